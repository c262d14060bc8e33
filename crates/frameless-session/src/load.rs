//! Opening another scene while the present one keeps running.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread::Builder;

use frameless_scene::{Environment, Limits, Scene, builtin};

/// How scenes are opened: how much they may ask for, and the light that all of them get.
#[derive(Clone, Default)]
pub struct Opener {
    /// Of each file.
    pub limits: Limits,
    /// Lights every scene that is opened; none: as the file says.
    pub environment: Option<Environment>,
}

impl Opener {
    /// A built-in scene by its name (`./NAME` is a file of that name), or a glTF file.
    ///
    /// # Errors
    /// With what is wrong with the file.
    pub fn open(&self, name: &str) -> anyhow::Result<Scene> {
        match builtin(name) {
            Some(scene) => Ok(self.lit(scene)),
            None => Ok(self.lit(frameless_scene::load(Path::new(name), &self.limits)?)),
        }
    }

    /// What is in a file's bytes, if it names no others.
    ///
    /// # Errors
    /// With what is wrong with the file.
    pub fn open_bytes(&self, name: &str, bytes: &[u8]) -> anyhow::Result<Scene> {
        Ok(self.lit(frameless_scene::load_bytes(name, bytes, None, &self.limits)?))
    }

    /// The scene, lit as all are.
    pub fn lit(&self, mut scene: Scene) -> Scene {
        if let Some(environment) = &self.environment {
            scene.light_by(environment.clone());
        }
        scene
    }
}

/// A scene being read and prepared in a thread of its own. `W` is a scene made ready for the renderer.
pub struct Loading<W> {
    /// What the user asked for.
    pub name: String,
    /// What is being done.
    pub stage: &'static str,
    progress: Receiver<Progress<W>>,
}

enum Progress<W> {
    Stage(&'static str),
    Done(anyhow::Result<(Arc<Scene>, W)>),
}

/// How far it is.
pub enum Outcome<W> {
    /// Not there yet.
    Running,
    /// What was read, and the same ready for the renderer.
    Ready(Arc<Scene>, W),
    /// Why not, for the user.
    Failed(String),
}

impl<W: Send + 'static> Loading<W> {
    /// Begins to `open` what is called `name`, and to `prepare` it for the renderer. `wake` is called whenever there is news.
    ///
    /// # Errors
    /// If the system has no thread left.
    pub fn start(
        name: String,
        open: impl FnOnce(&str) -> anyhow::Result<Scene> + Send + 'static,
        prepare: impl FnOnce(&Arc<Scene>) -> anyhow::Result<W> + Send + 'static,
        wake: impl Fn() + Send + 'static,
    ) -> io::Result<Loading<W>> {
        let (report, progress) = channel();
        let wanted = name.clone();
        Builder::new().name("load scene".to_owned()).spawn(move || {
            let world = open(&wanted).and_then(|scene| {
                report.send(Progress::Stage("building the BVH of")).ok();
                wake();
                let scene = Arc::new(scene);
                let world = prepare(&scene)?;
                Ok((scene, world))
            });
            // Fails if the user has opened something else since.
            report.send(Progress::Done(world)).ok();
            wake();
        })?;
        Ok(Loading { name, stage: "reading", progress })
    }

    /// What has happened since the last call.
    pub fn poll(&mut self) -> Outcome<W> {
        loop {
            match self.progress.try_recv() {
                Ok(Progress::Stage(stage)) => self.stage = stage,
                Ok(Progress::Done(Ok((scene, world)))) => return Outcome::Ready(scene, world),
                Ok(Progress::Done(Err(error))) => {
                    // The loader's errors begin with the file's name, and say all there is in one line.
                    return Outcome::Failed(format!("cannot open {error}"));
                }
                Err(TryRecvError::Empty) => return Outcome::Running,
                // A panic has been printed by then.
                Err(TryRecvError::Disconnected) => {
                    return Outcome::Failed(format!(
                        "cannot open {}: reading it failed unexpectedly; please report this file",
                        self.name
                    ));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use frameless_trace::World;

    use super::*;

    fn outcome(
        open: impl FnOnce(&str) -> anyhow::Result<Scene> + Send + 'static,
    ) -> Outcome<Arc<World>> {
        let prepare = |scene: &Arc<Scene>| Ok(Arc::new(World::new(Arc::clone(scene))));
        let mut loading = Loading::start("x.glb".to_owned(), open, prepare, || {}).unwrap();
        loop {
            match loading.poll() {
                Outcome::Running => std::thread::yield_now(),
                ended => return ended,
            }
        }
    }

    #[test]
    fn a_good_scene_becomes_a_world() {
        let named = |_: &str| Ok(Scene { name: "good".to_owned(), ..Scene::default() });
        let Outcome::Ready(scene, world) = outcome(named) else { panic!("not ready") };
        assert_eq!(scene.name, "good");
        assert!(Arc::ptr_eq(&scene, world.scene()));
    }

    #[test]
    fn built_in_scenes_have_names_and_files_have_paths() {
        let opener = Opener::default();
        assert_eq!(opener.open("sphere").unwrap().name, "sphere");
        let missing = opener.open("./sphere").unwrap_err();
        assert!(missing.to_string().contains("./sphere"), "{missing}");
    }

    #[test]
    fn every_scene_that_is_opened_gets_the_environment_and_keeps_the_limits() {
        let environment = Environment {
            name: "grey".to_owned(),
            width: 1,
            height: 1,
            texels: Arc::new(frameless_scene::Texels::Linear(vec![[0.5; 3]])),
            rotation_rad: 0.0,
            strength: 1.0,
        };
        let limits = Limits { json_values: 3, ..Limits::default() };
        let opener = Opener { environment: Some(environment.clone()), limits };
        assert_eq!(opener.open("sphere").unwrap().environment.as_ref(), Some(&environment));
        let empty = br#"{"asset": {"version": "2.0"}}"#;
        let bare =
            Opener { limits: Limits::default(), ..opener.clone() }.open_bytes("a.gltf", empty);
        assert_eq!(bare.unwrap().environment.as_ref(), Some(&environment));
        let refused = opener.open_bytes("a.gltf", empty).unwrap_err().to_string();
        assert!(refused.contains("limit"), "{refused}");
    }

    #[test]
    fn a_bad_file_and_a_panic_are_both_said() {
        let Outcome::Failed(text) = outcome(|name| anyhow::bail!("{name}: not a glTF file")) else {
            panic!("opened")
        };
        assert_eq!(text, "cannot open x.glb: not a glTF file");
        let Outcome::Failed(text) = outcome(|_| panic!("on purpose")) else { panic!("opened") };
        assert!(text.contains("x.glb") && text.contains("unexpectedly"), "{text}");
    }
}
