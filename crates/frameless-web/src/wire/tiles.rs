//! Tiles of the picture, in one image.

use super::{Fields, VERSION, WireError};

/// How a payload is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Codec {
    /// JPEG; never exact.
    Jpeg = 1,
    /// PNG.
    Png = 2,
}

impl Codec {
    fn from_byte(byte: u8) -> Result<Codec, WireError> {
        match byte {
            1 => Ok(Codec::Jpeg),
            2 => Ok(Codec::Png),
            came => {
                let (what, wanted) = ("codec", "1 (JPEG) or 2 (PNG)");
                Err(WireError::Value { what, wanted, came: came.to_string() })
            }
        }
    }
}

/// All of a tiles message but its payload.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TilesHeader {
    /// How the payload is written.
    pub codec: Codec,
    /// These tiles are now exactly the server's picture.
    pub lossless: bool,
    /// From 1, without gaps.
    pub sequence: u32,
    /// Another one has another size and none of the earlier tiles.
    pub generation: u32,
    /// Of the picture, in pixels.
    pub width: u16,
    /// Of the picture, in pixels.
    pub height: u16,
    /// Of a tile, in pixels; a multiple of 16.
    pub side: u16,
    /// The picture that they are from.
    pub picture: u32,
    /// The last of this client's inputs that the picture shows; 0: none.
    pub input: u32,
    /// Of the atlas, in tiles.
    pub columns: u16,
    /// Which tiles, row-major.
    pub tiles: Vec<u16>,
}

const KIND: u8 = 1;
const FIXED: usize = 32;
const LOSSLESS: u8 = 1;

impl TilesHeader {
    /// The whole message.
    pub fn to_bytes(&self, payload: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(FIXED + 2 * self.tiles.len() + payload.len());
        bytes.extend([KIND, VERSION, self.codec as u8, u8::from(self.lossless) * LOSSLESS]);
        bytes.extend(self.sequence.to_le_bytes());
        bytes.extend(self.generation.to_le_bytes());
        for number in [self.width, self.height, self.side, self.tiles.len() as u16] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(self.picture.to_le_bytes());
        bytes.extend(self.input.to_le_bytes());
        bytes.extend(self.columns.to_le_bytes());
        bytes.extend([0, 0]);
        self.tiles.iter().for_each(|tile| bytes.extend(tile.to_le_bytes()));
        bytes.extend_from_slice(payload);
        bytes
    }

    /// Header and payload of what came.
    ///
    /// # Errors
    /// If it is anything else, or names tiles outside the picture. The payload is not looked at.
    pub fn parse(bytes: &[u8]) -> Result<(TilesHeader, &[u8]), WireError> {
        let mut fields = Fields::of("tiles", bytes, KIND, FIXED)?;
        let codec = Codec::from_byte(fields.u8()?)?;
        let flags = fields.u8()?;
        let (sequence, generation) = (fields.u32()?, fields.u32()?);
        let (width, height, side) = (fields.u16()?, fields.u16()?, fields.u16()?);
        let count = fields.u16()?;
        let (picture, input) = (fields.u32()?, fields.u32()?);
        let (columns, reserved) = (fields.u16()?, fields.u16()?);
        check("flags", "0 or 1", flags.into(), flags <= LOSSLESS)?;
        check("side", "a multiple of 16", side.into(), side > 0 && side % 16 == 0)?;
        check("number of tiles", "1 or more", count.into(), count > 0)?;
        check(
            "columns",
            "1 to the number of tiles",
            columns.into(),
            (1..=count).contains(&columns),
        )?;
        check("reserved field", "0", reserved.into(), reserved == 0)?;
        let tiles = (0..count).map(|_| fields.u16()).collect::<Result<Vec<u16>, _>>()?;
        let in_picture = u32::from(width.div_ceil(side)) * u32::from(height.div_ceil(side));
        for &tile in &tiles {
            check("tile", "one in the picture", tile.into(), u32::from(tile) < in_picture)?;
        }
        let lossless = flags == LOSSLESS;
        let header = TilesHeader {
            codec,
            lossless,
            sequence,
            generation,
            width,
            height,
            side,
            picture,
            input,
            columns,
            tiles,
        };
        Ok((header, fields.rest()))
    }
}

fn check(what: &'static str, wanted: &'static str, came: u32, is: bool) -> Result<(), WireError> {
    if is { Ok(()) } else { Err(WireError::Value { what, wanted, came: came.to_string() }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header() -> TilesHeader {
        TilesHeader {
            codec: Codec::Png,
            lossless: true,
            sequence: 1,
            generation: 2,
            width: 100,
            height: 70,
            side: 32,
            picture: 3,
            input: 4,
            columns: 2,
            tiles: vec![0, 11, 5],
        }
    }

    #[rustfmt::skip]
    const GOLDEN: [u8; 41] = [
        1, 1, 2, 1, 1, 0, 0, 0, 2, 0, 0, 0, 100, 0, 70, 0, 32, 0, 3, 0,
        3, 0, 0, 0, 4, 0, 0, 0, 2, 0, 0, 0, 0, 0, 11, 0, 5, 0, 7, 8, 9,
    ];

    #[test]
    fn golden_bytes() {
        assert_eq!(header().to_bytes(&[7, 8, 9]), GOLDEN);
        let (parsed, payload) = TilesHeader::parse(&GOLDEN).unwrap();
        assert_eq!((parsed, payload), (header(), &[7, 8, 9][..]));
    }

    #[test]
    fn every_truncation_of_the_header_is_refused() {
        for end in 0..38 {
            assert!(TilesHeader::parse(&GOLDEN[..end]).is_err(), "{end} bytes");
        }
    }

    #[test]
    fn fields_that_contradict_each_other_are_refused() {
        // Type, version, codec, flags, side, count, columns, reserved, a tile outside the picture.
        for (at, value) in
            [(0, 2), (1, 2), (2, 3), (3, 2), (16, 33), (18, 0), (28, 0), (28, 4), (30, 1), (32, 12)]
        {
            let mut other = GOLDEN;
            other[at] = value;
            assert!(TilesHeader::parse(&other).is_err(), "byte {at} = {value}");
        }
    }
}
