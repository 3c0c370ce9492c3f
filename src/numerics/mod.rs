//! Numerical methods that several modules share: linear algebra and dual numbers, distributions and
//! order statistics, differences, sums over time and frequency, bisection, roots and minima, random
//! numbers, and the processor's vectors.

pub mod linear_algebra;
pub mod vectors;
pub mod statistics;
pub mod series;
pub mod bisection;
pub(crate) mod cubic_curve;
pub mod damping;
pub(crate) mod digits;
pub mod dual;
pub mod minimise;
pub mod runge_kutta;
pub mod trig;
