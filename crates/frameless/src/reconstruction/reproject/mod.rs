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
mod gather;
mod holes;
mod packed;
mod relight;
mod residual;
mod rest;
mod settle;
mod shade;
mod shadows;
mod smooth;
mod stage;
mod store;
mod touched;
mod warp;

use super::ReprojectOptions;
use super::contrast::tile_contrast;
use crate::rates::Rates;
use crate::tile::TileGrid;

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
    /// The canvas's generation, and how many samples were wanted.
    shown_for: (u32, u16),
    display: Display,
    /// Where everything was at the last refresh, and at the one before.
    poses: [Pose; 2],
    /// Seconds between these two.
    interval_secs: f32,
    /// When the earlier was.
    before: Tick,
    /// When everything was carried somewhere else last, since the camera moved.
    carried: Tick,
    refreshes: u64,
    /// Whether the lights of the last refresh are known.
    knows_lights: bool,
    /// How many pixels had no sample at the last refresh.
    unknown: usize,
    contrast: Vec<f32>,
    edges: Vec<u32>,
    covered: Vec<Vec<u32>>,
    no_rates: Option<Rates>,
    /// Scratch memory.
    landed: Vec<Option<residual::Landed>>,
}

impl Reproject {
    /// Nothing kept yet.
    pub fn new(options: ReprojectOptions) -> Reproject {
        let cells = if options.deep { 2 } else { 1 };
        let mut new = Reproject {
            options,
            cells,
            store: Store::new(Size::new(1, 1), cells, options.relight),
            warp: Default::default(),
            gather: gather::Gather::new(options.without != Some(ReprojectStage::Gather)),
            relight: Default::default(),
            settled: Default::default(),
            covers: Default::default(),
            shadows: Default::default(),
            drift: Default::default(),
            shown: Vec::new(),
            shown_at: Time::ZERO,
            shown_for: (0, 0),
            display: Display::default(),
            poses: Default::default(),
            interval_secs: 0.0,
            before: Tick::default(),
            carried: Tick::default(),
            refreshes: 0,
            knows_lights: false,
            unknown: 0,
            contrast: Vec::new(),
            edges: Vec::new(),
            covered: Vec::new(),
            no_rates: None,
            landed: Vec::new(),
        };
        new.begin(Size::new(1, 1));
        new
    }

