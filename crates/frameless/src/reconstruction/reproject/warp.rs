//! The forward step: every sample to where its surface is now.
//!
//! Where two samples meet in a cell, the nearer one stays if it is nearer by 1.5 %. On the same surface the newer one stays, and
//! the other moves to the neighbouring cell on its side, if that is empty; so it is with samples whose surface is not known. At last what is seen through the cracks between a nearer
//! object's samples is taken away.

use super::store::{Anchor, EMPTY, Layout, SCREEN, Store, surface};
use crate::wide::{self, F8, M8};
use crate::{Pose, Surface};

/// Depths within this ratio belong to the same surface.
const SAME_SURFACE: f32 = 0.015;
/// A neighbour nearer by more than this ratio covers what is behind it.
const COVERS: f32 = 0.07;

/// Scratch memory.
#[derive(Default)]
pub(super) struct Warp {
    next: Option<Store>,
    carried: Carried,
    /// Per cell the old cell whose sample is here now.
    winner: Vec<u32>,
    losers: Vec<u32>,
    moves: Vec<(u32, u32)>,
    covered: Vec<u32>,
}

/// Where the samples are now.
#[derive(Default)]
struct Carried {
    px: [Vec<f32>; 2],
    depth: Vec<f32>,
    /// The cell there.
    cell: Vec<u32>,
}

/// The first cell lies in the border, so that no sample is ever there.
const NOWHERE: u32 = 0;
/// Neither inside a picture nor NaN.
const GONE_PX: f32 = -1.0;

impl Warp {
    pub(super) fn run(&mut self, store: &mut Store, pose: &Pose) {
        self.carry(store, pose);
        self.settle(store);
        self.rebuild(store);
        self.step_aside(store);
    }

    /// Where every sample's surface is now.
    fn carry(&mut self, store: &Store, pose: &Pose) {
        let Carried { px, depth, cell } = &mut self.carried;
        for plane in px.iter_mut().chain([depth]) {
            plane.resize(store.layout.len(), GONE_PX);
        }
        cell.resize(store.layout.len(), NOWHERE);
        wide::run(Carry { store, pose, carried: &mut self.carried });
    }

    /// Who gets each cell.
    fn settle(&mut self, store: &Store) {
        self.winner.clear();
        self.winner.resize(store.layout.len(), NOWHERE);
        self.losers.clear();
        let Warp { carried, winner, losers, .. } = self;
        wide::run(Settle { store, carried, winner, losers });
    }

    fn rebuild(&mut self, store: &mut Store) {
        let next =
            self.next.get_or_insert_with(|| Store::new(store.layout.size, store.layout.per_side));
        if next.layout != store.layout {
            *next = Store::new(store.layout.size, store.layout.per_side);
        }
        wide::run(Rebuild { store, carried: &self.carried, winner: &self.winner, next });
        std::mem::swap(store, next);
    }

    fn step_aside(&mut self, store: &mut Store) {
        let Warp { next: Some(old), carried, losers, moves, .. } = self else { return };
        wide::run(StepAside { old, carried, losers, moves, store });
    }

    /// After [`Warp::run`]: what is seen between a nearer object's samples.
    pub(super) fn remove_seen_through_cracks(&mut self, store: &mut Store) {
        self.covered.clear();
        wide::run(Cracks { store, covered: &mut self.covered });
        for &i in &self.covered {
            store.object[i as usize] = EMPTY;
        }
    }
}

struct Carry<'a> {
    store: &'a Store,
    pose: &'a Pose,
    carried: &'a mut Carried,
}

/// Where eight samples are.
struct There {
    px: [F8; 2],
    depth: F8,
}

