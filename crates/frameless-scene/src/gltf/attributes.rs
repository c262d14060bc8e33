//! What a primitive's vertices carry: read from accessors, with every number made finite.

use std::collections::BTreeMap;

use glam::{Vec2, Vec3, Vec4};

use crate::{Influences, UV_SETS};

use super::accessor::Accessor;
use super::error::{Fault, quoted};
use super::json::Json;
use super::limits::Budget;
use super::warnings::Warnings;

/// Beyond this a position counts as infinite: squares of distances up to it are finite in 32 bits.
const LARGEST_COORDINATE: f32 = 1e18;

/// Accessors of the attributes that are read. Primitives with equal ones share their vertices.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Attributes {
    pub(super) position: Option<usize>,
    pub(super) normal: Option<usize>,
    pub(super) uvs: [Option<usize>; UV_SETS],
    pub(super) tangent: Option<usize>,
    pub(super) color: Option<usize>,
    /// JOINTS_n and WEIGHTS_n, in the order of n.
    pub(super) influences: Vec<[usize; 2]>,
    /// What the primitive's morph targets displace.
    pub(super) targets: Vec<TargetAttributes>,
}

/// Accessors of a morph target.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct TargetAttributes {
    position: Option<usize>,
    normal: Option<usize>,
    color: Option<usize>,
}

