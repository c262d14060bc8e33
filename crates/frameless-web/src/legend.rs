//! What a page is told once, or seldom: who is there to choose from, and what an overlay's colours mean.

use frameless_scene::{BUILTIN_DESCRIPTIONS, BUILTIN_NAMES};
use frameless_session::{Colours, Drawn, heatmap};

use crate::Secret;
use crate::settings;
use crate::wire::{Choice, NamedColour, Told, VERSION};

/// Colours of the bar: between them the page interpolates, which no eye can tell from the map itself.
const COLOURS: usize = 36;

/// First and once. `upload_bytes` is none where the renderer takes no scenes.
pub(crate) fn welcome(
    client: u32,
    token: &Secret,
    upload_bytes: Option<u64>,
    has_own_sampler: bool,
) -> Told {
    let scenes = BUILTIN_NAMES.into_iter().zip(BUILTIN_DESCRIPTIONS);
    let choice = |(name, description)| Choice { name, title: None, description };
    Told::Welcome {
        version: VERSION,
        program: concat!("frameless ", env!("CARGO_PKG_VERSION")),
        client,
        token: token.as_str().to_owned(),
        upload_bytes: upload_bytes.unwrap_or(0),
        scenes: if upload_bytes.is_some() { scenes.map(choice).collect() } else { Vec::new() },
        samplers: settings::samplers(has_own_sampler),
        tone_maps: settings::tone_maps(),
        overlays: settings::overlays(),
    }
}

/// What the colours mean.
pub(crate) fn told(overlay: Option<&Drawn>) -> Told {
    let Some(Drawn::HeatMap(legend)) = overlay else {
        let (ticks, colours) = (Vec::new(), Vec::new());
        return Told::Legend { title: None, ticks, colours, names: Vec::new() };
    };
    let rgb = |[r, g, b, _]: [u8; 4]| [r, g, b];
    let title = Some(legend.title);
    match &legend.colours {
        Colours::Scale(scale) => {
            let at = |i| i as f32 / (COLOURS - 1) as f32;
            let colours = (0..COLOURS).map(|i| rgb(heatmap::colour(at(i)))).collect();
            Told::Legend { title, ticks: scale.ticks(), colours, names: Vec::new() }
        }
        Colours::Names(names) => {
            let named = |&(colour, name): &([u8; 4], _)| NamedColour { colour: rgb(colour), name };
            let names = names.iter().map(named).collect();
            Told::Legend { title, ticks: Vec::new(), colours: Vec::new(), names }
        }
    }
}
