//! `POST /upload`: a scene from a client that drives. Who it is from, and whether it may, is asked before a byte of it is read.

use std::pin::Pin;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes};
use axum::extract::{Query, State};
use axum::http::header::{self, HeaderName};
use axum::http::{HeaderMap, StatusCode};
use serde::Deserialize;
use tokio::sync::oneshot;

use crate::hub::{Event, Upload, UploadRefused};
use crate::routes::{App, Shared};

/// Holds the token that the client was welcomed with. A page of another site could set no such header without being asked.
const CLIENT: HeaderName = HeaderName::from_static("x-client");

/// While a file comes it is asked so often whether its client may still send one: a slow one keeps the others waiting.
const BETWEEN_QUESTIONS: Duration = Duration::from_millis(500);

/// A status, and what the user is to read.
type Answer = (StatusCode, String);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct UploadQuery {
    #[serde(default)]
    name: String,
}

pub(crate) async fn upload(
    State(shared): App,
    Query(query): Query<UploadQuery>,
    headers: HeaderMap,
    body: Body,
) -> Answer {
    receive(&shared, &query, &headers, body).await.unwrap_or_else(|refusal| refusal)
}

async fn receive(
    shared: &Shared,
    query: &UploadQuery,
    headers: &HeaderMap,
    body: Body,
) -> Result<Answer, Answer> {
    let text = |header| headers.get(header).and_then(|value| value.to_str().ok());
    let token = text(CLIENT).unwrap_or("").to_owned();
    let client = may_upload(shared, &token).await?;
    let busy = |_| (StatusCode::SERVICE_UNAVAILABLE, "another file is being uploaded".to_owned());
    let _turn = Arc::clone(&shared.uploading).try_acquire_owned().map_err(busy)?;
    let announced = text(header::CONTENT_LENGTH).and_then(|length| length.parse().ok());
    let bytes = collect(body, shared, announced.unwrap_or(0), &token).await?;
    let name = shown_name(&query.name);
    let opened =
        ask(shared, |answer| Event::Upload(Upload { client, name, bytes, answer })).await?;
    Ok((StatusCode::OK, opened))
}

/// The number of the client with that token, if it may send a file now.
async fn may_upload(shared: &Shared, token: &str) -> Result<u32, Answer> {
    let token = token.to_owned();
    ask(shared, |answer| Event::MayUpload { token, answer }).await
}

/// What the hub says to an event.
async fn ask<T>(
    shared: &Shared,
    event: impl FnOnce(oneshot::Sender<Result<T, UploadRefused>>) -> Event,
) -> Result<T, Answer> {
    let (answer, answered) = oneshot::channel();
    let ending = || (StatusCode::SERVICE_UNAVAILABLE, "the server is ending".to_owned());
    shared.hub.events.send(event(answer)).await.map_err(|_| ending())?;
    match answered.await {
        Ok(answer) => answer.map_err(explain),
        Err(_) => Err(ending()),
    }
}

fn explain(refused: UploadRefused) -> Answer {
    let (status, text) = match refused {
        UploadRefused::Stranger => {
            (StatusCode::FORBIDDEN, "this page is not connected; try again when it is")
        }
        UploadRefused::NotDriving => {
            (StatusCode::FORBIDDEN, "another client drives; take the helm first")
        }
        UploadRefused::Busy => (StatusCode::SERVICE_UNAVAILABLE, "another scene is being opened"),
        UploadRefused::NoScenes => {
            (StatusCode::UNPROCESSABLE_ENTITY, "this renderer has but its own scene")
        }
        UploadRefused::Bad(reason) => return (StatusCode::UNPROCESSABLE_ENTITY, reason),
    };
    (status, text.to_owned())
}

/// All of a body, unless it is too long or stalls, or whoever sends it may no longer.
async fn collect(
    body: Body,
    shared: &Shared,
    announced: u64,
    token: &str,
) -> Result<Vec<u8>, Answer> {
    let most = shared.upload_bytes;
    let too_large = || {
        let text = format!("the file is too large: at most {most} bytes are taken");
        (StatusCode::PAYLOAD_TOO_LARGE, text)
    };
    if announced > most {
        return Err(too_large());
    }
    let mut stream = body.into_data_stream();
    let (mut bytes, mut asked_at) = (Vec::new(), Instant::now());
    while let Some(piece) = next_piece(&mut stream, shared.stalled).await? {
        if (bytes.len() + piece.len()) as u64 > most {
            return Err(too_large());
        }
        bytes.extend_from_slice(&piece);
        if asked_at.elapsed() >= BETWEEN_QUESTIONS {
            may_upload(shared, token).await?;
            asked_at = Instant::now();
        }
    }
    Ok(bytes)
}

async fn next_piece(
    stream: &mut axum::body::BodyDataStream,
    stalled: Duration,
) -> Result<Option<Bytes>, Answer> {
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
