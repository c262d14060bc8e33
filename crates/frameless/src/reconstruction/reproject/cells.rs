//! Cells to be changed while others change the cells before and behind them.

use super::store::{Anchor, EMPTY, Store};
use crate::Surface;

/// Neighbouring cells of a [`Store`], without its slots. Cells are counted from the first of these on.
pub(super) struct Cells<'a> {
    pub(super) rgb: [&'a mut [f32]; 3],
    pub(super) px: [&'a mut [f32]; 2],
    pub(super) depth: &'a mut [f32],
    pub(super) tick: &'a mut [u32],
    pub(super) object: &'a mut [u32],
    pub(super) anchor: &'a mut [Anchor],
    pub(super) slot: &'a mut [u32],
}

impl<'a> Cells<'a> {
    /// All of them.
    pub(super) fn of(store: &'a mut Store) -> Cells<'a> {
        Cells {
            rgb: store.rgb.each_mut().map(Vec::as_mut_slice),
            px: store.px.each_mut().map(Vec::as_mut_slice),
            depth: &mut store.depth,
            tick: &mut store.tick,
            object: &mut store.object,
            anchor: &mut store.anchor,
            slot: &mut store.slot,
        }
    }

    /// Takes the first `count` away, or all where there are fewer.
    pub(super) fn split_off_first(&mut self, count: usize) -> Cells<'a> {
        let count = count.min(self.object.len());
        Cells {
            rgb: self.rgb.each_mut().map(|plane| split_off(plane, count)),
            px: self.px.each_mut().map(|plane| split_off(plane, count)),
            depth: split_off(&mut self.depth, count),
            tick: split_off(&mut self.tick, count),
            object: split_off(&mut self.object, count),
            anchor: split_off(&mut self.anchor, count),
            slot: split_off(&mut self.slot, count),
        }
    }

    /// Where the sample in a cell is on its object.
    #[inline(always)]
    pub(super) fn surface(&self, i: usize) -> Surface {
        self.anchor[i].on(self.object[i])
    }

    #[inline(always)]
    pub(super) fn is_empty(&self, i: usize) -> bool {
        self.object[i] == EMPTY
    }
}

fn split_off<'a, T>(plane: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    plane.split_off_mut(..count).expect("no more than there are")
}
