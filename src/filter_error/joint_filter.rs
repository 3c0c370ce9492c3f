//! Filters of several maneuvers that share derivatives. The cost is the sum over the maneuvers.
//! Each maneuver keeps its own biases, initial states, derivatives that act as biases, noise and
//! gains. A single maneuver is treated as a group of one.
//!
//! Parameters in order: the shared derivatives, each maneuver's own parameters, then each
//! maneuver's noise.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::filter::Filter;
use super::noise::{Noise, NoiseParameter};
use super::response::FilterResponse;
use crate::dynamics::{InGusts, OUTPUTS};
use crate::output_error::Diverged;
use crate::output_error::sharing::{SharedParameters, add_matrix, add_vector, values_at};

/// Maneuvers with shared derivatives, or one maneuver.
#[derive(Debug)]
pub struct JointFilter<'f, const NX: usize, E: InGusts<NX>> {
    filters: &'f [Filter<NX, E>],
    /// Derivatives, biases and initial states of all maneuvers, with their places.
    own: &'f SharedParameters,
    noise_is_known: bool,
}

/// Result of a pass over all maneuvers.
#[derive(Clone, Debug)]
pub struct JointResponse {
    /// Response of each maneuver.
    pub members: Vec<FilterResponse>,
    /// Cost J of all maneuvers, priors included.
    pub cost: f64,
}

impl JointResponse {
    fn sum_members(members: Vec<FilterResponse>) -> Self {
        JointResponse {
            cost: members.iter().map(|r| r.cost).sum(),
            members,
        }
    }
}

impl<'f, const NX: usize, E: InGusts<NX>> JointFilter<'f, NX, E> {
    /// Joins filters; `own` places their derivatives, biases and initial states.
    #[must_use]
    pub fn new(filters: &'f [Filter<NX, E>], own: &'f SharedParameters) -> Self {
        JointFilter {
            filters,
            own,
            noise_is_known: false,
        }
    }

    /// Fixes the noise where the iteration starts.
    #[must_use]
    pub fn with_known_noise(self) -> Self {
        JointFilter {
            noise_is_known: true,
            ..self
        }
    }

