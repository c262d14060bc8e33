//! What the hub is told, and what it tells everybody.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use frameless_session::Status;
use tokio::sync::{mpsc, oneshot, watch};

use crate::Secret;
use crate::mailbox::Mailbox;
use crate::tiles::Published;
use crate::wire::Said;

/// A client that says more waits, and its link with it.
pub(crate) const MOST_WAITING: usize = 256;

/// What the hub is told.
pub(crate) enum Event {
    /// A client more.
    Join(Joining),
    /// A client less.
    Leave(u32),
    /// What a client wants.
    Said(u32, Said),
    /// Whether the client with that token may send a file; answered with its number.
    MayUpload { token: String, answer: oneshot::Sender<Result<u32, UploadRefused>> },
    /// A client's file.
    Upload(Upload),
    /// The loop has news.
    Woken,
    /// End.
    Stop,
}

/// A client that has just connected.
pub(crate) struct Joining {
    pub(crate) client: u32,
    /// By which it, and nobody else, can be recognised.
    pub(crate) token: Secret,
    /// The token that it had before its connection was lost: what is left of that one goes, and what it had is this one's.
    pub(crate) resumes: Option<String>,
    pub(crate) mailbox: Arc<Mailbox>,
}

/// A file that a client would like to see.
pub(crate) struct Upload {
    pub(crate) client: u32,
    /// For messages.
    pub(crate) name: String,
    pub(crate) bytes: Vec<u8>,
    /// Told once it is open, or why not.
    pub(crate) answer: oneshot::Sender<Result<String, UploadRefused>>,
}

/// Why an upload is not shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum UploadRefused {
    /// No client has that token.
    Stranger,
    /// The client does not drive.
    NotDriving,
    /// Another is being opened.
    Busy,
    /// The renderer takes no scenes.
    NoScenes,
    /// The loader's reason.
    Bad(String),
}

/// The newest status of the loop.
#[derive(Clone, Debug, Default)]
pub(crate) struct LoopStatus {
    /// None before the first picture.
    pub(crate) status: Option<Status>,
    /// The scene's time moves.
    pub(crate) playing: bool,
}

/// What everybody else has of the hub.
#[derive(Clone)]
pub(crate) struct HubHandle {
    pub(crate) events: mpsc::Sender<Event>,
    pub(crate) pictures: watch::Receiver<Option<Arc<Published>>>,
    pub(crate) statuses: watch::Receiver<LoopStatus>,
    // Nanoseconds that showing the last picture has cost, all clients together.
    pub(super) painted: Arc<AtomicU64>,
    // Bytes of what moves in one picture: the most that a client has been sent since then.
    pub(super) moved_bytes: Arc<AtomicU64>,
    // The number of the last picture that a client has drawn, every bit of it.
    pub(super) drawn: Arc<AtomicU32>,
    // Those who want pictures and are no clients.
    pub(super) lookers: Arc<AtomicUsize>,
}

/// As long as it lives pictures are made, whether there are clients or not.
pub(crate) struct Looking(Arc<AtomicUsize>);

impl Drop for Looking {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl HubHandle {
    /// Choosing and encoding tiles took so long.
    pub(crate) fn painted(&self, took: Duration) {
        self.painted.fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
    }

    /// Somebody who is no client wants pictures.
    pub(crate) fn look(&self) -> Looking {
        self.lookers.fetch_add(1, Ordering::Relaxed);
        // Where the inbox is full the hub is awake.
        self.events.try_send(Event::Woken).ok();
        Looking(Arc::clone(&self.lookers))
    }

    /// A client has drawn all of a picture.
    pub(crate) fn drawn(&self, number: u32) {
        self.drawn.fetch_max(number, Ordering::Relaxed);
    }

    /// A client is being sent so many bytes of what moves in one picture.
    pub(crate) fn moved(&self, bytes: usize) {
        self.moved_bytes.fetch_max(bytes as u64, Ordering::Relaxed);
    }
}
