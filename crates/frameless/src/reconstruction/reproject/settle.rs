//! Pixels at rest: their samples add up.
//!
//! ```text
//! μ_n = (1/n) Σ x_j                    linear RGB; x_1 is the sample at the centre, the others lie elsewhere in the pixel
//! σ²  = (1/(n−1)) Σ |x_j − μ_{j−1}|² (j−1)/j      in display-referred sRGB, summed over the channels (Welford 1962)
//! ```
//!
//! A pixel is at rest while its sample lies at its centre and neither its object nor one beside it moves. The sample at the
//! centre is kept apart: traced again, with the same random numbers, it is the same unless something has changed, however
//! noisy the renderer is and whatever else the pixel's other samples see. Where it has changed the pixel begins anew, and so do its
//! neighbours: what has gone may have covered a part of them and not their centres. A renderer with noise goes on with as many samples
//! as are off by noise as much as by the change,
//!
//! ```text
//! n ← min(n, σ² / δ²)                  δ² the squared change of the sample at the centre
//! ```

use super::borrow::{self, Borrow};
use super::relight::Relight;
use super::residual::squared;
use super::rest::{self, Rest};
use super::store::{EMPTY, SCREEN, Store};
use crate::tile::TileGrid;
use crate::{Display, Pose, Refinement, Refresh, Size, Surface, bands, wide};

/// Per pixel what its samples add up to; nothing where it is not at rest.
#[derive(Default)]
pub(super) struct Settled {
    count: Vec<u16>,
    /// Linear RGB.
    sum: Vec<[f32; 3]>,
    /// (n − 1) σ².
    spread: Vec<f32>,
    /// μ, display-referred.
    encoded: Vec<[f32; 3]>,
    grid: Option<TileGrid>,
    /// Per tile: the variance of a pixel's samples.
    noise: Vec<f32>,
    /// Per tile: the mean of how many samples that is, as far as it is known.
    noise_samples: Vec<u8>,
    borrow: Borrow,
    /// Scratch memory: per first cell of a pixel 1 if something moves in it.
    moving: Vec<u8>,
    /// Scratch memory, of each band of rows: cells that take over their pixel's mean, and which.
    handed_back: Vec<Vec<(usize, [f32; 3])>>,
    /// Scratch memory, of each band of rows: pixels whose sample at the centre has gone.
    left: Vec<Vec<[u32; 2]>>,
    /// Object numbers that have moved since the last refresh.
    moved: Vec<bool>,
    sky_moved: bool,
}

/// Samples that add up in a pixel where the renderer has no noise: more cannot be told apart in 8 bits.
pub(super) const SAMPLES_WITHOUT_NOISE: u16 = 64;
/// The most that are counted.
pub(super) const MOST_SAMPLES: u16 = u16::MAX;

/// A sample at the centre that differs by no more (Σ over the channels) is the same.
const SAME: f32 = 1e-6;
/// Of a renderer with noise: so many variances are no other path of light, but another thing.
const BEYOND_NOISE: f32 = 9.0;
/// Before much is known of a pixel it is thought to spread by this (Σ over the channels): 9 % of the range.
const FIRST_SPREAD: f32 = 0.025;
/// A tile's noise is the mean over its last samples: about so many.
const NOISE_MEMORY: u8 = 64;
/// Of fewer samples a pixel's own variance says nothing.
const KNOWN_SPREAD: u16 = 4;
const TILE: u32 = 8;
/// A sample this many standard deviations off, squared, makes a pixel suspect.
const SUSPECT: f32 = 9.0;

/// What the samples of some pixels add up to, as in [`Settled`].
pub(super) struct Means<'a> {
    pub(super) count: &'a mut [u16],
    pub(super) sum: &'a mut [[f32; 3]],
    pub(super) spread: &'a mut [f32],
    pub(super) encoded: &'a mut [[f32; 3]],
}

impl Means<'_> {
    pub(super) fn begin(&mut self, pixel: usize, rgb: [f32; 3], display: &Display) {
        self.count[pixel] = 1;
        (self.sum[pixel], self.spread[pixel]) = (rgb, 0.0);
        self.encoded[pixel] = display.encode(rgb);
    }
}

/// Of samples that add up to `sum`.
pub(super) fn mean(sum: [f32; 3], count: u16) -> [f32; 3] {
    let per_count = 1.0 / f32::from(count);
    sum.map(|c| c * per_count)
}

impl Settled {
    /// Nothing is added up until [`Settled::show`] is asked for it.
    pub(super) fn fit(&mut self, size: Size) {
        let (grid, moved) = (Some(TileGrid::new(size, TILE)), std::mem::take(&mut self.moved));
        *self = Settled { grid, moved, sky_moved: self.sky_moved, ..Settled::default() };
    }

