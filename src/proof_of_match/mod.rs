//! Proof of match: comparison of simulators with the aircraft. Each maneuver is flown again by a
//! body with six degrees of freedom, and judged by the tolerances of a standard.
//!
//! - [`maneuver_recording`]: the maneuver as recorded, inputs and outputs;
//! - [`derivative_table`], [`factor`] and [`aerodynamics`]: the model that flies it again;
//! - [`free_run`]: the flight, and [`linear_run`]: the slopes of its outputs;
//! - [`start`]: initial state and trim;
//! - [`specification`]: tolerances, which are the analyst's data;
//! - [`judgement`]: comparison with the tolerances;
//! - [`dutch_roll`]: modes by the maneuver's own estimates;
//! - [`mean_run`]: run at the posterior's mean, and the part of the flight that it does not explain;
//! - [`repeat_flight`]: probability that a repeat flight passes;
//! - [`mod@decisive_difference`]: the difference that decides whether it passes, as a linear
//!   function of the derivatives.

mod specification;
mod outputs;
mod derivative_table;
mod factor;
mod aerodynamics;
mod maneuver_recording;
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
