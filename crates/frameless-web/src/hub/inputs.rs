//! Which inputs of which client the pictures show, so that a page can measure how long it takes.

use std::collections::{BTreeMap, VecDeque};

use frameless_session::FreeCamera;
use glam::Vec3;

/// A drag over the picture's height turns by half a circle, as in the window.
const TURN_RAD: f32 = std::f32::consts::PI;

/// Moves the camera by what a client sent.
pub(super) fn steer(
    camera: &mut FreeCamera,
    orbit: [f32; 2],
    pan: [f32; 2],
    zoom: f32,
    fly: [f32; 3],
) {
    // What is left alone stays as it is to the last bit.
    if orbit != [0.0; 2] {
        // The scene follows the pointer, so the camera goes the other way.
        camera.orbit(-TURN_RAD * orbit[0], TURN_RAD * orbit[1]);
    }
    if pan != [0.0; 2] {
        camera.pan(pan, 1.0);
    }
    if zoom != 1.0 {
        camera.zoom(zoom);
    }
    if fly != [0.0; 3] {
        camera.fly(Vec3::from(fly));
    }
}

/// Inputs on their way through the loop.
#[derive(Default)]
pub(super) struct Inputs {
    // Since the last mark.
    came: BTreeMap<u32, u32>,
    marks: u64,
    marked: VecDeque<(u64, BTreeMap<u32, u32>)>,
    shown: BTreeMap<u32, u32>,
}

impl Inputs {
    /// A client's input has been told to the loop, or will be before the next mark.
    pub(super) fn came(&mut self, client: u32, input: u32) {
        if input > 0 {
            self.came.insert(client, input);
        }
    }

    /// The mark that the loop is to be given now, if there were inputs.
    pub(super) fn mark(&mut self) -> Option<u64> {
        if self.came.is_empty() {
            return None;
        }
        self.marks += 1;
        self.marked.push_back((self.marks, std::mem::take(&mut self.came)));
        Some(self.marks)
    }

    /// A picture shows everything up to a mark. Whether that is more than the last one showed.
    pub(super) fn shown_by(&mut self, mark: u64) -> bool {
        let mut more = false;
        while self.marked.front().is_some_and(|(of, _)| *of <= mark) {
            let (_, inputs) = self.marked.pop_front().unwrap_or_default();
            self.shown.extend(inputs);
            more = true;
        }
        more
    }

    /// Pairs of client and its last input that is shown.
    pub(super) fn shown(&self) -> Vec<(u32, u32)> {
        self.shown.iter().map(|(&client, &input)| (client, input)).collect()
    }

    /// The client has gone.
    pub(super) fn forget(&mut self, client: u32) {
        self.shown.remove(&client);
        self.came.remove(&client);
        for (_, inputs) in &mut self.marked {
            inputs.remove(&client);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_is_shown_by_the_first_picture_after_its_mark() {
        let mut inputs = Inputs::default();
        assert_eq!(inputs.mark(), None);
        inputs.came(3, 10);
        inputs.came(3, 11);
        inputs.came(4, 0);
        assert_eq!(inputs.mark(), Some(1));
        inputs.came(3, 12);
        assert_eq!(inputs.mark(), Some(2));
        assert!(!inputs.shown_by(0));
        assert!(inputs.shown_by(1));
        assert_eq!(inputs.shown(), [(3, 11)]);
        inputs.forget(3);
        assert!(inputs.shown_by(7));
        assert!(inputs.shown().is_empty());
    }
}
