//! Settings of the simulated aircraft besides geometry and derivatives: rates, loadings, engines,
//! surfaces, trim, control laws.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::actuators::Actuator;
use super::engine::Engine;
use super::law::ControlLaw;
use crate::error::did_you_mean;
use crate::rigid_body::Loading;

/// Simulated aircraft and rates of the simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Recorded samples per second. Default 40.
    #[serde(default = "default_rate")]
    pub rate_hz: f64,
    /// Control steps per second, a multiple of `rate_hz`; surfaces and gusts are linear between
    /// control steps. At `rate_hz` itself the record contains the exact surface motion. Default 80.
    #[serde(default = "default_control")]
    pub control_hz: f64,
    /// Integration steps per control step. Default 4.
    #[serde(default = "default_parts")]
    pub parts: u32,
    /// By ascending mass.
    pub loadings: Vec<Loading>,
    pub engine: Engine,
    /// Actuators by surface signal.
    pub surfaces: BTreeMap<String, Actuator>,
    pub trim: TrimSurfaces,
    /// Schedules by surface signal.
    #[serde(default)]
    pub schedules: BTreeMap<String, Schedule>,
    pub laws: BTreeMap<String, ControlLaw>,
    /// Surface signals in the order of simulation.
    #[serde(skip)]
    pub surface_names: Vec<String>,
}

/// Surfaces used for trim.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrimSurfaces {
    /// Pitch surfaces by priority: the first that trims within its limits is used; those before it
    /// stay at their limits.
    pub pitch: Vec<PitchTrimmer>,
    pub roll: String,
    pub yaw: String,
}

/// A pitch surface with the limits for its use in trim.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PitchTrimmer {
    pub signal: String,
    pub lower_deg: f64,
    pub upper_deg: f64,
}

/// Deflection scheduled with the angle of attack: linear between the points, constant outside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Schedule {
    pub alpha_deg: Vec<f64>,
    pub deflection_deg: Vec<f64>,
    /// Time constant of the α that enters the schedule. Default 0.2 s.
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
    /// Deflection at an angle of attack.
    #[must_use]
    pub fn deflection_at(&self, alpha_deg: f64) -> f64 {
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
    /// Index of a surface in the order of simulation.
    ///
    /// # Errors
    /// The message for a surface that is not simulated.
    pub fn surface_index(&self, surface: &str) -> Result<usize, String> {
        let index = self.surface_names.iter().position(|s| s == surface);
        index.ok_or_else(|| {
            let near = did_you_mean(surface, self.surface_names.iter().map(String::as_str));
            format!("`surfaces` has no `{surface}`{near}")
        })
    }

    /// Scheduled deflections of all surfaces at an angle of attack; 0 for a surface without schedule.
    #[must_use]
    pub fn scheduled_deflections(&self, alpha_deg: f64) -> Vec<f64> {
        let scheduled = |name: &String| {
            self.schedules
                .get(name)
                .map_or(0.0, |s| s.deflection_at(alpha_deg))
        };
        self.surface_names.iter().map(scheduled).collect()
    }

    /// Number of control steps per recorded sample.
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

    /// Checks the settings and fills `surface_names`.
    ///
    /// # Errors
    /// The message for the first setting that is wrong.
    pub fn checked(mut self) -> Result<Settings, String> {
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
        let is_valid = |l: &Loading| l.mass_slug > 0.0 && l.inertia().cholesky().is_some();
        if self.loadings.is_empty() || !self.loadings.iter().all(is_valid) {
            return Err(
                "`loadings` needs at least one entry with positive mass and a positive definite \
                 inertia matrix"
                    .into(),
            );
        }
        if !self
            .loadings
            .windows(2)
            .all(|w| w[0].mass_slug < w[1].mass_slug)
        {
            return Err("`loadings` must be in order of ascending `mass_slug`".into());
        }
        for (name, actuator) in &self.surfaces {
            actuator
                .check()
                .map_err(|e| format!("surface `{name}`: {e}"))?;
        }
        if let Some(trimmer) = self.trim.pitch.iter().find(|t| t.lower_deg > t.upper_deg) {
            return Err(format!(
                "trim by `{}`: `lower_deg` must not be above `upper_deg`",
                trimmer.signal
            ));
        }
        let schedules = self.schedules.iter();
        for (name, schedule) in schedules {
            let ascending = schedule.alpha_deg.windows(2).all(|w| w[0] < w[1]);
            if schedule.alpha_deg.len() != schedule.deflection_deg.len() || !ascending {
                return Err(format!(
                    "schedule of `{name}`: `alpha_deg` must ascend and have as many entries as \
                     `deflection_deg`"
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
            self.surface_index(name)?;
        }
        Ok(self)
    }
}
