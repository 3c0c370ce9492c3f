//! Terms of a coefficient whose difference from the tunnel is unknown.
//!
//! If the tunnel tabulates the sum of a constant and its slope, the sum replaces the constant,
//! since flight and tunnel both determine it better. A constant without a table or estimate is no
//! term: each maneuver keeps its own.

use nalgebra::{DMatrix, DVector};

use super::derivative_prior::{DerivativePrior, TableOnGrid};
use super::grid::{Grid, refined};
use super::scale_prior::Scale;
use crate::aero::{AeroModel, Coefficient, Condition, Derivative, Regressor, WindTunnel};
use crate::maneuver::Status;
use crate::model::evidence::ManeuverResults;
use crate::model::settings::Settings;
use crate::numerics::statistics::order_statistics::median;
use crate::tables::PriorSource;

/// Derivative or sum of one coefficient, whose difference from the tunnel is unknown over its grid.
#[derive(Clone, Debug)]
pub struct PosteriorTerm {
    /// Derivative of the model that the term is or replaces.
    pub derivative: String,
    /// Slope of the sum that replaces its constant; `None` for a derivative itself.
    pub slope: Option<String>,
    pub unit: &'static str,
    pub prior: DerivativePrior,
    /// Tunnel's breakpoints; without a table, all points of the grid.
    pub breakpoints_deg: Vec<f64>,
}

/// Covariance of weighted sums of the terms at a condition, from the variation between the points
/// of their grids; one sum per row of `design`.
#[must_use]
pub fn between_points(
    terms: &[PosteriorTerm],
    scales: &[Scale],
    design: &DMatrix<f64>,
    condition: &Condition,
) -> DMatrix<f64> {
    let pairs = terms.iter().zip(scales);
    let variances = pairs.map(|(t, s)| t.prior.variance_between_points(s, condition));
    of_independent(design, variances)
}

/// Covariance of weighted sums of independent quantities with these variances; one sum per row of
/// `design`.
#[must_use]
pub fn of_independent(
    design: &DMatrix<f64>,
    variances: impl ExactSizeIterator<Item = f64>,
) -> DMatrix<f64> {
    let variances = DVector::from_iterator(variances.len(), variances);
    design * DMatrix::from_diagonal(&variances) * design.transpose()
}

/// Data from which the terms follow.
#[derive(Clone, Copy, Debug)]
pub struct TermSources<'a> {
    pub aero_model: &'a AeroModel,
    /// Tunnel, constant beyond its ends.
    pub tunnel: &'a WindTunnel,
    pub settings: &'a Settings,
}

