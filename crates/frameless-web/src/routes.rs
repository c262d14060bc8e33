//! What there is to ask for, behind the guard.

use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, Query, Request, State};
use axum::http::header::{self, HeaderName, HeaderValue};
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde::Deserialize;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc, oneshot};

use crate::client;
use crate::guard::{Admission, Guard};
use crate::hub::{Event, HubHandle, Upload, UploadRefused};
use crate::tiles::Published;
use crate::wire::LONGEST_MESSAGE;

/// What is too long is read so far, so that the client can be told; from more the connection breaks off.
const LONGEST_READ: usize = 2 * LONGEST_MESSAGE;
use crate::{page, record};

/// What every request may need.
pub(crate) struct Shared {
    pub(crate) guard: Guard,
    /// Who may show the page in a frame, in the words of a content-security policy.
    pub(crate) frame_ancestors: String,
    pub(crate) hub: HubHandle,
    pub(crate) upload_bytes: u64,
    /// See [`crate::Options::stalled`].
    pub(crate) stalled: Duration,
    /// Clients that may still connect.
    pub(crate) seats: Arc<Semaphore>,
    /// One upload at a time: each may be large.
    pub(crate) uploading: Arc<Semaphore>,
    /// Recordings that may still begin.
    pub(crate) recording: Arc<Semaphore>,
    pub(crate) next_client: AtomicU32,
}

type App = State<Arc<Shared>>;

/// The routes, with the guard in front of all of them and of what is none.
pub(crate) fn router(shared: Arc<Shared>) -> Router {
    Router::new()
        .route("/", get(async || html(page::INDEX.to_owned())))
        .route("/stream", get(stream))
        .route("/picture.png", get(picture))
        .route("/recording.mp4", get(recording))
        .route("/upload", post(upload))
        .route("/{file}", get(file))
        .fallback(async || StatusCode::NOT_FOUND)
        .layer(middleware::from_fn_with_state(Arc::clone(&shared), guarded))
        .with_state(shared)
}

/// The one way in.
async fn guarded(State(shared): App, request: Request, next: Next) -> Response {
    let guard = &shared.guard;
    let host = request.headers().get(header::HOST).cloned();
    let admission = guard.check(request.method(), request.uri(), request.headers());
    let mut response = match admission {
        Ok(Admission::Enter) => next.run(request).await,
        Ok(Admission::Exchange) => exchange(guard),
        Err(_) => (StatusCode::FORBIDDEN, TURNED_AWAY).into_response(),
    };
    // Of a request that is let in the host is one of ours.
    let host = admission.ok().and(host);
    let host = host.as_ref().and_then(|host| host.to_str().ok());
    protect(response.headers_mut(), host, &shared.frame_ancestors);
    response
}

const TURNED_AWAY: &str = "This page needs the whole address that frameless printed when it was started: it ends in ?key= and \
     a long number. After a restart there is a new one.\n";

/// Gives the cookie, and leads on to the page. A redirect would not do: following a link from another site (a terminal in a browser), browsers
/// leave strict cookies out of the redirected request, too.
fn exchange(guard: &Guard) -> Response {
    let secure = if guard.tls { "; Secure" } else { "" };
    let secret = guard.secret.as_str();
    let cookie = format!("{}={secret}; HttpOnly; SameSite=Strict; Path=/{secure}", guard.cookie);
    let page = "<!doctype html><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" content=\"0;url=/\">\
                <title>frameless</title><a href=\"/\">frameless</a>";
    let mut response = html(page.to_owned());
    if let Ok(cookie) = HeaderValue::from_str(&cookie) {
        response.headers_mut().insert(header::SET_COOKIE, cookie);
    }
    response
}

/// What browsers are told not to do.
fn protect(headers: &mut HeaderMap, host: Option<&str>, frame_ancestors: &str) {
    // 'self' covers WebSockets in new browsers only.
    let sockets = host.map(|host| format!(" ws://{host} wss://{host}")).unwrap_or_default();
    let policy = format!(
        "default-src 'self'; connect-src 'self'{sockets}; img-src 'self' blob:; media-src 'self' blob:; \
         object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors {frame_ancestors}"
    );
    if let Ok(policy) = HeaderValue::from_str(&policy) {
        headers.insert(header::CONTENT_SECURITY_POLICY, policy);
    }
    let fixed = [
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
        (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    ];
    for (name, value) in fixed {
        headers.insert(name, HeaderValue::from_static(value));
    }
    if frame_ancestors == "'none'" {
        headers.insert(header::X_FRAME_OPTIONS, HeaderValue::from_static("DENY"));
    }
}

fn html(text: String) -> Response {
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], text).into_response()
}

async fn file(Path(name): Path<String>) -> Response {
    match page::file(&name) {
        Some((kind, content)) => ([(header::CONTENT_TYPE, kind)], content).into_response(),
        None => StatusCode::NOT_FOUND.into_response(),
    }
}

async fn stream(State(shared): App, upgrade: WebSocketUpgrade) -> Response {
    let Ok(seat) = Arc::clone(&shared.seats).try_acquire_owned() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "as many clients as may be are connected\n")
            .into_response();
    };
    let client = shared.next_client.fetch_add(1, Ordering::Relaxed);
    let (hub, stalled) = (shared.hub.clone(), shared.stalled);
    upgrade.max_message_size(LONGEST_READ).max_frame_size(LONGEST_READ).on_upgrade(
        async move |socket| {
            client::serve(client, socket, hub, stalled).await;
            drop(seat);
        },
    )
}

