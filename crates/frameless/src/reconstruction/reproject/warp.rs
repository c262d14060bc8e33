//! The forward step: every sample whose object moves goes to where its surface is now.
//!
//! The samples that move are lifted out of their cells, and put down again where they are now ([`carry`]); all others stay where they
//! are. So it is with samples that move and whose cells have been taken by new ones since the last refresh.
//! Where two samples meet in a cell, the nearer one stays if it is nearer by 1.5 %. On the same surface the newer one stays, and
//! the other moves to the neighbouring cell on its side, if that is empty; so it is with samples whose surface is not known.
//!
//! Bands of rows are carried side by side; a sample that leaves its band is put down when all of them have been carried. Bands are
//! the same whatever the number of threads, and so is what comes out.

mod carry;

use std::sync::Mutex;

use super::cells::Cells;
use super::store::{Anchor, SCREEN, Store};
use crate::{Pose, bands, wide};

use carry::{Band, Carry, Lifted};

/// Depths within this ratio belong to the same surface.
const SAME_SURFACE: f32 = 0.015;

/// The first cell lies in the border, so that no sample is ever there.
const NOWHERE: u32 = 0;
/// Neither inside a picture nor NaN.
const GONE_PX: f32 = -1.0;
/// The slot of a cell whose sample has been lifted.
const NO_SLOT: u32 = u32::MAX;

/// Rows of a band: few samples leave it, and eight threads have something to do with a small picture.
const BAND_ROWS: usize = 64;
/// So many displaced samples are carried at a time.
const CHUNK: usize = 4096;

/// Scratch memory.
#[derive(Default)]
pub(super) struct Warp {
    /// Samples that move, and whose cells others have taken since the last refresh.
    displaced: Vec<Mover>,
    /// Of each band.
    moved: Vec<Moved>,
    /// Rows of each thread.
    lifted: Mutex<Vec<Lifted>>,
    losers: Vec<Mover>,
    /// Slots of samples that are gone.
    free: Vec<u32>,
}

/// What is left to do when samples of a band have been carried.
#[derive(Default)]
struct Moved {
    /// Samples that came to another band, or to a row that had not been lifted.
    early: Vec<(u32, Mover)>,
    losers: Vec<Mover>,
    /// First cells of eights of which some have been lifted.
    starts: Vec<u32>,
    free: Vec<u32>,
}

/// One sample on its way.
#[derive(Clone, Copy)]
struct Mover {
    px: [f32; 2],
    depth: f32,
    rgb: [f32; 3],
    tick: u32,
    object: u32,
    slot: u32,
    anchor: Anchor,
}

impl Warp {
    /// `rests`: of an object number, whether its samples stay where they are.
    pub(super) fn run(
        &mut self,
        store: &mut Store,
        pose: &Pose,
        threads: usize,
        rests: impl Fn(u32) -> bool + Sync,
    ) {
        self.carry_bands(store, pose, threads, rests);
        self.carry_displaced(pose, threads);
        self.put_down_early(store);
        self.step_aside(store);
        self.give_back_slots(store);
    }

    /// Takes the sample in a cell away until the next refresh: it moves, and somebody else is there now. Beyond as many as there are
    /// cells, while nobody asks for a picture, samples are lost.
    pub(super) fn displace(&mut self, store: &mut Store, cell: usize) {
        if self.displaced.len() >= store.layout.len() {
            return;
        }
        self.displaced.push(take(&mut Cells::of(store), cell));
        store.slot[cell] = store.new_slot();
    }

    pub(super) fn has_displaced(&self) -> bool {
        !self.displaced.is_empty()
    }

    fn carry_bands(
        &mut self,
        store: &mut Store,
        pose: &Pose,
        threads: usize,
        rests: impl Fn(u32) -> bool + Sync,
    ) {
        let (layout, rests) = (store.layout, &rests);
        let height = layout.size.height as usize;
        // With several cells per pixel those of a row do not lie together.
        let rows = if layout.per_side == 1 { BAND_ROWS } else { height };
        self.moved.resize_with(height.div_ceil(rows), Moved::default);
        let mut rest = Cells::of(store);
        rest.split_off_first(layout.row(0));
        let bands = self.moved.iter_mut().zip((0..height).step_by(rows)).map(|(moved, row)| {
            let rows = row..(row + rows).min(height);
            let count = if layout.per_side == 1 { rows.len() * layout.stride } else { usize::MAX };
            let cells = rest.split_off_first(count);
            let first = layout.row(row as i32);
            Band { rows: rows.start as i32..rows.end as i32, cells, first, moved }
        });
        bands::run(threads, bands.collect(), |band| {
            let mut lifted = with(&self.lifted, Vec::pop).unwrap_or_default();
            wide::run(Carry { layout, pose, rests, band, lifted: &mut lifted });
            with(&self.lifted, |unused| unused.push(lifted));
        });
    }

