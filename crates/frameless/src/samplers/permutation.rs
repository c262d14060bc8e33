//! Every pixel once per cycle, in random order, with a new order for every cycle.

use crate::{Canvas, Request, Rng, Sampler, Size, Time};

/// No pixel is drawn twice before every pixel has been drawn once: ages are bounded by two cycles.
pub struct Permutation {
    rng: Rng,
    size: Option<Size>,
    // The first `drawn` entries are this cycle's pixels; the rest, in any order, are still to come.
    order: Vec<u32>,
    drawn: usize,
}

impl Permutation {
    /// The same seed makes the same choices.
    pub fn new(seed: u64) -> Permutation {
        Permutation { rng: Rng::new(seed), size: None, order: Vec::new(), drawn: 0 }
    }

    /// One step of the Fisher–Yates shuffle (Knuth, TAOCP 3.4.2, algorithm P), so that a cycle's order is never made all
    /// at once: the loop would wait for it.
    fn next_pixel(&mut self) -> u32 {
        if self.drawn == self.order.len() {
            self.drawn = 0;
        }
        let remaining = (self.order.len() - self.drawn) as u32;
        let pick = self.drawn + self.rng.below(remaining) as usize;
        self.order.swap(self.drawn, pick);
        self.drawn += 1;
        self.order[self.drawn - 1]
    }
}

impl Sampler for Permutation {
    fn choose(&mut self, _now: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>) {
        if self.size != Some(canvas.size()) {
            self.size = Some(canvas.size());
            self.order = (0..canvas.size().pixels() as u32).collect();
            self.drawn = 0;
        }
        requests.extend((0..count).map(|_| Request::centre(self.next_pixel())));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draw(sampler: &mut Permutation, canvas: &Canvas, count: usize) -> Vec<u32> {
        let mut requests = Vec::new();
        sampler.choose(Time::ZERO, canvas, count, &mut requests);
        requests.iter().map(|r| r.pixel).collect()
    }

    #[test]
    fn first_draws_are_pinned() {
        let canvas = Canvas::new(Size::new(512, 384));
        assert_eq!(draw(&mut Permutation::new(1), &canvas, 4), [81990, 5691, 90115, 49459]);
    }

    #[test]
    fn a_cycle_holds_every_pixel_once_and_cycles_differ() {
        let canvas = Canvas::new(Size::new(13, 7));
        let mut sampler = Permutation::new(5);
        let cycles: Vec<Vec<u32>> = (0..3).map(|_| draw(&mut sampler, &canvas, 91)).collect();
        for cycle in &cycles {
            let mut sorted = cycle.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..91).collect::<Vec<_>>());
        }
        assert_ne!(cycles[0], cycles[1]);
        assert_ne!(cycles[1], cycles[2]);
    }

    #[test]
    fn every_place_in_the_order_is_equally_likely() {
        let canvas = Canvas::new(Size::new(6, 1));
        let mut counts = [[0u32; 6]; 6];
        let mut sampler = Permutation::new(2);
        for _ in 0..6000 {
            for (place, pixel) in draw(&mut sampler, &canvas, 6).into_iter().enumerate() {
                counts[place][pixel as usize] += 1;
            }
        }
        let chi2: f64 =
            counts.iter().flatten().map(|&c| (f64::from(c) - 1000.0).powi(2) / 1000.0).sum();
        assert!(
            chi2 < 52.6,
            "χ² of a 6×6 Latin table, 25 degrees of freedom: {chi2} (p = 0.001 at 52.6)"
        );
    }
}
