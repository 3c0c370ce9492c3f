//! Stand-ins: values in place of a signal that a flight does not record.
//!
//! The equations of motion read every signal of [`signal::REQUIRED`]. Few of them decide the
//! derivatives of an axis; the others can be assumed or computed, at a cost that is stated.

use serde::{Deserialize, Serialize};

use super::record::{Mark, Record, Series};
use super::remaining_errors::{RemainingError, RemainingErrors};
use super::signal as s;
use crate::earth::air;
use crate::numerics::bisection::last_that_holds;
use crate::numerics::digits::rounded;

/// Source of the values of a signal that is not recorded.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum StandIn {
    /// One value throughout, in the signal's unit.
    Value(f64),
    /// Mean of the recorded samples, in the signal's unit: for gaps of a signal that changes little.
    Mean(f64),
    /// Mean of the recorded samples, in the signal's unit, with their standard deviation as the error that remains: for
    /// gaps of a signal that changes.
    Typical { mean: f64, deviation: f64 },
    /// V over the speed of sound. The air is that of the standard atmosphere, with the recorded
    /// temperature where there is one, here and in the following.
    MachOfVelocity,
    /// Mach number times the speed of sound.
    VelocityOfMach,
    /// √(2 q̄/ρ).
    VelocityOfPressure,
    /// ρ V²/2.
    PressureOfVelocity,
    /// Altitude at which the density is 2 q̄/V².
    AltitudeOfPressure,
    /// Pitch attitude of level flight: θ = α.
    ThetaOfAlpha,
    /// The moment of inertia about another axis, for the inertias of an axis without any state.
    InertiaOf(Inertia),
    /// No value: the record is as if the signal were not recorded. For a signal that no equation of
    /// motion reads.
    Absent,
}

/// Moment of inertia that stands for another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Inertia {
    Pitch,
    Yaw,
}

impl Inertia {
    fn signal(self) -> &'static str {
        match self {
            Inertia::Pitch => s::IY,
            Inertia::Yaw => s::IZ,
        }
    }
}

/// States that only the lateral derivatives need. Without one of them the longitudinal equations
/// assume straight flight with level wings.
pub const LATERAL: [&str; 4] = [s::BETA_VANE, s::P, s::R, s::PHI];

/// States that only the longitudinal derivatives need. α is not among them: the lateral equations
/// need it, at least as a constant.
pub const LONGITUDINAL: [&str; 2] = [s::Q, s::THETA];

impl StandIn {
    /// Stand-in of a signal, if it can have one. `has` is `true` for a signal that is recorded or
    /// given as a constant.
    #[must_use]
    pub fn of(signal: &str, has: impl Fn(&str) -> bool) -> Option<StandIn> {
        let has_all = |signals: &[&str]| signals.iter().all(|signal| has(signal));
        let has_none = |signals: &[&str]| !signals.iter().any(|signal| has(signal));
        match signal {
            s::RPM_LEFT | s::RPM_RIGHT | s::THRUST | s::IXZ | s::AX | s::AY => {
                Some(StandIn::Value(0.0))
            }
            s::MACH if has(s::VELOCITY) || has(s::QBAR) => Some(StandIn::MachOfVelocity),
            s::VELOCITY if has_all(&[s::MACH, s::ALTITUDE]) => Some(StandIn::VelocityOfMach),
            s::VELOCITY if has_all(&[s::QBAR, s::ALTITUDE]) => Some(StandIn::VelocityOfPressure),
            s::QBAR if has(s::ALTITUDE) && (has(s::VELOCITY) || has(s::MACH)) => {
                Some(StandIn::PressureOfVelocity)
            }
            s::ALTITUDE if has_all(&[s::VELOCITY, s::QBAR]) => Some(StandIn::AltitudeOfPressure),
            s::THETA if has_all(&LATERAL) => Some(StandIn::ThetaOfAlpha),
            s::Q if has_all(&LATERAL) => Some(StandIn::Value(0.0)),
            s::AN => Some(StandIn::Value(1.0)),
            // Nothing turns about the axes of the other states, so the size has no effect.
            s::IX | s::IZ => {
                (has(s::IY) && has_none(&LATERAL)).then_some(StandIn::InertiaOf(Inertia::Pitch))
            }
            s::IY => {
                (has(s::IZ) && has_none(&LONGITUDINAL)).then_some(StandIn::InertiaOf(Inertia::Yaw))
            }
            lateral if LATERAL.contains(&lateral) => {
                has_all(&LONGITUDINAL).then_some(StandIn::Value(0.0))
            }
            _ => None,
        }
    }

