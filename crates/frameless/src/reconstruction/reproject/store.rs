//! The samples kept: at most one in every cell of the picture, in 44 bytes.
//!
//! What the picture needs of a sample is one record, and what its surface is another: samples are kept, and put down where their surfaces
//! have moved, one by one and all over the picture, and every place in memory that has to be looked at is one to wait for. Loops over
//! eight pixels at a time turn records into columns. Only objects' numbers lie by themselves, and what few pictures need: what samples are
//! shaded again with, and of which primitive of a mesh that deforms they are.
//!
//! With n×n cells per pixel there are n² sub-grids, each with one cell of every pixel, one after the other; every sub-grid has a border
//! of one empty cell, so that loops over neighbours need no bounds.

use super::packed::{PackedAlbedo, PackedLinear, PackedNormal};
use super::touched::Touched;
use crate::pages::filled;
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

/// What the picture needs of a sample, word by word: its depth and its lights, where it is in its pixel, its tick, red, green, blue.
///
/// ```text
/// depth     16 bits    f32 without its sign and its last 15 bits: 0.2 % off
/// lights    16 bits    bit i: light i reaches it, the other way round where light i + 16 does: only differences count
/// column    16 bits    from the pixel's centre, upper half of an f32: 0.2 % off, so that of what lies next to a centre it is known on which
/// row       16 bits    side; a sample may have stepped aside to the cell next to its own
/// tick, red, green, blue of 32 bits each
/// ```
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(8))]
pub(super) struct Record(pub(super) [f32; 6]);

/// Where on its object, as in [`Surface`], and the bits of its packed linear colour.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(16))]
pub(super) struct Surfel(pub(super) [f32; 4]);

/// What it is shaded again with: linear red, green and blue without the direct light, the bits of the packed normal and albedo and of the
/// lights that reach it.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(8))]
pub(super) struct Shading(pub(super) [f32; 6]);

/// Bits of f32 that depths do not keep.
const DEPTH_BITS: u32 = 15;
/// The upper half of a word.
const UPPER: u32 = 0xffff << 16;
/// What makes an f32 cut to its upper half a rounded one.
const HALF: u32 = 1 << 15;

/// From the centre of its pixel to a position in the picture, in pixels.
#[inline(always)]
pub(super) fn from_centre(px: [f32; 2]) -> [f32; 2] {
    let [x, y] = px;
    [x - x as i32 as f32 - 0.5, y - y as i32 as f32 - 0.5]
}

impl Record {
    /// `offset`: from the pixel's centre, in pixels.
    #[inline(always)]
    pub(super) fn new(
        offset: [f32; 2],
        depth: f32,
        tick: Tick,
        [r, g, b]: [f32; 3],
        lit: u32,
    ) -> Record {
        let lit = (lit ^ lit >> 16) & 0xffff;
        let mut record = Record([f32::from_bits(lit), 0.0, f32::from_bits(tick.0), r, g, b]);
        record.set_offset(offset);
        record.set_depth(depth);
        record
    }

    /// From the centre of the pixel that it is kept in, in pixels.
    #[inline(always)]
    pub(super) fn offset(&self) -> [f32; 2] {
        let bits = self.0[1].to_bits();
        [bits << 16, bits & UPPER].map(f32::from_bits)
    }

    #[inline(always)]
    pub(super) fn set_offset(&mut self, offset: [f32; 2]) {
        let [x, y] = offset.map(|offset| offset.to_bits() + HALF);
        self.0[1] = f32::from_bits(x >> 16 | y & UPPER);
    }

    #[inline(always)]
    pub(super) fn depth(&self) -> f32 {
        f32::from_bits(self.0[0].to_bits() >> 16 << DEPTH_BITS)
    }

    #[inline(always)]
    pub(super) fn set_depth(&mut self, depth: f32) {
        let bits = self.0[0].to_bits() & 0xffff | depth_bits(depth) << 16;
        self.0[0] = f32::from_bits(bits);
    }

