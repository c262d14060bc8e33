//! What the heat maps show: values per pixel, and the legend that says what their colours mean.

use frameless::{Canvas, Engine, Sampler, Time, Tracer};

use crate::heatmap::{self, Scale};
use crate::rate::Counted;
use crate::settings::Overlay;

/// How to read a heat map.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Legend {
    /// What the numbers are, with their unit.
    pub(crate) title: &'static str,
    /// Which number has which colour.
    pub(crate) scale: Scale,
}

/// A heat map, or why there is none.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Drawn {
    /// The colours are in the picture.
    HeatMap(Legend),
    /// The sampler does not know such values; the picture itself is shown.
    Unknown,
}

// One step of one 8-bit channel is a change of (1/255)² = 1.5e-5; below 1e-4 nothing is seen.
const CHANGE: Scale = Scale::Logarithmic { low: 1e-4, high: 1.0 };

/// Draws heat maps of one engine. Keeps what is dear to compute for a tenth of a second.
#[derive(Default)]
pub(crate) struct HeatMaps {
    // What the sampler said last, when, and to which question.
    inspected: Option<(Overlay, Time, Vec<f32>)>,
}

// Inspecting a sampler takes milliseconds, which the loop stands still.
const INSPECT_SECS: f64 = 0.1;

impl HeatMaps {
    /// Replaces the picture `rgba` by the heat map.
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
            Overlay::Age => {
                let ages = engine.canvas().time().iter().map(|&time| now.secs_since(time) as f32);
                Some(paint(rgba, "age (s)", None, ages))
            }
            Overlay::SamplingRate => {
                let rate = engine.tracer_mut().rate(now, size).per_sec();
                Some(paint(rgba, "sampling rate (samples/s per pixel)", None, rate))
            }
            Overlay::Change | Overlay::TileProbability => {
                let values = self.inspect(overlay, now, engine.canvas(), engine.sampler());
                if values.len() != rgba.len() {
                    return Some(Drawn::Unknown);
                }
                let (title, scale) = match overlay {
                    Overlay::Change => ("change d (squared sRGB difference)", Some(CHANGE)),
                    _ => ("tile probability (per draw)", None),
                };
                Some(paint(rgba, title, scale, values.iter().copied()))
            }
        }
    }

    fn inspect(
        &mut self,
        overlay: Overlay,
        now: Time,
        canvas: &Canvas,
        sampler: &dyn Sampler,
    ) -> &[f32] {
        let fresh = self.inspected.take().filter(|(of, at, values)| {
            let same_size = values.is_empty() || values.len() == canvas.size().pixels();
            *of == overlay && same_size && now.secs_since(*at) < INSPECT_SECS
        });
        let (_, _, values) = self.inspected.insert(fresh.unwrap_or_else(|| {
            let insight = sampler.inspect(now, canvas);
            let values = match overlay {
                Overlay::Change => insight.change,
                _ => insight.tile_probability,
            };
            (overlay, now, values)
        }));
        values
    }
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
    Drawn::HeatMap(Legend { title, scale })
}
