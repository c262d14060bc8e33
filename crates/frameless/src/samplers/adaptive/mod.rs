//! Sampler `adaptive`: holes first, then moving fronts, then tiles by the square root of their learned rate of change.
//!
//! A batch is filled in this order:
//!
//! 1. **Holes** ([`Canvas::holes`]), pixels of which nothing is known: at most 40 %, or the part of the picture that they are.
//! 2. **Fronts** ([`front`]), at most 60 % of the rest: neighbours of samples that found a change. Gated off where most of
//!    the picture changes, since there is nothing to follow then.
//! 3. **Late looks** ([`late`]), in the last batches before a refresh: at most 40 % of the rest, gated as fronts are.
//! 4. **Refinement** ([`refine`]): more samples for what is at rest, as the control has it.
//! 5. **Tiles** ([`credit`]): by √v, with an even share for all.
//!
//! All but the even share is weighted by what counts more in the picture ([`weights`]): of holes, fronts and late looks where it counts
//! less than on average some are passed over; such holes come after the others.

mod block;
mod credit;
mod flow;
mod front;
mod late;
mod order;
mod refine;
mod shares;
mod stage;
mod tiles;
mod weights;
mod why;

use std::collections::VecDeque;

use crate::rates::Rates;
use crate::tile::TileGrid;
use crate::traced::Place;
use crate::wide::{self, Task, Unit};
use crate::{Canvas, Insight, Observation, Refinement, Request, Rng, Sampler, Time, Weights};
use credit::{ByRate, Credit};
use front::Front;
use late::Late;
use refine::Refine;
pub use stage::AdaptiveStage;
use tiles::Tiles;
use weights::TileWeights;
use why::Why;

/// Side of a tile, as a power of two: 8 pixels.
const TILE_BITS: u32 = 3;
/// The largest part of a batch that holes get, unless they are more than this part of the picture.
const HOLE_SHARE: f32 = 0.4;
/// The largest part of what holes leave that fronts get.
const FRONT_SHARE: f32 = 0.6;
/// The least part of what holes, fronts and late looks leave that is spread evenly over the picture.
const LEAST_EVEN: f32 = 0.03;
/// A tile whose v is above this is hot: fronts are everywhere in it.
const HOT_RATE: f32 = 0.01;
/// Where this part of the tiles is hot fronts begin to lose their share; at twice as many they have none.
const HOT_PART: f32 = 0.2;

/// How many holes ahead of the one at hand the next is fetched from memory: enough for a few dozen nanoseconds each.
const AHEAD: usize = 32;
/// What so many observations change is fetched at once.
const FEW: usize = 64;

/// The default of [`Sampler::set_temporal`].
pub(crate) const DEFAULT_TEMPORAL: f32 = 0.5;

/// See the module.
pub struct Adaptive {
    temporal: f32,
    weights: Weights,
    without: Option<AdaptiveStage>,
    rng: Rng,
    state: Option<State>,
}

/// What is known of one canvas.
struct State {
    generation: u32,
    rates: Rates,
    tiles: Tiles,
    credit: Credit,
    front: Front,
    late: Late,
    refine: Refine,
    weights: TileWeights,
    front_share: f32,
    /// How many tiles are hot.
    hot: usize,
    updates: u64,
    next_hole: usize,
    /// Holes that were passed over, since they count less.
    later_holes: VecDeque<u32>,
    /// Samples given out too few.
    owed: f32,
}

impl Adaptive {
    /// `temporal` in [0, 1]: see [`Sampler::set_temporal`]. The same seed makes the same choices.
    pub fn new(temporal: f32, seed: u64) -> Adaptive {
        let (temporal, rng) = (temporal.clamp(0.0, 1.0), Rng::new(seed));
        Adaptive { temporal, weights: Weights::default(), without: None, rng, state: None }
    }

    /// The same with one stage left out, for experiments; `None`: with all of them.
    pub fn without(self, stage: Option<AdaptiveStage>) -> Adaptive {
        Adaptive { without: stage, ..self }
    }
}

impl State {
    fn new(
        canvas: &Canvas,
        weights: &Weights,
        without: Option<AdaptiveStage>,
        rng: &mut Rng,
    ) -> State {
        let grid = TileGrid::new(canvas.size(), 1 << TILE_BITS);
        let mut tiles = Tiles::new(grid.len());
        let mut state = State {
            generation: canvas.generation(),
            credit: Credit::new(&mut tiles, grid.len(), without, rng),
            refine: Refine::new(&grid, rng),
            weights: TileWeights::new(weights, &grid),
            front: Front::new(),
            tiles,
            rates: Rates::new(grid),
            late: Late::new(),
            front_share: FRONT_SHARE,
            hot: 0,
            updates: 0,
            next_hole: 0,
            later_holes: VecDeque::new(),
            owed: 0.0,
        };
        state.weigh_all();
        state
    }

