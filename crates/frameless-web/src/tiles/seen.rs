//! What one client's canvas shows, and which tiles it is to be sent next.
//!
//! A tile that has visibly changed is sent lossily, those first that changed most times waited longest. Once it has been quiet it is sent
//! exactly. Differences that nobody sees are sent exactly, too, and ever more seldom while the rest of the picture moves.

use super::{Grid, Mean, Published};

/// A change that is worth JPEG: mean squared difference of a tile's pixels (Σ over the channels, 8 bits each), five steps in each channel. JPEG's own error
/// is half of this: below, much would be sent to gain little, and a tile that is exact by now would become worse. Seven pixels in the
/// tile that are off by 32 in each channel are more.
const WORTH_LOSSY: f64 = 80.0;
/// A tile that has not changed for so long is sent exactly.
const QUIET_MS: u64 = 120;
/// One that goes on changing, in a way that is not worth JPEG, is sent exactly all the same after so long: the first time, the second, and from
/// then on. Antialiasing goes on for seconds, and each of its steps in each tile would be as much as what really moves.
const UNSEEN_MS: [u64; 3] = [1000, 4000, 8000];
/// A tile that was never sent comes before any change: the largest possible change of a tile.
const NEVER: f64 = 3.0 * 255.0 * 255.0;
/// In one message. 1536 · 16 · 16 pixels are 1.2 MB of RGB, which each client may hold while it is encoded.
const MOST_TILES: usize = 1536;

/// Of one client. 56 bytes per tile.
pub(crate) struct Seen {
    generation: u32,
    tiles: Vec<Tile>,
}

#[derive(Clone, Copy, Default)]
struct Tile {
    /// Of what was sent.
    digest: u64,
    /// When it was sent, see [`Published::change_sums`].
    change_sum: u64,
    /// When it was sent last.
    sent_ms: u64,
    /// When its bytes were seen to change last, and to what.
    stirred_ms: u64,
    latest: u32,
    /// Since when it has been different in a way that is seen; 0: it is not.
    waiting_ms: u64,
    /// Of what was sent, if that had no detail.
    mean: Option<Mean>,
    sent: bool,
    exact: bool,
    exactly: u8,
}

/// In milliseconds of a clock of the caller's that begins above 0.
#[derive(Clone, Copy)]
pub(crate) struct Times {
    pub(crate) now_ms: u64,
    /// Of [`Published::calm_at`].
    pub(crate) calm_ms: u64,
}

impl Times {
    /// Nothing that is seen has changed lately.
    pub(crate) fn are_calm(self) -> bool {
        self.now_ms >= self.calm_ms
    }
}

/// What is to be sent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Chosen {
    /// Most urgent first, or row-major.
    pub(crate) tiles: Vec<u16>,
    /// Exactly.
    pub(crate) lossless: bool,
    /// What has changed is still to come.
    pub(crate) before_changes: bool,
    /// The canvas is the published picture, once all before this is drawn.
    pub(crate) all_exact: bool,
    /// When there will be something to refine, if nothing changes before.
    pub(crate) wait_ms: Option<u64>,
}

enum Need {
    Nothing,
    Lossy { priority: f64 },
    Exact { in_ms: u64 },
}

impl Seen {
    /// Nothing has been sent.
    pub(crate) fn nothing() -> Seen {
        Seen { generation: 0, tiles: Vec::new() }
    }

    /// What this takes.
    #[cfg(test)]
    pub(crate) fn bytes(&self) -> usize {
        self.tiles.capacity() * size_of::<Tile>()
    }

