//! Optional parts and signals that a pipeline or its files lack, and the cost of each absence.

use std::collections::BTreeSet;

use super::checked::Config;
use crate::aero::{Axis, Derivative, Output};
use crate::error::did_you_mean;
use crate::flight::signal;
use crate::flight::stand_in::{StandIn, consequence_of_absence};
use crate::maneuver::{Class, Status};
use crate::segment::absent_signals;

impl Config {
    /// One line for each part or signal that the pipeline lacks: its substitute, and the cost.
    #[must_use]
    pub fn absences(&self) -> Vec<String> {
        Recorder::of(self, &BTreeSet::new()).absences()
    }

    /// One line for each signal of the channel map that files lack, and for each absence of the
    /// pipeline that costs more in these files.
    #[must_use]
    pub fn absences_in_files(&self, lacking: &BTreeSet<String>) -> Vec<String> {
        let of_pipeline = self.absences();
        let mut lines = Recorder::of(self, lacking).absences();
        lines.retain(|line| !of_pipeline.contains(line));
        lines
    }

    /// Reason for which no maneuver of any class can be estimated: signals that no channel gives.
    pub(super) fn no_class_left(&self) -> Option<String> {
        let none = BTreeSet::new();
        let recorder = Recorder::of(self, &none);
        let of_classes = self.classes.iter().map(|class| recorder.lost_by(class));
        let of_classes: Vec<BTreeSet<&str>> = of_classes.collect();
        if of_classes.iter().any(BTreeSet::is_empty) {
            return None;
        }
        let names: BTreeSet<&str> = of_classes.into_iter().flatten().collect();
        let given = self.channels.values().map(|c| c.signal.as_str());
        let near = match names.first() {
            Some(name) if names.len() == 1 => did_you_mean(name, given),
            _ => String::new(),
        };
        let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        let names = names.join(", ");
        Some(format!(
            "no class is left: every one needs a signal that no channel gives. Give a line under `channels` to the \
             column of {names}{near}"
        ))
    }
}

/// Signals of a pipeline's recorder: those of the channel map without those that files lack.
struct Recorder<'a> {
    config: &'a Config,
    lacking: &'a BTreeSet<String>,
}

