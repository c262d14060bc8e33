//! Shading stored surfaces again, eight at a time: what [`relight`](super::relight) does with one, step by step and bit by bit.

use super::store::{Shading, Surfel};
use crate::wide::{F8, M8, Unit};
use crate::{Light, Placement};

/// Three coordinates, or colours.
type Three<U> = [F8<U>; 3];

/// Eight neighbouring samples, as if all were of the same object.
pub(super) struct Eight<U: Unit> {
    position: Three<U>,
    normal: Three<U>,
    albedo: Three<U>,
    /// Linear RGB as traced, without the direct light.
    indirect: Three<U>,
    lit: M8<U>,
}

impl<U: Unit> Eight<U> {
    #[inline(always)]
    pub(super) fn new(surfels: &[Surfel; 8], shadings: &[Shading; 8]) -> Self {
        let [a, b, c, d, e, f, g, h] = surfels;
        let surfels = [&a.0, &b.0, &c.0, &d.0, &e.0, &f.0, &g.0, &h.0];
        let [a, b, c, d, e, f, g, h] = shadings;
        let shadings = [&a.0, &b.0, &c.0, &d.0, &e.0, &f.0, &g.0, &h.0];
        let [x, y, z, _] = F8::four_columns(surfels);
        let [red, green, blue, normal, albedo, lit] = F8::six_columns(shadings);
        Eight {
            position: [x, y, z],
            normal: unpacked_normal(normal.to_bits()),
            albedo: unpacked_albedo(albedo.to_bits()),
            indirect: [red, green, blue],
            lit: lit.to_bits(),
        }
    }

    /// Linear colours under `lights`, of an object at `place`.
    #[inline(always)]
    pub(super) fn relit(&self, place: &Placement, lights: &[Light]) -> Three<U> {
        let [x, y, z] = self.position;
        let mut point = self.position;
        for (point, [a, b, c, d]) in point.iter_mut().zip(&place.point) {
            *point = F8::splat(*a) * x + F8::splat(*b) * y + (F8::splat(*c) * z + F8::splat(*d));
        }
        let mut normal = self.normal;
        for (normal, row) in normal.iter_mut().zip(&place.normal) {
            *normal = dot(&splat(row), &self.normal);
        }
        let per_length = per_length(&normal);
        let zero = F8::splat(0.0);
        let mut sum = [zero; 3];
        for (index, light) in lights.iter().take(32).enumerate() {
            let is_lit = self.lit.and(M8::splat(1 << index)).equals(M8::splat(0)).not();
            if !is_lit.any() {
                continue;
            }
            let (direction, irradiance) = arriving(light, &point);
            let cos = (dot(&normal, &direction) * per_length).at_least(zero);
            for (sum, irradiance) in sum.iter_mut().zip(irradiance) {
                *sum = (*sum + irradiance * cos).or(is_lit, *sum);
            }
        }
        let per_pi = F8::splat(std::f32::consts::FRAC_1_PI);
        let mut colour = self.indirect;
        for ((colour, albedo), sum) in colour.iter_mut().zip(self.albedo).zip(sum) {
            *colour = (*colour + albedo * per_pi * sum).at_least(zero);
        }
        colour
    }
}

/// [`Light::at`]: the direction to a light, and its irradiance.
#[inline(always)]
fn arriving<U: Unit>(light: &Light, point: &Three<U>) -> (Three<U>, Three<U>) {
    let intensity = splat(&light.intensity);
    let Some(position) = light.position else { return (splat(&light.backwards), intensity) };
    let mut direction = splat(&position);
    for (to, from) in direction.iter_mut().zip(point) {
        *to = *to - *from;
    }
    let one = F8::splat(1.0);
    let r2 = dot(&direction, &direction).at_least(F8::splat(Light::NEAREST_SQUARED));
    let r = r2.sqrt();
    for x in &mut direction {
        *x = *x / r;
    }
    let mut window = one;
    if light.range.is_finite() {
        let ratio = r2 / F8::splat(light.range * light.range);
        window = (one - ratio * ratio).clamped();
    }
    let mut spot = one;
    if let Some([cos_inner, cos_outer]) = light.cone {
        let cos = dot(&direction, &splat(&light.backwards));
        let width = (cos_inner - cos_outer).max(1e-4);
        let share = ((cos - F8::splat(cos_outer)) / F8::splat(width)).clamped();
        spot = share * share;
    }
    let per_r2 = window * spot / r2;
    let [r, g, b] = intensity;
    (direction, [r * per_r2, g * per_r2, b * per_r2])
}

