//! Outlook: covariance of the posterior after planned maneuvers.
//!
//! The covariance of a Gaussian posterior follows from the design and the noise of its data, not
//! from their values. Let z be the unknowns, with the posterior's covariance P, and u the
//! calibration errors of the common flight of the planned maneuvers. A are the rows of the planned
//! estimates over z, K the effects of u on them, and B the rows of the quantities of interest. An
//! [`Outlook`] holds the covariance of (A z + K u, B z). A maneuver then observes its rows of A z +
//! K u with its own noise.
//!
//! Scales and weights are taken from the posterior; P includes the uncertainty of the scales. The
//! values of the evidence have no effect, so it may have been computed with other held values.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::campaign_model::Model;
use super::local::{LocalValue, local_shares};
use crate::aero::{AeroModel, Condition, WindTunnel};
use crate::model::evidence::{ManeuverResults, in_order};
use crate::model::fusion::coefficient::{CoefficientPosterior, Data};
use crate::model::fusion::observation::Observation;
use crate::model::fusion::posterior::{gaussian, information};
use crate::model::fusion::unknowns::{SparseRow, Unknowns, covariance_between, is_of_campaign};
use crate::model::prior::term::{PosteriorTerm, TermSources};
use crate::model::settings::Settings;
use crate::numerics::linear_algebra::root::EXACT;
use crate::output_error::error_effect::SharedError;

/// Quantity at a flight condition.
#[derive(Clone, Debug, PartialEq)]
pub struct OutlookPoint {
    pub quantity: PointQuantity,
    pub condition: Condition,
}

/// Quantity whose variance is needed.
#[derive(Clone, Debug, PartialEq)]
pub enum PointQuantity {
    /// A derivative, or sum of derivatives, as published.
    Published(String),
    /// Linear combination of the values of [`Model::posterior_at_condition`]. Its variance is the
    /// sum of its variances in each coefficient.
    Combination(Vec<(LocalValue, f64)>),
}

/// Rows of a planned maneuver's estimates, with the covariance of the errors that no other maneuver
/// shares.
#[derive(Clone, Debug)]
pub struct PlannedRows {
    pub rows: Range<usize>,
    pub noise: DMatrix<f64>,
}

/// Joint covariance of planned maneuvers and points of one coefficient.
#[derive(Clone, Debug)]
pub struct Outlook {
    /// Covariance of the rows of all planned maneuvers, then of the points.
    pub covariance: DMatrix<f64>,
    /// In the order of the planned maneuvers; `None` for one that estimates nothing of the
    /// coefficient.
    pub planned: Vec<Option<PlannedRows>>,
    /// Index among the requested points, and row, of each point that depends on the coefficient.
    pub points: Vec<(usize, usize)>,
}

impl Model {
    /// Outlook of each coefficient on planned maneuvers of one flight and on points. `evidence`,
    /// `aero_model`, `tunnel` and `settings` must be the ones from which the posterior was made. A
    /// coefficient whose covariance is not finite is left out.
    #[must_use]
    pub fn outlook(
        &self,
        (evidence, planned): (&[ManeuverResults], &[ManeuverResults]),
        points: &[OutlookPoint],
        (aero_model, tunnel): (&AeroModel, &WindTunnel),
        settings: &Settings,
    ) -> Vec<Outlook> {
        let evidence = in_order(evidence);
        let tunnel = tunnel.clamped();
        let basis = TermSources {
            aero_model,
            tunnel: &tunnel,
            settings,
        };
        let all = self.coefficients.iter();
        all.filter_map(|(_, posterior)| posterior.outlook((&evidence, planned), points, &basis))
            .collect()
    }
}

impl Model {
    /// Unit and breakpoints in α of a derivative or sum; `None` if the posterior does not have it.
    #[must_use]
    pub fn breakpoints_deg(&self, derivative: &str) -> Option<(&'static str, &[f64])> {
        let all = self.coefficients.iter();
        let mut terms = all.flat_map(|(_, posterior)| &posterior.terms);
        let is_derivative =
            |t: &&PosteriorTerm| t.prior.name == derivative || t.derivative == derivative;
        let term = terms.find(is_derivative)?;
        Some((term.unit, &term.breakpoints_deg))
    }

    /// Derivatives and sums that are estimated, in the order of the model.
    pub fn quantities(&self) -> impl Iterator<Item = &str> {
        let all = self.coefficients.iter();
        let terms = all.flat_map(|(_, posterior)| &posterior.terms);
        terms.map(|term| term.prior.name.as_str())
    }
}

