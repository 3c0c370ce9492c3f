//! Windows of a record: the parts of a flight in which its instruments move most, with the data that
//! the reconstruction needs.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::equations::{MeasuredTerms, State};
use super::parameters::{INPUTS, INSTRUMENTS, OUTPUTS, SIGNALS, lacks_input};
use super::settings::Compatibility;
use crate::aircraft::{Aircraft, Flow, Position};
use crate::earth::{air, gravity_ft_s2};
use crate::flight::{Mark, Record, signal as s};
use crate::output_error::surface_noise::white_variance;
use crate::units::{DEG, G0_FT_S2};

/// The earth's rotation, rad/s (WGS 84).
const EARTH_RATE: f64 = 7.292_115e-5;

/// The earth's mean radius, ft (6,371 km).
const EARTH_RADIUS_FT: f64 = 2.090_2e7;

/// Largest pitch attitude, deg: beyond it the Euler angles are close to their singularity.
const STEEPEST_DEG: f64 = 75.0;

/// Largest readings of the vanes, deg: beyond them the flow turns away from the vane's axis.
const LARGEST_ALPHA_DEG: f64 = 85.0;
const LARGEST_BETA_DEG: f64 = 60.0;

/// Least airspeed, ft/s: below it the vanes and the airspeed sensor do not respond.
const SLOWEST_FT_S: f64 = 50.0;

/// Change of an angle in one sample beyond which it has wrapped around, deg.
const TURN_DEG: f64 = 90.0;

/// Step of the integration from point to point, s: a twentieth of the period of motions at 1 Hz, faster
/// than which an aircraft hardly turns.
const POINT_STEP_S: f64 = 0.05;

/// Data of a window: samples of inputs with a margin on both sides, outputs, and measured terms.
#[derive(Clone, Debug)]
pub struct Window {
    pub step_s: f64,
    pub samples: usize,
    /// Samples from a point of the integration to the next.
    pub samples_per_point: usize,
    /// Additional samples of the inputs before the first and after the last.
    pub margin: usize,
    /// At every point.
    pub terms: Vec<MeasuredTerms>,
    /// Values of the inputs in the signals' units.
    pub inputs: [Vec<f64>; INPUTS],
    /// `true` for an input with an instrument; the others have stand-ins.
    pub is_recorded: [bool; INPUTS],
    /// Variance of the white noise of each input's sample, in the square of the signal's unit.
    pub input_variances: [f64; INPUTS],
    /// Values of the outputs in the signals' units; NaN where a sample does not count, and throughout
    /// for an output without instrument.
    pub outputs: [Vec<f64>; OUTPUTS],
    /// The state as measured at the first sample.
    pub start: State,
}

/// Chooses at most `most` windows of a record, in order of time. Each signal in turn proposes the
/// remaining window in which it moves most.
pub fn choose_windows(record: &Record, most: usize, settings: &Compatibility) -> Vec<Range<usize>> {
    let usable = usable_windows(record, settings);
    let activity: Vec<Vec<f64>> = SIGNALS
        .iter()
        .map(|name| activity(record, name, &usable))
        .collect();
    let mut chosen = vec![false; usable.len()];
    let mut count = 0;
    'rounds: loop {
        let before = count;
        for ranks in &activity {
            if count >= most {
                break 'rounds;
            }
            let left = (0..usable.len()).filter(|&i| !chosen[i] && ranks[i] > 0.0);
            if let Some(best) = left.max_by(|&a, &b| ranks[a].total_cmp(&ranks[b]).then(b.cmp(&a)))
            {
                chosen[best] = true;
                count += 1;
            }
        }
        if count == before {
            break;
        }
    }
    usable
        .into_iter()
        .zip(chosen)
        .filter(|(_, chosen)| *chosen)
        .map(|(range, _)| range)
        .collect()
}

fn samples(seconds: f64, step_s: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a positive number of samples"
    )]
    let samples = (seconds / step_s).round().max(0.0) as usize;
    samples
}

