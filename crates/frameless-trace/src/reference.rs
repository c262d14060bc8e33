//! The tracer against slow, plain intersectors, on ordinary and on nasty input.

use std::sync::Arc;

use frameless::Rng;
use frameless_scene::{Geometry, Mesh, Scene, Transform};
use glam::{Affine3A, DVec3, Vec3, Vec3A};

use crate::World;
use crate::build::{corners, corners_at};
use crate::kernel::{Isa, Kernel, Portable, ShearRay};
use crate::leaf::{self, LONGEST, Leaf};
use crate::packet::{Packet, TOGETHER};
use crate::ray::{Hit, Ray};
use crate::test_scenes as scenes;
use crate::top::Targets;
use crate::traverse::Stack;

pub(crate) fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin: origin.into(), direction: direction.into() }
}

fn one_mesh(mesh: Mesh) -> World {
    let mut scene = scenes::empty();
    scenes::add(&mut scene, Geometry::Mesh(mesh), Transform::IDENTITY);
    World::new(Arc::new(scene))
}

pub(crate) fn as_mesh(geometry: Geometry) -> Mesh {
    let Geometry::Mesh(mesh) = geometry else { panic!("a mesh was asked for") };
    mesh
}

fn closest(world: &World, rays: &[Ray]) -> Vec<Option<Hit>> {
    let moment = world.moment(0.0);
    let mut stack = Stack::new();
    rays.iter().map(|ray| moment.targets(world).closest(ray, &mut stack)).collect()
}

/// Every triangle, one after the other, with the portable test.
pub(crate) fn every_triangle(mesh: &Mesh, ray: &Ray) -> Vec<(u32, f32)> {
    let shear = ShearRay::new(ray);
    let hits = (0..mesh.triangles.len() as u32).filter_map(|primitive| {
        let mut words = Vec::new();
        let triangle = (primitive, corners_at(&Affine3A::IDENTITY, mesh, primitive));
        leaf::write(&mut words, &[triangle]);
        words.resize(LONGEST, 0);
        let lanes = Portable::triangles(Leaf::at(&words, 0), &shear, f32::MAX);
        (lanes.mask != 0).then_some((primitive, lanes.t[0]))
    });
    hits.collect()
}

