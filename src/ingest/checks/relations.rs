//! Kinematic relations between channels: each has two sides that are equal for any aerodynamics.
//!
//! The sides are compared in integrated form over windows, which avoids differentiating noise. A
//! side is the change of a state plus the integral of a rate over the window, per second. With `v =
//! (u, v, w)` and `f` the specific force,
//!
//! - θ̇ = q cos φ − r sin φ, φ̇ = p + tan θ (q sin φ + r cos φ), ψ̇ = (q sin φ + r cos φ)/cos θ
//! - v̇ + ω × v − g = f at the c.g.; a sensor adds the acceleration of its arm
//! - ḣ = u sin θ − v sin φ cos θ − w cos φ cos θ, q̄ = ρ V²/2, M = V/a
//!
//! `v` is relative to the air, so its rate contains the gusts', and `f` the aircraft's response to
//! them. `f` and what follows from it is the predicted side, which noise must not disturb.
//!
//! One relation is not kinematic, because gusts hide a fighter's lateral acceleration: the side
//! force of a gust opposes the sideslip of the gust.

use super::block_means::BlockMeans;
use super::block_motion::BlockMotion;
use crate::flight::signal as s;
use crate::ingest::settings::Checks;
use crate::units::{DEG, G0_FT_S2};

/// Selection of the windows in which a relation is excited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Selection {
    /// Windows in which either side exceeds this level.
    Above(f64),
    /// This share of the windows: those with the largest deviation of the predicted side from its
    /// median. It is for relations whose noise reaches the level.
    Largest { share: f64, level: f64 },
}

impl Selection {
    /// Level from which a window counts as excited.
    pub fn level(self) -> f64 {
        match self {
            Selection::Above(level) | Selection::Largest { level, .. } => level,
        }
    }
}

/// Number of body axes: forward, right, down.
pub const BODY_AXES: usize = 3;

/// Effect of gusts on a relation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GustEffect {
    /// Gusts disturb both sides alike, or hardly.
    Slight,
    /// Gusts along a body axis disturb the measured side.
    Disturb {
        axis: usize,
        /// Unit of the sides per ft/s².
        per_ft_s2: f64,
    },
    /// Gusts excite the relation; without them it is not checked.
    Excite,
}

/// A quantity of the motion in one block.
type Term = fn(&BlockMotion) -> f64;

/// One side of a relation: the change of `state` plus the integral of `rate`, per second.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    pub state: Option<Term>,
    pub rate: Option<Term>,
}

/// A relation: `measured` equals `predicted`.
#[derive(Clone, Copy, Debug)]
pub struct Relation {
    pub name: &'static str,
    /// Every signal in the relation, the dominant ones first.
    pub signals: &'static [&'static str],
    /// Number of dominant signals: a fault in one of them shows.
    pub dominant: usize,
    pub measured: Side,
    pub predicted: Side,
    /// Factor from the sides' own unit to that of the selection's level.
    pub unit: f64,
    pub selection: Selection,
    /// Least correlation that counts as agreement.
    pub correlation: f64,
    /// Largest factor between the slope and one.
    pub slope_factor: f64,
    pub gusts: GustEffect,
}

impl Relation {
    /// Signals that the relation confirms when it holds.
    pub fn dominant(&self) -> &'static [&'static str] {
        self.signals.get(..self.dominant).unwrap_or(self.signals)
    }

    /// Body axis whose gusts disturb the measured side, and the sides' unit per ft/s².
    pub fn disturbed_by_gusts(&self) -> Option<(usize, f64)> {
        match self.gusts {
            GustEffect::Disturb { axis, per_ft_s2 } => Some((axis, per_ft_s2)),
            GustEffect::Slight | GustEffect::Excite => None,
        }
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

/// Relations whose signals a record has.
pub fn recorded(blocks: &BlockMeans, settings: &Checks) -> Vec<Relation> {
    let mut relations = all(settings);
    relations.retain(|relation| relation.signals.iter().all(|s| blocks.has(s)));
    relations
}

/// Returns all relations, attitudes first.
pub fn all(settings: &Checks) -> Vec<Relation> {
    let mut relations = attitudes(settings);
    relations.extend(accelerations(settings));
    relations.extend(velocities(settings));
    relations.extend(air_data(settings));
    relations.push(side_force());
    relations
}

fn attitudes(settings: &Checks) -> Vec<Relation> {
    let selection = Selection::Above(settings.excitation.attitude_deg_s);
    let relation = |name, signals, measured, predicted| Relation {
        name,
        signals,
        dominant: 2,
        measured,
        predicted,
        unit: DEG,
        selection,
        correlation: settings.least_attitude_correlation,
        slope_factor: settings.slope_factor,
        gusts: GustEffect::Slight,
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
            integral(|m| m.rates[0] + m.theta.tan() * m.turn_rate()),
        ),
        relation(
            "psi rate against q and r",
            &[s::PSI, s::R, s::Q, s::PHI, s::THETA],
            change(|m| m.psi),
            integral(|m| m.turn_rate() / m.theta.cos()),
        ),
    ]
}

