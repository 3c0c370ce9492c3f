//! Change of the derivatives over the angles of attack that a maneuver sweeps.
//!
//! The build-up has one value of each derivative in a maneuver. Where the derivative has the slope c′
//! over α, the maneuver has the further term c′ r (α − ᾱ) along its regressor r, and ½ c′ (α − ᾱ)²
//! along α itself. Filter error estimates these slopes with a prior about zero, whose size is that of
//! the wind tunnel's own slope ([`filter_error::slopes`](crate::filter_error::slopes)).

use super::task::Task;
use crate::aero::{Condition, Derivative, Regressor};
use crate::dynamics::Equations;
use crate::dynamics::motion::Window;
use crate::flight::signal;
use crate::output_error::{Case, Model};

/// Distance over which the tunnel's slopes are taken, deg: half the usual distance of test points.
const REACH_DEG: f64 = 2.5;

/// Slopes over α that act in a maneuver, with its window.
#[derive(Clone)]
pub(super) struct AlphaSlopes {
    /// Derivatives along the products of regressors and α − ᾱ, which are signals of the window.
    pub derivatives: Vec<Derivative>,
    pub window: Window,
    /// Size of each slope, per deg, in the order of the derivatives.
    pub sizes: Vec<f64>,
}

impl Task<'_> {
    /// Slopes over α of the derivatives that are free in `wide`, along the motion as measured.
    pub(super) fn alpha_slopes<const NX: usize, E: Equations<NX>>(
        &self,
        window: &Window,
        wide: &Case<NX, E>,
    ) -> AlphaSlopes {
        let alpha: Vec<f64> = window
            .signal(signal::ALPHA_VANE)
            .iter()
            .step_by(2)
            .copied()
            .collect();
        let mean = alpha.iter().sum::<f64>() / alpha.len().max(1) as f64;
        let mut slopes = AlphaSlopes {
            derivatives: vec![],
            window: window.clone(),
            sizes: vec![],
        };
        for (j, name) in wide.names.iter().take(wide.derivatives()).enumerate() {
            let Some(derivative) = self.context.buildup.derivative(name) else {
                continue;
            };
            let size = self.tunnel_slope(name);
            if derivative.regressor == Regressor::Constant || size == 0.0 {
                continue;
            }
            let regressor = wide.measured_regressor(j);
            let along = |(r, alpha): (&f64, &f64)| match derivative.regressor {
                Regressor::Alpha => 0.5 * (alpha - mean).powi(2),
                _ => r * (alpha - mean),
            };
            let values: Vec<f64> = regressor.iter().zip(&alpha).map(along).collect();
            slopes.add(derivative, &values, size);
        }
        slopes
    }

    /// Size of the tunnel's slope over α at the maneuver, per deg; zero without a table.
    fn tunnel_slope(&self, name: &str) -> f64 {
        let tunnel = self.context.tunnel;
        let at = self.maneuver.condition(tunnel);
        let value = |alpha_deg: f64| {
            let condition = Condition { alpha_deg, ..at };
            tunnel.at(name, &condition).map(|v| v.value)
        };
        let (up, down) = (
            value(at.alpha_deg + REACH_DEG),
            value(at.alpha_deg - REACH_DEG),
        );
        match (up, down) {
            (Some(up), Some(down)) => (up - down).abs() / (2.0 * REACH_DEG),
            _ => 0.0,
        }
    }
}

impl AlphaSlopes {
    /// Model with the slopes held at these values, in their order.
    pub fn held_in<'s>(&'s self, model: &Model<'s>, values: &[f64]) -> Model<'s> {
        let mut held = model.clone();
        let both = self.derivatives.iter().zip(values);
        held.held
            .extend(both.map(|(derivative, value)| (derivative, *value)));
        held
    }

    /// Model with the slopes free as well.
    pub fn added_to<'s>(&'s self, model: &Model<'s>) -> Model<'s> {
        let mut wide = model.clone();
        wide.free.extend(&self.derivatives);
        wide
    }

    fn add(&mut self, derivative: &Derivative, values: &[f64], size: f64) {
        let name = format!("{} over alpha", derivative.name);
        self.window = self.window.with_samples(&name, values);
        self.sizes.push(size);
        self.derivatives.push(Derivative {
            regressor: Regressor::Surface(name.clone()),
            name,
            coefficient: derivative.coefficient,
        });
    }
}
