//! Estimate: the derivatives of one maneuver, by output error on its axis's equations.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use crate::aero::{Axis, Bias, Buildup, Combined, Derivative, Output, WindTunnel};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::{MassProperties, Window};
use crate::dynamics::{Equations, Lateral, Longitudinal, OUTPUTS};
use crate::flight::{Mark, Record};
use crate::maneuver::{Class, Maneuver, Status};
use crate::output_error::newton_raphson::{self, Weights};
use crate::output_error::{Case, Fit, InitialState, Measurements, Model, Outcome};
use crate::tables::{EstimateRow, FitRow, History, HistoryOutput};
use crate::units::Unit;

/// What an inactive surface that moves a little all the same (feedback stays closed) does to the aircraft.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InactiveSurfaces {
    /// Its small motion acts at the wind-tunnel value, where there is one. Left out, feedback motion in step with a rate
    /// would be charged to that rate's derivative.
    #[default]
    WindTunnel,
    /// Nothing (the paper).
    Absent,
}

/// Choices of the estimation that hold for all classes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    pub weights: Weights,
    pub initial_state: InitialState,
    pub mass_properties: MassProperties,
    pub inactive_surfaces: InactiveSurfaces,
    /// A maneuver with a larger share of marked output samples is rejected.
    pub max_marked_share: f64,
    /// Smallest standard deviation believed of an output when weights are estimated, deg, deg/s, g.
    pub resolution: BTreeMap<Output, f64>,
    pub iteration: newton_raphson::Settings,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            weights: Weights::default(),
            initial_state: InitialState::default(),
            mass_properties: MassProperties::default(),
            inactive_surfaces: InactiveSurfaces::default(),
            max_marked_share: 0.2,
            resolution: BTreeMap::new(),
            iteration: newton_raphson::Settings::default(),
        }
    }
}

/// What every maneuver of a campaign is estimated with.
#[derive(Clone, Debug)]
pub struct Basis<'a> {
    pub aircraft: &'a Aircraft,
    pub buildup: &'a Buildup,
    pub tunnel: &'a WindTunnel,
    pub settings: &'a Settings,
}

/// The covariance of a maneuver's parameters in the units of the tables; initial states in rad and rad/s.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Covariance {
    pub names: Vec<String>,
    /// Row by row.
    pub white: Vec<f64>,
    pub corrected: Vec<f64>,
}

/// All that is known of a maneuver after its estimation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimated {
    pub fit: FitRow,
    pub estimates: Vec<EstimateRow>,
    pub covariance: Option<Covariance>,
    pub history: Option<History>,
}

/// Estimates one maneuver. Whatever goes wrong is in the outcome.
#[must_use]
pub fn maneuver(record: &Record, maneuver: &Maneuver, class: &Class, basis: &Basis) -> Estimated {
    let run = Run { record, maneuver, class, basis };
    let estimated = match class.axis {
        Axis::Longitudinal => run.estimate::<3, Longitudinal>(),
        Axis::Lateral => run.estimate::<4, Lateral>(),
    };
    estimated.unwrap_or_else(|reason| run.rejected(reason))
}

struct Run<'a> {
    record: &'a Record,
    maneuver: &'a Maneuver,
    class: &'a Class,
    basis: &'a Basis<'a>,
}

/// A derivative or bias of the class, with what becomes of it.
struct Term<'a> {
    name: &'a str,
    unit: &'static str,
    status: Status,
}

impl<'a> Run<'a> {
    fn estimate<const NX: usize, E: Equations<NX>>(&self) -> Result<Estimated, String> {
        let range = self.record.sample_at(self.maneuver.start_s)..self.record.sample_at(self.maneuver.end_s) + 1;
        let model = self.model()?;
        let derivatives = model.free.iter().copied().chain(model.held.iter().map(|(d, _)| *d));
        let surfaces: Vec<&str> = derivatives.filter_map(|d| d.regressor.surface()).collect();
        let settings = self.basis.settings;
        let window = Window::cut(self.record, range.clone(), surfaces.iter().copied(), settings.mass_properties)?;
        let measurements = self.measurements(&range)?;
        let case = Case::<NX, E>::new(self.basis.aircraft, &window, measurements, &model);
        let counted: usize = case.used().iter().sum();
        let left_out = 1.0 - counted as f64 / (OUTPUTS * case.samples()).max(1) as f64;
        if left_out > settings.max_marked_share {
            return Err(format!("{:.0}% of its output samples are marked", 100.0 * left_out));
        }
        if counted <= case.parameters() {
            return Err(format!("{counted} output samples for {} parameters", case.parameters()));
        }
        let start = case.starting_values(|name| self.tunnel(name).unwrap_or(0.0));
        let resolution = self.class.axis.outputs().map(|o| settings.resolution.get(&o).copied().unwrap_or(1e-6));
        let fit =
            newton_raphson::estimate(&case, start, self.weights()?, settings.weights, resolution, &settings.iteration);
        Ok(Estimated {
            estimates: self.rows(Some((&case.names, &fit))),
            covariance: covariance(&case.names, &fit),
            history: Some(self.history(&case.measurements, &fit, &window, &surfaces)),
            fit: self.fit_row(&fit, left_out),
        })
    }

