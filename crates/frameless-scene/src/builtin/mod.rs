//! The built-in suite: eight small worlds, each with one kind of motion that a renderer must cope with.
//!
//! They are plain data like a glTF file, painted and placed by formulas, so that nothing needs to be
//! downloaded and every number measured with them can be measured again. Every scene loops for ever;
//! camera 0 looks at it with a vertical angle of view of 50°; exposure fits a picture that is
//! sRGB-encoded and clipped, without tone mapping.

mod builder;
mod motion;
mod scenes;
mod textures;
mod world;

use crate::Scene;

/// What [`builtin`] knows, in the order of the documentation.
pub const BUILTIN_NAMES: [&str; 8] =
    ["sphere", "many", "orbit", "stopgo", "sudden", "shadow", "settle", "mix"];

/// What happens in each of [`BUILTIN_NAMES`], in one line.
pub const BUILTIN_DESCRIPTIONS: [&str; 8] = [
    "a big textured sphere rolls to and fro before a still camera",
    "forty small things fly about before a still camera",
    "the camera orbits and pans without rest; the world stands still",
    "the camera moves for 0.35 s and stops for 0.35 s, over and over",
    "the light jumps and changes colour at 1.0 s, a box teleports at 1.6 s",
    "the light moves and shadows sweep; mirrors show what flies behind the camera",
    "the sphere stops at 0.8 s, then everything rests (until it rolls back at 19.2 s)",
    "camera, sphere, ten small things and the light move at once",
];

/// The built-in scene of that name; `None` if it is not in [`BUILTIN_NAMES`].
pub fn builtin(name: &str) -> Option<Scene> {
    let scene = match name {
        "sphere" => scenes::sphere(),
        "many" => scenes::many(),
        "orbit" => scenes::orbit(),
        "stopgo" => scenes::stopgo(),
        "sudden" => scenes::sudden(),
        "shadow" => scenes::shadow(),
        "settle" => scenes::settle(),
        "mix" => scenes::mix(),
        _ => return None,
    };
    Some(scene)
}
