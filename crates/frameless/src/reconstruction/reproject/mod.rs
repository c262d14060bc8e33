//! Reconstruction `reproject`: samples remember the surface that they hit, and move with it.
//!
//! At every refresh all samples are carried to where their surfaces are then ([`warp`]), and the picture is gathered from
//! those of the same object around each pixel ([`gather`]). Pixels that nothing was carried to are holes. Between
//! refreshes, new samples are compared with what the picture showed of their surfaces ([`residual`]), and aimed so that they
//! land on pixel centres at the next refresh ([`aim`]).

mod aim;
mod borrow;
mod cells;
mod covers;
mod cracks;
mod drift;
mod fill;
mod gather;
mod holes;
mod packed;
mod relight;
mod residual;
mod rest;
mod settle;
mod shadows;
mod smooth;
mod stage;
mod store;
mod warp;

use super::ReprojectOptions;
use super::contrast::tile_contrast;
use crate::rates::Rates;
use crate::tile::TileGrid;
use crate::wide;
use crate::{
    Canvas, Display, Findings, Kept, Pose, Reconstruction, Refinement, Refresh, Request, Size, Time,
};
pub use stage::ReprojectStage;
use store::{Store, Tick};

/// See the module.
pub struct Reproject {
    options: ReprojectOptions,
    /// Cells per pixel side.
    cells: u32,
    store: Store,
    warp: warp::Warp,
    gather: gather::Gather,
    relight: relight::Relight,
    settled: settle::Settled,
    covers: covers::Covers,
    shadows: shadows::Shadows,
    drift: drift::Drift,
    /// The picture of the last refresh, and what is needed to find a surface in it.
    shown: Vec<[f32; 3]>,
    shown_at: Time,
    display: Display,
    /// Where everything was at the last refresh, and at the one before.
    poses: [Pose; 2],
    /// Seconds between these two.
    interval_secs: f32,
    /// When everything was carried somewhere else last, since the camera moved.
    carried: Tick,
    refreshes: u64,
    /// Whether the lights of the last refresh are known.
    knows_lights: bool,
    /// How many pixels had no sample at the last refresh.
    unknown: usize,
    contrast: Vec<f32>,
    holes: Vec<u32>,
    edges: Vec<u32>,
    covered: Vec<Vec<u32>>,
    no_rates: Option<Rates>,
}

impl Reproject {
    /// Nothing kept yet.
    pub fn new(options: ReprojectOptions) -> Reproject {
        let cells = if options.deep { 2 } else { 1 };
        let mut new = Reproject {
            options,
            cells,
            store: Store::new(Size::new(1, 1), cells),
            warp: Default::default(),
            gather: gather::Gather::new(options.without != Some(ReprojectStage::Gather)),
            relight: Default::default(),
            settled: Default::default(),
            covers: Default::default(),
            shadows: Default::default(),
            drift: Default::default(),
            shown: Vec::new(),
            shown_at: Time::ZERO,
            display: Display::default(),
            poses: Default::default(),
            interval_secs: 0.0,
            carried: Tick::default(),
            refreshes: 0,
            knows_lights: false,
            unknown: 0,
            contrast: Vec::new(),
            holes: Vec::new(),
            edges: Vec::new(),
            covered: Vec::new(),
            no_rates: None,
        };
        new.begin(Size::new(1, 1));
        new
    }

    /// Nothing kept in a picture of that size.
    fn begin(&mut self, size: Size) {
        self.store = Store::new(size, self.cells);
        self.warp = Default::default();
        self.refreshes = 0;
        self.unknown = 0;
        self.carried = Tick::default();
        self.shown.clear();
        self.settled.fit(size);
        self.covers.fit(size);
        self.shadows.fit(size);
        self.drift.fit(size);
        self.no_rates = None;
    }

    fn fit(&mut self, size: Size) {
        if self.store.layout.size != size {
            self.begin(size);
        }
    }

    /// Begins to fetch what sample `i` of those kept will be compared with: samples lie all over the picture, and waiting for
    /// memory would take longer than everything else.
    #[inline(always)]
    fn prefetch(&self, kept: &Kept<'_>, i: usize) {
        if let Some(request) = kept.requests.get(i + SHADE_AHEAD) {
            let (x, y) = kept.size.xy(request.pixel);
            self.store.prefetch_shade(x, y);
        }
        let Some(&Request { pixel, .. }) = kept.requests.get(i + AHEAD) else { return };
        let Size { width, height } = kept.size;
        let (x, y) = kept.size.xy(pixel);
        self.store.prefetch(x, y);
        self.settled.prefetch(pixel);
        for y in y.saturating_sub(1)..(y + 2).min(height) {
            wide::prefetch(&self.shown, (y * width + x) as usize);
        }
    }

