//! The renderer's side of the contract.

use crate::{Answer, Batch, Lighting, Pose, Size};

/// A renderer: takes batches of pixels, gives their colours back, now or later.
///
/// The engine calls [`submit`](Tracer::submit) with one batch after another and asks for what has become
/// of them with [`collect`](Tracer::collect). Answers may come late, in any order, in part, or never: what does not come is
/// chosen again, because its pixels grow old. On the simulated clock the engine waits for each batch before
/// it chooses the next, so that results do not depend on how fast the renderer is.
///
/// A function of a batch is a tracer already:
///
/// ```
/// use frameless::{Answer, Batch, Tracer};
///
/// let mut tracer = |batch: &Batch| -> Vec<[f32; 3]> {
///     batch.requests.iter().map(|r| {
///         let (x, y) = batch.size.xy(r.pixel);
///         [x as f32, y as f32, batch.scene_secs.sin() as f32]
///     }).collect()
/// };
/// # fn takes(_: &mut dyn Tracer) {}
/// # takes(&mut frameless::Function::new(tracer));
/// ```
pub trait Tracer {
    /// Take a batch. May trace it at once, hand it to other threads, or send it elsewhere.
    fn submit(&mut self, batch: Batch);

    /// The next answer, if there is one. With `wait`, wait for it as long as a batch is under way that may
    /// still be answered; `None` then means that nothing more will come.
    fn collect(&mut self, wait: bool) -> Option<Answer>;

    /// Whether colours have noise, as path tracing's. Then the same request of an unchanged scene, its
    /// [`sample_index`](crate::Request::sample_index) included, must still have the same answer: that is how change is told from
    /// noise. The default has none.
    fn is_noisy(&self) -> bool {
        false
    }

    /// How many samples it traces at the same time: a batch has at least so many, however slow they are. The default is 1.
    fn samples_at_once(&self) -> usize {
        1
    }

    /// So many of the machine's cores are needed for something else, from now on; 0: none. Returns whether it has any left: a renderer that
    /// has none is asked for little, and seldom. The default goes on as before.
    fn spare_threads(&mut self, _threads: usize) -> bool {
        true
    }

    /// Fill in where everything is in a picture of `size` at `scene_secs`, for a renderer that returns surfaces and can
    /// tell; its samples are then carried along as things move. Returns whether it can; the default cannot.
    fn pose(&mut self, _scene_secs: f64, _size: Size, _pose: &mut Pose) -> bool {
        false
    }

    /// Fill in the lights at `scene_secs`, for a renderer whose surfaces have albedo, normal and direct light; stored samples
    /// are then shaded again as lights change. Returns whether it can; the default cannot.
    fn lighting(&mut self, _scene_secs: f64, _lighting: &mut Lighting) -> bool {
        false
    }
}

impl<T: Tracer + ?Sized> Tracer for Box<T> {
    fn submit(&mut self, batch: Batch) {
        (**self).submit(batch)
    }

    fn collect(&mut self, wait: bool) -> Option<Answer> {
        (**self).collect(wait)
    }

    fn is_noisy(&self) -> bool {
        (**self).is_noisy()
    }

    fn samples_at_once(&self) -> usize {
        (**self).samples_at_once()
    }

    fn spare_threads(&mut self, threads: usize) -> bool {
        (**self).spare_threads(threads)
    }

    fn pose(&mut self, scene_secs: f64, size: Size, pose: &mut Pose) -> bool {
        (**self).pose(scene_secs, size, pose)
    }

    fn lighting(&mut self, scene_secs: f64, lighting: &mut Lighting) -> bool {
        (**self).lighting(scene_secs, lighting)
    }
}

/// A tracer made of a function from a batch to one linear RGB colour per request.
pub struct Function<F> {
    render: F,
    answers: std::collections::VecDeque<Answer>,
}

impl<F: FnMut(&Batch) -> Vec<[f32; 3]>> Function<F> {
    /// `render` returns one linear RGB colour per request of the batch, in the same order.
    pub fn new(render: F) -> Self {
        Function { render, answers: Default::default() }
    }
}

impl<F: FnMut(&Batch) -> Vec<[f32; 3]>> Tracer for Function<F> {
    fn submit(&mut self, batch: Batch) {
        let rgb = (self.render)(&batch);
        self.answers.push_back(Answer::to(batch, rgb, Vec::new()));
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        self.answers.pop_front()
    }
}
