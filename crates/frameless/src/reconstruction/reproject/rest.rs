//! Which pixels are at rest, and what they show: those with a sample at the centre, in and around which nothing moves.

use super::relight::Relight;
use super::settle::{self, Means};
use super::store::Store;
use crate::Refresh;
use crate::wide::{self, M8, Unit};

/// Marks the pixels of which a sample moves, each at its first cell.
pub(super) fn mark_moving(store: &Store, moves: impl Fn(u32) -> bool, moving: &mut [u8]) {
    wide::run(Marks { store, moves, moving });
}

struct Marks<'a, F> {
    store: &'a Store,
    moves: F,
    moving: &'a mut [u8],
}

impl<F: Fn(u32) -> bool> wide::Task for Marks<'_, F> {
    #[inline(always)]
    fn run<U: Unit>(self) {
        let (eights, _) = self.store.object.as_chunks::<8>();
        for sub in eights.chunks_exact(self.store.layout.plane / 8) {
            for (objects, marks) in sub.iter().zip(self.moving.as_chunks_mut::<8>().0) {
                let first = objects[0];
                if objects.iter().any(|&object| object != first) {
                    for (mark, &object) in marks.iter_mut().zip(objects) {
                        *mark |= u8::from((self.moves)(object));
                    }
                } else if (self.moves)(first) {
                    *marks = [1; 8];
                }
            }
        }
    }
}

/// A band of rows, eight pixels at a time.
pub(super) struct Rest<'a> {
    pub(super) store: &'a Store,
    pub(super) relight: &'a Relight,
    pub(super) refresh: &'a Refresh<'a>,
    /// Row by row, bit by bit for eight pixels at a time: which have a sample at their centre.
    pub(super) central: &'a [u8],
    /// See [`mark_moving`].
    pub(super) moving: &'a [u8],
    /// The band's first pixel.
    pub(super) first: usize,
    /// Of the band's pixels, as all below.
    pub(super) means: Means<'a>,
    pub(super) picture: &'a mut [[f32; 3]],
    /// Cells that take over their pixel's mean, and which.
    pub(super) handed_back: &'a mut Vec<(usize, [f32; 3])>,
    /// Pixels whose sample at the centre has gone.
    pub(super) left: &'a mut Vec<[u32; 2]>,
}

impl wide::Task for Rest<'_> {
    #[inline(always)]
    fn run<U: Unit>(mut self) {
        let width = self.store.layout.size.width;
        let (first, rows) = (self.first as u32 / width, self.picture.len() as u32 / width);
        for y in first..first + rows {
            for x in (0..width).step_by(8) {
                self.eight::<U>(x, y, 8.min((width - x) as usize));
            }
        }
    }
}

impl Rest<'_> {
    #[inline(always)]
    fn in_band(&self, x: u32, y: u32) -> usize {
        self.store.layout.size.index(x, y) as usize - self.first
    }

    #[inline(always)]
    fn eight<U: Unit>(&mut self, x: u32, y: u32, lanes: usize) {
        let start = self.in_band(x, y);
        let all = (1 << lanes) - 1;
        let rest = self.at_rest(x, y) & all;
        let (some, many) = self.counted::<U>(start, lanes);
        let mut begin = rest & !some;
        if self.relight.has_changed_any() {
            begin |= rest & some & self.relit(x, y, lanes);
        }
        each(begin, |lane| self.begin(x + lane as u32, y));
        each(some & !rest, |lane| self.end(x + lane as u32, y));
        let shown = many & rest & !begin;
        if shown == all {
            let means = &self.means.encoded[start..start + lanes];
            self.picture[start..start + lanes].copy_from_slice(means);
        } else {
            each(shown, |lane| self.picture[start + lane] = self.means.encoded[start + lane]);
        }
    }

    /// A bit for each of eight pixels: whether it has samples, and whether it has more than one.
    #[inline(always)]
    fn counted<U: Unit>(&self, start: usize, lanes: usize) -> (u32, u32) {
        let mut counts = [0; 8];
        for (count, &n) in counts.iter_mut().zip(&self.means.count[start..start + lanes]) {
            *count = u32::from(n);
        }
        let more_than = |n| M8::<U>::splat(n).less_than(M8::new(counts)).bits();
        (more_than(0), more_than(1))
    }

    /// A bit for each of eight pixels: whether it has a sample at its centre, and nothing moves in it and the eight around it.
    #[inline(always)]
    fn at_rest(&self, x: u32, y: u32) -> u32 {
        let stride = self.store.layout.stride;
        let first = self.store.layout.of_pixel(x as i32, y as i32);
        let around = [first - stride, first, first + stride].map(|i| {
            let eight =
                |i: usize| u64::from_le_bytes(self.moving[i..i + 8].try_into().expect("eight"));
            eight(i - 1) | eight(i) | eight(i + 1)
        });
        let moving = (around[0] | around[1] | around[2]).to_le_bytes();
        let still =
            moving.iter().enumerate().fold(0, |bits, (lane, &m)| bits | u32::from(m == 0) << lane);
        let columns = self.store.layout.size.width.div_ceil(8);
        still & u32::from(self.central[(y * columns + x / 8) as usize])
    }

    /// A bit for each of eight pixels: whether its sample at the centre has been shaded again.
    #[inline(always)]
    fn relit(&self, x: u32, y: u32, lanes: usize) -> u32 {
        (0..lanes).fold(0, |bits, lane| {
            let cell = self.store.central(x + lane as u32, y);
            let relit = cell.is_some_and(|cell| self.relight.has_changed(self.store.object[cell]));
            bits | u32::from(relit) << lane
        })
    }

    fn begin(&mut self, x: u32, y: u32) {
        if let Some(cell) = self.store.central(x, y) {
            let rgb = self.relight.linear(self.store, cell);
            self.means.begin(self.in_band(x, y), rgb, self.refresh.display);
        }
    }

    fn end(&mut self, x: u32, y: u32) {
        let pixel = self.in_band(x, y);
        let count = std::mem::take(&mut self.means.count[pixel]);
        match self.store.central(x, y) {
            None => self.left.push([x, y]),
            Some(cell) if self.refresh.is_noisy && count > 1 => {
                self.handed_back.push((cell, settle::mean(self.means.sum[pixel], count)));
            }
            Some(_) => {}
        }
    }
}

/// The bits that are set.
#[inline(always)]
fn each(mut bits: u32, mut act: impl FnMut(usize)) {
    while bits != 0 {
        act(bits.trailing_zeros() as usize);
        bits &= bits - 1;
    }
}
