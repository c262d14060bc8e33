//! Which scene is looked at, and from where: the state that the user's hands hold, whatever they hold it with.

use std::sync::Arc;

use frameless_scene::{Scene, View};
use glam::Vec3;

use crate::camera::FreeCamera;
use crate::command::ViewChoice;

/// From where the scene is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Looking {
    /// Through one of the scene's cameras, by index.
    Through(u32),
    /// The user has taken the camera.
    Free(FreeCamera),
}

/// A scene and a camera on it. Says what view to ask the render loop for; asks nobody itself.
#[derive(Clone, Debug)]
pub struct Helm {
    scene: Arc<Scene>,
    looking: Looking,
    // Where the user comes back to: the scene's camera that was used last, or the first view where there is no scene.
    home: Looking,
}

impl Helm {
    /// Looks at the scene through its first camera.
    pub fn new(scene: Arc<Scene>) -> Helm {
        Helm { scene, looking: Looking::Through(0), home: Looking::Through(0) }
    }

    /// For a renderer whose scene is not known here: a free camera that begins at `view`, and orbits the point of its axis nearest to
    /// `focus`. [`Helm::scene`] is empty, without any camera.
    pub fn without_scene(view: &View, focus: Vec3) -> Helm {
        let looking = Looking::Free(FreeCamera::from_view(view, focus));
        Helm { scene: Arc::new(Scene::default()), looking, home: looking }
    }

    /// What is looked at.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// From where.
    pub fn looking(&self) -> Looking {
        self.looking
    }

    /// The scene's camera that is looked through; `None` while the user has the camera.
    pub fn through(&self) -> Option<u32> {
        match self.looking {
            Looking::Through(camera) => Some(camera),
            Looking::Free(_) => None,
        }
    }

    /// Look through one of the scene's cameras.
    ///
    /// # Panics
    /// Later, where the view is asked for, if the scene has no camera of that index.
    pub fn look_through(&mut self, camera: u32) -> ViewChoice {
        self.home = Looking::Through(camera);
        self.come_back()
    }

    /// Back to the scene's camera that was used last, or to the first view where there is no scene.
    pub fn come_back(&mut self) -> ViewChoice {
        self.looking = self.home;
        self.view()
    }

    /// What to ask the render loop for now.
    pub fn view(&self) -> ViewChoice {
        match self.looking {
            Looking::Through(camera) => ViewChoice::Camera(camera),
            Looking::Free(camera) => ViewChoice::Free(camera.view()),
        }
    }

    /// Look from a given place, turning around the point of its axis that is nearest to the scene's middle at `scene_secs`.
    pub fn look_from(&mut self, view: &View, scene_secs: f64) -> ViewChoice {
        let camera = FreeCamera::from_view(view, self.focus(scene_secs));
        self.free(camera)
    }

    /// Move the camera. If it is the scene's, the user takes it from where it is at `scene_secs`; the picture does not jump.
    pub fn steer(&mut self, scene_secs: f64, motion: impl FnOnce(&mut FreeCamera)) -> ViewChoice {
        let mut camera = self.taken_camera(scene_secs);
        motion(&mut camera);
        self.free(camera)
    }

    fn free(&mut self, camera: FreeCamera) -> ViewChoice {
        self.looking = Looking::Free(camera);
        self.view()
    }

    fn taken_camera(&self, scene_secs: f64) -> FreeCamera {
        match self.looking {
            Looking::Free(camera) => camera,
            Looking::Through(camera) => {
                let state = self.scene.state_at(scene_secs);
                let view = self.scene.view_at(&state, camera);
                FreeCamera::from_view(&view, self.focus(scene_secs))
            }
        }
    }

    fn focus(&self, scene_secs: f64) -> Vec3 {
        let state = self.scene.state_at(scene_secs);
        self.scene.bounds_at(&state).map_or(Vec3::ZERO, |bounds| bounds.centre())
    }
}

#[cfg(test)]
mod tests {
    use frameless_scene::builtin;

    use super::*;

    fn helm() -> Helm {
        Helm::new(Arc::new(builtin("orbit").expect("built in")))
    }

    #[test]
    fn a_moving_camera_is_taken_where_it_is() {
        let mut helm = helm();
        let ViewChoice::Free(taken) = helm.steer(1.5, |_| {}) else { panic!("not taken") };
        let scene = Arc::clone(helm.scene());
        let want = scene.view_at(&scene.state_at(1.5), 0);
        assert!(taken.world_from_camera.abs_diff_eq(want.world_from_camera, 1e-3));
        assert_eq!(helm.through(), None);
        let ViewChoice::Free(later) = helm.steer(2.0, |_| {}) else { panic!("given back") };
        assert_eq!(later, taken, "it stays where the user has put it");
    }

    #[test]
    fn the_user_comes_back_to_the_camera_used_last() {
        let mut helm = helm();
        assert_eq!(helm.look_through(0), ViewChoice::Camera(0));
        helm.steer(0.0, |camera| camera.zoom(0.5));
        assert_eq!(helm.come_back(), ViewChoice::Camera(0));
        assert_eq!(helm.through(), Some(0));
    }

    #[test]
    fn without_a_scene_the_user_comes_back_to_the_first_view() {
        let view = helm().scene().view_at(&helm().scene().state_at(0.3), 0);
        let mut helm = Helm::without_scene(&view, Vec3::ZERO);
        let first = helm.view();
        assert!(helm.scene().cameras.is_empty());
        assert_ne!(helm.steer(0.0, |camera| camera.orbit(0.5, 0.1)), first);
        assert_eq!(helm.come_back(), first);
        assert_eq!(helm.through(), None);
    }

    #[test]
    fn a_given_place_is_where_it_looks_from() {
        let mut helm = helm();
        let view = helm.scene().view_at(&helm.scene().state_at(0.7), 0);
        let ViewChoice::Free(there) = helm.look_from(&view, 0.0) else { panic!("not free") };
        assert!(there.world_from_camera.abs_diff_eq(view.world_from_camera, 1e-3));
    }
}
