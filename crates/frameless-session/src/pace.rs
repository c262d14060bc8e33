//! How often a picture is made and painted.
//!
//! The display's rate where both are cheap. Where painting is not (software rendering on few cores takes 10 ms and
//! more), a fixed share of one core: what the window takes, the picture loses. Where making the picture of the samples is
//! not, a fixed share of the render loop's time: hardly any samples are chosen meanwhile, and a slow refresh should lower the rate of
//! pictures rather than that of samples. An answer to somebody who has just done something is made at once, on credit: what
//! rest that costs the samples is owed, and once too much is owed the next picture waits.

use frameless::Time;

/// Says when the next picture is due; the first one at once.
#[derive(Clone, Debug, Default)]
pub struct Pace {
    due: Time,
    // When the next one might be, if somebody waits for it.
    soonest: Time,
    // Until when the samples would have the loop for themselves if nothing were on credit.
    owed_until: Time,
    paint_secs: f64,
    // Somebody waits for the next picture.
    is_hurried: bool,
    // Somebody waits for the one that is being made.
    is_answer: bool,
    // It is made with half of the threads.
    with_half: bool,
    is_cheap: bool,
    steered_until: Time,
}

// A little less than 1/60 s: where the display waits for its refresh, that sets the rate and not this.
const SHORTEST_SECS: f64 = 0.015;
// Slower than 20 Hz is felt as stutter, whatever it costs.
const LONGEST_SECS: f64 = 1.0 / 20.0;
// Of one core, for painting.
const PAINT_SHARE: f64 = 0.25;
// Of the loop's time, for making pictures. More starves the samples of which they are made.
const REFRESH_SHARE: f64 = 0.42;
// The same of those that nobody waits for while somebody steers: an answer has to wait for the picture that is being made. The
// smaller one as long as that leaves 20 Hz.
const STEERED_SHARES: [f64; 2] = [1.0 / 4.0, 1.0 / 3.0];
// So long after the last answer somebody still steers.
const STEERED_SECS: f64 = 0.5;
// The same where a user goes on doing something and looks for the answers.
const HURRIED_SHARE: f64 = 0.5;
// Of the rest that the samples are owed, so much may be put off: two or three refreshes of a window.
const CREDIT_SECS: f64 = 0.04;
// A picture that all threads make in 10 ms, or half of them in 20, is made by half where nobody waits for it: it hardly comes later, and the
// other threads trace meanwhile. Of a larger one samples would be chosen for too long without hearing of each other, and it would be late.
const CHEAP_SECS: f64 = 0.02;
// Whatever a picture costs, the next comes after this at the latest.
const LONGEST_REST_SECS: f64 = 1.0;
// Of the newest paint in the learned cost: one slow paint is no reason to slow down.
const LEARNING_RATE: f64 = 0.1;

impl Pace {
    /// Told what the window's last paint cost, in seconds without waiting for the display.
    pub fn painted(&mut self, paint_secs: f64) {
        if paint_secs.is_finite() {
            self.paint_secs += LEARNING_RATE * (paint_secs - self.paint_secs);
        }
    }

    /// Told when a picture is ready, and how many seconds it took. The samples get their share before
    /// the next one: at once and not on average, since the first pictures of a large window cost most.
    pub fn made(&mut self, now: Time, refresh_secs: f64) {
        let half_secs = if self.with_half { refresh_secs } else { 2.0 * refresh_secs };
        self.is_cheap = half_secs < CHEAP_SECS;
        if std::mem::take(&mut self.is_answer) {
            self.steered_until = Time::from_secs(now.secs() + STEERED_SECS);
        }
        let rest_secs = |share: f64| refresh_secs * (1.0 / share - 1.0);
        let after =
            |from: Time, secs: f64| Time::from_secs(from.secs() + secs.min(LONGEST_REST_SECS));
        let unhurried_secs = match self.is_steered(now) {
            true => {
                let [long, short] = STEERED_SHARES.map(rest_secs);
                (LONGEST_SECS - refresh_secs).clamp(short, long)
            }
            false => rest_secs(REFRESH_SHARE),
        };
        // Nothing was paid back while this one was made.
        let owed_until = Time::from_secs(self.owed_until.secs() + refresh_secs);
        self.owed_until = after(owed_until.max(now), rest_secs(HURRIED_SHARE));
        let on_credit = Time::from_secs(self.owed_until.secs() - CREDIT_SECS);
        self.soonest = self.soonest.max(on_credit);
        self.due = self.due.max(after(now, unhurried_secs));
        if self.is_hurried {
            // By what was done while it was made.
            self.hurry();
        }
    }

