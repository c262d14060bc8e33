//! The panel at the side: what can be set.

use eframe::egui::{
    Align, ComboBox, Key, Layout, RichText, ScrollArea, Slider, TextEdit, Ui, Widget, vec2,
};
use frameless::{
    DEFAULT_TILE, DEFAULT_W_D, ReconstructionKind, ReprojectOptions, SamplerKind, Size, ToneMap,
};
use frameless_scene::Scene;

use frameless_session::{Overlay, PictureSize, Settings};

/// What the panel remembers that is no setting.
pub(crate) struct PanelState {
    /// What is typed into the field for a file.
    path: String,
    /// The parameters of the samplers that have some, while another one runs.
    change: SamplerKind,
    adaptive: SamplerKind,
    /// The options of `reproject`, while another reconstruction runs.
    reproject: ReconstructionKind,
    /// The slider of the budget, while there is none.
    samples_per_sec: f64,
}

impl Default for PanelState {
    fn default() -> Self {
        // The sketch's rate, so that ticking the box shows what it was about.
        let samples_per_sec = 900_000.0;
        PanelState {
            path: String::new(),
            change: SamplerKind::CHANGE,
            adaptive: SamplerKind::ADAPTIVE,
            reproject: ReconstructionKind::default(),
            samples_per_sec,
        }
    }
}

/// What the user asked for in the panel, apart from settings.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Wish {
    /// Look through one of the scene's cameras.
    Camera(u32),
    /// Open a file.
    Open(String),
    /// Save the picture.
    Save,
    /// Show or hide the keys.
    Help,
}

/// Draws the panel. `camera` is the scene's camera in use; none while the user has it.
pub(crate) fn show(
    ui: &mut Ui,
    state: &mut PanelState,
    settings: &mut Settings,
    scene: &Scene,
    camera: Option<u32>,
) -> Option<Wish> {
    let mut wish = None;
    ScrollArea::vertical().show(ui, |ui| {
        section(ui, "Scene");
        wish = scene_part(ui, state, scene, camera);
        section(ui, "Sampler");
        sampler_part(ui, state, settings);
        section(ui, "Reconstruction");
        reconstruction_part(ui, state, settings);
        section(ui, "Rays");
        budget_part(ui, state, settings);
        section(ui, "Picture");
        picture_part(ui, settings);
        section(ui, "Show");
        show_part(ui, settings);
        ui.add_space(6.0);
        ui.horizontal(|ui| {
            if ui.button("Save PNG").on_hover_text("F12").clicked() {
                wish = Some(Wish::Save);
            }
            if ui.button("Keys").on_hover_text("H").clicked() {
                wish = Some(Wish::Help);
            }
        });
    });
    wish
}

fn section(ui: &mut Ui, title: &str) {
    ui.add_space(6.0);
    ui.label(RichText::new(title).small().weak());
}

/// A label in a column of its own, and a widget beside it.
fn row(ui: &mut Ui, label: &str, hint: &str, widget: impl Widget) {
    const LABEL_WIDTH: f32 = 58.0;
    ui.horizontal(|ui| {
        let column = vec2(LABEL_WIDTH, ui.spacing().interact_size.y);
        ui.allocate_ui_with_layout(column, Layout::left_to_right(Align::Center), |ui| {
            ui.set_min_width(LABEL_WIDTH);
            ui.label(label).on_hover_text(hint);
        });
        ui.add(widget).on_hover_text(hint);
    });
}

