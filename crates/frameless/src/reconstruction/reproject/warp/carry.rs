//! Samples of neighbouring rows, lifted and put down.

use std::ops::Range;

use super::{GONE_PX, Losing, Motion, Moved, Moving, NOWHERE, put_down};
use crate::pose::BEHIND;
use crate::reconstruction::reproject::cells::Cells;
use crate::reconstruction::reproject::store::{self, EMPTY, Layout, Record, Shading, Surfel};
use crate::wide::{self, F8, M8, Unit};
use crate::{Pose, Surface, Window};

/// Rows that are lifted before the first of them is put down again. Few enough to lie in the cache, and enough that nearly all
/// samples come to rows that have been lifted.
const ROWS_AHEAD: usize = 8;

/// So many cells later what is prefetched is lifted.
const CELLS_AHEAD: usize = 64;

/// Carries the samples of a band of rows.
pub(super) struct Carry<'a, F> {
    pub(super) layout: Layout,
    pub(super) motion: &'a Motion<'a>,
    /// Of an object number, whether its samples stay where they are.
    pub(super) rests: &'a F,
    pub(super) band: Band<'a>,
    pub(super) lifted: &'a mut Lifted,
}

/// Neighbouring rows.
pub(super) struct Band<'a> {
    pub(super) rows: Range<i32>,
    pub(super) cells: Cells<'a>,
    /// The number of the first of its cells in the whole store.
    pub(super) first: usize,
    pub(super) moved: &'a mut Moved,
}

/// Scratch memory: the samples of one row in each, turn by turn.
#[derive(Default)]
pub(super) struct Lifted([Row; ROWS_AHEAD]);

#[derive(Default)]
struct Row {
    /// So many, and room for more.
    samples: Vec<LiftedSample>,
    len: usize,
    /// Of these, in the same order; empty if the store has no such.
    rests: Vec<Rest>,
}

/// A sample that has been lifted, in a line of the cache.
#[derive(Clone, Copy, Default)]
#[repr(align(64))]
struct LiftedSample {
    /// With the position and the depth that it has now.
    record: Record,
    /// Where it is now; [`NOWHERE`] outside the picture.
    px: [f32; 2],
    surfel: Surfel,
    cell: u32,
    object: u32,
}

/// What few pictures need of it, see [`store::Store`].
#[derive(Clone, Copy, Default)]
struct Rest {
    shading: Shading,
    primitive: u32,
}

/// Of a sample without.
const PLAIN: Rest = Rest { shading: Shading([0.0; 6]), primitive: 0 };

impl LiftedSample {
    #[inline(always)]
    fn moving<'a>(&'a self, rest: &'a Rest) -> Moving<'a> {
        let LiftedSample { px, object, record, surfel, .. } = self;
        let Rest { shading, primitive } = rest;
        Moving { px: *px, object: *object, primitive: *primitive, record, surfel, shading }
    }
}

impl Row {
    /// For so many samples.
    fn begin(&mut self, most: usize) {
        self.samples.resize(most, LiftedSample::default());
        self.len = 0;
        self.rests.clear();
    }

    /// Takes the samples that are `moving` out of the eight cells from `start` on; `to`: the cells where they are now.
    #[inline(always)]
    fn lift<U: Unit>(
        &mut self,
        cells: &mut Cells<'_>,
        start: usize,
        moving: M8<U>,
        there: &There<U>,
        to: M8<U>,
    ) {
        let objects = M8::load(cells.object, start);
        M8::splat(EMPTY).or(moving, objects).store(cells.object, start);
        let (lanes, object, cell) = (moving.bits(), objects.lanes(), to.lanes());
        let [x, y] = [there.px[0].lanes(), there.px[1].lanes()];
        let [depth, offset] = store::words(there.px, there.depth).map(M8::lanes);
        let (records, surfels) = (&cells.record[start..start + 8], &cells.surfel[start..start + 8]);
        let room = &mut self.samples[self.len..self.len + 8];
        let mut len = 0;
        for lane in 0..8 {
            // Whoever does not move is overwritten by the next.
            room[len % 8] = LiftedSample {
                record: records[lane].moved(depth[lane], offset[lane]),
                px: [x[lane], y[lane]],
                surfel: surfels[lane],
                cell: cell[lane],
                object: object[lane],
            };
            len += (lanes >> lane & 1) as usize;
        }
        self.len += len;
        if !(cells.shading.is_empty() && cells.primitive.is_empty()) {
            let rest = |i: usize| Rest { shading: cells.shading(i), primitive: cells.primitive(i) };
            let lanes = (0..8).filter(|lane| lanes >> lane & 1 == 1);
            self.rests.extend(lanes.map(|lane| rest(start + lane)));
        }
    }
}

