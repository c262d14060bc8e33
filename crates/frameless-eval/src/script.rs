//! Scripted events at work: the scene's own state, and then what the experiment does to it.

use frameless_scene::{Scene, State, View, look_at};
use glam::{Affine3A, Vec3};

use crate::experiment::{Action, EventSpec, Goal, Mover};

/// An event that lies this little ahead has happened: times are rounded to nanoseconds, some of them down.
const TOLERANCE_SECS: f64 = 1e-9;

/// The events of a scene, bound to its nodes and lights.
#[derive(Clone, Debug, Default)]
pub(crate) struct Script {
    /// From when on the scene's own time stands still.
    stop_secs: Option<f64>,
    /// Where the camera stands from when on, by time.
    cuts: Vec<(f64, Affine3A)>,
    /// By time.
    changes: Vec<Change>,
}

#[derive(Clone, Copy, Debug)]
struct Change {
    at_secs: f64,
    what: What,
}

#[derive(Clone, Copy, Debug)]
enum What {
    Move { node: u32, goal: Goal, over_secs: f64 },
    Dim { light: u32, factor: f32 },
}

impl Script {
    /// Finds the nodes and lights that the events (by time) speak of.
    ///
    /// # Errors
    /// Which event speaks of something that the scene does not have.
    pub(crate) fn bind<'a>(
        events: impl IntoIterator<Item = &'a EventSpec>,
        scene: &Scene,
    ) -> Result<Script, String> {
        let mut script = Script::default();
        for event in events {
            script.add(event, scene).map_err(|e| format!("event {:?}: {e}", event.name))?;
        }
        Ok(script)
    }

    fn add(&mut self, event: &EventSpec, scene: &Scene) -> Result<(), String> {
        let at_secs = event.at_secs;
        let what = match &event.action {
            None => return Ok(()),
            Some(Action::Stop) => {
                self.stop_secs = Some(at_secs);
                return Ok(());
            }
            Some(Action::Cut { eye, target }) => {
                self.cuts.push((at_secs, look_at(*eye, *target, Vec3::Y)));
                return Ok(());
            }
            Some(Action::Light { index, factor }) => {
                light_node(scene, *index)?;
                What::Dim { light: *index, factor: *factor }
            }
            Some(Action::Move { what, goal, over_secs }) => {
                What::Move { node: node(scene, what)?, goal: *goal, over_secs: *over_secs }
            }
        };
        self.changes.push(Change { at_secs, what });
        Ok(())
    }

    /// The scene's own time at `secs`.
    pub(crate) fn scene_secs(&self, secs: f64) -> f64 {
        self.stop_secs.map_or(secs, |stop| secs.min(stop))
    }

    /// Whether nothing but the scene's own time decides what there is.
    pub(crate) fn leaves_state_alone(&self) -> bool {
        self.changes.is_empty()
    }

    /// Does to `state`, the scene's own at [`Script::scene_secs`], what has happened until `secs`.
    pub(crate) fn apply(&self, secs: f64, scene: &Scene, state: &mut State) {
        for change in self.changes.iter().take_while(|change| has_come(change.at_secs, secs)) {
            match change.what {
                What::Dim { light, factor } => state.light_intensity[light as usize] *= factor,
                What::Move { node, goal, over_secs } => {
                    let since = (secs - change.at_secs).max(0.0);
                    let part = if since < over_secs { since / over_secs } else { 1.0 };
                    move_node(scene, state, node, goal, part as f32);
                }
            }
        }
    }

    /// The view at `secs` of a camera whose own path has led it to `view`.
    pub(crate) fn view(&self, secs: f64, view: View) -> View {
        let cut = self.cuts.iter().rev().find(|(at_secs, _)| has_come(*at_secs, secs));
        match cut {
            Some(&(_, world_from_camera)) => View { world_from_camera, ..view },
            None => view,
        }
    }
}

fn has_come(at_secs: f64, secs: f64) -> bool {
    secs + TOLERANCE_SECS >= at_secs
}

/// Moves a node the `part` in [0, 1] of its way. A node whose parent is flattened to nothing stays where it is: no place within
/// the parent is at the goal.
fn move_node(scene: &Scene, state: &mut State, node: u32, goal: Goal, part: f32) {
    let parent = scene.nodes[node as usize].parent;
    let world_from_parent =
        parent.map_or(Affine3A::IDENTITY, |parent| state.world_from_node[parent as usize]);
    let here = Vec3::from(state.world_from_node[node as usize].translation);
    let there = match goal {
        Goal::By(by) => here + by * part,
        Goal::To(to) => here.lerp(to, part),
    };
    let place = world_from_parent.inverse().transform_point3(there);
    if place.is_finite() {
        state.parent_from_node[node as usize].translation = place;
        scene.compose_world(state);
    }
}

