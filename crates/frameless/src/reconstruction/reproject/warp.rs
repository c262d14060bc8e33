//! The forward step: every sample whose object moves goes to where its surface is now.
//!
//! The samples that move are lifted out of their cells, and put down again where they are now; all others stay where they are. So it is
//! with samples that move and whose cells have been taken by new ones since the last refresh.
//! Where two samples meet in a cell, the nearer one stays if it is nearer by 1.5 %. On the same surface the newer one stays, and
//! the other moves to the neighbouring cell on its side, if that is empty; so it is with samples whose surface is not known.

use super::store::{Anchor, EMPTY, Layout, SCREEN, Store};
use crate::pose::BEHIND;
use crate::wide::{self, F8, M8, Unit};
use crate::{Pose, Surface, Window};

/// Depths within this ratio belong to the same surface.
const SAME_SURFACE: f32 = 0.015;

/// The first cell lies in the border, so that no sample is ever there.
const NOWHERE: u32 = 0;
/// Neither inside a picture nor NaN.
const GONE_PX: f32 = -1.0;
/// The slot of a cell whose sample has been lifted.
const NO_SLOT: u32 = u32::MAX;

/// Rows that are lifted before the first of them is put down again. Few enough to lie in the cache, and enough that nearly all
/// samples come to rows that have been lifted.
const ROWS_AHEAD: usize = 8;

/// Scratch memory.
#[derive(Default)]
pub(super) struct Warp {
    /// The samples of one row in each, turn by turn.
    lifted: [Row; ROWS_AHEAD],
    /// Samples that came to a row that had not been lifted.
    early: Vec<(u32, Mover)>,
    losers: Vec<Mover>,
    /// Samples that move, and whose cells others have taken since the last refresh.
    displaced: Vec<Mover>,
    /// First cells of eights of which some have been lifted.
    starts: Vec<u32>,
    /// Slots of samples that are gone.
    free: Vec<u32>,
}

#[derive(Default)]
struct Row {
    eights: Vec<Eight>,
    len: usize,
}

/// Eight neighbouring cells, some of whose samples have been lifted.
#[derive(Clone, Default)]
struct Eight {
    /// A bit per lane: whose sample moves.
    lanes: u32,
    /// Where it is now: the cell, [`NOWHERE`] outside the picture, the position in pixels, the depth.
    cell: [u32; 8],
    px: [[f32; 8]; 2],
    depth: [f32; 8],
    rgb: [[f32; 8]; 3],
    tick: [u32; 8],
    object: [u32; 8],
    slot: [u32; 8],
    anchor: [Anchor; 8],
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

impl Eight {
    #[inline(always)]
    fn mover(&self, lane: usize) -> Mover {
        Mover {
            px: [self.px[0][lane], self.px[1][lane]],
            depth: self.depth[lane],
            rgb: [self.rgb[0][lane], self.rgb[1][lane], self.rgb[2][lane]],
            tick: self.tick[lane],
            object: self.object[lane],
            slot: self.slot[lane],
            anchor: self.anchor[lane],
        }
    }
}

impl Row {
    #[inline(always)]
    fn next(&mut self) -> &mut Eight {
        if self.len == self.eights.len() {
            self.eights.push(Eight::default());
        }
        self.len += 1;
        &mut self.eights[self.len - 1]
    }
}

impl Warp {
    /// `rests`: of an object number, whether its samples stay where they are.
    pub(super) fn run(&mut self, store: &mut Store, pose: &Pose, rests: impl Fn(u32) -> bool) {
        wide::run(Carry { warp: self, store, pose, rests });
        self.carry_displaced(store, pose);
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
        self.displaced.push(take(store, cell));
        store.slot[cell] = store.new_slot();
    }

    pub(super) fn has_displaced(&self) -> bool {
        !self.displaced.is_empty()
    }

    fn carry_displaced(&mut self, store: &mut Store, pose: &Pose) {
        let Warp { displaced, early, free, .. } = self;
        for mut mover in displaced.drain(..) {
            let there = pose.project(&mover.anchor.on(mover.object));
            match there.and_then(|there| Some((there, store.layout.of_px(there.px)?))) {
                Some((there, cell)) => {
                    (mover.px, mover.depth) = (there.px, there.depth);
                    early.push((cell as u32, mover));
                }
                None => free.push(mover.slot),
            }
        }
    }