impl<F: Fn(u32) -> bool> wide::Task for Carry<'_, F> {
    #[inline(always)]
    fn run<U: Unit>(mut self) {
        let Range { start, end } = self.band.rows;
        for row in start..end + ROWS_AHEAD as i32 {
            // Whose turn it is to be lifted next is put down first.
            let turn = row as usize % ROWS_AHEAD;
            if row >= start + ROWS_AHEAD as i32 {
                self.put_down_row(turn, start..row.min(end));
            }
            if row < end {
                self.lift_row::<U>(row, turn);
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
    fn lift_row<U: Unit>(&mut self, y: i32, turn: usize) {
        let Layout { size, plane, stride, .. } = self.layout;
        self.lifted.0[turn].begin(self.layout.subs() * stride);
        for sub in 0..self.layout.subs() {
            let row = self.layout.of_pixel(0, y) + sub * plane - self.band.first;
            for x in (0..size.width as usize).step_by(8) {
                if self.lift_eight::<U>(row + x, turn) {
                    self.band.cells.touched.mark(x as u32, y as u32);
                }
            }
        }
    }

    /// Whether any sample of the eight cells from `start` on moves.
    #[inline(always)]
    fn lift_eight<U: Unit>(&mut self, start: usize, turn: usize) -> bool {
        let cells = &mut self.band.cells;
        cells.prefetch_eight(start + CELLS_AHEAD);
        let objects = M8::<U>::load(cells.object, start);
        let mut waiting = objects.equals(M8::splat(EMPTY)).not();
        let mut moving = M8::splat(0);
        let gone = F8::splat(GONE_PX);
        let mut there = There { px: [gone; 2], depth: gone };
        while let Some(lane) = waiting.first() {
            let object = cells.object[start + lane];
            let same = objects.equals(M8::splat(object));
            waiting = waiting.and(same.not());
            if !(self.rests)(object) {
                moving = moving.either(same);
                let now = carry_eight(cells, self.motion.now(), object, start);
                there.px = F8::all_or(now.px, same, there.px);
                there.depth = now.depth.or(same, there.depth);
            }
        }
        if moving.any() {
            let to = cells_at(&self.layout, there.px);
            self.lifted.0[turn].lift(cells, start, moving, &there, to);
        }
        moving.any()
    }

    /// `lifted`: the rows that have been lifted so far.
    #[inline(always)]
    fn put_down_row(&mut self, turn: usize, lifted: Range<i32>) {
        let Band { cells, first, moved, .. } = &mut self.band;
        let Moved { early, losers } = &mut **moved;
        let here = self.layout.row(lifted.start) as u32..self.layout.row(lifted.end) as u32;
        let (layout, motion, first) = (&self.layout, self.motion, *first);
        let mut losing = Losing { layout, motion, lifted: &here, first, losers };
        let row = &self.lifted.0[turn];
        for (nth, sample) in row.samples[..row.len].iter().enumerate() {
            let moving = sample.moving(row.rests.get(nth).unwrap_or(&PLAIN));
            let cell = sample.cell as usize;
            if here.contains(&(layout.in_plane(cell) as u32)) {
                put_down(cells, cell - first, &moving, &mut losing);
            } else if sample.cell != NOWHERE {
                early.push((sample.cell, moving.mover()));
            }
        }
    }
}

/// The eight samples from `start` on, as if all were of the same object.
#[inline(always)]
fn carry_eight<U: Unit>(cells: &Cells<'_>, pose: &Pose, object: u32, start: usize) -> There<U> {
    let gone = F8::splat(GONE_PX);
    if matches!(pose.deformed.get(object as usize), Some(Some(_))) {
        return carry_deformed(cells, pose, object, start);
    }
    let projection = match object {
        Surface::SKY => pose.picture_from_sky.as_ref(),
        object => pose.picture_from_object.get(object as usize),
    };
    let Some(projection) = projection else { return There { px: [gone; 2], depth: gone } };
    let (surfels, _) = cells.surfel[start..start + 8].as_chunks::<8>();
    let [a, b, c, d, e, f, g, h] = &surfels[0];
    let [x, y, z, _] = F8::four_columns([&a.0, &b.0, &c.0, &d.0, &e.0, &f.0, &g.0, &h.0]);
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

fn carry_deformed<U: Unit>(cells: &Cells<'_>, pose: &Pose, object: u32, start: usize) -> There<U> {
    let (mut px, mut depth) = ([[GONE_PX; 8]; 2], [GONE_PX; 8]);
    for lane in 0..8 {
        if cells.object[start + lane] == object
            && let Some(now) = pose.project(&cells.surface(start + lane))
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