    /// The stand-in in words: `is taken as 0`.
    #[must_use]
    pub fn in_words(self) -> String {
        match self {
            StandIn::Value(value) => format!("is taken as {value}"),
            StandIn::Mean(value) => {
                format!(
                    "is taken as {}, its mean where it is recorded",
                    rounded(value)
                )
            }
            StandIn::Typical { mean, deviation } => {
                let (mean, deviation) = (rounded(mean), rounded(deviation));
                format!(
                    "is taken as {mean} ± {deviation}, its mean and scatter where it is recorded"
                )
            }
            StandIn::MachOfVelocity => "is computed from V in the standard atmosphere".to_owned(),
            StandIn::VelocityOfMach => "is computed from Mach and altitude".to_owned(),
            StandIn::VelocityOfPressure | StandIn::PressureOfVelocity => {
                "is computed from the other air data in the standard atmosphere".to_owned()
            }
            StandIn::AltitudeOfPressure => "is computed from V and q̄".to_owned(),
            StandIn::ThetaOfAlpha => "is taken as α, as in level flight".to_owned(),
            StandIn::InertiaOf(inertia) => format!("is taken as `{}`", inertia.signal()),
            StandIn::Absent => "is left out".to_owned(),
        }
    }

    /// Signals that a computed stand-in is computed from.
    #[must_use]
    pub fn sources(self) -> &'static [&'static str] {
        match self {
            StandIn::Value(_) | StandIn::Mean(_) | StandIn::Typical { .. } | StandIn::Absent => &[],
            StandIn::MachOfVelocity | StandIn::PressureOfVelocity => &[s::VELOCITY, s::ALTITUDE],
            StandIn::VelocityOfMach => &[s::MACH, s::ALTITUDE],
            StandIn::VelocityOfPressure => &[s::QBAR, s::ALTITUDE],
            StandIn::AltitudeOfPressure => &[s::VELOCITY, s::QBAR],
            StandIn::ThetaOfAlpha => &[s::ALPHA_VANE],
            StandIn::InertiaOf(Inertia::Pitch) => &[s::IY],
            StandIn::InertiaOf(Inertia::Yaw) => &[s::IZ],
        }
    }

    /// Value at a sample from the values of the sources, at the air's temperature (K). The standard
    /// atmosphere gives the temperature if it is not finite.
    fn value(self, sources: &[f64], kelvin: f64) -> f64 {
        let [a, b] = [0, 1].map(|i| sources.get(i).copied().unwrap_or(f64::NAN));
        let air = |altitude_ft: f64| air(altitude_ft).at_temperature(kelvin);
        match self {
            StandIn::Value(value) | StandIn::Mean(value) | StandIn::Typical { mean: value, .. } => {
                value
            }
            StandIn::MachOfVelocity => a / air(b).sound_ft_s,
            StandIn::VelocityOfMach => a * air(b).sound_ft_s,
            StandIn::VelocityOfPressure => (2.0 * a / air(b).density_slug_ft3).sqrt(),
            StandIn::PressureOfVelocity => 0.5 * air(b).density_slug_ft3 * a * a,
            StandIn::AltitudeOfPressure => altitude_ft(2.0 * b / (a * a), kelvin),
            StandIn::ThetaOfAlpha | StandIn::InertiaOf(_) => a,
            StandIn::Absent => f64::NAN,
        }
    }

    /// Puts the stand-in in the place of the signal.
    pub fn fill(self, signal: &str, record: &mut Record) {
        if self == StandIn::Absent {
            record.signals.remove(signal);
            return;
        }
        if let Some(values) = self.values(record) {
            record
                .signals
                .insert(signal.to_owned(), Series::assumed(values));
        }
        if let StandIn::Typical { deviation, .. } = self {
            let errors = RemainingErrors {
                bias: Some(RemainingError::corrected(deviation)),
                scale: None,
            };
            record.remaining_errors.insert(signal.to_owned(), errors);
        }
    }

    /// Puts the stand-in in the place of the samples of the signal without a value.
    fn fill_gaps(self, signal: &str, record: &mut Record) {
        let Some(stand_in) = self.values(record) else {
            return;
        };
        if let Some(series) = record.signals.get_mut(signal) {
            let own = series.values.iter_mut().zip(&mut series.marks);
            for ((value, mark), assumed) in own.zip(stand_in) {
                if value.is_nan() && assumed.is_finite() {
                    (*value, *mark) = (assumed, Mark::Assumed);
                }
            }
        }
    }

    /// Values at all samples of a record; `None` if the record lacks a source.
    fn values(self, record: &Record) -> Option<Vec<f64>> {
        let sources = self.sources().iter().map(|name| record.values(name));
        let sources: Vec<&[f64]> = sources.collect::<Option<_>>()?;
        let temperatures = record.values(s::AIR_TEMPERATURE);
        let value = |k: usize| {
            let at_sample: Vec<f64> = sources.iter().map(|values| values[k]).collect();
            let kelvin = temperatures.map_or(f64::NAN, |values| values[k]);
            self.value(&at_sample, kelvin)
        };
        Some((0..record.samples).map(value).collect())
    }
}

