//! How the window looks: dark, quiet, compact, so that the picture is what one sees.

use eframe::egui::{
    self, Color32, CornerRadius, FontFamily, FontId, Margin, Stroke, TextStyle, Theme, vec2,
};

/// Behind everything.
pub(crate) const GROUND: Color32 = Color32::from_rgb(17, 18, 22);
/// What is chosen, and where a slider stands: the heat maps' orange.
pub(crate) const ACCENT: Color32 = Color32::from_rgb(240, 128, 48);
/// Something went wrong.
pub(crate) const ERROR: Color32 = Color32::from_rgb(255, 120, 110);
/// Behind text that lies over the picture.
pub(crate) const SCRIM: Color32 = Color32::from_rgba_premultiplied(9, 10, 12, 200);
/// Text over the picture.
pub(crate) const TEXT: Color32 = Color32::from_rgb(222, 225, 230);

/// Applies the look.
pub(crate) fn apply(context: &egui::Context) {
    context.set_theme(Theme::Dark);
    context.style_mut_of(Theme::Dark, |style| {
        style.text_styles = [
            (TextStyle::Heading, FontId::new(15.0, FontFamily::Proportional)),
            (TextStyle::Body, FontId::new(13.0, FontFamily::Proportional)),
            (TextStyle::Button, FontId::new(13.0, FontFamily::Proportional)),
            (TextStyle::Small, FontId::new(11.0, FontFamily::Proportional)),
            (TextStyle::Monospace, FontId::new(12.0, FontFamily::Monospace)),
        ]
        .into();
        style.spacing.item_spacing = vec2(8.0, 6.0);
        style.spacing.interact_size.y = 22.0;
        style.spacing.button_padding = vec2(8.0, 3.0);
        style.spacing.slider_width = 110.0;
        // Nothing slides or fades: every extra repaint is taken from the picture.
        style.animation_time = 0.0;
        let visuals = &mut style.visuals;
        visuals.panel_fill = GROUND;
        visuals.window_fill = GROUND;
        visuals.extreme_bg_color = Color32::from_rgb(13, 14, 17);
        visuals.selection.bg_fill = ACCENT.gamma_multiply(0.55);
        visuals.selection.stroke = Stroke::new(1.0, Color32::WHITE);
        visuals.slider_trailing_fill = true;
        for widget in [
            &mut visuals.widgets.inactive,
            &mut visuals.widgets.hovered,
            &mut visuals.widgets.active,
            &mut visuals.widgets.open,
        ] {
            widget.corner_radius = CornerRadius::same(4);
        }
        visuals.widgets.inactive.bg_fill = Color32::from_rgb(44, 48, 57);
        visuals.widgets.inactive.weak_bg_fill = Color32::from_rgb(36, 39, 47);
        visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_rgb(40, 43, 51));
    });
}

/// The frame of the side panel and the bar below the picture; the ground shows through.
pub(crate) fn panel_frame() -> egui::Frame {
    egui::Frame::NONE.inner_margin(Margin::symmetric(12, 8))
}
