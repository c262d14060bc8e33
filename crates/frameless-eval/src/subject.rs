//! What is looked at: a scene with the camera and the events of the experiment.

use std::sync::Arc;

use frameless::{Answer, Batch, Lighting, Pose, Request, Size, Surface, Tracer};
use frameless_scene::{Limits, State, View};
use frameless_trace::{Moment, Settings, World};

use crate::camera_path::CameraPath;
use crate::error::EvalError;
use crate::experiment::{EventSpec, SceneSource, SceneSpec};
use crate::script::Script;

/// A scene ready to be traced at any time of the run.
pub struct Subject {
    world: Arc<World>,
    camera: Option<CameraPath>,
    events: Vec<EventSpec>,
    script: Script,
}

impl Subject {
    /// Loads the scene and builds what the tracer needs.
    ///
    /// # Errors
    /// If the scene's file cannot be loaded, or an event speaks of something that the scene does not have.
    pub fn load(spec: &SceneSpec) -> Result<Subject, EvalError> {
        let scene = match &spec.source {
            SceneSource::Builtin(name) => {
                frameless_scene::builtin(name).expect("checked when the experiment was read")
            }
            SceneSource::File(path) => frameless_scene::load(path, &Limits::default())?,
        };
        let script = Script::bind(&spec.events, &scene)
            .map_err(|message| EvalError::Script { scene: spec.name.clone(), message })?;
        Ok(Subject {
            world: Arc::new(World::new(Arc::new(scene))),
            camera: spec.camera.clone(),
            events: spec.events.clone(),
            script,
        })
    }

    /// What happens in this scene, by time.
    pub fn events(&self) -> &[EventSpec] {
        &self.events
    }

    /// The same without one of its events: what there would be if it did not happen.
    pub(crate) fn without_event(&self, index: usize) -> Subject {
        let mut events = self.events.clone();
        events.remove(index);
        let script = Script::bind(&events, self.world.scene()).expect("they were bound before");
        Subject { world: self.world.clone(), camera: self.camera.clone(), events, script }
    }

    /// A renderer of this subject that traces on the calling thread; with `surfaces`, its answers say what was hit.
    pub fn tracer(&self, surfaces: bool) -> SubjectTracer<'_> {
        SubjectTracer { subject: self, moment: self.moment(0.0), surfaces, answer: None }
    }

    /// The whole picture at exactly `secs`, linear RGB, one sample per pixel at its centre: what an
    /// infinitely fast renderer would show.
    pub fn ideal(&self, secs: f64, size: Size) -> Vec<[f32; 3]> {
        let requests: Vec<Request> = (0..size.pixels() as u32).map(Request::centre).collect();
        self.trace(secs, size, &requests)
    }

    /// Linear RGB of any pixels at exactly `secs`.
    pub fn trace(&self, secs: f64, size: Size, requests: &[Request]) -> Vec<[f32; 3]> {
        self.trace_moment(&self.moment(secs), secs, size, requests, false).0
    }

    /// Linear RGB of any pixels at exactly `secs`, and what was hit.
    pub fn trace_surfaces(
        &self,
        secs: f64,
        size: Size,
        requests: &[Request],
    ) -> (Vec<[f32; 3]>, Vec<Surface>) {
        self.trace_moment(&self.moment(secs), secs, size, requests, true)
    }

    /// Where everything is in a picture of `size` at `secs`.
    pub fn pose(&self, secs: f64, size: Size) -> Pose {
        let (moment, mut pose) = (self.moment(secs), Pose::default());
        self.world.pose(&moment, &self.view(moment.state(), secs), size, &mut pose);
        pose
    }

    /// Whether nothing that can be seen differs between two times: neither camera nor object nor light.
    pub fn is_still(&self, a_secs: f64, b_secs: f64) -> bool {
        let (a, b) = (self.state(a_secs), self.state(b_secs));
        let same_state = a.world_from_node == b.world_from_node
            && a.light_intensity == b.light_intensity
            && a.morph_weights == b.morph_weights;
        same_state && self.view(&a, a_secs) == self.view(&b, b_secs)
    }

    fn state(&self, secs: f64) -> State {
        let scene = self.world.scene();
        let mut state = scene.state_at(self.script.scene_secs(secs));
        self.script.apply(secs, scene, &mut state);
        state
    }

    fn moment(&self, secs: f64) -> Moment {
        let mut moment = self.world.moment(self.script.scene_secs(secs));
        self.update_moment(secs, &mut moment);
        moment
    }

    fn update_moment(&self, secs: f64, moment: &mut Moment) {
        let scene_secs = self.script.scene_secs(secs);
        if self.script.leaves_state_alone() {
            return self.world.update_moment(scene_secs, moment);
        }
        self.world.update_moment_with(scene_secs, moment, |state| {
            self.script.apply(secs, self.world.scene(), state);
        });
    }

    fn trace_moment(
        &self,
        moment: &Moment,
        secs: f64,
        size: Size,
        requests: &[Request],
        surfaces: bool,
    ) -> (Vec<[f32; 3]>, Vec<Surface>) {
        let view = self.view(moment.state(), secs);
        let settings = Settings { surfaces, ..Settings::default() };
        self.world.trace_all(moment, &view, size, requests, &settings)
    }

    fn view(&self, state: &State, secs: f64) -> View {
        let view = match &self.camera {
            Some(path) => path.view(self.script.scene_secs(secs)),
            None => self.world.scene().view_at(state, 0),
        };
        self.script.view(secs, view)
    }
}

/// Traces batches of a [`Subject`] on the calling thread: with many runs side by side, one thread each is fastest.
pub struct SubjectTracer<'a> {
    subject: &'a Subject,
    moment: Moment,
    surfaces: bool,
    answer: Option<Answer>,
}

impl Tracer for SubjectTracer<'_> {
    fn submit(&mut self, batch: Batch) {
        let secs = batch.scene_secs;
        self.subject.update_moment(secs, &mut self.moment);
        let (rgb, surfaces) = self.subject.trace_moment(
            &self.moment,
            secs,
            batch.size,
            &batch.requests,
            self.surfaces,
        );
        self.answer = Some(Answer::to(batch, rgb, surfaces));
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        self.answer.take()
    }

    fn pose(&mut self, scene_secs: f64, size: Size, pose: &mut Pose) -> bool {
        self.subject.update_moment(scene_secs, &mut self.moment);
        let view = self.subject.view(self.moment.state(), scene_secs);
        self.subject.world.pose(&self.moment, &view, size, pose);
        true
    }

    fn lighting(&mut self, scene_secs: f64, lighting: &mut Lighting) -> bool {
        self.subject.update_moment(scene_secs, &mut self.moment);
        self.subject.world.lighting(&self.moment, lighting);
        true
    }
}
