//! What the hub has to say to one client. Bounded: of what is a state only the newest waits, of what is news the newest few.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::Notify;

/// Notices that wait; more would be a page that nobody reads.
const MOST_NOTICES: usize = 16;

/// One client's.
#[derive(Default)]
pub(crate) struct Mailbox {
    waiting: Mutex<Waiting>,
    arrived: Notify,
}

#[derive(Default)]
struct Waiting {
    states: [Option<Arc<str>>; Kind::COUNT],
    notices: VecDeque<Arc<str>>,
    closed: bool,
}

/// Messages of which only the newest counts, in the order in which they are sent.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    Welcome,
    Scene,
    State,
    Legend,
}

impl Kind {
    const COUNT: usize = 4;
}

impl Mailbox {
    /// Replaces an older message of that kind.
    pub(crate) fn put(&self, kind: Kind, message: Arc<str>) {
        self.change(|waiting| waiting.states[kind as usize] = Some(message));
    }

    /// Something for the user to read.
    pub(crate) fn notice(&self, message: Arc<str>) {
        self.change(|waiting| {
            if waiting.notices.len() == MOST_NOTICES {
                waiting.notices.pop_front();
            }
            waiting.notices.push_back(message);
        });
    }

    /// There will be no more.
    pub(crate) fn close(&self) {
        self.change(|waiting| waiting.closed = true);
    }

    /// Waits for a message; None once it is closed. Nothing is lost if this is given up.
    pub(crate) async fn next(&self) -> Option<Arc<str>> {
        loop {
            let arrived = self.arrived.notified();
            if let Some(next) = self.take() {
                return next;
            }
            arrived.await;
        }
    }

    /// The next message; `Some(None)`: closed; `None`: nothing yet.
    fn take(&self) -> Option<Option<Arc<str>>> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        let state = waiting.states.iter_mut().find_map(Option::take);
        match state.or_else(|| waiting.notices.pop_front()) {
            None if waiting.closed => Some(None),
            None => None,
            message => Some(message),
        }
    }

    fn change(&self, change: impl FnOnce(&mut Waiting)) {
        change(&mut self.waiting.lock().unwrap_or_else(PoisonError::into_inner));
        self.arrived.notify_one();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn of_states_the_newest_comes_and_of_notices_the_last_few() {
        let mailbox = Mailbox::default();
        mailbox.put(Kind::State, "old".into());
        mailbox.put(Kind::State, "new".into());
        (0..100).for_each(|i| mailbox.notice(format!("{i}").into()));
        mailbox.put(Kind::Welcome, "welcome".into());
        mailbox.close();
        let mut came = Vec::new();
        while let Some(message) = mailbox.next().await {
            came.push(message.to_string());
        }
        assert_eq!(came[..3], ["welcome", "new", "84"]);
        assert_eq!(came.len(), 2 + MOST_NOTICES);
    }
}
