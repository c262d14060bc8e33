//! Sampler `adaptive`: holes first, then moving fronts, then tiles by the square root of their learned rate of change.
//!
//! A batch is filled in this order:
//!
//! 1. **Holes** ([`Canvas::holes`]), pixels of which nothing is known: at most 40 %, or the part of the picture that they are.
//! 2. **Fronts** ([`front`]), at most 60 % of the rest: neighbours of samples that found a change. Gated off where most of
//!    the picture changes, since there is nothing to follow then.
//! 3. **Refinement** ([`refine`]): more samples for what is at rest, as the control has it.
//! 4. **Tiles** ([`credit`]): by √v, with an even share for all.

mod credit;
mod front;
mod refine;
mod stage;

use crate::rates::Rates;
use crate::tile::TileGrid;
use crate::{Canvas, Insight, Observation, Request, Rng, Sampler, Time};
use credit::Credit;
use front::Front;
use refine::Refine;
pub use stage::AdaptiveStage;

/// Side of a tile, as a power of two: 8 pixels.
const TILE_BITS: u32 = 3;
/// The largest part of a batch that holes get, unless they are more than this part of the picture.
const HOLE_SHARE: f32 = 0.4;
/// The largest part of what holes leave that fronts get.
const FRONT_SHARE: f32 = 0.6;
/// A tile whose v is above this is hot: fronts are everywhere in it.
const HOT_RATE: f32 = 0.01;
/// Where this part of the tiles is hot fronts begin to lose their share; at twice as many they have none.
const HOT_PART: f32 = 0.2;

/// The default of [`Sampler::set_temporal`].
pub(crate) const DEFAULT_TEMPORAL: f32 = 0.5;

/// See the module.
pub struct Adaptive {
    temporal: f32,
    without: Option<AdaptiveStage>,
    rng: Rng,
    state: Option<State>,
}

/// What is known of one canvas.
struct State {
    generation: u32,
    rates: Rates,
    credit: Credit,
    front: Front,
    refine: Refine,
    front_share: f32,
    updates: u64,
    next_hole: usize,
    /// Samples given out too few.
    owed: f32,
    /// Why each pixel was asked for last.
    why: Vec<Why>,
}

#[derive(Clone, Copy, PartialEq)]
enum Why {
    Tile,
    Front,
    Hole,
}

impl Adaptive {
    /// `temporal` in [0, 1]: see [`Sampler::set_temporal`]. The same seed makes the same choices.
    pub fn new(temporal: f32, seed: u64) -> Adaptive {
        let (temporal, rng) = (temporal.clamp(0.0, 1.0), Rng::new(seed));
        Adaptive { temporal, without: None, rng, state: None }
    }

    /// The same with one stage left out, for experiments; `None`: with all of them.
    pub fn without(self, stage: Option<AdaptiveStage>) -> Adaptive {
        Adaptive { without: stage, ..self }
    }
}

impl State {
    fn new(canvas: &Canvas, without: Option<AdaptiveStage>, rng: &mut Rng) -> State {
        let grid = TileGrid::new(canvas.size(), 1 << TILE_BITS);
        State {
            generation: canvas.generation(),
            credit: Credit::new(grid.len(), TILE_BITS, without, rng),
            refine: Refine::new(&grid, TILE_BITS, rng),
            rates: Rates::new(grid),
            front: Front::new(canvas.size()),
            front_share: FRONT_SHARE,
            updates: 0,
            next_hole: 0,
            owed: 0.0,
            why: vec![Why::Tile; canvas.size().pixels()],
        }
    }

    fn take(&mut self, pixel: u32, why: Why, requests: &mut Vec<Request>) {
        self.why[pixel as usize] = why;
        requests.push(Request::centre(pixel));
    }

    fn choose_holes(&mut self, canvas: &Canvas, most: usize, requests: &mut Vec<Request>) {
        let end = requests.len() + most;
        while requests.len() < end {
            let Some(&pixel) = canvas.holes().get(self.next_hole) else { return };
            self.next_hole += 1;
            if canvas.still_waits(pixel) {
                self.take(pixel, Why::Hole, requests);
            }
        }
    }

