//! The next message to a client: which tiles, and their bytes.

use std::sync::Arc;
use std::time::{Duration, Instant};

use frameless_session::{Drawn, Status};

use crate::tiles::{self, Atlas, Published, SIDE, Seen, Times};
use crate::wire::{Codec, StatusMessage, TilesHeader};

/// Before anything has been encoded, in bytes per tile: lossy, exact.
const FIRST_GUESS: [f64; 2] = [130.0, 350.0];
/// Of the newest message in what a tile is expected to take.
const LEARNING_RATE: f64 = 0.2;
/// While something moves, so much is refined per byte that is sent of what moves.
const REFINE_SHARE: f64 = 0.04;
/// The largest message in bytes while something moves: what moved most is on the page while the rest of the picture is still being
/// encoded, and waits for no large refinement.
const LARGEST_MOVING: usize = 16 << 10;
/// The same while nothing does: an atlas, what it is encoded to and the message are in memory at once.
const LARGEST_CALM: usize = 1 << 20;

/// What a client has been sent, and what that took. Passed to a thread and back for every message.
pub(super) struct Outgoing {
    seen: Seen,
    begun: Instant,
    // Bytes per tile: lossy, exact.
    cost: [f64; 2],
    // Bytes that refinement may take while something moves.
    credit: f64,
    // Of atlases.
    memory: Vec<u8>,
    // The last of the client's inputs that it has been shown.
    input: u32,
}

/// How much may be sent, and to whom.
pub(super) struct Room {
    pub(super) bytes: usize,
    pub(super) window: usize,
    pub(super) client: u32,
    pub(super) sequence: u32,
}

/// A message, or none if there is nothing to say.
pub(super) struct Ready {
    pub(super) outgoing: Outgoing,
    pub(super) picture: Arc<Published>,
    pub(super) message: Option<Vec<u8>>,
    /// Of what moves, and not of what is refined.
    pub(super) moves: bool,
    /// The canvas is the picture, once everything before is drawn.
    pub(super) all_exact: bool,
    /// When to look again, if nothing changes before.
    pub(super) wait: Option<Duration>,
}

impl Outgoing {
    pub(super) fn new(now: Instant) -> Outgoing {
        Outgoing {
            seen: Seen::nothing(),
            begun: now,
            cost: FIRST_GUESS,
            credit: 0.0,
            memory: Vec::new(),
            input: 0,
        }
    }

    /// Chooses and encodes.
    pub(super) fn make(mut self, picture: Arc<Published>, room: &Room) -> Ready {
        let ms_at = |at: Instant| at.saturating_duration_since(self.begun).as_millis() as u64 + 1;
        let times = Times { now_ms: ms_at(Instant::now()), calm_ms: ms_at(picture.calm_at) };
        let largest = if times.are_calm() { LARGEST_CALM } else { LARGEST_MOVING };
        let bytes = room.bytes.min(largest);
        let tiles = self.cost.map(|cost| (bytes as f64 / cost) as usize);
        let refine = self.credit >= self.cost[1];
        let chosen = self.seen.choose(&picture, times, tiles, refine);
        let wait = chosen.wait_ms.map(Duration::from_millis);
        if chosen.tiles.is_empty() {
            return self.nothing(picture, chosen.all_exact, wait);
        }
        let grid = picture.grid();
        let atlas =
            Atlas::of(&grid, &chosen.tiles, &picture.rgba, std::mem::take(&mut self.memory));
        let codec = if chosen.lossless { Codec::Png } else { Codec::Jpeg };
        // An encoder refuses no atlas; were it so, the tiles would be due again.
        let Ok(payload) = tiles::encode(codec, &atlas) else {
            return self.nothing(picture, false, wait);
        };
        self.learn(chosen.lossless, chosen.tiles.len(), payload.len(), room.window);
        self.seen.sent(&picture, &chosen, times.now_ms);
        // An input is shown by what it changed, and not by what was refined meanwhile.
        if !chosen.before_changes {
            self.input = picture.input_of(room.client);
        }
        let header = TilesHeader {
            codec,
            lossless: chosen.lossless,
            sequence: room.sequence,
            generation: picture.generation,
            width: picture.size.width as u16,
            height: picture.size.height as u16,
            side: SIDE as u16,
            picture: picture.number,
            input: self.input,
            columns: atlas.columns,
            tiles: chosen.tiles,
        };
        let message = Some(header.to_bytes(&payload));
        self.memory = atlas.rgb;
        let moves = !chosen.lossless;
        Ready { outgoing: self, picture, message, moves, all_exact: false, wait }
    }

