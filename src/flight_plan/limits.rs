//! Limits of a card: extreme values of its rehearsed flight, and the first limit that is broken.

use crate::flight::{Record, signal};
use crate::lab::campaign::FlightLimits;
use crate::rigid_body::AirData;

/// Share by which a surface may exceed its rate: rounding of its positions.
const ROUNDING: f64 = 1e-6;

/// Lowest and highest value of each limited quantity over a card, and the speed at its start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extremes {
    pub alpha_deg: (f64, f64),
    pub an_g: (f64, f64),
    pub qbar_psf: (f64, f64),
    /// Mach number in trim.
    pub mach: f64,
    /// Calibrated airspeed in trim, kt.
    pub calibrated_kt: f64,
}

impl Extremes {
    /// Extremes of a record.
    #[must_use]
    pub fn of(record: &Record) -> Extremes {
        let range = |name: &str| {
            let values = record.values(name).unwrap_or_default().iter().copied();
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            })
        };
        let first = |name: &str| {
            let values = record.values(name).unwrap_or_default();
            values.first().copied().unwrap_or(f64::NAN)
        };
        let mach = first(signal::MACH);
        Extremes {
            alpha_deg: range(signal::ALPHA_VANE),
            an_g: range(signal::AN),
            qbar_psf: range(signal::QBAR),
            mach,
            calibrated_kt: AirData::calibrated_kt(mach, first(signal::QBAR)),
        }
    }
}

/// First limit that a record breaks, in words; `None` if it keeps all limits.
#[must_use]
pub fn broken(limits: &FlightLimits, record: &Record, extremes: &Extremes) -> Option<String> {
    let ranges = [
        ("alpha", limits.alpha_deg, extremes.alpha_deg, "deg"),
        ("normal acceleration", limits.an_g, extremes.an_g, "g"),
        (
            "dynamic pressure",
            limits.qbar_psf,
            extremes.qbar_psf,
            "psf",
        ),
    ];
    let beyond = ranges.iter().find_map(|(what, limit, range, unit)| {
        let (lowest, highest) = (*limit)?;
        if !(range.0.is_finite() && range.1.is_finite()) {
            return Some(format!(
                "{what} has a limit, but the rehearsal records none"
            ));
        }
        let (value, limit) = if range.1 > highest {
            (range.1, highest)
        } else if range.0 < lowest {
            (range.0, lowest)
        } else {
            return None;
        };
        Some(format!(
            "{what} reaches {value:.1} {unit}; the limit is {limit} {unit}"
        ))
    });
    beyond.or_else(|| {
        limits.surface_rates_deg_s.iter().find_map(|(name, limit)| {
            let Some(rate) = highest_rate(record, name) else {
                let what =
                    format!("`{name}` has a limit of its rate, but the rehearsal records none");
                return Some(what);
            };
            (rate > limit * (1.0 + ROUNDING))
                .then(|| format!("`{name}` moves at {rate:.0} deg/s; the limit is {limit} deg/s"))
        })
    })
}

/// Highest rate of a signal between two samples.
fn highest_rate(record: &Record, name: &str) -> Option<f64> {
    let values = record.values(name)?;
    let rates = values
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs() / record.step_s);
    rates.reduce(f64::max)
}