    fn put_down_early(&mut self, store: &mut Store) {
        let Warp { early, losers, free, .. } = self;
        for (cell, mover) in early.drain(..) {
            put_down(store, cell, &mover, losers, free);
        }
    }

    /// Who lost its cell to a sample of the same surface goes to the one beside it, if that is empty.
    fn step_aside(&mut self, store: &mut Store) {
        let n = store.layout.per_side as f32;
        for loser in self.losers.drain(..) {
            // Positions in the picture are not negative.
            let [fx, fy] = loser.px.map(|p| p * n - (p * n) as i32 as f32 - 0.5);
            let sideways = fx.abs() > fy.abs();
            let dx = if sideways { fx.signum() / n } else { 0.0 };
            let dy = if sideways { 0.0 } else { fy.signum() / n };
            let beside = store.layout.of_px([loser.px[0] + dx, loser.px[1] + dy]);
            match beside.filter(|&cell| store.is_empty(cell)) {
                Some(cell) => put(store, cell, &loser, &mut self.free),
                None => self.free.push(loser.slot),
            }
        }
    }

    /// Every cell has a slot again.
    fn give_back_slots(&mut self, store: &mut Store) {
        for start in self.starts.drain(..) {
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

struct Carry<'a, F> {
    warp: &'a mut Warp,
    store: &'a mut Store,
    pose: &'a Pose,
    rests: F,
}

impl<F: Fn(u32) -> bool> wide::Task for Carry<'_, F> {
    #[inline(always)]
    fn run<U: Unit>(mut self) {
        let rows = self.store.layout.size.height as usize;
        for row in 0..rows + ROWS_AHEAD {
            // Whose turn it is to be lifted next is put down first.
            if row >= ROWS_AHEAD {
                self.put_down_row(row % ROWS_AHEAD, row.min(rows) as i32);
            }
            if row < rows {
                self.lift_row::<U>(row as i32);
            }
        }
    }
}

/// Where eight samples are.
struct There<U: Unit> {
    px: [F8<U>; 2],
    depth: F8<U>,
}

impl<F: Fn(u32) -> bool> Carry<'_, F> {
    #[inline(always)]
    fn lift_row<U: Unit>(&mut self, y: i32) {
        let turn = y as usize % ROWS_AHEAD;
        self.warp.lifted[turn].len = 0;
        let Layout { size, plane, .. } = self.store.layout;
        for sub in 0..self.store.layout.subs() {
            for x in (0..size.width as i32).step_by(8) {
                let start = self.store.layout.of_pixel(x, y) + sub * plane;
                self.lift_eight::<U>(start, turn);
            }
        }
    }

    #[inline(always)]
    fn lift_eight<U: Unit>(&mut self, start: usize, turn: usize) {
        let objects = M8::<U>::load(&self.store.object, start);
        let mut waiting = objects.equals(M8::splat(EMPTY)).not();
        let mut moving = M8::splat(0);
        let gone = F8::splat(GONE_PX);
        let mut there = There { px: [gone; 2], depth: gone };
        while let Some(lane) = waiting.first() {
            let object = self.store.object[start + lane];
            let same = objects.equals(M8::splat(object));
            waiting = waiting.and(same.not());
            if !(self.rests)(object) {
                moving = moving.either(same);
                let now = carry_eight(self.store, self.pose, object, start);
                there.px = F8::all_or(now.px, same, there.px);
                there.depth = now.depth.or(same, there.depth);
            }
        }
        if moving.any() {
            self.warp.starts.push(start as u32);
            lift(self.store, start, moving, &there, self.warp.lifted[turn].next());
        }
    }

    /// `lifted_rows`: so many have been lifted.
    #[inline(always)]
    fn put_down_row(&mut self, turn: usize, lifted_rows: i32) {
        let Warp { lifted, early, losers, free, .. } = &mut *self.warp;
        let store = &mut *self.store;
        let end = store.layout.of_pixel(0, lifted_rows) as u32 - 1;
        let plane = store.layout.plane as u32;
        let row = &lifted[turn];
        for eight in &row.eights[..row.len] {
            let mut lanes = eight.lanes;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                let (cell, mover) = (eight.cell[lane], eight.mover(lane));
                let in_plane = if cell < plane { cell } else { cell % plane };
                match in_plane < end {
                    true => put_down(store, cell, &mover, losers, free),
                    false => early.push((cell, mover)),
                }
            }
        }
    }
}

