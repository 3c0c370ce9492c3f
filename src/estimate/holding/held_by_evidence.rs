//! `hold: evidence`: each maneuver chooses which of its derivatives are held at the tunnel's values,
//! in place of Tables 1 and 3.
//!
//! Candidates are all derivatives that the class estimates or holds, except constants: those take
//! up trim and the effect of errors of held values. All candidates are free at first.
//! [`holding`](crate::output_error::holding) finds those that are better held. The maneuver is
//! fitted with these held, and the choice is repeated at that solution until it settles. The noise
//! is that of the least restricted fit that the data determine.

use std::collections::BTreeMap;

use crate::aero::{Derivative, Regressor};
use crate::dynamics::Equations;
use crate::dynamics::motion::ManeuverSignals;
use crate::estimate::fitting::{StartingPoints, fit_output_error};
use crate::estimate::task::Task;
use crate::maneuver::{Class, Status};
use crate::numerics::digits::rounded;
use crate::output_error::coloured::ResidualNoise;
use crate::output_error::cramer_rao;
use crate::output_error::holding::{HoldingCandidates, HoldingReason};
use crate::output_error::{Case, Fit, Model, Outcome};

/// Derivatives that a maneuver holds, with the reasons in words.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::estimate) struct HeldChoice {
    pub reasons: BTreeMap<String, String>,
}

/// Largest number of rounds of fitting and choosing. Each but the last holds or frees a derivative,
/// and none is freed twice.
const ROUNDS: usize = 10;

impl HeldChoice {
    /// The class with the maneuver's choice in place of its table.
    pub fn applied_to(&self, class: &Class) -> Class {
        let mut class = class.clone();
        self.apply_to(&mut class.statuses);
        for over in &mut class.overrides {
            self.apply_to(&mut over.statuses);
        }
        class
    }

    /// Changes the statuses of a table to those of the choice.
    fn apply_to(&self, statuses: &mut BTreeMap<String, Status>) {
        for (name, status) in statuses {
            let is_held = self.reasons.contains_key(name);
            match *status {
                Status::Estimated if is_held => *status = Status::Held,
                Status::Held if !is_held => *status = Status::Estimated,
                _ => {}
            }
        }
    }
}

/// State of the choice between two rounds.
struct Choice {
    /// Parameters that are held.
    held: Vec<bool>,
    /// Parameters that were held in an earlier round and are free again.
    released: Vec<bool>,
    /// Noise of the least restricted fit that the data determine.
    noise: Option<ResidualNoise>,
    candidates: Option<HoldingCandidates>,
    /// Parameters held in the last fit that converged.
    last_fitted: Option<Vec<bool>>,
}

impl Choice {
    fn all_free(parameters: usize) -> Choice {
        Choice {
            held: vec![false; parameters],
            released: vec![false; parameters],
            noise: None,
            candidates: None,
            last_fitted: None,
        }
    }
}

/// The choice of a maneuver's held derivatives.
struct Choosing<'t, 'a, const NX: usize, E: Equations<NX>> {
    task: &'t Task<'a>,
    signals: ManeuverSignals,
    /// Model with every candidate free.
    all_free: Model<'a>,
    wide: Case<NX, E>,
    /// Standard uncertainty of the tunnel's value of each parameter of `wide` that may be held.
    uncertainty: Vec<Option<f64>>,
}

impl<'t, 'a, const NX: usize, E: Equations<NX>> Choosing<'t, 'a, NX, E> {
    fn new(task: &'t Task<'a>) -> Result<Self, String> {
        let (range, all_free) = (task.range(), task.model_without_held()?);
        let surfaces = all_free
            .free
            .iter()
            .chain(all_free.held.iter().map(|(d, _)| d))
            .flat_map(|d| d.regressor.signals());
        let signals = ManeuverSignals::cut(
            task.context.aircraft,
            task.record,
            range.clone(),
            surfaces,
            task.context.settings.mass_properties,
        )?;
        let measurements = task.measurements(&range)?;
        let wide = Case::new(task.context.aircraft, &signals, measurements, &all_free);
        let uncertainty = wide
            .names
            .iter()
            .map(|name| tunnel_uncertainty(task, name))
            .collect();
        Ok(Choosing {
            task,
            signals,
            all_free,
            wide,
            uncertainty,
        })
    }

