//! A glTF mesh: its primitives joined to one [`Mesh`] with a material per triangle.

use std::collections::HashMap;
use std::rc::Rc;

use glam::{Vec2, Vec3, Vec4};

use crate::{Geometry, Material, Mesh, MorphTarget, TextureRef, UV_SETS};

use super::attributes::{Attributes, TargetVertices, Vertices};
use super::coincident::leave_out_coincident;
use super::document::Document;
use super::error::Fault;
use super::influences::{append_influences, settle_influences};
use super::json::Json;
use super::normals::{flatten, repair};
use super::tangents;
use super::topology::Topology;
use super::twins::most_in_one_place;

/// All meshes of the file, in its order.
pub(super) struct Meshes {
    /// Those without triangles are empty, and so are those that are the same as others.
    pub(super) geometries: Vec<Geometry>,
    /// Per mesh: the first that is made of the same accessors in the same way, which is perhaps itself.
    pub(super) same_as: Vec<usize>,
}

/// Reads them. Triangles of primitives without a material get `materials.len()`.
pub(super) fn load_meshes(
    document: &mut Document<'_>,
    materials: &[Material],
) -> Result<Meshes, Fault> {
    let (mut geometries, mut same_as) = (Vec::new(), Vec::new());
    let mut known: HashMap<Vec<Made>, usize> = HashMap::new();
    for (index, json) in document.root.list("meshes")?.iter().enumerate() {
        let primitives = json.required("primitives")?.elements()?;
        let primitives = primitives.iter().map(|json| Primitive::parse(json, document, materials));
        let primitives = primitives.collect::<Result<Vec<_>, Fault>>()?;
        refuse_other_target_counts(&primitives)?;
        for primitive in &primitives {
            warn_of_what_is_left_out(primitive, json, document, materials);
        }
        let made = primitives.iter().map(Primitive::made).collect();
        let first = *known.entry(made).or_insert(index);
        same_as.push(first);
        geometries.push(Geometry::Mesh(match first == index {
            true => load_mesh(json, &primitives, document, materials)?,
            false => Mesh::default(),
        }));
    }
    Ok(Meshes { geometries, same_as })
}

