//! The samples kept: at most one in every cell of the picture.
//!
//! Stored plane by plane, so that eight pixels at a time can be worked on. With n×n cells per pixel there are n² sub-grids, each with
//! one cell of every pixel, one after the other; every sub-grid has a border of one empty cell, so that loops over neighbours
//! need no bounds.
//!
//! What shading a sample again takes is needed only now and then, and lies in a slot. When the sample moves to another cell its slot
//! stays where it is. Every cell has one, also while it is empty.

use super::packed::{PackedAlbedo, PackedNormal};
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

/// A point on an object, as in [`Surface`]: its position, and the bits of the primitive's number.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Anchor(pub(super) [f32; 4]);

impl Anchor {
    fn new(surface: &Surface) -> Anchor {
        let [x, y, z] = surface.position;
        Anchor([x, y, z, f32::from_bits(surface.primitive)])
    }

    /// The point on `object`, and no more.
    pub(super) fn on(&self, object: u32) -> Surface {
        let [x, y, z, primitive] = self.0;
        let (position, primitive) = ([x, y, z], primitive.to_bits());
        Surface { object, primitive, position, ..Surface::default() }
    }
}

/// What shading a sample again takes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Shade {
    /// Linear RGB as traced.
    pub(super) rgb: [f32; 3],
    /// As in [`Surface`].
    pub(super) direct: [f32; 3],
    pub(super) normal: PackedNormal,
    pub(super) albedo: PackedAlbedo,
    pub(super) lit: u32,
}

/// One sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Display-referred sRGB.
    pub(super) rgb: [f32; 3],
    /// Where in the picture, in pixels.
    pub(super) px: [f32; 2],
    pub(super) depth: f32,
    pub(super) tick: Tick,
    pub(super) object: u32,
    pub(super) anchor: Anchor,
    pub(super) shade: Shade,
}

/// Half a second.
const VERY_OLD_TICKS: u32 = 500_000_000 >> TICK_BITS;

impl Shade {
    // Inlined: what is written to memory in small parts and read in large ones at once has to wait for all that was written before.
    #[inline(always)]
    fn new(surface: Option<&Surface>, rgb: [f32; 3]) -> Shade {
        let Some(surface) = surface else { return Shade { rgb, ..Shade::default() } };
        Shade {
            rgb,
            direct: surface.direct,
            normal: PackedNormal::new(surface.normal),
            albedo: PackedAlbedo::new(surface.albedo),
            lit: surface.lit,
        }
    }
}

impl Sample {
    #[inline(always)]
    pub(super) fn new(kept: &Kept<'_>, i: usize, display: &Display) -> Sample {
        let (object, anchor) = match kept.surfaces.get(i) {
            Some(surface) => (surface.object, Anchor::new(surface)),
            None => (SCREEN, Anchor::default()),
        };
        Sample {
            rgb: display.encode(kept.new[i]),
            px: kept.requests[i].position_px(kept.size),
            depth: f32::INFINITY,
            tick: Tick::of(kept.now),
            object,
            anchor,
            shade: Shade::new(kept.surfaces.get(i), kept.new[i]),
        }
    }

