//! Series of samples: counts, finite values, differences, integrals, Fourier sums, products at lags.

pub mod differences;
pub(crate) mod finite_places;
pub(crate) mod harmonics;
pub(crate) mod lagged_products;
pub(crate) mod sample_count;
pub mod trapezoid;