    /// Two of these differ in bit i if light i, or light i + 16, reaches one of them and not the other.
    #[inline(always)]
    pub(super) fn lit(&self) -> u32 {
        self.0[0].to_bits() & 0xffff
    }

    #[inline(always)]
    pub(super) fn tick(&self) -> Tick {
        Tick(self.0[2].to_bits())
    }

    /// Display-referred sRGB.
    #[inline(always)]
    pub(super) fn rgb(&self) -> [f32; 3] {
        [self.0[3], self.0[4], self.0[5]]
    }

    #[inline(always)]
    pub(super) fn set_rgb(&mut self, [r, g, b]: [f32; 3]) {
        (self.0[3], self.0[4], self.0[5]) = (r, g, b);
    }

    /// Whether both are at the same place in the picture and of the same colour.
    #[inline(always)]
    fn looks_like(&self, other: &Record) -> bool {
        self.0[1].to_bits() == other.0[1].to_bits() && self.rgb() == other.rgb()
    }

    /// With the two words of [`words`].
    #[inline(always)]
    pub(super) fn moved(&self, depth: u32, offset: u32) -> Record {
        let [first, _, rest @ ..] = self.0;
        let first = f32::from_bits(first.to_bits() & 0xffff | depth);
        let [tick, r, g, b] = rest;
        Record([first, f32::from_bits(offset), tick, r, g, b])
    }
}

/// Rounded.
#[inline(always)]
fn depth_bits(depth: f32) -> u32 {
    (depth.to_bits() + (1 << (DEPTH_BITS - 1))) >> DEPTH_BITS & 0xffff
}

/// Where eight samples are: [`Record::set_depth`] and [`Record::set_offset`], eight at a time. Bits of the depths in the upper halves, and of
/// columns and rows.
#[inline(always)]
pub(super) fn words<U: Unit>(px: [F8<U>; 2], depth: F8<U>) -> [M8<U>; 2] {
    let [mut x, mut y] = [M8::splat(0); 2];
    for (rounded, px) in [&mut x, &mut y].into_iter().zip(px) {
        let from_centre = px - px.truncated().to_f32() - F8::splat(0.5);
        *rounded = from_centre.to_bits().plus(M8::splat(HALF));
    }
    let lower = x.shifted_right::<16>().and(M8::splat(!UPPER));
    let offset = lower.either(y.and(M8::splat(UPPER)));
    let rounded = depth.to_bits().plus(M8::splat(1 << (DEPTH_BITS - 1)));
    [rounded.plus(rounded).and(M8::splat(UPPER)), offset]
}

/// [`Record::depth`], eight at a time.
#[inline(always)]
pub(super) fn depths<U: Unit>(word: F8<U>) -> F8<U> {
    let upper = word.to_bits().and(M8::splat(UPPER));
    // Not below zero: the upper bit of a depth is that of its exponent.
    upper.shifted_right::<1>().and(M8::splat(i32::MAX as u32)).as_f32()
}

/// [`Record::offset`], eight at a time.
#[inline(always)]
pub(super) fn offsets<U: Unit>(word: F8<U>) -> [F8<U>; 2] {
    let bits = word.to_bits();
    [bits.shifted_left::<16>().as_f32(), bits.and(M8::splat(UPPER)).as_f32()]
}

impl Surfel {
    // Inlined: what is written to memory in small parts and read in large ones at once has to wait for all that was written before.
    #[inline(always)]
    pub(super) fn new([x, y, z]: [f32; 3], linear: [f32; 3]) -> Surfel {
        Surfel([x, y, z, f32::from_bits(PackedLinear::new(linear).0)])
    }

    #[inline(always)]
    pub(super) fn position(&self) -> [f32; 3] {
        [self.0[0], self.0[1], self.0[2]]
    }

    /// Linear RGB as traced, about.
    #[inline(always)]
    pub(super) fn linear(&self) -> [f32; 3] {
        PackedLinear(self.0[3].to_bits()).unpack()
    }
}

