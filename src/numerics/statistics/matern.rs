//! Correlation of a random function that has a slope everywhere.

/// Matérn correlation of order 3/2 at a distance over its length.
#[must_use]
pub fn matern_3_2(distance: f64) -> f64 {
    let r = 3f64.sqrt() * distance;
    (1.0 + r) * (-r).exp()
}
