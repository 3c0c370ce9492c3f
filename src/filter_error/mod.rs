//! Filter error: maximum likelihood in moving air (Maine and Iliff 1981; Jategaonkar 2015, chapter
//! 5).
//!
//! Output error attributes the effects of gusts to the derivatives. Filter error adds noise of the
//! air to the states between samples. A filter of steady gain K corrects the predicted state x̂ to
//! x̃ by the measurements z:
//!
//! ```text
//! (1) prediction   x̂(k+1) = f(T x̃(k))
//! (2) innovation   v(k) = z(k) − h(x̂(k))
//! (3) correction   x̃(k) = x̂(k) + K v(k)
//! (4) cost         J = ½ Σ (v' S⁻¹ v + log|S|) + priors
//! ```
//!
//! f is the step of output error, h the outputs, S the covariance of the innovations v. T lets the
//! rotary gusts decay. Derivatives, biases, initial states, process noise and output noise are
//! estimated together; the noise of the measured inputs is given. Without process noise and with
//! exact inputs K is zero, and the innovations are the residuals of output error.
//!
//! | file | content |
//! |---|---|
//! | [`noise`] | parameters of the noise, their priors and floors |
//! | `linearised` | mean system of a maneuver, as a function of its derivatives |
//! | [`input_process_noise`] | noise of surfaces and dynamic pressure as noise of the states |
//! | `riccati` | covariance of the prediction, and its slopes |
//! | `gains` | gain and covariance of the innovations for each pattern of missing outputs |
//! | `gain_computation` | gains for given parameters, with their slopes along all of them |
//! | `reference` | one pass in plain scalar code, which the tests compare with `pass`: read it first |
//! | `measurement_updates` | corrections of states and sensitivities between two steps |
//! | `row_sinks` | receivers of the rows of a pass: sums, or a record of them |
//! | `pass` | one pass: innovations and their sensitivities, in the kernel of output error |
//! | [`response`] | result of a pass: cost, gradient and information |
//! | [`filter`] | a maneuver prepared |
//! | [`joint_filter`] | several maneuvers that share derivatives, or one |
//! | `quadratic_model` | a step within the limits of the noise |
//! | [`scoring`] | the iteration |
//! | [`signal_slopes`] | slopes of rates and outputs along the recorded signals |
//! | `error_propagation` | innovations' changes by errors of the instruments |
//! | [`calibration_gradients`] | effects of the instruments' errors on the gradient |
//! | [`bounds`] | covariance of the estimates, and the effects of held values and calibration |
//! | [`slopes`] | slopes of the derivatives over α, and their effect on the estimates |

pub mod bounds;
pub mod calibration_gradients;
mod error_propagation;
pub mod filter;
mod gain_computation;
mod gains;
mod input_process_noise;
pub mod joint_filter;
mod linearised;
mod measurement_updates;
pub mod noise;
mod pass;
mod quadratic_model;
#[cfg(test)]
mod reference;
pub mod response;
mod riccati;
mod row_sinks;
pub mod scoring;
pub mod signal_slopes;
pub mod slopes;

#[cfg(test)]
pub(crate) mod tests;
