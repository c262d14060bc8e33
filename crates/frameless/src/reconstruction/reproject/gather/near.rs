//! What is in and around eight neighbouring pixels.

use super::rows::{Columns, TILES};
use crate::reconstruction::reproject::store::{CENTRAL_PX, EMPTY, Tick};
use crate::wide::{F8, M8, Unit};

/// What lies farther than all around a hole by more than this ratio is behind them.
const BEHIND: f32 = 0.07;

/// The expected error of samples.
#[derive(Clone, Copy)]
pub(super) struct Model<U: Unit> {
    /// The tile's learned rate of change, and its contrast.
    v: F8<U>,
    s: F8<U>,
    /// ε: so that a sample at the very centre does not weigh everything.
    floor: F8<U>,
}

impl<U: Unit> Model<U> {
    #[inline(always)]
    pub(super) fn new(v: f32, s: f32) -> Self {
        Model { v: F8::splat(v), s: F8::splat(s), floor: F8::splat(1e-4 * s + 2e-6) }
    }

    #[inline(always)]
    fn error(&self, distance2: F8<U>, age_secs: F8<U>) -> F8<U> {
        self.v * age_secs + self.s * distance2
    }
}

/// Eight pixels in a row, of cells of which `N` × `N` = `SUBS` are in a pixel.
#[derive(Clone, Copy)]
pub(super) struct Near<'a, const N: usize, const SUBS: usize> {
    /// Their row, with the ones above and below it.
    rows: [&'a [Columns; SUBS]; 3],
    /// Where their first cells' left neighbours are.
    first: usize,
}

/// A cell around a pixel's.
struct Cell<'a> {
    columns: &'a Columns,
    at: usize,
    /// From the pixel to the cell's.
    step: [f32; 2],
    /// Whether it is at most one cell away.
    is_near: bool,
}

impl Cell<'_> {
    #[inline(always)]
    fn object<U: Unit>(&self) -> M8<U> {
        self.columns.object(self.at)
    }

    #[inline(always)]
    fn depth<U: Unit>(&self) -> F8<U> {
        self.columns.depth(self.at)
    }
}

/// What has been found around eight holes.
struct Found<U: Unit> {
    /// Depths of the nearest and of the farthest sample, and the object of the latter.
    least: F8<U>,
    most: F8<U>,
    farthest: M8<U>,
    /// The nearest object at opposite sides, and its depth.
    enclosing: M8<U>,
    depth: F8<U>,
}

impl<U: Unit> Found<U> {
    #[inline(always)]
    fn new() -> Self {
        let (far, empty) = (F8::splat(f32::INFINITY), M8::splat(EMPTY));
        Found { least: far, most: F8::splat(-1.0), farthest: empty, enclosing: empty, depth: far }
    }

    #[inline(always)]
    fn add(&mut self, object: M8<U>, depth: F8<U>) {
        let is_sample = object.equals(M8::splat(EMPTY)).not();
        let is_farther = self.most.less_than(depth).and(is_sample);
        self.most = depth.or(is_farther, self.most);
        self.farthest = object.or(is_farther, self.farthest);
        self.least = depth.or(depth.less_than(self.least).and(is_sample), self.least);
    }

    /// A sample, and who is at the opposite side.
    #[inline(always)]
    fn add_between(&mut self, object: M8<U>, depth: F8<U>, opposite: M8<U>) {
        let empty = M8::splat(EMPTY);
        let on_both_sides = opposite.equals(object).and(object.equals(empty).not());
        let is_nearer = depth.less_than(self.depth).either(self.enclosing.equals(empty));
        let encloses = on_both_sides.and(is_nearer);
        self.depth = depth.or(encloses, self.depth);
        self.enclosing = object.or(encloses, self.enclosing);
    }
}

/// What is around eight pixels that have no samples.
pub(super) struct AroundHoles<U: Unit> {
    /// The object that is probably there; [`EMPTY`] where there is none around.
    pub(super) object: M8<U>,
    /// Where the last ray tells more.
    pub(super) by_ray: M8<U>,
}

/// What eight pixels show.
pub(super) struct Seen<U: Unit> {
    pub(super) rgb: [F8<U>; 3],
    /// The object; [`EMPTY`] where there is none.
    pub(super) object: M8<U>,
    /// The expected error of the reference.
    pub(super) error: F8<U>,
    /// When the pixel's newest sample was traced.
    pub(super) tick: M8<U>,
    /// Whether there is a sample at the pixel's centre, and one that was traced there.
    pub(super) central: M8<U>,
    pub(super) traced: M8<U>,
}

