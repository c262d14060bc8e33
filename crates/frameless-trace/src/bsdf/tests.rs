//! Scattering against its own integrals, and against light that is conserved.

use std::f32::consts::TAU;

use super::*;
use crate::matter::LayersHere;

const NORMAL: Vec3A = Vec3A::new(0.6, 0.0, 0.8);
const BASE: Vec3A = Vec3A::new(0.9, 0.6, 0.3);

fn layers() -> LayersHere {
    LayersHere {
        ior: 1.5,
        specular_color: Vec3A::ONE,
        transmission: 0.0,
        refracts: false,
        coat: 0.0,
        coat_roughness: 0.0,
        coat_normal: NORMAL,
        sheen: Vec3A::ZERO,
        sheen_roughness: 0.5,
    }
}

fn plain(metallic: f32, roughness: f32) -> Matter {
    Matter { base: BASE, metallic, roughness, specular: 1.0, ..Matter::BLACK }
}

fn with(matter: Matter, layers: LayersHere) -> Matter {
    Matter { layers: Some(Box::new(layers)), ..matter }
}

/// What the suite is run on: plain ones, and every layer alone and with others.
fn matters() -> Vec<Matter> {
    let coat = LayersHere { coat: 1.0, coat_roughness: 0.5, ..layers() };
    let sheen = LayersHere { sheen: Vec3A::new(0.9, 0.3, 1.0), ..layers() };
    let glass = LayersHere { transmission: 0.8, refracts: true, ..layers() };
    let wall = LayersHere { transmission: 1.0, ior: 2.0, ..layers() };
    let tinted = LayersHere { specular_color: Vec3A::new(5.0, 0.1, 2.0), ..layers() };
    vec![
        plain(0.0, 1.0),
        Matter { specular: 0.0, ..plain(0.0, 0.3) },
        plain(0.0, 0.5),
        plain(1.0, 0.3),
        plain(1.0, 1.0),
        plain(0.5, 0.4),
        plain(0.0, 0.25),
        with(plain(0.0, 0.6), coat),
        with(plain(1.0, 0.4), coat),
        with(plain(0.0, 0.8), sheen),
        with(plain(0.0, 0.5), LayersHere { coat: 0.5, coat_roughness: 0.3, ..sheen }),
        with(plain(0.0, 0.4), glass),
        with(plain(0.2, 0.6), LayersHere { coat: 1.0, coat_roughness: 0.6, ..glass }),
        with(plain(0.0, 0.5), wall),
        with(plain(0.3, 0.5), tinted),
    ]
}

const TILTS: [f32; 5] = [0.0, 0.5, 1.0, 1.4, 1.55];

fn tilted(tilt_rad: f32) -> Vec3A {
    tilt_rad.cos() * NORMAL + tilt_rad.sin() * Vec3A::new(0.8, 0.0, -0.6)
}

fn seen(matter: &Matter, to_eye: Vec3A) -> Bsdf {
    of(matter, true, to_eye)
}

fn of(matter: &Matter, is_front: bool, to_eye: Vec3A) -> Bsdf {
    let mut bsdf = Bsdf::undivided(matter, NORMAL, to_eye);
    bsdf.divide_lobes(matter, is_front, to_eye);
    bsdf
}

/// Directions over the hemisphere, all weighing the same: (n + ½)/N in cos and φ.
fn hemisphere(per_side: u32) -> impl Iterator<Item = Vec3A> {
    let (x, y) = NORMAL.any_orthonormal_pair();
    let at = move |i: u32| (i as f32 + 0.5) / per_side as f32;
    (0..per_side * per_side).map(move |i| {
        let (cos, phi) = (at(i % per_side), TAU * at(i / per_side));
        let sin = (1.0 - cos * cos).sqrt();
        cos * NORMAL + sin * (phi.cos() * x + phi.sin() * y)
    })
}

/// Finer in the first number, which also chooses the lobe.
fn grid(per_side: u32) -> impl Iterator<Item = [f32; 2]> {
    let at = move |i: u32, steps: u32| ((i % steps) as f32 + 0.5) / steps as f32;
    let squared = per_side.pow(2);
    (0..per_side.pow(3)).map(move |i| [at(i, squared), at(i / squared, per_side)])
}

#[test]
fn densities_add_up_to_the_samples_that_stay_above() {
    for matter in matters() {
        for tilt in [0.0, 0.5, 1.3] {
            let bsdf = seen(&matter, tilted(tilt));
            let sum: f64 = hemisphere(800).map(|w| f64::from(bsdf.density(w))).sum();
            let integral = sum * f64::from(TAU) / (800.0 * 800.0);
            let stays = |u: &[f32; 2]| bsdf.sample(*u).is_some_and(|s| s.density.is_some());
            let above = grid(64).filter(stays).count() as f64 / 64f64.powi(3);
            assert!((integral - above).abs() < 0.02, "{matter:?}: {integral}, {above}");
        }
    }
}

#[test]
fn samples_reflect_as_much_as_the_integral_says() {
    for matter in matters() {
        for tilt in [0.0, 0.5, 1.3] {
            let bsdf = seen(&matter, tilted(tilt));
            let sum: Vec3A = hemisphere(800).map(|w| bsdf.scattered(w)).sum();
            let integral = sum * (TAU / (800.0 * 800.0));
            let found = grid(64).filter_map(|u| bsdf.sample(u));
            let weights = found.filter(|s| s.density.is_some()).map(|s| s.weight);
            let mean = weights.sum::<Vec3A>() / 64f32.powi(3);
            let apart = (mean - integral).abs().max_element();
            assert!(apart < 0.015, "{matter:?} {tilt}: {integral} {mean}");
        }
    }
}

