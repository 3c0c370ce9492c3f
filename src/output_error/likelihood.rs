//! What Newton-Raphson (1.3) and the bounds (1.7) need of the data, whether of one maneuver or of
//! several joined.

use nalgebra::DMatrix;

use super::case::Case;
use super::coloured::Series;
use super::cost::{self, Sums};
use super::cramer_rao;
use super::input_noise;
use super::response::{Detail, Diverged, Response};
use crate::dynamics::{Equations, OUTPUTS};

/// Data that say something of parameters: cost, gradient and information at any values of them.
pub trait Likelihood {
    /// Computed outputs with the sums of the normal equations, allocated once and written over at
    /// every iteration.
    type Response: Default;

    /// Names of the parameters in order.
    fn names(&self) -> &[String];

    /// A response of the right size to write into.
    fn response(&self) -> Self::Response;

    /// Whether a coarse response is less work than a rough one.
    fn has_coarse(&self) -> bool;

    /// Computes the response to these parameters.
    ///
    /// # Errors
    /// [`Diverged`] when an integration leaves the bounds of sense.
    fn respond(
        &self,
        detail: Detail,
        parameters: &[f64],
        response: &mut Self::Response,
    ) -> Result<(), Diverged>;

    /// Cost, gradient and information for weights on residuals in deg, deg/s and g.
    fn sums(&self, response: &Self::Response, weights: &[f64; OUTPUTS]) -> Sums;

    /// Variances of the residuals, output by output.
    fn variances(&self, response: &Self::Response) -> [f64; OUTPUTS];

    /// Residuals of a whole response with their sensitivities, output by output; those of different
    /// series are independent.
    fn series(&self, response: &Self::Response, weights: &[f64; OUTPUTS]) -> Vec<Series>;

    /// Σ Sᵀ W R W S for white residuals.
    fn white_covariance(&self, response: &Self::Response, weights: &[f64; OUTPUTS])
    -> DMatrix<f64>;

    /// These series, and what noise of what is taken as exact does to the gradient, at a whole
    /// response to these parameters.
    fn noisy(
        &self,
        parameters: &[f64],
        response: &Self::Response,
        weights: &[f64; OUTPUTS],
    ) -> (Vec<Series>, DMatrix<f64>);

    /// Where an integration diverged, in words.
    fn place(&self, diverged: Diverged) -> String;
}

impl<const NX: usize, E: Equations<NX>> Likelihood for Case<NX, E> {
    type Response = Response;

    fn names(&self) -> &[String] {
        &self.names
    }

    fn response(&self) -> Response {
        Case::response(self)
    }

    fn has_coarse(&self) -> bool {
        Case::has_coarse(self)
    }

    fn respond(
        &self,
        detail: Detail,
        parameters: &[f64],
        response: &mut Response,
    ) -> Result<(), Diverged> {
        self.respond_with(detail, parameters, response)
    }

    fn sums(&self, response: &Response, weights: &[f64; OUTPUTS]) -> Sums {
        cost::sums(response, weights)
    }

    fn variances(&self, response: &Response) -> [f64; OUTPUTS] {
        let normal = &response.normal;
        let output = |o: usize| (normal.square(o), normal.count(o));
        cramer_rao::variances(std::array::from_fn(output), self.parameters())
    }

    fn series(&self, response: &Response, weights: &[f64; OUTPUTS]) -> Vec<Series> {
        let normal = &response.normal;
        let series = |o: usize| {
            let (square, squares) = (normal.square(o), normal.squares(o));
            Series::new(
                self.step_s,
                weights[o],
                self.samples(),
                square,
                &squares,
                |samples, row| normal.block(samples.start / normal.block_samples(), o, row),
            )
        };
        (0..OUTPUTS).map(series).collect()
    }

    fn white_covariance(&self, response: &Response, weights: &[f64; OUTPUTS]) -> DMatrix<f64> {
        let variances = Likelihood::variances(self, response);
        response.normal.information(&std::array::from_fn(|o| {
            weights[o] * weights[o] * variances[o]
        }))
    }

    fn noisy(
        &self,
        parameters: &[f64],
        response: &Response,
        weights: &[f64; OUTPUTS],
    ) -> (Vec<Series>, DMatrix<f64>) {
        let series = self.series(response, weights);
        let inputs = input_noise::gradient_covariance(self, parameters, &series, weights);
        (series, inputs)
    }

    fn place(&self, diverged: Diverged) -> String {
        format!(
            "{:.2} s into the maneuver",
            diverged.sample as f64 * self.step_s
        )
    }
}
