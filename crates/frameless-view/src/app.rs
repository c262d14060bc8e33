//! The window: joins pictures, panel, camera and messages. Knows the render loop only through its channels.

use std::sync::Arc;

use eframe::egui::{self, Align2, CentralPanel, Context, Key, Panel, Rect, Sense, Ui};
use eframe::egui_wgpu::RenderState;
use eframe::wgpu::DeviceType;
use frameless::{Clock, Size};
use frameless_scene::Scene;
use frameless_session::{
    Command, Drawn, Helm, Loading, Outcome, Overlay, Picture, RenderThread, Report, Session,
    Settings, Status, snapshot,
};
use frameless_trace::{CpuTracer, ViewSource, World};

use crate::hud::{self, Line};
use crate::messages::Messages;
use crate::navigation::Motion;
use crate::panel::{self, PanelState, Wish};
use crate::picture::{PictureTexture, lay_out};
use crate::timed::Timed;
use crate::transport::Transport;
use crate::{ViewOptions, help, legend, theme};

pub(crate) struct App {
    helm: Helm,
    settings: Settings,
    transport: Transport,
    panel: PanelState,
    panels_shown: bool,
    help_shown: bool,
    render: RenderThread<Arc<World>>,
    target: RenderState,
    texture: PictureTexture,
    // None until the first picture.
    status: Option<Status>,
    // What the loop has been asked for already.
    sent_settings: Settings,
    sent_size: Size,
    loading: Option<Loading<Arc<World>>>,
    messages: Messages,
    save_next: bool,
    timed: Timed,
    options: ViewOptions,
}

// The loop wakes the window for every picture; this is for when it has stopped, and for the spinner.
const WAKE_AT_LEAST_SECS: f32 = 0.25;

// One for each overlay.
const DIGITS: [Key; 7] =
    [Key::Num0, Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6];

impl App {
    /// Starts the render loop.
    ///
    /// # Errors
    /// If there is no graphics device or no thread.
    pub(crate) fn new(
        context: &eframe::CreationContext<'_>,
        world: Arc<World>,
        options: ViewOptions,
    ) -> anyhow::Result<App> {
        theme::apply(&context.egui_ctx);
        let target = context.wgpu_render_state.clone();
        let target = target.ok_or_else(|| anyhow::anyhow!("there is no graphics device"))?;
        let settings = options.settings;
        let tracer = CpuTracer::new(
            Arc::clone(&world),
            ViewSource::Camera(0),
            options.tracing,
            options.threads,
        )
        .in_real_time();
        let size = settings.picture.size_in(options.window.map(|side| side as u32));
        let session = Session::new(size, Clock::real(), settings, options.seed, tracer)
            .with_refresh_threads(options.threads);
        let window = context.egui_ctx.clone();
        let render = RenderThread::start(session, move || window.request_repaint())?;
        render.send(Command::WantPicture { memory: Vec::new(), paint_secs: 0.0 });
        Ok(App {
            helm: Helm::new(Arc::clone(world.scene())),
            settings,
            transport: Transport::default(),
            panel: PanelState::default(),
            panels_shown: true,
            help_shown: false,
            render,
            texture: PictureTexture::new(&target),
            target,
            status: None,
            sent_settings: settings,
            sent_size: size,
            loading: None,
            messages: Messages::default(),
            save_next: false,
            timed: Timed::new(&options),
            options,
        })
    }

    /// Takes what the render loop has sent, and asks for the next picture.
    fn receive(&mut self, now_secs: f64, paint_secs: f64) {
        loop {
            match self.render.report() {
                Ok(None) => return,
                Ok(Some(Report::Picture(picture))) => self.take_picture(picture, paint_secs),
                Ok(Some(Report::Error(text))) => self.messages.error(text, now_secs),
                Err(_) => {
                    let text = "the renderer has stopped; please report what you did";
                    self.messages.error(text.to_owned(), now_secs);
                    return;
                }
            }
        }
    }

    fn take_picture(&mut self, picture: Picture, paint_secs: f64) {
        self.texture.upload(&self.target, &picture);
        if std::mem::take(&mut self.save_next) {
            let folder = self.options.save_to.clone();
            let (scene, size, rgba) =
                (self.helm.scene().name.clone(), picture.size, picture.rgba.clone());
            // Compressing takes longer than a refresh.
            self.messages.later(move || {
                snapshot::save_numbered(&folder, &scene, size, &rgba)
                    .map(|path| format!("saved {}", path.display()))
            });
        }
        self.timed.shown(&picture.status, paint_secs);
        self.status = Some(picture.status);
        self.render.send(Command::WantPicture { memory: picture.rgba, paint_secs });
    }

