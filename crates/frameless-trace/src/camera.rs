//! From a pixel to its ray.

use frameless::{Projection as PictureFrom, Request, Size};
use frameless_scene::{Projection, Scene, State, View};
use glam::{Affine3A, DAffine3, DMat4, DVec4, Mat3A, Vec3A};

use crate::ray::Ray;
use crate::texture::Cone;

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
pub struct Camera {
    size: Size,
    position: Vec3A,
    /// To the right, up, and against the direction of view.
    pub(crate) axes: Mat3A,
    /// Half the picture's width and height: at distance 1 (perspective) or in metres (orthographic).
    half: [f32; 2],
    is_perspective: bool,
}

impl Camera {
    /// `view` for a picture of `size`.
    pub fn new(view: &View, size: Size) -> Camera {
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
    pub fn ray(&self, request: &Request) -> Ray {
        self.ray_at(request.position_px(self.size))
    }

    /// The ray through a place in the picture, in pixels from its top-left corner.
    #[inline]
    pub fn ray_at(&self, [px, py]: [f32; 2]) -> Ray {
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

impl Camera {
    /// How much of what it sees a pixel is wide; in the middle of a perspective picture, which is wider than its edges.
    #[inline]
    pub(crate) fn cone(&self) -> Cone {
        let pixel = 2.0 * self.half[1] / self.size.height as f32;
        if self.is_perspective {
            Cone { width_m: 0.0, spread: pixel }
        } else {
            Cone { width_m: pixel, spread: 0.0 }
        }
    }

    /// Where points given in some coordinates are in the picture: the inverse of [`Camera::ray`]. Multiplied out in
    /// double precision, so that distant scenes keep their sub-pixel positions.
    pub fn picture_from(&self, world_from_object: &Affine3A) -> PictureFrom {
        let world_from_camera = Affine3A { matrix3: self.axes, translation: self.position };
        let camera_from_object = wide(&world_from_camera).inverse() * wide(world_from_object);
        rows(self.picture_from_camera() * DMat4::from(camera_from_object))
    }

    /// Where directions are in the picture; `None` if all rays are parallel.
    pub fn picture_from_direction(&self) -> Option<PictureFrom> {
        self.picture_from_directions(Mat3A::IDENTITY)
    }

    /// As [`Camera::picture_from_direction`], for directions given in some coordinates.
    pub(crate) fn picture_from_directions(&self, world_from_local: Mat3A) -> Option<PictureFrom> {
        let turn = |matrix3| wide(&Affine3A { matrix3, translation: Vec3A::ZERO });
        let camera_from_local = DMat4::from(turn(self.axes).inverse() * turn(world_from_local));
        self.is_perspective.then(|| rows(self.picture_from_camera() * camera_from_local))
    }

    /// The depth of a plane at (column, row, 1) = p in the picture, as (n, d) with depth = n · p / d · p; where the plane is seen,
    /// d · p is positive.
    pub(crate) fn depth_of_plane(&self, point: Vec3A, normal: Vec3A) -> [[f32; 3]; 2] {
        let towards_camera = if self.is_before(point, normal) { normal } else { -normal };
        let n = self.axes.transpose() * towards_camera;
        let distance = towards_camera.dot(self.position - point);
        let [half_width, half_height] = self.half;
        let [width, height] = [self.size.width as f32, self.size.height as f32];
        // n · (x, y, 0) with x = (2 column / width − 1) · half_width, and y likewise upwards.
        let [a, b, c] = [
            2.0 * n.x * half_width / width,
            -2.0 * n.y * half_height / height,
            n.y * half_height - n.x * half_width,
        ];
        if self.is_perspective {
            // (x, y, −1) · depth on the plane: depth n · (x, y, −1) = −distance.
            [[0.0, 0.0, distance], [-a, -b, n.z - c]]
        } else {
            // (x, y, −depth) on the plane: n · (x, y, 0) − depth n_z = −distance.
            [[a, b, c + distance], [0.0, 0.0, n.z]]
        }
    }

    /// Whether a plane is seen from the side of its normal.
    pub(crate) fn is_before(&self, point: Vec3A, normal: Vec3A) -> bool {
        let from_plane = if self.is_perspective { self.position - point } else { self.axes.z_axis };
        from_plane.dot(normal) > 0.0
    }

    /// Rows as in [`frameless::Projection`]; the camera looks along −z.
    fn picture_from_camera(&self) -> DMat4 {
        let [half_width, half_height] = self.half.map(f64::from);
        let [cx, cy] = [f64::from(self.size.width) / 2.0, f64::from(self.size.height) / 2.0];
        let (along_z, constant) = if self.is_perspective { (-1.0, 0.0) } else { (0.0, 1.0) };
        DMat4::from_cols(
            DVec4::new(cx / half_width, 0.0, 0.0, 0.0),
            DVec4::new(0.0, -cy / half_height, 0.0, 0.0),
            DVec4::new(cx * along_z, cy * along_z, -1.0, along_z),
            DVec4::new(cx * constant, cy * constant, 0.0, constant),
        )
    }
}

fn wide(affine: &Affine3A) -> DAffine3 {
    let columns = [affine.matrix3.x_axis, affine.matrix3.y_axis, affine.matrix3.z_axis];
    let [x, y, z] = columns.map(|column| glam::Vec3::from(column).as_dvec3());
    DAffine3::from_mat3_translation(
        glam::DMat3::from_cols(x, y, z),
        glam::Vec3::from(affine.translation).as_dvec3(),
    )
}

fn rows(matrix: DMat4) -> PictureFrom {
    PictureFrom(std::array::from_fn(|row| matrix.row(row).as_vec4().to_array()))
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
        let top_left = Request { pixel: 0, offset: [-0.5, -0.5], sample_index: 0 };
        let centre = Request { pixel: size.index(2, 1), offset: [-0.5, -0.5], sample_index: 0 };
        [camera.ray(&top_left), camera.ray(&centre)]
    }

    #[test]
    fn projecting_is_the_inverse_of_the_ray() {
        let world_from_camera = Affine3A::from_translation(Vec3::new(900.0, 2.0, -3.0))
            * Affine3A::from_rotation_y(0.7)
            * Affine3A::from_rotation_x(-0.3);
        let world_from_object = Affine3A::from_translation(Vec3::new(880.0, 1.0, 5.0))
            * Affine3A::from_rotation_z(1.1)
            * Affine3A::from_scale(Vec3::new(2.0, 0.5, 1.0));
        let size = Size::new(640, 360);
        for projection in
            [Projection::Perspective { yfov_rad: 0.9 }, Projection::Orthographic { ymag: 3.0 }]
        {
            let camera = Camera::new(&View { world_from_camera, projection }, size);
            for pixel in [0, 1234, size.index(320, 180), size.index(639, 359)] {
                let request = Request { pixel, offset: [0.25, -0.125], sample_index: 0 };
                let (ray, expected) = (camera.ray(&request), request.position_px(size));
                let point = ray.origin + 7.0 * ray.direction;
                let local = world_from_object.inverse().transform_point3a(point);
                let picture_from_object = camera.picture_from(&world_from_object);
                let there = picture_from_object.project(local.to_array()).expect("in front");
                // Positions near 900 m are exact to 1/16,000 m.
                let off = (0..2).map(|k| (there.px[k] - expected[k]).abs()).fold(0.0, f32::max);
                assert!(off < 0.03, "{projection:?} {expected:?}: {there:?}");
                let depth = 7.0 * ray.direction.dot(-camera.axes.z_axis);
                assert!((there.depth - depth).abs() < 1e-3, "{projection:?}: {there:?}, {depth}");
                if let Some(from_direction) = camera.picture_from_direction() {
                    let there = from_direction.project(ray.direction.to_array()).expect("ahead");
                    let off = (0..2).map(|k| (there.px[k] - expected[k]).abs()).fold(0.0, f32::max);
                    assert!(off < 1e-3, "{expected:?}: {there:?}");
                }
            }
        }
    }

    #[test]
    fn the_depth_of_a_plane_is_where_rays_meet_it() {
        let world_from_camera = Affine3A::from_translation(Vec3::new(1.0, 2.0, -3.0))
            * Affine3A::from_rotation_y(0.7)
            * Affine3A::from_rotation_x(-0.3);
        let size = Size::new(64, 36);
        let ahead = world_from_camera.transform_point3a(Vec3A::new(0.2, 0.1, -5.0));
        let turned = world_from_camera.transform_vector3a(Vec3A::new(0.3, -0.4, 0.9)).normalize();
        for projection in
            [Projection::Perspective { yfov_rad: 0.9 }, Projection::Orthographic { ymag: 3.0 }]
        {
            let camera = Camera::new(&View { world_from_camera, projection }, size);
            for (normal, pixel) in [(turned, 0), (-turned, 700), (turned, size.index(63, 35))] {
                let [n, d] = camera.depth_of_plane(ahead, normal);
                let request = Request { pixel, offset: [0.25, -0.125], sample_index: 0 };
                let (ray, [x, y]) = (camera.ray(&request), request.position_px(size));
                let [n, d] = [n, d].map(|row| row[0] * x + row[1] * y + row[2]);
                let t = (ahead - ray.origin).dot(normal) / ray.direction.dot(normal);
                let want = t * ray.direction.dot(-camera.axes.z_axis);
                assert!(d > 0.0 && (n / d - want).abs() < 1e-4 * want, "{pixel}: {n}/{d}, {want}");
            }
        }
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
