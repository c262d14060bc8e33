//! Pixels at rest, of a renderer with noise: a mean of few samples borrows from those around it.
//!
//! ```text
//! v_j = σ_j² / n_j                                     squared error of pixel j's mean, were its samples independent (Σ over the channels, as all here)
//! e_j = σ_j² / n_j^(3/2)                               the same of samples that keep away from each other
//! d_j² = |μ_p − μ_j|²                                  display-referred
//! r = max(0, Σ min(d², κ (v + v′)) / (e + e′) / pairs − 1)       over pairs of a tile's pixels three columns or three rows apart
//! b_j² = r · 2 e_p · dist_j² / 3² + max(0, d_j² − κ (v_p + v_j))
//! w_j = 1 / (e_j + c b_j²),   shown_p = Σ w_j μ_j / Σ w_j
//! ```
//!
//! over the pixels j of the same object at most [`RADIUS`] pixels away, p among them with b = 0. Weights in inverse proportion to expected squared errors make that of the mean
//! least (Aitken 1936) if errors are independent. Noise is; what the others differ from p by, b, is not, since all of them are off to the same side where p is the brightest: so it counts c times.
//!
//! Of a single pixel a difference is seen that stands out of the noise (κ); of a whole tile, on average over its pairs, one that does not (r). For the
//! former v is taken, the larger, and for the rest e: samples of a sequence of low discrepancy have a variance of n^(−3/2) where an edge crosses the pixel (Mitchell 1996), and paths in the
//! Cornell box had 0.55 v of 12 samples, in the built-in scene `shadow` 0.27 v of 64. With v alone, pixels of 64 samples borrowed more than did them good.
//! Of a renderer whose samples are independent too little is borrowed then, never too much.
//!
//! While there are few samples everything is borrowed that does not stand out: a shadow's edge is wide. As n grows less is hidden, edges become sharp, and in the end every
//! pixel shows its own mean. Where v is below [`EXACT`] nothing is borrowed. Means are linear: means of what is display-referred would be darker the more noise there is.
//!
//! σ² is that of the tile, or the pixel's own where it is larger and known: a bright path in thousands does not shine on its neighbours.

use super::store::{EMPTY, Store};
use crate::wide::{self, F8, M8, Planes, Unit};
use crate::{Display, Size, bands};

/// How far away a pixel is that is borrowed from. Of 37 pixels all of which are alike the mean has a sixth of the noise; twice as far it would be a twelfth, at four times the
/// price.
const RADIUS: i32 = 3;
/// c. Less: fine texture becomes softer than its noise is worth; more: noise is left. RMSE of the changed pixels of an edit in the Cornell box with 6 samples, and of `shadow` with 64,
/// where the plain means have 0.146 and 0.0099: 0.046 and 0.0099 with 4, 0.049 and 0.0097 with 6, 0.054 and 0.0097 with 9.
const ALIKE: f32 = 4.0;
/// κ: of two alike d² is v_p + v_j on average, and in one case of twenty more than four times as much.
const HIDDEN: f32 = 4.0;
/// Pairs of pixels that tell r are so many columns or rows apart: as far as is borrowed, so that what differs shows most.
const APART: usize = RADIUS as usize;
/// Rows of a tile; it has as many columns.
const TILE: usize = 8;
/// Below this v nothing is borrowed: half a step of 8 bits in each channel.
pub(super) const EXACT: f32 = 3.0 * (0.5 / 255.0) * (0.5 / 255.0);
/// At least, so that weights are finite.
const LEAST: f32 = 1e-9;

/// The means of all pixels, plane by plane, with a border of [`RADIUS`] all around.
#[derive(Default)]
pub(super) struct Borrow {
    stride: usize,
    /// μ, linear.
    linear: [Vec<f32>; 3],
    /// μ, display-referred.
    encoded: [Vec<f32>; 3],
    /// v.
    variance: Vec<f32>,
    /// e.
    error: Vec<f32>,
    /// [`EMPTY`] where a pixel is not at rest.
    object: Vec<u32>,
    /// Those that a pixel borrows from.
    around: Vec<Neighbour>,
}

/// A pixel beside another.
struct Neighbour {
    /// From the one to the other in a plane.
    offset: isize,
    /// In pixels.
    distance2: f32,
}

/// A pixel at rest.
pub(super) struct Mean {
    pub(super) linear: [f32; 3],
    pub(super) encoded: [f32; 3],
    /// σ².
    pub(super) variance: f32,
    /// n.
    pub(super) count: u16,
}

