//! Stored surfaces, shaded again with the present lights.
//!
//! ```text
//! colour now = (colour then − direct then) + albedo / π · Σ_i lit_i · E_i · max(0, n · l_i)
//! ```
//!
//! What the object emits and reflects, and ambient light, stay as they were until the pixel is traced again; so do shadows.

use super::store::{EMPTY, Sample, Shade, Store};
use crate::{Display, Light, Lighting, Surface, bands};

/// The lights under which the stored samples are shown.
#[derive(Default)]
pub(super) struct Relight {
    shown: Lighting,
    /// Bit i: light i stood elsewhere at the refresh before.
    moved: u32,
    /// Objects that look different under the new lights, or stand differently in them.
    changed: Vec<bool>,
    any_changed: bool,
}

impl Shade {
    /// Linear colour of a surface under `lighting`; `None` if its object cannot be shaded again.
    fn relit(&self, surface: &Surface, lighting: &Lighting) -> Option<[f32; 3]> {
        let surface = Surface {
            normal: self.normal.unpack(),
            albedo: self.albedo.unpack(),
            lit: self.lit,
            ..*surface
        };
        let direct = lighting.direct(&surface)?;
        Some(std::array::from_fn(|k| (self.rgb[k] - self.direct[k] + direct[k]).max(0.0)))
    }
}

impl Relight {
    /// What the sample would have looked like at the last refresh, as far as lights are concerned. Display-referred. What looked
    /// alike at the last two refreshes is thought to look so still.
    pub(super) fn as_shown(&self, sample: &Sample, display: &Display) -> [f32; 3] {
        if !self.has_changed(sample.object) {
            return sample.rgb;
        }
        let relit = sample.shade.relit(&sample.surface(), &self.shown);
        relit.map_or(sample.rgb, |rgb| display.encode(rgb))
    }

    /// Linear colour of the sample in a cell as it is shown.
    pub(super) fn linear(&self, store: &Store, cell: usize) -> [f32; 3] {
        let shade = store.shade(cell);
        shade.relit(&store.surface(cell), &self.shown).unwrap_or(shade.rgb)
    }

    /// Whether any object's samples were shaded again at the last refresh.
    pub(super) fn has_changed_any(&self) -> bool {
        self.any_changed
    }

    /// Whether an object's samples were shaded again at the last refresh.
    pub(super) fn has_changed(&self, object: u32) -> bool {
        self.changed.get(object as usize).is_some_and(|&changed| changed)
    }

    /// Shows all samples of objects for which something has changed under the new lights.
    pub(super) fn run(
        &mut self,
        store: &mut Store,
        lighting: &Lighting,
        display: &Display,
        threads: usize,
    ) {
        self.moved = moved(&lighting.lights, &self.shown.lights);
        let everything = lighting.lights != self.shown.lights;
        let then = &self.shown.world_from_object;
        let placements = lighting.world_from_object.iter().enumerate();
        self.changed.clear();
        self.changed.extend(
            placements.map(|(object, place)| everything || then.get(object) != Some(place)),
        );
        self.any_changed = self.changed.contains(&true);
        if self.any_changed {
            self.shown.clone_from(lighting);
            self.shade(store, display, threads);
        }
    }

    /// Bit i: light i stood elsewhere at the refresh before.
    pub(super) fn moved(&self) -> u32 {
        self.moved
    }

    fn shade(&self, store: &mut Store, display: &Display, threads: usize) {
        let band = store.layout.len().div_ceil(bands::PER_THREAD * threads);
        let mut colours = std::mem::take(&mut store.rgb);
        let [red, green, blue] = colours.each_mut().map(|plane| plane.chunks_mut(band));
        let chunks = red.zip(green).zip(blue).map(|((red, green), blue)| [red, green, blue]);
        let shaded = &*store;
        bands::run(threads, chunks.enumerate().collect(), |(nth, rgb)| {
            self.shade_cells(shaded, nth * band, rgb, display);
        });
        store.rgb = colours;
    }

    /// The cells from `first` on, whose display-referred colours are `rgb`.
    fn shade_cells(&self, store: &Store, first: usize, rgb: [&mut [f32]; 3], display: &Display) {
        let mut before = (EMPTY, false);
        for at in 0..rgb[0].len() {
            let cell = first + at;
            let object = store.object[cell];
            // Neighbours are mostly of the same object.
            if object != before.0 {
                before = (object, self.has_changed(object));
            }
            if !before.1 {
                continue;
            }
            if let Some(linear) = store.shade(cell).relit(&store.surface(cell), &self.shown) {
                let encoded = display.encode(linear);
                (0..3).for_each(|k| rgb[k][at] = encoded[k]);
            }
        }
    }
}

/// Bit i: light i is on and does not stand where it stood.
fn moved(now: &[Light], before: &[Light]) -> u32 {
    let place = |light: &Light| (light.position, light.backwards);
    let lights = now.iter().zip(before).take(32).enumerate();
    let moved = lights
        .filter(|(_, (now, before))| now.intensity != [0.0; 3] && place(now) != place(before));
    moved.fold(0, |bits, (i, _)| bits | 1 << i)
}
