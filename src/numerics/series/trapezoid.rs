//! Running integral by the trapezoidal rule.

/// Integral of equally spaced values from the first to each of them.
#[must_use]
pub fn running_integral(values: &[f64], step: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut integral = vec![0.0];
    for pair in values.windows(2) {
        sum += 0.5 * step * (pair[0] + pair[1]);
        integral.push(sum);
    }
    integral
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_integral_of_a_straight_line_is_exact() {
        assert_eq!(running_integral(&[1.0, 2.0, 3.0], 2.0), [0.0, 3.0, 8.0]);
        assert_eq!(running_integral(&[7.0], 2.0), [0.0]);
    }
}
