//! THE LOOP: choose pixels → trace them now → keep the samples → observe what changed.

use std::collections::VecDeque;
use std::time::Duration;

use thiserror::Error;

use crate::add_up::AddUp;
use crate::beside::{Beside, Late, Order, Told, Work};
use crate::replaced::Replaced;
use crate::{
    Answer, Batch, Canvas, Clock, Display, Findings, Hold, Kept, Lighting, Observation, Pose,
    Rates, Reconstruction, Refresh, Request, Sampler, Size, Time, Timeline, Tracer, Weights,
};

/// Everything that runs a frameless picture: a clock, a sampler, a renderer, and the canvas between them.
pub struct Engine<T> {
    clock: Clock,
    timeline: Timeline,
    display: Display,
    canvas: Canvas,
    sampler: Box<dyn Sampler>,
    add_up: AddUp,
    reconstruction: Box<dyn Reconstruction>,
    // Whether it has made no picture of this canvas yet.
    is_first_picture: bool,
    tracer: T,
    // Samples submitted and not yet answered.
    outstanding: usize,
    counters: Counters,
    // The first batch of the canvas's present size.
    first_batch: u64,
    // Reused from batch to batch.
    spare_requests: Vec<Request>,
    replaced: Replaced,
    findings: Findings,
    observations: Vec<Observation>,
    pose: Pose,
    lighting: Lighting,
    refresh_threads: usize,
    // A picture under way has the reconstruction, and then the canvas with it.
    beside: Option<Beside>,
    // It has all of the renderer's threads.
    gives_way: bool,
    beside_canvas: Option<Canvas>,
    // What samples told that came meanwhile, of which the sampler has not heard yet.
    unheard: VecDeque<Told>,
    late: Late,
    spare_replaced: Vec<Replaced>,
}

/// What the loop has done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Batches chosen, but for empty ones.
    pub batches: u64,
    /// Samples written to the canvas.
    pub kept: u64,
    /// Samples that came too late: the pixel had a newer one, or the picture another size.
    pub dropped: u64,
}

/// A renderer's answer that cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum EngineError {
    /// A colour that is NaN or infinite.
    #[error(
        "the renderer returned a colour that is not finite, {rgb:?}, for pixel ({x}, {y}) at scene time {scene_secs} s"
    )]
    NotFinite {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
        /// Scene time in seconds.
        scene_secs: f64,
        /// The colour.
        rgb: [f32; 3],
    },
    /// Arrays of the wrong length.
    #[error(
        "the renderer answered {requests} requests with {colours} colours and {surfaces} surfaces \
         (wanted: as many colours, and as many surfaces or none)"
    )]
    WrongLength {
        /// Requests in the answer.
        requests: usize,
        /// Colours in the answer.
        colours: usize,
        /// Surfaces in the answer.
        surfaces: usize,
    },
    /// A pixel that is not on the canvas.
    #[error("the renderer answered for pixel number {pixel}, but {width}×{height} has none such")]
    NoSuchPixel {
        /// The index in the answer.
        pixel: u32,
        /// The canvas's width.
        width: u32,
        /// The canvas's height.
        height: u32,
    },
}

impl Answer {
    /// The first sample that cannot be kept, and why.
    fn first_bad(&self) -> Option<(usize, EngineError)> {
        let pixels = self.size.pixels();
        let is_good = |(request, rgb): (&Request, &[f32; 3])| {
            ((request.pixel as usize) < pixels)
                & rgb.iter().fold(true, |all, c| all & c.is_finite())
        };
        let samples = || self.requests.iter().zip(&self.rgb);
        // Without a way out, which lets several be looked at at once.
        if samples().fold(true, |all, sample| all & is_good(sample)) {
            return None;
        }
        let index = samples().position(|sample| !is_good(sample))?;
        let (pixel, rgb) = (self.requests[index].pixel, self.rgb[index]);
        let Size { width, height } = self.size;
        let error = match self.size.xy(pixel) {
            _ if pixel as usize >= pixels => EngineError::NoSuchPixel { pixel, width, height },
            (x, y) => EngineError::NotFinite { x, y, scene_secs: self.scene_secs, rgb },
        };
        Some((index, error))
    }
}

/// Batches under way at once on the real clock: while one is traced the next is chosen.
const PIPELINE_DEPTH: usize = 2;

