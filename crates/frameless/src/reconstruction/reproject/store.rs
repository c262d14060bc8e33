//! The samples kept: at most one in every cell of the picture.
//!
//! What the picture needs of a sample is one record of half a line of the cache, and what its surface is another: samples are kept, and
//! put down where their surfaces have moved, one by one and all over the picture, and every place in memory that has to be looked at
//! is one to wait for. Loops over eight pixels at a time turn records into columns. Only objects' numbers lie by themselves.
//!
//! With n×n cells per pixel there are n² sub-grids, each with one cell of every pixel, one after the other; every sub-grid has a border
//! of one empty cell, so that loops over neighbours need no bounds.

use super::packed::{PackedAlbedo, PackedNormal};
use super::touched::Touched;
use crate::time::TICK_BITS;
pub(super) use crate::time::{TICK_SECS, Tick};
use crate::wide::{self, F8, M8, Unit};
use crate::{Display, Kept, Size, Surface};

/// The object number of samples of which the renderer could not say what they hit: they stay where they are in the picture.
pub(super) const SCREEN: u32 = Surface::SKY - 1;
/// The object number of an empty cell.
pub(super) const EMPTY: u32 = Surface::SKY - 2;

/// A sample so near to the centre is as good as one at the centre: rounding of its projected position.
pub(super) const CENTRAL_PX: f32 = 0.002;

/// What the picture needs of a sample: column and row, depth, the bits of its tick, red, green, blue, the bits of the primitive's number.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(32))]
pub(super) struct Record(pub(super) [f32; 8]);

/// What was hit, as in [`Surface`], and the linear colour that was traced: position, red, green, blue, the bits of the packed normal and
/// albedo.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(32))]
pub(super) struct Surfel(pub(super) [f32; 8]);

/// The lights that the traced colour shows, as in [`Surface`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(16))]
pub(super) struct Lit {
    pub(super) direct: [f32; 3],
    pub(super) lit: u32,
}

impl Record {
    /// Where in the picture, in pixels.
    #[inline(always)]
    pub(super) fn px(&self) -> [f32; 2] {
        [self.0[0], self.0[1]]
    }

    #[inline(always)]
    pub(super) fn depth(&self) -> f32 {
        self.0[2]
    }

    #[inline(always)]
    pub(super) fn tick(&self) -> Tick {
        Tick(self.0[3].to_bits())
    }

    /// Display-referred sRGB.
    #[inline(always)]
    pub(super) fn rgb(&self) -> [f32; 3] {
        [self.0[4], self.0[5], self.0[6]]
    }

    #[inline(always)]
    pub(super) fn set_rgb(&mut self, [r, g, b]: [f32; 3]) {
        (self.0[4], self.0[5], self.0[6]) = (r, g, b);
    }

    #[inline(always)]
    pub(super) fn set_px(&mut self, [x, y]: [f32; 2]) {
        (self.0[0], self.0[1]) = (x, y);
    }

    #[inline(always)]
    pub(super) fn set_depth(&mut self, depth: f32) {
        self.0[2] = depth;
    }

    /// Whether both are at the same place in the picture and of the same colour.
    #[inline(always)]
    fn looks_like(&self, other: &Record) -> bool {
        self.px() == other.px() && self.rgb() == other.rgb()
    }

    #[inline(always)]
    pub(super) fn primitive(&self) -> u32 {
        self.0[7].to_bits()
    }
}

impl Surfel {
    // Inlined: what is written to memory in small parts and read in large ones at once has to wait for all that was written before.
    #[inline(always)]
    fn new(surface: Option<&Surface>, [r, g, b]: [f32; 3]) -> Surfel {
        let Some(surface) = surface else {
            return Surfel([0.0, 0.0, 0.0, r, g, b, 0.0, 0.0]);
        };
        let [x, y, z] = surface.position;
        let normal = f32::from_bits(PackedNormal::new(surface.normal).0);
        let albedo = f32::from_bits(PackedAlbedo::new(surface.albedo).0);
        Surfel([x, y, z, r, g, b, normal, albedo])
    }

    #[inline(always)]
    pub(super) fn position(&self) -> [f32; 3] {
        [self.0[0], self.0[1], self.0[2]]
    }

