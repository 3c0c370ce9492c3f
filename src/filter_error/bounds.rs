//! Covariance of the estimates of filter error, with the effects of held values and of calibration
//! errors through the filter's own weights.
//!
//! If the innovations are white, the covariance is the inverse H⁻¹ of the information matrix. The
//! corrected covariance uses the autocovariance of the innovations, as output error uses that of
//! the residuals. It is never below H⁻¹.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::filter::Filter;
use super::joint_filter::JointFilter;
use super::response::FilterResponse;
use super::scoring::Scored;
use super::slopes::{SlopeEffect, SlopeInformation, SlopePrior};
use crate::dynamics::{InGusts, OUTPUTS};
use crate::numerics::linear_algebra::matrix::AlignedMatrix;
use crate::numerics::linear_algebra::symmetric;

use crate::output_error::bounds::block_series::BlockSeries;
use crate::output_error::bounds::coloured;
use crate::output_error::likelihood::information::Identification;
use crate::output_error::sharing::{SharedParameters, add_matrix, add_vector};

/// Covariances of the own parameters of filters: derivatives, biases and initial states.
#[derive(Clone, Debug)]
pub struct FilterBounds {
    pub covariance: DMatrix<f64>,
    pub condition_number: f64,
    /// Inverse H⁻¹ of the information on the filter's own parameters, with the noise held at its
    /// estimate.
    inverse: DMatrix<f64>,
}

/// Computes the bounds of a fit.
///
/// # Errors
/// If the data determine no covariance: condition number, and the parameters of the least
/// determined direction.
pub fn bounds<const NX: usize, E: InGusts<NX>>(
    filter: &JointFilter<NX, E>,
    scored: &Scored,
    max_condition_number: f64,
) -> Result<FilterBounds, (Option<f64>, Vec<usize>)> {
    let free: Vec<usize> = (0..filter.parameters())
        .filter(|j| scored.free[*j])
        .collect();
    let information = filter.information(&scored.response);
    let of_free = DMatrix::from_fn(free.len(), free.len(), |i, j| {
        information[(free[i], free[j])]
    });
    let (of_free, condition_number) = match Identification::identify(&of_free, max_condition_number)
    {
        Identification::Determined {
            inverse,
            condition_number,
        } => (inverse, condition_number),
        Identification::Undetermined {
            condition_number,
            parameters,
        } => {
            let named = parameters.into_iter().map(|j| free[j]);
            let without_noise = named.filter(|j| *j < filter.first_noise());
            return Err((condition_number, without_noise.collect()));
        }
    };
    let mut inverse = DMatrix::zeros(filter.parameters(), filter.parameters());
    for (i, &row) in free.iter().enumerate() {
        for (j, &column) in free.iter().enumerate() {
            inverse[(row, column)] = of_free[(i, j)];
        }
    }
    let without_noise = |matrix: &DMatrix<f64>| {
        let n = filter.first_noise();
        matrix.view((0, 0), (n, n)).into_owned()
    };
    let covariance = without_noise(&inverse);
    let at_known_noise = symmetric::inverse(&without_noise(&information));
    let at_known_noise = at_known_noise.unwrap_or_else(|| covariance.clone());
    Ok(FilterBounds {
        covariance,
        condition_number,
        inverse: at_known_noise,
    })
}

impl<const NX: usize, E: InGusts<NX>> Filter<NX, E> {
    /// Whitened innovations with their sensitivities to the filter's own parameters, one series per
    /// output.
    fn series(&self, response: &FilterResponse) -> Vec<BlockSeries> {
        let (sums, n) = (&response.sums, self.first_noise());
        let length = sums.samples_per_block();
        let series = (0..OUTPUTS).map(|o| {
            let squares = sums.squares(o).view((0, 0), (n, n)).into_owned();
            let sums_of = |samples: Range<usize>, row: &mut [f64]| {
                sums.block(samples.start / length, o, &mut row[..n])
            };
            let samples = self.samples();
            BlockSeries::new(
                self.case.step_s,
                1.0,
                samples,
                sums.square(o),
                &squares,
                sums_of,
            )
        });
        series.collect()
    }
}

impl FilterBounds {
    /// Covariance of a filter's own parameters from H⁻¹ and the innovations' autocovariance, at known
    /// noise: the noise's parameters hardly correlate with the others.
    #[must_use]
    pub fn corrected<const NX: usize, E: InGusts<NX>>(
        &self,
        filter: &JointFilter<NX, E>,
        scored: &Scored,
    ) -> DMatrix<f64> {
        let response = &scored.response;
        let aligned = AlignedMatrix::from_symmetric(&self.inverse);
        let n = self.inverse.nrows();
        let sharing = filter.own();
        let members = filter.filters().iter().zip(&response.members).enumerate();
        let series = members.flat_map(|(i, (filter, response))| {
            let places = sharing.places(i);
            let series = filter.series(response).into_iter();
            series.map(|series| series.with_parameters(places, n))
        });
        let series: Vec<BlockSeries> = series.collect();
        let innovations = coloured::covariance(&aligned, &series).widened_by_student_t();
        let others = filter.other_information(response);
        let others = others.view((0, 0), (n, n));
        let corrected = innovations + &self.inverse * others * &self.inverse;
        symmetric::raise_variances(corrected, &self.covariance)
    }

    /// `true` if a change of the parameters is large beside their bounds.
    #[must_use]
    pub fn are_exceeded_by(&self, change: &DVector<f64>, share: f64) -> bool {
        let variances = self.covariance.diagonal();
        let mut changes = change.iter().zip(variances.iter());
        changes.any(|(change, variance)| change.powi(2) > share * share * variance)
    }