/// `true` for a signal of a record without a value at some sample.
fn has_gap(signal: &str, record: &Record) -> bool {
    let mut values = record.values(signal).into_iter().flatten();
    values.any(|value| value.is_nan())
}

/// Part of a record in which a stand-in takes the place of a signal with gaps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GapExtent {
    /// The samples without a value.
    Samples,
    /// The whole record that is read, as for a signal that is not recorded. A maneuver then has one
    /// source of the signal throughout.
    WholePart,
}

/// Stand-ins that complete the record of a flight.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Completion {
    /// Stand-ins of the signals that the flight lacks, in the order in which they are computed.
    pub stand_ins: Vec<(String, StandIn)>,
    /// Stand-ins in the gaps of recorded signals, in the order in which they are computed.
    pub gaps: Vec<(String, StandIn)>,
}

impl Completion {
    /// Completes a record.
    pub fn apply(&self, record: &mut Record, extent: GapExtent) {
        let is_first = |signal: &str| FIRST.contains(&signal);
        let fill_gaps = |record: &mut Record, first: bool| {
            for (signal, stand_in) in self.gaps.iter().filter(|(s, _)| is_first(s) == first) {
                if has_gap(signal, record) {
                    match extent {
                        GapExtent::Samples => stand_in.fill_gaps(signal, record),
                        GapExtent::WholePart => stand_in.fill(signal, record),
                    }
                }
            }
        };
        fill_gaps(record, true);
        for (signal, stand_in) in &self.stand_ins {
            stand_in.fill(signal, record);
        }
        fill_gaps(record, false);
    }

    /// Signals from which the stand-ins are computed.
    pub fn sources(&self) -> impl Iterator<Item = &'static str> {
        let all = self.stand_ins.iter().chain(&self.gaps);
        let sources = all.flat_map(|(_, stand_in)| stand_in.sources());
        let is_any = !self.stand_ins.is_empty() || !self.gaps.is_empty();
        let temperature = is_any.then_some(s::AIR_TEMPERATURE);
        sources.copied().chain(temperature)
    }
}

