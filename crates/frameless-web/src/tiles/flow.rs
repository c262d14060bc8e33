//! How much may be on its way to a client: what its link delivers in one round trip and one refresh.
//!
//! ```text
//! window = clamp(1.25 · rate · (RTT + 1/60 s), 32 KiB, 4 MiB)
//! rate   = largest of (bytes acknowledged since a message was sent) / (time since then)      over the last seconds
//! RTT    = least time from sending to acknowledgement
//! ```
//!
//! After BBR (Cardwell, Cheng, Gunn, Yeganeh, Jacobson: BBR: Congestion-Based Congestion Control, ACM Queue 2016), which also gives the factor:
//! a link that could take more is found out in a few round trips. The round trip includes that the client decodes and draws: a client that is
//! slow, and not its link, is sent less, too.
//!
//! On a link that is always full, every message waits behind the others, and what is measured is more than the round trip: believed, it would let the
//! window grow, and the queue with it. So a round trip that has not been confirmed for ten seconds is measured anew, with the least window.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Less would not keep a fast link busy while its rate is being learned; a thousandth of a second of a slow link's queue more hurts nobody.
const LEAST: usize = 32 << 10;
/// More than a picture of any size allowed takes.
const MOST: usize = 4 << 20;
const REFRESH_SECS: f64 = 1.0 / 60.0;
/// A picture's tiles go in this many messages at most.
const MESSAGES_PER_PICTURE: usize = 6;
/// Beyond those that the round trip asks for at 60 pictures per second: one being drawn, one waiting.
const SPARE_PICTURES: usize = 1;
const GAIN: f64 = 1.25;
const RATE_MEMORY: Duration = Duration::from_secs(2);
const RTT_MEMORY: Duration = Duration::from_secs(10);

/// Of one client.
pub(crate) struct Flow {
    sent: VecDeque<Message>,
    in_flight: usize,
    next_sequence: u32,
    delivered: u64,
    rate: Fastest,
    rtt: RoundTrip,
}

struct Message {
    sequence: u32,
    bytes: usize,
    at: Instant,
    delivered_before: u64,
    // Itself and what was on its way before it.
    in_flight: usize,
}

/// A number that was acknowledged but never sent, or acknowledged before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NeverSent;

impl Flow {
    pub(crate) fn new(now: Instant) -> Flow {
        Flow {
            sent: VecDeque::new(),
            in_flight: 0,
            next_sequence: 1,
            delivered: 0,
            rate: Fastest { begun: now, now: 0.0, before: 0.0 },
            rtt: RoundTrip { secs: 0.0, confirmed: now, is_asked: true },
        }
    }

    /// The number of the next message.
    pub(crate) fn next_sequence(&self) -> u32 {
        self.next_sequence
    }

    /// Bytes that may be sent now; 0: wait for an acknowledgement.
    pub(crate) fn room(&self) -> usize {
        let most_pictures = (self.rtt.secs / REFRESH_SECS).ceil() as usize + SPARE_PICTURES;
        if self.sent.len() >= most_pictures * MESSAGES_PER_PICTURE {
            return 0;
        }
        self.window().saturating_sub(self.in_flight)
    }

    /// Bytes that may be in flight.
    pub(crate) fn window(&self) -> usize {
        if self.rtt.is_asked {
            return LEAST;
        }
        let wanted = GAIN * self.rate.value() * (self.rtt.secs + REFRESH_SECS);
        (wanted as usize).clamp(LEAST, MOST)
    }

    /// A message of so many bytes is being sent.
    pub(crate) fn send(&mut self, bytes: usize, now: Instant) {
        let (sequence, delivered_before) = (self.next_sequence, self.delivered);
        self.in_flight += bytes;
        let in_flight = self.in_flight;
        self.sent.push_back(Message { sequence, bytes, at: now, delivered_before, in_flight });
        self.rtt.doubt(now);
        self.next_sequence = self.next_sequence.wrapping_add(1);
    }

    /// The client has drawn message `sequence` and all before it.
    pub(crate) fn acknowledge(&mut self, sequence: u32, now: Instant) -> Result<(), NeverSent> {
        let acknowledged = self.sent.iter().position(|message| message.sequence == sequence);
        let last = acknowledged.ok_or(NeverSent)?;
        for (at, message) in self.sent.drain(..=last).enumerate() {
            self.in_flight -= message.bytes;
            self.delivered += message.bytes as u64;
            if at == last {
                // Two acknowledgements within a tick of the clock say nothing of the rate.
                let secs = now.duration_since(message.at).as_secs_f64().max(1e-4);
                let delivered = self.delivered - message.delivered_before;
                self.rate.note(delivered as f64 / secs, now);
                self.rtt.note(secs, message.in_flight <= LEAST, now);
            }
        }
        Ok(())
    }

