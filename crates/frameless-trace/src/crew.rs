//! Who works on batches: threads of their own, and whoever waits for an answer.
//!
//! The loop's thread works too while it waits, so that as many threads as cores are enough: none sleeps beside work that there is, none
//! takes the core of another, and with one thread nobody is ever woken. Work comes in pieces, since the loop's thread goes back to its
//! own as soon as what it waits for is there. One thread more stands in for it while it sleeps, which it does where pieces take long:
//! whoever sends it something should not wait for them.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};

use crate::traverse::Stack;

/// What is to be done for one answer.
///
/// One thread calls [`prepare`](Work::prepare), then any of them [`piece`](Work::piece), once for each number below
/// [`pieces`](Work::pieces) and several at once, and the last of them [`finish`](Work::finish).
pub(crate) trait Work: Send + Sync + 'static {
    /// What comes of it.
    type Answer: Send;

    /// Whether a piece is short, so that the thread that waits for the answer may work as well.
    fn is_short(&self) -> bool;

    /// At least 1.
    fn pieces(&self) -> usize;

    /// What is to be done before.
    fn prepare(&self);

    /// One of the pieces.
    fn piece(&self, number: usize, stack: &mut Stack);

    /// What is to be done afterwards.
    fn finish(self) -> Self::Answer;
}

/// Works until it is dropped; answers come in the order of the work.
pub(crate) struct Crew<W: Work> {
    threads: usize,
    board: Arc<Board<W>>,
    stack: Stack,
}

/// What all threads look at.
struct Board<W: Work> {
    queue: Mutex<Queue<W>>,
    /// There may be something to do.
    work: Condvar,
    /// The same, for the thread that stands in for the caller's.
    relief: Condvar,
    /// The first answer may be there.
    answer: Condvar,
}

struct Queue<W: Work> {
    entries: VecDeque<Entry<W>>,
    /// Number of the first entry.
    first: u64,
    /// Threads that wait for work.
    idle: usize,
    /// Threads that are to rest.
    spared: usize,
    /// Who waits for an answer sleeps.
    asleep: bool,
    closed: bool,
    /// A thread has panicked.
    lost: bool,
}

struct Entry<W: Work> {
    stage: Stage<W>,
    pieces: usize,
    /// The next piece that nobody has taken.
    next: usize,
    /// Pieces that are not done yet.
    left: usize,
}

enum Stage<W: Work> {
    New(Arc<W>),
    Preparing(Arc<W>),
    Ready(Arc<W>),
    Finishing,
    Done(W::Answer),
}

/// What one thread does next, of the entry with this number.
enum Task<W> {
    Prepare(u64, Arc<W>),
    Piece(u64, Arc<W>, usize),
}

impl<W: Work> Crew<W> {
    /// So many threads, the caller's included; `name` and a number are what the others are called.
    ///
    /// # Panics
    /// If the operating system gives no threads.
    pub(crate) fn new(threads: usize, name: &str) -> Crew<W> {
        let queue = Queue {
            entries: VecDeque::new(),
            first: 0,
            idle: 0,
            spared: 0,
            asleep: false,
            closed: false,
            lost: false,
        };
        let [work, relief, answer] = [(); 3].map(|()| Condvar::new());
        let board = Arc::new(Board { queue: Mutex::new(queue), work, relief, answer });
        let threads = threads.max(1);
        for index in 0..threads {
            let board = Arc::clone(&board);
            let thread = std::thread::Builder::new().name(format!("{name}-{index}"));
            let started = thread.spawn(move || match index {
                0 => board.stand_in(),
                _ => board.work(index),
            });
            started.expect("threads for tracing can be started");
        }
        Crew { threads, board, stack: Stack::new() }
    }