/// Altitudes between which a density is looked for, ft.
const ALTITUDES_FT: (f64, f64) = (-2_000.0, 100_000.0);

/// Halvings of that range: to less than a thousandth of a foot.
const HALVINGS: usize = 28;

/// Altitude at which the air has a density, ft, at the air's temperature (K). The standard
/// atmosphere gives the temperature if it is not finite. NaN for a density of no altitude.
fn altitude_ft(density_slug_ft3: f64, kelvin: f64) -> f64 {
    let (low, high) = ALTITUDES_FT;
    let density = |altitude_ft: f64| air(altitude_ft).at_temperature(kelvin).density_slug_ft3;
    let is_inside = density(high) <= density_slug_ft3 && density_slug_ft3 <= density(low);
    if !is_inside {
        return f64::NAN;
    }
    let is_denser = |altitude_ft| density(altitude_ft) > density_slug_ft3;
    let (low, high) = last_that_holds(ALTITUDES_FT, HALVINGS, is_denser);
    0.5 * (low + high)
}

/// Order in which stand-ins are computed: each after those that it may be computed from.
const FIRST: [&str; 2] = [s::VELOCITY, s::ALTITUDE];

/// Signals whose gaps a stand-in fills. The states and outputs of the equations of motion are not among
/// them: a maneuver needs their measurements.
const WITH_FILLED_GAPS: [&str; 8] = [
    s::VELOCITY,
    s::ALTITUDE,
    s::MACH,
    s::QBAR,
    s::RPM_LEFT,
    s::RPM_RIGHT,
    s::IXZ,
    s::THRUST,
];

/// Signals of [`WITH_FILLED_GAPS`] that change little within a flight. In a gap their mean is
/// closer than the stand-in for a signal that is never recorded.
const NEARLY_CONSTANT: [&str; 3] = [s::RPM_LEFT, s::RPM_RIGHT, s::IXZ];

/// Stand-ins in the gaps of recorded signals, in the order in which they are computed.
/// `is_complete` is `true` for a signal that is given as a constant or recorded without a gap;
/// `mean_and_deviation` returns those of a signal's finite samples.
#[must_use]
pub fn gap_stand_ins(
    with_gaps: &[&str],
    is_complete: impl Fn(&str) -> bool,
    mean_and_deviation: impl Fn(&str) -> Option<(f64, f64)>,
) -> Vec<(String, StandIn)> {
    let filled = WITH_FILLED_GAPS.iter().filter(|s| with_gaps.contains(s));
    let stand_in = |signal: &&str| {
        let stand_in = if NEARLY_CONSTANT.contains(signal) {
            StandIn::Mean(mean_and_deviation(signal)?.0)
        } else if *signal == s::THRUST {
            let (mean, deviation) = mean_and_deviation(signal)?;
            StandIn::Typical { mean, deviation }
        } else {
            StandIn::of(signal, &is_complete)?
        };
        Some(((*signal).to_owned(), stand_in))
    };
    filled.filter_map(stand_in).collect()
}

/// Stand-ins of the required signals that a flight lacks, in the order in which they are computed.
/// `has` is `true` for a signal that is recorded or given as a constant.
///
/// # Errors
/// The first required signal that can have no stand-in.
pub fn stand_ins(has: impl Fn(&str) -> bool) -> Result<Vec<(String, StandIn)>, &'static str> {
    let others = s::REQUIRED.iter().filter(|name| !FIRST.contains(name));
    let lacking = FIRST.iter().chain(others).filter(|name| !has(name));
    let of_signal = |name: &&'static str| match StandIn::of(name, &has) {
        Some(stand_in) => Ok(((*name).to_owned(), stand_in)),
        None => Err(*name),
    };
    lacking.map(of_signal).collect()
}