impl<U: Unit> Seen<U> {
    /// Of one cell per pixel.
    #[inline(always)]
    fn new(columns: &Columns, at: usize, model: &Model<U>, carried: Tick) -> Self {
        let ([x, y], object) = (columns.place(at), columns.object(at));
        let (tick, age_secs) = (columns.tick(at), columns.age_secs(at));
        let (none, empty) = (M8::splat(0), M8::splat(EMPTY));
        let distance2 = x * x + y * y;
        let is_sample = object.equals(empty).not();
        let central = distance2.less_than(F8::splat(CENTRAL_PX * CENTRAL_PX)).and(is_sample);
        let is_later = none.less_than(tick.minus(M8::splat(carried.0)));
        let error = model.error(distance2, age_secs);
        Seen {
            rgb: F8::all_or(columns.rgb(at), is_sample, [F8::splat(0.0); 3]),
            object,
            error: error.or(is_sample, F8::splat(f32::MAX)),
            tick: tick.and(is_sample),
            central,
            traced: central.and(is_later),
        }
    }

    /// With others of the same pixels.
    #[inline(always)]
    fn join(&mut self, other: &Self) {
        let (none, empty) = (M8::splat(0), M8::splat(EMPTY));
        let is_first = self.object.equals(empty);
        let is_newer = none.less_than(other.tick.minus(self.tick)).either(is_first);
        self.tick = other.tick.or(is_newer.and(other.object.equals(empty).not()), self.tick);
        let better = other.error.less_than(self.error);
        self.error = other.error.or(better, self.error);
        self.object = other.object.or(better, self.object);
        self.rgb = F8::all_or(other.rgb, better, self.rgb);
        self.central = self.central.either(other.central);
        self.traced = self.traced.either(other.traced);
    }
}

impl<'a, const N: usize, const SUBS: usize> Near<'a, N, SUBS> {
    /// The pixels of the `nth` tile.
    #[inline(always)]
    pub(super) fn new(rows: [&'a [Columns; SUBS]; 3], nth: usize) -> Self {
        // So the compiler knows that all neighbours are there.
        Near { rows, first: 8 * nth.min(TILES - 1) }
    }

    /// Of the cells of the 3×3 pixels around, row by row, the `k`th.
    #[inline(always)]
    fn cell(&self, k: usize) -> Cell<'a> {
        let [column, row] = [k % (3 * N), k / (3 * N)];
        let [dx, dy] = [column / N, row / N];
        let near = N - 1..=2 * N;
        Cell {
            columns: &self.rows[dy][row % N * N + column % N],
            at: self.first + dx,
            step: [dx as f32 - 1.0, dy as f32 - 1.0],
            is_near: near.contains(&column) && near.contains(&row),
        }
    }

    /// The pixels' own samples with the least expected error. `carried`: as in [`Look`](super::Look).
    #[inline(always)]
    pub(super) fn own<U: Unit>(&self, model: &Model<U>, carried: Tick) -> Seen<U> {
        let ([_, own, _], at) = (self.rows, self.first + 1);
        let mut seen = Seen::new(&own[0], at, model, carried);
        for columns in &own[1..] {
            seen.join(&Seen::new(columns, at, model, carried));
        }
        seen
    }

    /// What is around the pixels, those that have no samples. `before`: the last refresh.
    #[inline(always)]
    pub(super) fn around_holes<U: Unit>(&self, before: Tick) -> AroundHoles<U> {
        if N > 1 {
            return AroundHoles { object: self.nearest(), by_ray: M8::splat(0) };
        }
        let mut found = Found::new();
        // Nothing is in the pixels themselves.
        for k in 0..4 {
            let (one, other) = (self.cell(k), self.cell(8 - k));
            let (object, depth) = (one.object(), one.depth());
            found.add(object, depth);
            found.add_between(object, depth, other.object());
        }
        for k in 5..9 {
            found.add(self.cell(k).object(), self.cell(k).depth());
        }
        let is_open = found.enclosing.equals(M8::splat(EMPTY));
        let own = self.cell(4);
        let is_new = M8::splat(0).less_than(own.columns.tick(own.at).minus(M8::splat(before.0)));
        let is_behind = found.least.less_than(own.depth() * F8::splat(1.0 - BEHIND));
        let by_ray = is_open.and(is_new).and(is_behind);
        AroundHoles { object: found.farthest.or(is_open, found.enclosing), by_ray }
    }

