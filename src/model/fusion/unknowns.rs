//! Unknowns of a coefficient in one vector. Differences from the tunnel at the points of the grids
//! come first, then errors that all maneuvers of a class, or of the campaign, share.
//!
//! The systematic error of a class is, for each derivative that it estimates, a function of α in
//! units of the bounds of a maneuver. Its variance is ω², and its correlation fades over 10°.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};

use super::observation::Observation;
use crate::aero::Condition;
use crate::model::prior::grid::Grid;
use crate::model::prior::scale_prior::Scale;
use crate::model::prior::term::PosteriorTerm;
use crate::numerics::linear_algebra::root::{BlockRoot, root};
use crate::numerics::statistics::matern::matern_3_2;
use crate::output_error::error_effect::SharedError;

/// Distance over which a class's errors fade, deg; also the spacing of their grid.
const CLASS_LENGTH_DEG: f64 = 10.0;

/// Row of a sparse matrix over the unknowns: index of an unknown and its factor.
pub type SparseRow = Vec<(usize, f64)>;

/// Order of the unknowns.
#[derive(Clone, Debug)]
pub struct Unknowns {
    /// First unknown of each term.
    pub starts: Vec<usize>,
    /// Number of differences from the tunnel, which come first.
    pub differences: usize,
    /// Number of unknowns.
    pub count: usize,
    classes: BTreeMap<(usize, usize), ClassError>,
    campaign: BTreeMap<SharedError, usize>,
    class_error: f64,
}

/// Systematic error, a function of α, that a class's estimates of a term share.
#[derive(Clone, Debug)]
struct ClassError {
    start: usize,
    grid: Grid,
}

impl Unknowns {
    /// Unknowns of a coefficient's terms and of observations by class.
    #[must_use]
    pub fn new<'o>(
        terms: &[PosteriorTerm],
        observations: impl Iterator<Item = &'o (usize, Observation)>,
        class_error: f64,
    ) -> Unknowns {
        let mut count = 0;
        let mut next = |length: usize| {
            count += length;
            count - length
        };
        let starts = terms.iter().map(|t| next(t.prior.grid.len())).collect();
        let differences = next(0);
        let mut ranges: BTreeMap<(usize, usize), (f64, f64)> = BTreeMap::new();
        let mut shared = BTreeSet::new();
        for (class, observation) in observations {
            let alpha = observation.condition.alpha_deg;
            for term in &observation.terms {
                let range = ranges.entry((*class, *term)).or_insert((alpha, alpha));
                *range = (range.0.min(alpha), range.1.max(alpha));
            }
            let errors = observation.calibration.iter().map(|(error, _)| error);
            shared.extend(errors.filter(|e| is_of_campaign(e)).cloned());
        }
        let mut class_error_of = |range| {
            let grid = class_grid(range);
            let start = next(grid.len());
            ClassError { start, grid }
        };
        let classes = ranges.into_iter();
        let classes = classes.map(|(key, range)| (key, class_error_of(range)));
        let classes = classes.collect();
        let campaign = shared.into_iter().map(|error| (error, next(1))).collect();
        Unknowns {
            starts,
            differences,
            count: next(0),
            classes,
            campaign,
            class_error,
        }
    }

    /// Rows of an observation over the unknowns.
    #[must_use]
    pub fn rows(
        &self,
        terms: &[PosteriorTerm],
        class: usize,
        observation: &Observation,
    ) -> Vec<SparseRow> {
        let mut rows = self.difference_rows(terms, &observation.design, &observation.condition);
        for (i, (row, &term)) in rows.iter_mut().zip(&observation.terms).enumerate() {
            let bound = observation.noise[(i, i)].sqrt();
            if let Some(error) = self.classes.get(&(class, term)) {
                let shares = error.grid.shares(&observation.condition).into_iter();
                row.extend(shares.map(|(node, share)| (error.start + node, share * bound)));
            }
            for (error, change) in &observation.calibration {
                let place = self.campaign.get(error);
                row.extend(place.map(|place| (*place, change[i])));
            }
        }
        rows
    }

    /// Rows over the differences alone, from weights of the terms at a condition: one row of `design`
    /// each.
    #[must_use]
    pub fn difference_rows(
        &self,
        terms: &[PosteriorTerm],
        design: &DMatrix<f64>,
        condition: &Condition,
    ) -> Vec<SparseRow> {
        let shares = terms.iter().map(|t| t.prior.grid.shares(condition));
        let shares: Vec<SparseRow> = shares.collect();
        let row = |i: usize| {
            let terms = self.starts.iter().zip(&shares).enumerate();
            let acting = terms.filter(|(j, _)| design[(i, *j)] != 0.0);
            let weighted = acting.flat_map(|(j, (start, shares))| {
                let weight = design[(i, j)];
                shares
                    .iter()
                    .map(move |(node, share)| (start + node, weight * share))
            });
            weighted.collect()
        };
        (0..design.nrows()).map(row).collect()
    }

    /// Root of the prior covariance of all unknowns except the differences. Directions whose
    /// variance is below the share `least` of the largest of their kind are ignored.
    #[must_use]
    pub fn root_of_others(&self, least: f64) -> BlockRoot {
        let mut blocks = BlockRoot::default();
        self.push_others(least, |_| true, &mut blocks);
        blocks
    }

    /// Root of the prior covariance of all unknowns; `least` as in [`Unknowns::root_of_others`].
    #[must_use]
    pub fn root(&self, terms: &[PosteriorTerm], scales: &[Scale], least: f64) -> BlockRoot {
        self.root_of_observed(terms, scales, least, |_| true)
    }

    /// Root as by [`Unknowns::root`], with zero variance for unknowns on which no data depend. The
    /// posterior of the observed unknowns is the same.
    #[must_use]
    pub fn root_of_observed(
        &self,
        terms: &[PosteriorTerm],
        scales: &[Scale],
        least: f64,
        is_observed: impl Fn(usize) -> bool,
    ) -> BlockRoot {
        let mut blocks = root_of_differences(terms, scales, least, &is_observed);
        self.push_others(least, is_observed, &mut blocks);
        blocks
    }

    fn push_others(&self, least: f64, is_observed: impl Fn(usize) -> bool, blocks: &mut BlockRoot) {
        for error in self.classes.values() {
            let alphas = &error.grid.alphas_deg;
            let covariance = DMatrix::from_fn(alphas.len(), alphas.len(), |i, j| {
                let distance = (alphas[i] - alphas[j]).abs() / CLASS_LENGTH_DEG;
                self.class_error * self.class_error * matern_3_2(distance)
            });
            let observed = of_observed(covariance, |i| is_observed(error.start + i));
            blocks.push(root(&observed, least));
        }
        let of_campaign = self.campaign.len();
        blocks.push(DMatrix::identity(of_campaign, of_campaign));
    }
}

