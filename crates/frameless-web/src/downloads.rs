//! What can be taken away: the newest picture, and a recording. Each is made for whoever asks, so only so many at a time.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::StatusCode;
use axum::http::header::{self, HeaderName};
use axum::response::{IntoResponse, Response};
use futures_core::Stream;
use tokio::sync::OwnedSemaphorePermit;

use crate::hub::Looking;
use crate::record::{self, Recording};
use crate::routes::{App, busy};
use crate::tiles::Published;

/// A picture is handed to the connection in parts of so many bytes: its turn ends with the last one.
const PART: usize = 64 << 10;

/// `GET /picture.png`.
pub(crate) async fn picture(State(shared): App) -> Response {
    let Ok(turn) = Arc::clone(&shared.pictures).try_acquire_owned() else {
        return busy("as many pictures as may be are being sent; ask again in a second\n");
    };
    let newest = shared.hub.pictures.borrow().clone();
    let Some(newest) = newest else {
        return (StatusCode::NOT_FOUND, "there is no picture yet\n").into_response();
    };
    let number = newest.number;
    let Ok(Ok(png)) = tokio::task::spawn_blocking(move || png(&newest)).await else {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    };
    let headers = [
        (header::CONTENT_TYPE, "image/png".to_owned()),
        (header::CONTENT_LENGTH, png.len().to_string()),
        (HeaderName::from_static("x-picture"), number.to_string()),
    ];
    (headers, Body::from_stream(Parts { left: png.into(), _turn: turn })).into_response()
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

/// A file that is there.
struct Parts {
    left: Bytes,
    _turn: OwnedSemaphorePermit,
}

impl Stream for Parts {
    type Item = Result<Bytes, std::convert::Infallible>;

    fn poll_next(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        let length = self.left.len().min(PART);
        Poll::Ready((length > 0).then(|| Ok(self.left.split_to(length))))
    }
}

/// `GET /recording.mp4`.
pub(crate) async fn recording(State(shared): App) -> Response {
    let Ok(turn) = Arc::clone(&shared.recording).try_acquire_owned() else {
        return busy("as many recordings as may be are running\n");
    };
    let looking = shared.hub.look();
    let recording = match record::begin(shared.hub.pictures.clone()) {
        Ok(recording) => recording,
        Err(error) => {
            log::warn!("no recording could be begun: {error}");
            return StatusCode::SERVICE_UNAVAILABLE.into_response();
        }
    };
    let headers = [
        (header::CONTENT_TYPE, "video/mp4"),
        (header::CONTENT_DISPOSITION, "attachment; filename=\"frameless.mp4\""),
    ];
    let pieces = Pieces { recording, _turn: turn, _looking: looking };
    (headers, Body::from_stream(pieces)).into_response()
}

/// A file as it is being made.
struct Pieces {
    recording: Recording,
    _turn: OwnedSemaphorePermit,
    _looking: Looking,
}

impl Stream for Pieces {
    type Item = std::io::Result<Bytes>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        self.recording.poll_piece(context)
    }
}
