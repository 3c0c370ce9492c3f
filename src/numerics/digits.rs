//! Numbers in sentences.

/// A number with three significant digits.
#[must_use]
pub fn rounded(value: f64) -> String {
    let digits = format!("{value:.2e}");
    digits
        .parse()
        .map_or(digits, |number: f64| number.to_string())
}
