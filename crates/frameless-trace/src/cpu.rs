//! Batches traced on this machine's cores, beside the loop.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use frameless::{Answer, Batch, Lighting, Pose, Size, Surface, Tracer};
use rayon::ThreadPool;

use crate::camera::{Camera, ViewSource};
use crate::crew::{Crew, Work};
use crate::integrator::Settings;
use crate::latest::Latest;
use crate::moment::Moment;
use crate::order::Order;
use crate::traverse::Stack;
use crate::world::World;

/// Samples that one thread takes at once at most. Fewer: more time spent on handing out work, and less coherence; more: threads idle at
/// the end of a batch of a thousand.
const LONGEST_PIECE: usize = 64;

/// Of a thread's share of a batch, so that none is late by more than an eighth of it.
const PIECES_PER_THREAD: usize = 8;

/// A thread pool for [`crate::render`]; 0 threads: one per core.
///
/// # Panics
/// If the operating system gives no threads.
pub fn thread_pool(threads: usize) -> ThreadPool {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|index| format!("trace-{index}"))
        .build()
        .expect("threads for tracing can be started")
}

/// The renderer on this machine's cores: [`submit`](Tracer::submit) hands a batch to its threads and returns at once,
/// [`collect`](Tracer::collect) gives the finished answers in the order in which they were submitted, and works, too, while it waits.
///
/// An answer is the same, bit for bit, for any number of threads.
pub struct CpuTracer {
    world: Arc<World>,
    view: Arc<Mutex<ViewSource>>,
    settings: Settings,
    threads: usize,
    crew: Crew<Task>,
    idle: Idle,
    is_real_time: bool,
    /// Of a scene that takes long to bring to a time, in real time.
    latest: Option<Arc<Latest>>,
}

/// Memory of finished batches: one per batch that has ever been under way at the same time.
type Idle = Arc<Mutex<Vec<Workspace>>>;

/// Samples of a part of a batch.
type Piece = Vec<([f32; 3], Surface)>;

#[derive(Default)]
struct Workspace {
    /// Its own, but for a scene that has a [`Latest`]: that moment is let go when the batch is finished.
    moment: Option<Arc<Moment>>,
    order: Order,
    /// Of each piece, in the order of `order`.
    samples: Vec<Mutex<Piece>>,
}

/// Where the camera is, for who moves it from another thread: what is not being traced yet is seen from there.
#[derive(Clone)]
pub struct Viewpoint(Arc<Mutex<ViewSource>>);

impl Viewpoint {
    /// Moves it.
    pub fn set(&self, view: ViewSource) {
        *lock(&self.0) = view;
    }
}

impl CpuTracer {
    /// `threads`: of those that work at the same time, that which waits for answers included; 0 for one per core.
    ///
    /// # Panics
    /// If the operating system gives no threads.
    pub fn new(
        world: Arc<World>,
        view: ViewSource,
        settings: Settings,
        threads: usize,
    ) -> CpuTracer {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        let threads = if threads == 0 { cores() } else { threads };
        let (view, idle) = (Arc::new(Mutex::new(view)), Idle::default());
        let crew = Crew::new(threads, "trace");
        let (is_real_time, latest) = (false, None);
        CpuTracer { world, view, settings, threads, crew, idle, is_real_time, latest }
    }

    /// For the real clock: a scene that takes long to bring to a time, as one with a large mesh that deforms, does not hold up its batches. They show
    /// the newest moment that is finished, and the next is made meanwhile.
    pub fn in_real_time(mut self) -> CpuTracer {
        self.is_real_time = true;
        self.begin_world();
        self
    }

    fn begin_world(&mut self) {
        let is_late = self.is_real_time && self.world.takes_long_to_move();
        self.latest = is_late.then(|| Arc::new(Latest::new(Arc::clone(&self.world))));
    }

    /// Batches that are not being traced yet are seen from here.
    pub fn set_view(&mut self, view: ViewSource) {
        *lock(&self.view) = view;
    }

    /// The same for other threads.
    pub fn viewpoint(&self) -> Viewpoint {
        Viewpoint(Arc::clone(&self.view))
    }

    /// What is being traced.
    pub fn world(&self) -> &Arc<World> {
        &self.world
    }

    /// Batches submitted from now on show this world.
    pub fn set_world(&mut self, world: Arc<World>) {
        self.world = world;
        self.idle = Idle::default();
        self.begin_world();
    }

    fn at<T>(&self, scene_secs: f64, tell: impl FnOnce(&World, &Moment) -> T) -> T {
        let latest = self.latest.as_deref();
        let workspace = take_workspace(&self.idle, &self.world, scene_secs, latest);
        let told = tell(&self.world, workspace.moment());
        leave_workspace(&self.idle, workspace, latest);
        told
    }
}

impl Tracer for CpuTracer {
    fn submit(&mut self, batch: Batch) {
        let pieces = PIECES_PER_THREAD * self.threads;
        let piece = (batch.requests.len() / pieces).clamp(1, LONGEST_PIECE);
        self.crew.submit(Task {
            world: Arc::clone(&self.world),
            view: Arc::clone(&self.view),
            settings: self.settings,
            idle: Arc::clone(&self.idle),
            latest: self.latest.clone(),
            piece,
            // Batches are as long as they may last: one of few samples has slow ones.
            is_short: batch.requests.len() >= pieces,
            batch,
            ready: OnceLock::new(),
            camera: OnceLock::new(),
        });
    }

