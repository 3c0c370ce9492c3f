//! Measured motion: all inputs of an axis's equations, at the samples and halfway between them.
//!
//! A fourth-order Runge-Kutta step needs signals at its ends and in its middle: point 2k is sample k,
//! point 2k+1 lies between samples k and k+1, on a cubic through the samples beside it.
#![expect(
    clippy::inline_always,
    reason = "laid out by vectors for the processor at hand"
)]

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};

use super::lever::lever;
use crate::aircraft::{Aircraft, Flow, Position, Sensors, Thrust};
use crate::earth::gravity_at;
use crate::flight::{Record, signal};
use crate::numerics::sample_count::nearest;
use crate::units::{G0_FT_S2, RAD};

/// Motion at one instant, in rad, rad/s, rad/s², ft, ft/s, slug, lbf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// At the c.g., from the vanes.
    pub alpha: f64,
    pub beta: f64,
    pub velocity: f64,
    pub rates: [f64; 3],
    /// Angular accelerations: slopes of the measured rates.
    pub accelerations: [f64; 3],
    pub theta: f64,
    pub phi: f64,
    /// Specific forces at the c.g. forward, right and down, from the accelerometers, ft/s².
    pub force_x: f64,
    pub force_y: f64,
    pub force_z: f64,
    pub gravity: f64,
    pub qbar: f64,
    pub mass: f64,
    pub thrust: Thrust,
    pub ix: f64,
    pub iy: f64,
    pub iz: f64,
    pub ixz: f64,
    /// Angular momentum of both engines along +x, slug ft²/s.
    pub engine_momentum: f64,
    pub cg: Position,
}

/// Mass, c.g. and inertias: sample by sample, or their means over the maneuver (the paper's
/// choice).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MassProperties {
    #[default]
    Recorded,
    Mean,
}

const MASS_PROPERTIES: &[&str] = &[
    signal::MASS,
    signal::X_CG,
    signal::Y_CG,
    signal::Z_CG,
    signal::IX,
    signal::IY,
    signal::IZ,
    signal::IXZ,
];

/// Signals that the angles of the flow at the c.g. follow from.
const FLOW_SIGNALS: [&str; 9] = [
    signal::ALPHA_VANE,
    signal::BETA_VANE,
    signal::VELOCITY,
    signal::P,
    signal::Q,
    signal::R,
    signal::X_CG,
    signal::Y_CG,
    signal::Z_CG,
];

/// Signals of a window of a record at samples and half-samples.
#[derive(Clone, Debug)]
pub struct Window {
    /// Windows that differ in few signals share the others.
    points: BTreeMap<String, Arc<Vec<f64>>>,
    sensors: Sensors,
    /// α and β at the c.g. at every point, rad. Inverting the vanes is the most expensive part of a
    /// motion.
    flow: Arc<Vec<[f64; 2]>>,
    pub step_s: f64,
    pub samples: usize,
}