    /// The colours of the samples that were in the pixels last.
    #[inline(always)]
    pub(super) fn last<U: Unit>(&self) -> [F8<U>; 3] {
        self.rows[1][0].rgb(self.first + 1)
    }

    /// The objects of the samples nearest to the centres of holes; [`EMPTY`] where there is none around.
    #[inline(always)]
    fn nearest<U: Unit>(&self) -> M8<U> {
        let mut least = F8::splat(f32::INFINITY);
        let mut nearest = M8::splat(EMPTY);
        for k in 0..9 * SUBS {
            let Cell { columns, at, step, .. } = self.cell(k);
            let object = columns.object(at);
            let is_sample = object.equals(M8::splat(EMPTY)).not();
            let distance2 = distance2(columns.place(at), step);
            let nearer = distance2.less_than(least).and(is_sample);
            least = distance2.or(nearer, least);
            nearest = object.or(nearer, nearest);
        }
        nearest
    }

    /// Over the objects' samples: those in the pixel's cells and one further around, for holes in the 3×3 pixels around.
    #[inline(always)]
    pub(super) fn mean<U: Unit>(
        &self,
        model: &Model<U>,
        object: M8<U>,
        holes: M8<U>,
    ) -> [F8<U>; 3] {
        let (mut sums, mut weights) = ([F8::splat(0.0); 3], F8::splat(0.0));
        for k in 0..9 * SUBS {
            let Cell { columns, at, step, is_near } = self.cell(k);
            let same = columns.object(at).equals(object);
            let counts = if is_near { same } else { same.and(holes) };
            let distance2 = distance2(columns.place(at), step);
            let error = model.error(distance2, columns.age_secs(at)) + model.floor;
            let weight = (F8::splat(1.0) / (error * error)).or(counts, F8::splat(0.0));
            weights = weights + weight;
            for (sum, channel) in sums.iter_mut().zip(columns.rgb(at)) {
                *sum = *sum + weight * channel;
            }
        }
        let [red, green, blue] = sums;
        [red / weights, green / weights, blue / weights]
    }
}

/// Squared distance from the pixels' centres to samples that are so far from those of their own, which are a `step` away.
#[inline(always)]
fn distance2<U: Unit>([x, y]: [F8<U>; 2], step: [f32; 2]) -> F8<U> {
    let (dx, dy) = (plus(x, step[0]), plus(y, step[1]));
    dx * dx + dy * dy
}

/// Mostly known when it is compiled, and often nothing.
#[inline(always)]
fn plus<U: Unit>(from: F8<U>, step: f32) -> F8<U> {
    if step == 0.0 { from } else { from + F8::splat(step) }
}

#[cfg(test)]
mod tests {
    use super::super::rows::BLANK;
    use super::*;
    use crate::wide::{self, Task};

    /// What a hole shows between a white sample at the first place around it, row by row, and a black one at the second, both to the right
    /// of and below their pixels' centres.
    struct Between<'a>([usize; 2], &'a mut f32);

    impl Task for Between<'_> {
        #[inline(always)]
        fn run<U: Unit>(self) {
            let mut rows = [const { [BLANK] }; 3];
            rows.iter_mut().for_each(|[row]| row.object.fill(f32::from_bits(EMPTY)));
            for (place, grey) in self.0.into_iter().zip([1.0, 0.0]) {
                let ([row], column) = (&mut rows[place / 3], place % 3);
                row.object[column] = f32::from_bits(7);
                row.place.iter_mut().for_each(|place| place[column] = 0.4);
                row.rgb.iter_mut().for_each(|channel| channel[column] = grey);
            }
            let near = Near::<1, 1>::new(rows.each_ref(), 0);
            let model = Model::<U>::new(0.0, 1.0);
            let object = near.around_holes::<U>(Tick::default()).object;
            let [red, ..] = near.mean(&model, object, M8::splat(u32::MAX));
            *self.1 = red.lanes()[0];
        }
    }

    #[test]
    fn who_is_nearer_counts_more() {
        // Above and below, left and right, at two corners.
        for pair in [[1, 7], [3, 5], [0, 8]] {
            let [mut nearer, mut farther] = [0.0; 2];
            wide::run(Between(pair, &mut nearer));
            wide::run(Between([pair[1], pair[0]], &mut farther));
            assert!(nearer > 0.9 && (nearer + farther - 1.0).abs() < 1e-5, "{pair:?} {nearer}");
        }
    }
}
