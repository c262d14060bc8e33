//! `oracle-hold`: traces, in every slice of about 1 ms, the pixels whose shown colour is farthest from the ideal.
//!
//! Stands for nothing real: it knows the ideal picture. It is the reference for samplers whose picture is held: what could be gained
//! by choosing better.
//!
//! The error is taken against the ideal of the *next* refresh, which is what will be looked at; among the chosen pixels the
//! smallest errors are traced first, so that the largest are freshest at the refresh.

use frameless::{Canvas, Display, Request, Sampler, Time};

use crate::contender::{Arena, encode};
use crate::contenders::Frameless;
use crate::metrics::Picture;

/// A sampler that peeks.
pub(crate) struct OracleHold {
    ideals: Vec<Picture>,
    display_hz: u32,
    /// Error of the canvas against the ideal of refresh `errors_of`, and what the canvas holds as shown.
    errors: Vec<f32>,
    errors_of: Option<usize>,
    shown: Picture,
    times: Vec<Time>,
    order: Vec<u32>,
}

impl OracleHold {
    pub(crate) fn contender<'a>(arena: Arena<'a>) -> Frameless<'a> {
        let oracle = OracleHold {
            ideals: arena.ideals.pictures.clone(),
            display_hz: arena.display_hz,
            errors: Vec::new(),
            errors_of: None,
            shown: encode(&arena.ideals.start),
            times: vec![Time::ZERO; arena.size.pixels()],
            order: (0..arena.size.pixels() as u32).collect(),
        };
        Frameless::new(arena, Box::new(oracle))
    }

    /// Brings the errors up to date: all of them after a refresh, otherwise those of pixels traced since.
    fn update(&mut self, refresh: usize, canvas: &Canvas) {
        let ideal = &self.ideals[refresh];
        let display = Display::default();
        let everything = self.errors_of != Some(refresh);
        self.errors.resize(ideal.len(), 0.0);
        for pixel in 0..ideal.len() {
            let traced = canvas.time()[pixel] != self.times[pixel];
            if traced {
                self.times[pixel] = canvas.time()[pixel];
                self.shown[pixel] = display.encode(canvas.rgb()[pixel]);
            }
            if traced || everything {
                let (a, b) = (self.shown[pixel], ideal[pixel]);
                self.errors[pixel] = (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum();
            }
        }
        self.errors_of = Some(refresh);
    }
}

impl Sampler for OracleHold {
    fn choose(&mut self, now: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>) {
        // Refresh k is at (k + 1) / hz.
        let refresh = (now.secs() * f64::from(self.display_hz) + 1e-6) as usize;
        self.update(refresh.min(self.ideals.len() - 1), canvas);
        let count = count.min(self.order.len());
        if count == 0 {
            return;
        }
        let errors = &self.errors;
        // Ties are broken by the pixel's number, so that the choice does not depend on the order before.
        let larger_first =
            |a: &u32, b: &u32| errors[*b as usize].total_cmp(&errors[*a as usize]).then(a.cmp(b));
        self.order.select_nth_unstable_by(count - 1, larger_first);
        let chosen = &mut self.order[..count];
        chosen.sort_unstable_by(|a, b| larger_first(b, a));
        requests.extend(chosen.iter().map(|&pixel| Request::centre(pixel)));
    }
}
