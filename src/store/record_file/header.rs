//! Header of a record's file: its metadata, which is read before the samples.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use parquet::file::metadata::KeyValue;

use super::layout::{CONSTANT, FLIGHT, SAMPLES, START, STEP};
use crate::flight::Record;

/// Id, clock and constants of a record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordHeader {
    pub flight_id: String,
    pub start_s: f64,
    pub step_s: f64,
    pub samples: usize,
    /// Values of constant signals.
    pub constants: BTreeMap<String, f64>,
}

impl RecordHeader {
    /// Parses the key-value metadata of a file.
    ///
    /// # Errors
    /// The key that is missing or no number.
    pub(super) fn parse(keys: &HashMap<String, String>) -> Result<RecordHeader, String> {
        let text = |key: &str| {
            let value = keys.get(key);
            value.ok_or_else(|| format!("its metadata has no `{key}`"))
        };
        let number = |key: &str| {
            let value = text(key)?.parse::<f64>();
            value.map_err(|e| format!("`{key}`: {e}"))
        };
        let samples = text(SAMPLES)?.parse::<usize>();
        let named = keys
            .keys()
            .filter_map(|key| Some((key, key.strip_prefix(CONSTANT)?)));
        Ok(RecordHeader {
            flight_id: text(FLIGHT)?.clone(),
            start_s: number(START)?,
            step_s: number(STEP)?,
            samples: samples.map_err(|e| format!("`{SAMPLES}`: {e}"))?,
            constants: named
                .map(|(key, name)| Ok((name.to_owned(), number(key)?)))
                .collect::<Result<_, String>>()?,
        })
    }

    /// Key-value metadata of the file.
    pub(super) fn metadata(&self) -> Vec<KeyValue> {
        let constants = self
            .constants
            .iter()
            .map(|(name, v)| KeyValue::new(format!("{CONSTANT}{name}"), v.to_string()));
        let own = [
            KeyValue::new(FLIGHT.to_owned(), self.flight_id.clone()),
            KeyValue::new(START.to_owned(), self.start_s.to_string()),
            KeyValue::new(STEP.to_owned(), self.step_s.to_string()),
            KeyValue::new(SAMPLES.to_owned(), self.samples.to_string()),
        ];
        own.into_iter().chain(constants).collect()
    }

    /// Record of a range of samples, without signals.
    pub(super) fn record(&self, samples: &Range<usize>) -> Record {
        Record {
            flight_id: self.flight_id.clone(),
            start_s: self.start_s + samples.start as f64 * self.step_s,
            step_s: self.step_s,
            samples: samples.len(),
            signals: BTreeMap::new(),
            remaining_errors: BTreeMap::new(),
        }
    }
}