    /// The maneuver with some parameters of `wide` held.
    fn with_held(&self, held: &[bool]) -> Case<NX, E> {
        let names = self.wide.names.iter().zip(held);
        let held_names: Vec<&String> = names.filter(|(_, held)| **held).map(|(n, _)| n).collect();
        let is_held = |d: &Derivative| held_names.contains(&&d.name);
        let at_tunnel_value = |d: &&'a Derivative| Some((*d, self.task.tunnel_value(&d.name)?));
        let mut model = self.all_free.clone();
        model.held.extend(
            model
                .free
                .iter()
                .filter(|d| is_held(d))
                .filter_map(at_tunnel_value),
        );
        model.free.retain(|d| !is_held(d));
        let aircraft = self.task.context.aircraft;
        self.wide.with_model(aircraft, &self.signals, &model)
    }

    /// Information on all parameters of `wide`, at the values of a fit with some held.
    fn candidates(
        &self,
        narrow: &Case<NX, E>,
        fit: &Fit,
        noise: &ResidualNoise,
    ) -> Option<HoldingCandidates> {
        let values: Vec<f64> = self
            .wide
            .names
            .iter()
            .map(|name| self.value_at_fit(name, narrow, fit))
            .collect();
        HoldingCandidates::gather(
            &self.wide,
            &values,
            noise,
            &fit.weights,
            self.uncertainty.clone(),
            self.max_condition_number(),
        )
    }

    /// Estimate of a parameter, or the tunnel's value of one that is held.
    fn value_at_fit(&self, name: &String, narrow: &Case<NX, E>, fit: &Fit) -> f64 {
        let place = narrow.names.iter().position(|n| n == name);
        place
            .map(|j| fit.values[j])
            .or_else(|| self.task.tunnel_value(name))
            .unwrap_or(0.0)
    }

    fn max_condition_number(&self) -> f64 {
        self.task.context.settings.iteration.max_condition_number
    }

    /// Fits and chooses in turn until the choice settles.
    fn choose(&self) -> Result<HeldChoice, String> {
        let mut choice = Choice::all_free(self.wide.parameters());
        for round in 0..ROUNDS {
            let narrow = self.with_held(&choice.held);
            let starts = StartingPoints::new(self.task, &narrow)?;
            let (fit, _) = fit_output_error(self.task, &narrow, &starts)?;
            if fit.outcome != Outcome::NotConverged {
                if self.choose_again(&narrow, &fit, &mut choice) {
                    break;
                }
            } else if round == 0 {
                // With everything free there is no fit: begin with the class's table.
                choice.held = self.held_by_class();
            } else {
                // Return to the last choice that could be fitted.
                choice.held = choice.last_fitted.unwrap_or(choice.held);
                break;
            }
        }
        Ok(self.with_reasons(&choice.held, choice.candidates.as_ref()))
    }

    /// Chooses at a fit. Returns true if the choice is settled, or the fit gives no information.
    fn choose_again(&self, narrow: &Case<NX, E>, fit: &Fit, choice: &mut Choice) -> bool {
        choice.last_fitted = Some(choice.held.clone());
        if choice.noise.is_none() {
            choice.noise = cramer_rao::residual_noise(narrow, fit, self.max_condition_number());
        }
        let no_noise = ResidualNoise::default();
        let noise = choice.noise.as_ref().unwrap_or(&no_noise);
        let Some(found) = self.candidates(narrow, fit, noise) else {
            return true;
        };
        // Without noise from a determined fit, bounds cannot be judged: fit again first.
        let determined = found.hold_undetermined(choice.held.clone());
        let next = if choice.noise.is_some() {
            found.choose(determined, &mut choice.released)
        } else {
            determined
        };
        let is_settled = next == choice.held;
        choice.held = next;
        choice.candidates = Some(found);
        is_settled
    }

