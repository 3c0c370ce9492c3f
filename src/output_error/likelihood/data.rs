//! What Newton-Raphson (1.3) and the bounds (1.7) need of the data, whether of one maneuver or of
//! several joined.

use super::cost;
use super::cost::Sums;
use crate::dynamics::{Equations, OUTPUTS};
use crate::output_error::case::Case;
use crate::output_error::kernel::pass::Diverged;
use crate::output_error::kernel::response::{Detail, Response};

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
        cost::variances(std::array::from_fn(output), self.parameters())
    }

    fn place(&self, diverged: Diverged) -> String {
        format!(
            "{:.2} s into the maneuver",
            diverged.sample as f64 * self.step_s
        )
    }
}