    fn choose_fronts(&mut self, canvas: &Canvas, rest: usize, requests: &mut Vec<Request>) {
        let hot = self.rates.all().iter().filter(|&&rate| rate > HOT_RATE).count();
        let hot_part = hot as f32 / self.rates.all().len() as f32;
        self.front_share = FRONT_SHARE * (2.0 - hot_part / HOT_PART).clamp(0.0, 1.0);
        if self.front_share == 0.0 {
            self.front.clear();
            return;
        }
        let end = requests.len() + (self.front_share * rest as f32) as usize;
        while requests.len() < end {
            let Some(pixel) = self.front.next(canvas) else { return };
            self.take(pixel, Why::Front, requests);
        }
    }
}

impl Sampler for Adaptive {
    fn choose(&mut self, now: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>) {
        if self.state.as_ref().is_some_and(|state| state.generation != canvas.generation()) {
            self.state = None;
        }
        let without = self.without;
        let state = self.state.get_or_insert_with(|| State::new(canvas, without, &mut self.rng));
        let start = requests.len();
        if state.updates != canvas.updates() {
            state.updates = canvas.updates();
            state.next_hole = 0;
            state.refine.look(canvas, &state.rates);
        }
        let unknown = canvas.holes().len() as f32 / canvas.size().pixels() as f32;
        let hole_share = HOLE_SHARE.max(unknown);
        if without != Some(AdaptiveStage::Holes) {
            state.choose_holes(canvas, (hole_share * count as f32) as usize, requests);
        }
        if without != Some(AdaptiveStage::Fronts) {
            state.choose_fronts(canvas, count - (requests.len() - start), requests);
        }
        let State { credit, refine, rates, why, owed, .. } = state;
        let left = (count - (requests.len() - start)) as f32;
        let spatial = left * (1.0 - refine.temporal_part(self.temporal));
        if spatial > 0.0 {
            refine.draw(canvas, &rates.grid, spatial, |request| requests.push(request));
        }
        let before = requests.len();
        let rest = count as f32 - (before - start) as f32;
        credit.draw(now, canvas, rates, rest + *owed, |pixel| {
            why[pixel as usize] = Why::Tile;
            requests.push(Request::centre(pixel));
        });
        *owed += rest - (requests.len() - before) as f32;
    }

    fn observe(&mut self, canvas: &Canvas, observations: &[Observation]) {
        let Some(state) = self.state.as_mut().filter(|s| s.generation == canvas.generation())
        else {
            return;
        };
        for observed in observations {
            let tile = state.rates.grid.tile_of(observed.pixel);
            if let Some(refinement) = &observed.refinement {
                state.refine.observe(tile, refinement);
                if refinement.suspect {
                    state.front.suspect(observed);
                }
                continue;
            }
            let why = state.why[observed.pixel as usize];
            if !observed.known {
                continue;
            }
            let weight = match why {
                Why::Tile => 1.0,
                Why::Front => 0.5,
                Why::Hole => 0.0,
            };
            if weight > 0.0 {
                state.rates.observe(tile, observed, weight);
            }
            if state.front_share > 0.0 {
                state.front.observe(observed, canvas);
            }
        }
    }

    fn set_temporal(&mut self, temporal: f32) {
        self.temporal = temporal.clamp(0.0, 1.0);
    }

    fn rates(&self) -> Option<&Rates> {
        self.state.as_ref().map(|state| &state.rates)
    }

