//! Signals of recognition that are not recorded, and the cost of each absence in words.

use std::collections::BTreeSet;

use super::settings::Settings;
use crate::maneuver::{Class, Recognition};

/// A flag, pilot control or surface of recognition that is not recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AbsentSignal {
    pub signal: String,
    pub is_flag: bool,
    /// Consequence for the recognition of maneuvers.
    pub cost: String,
    /// Classes whose maneuvers cannot be recognised without it.
    pub unrecognised: Vec<String>,
}

/// Signals that recognition needs and that are not recorded, in alphabetical order.
pub fn absent_signals(
    classes: &[Class],
    settings: &Settings,
    is_recorded: impl Fn(&str) -> bool,
) -> Vec<AbsentSignal> {
    let of_classes = classes.iter().flat_map(|class| class.recognition.signals());
    let of_settings = settings.pilot_controls.iter().map(String::as_str);
    let flag = settings.excitation_flag.as_str();
    let flag = std::iter::once(flag).filter(|flag| !flag.is_empty());
    let needed: BTreeSet<&str> = of_classes.chain(of_settings).chain(flag).collect();
    let absent = needed.into_iter().filter(|signal| !is_recorded(signal));
    let evaluated = absent.map(|signal| {
        let absence = Absence {
            signal,
            classes,
            settings,
            is_recorded: &is_recorded,
        };
        absence.evaluated()
    });
    evaluated.collect()
}

/// One signal that is not recorded, with everything that decides the cost of its absence.
struct Absence<'a> {
    signal: &'a str,
    classes: &'a [Class],
    settings: &'a Settings,
    is_recorded: &'a dyn Fn(&str) -> bool,
}