/// Signals of the relation of the normal acceleration, the dominant one first.
const OF_AN: &[&str] = &[
    s::AN,
    s::THETA,
    s::PHI,
    s::Q,
    s::P,
    s::ALPHA_VANE,
    s::BETA_VANE,
    s::VELOCITY,
];

/// Signals of the relation of the axial acceleration.
const OF_AX: &[&str] = &[
    s::AX,
    s::THETA,
    s::Q,
    s::R,
    s::ALPHA_VANE,
    s::BETA_VANE,
    s::VELOCITY,
];

/// Signals of the relation of the lateral acceleration.
const OF_AY: &[&str] = &[
    s::AY,
    s::BETA_VANE,
    s::R,
    s::PHI,
    s::P,
    s::THETA,
    s::ALPHA_VANE,
    s::VELOCITY,
];

fn accelerations(settings: &Checks) -> Vec<Relation> {
    let relation = |axis, name, signals, measured, predicted, selection| Relation {
        name,
        signals,
        dominant: 1,
        measured,
        predicted,
        unit: 1.0,
        selection,
        correlation: settings.least_correlation,
        slope_factor: settings.slope_factor,
        gusts: GustEffect::Disturb {
            axis,
            per_ft_s2: 1.0 / G0_FT_S2,
        },
    };
    vec![
        relation(
            2,
            "normal acceleration of the motion against an",
            OF_AN,
            both(
                |m| -(m.uvw[2] + m.arm_velocity(m.arms[0])[2]) / G0_FT_S2,
                |m| -(m.turning_acceleration()[2] + m.centripetal(m.arms[0])[2]) / G0_FT_S2,
            ),
            integral(|m| m.an),
            Selection::Above(settings.excitation.normal_g),
        ),
        relation(
            0,
            "axial acceleration of the motion against ax",
            OF_AX,
            both(
                |m| (m.uvw[0] + m.arm_velocity(m.arms[1])[0]) / G0_FT_S2,
                |m| (m.turning_acceleration()[0] + m.centripetal(m.arms[1])[0]) / G0_FT_S2,
            ),
            integral(|m| m.ax),
            Selection::Above(settings.excitation.axial_g),
        ),
        relation(
            1,
            "lateral acceleration of the motion against ay",
            OF_AY,
            both(
                |m| (m.uvw[1] + m.arm_velocity(m.arms[2])[1]) / G0_FT_S2,
                |m| (m.turning_acceleration()[1] + m.centripetal(m.arms[2])[1]) / G0_FT_S2,
            ),
            integral(|m| m.ay),
            Selection::Largest {
                share: settings.excitation.lateral_share,
                level: settings.excitation.lateral_g,
            },
        ),
    ]
}

/// Signals of the relation of the forward velocity, the dominant three first.
const OF_FORWARD: &[&str] = &[
    s::VELOCITY,
    s::AX,
    s::THETA,
    s::Q,
    s::R,
    s::ALPHA_VANE,
    s::BETA_VANE,
];

/// Signals of the relation of the side velocity, the dominant two first.
const OF_SIDEWARD: &[&str] = &[
    s::BETA_VANE,
    s::R,
    s::VELOCITY,
    s::P,
    s::PHI,
    s::THETA,
    s::AY,
    s::ALPHA_VANE,
];

/// Signals of the relation of the downward velocity, the dominant two first.
const OF_DOWNWARD: &[&str] = &[
    s::ALPHA_VANE,
    s::Q,
    s::VELOCITY,
    s::AN,
    s::P,
    s::THETA,
    s::PHI,
    s::BETA_VANE,
];