    pub(super) fn surface(&self) -> Surface {
        self.anchor.on(self.object)
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

/// A grid of cells, plane by plane.
pub(super) struct Store {
    pub(super) layout: Layout,
    pub(super) rgb: [Vec<f32>; 3],
    pub(super) px: [Vec<f32>; 2],
    pub(super) depth: Vec<f32>,
    pub(super) tick: Vec<u32>,
    pub(super) object: Vec<u32>,
    pub(super) anchor: Vec<Anchor>,
    pub(super) slot: Vec<u32>,
    /// Per slot.
    pub(super) shade: Vec<Shade>,
    /// Slots that no cell has.
    pub(super) spare: Vec<u32>,
}

impl Store {
    pub(super) fn new(size: Size, per_side: u32) -> Store {
        let layout = Layout::new(size, per_side);
        let plane = || vec![0.0; layout.len()];
        Store {
            rgb: std::array::from_fn(|_| plane()),
            px: std::array::from_fn(|_| plane()),
            depth: plane(),
            tick: vec![0; layout.len()],
            object: vec![EMPTY; layout.len()],
            anchor: vec![Anchor::default(); layout.len()],
            slot: (0..layout.len() as u32).collect(),
            shade: vec![Shade::default(); layout.len()],
            spare: Vec::new(),
            layout,
        }
    }

    pub(super) fn set(&mut self, i: usize, sample: &Sample) {
        (0..3).for_each(|k| self.rgb[k][i] = sample.rgb[k]);
        [self.px[0][i], self.px[1][i]] = sample.px;
        self.depth[i] = sample.depth;
        self.tick[i] = sample.tick.0;
        self.object[i] = sample.object;
        self.anchor[i] = sample.anchor;
        self.shade[self.slot[i] as usize] = sample.shade;
    }

    /// Where the sample in a cell is on its object.
    #[inline(always)]
    pub(super) fn surface(&self, i: usize) -> Surface {
        self.anchor[i].on(self.object[i])
    }

    #[inline(always)]
    pub(super) fn shade(&self, i: usize) -> &Shade {
        &self.shade[self.slot[i] as usize]
    }

    /// All samples for another display, from their `linear` colours.
    pub(super) fn encode_again(
        &mut self,
        display: &Display,
        linear: impl Fn(&Store, usize) -> [f32; 3],
    ) {
        for i in 0..self.layout.len() {
            if self.is_empty(i) {
                continue;
            }
            let rgb = display.encode(linear(self, i));
            (0..3).for_each(|k| self.rgb[k][i] = rgb[k]);
        }
    }

    /// Gives the sample in a cell another linear colour.
    pub(super) fn recolour(&mut self, i: usize, rgb: [f32; 3], display: &Display) {
        self.shade[self.slot[i] as usize].rgb = rgb;
        let encoded = display.encode(rgb);
        (0..3).for_each(|k| self.rgb[k][i] = encoded[k]);
    }

    #[inline(always)]
    pub(super) fn is_empty(&self, i: usize) -> bool {
        self.object[i] == EMPTY
    }

    /// Begins to fetch what is known of a pixel's samples.
    #[inline(always)]
    pub(super) fn prefetch(&self, x: u32, y: u32) {
        for i in self.of_pixel(x, y) {
            self.rgb.iter().chain(&self.px).for_each(|plane| wide::prefetch(plane, i));
            wide::prefetch(&self.depth, i);
            [&self.tick, &self.object, &self.slot]
                .into_iter()
                .for_each(|plane| wide::prefetch(plane, i));
            wide::prefetch(&self.anchor, i);
        }
    }

    /// The same of what their shading takes, once the former is there.
    #[inline(always)]
    pub(super) fn prefetch_shade(&self, x: u32, y: u32) {
        for i in self.of_pixel(x, y) {
            wide::prefetch(&self.shade, self.slot[i] as usize);
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
            if Tick(self.tick[i]).is_later_than(Tick(self.tick[newest])) { i } else { newest }
        })
    }

    /// Of the cell `first` of pixel (x, y) and the seven to its right: whether there are samples at the pixels' centres.
    #[inline(always)]
    pub(super) fn are_central<U: Unit>(&self, first: usize, x: u32, y: u32) -> M8<U> {
        let is_sample = M8::load(&self.object, first).equals(M8::splat(EMPTY)).not();
        let px = [F8::load(&self.px[0], first), F8::load(&self.px[1], first)];
        let near = F8::splat(CENTRAL_PX * CENTRAL_PX);
        is_sample.and(distance2(px, &centres(x, y)).less_than(near))
    }

    /// The cell of a sample at a pixel's centre.
    #[inline(always)]
    pub(super) fn central(&self, x: u32, y: u32) -> Option<usize> {
        let is_central = |&i: &usize| {
            let (dx, dy) = (self.px[0][i] - (x as f32 + 0.5), self.px[1][i] - (y as f32 + 0.5));
            !self.is_empty(i) && dx * dx + dy * dy < CENTRAL_PX * CENTRAL_PX
        };
        self.of_pixel(x, y).find(is_central)
    }

    /// A slot that no cell has.
    pub(super) fn new_slot(&mut self) -> u32 {
        self.spare.pop().unwrap_or_else(|| {
            self.shade.push(Shade::default());
            self.shade.len() as u32 - 1
        })
    }

    /// Puts a sample into its cell. `outdated`: the pixel's others show something that is no longer there. Very old ones go in any case:
    /// carried from pixel to pixel, never alone where a new one lands in its cell, they could stay for seconds.
    pub(super) fn insert(&mut self, sample: &Sample, outdated: bool) {
        let Some(i) = self.layout.of_px(sample.px) else { return };
        let subs = self.layout.subs();
        if subs > 1 {
            let first = i % self.layout.plane;
            for cell in (0..subs).map(|sub| first + sub * self.layout.plane) {
                if outdated || sample.tick.0.wrapping_sub(self.tick[cell]) > VERY_OLD_TICKS {
                    self.object[cell] = EMPTY;
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