    /// Whoever is in a new sample's cell and moves will be somewhere else at the next refresh.
    fn make_room(&mut self, sample: &store::Sample) {
        let Some(cell) = self.store.layout.of_px(sample.px) else { return };
        if self.refreshes >= 2 {
            self.covers.note(&self.store, cell, sample);
            let object = self.store.object[cell];
            if !self.settled.rests(object) {
                self.warp.displace(&mut self.store, cell);
            } else if object == sample.object {
                self.shadows.note(&self.store, cell, sample);
            }
        }
    }

    /// Adds a sample to those of its pixel, if it is meant to be and the pixel is at rest.
    fn refine(&mut self, kept: &Kept<'_>, i: usize, display: &Display) -> Option<Refinement> {
        let (request, rgb) = (kept.requests[i], kept.new[i]);
        if request.sample_index == 0 || self.settled.count(request.pixel) == 0 {
            return None;
        }
        let mut refinement = self.settled.add(request.pixel, rgb, display, kept.is_noisy);
        if refinement.suspect {
            let (x, y) = kept.size.xy(request.pixel);
            let centre = [x as f32 + 0.5, y as f32 + 0.5];
            let age_secs = self.store.newest(x, y).map_or(0.0, |cell| {
                kept.now.secs_since(Tick(self.store.tick[cell]).time(kept.now))
            });
            refinement.suspect = age_secs > LONG_SINCE_SECS
                && self.around(centre).beyond_range(display.encode(rgb)) > 3.0 * residual::OUTDATED;
        }
        Some(refinement)
    }
}

/// So many samples later what is prefetched is used.
const AHEAD: usize = 16;
/// The same of what is found by what was prefetched first.
const SHADE_AHEAD: usize = 8;

/// A suspect pixel whose centre was traced later than this before is not looked at again: it shows something finer than a pixel.
const LONG_SINCE_SECS: f64 = 0.05;

/// Where one pixel in so many has lost its sample from one refresh to the next, the picture is another one.
const MUCH_GONE: usize = 4;

impl Reconstruction for Reproject {
    fn keep(&mut self, kept: &Kept<'_>, display: &Display, findings: &mut Findings) {
        self.fit(kept.size);
        for i in 0..kept.requests.len() {
            self.prefetch(kept, i);
            if let Some(refinement) = self.refine(kept, i, display) {
                findings.changes.push(0.0);
                findings.refinements.resize(i, None);
                findings.refinements.push(Some(refinement));
                continue;
            }
            let mut sample = store::Sample::new(kept, i, display);
            let found = self.residual(&sample, kept, i, display);
            sample.depth = found.depth;
            self.make_room(&sample);
            self.store.insert(&sample, found.outdated);
            findings.changes.push(found.change);
        }
    }

    fn aim(&self, now: Time, canvas: &Canvas, requests: &mut [Request]) {
        let is_out = self.options.without == Some(ReprojectStage::Aim);
        if self.refreshes >= 2 && self.store.layout.size == canvas.size() && !is_out {
            // Those that add to a pixel's samples lie where they are to lie.
            for i in 0..requests.len() {
                self.prefetch_motion(requests, i);
                if requests[i].sample_index == 0 {
                    self.aim_one(now, canvas, &mut requests[i]);
                }
            }
        }
    }

    fn wants_lighting(&self) -> bool {
        self.options.relight
    }

    fn refresh(&mut self, refresh: &Refresh<'_>, canvas: &mut Canvas, picture: &mut Vec<[f32; 3]>) {
        self.fit(canvas.size());
        self.carry(refresh);
        self.light(refresh);
        self.show(refresh, canvas, picture);
        self.tell(refresh, canvas);
    }
}

/// The steps of a refresh, in their order.
impl Reproject {
    /// Every sample to where its surface is now.
    fn carry(&mut self, refresh: &Refresh<'_>) {
        self.poses.swap(0, 1);
        match refresh.pose {
            Some(pose) => self.poses[0].clone_from(pose),
            None => self.poses[0] = Pose::default(),
        }
        self.interval_secs = refresh.now.secs_since(self.shown_at) as f32;
        self.refreshes += 1;
        self.shown_at = refresh.now;
        // Nothing is known to move before the second refresh.
        let before = &self.poses[usize::from(self.refreshes >= 2)];
        self.settled.find_moved([&self.poses[0], before]);
        if refresh.is_noisy {
            self.settled.hand_over(&mut self.store, refresh.display);
        }
        if self.refreshes >= 2 && !self.settled.any_rests() {
            self.carried = Tick::of(refresh.now);
        }
        let at_rest = self.refreshes >= 2 && self.poses[0] == self.poses[1];
        if !at_rest || self.warp.has_displaced() {
            // Of what was kept before the first refresh nobody knows yet where it is.
            let (first, settled) = (self.refreshes < 2, &self.settled);
            let rests = |object| object == store::SCREEN || !first && settled.rests(object);
            self.warp.run(&mut self.store, &self.poses[0], refresh.threads, rests);
            if self.options.without != Some(ReprojectStage::Cracks) {
                cracks::remove(&mut self.store, refresh.threads, &mut self.covered);
            }
        }
        if self.options.without != Some(ReprojectStage::Covers) {
            self.covers.run(&mut self.store);
        }
    }

