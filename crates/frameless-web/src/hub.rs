//! Between the render loop and the clients: one thread that knows the camera, the settings and who drives.
//!
//! Clients tell it what their users do; it tells the loop, and hands every picture worth it to all of them at once. It waits for
//! nobody: the newest picture replaces the one before, whoever has not taken that yet.

mod events;
mod inputs;
mod opening;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use anyhow::bail;
use frameless::Size;
use frameless_session::{
    Command, Drawn, Helm, Picture, PictureSize, RenderThread, Report, Session, Settings, Stage,
    Status,
};
use tokio::sync::{mpsc, watch};

pub(crate) use events::{Event, HubHandle, Joining, Looking, LoopStatus, Upload, UploadRefused};
use inputs::Inputs;
use opening::Opening;

use crate::Secret;
use crate::legend;
use crate::mailbox::Kind;
use crate::roster::Roster;
use crate::settings;
use crate::show::{Scenes, Show};
use crate::tiles::{Occasion, Published, Publisher, Taken};
use crate::wire::{Level, Said, Told};

/// While nothing happens a picture is made this often, in case something does. The first one after something has is made at once.
const CALM_INTERVAL: Duration = Duration::from_millis(50);
/// Nothing that is seen has changed and nobody has done anything for so long.
const CALM_AFTER: Duration = Duration::from_secs(1);
/// After somebody has done something, pictures come as fast as they can for so long.
const HURRIED_FOR: Duration = Duration::from_millis(300);
/// What moves by itself takes so much of each client's link, as long as that leaves 20 pictures per second.
const UNHURRIED_BYTES_PER_SEC: f64 = 600e3;
const LONGEST_UNHURRIED: Duration = Duration::from_millis(50);
/// A client that is told why it may not act is not told again for so long.
const BETWEEN_REFUSALS: Duration = Duration::from_secs(2);

/// Of a scene's cameras, notes and warnings clients are told so many; what waits for a client is bounded.
const MOST_TEXTS: usize = 256;
const LONGEST_TEXT: usize = 300;

/// The beginning of what a file says.
fn shortened(text: &str) -> String {
    match text.char_indices().nth(LONGEST_TEXT) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

/// The thread's state.
pub(crate) struct Hub<W: Send + 'static> {
    render: RenderThread<W>,
    helm: Helm,
    scenes: Option<Scenes<W>>,
    settings: Settings,
    size: Size,
    playing: bool,
    speed: f64,
    scene_secs: f64,
    roster: Roster,
    // The place for the picture in each client's page.
    places: BTreeMap<u32, [u32; 2]>,
    refused: BTreeMap<u32, Instant>,
    inputs: Inputs,
    view_changed: bool,
    settings_changed: bool,
    publisher: Publisher,
    overlay: Option<Drawn>,
    // Memory for the next picture; none while one is being made.
    memory: Option<Vec<[u8; 4]>>,
    acted_at: Instant,
    // When somebody looked last.
    looked_at: Instant,
    rests_after: Duration,
    rests: bool,
    // Between two pictures that nobody waits for.
    unhurried: Duration,
    pictures: watch::Sender<Option<Arc<Published>>>,
    statuses: watch::Sender<LoopStatus>,
    opening: Option<Opening<W>>,
    told: Option<Told>,
    handle: HubHandle,
}

/// Starts the loop and the hub's thread, which ends with [`Event::Stop`] or with the loop. Where nobody looks for `rests_after`, nothing
/// is traced until somebody does.
pub(crate) fn start<S>(
    show: Show<S>,
    rests_after: Duration,
    runtime: tokio::runtime::Handle,
) -> anyhow::Result<(HubHandle, std::thread::JoinHandle<anyhow::Result<()>>)>
where
    S: Stage + Send + 'static,
{
    let (events, inbox) = mpsc::channel(events::MOST_WAITING);
    let (pictures, watched) = watch::channel(None);
    let (statuses, status) = watch::channel(LoopStatus::default());
    let handle = HubHandle {
        events: events.clone(),
        pictures: watched,
        statuses: status,
        painted: Arc::default(),
        moved_bytes: Arc::default(),
        drawn: Arc::default(),
        lookers: Arc::default(),
    };
    let Show { session, helm, scenes } = show;
    let (settings, size) = (*session.settings(), session.size());
    let render = run_loop(session, events)?;
    let hub = Hub {
        render,
        helm,
        scenes,
        settings,
        size,
        playing: true,
        speed: 1.0,
        scene_secs: 0.0,
        roster: Roster::default(),
        places: BTreeMap::new(),
        refused: BTreeMap::new(),
        inputs: Inputs::default(),
        view_changed: true,
        settings_changed: false,
        publisher: Publisher::new(Instant::now()),
        overlay: None,
        memory: Some(Vec::new()),
        acted_at: Instant::now(),
        looked_at: Instant::now(),
        rests_after,
        rests: false,
        unhurried: Duration::ZERO,
        pictures,
        statuses,
        opening: None,
        told: None,
        handle: handle.clone(),
    };
    let thread = std::thread::Builder::new()
        .name("web hub".to_owned())
        .spawn(move || hub.run(inbox, &runtime))?;
    Ok((handle, thread))
}