    /// Changes of the filter's own parameters from changes of the gradient.
    #[must_use]
    pub fn changes(&self, gradient_shifts: &[DVector<f64>]) -> Vec<DVector<f64>> {
        let n = self.covariance.nrows();
        let change = |shift: &DVector<f64>| &self.inverse * shift.rows(0, n);
        gradient_shifts.iter().map(change).collect()
    }
}

/// Information at a fit from a wide filter, in which held derivatives and slopes over α are free as
/// well.
#[derive(Debug)]
pub struct WidePass {
    /// Names of the filter's own parameters.
    own: Vec<String>,
    /// Names of the wide filter's own parameters.
    names: Vec<String>,
    information: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl WidePass {
    /// Computes the pass of the wide filter `wide` at the fit of `filter`, whose noise it knows.
    /// `values` has the parameters by name; a parameter without a value is zero. `None` if the wide
    /// filter diverges.
    #[must_use]
    pub fn pass_at_fit<const NX: usize, E: InGusts<NX>>(
        filter: &Filter<NX, E>,
        wide: &Filter<NX, E>,
        values: &BTreeMap<&str, f64>,
    ) -> Option<Self> {
        let value = |name: &String| values.get(name.as_str()).copied().unwrap_or(0.0);
        let wide_parameters: Vec<f64> = wide.names().iter().map(value).collect();
        let response = wide.respond(&wide_parameters).ok()?;
        Some(WidePass {
            own: filter.names().to_vec(),
            names: wide.names().to_vec(),
            information: response.information(),
            gradient: response.gradient(),
        })
    }

    /// Makes the parameter `to` also move the parameter `from`, by a factor.
    pub fn add_column(&mut self, from: &str, factor: f64, to: &str) {
        let (Some(from), Some(to)) = (self.index_of(from), self.index_of(to)) else {
            return;
        };
        let information = &mut self.information;
        let column = information.column(from) * factor;
        information.set_column(to, &(information.column(to) + column));
        let row = information.row(from) * factor;
        information.set_row(to, &(information.row(to) + row));
        self.gradient[to] += factor * self.gradient[from];
    }

    /// Joins the passes of maneuvers; `own` places their own parameters in the joint fit. Held
    /// derivatives and slopes of one name are common to the maneuvers.
    #[must_use]
    pub fn joined(members: &[WidePass], sharing: &SharedParameters) -> Self {
        let mut names: Vec<String> = vec![];
        let mut all_places = Vec::with_capacity(members.len());
        for (i, member) in members.iter().enumerate() {
            let mut places = Vec::with_capacity(member.names.len());
            for name in member.joint_names(sharing, i) {
                let position = names.iter().position(|n| n == name);
                places.push(position.unwrap_or(names.len()));
                if position.is_none() {
                    names.push(name.clone());
                }
            }
            all_places.push(places);
        }
        let n = names.len();
        let (mut information, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for (member, places) in members.iter().zip(&all_places) {
            add_matrix(places, &member.information, &mut information);
            add_vector(places, &member.gradient, &mut gradient);
        }
        WidePass {
            own: sharing.names().to_vec(),
            names,
            information,
            gradient,
        }
    }

    /// Names of the parameters of one maneuver in the joint fit.
    fn joint_names<'n>(&'n self, sharing: &'n SharedParameters, member: usize) -> Vec<&'n String> {
        let places = sharing.places(member);
        let joint = |name: &'n String| {
            let place = self.own.iter().position(|n| n == name);
            place.map_or(name, |j| &sharing.names()[places[j]])
        };
        self.names.iter().map(joint).collect()
    }

    fn index_of(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// Column of the information along a parameter, for the filter's own parameters.
    fn cross(&self, along: Option<usize>) -> DVector<f64> {
        let entry = |name: &String| match (self.index_of(name), along) {
            (Some(row), Some(column)) => self.information[(row, column)],
            _ => 0.0,
        };
        DVector::from_iterator(self.own.len(), self.own.iter().map(entry))
    }

    /// Changes of the gradient by one standard uncertainty of each held value.
    #[must_use]
    pub fn held_shifts(&self, uncertainties: &BTreeMap<&str, f64>) -> Vec<DVector<f64>> {
        let shift =
            |(name, uncertainty): (&&str, &f64)| self.cross(self.index_of(name)) * *uncertainty;
        uncertainties.iter().map(shift).collect()
    }

    /// Effect on the estimates of slopes over α. `values` has the slopes at which the fit held them.
    #[must_use]
    pub fn slope_effect(
        &self,
        bounds: &FilterBounds,
        slopes: &[String],
        values: &[f64],
        priors: &[SlopePrior],
    ) -> Option<SlopeEffect> {
        let places: Vec<usize> = slopes
            .iter()
            .filter_map(|name| self.index_of(name))
            .collect();
        if places.len() != values.len() || places.is_empty() {
            return None;
        }
        let columns: Vec<DVector<f64>> = places.iter().map(|p| self.cross(Some(*p))).collect();
        let n = places.len();
        let information = SlopeInformation {
            inverse: bounds.inverse.clone(),
            cross: DMatrix::from_columns(&columns),
            slopes: DMatrix::from_fn(n, n, |i, j| self.information[(places[i], places[j])]),
            gradient: DVector::from_iterator(n, places.iter().map(|p| self.gradient[*p])),
            held_at: DVector::from_column_slice(values),
            priors: priors.to_vec(),
        };
        information.effect()
    }
}
