//! The motion that the channels of a record describe, block by block: what the kinematic relations
//! tie together.
//!
//! Angles are rad, everything else ft, s and g. Velocities u, v, w are V's components from the
//! angles at the c.g.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Checks;
use crate::aircraft::{Aircraft, Flow, Position};
use crate::earth::gravity_ft_s2;
use crate::flight::{Correction, signal};
use crate::units::{DEG, G0_FT_S2, M_PER_FT};

/// The signals that the relations use.
const USED: &[&str] = &[
    signal::ALPHA_VANE,
    signal::BETA_VANE,
    signal::VELOCITY,
    signal::MACH,
    signal::ALTITUDE,
    signal::P,
    signal::Q,
    signal::R,
    signal::THETA,
    signal::PHI,
    signal::PSI,
    signal::AN,
    signal::AX,
    signal::AY,
    signal::QBAR,
    signal::X_CG,
    signal::Y_CG,
    signal::Z_CG,
];

/// Averages a signal over short blocks as its samples come by; a block with fewer than half of its
/// samples is NaN.
#[derive(Clone, Debug)]
pub struct Averaging {
    length: usize,
    sum: f64,
    known: usize,
    seen: usize,
    means: Vec<f64>,
}

impl Averaging {
    /// For a signal that a relation uses; none for the others.
    #[must_use]
    pub fn of(signal: &str, step_s: f64, settings: &Checks) -> Option<Averaging> {
        let length = block_length(step_s, settings);
        USED.contains(&signal).then(|| Averaging {
            length,
            sum: 0.0,
            known: 0,
            seen: 0,
            means: Vec::new(),
        })
    }

    /// The next samples.
    pub fn push(&mut self, values: &[f64]) {
        let mut values = values;
        while !values.is_empty() {
            let (now, later) = values.split_at(values.len().min(self.length - self.seen));
            for value in now.iter().filter(|v| v.is_finite()) {
                self.sum += value;
                self.known += 1;
            }
            self.seen += now.len();
            values = later;
            if self.seen == self.length {
                let mean = if 2 * self.known >= self.length {
                    self.sum / self.known as f64
                } else {
                    f64::NAN
                };
                self.means.push(mean);
                (self.sum, self.known, self.seen) = (0.0, 0, 0);
            }
        }
    }

    /// The same for a signal that is one value throughout.
    #[must_use]
    pub fn constant(
        signal: &str,
        value: f64,
        samples: usize,
        step_s: f64,
        settings: &Checks,
    ) -> Option<Averaging> {
        let mut averaging = Averaging::of(signal, step_s, settings)?;
        averaging.means = vec![value; samples / averaging.length];
        Some(averaging)
    }
}

fn block_length(step_s: f64, settings: &Checks) -> usize {
    super::gaps::longest(settings.block_s, step_s).max(1)
}

/// The signals averaged over short blocks.
#[derive(Clone, Debug)]
pub struct Blocks {
    pub block_s: f64,
    pub count: usize,
    /// With the factor that a trial multiplies a signal by.
    values: BTreeMap<&'static str, (Arc<Vec<f64>>, f64)>,
}

impl Blocks {
    /// Of signals averaged over all samples of a record.
    #[must_use]
    pub fn of(
        averaged: BTreeMap<String, Averaging>,
        samples: usize,
        step_s: f64,
        settings: &Checks,
    ) -> Blocks {
        let length = block_length(step_s, settings);
        let mut averaged = averaged;
        let mut value =
            |name: &&'static str| Some((*name, (Arc::new(averaged.remove(*name)?.means), 1.0)));
        let values = USED.iter().filter_map(&mut value).collect();
        Blocks {
            block_s: length as f64 * step_s,
            count: samples / length,
            values,
        }
    }

    pub fn has(&self, signal: &str) -> bool {
        self.values.contains_key(signal)
    }

    /// Whether a signal never changes: a dead sensor's does not, noise makes every other's.
    pub fn still(&self, signal: &str) -> bool {
        let means = self.values.get(signal).map(|(means, _)| means.iter());
        let mut known = means.into_iter().flatten().filter(|v| v.is_finite());
        known
            .next()
            .is_none_or(|first| known.all(|v| (v - first).abs() <= 1e-9 * first.abs()))
    }

