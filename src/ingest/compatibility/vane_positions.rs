//! Positions of the flow vanes, where wrong ones explain faults of other instruments.
//!
//! A vane at the distance x ahead of its stated position reads α − q x/V in place of α, and β + r x/V. Delays of several
//! healthy instruments imitate that: the pitch rate, the pitch attitude, the accelerometers. Where a fit names faults, it
//! is repeated with other positions of the vanes. The best positions count if no fault of another instrument is left.

use super::error_estimates::estimate;
use super::joint_fit::{FittedErrors, fit};
use super::parameters::{INSTRUMENTS, Kind, SIGNALS};
use super::settings::Compatibility;
use super::window::Window;
use crate::aircraft::{Aircraft, Vane};
use crate::flight::signal as s;

/// Distances from the stated position that are tried first, ft: up to nearly that from the nose boom of a fighter to its
/// tail. The search costs seven fits of a flight.
const DISTANCES_FT: [f64; 4] = [-40.0, -15.0, 15.0, 40.0];

/// Distance of the trials about the best of them, ft.
const NEAR_FT: f64 = 8.0;

/// Least distance that is named, ft: at 300 ft/s it delays a reading by 10 ms, as an ordinary delay does.
const LEAST_FT: f64 = 3.0;

/// Least drop of the misfit by a position.
const LEAST_DROP: f64 = 10.0;

/// Distance of a vane ahead of its stated position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VanePosition {
    pub signal: &'static str,
    pub ahead_ft: f64,
}

/// A flow vane, and the instruments of its axis.
struct VaneOfAxis {
    signal: &'static str,
    of: fn(&mut Aircraft) -> &mut Vane,
    instruments: &'static [&'static str],
}

const VANES: [VaneOfAxis; 2] = [
    VaneOfAxis {
        signal: s::ALPHA_VANE,
        of: |aircraft| &mut aircraft.sensors.alpha_vane,
        instruments: &[
            s::Q,
            s::AX,
            s::AN,
            s::VELOCITY,
            s::THETA,
            s::ALTITUDE,
            s::QBAR,
            s::MACH,
        ],
    },
    VaneOfAxis {
        signal: s::BETA_VANE,
        of: |aircraft| &mut aircraft.sensors.beta_vane,
        instruments: &[s::P, s::R, s::AY, s::PHI, s::PSI],
    },
];

/// Errors with the positions of the vanes that explain the faults of other instruments; `None` without such faults, and
/// if no positions explain them.
pub fn explained(
    found: &FittedErrors,
    windows: &[Window],
    aircraft: &Aircraft,
    settings: &Compatibility,
) -> Option<(FittedErrors, Vec<VanePosition>)> {
    let mut best = Trial {
        aircraft: aircraft.clone(),
        errors: found.clone(),
    };
    let mut positions = Vec::new();
    for vane in VANES {
        if !vane.contradicts_others(&best.errors, settings) {
            continue;
        }
        let moved = |ahead_ft: f64| {
            let mut aircraft = best.aircraft.clone();
            (vane.of)(&mut aircraft).x_ft -= ahead_ft;
            let errors = fit(windows, &aircraft, settings)?;
            Some(Trial { aircraft, errors })
        };
        let Some((ahead_ft, trial)) = least_misfit(moved) else {
            continue;
        };
        if best.errors.misfit - trial.errors.misfit > LEAST_DROP && ahead_ft.abs() >= LEAST_FT {
            positions.push(VanePosition {
                signal: vane.signal,
                ahead_ft,
            });
            best = trial;
        }
    }
    let is_left = VANES
        .iter()
        .any(|vane| vane.contradicts_others(&best.errors, settings));
    (!positions.is_empty() && !is_left).then_some((best.errors, positions))
}

impl VaneOfAxis {
    /// `true` if an instrument of the axis has a fault that a position of the vane may explain: a delay, or a scale error
    /// of an accelerometer across the path.
    fn contradicts_others(&self, errors: &FittedErrors, settings: &Compatibility) -> bool {
        let is_fault = |i: usize, kind: Kind| {
            estimate(errors, i, kind, settings).is_some_and(|estimate| estimate.fault)
        };
        let is_own = |i: &usize| self.instruments.contains(&SIGNALS[*i]);
        (0..INSTRUMENTS).filter(is_own).any(|i| {
            let is_across = [s::AY, s::AN].contains(&SIGNALS[i]);
            is_fault(i, Kind::Delay) || is_across && is_fault(i, Kind::Scale)
        })
    }
}

/// Fit with a vane at another place.
struct Trial {
    aircraft: Aircraft,
    errors: FittedErrors,
}

/// Distance and trial of the least misfit: of those tried first, of two about the best, and of the vertex of the parabola
/// through these.
fn least_misfit(moved: impl Fn(f64) -> Option<Trial>) -> Option<(f64, Trial)> {
    let try_at = |ahead_ft: f64| Some((ahead_ft, moved(ahead_ft)?));
    let better = |a: (f64, Trial), b: (f64, Trial)| {
        if b.1.errors.misfit < a.1.errors.misfit {
            b
        } else {
            a
        }
    };
    let best = DISTANCES_FT.into_iter().filter_map(try_at).reduce(better)?;
    let (at, least) = (best.0, best.1.errors.misfit);
    let [aft, ahead] = [try_at(at - NEAR_FT)?, try_at(at + NEAR_FT)?];
    let [left, right] = [&aft, &ahead].map(|trial| trial.1.errors.misfit - least);
    let vertex = at + 0.5 * NEAR_FT * (left - right) / (left + right);
    let is_near = left + right > 0.0 && (vertex - at).abs() < 2.0 * NEAR_FT;
    let best = better(better(best, aft), ahead);
    match is_near.then(|| try_at(vertex)).flatten() {
        Some(trial) => Some(better(best, trial)),
        None => Some(best),
    }
}
