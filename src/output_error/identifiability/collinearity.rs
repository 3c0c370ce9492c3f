//! Collinearity of the parameters: correlations, variance inflation, and condition indices with
//! variance proportions (Belsley, Kuh and Welsch 1980). All are computed on H with unit diagonal,
//! that is on unit-length columns of `W^½ S`.
//!
//! With `H_s = D H D`, `D = diag H^-½`, eigenvalues λ and unit eigenvectors v:
//! - variance inflation of parameter j: `H_jj (H⁻¹)_jj = Σ_k v_jk²/λ_k`, the factor by which
//!   estimating the other parameters raises the variance of j;
//! - condition index of direction k: `√(λ_max/λ_k)`, the ratio of the lengths of the best
//!   determined direction and this one;
//! - variance proportion of j in k: `(v_jk²/λ_k) / Σ_l v_jl²/λ_l`.
//!
//! A direction of high index may make more than half of the variance of two or more parameters.
//! These parameters are a group that the data hardly separate.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::numerics::linear_algebra::symmetric::{inverse, scale, scaled};
use crate::numerics::statistics::mean::{mean, root_mean_square};
use crate::settings::settings;

settings! {
    /// Limits of the identifiability measures.
    #[derive(Copy)]
    pub struct CollinearityLimits {
        /// Smallest absolute correlation of two estimates that is published. Smaller: more rows in
        /// `correlations`.
        pub published_correlation: f64 = 0.5,
        /// Absolute correlation beyond which a pair of estimates is flagged.
        pub correlation: f64 = 0.9,
        /// Variance inflation beyond which an estimate is flagged.
        pub variance_inflation: f64 = 10.0,
        /// Condition index from which a direction names its group of parameters. Belsley calls 30
        /// strong. Smaller: more groups are named.
        pub condition_index: f64 = 30.0,
        /// Share of a parameter's variance from which it belongs to a direction's group.
        pub variance_proportion: f64 = 0.5,
    }
}

/// Group of parameters that the data hardly separate.
#[derive(Clone, Debug, PartialEq)]
pub struct CollinearGroup {
    /// Condition index; infinite where the data do not separate them at all.
    pub condition_index: f64,
    pub parameters: Vec<usize>,
}

/// Collinearity of one information matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Collinearity {
    /// Variance inflation of each parameter; `None` if it takes part in an undetermined direction.
    pub inflation: Vec<Option<f64>>,
    /// Correlation of the estimates, from H⁻¹; `None` if H has no inverse.
    pub correlation: Option<DMatrix<f64>>,
    /// Largest condition index, `√(λ_max/λ_min)`; infinite where a direction is undetermined.
    pub largest_index: f64,
    /// Groups, worst first.
    pub groups: Vec<CollinearGroup>,
}

/// Computes the collinearity of an information matrix; `None` if it is empty or not finite. A
/// parameter that is not excited (`H_jj = 0`) is in no group.
#[must_use]
pub fn collinearity(
    information: &DMatrix<f64>,
    max_condition_number: f64,
    limits: &CollinearityLimits,
) -> Option<Collinearity> {
    let n = information.nrows();
    if n == 0 || !information.iter().all(|h| h.is_finite()) {
        return None;
    }
    let excited: Vec<usize> = (0..n).filter(|&j| information[(j, j)] > 0.0).collect();
    if excited.is_empty() {
        return None;
    }
    let own = DMatrix::from_fn(excited.len(), excited.len(), |i, j| {
        information[(excited[i], excited[j])]
    });
    let eigen = SymmetricEigen::new(scaled(&own, &scale(&own)));
    let most = eigen.eigenvalues.max();
    // Rounding leaves an undetermined direction a tiny eigenvalue of either sign.
    let floor = most / max_condition_number;
    let directions = Directions { eigen, most, floor };
    let determined = excited.len() == n && directions.eigen.eigenvalues.iter().all(|l| *l > floor);
    let mut inflation = vec![None; n];
    for (i, &j) in excited.iter().enumerate() {
        inflation[j] = directions.inflation(i);
    }
    let mut groups = directions.groups(limits);
    for j in groups.iter_mut().flat_map(|g| &mut g.parameters) {
        *j = excited[*j];
    }
    let least = directions.eigen.eigenvalues.min();
    Some(Collinearity {
        inflation,
        correlation: inverse(&own)
            .filter(|_| determined)
            .map(|covariance| scaled(&covariance, &scale(&covariance))),
        largest_index: if determined {
            (most / least).sqrt()
        } else {
            f64::INFINITY
        },
        groups,
    })
}

