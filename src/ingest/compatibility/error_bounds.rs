//! Standard deviations of the instruments' errors: from the information, which contains the noise of
//! outputs and inputs, from the scatter between windows, and from gusts.

use nalgebra::{DMatrix, DVector};

use super::joint_state::{JointState, kind_of};
use super::measured_terms::EARTH_RATE;
use super::parameters::{
    INPUTS, KINDS, Kind, PARAMETERS, Parameters, SIGNALS, input, input_factor, output, place,
};
use super::window::Window;
use super::window_fit::{Squares, squares_about_mean};
use crate::flight::signal;
use crate::numerics::statistics::student;
use crate::units::DEG;

/// Relative error of the equations themselves. Gravity and positions are right to some 10⁻⁴. An arm
/// that is half an inch wrong adds 0.001 g at an angular acceleration of 1 rad/s², where the maneuvers
/// change the force by about 1 g.
pub const MODEL_SCALE: f64 = 0.001;

/// Assumed fraction of a vane's residual that correlates with the fitted motion, and with its rate.
/// The aircraft turns into a gust at once and with a delay. The correlated part therefore resembles
/// a scale error and a delay.
const GUST_RESPONSE: f64 = 0.5;

/// Outputs that measure the gusts into which the aircraft turns.
const VANES: [&str; 2] = [signal::ALPHA_VANE, signal::BETA_VANE];

/// Standard deviations of the shared parameters.
#[derive(Clone, Copy, Debug)]
pub struct ErrorBounds {
    /// Standard deviations with all contributions.
    pub total: Parameters,
    /// Contribution of gusts and of the equations' own error, which no number of windows or flights
    /// averages out.
    pub systematic: Parameters,
    /// Scatter of the errors between the windows beyond that of their noise. It shows errors that
    /// are not constant, such as a drift or a position error that varies with the flow.
    pub scatter: Parameters,
    /// Share of the information on each parameter that comes from the data and not from the prior.
    pub data_shares: Parameters,
}

