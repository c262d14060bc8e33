//! Where edges of shadows are, and move: pixels to be looked at just before the next refresh.
//!
//! A shadow does not move with the surface on which it lies, so that nothing carries it along. Two things say that it moves: its light
//! has, or a ray traced again has found other lights reaching the same point. The latter is true of what lies within a tile or two
//! of it, for a refresh or two.

use super::store::{CENTRAL_PX, EMPTY, Sample, Store};
use crate::Size;

/// Side of a tile, in pixels.
const TILE: u32 = 16;

/// What has been seen of moving shadows.
#[derive(Default)]
pub(super) struct Shadows {
    columns: u32,
    /// Per tile, bit i: light i, or i + 16, has begun or ceased to reach a point of it. Since the last refresh, and between the two before.
    seen: [Vec<u32>; 2],
    any: [bool; 2],
}

impl Shadows {
    /// Forgets everything.
    pub(super) fn fit(&mut self, size: Size) {
        self.columns = size.width.div_ceil(TILE);
        for seen in &mut self.seen {
            seen.clear();
            seen.resize((self.columns * size.height.div_ceil(TILE)) as usize, 0);
        }
        self.any = [false; 2];
    }

    /// A new sample is about to take the cell of one of the same object, which rests.
    #[inline(always)]
    pub(super) fn note(&mut self, store: &Store, cell: usize, sample: &Sample) {
        let changed = store.record[cell].lit() ^ sample.record.lit();
        let [[x0, y0], [x1, y1]] = [store.record[cell].offset(), sample.record.offset()];
        let [dx, dy] = [x0 - x1, y0 - y1];
        if changed != 0 && dx * dx + dy * dy < CENTRAL_PX * CENTRAL_PX {
            let [x, y] = sample.px.map(|p| p as u32 / TILE);
            self.seen[0][(y * self.columns + x) as usize] |= changed;
            self.any[0] = true;
        }
    }

    /// At a refresh: pixels at the edges of shadows of the lights that have `moved` (bits), and of all that were seen to move.
    pub(super) fn find_edges(&mut self, store: &Store, moved: u32, edges: &mut Vec<u32>) {
        edges.clear();
        let moved = (moved | moved >> 16) & 0xffff;
        if moved != 0 || self.any != [false; 2] {
            let Size { width, height } = store.layout.size;
            for y0 in (0..height).step_by(TILE as usize) {
                for x0 in (0..width).step_by(TILE as usize) {
                    let lights = moved | self.around(x0 / TILE, y0 / TILE, height.div_ceil(TILE));
                    if lights != 0 {
                        find_in_tile(store, [x0, y0], lights, edges);
                    }
                }
            }
        }
        self.seen.swap(0, 1);
        self.seen[0].fill(0);
        self.any = [false, self.any[0]];
    }

    /// Lights whose shadows were seen to move in a tile and the eight around it.
    fn around(&self, column: u32, row: u32, rows: u32) -> u32 {
        let near = |at: u32, end: u32| at.saturating_sub(1)..(at + 2).min(end);
        let tiles = near(row, rows)
            .flat_map(|y| near(column, self.columns).map(move |x| (y * self.columns + x) as usize));
        tiles.fold(0, |lights, tile| lights | self.seen[0][tile] | self.seen[1][tile])
    }
}

/// Pixels whose sample `lights` reach otherwise than one beside it on the same object.
fn find_in_tile(store: &Store, [x0, y0]: [u32; 2], lights: u32, edges: &mut Vec<u32>) {
    let (layout, Size { width, height }) = (store.layout, store.layout.size);
    let differ = |a: usize, b: usize| {
        store.object[a] == store.object[b]
            && (store.record[a].lit() ^ store.record[b].lit()) & lights != 0
    };
    for y in y0..(y0 + TILE).min(height) {
        for x in x0..(x0 + TILE).min(width) {
            let is_edge = store.of_pixel(x, y).any(|cell| {
                let around = [cell - 1, cell + 1, cell - layout.stride, cell + layout.stride];
                store.object[cell] < EMPTY && around.iter().any(|&other| differ(cell, other))
            });
            if is_edge {
                edges.push(layout.size.index(x, y));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::store::{Record, Tick, from_centre};
    use super::*;

    const SIZE: Size = Size { width: 96, height: 32 };

    fn sample_at([x, y]: [f32; 2], lit: u32) -> Sample {
        let record = Record::new(from_centre([x, y]), 1.0, Tick(1), [0.5; 3], lit);
        Sample { record, ..Sample::at([x, y], 1.0, 1) }
    }

    fn sample(x: u32, y: u32, lit: u32) -> Sample {
        sample_at([x as f32 + 0.5, y as f32 + 0.5], lit)
    }

    /// A floor under two lights: what the first reaches ends between columns 3 and 4, and the second's between 87 and 88. `others`: bits
    /// of lights that there are not.
    fn floor(others: u32) -> Store {
        let mut store = Store::new(SIZE, 1, false);
        for (y, x) in (0..SIZE.height).flat_map(|y| (0..SIZE.width).map(move |x| (y, x))) {
            store.insert(&sample(x, y, others | u32::from(x < 4) | u32::from(x < 88) << 1), false);
        }
        store
    }

    fn columns(shadows: &mut Shadows, store: &Store, moved: u32) -> Vec<u32> {
        let mut edges = Vec::new();
        shadows.find_edges(store, moved, &mut edges);
        let mut columns: Vec<u32> = edges.iter().map(|&pixel| SIZE.xy(pixel).0).collect();
        columns.sort_unstable();
        columns.dedup();
        columns
    }

    #[test]
    fn edges_of_the_shadows_of_lights_that_move_are_found_everywhere() {
        for others in [0, !0b11] {
            let (store, mut shadows) = (floor(others), Shadows::default());
            shadows.fit(SIZE);
            assert_eq!(columns(&mut shadows, &store, 0), []);
            assert_eq!(columns(&mut shadows, &store, 0b01), [3, 4]);
            assert_eq!(columns(&mut shadows, &store, 0b11), [3, 4, 87, 88]);
        }
    }

    #[test]
    fn a_ray_that_finds_another_light_tells_of_the_edges_around_for_two_refreshes() {
        let (store, mut shadows) = (floor(0), Shadows::default());
        shadows.fit(SIZE);
        let cell = store.layout.of_pixel(5, 5);
        let note = |shadows: &mut Shadows, x: f32, lit| {
            shadows.note(&store, cell, &sample_at([x, 5.5], lit));
        };
        note(&mut shadows, 5.5, 0b10);
        note(&mut shadows, 5.25, 0b11);
        assert_eq!(columns(&mut shadows, &store, 0), [], "as before, and another ray");
        note(&mut shadows, 5.5, 0b11);
        assert_eq!(columns(&mut shadows, &store, 0), [3, 4]);
        assert_eq!(columns(&mut shadows, &store, 0), [3, 4]);
        assert_eq!(columns(&mut shadows, &store, 0), [], "nothing since");
    }
}
