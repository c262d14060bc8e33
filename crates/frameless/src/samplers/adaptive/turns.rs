//! Turns in proportion to shares, by credit and without chance: exactly as many as there ought to be on average, and evenly over time.
//!
//! ```text
//! c_i ← c_i + q_i,   q_i = a · w_i + b · e_i      for everybody; Σ q turns in all
//! while c_i ≥ 1:   c_i ← c_i − 1, and i has a turn
//! ```
//!
//! Degenerate cases: who has no share never has a turn; if nobody has one there are none.

/// The sums are made anew after so many rounds, long before roundings add up to anything.
const RENEWED: u32 = 1024;

/// Shares and credits.
pub(super) struct Turns {
    /// c.
    credit: Vec<f32>,
    /// w.
    weight: Vec<f32>,
    /// e.
    even: Vec<f32>,
    sums: Sums,
    until_renewed: u32,
    /// Who has a turn, in front; the rest is of no meaning.
    due: Vec<u32>,
}

/// Over everybody.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    /// Σ w.
    pub(super) weight: f64,
    /// Σ e.
    pub(super) even: f64,
}

impl Turns {
    /// Nobody has a share yet. Credits in [0, 1) say how soon they have their first turn.
    pub(super) fn new(credit: Vec<f32>) -> Turns {
        let nothing = vec![0.0; credit.len()];
        Turns {
            weight: nothing.clone(),
            even: nothing,
            sums: Sums::default(),
            until_renewed: RENEWED,
            due: vec![0; credit.len()],
            credit,
        }
    }

    pub(super) fn sums(&self) -> Sums {
        self.sums
    }

    /// w of everybody.
    pub(super) fn weights(&self) -> &[f32] {
        &self.weight
    }

    /// w and e of everybody are others now, all at least 0.
    pub(super) fn set_all(&mut self, shares: impl Iterator<Item = (f32, f32)>) {
        for ((weight, even), share) in self.weight.iter_mut().zip(&mut self.even).zip(shares) {
            (*weight, *even) = share;
        }
        self.renew();
    }

    /// w of somebody is another one now, at least 0.
    #[inline]
    pub(super) fn set(&mut self, i: usize, weight: f32) {
        let old = std::mem::replace(&mut self.weight[i], weight);
        self.sums.weight += f64::from(weight) - f64::from(old);
    }

    /// Makes the sums anew.
    fn renew(&mut self) {
        let add = |numbers: &[f32]| numbers.iter().map(|&number| f64::from(number)).sum();
        self.sums = Sums { weight: add(&self.weight), even: add(&self.even) };
        self.until_renewed = RENEWED;
    }

    /// q of everybody.
    pub(super) fn all(&self, a: f32, b: f32) -> impl Iterator<Item = f32> {
        self.weight.iter().zip(&self.even).map(move |(weight, even)| a * weight + b * even)
    }

    /// One round: calls `take` with who has turns, and how many.
    #[inline]
    pub(super) fn draw(&mut self, a: f32, b: f32, mut take: impl FnMut(u32, u32)) {
        self.until_renewed -= 1;
        if self.until_renewed == 0 {
            self.renew();
        }
        // Flat loops, one thing each: the compiler makes vectors of the first, and the second has no branch to be guessed wrong.
        let shares = self.weight.iter().zip(&self.even);
        for (credit, (weight, even)) in self.credit.iter_mut().zip(shares) {
            *credit += a * weight + b * even;
        }
        let mut due = 0;
        for (i, credit) in (0..).zip(&self.credit) {
            self.due[due] = i;
            due += usize::from(*credit >= 1.0);
        }
        for &i in &self.due[..due] {
            let turns = self.credit[i as usize] as u32;
            self.credit[i as usize] -= turns as f32;
            take(i, turns);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rng;

    #[test]
    fn sums_kept_are_those_from_scratch() {
        let mut rng = Rng::new(9);
        let mut turns = Turns::new(vec![0.5; 1000]);
        turns.set_all((0..1000).map(|i| (0.1, (i % 3) as f32)));
        for _ in 0..100_000 {
            turns.set(rng.below(1000) as usize, 10f32.powf(-4.0 * rng.unit_f32()));
        }
        let kept = turns.sums();
        turns.renew();
        assert!((kept.weight / turns.sums().weight - 1.0).abs() < 1e-9, "{kept:?}");
        assert_eq!(kept.even, 999.0);
    }

    #[test]
    fn a_round_is_known_by_thought() {
        let mut turns = Turns::new(vec![0.0, 0.5, 0.75]);
        turns.set_all([(1.0, 0.0), (0.25, 1.0), (0.0, 0.0)].into_iter());
        let round = |turns: &mut Turns| {
            let mut taken = Vec::new();
            turns.draw(2.0, 0.25, |i, n| taken.push((i, n)));
            taken
        };
        assert_eq!(round(&mut turns), [(0, 2), (1, 1)], "2, and 0.5 + 2/4 + 1/4");
        assert_eq!(round(&mut turns), [(0, 2), (1, 1)], "2, and 0.25 + 0.75");
        assert_eq!(round(&mut turns), [(0, 2)]);
    }
}
