//! The forward step: every sample to where its surface is now.
//!
//! Where two samples meet in a cell, the nearer one stays if it is nearer by 1.5 %. On the same surface the newer one stays, and
//! the other moves to the neighbouring cell on its side, if that is empty; so it is with samples whose surface is not known. At last what is seen through the cracks between a nearer
//! object's samples is taken away.

use super::store::{Anchor, EMPTY, SCREEN, Sample, Store, surface};
use crate::wide::{self, F8};
use crate::{Pose, Surface};

/// Depths within this ratio belong to the same surface.
const SAME_SURFACE: f32 = 0.015;
/// A neighbour nearer by more than this ratio covers what is behind it.
const COVERS: f32 = 0.07;

/// Scratch memory.
#[derive(Default)]
pub(super) struct Warp {
    next: Option<Store>,
    /// Where the samples are now, and how far; outside the picture where they are gone.
    px: [Vec<f32>; 2],
    depth: Vec<f32>,
    /// Per cell the old cell whose sample is here now.
    winner: Vec<u32>,
    losers: Vec<u32>,
    covered: Vec<usize>,
}

const NOBODY: u32 = u32::MAX;
/// Neither inside a picture nor NaN.
const GONE_PX: f32 = -1.0;

impl Warp {
    pub(super) fn run(&mut self, store: &mut Store, pose: &Pose) {
        self.carry(store, pose);
        self.settle(store);
        self.rebuild(store);
        self.step_aside(store);
        self.remove_seen_through_cracks(store);
    }

    /// Where every sample's surface is now.
    fn carry(&mut self, store: &Store, pose: &Pose) {
        let cells = store.layout.len();
        for plane in self.px.iter_mut().chain([&mut self.depth]) {
            plane.clear();
            plane.resize(cells, GONE_PX);
        }
        wide::run(Carry { store, pose, px: &mut self.px, depth: &mut self.depth });
    }

    /// Who gets each cell.
    fn settle(&mut self, store: &Store) {
        self.winner.clear();
        self.winner.resize(store.layout.len(), NOBODY);
        self.losers.clear();
        for i in 0..store.layout.len() {
            if store.object[i] == EMPTY {
                continue;
            }
            let Some(cell) = store.layout.of_px([self.px[0][i], self.px[1][i]]) else { continue };
            let there = self.winner[cell];
            if there == NOBODY {
                self.winner[cell] = i as u32;
                continue;
            }
            let there = there as usize;
            let (depth, other) = (self.depth[i], self.depth[there]);
            let on_screen = store.object[i] == SCREEN || store.object[there] == SCREEN;
            if !on_screen && depth < other * (1.0 - SAME_SURFACE) {
                self.winner[cell] = i as u32;
            } else if on_screen || depth <= other * (1.0 + SAME_SURFACE) {
                let is_newer = store.tick[i].wrapping_sub(store.tick[there]) as i32 > 0;
                let (winner, loser) = if is_newer { (i, there) } else { (there, i) };
                self.winner[cell] = winner as u32;
                self.losers.push(loser as u32);
            }
        }
    }

    fn rebuild(&mut self, store: &mut Store) {
        let next =
            self.next.get_or_insert_with(|| Store::new(store.layout.size, store.layout.per_side));
        if next.layout != store.layout {
            *next = Store::new(store.layout.size, store.layout.per_side);
        }
        for (cell, &from) in self.winner.iter().enumerate() {
            if from == NOBODY {
                next.object[cell] = EMPTY;
                continue;
            }
            let from = from as usize;
            for k in 0..3 {
                next.rgb[k][cell] = store.rgb[k][from];
            }
            next.tick[cell] = store.tick[from];
            next.object[cell] = store.object[from];
            next.anchor[cell] = store.anchor[from];
            next.shade[cell] = store.shade[from];
            next.px[0][cell] = self.px[0][from];
            next.px[1][cell] = self.px[1][from];
            next.depth[cell] = self.depth[from];
        }
        std::mem::swap(store, next);
    }

    fn step_aside(&mut self, store: &mut Store) {
        let Some(old) = &self.next else { return };
        let n = store.layout.per_side as f32;
        for &loser in &self.losers {
            let loser = loser as usize;
            let px = [self.px[0][loser], self.px[1][loser]];
            let [fx, fy] = px.map(|p| (p * n).fract() - 0.5);
            let beside = if fx.abs() > fy.abs() {
                [px[0] + fx.signum() / n, px[1]]
            } else {
                [px[0], px[1] + fy.signum() / n]
            };
            if let Some(i) = store.layout.of_px(beside)
                && store.is_empty(i)
            {
                store.set(i, &Sample { px, depth: self.depth[loser], ..old.get(loser) });
            }
        }
    }