    /// Picks what to send of the picture: visible changes, or else (or with `refine`) what is ripe for refinement.
    ///
    /// At most `lossy` tiles of the one or `exact` of the other kind.
    pub(crate) fn choose(
        &mut self,
        picture: &Published,
        times: Times,
        [lossy, exact]: [usize; 2],
        refine: bool,
    ) -> Chosen {
        let grid = picture.grid();
        if self.generation != picture.generation || self.tiles.len() != grid.len() {
            self.generation = picture.generation;
            self.tiles = vec![Tile::default(); grid.len()];
        }
        let mut moving: Vec<(f64, u16)> = Vec::new();
        let mut resting: Vec<u16> = Vec::new();
        let mut chosen = Chosen { all_exact: true, ..Chosen::default() };
        for (index, tile) in self.tiles.iter_mut().enumerate() {
            let need = tile.need(picture, &grid, index, times);
            chosen.all_exact &= matches!(need, Need::Nothing);
            match need {
                Need::Nothing => {}
                Need::Lossy { priority } => moving.push((priority, index as u16)),
                Need::Exact { in_ms: 0 } => resting.push(index as u16),
                Need::Exact { in_ms } => {
                    chosen.wait_ms = Some(chosen.wait_ms.map_or(in_ms, |wait| wait.min(in_ms)));
                }
            }
        }
        chosen.lossless = !resting.is_empty() && (moving.is_empty() || refine);
        chosen.before_changes = chosen.lossless && !moving.is_empty();
        if chosen.lossless {
            // Row-major, so that neighbours stay neighbours.
            resting.truncate(exact.clamp(1, MOST_TILES));
            chosen.tiles = resting;
        } else {
            let most = lossy.clamp(1, MOST_TILES);
            if moving.len() > most {
                moving.select_nth_unstable_by(most, |(a, _), (b, _)| b.total_cmp(a));
                moving.truncate(most);
            }
            chosen.tiles = moving.into_iter().map(|(_, tile)| tile).collect();
            chosen.tiles.sort_unstable();
        }
        chosen
    }

    /// Tiles of the picture are on their way.
    pub(crate) fn sent(&mut self, picture: &Published, chosen: &Chosen, now_ms: u64) {
        for &index in &chosen.tiles {
            let tile = &mut self.tiles[usize::from(index)];
            tile.exactly = match chosen.lossless {
                true => tile.exactly.saturating_add(1),
                false => 0,
            };
            tile.digest = picture.digests[usize::from(index)];
            tile.change_sum = picture.change_sums[usize::from(index)];
            tile.mean = picture.means[usize::from(index)];
            (tile.sent_ms, tile.waiting_ms) = (now_ms, 0);
            (tile.sent, tile.exact) = (true, chosen.lossless);
        }
    }
}