impl Shading {
    #[inline(always)]
    pub(super) fn new(surface: &Surface, linear: [f32; 3]) -> Shading {
        let [r, g, b] = std::array::from_fn(|k| linear[k] - surface.direct[k]);
        let normal = PackedNormal::new(surface.normal).0;
        let albedo = PackedAlbedo::new(surface.albedo).0;
        let [normal, albedo, lit] = [normal, albedo, surface.lit].map(f32::from_bits);
        Shading([r, g, b, normal, albedo, lit])
    }

    /// Linear RGB without the direct light.
    pub(super) fn indirect(&self) -> [f32; 3] {
        [self.0[0], self.0[1], self.0[2]]
    }

    pub(super) fn set_indirect(&mut self, [r, g, b]: [f32; 3]) {
        (self.0[0], self.0[1], self.0[2]) = (r, g, b);
    }

    pub(super) fn normal(&self) -> PackedNormal {
        PackedNormal(self.0[3].to_bits())
    }

    pub(super) fn albedo(&self) -> PackedAlbedo {
        PackedAlbedo(self.0[4].to_bits())
    }

    pub(super) fn lit(&self) -> u32 {
        self.0[5].to_bits()
    }
}

/// The numbers of eight records.
#[inline(always)]
pub(super) fn rows_of([a, b, c, d, e, f, g, h]: &[Record; 8]) -> [&[f32; 6]; 8] {
    [&a.0, &b.0, &c.0, &d.0, &e.0, &f.0, &g.0, &h.0]
}

/// Where a sample is on its object, and no more.
#[inline(always)]
pub(super) fn surface(object: u32, primitive: u32, surfel: &Surfel) -> Surface {
    Surface { object, primitive, position: surfel.position(), ..Surface::default() }
}

/// One sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) object: u32,
    pub(super) primitive: u32,
    /// Where in the picture, in pixels.
    pub(super) px: [f32; 2],
    pub(super) record: Record,
    pub(super) surfel: Surfel,
    pub(super) shading: Shading,
}

/// Half a second.
const VERY_OLD_TICKS: u32 = 500_000_000 >> TICK_BITS;

/// The primitive where that is not known: no mesh has as many.
const UNKNOWN: u32 = u32::MAX;

impl Sample {
    /// At an unknown depth. `is_shaded`: whether it is to be shaded again.
    #[inline(always)]
    pub(super) fn new(kept: &Kept<'_>, i: usize, display: &Display, is_shaded: bool) -> Sample {
        let (surface, linear) = (kept.surfaces.get(i), kept.new[i]);
        let (object, primitive) = surface.map_or((SCREEN, 0), |s| (s.object, s.primitive));
        let (position, lit) = surface.map_or(([0.0; 3], 0), |s| (s.position, s.lit));
        let px = kept.requests[i].position_px(kept.size);
        let (tick, rgb) = (Tick::of(kept.now), display.encode(linear));
        let record = Record::new(from_centre(px), f32::INFINITY, tick, rgb, lit);
        let shading = surface.filter(|_| is_shaded).map(|surface| Shading::new(surface, linear));
        let (surfel, shading) = (Surfel::new(position, linear), shading.unwrap_or_default());
        Sample { object, primitive, px, record, surfel, shading }
    }

    /// A grey one of object 0.
    #[cfg(test)]
    pub(super) fn at(px: [f32; 2], depth: f32, tick: u32) -> Sample {
        let record = Record::new(from_centre(px), depth, Tick(tick), [0.5; 3], 0);
        let (surfel, shading) = (Surfel::default(), Shading::default());
        Sample { object: 0, primitive: 0, px, record, surfel, shading }
    }

