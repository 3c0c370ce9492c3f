//! A maneuver prepared for equation error in the frequency domain: spectra of the coefficients that
//! the measured motion implies, and of their regressors.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use nalgebra::Complex;

use super::fourier::{Band, DelayedSpectrum, Spectrum};
use crate::aero::{AeroModel, Axis, Derivative, Regressor, WindTunnel};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::{ManeuverSignals, MassProperties, slope_reach};
use crate::dynamics::{COEFFICIENTS, Equations, Lateral, Longitudinal};
use crate::flight::{Record, signal};
use crate::maneuver::Maneuver;
use crate::output_error::{Case, InitialState, Measurements, Model};

/// A maneuver in the frequency domain.
#[derive(Clone, Debug)]
pub struct ManeuverData {
    pub frequencies_hz: Vec<f64>,
    /// Signals of the surfaces that act in the maneuver's axis.
    pub surfaces: Vec<String>,
    pub coefficients: Vec<CoefficientData>,
}

/// One coefficient of the build-up.
#[derive(Clone, Debug)]
pub struct CoefficientData {
    /// Coefficient that the measured motion implies.
    pub implied: Spectrum,
    pub terms: Vec<TermData>,
}

/// One derivative of the build-up.
#[derive(Clone, Debug)]
pub struct TermData {
    pub regressor: DelayedSpectrum,
    /// Index of its surface.
    pub surface: Option<usize>,
    /// Tunnel's value.
    pub tunnel: Option<f64>,
    /// Root mean square of the tunnel's table; zero without a table.
    pub size: f64,
}

/// Aircraft, model and tunnel of a campaign.
#[derive(Clone, Copy, Debug)]
pub struct AircraftModel<'a> {
    pub aircraft: &'a Aircraft,
    pub aero_model: &'a AeroModel,
    pub tunnel: &'a WindTunnel,
}

impl ManeuverData {
    /// Prepares a maneuver; `None` if it is too short or a signal is missing.
    pub fn new(record: &Record, maneuver: &Maneuver, basis: AircraftModel) -> Option<ManeuverData> {
        match maneuver.axis {
            Axis::Longitudinal => Self::of_axis::<3, Longitudinal>(record, maneuver, basis),
            Axis::Lateral => Self::of_axis::<4, Lateral>(record, maneuver, basis),
        }
    }

    fn of_axis<const NX: usize, E: Equations<NX>>(
        record: &Record,
        maneuver: &Maneuver,
        basis: AircraftModel,
    ) -> Option<ManeuverData> {
        let range = record.sample_at(maneuver.start_s)..record.sample_at(maneuver.end_s) + 1;
        let band = Band::new(range.len(), record.step_s)?;
        let derivatives = derivatives(record, E::AXIS, basis.aero_model);
        let surfaces = surfaces_of(&derivatives);
        let signals = surfaces.iter().map(String::as_str);
        let signals = ManeuverSignals::cut(
            basis.aircraft,
            record,
            range,
            signals,
            MassProperties::Recorded,
        )
        .ok()?;
        let model = Model {
            free: derivatives,
            initial_state: InitialState::Measured,
            ..Model::default()
        };
        let case = Case::<NX, E>::new(basis.aircraft, &signals, Measurements::default(), &model);
        let regressors = regressors(&band, &case);
        let condition = maneuver.condition(basis.tunnel);
        let term = |j: usize| {
            let derivative = basis.aero_model.derivative(&case.names[j])?;
            let regressor = regressors.get(&case.terms[j].column)?;
            let tunnel = basis.tunnel.at(&derivative.name, &condition);
            Some(TermData {
                regressor: regressor.clone(),
                surface: surface_index(derivative, &surfaces),
                tunnel: tunnel.map(|reading| reading.value),
                size: basis.tunnel.root_mean_square(&derivative.name),
            })
        };
        let is_measured = |k: usize| {
            let accelerometer = E::AXIS.coefficients()[k].accelerometer();
            accelerometer.is_none_or(|output| !record.is_assumed(output.signal()))
        };
        let implied = implied_spectra(&band, &case, record.step_s).into_iter();
        let measured = implied.enumerate().filter(|(k, _)| is_measured(*k));
        let coefficients = measured.map(|(k, implied)| CoefficientData {
            implied,
            terms: case.ranges[k].clone().filter_map(&term).collect(),
        });
        Some(ManeuverData {
            frequencies_hz: band.frequencies_hz(),
            coefficients: coefficients.collect(),
            surfaces,
        })
    }
}

