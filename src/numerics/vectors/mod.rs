//! Vectors of the processor: loads and stores, lanes, sums over rows.

pub(crate) mod lanes;
pub(crate) mod row_products;
pub(crate) mod simd;