impl CoefficientPosterior {
    fn outlook(
        &self,
        (evidence, planned): (&[ManeuverResults], &[ManeuverResults]),
        points: &[OutlookPoint],
        basis: &TermSources,
    ) -> Option<Outlook> {
        let (mut data, observed) = Data::with_planned(&self.terms, evidence, planned, basis);
        data.set_noise(&self.terms, &self.noise_scales);
        let covariance = self.covariance(&data, evidence.len())?;
        let unknowns = &data.unknowns;
        let mut rows: Vec<SparseRow> = vec![];
        let mut planned_rows = Vec::with_capacity(observed.len());
        for observation in &observed {
            let placed = observation.as_ref().map(|(class, observation)| {
                let first = rows.len();
                rows.extend(unknowns.rows(&self.terms, *class, observation));
                PlannedRows {
                    rows: first..rows.len(),
                    noise: observation.whole_noise(&self.terms, &self.noise_scales),
                }
            });
            planned_rows.push(placed);
        }
        let of_planned = rows.len();
        let mut point_rows = Vec::new();
        for (i, point) in points.iter().enumerate() {
            if let Some(row) = self.row(point, unknowns) {
                point_rows.push((i, rows.len()));
                rows.push(row);
            }
        }
        let mut joint = DMatrix::from_fn(rows.len(), rows.len(), |i, j| {
            covariance_between(&rows[i], &rows[j], &covariance)
        });
        let mut calibrated = joint.view_mut((0, 0), (of_planned, of_planned));
        calibrated += calibration(&observed, &planned_rows, of_planned);
        Some(Outlook {
            covariance: joint,
            planned: planned_rows,
            points: point_rows,
        })
    }

    /// Covariance of all unknowns, including the errors that planned maneuvers share. The
    /// covariance of the differences includes the uncertainty of the scales.
    fn covariance(&self, data: &Data, maneuvers: usize) -> Option<DMatrix<f64>> {
        let mut weights = vec![1.0; maneuvers];
        for (place, weight) in &self.weights {
            weights[*place] = *weight;
        }
        let unknowns = &data.unknowns;
        let sums = information(&data.flights, &weights, unknowns.count);
        let root = unknowns.root(&self.terms, &self.scales, EXACT);
        let mut covariance = gaussian(&root, &sums)?.covariance;
        if !covariance.iter().all(|v| v.is_finite()) {
            return None;
        }
        let differences = (unknowns.differences, unknowns.differences);
        let published = self.gaussian.covariance.view((0, 0), differences);
        let mut of_differences = covariance.view_mut((0, 0), differences);
        of_differences += positive(&(published - &of_differences));
        Some(covariance)
    }

    /// Row of a point over the unknowns; `None` for a point that does not depend on the
    /// coefficient.
    fn row(&self, point: &OutlookPoint, unknowns: &Unknowns) -> Option<SparseRow> {
        match &point.quantity {
            PointQuantity::Published(name) => self.published_row(name, &point.condition, unknowns),
            PointQuantity::Combination(values) => {
                self.combined_row(values, &point.condition, unknowns)
            }
        }
    }

    /// Row of a term, or of the constant of a sum; `None` for a derivative of another coefficient.
    fn published_row(
        &self,
        name: &str,
        condition: &Condition,
        unknowns: &Unknowns,
    ) -> Option<SparseRow> {
        let of_term = |place: usize, weight: f64| {
            let shares = self.terms[place].prior.grid.shares(condition);
            let start = unknowns.starts[place];
            let weighted = shares.into_iter();
            weighted.map(move |(node, share)| (start + node, weight * share))
        };
        let place = |is: &dyn Fn(&PosteriorTerm) -> bool| self.terms.iter().position(is);
        if let Some(term) = place(&|t| t.prior.name == name) {
            return Some(of_term(term, 1.0).collect());
        }
        let term = place(&|t| t.derivative == name)?;
        let slope = self.terms[term].slope.as_ref()?;
        let slope = place(&|t| t.derivative == *slope)?;
        let of_slope = of_term(slope, -condition.alpha_deg);
        Some(of_term(term, 1.0).chain(of_slope).collect())
    }

    /// Row of the coefficient's part in a combination; `None` if it has none.
    fn combined_row(
        &self,
        values: &[(LocalValue, f64)],
        condition: &Condition,
        unknowns: &Unknowns,
    ) -> Option<SparseRow> {
        let mut row = SparseRow::new();
        for (value, weight) in values {
            let mut terms = self.terms.iter().zip(&unknowns.starts);
            let term_and_start = terms.find(|(term, _)| term.derivative == value.derivative);
            let Some((term, start)) = term_and_start else {
                continue;
            };
            let shares = local_shares(term, condition, value.is_mach_slope).unwrap_or_default();
            let shares = shares.into_iter();
            row.extend(shares.map(|(node, share)| (start + node, weight * share)));
        }
        (!row.is_empty()).then_some(row)
    }
}

/// Positive semidefinite part of a symmetric matrix, since rounding leaves tiny negative
/// eigenvalues.
fn positive(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let mut eigen = matrix.clone().symmetric_eigen();
    eigen.eigenvalues.apply(|value| *value = value.max(0.0));
    eigen.recompose()
}

/// Covariance K Kᵀ from the calibration errors that the planned maneuvers share with their flight.
fn calibration(
    observed: &[Option<(usize, Observation)>],
    placed: &[Option<PlannedRows>],
    rows: usize,
) -> DMatrix<f64> {
    let mut effects: BTreeMap<&SharedError, DVector<f64>> = BTreeMap::new();
    for (observation, placed) in observed.iter().flatten().zip(placed.iter().flatten()) {
        let of_flight = observation.1.calibration.iter();
        for (error, change) in of_flight.filter(|(error, _)| !is_of_campaign(error)) {
            let effect = effects.entry(error).or_insert_with(|| DVector::zeros(rows));
            effect.rows_range_mut(placed.rows.clone()).copy_from(change);
        }
    }
    let mut sum = DMatrix::zeros(rows, rows);
    for effect in effects.values() {
        sum += effect * effect.transpose();
    }
    sum
}
