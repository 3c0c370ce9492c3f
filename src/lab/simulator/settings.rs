//! Settings: what the simulated aircraft is besides its geometry and derivatives: rates, loadings,
//! engines, surfaces, laws.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::actuators::Actuator;
use super::control::Law;
use super::engine::Engine;
use super::loading::Loading;
use super::trim::TrimSurfaces;

/// The simulated aircraft and the clock of the simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Samples per second of the recorder. Default 40.
    #[serde(default = "default_rate")]
    pub rate_hz: f64,
    /// Control steps per second, a multiple of the recorder's: surfaces and gusts are linear
    /// between them. At the recorder's own rate the recorded surfaces are all there is to know of
    /// their motion. Default 80.
    #[serde(default = "default_control")]
    pub control_hz: f64,
    /// Integration steps per control step. Default 4.
    #[serde(default = "default_parts")]
    pub parts: u32,
    /// By ascending mass.
    pub loadings: Vec<Loading>,
    pub engine: Engine,
    /// Surface's signal → its actuator.
    pub surfaces: BTreeMap<String, Actuator>,
    pub trim: TrimSurfaces,
    /// Surface's signal → its schedule.
    #[serde(default)]
    pub schedules: BTreeMap<String, Schedule>,
    pub laws: BTreeMap<String, Law>,
    /// The surfaces in the order of simulation.
    #[serde(skip)]
    pub surface_names: Vec<String>,
}

/// A surface that follows the angle of attack: linear between the points, constant beyond.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Schedule {
    pub alpha_deg: Vec<f64>,
    pub deflection_deg: Vec<f64>,
    /// Time constant with which the schedule's α follows the aircraft's. Default 0.2 s.
    #[serde(default = "default_follow")]
    pub lag_s: f64,
}

fn default_rate() -> f64 {
    40.0
}
fn default_control() -> f64 {
    80.0
}
fn default_parts() -> u32 {
    4
}
fn default_follow() -> f64 {
    0.2
}

impl Schedule {
    /// The deflection at an angle of attack.
    #[must_use]
    pub fn at(&self, alpha_deg: f64) -> f64 {
        let points: Vec<(f64, f64)> = self
            .alpha_deg
            .iter()
            .copied()
            .zip(self.deflection_deg.iter().copied())
            .collect();
        let (Some(first), Some(last)) = (points.first(), points.last()) else {
            return 0.0;
        };
        if alpha_deg <= first.0 {
            return first.1;
        }
        let segment = points.windows(2).find(|w| alpha_deg < w[1].0);
        segment.map_or(last.1, |w| {
            w[0].1 + (alpha_deg - w[0].0) / (w[1].0 - w[0].0) * (w[1].1 - w[0].1)
        })
    }
}

impl Settings {
    /// The place of a surface in the order of simulation.
    ///
    /// # Errors
    /// A sentence, when it is not simulated.
    pub fn place(&self, surface: &str) -> Result<usize, String> {
        let place = self.surface_names.iter().position(|s| s == surface);
        place.ok_or_else(|| {
            let near =
                crate::error::did_you_mean(surface, self.surface_names.iter().map(String::as_str));
            format!("`surfaces` has no `{surface}`{near}")
        })
    }

    /// Every surface's scheduled deflection at an angle of attack, zero for one without schedule.
    #[must_use]
    pub fn scheduled(&self, alpha_deg: f64) -> Vec<f64> {
        let at = |name: &String| self.schedules.get(name).map_or(0.0, |s| s.at(alpha_deg));
        self.surface_names.iter().map(at).collect()
    }

    /// Control steps per sample.
    #[must_use]
    pub fn steps_per_sample(&self) -> usize {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "rounded and at least one"
        )]
        let steps = (self.control_hz / self.rate_hz).round().max(1.0) as usize;
        steps
    }

    /// What is wrong with the settings, or the names of the surfaces in their order.
    pub(super) fn checked(mut self) -> Result<Settings, String> {
        self.surface_names = self.surfaces.keys().cloned().collect();
        let per_sample = self.control_hz / self.rate_hz;
        if !(self.rate_hz > 0.0
            && per_sample >= 1.0
            && (per_sample - per_sample.round()).abs() < 1e-9)
        {
            return Err("`control_hz` must be a multiple of `rate_hz`".into());
        }
        if self.parts == 0 {
            return Err("`parts` must be at least 1".into());
        }
        let sound = |l: &Loading| l.mass_slug > 0.0 && l.inertia().cholesky().is_some();
        if self.loadings.is_empty() || !self.loadings.iter().all(sound) {
            return Err("`loadings` needs at least one, with positive mass and inertias that a body can have".into());
        }
        if !self
            .loadings
            .windows(2)
            .all(|w| w[0].mass_slug < w[1].mass_slug)
        {
            return Err("`loadings` must stand by ascending `mass_slug`".into());
        }
        let schedules = self.schedules.iter();
        for (name, schedule) in schedules {
            let ascending = schedule.alpha_deg.windows(2).all(|w| w[0] < w[1]);
            if schedule.alpha_deg.len() != schedule.deflection_deg.len() || !ascending {
                return Err(format!(
                    "schedule of `{name}`: as many deflections as angles, these ascending"
                ));
            }
        }
        let trimmers = self
            .trim
            .pitch
            .iter()
            .map(|t| &t.signal)
            .chain([&self.trim.roll, &self.trim.yaw]);
        let in_laws = self.laws.values().flat_map(|law| {
            law.pitch
                .keys()
                .chain(law.lateral.keys())
                .chain(law.gearing.values().flat_map(BTreeMap::keys))
        });
        for name in trimmers.chain(in_laws).chain(self.schedules.keys()) {
            self.place(name)?;
        }
        Ok(self)
    }
}
