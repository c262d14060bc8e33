//! What happened, said in the window.

use std::sync::mpsc::{Receiver, Sender, channel};

use eframe::egui::Color32;

use crate::hud::Line;
use crate::theme;

/// The newest messages, each for a while.
pub(crate) struct Messages {
    shown: Vec<Message>,
    sender: Sender<anyhow::Result<String>>,
    receiver: Receiver<anyhow::Result<String>>,
}

struct Message {
    text: String,
    colour: Color32,
    until_secs: f64,
}

// Long enough to read a path.
const INFO_SECS: f64 = 6.0;
// Long enough to be seen by somebody who looked away; Esc dismisses it.
const ERROR_SECS: f64 = 30.0;
// More would hide the picture.
const MOST: usize = 4;

impl Default for Messages {
    fn default() -> Self {
        let (sender, receiver) = channel();
        Messages { shown: Vec::new(), sender, receiver }
    }
}

impl Messages {
    /// Something was done.
    pub(crate) fn info(&mut self, text: String, now_secs: f64) {
        log::info!("{text}");
        self.push(Message { text, colour: theme::TEXT, until_secs: now_secs + INFO_SECS });
    }

    /// Something went wrong.
    pub(crate) fn error(&mut self, text: String, now_secs: f64) {
        // A state is said again as long as it lasts: no second line for it.
        match self.shown.iter_mut().find(|message| message.text == text) {
            Some(message) => message.until_secs = now_secs + ERROR_SECS,
            None => {
                log::error!("{text}");
                let until_secs = now_secs + ERROR_SECS;
                self.push(Message { text, colour: theme::ERROR, until_secs });
            }
        }
    }

    /// Does something slow in a thread of its own, and says then how it went.
    pub(crate) fn later(&self, work: impl FnOnce() -> anyhow::Result<String> + Send + 'static) {
        let sender = self.sender.clone();
        std::thread::spawn(move || {
            // Fails if the window has been closed.
            sender.send(work()).ok();
        });
    }

    /// Takes the messages of [`Messages::later`].
    pub(crate) fn receive(&mut self, now_secs: f64) {
        while let Ok(message) = self.receiver.try_recv() {
            match message {
                Ok(text) => self.info(text, now_secs),
                Err(error) => self.error(format!("{error:#}"), now_secs),
            }
        }
    }

    /// What is to be shown, oldest first.
    pub(crate) fn lines(&mut self, now_secs: f64) -> Vec<Line> {
        self.shown.retain(|message| message.until_secs > now_secs);
        let line = |message: &Message| Line { text: message.text.clone(), colour: message.colour };
        self.shown.iter().map(line).collect()
    }

    /// The user has read them.
    pub(crate) fn clear(&mut self) {
        self.shown.clear();
    }

    fn push(&mut self, message: Message) {
        if self.shown.len() == MOST {
            self.shown.remove(0);
        }
        self.shown.push(message);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(messages: &mut Messages, now_secs: f64) -> Vec<String> {
        messages.lines(now_secs).into_iter().map(|line| line.text).collect()
    }

    #[test]
    fn messages_go_away_and_errors_stay_longer() {
        let mut messages = Messages::default();
        messages.info("saved".to_owned(), 0.0);
        messages.error("broken".to_owned(), 0.0);
        assert_eq!(texts(&mut messages, 1.0), ["saved", "broken"]);
        assert_eq!(texts(&mut messages, INFO_SECS + 1.0), ["broken"]);
        assert!(texts(&mut messages, ERROR_SECS + 1.0).is_empty());
    }

    #[test]
    fn a_repeated_error_is_one_line() {
        let mut messages = Messages::default();
        (0..50).for_each(|i| messages.error("broken".to_owned(), f64::from(i)));
        assert_eq!(texts(&mut messages, 50.0), ["broken"]);
        (0..50).for_each(|i| messages.error(format!("broken {i}"), 50.0));
        assert_eq!(texts(&mut messages, 50.0).len(), MOST);
    }

    #[test]
    fn slow_work_reports_when_it_is_done() {
        let mut messages = Messages::default();
        messages.later(|| anyhow::bail!("disk full"));
        while texts(&mut messages, 0.0).is_empty() {
            messages.receive(0.0);
        }
        assert_eq!(texts(&mut messages, 0.0), ["disk full"]);
    }
}
