//! The camera that the user moves: orbit, pan, zoom, fly.
//!
//! A turned frame around a target: position = target − distance · forward. Since the frame is a whole rotation
//! and not two angles, taking over a scene's camera never makes the picture jump, not even a rolled one.

use frameless_scene::{Projection, View};
use glam::{Affine3A, Quat, Vec3};

/// A camera that looks at `target` from `distance`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeCamera {
    /// World from camera: looks along −z, +y is up. Unit quaternion.
    rotation: Quat,
    /// What orbiting turns around, in metres.
    target: Vec3,
    /// Metres from the camera to the target; positive.
    distance: f32,
    projection: Projection,
}

// Nearer than this to the pole, "up" would be along the direction of view and a horizontal drag would only spin
// the picture.
const STEEPEST_RAD: f32 = 89.0 / 180.0 * std::f32::consts::PI;
// Scenes are in metres, from a watch's wheel to a planet; beyond these f32 has no precision left to move with.
const DISTANCES: std::ops::RangeInclusive<f32> = 1e-4..=1e7;

impl FreeCamera {
    /// The camera that sees what `view` sees, and turns around the point of its axis nearest to `focus`.
    ///
    /// Where `focus` lies behind the camera (or the numbers are not finite) it turns around a point one metre ahead.
    pub fn from_view(view: &View, focus: Vec3) -> FreeCamera {
        let rotation = Quat::from_mat3a(&view.world_from_camera.matrix3).normalize();
        let eye = Vec3::from(view.world_from_camera.translation);
        let ahead = (focus - eye).dot(rotation * Vec3::NEG_Z);
        let distance = if ahead > *DISTANCES.start() { ahead.min(*DISTANCES.end()) } else { 1.0 };
        let target = eye + distance * (rotation * Vec3::NEG_Z);
        FreeCamera { rotation, target, distance, projection: view.projection }
    }

    /// Where it stands and how it projects.
    pub fn view(&self) -> View {
        let eye = self.target - self.distance * self.forward();
        View {
            world_from_camera: Affine3A::from_rotation_translation(self.rotation, eye),
            projection: self.projection,
        }
    }

    /// Turn around the target: `yaw_rad` around the world's y axis (positive: the camera moves to its right),
    /// then `pitch_rad` around the camera's own x axis (positive: it climbs). Keeps target and distance.
    pub fn orbit(&mut self, yaw_rad: f32, pitch_rad: f32) {
        let elevation = (self.rotation * Vec3::Z).y.clamp(-1.0, 1.0).asin();
        // A camera that starts nearer to the pole (a view straight down) may stay, but not go further.
        let limit = STEEPEST_RAD.max(elevation.abs());
        let pitch_rad = (elevation + pitch_rad).clamp(-limit, limit) - elevation;
        let turned =
            Quat::from_rotation_y(yaw_rad) * self.rotation * Quat::from_rotation_x(-pitch_rad);
        self.rotation = turned.normalize();
    }

    /// Move camera and target in the picture plane so that what lies at the target's depth follows a pointer that
    /// moved by `delta_px` (x right, y down) in a picture `height_px` high.
    pub fn pan(&mut self, delta_px: [f32; 2], height_px: f32) {
        let metres_per_px = self.visible_height() / height_px.max(1.0);
        let in_plane = Vec3::new(-delta_px[0], delta_px[1], 0.0) * metres_per_px;
        self.target += self.rotation * in_plane;
    }

    /// Multiply the distance by `factor` (below 1: nearer); an orthographic view narrows instead.
    pub fn zoom(&mut self, factor: f32) {
        match &mut self.projection {
            Projection::Perspective { .. } => self.distance = within_reach(self.distance * factor),
            Projection::Orthographic { ymag } => *ymag = within_reach(*ymag * factor),
        }
    }

    /// Move camera and target by `steps` in the camera's own axes (right, up, backward), in units of the distance
    /// to the target: near things are approached slowly.
    pub fn fly(&mut self, steps: Vec3) {
        self.target += self.rotation * (steps * self.distance);
    }

    fn forward(&self) -> Vec3 {
        self.rotation * Vec3::NEG_Z
    }

    /// Height of what is seen at the target's depth, in metres: 2 · distance · tan(yfov / 2), or 2 · ymag.
    fn visible_height(&self) -> f32 {
        match self.projection {
            Projection::Perspective { yfov_rad } => 2.0 * self.distance * (0.5 * yfov_rad).tan(),
            Projection::Orthographic { ymag } => 2.0 * ymag,
        }
    }
}

fn within_reach(metres: f32) -> f32 {
    metres.clamp(*DISTANCES.start(), *DISTANCES.end())
}

#[cfg(test)]
mod tests {
    use std::f32::consts::FRAC_PI_2;

    use frameless_scene::look_at;

    use super::*;

    const YFOV: f32 = 0.8;

    fn camera() -> FreeCamera {
        let view = View {
            world_from_camera: look_at(Vec3::new(3.0, 2.0, 6.0), Vec3::new(0.0, 1.0, 0.0), Vec3::Y),
            projection: Projection::Perspective { yfov_rad: YFOV },
        };
        FreeCamera::from_view(&view, Vec3::new(0.0, 1.0, 0.0))
    }

