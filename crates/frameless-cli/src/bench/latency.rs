//! Input: how long it takes until the first pixel of the canvas shows it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use frameless::{Answer, Batch, Clock, Lighting, Pose, Rng, Size, Surface, Time, Tracer};
use frameless_scene::{Limits, View};
use frameless_session::{
    Command, RenderThread, Report, Session, Settings, Stage, Steering, ViewChoice,
};
use frameless_trace::{CpuTracer, ViewSource, World};
use glam::{Affine3A, Vec3A};

use super::table::Row;
use crate::args::BenchArgs;
use crate::failure::Failure;
use crate::input;

/// Until the loop has learned how fast the renderer is, and there is a picture.
const WARM_UP_SECS: f64 = 1.0;
/// From one input to the next, drawn evenly: no pace that a loop could fall into step with.
const PAUSE_MS: [f32; 2] = [4.0, 40.0];
/// So far the camera is turned: nearly everything is somewhere else then.
const TURN_RAD: f32 = 0.1;
/// Longer, and the loop has stopped.
const PATIENCE: Duration = Duration::from_secs(10);

/// Rows `latency.p50_ms` and `latency.p99_ms`: from a camera command, sent from another thread at any moment, until the first sample that
/// was traced with the new camera has been kept, in a scene that stands still; with all that the window shows but without pictures. `latency.with_pictures.p50_ms` and
/// `.p99_ms`: the same while pictures are made, at the rate of a display, as for window and page; `.pictures_per_sec`: how many those were.
/// `….samples_per_sec`: how many samples were kept meanwhile.
///
/// The percentiles are of all inputs; smallest and largest are those of single rounds.
pub(super) fn measure(args: &BenchArgs) -> Result<Vec<Row>, Failure> {
    let scene = input::scene(args.scene(), &args.choice(), &Limits::default())?;
    let world = Arc::new(World::new(Arc::new(scene)));
    let rounds = |pictures| -> Result<Vec<Round>, Failure> {
        (0..args.rounds).map(|seed| Ok(round(&world, args, u64::from(seed), pictures)?)).collect()
    };
    let settings = Settings::default();
    let conditions = format!(
        "{}, {}×{}, real clock, {} threads, {}+{}, {} rounds of {} s, an input every {} to {} ms",
        args.scene(),
        args.size.width,
        args.size.height,
        super::threads(args),
        settings.sampler.name(),
        settings.reconstruction.name(),
        args.rounds,
        args.secs,
        PAUSE_MS[0],
        PAUSE_MS[1],
    );
    let mut rows = Vec::new();
    for (pictures, name, what) in [
        (false, "", "no picture is made"),
        (true, ".with_pictures", "pictures are made at the rate of a display"),
    ] {
        let rounds = rounds(pictures)?;
        let conditions = format!("{conditions}; {what}");
        for (percentile, part) in [("p50", 0.5), ("p99", 0.99)] {
            let name = format!("latency{name}.{percentile}_ms");
            rows.push(percentile_row(name, &rounds, part, &conditions));
        }
        let mut put = |what: &str, unit: &'static str, per_sec: fn(&Round) -> f64| {
            let per_sec: Vec<f64> = rounds.iter().map(per_sec).collect();
            rows.push(Row::new(format!("latency{name}.{what}"), unit, &per_sec, &conditions));
        };
        put("samples_per_sec", "samples/s", |round| round.samples_per_sec);
        if pictures {
            put("pictures_per_sec", "pictures/s", |round| round.pictures_per_sec);
        }
    }
    Ok(rows)
}

/// What came of one round.
struct Round {
    latencies_ms: Vec<f64>,
    pictures_per_sec: f64,
    samples_per_sec: f64,
}

fn percentile_row(name: String, rounds: &[Round], part: f64, conditions: &str) -> Row {
    let of = |mut latencies: Vec<f64>| {
        latencies.sort_by(f64::total_cmp);
        latencies[((latencies.len() - 1) as f64 * part).ceil() as usize]
    };
    let all = rounds.iter().flat_map(|round| round.latencies_ms.iter().copied()).collect();
    let each: Vec<f64> = rounds.iter().map(|round| of(round.latencies_ms.clone())).collect();
    Row { value: of(all), ..Row::new(name, "ms", &each, conditions) }
}