    fn nothing(self, picture: Arc<Published>, all_exact: bool, wait: Option<Duration>) -> Ready {
        Ready { outgoing: self, picture, message: None, moves: false, all_exact, wait }
    }

    fn learn(&mut self, lossless: bool, tiles: usize, bytes: usize, window: usize) {
        let cost = &mut self.cost[usize::from(lossless)];
        *cost += LEARNING_RATE * (bytes as f64 / tiles as f64 - *cost);
        self.credit += match lossless {
            true => -(bytes as f64),
            false => REFINE_SHARE * bytes as f64,
        };
        self.credit = self.credit.clamp(0.0, window as f64);
    }
}

/// What of a status does not depend on the client.
pub(super) fn status(status: &Status, pixels: usize) -> StatusMessage {
    StatusMessage {
        overlay: match status.overlay {
            None => 0,
            Some(Drawn::HeatMap(_)) => 1,
            Some(Drawn::Unknown) => 2,
        },
        samples_per_sec: status.samples_per_sec as f32,
        pictures_per_sec: status.pictures_per_sec as f32,
        mean_age_secs: status.ages.mean_secs as f32,
        max_age_secs: status.ages.max_secs as f32,
        unknown: status.ages.unknown as f32 / pixels as f32,
        scene_secs: status.scene_secs,
        ..StatusMessage::default()
    }
}

#[cfg(test)]
mod tests {
    use frameless::Size;

    use super::*;
    use crate::tiles::{Publisher, picture, published};
    use crate::wire::LONGEST_MESSAGE;

    /// The largest picture, of noise: nothing compresses worse.
    fn noise(seed: u32) -> Arc<Published> {
        let size = Size::new(3840, 2160);
        let mut state = seed;
        let mut byte = || {
            // Marsaglia 2003: xorshift.
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state as u8
        };
        let rgba = (0..size.pixels()).map(|_| [byte(), byte(), byte(), 255]).collect();
        let now = Instant::now();
        published(Publisher::new(now).take(
            picture(size, rgba),
            Vec::new(),
            crate::tiles::Occasion::Motion,
            now,
        ))
    }

    #[test]
    fn a_client_takes_at_most_8_mib_whatever_it_is_shown() {
        let picture = noise(1);
        let room = Room { bytes: 4 << 20, window: 4 << 20, client: 1, sequence: 1 };
        let mut outgoing = Outgoing::new(Instant::now());
        let mut largest = 0;
        let mut lossless = 0;
        for _ in 0..40 {
            let ready = outgoing.make(Arc::clone(&picture), &room);
            outgoing = ready.outgoing;
            if let Some(message) = ready.message {
                let header = TilesHeader::parse(&message).expect("tiles").0;
                lossless += u32::from(header.lossless);
                // The payload before it becomes a message, the message, and the same in the socket's buffer.
                largest = largest.max(outgoing.memory.capacity() + 3 * message.len());
            }
            std::thread::sleep(Duration::from_millis(8));
        }
        let bytes = largest + outgoing.seen.bytes() + LONGEST_MESSAGE;
        assert!(lossless > 0, "both kinds of messages are tried");
        assert!(bytes <= 8 << 20, "{bytes} bytes");
    }
}
