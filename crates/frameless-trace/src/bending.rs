//! Meshes that deform, against slow and plain ways of finding the same.

use std::sync::Arc;

use frameless::Rng;
use frameless_scene::{
    AfterEnd, Animation, Channel, Deformation, Geometry, Influences, Interpolation, Mesh, Scene,
    Skin, Target, Transform, Values,
};
use glam::{Affine3A, Quat, Vec3, Vec3A};

use crate::World;
use crate::kernel::Isa;
use crate::leaf::Leaf;
use crate::ray::Hit;
use crate::reference::{as_mesh, every_triangle, random_rays, random_soup, ray};
use crate::refit::Flexible;
use crate::test_scenes as scenes;
use crate::traverse::Stack;
use crate::wide::Node;

/// Seconds until the joint has turned by half a turn; it stays so.
const BENDS_SECS: f32 = 1.0;

/// A closed sphere whose upper part follows a joint at the origin that turns about x, and whose lower part does not.
fn bending_ball() -> Scene {
    let mut scene = scenes::empty();
    let mut mesh = as_mesh(scenes::triangle_sphere(24, 48, 0));
    let upper = |p: &Vec3| (0.5 + 0.8 * p.y).clamp(0.0, 1.0);
    let weights = mesh.positions.iter().map(|p| [upper(p), 1.0 - upper(p), 0.0, 0.0]).collect();
    let joints = vec![[0, 1, 0, 0]; mesh.positions.len()];
    mesh.influences = vec![Influences { joints, weights }];
    scenes::add_material(&mut scene, Vec3::ONE, 0.0, 1.0);
    let instance = scenes::add(&mut scene, Geometry::Mesh(mesh), Transform::IDENTITY);
    let joint = scene.nodes.len() as u32;
    scene.nodes.extend([scenes::node(Transform::IDENTITY), scenes::node(Transform::IDENTITY)]);
    let inverse_bind = vec![Affine3A::IDENTITY; 2];
    scene.skins = vec![Skin { name: String::new(), joints: vec![joint, joint + 1], inverse_bind }];
    scene.deformations = vec![Deformation { instance, skin: Some(0), weights: 0..0 }];
    scene.animation = Animation {
        duration_secs: f64::from(BENDS_SECS),
        after_end: AfterEnd::Hold,
        channels: vec![Channel {
            target: Target::Rotation(joint),
            times: vec![0.0, BENDS_SECS],
            values: Values::Quat(vec![Quat::IDENTITY, Quat::from_rotation_x(3.0)]),
            interpolation: Interpolation::Linear,
        }],
    };
    scene.ambient = Vec3::ONE;
    scene
}

fn mesh(scene: &Scene) -> &Mesh {
    let Geometry::Mesh(mesh) = &scene.geometries[0] else { panic!("the ball is a mesh") };
    mesh
}

/// The ball's mesh as it is at one time, rigid.
fn frozen(scene: &Scene, secs: f64) -> Mesh {
    let mut now = frameless_scene::Deformed::default();
    scene.deform(0, &scene.state_at(secs), &mut now);
    let positions = now.positions().iter().map(|&position| position.into()).collect();
    Mesh { positions, ..mesh(scene).clone() }
}

#[test]
fn a_tree_that_follows_finds_what_every_triangle_finds() {
    let scene = Arc::new(bending_ball());
    let world = World::new(scene.clone());
    let (mut rng, mut stack) = (Rng::new(1), Stack::new());
    let mut moment = world.moment(0.0);
    let mut hits = 0;
    for secs in [0.0, 0.3, 0.9, 0.1, 1.0, 0.55] {
        world.update_moment(secs, &mut moment);
        let mesh = frozen(&scene, secs);
        for ray in random_rays(&mut rng, 1_000) {
            let all = every_triangle(&mesh, &ray);
            let found = moment.targets(&world).closest(&ray, &mut stack);
            let nearest = all.iter().map(|hit| hit.1).reduce(f32::min);
            assert_eq!(found.map(|hit| hit.t), nearest, "{secs} s, {ray:?}: {found:?} of {all:?}");
            let occluded = moment.targets(&world).occluded(&ray, f32::INFINITY, &mut stack);
            assert_eq!(occluded, found.is_some(), "{ray:?}");
            hits += usize::from(found.is_some());
        }
    }
    assert!(hits > 1_500, "{hits}");
}