/// While a picture has all threads there is a turn of the loop this often. Input is answered at once all the same; more often, and the
/// picture takes longer.
const PAUSE: Duration = Duration::from_millis(2);

/// Such a turn takes this part of the time of others.
const BRIEF: usize = 2;

/// After a picture that was made beside the loop: of so many answers that came meanwhile the sampler hears, and so many are told to the
/// reconstruction, per answer that comes, until none waits. More at once would hold up the loop, fewer would not be through before the next
/// picture.
const UNHEARD_PER_ANSWER: usize = 8;
const LATE_PER_ANSWER: usize = 3;

impl<T: Tracer> Engine<T> {
    /// A loop over a black canvas.
    pub fn new(size: Size, clock: Clock, sampler: Box<dyn Sampler>, tracer: T) -> Engine<T> {
        Engine::with_canvas(Canvas::new(size), clock, sampler, tracer)
    }

    /// A loop that goes on with an existing picture.
    pub fn with_canvas(
        canvas: Canvas,
        clock: Clock,
        sampler: Box<dyn Sampler>,
        tracer: T,
    ) -> Engine<T> {
        Engine {
            clock,
            timeline: Timeline::default(),
            display: Display::default(),
            canvas,
            sampler,
            add_up: AddUp::default(),
            reconstruction: Box::new(Hold::default()),
            is_first_picture: true,
            tracer,
            outstanding: 0,
            counters: Counters::default(),
            first_batch: 0,
            spare_requests: Vec::new(),
            replaced: Replaced::default(),
            findings: Findings::default(),
            observations: Vec::new(),
            pose: Pose::default(),
            lighting: Lighting::default(),
            refresh_threads: 1,
            beside: None,
            gives_way: false,
            beside_canvas: None,
            unheard: VecDeque::new(),
            late: Late::new(),
            spare_replaced: Vec::new(),
        }
    }

    /// One turn of the loop, about 1 ms. Returns how many samples were kept.
    ///
    /// On the simulated clock: one batch, chosen, traced, kept and observed. On the real clock: batches are
    /// chosen until the renderer has enough to do, then one answer is awaited.
    ///
    /// # Errors
    /// If the renderer's answer cannot be used. Its good samples before the bad one are kept, and the loop can
    /// go on.
    pub fn step(&mut self) -> Result<usize, EngineError> {
        self.observations.clear();
        self.take_back_if_done();
        match &mut self.clock {
            Clock::Simulated(clock) => {
                let (now, count) = clock.next_batch();
                self.choose_and_submit(now, count);
                self.collect_all()
            }
            Clock::Real(_) => self.step_real(),
        }
    }

    /// Simulated clock: run every batch that begins before `end`.
    ///
    /// # Errors
    /// As [`Engine::step`].
    pub fn run_until(&mut self, end: Time) -> Result<(), EngineError> {
        while self.clock.now() < end {
            self.step()?;
        }
        Ok(())
    }

    fn step_real(&mut self) -> Result<usize, EngineError> {
        if let Clock::Real(clock) = &mut self.clock
            && let Some(wanted) = clock.next_call()
        {
            return self.step_call(wanted);
        }
        if self.gives_way {
            return self.step_briefly();
        }
        self.keep_busy();
        if self.outstanding == 0 {
            self.clock.rest();
            return Ok(0);
        }
        let kept = self.collect_one()?.unwrap_or(0);
        self.clock.answered(kept, self.outstanding > 0);
        Ok(kept)
    }

    /// Chooses batches until the renderer has enough to do.
    fn keep_busy(&mut self) {
        let batch = self.clock.batch_length().max(self.tracer.samples_at_once());
        while self.outstanding < PIPELINE_DEPTH * batch {
            let before = self.outstanding;
            self.choose_and_submit_due(batch);
            // Nothing is due, or the sampler knows no pixel to look at.
            if self.outstanding == before {
                return;
            }
        }
    }

    /// What is under way already, and so little more that it does not hold up the picture, which has all of the threads. How long it takes
    /// says nothing of the renderer.
    fn step_briefly(&mut self) -> Result<usize, EngineError> {
        let before = self.collect_all()?;
        let alone = self.clock.batch_length() / self.tracer.samples_at_once();
        self.choose_and_submit_due((alone / BRIEF).max(1));
        let kept = self.collect_all()?;
        self.clock.answered(0, false);
        Ok(before + kept)
    }