/// Of all light that comes in, no more goes out: in no colour, at no angle, whatever is on top of what.
#[test]
fn no_light_is_made() {
    let smooth = matters().into_iter().map(|matter| Matter { roughness: 0.0, ..matter });
    let polished = smooth.clone().map(|mut matter| {
        matter.layers.iter_mut().for_each(|layers| layers.coat_roughness = 0.0);
        matter
    });
    for matter in matters().into_iter().chain(smooth).chain(polished) {
        let white = Matter { base: Vec3A::ONE, ..matter };
        for tilt in TILTS {
            for is_front in [true, false] {
                let bsdf = of(&white, is_front, tilted(tilt));
                let weights = grid(48).filter_map(|u| bsdf.sample(u)).map(|s| s.weight);
                let mean = weights.sum::<Vec3A>() / 48f32.powi(3);
                assert!(mean.max_element() < 1.01, "{white:?} {tilt} {is_front}: {mean}");
                assert!(mean.min_element() >= 0.0, "{white:?} {tilt} {is_front}: {mean}");
            }
        }
    }
}

/// Smooth glass and smooth white plastic lose nothing.
#[test]
fn smooth_dielectrics_keep_all_light() {
    let white = |transmission, refracts| {
        let glass = LayersHere { transmission, refracts, ..layers() };
        with(Matter { base: Vec3A::ONE, ..plain(0.0, 0.0) }, glass)
    };
    for matter in [white(1.0, true), white(1.0, false), white(0.0, false), white(0.5, true)] {
        for tilt in TILTS {
            for is_front in [true, false] {
                let bsdf = of(&matter, is_front, tilted(tilt));
                let weights = grid(48).filter_map(|u| bsdf.sample(u)).map(|s| s.weight);
                let mean = weights.sum::<Vec3A>() / 48f32.powi(3);
                assert!((mean - 1.0).abs().max_element() < 0.01, "{matter:?} {tilt}: {mean}");
            }
        }
    }
}

/// What scatters evenly goes a shorter way: it must be what the longer one tends to.
#[test]
fn matte_is_what_hardly_glossy_is() {
    let matte = Matter { specular: 0.0, ..plain(0.0, 1.0) };
    let hardly = Matter { specular: 1e-6, ..matte.clone() };
    for tilt in TILTS {
        let [matte, hardly] = [&matte, &hardly].map(|matter| seen(matter, tilted(tilt)));
        for direction in hemisphere(9).chain([-NORMAL]) {
            let ((f, density), (g, other)) = (matte.towards(direction), hardly.towards(direction));
            assert!(f.abs_diff_eq(g, 1e-4) && (density - other).abs() < 1e-4, "{direction}");
        }
        for numbers in grid(5) {
            let found = matte.sample(numbers).expect("above");
            assert_eq!(found.weight, BASE);
            let density = matte.density(found.direction);
            assert!((found.density.unwrap_or_default() - density).abs() < 1e-5, "{found:?}");
        }
    }
}

#[test]
fn light_goes_both_ways_alike() {
    for matter in matters() {
        for tilt in TILTS {
            let to_eye = tilted(tilt);
            let there = seen(&matter, to_eye);
            for to_light in hemisphere(7) {
                let back = seen(&matter, to_light);
                let one = there.scattered(to_light) * to_eye.dot(NORMAL);
                let other = back.scattered(to_eye) * to_light.dot(NORMAL);
                let apart = (one - other).abs().max_element();
                assert!(apart < 1e-3 * one.max_element().max(1e-3), "{matter:?}");
            }
        }
    }
}

#[test]
fn a_mirror_reflects_its_colour_and_more_at_the_edge() {
    let mirror = seen(&plain(1.0, 0.0), tilted(0.4));
    let scattered = mirror.sample([0.5; 2]).expect("above");
    assert!((scattered.direction.dot(NORMAL) - 0.4f32.cos()).abs() < 1e-5);
    assert!((scattered.weight - BASE).abs().max_element() < 1e-3);
    assert_eq!(mirror.scattered(scattered.direction), Vec3A::ZERO);
    let edge = seen(&plain(1.0, 0.0), tilted(1.56)).sample([0.5; 2]).expect("above");
    assert!(edge.weight.min_element() > 0.9, "{edge:?}");
}

#[test]
fn nothing_absurd_makes_absurd_light() {
    for number in [0.0, 1.0, f32::MAX, f32::INFINITY] {
        let glass = LayersHere {
            ior: number.max(1.0),
            specular_color: Vec3A::splat(number.min(f32::MAX)),
            transmission: 1.0,
            refracts: true,
            coat: number,
            coat_roughness: number,
            coat_normal: NORMAL,
            sheen: Vec3A::ONE,
            sheen_roughness: number,
        };
        for is_front in [true, false] {
            let matter = with(plain(0.0, number), glass);
            let bsdf = of(&matter, is_front, tilted(1.0));
            for scattered in grid(12).filter_map(|u| bsdf.sample(u)) {
                assert!(scattered.weight.is_finite(), "{matter:?} {scattered:?}");
                assert!(scattered.direction.is_finite(), "{matter:?} {scattered:?}");
            }
        }
    }
}
