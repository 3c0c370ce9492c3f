//! The channel map compared with the files: which channels are read, with which factor into the
//! unit of their signal.

use std::collections::BTreeMap;

use super::conditioner::{ChannelStatistics, LARGEST};
use crate::error::Problem;
use crate::flight::{Channel, signal};
use crate::ingest::clock::Clock;
use crate::ingest::column_source::ColumnSource;
use crate::ingest::context::Context;
use crate::ingest::refusal::Refusal;
use crate::units::Unit;

/// Relative difference below which two factors are the same unit: rounding of the factors.
const SAME_FACTOR: f64 = 1e-12;

/// Most stuck intervals of a channel that a message names by their times.
const NAMED_INTERVALS: usize = 3;

/// A channel that the files have, with the factor that converts its values into the signal's unit.
#[derive(Clone, Copy, Debug)]
pub struct ChannelPlan<'a> {
    pub name: &'a str,
    pub channel: &'a Channel,
    pub factor: f64,
}

/// Plans the channels to be read, in the order of their signals, with a problem for each channel
/// that cannot be read.
///
/// # Errors
/// A problem that refuses the flight: a unit in a file that is not the channel map's, a required
/// channel that is in no file, a signal with two channels, or a required signal without a source.
pub fn plan_channels<'a>(
    source: &(impl ColumnSource + ?Sized),
    context: &Context<'a>,
) -> Result<(Vec<ChannelPlan<'a>>, Vec<Problem>), Problem> {
    let flight_id = source.flight_id();
    plan(source, context, flight_id).map_err(|refusal| refusal.into_problem(flight_id))
}

fn plan<'a>(
    source: &(impl ColumnSource + ?Sized),
    context: &Context<'a>,
    flight_id: &str,
) -> Result<(Vec<ChannelPlan<'a>>, Vec<Problem>), Refusal> {
    check_units(source, context.channels)?;
    let mut plans: BTreeMap<&str, ChannelPlan> = BTreeMap::new();
    let mut problems = Vec::new();
    let mapped = context.channels.iter();
    for (name, channel) in mapped.filter(|(_, c)| c.signal != signal::TIME) {
        let factor = match unit_factor(source, name, channel) {
            Ok(factor) => factor,
            Err(refusal) if context.is_optional(&channel.signal) => {
                problems.push(refusal.into_problem(flight_id));
                continue;
            }
            Err(refusal) => return Err(refusal),
        };
        let plan = ChannelPlan {
            name,
            channel,
            factor,
        };
        if plans.insert(&channel.signal, plan).is_some() {
            return Err(duplicate_signal(name, channel));
        }
    }
    for required in signal::REQUIRED {
        if !plans.contains_key(required) && !context.constants.contains_key(*required) {
            return Err(missing_signal(required));
        }
    }
    Ok((plans.into_values().collect(), problems))
}

/// Checks that every unit that a file states is the channel map's.
fn check_units(
    source: &(impl ColumnSource + ?Sized),
    channels: &BTreeMap<String, Channel>,
) -> Result<(), Refusal> {
    for (name, channel) in channels {
        let stated = (0..source.files()).filter_map(|file| source.unit(file, name));
        let differs = |unit: &&str| !unit.is_empty() && !same_unit(unit, &channel.unit);
        if let Some(stated) = stated.map(str::trim).find(differs) {
            let reason = format!(
                "the file states `{stated}` for channel `{name}`, the channel map `{}`: correct \
                 the channel map, or the file",
                channel.unit
            );
            return Err(Refusal::of_channel(name, reason));
        }
    }
    Ok(())
}

fn same_unit(stated: &str, mapped: &str) -> bool {
    match (Unit::parse(stated), Unit::parse(mapped)) {
        (Ok(a), Ok(b)) => a
            .factor_to(b)
            .is_some_and(|f| (f - 1.0).abs() < SAME_FACTOR),
        _ => stated == mapped,
    }
}

/// Factor from a channel's unit into its signal's.
fn unit_factor(
    source: &(impl ColumnSource + ?Sized),
    name: &str,
    channel: &Channel,
) -> Result<f64, Refusal> {
    if !(0..source.files()).any(|file| source.has(file, name)) {
        let reason = format!(
            "channel `{name}` (signal `{}`) is not in the file",
            channel.signal
        );
        return Err(Refusal::of_channel(name, reason));
    }
    let target = Unit::of_signal(&channel.signal);
    let unit = Unit::parse(&channel.unit).ok();
    unit.and_then(|u| u.factor_to(target)).ok_or_else(|| {
        let reason = format!(
            "signal `{}` is in {}, which `{}` does not convert to",
            channel.signal, target.name, channel.unit
        );
        Refusal::of_channel(name, reason)
    })
}

/// Refusal of a channel that is in the files and never has a value.
pub fn empty_channel(name: &str, channel: &Channel, rows: usize) -> Refusal {
    let reason = format!(
        "channel `{name}` (signal `{}`) holds no number in {rows} rows",
        channel.signal
    );
    Refusal::of_channel(name, reason)
}

/// Report of the intervals in which a channel is stuck; `None` where it never is.
pub fn stuck_channel(name: &str, statistics: &ChannelStatistics, clock: &Clock) -> Option<Refusal> {
    if statistics.stuck.is_empty() {
        return None;
    }
    let from_to = |&(from, to): &(usize, usize)| {
        format!(
            "from {:.1} s to {:.1} s",
            clock.time_s(from),
            clock.time_s(to.saturating_sub(1))
        )
    };
    let stuck = &statistics.stuck;
    let named: Vec<String> = stuck.iter().take(NAMED_INTERVALS).map(from_to).collect();
    let more = match stuck.len().saturating_sub(NAMED_INTERVALS) {
        0 => String::new(),
        more => format!(" and {more} times more"),
    };
    let reason = format!(
        "its value is stuck {}{more}: noise changed it before, and then nothing; it is left out \
         there",
        named.join(", ")
    );
    Some(Refusal::of_channel(name, reason))
}

/// Refusal of the samples of a channel that are beyond any measurement; `None` where none is.
#[must_use]
pub fn values_beyond(
    name: &str,
    channel: &Channel,
    statistics: &ChannelStatistics,
    clock: &Clock,
) -> Option<Refusal> {
    let first_s = clock.time_s(statistics.first_beyond?);
    let unit = Unit::of_signal(&channel.signal).name;
    let reason = format!(
        "{} samples are beyond {LARGEST:e} {unit}, which no aircraft has, the first at {first_s:.3} s; \
         they count as missing",
        statistics.beyond
    );
    Some(Refusal::of_channel(name, reason))
}

fn duplicate_signal(name: &str, channel: &Channel) -> Refusal {
    let reason = format!(
        "channel `{name}` and another one are both mapped to signal `{}`",
        channel.signal
    );
    Refusal::of_channel(name, reason)
}

fn missing_signal(signal: &str) -> Refusal {
    Refusal {
        place: format!("signal `{signal}`"),
        reason: format!(
            "signal `{signal}` is neither a channel nor a constant; map a channel to it or give \
             its value"
        ),
    }
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