fn round(world: &Arc<World>, args: &BenchArgs, seed: u64, pictures: bool) -> anyhow::Result<Round> {
    let mut user = User::start(world, args, seed, pictures)?;
    user.rest(WARM_UP_SECS)?;
    let (begin, before) = (user.clock.now(), user.pictures);
    let samples = user.watch.samples.load(Ordering::Relaxed);
    let mut latencies_ms = Vec::new();
    let mut rng = Rng::new(seed);
    while user.clock.now().secs_since(begin) < args.secs || latencies_ms.is_empty() {
        let [least, most] = PAUSE_MS;
        user.rest(1e-3 * f64::from(least + (most - least) * rng.unit_f32()))?;
        latencies_ms.push(1e3 * user.steer()?);
    }
    let secs = user.clock.now().secs_since(begin);
    let samples = user.watch.samples.load(Ordering::Relaxed) - samples;
    Ok(Round {
        latencies_ms,
        pictures_per_sec: f64::from(user.pictures - before) / secs,
        samples_per_sec: samples as f64 / secs,
    })
}

/// Who has the loop in another thread, as a window has.
struct User {
    clock: Clock,
    render: RenderThread<Arc<World>>,
    news: Receiver<News>,
    watch: Arc<Watch>,
    /// From where it is looked, and from where before, each with where everything is then.
    looks: [(View, Arc<Pose>); 2],
    size: Size,
    pictures: u32,
}

enum News {
    /// The loop has something to say.
    Report,
    /// The first sample with the new camera has been kept.
    Kept(Time),
}

impl User {
    fn start(
        world: &Arc<World>,
        args: &BenchArgs,
        seed: u64,
        pictures: bool,
    ) -> anyhow::Result<User> {
        let (news, received) = channel();
        let clock = Clock::real();
        let watch = Arc::new(Watch::default());
        let camera = ViewSource::Camera(0);
        let tracing = frameless_trace::Settings::default();
        let tracer = CpuTracer::new(Arc::clone(world), camera, tracing, args.threads);
        let watched = Watched {
            tracer,
            watch: Arc::clone(&watch),
            clock: clock.clone(),
            kept: news.clone(),
            seen: false,
        };
        let settings = Settings::default();
        let session = Session::new(args.size, Clock::real(), settings, seed, watched)
            .with_refresh_threads(args.threads);
        let wake = move || drop(news.send(News::Report));
        let render = RenderThread::start(session, wake)?;
        let looks = views(world).map(|view| (view, Arc::new(pose(world, &view, args.size))));
        // What moves by itself would say nothing of the camera.
        render.send(Command::Play(false));
        render.send(Command::Seek(0.0));
        render.send(Command::View(ViewChoice::Free(looks[0].0)));
        if pictures {
            render.send(Command::WantPicture { memory: Vec::new(), paint_secs: 0.0 });
        }
        Ok(User { clock, render, news: received, watch, looks, size: args.size, pictures: 0 })
    }

    /// Looks at pictures for a while.
    fn rest(&mut self, secs: f64) -> anyhow::Result<()> {
        let end = self.clock.now().secs() + secs;
        loop {
            let left = end - self.clock.now().secs();
            if left <= 0.0 {
                return Ok(());
            }
            if let Ok(News::Report) = self.news.recv_timeout(Duration::from_secs_f64(left)) {
                self.take_reports()?;
            }
        }
    }

    fn take_reports(&mut self) -> anyhow::Result<()> {
        loop {
            match self.render.report() {
                Ok(Some(Report::Picture(picture))) => {
                    self.pictures += 1;
                    let memory = picture.rgba;
                    self.render.send(Command::WantPicture { memory, paint_secs: 0.0 });
                }
                Ok(Some(Report::Error(error))) => anyhow::bail!("{error}"),
                Ok(None) => return Ok(()),
                Err(_) => anyhow::bail!("the loop has ended"),
            }
        }
    }

    /// Turns the camera. Returns after how many seconds the canvas shows it.
    fn steer(&mut self) -> anyhow::Result<f64> {
        self.looks.swap(0, 1);
        let [now, before] = self.looks.each_ref().map(|(_, pose)| Arc::clone(pose));
        self.watch.begin(Turn { before, now, size: self.size });
        let begin = self.clock.now();
        self.render.send(Command::View(ViewChoice::Free(self.looks[0].0)));
        loop {
            let waited = Duration::from_secs_f64(self.clock.now().secs_since(begin));
            match self.news.recv_timeout(PATIENCE.saturating_sub(waited)) {
                Ok(News::Kept(time)) => return Ok(time.secs_since(begin)),
                Ok(News::Report) => self.take_reports()?,
                Err(_) => anyhow::bail!(
                    "no sample has shown the new camera for {PATIENCE:?}: either the loop stands still, or no surface is seen \
                     elsewhere after a turn by 6° (give a larger --size, or a --scene whose camera sees something)"
                ),
            }
        }
    }
}

