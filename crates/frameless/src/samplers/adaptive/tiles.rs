//! What is looked up of a tile whenever one of its pixels is chosen or was traced.
//!
//! Tiles are looked up all over the picture, and waiting for memory takes longer than all that is computed: hence one line of the cache for all
//! of it, whoever it belongs to.

use super::front::TileFront;
use super::order::Recent;
use super::why::{Reasons, Why};
use crate::rates::Evidence;
use crate::traced::Place;
use crate::{pages, wide};

/// See the module.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct Tile {
    pub(super) front: TileFront,
    pub(super) reasons: Reasons,
    pub(super) evidence: Evidence,
    /// How old samples have been, on average, when they were replaced.
    pub(super) mean_age_secs: f32,
    pub(super) recent: Recent,
    /// Whose turn it is in it: see [`Order`](super::order::Order).
    pub(super) turn: u8,
    /// Whether it is in the queue of those with pixels beside changes.
    pub(super) waits: bool,
}

const _: () = assert!(size_of::<Tile>() == 64);

/// All of them.
pub(super) struct Tiles(Vec<Tile>);

/// How much the last sample counts in a mean age.
const LAST_AGE: f32 = 0.05;

impl Tiles {
    pub(super) fn new(tiles: usize) -> Tiles {
        Tiles(pages::filled(Tile::default(), tiles))
    }

    #[inline(always)]
    pub(super) fn of(&self, tile: usize) -> &Tile {
        &self.0[tile]
    }

    #[inline(always)]
    pub(super) fn of_mut(&mut self, tile: usize) -> &mut Tile {
        &mut self.0[tile]
    }

    pub(super) fn all_mut(&mut self) -> impl Iterator<Item = &mut Tile> {
        self.0.iter_mut()
    }

    /// Why a pixel is asked for.
    #[inline(always)]
    pub(super) fn set_why(&mut self, place: Place, why: Why) {
        self.of_mut(place.tile()).reasons.set(1 << place.within(), why);
    }

    /// Begins to fetch a tile.
    #[inline(always)]
    pub(super) fn prefetch(&self, tile: usize) {
        wide::prefetch(&self.0, tile);
    }
}

impl Tile {
    /// Of a sample that replaced one of this age.
    #[inline(always)]
    pub(super) fn observe_age(&mut self, age_secs: f32) {
        self.mean_age_secs += LAST_AGE * (age_secs - self.mean_age_secs);
    }
}
