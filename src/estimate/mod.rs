//! Estimate: the derivatives of one maneuver, by output error on its axis's equations.

mod calibration;
mod evidence;
pub mod joint;
mod measures;
pub mod prediction;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use crate::aero::{Axis, Bias, Buildup, Combined, Derivative, Output, Regressor, WindTunnel};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::{MassProperties, Window};
use crate::dynamics::{Equations, Lateral, Longitudinal, OUTPUTS};
use crate::flight::{Mark, Record};
use crate::maneuver::{Class, Maneuver, Status};
use crate::output_error::calibration_errors::Calibration;
use crate::output_error::estimation::{self, Weights};
use crate::output_error::identifiability;
use crate::output_error::newton_raphson;
use crate::output_error::surface_noise::noisy_surfaces;
use crate::output_error::{Case, Fit, InitialState, Measurements, Model, Outcome};
use crate::output_error::{consider, equation_error};
use crate::settings::{settings, single_values};
use crate::tables::{CorrelationRow, EstimateRow, FitRow, History, HistoryOutput, StartingValues};
use crate::units::Unit;

/// What an inactive surface that moves a little all the same (feedback stays closed) does to the
/// aircraft.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InactiveSurfaces {
    /// Its small motion acts at the wind-tunnel value, where there is one. Left out, feedback
    /// motion in step with a rate would be charged to that rate's derivative.
    #[default]
    WindTunnel,
    /// Nothing (the paper).
    Absent,
}

/// Where the iteration starts; the other start is tried where it does not converge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    /// At the derivatives that the measured accelerations imply. An airframe that is unstable
    /// without its feedback diverges within seconds from a tunnel's values; from these it does not.
    #[default]
    EquationError,
    /// At the tunnel's values (the paper).
    WindTunnel,
}

/// Who says which derivatives are held at the tunnel's values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hold {
    /// The class (Tables 1 and 3). Maneuvers that are to share derivatives (`joint`) need it: they
    /// must hold the same.
    #[default]
    Table,
    /// The maneuver: what the tunnel knows better than the maneuver can tell.
    Evidence,
}

impl Hold {
    /// Warning that goes with a choice.
    #[must_use]
    pub fn warning(self) -> Option<&'static str> {
        let warning = "estimate: hold: evidence: intervals cover less than with `table` (89 instead of 94 % in simulation): \
                       state the tunnel's uncertainty";
        (self == Hold::Evidence).then_some(warning)
    }
}

impl From<Start> for StartingValues {
    fn from(start: Start) -> StartingValues {
        match start {
            Start::EquationError => StartingValues::EquationError,
            Start::WindTunnel => StartingValues::WindTunnel,
        }
    }
}

