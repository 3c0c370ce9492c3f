//! Reasons to doubt a fit that converged: it explains less than a constant, contradicts equation
//! error, or needs an error that no instrument has.

use super::second_opinion::Distance;
use crate::aero::Output;
use crate::dynamics::{Equations, OUTPUTS};
use crate::estimate::estimated::Estimated;
use crate::estimate::rows::RowMaker;
use crate::estimate::settings::Doubtful;
use crate::estimate::task::Task;
use crate::numerics::statistics::normal::NORMAL_95;
use crate::output_error::equation_error::Regression;
use crate::output_error::theil::OutputAgreement;
use crate::output_error::{Case, Fit, InitialState, Outcome};
use crate::units::{DEG, Unit};

/// Motion that a fit explains without the corrections of a filter, and the second opinion on it.
pub(in crate::estimate) struct ExplainedMotion<'a> {
    /// Outputs of the equations; `None` if they diverge.
    pub outputs: Option<&'a [[f64; OUTPUTS]]>,
    /// `true` if gusts explain a drift of the attitude: it integrates the rates, and the rotary
    /// gusts in them.
    pub attitude_drifts: bool,
    pub second_opinion: &'a Regression,
}

/// A fit that is to be judged.
pub(in crate::estimate) struct Credibility<'c, 'a, const NX: usize, E: Equations<NX>> {
    pub task: &'c Task<'a>,
    pub case: &'c Case<NX, E>,
    pub fit: &'c Fit,
    pub explanation: ExplainedMotion<'c>,
}

impl<const NX: usize, E: Equations<NX>> Credibility<'_, '_, NX, E> {
    /// Adds the agreement of the fit with the measured outputs and with equation error, and the
    /// outcome `doubtful` with its reasons.
    pub fn add_to(&self, estimated: &mut Estimated) {
        let outputs = self.explanation.outputs;
        let agreements = outputs.map(|y| OutputAgreement::of_outputs(&self.case.measurements, y));
        let rows = RowMaker::new(self.task);
        estimated.fit_outputs = agreements.map_or_else(Vec::new, |a| rows.agreement_rows(&a));
        let distance = Distance::between(self.fit, self.explanation.second_opinion);
        let row = &mut estimated.fit;
        row.equation_error_distance = distance.map(|d| d.per_derivative());
        if self.fit.outcome != Outcome::Converged {
            return;
        }
        let doubts = self.doubts(agreements.as_ref(), distance);
        if doubts.is_empty() {
            return;
        }
        let doubts = doubts.join("; ");
        match self.task.context.settings.doubtful {
            Doubtful::LeaveOut => (row.outcome, row.reason) = (Outcome::Doubtful, doubts),
            Doubtful::Use => row.reason = format!("{}; used in spite of: {doubts}", row.reason),
        }
    }

    /// Reasons to doubt the fit; empty for a credible one.
    fn doubts(
        &self,
        agreements: Option<&[OutputAgreement; OUTPUTS]>,
        distance: Option<Distance>,
    ) -> Vec<String> {
        let mut doubts = self.unexplained_outputs(agreements);
        doubts.extend(self.contradiction(distance));
        doubts.extend(self.impossible_biases());
        doubts.extend(self.impossible_initial_states());
        doubts
    }

    /// Outputs that move and that a constant would fit better than the equations.
    fn unexplained_outputs(&self, agreements: Option<&[OutputAgreement; OUTPUTS]>) -> Vec<String> {
        let Some(agreements) = agreements else {
            return vec!["its equations diverge along the maneuver".to_owned()];
        };
        let least = self.task.context.settings.doubt.r_squared;
        let mut doubts = Vec::new();
        for (o, output) in E::AXIS.outputs().into_iter().enumerate() {
            let ordinary = self.ordinary_bias(output).unwrap_or(0.0);
            let moves = agreements[o].measured_deviation() > ordinary;
            let drifts = self.explanation.attitude_drifts && output.is_attitude();
            let counts = moves && !drifts && self.fit.weights[o] > 0.0;
            let share = agreements[o].r_squared().filter(|share| *share < least);
            if let Some(share) = share.filter(|_| counts) {
                doubts.push(format!(
                    "it explains less of {} than a constant (R² {share:.2})",
                    output.signal()
                ));
            }
        }
        doubts
    }

    /// Reason for a fit that lies too far from equation error; `None` for one that agrees with it.
    fn contradiction(&self, distance: Option<Distance>) -> Option<String> {
        let distance = distance?;
        let probability = distance.probability();
        (probability < self.task.context.settings.doubt.contradiction).then(|| {
            format!(
                "its {} derivatives are {:.1} joint standard errors from equation error \
                 (probability {probability:.0e})",
                distance.derivatives,
                distance.per_derivative(),
            )
        })
    }

    /// Biases larger than an instrument can have, by more than their uncertainty.
    fn impossible_biases(&self) -> Vec<String> {
        let (case, fit) = (self.case, self.fit);
        let mut doubts = Vec::new();
        for (i, &o) in case.biased_outputs.iter().enumerate() {
            let j = case.derivatives() + i;
            let error = self.impossible_error(E::AXIS.outputs()[o], j, fit.values[j], 1.0);
            doubts.extend(error.map(|error| format!("{} is {error}", case.names[j])));
        }
        doubts
    }

    /// Initial states further from the measured ones than an instrument's error, by more than their
    /// uncertainty. The smaller of two distances counts. One is from the first sample, which may be
    /// an outlier; the other from the mean of several samples, during which the aircraft may move.
    /// The first outputs are the measured states.
    fn impossible_initial_states(&self) -> Vec<String> {
        let (case, fit) = (self.case, self.fit);
        let first = case.parameters() - NX;
        let Some(measured) = case.motion.states.first() else {
            return vec![];
        };
        if case.initial_state != InitialState::Estimated {
            return vec![];
        }
        let mut doubts = Vec::new();
        for (i, output) in E::AXIS.outputs().into_iter().take(NX).enumerate() {
            let changes = [measured[i], case.start[i]].map(|x| DEG * (fit.values[first + i] - x));
            let change = if changes[0].abs() < changes[1].abs() {
                changes[0]
            } else {
                changes[1]
            };
            let error = self.impossible_error(output, first + i, change, DEG);
            let name = &case.names[first + i];
            doubts.extend(
                error.map(|error| format!("{name} differs from its measured value by {error}")),
            );
        }
        doubts
    }

    /// Words for an error of an output that its instrument cannot have; `None` for one that it can.
    /// `unit` is the output's unit in that of the parameter `j`.
    fn impossible_error(&self, output: Output, j: usize, error: f64, unit: f64) -> Option<String> {
        let ordinary = self.ordinary_bias(output)?;
        let most = self.task.context.settings.doubt.ordinary_biases * ordinary;
        let uncertainty = unit * self.fit.covariance_corrected.as_ref()?[(j, j)].sqrt();
        (error.abs() > most + NORMAL_95 * uncertainty).then(|| {
            format!(
                "{error:.3} {}, {:.0} times the ordinary bias of its instrument",
                Unit::of_signal(output.signal()).name,
                error.abs() / ordinary
            )
        })
    }

    /// Ordinary bias of an output's instrument; `None` where the configuration has none.
    fn ordinary_bias(&self, output: Output) -> Option<f64> {
        let bias = self
            .task
            .context
            .settings
            .ordinary_bias
            .get(&output)
            .copied();
        bias.filter(|bias| *bias > 0.0)
    }
}
