//! The picture from the carried samples.
//!
//! ```text
//! e_j = v · age_j + s · dist_j²         expected squared error of sample j at a pixel's centre
//! w_j = 1 / (e_j + ε)²                  over the samples of the reference's object
//! ```
//!
//! The reference is the pixel's own sample with the least expected error. Pixels without one are holes: beside samples they show
//! the mean of those around that belong to the nearest one's object, farther away what the nearest pixel shows that is no hole
//! ([`fill`](super::fill)).

use super::fill;
use super::store::{EMPTY, Store, Tick};
use crate::Time;
use crate::rates::Rates;
use crate::wide::{self, F8, M8};

/// Whether a pixel had a sample of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Hole {
    No,
    /// There is one, but not at the pixel's centre, and nothing moves that could have carried it there.
    OffCentre,
    /// Neighbours know enough for a good guess.
    Small,
    /// Nothing near is known.
    Large,
}

impl Hole {
    pub(super) fn is_unknown(self) -> bool {
        matches!(self, Hole::Small | Hole::Large)
    }
}

#[derive(Default)]
pub(super) struct Gather {
    holes: Vec<Hole>,
    empty: Vec<u32>,
    /// Per pixel the one whose sample it shows.
    source: Vec<u32>,
}

/// Below this expected error a sample is taken as it is.
const EXACT: f32 = 2e-5;

impl Gather {
    /// Per pixel.
    pub(super) fn holes(&self) -> &[Hole] {
        &self.holes
    }

    /// After a picture: samples beside their pixel's centre are to be traced again, where their object `rests`.
    pub(super) fn find_off_centre(&mut self, store: &Store, rests: impl Fn(u32) -> bool) {
        let size = store.layout.size;
        for (pixel, hole) in self.holes.iter_mut().enumerate().filter(|(_, h)| **h == Hole::No) {
            let (x, y) = size.xy(pixel as u32);
            let may_rest = store.newest(x, y).is_some_and(|cell| rests(store.object[cell]));
            if may_rest && store.central(x, y).is_none() {
                *hole = Hole::OffCentre;
            }
        }
    }

    /// The pixel whose sample a pixel shows: itself, unless it is a hole; `None` if nothing is known anywhere.
    pub(super) fn source(&self, pixel: usize) -> Option<u32> {
        let source = self.source[pixel];
        (source != fill::NOBODY).then_some(source)
    }

    /// `contrast` per tile of `rates`, whose tiles are eight pixels wide.
    pub(super) fn run(
        &mut self,
        store: &Store,
        now: Time,
        rates: &Rates,
        contrast: &[f32],
        picture: &mut [[f32; 3]],
    ) {
        self.holes.clear();
        self.holes.resize(picture.len(), Hole::No);
        self.empty.clear();
        let model = Model { store, now: Tick::of(now), rates, contrast };
        wide::run(Blocks { model, picture, empty: &mut self.empty });
        fill::nearest(store.layout.size, &self.empty, &mut self.source);
        for &pixel in &self.empty {
            let i = pixel as usize;
            if let Some(rgb) = model.between(pixel) {
                picture[i] = rgb;
            } else if let Some(source) = self.source(i) {
                picture[i] = picture[source as usize];
            }
            self.holes[i] = fill::kind(store.layout.size, &self.source, pixel);
        }
    }
}

/// The expected error of samples.
#[derive(Clone, Copy)]
struct Model<'a> {
    store: &'a Store,
    now: Tick,
    rates: &'a Rates,
    contrast: &'a [f32],
}

/// Pixels that have a sample of their own, eight at a time.
struct Blocks<'a> {
    model: Model<'a>,
    picture: &'a mut [[f32; 3]],
    empty: &'a mut Vec<u32>,
}

impl wide::Task for Blocks<'_> {
    #[inline(always)]
    fn run(self) {
        let Blocks { model, picture, empty } = self;
        let size = model.store.layout.size;
        for y in 0..size.height {
            for x in (0..size.width).step_by(8) {
                let (rgb, objects) = model.block(x as i32, y as i32);
                let first = size.index(x, y) as usize;
                for lane in 0..8.min((size.width - x) as usize) {
                    if objects.0[lane] == EMPTY {
                        empty.push((first + lane) as u32);
                    } else {
                        picture[first + lane] = rgb.map(|plane| plane.0[lane]);
                    }
                }
            }
        }
    }
}

/// Eight pixels in a row of one tile.
struct Eight {
    centre: [F8; 2],
    /// The tile's learned rate of change, and its contrast.
    v: F8,
    s: F8,
}

