//! A running server, and a client that draws what it is sent.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use frameless::{Clock, Size};
use frameless_scene::{Scene, builtin};
use frameless_session::{Helm, Opener, PictureSize, Session, Settings, Stage};
use frameless_trace::{CpuTracer, ViewSource, World};
use frameless_web::wire::{Ack, StatusMessage, TilesHeader};
use frameless_web::{Options, Prepare, Scenes, Server, Show, Stopper};
use image::RgbImage;
use serde_json::Value;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::{self, Message, WebSocket};

/// A server in a thread of its own; ends when dropped.
pub(crate) struct Running {
    pub(crate) address: SocketAddr,
    pub(crate) key: String,
    stopper: Stopper,
    thread: Option<JoinHandle<anyhow::Result<()>>>,
}

/// Any free port of this machine.
pub(crate) fn options() -> Options {
    Options { address: ([127, 0, 0, 1], 0).into(), ..Options::default() }
}

/// The built-in scene `sphere` at 160×120.
pub(crate) fn start(options: Options) -> Running {
    start_at(options, Size::new(160, 120))
}

pub(crate) fn start_at(options: Options, size: Size) -> Running {
    let scene = Arc::new(builtin("sphere").expect("built in"));
    let prepare = |scene: &Arc<Scene>| Ok(Arc::new(World::new(Arc::clone(scene))));
    let tracing = frameless_trace::Settings::default();
    let world = Arc::new(World::new(Arc::clone(&scene)));
    let tracer = CpuTracer::new(world, ViewSource::Camera(0), tracing, 1);
    start_with(options, size, tracer, Some(Arc::new(prepare)))
}

/// Any renderer; without `prepare` it takes no other scenes.
pub(crate) fn start_with<S: Stage + Send + 'static>(
    options: Options,
    size: Size,
    stage: S,
    prepare: Option<Prepare<S::World>>,
) -> Running {
    let server = Server::bind(options).unwrap();
    let address = server.address();
    let url = server.url();
    let key = url.rsplit_once("?key=").expect("the address holds the key").1.to_owned();
    let stopper = server.stopper();
    let settings = Settings { picture: PictureSize::Fixed(size), ..Settings::default() };
    let show = Show {
        session: Session::new(size, Clock::real(), settings, 1, stage),
        helm: Helm::new(Arc::new(builtin("sphere").expect("built in"))),
        scenes: prepare.map(|prepare| Scenes { opener: Opener::default(), prepare }),
    };
    let thread = std::thread::spawn(move || server.run(show));
    Running { address, key, stopper, thread: Some(thread) }
}

impl Running {
    /// Header lines that let a request in.
    pub(crate) fn pass(&self) -> String {
        let port = self.address.port();
        format!("Host: localhost:{port}\r\nCookie: frameless-{port}={}\r\n", self.key)
    }

    pub(crate) fn origin(&self) -> String {
        format!("http://localhost:{}", self.address.port())
    }

    /// Sends bytes on a new connection, and reads the answer to its end or until nothing comes.
    pub(crate) fn ask(&self, request: &[u8]) -> Answer {
        let mut stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        // A server that has refused already may have closed.
        stream.write_all(request).ok();
        Answer::read(&mut stream, request.starts_with(b"HEAD "))
    }

    /// A `GET` that is let in.
    pub(crate) fn get(&self, path: &str) -> Answer {
        let pass = self.pass();
        self.ask(format!("GET {path} HTTP/1.1\r\n{pass}Connection: close\r\n\r\n").as_bytes())
    }

    /// Ends it, and says how it ended.
    pub(crate) fn end(mut self) -> anyhow::Result<()> {
        self.stopper.stop();
        self.thread.take().expect("it runs").join().expect("it does not panic")
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stopper.stop();
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
    }
}