impl Borrow {
    /// Shows in `picture` what pixels at rest borrow; `means`: of each pixel, if it rests.
    pub(super) fn run(
        &mut self,
        store: &Store,
        display: &Display,
        threads: usize,
        means: impl Fn(usize) -> Option<Mean>,
        picture: &mut [[f32; 3]],
    ) {
        let size = store.layout.size;
        self.fit(size);
        self.load(store, means);
        let rows = bands::rows(size.height, threads);
        let bands = picture.chunks_mut((rows * size.width) as usize);
        let bands = bands.zip((0..size.height).step_by(rows as usize));
        let (borrow, planes) = (&*self, self.planes());
        let bands = bands.map(|(picture, first_row)| Band {
            borrow,
            planes,
            width: size.width as usize,
            first_row: first_row as usize,
            display,
            picture,
        });
        bands::run(threads, bands.collect(), wide::run);
    }

    fn fit(&mut self, size: Size) {
        let border = RADIUS as usize;
        let stride = (size.width as usize).next_multiple_of(8) + 2 * border;
        // Eights read a few beyond the last row's end.
        let len = stride * (size.height as usize + 2 * border) + 8;
        if (self.stride, self.object.len()) == (stride, len) {
            return;
        }
        self.stride = stride;
        let planes = self.linear.iter_mut().chain(&mut self.encoded);
        planes
            .chain([&mut self.variance, &mut self.error])
            .for_each(|plane| *plane = vec![0.0; len]);
        self.object = vec![EMPTY; len];
        let square = (-RADIUS..=RADIUS).flat_map(|dy| (-RADIUS..=RADIUS).map(move |dx| (dx, dy)));
        let is_near = |&(dx, dy): &(i32, i32)| {
            (dx, dy) != (0, 0) && dx * dx + dy * dy <= RADIUS * (RADIUS + 1)
        };
        let neighbour = |(dx, dy): (i32, i32)| Neighbour {
            offset: dy as isize * stride as isize + dx as isize,
            distance2: (dx * dx + dy * dy) as f32,
        };
        self.around = square.filter(is_near).map(neighbour).collect();
    }

    fn at(&self, x: usize, y: usize) -> usize {
        (y + RADIUS as usize) * self.stride + x + RADIUS as usize
    }

    fn load(&mut self, store: &Store, means: impl Fn(usize) -> Option<Mean>) {
        let Size { width, height } = store.layout.size;
        for y in 0..height {
            let begin = self.at(0, y as usize);
            for x in 0..width {
                let i = begin + x as usize;
                let mean = means(store.layout.size.index(x, y) as usize);
                let rests = mean.and_then(|mean| Some((mean, store.central(x, y)?)));
                let Some((mean, cell)) = rests else {
                    self.object[i] = EMPTY;
                    continue;
                };
                self.object[i] = store.object[cell];
                let n = f32::from(mean.count);
                self.variance[i] = (mean.variance / n).max(LEAST);
                self.error[i] = (mean.variance / (n * n.sqrt())).max(LEAST);
                for k in 0..3 {
                    self.linear[k][i] = mean.linear[k];
                    self.encoded[k][i] = mean.encoded[k];
                }
            }
        }
    }

    fn planes(&self) -> Planes<'_, f32, 8> {
        let [r, g, b] = self.linear.each_ref().map(Vec::as_slice);
        let [er, eg, eb] = self.encoded.each_ref().map(Vec::as_slice);
        Planes::new([&self.error, r, g, b, &self.variance, er, eg, eb])
    }
}

/// A band of rows.
struct Band<'a> {
    borrow: &'a Borrow,
    planes: Planes<'a, f32, 8>,
    width: usize,
    first_row: usize,
    display: &'a Display,
    picture: &'a mut [[f32; 3]],
}

impl wide::Task for Band<'_> {
    #[inline(always)]
    fn run<U: Unit>(self) {
        let Band { borrow, planes, width, first_row, display, picture } = self;
        for (nth, rows) in picture.chunks_mut(TILE * width).enumerate() {
            let y = first_row + TILE * nth;
            for x in (0..width).step_by(TILE) {
                let lanes = TILE.min(width - x);
                let first = borrow.at(x, y);
                let hidden = borrow.hidden::<U>(planes, first, rows.len() / width, lanes);
                for (dy, row) in rows.chunks_exact_mut(width).enumerate() {
                    let i = first + dy * borrow.stride;
                    let borrowing = borrow.borrowing::<U>(i).and(M8::first_lanes(lanes));
                    if borrowing.any() {
                        let [r, g, b] = borrow.mean::<U>(planes, i, hidden);
                        let (r, g, b) = (r.lanes(), g.lanes(), b.lanes());
                        borrowing.for_each(|lane| {
                            row[x + lane] = display.encode([r[lane], g[lane], b[lane]]);
                        });
                    }
                }
            }
        }
    }
}

