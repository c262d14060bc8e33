//! What is opened: which part of a file, how much it may ask for, and the light around it.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use frameless_scene::{AnimationChoice, Limits, Pick};

use crate::parse;

/// How a scene is opened.
#[derive(ClapArgs, Debug, Default)]
pub(crate) struct OpenArgs {
    #[command(flatten)]
    pub(crate) choice: ChoiceArgs,

    #[command(flatten)]
    pub(crate) environment: EnvironmentArgs,

    #[command(flatten)]
    pub(crate) limits: LimitArgs,
}

/// Which part of a glTF file.
#[derive(ClapArgs, Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct ChoiceArgs {
    /// Show this of the file's scenes: a number from 0, or a name [default: the one that the file names, else its first]
    #[arg(long = "scene", value_name = "N|NAME", value_parser = parse::pick)]
    pub(crate) file_scene: Option<Pick>,

    /// Play this of the file's animations: a number from 0, a name, all or none [default: all at once; the first alone if two
    /// of them move the same thing]
    #[arg(long, value_name = "N|NAME|all|none", value_parser = parse::animation)]
    pub(crate) animation: Option<AnimationChoice>,
}

/// What is far away.
#[derive(ClapArgs, Debug)]
pub(crate) struct EnvironmentArgs {
    /// Light the scene by a Radiance picture (.hdr) of all that is far away, which is seen behind it, too
    ///
    /// Latitude and longitude; the middle column is seen along +x. It takes the place of light that is added to files without any.
    #[arg(long = "env", value_name = "FILE")]
    pub(crate) file: Option<PathBuf>,

    /// Turn the environment about the vertical, in degrees; positive turns what is along +z towards +x
    #[arg(long = "env-rotation", value_name = "DEGREES", default_value = "0")]
    #[arg(value_parser = parse::finite, allow_negative_numbers = true, requires = "file")]
    pub(crate) rotation_deg: f64,

    /// Multiply the environment's light
    #[arg(long = "env-strength", value_name = "FACTOR", default_value = "1")]
    #[arg(value_parser = parse::positive, requires = "file")]
    pub(crate) strength: f64,
}

impl Default for EnvironmentArgs {
    fn default() -> EnvironmentArgs {
        EnvironmentArgs { file: None, rotation_deg: 0.0, strength: 1.0 }
    }
}

/// How much a file may ask for. What it asks for is checked before it is given.
#[derive(ClapArgs, Debug)]
#[command(next_help_heading = "Limits of a file")]
pub(crate) struct LimitArgs {
    /// Bytes of everything that is decoded: vertices, triangles, keyframes, texels; K, M and G are powers of 1024
    #[arg(long, value_name = "BYTES", default_value = "4G", value_parser = parse::bytes)]
    max_memory: u64,

    /// Triangles of all meshes; twice as many vertices
    #[arg(long, value_name = "N", default_value_t = Limits::default().triangles)]
    max_triangles: u64,

    /// Pixels of all textures together, and of the environment; beyond six per byte of file and an eighth of this, textures are halved
    #[arg(long, value_name = "N", default_value_t = Limits::default().total_pixels)]
    max_texture_pixels: u64,

    /// Nodes
    #[arg(long, value_name = "N", default_value_t = Limits::default().nodes)]
    max_nodes: u64,

    /// Nodes between the scene and its deepest node
    #[arg(long, value_name = "N", default_value_t = Limits::default().node_depth)]
    max_nesting: u64,

    /// Meshes at nodes
    #[arg(long, value_name = "N", default_value_t = Limits::default().instances)]
    max_instances: u64,

    /// Lights at nodes
    #[arg(long, value_name = "N", default_value_t = Limits::default().lights)]
    max_lights: u64,

    /// Surfaces on top of each other, or nearly so: boxes of the tree over all triangles that a ray has to ask, twice as many if
    /// it stopped nowhere; as often as it asks, a picture takes long
    #[arg(long, value_name = "N", default_value_t = Limits::default().overlap)]
    max_overlap: u64,
}

impl Default for LimitArgs {
    fn default() -> LimitArgs {
        let limits = Limits::default();
        LimitArgs {
            max_memory: limits.decoded_bytes,
            max_triangles: limits.triangles,
            max_texture_pixels: limits.total_pixels,
            max_nodes: limits.nodes,
            max_nesting: limits.node_depth,
            max_instances: limits.instances,
            max_lights: limits.lights,
            max_overlap: limits.overlap,
        }
    }
}

impl LimitArgs {
    /// Those that follow from others are raised and lowered with them.
    pub(crate) fn limits(&self) -> Limits {
        let default = Limits::default();
        // As many as fit.
        let scaled = |count: u64| {
            let scaled = u128::from(count) * u128::from(self.max_memory);
            (scaled / u128::from(default.decoded_bytes)).try_into().unwrap_or(u64::MAX)
        };
        Limits {
            decoded_bytes: self.max_memory,
            // A file is at most as large as what is in it, but for text.
            file_bytes: default.file_bytes.max(self.max_memory / 4),
            triangles: self.max_triangles,
            vertices: self.max_triangles.saturating_mul(2),
            image_pixels: default.image_pixels.max(self.max_texture_pixels / 2),
            total_pixels: self.max_texture_pixels,
            nodes: self.max_nodes,
            node_depth: self.max_nesting,
            instances: self.max_instances,
            lights: self.max_lights,
            overlap: self.max_overlap,
            keyframes: scaled(default.keyframes),
            json_values: scaled(default.json_values),
            ..default
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_flags_mean_the_librarys_limits() {
        assert_eq!(LimitArgs::default().limits(), Limits::default());
    }

    #[test]
    fn half_the_memory_means_half_the_values() {
        let default = Limits::default();
        let max_memory = default.decoded_bytes / 2;
        let limits = LimitArgs { max_memory, ..LimitArgs::default() }.limits();
        assert_eq!(
            (limits.json_values, limits.keyframes),
            (default.json_values / 2, default.keyframes / 2)
        );
        let most = LimitArgs { max_memory: u64::MAX, ..LimitArgs::default() }.limits();
        assert!(most.json_values > default.json_values);
    }
}
