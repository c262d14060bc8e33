//! What large holes show: of the blocks of pixels around them, the finest that know enough, and the smoother the less is known.
//!
//! ```text
//! pull   c = Σ w_i c_i / Σ w_i,  w = min(1, k · mean of w_i)      over 2×2 blocks, from pixels up to the whole picture
//! push   c ← w c + (1 − w) c'                                    c' interpolated between the next coarser blocks
//! ```
//!
//! w is 1 for a pixel that has samples or lies beside some, 0 for one in a large hole (Gortler et al. 1996, "The lumigraph"). Of a
//! texture of variance σ² a neighbour's colour is off by 2σ² on average, a mean of many by σ²; and an edge that lies
//! anywhere between two samples costs a third less under a ramp than under a step in the middle. k says how soon a block is thought to
//! know enough. What the whole picture does not know is the `prior`.
//!
//! Blocks smaller than tiles of 8×8 pixels are looked at in and beside tiles with holes only; other tiles count with the pixels on
//! their diagonal.

use std::ops::Range;

use crate::Size;
use crate::spare::give_back;
use crate::tile::TileGrid;

/// A colour and its weight.
type Block = [f32; 4];

/// Side of a tile, as a power of two.
const TILE_BITS: usize = 3;

/// k up to tiles, where a block with a single sample knows enough, and beyond them, where even a whole one leaves half to what is
/// around: what little survives a cut is not taken for the rest of the picture. With less, holes are smoother and show more of what is far
/// away, and at last of the prior.
const ENOUGH: [f32; 2] = [4.0, 0.5];

/// k for blocks of 2^`bits` pixels.
fn enough(bits: usize) -> f32 {
    ENOUGH[usize::from(bits > TILE_BITS)]
}

/// Blocks of 2^l × 2^l pixels.
#[derive(Default)]
struct Level {
    columns: usize,
    rows: usize,
    /// Row by row: of the whole picture, or of those tiles that have any, one after the other.
    blocks: Vec<Block>,
    /// Of blocks smaller than tiles: how many there are in a row of a tile, as a power of two; 0: they are of the whole picture.
    side_bits: usize,
    /// Tiles in a row, and per tile where its blocks begin.
    tile_columns: usize,
    first: Vec<u32>,
}

/// Pixels of large holes, a bit for every pixel of a tile, row by row.
#[derive(Clone, Copy)]
pub(super) struct Far<'a> {
    pub(super) grid: &'a TileGrid,
    pub(super) tiles: &'a [u64],
}

/// Fills large holes.
#[derive(Default)]
pub(super) struct Smooth {
    /// From blocks of 2×2 pixels on, up to a single block.
    levels: Vec<Level>,
    /// Per tile: whether it or one beside it has holes.
    near: Vec<bool>,
}

impl Smooth {
    pub(super) fn run(&mut self, far: Far<'_>, prior: [f32; 3], picture: &mut [[f32; 3]]) {
        self.fit(far.grid.size);
        self.find_near(far);
        self.make_room();
        self.pull_tiles(far, picture);
        for l in TILE_BITS..self.levels.len() {
            let (finer, coarser) = self.levels.split_at_mut(l);
            let (finer, coarser) = (&finer[l - 1], &mut coarser[0]);
            coarser.pull(enough(l + 1), finer, 0..coarser.columns, 0..coarser.rows);
        }
        let top = self.levels.last_mut().expect("a tile at least");
        top.blocks.iter_mut().for_each(|block| *block = mixed(*block, prior));
        self.push(far);
        for tile in far.holed() {
            self.levels[0].fill(far, tile, picture);
        }
    }

    fn fit(&mut self, size: Size) {
        let longer = size.width.max(size.height).next_power_of_two();
        self.levels.resize_with(TILE_BITS.max(longer.trailing_zeros() as usize), Level::default);
        for (level, bits) in self.levels.iter_mut().zip(1..) {
            level.columns = (size.width as usize).div_ceil(1 << bits);
            level.rows = (size.height as usize).div_ceil(1 << bits);
            level.side_bits = TILE_BITS.saturating_sub(bits);
            level.tile_columns = size.width.div_ceil(1 << TILE_BITS) as usize;
            if level.side_bits == 0 {
                level.blocks.resize(level.columns * level.rows, [0.0; 4]);
            }
        }
    }