/// Of an HTTP request.
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    /// Head and, as far as its length is announced or the connection closes, body.
    pub(crate) fn read(stream: &mut TcpStream, is_head: bool) -> Answer {
        let (mut bytes, mut piece) = (Vec::new(), [0; 65536]);
        loop {
            let end = bytes.windows(4).position(|four| four == b"\r\n\r\n");
            if let Some(end) = end {
                let head = String::from_utf8_lossy(&bytes[..end]).to_ascii_lowercase();
                let length = head.lines().find_map(|line| line.strip_prefix("content-length: "));
                let announced = length.and_then(|length| length.parse().ok());
                let length = if is_head { Some(0) } else { announced };
                let body = &bytes[end + 4..];
                let upgraded = head.starts_with("http/1.1 101");
                if upgraded || length.is_some_and(|length: usize| body.len() >= length) {
                    let status = head.split(' ').nth(1).and_then(|code| code.parse().ok());
                    return Answer { status: status.unwrap_or(0), body: body.to_vec(), head };
                }
            }
            match stream.read(&mut piece) {
                Ok(0) | Err(_) if end.is_none() => {
                    return Answer { status: 0, head: String::new(), body: bytes };
                }
                Ok(0) | Err(_) => {
                    let head =
                        String::from_utf8_lossy(&bytes[..end.unwrap_or(0)]).to_ascii_lowercase();
                    let status = head.split(' ').nth(1).and_then(|code| code.parse().ok());
                    let body = bytes[end.unwrap_or(0) + 4..].to_vec();
                    return Answer { status: status.unwrap_or(0), head, body };
                }
                Ok(count) => bytes.extend_from_slice(&piece[..count]),
            }
        }
    }

    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        let prefix = format!("{name}: ");
        self.head.lines().find_map(|line| line.strip_prefix(&prefix))
    }
}

/// What a client is told.
#[derive(Debug)]
pub(crate) enum Received {
    Tiles(TilesHeader),
    Status(StatusMessage),
    Json(Value),
    /// The connection has ended, with this code if it said why.
    Closed(Option<u16>),
    /// Something binary, to a client that does not draw.
    Unread,
    /// Nothing within the time.
    Nothing,
}

/// A page without a browser.
pub(crate) struct Client {
    pub(crate) socket: WebSocket<TcpStream>,
    pub(crate) canvas: RgbImage,
    pub(crate) number: u32,
    /// By which the server recognises it.
    pub(crate) token: String,
    pub(crate) bytes: usize,
    /// Whether it looks at what it is sent.
    pub(crate) draws: bool,
    generation: u32,
    sequence: u32,
}

/// How long anything may take here: far longer than it does.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

impl Client {
    /// Connects, and waits for the welcome.
    pub(crate) fn connect(running: &Running) -> Client {
        Client::try_connect(running).expect("let in").welcomed()
    }

    /// Connects as a page does whose connection was lost.
    pub(crate) fn resume(running: &Running, token: &str) -> Client {
        let path = format!("/stream?resume={token}");
        Client::try_connect_to(running, &path).expect("let in").welcomed()
    }

    fn welcomed(mut self) -> Client {
        let welcome = self.json("welcome");
        self.number = welcome["client"].as_u64().expect("a number") as u32;
        self.token = welcome["token"].as_str().expect("a token").to_owned();
        self
    }

    /// The status if it is not let in.
    pub(crate) fn try_connect(running: &Running) -> Result<Client, u16> {
        Client::try_connect_to(running, "/stream")
    }

