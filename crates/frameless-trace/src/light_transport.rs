//! Tests of the integrator `path` against what is known in closed form, and against `direct`.

use std::f32::consts::PI;
use std::sync::Arc;

use frameless::{Request, Size};
use frameless_scene::{
    Geometry, Material, Mesh, Projection, Scene, Transform, TriangleMaterials, View, look_at,
};
use glam::{Quat, Vec3};

use crate::integrator::{Integrator, Settings};
use crate::test_scenes as scenes;
use crate::{Still, ViewSource, World, render, render_still, thread_pool};

const PATH: Settings =
    Settings { integrator: Integrator::Path, max_depth: 300, lens: None, surfaces: true };

fn matte(scene: &mut Scene, base: Vec3, emissive: Vec3) -> u32 {
    let base_color = base.extend(1.0);
    scene.materials.push(Material { base_color, emissive, specular: 0.0, ..Material::default() });
    scene.materials.len() as u32 - 1
}

/// Mean of the radiance that comes along a narrow view, over `samples` paths.
fn looking(scene: Scene, eye: Vec3, target: Vec3, samples: u32) -> Vec3 {
    let world = World::new(Arc::new(scene));
    let up = if (target - eye).x == 0.0 && (target - eye).z == 0.0 { Vec3::Z } else { Vec3::Y };
    let world_from_camera = look_at(eye, target, up);
    let view = View { world_from_camera, projection: Projection::Perspective { yfov_rad: 1e-3 } };
    let (size, pool) = (Size::new(8, 8), thread_pool(1));
    let (secs, view, samples) = (0.0, ViewSource::Free(view), samples / 64);
    let still = Still { secs, view, size, settings: PATH, samples, first_sample: 0 };
    let image = render_still(&world, &still, &pool, || ());
    image.iter().copied().map(Vec3::from).sum::<Vec3>() / image.len() as f32
}

#[track_caller]
fn assert_near(got: Vec3, want: Vec3, tolerance: f32) {
    assert!(
        (got - want).abs().max_element() <= tolerance * want.max_element(),
        "{got}, not {want}"
    );
}

#[test]
fn in_a_closed_glowing_room_every_bounce_adds_its_part() {
    // L = e + ρ L, whatever the shape.
    let mut scene = scenes::empty();
    let albedo = Vec3::new(0.5, 0.8, 0.0);
    let walls = matte(&mut scene, albedo, Vec3::splat(0.3));
    scene.materials[walls as usize].double_sided = true;
    let room = Transform { scale: Vec3::new(3.0, 1.0, 2.0), ..Transform::IDENTITY };
    scenes::add(&mut scene, scenes::triangle_sphere(8, 12, walls), room);
    let got = looking(scene, Vec3::ZERO, Vec3::new(1.0, 0.2, 0.3), 1 << 14);
    assert_near(got, 0.3 / (Vec3::ONE - albedo), 0.01);
}

#[test]
fn a_white_body_in_a_white_sky_is_invisible_if_it_is_matte_or_a_mirror() {
    let white = |metallic, roughness| {
        let mut scene = scenes::empty();
        scene.sky = [Vec3::ONE; 2];
        scene.materials.push(Material {
            metallic,
            roughness,
            specular: 0.0,
            ..Material::default()
        });
        scenes::add(&mut scene, scenes::triangle_sphere(12, 16, 0), Transform::IDENTITY);
        looking(scene, Vec3::new(0.0, 0.0, 4.0), Vec3::new(0.4, 0.3, 0.0), 1 << 12)
    };
    assert_near(white(0.0, 1.0), Vec3::ONE, 1e-4);
    assert_near(white(1.0, 0.0), Vec3::ONE, 1e-4);
    // Light that a rough metal's facets send on to each other is lost in this model: of D V cosθ over the hemisphere, added up
    // in another program, 0.563 is left at cosθ = 0.87 and 0.555 at 1.
    assert_near(white(1.0, 0.8), Vec3::splat(0.56), 0.01);
}

