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

/// A view of the whole of `bounds`, three-quarter from the front right and slightly from above.
///
/// `yfov_rad` is the vertical angle of view in (0, π), `aspect` width / height. The sphere around the box
/// touches the nearer pair of the picture's borders; a box that is a point is seen from 1 m away.
pub fn frame_bounds(bounds: Bounds, yfov_rad: f32, aspect: f32) -> View {
    /// From the middle of the scene towards the camera.
    const TOWARDS_CAMERA: Vec3 = Vec3::new(0.48, 0.36, 0.8);
    let half_y = 0.5 * yfov_rad;
    let half_x = (half_y.tan() * aspect).atan();
    let radius = bounds.radius();
    let distance = if radius > 0.0 { radius / half_x.min(half_y).sin() } else { 1.0 };
    let eye = bounds.centre() + TOWARDS_CAMERA * distance;
    View {
        world_from_camera: look_at(eye, bounds.centre(), Vec3::Y),
        projection: Projection::Perspective { yfov_rad },
    }
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
