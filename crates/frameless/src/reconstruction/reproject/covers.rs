//! What something nearer has come before is taken away, wherever nothing says that it is still seen.
//!
//! Samples of what lies behind a wall would shine through it until each of their pixels has been traced again. So new samples are
//! compared with those whose cells they take. In and beside tiles where they are often much nearer, an older sample goes if those traced
//! since are nearer by 10 % all around it: there is one in each of four regions that surround its block of pixels like the vanes of a
//! pinwheel,
//!
//! ```text
//! U U U R R
//! U U U R R
//! L L · R R
//! L L D D D
//! L L D D D
//! ```
//!
//! and none in them or in its block is as far as itself. Blocks are of 4×4 pixels; where new samples are too few for that, of 8×8, or
//! of 16×16. The sample's pixel is a hole then: it shows what is around, and is traced first.

use std::ops::Range;

use super::holes::Waiting;
use super::store::{EMPTY, SCREEN, Sample, Store, Tick};
use crate::wide::{self, F8, M8, Unit};
use crate::{Size, bayer};

/// Side of a tile in which covering samples are counted, in pixels.
const TILE: u32 = 16;
/// Side of the smallest blocks.
const BLOCK: u32 = 4;
/// Blocks are so large, in smallest blocks.
const SCALES: [usize; 3] = [1, 2, 4];
/// Smallest blocks per side of a tile, and of a tile and what lies around it: the pinwheel of the largest block.
const IN_TILE: usize = (TILE / BLOCK) as usize;
const AROUND: usize = 5 * IN_TILE;
/// A sample nearer by more than this ratio than the one whose cell it takes has come before it.
const COVERS: f32 = 0.8;
/// One farther than this times the farthest of those around is behind them.
const BEHIND: f32 = 1.0 / 0.9;
/// Fewer in and beside a tile may be of a thin thing, or of one that has passed.
const LEAST_COVERING: u32 = 3;
/// Of the new samples in a tile, one in so many at least.
const LEAST_SHARE: u32 = 4;

/// Of each block of so many pixels a side a few are traced if something may have come before it.
const PROBED: u32 = 8;
/// So many.
const PROBES: usize = 4;

/// A block without new samples.
const NOTHING: f32 = f32::NEG_INFINITY;
/// One outside the picture.
const OUTSIDE: f32 = -1.0;

/// From a block to those of its pinwheel's four vanes: columns, rows.
const VANES: [[[isize; 2]; 2]; 4] =
    [[[1, 2], [-2, 0]], [[0, 2], [1, 2]], [[-2, -1], [0, 2]], [[-2, 0], [-2, -1]]];

/// Since something first came before a tile's samples.
#[derive(Clone, Copy, Default)]
struct Tile {
    begun: Tick,
    covering: u32,
    others: u32,
}

/// Counts what covers what.
#[derive(Default)]
pub(super) struct Covers {
    columns: u32,
    tiles: Vec<Tile>,
    /// Tiles to look at, by their first pixels, and since when.
    suspect: Vec<([u32; 2], Tick)>,
    /// Places in a block of [`PROBED`] pixels a side, in the order in which they are traced.
    probes: Vec<(u32, u32)>,
}

impl Covers {
    /// Forgets everything.
    pub(super) fn fit(&mut self, size: Size) {
        self.columns = size.width.div_ceil(TILE);
        self.probes = bayer::order(PROBED.trailing_zeros());
        self.suspect.clear();
        self.tiles.clear();
        self.tiles.resize((self.columns * size.height.div_ceil(TILE)) as usize, Tile::default());
    }

    /// A new sample is about to take a cell.
    #[inline(always)]
    pub(super) fn note(&mut self, store: &Store, cell: usize, sample: &Sample) {
        // How far away what is on the screen only is, nobody knows.
        if matches!(store.object[cell], EMPTY | SCREEN) {
            return;
        }
        let [x, y] = sample.px.map(|p| p as u32 / TILE);
        let tile = &mut self.tiles[(y * self.columns + x) as usize];
        if sample.record.depth() < COVERS * store.depth(cell) {
            if tile.covering == 0 {
                *tile = Tile { begun: sample.record.tick(), covering: 0, others: 0 };
            }
            tile.covering += 1;
        } else {
            tile.others += 1;
        }
    }