    /// One batch, awaited, for a renderer whose calls have a price.
    fn step_call(&mut self, wanted: usize) -> Result<usize, EngineError> {
        let batch = self.choose(wanted);
        let (now, samples) = (batch.now, batch.requests.len());
        if samples == 0 {
            self.clock.rest();
            return Ok(0);
        }
        self.outstanding += samples;
        self.tracer.submit(batch);
        let kept = self.collect_all()?;
        self.clock.called(samples, now);
        Ok(kept)
    }

    /// Real clock.
    fn choose_and_submit_due(&mut self, wanted: usize) {
        if let Clock::Real(clock) = &mut self.clock {
            let (now, count) = clock.next_batch(wanted);
            if count > 0 {
                self.choose_and_submit(now, count);
            }
        }
    }

    fn choose_and_submit(&mut self, now: Time, count: usize) {
        let batch = self.batch(now, count);
        self.outstanding += batch.requests.len();
        self.tracer.submit(batch);
    }

    fn batch(&mut self, now: Time, count: usize) -> Batch {
        let mut requests = std::mem::take(&mut self.spare_requests);
        requests.clear();
        if count > 0 {
            self.sampler.choose(now, &self.canvas, count, &mut requests);
        }
        if !self.sampler.refines() {
            self.add_up.turn(&self.canvas, &mut requests);
        }
        if self.beside.is_none() {
            self.reconstruction.aim(now, &self.canvas, &mut requests);
        }
        let (id, scene_secs) = (self.counters.batches, self.timeline.scene_secs(now));
        self.counters.batches += u64::from(!requests.is_empty());
        Batch { id, now, scene_secs, size: self.canvas.size(), requests }
    }

    /// Chooses a batch for a renderer that the caller drives, instead of [`Engine::step`]: nothing is submitted to the engine's
    /// own, and the answer is brought to [`Engine::answer`], whenever it comes, in parts, or never.
    ///
    /// Real clock: `wanted` samples; fewer, or none, within a budget. Simulated clock: as many as are due in the next slice of time,
    /// which may be none.
    pub fn choose(&mut self, wanted: usize) -> Batch {
        let (now, count) = match &mut self.clock {
            Clock::Simulated(clock) => clock.next_batch(),
            Clock::Real(clock) => clock.next_batch(wanted),
        };
        self.batch(now, count)
    }

    /// Keeps and observes an answer to (part of) a batch of [`Engine::choose`]. Returns how many samples were kept.
    ///
    /// # Errors
    /// As [`Engine::step`].
    pub fn answer(&mut self, mut answer: Answer) -> Result<usize, EngineError> {
        if answer.batch < self.first_batch {
            // Of another canvas, even if that had this one's size.
            self.counters.dropped += answer.requests.len() as u64;
            self.observations.clear();
            return Ok(0);
        }
        let outcome = self.keep(&mut answer);
        let kept = self.replaced.requests.len();
        self.counters.kept += kept as u64;
        self.tell(answer.now);
        self.spare_requests = answer.requests;
        outcome.map(|()| kept)
    }

    fn collect_all(&mut self) -> Result<usize, EngineError> {
        let mut total = 0;
        while self.outstanding > 0 {
            match self.collect_one()? {
                Some(kept) => total += kept,
                None => break,
            }
        }
        Ok(total)
    }

    /// Waits for an answer, keeps and observes it. `None`: the renderer has lost what was under way.
    fn collect_one(&mut self) -> Result<Option<usize>, EngineError> {
        let Some(answer) = self.tracer.collect(true) else {
            self.outstanding = 0;
            return Ok(None);
        };
        self.outstanding = self.outstanding.saturating_sub(answer.requests.len());
        self.answer(answer).map(Some)
    }

    /// Writes an answer to the canvas and notes what each sample replaced; its samples are taken out of it.
    fn keep(&mut self, answer: &mut Answer) -> Result<(), EngineError> {
        self.replaced.clear();
        let (requests, colours) = (answer.requests.len(), answer.rgb.len());
        let surfaces = answer.surfaces.len();
        if colours != requests || (surfaces != requests && surfaces != 0) {
            return Err(EngineError::WrongLength { requests, colours, surfaces });
        }
        if answer.size != self.canvas.size() {
            self.counters.dropped += requests as u64;
            return Ok(());
        }
        let (good, outcome) = match answer.first_bad() {
            Some((index, error)) => (index, Err(error)),
            None => (requests, Ok(())),
        };
        self.counters.dropped += self.replaced.put(answer, good, &mut self.canvas) as u64;
        outcome
    }

