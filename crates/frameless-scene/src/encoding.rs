//! What the bytes of a picture mean, there and back.

use std::sync::LazyLock;

use glam::Vec4;

use crate::linear_from_srgb;

/// What the bytes of a picture mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// c / 255.
    Number,
    /// sRGB, but for alpha, which is c / 255.
    Color,
}

impl Encoding {
    /// In the order of their numbers.
    pub const BOTH: [Encoding; 2] = [Encoding::Number, Encoding::Color];

    /// Of colours, or of what is none.
    pub fn of(is_color: bool) -> Encoding {
        Encoding::BOTH[usize::from(is_color)]
    }

    /// The value of every byte.
    #[inline]
    pub fn table(self) -> &'static [f32; 256] {
        static TABLES: LazyLock<[[f32; 256]; 2]> = LazyLock::new(|| {
            let number = std::array::from_fn(|byte| (byte as f64 / 255.0) as f32);
            let color = std::array::from_fn(|byte| linear_from_srgb(byte as f64 / 255.0) as f32);
            [number, color]
        });
        &TABLES[self as usize]
    }

    /// The bytes that mean about this, each in [0, 1].
    pub fn encode(self, rgba: Vec4) -> [u8; 4] {
        let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
        let [r, g, b, a] = rgba.to_array();
        match self {
            Encoding::Number => [r, g, b, a].map(byte),
            Encoding::Color => {
                let steps = &*SRGB_STEPS;
                [steps.byte(r), steps.byte(g), steps.byte(b), byte(a)]
            }
        }
    }
}

/// sRGB bytes of linear light by looking them up: smaller copies of pictures are millions of texels, and a power takes as long as ten look-ups.
struct SrgbSteps {
    /// The least light that has each byte.
    least: [f32; 256],
    /// The byte of the darkest light of each of so many equal parts of [0, 1].
    first: [u8; SrgbSteps::PARTS + 1],
}

static SRGB_STEPS: LazyLock<SrgbSteps> = LazyLock::new(SrgbSteps::new);

impl SrgbSteps {
    /// So many that a part has hardly ever more than two bytes: in the dark they are 1 / (12.92 · 255) wide.
    const PARTS: usize = 4096;

    /// What is looked up.
    fn computed(light: f32) -> u8 {
        let c = light;
        let srgb = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        (srgb.clamp(0.0, 1.0) * 255.0).round() as u8
    }

    fn new() -> SrgbSteps {
        let least = std::array::from_fn(|byte| {
            // Positive numbers are in the order of their bits.
            let (mut below, mut at) = (0, 1f32.to_bits());
            while byte > 0 && at - below > 1 {
                let middle = below + (at - below) / 2;
                let is_there = usize::from(Self::computed(f32::from_bits(middle))) >= byte;
                if is_there { at = middle } else { below = middle }
            }
            if byte > 0 { f32::from_bits(at) } else { 0.0 }
        });
        let first = std::array::from_fn(|part| Self::computed(part as f32 / Self::PARTS as f32));
        SrgbSteps { least, first }
    }

    #[inline]
    fn byte(&self, light: f32) -> u8 {
        let light = light.clamp(0.0, 1.0);
        let mut byte = self.first[(light * Self::PARTS as f32) as usize];
        while byte < 255 && light >= self.least[usize::from(byte) + 1] {
            byte += 1;
        }
        byte
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_has_its_known_values() {
        let table = Encoding::Color.table();
        assert_eq!((table[0], table[255]), (0.0, 1.0));
        assert!(
            (table[188] - 0.5029).abs() < 1e-4,
            "sRGB 188 is about half the light, not {}",
            table[188]
        );
        assert_eq!(Encoding::Number.table()[51], 0.2);
        let white = Encoding::Color.encode(Vec4::new(1.0, 0.5029, 0.0, 0.5));
        assert_eq!(white, [255, 188, 0, 128]);
    }

    #[test]
    fn looked_up_bytes_are_those_computed() {
        // All that are near a step, and others.
        let steps = SRGB_STEPS.least.iter().flat_map(|least| {
            (-3..=3).map(|by| f32::from_bits(least.to_bits().saturating_add_signed(by)))
        });
        let others = (0..100_000).map(|k| k as f32 / 99_999.0);
        for light in steps.chain(others).chain([-1.0, -0.0, 2.0, f32::NAN]) {
            assert_eq!(SRGB_STEPS.byte(light), SrgbSteps::computed(light), "{light}");
        }
    }
}