settings! {
    /// Settings of the estimation, of all classes.
    pub struct Settings {
        /// Weights of the residuals: `table` takes each class's own (Tables 2 and 4), `estimated` the
        /// inverse of the residuals' variances. `estimated` changes every estimate and its bound.
        pub weights: Weights = Weights::default(),
        /// Initial state of a maneuver: `estimated` with the derivatives, or `measured`, the first
        /// sample, whose noise then enters the estimates.
        pub initial_state: InitialState = InitialState::default(),
        /// Mass, centre of gravity and inertias: `recorded` sample by sample, or `mean`, one value
        /// per maneuver as in the paper.
        pub mass_properties: MassProperties = MassProperties::default(),
        /// Small feedback motion of surfaces that a class does not excite: `wind_tunnel` applies the
        /// tunnel's derivatives to it, `absent` ignores it as in the paper. `absent` charges motion
        /// in step with a rate to that rate's derivative.
        pub inactive_surfaces: InactiveSurfaces = InactiveSurfaces::default(),
        /// Start of the iteration: `equation_error`, or `wind_tunnel` as in the paper. The other
        /// start is tried where the iteration does not converge.
        pub start: Start = Start::default(),
        /// Choice of the derivatives that are held at the tunnel's value: `table` takes each
        /// class's own (Tables 1 and 3), `evidence` holds what the tunnel determines better than
        /// the maneuver. The intervals of `evidence` cover less than those of `table`.
        pub hold: Hold = Hold::default(),
        /// Standard uncertainty of a held derivative whose table states none, percent of the root
        /// mean square of the table. Larger: wider `bound_corrected`, and `evidence` holds fewer
        /// derivatives.
        pub held_uncertainty_pct: f64 = 20.0,
        /// Joint estimation of maneuvers of one class and angle of attack, besides each alone. It
        /// adds rows and changes none; it needs `hold: table`.
        #[serde(skip_serializing)]
        pub joint: Option<joint::Settings> = None,
        /// Prediction of each maneuver with derivatives from the others of its class and angle of
        /// attack; `null` turns it off. It changes no estimate.
        #[serde(skip_serializing)]
        pub prediction: Option<prediction::Settings> = Some(prediction::Settings::default()),
    }
    expert {
        /// Smallest standard deviation of each output with `weights: estimated`, deg, deg/s or g.
        /// Larger: outputs of coarse resolution weigh less.
        pub resolution: BTreeMap<Output, f64> = BTreeMap::new(),
        /// End of the iteration.
        pub iteration: newton_raphson::Settings = newton_raphson::Settings::default(),
        /// Constants (`CN_0`) that joined or predicting maneuvers share. `true` charges each flight's
        /// zero error of vanes and surfaces to the slopes; `false` lets each maneuver keep its own.
        #[serde(skip_serializing)]
        pub share_constants: bool = false,
        /// Limits of the identifiability measures.
        pub identifiability: identifiability::Limits = identifiability::Limits::default(),
    }
    elsewhere {
        /// Uncertainty that calibration leaves of each signal: `instruments:` of aircraft.yaml.
        /// Signals without an entry count as exact.
        pub calibration: BTreeMap<String, Calibration> = BTreeMap::new(),
        /// Largest share of flagged samples over the outputs together, and in each surface:
        /// `segment: quality: marked_share`.
        pub max_marked_share: f64 = 0.2,
    }
}
single_values!(Weights, InitialState, MassProperties, InactiveSurfaces, Start, Hold, BTreeMap<Output, f64>);

/// What every maneuver of a campaign is estimated with.
#[derive(Clone, Debug)]
pub struct Basis<'a> {
    pub aircraft: &'a Aircraft,
    pub buildup: &'a Buildup,
    pub tunnel: &'a WindTunnel,
    /// The table that starting values are read from: the tunnel's, but for studies of the
    /// iteration.
    pub start: &'a WindTunnel,
    pub settings: &'a Settings,
}

impl<'a> Basis<'a> {
    /// The iteration starts from the tunnel's values where it starts from a table.
    #[must_use]
    pub fn new(
        aircraft: &'a Aircraft,
        buildup: &'a Buildup,
        tunnel: &'a WindTunnel,
        settings: &'a Settings,
    ) -> Basis<'a> {
        Basis {
            aircraft,
            buildup,
            tunnel,
            start: tunnel,
            settings,
        }
    }
}

/// The covariance of a maneuver's parameters in the units of the tables; initial states in rad and
/// rad/s.
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
    /// The sums that the tunnel tabulates, where both parts were estimated.
    pub combined: Vec<EstimateRow>,
    pub covariance: Option<Covariance>,
    /// Among the regressors as flown and among the estimates.
    pub correlations: Vec<CorrelationRow>,
    pub history: Option<History>,
}

/// Estimates one maneuver. Whatever goes wrong is in the outcome.
#[must_use]
pub fn maneuver(record: &Record, maneuver: &Maneuver, class: &Class, basis: &Basis) -> Estimated {
    let run = Run {
        record,
        maneuver,
        class,
        basis,
    };
    if maneuver.is_rejected() {
        return run.rejected(maneuver.quality.reason.clone());
    }
    match basis.settings.hold {
        Hold::Table => run.estimated(),
        Hold::Evidence => by_evidence(&run),
    }
}

/// Estimates with what the maneuver's own evidence says is to be held.
fn by_evidence(run: &Run) -> Estimated {
    let choice = match run.class.axis {
        Axis::Longitudinal => run.choose::<3, Longitudinal>(),
        Axis::Lateral => run.choose::<4, Lateral>(),
    };
    let choice = match choice {
        Ok(choice) => choice,
        Err(reason) => return run.rejected(reason),
    };
    let mut estimated = Run {
        class: &choice.applied_to(run.class),
        ..*run
    }
    .estimated();
    for row in &mut estimated.estimates {
        row.held_because = choice.held_because.get(&row.derivative).cloned();
    }
    estimated
}

