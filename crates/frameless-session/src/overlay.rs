//! What the heat maps show: values per pixel, and the legend that says what their colours mean.

use frameless::{Canvas, Engine, Observation, Sampler, Size, Time, Tracer};

use crate::heatmap::{self, Scale};
use crate::rate::Counted;
use crate::settings::Overlay;

/// How to read what is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    /// What is shown; for numbers with their unit.
    pub title: &'static str,
    /// What the colours mean.
    pub colours: Colours,
}

/// What colours mean.
#[derive(Clone, Debug, PartialEq)]
pub enum Colours {
    /// Numbers, in the colours of the heat map.
    Scale(Scale),
    /// Something else each.
    Names(&'static [([u8; 4], &'static str)]),
}

/// An overlay, or why there is none.
#[derive(Clone, Debug, PartialEq)]
pub enum Drawn {
    /// The colours are in the picture.
    HeatMap(Legend),
    /// The sampler does not know such values; the picture itself is shown.
    Unknown,
}

// One step of one 8-bit channel is a change of (1/255)² = 1.5e-5; below 1e-4 nothing is seen.
const CHANGE: Scale = Scale::Logarithmic { low: 1e-4, high: 1.0 };
// After a second at the low end a pixel is wrong by 1 % of the range; at the high end, an edge in quick motion, by 5 % after
// a quarter of a millisecond.
const LEARNED_RATE: Scale = Scale::Logarithmic { low: 1e-4, high: 10.0 };
const UNKNOWN: [u8; 4] = [255, 220, 40, 255];
const WAITING: [u8; 4] = [230, 60, 80, 255];
const HOLES: [([u8; 4], &str); 2] =
    [(UNKNOWN, "nothing known"), (WAITING, "to be traced at its centre")];

/// Draws overlays of one engine. Keeps what is dear to compute for a tenth of a second.
#[derive(Default)]
pub(crate) struct HeatMaps {
    // What the sampler said last, and when.
    inspected: Option<(Time, Vec<f32>)>,
    // Change d of every pixel when it was traced last; empty while nobody looks.
    changes: Vec<f32>,
}

// Inspecting a sampler takes milliseconds, which the loop stands still.
const INSPECT_SECS: f64 = 0.1;

impl HeatMaps {
    /// Notes changes that have just been observed, while somebody looks at them.
    pub(crate) fn note_changes(&mut self, size: Size, observations: &[Observation]) {
        self.changes.resize(size.pixels(), 0.0);
        for observed in observations.iter().filter(|observed| observed.known) {
            self.changes[observed.pixel as usize] = observed.change;
        }
    }

    /// Nobody looks at changes any longer, or the picture has another size.
    pub(crate) fn forget_changes(&mut self) {
        self.changes = Vec::new();
    }

    /// Replaces the picture `rgba`, which the engine has just made, by the overlay.
    pub(crate) fn draw<T: Tracer>(
        &mut self,
        overlay: Overlay,
        engine: &mut Engine<Counted<T>>,
        rgba: &mut [[u8; 4]],
    ) -> Option<Drawn> {
        let now = engine.now();
        let size = engine.canvas().size();
        match overlay {
            Overlay::None => None,
            Overlay::Change => {
                self.changes.resize(size.pixels(), 0.0);
                let values = self.changes.iter().copied();
                Some(paint(rgba, "change d (squared sRGB difference)", Some(CHANGE), values))
            }
            Overlay::SourceAge => {
                let age_secs = |traced: Time| match traced {
                    Time::ZERO => f32::INFINITY,
                    traced => now.secs_since(traced) as f32,
                };
                let ages: Vec<f32> = engine.canvas().time().map(age_secs).collect();
                Some(paint(rgba, "age of the sample shown (s)", None, ages.iter().copied()))
            }
            Overlay::SamplingRate => {
                let rate = engine.tracer_mut().rate(now, size).per_sec();
                Some(paint(rgba, "sampling rate (samples/s per pixel)", None, rate))
            }
            Overlay::TileProbability => {
                let values = self.tile_probability(now, engine.canvas(), engine.sampler());
                if values.len() != rgba.len() {
                    return Some(Drawn::Unknown);
                }
                Some(paint(rgba, "tile probability (per draw)", None, values.iter().copied()))
            }
            Overlay::LearnedRate => {
                let Some(rates) = engine.rates() else { return Some(Drawn::Unknown) };
                let values = (0..size.pixels() as u32).map(|pixel| rates.of_pixel(pixel));
                let title = "learned rate v (squared error per channel and s)";
                Some(paint(rgba, title, Some(LEARNED_RATE), values))
            }
            Overlay::Holes => Some(paint_holes(rgba, engine.canvas())),
        }
    }

    fn tile_probability(&mut self, now: Time, canvas: &Canvas, sampler: &dyn Sampler) -> &[f32] {
        let fresh = self.inspected.take().filter(|(at, values)| {
            let same_size = values.is_empty() || values.len() == canvas.size().pixels();
            same_size && now.secs_since(*at) < INSPECT_SECS
        });
        let (_, values) = self
            .inspected
            .insert(fresh.unwrap_or_else(|| (now, sampler.inspect(now, canvas).tile_probability)));
        values
    }
}

/// Marks holes in the picture, which is darkened so that they stand out.
fn paint_holes(rgba: &mut [[u8; 4]], canvas: &Canvas) -> Drawn {
    for (rgba, known) in rgba.iter_mut().zip(canvas.known()) {
        let [r, g, b, _] = *rgba;
        *rgba = if known { [r / 3, g / 3, b / 3, 255] } else { UNKNOWN };
    }
    let is_off_centre = |&&pixel: &&u32| canvas.is_known(pixel) && canvas.still_waits(pixel);
    for &pixel in canvas.holes().iter().filter(is_off_centre) {
        rgba[pixel as usize] = WAITING;
    }
    Drawn::HeatMap(Legend { title: "holes", colours: Colours::Names(&HOLES) })
}

/// Without a scale: a linear one up to about the largest value.
fn paint(
    rgba: &mut [[u8; 4]],
    title: &'static str,
    scale: Option<Scale>,
    values: impl ExactSizeIterator<Item = f32> + Clone,
) -> Drawn {
    let scale =
        scale.unwrap_or_else(|| Scale::linear_up_to(heatmap::typical_largest(values.clone())));
    for (rgba, value) in rgba.iter_mut().zip(values) {
        *rgba = heatmap::colour(scale.position(value));
    }
    Drawn::HeatMap(Legend { title, colours: Colours::Scale(scale) })
}