/// Consequence of a missing signal for the results, as text for the user. `has` is `true` for a
/// signal that is recorded or given as a constant.
#[must_use]
pub fn consequence_of_absence(signal: &str, has: impl Fn(&str) -> bool) -> &'static str {
    let has_all = |signals: &[&str]| signals.iter().all(|signal| has(signal));
    match signal {
        s::RPM_LEFT | s::RPM_RIGHT => {
            "the gyroscopic moment of this engine is charged to the moments of q and r"
        }
        s::THRUST => {
            "the constant of CA is that of the axial force less the thrust, and the CN derivatives take its part \
             across the path; bounds contain it only if `instruments: thrust_lbf: uncertainty: { bias: … }` of \
             aircraft.yaml states how large it may be"
        }
        s::IXZ => {
            "roll and yaw are taken as uncoupled: Cl and Cn derivatives take a share of each other"
        }
        s::IX | s::IY | s::IZ => {
            "nothing turns about the axes of the states that are not recorded, so it has no effect"
        }
        s::MACH => "tunnel tables over Mach are read at the standard atmosphere's",
        s::VELOCITY | s::QBAR => {
            "every derivative has the error of the standard atmosphere and of the other air data"
        }
        s::ALTITUDE => "gravity and the density have the error of the other air data",
        s::PSI => "the errors of the other instruments are found with larger bounds",
        s::AIR_TEMPERATURE => {
            "the air has the temperature of the standard atmosphere: q̄ and Mach are not compared with V on a warm or cold day"
        }
        s::AY if has_all(&LATERAL) => {
            "the CY derivatives follow from the motion of beta alone, with larger bounds"
        }
        s::AN if has_all(&LONGITUDINAL) => {
            "the CN derivatives follow from the motion of alpha alone, with larger bounds"
        }
        s::AX if has_all(&LONGITUDINAL) => {
            "the CA derivatives are not estimated: they are held at the tunnel's values, and count as zero without one"
        }
        signal if LATERAL.contains(&signal) || signal == s::AY => {
            "there are no lateral derivatives; the longitudinal ones take level wings without sideslip"
        }
        signal if LONGITUDINAL.contains(&signal) || [s::AN, s::AX].contains(&signal) => {
            "there are no longitudinal derivatives; the lateral ones take level flight"
        }
        _ => "nothing stands for it",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Test for the signals of a recorder that has all required ones except some.
    fn all_but<'a>(missing: &'a [&'a str]) -> impl Fn(&str) -> bool + 'a {
        move |signal| s::REQUIRED.contains(&signal) && !missing.contains(&signal)
    }

    fn record(signals: &[(&str, f64)]) -> Record {
        let series = |value: f64| Series {
            values: vec![value; 3],
            marks: vec![Mark::Measured; 3],
        };
        Record {
            flight_id: "f".to_owned(),
            start_s: 0.0,
            step_s: 0.02,
            samples: 3,
            signals: signals
                .iter()
                .map(|(name, value)| ((*name).to_owned(), series(*value)))
                .collect(),
            remaining_errors: [].into(),
        }
    }

    #[test]
    fn one_axis_can_be_assumed_but_not_both() {
        let level = StandIn::of(s::PHI, all_but(&[s::PHI, s::P]));
        assert_eq!(level, Some(StandIn::Value(0.0)));
        assert_eq!(
            StandIn::of(s::THETA, all_but(&[s::THETA, s::Q])),
            Some(StandIn::ThetaOfAlpha)
        );
        let neither = [s::PHI, s::THETA];
        assert_eq!(StandIn::of(s::PHI, all_but(&neither)), None);
        assert_eq!(StandIn::of(s::THETA, all_but(&neither)), None);
        for needed in [s::MASS, s::IX, s::IY, s::IZ, s::X_CG, s::ALPHA_VANE] {
            assert_eq!(StandIn::of(needed, all_but(&[needed])), None, "{needed}");
        }
    }

    #[test]
    fn an_axis_without_states_needs_no_inertia_of_its_own() {
        let of = |signal: &str, missing: &[&str]| StandIn::of(signal, all_but(missing));
        let lateral = [&LATERAL[..], &[s::IX, s::IZ]].concat();
        let pitch = Some(StandIn::InertiaOf(Inertia::Pitch));
        assert_eq!([s::IX, s::IZ].map(|ix| of(ix, &lateral)), [pitch; 2]);
        let longitudinal = [&LONGITUDINAL[..], &[s::IY]].concat();
        assert_eq!(
            of(s::IY, &longitudinal),
            Some(StandIn::InertiaOf(Inertia::Yaw))
        );
        // A state that is recorded turns the aircraft.
        let with_p: Vec<&str> = lateral
            .iter()
            .copied()
            .filter(|name| *name != s::P)
            .collect();
        assert_eq!(of(s::IX, &with_p), None);
        assert_eq!(of(s::IX, &[&lateral[..], &[s::IY]].concat()), None);
    }

    #[test]
    fn an_acceleration_costs_its_own_derivatives_and_no_axis_while_the_states_are_recorded() {
        let all = [s::AN, s::AX, s::AY];
        for (absent, coefficient) in all.into_iter().zip(["CN", "CA", "CY"]) {
            assert!(StandIn::of(absent, all_but(&all)).is_some(), "{absent}");
            let alone = consequence_of_absence(absent, all_but(&[absent]));
            assert!(alone.contains(coefficient), "{alone}");
        }
        let with_axis = consequence_of_absence(s::AY, all_but(&[s::AY, s::BETA_VANE]));
        assert_eq!(with_axis, consequence_of_absence(s::P, all_but(&[s::P])));
    }

    #[test]
    fn air_data_follow_from_each_other() {
        // 25,000 ft: density 0.00106525 slug/ft3 and sound 1016.1 ft/s (U.S. Standard Atmosphere).
        let (altitude, velocity) = (25_000.0, 500.0);
        let qbar = 0.5 * air(altitude).density_slug_ft3 * velocity * velocity;
        let mach = velocity / air(altitude).sound_ft_s;
        assert_relative_eq!(qbar, 0.5 * 0.001_065_25 * 250_000.0, max_relative = 1e-3);
        let all = [
            (s::ALTITUDE, altitude),
            (s::VELOCITY, velocity),
            (s::QBAR, qbar),
            (s::MACH, mach),
        ];
        for (lacking, truth) in all {
            let given: Vec<(&str, f64)> = all.into_iter().filter(|(n, _)| *n != lacking).collect();
            let mut record = record(&given);
            StandIn::of(lacking, all_but(&[lacking]))
                .unwrap()
                .fill(lacking, &mut record);
            assert_relative_eq!(
                record.values(lacking).unwrap()[1],
                truth,
                max_relative = 1e-6
            );
            assert_eq!(record.signals[lacking].marks[1], Mark::Assumed);
        }
    }

    #[test]
    fn a_recorded_temperature_replaces_that_of_the_standard_atmosphere() {
        let (altitude, velocity, kelvin) = (25_000.0, 500.0, 263.6);
        // p = 786.33 lbf/ft² at 25,000 ft; R = 1716.56 ft lbf/(slug °R), γ = 1.4; °R = 1.8 K.
        let density = 786.33 / (1_716.56 * 1.8 * kelvin);
        let sound = f64::sqrt(1.4 * 1_716.56 * 1.8 * kelvin);
        let all = [
            (s::ALTITUDE, altitude),
            (s::VELOCITY, velocity),
            (s::QBAR, 0.5 * density * velocity * velocity),
            (s::MACH, velocity / sound),
        ];
        for (lacking, truth) in all {
            let mut given: Vec<(&str, f64)> =
                all.into_iter().filter(|(n, _)| *n != lacking).collect();
            given.push((s::AIR_TEMPERATURE, kelvin));
            let mut record = record(&given);
            let stand_in = StandIn::of(lacking, all_but(&[lacking])).unwrap();
            stand_in.fill(lacking, &mut record);
            let value = record.values(lacking).unwrap()[1];
            assert_relative_eq!(value, truth, max_relative = 1e-3);
        }
    }

    /// Record of three samples whose last value of a signal is missing, and the completion for it.
    fn with_gap(signal: &str) -> (Record, Completion) {
        let mut record = record(&[(s::ALTITUDE, 25_000.0), (s::VELOCITY, 500.0), (signal, 0.5)]);
        let series = record.signals.get_mut(signal).unwrap();
        (series.values[2], series.marks[2]) = (f64::NAN, Mark::Missing);
        let completion = Completion {
            stand_ins: vec![],
            gaps: gap_stand_ins(&[signal], all_but(&[signal]), |_| Some((0.75, 0.25))),
        };
        (record, completion)
    }

    #[test]
    fn a_gap_is_filled_sample_by_sample_and_in_a_maneuver_throughout() {
        for (signal, assumed) in [(s::MACH, 500.0 / air(25_000.0).sound_ft_s), (s::IXZ, 0.75)] {
            let (record, completion) = with_gap(signal);
            let completed = |extent: GapExtent| {
                let mut record = record.clone();
                completion.apply(&mut record, extent);
                record.signals[signal].clone()
            };
            let by_sample = completed(GapExtent::Samples);
            assert_eq!(by_sample.values, [0.5, 0.5, assumed], "{signal}");
            assert_eq!(
                by_sample.marks,
                [Mark::Measured, Mark::Measured, Mark::Assumed]
            );
            assert_eq!(
                completed(GapExtent::WholePart),
                Series::assumed(vec![assumed; 3])
            );
        }
    }

    #[test]
    fn a_gap_of_the_thrust_leaves_its_scatter_as_an_error_of_the_maneuver() {
        let (mut record, completion) = with_gap(s::THRUST);
        completion.apply(&mut record, GapExtent::WholePart);
        assert_eq!(record.signals[s::THRUST], Series::assumed(vec![0.75; 3]));
        let bias = record.remaining_errors[s::THRUST].bias;
        assert_eq!(bias, Some(RemainingError::corrected(0.25)));
        let words = completion.gaps[0].1.in_words();
        assert!(words.contains("0.75 ± 0.25"), "{words}");
    }

    #[test]
    fn a_part_without_a_gap_keeps_what_was_recorded() {
        let (mut record, completion) = with_gap(s::MACH);
        record = record.cut(None, 0..2);
        let before = record.clone();
        completion.apply(&mut record, GapExtent::WholePart);
        assert_eq!(record, before);
    }

    #[test]
    fn gaps_of_states_and_of_signals_without_a_complete_source_stay() {
        let stand_ins = |with_gaps: &[&str], incomplete: &[&str]| {
            let stand_ins =
                gap_stand_ins(with_gaps, all_but(incomplete), |_| Some((-2000.0, 90.0)));
            stand_ins.into_iter()
        };
        let needed = [s::THETA, s::AN, s::MASS];
        assert_eq!(stand_ins(&needed, &needed).count(), 0);
        // Mach and V give each other.
        let neither = [s::MACH, s::VELOCITY, s::QBAR];
        assert_eq!(stand_ins(&[s::MACH, s::VELOCITY], &neither).count(), 0);
        let both = [s::MACH, s::ALTITUDE];
        let names: Vec<String> = stand_ins(&both, &both).map(|(name, _)| name).collect();
        assert_eq!(names, [s::ALTITUDE, s::MACH]);
        let inertia = stand_ins(&[s::IXZ], &[s::IXZ]).next().unwrap();
        assert_eq!(inertia.1, StandIn::Mean(-2000.0));
        assert_eq!(
            inertia.1.in_words(),
            "is taken as -2000, its mean where it is recorded"
        );
    }

    #[test]
    fn a_density_of_no_altitude_has_no_altitude() {
        assert!(altitude_ft(1.0, f64::NAN).is_nan() && altitude_ft(f64::NAN, 250.0).is_nan());
    }
}
