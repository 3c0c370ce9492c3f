//! Everything that all maneuvers of a campaign are estimated with.

use super::settings::Settings;
use crate::aero::{AeroModel, WindTunnel};
use crate::aircraft::Aircraft;
use crate::surfaces::DelayCorrection;

/// Everything that all maneuvers of a campaign are estimated with.
#[derive(Clone, Debug)]
pub struct Context<'a> {
    pub aircraft: &'a Aircraft,
    pub aero_model: &'a AeroModel,
    pub tunnel: &'a WindTunnel,
    /// Table of starting values: the tunnel's, except in studies of the iteration.
    pub start: &'a WindTunnel,
    pub settings: &'a Settings,
    /// Delays of the surfaces: the records are corrected, uncertainties are common to all maneuvers.
    pub delays: &'a [DelayCorrection],
}

impl<'a> Context<'a> {
    /// A context whose table of starting values is the tunnel's.
    #[must_use]
    pub fn new(
        aircraft: &'a Aircraft,
        aero_model: &'a AeroModel,
        tunnel: &'a WindTunnel,
        settings: &'a Settings,
    ) -> Context<'a> {
        Context {
            aircraft,
            aero_model,
            tunnel,
            start: tunnel,
            settings,
            delays: &[],
        }
    }

    /// The context of records whose surfaces' delays are corrected.
    #[must_use]
    pub fn with_delays(self, delays: &'a [DelayCorrection]) -> Context<'a> {
        Context { delays, ..self }
    }
}
