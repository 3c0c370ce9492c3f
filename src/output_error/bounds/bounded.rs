//! Data that the bounds (1.7) need in addition to the likelihood. They are residuals with their
//! sensitivities in blocks, and the noise of signals that the equations take as exact.

use nalgebra::DMatrix;

use super::block_series::BlockSeries;
use super::input_noise;
use crate::dynamics::{Equations, OUTPUTS};
use crate::output_error::case::Case;
use crate::output_error::kernel::response::Response;
use crate::output_error::likelihood::definition::Likelihood;
use crate::output_error::likelihood::joint::{Joint, JointMember};

/// Data whose estimates have bounds.
pub trait Bounded: Likelihood {
    /// Residuals of a whole response with their sensitivities, one series per output; different
    /// series are independent.
    fn series(&self, response: &Self::Response, weights: &[f64; OUTPUTS]) -> Vec<BlockSeries>;

    /// Covariance Σ Sᵀ W R W S of the gradient for white residuals, with sensitivities S, weights W
    /// and noise variances R.
    fn white_covariance(&self, response: &Self::Response, weights: &[f64; OUTPUTS])
    -> DMatrix<f64>;

    /// The residuals' series, and the gradient's covariance from the noise of measured surfaces, at
    /// a whole response to these parameters.
    fn noisy(
        &self,
        parameters: &[f64],
        response: &Self::Response,
        weights: &[f64; OUTPUTS],
    ) -> (Vec<BlockSeries>, DMatrix<f64>);
}

impl<const NX: usize, E: Equations<NX>> Bounded for Case<NX, E> {
    fn series(&self, response: &Response, weights: &[f64; OUTPUTS]) -> Vec<BlockSeries> {
        let sums = &response.sums;
        let length = sums.samples_per_block();
        let mut series = Vec::with_capacity(OUTPUTS);
        for (o, weight) in weights.iter().enumerate() {
            series.push(BlockSeries::new(
                self.step_s,
                *weight,
                self.samples(),
                sums.square(o),
                &sums.squares(o),
                |samples, row| sums.block(samples.start / length, o, row),
            ));
        }
        series
    }

    fn white_covariance(&self, response: &Response, weights: &[f64; OUTPUTS]) -> DMatrix<f64> {
        let variances = Likelihood::variances(self, response);
        response.sums.information(&std::array::from_fn(|o| {
            weights[o] * weights[o] * variances[o]
        }))
    }

    fn noisy(
        &self,
        parameters: &[f64],
        response: &Response,
        weights: &[f64; OUTPUTS],
    ) -> (Vec<BlockSeries>, DMatrix<f64>) {
        let series = self.series(response, weights);
        let inputs = input_noise::gradient_covariance(self, parameters, &series, weights);
        (series, inputs)
    }
}

impl<const NX: usize, E: Equations<NX>> Bounded for Joint<'_, NX, E> {
    fn series(&self, response: &Vec<Response>, weights: &[f64; OUTPUTS]) -> Vec<BlockSeries> {
        let members = self.members.iter().zip(response);
        members
            .flat_map(|(m, r)| m.with_parameters(&m.case.series(r, weights), self.names().len()))
            .collect()
    }

    fn white_covariance(&self, response: &Vec<Response>, weights: &[f64; OUTPUTS]) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(self.names().len(), self.names().len());
        for (member, response) in self.members.iter().zip(response) {
            member.add(&member.case.white_covariance(response, weights), &mut sum);
        }
        sum
    }

    fn noisy(
        &self,
        parameters: &[f64],
        response: &Vec<Response>,
        weights: &[f64; OUTPUTS],
    ) -> (Vec<BlockSeries>, DMatrix<f64>) {
        let n = self.names().len();
        let (mut all, mut sum) = (Vec::new(), DMatrix::zeros(n, n));
        for (member, response) in self.members.iter().zip(response) {
            let (series, inputs) =
                member
                    .case
                    .noisy(&member.parameters(parameters), response, weights);
            all.extend(member.with_parameters(&series, n));
            member.add(&inputs, &mut sum);
        }
        (all, sum)
    }
}

impl<const NX: usize, E: Equations<NX>> JointMember<'_, NX, E> {
    fn with_parameters(&self, series: &[BlockSeries], parameters: usize) -> Vec<BlockSeries> {
        series
            .iter()
            .map(|series| series.with_parameters(&self.places, parameters))
            .collect()
    }
}