    /// Their colours for the present display and lights.
    fn light(&mut self, refresh: &Refresh<'_>) {
        let display = *refresh.display;
        if std::mem::replace(&mut self.display, display) != display {
            let (store, relight) = (&mut self.store, &self.relight);
            store.encode_again(&display, |store, cell| relight.linear(store, cell));
            self.settled.encode_again(&display);
        }
        self.knows_lights = refresh.lighting.is_some();
        if !self.knows_lights && !refresh.is_noisy && self.refreshes >= 2 {
            let (now, interval_secs) = (refresh.now, self.interval_secs);
            self.drift
                .run(&mut self.store, now, interval_secs, |object| self.settled.rests(object));
        }
        if let Some(lighting) = refresh.lighting {
            self.relight.run(&mut self.store, lighting, &display, refresh.threads);
        }
    }

    /// The picture, and what waits to be traced.
    fn show(&mut self, refresh: &Refresh<'_>, canvas: &Canvas, picture: &mut Vec<[f32; 3]>) {
        let size = canvas.size();
        let rates = refresh.rates.unwrap_or_else(|| {
            self.no_rates.get_or_insert_with(|| Rates::new(TileGrid::new(size, 8)))
        });
        if self.shown.len() != size.pixels() {
            self.shown = canvas.rgb().iter().map(|&rgb| refresh.display.encode(rgb)).collect();
        }
        tile_contrast(&self.shown, &rates.grid, &mut self.contrast);
        let (now, threads) = (refresh.now, refresh.threads);
        let (store, contrast) = (&self.store, &self.contrast);
        self.gather.run(store, now, threads, rates, contrast, &self.shown, picture);
        self.doubt(size, now);
        let recentres = self.options.without != Some(ReprojectStage::Recentre);
        if recentres && self.settled.any_rests() {
            let rests = |object| self.settled.rests(object);
            self.gather.find_off_centre(&self.store, self.carried, threads, rests);
        }
        if self.samples_wanted(refresh) > 0 {
            self.settled.show(&mut self.store, &self.relight, refresh, picture);
        }
        if refresh.is_noisy && self.options.without != Some(ReprojectStage::Borrow) {
            self.settled.borrow(&self.store, refresh, picture);
        }
        self.shown.clone_from(picture);
    }

    /// Where what was known has gone at once (a cut, a jump), what is left is looked at again, too; so are places before which something
    /// seems to have come.
    fn doubt(&mut self, size: Size, now: Time) {
        if self.options.without == Some(ReprojectStage::Covers) {
            return;
        }
        let before = std::mem::replace(&mut self.unknown, self.gather.waiting.len());
        if self.refreshes >= 2 && self.unknown.saturating_sub(before) > size.pixels() / MUCH_GONE {
            self.covers.doubt_all(Tick::of(now));
        }
        self.covers.probe(&self.store, &mut self.gather.waiting);
    }

    /// Of how many samples pixels at rest are to show the mean; 0: none.
    fn samples_wanted(&self, refresh: &Refresh<'_>) -> u16 {
        match refresh.is_noisy {
            true => settle::MOST_SAMPLES,
            false if self.options.antialias => settle::SAMPLES_WITHOUT_NOISE,
            false => 0,
        }
    }

    /// Tells the canvas what its pixels show now.
    fn tell(&mut self, refresh: &Refresh<'_>, canvas: &mut Canvas) {
        self.shadows.find_edges(&self.store, self.relight.moved(), &mut self.edges);
        canvas.set_last_minute(&mut self.edges);
        let gather::Gather { waiting, marks, .. } = &mut self.gather;
        waiting.order(&mut self.holes);
        canvas.update(refresh.now, &mut self.holes, marks);
        canvas.set_samples(self.samples_wanted(refresh), self.settled.counts());
        let grid = refresh.rates.filter(|_| refresh.wants_motion).map(|rates| &rates.grid);
        let motion = grid.into_iter().flat_map(|grid| self.tile_motion(grid));
        canvas.set_tiles(&self.contrast, motion);
    }
}