/// Where everything is, seen from there.
fn pose(world: &World, view: &View, size: Size) -> Pose {
    let mut pose = Pose::default();
    world.pose(&world.moment(0.0), view, size, &mut pose);
    pose
}

/// The scene's first camera, and the same turned to the side.
fn views(world: &World) -> [View; 2] {
    let moment = world.moment(0.0);
    let view = world.scene().view_at(moment.state(), 0);
    let turn = Affine3A::from_axis_angle(glam::Vec3::Y, TURN_RAD);
    let mut world_from_camera = view.world_from_camera * turn;
    world_from_camera.translation = Vec3A::ZERO + view.world_from_camera.translation;
    [view, View { world_from_camera, ..view }]
}

/// What the loop looks out for.
#[derive(Default)]
struct Watch {
    is_on: AtomicBool,
    /// That have come so far.
    samples: AtomicU64,
    turn: Mutex<Option<Turn>>,
}

/// The camera turns: where everything was in the picture, and where it is.
struct Turn {
    before: Arc<Pose>,
    now: Arc<Pose>,
    size: Size,
}

impl Watch {
    fn begin(&self, turn: Turn) {
        *self.turn.lock().unwrap_or_else(PoisonError::into_inner) = Some(turn);
        self.is_on.store(true, Ordering::Release);
    }

    /// Whether an answer shows the turn; only the first that does.
    fn ends_with(&self, answer: &Answer) -> bool {
        if !self.is_on.load(Ordering::Acquire) {
            return false;
        }
        let turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        let is_shown = turn.as_ref().is_some_and(|turn| turn.is_shown(answer));
        if is_shown {
            self.is_on.store(false, Ordering::Relaxed);
        }
        is_shown
    }
}

impl Turn {
    /// All samples of an answer have one camera: the first that is seen in one place before, and in another now, tells which.
    fn is_shown(&self, answer: &Answer) -> bool {
        const HERE_PX: f32 = 0.5;
        let mut samples = answer.requests.iter().zip(&answer.surfaces);
        let told = samples.find_map(|(request, surface)| {
            let is_here = |pose: &Pose, surface: &Surface| {
                let [x, y] = request.position_px(self.size);
                pose.project(surface).is_some_and(|there| {
                    (there.px[0] - x).abs().max((there.px[1] - y).abs()) < HERE_PX
                })
            };
            let (before, now) = (is_here(&self.before, surface), is_here(&self.now, surface));
            (before != now).then_some(now)
        });
        answer.size == self.size && told == Some(true)
    }
}

/// The renderer, whose answers are looked at. What it has given has been kept and observed when the loop turns to it again.
struct Watched {
    tracer: CpuTracer,
    watch: Arc<Watch>,
    clock: Clock,
    kept: Sender<News>,
    seen: bool,
}

impl Watched {
    fn tell(&mut self) {
        if std::mem::take(&mut self.seen) {
            self.kept.send(News::Kept(self.clock.now())).ok();
        }
    }
}

impl Tracer for Watched {
    fn submit(&mut self, batch: Batch) {
        self.tell();
        self.tracer.submit(batch);
    }

    fn collect(&mut self, wait: bool) -> Option<Answer> {
        self.tell();
        let answer = self.tracer.collect(wait)?;
        self.watch.samples.fetch_add(answer.requests.len() as u64, Ordering::Relaxed);
        self.seen = self.watch.ends_with(&answer);
        Some(answer)
    }

    fn is_noisy(&self) -> bool {
        self.tracer.is_noisy()
    }

    fn samples_at_once(&self) -> usize {
        self.tracer.samples_at_once()
    }

    fn spare_threads(&mut self, threads: usize) -> bool {
        self.tracer.spare_threads(threads)
    }

    fn pose(&mut self, scene_secs: f64, size: Size, pose: &mut Pose) -> bool {
        self.tell();
        self.tracer.pose(scene_secs, size, pose)
    }

    fn lighting(&mut self, scene_secs: f64, lighting: &mut Lighting) -> bool {
        self.tracer.lighting(scene_secs, lighting)
    }
}

impl Stage for Watched {
    type World = Arc<World>;

    fn set_view(&mut self, view: ViewChoice) {
        Stage::set_view(&mut self.tracer, view);
    }

    fn steering(&self) -> Option<Steering> {
        self.tracer.steering()
    }

    fn set_world(&mut self, world: Arc<World>) {
        Stage::set_world(&mut self.tracer, world);
    }

    /// Asked for after every turn of the loop.
    fn trouble(&mut self) -> Option<String> {
        self.tell();
        None
    }
}