    fn begin_to_add(&mut self, size: Size) {
        if self.count.is_empty() {
            let tiles = self.grid.as_ref().map_or(0, TileGrid::len);
            self.count = vec![0; size.pixels()];
            self.sum = vec![[0.0; 3]; size.pixels()];
            self.spread = vec![0.0; size.pixels()];
            self.encoded = vec![[0.0; 3]; size.pixels()];
            self.noise = vec![0.0; tiles];
            self.noise_samples = vec![0; tiles];
        }
    }

    /// Of how many samples each pixel shows the mean; 0 where it is not at rest. Empty if nobody has asked for means.
    pub(super) fn counts(&self) -> &[u16] {
        &self.count
    }

    /// Of how many samples a pixel shows the mean; 0 where it is not at rest.
    pub(super) fn count(&self, pixel: u32) -> u16 {
        self.count.get(pixel as usize).copied().unwrap_or(0)
    }

    /// Begins to fetch what is known of a pixel.
    #[inline(always)]
    pub(super) fn prefetch(&self, pixel: u32) {
        wide::prefetch(&self.count, pixel as usize);
        wide::prefetch(&self.sum, pixel as usize);
        wide::prefetch(&self.spread, pixel as usize);
        wide::prefetch(&self.encoded, pixel as usize);
    }

    /// Variance of the samples of a pixel in the tile, Σ over the channels, as far as it is known.
    pub(super) fn noise(&self, pixel: u32) -> f32 {
        let noise = |grid: &TileGrid| self.noise.get(grid.tile_of(pixel)).copied();
        self.grid.as_ref().and_then(noise).unwrap_or(0.0)
    }

    fn begin(&mut self, pixel: usize, rgb: [f32; 3], display: &Display) {
        let Settled { count, sum, spread, encoded, .. } = self;
        Means { count, sum, spread, encoded }.begin(pixel, rgb, display);
    }

    /// Linear mean of the pixel's samples.
    fn mean(&self, pixel: usize) -> [f32; 3] {
        mean(self.sum[pixel], self.count[pixel])
    }

    /// Means for another display.
    pub(super) fn encode_again(&mut self, display: &Display) {
        for pixel in 0..self.count.len() {
            if self.count[pixel] > 0 {
                self.encoded[pixel] = display.encode(self.mean(pixel));
            }
        }
    }

    /// One more sample of a pixel at rest.
    pub(super) fn add(
        &mut self,
        pixel: u32,
        rgb: [f32; 3],
        display: &Display,
        is_noisy: bool,
    ) -> Refinement {
        let tile = self.grid.as_ref().map(|grid| grid.tile_of(pixel));
        let pixel = pixel as usize;
        if !is_noisy && self.count[pixel] >= SAMPLES_WITHOUT_NOISE {
            return Refinement { deviation: 0.0, suspect: false };
        }
        let n = f32::from(self.count[pixel]);
        let deviation = squared(display.encode(rgb), self.encoded[pixel]) * n / (n + 1.0);
        let suspect = deviation > SUSPECT * (self.spread[pixel] + FIRST_SPREAD) / n;
        self.spread[pixel] += deviation;
        if let Some(tile) = tile {
            self.noise_samples[tile] = (self.noise_samples[tile] + 1).min(NOISE_MEMORY);
            let part = 1.0 / f32::from(self.noise_samples[tile]);
            self.noise[tile] += part * (deviation - self.noise[tile]);
        }
        if self.count[pixel] == MOST_SAMPLES {
            self.keep_only(pixel, MOST_SAMPLES / 2);
        }
        (0..3).for_each(|k| self.sum[pixel][k] += rgb[k]);
        self.count[pixel] += 1;
        self.encoded[pixel] = display.encode(self.mean(pixel));
        Refinement { deviation, suspect }
    }

    /// The sample at the centre has changed by `change` (Σ over the channels) to the linear `rgb`. Returns whether its neighbours
    /// should begin anew, too.
    pub(super) fn verify(
        &mut self,
        pixel: u32,
        rgb: [f32; 3],
        change: f32,
        display: &Display,
        is_noisy: bool,
    ) -> bool {
        if change <= SAME {
            return false;
        }
        let pixel = pixel as usize;
        let n = self.count[pixel];
        let variance = self.spread[pixel] / (f32::from(n) - 1.0).max(1.0);
        let as_good = if is_noisy { (variance / change) as u16 } else { 0 };
        if as_good <= 1 {
            self.begin(pixel, rgb, display);
        } else if as_good < n {
            self.keep_only(pixel, as_good);
        }
        as_good <= 1 && (!is_noisy || change > BEYOND_NOISE * variance)
    }