impl wide::Task for Carry<'_> {
    #[inline(always)]
    fn run(self) {
        let Carry { store, pose, carried: Carried { px: [px, py], depth, cell } } = self;
        for start in (0..store.layout.len()).step_by(8) {
            let objects = M8::load(&store.object, start);
            let mut waiting = objects.equals(M8::splat(EMPTY)).not();
            if !waiting.any() {
                M8::splat(NOWHERE).store(cell, start);
                continue;
            }
            let anchors = coordinates(&store.anchor[start..start + 8]);
            let gone = F8::splat(GONE_PX);
            let mut there = There { px: [gone; 2], depth: gone };
            while let Some(lane) = waiting.first() {
                let object = store.object[start + lane];
                let same = objects.equals(M8::splat(object));
                waiting = waiting.and(same.not());
                let now = carry_eight(store, pose, object, start, anchors);
                there.px = [now.px[0].or(same, there.px[0]), now.px[1].or(same, there.px[1])];
                there.depth = now.depth.or(same, there.depth);
            }
            there.px[0].store(px, start);
            there.px[1].store(py, start);
            there.depth.store(depth, start);
            cells_at(&store.layout, there.px).store(cell, start);
        }
    }
}

/// The eight samples from `start` on, as if all were of the same object.
#[inline(always)]
fn carry_eight(store: &Store, pose: &Pose, object: u32, start: usize, anchors: [F8; 3]) -> There {
    let gone = F8::splat(GONE_PX);
    if object == SCREEN {
        let px = [F8::load(&store.px[0], start), F8::load(&store.px[1], start)];
        return There { px, depth: F8::splat(f32::INFINITY) };
    }
    if matches!(pose.deformed.get(object as usize), Some(Some(_))) {
        return carry_deformed(store, pose, object, start);
    }
    let projection = match object {
        Surface::SKY => pose.picture_from_sky.as_ref(),
        object => pose.picture_from_object.get(object as usize),
    };
    let Some(projection) = projection else { return There { px: [gone; 2], depth: gone } };
    let [x, y, z] = anchors;
    let row = |k: usize| {
        let [a, b, c, d] = projection.0[k].map(F8::splat);
        a * x + b * y + (c * z + d)
    };
    let w = row(3);
    let in_front = F8::splat(0.0).less_than(w);
    let per_w = F8::splat(1.0) / w;
    let infinite = if object == Surface::SKY { f32::INFINITY } else { 0.0 };
    There {
        px: [0, 1].map(|k| (row(k) * per_w).or(in_front, gone)),
        depth: row(2) + F8::splat(infinite),
    }
}

fn carry_deformed(store: &Store, pose: &Pose, object: u32, start: usize) -> There {
    let (mut px, mut depth) = ([[GONE_PX; 8]; 2], [GONE_PX; 8]);
    for lane in 0..8 {
        if store.object[start + lane] == object
            && let Some(now) = pose.project(&surface(object, &store.anchor[start + lane]))
        {
            (0..2).for_each(|k| px[k][lane] = now.px[k]);
            depth[lane] = now.depth;
        }
    }
    There { px: px.map(F8::new), depth: F8::new(depth) }
}

/// [`Layout::of_px`], eight at a time; [`NOWHERE`] outside.
#[inline(always)]
fn cells_at(layout: &Layout, px: [F8; 2]) -> M8 {
    let zero = F8::splat(0.0);
    let [below, above] = px.map(|p| p.less_than(zero));
    let size = layout.size;
    let inside = px[0].less_than(F8::splat(size.width as f32));
    let inside = inside.and(px[1].less_than(F8::splat(size.height as f32)));
    let inside = inside.and(below.not()).and(above.not());
    let [column, row] = px.map(F8::truncated);
    let first = row.times(M8::splat(layout.stride as u32)).plus(column);
    let mut cell = first.plus(M8::splat(layout.of_pixel(0, 0) as u32));
    if layout.per_side > 1 {
        let (n, last) = (layout.per_side, M8::splat(layout.per_side - 1));
        let sub = |p: F8, whole: M8| {
            let sub = ((p - whole.to_f32()) * F8::splat(n as f32)).truncated();
            sub.or(sub.less_than(last), last)
        };
        let sub = sub(px[1], row).times(M8::splat(n)).plus(sub(px[0], column));
        cell = cell.plus(sub.times(M8::splat(layout.plane as u32)));
    }
    cell.or(inside, M8::splat(NOWHERE))
}