    /// What tiles count has changed.
    fn weigh_all(&mut self) {
        self.credit.weigh_all(&ByRate { rates: &self.rates, m: self.weights.of_tiles() });
        self.refine.weigh_all(|tile| self.weights.of_tile(tile));
    }

    /// Looks at the canvas anew, after a reconstruction has said what its pixels show.
    fn look(&mut self, canvas: &Canvas) {
        self.updates = canvas.updates();
        self.next_hole = 0;
        self.late.look(canvas);
        self.later_holes.clear();
        if self.weights.look(canvas, &self.rates.grid) {
            self.weigh_all();
        }
        self.refine.look(canvas, &self.rates, &self.tiles, |tile| self.weights.of_tile(tile));
    }

    fn take(&mut self, pixel: u32, why: Why, requests: &mut Vec<Request>) {
        self.tiles.set_why(self.rates.grid.place(pixel), why);
        requests.push(Request::centre(pixel));
    }

    fn choose_holes(&mut self, canvas: &Canvas, most: usize, requests: &mut Vec<Request>) {
        let end = requests.len() + most;
        while requests.len() < end {
            let Some(&pixel) = canvas.holes().get(self.next_hole) else { break };
            self.next_hole += 1;
            if let Some(&later) = canvas.holes().get(self.next_hole + AHEAD) {
                let place = self.rates.grid.place(later);
                canvas.traced().prefetch(place);
                self.tiles.prefetch(place.tile());
            }
            if canvas.still_waits(pixel) {
                match self.weights.lets_pass(&self.rates.grid, pixel) {
                    true => self.take(pixel, Why::Hole, requests),
                    false => self.later_holes.push_back(pixel),
                }
            }
        }
        while requests.len() < end {
            let Some(pixel) = self.later_holes.pop_front() else { return };
            if canvas.still_waits(pixel) {
                self.take(pixel, Why::Hole, requests);
            }
        }
    }

    fn choose_fronts(
        &mut self,
        now: Time,
        rest: usize,
        temporal: f32,
        requests: &mut Vec<Request>,
    ) {
        let hot_part = self.hot as f32 / self.rates.grid.len() as f32;
        self.front_share =
            wanted(temporal) * FRONT_SHARE * (2.0 - hot_part / HOT_PART).clamp(0.0, 1.0);
        if self.front_share == 0.0 {
            self.front.clear(&mut self.tiles);
            return;
        }
        let end = requests.len() + (self.front_share * rest as f32) as usize;
        let State { front, tiles, weights, rates, .. } = self;
        let grid = &rates.grid;
        let all_followed = front.follow(tiles, grid, |tile, mut pixels| {
            let (corner, mut taken) = (grid.corner(tile), 0);
            while pixels != 0 && requests.len() < end {
                let bit = pixels & pixels.wrapping_neg();
                pixels ^= bit;
                let pixel = corner + grid.step(bit.trailing_zeros() as usize);
                if weights.lets_pass(grid, pixel) {
                    taken |= bit;
                    requests.push(Request::centre(pixel));
                }
            }
            [taken, pixels]
        });
        front.adapt(now, all_followed);
    }

    fn choose_late(
        &mut self,
        now: Time,
        canvas: &Canvas,
        rest: usize,
        requests: &mut Vec<Request>,
    ) {
        // As fronts: where everything changes, edges of shadows are not what is wrong most.
        let wanted = self.front_share / FRONT_SHARE;
        let State { late, weights, rates, tiles, .. } = self;
        late.choose(now, canvas, rest, wanted, |pixel| {
            if weights.lets_pass(&rates.grid, pixel) {
                tiles.set_why(rates.grid.place(pixel), Why::Late);
                requests.push(Request::centre(pixel));
            }
        });
    }
}

/// Who would rather finish what is there lets what changes wait: a part of its share, in [0, 1].
fn wanted(temporal: f32) -> f32 {
    (temporal / DEFAULT_TEMPORAL).min(1.0)
}

