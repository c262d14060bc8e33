//! What a scene needs to be seen and the file does not have: a camera, and light. Every addition is a note.

use glam::{Quat, Vec3};

use super::warnings::Warnings;
use crate::{
    Bounds, Camera, Geometry, Light, LightKind, Material, Node, Projection, Scene, Transform,
};
use crate::{FARTHEST_M, frame_bounds, look_at};

/// The angle between the top and the bottom of the added camera's picture: 40°, between a normal and a wide lens.
const YFOV_RAD: f32 = 0.7;

/// Adds a camera that shows everything at time 0, if the scene has none.
pub(super) fn add_camera(scene: &mut Scene, warnings: &mut Warnings) {
    /// Width / height. On a narrower canvas the sides are cut off.
    const ASPECT: f32 = 4.0 / 3.0;
    /// What is framed where there is nothing to be seen.
    const EMPTY: Bounds = Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE };
    /// A nanometre: squares of a thousandth of it are still numbers.
    const SMALLEST_RADIUS: f32 = 1e-9;
    /// The same of the distance from the origin, four steps of single precision: what is smaller would frame rounding errors.
    const SMALLEST_SHARE: f32 = 2.5e-7;
    const FARTHEST: Vec3 = Vec3::splat(FARTHEST_M);
    /// What is farther away may be lost.
    const DRAWN: f32 = 1.001e12;
    if !scene.cameras.is_empty() {
        return;
    }
    let seen = bounds_in_motion(scene);
    if seen.is_none() && !scene.instances.is_empty() {
        warnings.add("nothing can be seen: everything has coordinates that are no numbers");
    }
    let mut bounds = seen.unwrap_or(EMPTY);
    if bounds.min.min(-bounds.max).min_element() < -DRAWN {
        warnings.add("something is farther than 1e12 m from the origin, and may not be drawn");
    }
    bounds.min = bounds.min.clamp(-FARTHEST, FARTHEST);
    bounds.max = bounds.max.clamp(-FARTHEST, FARTHEST);
    let centre = bounds.centre();
    let rounding = SMALLEST_SHARE * centre.abs().max_element();
    if bounds.radius() < SMALLEST_RADIUS.max(rounding) {
        warnings.add("everything is too small, for where it stands, to be told from a point");
        let half = Vec3::splat(0.5f32.max(100.0 * rounding));
        bounds = Bounds { min: centre - half, max: centre + half };
    }
    let view = frame_bounds(bounds, YFOV_RAD, ASPECT);
    let (_, rotation, translation) = view.world_from_camera.to_scale_rotation_translation();
    let node = add_node(scene, "added camera", translation, rotation);
    let projection = Projection::Perspective { yfov_rad: YFOV_RAD };
    scene.cameras.push(Camera { name: "added camera".to_owned(), node, projection });
    let note = "no camera in the file: added one that looks at everything";
    scene.notes.push(note.to_owned());
}

/// Of everything at the begin, and while it moves if that is not much more.
fn bounds_in_motion(scene: &Scene) -> Option<Bounds> {
    /// Moments of the animation that are looked at.
    const MOMENTS: u32 = 8;
    /// What moves farther is not worth seeing everything else so small.
    const MOST_GROWTH: f32 = 1.8;
    let duration = scene.animation.duration_secs;
    let at = |moment| {
        scene.bounds_at(&scene.state_at(duration * f64::from(moment) / f64::from(MOMENTS)))
    };
    let first = at(0)?;
    let moments = if duration > 0.0 { MOMENTS } else { 0 };
    let all = (1..moments).filter_map(at).fold(first, Bounds::union);
    Some(if all.radius() <= MOST_GROWTH * first.radius() { all } else { first })
}

/// How notes of added light begin.
pub(crate) const NO_LIGHT: &str = "no light in the file";

/// Adds light, if the scene has no lights: all of it, or a little where surfaces glow.
pub(super) fn add_light(scene: &mut Scene) {
    if !scene.lights.is_empty() {
        return;
    }
    scene.has_added_light = true;
    if has_glowing_triangles(scene) {
        // Lets the scene be seen by renderers that do not follow light from glowing surfaces to others.
        scene.ambient = Vec3::splat(0.2);
        scene.notes.push(format!("{NO_LIGHT} but glowing surfaces: added faint ambient light"));
        return;
    }
    add_key_light(scene);
    // With the key light a white matte surface reaches a radiance of 1 where it faces the light, and 0.25 in its shadow.
    scene.ambient = Vec3::splat(0.25);
    scene.sky = [Vec3::new(0.25, 0.24, 0.23), Vec3::new(0.55, 0.7, 0.9)];
    let note = format!("{NO_LIGHT}: added a key light from above, ambient light and a sky");
    scene.notes.push(note);
}

/// A sun behind the added camera's left shoulder, so that what it shows has both lit and shaded sides.
fn add_key_light(scene: &mut Scene) {
    const TOWARDS_LIGHT: Vec3 = Vec3::new(-0.3, 0.8, 0.52);
    /// E of a white matte surface's radiance E / π = 0.75.
    const IRRADIANCE: f32 = 0.75 * std::f32::consts::PI;
    let aim = look_at(TOWARDS_LIGHT, Vec3::ZERO, Vec3::Y);
    let rotation = Quat::from_mat3a(&aim.matrix3);
    let node = add_node(scene, "added key light", Vec3::ZERO, rotation);
    scene.lights.push(Light {
        node,
        kind: LightKind::Directional,
        intensity: Vec3::splat(IRRADIANCE),
        range: f32::INFINITY,
    });
}

/// Whether anything is made to light the scene, rather than to be a signal lamp or a screen in it.
fn has_glowing_triangles(scene: &Scene) -> bool {
    /// What a white surface reaches in the added light; a lamp is brighter.
    const LAMP_RADIANCE: f32 = 1.0;
    let is_lamp = |m: &Material| scene.mean_radiance(m).max_element() >= LAMP_RADIANCE;
    let lamps: Vec<bool> = scene.materials.iter().map(is_lamp).collect();
    let glows = |material: u32| lamps[material as usize];
    scene.instances.iter().any(|instance| match &scene.geometries[instance.geometry as usize] {
        Geometry::Mesh(mesh) => mesh.triangle_materials.used().any(glows),
        Geometry::Sphere { material } => glows(*material),
    })
}

fn add_node(scene: &mut Scene, name: &str, translation: Vec3, rotation: Quat) -> u32 {
    let rest = Transform { translation, rotation, scale: Vec3::ONE };
    scene.nodes.push(Node { name: name.to_owned(), parent: None, rest });
    scene.nodes.len() as u32 - 1
}