    fn remove_seen_through_cracks(&mut self, store: &mut Store) {
        self.covered.clear();
        let layout = store.layout;
        let n = layout.per_side as i32;
        for y in 1..layout.size.height as i32 - 1 {
            for sub in 0..(n * n) as usize {
                let row = layout.of_pixel(0, y) + sub * layout.plane;
                for x in 1..layout.size.width as usize - 1 {
                    let i = row + x;
                    let object = store.object[i];
                    let alike = object == store.object[i - 1] && object == store.object[i + 1];
                    if !alike && object != EMPTY && is_covered(store, x as i32, y, sub) {
                        self.covered.push(i);
                    }
                }
            }
        }
        for &i in &self.covered {
            store.object[i] = EMPTY;
        }
    }
}

/// Whether at least six of the eight samples around are of nearer, other objects, and at most one is not.
fn is_covered(store: &Store, x: i32, y: i32, sub: usize) -> bool {
    let layout = &store.layout;
    let n = layout.per_side as i32;
    let (sx, sy) = (sub as i32 % n, sub as i32 / n);
    let here = layout.neighbour(x, y, sx, sy);
    let (mut nearer, mut samples) = (0, 0);
    for dy in -n..=n {
        for dx in -n..=n {
            let j = layout.neighbour(x, y, sx + dx, sy + dy);
            if j != here && !store.is_empty(j) {
                samples += 1;
                let covers = store.depth[j] < store.depth[here] * (1.0 - COVERS);
                nearer += usize::from(covers && store.object[j] != store.object[here]);
            }
        }
    }
    nearer >= 6 && nearer + 1 + 2 * (n as usize - 1) >= samples
}

struct Carry<'a> {
    store: &'a Store,
    pose: &'a Pose,
    px: &'a mut [Vec<f32>; 2],
    depth: &'a mut [f32],
}

impl wide::Task for Carry<'_> {
    #[inline(always)]
    fn run(self) {
        let Carry { store, pose, px: [px, py], depth } = self;
        let blocks =
            px.chunks_exact_mut(8).zip(py.chunks_exact_mut(8)).zip(depth.chunks_exact_mut(8));
        for (block, ((px, py), depth)) in blocks.enumerate() {
            let start = 8 * block;
            let objects = &store.object[start..start + 8];
            let object = objects[0];
            let alike = objects.iter().all(|&other| other == object);
            if alike && object == EMPTY {
                continue;
            }
            let is_rigid = !matches!(pose.deformed.get(object as usize), Some(Some(_)));
            let projection = match object {
                Surface::SKY => pose.picture_from_sky.as_ref(),
                SCREEN => None,
                object => pose.picture_from_object.get(object as usize),
            };
            if let Some(projection) = projection.filter(|_| alike && is_rigid) {
                let [x, y, z] = coordinates(&store.anchor[start..start + 8]);
                let row = |k: usize| {
                    let [a, b, c, d] = projection.0[k].map(F8::splat);
                    a * x + b * y + (c * z + d)
                };
                let w = row(3);
                let in_front = F8::splat(0.0).less_than(w);
                let gone = F8::splat(GONE_PX);
                px.copy_from_slice(&(row(0) / w).or(in_front, gone).0);
                py.copy_from_slice(&(row(1) / w).or(in_front, gone).0);
                let infinite = if object == Surface::SKY { f32::INFINITY } else { 0.0 };
                depth.copy_from_slice(&(row(2) + F8::splat(infinite)).0);
                continue;
            }
            for lane in 0..8 {
                let i = start + lane;
                match objects[lane] {
                    EMPTY => {}
                    SCREEN => {
                        (px[lane], py[lane]) = (store.px[0][i], store.px[1][i]);
                        depth[lane] = f32::INFINITY;
                    }
                    object => {
                        if let Some(there) = pose.project(&surface(object, &store.anchor[i])) {
                            [px[lane], py[lane]] = there.px;
                            depth[lane] = there.depth;
                        }
                    }
                }
            }
        }
    }
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
    planes.map(F8)
}