#[test]
fn refitting_finds_what_building_finds_hit_for_hit() {
    let scene = Arc::new(bending_ball());
    let world = World::new(scene.clone());
    let mut followed = world.moment(0.0);
    let (mut rng, mut stack) = (Rng::new(2), Stack::new());
    for secs in [0.2, 0.4, 0.6, 0.8, 1.0, 0.0] {
        world.update_moment(secs, &mut followed);
        let mut rigid = bending_ball();
        rigid.geometries[0] = Geometry::Mesh(frozen(&scene, secs));
        rigid.deformations.clear();
        let built_world = World::new(Arc::new(rigid));
        let built = built_world.moment(secs);
        for ray in random_rays(&mut rng, 2_000) {
            let a = followed.targets(&world).closest(&ray, &mut stack);
            let b = built.targets(&built_world).closest(&ray, &mut stack);
            assert_eq!(a, b, "{secs} s, {ray:?}");
        }
    }
}

#[test]
fn a_bent_closed_mesh_has_no_holes() {
    let scene = Arc::new(bending_ball());
    let world = World::new(scene.clone());
    let (mut rng, mut stack) = (Rng::new(3), Stack::new());
    for secs in [0.25, 0.5] {
        let (moment, mesh) = (world.moment(secs), frozen(&scene, secs));
        for _ in 0..20_000 {
            let triangle = mesh.triangles[rng.below(mesh.triangles.len() as u32) as usize];
            let [a, b] = [0, 1].map(|k| mesh.positions[triangle[k] as usize]);
            let target = if rng.below(4) == 0 { a } else { a.lerp(b, rng.unit_f32()) };
            // Below the bend, where the ball is as it was.
            let origin = Vec3::new(0.0, -0.8, 0.0) + 0.05 * scenes::unit(&mut rng);
            let ray = ray(origin, target - origin);
            assert!(moment.targets(&world).closest(&ray, &mut stack).is_some(), "{ray:?}");
        }
    }
}

#[test]
fn portable_and_fastest_code_see_the_same_deforming_mesh() {
    let scene = Arc::new(bending_ball());
    let (fast, portable) = (World::new(scene.clone()), World::with_isa(scene, Isa::Portable));
    if fast.isa == Isa::Portable {
        eprintln!("SKIPPED: this processor has no AVX2, nothing to compare");
        return;
    }
    let closest = |world: &World| -> Vec<Option<Hit>> {
        let mut stack = Stack::new();
        let mut moment = world.moment(0.0);
        world.update_moment(0.7, &mut moment);
        let rays = random_rays(&mut Rng::new(4), 10_000);
        rays.iter().map(|ray| moment.targets(world).closest(ray, &mut stack)).collect()
    };
    assert_eq!(closest(&fast), closest(&portable));
}