/// [`PackedNormal::unpack`](super::packed::PackedNormal::unpack).
#[inline(always)]
fn unpacked_normal<U: Unit>(bits: M8<U>) -> Three<U> {
    let steps = F8::splat(super::packed::NORMAL_STEPS);
    let u = bits.shifted_right::<16>().to_f32() / steps;
    let v = bits.shifted_left::<16>().shifted_right::<16>().to_f32() / steps;
    let z = F8::splat(1.0) - u.abs() - v.abs();
    let fold = (F8::splat(0.0) - z).at_least(F8::splat(0.0));
    let (x, y) = (u - fold.with_sign_of(u), v - fold.with_sign_of(v));
    let per_length = per_length(&[x, y, z]);
    [x * per_length, y * per_length, z * per_length]
}

/// [`PackedAlbedo::unpack`](super::packed::PackedAlbedo::unpack).
#[inline(always)]
fn unpacked_albedo<U: Unit>(bits: M8<U>) -> Three<U> {
    let mut albedo = [F8::splat(0.0); 3];
    for (albedo, bits) in
        albedo.iter_mut().zip([bits.shifted_right::<20>(), bits.shifted_right::<10>(), bits])
    {
        let root = bits.and(M8::splat(1023)).to_f32() / F8::splat(super::packed::ALBEDO_STEPS);
        *albedo = root * root;
    }
    albedo
}

#[inline(always)]
fn per_length<U: Unit>(v: &Three<U>) -> F8<U> {
    F8::splat(1.0) / dot(v, v).sqrt().at_least(F8::splat(f32::MIN_POSITIVE))
}

#[inline(always)]
fn dot<U: Unit>(a: &Three<U>, b: &Three<U>) -> F8<U> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn splat<U: Unit>([x, y, z]: &[f32; 3]) -> Three<U> {
    [F8::splat(*x), F8::splat(*y), F8::splat(*z)]
}

#[cfg(test)]
mod tests {
    use super::super::relight::relit;
    use super::*;
    use crate::wide::{self, Task};
    use crate::{Display, Lighting, Rng, Surface, ToneMap};

    struct Compare<'a> {
        surfels: &'a [Surfel; 8],
        shadings: &'a [Shading; 8],
        lighting: &'a Lighting,
        display: &'a Display,
    }

    impl Task for Compare<'_> {
        #[inline(always)]
        fn run<U: Unit>(self) {
            let Compare { surfels, shadings, lighting, display } = self;
            let place = lighting.world_from_object[0].expect("the only object");
            let eight = Eight::<U>::new(surfels, shadings).relit(&place, &lighting.lights);
            let encoded = display.encode_eight(eight);
            for lane in 0..8 {
                let one = relit(0, &surfels[lane], &shadings[lane], lighting);
                let one = one.expect("is shaded again");
                assert_eq!(eight.map(|c| c.lanes()[lane].to_bits()), one.map(f32::to_bits));
                let one = display.encode(one);
                assert_eq!(encoded.map(|c| c.lanes()[lane].to_bits()), one.map(f32::to_bits));
            }
        }
    }

    #[test]
    fn eight_at_a_time_are_what_they_are_one_by_one() {
        let mut rng = Rng::new(1);
        for round in 0..400 {
            let mut any = |scale: f32| scale * (rng.unit_f32() - 0.5);
            let mut three = |scale: f32| -> [f32; 3] { std::array::from_fn(|_| any(scale)) };
            let light = |position: Option<[f32; 3]>, range: f32, cone: Option<[f32; 2]>| Light {
                position,
                backwards: [0.6, 0.0, 0.8],
                intensity: [9.0, 5.0, 2.0],
                range,
                cone,
            };
            let lights = vec![
                light(Some(three(4.0)), f32::INFINITY, None),
                light(Some(three(4.0)), 3.0, Some([0.9, 0.2])),
                light(None, f32::INFINITY, None),
            ];
            let place = Placement {
                point: [(); 3].map(|()| {
                    let [a, b, c] = three(2.0);
                    [a, b, c, 0.5]
                }),
                normal: [(); 3].map(|()| three(2.0)),
            };
            let lighting = Lighting { lights, world_from_object: vec![Some(place)] };
            let surfels = [(); 8].map(|()| Surfel::new(three(3.0), [0.0; 3]));
            let shadings = std::array::from_fn(|lane| {
                let (n, linear) = (three(1.0), three(2.0).map(f32::abs));
                let length = n.iter().map(|n| n * n).sum::<f32>().sqrt();
                let surface = Surface {
                    normal: n.map(|n| n / length),
                    albedo: three(2.0).map(f32::abs),
                    direct: three(1.0).map(f32::abs),
                    lit: (round + lane as u32) % 8,
                    ..Surface::default()
                };
                Shading::new(&surface, linear)
            });
            for tone_map in [ToneMap::None, ToneMap::ALL[round as usize % ToneMap::ALL.len()]] {
                let display = &Display::new(0.3).with_tone_map(tone_map);
                let (surfels, shadings, lighting) = (&surfels, &shadings, &lighting);
                wide::run(Compare { surfels, shadings, lighting, display });
            }
        }
    }
}
