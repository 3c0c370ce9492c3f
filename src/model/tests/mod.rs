//! Tests of the posterior: its exact limits, its derivatives, and simulated campaigns.

mod angle;
mod fixture;
mod held;
mod lift_and_drag;
mod limits;
mod outlook;
mod parts;
mod simulated;