/// Spectra of the coefficients that the measured motion implies. Moments follow from slopes of the
/// rates, whose response to frequency is removed.
fn implied_spectra<const NX: usize, E: Equations<NX>>(
    band: &Band,
    case: &Case<NX, E>,
    step_s: f64,
) -> Vec<Vec<Complex<f64>>> {
    let implied = |k: usize| case.motion.implied.iter().map(|c| c[k]).collect();
    let implied: Vec<Vec<f64>> = (0..COEFFICIENTS).map(implied).collect();
    let slope_response = slope_response(&band.frequencies_hz(), step_s);
    let mut spectra = band.spectra(&implied);
    for (spectrum, coefficient) in spectra.iter_mut().zip(E::AXIS.coefficients()) {
        if coefficient.is_moment() {
            divide(spectrum, &slope_response);
        }
    }
    spectra
}

/// Spectra of the distinct columns of regressors.
fn regressors<const NX: usize, E: Equations<NX>>(
    band: &Band,
    case: &Case<NX, E>,
) -> BTreeMap<usize, DelayedSpectrum> {
    let columns = case.terms.iter().enumerate();
    let first: BTreeMap<usize, usize> = columns.rev().map(|(j, term)| (term.column, j)).collect();
    let series: Vec<Vec<f64>> = first
        .values()
        .map(|j| case.measured_regressor(*j))
        .collect();
    first.into_keys().zip(band.shifted(&series)).collect()
}

/// Derivatives of an axis without the constants, which the mean removes, and without those whose
/// regressors follow from signals that are not recorded.
fn derivatives<'a>(record: &Record, axis: Axis, aero_model: &'a AeroModel) -> Vec<&'a Derivative> {
    let has_alpha_rate = [signal::AN, signal::AX]
        .iter()
        .all(|s| record.is_recorded(s));
    let is_recorded = |d: &&Derivative| {
        let mut signals = d.regressor.signals();
        let has_regressor = has_alpha_rate || !d.regressor.has_alpha_rate();
        has_regressor && signals.all(|s| record.signals.contains_key(s))
    };
    aero_model
        .derivatives_of(axis)
        .filter(|d| d.regressor != Regressor::Constant)
        .filter(is_recorded)
        .collect()
}

/// Signals of the surfaces of derivatives, sorted.
fn surfaces_of(derivatives: &[&Derivative]) -> Vec<String> {
    let surfaces = derivatives.iter().filter_map(|d| d.regressor.surface());
    let mut surfaces: Vec<String> = surfaces.map(str::to_owned).collect();
    surfaces.sort_unstable();
    surfaces.dedup();
    surfaces
}

fn surface_index(derivative: &Derivative, surfaces: &[String]) -> Option<usize> {
    let surface = derivative.regressor.surface()?;
    surfaces.iter().position(|s| s == surface)
}

/// Frequency response of the slope of a local straight line, over the response of exact
/// differentiation. The ratio is real, because the line is symmetric about its sample, so the slope
/// has the right phase.
fn slope_response(frequencies_hz: &[f64], step_s: f64) -> Vec<f64> {
    let reach = slope_reach(step_s);
    let response = |frequency_hz: &f64| {
        let angle = 2.0 * PI * frequency_hz * step_s;
        let (mut slope, mut norm) = (0.0, 0.0);
        for d in 1..=reach {
            let d = d as f64;
            slope += d * (d * angle).sin();
            norm += d * d * angle;
        }
        slope / norm
    };
    frequencies_hz.iter().map(response).collect()
}

fn divide(spectrum: &mut [Complex<f64>], response: &[f64]) {
    for (value, response) in spectrum.iter_mut().zip(response) {
        *value /= *response;
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn the_response_of_the_slope_is_that_of_nine_samples_of_a_sine() {
        let (frequency_hz, step_s) = (1.7, 0.025);
        let omega = 2.0 * PI * frequency_hz;
        let sine = |k: f64| (omega * k * step_s).sin();
        let (mut up, mut norm) = (0.0, 0.0);
        for d in 1..=4 {
            let d = f64::from(d);
            up += d * (sine(d) - sine(-d));
            norm += 2.0 * d * d;
        }
        let slope = up / (norm * step_s);
        assert_relative_eq!(
            slope_response(&[frequency_hz], step_s)[0],
            slope / omega,
            max_relative = 1e-12
        );
    }
}