/// Samples by which a delay may reach out of a window, with those of the interpolation kernel.
pub fn margin(settings: &Compatibility, step_s: f64) -> usize {
    samples(settings.longest_delay_s, step_s) + 3
}

/// Factor by which the only window of a record may be shorter than the configured length.
const SHORTEST_ONLY: usize = 4;

/// Windows of the configured length, or at least half of it, over which the equations can be
/// integrated. A record that is too short has one window, its longest usable part.
fn usable_windows(record: &Record, settings: &Compatibility) -> Vec<Range<usize>> {
    let decimation = decimation(record.step_s);
    let length = samples(settings.window_s, record.step_s).max(2 * decimation);
    let margin = decimation * margin(settings, decimation as f64 * record.step_s);
    let mut found = Vec::new();
    for run in usable_runs(record) {
        let mut first = run.start + margin;
        while first + length / 2 + margin <= run.end {
            let end = (first + length).min(run.end - margin);
            found.push(first..end);
            first = end;
        }
    }
    if found.is_empty() {
        let runs = usable_runs(record).into_iter();
        let inner = runs.map(|run| run.start + margin..run.end.saturating_sub(margin));
        let longest = inner.max_by_key(ExactSizeIterator::len);
        found.extend(longest.filter(|run| run.len() >= length / SHORTEST_ONLY));
    }
    found
}

/// Runs of samples in which every input is finite and the attitude is away from the singularity.
fn usable_runs(record: &Record) -> Vec<Range<usize>> {
    let values = |name: &str| record.values(name).unwrap_or_default();
    let needed = SIGNALS[..INPUTS]
        .iter()
        .chain(&[s::PHI, s::X_CG, s::Y_CG, s::Z_CG, s::ALTITUDE]);
    let finite: Vec<&[f64]> = needed.map(|name| values(name)).collect();
    let (theta, alpha, beta) = (
        values(s::THETA),
        values(s::ALPHA_VANE),
        values(s::BETA_VANE),
    );
    let (velocity, phi, psi) = (values(s::VELOCITY), values(s::PHI), record.values(s::PSI));
    let at = |values: &[f64], k: usize| values.get(k).copied().unwrap_or(f64::NAN);
    let is_usable = |k: usize| {
        finite.iter().all(|values| at(values, k).is_finite())
            && at(theta, k).abs() < STEEPEST_DEG
            && at(alpha, k).abs() < LARGEST_ALPHA_DEG
            && at(beta, k).abs() < LARGEST_BETA_DEG
            && at(velocity, k) > SLOWEST_FT_S
            && psi.is_none_or(|psi| at(psi, k).is_finite())
    };
    let jumps =
        |values: &[f64], k: usize| k > 0 && (at(values, k) - at(values, k - 1)).abs() > TURN_DEG;
    let mut runs: Vec<Range<usize>> = Vec::new();
    for k in (0..record.samples).filter(|k| is_usable(*k)) {
        match runs.last_mut() {
            Some(run)
                if run.end == k && !jumps(phi, k) && !psi.is_some_and(|psi| jumps(psi, k)) =>
            {
                run.end = k + 1;
            }
            _ => runs.push(k..k + 1),
        }
    }
    runs
}

/// Activity of a signal in each window: the mean square of its change over a second.
fn activity(record: &Record, name: &str, windows: &[Range<usize>]) -> Vec<f64> {
    let reach = samples(1.0, record.step_s).max(1);
    let values = record.values(name).unwrap_or_default();
    let moved = |range: &Range<usize>| {
        let values = values.get(range.clone()).unwrap_or_default();
        let changes = values
            .iter()
            .zip(values.get(reach..).unwrap_or_default())
            .map(|(a, b)| (b - a).powi(2));
        let (sum, count) = changes
            .filter(|c| c.is_finite())
            .fold((0.0, 0_usize), |(s, n), c| (s + c, n + 1));
        sum / count.max(1) as f64
    };
    windows.iter().map(moved).collect()
}

