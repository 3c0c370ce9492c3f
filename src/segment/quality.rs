//! Quality of a maneuver before it is estimated. A good maneuver starts trimmed, holds α, moves one
//! axis alone and exceeds the noise. Its surfaces are free of their stops, and its samples are as
//! recorded. A maneuver beyond a limit is rejected with the reason.

use std::ops::RangeInclusive;

use super::settings::{Actuator, QualityLimits};
use crate::aero::{Axis, Output};
use crate::flight::{Record, signal};
use crate::maneuver::{Acceptance, Class, Maneuver, Quality};
use crate::numerics::series::differences::white_noise;
use crate::numerics::series::sample_count::nearest;
use crate::units::RAD;

/// Time before the first input that is excluded from the lead-in, s. The detected time of a step is
/// within a few samples of the input's begin.
const CLEAR_OF_INPUT_S: f64 = 0.1;

/// Fraction of a surface's travel within which the surface counts as at its stop. It is larger than
/// the sensor's error there, and smaller than the margin that commands leave.
const AT_STOP: f64 = 0.01;

/// Fraction of an actuator's rate above which the actuator counts as at its full rate. The rest is
/// room for the noise of a difference between two samples.
const AT_FULL_RATE: f64 = 0.9;

/// Half the time over which a rate is differentiated, s. It is short compared with the aircraft's
/// motion, and long enough that gyro noise contributes little to the acceleration.
const HALF_SPAN_S: f64 = 0.1;

/// Least number of samples of a mean square about a line: two determine the line.
const FEWEST_SAMPLES: f64 = 3.0;

/// Measures the quality of a maneuver and judges it by the limits.
///
/// A maneuver that the analyst gave is always accepted, since it was inspected.
pub(super) fn measure(
    record: &Record,
    class: &Class,
    maneuver: &Maneuver,
    limits: &QualityLimits,
    is_given: bool,
) -> Quality {
    let whole = record.sample_at(maneuver.start_s)..=record.sample_at(maneuver.end_s);
    let (recognised, recognition) = (&maneuver.recognised, &class.recognition);
    let default_first_s = maneuver.start_s + recognition.lead_in_s;
    let default_last_s = maneuver.end_s - recognition.decay_s;
    let first_s = recognised.first_input_s.unwrap_or(default_first_s);
    let last_s = recognised.last_input_s.unwrap_or(default_last_s);
    let lead_in = *whole.start()..=record.sample_at(first_s - CLEAR_OF_INPUT_S);
    let excited = record.sample_at(first_s)..=record.sample_at(last_s);
    let own = rates(class.axis);
    let moved = root_mean_square(record, own, &whole, About::Line);
    let before = root_mean_square(record, own, &lead_in, About::Mean);
    let measured = Quality {
        lead_in_motion: ratio(before, moved),
        alpha_rms_deg: root_mean_square(record, &[signal::ALPHA_VANE], &whole, About::Mean),
        other_axis: coupling(record, class.axis, &whole),
        signal_to_noise: signal_to_noise(record, own, &whole),
        saturated_share: largest_share(record, limits, &excited, is_at_stop),
        rate_limited_share: largest_share(record, limits, &excited, is_at_full_rate),
        marked_share: marked_share(record, class, maneuver),
        ..Quality::default()
    };
    let not_recorded = states_not_recorded(record, class.axis);
    let is_accepted = is_given && not_recorded.is_none();
    let reasons: Vec<String> = not_recorded
        .into_iter()
        .chain(reasons(&measured, limits))
        .collect();
    Quality {
        verdict: if is_accepted || reasons.is_empty() {
            Acceptance::Accepted
        } else {
            Acceptance::Rejected
        },
        reason: reasons.join("; "),
        ..measured
    }
}

/// The reason for which the axis cannot be estimated: states that have stand-ins in the record.
fn states_not_recorded(record: &Record, axis: Axis) -> Option<String> {
    let states = axis.outputs().into_iter().filter(|o| o.is_state());
    let lacking: Vec<&str> = states
        .map(Output::signal)
        .filter(|signal| record.is_assumed(signal))
        .collect();
    (!lacking.is_empty()).then(|| format!("{} is not recorded", lacking.join(", ")))
}

