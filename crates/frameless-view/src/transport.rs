//! The bar below the picture: play, scrub, speed.

use eframe::egui::{Button, DragValue, Key, Slider, Ui, vec2};

use frameless_session::Command;

/// What the bar shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Transport {
    /// Whether the scene's time moves.
    pub(crate) playing: bool,
    /// Seconds of the scene per second.
    pub(crate) speed: f64,
}

impl Default for Transport {
    fn default() -> Self {
        Transport { playing: true, speed: 1.0 }
    }
}

// Fast enough to skim an hour, slow enough to see a sample.
const SPEEDS: std::ops::RangeInclusive<f64> = -100.0..=100.0;

impl Transport {
    /// Draws the bar for a scene at `scene_secs` that begins again after `duration_secs`; returns what is to be done.
    pub(crate) fn show<W>(
        &mut self,
        ui: &mut Ui,
        scene_secs: f64,
        duration_secs: f64,
    ) -> Vec<Command<W>> {
        let mut commands = Vec::new();
        ui.horizontal(|ui| {
            // As wide as the wider word, so that nothing moves.
            let label = if self.playing { "Pause" } else { "Play" };
            let button = Button::new(label).min_size(vec2(58.0, 0.0));
            if ui.add(button).on_hover_text("space").clicked() {
                commands.push(self.toggle());
            }
            if duration_secs <= 0.0 {
                ui.weak("nothing moves in this scene");
                return;
            }
            let speed = DragValue::new(&mut self.speed).range(SPEEDS).speed(0.01).suffix("×");
            if ui.add(speed).on_hover_text("seconds of the scene per second").changed() {
                commands.push(Command::Speed(self.speed));
            }
            let mut at = scene_secs.rem_euclid(duration_secs);
            ui.spacing_mut().slider_width = (ui.available_width() - 80.0).max(60.0);
            // Formatted, not rounded: a slider that rounds its value reports a change in every refresh.
            let slider = Slider::new(&mut at, 0.0..=duration_secs);
            let slider = slider.custom_formatter(|secs, _| format!("{secs:.2}")).suffix(" s");
            if ui.add(slider).changed() {
                commands.push(Command::Seek(at));
            }
        });
        commands
    }

    /// Pauses or goes on.
    pub(crate) fn toggle<W>(&mut self) -> Command<W> {
        self.playing = !self.playing;
        Command::Play(self.playing)
    }

    /// The key that [`Transport::toggle`]s.
    pub(crate) const KEY: Key = Key::Space;
}