    /// What the last paint cost, without waiting for the display.
    fn paint_secs(&self, context: &Context, frame: &eframe::Frame) -> f64 {
        let toolkit = f64::from(frame.info().cpu_usage.unwrap_or(0.0));
        let window_px = context.content_rect().size() * context.pixels_per_point();
        match self.target.adapter.get_info().device_type {
            DeviceType::Cpu => toolkit + software_paint_secs(f64::from(window_px.x * window_px.y)),
            _ => toolkit,
        }
    }

    /// Begins to open a scene; what was being opened before is forgotten.
    fn open(&mut self, name: String, context: &Context, now_secs: f64) {
        let window = context.clone();
        let wake = move || window.request_repaint();
        let opener = self.options.opener.clone();
        let limits = opener.limits.clone();
        let open = move |name: &str| opener.open(name);
        let prepare = move |scene: &Arc<Scene>| {
            Ok(Arc::new(World::open(&scene.name, Arc::clone(scene), &limits)?))
        };
        match Loading::start(name, open, prepare, wake) {
            Ok(loading) => self.loading = Some(loading),
            Err(error) => self.messages.error(error.to_string(), now_secs),
        }
    }

    fn receive_loaded(&mut self, now_secs: f64) {
        match self.loading.as_mut().map(Loading::poll) {
            None | Some(Outcome::Running) => return,
            Some(Outcome::Failed(text)) => self.messages.error(text, now_secs),
            Some(Outcome::Ready(scene, world)) => {
                self.messages.info(format!("opened {}", scene.name), now_secs);
                self.helm = Helm::new(scene);
                self.render.send(Command::Scene(world));
            }
        }
        self.loading = None;
    }

    fn scene_secs(&self) -> f64 {
        self.status.as_ref().map_or(0.0, |status| status.scene_secs)
    }

    fn steer(&mut self, motion: &Motion, height: f32) {
        if motion.is_still() {
            return;
        }
        let scene_secs = self.scene_secs();
        let view = self.helm.steer(scene_secs, |camera| motion.apply(camera, height));
        self.render.send(Command::View(view));
    }

    fn come_back(&mut self) {
        let view = self.helm.come_back();
        self.render.send(Command::View(view));
    }

    fn keys(&mut self, context: &Context) {
        let pressed = |key| context.input(|input| input.key_pressed(key));
        if pressed(Key::F12) {
            self.save_next = true;
        }
        if pressed(Key::Escape) {
            self.help_shown = false;
            self.messages.clear();
        }
        if context.egui_wants_keyboard_input() {
            return;
        }
        if pressed(Transport::KEY) {
            let command = self.transport.toggle();
            self.render.send(command);
        }
        if pressed(Key::H) || pressed(Key::Questionmark) {
            self.help_shown = !self.help_shown;
        }
        if pressed(Key::P) {
            self.panels_shown = !self.panels_shown;
        }
        if pressed(Key::Home) {
            self.come_back();
        }
        for (key, overlay) in DIGITS.into_iter().zip(Overlay::ALL) {
            if pressed(key) {
                self.settings.overlay = overlay;
            }
        }
    }

    fn dropped_files(&mut self, context: &Context, now_secs: f64) {
        let dropped = context.input(|input| {
            input.raw.dropped_files.first().map(|file| file.path().to_string_lossy().into_owned())
        });
        if let Some(path) = dropped {
            self.open(path, context, now_secs);
        }
    }

    fn panels(&mut self, ui: &mut Ui, now_secs: f64) {
        if !self.panels_shown {
            return;
        }
        let camera = self.helm.through();
        let frame = theme::panel_frame();
        let side = Panel::right("settings").exact_size(272.0).resizable(false).frame(frame);
        let wish = side.show(ui, |ui| {
            panel::show(ui, &mut self.panel, &mut self.settings, self.helm.scene(), camera)
        });
        match wish.inner {
            None => {}
            Some(Wish::Camera(camera)) => {
                let view = self.helm.look_through(camera);
                self.render.send(Command::View(view));
            }
            Some(Wish::Open(name)) => self.open(name, ui.ctx(), now_secs),
            Some(Wish::Save) => self.save_next = true,
            Some(Wish::Help) => self.help_shown = !self.help_shown,
        }
        let scene_secs = self.scene_secs();
        let duration_secs = self.helm.scene().animation.duration_secs;
        let bar = Panel::bottom("time").resizable(false).frame(frame);
        let commands = bar.show(ui, |ui| self.transport.show(ui, scene_secs, duration_secs));
        commands.inner.into_iter().for_each(|command| self.render.send(command));
    }