fn velocities(settings: &Checks) -> Vec<Relation> {
    let selection = Selection::Above(settings.excitation.velocity_ft_s2);
    let relation = |axis, name, signals, dominant, measured, predicted| Relation {
        name,
        signals,
        dominant,
        measured,
        predicted,
        unit: 1.0,
        selection,
        correlation: settings.least_correlation,
        slope_factor: settings.slope_factor,
        gusts: GustEffect::Disturb {
            axis,
            per_ft_s2: 1.0,
        },
    };
    vec![
        relation(
            0,
            "forward velocity against ax and theta",
            OF_FORWARD,
            3,
            change(|m| m.uvw[0]),
            integral(|m| m.specific_force()[0] - m.turning_acceleration()[0]),
        ),
        relation(
            1,
            "side velocity against r, p and phi",
            OF_SIDEWARD,
            2,
            change(|m| m.uvw[1]),
            integral(|m| m.specific_force()[1] - m.turning_acceleration()[1]),
        ),
        relation(
            2,
            "downward velocity against q and an",
            OF_DOWNWARD,
            2,
            change(|m| m.uvw[2]),
            integral(|m| m.specific_force()[2] - m.turning_acceleration()[2]),
        ),
    ]
}

fn air_data(settings: &Checks) -> Vec<Relation> {
    let relation = |name, signals, dominant, measured, predicted, selection| Relation {
        name,
        signals,
        dominant,
        measured,
        predicted,
        unit: 1.0,
        selection,
        correlation: settings.least_correlation,
        slope_factor: settings.slope_factor,
        gusts: GustEffect::Slight,
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
            integral(BlockMotion::climb_rate),
            Selection::Above(settings.excitation.climb_ft_s),
        ),
        relation(
            "dynamic pressure against velocity and altitude",
            &[s::QBAR, s::VELOCITY, s::ALTITUDE],
            2,
            integral(|m| m.qbar),
            integral(|m| 0.5 * m.air.density_slug_ft3 * m.velocity * m.velocity),
            Selection::Above(settings.excitation.qbar_psf),
        ),
        relation(
            "Mach against velocity and altitude",
            &[s::MACH, s::VELOCITY, s::ALTITUDE],
            2,
            integral(|m| m.mach),
            integral(|m| m.velocity / m.air.sound_ft_s),
            Selection::Above(settings.excitation.mach),
        ),
    ]
}

/// Side force by sideslip, per rad, of wing area: the geometric mean of usual aircraft (Roskam,
/// *Airplane Flight Dynamics*: −0.2 to −1.5).
const TYPICAL_CY_BETA: f64 = -0.6;

/// Largest ratio between an aircraft's side force due to sideslip and the typical value. The usual
/// range extends to factors of 3 and 2.5; the rest allows for the slope's error in gusts. Units of
/// the vane (57) and a reversed sign lie beyond it.
const CY_BETA_FACTOR: f64 = 4.0;

/// Least rate of sideslip, deg/s: twice the apparent rate from an error of 0.2 deg in bank at 400
/// ft/s.
const SIDESLIP_DEG_S: f64 = 0.03;

/// Side force against the sideslip that gusts make. The predicted side is the lateral acceleration
/// of the motion over V. In gusts that is the gusts' own acceleration, to which no control of the
/// aircraft contributes.
fn side_force() -> Relation {
    Relation {
        name: "side force against side gusts",
        signals: &[
            s::AY,
            s::BETA_VANE,
            s::R,
            s::PHI,
            s::P,
            s::THETA,
            s::ALPHA_VANE,
            s::VELOCITY,
            s::QBAR,
            s::MASS,
        ],
        dominant: 1,
        measured: change(|m| m.side_force / TYPICAL_CY_BETA),
        predicted: both(
            |m| (m.uvw[1] + m.arm_velocity(m.arms[2])[1]) / m.velocity,
            |m| (m.turning_acceleration()[1] + m.centripetal(m.arms[2])[1]) / m.velocity,
        ),
        unit: DEG,
        selection: Selection::Above(SIDESLIP_DEG_S),
        correlation: 0.0,
        slope_factor: CY_BETA_FACTOR,
        gusts: GustEffect::Excite,
    }
}
