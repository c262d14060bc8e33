//! The steps from bytes to a scene.

use std::fs::File;
use std::path::Path;

use crate::{Geometry, Instance, Material, Scene, Target, Value};

use super::accessor::parse_accessors;
use super::animation::load_animation;
use super::buffers::{load_buffers, parse_views};
use super::camera::load_cameras;
use super::container::Container;
use super::defaults::{add_camera, add_light};
use super::document::Document;
use super::error::{Fault, LoadError, Place, Problem};
use super::extensions::check_extensions;
use super::json::{Json, parse};
use super::light::load_lights;
use super::limits::{Budget, Limits, within};
use super::material::load_materials;
use super::mesh::load_meshes;
use super::node::{Hierarchy, load_nodes, node_called};
use super::texture::Textures;
use super::uri::read_file;
use super::warnings::Warnings;

/// Loads a scene from a `.glb` or `.gltf` file (told apart by content); files that it names are looked for in its folder.
///
/// A file with several scenes shows its default one, else its first; see [`load_scene`].
pub fn load(path: &Path, limits: &Limits) -> Result<Scene, LoadError> {
    load_scene(path, None, limits)
}

/// Like [`load`], but shows scene number `scene` of the file, if that is given.
pub fn load_scene(path: &Path, scene: Option<usize>, limits: &Limits) -> Result<Scene, LoadError> {
    let shown = path.display().to_string();
    let bytes = read(path, limits).map_err(|fault| fault.in_file(&shown))?;
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
    from_bytes(&name.unwrap_or_default(), &bytes, Some(folder), scene, limits)
        .map_err(|fault| fault.in_file(&shown))
}

/// Loads a scene that is in memory already: dropped onto the window, or uploaded. `name` is for messages. With no
/// `folder`, a file that names others is refused.
pub fn load_bytes(
    name: &str,
    bytes: &[u8],
    folder: Option<&Path>,
    limits: &Limits,
) -> Result<Scene, LoadError> {
    from_bytes(name, bytes, folder, None, limits).map_err(|fault| fault.in_file(name))
}

fn read(path: &Path, limits: &Limits) -> Result<Vec<u8>, Fault> {
    let whole = |problem| Fault { place: Place::Whole, problem };
    let metadata = path.metadata().map_err(|error| whole(Problem::Io(error)))?;
    if !metadata.is_file() {
        // Opening a pipe would wait for its other end.
        let wanted = "a plain file".to_owned();
        return Err(whole(Problem::Unexpected { wanted, came: "something else".to_owned() }));
    }
    let file = File::open(path).map_err(|error| whole(Problem::Io(error)))?;
    read_file(file, "", &mut Budget::new(limits)).map_err(|fault| whole(fault.problem))
}

fn from_bytes(
    name: &str,
    bytes: &[u8],
    folder: Option<&Path>,
    chosen_scene: Option<usize>,
    limits: &Limits,
) -> Result<Scene, Fault> {
    within(bytes.len() as u64, limits.file_bytes, "bytes of file", "")?;
    let mut warnings = Warnings::default();
    let mut budget = Budget::new(limits);
    let container = Container::split(bytes, &mut warnings)?;
    let value = parse(container.json, container.json_offset, limits)?;
    let root = Json::root(&value);
    check_version(&root)?;
    check_extensions(&root, &value, &mut warnings)?;
    let buffers = load_buffers(&root, container.bin, folder, &mut budget, &mut warnings)?;
    let views = parse_views(&root, &buffers)?;
    let accessors = parse_accessors(&root, &views)?;
    let mut document = Document { root, views, accessors, folder, budget, warnings };
    let mut scene = build(&mut document, chosen_scene)?;
    name.clone_into(&mut scene.name);
    finish(&mut scene, document.warnings);
    Ok(scene)
}

fn check_version(root: &Json<'_>) -> Result<(), Fault> {
    let asset = root.required("asset")?;
    refuse_other_than_2(&asset.required("version")?)?;
    asset.field("minVersion")?.map_or(Ok(()), |version| refuse_other_than_2(&version))
}

/// Within a major version, newer files can be read by older readers (glTF 2.0 §3.2).
fn refuse_other_than_2(version: &Json<'_>) -> Result<(), Fault> {
    match version.text()?.split('.').next() {
        Some("2") => Ok(()),
        _ => Err(version.fault("glTF version 2.x")),
    }
}

fn build(document: &mut Document<'_>, chosen_scene: Option<usize>) -> Result<Scene, Fault> {
    let limits = document.budget.limits.clone();
    let root = document.root.clone();
    let hierarchy = load_nodes(&root, chosen_scene, &limits, &mut document.warnings)?;
    let mut textures = Textures::parse(&root, document.views.len())?;
    let mut scene =
        Scene { materials: load_materials(document, &mut textures)?, ..Scene::default() };
    (scene.textures, scene.images) = (textures.textures, textures.images);
    scene.geometries = load_meshes(document, &scene.materials)?;
    add_default_material(&mut scene);
    place_instances(&mut scene, document, &hierarchy)?;
    scene.cameras = load_cameras(&root, &hierarchy)?;
    scene.lights = load_lights(&root, &hierarchy)?;
    check_skins(document, &hierarchy)?;
    scene.animation = load_animation(document, &hierarchy)?;
    scene.nodes.clone_from(&hierarchy.nodes);
    set_still_pose(&mut scene);
    refuse_infinite_places(&scene, &hierarchy)?;
    Ok(scene)
}

