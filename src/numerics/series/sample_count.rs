//! Durations and positions as whole numbers of samples.

/// Fraction of a step by which a duration may fall short of a whole number of steps: a clock's mean
/// step differs from the nominal one by rounding.
const STEP_TOLERANCE: f64 = 1e-6;

/// Whole number of steps that fit into a duration.
pub fn whole_steps(duration_s: f64, step_s: f64) -> usize {
    let steps = (duration_s / step_s + STEP_TOLERANCE).floor().max(0.0);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "floored and not negative"
    )]
    let steps = steps as usize;
    steps
}

/// Nearest whole number, not below zero.
pub fn nearest(value: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "rounded and not negative"
    )]
    let index = value.round().max(0.0) as usize;
    index
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_of_exactly_ten_steps_is_ten_steps_despite_rounding() {
        assert_eq!(whole_steps(0.25, 0.025), 10);
        assert_eq!(whole_steps(0.25, 0.024_999_98), 10);
        assert_eq!(whole_steps(0.0, 0.025), 0);
    }
}
