//! Rows of the table `problems`.

use crate::error::{Problem, ProblemStage};

/// A problem of a flight at a place: a file, a channel, a maneuver or a time.
pub fn problem(stage: ProblemStage, flight_id: &str, place: &str, reason: &str) -> Problem {
    Problem {
        stage,
        flight_id: flight_id.to_owned(),
        place: place.to_owned(),
        reason: reason.to_owned(),
    }
}
