//! Materials as they are seen: textures, holes, glass, environments, against what is known without tracing.

use std::f32::consts::PI;
use std::sync::Arc;

use frameless::{Request, Size};
use frameless_scene::{
    AlphaMode, Environment, Filter, Geometry, Image, Layers, Material, Mesh, Minify, Projection,
    Scene, Texels, Texture, TextureRef, Transform, TriangleMaterials, View, Volume, Wrap, look_at,
};
use glam::{Quat, Vec2, Vec3, Vec4};

use crate::integrator::{Integrator, Settings};
use crate::test_scenes as scenes;
use crate::{Still, ViewSource, World, render_still, thread_pool};

const DIRECT: Settings =
    Settings { integrator: Integrator::Direct, max_depth: 8, lens: None, surfaces: true };
const PATH: Settings =
    Settings { integrator: Integrator::Path, max_depth: 30, lens: None, surfaces: true };

/// Mean of what comes along a narrow view, over `samples` samples.
fn looking(scene: &Scene, [eye, target]: [Vec3; 2], settings: Settings, samples: u32) -> Vec3 {
    let world = World::new(Arc::new(scene.clone()));
    let up = if (target - eye).x == 0.0 && (target - eye).z == 0.0 { Vec3::Z } else { Vec3::Y };
    let projection = Projection::Perspective { yfov_rad: 1e-3 };
    let view = ViewSource::Free(View { world_from_camera: look_at(eye, target, up), projection });
    let still =
        Still { secs: 0.0, view, size: Size::new(1, 1), settings, samples, first_sample: 0 };
    Vec3::from(render_still(&world, &still, &thread_pool(1), || ())[0])
}

#[track_caller]
fn assert_near(got: Vec3, want: Vec3, tolerance: f32) {
    assert!((got - want).abs().max_element() <= tolerance, "{got}, not {want}");
}

/// A square of side 2 in the plane z, facing +z, with a picture upright on it.
fn pane(scene: &mut Scene, z: f32, material: Material) -> u32 {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let mut mesh = Mesh {
        positions: corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: TriangleMaterials::all(scene.materials.len() as u32, 2),
        ..Mesh::default()
    };
    mesh.uvs[0] = corners.map(|[x, y]| Vec2::new(0.5 + 0.5 * x, 0.5 - 0.5 * y)).to_vec();
    scene.materials.push(material);
    scenes::add(scene, Geometry::Mesh(mesh), scenes::at(0.0, 0.0, z))
}

fn picture(scene: &mut Scene, width: u32, rgba: Vec<[u8; 4]>, minify: Minify) -> TextureRef {
    let height = rgba.len() as u32 / width;
    scene.images.push(Image { width, height, rgba });
    let image = scene.images.len() as u32 - 1;
    let wrap = [Wrap::ClampToEdge; 2];
    scene.textures.push(Texture { image, wrap, filter: Filter::Nearest, minify });
    TextureRef::plain(scene.textures.len() as u32 - 1)
}

const NEAREST: Minify = Minify { filter: Filter::Nearest, levels: None };

fn glowing(emissive: Vec3) -> Material {
    Material { emissive, base_color: Vec4::W, specular: 0.0, ..Material::default() }
}

/// Black, but for its alpha.
fn veil(alpha: f32) -> Material {
    let base_color = Vec4::new(0.0, 0.0, 0.0, alpha);
    Material { base_color, alpha_mode: AlphaMode::Blend, specular: 0.0, ..Material::default() }
}

const AHEAD: [Vec3; 2] = [Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO];

#[test]
fn masked_texels_let_rays_of_all_kinds_through() {
    let mut scene = scenes::empty();
    pane(&mut scene, 0.0, glowing(Vec3::ONE));
    let texture = picture(&mut scene, 2, vec![[255, 255, 255, 200], [255, 255, 255, 100]], NEAREST);
    let masked = Material {
        base_color_texture: Some(texture),
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        emissive: Vec3::X,
        ..glowing(Vec3::ZERO)
    };
    pane(&mut scene, 1.0, masked);
    let floor = scenes::add_material(&mut scene, Vec3::ONE, 0.0, 1.0);
    scenes::add(&mut scene, scenes::floor(9.0, -3.0, floor), Transform::IDENTITY);
    scenes::add_point_light(&mut scene, Vec3::new(0.0, 0.0, 2.0), 0.0);
    for settings in [DIRECT, PATH] {
        let at = |x: f32| {
            let aim = [Vec3::new(x, 0.0, 5.0), Vec3::new(x, 0.0, 0.0)];
            looking(&scene, aim, settings, 8)
        };
        assert_near(at(-0.5), Vec3::X, 1e-5);
        assert_near(at(0.5), Vec3::ONE, 1e-5);
    }
    // The light's ray from the pane behind: through the right half only.
    let world = World::new(Arc::new(scene));
    let moment = world.moment(0.0);
    let mut stack = crate::traverse::Stack::new();
    let mut passes = |x: f32| {
        let origin = glam::Vec3A::new(x, 0.0, 0.1);
        let ray = crate::Ray { origin, direction: glam::Vec3A::Z };
        world.passing(&moment, &ray, 1.9, true, &mut stack)
    };
    assert_eq!((passes(-0.5).x, passes(0.5).x), (0.0, 1.0));
}