    fn keep_only(&mut self, pixel: usize, count: u16) {
        let part = f32::from(count) / f32::from(self.count[pixel]);
        self.sum[pixel] = self.sum[pixel].map(|c| c * part);
        self.spread[pixel] *= part;
        self.count[pixel] = count;
    }

    /// What has moved between two refreshes.
    pub(super) fn find_moved(&mut self, [now, before]: [&Pose; 2]) {
        let deformed = |pose: &Pose, object: usize| pose.deformed.get(object).cloned().flatten();
        self.moved.clear();
        self.moved.extend(now.picture_from_object.iter().enumerate().map(
            |(object, projection)| {
                before.picture_from_object.get(object) != Some(projection)
                    || deformed(now, object) != deformed(before, object)
            },
        ));
        self.sky_moved = now.picture_from_sky != before.picture_from_sky;
        if now.windows != before.windows {
            // Who stands still may yet go out of sight.
            self.moved.fill(true);
            self.sky_moved = true;
        }
    }

    /// Whether any object may rest.
    pub(super) fn any_rests(&self) -> bool {
        !self.sky_moved || self.moved.iter().any(|&moved| !moved)
    }

    pub(super) fn rests(&self, object: u32) -> bool {
        match object {
            SCREEN | EMPTY => true,
            Surface::SKY => !self.sky_moved,
            object => self.moved.get(object as usize).is_some_and(|&moved| !moved),
        }
    }

    /// Samples that are about to be carried away take their pixel's mean with them.
    pub(super) fn hand_over(&mut self, store: &mut Store, relight: &Relight, display: &Display) {
        for pixel in 0..self.count.len() {
            if self.count[pixel] > 1 {
                let (x, y) = store.layout.size.xy(pixel as u32);
                let cell = store.central(x, y).filter(|&cell| !self.rests(store.object[cell]));
                if let Some(cell) = cell {
                    relight.recolour(store, cell, self.mean(pixel), display);
                    self.count[pixel] = 0;
                }
            }
        }
    }

    /// After a picture has been gathered: which pixels are at rest, and what they show.
    pub(super) fn show(
        &mut self,
        store: &mut Store,
        relight: &Relight,
        refresh: &Refresh<'_>,
        central: &[u8],
        picture: &mut [[f32; 3]],
    ) {
        self.begin_to_add(store.layout.size);
        if !self.any_rests() && !refresh.is_noisy {
            return self.count.fill(0);
        }
        self.find_moving(store);
        let Size { width, height } = store.layout.size;
        let rows = bands::rows(height, refresh.threads);
        let band = (rows * width) as usize;
        self.handed_back.resize_with(height.div_ceil(rows) as usize, Vec::new);
        self.left.resize_with(height.div_ceil(rows) as usize, Vec::new);
        let chunks = self
            .count
            .chunks_mut(band)
            .zip(self.sum.chunks_mut(band))
            .zip(self.spread.chunks_mut(band))
            .zip(self.encoded.chunks_mut(band))
            .zip(picture.chunks_mut(band))
            .zip(&mut self.handed_back)
            .zip(&mut self.left);
        let (shown, moving) = (&*store, &*self.moving);
        let bands = chunks.enumerate().map(|(nth, chunks)| {
            let ((((((count, sum), spread), encoded), picture), handed_back), left) = chunks;
            let means = Means { count, sum, spread, encoded };
            let first = nth * band;
            let store = shown;
            Rest {
                store,
                relight,
                refresh,
                central,
                moving,
                first,
                means,
                picture,
                handed_back,
                left,
            }
        });
        bands::run(refresh.threads, bands.collect(), wide::run);
        for (cell, rgb) in self.handed_back.iter_mut().flat_map(|cells| cells.drain(..)) {
            relight.recolour(store, cell, rgb, refresh.display);
        }
        let mut left = std::mem::take(&mut self.left);
        for [x, y] in left.iter_mut().flat_map(|pixels| pixels.drain(..)) {
            self.begin_around(store, relight, [x, y], refresh.display);
        }
        self.left = left;
    }

    /// After [`Settled::show`], of a renderer with noise: means of few samples borrow from those around.
    pub(super) fn borrow(
        &mut self,
        store: &Store,
        refresh: &Refresh<'_>,
        picture: &mut [[f32; 3]],
    ) {
        let mut borrow = std::mem::take(&mut self.borrow);
        let means = |pixel: usize| {
            (self.count[pixel] > 0).then(|| borrow::Mean {
                linear: self.mean(pixel),
                encoded: self.encoded[pixel],
                variance: self.variance(pixel),
                count: self.count[pixel],
            })
        };
        borrow.run(store, refresh.display, refresh.threads, means, picture);
        self.borrow = borrow;
    }

