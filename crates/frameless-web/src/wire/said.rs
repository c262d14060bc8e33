//! What a client says in JSON, checked: behind [`Said::parse`] every number is finite and within its range.

use serde::{Deserialize, Deserializer};

use super::WireError;

/// A wish. `input` is the client's own number of it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Said {
    /// Take or release the helm.
    Drive {
        /// Take it.
        on: bool,
    },
    /// Move the camera.
    Camera {
        /// Of this input.
        #[serde(default)]
        input: u32,
        /// How far the pointer was dragged, right and down, in heights of the picture.
        #[serde(default)]
        orbit: [f32; 2],
        /// Likewise.
        #[serde(default)]
        pan: [f32; 2],
        /// Factor on the distance.
        #[serde(default = "one")]
        zoom: f32,
        /// Right, up, backward, in units of the distance to what is orbited.
        #[serde(default)]
        fly: [f32; 3],
    },
    /// One of the scene's cameras.
    LookThrough {
        /// Of this input.
        #[serde(default)]
        input: u32,
        /// Its index.
        camera: u32,
    },
    /// The scene's camera that was used last.
    ComeBack {
        /// Of this input.
        #[serde(default)]
        input: u32,
    },
    /// Go on or stand still.
    Play {
        /// Of this input.
        #[serde(default)]
        input: u32,
        /// Go on.
        on: bool,
    },
    /// Jump.
    Seek {
        /// Of this input.
        #[serde(default)]
        input: u32,
        /// Scene time in seconds.
        secs: f64,
    },
    /// How fast the scene's time goes.
    Speed {
        /// Of this input.
        #[serde(default)]
        input: u32,
        /// Seconds of the scene per second.
        speed: f64,
    },
    /// What the panel sets.
    Settings(SettingsChange),
    /// The place for the picture.
    Size {
        /// Width and height in device pixels.
        place: [u32; 2],
    },
    /// A built-in scene.
    Open {
        /// Its name.
        name: String,
    },
}

/// Settings that are to change; the others stay.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SettingsChange {
    /// Of this input.
    #[serde(default)]
    pub input: u32,
    /// By its name.
    pub sampler: Option<String>,
    /// Of the sampler `adaptive`, in [0, 1].
    #[serde(default, deserialize_with = "present")]
    pub temporal: Option<Option<f32>>,
    /// Of the sampler `change`, in [0, 1].
    #[serde(default, deserialize_with = "present")]
    pub w_d: Option<Option<f32>>,
    /// Of the sampler `change`, 1 to 64 pixels.
    #[serde(default, deserialize_with = "present")]
    pub tile: Option<Option<u32>>,
    /// By its name, with its options.
    pub reconstruction: Option<String>,
    /// Null: as many as the renderer can.
    #[serde(default, deserialize_with = "present")]
    pub samples_per_sec: Option<Option<f64>>,
    /// In stops.
    pub exposure_stops: Option<f32>,
    /// By its name.
    pub tone_map: Option<String>,
    /// By its name.
    pub overlay: Option<String>,
    /// By its name, or a size.
    pub picture: Option<String>,
}

/// Tells a member that is null from one that is not there.
fn present<'de, D, T>(deserializer: D) -> Result<Option<Option<T>>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    Option::deserialize(deserializer).map(Some)
}

fn one() -> f32 {
    1.0
}

// A drag over a hundred pictures, or a flight of a hundred distances, in one refresh: nobody's hand does that.
const FARTHEST: f32 = 100.0;
const ZOOMS: std::ops::RangeInclusive<f32> = 0.01..=100.0;
// Scene times are compared in f64: a thousand years are still exact to a millisecond.
const LATEST_SECS: f64 = 3e10;
const FASTEST: f64 = 100.0;
const LARGEST_PLACE: u32 = 16_384;

impl Said {
    /// From what came.
    ///
    /// # Errors
    /// If it is no such message, or a number is out of its range.
    pub fn parse(text: &str) -> Result<Said, WireError> {
        // An array of a kind and its fields would be understood, too.
        if !text.trim_start().starts_with('{') {
            return Err(WireError::Json("wanted an object".to_owned()));
        }
        let said: Said =
            serde_json::from_str(text).map_err(|error| WireError::Json(error.to_string()))?;
        said.check()?;
        Ok(said)
    }

