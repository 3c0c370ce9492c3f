//! Strips of a recording as found: each channel in harvest's unit, and the columns without a signal.

use std::collections::BTreeMap;

use super::signal_strips::{FLAG, FLIGHT_SIGNAL, LEAST_COLUMNS, SignalStrips};
use crate::flight::record::Series;
use crate::flight::{Mark, Record};
use crate::inspection::{Channel, Inspection, Role};
use crate::report::figure::strip::Strip;
use crate::report::figure::strip_figure::{self, StripFigure};
use crate::units::Unit;

/// Width of the drawing.
const WIDTH: f64 = 980.0;

/// Strips of some channels.
#[must_use]
pub fn draw_channels(inspection: &Inspection, id: &str, channels: &[&Channel]) -> String {
    let converted = channels.iter().filter_map(|channel| {
        let values = inspection.grid.columns.get(&channel.column)?;
        let unit = Unit::parse(&channel.unit).ok()?;
        let conversion = unit.conversion_to(Unit::of_signal(&channel.signal))?;
        let converted = |value: &f64| conversion.of(channel.sign * value);
        let values = values.iter().map(converted).collect();
        Some((channel.signal.clone(), values))
    });
    let record = record(inspection, converted.collect());
    let strips = |signals: &SignalStrips| {
        let strip = |channel: &&Channel| {
            let style = if channel.role == Role::Flag {
                FLAG
            } else {
                FLIGHT_SIGNAL
            };
            let mut strip = signals.strip(&channel.signal, style, &[])?;
            if channel.column != strip.name {
                strip.name = format!("{} ({})", strip.name, channel.column);
            }
            Some(strip)
        };
        channels.iter().filter_map(strip).collect()
    };
    draw(&record, id, "channels", strips)
}

/// Strips of the columns without a signal, in the unit recorded.
#[must_use]
pub fn draw_unused(inspection: &Inspection, id: &str) -> String {
    let unused = &inspection.unused;
    let columns = unused.iter().filter_map(|column| {
        let values = inspection.grid.columns.get(&column.column)?;
        Some((column.column.clone(), values.clone()))
    });
    let record = record(inspection, columns.collect());
    let strips = |signals: &SignalStrips| {
        let strip = |column: &crate::inspection::Unused| {
            let mut strip = signals.strip(&column.column, FLIGHT_SIGNAL, &[])?;
            strip.name.clone_from(&column.column);
            strip.unit = column.unit.clone().unwrap_or_default();
            Some(strip)
        };
        unused.iter().filter_map(strip).collect()
    };
    draw(&record, id, "columns without a signal", strips)
}

/// Record of some columns on the inspection's grid: recordings one after the other.
fn record(inspection: &Inspection, columns: BTreeMap<String, Vec<f64>>) -> Record {
    let series = |values: Vec<f64>| {
        let mark = |v: &f64| {
            if v.is_finite() {
                Mark::Measured
            } else {
                Mark::Missing
            }
        };
        let marks = values.iter().map(mark).collect();
        Series { values, marks }
    };
    let stretches = &inspection.grid.stretches;
    Record {
        flight_id: String::new(),
        start_s: 0.0,
        step_s: inspection.grid.step_s,
        samples: stretches.last().map_or(0, |stretch| stretch.end),
        signals: columns
            .into_iter()
            .map(|(name, values)| (name, series(values)))
            .collect(),
        remaining_errors: BTreeMap::new(),
    }
}

fn draw(
    record: &Record,
    id: &str,
    title: &str,
    strips: impl Fn(&SignalStrips) -> Vec<Strip>,
) -> String {
    let to_s = record.time_s(record.samples.saturating_sub(1));
    let signals = SignalStrips::new(record, (0.0, to_s), (0.0, to_s), LEAST_COLUMNS);
    strip_figure::draw(&StripFigure {
        id: id.to_owned(),
        title: title.to_owned(),
        description: format!(
            "Strip charts of {} {title} over {to_s:.0} s.",
            record.signals.len()
        ),
        width: WIDTH,
        time: signals.time,
        columns: vec![strips(&signals)],
    })
}
