//! Recording of a flight: the channel map applied backwards, from signals to recorded columns.

use std::collections::BTreeMap;

use crate::flight::channel::RawColumn;
use crate::flight::{Channel, Record};
use crate::units::Unit;

/// Columns of a recorder for consecutive records.
pub fn columns(
    channels: &BTreeMap<String, Channel>,
    records: &[Record],
) -> BTreeMap<String, RawColumn> {
    channels
        .iter()
        .map(|(name, channel)| (name.clone(), column(channel, records)))
        .collect()
}

fn column(channel: &Channel, records: &[Record]) -> RawColumn {
    let factor = Unit::parse(&channel.unit)
        .ok()
        .and_then(|u| u.factor_to(Unit::of_signal(&channel.signal)));
    let per_unit = 1.0 / (factor.unwrap_or(1.0) * channel.sign * channel.scale);
    let recorded = |value: f64| match channel.wraps_at {
        Some(period) => (value * per_unit).rem_euclid(period),
        None => value * per_unit,
    };
    let values = records.iter().flat_map(|record| {
        (0..record.samples).map(move |k| recorded(signal_value(channel, record, k)))
    });
    RawColumn {
        unit: Some(channel.unit.clone()),
        values: values.collect(),
    }
}

/// Value of a channel's signal at a sample; 0 for a flag that the card's program does not set.
fn signal_value(channel: &Channel, record: &Record, k: usize) -> f64 {
    match record.values(&channel.signal) {
        _ if channel.signal == "time_s" => record.time_s(k),
        Some(values) => values.get(k).copied().unwrap_or(f64::NAN),
        None => 0.0,
    }
}