/// Of panes one behind the other, in whichever order the file has them: L = Σ a_k e_k Π (1 − a_j before it).
#[test]
fn panes_that_blend_lie_over_each_other_in_order() {
    let mut scene = scenes::empty();
    scene.sky = [Vec3::ONE; 2];
    let panes = [(1.0, 0.25, Vec3::X), (0.0, 0.5, Vec3::Y), (2.0, 0.75, Vec3::Z)];
    for (z, alpha, emissive) in panes {
        pane(&mut scene, z, Material { emissive, ..veil(alpha) });
    }
    let want = Vec3::new(0.25 * 0.25, 0.25 * 0.75 * 0.5, 0.75) + 0.25 * 0.75 * 0.5 * Vec3::ONE;
    assert_near(looking(&scene, AHEAD, DIRECT, 1), want, 1e-5);
    assert_near(looking(&scene, AHEAD, PATH, 1 << 14), want, 0.01);
    // Off the diagonal's two triangles, too, from behind, and wholly transparent ones are not there.
    for material in &mut scene.materials {
        material.base_color.w = 0.0;
        material.double_sided = true;
    }
    let behind = [Vec3::new(0.3, 0.1, -5.0), Vec3::new(0.3, 0.1, 0.0)];
    for settings in [DIRECT, PATH] {
        assert_eq!(looking(&scene, behind, settings, 4), Vec3::ONE);
    }
}

#[test]
fn a_veil_dims_the_light_behind_it_and_is_no_shadow_for_relighting() {
    for (settings, samples) in [(DIRECT, 1), (PATH, 16)] {
        let mut scene = scenes::empty();
        let white = scenes::add_material(&mut scene, Vec3::ONE, 0.0, 1.0);
        scene.materials[white as usize].specular = 0.0;
        scenes::add(&mut scene, scenes::floor(5.0, 0.0, white), Transform::IDENTITY);
        scenes::add_point_light(&mut scene, Vec3::new(0.0, 4.0, 0.0), 16.0 * PI);
        // Beside the line where the pane's triangles meet: both are hit there.
        let aim = [Vec3::new(3.0, 1.0, 0.0), Vec3::new(0.3, 0.0, 0.1)];
        let bare = looking(&scene, aim, settings, samples);
        let lying =
            Transform { rotation: Quat::from_rotation_x(-PI / 2.0), ..scenes::at(0.0, 2.0, 0.0) };
        let pane = pane(&mut scene, 0.0, veil(0.25));
        let node = scene.instances[pane as usize].node as usize;
        scene.nodes[node].rest = lying;
        assert_near(looking(&scene, aim, settings, samples), 0.75 * bare, 1e-3);
        let world = World::new(Arc::new(scene));
        let up = look_at(aim[0], aim[1], Vec3::Y);
        let projection = Projection::Perspective { yfov_rad: 1e-3 };
        let view = View { world_from_camera: up, projection };
        let request = Request::centre(0);
        let (_, surface) =
            world.trace(&world.moment(0.0), &view, Size::new(1, 1), &request, &settings);
        assert_eq!((surface.lit & 1, surface.direct), (0, [0.0; 3]));
    }
}

#[test]
fn what_is_unlit_shows_its_colour_and_lights_nothing() {
    let mut scene = scenes::empty();
    scene.sky = [Vec3::ZERO; 2];
    let color = Vec3::new(0.25, 0.5, 1.0);
    let unlit = Material { base_color: color.extend(1.0), unlit: true, ..Material::default() };
    pane(&mut scene, 0.0, Material { emissive: Vec3::splat(9.0), ..unlit });
    let white = scenes::add_material(&mut scene, Vec3::ONE, 0.0, 1.0);
    scenes::add(&mut scene, scenes::floor(5.0, -1.0, white), Transform::IDENTITY);
    scene.ambient = Vec3::ZERO;
    for settings in [DIRECT, PATH] {
        assert_eq!(looking(&scene, AHEAD, settings, 4), color);
        let below = [Vec3::new(0.0, 1.0, 4.0), Vec3::new(0.0, -1.0, 1.0)];
        assert_eq!(looking(&scene, below, settings, 64), Vec3::ZERO);
    }
}

