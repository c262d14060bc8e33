//! What one client's canvas shows, and which tiles it is to be sent next.
//!
//! A tile that has visibly changed is sent lossily, those first that changed most times waited longest. Once it has been quiet it is sent
//! exactly. Differences that nobody sees are sent exactly, too, and ever more seldom while the rest of the picture moves.

use super::publish::SEEN;
use super::{Grid, Published};

/// A tile that has not visibly changed for so long is refined.
const QUIET_MS: u32 = 120;
/// An exact tile whose present difference nobody sees is refined again after this, doubled each time.
const UNSEEN_MS: u32 = 500;
/// 0.5 s · 2⁴ = 8 s at most.
const MOST_DOUBLINGS: u8 = 4;
/// A tile that was never sent comes before any change: the largest possible change of a tile.
const NEVER: f64 = 3.0 * 255.0 * 255.0;
/// In one message. 512 · 32 · 32 pixels are 1.5 MB of RGB, which each client may hold while it is encoded.
const MOST_TILES: usize = 512;

/// Of one client. 32 bytes per tile.
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
    /// When it was sent last, or was seen to change.
    stirred_ms: u32,
    /// Since when it has been different in a way that is seen; 0: it is not.
    waiting_ms: u32,
    sent: bool,
    exact: bool,
    doublings: u8,
}

/// What is to be sent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Chosen {
    /// Most urgent first, or row-major.
    pub(crate) tiles: Vec<u16>,
    /// Exactly.
    pub(crate) lossless: bool,
    /// The canvas is the published picture, once all before this is drawn.
    pub(crate) all_exact: bool,
    /// When there will be something to refine, if nothing changes before.
    pub(crate) wait_ms: Option<u32>,
}

enum Need {
    Nothing,
    Lossy { priority: f64 },
    Exact { in_ms: u32 },
}

impl Seen {
    /// Nothing has been sent.
    pub(crate) fn nothing() -> Seen {
        Seen { generation: 0, tiles: Vec::new() }
    }

    /// Picks what to send of the picture: visible changes, or else (or with `refine`) what is ripe for refinement. `now_ms` is a
    /// clock of the caller's that begins above 0.
    ///
    /// At most `lossy` tiles of the one or `exact` of the other kind.
    pub(crate) fn choose(
        &mut self,
        picture: &Published,
        now_ms: u32,
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
            let need = tile.need(picture, &grid, index, now_ms);
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
    pub(crate) fn sent(&mut self, picture: &Published, chosen: &Chosen, now_ms: u32) {
        for &index in &chosen.tiles {
            let tile = &mut self.tiles[usize::from(index)];
            tile.doublings = match chosen.lossless && tile.exact {
                true => (tile.doublings + 1).min(MOST_DOUBLINGS),
                false => 0,
            };
            tile.digest = picture.digests[usize::from(index)];
            tile.change_sum = picture.change_sums[usize::from(index)];
            (tile.stirred_ms, tile.waiting_ms) = (now_ms, 0);
            (tile.sent, tile.exact) = (true, chosen.lossless);
        }
    }
}

impl Tile {
    fn need(&mut self, picture: &Published, grid: &Grid, index: usize, now_ms: u32) -> Need {
        let same = self.sent && self.digest == picture.digests[index];
        if same && self.exact {
            self.waiting_ms = 0;
            return Need::Nothing;
        }
        let changed = picture.change_sums[index] - self.change_sum;
        let change = match self.sent {
            true => changed as f64 / f64::from(grid.pixels(index)),
            false => NEVER,
        };
        if !same && change >= SEEN {
            if self.waiting_ms == 0 {
                self.waiting_ms = now_ms;
            }
            let waited_ms = now_ms - self.waiting_ms + 1;
            return Need::Lossy { priority: change * f64::from(waited_ms) };
        }
        self.waiting_ms = 0;
        let rest_ms = match self.exact && !picture.calm {
            true => UNSEEN_MS << self.doublings,
            false => QUIET_MS,
        };
        Need::Exact { in_ms: (self.stirred_ms + rest_ms).saturating_sub(now_ms) }
    }
}
