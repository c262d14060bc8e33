//! Stored surfaces, shaded again with the present lights.
//!
//! ```text
//! colour now = (colour then − direct then) + albedo / π · Σ_i lit_i · E_i · max(0, n · l_i)
//! ```
//!
//! What the object emits and reflects, and ambient light, stay as they were until the pixel is traced again; so do shadows.

use super::shade;
use super::store::{EMPTY, Layout, Record, Sample, Shading, Store, Surfel};
use crate::wide::{self, M8, Unit};
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

/// Linear colour of a sample under `lighting`; `None` if its object cannot be shaded again.
pub(super) fn relit(
    object: u32,
    surfel: &Surfel,
    shading: &Shading,
    lighting: &Lighting,
) -> Option<[f32; 3]> {
    let (indirect, direct) = (shading.indirect(), direct(object, surfel, shading, lighting)?);
    let now = |k: usize| indirect[k] + direct[k];
    // Not `max`, which may say −0.
    Some(std::array::from_fn(|k| if now(k) > 0.0 { now(k) } else { 0.0 }))
}

/// The part of that which comes from the lights.
fn direct(
    object: u32,
    surfel: &Surfel,
    shading: &Shading,
    lighting: &Lighting,
) -> Option<[f32; 3]> {
    lighting.direct(&Surface {
        object,
        position: surfel.position(),
        normal: shading.normal().unpack(),
        albedo: shading.albedo().unpack(),
        lit: shading.lit(),
        ..Surface::default()
    })
}

impl Relight {
    /// What the sample would have looked like at the last refresh, as far as lights are concerned. Display-referred. What looked
    /// alike at the last two refreshes is thought to look so still.
    pub(super) fn as_shown(&self, sample: &Sample, display: &Display) -> [f32; 3] {
        if !self.has_changed(sample.object) {
            return sample.record.rgb();
        }
        let Sample { object, record, surfel, shading, .. } = sample;
        relit(*object, surfel, shading, &self.shown).map_or(record.rgb(), |rgb| display.encode(rgb))
    }

    /// Linear colour of the sample in a cell as it is shown.
    pub(super) fn linear(&self, store: &Store, cell: usize) -> [f32; 3] {
        let (object, surfel) = (store.object[cell], &store.surfel[cell]);
        let relit = |shading| relit(object, surfel, shading, &self.shown);
        store.shading.get(cell).and_then(relit).unwrap_or_else(|| surfel.linear())
    }

    /// Gives the sample in a cell another linear colour, which it has under the lights of the last refresh.
    pub(super) fn recolour(
        &self,
        store: &mut Store,
        cell: usize,
        rgb: [f32; 3],
        display: &Display,
    ) {
        store.touch(cell);
        store.record[cell].set_rgb(display.encode(rgb));
        let (object, surfel) = (store.object[cell], &mut store.surfel[cell]);
        *surfel = Surfel::new(surfel.position(), rgb);
        if let Some(shading) = store.shading.get_mut(cell) {
            let direct = direct(object, surfel, shading, &self.shown).unwrap_or_default();
            shading.set_indirect(std::array::from_fn(|k| rgb[k] - direct[k]));
        }
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
        let stride = store.layout.stride;
        let band = (store.layout.len() / stride).div_ceil(bands::PER_THREAD * threads) * stride;
        let mut records = std::mem::take(&mut store.record);
        let shaded = &*store;
        let bands = records.chunks_mut(band).enumerate();
        let bands = bands.map(|(nth, records)| Shade {
            relight: self,
            store: shaded,
            display,
            first: nth * band,
            records,
        });
        bands::run(threads, bands.collect(), wide::run);
        store.record = records;
    }
}

/// Shades the samples of some rows of cells, whose records are apart.
struct Shade<'a> {
    relight: &'a Relight,
    store: &'a Store,
    display: &'a Display,
    /// The first of the cells.
    first: usize,
    records: &'a mut [Record],
}

impl wide::Task for Shade<'_> {
    #[inline(always)]
    fn run<U: Unit>(mut self) {
        let stride = self.store.layout.stride;
        for row in 0..self.records.len() / stride {
            for column in (0..stride).step_by(8) {
                let start = row * stride + column;
                if self.eight::<U>(start) {
                    self.touch(self.first + start);
                }
            }
        }
    }
}

impl Shade<'_> {
    /// Eight cells from the one with the record `start` on. Returns whether any has been shaded.
    #[inline(always)]
    fn eight<U: Unit>(&mut self, start: usize) -> bool {
        let Shade { relight, store, display, first, .. } = *self;
        let cells = first + start..first + start + 8;
        let objects = M8::<U>::load(&store.object, first + start);
        let mut waiting = objects.equals(M8::splat(EMPTY)).not();
        let mut any = false;
        while let Some(lane) = waiting.first() {
            let object = store.object[first + start + lane];
            let same = objects.equals(M8::splat(object));
            waiting = waiting.and(same.not());
            let place = relight.shown.world_from_object.get(object as usize).copied().flatten();
            let Some(place) = place.filter(|_| relight.has_changed(object)) else { continue };
            let (surfels, _) = store.surfel[cells.clone()].as_chunks::<8>();
            let (shadings, _) = store.shading[cells.clone()].as_chunks::<8>();
            let eight = shade::Eight::<U>::new(&surfels[0], &shadings[0]);
            let linear = eight.relit(&place, &relight.shown.lights);
            let [r, g, b] = display.encode_eight(linear);
            let [r, g, b] = [r.lanes(), g.lanes(), b.lanes()];
            let records = &mut self.records[start..start + 8];
            same.for_each(|lane| records[lane].set_rgb([r[lane], g[lane], b[lane]]));
            any = true;
        }
        any
    }

    /// The eight cells from `cell` on have been shaded. Their pixels begin one to the left of a tile.
    fn touch(&self, cell: usize) {
        let Layout { size, stride, .. } = self.store.layout;
        let in_plane = self.store.layout.in_plane(cell);
        // Samples are inside the picture; one row and one column of the border lie before it.
        let (x, y) = ((in_plane % stride) as u32, (in_plane / stride) as u32 - 1);
        self.store.touched.mark(x.saturating_sub(1), y);
        self.store.touched.mark(x.min(size.width - 1), y);
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
