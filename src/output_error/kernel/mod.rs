//! The kernel: one pass over a maneuver. It gives outputs, sensitivities, and the sums of the cost
//! (1.2), its gradient (1.4) and the Gauss-Newton second gradient (1.5).
//!
//! [`reference`] is the same pass in plain scalar code, to be read first. The fast pass goes chunk
//! by chunk. [`chunk_build_up`] has the build-up at a chunk's points, and [`chunk_regressors`] the
//! regressors there. [`trajectory`] integrates the states, and [`propagators`] turns each step into
//! matrices. [`propagation`] takes all sensitivities through the steps with these matrices.
//! [`chunk_rows`] has those of the outputs, and [`normal_equations`] adds up the sums. [`pass`] runs
//! all of these, and [`response`] is what a caller sees.

pub(crate) mod chunk_build_up;
pub(crate) mod chunk_regressors;
pub(crate) mod chunk_rows;
pub(crate) mod normal_equations;
pub(crate) mod pass;
pub(crate) mod propagation;
pub(crate) mod propagators;
pub mod reference;
pub(crate) mod response;
pub(crate) mod trajectory;