impl Tile {
    fn need(&mut self, picture: &Published, grid: &Grid, index: usize, times: Times) -> Need {
        let Times { now_ms, calm_ms } = times;
        let digest = picture.digests[index];
        if self.latest != digest as u32 {
            (self.latest, self.stirred_ms) = (digest as u32, now_ms);
        }
        let same = self.sent && self.digest == digest;
        if same && self.exact {
            self.waiting_ms = 0;
            return Need::Nothing;
        }
        let changed = picture.change_sums[index] - self.change_sum;
        let change = match self.sent {
            true => changed as f64 / f64::from(grid.pixels(index)),
            false => NEVER,
        };
        let means = self.mean.zip(picture.means[index]);
        let has_another_tone = means.is_some_and(|(sent, now)| now.is_seen_beside(sent));
        if !same && (change >= WORTH_LOSSY || has_another_tone) {
            if self.waiting_ms == 0 {
                self.waiting_ms = now_ms;
            }
            let waited_ms = now_ms - self.waiting_ms + 1;
            return Need::Lossy { priority: change * waited_ms as f64 };
        }
        self.waiting_ms = 0;
        let unseen_ms = UNSEEN_MS[usize::from(self.exactly).min(UNSEEN_MS.len() - 1)];
        // While it has not been sent exactly since it moved, rest is the sign; after that, longer rest.
        let quiet_ms = match self.exactly {
            0 => self.stirred_ms.max(self.sent_ms) + QUIET_MS,
            _ => self.stirred_ms + UNSEEN_MS[0],
        };
        let while_calm_ms = calm_ms.max(self.sent_ms + QUIET_MS);
        let at_ms = while_calm_ms.min(quiet_ms).min(self.sent_ms + unseen_ms);
        Need::Exact { in_ms: at_ms.saturating_sub(now_ms) }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::time::Instant;

    use frameless::Size;

    use super::*;
    use crate::tiles::{Occasion, Publisher, SIDE, picture, published};

    const SIZE: Size = Size { width: 4 * SIDE, height: SIDE };
    const PLENTY: [usize; 2] = [100, 100];

    /// Four grey tiles, some pixels of which have another level.
    struct Scene {
        publisher: Publisher,
        rgba: Vec<[u8; 4]>,
        now: Instant,
    }

    impl Scene {
        fn new() -> Scene {
            let now = Instant::now();
            let rgba = vec![[100, 100, 100, 255]; SIZE.pixels()];
            Scene { publisher: Publisher::new(now), rgba, now }
        }

        /// After bits of some pixels of a tile have been turned.
        fn flip(&mut self, tile: u32, pixels: u32, bits: u8) -> Arc<Published> {
            for pixel in 0..pixels {
                let at = tile * SIDE + pixel % SIDE + pixel / SIDE * SIZE.width;
                self.rgba[at as usize][0] ^= bits;
            }
            self.show()
        }

        fn show(&mut self) -> Arc<Published> {
            published(self.publisher.take(
                picture(SIZE, self.rgba.clone()),
                Vec::new(),
                Occasion::Input,
                self.now,
            ))
        }
    }

    /// While the picture moves.
    fn at(now_ms: u64) -> Times {
        Times { now_ms, calm_ms: u64::MAX }
    }

    /// Chooses, and sends what was chosen.
    fn send(seen: &mut Seen, shown: &Published, now_ms: u64, most: [usize; 2]) -> Chosen {
        let chosen = seen.choose(shown, at(now_ms), most, false);
        seen.sent(shown, &chosen, now_ms);
        chosen
    }

    #[test]
    fn everything_is_sent_once_then_exactly_and_then_nothing() {
        let (mut scene, mut seen) = (Scene::new(), Seen::nothing());
        let shown = scene.show();
        let first = send(&mut seen, &shown, 1, PLENTY);
        assert_eq!((first.tiles, first.lossless), (vec![0, 1, 2, 3], false));
        let early = send(&mut seen, &shown, 50, PLENTY);
        assert_eq!((early.tiles, early.wait_ms), (vec![], Some(1 + QUIET_MS - 50)));
        let exact = send(&mut seen, &shown, 1 + QUIET_MS, PLENTY);
        assert_eq!((exact.tiles, exact.lossless, exact.all_exact), (vec![0, 1, 2, 3], true, false));
        let done = seen.choose(&shown, at(1000), PLENTY, true);
        assert_eq!(done, Chosen { all_exact: true, ..Chosen::default() });
    }

    #[test]
    fn fifty_days_are_no_turn_of_the_clock() {
        let (mut scene, mut seen) = (Scene::new(), Seen::nothing());
        let begin = u64::from(u32::MAX) - 10;
        send(&mut seen, &scene.show(), begin, PLENTY);
        let shown = scene.flip(1, 60, 128);
        let moved = send(&mut seen, &shown, begin + 20, PLENTY);
        assert_eq!((moved.tiles, moved.lossless), (vec![1], false));
        let exact = send(&mut seen, &shown, begin + 20 + QUIET_MS, PLENTY);
        assert_eq!((exact.tiles, exact.lossless), (vec![0, 1, 2, 3], true));
    }

    fn exact_everywhere(scene: &mut Scene) -> Seen {
        let mut seen = Seen::nothing();
        let shown = scene.show();
        send(&mut seen, &shown, 1, PLENTY);
        send(&mut seen, &shown, 500, PLENTY);
        seen
    }

    #[test]
    fn what_changed_most_comes_first_and_what_waits_comes_in_the_end() {
        let mut scene = Scene::new();
        let mut seen = exact_everywhere(&mut scene);
        scene.flip(1, 60, 32);
        let mut waited = 0;
        for step in 0..100 {
            // Tile 3 changes 68 times as much as tile 1 has, again and again.
            let shown = scene.flip(3, 256, 128);
            let chosen = send(&mut seen, &shown, 1000 + 16 * step, [1, 1]);
            if chosen.tiles == [1] {
                break;
            }
            waited = step;
        }
        assert!((1..20).contains(&waited), "tile 1 waited for {waited} others");
    }

    #[test]
    fn what_nobody_sees_is_sent_exactly_and_ever_more_seldom() {
        let mut scene = Scene::new();
        let mut seen = exact_everywhere(&mut scene);
        let mut sent = Vec::new();
        for ms in (1000..20_000).step_by(50) {
            // One pixel by one step, up and down.
            scene.rgba[5][0] ^= 1;
            let shown = scene.show();
            let chosen = send(&mut seen, &shown, ms, PLENTY);
            assert!(chosen.tiles.is_empty() || chosen.lossless);
            if !chosen.tiles.is_empty() {
                sent.push(ms);
            }
        }
        let pauses: Vec<u64> = sent.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(pauses.is_sorted() && pauses.len() <= 3, "{pauses:?}");
    }

    #[test]
    fn what_nobody_sees_is_sent_as_soon_as_nothing_moves() {
        let mut scene = Scene::new();
        let mut seen = exact_everywhere(&mut scene);
        scene.rgba[5][0] ^= 1;
        let shown = scene.show();
        let moving = seen.choose(&shown, at(1000), PLENTY, false);
        assert!(moving.tiles.is_empty() && moving.wait_ms > Some(QUIET_MS), "{moving:?}");
        let calm = seen.choose(&shown, Times { now_ms: 1000, calm_ms: 900 }, PLENTY, false);
        assert_eq!((calm.tiles, calm.lossless), (vec![0], true));
        let soon = seen.choose(&shown, Times { now_ms: 1000, calm_ms: 1050 }, PLENTY, false);
        assert_eq!(soon.wait_ms, Some(50));
    }

    #[test]
    fn what_has_no_detail_is_followed_step_by_step() {
        let (mut scene, mut seen) = (Scene::new(), Seen::nothing());
        let mut rgba = scene.rgba.clone();
        // Tile 3 has detail.
        rgba.iter_mut().skip(3 * SIDE as usize).step_by(4 * SIDE as usize).for_each(|p| p[0] = 200);
        scene.rgba = rgba;
        let shown = scene.show();
        send(&mut seen, &shown, 1, PLENTY);
        send(&mut seen, &shown, 500, PLENTY);
        // A slow fade, each step of which is far less than is worth sending anywhere else.
        scene.rgba.iter_mut().for_each(|[r, g, b, _]| (*r, *g, *b) = (*r + 2, *g + 2, *b + 2));
        let faded = send(&mut seen, &scene.show(), 1000, PLENTY);
        assert_eq!((faded.tiles, faded.lossless), (vec![0, 1, 2], false));
    }

    #[test]
    fn another_generation_begins_anew() {
        let mut scene = Scene::new();
        let mut seen = exact_everywhere(&mut scene);
        let smaller = Size::new(SIDE + 1, 3);
        let rgba = vec![[1, 2, 3, 255]; smaller.pixels()];
        let taken =
            scene.publisher.take(picture(smaller, rgba), Vec::new(), Occasion::Motion, scene.now);
        let chosen = seen.choose(&published(taken), at(1000), PLENTY, false);
        assert_eq!(chosen.tiles, [0, 1]);
    }

    #[test]
    fn a_message_has_a_bounded_number_of_tiles() {
        let size = Size::new(3840, 2160);
        let now = Instant::now();
        let black = picture(size, vec![[0, 0, 0, 255]; size.pixels()]);
        let shown = published(Publisher::new(now).take(black, Vec::new(), Occasion::Motion, now));
        let mut seen = Seen::nothing();
        assert_eq!(seen.choose(&shown, at(1), [usize::MAX; 2], true).tiles.len(), MOST_TILES);
        assert_eq!(size_of::<Tile>(), 56);
        assert!(seen.bytes() < 1_900_000, "{} bytes for the largest picture", seen.bytes());
    }
}
