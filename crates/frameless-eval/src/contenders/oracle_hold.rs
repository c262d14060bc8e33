//! `oracle-hold`: traces, between two refreshes, the pixels whose shown colour is farthest from the ideal.
//!
//! Stands for nothing real: it knows the ideal picture. It is the reference for samplers whose picture is held: what could be gained
//! by choosing better.
//!
//! The error is taken against the ideal of the *next* refresh, which is what will be looked at. Each of the chosen pixels is traced
//! once until then: one whose colour still changes afterwards would otherwise be traced again and again in vain. The
//! smallest errors come first, so that the largest are freshest at the refresh. It is greedy, refresh by
//! refresh, and so no strict bound.

use std::sync::Arc;

use frameless::{Canvas, Display, ReconstructionKind, Request, Sampler, Time};

use crate::contender::Arena;
use crate::contenders::Frameless;
use crate::metrics::Picture;

/// A sampler that peeks.
pub(crate) struct OracleHold {
    ideals: Arc<[Picture]>,
    display_hz: u32,
    samples_per_refresh: usize,
    /// The refresh for which `plan` was made.
    planned_for: Option<usize>,
    /// Pixels still to be traced until then, the next one last.
    plan: Vec<u32>,
}

impl OracleHold {
    pub(crate) fn contender<'a>(arena: Arena<'a>) -> Frameless<'a> {
        let samples = (arena.samples_per_sec * arena.refresh_secs()).ceil() as usize;
        let oracle = OracleHold {
            ideals: arena.ideals.pictures.clone(),
            display_hz: arena.display_hz,
            samples_per_refresh: samples.clamp(1, arena.size.pixels()),
            planned_for: None,
            plan: Vec::new(),
        };
        Frameless::new(arena, Box::new(oracle), ReconstructionKind::Hold)
    }

    /// The pixels with the largest errors against the ideal of `refresh`, the largest first.
    fn make_plan(&mut self, refresh: usize, canvas: &Canvas) {
        let display = Display::default();
        let error = |(rgb, ideal): (&[f32; 3], &[f32; 3])| -> f32 {
            let shown = display.encode(*rgb);
            (0..3).map(|k| (shown[k] - ideal[k]) * (shown[k] - ideal[k])).sum()
        };
        let errors: Vec<f32> = canvas.rgb().iter().zip(&self.ideals[refresh]).map(error).collect();
        // Ties are broken by the pixel's number, so that the choice depends on nothing else.
        let larger_first =
            |a: &u32, b: &u32| errors[*b as usize].total_cmp(&errors[*a as usize]).then(a.cmp(b));
        self.plan = (0..errors.len() as u32).collect();
        self.plan.select_nth_unstable_by(self.samples_per_refresh - 1, larger_first);
        self.plan.truncate(self.samples_per_refresh);
        self.plan.sort_unstable_by(larger_first);
        self.planned_for = Some(refresh);
    }
}

impl Sampler for OracleHold {
    fn choose(&mut self, now: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>) {
        // Refresh k is at (k + 1) / hz; a batch that begins at a refresh works for the next one.
        let refresh = (now.secs() * f64::from(self.display_hz) + 1e-6) as usize;
        let refresh = refresh.min(self.ideals.len() - 1);
        if self.planned_for != Some(refresh) {
            self.make_plan(refresh, canvas);
        }
        let rest = self.plan.len().saturating_sub(count);
        requests.extend(self.plan.drain(rest..).rev().map(Request::centre));
    }
}
