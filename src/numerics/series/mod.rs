//! Series of samples: counts, differences, integrals, Fourier sums.

pub mod differences;
pub(crate) mod harmonics;
pub(crate) mod sample_count;
pub mod trapezoid;
