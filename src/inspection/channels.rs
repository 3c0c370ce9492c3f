//! Channels that names and units propose, with their certainty and evidence.

use super::clock::ClockColumn;
use super::controls::inputs::InputColumn;
use super::findings::{Channel, Role};
use super::search::plausible::ColumnFacts;
use crate::flight::signal;
use crate::units::Unit;

/// Channel of a column, without further findings.
pub fn plain_channel(facts: &ColumnFacts, signal: String, role: Role) -> Channel {
    let unit = facts.unit.unwrap_or_else(|| Unit::of_signal(&signal));
    Channel {
        column: facts.name.clone(),
        signal,
        unit: unit.name.to_owned(),
        sign: 1.0,
        wraps_at: None,
        role,
        is_sure: false,
        evidence: String::new(),
        range: facts.range.unwrap_or_default(),
        moves: true,
        step: None,
        mirror_images: None,
    }
}

/// Channel of the time.
pub fn time_channel(clock: &ClockColumn, facts: &[ColumnFacts]) -> Channel {
    let own = facts.iter().find(|c| c.name == clock.name);
    Channel {
        column: clock.name.clone(),
        signal: signal::TIME.to_owned(),
        unit: clock.unit.name.to_owned(),
        sign: 1.0,
        wraps_at: None,
        role: Role::Time,
        is_sure: clock.is_sure,
        evidence: clock.evidence.clone(),
        range: own.and_then(|c| c.range).unwrap_or_default(),
        moves: true,
        step: None,
        mirror_images: None,
    }
}

/// Channel of a signal that name and unit alone give.
pub fn constant_channel(facts: &ColumnFacts, name: &str) -> Channel {
    let (low, _) = facts.range.unwrap_or_default();
    let is_stated = facts.unit.is_some();
    let has_one_sign = signal::POSITIVE.contains(&name)
        || [signal::THRUST, signal::RPM_LEFT, signal::RPM_RIGHT].contains(&name);
    let (is_sure, evidence) = match (is_stated, has_one_sign) {
        (true, true) if low >= 0.0 => (true, "its name and its stated unit"),
        (true, true) => (false, "it is negative at times"),
        (true, false) => (
            false,
            "its name and its stated unit; no motion determines its sign",
        ),
        (false, true) => (false, "its name; its unit is not stated"),
        (false, false) => (
            false,
            "its name; its unit is not stated, and no motion determines its sign",
        ),
    };
    let (is_sure, evidence) = unless_unknown_unit(facts, is_sure, evidence.to_owned());
    Channel {
        is_sure,
        evidence,
        ..plain_channel(facts, name.to_owned(), Role::Constant)
    }
}

/// A channel, marked as unsure if the name of another column means the signal as well.
pub fn unless_shared(channel: Channel, rival: Option<&ColumnFacts>) -> Channel {
    match rival {
        Some(rival) => Channel {
            is_sure: false,
            evidence: format!(
                "{}; but `{}` may be {} as well",
                channel.evidence, rival.name, channel.signal
            ),
            ..channel
        },
        None => channel,
    }
}

/// Temperatures of the air from the ground to the stratosphere, K.
const AIR_KELVIN: std::ops::Range<f64> = 180.0..335.0;

/// Channel of the temperature of the air; `None` for values that no air has. Without a stated unit it is
/// the unit that fits.
pub fn temperature_channel(facts: &ColumnFacts) -> Option<Channel> {
    let (low, high) = facts.range?;
    let kelvin = Unit::of_signal(signal::AIR_TEMPERATURE);
    let is_of_air = |unit: &Unit| {
        let conversion = unit.conversion_to(kelvin);
        conversion.is_some_and(|to| [low, high].iter().all(|v| AIR_KELVIN.contains(&to.of(*v))))
    };
    let usual = ["K", "degC"]
        .into_iter()
        .filter_map(|name| Unit::parse(name).ok());
    let unit = facts
        .unit
        .into_iter()
        .chain(usual.filter(|_| facts.unit.is_none()))
        .find(is_of_air)?;
    let is_static = facts.spelling.joined() == "sat" || facts.spelling.joined().contains("static");
    let (is_sure, evidence) = match (facts.unit.is_some(), is_static) {
        (true, true) => (true, "its name and its stated unit"),
        (true, false) => (
            false,
            "its name and its stated unit; a probe may read the total temperature",
        ),
        (false, _) => (false, "its name; its unit follows from its range alone"),
    };
    let (is_sure, evidence) = unless_unknown_unit(facts, is_sure, evidence.to_owned());
    Some(Channel {
        unit: unit.name.to_owned(),
        is_sure,
        evidence,
        ..plain_channel(facts, signal::AIR_TEMPERATURE.to_owned(), Role::Constant)
    })
}

/// A verdict, marked as unsure if the file states a unit that harvest does not have.
pub fn unless_unknown_unit(facts: &ColumnFacts, is_sure: bool, evidence: String) -> (bool, String) {
    match &facts.unknown_unit {
        Some(unit) => (
            false,
            format!("{evidence}; but harvest does not have the unit `{unit}` that the file states"),
        ),
        None => (is_sure, evidence),
    }
}

/// Range above which an angle is in degrees: no surface turns by as many radians.
const LARGEST_RAD: f64 = 1.6;

/// Unit of an input, and `true` if the file or the name states it clearly. The unit of other angles follows from their
/// range: in that of radians, it is the one (`usual`) that the recorder's other angles have. Controls are numbers.
pub fn input_unit(facts: &ColumnFacts, input: &InputColumn, usual: Option<Unit>) -> (Unit, bool) {
    let number = Unit::of_signal("");
    if let Some(unit) = facts.unit {
        return (unit, !facts.has_ambiguous_unit);
    }
    let (low, high) = facts.range.unwrap_or_default();
    let degrees = Unit::of_signal("_deg");
    let radians = degrees
        .alike()
        .find(|unit| unit.is_radian())
        .unwrap_or(degrees);
    match (
        input.kind.is_surface(),
        low.abs().max(high.abs()) > LARGEST_RAD,
    ) {
        (false, _) => (number, false),
        (true, true) => (degrees, false),
        (true, false) => (usual.unwrap_or(radians), false),
    }
}

/// Suffix of the names of signals in the quantity of a unit.
pub fn suffix(unit: Unit) -> &'static str {
    if unit.is_inch() {
        return unit.suffix.unwrap_or_default();
    }
    unit.alike()
        .find_map(|other| other.suffix)
        .unwrap_or_default()
}

/// A number to two digits.
pub fn rounded(value: f64) -> f64 {
    let places = (1.0 - value.abs().log10().floor()).max(0.0);
    let scale = 10_f64.powf(places);
    (value * scale).round() / scale
}