/// x, y and z of eight points.
#[inline(always)]
fn coordinates(anchors: &[Anchor]) -> [F8; 3] {
    let mut planes = [[0.0; 8]; 3];
    for (lane, anchor) in anchors.iter().enumerate() {
        for (plane, &coordinate) in planes.iter_mut().zip(&anchor.position) {
            plane[lane] = coordinate;
        }
    }
    planes.map(F8::new)
}

struct Settle<'a> {
    store: &'a Store,
    carried: &'a Carried,
    winner: &'a mut [u32],
    losers: &'a mut Vec<u32>,
}

impl wide::Task for Settle<'_> {
    #[inline(always)]
    fn run(self) {
        let Settle { store, carried, winner, losers } = self;
        for (i, &cell) in (0..).zip(&carried.cell) {
            if cell == NOWHERE {
                continue;
            }
            let there = winner[cell as usize];
            winner[cell as usize] =
                if there == NOWHERE { i } else { meet(store, &carried.depth, there, i, losers) };
        }
    }
}

/// Who stays where sample `i` comes to where `there` is already.
#[inline(always)]
fn meet(store: &Store, depths: &[f32], there: u32, i: u32, losers: &mut Vec<u32>) -> u32 {
    let (a, b) = (i as usize, there as usize);
    let (depth, other) = (depths[a], depths[b]);
    let on_screen = store.object[a] == SCREEN || store.object[b] == SCREEN;
    if !on_screen && depth < other * (1.0 - SAME_SURFACE) {
        return i;
    }
    if !on_screen && depth > other * (1.0 + SAME_SURFACE) {
        return there;
    }
    let is_newer = store.tick[a].wrapping_sub(store.tick[b]) as i32 > 0;
    let (winner, loser) = if is_newer { (i, there) } else { (there, i) };
    losers.push(loser);
    winner
}

struct Rebuild<'a> {
    store: &'a Store,
    carried: &'a Carried,
    winner: &'a [u32],
    next: &'a mut Store,
}

/// Cells that are moved plane by plane before the next ones are: so many lie in the first-level cache.
const CACHED: usize = 256;

impl wide::Task for Rebuild<'_> {
    #[inline(always)]
    fn run(self) {
        let Rebuild { store, carried, winner, next } = self;
        for (start, from) in (0..).step_by(CACHED).zip(winner.chunks(CACHED)) {
            let cells = start..start + from.len();
            for k in 0..3 {
                wide::gather(&mut next.rgb[k][cells.clone()], &store.rgb[k], from);
            }
            for k in 0..2 {
                wide::gather(&mut next.px[k][cells.clone()], &carried.px[k], from);
            }
            wide::gather(&mut next.depth[cells.clone()], &carried.depth, from);
            wide::gather(&mut next.tick[cells.clone()], &store.tick, from);
            // Nobody is at `NOWHERE`: where nobody comes to, the cell is empty.
            wide::gather(&mut next.object[cells.clone()], &store.object, from);
            wide::gather(&mut next.anchor[cells.clone()], &store.anchor, from);
            wide::gather(&mut next.shade[cells], &store.shade, from);
        }
    }
}

struct StepAside<'a> {
    old: &'a Store,
    carried: &'a Carried,
    losers: &'a [u32],
    /// Who goes where.
    moves: &'a mut Vec<(u32, u32)>,
    store: &'a mut Store,
}

impl wide::Task for StepAside<'_> {
    #[inline(always)]
    fn run(self) {
        let StepAside { old, carried, losers, moves, store } = self;
        moves.clear();
        let n = store.layout.per_side as f32;
        for &loser in losers {
            let i = loser as usize;
            let px = [carried.px[0][i], carried.px[1][i]];
            let [fx, fy] = px.map(|p| (p * n).fract() - 0.5);
            let sideways = fx.abs() > fy.abs();
            let dx = if sideways { fx.signum() / n } else { 0.0 };
            let dy = if sideways { 0.0 } else { fy.signum() / n };
            if let Some(cell) = store.layout.of_px([px[0] + dx, px[1] + dy])
                && store.is_empty(cell)
            {
                store.object[cell] = old.object[i];
                moves.push((loser, cell as u32));
            }
        }
        (0..3).for_each(|k| scatter(moves, &old.rgb[k], &mut store.rgb[k]));
        (0..2).for_each(|k| scatter(moves, &carried.px[k], &mut store.px[k]));
        scatter(moves, &carried.depth, &mut store.depth);
        scatter(moves, &old.tick, &mut store.tick);
        scatter(moves, &old.anchor, &mut store.anchor);
        scatter(moves, &old.shade, &mut store.shade);
    }
}

