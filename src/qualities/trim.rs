//! Steady flight at an angle of attack, in the conditions that were flown there.
//!
//! Between the flown angles of attack conditions are interpolated linearly. The flight-path angle
//! is as flown: pitch attitude less angle of attack. Normal force and the downward part of the
//! thrust carry the weight. The forward part of the thrust balances axial force and weight. The
//! pitch control balances the moment.

use std::collections::{BTreeMap, BTreeSet};

use crate::aero::{Condition, WindTunnel};
use crate::aircraft::{Aircraft, Position, Thrust};
use crate::dynamics::Motion;
use crate::earth::gravity_ft_s2;
use crate::flight::signal;
use crate::maneuver::{Maneuver, Means};
use crate::numerics::statistics::mean::finite_mean;
use crate::units::RAD;

/// Angles of attack within which maneuvers count as one condition, deg.
const TOGETHER_DEG: f64 = 2.5;

/// Name of the tunnel's third variable among a condition's quantities.
const THIRD: &str = "third";

/// Steady wings-level flight, in rad, ft, s, slug, lbf.
#[derive(Clone, Debug, PartialEq)]
pub struct Trim {
    pub condition: Condition,
    pub alpha: f64,
    pub theta: f64,
    pub velocity: f64,
    pub qbar: f64,
    pub mass: f64,
    pub gravity: f64,
    pub ix: f64,
    pub iy: f64,
    pub iz: f64,
    pub ixz: f64,
    pub cg: Position,
    /// Positions of surfaces and vanes, deg.
    pub surfaces_deg: BTreeMap<String, f64>,
}

impl Trim {
    /// Motion at trim, with a thrust. Specific forces carry the weight.
    #[must_use]
    pub fn motion(&self, thrust: Thrust) -> Motion {
        Motion {
            alpha: self.alpha,
            beta: 0.0,
            velocity: self.velocity,
            rates: [0.0; 3],
            accelerations: [0.0; 3],
            theta: self.theta,
            phi: 0.0,
            force_x: self.gravity * self.theta.sin(),
            force_y: 0.0,
            force_z: -self.gravity * self.theta.cos(),
            gravity: self.gravity,
            qbar: self.qbar,
            mass: self.mass,
            thrust,
            ix: self.ix,
            iy: self.iy,
            iz: self.iz,
            ixz: self.ixz,
            engine_momentum: 0.0,
            cg: self.cg,
        }
    }

    /// Thrust that balances the weight and an axial force coefficient.
    #[must_use]
    pub fn thrust(&self, aircraft: &Aircraft, axial_force: f64) -> Thrust {
        let force = self.qbar * aircraft.wing_area_ft2;
        let forward = self.mass * self.gravity * self.theta.sin() + force * axial_force;
        let of_one = aircraft.thrust(1.0, self.cg).forward_lbf;
        aircraft.thrust(forward / of_one, self.cg)
    }

    /// Normal force coefficient that carries the weight with a thrust.
    #[must_use]
    pub fn normal_force(&self, aircraft: &Aircraft, thrust: Thrust) -> f64 {
        let down = self.mass * self.gravity * self.theta.cos() + thrust.down_lbf;
        down / (self.qbar * aircraft.wing_area_ft2)
    }
}

/// Values of one flown condition.
#[derive(Clone, Debug, PartialEq)]
struct FlownCondition {
    alpha_deg: f64,
    /// Means of the condition's quantities by signal, including the tunnel's third variable if it
    /// has one.
    quantities: BTreeMap<&'static str, f64>,
    /// By channel.
    surfaces_deg: BTreeMap<String, f64>,
}

/// Conditions in which a campaign was flown, by ascending angle of attack.
#[derive(Clone, Debug, PartialEq)]
pub struct FlownConditions {
    conditions: Vec<FlownCondition>,
}

impl FlownConditions {
    /// Means of maneuvers that were flown at nearly the same angle of attack.
    #[must_use]
    pub fn new(flown: &[(&Maneuver, &Means)], tunnel: &WindTunnel) -> FlownConditions {
        let of_maneuver = |(m, means): &(&Maneuver, &Means)| FlownCondition::of(m, means, tunnel);
        let mut all: Vec<FlownCondition> = flown.iter().map(of_maneuver).collect();
        all.sort_by(|a, b| a.alpha_deg.total_cmp(&b.alpha_deg));
        let mut groups: Vec<Vec<FlownCondition>> = Vec::new();
        for own in all {
            match groups.last_mut() {
                Some(group) if own.alpha_deg - group[0].alpha_deg <= TOGETHER_DEG => {
                    group.push(own);
                }
                _ => groups.push(vec![own]),
            }
        }
        FlownConditions {
            conditions: groups
                .iter()
                .filter_map(|group| FlownCondition::mean(group))
                .collect(),
        }
    }