    /// So many of the threads rest from now on, once they are done with the pieces that they are at; never the caller's. Where pieces take
    /// long none rests: the caller would be late to call it back. Returns whether any is left, the caller's included.
    pub(crate) fn spare(&mut self, threads: usize) -> bool {
        let mut queue = self.board.lock();
        queue.spared = if queue.is_short() { threads } else { 0 };
        let is_left = queue.spared < self.threads;
        drop(queue);
        self.board.work.notify_all();
        is_left
    }

    /// Hands over work.
    pub(crate) fn submit(&mut self, work: W) {
        let pieces = work.pieces();
        let stage = Stage::New(Arc::new(work));
        let mut queue = self.board.lock();
        queue.entries.push_back(Entry { stage, pieces, next: 0, left: pieces });
        self.board.call(&queue);
    }

    /// The next answer, for which the caller works. `None`: there is nothing more to come.
    ///
    /// # Panics
    /// If another thread has panicked.
    pub(crate) fn wait(&mut self) -> Option<W::Answer> {
        let board = Arc::clone(&self.board);
        let mut queue = board.lock();
        loop {
            if queue.entries.is_empty() {
                return None;
            }
            if let Some(answer) = queue.take_first() {
                return Some(answer);
            }
            let task = if queue.is_short() { queue.next_task() } else { None };
            queue = match task {
                Some(task) => {
                    drop(queue);
                    board.perform(task, &mut self.stack)
                }
                None => board.sleep(queue),
            };
        }
    }

    /// The next answer, if it is there. Where nobody else works, the caller does some of it.
    ///
    /// # Panics
    /// If another thread has panicked.
    pub(crate) fn poll(&mut self) -> Option<W::Answer> {
        let board = Arc::clone(&self.board);
        let mut queue = board.lock();
        if let Some(answer) = queue.take_first() {
            return Some(answer);
        }
        let task = queue.next_task()?;
        drop(queue);
        board.perform(task, &mut self.stack).take_first()
    }
}

impl<W: Work> Drop for Crew<W> {
    /// The threads end after the piece that they are at.
    fn drop(&mut self) {
        self.board.lock().closed = true;
        self.board.work.notify_all();
        self.board.relief.notify_one();
    }
}

impl<W: Work> Board<W> {
    fn lock(&self) -> MutexGuard<'_, Queue<W>> {
        self.queue.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Calls those who wait for work; calling takes the system's help, so nobody is called for nothing.
    fn call(&self, queue: &Queue<W>) {
        if queue.idle > 0 {
            self.work.notify_all();
        }
        match queue.asleep {
            false => {}
            true if queue.is_short() => self.answer.notify_one(),
            true => self.relief.notify_one(),
        }
    }

    /// A thread's life; they are numbered from 1.
    fn work(&self, number: usize) {
        let mut stack = Stack::new();
        let mut queue = self.lock();
        while !queue.closed {
            let task = if number > queue.spared { queue.next_task() } else { None };
            queue = match task {
                Some(task) => {
                    drop(queue);
                    self.perform(task, &mut stack)
                }
                None => {
                    // Who rests is not called for work.
                    let waits = usize::from(number > queue.spared);
                    queue.idle += waits;
                    let mut queue = wait(&self.work, queue);
                    queue.idle -= waits;
                    queue
                }
            };
        }
    }

    /// The life of the thread that stands in for the caller's.
    fn stand_in(&self) {
        let mut stack = Stack::new();
        let mut queue = self.lock();
        while !queue.closed {
            let is_needed = queue.asleep && !queue.is_short();
            let task = if is_needed { queue.next_task() } else { None };
            queue = match task {
                Some(task) => {
                    drop(queue);
                    self.perform(task, &mut stack)
                }
                None => wait(&self.relief, queue),
            };
        }
    }

    /// Until the first answer is there, or something else to do.
    fn sleep<'a>(&'a self, mut queue: MutexGuard<'a, Queue<W>>) -> MutexGuard<'a, Queue<W>> {
        queue.asleep = true;
        if !queue.is_short() {
            self.relief.notify_one();
        }
        let mut queue = wait(&self.answer, queue);
        queue.asleep = false;
        queue
    }

