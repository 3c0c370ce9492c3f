//! Matrices: products, Cholesky's method, symmetric positive definite matrices, square roots.

pub(crate) mod matrix;
pub mod root;
pub(crate) mod small;
pub mod symmetric;
pub mod triangular;
