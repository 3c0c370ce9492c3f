//! Interface between the likelihood, of one maneuver or of several, and Newton-Raphson (1.3).

use super::cost::{self, Sums};
use crate::dynamics::{Equations, OUTPUTS};
use crate::output_error::case::Case;
use crate::output_error::kernel::pass::Diverged;
use crate::output_error::kernel::response::{Detail, Response};

/// Data with a likelihood: cost, gradient and information at any values of the parameters.
pub trait Likelihood {
    /// Computed outputs with the sums of the normal equations. Allocated once and overwritten by
    /// every iteration.
    type Response: Default;

    /// Names of the parameters in order.
    fn names(&self) -> &[String];

    /// Allocates a response.
    fn response(&self) -> Self::Response;

    /// `true` if a coarse response is less work than a whole one.
    fn has_coarse(&self) -> bool;

    /// Computes the response to these parameters.
    ///
    /// # Errors
    /// [`Diverged`] when an integration leaves its bounds.
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

    /// Place at which an integration diverged, in words.
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
        let sums = &response.sums;
        let outputs = std::array::from_fn(|o| (sums.square(o), sums.count(o)));
        cost::residual_variances(outputs, self.parameters())
    }

    fn place(&self, diverged: Diverged) -> String {
        let time_s = diverged.sample as f64 * self.step_s;
        format!("{time_s:.2} s into the maneuver")
    }
}