impl Window {
    /// Cuts `range` out of the record: the named signals besides those the equations need.
    ///
    /// # Errors
    /// A sentence that names the signal and time where a value is missing, or a size is not positive.
    pub fn cut<'a>(
        aircraft: &Aircraft,
        record: &Record,
        range: Range<usize>,
        surfaces: impl IntoIterator<Item = &'a str>,
        mass_properties: MassProperties,
    ) -> Result<Window, String> {
        let mut points = BTreeMap::new();
        for name in signal::REQUIRED.iter().copied().chain(surfaces) {
            let values = record.values(name).and_then(|v| v.get(range.clone()));
            let values = values
                .ok_or_else(|| format!("the record has no signal `{name}` over the maneuver"))?;
            if has_missing(values) {
                let gap = values.iter().position(|v| !v.is_finite()).unwrap_or(0);
                let time_s = record.time_s(range.start + gap);
                return Err(format!(
                    "signal `{name}` is missing at {time_s:.3} s, inside the maneuver"
                ));
            }
            let wrong = values.iter().position(|v| *v <= 0.0);
            if let Some(wrong) = wrong.filter(|_| signal::POSITIVE.contains(&name)) {
                let (value, time_s) = (values[wrong], record.time_s(range.start + wrong));
                return Err(format!(
                    "signal `{name}` is {value} at {time_s:.3} s, inside the maneuver; it must be greater \
                     than zero"
                ));
            }
            let mean = mass_properties == MassProperties::Mean && MASS_PROPERTIES.contains(&name);
            points.insert(
                name.to_owned(),
                Arc::new(if mean {
                    constant_mean(values)
                } else {
                    with_half_samples(values)
                }),
            );
        }
        for name in [signal::P, signal::Q, signal::R] {
            let slope = slope(
                record.values(name).unwrap_or_default(),
                &range,
                record.step_s,
            );
            points.insert(slope_name(name), Arc::new(with_half_samples(&slope)));
        }
        let mut window = Window {
            points,
            sensors: aircraft.sensors.clone(),
            flow: Arc::default(),
            step_s: record.step_s,
            samples: range.len(),
        };
        window.flow = Arc::new(window.flow_at_cg());
        Ok(window)
    }

    /// α and β at the c.g. at every point, from the vanes.
    fn flow_at_cg(&self) -> Vec<[f64; 2]> {
        Arch::new().dispatch(VaneInversion {
            sensors: &self.sensors,
            signals: FLOW_SIGNALS.map(|name| self.signal(name)),
            points: self.len(),
        })
    }

    /// Replaces the points of a signal, or adds one.
    fn set(&mut self, name: &str, points: Vec<f64>) {
        self.points.insert(name.to_owned(), Arc::new(points));
        if FLOW_SIGNALS.contains(&name) {
            self.flow = Arc::new(self.flow_at_cg());
        }
    }

    /// Number of points: samples and the halves between them.
    #[must_use]
    pub fn len(&self) -> usize {
        (2 * self.samples).saturating_sub(1)
    }

    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples == 0
    }

    /// Returns true if all signals of the motion are those of another window: only surfaces differ.
    #[must_use]
    pub fn shares_motion_with(&self, other: &Window) -> bool {
        let slopes = [signal::P, signal::Q, signal::R].map(slope_name);
        let slopes = slopes.iter().map(String::as_str);
        let is_same = |name: &str| match (self.points.get(name), other.points.get(name)) {
            (Some(own), Some(other)) => Arc::ptr_eq(own, other),
            _ => false,
        };
        signal::REQUIRED.iter().copied().chain(slopes).all(is_same)
    }

    /// Values of a signal at the points; empty for a signal that was not cut out.
    #[must_use]
    pub fn signal(&self, name: &str) -> &[f64] {
        self.points
            .get(name)
            .map_or(&[], |points| points.as_slice())
    }

    /// Window as a sensor in error would have recorded it: a signal's values times `1 + scale`,
    /// plus `bias`.
    #[must_use]
    pub fn misread(&self, name: &str, scale: f64, bias: f64) -> Window {
        let mut window = self.clone();
        for (name, bias) in [(name, bias), (slope_name(name).as_str(), 0.0)] {
            if let Some(points) = self.points.get(name) {
                let misread = points.iter().map(|value| value + (scale * value + bias));
                window.set(name, misread.collect());
            }
        }
        window
    }

    /// Window as a recorder would have recorded it with a signal late by `delay_s`, to first order in
    /// the delay.
    #[must_use]
    pub fn late(&self, name: &str, delay_s: f64) -> Window {
        let mut window = self.clone();
        if let Some(points) = self.points.get(name) {
            // Points lie half a step apart.
            let per_difference = delay_s / self.step_s;
            let last = points.len().saturating_sub(1);
            let value = |(i, value): (usize, &f64)| {
                let difference = points[(i + 1).min(last)] - points[i.saturating_sub(1)];
                value - per_difference * difference
            };
            window.set(name, points.iter().enumerate().map(value).collect());
        }
        window
    }

    /// Window with a further signal, given at the samples.
    #[must_use]
    pub fn with_samples(&self, name: &str, values: &[f64]) -> Window {
        let mut window = self.clone();
        window.set(name, with_half_samples(values));
        window
    }

    /// Window with all signals linear between samples, as other estimators take them.
    #[must_use]
    pub fn linear_between_samples(&self) -> Window {
        let mut window = self.clone();
        for points in window.points.values_mut() {
            let points = Arc::make_mut(points);
            for middle in (1..points.len()).step_by(2) {
                points[middle] = 0.5 * (points[middle - 1] + points[middle + 1]);
            }
        }
        window.flow = Arc::new(window.flow_at_cg());
        window
    }

    /// Window with a further, constant signal.
    #[must_use]
    pub fn with_constant(&self, name: &str, value: f64) -> Window {
        let mut window = self.clone();
        window.set(name, vec![value; self.len()]);
        window
    }

    /// Measured motion along the window.
    #[must_use]
    pub fn motion<'a>(
        &'a self,
        aircraft: &'a Aircraft,
    ) -> MeasuredMotion<'a, impl Fn(f64) -> f64 + use<>> {
        MeasuredMotion {
            aircraft,
            signals: self.signals(),
            gravity: gravity_at(aircraft.latitude_deg),
            points: self.len(),
        }
    }

    fn signals(&self) -> Signals<'_> {
        Signals {
            flow: &self.flow,
            velocity: self.signal(signal::VELOCITY),
            rates: [signal::P, signal::Q, signal::R].map(|name| self.signal(name)),
            slopes: [signal::P, signal::Q, signal::R].map(|name| self.signal(&slope_name(name))),
            attitude: [signal::THETA, signal::PHI].map(|name| self.signal(name)),
            forces: [signal::AX, signal::AY, signal::AN].map(|name| self.signal(name)),
            air: [signal::ALTITUDE, signal::QBAR].map(|name| self.signal(name)),
            engines: [signal::THRUST, signal::RPM_LEFT, signal::RPM_RIGHT]
                .map(|name| self.signal(name)),
            mass: self.signal(signal::MASS),
            cg: [signal::X_CG, signal::Y_CG, signal::Z_CG].map(|name| self.signal(name)),
            inertia: [signal::IX, signal::IY, signal::IZ, signal::IXZ]
                .map(|name| self.signal(name)),
        }
    }
}

