//! Hold by evidence: instead of Tables 1 and 3 each maneuver decides which of its derivatives are held at the tunnel's
//! values.
//!
//! Candidates are all derivatives that the class estimates or holds, except constants: those take up trim and what errors
//! of held values do there. All are free at first; [`holding`](crate::output_error::holding) says which are better held,
//! the maneuver is fitted with these held, and asked again at that solution until the choice stands. What noise there is the
//! least restricted fit that the data determine says.

use std::collections::BTreeMap;

use super::Run;
use crate::aero::{Derivative, Regressor};
use crate::dynamics::Equations;
use crate::dynamics::motion::Window;
use crate::maneuver::{Class, Status};
use crate::output_error::holding::{Because, Candidates};
use crate::output_error::{Case, Model, Outcome};

/// A maneuver's own choice, and why each held derivative is held.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Choice {
    pub held_because: BTreeMap<String, String>,
}

/// Rounds of fitting and choosing; each but the last holds or frees a derivative, and none is freed twice.
const ROUNDS: usize = 10;

impl Choice {
    /// The class with the maneuver's choice in place of its table.
    pub fn applied_to(&self, class: &Class) -> Class {
        let mut class = class.clone();
        let held = |name: &String| self.held_because.contains_key(name);
        let own = |name: &String, status: &mut Status| match *status {
            Status::Estimated if held(name) => *status = Status::Held,
            Status::Held if !held(name) => *status = Status::Estimated,
            _ => {}
        };
        class.statuses.iter_mut().for_each(|(name, status)| own(name, status));
        class.overrides.iter_mut().flat_map(|o| &mut o.statuses).for_each(|(name, status)| own(name, status));
        class
    }
}

impl<'a> Run<'a> {
    /// Chooses what to hold in this maneuver.
    ///
    /// # Errors
    /// What makes the maneuver rejected, as in its estimation.
    pub(super) fn choose<const NX: usize, E: Equations<NX>>(&self) -> Result<Choice, String> {
        let (range, table) = (self.range(), self.model()?);
        let active = |d: &Derivative| matches!(self.status(&d.name), Some(Status::Estimated | Status::Held));
        let derivatives = self.basis.buildup.derivatives_of(self.class.axis);
        let candidates: Vec<&'a Derivative> = derivatives.filter(|d| active(d)).collect();
        let inactive = |d: &Derivative| !active(d);
        let acting = table.held.iter().copied().filter(|(d, _)| inactive(d));
        let all = Model { free: candidates, held: acting.collect(), ..table.clone() };
        let surfaces = all.free.iter().chain(all.held.iter().map(|(d, _)| d)).filter_map(|d| d.regressor.surface());
        let window = Window::cut(self.record, range.clone(), surfaces, self.basis.settings.mass_properties)?;
        let measurements = self.measurements(&range)?;
        let case = |model: &Model| Case::<NX, E>::new(self.basis.aircraft, &window, measurements.clone(), model);
        let wide = case(&all);
        let with = |held: &dyn Fn(&Derivative) -> bool| {
            let mut model = Model { free: all.free.iter().copied().filter(|d| !held(d)).collect(), ..all.clone() };
            model.held.extend(all.free.iter().filter(|d| held(d)).filter_map(|d| Some((*d, self.tunnel(&d.name)?))));
            model
        };
        let uncertainty: Vec<Option<f64>> = wide.names.iter().map(|name| self.known_to(name)).collect();
        let mut held = vec![false; wide.parameters()];
        let mut released = held.clone();
        let mut least_restricted = None;
        let mut because = None;
        for round in 0..ROUNDS {
            let is_held = |d: &Derivative| wide.names.iter().position(|n| *n == d.name).is_some_and(|j| held[j]);
            let narrow = case(&with(&is_held));
            let fit = self.fit(&narrow)?;
            if fit.outcome == Outcome::NotConverged {
                if round > 0 {
                    break;
                }
                // With everything free the maneuver cannot be fitted: begin with what the table holds.
                held = wide.names.iter().map(|n| self.status(n) == Some(Status::Held)).collect();
                continue;
            }
            let value = |name: &str| narrow.names.iter().position(|n| n == name).map(|j| fit.values[j]);
            let at = |name: &String| value(name).or_else(|| self.tunnel(name)).unwrap_or(0.0);
            let values: Vec<f64> = wide.names.iter().map(at).collect();
            let outputs = least_restricted.as_ref().unwrap_or(&fit.response.outputs);
            let max = self.basis.settings.iteration.max_condition_number;
            let gathered = Candidates::gather(&wide, &values, outputs, &fit.weights, uncertainty.clone(), max);
            let Some(candidates) = gathered else { break };
            let determined = candidates.determined(held.clone());
            let next = if determined == held {
                least_restricted.get_or_insert_with(|| fit.response.outputs.clone());
                candidates.settle(held.clone(), &mut released)
            } else {
                // A fit that the data do not determine says nothing of the noise: fit again before judging bounds.
                determined
            };
            let settled = next == held;
            held = next;
            because = Some(candidates);
            if settled {
                break;
            }
        }
        let chosen = (0..held.len()).filter(|&j| held[j]);
        let why = |j: usize| because.as_ref().and_then(|c| c.because(&held, j));
        let reason = |j: usize| (wide.names[j].clone(), self.in_words(&wide.names, j, why(j)));
        Ok(Choice { held_because: chosen.map(reason).collect() })
    }

    /// How well the tunnel knows a derivative that may be held: none for constants, biases and initial states, for a
    /// derivative without a table, and for one whose table is all zero and states no uncertainty.
    fn known_to(&self, name: &str) -> Option<f64> {
        let derivative = self.basis.buildup.derivative(name)?;
        let known = derivative.regressor != Regressor::Constant && self.tunnel(name).is_some();
        known.then(|| self.held_uncertainty(derivative)).filter(|u| *u > 0.0)
    }

    fn in_words(&self, names: &[String], parameter: usize, because: Option<Because>) -> String {
        match because {
            None => "it was held beside others that are free now".to_owned(),
            Some(Because::NotFelt) => match self.basis.buildup.derivative(&names[parameter]) {
                Some(Derivative { regressor: Regressor::Surface(s) | Regressor::Vane(s), .. }) => {
                    format!("{s} did not move")
                }
                _ => "its regressor did not move".to_owned(),
            },
            Some(Because::NotToldApart(others)) => {
                let others: Vec<&str> = others.iter().map(|&j| names[j].as_str()).collect();
                format!("the data do not tell it apart from {}", others.join(", "))
            }
            Some(Because::Bound { bound, uncertainty, partner }) => {
                let with = partner.filter(|(_, c)| c.abs() > self.basis.settings.identifiability.correlation);
                let with = with.map_or_else(String::new, |(j, correlation)| {
                    format!("; it would correlate {correlation:.2} with {}", names[j])
                });
                format!(
                    "estimated, its bound would be {bound:.3e}; the tunnel's uncertainty is {uncertainty:.3e}{with}"
                )
            }
        }
    }
}
