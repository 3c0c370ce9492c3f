//! The kinematic relations between channels, each as two sides that are equal whatever the
//! aerodynamics.
//!
//! They are compared in integrated form over windows, so that no noise is differentiated: a side is
//! the change of a state plus the integral of a rate over the window, per second. With `v = (u, v,
//! w)` and `f` the specific force,
//!
//! - θ̇ = q cos φ − r sin φ, φ̇ = p + tan θ (q sin φ + r cos φ), ψ̇ = (q sin φ + r cos φ)/cos θ
//! - v̇ + ω × v − g = f at the c.g.; a sensor adds the acceleration of its arm
//! - ḣ = u sin θ − v sin φ cos θ − w cos φ cos θ, q̄ = ρ V²/2, M = V/a

use super::block_motion::BlockMotion;
use crate::flight::signal as s;
use crate::ingest::settings::Checks;
use crate::units::{DEG, G0_FT_S2};

/// Which windows say something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    /// Those in which either side is larger than this.
    Above(f64),
    /// This share of the windows, those with the largest deviation of the predicting side from its
    /// median; noise reaches the level.
    Largest { share: f64, level: f64 },
}

impl Choice {
    pub fn level(self) -> f64 {
        match self {
            Choice::Above(level) | Choice::Largest { level, .. } => level,
        }
    }
}

type Term = fn(&BlockMotion) -> f64;

/// One side of a relation: the change of `state` plus the integral of `rate`, per second, times
/// `unit`.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    pub state: Option<Term>,
    pub rate: Option<Term>,
}

/// One relation: `measured` equals `predicted`.
#[derive(Clone, Copy, Debug)]
pub struct Relation {
    pub name: &'static str,
    /// Every signal in it, the ones that dominate it first.
    pub signals: &'static [&'static str],
    /// How many of the signals dominate it: a fault in one of them cannot hide.
    pub dominant: usize,
    pub measured: Side,
    pub predicted: Side,
    /// From the sides' own unit to the one that the choice is in.
    pub unit: f64,
    pub choice: Choice,
    /// The least correlation that counts as agreement.
    pub correlation: f64,
}

impl Relation {
    /// The signals that the relation clears when it holds.
    pub fn dominant(&self) -> &'static [&'static str] {
        self.signals.get(..self.dominant).unwrap_or(self.signals)
    }
}

const fn change(state: Term) -> Side {
    Side {
        state: Some(state),
        rate: None,
    }
}

const fn integral(rate: Term) -> Side {
    Side {
        state: None,
        rate: Some(rate),
    }
}

const fn both(state: Term, rate: Term) -> Side {
    Side {
        state: Some(state),
        rate: Some(rate),
    }
}

/// All relations, attitudes first.
pub fn all(settings: &Checks) -> Vec<Relation> {
    let mut relations = attitudes(settings);
    relations.extend(accelerations(settings));
    relations.extend(velocities(settings));
    relations.extend(air_data(settings));
    relations
}

fn attitudes(settings: &Checks) -> Vec<Relation> {
    let choice = Choice::Above(settings.excitation.attitude_deg_s);
    let relation = |name, signals, measured, predicted| Relation {
        name,
        signals,
        dominant: 2,
        measured,
        predicted,
        unit: DEG,
        choice,
        correlation: settings.least_attitude_correlation,
    };
    vec![
        relation(
            "theta rate against q and r",
            &[s::THETA, s::Q, s::R, s::PHI],
            change(|m| m.theta),
            integral(|m| m.rates[1] * m.phi.cos() - m.rates[2] * m.phi.sin()),
        ),
        relation(
            "phi rate against p, q and r",
            &[s::PHI, s::P, s::Q, s::R, s::THETA],
            change(|m| m.phi),
            integral(|m| {
                m.rates[0] + m.theta.tan() * (m.rates[1] * m.phi.sin() + m.rates[2] * m.phi.cos())
            }),
        ),
        relation(
            "psi rate against q and r",
            &[s::PSI, s::R, s::Q, s::PHI, s::THETA],
            change(|m| m.psi),
            integral(|m| (m.rates[1] * m.phi.sin() + m.rates[2] * m.phi.cos()) / m.theta.cos()),
        ),
    ]
}

