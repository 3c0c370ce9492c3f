//! Everything a report is made from: the campaign's tables, time histories and provenance.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::provenance::Provenance;
use crate::aero::Axis;
use crate::error::Problem;
use crate::lineage::Changes;
use crate::maneuver::Maneuver;
use crate::output_error::identifiability::CollinearityLimits;
use crate::proof_of_match::{self, Matched};
use crate::qualities::{Qualities, Specification};
use crate::tables::{
    AgreementRow, ChannelRow, CheckRow, ComparisonRow, ContributionRow, CorrelationRow,
    EstimateRow, EventRow, FitRow, FlightRow, History, InstrumentRow, InstrumentTrendRow,
    PosteriorRow, TrendRow,
};

/// A maneuver class of the configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct ConfiguredClass {
    pub name: String,
    pub title: String,
    pub axis: Axis,
}

/// Time history of a maneuver, drawn.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct HistoryFigure {
    pub svg: String,
    /// `true` if it shows samples that are excluded from the cost.
    pub has_excluded: bool,
}

/// Input of the report stage.
#[derive(Clone, Copy, Debug)]
pub struct Contents<'a> {
    pub title: &'a str,
    pub aircraft: &'a str,
    /// Archive that the flights were read from.
    pub archive: &'a str,
    /// Wind-tunnel database and the sources of its values.
    pub wind_tunnel: &'a str,
    pub maneuvers: &'a [Maneuver],
    pub fits: &'a [FitRow],
    pub estimates: &'a [EstimateRow],
    /// Outputs of each maneuver, predicted with derivatives estimated from other maneuvers.
    pub predictions: &'a [AgreementRow],
    pub correlations: &'a [CorrelationRow],
    /// Limits above which a correlation, a variance inflation or a condition index is flagged.
    pub limits: &'a CollinearityLimits,
    pub posterior: &'a [PosteriorRow],
    /// Maneuvers in the posterior.
    pub contributions: &'a [ContributionRow],
    pub trends: &'a [TrendRow],
    /// Specification of flying qualities, and the rows judged by it; empty without a specification.
    pub specification: Option<&'a Specification>,
    pub qualities: &'a Qualities,
    /// Tolerances of the proof of match, and each maneuver flown again; empty without tolerances.
    pub tolerances: Option<&'a proof_of_match::Specification>,
    pub matched: &'a [Matched],
    pub comparison: &'a [ComparisonRow],
    pub flights: &'a [FlightRow],
    pub channels: &'a [ChannelRow],
    pub checks: &'a [CheckRow],
    pub instruments: &'a [InstrumentRow],
    pub instrument_trends: &'a [InstrumentTrendRow],
    pub events: &'a [EventRow],
    pub problems: &'a [Problem],
    /// Identifiers of the maneuvers that get a page (see [`super::maneuvers_with_page`]).
    pub pages: &'a BTreeSet<String>,
    /// Time histories of the maneuvers with a page, drawn, by maneuver.
    pub history_figures: &'a BTreeMap<String, HistoryFigure>,
    /// Time histories of the maneuvers that represent a class ([`super::representatives`]), reduced by
    /// [`super::thinned`].
    pub histories: &'a [History],
    /// Angle of attack nearest to which the representative maneuver of a class lies, deg.
    pub typical_alpha_deg: f64,
    pub provenance: &'a Provenance,
    /// Derivatives in the order of the model.
    pub order: &'a [String],
    /// Configured maneuver classes, in the order of the report.
    pub classes: &'a [ConfiguredClass],
    /// Differences from the previously published night.
    pub overnight: &'a Changes,
}

impl<'a> Contents<'a> {
    /// Maps each maneuver's identifier to its fit.
    #[must_use]
    pub fn fits_by_maneuver(&self) -> BTreeMap<&'a str, &'a FitRow> {
        self.fits
            .iter()
            .map(|fit| (fit.maneuver_id.as_str(), fit))
            .collect()
    }
}

/// Groups rows by a key, in their order.
pub fn group_by<'a, T>(
    rows: &'a [T],
    key: impl Fn(&'a T) -> &'a str,
) -> BTreeMap<&'a str, Vec<&'a T>> {
    let mut groups: BTreeMap<&str, Vec<&T>> = BTreeMap::new();
    for row in rows {
        groups.entry(key(row)).or_default().push(row);
    }
    groups
}
