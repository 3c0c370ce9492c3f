//! Changes of the gradient by errors of the instruments, to first order in the errors: the filter's
//! rows times the changes of its innovations.

use std::collections::BTreeMap;
use std::marker::PhantomData;

use nalgebra::DVector;
use pulp::Arch;

use super::error_propagation::{ABREAST, ErrorPropagation, OutputErrors, inputs_in_error};
use super::filter::Filter;
use super::response::FilterResponse;
use super::row_sinks::RecordedPass;
use super::signal_slopes::{NodeEquations, Recorded};
use crate::dynamics::{InGusts, OUTPUTS};
use crate::numerics::linear_algebra::matrix::AlignedMatrix;
use crate::output_error::Diverged;
use crate::output_error::calibration_errors::SignalError;

impl<const NX: usize, E: InGusts<NX>> Filter<NX, E> {
    /// Changes of the gradient of the filter's own parameters by errors of the instruments, at the
    /// same gain.
    ///
    /// # Errors
    /// [`Diverged`] when the state leaves its bounds at these parameters, or a change is not finite.
    pub fn gradient_shifts(
        &self,
        parameters: &[f64],
        recorded: &Recorded,
        errors: &[SignalError],
    ) -> Result<Vec<DVector<f64>>, Diverged> {
        let gains = self.gains_with_slopes(parameters)?;
        let mut pass = RecordedPass::new(self.samples(), self.lanes());
        let mut response = FilterResponse::empty(self.samples(), self.parameters());
        self.run(parameters, &gains, &mut response, Some(&mut pass))?;
        let names = self.names().iter().map(String::as_str);
        let values: BTreeMap<&str, f64> = names.zip(parameters.iter().copied()).collect();
        let nodes = NodeEquations::new(&self.case, recorded, &values);
        let changes = nodes.signal_changes(recorded, errors);
        let slopes = nodes.slopes_along(recorded, &changes, &pass.steps);
        let mut white = AlignedMatrix::zeros(OUTPUTS * self.samples(), errors.len());
        for first in (0..errors.len()).step_by(ABREAST) {
            let group = first..errors.len().min(first + ABREAST);
            Arch::new().dispatch(ErrorPropagation::<NX, E> {
                steps: &pass.steps,
                gains: &gains,
                patterns: self.patterns(),
                decay: self.noise(parameters).decay(self.case.step_s),
                half_step_s: 0.5 * self.case.step_s,
                inputs: inputs_in_error(&slopes, &changes[group.clone()], self.samples()),
                outputs: OutputErrors::of::<NX, E>(&errors[group]),
                measured: &self.case.measurements.values,
                white: &mut white,
                first,
                equations: PhantomData,
            });
        }
        let lanes = white.transposed_product(&pass.rows);
        if lanes.values().iter().all(|change| change.is_finite()) {
            Ok(lanes
                .rows()
                .map(|lanes| self.values_in_lanes(lanes))
                .collect())
        } else {
            Err(Diverged { sample: 0 })
        }
    }

    /// Values of the filter's own parameters, from values in lanes.
    fn values_in_lanes(&self, lanes: &[f64]) -> DVector<f64> {
        let values = (0..self.first_noise()).map(|j| lanes[self.lane(j)]);
        DVector::from_iterator(self.first_noise(), values)
    }
}