/// The angular rates of an axis.
fn rates(axis: Axis) -> &'static [&'static str] {
    match axis {
        Axis::Longitudinal => &[signal::Q],
        Axis::Lateral => &[signal::P, signal::R],
    }
}

/// Ratio of the angular accelerations caused by the motion of the other axis to all those of the
/// axis; root mean squares about their means.
///
/// Euler's equations couple the axes by products of rates: q̇ by p r, ṗ by q r, ṙ by p q. The
/// moments of inertia weigh a product by at most 1 (triangle inequality), here taken as 1. Gusts
/// roll an aircraft without much yaw, so their products are small.
fn coupling(record: &Record, axis: Axis, part: &RangeInclusive<usize>) -> Option<f64> {
    let products: &[(&str, &str)] = match axis {
        Axis::Longitudinal => &[(signal::P, signal::R)],
        Axis::Lateral => &[(signal::Q, signal::R), (signal::P, signal::Q)],
    };
    let rate = |name: &str| record.values(name)?.get(part.clone());
    let coupled = products.iter().map(|(a, b)| {
        let pairs = rate(a)?.iter().zip(rate(b)?);
        let product: Vec<f64> = pairs.map(|(a, b)| RAD * a * b).collect();
        mean_square(&product, About::Mean)
    });
    let half = nearest(HALF_SPAN_S / record.step_s).max(1);
    let span_s = 2.0 * half as f64 * record.step_s;
    let accelerated = rates(axis).iter().map(|name| {
        let across = rate(name)?.windows(2 * half + 1);
        let slopes: Vec<f64> = across.map(|w| (w[2 * half] - w[0]) / span_s).collect();
        mean_square(&slopes, About::Mean)
    });
    let (coupled, all): (Option<f64>, Option<f64>) = (coupled.sum(), accelerated.sum());
    ratio(coupled.map(f64::sqrt), all.map(f64::sqrt))
}

/// A measure, its upper limit, and the function that returns the reason for a rejection.
type UpperLimit = (Option<f64>, f64, fn(f64) -> String);

/// The reason for each measure beyond its limit, in words.
fn reasons(q: &Quality, limits: &QualityLimits) -> Vec<String> {
    let upper: [UpperLimit; 6] = [
        (q.lead_in_motion, limits.lead_in_motion, |v| {
            format!(
                "not trimmed at the start: it moves {v:.2} times as much before the first input \
                 as in the maneuver"
            )
        }),
        (q.alpha_rms_deg, limits.alpha_rms_deg, |v| {
            format!("α strays by {v:.1} deg root mean square")
        }),
        (q.other_axis, limits.other_axis, |v| {
            format!("the motion of the other axis makes {v:.2} of its angular acceleration")
        }),
        (q.saturated_share, limits.saturated_share, |v| {
            let percent = 100.0 * v;
            format!("a surface rests at its stop for {percent:.0}% of the inputs")
        }),
        (q.rate_limited_share, limits.rate_limited_share, |v| {
            let percent = 100.0 * v;
            format!("a surface moves at its actuator's full rate for {percent:.0}% of the inputs")
        }),
        (q.marked_share, limits.marked_share, |v| {
            format!("{:.0}% of its samples are marked", 100.0 * v)
        }),
    ];
    let mut reasons: Vec<String> = upper
        .iter()
        .filter_map(|(value, limit, words)| {
            let value = value.filter(|v| v > limit)?;
            Some(format!("{} (limit {limit})", words(value)))
        })
        .collect();
    let limit = limits.signal_to_noise;
    if let Some(v) = q.signal_to_noise.filter(|v| *v < limit) {
        reasons.push(format!(
            "the response is {v:.1} times its noise (limit {limit})"
        ));
    }
    reasons
}

/// Reference of a mean square.
#[derive(Clone, Copy)]
enum About {
    Mean,
    /// A straight line: a slow turn or a drift is no motion.
    Line,
}

fn ratio(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.zip(b).filter(|(_, b)| *b > 0.0).map(|(a, b)| a / b)
}

