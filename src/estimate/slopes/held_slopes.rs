//! Slopes over α of the derivatives of a fit.

use nalgebra::DVector;

use super::alpha_slopes::AlphaSlopes;
use crate::filter_error::bounds::{FilterBounds, WidePass};
use crate::filter_error::slopes::{SlopeEffect, SlopePrior};

/// Slopes of the derivatives over α, and the values at which a fit holds them. Slopes of one name are
/// common to the maneuvers.
#[derive(Clone)]
pub(in crate::estimate) struct HeldSlopes {
    names: Vec<String>,
    values: Vec<f64>,
    priors: Vec<SlopePrior>,
}

impl HeldSlopes {
    /// Derivatives that do not change over α.
    pub fn constant<'s>(members: impl Iterator<Item = &'s AlphaSlopes>) -> Self {
        let (mut names, mut priors) = (vec![], vec![]);
        for slope in members.flat_map(|member| &member.slopes) {
            if !names.contains(&slope.term.name) {
                names.push(slope.term.name.clone());
                priors.push(slope.prior);
            }
        }
        let values = vec![0.0; names.len()];
        HeldSlopes {
            names,
            values,
            priors,
        }
    }

    /// The slopes moved by a fraction of the way to other values.
    pub fn towards(&self, values: &DVector<f64>, share: f64) -> Self {
        let pairs = self.values.iter().zip(values.iter());
        HeldSlopes {
            names: self.names.clone(),
            values: pairs.map(|(from, to)| from + share * (to - from)).collect(),
            priors: self.priors.clone(),
        }
    }

    /// Effect on the estimates of a fit if the slopes are estimated and not held; `None` without
    /// slopes.
    pub fn effect(&self, pass: &WidePass, bounds: &FilterBounds) -> Option<SlopeEffect> {
        pass.slope_effect(bounds, &self.names, &self.values, &self.priors)
    }

    /// `true` if no derivative changes over α.
    pub fn is_constant(&self) -> bool {
        self.values.iter().all(|v| *v == 0.0)
    }

    /// Values of a maneuver's slopes, in their order.
    pub fn values_of(&self, slopes: &AlphaSlopes) -> Vec<f64> {
        let value = |name: &str| {
            let place = self.names.iter().position(|n| n == name);
            place.map_or(0.0, |place| self.values[place])
        };
        let names = slopes.slopes.iter().map(|slope| &slope.term.name);
        names.map(|name| value(name)).collect()
    }
}
