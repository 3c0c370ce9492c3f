//! The quality of a maneuver before it is estimated: trimmed at the start, α held, one axis alone,
//! above the noise, surfaces free of their stops, samples as recorded. What is beyond a limit is
//! rejected with the reason.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use crate::aero::Axis;
use crate::flight::{Record, signal};
use crate::maneuver::{Acceptance, Class, Maneuver, Quality};
use crate::numerics::order_statistics::upper_median_in_place;
use crate::settings::{elements, settings};

settings! {
    /// Stops and rate of a surface's actuator.
    pub struct Actuator {
        /// Lower stop, deg.
        pub lower_deg: f64,
        /// Upper stop, deg.
        pub upper_deg: f64,
        /// Highest rate, deg/s.
        pub rate_deg_s: f64,
    }
}
elements!(BTreeMap<String, Actuator>: Actuator as "<surface>");

settings! {
    /// Limits beyond which a maneuver is not estimated.
    pub struct Limits {
        /// Largest motion in the lead-in over motion in the maneuver. Larger: maneuvers with
        /// residual motion before their inputs pass, whose initial state dominates the derivatives.
        pub lead_in_motion: f64 = 0.5,
        /// Largest root mean square of alpha about its mean, deg. The default is the spacing of the
        /// trends. Larger: maneuvers pass during which the derivatives are not constant.
        pub alpha_rms_deg: f64 = 5.0,
        /// Largest motion of the other axis over motion of the own axis. Larger: maneuvers pass that
        /// the other axis's measured signals, with their errors, move.
        pub other_axis: f64 = 1.0,
        /// Smallest signal-to-noise ratio. Smaller: maneuvers pass whose response noise hides.
        pub signal_to_noise: f64 = 5.0,
        /// Largest share of the inputs' time that a surface is at a stop, where it excites nothing.
        pub saturated_share: f64 = 0.5,
        /// Largest share of the inputs' time that a surface moves at its actuator's rate, where it
        /// follows no command. Its measured motion enters the equations, so less does no harm.
        pub rate_limited_share: f64 = 0.8,
        /// Largest share of flagged samples: bridged, despiked, missing or stuck. Segment applies it
        /// to all signals of a maneuver, estimate to the outputs together and to each surface.
        /// Larger: more maneuvers are estimated from repaired samples.
        pub marked_share: f64 = 0.2,
        /// Stops and rate of each surface's actuator, by signal. A surface without an entry is never
        /// saturated or rate-limited.
        pub actuators: BTreeMap<String, Actuator> = BTreeMap::new(),
    }
}

/// The quality of a maneuver. What the analyst gave is measured, and accepted whatever the limits
/// say: he has seen it.
pub(super) fn of(
    record: &Record,
    class: &Class,
    maneuver: &Maneuver,
    limits: &Limits,
    given: bool,
) -> Quality {
    let whole = record.sample_at(maneuver.start_s)..=record.sample_at(maneuver.end_s);
    let first_s = maneuver
        .recognised
        .first_input_s
        .unwrap_or(maneuver.start_s + class.recognition.lead_in_s);
    let last_s = maneuver
        .recognised
        .last_input_s
        .unwrap_or(maneuver.end_s - class.recognition.decay_s);
    // The detector places a step within a few samples; the input itself is no part of the lead-in.
    let lead_in = *whole.start()..=record.sample_at(first_s - 0.1);
    let excited = record.sample_at(first_s)..=record.sample_at(last_s);
    let (own, other) = rates(class.axis);
    let motion =
        |signals: &[&str], part: &RangeInclusive<usize>, fit| motion(record, signals, part, fit);
    let moved = motion(own, &whole, Fit::Line);
    let measured = Quality {
        lead_in_motion: ratio(motion(own, &lead_in, Fit::Mean), moved),
        alpha_rms_deg: motion(&[signal::ALPHA_VANE], &whole, Fit::Mean),
        other_axis: ratio(motion(other, &whole, Fit::Line), moved),
        signal_to_noise: signal_to_noise(record, own, &whole),
        saturated_share: worst(record, limits, &excited, at_a_stop),
        rate_limited_share: worst(record, limits, &excited, at_full_rate),
        marked_share: marked(record, class, maneuver),
        ..Quality::default()
    };
    let reason = beyond(&measured, limits).join("; ");
    let verdict = if reason.is_empty() || given {
        Acceptance::Accepted
    } else {
        Acceptance::Rejected
    };
    Quality {
        verdict,
        reason,
        ..measured
    }
}

/// The angular rates of an axis, and of the other.
fn rates(axis: Axis) -> (&'static [&'static str], &'static [&'static str]) {
    let (pitch, roll_and_yaw) = (&[signal::Q][..], &[signal::P, signal::R][..]);
    match axis {
        Axis::Longitudinal => (pitch, roll_and_yaw),
        Axis::Lateral => (roll_and_yaw, pitch),
    }
}

