//! Results of the posterior: rows of tables, local values, draws, and the outlook on planned flights.

pub mod published;
pub mod rows;
pub mod campaign_model;
pub mod with_held;
pub mod lift_and_drag;
pub mod draws;
pub mod local;
pub mod outlook;
