//! The socket, and the threads behind it.

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::AtomicU32;
use std::time::Duration;

use anyhow::{Context, anyhow};
use axum::Router;
use frameless_session::Stage;
use hyper::Request;
use hyper::body::Incoming;
use hyper::service::Service;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio::sync::{Semaphore, mpsc};
use tokio::time::timeout;
use tokio_io_timeout::TimeoutStream;
use tokio_rustls::TlsAcceptor;

use crate::door::{Door, Visitor};
use crate::guard::{Guard, Refusals};
use crate::hub::{self, Event, HubHandle};
use crate::routes::{self, HEADERS_WITHIN, Shared};
use crate::{Options, Secret, Show};

/// A server that listens, but does not answer yet.
pub struct Server {
    options: Options,
    listener: TcpListener,
    address: SocketAddr,
    secret: Secret,
    tls: Option<TlsAcceptor>,
    stop: (mpsc::Sender<()>, mpsc::Receiver<()>),
}

/// Ends a server from elsewhere.
#[derive(Clone, Debug)]
pub struct Stopper(mpsc::Sender<()>);

impl Stopper {
    /// The server's [`Server::run`] returns soon.
    pub fn stop(&self) {
        // Full: it has been told already. Closed: it has ended.
        self.0.try_send(()).ok();
    }
}

/// Connections beside those of clients: pages being loaded, handshakes.
const SPARE_CONNECTIONS: usize = 64;
/// The largest is 33 MB as it is sent.
const MOST_PICTURES: usize = 2;
/// Each takes a good part of a core.
const MOST_RECORDINGS: usize = 4;
/// What one request's headers may take, in bytes.
const MOST_HEADERS: usize = 64 << 10;
/// Connections get so long to say good-bye.
const FAREWELL: Duration = Duration::from_secs(1);

impl Server {
    /// Takes the port.
    ///
    /// # Errors
    /// If the options are not safe, the port is taken, or certificates cannot be read.
    pub fn bind(options: Options) -> anyhow::Result<Server> {
        options.check()?;
        let secret = match &options.key_file {
            Some(path) => Secret::of_file(path)?,
            None => Secret::new()?,
        };
        let tls = options.tls.as_ref().map(|files| files.config()).transpose()?;
        let tls = tls.map(|config| TlsAcceptor::from(Arc::new(config)));
        let listener = TcpListener::bind(options.address).map_err(|error| {
            let (address, port) = (options.address, options.address.port());
            match error.kind() {
                std::io::ErrorKind::AddrInUse => anyhow!(
                    "{address}: port {port} is taken, perhaps by another frameless; choose one with `frameless serve --port`, or any free one with --port 0"
                ),
                _ => anyhow!("cannot listen on {address}: {error}"),
            }
        })?;
        listener.set_nonblocking(true).context("cannot listen")?;
        let address = listener.local_addr().context("cannot listen")?;
        Ok(Server { options, listener, address, secret, tls, stop: mpsc::channel(1) })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The one address to open in a browser, secret included.
    pub fn url(&self) -> String {
        let scheme = if self.tls.is_some() { "https" } else { "http" };
        let names = self.options.names();
        let name = names.first().map_or("localhost", String::as_str);
        format!("{scheme}://{name}:{}/?key={}", self.address.port(), self.secret.as_str())
    }

    /// Ends [`Server::run`].
    pub fn stopper(&self) -> Stopper {
        Stopper(self.stop.0.clone())
    }

    /// Serves until it is stopped, or the renderer ends.
    ///
    /// # Errors
    /// If the system has no thread left, or the renderer has stopped.
    pub fn run<S: Stage + Send + 'static>(mut self, mut show: Show<S>) -> anyhow::Result<()> {
        if let Some(scenes) = &mut show.scenes {
            let (wanted, most) = (self.options.upload_bytes, scenes.opener.limits.file_bytes);
            if wanted > most {
                log::warn!(
                    "uploads of {wanted} bytes were allowed, but no scene may have more than {most}: that is the limit"
                );
            }
            scenes.opener.limits.file_bytes = most.min(wanted);
        }
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            // One for each client that is being encoded for; more wait.
            .max_blocking_threads(4)
            .thread_name("web")
            .enable_all()
            .build()
            .context("cannot start the web server's threads")?;
        let upload_bytes = show.scenes.as_ref().map_or(0, |scenes| scenes.opener.limits.file_bytes);
        let (hub, thread) = hub::start(show, self.options.rests_after, runtime.handle().clone())?;
        let router = routes::router(Arc::new(self.shared(hub.clone(), upload_bytes)));
        runtime.block_on(self.listen(router, &hub));
        // The hub tells the clients, which end by themselves; if it has ended before, it is not told.
        runtime.block_on(hub.events.send(Event::Stop)).ok();
        let ended = thread.join().unwrap_or_else(|_| Err(anyhow!("the web server has failed")));
        runtime.shutdown_timeout(FAREWELL);
        ended
    }

