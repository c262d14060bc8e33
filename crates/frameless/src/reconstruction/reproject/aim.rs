//! Aiming: where to trace, so that the hit lies on a pixel's centre at the next refresh.

use super::store::SCREEN;
use super::{AHEAD, Reproject};
use crate::tile::TileGrid;
use crate::{Canvas, Request, Time, wide};

/// Where to look for a surface in a hole: the farthest of these neighbours has probably been uncovered.
const AROUND: [[i32; 2]; 8] = [[3, 0], [-3, 0], [0, 3], [0, -3], [6, 0], [-6, 0], [0, 6], [0, -6]];
/// Faster surfaces (pixels per refresh) are not aimed at.
const FASTEST_PX: f32 = 200.0;

/// A pixel that has shown the same for longer is looked at where it is: aimed elsewhere again and again, it would never change.
const UNAIMED_AFTER_SECS: f64 = 0.5;

impl Reproject {
    pub(super) fn aim_one(&self, now: Time, canvas: &Canvas, request: &mut Request) {
        let size = self.store.layout.size;
        let Some(motion) = self.motion(request.pixel) else { return };
        let is_old = || now.secs_since(canvas.time_of(request.pixel)) > UNAIMED_AFTER_SECS;
        if motion == [0.0; 2] || is_old() {
            return;
        }
        // How much of the motion from refresh to refresh is still to come; nothing after two refreshes at one time, between which
        // the renderer was given another camera.
        let gone = now.secs_since(self.shown_at) as f32 / self.interval_secs;
        let rest = if self.interval_secs > 0.0 { (1.0 - gone).clamp(0.0, 1.0) } else { 0.0 };
        let (x, y) = size.xy(request.pixel);
        let position: [f32; 2] = std::array::from_fn(|k| {
            let here = [x, y][k] as f32 + 0.5;
            let lands = floor(here + rest * motion[k]) + 0.5;
            let most = [size.width, size.height][k] as f32 - 0.01;
            (lands - rest * motion[k]).clamp(0.01, most)
        });
        let [x, y] = position.map(|p| p as u32);
        request.pixel = size.index(x, y);
        request.offset = [position[0] - x as f32 - 0.5, position[1] - y as f32 - 0.5];
    }

    /// Begins to fetch what [`Reproject::motion`] will look at after request `i`: first what is in the pixel, then what is around it
    /// if that is nothing.
    #[inline(always)]
    pub(super) fn prefetch_motion(&self, requests: &[Request], i: usize) {
        let size = self.store.layout.size;
        if let Some(later) = requests.get(i + AHEAD) {
            let (x, y) = size.xy(later.pixel);
            for cell in self.store.of_pixel(x, y) {
                wide::prefetch(&self.store.object, cell);
                wide::prefetch(&self.store.record, cell);
                wide::prefetch(&self.store.surfel, cell);
            }
        }
        if let Some(soon) = requests.get(i + AHEAD / 2) {
            let (x, y) = size.xy(soon.pixel);
            if self.store.newest(x, y).is_none() {
                for cell in self.cells_around(x, y) {
                    wide::prefetch(&self.store.object, cell);
                    wide::prefetch(&self.store.record, cell);
                    wide::prefetch(&self.store.surfel, cell);
                }
            }
        }
    }

    /// How far what is seen at a pixel moves from one refresh to the next, in pixels.
    fn motion(&self, pixel: u32) -> Option<[f32; 2]> {
        let (x, y) = self.store.layout.size.xy(pixel);
        let cell = self.store.newest(x, y).or_else(|| self.uncovered(x, y))?;
        let object = self.store.object[cell];
        if object != SCREEN && self.settled.rests(object) {
            return Some([0.0; 2]);
        }
        let surface = self.store.surface(cell);
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

    /// The farthest sample around a hole.
    fn uncovered(&self, x: u32, y: u32) -> Option<usize> {
        let near = self.cells_around(x, y).filter_map(|first| self.store.newest_of(first));
        near.max_by(|&a, &b| self.store.depth(a).total_cmp(&self.store.depth(b)))
    }

    /// First cells of the pixels [`AROUND`].
    #[inline(always)]
    fn cells_around(&self, x: u32, y: u32) -> impl Iterator<Item = usize> {
        let layout = self.store.layout;
        AROUND.iter().filter_map(move |[dx, dy]| {
            let (x, y) = (x.checked_add_signed(*dx)?, y.checked_add_signed(*dy)?);
            let inside = x < layout.size.width && y < layout.size.height;
            inside.then(|| layout.of_pixel(x as i32, y as i32))
        })
    }
}

/// Of a small number: `f32::floor` is a call to a library.
#[inline(always)]
fn floor(x: f32) -> f32 {
    let whole = x as i32 as f32;
    if whole > x { whole - 1.0 } else { whole }
}
