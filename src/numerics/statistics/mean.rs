//! Means: of all values, and of those that are finite.

/// Mean of all values; zero without one.
#[must_use]
pub fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}

/// Root mean square of all values; zero without one.
#[must_use]
pub fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    mean(values.map(|v| v * v)).sqrt()
}

/// Mean of the finite values; `None` without one.
#[must_use]
pub fn finite_mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let finite = values.into_iter().filter(|v| v.is_finite());
    let (count, sum) = finite.fold((0_usize, 0.0), |(count, sum), v| (count + 1, sum + v));
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_mean_of_nothing_is_zero() {
        assert!(mean(std::iter::empty()) == 0.0);
        assert_relative_eq!(mean([1.0, 2.0, 6.0].into_iter()), 3.0);
    }

    #[test]
    fn values_that_are_not_finite_are_no_part_of_a_mean() {
        assert_eq!(finite_mean([1.0, f64::NAN, 3.0]), Some(2.0));
        assert_eq!(finite_mean([f64::NAN]), None);
    }
}
