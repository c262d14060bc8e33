//! Sampler `change`: Dayal, Watson and Luebke, "Improving frameless rendering by focusing on change", SIGGRAPH 2002 sketch.
//!
//! For pixel p of n, with newₖ and oldₖ its last two colours in display-referred sRGB and t_p its last time:
//!
//! ```text
//! d_p  = Σₖ (newₖ − oldₖ)²                       change, set whenever p is traced
//! a_p  = t − t_p                                 age
//! P(p) = w_d · d_p / Σd + w_a · a_p / Σa,        w_d + w_a = 1
//! P(T) = Σ_{p∈T} P(p)                            over square tiles
//! ```
//!
//! A tile is drawn by P(T), then a pixel inside it by the bilinear interpolation of the tile probabilities
//! ([`crate::tile_pdf`]).
//!
//! Degenerate cases: Σd = 0 puts all weight on age; Σa = 0 (everything traced just now) all weight on change; both
//! zero: every pixel is equally likely. One tile: uniform inside it.

use crate::tile::TileGrid;
use crate::tile_pdf::TilePdf;
use crate::{Canvas, Insight, Observation, Request, Rng, Sampler, Time};

/// Default weight of change; 1 − w_d is the weight of age. See docs/evaluation.md for the scan. Larger: trails are left
/// behind moving objects, since nothing returns to pixels that have changed once; smaller: samples are
/// wasted where nothing happens.
pub const DEFAULT_W_D: f32 = 0.9;

/// Default side of a tile in pixels. Larger tiles blur where the change is. Small ones (4) find a change late that
/// moves into tiles where nothing has changed yet: they serve as well where everything changes, and twice as badly
/// where little does (docs/evaluation.md).
pub const DEFAULT_TILE: u32 = 16;

/// The 2002 sketch, exactly.
pub struct Change {
    w_d: f32,
    tile: u32,
    rng: Rng,
    known: Option<Known>,
}

/// What is known of one canvas.
struct Known {
    generation: u32,
    updates: u64,
    sums: Sums,
    pdf: TilePdf,
}

impl Change {
    /// `w_d` is clamped to [0, 1], the `tile` side to at least 1 pixel. The same seed makes the same choices.
    pub fn new(w_d: f32, tile: u32, seed: u64) -> Change {
        let w_d = if w_d.is_nan() { DEFAULT_W_D } else { w_d.clamp(0.0, 1.0) };
        Change { w_d, tile: tile.max(1), rng: Rng::new(seed), known: None }
    }
}

impl Known {
    fn is_of(&self, canvas: &Canvas) -> bool {
        self.generation == canvas.generation() && self.sums.grid.size == canvas.size()
    }

    fn from_scratch(canvas: &Canvas, tile: u32) -> Known {
        let sums = Sums::from_scratch(canvas, tile, &[]);
        let pdf = TilePdf::new(&sums.grid);
        Known { generation: canvas.generation(), updates: canvas.updates(), pdf, sums }
    }

    /// Ages have changed without a sample; what each pixel's last sample changed has not.
    fn update(&mut self, canvas: &Canvas) {
        if self.updates != canvas.updates() {
            self.updates = canvas.updates();
            self.sums = Sums::from_scratch(canvas, self.sums.grid.side, &self.sums.change);
        }
    }
}

impl Sampler for Change {
    fn choose(&mut self, now: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>) {
        if self.known.as_ref().is_some_and(|known| !known.is_of(canvas)) {
            self.known = None;
        }
        let known = self.known.get_or_insert_with(|| Known::from_scratch(canvas, self.tile));
        known.update(canvas);
        known.sums.tile_probability(now, self.w_d, &mut known.pdf.probability);
        known.pdf.draw(&mut self.rng, count, requests);
    }

    fn observe(&mut self, canvas: &Canvas, observations: &[Observation]) {
        // Before the first choice there is nothing to update: the sums will be made from the canvas.
        let Some(known) = self.known.as_mut().filter(|known| known.is_of(canvas)) else { return };
        for observation in observations {
            known.sums.update(observation);
        }
    }

    fn inspect(&self, now: Time, canvas: &Canvas) -> Insight {
        let Some(known) = self.known.as_ref().filter(|known| known.is_of(canvas)) else {
            return Insight::default();
        };
        let sums = &known.sums;
        let mut pdf = TilePdf::new(&sums.grid);
        sums.tile_probability(now, self.w_d, &mut pdf.probability);
        let pixels = 0..canvas.size().pixels() as u32;
        Insight {
            change: sums.change.iter().map(|&d| unfixed(u64::from(d)) as f32).collect(),
            probability: pdf.pixel_probability(),
            tile_probability: pixels.map(|p| pdf.probability[sums.grid.tile_of(p)]).collect(),
        }
    }
}

