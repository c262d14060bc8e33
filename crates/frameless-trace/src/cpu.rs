//! Batches traced on this machine's cores, beside the loop.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex};

use frameless::{Answer, Batch, Lighting, Pose, Request, Size, Surface, Tracer};
use rayon::ThreadPool;
use rayon::prelude::*;

use crate::camera::{Camera, ViewSource};
use crate::integrator::Settings;
use crate::moment::Moment;
use crate::order::by_tile;
use crate::traverse::Stack;
use crate::world::World;

/// Samples that one thread takes at once. Fewer: more time spent on handing out work; more: threads idle at the end of a
/// batch of a thousand.
const CHUNK: usize = 64;

/// A thread pool for [`crate::render`] or a [`CpuTracer`]; 0 threads: one per core.
///
/// # Panics
/// If the operating system gives no threads.
pub fn thread_pool(threads: usize) -> ThreadPool {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|index| format!("trace-{index}"))
        // The panic's message is out by now; the answer that never comes tells `collect`.
        .panic_handler(|_| {})
        .build()
        .expect("threads for tracing can be started")
}

/// The renderer on this machine's cores: [`submit`](Tracer::submit) hands a batch to its threads and returns at once,
/// [`collect`](Tracer::collect) gives the finished answers in the order in which they were submitted.
///
/// An answer is the same, bit for bit, for any number of threads.
pub struct CpuTracer {
    shared: Arc<Shared>,
    view: ViewSource,
    settings: Settings,
    pool: ThreadPool,
    under_way: VecDeque<Receiver<Answer>>,
}

/// What a batch under way needs, so that the tracer can take up another world meanwhile.
struct Shared {
    world: Arc<World>,
    /// Memory of finished batches: one per batch that has ever been under way at the same time.
    idle: Mutex<Vec<Workspace>>,
}

struct Workspace {
    moment: Moment,
    order: Vec<u32>,
    /// In the order of `order`.
    samples: Vec<([f32; 3], Surface)>,
}

impl CpuTracer {
    /// `threads`: 0 for one per core.
    ///
    /// # Panics
    /// If the operating system gives no threads.
    pub fn new(
        world: Arc<World>,
        view: ViewSource,
        settings: Settings,
        threads: usize,
    ) -> CpuTracer {
        let (pool, under_way) = (thread_pool(threads), VecDeque::new());
        CpuTracer { shared: Shared::new(world), view, settings, pool, under_way }
    }

    /// Batches submitted from now on are seen from here.
    pub fn set_view(&mut self, view: ViewSource) {
        self.view = view;
    }

    /// What is being traced.
    pub fn world(&self) -> &Arc<World> {
        &self.shared.world
    }

    /// Batches submitted from now on show this world.
    pub fn set_world(&mut self, world: Arc<World>) {
        self.shared = Shared::new(world);
    }
}

impl Tracer for CpuTracer {
    fn submit(&mut self, batch: Batch) {
        let (answer, receiver) = sync_channel(1);
        let (shared, view, settings) = (self.shared.clone(), self.view, self.settings);
        self.under_way.push_back(receiver);
        self.pool.spawn(move || {
            // Nobody listens any more once the tracer is dropped.
            let _ = answer.send(shared.answer(batch, &view, &settings));
        });
    }

    /// # Panics
    /// If a thread of the pool has panicked.
    fn collect(&mut self, wait: bool) -> Option<Answer> {
        const LOST: &str = "a tracing thread panicked";
        let first = self.under_way.front()?;
        let answer = if wait {
            first.recv().expect(LOST)
        } else {
            match first.try_recv() {
                Ok(answer) => answer,
                Err(TryRecvError::Empty) => return None,
                Err(TryRecvError::Disconnected) => panic!("{LOST}"),
            }
        };
        self.under_way.pop_front();
        Some(answer)
    }

    fn is_noisy(&self) -> bool {
        self.settings.integrator.is_noisy()
    }

    fn pose(&mut self, scene_secs: f64, size: Size, pose: &mut Pose) -> bool {
        let mut workspace = self.shared.take_workspace(scene_secs);
        self.shared.world.update_moment(scene_secs, &mut workspace.moment);
        let view = self.view.at(self.shared.world.scene(), workspace.moment.state());
        self.shared.world.pose(&workspace.moment, &view, size, pose);
        self.shared.idle().push(workspace);
        true
    }

    fn lighting(&mut self, scene_secs: f64, lighting: &mut Lighting) -> bool {
        let mut workspace = self.shared.take_workspace(scene_secs);
        self.shared.world.update_moment(scene_secs, &mut workspace.moment);
        self.shared.world.lighting(&workspace.moment, lighting);
        self.shared.idle().push(workspace);
        true
    }
}

impl Shared {
    fn new(world: Arc<World>) -> Arc<Shared> {
        Arc::new(Shared { world, idle: Mutex::new(Vec::new()) })
    }

    /// Runs in the pool, and hands parts of the batch to the pool's other threads.
    fn answer(&self, batch: Batch, view: &ViewSource, settings: &Settings) -> Answer {
        let mut workspace = self.take_workspace(batch.scene_secs);
        self.world.update_moment(batch.scene_secs, &mut workspace.moment);
        let view = view.at(self.world.scene(), workspace.moment.state());
        by_tile(&batch.requests, batch.size, &mut workspace.order);
        self.trace(&mut workspace, &Camera::new(&view, batch.size), &batch.requests, settings);
        let (rgb, surfaces) = workspace.in_order_of_requests(settings);
        self.idle().push(workspace);
        Answer::to(batch, rgb, surfaces)
    }

    fn trace(
        &self,
        workspace: &mut Workspace,
        camera: &Camera,
        requests: &[Request],
        settings: &Settings,
    ) {
        let Workspace { moment, order, samples } = workspace;
        samples.resize(order.len(), ([0.0; 3], Surface::default()));
        let chunks = order.par_chunks(CHUNK).zip(samples.par_chunks_mut(CHUNK));
        chunks.for_each_init(Stack::new, |stack, (order, samples)| {
            let (seen, mut places) = ((&*moment, camera), samples.iter_mut());
            let requests = order.iter().map(|&request| requests[request as usize]);
            let put = |rgb, surface| {
                if let Some(place) = places.next() {
                    *place = (rgb, surface);
                }
            };
            self.world.samples(seen, requests, settings, stack, put);
        });
    }

    fn take_workspace(&self, secs: f64) -> Workspace {
        self.idle().pop().unwrap_or_else(|| Workspace {
            moment: self.world.moment(secs),
            order: Vec::new(),
            samples: Vec::new(),
        })
    }

    fn idle(&self) -> std::sync::MutexGuard<'_, Vec<Workspace>> {
        self.idle.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Workspace {
    fn in_order_of_requests(&self, settings: &Settings) -> (Vec<[f32; 3]>, Vec<Surface>) {
        let mut rgb = vec![[0.0; 3]; self.samples.len()];
        let mut surfaces = Vec::new();
        if settings.surfaces {
            surfaces.resize(self.samples.len(), Surface::default());
        }
        for (&request, &(colour, surface)) in self.order.iter().zip(&self.samples) {
            rgb[request as usize] = colour;
            if settings.surfaces {
                surfaces[request as usize] = surface;
            }
        }
        (rgb, surfaces)
    }
}
