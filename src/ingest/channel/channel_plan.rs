//! The channel map compared with the files: which channels are read, with which conversion into
//! the unit of their signal.

use std::collections::BTreeMap;

use super::channel_refusals::duplicate_signal;
use crate::error::Problem;
use crate::flight::{Channel, signal};
use crate::ingest::column_source::ColumnSource;
use crate::ingest::context::Context;
use crate::ingest::refusal::{Refusal, UnreadChannel};
use crate::units::{Conversion, Unit};

/// Relative difference below which two factors are the same unit: rounding of the factors.
const SAME_FACTOR: f64 = 1e-12;

/// A channel that the files have, with the conversion of its values into the signal's unit.
#[derive(Clone, Copy, Debug)]
pub struct ChannelPlan<'a> {
    pub name: &'a str,
    pub channel: &'a Channel,
    pub conversion: Conversion,
}

/// Plans the channels to be read, in the order of their signals, with a problem for each channel
/// that cannot be read.
///
/// # Errors
/// A problem that refuses the flight:
/// - a unit in a file differs from the channel map's;
/// - a required channel is in no file;
/// - a signal has two channels;
/// - a required signal has no source.
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
    let mut plans: BTreeMap<&str, ChannelPlan> = BTreeMap::new();
    let mut left_out: Vec<UnreadChannel> = Vec::new();
    let is_mapped = |signal: &str| context.channels.values().any(|c| c.signal == signal);
    let is_dispensable =
        |signal: &str| context.can_do_without(signal, |other| other != signal && is_mapped(other));
    let is_time = |channel: &Channel| channel.signal == signal::TIME;
    if let Some((name, time)) = context.channels.iter().find(|(_, c)| is_time(c)) {
        stated_units(source, name, time)?;
    }
    for (name, channel) in context.channels.iter().filter(|(_, c)| !is_time(c)) {
        let conversion = match checked_conversion(source, name, channel) {
            Ok(conversion) => conversion,
            Err(refusal) if is_in_files(source, name) && !is_dispensable(&channel.signal) => {
                return Err(refusal);
            }
            Err(refusal) => {
                left_out.push(UnreadChannel {
                    signal: &channel.signal,
                    refusal,
                    is_absent: is_lacking(source, name, channel),
                });
                continue;
            }
        };
        let plan = ChannelPlan {
            name,
            channel,
            conversion,
        };
        if plans.insert(&channel.signal, plan).is_some() {
            return Err(duplicate_signal(name, channel));
        }
    }
    let stand_ins = match context.stand_ins(|signal| plans.contains_key(signal)) {
        Ok(stand_ins) => stand_ins,
        Err(signals) => return Err(Refusal::of_signals(&signals, left_out)),
    };
    let problems = left_out
        .into_iter()
        .map(|one| one.into_problem(&stand_ins, flight_id))
        .collect();
    Ok((plans.into_values().collect(), problems))
}

/// Checks that the units that files state for the columns of a channel are those of the channel
/// map.
fn stated_units(
    source: &(impl ColumnSource + ?Sized),
    name: &str,
    channel: &Channel,
) -> Result<(), Refusal> {
    let Some(formula) = &channel.formula else {
        return stated_unit(source, name, &channel.unit);
    };
    let mut operands = formula.operands().iter();
    operands.try_for_each(|operand| stated_unit(source, &operand.column, &operand.unit))
}

fn stated_unit(
    source: &(impl ColumnSource + ?Sized),
    name: &str,
    mapped: &str,
) -> Result<(), Refusal> {
    let stated = (0..source.files()).filter_map(|file| source.unit(file, name));
    let differs = |unit: &&str| !unit.is_empty() && !same_unit(unit, mapped);
    match stated.map(str::trim).find(differs) {
        None => Ok(()),
        Some(stated) => {
            let reason = format!(
                "the file states `{stated}` for channel `{name}`, the channel map `{mapped}`: correct \
                 the channel map, or the file"
            );
            Err(Refusal::of_channel(name, reason))
        }
    }
}