    fn status(&self, name: &str) -> Option<Status> {
        self.class.status(name, self.maneuver.alpha_deg)
    }

    fn tunnel(&self, name: &str) -> Option<f64> {
        self.basis.tunnel.value(name, self.maneuver.alpha_deg, self.maneuver.mach).map(|v| v.value)
    }

    /// Sorts the axis's derivatives and biases into free and held.
    fn model(&self) -> Result<Model<'a>, String> {
        let basis = self.basis;
        let mut model = Model { initial_state: basis.settings.initial_state, ..Model::default() };
        for derivative in basis.buildup.derivatives_of(self.class.axis) {
            match self.status(&derivative.name) {
                Some(Status::Estimated) => model.free.push(derivative),
                Some(Status::Held) => model.held.push((derivative, self.held(derivative)?)),
                Some(Status::Inactive) | None => {
                    if basis.settings.inactive_surfaces == InactiveSurfaces::WindTunnel {
                        model.held.extend(self.tunnel(&derivative.name).map(|value| (derivative, value)));
                    }
                }
            }
        }
        let free = |bias: &&Bias| self.status(&bias.name) == Some(Status::Estimated);
        model.biases = basis.buildup.biases_of(self.class.axis).filter(free).collect();
        Ok(model)
    }

    fn held(&self, derivative: &Derivative) -> Result<f64, String> {
        self.tunnel(&derivative.name)
            .ok_or_else(|| format!("{} is to be held at a wind-tunnel value and has none", derivative.name))
    }

    fn weights(&self) -> Result<[f64; OUTPUTS], String> {
        let mut weights = [0.0; OUTPUTS];
        for (weight, output) in weights.iter_mut().zip(self.class.axis.outputs()) {
            *weight = self
                .class
                .weight(output, self.maneuver.alpha_deg)
                .ok_or_else(|| format!("class {} has no weight for `{}`", self.class.name, output.signal()))?;
        }
        Ok(weights)
    }

    fn measurements(&self, range: &Range<usize>) -> Result<Measurements, String> {
        let mut series = Vec::with_capacity(OUTPUTS);
        for output in self.class.axis.outputs() {
            let name = output.signal();
            series.push(self.record.signals.get(name).ok_or_else(|| format!("the record has no signal `{name}`"))?);
        }
        let used = |o: usize, k: usize| series[o].marks[k] == Mark::Measured && series[o].values[k].is_finite();
        let row = |k: usize| std::array::from_fn(|o| if used(o, k) { series[o].values[k] } else { 0.0 });
        Ok(Measurements {
            values: range.clone().map(row).collect(),
            used: range.clone().map(|k| std::array::from_fn(|o| used(o, k))).collect(),
        })
    }

    fn terms(&self) -> Vec<Term<'a>> {
        let (buildup, axis) = (self.basis.buildup, self.class.axis);
        let derivatives = buildup.derivatives_of(axis).map(|d| (d.name.as_str(), d.unit().name()));
        let biases = buildup.biases_of(axis).map(|b| (b.name.as_str(), b.unit().name()));
        derivatives
            .chain(biases)
            .map(|(name, unit)| Term { name, unit, status: self.status(name).unwrap_or(Status::Inactive) })
            .collect()
    }

    /// The maneuver's rows: one per derivative and bias of the axis, and one per combined sum.
    fn rows(&self, fit: Option<(&Vec<String>, &Fit)>) -> Vec<EstimateRow> {
        let at = |name: &str| fit.and_then(|(names, _)| names.iter().position(|n| n == name));
        let deviation = |matrix: Option<&DMatrix<f64>>, j: usize| matrix.map(|m| m[(j, j)].sqrt());
        let mut rows = Vec::new();
        for term in self.terms() {
            let mut row = self.row(term.name, term.unit, term.status);
            match (term.status, at(term.name), fit) {
                (Status::Estimated, Some(j), Some((_, fit))) => {
                    row.value = Some(fit.values[j]);
                    row.bound = deviation(fit.covariance.as_ref(), j);
                    row.bound_corrected = deviation(fit.covariance_corrected.as_ref(), j);
                }
                (Status::Held, ..) => row.value = row.wind_tunnel,
                _ => {}
            }
            rows.push(row);
        }
        for combined in &self.basis.buildup.combined {
            rows.extend(self.combined_row(combined, at(&combined.constant), at(&combined.slope), fit.map(|f| f.1)));
        }
        rows
    }

    /// The row of a sum `constant + slope α`, where both parts were estimated.
    fn combined_row(
        &self,
        combined: &Combined,
        constant: Option<usize>,
        slope: Option<usize>,
        fit: Option<&Fit>,
    ) -> Option<EstimateRow> {
        let (i, j, fit, alpha) = (constant?, slope?, fit?, self.maneuver.alpha_deg);
        let variance = |m: &DMatrix<f64>| m[(i, i)] + 2.0 * alpha * m[(i, j)] + alpha * alpha * m[(j, j)];
        let deviation = |m: &DMatrix<f64>| variance(m).max(0.0).sqrt();
        let unit = self.basis.buildup.unit_of(&combined.name)?.name();
        Some(EstimateRow {
            value: Some(fit.values[i] + alpha * fit.values[j]),
            bound: fit.covariance.as_ref().map(deviation),
            bound_corrected: fit.covariance_corrected.as_ref().map(deviation),
            ..self.row(&combined.name, unit, Status::Estimated)
        })
    }

    fn row(&self, name: &str, unit: &str, status: Status) -> EstimateRow {
        EstimateRow {
            maneuver_id: self.maneuver.maneuver_id.clone(),
            flight_id: self.maneuver.flight_id.clone(),
            class: self.class.name.clone(),
            alpha_deg: self.maneuver.alpha_deg,
            mach: self.maneuver.mach,
            derivative: name.to_owned(),
            unit: unit.to_owned(),
            status: status.name().to_owned(),
            value: None,
            bound: None,
            bound_corrected: None,
            wind_tunnel: self.tunnel(name),
        }
    }

    fn fit_row(&self, fit: &Fit, left_out: f64) -> FitRow {
        FitRow {
            maneuver_id: self.maneuver.maneuver_id.clone(),
            class: self.class.name.clone(),
            outcome: fit.outcome.name().to_owned(),
            reason: fit.reason.clone(),
            iterations: fit.iterations,
            initial_cost: fit.initial_cost,
            final_cost: fit.final_cost,
            condition_number: fit.condition_number,
            left_out: Some(left_out),
        }
    }

    fn rejected(&self, reason: String) -> Estimated {
        let fit = FitRow {
            maneuver_id: self.maneuver.maneuver_id.clone(),
            class: self.class.name.clone(),
            outcome: Outcome::Rejected.name().to_owned(),
            reason,
            iterations: 0,
            initial_cost: None,
            final_cost: None,
            condition_number: None,
            left_out: None,
        };
        Estimated { fit, estimates: self.rows(None), covariance: None, history: None }
    }

    fn history(&self, measured: &Measurements, fit: &Fit, window: &Window, surfaces: &[&str]) -> History {
        let outputs = self.class.axis.outputs().into_iter().enumerate().map(|(o, output)| HistoryOutput {
            label: output.signal().to_owned(),
            unit: Unit::of_signal(output.signal()).name.to_owned(),
            measured: measured.values.iter().map(|z| z[o]).collect(),
            computed: fit.response.outputs.iter().map(|y| y[o]).collect(),
            marked: measured.used.iter().map(|used| !used[o]).collect(),
        });
        let mut names: Vec<&str> = surfaces.to_vec();
        names.sort_unstable();
        names.dedup();
        let control = |name: &str| (name.to_owned(), window.signal(name).iter().step_by(2).copied().collect());
        History {
            maneuver_id: self.maneuver.maneuver_id.clone(),
            class: self.class.name.clone(),
            alpha_deg: self.maneuver.alpha_deg,
            time_s: (0..measured.values.len()).map(|k| k as f64 * window.step_s).collect(),
            outputs: outputs.collect(),
            controls: names.into_iter().map(control).collect(),
        }
    }
}

fn covariance(names: &[String], fit: &Fit) -> Option<Covariance> {
    let rows = |m: &DMatrix<f64>| m.transpose().as_slice().to_vec();
    let (white, corrected) = (fit.covariance.as_ref()?, fit.covariance_corrected.as_ref()?);
    Some(Covariance { names: names.to_vec(), white: rows(white), corrected: rows(corrected) })
}
