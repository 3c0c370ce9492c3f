//! Mean flight condition of a maneuver over its window, without missing samples.

use std::ops::RangeInclusive;

use crate::aircraft::{Aircraft, Position, VaneFlow};
use crate::flight::{Record, signal};
use crate::maneuver::{Class, Maneuver, ManeuverOrigin, Quality, Recognised};
use crate::numerics::statistics::mean::finite_mean;
use crate::numerics::vectors::simd::vectorised;
use crate::units::DEG;

use super::quality;
use super::settings::QualityLimits;

/// Signals of a flight condition.
pub(super) const SIGNALS: &[&str] = &[
    signal::ALPHA_VANE,
    signal::BETA_VANE,
    signal::VELOCITY,
    signal::MACH,
    signal::ALTITUDE,
    signal::P,
    signal::Q,
    signal::R,
    signal::QBAR,
    signal::MASS,
    signal::X_CG,
    signal::Y_CG,
    signal::Z_CG,
];

/// The maneuver of a class in a window (s on the record's clock), cut at the ends of the record,
/// with its quality. Without `recognised` it is one that the analyst gave.
///
/// # Errors
/// The reason why the flight condition cannot be computed, in words.
pub(super) fn maneuver(
    record: &Record,
    aircraft: &Aircraft,
    class: &Class,
    (start_s, end_s): (f64, f64),
    recognised: Option<Recognised>,
    limits: &QualityLimits,
) -> Result<Maneuver, String> {
    let (first, last) = (record.sample_at(start_s), record.sample_at(end_s));
    if last <= first {
        return Err(format!(
            "the window of a maneuver like {} holds no samples",
            class.name
        ));
    }
    let mean = |name: &str| mean_of_signal(record, name, first..=last);
    let start_s = record.time_s(first);
    let is_given = recognised.is_none();
    let mut maneuver = Maneuver {
        maneuver_id: format!("{}_t{:05}", record.flight_id, start_s.floor()),
        flight_id: record.flight_id.clone(),
        class: class.name.clone(),
        axis: class.axis,
        start_s,
        end_s: record.time_s(last),
        alpha_deg: mean_alpha_deg(record, aircraft, first..=last)
            .ok_or("no sample has the signals that α takes")?,
        mach: mean(signal::MACH)?,
        qbar_psf: mean(signal::QBAR)?,
        velocity_ft_s: mean(signal::VELOCITY)?,
        altitude_ft: mean(signal::ALTITUDE)?,
        mass_slug: mean(signal::MASS)?,
        x_cg_ft: mean(signal::X_CG)?,
        samples: last - first + 1,
        origin: if is_given {
            ManeuverOrigin::Given
        } else {
            ManeuverOrigin::Found
        },
        recognised: recognised.unwrap_or_default(),
        quality: Quality::default(),
    };
    maneuver.quality = quality::measure(record, class, &maneuver, limits, is_given);
    Ok(maneuver)
}

fn mean_of_signal(
    record: &Record,
    name: &str,
    window: RangeInclusive<usize>,
) -> Result<f64, String> {
    let values = record
        .values(name)
        .and_then(|v| v.get(window))
        .unwrap_or_default();
    finite_mean(values.iter().copied())
        .ok_or_else(|| format!("`{name}` has no sample in the maneuver"))
}

/// Mean angle of attack at the c.g., deg, from both vanes, the rates and the c.g.
fn mean_alpha_deg(
    record: &Record,
    aircraft: &Aircraft,
    window: RangeInclusive<usize>,
) -> Option<f64> {
    let of = |name: &str| record.values(name)?.get(window.clone());
    let (alpha, beta, velocity) = (
        of(signal::ALPHA_VANE)?,
        of(signal::BETA_VANE)?,
        of(signal::VELOCITY)?,
    );
    let [p, q, r] = [of(signal::P)?, of(signal::Q)?, of(signal::R)?];
    let [x, y, z] = [of(signal::X_CG)?, of(signal::Y_CG)?, of(signal::Z_CG)?];
    let mut at_cg = vec![0.0; alpha.len()];
    vectorised(
        #[inline(always)]
        || {
            for (k, alpha_at_cg) in at_cg.iter_mut().enumerate() {
                let at_vanes = VaneFlow {
                    alpha: alpha[k] / DEG,
                    beta: beta[k] / DEG,
                    velocity: velocity[k],
                    rates: [p[k] / DEG, q[k] / DEG, r[k] / DEG],
                };
                let cg = Position {
                    x_ft: x[k],
                    y_ft: y[k],
                    z_ft: z[k],
                };
                *alpha_at_cg = aircraft.sensors.flow_at_cg(&at_vanes, cg).alpha * DEG;
            }
        },
    );
    finite_mean(at_cg)
}
