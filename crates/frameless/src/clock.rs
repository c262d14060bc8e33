//! What time it is, and how many samples are due: the only file that reads the machine's clock.

use std::time::{Duration, Instant};

use crate::{BatchLength, Time};

/// Batches per second: a batch is at most about 1 ms of work. Feedback comes once per batch, and longer batches
/// cost quality (4 ms: 8–15 % more error, 16 ms: up to 80 %); shorter ones cost overhead. A multiple of 60
/// and 120, so that on the simulated clock no batch straddles a display refresh.
pub const BATCHES_PER_SEC: u32 = 960;

/// On the real clock batches are half as long: input waits for the one that is being traced, and for the first that shows it. Shorter
/// ones cost more for themselves than they save (docs/performance.md).
const REAL_BATCHES_PER_SEC: f64 = 2.0 * BATCHES_PER_SEC as f64;

/// Where "now" comes from.
#[derive(Clone, Debug)]
pub enum Clock {
    /// The n-th sample is traced at n / rate, however long it takes: results are reproducible bit for bit.
    Simulated(Simulated),
    /// The machine's clock.
    Real(Real),
}

impl Clock {
    /// A simulated clock.
    ///
    /// # Panics
    /// If the rate is not positive and finite.
    pub fn simulated(samples_per_sec: f64) -> Clock {
        assert!(
            samples_per_sec > 0.0 && samples_per_sec.is_finite(),
            "a rate in samples per second must be positive and finite, got {samples_per_sec}"
        );
        Clock::Simulated(Simulated { samples_per_sec, batch: 0 })
    }

    /// The machine's clock, starting at zero now.
    pub fn real() -> Clock {
        Clock::Real(Real::start())
    }

    /// The machine's clock for a renderer whose calls have a price: one batch at a time, as long as [`BatchLength`] finds best.
    ///
    /// # Panics
    /// If `batch_secs`, what a batch should last, is not positive and finite.
    pub fn real_for_calls(batch_secs: f64) -> Clock {
        assert!(
            batch_secs > 0.0 && batch_secs.is_finite(),
            "a batch must last a positive and finite time, got {batch_secs} s"
        );
        Clock::Real(Real { length: Some(BatchLength::new(batch_secs)), ..Real::start() })
    }

    /// The present time. The simulated clock stands still between batches.
    pub fn now(&self) -> Time {
        match self {
            Clock::Simulated(clock) => clock.time_of(clock.batch),
            Clock::Real(clock) => clock.now(),
        }
    }

    /// Real clock: learn from an answer, see [`Real::answered`].
    pub(crate) fn answered(&mut self, samples: usize, busy: bool) {
        if let Clock::Real(clock) = self {
            clock.answered(samples, busy);
        }
    }

    /// Real clock: since `begin` the loop has done something else, such as a picture, which says nothing of the renderer.
    pub(crate) fn interrupted(&mut self, begin: Time) {
        let end = self.now();
        if let Clock::Real(clock) = self {
            clock.interrupted(begin, end);
        }
    }

    /// Real clock: learn that a batch chosen at `begin` has been answered.
    pub(crate) fn called(&mut self, samples: usize, begin: Time) {
        let end = self.now();
        if let Clock::Real(Real { length: Some(length), .. }) = self {
            length.answered(samples, begin, end);
        }
    }

    /// Samples that the renderer traces in a batch's time.
    pub(crate) fn batch_length(&self) -> usize {
        match self {
            Clock::Simulated(_) => 0,
            Clock::Real(clock) => clock.batch_length(),
        }
    }

    /// Real clock: do nothing for about half a batch; called when nothing is due.
    pub(crate) fn rest(&self) {
        if let Clock::Real(_) = self {
            std::thread::sleep(Duration::from_secs_f64(0.5 / REAL_BATCHES_PER_SEC));
        }
    }
}

/// See [`Clock::Simulated`]. Batch i holds the samples due in [i, i + 1) / [`BATCHES_PER_SEC`] seconds, all traced at the
/// beginning of that interval.
#[derive(Clone, Debug)]
pub struct Simulated {
    samples_per_sec: f64,
    batch: u64,
}

impl Simulated {
    fn time_of(&self, batch: u64) -> Time {
        Time((u128::from(batch) * 1_000_000_000 / u128::from(BATCHES_PER_SEC)) as u64)
    }