impl Window {
    /// Window over a range of the record, at the step of the windows.
    pub fn of(
        record: &Record,
        range: Range<usize>,
        aircraft: &Aircraft,
        settings: &Compatibility,
    ) -> Window {
        let decimation = decimation(record.step_s);
        let step_s = decimation as f64 * record.step_s;
        let samples_per_point = samples(POINT_STEP_S, step_s).max(1);
        let (margin, samples) = (margin(settings, step_s), range.len() / decimation);
        let first = range.start.saturating_sub(margin * decimation);
        let wide = first..first + (samples + 2 * margin) * decimation;
        let range = range.start..range.start + samples * decimation;
        let input = |i: usize| {
            decimate(
                record
                    .values(SIGNALS[i])
                    .and_then(|v| v.get(wide.clone()))
                    .unwrap_or_default(),
                decimation,
            )
        };
        let output = |o: usize| {
            if lacks_input(o, |signal| record.is_recorded(signal)) {
                return vec![f64::NAN; samples];
            }
            decimate_measured(record, SIGNALS[INPUTS + o], &range, decimation)
        };
        let centres: Vec<usize> = range
            .clone()
            .step_by(decimation * samples_per_point)
            .map(|k| k + decimation / 2)
            .collect();
        let terms = measured_terms(record, &centres, aircraft);
        Window {
            step_s,
            samples,
            samples_per_point,
            margin,
            start: measured_state(
                record,
                centres.first().copied().unwrap_or(range.start),
                aircraft,
                terms.first(),
            ),
            terms,
            inputs: std::array::from_fn(input),
            is_recorded: std::array::from_fn(|i| record.is_recorded(SIGNALS[i])),
            input_variances: std::array::from_fn(|i| {
                white_level(record, SIGNALS[i], &range) / decimation as f64
            }),
            outputs: std::array::from_fn(output),
        }
    }

    /// Number of points of the integration. The first sample is one.
    pub fn points(&self) -> usize {
        self.samples.saturating_sub(1) / self.samples_per_point + 1
    }

    pub fn point_step_s(&self) -> f64 {
        self.samples_per_point as f64 * self.step_s
    }

    /// Number of nodes of the sensitivities: every second point.
    pub fn nodes(&self) -> usize {
        self.points().div_ceil(2)
    }

    pub fn samples_per_node(&self) -> usize {
        2 * self.samples_per_point
    }

    /// ω × v as measured at a sample, ft/s².
    pub fn turning(&self, k: usize) -> Vector3<f64> {
        let omega = Vector3::from_fn(|i, _| input_factor(i) * self.inputs[i][self.margin + k]);
        let [alpha, beta, speed] = [0, 1, 2].map(|o| self.outputs[o][k]);
        let ((sa, ca), (sb, cb)) = ((alpha / DEG).sin_cos(), (beta / DEG).sin_cos());
        omega.cross(&(Vector3::new(ca * cb, sb, sa * cb) * speed))
    }
}

/// Samples of the record that are averaged into one sample of a window, alike for all channels: at least
/// 25 a second remain, which resolve the motion of an aircraft.
fn decimation(step_s: f64) -> usize {
    const SLOWEST_STEP_S: f64 = 0.04;
    // The step is measured: at 50 and at 100 Hz the ratio is a whole number but for the clock's error.
    const CLOCK_ERROR: f64 = 0.01;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small positive number"
    )]
    let decimation = (SLOWEST_STEP_S / step_s + CLOCK_ERROR).floor().max(1.0) as usize;
    decimation
}

fn decimate(values: &[f64], decimation: usize) -> Vec<f64> {
    values
        .chunks_exact(decimation)
        .map(|v| v.iter().sum::<f64>() / decimation as f64)
        .collect()
}