    /// Linear RGB as traced.
    #[inline(always)]
    pub(super) fn linear(&self) -> [f32; 3] {
        [self.0[3], self.0[4], self.0[5]]
    }

    pub(super) fn normal(&self) -> PackedNormal {
        PackedNormal(self.0[6].to_bits())
    }

    pub(super) fn albedo(&self) -> PackedAlbedo {
        PackedAlbedo(self.0[7].to_bits())
    }
}

impl Lit {
    #[inline(always)]
    fn new(surface: Option<&Surface>) -> Lit {
        surface.map_or(Lit::default(), |surface| Lit { direct: surface.direct, lit: surface.lit })
    }
}

/// The numbers of eight records.
#[inline(always)]
pub(super) fn rows_of([a, b, c, d, e, f, g, h]: &[Record; 8]) -> [&[f32; 8]; 8] {
    [&a.0, &b.0, &c.0, &d.0, &e.0, &f.0, &g.0, &h.0]
}

/// Where a sample is on its object, and no more.
#[inline(always)]
pub(super) fn surface(object: u32, record: &Record, surfel: &Surfel) -> Surface {
    let (primitive, position) = (record.primitive(), surfel.position());
    Surface { object, primitive, position, ..Surface::default() }
}

/// One sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) object: u32,
    pub(super) record: Record,
    pub(super) surfel: Surfel,
    pub(super) lit: Lit,
}

/// Half a second.
const VERY_OLD_TICKS: u32 = 500_000_000 >> TICK_BITS;

impl Sample {
    /// At an unknown depth.
    #[inline(always)]
    pub(super) fn new(kept: &Kept<'_>, i: usize, display: &Display) -> Sample {
        let (surface, linear) = (kept.surfaces.get(i), kept.new[i]);
        let (object, primitive) = surface.map_or((SCREEN, 0), |s| (s.object, s.primitive));
        let [x, y] = kept.requests[i].position_px(kept.size);
        let [r, g, b] = display.encode(linear);
        let [tick, primitive] = [Tick::of(kept.now).0, primitive].map(f32::from_bits);
        let record = Record([x, y, f32::INFINITY, tick, r, g, b, primitive]);
        Sample { object, record, surfel: Surfel::new(surface, linear), lit: Lit::new(surface) }
    }

    /// Where it is on its object, and no more.
    #[inline(always)]
    pub(super) fn surface(&self) -> Surface {
        surface(self.object, &self.record, &self.surfel)
    }
}

/// How the cells lie in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    pub(super) size: Size,
    /// Cells per pixel side.
    pub(super) per_side: u32,
    /// From a cell to the one below it in its sub-grid.
    pub(super) stride: usize,
    /// Cells of a sub-grid, its border included.
    pub(super) plane: usize,
}

impl Layout {
    pub(super) fn new(size: Size, per_side: u32) -> Layout {
        // Rows end with room for a whole block of eight.
        let stride = (size.width as usize).next_multiple_of(8) + 8;
        Layout { size, per_side, stride, plane: stride * (size.height as usize + 2) }
    }

    /// How many sub-grids there are: cells per pixel.
    pub(super) fn subs(&self) -> usize {
        (self.per_side * self.per_side) as usize
    }

    pub(super) fn len(&self) -> usize {
        self.plane * self.subs()
    }

    /// Where the first sub-grid's cell of pixel (x, y) is; −1 and the width or height lie in the border.
    #[inline(always)]
    pub(super) fn of_pixel(&self, x: i32, y: i32) -> usize {
        self.row(y) + (x + 1) as usize
    }

    /// Where the first sub-grid's row of pixels y begins, with the border to its left.
    #[inline(always)]
    pub(super) fn row(&self, y: i32) -> usize {
        (y + 1) as usize * self.stride
    }