/// Share of an undetermined direction's unit square above which a parameter takes part: more than
/// rounding. A parameter with any part in it has no bounded variance.
const UNDETERMINED_SHARE: f64 = 1e-6;

/// Eigenvalues and directions of the scaled information matrix.
struct Directions {
    eigen: SymmetricEigen<f64, nalgebra::Dyn>,
    most: f64,
    floor: f64,
}

impl Directions {
    fn eigenvalue(&self, k: usize) -> f64 {
        self.eigen.eigenvalues[k].max(self.floor)
    }

    /// `v_jk²/λ_k`: part of the scaled variance of parameter j from direction k.
    fn variance_part(&self, j: usize, k: usize) -> f64 {
        let v = self.eigen.eigenvectors[(j, k)];
        v * v / self.eigenvalue(k)
    }

    fn variance(&self, j: usize) -> f64 {
        (0..self.eigen.eigenvalues.len())
            .map(|k| self.variance_part(j, k))
            .sum()
    }

    fn inflation(&self, j: usize) -> Option<f64> {
        let undetermined = (0..self.eigen.eigenvalues.len()).any(|k| {
            self.is_undetermined(k) && self.eigen.eigenvectors[(j, k)].powi(2) >= UNDETERMINED_SHARE
        });
        (!undetermined).then(|| self.variance(j))
    }

    fn is_undetermined(&self, k: usize) -> bool {
        self.eigen.eigenvalues[k] <= self.floor
    }

    fn groups(&self, limits: &CollinearityLimits) -> Vec<CollinearGroup> {
        let n = self.eigen.eigenvalues.len();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| self.eigen.eigenvalues[*a].total_cmp(&self.eigen.eigenvalues[*b]));
        let groups = order.into_iter().map(|k| self.group(k, limits));
        groups.flatten().collect()
    }

    /// Group of a direction; `None` below the limits.
    fn group(&self, k: usize, limits: &CollinearityLimits) -> Option<CollinearGroup> {
        let index = (self.most / self.eigenvalue(k)).sqrt();
        let parameters: Vec<usize> = (0..self.eigen.eigenvalues.len())
            .filter(|&j| self.variance_part(j, k) / self.variance(j) >= limits.variance_proportion)
            .collect();
        let condition_index = if self.is_undetermined(k) {
            f64::INFINITY
        } else {
            index
        };
        (index >= limits.condition_index && parameters.len() >= 2).then_some(CollinearGroup {
            condition_index,
            parameters,
        })
    }
}

/// Correlation of two histories; `None` if one of them is constant.
#[must_use]
pub fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let (da, db) = (about_mean(a), about_mean(b));
    let product: f64 = da.iter().zip(&db).map(|(x, y)| x * y).sum();
    let size = root_mean_square(da.iter().copied())
        * root_mean_square(db.iter().copied())
        * da.len() as f64;
    (size > 0.0).then(|| (product / size).clamp(-1.0, 1.0))
}

/// Root mean square of a history about its mean; rounding of a constant counts as zero.
#[must_use]
pub fn excitation(values: &[f64]) -> f64 {
    root_mean_square(about_mean(values).into_iter())
}

