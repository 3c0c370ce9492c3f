//! Rows of the posterior's tables.

use nalgebra::DMatrix;

use super::published::PublishedDerivative;
use crate::aero::Coefficient;
use crate::model::evidence::ManeuverResults;
use crate::model::fusion::coefficient::CoefficientPosterior;
use crate::model::fusion::posterior::prior_covariance_of_terms;
use crate::model::fusion::self_check::Agreement;
use crate::model::fusion::unknowns::covariance_between;
use crate::numerics::statistics::normal::NORMAL_95;
use crate::tables::{
    ContributionRow, CovarianceRow, LeftOutKind, PosteriorRow, ScaleRow, SelfCheckRow,
};

/// Rows of one coefficient in each of the posterior's tables.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CoefficientTables {
    pub posterior: Vec<PosteriorRow>,
    pub covariance: Vec<CovarianceRow>,
    pub scales: Vec<ScaleRow>,
    pub contributions: Vec<ContributionRow>,
    pub self_check: Vec<SelfCheckRow>,
}

impl CoefficientTables {
    /// Appends the rows of another coefficient.
    pub fn append(&mut self, other: CoefficientTables) {
        self.posterior.extend(other.posterior);
        self.covariance.extend(other.covariance);
        self.scales.extend(other.scales);
        self.contributions.extend(other.contributions);
        self.self_check.extend(other.self_check);
    }
}

impl CoefficientPosterior {
    /// Rows of all tables.
    #[must_use]
    pub fn rows(
        &self,
        coefficient: Coefficient,
        evidence: &[ManeuverResults],
    ) -> CoefficientTables {
        let alphas: Vec<f64> = evidence.iter().map(|e| e.maneuver.alpha_deg).collect();
        let quantities = self.quantities();
        let before = prior_covariance_of_terms(&self.unknowns, &self.terms, &self.scales);
        let posterior = quantities
            .iter()
            .flat_map(|q| self.posterior(q, &before, &alphas));
        CoefficientTables {
            posterior: posterior.collect(),
            covariance: self.covariance_rows(),
            scales: self.scale_rows(),
            contributions: self.contributions(coefficient, evidence),
            self_check: self.self_check(coefficient),
        }
    }

    fn posterior(
        &self,
        quantity: &PublishedDerivative,
        before: &DMatrix<f64>,
        alphas_deg: &[f64],
    ) -> Vec<PosteriorRow> {
        let values = self.values(quantity);
        let row = |i: usize| {
            let (node, row_of_node) = (&quantity.nodes[i], &quantity.rows[i]);
            let variance =
                covariance_between(row_of_node, row_of_node, &self.gaussian.covariance).max(0.0);
            let deviation = variance.sqrt();
            let prior_variance = covariance_between(row_of_node, row_of_node, before);
            PosteriorRow {
                derivative: quantity.name.clone(),
                unit: quantity.unit.to_owned(),
                alpha_deg: node.alpha_deg,
                mach: node.mach,
                third: node.third,
                value: values[i],
                standard_deviation: deviation,
                lower_95: values[i] - NORMAL_95 * deviation,
                upper_95: values[i] + NORMAL_95 * deviation,
                wind_tunnel: quantity.has_tunnel.then_some(quantity.tunnel[i]),
                prior_deviation: prior_variance.sqrt(),
                flight_share_pct: (prior_variance > 0.0)
                    .then(|| 100.0 * (1.0 - variance / prior_variance).max(0.0)),
                maneuvers: self.maneuvers_near(quantity.term, alphas_deg, node.alpha_deg),
            }
        };
        (0..values.len()).map(row).collect()
    }

    fn covariance_rows(&self) -> Vec<CovarianceRow> {
        let mut points = Vec::new();
        for (term, start) in self.terms.iter().zip(&self.unknowns.starts) {
            for (i, node) in term.prior.grid.nodes().into_iter().enumerate() {
                if term.breakpoints_deg.contains(&node.alpha_deg) {
                    points.push((term.prior.name.as_str(), node, start + i));
                }
            }
        }
        let mut rows = Vec::with_capacity(points.len() * (points.len() + 1) / 2);
        for (i, (first, at, row)) in points.iter().enumerate() {
            for (second, there, column) in &points[..=i] {
                rows.push(CovarianceRow {
                    first: (*first).to_owned(),
                    first_alpha_deg: at.alpha_deg,
                    first_mach: at.mach,
                    first_third: at.third,
                    second: (*second).to_owned(),
                    second_alpha_deg: there.alpha_deg,
                    second_mach: there.mach,
                    second_third: there.third,
                    covariance: self.gaussian.covariance[(*row, *column)],
                });
            }
        }
        rows
    }

    fn scale_rows(&self) -> Vec<ScaleRow> {
        let pairs = self.terms.iter().zip(&self.scales);
        pairs
            .map(|(term, scale)| ScaleRow {
                derivative: term.prior.name.clone(),
                knowledge: term.prior.source,
                size: scale.size,
                length_deg: scale.length_deg,
            })
            .collect()
    }

    fn contributions(
        &self,
        coefficient: Coefficient,
        evidence: &[ManeuverResults],
    ) -> Vec<ContributionRow> {
        let row = |(place, weight): (&usize, &f64)| {
            let maneuver = evidence[*place].maneuver;
            ContributionRow {
                maneuver_id: maneuver.maneuver_id.clone(),
                class: maneuver.class.clone(),
                coefficient: format!("{coefficient:?}"),
                weight: *weight,
            }
        };
        self.weights.iter().map(row).collect()
    }

    fn self_check(&self, coefficient: Coefficient) -> Vec<SelfCheckRow> {
        let row = |left_out: LeftOutKind, item: &str, agreement: &Agreement| SelfCheckRow {
            left_out,
            item: item.to_owned(),
            coefficient: format!("{coefficient:?}"),
            estimates: agreement.estimates,
            inside_95_pct: 100.0 * agreement.inside as f64 / agreement.estimates.max(1) as f64,
            log_density: agreement.log_density,
        };
        let flights = self.flights.iter();
        let flights = flights.map(|(id, a)| row(LeftOutKind::Flight, id, a));
        let classes = self.classes.iter();
        let classes = classes.map(|(id, a)| row(LeftOutKind::Class, id, a));
        flights.chain(classes).collect()
    }
}
