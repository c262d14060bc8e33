//! An environment as light: what comes from a direction, how a direction is drawn, and what a matte surface sends back of all of it.
//!
//! ```text
//! column = (atan2(z, x) + rotation) / 2π + ½          row = acos(y) / π                          latitude and longitude
//! p(texel) ∝ (mean luminance of the texel and the eight around it) · (solid angle of its row)
//! p(ω) = p(texel) / solid angle of the texel
//! E(n) = Σ_lm A_l L_lm Y_lm(n)       A = π, 2π/3, π/4        (Ramamoorthi and Hanrahan 2001, "An Efficient Representation for
//!                                                             Irradiance Environment Maps")
//! ```
//!
//! Radiance is interpolated between the centres of texels; the density is constant over each of them. The neighbours are in the mean so
//! that a texel beside a bright one, into which that one reaches, is not drawn too seldom.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use frameless_scene::Environment;
use glam::{DVec3, Vec3, Vec3A};
use rayon::prelude::*;

/// Coefficients of spherical harmonics up to order 2.
const HARMONICS: usize = 9;

/// An [`Environment`] prepared for tracing.
pub(crate) struct Surroundings {
    environment: Environment,
    /// Probability of the rows up to and with each; the last is 1.
    rows: Vec<f32>,
    /// Within each row: of the columns up to and with each.
    columns: Vec<f32>,
    irradiance: [Vec3A; HARMONICS],
}

/// Light from a direction that was drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FromAfar {
    /// Unit length, world coordinates.
    pub(crate) direction: Vec3A,
    /// Linear RGB.
    pub(crate) radiance: Vec3A,
    /// Per solid angle; positive.
    pub(crate) density: f32,
}

impl Surroundings {
    pub(crate) fn new(environment: &Environment) -> Surroundings {
        let (width, height) = (environment.width as usize, environment.height as usize);
        let mut columns = vec![0.0; width * height];
        let weights = columns.par_chunks_mut(width).enumerate().map(|(row, columns)| {
            cumulate(&weights(environment, row), columns) * f64::from(band(row, height))
        });
        let weights: Vec<f64> = weights.collect();
        let mut rows = vec![0.0; height];
        cumulate(&weights, &mut rows);
        let irradiance = project(environment);
        Surroundings { environment: environment.clone(), rows, columns, irradiance }
    }