impl TermSources<'_> {
    /// Terms of a coefficient, in the order of the model.
    #[must_use]
    pub fn terms(
        &self,
        coefficient: Coefficient,
        evidence: &[ManeuverResults],
    ) -> Vec<PosteriorTerm> {
        let of_coefficient = |d: &&Derivative| d.coefficient == coefficient;
        let derivatives = self.aero_model.derivatives.iter().filter(of_coefficient);
        let alphas = self.alphas_deg(coefficient, evidence);
        derivatives
            .filter_map(|derivative| self.term(derivative, &alphas, evidence))
            .collect()
    }

    /// Upper limit of the number of points of a coefficient's grids, found without making the
    /// grids.
    #[must_use]
    pub fn count_points(&self, coefficient: Coefficient, evidence: &[ManeuverResults]) -> usize {
        let derivatives = self.aero_model.derivatives.iter();
        let alphas = self.alphas_deg(coefficient, evidence).len();
        derivatives
            .filter(|derivative| derivative.coefficient == coefficient)
            .map(|derivative| {
                let sums = self.aero_model.combined.iter();
                let sums_of_constant = sums.filter(|sum| sum.constant == derivative.name);
                let names = sums_of_constant
                    .map(|sum| &sum.name)
                    .chain([&derivative.name]);
                let tables = names.map(|name| {
                    let (machs, thirds) = (self.tunnel.machs(name), self.tunnel.thirds(name));
                    machs.len().max(1).saturating_mul(thirds.len().max(1))
                });
                alphas.saturating_mul(tables.max().unwrap_or(1))
            })
            .fold(0, usize::saturating_add)
    }

    /// Angles of attack of a coefficient's grids: the breakpoints of its tables, the flown range, and
    /// points between.
    fn alphas_deg(&self, coefficient: Coefficient, evidence: &[ManeuverResults]) -> Vec<f64> {
        let names = self.table_names(coefficient);
        let tabulated: Vec<f64> = names
            .flat_map(|name| self.tunnel.alphas_deg(name))
            .collect();
        let step = self.settings.alpha_step_deg;
        let [below, above] = beyond_tables(&tabulated, &flown_alphas(coefficient, evidence), step);
        refined(tabulated.into_iter().chain(below).chain(above), step)
    }

    /// Names of the tables of a coefficient: its derivatives, and the sums with its constant.
    fn table_names(&self, coefficient: Coefficient) -> impl Iterator<Item = &String> {
        let is_of_coefficient =
            move |derivative: &&Derivative| derivative.coefficient == coefficient;
        let derivatives = self.aero_model.derivatives.iter();
        let sums = self.aero_model.combined.iter().filter(move |sum| {
            let constant = self.aero_model.derivative(&sum.constant);
            constant.is_some_and(|derivative| is_of_coefficient(&derivative))
        });
        derivatives
            .filter(is_of_coefficient)
            .map(|derivative| &derivative.name)
            .chain(sums.map(|sum| &sum.name))
    }

    fn term(
        &self,
        derivative: &Derivative,
        alphas: &[f64],
        evidence: &[ManeuverResults],
    ) -> Option<PosteriorTerm> {
        let is_constant = derivative.regressor == Regressor::Constant;
        let sum = self.aero_model.combined.iter();
        let mut sum = sum.clone().find(|c| c.constant == derivative.name);
        let is_tabulated = |name: &str| self.tunnel.root_mean_square(name) > 0.0;
        if is_tabulated(&derivative.name) && sum.is_some_and(|s| !is_tabulated(&s.name)) {
            sum = None;
        }
        let name = sum.map_or(&derivative.name, |s| &s.name);
        if is_constant && sum.is_none() && !is_tabulated(name) {
            return None;
        }
        let grid = Grid {
            alphas_deg: alphas.to_vec(),
            machs: self.tunnel.machs(name),
            thirds: self.tunnel.thirds(name),
        };
        let (table, size) = self.table(name, &grid, evidence)?;
        let length_deg = self.settings.length_deg;
        let mut breakpoints_deg = self.tunnel.alphas_deg(name);
        if breakpoints_deg.is_empty() {
            breakpoints_deg = alphas.to_vec();
        }
        let prior = DerivativePrior::new(name.clone(), grid, table, Scale { size, length_deg });
        Some(PosteriorTerm {
            derivative: derivative.name.clone(),
            slope: sum.map(|s| s.slope.clone()),
            unit: self.aero_model.unit_of(name)?.name(),
            prior,
            breakpoints_deg,
        })
    }

    /// Tunnel's table over a grid, and the centre of the difference's relative size. A derivative
    /// without table gets the order of magnitude of its estimates; `None` without estimates.
    fn table(
        &self,
        name: &str,
        grid: &Grid,
        evidence: &[ManeuverResults],
    ) -> Option<(TableOnGrid, f64)> {
        let read = |node: super::grid::Node| self.tunnel.at(name, &node.condition());
        let values: Option<Vec<_>> = grid.nodes().into_iter().map(read).collect();
        let size = self.tunnel.root_mean_square(name);
        if let Some(values) = values.filter(|_| size > 0.0) {
            let mean = values.iter().map(|v| v.value).collect();
            let stated: Option<Vec<f64>> = values.iter().map(|v| v.uncertainty).collect();
            let (source, centre) = match stated {
                Some(_) => (PriorSource::TableWithUncertainty, 1.0),
                None => (
                    PriorSource::Table,
                    self.settings.tunnel_uncertainty_pct / 100.0,
                ),
            };
            let uncertainty = stated.unwrap_or_default();
            return Some((
                TableOnGrid {
                    source,
                    mean,
                    uncertainty,
                    size,
                },
                centre,
            ));
        }
        let rows = evidence
            .iter()
            .flat_map(|e| e.estimates.iter().chain(e.combined));
        let estimates =
            rows.filter(|row| row.derivative == name && row.status == Status::Estimated);
        let size = median(estimates.filter_map(|row| row.value).map(f64::abs))?;
        let table = TableOnGrid {
            source: PriorSource::Magnitude,
            mean: vec![0.0; grid.len()],
            uncertainty: vec![],
            size,
        };
        (size > 0.0).then_some((table, 1.0))
    }
}

/// Mean angles of attack of the maneuvers on a coefficient's axis.
fn flown_alphas(coefficient: Coefficient, evidence: &[ManeuverResults]) -> Vec<f64> {
    let on_axis = evidence
        .iter()
        .filter(|e| e.maneuver.axis == coefficient.axis());
    on_axis.map(|e| e.maneuver.alpha_deg).collect()
}

/// Points below and above the tabulated angles of attack where maneuvers are flown there: a whole
/// step encloses the outermost maneuver.
fn beyond_tables(tabulated: &[f64], flown: &[f64], step: f64) -> [Option<f64>; 2] {
    let least = |values: &[f64]| values.iter().copied().reduce(f64::min);
    let largest = |values: &[f64]| values.iter().copied().reduce(f64::max);
    let lowest = least(flown).map(|a| (a / step).floor() * step);
    let highest = largest(flown).map(|a| (a / step).ceil() * step);
    let below = lowest.filter(|a| least(tabulated).is_none_or(|first| *a < first));
    let above = highest.filter(|a| largest(tabulated).is_none_or(|last| *a > last));
    [below, above]
}