    /// Everything may be covered, by what is traced from now on.
    pub(super) fn doubt_all(&mut self, now: Tick) {
        self.tiles.fill(Tile { begun: now, covering: 1, others: 0 });
        self.find_suspect();
    }

    /// In suspect tiles a few pixels that have not been traced since are to be, so that there is something to judge the others by.
    pub(super) fn probe(&self, store: &Store, waiting: &mut Waiting) {
        let size = store.layout.size;
        for &([x0, y0], begun) in &self.suspect {
            let blocks = (0..TILE).step_by(PROBED as usize);
            for (dy, dx) in blocks.clone().flat_map(|dy| blocks.clone().map(move |dx| (dy, dx))) {
                for &(x, y) in &self.probes[..PROBES] {
                    let (x, y) = (x0 + dx + x, y0 + dy + y);
                    let is_old = |cell: usize| begun.is_later_than(store.tick(cell));
                    if x < size.width && y < size.height && store.newest(x, y).is_some_and(is_old) {
                        waiting.doubt(size.index(x, y));
                    }
                }
            }
        }
    }

    /// At a refresh, once all samples are where they are now. Empties cells.
    pub(super) fn run(&mut self, store: &mut Store) {
        self.suspect.clear();
        let mut any = false;
        for tile in &mut self.tiles {
            if tile.covering * LEAST_SHARE < tile.covering + tile.others {
                tile.covering = 0;
            }
            any |= tile.covering > 0;
        }
        if any {
            self.find_suspect();
            wide::run(Uncover { store, suspect: &self.suspect });
        }
    }

    /// Tiles in and beside which enough is covered.
    fn find_suspect(&mut self) {
        self.suspect.clear();
        let (columns, rows) = (self.columns, self.tiles.len() as u32 / self.columns);
        let beside = |at: u32, end: u32| at.saturating_sub(1)..(at + 2).min(end);
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)))
        {
            let near = beside(row, rows)
                .flat_map(|row| beside(column, columns).map(move |column| row * columns + column))
                .map(|tile| &self.tiles[tile as usize])
                .filter(|tile| tile.covering > 0);
            let (mut covering, mut begun) = (0, None);
            for tile in near {
                covering += tile.covering;
                let earlier = |begun: &Tick| begun.is_later_than(tile.begun);
                if begun.as_ref().is_none_or(earlier) {
                    begun = Some(tile.begun);
                }
            }
            if let Some(begun) = begun.filter(|_| covering >= LEAST_COVERING) {
                self.suspect.push(([column * TILE, row * TILE], begun));
            }
        }
    }
}

/// Takes away what is covered of suspect tiles.
struct Uncover<'a> {
    store: &'a mut Store,
    suspect: &'a [([u32; 2], Tick)],
}

impl wide::Task for Uncover<'_> {
    #[inline(always)]
    fn run<U: Unit>(self) {
        let Uncover { store, suspect } = self;
        let mut farthest = [[NOTHING; AROUND]; AROUND];
        for &(first, begun) in suspect {
            look_around::<U>(store, first, begun, &mut farthest);
            let pyramid = [farthest, coarser(&farthest, 2), coarser(&farthest, 4)];
            for (by, bx) in (0..IN_TILE).flat_map(|by| (0..IN_TILE).map(move |bx| (by, bx))) {
                let here = [bx, by].map(|b| b + (AROUND - IN_TILE) / 2);
                let limits = SCALES.iter().zip(&pyramid);
                let limit = limits.filter_map(|(&scale, level)| around(level, here, scale)).next();
                if let Some(farthest) = limit {
                    let [x, y] = [first[0] + bx as u32 * BLOCK, first[1] + by as u32 * BLOCK];
                    take_away(store, [x, y], begun, BEHIND * farthest);
                }
            }
        }
    }
}