/// Triangles without a material name the one after the file's last.
fn add_default_material(scene: &mut Scene) {
    let beyond = scene.materials.len() as u32;
    let is_needed = scene.geometries.iter().any(|geometry| match geometry {
        Geometry::Mesh(mesh) => mesh.triangle_materials.contains(&beyond),
        Geometry::Sphere { .. } => false,
    });
    if is_needed {
        scene.materials.push(Material { name: "default".to_owned(), ..Material::default() });
    }
}

/// One instance per node with a mesh that has triangles, in the order of the file's nodes. Meshes at no node are dropped.
fn place_instances(
    scene: &mut Scene,
    document: &Document<'_>,
    hierarchy: &Hierarchy,
) -> Result<(), Fault> {
    let file_meshes = std::mem::take(&mut scene.geometries);
    let is_empty = |mesh: usize| match &file_meshes[mesh] {
        Geometry::Mesh(mesh) => mesh.triangles.is_empty(),
        Geometry::Sphere { .. } => false,
    };
    let mut geometry_of = vec![None; file_meshes.len()];
    let mut geometry_count = 0;
    for (file_index, node) in document.root.list("nodes")?.iter().enumerate() {
        let Some(reference) = node.field("mesh")? else { continue };
        let mesh = reference.index(file_meshes.len(), "meshes")?;
        let Some(index) = hierarchy.index_of[file_index].filter(|_| !is_empty(mesh)) else {
            continue;
        };
        let geometry = *geometry_of[mesh].get_or_insert_with(|| {
            geometry_count += 1;
            geometry_count - 1
        });
        scene.instances.push(Instance { node: index, geometry });
        let limit = document.budget.limits.instances;
        within(scene.instances.len() as u64, limit, "instances", node.pointer())?;
    }
    let mut used: Vec<_> = geometry_of.into_iter().zip(file_meshes).collect();
    used.retain(|(geometry, _)| geometry.is_some());
    used.sort_by_key(|(geometry, _)| *geometry);
    scene.geometries = used.into_iter().map(|(_, mesh)| mesh).collect();
    Ok(())
}

/// Skinned meshes are drawn as they are modelled; what the skins refer to has to exist nevertheless.
fn check_skins(document: &mut Document<'_>, hierarchy: &Hierarchy) -> Result<(), Fault> {
    let nodes = document.root.list("nodes")?;
    let skins = document.root.list("skins")?;
    for skin in &skins {
        for joint in skin.required("joints")?.elements()? {
            joint.index(nodes.len(), "nodes")?;
        }
        if let Some(skeleton) = skin.field("skeleton")? {
            skeleton.index(nodes.len(), "nodes")?;
        }
        if let Some(matrices) = skin.field("inverseBindMatrices")? {
            matrices.index(document.accessors.len(), "accessors")?;
        }
    }
    for (file_index, node) in nodes.iter().enumerate() {
        let Some(skin) = node.field("skin")? else { continue };
        let skin = &skins[skin.index(skins.len(), "skins")?];
        if hierarchy.index_of[file_index].is_some() {
            let what = "skins are not drawn: the mesh keeps its rest pose";
            document.warnings.about(what, skin.called("skin"));
        }
    }
    Ok(())
}

/// An animation whose only keys are at time 0 has no length and moves nothing: it is a pose.
fn set_still_pose(scene: &mut Scene) {
    if scene.animation.duration_secs > 0.0 {
        return;
    }
    for channel in std::mem::take(&mut scene.animation.channels) {
        let nodes = &mut scene.nodes;
        match (channel.target, channel.value_at(0.0)) {
            (Target::Translation(i), Value::Vec3(v)) => nodes[i as usize].rest.translation = v,
            (Target::Rotation(i), Value::Quat(q)) => nodes[i as usize].rest.rotation = q,
            (Target::Scale(i), Value::Vec3(v)) => nodes[i as usize].rest.scale = v,
            (target, value) => unreachable!("a glTF channel gives {target:?} no {value:?}"),
        }
    }
}

/// Finite numbers multiply to infinite ones down a chain of nodes.
fn refuse_infinite_places(scene: &Scene, hierarchy: &Hierarchy) -> Result<(), Fault> {
    let places = scene.state_at(0.0).world_from_node;
    match places.iter().position(|place| !place.is_finite()) {
        None => Ok(()),
        Some(node) => {
            let pointer = format!("/nodes/{}", hierarchy.file_index[node]);
            let came = format!("{} infinitely large or far away", node_called(hierarchy, node));
            Err(Fault::at(&pointer, "a node with a finite place in the world", came))
        }
    }
}

/// Adds what is missing, and says what was ignored.
fn finish(scene: &mut Scene, mut warnings: Warnings) {
    if scene.instances.is_empty() {
        warnings.add("the file has nothing to draw");
    }
    add_camera(scene);
    add_light(scene);
    scene.warnings = warnings.into_lines();
    for warning in &scene.warnings {
        log::warn!("{}: {warning}", scene.name);
    }
    for note in &scene.notes {
        log::info!("{}: {note}", scene.name);
    }
}
