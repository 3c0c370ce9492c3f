//! One maneuver to be estimated: its model, held values, weights and measurements.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::context::Context;
use super::settings::InactiveSurfaces;
use crate::aero::{Bias, Derivative, Output, Regressor};
use crate::dynamics::OUTPUTS;
use crate::flight::{Mark, Record, RemainingError};
use crate::maneuver::{Class, Maneuver, Status};
use crate::output_error::calibration_errors::Calibration;
use crate::output_error::{Measurements, Model};

/// One maneuver to be estimated.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub record: &'a Record,
    pub maneuver: &'a Maneuver,
    pub class: &'a Class,
    pub context: &'a Context<'a>,
}

impl<'a> Task<'a> {
    /// Errors of the signals, root mean squares: those that remain where the flight itself determines
    /// them, elsewhere those that calibration states.
    pub(super) fn error_sizes(&self) -> impl Iterator<Item = (&'a str, Calibration)> {
        let stated = &self.context.settings.calibration;
        let remaining = &self.record.remaining_errors;
        let signals: BTreeSet<&str> = stated
            .keys()
            .chain(remaining.keys())
            .map(String::as_str)
            .collect();
        let task = *self;
        signals
            .into_iter()
            .map(move |signal| (signal, task.error_size(signal)))
    }

    /// `true` if no signal has a stated or found error, and no surface a delay.
    pub(super) fn has_exact_signals(&self) -> bool {
        self.context.settings.calibration.is_empty()
            && self.record.remaining_errors.is_empty()
            && self.context.delays.is_empty()
    }

    /// Errors of one signal, as [`Self::error_sizes`] has them; zero for a signal that counts as
    /// exact.
    pub(super) fn error_size(&self, signal: &str) -> Calibration {
        let stated = self.context.settings.calibration.get(signal);
        let stated = stated.copied().unwrap_or_default();
        let remaining = self.record.remaining_errors.get(signal);
        let remaining = remaining.copied().unwrap_or_default();
        // The calibration of an instrument does not apply to an assumed value.
        let is_assumed = self.record.is_assumed(signal);
        let size = |remaining: Option<RemainingError>, stated: f64| {
            let calibration = (stated > 0.0 && !is_assumed).then_some(stated);
            remaining.map_or(stated, |error| error.root_mean_square(calibration))
        };
        Calibration {
            bias: size(remaining.bias, stated.bias),
            scale_pct: 100.0 * size(remaining.scale, stated.scale_pct / 100.0),
        }
    }

    /// Samples of the maneuver in the record.
    pub(super) fn range(&self) -> Range<usize> {
        self.record.sample_at(self.maneuver.start_s)..self.record.sample_at(self.maneuver.end_s) + 1
    }

    /// Status of a derivative or bias in this maneuver.
    pub(super) fn status(&self, name: &str) -> Option<Status> {
        self.class.status(name, self.maneuver.alpha_deg)
    }

    /// `true` for the constant of a coefficient.
    pub(super) fn is_constant(&self, name: &str) -> bool {
        self.context
            .aero_model
            .derivative(name)
            .is_some_and(|d| d.regressor == Regressor::Constant)
    }

    /// Tunnel's value at the maneuver's flight condition.
    pub(super) fn tunnel_value(&self, name: &str) -> Option<f64> {
        self.context
            .tunnel
            .at(name, &self.maneuver.condition(self.context.tunnel))
            .map(|v| v.value)
    }

    /// Standard uncertainty of a held value: the database's, or the configured share of the derivative's
    /// size.
    pub(super) fn held_uncertainty(&self, derivative: &Derivative) -> f64 {
        let tunnel = self.context.tunnel;
        let stated = tunnel.at(&derivative.name, &self.maneuver.condition(tunnel));
        let share = self.context.settings.held_uncertainty_pct / 100.0;
        stated
            .and_then(|v| v.uncertainty)
            .unwrap_or_else(|| share * tunnel.root_mean_square(&derivative.name))
    }

    /// Standard uncertainties of the held values by derivative.
    pub(super) fn held_uncertainties(&self, model: &Model<'a>) -> BTreeMap<&'a str, f64> {
        model
            .held
            .iter()
            .map(|(d, _)| (d.name.as_str(), self.held_uncertainty(d)))
            .collect()
    }

    /// Model of the class: derivatives and biases of the axis, free or held.
    pub(super) fn class_model(&self) -> Result<Model<'a>, String> {
        let basis = self.context;
        let mut model = Model {
            initial_state: basis.settings.initial_state,
            ..Model::default()
        };
        for derivative in basis.aero_model.derivatives_of(self.class.axis) {
            match self.status(&derivative.name) {
                Some(Status::Estimated) => model.free.push(derivative),
                Some(Status::Held) => model.held.push((derivative, self.held_value(derivative)?)),
                Some(Status::Inactive) | None => {
                    let acts = basis.settings.inactive_surfaces == InactiveSurfaces::WindTunnel
                        && self.has_regressor(derivative);
                    if acts {
                        model.held.extend(
                            self.tunnel_value(&derivative.name)
                                .map(|value| (derivative, value)),
                        );
                    }
                }
            }
        }
        let free = |bias: &&Bias| self.status(&bias.name) == Some(Status::Estimated);
        model.biases = basis
            .aero_model
            .biases_of(self.class.axis)
            .filter(free)
            .collect();
        Ok(model)
    }

