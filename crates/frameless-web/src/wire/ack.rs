//! A client has drawn what it was sent.

use super::{Fields, VERSION, WireError};

/// Acknowledges a tiles message and all before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ack {
    /// Its sequence number.
    pub sequence: u32,
}

const KIND: u8 = 16;
const LENGTH: usize = 8;

impl Ack {
    /// As it is sent.
    pub fn to_bytes(self) -> [u8; LENGTH] {
        let [a, b, c, d] = self.sequence.to_le_bytes();
        [KIND, VERSION, 0, 0, a, b, c, d]
    }

    /// From what came.
    ///
    /// # Errors
    /// If it is anything else.
    pub fn parse(bytes: &[u8]) -> Result<Ack, WireError> {
        let what = "an acknowledgement";
        let mut fields = Fields::of(what, bytes, KIND, LENGTH)?;
        if bytes.len() != LENGTH {
            return Err(WireError::Length { what, wanted: LENGTH, came: bytes.len() });
        }
        match fields.u16()? {
            0 => Ok(Ack { sequence: fields.u32()? }),
            came => {
                let came = came.to_string();
                Err(WireError::Value { what: "reserved field", wanted: "0", came })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOLDEN: [u8; 8] = [16, 1, 0, 0, 0x78, 0x56, 0x34, 0x12];

    #[test]
    fn golden_bytes() {
        let ack = Ack { sequence: 0x1234_5678 };
        assert_eq!(ack.to_bytes(), GOLDEN);
        assert_eq!(Ack::parse(&GOLDEN), Ok(ack));
    }

    #[test]
    fn every_truncation_and_every_other_header_is_refused() {
        for end in 0..GOLDEN.len() {
            assert!(Ack::parse(&GOLDEN[..end]).is_err(), "{end} bytes");
        }
        assert!(Ack::parse(&[&GOLDEN[..], &[0]].concat()).is_err());
        for at in 0..4 {
            let mut other = GOLDEN;
            other[at] ^= 2;
            assert!(Ack::parse(&other).is_err(), "byte {at}");
        }
    }
}