impl Absence<'_> {
    fn evaluated(&self) -> AbsentSignal {
        let is_flag = self.is_flag();
        let cost = if is_flag {
            self.cost_of_flag()
        } else {
            self.cost_of_input()
        };
        AbsentSignal {
            signal: self.signal.to_owned(),
            is_flag,
            cost,
            unrecognised: self.names(|rule| self.is_unrecognised(rule)),
        }
    }

    fn is_flag(&self) -> bool {
        let mut classes = self.classes.iter();
        self.is_excitation_flag() || classes.any(|c| c.recognition.flags.contains_key(self.signal))
    }

    fn is_excitation_flag(&self) -> bool {
        self.settings.excitation_flag == self.signal
    }

    fn is_control(&self) -> bool {
        self.settings
            .pilot_controls
            .iter()
            .any(|c| c == self.signal)
    }

    fn cost_of_flag(&self) -> String {
        let inputs = "maneuvers are recognised by their inputs alone";
        if self.is_excitation_flag() {
            format!(
                "{inputs}, those close together are separated by their steps, and feedback that answers the pilot may \
                 count as excitation"
            )
        } else {
            format!("{inputs}, and classes that differ in nothing else are `unknown`")
        }
    }

    /// Cost of a control or surface: classes that it leaves without an input, classes that other
    /// inputs recognise, classes of which it is no input.
    fn cost_of_input(&self) -> String {
        let unrecognised = self.names(|rule| self.is_unrecognised(rule));
        let replaced = self.names(|rule| self.is_input(rule) && !self.is_unrecognised(rule));
        let open = self
            .names(|rule| rule.counted().any(|name| name == self.signal) && !self.is_input(rule));
        let mut costs = Vec::new();
        if !unrecognised.is_empty() {
            costs.push(format!(
                "maneuvers of {} cannot be recognised",
                unrecognised.join(", ")
            ));
        }
        if !replaced.is_empty() {
            costs.push(format!(
                "steps of the surfaces stand for its steps in maneuvers of {}",
                replaced.join(", ")
            ));
        }
        if !open.is_empty() {
            let open = open.join(", ");
            costs.push(format!("it neither excludes nor confirms {open}"));
        }
        if self.is_control() {
            costs.push("ordinary flying with it may be taken for a maneuver".to_owned());
        }
        costs.join("; ")
    }

    /// Names of the classes whose recognition satisfies a condition.
    fn names(&self, holds: impl Fn(&Recognition) -> bool) -> Vec<String> {
        let classes = self.classes.iter().filter(|c| holds(&c.recognition));
        classes.map(|class| class.name.clone()).collect()
    }

    fn is_input(&self, rule: &Recognition) -> bool {
        rule.inputs().contains(self.signal)
    }

    /// `true` if the signal is an input of a class and no surface stands for it: surfaces stand for
    /// the steps of pilot controls alone.
    fn is_unrecognised(&self, rule: &Recognition) -> bool {
        let has_surfaces =
            !rule.surfaces.is_empty() && rule.surfaces.iter().all(|s| (self.is_recorded)(s));
        let has_pattern =
            rule.pulses.contains_key(self.signal) || rule.sweep.contains_key(self.signal);
        let is_replaced = self.is_control() && has_surfaces && !has_pattern;
        self.is_input(rule) && !is_replaced
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aero::Axis;
    use crate::maneuver::class::StepCount;
    use crate::segment::Settings;

    /// A class that counts steps: `(signal, at least)`.
    fn class(name: &str, steps: &[(&str, usize)], surfaces: &[&str]) -> Class {
        let count = |(signal, at_least): &(&str, usize)| {
            let count = StepCount {
                at_least: *at_least,
                at_most: 9,
            };
            ((*signal).to_owned(), count)
        };
        Class {
            name: name.to_owned(),
            title: String::new(),
            axis: Axis::Lateral,
            recognition: Recognition {
                flags: [("armed".to_owned(), true)].into(),
                steps: steps.iter().map(count).collect(),
                surfaces: surfaces.iter().map(|s| (*s).to_owned()).collect(),
                ..Recognition::default()
            },
            statuses: [].into(),
            weights: [].into(),
            overrides: vec![],
        }
    }

    fn absent(lacking: &[&str]) -> Vec<AbsentSignal> {
        let classes = [
            class("FLOWN", &[("pedal_in", 4), ("vane_deg", 0)], &["dr_deg"]),
            class("MOVED", &[("dr_deg", 3), ("vane_deg", 2)], &["dr_deg"]),
        ];
        let settings = Settings {
            excitation_flag: "works".to_owned(),
            pilot_controls: vec!["pedal_in".to_owned()],
            ..Settings::default()
        };
        absent_signals(&classes, &settings, |signal| !lacking.contains(&signal))
    }

    fn one(lacking: &[&str], signal: &str) -> AbsentSignal {
        let mut all = absent(lacking).into_iter();
        all.find(|one| one.signal == signal).unwrap()
    }

    #[test]
    fn a_control_for_which_surfaces_stand_costs_no_class() {
        let pedal = one(&["pedal_in"], "pedal_in");
        assert!(pedal.unrecognised.is_empty(), "{pedal:?}");
        assert!(
            pedal
                .cost
                .starts_with("steps of the surfaces stand for its steps in maneuvers of FLOWN;"),
            "{pedal:?}"
        );
        assert!(!pedal.cost.contains("cannot"), "{pedal:?}");
        let without_rudder = one(&["pedal_in", "dr_deg"], "pedal_in");
        assert_eq!(without_rudder.unrecognised, ["FLOWN"]);
    }

    #[test]
    fn a_surface_costs_the_classes_that_it_makes_and_no_others() {
        let vane = one(&["vane_deg"], "vane_deg");
        assert_eq!(
            vane.cost,
            "maneuvers of MOVED cannot be recognised; it neither excludes nor confirms FLOWN"
        );
        assert_eq!(vane.unrecognised, ["MOVED"]);
    }

    #[test]
    fn flags_cost_evidence_alone() {
        for flag in ["armed", "works"] {
            let flag = one(&["armed", "works"], flag);
            assert!(flag.is_flag && flag.unrecognised.is_empty());
            assert!(flag.cost.contains("by their inputs alone"), "{flag:?}");
        }
        assert_eq!(absent(&[]), []);
    }
}
