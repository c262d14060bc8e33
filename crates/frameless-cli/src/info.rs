//! `frameless info`: what is in a scene.

use std::collections::HashSet;
use std::sync::Arc;

use frameless_scene::{
    AfterEnd, Camera, Geometry, Image, Influences, Light, LightKind, Mesh, MorphTarget, Projection,
    Scene, Target,
};
use frameless_trace::{Overlap, World};

use crate::args::InfoArgs;
use crate::failure::Failure;
use crate::{input, logger, output};

/// Bytes in a mebibyte.
const MIB: f64 = 1_048_576.0;

/// Load the scene and tell.
pub(crate) fn run(args: &InfoArgs) -> Result<(), Failure> {
    // Warnings stand in the list below.
    logger::silence();
    let limits = args.limits.limits();
    let scene = Arc::new(input::scene(&args.scene, &args.choice, &limits)?);
    // Whether it can be drawn is known when it has been made ready for that.
    let world = World::new(Arc::clone(&scene));
    let overlap = world.check_overlap(&args.scene, &limits).map_err(Failure::bad_input)?;
    Ok(output::print(&describe(&scene, &overlap))?)
}

/// A paragraph of lines `what  how many`, lists indented below, warnings last.
fn describe(scene: &Scene, overlap: &Overlap) -> String {
    let mut lines = vec![format!("scene       {}", scene.name)];
    let contents = &scene.contents;
    let shown: Vec<usize> = contents.shown_scene.into_iter().collect();
    lines.extend(parts("scenes", &contents.scenes, "shown", &shown));
    lines.extend([shapes(scene), triangles(scene), bounds(scene)]);
    lines.push(format!(
        "overlap     {} boxes for a ray, where most surfaces lie on each other",
        overlap.boxes
    ));
    lines.push(format!("materials   {}", scene.materials.len()));
    lines.push(format!("textures    {}", textures(scene)));
    lines.extend(scene.images.iter().enumerate().map(|(i, image)| item(i, &picture(image))));
    lines.push(format!("cameras     {}", scene.cameras.len()));
    lines.extend(scene.cameras.iter().enumerate().map(|(i, view)| item(i, &camera(view))));
    lines.push(format!("lights      {}", scene.lights.len()));
    lines.extend(scene.lights.iter().enumerate().map(|(i, lamp)| item(i, &light(lamp))));
    lines.push(format!("motion      {}", motion(scene)));
    lines.extend(parts("animations", &contents.animations, "played", &contents.played));
    lines.extend(deformations(scene));
    lines.extend(scene.notes.iter().map(|note| format!("note: {note}")));
    lines.extend(
        scene.warnings.iter().chain(&overlap.warnings).map(|warning| format!("warning: {warning}")),
    );
    lines.iter().map(|line| output::printable(line) + "\n").collect()
}

fn item(index: usize, text: &str) -> String {
    format!("{index:>12}  {text}")
}

/// What a file has several of, and which of them are used; nothing for built-in scenes.
fn parts(what: &str, names: &[String], used: &str, which: &[usize]) -> Vec<String> {
    if names.is_empty() {
        return Vec::new();
    }
    let mut lines = vec![format!("{what:<12}{}", names.len())];
    let which: HashSet<usize> = which.iter().copied().collect();
    let line = |(index, name): (usize, &String)| {
        let mark = if which.contains(&index) { format!(", {used}") } else { String::new() };
        item(index, &format!("{}{mark}", quoted(name)))
    };
    lines.extend(names.iter().enumerate().map(line));
    lines
}

/// What bends and bulges, if anything does.
fn deformations(scene: &Scene) -> Option<String> {
    let skinned = scene.deformations.iter().filter(|d| d.skin.is_some()).count();
    let joints: usize = scene.skins.iter().map(|skin| skin.joints.len()).sum();
    let (deforming, weights) = (scene.deformations.len(), scene.morph_weights.len());
    (deforming > 0).then(|| {
        format!(
            "deforming   {deforming} instances, {skinned} of them by skins ({joints} joints); {weights} morph weights"
        )
    })
}

fn shapes(scene: &Scene) -> String {
    let spheres = scene.geometries.iter().filter(|g| matches!(g, Geometry::Sphere { .. })).count();
    format!(
        "geometries  {} meshes and {spheres} spheres, as {} instances at {} nodes",
        scene.geometries.len() - spheres,
        scene.instances.len(),
        scene.nodes.len()
    )
}