    /// Whether airspeed, dynamic pressure or Mach number say for most of the record that the
    /// aircraft is faster than this, ft/s. One of them may be dead.
    pub fn flies(&self, faster_ft_s: f64) -> bool {
        // Of this velocity at sea level: higher up it takes more of it.
        let (density, sound) = atmosphere(0.0);
        let pressure = 0.5 * density * faster_ft_s * faster_ft_s;
        let levels = [
            (signal::VELOCITY, faster_ft_s),
            (signal::QBAR, pressure),
            (signal::MACH, faster_ft_s / sound),
        ];
        let mostly = |(signal, level): (&str, f64)| {
            let known = || {
                (0..self.count)
                    .map(|k| self.at(signal, k))
                    .filter(|v| v.is_finite())
            };
            2 * known().filter(|v| v.abs() > level).count() > known().count()
        };
        levels.into_iter().any(mostly)
    }

    /// These blocks with one signal multiplied: what the record would say if that channel were
    /// wrong by the factor.
    pub fn with(&self, signal: &str, factor: f64) -> Blocks {
        let mut changed = self.clone();
        if let Some((_, own)) = changed.values.get_mut(signal) {
            *own *= factor;
        }
        changed
    }

    /// These blocks with signals corrected.
    pub fn corrected(&self, corrections: &[Correction]) -> Blocks {
        let mut changed = self.clone();
        for correction in corrections {
            if let Some((means, _)) = changed.values.get_mut(correction.signal.as_str()) {
                *means = Arc::new(correction.of_values(means, self.block_s));
            }
        }
        changed
    }

    fn at(&self, signal: &str, block: usize) -> f64 {
        let value = self
            .values
            .get(signal)
            .and_then(|(means, factor)| Some(means.get(block)? * factor));
        value.unwrap_or(f64::NAN)
    }
}

/// The motion in one block.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// p, q, r, rad/s.
    pub rates: [f64; 3],
    /// Rad.
    pub theta: f64,
    pub phi: f64,
    pub psi: f64,
    /// True airspeed and its components u, v, w at the c.g., ft/s.
    pub velocity: f64,
    pub along: [f64; 3],
    pub altitude: f64,
    /// Gravity in body axes, ft/s².
    pub gravity: [f64; 3],
    /// Sensor readings, g.
    pub an: f64,
    pub ax: f64,
    pub ay: f64,
    pub mach: f64,
    pub qbar: f64,
    /// Standard atmosphere at the altitude: slug/ft³ and ft/s.
    pub density: f64,
    pub sound: f64,
    /// From the c.g. to the accelerometers (normal, axial, lateral), ft forward, right and down.
    pub arms: [[f64; 3]; 3],
}

impl Motion {
    /// The motion in a block; none where the aircraft is not flying.
    pub fn of(blocks: &Blocks, k: usize, aircraft: &Aircraft, settings: &Checks) -> Option<Motion> {
        let at = |signal| blocks.at(signal, k);
        let angle = |signal| at(signal) / DEG;
        let velocity = at(signal::VELOCITY);
        if velocity.abs() < settings.least_velocity_ft_s {
            return None;
        }
        let rates = [angle(signal::P), angle(signal::Q), angle(signal::R)];
        let cg = Position {
            x_ft: at(signal::X_CG),
            y_ft: at(signal::Y_CG),
            z_ft: at(signal::Z_CG),
        };
        let read = Flow {
            alpha: angle(signal::ALPHA_VANE),
            beta: angle(signal::BETA_VANE),
            velocity,
            rates,
        };
        let flow = aircraft.sensors.flow_at_cg(&read, cg);
        let ((sa, ca), (sb, cb)) = (flow.alpha.sin_cos(), flow.beta.sin_cos());
        let (theta, phi, altitude) = (
            angle(signal::THETA),
            angle(signal::PHI),
            at(signal::ALTITUDE),
        );
        let ((st, ct), (sp, cp)) = (theta.sin_cos(), phi.sin_cos());
        let g = gravity_ft_s2(aircraft.latitude_deg, altitude);
        let (density, sound) = atmosphere(altitude);
        let s = &aircraft.sensors;
        Some(Motion {
            rates,
            theta,
            phi,
            psi: angle(signal::PSI),
            velocity,
            along: [velocity * ca * cb, velocity * sb, velocity * sa * cb],
            altitude,
            gravity: [-g * st, g * ct * sp, g * ct * cp],
            an: at(signal::AN),
            ax: at(signal::AX),
            ay: at(signal::AY),
            mach: at(signal::MACH),
            qbar: at(signal::QBAR),
            density,
            sound,
            arms: [s.an.arm(cg), s.ax.arm(cg), s.ay.arm(cg)],
        })
    }

