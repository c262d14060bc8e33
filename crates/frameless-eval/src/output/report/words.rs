//! Numbers as people read them.

/// `225K`, `3.6M`.
pub(super) fn rate(samples_per_sec: f64) -> String {
    let (value, unit) = match samples_per_sec {
        rate if rate >= 1e6 => (rate / 1e6, "M"),
        rate if rate >= 1e3 => (rate / 1e3, "K"),
        rate => (rate, ""),
    };
    let text = format!("{value:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned() + unit
}

/// `1 scene`, `2 scenes`.
pub(super) fn count(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

/// `33 ms`.
pub(super) fn millis(secs: f64) -> String {
    format!("{:.0} ms", secs * 1000.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_short() {
        for (samples_per_sec, text) in
            [(225e3, "225K"), (3.6e6, "3.6M"), (50.0, "50"), (1e6, "1M"), (12_500.0, "12.5K")]
        {
            assert_eq!(rate(samples_per_sec), text);
        }
    }
}