fn load_mesh(
    json: &Json<'_>,
    primitives: &[Primitive<'_>],
    document: &mut Document<'_>,
    materials: &[Material],
) -> Result<Mesh, Fault> {
    let shaded_smoothly = primitives.iter().any(|primitive| primitive.attributes.normal.is_some());
    let mut joiner =
        Joiner { json, shaded_smoothly, mesh: Mesh::default(), shared: HashMap::new() };
    for primitive in primitives {
        if primitive.attributes.position.is_some() && primitive.topology.is_some() {
            joiner.add(primitive, document)?;
        }
    }
    let mut mesh = joiner.mesh;
    settle_influences(&mut mesh, json, document);
    drop_useless_displacements(&mut mesh);
    let veils = |material: u32| match materials.get(material as usize) {
        Some(material) => most_in_one_place(material) as usize,
        None => 1,
    };
    if leave_out_coincident(&mut mesh, veils) > 0 {
        let what = "triangles that are there already were left out";
        document.warnings.about(what, json.called("mesh"));
    }
    Ok(mesh)
}

/// All primitives of a mesh have the same morph targets (glTF 2.0 §3.7.2.2).
fn refuse_other_target_counts(primitives: &[Primitive<'_>]) -> Result<(), Fault> {
    let Some(first) = primitives.first() else { return Ok(()) };
    let wanted = first.attributes.targets.len();
    for primitive in primitives {
        let came = primitive.attributes.targets.len();
        if came != wanted {
            let wanted = format!("{wanted} morph targets, as the mesh's first primitive has");
            return Err(Fault::at(primitive.json.pointer(), wanted, came));
        }
    }
    Ok(())
}

/// Displacements of what the mesh does not have.
fn drop_useless_displacements(mesh: &mut Mesh) {
    for target in &mut mesh.targets {
        if mesh.normals.is_empty() {
            target.normals.clear();
        }
        if mesh.colors.is_empty() {
            target.colors.clear();
        }
    }
}

/// All that the vertices and triangles of a primitive depend on: accessors, indices, order and material.
type Made = (Attributes, Option<usize>, Option<Topology>, u32);

/// A primitive whose references are known to lead somewhere.
struct Primitive<'a> {
    json: Json<'a>,
    attributes: Attributes,
    /// Accessor and where it is named.
    indices: Option<(usize, Json<'a>)>,
    /// `None`: points or lines.
    topology: Option<Topology>,
    material: Option<usize>,
    /// What triangles store.
    material_slot: u32,
    /// Whose axes are asked for.
    normal_map: Option<TextureRef>,
}

impl<'a> Primitive<'a> {
    fn parse(
        json: &Json<'a>,
        document: &mut Document<'_>,
        materials: &[Material],
    ) -> Result<Primitive<'a>, Fault> {
        let attributes = Attributes::parse(json, &document.accessors, &mut document.warnings)?;
        let accessors = document.accessors.len();
        let indices = match json.field("indices")? {
            Some(indices) => {
                let accessor = indices.index(accessors, "accessors")?;
                document.accessors[accessor].check_indices(&indices)?;
                Some((accessor, indices))
            }
            None => None,
        };
        let material = match json.field("material")? {
            Some(material) => Some(material.index(materials.len(), "materials")?),
            None => None,
        };
        let normal_map = material.and_then(|material| normal_map(&materials[material]));
        Ok(Primitive {
            normal_map,
            json: json.clone(),
            attributes,
            indices,
            topology: Topology::parse(json)?,
            material,
            material_slot: material.unwrap_or(materials.len()) as u32,
        })
    }
}

impl Primitive<'_> {
    fn made(&self) -> Made {
        let indices = self.indices.as_ref().map(|(accessor, _)| *accessor);
        (self.attributes.clone(), indices, self.topology, self.material_slot)
    }
}

/// The normal map of the surface, else of its coat: where both have one, they are expected to lie alike.
fn normal_map(material: &Material) -> Option<TextureRef> {
    let coat = material.layers.as_ref().and_then(|layers| layers.clearcoat_normal_texture);
    material.normal_texture.or(coat).map(|(texture, _)| texture)
}

fn warn_of_what_is_left_out(
    primitive: &Primitive<'_>,
    mesh: &Json<'_>,
    document: &mut Document<'_>,
    materials: &[Material],
) {
    let mut warn = |what: &str| document.warnings.about(what, mesh.called("mesh"));
    if primitive.topology.is_none() {
        warn("points and lines are not drawn");
    }
    if primitive.attributes.position.is_none() {
        warn("primitives without POSITION are not drawn");
    }
    let lacks = |texture: TextureRef| primitive.attributes.uvs[texture.uv_set as usize].is_none();
    let material = primitive.material.map(|material| &materials[material]);
    if material.is_some_and(|material| material.textures().any(|(texture, _)| lacks(texture))) {
        warn("a texture shows one texel only, as the mesh lacks its texture coordinates");
    }
}

/// The primitives of a mesh so far.
struct Joiner<'a> {
    json: &'a Json<'a>,
    /// Whether any primitive has normals, so that all need some.
    shaded_smoothly: bool,
    mesh: Mesh,
    /// Primitives that share vertices in the file share them here.
    shared: HashMap<Attributes, Shared>,
}

/// The vertices of an attribute set.
#[derive(Clone)]
struct Shared {
    /// Index of the first of them.
    first: u32,
    /// Those that are nowhere, counted from the first.
    nowhere: Rc<Vec<u32>>,
    /// As in the file.
    tangents: Option<Rc<Vec<Vec4>>>,
}

