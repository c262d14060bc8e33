//! Cells to be changed while others change the cells before and behind them.

use super::store::{self, EMPTY, Lit, Record, Store, Surfel};
use super::touched::Touched;
use crate::{Surface, wide};

/// Neighbouring cells of a [`Store`]. Cells are counted from the first of these on.
pub(super) struct Cells<'a> {
    pub(super) object: &'a mut [u32],
    pub(super) record: &'a mut [Record],
    pub(super) surfel: &'a mut [Surfel],
    pub(super) lit: &'a mut [Lit],
    pub(super) touched: &'a Touched,
}

impl<'a> Cells<'a> {
    /// All of them.
    pub(super) fn of(store: &'a mut Store) -> Cells<'a> {
        let Store { object, record, surfel, lit, touched, .. } = store;
        Cells { object, record, surfel, lit, touched }
    }

    /// Takes the first `count` away, or all where there are fewer.
    pub(super) fn split_off_first(&mut self, count: usize) -> Cells<'a> {
        Cells {
            object: split_off(&mut self.object, count),
            record: split_off(&mut self.record, count),
            surfel: split_off(&mut self.surfel, count),
            lit: split_off(&mut self.lit, count),
            touched: self.touched,
        }
    }

    /// Where the sample in a cell is on its object.
    #[inline(always)]
    pub(super) fn surface(&self, i: usize) -> Surface {
        store::surface(self.object[i], &self.record[i], &self.surfel[i])
    }

    /// Begins to fetch what is in a cell.
    #[inline(always)]
    pub(super) fn prefetch(&self, i: usize) {
        wide::prefetch(self.object, i);
        wide::prefetch(self.record, i);
        wide::prefetch(self.surfel, i);
        wide::prefetch(self.lit, i);
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