/// Learning.
impl State {
    /// Begin to fetch what an observation will change.
    #[inline(always)]
    fn fetch(&self, observed: &Observation, tile: usize) {
        if observed.refinement.is_some() {
            self.refine.prefetch(tile);
            return;
        }
        self.tiles.prefetch(tile);
    }

    fn observe_refinement(&mut self, place: Place, n: u16, refinement: &Refinement) {
        let tile = place.tile();
        self.refine.observe(tile, n, refinement, self.weights.of_tile(tile));
        if refinement.suspect {
            self.front.suspect(&mut self.tiles, place);
        }
    }

    #[inline(always)]
    fn observe_sample(&mut self, observed: &Observation, place: Place) {
        let number = place.tile();
        let tile = self.tiles.of_mut(number);
        tile.front.traced(place.within());
        tile.recent.traced(place.within());
        if !observed.known {
            return;
        }
        let why = tile.reasons.of(place.within());
        self.front.hear(observed, place, why);
        let weight = match why {
            Why::Tile => 1.0,
            Why::Front => 0.5,
            Why::Hole | Why::Late => return,
        };
        let age_secs = observed.now.secs_since(observed.previous) as f32;
        tile.observe_age(age_secs);
        let after = tile.evidence.observe(observed.change, age_secs, weight);
        let before = self.rates.set(number, after);
        self.credit.touch(number);
        self.hot += usize::from(after > HOT_RATE);
        self.hot -= usize::from(before > HOT_RATE);
    }
}

/// See [`Sampler::observe`].
struct Hear<'a> {
    state: &'a mut State,
    canvas: &'a Canvas,
    observations: &'a [Observation],
}

impl Task for Hear<'_> {
    #[inline(always)]
    fn run<U: Unit>(self) {
        let Hear { state, canvas, observations } = self;
        let mut places = [Place::default(); FEW];
        for few in observations.chunks(FEW) {
            // What will be changed is fetched before, all over the picture.
            for (place, observed) in places.iter_mut().zip(few) {
                *place = state.rates.grid.place(observed.pixel);
                state.fetch(observed, place.tile());
            }
            for (&place, observed) in places.iter().zip(few) {
                match &observed.refinement {
                    None => state.observe_sample(observed, place),
                    Some(refinement) => {
                        let n = canvas.samples()[observed.pixel as usize];
                        state.observe_refinement(place, n, refinement);
                    }
                }
            }
        }
    }
}

impl Sampler for Adaptive {
    fn choose(&mut self, now: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>) {
        if self.state.as_ref().is_some_and(|state| state.generation != canvas.generation()) {
            self.state = None;
        }
        let without = self.without;
        let new = || State::new(canvas, &self.weights, without, &mut self.rng);
        let state = self.state.get_or_insert_with(new);
        let start = requests.len();
        if state.updates != canvas.updates() {
            state.look(canvas);
        }
        let unknown = canvas.holes().len() as f32 / canvas.size().pixels() as f32;
        // A pixel may wait for two reasons.
        let hole_share = HOLE_SHARE.max(unknown).min(1.0);
        if without != Some(AdaptiveStage::Holes) {
            state.choose_holes(canvas, (hole_share * count as f32) as usize, requests);
        }
        if without != Some(AdaptiveStage::Fronts) {
            let rest = count - (requests.len() - start);
            state.choose_fronts(now, rest, self.temporal, requests);
        }
        if without != Some(AdaptiveStage::Late) {
            let rest = count - (requests.len() - start);
            state.choose_late(now, canvas, rest, requests);
        }
        let State { credit, refine, rates, tiles, weights, owed, .. } = state;
        let left = (count - (requests.len() - start)) as f32;
        let spatial = left * (1.0 - refine.temporal_part(self.temporal));
        if spatial > 0.0 {
            refine.draw(canvas, &rates.grid, spatial, |request| requests.push(request));
        }
        let before = requests.len();
        let rest = count as f32 - (before - start) as f32;
        let counts = [rest + *owed, LEAST_EVEN * left];
        let weights = ByRate { rates, m: weights.of_tiles() };
        credit.draw(&weights, tiles, counts, requests);
        *owed += rest - (requests.len() - before) as f32;
    }

    fn observe(&mut self, canvas: &Canvas, observations: &[Observation]) {
        let Some(state) = self.state.as_mut().filter(|s| s.generation == canvas.generation())
        else {
            return;
        };
        state.front.expect(observations.len());
        wide::run(Hear { state, canvas, observations });
        if state.front_share > 0.0 {
            state.front.observe(&mut state.tiles, canvas);
        }
    }