impl Model<'_> {
    /// Colours, and the objects that are seen.
    #[inline(always)]
    fn block(&self, x: i32, y: i32) -> ([F8; 3], M8) {
        let layout = &self.store.layout;
        let n = layout.per_side as i32;
        let tile = self.rates.grid.tile_of(layout.size.index(x as u32, y as u32));
        let mut centre_x = [0.0; 8];
        for (lane, centre) in centre_x.iter_mut().enumerate() {
            *centre = (x + lane as i32) as f32 + 0.5;
        }
        let eight = Eight {
            centre: [F8(centre_x), F8::splat(y as f32 + 0.5)],
            v: F8::splat(self.rates.of_tile(tile)),
            s: F8::splat(self.contrast[tile]),
        };
        let mut least = F8::splat(f32::MAX);
        let mut objects = M8([EMPTY; 8]);
        let mut rgb = [F8::splat(0.0); 3];
        for dy in 0..n {
            for dx in 0..n {
                let i = layout.neighbour(x, y, dx, dy);
                let error = self.errors(i, &eight);
                let object = M8::load(&self.store.object, i);
                let better = error.less_than(least).and(object.equals(M8([EMPTY; 8])).not());
                least = error.or(better, least);
                objects = object.or(better, objects);
                for (rgb, plane) in rgb.iter_mut().zip(&self.store.rgb) {
                    *rgb = F8::load(plane, i).or(better, *rgb);
                }
            }
        }
        let exact = least.less_than(F8::splat(EXACT));
        if exact.or(objects.equals(M8([EMPTY; 8])).not(), M8([u32::MAX; 8])).all() {
            return (rgb, objects);
        }
        let mean = self.mean(x, y, &eight, objects);
        (std::array::from_fn(|k| rgb[k].or(exact, mean[k])), objects)
    }

    #[inline(always)]
    fn errors(&self, i: usize, eight: &Eight) -> F8 {
        let dx = F8::load(&self.store.px[0], i) - eight.centre[0];
        let dy = F8::load(&self.store.px[1], i) - eight.centre[1];
        let ticks = M8::load(&self.store.tick, i);
        let mut age_secs = [0.0; 8];
        for (age_secs, tick) in age_secs.iter_mut().zip(ticks.0) {
            *age_secs = Tick(tick).secs_until(self.now);
        }
        eight.v * F8(age_secs) + eight.s * (dx * dx + dy * dy)
    }

    /// Over the pixel's cells and those one further around.
    #[inline(always)]
    fn mean(&self, x: i32, y: i32, eight: &Eight, objects: M8) -> [F8; 3] {
        let n = self.store.layout.per_side as i32;
        let floor = F8::splat(least_error(eight.s.0[0]));
        let zero = F8::splat(0.0);
        let (mut red, mut green, mut blue, mut weights) = (zero, zero, zero, zero);
        for dy in -1..=n {
            for dx in -1..=n {
                let i = self.store.layout.neighbour(x, y, dx, dy);
                let error = self.errors(i, eight) + floor;
                let same = M8::load(&self.store.object, i).equals(objects);
                let weight = (F8::splat(1.0) / (error * error)).or(same, zero);
                weights = weights + weight;
                red = red + weight * F8::load(&self.store.rgb[0], i);
                green = green + weight * F8::load(&self.store.rgb[1], i);
                blue = blue + weight * F8::load(&self.store.rgb[2], i);
            }
        }
        [red / weights, green / weights, blue / weights]
    }
}

impl Model<'_> {
    /// A hole beside samples: the mean of those around it that belong to the nearest one's object. `None` if there are none.
    fn between(&self, pixel: u32) -> Option<[f32; 3]> {
        let layout = &self.store.layout;
        let (x, y) = layout.size.xy(pixel);
        let (n, tile) = (layout.per_side as i32, self.rates.grid.tile_of(pixel));
        let (v, s) = (self.rates.of_tile(tile), self.contrast[tile]);
        let around = move || {
            let rows = -n..2 * n;
            let cells = rows.flat_map(move |dy| (-n..2 * n).map(move |dx| (dx, dy)));
            let cells = cells.map(move |(dx, dy)| layout.neighbour(x as i32, y as i32, dx, dy));
            cells.filter(|&i| !self.store.is_empty(i))
        };
        let distance2 = |i: usize| {
            let dx = self.store.px[0][i] - (x as f32 + 0.5);
            let dy = self.store.px[1][i] - (y as f32 + 0.5);
            dx * dx + dy * dy
        };
        let nearest = around().min_by(|&a, &b| distance2(a).total_cmp(&distance2(b)))?;
        let (mut sum, mut weights) = ([0.0; 3], 0.0);
        for i in around().filter(|&i| self.store.object[i] == self.store.object[nearest]) {
            let age_secs = Tick(self.store.tick[i]).secs_until(self.now);
            let error = v * age_secs + s * distance2(i) + least_error(s);
            let weight = 1.0 / (error * error);
            (0..3).for_each(|k| sum[k] += weight * self.store.rgb[k][i]);
            weights += weight;
        }
        Some(sum.map(|c| c / weights))
    }
}

/// ε: so that a sample at the very centre does not weigh everything.
#[inline(always)]
fn least_error(s: f32) -> f32 {
    1e-4 * s + 2e-6
}
