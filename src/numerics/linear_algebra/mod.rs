//! Matrices: products, Cholesky's method, symmetric positive definite matrices, square roots.

pub(crate) mod matrix;
pub mod root;
pub(crate) mod small;
pub mod symmetric;
pub mod triangular;

/// Columns of a block where only a part of a matrix is computed.
const BLOCK: usize = 64;
