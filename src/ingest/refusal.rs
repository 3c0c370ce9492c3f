//! Reasons for which ingest refuses a flight, a stretch or a channel.

use crate::error::{Problem, ProblemStage};
use crate::flight::stand_in::cost;
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
        let cost = cost(signal, |other| stand_in_of(other).is_none());
        let consequence = match stand_in_of(signal) {
            Some((name, stand_in)) => format!("; `{name}` {}: {cost}", stand_in.in_words()),
            None if signal::OPTIONAL.contains(&signal) => format!("; {cost}"),
            None => String::new(),
        };
        Refusal {
            reason: format!("{}{consequence}", self.reason),
            ..self
        }
    }

    /// The problem of a flight or stretch.
    #[must_use]
    pub fn into_problem(self, flight_id: &str) -> Problem {
        Problem {
            stage: ProblemStage::Ingest,
            flight_id: flight_id.to_owned(),
            place: self.place,
            reason: self.reason,
        }
    }
}