/// Measured values of a signal over a range; NaN where a sample was repaired or not recorded. Beside a
/// measured value of a slow channel the samples on the line to the next are averaged with it, so that
/// the mean is that at the middle.
fn decimate_measured(
    record: &Record,
    name: &str,
    range: &Range<usize>,
    decimation: usize,
) -> Vec<f64> {
    let series = record.signals.get(name);
    let Some((values, marks)) =
        series.and_then(|s| Some((s.values.get(range.clone())?, s.marks.get(range.clone())?)))
    else {
        return vec![f64::NAN; range.len() / decimation];
    };
    let means = decimate(values, decimation).into_iter();
    let counts = |marks: &[Mark]| {
        marks.contains(&Mark::Measured)
            && marks
                .iter()
                .all(|m| matches!(m, Mark::Measured | Mark::Between))
    };
    let counted = marks.chunks_exact(decimation).map(counts);
    means
        .zip(counted)
        .map(|(mean, counts)| if counts { mean } else { f64::NAN })
        .collect()
}

/// Variance of white noise with the power of a signal's own noise, for each sample of the record;
/// zero for a signal that is not recorded. The noise of a slow channel's sample lasts until the
/// next one.
fn white_level(record: &Record, name: &str, range: &Range<usize>) -> f64 {
    let series = record.signals.get(name);
    let Some((values, marks)) =
        series.and_then(|s| Some((s.values.get(range.clone())?, s.marks.get(range.clone())?)))
    else {
        return 0.0;
    };
    let both = values.iter().zip(marks);
    let measured: Vec<f64> = both
        .filter(|(_, mark)| **mark == Mark::Measured)
        .map(|(value, _)| *value)
        .collect();
    let spacing = values.len() as f64 / measured.len().max(1) as f64;
    white_variance(&measured) * spacing
}

/// Terms of the equations at some samples.
fn measured_terms(record: &Record, samples: &[usize], aircraft: &Aircraft) -> Vec<MeasuredTerms> {
    let columns = [
        s::X_CG,
        s::Y_CG,
        s::Z_CG,
        s::ALPHA_VANE,
        s::BETA_VANE,
        s::VELOCITY,
        s::ALTITUDE,
        s::PHI,
        s::THETA,
        s::PSI,
    ]
    .map(|name| record.values(name).unwrap_or_default());
    let (sensors, heading) = (&aircraft.sensors, record.values(s::PSI).is_some());
    let temperatures = record.values(s::AIR_TEMPERATURE);
    let temperature_ratio = |k: usize, altitude_ft: f64| {
        let recorded = temperatures.and_then(|values| values.get(k));
        let ratio = recorded.map(|kelvin| kelvin / air(altitude_ft).kelvin);
        ratio.filter(|ratio| ratio.is_finite()).unwrap_or(1.0)
    };
    let terms = |k: &usize| {
        let now = columns.map(|values| values.get(*k).copied().unwrap_or(0.0));
        let [
            x_ft,
            y_ft,
            z_ft,
            alpha,
            beta,
            speed,
            altitude,
            phi,
            theta,
            psi,
        ] = now;
        let (cg, alpha, beta) = (Position { x_ft, y_ft, z_ft }, alpha / DEG, beta / DEG);
        let along = Vector3::new(
            alpha.cos() * beta.cos(),
            beta.sin(),
            alpha.sin() * beta.cos(),
        );
        let attitude = [phi, theta, psi].map(|angle| angle / DEG);
        MeasuredTerms {
            gravity: gravity_ft_s2(aircraft.latitude_deg, altitude),
            arms: [sensors.ax.arm(cg), sensors.ay.arm(cg), sensors.an.arm(cg)],
            cg,
            temperature_ratio: temperature_ratio(*k, altitude),
            ..rotation_terms(aircraft, attitude, along * speed, heading)
        }
    };
    samples.iter().map(terms).collect()
}