    /// For blocks smaller than tiles, where they are looked at.
    fn make_room(&mut self) {
        for level in &mut self.levels[..TILE_BITS - 1] {
            let (per_tile, mut room) = (1 << (2 * level.side_bits), 0);
            level.first.clear();
            level.first.extend(self.near.iter().map(|&is_near| {
                let first = room;
                room += if is_near { per_tile } else { 0 };
                first as u32
            }));
            level.blocks.resize(room, [0.0; 4]);
            give_back(&mut level.blocks);
        }
    }

    fn find_near(&mut self, far: Far<'_>) {
        let [columns, rows] = [far.grid.columns, far.grid.rows].map(|count| count as usize);
        self.near.clear();
        self.near.resize(columns * rows, false);
        let beside = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
        for tile in far.holed() {
            for y in beside(tile / columns, rows) {
                for x in beside(tile % columns, columns) {
                    self.near[y * columns + x] = true;
                }
            }
        }
    }

    /// Up to the blocks that are tiles.
    fn pull_tiles(&mut self, far: Far<'_>, picture: &[[f32; 3]]) {
        let (size, width) = (far.grid.size, far.grid.size.width as usize);
        let (fine, tiles) = self.levels.split_at_mut(TILE_BITS - 1);
        let Level { columns, ref mut blocks, .. } = tiles[0];
        for (tile, block) in blocks.iter_mut().enumerate() {
            let (x, y) = (tile % columns, tile / columns);
            let pixel = |x: usize, y: usize| {
                let [r, g, b] = picture[y * width + x];
                let is_far = far.tiles[tile] >> (y % 8 * 8 + x % 8) & 1 == 1;
                [r, g, b, if is_far { 0.0 } else { 1.0 }]
            };
            let xs = x << TILE_BITS..((x + 1) << TILE_BITS).min(width);
            let ys = y << TILE_BITS..((y + 1) << TILE_BITS).min(size.height as usize);
            if !self.near[tile] {
                *block = pulled(1.0, xs.zip(ys).map(|(x, y)| pixel(x, y)));
                continue;
            }
            let halved = |range: &Range<usize>, bits: usize| {
                range.start >> bits..range.end.div_ceil(1 << bits)
            };
            for (y, x) in pairs(halved(&ys, 1), halved(&xs, 1)) {
                let children = pairs(twice(y, ys.end), twice(x, xs.end)).map(|(y, x)| pixel(x, y));
                fine[0].set(x, y, pulled(enough(1), children));
            }
            for l in 1..TILE_BITS - 1 {
                let (finer, coarser) = fine.split_at_mut(l);
                coarser[0].pull(
                    enough(l + 1),
                    &finer[l - 1],
                    halved(&xs, l + 1),
                    halved(&ys, l + 1),
                );
            }
            let finest = &fine[TILE_BITS - 2];
            *block = pulled(enough(TILE_BITS), finest.children(x, y));
        }
    }

    /// From the coarsest blocks to the finest; those smaller than tiles only in tiles with holes.
    fn push(&mut self, far: Far<'_>) {
        let tile_columns = far.grid.columns as usize;
        for l in (0..self.levels.len() - 1).rev() {
            let (finer, coarser) = self.levels.split_at_mut(l + 1);
            let (finer, coarser) = (&mut finer[l], &coarser[0]);
            if l >= TILE_BITS - 1 {
                finer.push(coarser, 0..finer.columns, 0..finer.rows);
                continue;
            }
            let per_tile = 1 << (TILE_BITS - 1 - l);
            let blocks = |at: usize, end: usize| at * per_tile..((at + 1) * per_tile).min(end);
            for tile in far.holed() {
                let (x, y) = (tile % tile_columns, tile / tile_columns);
                finer.push(coarser, blocks(x, finer.columns), blocks(y, finer.rows));
            }
        }
    }
}

impl Level {
    /// Where a block is in memory.
    #[inline]
    fn place(&self, x: usize, y: usize) -> usize {
        let bits = self.side_bits;
        if bits == 0 {
            return y * self.columns + x;
        }
        let last = (1 << bits) - 1;
        let first = self.first[(y >> bits) * self.tile_columns + (x >> bits)] as usize;
        first + ((y & last) << bits | (x & last))
    }

    #[inline]
    fn at(&self, x: usize, y: usize) -> Block {
        self.blocks[self.place(x, y)]
    }