    /// Whether the picture that is due now should be made with half of the threads, and not with all.
    pub fn takes_half(&mut self, now: Time) -> bool {
        self.with_half = self.is_cheap && !self.is_answer && !self.is_steered(now);
        self.with_half
    }

    fn is_steered(&self, now: Time) -> bool {
        now < self.steered_until
    }

    /// Told when somebody has done something: the next picture shows it, and may come a little earlier than it would.
    pub fn hurry(&mut self) {
        self.due = self.due.min(self.soonest);
        self.is_hurried = true;
    }

    /// Whether a picture is due; if so, the next one is due an interval later.
    pub fn is_due(&mut self, now: Time) -> bool {
        if now < self.due {
            return false;
        }
        self.is_answer = std::mem::take(&mut self.is_hurried);
        self.with_half = false;
        // What was missed is not made up for.
        self.due = Time::from_secs(now.secs() + self.interval_secs());
        self.soonest = Time::from_secs(now.secs() + SHORTEST_SECS);
        true
    }

    /// Seconds between two pictures, as far as painting goes.
    pub fn interval_secs(&self) -> f64 {
        (self.paint_secs / PAINT_SHARE).clamp(SHORTEST_SECS, LONGEST_SECS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn due_in_a_second(pace: &mut Pace) -> usize {
        (1000..2000).filter(|&ms| pace.is_due(Time::from_secs(1e-3 * f64::from(ms)))).count()
    }

    #[test]
    fn cheap_painting_goes_at_the_displays_rate() {
        let mut pace = Pace::default();
        pace.painted(0.001);
        assert!((60..=67).contains(&due_in_a_second(&mut pace)));
    }

    #[test]
    fn dear_painting_goes_at_a_quarter_of_a_core() {
        let mut pace = Pace::default();
        (0..100).for_each(|_| pace.painted(0.01));
        let painted = due_in_a_second(&mut pace);
        assert!((24..=26).contains(&painted), "{painted} × 10 ms");
        (0..100).for_each(|_| pace.painted(5.0));
        assert_eq!(pace.interval_secs(), LONGEST_SECS);
        pace.painted(f64::NAN);
        assert_eq!(pace.interval_secs(), LONGEST_SECS);
    }

    const fn ms(ms: u64) -> Time {
        Time(ms * 1_000_000)
    }

    #[test]
    fn whoever_has_done_something_is_answered_at_once() {
        let mut pace = Pace::default();
        assert!(pace.is_due(ms(1000)));
        pace.made(ms(1030), 0.03);
        assert!(!pace.is_due(ms(1031)));
        pace.hurry();
        assert!(pace.is_due(ms(1031)));
        // That was on credit: the next has to wait until all but the credit is paid back.
        pace.made(ms(1061), 0.03);
        pace.hurry();
        assert!(!pace.is_due(ms(1079)));
        assert!(pace.is_due(ms(1082)));
    }

    #[test]
    fn a_cheap_picture_comes_at_the_displays_rate_hurried_or_not() {
        let mut pace = Pace::default();
        assert!(pace.is_due(ms(1061)));
        pace.made(ms(1062), 0.001);
        pace.hurry();
        assert!(!pace.is_due(ms(1075)));
        assert!(pace.is_due(ms(1077)));
    }

    #[test]
    fn whoever_goes_on_doing_something_gets_half_of_the_loop() {
        let (mut pace, mut now, mut made) = (Pace::default(), Time::from_secs(1.0), 0);
        while now < Time::from_secs(4.0) {
            now.0 += 1_000_000;
            pace.hurry();
            if pace.is_due(now) {
                now.0 += 20_000_000;
                pace.made(now, 0.02);
                made += 1;
            }
        }
        assert!((73..=78).contains(&made), "{made} × 20 ms of 3 s");
    }

    #[test]
    fn dear_refreshes_leave_the_samples_most_of_the_loop() {
        let made_in_a_second = |refresh_ms: u64| {
            let (mut pace, mut now, mut made) = (Pace::default(), Time::from_secs(1.0), 0);
            while now < Time::from_secs(2.0) {
                now.0 += 1_000_000;
                if pace.is_due(now) {
                    now.0 += refresh_ms * 1_000_000;
                    pace.made(now, 1e-3 * refresh_ms as f64);
                    made += 1;
                }
            }
            made
        };
        assert!((59..=67).contains(&made_in_a_second(1)));
        assert!((13..=15).contains(&made_in_a_second(30)));
        // The very first already.
        assert_eq!(made_in_a_second(300), 2);
        let mut pace = Pace::default();
        pace.made(Time::ZERO, 60.0);
        assert!(pace.is_due(Time::from_secs(LONGEST_REST_SECS)));
    }

    #[test]
    fn a_cheap_picture_that_nobody_waits_for_leaves_half_of_the_threads() {
        let mut pace = Pace::default();
        let mut now = ms(1000);
        let mut made = |pace: &mut Pace, takes_ms: u64| {
            now = (now.0..).step_by(1_000_000).map(Time).find(|&now| pace.is_due(now)).unwrap();
            let with_half = pace.takes_half(now);
            now.0 += takes_ms * 1_000_000;
            pace.made(now, 1e-3 * takes_ms as f64);
            with_half
        };
        assert!(!made(&mut pace, 9), "nobody knows how long it will take");
        assert!(made(&mut pace, 19) && made(&mut pace, 25));
        assert!(!made(&mut pace, 12), "too long for half of them");
        assert!(!made(&mut pace, 9));
        pace.hurry();
        assert!(!made(&mut pace, 9), "somebody waits");
        assert!(!made(&mut pace, 9), "and will again");
    }

    #[test]
    fn what_is_done_while_a_picture_is_made_is_answered_by_the_next() {
        let rest_ms = |acts_at: Option<u64>| {
            let mut pace = Pace::default();
            assert!(pace.is_due(ms(1000)));
            acts_at.inspect(|_| pace.hurry());
            pace.made(ms(1020), 0.02);
            (1020..2000).find(|&now| pace.is_due(ms(now))).expect("due again") - 1020
        };
        assert_eq!(rest_ms(None), 28);
        assert_eq!(rest_ms(Some(1010)), 0);
    }

    #[test]
    fn while_somebody_steers_the_loop_is_freer_for_the_next_answer() {
        let rest_ms = |steers: bool, takes_ms: u64| {
            let mut pace = Pace::default();
            if steers {
                pace.hurry();
            }
            assert!(pace.is_due(ms(1000)));
            let made = 1000 + takes_ms;
            pace.made(ms(made), 1e-3 * takes_ms as f64);
            (made..2000).find(|&now| pace.is_due(ms(now))).expect("due again") - made
        };
        assert_eq!([10, 14, 40].map(|takes_ms| rest_ms(true, takes_ms)), [30, 36, 80]);
        assert_eq!([10, 14, 40].map(|takes_ms| rest_ms(false, takes_ms)), [14, 20, 56]);
    }
}