    /// # Panics
    /// If a thread of the tracer's has panicked.
    fn collect(&mut self, wait: bool) -> Option<Answer> {
        if wait { self.crew.wait() } else { self.crew.poll() }
    }

    fn is_noisy(&self) -> bool {
        self.settings.integrator.is_noisy()
    }

    fn samples_at_once(&self) -> usize {
        self.threads
    }

    fn spare_threads(&mut self, threads: usize) -> bool {
        self.crew.spare(threads)
    }

    fn pose(&mut self, scene_secs: f64, size: Size, pose: &mut Pose) -> bool {
        let view = *lock(&self.view);
        self.at(scene_secs, |world, moment| {
            world.pose(moment, &view.at(world.scene(), moment.state()), size, pose);
        });
        true
    }

    fn lighting(&mut self, scene_secs: f64, lighting: &mut Lighting) -> bool {
        self.at(scene_secs, |world, moment| world.lighting(moment, lighting));
        true
    }
}

/// A batch under way, with all that it needs, so that the tracer can take up another world meanwhile.
struct Task {
    world: Arc<World>,
    view: Arc<Mutex<ViewSource>>,
    settings: Settings,
    idle: Idle,
    latest: Option<Arc<Latest>>,
    /// Samples per piece.
    piece: usize,
    is_short: bool,
    batch: Batch,
    ready: OnceLock<Workspace>,
    /// That of the moment when tracing began.
    camera: OnceLock<Camera>,
}

impl Task {
    fn workspace(&self) -> &Workspace {
        self.ready.get().expect("prepared before it is traced")
    }

    fn camera(&self) -> &Camera {
        self.camera.get_or_init(|| {
            let view = *lock(&self.view);
            let state = self.workspace().moment().state();
            Camera::new(&view.at(self.world.scene(), state), self.batch.size)
        })
    }
}

impl Work for Task {
    type Answer = Answer;

    fn is_short(&self) -> bool {
        self.is_short
    }

    fn pieces(&self) -> usize {
        self.batch.requests.len().div_ceil(self.piece).max(1)
    }

    fn prepare(&self) {
        let Batch { scene_secs, requests, size, .. } = &self.batch;
        let latest = self.latest.as_deref();
        let mut workspace = take_workspace(&self.idle, &self.world, *scene_secs, latest);
        workspace.order.by_tile(requests, *size);
        if workspace.samples.len() < self.pieces() {
            workspace.samples.resize_with(self.pieces(), Mutex::default);
        }
        assert!(self.ready.set(workspace).is_ok(), "prepared once");
    }

    fn piece(&self, number: usize, stack: &mut Stack) {
        let workspace = self.workspace();
        let (moment, order, samples) =
            (workspace.moment(), workspace.order.requests(), &workspace.samples);
        let camera = self.camera();
        let mut samples = lock(&samples[number]);
        samples.clear();
        let requests = order.chunks(self.piece).nth(number).unwrap_or_default();
        let requests = requests.iter().map(|&request| self.batch.requests[request as usize]);
        let put = |rgb, surface| samples.push((rgb, surface));
        self.world.samples((moment, camera), requests, &self.settings, stack, put);
    }

    fn finish(self) -> Answer {
        let Task { settings, idle, latest, piece, batch, ready, .. } = self;
        let mut workspace = ready.into_inner().expect("prepared before it is traced");
        let (rgb, surfaces) = workspace.in_order_of_requests(piece, &settings);
        leave_workspace(&idle, workspace, latest.as_deref());
        Answer::to(batch, rgb, surfaces)
    }
}

impl Workspace {
    fn moment(&self) -> &Moment {
        self.moment.as_ref().expect("a workspace that was taken has one")
    }

    fn in_order_of_requests(
        &mut self,
        piece: usize,
        settings: &Settings,
    ) -> (Vec<[f32; 3]>, Vec<Surface>) {
        let order = self.order.requests();
        let mut rgb = vec![[0.0; 3]; order.len()];
        let mut surfaces = Vec::new();
        if settings.surfaces {
            surfaces.resize(order.len(), Surface::default());
        }
        for (requests, samples) in order.chunks(piece).zip(&mut self.samples) {
            let samples = samples.get_mut().unwrap_or_else(PoisonError::into_inner);
            for (&request, &(colour, surface)) in requests.iter().zip(&*samples) {
                rgb[request as usize] = colour;
                if settings.surfaces {
                    surfaces[request as usize] = surface;
                }
            }
        }
        (rgb, surfaces)
    }
}

/// At this time, or with the newest moment that there is.
fn take_workspace(idle: &Idle, world: &World, secs: f64, latest: Option<&Latest>) -> Workspace {
    let mut workspace = lock(idle).pop().unwrap_or_default();
    workspace.moment = Some(match (latest, workspace.moment.take()) {
        (Some(latest), _) => latest.at(secs),
        (None, Some(mut own)) => {
            let moment = Arc::get_mut(&mut own).expect("nobody else has a workspace's own moment");
            world.update_moment(secs, moment);
            own
        }
        (None, None) => Arc::new(world.moment(secs)),
    });
    workspace
}

/// Gives it back to be used again.
fn leave_workspace(idle: &Idle, mut workspace: Workspace, latest: Option<&Latest>) {
    if latest.is_some() {
        workspace.moment = None;
    }
    lock(idle).push(workspace);
}

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}