fn about_mean(values: &[f64]) -> Vec<f64> {
    let mean = mean(values.iter().copied());
    let rounding = 1e-12 * values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    values
        .iter()
        .map(|v| {
            if (v - mean).abs() <= rounding {
                0.0
            } else {
                v - mean
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Information `Xᵀ X` of two regressors that correlate by ρ and an independent third, of
    /// different lengths.
    fn designed(rho: f64) -> DMatrix<f64> {
        let (a, b, c) = (1.0, 1e3, 1e-4);
        DMatrix::from_row_slice(
            3,
            3,
            &[
                a * a,
                rho * a * b,
                0.0,
                rho * a * b,
                b * b,
                0.0,
                0.0,
                0.0,
                c * c,
            ],
        )
    }

    fn measured(information: &DMatrix<f64>) -> Collinearity {
        collinearity(information, 1e10, &CollinearityLimits::default()).unwrap()
    }

    #[test]
    fn two_regressors_have_the_closed_forms_of_their_correlation() {
        let rho: f64 = 0.95;
        let c = measured(&designed(rho));
        // The inverse of [1 ρ; ρ 1] is [1 -ρ; -ρ 1]/(1-ρ²); its eigenvalues are 1+ρ and 1-ρ.
        let inflation: Vec<f64> = c.inflation.iter().map(|v| v.unwrap()).collect();
        assert_relative_eq!(inflation[0], 1.0 / (1.0 - rho * rho), max_relative = 1e-10);
        assert_relative_eq!(inflation[1], 1.0 / (1.0 - rho * rho), max_relative = 1e-10);
        assert_relative_eq!(inflation[2], 1.0, max_relative = 1e-10);
        let correlation = c.correlation.unwrap();
        assert_relative_eq!(correlation[(0, 1)], -rho, max_relative = 1e-10);
        assert_relative_eq!(correlation[(0, 0)], 1.0, max_relative = 1e-10);
        assert!(correlation[(0, 2)].abs() < 1e-12);
        assert_relative_eq!(
            c.largest_index,
            ((1.0 + rho) / (1.0 - rho)).sqrt(),
            max_relative = 1e-10
        );
        assert!(
            c.groups.is_empty(),
            "an index of 6 is no group: {:?}",
            c.groups
        );
    }

    #[test]
    fn a_group_is_named_from_a_condition_index_of_30_on_with_the_parameters_that_share_it() {
        // Index √((1+ρ)/(1-ρ)) = 30 at ρ = 899/901.
        let at = |index: f64| (index * index - 1.0) / (index * index + 1.0);
        assert!(measured(&designed(at(29.5))).groups.is_empty());
        let groups = measured(&designed(at(30.5))).groups;
        assert_eq!(groups.len(), 1);
        assert_eq!(groups[0].parameters, [0, 1]);
        assert_relative_eq!(groups[0].condition_index, 30.5, max_relative = 1e-6);
    }

    #[test]
    fn proportional_regressors_have_no_inflation_and_an_infinite_index_and_spare_the_third() {
        let c = measured(&designed(1.0));
        assert_eq!((c.inflation[0], c.inflation[1]), (None, None));
        assert_relative_eq!(c.inflation[2].unwrap(), 1.0, max_relative = 1e-9);
        assert!(c.correlation.is_none() && c.largest_index.is_infinite());
        assert_eq!(
            c.groups,
            [CollinearGroup {
                condition_index: f64::INFINITY,
                parameters: vec![0, 1]
            }]
        );
    }

    #[test]
    fn a_regressor_that_is_not_felt_is_in_no_group() {
        let mut information = designed(0.5);
        information[(2, 2)] = 0.0;
        let c = measured(&information);
        assert_eq!(c.inflation[2], None);
        assert!(c.inflation[0].is_some() && c.correlation.is_none() && c.groups.is_empty());
    }

    #[test]
    fn correlation_and_excitation_are_about_the_mean() {
        let sine: Vec<f64> = (0..1000)
            .map(|k| 20.0 + 3.0 * (2.0 * std::f64::consts::PI * f64::from(k) / 250.0).sin())
            .collect();
        let opposite: Vec<f64> = sine.iter().map(|v| 5.0 - 2.0 * v).collect();
        let cosine: Vec<f64> = (0..1000)
            .map(|k| (2.0 * std::f64::consts::PI * f64::from(k) / 250.0).cos())
            .collect();
        assert_relative_eq!(
            excitation(&sine),
            3.0 / 2.0_f64.sqrt(),
            max_relative = 1e-10
        );
        assert_relative_eq!(
            correlation(&sine, &opposite).unwrap(),
            -1.0,
            max_relative = 1e-10
        );
        assert!(correlation(&sine, &cosine).unwrap().abs() < 1e-10);
        assert_eq!(correlation(&sine, &vec![0.1; 1000]), None);
        assert!(excitation(&vec![0.1; 1000]).abs() < f64::EPSILON);
    }
}
