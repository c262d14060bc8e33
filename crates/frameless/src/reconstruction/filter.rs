//! Reconstruction `filter`: every pixel is a mean of the held samples around it, weighted by their expected errors.
//!
//! ```text
//! e_j = v · age_j + s · r_j²          expected squared error of sample j, r_j pixels away
//! w_j = 1 / (e_j + ε)²
//! ```
//!
//! with v the learned rate of change of the tile ([`Rates`]) and s its spatial contrast. Where nothing changes (v = 0) that is
//! `hold`, and so it is with a sampler that learns no rates; where samples are old it leans on younger neighbours. The radius follows from where both terms meet, √(v·age/s).

use super::Findings;
use super::contrast::tile_contrast;
use crate::{Canvas, Display, Kept, Rates, Reconstruction, Refresh};

/// See the module.
#[derive(Default)]
pub struct Filter {
    held: Vec<[f32; 3]>,
    picture: Vec<[f32; 3]>,
    contrast: Vec<f32>,
    age_secs: Vec<f32>,
}

/// ε: a squared error of half an 8-bit step.
const LEAST_ERROR: f32 = 1e-4;

impl Reconstruction for Filter {
    fn keep(&mut self, kept: &Kept<'_>, display: &Display, findings: &mut Findings) {
        display.changes(kept.new, kept.old, &mut findings.changes);
    }

    fn refresh(&mut self, refresh: &Refresh<'_>, canvas: &mut Canvas) {
        self.held.clear();
        self.held.extend(canvas.rgb().iter().map(|&rgb| refresh.display.encode(rgb)));
        self.picture.clone_from(&self.held);
        let Some(rates) = refresh.rates else { return };
        tile_contrast(&self.held, &rates.grid, &mut self.contrast);
        self.age_secs.clear();
        self.age_secs.extend(canvas.time().map(|time| refresh.now.secs_since(time) as f32));
        let mut picture = std::mem::take(&mut self.picture);
        for tile in 0..rates.grid.len() {
            self.filter_tile(rates, tile, &mut picture);
        }
        self.picture = picture;
    }

    fn picture(&self) -> &[[f32; 3]] {
        &self.picture
    }
}

impl Filter {
    fn filter_tile(&self, rates: &Rates, tile: usize, picture: &mut [[f32; 3]]) {
        let (rect, size) = (rates.grid.rect(tile), rates.grid.size);
        let (v, s) = (rates.of_tile(tile), self.contrast[tile]);
        let at = |x: u32, y: u32| size.index(x, y) as usize;
        let pixels = || (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| (x, y)));
        let age_sum: f32 = pixels().map(|(x, y)| self.age_secs[at(x, y)]).sum();
        let reach = (v * age_sum / rect.pixels() as f32 / s).sqrt();
        let radius = match reach {
            r if r < 0.35 => return,
            r if r < 1.2 => 1,
            r if r < 2.2 => 2,
            _ => 3,
        };
        for (x, y) in pixels() {
            let (mut sum, mut weights) = ([0.0; 3], 0.0);
            for ny in y.saturating_sub(radius)..(y + radius + 1).min(size.height) {
                for nx in x.saturating_sub(radius)..(x + radius + 1).min(size.width) {
                    let j = at(nx, ny);
                    let (dx, dy) = (nx as f32 - x as f32, ny as f32 - y as f32);
                    let error = v * self.age_secs[j] + s * (dx * dx + dy * dy) + LEAST_ERROR;
                    let weight = 1.0 / (error * error);
                    (0..3).for_each(|k| sum[k] += weight * self.held[j][k]);
                    weights += weight;
                }
            }
            picture[at(x, y)] = sum.map(|c| c / weights);
        }
    }
}
