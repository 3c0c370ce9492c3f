//! Findings on all instruments of a flight: rows of the table `instruments`, problems, and the
//! corrections of the record.

mod instrument_finding;

use std::collections::BTreeMap;

pub use instrument_finding::InstrumentFinding;

use super::error_estimates::{ErrorEvidence, has_estimate_at_limit, withdraw_corrections};
use super::joint_fit::FittedErrors;
use super::parameters::{INSTRUMENTS, Kind};
use super::row_correction::correction;
use super::settings::Compatibility;
use super::vane_positions::VanePosition;
use crate::error::{Problem, ProblemStage};
use crate::flight::{Channel, Correction, signal};
use crate::tables::InstrumentRow;

/// Least relative difference of the temperature from the standard atmosphere's that is named: 5 K,
/// by which the derivatives change less than by an ordinary error of q̄.
const LEAST_AIR_DIFFERENCE: f64 = 0.02;

/// Largest relative difference of the temperature: the extremes on record (MIL-STD-210C) are within 20 %
/// of the standard atmosphere's.
const LARGEST_AIR_DIFFERENCE: f64 = 0.2;

/// Size of both scale errors from which they are certain, and difference up to which they agree, in
/// bounds.
const SURE_BOUNDS: f64 = 4.0;
const AGREEING_BOUNDS: f64 = 3.0;

/// Findings on all recorded instruments of a flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings(pub Vec<InstrumentFinding>);

impl Findings {
    /// Findings for each recorded instrument from the fitted errors.
    #[must_use]
    pub fn of(
        errors: Option<&FittedErrors>,
        channels: &BTreeMap<String, Channel>,
        recorded: &[String],
        settings: &Compatibility,
    ) -> Findings {
        let finding = |i| InstrumentFinding::of(i, errors, channels, recorded, settings);
        let mut findings = Findings((0..INSTRUMENTS).filter_map(finding).collect());
        if !recorded.iter().any(|s| s == signal::AIR_TEMPERATURE) {
            findings.leave_to_air_temperature();
        }
        findings
    }

    /// Withdraws corrections of q̄ and Mach whose scale errors are those of another temperature of the
    /// air than the standard atmosphere's.
    fn leave_to_air_temperature(&mut self) {
        let Some(temperature) = self.air_temperature() else {
            return;
        };
        for finding in &mut self.0 {
            if [signal::QBAR, signal::MACH].contains(&finding.signal) {
                finding.air_temperature = Some(temperature);
                for estimate in finding.estimates.iter_mut().flatten() {
                    (estimate.applied, estimate.fault) = (false, false);
                }
            }
        }
    }

    /// Temperature of the air over the standard atmosphere's, if it explains the scale errors of both
    /// q̄ and Mach. With T times that temperature, q̄ at a speed and a pressure altitude is 1/T times as
    /// large, and Mach 1/√T times.
    fn air_temperature(&self) -> Option<f64> {
        let scale = |signal: &str| {
            let finding = self.0.iter().find(|f| f.signal == signal)?;
            finding.estimates[Kind::Scale as usize]
        };
        let (pressure, mach) = (scale(signal::QBAR)?, scale(signal::MACH)?);
        let (by_pressure, by_mach) = (-pressure.value.ln_1p(), -2.0 * mach.value.ln_1p());
        let bound = pressure.bound.hypot(2.0 * mach.bound);
        let is_sure =
            |log: f64, bound: f64| log.abs() > LEAST_AIR_DIFFERENCE.max(SURE_BOUNDS * bound);
        let agree = (by_pressure - by_mach).abs() <= AGREEING_BOUNDS * bound;
        let is_air = is_sure(by_pressure, pressure.bound) && is_sure(by_mach, 2.0 * mach.bound);
        let is_possible = by_pressure.abs() < LARGEST_AIR_DIFFERENCE;
        (is_air && agree && is_possible).then(|| by_pressure.exp())
    }