    /// To where their surfaces are now, or out of the picture.
    fn carry_displaced(&mut self, pose: &Pose, threads: usize) {
        let chunks = self.displaced.chunks_mut(CHUNK).collect();
        bands::run(threads, chunks, |chunk: &mut [Mover]| {
            for mover in chunk {
                match pose.project(&mover.anchor.on(mover.object)) {
                    Some(there) => (mover.px, mover.depth) = (there.px, there.depth),
                    None => mover.px = [GONE_PX; 2],
                }
            }
        });
    }

    fn put_down_early(&mut self, store: &mut Store) {
        let Warp { displaced, moved, losers, free, .. } = self;
        let layout = store.layout;
        let cells = &mut Cells::of(store);
        for band in moved.iter_mut() {
            losers.append(&mut band.losers);
            free.append(&mut band.free);
        }
        for (cell, mover) in moved.iter_mut().flat_map(|band| band.early.drain(..)) {
            put_down(cells, cell as usize, &mover, losers, free);
        }
        for mover in displaced.drain(..) {
            match layout.of_px(mover.px) {
                Some(cell) => put_down(cells, cell, &mover, losers, free),
                None => free.push(mover.slot),
            }
        }
    }

    /// Who lost its cell to a sample of the same surface goes to the one beside it, if that is empty.
    fn step_aside(&mut self, store: &mut Store) {
        let layout = store.layout;
        let cells = &mut Cells::of(store);
        let n = layout.per_side as f32;
        for loser in self.losers.drain(..) {
            // Positions in the picture are not negative.
            let [fx, fy] = loser.px.map(|p| p * n - (p * n) as i32 as f32 - 0.5);
            let sideways = fx.abs() > fy.abs();
            let dx = if sideways { fx.signum() / n } else { 0.0 };
            let dy = if sideways { 0.0 } else { fy.signum() / n };
            let beside = layout.of_px([loser.px[0] + dx, loser.px[1] + dy]);
            match beside.filter(|&cell| cells.is_empty(cell)) {
                Some(cell) => put(cells, cell, &loser, &mut self.free),
                None => self.free.push(loser.slot),
            }
        }
    }

    /// Every cell has a slot again.
    fn give_back_slots(&mut self, store: &mut Store) {
        for start in self.moved.iter_mut().flat_map(|band| band.starts.drain(..)) {
            let start = start as usize;
            for slot in &mut store.slot[start..start + 8] {
                if *slot == NO_SLOT {
                    *slot = self.free.pop().expect("as many slots as cells");
                }
            }
        }
        store.spare.append(&mut self.free);
    }
}

/// Threads that panic leave nothing behind that is half done.
fn with<T, R>(shared: &Mutex<T>, work: impl FnOnce(&mut T) -> R) -> R {
    work(&mut shared.lock().unwrap_or_else(|poisoned| poisoned.into_inner()))
}

/// One sample to its new cell, if it stays there.
#[inline(always)]
fn put_down(
    cells: &mut Cells<'_>,
    cell: usize,
    mover: &Mover,
    losers: &mut Vec<Mover>,
    free: &mut Vec<u32>,
) {
    if cells.is_empty(cell) {
        return put(cells, cell, mover, free);
    }
    let there = cells.depth[cell];
    let on_screen = cells.object[cell] == SCREEN;
    if !on_screen && mover.depth < there * (1.0 - SAME_SURFACE) {
        return put(cells, cell, mover, free);
    }
    if !on_screen && mover.depth > there * (1.0 + SAME_SURFACE) {
        return free.push(mover.slot);
    }
    if mover.tick.wrapping_sub(cells.tick[cell]) as i32 > 0 {
        losers.push(take(cells, cell));
        put(cells, cell, mover, free);
    } else {
        losers.push(*mover);
    }
}

