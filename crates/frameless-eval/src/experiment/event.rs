//! What happens suddenly: named, so that the time until a picture shows it can be measured.

use glam::Vec3;
use serde::Deserialize;

/// Something that happens at one time, done by the experiment or by the scene itself.
#[derive(Clone, Debug, PartialEq)]
pub struct EventSpec {
    /// After 0 and before the end of the run.
    pub at_secs: f64,
    /// Unique in the scene.
    pub name: String,
    /// `None`: the scene does it by itself.
    pub action: Option<Action>,
}

/// What an experiment does to a scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Something is elsewhere from then on.
    Move {
        /// What.
        what: Mover,
        /// Where to.
        goal: Goal,
        /// How long it takes to get there, at constant speed; 0: at once.
        over_secs: f64,
    },
    /// A light is brighter or darker from then on.
    Light {
        /// Index into the scene's lights.
        index: u32,
        /// Multiplies its intensity; at least 0.
        factor: f32,
    },
    /// The camera stands elsewhere from then on, whatever its path says.
    Cut {
        /// Metres.
        eye: Vec3,
        /// Metres; away from the eye.
        target: Vec3,
    },
    /// The scene's own time and the camera's path stand still from then on; what the experiment does goes on.
    Stop,
}

/// What is moved.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(untagged)]
pub enum Mover {
    /// The light with this index: its node.
    #[serde(skip)]
    Light(u32),
    /// The node with this index.
    NodeIndex(u32),
    /// The node with this name; there must be exactly one.
    NodeName(String),
}

/// Where it is moved, in metres of the world. Its children come along; its own animation goes on around the new place
/// (`By`) or is overridden (`To`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// So far from where it would be.
    By(Vec3),
    /// There.
    To(Vec3),
}

impl EventSpec {
    /// When all of the change is there: an object that moves has arrived.
    pub fn complete_secs(&self) -> f64 {
        match &self.action {
            Some(Action::Move { over_secs, .. }) => self.at_secs + over_secs,
            _ => self.at_secs,
        }
    }
}

/// `[[scenes.events]]` in an experiment file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EventTable {
    at_secs: f64,
    name: String,
    #[serde(rename = "move")]
    movement: Option<MoveTable>,
    light: Option<LightTable>,
    cut: Option<CutTable>,
    #[serde(default)]
    stop: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MoveTable {
    node: Option<Mover>,
    light: Option<u32>,
    by: Option<[f32; 3]>,
    to: Option<[f32; 3]>,
    #[serde(default)]
    over_secs: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LightTable {
    index: u32,
    factor: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CutTable {
    eye: [f32; 3],
    target: [f32; 3],
}

/// The events of a scene by time, or what is wrong with them.
pub(super) fn check_events(
    tables: Vec<EventTable>,
    duration_secs: f64,
) -> Result<Vec<EventSpec>, String> {
    let mut events: Vec<EventSpec> = Vec::new();
    for table in tables {
        let name = table.name.clone();
        let event = table.check(duration_secs).map_err(|e| format!("{name:?}: {e}"))?;
        if events.iter().any(|other| other.name == name) {
            return Err(format!("two are called {name:?}"));
        }
        events.push(event);
    }
    if events.iter().filter(|event| event.action == Some(Action::Stop)).count() > 1 {
        return Err("only one can stop the scene".into());
    }
    events.sort_by(|a, b| a.at_secs.total_cmp(&b.at_secs));
    Ok(events)
}

impl EventTable {
    fn check(self, duration_secs: f64) -> Result<EventSpec, String> {
        if !(self.at_secs > 0.0 && self.at_secs < duration_secs) {
            return Err(format!(
                "at_secs must be after 0 and before the end at {duration_secs}, got {}",
                self.at_secs
            ));
        }
        let mut actions = Vec::new();
        if let Some(table) = self.movement {
            actions.push(table.check()?);
        }
        if let Some(table) = self.light {
            actions.push(table.check()?);
        }
        if let Some(table) = self.cut {
            actions.push(table.check()?);
        }
        if self.stop {
            actions.push(Action::Stop);
        }
        if actions.len() > 1 {
            return Err("an event has at most one of move, light, cut and stop".into());
        }
        let event = EventSpec { at_secs: self.at_secs, name: self.name, action: actions.pop() };
        if event.complete_secs() >= duration_secs {
            return Err(format!("it ends after the run, at {} s", event.complete_secs()));
        }
        Ok(event)
    }
}

impl MoveTable {
    fn check(self) -> Result<Action, String> {
        let what = match (self.node, self.light) {
            (Some(node), None) => node,
            (None, Some(light)) => Mover::Light(light),
            _ => return Err("move needs either node or light".into()),
        };
        let goal = match (self.by, self.to) {
            (Some(by), None) => Goal::By(by.into()),
            (None, Some(to)) => Goal::To(to.into()),
            _ => return Err("move needs either by or to".into()),
        };
        let (Goal::By(v) | Goal::To(v)) = goal;
        if !v.is_finite() || !(0.0..f64::INFINITY).contains(&self.over_secs) {
            return Err("move needs finite numbers and over_secs of at least 0".into());
        }
        Ok(Action::Move { what, goal, over_secs: self.over_secs })
    }
}

impl LightTable {
    fn check(self) -> Result<Action, String> {
        if !(0.0..f32::INFINITY).contains(&self.factor) {
            return Err(format!("factor must be finite and at least 0, got {}", self.factor));
        }
        Ok(Action::Light { index: self.index, factor: self.factor })
    }
}

impl CutTable {
    fn check(self) -> Result<Action, String> {
        let (eye, target) = (Vec3::from(self.eye), Vec3::from(self.target));
        if !eye.is_finite() || !target.is_finite() || eye == target {
            return Err("cut needs finite numbers and a target away from the eye".into());
        }
        Ok(Action::Cut { eye, target })
    }
}