/// Poses that no transform should give: nothing panics, and what is sane stays.
#[test]
fn vertices_that_are_nowhere_take_only_their_triangles_away() {
    let mut rng = Rng::new(5);
    let mesh = random_soup(&mut rng, 300, 0.5);
    let at_rest: Vec<Vec3A> = mesh.positions.iter().map(|&p| p.into()).collect();
    let mut positions = at_rest.clone();
    let mut tree = Flexible::new(&mesh, &positions);
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 3e38, -1e16];
    for (k, bad) in bad.into_iter().enumerate() {
        positions[30 * k][k % 3] = bad;
    }
    positions[600..603].fill(Vec3A::NAN);
    tree.update(&mesh, &positions);
    let is_sane = |v: &u32| positions[*v as usize].to_array().iter().all(|x| x.abs() < 1e15);
    let sane = |&p: &u32| mesh.triangles[p as usize].iter().all(is_sane);
    let kept: Vec<u32> = (0..300).filter(sane).collect();
    assert_eq!(kept.len(), 300 - 6);
    let drawn: Vec<u32> = {
        let children = tree.blas.nodes.iter().flat_map(|node| node.child);
        let leaves = children
            .filter(|&child| child != Node::UNUSED && child.is_leaf())
            .map(|child| Leaf::at(&tree.blas.leaves, child.place()));
        let is_drawn = |leaf: &Leaf<'_>, lane: usize| {
            (0..3).all(|k| leaf.corner(lane, k).iter().all(|x| x.is_finite()))
        };
        let mut drawn: Vec<u32> = leaves
            .flat_map(|leaf| (0..leaf.triangles()).map(move |lane| (leaf, lane)))
            .filter(|(leaf, lane)| is_drawn(leaf, *lane))
            .map(|(leaf, lane)| leaf.triangle(lane))
            .collect();
        drawn.sort_unstable();
        drawn.dedup();
        drawn
    };
    assert_eq!(drawn, kept);
    let (low, high) = tree.blas.bounds.expect("there are triangles");
    assert!(low.min_element() > -5.0 && high.max_element() < 5.0, "{low} {high}");
    tree.update(&mesh, &at_rest);
    let (low, high) = tree.blas.bounds.expect("there are triangles");
    assert!(low.is_finite() && high.cmpgt(low).all());
    tree.update(&mesh, &vec![Vec3A::NAN; positions.len()]);
    assert!(Flexible::new(&Mesh::default(), &[]).blas.bounds.is_none());
}

/// Once, not at every moment.
#[test]
fn vertices_that_get_lost_are_told_of() {
    let mut scene = bending_ball();
    let joint = scene.skins[0].joints[0];
    scene.animation.channels.push(Channel {
        target: Target::Scale(joint),
        times: vec![0.0, BENDS_SECS],
        values: Values::Vec3(vec![Vec3::ONE, Vec3::splat(1e30)]),
        interpolation: Interpolation::Step,
    });
    let world = World::new(Arc::new(scene));
    let is_said = &world.deforming[0].is_said;
    let mut moment = world.moment(0.5);
    assert!(!is_said.is_completed(), "all is there until the last key");
    world.update_moment(f64::from(BENDS_SECS), &mut moment);
    assert!(is_said.is_completed());
}

#[test]
fn joints_that_overflow_hit_nothing() {
    for scale in [f32::INFINITY, f32::NAN, 1e38, 1e-38, 0.0] {
        let mut scene = bending_ball();
        let joint = scene.skins[0].joints[0] as usize;
        scene.nodes[joint].rest.scale = Vec3::splat(scale);
        let world = World::new(Arc::new(scene));
        let mut moment = world.moment(0.0);
        world.update_moment(0.5, &mut moment);
        let mut stack = Stack::new();
        for ray in random_rays(&mut Rng::new(6), 200) {
            let hit = moment.targets(&world).closest(&ray, &mut stack);
            assert!(hit.is_none_or(|hit| hit.t.is_finite()), "{hit:?}");
        }
        let mut pose = frameless::Pose::default();
        let view = world.scene().view_at(moment.state(), 0);
        world.pose(&moment, &view, scenes::SIZE, &mut pose);
        let deformed = pose.deformed[0].as_ref().expect("it deforms");
        assert!(deformed.positions.iter().flatten().all(|x| x.is_finite()));
    }
}

