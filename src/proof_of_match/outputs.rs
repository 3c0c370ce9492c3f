//! Outputs of a simulation that can be matched, in one order.

use crate::rigid_body::Readings;
use crate::tables::MatchedQuantity;

/// Number of outputs.
pub const COUNT: usize = MATCHED.len();

/// Outputs in their order.
pub const MATCHED: [MatchedQuantity; 11] = [
    MatchedQuantity::AlphaVane,
    MatchedQuantity::BetaVane,
    MatchedQuantity::Velocity,
    MatchedQuantity::RollRate,
    MatchedQuantity::PitchRate,
    MatchedQuantity::YawRate,
    MatchedQuantity::PitchAttitude,
    MatchedQuantity::Bank,
    MatchedQuantity::NormalAcceleration,
    MatchedQuantity::AxialAcceleration,
    MatchedQuantity::LateralAcceleration,
];

/// Values of the outputs at one sample.
pub type Outputs = [f64; COUNT];

/// Index of a quantity among the outputs; `None` for one that is no time history.
#[must_use]
pub fn output_index(quantity: MatchedQuantity) -> Option<usize> {
    MATCHED.iter().position(|own| *own == quantity)
}

/// Outputs from the readings of the sensors and the airspeed.
#[must_use]
pub fn outputs(readings: &Readings, velocity_ft_s: f64) -> Outputs {
    let [p, q, r] = readings.rates_deg_s;
    let [phi, theta, _] = readings.euler_deg;
    [
        readings.alpha_vane_deg,
        readings.beta_vane_deg,
        velocity_ft_s,
        p,
        q,
        r,
        theta,
        phi,
        readings.an_g,
        readings.ax_g,
        readings.ay_g,
    ]
}