    /// Tells the sampler what the samples just kept have changed: later, if the reconstruction, which says so, is away or has others to
    /// look at before.
    fn tell(&mut self, now: Time) {
        self.observations.clear();
        if self.beside.is_none() && self.late.is_empty() {
            self.observe(now);
        } else {
            let spare = self.spare_replaced.pop().unwrap_or_default();
            let replaced = std::mem::replace(&mut self.replaced, spare);
            match &self.beside {
                Some(beside) => beside.tell(now, replaced),
                None => {
                    self.late.push_back((now, replaced));
                    (0..LATE_PER_ANSWER).for_each(|_| self.observe_late());
                }
            }
        }
        for _ in 0..UNHEARD_PER_ANSWER {
            let Some(Told { mut replaced, findings }) = self.unheard.pop_front() else { return };
            self.hear(&mut replaced, &findings);
            self.spare_replaced.push(replaced);
        }
    }

    fn observe_late(&mut self) {
        let Some((now, replaced)) = self.late.pop_front() else { return };
        self.spare_replaced.push(std::mem::replace(&mut self.replaced, replaced));
        self.observe(now);
    }

    /// Finds out what the samples just kept have changed, and tells the sampler.
    fn observe(&mut self, now: Time) {
        self.findings.changes.clear();
        self.findings.refinements.clear();
        let kept = self.replaced.kept(now, self.canvas.size(), self.tracer.is_noisy());
        self.reconstruction.keep(&kept, &self.display, &mut self.findings);
        let (mut replaced, findings) =
            (std::mem::take(&mut self.replaced), std::mem::take(&mut self.findings));
        self.hear(&mut replaced, &findings);
        (self.replaced, self.findings) = (replaced, findings);
    }

    fn hear(&mut self, replaced: &mut Replaced, findings: &Findings) {
        replaced.told.iter_mut().zip(&findings.changes).for_each(|(told, &d)| told.change = d);
        replaced.told.iter_mut().zip(&findings.refinements).for_each(|(t, &r)| t.refinement = r);
        std::mem::swap(&mut self.observations, &mut replaced.told);
        let told = match self.sampler.refines() {
            true => &self.observations,
            false => self.add_up.told(&self.observations),
        };
        self.sampler.observe(&self.canvas, told);
    }

    /// The picture at `now`, display-referred sRGB in [0, 1], row-major.
    pub fn refresh(&mut self, now: Time) -> &[[f32; 3]] {
        self.take_back();
        self.is_first_picture = false;
        let begin = self.clock.now();
        let (secs, size) = (self.timeline.scene_secs(now), self.canvas.size());
        let pose = self.tracer.pose(secs, size, &mut self.pose).then_some(&self.pose);
        let lighting =
            self.reconstruction.wants_lighting() && self.tracer.lighting(secs, &mut self.lighting);
        let lighting = lighting.then_some(&self.lighting);
        let rates = self.sampler.rates().filter(|rates| rates.size() == size);
        let (display, is_noisy) = (&self.display, self.tracer.is_noisy());
        let wants_motion = self.sampler.wants_motion();
        let refresh = Refresh {
            now,
            pose,
            lighting,
            display,
            is_noisy,
            rates,
            wants_motion,
            threads: self.refresh_threads,
        };
        self.reconstruction.refresh(&refresh, &mut self.canvas);
        self.clock.interrupted(begin);
        self.reconstruction.picture()
    }

    /// The picture of the last refresh; empty before the first, and while one is made beside the loop.
    pub fn picture(&self) -> &[[f32; 3]] {
        self.reconstruction.picture()
    }

    /// Whether [`Engine::refresh_beside`] is possible now: on the real clock, while no other picture is under way, and not where the
    /// picture is made of the canvas itself (by [`Hold`] and [`Filter`](crate::Filter), or as the first of its size).
    pub fn can_refresh_beside(&self) -> bool {
        let is_real = matches!(self.clock, Clock::Real(_));
        let has_samples = self.reconstruction.has_own_samples() && !self.is_first_picture;
        is_real && has_samples && self.beside.is_none()
    }