    /// Steady flight at an angle of attack; `None` well beyond the flown ones.
    #[must_use]
    pub fn trim(&self, alpha_deg: f64, aircraft: &Aircraft) -> Option<Trim> {
        let is_near = |c: &&FlownCondition| (c.alpha_deg - alpha_deg).abs() <= TOGETHER_DEG;
        let upper = self.conditions.iter().find(|c| c.alpha_deg >= alpha_deg);
        let lower = self.conditions.iter().rfind(|c| c.alpha_deg <= alpha_deg);
        let upper_end = self.conditions.last().filter(is_near);
        let lower_end = self.conditions.first().filter(is_near);
        let (lower, upper) = (lower.or(lower_end)?, upper.or(upper_end)?);
        FlownCondition::between(lower, upper, alpha_deg).trim(alpha_deg, aircraft)
    }
}

impl FlownCondition {
    fn of(maneuver: &Maneuver, means: &Means, tunnel: &WindTunnel) -> FlownCondition {
        let known = [
            (THIRD, maneuver.condition(tunnel).third),
            (signal::THETA, Some(means.theta_deg)),
            (signal::MACH, Some(maneuver.mach)),
            (signal::QBAR, Some(maneuver.qbar_psf)),
            (signal::VELOCITY, Some(maneuver.velocity_ft_s)),
            (signal::ALTITUDE, Some(maneuver.altitude_ft)),
            (signal::MASS, Some(maneuver.mass_slug)),
            (signal::X_CG, Some(maneuver.x_cg_ft)),
            (signal::Z_CG, Some(means.z_cg_ft)),
            (signal::IX, Some(means.ix_slug_ft2)),
            (signal::IY, Some(means.iy_slug_ft2)),
            (signal::IZ, Some(means.iz_slug_ft2)),
            (signal::IXZ, Some(means.ixz_slug_ft2)),
        ];
        let known = known
            .into_iter()
            .filter_map(|(name, value)| Some((name, value?)));
        FlownCondition {
            alpha_deg: maneuver.alpha_deg,
            quantities: known.collect(),
            surfaces_deg: means.surfaces_deg.clone(),
        }
    }

    /// Mean of several; `None` for an empty list.
    fn mean(group: &[FlownCondition]) -> Option<FlownCondition> {
        Some(FlownCondition {
            alpha_deg: finite_mean(group.iter().map(|own| own.alpha_deg))?,
            quantities: mean_of(&group.iter().map(|own| &own.quantities)),
            surfaces_deg: mean_of(&group.iter().map(|own| &own.surfaces_deg)),
        })
    }

    /// Values between two conditions.
    fn between(lower: &FlownCondition, upper: &FlownCondition, alpha_deg: f64) -> FlownCondition {
        let width = upper.alpha_deg - lower.alpha_deg;
        let share = if width > 0.0 {
            (alpha_deg - lower.alpha_deg) / width
        } else {
            1.0
        };
        FlownCondition {
            alpha_deg: lower.alpha_deg + share * width,
            quantities: between(&lower.quantities, &upper.quantities, share),
            surfaces_deg: between(&lower.surfaces_deg, &upper.surfaces_deg, share),
        }
    }

    /// Steady flight at an angle of attack near this condition's. The flight-path angle is as
    /// flown, so pitch attitude follows the angle of attack.
    fn trim(&self, alpha_deg: f64, aircraft: &Aircraft) -> Option<Trim> {
        let get = |name: &str| self.quantities.get(name).copied();
        let theta_deg = get(signal::THETA)? - self.alpha_deg + alpha_deg;
        Some(Trim {
            condition: Condition {
                alpha_deg,
                mach: get(signal::MACH)?,
                third: get(THIRD),
            },
            alpha: RAD * alpha_deg,
            theta: RAD * theta_deg,
            velocity: get(signal::VELOCITY)?,
            qbar: get(signal::QBAR)?,
            mass: get(signal::MASS)?,
            gravity: gravity_ft_s2(aircraft.latitude_deg, get(signal::ALTITUDE)?),
            ix: get(signal::IX)?,
            iy: get(signal::IY)?,
            iz: get(signal::IZ)?,
            ixz: get(signal::IXZ)?,
            cg: Position {
                x_ft: get(signal::X_CG)?,
                y_ft: 0.0,
                z_ft: get(signal::Z_CG)?,
            },
            surfaces_deg: self.surfaces_deg.clone(),
        })
    }
}

/// Mean of each value over those that have it.
fn mean_of<'a, K: Ord + Clone + 'a>(
    group: &(impl Iterator<Item = &'a BTreeMap<K, f64>> + Clone),
) -> BTreeMap<K, f64> {
    let names: BTreeSet<&K> = group.clone().flat_map(BTreeMap::keys).collect();
    let mean = |name: &K| finite_mean(group.clone().filter_map(|own| own.get(name).copied()));
    names
        .into_iter()
        .filter_map(|name| Some((name.clone(), mean(name)?)))
        .collect()
}

/// Interpolates values at a fraction; a value that one map lacks is taken from the other.
fn between<K: Ord + Clone>(
    lower: &BTreeMap<K, f64>,
    upper: &BTreeMap<K, f64>,
    share: f64,
) -> BTreeMap<K, f64> {
    let mut values = lower.clone();
    for (name, value) in upper {
        let below = lower.get(name).unwrap_or(value);
        values.insert(name.clone(), below + share * (value - below));
    }
    values
}