    fn check(&self) -> Result<(), WireError> {
        match self {
            Said::Camera { orbit, pan, zoom, fly, .. } => {
                let mut far = orbit.iter().chain(pan).chain(fly);
                // Not `> FARTHEST`: NaN is refused, too.
                within("camera", "at most 100", far.all(|number| number.abs() <= FARTHEST))?;
                within("zoom", "0.01 to 100", ZOOMS.contains(zoom))
            }
            Said::Seek { secs, .. } => {
                within("secs", "at most a thousand years", secs.abs() <= LATEST_SECS)
            }
            Said::Speed { speed, .. } => within("speed", "-100 to 100", speed.abs() <= FASTEST),
            Said::Size { place } => {
                within("place", "at most 16384", place.iter().all(|&side| side <= LARGEST_PLACE))
            }
            // Settings are checked as a whole, where those that stay are known.
            _ => Ok(()),
        }
    }

    /// The client's number of this input; 0 if it has none.
    pub fn input(&self) -> u32 {
        match self {
            Said::Camera { input, .. }
            | Said::LookThrough { input, .. }
            | Said::ComeBack { input }
            | Said::Play { input, .. }
            | Said::Seek { input, .. }
            | Said::Speed { input, .. } => *input,
            Said::Settings(change) => change.input,
            Said::Drive { .. } | Said::Size { .. } | Said::Open { .. } => 0,
        }
    }
}

fn within(what: &'static str, wanted: &'static str, is: bool) -> Result<(), WireError> {
    if is {
        Ok(())
    } else {
        Err(WireError::Value { what, wanted, came: "something else".to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_messages_of_the_specification_are_taken() {
        for good in [
            r#"{"type": "drive", "on": true}"#,
            r#"{"type": "camera", "input": 7, "orbit": [0.1, -0.2], "zoom": 0.9, "fly": [0, 0, 1]}"#,
            r#"{"type": "camera"}"#,
            r#"{"type": "look_through", "input": 8, "camera": 0}"#,
            r#"{"type": "come_back"}"#,
            r#"{"type": "play", "on": false}"#,
            r#"{"type": "seek", "secs": 1.5}"#,
            r#"{"type": "speed", "speed": -0.5}"#,
            r#"{"type": "settings", "samples_per_sec": null, "picture": "512x384"}"#,
            r#"{"type": "size", "place": [1280, 800]}"#,
            r#"{"type": "open", "name": "orbit"}"#,
        ] {
            Said::parse(good).unwrap_or_else(|error| panic!("{good}: {error}"));
        }
    }

    #[test]
    fn null_is_not_the_same_as_nothing() {
        let parsed = |text| match Said::parse(text) {
            Ok(Said::Settings(change)) => change.samples_per_sec,
            other => panic!("{other:?}"),
        };
        assert_eq!(parsed(r#"{"type": "settings"}"#), None);
        assert_eq!(parsed(r#"{"type": "settings", "samples_per_sec": null}"#), Some(None));
        assert_eq!(parsed(r#"{"type": "settings", "samples_per_sec": 5}"#), Some(Some(5.0)));
    }

    #[test]
    fn anything_else_is_refused() {
        let deep = format!("{}{}", "[".repeat(10_000), "]".repeat(10_000));
        for bad in [
            "",
            "{}",
            "[]",
            "null",
            &deep,
            r#"{"type": "shutdown"}"#,
            r#"{"type": "drive"}"#,
            r#"{"type": "drive", "on": 1}"#,
            r#"{"type": "drive", "on": true, "also": 1}"#,
            r#"{"type": "drive", "on": true} x"#,
            r#"{"type": "settings", "colour": 1}"#,
            r#"{"type": "camera", "zoom": 0}"#,
            r#"{"type": "camera", "zoom": 1e300}"#,
            r#"{"type": "camera", "orbit": [1e39, 0]}"#,
            r#"{"type": "camera", "orbit": [0]}"#,
            r#"{"type": "camera", "input": -1}"#,
            r#"{"type": "seek", "secs": 1e999}"#,
            r#"{"type": "seek", "secs": 1e40}"#,
            r#"{"type": "speed", "speed": 101}"#,
            r#"{"type": "size", "place": [16385, 1]}"#,
            r#"{"type": "open", "name": 5}"#,
        ] {
            assert!(Said::parse(bad).is_err(), "{}", &bad[..bad.len().min(60)]);
        }
    }
}