/// Shows two decimals and keeps all: a slider that rounds would change what the command line has set.
fn fraction(slider: Slider<'_>) -> Slider<'_> {
    slider.custom_formatter(|value, _| format!("{value:.2}"))
}

fn scene_part(
    ui: &mut Ui,
    state: &mut PanelState,
    scene: &Scene,
    camera: Option<u32>,
) -> Option<Wish> {
    let mut wish = None;
    ui.heading(&scene.name);
    let selected = camera.map_or("free camera".to_owned(), |camera| camera_name(scene, camera));
    ComboBox::from_id_salt("camera")
        .selected_text(selected)
        .width(ui.available_width())
        .truncate()
        .show_ui(ui, |ui| {
            for index in 0..scene.cameras.len() as u32 {
                let chosen = camera == Some(index);
                if ui.selectable_label(chosen, camera_name(scene, index)).clicked() {
                    wish = Some(Wish::Camera(index));
                }
            }
        });
    ui.horizontal(|ui| {
        let hint = "path of a .glb or .gltf";
        let field = TextEdit::singleline(&mut state.path).hint_text(hint).desired_width(140.0);
        let entered = ui.add(field).lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        let clicked = ui.button("Open").clicked();
        if (entered || clicked) && !state.path.trim().is_empty() {
            wish = Some(Wish::Open(state.path.trim().to_owned()));
        }
    });
    wish
}

fn camera_name(scene: &Scene, camera: u32) -> String {
    match scene.cameras.get(camera as usize).map(|camera| camera.name.as_str()) {
        None | Some("") => format!("camera {camera}"),
        Some(name) => format!("camera {camera}: {name}"),
    }
}

fn sampler_part(ui: &mut Ui, state: &mut PanelState, settings: &mut Settings) {
    match settings.sampler {
        SamplerKind::Change { .. } => state.change = settings.sampler,
        SamplerKind::Adaptive { .. } => state.adaptive = settings.sampler,
        SamplerKind::Random | SamplerKind::Permutation => {}
    }
    ComboBox::from_id_salt("sampler")
        .selected_text(settings.sampler.name())
        .width(ui.available_width())
        .show_ui(ui, |ui| {
            let kinds =
                [state.adaptive, state.change, SamplerKind::Permutation, SamplerKind::Random];
            for kind in kinds {
                let choice = ui.selectable_value(&mut settings.sampler, kind, kind.name());
                choice.on_hover_text(sampler_hint(kind));
            }
        })
        .response
        .on_hover_text("who chooses the pixels that are traced next");
    match &mut settings.sampler {
        SamplerKind::Change { w_d, tile } => {
            let hint = format!("weight of change against age; {DEFAULT_W_D} unless set");
            row(ui, "w_d", &hint, fraction(Slider::new(w_d, 0.0..=1.0)));
            let hint = format!("side of a tile in pixels; {DEFAULT_TILE} unless set");
            row(ui, "tile", &hint, Slider::new(tile, 1..=64).logarithmic(true).suffix(" px"));
        }
        SamplerKind::Adaptive(options) => temporal_row(ui, &mut options.temporal),
        SamplerKind::Random | SamplerKind::Permutation => {}
    }
}

fn sampler_hint(kind: SamplerKind) -> &'static str {
    match kind {
        SamplerKind::Random => "any pixel, each time anew (Bishop et al. 1994)",
        SamplerKind::Permutation => "every pixel once, in random order; then again",
        SamplerKind::Change { .. } => "where colours have just changed (the sketch of 2002)",
        SamplerKind::Adaptive { .. } => {
            "what has been uncovered first, then moving edges, then where change has been learned to be fast"
        }
    }
}

/// A slider between two words.
fn temporal_row(ui: &mut Ui, temporal: &mut f32) {
    let hint = "what samples are spent on: to the left on finishing what is there, to the right on following what moves. \
                What has been learned stays";
    ui.horizontal(|ui| {
        ui.label("spatial").on_hover_text(hint);
        ui.add(Slider::new(temporal, 0.0..=1.0).show_value(false)).on_hover_text(hint);
        ui.label("temporal").on_hover_text(hint);
    });
}

fn reconstruction_part(ui: &mut Ui, state: &mut PanelState, settings: &mut Settings) {
    if matches!(settings.reconstruction, ReconstructionKind::Reproject(_)) {
        state.reproject = settings.reconstruction;
    }
    let kinds = [
        (state.reproject, "samples move with the surfaces that they hit"),
        (ReconstructionKind::Filter, "the mean of the samples around, the younger the heavier"),
        (ReconstructionKind::Hold, "each pixel shows its newest sample, however old"),
    ];
    ui.horizontal(|ui| {
        for (kind, hint) in kinds {
            let name = reconstruction_name(kind);
            ui.radio_value(&mut settings.reconstruction, kind, name).on_hover_text(hint);
        }
    });
    if let ReconstructionKind::Reproject(options) = &mut settings.reconstruction {
        reproject_options(ui, options);
    }
}

