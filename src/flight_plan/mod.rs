//! Flight plan: the cards that lower the uncertainty of tonight's posterior most in the minutes of
//! the next flight.
//!
//! Each candidate is rehearsed: flown by the laboratory's simulator with the derivatives of the
//! posterior, recorded with the campaign's noise, and estimated as a flown maneuver is
//! ([`rehearsal`]). Its covariance is the card's evidence in the campaign's model
//! ([`crate::model::Outlook`]), so its effect on each bound follows without flying it. A goal is a
//! linear combination of the derivatives ([`goal_points`]): one of them, or what decides a level or
//! a proof of match ([`decision`]). [`choice`] finds the set that is worth most in the minutes,
//! [`plan`] writes the tables, and [`kneeboard`] the pilot's page.

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
