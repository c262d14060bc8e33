//! The render loop in a thread of its own: neither the window nor the loop ever waits for the other.

use std::io;
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
    // Taken on drop: that the channel is closed is the sign to end.
    commands: Option<Sender<Command<W>>>,
    reports: Receiver<Report>,
    steering: Option<Steering>,
    thread: Option<JoinHandle<()>>,
}

/// The loop has ended, which it does by itself only when the renderer panics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended;

impl<W: Send + 'static> RenderThread<W> {
    /// Starts the loop. `wake` is called after every report.
    ///
    /// # Errors
    /// If the system has no thread left.
    pub fn start<S: Stage<World = W> + Send + 'static>(
        session: Session<S>,
        wake: impl Fn() + Send + 'static,
    ) -> io::Result<RenderThread<W>> {
        let (to_loop, commands) = channel();
        let (to_window, reports) = channel();
        let steering = session.steering();
        let thread = Builder::new()
            .name(LOOP_THREAD.to_owned())
            .spawn(move || run(session, &commands, &to_window, wake))?;
        Ok(RenderThread { commands: Some(to_loop), reports, steering, thread: Some(thread) })
    }

    /// Ask for something. Lost if the loop has ended, which [`RenderThread::report`] says.
    pub fn send(&self, command: Command<W>) {
        // Input does not wait for the loop's next turn. Only what makes sense in any scene: the loop may be about to open another.
        if let (Command::View(ViewChoice::Free(view)), Some(steer)) = (&command, &self.steering) {
            steer(*view);
        }
        if let Some(commands) = &self.commands {
            commands.send(command).ok();
        }
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
        self.commands = None;
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
    commands: &Receiver<Command<S::World>>,
    reports: &Sender<Report>,
    wake: impl Fn(),
) {
    let mut pace = Pace::default();
    let mut wanted = None;
    let mut rests = false;
    let mut next_error = Time::ZERO;
    // Sending fails once the window is gone; then the channel of commands is closed, too.
    let report = |report| {
        reports.send(report).ok();
        wake();
    };
    loop {
        // Of the sizes that a window takes on while its border is dragged only the last matters, and each would cost a refresh; of
        // settings, too, and each may cost a sampler.
        let (mut size, mut settings) = (None, None);
        loop {
            let next = match rests {
                true => commands.recv().map_err(|_| TryRecvError::Disconnected),
                false => commands.try_recv(),
            };
            match next {
                Ok(Command::Rest(on)) => rests = on,
                Ok(Command::Size(wanted)) => size = Some(wanted),
                Ok(Command::Settings(wanted)) => settings = Some(wanted),
                Ok(Command::WantPicture { memory, paint_secs }) => {
                    pace.painted(paint_secs);
                    wanted = Some(memory);
                }
                Ok(command) => {
                    if let Command::Mark(_) = command {
                        pace.hurry();
                    }
                    session.apply(command);
                }
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => return,
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
        if let Some((picture, secs)) = session.take_picture() {
            pace.made_beside(session.now(), secs);
            report(Report::Picture(picture));
        }
        let may = wanted.is_some() && session.is_worth_showing() && !session.is_making();
        if may && pace.is_due(session.now()) {
            let begin = session.now();
            let memory = wanted.take().unwrap_or_default();
            // Who waits for an answer gets it from all threads.
            let memory = match pace.is_hurried() {
                true => memory,
                false => match session.begin_picture(memory) {
                    Ok(()) => continue,
                    Err(memory) => memory,
                },
            };
            session.work_ahead(pace.ahead_secs(begin));
            let picture = session.picture(memory);
            let ready = session.now();
            pace.made(ready, ready.secs_since(begin));
            report(Report::Picture(picture));
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
