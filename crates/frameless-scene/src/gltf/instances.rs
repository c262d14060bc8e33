//! Which mesh stands at which node, how often (EXT_mesh_gpu_instancing), and how it deforms.

use std::ops::Range;

use glam::{Affine3A, Quat, Vec3};

use crate::{Deformation, Geometry, Instance, Mesh, MorphTarget, Node, Scene, Skin, Transform};

use super::document::Document;
use super::error::Fault;
use super::json::Json;
use super::limits::within;
use super::mesh::BYTES_PER_INFLUENCES;
use super::node::{Hierarchy, unit};

/// Per node of the file: where in [`Scene::morph_weights`] the weights of its mesh stand.
pub(super) type WeightsOfNode = Vec<Option<Range<u32>>>;

/// One instance per node with a mesh that has triangles (or as many as the node says), in the order of the file's nodes.
/// Meshes at no node are dropped, as are skins that nothing uses.
pub(super) fn place_instances(
    scene: &mut Scene,
    document: &mut Document<'_>,
    hierarchy: &mut Hierarchy,
    skins: Vec<Option<Skin>>,
    same_as: Vec<usize>,
) -> Result<WeightsOfNode, Fault> {
    let nodes = document.root.list("nodes")?;
    let mut placer = Placer {
        file_meshes: std::mem::take(&mut scene.geometries),
        same_as,
        mesh_list: document.root.list("meshes")?,
        geometry_of: Vec::new(),
        file_skins: skins,
        skin_of: Vec::new(),
        geometries: 0,
        skins: 0,
        weights_of: vec![None; nodes.len()],
    };
    placer.geometry_of.resize(placer.file_meshes.len(), None);
    placer.skin_of.resize(placer.file_skins.len(), None);
    for (file_index, node) in nodes.iter().enumerate() {
        placer.place(file_index, node, scene, document, hierarchy)?;
    }
    scene.geometries = used(placer.geometry_of, placer.file_meshes);
    scene.skins = used(placer.skin_of, placer.file_skins).into_iter().flatten().collect();
    Ok(placer.weights_of)
}

/// The `things` that have a number, in the order of the numbers.
fn used<T>(numbers: Vec<Option<u32>>, things: Vec<T>) -> Vec<T> {
    let numbered = numbers.into_iter().zip(things);
    let mut used: Vec<_> = numbered.filter_map(|(number, thing)| Some((number?, thing))).collect();
    used.sort_by_key(|(number, _)| *number);
    used.into_iter().map(|(_, thing)| thing).collect()
}

/// The number of thing `index`: the next one if it has none yet.
fn number(numbers: &mut [Option<u32>], index: usize, next: &mut u32) -> u32 {
    *numbers[index].get_or_insert_with(|| {
        *next += 1;
        *next - 1
    })
}

struct Placer<'a> {
    file_meshes: Vec<Geometry>,
    /// See [`super::mesh::Meshes`].
    same_as: Vec<usize>,
    mesh_list: Vec<Json<'a>>,
    /// Per mesh of the file, once it is used.
    geometry_of: Vec<Option<u32>>,
    file_skins: Vec<Option<Skin>>,
    /// Per skin of the file, once it is used.
    skin_of: Vec<Option<u32>>,
    /// How many are used so far.
    geometries: u32,
    skins: u32,
    weights_of: WeightsOfNode,
}

