//! Free runs, judgement and probabilities, on maneuvers of the laboratory's simulator.

mod aerodynamics;
mod decisive_difference;
mod dutch_roll;
mod fixture;
mod free_run;
mod judgement;
mod lag;
mod linear_run;
mod repeat_flight;
mod wrong_models;
