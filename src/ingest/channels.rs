//! A channel of the map against what the files have: its unit, the factor into the signal's, what
//! is said when it is not there, holds nothing or is stuck.

use std::collections::BTreeMap;

use super::Spoilt;
use super::clock::Clock;
use super::conditioner::Done;
use super::source::Source;
use crate::flight::Channel;
use crate::units::Unit;

/// Every unit that a file states is the channel map's.
///
/// # Errors
/// The first channel whose stated unit is another.
pub fn check_units(
    source: &(impl Source + ?Sized),
    channels: &BTreeMap<String, Channel>,
) -> Result<(), Spoilt> {
    for (name, channel) in channels {
        let stated = (0..source.files()).filter_map(|file| source.unit(file, name));
        let other = |unit: &&str| !unit.is_empty() && !same_unit(unit, &channel.unit);
        if let Some(stated) = stated.map(str::trim).find(other) {
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

/// From a channel's unit into its signal's.
///
/// # Errors
/// The column is in no file, or has a unit that its signal cannot be in.
pub fn factor(
    source: &(impl Source + ?Sized),
    name: &str,
    channel: &Channel,
) -> Result<f64, Spoilt> {
    let at = |reason: String| Err((format!("channel `{name}`"), reason));
    if !(0..source.files()).any(|file| source.has(file, name)) {
        return at(format!(
            "channel `{name}` (signal `{}`) is not in the file",
            channel.signal
        ));
    }
    let target = Unit::of_signal(&channel.signal);
    Unit::parse(&channel.unit)
        .ok()
        .and_then(|u| u.factor_to(target))
        .map_or_else(
            || {
                at(format!(
                    "signal `{}` is in {}, which `{}` does not convert to",
                    channel.signal, target.name, channel.unit
                ))
            },
            Ok,
        )
}

/// A channel that is there and never has a value.
pub fn holds_nothing(name: &str, channel: &Channel, rows: usize) -> Spoilt {
    let reason = format!(
        "channel `{name}` (signal `{}`) holds no number in {rows} rows",
        channel.signal
    );
    (format!("channel `{name}`"), reason)
}

/// How many stand-stills of a channel are named by their times.
const NAMED: usize = 3;

/// A channel that stood still where it should have moved.
pub fn stuck(name: &str, done: &Done, clock: &Clock) -> Option<Spoilt> {
    let from_to = |&(from, to): &(usize, usize)| {
        format!(
            "from {:.1} s to {:.1} s",
            clock.time_s(from),
            clock.time_s(to.saturating_sub(1))
        )
    };
    let named: Vec<String> = done.stuck.iter().take(NAMED).map(from_to).collect();
    let more = done.stuck.len().saturating_sub(NAMED);
    let more = if more > 0 {
        format!(" and {more} times more")
    } else {
        String::new()
    };
    (!named.is_empty()).then(|| {
        let reason = format!(
            "its value is stuck {}{more}: noise changed it before, and then nothing; it is left out there",
            named.join(", ")
        );
        (format!("channel `{name}`"), reason)
    })
}

/// Two channels for one signal.
pub fn twice(name: &str, channel: &Channel) -> Spoilt {
    let reason = format!(
        "channel `{name}` and another one are both mapped to signal `{}`",
        channel.signal
    );
    (format!("channel `{name}`"), reason)
}

/// A required signal that is neither a channel nor a constant.
pub fn nobody_gives(signal: &str) -> Spoilt {
    let reason = format!(
        "signal `{signal}` is neither a channel nor a constant; map a channel to it or give its value"
    );
    (format!("signal `{signal}`"), reason)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_spelled_differently_are_the_same() {
        assert!(same_unit("psf", "lbf/ft2"));
        assert!(same_unit("slug ft^2", "slug ft2"));
        assert!(!same_unit("rad", "deg"));
        assert!(!same_unit("deg", "deg/s"));
        assert!(!same_unit("furlong", "ft"));
    }
}