    fn try_connect_to(running: &Running, path: &str) -> Result<Client, u16> {
        let port = running.address.port();
        let mut request =
            format!("ws://localhost:{port}{path}").into_client_request().expect("an address");
        let cookie = format!("frameless-{port}={}", running.key);
        request.headers_mut().insert("Cookie", cookie.parse().expect("a header"));
        request.headers_mut().insert("Origin", running.origin().parse().expect("a header"));
        let stream = TcpStream::connect(running.address).expect("it listens");
        stream.set_read_timeout(Some(Duration::from_millis(100))).expect("a time-out");
        stream.set_nodelay(true).expect("no delay");
        let begin = Instant::now();
        let mut shaking = tungstenite::client(request, stream);
        let socket = loop {
            match shaking {
                Ok((socket, _)) => break socket,
                Err(tungstenite::HandshakeError::Interrupted(more))
                    if begin.elapsed() < PATIENCE =>
                {
                    shaking = more.handshake();
                }
                Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(response))) => {
                    return Err(response.status().as_u16());
                }
                Err(other) => panic!("no handshake: {other}"),
            }
        };
        let canvas = RgbImage::new(1, 1);
        Ok(Client {
            socket,
            canvas,
            number: 0,
            token: String::new(),
            bytes: 0,
            draws: true,
            generation: 0,
            sequence: 0,
        })
    }

    pub(crate) fn say(&mut self, json: &str) {
        self.socket.send(Message::text(json)).expect("it is connected");
    }

    pub(crate) fn acknowledge(&mut self, sequence: u32) {
        let ack = Ack { sequence }.to_bytes().to_vec();
        self.socket.send(Message::binary(ack)).expect("it is connected");
    }

    /// The next message. Tiles are drawn, and not acknowledged.
    pub(crate) fn receive(&mut self, within: Duration) -> Received {
        let end = Instant::now() + within;
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => {
                    self.bytes += text.len() + 4;
                    return Received::Json(serde_json::from_str(&text).expect("JSON"));
                }
                Ok(Message::Binary(bytes)) => {
                    self.bytes += bytes.len() + 4;
                    return match bytes[0] {
                        _ if !self.draws => Received::Unread,
                        1 => Received::Tiles(self.draw(&bytes)),
                        2 => Received::Status(StatusMessage::parse(&bytes).expect("a status")),
                        other => panic!("a message of type {other}"),
                    };
                }
                Ok(Message::Close(frame)) => {
                    return Received::Closed(frame.map(|frame| frame.code.into()));
                }
                Ok(_) => self.bytes += 6,
                Err(tungstenite::Error::Io(error))
                    if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) =>
                {
                    if Instant::now() >= end {
                        return Received::Nothing;
                    }
                }
                Err(_) => return Received::Closed(None),
            }
            if Instant::now() >= end {
                return Received::Nothing;
            }
        }
    }

    /// The next message; tiles are acknowledged.
    pub(crate) fn next(&mut self) -> Received {
        let received = self.receive(PATIENCE);
        if let Received::Tiles(header) = &received {
            self.acknowledge(header.sequence);
        }
        received
    }

    /// Goes on until `wanted` has found what it looks for.
    pub(crate) fn until<T>(
        &mut self,
        what: &str,
        mut wanted: impl FnMut(&mut Client, &Received) -> Option<T>,
    ) -> T {
        let end = Instant::now() + PATIENCE;
        loop {
            let received = self.next();
            assert!(!matches!(received, Received::Closed(_)), "closed before {what}: {received:?}");
            assert!(Instant::now() < end, "{what} has not come");
            if let Some(found) = wanted(self, &received) {
                return found;
            }
        }
    }

    /// The next JSON message of that type.
    pub(crate) fn json(&mut self, kind: &str) -> Value {
        self.until(kind, |_, received| match received {
            Received::Json(json) if json["type"] == kind => Some(json.clone()),
            _ => None,
        })
    }

    /// The next notice in which that stands.
    pub(crate) fn notice(&mut self, part: &str) {
        self.until(part, |_, received| match received {
            Received::Json(json) if json["type"] == "notice" => {
                json["text"].as_str().is_some_and(|text| text.contains(part)).then_some(())
            }
            _ => None,
        });
    }

    /// The next state of which that holds.
    pub(crate) fn state(&mut self, what: &str, holds: impl Fn(&Value) -> bool) -> Value {
        self.until(what, |_, received| match received {
            Received::Json(json) if json["type"] == "state" && holds(json) => Some(json.clone()),
            _ => None,
        })
    }

    /// Until the canvas is said to be the server's picture; checks that it is.
    pub(crate) fn exact(&mut self) -> StatusMessage {
        self.until("the exact picture", |client, received| match received {
            Received::Status(status) if status.exact => {
                let crc = crc32fast::hash(client.canvas.as_raw());
                assert_eq!(crc, status.crc, "the canvas is not the server's picture");
                Some(*status)
            }
            _ => None,
        })
    }

    fn draw(&mut self, bytes: &[u8]) -> TilesHeader {
        let (header, payload) = TilesHeader::parse(bytes).expect("tiles");
        assert_eq!(header.sequence, self.sequence + 1, "without gaps");
        self.sequence = header.sequence;
        let (width, height) = (u32::from(header.width), u32::from(header.height));
        if header.generation != self.generation {
            self.generation = header.generation;
            self.canvas = RgbImage::new(width, height);
        }
        assert_eq!(self.canvas.dimensions(), (width, height));
        let atlas = image::load_from_memory(payload).expect("a picture").to_rgb8();
        let side = u32::from(header.side);
        let columns = width.div_ceil(side);
        for (k, &tile) in header.tiles.iter().enumerate() {
            let (k, tile) = (k as u32, u32::from(tile));
            let (x, y) = (tile % columns * side, tile / columns * side);
            let from = (k % u32::from(header.columns) * side, k / u32::from(header.columns) * side);
            for (dx, dy) in (0..side * side).map(|i| (i % side, i / side)) {
                if x + dx < width && y + dy < height {
                    let pixel = *atlas.get_pixel(from.0 + dx, from.1 + dy);
                    self.canvas.put_pixel(x + dx, y + dy, pixel);
                }
            }
        }
        header
    }
}
