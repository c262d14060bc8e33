//! Draws from a discrete distribution in constant time: the alias method (Walker 1977, "An efficient method for generating
//! discrete random variables with general distributions"; the table is built as in Vose 1991).

use crate::Rng;

/// n columns of equal probability; column i gives i below its threshold and `other` above.
#[derive(Clone, Debug)]
pub(crate) struct Alias {
    columns: Vec<Column>,
}

#[derive(Clone, Copy, Debug)]
struct Column {
    /// In units of 2⁻³².
    threshold: u32,
    other: u32,
}

const ONE: f64 = 4_294_967_296.0;

impl Alias {
    /// A distribution proportional to `weights`: none negative, at least one positive, or all zero (then nothing
    /// may be drawn).
    pub(crate) fn new(weights: &[f64]) -> Alias {
        let n = weights.len();
        let sum: f64 = weights.iter().sum();
        let mut scaled: Vec<f64> = weights.iter().map(|w| w * n as f64 / sum).collect();
        // A column that is never split keeps itself on both sides, so that rounding cannot matter.
        let own = |i: usize| Column { threshold: u32::MAX, other: i as u32 };
        let mut columns: Vec<Column> = (0..n).map(own).collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) =
            (0..n).partition(|&i| scaled[i] < 1.0);
        while let (Some(less), Some(&more)) = (small.pop(), large.last()) {
            columns[less] = Column { threshold: (scaled[less] * ONE) as u32, other: more as u32 };
            scaled[more] -= 1.0 - scaled[less];
            if scaled[more] < 1.0 {
                large.pop();
                small.push(more);
            }
        }
        Alias { columns }
    }

    /// An index with its probability, from one random number: its high part is the column, its low part the side.
    #[inline]
    pub(crate) fn draw(&self, rng: &mut Rng) -> u32 {
        let product = u64::from(rng.next_u32()) * self.columns.len() as u64;
        let (i, side) = ((product >> 32) as u32, product as u32);
        let column = self.columns[i as usize];
        if side < column.threshold { i } else { column.other }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The probability of every index, added up column by column.
    fn probability(alias: &Alias) -> Vec<f64> {
        let n = alias.columns.len();
        let mut probability = vec![0.0; n];
        for (i, column) in alias.columns.iter().enumerate() {
            let below = f64::from(column.threshold) / ONE;
            probability[i] += below / n as f64;
            probability[column.other as usize] += (1.0 - below) / n as f64;
        }
        probability
    }

    #[test]
    fn the_table_holds_the_distribution() {
        for weights in [
            &[1.0][..],
            &[0.0, 2.0, 0.0],
            &[1.0, 2.0, 3.0, 4.0],
            &[5.0, 5.0, 5.0],
            &[1e-9, 1.0, 7.0, 0.0],
        ] {
            let sum: f64 = weights.iter().sum();
            for (p, w) in probability(&Alias::new(weights)).iter().zip(weights) {
                assert!((p - w / sum).abs() < 1e-9, "{weights:?}: {p}");
            }
        }
    }
}