    /// Begins to make the picture at `now` in a thread of its own; the loop goes on, with the threads that the picture does not need. If it
    /// needs all, turns of the loop are brief, and come now and then (see [`Engine::pause`]).
    ///
    /// `show` is given the picture in that thread, when it is ready, with the canvas as it is then told to be: its colours are not those of the
    /// samples. `end` is called there once the loop can have everything back, which it has at its next [turn](Engine::step), or by
    /// [`Engine::end_refresh`]. Until then the sampler does not hear of what new samples told.
    ///
    /// # Panics
    /// If it is [not possible](Engine::can_refresh_beside), or the system has no thread left.
    pub fn refresh_beside(
        &mut self,
        now: Time,
        show: impl FnOnce(&[[f32; 3]], &Canvas) + Send + 'static,
        end: impl FnOnce() + Send + 'static,
    ) {
        assert!(self.can_refresh_beside(), "a picture cannot be made beside the loop now");
        let (secs, size) = (self.timeline.scene_secs(now), self.canvas.size());
        let order = Order {
            now,
            has_pose: self.tracer.pose(secs, size, &mut self.pose),
            has_lighting: self.reconstruction.wants_lighting()
                && self.tracer.lighting(secs, &mut self.lighting),
            display: self.display,
            is_noisy: self.tracer.is_noisy(),
            rates: self.sampler.rates().filter(|rates| rates.size() == size).cloned(),
            wants_motion: self.sampler.wants_motion(),
            threads: self.refresh_threads,
        };
        self.gives_way = !self.tracer.spare_threads(order.threads);
        let mut canvas = self.beside_canvas.take().unwrap_or_else(|| Canvas::new(size));
        canvas.copy_times(&self.canvas);
        let work = Work {
            reconstruction: std::mem::replace(&mut self.reconstruction, Box::new(Hold::default())),
            canvas,
            pose: std::mem::take(&mut self.pose),
            lighting: std::mem::take(&mut self.lighting),
            told: VecDeque::new(),
        };
        let late = std::mem::take(&mut self.late);
        self.beside = Some(Beside::start(work, order, late, show, end));
    }

    /// Whether a picture is being made beside the loop.
    pub fn is_refreshing(&self) -> bool {
        self.beside.is_some()
    }

    /// How long the next turn of the loop can wait if no input comes: not at all, but while a picture beside it has all threads.
    pub fn pause(&self) -> Duration {
        if self.gives_way { PAUSE } else { Duration::ZERO }
    }

    /// Waits for the picture that is being made beside the loop, if one is.
    pub fn end_refresh(&mut self) {
        self.take_back();
    }

    fn take_back_if_done(&mut self) {
        if self.beside.as_ref().is_some_and(Beside::is_done) {
            self.take_back();
        }
    }

    fn take_back(&mut self) {
        let Some(beside) = self.beside.take() else { return };
        let (work, late) = beside.end();
        let Work { reconstruction, mut canvas, pose, lighting, told } = work;
        self.tracer.spare_threads(0);
        self.gives_way = false;
        self.reconstruction = reconstruction;
        (self.pose, self.lighting) = (pose, lighting);
        self.canvas.take_all_but_colours(&mut canvas);
        self.beside_canvas = Some(canvas);
        self.unheard.extend(told);
        self.late = late;
        // The canvas that was away knows nothing of them.
        for (now, replaced) in &self.late {
            replaced.newest().for_each(|pixel| self.canvas.note(pixel, *now));
        }
    }

    /// Begin with a picture that is known already: its samples count as traced at their time, and nobody is told of changes.
    ///
    /// # Errors
    /// As [`Engine::step`].
    pub fn start_with(&mut self, answer: &Answer) -> Result<(), EngineError> {
        self.take_back();
        self.keep(&mut answer.clone())?;
        self.counters.kept += self.replaced.requests.len() as u64;
        self.observe(answer.now);
        Ok(())
    }

    /// Make pictures in another way from now on. What the canvas holds stays in its place; surfaces are learned anew. Also
    /// for a renderer that has been given another scene: surfaces of the one before mean nothing in it.
    pub fn set_reconstruction(&mut self, reconstruction: Box<dyn Reconstruction>) {
        self.take_back();
        self.reconstruction = reconstruction;
        self.hand_over_canvas();
    }

