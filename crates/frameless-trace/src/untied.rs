//! Clustering of boxes whatever they are.
//!
//! `obvhs` merges two neighbours that are each other's best. Where boxes are alike, or stand in a row at equal distances, every box has two best
//! neighbours and takes the first of them: of a million boxes two are merged, then again two, for minutes. So it is given boxes that are a
//! little larger than they are, each by a part of its own, and the tree is fitted to the true ones afterwards.
//!
//! ```text
//! by = u (2⁻¹² size + 2⁻¹⁹ max |coordinate| + 2⁻⁴⁰)        u: of the box's number, in [0, 1); the largest coordinate of all is made 1
//! ```
//!
//! A merge is then decided otherwise only where it hardly matters. The second part is that which is not lost in rounding where a small box stands far
//! away; the last is for points at the origin.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// How clustering is done, see [`PlocBuilder::build`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ploc {
    pub(crate) search_distance: PlocSearchDistance,
    pub(crate) sort_precision: SortPrecision,
    pub(crate) search_depth_threshold: usize,
}

impl Ploc {
    /// A tree over all boxes, one to a leaf, in the memory of `binary`.
    pub(crate) fn build(self, builder: &mut PlocBuilder, boxes: &[Aabb], binary: &mut Bvh2) {
        let mut indices = std::mem::take(&mut binary.primitive_indices);
        indices.clear();
        indices.extend(0..boxes.len() as u32);
        let untied = untied(boxes);
        builder.build_with_bvh(
            binary,
            self.search_distance,
            &untied,
            indices,
            self.sort_precision,
            self.search_depth_threshold,
        );
        for node in binary.nodes.iter_mut().filter(|node| node.is_leaf()) {
            let index = binary.primitive_indices[node.first_index as usize];
            node.set_aabb(boxes[index as usize]);
        }
        binary.refit_all();
    }
}

const OF_SIZE: f32 = 1.0 / 4096.0;
const OF_PLACE: f32 = 1.0 / 524_288.0;
const AT_LEAST: f32 = 1e-12;

fn untied(boxes: &[Aabb]) -> Vec<Aabb> {
    let farthest = |bounds: &Aabb| bounds.min.abs().max(bounds.max.abs()).max_element();
    let scale = 1.0 / boxes.iter().map(farthest).fold(1e-30, f32::max);
    let apart = |(number, bounds): (u32, &Aabb)| {
        let (min, max) = (scale * bounds.min, scale * bounds.max);
        let size = (max - min).max_element();
        let place = min.abs().max(max.abs()).max_element();
        let by = Vec3A::splat(part(number) * (OF_SIZE * size + OF_PLACE * place + AT_LEAST));
        Aabb::new(min - by, max + by)
    };
    (0..).zip(boxes).map(apart).collect()
}

/// A number in [0, 1) that looks like chance (the finalizer of MurmurHash3).
fn part(number: u32) -> f32 {
    let mut hash = number;
    hash = (hash ^ (hash >> 16)).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ (hash >> 13)).wrapping_mul(0xc2b2_ae35);
    (hash ^ (hash >> 16)) as f32 / (1u64 << 32) as f32
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    /// Merging two at a time takes minutes for so many.
    const COUNT: u32 = 100_000;

    fn assert_quickly_right(what: &str, boxes: &[Aabb]) {
        let begin = Instant::now();
        let mut binary = Bvh2::zeroed(0);
        let ploc = Ploc {
            search_distance: PlocSearchDistance::Minimum,
            sort_precision: SortPrecision::U64,
            search_depth_threshold: 0,
        };
        ploc.build(&mut PlocBuilder::new(), boxes, &mut binary);
        let secs = begin.elapsed().as_secs_f64();
        assert!(secs < 10.0, "{what}: {secs:.1} s");
        let all = boxes.iter().fold(Aabb::INVALID, |sum, bounds| sum.union(bounds));
        assert_eq!(*binary.nodes[0].aabb(), all, "{what}");
        let mut leaves: Vec<u32> = binary.primitive_indices.clone();
        leaves.sort_unstable();
        assert!(leaves.into_iter().eq(0..boxes.len() as u32), "{what}");
        for node in binary.nodes.iter().filter(|node| node.is_leaf()) {
            let index = binary.primitive_indices[node.first_index as usize];
            assert_eq!(*node.aabb(), boxes[index as usize], "{what}");
        }
    }

    #[test]
    fn boxes_that_are_alike_are_clustered_in_time() {
        let unit = Aabb::new(Vec3A::ZERO, Vec3A::ONE);
        let around = |size: f32, place: Vec3A| Aabb::new(place, place + Vec3A::splat(size));
        for (what, bounds) in [
            ("one box", unit),
            ("a point at the origin", around(0.0, Vec3A::ZERO)),
            ("a point elsewhere", around(0.0, Vec3A::new(3.0, 0.1, -7.0))),
            ("something tiny", around(1e-25, Vec3A::ZERO)),
            ("something tiny far away", around(1e-3, Vec3A::splat(-1e14))),
        ] {
            assert_quickly_right(what, &vec![bounds; COUNT as usize]);
        }
        let mut beside = vec![around(1e-25, Vec3A::ZERO); COUNT as usize];
        beside.push(around(1e14, Vec3A::ZERO));
        assert_quickly_right("something tiny beside something large", &beside);
    }

    #[test]
    fn rows_are_clustered_in_time() {
        for (size, step) in [(1.0, 1.0), (0.5, 1.0), (0.0, 1.0), (1.0, 0.0625), (1e-6, 1e-3)] {
            let at = |number: u32| Vec3A::new(number as f32 * step, 2.0, 3.0);
            let boxes = (0..COUNT).map(|n| Aabb::new(at(n), at(n) + Vec3A::splat(size)));
            assert_quickly_right("a row", &boxes.collect::<Vec<_>>());
        }
    }
}
