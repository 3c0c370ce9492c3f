//! Change of the derivatives over the angles of attack that a maneuver sweeps.
//!
//! The build-up has one value of each derivative in a maneuver. In the wind tunnel's tables t(α) it
//! changes: the maneuver has the further term s (t(α) − t(ᾱ)) r along a derivative's regressor r. Along α
//! itself it is s (T(α) − T(ᾱ) − t(ᾱ) (α − ᾱ)), T the tabulated sum of constant and α t, or without one the
//! integral of t. A derivative that is held changes likewise. The slopes s are 1 where flight changes
//! as the tunnel, 0 where it is constant. Filter error estimates them
//! ([`filter_error::slopes`](crate::filter_error::slopes)).

use super::task::Task;
use crate::aero::{Condition, Derivative, Regressor};
use crate::dynamics::Equations;
use crate::dynamics::motion::Window;
use crate::output_error::{Case, Model};
use crate::units::DEG;

/// Intervals of the swept angles of attack, in each of which the tunnel's change is linear.
const INTERVALS: usize = 200;

/// Slopes over α that act in a maneuver, with its window.
#[derive(Clone)]
pub(super) struct AlphaSlopes {
    /// Derivatives along the tunnel's changes, which are signals of the window.
    pub derivatives: Vec<Derivative>,
    pub window: Window,
}

/// Angles of attack of a maneuver and their mean, deg.
struct Swept {
    alphas: Vec<f64>,
    mean: f64,
    lowest: f64,
    /// Length of an interval.
    step: f64,
}

impl Task<'_> {
    /// Slopes over α of the derivatives that are free in `wide`, along the motion as measured.
    pub(super) fn alpha_slopes<const NX: usize, E: Equations<NX>>(
        &self,
        window: &Window,
        wide: &Case<NX, E>,
    ) -> AlphaSlopes {
        let motion = window.motion(self.context.aircraft);
        let swept = Swept::new(motion.points().step_by(2).map(|m| DEG * m.alpha).collect());
        let mut slopes = AlphaSlopes {
            derivatives: vec![],
            window: window.clone(),
        };
        for (j, name) in wide.names.iter().take(wide.derivatives()).enumerate() {
            let Some(derivative) = self.context.buildup.derivative(name) else {
                continue;
            };
            if derivative.regressor == Regressor::Constant {
                continue;
            }
            let (along, regressor) = match derivative.regressor {
                Regressor::Alpha => (self.change_along_alpha(name, &swept), None),
                _ => (self.change(name, &swept), Some(wide.measured_regressor(j))),
            };
            let Some(along) = along.filter(|a| a.iter().any(|c| *c != 0.0)) else {
                continue;
            };
            let mut values = swept.along(&along);
            for (value, r) in values.iter_mut().zip(regressor.iter().flatten()) {
                *value *= r;
            }
            slopes.add(derivative, &values);
        }
        slopes
    }

    /// Tunnel's change of a derivative, or tabulated sum, from the mean angle of attack to those swept.
    /// `None` without a table.
    fn change(&self, name: &str, swept: &Swept) -> Option<Vec<f64>> {
        let mean = self.tunnel_at(name, swept.mean)?;
        let at = |alpha_deg| Some(self.tunnel_at(name, alpha_deg)? - mean);
        swept.angles().map(at).collect()
    }

    /// Tunnel's change of a coefficient beyond that by its slope along α at the mean.
    fn change_along_alpha(&self, slope: &str, swept: &Swept) -> Option<Vec<f64>> {
        let sums = &self.context.buildup.combined;
        let sum = sums.iter().find(|sum| sum.slope == slope);
        let Some(change) = sum.and_then(|sum| self.change(&sum.name, swept)) else {
            return Some(swept.integral(&self.change(slope, swept)?));
        };
        let mean = self.tunnel_at(slope, swept.mean)?;
        let both = change.iter().zip(swept.angles());
        Some(
            both.map(|(c, alpha)| c - mean * (alpha - swept.mean))
                .collect(),
        )
    }

    fn tunnel_at(&self, name: &str, alpha_deg: f64) -> Option<f64> {
        let tunnel = self.context.tunnel;
        let condition = Condition {
            alpha_deg,
            ..self.maneuver.condition(tunnel)
        };
        tunnel.at(name, &condition).map(|v| v.value)
    }
}

impl Swept {
    fn new(alphas: Vec<f64>) -> Swept {
        let mean = alphas.iter().sum::<f64>() / alphas.len().max(1) as f64;
        let lowest = alphas.iter().copied().fold(mean, f64::min);
        let highest = alphas.iter().copied().fold(mean, f64::max);
        Swept {
            step: ((highest - lowest) / INTERVALS as f64).max(f64::MIN_POSITIVE),
            alphas,
            mean,
            lowest,
        }
    }

    /// Angles from the lowest to the highest.
    fn angles(&self) -> impl Iterator<Item = f64> {
        (0..=INTERVALS).map(|i| self.lowest + self.step * i as f64)
    }

    /// Values at the samples of a quantity that is linear between the angles.
    fn along(&self, quantity: &[f64]) -> Vec<f64> {
        self.alphas
            .iter()
            .map(|alpha| self.read(quantity, *alpha))
            .collect()
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the number of an interval"
    )]
    fn read(&self, quantity: &[f64], alpha: f64) -> f64 {
        let place = ((alpha - self.lowest) / self.step).clamp(0.0, INTERVALS as f64);
        let low = (place as usize).min(INTERVALS - 1);
        let share = place - low as f64;
        quantity[low] + share * (quantity[low + 1] - quantity[low])
    }

    /// Integral over α from the mean.
    fn integral(&self, quantity: &[f64]) -> Vec<f64> {
        let mut sum = 0.0;
        let mut integral = vec![0.0];
        for pair in quantity.windows(2) {
            sum += 0.5 * self.step * (pair[0] + pair[1]);
            integral.push(sum);
        }
        let at_mean = self.read(&integral, self.mean);
        integral.iter().map(|value| value - at_mean).collect()
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

    fn add(&mut self, derivative: &Derivative, values: &[f64]) {
        let name = format!("{} over alpha", derivative.name);
        self.window = self.window.with_samples(&name, values);
        self.derivatives.push(Derivative {
            regressor: Regressor::Surface(name.clone()),
            name,
            coefficient: derivative.coefficient,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_quantity_is_read_between_the_angles_and_integrated_from_the_mean() {
        let swept = Swept::new(vec![9.9, 12.0, 14.1]);
        // t(α) − t(ᾱ) = 3 (α − 12): its integral is 1.5 (α − 12)².
        let changes: Vec<f64> = swept.angles().map(|a| 3.0 * (a - 12.0)).collect();
        for (value, alpha) in swept.along(&changes).iter().zip(&swept.alphas) {
            assert_relative_eq!(*value, 3.0 * (alpha - 12.0), epsilon = 1e-12);
        }
        let integral = swept.along(&swept.integral(&changes));
        for (value, alpha) in integral.iter().zip(&swept.alphas) {
            assert_relative_eq!(*value, 1.5 * (alpha - 12.0f64).powi(2), epsilon = 1e-3);
        }
        assert_relative_eq!(integral[1], 0.0);
    }
}