impl Placer<'_> {
    fn place(
        &mut self,
        file_index: usize,
        node: &Json<'_>,
        scene: &mut Scene,
        document: &mut Document<'_>,
        hierarchy: &mut Hierarchy,
    ) -> Result<(), Fault> {
        let skin = match node.field("skin")? {
            Some(skin) => Some(skin.index(self.file_skins.len(), "skins")?),
            None => None,
        };
        let Some(reference) = node.field("mesh")? else { return Ok(()) };
        let mesh_index = reference.index(self.file_meshes.len(), "meshes")?;
        let Some(index) = hierarchy.index_of[file_index] else { return Ok(()) };
        let shape = self.same_as[mesh_index];
        let Geometry::Mesh(mesh) = &self.file_meshes[shape] else { return Ok(()) };
        if mesh.triangles.is_empty() {
            return Ok(());
        }
        let skin = self.usable_skin(skin, mesh, node, document)?;
        let weights = self.weights(mesh, mesh_index, node, scene, document)?;
        let places = match read_places(node, document)? {
            Some(_) if skin.is_some() => {
                let what = "a skinned mesh is drawn once, however often its node wants it";
                document.warnings.about(what, node.called("node"));
                vec![index]
            }
            Some(places) => add_nodes(&places, index, node, document, hierarchy)?,
            None => vec![index],
        };
        let all = (scene.instances.len() + places.len()) as u64;
        within(all, document.budget.limits.instances, "instances", node.pointer())?;
        let size = (mesh.positions.len(), mesh.triangles.len());
        let pose_bytes = pose_bytes(mesh, skin.and_then(|skin| self.file_skins[skin].as_ref()));
        let geometry = number(&mut self.geometry_of, shape, &mut self.geometries);
        let skin = skin.map(|skin| number(&mut self.skin_of, skin, &mut self.skins));
        for node_index in places {
            scene.instances.push(Instance { node: node_index, geometry });
            if skin.is_some() || !weights.is_empty() {
                // Every instance that deforms has vertices and triangles of its own.
                document.budget.add_vertices(node.pointer(), size.0)?;
                document.budget.add_triangles(node.pointer(), size.1)?;
                document.budget.allocate(node.pointer(), pose_bytes, 1)?;
                let (instance, weights) = (scene.instances.len() as u32 - 1, weights.clone());
                scene.deformations.push(Deformation { instance, skin, weights });
            }
        }
        self.weights_of[file_index] = (!weights.is_empty()).then_some(weights);
        Ok(())
    }

    /// The skin, if it can carry the mesh: every joint that the mesh names is one of it.
    fn usable_skin(
        &self,
        skin: Option<usize>,
        mesh: &Mesh,
        node: &Json<'_>,
        document: &mut Document<'_>,
    ) -> Result<Option<usize>, Fault> {
        let Some(index) = skin else { return Ok(None) };
        let mut keeps_shape = |why: &str| {
            let what = format!("skinned meshes keep their rest shape, as {why}");
            document.warnings.about(what, node.called("node"));
            Ok(None)
        };
        let Some(skin) = &self.file_skins[index] else {
            return keeps_shape("joints of their skin are not in the scene");
        };
        if mesh.influences.is_empty() {
            return keeps_shape("their vertices name no joints");
        }
        let joints = mesh.influences.iter().flat_map(|set| set.joints.as_flattened());
        let highest = joints.copied().max().map_or(0, usize::from);
        if highest >= skin.joints.len() {
            let wanted =
                format!("a skin of more than {highest} joints, as the mesh names that one");
            let pointer = format!("{}/skin", node.pointer());
            return Err(Fault::at(&pointer, wanted, format!("one of {}", skin.joints.len())));
        }
        Ok(Some(index))
    }

    /// Appends the weights of a node's mesh: the node's own, else the mesh's, else zeros.
    fn weights(
        &self,
        mesh: &Mesh,
        mesh_index: usize,
        node: &Json<'_>,
        scene: &mut Scene,
        document: &mut Document<'_>,
    ) -> Result<Range<u32>, Fault> {
        let targets = mesh.targets.len();
        let first = scene.morph_weights.len();
        document.budget.allocate(node.pointer(), targets, BYTES_PER_WEIGHT)?;
        let own = node.field("weights")?;
        let shared = self.mesh_list[mesh_index].field("weights")?;
        for list in [&shared, &own].into_iter().flatten() {
            let numbers = list.elements()?;
            if numbers.len() != targets {
                let wanted = format!("a weight for each of the {targets} morph targets");
                return Err(Fault::at(list.pointer(), wanted, numbers.len()));
            }
            scene.morph_weights.truncate(first);
            for number in numbers {
                scene.morph_weights.push(number.number()?);
            }
        }
        scene.morph_weights.resize(first + targets, 0.0);
        within(scene.morph_weights.len() as u64, u64::from(u32::MAX), "weights", node.pointer())?;
        Ok(first as u32..(first + targets) as u32)
    }
}

/// Itself, now and at rest, and what it takes to read it from the file.
const BYTES_PER_WEIGHT: usize = 32;