/// Möller & Trumbore 1997 in double precision; and how far inside the hit is, as the smallest barycentric weight.
fn in_double(mesh: &Mesh, primitive: u32, ray: &Ray) -> Option<(f64, f64)> {
    let [a, b, c] = corners(mesh, primitive).map(|v| v.as_dvec3());
    let (o, d): (DVec3, DVec3) =
        (Vec3::from(ray.origin).as_dvec3(), Vec3::from(ray.direction).as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let determinant = e1.dot(p);
    let from_a = o - a;
    let q = from_a.cross(e1);
    let (u, v, t) = (from_a.dot(p) / determinant, d.dot(q) / determinant, e2.dot(q) / determinant);
    let inside = u.min(v).min(1.0 - u - v);
    (inside >= 0.0 && t > 0.0).then_some((t, inside))
}

pub(crate) fn random_soup(rng: &mut Rng, count: u32, size: f32) -> Mesh {
    let mut positions = Vec::new();
    for _ in 0..count {
        let centre = 3.0 * rng.unit_f32() * scenes::unit(rng);
        positions.extend((0..3).map(|_| centre + size * scenes::unit(rng)));
    }
    let triangles = (0..count).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    as_mesh(scenes::mesh(positions, triangles, 0))
}

pub(crate) fn random_rays(rng: &mut Rng, count: usize) -> Vec<Ray> {
    let random = |rng: &mut Rng| {
        let origin = 6.0 * rng.unit_f32() * scenes::unit(rng);
        let target = 3.0 * rng.unit_f32() * scenes::unit(rng);
        ray(origin, (0.1 + 3.0 * rng.unit_f32()) * (target - origin))
    };
    (0..count).map(|_| random(rng)).collect()
}

/// The tree must find exactly what testing every triangle finds.
fn assert_same_as_every_triangle(mesh: Mesh, rays: &[Ray]) -> usize {
    let world = one_mesh(mesh.clone());
    let moment = world.moment(0.0);
    let mut stack = Stack::new();
    let mut hits = 0;
    for ray in rays {
        let all = every_triangle(&mesh, ray);
        let nearest = all.iter().map(|hit| hit.1).reduce(f32::min);
        let found = moment.targets(&world).closest(ray, &mut stack);
        assert_eq!(found.map(|hit| hit.t), nearest, "{ray:?}: {found:?} of {all:?}");
        if let Some(hit) = found {
            assert!(all.contains(&(hit.primitive, hit.t)), "{ray:?}: {hit:?} of {all:?}");
            hits += 1;
        }
        let occluded = moment.targets(&world).occluded(ray, f32::INFINITY, &mut stack);
        assert_eq!(occluded, found.is_some(), "{ray:?}");
    }
    hits
}

#[test]
fn random_triangles_as_in_double_precision() {
    let mut rng = Rng::new(1);
    let mesh = random_soup(&mut rng, 300, 0.4);
    let rays = random_rays(&mut rng, 5_000);
    let mut hits = 0;
    for (ray, found) in rays.iter().zip(closest(&one_mesh(mesh.clone()), &rays)) {
        let exact = (0..300)
            .filter_map(|primitive| {
                in_double(&mesh, primitive, ray).map(|(t, inside)| (t, inside, primitive))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        // Rays within rounding of an edge may go either way.
        if exact.is_some_and(|(_, inside, _)| inside < 1e-4) {
            continue;
        }
        let Some((t, _, primitive)) = exact else {
            assert!(
                found.is_none_or(|hit| in_double(&mesh, hit.primitive, ray).is_none()),
                "{ray:?}"
            );
            continue;
        };
        let hit = found.unwrap_or_else(|| panic!("{ray:?} misses {primitive} at {t}"));
        assert_eq!(hit.primitive, primitive, "{ray:?}: {hit:?} instead of t {t}");
        assert!(
            (f64::from(hit.t) - t).abs() < 1e-4 * (1.0 + t),
            "{ray:?}: {hit:?} instead of t {t}"
        );
        hits += 1;
    }
    assert!(hits > 1_000, "only {hits} rays hit anything");
}

#[test]
fn trees_of_all_sizes_find_what_every_triangle_finds() {
    let mut rng = Rng::new(2);
    for count in [0, 1, 2, 4, 5, 8, 9, 33, 1_000] {
        let mesh = random_soup(&mut rng, count, 0.5);
        let hits = assert_same_as_every_triangle(mesh, &random_rays(&mut rng, 2_000));
        assert!(hits > 0 || count < 33, "{count} triangles, no hit");
    }
}

#[test]
fn axis_parallel_rays_on_a_grid_of_shared_edges() {
    // Every ray runs in the plane of box sides, along edges, or through vertices.
    let side = 8;
    let positions = (0..=side * side + 2 * side)
        .map(|k| Vec3::new((k % (side + 1)) as f32, (k / (side + 1)) as f32, ((k * 7) % 3) as f32));
    let mut triangles = Vec::new();
    for (x, y) in (0..side * side).map(|k| (k % side, k / side)) {
        let corner = y * (side + 1) + x;
        triangles.push([corner, corner + 1, corner + side + 1]);
        triangles.push([corner + 1, corner + side + 2, corner + side + 1]);
    }
    let mesh = as_mesh(scenes::mesh(positions.collect(), triangles, 0));
    let mut rays = Vec::new();
    for k in 0..=4 * side {
        for j in 0..=4 * side {
            let [a, b] = [k as f32 * 0.25, j as f32 * 0.25];
            rays.push(ray(Vec3::new(a, b, 9.0), Vec3::NEG_Z));
            rays.push(ray(Vec3::new(a, b, -9.0), Vec3::Z * 1e-3));
            rays.push(ray(Vec3::new(-9.0, a, b), Vec3::X));
            rays.push(ray(Vec3::new(a, 99.0, b), Vec3::NEG_Y));
            rays.push(ray(Vec3::new(a, b, 9.0), Vec3::new(-0.0, 1e-30, -1.0)));
        }
    }
    let hits = assert_same_as_every_triangle(mesh, &rays);
    // All three families along z meet the surface, and it has no holes.
    assert!(hits >= 3 * 33 * 33, "{hits}");
}

#[test]
fn degenerate_and_coincident_triangles() {
    let mut rng = Rng::new(3);
    let mut mesh = random_soup(&mut rng, 40, 0.5);
    let n = mesh.positions.len() as u32;
    mesh.positions.extend([
        Vec3::ZERO,
        Vec3::X,
        Vec3::X * 2.0,
        Vec3::splat(f32::NAN),
        Vec3::splat(3e38),
    ]);
    mesh.triangles.extend([[n, n, n], [n, n + 1, n + 2], [n, n + 1, n + 1]]);
    for _ in 0..100 {
        mesh.triangles.push([0, 1, 2]);
    }
    let sane = mesh.clone();
    mesh.triangles.extend([[n, n + 1, n + 3], [n + 3, n + 3, n + 3], [n, n + 1, n + 4]]);
    for mesh in [&mut mesh, &mut sane.clone()] {
        mesh.triangle_materials.resize(mesh.triangles.len(), 0);
    }
    let rays = random_rays(&mut rng, 2_000);
    assert_same_as_every_triangle(sane.clone(), &rays);
    let found = closest(&one_mesh(mesh), &rays);
    assert_eq!(
        found.iter().flatten().count(),
        closest(&one_mesh(sane), &rays).iter().flatten().count()
    );
}

#[test]
fn a_tree_too_deep_for_the_stack_is_balanced() {
    // Each triangle is nearer the origin and smaller than the one before, see the tests of `build`.
    let mut positions = Vec::new();
    for k in 0..400 {
        let size = 0.8f32.powi(k);
        positions.extend([Vec3::X, Vec3::Y, Vec3::Z].map(|axis| size * (Vec3::ONE + 0.1 * axis)));
    }
    let triangles = (0..400).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let mesh = as_mesh(scenes::mesh(positions, triangles, 0));
    let rays = random_rays(&mut Rng::new(4), 1_000);
    assert_same_as_every_triangle(mesh, &rays);
}

#[test]
fn rays_that_are_no_rays_hit_nothing() {
    let world = one_mesh(as_mesh(scenes::triangle_sphere(8, 8, 0)));
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let mut rays = vec![ray(Vec3::ZERO, Vec3::ZERO), ray(Vec3::ZERO, Vec3::splat(1e-40))];
    for bad in bad {
        rays.push(ray(Vec3::new(bad, 0.0, 0.0), Vec3::X));
        rays.push(ray(Vec3::ZERO, Vec3::new(0.0, bad, 1.0)));
    }
    assert!(closest(&world, &rays).iter().all(Option::is_none));
}

#[test]
fn a_closed_mesh_has_no_holes_at_shared_edges() {
    let mesh = as_mesh(scenes::triangle_sphere(40, 60, 0));
    let world = one_mesh(mesh.clone());
    let mut rng = Rng::new(5);
    let mut rays = Vec::new();
    for _ in 0..1_000_000 {
        // From inside, at a point of an edge, or exactly at a vertex.
        let triangle = mesh.triangles[rng.below(mesh.triangles.len() as u32) as usize];
        let [a, b] = [0, 1].map(|k| mesh.positions[triangle[k] as usize]);
        let target = if rng.below(4) == 0 { a } else { a.lerp(b, rng.unit_f32()) };
        let origin = 0.7 * rng.unit_f32() * scenes::unit(&mut rng);
        rays.push(ray(origin, target - origin));
    }
    let misses = closest(&world, &rays).iter().filter(|hit| hit.is_none()).count();
    assert_eq!(misses, 0, "of {}", rays.len());
    let (moment, mut found) = (world.moment(0.0), vec![None; rays.len()]);
    moment.targets(&world).closest_of(&rays, &mut found, &mut Stack::new());
    assert!(found.iter().all(Option::is_some), "rays by turns find holes");
}

#[test]
fn of_coinciding_surfaces_the_first_is_found() {
    // Twice the same triangles in each of two meshes, of which one is shared by two instances at the same place.
    let mut rng = Rng::new(12);
    let mut mesh = random_soup(&mut rng, 50, 0.5);
    mesh.triangles.extend(mesh.triangles.clone());
    mesh.triangle_materials.resize(mesh.triangles.len(), 0);
    let mut scene = scenes::empty();
    scenes::add(&mut scene, Geometry::Mesh(mesh.clone()), Transform::IDENTITY);
    scenes::add(&mut scene, Geometry::Mesh(mesh), Transform::IDENTITY);
    let second = scene.instances[1];
    scene.instances.push(second);
    let found = closest(&World::new(Arc::new(scene)), &random_rays(&mut rng, 3_000));
    let hits: Vec<Hit> = found.into_iter().flatten().collect();
    assert!(hits.len() > 100, "{}", hits.len());
    for hit in hits {
        assert!(hit.instance == 0 && hit.primitive < 50, "{hit:?}");
    }
}

#[test]
fn instances_find_what_transformed_triangles_find() {
    // Mirrored, sheared by a parent, far away: the same triangles, once as instances and once in world coordinates.
    let scene = scenes::mixed();
    let world = World::new(scene.clone());
    let moment = world.moment(0.0);
    let mut rng = Rng::new(6);
    let rays = random_rays(&mut rng, 5_000);
    let mut hits = 0;
    for (ray, found) in rays.iter().zip(closest(&world, &rays)) {
        let exact = nearest_in_world(&scene, moment.state(), ray);
        match (found, exact) {
            (Some(hit), Some((t, instance))) => {
                assert!(
                    (f64::from(hit.t) - t).abs() < 1e-4 * (1.0 + t),
                    "{ray:?}: {hit:?}, not {t} of {instance}"
                );
                hits += 1;
            }
            (None, None) => {}
            (found, exact) => panic!("{ray:?}: {found:?}, exact {exact:?}"),
        }
    }
    assert!(hits > 2_000, "{hits}");
}

fn nearest_in_world(
    scene: &Scene,
    state: &frameless_scene::State,
    ray: &Ray,
) -> Option<(f64, usize)> {
    let mut nearest: Option<(f64, usize)> = None;
    for (index, instance) in scene.instances.iter().enumerate() {
        let world_from_object = state.world_from_node[instance.node as usize];
        let hits: Vec<f64> = match &scene.geometries[instance.geometry as usize] {
            Geometry::Mesh(mesh) => {
                let mut mesh = mesh.clone();
                for position in &mut mesh.positions {
                    *position = world_from_object.transform_point3(*position);
                }
                let all = 0..mesh.triangles.len() as u32;
                all.filter_map(|p| in_double(&mesh, p, ray)).map(|hit| hit.0).collect()
            }
            Geometry::Sphere { .. } => {
                let object_from_world = world_from_object.inverse();
                let o = Vec3::from(object_from_world.transform_point3a(ray.origin)).as_dvec3();
                let d = Vec3::from(object_from_world.transform_vector3a(ray.direction)).as_dvec3();
                let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - 1.0);
                let root = (b * b - a * c).sqrt();
                [(-b - root) / a, (-b + root) / a].into_iter().filter(|&t| t > 0.0).collect()
            }
        };
        for t in hits {
            if nearest.is_none_or(|(best, _)| t < best) {
                nearest = Some((t, index));
            }
        }
    }
    nearest
}

#[test]
fn portable_and_fastest_code_agree_bit_for_bit() {
    let mut scene = Scene::clone(&scenes::mixed());
    let soup = random_soup(&mut Rng::new(8), 2_000, 0.3);
    scenes::add(&mut scene, Geometry::Mesh(soup), Transform::IDENTITY);
    let scene = Arc::new(scene);
    let (fast, portable) = (World::new(scene.clone()), World::with_isa(scene, Isa::Portable));
    if fast.isa == Isa::Portable {
        eprintln!("SKIPPED: this processor has no AVX2, nothing to compare");
        return;
    }
    let rays = random_rays(&mut Rng::new(9), 20_000);
    assert_eq!(closest(&fast, &rays), closest(&portable, &rays));
    let (a, b) = (fast.moment(0.0), portable.moment(0.0));
    let mut stack = Stack::new();
    for ray in &rays {
        let fast = a.targets(&fast).occluded(ray, 1.0, &mut stack);
        assert_eq!(fast, b.targets(&portable).occluded(ray, 1.0, &mut stack), "{ray:?}");
    }
}

/// Neighbours: around one direction, from one point or to one, from hardly apart to far apart.
fn neighbours(rng: &mut Rng, count: usize) -> Vec<Ray> {
    let origin = 5.0 * rng.unit_f32() * scenes::unit(rng);
    let target = 2.0 * rng.unit_f32() * scenes::unit(rng);
    let spread = 0.1 * rng.unit_f32() * rng.unit_f32() * (target - origin).length();
    let [from, to] = [[0.0, spread], [spread, 0.0], [spread, spread]][rng.below(3) as usize];
    let off = |rng: &mut Rng, by: f32| by * scenes::unit(rng);
    let near = |rng: &mut Rng| {
        let origin = origin + off(rng, from);
        ray(origin, target + off(rng, to) - origin)
    };
    (0..count).map(|_| near(rng)).collect()
}

#[test]
fn rays_walked_together_find_what_each_finds_alone() {
    let mut scene = Scene::clone(&scenes::mixed());
    let soup = random_soup(&mut Rng::new(8), 2_000, 0.3);
    // Twice, so that surfaces coincide.
    scenes::add(&mut scene, Geometry::Mesh(soup.clone()), Transform::IDENTITY);
    scenes::add(&mut scene, Geometry::Mesh(soup), Transform::IDENTITY);
    // Its edges are met exactly.
    scenes::add(&mut scene, scenes::triangle_sphere(8, 12, 0), Transform::IDENTITY);
    let scene = Arc::new(scene);
    for isa in Isa::all() {
        let world = World::with_isa(scene.clone(), isa);
        let moment = world.moment(0.0);
        let (targets, mut stack) = (moment.targets(&world), Stack::new());
        let mut rng = Rng::new(13);
        let (mut hits, mut together, mut blocked, mut passed) = (0, 0, 0, 0);
        for _ in 0..400 {
            // Some groups are not full.
            let count = 1 + rng.below(70) as usize;
            let rays = neighbours(&mut rng, count);
            // Whatever has been learned of others.
            stack.worth = Default::default();
            let mut found = vec![None; count];
            targets.closest_of(&rays, &mut found, &mut stack);
            let alone: Vec<_> = rays.iter().map(|ray| targets.closest(ray, &mut stack)).collect();
            assert_eq!(found, alone);
            hits += found.iter().flatten().count();
            for rays in rays.chunks(TOGETHER) {
                together += usize::from(Packet::new::<Portable>(rays, f32::MAX).is_some());
                let t_max = [1.0, 0.6, f32::INFINITY][rng.below(3) as usize];
                let known = targets.occluded_of((rays, t_max), |_| false, &mut stack);
                let rest = Targets { standing: None, ..targets };
                for (index, ray) in rays.iter().enumerate() {
                    let is_occluded = targets.occluded(ray, t_max, &mut stack);
                    if known.blocked >> index & 1 != 0 {
                        assert!(is_occluded, "{ray:?}");
                        blocked += 1;
                    } else if known.passed >> index & 1 != 0 {
                        let by_rest = rest.occluded(ray, t_max, &mut stack);
                        assert_eq!(is_occluded, by_rest, "{ray:?}");
                        assert!(known.is_all >> index & 1 == 0 || !is_occluded, "{ray:?}");
                        passed += 1;
                    }
                }
            }
        }
        let enough = hits > 2_000 && together > 100 && blocked > 500 && passed > 500;
        assert!(enough, "{hits} hits, {together} groups, {blocked} blocked, {passed} passed");
    }
}

#[test]
fn hundreds_of_instances_are_all_found() {
    let mut scene = scenes::empty();
    let mut rng = Rng::new(10);
    let mut centres = Vec::new();
    for k in 0..500 {
        let centre = 40.0 * scenes::unit(&mut rng) * rng.unit_f32();
        let geometry = if k % 2 == 0 {
            Geometry::Sphere { material: 0 }
        } else {
            scenes::triangle_sphere(6, 8, 0)
        };
        let rest =
            Transform { translation: centre, scale: Vec3::splat(0.2), ..Transform::IDENTITY };
        scenes::add(&mut scene, geometry, rest);
        centres.push(centre);
    }
    let world = World::new(Arc::new(scene));
    let moment = world.moment(0.0);
    let mut stack = Stack::new();
    for (instance, &centre) in centres.iter().enumerate() {
        // From inside each: nothing else is as near.
        let hit = moment.targets(&world).closest(&ray(centre, scenes::unit(&mut rng)), &mut stack);
        let hit = hit.unwrap_or_else(|| panic!("instance {instance} was not found"));
        assert!(hit.t < 0.21, "{hit:?}");
        assert!(
            moment.placed(hit.instance).world_from_object.translation.distance(Vec3A::from(centre))
                < 0.41
        );
    }
}