    /// Filter of each maneuver.
    #[must_use]
    pub fn filters(&self) -> &'f [Filter<NX, E>] {
        self.filters
    }

    /// Derivatives, biases and initial states with their places.
    #[must_use]
    pub fn own(&self) -> &'f SharedParameters {
        self.own
    }

    /// Number of derivatives, biases and initial states.
    #[must_use]
    pub fn first_noise(&self) -> usize {
        self.own.names().len()
    }

    /// Number of all parameters.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.noise_places(self.filters.len()).start
    }

    /// Places of the noise of a maneuver.
    fn noise_places(&self, member: usize) -> Range<usize> {
        let count = |filter: &Filter<NX, E>| filter.noise_parameters().len();
        let before: usize = self.filters.iter().take(member).map(count).sum();
        let first = self.first_noise() + before;
        first..first + self.filters.get(member).map_or(0, count)
    }

    /// Place of each parameter of a maneuver, its noise included.
    fn places(&self, member: usize) -> Vec<usize> {
        let places = self.own.places(member).iter().copied();
        places.chain(self.noise_places(member)).collect()
    }

    /// Filters with the places of their parameters.
    fn members(&self) -> impl Iterator<Item = (&'f Filter<NX, E>, Vec<usize>)> {
        let filters = self.filters.iter().enumerate();
        filters.map(|(i, filter)| (filter, self.places(i)))
    }

    /// Parameters of a maneuver's filter.
    #[must_use]
    pub fn parameters_of(&self, member: usize, joint: &[f64]) -> Vec<f64> {
        values_at(&self.places(member), joint)
    }

    /// Noise of each maneuver.
    #[must_use]
    pub fn noise(&self, parameters: &[f64]) -> Vec<Noise> {
        let members = self.members();
        members
            .map(|(filter, places)| filter.noise(&values_at(&places, parameters)))
            .collect()
    }

    /// Derivatives, biases and initial states with the noise of each maneuver.
    #[must_use]
    pub fn with_noise(&self, own: &[f64], noise: &[Noise]) -> Vec<f64> {
        let gusts = E::AIR_RELATIVE_RATES.len();
        let noise = noise.iter().flat_map(|noise| noise.parameters(gusts));
        own.iter().copied().chain(noise).collect()
    }

    /// Computes a pass with sensitivities.
    ///
    /// # Errors
    /// [`Diverged`] when a state leaves its bounds or a filter has no finite gain.
    pub fn respond(&self, parameters: &[f64]) -> Result<JointResponse, Diverged> {
        let respond = |(filter, places): (&Filter<NX, E>, Vec<usize>)| {
            filter.respond(&values_at(&places, parameters))
        };
        let members: Result<_, _> = self.members().map(respond).collect();
        Ok(JointResponse::sum_members(members?))
    }

    /// Computes the innovations alone.
    ///
    /// # Errors
    /// [`Diverged`] when a state leaves its bounds or a filter has no finite gain.
    pub fn innovations(&self, parameters: &[f64]) -> Result<JointResponse, Diverged> {
        let respond = |(filter, places): (&Filter<NX, E>, Vec<usize>)| {
            filter.innovations(&values_at(&places, parameters))
        };
        let members: Result<_, _> = self.members().map(respond).collect();
        Ok(JointResponse::sum_members(members?))
    }

    /// Gradient of −J.
    #[must_use]
    pub fn gradient(&self, response: &JointResponse) -> DVector<f64> {
        let mut sum = DVector::zeros(self.parameters());
        for ((_, places), response) in self.members().zip(&response.members) {
            add_vector(&places, &response.gradient(), &mut sum);
        }
        sum
    }

    /// Expected second gradient of J.
    #[must_use]
    pub fn information(&self, response: &JointResponse) -> DMatrix<f64> {
        self.sum_of(response, FilterResponse::information)
    }

    /// Part of the information that comes from the covariance of the innovations and the priors.
    pub(super) fn other_information(&self, response: &JointResponse) -> DMatrix<f64> {
        self.sum_of(response, |response| response.other_information().clone())
    }

    fn sum_of(
        &self,
        response: &JointResponse,
        matrix: impl Fn(&FilterResponse) -> DMatrix<f64>,
    ) -> DMatrix<f64> {
        let n = self.parameters();
        let mut sum = DMatrix::zeros(n, n);
        for ((_, places), response) in self.members().zip(&response.members) {
            add_matrix(&places, &matrix(response), &mut sum);
        }
        sum
    }

    /// Lower limits of the parameters during the iteration: none for derivatives, biases and
    /// initial states. The limits of the noise parameters follow from `resolutions`, the smallest
    /// standard deviation of each output of each maneuver.
    #[must_use]
    pub fn floors(&self, resolutions: &[[f64; OUTPUTS]]) -> Vec<f64> {
        let unlimited = vec![f64::NEG_INFINITY; self.first_noise()];
        let members = self.filters.iter().zip(resolutions);
        let noise = members.flat_map(|(filter, resolution)| {
            let parameters = filter.noise_parameters().iter();
            parameters.map(|parameter| parameter.floor(resolution))
        });
        unlimited.into_iter().chain(noise).collect()
    }

    /// Fixes noise parameters that the data do not determine: all of them if the noise is known.
    /// Otherwise the noise of outputs that never count, and corner and correlations of rotary gusts
    /// of fixed size.
    pub(super) fn fix_noise(&self, free: &mut [bool]) {
        if self.noise_is_known {
            free[self.first_noise()..].fill(false);
        }
        for (member, filter) in self.filters.iter().enumerate() {
            let noise = &mut free[self.noise_places(member)];
            fix_unmeasured(filter, noise);
            fix_without_effect(
                filter.noise_parameters(),
                E::AIR_RELATIVE_RATES.len(),
                noise,
            );
        }
    }
}

/// Marks the noise of outputs that never count as fixed.
fn fix_unmeasured<const NX: usize, E: InGusts<NX>>(filter: &Filter<NX, E>, free: &mut [bool]) {
    for (kind, free) in filter.noise_parameters().iter().zip(free) {
        if let NoiseParameter::Output(output) = kind {
            *free &= filter.case.measurements.have(*output);
        }
    }
}

fn fix_without_effect(kinds: &[NoiseParameter], gusts: usize, free: &mut [bool]) {
    let is_fixed = |free: &[bool], kind: NoiseParameter| {
        let place = kinds.iter().position(|k| *k == kind);
        place.is_some_and(|n| !free[n])
    };
    let all_fixed = (0..gusts).all(|g| is_fixed(free, NoiseParameter::Gust(g)));
    for (n, kind) in kinds.iter().enumerate() {
        let without_effect = match *kind {
            NoiseParameter::Corner => all_fixed,
            NoiseParameter::Correlation(g) => {
                is_fixed(free, NoiseParameter::Gust(g)) || is_fixed(free, NoiseParameter::Angle)
            }
            _ => false,
        };
        if without_effect {
            free[n] = false;
        }
    }
}
