//! Cards as they are written, YAML: the simulated aircraft, its truth and instruments, the programs
//! of the maneuvers, and the flights with their test points.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::lab::simulator::{Input, Instruments, Program, Settings, Tables, Turbulence};

/// A campaign to be simulated. Paths are relative to the folder harvest is run in.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cards {
    /// The pipeline whose aircraft, channel map and build-up hold: a folder, or the name of one
    /// under `pipelines/`.
    pub pipeline: PathBuf,
    /// The true derivatives, CSV as a wind-tunnel table.
    pub truth: PathBuf,
    pub seed: u64,
    #[serde(default)]
    pub tables: Tables,
    pub aircraft: Settings,
    #[serde(default)]
    pub instruments: Instruments,
    #[serde(default)]
    pub wind_tunnel: Tunnel,
    /// Maneuver class → what is done in it.
    pub programs: BTreeMap<String, Program>,
    /// Name of the flight → what it flies.
    pub flights: BTreeMap<String, FlightCard>,
    /// How `harvest validate` records the test points.
    #[serde(default)]
    pub study: Study,
}

/// How the bounds are put to the test: maneuvers of the cards recorded many times.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Study {
    /// Records of each maneuver.
    pub realisations: usize,
    /// Angles of attack of each class, spread over those that its cards have.
    pub points: usize,
    /// Time constant of the outputs' noise where it is coloured; its size is that of the white
    /// noise.
    pub coloured_time_s: f64,
}

impl Default for Study {
    fn default() -> Self {
        Study {
            realisations: 200,
            points: 3,
            coloured_time_s: 0.5,
        }
    }
}

/// How the wind-tunnel database differs from the truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tunnel {
    /// Standard deviation of a derivative's error over the whole table, in percent of its root mean
    /// square.
    pub error_pct: f64,
    /// The same for each of its points.
    pub scatter_pct: f64,
    /// Derivatives and combined sums that the tunnel does not have.
    pub leave_out: Vec<String>,
}

/// One flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlightCard {
    pub altitude_ft: f64,
    pub mass_slug: f64,
    /// Mass burnt from one test point to the next.
    #[serde(default)]
    pub burnt_slug: f64,
    #[serde(default)]
    pub heading_deg: f64,
    #[serde(default)]
    pub turbulence: Option<Turbulence>,
    pub points: Vec<TestPoint>,
}

/// A maneuver class at some angles of attack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestPoint {
    pub class: String,
    pub alpha_deg: Vec<f64>,
    /// All inputs are this many times their program's.
    #[serde(default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}

impl Program {
    /// The program with its inputs this many times as large.
    #[must_use]
    pub fn scaled(&self, scale: f64) -> Program {
        let input = |i: &Input| Input {
            size: scale * i.size,
            ..i.clone()
        };
        Program {
            inputs: self.inputs.iter().map(input).collect(),
            ..self.clone()
        }
    }
}