    fn set_temporal(&mut self, temporal: f32) {
        self.temporal = temporal.clamp(0.0, 1.0);
    }

    /// Contrast and flow count from the next refresh on.
    fn set_weights(&mut self, weights: &Weights) {
        self.weights = weights.clone();
        if let Some(state) = &mut self.state {
            state.weights = TileWeights::new(weights, &state.rates.grid);
            state.weigh_all();
        }
    }

    fn refines(&self) -> bool {
        true
    }

    fn wants_motion(&self) -> bool {
        self.weights.flow != 0.0
    }

    fn rates(&self) -> Option<&Rates> {
        self.state.as_ref().map(|state| &state.rates)
    }

    fn inspect(&self, _now: Time, canvas: &Canvas) -> Insight {
        let of = |state: &&State| state.generation == canvas.generation();
        let Some(state) = self.state.as_ref().filter(of) else { return Insight::default() };
        let weights = ByRate { rates: &state.rates, m: state.weights.of_tiles() };
        let tiles = state.credit.shares(&weights);
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
            [774, 1541, 1874, 1760, 2267]
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
    fn probabilities_sum_to_one_whatever_was_observed_since_the_last_draw() {
        let size = Size::new(60, 44);
        let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; size.pixels()]);
        let mut sampler = Adaptive::new(DEFAULT_TEMPORAL, 5);
        for turn in 1..20u64 {
            let now = Time(turn * 1_000_000);
            let chosen = choose(&mut sampler, &canvas, 200);
            let observe = |pixel: u32| {
                let (previous, _) = canvas.replace(pixel, now, [0.0; 3]);
                let change = if pixel < 600 { 0.3 } else { 0.0 };
                Observation { pixel, now, previous, known: true, change, refinement: None }
            };
            let observations: Vec<Observation> = chosen.into_iter().map(observe).collect();
            sampler.observe(&canvas, &observations);
            let sum: f32 = sampler.inspect(now, &canvas).probability.iter().sum();
            assert!((sum - 1.0).abs() < 1e-4, "{sum} at turn {turn}");
        }
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
    fn pixels_that_wait_twice_take_no_more_than_the_batch() {
        let size = Size::new(64, 32);
        let mut canvas = Canvas::new(size);
        let holes: Vec<u32> = (0..2048).chain(0..1024).collect();
        canvas.update(Time(1), canvas.traced().tiles().to_vec(), holes);
        for count in [1, 100, 2000] {
            let chosen = choose(&mut Adaptive::new(DEFAULT_TEMPORAL, 1), &canvas, count).len();
            assert!(chosen.abs_diff(count) <= 1, "{chosen} of {count}");
        }
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

    /// How often each tile of 8×8 is looked at, of `turns` · 100 samples in a picture that changes alike everywhere.
    fn looked_at(sampler: &mut Adaptive, turns: u64) -> Vec<u32> {
        let size = Size::new(64, 64);
        let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; size.pixels()]);
        let mut counts = vec![0; 64];
        for turn in 1..=turns {
            let now = Time(turn * 1_000_000);
            let mut requests = Vec::new();
            sampler.choose(now, &canvas, 100, &mut requests);
            let observe = |request: &Request| {
                let pixel = request.pixel;
                let (x, y) = size.xy(pixel);
                counts[(y / 8 * 8 + x / 8) as usize] += 1;
                let (previous, _) = canvas.replace(pixel, now, [0.0; 3]);
                Observation { pixel, now, previous, known: true, change: 1e-3, refinement: None }
            };
            let observations: Vec<Observation> = requests.iter().map(observe).collect();
            sampler.observe(&canvas, &observations);
        }
        counts
    }

    #[test]
    fn what_counts_nothing_keeps_its_floor() {
        let mut values = vec![0.0; 64];
        values[9] = 1.0;
        let weights = Weights::default().with_importance(8, 8, values).expect("valid");
        let mut sampler = Adaptive::new(DEFAULT_TEMPORAL, 3);
        sampler.set_weights(&weights);
        let counts = looked_at(&mut sampler, 400);
        // A fifth of 40 000 samples, spread over 64 tiles, but for a credit that may be under way.
        for (tile, &count) in counts.iter().enumerate().filter(|(tile, _)| *tile != 9) {
            assert!((123..=127).contains(&count), "tile {tile}: {count}");
        }
        assert!(counts[9] > 31_000, "{}", counts[9]);
    }

    #[test]
    fn weights_that_are_off_again_leave_what_was_learned() {
        let mut sampler = Adaptive::new(DEFAULT_TEMPORAL, 3);
        looked_at(&mut sampler, 100);
        let rates = |sampler: &Adaptive| -> Vec<f32> {
            let learned = sampler.rates().expect("learned");
            (0..64).map(|tile| learned.of_tile(tile)).collect()
        };
        let learned = rates(&sampler);
        let weights = Weights::default().with_importance(1, 2, vec![1.0, 9.0]).expect("valid");
        sampler.set_weights(&weights);
        let canvas = Canvas::from_picture(Size::new(64, 64), vec![[0.0; 3]; 4096]);
        let shares = |sampler: &Adaptive| sampler.inspect(Time(0), &canvas).tile_probability;
        let weighted = shares(&sampler);
        assert!(weighted[4095] > 1.5 * weighted[0]);
        sampler.set_weights(&Weights::default());
        let plain = shares(&sampler);
        assert!(plain[4095] < 1.5 * plain[0]);
        assert_eq!(rates(&sampler), learned);
    }

    #[test]
    fn holes_that_count_less_come_after_the_others() {
        let size = Size::new(16, 8);
        let canvas = Canvas::new(size);
        let mut sampler = Adaptive::new(DEFAULT_TEMPORAL, 1);
        sampler
            .set_weights(&Weights::default().with_importance(2, 1, vec![0.0, 1.0]).expect("valid"));
        let is_right = |pixel: &u32| pixel % 16 >= 8;
        let pixels = choose(&mut sampler, &canvas, 128);
        assert!(pixels[..64].iter().all(is_right), "those that count");
        assert!(!pixels[64..].iter().any(is_right), "then all others");
    }

    /// Plays 400 ms with 100 samples each; of pixels for which `is_restless` says so every sample differs by `change`.
    fn play(sampler: &mut Adaptive, is_restless: fn(u32) -> bool, change: f32) {
        let size = Size::new(64, 64);
        let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; size.pixels()]);
        for turn in 1..400u64 {
            let now = Time(turn * 1_000_000);
            let mut requests = Vec::new();
            sampler.choose(now, &canvas, 100, &mut requests);
            let observe = |&Request { pixel, .. }: &Request| {
                let (previous, _) = canvas.replace(pixel, now, [0.0; 3]);
                let change = if is_restless(pixel) { change } else { 0.0 };
                Observation { pixel, now, previous, known: true, change, refinement: None }
            };
            let observations: Vec<Observation> = requests.iter().map(observe).collect();
            sampler.observe(&canvas, &observations);
        }
    }

    #[test]
    fn fronts_look_again_sooner_where_samples_are_left_and_end_where_everything_changes() {
        let mut sampler = Adaptive::new(DEFAULT_TEMPORAL, 1);
        play(&mut sampler, |pixel| pixel == 2080, 0.5);
        let state = sampler.state.as_ref().expect("chosen");
        assert!(state.front.fresh_secs() < 2e-3, "{}", state.front.fresh_secs());
        assert_eq!(state.front_share, FRONT_SHARE);
        let mut sampler = Adaptive::new(DEFAULT_TEMPORAL, 1);
        play(&mut sampler, |_| true, 0.5);
        assert_eq!(sampler.state.as_ref().expect("chosen").front_share, 0.0);
    }

    #[test]
    fn late_looks_obey_the_control() {
        let size = Size::new(64, 64);
        let late = |temporal: f32| {
            let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; size.pixels()]);
            let mut sampler = Adaptive::new(temporal, 1);
            let mut requests = Vec::new();
            for millis in 0..48u64 {
                let now = Time(millis * 1_000_000);
                if millis % 16 == 0 {
                    canvas.update(now, canvas.traced().tiles().to_vec(), Vec::new());
                    canvas.set_last_minute(&mut (0..200).collect());
                }
                sampler.choose(now, &canvas, 100, &mut requests);
            }
            let tiles = &sampler.state.as_ref().expect("chosen").tiles;
            let grid = canvas.traced().grid();
            let why = |place: Place| tiles.of(place.tile()).reasons.of(place.within());
            (0..200).filter(|&pixel| why(grid.place(pixel)) == Why::Late).count()
        };
        assert!(late(DEFAULT_TEMPORAL) > 150, "{}", late(DEFAULT_TEMPORAL));
        assert_eq!(late(0.0), 0);
    }
}
