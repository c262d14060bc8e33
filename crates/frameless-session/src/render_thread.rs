//! The render loop in a thread of its own: neither the window nor the loop ever waits for the other.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::{Builder, JoinHandle};

use frameless::Time;

use crate::command::{Command, Report, ViewChoice};
use crate::pace::Pace;
use crate::session::{Session, Stage, Steering};

/// The name of the thread that renderers are called in.
pub const LOOP_THREAD: &str = "render loop";

/// A running loop. Ends when dropped.
pub struct RenderThread<W> {
    to_loop: Sender<Heard<W>>,
    reports: Receiver<Report>,
    steering: Option<Steering>,
    thread: Option<JoinHandle<()>>,
}

/// What the loop is told.
enum Heard<W> {
    Command(Command<W>),
    /// The picture that was begun then is ready, and nothing is left to be done for it.
    PictureEnds(Time),
    End,
}

/// The loop has ended, which it does by itself only when the renderer panics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended;

impl<W: Send + 'static> RenderThread<W> {
    /// Starts the loop. `wake` is called after every report, in the thread that it is of.
    ///
    /// # Errors
    /// If the system has no thread left.
    pub fn start<S: Stage<World = W> + Send + 'static>(
        session: Session<S>,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> io::Result<RenderThread<W>> {
        let (to_loop, heard) = channel();
        let (to_window, reports) = channel();
        let steering = session.steering();
        let to_itself = to_loop.clone();
        // Sending fails once the window is gone; then the loop is told to end, too.
        let report = move |report| {
            to_window.send(report).ok();
            wake();
        };
        let thread = Builder::new()
            .name(LOOP_THREAD.to_owned())
            .spawn(move || run(session, &heard, &to_itself, &Arc::new(report)))?;
        Ok(RenderThread { to_loop, reports, steering, thread: Some(thread) })
    }

    /// Ask for something. Lost if the loop has ended, which [`RenderThread::report`] says.
    pub fn send(&self, command: Command<W>) {
        // Input does not wait for the loop's next turn. Only what makes sense in any scene: the loop may be about to open another.
        if let (Command::View(ViewChoice::Free(view)), Some(steer)) = (&command, &self.steering) {
            steer(*view);
        }
        self.to_loop.send(Heard::Command(command)).ok();
    }

    /// What the loop has to say, if anything.
    ///
    /// # Errors
    /// If the loop has ended.
    pub fn report(&self) -> Result<Option<Report>, Ended> {
        match self.reports.try_recv() {
            Ok(report) => Ok(Some(report)),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(Ended),
        }
    }
}

impl<W> Drop for RenderThread<W> {
    fn drop(&mut self) {
        self.to_loop.send(Heard::End).ok();
        if let Some(thread) = self.thread.take() {
            // A panic in there has been printed already, and the window is closing.
            thread.join().ok();
        }
    }
}

// A renderer that fails does so a thousand times a second.
const SECS_BETWEEN_ERRORS: f64 = 2.0;

