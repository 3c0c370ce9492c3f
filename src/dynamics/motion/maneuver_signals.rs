//! Signals of a maneuver, cut out of a record: values at the samples and halfway between them.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use pulp::Arch;

use super::half_samples::{constant_mean, with_half_samples, with_means_between};
use super::local_slope::slope;
use super::measured_motion::{MeasuredMotion, Signals};
use super::vane_inversion::{FLOW_SIGNALS, VaneInversion};
use crate::aircraft::{Aircraft, Sensors};
use crate::earth::gravity_at;
use crate::flight::{Record, signal};
use crate::numerics::vectors::simd::vectorised;

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

/// Angular rates, whose slopes are the angular accelerations.
const RATES: [&str; 3] = [signal::P, signal::Q, signal::R];

/// Signals of a maneuver at samples and half-samples.
#[derive(Clone, Debug)]
pub struct ManeuverSignals {
    /// Values at the points by signal. Copies that differ in few signals share the others.
    points: BTreeMap<Arc<str>, Arc<Vec<f64>>>,
    sensors: Sensors,
    /// α and β at the c.g. at every point, rad. Inverting the vanes is the most expensive part of a
    /// motion.
    flow: Arc<Vec<[f64; 2]>>,
    pub step_s: f64,
    pub samples: usize,
    /// Two, or one without the points between samples.
    points_per_sample: usize,
}