    /// Parameters of `wide` that the class holds.
    fn held_by_class(&self) -> Vec<bool> {
        let names = self.wide.names.iter();
        names
            .map(|name| self.task.status(name) == Some(Status::Held))
            .collect()
    }

    /// The choice with the reason of each held derivative in words.
    fn with_reasons(&self, held: &[bool], candidates: Option<&HoldingCandidates>) -> HeldChoice {
        let names = &self.wide.names;
        let reason = |j: usize| {
            let because = candidates.and_then(|c| c.reason(held, j));
            (names[j].clone(), self.reason_in_words(j, because))
        };
        HeldChoice {
            reasons: (0..held.len()).filter(|&j| held[j]).map(reason).collect(),
        }
    }

    /// Reason for holding a parameter, in the words of the table `estimates`.
    fn reason_in_words(&self, parameter: usize, because: Option<HoldingReason>) -> String {
        let names = &self.wide.names;
        match because {
            None => "held together with derivatives that were freed later".to_owned(),
            Some(HoldingReason::NotExcited) => {
                match self.task.context.aero_model.derivative(&names[parameter]) {
                    Some(Derivative {
                        regressor: Regressor::Surface(s) | Regressor::Vane(s),
                        ..
                    }) => {
                        format!("{s} did not move")
                    }
                    _ => "its regressor did not move".to_owned(),
                }
            }
            Some(HoldingReason::NotSeparable(others)) => {
                let others: Vec<&str> = others.iter().map(|&j| names[j].as_str()).collect();
                format!("not identifiable beside {}", others.join(", "))
            }
            Some(HoldingReason::Bound {
                bound,
                uncertainty,
                partner,
            }) => {
                let limit = self.task.context.settings.identifiability.correlation;
                let with = partner.filter(|(_, correlation)| correlation.abs() > limit);
                let with = with.map_or_else(String::new, |(j, correlation)| {
                    format!("; it would correlate {correlation:.2} with {}", names[j])
                });
                let (bound, uncertainty) = (rounded(bound), rounded(uncertainty));
                format!(
                    "estimated, its bound would be {bound}; the tunnel's uncertainty is {uncertainty}{with}"
                )
            }
        }
    }
}

/// Chooses the derivatives to hold in this maneuver.
///
/// # Errors
/// The reason why the maneuver is rejected, as in its estimation.
pub(in crate::estimate) fn choose_held<const NX: usize, E: Equations<NX>>(
    task: &Task,
) -> Result<HeldChoice, String> {
    Choosing::<NX, E>::new(task)?.choose()
}

/// Standard uncertainty of the tunnel's value of a derivative that may be held.
///
/// `None` for constants, biases and initial states, for a derivative without a table, and for
/// one whose table is all zero and states no uncertainty.
fn tunnel_uncertainty(task: &Task, name: &str) -> Option<f64> {
    let derivative = task.context.aero_model.derivative(name)?;
    if derivative.regressor == Regressor::Constant || task.tunnel_value(name).is_none() {
        return None;
    }
    Some(task.held_uncertainty(derivative)).filter(|u| *u > 0.0)
}

/// Names the undetermined derivatives of a fit that have no tunnel value to be held at; empty
/// without any.
pub(in crate::estimate) fn undetermined_without_tunnel<const NX: usize, E: Equations<NX>>(
    task: &Task,
    case: &Case<NX, E>,
    fit: &Fit,
) -> String {
    let names = fit.undetermined.iter().filter_map(|&j| case.names.get(j));
    let is_derivative = |name: &&String| {
        task.context.aero_model.derivative(name).is_some() && !task.is_constant(name)
    };
    let lacking: Vec<&str> = names
        .filter(is_derivative)
        .filter(|name| tunnel_uncertainty(task, name).is_none())
        .map(String::as_str)
        .collect();
    match lacking.as_slice() {
        [] => String::new(),
        [one] => format!("; {one} has no wind-tunnel value with an uncertainty to be held at"),
        many => format!(
            "; none of {} has a wind-tunnel value with an uncertainty to be held at",
            many.join(", ")
        ),
    }
}
