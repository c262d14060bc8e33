//! The render loop as the window sees it: an engine that takes commands and hands out pictures.
//!
//! No thread and no window here: see `render_thread.rs`.

use std::time::Duration;

use frameless::{
    AdaptiveOptions, Canvas, Clock, Display, Engine, EngineError, ReconstructionKind, Sampler,
    SamplerKind, Size, Time, Tracer,
};
use frameless_scene::View;

use crate::command::{Command, Picture, Status, ViewChoice};
use crate::overlay::HeatMaps;
use crate::rate::Counted;
use crate::settings::{Overlay, Settings};
use crate::shown::{self, Ages, Shown};

/// A renderer that can be pointed at another scene or from another place.
pub trait Stage: Tracer {
    /// A scene made ready for this renderer, in another thread.
    type World: Send + 'static;

    /// Batches submitted from now on look from there.
    fn set_view(&mut self, view: ViewChoice);

    /// How another thread moves the camera without waiting for the loop, before it tells the loop; `None`: not at all.
    fn steering(&self) -> Option<Steering> {
        None
    }

    /// Batches submitted from now on show that scene.
    fn set_world(&mut self, world: Self::World);

    /// Why no answers come, if it has failed and waits to be mended.
    fn trouble(&mut self) -> Option<String> {
        None
    }
}

/// Moves a renderer's camera to where the user has put it, from any thread.
pub type Steering = Box<dyn Fn(View) + Send>;

/// Makes a sampler that is none of [`SamplerKind`]'s.
pub type OwnSampler = Box<dyn FnMut() -> Box<dyn Sampler> + Send>;

/// An engine with its settings.
pub struct Session<S> {
    engine: Engine<Counted<S>>,
    settings: Settings,
    own_sampler: Option<OwnSampler>,
    seed: u64,
    held: Shown,
    heat_maps: HeatMaps,
    throughput: Throughput,
    mark: u64,
    refresh_threads: usize,
}

impl<S: Stage> Session<S> {
    /// A black picture.
    pub fn new(size: Size, clock: Clock, settings: Settings, seed: u64, stage: S) -> Self {
        let sampler = settings.sampler.build(seed);
        let mut engine = Engine::new(size, clock, sampler, Counted::new(stage));
        engine.set_budget(settings.samples_per_sec);
        engine.set_display(settings.display());
        engine.set_reconstruction(settings.reconstruction.build());
        let held = Shown::new(engine.canvas(), *engine.display());
        let (heat_maps, throughput) = (HeatMaps::default(), Throughput::default());
        let settings = Settings { own_sampler: None, ..settings };
        Session {
            engine,
            settings,
            own_sampler: None,
            seed,
            held,
            heat_maps,
            throughput,
            mark: 0,
            refresh_threads: 1,
        }
    }

    /// Another sampler among those that the user may choose from; it begins.
    pub fn with_own_sampler(mut self, mut make: OwnSampler) -> Self {
        self.engine.set_sampler(make());
        self.settings.own_sampler = Some(true);
        self.own_sampler = Some(make);
        self
    }

    /// Make pictures with so many threads; 0: one per core. One, unless this is called.
    pub fn with_refresh_threads(mut self, threads: usize) -> Self {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        let threads = if threads == 0 { cores() } else { threads };
        self.refresh_threads = threads.min(MOST_REFRESH_THREADS);
        self
    }

    /// See [`Stage::steering`].
    pub fn steering(&self) -> Option<Steering> {
        self.engine.tracer().tracer.steering()
    }

    /// One turn of the loop.
    pub fn step(&mut self) -> Result<usize, EngineError> {
        let outcome = self.engine.step();
        if self.settings.overlay == Overlay::Change {
            let size = self.engine.canvas().size();
            self.heat_maps.note_changes(size, self.engine.observations());
        }
        outcome
    }

    /// See [`Engine::pause`].
    pub fn pause(&self) -> Duration {
        self.engine.pause()
    }

    /// The present time of the engine's clock.
    pub fn now(&self) -> Time {
        self.engine.now()
    }