    /// Time and number of samples of the next batch; the number may be 0 at low rates.
    pub(crate) fn next_batch(&mut self) -> (Time, usize) {
        let due = |batch: u64| {
            (batch as f64 * self.samples_per_sec / f64::from(BATCHES_PER_SEC)).floor() as usize
        };
        let planned = (self.time_of(self.batch), due(self.batch + 1) - due(self.batch));
        self.batch += 1;
        planned
    }
}

/// See [`Clock::Real`]. Learns how fast the renderer is and plans batches that last as long as they should.
#[derive(Clone, Debug)]
pub struct Real {
    started: Instant,
    budget_per_sec: Option<f64>,
    allowance: f64,
    allowance_at: Time,
    secs_per_sample: f64,
    last_answer: Option<Time>,
    /// Since the last interruption.
    has_learned: bool,
    /// For a renderer whose calls have a price.
    length: Option<BatchLength>,
}

// Until the first answer: a renderer that needs a second per sample must not be asked for a thousand.
const FIRST_BATCH: usize = 2;
// More would not fit a batch's memory into the cache; 65,536 samples in 1 ms are 15 ns each.
const LARGEST_BATCH: f64 = 65_536.0;
// Weight of the newest batch in the learned time per sample: settles within about ten batches (5 ms) where samples become cheaper. Where
// they become dearer the next batch is shorter at once, since times are averaged and not rates.
const LEARNING_RATE: f64 = 0.2;

impl Real {
    fn start() -> Real {
        Real {
            started: Instant::now(),
            budget_per_sec: None,
            allowance: 0.0,
            allowance_at: Time::ZERO,
            secs_per_sample: 1.0 / (FIRST_BATCH as f64 * REAL_BATCHES_PER_SEC),
            last_answer: None,
            has_learned: false,
            length: None,
        }
    }

    fn now(&self) -> Time {
        Time(self.started.elapsed().as_nanos() as u64)
    }

    /// At most this many samples per second; `None`: as many as the renderer can.
    pub(crate) fn set_budget(&mut self, samples_per_sec: Option<f64>) {
        self.budget_per_sec = samples_per_sec;
        self.allowance = 0.0;
        self.allowance_at = self.now();
    }

    /// For a renderer whose calls have a price: how many samples the next call should have.
    pub(crate) fn next_call(&mut self) -> Option<usize> {
        self.length.as_mut().map(BatchLength::next_length)
    }

    /// Time and number of samples of the next batch, of which `wanted` are asked for. Within a budget the number is smaller, and 0
    /// while nothing is due.
    pub(crate) fn next_batch(&mut self, wanted: usize) -> (Time, usize) {
        let now = self.now();
        let Some(budget) = self.budget_per_sec else { return (now, wanted) };
        // What was not used in time is lost, but for one batch: a renderer that stood still does not catch up in a burst, and one
        // whose calls take long is not starved.
        let earned = budget * now.secs_since(self.allowance_at);
        let most = (2.0 * budget / REAL_BATCHES_PER_SEC).max(wanted as f64).max(1.0);
        self.allowance = (self.allowance + earned).min(most);
        self.allowance_at = now;
        let count = wanted.min(self.allowance as usize);
        self.allowance -= count as f64;
        (now, count)
    }

    /// Told after an answer of `samples` samples has been kept; `busy`: another batch was under way, so that the
    /// renderer has worked all the time since the answer before.
    pub(crate) fn answered(&mut self, samples: usize, busy: bool) {
        self.answered_at(self.now(), samples, busy);
    }

    fn answered_at(&mut self, now: Time, samples: usize, busy: bool) {
        if let (Some(last), true) = (self.last_answer, samples > 0) {
            let measured = now.secs_since(last).max(1e-6) / samples as f64;
            // A batch grows by at most a sixth: one lucky measurement must not make a batch of 60 ms. And shrinks to two fifths at most: whatever
            // else the machine does may hold up a batch.
            let measured = measured.clamp(0.25 * self.secs_per_sample, 8.0 * self.secs_per_sample);
            self.secs_per_sample += LEARNING_RATE * (measured - self.secs_per_sample);
            self.has_learned = true;
        }
        self.last_answer = busy.then_some(now);
    }

    /// The time until the next answer is not measured, since the renderer may have worked on meanwhile. But where nothing is learned between
    /// interruptions, as in a loop that makes a picture after each turn, it is measured without the interruption.
    fn interrupted(&mut self, begin: Time, end: Time) {
        let without = self.last_answer.map(|last| Time(last.0 + end.0 - begin.0));
        self.last_answer = if self.has_learned { None } else { without };
        self.has_learned = false;
    }

