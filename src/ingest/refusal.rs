//! Reasons for which ingest refuses a flight, a stretch or a channel.

use crate::error::{Problem, ProblemStage};
use crate::flight::absence::remedies;
use crate::flight::stand_in::consequence_of_absence;
use crate::flight::{StandIn, signal};

/// A place in the recording and the reason for which it cannot be used; a [`Problem`] without its
/// flight.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    pub place: String,
    pub reason: String,
}

impl Refusal {
    /// A refusal at a channel, by its name in the channel map.
    #[must_use]
    pub fn of_channel(name: &str, reason: String) -> Refusal {
        Refusal {
            place: format!("channel `{name}`"),
            reason,
        }
    }

    /// This refusal with the stand-in of the signal that is left out, and the cost of its absence.
    #[must_use]
    pub fn with_stand_in(self, signal: &str, stand_ins: &[(String, StandIn)]) -> Refusal {
        let stand_in_of = |signal: &str| {
            let mut present = stand_ins.iter().filter(|(_, s)| *s != StandIn::Absent);
            present.find(|(name, _)| name == signal)
        };
        let consequence = consequence_of_absence(signal, |other| stand_in_of(other).is_none());
        let consequence = match stand_in_of(signal) {
            Some((name, stand_in @ StandIn::Mean(_))) => {
                format!(
                    "; `{name}` {}: its changes are left out",
                    stand_in.in_words()
                )
            }
            Some((name, stand_in @ StandIn::Typical { .. })) => {
                format!(
                    "; `{name}` {}: the scatter is in the bounds of the derivatives",
                    stand_in.in_words()
                )
            }
            Some((name, stand_in)) => format!("; `{name}` {}: {consequence}", stand_in.in_words()),
            None if signal::OPTIONAL.contains(&signal) => format!("; {consequence}"),
            None => String::new(),
        };
        Refusal {
            reason: format!("{}{consequence}", self.reason),
            ..self
        }
    }

    /// Refusal of a flight for required signals without a source: at the channel of each where the
    /// channel map has one, with the remedies.
    pub(super) fn of_signals(signals: &[&str], left_out: Vec<UnreadChannel>) -> Refusal {
        let mut own = left_out;
        own.retain(|one| signals.contains(&one.signal));
        let advice = remedies(signals);
        let advice = match own.len() {
            0 => format!(": {advice}"),
            1 => format!(
                ". Where the recorder lacks it, replace its line in the channel map: {advice}"
            ),
            _ => {
                format!(
                    ". Where the recorder lacks them, replace their lines in the channel map: {advice}"
                )
            }
        };
        let at_channel = |signal: &str| own.iter().find(|one| one.signal == signal);
        let refusals: Vec<Refusal> = signals
            .iter()
            .map(|signal| match at_channel(signal) {
                Some(one) => one.refusal.clone(),
                None => without_channel(signal),
            })
            .collect();
        let places: Vec<&str> = refusals.iter().map(|r| r.place.as_str()).collect();
        let reasons: Vec<&str> = refusals.iter().map(|r| r.reason.as_str()).collect();
        Refusal {
            place: places.join(", "),
            reason: format!("{}{advice}", reasons.join("; ")),
        }
    }

    /// The problem of a flight or stretch.
    #[must_use]
    pub fn into_problem(self, flight_id: &str) -> Problem {
        self.of_stage(ProblemStage::Ingest, flight_id)
    }

    /// The problem of a flight or stretch at a stage.
    #[must_use]
    pub(super) fn of_stage(self, stage: ProblemStage, flight_id: &str) -> Problem {
        Problem {
            stage,
            flight_id: flight_id.to_owned(),
            place: self.place,
            reason: self.reason,
        }
    }
}

/// A channel that is left out of a flight.
pub(super) struct UnreadChannel<'a> {
    pub signal: &'a str,
    pub refusal: Refusal,
    /// `false` for a channel whose recorded values cannot be used.
    pub is_absent: bool,
}

impl UnreadChannel<'_> {
    /// The row of a flight that is read without the channel: the stand-in and the cost.
    pub(super) fn into_problem(self, stand_ins: &[(String, StandIn)], flight_id: &str) -> Problem {
        let stage = if self.is_absent {
            ProblemStage::Recording
        } else {
            ProblemStage::Ingest
        };
        let refusal = self.refusal.with_stand_in(self.signal, stand_ins);
        refusal.of_stage(stage, flight_id)
    }
}

/// Refusal of a required signal that has no channel, no constant and no stand-in.
fn without_channel(signal: &str) -> Refusal {
    Refusal {
        place: format!("signal `{signal}`"),
        reason: format!("signal `{signal}` is neither a channel nor a constant"),
    }
}
