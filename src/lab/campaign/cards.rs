//! Test cards as written in YAML: simulated aircraft, true derivatives, instruments, programs of the
//! maneuver classes, flights with their test points.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::next_flight::NextFlight;
use super::study_condition::StudyCondition;
use super::test_point::TestPoint;
use crate::lab::simulator::{
    DerivativeLookup, DiscreteGusts, FlightCondition, Instruments, Program, Settings, Turbulence,
};

/// A file of test cards. Paths are relative to the working directory.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cards {
    /// Pipeline with aircraft, channel map and build-up: a folder, or the name of one under
    /// `pipelines/`.
    pub pipeline: PathBuf,
    /// True derivatives: CSV in the form of a wind-tunnel table. `harvest next` flies the posterior
    /// and needs none.
    #[serde(default)]
    pub truth: Option<PathBuf>,
    pub seed: u64,
    /// Source of the derivatives during a maneuver.
    #[serde(default, rename = "tables")]
    pub derivatives: DerivativeLookup,
    pub aircraft: Settings,
    #[serde(default)]
    pub instruments: Instruments,
    #[serde(default)]
    pub recorder: RecorderCard,
    #[serde(default)]
    pub wind_tunnel: TunnelErrors,
    /// Programs by maneuver class.
    pub programs: BTreeMap<String, Program>,
    /// Flights by name.
    pub flights: BTreeMap<String, FlightCard>,
    /// Settings of `harvest next`.
    #[serde(default)]
    pub next: NextFlight,
    /// Settings of `harvest lab validate`.
    #[serde(default)]
    pub study: StudySettings,
}

/// Recorder of the flights. Default: every channel of the channel map at the rate of the recorder, one
/// column a channel.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RecorderCard {
    pub form: Form,
    /// Formulas, of the simulator's signals, for the columns that only formulas of the channel map
    /// use.
    pub columns: BTreeMap<String, String>,
    pub slow: SlowColumns,
}

/// Form of the files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// One column a channel.
    #[default]
    Wide,
    /// One row a value: time, name, value.
    Tall,
}

/// Columns that are recorded at a lower rate.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SlowColumns {
    pub rate_hz: f64,
    pub columns: Vec<String>,
}

/// Settings of the study of the bounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StudySettings {
    /// Number of records of each maneuver.
    pub realisations: usize,
    /// Number of angles of attack of each class, spread over those of its cards.
    pub points: usize,
    /// Time constant of the coloured noise; its standard deviation is that of the white noise.
    pub coloured_time_s: f64,
    /// Conditions of the study, in the order of its page.
    pub conditions: Vec<StudyCondition>,
}

impl Default for StudySettings {
    fn default() -> Self {
        StudySettings {
            realisations: 200,
            points: 3,
            coloured_time_s: 0.5,
            conditions: Vec::new(),
        }
    }
}

/// Errors of the simulated wind-tunnel database.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TunnelErrors {
    /// Standard deviation of the error common to a table, percent of the table's root mean square.
    /// The tables are those of the derivatives and of the combined sums; constants follow.
    pub error_pct: f64,
    /// Standard deviation of the further error of each point, in the same unit.
    pub scatter_pct: f64,
    /// Angle of attack over which a point's further error fades, deg: balances, mounts and fairing
    /// make errors alike at neighbouring angles. Zero: each point has an error of its own.
    pub scatter_length_deg: f64,
    /// Derivatives and combined sums left out of the database.
    pub leave_out: Vec<String>,
}

impl Default for TunnelErrors {
    fn default() -> Self {
        TunnelErrors {
            error_pct: 0.0,
            scatter_pct: 0.0,
            scatter_length_deg: 15.0,
            leave_out: Vec::new(),
        }
    }
}

/// Test points and conditions of one flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlightCard {
    pub altitude_ft: f64,
    pub mass_slug: f64,
    /// Mass burnt between consecutive test points.
    #[serde(default)]
    pub burnt_slug: f64,
    #[serde(default)]
    pub heading_deg: f64,
    #[serde(default)]
    pub turbulence: Option<Turbulence>,
    #[serde(default)]
    pub discrete_gusts: Option<DiscreteGusts>,
    /// Time by which surfaces are recorded late.
    #[serde(default)]
    pub surface_delay_s: f64,
    pub points: Vec<TestPoint>,
}

impl FlightCard {
    /// Condition of the flight's maneuvers.
    #[must_use]
    pub fn condition(&self, derivatives: DerivativeLookup) -> FlightCondition {
        FlightCondition {
            derivatives,
            turbulence: self.turbulence,
            discrete_gusts: self.discrete_gusts,
        }
    }
}