    /// Samples in a batch that lasts as long as it should.
    pub(crate) fn batch_length(&self) -> usize {
        let samples = 1.0 / (REAL_BATCHES_PER_SEC * self.secs_per_sample);
        samples.clamp(1.0, LARGEST_BATCH) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simulated_batches_add_up_to_the_rate() {
        for rate in [1.0, 37.5, 225_000.0, 900_000.0, 3_600_000.0] {
            let Clock::Simulated(mut clock) = Clock::simulated(rate) else { unreachable!() };
            let total: usize = (0..10 * BATCHES_PER_SEC).map(|_| clock.next_batch().1).sum();
            assert_eq!(total, (10.0 * rate) as usize);
            assert_eq!(clock.next_batch().0, Time::from_secs(10.0));
        }
    }

    #[test]
    fn a_budget_is_kept() {
        let Clock::Real(mut clock) = Clock::real() else { unreachable!() };
        clock.secs_per_sample = 1e-9;
        clock.set_budget(Some(100_000.0));
        let mut total = 0;
        let until = clock.now().0 + 100_000_000;
        while clock.now().0 < until {
            let wanted = clock.batch_length();
            total += clock.next_batch(wanted).1;
            std::thread::sleep(Duration::from_micros(500));
        }
        assert!(total <= 10_200, "100 ms at 100,000 samples/s: {total}");
    }

    /// The lengths and durations of batches of a renderer that traces so many samples at once, each in so many seconds, with two batches
    /// under way.
    fn batches(clock: &mut Real, secs_per_sample: f64, at_once: usize) -> Vec<(usize, f64)> {
        let mut now = clock.last_answer.unwrap_or(Time(1)).secs();
        let mut waiting = std::collections::VecDeque::new();
        let mut batches = Vec::new();
        for _ in 0..150 {
            while waiting.len() < 2 {
                waiting.push_back(clock.batch_length().max(at_once));
            }
            let samples: usize = waiting.pop_front().expect("two");
            let secs = samples.div_ceil(at_once) as f64 * secs_per_sample;
            now += secs;
            clock.answered_at(Time::from_secs(now), samples, true);
            batches.push((samples, secs));
        }
        batches
    }

    #[test]
    fn a_batch_lasts_at_most_a_millisecond_at_any_speed_of_the_renderer() {
        for at_once in [1, 2, 16] {
            // 0.1 µs to 1 s.
            for secs_per_sample in (0..8).map(|decade| 1e-7 * 10f64.powi(decade)) {
                let Clock::Real(mut clock) = Clock::real() else { unreachable!() };
                let batches = batches(&mut clock, secs_per_sample, at_once);
                let per_batch = at_once as f64 * 0.5e-3 / secs_per_sample;
                for (i, &(samples, secs)) in batches.iter().enumerate() {
                    let context = format!("{secs_per_sample} s, {at_once} at once, batch {i}");
                    assert!(
                        secs < 1.001e-3 || samples <= at_once.max(FIRST_BATCH),
                        "{context}: {samples}, {secs} s"
                    );
                    if i >= 100 {
                        let is_one_per_core = per_batch < at_once as f64 && samples == at_once;
                        let is_full = samples as f64 > 0.8 * per_batch.min(LARGEST_BATCH);
                        assert!(is_one_per_core || is_full, "{context}: {samples}, {per_batch}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_renderer_that_becomes_slower_gets_short_batches_at_once() {
        let Clock::Real(mut clock) = Clock::real() else { unreachable!() };
        batches(&mut clock, 1e-6, 2);
        // As a view into glass, or a path instead of a straight ray.
        let slow = batches(&mut clock, 1e-4, 2);
        let long: f64 = slow.iter().map(|batch| batch.1).filter(|&secs| secs > 1.1e-3).sum();
        assert!(long < 3.0 * slow[0].1, "{slow:?}");
    }

    #[test]
    fn a_picture_after_each_answer_does_not_keep_batches_short() {
        let Clock::Real(mut clock) = Clock::real() else { unreachable!() };
        let (mut now, secs_per_sample) = (0.0, 1e-6);
        for _ in 0..400 {
            now += clock.batch_length() as f64 * secs_per_sample;
            clock.answered_at(Time::from_secs(now), clock.batch_length(), true);
            clock.interrupted(Time::from_secs(now), Time::from_secs(now + 20e-3));
            now += 20e-3;
        }
        let (length, best) = (clock.batch_length() as f64, 1.0 / (REAL_BATCHES_PER_SEC * 1e-6));
        assert!((0.8 * best..1.2 * best).contains(&length), "{length} samples, {best} are right");
    }
}
