//! Several maneuvers that share derivatives: one cost (1.2), the sum over the maneuvers. Each keeps its
//! biases, initial states, and derivatives that act as biases.
//!
//! Parameters in order: the shared derivatives, then each maneuver's own. The information matrix (1.5)
//! has a block for the shared derivatives, one for each maneuver's own parameters, and borders
//! between the two. Residuals of different maneuvers are independent; each has its own variances and
//! autocorrelation.

use nalgebra::{DMatrix, DVector};

use super::cost::{self, Sums};
use super::definition::Likelihood;
use super::sharing::{SharedParameters, add_matrix, add_vector, values_at};
use crate::dynamics::{Equations, OUTPUTS};
use crate::output_error::case::Case;
use crate::output_error::kernel::pass::Diverged;
use crate::output_error::kernel::response::{Detail, Response};

/// Maneuvers with shared derivatives.
#[derive(Debug)]
pub struct Joint<'a, const NX: usize, E: Equations<NX>> {
    pub(crate) members: Vec<JointMember<'a, NX, E>>,
    parameters: SharedParameters,
}

/// One of the maneuvers.
#[derive(Debug)]
pub(crate) struct JointMember<'a, const NX: usize, E: Equations<NX>> {
    label: &'a str,
    pub case: &'a Case<NX, E>,
    /// Place of each own parameter among the joint ones.
    pub places: Vec<usize>,
}

impl<const NX: usize, E: Equations<NX>> JointMember<'_, NX, E> {
    /// The member's parameters among the joint ones.
    pub fn parameters(&self, joint: &[f64]) -> Vec<f64> {
        values_at(&self.places, joint)
    }

    /// Adds the member's matrix to the joint one.
    pub fn add(&self, matrix: &DMatrix<f64>, sum: &mut DMatrix<f64>) {
        add_matrix(&self.places, matrix, sum);
    }
}

impl<'a, const NX: usize, E: Equations<NX>> Joint<'a, NX, E> {
    /// Joins maneuvers, each with a label for its own parameters. `is_own` selects the derivatives
    /// that each maneuver keeps to itself.
    ///
    /// # Errors
    /// A sentence that names the maneuver whose free derivatives differ from the first maneuver's.
    pub fn new(
        cases: impl IntoIterator<Item = (&'a str, &'a Case<NX, E>)>,
        is_own: impl Fn(&str) -> bool,
    ) -> Result<Self, String> {
        let cases: Vec<(&str, &Case<NX, E>)> = cases.into_iter().collect();
        let named = cases
            .iter()
            .map(|(label, case)| (*label, case.names.as_slice(), case.derivatives()));
        let parameters = SharedParameters::new(named, is_own)?;
        let members = cases
            .iter()
            .enumerate()
            .map(|(i, (label, case))| JointMember {
                label,
                case,
                places: parameters.places(i).to_vec(),
            });
        Ok(Joint {
            members: members.collect(),
            parameters,
        })
    }

    /// Parameters with their places.
    #[must_use]
    pub fn parameters(&self) -> &SharedParameters {
        &self.parameters
    }

    /// Cost J (1.2) of each member alone, at a joint response.
    #[must_use]
    pub fn costs(&self, response: &[Response], weights: &[f64; OUTPUTS]) -> Vec<f64> {
        let members = self.members.iter().zip(response);
        members
            .map(|(m, r)| Likelihood::sums(m.case, r, weights).cost())
            .collect()
    }
}

impl<'a, const NX: usize, E: Equations<NX>> Joint<'a, NX, E> {
    /// Computes each member's response. For a divergence, samples are counted through the members
    /// in order.
    fn respond_each(
        &self,
        response: &mut [Response],
        respond: impl Fn(&JointMember<'a, NX, E>, &mut Response) -> Result<(), Diverged>,
    ) -> Result<(), Diverged> {
        let mut before = 0;
        for (member, response) in self.members.iter().zip(response) {
            respond(member, response).map_err(|d| Diverged {
                sample: before + d.sample,
            })?;
            before += member.case.samples();
        }
        Ok(())
    }
}

impl<const NX: usize, E: Equations<NX>> Likelihood for Joint<'_, NX, E> {
    type Response = Vec<Response>;

    fn names(&self) -> &[String] {
        self.parameters.names()
    }

    fn response(&self) -> Vec<Response> {
        self.members.iter().map(|m| m.case.response()).collect()
    }

    fn has_coarse(&self) -> bool {
        self.members.iter().all(|member| member.case.has_coarse())
    }

    fn respond(
        &self,
        detail: Detail,
        parameters: &[f64],
        response: &mut Vec<Response>,
    ) -> Result<(), Diverged> {
        self.respond_each(response, |member, response| {
            member
                .case
                .respond_with(detail, &member.parameters(parameters), response)
        })
    }

    fn sums(&self, response: &Vec<Response>, weights: &[f64; OUTPUTS]) -> Sums {
        let n = self.names().len();
        let mut sums = Sums {
            weighted_square: 0.0,
            gradient: DVector::zeros(n),
            information: DMatrix::zeros(n, n),
            count: 0,
        };
        for (member, response) in self.members.iter().zip(response) {
            let own = cost::sums(response, weights);
            sums.weighted_square += own.weighted_square;
            sums.count += own.count;
            add_vector(&member.places, &own.gradient, &mut sums.gradient);
            member.add(&own.information, &mut sums.information);
        }
        sums
    }

    /// Variances pooled over the members by their samples. All parameters of a member count against
    /// its degrees of freedom, also shared ones.
    fn variances(&self, response: &Vec<Response>) -> [f64; OUTPUTS] {
        let (mut squares, mut counts) = ([0.0; OUTPUTS], [0.0; OUTPUTS]);
        for (member, response) in self.members.iter().zip(response) {
            let (variances, used) = (
                Likelihood::variances(member.case, response),
                member.case.used(),
            );
            for o in 0..OUTPUTS {
                squares[o] += variances[o] * used[o] as f64;
                counts[o] += used[o] as f64;
            }
        }
        std::array::from_fn(|o| squares[o] / f64::max(counts[o], 1.0))
    }

    fn place(&self, diverged: Diverged) -> String {
        let mut sample = diverged.sample;
        for member in &self.members {
            if sample < member.case.samples() {
                return format!(
                    "{:.2} s into {}",
                    sample as f64 * member.case.step_s,
                    member.label
                );
            }
            sample -= member.case.samples();
        }
        "in a maneuver".to_owned()
    }
}
