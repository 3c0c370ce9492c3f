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
use crate::dynamics::{Equations, OUTPUTS};
use crate::output_error::case::Case;
use crate::output_error::kernel::pass::Diverged;
use crate::output_error::kernel::response::{Detail, Response};

/// Maneuvers with shared derivatives.
#[derive(Debug)]
pub struct Joint<'a, const NX: usize, E: Equations<NX>> {
    pub(crate) members: Vec<Member<'a, NX, E>>,
    /// Places of the shared derivatives among a member's parameters.
    shared: Vec<usize>,
    names: Vec<String>,
}

/// One of the maneuvers.
#[derive(Debug)]
pub(crate) struct Member<'a, const NX: usize, E: Equations<NX>> {
    label: &'a str,
    pub case: &'a Case<NX, E>,
    /// Place of each own parameter among the joint ones.
    pub places: Vec<usize>,
}

impl<const NX: usize, E: Equations<NX>> Member<'_, NX, E> {
    /// The member's parameters among the joint ones.
    pub fn parameters(&self, joint: &[f64]) -> Vec<f64> {
        self.places.iter().map(|&place| joint[place]).collect()
    }

    /// Adds the member's matrix to the joint one.
    pub fn add(&self, matrix: &DMatrix<f64>, sum: &mut DMatrix<f64>) {
        for (j, &column) in self.places.iter().enumerate() {
            for (i, &row) in self.places.iter().enumerate() {
                sum[(row, column)] += matrix[(i, j)];
            }
        }
    }
}

impl<'a, const NX: usize, E: Equations<NX>> Joint<'a, NX, E> {
    /// Joins maneuvers, each with a label for its own parameters. `is_own` selects the derivatives
    /// that each maneuver keeps to itself.
    ///
    /// # Errors
    /// A sentence that names the maneuver whose free derivatives are not those of the first.
    pub fn new(
        cases: impl IntoIterator<Item = (&'a str, &'a Case<NX, E>)>,
        is_own: impl Fn(&str) -> bool,
    ) -> Result<Self, String> {
        let mut joint = Joint {
            members: Vec::new(),
            shared: Vec::new(),
            names: Vec::new(),
        };
        for (label, case) in cases {
            let derivatives = &case.names[..case.derivatives()];
            match joint.members.first().map(|first| first.case) {
                None => joint.share(derivatives, &is_own),
                Some(first) if *derivatives == first.names[..first.derivatives()] => {}
                Some(_) => {
                    return Err(format!(
                        "{label} has other free derivatives than the maneuvers it is joined with"
                    ));
                }
            }
            let places = joint.place_parameters(label, &case.names);
            joint.members.push(Member {
                label,
                case,
                places,
            });
        }
        Ok(joint)
    }

    /// Sets the shared derivatives: those of the first maneuver that no maneuver keeps to itself.
    fn share(&mut self, derivatives: &[String], is_own: impl Fn(&str) -> bool) {
        for (j, name) in derivatives.iter().enumerate() {
            if !is_own(name) {
                self.shared.push(j);
                self.names.push(name.clone());
            }
        }
    }

    /// Places of a maneuver's parameters; its own are appended to the joint ones.
    fn place_parameters(&mut self, label: &str, names: &[String]) -> Vec<usize> {
        let mut places = Vec::with_capacity(names.len());
        for (j, name) in names.iter().enumerate() {
            if let Some(place) = self.shared.iter().position(|&s| s == j) {
                places.push(place);
            } else {
                places.push(self.names.len());
                self.names.push(format!("{name} of {label}"));
            }
        }
        places
    }

    /// Places of the shared derivatives among a member's parameters.
    #[must_use]
    pub fn shared(&self) -> &[usize] {
        &self.shared
    }

    /// Place of each parameter of a member among the joint ones.
    #[must_use]
    pub fn places(&self, member: usize) -> &[usize] {
        self.members.get(member).map_or(&[], |m| &m.places)
    }

    /// Joint parameters from the shared derivatives and each member's full set, of which its own
    /// part is used.
    #[must_use]
    pub fn assemble(&self, shared: &[f64], members: &[Vec<f64>]) -> Vec<f64> {
        let mut joint = shared.to_vec();
        for values in members {
            let own = values
                .iter()
                .enumerate()
                .filter(|(j, _)| !self.shared.contains(j));
            joint.extend(own.map(|(_, v)| *v));
        }
        joint
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
    /// Computes each member's response. The sample of a divergence counts through the members in
    /// order.
    fn respond_each(
        &self,
        response: &mut [Response],
        respond: impl Fn(&Member<'a, NX, E>, &mut Response) -> Result<(), Diverged>,
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
        &self.names
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
        let n = self.names.len();
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
            for (g, &place) in own.gradient.iter().zip(&member.places) {
                sums.gradient[place] += g;
            }
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