impl Borrow {
    /// Which of the eight pixels from `i` on borrow.
    #[inline(always)]
    fn borrowing<U: Unit>(&self, i: usize) -> M8<U> {
        let rests = M8::load(&self.object, i).equals(M8::splat(EMPTY)).not();
        rests.and(F8::splat(EXACT).less_than(F8::load(&self.variance, i)))
    }

    /// r of the tile whose first pixel is `first`.
    #[inline(always)]
    fn hidden<U: Unit>(
        &self,
        planes: Planes<'_, f32, 8>,
        first: usize,
        rows: usize,
        lanes: usize,
    ) -> f32 {
        let zero = F8::splat(0.0);
        let (mut sum, mut pairs) = (zero, zero);
        for i in (0..rows).map(|dy| first + dy * self.stride) {
            let rests = M8::load(&self.object, i).equals(M8::splat(EMPTY)).not();
            let counts = rests.and(M8::first_lanes(lanes));
            for j in [i + APART, i + APART * self.stride] {
                let Pair { is_same, difference2, variance, error } = self.pair::<U>(planes, i, j);
                let most = F8::splat(HIDDEN) * variance;
                let seen = difference2.or(difference2.less_than(most), most);
                let counts = counts.and(is_same);
                sum = sum + (seen / error - F8::splat(1.0)).or(counts, zero);
                pairs = pairs + F8::splat(1.0).or(counts, zero);
            }
        }
        let total = |numbers: F8<U>| numbers.lanes().iter().sum::<f32>();
        (total(sum) / total(pairs).max(1.0)).max(0.0)
    }

    #[inline(always)]
    fn pair<U: Unit>(&self, planes: Planes<'_, f32, 8>, i: usize, j: usize) -> Pair<U> {
        let [error, .., v, r, g, b] = planes.load::<U>(i);
        let [other_error, .., other_v, other_r, other_g, other_b] = planes.load::<U>(j);
        let (dr, dg, db) = (r - other_r, g - other_g, b - other_b);
        Pair {
            is_same: M8::load(&self.object, i).equals(M8::load(&self.object, j)),
            difference2: dr * dr + dg * dg + db * db,
            variance: v + other_v,
            error: error + other_error,
        }
    }

    /// Linear; of those that do not rest anything.
    #[inline(always)]
    fn mean<U: Unit>(&self, planes: Planes<'_, f32, 8>, i: usize, hidden: f32) -> [F8<U>; 3] {
        let zero = F8::splat(0.0);
        let [own, r, g, b, ..] = planes.load::<U>(i);
        let mut weights = F8::splat(1.0) / own;
        let (mut red, mut green, mut blue) = (weights * r, weights * g, weights * b);
        let hidden_per_px2 = F8::splat(2.0 * hidden / (APART * APART) as f32) * own;
        for &Neighbour { offset, distance2 } in &self.around {
            let j = i.wrapping_add_signed(offset);
            let Pair { is_same, difference2, variance, .. } = self.pair::<U>(planes, i, j);
            let beyond = difference2 - F8::splat(HIDDEN) * variance;
            let bias =
                hidden_per_px2 * F8::splat(distance2) + zero.or(beyond.less_than(zero), beyond);
            let [error, r, g, b, ..] = planes.load::<U>(j);
            let weight = (F8::splat(1.0) / (error + F8::splat(ALIKE) * bias)).or(is_same, zero);
            weights = weights + weight;
            red = red + weight * r;
            green = green + weight * g;
            blue = blue + weight * b;
        }
        [red / weights, green / weights, blue / weights]
    }
}

/// Of eight pixels and eight others.
struct Pair<U: Unit> {
    /// Whether they show one object.
    is_same: M8<U>,
    /// d².
    difference2: F8<U>,
    /// v + v′.
    variance: F8<U>,
    /// e + e′.
    error: F8<U>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rng;
    use crate::reconstruction::reproject::store::Sample;

    const SIZE: Size = Size { width: 40, height: 32 };

