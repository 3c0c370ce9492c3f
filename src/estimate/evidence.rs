//! Hold by evidence: instead of Tables 1 and 3 each maneuver decides which of its derivatives are
//! held at the tunnel's values.
//!
//! Candidates are all derivatives that the class estimates or holds, except constants: those take
//! up trim and what errors of held values do there. All are free at first;
//! [`holding`](crate::output_error::holding) says which are better held, the maneuver is fitted
//! with these held, and asked again at that solution until the choice stands. What noise there is
//! the least restricted fit that the data determine says.

use std::collections::BTreeMap;

use super::Run;
use crate::aero::{Derivative, Regressor};
use crate::dynamics::Equations;
use crate::dynamics::motion::Window;
use crate::maneuver::{Class, Status};
use crate::output_error::coloured::Noise;
use crate::output_error::cramer_rao;
use crate::output_error::holding::{Because, Candidates};
use crate::output_error::{Case, Fit, Model, Outcome};

/// A maneuver's own choice, and why each held derivative is held.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Choice {
    pub held_because: BTreeMap<String, String>,
}

/// Rounds of fitting and choosing; each but the last holds or frees a derivative, and none is freed
/// twice.
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
        class
            .statuses
            .iter_mut()
            .for_each(|(name, status)| own(name, status));
        class
            .overrides
            .iter_mut()
            .flat_map(|o| &mut o.statuses)
            .for_each(|(name, status)| own(name, status));
        class
    }
}

/// A maneuver of which it is chosen what to hold.
struct Choosing<'r, 'a, const NX: usize, E: Equations<NX>> {
    run: &'r Run<'a>,
    window: Window,
    /// Every candidate free.
    all: Model<'a>,
    wide: Case<NX, E>,
    /// Of the value that each parameter of `wide` may be held at.
    uncertainty: Vec<Option<f64>>,
}

impl<'r, 'a, const NX: usize, E: Equations<NX>> Choosing<'r, 'a, NX, E> {
    fn new(run: &'r Run<'a>) -> Result<Self, String> {
        let (range, all) = (run.range(), run.model_without_held()?);
        let surfaces = all
            .free
            .iter()
            .chain(all.held.iter().map(|(d, _)| d))
            .filter_map(|d| d.regressor.surface());
        let window = Window::cut(
            run.record,
            range.clone(),
            surfaces,
            run.basis.settings.mass_properties,
        )?;
        let wide = Case::new(run.basis.aircraft, &window, run.measurements(&range)?, &all);
        let uncertainty = wide.names.iter().map(|name| run.known_to(name)).collect();
        Ok(Choosing {
            run,
            window,
            all,
            wide,
            uncertainty,
        })
    }

    /// The maneuver with these parameters of `wide` held.
    fn narrow(&self, held: &[bool]) -> Case<NX, E> {
        let is_held = |d: &Derivative| {
            self.wide
                .names
                .iter()
                .zip(held)
                .any(|(name, held)| *held && *name == d.name)
        };
        let tunnel = |d: &&'a Derivative| Some((*d, self.run.tunnel(&d.name)?));
        let mut model = self.all.clone();
        model
            .held
            .extend(model.free.iter().filter(|d| is_held(d)).filter_map(tunnel));
        model.free.retain(|d| !is_held(d));
        Case::new(
            self.run.basis.aircraft,
            &self.window,
            self.wide.measurements.clone(),
            &model,
        )
    }

    /// What the data say of all parameters at the values of a fit with some held.
    fn gather(&self, narrow: &Case<NX, E>, fit: &Fit, noise: &Noise) -> Option<Candidates> {
        let value = |name: &String| {
            narrow
                .names
                .iter()
                .position(|n| n == name)
                .map(|j| fit.values[j])
        };
        let at = |name: &String| value(name).or_else(|| self.run.tunnel(name)).unwrap_or(0.0);
        let values: Vec<f64> = self.wide.names.iter().map(at).collect();
        let max = self.max_condition_number();
        Candidates::gather(
            &self.wide,
            &values,
            noise,
            &fit.weights,
            self.uncertainty.clone(),
            max,
        )
    }

    fn max_condition_number(&self) -> f64 {
        self.run.basis.settings.iteration.max_condition_number
    }