    /// Nothing kept in a picture of that size.
    fn begin(&mut self, size: Size) {
        self.store = Store::new(size, self.cells, self.options.relight);
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

    /// Begins to fetch what is known of the pixel of sample `i` of those kept.
    #[inline(always)]
    fn prefetch(&self, kept: &Kept<'_>, i: usize) {
        let pixel = kept.requests[i].pixel;
        let (x, y) = kept.size.xy(pixel);
        self.store.prefetch(x, y);
        self.settled.prefetch(pixel);
    }

    /// Whoever is in a new sample's cell and moves will be somewhere else at the next refresh.
    fn make_room(&mut self, sample: &store::Sample) {
        let Some(cell) = self.store.layout.of_px(sample.px) else { return };
        if self.refreshes >= 2 {
            self.covers.note(&self.store, cell, sample);
            let object = self.store.object[cell];
            if !self.settled.rests(object) {
                self.warp.displace(&mut self.store, cell, sample);
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
            let age_secs = self
                .store
                .newest(x, y)
                .map_or(0.0, |cell| kept.now.secs_since(self.store.tick(cell).time(kept.now)));
            refinement.suspect = age_secs > LONG_SINCE_SECS
                && self.around(centre).beyond_range(display.encode(rgb)) > 3.0 * residual::OUTDATED;
        }
        Some(refinement)
    }
}

/// So many samples later what is prefetched is used.
const AHEAD: usize = 16;

/// Of so many samples at a time what they will be compared with is fetched.
const FEW: usize = 32;

/// A suspect pixel whose centre was traced later than this before is not looked at again: it shows something finer than a pixel.
const LONG_SINCE_SECS: f64 = 0.05;

/// Where one pixel in so many has lost its sample from one refresh to the next, the picture is another one.
const MUCH_GONE: usize = 4;

impl Reconstruction for Reproject {
    fn keep(&mut self, kept: &Kept<'_>, display: &Display, findings: &mut Findings) {
        self.fit(kept.size);
        let mut landed = std::mem::take(&mut self.landed);
        for first in (0..kept.requests.len()).step_by(FEW) {
            // Samples lie all over the picture, and waiting for memory would take longer than everything else: of a few all that they will be
            // compared with is fetched before.
            let few = first..(first + FEW).min(kept.requests.len());
            few.clone().for_each(|i| self.prefetch(kept, i));
            landed.clear();
            landed.extend(few.clone().map(|i| {
                (kept.requests[i].sample_index == 0).then(|| self.land(kept, i, display))
            }));
            for i in few {
                if let Some(refinement) = self.refine(kept, i, display) {
                    findings.changes.push(0.0);
                    findings.refinements.resize(i, None);
                    findings.refinements.push(Some(refinement));
                    continue;
                }
                let landed = landed[i - first].take();
                let mut landed = landed.unwrap_or_else(|| self.land(kept, i, display));
                let found = self.residual(&landed, kept, i, display);
                let sample = &mut landed.sample;
                sample.record.set_depth(found.depth);
                self.make_room(sample);
                self.store.insert(sample, found.outdated);
                findings.changes.push(found.change);
            }
        }
        self.landed = landed;
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

    fn has_own_samples(&self) -> bool {
        true
    }

    fn wants_lighting(&self) -> bool {
        self.options.relight
    }

    fn refresh(&mut self, refresh: &Refresh<'_>, canvas: &mut Canvas) {
        self.fit(canvas.size());
        self.carry(refresh);
        self.light(refresh);
        self.show(refresh, canvas);
        self.tell(refresh, canvas);
    }

    fn picture(&self) -> &[[f32; 3]] {
        &self.shown
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
        self.before = Tick::of(self.shown_at);
        self.interval_secs = refresh.now.secs_since(self.shown_at) as f32;
        self.refreshes += 1;
        self.shown_at = refresh.now;
        self.store.keep_primitives(self.poses[0].deformed.iter().any(Option::is_some));
        // Nothing is known to move before the second refresh.
        let before = &self.poses[usize::from(self.refreshes >= 2)];
        self.settled.find_moved([&self.poses[0], before]);
        if refresh.is_noisy {
            self.settled.hand_over(&mut self.store, &self.relight, refresh.display);
        }
        if !self.settled.any_rests() {
            self.store.touched.mark_all();
            if self.refreshes >= 2 {
                self.carried = Tick::of(refresh.now);
            }
        }
        let at_rest = self.refreshes >= 2 && self.poses[0] == self.poses[1];
        if !at_rest || self.warp.has_displaced() {
            // Of what was kept before the first refresh nobody knows yet where it is.
            let (first, settled) = (self.refreshes < 2, &self.settled);
            let rests = |object| object == store::SCREEN || !first && settled.rests(object);
            let motion = warp::Motion {
                poses: self.poses.each_ref(),
                ticks: [Tick::of(refresh.now), self.before],
                is_known: !first,
            };
            self.warp.run(&mut self.store, &motion, refresh.threads, rests);
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
        if let Some(lighting) = refresh.lighting.filter(|_| self.options.relight) {
            self.relight.run(&mut self.store, lighting, &display, refresh.threads);
        }
    }

    /// The picture, and what waits to be traced.
    fn show(&mut self, refresh: &Refresh<'_>, canvas: &mut Canvas) {
        let (size, wanted) = (canvas.size(), self.samples_wanted(refresh));
        let rates = refresh.rates.unwrap_or_else(|| {
            self.no_rates.get_or_insert_with(|| Rates::new(TileGrid::new(size, touched::TILE)))
        });
        let is_new = (canvas.generation(), wanted);
        // With noise, pixels show what they borrow from others.
        if std::mem::replace(&mut self.shown_for, is_new) != is_new || refresh.is_noisy {
            self.store.touched.mark_all();
        }
        if self.shown.len() != size.pixels() {
            self.shown = canvas.rgb().iter().map(|&rgb| refresh.display.encode(rgb)).collect();
            tile_contrast(&self.shown, &rates.grid, &mut self.contrast);
        }
        let (mut marks, mut holes) = canvas.lend();
        let recentres = self.options.without != Some(ReprojectStage::Recentre);
        let rests = |object| self.settled.rests(object);
        let look = gather::Look {
            store: &self.store,
            now: refresh.now,
            threads: refresh.threads,
            rates,
            contrast: &self.contrast,
            carried: self.carried,
            before: self.before,
            rests: (recentres && self.settled.any_rests()).then_some(&rests),
        };
        let shown = gather::Shown { rgb: &mut self.shown, marks: &mut marks };
        self.gather.run(look, shown);
        self.store.touched.clear();
        self.doubt(size, refresh.now);
        if wanted > 0 {
            let (store, shown) = (&mut self.store, &mut self.shown);
            self.settled.show(store, &self.relight, refresh, self.gather.central(), shown);
        }
        if refresh.is_noisy && self.options.without != Some(ReprojectStage::Borrow) {
            self.settled.borrow(&self.store, refresh, &mut self.shown);
        }
        let grid = TileGrid::new(size, touched::TILE);
        tile_contrast(&self.shown, &grid, &mut self.contrast);
        self.gather.waiting.order(&self.contrast, &mut holes);
        canvas.update(refresh.now, marks, holes);
    }

    /// Where what was known has gone at once (a cut, a jump), what is left is looked at again, too; so are places before which something
    /// seems to have come.
    fn doubt(&mut self, size: Size, now: Time) {
        if self.options.without == Some(ReprojectStage::Covers) {
            return;
        }
        let before = std::mem::replace(&mut self.unknown, self.gather.waiting.unknown());
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
        canvas.set_samples(self.samples_wanted(refresh), self.settled.counts());
        let grid = refresh.rates.filter(|_| refresh.wants_motion).map(|rates| &rates.grid);
        let motion = grid.into_iter().flat_map(|grid| self.tile_motion(grid));
        canvas.set_tiles(&self.contrast, motion);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Answer, Batch, Clock, Engine, Projection, SamplerKind, Surface, Tracer};
    use std::collections::VecDeque;

    /// Gathers every picture anew.
    struct Anew(Reproject);

    impl Reconstruction for Anew {
        fn keep(&mut self, kept: &Kept<'_>, display: &Display, findings: &mut Findings) {
            self.0.keep(kept, display, findings);
        }

        fn aim(&self, now: Time, canvas: &Canvas, requests: &mut [Request]) {
            self.0.aim(now, canvas, requests);
        }

        fn refresh(&mut self, refresh: &Refresh<'_>, canvas: &mut Canvas) {
            self.0.store.touched.mark_all();
            self.0.refresh(refresh, canvas);
        }

        fn picture(&self) -> &[[f32; 3]] {
            self.0.picture()
        }
    }

    /// A wall at rest with a lamp that flickers on a part of it, and before it a bar that moves until 0.4 s; in every fifth batch without
    /// surfaces.
    #[derive(Default)]
    struct Wall(VecDeque<Batch>);

    /// Column of the bar's left edge.
    fn bar(secs: f64) -> f32 {
        10.0 + 40.0 * secs.min(0.4) as f32
    }

    impl Tracer for Wall {
        fn submit(&mut self, batch: Batch) {
            self.0.push_back(batch);
        }

        fn collect(&mut self, _wait: bool) -> Option<Answer> {
            let batch = self.0.pop_front()?;
            let hit = |request: &Request| {
                let ([x, y], left) = (request.position_px(batch.size), bar(batch.scene_secs));
                let is_bar = x >= left && x < left + 9.0;
                let position = [if is_bar { x - left } else { x }, y, 0.0];
                let flickers = x > 70.0 && y > 30.0 && (20.0 * batch.scene_secs) as u32 % 2 == 1;
                let grey = 0.3 + 0.2 * (0.7 * position[0]).sin() * (0.5 * y).cos();
                let light = if flickers { 0.5 } else { 1.0 };
                let rgb = [light * grey, if is_bar { 0.0 } else { light * grey }, 0.1];
                (rgb, Surface { object: u32::from(is_bar), position, ..Surface::default() })
            };
            let (rgb, surfaces) = batch.requests.iter().map(hit).unzip();
            let surfaces: Vec<Surface> = if batch.id % 5 == 0 { Vec::new() } else { surfaces };
            Some(Answer::to(batch, rgb, surfaces))
        }

        fn pose(&mut self, secs: f64, _size: Size, pose: &mut Pose) -> bool {
            let at = |left: f32, depth: f32| {
                let rest = [0.0, 0.0, 0.0, 1.0];
                Projection([
                    [1.0, 0.0, 0.0, left],
                    [0.0, 1.0, 0.0, 0.0],
                    [0.0, 0.0, 0.0, depth],
                    rest,
                ])
            };
            pose.picture_from_object = vec![at(0.0, 2.0), at(bar(secs), 1.0)];
            true
        }
    }

    #[test]
    fn holes_have_been_traced_when_they_were_traced_last() {
        let (clock, sampler) = (Clock::simulated(60_000.0), SamplerKind::ADAPTIVE.build(3));
        let mut engine = Engine::new(Size::new(101, 45), clock, sampler, Wall::default());
        engine.set_reconstruction(Box::new(Reproject::new(ReprojectOptions::default())));
        let mut uncovered = 0;
        for refresh in 1..=30 {
            let time = Time(refresh * 1_000_000_000 / 60);
            engine.run_until(time).expect("finite colours");
            let before: Vec<(Time, bool)> =
                engine.canvas().time().zip(engine.canvas().known()).collect();
            engine.refresh(time);
            let after = engine.canvas().time().zip(engine.canvas().known());
            for ((was, was_known), (is, is_known)) in before.into_iter().zip(after) {
                assert!(is_known || is == was, "{was:?} {is:?}");
                uncovered += usize::from(was_known && !is_known);
            }
        }
        assert!(uncovered > 50, "{uncovered}");
    }

    #[test]
    fn what_stays_as_it_is_is_what_would_be_gathered_again() {
        for antialias in [false, true] {
            let options = ReprojectOptions { antialias, ..ReprojectOptions::default() };
            let engine = |reconstruction: Box<dyn Reconstruction>| {
                let size = Size::new(101, 45);
                let (clock, sampler) =
                    (Clock::simulated(120_000.0), SamplerKind::ADAPTIVE.build(3));
                let mut engine = Engine::new(size, clock, sampler, Wall::default());
                engine.set_reconstruction(reconstruction);
                engine
            };
            let mut lazy = engine(Box::new(Reproject::new(options)));
            let mut anew = engine(Box::new(Anew(Reproject::new(options))));
            for refresh in 1..=70 {
                let time = Time(refresh * 1_000_000_000 / 60);
                let look = |engine: &mut Engine<Wall>| {
                    engine.run_until(time).expect("finite colours");
                    let picture = engine.refresh(time).to_vec();
                    (picture, engine.canvas().clone())
                };
                assert!(look(&mut lazy) == look(&mut anew), "{antialias} {refresh}");
            }
        }
    }
}
