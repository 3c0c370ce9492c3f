//! Numerical methods that several modules share: linear algebra and dual numbers, distributions and
//! order statistics, differences, sums over time and frequency, bisection, roots and minima, random
//! numbers, and the processor's vectors.

pub mod bisection;
pub mod chi_squared;
pub(crate) mod cubic_curve;
pub mod damping;
pub mod differences;
pub(crate) mod digits;
pub mod dual;
#[cfg(test)]
pub mod forecasts;
pub(crate) mod harmonics;
pub(crate) mod lanes;
pub(crate) mod matrix;
pub mod mean;
pub mod minimise;
pub mod normal;
pub mod order_statistics;
pub mod random;
pub mod random_effects;
pub mod root;
pub(crate) mod row_products;
pub mod runge_kutta;
pub(crate) mod sample_count;
pub(crate) mod simd;
pub(crate) mod small;
pub mod student;
pub mod symmetric;
pub mod trapezoid;
pub mod triangular;
pub mod trig;
