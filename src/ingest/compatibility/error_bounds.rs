//! Standard deviations of the instruments' errors: from the information and from the scatter
//! between windows, and those that a fault is compared with.

use nalgebra::DVector;

use super::joint_state::JointState;
use super::parameters::{INPUTS, Kind, OUTPUTS, Parameters, place};
use super::window::{Window, input_factor};
use super::window_fit::squares_about_mean;
use crate::numerics::student;

/// Relative error of the equations themselves: gravity, arms and positions are not known more
/// closely.
pub const MODEL_SCALE: f64 = 0.002;

/// Share of a vane's unexplained motion that goes with the explained motion. The aircraft turns
/// into a gust, so this share is taken for a scale error.
const GUST_RESPONSE: f64 = 0.5;

impl JointState<'_> {
    /// Standard deviations of the shared parameters: of the information or of the scatter between
    /// windows, whichever is larger.
    pub fn bounds(&self, windows: &[Window]) -> Option<Parameters> {
        let inverse = self.inverse(&self.information())?;
        let jackknife = self.jackknife();
        let mut bounds = std::array::from_fn(|j| inverse[(j, j)].max(jackknife[j]).sqrt());
        for (i, ratio) in turning_over_force(windows).into_iter().enumerate() {
            let j = place(FIRST_ACCELEROMETER + i, Kind::Scale);
            bounds[j] = bounds[j].hypot(MODEL_SCALE * ratio);
        }
        Some(bounds)
    }

    /// The bounds with the effect of gusts on the scale of an output.
    pub fn fault_bounds(&self, bounds: &Parameters) -> Parameters {
        let mut wider = *bounds;
        for output in 0..OUTPUTS {
            let (mut residuals, mut motion) = (0.0, 0.0);
            for window in &self.windows {
                let (slow, moved) = window.residuals_and_motion(&self.context, output);
                residuals += slow;
                motion += moved;
            }
            let j = place(INPUTS + output, Kind::Scale);
            if motion > 0.0 {
                wider[j] = wider[j].hypot(GUST_RESPONSE * (residuals / motion).sqrt());
            }
        }
        wider
    }

    /// Variances of the shared parameters from the scatter between windows: each left out in turn.
    /// The variance of few windows is itself uncertain, so it is enlarged as Student's intervals
    /// are.
    fn jackknife(&self) -> Parameters {
        let (information, gradient) = (self.information(), self.gradient());
        let steps_without: Vec<DVector<f64>> = self
            .windows
            .iter()
            .filter_map(|window| {
                let inverse = self.inverse(&(&information - &window.information))?;
                Some(inverse * (&gradient - &window.gradient))
            })
            .collect();
        let count = steps_without.len() as f64;
        let widening = student::widening_95(count - 1.0).powi(2);
        std::array::from_fn(|j| {
            let mean = steps_without.iter().map(|d| d[j]).sum::<f64>() / count.max(1.0);
            let scatter = steps_without.iter().map(|d| (d[j] - mean).powi(2));
            widening * scatter.sum::<f64>() * (count - 1.0) / count.max(1.0)
        })
    }
}

/// The first accelerometer among the inputs; three rate gyros stand before it.
const FIRST_ACCELEROMETER: usize = 3;

/// Ratio of the swings of ω × v to those of the specific force in each axis (forward, right, down).
/// A relative error of the former is so many times as large an error of the accelerometer's scale.
fn turning_over_force(windows: &[Window]) -> [f64; 3] {
    std::array::from_fn(|i| {
        let input = FIRST_ACCELEROMETER + i;
        let turning = swings(windows, |w, k| w.turning(k)[i]);
        let force = swings(windows, |w, k| {
            input_factor(input) * w.inputs[input][w.margin + k]
        });
        if force > 0.0 {
            (turning / force).sqrt()
        } else {
            0.0
        }
    })
}

/// Sum over windows of the squared deviations of a quantity from its mean in the window.
fn swings(windows: &[Window], value: impl Fn(&Window, usize) -> f64) -> f64 {
    let of_window = |window: &Window| {
        let values = (0..window.samples).map(|k| value(window, k));
        let finite: Vec<f64> = values.filter(|v| v.is_finite()).collect();
        squares_about_mean(&finite)
    };
    windows.iter().map(of_window).sum()
}
