//! The full-resolution picture that past frames have added up to.

use frameless::Size;

/// One pixel of the history.
#[derive(Clone, Copy, Debug)]
pub(super) struct Past {
    /// Display-referred sRGB.
    pub(super) colour: [f32; 3],
    /// How much has been added up here: a sample at the pixel's centre counts 1.
    pub(super) weight: f32,
    /// The object that the pixel shows.
    pub(super) object: u32,
    /// 1 / distance along the direction of view; 0 for the sky. In a picture it is linear over a plane.
    pub(super) inverse_depth: f32,
    /// The moment that the pixel shows, in seconds: the mean over what has been added up.
    pub(super) secs: f32,
}

/// Fraction by which depths may differ and still be the same place of the same object.
const DEPTH_TOLERANCE: f32 = 0.1;

impl Past {
    /// Whether this is where a surface point was.
    pub(super) fn shows(&self, object: u32, inverse_depth: f32) -> bool {
        let difference = (self.inverse_depth - inverse_depth).abs();
        self.object == object
            && difference <= DEPTH_TOLERANCE * self.inverse_depth.max(inverse_depth)
    }
}

/// The whole picture.
pub(super) struct History {
    pub(super) size: Size,
    pub(super) pixels: Vec<Past>,
}

impl History {
    /// The pixel around a position in pixels from the picture's corner; `None` outside.
    pub(super) fn at(&self, [x, y]: [f32; 2]) -> Option<&Past> {
        let Size { width, height } = self.size;
        let inside = x >= 0.0 && y >= 0.0 && x < width as f32 && y < height as f32;
        inside.then(|| &self.pixels[self.size.index(x as u32, y as u32) as usize])
    }

    /// The colour of an object at a position in pixels from the picture's corner, inside the picture: Catmull-Rom over the 4×4 pixels
    /// around, leaving out those that show other objects. A pixel's centre gives that pixel's colour.
    pub(super) fn colour(&self, [x, y]: [f32; 2], nearest: &Past) -> [f32; 3] {
        let (left, top) = ((x - 0.5).floor(), (y - 0.5).floor());
        let (along_x, along_y) = (catmull_rom(x - 0.5 - left), catmull_rom(y - 0.5 - top));
        let clamped = |corner: f32, i: usize, side: u32| {
            (corner as i32 - 1 + i as i32).clamp(0, side as i32 - 1) as usize
        };
        let columns: [usize; 4] = std::array::from_fn(|i| clamped(left, i, self.size.width));
        let (mut sum, mut total) = ([0.0; 3], 0.0);
        for (j, &wy) in along_y.iter().enumerate() {
            let row = clamped(top, j, self.size.height) * self.size.width as usize;
            for (&column, &wx) in columns.iter().zip(&along_x) {
                let past = &self.pixels[row + column];
                let w = if past.object == nearest.object { wx * wy } else { 0.0 };
                (0..3).for_each(|k| sum[k] += w * past.colour[k]);
                total += w;
            }
        }
        // With too few of its pixels left, weights cancel each other and the quotient could be anything.
        if total < 0.5 {
            return nearest.colour;
        }
        sum.map(|s| (s / total).clamp(0.0, 1.0))
    }
}

/// Weights of four points at −1, 0, 1, 2 for a value at `t` in [0, 1): the cubic through the middle two whose slopes are half the
/// difference of the neighbours (Catmull and Rom 1974). They add up to 1.
fn catmull_rom(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t + 2.0 * t2 - t3),
        0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
        0.5 * (t + 4.0 * t2 - 3.0 * t3),
        0.5 * (-t2 + t3),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn past(colour: f32, object: u32) -> Past {
        Past { colour: [colour; 3], weight: 1.0, object, inverse_depth: 0.5, secs: 0.0 }
    }

    #[test]
    fn a_ramp_stays_a_ramp_and_a_centre_gives_the_pixel() {
        let size = Size::new(8, 6);
        let pixels = (0..48).map(|p| past(size.xy(p).0 as f32 / 8.0, 0)).collect();
        let history = History { size, pixels };
        let colour = |x, y| history.colour([x, y], history.at([x, y]).expect("inside"))[0];
        assert_eq!(colour(3.5, 2.5), 0.375);
        for x in [2.6, 3.0, 4.9] {
            assert!((colour(x, 3.1) - (x - 0.5) / 8.0).abs() < 1e-6);
        }
        assert!(history.at([-0.1, 2.0]).is_none() && history.at([2.0, 6.0]).is_none());
    }

    #[test]
    fn other_objects_do_not_bleed() {
        let size = Size::new(8, 1);
        let pixels = (0..8).map(|x| if x < 4 { past(0.2, 0) } else { past(0.9, 1) }).collect();
        let history = History { size, pixels };
        for x in [3.6, 3.9, 4.1, 4.4] {
            let nearest = history.at([x, 0.5]).expect("inside");
            let got = history.colour([x, 0.5], nearest)[0];
            assert!((got - nearest.colour[0]).abs() < 1e-6, "{x}: {got}");
        }
    }

    #[test]
    fn a_place_is_known_by_object_and_depth() {
        assert!(past(0.0, 3).shows(3, 0.52));
        assert!(!past(0.0, 3).shows(4, 0.5), "another object");
        assert!(!past(0.0, 3).shows(3, 0.4), "another side of it");
        assert!(Past { inverse_depth: 0.0, ..past(0.0, 9) }.shows(9, 0.0), "the sky");
    }
}
