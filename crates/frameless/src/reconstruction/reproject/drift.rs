//! What slowly becomes lighter or darker goes on so until it is traced again.
//!
//! ```text
//! δ = new − raw                       of a ray traced again at rest, raw: what it was before any drift
//! N ← ρN + δ,  D ← ρD + raw · age,  S ← ρS + δ²        per tile and channel, display-referred
//! r = N/D · max(0, 1 − 4S/N²)         drift per second, relative
//! c ← c (1 + r Δt)                    at every refresh, of what rests
//! ```
//!
//! A lamp that moves, a sun that sets, a colour that fades: neighbours change alike, so that a few of them tell of the others. N²/S is
//! about the number of samples if they agree, 1 if they do not: then there is no drift. Steps (edges of shadows, what moves in
//! a mirror) are left out.

use super::store::{EMPTY, Store};
use crate::{Size, Time};

/// Side of a tile, in pixels.
const TILE: u32 = 16;
/// ρ, as of the learned rates.
const MEMORY: f32 = 0.92;
/// A larger difference in a channel is a step.
const STEP: f32 = 0.08;
/// How many times N² must be more than S before any drift is believed, which four samples that agree are.
const DOUBT: f32 = 4.0;
/// Slower drift (relative, per second) is none: less than a step of 8 bits in a quarter of a second.
const LEAST: f32 = 0.01;
/// Nothing becomes twice as light in less than this, as far as is known.
const FASTEST: f32 = 4.0;

/// N, D, S of the three channels.
#[derive(Clone, Copy, Default)]
struct Tile {
    change: [f32; 3],
    light: [f32; 3],
    square: [f32; 3],
    /// r.
    drift: [f32; 3],
}

/// How the tiles' colours drift.
#[derive(Default)]
pub(super) struct Drift {
    columns: u32,
    tiles: Vec<Tile>,
}

impl Drift {
    /// Forgets everything.
    pub(super) fn fit(&mut self, size: Size) {
        self.columns = size.width.div_ceil(TILE);
        self.tiles.clear();
        self.tiles.resize((self.columns * size.height.div_ceil(TILE)) as usize, Tile::default());
    }

    /// A ray at rest in pixel (x, y) has been traced again, `age_secs` after it showed what has drifted to `before` since.
    #[inline(always)]
    pub(super) fn note(
        &mut self,
        [x, y]: [u32; 2],
        before: [f32; 3],
        now: [f32; 3],
        age_secs: f32,
    ) {
        let tile = &mut self.tiles[(y / TILE * self.columns + x / TILE) as usize];
        if (0..3).any(|k| (now[k] - before[k]).abs() > STEP) {
            return;
        }
        for k in 0..3 {
            let raw = before[k] / (1.0 + tile.drift[k] * age_secs).max(0.5);
            let change = now[k] - raw;
            tile.change[k] = MEMORY * tile.change[k] + change;
            tile.light[k] = MEMORY * tile.light[k] + raw * age_secs;
            tile.square[k] = MEMORY * tile.square[k] + change * change;
        }
    }

    /// At a refresh `interval_secs` after the last: what rests goes on as it has.
    pub(super) fn run(
        &mut self,
        store: &mut Store,
        now: Time,
        interval_secs: f32,
        rests: impl Fn(u32) -> bool,
    ) {
        for (index, tile) in (0..).zip(&mut self.tiles) {
            tile.drift =
                std::array::from_fn(|k| drift(tile.change[k], tile.light[k], tile.square[k]));
            if tile.drift != [0.0; 3] {
                let first = [index % self.columns * TILE, index / self.columns * TILE];
                go_on(store, first, tile.drift, (now, interval_secs), &rests);
            }
        }
    }
}

/// What rests of a tile, as far as it was there.
fn go_on(
    store: &mut Store,
    [x0, y0]: [u32; 2],
    drift: [f32; 3],
    (now, interval_secs): (Time, f32),
    rests: impl Fn(u32) -> bool,
) {
    let Size { width, height } = store.layout.size;
    for y in y0..(y0 + TILE).min(height) {
        for x in x0..(x0 + TILE).min(width) {
            for cell in store.of_pixel(x, y) {
                if store.object[cell] >= EMPTY || !rests(store.object[cell]) {
                    continue;
                }
                let age_secs = now.secs_since(store.tick(cell).time(now)) as f32;
                let secs = age_secs.min(interval_secs);
                let rgb = store.record[cell].rgb();
                let go_on = |k: usize| (rgb[k] * (1.0 + drift[k] * secs)).clamp(0.0, 1.0);
                store.record[cell].set_rgb(std::array::from_fn(go_on));
                store.touched.mark(x, y);
            }
        }
    }
}

