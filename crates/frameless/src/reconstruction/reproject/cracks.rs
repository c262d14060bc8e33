//! What is seen through the cracks between a nearer object's samples is taken away.
//!
//! A sample goes if, of those within a pixel's distance, at least six are of other objects and nearer by 7 %, and at most one is not
//! (with more cells per pixel, a few more).

use std::ops::Range;

use super::store::{EMPTY, Layout, Store};
use crate::bands;
use crate::wide::{self, F8, M8, Offsets, Planes, Unit};

/// A neighbour nearer by more than this ratio covers what is behind it.
const COVERS: f32 = 0.07;

/// After the warp. `covered` is scratch memory: cells of each band of rows.
pub(super) fn remove(store: &mut Store, threads: usize, covered: &mut Vec<Vec<u32>>) {
    let height = store.layout.size.height;
    let rows = bands::rows(height, threads);
    covered.resize_with(height.div_ceil(rows) as usize, Vec::new);
    let whole = &*store;
    let bands = covered.iter_mut().zip((0..height).step_by(rows as usize)).map(|(covered, row)| {
        // Pixels at the border have no neighbours on all sides.
        let rows = row.max(1) as i32..(row + rows).min(height.saturating_sub(1)) as i32;
        Cracks { store: whole, rows, covered }
    });
    bands::run(threads, bands.collect(), wide::run);
    for i in covered.iter_mut().flat_map(|cells| cells.drain(..)) {
        store.remove(i as usize);
    }
}

struct Cracks<'a> {
    store: &'a Store,
    rows: Range<i32>,
    covered: &'a mut Vec<u32>,
}

impl wide::Task for Cracks<'_> {
    #[inline(always)]
    fn run<U: Unit>(self) {
        let Cracks { store, rows, covered } = self;
        let layout = &store.layout;
        let (n, size) = (layout.per_side as i32, layout.size);
        for sub in 0..n * n {
            let around = Around::new(layout, sub);
            for y in rows.clone() {
                for x in (1..size.width as i32 - 1).step_by(8) {
                    let first = layout.of_pixel(x, y) + sub as usize * layout.plane;
                    let inside = M8::<U>::first_lanes((size.width as i32 - 1 - x) as usize);
                    let mask = are_covered(store, first, &around).and(inside);
                    mask.for_each(|lane| covered.push((first + lane) as u32));
                }
            }
        }
    }
}

/// From a cell to those within a pixel's distance.
struct Around {
    offsets: Vec<isize>,
    objects: Offsets,
    /// How many may be there that do not cover.
    others: u32,
}

impl Around {
    fn new(layout: &Layout, sub: i32) -> Around {
        let n = layout.per_side as i32;
        let (sx, sy) = (sub % n, sub / n);
        let here = layout.neighbour(1, 1, sx, sy) as isize;
        let mut offsets = Vec::new();
        for dy in -n..=n {
            for dx in -n..=n {
                if (dx, dy) != (0, 0) {
                    offsets.push(layout.neighbour(1, 1, sx + dx, sy + dy) as isize - here);
                }
            }
        }
        let objects = Offsets::new(offsets.iter().copied());
        Around { offsets, objects, others: 1 + 2 * (n as u32 - 1) }
    }
}

/// Whether at least six of the eight samples around are of nearer, other objects, and at most one is not.
#[inline(always)]
fn are_covered<U: Unit>(store: &Store, first: usize, around: &Around) -> M8<U> {
    let objects = M8::load(&store.object, first);
    let empty = M8::splat(EMPTY);
    let left = M8::load(&store.object, first - 1).equals(objects);
    let alike = left.and(M8::load(&store.object, first + 1).equals(objects));
    let candidates = alike.not().and(objects.equals(empty).not());
    let none = M8::splat(0);
    if !candidates.any() {
        return none;
    }
    // Masks are −1 where they are set: counts are kept negative.
    let mut foreign = none;
    let objects_around = Planes::new([&store.object]).around(first, &around.objects);
    for k in 0..objects_around.len() {
        let [others] = objects_around.load(k);
        foreign = foreign.plus(others.equals(objects).not().and(others.equals(empty).not()));
    }
    let candidates = candidates.and(foreign.less_than(M8::splat(-5i32 as u32)));
    if !candidates.any() {
        return none;
    }
    let limit = store.depths::<U>(first) * F8::splat(1.0 - COVERS);
    let (mut nearer, mut samples) = (none, none);
    for (k, &offset) in around.offsets.iter().enumerate() {
        let [others] = objects_around.load(k);
        let is_sample = others.equals(empty).not();
        let covers = store.depths::<U>(first.wrapping_add_signed(offset)).less_than(limit);
        samples = samples.plus(is_sample);
        nearer = nearer.plus(is_sample.and(covers).and(others.equals(objects).not()));
    }
    // nearer + others ≥ samples.
    let enough = samples.plus(M8::splat(around.others)).less_than(nearer).not();
    let all_but_few = nearer.less_than(M8::splat(-5i32 as u32)).and(enough);
    candidates.and(all_but_few)
}