impl JointState<'_> {
    /// Standard deviations of the shared parameters: by the information or by the scatter between
    /// windows, whichever is larger. The effects of gusts and of the equations' error are added.
    pub fn bounds(&self, windows: &[Window]) -> Option<ErrorBounds> {
        let inverse = self.inverse(&self.evidence_information())?;
        let jackknife = self.jackknife();
        let mut systematic = [0.0; PARAMETERS];
        for (i, ratio) in turning_over_force(windows).into_iter().enumerate() {
            let j = place(input::FORWARD + i, Kind::Scale);
            systematic[j] += (MODEL_SCALE * ratio).powi(2);
        }
        let moves = self.moves_by_errors(&inverse);
        let gust_errors = std::array::from_fn(|j| self.gust_error(j));
        self.add_errors(&gust_errors, &moves, &mut systematic);
        self.add_errors(&self.heading_errors(windows), &moves, &mut systematic);
        // The variance of few windows is itself uncertain, so it is enlarged as Student's intervals are.
        let windows = self.windows.len() as f64;
        let widening = student::widening_95(windows - 1.0).powi(2);
        let variance = |j: usize| inverse[(j, j)].max(widening * jackknife[j]) + systematic[j];
        let scatter = |j: usize| windows * (jackknife[j] - inverse[(j, j)]).max(0.0);
        let total: Parameters = std::array::from_fn(variance);
        Some(ErrorBounds {
            total: total.map(f64::sqrt),
            systematic: systematic.map(f64::sqrt),
            scatter: std::array::from_fn(|j| scatter(j).sqrt()),
            data_shares: std::array::from_fn(|j| self.data_share(&inverse, j)),
        })
    }

    /// Change of the estimates by a unit error of each parameter, one column per parameter: C H. H
    /// is the information of the data, and C = (H + P⁻¹)⁻¹ the covariance (`inverse`). The
    /// parameter absorbs its own error but for the part that its prior holds back, and only this
    /// part moves the others.
    pub fn moves_by_errors(&self, inverse: &DMatrix<f64>) -> DMatrix<f64> {
        inverse * self.evidence_information()
    }

    /// Adds the variances that errors of the parameters cause.
    fn add_errors(&self, errors: &Parameters, moves: &DMatrix<f64>, variances: &mut Parameters) {
        let errors = errors.iter().enumerate();
        for (source, error) in errors.filter(|(source, _)| self.estimated[*source]) {
            for (j, variance) in variances.iter_mut().enumerate() {
                *variance += (error * moves[(j, source)]).powi(2);
            }
        }
    }

    /// Error that gusts cause in the scale of an output or the delay of a vane; zero for the other parameters.
    /// The aircraft turns into a gust, so the gusts correlate with the motion, and no number of windows
    /// averages that out.
    pub fn gust_error(&self, j: usize) -> f64 {
        let (instrument, kind) = (j / KINDS, kind_of(j));
        let Some(output) = instrument.checked_sub(INPUTS) else {
            return 0.0;
        };
        let explained_by: fn(&Squares) -> f64 = match kind {
            Kind::Scale => |all| all.motion,
            Kind::Delay if VANES.contains(&SIGNALS[instrument]) => |all| all.rate,
            _ => return 0.0,
        };
        let mut all = Squares::default();
        for window in &self.windows {
            let own = window.residuals_and_motion(&self.context, output);
            all.residuals += own.residuals;
            all.motion += own.motion;
            all.rate += own.rate;
        }
        let explained = explained_by(&all);
        if explained > 0.0 {
            GUST_RESPONSE * (all.residuals / explained).sqrt()
        } else {
            0.0
        }
    }

    /// Errors of the rate gyros' biases without a recorded heading: the part of the earth's rotation along the unknown
    /// north, which the equations leave out. Zero for the other parameters.
    fn heading_errors(&self, windows: &[Window]) -> Parameters {
        let mut errors = [0.0; PARAMETERS];
        let has_heading = self.estimated[place(INPUTS + output::PSI, Kind::Delay)];
        if has_heading {
            return errors;
        }
        let latitude = self.context.aircraft.latitude_deg / DEG;
        let terms = || windows.iter().flat_map(|window| &window.terms);
        let count = terms().count().max(1) as f64;
        for axis in [input::P, input::Q, input::R] {
            // Mean square along the axis of a horizontal unit vector in any direction.
            let down = terms().map(|terms| terms.to_body[(axis, 2)].powi(2));
            let horizontal = down.map(|down| 0.5 * (1.0 - down)).sum::<f64>() / count;
            let rate = EARTH_RATE * latitude.cos() * horizontal.sqrt();
            errors[place(axis, Kind::Bias)] = rate * DEG;
        }
        errors
    }

    /// Variances of the shared parameters from the scatter between windows: each left out in turn.
    fn jackknife(&self) -> Parameters {
        let (information, gradient) = (self.evidence_information(), self.evidence_gradient());
        let steps_without: Vec<DVector<f64>> = self
            .windows
            .iter()
            .filter_map(|window| {
                let inverse = self.inverse(&(&information - &window.evidence.0))?;
                Some(inverse * (&gradient - &window.evidence.1))
            })
            .collect();
        let count = steps_without.len() as f64;
        std::array::from_fn(|j| {
            let mean = steps_without.iter().map(|d| d[j]).sum::<f64>() / count.max(1.0);
            let scatter = steps_without.iter().map(|d| (d[j] - mean).powi(2));
            scatter.sum::<f64>() * (count - 1.0) / count.max(1.0)
        })
    }
}

/// Ratio of the variations of ω × v to those of the specific force in each axis (forward, right,
/// down). A relative error of the former looks like an error of the accelerometer's scale
/// multiplied by this ratio.
fn turning_over_force(windows: &[Window]) -> [f64; 3] {
    let mut swings = [[0.0; 2]; 3];
    for window in windows {
        let turns: Vec<_> = (0..window.samples).map(|k| window.turning(k)).collect();
        for (i, [turning, force]) in swings.iter_mut().enumerate() {
            let input = input::FORWARD + i;
            let forces = window.inputs[input][window.margin..].iter();
            let forces = forces.take(window.samples);
            *turning += swing(turns.iter().map(|turn| turn[i]));
            *force += swing(forces.map(|force| input_factor(input) * force));
        }
    }
    swings.map(|[turning, force]| {
        if force > 0.0 {
            (turning / force).sqrt()
        } else {
            0.0
        }
    })
}

/// Sum of the squared deviations of a quantity from its mean in a window.
fn swing(values: impl Iterator<Item = f64>) -> f64 {
    let finite: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    squares_about_mean(&finite)
}
