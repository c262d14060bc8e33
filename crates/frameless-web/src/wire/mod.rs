//! What travels over the WebSocket, as docs/stream-format.md has it: both directions, both ways, so that tests can read what is
//! written.

mod ack;
mod said;
mod status;
mod tiles;
mod told;

pub use ack::Ack;
pub use said::{Said, SettingsChange};
pub use status::StatusMessage;
pub use tiles::{Codec, TilesHeader};
pub use told::{Choice, Level, NamedColour, SettingsState, Told};

/// Of every message; what a page must not misread raises it.
pub const VERSION: u8 = 1;
/// The largest message that is taken from a client, in bytes.
pub const LONGEST_MESSAGE: usize = 1 << 20;

/// Why a message is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// Fewer or more bytes than a message of its kind has.
    #[error("wanted {wanted} bytes of {what}, came {came}")]
    Length {
        /// The kind of message.
        what: &'static str,
        /// How many it has.
        wanted: usize,
        /// How many came.
        came: usize,
    },
    /// A field holds what it must not.
    #[error("{what}: wanted {wanted}, came {came}")]
    Value {
        /// The field.
        what: &'static str,
        /// What it may hold.
        wanted: &'static str,
        /// What it held.
        came: String,
    },
    /// Not one of the JSON messages that a client may send.
    #[error("{0}")]
    Json(String),
}

/// Reads little-endian fields one after the other.
struct Fields<'a> {
    what: &'static str,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Fields<'a> {
    /// Of a message with at least `least` bytes, the first two of which are type and version.
    fn of(
        what: &'static str,
        bytes: &'a [u8],
        kind: u8,
        least: usize,
    ) -> Result<Fields<'a>, WireError> {
        if bytes.len() < least {
            return Err(WireError::Length { what, wanted: least, came: bytes.len() });
        }
        let mut fields = Fields { what, bytes, at: 0 };
        fields.expect("type", kind, "the type of this message")?;
        fields.expect("version", VERSION, "version 1")?;
        Ok(fields)
    }

    fn expect(
        &mut self,
        what: &'static str,
        want: u8,
        wanted: &'static str,
    ) -> Result<(), WireError> {
        match self.u8()? {
            came if came == want => Ok(()),
            came => Err(WireError::Value { what, wanted, came: came.to_string() }),
        }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], WireError> {
        let field = self.bytes[self.at..].first_chunk::<N>();
        let short =
            WireError::Length { what: self.what, wanted: self.at + N, came: self.bytes.len() };
        let field = *field.ok_or(short)?;
        self.at += N;
        Ok(field)
    }

    fn u8(&mut self) -> Result<u8, WireError> {
        Ok(self.take::<1>()?[0])
    }

    fn u16(&mut self) -> Result<u16, WireError> {
        self.take().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32, WireError> {
        self.take().map(u32::from_le_bytes)
    }

    fn f32(&mut self) -> Result<f32, WireError> {
        self.take().map(f32::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64, WireError> {
        self.take().map(f64::from_le_bytes)
    }

    fn rest(self) -> &'a [u8] {
        &self.bytes[self.at..]
    }
}