/// E cosθ of a normal that is tilted towards +x, of an upright picture, one lying on its side, one seen from behind, one mirrored.
#[test]
fn normal_maps_tilt_towards_the_pictures_right_and_up() {
    let tilted = |texel: [u8; 4], change: &dyn Fn(&mut Scene, usize)| {
        let mut scene = scenes::empty();
        let texture = picture(&mut scene, 1, vec![texel], NEAREST);
        let base = Material { specular: 0.0, double_sided: true, ..Material::default() };
        pane(&mut scene, 0.0, Material { normal_texture: Some((texture, 1.0)), ..base });
        let node = scene.instances[0].node as usize;
        change(&mut scene, node);
        // A light far to the right.
        scenes::add_point_light(&mut scene, Vec3::new(1000.0, 0.0, 0.0), PI * 1e6);
        looking(&scene, AHEAD, DIRECT, 1).x
    };
    // (0.6, 0, 0.8) in bytes.
    let right = [204, 128, 230, 255];
    let near = |got: f32, want: f32| assert!((got - want).abs() < 0.01, "{got}, not {want}");
    let flat: [u8; 4] = [128, 128, 255, 255];
    near(tilted(flat, &|_, _| ()), 0.004);
    near(tilted(right, &|_, _| ()), 0.6);
    near(tilted([51, 128, 230, 255], &|_, _| ()), 0.0);
    let on_its_side = |scene: &mut Scene, node: usize| {
        scene.nodes[node].rest.rotation = Quat::from_rotation_z(-PI / 2.0);
    };
    near(tilted(right, &on_its_side), 0.0);
    near(tilted([128, 204, 230, 255], &on_its_side), 0.6);
    // From behind, right is left, and the whole normal is turned round: it points away from the eye's left, to the right.
    let turned = |scene: &mut Scene, node: usize| {
        scene.nodes[node].rest.rotation = Quat::from_rotation_y(PI);
    };
    near(tilted(right, &turned), 0.6);
    let mirrored = |scene: &mut Scene, node: usize| {
        scene.nodes[node].rest.scale = Vec3::new(1.0, -1.0, 1.0);
        scene.nodes[node].rest.rotation = Quat::from_rotation_z(PI / 2.0);
    };
    // Up in the mirrored picture is down in its plane, and that is to the right.
    near(tilted([128, 204, 230, 255], &mirrored), 0.6);
}

#[test]
fn occlusion_dims_ambient_light_alone() {
    let mut scene = scenes::empty();
    scene.ambient = Vec3::ONE;
    let texture = picture(&mut scene, 1, vec![[51, 0, 0, 255]], NEAREST);
    let material = Material { occlusion_texture: Some((texture, 0.5)), ..Material::default() };
    pane(&mut scene, 0.0, material);
    // 1 + 0.5 (0.2 − 1).
    assert_near(looking(&scene, AHEAD, DIRECT, 1), Vec3::splat(0.6), 1e-5);
    scene.ambient = Vec3::ZERO;
    scenes::add_point_light(&mut scene, Vec3::new(0.0, 0.0, 1.0), PI);
    assert_near(looking(&scene, AHEAD, DIRECT, 1), Vec3::ONE, 1e-3);
}

/// A block of glass, 2 × 2 × `thickness`, and what it is made of.
fn block(scene: &mut Scene, thickness: f32, layers: Layers, base: Vec3) {
    let material = Material {
        base_color: base.extend(1.0),
        roughness: 0.0,
        layers: Some(Box::new(layers)),
        ..Material::default()
    };
    pane(scene, 0.5 * thickness, material.clone());
    let back = pane(scene, 0.0, material);
    let node = scene.instances[back as usize].node as usize;
    let rotation = Quat::from_rotation_y(PI);
    scene.nodes[node].rest = Transform { rotation, ..scenes::at(0.0, 0.0, -0.5 * thickness) };
}

