//! A frameless picture on a web page, as it is being traced: one URL, safe by default, and no frames in the stream either.
//!
//! [`Server::bind`] takes a port and makes a secret; [`Server::run`] serves a [`Show`]: a session of any renderer, and the camera on
//! it. The render loop runs in a thread of its own and hands pictures to the hub (`hub`), which publishes those in which something
//! changed; every client's connection (`client`) sends the tiles that its canvas misses most, as much as its link takes (`tiles`).
//! The bytes are specified in docs/stream-format.md (`wire`). Who is let in: `guard`, and SECURITY.md.

mod client;
mod door;
mod downloads;
mod guard;
mod hub;
mod legend;
mod mailbox;
mod options;
mod page;
mod record;
mod roster;
mod routes;
mod secret;
mod server;
mod settings;
mod show;
mod tiles;
mod upload;
pub mod wire;

pub use options::{DEFAULT_PORT, DEFAULT_UPLOAD_BYTES, Options, TlsFiles};
pub use secret::Secret;
pub use server::{Server, Stopper};
pub use settings::MOST_PIXELS;
pub use show::{Prepare, Scenes, Show};