    /// The cell at a position in the picture, in pixels; `None` outside.
    #[inline(always)]
    pub(super) fn of_px(&self, px: [f32; 2]) -> Option<usize> {
        let [x, y] = px;
        let inside =
            x >= 0.0 && y >= 0.0 && x < self.size.width as f32 && y < self.size.height as f32;
        if !inside {
            return None;
        }
        let (column, row) = (x as i32, y as i32);
        let first = self.of_pixel(column, row);
        if self.per_side == 1 {
            return Some(first);
        }
        let n = self.per_side as f32;
        let sub = |p: f32, whole: i32| {
            (((p - whole as f32) * n) as usize).min(self.per_side as usize - 1)
        };
        Some(first + self.plane * (sub(y, row) * self.per_side as usize + sub(x, column)))
    }

    /// Where a cell is in its sub-grid.
    #[inline(always)]
    pub(super) fn in_plane(&self, cell: usize) -> usize {
        if cell < self.plane { cell } else { cell % self.plane }
    }

    /// The cell `dx`, `dy` cells from the first cell of pixel (x, y).
    #[inline(always)]
    pub(super) fn neighbour(&self, x: i32, y: i32, dx: i32, dy: i32) -> usize {
        let n = self.per_side as i32;
        if n == 1 {
            return self.of_pixel(x + dx, y + dy);
        }
        let (cx, cy) = (x * n + dx, y * n + dy);
        let (x, y) = (cx.div_euclid(n), cy.div_euclid(n));
        let sub = (cy - y * n) * n + (cx - x * n);
        self.of_pixel(x, y) + self.plane * sub as usize
    }
}

/// A grid of cells.
pub(super) struct Store {
    pub(super) layout: Layout,
    pub(super) object: Vec<u32>,
    pub(super) record: Vec<Record>,
    pub(super) surfel: Vec<Surfel>,
    pub(super) lit: Vec<Lit>,
    pub(super) touched: Touched,
}

impl Store {
    pub(super) fn new(size: Size, per_side: u32) -> Store {
        let layout = Layout::new(size, per_side);
        Store {
            object: vec![EMPTY; layout.len()],
            record: vec![Record::default(); layout.len()],
            surfel: vec![Surfel::default(); layout.len()],
            lit: vec![Lit::default(); layout.len()],
            touched: Touched::new(size),
            layout,
        }
    }

    /// `i`: the cell of the sample's position.
    #[inline(always)]
    pub(super) fn set(&mut self, i: usize, sample: &Sample) {
        if self.object[i] != sample.object || !self.record[i].looks_like(&sample.record) {
            self.touched.mark_px(sample.record.px());
        }
        self.object[i] = sample.object;
        self.record[i] = sample.record;
        self.surfel[i] = sample.surfel;
        self.lit[i] = sample.lit;
    }

    /// Takes the sample in a cell away.
    pub(super) fn remove(&mut self, i: usize) {
        self.touched.mark_px(self.record[i].px());
        self.object[i] = EMPTY;
    }

    /// Where the sample in a cell is on its object.
    #[inline(always)]
    pub(super) fn surface(&self, i: usize) -> Surface {
        surface(self.object[i], &self.record[i], &self.surfel[i])
    }

    #[inline(always)]
    pub(super) fn tick(&self, i: usize) -> Tick {
        self.record[i].tick()
    }

    #[inline(always)]
    pub(super) fn depth(&self, i: usize) -> f32 {
        self.record[i].depth()
    }

    /// All samples for another display, from their `linear` colours.
    pub(super) fn encode_again(
        &mut self,
        display: &Display,
        linear: impl Fn(&Store, usize) -> [f32; 3],
    ) {
        self.touched.mark_all();
        for i in 0..self.layout.len() {
            if !self.is_empty(i) {
                let rgb = display.encode(linear(self, i));
                self.record[i].set_rgb(rgb);
            }
        }
    }

    /// Gives the sample in a cell another linear colour.
    pub(super) fn recolour(&mut self, i: usize, rgb: [f32; 3], display: &Display) {
        self.touched.mark_px(self.record[i].px());
        self.surfel[i].0[3..6].copy_from_slice(&rgb);
        self.record[i].set_rgb(display.encode(rgb));
    }

    #[inline(always)]
    pub(super) fn is_empty(&self, i: usize) -> bool {
        self.object[i] == EMPTY
    }