    /// These findings with vanes at other positions than the stated ones.
    #[must_use]
    pub fn with_positions(mut self, positions: &[VanePosition]) -> Findings {
        for finding in &mut self.0 {
            let own = positions.iter().find(|p| p.signal == finding.signal);
            finding.ahead_ft = own.map(|position| position.ahead_ft);
        }
        self
    }

    /// `true` if a vane is at another position than the stated one.
    #[must_use]
    pub fn has_moved_vane(&self) -> bool {
        self.0.iter().any(|finding| finding.ahead_ft.is_some())
    }

    /// `true` if an instrument has a fault.
    #[must_use]
    pub fn has_fault(&self) -> bool {
        self.0.iter().any(InstrumentFinding::has_fault)
    }

    /// `true` if an instrument that the equations of motion need has a fault.
    #[must_use]
    pub fn has_required_fault(&self) -> bool {
        self.0
            .iter()
            .any(|f| signal::is_indispensable(f.signal) && f.has_fault())
    }

    /// These findings with every fault corrected.
    #[must_use]
    pub fn with_faults_corrected(&self) -> Findings {
        let mut corrected = self.clone();
        for finding in &mut corrected.0 {
            let is_usable = !has_estimate_at_limit(&finding.estimates);
            for estimate in finding.estimates.iter_mut().flatten() {
                estimate.applied |= estimate.fault && is_usable;
            }
        }
        corrected
    }

    /// These findings with every fault marked as doubtful: neither named nor corrected.
    #[must_use]
    pub fn without_faults(mut self) -> Findings {
        let estimates = self
            .0
            .iter_mut()
            .flat_map(|f| f.estimates.iter_mut().flatten());
        for estimate in estimates.filter(|estimate| estimate.fault) {
            estimate.doubtful = true;
            estimate.fault = false;
            estimate.applied = false;
        }
        self
    }

    /// These findings with nothing corrected.
    #[must_use]
    pub fn without_corrections(mut self) -> Findings {
        for finding in &mut self.0 {
            withdraw_corrections(&mut finding.estimates);
        }
        self
    }

    /// Signals whose scale error is at the limit of its search, each with the fault in words: no error
    /// of an instrument explains their values.
    pub fn inexplicable(&self) -> impl Iterator<Item = (&'static str, String)> {
        let scale = |f: &InstrumentFinding| f.estimates[Kind::Scale as usize];
        let inexplicable = self
            .0
            .iter()
            .filter(move |f| scale(f).is_some_and(|e| e.at_limit));
        inexplicable.map(|f| (f.signal, f.fault_sentence()))
    }

    /// Corrections of the record, and the errors that remain.
    #[must_use]
    pub fn corrections(&self, settings: &Compatibility) -> Vec<Correction> {
        let rows = self.rows("").into_iter();
        rows.filter_map(|row| correction(&row, settings)).collect()
    }

    /// Rows of the table `instruments`.
    #[must_use]
    pub fn rows(&self, flight_id: &str) -> Vec<InstrumentRow> {
        self.0.iter().map(|f| f.row(flight_id)).collect()
    }

    /// Evidence of the flight alone on the errors of its instruments.
    #[must_use]
    pub fn evidence(&self) -> Vec<ErrorEvidence> {
        self.0.iter().flat_map(|f| f.evidence.clone()).collect()
    }

    /// A problem for each instrument with a fault.
    #[must_use]
    pub fn problems(&self, flight_id: &str) -> Vec<Problem> {
        let reason = |f: &InstrumentFinding| {
            if f.has_fault() {
                return Some(format!("{}; {}", f.fault_sentence(), f.consequence()));
            }
            f.air_sentence()
        };
        let problem = |f: &InstrumentFinding| {
            Some(Problem {
                stage: ProblemStage::Ingest,
                flight_id: flight_id.to_owned(),
                place: format!("channel `{}`", f.channel),
                reason: reason(f)?,
            })
        };
        self.0.iter().filter_map(problem).collect()
    }