impl Estimated {
    /// The row of a maneuver whose class the configuration does not have.
    #[must_use]
    pub fn unknown_class(maneuver: &Maneuver) -> Estimated {
        let reason = format!("the configuration has no class `{}`", maneuver.class);
        Estimated::without_fit(rejected(maneuver, reason), vec![])
    }

    /// The rows of a maneuver that was not fitted.
    fn without_fit(fit: FitRow, estimates: Vec<EstimateRow>) -> Estimated {
        Estimated {
            fit,
            estimates,
            combined: vec![],
            covariance: None,
            correlations: vec![],
            history: None,
        }
    }
}

#[derive(Clone, Copy)]
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

/// A maneuver made ready: everything that does not depend on the parameters.
struct Ready<'a, const NX: usize, E: Equations<NX>> {
    model: Model<'a>,
    surfaces: Vec<&'a str>,
    window: Window,
    case: Case<NX, E>,
    /// Share of the output samples that do not count.
    left_out: f64,
}

impl<'a> Run<'a> {
    fn estimated(&self) -> Estimated {
        let estimated = match self.class.axis {
            Axis::Longitudinal => self.estimate::<3, Longitudinal>(),
            Axis::Lateral => self.estimate::<4, Lateral>(),
        };
        estimated.unwrap_or_else(|reason| self.rejected(reason))
    }

    /// The maneuver's samples in the record.
    fn range(&self) -> Range<usize> {
        self.record.sample_at(self.maneuver.start_s)..self.record.sample_at(self.maneuver.end_s) + 1
    }

    fn estimate<const NX: usize, E: Equations<NX>>(&self) -> Result<Estimated, String> {
        let ready = self.ready::<NX, E>(self.model()?)?;
        let case = &ready.case;
        let (mut fit, start) = self.fit(case)?;
        if self.basis.settings.hold == Hold::Evidence {
            fit.reason.push_str(&self.without_tunnel(case, &fit));
        }
        let wide = self.wide(&ready);
        let values = values_of(&ready.model, &case.names, &fit.values);
        consider::consider(
            case,
            &wide,
            &values,
            &self.held_uncertainties(&ready.model),
            &mut fit,
        );
        self.miscalibrate(&ready, &mut fit);
        let mut estimated = Estimated {
            estimates: self.rows(Some((&case.names, &fit))),
            combined: self.combined(&case.names, &fit),
            covariance: covariance(&case.names, &fit),
            correlations: vec![],
            history: Some(self.history(&case.measurements, &fit, &ready.window, &ready.surfaces)),
            fit: self.fit_row(&fit, ready.left_out, start.into()),
        };
        self.measure(case, &ready.window, &ready.model, &fit, &mut estimated);
        Ok(estimated)
    }