/// What is beyond its limit, in words.
fn beyond(q: &Quality, limits: &Limits) -> Vec<String> {
    let mut reasons = Vec::new();
    let mut more = |value: Option<f64>, limit: f64, words: &dyn Fn(f64) -> String| {
        reasons.extend(
            value
                .filter(|v| *v > limit)
                .map(|v| format!("{} (limit {limit})", words(v))),
        );
    };
    more(q.lead_in_motion, limits.lead_in_motion, &|v| {
        format!(
            "not trimmed at the start: it moves {v:.2} times as much before the first input as in the maneuver"
        )
    });
    more(q.alpha_rms_deg, limits.alpha_rms_deg, &|v| {
        format!("α strays by {v:.1} deg root mean square")
    });
    more(q.other_axis, limits.other_axis, &|v| {
        format!("the other axis moves {v:.2} times as much as its own")
    });
    more(q.saturated_share, limits.saturated_share, &|v| {
        format!(
            "a surface rests at its stop for {:.0}% of the inputs",
            100.0 * v
        )
    });
    more(q.rate_limited_share, limits.rate_limited_share, &|v| {
        format!(
            "a surface moves at its actuator's full rate for {:.0}% of the inputs",
            100.0 * v
        )
    });
    more(q.marked_share, limits.marked_share, &|v| {
        format!("{:.0}% of its samples are marked", 100.0 * v)
    });
    if let Some(v) = q.signal_to_noise.filter(|v| *v < limits.signal_to_noise) {
        reasons.push(format!(
            "the response is {v:.1} times its noise (limit {})",
            limits.signal_to_noise
        ));
    }
    reasons
}

#[derive(Clone, Copy)]
enum Fit {
    Mean,
    /// A slow turn or a drift is no motion.
    Line,
}

fn ratio(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.zip(b).filter(|(_, b)| *b > 0.0).map(|(a, b)| a / b)
}

/// Root of the sum of the mean squares of signals about their mean or a straight line.
fn motion(
    record: &Record,
    signals: &[&str],
    part: &RangeInclusive<usize>,
    fit: Fit,
) -> Option<f64> {
    let squares: Option<Vec<f64>> = signals
        .iter()
        .map(|s| mean_square(record.values(s)?.get(part.clone())?, fit))
        .collect();
    squares.map(|s| s.iter().sum::<f64>().sqrt())
}

fn mean_square(values: &[f64], fit: Fit) -> Option<f64> {
    let known: Vec<(f64, f64)> = values
        .iter()
        .enumerate()
        .filter(|(_, v)| v.is_finite())
        .map(|(k, v)| (k as f64, *v))
        .collect();
    let n = known.len() as f64;
    if n < 3.0 {
        return None;
    }
    let (time, mean) = (
        known.iter().map(|k| k.0).sum::<f64>() / n,
        known.iter().map(|k| k.1).sum::<f64>() / n,
    );
    let slope = match fit {
        Fit::Mean => 0.0,
        Fit::Line => {
            let (xy, xx) = known.iter().fold((0.0, 0.0), |(xy, xx), (t, v)| {
                (xy + (t - time) * (v - mean), xx + (t - time) * (t - time))
            });
            xy / xx
        }
    };
    let residual = |(t, v): &(f64, f64)| v - mean - slope * (t - time);
    Some(known.iter().map(|k| residual(k).powi(2)).sum::<f64>() / n)
}

/// The rate with the most signal over noise. Noise is what does not continue from sample to sample:
/// the median of second differences, of which motion at the aircraft's frequencies makes nothing.
fn signal_to_noise(record: &Record, signals: &[&str], part: &RangeInclusive<usize>) -> Option<f64> {
    let of = |name: &&str| -> Option<f64> {
        let values = record.values(name)?.get(part.clone())?;
        let second = |w: &[f64]| (w[0] - 2.0 * w[1] + w[2]).abs();
        let mut differences: Vec<f64> = values
            .windows(3)
            .map(second)
            .filter(|d| d.is_finite())
            .collect();
        if differences.len() < 2 {
            return None;
        }
        // Second differences of white noise have six times its variance.
        let noise = 1.4826 * upper_median_in_place(&mut differences)? / 6.0_f64.sqrt();
        ratio(Some(mean_square(values, Fit::Line)?.sqrt()), Some(noise))
    };
    signals.iter().filter_map(of).max_by(f64::total_cmp)
}

/// The largest share of samples of a surface for which something holds.
fn worst(
    record: &Record,
    limits: &Limits,
    part: &RangeInclusive<usize>,
    holds: fn(&Actuator, &[f64], f64) -> bool,
) -> Option<f64> {
    let of = |(name, actuator): (&String, &Actuator)| -> Option<f64> {
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
        .filter_map(of)
        .max_by(f64::total_cmp)
}

/// Within a hundredth of its travel of a stop.
fn at_a_stop(actuator: &Actuator, values: &[f64], _step_s: f64) -> bool {
    let near = 0.01 * (actuator.upper_deg - actuator.lower_deg);
    values
        .iter()
        .all(|v| *v <= actuator.lower_deg + near || *v >= actuator.upper_deg - near)
}

/// At nine tenths of its rate or more.
fn at_full_rate(actuator: &Actuator, values: &[f64], step_s: f64) -> bool {
    values
        .windows(2)
        .all(|w| (w[1] - w[0]).abs() >= 0.9 * actuator.rate_deg_s * step_s)
}

/// Share of samples with which something went wrong, among those of the axis's outputs and the
/// class's inputs that are recorded.
fn marked(record: &Record, class: &Class, maneuver: &Maneuver) -> Option<f64> {
    let outputs = class.axis.outputs();
    let names = outputs
        .iter()
        .map(|o| o.signal())
        .chain(class.recognition.inputs());
    let recorded: Vec<&str> = names
        .filter(|name| record.signals.contains_key(*name))
        .collect();
    (!recorded.is_empty()).then(|| record.marked_share(recorded, maneuver.start_s, maneuver.end_s))
}