    /// Absent output that the regressor of a derivative follows from: the measured α̇ (2.1) needs
    /// normal and axial acceleration.
    pub(super) fn absent_of_regressor(&self, derivative: &Derivative) -> Option<Output> {
        let needs = derivative.regressor.has_alpha_rate();
        let mut accelerations = [Output::An, Output::Ax].into_iter();
        accelerations.find(|output| needs && self.is_absent(*output))
    }

    /// `true` if the regressor of a derivative follows from recorded signals.
    fn has_regressor(&self, derivative: &Derivative) -> bool {
        let mut signals = derivative.regressor.signals();
        self.absent_of_regressor(derivative).is_none()
            && signals.all(|signal| self.record.signals.contains_key(signal))
    }

    /// `true` for an output that is not recorded: the record has a stand-in for it.
    pub(super) fn is_absent(&self, output: Output) -> bool {
        self.record.is_assumed(output.signal())
    }

    /// Outputs of the axis that are recorded.
    pub(super) fn recorded_outputs(&self) -> impl Iterator<Item = Output> {
        let outputs = self.class.axis.outputs().into_iter();
        outputs.filter(|output| !self.is_absent(*output))
    }

    /// Model with everything free that the class estimates or holds.
    pub(super) fn model_without_held(&self) -> Result<Model<'a>, String> {
        let active =
            |d: &Derivative| matches!(self.status(&d.name), Some(Status::Estimated | Status::Held));
        let mut model = self.class_model()?;
        model.free = self
            .context
            .aero_model
            .derivatives_of(self.class.axis)
            .filter(|d| active(d))
            .collect();
        model.held.retain(|(d, _)| !active(d));
        Ok(model)
    }

    /// Value at which a derivative is held.
    fn held_value(&self, derivative: &Derivative) -> Result<f64, String> {
        self.tunnel_value(&derivative.name).ok_or_else(|| {
            format!(
                "{} is to be held at a wind-tunnel value and has none here",
                derivative.name
            )
        })
    }

    /// The class's weights of the outputs.
    pub(super) fn weights(&self) -> Result<[f64; OUTPUTS], String> {
        let mut weights = [0.0; OUTPUTS];
        for (weight, output) in weights.iter_mut().zip(self.class.axis.outputs()) {
            *weight = self
                .class
                .weight(output, self.maneuver.alpha_deg)
                .ok_or_else(|| {
                    format!(
                        "class {} has no weight for `{}`",
                        self.class.name,
                        output.signal()
                    )
                })?;
        }
        Ok(weights)
    }

    /// Smallest standard deviation assumed of each output when weights are estimated.
    pub(super) fn resolution(&self) -> [f64; OUTPUTS] {
        let resolution = &self.context.settings.resolution;
        self.class
            .axis
            .outputs()
            .map(|o| resolution.get(&o).copied().unwrap_or(1e-6))
    }

    /// Measured outputs; samples that do not count are zero and flagged as not used.
    pub(super) fn measurements(&self, range: &Range<usize>) -> Result<Measurements, String> {
        let mut series = Vec::with_capacity(OUTPUTS);
        for output in self.class.axis.outputs() {
            let name = output.signal();
            series.push(
                self.record
                    .signals
                    .get(name)
                    .ok_or_else(|| format!("the record has no signal `{name}`"))?,
            );
        }
        let used = |o: usize, k: usize| {
            series[o].marks[k] == Mark::Measured && series[o].values[k].is_finite()
        };
        let row =
            |k: usize| std::array::from_fn(|o| if used(o, k) { series[o].values[k] } else { 0.0 });
        Ok(Measurements {
            values: range.clone().map(row).collect(),
            used: range
                .clone()
                .map(|k| std::array::from_fn(|o| used(o, k)))
                .collect(),
        })
    }
}

/// Values of all parameters by name, held and free.
pub(super) fn values_by_name<'a>(
    model: &'a Model,
    names: &'a [String],
    values: &[f64],
) -> BTreeMap<&'a str, f64> {
    let held = model
        .held
        .iter()
        .map(|(d, value)| (d.name.as_str(), *value));
    held.chain(names.iter().map(String::as_str).zip(values.iter().copied()))
        .collect()
}
