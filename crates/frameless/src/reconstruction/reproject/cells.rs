//! Cells to be changed while others change the cells before and behind them.

use super::store::{self, EMPTY, Record, Shading, Store, Surfel};
use super::touched::Touched;
use crate::{Surface, wide};

/// Neighbouring cells of a [`Store`]. Cells are counted from the first of these on.
pub(super) struct Cells<'a> {
    pub(super) object: &'a mut [u32],
    pub(super) record: &'a mut [Record],
    pub(super) surfel: &'a mut [Surfel],
    /// As in the store, these may be empty.
    pub(super) shading: &'a mut [Shading],
    pub(super) primitive: &'a mut [u32],
    pub(super) touched: &'a Touched,
}

impl<'a> Cells<'a> {
    /// All of them.
    pub(super) fn of(store: &'a mut Store) -> Cells<'a> {
        let Store { object, record, surfel, shading, primitive, touched, .. } = store;
        Cells { object, record, surfel, shading, primitive, touched }
    }

    /// Takes the first `count` away, or all where there are fewer.
    pub(super) fn split_off_first(&mut self, count: usize) -> Cells<'a> {
        Cells {
            object: split_off(&mut self.object, count),
            record: split_off(&mut self.record, count),
            surfel: split_off(&mut self.surfel, count),
            shading: split_off(&mut self.shading, count),
            primitive: split_off(&mut self.primitive, count),
            touched: self.touched,
        }
    }

    /// Where the sample in a cell is on its object.
    #[inline(always)]
    pub(super) fn surface(&self, i: usize) -> Surface {
        store::surface(self.object[i], self.primitive(i), &self.surfel[i])
    }

    #[inline(always)]
    pub(super) fn primitive(&self, i: usize) -> u32 {
        self.primitive.get(i).copied().unwrap_or_default()
    }

    #[inline(always)]
    pub(super) fn shading(&self, i: usize) -> Shading {
        self.shading.get(i).copied().unwrap_or_default()
    }

    /// Into a cell what few pictures need, if this one does.
    #[inline(always)]
    pub(super) fn put_rest(&mut self, i: usize, shading: &Shading, primitive: u32) {
        if let Some(room) = self.shading.get_mut(i) {
            *room = *shading;
        }
        if let Some(room) = self.primitive.get_mut(i) {
            *room = primitive;
        }
    }

    /// Begins to fetch what is in a cell.
    #[inline(always)]
    pub(super) fn prefetch(&self, i: usize) {
        wide::prefetch(self.object, i);
        wide::prefetch(self.record, i);
        wide::prefetch(self.record, i + 1);
        wide::prefetch(self.surfel, i);
        if !self.shading.is_empty() {
            wide::prefetch(self.shading, i);
        }
    }

    /// The same of the eight cells from `start` on, but for what few pictures need.
    #[inline(always)]
    pub(super) fn prefetch_eight(&self, start: usize) {
        wide::prefetch(self.object, start);
        (0..8).step_by(2).for_each(|i| wide::prefetch(self.record, start + i));
        (0..8).step_by(4).for_each(|i| wide::prefetch(self.surfel, start + i));
    }

    #[inline(always)]
    pub(super) fn is_empty(&self, i: usize) -> bool {
        self.object[i] == EMPTY
    }
}

fn split_off<'a, T>(plane: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let count = count.min(plane.len());
    plane.split_off_mut(..count).expect("no more than there are")
}