    /// Since when the oldest message on its way has been so.
    pub(crate) fn waiting_since(&self) -> Option<Instant> {
        self.sent.front().map(|message| message.at)
    }
}

/// The largest of what was noted within the last one to two halves of [`RATE_MEMORY`].
struct Fastest {
    begun: Instant,
    now: f64,
    before: f64,
}

impl Fastest {
    fn note(&mut self, value: f64, now: Instant) {
        if now.duration_since(self.begun) >= RATE_MEMORY / 2 {
            (self.before, self.now, self.begun) = (self.now, 0.0, now);
        }
        self.now = self.now.max(value);
    }

    fn value(&self) -> f64 {
        self.now.max(self.before)
    }
}

/// The least of what was noted, until it is to be measured anew.
struct RoundTrip {
    secs: f64,
    confirmed: Instant,
    is_asked: bool,
}

impl RoundTrip {
    fn note(&mut self, secs: f64, was_alone: bool, now: Instant) {
        if secs <= self.secs || self.is_asked && was_alone {
            *self = RoundTrip { secs, confirmed: now, is_asked: false };
        }
    }

    fn doubt(&mut self, now: Instant) {
        self.is_asked |= now.duration_since(self.confirmed) >= RTT_MEMORY;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A link of `bytes_per_sec` with a round trip of `rtt`, always as full as the window lets it be, for `secs`.
    /// Returns the longest that a message was under way in the second half, and the bytes delivered per second.
    fn drive(bytes_per_sec: f64, rtt: Duration, secs: u64) -> (Flow, Duration, f64) {
        let begin = Instant::now();
        let mut flow = Flow::new(begin);
        let (mut now, mut link_free) = (begin, begin);
        let mut arrivals: VecDeque<(Instant, u32, Instant)> = VecDeque::new();
        let (mut slowest, mut delivered_at_half) = (Duration::ZERO, 0);
        let half = begin + Duration::from_secs(secs) / 2;
        while now < begin + Duration::from_secs(secs) {
            now += Duration::from_millis(1);
            while let Some(&(at, sequence, sent)) = arrivals.front()
                && at <= now
            {
                arrivals.pop_front();
                flow.acknowledge(sequence, now).unwrap();
                if now > half {
                    slowest = slowest.max(now - sent);
                }
            }
            if now <= half {
                delivered_at_half = flow.delivered;
            }
            let room = flow.room();
            if room > 0 {
                let bytes = room.min(100_000);
                link_free =
                    link_free.max(now) + Duration::from_secs_f64(bytes as f64 / bytes_per_sec);
                arrivals.push_back((link_free + rtt, flow.next_sequence(), now));
                flow.send(bytes, now);
            }
        }
        let per_sec = (flow.delivered - delivered_at_half) as f64 / (secs as f64 / 2.0);
        (flow, slowest, per_sec)
    }

    #[test]
    fn a_slow_link_has_no_queue() {
        let (flow, slowest, per_sec) = drive(100_000.0, Duration::from_millis(20), 120);
        // The least window takes a third of a second; what is measured with it, times the gain.
        assert!(flow.window() < 48_000, "{}", flow.window());
        assert!(slowest < Duration::from_millis(520), "{slowest:?}");
        assert!(per_sec > 90_000.0, "{per_sec} bytes/s");
    }

    #[test]
    fn a_fast_link_is_used() {
        let (flow, slowest, per_sec) = drive(50e6, Duration::from_millis(5), 5);
        assert!(per_sec > 10e6, "{per_sec} bytes/s through {}", flow.window());
        assert!(flow.window() > 8 * LEAST, "{}", flow.window());
        assert!(slowest < Duration::from_millis(100), "{slowest:?}");
    }

    #[test]
    fn far_away_means_more_on_its_way() {
        let (flow, ..) = drive(2e6, Duration::from_millis(200), 10);
        assert!(flow.window() > 200_000, "{}", flow.window());
    }

    #[test]
    fn what_was_never_sent_cannot_be_acknowledged() {
        let now = Instant::now();
        let mut flow = Flow::new(now);
        assert_eq!(flow.acknowledge(1, now), Err(NeverSent));
        flow.send(10, now);
        flow.send(10, now);
        assert_eq!(flow.acknowledge(2, now), Ok(()));
        assert_eq!(flow.in_flight, 0);
        for sequence in [0, 1, 2, 3, u32::MAX] {
            assert_eq!(flow.acknowledge(sequence, now), Err(NeverSent), "{sequence}");
        }
    }
}