    /// σ² of a pixel at rest, Σ over the channels: the tile's, or its own where it is larger and known.
    fn variance(&self, pixel: usize) -> f32 {
        let tile = self.grid.as_ref().map(|grid| grid.tile_of(pixel as u32));
        let known = tile.filter(|&tile| self.noise_samples[tile] > 0);
        let of_tile = known.map_or(FIRST_SPREAD, |tile| self.noise[tile]);
        match self.count[pixel] {
            n if n < KNOWN_SPREAD => of_tile,
            n => of_tile.max(self.spread[pixel] / f32::from(n - 1)),
        }
    }

    /// The pixels beside one whose sample at the centre has changed or gone begin anew.
    pub(super) fn begin_around(
        &mut self,
        store: &Store,
        relight: &Relight,
        [x, y]: [u32; 2],
        display: &Display,
    ) {
        let Size { width, height } = store.layout.size;
        for y in y.saturating_sub(1)..(y + 2).min(height) {
            for x in x.saturating_sub(1)..(x + 2).min(width) {
                let pixel = store.layout.size.index(x, y);
                if self.count(pixel) > 1
                    && let Some(cell) = store.central(x, y)
                {
                    store.touched.mark(x, y);
                    self.begin(pixel as usize, relight.linear(store, cell), display);
                }
            }
        }
    }

    /// Marks the pixels of which a sample moves.
    fn find_moving(&mut self, store: &Store) {
        self.moving.clear();
        self.moving.resize(store.layout.plane, 0);
        if self.anything_moves() {
            let mut moving = std::mem::take(&mut self.moving);
            rest::mark_moving(store, |object| !self.rests(object), &mut moving);
            self.moving = moving;
        }
    }

    fn anything_moves(&self) -> bool {
        self.sky_moved || self.moved.contains(&true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Projection, Window};

    fn settled() -> (Settled, Display) {
        let mut settled = Settled::default();
        settled.fit(Size::new(1, 1));
        settled.begin_to_add(Size::new(1, 1));
        (settled, Display::default())
    }

    #[test]
    fn nothing_rests_while_a_window_moves() {
        let mut settled = settled().0;
        let pose = |depth: f32| Pose {
            picture_from_object: vec![Projection::default(); 2],
            windows: vec![Window { depth: [[0.0, 0.0, depth]; 2], ..Window::default() }],
            ..Pose::default()
        };
        settled.find_moved([&pose(1.0), &pose(1.0)]);
        assert!([0, 1, Surface::SKY].iter().all(|&object| settled.rests(object)));
        settled.find_moved([&pose(1.0), &pose(2.0)]);
        assert!(![0, 1, Surface::SKY].iter().any(|&object| settled.rests(object)));
    }

    #[test]
    fn samples_add_up_to_their_mean() {
        let (mut settled, display) = settled();
        settled.begin(0, [0.1; 3], &display);
        for grey in [0.2, 0.3, 0.4] {
            settled.add(0, [grey; 3], &display, true);
        }
        assert_eq!(settled.count(0), 4);
        assert!((settled.mean(0)[1] - 0.25).abs() < 1e-6);
        settled.verify(0, [0.1; 3], 0.0, &display, false);
        assert_eq!(settled.count(0), 4, "the same again");
        settled.verify(0, [0.9; 3], 0.5, &display, false);
        assert_eq!((settled.count(0), settled.mean(0)), (1, [0.9; 3]), "begins anew");
    }

    #[test]
    fn a_small_change_shortens_a_noisy_mean() {
        let (mut settled, display) = settled();
        settled.begin(0, [0.2; 3], &display);
        for i in 1..400 {
            settled.add(0, [if i % 2 == 0 { 0.2 } else { 0.3 }; 3], &display, true);
        }
        // σ² is about the squared half of the step, in all channels; a change a tenth of that in size leaves a hundred samples.
        let step = display.change([0.2; 3], [0.3; 3]);
        let mean = settled.mean(0);
        settled.verify(0, [0.2; 3], step / 400.0, &display, true);
        assert!((80..130).contains(&settled.count(0)), "{}", settled.count(0));
        assert!((settled.mean(0)[0] - mean[0]).abs() < 1e-6, "the mean itself stays");
    }

    #[test]
    fn what_is_far_off_is_suspect() {
        let (mut settled, display) = settled();
        settled.begin(0, [0.2; 3], &display);
        for _ in 0..20 {
            assert!(!settled.add(0, [0.21; 3], &display, true).suspect);
        }
        assert!(settled.add(0, [0.9; 3], &display, true).suspect);
    }

    #[test]
    fn counting_never_overflows() {
        let (mut settled, display) = settled();
        settled.begin(0, [0.5; 3], &display);
        for _ in 0..2 * u32::from(MOST_SAMPLES) {
            settled.add(0, [0.5; 3], &display, true);
        }
        assert!((settled.mean(0)[0] - 0.5).abs() < 1e-3);
    }
}
