//! How much each part of the picture counts, if not all of it alike.

use thiserror::Error;

/// Image-quality weights: where samples are worth more than elsewhere. By default every part of the picture counts alike.
///
/// ```
/// use frameless::{Gaze, WeightError, Weights};
///
/// # fn main() -> Result<(), WeightError> {
/// // Somebody looks at the middle of the picture, and its lower half is three times as important as its upper.
/// let gaze = Gaze { at: [0.5, 0.5], radius: Gaze::RADIUS, strength: 1.0 };
/// let weights = Weights::default().with_gaze(gaze)?.with_importance(1, 2, vec![1.0, 3.0])?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Weights {
    pub(crate) contrast: f32,
    pub(crate) flow: f32,
    pub(crate) gaze: Option<Gaze>,
    pub(crate) importance: Option<Importance>,
}

/// Where somebody looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaze {
    /// In parts of the picture's width and height: (0.5, 0.5) is its middle. May lie outside.
    pub at: [f32; 2],
    /// How far from there the smallest detail that the eye resolves is twice as large, in parts of the picture's height.
    pub radius: f32,
    /// In [0, 1]: 0 counts everything alike, 1 as the eye sees it.
    pub strength: f32,
}

/// Per cell of a grid over the picture, how much a squared error counts there.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Importance {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) values: Vec<f32>,
}

/// A weight that cannot be used.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum WeightError {
    /// A strength outside its range.
    #[error("the strength of {weight} must be in [{least}, 1], but is {strength}")]
    Strength {
        /// Of which weight.
        weight: &'static str,
        /// The least that is allowed.
        least: f32,
        /// What came.
        strength: f32,
    },
    /// A gaze that is nowhere, or a radius that is none.
    #[error("a gaze must be at a finite place and have a finite radius above 0, but is {0:?}")]
    Gaze(Gaze),
    /// An importance map without cells, or with too few or too many values.
    #[error("an importance map of {width}×{height} cells cannot have {values} values")]
    MapSize {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Values given.
        values: usize,
    },
    /// An importance that is negative, infinite or NaN.
    #[error("importances must be finite and at least 0, but cell ({x}, {y}) has {value}")]
    MapValue {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
        /// The value.
        value: f32,
    },
}

impl Gaze {
    /// A radius for pictures 384 pixels high at 67 pixels per degree, the distance at which FLIP judges them: 57 pixels, or 0.85°.
    /// Guenter et al. 2012 ("Foveated 3D graphics") found 1.32 to 1.65 minutes of arc per degree of eccentricity beside a 48th of a
    /// degree where one looks, which doubles within 0.95° to 0.76°.
    pub const RADIUS: f32 = 0.15;
}

impl Weights {
    /// Samples in proportion to the spatial contrast around them, to the power of `strength` in [−1, 1]: 1 prefers edges and
    /// texture, −1 plain surfaces, where errors are not masked. Needs [`Reproject`](crate::Reproject).
    ///
    /// # Errors
    /// [`WeightError::Strength`].
    pub fn with_contrast(self, strength: f32) -> Result<Weights, WeightError> {
        Ok(Weights { contrast: checked("contrast", -1.0, strength)?, ..self })
    }

    /// Samples for what moves otherwise than the picture as a whole, which by Gibson expands, turns or slides when the camera moves:
    /// in proportion to that difference, to the power of `strength` in [−1, 1]. −1 prefers what goes along. Needs
    /// [`Reproject`](crate::Reproject) and a renderer that tells of surfaces.
    ///
    /// # Errors
    /// [`WeightError::Strength`].
    pub fn with_flow(self, strength: f32) -> Result<Weights, WeightError> {
        Ok(Weights { flow: checked("flow", -1.0, strength)?, ..self })
    }