/// Root of the sum of the mean squares of signals.
fn root_mean_square(
    record: &Record,
    signals: &[&str],
    part: &RangeInclusive<usize>,
    about: About,
) -> Option<f64> {
    let squares: Option<Vec<f64>> = signals
        .iter()
        .map(|s| mean_square(record.values(s)?.get(part.clone())?, about))
        .collect();
    squares.map(|s| s.iter().sum::<f64>().sqrt())
}

fn mean_square(values: &[f64], about: About) -> Option<f64> {
    let finite: Vec<(f64, f64)> = values
        .iter()
        .enumerate()
        .filter(|(_, v)| v.is_finite())
        .map(|(k, v)| (k as f64, *v))
        .collect();
    let n = finite.len() as f64;
    if n < FEWEST_SAMPLES {
        return None;
    }
    let (time, mean) = (
        finite.iter().map(|v| v.0).sum::<f64>() / n,
        finite.iter().map(|v| v.1).sum::<f64>() / n,
    );
    let slope = match about {
        About::Mean => 0.0,
        About::Line => {
            let (xy, xx) = finite.iter().fold((0.0, 0.0), |(xy, xx), (t, v)| {
                (xy + (t - time) * (v - mean), xx + (t - time) * (t - time))
            });
            xy / xx
        }
    };
    let residual = |(t, v): &(f64, f64)| v - mean - slope * (t - time);
    Some(finite.iter().map(|v| residual(v).powi(2)).sum::<f64>() / n)
}

/// The largest signal-to-noise ratio among some signals.
///
/// The noise follows from the median of second differences from sample to sample, to which motion
/// at the aircraft's frequencies contributes almost nothing.
fn signal_to_noise(record: &Record, signals: &[&str], part: &RangeInclusive<usize>) -> Option<f64> {
    let of_signal = |name: &&str| -> Option<f64> {
        let values = record.values(name)?.get(part.clone())?;
        let noise = white_noise(values)?;
        ratio(Some(mean_square(values, About::Line)?.sqrt()), Some(noise))
    };
    signals.iter().filter_map(of_signal).max_by(f64::total_cmp)
}

/// The largest share, over some surfaces, of samples that satisfy a condition.
fn largest_share(
    record: &Record,
    limits: &QualityLimits,
    part: &RangeInclusive<usize>,
    holds: fn(&Actuator, &[f64], f64) -> bool,
) -> Option<f64> {
    let of_surface = |(name, actuator): (&String, &Actuator)| -> Option<f64> {
        let values = record.values(name)?.get(part.clone())?;
        let pairs = values
            .windows(2)
            .filter(|w| w.iter().all(|v| v.is_finite()));
        let (n, met) = pairs.fold((0_usize, 0_usize), |(n, met), w| {
            (n + 1, met + usize::from(holds(actuator, w, record.step_s)))
        });
        (n > 0).then(|| met as f64 / n as f64)
    };
    limits
        .actuators
        .iter()
        .filter_map(of_surface)
        .max_by(f64::total_cmp)
}

fn is_at_stop(actuator: &Actuator, values: &[f64], _step_s: f64) -> bool {
    let near = AT_STOP * (actuator.upper_deg - actuator.lower_deg);
    values
        .iter()
        .all(|v| *v <= actuator.lower_deg + near || *v >= actuator.upper_deg - near)
}

fn is_at_full_rate(actuator: &Actuator, values: &[f64], step_s: f64) -> bool {
    values
        .windows(2)
        .all(|w| (w[1] - w[0]).abs() >= AT_FULL_RATE * actuator.rate_deg_s * step_s)
}

/// Share of flagged samples in the recorded signals among the axis's outputs and the class's
/// inputs.
fn marked_share(record: &Record, class: &Class, maneuver: &Maneuver) -> Option<f64> {
    let outputs = class.axis.outputs().map(Output::signal).into_iter();
    let names = outputs
        .filter(|signal| !record.is_assumed(signal))
        .chain(class.recognition.inputs());
    let recorded: Vec<&str> = names
        .filter(|name| record.signals.contains_key(*name))
        .collect();
    (!recorded.is_empty()).then(|| record.marked_share(recorded, maneuver.start_s, maneuver.end_s))
}