fn node(scene: &Scene, mover: &Mover) -> Result<u32, String> {
    let count = scene.nodes.len() as u32;
    match mover {
        Mover::Light(light) => light_node(scene, *light),
        Mover::NodeIndex(index) if *index < count => Ok(*index),
        Mover::NodeIndex(index) => Err(format!("there is no node {index}, only {count} nodes")),
        Mover::NodeName(name) => {
            let named = |i: &u32| scene.nodes[*i as usize].name == *name;
            match (0..count).filter(named).collect::<Vec<_>>().as_slice() {
                [] => Err(format!("there is no node {name:?}, but: {}", names(scene))),
                [index] => Ok(*index),
                several => Err(format!(
                    "{} nodes are called {name:?}; name one by its index, among {several:?}",
                    several.len()
                )),
            }
        }
    }
}

fn light_node(scene: &Scene, light: u32) -> Result<u32, String> {
    let found = scene.lights.get(light as usize).map(|light| light.node);
    found.ok_or_else(|| format!("there is no light {light}, only {} lights", scene.lights.len()))
}

/// The first few names of nodes, as a help.
fn names(scene: &Scene) -> String {
    const SHOWN: usize = 20;
    let mut names: Vec<&str> = scene.nodes.iter().map(|node| node.name.as_str()).collect();
    names.retain(|name| !name.is_empty());
    let rest = names.len().saturating_sub(SHOWN);
    names.truncate(SHOWN);
    let list = names.join(", ");
    if rest > 0 { format!("{list} and {rest} more") } else { list }
}

#[cfg(test)]
mod tests {
    use frameless_scene::{Node, Transform};
    use glam::Quat;

    use super::*;

    /// A child in a parent that is turned, scaled and elsewhere.
    fn family(parent_scale: Vec3) -> Scene {
        let parent = Transform {
            translation: Vec3::new(5.0, 0.0, 0.0),
            rotation: Quat::from_rotation_y(1.0),
            scale: parent_scale,
        };
        let child = Transform { translation: Vec3::Y, ..Transform::IDENTITY };
        let node = |name: &str, parent, rest| Node { name: name.into(), parent, rest };
        let nodes = vec![node("parent", None, parent), node("child", Some(0), child)];
        Scene { nodes, ..Scene::default() }
    }

    fn state_after(scene: &Scene, name: &str, goal: Goal) -> State {
        let what = Mover::NodeName(name.into());
        let action = Some(Action::Move { what, goal, over_secs: 0.0 });
        let event = EventSpec { at_secs: 1.0, name: "it".into(), action };
        let script = Script::bind([&event], scene).expect("the node is there");
        let mut state = scene.state_at(2.0);
        script.apply(2.0, scene, &mut state);
        state
    }

    #[test]
    fn goals_are_in_the_world_and_children_come_along() {
        let scene = family(Vec3::new(2.0, 3.0, 2.0));
        let place =
            |state: &State, node: usize| Vec3::from(state.world_from_node[node].translation);
        let (before, by) = (scene.state_at(2.0), Vec3::new(0.0, 0.0, 1.0));
        for node in [0, 1] {
            let name = ["parent", "child"][node];
            let to = Vec3::new(1.0, 2.0, 3.0);
            assert!((place(&state_after(&scene, name, Goal::To(to)), node) - to).length() < 1e-5);
            let moved = state_after(&scene, name, Goal::By(by));
            assert!((place(&moved, node) - place(&before, node) - by).length() < 1e-5);
        }
        let moved = state_after(&scene, "parent", Goal::By(by));
        assert!((place(&moved, 1) - place(&before, 1) - by).length() < 1e-5, "the child stayed");
    }

    #[test]
    fn in_a_parent_that_is_flattened_nothing_moves() {
        let scene = family(Vec3::new(1.0, 0.0, 1.0));
        let moved = state_after(&scene, "child", Goal::By(Vec3::Y));
        assert_eq!(moved.world_from_node, scene.state_at(2.0).world_from_node);
    }
}
