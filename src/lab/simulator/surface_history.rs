//! Surfaces as a recorder that is late has them.

/// Deflections of the surfaces at every control step, between which they are linear.
pub struct SurfaceHistory {
    /// Delay of the recorder, control steps.
    delay: f64,
    steps: Vec<Vec<f64>>,
}

impl SurfaceHistory {
    pub fn new(delay: f64) -> SurfaceHistory {
        SurfaceHistory {
            delay,
            steps: Vec::new(),
        }
    }

    /// Appends the deflections of the next control step.
    pub fn push(&mut self, deflections_deg: &[f64]) {
        self.steps.push(deflections_deg.to_vec());
    }

    /// Deflections that are recorded at the last control step: those of one delay before, or the
    /// first ones.
    pub fn recorded(&self) -> Vec<f64> {
        let last = self.steps.len().saturating_sub(1);
        let place = (last as f64 - self.delay).max(0.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative, and below the number of steps"
        )]
        let before = place as usize;
        let after = (before + 1).min(last);
        let (Some(from), Some(to)) = (self.steps.get(before), self.steps.get(after)) else {
            return Vec::new();
        };
        let fraction = place - before as f64;
        if fraction == 0.0 {
            return from.clone();
        }
        let pairs = from.iter().zip(to);
        pairs.map(|(a, b)| a + fraction * (b - a)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn a_ramp_is_recorded_by_its_delay_later() {
        let mut history = SurfaceHistory::new(1.25);
        for k in 0..6 {
            history.push(&[2.0 * f64::from(k), 7.0]);
            let expected = 2.0 * (f64::from(k) - 1.25).max(0.0);
            assert_abs_diff_eq!(history.recorded()[0], expected, epsilon = 1e-12);
            assert_abs_diff_eq!(history.recorded()[1], 7.0);
        }
    }

    #[test]
    fn without_delay_the_record_is_exact() {
        let mut history = SurfaceHistory::new(0.0);
        for value in [0.3, -0.1, 12.7] {
            history.push(&[value]);
            assert!(history.recorded() == [value]);
        }
    }
}