/// d_p of every pixel, and the sums of d_p and t_p over every tile, kept up to date sample by sample.
///
/// All integers: a sum updated for hours equals the sum from scratch exactly.
#[derive(Clone, Debug, PartialEq)]
struct Sums {
    grid: TileGrid,
    /// d_p in units of 2⁻³⁰.
    change: Vec<u32>,
    /// Σ_{p∈T} d_p in the same units.
    tile_change: Vec<u64>,
    /// Σ_{p∈T} t_p in nanoseconds, modulo 2⁶⁴: only differences that fit are ever used.
    tile_time: Vec<u64>,
    tile_pixels: Vec<u32>,
}

const FIXED_ONE: f32 = (1u32 << 30) as f32;

/// d ∈ [0, 3] as a multiple of 2⁻³⁰: finer than an f32 near 1, and 3 fits.
fn fixed(d: f32) -> u32 {
    (d * FIXED_ONE) as u32
}

fn unfixed(sum: u64) -> f64 {
    sum as f64 / f64::from(FIXED_ONE)
}

impl Sums {
    /// `change` holds d_p in fixed point; empty: no change anywhere.
    fn from_scratch(canvas: &Canvas, tile: u32, change: &[u32]) -> Sums {
        let grid = TileGrid::new(canvas.size(), tile);
        let mut sums = Sums {
            change: if change.is_empty() {
                vec![0; canvas.size().pixels()]
            } else {
                change.to_vec()
            },
            tile_change: vec![0; grid.len()],
            tile_time: vec![0; grid.len()],
            tile_pixels: (0..grid.len()).map(|t| grid.rect(t).pixels()).collect(),
            grid,
        };
        for (pixel, time) in canvas.time().enumerate() {
            let tile = sums.grid.tile_of(pixel as u32);
            sums.tile_time[tile] = sums.tile_time[tile].wrapping_add(time.0);
            sums.tile_change[tile] += u64::from(sums.change[pixel]);
        }
        sums
    }

    #[inline]
    fn update(&mut self, observed: &Observation) {
        let tile = self.grid.tile_of(observed.pixel);
        let new = fixed(observed.change);
        let old = std::mem::replace(&mut self.change[observed.pixel as usize], new);
        self.tile_change[tile] = self.tile_change[tile] + u64::from(new) - u64::from(old);
        let aged = observed.now.0.wrapping_sub(observed.previous.0);
        self.tile_time[tile] = self.tile_time[tile].wrapping_add(aged);
    }

