//! Another scene, while the present one keeps running.

use std::sync::Arc;

use frameless_scene::{BUILTIN_NAMES, Scene};
use frameless_session::{Command, Helm, Loading, Opener, Outcome};
use tokio::sync::oneshot;

use super::{Event, Hub, Upload, UploadRefused};
use crate::mailbox::Kind;
use crate::settings::quoted;
use crate::wire::Level;

/// A scene being opened, and who waits for it.
pub(super) struct Opening<W> {
    loading: Loading<W>,
    answer: Option<oneshot::Sender<Result<String, UploadRefused>>>,
}

impl<W> Opening<W> {
    /// For the page.
    pub(super) fn describe(&self) -> String {
        format!("{} {}", self.loading.stage, self.loading.name)
    }
}

impl<W: Send + 'static> Hub<W> {
    pub(super) fn open_builtin(&mut self, client: u32, name: &str) {
        // The list, and nothing that the client wrote, says what is opened.
        let Some(name) = BUILTIN_NAMES.into_iter().find(|known| *known == name) else {
            let text = format!("there is no built-in scene {}", quoted(name));
            return self.roster.notice_to(client, Level::Error, text);
        };
        let Some(opener) = self.opener() else {
            let text = "this renderer has but its own scene".to_owned();
            return self.roster.notice_to(client, Level::Error, text);
        };
        if self.opening.is_some() {
            let text = "another scene is being opened; try again then".to_owned();
            return self.roster.notice_to(client, Level::Error, text);
        }
        self.open(name.to_owned(), move |name| opener.open(name), None);
    }

    fn opener(&self) -> Option<Opener> {
        self.scenes.as_ref().map(|scenes| scenes.opener.clone())
    }

    /// Who has that token, if it may send a file now.
    pub(super) fn uploader(&mut self, token: &str) -> Result<u32, UploadRefused> {
        let client = self.roster.with_token(token).ok_or(UploadRefused::Stranger)?;
        self.may_upload(client)?;
        Ok(client)
    }

    fn may_upload(&mut self, client: u32) -> Result<(), UploadRefused> {
        match &self.scenes {
            None => Err(UploadRefused::NoScenes),
            Some(_) if !self.roster.may_act(client) => Err(UploadRefused::NotDriving),
            Some(_) if self.opening.is_some() => Err(UploadRefused::Busy),
            Some(_) => Ok(()),
        }
    }

    pub(super) fn upload(&mut self, upload: Upload) {
        let Upload { client, name, bytes, answer } = upload;
        // It may have lost the helm meanwhile.
        if let Err(refused) = self.may_upload(client) {
            // Fails if the client has gone.
            answer.send(Err(refused)).ok();
            return;
        }
        let opener = self.opener().unwrap_or_default();
        self.open(name, move |name| opener.open_bytes(name, &bytes), Some(answer));
    }

    /// While nothing else is being opened.
    fn open(
        &mut self,
        name: String,
        open: impl FnOnce(&str) -> anyhow::Result<Scene> + Send + 'static,
        answer: Option<oneshot::Sender<Result<String, UploadRefused>>>,
    ) {
        let Some(scenes) = &self.scenes else { return };
        let (prepare, events) = (Arc::clone(&scenes.prepare), self.handle.events.clone());
        let wake = move || drop(events.try_send(Event::Woken));
        match Loading::start(name, open, move |scene| prepare(scene), wake) {
            Ok(loading) => self.opening = Some(Opening { loading, answer }),
            Err(error) => {
                let text = error.to_string();
                if let Some(answer) = answer {
                    // Fails if the client has gone.
                    answer.send(Err(UploadRefused::Bad(text.clone()))).ok();
                }
                self.roster.notice(Level::Error, text);
            }
        }
    }

    pub(super) fn hear_opening(&mut self) {
        let Some(opening) = &mut self.opening else { return };
        let outcome = match opening.loading.poll() {
            Outcome::Running => return,
            Outcome::Failed(text) => {
                self.roster.notice(Level::Error, text.clone());
                Err(UploadRefused::Bad(text))
            }
            Outcome::Ready(scene, world) => {
                let text = format!("opened {}", scene.name);
                self.helm = Helm::new(scene);
                // The new scene begins with its first camera: no view of the old one may follow.
                self.view_changed = false;
                self.render.send(Command::Scene(world));
                self.roster.put(Kind::Scene, &self.scene());
                self.roster.notice(Level::Info, text.clone());
                Ok(text)
            }
        };
        self.act();
        let answer = self.opening.take().and_then(|opening| opening.answer);
        if let Some(answer) = answer {
            // Fails if the client has gone.
            answer.send(outcome).ok();
        }
    }
}
