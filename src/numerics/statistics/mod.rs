//! Statistics: means, order statistics, distributions, random numbers, random effects.

pub mod chi_squared;
#[cfg(test)]
pub mod forecasts;
pub mod matern;
pub mod mean;
pub mod normal;
pub mod order_statistics;
pub mod random;
pub mod random_effects;
pub mod student;