    fn eye(camera: &FreeCamera) -> Vec3 {
        camera.view().world_from_camera.translation.into()
    }

    #[track_caller]
    fn assert_close(got: Vec3, want: Vec3) {
        assert!((got - want).length() < 1e-5, "got {got}, want {want}");
    }

    #[test]
    fn taking_over_does_not_move_the_picture() {
        let rolled = Quat::from_euler(glam::EulerRot::YXZ, 1.0, -0.4, 0.7);
        let view = View {
            world_from_camera: Affine3A::from_rotation_translation(
                rolled,
                Vec3::new(1.0, 2.0, 3.0),
            ),
            projection: Projection::Perspective { yfov_rad: YFOV },
        };
        for focus in [Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0), Vec3::splat(1e30), Vec3::NAN] {
            let taken = FreeCamera::from_view(&view, focus).view();
            assert!(taken.world_from_camera.abs_diff_eq(view.world_from_camera, 1e-3), "{focus}");
            assert!(taken.world_from_camera.is_finite());
        }
    }

    #[test]
    fn the_view_matrix_is_look_at() {
        let mut camera = camera();
        camera.orbit(0.6, 0.2);
        let want = look_at(eye(&camera), camera.target, Vec3::Y);
        assert!(camera.view().world_from_camera.abs_diff_eq(want, 1e-5));
    }

    #[test]
    fn orbiting_keeps_target_and_distance() {
        let mut camera = camera();
        let (target, distance) = (camera.target, (eye(&camera) - camera.target).length());
        for i in 0..1000 {
            camera.orbit(0.1, 0.05 * (i as f32).sin());
        }
        assert_eq!(camera.target, target);
        assert!(((eye(&camera) - target).length() - distance).abs() < 1e-4);
    }

    #[test]
    fn a_quarter_turn_in_closed_form() {
        let view = View {
            world_from_camera: look_at(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, Vec3::Y),
            projection: Projection::Perspective { yfov_rad: YFOV },
        };
        let mut camera = FreeCamera::from_view(&view, Vec3::ZERO);
        camera.orbit(FRAC_PI_2, 0.0);
        assert_close(eye(&camera), Vec3::new(5.0, 0.0, 0.0));
        camera.orbit(0.0, 0.5);
        assert_close(eye(&camera), Vec3::new(5.0 * 0.5_f32.cos(), 5.0 * 0.5_f32.sin(), 0.0));
    }

    #[test]
    fn orbiting_stops_before_the_pole() {
        let mut camera = camera();
        for _ in 0..100 {
            camera.orbit(0.0, 0.3);
        }
        let up = camera.rotation * Vec3::Y;
        assert!(up.y > 0.0, "upside down: {up}");
        let elevation = (-camera.forward().y).asin();
        assert!((elevation - STEEPEST_RAD).abs() < 1e-3, "{elevation}");
    }

    #[test]
    fn a_view_straight_down_can_be_taken_over() {
        let view = View {
            world_from_camera: look_at(Vec3::new(0.0, 4.0, 0.0), Vec3::ZERO, Vec3::NEG_Z),
            projection: Projection::Orthographic { ymag: 2.0 },
        };
        let mut camera = FreeCamera::from_view(&view, Vec3::ZERO);
        camera.orbit(0.0, 0.5);
        assert_close(eye(&camera), Vec3::new(0.0, 4.0, 0.0));
        camera.orbit(0.0, -0.5);
        assert!(((eye(&camera)).y - 4.0 * 0.5_f32.cos()).abs() < 1e-4);
    }

    #[test]
    fn panning_moves_the_target_in_the_picture_plane() {
        let mut camera = camera();
        let (before, forward) = (camera, camera.forward());
        camera.pan([30.0, -50.0], 400.0);
        let moved = camera.target - before.target;
        assert!(moved.dot(forward).abs() < 1e-5, "out of the plane by {}", moved.dot(forward));
        assert_eq!(camera.rotation, before.rotation);
        // A point at the target's depth that was under the pointer is still there: the visible height is
        // 2 d tan(yfov/2), so 30 of 400 pixels are that part of it.
        let metres_per_px = 2.0 * before.distance * (0.5 * YFOV).tan() / 400.0;
        let in_camera = before.rotation.inverse() * moved;
        assert_close(in_camera, Vec3::new(-30.0, -50.0, 0.0) * metres_per_px);
    }

    #[test]
    fn zooming_scales_the_distance_and_stays_in_reach() {
        let mut camera = camera();
        let (target, distance) = (camera.target, camera.distance);
        camera.zoom(0.5);
        assert_close(eye(&camera), target - 0.5 * distance * camera.forward());
        for _ in 0..1000 {
            camera.zoom(0.1);
        }
        assert_eq!(camera.distance, *DISTANCES.start());
        assert!(camera.view().world_from_camera.is_finite());
    }

    #[test]
    fn flying_forward_goes_where_the_camera_looks() {
        let mut camera = camera();
        let (start, forward) = (eye(&camera), camera.forward());
        camera.fly(Vec3::new(0.0, 0.0, -0.5));
        assert_close(eye(&camera), start + 0.5 * camera.distance * forward);
    }
}