impl Joiner<'_> {
    fn add(&mut self, primitive: &Primitive<'_>, document: &mut Document<'_>) -> Result<(), Fault> {
        let mut triangles = read_triangles(primitive, document)?;
        let needs_flat_normals = self.shaded_smoothly && primitive.attributes.normal.is_none();
        if needs_flat_normals {
            let shared = self.read_vertices(&primitive.attributes, document)?;
            let pointer = primitive.json.pointer();
            document.budget.add_vertices(pointer, 3 * triangles.len())?;
            let each = bytes_per_flat_vertex(&shared);
            document.budget.allocate(pointer, 3 * triangles.len(), each)?;
            let flat = flatten(&shared, &mut triangles);
            let appended = self.append_vertices(flat, pointer, document)?;
            return self.append_triangles(primitive, triangles, &appended, document);
        }
        if !self.shared.contains_key(&primitive.attributes) {
            let mut vertices = self.read_vertices(&primitive.attributes, document)?;
            self.repair_normals(&mut vertices, &triangles, document);
            let pointer = primitive.json.pointer();
            let appended = self.append_vertices(vertices, pointer, document)?;
            self.shared.insert(primitive.attributes.clone(), appended);
        }
        let appended = self.shared[&primitive.attributes].clone();
        self.append_triangles(primitive, triangles, &appended, document)
    }

    fn read_vertices(
        &self,
        attributes: &Attributes,
        document: &mut Document<'_>,
    ) -> Result<Vertices, Fault> {
        let Document { accessors, budget, warnings, .. } = document;
        Vertices::read(attributes, accessors, self.json, budget, warnings)
    }

    fn repair_normals(
        &self,
        vertices: &mut Vertices,
        triangles: &[[u32; 3]],
        document: &mut Document<'_>,
    ) {
        let Some(normals) = &mut vertices.normals else { return };
        if repair(normals, &vertices.positions, triangles) > 0 {
            let what = "normals without direction were taken from the triangles around";
            document.warnings.about(what, self.json.called("mesh"));
        }
    }

    fn append_vertices(
        &mut self,
        vertices: Vertices,
        pointer: &str,
        document: &mut Document<'_>,
    ) -> Result<Shared, Fault> {
        let mesh = &mut self.mesh;
        let first = mesh.positions.len();
        document.budget.allocate(pointer, made_up(mesh, &vertices), 1)?;
        append(&mut mesh.positions, vertices.positions);
        let all = mesh.positions.len();
        extend(&mut mesh.normals, vertices.normals, Vec3::Y, first, all);
        for (uvs, more) in mesh.uvs.iter_mut().zip(vertices.uvs) {
            extend(uvs, more, Vec2::ZERO, first, all);
        }
        extend(&mut mesh.colors, vertices.colors, Vec4::ONE, first, all);
        append_influences(&mut mesh.influences, vertices.influences, first, all);
        mesh.targets.resize_with(vertices.targets.len(), MorphTarget::default);
        for (target, more) in mesh.targets.iter_mut().zip(vertices.targets) {
            extend(&mut target.positions, more.positions, Vec3::ZERO, first, all);
            extend(&mut target.normals, more.normals, Vec3::ZERO, first, all);
            extend(&mut target.colors, more.colors, Vec4::ZERO, first, all);
        }
        let tangents = vertices.tangents.map(Rc::new);
        Ok(Shared { first: first as u32, nowhere: Rc::new(vertices.nowhere), tangents })
    }

    fn append_triangles(
        &mut self,
        primitive: &Primitive<'_>,
        mut triangles: Vec<[u32; 3]>,
        vertices: &Shared,
        document: &mut Document<'_>,
    ) -> Result<(), Fault> {
        if !vertices.nowhere.is_empty() {
            let is_somewhere = |corner: &u32| vertices.nowhere.binary_search(corner).is_err();
            triangles.retain(|triangle| triangle.iter().all(is_somewhere));
        }
        self.append_tangents(primitive, &triangles, vertices, document)?;
        triangles.as_flattened_mut().iter_mut().for_each(|corner| *corner += vertices.first);
        append(&mut self.mesh.triangles, triangles);
        let count = self.mesh.triangles.len();
        self.mesh.triangle_materials.resize(count, primitive.material_slot);
        Ok(())
    }

    /// Of triangles that are about to be appended, if they have a normal map. What deforms has none: its axes are taken from where the
    /// triangle is by then.
    fn append_tangents(
        &mut self,
        primitive: &Primitive<'_>,
        triangles: &[[u32; 3]],
        vertices: &Shared,
        document: &mut Document<'_>,
    ) -> Result<(), Fault> {
        let deforms = !self.mesh.targets.is_empty() || !self.mesh.influences.is_empty();
        let map = primitive.normal_map.filter(|_| self.shaded_smoothly && !deforms);
        let before = 3 * self.mesh.triangles.len();
        let tangents = match (map, &vertices.tangents) {
            (None, _) => None,
            (Some(map), file) => {
                let pointer = primitive.json.pointer();
                document.budget.allocate(pointer, 3 * triangles.len(), size_of::<Vec4>())?;
                Some(match file {
                    Some(tangents) => tangents::from_file(tangents, triangles),
                    None => {
                        let place =
                            |triangle: &[u32; 3]| triangle.map(|corner| corner + vertices.first);
                        let placed: Vec<[u32; 3]> = triangles.iter().map(place).collect();
                        tangents::generate(&self.mesh, &placed, &map)
                    }
                })
            }
        };
        let all = before + 3 * triangles.len();
        extend(&mut self.mesh.tangents, tangents, tangents::UNKNOWN, before, all);
        Ok(())
    }
}