/// Without its options.
fn reconstruction_name(kind: ReconstructionKind) -> &'static str {
    match kind {
        ReconstructionKind::Hold => "hold",
        ReconstructionKind::Filter => "filter",
        ReconstructionKind::Reproject(_) => "reproject",
    }
}

fn reproject_options(ui: &mut Ui, options: &mut ReprojectOptions) {
    ui.horizontal(|ui| {
        ui.checkbox(&mut options.relight, "relight").on_hover_text(
            "shade old samples with the present lights: a switched lamp shows at once",
        );
        ui.checkbox(&mut options.antialias, "antialias")
            .on_hover_text("where nothing moves, samples add up to smooth edges");
        ui.checkbox(&mut options.deep, "deep").on_hover_text(
            "up to four samples per pixel: smoother in motion, at four times the cost of a picture",
        );
    });
}

fn show_part(ui: &mut Ui, settings: &mut Settings) {
    for (digit, overlay) in Overlay::ALL.into_iter().enumerate() {
        ui.radio_value(&mut settings.overlay, overlay, overlay.name())
            .on_hover_text(format!("{} (key {digit})", overlay.explanation()));
    }
}

// From a picture of 512×384 in three minutes to more than a CPU traces.
const BUDGETS: std::ops::RangeInclusive<f64> = 1e3..=1e8;

fn budget_part(ui: &mut Ui, state: &mut PanelState, settings: &mut Settings) {
    let mut limited = settings.samples_per_sec.is_some();
    ui.checkbox(&mut limited, "at most so many samples/s");
    let per_sec = settings.samples_per_sec.as_mut().unwrap_or(&mut state.samples_per_sec);
    ui.add_enabled_ui(limited, |ui| {
        let slider = Slider::new(per_sec, BUDGETS);
        let slider = slider.logarithmic(true).custom_formatter(|per_sec, _| metric(per_sec));
        row(ui, "rate", "samples per second", slider);
    });
    state.samples_per_sec = *per_sec;
    settings.samples_per_sec = limited.then_some(state.samples_per_sec);
}

/// 900000 → 900 k.
fn metric(number: f64) -> String {
    match number {
        1e6.. => format!("{:.2} M", number / 1e6),
        1e3.. => format!("{:.0} k", number / 1e3),
        _ => format!("{number:.0}"),
    }
}

fn picture_part(ui: &mut Ui, settings: &mut Settings) {
    let slider = fraction(Slider::new(&mut settings.exposure_stops, -8.0..=8.0));
    row(ui, "exposure", "in stops: brighter by this power of two", slider);
    ui.horizontal(|ui| {
        ui.label("tones").on_hover_text("how what is brighter than white is brought into range");
        for tone_map in ToneMap::ALL {
            let choice = ui.selectable_value(&mut settings.tone_map, tone_map, tone_map.name());
            choice.on_hover_text(tone_map.explanation());
        }
    });
    let fixed = [(320, 240), (512, 384), (640, 480), (1024, 768), (1280, 720), (1920, 1080)];
    let fixed = fixed.map(|(width, height)| PictureSize::Fixed(Size::new(width, height)));
    ComboBox::from_id_salt("size")
        .selected_text(size_name(settings.picture))
        .width(ui.available_width())
        .show_ui(ui, |ui| {
            for size in [PictureSize::default(), PictureSize::WHOLE_WINDOW].into_iter().chain(fixed)
            {
                ui.selectable_value(&mut settings.picture, size, size_name(size));
            }
        });
}

fn size_name(size: PictureSize) -> String {
    match size {
        PictureSize::WHOLE_WINDOW => "every pixel of the window".to_owned(),
        PictureSize::Window { .. } => "as the window, coarser if it is large".to_owned(),
        PictureSize::Fixed(Size { width, height }) => format!("{width} × {height}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_short() {
        let written = [1e3, 22_600.0, 900_000.0, 3.6e6].map(metric);
        assert_eq!(written, ["1 k", "23 k", "900 k", "3.60 M"]);
    }

    #[test]
    fn cameras_without_a_name_have_a_number() {
        assert_eq!(camera_name(&Scene::default(), 3), "camera 3");
    }
}