    /// Does what the window asks for; a wish for a picture, or for rest, is for the caller to keep.
    pub fn apply(&mut self, command: Command<S::World>) {
        let now = self.engine.now();
        match command {
            Command::Settings(settings) => self.set(settings),
            Command::Size(size) => {
                self.engine.resize(size);
                self.heat_maps.forget_changes();
            }
            Command::View(view) => self.engine.tracer_mut().tracer.set_view(view),
            Command::Scene(world) => {
                let renderer = self.engine.tracer_mut();
                renderer.begin_scene();
                renderer.tracer.set_world(world);
                renderer.tracer.set_view(ViewChoice::Camera(0));
                self.engine.timeline_mut().seek(now, 0.0);
                // The old scene's surfaces are not in the new one.
                self.engine.set_reconstruction(self.settings.reconstruction.build());
            }
            Command::Play(true) => self.engine.timeline_mut().play(now),
            Command::Play(false) => self.engine.timeline_mut().pause(now),
            Command::Seek(scene_secs) => self.engine.timeline_mut().seek(now, scene_secs),
            Command::Speed(speed) => self.engine.timeline_mut().set_speed(now, speed),
            Command::Mark(mark) => self.mark = mark,
            // For the loop around this.
            Command::WantPicture { .. } | Command::Rest(_) => {}
        }
    }

    /// How it is set.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Width and height of its pictures.
    pub fn size(&self) -> Size {
        self.engine.canvas().size()
    }

    /// Applies what differs, so that moving one slider does not make the sampler forget what it has learned.
    fn set(&mut self, new: Settings) {
        let own_sampler = self.own_sampler.as_ref().map(|_| new.own_sampler == Some(true));
        let new = Settings { own_sampler, ..new };
        let old = std::mem::replace(&mut self.settings, new);
        self.set_sampler(&old, &new);
        if new.samples_per_sec != old.samples_per_sec {
            self.engine.set_budget(new.samples_per_sec);
        }
        if new.display() != old.display() {
            self.engine.set_display(new.display());
        }
        if new.reconstruction != old.reconstruction {
            self.engine.set_reconstruction(new.reconstruction.build());
        }
        if new.overlay != Overlay::SamplingRate {
            self.engine.tracer_mut().stop_counting();
        }
        if new.overlay != Overlay::Change {
            self.heat_maps.forget_changes();
        }
    }

    fn set_sampler(&mut self, old: &Settings, new: &Settings) {
        if let (Some(true), Some(make)) = (new.own_sampler, &mut self.own_sampler) {
            if old.own_sampler != Some(true) {
                self.engine.set_sampler(make());
            }
            return;
        }
        match (old.sampler, new.sampler) {
            (SamplerKind::Adaptive(before), SamplerKind::Adaptive(now))
                if old.own_sampler == new.own_sampler
                    && (AdaptiveOptions { temporal: now.temporal, ..before }) == now =>
            {
                self.engine.set_temporal(now.temporal);
            }
            (before, now) if before == now && old.own_sampler == new.own_sampler => {}
            (_, now) => {
                // Another seed than before: a sampler chosen again does not repeat itself.
                self.seed = self.seed.wrapping_add(1);
                self.engine.set_sampler(now.build(self.seed));
            }
        }
    }

    /// See [`Stage::trouble`].
    pub fn trouble(&mut self) -> Option<String> {
        self.engine.tracer_mut().tracer.trouble()
    }

    /// Whether there is more than the first few samples, or no hope of more soon. The first batches are tiny, until the clock
    /// knows the renderer; a picture of them would show nothing, cost as much as any, and put off the next.
    pub fn is_worth_showing(&self) -> bool {
        let enough = self.engine.canvas().size().pixels() as u64 / PIXELS_PER_FIRST_SAMPLE;
        self.engine.counters().kept >= enough || self.now() >= FIRST_PICTURE_AT_LATEST
    }

    /// Whether [`Session::begin_picture`] is possible now: where it [is](Engine::can_refresh_beside) at all, and no overlay is shown, which is drawn of
    /// what only the loop knows. Elsewhere [`Session::picture`] makes it at once.
    pub fn can_begin_picture(&self) -> bool {
        self.settings.overlay == Overlay::None && self.engine.can_refresh_beside()
    }