    /// Gives the reconstruction what the canvas holds, as samples without surfaces, with their times.
    fn hand_over_canvas(&mut self) {
        self.is_first_picture = true;
        self.unheard.clear();
        self.late.clear();
        let canvas = &self.canvas;
        let held = canvas.time().zip(canvas.known()).zip(0u32..);
        let held = held.filter(|((_, known), _)| *known).map(|((time, _), pixel)| (time, pixel));
        let mut held: Vec<(Time, u32)> = held.collect();
        held.sort_unstable();
        for batch in held.chunk_by(|(a, _), (b, _)| a == b) {
            let requests: Vec<Request> = batch.iter().map(|&(_, i)| Request::centre(i)).collect();
            let rgb: Vec<[f32; 3]> = batch.iter().map(|&(_, i)| canvas.rgb()[i as usize]).collect();
            let (now, size) = (batch[0].0, canvas.size());
            let kept = Kept {
                now,
                size,
                requests: &requests,
                new: &rgb,
                old: &rgb,
                surfaces: &[],
                is_noisy: false,
            };
            self.findings.changes.clear();
            self.reconstruction.keep(&kept, &self.display, &mut self.findings);
        }
    }

    /// Where its time comes from.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// The present time of the engine's clock.
    pub fn now(&self) -> Time {
        self.clock.now()
    }

    /// The samples kept so far.
    pub fn canvas(&self) -> &Canvas {
        &self.canvas
    }

    /// What the loop has done so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Who chooses the pixels.
    pub fn sampler(&self) -> &dyn Sampler {
        &*self.sampler
    }

    /// Let somebody else choose the pixels; the picture stays.
    pub fn set_sampler(&mut self, sampler: Box<dyn Sampler>) {
        self.replace_sampler(sampler);
    }

    /// As [`Engine::set_sampler`]; returns who has chosen until now.
    pub fn replace_sampler(&mut self, sampler: Box<dyn Sampler>) -> Box<dyn Sampler> {
        std::mem::replace(&mut self.sampler, sampler)
    }

    /// What has been learned of how fast each part of the picture changes; `None` if the sampler learns no such thing, or
    /// has not begun since the last change of size.
    pub fn rates(&self) -> Option<&Rates> {
        self.sampler.rates().filter(|rates| rates.size() == self.canvas.size())
    }

    /// What the sampler was told last in the last turn of the loop; empty if nothing. That is of the newest answer, but after a picture that
    /// was made beside the loop of answers that came meanwhile.
    pub fn observations(&self) -> &[Observation] {
        &self.observations
    }

    /// Trade temporal against spatial accuracy, see [`Sampler::set_temporal`].
    pub fn set_temporal(&mut self, temporal: f32) {
        self.sampler.set_temporal(temporal);
    }

    /// Count parts of the picture differently, see [`Weights`]. A sampler set later begins without.
    pub fn set_weights(&mut self, weights: &Weights) {
        self.sampler.set_weights(weights);
    }

    /// The renderer.
    pub fn tracer(&self) -> &T {
        &self.tracer
    }

    /// The renderer, to change its camera or its scene; what batches under way are answered with is for it to say.
    pub fn tracer_mut(&mut self) -> &mut T {
        &mut self.tracer
    }

    /// Exposure and transfer function.
    pub fn display(&self) -> &Display {
        &self.display
    }

    /// Change how radiance is shown. The samples stay as they are; changes are measured with the new display
    /// from the next sample on.
    pub fn set_display(&mut self, display: Display) {
        self.display = display;
    }

    /// Which moment of the scene is shown.
    pub fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    /// Play, pause, scrub.
    pub fn timeline_mut(&mut self) -> &mut Timeline {
        &mut self.timeline
    }

    /// Real clock: at most this many samples per second; `None`: as many as the renderer can. The simulated
    /// clock has its rate already and ignores this.
    pub fn set_budget(&mut self, samples_per_sec: Option<f64>) {
        if let Clock::Real(clock) = &mut self.clock {
            clock.set_budget(samples_per_sec);
        }
    }

    /// Make pictures with so many threads; 1 at first. For who shows pictures while nothing else is to be done: no samples are
    /// chosen meanwhile.
    pub fn set_refresh_threads(&mut self, threads: usize) {
        self.refresh_threads = threads.max(1);
    }

    /// Go on in another size with the same picture, resampled. Batches under way are dropped when they come.
    pub fn resize(&mut self, size: Size) {
        if size != self.canvas.size() {
            self.take_back();
            self.beside_canvas = None;
            self.canvas = self.canvas.resized(size);
            self.first_batch = self.counters.batches;
            self.observations.clear();
            self.hand_over_canvas();
        }
    }
}
