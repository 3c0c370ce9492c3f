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

    fn absent_signals(&self) -> Vec<String> {
        let required = signal::REQUIRED.iter().copied();
        let lacking = required.filter(|signal| !self.has_signal(signal));
        let line = |signal: &str| {
            let stand_in = StandIn::of(signal, |other| self.has_signal(other))?;
            let (words, cost) = (stand_in.in_words(), cost(signal));
            Some(format!("no `{signal}`: it {words}; {cost}"))
        };
        let mut lines: Vec<String> = lacking.filter_map(line).collect();
        if !self.has_signal(signal::PSI) {
            lines.push(format!("no `{}`: {}", signal::PSI, cost(signal::PSI)));
        }
        lines
    }

    /// Axes whose outputs are not all recorded, with the classes that no maneuver can have.
    fn lost_axes(&self) -> Vec<String> {
        let line = |axis: Axis| {
            let outputs = axis.outputs().into_iter();
            let lacking = outputs.map(Output::signal);
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