    /// P(T) = w_d · D_T / Σd + w_a · A_T / Σa, with A_T = n_T · t − Σ_{p∈T} t_p: ages need no update as time passes.
    fn tile_probability(&self, now: Time, w_d: f32, probability: &mut Vec<f32>) {
        let age = |tile: usize| {
            (u64::from(self.tile_pixels[tile]).wrapping_mul(now.0))
                .wrapping_sub(self.tile_time[tile])
        };
        let change_sum = self.tile_change.iter().sum::<u64>() as f64;
        let age_sum: f64 = (0..self.grid.len()).map(|tile| age(tile) as f64).sum();
        probability.clear();
        if change_sum == 0.0 && age_sum == 0.0 {
            let n = self.grid.size.pixels() as f32;
            probability.extend(self.tile_pixels.iter().map(|&pixels| pixels as f32 / n));
            return;
        }
        let w_d = match (change_sum > 0.0, age_sum > 0.0) {
            (true, true) => f64::from(w_d),
            (true, false) => 1.0,
            (false, _) => 0.0,
        };
        let per_change = if change_sum > 0.0 { w_d / change_sum } else { 0.0 };
        let per_age = if age_sum > 0.0 { (1.0 - w_d) / age_sum } else { 0.0 };
        probability.extend((0..self.grid.len()).map(|tile| {
            (self.tile_change[tile] as f64 * per_change + age(tile) as f64 * per_age) as f32
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    fn observation(pixel: u32, now: Time, previous: Time, change: f32) -> Observation {
        Observation { pixel, now, previous, known: true, change, refinement: None }
    }

    #[test]
    fn first_draws_are_pinned() {
        let canvas = Canvas::new(Size::new(512, 384));
        let mut requests = Vec::new();
        Change::new(DEFAULT_W_D, DEFAULT_TILE, 1).choose(Time(1), &canvas, 4, &mut requests);
        let pixels: Vec<u32> = requests.iter().map(|r| r.pixel).collect();
        assert_eq!(pixels, [44756, 46433, 91068, 116122]);
    }

    #[test]
    fn a_million_updates_equal_the_sums_from_scratch() {
        let size = Size::new(101, 67);
        let mut canvas = Canvas::new(size);
        let mut sums = Sums::from_scratch(&canvas, 16, &[]);
        let mut rng = Rng::new(7);
        let mut d = vec![0; size.pixels()];
        for i in 0..1_000_000u64 {
            let (pixel, now) = (rng.below(size.pixels() as u32), Time(i * 1111));
            let (previous, _) = canvas.replace(pixel, now, [0.0; 3]);
            let change = if rng.below(3) == 0 { 3.0 * rng.unit_f32() } else { 0.0 };
            sums.update(&observation(pixel, canvas.time_of(pixel), previous, change));
            d[pixel as usize] = fixed(change);
        }
        assert_eq!(sums, Sums::from_scratch(&canvas, 16, &d));
    }

    #[test]
    fn a_resize_there_and_back_between_two_choices_starts_from_scratch() {
        let (size, other) = (Size::new(40, 30), Size::new(20, 15));
        let mut canvas = Canvas::new(size);
        let mut sampler = Change::new(DEFAULT_W_D, 8, 1);
        let mut requests = Vec::new();
        sampler.choose(Time(1), &canvas, 500, &mut requests);
        let observe = |request: &Request| {
            let (previous, _) = canvas.replace(request.pixel, Time(50_000), [0.5; 3]);
            observation(request.pixel, canvas.time_of(request.pixel), previous, 0.75)
        };
        let observations: Vec<Observation> = requests.iter().map(observe).collect();
        sampler.observe(&canvas, &observations);
        let canvas = canvas.resized(other).resized(size);
        sampler.choose(Time(100_000), &canvas, 1, &mut requests);
        let known = sampler.known.as_ref().expect("made by the choice");
        assert_eq!(known.sums, Sums::from_scratch(&canvas, 8, &[]));
    }

    #[test]
    fn tile_probability_is_the_papers_sum_over_pixels() {
        let (size, w_d) = (Size::new(9, 7), 0.9f32);
        let mut canvas = Canvas::new(size);
        let mut sums = Sums::from_scratch(&canvas, 4, &[]);
        let mut rng = Rng::new(11);
        let mut d = vec![0.0f64; size.pixels()];
        for i in 0..40u64 {
            let pixel = rng.below(size.pixels() as u32);
            let (now, change) = (Time((100 + i) << 14), rng.unit_f32());
            let (previous, _) = canvas.replace(pixel, now, [0.0; 3]);
            sums.update(&observation(pixel, now, previous, change));
            d[pixel as usize] = f64::from(change);
        }
        // The formulas of the paper, pixel by pixel.
        let now = Time(200 << 14);
        let age: Vec<f64> = canvas.time().map(|t| now.secs_since(t)).collect();
        let (d_sum, a_sum): (f64, f64) = (d.iter().sum(), age.iter().sum());
        let w_d = f64::from(w_d);
        let mut want = vec![0.0; 6];
        for y in 0..7 {
            for x in 0..9 {
                let p = (y * 9 + x) as usize;
                want[(y / 4 * 3 + x / 4) as usize] +=
                    w_d * d[p] / d_sum + (1.0 - w_d) * age[p] / a_sum;
            }
        }
        let mut got = Vec::new();
        sums.tile_probability(now, w_d as f32, &mut got);
        assert_eq!(got.len(), want.len());
        for (tile, (&got, &want)) in got.iter().zip(&want).enumerate() {
            assert!((f64::from(got) - want).abs() < 1e-6, "tile {tile}: {got}, want {want}");
        }
    }

    #[test]
    fn without_change_all_weight_is_on_age_and_without_age_on_change() {
        let canvas = Canvas::new(Size::new(8, 4));
        let mut sums = Sums::from_scratch(&canvas, 4, &[]);
        let mut p = Vec::new();
        sums.tile_probability(Time::ZERO, 0.9, &mut p);
        assert_eq!(p, [0.5, 0.5], "nothing known: every pixel is equally likely");

        (0..8).for_each(|i| sums.update(&observation(i / 4 * 8 + i % 4, Time(100), Time(0), 0.0)));
        sums.tile_probability(Time(200), 0.9, &mut p);
        let want = [(8 * 100 + 8 * 200) as f32 / 5600.0, 16.0 * 200.0 / 5600.0];
        assert_eq!(p, want, "no change: by age alone");

        (0..32).for_each(|i| {
            let previous = if i % 8 < 4 && i < 16 { 100 } else { 0 };
            sums.update(&observation(
                i,
                Time(300),
                Time(previous),
                if i % 8 < 4 { 1.0 } else { 0.0 },
            ));
        });
        sums.tile_probability(Time(300), 0.9, &mut p);
        assert_eq!(p, [1.0, 0.0], "no age: by change alone");
    }

    #[test]
    fn scheduling_memory_is_at_most_32_bytes_per_pixel() {
        let canvas = Canvas::new(Size::new(512, 384));
        let mut sampler = Change::new(DEFAULT_W_D, DEFAULT_TILE, 1);
        sampler.choose(Time(1), &canvas, 10_000, &mut Vec::new());
        let Known { sums, pdf, .. } = sampler.known.as_ref().expect("made by the first choice");
        let bytes = size_of_val(&sums.change[..])
            + size_of_val(&sums.tile_change[..])
            + size_of_val(&sums.tile_time[..])
            + size_of_val(&sums.tile_pixels[..])
            + size_of_val(&pdf.probability[..])
            + size_of_val(canvas.traced().tiles());
        let per_pixel = bytes as f64 / canvas.size().pixels() as f64;
        assert!(per_pixel <= 32.0, "{per_pixel} bytes per pixel");
        assert!(
            (8.0..8.2).contains(&per_pixel),
            "docs/performance.md says 8.1, this is {per_pixel}"
        );
    }
}