    /// Samples where somebody looks, and fewer the less sharply the eye sees there.
    ///
    /// # Errors
    /// [`WeightError::Strength`], [`WeightError::Gaze`].
    pub fn with_gaze(self, gaze: Gaze) -> Result<Weights, WeightError> {
        checked("gaze", 0.0, gaze.strength)?;
        let is_somewhere = gaze.at.iter().all(|c| c.is_finite());
        if !is_somewhere || !gaze.radius.is_finite() || gaze.radius <= 0.0 {
            return Err(WeightError::Gaze(gaze));
        }
        Ok(Weights { gaze: Some(gaze), ..self })
    }

    /// How many times as much a squared error counts in each cell of a `width`×`height` grid over the picture, row-major, at least 0;
    /// only ratios matter. The grid may be finer or coarser than the picture. Where it is 0 a pixel is still looked after as often as
    /// every pixel at least is.
    ///
    /// # Errors
    /// [`WeightError::MapSize`], [`WeightError::MapValue`].
    pub fn with_importance(
        self,
        width: u32,
        height: u32,
        values: Vec<f32>,
    ) -> Result<Weights, WeightError> {
        let cells = u64::from(width) * u64::from(height);
        if cells == 0 || cells != values.len() as u64 {
            return Err(WeightError::MapSize { width, height, values: values.len() });
        }
        if let Some(i) = values.iter().position(|value| !value.is_finite() || *value < 0.0) {
            let (x, y) = (i as u32 % width, i as u32 / width);
            return Err(WeightError::MapValue { x, y, value: values[i] });
        }
        Ok(Weights { importance: Some(Importance { width, height, values }), ..self })
    }

    /// Strengths outside their ranges become the nearest inside; NaN becomes the least. The gaze is at the picture's middle.
    pub(crate) fn clamped(contrast: f32, flow: f32, gaze: f32) -> Weights {
        let within = |strength: f32, least: f32| strength.max(least).min(1.0);
        let strength = within(gaze, 0.0);
        Weights {
            contrast: within(contrast, -1.0),
            flow: within(flow, -1.0),
            gaze: Some(Gaze { at: [0.5; 2], radius: Gaze::RADIUS, strength }),
            importance: None,
        }
    }

    /// Whether nothing counts more than anything else.
    pub fn is_off(&self) -> bool {
        let looks_nowhere = self.gaze.is_none_or(|gaze| gaze.strength == 0.0);
        self.contrast == 0.0 && self.flow == 0.0 && looks_nowhere && self.importance.is_none()
    }
}

fn checked(weight: &'static str, least: f32, strength: f32) -> Result<f32, WeightError> {
    match strength >= least && strength <= 1.0 {
        true => Ok(strength),
        false => Err(WeightError::Strength { weight, least, strength }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsense_is_refused_with_what_came() {
        let off = Weights::default;
        let gaze = |x: f32, radius: f32, strength: f32| {
            off().with_gaze(Gaze { at: [x, 0.5], radius, strength })
        };
        let refused = [
            (off().with_contrast(1.5), "1.5"),
            (off().with_flow(f32::NAN), "NaN"),
            (gaze(0.5, 0.1, -0.5), "-0.5"),
            (gaze(f32::INFINITY, 0.1, 0.5), "inf"),
            (gaze(0.5, 0.0, 0.5), "radius: 0.0"),
            (off().with_importance(0, 4, Vec::new()), "0×4"),
            (off().with_importance(2, 2, vec![1.0; 3]), "3 values"),
            (off().with_importance(2, 2, vec![1.0, 0.0, 1.0, -2.0]), "(1, 1) has -2"),
            (off().with_importance(2, 1, vec![f32::NAN, 0.0]), "(0, 0) has NaN"),
        ];
        for (refused, says) in refused {
            let message = refused.expect_err(says).to_string();
            assert!(message.contains(says), "{message}");
        }
        assert!(gaze(3.0, 0.1, 0.0).expect("looks away").is_off());
        assert!(!off().with_importance(1, 1, vec![0.0]).expect("a map").is_off());
    }
}
