//! From a pixel to its ray.

use frameless::{Request, Size};
use frameless_scene::{Projection, Scene, State, View};
use glam::{Mat3A, Vec3A};

use crate::ray::Ray;

/// Who looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ViewSource {
    /// The scene's own camera with this index, which may be animated.
    Camera(u32),
    /// A view that does not depend on the scene's time.
    Free(View),
}

impl ViewSource {
    pub(crate) fn at(&self, scene: &Scene, state: &State) -> View {
        match self {
            ViewSource::Camera(camera) => scene.view_at(state, *camera),
            ViewSource::Free(view) => *view,
        }
    }
}

/// A view prepared for a picture of one size.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Camera {
    size: Size,
    position: Vec3A,
    axes: Mat3A,
    /// Half the picture's width and height: at distance 1 (perspective) or in metres (orthographic).
    half: [f32; 2],
    is_perspective: bool,
}

impl Camera {
    pub(crate) fn new(view: &View, size: Size) -> Camera {
        let (half_height, is_perspective) = match view.projection {
            Projection::Perspective { yfov_rad } => ((0.5 * yfov_rad).tan(), true),
            Projection::Orthographic { ymag } => (ymag, false),
        };
        let aspect = size.width as f32 / size.height as f32;
        let position = view.world_from_camera.translation;
        let axes = view.world_from_camera.matrix3;
        Camera { size, position, axes, half: [half_height * aspect, half_height], is_perspective }
    }

    /// With (x, y) in [−1, 1]² over the picture, y up: from the camera's position through (x·half, y·half, −1), or
    /// from (x·half, y·half, 0) along −z. The direction has unit length.
    #[inline]
    pub(crate) fn ray(&self, request: &Request) -> Ray {
        let [px, py] = request.position_px(self.size);
        let x = (2.0 * px / self.size.width as f32 - 1.0) * self.half[0];
        let y = (1.0 - 2.0 * py / self.size.height as f32) * self.half[1];
        if self.is_perspective {
            let direction = self.axes * Vec3A::new(x, y, -1.0);
            Ray { origin: self.position, direction: direction.normalize_or_zero() }
        } else {
            let origin = self.position + self.axes * Vec3A::new(x, y, 0.0);
            Ray { origin, direction: (-self.axes.z_axis).normalize_or_zero() }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Affine3A, Vec3};

    fn corner_rays(projection: Projection) -> [Ray; 2] {
        // Looks along +x from (1, 2, 3): −z becomes +x under a turn of −90° about y.
        let world_from_camera = Affine3A::from_translation(Vec3::new(1.0, 2.0, 3.0))
            * Affine3A::from_rotation_y(-std::f32::consts::FRAC_PI_2);
        let size = Size::new(4, 2);
        let camera = Camera::new(&View { world_from_camera, projection }, size);
        let top_left = Request { pixel: 0, offset: [-0.5, -0.5] };
        let centre = Request { pixel: size.index(2, 1), offset: [-0.5, -0.5] };
        [camera.ray(&top_left), camera.ray(&centre)]
    }

    #[test]
    fn perspective_corners() {
        let yfov_rad = std::f32::consts::FRAC_PI_2;
        let [top_left, centre] = corner_rays(Projection::Perspective { yfov_rad });
        assert_eq!(top_left.origin, Vec3A::new(1.0, 2.0, 3.0));
        // 90° high and twice as wide: (−2, 1, −1) in the camera's space; its x axis is the world's z.
        let expected = Vec3A::new(1.0, 1.0, -2.0).normalize();
        assert!(top_left.direction.abs_diff_eq(expected, 1e-6), "{top_left:?}");
        assert!(centre.direction.abs_diff_eq(Vec3A::X, 1e-6), "{centre:?}");
    }

    #[test]
    fn orthographic_corners() {
        let [top_left, centre] = corner_rays(Projection::Orthographic { ymag: 3.0 });
        assert!(top_left.origin.abs_diff_eq(Vec3A::new(1.0, 5.0, -3.0), 1e-5), "{top_left:?}");
        assert!(centre.origin.abs_diff_eq(Vec3A::new(1.0, 2.0, 3.0), 1e-5), "{centre:?}");
        for ray in [top_left, centre] {
            assert!(ray.direction.abs_diff_eq(Vec3A::X, 1e-6), "{ray:?}");
        }
    }
}