/// Beer and Lambert: e^(−σ d), which is the colour at its distance; and the base colour twice.
#[test]
fn a_volume_absorbs_by_the_closed_form() {
    let color = Vec3::new(0.9, 0.5, 0.2);
    let glass = Layers {
        // Neither reflects nor bends.
        ior: 1.0,
        transmission: 1.0,
        volume: Some(Volume::attenuating(color, 2.0)),
        ..Layers::default()
    };
    let base = Vec3::new(0.5, 1.0, 1.0);
    for thickness in [0.5, 2.0, 3.0] {
        let mut scene = scenes::empty();
        scene.sky = [Vec3::ONE; 2];
        block(&mut scene, thickness, glass.clone(), base);
        let want = color.powf(thickness / 2.0) * base * base;
        for (settings, samples) in [(DIRECT, 1), (PATH, 256)] {
            assert_near(looking(&scene, AHEAD, settings, samples), want, 2e-3);
        }
        // What stands inside is seen through what lies before it.
        pane(&mut scene, 0.0, glowing(Vec3::ONE));
        let want = color.powf(thickness / 4.0) * base;
        for (settings, samples) in [(DIRECT, 1), (PATH, 256)] {
            assert_near(looking(&scene, AHEAD, settings, samples), want, 2e-3);
        }
    }
}

/// A plane-parallel block moves what is behind it aside: d sinθ (1 − cosθ / √(n² − sin²θ)).
#[test]
fn a_block_of_glass_displaces_what_is_behind_it() {
    let (thickness, ior) = (1.0f32, 1.5f32);
    let glass = Layers {
        ior,
        transmission: 1.0,
        volume: Some(Volume { absorption_per_m: Vec3::ZERO }),
        ..Layers::default()
    };
    let mut scene = scenes::empty();
    block(&mut scene, thickness, glass, Vec3::ONE);
    let (sin, cos) = (0.5f32.sin(), 0.5f32.cos());
    let shift = thickness * (sin / cos - sin / (ior * ior - sin * sin).sqrt());
    // Where the straight ray would meet the plane z = −3, and where the bent one does.
    let straight = -3.0 * sin / cos;
    let spot = Transform { scale: Vec3::splat(0.05), ..scenes::at(straight + shift, 0.0, -3.0) };
    scene.materials.push(glowing(Vec3::splat(10.0)));
    let material = scene.materials.len() as u32 - 1;
    scenes::add(&mut scene, Geometry::Sphere { material }, spot);
    let eye = 4.0 * Vec3::new(sin, 0.0, cos);
    let seen = looking(&scene, [eye, Vec3::ZERO], DIRECT, 1).x;
    assert!(seen > 8.0, "{seen}: the spot is not where Snell has it");
}

fn environment(width: u32, height: u32, texel: impl Fn(u32, u32) -> f32) -> Environment {
    let texels = (0..width * height).map(|i| [texel(i % width, i / width); 3]).collect();
    let (name, texels) = (String::new(), Arc::new(Texels::Linear(texels)));
    Environment { name, width, height, texels, rotation_rad: 0.0, strength: 1.0 }
}

#[test]
fn in_an_even_environment_white_bodies_are_invisible() {
    let bodies = [
        Material { specular: 0.0, ..Material::default() },
        Material { metallic: 1.0, roughness: 0.0, ..Material::default() },
        Material { roughness: 0.0, ..Material::default() },
        Material {
            roughness: 0.0,
            layers: Some(Box::new(Layers {
                transmission: 1.0,
                volume: Some(Volume { absorption_per_m: Vec3::ZERO }),
                ..Layers::default()
            })),
            ..Material::default()
        },
    ];
    for body in bodies {
        let mut scene = scenes::empty();
        scene.environment = Some(environment(16, 8, |_, _| 1.0));
        scene.materials.push(body.clone());
        scenes::add(&mut scene, scenes::triangle_sphere(16, 24, 0), Transform::IDENTITY);
        let aim = [Vec3::new(0.0, 0.0, 4.0), Vec3::new(0.4, 0.3, 0.0)];
        let settings = Settings { max_depth: 200, ..PATH };
        assert_near(looking(&scene, aim, settings, 4096), Vec3::ONE, 0.02);
        // Nine numbers add the rows up at their middles: 2 % too much of so coarse a picture.
        assert_near(looking(&scene, aim, DIRECT, 1), Vec3::ONE, 0.05);
    }
}