fn run_loop<S: Stage + Send + 'static>(
    session: Session<S>,
    events: mpsc::Sender<Event>,
) -> std::io::Result<RenderThread<S::World>> {
    // Where the inbox is full the hub looks at the loop's reports after what is in it.
    RenderThread::start(session, move || drop(events.try_send(Event::Woken)))
}

impl<W: Send + 'static> Hub<W> {
    fn run(
        mut self,
        mut inbox: mpsc::Receiver<Event>,
        runtime: &tokio::runtime::Handle,
    ) -> anyhow::Result<()> {
        let ended = loop {
            let wait = self.has_to_do_in();
            let next = runtime.block_on(async {
                match wait {
                    None => inbox.recv().await,
                    // Too long is a second too long for nobody: an event of no news.
                    Some(wait) => {
                        tokio::time::timeout(wait, inbox.recv()).await.unwrap_or(Some(Event::Woken))
                    }
                }
            });
            let mut events = next.into_iter().chain(std::iter::from_fn(|| inbox.try_recv().ok()));
            if events.any(|event| !self.handle_event(event)) {
                break Ok(());
            }
            if let Err(error) = self.hear_loop() {
                self.roster.notice(Level::Error, error.to_string());
                break Err(error);
            }
            self.hear_opening();
            self.rest();
            self.tell_loop();
            self.tell_state();
        };
        self.roster.close();
        ended
    }

    /// False: it is time to end.
    fn handle_event(&mut self, event: Event) -> bool {
        match event {
            Event::Woken => {}
            Event::Stop => return false,
            Event::Join(joining) => self.join(joining),
            Event::Leave(client) => self.leave(client),
            Event::Said(client, said) => self.hear(client, said),
            Event::MayUpload { token, answer } => {
                let uploader = self.uploader(&token);
                // Fails if the client has gone.
                answer.send(uploader).ok();
            }
            Event::Upload(upload) => self.upload(upload),
        }
        true
    }

    fn join(&mut self, joining: Joining) {
        let Joining { client, token, resumes, mailbox } = joining;
        mailbox.put(Kind::Welcome, self.welcome(client, &token).to_json().into());
        mailbox.put(Kind::Scene, self.scene().to_json().into());
        mailbox.put(Kind::Legend, legend::told(self.overlay.as_ref()).to_json().into());
        self.roster.join(client, token, Arc::clone(&mailbox));
        let lost = resumes.and_then(|token| self.roster.with_token(&token));
        if let Some(lost) = lost.filter(|lost| *lost != client) {
            self.roster.succeed(lost, client);
            self.leave(lost);
        }
        mailbox.put(Kind::State, self.state().to_json().into());
        self.act();
    }

    fn leave(&mut self, client: u32) {
        self.roster.leave(client);
        self.places.remove(&client);
        self.refused.remove(&client);
        self.inputs.forget(client);
    }

    /// Somebody does something: the next picture is wanted at once.
    fn act(&mut self) {
        self.acted_at = Instant::now();
    }

    fn hear(&mut self, client: u32, said: Said) {
        match said {
            Said::Size { place } => {
                self.places.insert(client, place);
                self.follow_place();
                return;
            }
            Said::Drive { on: true } => {
                if let Some(before) = self.roster.take(client) {
                    let text = format!("client {client} drives now");
                    self.roster.notice_to(before, Level::Info, text);
                }
                self.follow_place();
                return;
            }
            Said::Drive { on: false } => return self.roster.release(client),
            _ if !self.roster.may_act(client) => return self.refuse(client),
            _ => {}
        }
        self.act();
        let input = said.input();
        self.obey(client, said);
        self.inputs.came(client, input);
    }

    fn obey(&mut self, client: u32, said: Said) {
        match said {
            Said::Camera { orbit, pan, zoom, fly, .. } => {
                self.helm.steer(self.scene_secs, |camera| {
                    inputs::steer(camera, orbit, pan, zoom, fly);
                });
                self.view_changed = true;
            }
            Said::LookThrough { camera, .. } => {
                let cameras = self.helm.scene().cameras.len();
                if (camera as usize) < cameras {
                    self.helm.look_through(camera);
                    self.view_changed = true;
                } else {
                    let text = format!("there is no camera {camera}: the scene has {cameras}");
                    self.roster.notice_to(client, Level::Error, text);
                }
            }
            Said::ComeBack { .. } => {
                self.helm.come_back();
                self.view_changed = true;
            }
            Said::Play { on, .. } => {
                self.playing = on;
                self.render.send(Command::Play(on));
            }
            Said::Seek { secs, .. } => self.render.send(Command::Seek(secs)),
            Said::Speed { speed, .. } => {
                self.speed = speed;
                self.render.send(Command::Speed(speed));
            }
            Said::Settings(change) => match settings::changed(&self.settings, &change) {
                Ok(settings) => {
                    self.settings = settings;
                    self.settings_changed = true;
                    self.follow_place();
                }
                Err(text) => self.roster.notice_to(client, Level::Error, text),
            },
            Said::Open { name } => self.open_builtin(client, &name),
            // Done before.
            Said::Size { .. } | Said::Drive { .. } => {}
        }
    }

    fn refuse(&mut self, client: u32) {
        let now = Instant::now();
        let lately = self.refused.get(&client);
        if lately.is_some_and(|at| now.duration_since(*at) < BETWEEN_REFUSALS) {
            return;
        }
        self.refused.insert(client, now);
        if let Some(driver) = self.roster.driver() {
            let text = format!("client {driver} drives; take the helm first");
            self.roster.notice_to(client, Level::Error, text);
        }
    }

    /// The picture is as large as the driver's page has room for.
    fn follow_place(&mut self) {
        let place = match self.settings.picture {
            // Needs none.
            PictureSize::Fixed(_) => Some([0; 2]),
            _ => self.roster.driver().and_then(|driver| self.places.get(&driver)).copied(),
        };
        let Some(place) = place else { return };
        let size = settings::size_in(&self.settings, place);
        if size != self.size {
            self.size = size;
            self.render.send(Command::Size(size));
            self.act();
        }
    }

    /// What the clients' inputs come to, and a wish for a picture.
    fn tell_loop(&mut self) {
        if std::mem::take(&mut self.settings_changed) {
            self.render.send(Command::Settings(self.settings));
        }
        if std::mem::take(&mut self.view_changed) {
            self.render.send(Command::View(self.helm.view()));
        }
        if let Some(mark) = self.inputs.mark() {
            self.render.send(Command::Mark(mark));
        }
        if self.wants_picture_in() == Some(Duration::ZERO)
            && let Some(memory) = self.memory.take()
        {
            let paint_secs = 1e-9 * self.handle.painted.swap(0, Ordering::Relaxed) as f64;
            self.render.send(Command::WantPicture { memory, paint_secs });
        }
    }

    /// None: nothing before something happens.
    fn has_to_do_in(&self) -> Option<Duration> {
        match self.is_looked_at() {
            true => self.wants_picture_in(),
            false if self.rests => None,
            false => Some(self.rests_after.saturating_sub(self.looked_at.elapsed())),
        }
    }

    fn is_looked_at(&self) -> bool {
        !self.roster.is_empty() || self.handle.lookers.load(Ordering::Relaxed) > 0
    }

    /// Stops the loop once nobody has looked for a while, and starts it as soon as somebody does.
    fn rest(&mut self) {
        if self.is_looked_at() {
            self.looked_at = Instant::now();
        }
        let rests = self.looked_at.elapsed() >= self.rests_after;
        if rests != self.rests {
            self.rests = rests;
            self.render.send(Command::Rest(rests));
        }
    }

    /// None: not before something happens.
    fn wants_picture_in(&self) -> Option<Duration> {
        if self.memory.is_none() || !self.is_looked_at() {
            return None;
        }
        let now = Instant::now();
        let idle = now.duration_since(self.acted_at);
        let is_calm = idle >= CALM_AFTER && self.publisher.quiet_for(now) >= CALM_AFTER;
        let pause = if idle < HURRIED_FOR {
            Duration::ZERO
        } else if is_calm {
            CALM_INTERVAL
        } else {
            self.unhurried
        };
        Some((self.publisher.taken_at() + pause).saturating_duration_since(now))
    }

    fn hear_loop(&mut self) -> anyhow::Result<()> {
        loop {
            match self.render.report() {
                Ok(None) => return Ok(()),
                Ok(Some(Report::Picture(picture))) => self.take(picture),
                Ok(Some(Report::Error(text))) => self.roster.notice(Level::Error, text),
                Err(_) => bail!("the renderer has stopped; please report what you did"),
            }
        }
    }

    fn take(&mut self, picture: Picture) {
        let bytes = self.handle.moved_bytes.swap(0, Ordering::Relaxed);
        if bytes > 0 {
            let wanted = Duration::from_secs_f64(bytes as f64 / UNHURRIED_BYTES_PER_SEC);
            self.unhurried = wanted.min(LONGEST_UNHURRIED);
        }
        self.hear_status(&picture.status);
        let new_input = self.inputs.shown_by(picture.mark);
        let occasion = self.occasion(&picture, new_input);
        let taken = self.publisher.take(picture, self.inputs.shown(), occasion, Instant::now());
        match taken {
            Taken::Same(memory) => self.memory = Some(memory),
            Taken::New(published) => {
                let before = self.pictures.send_replace(Some(published));
                // Its memory, unless a client is still at it.
                let memory = before.and_then(Arc::into_inner).map(|published| published.rgba);
                self.memory = Some(memory.unwrap_or_default());
            }
        }
    }

    /// A renderer that needs seconds for a picture refines none: what is new is shown at once.
    fn occasion(&self, picture: &Picture, new_input: bool) -> Occasion {
        let ends = self.scenes.is_some().then(|| self.helm.scene().animation.duration_secs);
        let stands = !self.playing || ends == Some(0.0);
        let is_fast = picture.status.samples_per_sec >= picture.size.pixels() as f64;
        if new_input {
            Occasion::Input
        } else if stands
            && is_fast
            && self.overlay.is_none()
            && self.acted_at.elapsed() >= HURRIED_FOR
        {
            let drawn = self.handle.drawn.load(Ordering::Relaxed);
            let is_drawn = self.roster.is_empty() || drawn >= self.publisher.last_number();
            Occasion::Refinement { is_drawn }
        } else {
            Occasion::Motion
        }
    }

    fn hear_status(&mut self, status: &Status) {
        self.scene_secs = status.scene_secs;
        if status.overlay != self.overlay {
            self.overlay.clone_from(&status.overlay);
            self.roster.put(Kind::Legend, &legend::told(self.overlay.as_ref()));
        }
        let (status, playing) = (Some(status.clone()), self.playing);
        self.statuses.send_replace(LoopStatus { status, playing });
    }

    fn tell_state(&mut self) {
        let state = self.state();
        if self.told.as_ref() != Some(&state) {
            self.roster.put(Kind::State, &state);
            self.told = Some(state);
        }
    }

    fn welcome(&self, client: u32, token: &Secret) -> Told {
        let upload_bytes = self.scenes.as_ref().map(|scenes| scenes.opener.limits.file_bytes);
        legend::welcome(client, token, upload_bytes, self.settings.own_sampler.is_some())
    }

    fn scene(&self) -> Told {
        let scene = self.helm.scene();
        let name = |(index, camera): (usize, &frameless_scene::Camera)| match &*camera.name {
            "" => format!("camera {index}"),
            name => shortened(&format!("camera {index}: {name}")),
        };
        let some = |texts: &[String]| texts.iter().take(MOST_TEXTS).map(|t| shortened(t)).collect();
        Told::Scene {
            name: shortened(&scene.name),
            notes: some(&scene.notes),
            warnings: some(&scene.warnings),
            // Of a renderer's own scene nobody knows when it ends.
            duration_secs: self.scenes.is_some().then_some(scene.animation.duration_secs),
            cameras: scene.cameras.iter().take(MOST_TEXTS).enumerate().map(name).collect(),
        }
    }

    fn state(&self) -> Told {
        Told::State {
            driver: self.roster.driver(),
            clients: self.roster.len(),
            playing: self.playing,
            speed: self.speed,
            camera: self.helm.through(),
            loading: self.opening.as_ref().map(Opening::describe),
            width: self.size.width,
            height: self.size.height,
            settings: settings::state(&self.settings),
        }
    }
}