async fn picture(State(shared): App) -> Response {
    let newest = shared.hub.pictures.borrow().clone();
    let Some(newest) = newest else {
        return (StatusCode::NOT_FOUND, "there is no picture yet\n").into_response();
    };
    let number = newest.number;
    match tokio::task::spawn_blocking(move || png(&newest)).await {
        Ok(Ok(png)) => {
            let headers = [
                (header::CONTENT_TYPE, "image/png".to_owned()),
                (HeaderName::from_static("x-picture"), number.to_string()),
            ];
            (headers, png).into_response()
        }
        _ => StatusCode::INTERNAL_SERVER_ERROR.into_response(),
    }
}

fn png(picture: &Published) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.size.width, picture.size.height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(picture.rgba.as_flattened())?;
    writer.finish()?;
    Ok(bytes)
}

async fn recording(State(shared): App) -> Response {
    let Ok(turn) = Arc::clone(&shared.recording).try_acquire_owned() else {
        let text = "as many recordings as may be are running
";
        return (StatusCode::SERVICE_UNAVAILABLE, text).into_response();
    };
    let Ok(pieces) = record::begin(shared.hub.pictures.clone()) else {
        return StatusCode::SERVICE_UNAVAILABLE.into_response();
    };
    let headers = [
        (header::CONTENT_TYPE, "video/mp4"),
        (header::CONTENT_DISPOSITION, "attachment; filename=\"frameless.mp4\""),
    ];
    (headers, Body::from_stream(Pieces { pieces, _turn: turn })).into_response()
}

/// A file as it is being made.
struct Pieces {
    pieces: mpsc::Receiver<Bytes>,
    _turn: OwnedSemaphorePermit,
}

impl futures_core::Stream for Pieces {
    type Item = Result<Bytes, std::convert::Infallible>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        self.pieces.poll_recv(context).map(|piece| piece.map(Ok))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct UploadQuery {
    client: u32,
    #[serde(default)]
    name: String,
}

async fn upload(
    State(shared): App,
    Query(query): Query<UploadQuery>,
    headers: HeaderMap,
    body: Body,
) -> (StatusCode, String) {
    let Ok(_turn) = Arc::clone(&shared.uploading).try_acquire_owned() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "another file is being uploaded\n".to_owned());
    };
    let announced = headers.get(header::CONTENT_LENGTH).and_then(|length| length.to_str().ok());
    let announced = announced.and_then(|length| length.parse().ok()).unwrap_or(0);
    let bytes = match collect(body, &shared, announced).await {
        Ok(bytes) => bytes,
        Err(refusal) => return refusal,
    };
    let (answer, answered) = oneshot::channel();
    let upload = Upload { client: query.client, name: shown_name(&query.name), bytes, answer };
    if shared.hub.events.send(Event::Upload(upload)).await.is_err() {
        return (StatusCode::SERVICE_UNAVAILABLE, "the server is ending\n".to_owned());
    }
    match answered.await {
        Ok(Ok(text)) => (StatusCode::OK, text),
        Ok(Err(refused)) => explain(refused),
        // Another scene has been asked for since.
        Err(_) => (StatusCode::CONFLICT, "another scene was opened instead\n".to_owned()),
    }
}

fn explain(refused: UploadRefused) -> (StatusCode, String) {
    match refused {
        UploadRefused::NotDriving => {
            (StatusCode::FORBIDDEN, "another client drives; take the helm first".to_owned())
        }
        UploadRefused::Busy => {
            (StatusCode::SERVICE_UNAVAILABLE, "another scene is being opened".to_owned())
        }
        UploadRefused::NoScenes => {
            (StatusCode::UNPROCESSABLE_ENTITY, "this renderer has but its own scene".to_owned())
        }
        UploadRefused::Bad(reason) => (StatusCode::UNPROCESSABLE_ENTITY, reason),
    }
}

/// All of a body, unless it is too long or stalls.
async fn collect(
    body: Body,
    shared: &Shared,
    announced: u64,
) -> Result<Vec<u8>, (StatusCode, String)> {
    let most = shared.upload_bytes;
    let too_large = || {
        let text = format!("the file is too large: at most {most} bytes are taken");
        (StatusCode::PAYLOAD_TOO_LARGE, text)
    };
    if announced > most {
        return Err(too_large());
    }
    let mut stream = body.into_data_stream();
    let mut bytes = Vec::new();
    while let Some(piece) = next_piece(&mut stream, shared.stalled).await? {
        if (bytes.len() + piece.len()) as u64 > most {
            return Err(too_large());
        }
        bytes.extend_from_slice(&piece);
    }
    Ok(bytes)
}

async fn next_piece(
    stream: &mut axum::body::BodyDataStream,
    stalled: Duration,
) -> Result<Option<Bytes>, (StatusCode, String)> {
    let next = std::future::poll_fn(|context| {
        futures_core::Stream::poll_next(Pin::new(&mut *stream), context)
    });
    match tokio::time::timeout(stalled, next).await {
        Ok(None) => Ok(None),
        Ok(Some(Ok(piece))) => Ok(Some(piece)),
        Ok(Some(Err(_))) => Err((StatusCode::BAD_REQUEST, "the upload broke off".to_owned())),
        Err(_) => Err((StatusCode::REQUEST_TIMEOUT, format!("nothing came for {stalled:?}"))),
    }
}

/// A name for messages: it opens nothing.
fn shown_name(name: &str) -> String {
    const LONGEST: usize = 80;
    let printable = name.chars().filter(|c| !c.is_control()).take(LONGEST);
    let name: String = printable.collect();
    if name.trim().is_empty() { "the uploaded file".to_owned() } else { name }
}

/// For requests whose headers do not come.
pub(crate) const HEADERS_WITHIN: Duration = Duration::from_secs(10);
