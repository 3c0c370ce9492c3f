//! A channel is what the recorder wrote: a column name, a unit, a sign. The channel map says which
//! signal it is.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// One line of the channel map: how a recorded column becomes a signal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// The signal it is, with the signal's unit as the end of its name: `alpha_vane_deg`.
    pub signal: String,
    /// The unit the recorder writes; converted into the signal's.
    pub unit: String,
    /// −1 where the recorder's sign is the opposite of the signal's.
    #[serde(default = "one")]
    pub sign: f64,
    /// A further factor of the recorder (a known calibration).
    #[serde(default = "one")]
    pub scale: f64,
    /// The period at which the value wraps around (a heading: 360), in the recorder's unit.
    #[serde(default)]
    pub wraps_at: Option<f64>,
}

fn one() -> f64 {
    1.0
}

/// A column as it lies in the file: the unit that its metadata states, where it states one, and the
/// values as numbers (a null is a NaN).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawColumn {
    pub unit: Option<String>,
    pub values: Vec<f64>,
}

/// A flight as recorded: the columns of the channel map, still on the recorder's clock, in its
/// units and signs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawFlight {
    pub flight_id: String,
    pub columns: BTreeMap<String, RawColumn>,
}
