//! Rows of cells, as columns of numbers.

use crate::reconstruction::reproject::store::{self, Layout, Store, TICK_SECS, Tick};
use crate::wide::{self, F8, M8, Unit};

/// So many tiles side by side are gathered before others of the same rows: what three rows of cells take of them lies in the cache nearest to
/// the processor.
pub(super) const TILES: usize = 64;
/// Eights of cells in which these and the pixels beside them are.
pub(super) const EIGHTS: usize = TILES + 1;

/// Numbers of neighbouring cells.
pub(super) type Plane = [f32; 8 * EIGHTS];

/// Neighbouring cells of a sub-grid.
#[derive(Clone)]
pub(super) struct Columns {
    /// From the pixel's centre.
    pub(super) place: [Plane; 2],
    /// The bits of the object's number.
    pub(super) object: Plane,
    /// When the sample was traced, the bits of the tick, and how long ago.
    pub(super) tick: Plane,
    pub(super) age_secs: Plane,
    pub(super) rgb: [Plane; 3],
    pub(super) depth: Plane,
}

/// Nothing that anybody reads.
pub(super) const BLANK: Columns = {
    let plane = [0.0; 8 * EIGHTS];
    Columns {
        place: [plane; 2],
        object: plane,
        tick: plane,
        age_secs: plane,
        rgb: [plane; 3],
        depth: plane,
    }
};

/// So many cells later what is prefetched is read.
const CELLS_AHEAD: usize = 64;

impl Columns {
    /// Reads from cell `from` on. `wanted`: of eights of cells.
    #[inline(always)]
    fn read<U: Unit>(&mut self, store: &Store, from: usize, now: Tick, wanted: &[bool; EIGHTS]) {
        for eight in (0..EIGHTS).filter(|&eight| wanted[eight]) {
            let (at, start) = (8 * eight, from + 8 * eight);
            wide::prefetch(&store.object, start + CELLS_AHEAD);
            (0..8).step_by(2).for_each(|i| wide::prefetch(&store.record, start + CELLS_AHEAD + i));
            let (records, _) = store.record[start..start + 8].as_chunks::<8>();
            let [depth, place, tick, r, g, b] = F8::<U>::six_columns(store::rows_of(&records[0]));
            let age = M8::splat(now.0).minus(tick.to_bits()).to_f32();
            let [x, y] = store::offsets(place);
            x.store(&mut self.place[0], at);
            y.store(&mut self.place[1], at);
            M8::<U>::load(&store.object, start).as_f32().store(&mut self.object, at);
            tick.store(&mut self.tick, at);
            (age * F8::splat(TICK_SECS)).store(&mut self.age_secs, at);
            r.store(&mut self.rgb[0], at);
            g.store(&mut self.rgb[1], at);
            b.store(&mut self.rgb[2], at);
            store::depths(depth).store(&mut self.depth, at);
        }
    }

    /// Column and row of eight samples from their pixels' centres.
    #[inline(always)]
    pub(super) fn place<U: Unit>(&self, at: usize) -> [F8<U>; 2] {
        [F8::load(&self.place[0], at), F8::load(&self.place[1], at)]
    }

    #[inline(always)]
    pub(super) fn object<U: Unit>(&self, at: usize) -> M8<U> {
        F8::load(&self.object, at).to_bits()
    }

    #[inline(always)]
    pub(super) fn tick<U: Unit>(&self, at: usize) -> M8<U> {
        F8::load(&self.tick, at).to_bits()
    }

    #[inline(always)]
    pub(super) fn age_secs<U: Unit>(&self, at: usize) -> F8<U> {
        F8::load(&self.age_secs, at)
    }

    #[inline(always)]
    pub(super) fn depth<U: Unit>(&self, at: usize) -> F8<U> {
        F8::load(&self.depth, at)
    }

    #[inline(always)]
    pub(super) fn rgb<U: Unit>(&self, at: usize) -> [F8<U>; 3] {
        let [r, g, b] = &self.rgb;
        [F8::load(r, at), F8::load(g, at), F8::load(b, at)]
    }
}

/// So many rows of pixels are there at a time, turn by turn.
const ROWS: usize = 3;

/// Rows of pixels, each as the columns of its sub-grids.
pub(super) struct Rows<'a, const SUBS: usize>(&'a mut [[Columns; SUBS]]);

impl<'a, const SUBS: usize> Rows<'a, SUBS> {
    /// With scratch memory.
    pub(super) fn new(columns: &'a mut Vec<Columns>) -> Rows<'a, SUBS> {
        columns.resize(ROWS * SUBS, BLANK);
        Rows(columns.as_chunks_mut().0)
    }

    /// Reads what is `wanted` of the row of pixels `y` from column `x` on, a multiple of eight, instead of what was there of the row three before. −1 and
    /// the height are the border.
    #[inline(always)]
    pub(super) fn read<U: Unit>(
        &mut self,
        store: &Store,
        now: Tick,
        [x, y]: [i32; 2],
        wanted: &[bool; EIGHTS],
    ) {
        let Layout { plane, .. } = store.layout;
        let from = store.layout.row(y) + x as usize;
        for (sub, columns) in self.0[turn(y)].iter_mut().enumerate() {
            columns.read::<U>(store, from + sub * plane, now, wanted);
        }
    }

    /// The row of pixels `y`, with the ones above and below it.
    #[inline(always)]
    pub(super) fn around(&self, y: i32) -> [&[Columns; SUBS]; ROWS] {
        [y - 1, y, y + 1].map(|y| &self.0[turn(y)])
    }
}

#[inline(always)]
fn turn(y: i32) -> usize {
    (y + 1) as usize % ROWS
}