    #[inline]
    fn set(&mut self, x: usize, y: usize, block: Block) {
        let place = self.place(x, y);
        self.blocks[place] = block;
    }

    /// From the next finer level.
    fn pull(&mut self, k: f32, finer: &Level, columns: Range<usize>, rows: Range<usize>) {
        for (y, x) in pairs(rows, columns) {
            self.set(x, y, pulled(k, finer.children(x, y)));
        }
    }

    /// From the next coarser level.
    fn push(&mut self, coarser: &Level, columns: Range<usize>, rows: Range<usize>) {
        for (y, x) in pairs(rows, columns) {
            let block = self.at(x, y);
            if block[3] < 1.0 {
                self.set(x, y, mixed(block, coarser.between(x, y)));
            }
        }
    }

    /// The large holes of a tile of pixels, as [`Level::between`] has it.
    fn fill(&self, far: Far<'_>, tile: usize, picture: &mut [[f32; 3]]) {
        /// Blocks of a tile in a row, with one at either side.
        const SIDE: usize = 6;
        let [column, row] = far.grid.column_and_row(tile).map(|at| at as usize);
        let beside = |at: usize, i: usize, end: usize| (4 * at + i).saturating_sub(1).min(end - 1);
        let mut blocks = [[[0.0; 4]; SIDE]; SIDE];
        for (i, blocks) in blocks.iter_mut().enumerate() {
            for (j, block) in blocks.iter_mut().enumerate() {
                *block = self.at(beside(column, j, self.columns), beside(row, i, self.rows));
            }
        }
        let (corner, mut pixels) = (far.grid.corner(tile), far.tiles[tile]);
        while pixels != 0 {
            let place = pixels.trailing_zeros() as usize;
            pixels &= pixels - 1;
            // That of its own, and the nearer one beside it.
            let [[x, u], [y, v]] = [place % 8, place / 8].map(|i| [i / 2 + 1, i / 2 + 2 * (i % 2)]);
            let near = [blocks[y][x], blocks[y][u], blocks[v][x], blocks[v][u]];
            picture[(corner + far.grid.step(place)) as usize] = interpolated(near);
        }
    }

    /// Of a block of the next coarser level.
    fn children(&self, x: usize, y: usize) -> impl Iterator<Item = Block> {
        let children = pairs(twice(y, self.rows), twice(x, self.columns));
        children.map(|(y, x)| self.at(x, y))
    }

    /// Interpolated at the centre of a block, or pixel, of the next finer level: a quarter of a block beside that of its own.
    fn between(&self, x: usize, y: usize) -> [f32; 3] {
        let own_and_beside = |i: usize, end: usize| {
            let beside = if i.is_multiple_of(2) { (i / 2).saturating_sub(1) } else { i / 2 + 1 };
            [i / 2, beside.min(end - 1)]
        };
        let ([x, u], [y, v]) = (own_and_beside(x, self.columns), own_and_beside(y, self.rows));
        interpolated([self.at(x, y), self.at(u, y), self.at(x, v), self.at(u, v)])
    }
}

impl Far<'_> {
    /// Tiles with such pixels.
    fn holed(&self) -> impl Iterator<Item = usize> {
        self.tiles.iter().enumerate().filter(|(_, pixels)| **pixels != 0).map(|(tile, _)| tile)
    }
}

/// Between a block, the nearer ones beside and above or below it, and the one across.
#[inline(always)]
fn interpolated([a, b, c, d]: [Block; 4]) -> [f32; 3] {
    let [r, g, b, _]: Block =
        std::array::from_fn(|k| (9.0 * a[k] + 3.0 * (b[k] + c[k]) + d[k]) * (1.0 / 16.0));
    [r, g, b]
}

/// All (y, x), row by row.
fn pairs(ys: Range<usize>, xs: Range<usize>) -> impl Iterator<Item = (usize, usize)> {
    ys.flat_map(move |y| xs.clone().map(move |x| (y, x)))
}

/// The two of the next finer level, as far as there are.
fn twice(i: usize, end: usize) -> Range<usize> {
    2 * i..(2 * i + 2).min(end)
}

