//! Window of a record: the data that the reconstruction needs of a part of a flight.

use std::ops::Range;

use nalgebra::Vector3;

use super::decimation::{decimate, decimate_measured, decimation, white_level};
use super::equations::{MeasuredTerms, State};
use super::measured_terms::{flow_direction, measured_state, measured_terms};
use super::parameters::{INPUTS, OUTPUTS, SIGNALS, input_factor, lacks_input};
use super::settings::Compatibility;
use crate::aircraft::Aircraft;
use crate::flight::Record;
use crate::flight::interpolation_kernel::WIDTH;
use crate::numerics::series::sample_count::nearest;
use crate::units::DEG;

/// Step of the integration from point to point, s: a twentieth of the period at 1 Hz. An aircraft
/// hardly turns faster than that.
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

/// Samples by which a delay may reach out of a window, with those of the interpolation kernel.
pub fn margin(settings: &Compatibility, step_s: f64) -> usize {
    nearest(settings.longest_delay_s / step_s) + WIDTH - 1
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
        let samples_per_point = nearest(POINT_STEP_S / step_s).max(1);
        let (margin, samples) = (margin(settings, step_s), range.len() / decimation);
        let first = range.start.saturating_sub(margin * decimation);
        let wide = first..first + (samples + 2 * margin) * decimation;
        let range = range.start..range.start + samples * decimation;
        let input = |i: usize| {
            let values = record.values(SIGNALS[i]).and_then(|v| v.get(wide.clone()));
            decimate(values.unwrap_or_default(), decimation)
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
        let first_centre = centres.first().copied().unwrap_or(range.start);
        let variance = |i: usize| white_level(record, SIGNALS[i], &range) / decimation as f64;
        Window {
            step_s,
            samples,
            samples_per_point,
            margin,
            start: measured_state(record, first_centre, aircraft, terms.first()),
            terms,
            inputs: std::array::from_fn(input),
            is_recorded: std::array::from_fn(|i| record.is_recorded(SIGNALS[i])),
            input_variances: std::array::from_fn(variance),
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
        omega.cross(&(flow_direction(alpha / DEG, beta / DEG) * speed))
    }
}
