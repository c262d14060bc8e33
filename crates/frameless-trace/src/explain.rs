//! One pixel in words.

use frameless::{Display, Request, Size, ToneMap};

use crate::camera::{Camera, ViewSource};
use crate::direct::Probe;
use crate::integrator::Settings;
use crate::traverse::Stack;
use crate::world::World;

impl Probe for Vec<String> {
    fn note(&mut self, line: impl FnOnce() -> String) {
        self.push(line());
    }
}

/// How a sample's colour comes about: the ray, what it hits at every bounce, the surface, each light with its visibility
/// and contribution, and the colour, linear and as it is shown. Traces with the very code that fills pictures.
pub fn explain(
    world: &World,
    secs: f64,
    view: &ViewSource,
    size: Size,
    request: &Request,
    settings: &Settings,
) -> Vec<String> {
    let moment = world.moment(secs);
    let view = view.at(world.scene(), moment.state());
    let (x, y) = size.xy(request.pixel);
    let mut lines = vec![format!(
        "pixel ({x}, {y}) of {}×{}, sample {}, offset {:?}, at {secs} s, {}",
        size.width,
        size.height,
        request.sample_index,
        request.offset,
        settings.integrator.name()
    )];
    let camera = Camera::new(&view, size);
    let (rgb, surface) =
        world.sample_with(&moment, &camera, request, settings, &mut Stack::new(), &mut lines);
    lines.push(format!("first surface: {surface:?}"));
    let shown = |tone_map: ToneMap| {
        let [r, g, b, _] = Display::new(0.0).with_tone_map(tone_map).encode_rgba8(rgb);
        format!("{:?} (tone mapping {})", [r, g, b], tone_map.name())
    };
    let (by_default, plain) = (shown(ToneMap::default()), shown(ToneMap::None));
    lines.push(format!("linear RGB {rgb:?}, sRGB at exposure 0: {by_default}, {plain}"));
    lines
}
