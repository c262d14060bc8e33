//! A thin lens before the camera: what is nearer or farther than the plane in focus is blurred.
//!
//! Cook, Porter and Carpenter 1984, "Distributed Ray Tracing", §4.3.

use std::f32::consts::TAU;

use frameless::Surface;
use glam::Vec3A;

use crate::camera::Camera;
use crate::moment::Moment;
use crate::ray::Ray;
use crate::top::Shape;

/// Light enters through a disc around the camera's position, instead of through a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Of the disc; at least 0.
    pub radius_m: f32,
    /// From the camera to the plane that is sharp, along the direction of view; above 0.
    pub focus_m: f32,
}

impl Lens {
    /// A ray through the lens: (u, v) in [0, 1)² choose where, evenly over its area. In the plane in focus it meets `ray`, the
    /// one through the middle.
    ///
    /// ```text
    /// o′ = o + R √u (cos 2πv, sin 2πv, 0)        d′ = o + d · F / d_z − o′
    /// ```
    pub(crate) fn ray(&self, camera: &Camera, ray: &Ray, [u, v]: [f32; 2]) -> Ray {
        let sharp = at_depth(camera, ray, self.focus_m);
        let (sin, cos) = (TAU * v).sin_cos();
        let on_lens = self.radius_m * u.sqrt() * Vec3A::new(cos, sin, 0.0);
        let origin = ray.origin + camera.axes * on_lens;
        Ray { origin, direction: (sharp - origin).normalize_or_zero() }
    }
}

/// `surface`, found through a lens, where `ray` through the middle of it would have met it: as deep, but in the pixel that it was
/// traced for. So a blurred picture stays blurred while it is carried along. What deforms stays where it is.
pub(crate) fn in_own_pixel(
    surface: Surface,
    moment: &Moment,
    camera: &Camera,
    ray: &Ray,
) -> Surface {
    if surface.object == Surface::SKY {
        return Surface { position: ray.direction.to_array(), ..surface };
    }
    let placed = moment.placed(surface.object);
    if matches!(placed.shape, Shape::Deforming(_)) {
        return surface;
    }
    let point = placed.world_from_object.transform_point3a(Vec3A::from(surface.position));
    let depth = (ray.origin - point).dot(camera.axes.z_axis);
    let moved = placed.object_from_world.transform_point3a(at_depth(camera, ray, depth));
    Surface { position: moved.to_array(), ..surface }
}

/// Where a ray is so far from the camera, measured along the direction of view.
fn at_depth(camera: &Camera, ray: &Ray, depth: f32) -> Vec3A {
    ray.origin + ray.direction * (-depth / ray.direction.dot(camera.axes.z_axis))
}

#[cfg(test)]
mod tests {
    use frameless::{Request, Size};
    use frameless_scene::{Projection, View};
    use glam::{Affine3A, Vec3};

    use super::*;
    use crate::{Integrator, Settings, World};

    const SIZE: Size = Size { width: 64, height: 48 };

    fn cameras() -> [Camera; 2] {
        let world_from_camera = Affine3A::from_translation(Vec3::new(1.0, 2.0, 3.0))
            * Affine3A::from_rotation_y(0.7)
            * Affine3A::from_rotation_x(-0.3);
        [Projection::Perspective { yfov_rad: 0.9 }, Projection::Orthographic { ymag: 3.0 }]
            .map(|projection| Camera::new(&View { world_from_camera, projection }, SIZE))
    }

    #[test]
    fn all_rays_of_a_pixel_meet_in_the_plane_in_focus_and_fill_the_lens() {
        let lens = Lens { radius_m: 0.25, focus_m: 4.0 };
        for camera in cameras() {
            let ray = camera.ray(&Request::centre(SIZE.index(50, 7)));
            let sharp = at_depth(&camera, &ray, 4.0);
            let mut mean_square = 0.0;
            for k in 0..64 {
                let numbers = [(k / 8) as f32 / 8.0 + 0.0625, (k % 8) as f32 / 8.0];
                let through = lens.ray(&camera, &ray, numbers);
                let off = through.origin - ray.origin;
                assert!(off.dot(camera.axes.z_axis).abs() < 1e-6 && off.length() <= 0.25);
                mean_square += off.length_squared() / 64.0;
                let met = at_depth(&camera, &through, 4.0);
                assert!(met.abs_diff_eq(sharp, 1e-5), "{met} {sharp}");
            }
            // Of a disc it is R²/2.
            assert!((mean_square / (0.25 * 0.25) - 0.5).abs() < 1e-3, "{mean_square}");
        }
    }

    fn samples(lens: Option<Lens>, pixel: u32) -> Vec<([f32; 3], [f32; 2])> {
        let world = World::new(frameless_scene::builtin("sphere").expect("is there").into());
        let (moment, mut pose) = (world.moment(0.0), frameless::Pose::default());
        let view = world.scene().view_at(moment.state(), 0);
        world.pose(&moment, &view, SIZE, &mut pose);
        let settings = Settings { integrator: Integrator::Path, lens, ..Settings::default() };
        let traced = |k| {
            let request = Request { pixel, offset: [0.0; 2], sample_index: k };
            let (rgb, surface) = world.trace(&moment, &view, SIZE, &request, &settings);
            (rgb, pose.project(&surface).expect("in the picture").px)
        };
        (0..32).map(traced).collect()
    }

    /// However it was blurred, a sample is shown in its own pixel.
    #[test]
    fn what_is_out_of_focus_belongs_to_the_pixel_it_was_traced_for() {
        let lens = Lens { radius_m: 0.3, focus_m: 0.5 };
        let mut blurred = 0;
        for pixel in (0..SIZE.pixels() as u32).step_by(97) {
            let [x, y] = Request::centre(pixel).position_px(SIZE);
            for (_, px) in samples(Some(lens), pixel) {
                assert!(
                    (px[0] - x).abs() < 0.02 && (px[1] - y).abs() < 0.02,
                    "{px:?}, not {x} {y}"
                );
            }
            let spread = |lens| {
                let greens = samples(lens, pixel).into_iter().map(|(rgb, _)| rgb[1]);
                let [low, high] = greens.fold([f32::MAX, 0.0], |[l, h], g| [g.min(l), g.max(h)]);
                high - low
            };
            blurred += u32::from(spread(Some(lens)) > spread(None) + 0.05);
        }
        assert!(blurred > 3, "the lens blurs nothing: {blurred}");
    }

    #[test]
    fn a_lens_without_width_is_a_pinhole() {
        let pixel = SIZE.index(32, 24);
        let closed = Lens { radius_m: 0.0, focus_m: 3.0 };
        for ((got, _), (want, _)) in samples(Some(closed), pixel).iter().zip(samples(None, pixel)) {
            assert!(
                (0..3).all(|k| (got[k] - want[k]).abs() < 1e-3 * (1.0 + want[k])),
                "{got:?} {want:?}"
            );
        }
    }
}
