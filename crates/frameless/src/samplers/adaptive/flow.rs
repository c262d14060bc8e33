//! How the picture moves as a whole: Gibson's patterns of optic flow.
//!
//! ```text
//! û(x) = t + e (x − x̄) + w (x − x̄)⊥,    (x, y)⊥ = (−y, x)
//! ```
//!
//! Translation t, expansion e and rotation w (Gibson 1950, "The perception of the visual world"), by least squares over the tiles'
//! own motions u: with Σ over tiles weighted by k and x̄, ū their means,
//!
//! ```text
//! t = ū,   e = Σ k (x − x̄)·u / Σ k |x − x̄|²,   w = Σ k (x − x̄)⊥·u / Σ k |x − x̄|²
//! k = 1 / (1 + |u − û|² / σ²)              from the fit before: who moves otherwise has little say (Cauchy)
//! ```

/// How a tile moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moving {
    pub(crate) tile: usize,
    /// Its middle.
    pub(crate) at_px: [f32; 2],
    /// From one refresh to the next.
    pub(crate) motion_px: [f32; 2],
}

/// The pattern; all zero if nothing moves, or nobody is known to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Flow {
    /// x̄.
    middle_px: [f32; 2],
    /// t, per refresh.
    translation_px: [f32; 2],
    /// e: part by which everything grows per refresh.
    expansion: f32,
    /// w, radians per refresh.
    rotation: f32,
}

/// σ: who is farther off than this is somebody else.
const OFF_PX: f32 = 1.0;
/// Fits, each with the weights of the one before; after a few they hardly change.
const FITS: usize = 4;

impl Flow {
    pub(crate) fn fit(tiles: &[Moving]) -> Flow {
        let mut flow = Flow::weighted(tiles, |_| 1.0);
        for _ in 1..FITS {
            let before = flow;
            let weight =
                |moving: &Moving| 1.0 / (1.0 + (before.deviation_px(moving) / OFF_PX).powi(2));
            flow = Flow::weighted(tiles, weight);
        }
        flow
    }

    fn weighted(tiles: &[Moving], weight: impl Fn(&Moving) -> f32) -> Flow {
        let (mut sum, mut at, mut motion) = (0.0, [0.0; 2], [0.0; 2]);
        for moving in tiles {
            let k = weight(moving);
            sum += k;
            (0..2).for_each(|i| at[i] += k * moving.at_px[i]);
            (0..2).for_each(|i| motion[i] += k * moving.motion_px[i]);
        }
        if sum == 0.0 {
            return Flow::default();
        }
        let (middle_px, translation_px) = (at.map(|c| c / sum), motion.map(|c| c / sum));
        let (mut expansion, mut rotation, mut square) = (0.0, 0.0, 0.0);
        for moving in tiles {
            let k = weight(moving);
            let [x, y]: [f32; 2] = std::array::from_fn(|i| moving.at_px[i] - middle_px[i]);
            let [u, v] = moving.motion_px;
            expansion += k * (x * u + y * v);
            rotation += k * (x * v - y * u);
            square += k * (x * x + y * y);
        }
        // A single place neither grows nor turns.
        let per_square = if square > 0.0 { 1.0 / square } else { 0.0 };
        let (expansion, rotation) = (expansion * per_square, rotation * per_square);
        Flow { middle_px, translation_px, expansion, rotation }
    }

    /// |u − û| in pixels per refresh.
    pub(crate) fn deviation_px(&self, moving: &Moving) -> f32 {
        let [x, y]: [f32; 2] = std::array::from_fn(|i| moving.at_px[i] - self.middle_px[i]);
        let [tx, ty] = self.translation_px;
        let u = tx + self.expansion * x - self.rotation * y;
        let v = ty + self.expansion * y + self.rotation * x;
        (moving.motion_px[0] - u).hypot(moving.motion_px[1] - v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tiles(motion_px: impl Fn(f32, f32) -> [f32; 2]) -> Vec<Moving> {
        let tile = |tile: usize| {
            let (x, y) = ((tile % 16) as f32 * 8.0 + 4.0, (tile / 16) as f32 * 8.0 + 4.0);
            Moving { tile, at_px: [x, y], motion_px: motion_px(x, y) }
        };
        (0..16 * 12).map(tile).collect()
    }

    #[test]
    fn gibsons_patterns_are_found_and_leave_nothing() {
        let tiles =
            tiles(|x, y| [3.0 + 0.02 * (x - 30.0) - 0.01 * y, -1.0 + 0.02 * y + 0.01 * (x - 30.0)]);
        let flow = Flow::fit(&tiles);
        assert!((flow.expansion - 0.02).abs() < 1e-5, "{flow:?}");
        assert!((flow.rotation - 0.01).abs() < 1e-5, "{flow:?}");
        assert!(tiles.iter().all(|moving| flow.deviation_px(moving) < 1e-3));
    }

    #[test]
    fn who_moves_by_itself_does_not_bend_the_pattern() {
        let mut tiles = tiles(|x, _| [2.0 + 0.01 * x, 0.0]);
        let flow = Flow::fit(&tiles);
        tiles[50..70].iter_mut().for_each(|moving| moving.motion_px = [-9.0, 4.0]);
        let bent = Flow::fit(&tiles);
        for (i, moving) in tiles.iter().enumerate() {
            let off = bent.deviation_px(moving);
            if (50..70).contains(&i) {
                assert!(off > 10.0, "{off}");
            } else {
                assert!(off < flow.deviation_px(moving) + 0.2, "{off}");
            }
        }
    }

    #[test]
    fn few_tiles_or_none_have_a_flow() {
        assert_eq!(Flow::fit(&[]), Flow::default());
        let one = Moving { tile: 0, at_px: [4.0; 2], motion_px: [1.0, 2.0] };
        assert_eq!(Flow::fit(&[one]).deviation_px(&one), 0.0);
    }
}
