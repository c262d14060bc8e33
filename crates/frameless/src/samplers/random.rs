//! Independent uniform pixels: frameless rendering as first described (Bishop, Fuchs, McMillan and Scher Zagier,
//! "Frameless Rendering: Double Buffering Considered Harmful", SIGGRAPH 1994).

use crate::{Canvas, Insight, Request, Rng, Sampler, Time};

/// Every draw is any pixel with probability 1/n, whatever was drawn before.
pub struct Random {
    rng: Rng,
}

impl Random {
    /// The same seed makes the same choices.
    pub fn new(seed: u64) -> Random {
        Random { rng: Rng::new(seed) }
    }
}

impl Sampler for Random {
    fn choose(&mut self, _now: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>) {
        let pixels = canvas.size().pixels() as u32;
        requests.extend((0..count).map(|_| Request::centre(self.rng.below(pixels))));
    }

    fn inspect(&self, _now: Time, canvas: &Canvas) -> Insight {
        let pixels = canvas.size().pixels();
        Insight { probability: vec![1.0 / pixels as f32; pixels], ..Insight::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    #[test]
    fn first_draws_are_pinned() {
        let canvas = Canvas::new(Size::new(512, 384));
        let mut requests = Vec::new();
        Random::new(1).choose(Time::ZERO, &canvas, 4, &mut requests);
        let pixels: Vec<u32> = requests.iter().map(|r| r.pixel).collect();
        assert_eq!(pixels, [81990, 5690, 90114, 49457]);
    }
}
