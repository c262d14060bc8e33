//! Mouse and keys → the camera.

use eframe::egui::{InputState, Key, PointerButton, Response, Vec2};
use glam::Vec3;

use frameless_session::FreeCamera;

/// What the user's hands did since the last refresh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Motion {
    /// Left drag, in points.
    orbit: Vec2,
    /// Right or middle drag, in points.
    pan: Vec2,
    /// Factor on the distance; 1: none.
    zoom: f32,
    /// Right, up, backward, in units of the distance to the target.
    fly: Vec3,
}

// A drag over the picture's height turns by half a circle.
const TURN_RAD: f32 = std::f32::consts::PI;
// A notch of the wheel is about 50 points: a fifth nearer.
const ZOOM_PER_POINT: f32 = 0.004;
// Distances to the target per second, slow and with shift.
const FLY_PER_SEC: [f32; 2] = [0.8, 3.0];
// A stall must not become a leap.
const LONGEST_STEP_SECS: f32 = 0.1;

impl Motion {
    const STILL: Motion = Motion { orbit: Vec2::ZERO, pan: Vec2::ZERO, zoom: 1.0, fly: Vec3::ZERO };

    /// Of the pointer on the picture and, while no text is being typed, of the keys.
    pub(crate) fn read(picture: &Response, keys: bool) -> Motion {
        let mut motion = Motion::STILL;
        // A response asks the context for the input itself: never within `input`, whose lock it would wait for.
        if picture.dragged_by(PointerButton::Primary) {
            motion.orbit = picture.drag_delta();
        } else if picture.dragged_by(PointerButton::Secondary)
            || picture.dragged_by(PointerButton::Middle)
        {
            motion.pan = picture.drag_delta();
        }
        let hovered = picture.hovered();
        picture.ctx.input(|input| {
            if hovered {
                let points = input.smooth_scroll_delta().y;
                motion.zoom = (-points * ZOOM_PER_POINT).exp() / input.zoom_delta();
            }
            if keys && !input.modifiers.command {
                motion.fly = flight(input);
            }
        });
        motion
    }

    /// Whether nothing moved.
    pub(crate) fn is_still(&self) -> bool {
        *self == Motion::STILL
    }

    /// Moves the camera of a picture drawn `height` points high.
    pub(crate) fn apply(&self, camera: &mut FreeCamera, height: f32) {
        if self.orbit != Vec2::ZERO {
            // The scene follows the pointer, so the camera goes the other way.
            let rad = self.orbit * (TURN_RAD / height.max(1.0));
            camera.orbit(-rad.x, rad.y);
        }
        if self.pan != Vec2::ZERO {
            camera.pan([self.pan.x, self.pan.y], height);
        }
        if self.zoom != 1.0 {
            camera.zoom(self.zoom);
        }
        if self.fly != Vec3::ZERO {
            camera.fly(self.fly);
        }
    }
}

fn flight(input: &InputState) -> Vec3 {
    let axis =
        |more, less| f32::from(i8::from(input.key_down(more)) - i8::from(input.key_down(less)));
    let per_sec = FLY_PER_SEC[usize::from(input.modifiers.shift)];
    let step = per_sec * input.stable_dt.min(LONGEST_STEP_SECS);
    step * Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::S, Key::W))
}

#[cfg(test)]
mod tests {
    use frameless_scene::{Projection, View, look_at};

    use super::*;

    fn camera() -> FreeCamera {
        let view = View {
            world_from_camera: look_at(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, Vec3::Y),
            projection: Projection::Perspective { yfov_rad: 0.8 },
        };
        FreeCamera::from_view(&view, Vec3::ZERO)
    }

    /// Where a world point is in the camera: right, up.
    fn seen(camera: &FreeCamera, point: Vec3) -> (f32, f32) {
        let at = camera.view().world_from_camera.inverse().transform_point3(point);
        (at.x, at.y)
    }

    #[test]
    fn the_front_of_the_scene_follows_a_left_drag() {
        let front = Vec3::Z;
        let mut right = camera();
        Motion { orbit: Vec2::new(20.0, 0.0), ..Motion::STILL }.apply(&mut right, 400.0);
        assert!(seen(&right, front).0 > 0.01);
        let mut down = camera();
        Motion { orbit: Vec2::new(0.0, 20.0), ..Motion::STILL }.apply(&mut down, 400.0);
        assert!(seen(&down, front).1 < -0.01);
    }

    #[test]
    fn the_scene_follows_a_right_drag() {
        let mut moved = camera();
        Motion { pan: Vec2::new(20.0, 10.0), ..Motion::STILL }.apply(&mut moved, 400.0);
        let (x, y) = seen(&moved, Vec3::ZERO);
        assert!(x > 0.01 && y < -0.01, "{x} {y}");
    }

    #[test]
    fn nothing_moves_by_itself() {
        let mut still = camera();
        Motion::STILL.apply(&mut still, 400.0);
        assert_eq!(still, camera());
        assert!(Motion::STILL.is_still());
    }
}
