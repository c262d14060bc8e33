//! Surfaces that lie on top of each other, so that every ray asks thousands of triangles: nobody can help that, but it can be said.
//!
//! ```text
//! E = Σ_leaf A(leaf) / A(all)        A: half the surface of a box; E: leaves that a ray meets on average, of those through the box of all that
//!                                    nothing stops (the surface area heuristic)
//! ```

use frameless_scene::Geometry;
use glam::{Affine3A, Vec3A};

use crate::build::Blas;
use crate::wide::{Bounds, NOTHING, Node, half_area, union};
use crate::world::World;

/// Leaves per ray from which on pictures take long: 5 µs for each ray. Rooms have 2 to 20, bushes and crowds of bodies 100.
const MANY: f32 = 1000.0;

/// Says it once, of how things stand at time 0.
pub(crate) fn warn_of_crowds(world: &World) {
    let leaves = leaves_per_ray(world);
    if leaves > MANY {
        log::warn!(
            "{}: surfaces lie on top of each other, or nearly so: a ray has about {:.0} triangles to ask, and pictures take long",
            world.scene().name,
            2.0 * leaves
        );
    }
}

/// E of everything.
fn leaves_per_ray(world: &World) -> f32 {
    let (scene, state) = (world.scene(), world.scene().state_at(0.0));
    let tree_of = |instance: usize| {
        let geometry = scene.instances[instance].geometry as usize;
        match (scene.deformation_of(instance), &scene.geometries[geometry]) {
            (Some(number), _) => Some(&world.deforming[number].tree.blas),
            (None, Geometry::Mesh(_)) => world.blas[geometry].get(),
            (None, Geometry::Sphere { .. }) => None,
        }
    };
    let mut known: Vec<Option<f32>> = vec![None; scene.geometries.len()];
    let mut all: Vec<(Bounds, f32)> = Vec::new();
    if let Some(standing) = &world.standing {
        all.extend(standing.tree().bounds.map(|bounds| (bounds.into(), in_tree(standing.tree()))));
    }
    for (instance, placed) in scene.instances.iter().enumerate() {
        let stands = world.standing.as_ref().is_some_and(|standing| standing.has(instance));
        let Some(tree) = tree_of(instance).filter(|_| !stands) else { continue };
        let Some(bounds) = tree.bounds else { continue };
        // Poses of one shape are alike enough.
        let leaves = known[placed.geometry as usize].get_or_insert_with(|| in_tree(tree));
        let place = scene.world_from_instance(instance, &state);
        all.push((around(bounds.into(), &place), *leaves));
    }
    let whole = all.iter().fold(NOTHING, |sum, (bounds, _)| union(sum, *bounds));
    let part = |(bounds, leaves): &(Bounds, f32)| half_area(*bounds) * leaves;
    let leaves = all.iter().map(part).sum::<f32>() / half_area(whole);
    // What is a point, or infinitely large, is met by few.
    if leaves.is_finite() { leaves } else { 0.0 }
}

/// E of one tree; 1 of what has no extent.
fn in_tree(tree: &Blas) -> f32 {
    let Some(bounds) = tree.bounds else { return 0.0 };
    let leaves = tree.nodes.iter().flat_map(|node| {
        let is_leaf =
            |slot: &usize| node.child[*slot] != Node::UNUSED && node.child[*slot].is_leaf();
        (0..8).filter(is_leaf).map(|slot| {
            let corner = |side: usize| [0, 1, 2].map(|axis| node.plane(2 * axis + side, slot));
            half_area([corner(0), corner(1)].map(Vec3A::from_array))
        })
    });
    let ratio = leaves.sum::<f32>() / half_area(bounds.into());
    if ratio.is_finite() { ratio } else { 1.0 }
}

/// The box around a box that has been moved.
fn around([low, high]: Bounds, place: &Affine3A) -> Bounds {
    let corner = |k: usize| {
        let side = |axis: usize| if k >> axis & 1 == 0 { low[axis] } else { high[axis] };
        place.transform_point3a(Vec3A::from_array([0, 1, 2].map(side)))
    };
    (0..8).map(corner).fold(NOTHING, |sum, corner| union(sum, [corner, corner]))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use frameless_scene::{Mesh, Transform, TriangleMaterials, builtin};
    use glam::Vec3;

    use super::*;
    use crate::test_scenes as scenes;

    fn of_copies(triangles: usize, instances: usize) -> f32 {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]; triangles],
            triangle_materials: TriangleMaterials::all(0, triangles),
            ..Mesh::default()
        };
        let mut scene = scenes::empty();
        for k in 0..instances {
            let place = Transform { translation: k as f32 * 1e-6 * Vec3::Z, ..Transform::IDENTITY };
            scenes::add(&mut scene, Geometry::Mesh(mesh.clone()), place);
        }
        leaves_per_ray(&World::new(Arc::new(scene)))
    }

    /// Four of them in nearly each leaf.
    #[test]
    fn copies_are_counted() {
        for (triangles, instances) in [(4, 1), (4_000, 1), (4, 1_000), (400, 10)] {
            let leaves = (triangles * instances) as f32 / 4.0;
            let found = of_copies(triangles, instances);
            assert!((0.95..1.25).contains(&(found / leaves)), "{triangles} × {instances}: {found}");
        }
    }

    #[test]
    fn rooms_are_no_crowds() {
        for name in ["many", "shadow"] {
            let world = World::new(Arc::new(builtin(name).expect("it is built in")));
            let leaves = leaves_per_ray(&world);
            assert!(leaves < 30.0, "{name}: {leaves}");
        }
    }
}
