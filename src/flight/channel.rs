//! Channels as the recorder wrote them: column name, unit and sign. The channel map assigns them to
//! signals.

use std::collections::BTreeMap;

use serde::Serialize;

use super::formula::Formula;

/// One line of the channel map: conversion of a recorded column, or of several, to a signal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Channel {
    /// Signal of the column, with the signal's unit as the end of its name: `alpha_vane_deg`.
    pub signal: String,
    /// Unit of the recorded values; they are converted to the signal's unit.
    pub unit: String,
    /// −1 where the recorder's sign is the opposite of the signal's.
    pub sign: f64,
    /// Further factor of the recorder (a calibration).
    pub scale: f64,
    /// Period at which the value wraps around (a heading: 360), in the recorder's unit.
    pub wraps_at: Option<f64>,
    /// Columns from which the channel is computed, in place of the column of its own name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub formula: Option<Formula>,
}

impl Channel {
    /// Channel of a column in a unit, with the signal's sign.
    #[must_use]
    pub fn plain(signal: &str, unit: &str) -> Channel {
        Channel {
            signal: signal.to_owned(),
            unit: unit.to_owned(),
            sign: 1.0,
            scale: 1.0,
            wraps_at: None,
            formula: None,
        }
    }
}

/// Columns that the files must have for the channels: those of channels without a formula, and those
/// of the formulas.
#[must_use]
pub fn columns(channels: &BTreeMap<String, Channel>) -> BTreeMap<String, Channel> {
    let (computed, recorded): (Vec<_>, Vec<_>) = channels
        .iter()
        .partition(|(_, channel)| channel.formula.is_some());
    let operands = computed
        .into_iter()
        .filter_map(|(_, channel)| channel.formula.as_ref())
        .flat_map(Formula::operands);
    let mut columns: BTreeMap<String, Channel> = operands
        .map(|operand| (operand.column.clone(), Channel::plain("", &operand.unit)))
        .collect();
    let recorded = recorded.into_iter();
    columns.extend(recorded.map(|(name, channel)| (name.clone(), channel.clone())));
    columns
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
