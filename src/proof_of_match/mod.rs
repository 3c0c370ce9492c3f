//! Proof of match: does the simulator still match the aircraft? Each maneuver is flown again by a
//! body with six degrees of freedom, and judged by the tolerances of a standard.
//!
//! [`recording`] is the maneuver as recorded: inputs and outputs. [`derivative_table`] and
//! [`aerodynamics`] are the model that flies it, [`free_run`] the flight, [`linear_run`] the slopes
//! of its outputs, and [`start`] its initial state and trim. [`specification`] has the tolerances,
//! which are the analyst's data; [`judgement`] compares, and [`dutch_roll`] adds the modes of the
//! flight's own estimates; [`mean_run`] is the run at the posterior's mean with the part of the flight
//! that it does not explain, [`repeat_flight`] adds the probability that a repeat flight passes, and
//! [`mod@decisive_difference`] the difference that decides it, as a linear function of the
//! derivatives.

mod specification;
mod outputs;
mod derivative_table;
mod aerodynamics;
mod recording;
mod load_changes;
mod free_run;
mod linear_run;
mod start;
mod dutch_roll;
mod judgement;
mod mean_run;
mod repeat_flight;
mod decisive_difference;
mod maneuver;
mod models;
#[cfg(test)]
mod tests;

pub use decisive_difference::DecisiveDifference;
pub use dutch_roll::OwnEstimates;
pub use maneuver::{
    Matched, ProofInputs, RecordedManeuver, decisive_difference, fly_again, not_flown,
};
pub use models::{of_posterior, of_trends};
pub use specification::{Specification, Test, Tolerance};
