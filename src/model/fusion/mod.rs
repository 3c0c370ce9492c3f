//! Posterior of one coefficient: the evidence of the flights, their scales and weights, the Gaussian.

pub mod observation;
pub mod unknowns;
pub mod flight_data;
pub mod posterior;
pub mod observed_differences;
pub mod scales;
pub mod open_scales;
pub mod self_check;
pub mod other_flights;
pub mod held_values;
pub mod coefficient;
