//! What there is to ask for, behind the guard.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Extension, Path, Query, Request, State};
use axum::http::header::{self, HeaderName, HeaderValue};
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde::Deserialize;
use tokio::sync::Semaphore;

use crate::door::Visitor;
use crate::guard::{Admission, Guard, Refusals};
use crate::hub::HubHandle;
use crate::wire::LONGEST_MESSAGE;
use crate::{Secret, client, downloads, page, upload};

/// What is too long is read so far, so that the client can be told; from more the connection breaks off.
const LONGEST_READ: usize = 2 * LONGEST_MESSAGE;

/// What every request may need.
pub(crate) struct Shared {
    pub(crate) guard: Guard,
    pub(crate) refusals: Refusals,
    /// Who may show the page in a frame, in the words of a content-security policy.
    pub(crate) frame_ancestors: String,
    pub(crate) hub: HubHandle,
    pub(crate) upload_bytes: u64,
    /// See [`crate::Options::stalled`].
    pub(crate) stalled: Duration,
    /// The most clients at once.
    pub(crate) clients: usize,
    /// Those that may still connect.
    pub(crate) seats: Arc<Semaphore>,
    /// Pictures that may still be asked for: each is whole in memory until it has been taken.
    pub(crate) pictures: Arc<Semaphore>,
    /// One upload at a time: each may be large.
    pub(crate) uploading: Arc<Semaphore>,
    /// Recordings that may still begin.
    pub(crate) recording: Arc<Semaphore>,
    pub(crate) next_client: AtomicU32,
}

pub(crate) type App = State<Arc<Shared>>;

/// The routes, with the guard in front of all of them and of what is none.
pub(crate) fn router(shared: Arc<Shared>) -> Router {
    Router::new()
        .route("/", get(async || html(page::INDEX.to_owned())))
        .route("/stream", get(stream))
        .route("/clients", get(clients))
        .route("/picture.png", get(downloads::picture))
        .route("/recording.mp4", get(downloads::recording))
        .route("/upload", post(upload::upload))
        .route("/{file}", get(file))
        .fallback(async || StatusCode::NOT_FOUND)
        .layer(middleware::from_fn_with_state(Arc::clone(&shared), guarded))
        .with_state(shared)
}

/// The one way in.
async fn guarded(
    State(shared): App,
    Extension(visitor): Extension<Arc<Visitor>>,
    request: Request,
    next: Next,
) -> Response {
    let guard = &shared.guard;
    let host = request.headers().get(header::HOST).cloned();
    let admission = guard.check(request.method(), request.uri(), request.headers());
    match admission {
        Ok(_) => visitor.is_known(),
        Err(refusal) => shared.refusals.log(refusal, request.method(), host.as_ref()),
    }
    let mut response = match admission {
        Ok(Admission::Enter) => next.run(request).await,
        Ok(Admission::Exchange) => exchange(guard, request.headers()),
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
fn exchange(guard: &Guard, headers: &HeaderMap) -> Response {
    let secure = if guard.tls { "; Secure" } else { "" };
    let secret = guard.secret.as_str();
    let name = guard.cookie(headers);
    let cookie = format!("{name}={secret}; HttpOnly; SameSite=Strict; Path=/{secure}");
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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StreamQuery {
    /// The token that this page had before its connection was lost.
    resume: Option<String>,
}

async fn stream(
    State(shared): App,
    Query(query): Query<StreamQuery>,
    upgrade: WebSocketUpgrade,
) -> Response {
    let Ok(seat) = Arc::clone(&shared.seats).try_acquire_owned() else {
        return busy("as many clients as may be are connected\n");
    };
    let Ok(token) = Secret::new() else {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    };
    let number = shared.next_client.fetch_add(1, Ordering::Relaxed);
    let newcomer = client::Newcomer { number, token, resumes: query.resume };
    let (hub, stalled) = (shared.hub.clone(), shared.stalled);
    upgrade.max_message_size(LONGEST_READ).max_frame_size(LONGEST_READ).on_upgrade(
        async move |socket| {
            client::serve(newcomer, socket, hub, stalled).await;
            drop(seat);
        },
    )
}

/// How many clients there are and may be: a browser does not tell a page why its WebSocket was refused.
async fn clients(State(shared): App) -> Response {
    let connected = shared.clients - shared.seats.available_permits();
    let text = format!("{{\"clients\": {connected}, \"most\": {}}}\n", shared.clients);
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}

/// Not now, but soon.
pub(crate) fn busy(why: &'static str) -> Response {
    (StatusCode::SERVICE_UNAVAILABLE, [(header::RETRY_AFTER, "1")], why).into_response()
}

/// For requests whose headers do not come.
pub(crate) const HEADERS_WITHIN: Duration = Duration::from_secs(10);