    /// All faults in one sentence; `None` without a fault.
    #[must_use]
    pub fn fault_summary(&self) -> Option<String> {
        let all: Vec<String> = self
            .0
            .iter()
            .filter(|f| f.has_fault())
            .map(InstrumentFinding::fault_sentence)
            .collect();
        (!all.is_empty()).then(|| all.join("; "))
    }

    /// Faults of the channel of a signal, in words.
    #[must_use]
    pub fn verdict(&self, signal: &str) -> Option<String> {
        let finding = self.0.iter().find(|f| f.signal == signal)?;
        let faults = finding.faults();
        (!faults.is_empty()).then(|| faults.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::super::error_estimates::tests::errors;
    use super::super::parameters::{SIGNALS, place};
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn no_error_of_an_instrument_is_corrected_beside_one_at_the_limit_of_its_search() {
        let mach = SIGNALS.iter().position(|s| *s == signal::MACH).unwrap();
        let settings = Compatibility::default();
        let of_scale = |scale: f64| {
            let mut errors = errors(place(mach, Kind::Bias), 0.35, 0.002);
            errors.values[place(mach, Kind::Scale)] = scale;
            let channel = Channel::plain(signal::MACH, "1");
            let channels = BTreeMap::from([("mach".to_owned(), channel)]);
            let recorded = [signal::MACH.to_owned()];
            Findings::of(Some(&errors), &channels, &recorded, &settings)
        };
        let at_limit = of_scale(-0.8);
        assert_eq!(at_limit.corrections(&settings), []);
        assert_eq!(at_limit.with_faults_corrected().corrections(&settings), []);
        let problem = &at_limit.problems("f")[0].reason;
        assert!(problem.contains("left as recorded"), "{problem}");
        let inexplicable: Vec<_> = at_limit.inexplicable().map(|(name, _)| name).collect();
        assert_eq!(inexplicable, [signal::MACH]);
        let inside = of_scale(-0.4);
        assert_eq!(inside.corrections(&settings).len(), 1);
        assert_eq!(inside.inexplicable().count(), 0);
    }

    #[test]
    fn scale_errors_of_a_warm_day_correct_nothing_and_name_the_temperature() {
        let instrument = |signal: &str| SIGNALS.iter().position(|s| *s == signal).unwrap();
        let of_scales = |pressure: f64, mach: f64, others: &[&str]| {
            let j = place(instrument(signal::QBAR), Kind::Scale);
            let mut errors = errors(j, pressure, 0.002);
            errors.values[place(instrument(signal::MACH), Kind::Scale)] = mach;
            let channels = [signal::QBAR, signal::MACH]
                .map(|signal| (signal.to_owned(), Channel::plain(signal, "1")));
            let recorded = [signal::QBAR, signal::MACH].iter().chain(others);
            let recorded: Vec<String> = recorded.map(|s| (*s).to_owned()).collect();
            let settings = Compatibility::default();
            Findings::of(
                Some(&errors),
                &BTreeMap::from(channels),
                &recorded,
                &settings,
            )
        };
        let scales = |findings: &Findings| {
            let of = |c: &Correction| (c.signal.clone(), c.scale);
            findings
                .corrections(&Compatibility::default())
                .iter()
                .filter(|correction| correction.changes_values())
                .map(of)
                .collect::<Vec<_>>()
        };
        // 10 % warmer.
        let (pressure, mach) = (1.0 / 1.1 - 1.0, 1.0 / f64::sqrt(1.1) - 1.0);
        let warm = of_scales(pressure, mach, &[]);
        assert_eq!(scales(&warm), []);
        let problem = &warm.problems("f")[0];
        assert!(problem.reason.contains("110 %"), "{problem:?}");
        let recorded = of_scales(pressure, mach, &[signal::AIR_TEMPERATURE]);
        assert_eq!(scales(&recorded).len(), 2);
        let of_one_instrument = of_scales(pressure, 0.0, &[]);
        assert_relative_eq!(scales(&of_one_instrument)[0].1, pressure);
    }
}
