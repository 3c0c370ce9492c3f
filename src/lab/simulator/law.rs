//! Control laws as data: feedback surfaces, allowed deviations, stick gearing.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// One control law.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControlLaw {
    /// Surfaces of the pitch feedback, each with the deflection allowed to it, deg.
    #[serde(default)]
    pub pitch: BTreeMap<String, f64>,
    /// Surfaces of the lateral-directional feedback, each with the deflection allowed to it, deg.
    #[serde(default)]
    pub lateral: BTreeMap<String, f64>,
    /// Allowed deviations from trim.
    #[serde(default)]
    pub hold: AllowedDeviations,
    /// Gearing: pilot control → surface → deg per inch.
    #[serde(default)]
    pub gearing: BTreeMap<String, BTreeMap<String, f64>>,
}

/// Deviations from trim that the feedback weighs against surface deflections: small ones make it
/// stiff. The defaults leave test inputs visible and keep the aircraft at its test point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AllowedDeviations {
    pub velocity_ft_s: f64,
    pub alpha_deg: f64,
    pub q_deg_s: f64,
    pub theta_deg: f64,
    pub beta_deg: f64,
    pub p_deg_s: f64,
    pub r_deg_s: f64,
    pub phi_deg: f64,
}

impl Default for AllowedDeviations {
    fn default() -> Self {
        AllowedDeviations {
            velocity_ft_s: 60.0,
            alpha_deg: 8.0,
            q_deg_s: 15.0,
            theta_deg: 15.0,
            beta_deg: 6.0,
            p_deg_s: 20.0,
            r_deg_s: 10.0,
            phi_deg: 20.0,
        }
    }
}