/// Per smallest block of a tile and around it: the depth of the farthest sample traced since, [`NOTHING`] or [`OUTSIDE`].
#[inline(always)]
fn look_around<U: Unit>(
    store: &Store,
    first: [u32; 2],
    begun: Tick,
    farthest: &mut [[f32; AROUND]; AROUND],
) {
    let Size { width, height } = store.layout.size;
    let margin = ((AROUND - IN_TILE) / 2) as i32 * BLOCK as i32;
    let [x0, y0] = first.map(|at| at as i32 - margin);
    for (by, row) in farthest.iter_mut().enumerate() {
        let ys = within(y0 + by as i32 * BLOCK as i32, height);
        for (pair, blocks) in row.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            let x = x0 + pair as i32 * 2 * BLOCK as i32;
            if ys.is_empty() || within(x, width).is_empty() {
                *blocks = [OUTSIDE; 2];
                continue;
            }
            // Beyond the right border cells are empty.
            let mut eight = F8::<U>::splat(NOTHING);
            for y in ys.clone() {
                for sub in 0..store.layout.subs() {
                    let cell = store.layout.of_pixel(x, y) + sub * store.layout.plane;
                    let is_sample = M8::load(&store.object, cell).equals(M8::splat(EMPTY)).not();
                    // As with single ticks: later than or at the same time, modulo 2³².
                    let since = store.ticks::<U>(cell).minus(M8::splat(begun.0));
                    let is_new = since.less_than(M8::splat(0)).not().and(is_sample);
                    let depth = store.depths(cell);
                    eight = depth.or(is_new.and(eight.less_than(depth)), eight);
                }
            }
            let lanes = eight.lanes();
            let most = |lanes: &[f32]| lanes.iter().copied().fold(NOTHING, f32::max);
            *blocks = [most(&lanes[..4]), most(&lanes[4..])];
            if within(x + BLOCK as i32, width).is_empty() {
                blocks[1] = OUTSIDE;
            }
        }
    }
}

/// Those of the `BLOCK` pixels from `at` on that are in the picture.
#[inline(always)]
fn within(at: i32, end: u32) -> Range<i32> {
    at.max(0)..(at + BLOCK as i32).min(end as i32)
}

/// The same for blocks of `scale`×`scale` smallest ones, at the place of each of these.
fn coarser(fine: &[[f32; AROUND]; AROUND], scale: usize) -> [[f32; AROUND]; AROUND] {
    let mut coarse = [[NOTHING; AROUND]; AROUND];
    for (fine, coarse) in fine.chunks(scale).zip(coarse.chunks_mut(scale)) {
        for left in (0..AROUND).step_by(scale) {
            let columns = left..left + scale;
            let most = fine.iter().flat_map(|row| &row[columns.clone()]).copied();
            let most = most.fold(NOTHING, f32::max);
            coarse.iter_mut().for_each(|row| row[columns.clone()].fill(most));
        }
    }
    coarse
}

/// The depth of the farthest new sample in a block of `scale` smallest ones and in its pinwheel; `None` if a vane that is inside
/// the picture has none.
fn around(level: &[[f32; AROUND]; AROUND], [bx, by]: [usize; 2], scale: usize) -> Option<f32> {
    let mut farthest = level[by][bx];
    for [[left, right], [top, bottom]] in VANES {
        let mut in_vane = NOTHING;
        for (dy, dx) in (top..=bottom).flat_map(|dy| (left..=right).map(move |dx| (dy, dx))) {
            let [x, y] =
                [(bx, dx), (by, dy)].map(|(b, d)| b.wrapping_add_signed(d * scale as isize));
            in_vane = in_vane.max(level[y][x]);
        }
        if in_vane == NOTHING {
            return None;
        }
        farthest = farthest.max(in_vane);
    }
    (farthest > 0.0).then_some(farthest)
}

