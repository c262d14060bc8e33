//! Light that upright fibres scatter back at grazing angles, as on velvet (KHR_materials_sheen).
//!
//! ```text
//! D = (2 + 1/α) sin^(1/α) θ_h / 2π          α = roughness²       Estevez and Kulla 2017, "Production Friendly Microfacet Sheen BRDF"
//! V = 1 / 4(n·ωₒ + n·ωᵢ − (n·ωₒ)(n·ωᵢ))                           Neubelt and Pettineo 2013, "Crafting a Next-Gen Material Pipeline"
//! E(cosθ, roughness) = ∫ D V cosθᵢ dωᵢ                            what white fibres send back
//! what is below shows min(1 − max(sheen) E(θₒ), 1 − max(sheen) E(θᵢ)) of itself
//! ```
//!
//! E is added up once into a table. Differs from the extension: where E would be above 1 the fibres scatter less, so that no light is made.

use std::f32::consts::{PI, TAU};
use std::sync::LazyLock;

use glam::Vec3A;

/// Cells of the table along either axis.
const CELLS: usize = 32;
/// Below it fibres are finer than single precision.
const SMOOTHEST: f32 = 0.07;

/// By roughness, then by cosine. What is above 1 is what D V has to be divided by.
static TABLE: LazyLock<Vec<[f32; CELLS]>> = LazyLock::new(|| {
    let row = |row| std::array::from_fn(|column| integral(at(column), at(row)));
    (0..CELLS).map(row).collect()
});

fn at(cell: usize) -> f32 {
    (cell as f32 + 0.5) / CELLS as f32
}

/// ∫ D V cosθᵢ over the hemisphere, by 64 × 64 directions.
fn integral(cos: f32, roughness: f32) -> f32 {
    const STEPS: u32 = 64;
    let to_eye = Vec3A::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    let part = |k: u32| (k as f32 + 0.5) / STEPS as f32;
    let directions = (0..STEPS * STEPS).map(|k| {
        let (cos, phi) = (part(k % STEPS), PI * part(k / STEPS));
        let sin = (1.0 - cos * cos).sqrt();
        Vec3A::new(sin * phi.cos(), sin * phi.sin(), cos)
    });
    let sent = |to_light: Vec3A| {
        let half = (to_eye + to_light).normalize_or(Vec3A::Z);
        raw([to_eye.z, to_light.z], half.z, roughness) * to_light.z
    };
    let sum: f32 = directions.map(sent).sum();
    sum * TAU / (STEPS * STEPS) as f32
}

/// D V; o, i, h: cosines to the normal of both directions and of the one between them.
fn raw([o, i]: [f32; 2], h: f32, roughness: f32) -> f32 {
    let roughness = roughness.clamp(SMOOTHEST, 1.0);
    let sharpness = 1.0 / (roughness * roughness);
    let sin = (1.0 - h * h).max(0.0).sqrt();
    let fibres = (2.0 + sharpness) * sin.powf(sharpness) / TAU;
    fibres / (4.0 * (o + i - o * i)).max(1e-4)
}

/// Interpolated in the table.
fn looked_up(cos: f32, roughness: f32) -> f32 {
    let place = |x: f32| {
        let x = (x.clamp(0.0, 1.0) * CELLS as f32 - 0.5).clamp(0.0, (CELLS - 1) as f32);
        let cell = (x as usize).min(CELLS - 2);
        (cell, x - cell as f32)
    };
    let ((column, x), (row, y)) = (place(cos), place(roughness));
    let along = |row: usize| {
        let [a, b] = [TABLE[row][column], TABLE[row][column + 1]];
        a + x * (b - a)
    };
    along(row) + y * (along(row + 1) - along(row))
}

/// E, in [0, 1].
pub(crate) fn albedo(cos: f32, roughness: f32) -> f32 {
    looked_up(cos, roughness).clamp(0.0, 1.0)
}

/// f of white fibres; o, i, h: cosines to the normal of both directions, which are above the surface, and of the one between them.
pub(crate) fn value([o, i]: [f32; 2], h: f32, roughness: f32) -> f32 {
    let most = looked_up(o, roughness).max(looked_up(i, roughness));
    raw([o, i], h, roughness) / most.max(1.0)
}