    /// Column `k` of the records in the eight cells from `first` on.
    #[inline(always)]
    pub(super) fn column<U: Unit>(&self, k: usize, first: usize) -> F8<U> {
        let mut lanes = [0.0; 8];
        for (lane, record) in lanes.iter_mut().zip(&self.record[first..first + 8]) {
            *lane = record.0[k];
        }
        F8::new(lanes)
    }

    /// The depths in the eight cells from `first` on.
    #[inline(always)]
    pub(super) fn depths<U: Unit>(&self, first: usize) -> F8<U> {
        self.column(2, first)
    }

    /// The ticks in the eight cells from `first` on.
    #[inline(always)]
    pub(super) fn ticks<U: Unit>(&self, first: usize) -> M8<U> {
        self.column::<U>(3, first).to_bits()
    }

    /// Begins to fetch what is known of a pixel's samples.
    #[inline(always)]
    pub(super) fn prefetch(&self, x: u32, y: u32) {
        for i in self.of_pixel(x, y) {
            wide::prefetch(&self.object, i);
            wide::prefetch(&self.record, i);
            wide::prefetch(&self.surfel, i);
            wide::prefetch(&self.lit, i);
        }
    }

    /// The cells of a pixel.
    #[inline(always)]
    pub(super) fn of_pixel(&self, x: u32, y: u32) -> impl Iterator<Item = usize> + use<> {
        let (first, plane) = (self.layout.of_pixel(x as i32, y as i32), self.layout.plane);
        (0..self.layout.subs()).map(move |sub| first + sub * plane)
    }

    /// The cell of the newest sample in a pixel.
    #[inline(always)]
    pub(super) fn newest(&self, x: u32, y: u32) -> Option<usize> {
        self.newest_of(self.layout.of_pixel(x as i32, y as i32))
    }

    /// The same of the pixel with the first cell `first`.
    #[inline(always)]
    pub(super) fn newest_of(&self, first: usize) -> Option<usize> {
        let cells = (0..self.layout.subs()).map(|sub| first + sub * self.layout.plane);
        cells.filter(|&i| !self.is_empty(i)).reduce(|newest, i| {
            if self.tick(i).is_later_than(self.tick(newest)) { i } else { newest }
        })
    }

    /// The cell of a sample at a pixel's centre.
    #[inline(always)]
    pub(super) fn central(&self, x: u32, y: u32) -> Option<usize> {
        let is_central = |&i: &usize| {
            let [px, py] = self.record[i].px();
            let (dx, dy) = (px - (x as f32 + 0.5), py - (y as f32 + 0.5));
            !self.is_empty(i) && dx * dx + dy * dy < CENTRAL_PX * CENTRAL_PX
        };
        self.of_pixel(x, y).find(is_central)
    }

    /// Puts a sample into its cell. `outdated`: the pixel's others show something that is no longer there. Very old ones go in any case:
    /// carried from pixel to pixel, never alone where a new one lands in its cell, they could stay for seconds.
    pub(super) fn insert(&mut self, sample: &Sample, outdated: bool) {
        let Some(i) = self.layout.of_px(sample.record.px()) else { return };
        let subs = self.layout.subs();
        if subs > 1 {
            let (first, plane) = (i % self.layout.plane, self.layout.plane);
            for cell in (0..subs).map(|sub| first + sub * plane) {
                let ticks = sample.record.tick().0.wrapping_sub(self.tick(cell).0);
                if outdated || ticks > VERY_OLD_TICKS {
                    self.remove(cell);
                }
            }
        }
        self.set(i, sample);
    }
}

/// Of the eight pixels from (x, y) on.
#[inline(always)]
pub(super) fn centres<U: Unit>(x: u32, y: u32) -> [F8<U>; 2] {
    let columns = M8::new([0, 1, 2, 3, 4, 5, 6, 7]).plus(M8::splat(x));
    [columns.to_f32() + F8::splat(0.5), F8::splat(y as f32 + 0.5)]
}

#[inline(always)]
pub(super) fn distance2<U: Unit>(px: [F8<U>; 2], centre: &[F8<U>; 2]) -> F8<U> {
    let (dx, dy) = (px[0] - centre[0], px[1] - centre[1]);
    dx * dx + dy * dy
}
