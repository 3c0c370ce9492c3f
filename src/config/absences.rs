//! Optional parts that a pipeline lacks, and the cost of each absence.

use super::checked::Config;
use crate::aero::{Axis, Output};
use crate::flight::signal;
use crate::flight::stand_in::{StandIn, cost};

impl Config {
    /// One line for each part that the pipeline lacks: its substitute, and the cost.
    #[must_use]
    pub fn absences(&self) -> Vec<String> {
        let mut lines = Vec::new();
        lines.extend(self.no_tunnel());
        lines.extend(self.absent_signals());
        lines.extend(self.lost_axes());
        lines.extend(self.no_excitation_flag());
        lines.extend(self.no_pilot_controls());
        lines
    }

    /// `true` for a signal of a channel.
    fn is_recorded(&self, signal: &str) -> bool {
        self.channels
            .values()
            .any(|channel| channel.signal == signal)
    }

    /// `true` for a signal of a channel or a constant.
    fn has_signal(&self, signal: &str) -> bool {
        self.is_recorded(signal) || self.constants.contains_key(signal)
    }

    fn no_tunnel(&self) -> Option<String> {
        if self.wind_tunnel.is_some() {
            return None;
        }
        let held = match self.held_at_nothing {
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
        let has_rotors = self.aircraft.engine_inertia_slug_ft2 > 0.0;
        let is_rotor = |signal: &str| [signal::RPM_LEFT, signal::RPM_RIGHT].contains(&signal);
        let mut costs: Vec<(&str, Vec<(&str, String)>)> = Vec::new();
        for signal in lacking.filter(|signal| has_rotors || !is_rotor(signal)) {
            let Some(stand_in) = StandIn::of(signal, has) else {
                continue;
            };
            let (own, absent) = (cost(signal, has), (signal, stand_in.in_words()));
            match costs.iter_mut().find(|(cost, _)| *cost == own) {
                Some((_, signals)) => signals.push(absent),
                None => costs.push((own, vec![absent])),
            }
        }
        let mut lines: Vec<String> = costs.iter().map(|(cost, s)| absence(s, cost)).collect();
        let optional = signal::OPTIONAL.into_iter();
        let absent = optional.filter(|signal| !has(signal));
        lines.extend(absent.map(|signal| format!("no `{signal}`: {}", cost(signal, has))));
        lines
    }

    /// Axes whose states are not all recorded, with the classes that no maneuver can have.
    fn lost_axes(&self) -> Vec<String> {
        let line = |axis: Axis| {
            let states = axis.outputs().into_iter().filter(|o| o.is_state());
            let lacking = states.map(Output::signal);
            let lacking = lacking.filter(|signal| !self.is_recorded(signal));
            let lacking: Vec<&str> = lacking.collect();
            let classes = self.classes.iter().filter(|class| class.axis == axis);
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
        self.segment.excitation_flag.is_empty().then(|| {
            "no `segment: excitation_flag`: maneuvers close together are told apart by their steps \
             alone, and feedback that answers the pilot may count as excitation"
                .to_owned()
        })
    }

    fn no_pilot_controls(&self) -> Option<String> {
        self.segment.pilot_controls.is_empty().then(|| {
            "no `segment: pilot_controls`: steps of surfaces stand for the pilot's, and ordinary \
             flying with steps may be taken for a maneuver"
                .to_owned()
        })
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
