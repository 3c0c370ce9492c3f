//! Clock of a recording: the column that counts time, and its unit.

use super::recording::{Recording, column_names};
use super::vocabulary::meanings;
use super::words::Spelling;
use crate::flight::signal;
use crate::numerics::order_statistics::median;
use crate::units::{Quantity, Unit};

/// Least share of steps that go forwards in a column that counts time.
const FORWARDS: f64 = 0.99;
/// Share of its mean by which the median step of a clock differs at most.
const UNEVEN: f64 = 0.5;
/// Steps between samples that recorders have, s: 1 kHz to 2 Hz.
const STEPS_S: (f64, f64) = (0.000_9, 0.55);

/// The column that counts time.
#[derive(Clone, Debug, PartialEq)]
pub struct ClockColumn {
    pub name: String,
    pub unit: Unit,
    /// Median step between rows, s.
    pub step_s: f64,
    /// `true` if name and unit leave no doubt.
    pub is_sure: bool,
    pub evidence: String,
}

/// Finds the column that counts time.
#[must_use]
pub fn find_clock(recordings: &[Recording]) -> Option<ClockColumn> {
    let names = column_names(recordings);
    let candidates = names.into_iter().filter_map(|name| clock(recordings, name));
    candidates
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, clock)| clock)
}

/// A column as a clock, with the weight of its name; `None` for a column that is no clock.
fn clock(recordings: &[Recording], name: &str) -> Option<(f64, ClockColumn)> {
    let columns = recordings.iter().filter_map(|r| r.column(name));
    let mut steps = Vec::new();
    let mut stated = None;
    for column in columns {
        steps.extend(column.values.windows(2).map(|pair| pair[1] - pair[0]));
        stated = stated.or_else(|| Unit::parse(column.stated.as_deref()?).ok());
    }
    steps.retain(|step| step.is_finite());
    let forwards = steps.iter().filter(|step| **step > 0.0).count() as f64;
    let step = median(steps.iter().copied())?;
    let mean = steps.iter().filter(|s| **s > 0.0).sum::<f64>() / forwards;
    let is_even = forwards >= FORWARDS * steps.len() as f64 && (step / mean - 1.0).abs() < UNEVEN;
    let spelling = Spelling::of(name);
    let meaning = meanings(&spelling)
        .into_iter()
        .find(|m| m.0 == signal::TIME);
    let stated = stated.or(spelling.unit);
    if !is_even || stated.is_some_and(|unit| unit.quantity != Quantity::Time) {
        return None;
    }
    let (unit, by) = match stated {
        Some(unit) => (unit, "the unit is stated"),
        None => (of_step(step)?, "the unit follows from the step alone"),
    };
    let step_s = step * unit.factor_to(Unit::of_signal(signal::TIME))?;
    let is_usual = (STEPS_S.0..=STEPS_S.1).contains(&step_s);
    let weight = meaning.map_or(0.0, |m| m.1) + if stated.is_some() { 0.5 } else { 0.0 };
    let evidence = format!("rises evenly by {step_s:.4} s from row to row; {by}");
    let is_sure = is_usual && (meaning.is_some() || stated.is_some());
    let name = name.to_owned();
    Some((
        weight + f64::from(u8::from(is_usual)),
        ClockColumn {
            name,
            unit,
            step_s,
            is_sure,
            evidence,
        },
    ))
}

/// Unit in which a step is that of a recorder.
fn of_step(step: f64) -> Option<Unit> {
    let units = ["s", "ms", "us", "ns"].into_iter();
    let mut units = units.filter_map(|name| Unit::parse(name).ok());
    units.find(|unit| {
        let step_s = unit
            .factor_to(Unit::of_signal(signal::TIME))
            .map(|f| f * step);
        step_s.is_some_and(|s| (STEPS_S.0..=STEPS_S.1).contains(&s))
    })
}