/// Covariance with zero for all that is not observed.
fn of_observed(mut covariance: DMatrix<f64>, is_observed: impl Fn(usize) -> bool) -> DMatrix<f64> {
    for i in (0..covariance.nrows()).filter(|i| !is_observed(*i)) {
        covariance.row_mut(i).fill(0.0);
        covariance.column_mut(i).fill(0.0);
    }
    covariance
}

/// Root of the prior covariance of the differences, with zero variance for those that are not
/// observed. Directions below `least` of a term's largest variance are ignored.
#[must_use]
pub fn root_of_differences(
    terms: &[PosteriorTerm],
    scales: &[Scale],
    least: f64,
    is_observed: impl Fn(usize) -> bool,
) -> BlockRoot {
    let mut blocks = BlockRoot::default();
    let mut start = 0;
    for (term, scale) in terms.iter().zip(scales) {
        let covariance = term.prior.covariance.for_scale(scale);
        let next = start + covariance.nrows();
        let observed = of_observed(covariance, |i| is_observed(start + i));
        blocks.push(root(&observed, least));
        start = next;
    }
    blocks
}

/// `true` for an error that is common to all flights, such as a recorder's delay of a surface.
#[must_use]
pub fn is_of_campaign(error: &SharedError) -> bool {
    matches!(error, SharedError::Delay(_))
}

fn class_grid((lowest, highest): (f64, f64)) -> Grid {
    let mut alpha = (lowest / CLASS_LENGTH_DEG).floor() * CLASS_LENGTH_DEG;
    let mut alphas = vec![alpha];
    while alpha < highest {
        alpha += CLASS_LENGTH_DEG;
        alphas.push(alpha);
    }
    Grid::of_alpha(alphas)
}

/// Weighted sum of the unknowns.
#[must_use]
pub fn weighted_sum(row: &SparseRow, unknowns: &DVector<f64>) -> f64 {
    row.iter()
        .map(|(place, weight)| weight * unknowns[*place])
        .sum()
}

/// Covariance of two weighted sums of the unknowns.
#[must_use]
pub fn covariance_between(first: &SparseRow, second: &SparseRow, covariance: &DMatrix<f64>) -> f64 {
    let pairs = first
        .iter()
        .flat_map(|a| second.iter().map(move |b| (a, b)));
    pairs
        .map(|((i, weight), (j, other))| weight * other * covariance[(*i, *j)])
        .sum()
}