/// Rotation of earth and horizon at an attitude (rad) and a velocity in body axes (ft/s). Without a
/// heading only the part that is independent of it.
pub fn rotation_terms(
    aircraft: &Aircraft,
    [phi, theta, psi]: [f64; 3],
    along: Vector3<f64>,
    heading: bool,
) -> MeasuredTerms {
    let to_body = to_body(phi, theta, psi);
    let latitude = aircraft.latitude_deg / DEG;
    let pole = Vector3::new(latitude.cos(), 0.0, -latitude.sin()) * EARTH_RATE;
    let ground = to_body.transpose() * along;
    let round = Vector3::new(ground.y, -ground.x, -ground.y * latitude.tan()) / EARTH_RADIUS_FT;
    let earth = if heading {
        to_body * pole
    } else {
        Vector3::zeros()
    };
    MeasuredTerms {
        gravity: 0.0,
        arms: [[0.0; 3]; 3],
        cg: Position {
            x_ft: 0.0,
            y_ft: 0.0,
            z_ft: 0.0,
        },
        earth,
        horizon: earth + to_body * round,
        to_body,
        temperature_ratio: 1.0,
    }
}

/// Rotation from north, east, down to body axes; angles in rad.
fn to_body(phi: f64, theta: f64, psi: f64) -> Matrix3<f64> {
    let ((sp, cp), (st, ct), (sy, cy)) = (phi.sin_cos(), theta.sin_cos(), psi.sin_cos());
    Matrix3::new(
        ct * cy,
        ct * sy,
        -st,
        sp * st * cy - cp * sy,
        sp * st * sy + cp * cy,
        sp * ct,
        cp * st * cy + sp * sy,
        cp * st * sy - sp * cy,
        cp * ct,
    )
}

/// State measured at a sample.
fn measured_state(
    record: &Record,
    k: usize,
    aircraft: &Aircraft,
    terms: Option<&MeasuredTerms>,
) -> State {
    let at = |name: &str| {
        record
            .values(name)
            .and_then(|v| v.get(k))
            .copied()
            .unwrap_or(0.0)
    };
    let Some(terms) = terms else {
        return State::zeros();
    };
    let rates = [at(s::P) / DEG, at(s::Q) / DEG, at(s::R) / DEG];
    let read = Flow {
        alpha: at(s::ALPHA_VANE) / DEG,
        beta: at(s::BETA_VANE) / DEG,
        velocity: at(s::VELOCITY),
        rates,
    };
    let flow = aircraft.sensors.flow_at_cg(&read, terms.cg);
    let ((sa, ca), (sb, cb)) = (flow.alpha.sin_cos(), flow.beta.sin_cos());
    let velocity = [
        flow.velocity * ca * cb,
        flow.velocity * sb,
        flow.velocity * sa * cb,
    ];
    let omega = Vector3::from(rates);
    let swung = |i: usize| velocity[i] + omega.cross(&Vector3::from(terms.arms[i]))[i];
    State::from([
        swung(0),
        swung(1),
        swung(2),
        at(s::PHI) / DEG,
        at(s::THETA) / DEG,
        at(s::PSI) / DEG,
        at(s::ALTITUDE),
    ])
}

/// Factor from an input's unit to rad/s or ft/s², in the sense of the equations (down positive).
pub fn input_factor(input: usize) -> f64 {
    match SIGNALS[input] {
        s::AX | s::AY => G0_FT_S2,
        s::AN => -G0_FT_S2,
        _ => 1.0 / DEG,
    }
}

const _: () = assert!(INPUTS + OUTPUTS == INSTRUMENTS);

#[cfg(test)]
mod tests {
    use super::decimation;

    #[test]
    fn at_least_25_samples_a_second_remain_whatever_the_error_of_the_clock() {
        for (rate_hz, expected) in [
            (10.0, 1),
            (40.0, 1),
            (50.0, 2),
            (100.0, 4),
            (120.0, 4),
            (1000.0, 40),
        ] {
            for error in [-1e-4, 0.0, 1e-4] {
                assert_eq!(decimation((1.0 + error) / rate_hz), expected, "{rate_hz}");
            }
        }
    }
}