    fn perform(&self, task: Task<W>, stack: &mut Stack) -> MutexGuard<'_, Queue<W>> {
        let _lost = LostOnPanic(self);
        match task {
            Task::Prepare(number, work) => {
                work.prepare();
                let mut queue = self.lock();
                queue.entry(number).stage = Stage::Ready(work);
                self.call(&queue);
                queue
            }
            Task::Piece(number, work, piece) => {
                work.piece(piece, stack);
                let mut queue = self.lock();
                // So that whoever is last is the only one to hold it.
                drop(work);
                let entry = queue.entry(number);
                entry.left -= 1;
                if entry.left > 0 {
                    return queue;
                }
                self.finish(number, queue)
            }
        }
    }

    fn finish<'a>(
        &'a self,
        number: u64,
        mut queue: MutexGuard<'a, Queue<W>>,
    ) -> MutexGuard<'a, Queue<W>> {
        let stage = std::mem::replace(&mut queue.entry(number).stage, Stage::Finishing);
        drop(queue);
        let Stage::Ready(work) = stage else { unreachable!("pieces are taken of what is ready") };
        let answer = Arc::into_inner(work).expect("all other threads have let it go").finish();
        let mut queue = self.lock();
        queue.entry(number).stage = Stage::Done(answer);
        if queue.asleep {
            self.answer.notify_one();
        }
        queue
    }
}

fn wait<'a, T>(until: &Condvar, guard: MutexGuard<'a, T>) -> MutexGuard<'a, T> {
    until.wait(guard).unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl<W: Work> Queue<W> {
    fn entry(&mut self, number: u64) -> &mut Entry<W> {
        &mut self.entries[(number - self.first) as usize]
    }

    /// # Panics
    /// If another thread has panicked.
    fn take_first(&mut self) -> Option<W::Answer> {
        assert!(!self.lost, "a tracing thread panicked");
        if !matches!(self.entries.front()?.stage, Stage::Done(_)) {
            return None;
        }
        let Some(Entry { stage: Stage::Done(answer), .. }) = self.entries.pop_front() else {
            unreachable!("it is the one just looked at")
        };
        self.first += 1;
        Some(answer)
    }

    /// Whether what comes next is in short pieces.
    fn is_short(&self) -> bool {
        self.entries.iter().all(|entry| match &entry.stage {
            Stage::New(work) | Stage::Preparing(work) | Stage::Ready(work) => work.is_short(),
            Stage::Finishing | Stage::Done(_) => true,
        })
    }

    /// What is best done next: preparations first, so that nobody waits for them later.
    fn next_task(&mut self) -> Option<Task<W>> {
        let numbered = || self.first..;
        let new = self.entries.iter().zip(numbered()).find_map(|(entry, number)| {
            let Stage::New(work) = &entry.stage else { return None };
            Some((number, Arc::clone(work)))
        });
        if let Some((number, work)) = new {
            self.entry(number).stage = Stage::Preparing(Arc::clone(&work));
            return Some(Task::Prepare(number, work));
        }
        self.entries.iter_mut().zip(self.first..).find_map(|(entry, number)| {
            let Stage::Ready(work) = &entry.stage else { return None };
            if entry.next == entry.pieces {
                return None;
            }
            entry.next += 1;
            Some(Task::Piece(number, Arc::clone(work), entry.next - 1))
        })
    }
}

/// Says that an answer will never come.
struct LostOnPanic<'a, W: Work>(&'a Board<W>);

