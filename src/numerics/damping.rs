//! Damping of steps towards a minimum (Marquardt), by the share of its predicted gain that a step keeps.

/// Factor by which damping grows or falls (Marquardt's ν).
const FACTOR: f64 = 10.0;

/// Shares of the predicted gain above which a prediction is good, and below which it is poor.
/// Source: trust regions (Nocedal and Wright, *Numerical Optimization*, algorithm 4.1).
const GOOD: f64 = 0.75;
const POOR: f64 = 0.25;

/// Damping after a step that kept this share of its predicted gain: less after a good prediction, more after a
/// poor one. `first` is the least damping other than none.
#[must_use]
pub fn next_damping(damping: f64, kept: f64, first: f64) -> f64 {
    match kept {
        k if k > GOOD && damping > first => damping / FACTOR,
        k if k > GOOD => 0.0,
        k if k < POOR => raised_damping(damping, first),
        _ => damping,
    }
}

/// Damping after a step that failed.
#[must_use]
pub fn raised_damping(damping: f64, first: f64) -> f64 {
    (damping * FACTOR).max(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damping_follows_the_quality_of_the_prediction() {
        let first = 1e-4;
        assert_eq!(raised_damping(0.0, first).to_bits(), first.to_bits());
        for (damping, kept, next) in [
            (1.0, 0.5, 1.0),
            (1.0, 0.1, 10.0),
            (0.0, 0.1, first),
            (1.0, 0.9, 0.1),
            (first, 0.9, 0.0),
            (1.0, f64::NAN, 1.0),
        ] {
            let found = next_damping(damping, kept, first);
            assert!((found - next).abs() < 1e-12, "{damping} {kept}: {found}");
        }
    }
}