impl ManeuverSignals {
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
    ) -> Result<ManeuverSignals, String> {
        let between = with_half_samples;
        ManeuverSignals::cut_with(aircraft, record, range, surfaces, mass_properties, between)
    }

    /// [`ManeuverSignals::cut`] with all signals linear between samples, as other estimators take
    /// them.
    ///
    /// # Errors
    /// As [`ManeuverSignals::cut`].
    pub fn cut_linear<'a>(
        aircraft: &Aircraft,
        record: &Record,
        range: Range<usize>,
        surfaces: impl IntoIterator<Item = &'a str>,
        mass_properties: MassProperties,
    ) -> Result<ManeuverSignals, String> {
        let between = with_means_between;
        ManeuverSignals::cut_with(aircraft, record, range, surfaces, mass_properties, between)
    }

    /// Cuts `range` out of the record; `between` adds the values between samples.
    fn cut_with<'a>(
        aircraft: &Aircraft,
        record: &Record,
        range: Range<usize>,
        surfaces: impl IntoIterator<Item = &'a str>,
        mass_properties: MassProperties,
        between: fn(&[f64]) -> Vec<f64>,
    ) -> Result<ManeuverSignals, String> {
        let mut points = BTreeMap::new();
        for name in signal::REQUIRED.iter().copied().chain(surfaces) {
            let values = checked_values(record, name, &range)?;
            let is_mean =
                mass_properties == MassProperties::Mean && MASS_PROPERTIES.contains(&name);
            let at_points = if is_mean {
                constant_mean(values)
            } else {
                between(values)
            };
            points.insert(name.into(), Arc::new(at_points));
        }
        for name in RATES {
            let values = record.values(name).unwrap_or_default();
            let slope = slope(values, &range, record.step_s);
            points.insert(slope_name(name).into(), Arc::new(between(&slope)));
        }
        let mut signals = ManeuverSignals {
            points,
            sensors: aircraft.sensors.clone(),
            flow: Arc::default(),
            step_s: record.step_s,
            samples: range.len(),
            points_per_sample: 2,
        };
        signals.flow = Arc::new(signals.flow_at_cg());
        Ok(signals)
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
        self.points.insert(name.into(), Arc::new(points));
        if FLOW_SIGNALS.contains(&name) {
            self.flow = Arc::new(self.flow_at_cg());
        }
    }

    /// Number of points: samples, and the halves between them unless they are left out.
    #[must_use]
    pub fn len(&self) -> usize {
        let per_sample = self.points_per_sample;
        (per_sample * self.samples).saturating_sub(per_sample - 1)
    }

    /// `true` if a point is a sample.
    #[must_use]
    pub fn is_sample(&self, point: usize) -> bool {
        point.is_multiple_of(self.points_per_sample)
    }

    /// `true` unless the points between samples are left out.
    #[must_use]
    pub fn has_points_between_samples(&self) -> bool {
        self.points_per_sample > 1
    }

    /// Signals at every `stride`-th sample without the points between, for equations at these instants
    /// alone.
    #[must_use]
    pub fn at_every(&self, stride: usize) -> ManeuverSignals {
        let distance = self.points_per_sample * stride;
        let every = |points: &Vec<f64>| points.iter().step_by(distance).copied().collect();
        let points = self.points.iter();
        ManeuverSignals {
            points: points
                .map(|(name, points)| (Arc::clone(name), Arc::new(every(points))))
                .collect(),
            sensors: self.sensors.clone(),
            flow: Arc::new(self.flow.iter().step_by(distance).copied().collect()),
            step_s: self.step_s * stride as f64,
            samples: self.samples.div_ceil(stride),
            points_per_sample: 1,
        }
    }

    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples == 0
    }

    /// `true` if all signals of the motion are those of the other: only surfaces differ.
    #[must_use]
    pub fn shares_motion_with(&self, other: &ManeuverSignals) -> bool {
        let slopes = RATES.map(slope_name);
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

    /// Values of a signal at the samples, without the points between them.
    #[must_use]
    pub fn samples_of(&self, name: &str) -> Vec<f64> {
        self.signal(name)
            .iter()
            .step_by(self.points_per_sample)
            .copied()
            .collect()
    }

    /// Signals as a sensor in error would have recorded it: a signal's values times `1 + scale`,
    /// plus `bias`.
    #[must_use]
    pub fn with_error(&self, name: &str, scale: f64, bias: f64) -> ManeuverSignals {
        let mut signals = self.clone();
        for (name, bias) in [(name, bias), (slope_name(name).as_str(), 0.0)] {
            if let Some(points) = self.points.get(name) {
                let in_error = points.iter().map(|value| value + (scale * value + bias));
                signals.set(name, in_error.collect());
            }
        }
        signals
    }

    /// Signals as a recorder would have recorded it with a signal late by `delay_s`, to first order in
    /// the delay.
    #[must_use]
    pub fn delayed(&self, name: &str, delay_s: f64) -> ManeuverSignals {
        let mut signals = self.clone();
        if let Some(points) = self.points.get(name) {
            let values = points.iter().enumerate();
            let late = values.map(|(i, value)| value + self.change_by_delay(points, i, delay_s));
            signals.set(name, late.collect());
        }
        signals
    }

    /// Changes of a signal's samples by a delay, to first order in the delay.
    #[must_use]
    pub fn changes_by_delay(&self, name: &str, delay_s: f64) -> Vec<f64> {
        let points = self.signal(name);
        (0..points.len())
            .step_by(self.points_per_sample)
            .map(|i| self.change_by_delay(points, i, delay_s))
            .collect()
    }

    /// Change of a point by a delay, from the points on either side.
    fn change_by_delay(&self, points: &[f64], i: usize, delay_s: f64) -> f64 {
        let between_s = 2.0 * self.step_s / self.points_per_sample as f64;
        let last = points.len().saturating_sub(1);
        let difference = points[(i + 1).min(last)] - points[i.saturating_sub(1)];
        -delay_s / between_s * difference
    }

    /// Signals with a further signal, given at the samples.
    #[must_use]
    pub fn with_samples(&self, name: &str, values: &[f64]) -> ManeuverSignals {
        let mut signals = self.clone();
        signals.set(name, with_half_samples(values));
        signals
    }

    /// Signals with a further, constant signal.
    #[must_use]
    pub fn with_constant(&self, name: &str, value: f64) -> ManeuverSignals {
        let mut signals = self.clone();
        signals.set(name, vec![value; self.len()]);
        signals
    }

    /// Measured motion of the maneuver.
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
            rates: RATES.map(|name| self.signal(name)),
            slopes: RATES.map(|name| self.signal(&slope_name(name))),
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

/// Values of a signal over a range of the record.
///
/// # Errors
/// A sentence that names the signal and time where a value is missing, or a size is not positive.
fn checked_values<'r>(
    record: &'r Record,
    name: &str,
    range: &Range<usize>,
) -> Result<&'r [f64], String> {
    let values = record
        .values(name)
        .and_then(|values| values.get(range.clone()))
        .ok_or_else(|| format!("the record has no signal `{name}` over the maneuver"))?;
    if has_missing(values) {
        let gap = values.iter().position(|v| !v.is_finite()).unwrap_or(0);
        let time_s = record.time_s(range.start + gap);
        return Err(format!(
            "signal `{name}` is missing at {time_s:.3} s, inside the maneuver"
        ));
    }
    let must_be_positive = signal::POSITIVE.contains(&name);
    if let Some(wrong) = values.iter().position(|v| must_be_positive && *v <= 0.0) {
        let (value, time_s) = (values[wrong], record.time_s(range.start + wrong));
        return Err(format!(
            "signal `{name}` is {value} at {time_s:.3} s, inside the maneuver; it must be greater \
             than zero"
        ));
    }
    Ok(values)
}

/// Name of the slope of an angular rate among the signals.
#[must_use]
pub fn slope_name(name: &str) -> String {
    format!("slope of {name}")
}

/// `true` if a value is missing. One pass over all values vectorises; a search does not.
fn has_missing(values: &[f64]) -> bool {
    vectorised(
        #[inline(always)]
        || {
            values
                .iter()
                .fold(false, |missing, v| missing | !v.is_finite())
        },
    )
}
