//! Flight plan: the cards that lower the uncertainty of tonight's posterior most in the minutes of
//! the next flight.
//!
//! Each candidate is rehearsed ([`rehearsal`]): the laboratory's simulator flies it with the
//! derivatives of the posterior and records it with the campaign's noise. It is then estimated like
//! a flown maneuver. Its covariance is the card's evidence in the campaign's model
//! ([`crate::model::Outlook`]), so its effect on each bound follows without flying it. A goal is a
//! linear combination of the derivatives ([`goal_points`]). It is a single derivative, or the
//! quantity that decides a level or a proof of match ([`decision`]). [`choice`] finds the set that
//! is worth most in the minutes, [`plan`] writes the tables, and [`kneeboard`] the pilot's page.

mod candidate;
mod goals;
mod decision;
mod goal_points;
mod goal_file;
mod limits;
mod experience;
mod rehearsal;
mod choice;
mod plan;
mod kneeboard;
mod next_flight;
#[cfg(test)]
mod tests;

pub use next_flight::{PlannedFlight, Request, plan_next_flight};