/// `true` if a stated unit does not contradict the channel map. A unit that harvest does not have says nothing,
/// and a load factor is a pure number.
fn same_unit(stated: &str, mapped: &str) -> bool {
    if Unit::is_unknown(stated) {
        return true;
    }
    match (Unit::parse(stated), Unit::parse(mapped)) {
        (Ok(a), Ok(b)) if a.is_load_factor_of(b) => true,
        // A pound becomes a pound-force, not the reverse.
        (Ok(a), Ok(b)) => a
            .factor_to(b)
            .or(b.factor_to(a))
            .is_some_and(|f| (f - 1.0).abs() < SAME_FACTOR),
        _ => stated == mapped,
    }
}

fn is_in_files(source: &(impl ColumnSource + ?Sized), name: &str) -> bool {
    (0..source.files()).any(|file| source.has(file, name))
}

/// `true` for a channel whose column, or a column of whose formula, no file has.
fn is_lacking(source: &(impl ColumnSource + ?Sized), name: &str, channel: &Channel) -> bool {
    let has = |column: &str| {
        let mut files = 0..source.files();
        files.any(|file| source.has(file, column) || source.unreadable(file, column).is_some())
    };
    match &channel.formula {
        None => !has(name),
        Some(formula) => formula.operands().iter().any(|o| !has(&o.column)),
    }
}

/// Refusal of a channel that is in no file. For a formula it names the columns that no file has.
fn not_in_files(source: &(impl ColumnSource + ?Sized), name: &str, channel: &Channel) -> Refusal {
    let signal = &channel.signal;
    let mut unreadable = (0..source.files()).filter_map(|file| source.unreadable(file, name));
    if let Some(reason) = unreadable.next() {
        return Refusal::of_channel(name, reason.to_owned());
    }
    let reason = match &channel.formula {
        None => format!("channel `{name}` (signal `{signal}`) is not in the file"),
        Some(formula) => {
            let columns = formula.operands().iter().map(|operand| &operand.column);
            let lacking = columns.filter(|column| !is_in_files(source, column));
            let lacking: Vec<String> = lacking.map(|column| format!("`{column}`")).collect();
            if lacking.is_empty() {
                format!(
                    "the columns of channel `{name}` (signal `{signal}`) are in different files; a \
                     formula takes the values of one row"
                )
            } else {
                format!(
                    "channel `{name}` (signal `{signal}`) is computed from {}, not in the file",
                    lacking.join(", ")
                )
            }
        }
    };
    Refusal::of_channel(name, reason)
}

/// Conversion of a channel's unit into its signal's, if the units that the files state are those of the
/// channel map.
fn checked_conversion(
    source: &(impl ColumnSource + ?Sized),
    name: &str,
    channel: &Channel,
) -> Result<Conversion, Refusal> {
    stated_units(source, name, channel)?;
    unit_conversion(source, name, channel)
}

/// Conversion of a channel's unit into its signal's.
fn unit_conversion(
    source: &(impl ColumnSource + ?Sized),
    name: &str,
    channel: &Channel,
) -> Result<Conversion, Refusal> {
    if !is_in_files(source, name) {
        return Err(not_in_files(source, name, channel));
    }
    let target = Unit::of_signal(&channel.signal);
    let unit = Unit::parse(&channel.unit).ok();
    unit.and_then(|u| u.conversion_to(target)).ok_or_else(|| {
        let reason = format!(
            "signal `{}` is in {}, which `{}` does not convert to",
            channel.signal, target.name, channel.unit
        );
        Refusal::of_channel(name, reason)
    })
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
        assert!(!same_unit("kcas", "kt"));
        assert!(same_unit("furlong", "ft") && same_unit("-", "g") && !same_unit("g", "-"));
    }
}