fn drift(change: f32, light: f32, square: f32) -> f32 {
    let agreement = (1.0 - DOUBT * square / (change * change)).max(0.0);
    let drift = change / light * agreement;
    // Nothing is known of black.
    if drift.is_finite() && drift.abs() > LEAST { drift.clamp(-FASTEST, FASTEST) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::store::{Record, Sample, Tick};
    use super::*;

    const SIZE: Size = Size { width: 16, height: 16 };

    /// A floor of two colours, all traced at time 0.
    fn floor() -> Store {
        let mut store = Store::new(SIZE, 1, false);
        for (y, x) in (0..16).flat_map(|y| (0..16).map(move |x| (y, x))) {
            let mut sample = Sample::at([x as f32 + 0.5, y as f32 + 0.5], 1.0, 0);
            sample.record.set_rgb(colour(x, 1.0));
            store.insert(&sample, false);
        }
        store
    }

    fn colour(x: u32, light: f32) -> [f32; 3] {
        [0.6, 0.3, 0.1].map(|c| light * if x.is_multiple_of(2) { c } else { 0.5 * c })
    }

    /// Refreshes at 60 Hz for half a second, of which a few pixels are traced again in each; the light is a function of time. Returns how
    /// far the reddest pixel is off at the end.
    fn off_after(light: impl Fn(f32, u32) -> f32) -> f32 {
        let (mut store, mut drift) = (floor(), Drift::default());
        drift.fit(SIZE);
        for refresh in 1..31u32 {
            let secs = refresh as f32 / 60.0;
            let now = Time::from_secs(f64::from(secs));
            for x in (0..4).map(|i| (5 * refresh + 7 * i) % 15) {
                let (y, cell) =
                    (refresh % 16, store.layout.of_pixel(x as i32, (refresh % 16) as i32));
                let before = store.record[cell].rgb();
                let age_secs = now.secs_since(store.tick(cell).time(now)) as f32;
                let new = colour(x, light(secs, x));
                drift.note([x, y], before, new, age_secs);
                store.record[cell].set_rgb(new);
                store.record[cell].0[2] = f32::from_bits(Tick::of(now).0);
            }
            drift.run(&mut store, now, 1.0 / 60.0, |_| true);
        }
        // The last row is traced once, in the beginning at the latest.
        (0..16)
            .map(|x| {
                let cell = store.layout.of_pixel(x, 15);
                (store.record[cell].rgb()[0] - colour(x as u32, light(0.5, 15))[0]).abs()
            })
            .fold(0.0, f32::max)
    }

    #[test]
    fn what_fades_fades_on_where_nobody_looks() {
        let off = off_after(|secs, _| 1.0 - 0.4 * secs);
        assert!(off < 0.06, "{off}, without drift 0.12");
    }

    #[test]
    fn what_stays_stays_bit_for_bit() {
        assert_eq!(off_after(|_, _| 1.0), 0.0);
    }

    #[test]
    fn those_who_disagree_let_nothing_drift() {
        let off = off_after(|secs, x| if x % 4 < 2 { 1.0 - 0.1 * secs } else { 1.0 + 0.1 * secs });
        assert!(off < 0.07, "{off}");
    }

    #[test]
    fn steps_are_no_drift() {
        let mut drift = Drift::default();
        drift.fit(SIZE);
        for _ in 0..20 {
            drift.note([3, 3], [0.5; 3], [0.4; 3], 0.1);
        }
        let mut store = floor();
        drift.run(&mut store, Time::from_secs(1.0), 0.1, |_| true);
        let colours = |store: &Store| store.record.iter().map(Record::rgb).collect::<Vec<_>>();
        assert!(colours(&store) == colours(&floor()));
    }
}