/// What an instance takes for its joints and its own shape, if that deforms, and what of morph targets has to be read for each of its poses.
fn pose_bytes(mesh: &Mesh, skin: Option<&Skin>) -> usize {
    // Now and before.
    let joints = skin.map_or(0, |skin| 2 * skin.joints.len() * size_of::<Affine3A>());
    let displaced = |target: &MorphTarget| {
        let [positions, normals] = [&target.positions, &target.normals];
        size_of_val(&positions[..]) + size_of_val(&normals[..]) + size_of_val(&target.colors[..])
    };
    let deforms = skin.is_some() || !mesh.targets.is_empty();
    let shape = match deforms {
        true => {
            // Of most meshes there is one set, which is not worth counting.
            let more_sets = skin.map_or(0, |_| mesh.influences.len().saturating_sub(1));
            (BYTES_PER_POSED_VERTEX + more_sets * BYTES_PER_INFLUENCES) * mesh.positions.len()
                + BYTES_PER_POSED_TRIANGLE * mesh.triangles.len()
        }
        false => 0,
    };
    joints + shape + mesh.targets.iter().map(displaced).sum::<usize>()
}

/// Where it is and its normal, now and before.
const BYTES_PER_POSED_VERTEX: usize = 48;
/// What is made of it for rays, and as much again while it is made.
const BYTES_PER_POSED_TRIANGLE: usize = 72;

/// Where EXT_mesh_gpu_instancing wants the mesh, in the node's coordinates.
fn read_places(
    node: &Json<'_>,
    document: &mut Document<'_>,
) -> Result<Option<Vec<Transform>>, Fault> {
    let Some(extension) = node.extension("EXT_mesh_gpu_instancing")? else { return Ok(None) };
    let mut places: Option<Vec<Transform>> = None;
    let attributes = extension.required("attributes")?;
    for (name, json) in attributes.members()? {
        let accessor = json.index(document.accessors.len(), "accessors")?;
        let count = document.accessors[accessor].count;
        if places.as_ref().is_some_and(|places| places.len() != count) {
            let wanted = "as many elements as the other attributes have";
            return Err(Fault::at(json.pointer(), wanted, count));
        }
        if places.is_none() {
            document.budget.place_instances(json.pointer(), count)?;
            document.budget.allocate(json.pointer(), count, size_of::<Transform>())?;
        }
        let places = places.get_or_insert_with(|| vec![Transform::IDENTITY; count]);
        let accessor = &document.accessors[accessor];
        match name {
            "TRANSLATION" | "SCALE" => {
                accessor.check_kind(&["VEC3"], &json)?;
                let numbers = accessor.numbers::<3>(&mut document.budget)?;
                for (place, numbers) in places.iter_mut().zip(numbers) {
                    let field =
                        if name == "SCALE" { &mut place.scale } else { &mut place.translation };
                    *field = Vec3::from_array(numbers);
                }
            }
            "ROTATION" => {
                accessor.check_kind(&["VEC4"], &json)?;
                let numbers = accessor.numbers::<4>(&mut document.budget)?;
                for (place, numbers) in places.iter_mut().zip(numbers) {
                    place.rotation = unit(Quat::from_array(numbers)).unwrap_or(Quat::IDENTITY);
                }
            }
            // Those of applications.
            _ => {}
        }
    }
    Ok(Some(places.unwrap_or_default()))
}

/// Itself, where it stands in the world, and its box.
const BYTES_PER_NODE: usize = 256;

/// A node below `parent` for every place that has finite numbers.
fn add_nodes(
    places: &[Transform],
    parent: u32,
    node: &Json<'_>,
    document: &mut Document<'_>,
    hierarchy: &mut Hierarchy,
) -> Result<Vec<u32>, Fault> {
    document.budget.allocate(node.pointer(), places.len(), BYTES_PER_NODE)?;
    let mut indices = Vec::with_capacity(places.len());
    for &rest in places {
        if !(rest.translation.is_finite() && rest.scale.is_finite()) {
            let what = "instances with infinite or NaN places were left out";
            document.warnings.about(what, node.called("node"));
            continue;
        }
        indices.push(hierarchy.nodes.len() as u32);
        hierarchy.nodes.push(Node { name: String::new(), parent: Some(parent), rest });
        hierarchy.file_index.push(hierarchy.file_index[parent as usize]);
    }
    Ok(indices)
}
