//! The tables of a published night, read back.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::lineage::Lineage;
use crate::store::files;
use crate::store::{Night, Nights};
use crate::tables::{
    CovarianceRow, EstimateRow, FitRow, InstrumentTrendRow, PosteriorRow, PublishedTrend,
    PublishedVerdict, SelfCheckRow,
};

/// Time and class of a maneuver, from the table `maneuvers`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ManeuverWindow {
    pub maneuver_id: String,
    pub flight_id: String,
    pub class: String,
    pub start_s: f64,
    pub end_s: f64,
}

/// The tables of a night that are compared with another night's, and its lineage. Rows of joint
/// estimates are left out.
#[derive(Clone, Copy, Debug)]
pub struct NightTables<'a> {
    pub lineage: &'a Lineage,
    pub maneuvers: &'a [ManeuverWindow],
    pub fits: &'a [FitRow],
    pub estimates: &'a [EstimateRow],
    pub trends: &'a [PublishedTrend],
    pub verdicts: &'a [PublishedVerdict],
    pub posterior: &'a [PosteriorRow],
    pub covariances: &'a [CovarianceRow],
    pub self_check: &'a [SelfCheckRow],
    pub instrument_trends: &'a [InstrumentTrendRow],
}

/// Tables of a published night that are compared with another night's.
#[derive(Clone, Debug, Default)]
pub struct PublishedNight {
    lineage: Lineage,
    maneuvers: Vec<ManeuverWindow>,
    fits: Vec<FitRow>,
    estimates: Vec<EstimateRow>,
    trends: Vec<PublishedTrend>,
    verdicts: Vec<PublishedVerdict>,
    posterior: Vec<PosteriorRow>,
    covariances: Vec<CovarianceRow>,
    self_check: Vec<SelfCheckRow>,
    instrument_trends: Vec<InstrumentTrendRow>,
}

impl PublishedNight {
    /// Reads a complete night.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] or [`crate::error::Error::Config`] naming the table that cannot
    /// be read.
    pub fn read(nights: &Nights, night: &Night) -> Result<PublishedNight> {
        let folder = nights.folder(&night.name);
        let mut estimates: Vec<EstimateRow> = files::published(&folder, "estimates")?;
        estimates.retain(|e| !e.is_joint());
        Ok(PublishedNight {
            lineage: night.lineage.clone(),
            maneuvers: files::published(&folder, "maneuvers")?,
            fits: files::published(&folder, "fits")?,
            estimates,
            trends: files::published(&folder, "trends")?,
            verdicts: files::published(&folder, "comparison")?,
            posterior: files::published(&folder, "posterior")?,
            covariances: files::published(&folder, "posterior_covariance")?,
            self_check: files::published(&folder, "self_check")?,
            instrument_trends: files::published(&folder, "instrument_trends")?,
        })
    }

    /// The tables, borrowed.
    #[must_use]
    pub fn tables(&self) -> NightTables<'_> {
        NightTables {
            lineage: &self.lineage,
            maneuvers: &self.maneuvers,
            fits: &self.fits,
            estimates: &self.estimates,
            trends: &self.trends,
            verdicts: &self.verdicts,
            posterior: &self.posterior,
            covariances: &self.covariances,
            self_check: &self.self_check,
            instrument_trends: &self.instrument_trends,
        }
    }
}
