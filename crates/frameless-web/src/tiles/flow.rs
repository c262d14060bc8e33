//! How much may be on its way to a client: what its link delivers in one round trip and one refresh.
//!
//! ```text
//! window = clamp(rate · (RTT + 1/60 s), 32 KiB, 4 MiB)
//! rate   = largest of (bytes acknowledged since a message was sent) / (time since then)      over the last seconds
//! RTT    = least time from sending to acknowledgement                                        over the last ten
//! ```
//!
//! After BBR (Cardwell, Cheng, Gunn, Yeganeh, Jacobson: BBR: Congestion-Based Congestion Control, ACM Queue 2016). The round trip
//! includes that the client decodes and draws: a client that is slow, and not its link, is sent less, too.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Less would not keep a fast link busy while its rate is being learned; a thousandth of a second of a slow link's queue more hurts nobody.
const LEAST: usize = 32 << 10;
/// More than a picture of any size allowed takes.
const MOST: usize = 4 << 20;
const REFRESH_SECS: f64 = 1.0 / 60.0;
/// Beyond those that the round trip asks for at 60 per second: one being drawn, one waiting.
const SPARE_MESSAGES: usize = 2;
const RATE_MEMORY: Duration = Duration::from_secs(2);
const RTT_MEMORY: Duration = Duration::from_secs(10);

/// Of one client.
pub(crate) struct Flow {
    sent: VecDeque<Message>,
    in_flight: usize,
    next_sequence: u32,
    delivered: u64,
    rate: Extreme,
    rtt: Extreme,
}

struct Message {
    sequence: u32,
    bytes: usize,
    at: Instant,
    delivered_before: u64,
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
            rate: Extreme::new(RATE_MEMORY, f64::max, now),
            rtt: Extreme::new(RTT_MEMORY, f64::min, now),
        }
    }

    /// The number of the next message.
    pub(crate) fn next_sequence(&self) -> u32 {
        self.next_sequence
    }

    /// Bytes that may be sent now; 0: wait for an acknowledgement.
    pub(crate) fn room(&self) -> usize {
        let rtt_secs = self.rtt.value().unwrap_or(0.0);
        let most_messages = (rtt_secs / REFRESH_SECS).ceil() as usize + SPARE_MESSAGES;
        if self.sent.len() >= most_messages {
            return 0;
        }
        self.window().saturating_sub(self.in_flight)
    }

    /// Bytes that may be in flight.
    pub(crate) fn window(&self) -> usize {
        let (rate, rtt_secs) = (self.rate.value(), self.rtt.value());
        let wanted = rate.unwrap_or(0.0) * (rtt_secs.unwrap_or(0.0) + REFRESH_SECS);
        (wanted as usize).clamp(LEAST, MOST)
    }

    /// A message of so many bytes is being sent.
    pub(crate) fn send(&mut self, bytes: usize, now: Instant) {
        let (sequence, delivered_before) = (self.next_sequence, self.delivered);
        self.sent.push_back(Message { sequence, bytes, at: now, delivered_before });
        self.in_flight += bytes;
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
                self.rtt.note(secs, now);
            }
        }
        Ok(())
    }

    /// Since when the oldest message on its way has been so.
    pub(crate) fn waiting_since(&self) -> Option<Instant> {
        self.sent.front().map(|message| message.at)
    }
}

/// The largest or least of what was noted within the last one to two halves of a memory.
struct Extreme {
    half: Duration,
    better: fn(f64, f64) -> f64,
    begun: Instant,
    now: Option<f64>,
    before: Option<f64>,
}

impl Extreme {
    fn new(memory: Duration, better: fn(f64, f64) -> f64, now: Instant) -> Extreme {
        Extreme { half: memory / 2, better, begun: now, now: None, before: None }
    }

    fn note(&mut self, value: f64, now: Instant) {
        if now.duration_since(self.begun) >= self.half {
            (self.before, self.now, self.begun) = (self.now, None, now);
        }
        self.now = Some(self.now.map_or(value, |best| (self.better)(best, value)));
    }

    fn value(&self) -> Option<f64> {
        match (self.now, self.before) {
            (Some(now), Some(before)) => Some((self.better)(now, before)),
            (now, before) => now.or(before),
        }
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
        let (flow, slowest, _) = drive(100_000.0, Duration::from_millis(20), 20);
        assert_eq!(flow.window(), LEAST);
        // 32 KiB at 100 kB/s.
        assert!(slowest < Duration::from_millis(360), "{slowest:?}");
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