fn pulled(k: f32, children: impl Iterator<Item = Block>) -> Block {
    let (mut sum, mut count) = ([0.0; 4], 0.0);
    for [r, g, b, w] in children {
        sum = [sum[0] + w * r, sum[1] + w * g, sum[2] + w * b, sum[3] + w];
        count += 1.0;
    }
    let [r, g, b, w] = sum;
    let per_weight = if w > 0.0 { 1.0 / w } else { 0.0 };
    [r * per_weight, g * per_weight, b * per_weight, (k * w / count).min(1.0)]
}

/// As much of another colour as the block does not know.
fn mixed([r, g, b, w]: Block, other: [f32; 3]) -> Block {
    let mix = |own: f32, other: f32| w * own + (1.0 - w) * other;
    [mix(r, other[0]), mix(g, other[1]), mix(b, other[2]), 1.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Size = Size { width: 45, height: 37 };

    /// What is shown where `known` is false, as (x, y, colour), the others showing `colour`.
    fn filled(
        known: impl Fn(u32, u32) -> bool,
        colour: impl Fn(u32, u32) -> f32,
        prior: f32,
    ) -> Vec<(u32, u32, f32)> {
        let pixels = 0..SIZE.pixels() as u32;
        let is_known = |&pixel: &u32| known(SIZE.xy(pixel).0, SIZE.xy(pixel).1);
        let grid = TileGrid::new(SIZE, 8);
        let mut tiles = vec![0; grid.len()];
        for place in pixels.clone().filter(|pixel| !is_known(pixel)).map(|pixel| grid.place(pixel))
        {
            tiles[place.tile()] |= 1u64 << place.within();
        }
        let shown = |pixel| {
            let (x, y) = SIZE.xy(pixel);
            if known(x, y) { [colour(x, y); 3] } else { [f32::NAN; 3] }
        };
        // What was there before counts nothing, as long as it is a number.
        let mut picture: Vec<[f32; 3]> =
            pixels.map(|pixel| shown(pixel).map(|c| if c.is_nan() { 99.0 } else { c })).collect();
        let far = Far { grid: &grid, tiles: &tiles };
        Smooth::default().run(far, [prior; 3], &mut picture);
        let now = |pixel: u32| (SIZE.xy(pixel).0, SIZE.xy(pixel).1, picture[pixel as usize][0]);
        (0..SIZE.pixels() as u32).filter(|pixel| !is_known(pixel)).map(now).collect()
    }

    #[test]
    fn where_everything_around_is_alike_so_is_the_hole() {
        let is_known = |x: u32, y: u32| !(7..30).contains(&x) || !(9..20).contains(&y);
        for (x, y, c) in filled(is_known, |_, _| 0.25, 0.25) {
            assert!((c - 0.25).abs() < 1e-6, "{x}, {y}: {c}");
        }
    }

    #[test]
    fn where_nothing_is_known_the_prior_is_shown() {
        assert!(filled(|_, _| false, |_, _| 0.0, 0.75).iter().all(|pixel| pixel.2 == 0.75));
    }

    #[test]
    fn between_sparse_samples_of_a_ramp_there_is_about_the_ramp() {
        let ramp = |x: u32, y: u32| (x as f32 + 0.5 * y as f32) / 64.0;
        let is_inside = |x: u32, y: u32| (8..37).contains(&x) && (8..29).contains(&y);
        let filled = filled(|x, y| x % 4 == 1 && y % 4 == 2, ramp, 0.5);
        let inside = filled.iter().filter(|(x, y, _)| is_inside(*x, *y));
        let off: Vec<f32> = inside.map(|&(x, y, c)| (c - ramp(x, y)).abs()).collect();
        // The nearest sample would be off by up to two columns and two rows: 3/64.
        assert!(off.iter().all(|&off| off < 2.5 / 64.0), "{off:?}");
        assert!(off.iter().sum::<f32>() / (off.len() as f32) < 1.0 / 64.0);
    }

    #[test]
    fn a_hole_between_dark_and_light_goes_from_one_to_the_other() {
        let is_known = |x: u32, _| !(10..35).contains(&x);
        let row: Vec<f32> = filled(is_known, |x, _| f32::from(x >= 35), 0.5)
            .into_iter()
            .filter(|pixel| pixel.1 == 18)
            .map(|pixel| pixel.2)
            .collect();
        assert!(row.windows(2).all(|pair| pair[0] <= pair[1] + 1e-6), "{row:?}");
        assert!(row[0] < 0.25 && row[24] > 0.75, "{row:?}");
    }
}
