//! Survey of a tall file: its names with their units and times, and the order of its rows.

use std::collections::BTreeMap;

use super::source::{Tall, text};
use crate::error::Result;
use crate::store::import::imported_contents::refused;

/// Number of bins of the time span, from which the spans that are sorted at once are composed.
pub(super) const BINS: usize = 1 << 14;

/// Largest number of names of a file: more than any recorder has channels.
const MOST_NAMES: usize = 20_000;

/// Values of one name.
#[derive(Default)]
pub(super) struct NamedValues {
    pub unit: Option<String>,
    pub count: usize,
    /// Sum of the hashes of the times: equal for equal times in any order.
    times: u64,
}

impl NamedValues {
    fn add(&mut self, time: f64, unit: Option<&str>) {
        self.count += 1;
        self.times = self.times.wrapping_add(hash(time));
        if self.unit.is_none() {
            self.unit = unit.map(str::to_owned);
        }
    }

    /// Key of the set of times, by which names are compared.
    pub(super) fn clock(&self) -> Clock {
        Clock {
            count: self.count,
            times: self.times,
        }
    }
}

/// Key of a set of times: equal for names that have values at the same times, for any order of the
/// rows.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Clock {
    count: usize,
    /// Sum of the hashes of the times.
    times: u64,
}

/// Hash of a time (the finaliser of Steele, Lea and Flood).
fn hash(time: f64) -> u64 {
    let z = time.to_bits();
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Names with their values, and the order of the rows.
#[derive(Default)]
pub(super) struct Survey {
    pub names: BTreeMap<String, NamedValues>,
    pub is_in_order: bool,
    rows: usize,
    /// Least and largest finite time.
    span_s: (f64, f64),
}

impl Survey {
    fn add_time(&mut self, time: f64, before: f64) {
        self.rows += 1;
        self.is_in_order &= time >= before;
        if time.is_finite() {
            self.span_s = (self.span_s.0.min(time), self.span_s.1.max(time));
        }
    }

    /// Bin of a time; a time that is no number is in the last bin.
    pub(super) fn bin(&self, time: f64) -> usize {
        let (first, last) = self.span_s;
        let share = (time - first) / (last - first);
        if share.is_nan() {
            return BINS - 1;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped to a range of counts"
        )]
        let bin = (share * BINS as f64).clamp(0.0, (BINS - 1) as f64) as usize;
        bin
    }
}

impl Tall {
    /// Reads the whole file once.
    pub(super) fn survey(&self) -> Result<Survey> {
        let mut survey = Survey {
            is_in_order: true,
            span_s: (f64::INFINITY, f64::NEG_INFINITY),
            ..Survey::default()
        };
        let mut before = f64::NEG_INFINITY;
        for batch in self.batches()? {
            let batch = batch?;
            let names = self.texts(&batch, &self.name)?;
            let units = self.unit.as_ref().map(|unit| self.texts(&batch, unit));
            let units = units.transpose()?;
            for (row, time) in self.times(&batch)?.into_iter().enumerate() {
                survey.add_time(time, before);
                before = time;
                let name = text(&names, row);
                let unit = units.as_ref().map(|units| text(units, row));
                let unit = unit.filter(|unit| !unit.is_empty());
                if let Some(values) = survey.names.get_mut(name) {
                    values.add(time, unit);
                } else {
                    let mut values = NamedValues::default();
                    values.add(time, unit);
                    survey.names.insert(name.to_owned(), values);
                }
            }
            if survey.names.len() > MOST_NAMES {
                let what = format!("more than {MOST_NAMES} names in the column `{}`", self.name);
                return Err(refused(&self.source, &what));
            }
        }
        // A channel may have the clock's name.
        survey.names.remove(&self.time);
        Ok(survey)
    }
}
