//! Channels as the recorder wrote them: column name, unit and sign. The channel map assigns them to
//! signals.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// One line of the channel map: conversion of a recorded column to a signal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Signal of the column, with the signal's unit as the end of its name: `alpha_vane_deg`.
    pub signal: String,
    /// Unit of the recorded values; they are converted to the signal's unit.
    pub unit: String,
    /// −1 where the recorder's sign is the opposite of the signal's.
    #[serde(default = "one")]
    pub sign: f64,
    /// Further factor of the recorder (a calibration).
    #[serde(default = "one")]
    pub scale: f64,
    /// Period at which the value wraps around (a heading: 360), in the recorder's unit.
    #[serde(default)]
    pub wraps_at: Option<f64>,
}

fn one() -> f64 {
    1.0
}

/// A column of a file: the unit that its metadata states, where it states one, and the values (a
/// null is a NaN).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawColumn {
    pub unit: Option<String>,
    pub values: Vec<f64>,
}

/// A flight as recorded: the columns of the channel map, on the recorder's clock and in its units
/// and signs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawFlight {
    pub flight_id: String,
    pub columns: BTreeMap<String, RawColumn>,
}
