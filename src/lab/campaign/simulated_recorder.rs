//! Recording of a flight: the channel map applied backwards, from signals to recorded columns.

use std::collections::BTreeMap;

use super::cards::{Form, RecorderCard};
use crate::error::did_you_mean;
use crate::flight::channel::{RawColumn, columns};
use crate::flight::formula::Operand;
use crate::flight::{Channel, Formula, Record, signal};
use crate::store::recorder;
use crate::units::{Conversion, Unit};

/// Recorder of a campaign, checked against the channel map.
#[derive(Clone, Debug)]
pub struct Recorder {
    form: Form,
    /// Column of the clock.
    time: String,
    columns: Vec<RecordedColumn>,
}

#[derive(Clone, Debug)]
struct RecordedColumn {
    name: String,
    unit: String,
    content: Content,
    /// Samples from one recorded value to the next.
    every: usize,
}

/// Values of a column.
#[derive(Clone, Debug)]
enum Content {
    Channel {
        channel: Channel,
        from_signal: Conversion,
    },
    Formula {
        formula: Formula,
        /// Factor of the recorder in the channel map.
        factor: f64,
    },
}

impl Recorder {
    /// Checks a recorder.
    ///
    /// # Errors
    /// The name of a column and the message for the first mistake.
    pub fn new(
        card: &RecorderCard,
        channels: &BTreeMap<String, Channel>,
        signals: &[&str],
        rate_hz: f64,
    ) -> Result<Recorder, (String, String)> {
        let recorded = columns(channels);
        let mut given = card.columns.keys().chain(&card.slow.columns);
        if let Some(name) = given.find(|name| !recorded.contains_key(*name)) {
            let near = did_you_mean(name, recorded.keys().map(String::as_str));
            let what = format!("recorder: the channel map has no column `{name}`{near}");
            return Err((name.clone(), what));
        }
        let of_slow = every(rate_hz, &card.slow).map_err(|what| ("rate_hz".to_owned(), what))?;
        let column = |(name, channel): (&String, &Channel)| -> Result<_, (String, String)> {
            let is_slow = card.slow.columns.contains(name);
            Ok(RecordedColumn {
                name: name.clone(),
                unit: channel.unit.clone(),
                content: content(card, channels, signals, name, channel)
                    .map_err(|what| (name.clone(), what))?,
                every: if is_slow { of_slow } else { 1 },
            })
        };
        let mut clocks = channels.iter().filter(|(_, c)| c.signal == signal::TIME);
        Ok(Recorder {
            form: card.form,
            time: clocks
                .next()
                .map_or_else(String::new, |(name, _)| name.clone()),
            columns: recorded.iter().map(column).collect::<Result<_, _>>()?,
        })
    }

    /// Bytes of the file with consecutive records.
    ///
    /// # Errors
    /// The reason, in words.
    pub fn bytes(&self, records: &[Record]) -> Result<Vec<u8>, String> {
        let columns = self.columns.iter();
        let columns = columns
            .map(|column| (column.name.clone(), column.recorded(records)))
            .collect();
        match self.form {
            Form::Wide => recorder::bytes(&columns),
            Form::Tall => recorder::tall_bytes(&self.time, &columns),
        }
    }
}

/// Samples from one value of a slow column to the next.
fn every(rate_hz: f64, slow: &super::cards::SlowColumns) -> Result<usize, String> {
    if slow.columns.is_empty() {
        return Ok(1);
    }
    let ratio = rate_hz / slow.rate_hz;
    if !(ratio >= 1.0 && ratio <= rate_hz * 60.0 && (ratio - ratio.round()).abs() < 1e-9) {
        return Err(
            "recorder: the rate of the aircraft must be a multiple of `slow: rate_hz`".to_owned(),
        );
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number from 1 to a minute of samples"
    )]
    let every = ratio.round() as usize;
    Ok(every)
}

/// Content of a recorded column: the simulator's signal in the channel's unit, or the formula that
/// the recorder card gives for it.
fn content(
    card: &RecorderCard,
    channels: &BTreeMap<String, Channel>,
    signals: &[&str],
    name: &str,
    channel: &Channel,
) -> Result<Content, String> {
    let unit = Unit::parse(&channel.unit)?;
    let Some(text) = card.columns.get(name) else {
        if channel.signal.is_empty() {
            return Err(format!(
                "recorder: `columns` gives no formula for `{name}`, which the channel map computes from"
            ));
        }
        let from_signal = Unit::of_signal(&channel.signal).conversion_to(unit);
        let from_signal = from_signal.ok_or("a unit of another quantity")?;
        return Ok(Content::Channel {
            channel: channel.clone(),
            from_signal,
        });
    };
    let operand = |signal: &str| {
        if !signals.contains(&signal) {
            let near = did_you_mean(signal, signals.iter().copied());
            return Err(format!("the simulator has no signal `{signal}`{near}"));
        }
        Ok(Operand {
            column: signal.to_owned(),
            unit: Unit::of_signal(signal).name.to_owned(),
            factor: 1.0,
        })
    };
    let formula = Formula::parse(text, unit, operand)
        .map_err(|what| format!("recorder: formula `{text}` of `{name}`: {what}"))?;
    let operands = channels.values().filter_map(|c| c.formula.as_ref());
    let mut operands = operands.flat_map(Formula::operands);
    let factor = operands
        .find(|operand| operand.column == name)
        .map_or(1.0, |o| o.factor);
    Ok(Content::Formula { formula, factor })
}

impl RecordedColumn {
    /// The column for consecutive records; NaN where it has no value.
    fn recorded(&self, records: &[Record]) -> RawColumn {
        let values = records.iter().flat_map(|record| {
            (0..record.samples).map(move |k| {
                if k % self.every == 0 {
                    self.content.value(record, k)
                } else {
                    f64::NAN
                }
            })
        });
        RawColumn {
            unit: Some(self.unit.clone()),
            values: values.collect(),
        }
    }
}

impl Content {
    /// Value at a sample.
    fn value(&self, record: &Record, k: usize) -> f64 {
        match self {
            Content::Channel {
                channel,
                from_signal,
            } => {
                let value = from_signal.of(signal_value(&channel.signal, record, k))
                    / (channel.sign * channel.scale);
                match channel.wraps_at {
                    Some(period) => value.rem_euclid(period),
                    None => value,
                }
            }
            Content::Formula { formula, factor } => {
                let operands = formula.operands().iter();
                let values = operands.map(|o| signal_value(&o.column, record, k));
                formula.value(&values.collect::<Vec<f64>>()) / factor
            }
        }
    }
}

/// Value of a signal at a sample; 0 for a flag that the card's program does not set.
fn signal_value(signal: &str, record: &Record, k: usize) -> f64 {
    match record.values(signal) {
        _ if signal == signal::TIME => record.time_s(k),
        Some(values) => values.get(k).copied().unwrap_or(f64::NAN),
        None => 0.0,
    }
}