    /// Cuts the maneuver out of the record and lays it out for this model.
    fn ready<const NX: usize, E: Equations<NX>>(
        &self,
        model: Model<'a>,
    ) -> Result<Ready<'a, NX, E>, String> {
        let range = self.range();
        let derivatives = model
            .free
            .iter()
            .copied()
            .chain(model.held.iter().map(|(d, _)| *d));
        let surfaces: Vec<&str> = derivatives.filter_map(|d| d.regressor.surface()).collect();
        let settings = self.basis.settings;
        self.refuse_marked(&surfaces)?;
        let window = Window::cut(
            self.record,
            range.clone(),
            surfaces.iter().copied(),
            settings.mass_properties,
        )?;
        let measurements = self.measurements(&range)?;
        let mut case = Case::<NX, E>::new(self.basis.aircraft, &window, measurements, &model);
        let counted: usize = case.used().iter().sum();
        let left_out = 1.0 - counted as f64 / (OUTPUTS * case.samples()).max(1) as f64;
        if counted <= case.parameters() {
            return Err(format!(
                "{counted} output samples for {} parameters",
                case.parameters()
            ));
        }
        let mut free = model.free.clone();
        free.sort_by_key(|d| case.names.iter().position(|name| *name == d.name));
        case.noisy_surfaces = noisy_surfaces(self.basis.aircraft, &window, &free, &model.held);
        Ok(Ready {
            model,
            surfaces,
            window,
            case,
            left_out,
        })
    }

    /// Refuses a maneuver of which too much is repaired or missing. Samples between those of a slow
    /// channel do not count: nothing is wrong with them, and the cost leaves them out.
    fn refuse_marked(&self, surfaces: &[&str]) -> Result<(), String> {
        let Maneuver { start_s, end_s, .. } = *self.maneuver;
        let most = self.basis.settings.max_marked_share;
        let outputs = self.record.marked_share(
            self.class.axis.outputs().map(Output::signal),
            start_s,
            end_s,
        );
        if outputs > most {
            return Err(format!(
                "{:.0}% of its output samples are marked",
                100.0 * outputs
            ));
        }
        for surface in surfaces {
            let share = self.record.marked_share([*surface], start_s, end_s);
            if share > most {
                return Err(format!(
                    "{:.0}% of the samples of `{surface}` are marked",
                    100.0 * share
                ));
            }
        }
        Ok(())
    }

    /// Output error from the configured start, and from the other one if that does not converge.
    fn fit<const NX: usize, E: Equations<NX>>(
        &self,
        case: &Case<NX, E>,
    ) -> Result<(Fit, Start), String> {
        if case.parameters() == 0 {
            return Err("nothing is free to be estimated".to_owned());
        }
        let settings = self.basis.settings;
        let Maneuver {
            alpha_deg, mach, ..
        } = *self.maneuver;
        let value = |name: &str| {
            self.basis
                .start
                .value(name, alpha_deg, mach)
                .map_or(0.0, |v| v.value)
        };
        let tunnel = case.starting_values(value);
        let implied = equation_error::start(case, &tunnel);
        let (first, second, other_start) = match settings.start {
            Start::EquationError => (implied, tunnel, Start::WindTunnel),
            Start::WindTunnel => (tunnel, implied, Start::EquationError),
        };
        let resolution = self.resolution();
        let weights = self.weights()?;
        let from = |start| {
            estimation::estimate(
                case,
                start,
                weights,
                settings.weights,
                resolution,
                &settings.iteration,
            )
        };
        let fit = from(first);
        if fit.outcome == Outcome::Converged {
            return Ok((fit, settings.start));
        }
        let other = from(second);
        Ok(if other.outcome == Outcome::Converged {
            (other, other_start)
        } else {
            (fit, settings.start)
        })
    }

    /// The maneuver with the held derivatives free as well: what an error of theirs would do.
    fn wide<const NX: usize, E: Equations<NX>>(&self, ready: &Ready<'a, NX, E>) -> Case<NX, E> {
        let Ready {
            model,
            window,
            case,
            ..
        } = ready;
        let held = model.held.iter().map(|(d, _)| *d);
        let all = Model {
            free: model.free.iter().copied().chain(held).collect(),
            held: vec![],
            ..model.clone()
        };
        Case::new(self.basis.aircraft, window, case.measurements.clone(), &all)
    }

    fn held_uncertainties(&self, model: &Model<'a>) -> BTreeMap<&'a str, f64> {
        model
            .held
            .iter()
            .map(|(d, _)| (d.name.as_str(), self.held_uncertainty(d)))
            .collect()
    }

    /// Standard uncertainty of a held value: the database's, or the configured share of the
    /// derivative's size.
    fn held_uncertainty(&self, derivative: &Derivative) -> f64 {
        let tunnel = self.basis.tunnel;
        let stated = tunnel.at(&derivative.name, &self.maneuver.condition(tunnel));
        let share = self.basis.settings.held_uncertainty_pct / 100.0;
        stated
            .and_then(|v| v.uncertainty)
            .unwrap_or_else(|| share * tunnel.root_mean_square(&derivative.name))
    }

    fn status(&self, name: &str) -> Option<Status> {
        self.class.status(name, self.maneuver.alpha_deg)
    }

    /// Whether a derivative is its coefficient's constant.
    fn is_constant(&self, name: &str) -> bool {
        self.basis
            .buildup
            .derivative(name)
            .is_some_and(|d| d.regressor == Regressor::Constant)
    }

    fn tunnel(&self, name: &str) -> Option<f64> {
        self.basis
            .tunnel
            .at(name, &self.maneuver.condition(self.basis.tunnel))
            .map(|v| v.value)
    }

    /// Sorts the axis's derivatives and biases into free and held.
    fn model(&self) -> Result<Model<'a>, String> {
        let basis = self.basis;
        let mut model = Model {
            initial_state: basis.settings.initial_state,
            ..Model::default()
        };
        for derivative in basis.buildup.derivatives_of(self.class.axis) {
            match self.status(&derivative.name) {
                Some(Status::Estimated) => model.free.push(derivative),
                Some(Status::Held) => model.held.push((derivative, self.held(derivative)?)),
                Some(Status::Inactive) | None => {
                    if basis.settings.inactive_surfaces == InactiveSurfaces::WindTunnel {
                        model.held.extend(
                            self.tunnel(&derivative.name)
                                .map(|value| (derivative, value)),
                        );
                    }
                }
            }
        }
        let free = |bias: &&Bias| self.status(&bias.name) == Some(Status::Estimated);
        model.biases = basis
            .buildup
            .biases_of(self.class.axis)
            .filter(free)
            .collect();
        Ok(model)
    }

    /// The model with everything free that the class estimates or holds.
    fn model_without_held(&self) -> Result<Model<'a>, String> {
        let active =
            |d: &Derivative| matches!(self.status(&d.name), Some(Status::Estimated | Status::Held));
        let mut model = self.model()?;
        model.free = self
            .basis
            .buildup
            .derivatives_of(self.class.axis)
            .filter(|d| active(d))
            .collect();
        model.held.retain(|(d, _)| !active(d));
        Ok(model)
    }

    fn held(&self, derivative: &Derivative) -> Result<f64, String> {
        self.tunnel(&derivative.name).ok_or_else(|| {
            format!(
                "{} is to be held at a wind-tunnel value and has none here",
                derivative.name
            )
        })
    }

    fn weights(&self) -> Result<[f64; OUTPUTS], String> {
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

    fn resolution(&self) -> [f64; OUTPUTS] {
        let resolution = &self.basis.settings.resolution;
        self.class
            .axis
            .outputs()
            .map(|o| resolution.get(&o).copied().unwrap_or(1e-6))
    }

    fn measurements(&self, range: &Range<usize>) -> Result<Measurements, String> {
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

    fn terms(&self) -> Vec<Term<'a>> {
        let (buildup, axis) = (self.basis.buildup, self.class.axis);
        let derivatives = buildup
            .derivatives_of(axis)
            .map(|d| (d.name.as_str(), d.unit().name()));
        let biases = buildup
            .biases_of(axis)
            .map(|b| (b.name.as_str(), b.unit().name()));
        derivatives
            .chain(biases)
            .map(|(name, unit)| Term {
                name,
                unit,
                status: self.status(name).unwrap_or(Status::Inactive),
            })
            .collect()
    }

    /// The maneuver's rows: one per derivative and bias of the axis.
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
                    row.bound_held = deviation(fit.covariance_held.as_ref(), j);
                    row.bound_calibration = deviation(fit.covariance_calibration.as_ref(), j);
                    row.bound_corrected = deviation(fit.covariance_corrected.as_ref(), j);
                }
                (Status::Held, ..) => row.value = row.wind_tunnel,
                _ => {}
            }
            rows.push(row);
        }
        rows
    }

    fn combined(&self, names: &[String], fit: &Fit) -> Vec<EstimateRow> {
        let at = |name: &str| names.iter().position(|n| n == name);
        let sums = self.basis.buildup.combined.iter();
        sums.filter_map(|c| self.combined_row(c, at(&c.constant)?, at(&c.slope)?, fit))
            .collect()
    }

    /// The row of a sum `constant + slope α` of parameters `i` and `j`.
    fn combined_row(
        &self,
        combined: &Combined,
        i: usize,
        j: usize,
        fit: &Fit,
    ) -> Option<EstimateRow> {
        let alpha = self.maneuver.alpha_deg;
        let variance =
            |m: &DMatrix<f64>| m[(i, i)] + 2.0 * alpha * m[(i, j)] + alpha * alpha * m[(j, j)];
        let deviation = |m: &DMatrix<f64>| variance(m).max(0.0).sqrt();
        let unit = self.basis.buildup.unit_of(&combined.name)?.name();
        Some(EstimateRow {
            value: Some(fit.values[i] + alpha * fit.values[j]),
            bound: fit.covariance.as_ref().map(deviation),
            bound_held: fit.covariance_held.as_ref().map(deviation),
            bound_calibration: fit.covariance_calibration.as_ref().map(deviation),
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
            status,
            value: None,
            bound: None,
            bound_held: None,
            bound_calibration: None,
            bound_corrected: None,
            wind_tunnel: self.tunnel(name),
            variance_inflation: None,
            excitation: None,
            contribution_pct: None,
            equation_error: None,
            held_because: None,
        }
    }

    fn fit_row(&self, fit: &Fit, left_out: f64, start: StartingValues) -> FitRow {
        FitRow {
            maneuver_id: self.maneuver.maneuver_id.clone(),
            class: self.class.name.clone(),
            outcome: fit.outcome,
            reason: fit.reason.clone(),
            start: Some(start),
            iterations: fit.iterations,
            initial_cost: fit.initial_cost,
            final_cost: fit.final_cost,
            condition_number: fit.condition_number,
            left_out: Some(left_out),
            largest_condition_index: None,
            confounded: None,
        }
    }

    fn rejected(&self, reason: String) -> Estimated {
        Estimated::without_fit(rejected(self.maneuver, reason), self.rows(None))
    }

    fn history(
        &self,
        measured: &Measurements,
        fit: &Fit,
        window: &Window,
        surfaces: &[&str],
    ) -> History {
        let outputs = self
            .class
            .axis
            .outputs()
            .into_iter()
            .enumerate()
            .map(|(o, output)| HistoryOutput {
                label: output.signal().to_owned(),
                unit: Unit::of_signal(output.signal()).name.to_owned(),
                measured: measured.values.iter().map(|z| z[o]).collect(),
                computed: fit.response.outputs.iter().map(|y| y[o]).collect(),
                marked: measured.used.iter().map(|used| !used[o]).collect(),
            });
        let mut names: Vec<&str> = surfaces.to_vec();
        names.sort_unstable();
        names.dedup();
        let control = |name: &str| {
            (
                name.to_owned(),
                window.signal(name).iter().step_by(2).copied().collect(),
            )
        };
        History {
            maneuver_id: self.maneuver.maneuver_id.clone(),
            class: self.class.name.clone(),
            alpha_deg: self.maneuver.alpha_deg,
            time_s: (0..measured.values.len())
                .map(|k| k as f64 * window.step_s)
                .collect(),
            outputs: outputs.collect(),
            controls: names.into_iter().map(control).collect(),
        }
    }
}

fn rejected(maneuver: &Maneuver, reason: String) -> FitRow {
    FitRow {
        maneuver_id: maneuver.maneuver_id.clone(),
        class: maneuver.class.clone(),
        outcome: Outcome::Rejected,
        reason,
        start: None,
        iterations: 0,
        initial_cost: None,
        final_cost: None,
        condition_number: None,
        left_out: None,
        largest_condition_index: None,
        confounded: None,
    }
}

/// Every parameter of a maneuver by name: the held ones' values, and the free ones'.
fn values_of<'a>(model: &'a Model, names: &'a [String], values: &[f64]) -> BTreeMap<&'a str, f64> {
    let held = model
        .held
        .iter()
        .map(|(d, value)| (d.name.as_str(), *value));
    held.chain(names.iter().map(String::as_str).zip(values.iter().copied()))
        .collect()
}

fn covariance(names: &[String], fit: &Fit) -> Option<Covariance> {
    let rows = |m: &DMatrix<f64>| m.transpose().as_slice().to_vec();
    let (white, corrected) = (fit.covariance.as_ref()?, fit.covariance_corrected.as_ref()?);
    Some(Covariance {
        names: names.to_vec(),
        white: rows(white),
        corrected: rows(corrected),
    })
}