#[inline(always)]
fn scatter<T: Copy>(moves: &[(u32, u32)], from: &[T], into: &mut [T]) {
    for &(source, cell) in moves {
        into[cell as usize] = from[source as usize];
    }
}

struct Cracks<'a> {
    store: &'a Store,
    covered: &'a mut Vec<u32>,
}

impl wide::Task for Cracks<'_> {
    #[inline(always)]
    fn run(self) {
        let Cracks { store, covered } = self;
        let layout = &store.layout;
        let (n, size) = (layout.per_side as i32, layout.size);
        for sub in 0..n * n {
            let around = Around::new(layout, sub);
            for y in 1..size.height as i32 - 1 {
                for x in (1..size.width as i32 - 1).step_by(8) {
                    let first = layout.of_pixel(x, y) + sub as usize * layout.plane;
                    let inside = M8::first_lanes((size.width as i32 - 1 - x) as usize);
                    let mask = are_covered(store, first, &around).and(inside);
                    mask.for_each(|lane| covered.push((first + lane) as u32));
                }
            }
        }
    }
}

/// From a cell to those within a pixel's distance.
struct Around {
    offsets: [isize; 24],
    len: usize,
    /// How many may be there that do not cover.
    others: u32,
}

impl Around {
    fn new(layout: &Layout, sub: i32) -> Around {
        let n = layout.per_side as i32;
        let (sx, sy) = (sub % n, sub / n);
        let here = layout.neighbour(1, 1, sx, sy) as isize;
        let (mut offsets, mut len) = ([0; 24], 0);
        for dy in -n..=n {
            for dx in -n..=n {
                if (dx, dy) != (0, 0) {
                    offsets[len] = layout.neighbour(1, 1, sx + dx, sy + dy) as isize - here;
                    len += 1;
                }
            }
        }
        Around { offsets, len, others: 1 + 2 * (n as u32 - 1) }
    }
}

/// Whether at least six of the eight samples around are of nearer, other objects, and at most one is not.
#[inline(always)]
fn are_covered(store: &Store, first: usize, around: &Around) -> M8 {
    let objects = M8::load(&store.object, first);
    let empty = M8::splat(EMPTY);
    let left = M8::load(&store.object, first - 1).equals(objects);
    let alike = left.and(M8::load(&store.object, first + 1).equals(objects));
    let candidates = alike.not().and(objects.equals(empty).not());
    let none = M8::splat(0);
    if !candidates.any() {
        return none;
    }
    let offsets = &around.offsets[..around.len];
    // Masks are −1 where they are set: counts are kept negative.
    let mut foreign = none;
    for &offset in offsets {
        let others = M8::load(&store.object, first.wrapping_add_signed(offset));
        foreign = foreign.plus(others.equals(objects).not().and(others.equals(empty).not()));
    }
    let candidates = candidates.and(foreign.less_than(M8::splat(-5i32 as u32)));
    if !candidates.any() {
        return none;
    }
    let limit = F8::load(&store.depth, first) * F8::splat(1.0 - COVERS);
    let (mut nearer, mut samples) = (none, none);
    for &offset in offsets {
        let j = first.wrapping_add_signed(offset);
        let others = M8::load(&store.object, j);
        let is_sample = others.equals(empty).not();
        let covers = F8::load(&store.depth, j).less_than(limit);
        samples = samples.plus(is_sample);
        nearer = nearer.plus(is_sample.and(covers).and(others.equals(objects).not()));
    }
    // nearer + others ≥ samples.
    let enough = samples.plus(M8::splat(around.others)).less_than(nearer).not();
    let all_but_few = nearer.less_than(M8::splat(-5i32 as u32)).and(enough);
    candidates.and(all_but_few)
}
