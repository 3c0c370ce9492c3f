//! Differences at the points of the grids on which the data depend.

use nalgebra::{DMatrix, DVector};

use super::flight_data::Information;
use super::posterior::inner_root;
use super::unknowns::Unknowns;
use crate::model::prior::prior_covariance::PriorCovariance;
use crate::model::prior::scale_prior::{Scale, ScalePrior};
use crate::model::prior::term::PosteriorTerm;
use crate::numerics::linear_algebra::root::{BlockRoot, root, root_of_some};
use crate::numerics::linear_algebra::symmetric::square;
use crate::numerics::linear_algebra::triangular::solve_lower;

/// Differences on which the data depend, term by term, with the information on them.
#[derive(Clone, Debug)]
pub struct ObservedDifferences {
    pub terms: Vec<ObservedTerm>,
    pub information: Information,
}

/// Differences of one term on which the data depend.
#[derive(Clone, Debug)]
pub struct ObservedTerm {
    /// Index of the term's first observed difference among the observed differences of all terms.
    pub start: usize,
    /// Prior covariance between the observed differences.
    pub covariance: PriorCovariance,
    /// Prior covariance between all differences of the term and the observed ones.
    with_all: PriorCovariance,
    /// Points of the term's grid.
    points: Vec<usize>,
    pub scale: ScalePrior,
}

impl ObservedTerm {
    /// Number of differences on which the data depend.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points.len()
    }
}

impl ObservedDifferences {
    /// Selects the differences about which there is information.
    #[must_use]
    pub fn new(
        terms: &[PosteriorTerm],
        unknowns: &Unknowns,
        information: &Information,
    ) -> ObservedDifferences {
        let Information { matrix, vector } = information;
        let mut places = Vec::new();
        let mut observed = Vec::with_capacity(terms.len());
        for (term, first) in terms.iter().zip(&unknowns.starts) {
            let points = 0..term.prior.grid.len();
            let (start, every): (usize, Vec<usize>) = (places.len(), points.clone().collect());
            let is_observed = |point: &usize| information.is_about(first + point);
            let observed_points: Vec<usize> = points.filter(is_observed).collect();
            places.extend(observed_points.iter().map(|point| first + point));
            observed.push(ObservedTerm {
                start,
                covariance: term
                    .prior
                    .covariance
                    .select(&observed_points, &observed_points),
                with_all: term.prior.covariance.select(&every, &observed_points),
                points: observed_points,
                scale: term.prior.scale,
            });
        }
        ObservedDifferences {
            terms: observed,
            information: Information {
                matrix: matrix.select_rows(&places).select_columns(&places),
                vector: vector.select_rows(&places),
            },
        }
    }

    /// Root of the prior covariance. Directions below `least` of a term's largest variance are
    /// ignored.
    #[must_use]
    pub fn root(&self, scales: &[Scale], least: f64) -> BlockRoot {
        let mut blocks = BlockRoot::default();
        for (term, scale) in self.terms.iter().zip(scales) {
            blocks.push(root(&term.covariance.for_scale(scale), least));
        }
        blocks
    }

    /// Posterior mean of all differences for some scales.
    #[must_use]
    pub fn mean(&self, scales: &[Scale], least: f64) -> Option<DVector<f64>> {
        let Information { matrix, vector } = &self.information;
        let (mut root, mut of_all) = (BlockRoot::default(), BlockRoot::default());
        for (term, scale) in self.terms.iter().zip(scales) {
            let with_all = root_of_some(&term.with_all.for_scale(scale), &term.points, least);
            root.push(with_all.select_rows(&term.points));
            of_all.push(with_all);
        }
        let lower = inner_root(root.lower_product(&root.left(matrix)))?;
        let mut seen = root.left_of(vector);
        lower.solve_lower_triangular_mut(&mut seen);
        lower.tr_solve_lower_triangular_mut(&mut seen);
        let mean = of_all.times(&seen);
        mean.iter().all(|v| v.is_finite()).then_some(mean)
    }

    /// Marginal likelihood of some scales.
    #[must_use]
    pub fn marginal_likelihood(&self, scales: &[Scale], least: f64) -> Option<MarginalLikelihood> {
        let Information { matrix, vector } = &self.information;
        let root = self.root(scales, least);
        let mut halves = root.left(matrix);
        let lower = inner_root(root.lower_product(&halves))?;
        solve_lower(lower.as_view(), halves.as_view_mut());
        let mut seen = root.left_of(vector);
        lower.solve_lower_triangular_mut(&mut seen);
        let log_determinant: f64 = lower.diagonal().iter().map(|d| d.ln()).sum();
        Some(MarginalLikelihood {
            value: log_determinant - 0.5 * seen.norm_squared(),
            innovation: vector - halves.tr_mul(&seen),
            information: matrix - square(&halves),
        })
    }
}

/// Marginal likelihood of scales, and the vectors and matrices from which its derivatives follow.
#[derive(Clone, Debug)]
pub struct MarginalLikelihood {
    /// Minus the log of the marginal likelihood, without constants.
    pub value: f64,
    /// Innovation a = η − Λ P η, in the symbols of [`scales`](super::scales).
    pub innovation: DVector<f64>,
    /// Information of the innovation, M = Λ − Λ P Λ.
    pub information: DMatrix<f64>,
}
