//! Tests of the posterior: its exact limits, its derivatives, and simulated campaigns.

mod fixture;
mod held;
mod limits;
mod parts;
mod simulated;