/// The sample in a cell, which then has no slot.
#[inline(always)]
fn take(cells: &mut Cells<'_>, cell: usize) -> Mover {
    Mover {
        px: [cells.px[0][cell], cells.px[1][cell]],
        depth: cells.depth[cell],
        rgb: [cells.rgb[0][cell], cells.rgb[1][cell], cells.rgb[2][cell]],
        tick: cells.tick[cell],
        object: cells.object[cell],
        slot: std::mem::replace(&mut cells.slot[cell], NO_SLOT),
        anchor: cells.anchor[cell],
    }
}

/// Into a cell, instead of who is there.
#[inline(always)]
fn put(cells: &mut Cells<'_>, cell: usize, mover: &Mover, free: &mut Vec<u32>) {
    [cells.px[0][cell], cells.px[1][cell]] = mover.px;
    cells.depth[cell] = mover.depth;
    (0..3).for_each(|k| cells.rgb[k][cell] = mover.rgb[k]);
    cells.tick[cell] = mover.tick;
    cells.object[cell] = mover.object;
    cells.anchor[cell] = mover.anchor;
    let before = std::mem::replace(&mut cells.slot[cell], mover.slot);
    if before != NO_SLOT {
        free.push(before);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Projection, Size};

    /// Takes x of object 0 to column `scale` · x + `shift`.
    fn pose(scale: f32, shift: f32) -> Pose {
        let projection = Projection([
            [scale, 0.0, 0.0, shift],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 0.0, 1.0],
        ]);
        Pose { picture_from_object: vec![projection], ..Pose::default() }
    }

    fn assert_nobody_shares_a_slot(store: &Store) {
        let mut slots: Vec<u32> = store.slot.iter().chain(&store.spare).copied().collect();
        slots.sort_unstable();
        assert!(slots.into_iter().eq(0..store.shade.len() as u32));
    }

    /// Samples of object 0 at positions x of a row of eight pixels, each newer than the one before, where a pose that makes everything
    /// half as wide takes them.
    fn halved(positions: &[f32]) -> Vec<Option<(u32, f32)>> {
        let mut store = Store::new(Size::new(8, 1), 1);
        for (tick, &x) in (1..).zip(positions) {
            let cell = store.layout.of_px([x, 0.5]).expect("inside");
            store.object[cell] = 0;
            store.tick[cell] = tick;
            store.anchor[cell] = Anchor([x, 0.5, 0.0, 0.0]);
        }
        Warp::default().run(&mut store, &pose(0.5, 0.0), 1, |_| false);
        assert_nobody_shares_a_slot(&store);
        let cell = |x| store.layout.of_pixel(x, 0);
        let sample = |x| (store.tick[cell(x)], store.px[0][cell(x)]);
        (0..8).map(|x| (!store.is_empty(cell(x))).then(|| sample(x))).collect()
    }

    #[test]
    fn who_is_displaced_comes_back_where_its_surface_is() {
        let mut store = Store::new(Size::new(8, 1), 1);
        let cell = |store: &Store, x: f32| store.layout.of_px([x, 0.5]).expect("inside");
        let (old, gone) = (cell(&store, 1.5), cell(&store, 7.5));
        for (i, x) in [(old, 1.5), (gone, 7.5)] {
            store.object[i] = 0;
            store.anchor[i] = Anchor([x, 0.5, 0.0, 0.0]);
            store.shade[store.slot[i] as usize].lit = 7;
        }
        let mut warp = Warp::default();
        for i in [old, gone] {
            warp.displace(&mut store, i);
            // Something at rest has been traced there.
            store.object[i] = SCREEN;
        }
        // Three to the right: one of the two leaves the picture.
        warp.run(&mut store, &pose(1.0, 3.0), 1, |object| object == SCREEN);
        let now = cell(&store, 4.5);
        assert_eq!((store.object[now], store.px[0][now], store.shade(now).lit), (0, 4.5, 7));
        assert_eq!((store.object[old], store.object[gone]), (SCREEN, SCREEN));
        assert_nobody_shares_a_slot(&store);
    }

    #[test]
    fn who_loses_its_cell_steps_aside_if_there_is_room() {
        // 0.25 and 0.75 meet in the first cell: the newer stays, the other goes to its right.
        assert_eq!(halved(&[1.5, 0.5])[..3], [Some((2, 0.25)), Some((1, 0.75)), None]);
        // To the left there is nothing.
        assert_eq!(halved(&[0.5, 1.5])[..2], [Some((2, 0.75)), None]);
        // And here the cell to the right is taken.
        assert_eq!(halved(&[1.5, 0.5, 2.5])[..3], [Some((2, 0.25)), Some((3, 1.25)), None]);
    }
}
