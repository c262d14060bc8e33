//! What was measured, for people and for programs.

use std::fmt::Write;

use serde::Serialize;

/// One figure: the median of several rounds, with the smallest and the largest.
#[derive(Clone, Serialize)]
pub(super) struct Row {
    pub(super) name: String,
    /// The median.
    pub(super) value: f64,
    pub(super) min: f64,
    pub(super) max: f64,
    pub(super) unit: &'static str,
    pub(super) conditions: String,
}

#[derive(Serialize)]
struct Report<'a> {
    rows: &'a [Row],
}

impl Row {
    /// # Panics
    /// If there is no round.
    pub(super) fn new(
        name: impl Into<String>,
        unit: &'static str,
        rounds: &[f64],
        conditions: &str,
    ) -> Row {
        let mut sorted = rounds.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (min, max) = (sorted[0], sorted[sorted.len() - 1]);
        let value = median(&sorted);
        Row { name: name.into(), value, min, max, unit, conditions: conditions.to_owned() }
    }
}

/// Of numbers in order, at least one: of an even number the mean of the two in the middle.
pub(super) fn median(sorted: &[f64]) -> f64 {
    let upper = sorted.len() / 2;
    let lower = (sorted.len() - 1) / 2;
    0.5 * (sorted[lower] + sorted[upper])
}

pub(super) fn json(rows: &[Row]) -> String {
    serde_json::to_string_pretty(&Report { rows }).expect("plain data") + "\n"
}

pub(super) fn plain(rows: &[Row]) -> String {
    let mut text = format!("{:56} {:>10} {:>10} {:>10}  unit\n", "name", "median", "min", "max");
    for row in rows {
        // Writing to a string cannot fail.
        let [value, min, max] = [row.value, row.min, row.max].map(four_digits);
        let _ = writeln!(text, "{:56} {value:>10} {min:>10} {max:>10}  {}", row.name, row.unit);
    }
    let mut conditions: Vec<&str> = rows.iter().map(|row| row.conditions.as_str()).collect();
    conditions.dedup();
    for conditions in conditions {
        let _ = writeln!(text, "\n{conditions}");
    }
    text
}

/// Four significant digits, without an exponent.
fn four_digits(value: f64) -> String {
    let before_point = value.abs().max(1e-9).log10().floor() as i32 + 1;
    format!("{:.*}", (4 - before_point).clamp(0, 6) as usize, value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_an_even_number_lies_between_the_two_in_the_middle() {
        let value = |rounds: &[f64]| Row::new("name", "ns", rounds, "").value;
        assert_eq!(value(&[3.0]), 3.0);
        assert_eq!(value(&[5.0, 1.0]), 3.0);
        assert_eq!(value(&[9.0, 1.0, 2.0]), 2.0);
        assert_eq!(value(&[4.0, 1.0, 9.0, 2.0]), 3.0);
    }
}