impl<'a> Recorder<'a> {
    fn of(config: &'a Config, lacking: &'a BTreeSet<String>) -> Recorder<'a> {
        Recorder { config, lacking }
    }

    fn absences(&self) -> Vec<String> {
        let mut lines = Vec::new();
        lines.extend(self.no_tunnel());
        lines.extend(self.absent_signals());
        lines.extend(self.lost_axes());
        lines.extend(self.no_excitation_flag());
        lines.extend(self.no_pilot_controls());
        lines.extend(self.absent_names());
        lines
    }

    /// `true` for a signal of a channel.
    fn is_recorded(&self, signal: &str) -> bool {
        let mut channels = self.config.channels.values();
        channels.any(|channel| channel.signal == signal) && !self.lacking.contains(signal)
    }

    /// `true` for a signal of a channel or a constant.
    fn has_signal(&self, signal: &str) -> bool {
        self.is_recorded(signal) || self.config.constants.contains_key(signal)
    }

    fn no_tunnel(&self) -> Option<String> {
        if self.config.wind_tunnel.is_some() {
            return None;
        }
        let held = match self.config.held_at_nothing {
            0 => String::new(),
            held => format!("; {held} derivatives that the classes hold count as zero"),
        };
        Some(format!(
            "no wind tunnel: nothing is compared with one, and the posterior has no prior{held}"
        ))
    }

    /// One line for all absent signals that cost the same.
    fn absent_signals(&self) -> Vec<String> {
        let required = signal::REQUIRED.iter().copied();
        let has = |signal: &str| self.has_signal(signal);
        let lacking = required.filter(|signal| !has(signal));
        // Without a rotor's inertia its speed has no effect.
        let has_rotors = self.config.aircraft.engine_inertia_slug_ft2 > 0.0;
        let is_rotor = |signal: &str| [signal::RPM_LEFT, signal::RPM_RIGHT].contains(&signal);
        let mut costs: Vec<(&str, Vec<(&str, String)>)> = Vec::new();
        for signal in lacking.filter(|signal| has_rotors || !is_rotor(signal)) {
            let Some(stand_in) = StandIn::of(signal, has) else {
                continue;
            };
            let (own, absent) = (
                consequence_of_absence(signal, has),
                (signal, stand_in.in_words()),
            );
            match costs.iter_mut().find(|(cost, _)| *cost == own) {
                Some((_, signals)) => signals.push(absent),
                None => costs.push((own, vec![absent])),
            }
        }
        let mut lines: Vec<String> = costs.iter().map(|(cost, s)| absence(s, cost)).collect();
        let optional = signal::OPTIONAL.into_iter();
        let absent = optional.filter(|signal| !has(signal));
        lines.extend(
            absent.map(|signal| format!("no `{signal}`: {}", consequence_of_absence(signal, has))),
        );
        lines
    }

    /// Axes whose states are not all recorded, with the classes that no maneuver can have.
    fn lost_axes(&self) -> Vec<String> {
        let line = |axis: Axis| {
            let states = axis.outputs().into_iter().filter(|o| o.is_state());
            let lacking = states.map(Output::signal);
            let lacking = lacking.filter(|signal| !self.is_recorded(signal));
            let lacking: Vec<&str> = lacking.collect();
            let classes = self
                .config
                .classes
                .iter()
                .filter(|class| class.axis == axis);
            let classes: Vec<&str> = classes.map(|class| class.name.as_str()).collect();
            (!lacking.is_empty() && !classes.is_empty()).then(|| {
                format!(
                    "no recorded {}: maneuvers of {} are found and not estimated",
                    lacking.join(", "),
                    classes.join(", ")
                )
            })
        };
        let axes = [Axis::Longitudinal, Axis::Lateral].into_iter();
        axes.filter_map(line).collect()
    }

    fn no_excitation_flag(&self) -> Option<String> {
        self.config.segment.excitation_flag.is_empty().then(|| {
            "no `segment: excitation_flag`: only their steps separate maneuvers that are close \
             together, and feedback that answers the pilot may count as excitation"
                .to_owned()
        })
    }

    fn no_pilot_controls(&self) -> Option<String> {
        self.config.segment.pilot_controls.is_empty().then(|| {
            "no `segment: pilot_controls`: steps of surfaces stand for the pilot's, and ordinary \
             flying with steps may be taken for a maneuver"
                .to_owned()
        })
    }

    /// Flags, pilot controls and surfaces, named by the analyst, that are not recorded.
    fn absent_names(&self) -> Vec<String> {
        let config = self.config;
        let has = |signal: &str| self.has_signal(signal);
        let of_recognition = absent_signals(&config.classes, &config.segment, has);
        let derivatives = config.aero_model.derivatives.iter();
        let of_model = derivatives.flat_map(|d| d.regressor.signals());
        let of_instruments = config.estimate.calibration.keys().map(String::as_str);
        let used = of_recognition.iter().map(|absent| absent.signal.as_str());
        let names: BTreeSet<&str> = used.chain(of_model).chain(of_instruments).collect();
        let absent = names
            .into_iter()
            .filter(|name| !signal::is_own(name) && !has(name));
        let line = |name: &str| {
            let recognition = of_recognition.iter().find(|absent| absent.signal == name);
            let unrecognised = recognition.map_or(&[][..], |absent| &absent.unrecognised);
            let cost = recognition.map(|absent| absent.cost.clone());
            let cost = cost.filter(|cost| !cost.is_empty()).into_iter();
            let costs: Vec<String> = cost
                .chain(self.cost_of_surface(name, unrecognised))
                .collect();
            if costs.is_empty() {
                return format!("no `{name}`: no result depends on it");
            }
            format!("no `{name}`: {}", costs.join("; "))
        };
        absent.map(line).collect()
    }

    /// Costs of a surface that is not recorded for the estimates of the classes that are recognised.
    fn cost_of_surface(&self, surface: &str, unrecognised: &[String]) -> Vec<String> {
        let classes = self.config.classes.iter();
        let recognised = classes.filter(|class| !unrecognised.contains(&class.name));
        let (lost, others): (Vec<&Class>, Vec<&Class>) =
            recognised.partition(|class| self.needs(class, surface));
        let others = others.into_iter();
        let at_rest = others.filter(|class| self.has_value(class, surface));
        let names = |classes: Vec<&Class>| {
            let names: Vec<&str> = classes.iter().map(|class| class.name.as_str()).collect();
            (!names.is_empty()).then(|| names.join(", "))
        };
        let lost =
            names(lost).map(|names| format!("maneuvers of {names} are found and not estimated"));
        let at_rest = names(at_rest.collect())
            .map(|names| format!("its effect is left out of maneuvers of {names}"));
        lost.into_iter().chain(at_rest).collect()
    }

    /// `true` for a class that estimates or holds a derivative of a surface.
    fn needs(&self, class: &Class, surface: &str) -> bool {
        let overrides = class.overrides.iter().map(|o| &o.statuses);
        let statuses = || std::iter::once(&class.statuses).chain(overrides.clone());
        let is_active = |name: &String| {
            let mut statuses = statuses().filter_map(|statuses| statuses.get(name));
            statuses.any(|status| *status != Status::Inactive)
        };
        self.derivatives_of(surface, class)
            .any(|d| is_active(&d.name))
    }

    /// `true` for a class of an axis in which the tunnel has a derivative of a surface.
    fn has_value(&self, class: &Class, surface: &str) -> bool {
        self.derivatives_of(surface, class)
            .any(|d| self.config.tunnel.has(&d.name))
    }

    /// Derivatives of a class's axis whose regressors contain a surface.
    fn derivatives_of(&self, surface: &str, class: &Class) -> impl Iterator<Item = &Derivative> {
        let derivatives = self.config.aero_model.derivatives_of(class.axis);
        derivatives.filter(move |d| d.regressor.signals().any(|s| s == surface))
    }

    /// Signals without which the maneuvers of a class are not recognised, unless the analyst gives
    /// them, or not estimated.
    fn lost_by(&self, class: &'a Class) -> BTreeSet<&'a str> {
        let config = self.config;
        let has = |signal: &str| self.has_signal(signal);
        let is_given = config.events.iter().any(|event| event.class == class.name);
        let inputs = class.recognition.inputs();
        let of_class = std::slice::from_ref(class);
        let absent = absent_signals(of_class, &config.segment, has);
        let is_lost = |name: &str| {
            let own = absent.iter().find(|absent| absent.signal == name);
            own.is_some_and(|absent| !absent.unrecognised.is_empty())
        };
        let derivatives = config.aero_model.derivatives_of(class.axis);
        let of_model = derivatives.flat_map(|d| d.regressor.signals());
        let of_model = of_model.filter(|name| !signal::is_own(name) && !has(name));
        let mut lost: BTreeSet<&str> = of_model.filter(|name| self.needs(class, name)).collect();
        if !is_given {
            lost.extend(inputs.into_iter().filter(|name| is_lost(name)));
        }
        lost
    }
}

