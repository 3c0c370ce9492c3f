//! A channel into a signal: unit, sign and scale as the channel map says, its rows into the slots of the clock, repaired.

use std::collections::BTreeMap;

use super::clock::Clock;
use super::{Settings, Spoilt, gaps, spikes};
use crate::flight::record::Series;
use crate::flight::{Channel, RawFlight};
use crate::units::Unit;

/// The unit of a flag: engaged or not, nothing between.
const FLAG: &str = "0/1";

/// Every unit that the file states is the channel map's.
///
/// # Errors
/// The first channel whose stated unit is another.
pub fn check_units(raw: &RawFlight, channels: &BTreeMap<String, Channel>) -> Result<(), Spoilt> {
    for (name, channel) in channels {
        let stated = raw.columns.get(name).and_then(|c| c.unit.as_deref()).map(str::trim).filter(|u| !u.is_empty());
        if let Some(stated) = stated
            && !same_unit(stated, &channel.unit)
        {
            let reason = format!(
                "the file states `{stated}` for channel `{name}`, the channel map `{}`: correct the channel map, or \
                 the file",
                channel.unit
            );
            return Err((format!("channel `{name}`"), reason));
        }
    }
    Ok(())
}

fn same_unit(stated: &str, mapped: &str) -> bool {
    match (Unit::parse(stated), Unit::parse(mapped)) {
        (Ok(a), Ok(b)) => a.factor_to(b).is_some_and(|f| (f - 1.0).abs() < 1e-12),
        _ => stated == mapped,
    }
}

/// The signal that a channel carries, on the clock, with its repairs marked.
///
/// # Errors
/// The column is not in the file, holds no number at all, or has a unit that its signal cannot be in.
pub fn series(
    raw: &RawFlight,
    name: &str,
    channel: &Channel,
    clock: &Clock,
    settings: &Settings,
) -> Result<Series, Spoilt> {
    let at = |reason: String| Err((format!("channel `{name}`"), reason));
    let Some(column) = raw.columns.get(name) else {
        return at(format!("channel `{name}` (signal `{}`) is not in the file", channel.signal));
    };
    let target = Unit::of_signal(&channel.signal);
    let Some(factor) = Unit::parse(&channel.unit).ok().and_then(|u| u.factor_to(target)) else {
        return at(format!(
            "signal `{}` is in {}, which `{}` does not convert to",
            channel.signal, target.name, channel.unit
        ));
    };
    if !column.values.iter().any(|v| v.is_finite()) {
        let rows = column.values.len();
        return at(format!("channel `{name}` (signal `{}`) holds no number in {rows} rows", channel.signal));
    }
    let mut recorded = column.values.clone();
    if let Some(period) = channel.wraps_at {
        unwrap(&mut recorded, period);
    }
    let mut values = vec![f64::NAN; clock.samples];
    for (&slot, value) in clock.slots.iter().zip(recorded) {
        if let Some(place) = values.get_mut(slot).filter(|_| value.is_finite()) {
            *place = value * channel.sign * channel.scale * factor;
        }
    }
    Ok(repaired(values, channel.unit == FLAG, clock.step_s, settings))
}

/// A flag has no noise and no values between its two: it is never despiked, and a gap holds what was last recorded.
fn repaired(mut values: Vec<f64>, flag: bool, step_s: f64, settings: &Settings) -> Series {
    let spikes = if flag { Vec::new() } else { spikes::remove(&mut values, step_s, &settings.spikes) };
    let longest = gaps::longest(settings.longest_bridge_s, step_s);
    let marks = gaps::fill(&mut values, longest, if flag { gaps::Bridge::Held } else { gaps::Bridge::Line });
    let mut series = Series { values, marks };
    for spike in spikes {
        series.marks[spike] = crate::flight::Mark::Despiked;
    }
    series
}

/// Makes a value that wraps around at `period` continuous.
fn unwrap(values: &mut [f64], period: f64) {
    let mut before: Option<f64> = None;
    for value in values.iter_mut().filter(|v| v.is_finite()) {
        if let Some(before) = before {
            *value -= ((*value - before) / period).round() * period;
        }
        before = Some(*value);
    }
}

/// Two channels for one signal.
pub fn twice(name: &str, channel: &Channel) -> Spoilt {
    let reason = format!("channel `{name}` and another one are both mapped to signal `{}`", channel.signal);
    (format!("channel `{name}`"), reason)
}

/// A required signal that is neither a channel nor a constant.
pub fn nobody_gives(signal: &str) -> Spoilt {
    let reason =
        format!("signal `{signal}` is neither a channel nor a constant; map a channel to it or give its value");
    (format!("signal `{signal}`"), reason)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_through_north_becomes_continuous() {
        let mut heading = vec![358.0, 359.5, f64::NAN, 1.0, 2.5, 359.0, 357.0];
        unwrap(&mut heading, 360.0);
        heading[2] = 0.0;
        assert_eq!(heading, [358.0, 359.5, 0.0, 361.0, 362.5, 359.0, 357.0]);
    }

    #[test]
    fn units_spelled_differently_are_the_same() {
        assert!(same_unit("psf", "lbf/ft2"));
        assert!(same_unit("slug ft^2", "slug ft2"));
        assert!(!same_unit("rad", "deg"));
        assert!(!same_unit("deg", "deg/s"));
        assert!(!same_unit("furlong", "ft"));
    }
}
