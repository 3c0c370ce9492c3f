//! Airspeed of recordings that have the Mach number in its place: Mach times the speed of sound at the altitude. With it
//! the equations of motion hold for the other columns; it is no column of the recorder.

use super::findings::Inspection;
use super::names::vocabulary::meanings;
use super::names::words::Spelling;
use super::recording::{Column, Recording, column_names};
use crate::earth::air;
use crate::flight::signal;
use crate::units::Unit;

/// Name of the computed column: a usual one of an airspeed.
const NAME: &str = "true airspeed";

/// Altitude above which numbers without a unit are feet.
const HIGHEST_M: f64 = 15_000.0;

/// Recordings with the airspeed of their Mach number and altitude; `None` where they have an airspeed, or lack one of
/// both.
pub fn with_airspeed(recordings: &[Recording]) -> Option<Vec<Recording>> {
    let names = column_names(recordings);
    let named = |signal: &str| {
        let means = |name: &&&str| {
            let meanings = meanings(&Spelling::of(name));
            meanings.iter().any(|(meant, _)| *meant == signal)
        };
        names.iter().find(means).copied()
    };
    if named(signal::VELOCITY).is_some() {
        return None;
    }
    let (mach, altitude) = (named(signal::MACH)?, named(signal::ALTITUDE)?);
    let columns = || recordings.iter().filter_map(|r| r.column(altitude));
    let stated = columns().find_map(|c| Unit::parse(c.stated.as_deref()?).ok());
    let highest = columns()
        .flat_map(|c| &c.values)
        .copied()
        .fold(0.0, f64::max);
    let usual = if highest > HIGHEST_M { "ft" } else { "m" };
    let unit = stated
        .or(Spelling::of(altitude).unit)
        .or(Unit::parse(usual).ok())?;
    let to_ft = unit.factor_to(Unit::of_signal(signal::ALTITUDE))?;
    let extended = recordings.iter().map(|recording| {
        let mut extended = recording.clone();
        if let Some((mach, altitude)) = recording.column(mach).zip(recording.column(altitude)) {
            let both = mach.values.iter().zip(&altitude.values);
            extended.columns.push(Column {
                name: NAME.to_owned(),
                stated: Some("ft/s".to_owned()),
                values: both
                    .map(|(mach, h)| mach * air(h * to_ft).sound_ft_s)
                    .collect(),
            });
        }
        extended
    });
    Some(extended.collect())
}

/// Findings without the computed column. The Mach number and the altitude are as sure as the airspeed: the equation
/// between the three is its definition.
pub fn without_airspeed(mut inspection: Inspection) -> Inspection {
    let own = inspection.channels.iter().position(|c| c.column == NAME);
    let airspeed = own.map(|at| inspection.channels.remove(at));
    for channel in &mut inspection.channels {
        if let Some(airspeed) = airspeed.as_ref().filter(|_| channel.signal == signal::MACH) {
            channel.is_sure = airspeed.is_sure;
            channel.evidence = format!("the airspeed of it: {}", airspeed.evidence);
        }
    }
    inspection.unused.retain(|column| column.column != NAME);
    inspection.grid.columns.remove(NAME);
    inspection
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inspection::inspect;
    use crate::inspection::quantity::Quantity;
    use crate::inspection::test_flight::TestFlight;

    #[test]
    fn a_mach_number_stands_for_the_airspeed_in_the_equations() {
        let recording = TestFlight::default().recording(&[
            ("Mach", Quantity::Mach, "-"),
            ("Alt [ft]", Quantity::Altitude, "ft"),
            ("alpha", Quantity::Alpha, "deg"),
            ("theta", Quantity::Theta, "deg"),
            ("phi", Quantity::Phi, "deg"),
            ("p", Quantity::P, "deg/s"),
            ("q", Quantity::Q, "deg/s"),
            ("r", Quantity::R, "deg/s"),
            ("nz", Quantity::An, "g"),
            ("nx", Quantity::Ax, "g"),
        ]);
        let found = inspect(&[recording]).expect("a clock");
        assert!(found.channels.iter().all(|c| c.column != NAME));
        let is_sure = |signal: &str| {
            let own = found.channels.iter().find(|c| c.signal == signal);
            own.is_some_and(|channel| channel.is_sure)
        };
        for signal in [signal::MACH, signal::ALPHA_VANE, signal::AN, signal::Q] {
            assert!(is_sure(signal), "{signal}");
        }
    }
}
