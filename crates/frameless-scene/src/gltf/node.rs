//! The transform hierarchy: checked for loops, walked without recursion, parents before children.

use glam::{Mat3, Mat4, Quat, Vec3, Vec4};

use crate::{Node, Transform};

use super::choice::Pick;
use super::error::Fault;
use super::json::{Json, called};
use super::limits::{Limits, within};
use super::warnings::Warnings;

/// The nodes of one of the file's scenes.
#[derive(Debug, Default)]
pub(super) struct Hierarchy {
    /// Parents first.
    pub(super) nodes: Vec<Node>,
    /// For every node of the file: its index in `nodes`, if it belongs to the scene.
    pub(super) index_of: Vec<Option<u32>>,
    /// For every one of `nodes`: its index in the file.
    pub(super) file_index: Vec<usize>,
    /// The file's scene that these are the nodes of, if the file has scenes.
    pub(super) scene: Option<usize>,
}

/// Builds the hierarchy of scene `chosen`, else of the file's default scene, else of its first, else of all nodes.
pub(super) fn load_nodes(
    root: &Json<'_>,
    chosen: Option<&Pick>,
    limits: &Limits,
    warnings: &mut Warnings,
) -> Result<Hierarchy, Fault> {
    let file_nodes = root.list("nodes")?;
    within(file_nodes.len() as u64, limits.nodes, "nodes", "/nodes")?;
    let family = Family::parse(&file_nodes)?;
    let scene_roots = parse_scenes(root, &family)?;
    let shown = chosen_scene(root, chosen)?;
    let roots = match shown {
        Some(scene) => scene_roots[scene].clone(),
        None => family.roots(),
    };
    if scene_roots.len() > 1 && chosen.is_none() {
        warnings.add(format!("only one of the file's {} scenes is shown", scene_roots.len()));
    }
    let rest = parse_transforms(&file_nodes, warnings)?;
    let order = family.parents_first(&roots, limits)?;
    let mut hierarchy =
        Hierarchy { index_of: vec![None; file_nodes.len()], scene: shown, ..Hierarchy::default() };
    for (index, &file_index) in order.iter().enumerate() {
        hierarchy.index_of[file_index] = Some(index as u32);
        let parent = family.parent[file_index].and_then(|parent| hierarchy.index_of[parent]);
        let name = file_nodes[file_index].name().to_owned();
        hierarchy.nodes.push(Node { name, parent, rest: rest[file_index] });
    }
    hierarchy.file_index = order;
    Ok(hierarchy)
}

/// Who is whose child, by index in the file.
struct Family {
    children: Vec<Vec<usize>>,
    parent: Vec<Option<usize>>,
}