/// E = L Ω cosθ, the texel being interpolated with black ones beside it.
#[test]
fn a_sun_of_one_texel_lights_by_the_closed_form() {
    const SIZE: [u32; 2] = [256, 128];
    let row = 20;
    let radiance = 500.0;
    let mut scene = scenes::empty();
    let sun =
        environment(SIZE[0], SIZE[1], |x, y| if [x, y] == [40, row] { radiance } else { 0.0 });
    scene.environment = Some(sun);
    let white = scenes::add_material(&mut scene, Vec3::splat(0.8), 0.0, 1.0);
    scene.materials[white as usize].specular = 0.0;
    scenes::add(&mut scene, scenes::floor(10.0, 0.0, white), Transform::IDENTITY);
    let theta = PI * (row as f32 + 0.5) / SIZE[1] as f32;
    let texel = 2.0 * PI / SIZE[0] as f32 * PI / SIZE[1] as f32 * theta.sin();
    let want = 0.8 / PI * radiance * texel * theta.cos();
    let aim = [Vec3::new(1.0, 2.0, 0.5), Vec3::ZERO];
    let got = looking(&scene, aim, PATH, 1 << 13);
    assert_near(got / want, Vec3::ONE, 0.02);
}

/// From afar a checker is its mean, not one of its colours; where the file asks for the nearest texel, it is that.
#[test]
fn distant_textures_are_looked_up_in_smaller_copies() {
    let seen = |minify: Minify, distance: f32| {
        let mut scene = scenes::empty();
        let texel =
            |i: u32| if (i % 64 + i / 64).is_multiple_of(2) { [0, 0, 0, 255] } else { [255; 4] };
        let texture = picture(&mut scene, 64, (0..64 * 64).map(texel).collect(), minify);
        let unlit = Material { unlit: true, ..Material::default() };
        pane(&mut scene, 0.0, Material { base_color_texture: Some(texture), ..unlit });
        let world = World::new(Arc::new(scene));
        let world_from_camera = look_at(Vec3::new(0.0, 0.0, distance), Vec3::ZERO, Vec3::Y);
        let projection = Projection::Perspective { yfov_rad: 0.5 };
        let view = ViewSource::Free(View { world_from_camera, projection });
        let (size, settings) = (Size::new(16, 16), DIRECT);
        let still = Still { secs: 0.0, view, size, settings, samples: 1, first_sample: 0 };
        let image = render_still(&world, &still, &thread_pool(1), || ());
        [image[8 * 16 + 8][0], image[6 * 16 + 9][0], image[9 * 16 + 6][0]]
    };
    for value in seen(Minify::TRILINEAR, 4.0) {
        assert!((value - 0.5).abs() < 0.01, "{value}");
    }
    for minify in [NEAREST, Minify::TRILINEAR] {
        let distance = if minify == NEAREST { 4.0 } else { 0.05 };
        for value in seen(minify, distance) {
            assert!(value == 0.0 || value == 1.0, "{value}");
        }
    }
}

/// What no file should say, but some does, is drawn all the same.
#[test]
fn absurd_materials_give_finite_pixels() {
    let mut scene = scenes::empty();
    let texture = picture(&mut scene, 1, vec![[255, 0, 128, 0]], Minify::TRILINEAR);
    let lost = TextureRef { uv_set: 3, ..texture };
    let layers = Layers {
        ior: f32::INFINITY,
        specular_color: Vec3::splat(f32::MAX),
        transmission: 1.0,
        volume: Some(Volume::attenuating(Vec3::ZERO, 1e-30)),
        clearcoat: 1.0,
        clearcoat_normal_texture: Some((texture, 1e30)),
        sheen_color: Vec3::ONE,
        ..Layers::default()
    };
    let absurd = Material {
        base_color_texture: Some(lost),
        metallic_roughness_texture: Some(texture),
        normal_texture: Some((texture, -1e30)),
        occlusion_texture: Some((lost, 1.0)),
        emissive: Vec3::splat(1e30),
        emissive_texture: Some(texture),
        layers: Some(Box::new(layers)),
        ..Material::default()
    };
    let modes = [AlphaMode::Opaque, AlphaMode::Blend, AlphaMode::Mask { cutoff: -1.0 }];
    for (z, alpha_mode) in modes.into_iter().enumerate() {
        pane(&mut scene, z as f32, Material { alpha_mode, ..absurd.clone() });
        pane(
            &mut scene,
            z as f32 - 0.5,
            Material { alpha_mode, normal_texture: None, ..absurd.clone() },
        );
    }
    scene.environment = Some(environment(2, 1, |x, _| x as f32 * 1e38));
    scenes::add_point_light(&mut scene, Vec3::new(0.0, 0.0, 3.0), 1e30);
    scene.check().unwrap();
    for settings in [DIRECT, PATH] {
        for aim in [AHEAD, [Vec3::new(3.0, 1.0, 0.2), Vec3::ZERO], [Vec3::splat(-2.0), Vec3::ZERO]]
        {
            assert!(looking(&scene, aim, settings, 32).is_finite());
        }
    }
}