    /// A sample at every centre; the object by column and row.
    fn store(object: impl Fn(u32, u32) -> u32) -> Store {
        let mut store = Store::new(SIZE, 1, false);
        for y in 0..SIZE.height {
            for x in 0..SIZE.width {
                let px = [x as f32 + 0.5, y as f32 + 0.5];
                let sample = Sample { object: object(x, y), ..Sample::at(px, 1.0, 1) };
                store.insert(&sample, false);
            }
        }
        store
    }

    /// Means of `count` independent samples of grey levels, with noise of variance `variance` (Σ over the channels, of which each has the same).
    fn borrowed(
        store: &Store,
        variance: f32,
        count: u16,
        level: impl Fn(u32, u32) -> f32,
    ) -> Vec<f32> {
        let (mut rng, display) = (Rng::new(1), Display::default());
        let noise = (0..SIZE.pixels()).map(|_| (0..12).map(|_| rng.unit_f32()).sum::<f32>() - 6.0);
        let sigma = (variance / (3.0 * f32::from(count))).sqrt();
        let grey: Vec<f32> = noise
            .zip(0..)
            .map(|(noise, pixel)| {
                let (x, y) = SIZE.xy(pixel);
                level(x, y) + sigma * noise
            })
            .collect();
        let linear = |encoded: f32| ((encoded + 0.055) / 1.055).powf(2.4);
        let mean = |pixel: usize| {
            let linear = [linear(grey[pixel]); 3];
            Some(Mean { linear, encoded: display.encode(linear), variance, count })
        };
        let mut pictures = [1, 3].map(|threads| {
            let mut picture: Vec<[f32; 3]> = grey.iter().map(|&level| [level; 3]).collect();
            Borrow::default().run(store, &display, threads, mean, &mut picture);
            picture
        });
        assert_eq!(pictures[0], pictures[1], "any number of threads");
        std::mem::take(&mut pictures[0]).into_iter().map(|rgb| rgb[0]).collect()
    }

    fn rmse(picture: &[f32], level: impl Fn(u32, u32) -> f32) -> f32 {
        let square = |(pixel, &shown): (usize, &f32)| {
            let (x, y) = SIZE.xy(pixel as u32);
            (shown - level(x, y)).powi(2)
        };
        (picture.iter().enumerate().map(square).sum::<f32>() / picture.len() as f32).sqrt()
    }

    #[test]
    fn of_what_is_alike_there_is_a_quarter_of_the_noise() {
        let grey = |_, _| 0.5;
        let picture = borrowed(&store(|_, _| 0), 0.03, 1, grey);
        let left = rmse(&picture, grey) / 0.1;
        // Of 37 pixels a sixth. At the border there are fewer, and some stand out by chance.
        assert!((1.0 / 6.0..0.28).contains(&left), "{left}");
    }

    #[test]
    fn nothing_is_borrowed_from_other_objects() {
        let checks = |x: u32, y: u32| (x + y) % 2;
        let level = |x: u32, y: u32| if checks(x, y) == 0 { 0.45 } else { 0.55 };
        let picture = borrowed(&store(checks), 0.03, 1, level);
        assert!(rmse(&picture, level) < 0.035, "{}", rmse(&picture, level));
        let in_common = borrowed(&store(|_, _| 0), 0.03, 1, level);
        assert!(rmse(&in_common, level) > 0.045, "no wonder");
    }

    #[test]
    fn edges_become_sharp_and_texture_stays() {
        let edge = |x: u32, _: u32| if x < 20 { 0.4 } else { 0.7 };
        let texture = |x: u32, y: u32| 0.5 + 0.2 * (0.7 * x as f32).sin() * (0.6 * y as f32).cos();
        for n in [1, 4, 16, 64, 256] {
            let alone = 0.1 / f32::from(n).sqrt();
            let of_edge = rmse(&borrowed(&store(|_, _| 0), 0.03, n, edge), edge);
            assert!(of_edge < 0.9 * alone, "{n}: {of_edge}, alone {alone}");
            let of_texture = rmse(&borrowed(&store(|_, _| 0), 0.03, n, texture), texture);
            assert!(of_texture < 1.01 * alone, "{n}: {of_texture}, alone {alone}");
        }
    }

    #[test]
    fn what_is_known_well_is_left_as_it_is() {
        let level = |x: u32, _: u32| x as f32 / 100.0;
        let picture = borrowed(&store(|_, _| 0), 0.9 * EXACT, 1, level);
        let shown = borrowed(&store(|x, _| x), 0.9 * EXACT, 1, level);
        assert_eq!(picture, shown);
    }
}