    fn choose(&self) -> Result<Choice, String> {
        let mut held = vec![false; self.wide.parameters()];
        let mut released = held.clone();
        // Of the least restricted fit that the data determine.
        let mut noise: Option<Noise> = None;
        let mut because = None;
        let mut fitted: Option<Vec<bool>> = None;
        for round in 0..ROUNDS {
            let narrow = self.narrow(&held);
            let (fit, _) = self.run.fit(&narrow)?;
            if fit.outcome == Outcome::NotConverged {
                if round > 0 {
                    // A choice that cannot be fitted is none: back to the last that could.
                    held = fitted.unwrap_or(held);
                    break;
                }
                // With everything free the maneuver cannot be fitted: begin with what the table
                // holds.
                held = self
                    .wide
                    .names
                    .iter()
                    .map(|n| self.run.status(n) == Some(Status::Held))
                    .collect();
                continue;
            }
            fitted = Some(held.clone());
            noise = noise.or_else(|| cramer_rao::noise(&narrow, &fit, self.max_condition_number()));
            let Some(candidates) =
                self.gather(&narrow, &fit, noise.as_ref().unwrap_or(&Noise::default()))
            else {
                break;
            };
            // A fit that the data do not determine says nothing of the noise: fit again before
            // judging bounds.
            let next = match noise {
                Some(_) => candidates.settle(candidates.determined(held.clone()), &mut released),
                None => candidates.determined(held.clone()),
            };
            let settled = next == held;
            held = next;
            because = Some(candidates);
            if settled {
                break;
            }
        }
        let why = |j: usize| because.as_ref().and_then(|c| c.because(&held, j));
        let names = &self.wide.names;
        let reason = |j: usize| (names[j].clone(), self.run.in_words(names, j, why(j)));
        Ok(Choice {
            held_because: (0..held.len()).filter(|&j| held[j]).map(reason).collect(),
        })
    }
}

impl Run<'_> {
    /// Chooses what to hold in this maneuver.
    ///
    /// # Errors
    /// What makes the maneuver rejected, as in its estimation.
    pub(super) fn choose<const NX: usize, E: Equations<NX>>(&self) -> Result<Choice, String> {
        Choosing::<NX, E>::new(self)?.choose()
    }

    /// How well the tunnel knows a derivative that may be held: none for constants, biases and
    /// initial states, for a derivative without a table, and for one whose table is all zero and
    /// states no uncertainty.
    fn known_to(&self, name: &str) -> Option<f64> {
        let derivative = self.basis.buildup.derivative(name)?;
        let known = derivative.regressor != Regressor::Constant && self.tunnel(name).is_some();
        known
            .then(|| self.held_uncertainty(derivative))
            .filter(|u| *u > 0.0)
    }

    /// Why evidence could not mend a fit that the data do not determine: what has nothing to be
    /// held at.
    pub(super) fn without_tunnel<const NX: usize, E: Equations<NX>>(
        &self,
        case: &Case<NX, E>,
        fit: &Fit,
    ) -> String {
        let names = fit.undetermined.iter().filter_map(|&j| case.names.get(j));
        let is_derivative = |name: &&String| {
            self.basis.buildup.derivative(name).is_some() && !self.is_constant(name)
        };
        let lacking: Vec<&str> = names
            .filter(is_derivative)
            .filter(|n| self.known_to(n).is_none())
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

    fn in_words(&self, names: &[String], parameter: usize, because: Option<Because>) -> String {
        match because {
            None => "it was held beside others that are free now".to_owned(),
            Some(Because::NotFelt) => match self.basis.buildup.derivative(&names[parameter]) {
                Some(Derivative {
                    regressor: Regressor::Surface(s) | Regressor::Vane(s),
                    ..
                }) => {
                    format!("{s} did not move")
                }
                _ => "its regressor did not move".to_owned(),
            },
            Some(Because::NotToldApart(others)) => {
                let others: Vec<&str> = others.iter().map(|&j| names[j].as_str()).collect();
                format!("the data do not tell it apart from {}", others.join(", "))
            }
            Some(Because::Bound {
                bound,
                uncertainty,
                partner,
            }) => {
                let with = partner
                    .filter(|(_, c)| c.abs() > self.basis.settings.identifiability.correlation);
                let with = with.map_or_else(String::new, |(j, correlation)| {
                    format!("; it would correlate {correlation:.2} with {}", names[j])
                });
                let (bound, uncertainty) = (short(bound), short(uncertainty));
                format!(
                    "estimated, its bound would be {bound}; the tunnel's uncertainty is {uncertainty}{with}"
                )
            }
        }
    }
}

/// A number with three significant digits.
fn short(value: f64) -> String {
    let digits = format!("{value:.2e}");
    digits
        .parse()
        .map_or(digits, |rounded: f64| rounded.to_string())
}
