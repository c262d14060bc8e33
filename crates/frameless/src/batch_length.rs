//! How many samples a renderer is asked for at once, if every call of it has a price.

use std::collections::VecDeque;

use crate::Time;

/// Learns batch lengths for a renderer whose calls cost something by themselves: a launch, an interpreter, a network.
///
/// ```text
/// secs(n) = a + b·n            through the quickest of the latest short and long batches
/// n = (max(T, 3a) − a) / b     a batch lasts T, or longer where less than two thirds of it would be tracing
/// ```
///
/// Lengths alternate around n, since equal ones would tell nothing of a and b. The quickest count, since whatever else the machine
/// does can only make a call longer. A call that costs nothing gets batches of T.
#[derive(Clone, Debug)]
pub struct BatchLength {
    target_secs: f64,
    wanted: f64,
    is_long: bool,
    // The first batch also pays for what is loaded, compiled and allocated once.
    warmed_up: bool,
    /// Samples and seconds of the latest batches.
    latest: VecDeque<(f64, f64)>,
}

// A renderer that needs a second per sample must not be asked for a thousand.
const FIRST: f64 = 16.0;
// More would not fit a batch's memory into the cache.
const LONGEST: f64 = 65_536.0;
// Six short and six long ones: with fewer all may have been disturbed, with more a renderer that has become slower is noticed late.
const LATEST: usize = 12;
// Long and short batches differ by a factor of 5/3: enough to see b above a few percent of noise.
const ALTERNATION: f64 = 0.25;
// At most so much more, or less, from batch to batch: one lucky measurement must not make a batch of a second.
const STEP: f64 = 2.0;

impl BatchLength {
    /// Batches of about `target_secs`; positive.
    pub fn new(target_secs: f64) -> BatchLength {
        let latest = VecDeque::with_capacity(LATEST);
        BatchLength { target_secs, wanted: FIRST, is_long: false, warmed_up: false, latest }
    }

    /// How many samples the next batch has; at least 1.
    pub fn next_length(&mut self) -> usize {
        self.is_long = !self.is_long;
        let sign = if self.is_long { 1.0 } else { -1.0 };
        (self.wanted * (1.0 + sign * ALTERNATION)).round().clamp(1.0, LONGEST) as usize
    }

    /// Told of a batch that was answered completely: `samples` of them, from `begin` to `end`.
    pub fn answered(&mut self, samples: usize, begin: Time, end: Time) {
        if samples == 0 || !std::mem::replace(&mut self.warmed_up, true) {
            return;
        }
        if self.latest.len() == LATEST {
            self.latest.pop_front();
        }
        self.latest.push_back((samples as f64, end.secs_since(begin).max(1e-7)));
        let (per_call, per_sample) = self.costs();
        let length = ((3.0 * per_call).max(self.target_secs) - per_call) / per_sample;
        self.wanted = length.clamp(self.wanted / STEP, self.wanted * STEP).clamp(1.0, LONGEST);
    }

    /// a and b, in seconds; b is positive.
    fn costs(&self) -> (f64, f64) {
        let mut by_length: Vec<(f64, f64)> = self.latest.iter().copied().collect();
        by_length.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (short, long) = by_length.split_at(by_length.len() / 2);
        let quickest =
            |half: &[(f64, f64)]| half.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((n, secs)) = quickest(long) else { return (0.0, self.target_secs) };
        let each = secs / n;
        let per_sample = match quickest(short) {
            // Where time does not grow with n, as far as one can see, the next batch may be longer.
            Some((m, less)) if n > 1.1 * m => ((secs - less) / (n - m)).clamp(1e-3 * each, each),
            _ => each,
        };
        (secs - per_sample * n, per_sample)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Length and duration of the last two batches of a renderer that takes `per_call + per_sample · n` seconds, give or take
    /// `noise`.
    fn settled(per_call: f64, per_sample: f64, noise: f64) -> [(usize, f64); 2] {
        let mut rng = crate::Rng::new(1);
        let mut length = BatchLength::new(1e-3);
        let mut batches = [(0, 0.0); 2];
        for _ in 0..60 {
            let n = length.next_length();
            let exact = per_call + per_sample * n as f64;
            let secs = exact * (1.0 + noise * (2.0 * f64::from(rng.unit_f32()) - 1.0));
            length.answered(n, Time::ZERO, Time::from_secs(secs));
            batches = [batches[1], (n, secs)];
        }
        batches
    }

    fn mean_secs(batches: [(usize, f64); 2]) -> f64 {
        0.5 * (batches[0].1 + batches[1].1)
    }

    #[test]
    fn calls_that_cost_nothing_get_batches_of_the_wanted_duration() {
        for per_sample in [1e-7, 1e-6, 1e-4] {
            let secs = mean_secs(settled(0.0, per_sample, 0.0));
            assert!((secs / 1e-3 - 1.0).abs() < 0.1, "{per_sample}: {secs} s");
        }
    }

    #[test]
    fn of_a_call_that_costs_much_two_thirds_are_tracing() {
        for noise in [0.0, 0.03] {
            let secs = mean_secs(settled(10e-3, 1e-6, noise));
            assert!((secs / 30e-3 - 1.0).abs() < 0.25, "noise {noise}: {secs} s");
        }
    }

    #[test]
    fn slow_samples_come_one_by_one_and_fast_ones_not_without_end() {
        assert!(settled(0.0, 0.5, 0.1).iter().all(|&(n, _)| n <= 2));
        assert!(settled(1e-3, 0.0, 0.1).iter().all(|&(n, _)| n <= LONGEST as usize));
        let mut length = BatchLength::new(1e-3);
        length.answered(0, Time::ZERO, Time::ZERO);
        assert!((1..=32).contains(&length.next_length()));
    }

    #[test]
    fn the_first_call_which_also_loads_and_compiles_does_not_count() {
        let mut length = BatchLength::new(1e-3);
        let n = length.next_length();
        length.answered(n, Time::ZERO, Time::from_secs(3.0));
        for _ in 0..12 {
            let n = length.next_length();
            length.answered(n, Time::ZERO, Time::from_secs(1e-6 * n as f64));
        }
        assert!(length.next_length() > 500);
    }
}