    /// From a direction of unit length.
    pub(crate) fn radiance(&self, direction: Vec3A) -> Vec3A {
        let [u, v] = self.place(direction);
        let (x, y) = (u * self.width() - 0.5, v * self.height() - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (i, j) = (left as i64, top as i64);
        let above = self.texel(i, j).lerp(self.texel(i + 1, j), x - left);
        let below = self.texel(i, j + 1).lerp(self.texel(i + 1, j + 1), x - left);
        self.environment.strength * above.lerp(below, y - top)
    }

    /// E of a surface with this normal, of unit length; at least 0.
    pub(crate) fn irradiance(&self, normal: Vec3A) -> Vec3A {
        let [x, y, z] = self.turned(normal).to_array();
        let parts = harmonics([x, y, z]).into_iter().zip(self.irradiance);
        let sum: Vec3A = parts.map(|(value, coefficient)| value * coefficient).sum();
        self.environment.strength * sum.max(Vec3A::ZERO)
    }

    /// Light by two random numbers in [0, 1); `None` if there is none at all.
    pub(crate) fn sample(&self, [s, t]: [f32; 2]) -> Option<FromAfar> {
        let (row, v) = draw(&self.rows, t)?;
        let (column, u) = draw(self.row(row), s)?;
        let (u, v) = ((column as f32 + u) / self.width(), (row as f32 + v) / self.height());
        let (sin, cos) = (PI * v).sin_cos();
        let phi = TAU * (u - 0.5) - self.environment.rotation_rad;
        let direction = Vec3A::new(sin * phi.cos(), cos, sin * phi.sin());
        let density = self.density_of(column, row);
        let light = FromAfar { direction, radiance: self.radiance(direction), density };
        (density > 0.0 && density.is_finite()).then_some(light)
    }

    /// With which [`Surroundings::sample`] finds a direction of unit length, per solid angle.
    pub(crate) fn density(&self, direction: Vec3A) -> f32 {
        let [u, v] = self.place(direction);
        let column = ((u * self.width()) as usize).min(self.environment.width as usize - 1);
        let row = ((v * self.height()) as usize).min(self.environment.height as usize - 1);
        self.density_of(column, row)
    }

    fn density_of(&self, column: usize, row: usize) -> f32 {
        let part = |cumulated: &[f32], k: usize| match k {
            0 => cumulated[0],
            k => cumulated[k] - cumulated[k - 1],
        };
        let probability = part(&self.rows, row) * part(self.row(row), column);
        let texel = band(row, self.environment.height as usize) * TAU / self.width();
        probability / texel
    }

    fn row(&self, row: usize) -> &[f32] {
        let width = self.environment.width as usize;
        &self.columns[row * width..][..width]
    }

    /// Where a direction is in the picture, in [0, 1].
    fn place(&self, direction: Vec3A) -> [f32; 2] {
        let azimuth = direction.z.atan2(direction.x) + self.environment.rotation_rad;
        let u = azimuth / TAU + 0.5;
        [u - u.floor(), direction.y.clamp(-1.0, 1.0).acos() * FRAC_1_PI]
    }

    /// A direction in the coordinates of the picture, as it is before it is turned.
    fn turned(&self, direction: Vec3A) -> Vec3A {
        let (sin, cos) = self.environment.rotation_rad.sin_cos();
        let Vec3 { x, y, z } = direction.into();
        Vec3A::new(cos * x - sin * z, y, sin * x + cos * z)
    }

    /// Columns wrap around; rows end at the poles.
    fn texel(&self, column: i64, row: i64) -> Vec3A {
        texel(&self.environment, column, row)
    }

    fn width(&self) -> f32 {
        self.environment.width as f32
    }

    fn height(&self) -> f32 {
        self.environment.height as f32
    }
}

fn texel(environment: &Environment, column: i64, row: i64) -> Vec3A {
    let (width, height) = (i64::from(environment.width), i64::from(environment.height));
    let place = row.clamp(0, height - 1) * width + column.rem_euclid(width);
    environment.texels.at(place as usize).into()
}

/// Solid angle of a row over that of a lune of the same width: cosθ above minus cosθ below.
fn band(row: usize, height: usize) -> f32 {
    let cos = |row: usize| (std::f64::consts::PI * row as f64 / height as f64).cos();
    (cos(row) - cos(row + 1)) as f32
}

/// Mean luminance around each texel of a row.
fn weights(environment: &Environment, row: usize) -> Vec<f64> {
    const LUMINANCE: Vec3A = Vec3A::new(0.2126, 0.7152, 0.0722);
    let width = environment.width as usize;
    let around = [-1, 0, 1].map(|j| -> Vec<f64> {
        let texels = (0..width).map(|column| texel(environment, column as i64, row as i64 + j));
        texels.map(|texel| f64::from(texel.dot(LUMINANCE)) / 9.0).collect()
    });
    let weights = (0..width).map(|column| {
        let columns = [(column + width - 1) % width, column, (column + 1) % width];
        around.iter().flat_map(|row| columns.map(|column| row[column])).sum()
    });
    weights.collect()
}

/// Fills in the sums so far over the sum of all, and returns that. Evenly, if it is 0.
fn cumulate(weights: &[f64], cumulated: &mut [f32]) -> f64 {
    let (total, count): (f64, _) = (weights.iter().sum(), weights.len() as f64);
    let mut sum = 0.0;
    for (k, (&weight, cumulated)) in weights.iter().zip(&mut *cumulated).enumerate() {
        sum += weight;
        let part = if total > 0.0 { sum / total } else { (k + 1) as f64 / count };
        *cumulated = part as f32;
    }
    if let Some(last) = cumulated.last_mut() {
        *last = 1.0;
    }
    total
}

/// The entry in which a number in [0, 1) falls, and where in it, in [0, 1).
fn draw(cumulated: &[f32], number: f32) -> Option<(usize, f32)> {
    let entry = cumulated.partition_point(|&up_to| up_to <= number).min(cumulated.len() - 1);
    let before = if entry == 0 { 0.0 } else { cumulated[entry - 1] };
    let part = cumulated[entry] - before;
    (part > 0.0).then(|| (entry, ((number - before) / part).clamp(0.0, 1.0)))
}

/// L_lm · A_l, by every texel once.
fn project(environment: &Environment) -> [Vec3A; HARMONICS] {
    let (width, height) = (environment.width as usize, environment.height as usize);
    let mut sums = [DVec3::ZERO; HARMONICS];
    let azimuths = (0..width).map(|column| {
        let phi = std::f64::consts::TAU * ((column as f64 + 0.5) / width as f64 - 0.5);
        [phi.cos(), phi.sin()]
    });
    let azimuths: Vec<[f64; 2]> = azimuths.collect();
    for row in 0..height {
        let theta = std::f64::consts::PI * (row as f64 + 0.5) / height as f64;
        let (sin, cos) = (theta.sin(), theta.cos());
        let solid_angle = f64::from(band(row, height)) * std::f64::consts::TAU / width as f64;
        for (column, [x, z]) in azimuths.iter().enumerate() {
            let direction = [sin * x, cos, sin * z];
            let light = texel(environment, column as i64, row as i64);
            let light = Vec3::from(light).as_dvec3() * solid_angle;
            for (sum, value) in sums.iter_mut().zip(harmonics(direction.map(|c| c as f32))) {
                *sum += light * f64::from(value);
            }
        }
    }
    let bands = [PI, 2.0 * PI / 3.0, 2.0 * PI / 3.0, 2.0 * PI / 3.0];
    std::array::from_fn(|k| {
        let factor = bands.get(k).copied().unwrap_or(PI / 4.0);
        Vec3A::from(sums[k].as_vec3()) * factor
    })
}

/// Y₀₀, Y₁₋₁, Y₁₀, Y₁₁, Y₂₋₂, Y₂₋₁, Y₂₀, Y₂₁, Y₂₂ of a direction.
fn harmonics([x, y, z]: [f32; 3]) -> [f32; HARMONICS] {
    [
        0.282_094_8,
        0.488_602_5 * y,
        0.488_602_5 * z,
        0.488_602_5 * x,
        1.092_548_4 * x * y,
        1.092_548_4 * y * z,
        0.315_391_57 * (3.0 * z * z - 1.0),
        1.092_548_4 * x * z,
        0.546_274_2 * (x * x - y * y),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use frameless::Rng;
    use frameless_scene::Texels;
    use std::sync::Arc;

    fn environment(width: u32, height: u32, texel: impl Fn(u32, u32) -> f32) -> Environment {
        let texels = (0..width * height).map(|i| [texel(i % width, i / width); 3]).collect();
        Environment {
            name: String::new(),
            width,
            height,
            texels: Arc::new(Texels::Linear(texels)),
            rotation_rad: 0.0,
            strength: 1.0,
        }
    }

    fn uneven(rotation_rad: f32) -> Surroundings {
        let mut rng = Rng::new(5);
        let numbers: Vec<f32> = (0..128).map(|_| rng.unit_f32().powi(6)).collect();
        let environment = environment(16, 8, |x, y| numbers[(16 * y + x) as usize]);
        Surroundings::new(&Environment { rotation_rad, strength: 2.5, ..environment })
    }

    /// Directions that stand for the same solid angle each.
    fn sphere(per_side: u32) -> impl Iterator<Item = Vec3A> {
        let at = move |i: u32| (i as f32 + 0.5) / per_side as f32;
        (0..per_side * per_side).map(move |i| {
            let (y, phi) = (2.0 * at(i % per_side) - 1.0, TAU * at(i / per_side));
            let sin = (1.0 - y * y).sqrt();
            Vec3A::new(sin * phi.cos(), y, sin * phi.sin())
        })
    }

    #[test]
    fn densities_add_up_to_one_and_are_those_of_the_samples() {
        for rotation in [0.0, 1.0, -7.0] {
            let surroundings = uneven(rotation);
            let sum: f64 = sphere(700).map(|w| f64::from(surroundings.density(w))).sum();
            let integral = sum * 4.0 * std::f64::consts::PI / (700.0 * 700.0);
            assert!((integral - 1.0).abs() < 0.01, "{integral}");
            let mut rng = Rng::new(1);
            let mut apart = 0;
            for _ in 0..10_000 {
                let light = surroundings.sample([rng.unit_f32(), rng.unit_f32()]).unwrap();
                let density = surroundings.density(light.direction);
                // On the line between two texels rounding decides.
                apart += u32::from((density - light.density).abs() > 1e-3 * density);
                assert!((light.direction.length() - 1.0).abs() < 1e-5);
            }
            assert!(apart < 20, "{apart}");
        }
    }

    #[test]
    fn what_is_drawn_adds_up_to_all_there_is() {
        let surroundings = uneven(0.5);
        let all: Vec3A = sphere(700).map(|w| surroundings.radiance(w)).sum();
        let integral = all.x * 4.0 * PI / (700.0 * 700.0);
        let mut rng = Rng::new(2);
        const SAMPLES: u32 = 100_000;
        let mean = (0..SAMPLES)
            .filter_map(|_| surroundings.sample([rng.unit_f32(), rng.unit_f32()]))
            .map(|light| f64::from(light.radiance.x / light.density))
            .sum::<f64>()
            / f64::from(SAMPLES);
        assert!((mean / f64::from(integral) - 1.0).abs() < 0.02, "{mean} {integral}");
    }

    /// The exact irradiance, by adding up, against nine numbers. Of light from half of all directions nine are off by a few percent.
    #[test]
    fn nine_numbers_tell_irradiance() {
        let even = Surroundings::new(&environment(64, 32, |_, _| 0.5));
        for normal in sphere(5) {
            assert!((even.irradiance(normal).x - 0.5 * PI).abs() < 2e-3);
        }
        let above = Surroundings::new(&environment(64, 32, |_, y| f32::from(u8::from(y < 16))));
        for normal in [Vec3A::Y, Vec3A::X, Vec3A::Z, -Vec3A::Y, Vec3A::new(0.6, 0.8, 0.0)] {
            // Half the sky above the horizon, tilted: π (1 + cosθ) / 2.
            let exact = PI * (1.0 + normal.y) / 2.0;
            let came = above.irradiance(normal).x;
            assert!((came - exact).abs() < 0.06 * PI, "{normal}: {came} {exact}");
        }
    }

    #[test]
    fn turning_takes_z_to_x() {
        // Bright along +z: a quarter beyond the middle column.
        let light = environment(8, 4, |x, _| f32::from(u8::from(x == 6)));
        let still = Surroundings::new(&light);
        let quarter = Environment { rotation_rad: PI / 2.0, ..light };
        let turned = Surroundings::new(&quarter);
        let towards = |x: f32, z: f32| Vec3A::new(x, 0.01, z).normalize();
        assert!(still.radiance(towards(-0.3, 1.0)).x > still.radiance(towards(1.0, 0.3)).x);
        assert!(turned.radiance(towards(1.0, 0.3)).x > turned.radiance(towards(-0.3, 1.0)).x);
        assert!(turned.irradiance(Vec3A::X).x > turned.irradiance(Vec3A::Z).x);
    }

    #[test]
    fn a_black_picture_gives_no_light_and_no_trouble() {
        for (width, height) in [(1, 1), (3, 1), (1, 5)] {
            for value in [0.0, 1.0, 1e30] {
                let surroundings = Surroundings::new(&environment(width, height, |_, _| value));
                for direction in sphere(4).chain([Vec3A::ZERO]) {
                    assert!(surroundings.radiance(direction).is_finite());
                    assert!(surroundings.density(direction).is_finite());
                }
                for number in [0.0, 0.5, 0.999_999_9] {
                    let light = surroundings.sample([number, number]);
                    assert!(light.is_none_or(|light| light.direction.is_finite()));
                }
            }
        }
    }
}