#[test]
fn a_tree_that_has_become_bad_is_built_anew() {
    let mut rng = Rng::new(7);
    let mesh = random_soup(&mut rng, 1_000, 0.2);
    let at_rest: Vec<Vec3A> = mesh.positions.iter().map(|&p| p.into()).collect();
    let mut tree = Flexible::new(&mesh, &at_rest);
    let built = tree.blas.leaves.as_ptr();
    // A little to the side: the same memory, the same shape.
    let moved: Vec<Vec3A> = at_rest.iter().map(|p| 1.1 * *p + Vec3A::X).collect();
    tree.update(&mesh, &moved);
    assert_eq!(tree.blas.leaves.as_ptr(), built, "memory was allocated");
    // Every triangle to the place of another.
    let mut order: Vec<usize> = (0..1_000).collect();
    for k in (1..1_000).rev() {
        order.swap(k, rng.below(k as u32 + 1) as usize);
    }
    let shuffled: Vec<Vec3A> =
        order.iter().flat_map(|&k| at_rest[3 * k..3 * k + 3].to_vec()).collect();
    let followed = tree.clone().refit(&shuffled);
    let fresh = Flexible::new(&mesh, &shuffled).refit(&shuffled);
    assert!(followed > 2.0 * fresh, "{followed} {fresh}: no reason to build");
    tree.update(&mesh, &shuffled);
    assert_eq!(tree.refit(&shuffled), fresh);
}

/// The upper part of the ball, turned by a right angle: its normals are turned, too.
#[test]
fn smooth_normals_turn_with_the_joint() {
    let mut scene = bending_ball();
    let Geometry::Mesh(mesh) = &mut scene.geometries[0] else { panic!("the ball is a mesh") };
    mesh.normals = mesh.positions.iter().map(|p| p.normalize()).collect();
    let Values::Quat(turns) = &mut scene.animation.channels[0].values else { panic!("turns") };
    turns[1] = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let world = World::new(Arc::new(scene));
    let moment = world.moment(1.0);
    let ray = ray(Vec3::new(0.05, 0.05, 5.0), Vec3::NEG_Z);
    let hit = moment.targets(&world).closest(&ray, &mut Stack::new()).expect("the ball");
    let point = crate::point::Point::new(&world, &moment, &ray, &hit, Default::default());
    // What was at the top, at (0.05, 1, -0.05), looks along +z now.
    assert!(point.normal.abs_diff_eq(Vec3A::new(0.05, 0.05, 1.0).normalize(), 0.02), "{point:?}");
    let [a, b, c] = point.anchor.to_array();
    assert!((a + b + c - 1.0).abs() < 1e-6 && point.anchor.min_element() >= 0.0, "{point:?}");
}

/// However its tree has been made: that depends on what its moment has shown before.
#[test]
fn a_ray_that_enters_what_deforms_takes_its_price() {
    let mut world = World::new(Arc::new(bending_ball()));
    let made = world.deforming[0].price;
    assert!((5..100).contains(&made), "{made}");
    world.deforming[0].price = 1_000;
    let (straight, mut by_steps) = (world.moment(1.0), world.moment(0.0));
    for step in 1..=10 {
        world.update_moment(0.1 * f64::from(step), &mut by_steps);
    }
    let mut entered = 0;
    for ray in random_rays(&mut Rng::new(3), 200) {
        let [straight, by_steps] = [&straight, &by_steps].map(|moment| {
            let mut stack = Stack::new();
            moment.targets(&world).closest(&ray, &mut stack);
            stack.boxes
        });
        assert_eq!(straight, by_steps, "{ray:?}");
        // The root of the tree over all instances, and one leaf.
        assert!([1, 2 + 1_000].contains(&straight), "{straight}");
        entered += u32::from(straight > 1_000);
    }
    assert!(entered > 50, "{entered}");
}

#[test]
fn a_crowd_has_its_triangles_once() {
    let mut scene = bending_ball();
    let (first, deformation) = (scene.instances[0], scene.deformations[0].clone());
    scene.instances.push(first);
    scene.deformations.push(Deformation { instance: 1, ..deformation });
    let world = World::new(Arc::new(scene));
    let [one, other] = [0, 1].map(|index| world.deforming[index].vertices().triangles);
    assert!(Arc::ptr_eq(&one, &other));
}
