//! Aiming: where to trace, so that the hit lies on a pixel's centre at the next refresh.

use super::Reproject;
use super::store::surface;
use crate::tile::TileGrid;
use crate::{Request, Time};

/// Where to look for a surface in a hole: the farthest of these neighbours has probably been uncovered.
const AROUND: [[i32; 2]; 8] = [[3, 0], [-3, 0], [0, 3], [0, -3], [6, 0], [-6, 0], [0, 6], [0, -6]];
/// Faster surfaces (pixels per refresh) are not aimed at.
const FASTEST_PX: f32 = 200.0;

impl Reproject {
    pub(super) fn aim_one(&self, now: Time, request: &mut Request) {
        let size = self.store.layout.size;
        let Some(motion) = self.motion(request.pixel) else { return };
        if motion == [0.0; 2] {
            return;
        }
        // How much of the motion from refresh to refresh is still to come.
        let gone = now.secs_since(self.shown_at) as f32 / self.interval_secs;
        let rest = (1.0 - gone).clamp(0.0, 1.0);
        let (x, y) = size.xy(request.pixel);
        let position: [f32; 2] = std::array::from_fn(|k| {
            let here = [x, y][k] as f32 + 0.5;
            let lands = (here + rest * motion[k]).floor() + 0.5;
            let most = [size.width, size.height][k] as f32 - 0.01;
            (lands - rest * motion[k]).clamp(0.01, most)
        });
        let [px, py] = position.map(f32::floor);
        request.pixel = size.index(px as u32, py as u32);
        request.offset = [position[0] - px - 0.5, position[1] - py - 0.5];
    }

    /// How far what is seen at a pixel moves from one refresh to the next, in pixels.
    fn motion(&self, pixel: u32) -> Option<[f32; 2]> {
        let (x, y) = self.store.layout.size.xy(pixel);
        let cell = self.store.newest(x, y).or_else(|| self.uncovered(x, y))?;
        let surface = surface(self.store.object[cell], &self.store.anchor[cell]);
        let here = self.poses[0].project(&surface)?.px;
        let before = self.poses[1].project(&surface)?.px;
        let motion = [here[0] - before[0], here[1] - before[1]];
        (motion[0].abs() < FASTEST_PX && motion[1].abs() < FASTEST_PX).then_some(motion)
    }

    /// How far what is seen in the middle of each tile has moved between the last two refreshes.
    pub(super) fn tile_motion(&self, grid: &TileGrid) -> impl Iterator<Item = Option<[f32; 2]>> {
        (0..grid.len()).map(move |tile| {
            let rect = grid.rect(tile);
            let (x, y) = ((rect.x0 + rect.x1) / 2, (rect.y0 + rect.y1) / 2);
            // Before the second refresh nothing is known to move.
            (self.refreshes >= 2).then(|| self.motion(grid.size.index(x, y))).flatten()
        })
    }

    fn uncovered(&self, x: u32, y: u32) -> Option<usize> {
        let size = self.store.layout.size;
        let near = AROUND.iter().filter_map(|[dx, dy]| {
            let (x, y) = (x.checked_add_signed(*dx)?, y.checked_add_signed(*dy)?);
            let inside = x < size.width && y < size.height;
            inside.then(|| self.store.newest(x, y)).flatten()
        });
        near.max_by(|&a, &b| self.store.depth[a].total_cmp(&self.store.depth[b]))
    }
}
