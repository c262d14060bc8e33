//! A picture that is made in a thread of its own, so that the loop goes on.
//!
//! The thread has the reconstruction to itself, and a canvas that is told what the pixels show. Meanwhile new samples are written to the
//! loop's canvas; when the picture is ready the thread keeps them, too, and finds out what they told: a little later than it would be
//! without a picture, and in their order.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

use crate::replaced::Replaced;
use crate::{Canvas, Display, Findings, Lighting, Pose, Rates, Reconstruction, Refresh, Time};

/// What the thread works with, and gives back.
pub(crate) struct Work {
    pub(crate) reconstruction: Box<dyn Reconstruction>,
    pub(crate) canvas: Canvas,
    pub(crate) pose: Pose,
    pub(crate) lighting: Lighting,
    /// The samples of answers that have come meanwhile, and what they told.
    pub(crate) told: VecDeque<Told>,
}

/// The samples of one answer, and what they told.
pub(crate) struct Told {
    pub(crate) replaced: Replaced,
    pub(crate) findings: Findings,
}

/// The rest of what a picture is made for, see [`Refresh`].
pub(crate) struct Order {
    pub(crate) now: Time,
    pub(crate) has_pose: bool,
    pub(crate) has_lighting: bool,
    pub(crate) display: Display,
    pub(crate) is_noisy: bool,
    pub(crate) rates: Option<Rates>,
    pub(crate) wants_motion: bool,
    pub(crate) threads: usize,
}

/// A picture under way.
pub(crate) struct Beside {
    /// Until it has been waited for.
    thread: Option<JoinHandle<Work>>,
    late: Arc<Mutex<Late>>,
}

/// Samples that have been written to the loop's canvas, but of which the reconstruction does not know yet; oldest answers first.
pub(crate) type Late = VecDeque<(Time, Replaced)>;

impl Beside {
    /// `show` is given the picture, and what the pixels show; `end` is called when there is nothing left to do but to give everything back,
    /// even if that has failed.
    ///
    /// # Panics
    /// If the system has no thread left.
    pub(crate) fn start(
        mut work: Work,
        order: Order,
        late: Late,
        show: impl FnOnce(&[[f32; 3]], &Canvas) + Send + 'static,
        end: impl FnOnce() + Send + 'static,
    ) -> Beside {
        let late = Arc::new(Mutex::new(late));
        let inbox = Arc::clone(&late);
        let make = move || {
            let _end = OnDrop(Some(end));
            work.refresh(&order);
            show(work.reconstruction.picture(), &work.canvas);
            // Not those that come meanwhile: it could go on for ever.
            let waiting = lock(&inbox).len();
            for _ in 0..waiting {
                let Some((now, replaced)) = lock(&inbox).pop_front() else { break };
                work.keep(now, replaced, &order);
            }
            work
        };
        let thread = Builder::new().name("picture".to_owned()).spawn(make);
        let thread = thread.expect("a thread for a picture can be started");
        Beside { thread: Some(thread), late }
    }

    /// Samples have been written to the loop's canvas.
    pub(crate) fn tell(&self, now: Time, replaced: Replaced) {
        lock(&self.late).push_back((now, replaced));
    }

    pub(crate) fn is_done(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Waits for it. Also gives back what it has not come to.
    ///
    /// # Panics
    /// If the reconstruction has.
    pub(crate) fn end(mut self) -> (Work, Late) {
        let thread = self.thread.take().expect("it is waited for once");
        let work = thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        let late = std::mem::take(&mut *lock(&self.late));
        (work, late)
    }
}

impl Drop for Beside {
    /// Nobody wants the picture any more; its thread ends before the loop does.
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            // A panic in there has been printed already.
            thread.join().ok();
        }
    }
}

/// Calls a function when it goes, whatever the reason.
struct OnDrop<F: FnOnce()>(Option<F>);

impl<F: FnOnce()> Drop for OnDrop<F> {
    fn drop(&mut self) {
        if let Some(call) = self.0.take() {
            call();
        }
    }
}

impl Work {
    fn refresh(&mut self, order: &Order) {
        let refresh = Refresh {
            now: order.now,
            pose: order.has_pose.then_some(&self.pose),
            lighting: order.has_lighting.then_some(&self.lighting),
            display: &order.display,
            is_noisy: order.is_noisy,
            rates: order.rates.as_ref(),
            wants_motion: order.wants_motion,
            threads: order.threads,
        };
        self.reconstruction.refresh(&refresh, &mut self.canvas);
    }

    fn keep(&mut self, now: Time, replaced: Replaced, order: &Order) {
        let kept = replaced.kept(now, self.canvas.size(), order.is_noisy);
        let mut findings = Findings::default();
        self.reconstruction.keep(&kept, &order.display, &mut findings);
        replaced.newest().for_each(|pixel| self.canvas.note(pixel, now));
        self.told.push_back(Told { replaced, findings });
    }
}

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}