impl<W: Work> Drop for LostOnPanic<'_, W> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.lock().lost = true;
            self.0.answer.notify_one();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::thread::{ThreadId, current};

    use super::*;

    /// Notes who has done its pieces.
    struct Noted {
        pieces: Vec<Mutex<Option<ThreadId>>>,
        prepared: AtomicUsize,
        is_short: bool,
        panics: bool,
    }

    fn noted(pieces: usize, is_short: bool) -> Noted {
        let pieces = (0..pieces).map(|_| Mutex::new(None)).collect();
        Noted { pieces, prepared: AtomicUsize::new(0), is_short, panics: false }
    }

    impl Work for Noted {
        type Answer = Vec<ThreadId>;

        fn is_short(&self) -> bool {
            self.is_short
        }

        fn pieces(&self) -> usize {
            self.pieces.len()
        }

        fn prepare(&self) {
            assert!(!self.panics, "a renderer that panics on purpose");
            self.prepared.fetch_add(1, Ordering::Relaxed);
        }

        fn piece(&self, number: usize, _stack: &mut Stack) {
            assert_eq!(self.prepared.load(Ordering::Relaxed), 1, "once, and before");
            let before = self.pieces[number].lock().unwrap().replace(current().id());
            assert_eq!(before, None, "done twice");
            std::thread::sleep(std::time::Duration::from_micros(200));
        }

        fn finish(self) -> Vec<ThreadId> {
            let who = self.pieces.into_iter().map(|piece| piece.into_inner().unwrap());
            who.map(|who| who.expect("every piece is done")).collect()
        }
    }

    /// Which threads have worked for a few answers.
    fn workers(threads: usize, is_short: bool) -> Vec<ThreadId> {
        let mut crew = Crew::new(threads, "test");
        (1..=10).for_each(|pieces| crew.submit(noted(pieces, is_short)));
        let mut all = Vec::new();
        for pieces in 1..=10 {
            let who = crew.wait().expect("it was submitted");
            assert_eq!(who.len(), pieces, "in order");
            all.extend(who);
        }
        assert!(crew.wait().is_none() && crew.poll().is_none());
        all.sort_by_key(|id| format!("{id:?}"));
        all.dedup();
        all
    }

    #[test]
    fn alone_the_caller_does_everything() {
        assert_eq!(workers(1, true), [current().id()]);
    }

    #[test]
    fn the_caller_is_one_of_them() {
        let all = workers(3, true);
        assert!(all.contains(&current().id()) && (2..=3).contains(&all.len()), "{all:?}");
    }

    #[test]
    fn who_is_spared_does_nothing_until_called_again() {
        let mut crew = Crew::new(2, "test");
        assert!(crew.spare(1), "the caller is left");
        crew.submit(noted(5, true));
        let alone = crew.wait().unwrap();
        assert!(alone.iter().all(|&who| who == current().id()));
        crew.spare(0);
        let both = (0..100).any(|_| {
            crew.submit(noted(5, true));
            crew.wait().unwrap().iter().any(|&who| who != current().id())
        });
        assert!(both, "never called again");
    }

    #[test]
    fn nobody_is_left_if_all_are_spared_unless_what_they_do_takes_long() {
        let mut crew = Crew::new(2, "test");
        assert!(!crew.spare(2));
        crew.submit(noted(5, false));
        assert!(crew.spare(2));
        crew.wait().unwrap();
    }

    #[test]
    fn what_takes_long_is_done_by_others() {
        for threads in [1, 3] {
            let all = workers(threads, false);
            assert!(!all.contains(&current().id()) && all.len() <= threads, "{all:?}");
        }
    }

    #[test]
    fn who_only_asks_gets_there_too() {
        let mut crew = Crew::new(1, "test");
        crew.submit(noted(3, true));
        let asked = (1..).find(|_| crew.poll().is_some()).unwrap();
        assert_eq!(asked, 4, "prepared, and one piece each time");
    }

    #[test]
    #[should_panic(expected = "a tracing thread panicked")]
    fn a_panic_is_not_waited_for() {
        let mut crew = Crew::new(2, "test");
        crew.submit(Noted { panics: true, ..noted(1, false) });
        crew.wait();
    }
}