/// Empties cells of a block with older samples that are farther.
fn take_away(store: &mut Store, [x0, y0]: [u32; 2], begun: Tick, limit: f32) {
    let Size { width, height } = store.layout.size;
    for y in y0..(y0 + BLOCK).min(height) {
        for x in x0..(x0 + BLOCK).min(width) {
            for cell in store.of_pixel(x, y) {
                let is_older = begun.is_later_than(store.tick(cell));
                let is_known = store.object[cell] != SCREEN;
                if is_older && is_known && store.depth(cell) > limit {
                    store.remove(cell);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tile::TileGrid;

    const SIZE: Size = Size { width: 64, height: 48 };

    fn sample(x: f32, y: f32, depth: f32, tick: u32) -> Sample {
        let object = u32::from(depth < 5.0);
        Sample { object, ..Sample::at([x + 0.5, y + 0.5], depth, tick) }
    }

    /// All is ten away; then every fifth pixel for which it is `near` is found to be one away, the others where they were.
    fn left_after(near: impl Fn(u32, u32) -> bool) -> Vec<(u32, u32)> {
        let (mut store, mut covers) = (Store::new(SIZE, 1, false), Covers::default());
        covers.fit(SIZE);
        let pixels = || (0..SIZE.height).flat_map(|y| (0..SIZE.width).map(move |x| (x, y)));
        for (x, y) in pixels() {
            store.insert(&sample(x as f32, y as f32, 10.0, 1), false);
        }
        for (x, y) in pixels().filter(|(x, y)| (x + 3 * y) % 5 == 0) {
            let depth = if near(x, y) { 1.0 } else { 10.0 };
            let new = sample(x as f32, y as f32, depth, 2);
            let cell = store.layout.of_px(new.px).expect("inside");
            covers.note(&store, cell, &new);
            store.insert(&new, false);
        }
        covers.run(&mut store);
        let is_far =
            |&(x, y): &(u32, u32)| store.newest(x, y).is_some_and(|cell| store.depth(cell) > 5.0);
        pixels().filter(is_far).collect()
    }

    #[test]
    fn a_wall_before_everything_leaves_nothing_of_what_is_behind() {
        assert_eq!(left_after(|_, _| true), []);
    }

    #[test]
    fn beside_what_comes_everything_stays() {
        let left = left_after(|x, _| x < 32);
        assert!((0..SIZE.height).all(|y| (32..SIZE.width).all(|x| left.contains(&(x, y)))));
        // Up to the edge it is covered, but for what lies within a block of it.
        assert!(left.iter().all(|&(x, _)| x >= 32 - 2 * BLOCK), "{left:?}");
    }

    #[test]
    fn what_is_seen_through_a_grid_stays() {
        // Bars of six pixels, gaps of ten: within eight pixels of everything there are samples of both.
        let is_bar = |x: u32| x % 16 < 6;
        let left = left_after(|x, _| is_bar(x));
        let seen = (0..SIZE.width).filter(|&x| !is_bar(x));
        assert!(seen.into_iter().all(|x| (0..SIZE.height).all(|y| left.contains(&(x, y)))));
    }

    #[test]
    fn what_turns_out_to_be_farther_takes_nothing_away() {
        assert_eq!(left_after(|_, _| false).len(), SIZE.pixels());
    }

    #[test]
    fn after_a_cut_a_few_pixels_of_every_block_are_probed() {
        let (mut store, mut covers) = (Store::new(SIZE, 1, false), Covers::default());
        covers.fit(SIZE);
        let pixels = || (0..SIZE.height).flat_map(|y| (0..SIZE.width).map(move |x| (x, y)));
        for (x, y) in pixels() {
            store.insert(&sample(x as f32, y as f32, 10.0, 1), false);
        }
        let probed = |covers: &Covers, store: &Store| {
            let (mut waiting, mut ordered) = (Waiting::default(), Vec::new());
            waiting.begin(&TileGrid::new(SIZE, 8));
            covers.probe(store, &mut waiting);
            waiting.order(&[0.01; 48], &mut ordered);
            ordered
        };
        assert_eq!(probed(&covers, &store), [], "nothing is suspect");
        covers.doubt_all(Tick(2));
        let first = probed(&covers, &store);
        let blocks = SIZE.pixels() / (PROBED * PROBED) as usize;
        assert_eq!(first.len(), PROBES * blocks);
        let block = |&pixel: &u32| (SIZE.xy(pixel).0 / PROBED, SIZE.xy(pixel).1 / PROBED);
        let mut reached: Vec<(u32, u32)> = first[..blocks].iter().map(block).collect();
        reached.sort_unstable();
        reached.dedup();
        assert_eq!(reached.len(), blocks, "one in each block before there are two in any");
        // Something nearer is found at the first of them: everything older is covered by it.
        for &pixel in &first[..blocks] {
            let (x, y) = SIZE.xy(pixel);
            let new = sample(x as f32, y as f32, 1.0, 3);
            covers.note(&store, store.layout.of_px(new.px).expect("inside"), &new);
            store.insert(&new, false);
        }
        covers.run(&mut store);
        let is_far =
            |&(x, y): &(u32, u32)| store.newest(x, y).is_some_and(|cell| store.depth(cell) > 5.0);
        assert_eq!(pixels().filter(is_far).count(), 0);
        covers.run(&mut store);
        assert!(probed(&covers, &store).iter().all(|pixel| !first[..blocks].contains(pixel)));
    }
}