    /// The specific force at the c.g. that the accelerometers stand for, ft/s², without their arms.
    pub fn force(&self) -> [f64; 3] {
        [self.ax * G0_FT_S2, self.ay * G0_FT_S2, -self.an * G0_FT_S2]
    }

    /// ω × (u, v, w) − gravity, ft/s²: what the specific force has to balance beside the change of
    /// the velocity.
    pub fn turning(&self) -> [f64; 3] {
        let turned = cross(self.rates, self.along);
        [
            turned[0] - self.gravity[0],
            turned[1] - self.gravity[1],
            turned[2] - self.gravity[2],
        ]
    }

    /// ω × (ω × arm), ft/s².
    pub fn centripetal(&self, arm: [f64; 3]) -> [f64; 3] {
        cross(self.rates, cross(self.rates, arm))
    }

    /// ω × arm, ft/s: the velocity of a sensor relative to the c.g.; its change is the sensor's own
    /// acceleration.
    pub fn swing(&self, arm: [f64; 3]) -> [f64; 3] {
        cross(self.rates, arm)
    }

    /// The rate of climb, ft/s.
    pub fn climb(&self) -> f64 {
        let [u, v, w] = self.along;
        let ((st, ct), (sp, cp)) = (self.theta.sin_cos(), self.phi.sin_cos());
        u * st - v * sp * ct - w * cp * ct
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Density (slug/ft³) and speed of sound (ft/s) of the standard atmosphere up to 20 km; NaN where
/// it has none.
pub(super) fn atmosphere(altitude_ft: f64) -> (f64, f64) {
    const KG_M3: f64 = 515.378_818;
    const GAS: f64 = 287.052_87;
    let h = altitude_ft * M_PER_FT;
    let temperature = (288.15 - 0.006_5 * h).max(216.65);
    let pressure = if h < 11_000.0 {
        101_325.0 * (temperature / 288.15).powf(5.255_88)
    } else {
        22_632.06 * (-(h - 11_000.0) / 6_341.62).exp()
    };
    (
        pressure / (GAS * temperature) / KG_M3,
        (1.4 * GAS * temperature).sqrt() / M_PER_FT,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_atmosphere_is_the_standard_one() {
        for (altitude, density, sound) in [
            (0.0, 2.376_9e-3, 1116.45),
            (25_000.0, 1.065_5e-3, 1016.1),
            (45_000.0, 4.622_7e-4, 968.08),
        ] {
            let (rho, a) = atmosphere(altitude);
            // The tables are over geometric altitude, the formula takes it for geopotential.
            assert_relative_eq!(rho, density, max_relative = 5e-3);
            assert_relative_eq!(a, sound, max_relative = 1e-3);
        }
    }

    #[test]
    fn a_block_with_fewer_than_half_its_samples_has_no_mean() {
        let settings = Checks {
            block_s: 0.1,
            ..Checks::default()
        };
        let mut averaging = Averaging::of(signal::Q, 0.025, &settings).unwrap();
        averaging.push(&[1.0, f64::NAN, f64::NAN]);
        averaging.push(&[f64::NAN, 1.0, f64::NAN, 3.0, f64::NAN, 7.0]);
        assert!(averaging.means[0].is_nan());
        assert_relative_eq!(averaging.means[1], 2.0);
        assert_eq!(averaging.means.len(), 2);
    }
}