impl Family {
    /// Every node has at most one parent, and no node is its own ancestor.
    fn parse(nodes: &[Json<'_>]) -> Result<Family, Fault> {
        let mut family =
            Family { children: Vec::with_capacity(nodes.len()), parent: vec![None; nodes.len()] };
        for (index, node) in nodes.iter().enumerate() {
            let mut children = Vec::new();
            for reference in node.list("children")? {
                let child = reference.index(nodes.len(), "nodes")?;
                if let Some(other) = family.parent[child].replace(index) {
                    let wanted = format!("a node without a parent, not a child of node {other}");
                    return Err(reference.fault(wanted));
                }
                children.push(child);
            }
            family.children.push(children);
        }
        family.refuse_loops(nodes)?;
        Ok(family)
    }

    /// With at most one parent each, what no root reaches is in a loop or below one.
    fn refuse_loops(&self, nodes: &[Json<'_>]) -> Result<(), Fault> {
        let mut reached = vec![false; nodes.len()];
        let mut open = self.roots();
        while let Some(node) = open.pop() {
            reached[node] = true;
            open.extend(&self.children[node]);
        }
        match reached.iter().position(|reached| !reached) {
            None => Ok(()),
            Some(node) => {
                let came = "an ancestor that is its own descendant";
                Err(Fault::at(nodes[node].pointer(), "a node below a root", came))
            }
        }
    }

    fn roots(&self) -> Vec<usize> {
        (0..self.parent.len()).filter(|&node| self.parent[node].is_none()).collect()
    }

    /// `roots` and all below them, each after its parent.
    fn parents_first(&self, roots: &[usize], limits: &Limits) -> Result<Vec<usize>, Fault> {
        let mut order = Vec::new();
        let mut generation = roots.to_vec();
        let mut depth = 0;
        while !generation.is_empty() {
            depth += 1;
            within(depth, limits.node_depth, "levels of nodes", "/nodes")?;
            let next = generation.iter().flat_map(|&node| self.children[node].iter().copied());
            let next: Vec<usize> = next.collect();
            order.append(&mut generation);
            generation = next;
        }
        Ok(order)
    }
}

/// The root nodes of every scene.
fn parse_scenes(root: &Json<'_>, family: &Family) -> Result<Vec<Vec<usize>>, Fault> {
    root.list("scenes")?.iter().map(|scene| scene_nodes(scene, family)).collect()
}

fn scene_nodes(scene: &Json<'_>, family: &Family) -> Result<Vec<usize>, Fault> {
    let mut roots = Vec::new();
    let mut seen = std::collections::HashSet::new();
    for reference in scene.list("nodes")? {
        let node = reference.index(family.parent.len(), "nodes")?;
        if family.parent[node].is_some() {
            return Err(reference.fault("a node without a parent"));
        }
        if !seen.insert(node) {
            return Err(reference.fault("each node once"));
        }
        roots.push(node);
    }
    Ok(roots)
}

fn chosen_scene(root: &Json<'_>, chosen: Option<&Pick>) -> Result<Option<usize>, Fault> {
    let scenes = root.list("scenes")?;
    let default = match root.field("scene")? {
        Some(scene) => Some(scene.index(scenes.len(), "scenes")?),
        None => (!scenes.is_empty()).then_some(0),
    };
    match chosen {
        Some(pick) => pick.find(&scenes, "scenes", "scene").map(Some),
        None => Ok(default),
    }
}

fn parse_transforms(nodes: &[Json<'_>], warnings: &mut Warnings) -> Result<Vec<Transform>, Fault> {
    nodes.iter().map(|node| parse_transform(node, warnings)).collect()
}

fn parse_transform(node: &Json<'_>, warnings: &mut Warnings) -> Result<Transform, Fault> {
    if let Some(matrix) = node.field("matrix")? {
        let matrix = Mat4::from_cols_array(&matrix.numbers()?);
        for other in ["translation", "rotation", "scale"] {
            if node.field(other)?.is_some() {
                let what =
                    "nodes with a matrix and something else that places them: the matrix counts";
                warnings.about(what, node.called("node"));
            }
        }
        let (transform, error) = decompose(&matrix);
        if error > LARGEST_MATRIX_ERROR {
            let what = "sheared or projective matrices are drawn without shear and projection";
            warnings.about(what, node.called("node"));
        }
        return Ok(transform);
    }
    let rotation = Quat::from_array(node.numbers_or("rotation", [0.0, 0.0, 0.0, 1.0])?);
    Ok(Transform {
        translation: node.numbers_or("translation", [0.0; 3])?.into(),
        rotation: unit(rotation).unwrap_or_else(|| {
            warnings.about("rotations of length zero were left out", node.called("node"));
            Quat::IDENTITY
        }),
        scale: node.numbers_or("scale", [1.0; 3])?.into(),
    })
}

/// `rotation` at length one, unless it has no direction. In double precision: no square of a finite float overflows.
pub(super) fn unit(rotation: Quat) -> Option<Quat> {
    let q = rotation.to_array().map(f64::from);
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    let unit = Quat::from_array(q.map(|x| (x / length) as f32));
    (length.is_finite() && length > 1e-12).then_some(unit)
}

/// Relative to the matrix's largest entry; exporters round to six digits or so.
const LARGEST_MATRIX_ERROR: f32 = 1e-3;

/// The translation, rotation and scale nearest at hand, and how far their product is from `matrix`, relative to the largest
/// entry of its linear part. A mirroring matrix gets a negative x scale; columns of length zero are a scale of zero.
fn decompose(matrix: &Mat4) -> (Transform, f32) {
    let linear = Mat3::from_mat4(*matrix);
    let largest = linear.to_cols_array().iter().fold(0.0_f32, |largest, x| largest.max(x.abs()));
    if largest == 0.0 {
        let translation = matrix.w_axis.truncate();
        return (Transform { translation, scale: Vec3::ZERO, ..Transform::IDENTITY }, 0.0);
    }
    // Of entries up to 1, squares neither overflow nor vanish.
    let relative = linear * largest.recip();
    let mut scale = Vec3::from_array(relative.to_cols_array_2d().map(|c| Vec3::from(c).length()));
    let axes = rotation_axes(&relative, scale);
    if relative.determinant() < 0.0 {
        scale.x = -scale.x;
    }
    let mirrored_axes = Mat3::from_cols(axes.x_axis * scale.x.signum(), axes.y_axis, axes.z_axis);
    let rotation = Quat::from_mat3(&mirrored_axes).normalize();
    let product = Mat3::from_quat(rotation) * Mat3::from_diagonal(scale);
    let difference = (product - relative).to_cols_array();
    let error = difference.iter().fold(0.0_f32, |error, x| error.max(x.abs()));
    let bottom =
        Vec4::new(matrix.x_axis.w, matrix.y_axis.w, matrix.z_axis.w, matrix.w_axis.w - 1.0);
    let transform =
        Transform { translation: matrix.w_axis.truncate(), rotation, scale: scale * largest };
    (transform, error.max(bottom.abs().max_element()))
}

/// An orthonormal frame (Gram–Schmidt from x to z) along the columns of `linear`, which have the lengths `length`; of the
/// same handedness. Columns without length or direction of their own are made up.
fn rotation_axes(linear: &Mat3, length: Vec3) -> Mat3 {
    let mirror = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
    let column = |i: usize| (linear.col(i) / length[i]).normalize_or_zero();
    let (x, y, z) = (column(0), column(1), column(2));
    let x = x.try_normalize().or_else(|| y.cross(z).try_normalize()).unwrap_or_else(|| {
        let only = if y == Vec3::ZERO { z } else { y };
        only.any_orthonormal_vector()
    });
    let y = (y - x * x.dot(y)).try_normalize();
    let y = y.or_else(|| (z.cross(x) * mirror).try_normalize());
    let y = y.unwrap_or_else(|| x.any_orthonormal_vector());
    Mat3::from_cols(x, y, x.cross(y) * mirror)
}

/// How a message calls node `index` of a hierarchy.
pub(super) fn node_called(hierarchy: &Hierarchy, index: usize) -> String {
    let pointer = format!("/nodes/{}", hierarchy.file_index[index]);
    called("node", &hierarchy.nodes[index].name, &pointer)
}