/// Line of absent signals, each with its stand-in in words, that cost the same.
fn absence(signals: &[(&str, String)], cost: &str) -> String {
    let names: Vec<String> = signals
        .iter()
        .map(|(name, _)| format!("`{name}`"))
        .collect();
    let stand_ins = match signals {
        [(_, words)] => format!("it {words}"),
        [(_, first), others @ ..] if others.iter().all(|(_, words)| words == first) => {
            format!("each {first}")
        }
        _ => {
            let own = signals
                .iter()
                .map(|(name, words)| format!("`{name}` {words}"));
            own.collect::<Vec<_>>().join(", ")
        }
    };
    format!("no {}: {stand_ins}; {cost}", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_that_cost_the_same_share_a_line() {
        let absent = |name, words: &str| (name, words.to_owned());
        let (p, r) = (
            absent("p_deg_s", "is taken as 0"),
            absent("r_deg_s", "is taken as 0"),
        );
        assert_eq!(
            absence(std::slice::from_ref(&p), "much"),
            "no `p_deg_s`: it is taken as 0; much"
        );
        assert_eq!(
            absence(&[p, r], "much"),
            "no `p_deg_s`, `r_deg_s`: each is taken as 0; much"
        );
        let others = [
            absent("q_deg_s", "is taken as 0"),
            absent("an_g", "is taken as 1"),
        ];
        assert_eq!(
            absence(&others, "much"),
            "no `q_deg_s`, `an_g`: `q_deg_s` is taken as 0, `an_g` is taken as 1; much"
        );
    }
}
