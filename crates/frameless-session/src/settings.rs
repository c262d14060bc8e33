//! What the user can set, apart from the camera and the time.

use frameless::{Display, ReconstructionKind, SamplerKind, Size, ToneMap};

/// Everything that may be set while the picture runs. No change of it clears the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Who chooses the pixels, with its parameters.
    pub sampler: SamplerKind,
    /// Whether the renderer's own sampler chooses the pixels instead; `None` if it has none. See [`crate::Session::with_own_sampler`].
    pub own_sampler: Option<bool>,
    /// How the picture is made of the samples.
    pub reconstruction: ReconstructionKind,
    /// At most this many samples per second; `None`: as many as the renderer can.
    pub samples_per_sec: Option<f64>,
    /// Radiance is multiplied by 2^`exposure_stops` before display.
    pub exposure_stops: f32,
    /// How what is brighter than white is brought into range.
    pub tone_map: ToneMap,
    /// What is shown instead of the picture.
    pub overlay: Overlay,
    /// How many pixels the picture has.
    pub picture: PictureSize,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            sampler: SamplerKind::default(),
            own_sampler: None,
            reconstruction: ReconstructionKind::default(),
            samples_per_sec: None,
            exposure_stops: 0.0,
            tone_map: ToneMap::default(),
            overlay: Overlay::None,
            picture: PictureSize::default(),
        }
    }
}

impl Settings {
    /// How radiance becomes a display colour.
    pub fn display(&self) -> Display {
        Display::new(self.exposure_stops).with_tone_map(self.tone_map)
    }
}

/// What is shown instead of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Overlay {
    /// The picture.
    #[default]
    None,
    /// Change d when the pixel was traced last.
    Change,
    /// Seconds since what the pixel shows was traced, there or where it has moved from.
    SourceAge,
    /// Probability that the next draw falls into the pixel's tile.
    TileProbability,
    /// Samples per second.
    SamplingRate,
    /// v, how fast the sampler has found the pixel's tile to change.
    LearnedRate,
    /// Pixels of which nothing is known, and those that wait to be traced, over the darkened picture.
    Holes,
}

impl Overlay {
    /// All of them, in the order of the keys 0 to 6.
    pub const ALL: [Overlay; 7] = [
        Overlay::None,
        Overlay::Change,
        Overlay::SourceAge,
        Overlay::TileProbability,
        Overlay::SamplingRate,
        Overlay::LearnedRate,
        Overlay::Holes,
    ];

    /// As in the panel.
    pub fn name(self) -> &'static str {
        match self {
            Overlay::None => "the picture",
            Overlay::Change => "change",
            Overlay::SourceAge => "source age",
            Overlay::TileProbability => "tile probability",
            Overlay::SamplingRate => "sampling rate",
            Overlay::LearnedRate => "learned rate",
            Overlay::Holes => "holes",
        }
    }

    /// What it teaches, in a sentence or two.
    pub fn explanation(self) -> &'static str {
        match self {
            Overlay::None => "what the samples look like together",
            Overlay::Change => {
                "how far each pixel's last sample was from what the picture showed there: what the sampler is told"
            }
            Overlay::SourceAge => {
                "how long ago the sample was traced that a pixel shows. With reproject it may have been traced \
                 elsewhere, and have come here with its surface"
            }
            Overlay::TileProbability => {
                "where the sampler's next draw falls. Samplers adaptive and change have it"
            }
            Overlay::SamplingRate => "how often each pixel is traced",
            Overlay::LearnedRate => {
                "v, the squared error that a second of age brings, learned for every tile; the more, the more \
                 samples go there. Sampler adaptive has it"
            }
            Overlay::Holes => {
                "pixels of which nothing is known: never traced, or just uncovered by something that moved away. \
                 Sampler adaptive traces them first"
            }
        }
    }
}

/// How many pixels the picture has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureSize {
    /// As many as its place in the window has, divided by the smallest whole number that keeps them below `at_most`.
    Window {
        /// Pixels; at least 1.
        at_most: u32,
    },
    /// Always the same, drawn enlarged by a whole number, or reduced where the window is too small.
    Fixed(Size),
}

impl Default for PictureSize {
    /// The window, with at most 640×480 pixels: as many as one thread can carry along several times a second.
    fn default() -> Self {
        PictureSize::Window { at_most: 640 * 480 }
    }
}

// A place in a window that is being shrunk may have no width; a picture needs at least one pixel.
const SMALLEST_SIDE: u32 = 16;

impl PictureSize {
    /// The window, up to Full HD.
    pub const WHOLE_WINDOW: PictureSize = PictureSize::Window { at_most: 1920 * 1080 };

    /// The picture's size for a place of `place_px` physical pixels.
    pub fn size_in(self, place_px: [u32; 2]) -> Size {
        let [width, height] = place_px.map(|side| side.max(SMALLEST_SIDE));
        match self {
            PictureSize::Fixed(size) => size,
            PictureSize::Window { at_most } => {
                let too_many = f64::from(width) * f64::from(height) / f64::from(at_most.max(1));
                let divisor = (too_many.sqrt().ceil() as u32).max(1);
                Size::new((width / divisor).max(1), (height / divisor).max(1))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_follows_the_window_up_to_the_limit() {
        let window = PictureSize::Window { at_most: 500_000 };
        assert_eq!(window.size_in([800, 600]), Size::new(800, 600));
        assert_eq!(window.size_in([1000, 600]), Size::new(500, 300));
        assert_eq!(window.size_in([3840, 2160]), Size::new(768, 432));
        assert!(window.size_in([40_000, 40_000]).pixels() <= 500_000);
        assert_eq!(window.size_in([0, 0]), Size::new(16, 16));
        assert_eq!(PictureSize::Window { at_most: 0 }.size_in([100, 100]).pixels(), 1);
    }
}
