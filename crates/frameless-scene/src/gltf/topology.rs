//! From the order of vertices to triangles (glTF 2.0 §3.7.2.1).

use super::error::Fault;
use super::json::Json;

/// How vertices make triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Topology {
    /// Three vertices each: { v₃ᵢ, v₃ᵢ₊₁, v₃ᵢ₊₂ }.
    Triangles,
    /// Every vertex with the two before it: { vᵢ, vᵢ₊₍₁₊ᵢ%₂₎, vᵢ₊₍₂₋ᵢ%₂₎ }.
    Strip,
    /// Every two neighbours with the first: { vᵢ₊₁, vᵢ₊₂, v₀ }.
    Fan,
}

impl Topology {
    /// The primitive's mode; `None` for points and lines.
    pub(super) fn parse(primitive: &Json<'_>) -> Result<Option<Topology>, Fault> {
        let Some(mode) = primitive.field("mode")? else { return Ok(Some(Topology::Triangles)) };
        match mode.unsigned()? {
            0..=3 => Ok(None),
            4 => Ok(Some(Topology::Triangles)),
            5 => Ok(Some(Topology::Strip)),
            6 => Ok(Some(Topology::Fan)),
            _ => Err(mode.fault("a mode from 0 to 6")),
        }
    }

    /// How many triangles `vertices` vertices make; vertices left over make none.
    pub(super) fn triangle_count(self, vertices: usize) -> usize {
        match self {
            Topology::Triangles => vertices / 3,
            Topology::Strip | Topology::Fan => vertices.saturating_sub(2),
        }
    }

    /// The positions in the vertex order of triangle `i`'s corners, counter-clockwise.
    pub(super) fn corners(self, i: usize) -> [usize; 3] {
        match self {
            Topology::Triangles => [3 * i, 3 * i + 1, 3 * i + 2],
            Topology::Strip => [i, i + 1 + i % 2, i + 2 - i % 2],
            Topology::Fan => [i + 1, i + 2, 0],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangles(topology: Topology, vertices: usize) -> Vec<[usize; 3]> {
        (0..topology.triangle_count(vertices)).map(|i| topology.corners(i)).collect()
    }

    #[test]
    fn strips_turn_every_second_triangle() {
        assert_eq!(triangles(Topology::Strip, 5), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    }

    #[test]
    fn fans_keep_the_first_vertex() {
        assert_eq!(triangles(Topology::Fan, 5), [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
    }

    #[test]
    fn too_few_vertices_make_no_triangle() {
        for topology in [Topology::Triangles, Topology::Strip, Topology::Fan] {
            for vertices in 0..3 {
                assert_eq!(topology.triangle_count(vertices), 0, "{topology:?} of {vertices}");
            }
        }
        assert_eq!(triangles(Topology::Triangles, 5), [[0, 1, 2]]);
    }
}