    fn inspect(&self, _now: Time, canvas: &Canvas) -> Insight {
        let of = |state: &&State| state.generation == canvas.generation();
        let Some(state) = self.state.as_ref().filter(of) else { return Insight::default() };
        let tiles = state.credit.shares(state.rates.all());
        let grid = &state.rates.grid;
        let pixels = 0..canvas.size().pixels() as u32;
        let tile_probability: Vec<f32> = pixels.map(|p| tiles[grid.tile_of(p)]).collect();
        let probability = tile_probability
            .iter()
            .enumerate()
            .map(|(pixel, share)| share / grid.rect(grid.tile_of(pixel as u32)).pixels() as f32);
        Insight { change: Vec::new(), probability: probability.collect(), tile_probability }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    fn choose(sampler: &mut Adaptive, canvas: &Canvas, count: usize) -> Vec<u32> {
        let mut requests = Vec::new();
        sampler.choose(Time(1), canvas, count, &mut requests);
        requests.iter().map(|request| request.pixel).collect()
    }

    #[test]
    fn first_draws_are_pinned() {
        let size = Size::new(64, 48);
        let canvas = Canvas::from_picture(size, vec![[0.0; 3]; size.pixels()]);
        assert_eq!(
            choose(&mut Adaptive::new(DEFAULT_TEMPORAL, 1), &canvas, 4),
            [645, 1986, 1638, 2459]
        );
    }

    #[test]
    fn without_rates_all_tiles_share_alike() {
        let size = Size::new(64, 64);
        let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; size.pixels()]);
        let mut counts = vec![0u32; 64];
        let mut sampler = Adaptive::new(DEFAULT_TEMPORAL, 3).without(Some(AdaptiveStage::Rates));
        for turn in 1..65u64 {
            let now = Time(turn * 1_000_000);
            let mut requests = Vec::new();
            sampler.choose(now, &canvas, 100, &mut requests);
            let observe = |request: &Request| {
                let pixel = request.pixel;
                let tile = TileGrid::new(size, 8).tile_of(pixel);
                counts[tile] += 1;
                let (previous, _) = canvas.replace(pixel, now, [0.0; 3]);
                let change = if tile == 0 { 0.002 } else { 0.0 };
                Observation { pixel, now, previous, known: true, change, refinement: None }
            };
            let observations: Vec<Observation> = requests.iter().map(observe).collect();
            sampler.observe(&canvas, &observations);
        }
        assert!(counts.iter().all(|count| count.abs_diff(100) <= 1), "{counts:?}");
    }

    #[test]
    fn a_new_picture_is_covered_evenly_from_coarse_to_fine() {
        let size = Size::new(64, 32);
        let canvas = Canvas::new(size);
        // 40 % of the samples go to holes: the first 8 · 2 pixels are one of every 16 × 8.
        let pixels = choose(&mut Adaptive::new(DEFAULT_TEMPORAL, 1), &canvas, 5 * 8);
        let mut blocks: Vec<(u32, u32)> =
            pixels[..16].iter().map(|&p| size.xy(p)).map(|(x, y)| (x / 16, y / 8)).collect();
        blocks.sort_unstable();
        blocks.dedup();
        assert_eq!(blocks.len(), 16);
    }

    #[test]
    fn samples_go_where_the_picture_changes_and_everywhere_else_as_well() {
        let size = Size::new(64, 64);
        let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; size.pixels()]);
        let mut sampler = Adaptive::new(DEFAULT_TEMPORAL, 3);
        let is_restless = |pixel: u32| size.xy(pixel).0 < 8 && size.xy(pixel).1 < 8;
        let mut counts = vec![0u32; size.pixels()];
        for turn in 1..400u64 {
            let now = Time(turn * 1_000_000);
            let mut requests = Vec::new();
            sampler.choose(now, &canvas, 100, &mut requests);
            let observe = |request: &Request| {
                let pixel = request.pixel;
                counts[pixel as usize] += 1;
                let (previous, _) = canvas.replace(pixel, now, [0.0; 3]);
                let change = if is_restless(pixel) { 0.002 } else { 0.0 };
                Observation { pixel, now, previous, known: true, change, refinement: None }
            };
            let observations: Vec<Observation> = requests.iter().map(observe).collect();
            sampler.observe(&canvas, &observations);
        }
        let restless: u32 = (0..4096).filter(|&p| is_restless(p)).map(|p| counts[p as usize]).sum();
        let total: u32 = counts.iter().sum();
        // √v of one tile against 63 at rest, with a fifth of the samples even: nearly all of the other four fifths.
        assert!(restless > total / 2 && restless < total * 17 / 20, "{restless} of {total}");
        assert!(counts.iter().all(|&count| count > 0), "a pixel was never looked at");
    }
}