/// Takes the samples that are `moving` out of their cells.
#[inline(always)]
fn lift<U: Unit>(
    store: &mut Store,
    start: usize,
    moving: M8<U>,
    there: &There<U>,
    eight: &mut Eight,
) {
    let (object, slot) = (M8::load(&store.object, start), M8::load(&store.slot, start));
    M8::splat(EMPTY).or(moving, object).store(&mut store.object, start);
    M8::splat(NO_SLOT).or(moving, slot).store(&mut store.slot, start);
    eight.lanes = moving.bits();
    eight.cell = cells_at(&store.layout, there.px).lanes();
    eight.px = [there.px[0].lanes(), there.px[1].lanes()];
    eight.depth = there.depth.lanes();
    for (rgb, plane) in eight.rgb.iter_mut().zip(&store.rgb) {
        rgb.copy_from_slice(&plane[start..start + 8]);
    }
    eight.tick.copy_from_slice(&store.tick[start..start + 8]);
    eight.object = object.lanes();
    eight.slot = slot.lanes();
    eight.anchor.copy_from_slice(&store.anchor[start..start + 8]);
}

/// The eight samples from `start` on, as if all were of the same object.
#[inline(always)]
fn carry_eight<U: Unit>(store: &Store, pose: &Pose, object: u32, start: usize) -> There<U> {
    let gone = F8::splat(GONE_PX);
    if matches!(pose.deformed.get(object as usize), Some(Some(_))) {
        return carry_deformed(store, pose, object, start);
    }
    let projection = match object {
        Surface::SKY => pose.picture_from_sky.as_ref(),
        object => pose.picture_from_object.get(object as usize),
    };
    let Some(projection) = projection else { return There { px: [gone; 2], depth: gone } };
    let (anchors, _) = store.anchor[start..start + 8].as_chunks::<8>();
    let [x, y, z, _] = F8::columns(anchors[0].each_ref().map(|anchor| &anchor.0));
    let row = |k: usize| {
        let [a, b, c, d] = projection.0[k];
        F8::splat(a) * x + F8::splat(b) * y + (F8::splat(c) * z + F8::splat(d))
    };
    let w = row(3);
    let per_w = F8::splat(1.0) / w;
    let px = [row(0) * per_w, row(1) * per_w];
    let infinite = if object == Surface::SKY { f32::INFINITY } else { 0.0 };
    let mut there = There { px, depth: row(2) + F8::splat(infinite) };
    let mut is_seen = F8::splat(0.0).less_than(w);
    if let Some(window) = pose.window(object) {
        is_seen = is_seen.and(there.is_in(window));
    } else {
        for window in &pose.windows {
            is_seen = is_seen.and(there.is_hidden_by(window).not());
        }
    }
    there.px = F8::all_or(px, is_seen, [gone; 2]);
    there
}

impl<U: Unit> There<U> {
    /// [`Window::contains`], eight at a time.
    #[inline(always)]
    fn is_in(&self, window: &Window) -> M8<U> {
        let mut outside = M8::splat(0);
        for edge in &window.edges {
            outside = outside.either(self.at(edge).less_than(F8::splat(0.0)));
        }
        outside.not()
    }

    /// [`Window::hides`], eight at a time.
    #[inline(always)]
    fn is_hidden_by(&self, window: &Window) -> M8<U> {
        let [n, d] = [self.at(&window.depth[0]), self.at(&window.depth[1])];
        let is_behind = (n * F8::splat(BEHIND)).less_than(self.depth * d);
        if is_behind.any() { is_behind.and(self.is_in(window)) } else { is_behind }
    }

    #[inline(always)]
    fn at(&self, &[a, b, c]: &[f32; 3]) -> F8<U> {
        F8::splat(a) * self.px[0] + (F8::splat(b) * self.px[1] + F8::splat(c))
    }
}