    fn picture(&mut self, ui: &mut Ui, now_secs: f64) {
        let place = ui.max_rect();
        let response = ui.interact(place, ui.scope_id().with("picture"), Sense::click_and_drag());
        let pixels_per_point = ui.pixels_per_point();
        let place_px = place.size() * pixels_per_point;
        self.send_size(self.settings.picture.size_in([place_px.x as u32, place_px.y as u32]));
        if response.double_clicked() {
            self.come_back();
        }
        let size = self.texture.size().unwrap_or(self.sent_size);
        let drawn = lay_out(place, size, pixels_per_point);
        let keys = !ui.ctx().egui_wants_keyboard_input();
        let motion = Motion::read(&response, keys);
        self.steer(&motion, drawn.height());
        self.texture.paint(ui.painter(), drawn);
        self.write_over(ui, place.shrink(10.0), now_secs);
    }

    fn send_size(&mut self, size: Size) {
        if size != self.sent_size {
            self.sent_size = size;
            self.render.send(Command::Size(size));
        }
    }

    /// HUD, messages, and the overlay's legend.
    fn write_over(&mut self, ui: &mut Ui, place: Rect, now_secs: f64) {
        let painter = ui.painter();
        let mut free = place;
        if let Some(status) = &self.status {
            let size = self.texture.size().unwrap_or(self.sent_size);
            let lines = hud::lines(status, size, self.helm.scene());
            let lines: Vec<Line> = lines.into_iter().map(Line::plain).collect();
            free = hud::below(free, hud::paint(painter, Align2::LEFT_TOP, free, &lines));
            match &status.overlay {
                Some(Drawn::HeatMap(legend)) => legend::paint(painter, place.expand(10.0), legend),
                Some(Drawn::Unknown) => {
                    let name = self.settings.sampler.name();
                    let overlay = self.settings.overlay.name();
                    let text = format!("sampler {name} has no {overlay}; adaptive has");
                    let line = [Line::plain(text)];
                    hud::paint(painter, Align2::LEFT_BOTTOM, place, &line);
                }
                None => {}
            }
        }
        let messages = self.messages.lines(now_secs);
        if !messages.is_empty() {
            free = hud::below(free, hud::paint(painter, Align2::LEFT_TOP, free, &messages));
        }
        if let Some(loading) = &self.loading {
            let text = format!("    {} {} …", loading.stage, loading.name);
            let line = [Line::plain(text)];
            let area = hud::paint(painter, Align2::LEFT_TOP, free, &line);
            let middle = area.left_center() + egui::vec2(18.0, 0.0);
            let spinner = Rect::from_center_size(middle, egui::vec2(14.0, 14.0));
            ui.put(spinner, egui::Spinner::new().size(14.0));
        }
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut Ui, frame: &mut eframe::Frame) {
        let context = ui.ctx().clone();
        let now_secs = context.input(|input| input.time);
        let paint_secs = self.paint_secs(&context, frame);
        self.receive(now_secs, paint_secs);
        self.receive_loaded(now_secs);
        self.messages.receive(now_secs);
        self.dropped_files(&context, now_secs);
        self.keys(&context);
        self.panels(ui, now_secs);
        let bare = egui::Frame::NONE;
        CentralPanel::default().frame(bare).show(ui, |ui| self.picture(ui, now_secs));
        if self.help_shown {
            help::show(&context, &mut self.help_shown);
        }
        if self.settings != self.sent_settings {
            self.sent_settings = self.settings;
            self.render.send(Command::Settings(self.settings));
        }
        self.timed.act(&context, now_secs);
        context.request_repaint_after_secs(WAKE_AT_LEAST_SECS);
    }

    /// Behind everything: clearing is free, painting rectangles is not where a CPU does it.
    fn clear_color(&self, _: &egui::Visuals) -> [f32; 4] {
        theme::GROUND.to_normalized_gamma_f32()
    }

    fn on_exit(&mut self) {
        self.timed.summarise();
    }
}

/// What a software driver spends on a window of so many pixels, in seconds of all its threads: the toolkit's clock does
/// not see them. Measured with lavapipe: 19 ms for 1280 × 800, panel and picture shown.
fn software_paint_secs(window_px: f64) -> f64 {
    19e-9 * window_px
}