/// Inversion of the vanes at every point, compiled for the processor at hand.
struct VaneInversion<'a> {
    sensors: &'a Sensors,
    signals: [&'a [f64]; FLOW_SIGNALS.len()],
    points: usize,
}

impl WithSimd for VaneInversion<'_> {
    type Output = Vec<[f64; 2]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<[f64; 2]> {
        let mut angles = Vec::with_capacity(self.points);
        let [alpha, beta, velocity, p, q, r, x_ft, y_ft, z_ft] = self.signals;
        for i in 0..self.points {
            let read = Flow {
                alpha: alpha[i] * RAD,
                beta: beta[i] * RAD,
                velocity: velocity[i],
                rates: [p[i] * RAD, q[i] * RAD, r[i] * RAD],
            };
            let cg = Position {
                x_ft: x_ft[i],
                y_ft: y_ft[i],
                z_ft: z_ft[i],
            };
            let flow = self.sensors.flow_at_cg(&read, cg);
            angles.push([flow.alpha, flow.beta]);
        }
        angles
    }
}

/// Measured motion along a window.
pub struct MeasuredMotion<'a, G: Fn(f64) -> f64> {
    aircraft: &'a Aircraft,
    signals: Signals<'a>,
    gravity: G,
    points: usize,
}

impl<G: Fn(f64) -> f64> std::fmt::Debug for MeasuredMotion<'_, G> {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} points", self.points)
    }
}

impl<G: Fn(f64) -> f64> MeasuredMotion<'_, G> {
    /// Motion at one point.
    #[inline(always)]
    pub fn at(&self, point: usize) -> Motion {
        let accelerations = self.signals.slopes.map(|s| s[point] * RAD);
        let gravity = &self.gravity;
        self.signals
            .at(self.aircraft, gravity, point, accelerations)
    }

    /// Motion at one point as it would be measured without angular accelerations.
    #[inline(always)]
    pub fn without_angular_accelerations(&self, point: usize) -> Motion {
        let gravity = &self.gravity;
        self.signals.at(self.aircraft, gravity, point, [0.0; 3])
    }

    /// Motion at every point in order.
    pub fn points(&self) -> impl Iterator<Item = Motion> {
        (0..self.points).map(|point| self.at(point))
    }
}

