//! The steps from bytes to a scene.

use std::fs::File;
use std::path::Path;

use crate::{Camera, Contents, Geometry, Material, Node, Scene, Skin, State, Target, Value};

use super::accessor::{Accessor, parse_accessors};
use super::animation::{Movers, Nodes, load_animation};
use super::buffers::{distinct_bytes, load_buffers, parse_views};
use super::camera::load_cameras;
use super::choice::Choice;
use super::compressed::decode_views;
use super::container::Container;
use super::defaults::{add_camera, add_light};
use super::document::Document;
use super::error::{Fault, LoadError, Place, Problem};
use super::extensions::check_extensions;
use super::instances::place_instances;
use super::json::{Json, parse};
use super::light::load_lights;
use super::limits::{Budget, Limits, within};
use super::lost::warn_of_lost_vertices;
use super::material::load_materials;
use super::mesh::load_meshes;
use super::node::{Hierarchy, load_nodes, node_called};
use super::skin::load_skins;
use super::texture::Textures;
use super::twins::leave_out_twins;
use super::uri::read_file;
use super::warnings::Warnings;

/// Loads a scene from a `.glb` or `.gltf` file (told apart by content); files that it names are looked for in its folder.
///
/// A file with several scenes shows its default one, else its first; see [`load_chosen`].
pub fn load(path: &Path, limits: &Limits) -> Result<Scene, LoadError> {
    load_chosen(path, &Choice::default(), limits)
}

/// Like [`load`], but shows the scene and plays the animations that are chosen.
pub fn load_chosen(path: &Path, choice: &Choice, limits: &Limits) -> Result<Scene, LoadError> {
    let shown = path.display().to_string();
    let bytes = read_whole(path, limits)?;
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
    from_bytes(&name.unwrap_or_default(), &bytes, Some(folder), choice, limits)
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
    from_bytes(name, bytes, folder, &Choice::default(), limits).map_err(|fault| fault.in_file(name))
}

/// The bytes of a plain file within the limits.
fn read_whole(path: &Path, limits: &Limits) -> Result<Vec<u8>, LoadError> {
    let (file, _) = open_plain(path, limits)?;
    read_file((file, path), "", &mut Budget::new(limits))
        .map_err(|fault| whole(fault.problem).in_file(&path.display().to_string()))
}

/// A plain file within the limits, and how many bytes it has.
pub(crate) fn open_plain(path: &Path, limits: &Limits) -> Result<(File, u64), LoadError> {
    let open = || {
        let metadata = path.metadata().map_err(|error| whole(Problem::Io(error)))?;
        if !metadata.is_file() {
            // Opening a pipe would wait for its other end.
            let wanted = "a plain file".to_owned();
            return Err(whole(Problem::Unexpected { wanted, came: "something else".to_owned() }));
        }
        let bytes = metadata.len();
        within(bytes, limits.file_bytes, "bytes of file", "")
            .map_err(|fault| whole(fault.problem))?;
        let file = File::open(path).map_err(|error| whole(Problem::Io(error)))?;
        Ok((file, bytes))
    };
    open().map_err(|fault: Fault| fault.in_file(&path.display().to_string()))
}

fn whole(problem: Problem) -> Fault {
    Fault { place: Place::Whole, problem }
}

fn from_bytes(
    name: &str,
    bytes: &[u8],
    folder: Option<&Path>,
    choice: &Choice,
    limits: &Limits,
) -> Result<Scene, Fault> {
    within(bytes.len() as u64, limits.file_bytes, "bytes of file", "")?;
    let mut warnings = Warnings::default();
    let mut budget = Budget::new(limits);
    budget.add_file(Path::new(""), bytes.len());
    let container = Container::split(bytes, &mut warnings)?;
    let value = parse(container.json, container.json_offset, &mut budget, &mut warnings)?;
    let root = Json::root(&value);
    charge_for_lists(&root, &mut budget)?;
    check_version(&root)?;
    check_extensions(&root, &value, &mut warnings)?;
    let buffers = load_buffers(&root, container.bin, folder, &mut budget, &mut warnings)?;
    let decoded = decode_views(&root, &buffers, &mut budget)?;
    let views = parse_views(&root, &buffers, &decoded)?;
    let accessors = parse_accessors(&root, &views)?;
    let mut document = Document { root, views, accessors, folder, budget, warnings };
    let mut scene = build(&mut document, choice)?;
    name.clone_into(&mut scene.name);
    finish(&mut scene, document.warnings);
    Ok(scene)
}

