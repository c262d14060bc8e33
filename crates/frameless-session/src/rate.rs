//! How often each pixel is traced: a renderer that counts its answers, and knows which scene they are of.

use frameless::{Answer, Batch, Lighting, Pose, Size, Time, Tracer};

/// Samples per second of every pixel, smoothed over about a second.
///
/// Two sums, both fading with the same half-life: samples and seconds. Their quotient is right from the first
/// moment on, without a warm-up from zero.
#[derive(Clone, Debug)]
pub(crate) struct SamplingRate {
    size: Size,
    // Samples that came since the last update, per pixel.
    fresh: Vec<u16>,
    // Faded samples, per pixel.
    samples: Vec<f32>,
    // Faded seconds, the same for all pixels.
    secs: f32,
    updated: Time,
}

// Shorter shows single samples at 4 per pixel and second, longer smears what the sampler does.
const HALF_LIFE_SECS: f64 = 0.5;

impl SamplingRate {
    fn new(size: Size, now: Time) -> SamplingRate {
        let pixels = size.pixels();
        SamplingRate {
            size,
            fresh: vec![0; pixels],
            samples: vec![0.0; pixels],
            secs: 0.0,
            updated: now,
        }
    }

    fn count(&mut self, answer: &Answer) {
        if answer.size != self.size {
            return;
        }
        for request in &answer.requests {
            if let Some(fresh) = self.fresh.get_mut(request.pixel as usize) {
                *fresh = fresh.saturating_add(1);
            }
        }
    }

    fn update(&mut self, now: Time) {
        let elapsed = now.secs_since(self.updated);
        let keep = (-elapsed / HALF_LIFE_SECS).exp2() as f32;
        for (samples, fresh) in self.samples.iter_mut().zip(&mut self.fresh) {
            *samples = *samples * keep + f32::from(std::mem::take(fresh));
        }
        self.secs = self.secs * keep + elapsed as f32;
        self.updated = now;
    }

    /// Samples per second, per pixel, row-major; all zero before any time has passed.
    pub(crate) fn per_sec(&self) -> impl ExactSizeIterator<Item = f32> + Clone {
        let per_sec = if self.secs > 0.0 { self.secs.recip() } else { 0.0 };
        self.samples.iter().map(move |samples| samples * per_sec)
    }
}

/// A renderer whose answers can be counted per pixel, at a nanosecond or two per sample while somebody looks.
pub(crate) struct Counted<T> {
    /// The renderer itself.
    pub tracer: T,
    rate: Option<SamplingRate>,
    // The next batch's number, and the first that shows the present scene.
    next: u64,
    first_of_scene: u64,
}

impl<T> Counted<T> {
    /// Not counting yet.
    pub(crate) fn new(tracer: T) -> Counted<T> {
        Counted { tracer, rate: None, next: 0, first_of_scene: 0 }
    }

    /// The rate up to `now`; counting begins with the first call, and anew when the size changes.
    pub(crate) fn rate(&mut self, now: Time, size: Size) -> &SamplingRate {
        let kept = self.rate.take().filter(|rate| rate.size == size);
        let rate = self.rate.insert(kept.unwrap_or_else(|| SamplingRate::new(size, now)));
        rate.update(now);
        rate
    }

    /// The renderer has been given another scene: what batches under way have hit is not in it.
    pub(crate) fn begin_scene(&mut self) {
        self.first_of_scene = self.next;
    }

    /// Nobody looks any longer.
    pub(crate) fn stop_counting(&mut self) {
        self.rate = None;
    }
}

impl<T: Tracer> Tracer for Counted<T> {
    fn submit(&mut self, batch: Batch) {
        self.next = batch.id + 1;
        self.tracer.submit(batch)
    }

    fn collect(&mut self, wait: bool) -> Option<Answer> {
        let mut answer = self.tracer.collect(wait)?;
        if answer.batch < self.first_of_scene {
            answer.surfaces.clear();
        }
        if let Some(rate) = &mut self.rate {
            rate.count(&answer);
        }
        Some(answer)
    }

    fn is_noisy(&self) -> bool {
        self.tracer.is_noisy()
    }

    fn samples_at_once(&self) -> usize {
        self.tracer.samples_at_once()
    }

