//! What the hub is told, and what it tells everybody.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use frameless_session::Status;
use tokio::sync::{mpsc, oneshot, watch};

use crate::mailbox::Mailbox;
use crate::tiles::Published;
use crate::wire::Said;

/// A client that says more waits, and its link with it.
pub(crate) const MOST_WAITING: usize = 256;

/// What the hub is told.
pub(crate) enum Event {
    /// A client more.
    Join { client: u32, mailbox: Arc<Mailbox> },
    /// A client less.
    Leave(u32),
    /// What a client wants.
    Said(u32, Said),
    /// A client's file.
    Upload(Upload),
    /// The loop has news.
    Woken,
    /// End.
    Stop,
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
    // Bytes of the largest message since then of what moves.
    pub(super) moved_bytes: Arc<AtomicU64>,
}

impl HubHandle {
    /// Choosing and encoding tiles took so long.
    pub(crate) fn painted(&self, took: Duration) {
        self.painted.fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
    }

    /// A client is being sent so many bytes of what moves.
    pub(crate) fn moved(&self, bytes: usize) {
        self.moved_bytes.fetch_max(bytes as u64, Ordering::Relaxed);
    }
}