fn accelerations(settings: &Checks) -> Vec<Relation> {
    let relation = |name, signals, measured, predicted, choice| Relation {
        name,
        signals,
        dominant: 1,
        measured,
        predicted,
        unit: 1.0,
        choice,
        correlation: settings.least_correlation,
    };
    vec![
        relation(
            "normal acceleration against the motion",
            &[
                s::AN,
                s::THETA,
                s::PHI,
                s::Q,
                s::P,
                s::ALPHA_VANE,
                s::BETA_VANE,
                s::VELOCITY,
            ],
            integral(|m| m.an),
            both(
                |m| -(m.along[2] + m.swing(m.arms[0])[2]) / G0_FT_S2,
                |m| -(m.turning()[2] + m.centripetal(m.arms[0])[2]) / G0_FT_S2,
            ),
            Choice::Above(settings.excitation.normal_g),
        ),
        relation(
            "axial acceleration against the motion",
            &[
                s::AX,
                s::THETA,
                s::Q,
                s::R,
                s::ALPHA_VANE,
                s::BETA_VANE,
                s::VELOCITY,
            ],
            integral(|m| m.ax),
            both(
                |m| (m.along[0] + m.swing(m.arms[1])[0]) / G0_FT_S2,
                |m| (m.turning()[0] + m.centripetal(m.arms[1])[0]) / G0_FT_S2,
            ),
            Choice::Above(settings.excitation.axial_g),
        ),
        // The sensor is far less noisy than the motion here, so it is the predicting side.
        relation(
            "lateral acceleration of the motion against ay",
            &[
                s::AY,
                s::BETA_VANE,
                s::R,
                s::PHI,
                s::P,
                s::THETA,
                s::ALPHA_VANE,
                s::VELOCITY,
            ],
            both(
                |m| (m.along[1] + m.swing(m.arms[2])[1]) / G0_FT_S2,
                |m| (m.turning()[1] + m.centripetal(m.arms[2])[1]) / G0_FT_S2,
            ),
            integral(|m| m.ay),
            Choice::Largest {
                share: settings.excitation.lateral_share,
                level: settings.excitation.lateral_g,
            },
        ),
    ]
}

fn velocities(settings: &Checks) -> Vec<Relation> {
    let choice = Choice::Above(settings.excitation.velocity_ft_s2);
    let relation = |name, signals, dominant, measured, predicted| Relation {
        name,
        signals,
        dominant,
        measured,
        predicted,
        unit: 1.0,
        choice,
        correlation: settings.least_correlation,
    };
    vec![
        relation(
            "forward velocity against ax and theta",
            &[
                s::VELOCITY,
                s::AX,
                s::THETA,
                s::Q,
                s::R,
                s::ALPHA_VANE,
                s::BETA_VANE,
            ],
            3,
            change(|m| m.along[0]),
            integral(|m| m.force()[0] - m.turning()[0]),
        ),
        relation(
            "side velocity against r, p and phi",
            &[
                s::BETA_VANE,
                s::R,
                s::VELOCITY,
                s::P,
                s::PHI,
                s::THETA,
                s::AY,
                s::ALPHA_VANE,
            ],
            2,
            change(|m| m.along[1]),
            integral(|m| m.force()[1] - m.turning()[1]),
        ),
        relation(
            "downward velocity against q and an",
            &[
                s::ALPHA_VANE,
                s::Q,
                s::VELOCITY,
                s::AN,
                s::P,
                s::THETA,
                s::PHI,
                s::BETA_VANE,
            ],
            2,
            change(|m| m.along[2]),
            integral(|m| m.force()[2] - m.turning()[2]),
        ),
    ]
}

fn air_data(settings: &Checks) -> Vec<Relation> {
    let relation = |name, signals, dominant, measured, predicted, choice| Relation {
        name,
        signals,
        dominant,
        measured,
        predicted,
        unit: 1.0,
        choice,
        correlation: settings.least_correlation,
    };
    vec![
        relation(
            "climb against the flight path",
            &[
                s::ALTITUDE,
                s::VELOCITY,
                s::ALPHA_VANE,
                s::THETA,
                s::PHI,
                s::BETA_VANE,
            ],
            4,
            change(|m| m.altitude),
            integral(BlockMotion::climb),
            Choice::Above(settings.excitation.climb_ft_s),
        ),
        relation(
            "dynamic pressure against velocity and altitude",
            &[s::QBAR, s::VELOCITY, s::ALTITUDE],
            2,
            integral(|m| m.qbar),
            integral(|m| 0.5 * m.density * m.velocity * m.velocity),
            Choice::Above(settings.excitation.qbar_psf),
        ),
        relation(
            "Mach against velocity and altitude",
            &[s::MACH, s::VELOCITY, s::ALTITUDE],
            2,
            integral(|m| m.mach),
            integral(|m| m.velocity / m.sound),
            Choice::Above(settings.excitation.mach),
        ),
    ]
}