    fn spare_threads(&mut self, threads: usize) -> bool {
        self.tracer.spare_threads(threads)
    }

    fn pose(&mut self, scene_secs: f64, size: Size, pose: &mut Pose) -> bool {
        self.tracer.pose(scene_secs, size, pose)
    }

    fn lighting(&mut self, scene_secs: f64, lighting: &mut Lighting) -> bool {
        self.tracer.lighting(scene_secs, lighting)
    }
}

#[cfg(test)]
mod tests {
    use frameless::{Function, Request, Surface};

    use super::*;

    fn trace(counted: &mut impl Tracer, now: Time, size: Size, pixels: &[u32]) {
        let requests = pixels.iter().map(|&pixel| Request::centre(pixel)).collect();
        counted.submit(Batch { id: 0, now, scene_secs: 0.0, size, requests });
        while counted.collect(true).is_some() {}
    }

    #[test]
    fn a_steady_rate_is_shown_from_the_start_and_after_a_while() {
        let size = Size::new(2, 1);
        let black = |batch: &Batch| vec![[0.0; 3]; batch.requests.len()];
        let mut counted = Counted::new(Function::new(black));
        counted.rate(Time::ZERO, size);
        // Pixel 1: 3 samples every 100 ms are 30 per second.
        for i in 1..=50 {
            let now = Time::from_secs(0.1 * f64::from(i));
            trace(&mut counted, now, size, &[1, 1, 1]);
            let rate: Vec<f32> = counted.rate(now, size).per_sec().collect();
            assert_eq!(rate[0], 0.0);
            assert!((rate[1] - 30.0).abs() < 3.0, "after {i} steps: {}", rate[1]);
        }
    }

    #[test]
    fn a_changed_rate_is_half_learned_after_the_half_life() {
        let size = Size::new(1, 1);
        let mut rate = SamplingRate::new(size, Time::ZERO);
        for i in 1..=1000 {
            rate.fresh[0] = 1;
            rate.update(Time::from_secs(f64::from(i) * 0.01));
        }
        assert!((rate.per_sec().next().unwrap() - 100.0).abs() < 0.1);
        rate.update(Time::from_secs(10.0 + HALF_LIFE_SECS));
        let left = rate.per_sec().next().unwrap();
        // Σ 0.5^(t/h) over the past is h / ln 2 = 0.72 s; half of it and the 0.5 s of silence remain.
        let want = 100.0 * (0.5 * 0.5 / 2f32.ln()) / (0.5 * 0.5 / 2f32.ln() + 0.5);
        assert!((left - want).abs() < 1.0, "{left}, want {want}");
    }

    #[test]
    fn answers_of_another_size_are_not_counted() {
        let black = |batch: &Batch| vec![[0.0; 3]; batch.requests.len()];
        let mut counted = Counted::new(Function::new(black));
        counted.rate(Time::ZERO, Size::new(2, 2));
        trace(&mut counted, Time::ZERO, Size::new(9, 9), &[0, 80]);
        let rate = counted.rate(Time::from_secs(1.0), Size::new(2, 2));
        assert_eq!(rate.per_sec().sum::<f32>(), 0.0);
    }

    #[test]
    fn surfaces_of_a_scene_that_is_gone_are_left_out() {
        let nothing = Surface { object: Surface::SKY, ..Surface::default() };
        let mut counted = Counted::new(Sky(nothing, Vec::new()));
        let batch = |id| {
            let (requests, size) = (vec![Request::centre(0)], Size::new(1, 1));
            Batch { id, now: Time::ZERO, scene_secs: 0.0, size, requests }
        };
        counted.submit(batch(0));
        counted.begin_scene();
        counted.submit(batch(1));
        let mut surfaces = || counted.collect(true).map(|answer| answer.surfaces.len());
        assert_eq!([surfaces(), surfaces(), surfaces()], [Some(1), Some(0), None]);
    }

    /// Answers the newest batch first.
    struct Sky(Surface, Vec<Answer>);

    impl Tracer for Sky {
        fn submit(&mut self, batch: Batch) {
            self.1.push(Answer::to(batch, vec![[0.0; 3]], vec![self.0]));
        }

        fn collect(&mut self, _wait: bool) -> Option<Answer> {
            self.1.pop()
        }
    }
}