fn carry_deformed<U: Unit>(store: &Store, pose: &Pose, object: u32, start: usize) -> There<U> {
    let (mut px, mut depth) = ([[GONE_PX; 8]; 2], [GONE_PX; 8]);
    for lane in 0..8 {
        if store.object[start + lane] == object
            && let Some(now) = pose.project(&store.surface(start + lane))
        {
            (0..2).for_each(|k| px[k][lane] = now.px[k]);
            depth[lane] = now.depth;
        }
    }
    There { px: px.map(F8::new), depth: F8::new(depth) }
}

/// [`Layout::of_px`], eight at a time; [`NOWHERE`] outside.
#[inline(always)]
fn cells_at<U: Unit>(layout: &Layout, px: [F8<U>; 2]) -> M8<U> {
    let zero = F8::splat(0.0);
    let (left, above) = (px[0].less_than(zero), px[1].less_than(zero));
    let size = layout.size;
    let inside = px[0].less_than(F8::splat(size.width as f32));
    let inside = inside.and(px[1].less_than(F8::splat(size.height as f32)));
    let inside = inside.and(left.not()).and(above.not());
    let (column, row) = (px[0].truncated(), px[1].truncated());
    let first = row.times(M8::splat(layout.stride as u32)).plus(column);
    let mut cell = first.plus(M8::splat(layout.of_pixel(0, 0) as u32));
    if layout.per_side > 1 {
        let (n, last) = (layout.per_side, M8::splat(layout.per_side - 1));
        let sub = |p: F8<U>, whole: M8<U>| {
            let sub = ((p - whole.to_f32()) * F8::splat(n as f32)).truncated();
            sub.or(sub.less_than(last), last)
        };
        let sub = sub(px[1], row).times(M8::splat(n)).plus(sub(px[0], column));
        cell = cell.plus(sub.times(M8::splat(layout.plane as u32)));
    }
    cell.or(inside, M8::splat(NOWHERE))
}

/// One sample to its new cell, if it stays there.
#[inline(always)]
fn put_down(
    store: &mut Store,
    cell: u32,
    mover: &Mover,
    losers: &mut Vec<Mover>,
    free: &mut Vec<u32>,
) {
    let cell = cell as usize;
    if cell == NOWHERE as usize {
        return free.push(mover.slot);
    }
    if store.is_empty(cell) {
        return put(store, cell, mover, free);
    }
    let there = store.depth[cell];
    let on_screen = store.object[cell] == SCREEN;
    if !on_screen && mover.depth < there * (1.0 - SAME_SURFACE) {
        return put(store, cell, mover, free);
    }
    if !on_screen && mover.depth > there * (1.0 + SAME_SURFACE) {
        return free.push(mover.slot);
    }
    if mover.tick.wrapping_sub(store.tick[cell]) as i32 > 0 {
        losers.push(take(store, cell));
        put(store, cell, mover, free);
    } else {
        losers.push(*mover);
    }
}

/// The sample in a cell, which then has no slot.
#[inline(always)]
fn take(store: &mut Store, cell: usize) -> Mover {
    Mover {
        px: [store.px[0][cell], store.px[1][cell]],
        depth: store.depth[cell],
        rgb: [store.rgb[0][cell], store.rgb[1][cell], store.rgb[2][cell]],
        tick: store.tick[cell],
        object: store.object[cell],
        slot: std::mem::replace(&mut store.slot[cell], NO_SLOT),
        anchor: store.anchor[cell],
    }
}

/// Into a cell, instead of who is there.
#[inline(always)]
fn put(store: &mut Store, cell: usize, mover: &Mover, free: &mut Vec<u32>) {
    [store.px[0][cell], store.px[1][cell]] = mover.px;
    store.depth[cell] = mover.depth;
    (0..3).for_each(|k| store.rgb[k][cell] = mover.rgb[k]);
    store.tick[cell] = mover.tick;
    store.object[cell] = mover.object;
    store.anchor[cell] = mover.anchor;
    let before = std::mem::replace(&mut store.slot[cell], mover.slot);
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
        Warp::default().run(&mut store, &pose(0.5, 0.0), |_| false);
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
        warp.run(&mut store, &pose(1.0, 3.0), |object| object == SCREEN);
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
