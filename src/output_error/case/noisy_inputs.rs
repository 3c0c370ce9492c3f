//! Inputs whose white noise the equations interpret as motion.

use super::surface_noise::NoisySurface;

/// White noise of the inputs of a maneuver; none by default.
#[derive(Clone, Debug, Default)]
pub struct NoisyInputs {
    pub surfaces: Vec<NoisySurface>,
    /// Relative variance of the dynamic pressure's noise.
    pub pressure_variance: f64,
}

impl NoisyInputs {
    /// `true` if no input has noise.
    #[must_use]
    pub fn are_exact(&self) -> bool {
        self.surfaces.is_empty() && self.pressure_variance == 0.0
    }
}
