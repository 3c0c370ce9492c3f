//! Checks of `aircraft.yaml`: geometry, channel map, sizes of instrument errors.

use std::collections::BTreeMap;

use super::names::spelt_signal;
use super::numbers;
use crate::aircraft::ThrustLine;
use crate::config::checked::Config;
use crate::config::instruments::InstrumentErrors;
use crate::config::source::Source;
use crate::config::tunnel_tables::MISSPELT;
use crate::error::{Result, similarity};
use crate::flight::absence::remedies;
use crate::flight::{Channel, StandIn, signal};
use crate::ingest;
use crate::units::Unit;

/// Reference chord times span over wing area: one for a rectangle, 4/3 for a triangle. The margins leave room for other
/// reference chords; lengths in metres for feet make it a third.
const WING_SHAPES: std::ops::Range<f64> = 0.45..3.0;

/// Checks the numbers of the geometry.
pub(super) fn geometry(config: &Config, source: &Source) -> Result<()> {
    let a = &config.aircraft;
    let positive = [
        ("aircraft", "wing_area_ft2", a.wing_area_ft2),
        ("aircraft", "span_ft", a.span_ft),
        ("aircraft", "chord_ft", a.chord_ft),
        ("alpha_vane", "factor", a.sensors.alpha_vane.factor),
        ("beta_vane", "factor", a.sensors.beta_vane.factor),
    ];
    for (key, name, value) in positive {
        numbers::positive(source, key, name, value)?;
    }
    let (key, inertia) = ("engine_inertia_slug_ft2", a.engine_inertia_slug_ft2);
    numbers::not_negative(source, "aircraft", key, inertia)?;
    let share = a.chord_ft * a.span_ft / a.wing_area_ft2;
    if !WING_SHAPES.contains(&share) {
        let what = format!(
            "`chord_ft` times `span_ft` is {share:.3} of `wing_area_ft2`; wings have 1 to 1.5: is one of them in another unit?"
        );
        return Err(source.error_under("aircraft", "chord_ft", what));
    }
    if !(-90.0..=90.0).contains(&a.latitude_deg) {
        return Err(source.error("latitude_deg", "`latitude_deg` must lie between -90 and 90"));
    }
    a.thrust_line
        .map_or(Ok(()), |line| thrust_line(line, source))
}

fn thrust_line(line: ThrustLine, source: &Source) -> Result<()> {
    let inclination = line.inclination_deg;
    if !(-45.0..=45.0).contains(&inclination) {
        let what = format!("`inclination_deg` must lie between -45 and 45, not {inclination}");
        return Err(source.error_under("thrust_line", "inclination_deg", what));
    }
    Ok(())
}

/// Checks the channel map and the constants: units fit, each signal has one source, no required
/// signal is missing.
pub(super) fn channels(config: &Config, source: &Source) -> Result<()> {
    let mut signals: Vec<&str> = config.constants.keys().map(String::as_str).collect();
    for (column, channel) in &config.channels {
        if let Some(what) = mistake(column, channel) {
            return Err(source.error_under("channels", column, what));
        }
        if signals.contains(&channel.signal.as_str()) {
            let what = format!("signal `{}` has two sources", channel.signal);
            return Err(source.error_under("channels", column, what));
        }
        signals.push(&channel.signal);
    }
    for name in signal::POSITIVE {
        if let Some(value) = config.constants.get(*name) {
            numbers::positive(source, "constants", name, *value)?;
        }
    }
    for required in std::iter::once(&"time_s").chain(signal::REQUIRED) {
        let has = |name: &str| signals.contains(&name);
        let is_needed =
            StandIn::of(required, has).is_none() || misspelt(required, &signals).is_some();
        if !has(required) && is_needed {
            let near = misspelt(required, &signals);
            let near = near.map(|name| format!("; did you mean `{required}` by `{name}`?"));
            let what = format!(
                "no channel or constant gives the signal `{required}`{}",
                near.unwrap_or_else(|| format!(": {}", remedies(&[*required])))
            );
            return Err(source.error("channels", what));
        }
    }
    Ok(())
}

/// Hint for a signal whose name has no unit at its end; empty for other signals.
fn without_unit(unit: Unit, target: Unit, signal: &str) -> String {
    let mut units = std::iter::once(unit).chain(unit.alike());
    let suffix = units
        .find_map(|u| u.suffix)
        .filter(|_| target.suffix.is_none());
    suffix.map_or_else(String::new, |suffix| {
        format!(
            ": a signal's name ends with the unit that it is kept in, such as `{signal}{suffix}`"
        )
    })
}

/// The first mistake of a channel: its unit, its sign, its scale.
fn mistake(column: &str, channel: &Channel) -> Option<String> {
    let unit = match Unit::parse(&channel.unit) {
        Ok(unit) => unit,
        Err(what) => return Some(format!("channel `{column}`: {what}")),
    };
    let target = Unit::of_signal(&channel.signal);
    if unit.conversion_to(target).is_none() {
        let (name, kept, signal) = (unit.name, target.name, &channel.signal);
        let hint = without_unit(unit, target, signal);
        return Some(format!(
            "channel `{column}`: `{name}` cannot become {kept} of `{signal}`{hint}"
        ));
    }
    if ![1.0, -1.0].contains(&channel.sign) {
        let sign = channel.sign;
        return Some(format!("channel `{column}`: sign is 1 or -1, not {sign}"));
    }
    let is_scale = channel.scale.is_finite() && channel.scale > 0.0;
    (!is_scale)
        .then(|| format!("channel `{column}`: scale must be greater than zero; a sign is `sign`"))
}

/// Signal of the channel map that is probably this required one, misspelt. Signals that harvest has
/// are not.
fn misspelt<'a>(required: &str, signals: &[&'a str]) -> Option<&'a str> {
    let is_other = |name: &&str| !signal::is_own(name) && *name != signal::TIME;
    let others = signals.iter().copied().filter(is_other);
    let near = others.filter(|name| similarity(name, required) >= MISSPELT);
    near.max_by(|a, b| similarity(a, required).total_cmp(&similarity(b, required)))
}

/// Sizes of instrument errors: no misspelt signals, no negative sizes. A size may be that of an assumed
/// value, such as a thrust that is not recorded.
pub(super) fn instruments(
    errors: &BTreeMap<String, InstrumentErrors>,
    config: &Config,
    source: &Source,
) -> Result<()> {
    let mut examined = ingest::Settings::default().compatibility.ordinary;
    for (name, instrument) in errors {
        let error = |what: String| Err(source.error_under("instruments", name, what));
        spelt_signal(config, source, name, "instruments")?;
        let uncertainty = instrument.uncertainty;
        let (ordinary, fault) = (instrument.ordinary.given(), instrument.fault.given());
        let sizes = [uncertainty.bias, uncertainty.scale_pct].map(Some);
        let sizes = sizes.iter().chain(&ordinary).chain(&fault).flatten();
        if let Some(size) = sizes
            .copied()
            .find(|size| !(size.is_finite() && *size >= 0.0))
        {
            return error(format!(
                "`{name}`: sizes of errors are not negative, not {size}"
            ));
        }
        let has_sizes = ordinary.iter().chain(&fault).any(Option::is_some);
        if has_sizes && examined.of_signal(name).is_none() {
            return error(format!(
                "`{name}`: no kinematic equation has this signal, so `ordinary` and `fault` have no effect"
            ));
        }
    }
    Ok(())
}