/// What is made up where vertices that are added to those of a mesh have joints or displacements that these lack, or lack some of theirs: bytes.
fn made_up(mesh: &Mesh, added: &Vertices) -> usize {
    let all = mesh.positions.len() + added.positions.len();
    let gap = |have: usize, more: Option<usize>| match (have, more) {
        (0, None) => 0,
        (have, more) => all.saturating_sub(have + more.unwrap_or(0)),
    };
    let of_set = |k: usize| {
        let have = mesh.influences.get(k).map_or(0, |set| set.joints.len());
        gap(have, added.influences.get(k).map(|set| set.joints.len())) * BYTES_PER_INFLUENCES
    };
    let none = MorphTarget::default();
    let of_target = |(k, more): (usize, &TargetVertices)| {
        let have = mesh.targets.get(k).unwrap_or(&none);
        12 * gap(have.positions.len(), more.positions.as_ref().map(Vec::len))
            + 12 * gap(have.normals.len(), more.normals.as_ref().map(Vec::len))
            + 16 * gap(have.colors.len(), more.colors.as_ref().map(Vec::len))
    };
    let sets = mesh.influences.len().max(added.influences.len());
    let displacements = added.targets.iter().enumerate().map(of_target).sum::<usize>();
    (0..sets).map(of_set).sum::<usize>() + displacements
}

/// Four joints and their weights.
pub(super) const BYTES_PER_INFLUENCES: usize = 8 + 16;

/// Of each vertex that is made from one of `vertices`.
fn bytes_per_flat_vertex(vertices: &Vertices) -> usize {
    let displaced = |target: &TargetVertices| {
        12 * usize::from(target.positions.is_some()) + 16 * usize::from(target.colors.is_some())
    };
    let targets: usize = vertices.targets.iter().map(displaced).sum();
    BYTES_PER_VERTEX + vertices.influences.len() * BYTES_PER_INFLUENCES + targets
}

/// Position, normal, texture coordinates, colour.
const BYTES_PER_VERTEX: usize = 12 + 12 + UV_SETS * 8 + 16;

/// Itself, what is made of it for rays (about 36), and as many again for the time that this takes: a microsecond.
const BYTES_PER_TRIANGLE: usize = 128;

/// Appends `more` to `values`. The first of them stay where they are: of a large mesh there may be no room for both.
fn append<T>(values: &mut Vec<T>, more: Vec<T>) {
    if values.is_empty() {
        *values = more;
    } else {
        values.extend(more);
    }
}

