//! The samples of one answer and what they took the place of.

use crate::{Kept, Request, Size, Surface, Time};

/// In the answer's order; what has been dropped is not among them.
#[derive(Default)]
pub(crate) struct Replaced {
    pub(crate) requests: Vec<Request>,
    pub(crate) before: Vec<Before>,
    pub(crate) old: Vec<[f32; 3]>,
    pub(crate) new: Vec<[f32; 3]>,
    pub(crate) surfaces: Vec<Surface>,
}

/// What a pixel was.
#[derive(Clone, Copy)]
pub(crate) struct Before {
    /// When it had been traced.
    pub(crate) previous: Time,
    /// Whether anything was known of it.
    pub(crate) known: bool,
    /// Whether the sample was added to others, so that none was replaced.
    pub(crate) is_refinement: bool,
}

impl Replaced {
    pub(crate) fn clear(&mut self) {
        self.requests.clear();
        self.before.clear();
        self.old.clear();
        self.new.clear();
        self.surfaces.clear();
    }

    /// As a reconstruction takes them.
    pub(crate) fn kept(&self, now: Time, size: Size, is_noisy: bool) -> Kept<'_> {
        let Replaced { requests, old, new, surfaces, .. } = self;
        Kept { now, size, requests, new, old, surfaces, is_noisy }
    }
}