    /// Begins to make the picture of now beside the loop, in reused memory, with all [threads](Session::with_refresh_threads) or with half of
    /// them, so that the loop has the others. `show` is given it when it is ready, and `end` is called when
    /// [`Session::end_picture`] will not have to wait any longer, both in a thread of the picture's.
    ///
    /// # Panics
    /// If it is [not possible](Session::can_begin_picture), or the system has no thread left.
    pub fn begin_picture(
        &mut self,
        memory: Vec<[u8; 4]>,
        with_half: bool,
        show: impl FnOnce(Picture) + Send + 'static,
        end: impl FnOnce() + Send + 'static,
    ) {
        let now = self.engine.now();
        let (size, mark, status) = (self.size(), self.mark, self.status(now));
        let show = move |picture: &[[f32; 3]], canvas: &Canvas| {
            let mut rgba = memory;
            rgba.clear();
            rgba.extend(picture.iter().map(|&colour| rgba8(colour)));
            let status = Status { ages: shown::ages(canvas, now), ..status };
            show(Picture { size, rgba, mark, status });
        };
        let threads =
            if with_half { self.refresh_threads.div_ceil(2) } else { self.refresh_threads };
        self.engine.set_refresh_threads(threads);
        self.engine.refresh_beside(now, show, end);
    }

    /// Whether a picture is being made beside the loop.
    pub fn is_making(&self) -> bool {
        self.engine.is_refreshing()
    }

    /// Waits for the picture that is being made beside the loop, if one is.
    pub fn end_picture(&mut self) {
        self.engine.end_refresh();
    }

    /// The picture now, in reused memory.
    pub fn picture(&mut self, memory: Vec<[u8; 4]>) -> Picture {
        let now = self.engine.now();
        let mut rgba = memory;
        rgba.clear();
        match self.settings.reconstruction {
            // Only what is new has changed.
            ReconstructionKind::Hold => {
                self.held.update(self.engine.canvas(), *self.engine.display());
                rgba.extend_from_slice(self.held.rgba());
            }
            ReconstructionKind::Filter | ReconstructionKind::Reproject(_) => {
                self.engine.set_refresh_threads(self.refresh_threads);
                rgba.extend(self.engine.refresh(now).iter().map(|&colour| rgba8(colour)));
            }
        }
        let overlay = self.heat_maps.draw(self.settings.overlay, &mut self.engine, &mut rgba);
        let ages = shown::ages(self.engine.canvas(), now);
        let status = Status { ages, overlay, ..self.status(now) };
        Picture { size: self.size(), rgba, mark: self.mark, status }
    }

    /// What is known before the picture is made.
    fn status(&mut self, now: Time) -> Status {
        let throughput = self.throughput.update(now, self.engine.counters().kept);
        Status {
            scene_secs: self.engine.timeline().scene_secs(now),
            samples_per_sec: throughput.samples_per_sec,
            pictures_per_sec: throughput.pictures_per_sec,
            ages: Ages::default(),
            overlay: None,
        }
    }
}

// Starting more takes longer than they save.
const MOST_REFRESH_THREADS: usize = 8;
// One sample in 8×8 pixels is a sketch of the picture.
const PIXELS_PER_FIRST_SAMPLE: u64 = 64;
// For renderers that need longer.
const FIRST_PICTURE_AT_LATEST: Time = Time(500_000_000);

/// 8 bits per channel of a display-referred colour, with alpha 255.
fn rgba8(colour: [f32; 3]) -> [u8; 4] {
    let [r, g, b] = colour.map(Display::quantize);
    [r, g, b, 255]
}

/// Samples and pictures per second over the last stretch of at least [`STRETCH_SECS`].
#[derive(Clone, Copy, Debug, Default)]
struct Throughput {
    since: Time,
    kept: u64,
    pictures: u32,
    samples_per_sec: f64,
    pictures_per_sec: f64,
}

// Shorter and the number flickers, longer and it lags behind the slider.
const STRETCH_SECS: f64 = 0.25;

