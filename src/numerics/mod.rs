//! Numerical methods that several modules share. Rooms hold linear algebra, the processor's
//! vectors, statistics, and series of samples; files hold roots, minima, slopes and integration.

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