    /// Where it is on its object, and no more.
    #[inline(always)]
    pub(super) fn surface(&self) -> Surface {
        surface(self.object, self.primitive, &self.surfel)
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

    /// Column and row of the pixel of a cell that is not in the border.
    #[inline(always)]
    pub(super) fn pixel_of(&self, cell: usize) -> (u32, u32) {
        let (in_plane, stride) = (self.in_plane(cell) as u32, self.stride as u32);
        (in_plane % stride - 1, in_plane / stride - 1)
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
    /// Empty where nothing is shaded again.
    pub(super) shading: Vec<Shading>,
    /// Of which primitives of their objects samples are; empty where no object deforms.
    pub(super) primitive: Vec<u32>,
    pub(super) touched: Touched,
}

impl Store {
    /// Empty. `is_shaded`: whether samples are to be shaded again.
    pub(super) fn new(size: Size, per_side: u32, is_shaded: bool) -> Store {
        let layout = Layout::new(size, per_side);
        Store {
            object: filled(EMPTY, layout.len()),
            record: filled(Record::default(), layout.len()),
            surfel: filled(Surfel::default(), layout.len()),
            shading: filled(Shading::default(), if is_shaded { layout.len() } else { 0 }),
            primitive: vec![UNKNOWN; layout.len()],
            touched: Touched::new(size),
            layout,
        }
    }

    /// Whether any object deforms: else nobody needs to know primitives.
    pub(super) fn keep_primitives(&mut self, are_needed: bool) {
        if !are_needed {
            self.primitive = Vec::new();
        } else if self.primitive.is_empty() {
            self.primitive = vec![UNKNOWN; self.layout.len()];
        }
    }

    /// `i`: the cell of the sample's position.
    #[inline(always)]
    pub(super) fn set(&mut self, i: usize, sample: &Sample) {
        if self.object[i] != sample.object || !self.record[i].looks_like(&sample.record) {
            self.touched.mark_px(sample.px);
        }
        self.object[i] = sample.object;
        self.record[i] = sample.record;
        self.surfel[i] = sample.surfel;
        if let Some(shading) = self.shading.get_mut(i) {
            *shading = sample.shading;
        }
        if let Some(primitive) = self.primitive.get_mut(i) {
            *primitive = sample.primitive;
        }
    }

    /// Takes the sample in a cell away. (Of those that have been carried elsewhere the record stays, until another takes their cell: where a
    /// ray has gone since the last refresh tells of what is there.)
    pub(super) fn remove(&mut self, i: usize) {
        self.touch(i);
        self.object[i] = EMPTY;
        self.record[i] = Record::default();
    }

    /// Something has changed in a cell.
    pub(super) fn touch(&self, i: usize) {
        let (x, y) = self.layout.pixel_of(i);
        self.touched.mark(x, y);
    }

    /// Where the sample in a cell is on its object.
    #[inline(always)]
    pub(super) fn surface(&self, i: usize) -> Surface {
        let primitive = self.primitive.get(i).copied().unwrap_or(UNKNOWN);
        surface(self.object[i], primitive, &self.surfel[i])
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

    #[inline(always)]
    pub(super) fn is_empty(&self, i: usize) -> bool {
        self.object[i] == EMPTY
    }

    /// Column `k` of the records in the eight cells from `first` on.
    #[inline(always)]
    fn column<U: Unit>(&self, k: usize, first: usize) -> F8<U> {
        let mut lanes = [0.0; 8];
        for (lane, record) in lanes.iter_mut().zip(&self.record[first..first + 8]) {
            *lane = record.0[k];
        }
        F8::new(lanes)
    }

    /// The depths in the eight cells from `first` on.
    #[inline(always)]
    pub(super) fn depths<U: Unit>(&self, first: usize) -> F8<U> {
        depths(self.column(0, first))
    }

    /// The ticks in the eight cells from `first` on.
    #[inline(always)]
    pub(super) fn ticks<U: Unit>(&self, first: usize) -> M8<U> {
        self.column::<U>(2, first).to_bits()
    }

    /// Begins to fetch what is known of a pixel's samples.
    #[inline(always)]
    pub(super) fn prefetch(&self, x: u32, y: u32) {
        for i in self.of_pixel(x, y) {
            wide::prefetch(&self.object, i);
            // Records lie across the borders of lines.
            wide::prefetch(&self.record, i);
            wide::prefetch(&self.record, i + 1);
            wide::prefetch(&self.surfel, i);
            if !self.shading.is_empty() {
                wide::prefetch(&self.shading, i);
            }
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
            let [dx, dy] = self.record[i].offset();
            !self.is_empty(i) && dx * dx + dy * dy < CENTRAL_PX * CENTRAL_PX
        };
        self.of_pixel(x, y).find(is_central)
    }

    /// Puts a sample into its cell. `outdated`: the pixel's others show something that is no longer there. Very old ones go in any case:
    /// carried from pixel to pixel, never alone where a new one lands in its cell, they could stay for seconds.
    pub(super) fn insert(&mut self, sample: &Sample, outdated: bool) {
        let Some(i) = self.layout.of_px(sample.px) else { return };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wide::Task;

    #[test]
    fn records_tell_what_they_were_told() {
        let mut rng = crate::Rng::new(1);
        for round in 0..10_000u32 {
            let mut any = |scale: f32| scale * (rng.unit_f32() - 0.5);
            let (offset, rgb) = ([any(3.9), any(3.9)], [any(1.0), any(1.0), any(1.0)]);
            let depth = 2f32.powf(any(60.0));
            let record = Record::new(offset, depth, Tick(round << 12), rgb, round << 8);
            assert_eq!((record.tick(), record.rgb()), (Tick(round << 12), rgb));
            assert_eq!(record.lit(), (round << 8 ^ round >> 8) & 0xffff);
            assert!((record.depth() / depth - 1.0).abs() <= 1.0 / 512.0);
            let off = [0, 1].map(|k| (record.offset()[k] / offset[k] - 1.0).abs());
            assert!(off.iter().all(|&off| off <= 1.0 / 256.0), "{offset:?} {off:?}");
        }
        let record = Record::new([0.0; 2], f32::INFINITY, Tick(0), [0.0; 3], 0);
        assert_eq!((record.offset(), record.depth()), ([0.0; 2], f32::INFINITY));
    }

    struct Compare;

    impl Task for Compare {
        #[inline(always)]
        fn run<U: Unit>(self) {
            let mut rng = crate::Rng::new(1);
            for _ in 0..1000 {
                let mut any = |scale: f32| -> [f32; 8] { [(); 8].map(|()| scale * rng.unit_f32()) };
                let (x, y, depth) = (any(700.0), any(20.0), any(90.0));
                let [depths, places] = words::<U>([F8::new(x), F8::new(y)], F8::new(depth));
                let [columns, rows] = offsets::<U>(places.as_f32());
                for lane in 0..8 {
                    let offset = from_centre([x[lane], y[lane]]);
                    let one = Record::new(offset, depth[lane], Tick(7), [0.1; 3], 5);
                    let moved = Record::new([0.2; 2], 3.0, Tick(7), [0.1; 3], 5);
                    let moved = moved.moved(depths.lanes()[lane], places.lanes()[lane]);
                    assert_eq!(moved.0.map(f32::to_bits), one.0.map(f32::to_bits));
                    assert_eq!([columns.lanes()[lane], rows.lanes()[lane]], one.offset());
                }
            }
        }
    }

    #[test]
    fn eight_at_a_time_are_what_they_are_one_by_one() {
        crate::wide::run(Compare);
    }

    #[test]
    fn a_cell_knows_its_pixel() {
        for per_side in [1, 2] {
            let layout = Layout::new(Size::new(13, 9), per_side);
            for (x, y) in [(0, 0), (12, 8), (5, 3)] {
                for sub in 0..layout.subs() {
                    let cell = layout.of_pixel(x, y) + sub * layout.plane;
                    assert_eq!(layout.pixel_of(cell), (x as u32, y as u32));
                }
            }
        }
    }
}