impl Throughput {
    /// Told at every picture how many samples have been kept so far.
    fn update(&mut self, now: Time, kept: u64) -> Throughput {
        self.pictures += 1;
        let secs = now.secs_since(self.since);
        if secs >= STRETCH_SECS {
            let samples_per_sec = (kept - self.kept) as f64 / secs;
            let pictures_per_sec = f64::from(self.pictures) / secs;
            *self = Throughput { since: now, kept, pictures: 0, samples_per_sec, pictures_per_sec };
        }
        *self
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use frameless::{SamplerKind, ToneMap};

    use super::*;
    use crate::overlay::Drawn;
    use crate::test_stage::Plain;

    const KINDS: [ReconstructionKind; 3] =
        [ReconstructionKind::Hold, ReconstructionKind::Filter, ReconstructionKind::REPROJECT];

    /// A session with every pixel traced at least once.
    fn white_session() -> Session<Plain> {
        white_session_with(ReconstructionKind::default())
    }

    fn white_session_with(reconstruction: ReconstructionKind) -> Session<Plain> {
        let sampler = SamplerKind::Permutation;
        let tone_map = ToneMap::None;
        let settings = Settings { sampler, reconstruction, tone_map, ..Settings::default() };
        let clock = Clock::simulated(100_000.0);
        let mut session = Session::new(Size::new(40, 30), clock, settings, 1, Plain::new(1.0));
        run(&mut session, 0.1);
        assert_eq!(brightness(&mut session), 255.0);
        session
    }

    fn run(session: &mut Session<Plain>, secs: f64) {
        let end = Time::from_secs(session.now().secs() + secs);
        while session.now() < end {
            session.step().unwrap();
        }
    }

    /// Mean of the picture's red channel.
    fn brightness(session: &mut Session<Plain>) -> f64 {
        let picture = session.picture(Vec::new());
        assert_eq!(picture.rgba.len(), picture.size.pixels());
        let sum: f64 = picture.rgba.iter().map(|&[red, ..]| f64::from(red)).sum();
        sum / picture.rgba.len() as f64
    }

    #[test]
    fn the_picture_survives_every_change_of_settings() {
        let mut session = white_session();
        let before = session.settings;
        for sampler in [SamplerKind::Random, SamplerKind::Change { w_d: 0.5, tile: 7 }] {
            session.apply(Command::Settings(Settings { sampler, ..before }));
            assert_eq!(brightness(&mut session), 255.0, "{sampler:?}");
        }
        for reconstruction in KINDS {
            session.apply(Command::Settings(Settings { reconstruction, ..before }));
            assert_eq!(brightness(&mut session), 255.0, "{reconstruction:?}");
        }
        let budget = Settings { samples_per_sec: Some(1000.0), ..before };
        session.apply(Command::Settings(budget));
        session.apply(Command::View(ViewChoice::Camera(1)));
        session.apply(Command::Play(false));
        session.apply(Command::Seek(1.0));
        session.apply(Command::Speed(2.0));
        assert_eq!(brightness(&mut session), 255.0);
        assert_eq!(session.engine.tracer().tracer.view, ViewChoice::Camera(1));
    }

    /// A session on the real clock, with every pixel traced and one picture made.
    fn real_session(reconstruction: ReconstructionKind) -> Session<Plain> {
        let (sampler, tone_map) = (SamplerKind::Permutation, ToneMap::None);
        let settings = Settings { sampler, reconstruction, tone_map, ..Settings::default() };
        let (size, plain) = (Size::new(40, 30), Plain::new(1.0));
        let mut session = Session::new(size, Clock::real(), settings, 1, plain);
        assert!(!session.can_begin_picture(), "the first picture of a size");
        while session.picture(Vec::new()).status.ages.unknown > 0 {
            session.step().unwrap();
        }
        session
    }

    #[test]
    fn a_picture_made_beside_the_loop_is_the_picture() {
        let mut session = real_session(ReconstructionKind::REPROJECT);
        session.apply(Command::Mark(5));
        let (shown, made) = channel();
        let ended = shown.clone();
        session.begin_picture(
            vec![[7; 4]; 3],
            false,
            move |picture| shown.send(Some(picture)).unwrap(),
            move || ended.send(None).unwrap(),
        );
        assert!(session.is_making() && !session.can_begin_picture(), "one at a time");
        session.apply(Command::Mark(6));
        let picture = made.recv().unwrap().expect("shown first");
        assert_eq!((picture.size, picture.mark), (session.size(), 5), "marks after it began");
        assert!(picture.rgba.iter().all(|&pixel| pixel == [255; 4]));
        assert_eq!(picture.status.ages.unknown, 0);
        assert!(made.recv().unwrap().is_none(), "the end");
        session.end_picture();
        assert!(!session.is_making() && session.can_begin_picture());
    }

    #[test]
    fn what_is_made_of_the_canvas_or_of_the_loops_knowledge_is_not_made_beside_it() {
        for kind in [ReconstructionKind::Hold, ReconstructionKind::Filter] {
            assert!(!real_session(kind).can_begin_picture(), "{kind:?}");
        }
        let mut session = real_session(ReconstructionKind::REPROJECT);
        assert!(session.can_begin_picture());
        let overlay = Overlay::Change;
        session.apply(Command::Settings(Settings { overlay, ..session.settings }));
        assert!(!session.can_begin_picture());
        let simulated = white_session_with(ReconstructionKind::REPROJECT);
        assert!(!simulated.can_begin_picture(), "the same bytes every time");
    }

    #[test]
    fn the_picture_survives_a_resize() {
        for (sampler, reconstruction) in KINDS.map(|kind| (SamplerKind::ADAPTIVE, kind)) {
            let mut session = white_session_with(reconstruction);
            session.apply(Command::Settings(Settings { sampler, ..session.settings }));
            run(&mut session, 0.05);
            session.apply(Command::Size(Size::new(77, 13)));
            // At once: nothing has been chosen yet in the new size.
            assert_eq!(session.picture(Vec::new()).size, Size::new(77, 13));
            assert_eq!(brightness(&mut session), 255.0, "{reconstruction:?}");
            run(&mut session, 0.05);
            assert_eq!(brightness(&mut session), 255.0, "{reconstruction:?}");
        }
    }

    #[test]
    fn another_scene_takes_the_picture_over_pixel_by_pixel() {
        for reconstruction in KINDS {
            let mut session = white_session_with(reconstruction);
            session.apply(Command::View(ViewChoice::Camera(3)));
            session.apply(Command::Scene(0.0));
            assert_eq!(brightness(&mut session), 255.0, "{reconstruction:?}");
            assert_eq!(session.engine.tracer().tracer.view, ViewChoice::Camera(0));
            assert_eq!(session.picture(Vec::new()).status.scene_secs, 0.0);
            // 1,200 pixels at 100,000 samples/s take 12 ms.
            run(&mut session, 0.006);
            let half = brightness(&mut session);
            assert!((64.0..192.0).contains(&half), "half the pixels are new: {half}");
            run(&mut session, 0.05);
            assert_eq!(brightness(&mut session), 0.0, "{reconstruction:?}");
        }
    }

    #[test]
    fn exposure_changes_the_picture_without_a_sample() {
        for reconstruction in KINDS {
            let mut session = white_session_with(reconstruction);
            let exposure_stops = -2.0;
            session.apply(Command::Settings(Settings { exposure_stops, ..session.settings }));
            // sRGB of 0.25 is 0.537.
            assert_eq!(brightness(&mut session), 137.0, "{reconstruction:?}");
        }
    }

    #[test]
    fn another_reconstruction_begins_with_what_is_held() {
        let mut session = white_session_with(ReconstructionKind::Hold);
        session.engine.tracer_mut().tracer.striped = true;
        run(&mut session, 0.1);
        let held = session.picture(Vec::new());
        for reconstruction in KINDS {
            let other = Settings { reconstruction, ..session.settings };
            session.apply(Command::Settings(other));
            let shown = session.picture(Vec::new());
            assert_eq!(shown.rgba, held.rgba, "{reconstruction:?}");
            assert_eq!(shown.status.ages.unknown, 0, "{reconstruction:?}");
            let later_secs = shown.status.ages.mean_secs - held.status.ages.mean_secs;
            assert!(later_secs.abs() < 1e-3, "{reconstruction:?}: {later_secs} s older");
        }
    }

    #[test]
    fn what_has_been_learned_stays_when_temporal_is_traded_against_spatial() {
        let mut session = white_session();
        let adaptive = Settings { sampler: SamplerKind::ADAPTIVE, ..session.settings };
        session.apply(Command::Settings(adaptive));
        run(&mut session, 0.05);
        session.apply(Command::Scene(0.0));
        run(&mut session, 0.05);
        let learned = |session: &Session<Plain>| session.engine.rates().map(|r| r.of_pixel(0));
        let before = learned(&session);
        assert!(before > Some(0.0), "{before:?}");
        let sampler =
            SamplerKind::Adaptive(AdaptiveOptions { temporal: 0.9, ..AdaptiveOptions::default() });
        session.apply(Command::Settings(Settings { sampler, ..adaptive }));
        assert_eq!(learned(&session), before);
    }

    #[test]
    fn encoding_what_is_new_is_encoding_all() {
        let mut session = white_session_with(ReconstructionKind::Hold);
        for grey in [0.1, 0.7, 0.3] {
            session.apply(Command::Scene(grey));
            run(&mut session, 0.004);
            let shown = session.picture(vec![[7; 4]; 3]).rgba;
            assert_eq!(shown, frameless::hold(session.engine.canvas(), session.engine.display()));
            assert!(shown.iter().any(|pixel| *pixel != shown[0]), "only part of it is new");
        }
    }

    #[test]
    fn resizing_there_and_back_between_two_pictures_shows_what_is_there() {
        let mut session = white_session_with(ReconstructionKind::Hold);
        session.engine.tracer_mut().tracer.striped = true;
        run(&mut session, 0.1);
        session.picture(Vec::new());
        // Same times afterwards, since a batch has one, but at other pixels.
        session.apply(Command::Size(Size::new(30, 30)));
        session.apply(Command::Size(Size::new(40, 30)));
        let shown = session.picture(Vec::new()).rgba;
        assert_eq!(shown, frameless::hold(session.engine.canvas(), session.engine.display()));
    }

    #[test]
    fn pausing_stops_the_scenes_time_and_not_the_loop() {
        let mut session = white_session();
        session.apply(Command::Play(false));
        let before = session.picture(Vec::new()).status.scene_secs;
        let kept = session.engine.counters().kept;
        run(&mut session, 0.1);
        assert_eq!(session.picture(Vec::new()).status.scene_secs, before);
        assert!(session.engine.counters().kept > kept + 5_000);
    }

    #[test]
    fn an_own_sampler_chooses_until_another_is_chosen_and_when_it_is_chosen_again() {
        let make = || -> Box<dyn frameless::Sampler> { Box::new(First) };
        let mut session =
            white_session_with(ReconstructionKind::Hold).with_own_sampler(Box::new(make));
        let own = session.settings;
        session.apply(Command::Scene(0.0));
        run(&mut session, 0.05);
        assert!(brightness(&mut session) > 254.0, "only the first pixel is looked at");
        for (settings, is_own) in [
            (Settings { own_sampler: Some(false), ..own }, Some(false)),
            (own, Some(true)),
            (Settings { own_sampler: None, ..own }, Some(false)),
        ] {
            session.apply(Command::Settings(settings));
            assert_eq!(session.settings().own_sampler, is_own);
        }
        run(&mut session, 0.05);
        assert_eq!(brightness(&mut session), 0.0);
        let mut plain = white_session();
        plain.apply(Command::Settings(own));
        assert_eq!(plain.settings().own_sampler, None, "it has none");
    }

    /// Looks at one pixel.
    struct First;

    impl Sampler for First {
        fn choose(
            &mut self,
            _: Time,
            _: &frameless::Canvas,
            count: usize,
            requests: &mut Vec<frameless::Request>,
        ) {
            requests.extend((0..count).map(|_| frameless::Request::centre(0)));
        }
    }

    #[test]
    fn every_overlay_has_a_legend_and_the_picture_comes_back() {
        let mut session = white_session();
        let adaptive = Settings { sampler: SamplerKind::ADAPTIVE, ..session.settings };
        for overlay in Overlay::ALL.into_iter().filter(|&overlay| overlay != Overlay::None) {
            session.apply(Command::Settings(Settings { overlay, ..adaptive }));
            session.picture(Vec::new());
            run(&mut session, 0.5);
            let drawn = session.picture(Vec::new()).status.overlay;
            assert!(matches!(drawn, Some(Drawn::HeatMap(_))), "{overlay:?}: {drawn:?}");
            assert_ne!(brightness(&mut session), 255.0, "{overlay:?}");
        }
        session.apply(Command::Settings(adaptive));
        assert_eq!(session.picture(Vec::new()).status.overlay, None);
        assert_eq!(brightness(&mut session), 255.0);
    }

    #[test]
    fn a_sampler_that_knows_nothing_shows_the_picture() {
        let mut session = white_session();
        for overlay in [Overlay::TileProbability, Overlay::LearnedRate] {
            session.apply(Command::Settings(Settings { overlay, ..session.settings }));
            assert_eq!(session.picture(Vec::new()).status.overlay, Some(Drawn::Unknown));
            assert_eq!(brightness(&mut session), 255.0);
        }
    }

    #[test]
    fn change_is_seen_whoever_chooses_the_pixels() {
        for sampler in SamplerKind::ALL {
            let mut session = white_session();
            let overlay = Overlay::Change;
            session.apply(Command::Settings(Settings { sampler, overlay, ..session.settings }));
            run(&mut session, 0.05);
            let calm = brightness(&mut session);
            session.apply(Command::Scene(0.0));
            run(&mut session, 0.01);
            let changed = brightness(&mut session);
            assert!(calm < 1.0 && changed > 20.0, "{sampler:?}: {calm}, then {changed}");
            session.apply(Command::Size(Size::new(10, 10)));
            assert!(brightness(&mut session) < 1.0, "nothing is known of these pixels");
        }
    }

    #[test]
    fn the_first_picture_waits_for_a_sketch_but_not_for_a_slow_renderer() {
        for (samples_per_sec, wait_secs) in [(100_000.0, 0.0), (1.0, 0.5)] {
            let (size, clock) = (Size::new(64, 64), Clock::simulated(samples_per_sec));
            let settings = Settings::default();
            let mut session = Session::new(size, clock, settings, 1, Plain::new(1.0));
            assert!(!session.is_worth_showing());
            run(&mut session, wait_secs + 0.01);
            assert!(session.is_worth_showing(), "at {samples_per_sec} samples/s");
        }
    }

    #[test]
    fn holes_are_marked_until_they_are_traced() {
        let overlay = Overlay::Holes;
        let settings = Settings { overlay, ..Settings::default() };
        let clock = Clock::simulated(100_000.0);
        let mut session = Session::new(Size::new(40, 30), clock, settings, 1, Plain::new(1.0));
        // Known pixels are grey: a third of white.
        let yellow = |session: &mut Session<Plain>| {
            let picture = session.picture(Vec::new());
            let marked = picture.rgba.iter().filter(|[_, _, blue, _]| *blue == 40).count();
            assert_eq!(marked, picture.status.ages.unknown);
            marked
        };
        assert_eq!(yellow(&mut session), 1200);
        run(&mut session, 0.005);
        assert!((600..1200).contains(&yellow(&mut session)));
        run(&mut session, 0.1);
        assert_eq!(yellow(&mut session), 0);
    }

    #[test]
    fn throughput_and_ages_are_those_of_the_simulated_clock() {
        // With antialias most looks at what rests would add to its samples, and leave their age.
        let mut session = white_session_with(ReconstructionKind::Hold);
        session.picture(Vec::new());
        run(&mut session, 1.0);
        let status = session.picture(Vec::new()).status;
        assert!((status.samples_per_sec / 100_000.0 - 1.0).abs() < 0.02, "{status:?}");
        assert_eq!(status.ages.unknown, 0);
        // A permutation visits each of 1,200 pixels every 12 ms, at most twice that from one pass to the next.
        assert!((0.004..0.008).contains(&status.ages.mean_secs), "{status:?}");
        assert!((0.008..0.026).contains(&status.ages.max_secs), "{status:?}");
    }
}