    fn shared(&self, hub: HubHandle, upload_bytes: u64) -> Shared {
        let guard = Guard {
            secret: self.secret.clone(),
            names: self.options.names(),
            tls: self.tls.is_some(),
        };
        Shared {
            guard,
            refusals: Refusals::default(),
            frame_ancestors: self.options.allow_frame.clone().unwrap_or("'none'".to_owned()),
            hub,
            upload_bytes,
            stalled: self.options.stalled,
            clients: self.options.clients,
            seats: Arc::new(Semaphore::new(self.options.clients)),
            pictures: Arc::new(Semaphore::new(MOST_PICTURES)),
            uploading: Arc::new(Semaphore::new(1)),
            recording: Arc::new(Semaphore::new(MOST_RECORDINGS)),
            next_client: AtomicU32::new(1),
        }
    }

    async fn listen(&mut self, router: Router, hub: &HubHandle) {
        let Ok(listener) = self.listener.try_clone().and_then(tokio::net::TcpListener::from_std)
        else {
            return;
        };
        let door = Door::new(self.options.clients + SPARE_CONNECTIONS);
        loop {
            let accepted = tokio::select! {
                accepted = listener.accept() => accepted,
                _ = self.stop.1.recv() => return,
                () = hub.events.closed() => return,
            };
            let Ok((stream, _)) = accepted else {
                // No file descriptor left: some may be freed soon.
                tokio::time::sleep(Duration::from_millis(20)).await;
                continue;
            };
            // Nobody makes room: closed at once.
            let Some((visitor, place)) = door.enter().await else { continue };
            let (router, tls) = (router.clone(), self.tls.clone());
            let stalled = self.options.stalled;
            tokio::spawn(async move {
                tokio::select! {
                    () = converse(stream, stalled, tls, router, Arc::clone(&visitor)) => {}
                    () = visitor.has_to_go() => {}
                }
                drop(place);
            });
        }
    }
}

/// One connection, to its end. That it breaks off is its own affair.
async fn converse(
    stream: TcpStream,
    stalled: Duration,
    tls: Option<TlsAcceptor>,
    router: Router,
    visitor: Arc<Visitor>,
) {
    // Small messages are not to wait for others.
    stream.set_nodelay(true).ok();
    // Who reads nothing for so long of what is there for it has gone.
    let mut stream = Box::pin(TimeoutStream::new(stream));
    stream.as_mut().set_write_timeout_pinned(Some(stalled));
    match tls {
        None => answer(stream, router, visitor).await,
        Some(tls) => {
            if let Ok(Ok(stream)) = timeout(HEADERS_WITHIN, tls.accept(stream)).await {
                answer(stream, router, visitor).await;
            }
        }
    }
}

async fn answer(
    stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
    router: Router,
    visitor: Arc<Visitor>,
) {
    let mut http = hyper::server::conn::http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEADERS_WITHIN).max_buf_size(MOST_HEADERS);
    let router = TowerToHyperService::new(router);
    // The guard says who has shown the secret.
    let service = hyper::service::service_fn(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(Arc::clone(&visitor));
        router.call(request)
    });
    http.serve_connection(TokioIo::new(stream), service).with_upgrades().await.ok();
}
