//! From where the scene is looked at: the file's cameras, or one that shows everything.

use glam::{Affine3A, Mat3A, Vec3, Vec3A};

use crate::{Bounds, Projection, Scene, State};

/// From where and how the scene is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// World from camera: looks along −z, +y is up. Rigid (no scale).
    pub world_from_camera: Affine3A,
    /// How directions become pixels.
    pub projection: Projection,
}

impl Scene {
    /// The view of camera `camera` (an index into [`Scene::cameras`]) at the moment of `state`.
    ///
    /// The node's scale and shear are taken off: the direction of view stays, and up as far as it can.
    pub fn view_at(&self, state: &State, camera: u32) -> View {
        let camera = &self.cameras[camera as usize];
        let world_from_node = state.world_from_node[camera.node as usize];
        View { world_from_camera: rigid(&world_from_node), projection: camera.projection }
    }
}

/// A camera at `eye` that looks at `target`: world from camera, along −z with +y up.
///
/// Where `eye` is `target`, it looks along −z of the world; where `up` (or zero) is along the direction of
/// view, some other up is taken.
pub fn look_at(eye: Vec3, target: Vec3, up: Vec3) -> Affine3A {
    let backward = (eye - target).normalize_or(Vec3::Z);
    Affine3A { matrix3: basis(backward.into(), up.into()), translation: eye.into() }
}

/// A view of the whole of `bounds`, three-quarter from the front right and slightly from above; of what is flat, like a sign, from the
/// front.
///
/// `yfov_rad` is the vertical angle of view in (0, π), `aspect` width / height. The box reaches almost to the nearest pair of the
/// picture's borders; a box that is a point is seen from 1 m away.
pub fn frame_bounds(bounds: Bounds, yfov_rad: f32, aspect: f32) -> View {
    /// A twentieth of the distance is left free.
    const MARGIN: f32 = 1.05;
    let half = 0.5 * bounds.max - 0.5 * bounds.min;
    let view_from = |distance: f32| {
        look_at(bounds.centre() + towards_camera(half) * distance, bounds.centre(), Vec3::Y)
    };
    let tan_y = (0.5 * yfov_rad).tan();
    let fitting = fitting_distance(view_from(1.0).matrix3, half, [tan_y * aspect, tan_y]);
    let distance = if fitting > 0.0 { MARGIN * fitting } else { 1.0 };
    View {
        world_from_camera: view_from(distance),
        projection: Projection::Perspective { yfov_rad },
    }
}

/// From the middle of a box of such half sizes towards its camera.
fn towards_camera(half: Vec3) -> Vec3 {
    /// Of its larger side: what is thinner is a picture of something.
    const FLAT: f32 = 0.15;
    if half.z <= FLAT * half.x.max(half.y) && half.y > FLAT * half.x {
        Vec3::Z
    } else {
        Vec3::new(0.48, 0.36, 0.8)
    }
}

/// From how far away all corners of a box are in the picture, for a camera that looks at its middle: the largest
/// |x| / tan_x + z and |y| / tan_y + z of a corner (x, y, z) in the camera's coordinates.
fn fitting_distance(world_from_camera: Mat3A, half: Vec3, tan: [f32; 2]) -> f32 {
    let corner = |signs: Vec3| {
        let corner = world_from_camera.transpose() * Vec3A::from(signs * half);
        corner.z + (corner.x.abs() / tan[0]).max(corner.y.abs() / tan[1])
    };
    let signs = |i: u32| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
    (0..8).map(|i| corner(Vec3::from_array(signs(i)))).fold(0.0, f32::max)
}

fn rigid(transform: &Affine3A) -> Affine3A {
    let backward = transform.matrix3.z_axis.normalize_or(Vec3A::Z);
    Affine3A {
        matrix3: basis(backward, transform.matrix3.y_axis),
        translation: transform.translation,
    }
}

/// Right, up, backward: orthonormal and right-handed, with `backward` (unit length) kept.
fn basis(backward: Vec3A, up: Vec3A) -> Mat3A {
    let right = up.normalize_or_zero().cross(backward);
    // Below this the direction of `right` would be rounding noise.
    let right = if right.length_squared() < 1e-10 {
        backward.any_orthonormal_vector()
    } else {
        right.normalize()
    };
    Mat3A::from_cols(right, backward.cross(right), backward)
}
