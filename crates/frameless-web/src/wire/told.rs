//! What the server says in JSON.

use serde::Serialize;

/// A message of the server's.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Told {
    /// First and once.
    Welcome {
        /// Of the stream.
        version: u8,
        /// Name and version.
        program: &'static str,
        /// The client's number.
        client: u32,
        /// By which the client is recognised: in uploads, and when it comes back after its connection was lost.
        token: String,
        /// The largest upload; 0 where there are no scenes.
        upload_bytes: u64,
        /// The built-in scenes.
        scenes: Vec<Choice>,
        /// Who may choose the pixels.
        samplers: Vec<Choice>,
        /// How what is brighter than white may be brought into range.
        tone_maps: Vec<Choice>,
        /// What may be shown instead of the picture.
        overlays: Vec<Choice>,
    },
    /// Another scene is shown.
    Scene {
        /// Its name.
        name: String,
        /// What was done to it.
        notes: Vec<String>,
        /// What of the file was ignored.
        warnings: Vec<String>,
        /// When it begins again; 0: nothing moves; `None`: nobody knows.
        duration_secs: Option<f64>,
        /// Names of its cameras.
        cameras: Vec<String>,
    },
    /// Everything that may change by hand.
    State {
        /// The client that drives.
        driver: Option<u32>,
        /// How many there are.
        clients: usize,
        /// The scene's time moves.
        playing: bool,
        /// Seconds of the scene per second.
        speed: f64,
        /// The scene's camera in use; none while the user has the camera.
        camera: Option<u32>,
        /// What is being opened.
        loading: Option<String>,
        /// Asked of the renderer.
        width: u32,
        /// Asked of the renderer.
        height: u32,
        /// What the panel shows.
        settings: SettingsState,
    },
    /// What the overlay's colours mean; without a title nothing.
    Legend {
        /// What is shown; numbers with their unit.
        #[serde(skip_serializing_if = "Option::is_none")]
        title: Option<&'static str>,
        /// Position and value.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        ticks: Vec<(f32, f32)>,
        /// Evenly spaced from dark to bright.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        colours: Vec<[u8; 3]>,
        /// Colours that mean something else each.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        names: Vec<NamedColour>,
    },
    /// For the user to read.
    Notice {
        /// How bad it is.
        level: Level,
        /// One line.
        text: String,
    },
}

impl Told {
    /// As it is sent.
    pub fn to_json(&self) -> String {
        // Strings, numbers and lists of them can always be written.
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// Something to choose.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Choice {
    /// As in messages.
    pub name: &'static str,
    /// As in the panel, where that differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub title: Option<&'static str>,
    /// In a sentence.
    pub description: &'static str,
}

/// A colour and its meaning.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct NamedColour {
    /// sRGB.
    pub colour: [u8; 3],
    /// What it means.
    pub name: &'static str,
}

/// How bad a notice is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Something was done.
    Info,
    /// Something went wrong.
    Error,
}

/// What the panel shows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SettingsState {
    /// By its name.
    pub sampler: &'static str,
    /// Of `adaptive`.
    pub temporal: Option<f32>,
    /// Of `change`.
    pub w_d: Option<f32>,
    /// Of `change`, in pixels.
    pub tile: Option<u32>,
    /// By its name, with its options.
    pub reconstruction: String,
    /// None: as many as the renderer can.
    pub samples_per_sec: Option<f64>,
    /// In stops.
    pub exposure_stops: f32,
    /// By its name.
    pub tone_map: &'static str,
    /// By its name.
    pub overlay: &'static str,
    /// `window`, `whole-window`, or a size.
    pub picture: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notices_and_legends_are_as_specified() {
        let notice = Told::Notice { level: Level::Info, text: "a \"b\"".to_owned() };
        assert_eq!(notice.to_json(), r#"{"type":"notice","level":"info","text":"a \"b\""}"#);
        let (ticks, colours) = (Vec::new(), Vec::new());
        let none = Told::Legend { title: None, ticks, colours, names: Vec::new() };
        assert_eq!(none.to_json(), r#"{"type":"legend"}"#);
    }
}