fn run<S: Stage>(
    mut session: Session<S>,
    heard: &Receiver<Heard<S::World>>,
    to_itself: &Sender<Heard<S::World>>,
    report: &Arc<impl Fn(Report) + Send + Sync + 'static>,
) {
    let mut pace = Pace::default();
    let mut wanted = None;
    let mut rests = false;
    let mut next_error = Time::ZERO;
    // Since when a picture is being made beside the loop.
    let mut begun = None;
    loop {
        // Of the sizes that a window takes on while its border is dragged only the last matters, and each would cost a refresh; of
        // settings, too, and each may cost a sampler.
        let (mut size, mut settings) = (None, None);
        // Only for the first that is heard: it is answered at once.
        let mut pause = session.pause();
        loop {
            let pause = std::mem::take(&mut pause);
            let next = match (rests, pause.is_zero()) {
                (true, _) => heard.recv().map_err(|_| TryRecvError::Disconnected),
                (false, false) => heard.recv_timeout(pause).map_err(|_| TryRecvError::Empty),
                (false, true) => heard.try_recv(),
            };
            let command = match next {
                Ok(Heard::Command(command)) => command,
                Ok(Heard::PictureEnds(of)) => {
                    // Not if the loop has found out by itself, and has begun another.
                    if begun == Some(of) {
                        session.end_picture();
                    }
                    continue;
                }
                Err(TryRecvError::Empty) => break,
                Ok(Heard::End) | Err(TryRecvError::Disconnected) => return,
            };
            match command {
                Command::Rest(on) => rests = on,
                Command::Size(wanted) => size = Some(wanted),
                Command::Settings(wanted) => settings = Some(wanted),
                Command::WantPicture { memory, paint_secs } => {
                    pace.painted(paint_secs);
                    wanted = Some(memory);
                }
                command => {
                    if let Command::Mark(_) = command {
                        pace.hurry();
                    }
                    session.apply(command);
                }
            }
        }
        for command in size.map(Command::Size).into_iter().chain(settings.map(Command::Settings)) {
            session.apply(command);
        }
        let trouble = session.step().err().map(|error| error.to_string());
        if session.now() >= next_error
            && let Some(trouble) = trouble.or_else(|| session.trouble())
        {
            next_error = Time::from_secs(session.now().secs() + SECS_BETWEEN_ERRORS);
            report(Report::Error(trouble));
        }
        if session.is_making() {
            continue;
        }
        if let Some(begun) = begun.take() {
            let now = session.now();
            pace.made(now, now.secs_since(begun));
        }
        if session.is_worth_showing()
            && let Some(memory) = wanted.take_if(|_| pace.is_due(session.now()))
        {
            let begin = session.now();
            if session.can_begin_picture() {
                let (show, end) = (Arc::clone(report), to_itself.clone());
                session.begin_picture(
                    memory,
                    pace.takes_half(begin),
                    move |picture| show(Report::Picture(picture)),
                    // The loop may have ended.
                    move || drop(end.send(Heard::PictureEnds(begin))),
                );
                begun = Some(begin);
            } else {
                let picture = session.picture(memory);
                let ready = session.now();
                pace.made(ready, ready.secs_since(begin));
                report(Report::Picture(picture));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use frameless::{Clock, Size, ToneMap};
    use frameless_scene::{Projection, View};

    use super::*;
    use crate::command::Picture;
    use crate::settings::Settings;
    use crate::test_stage::Plain;

    fn start() -> RenderThread<f32> {
        start_with(Plain::new(1.0))
    }

    fn start_with(plain: Plain) -> RenderThread<f32> {
        let settings = Settings { tone_map: ToneMap::None, ..Settings::default() };
        let session = Session::new(Size::new(16, 12), Clock::real(), settings, 1, plain);
        RenderThread::start(session, || {}).unwrap()
    }

    fn next(thread: &RenderThread<f32>) -> Result<Report, Ended> {
        loop {
            match thread.report()? {
                Some(report) => return Ok(report),
                None => std::thread::yield_now(),
            }
        }
    }

    fn picture(thread: &RenderThread<f32>) -> Picture {
        thread.send(Command::WantPicture { memory: Vec::new(), paint_secs: 0.0 });
        match next(thread) {
            Ok(Report::Picture(picture)) => picture,
            other => panic!("no picture: {other:?}"),
        }
    }

    #[test]
    fn a_wish_is_answered_once_and_the_loop_goes_on() {
        let thread = start();
        while picture(&thread).status.ages.unknown > 0 {}
        assert!(picture(&thread).rgba.iter().all(|&pixel| pixel == [255; 4]));
        std::thread::sleep(std::time::Duration::from_millis(60));
        assert!(matches!(thread.report(), Ok(None)), "nobody asked");
    }

    #[test]
    fn a_picture_says_what_it_shows() {
        let thread = start();
        assert_eq!(picture(&thread).mark, 0);
        thread.send(Command::Play(false));
        thread.send(Command::Mark(7));
        assert_eq!(picture(&thread).mark, 7);
    }

    #[test]
    fn steering_does_not_wait_for_the_loop() {
        let plain = Plain::new(1.0);
        let steered = plain.steered.clone();
        let thread = start_with(plain);
        let projection = Projection::Perspective { yfov_rad: 1.0 };
        let view = View { world_from_camera: Default::default(), projection };
        thread.send(Command::View(ViewChoice::Camera(0)));
        assert_eq!(*steered.lock().unwrap(), None, "the loop may be about to open another scene");
        thread.send(Command::View(ViewChoice::Free(view)));
        assert_eq!(*steered.lock().unwrap(), Some(view));
    }

    #[test]
    fn at_rest_nothing_is_traced_and_everything_stays() {
        let thread = start();
        while picture(&thread).status.ages.unknown > 0 {}
        thread.send(Command::Rest(true));
        // A renderer that would fail at once, if it were asked.
        thread.send(Command::Scene(f32::NAN));
        thread.send(Command::WantPicture { memory: Vec::new(), paint_secs: 0.0 });
        std::thread::sleep(std::time::Duration::from_millis(100));
        assert!(matches!(thread.report(), Ok(None)));
        thread.send(Command::Scene(1.0));
        thread.send(Command::Rest(false));
        let Ok(Report::Picture(picture)) = next(&thread) else { panic!("no picture") };
        assert_eq!(picture.status.ages.unknown, 0);
        thread.send(Command::Rest(true));
        drop(thread);
    }

    #[test]
    fn a_renderer_that_fails_is_said_and_the_picture_stays() {
        let thread = start();
        while picture(&thread).status.ages.unknown > 0 {}
        thread.send(Command::Scene(f32::NAN));
        let Ok(Report::Error(text)) = next(&thread) else { panic!("no error") };
        assert!(text.contains("not finite"), "{text}");
        assert!(picture(&thread).rgba.iter().all(|&pixel| pixel == [255; 4]));
    }

    #[test]
    fn a_renderer_that_panics_ends_the_loop_and_not_the_window() {
        let thread = start();
        thread.send(Command::Scene(-1.0));
        assert!(matches!(next(&thread), Err(Ended)));
        thread.send(Command::Play(false));
    }
}
