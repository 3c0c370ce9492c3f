//! Size of the gusts that filter error found in a maneuver.

use crate::aero::Axis;
use crate::estimate::task::Task;
use crate::filter_error::noise::Noise;
use crate::flight::signal;
use crate::numerics::statistics::mean::mean;
use crate::units::DEG;

/// Scale of turbulence at altitude, ft (MIL-F-8785C, Dryden). It relates the random walk of the
/// angle, which is the high-frequency part of a gust, to the gust's speed.
const GUST_SCALE_FT: f64 = 1750.0;

/// Speed of the gusts across the flight path, ft/s rms.
pub(in crate::estimate) fn gust_ft_s(task: &Task, noise: &Noise, step_s: f64) -> f64 {
    let maneuver = task.record.values(signal::VELOCITY).unwrap_or_default();
    let velocities = maneuver.get(task.range()).unwrap_or_default();
    let velocity = mean(velocities.iter().copied());
    let steps = GUST_SCALE_FT / (2.0 * velocity * step_s);
    velocity * noise.angle * steps.sqrt()
}

/// Rotary gust, deg/s rms: the larger one of the axis.
pub(in crate::estimate) fn rotary_gust_deg_s(axis: Axis, noise: &Noise) -> f64 {
    DEG * match axis {
        Axis::Longitudinal => noise.gusts[0],
        Axis::Lateral => noise.gusts[0].max(noise.gusts[1]),
    }
}