fn triangles(scene: &Scene) -> String {
    let of = |geometry: &Geometry| mesh(geometry).map_or(0, |mesh| mesh.triangles.len());
    let stored: usize = scene.geometries.iter().map(of).sum();
    let seen: usize = scene
        .instances
        .iter()
        .map(|instance| of(&scene.geometries[instance.geometry as usize]))
        .sum();
    let bytes: usize = scene.geometries.iter().filter_map(mesh).map(mesh_bytes).sum();
    format!(
        "triangles   {stored} in {:.1} MiB, {seen} with every instance counted",
        bytes as f64 / MIB
    )
}

fn mesh(geometry: &Geometry) -> Option<&Mesh> {
    match geometry {
        Geometry::Mesh(mesh) => Some(mesh),
        Geometry::Sphere { .. } => None,
    }
}

/// Without the BVH, which takes about as much again.
fn mesh_bytes(mesh: &Mesh) -> usize {
    size_of_val(&mesh.positions[..])
        + size_of_val(&mesh.normals[..])
        + mesh.uvs.iter().map(|set| size_of_val(&set[..])).sum::<usize>()
        + size_of_val(&mesh.colors[..])
        + size_of_val(&mesh.triangles[..])
        + mesh.triangle_materials.bytes()
        + mesh.influences.iter().map(influence_bytes).sum::<usize>()
        + mesh.targets.iter().map(target_bytes).sum::<usize>()
}

fn influence_bytes(set: &Influences) -> usize {
    size_of_val(&set.joints[..]) + size_of_val(&set.weights[..])
}

fn target_bytes(target: &MorphTarget) -> usize {
    size_of_val(&target.positions[..])
        + size_of_val(&target.normals[..])
        + size_of_val(&target.colors[..])
}

fn bounds(scene: &Scene) -> String {
    match scene.bounds_at(&scene.state_at(0.0)) {
        Some(bounds) => format!("bounds      {:.3} to {:.3} m, at 0 s", bounds.min, bounds.max),
        None => "bounds      nothing to be seen".into(),
    }
}

fn textures(scene: &Scene) -> String {
    let bytes: usize = scene.images.iter().map(image_bytes).sum();
    let (textures, images) = (scene.textures.len(), scene.images.len());
    format!("{textures} of {images} images, {:.1} MiB", bytes as f64 / MIB)
}

fn image_bytes(image: &Image) -> usize {
    size_of_val(&image.rgba[..])
}

fn picture(image: &Image) -> String {
    format!("{}×{}, {:.2} MiB", image.width, image.height, image_bytes(image) as f64 / MIB)
}

/// A name from the file, in quotes, control characters escaped; of a long one the beginning.
fn quoted(name: &str) -> String {
    const MOST: usize = 100;
    match name.char_indices().nth(MOST) {
        None => format!("{name:?}"),
        Some((end, _)) => format!("{:?}…", &name[..end]),
    }
}

fn camera(camera: &Camera) -> String {
    let projection = match camera.projection {
        Projection::Perspective { yfov_rad } => {
            format!("perspective, {:.1}° from top to bottom", yfov_rad.to_degrees())
        }
        Projection::Orthographic { ymag } => {
            format!("orthographic, {} m from top to bottom", 2.0 * ymag)
        }
    };
    if camera.name.is_empty() {
        projection
    } else {
        format!("{projection}, {}", quoted(&camera.name))
    }
}

fn light(light: &Light) -> String {
    let (kind, unit) = match light.kind {
        LightKind::Point => ("point", "W/sr"),
        LightKind::Directional => ("directional", "W/m²"),
        LightKind::Spot { .. } => ("spot", "W/sr"),
    };
    format!("{kind}, {:.3} {unit}", light.intensity)
}

fn motion(scene: &Scene) -> String {
    let animation = &scene.animation;
    if animation.duration_secs == 0.0 {
        return "none".into();
    }
    let after_end = match animation.after_end {
        AfterEnd::Repeat => "then again",
        AfterEnd::Hold => "then still",
    };
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for channel in &animation.channels {
        let name = driven(channel.target);
        match counts.iter_mut().find(|(known, _)| *known == name) {
            Some((_, count)) => *count += 1,
            None => counts.push((name, 1)),
        }
    }
    let counts: Vec<String> =
        counts.iter().map(|(name, count)| format!("{count} {name}")).collect();
    format!("{:.3} s, {after_end}; channels: {}", animation.duration_secs, counts.join(", "))
}

fn driven(target: Target) -> &'static str {
    match target {
        Target::Translation(_) => "translation",
        Target::Rotation(_) => "rotation",
        Target::Scale(_) => "scale",
        Target::LightIntensity(_) => "light",
        Target::MorphWeight(_) => "morph weight",
    }
}