/// A square of side 2 at height `z`, facing down, turned and scaled into place by an instance.
fn lamp(scene: &mut Scene, side: f32, height: f32, radiance: f32) {
    let glow = matte(scene, Vec3::ZERO, Vec3::splat(radiance));
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let square = Mesh {
        positions: corners.map(|[x, z]| Vec3::new(x, 0.0, z)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: TriangleMaterials::all(glow, 2),
        ..Mesh::default()
    };
    let place = Transform {
        translation: Vec3::Y * height,
        rotation: Quat::from_rotation_y(0.5),
        scale: Vec3::splat(0.5 * side),
    };
    scenes::add(scene, Geometry::Mesh(square), place);
}

/// Irradiance below the middle of a parallel square (Lambert 1760): E = L · 4 · 2 a/√(1+a²) · atan(a/√(1+a²)) / 2 with a = side / 2h.
fn below_a_square(side: f32, height: f32) -> f32 {
    let a = side / (2.0 * height);
    let c = a / (1.0 + a * a).sqrt();
    4.0 * c * c.atan()
}

#[test]
fn a_square_lamp_lights_what_is_below_it_by_the_closed_form() {
    for (side, height) in [(1.0, 2.0), (4.0, 0.5), (0.1, 3.0)] {
        let mut scene = scenes::empty();
        let floor = matte(&mut scene, Vec3::splat(0.6), Vec3::ZERO);
        scenes::add(&mut scene, scenes::floor(100.0, 0.0, floor), Transform::IDENTITY);
        lamp(&mut scene, side, height, 5.0);
        let eye = Vec3::new(0.9 * height, 0.45 * height, 0.0) + Vec3::X * side;
        let got = looking(scene, eye, Vec3::ZERO, 1 << 14);
        let want = 0.6 / PI * 5.0 * below_a_square(side, height);
        assert_near(got, Vec3::splat(want), 0.02);
    }
}

#[test]
fn a_lamp_is_found_by_either_way_alone_as_well() {
    // A rough mirror sees a large lamp mostly by following directions, a small one mostly by asking it: together they must agree with
    // a brute force, for which the lamp is a sphere that cannot be asked.
    let floor_under = |lamp: &dyn Fn(&mut Scene)| {
        let mut scene = scenes::empty();
        let metal = scenes::add_material(&mut scene, Vec3::splat(0.8), 1.0, 0.35);
        scenes::add(&mut scene, scenes::floor(100.0, 0.0, metal), Transform::IDENTITY);
        lamp(&mut scene);
        looking(scene, Vec3::new(-3.0, 2.0, 0.0), Vec3::ZERO, 1 << 17)
    };
    let ball = Transform { scale: Vec3::splat(1.2), ..scenes::at(3.0, 2.4, 0.0) };
    let met = floor_under(&|scene| {
        let glow = matte(scene, Vec3::ZERO, Vec3::splat(2.0));
        scenes::add(scene, Geometry::Sphere { material: glow }, ball);
    });
    let asked = floor_under(&|scene| {
        let glow = matte(scene, Vec3::ZERO, Vec3::splat(2.0));
        scenes::add(scene, scenes::triangle_sphere(60, 90, glow), ball);
    });
    assert_near(asked, met, 0.02);
}

#[test]
fn matte_surfaces_under_a_point_light_are_as_in_direct() {
    let mut scene = scenes::empty();
    let white = matte(&mut scene, Vec3::new(0.7, 0.5, 0.3), Vec3::ZERO);
    let dark = matte(&mut scene, Vec3::ZERO, Vec3::ZERO);
    scenes::add(&mut scene, scenes::floor(100.0, -1.0, white), Transform::IDENTITY);
    scenes::add(&mut scene, Geometry::Sphere { material: dark }, scenes::at(0.3, 0.2, 0.0));
    scenes::add_point_light(&mut scene, Vec3::new(1.0, 3.0, 1.0), 20.0);
    let world = World::new(Arc::new(scene));
    let pool = thread_pool(1);
    let picture = |settings| render(&world, 0.0, &scenes::CAMERA, scenes::SIZE, &settings, &pool);
    // A convex dark body above a floor: nothing bounces twice.
    let (path, direct) = (picture(PATH), picture(Settings::default()));
    assert!(direct.iter().any(|rgb| rgb[0] > 0.1));
    for (path, direct) in path.into_iter().zip(direct) {
        assert_near(path.into(), direct.into(), 1e-4);
    }
}

#[test]
fn the_same_request_has_the_same_answer_and_the_next_another() {
    let world = World::new(scenes::mixed());
    let (moment, size) = (world.moment(0.0), scenes::SIZE);
    let view = scenes::CAMERA.at(world.scene(), moment.state());
    let answer = |pixel, sample_index| {
        let request = Request { sample_index, ..Request::centre(pixel) };
        world.trace(&moment, &view, size, &request, &PATH).0
    };
    let mut differ = 0;
    for pixel in 0..size.pixels() as u32 {
        assert_eq!(answer(pixel, 7), answer(pixel, 7));
        differ += u32::from(answer(pixel, 7) != answer(pixel, 8));
        assert!(answer(pixel, 0xffff_ffff).iter().all(|c| c.is_finite()));
    }
    assert!(differ > size.pixels() as u32 / 4, "{differ}");
}