impl Attributes {
    pub(super) fn parse(
        primitive: &Json<'_>,
        accessors: &[Accessor<'_>],
        warnings: &mut Warnings,
    ) -> Result<Attributes, Fault> {
        let mut attributes = Attributes::default();
        let mut list = primitive.required("attributes")?.members()?;
        let mut influences = BTreeMap::new();
        for (semantic, json) in &list {
            let accessor = json.index(accessors.len(), "accessors")?;
            check_kind(semantic, &accessors[accessor], json)?;
            match *semantic {
                "POSITION" => attributes.position = Some(accessor),
                "NORMAL" => attributes.normal = Some(accessor),
                "TANGENT" => attributes.tangent = Some(accessor),
                "TEXCOORD_0" => attributes.uvs[0] = Some(accessor),
                "TEXCOORD_1" => attributes.uvs[1] = Some(accessor),
                "TEXCOORD_2" => attributes.uvs[2] = Some(accessor),
                "TEXCOORD_3" => attributes.uvs[3] = Some(accessor),
                "COLOR_0" => attributes.color = Some(accessor),
                other if is_silently_ignored(other) => {}
                other => match influence(other) {
                    Some((number, part)) => {
                        influences.entry(number).or_insert([None; 2])[part] = Some(accessor);
                    }
                    None => warnings.about("vertex attributes ignored", quoted(other)),
                },
            }
        }
        for set in influences.into_values() {
            match set {
                [Some(joints), Some(weights)] => attributes.influences.push([joints, weights]),
                _ => warnings.add("joints without weights, or weights without joints, are ignored"),
            }
        }
        for target in primitive.list("targets")? {
            let members = target.members()?;
            attributes.targets.push(TargetAttributes::parse(&members, accessors, warnings)?);
            list.extend(members);
        }
        if let Some(position) = attributes.position {
            refuse_other_counts(&list, accessors, accessors[position].count)?;
        }
        Ok(attributes)
    }
}

impl TargetAttributes {
    fn parse(
        members: &[(&str, Json<'_>)],
        accessors: &[Accessor<'_>],
        warnings: &mut Warnings,
    ) -> Result<TargetAttributes, Fault> {
        let mut target = TargetAttributes::default();
        for (semantic, json) in members {
            let accessor = json.index(accessors.len(), "accessors")?;
            match *semantic {
                // Tangents are not displaced, and have three components here.
                "POSITION" | "NORMAL" | "COLOR_0" => {
                    check_kind(semantic, &accessors[accessor], json)?;
                }
                _ => {}
            }
            match *semantic {
                "POSITION" => target.position = Some(accessor),
                "NORMAL" => target.normal = Some(accessor),
                "COLOR_0" => target.color = Some(accessor),
                other if is_silently_ignored(other) => {}
                other => warnings.about("morphed vertex attributes ignored", quoted(other)),
            }
        }
        Ok(target)
    }
}

/// Refuses elements that an attribute which is read cannot have (glTF 2.0 §3.7.2.1).
fn check_kind(semantic: &str, accessor: &Accessor<'_>, json: &Json<'_>) -> Result<(), Fault> {
    match semantic {
        "POSITION" | "NORMAL" => accessor.check_kind(&["VEC3"], json),
        "TANGENT" => accessor.check_kind(&["VEC4"], json),
        "TEXCOORD_0" | "TEXCOORD_1" | "TEXCOORD_2" | "TEXCOORD_3" => {
            accessor.check_kind(&["VEC2"], json)
        }
        "COLOR_0" => accessor.check_kind(&["VEC3", "VEC4"], json),
        _ => match influence(semantic) {
            Some((_, 0)) => accessor.check_joints(json),
            Some(_) => accessor.check_kind(&["VEC4"], json),
            None => Ok(()),
        },
    }
}

/// Names that begin with an underscore belong to applications; a morphed tangent follows from what its triangle has become.
fn is_silently_ignored(semantic: &str) -> bool {
    semantic == "TANGENT" || semantic.starts_with('_')
}

/// The n of JOINTS_n (part 0) or WEIGHTS_n (part 1).
fn influence(semantic: &str) -> Option<(u32, usize)> {
    let (part, number) = match semantic.strip_prefix("JOINTS_") {
        Some(number) => (0, number),
        None => (1, semantic.strip_prefix("WEIGHTS_")?),
    };
    Some((number.parse().ok()?, part))
}

fn refuse_other_counts(
    attributes: &[(&str, Json<'_>)],
    accessors: &[Accessor<'_>],
    count: usize,
) -> Result<(), Fault> {
    for (_, json) in attributes {
        let came = accessors[json.index(accessors.len(), "accessors")?].count;
        if came != count {
            let wanted = format!("as many elements as POSITION has: {count}");
            return Err(Fault::at(json.pointer(), wanted, came));
        }
    }
    Ok(())
}

/// Vertices with what they carry; arrays are as long as `positions`.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    /// Finite.
    pub(super) positions: Vec<Vec3>,
    /// As in the file: may be of any length, or NaN.
    pub(super) normals: Option<Vec<Vec3>>,
    pub(super) uvs: [Option<Vec<Vec2>>; UV_SETS],
    /// As in the file: may be of any length, or NaN.
    pub(super) tangents: Option<Vec<Vec4>>,
    pub(super) colors: Option<Vec<Vec4>>,
    /// As in the file: weights may be anything.
    pub(super) influences: Vec<Influences>,
    /// Finite.
    pub(super) targets: Vec<TargetVertices>,
    /// Vertices whose position was infinite or NaN (and is 0 now), ascending.
    pub(super) nowhere: Vec<u32>,
}

/// Displacements; arrays are as long as the vertices.
#[derive(Debug, Default)]
pub(super) struct TargetVertices {
    pub(super) positions: Option<Vec<Vec3>>,
    pub(super) normals: Option<Vec<Vec3>>,
    pub(super) colors: Option<Vec<Vec4>>,
}

impl TargetVertices {
    fn read(
        attributes: &TargetAttributes,
        accessors: &[Accessor<'_>],
        mesh: &Json<'_>,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<TargetVertices, Fault> {
        let mut vectors_of = |accessor: Option<usize>| -> Result<Option<Vec<Vec3>>, Fault> {
            let Some(accessor) = accessor else { return Ok(None) };
            let mut read = vectors(accessors[accessor].numbers::<3>(budget)?);
            let fine = |v: &Vec3| v.is_finite();
            settle(&mut read, fine, Vec3::ZERO, "displacements", mesh, warnings);
            Ok(Some(read))
        };
        let (positions, normals) =
            (vectors_of(attributes.position)?, vectors_of(attributes.normal)?);
        let mut colors = match attributes.color {
            Some(accessor) => Some(read_colors(&accessors[accessor], 0.0, budget)?),
            None => None,
        };
        if let Some(colors) = &mut colors {
            settle(colors, |c| c.is_finite(), Vec4::ZERO, "displacements", mesh, warnings);
        }
        Ok(TargetVertices { positions, normals, colors })
    }
}

impl Vertices {
    /// Reads what `attributes` names; `mesh` is for warnings.
    pub(super) fn read(
        attributes: &Attributes,
        accessors: &[Accessor<'_>],
        mesh: &Json<'_>,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<Vertices, Fault> {
        let mut vertices = Vertices::default();
        if let Some(accessor) = attributes.position {
            budget.add_vertices(mesh.pointer(), accessors[accessor].count)?;
            vertices.positions = vectors(accessors[accessor].numbers::<3>(budget)?);
            vertices.settle_positions(mesh, warnings);
        }
        if let Some(accessor) = attributes.normal {
            vertices.normals = Some(vectors(accessors[accessor].numbers::<3>(budget)?));
        }
        for (uvs, accessor) in vertices.uvs.iter_mut().zip(attributes.uvs) {
            let Some(accessor) = accessor else { continue };
            let mut read: Vec<Vec2> = vectors(accessors[accessor].numbers::<2>(budget)?);
            settle(
                &mut read,
                |uv| uv.is_finite(),
                Vec2::ZERO,
                "texture coordinates",
                mesh,
                warnings,
            );
            *uvs = Some(read);
        }
        if let Some(accessor) = attributes.tangent {
            vertices.tangents = Some(vectors(accessors[accessor].numbers::<4>(budget)?));
        }
        if let Some(accessor) = attributes.color {
            let mut colors = read_colors(&accessors[accessor], 1.0, budget)?;
            settle(&mut colors, |c| c.is_finite(), Vec4::ONE, "vertex colours", mesh, warnings);
            colors.iter_mut().for_each(|color| *color = color.clamp(Vec4::ZERO, Vec4::ONE));
            vertices.colors = Some(colors);
        }
        for [joints, weights] in &attributes.influences {
            let joints = accessors[*joints].joints(budget)?;
            let weights = accessors[*weights].numbers::<4>(budget)?;
            vertices.influences.push(Influences { joints, weights });
        }
        for target in &attributes.targets {
            let target = TargetVertices::read(target, accessors, mesh, budget, warnings)?;
            vertices.targets.push(target);
        }
        Ok(vertices)
    }

    fn settle_positions(&mut self, mesh: &Json<'_>, warnings: &mut Warnings) {
        for (index, position) in self.positions.iter_mut().enumerate() {
            if position.is_nan() || position.abs().max_element() > LARGEST_COORDINATE {
                *position = Vec3::ZERO;
                self.nowhere.push(index as u32);
            }
        }
        if !self.nowhere.is_empty() {
            let what = "triangles with infinite or NaN positions are not drawn";
            warnings.about(what, mesh.called("mesh"));
        }
    }
}

/// Linear RGB, which gets `alpha`, or RGBA.
fn read_colors(
    accessor: &Accessor<'_>,
    alpha: f32,
    budget: &mut Budget,
) -> Result<Vec<Vec4>, Fault> {
    if accessor.width == 3 {
        let rgb = accessor.numbers::<3>(budget)?;
        return Ok(rgb.into_iter().map(|[r, g, b]| Vec4::new(r, g, b, alpha)).collect());
    }
    Ok(vectors(accessor.numbers::<4>(budget)?))
}

fn vectors<const N: usize, V: From<[f32; N]>>(arrays: Vec<[f32; N]>) -> Vec<V> {
    arrays.into_iter().map(V::from).collect()
}

/// Replaces what is not `fine`, with a warning.
fn settle<T: Copy>(
    values: &mut [T],
    fine: impl Fn(&T) -> bool,
    replacement: T,
    what: &str,
    mesh: &Json<'_>,
    warnings: &mut Warnings,
) {
    let mut replaced = 0;
    for value in values.iter_mut().filter(|value| !fine(value)) {
        *value = replacement;
        replaced += 1;
    }
    if replaced > 0 {
        warnings.about(format!("infinite or NaN {what} were replaced"), mesh.called("mesh"));
    }
}