/// Signals of a window, grouped by use.
struct Signals<'a> {
    flow: &'a [[f64; 2]],
    velocity: &'a [f64],
    rates: [&'a [f64]; 3],
    slopes: [&'a [f64]; 3],
    attitude: [&'a [f64]; 2],
    forces: [&'a [f64]; 3],
    air: [&'a [f64]; 2],
    engines: [&'a [f64]; 3],
    mass: &'a [f64],
    cg: [&'a [f64]; 3],
    inertia: [&'a [f64]; 4],
}

impl Signals<'_> {
    /// Motion at point `i` with these angular accelerations.
    #[inline(always)]
    fn at(
        &self,
        aircraft: &Aircraft,
        gravity: impl Fn(f64) -> f64,
        i: usize,
        accelerations: [f64; 3],
    ) -> Motion {
        let rates = self.rates.map(|s| s[i] * RAD);
        let [x_ft, y_ft, z_ft] = self.cg.map(|s| s[i]);
        let cg = Position { x_ft, y_ft, z_ft };
        let [alpha, beta] = self.flow[i];
        let felt =
            |i: usize, sensor: Position| lever(i, sensor.arm(cg), rates, accelerations).value;
        let [thrust, rpm_left, rpm_right] = self.engines.map(|s| s[i]);
        let thrust = aircraft.thrust(thrust, cg);
        let [altitude, qbar] = self.air.map(|s| s[i]);
        let [ix, iy, iz, ixz] = self.inertia.map(|s| s[i]);
        let [ax, ay, an] = self.forces.map(|s| s[i]);
        let mass = self.mass[i];
        // With an accelerometer that does not sense thrust (the print of 2.8), thrust is added
        // here.
        let unfelt = if aircraft.sensors.thrust_in_ax {
            0.0
        } else {
            thrust.forward_lbf * (1.0 / mass)
        };
        Motion {
            alpha,
            beta,
            velocity: self.velocity[i],
            rates,
            accelerations,
            theta: self.attitude[0][i] * RAD,
            phi: self.attitude[1][i] * RAD,
            force_x: G0_FT_S2 * ax - felt(0, aircraft.sensors.ax) + unfelt,
            force_y: G0_FT_S2 * ay - felt(1, aircraft.sensors.ay),
            force_z: -G0_FT_S2 * an - felt(2, aircraft.sensors.an),
            gravity: gravity(altitude),
            qbar,
            mass,
            thrust,
            ix,
            iy,
            iz,
            ixz,
            engine_momentum: aircraft.engine_inertia_slug_ft2
                * (rpm_left + rpm_right)
                * (2.0 * std::f64::consts::PI / 60.0),
            cg,
        }
    }
}

fn slope_name(name: &str) -> String {
    format!("slope of {name}")
}

/// Returns true if a value is missing. One pass over all values vectorises; a search does not.
fn has_missing(values: &[f64]) -> bool {
    Arch::new().dispatch(|| {
        values
            .iter()
            .fold(false, |missing, v| missing | !v.is_finite())
    })
}

/// Interleaves samples with the values half-way between them, of the cubic through the two samples on
/// either side. A straight line would cut the corners of a sine of angular frequency ω by (ω step)²/12,
/// and so the effect of a surface; at 10 Hz and 1 Hz that is 3 %. At the ends, and beside a gap, the
/// value is the mean of its neighbours.
fn with_half_samples(values: &[f64]) -> Vec<f64> {
    let mut points = vec![0.0; (2 * values.len()).saturating_sub(1)];
    Arch::new().dispatch(|| {
        for (points, pair) in points.chunks_exact_mut(2).zip(values.windows(2)) {
            points[0] = pair[0];
            points[1] = 0.5 * (pair[0] + pair[1]);
        }
        let inner = points.get_mut(2..).unwrap_or_default();
        for (points, four) in inner.chunks_exact_mut(2).zip(values.windows(4)) {
            let middle = points[1] + ((four[1] - four[0]) - (four[3] - four[2])) / 16.0;
            points[1] = if middle.is_finite() {
                middle
            } else {
                points[1]
            };
        }
    });
    if let (Some(point), Some(value)) = (points.last_mut(), values.last()) {
        *point = *value;
    }
    points
}

fn constant_mean(values: &[f64]) -> Vec<f64> {
    // Several independent sums hide the latency of one.
    let (whole, rest) = values.as_chunks::<8>();
    let sums = whole
        .iter()
        .fold([0.0; 8], |sums, v| std::array::from_fn(|i| sums[i] + v[i]));
    let mean = sums.iter().chain(rest).sum::<f64>() / values.len().max(1) as f64;
    vec![mean; (2 * values.len()).saturating_sub(1)]
}

/// Half the length of the local straight line whose slope is the derivative: short against the
/// airframe's modes, and long enough to keep the gyros' noise, at the accelerometers' arms, below that
/// of the accelerometers.
const SLOPE_REACH_S: f64 = 0.1;

/// Samples on each side of the local straight line whose slope is the derivative, at least one.
#[must_use]
pub fn slope_reach(step_s: f64) -> usize {
    nearest(SLOPE_REACH_S / step_s).max(1)
}

/// Slope per second of a signal over a range of the record, by local least squares.
fn slope(values: &[f64], range: &Range<usize>, step_s: f64) -> Vec<f64> {
    let reach = slope_reach(step_s);
    let at = |k: usize| {
        let first = k.checked_sub(reach);
        let Some(line) = first.and_then(|first| values.get(first..=k + reach)) else {
            return slope_at_gap(values, k, step_s);
        };
        let (mut up, mut norm) = (0.0, 0.0);
        for d in 1..=reach {
            let weight = d as f64;
            up += weight * (line[reach + d] - line[reach - d]);
            norm += 2.0 * weight * weight;
        }
        if up.is_finite() {
            up / (norm * step_s)
        } else {
            slope_at_gap(values, k, step_s)
        }
    };
    range.clone().map(at).collect()
}

/// Slope where samples are missing or the record ends: least squares on the pairs that are there.
fn slope_at_gap(values: &[f64], k: usize, step_s: f64) -> f64 {
    let reach = slope_reach(step_s)
        .min(k)
        .min(values.len().saturating_sub(k + 1));
    let (mut up, mut norm) = (0.0, 0.0);
    for d in 1..=reach {
        let (weight, change) = (d as f64, values[k + d] - values[k - d]);
        if change.is_finite() {
            up += weight * change;
            norm += 2.0 * weight * weight;
        }
    }
    if norm > 0.0 {
        up / (norm * step_s)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::record::with_margin;
    use approx::assert_abs_diff_eq;

    #[test]
    fn points_between_samples_lie_on_cubics_and_at_the_ends_on_lines() {
        let cubic = |t: f64| 1.0 - 2.0 * t + 0.5 * t * t + 0.25 * t * t * t;
        let samples: Vec<f64> = (0..8).map(|k| cubic(f64::from(k))).collect();
        let points = with_half_samples(&samples);
        assert_eq!(points.len(), 15);
        for (i, point) in points.iter().enumerate() {
            let expected = match i {
                1 | 13 => 0.5 * (samples[i / 2] + samples[i / 2 + 1]),
                _ => cubic(0.5 * i as f64),
            };
            assert_abs_diff_eq!(*point, expected, epsilon = 1e-12);
        }
        assert_eq!(with_half_samples(&[1.0, 3.0]), [1.0, 2.0, 3.0]);
        assert!(with_half_samples(&[]).is_empty());
    }

    #[test]
    fn points_beside_a_gap_are_the_means_of_their_neighbours() {
        let points = with_half_samples(&[0.0, 1.0, 4.0, 9.0, f64::NAN, 25.0]);
        assert_abs_diff_eq!(points[3], 2.25);
        assert_abs_diff_eq!(points[5], 6.5);
        assert!(points[7].is_nan() && points[9].is_nan());
    }

    #[test]
    fn a_slope_spans_the_same_time_at_any_rate() {
        let reaches = [10.0, 20.0, 40.0, 50.0, 2.0].map(|rate_hz| slope_reach(1.0 / rate_hz));
        assert_eq!(reaches, [1, 2, 4, 5, 1]);
    }

    #[test]
    fn a_part_of_a_record_has_the_samples_of_its_slopes_at_any_rate() {
        for rate_hz in [2.0, 40.0, 100.0, 1000.0] {
            let step_s = 1.0 / rate_hz;
            let part = with_margin(5000, 5000, 9000, step_s);
            let reach = slope_reach(step_s);
            assert!(
                part.start <= 5000 - reach && part.end > 5000 + reach,
                "{rate_hz}"
            );
        }
    }

    #[test]
    fn the_slope_of_a_straight_line_is_exact_up_to_the_ends() {
        let line: Vec<f64> = (0..20).map(|k| 3.0 + 0.5 * f64::from(k)).collect();
        for s in slope(&line, &(1..19), 0.025) {
            assert_abs_diff_eq!(s, 20.0, epsilon = 1e-12);
        }
    }
}
