//! Reconstruction `reproject`: samples remember the surface that they hit, and move with it.
//!
//! At every refresh all samples are carried to where their surfaces are then ([`warp`]), and the picture is gathered from
//! those of the same object around each pixel ([`gather`]). Pixels that nothing was carried to are holes. Between
//! refreshes, new samples are compared with what the picture showed of their surfaces ([`residual`]), and aimed so that they
//! land on pixel centres at the next refresh ([`aim`]).

mod aim;
mod fill;
mod gather;
mod holes;
mod residual;
mod store;
mod warp;

use super::ReprojectOptions;
use super::contrast::tile_contrast;
use crate::rates::Rates;
use crate::tile::TileGrid;
use crate::{Canvas, Display, Kept, Pose, Reconstruction, Refresh, Request, Size, Time};
use store::{Store, Tick};

/// See the module.
pub struct Reproject {
    options: ReprojectOptions,
    /// Cells per pixel side.
    cells: u32,
    store: Store,
    warp: warp::Warp,
    gather: gather::Gather,
    /// The picture of the last refresh, and what is needed to find a surface in it.
    shown: Vec<[f32; 3]>,
    shown_at: Time,
    /// Where everything was at the last refresh, and at the one before.
    poses: [Pose; 2],
    /// Seconds between these two.
    interval_secs: f32,
    refreshes: u64,
    contrast: Vec<f32>,
    holes: Vec<u32>,
    no_rates: Option<Rates>,
}

impl Reproject {
    /// Nothing kept yet.
    pub fn new(options: ReprojectOptions) -> Reproject {
        let cells = if options.deep { 2 } else { 1 };
        Reproject {
            options,
            cells,
            store: Store::new(Size::new(1, 1), cells),
            warp: Default::default(),
            gather: Default::default(),
            shown: Vec::new(),
            shown_at: Time::ZERO,
            poses: Default::default(),
            interval_secs: 0.0,
            refreshes: 0,
            contrast: Vec::new(),
            holes: Vec::new(),
            no_rates: None,
        }
    }

    fn fit(&mut self, size: Size) {
        if self.store.layout.size != size {
            self.store = Store::new(size, self.cells);
            self.refreshes = 0;
            self.shown.clear();
            self.no_rates = None;
        }
    }
}

impl Reconstruction for Reproject {
    fn keep(&mut self, kept: &Kept<'_>, display: &Display, changes: &mut Vec<f32>) {
        self.fit(kept.size);
        for i in 0..kept.requests.len() {
            let mut sample = store::Sample::new(kept, i, display);
            let found = self.residual(&sample, display.encode(kept.old[i]));
            sample.depth = found.depth;
            self.store.insert(&sample, found.outdated);
            changes.push(found.change);
        }
    }

    fn aim(&self, now: Time, canvas: &Canvas, requests: &mut [Request]) {
        if self.refreshes >= 2 && self.store.layout.size == canvas.size() {
            for request in requests {
                self.aim_one(now, request);
            }
        }
    }

    fn refresh(&mut self, refresh: &Refresh<'_>, canvas: &mut Canvas, picture: &mut Vec<[f32; 3]>) {
        let size = canvas.size();
        self.fit(size);
        self.poses.swap(0, 1);
        match refresh.pose {
            Some(pose) => self.poses[0].clone_from(pose),
            None => self.poses[0] = Pose::default(),
        }
        self.interval_secs = refresh.now.secs_since(self.shown_at) as f32;
        self.refreshes += 1;
        self.shown_at = refresh.now;
        let at_rest = self.refreshes >= 2 && self.poses[0] == self.poses[1];
        if !at_rest {
            self.warp.run(&mut self.store, &self.poses[0]);
        }
        let rates = refresh.rates.unwrap_or_else(|| {
            self.no_rates.get_or_insert_with(|| Rates::new(TileGrid::new(size, 8)))
        });
        if self.shown.len() != size.pixels() {
            self.shown = canvas.rgb().iter().map(|&rgb| refresh.display.encode(rgb)).collect();
        }
        tile_contrast(&self.shown, &rates.grid, &mut self.contrast);
        picture.clone_from(&self.shown);
        self.gather.run(&self.store, refresh.now, rates, &self.contrast, picture);
        if at_rest {
            self.gather.find_off_centre(&self.store);
        }
        self.shown.clone_from(picture);
        holes::order(self.gather.holes(), size, &mut self.holes);
        let (store, gather) = (&self.store, &self.gather);
        canvas.update(refresh.now, &mut self.holes, |pixel| {
            let (x, y) = size.xy(pixel as u32);
            let is_known = !gather.holes()[pixel].is_unknown();
            let (x, y) = gather.source(pixel).map_or((x, y), |source| size.xy(source));
            let newest = store.newest(x, y).map(|i| Tick(store.tick[i]).time(refresh.now));
            (newest.unwrap_or(Time::ZERO), is_known)
        });
    }
}
