//! Reasons for which ingest refuses a flight, a stretch or a channel.

use crate::error::{Problem, ProblemStage};

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