/// Appends `more` to `values` so that it is `all` long, unless it stays empty; vertices without a value get `filler`.
pub(super) fn extend<T: Copy>(
    values: &mut Vec<T>,
    more: Option<Vec<T>>,
    filler: T,
    first: usize,
    all: usize,
) {
    match more {
        Some(more) => {
            values.resize(first, filler);
            append(values, more);
        }
        None if values.is_empty() => {}
        None => values.resize(all, filler),
    }
}

/// The triangles with indices into the primitive's own vertices, in bounds.
fn read_triangles(
    primitive: &Primitive<'_>,
    document: &mut Document<'_>,
) -> Result<Vec<[u32; 3]>, Fault> {
    let (Some(position), Some(topology)) = (primitive.attributes.position, primitive.topology)
    else {
        return Ok(Vec::new());
    };
    let vertices = document.accessors[position].count;
    let order = match &primitive.indices {
        None => Order::Sequence(vertices),
        Some((accessor, json)) => {
            let accessor = &document.accessors[*accessor];
            // Before there is room for them, if it can be: a file may have millions.
            refuse_beyond(vertices, accessor.highest_stored_index(), json)?;
            let indices = accessor.indices(&mut document.budget)?;
            refuse_beyond(vertices, indices.iter().copied().max(), json)?;
            Order::Indices(indices)
        }
    };
    let all = 0..topology.triangle_count(order.len());
    let all = all.map(|i| topology.corners(i).map(|corner| order.vertex(corner)));
    // As strips have them where they turn; no ray hits them, in whatever pose.
    let triangles = all.filter(|[a, b, c]| a != b && b != c && c != a);
    let (count, pointer) = (triangles.clone().count(), primitive.json.pointer());
    document.budget.add_triangles(pointer, count)?;
    document.budget.allocate(pointer, count, BYTES_PER_TRIANGLE)?;
    let mut read = Vec::with_capacity(count);
    read.extend(triangles);
    Ok(read)
}

/// In which order vertices make triangles.
enum Order {
    /// As they come.
    Sequence(usize),
    /// As indices say.
    Indices(Vec<u32>),
}

/// Refuses indices up to `highest` of fewer vertices.
fn refuse_beyond(vertices: usize, highest: Option<u32>, json: &Json<'_>) -> Result<(), Fault> {
    match highest {
        Some(index) if index as usize >= vertices => {
            let wanted = format!("indices below the number of vertices, {vertices}");
            Err(Fault::at(json.pointer(), wanted, index))
        }
        _ => Ok(()),
    }
}

impl Order {
    fn len(&self) -> usize {
        match self {
            Order::Sequence(count) => *count,
            Order::Indices(indices) => indices.len(),
        }
    }

    fn vertex(&self, position: usize) -> u32 {
        match self {
            Order::Sequence(_) => position as u32,
            Order::Indices(indices) => indices[position],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Influences;

    #[test]
    fn what_is_made_up_for_other_vertices_is_counted() {
        let with_set = |count: usize| Influences {
            joints: vec![[0; 4]; count],
            weights: vec![[0.0; 4]; count],
        };
        let of = |count: usize, sets: usize| Vertices {
            positions: vec![Vec3::ZERO; count],
            influences: (0..sets).map(|_| with_set(count)).collect(),
            ..Vertices::default()
        };
        let mut mesh = Mesh { positions: vec![Vec3::ZERO; 3], ..Mesh::default() };
        assert_eq!(made_up(&mesh, &of(5, 0)), 0, "nobody has any");
        assert_eq!(made_up(&mesh, &of(5, 2)), 2 * 3 * BYTES_PER_INFLUENCES);
        mesh.influences = vec![with_set(3); 4];
        assert_eq!(made_up(&mesh, &of(5, 4)), 0, "all have them");
        assert_eq!(made_up(&mesh, &of(5, 1)), 3 * 5 * BYTES_PER_INFLUENCES);
        let mut added = of(5, 4);
        added.targets.push(TargetVertices {
            positions: Some(vec![Vec3::ZERO; 5]),
            ..TargetVertices::default()
        });
        assert_eq!(made_up(&mesh, &added), 3 * 12);
    }
}
