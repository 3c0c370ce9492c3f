//! Output error: maximum likelihood by matching the outputs of the integrated equations to the
//! measured ones (eqs. 1.1-1.7).
//!
//! The rooms in order; each uses only those before it:
//!
//! | room | content |
//! |---|---|
//! | [`case`] | one maneuver prepared for estimation: regressors, held and free parameters, layout |
//! | [`kernel`] | one pass: outputs, sensitivities and the sums of the normal equations |
//! | [`likelihood`] | cost (1.2), iteration (1.3), equation-error start, several maneuvers as one |
//! | [`bounds`] | Cramér-Rao bounds (1.6, 1.7) corrected for coloured residuals and input noise |
//! | [`identifiability`] | collinearity of the parameters, and the choice of those to hold |
//! | [`estimation`] | iteration, weights and bounds together |

pub(crate) mod bounds;
pub(crate) mod case;
pub mod estimation;
pub mod identifiability;
pub mod kernel;
pub mod likelihood;

pub use bounds::bounded::Bounded;
pub use bounds::{calibration_errors, coloured, consider, cramer_rao};
pub use case::layout::MOST_PRODUCTS;
pub use case::noisy_inputs::NoisyInputs;
pub use case::{Case, InitialState, Measurements, Model};
pub use case::{pressure_noise, surface_noise};
pub use identifiability::holding;
pub use kernel::pass::Diverged;
pub use kernel::response::{Detail, Response, Sensitivities};
pub use likelihood::definition::Likelihood;
pub use likelihood::joint::Joint;
pub use likelihood::outcome::{Fit, Outcome};
pub use likelihood::{cost, equation_error, error_effect, mean, newton_raphson, sharing, theil};

#[cfg(test)]
pub(crate) mod tests;