/// What an empty element of each list is made into at least: files of three bytes for each could fill the memory otherwise.
fn charge_for_lists(root: &Json<'_>, budget: &mut Budget) -> Result<(), Fault> {
    /// JSON pointer and the like.
    const WORDS: usize = 64;
    for (list, bytes) in [
        ("accessors", size_of::<Accessor<'_>>() + WORDS),
        ("animations", 2 * WORDS),
        ("buffers", WORDS),
        ("bufferViews", 2 * WORDS),
        ("cameras", size_of::<Camera>() + WORDS),
        ("images", 3 * WORDS),
        ("materials", size_of::<Material>() + WORDS),
        ("meshes", size_of::<Geometry>() + WORDS),
        // At rest, in the world, and what hangs below it.
        ("nodes", size_of::<Node>() + 3 * WORDS),
        ("samplers", WORDS),
        ("scenes", WORDS),
        ("skins", size_of::<Skin>() + WORDS),
        ("textures", WORDS),
    ] {
        budget.allocate(&format!("/{list}"), root.count(list), bytes)?;
    }
    Ok(())
}

fn check_version(root: &Json<'_>) -> Result<(), Fault> {
    let asset = root.required("asset")?;
    refuse_other_than_2(&asset.required("version")?)?;
    // What a reader has to know at least (glTF 2.0 §3.2): here that is 2.0.
    match asset.field("minVersion")? {
        Some(least) if least.text()? != "2.0" => Err(least.fault("glTF version 2.0")),
        _ => Ok(()),
    }
}

/// Within a major version, newer files can be read by older readers (glTF 2.0 §3.2).
fn refuse_other_than_2(version: &Json<'_>) -> Result<(), Fault> {
    match version.text()?.split('.').next() {
        Some("2") => Ok(()),
        _ => Err(version.fault("glTF version 2.x")),
    }
}

fn build(document: &mut Document<'_>, choice: &Choice) -> Result<Scene, Fault> {
    let limits = document.budget.limits.clone();
    let root = document.root.clone();
    let mut hierarchy = load_nodes(&root, choice.scene.as_ref(), &limits, &mut document.warnings)?;
    let mut textures = Textures::parse(&root, &document.views)?;
    let pieces = document.accessors.iter().flat_map(Accessor::pieces);
    document.budget.tell(distinct_bytes(pieces.chain(textures.pieces(&document.views))));
    let mut scene =
        Scene { materials: load_materials(document, &mut textures)?, ..Scene::default() };
    scene.images = textures.decode(&scene.materials, document);
    scene.textures = textures.textures;
    let meshes = load_meshes(document, &scene.materials)?;
    scene.geometries = meshes.geometries;
    add_default_material(&mut scene);
    let skins = load_skins(document, &hierarchy)?;
    let weights_of = place_instances(&mut scene, document, &mut hierarchy, skins, meshes.same_as)?;
    scene.cameras = load_cameras(&root, &hierarchy, &mut document.budget)?;
    scene.lights = load_lights(&root, &hierarchy, &limits, &mut document.warnings)?;
    scene.contents = load_contents(&root, &hierarchy)?;
    let nodes = Nodes { hierarchy: &hierarchy, weights_of: &weights_of };
    let (animation, movers) =
        load_animation(document, &nodes, &choice.animation, &mut scene.contents)?;
    scene.animation = animation;
    scene.nodes.clone_from(&hierarchy.nodes);
    set_still_pose(&mut scene);
    let state = scene.state_at(0.0);
    refuse_infinite_places(&state, &hierarchy, &movers, &root)?;
    leave_out_twins(&mut scene, &state, &mut document.warnings);
    warn_of_lost_vertices(&scene, &state, &hierarchy, &mut document.warnings);
    Ok(scene)
}

/// Triangles without a material name the one after the file's last.
fn add_default_material(scene: &mut Scene) {
    let beyond = scene.materials.len() as u32;
    let is_needed = scene.geometries.iter().any(|geometry| match geometry {
        Geometry::Mesh(mesh) => mesh.triangle_materials.used().any(|material| material == beyond),
        Geometry::Sphere { .. } => false,
    });
    if is_needed {
        scene.materials.push(Material { name: "default".to_owned(), ..Material::default() });
    }
}

/// Names of what can be chosen.
fn load_contents(root: &Json<'_>, hierarchy: &Hierarchy) -> Result<Contents, Fault> {
    let names = |key: &str| -> Result<Vec<String>, Fault> {
        Ok(root.list(key)?.iter().map(|json| json.name().to_owned()).collect())
    };
    let (scenes, animations) = (names("scenes")?, names("animations")?);
    let nodes = hierarchy.file_index.iter().map(|&index| index as u32).collect();
    Ok(Contents { scenes, shown_scene: hierarchy.scene, animations, played: Vec::new(), nodes })
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
            (Target::MorphWeight(i), Value::Scalar(w)) => scene.morph_weights[i as usize] = w,
            (target, value) => unreachable!("a glTF channel gives {target:?} no {value:?}"),
        }
    }
}

/// Finite numbers multiply to infinite ones down a chain of nodes.
fn refuse_infinite_places(
    state: &State,
    hierarchy: &Hierarchy,
    movers: &Movers,
    root: &Json<'_>,
) -> Result<(), Fault> {
    match state.world_from_node.iter().position(|place| !place.is_finite()) {
        None => Ok(()),
        Some(node) => {
            let pointer = format!("/nodes/{}", hierarchy.file_index[node]);
            let parent = |&node: &u32| hierarchy.nodes[node as usize].parent;
            let mut line = std::iter::successors(Some(node as u32), parent);
            let by = match line.find_map(|node| movers.get(&node)) {
                Some(&mover) => {
                    let animation = root.list("animations")?[mover].called("animation");
                    format!(" at time 0, as {animation} moves it")
                }
                None => String::new(),
            };
            let called = node_called(hierarchy, node);
            let came = format!("{called} infinitely large or far away{by}");
            Err(Fault::at(&pointer, "a node with a finite place in the world", came))
        }
    }
}

/// Adds what is missing, and says what was ignored.
fn finish(scene: &mut Scene, mut warnings: Warnings) {
    if scene.instances.is_empty() {
        warnings.add("the file has nothing to draw");
    }
    add_camera(scene, &mut warnings);
    add_light(scene);
    scene.warnings = warnings.into_lines();
    for warning in &scene.warnings {
        log::warn!("{}: {warning}", scene.name);
    }
    for note in &scene.notes {
        log::info!("{}: {note}", scene.name);
    }
}
