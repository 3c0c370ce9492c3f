//! Everything that an export is made from.

use super::export_table::ExportTable;
use super::settings::Settings;
use crate::aero::{AeroModel, Coefficient, Derivative, Regressor, WindTunnel};
use crate::aircraft::Aircraft;
use crate::model::CorrelatedDerivatives;
use crate::tables::PosteriorRow;

/// Everything that an export is made from.
#[derive(Clone, Copy, Debug)]
pub struct ExportContents<'a> {
    pub title: &'a str,
    pub aircraft: &'a Aircraft,
    pub aero_model: &'a AeroModel,
    pub tunnel: &'a WindTunnel,
    pub posterior: &'a [PosteriorRow],
    /// Correlations between derivatives of the posterior.
    pub correlations: &'a [CorrelatedDerivatives],
    pub settings: &'a Settings,
}

/// Derivatives of one coefficient that have a table: either along vanes, or along all other
/// regressors.
pub(super) fn terms<'a>(
    contents: &'a ExportContents,
    tables: &'a [ExportTable],
    coefficient: Coefficient,
    of_vanes: bool,
) -> impl Iterator<Item = &'a Derivative> {
    contents.aero_model.derivatives.iter().filter(move |d| {
        let is_vane = matches!(d.regressor, Regressor::Vane(_));
        d.coefficient == coefficient
            && is_vane == of_vanes
            && tables.iter().any(|t| t.derivative == d.name)
    })
}

/// All coefficients, forces first.
pub(super) const COEFFICIENTS: [Coefficient; 6] = [
    Coefficient::CN,
    Coefficient::CA,
    Coefficient::CY,
    Coefficient::Cl,
    Coefficient::Cm,
    Coefficient::Cn,
];
