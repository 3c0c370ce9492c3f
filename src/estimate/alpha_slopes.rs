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
use crate::numerics::trapezoid::running_integral;
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

/// Range of a maneuver's angles of attack, deg.
struct AlphaRange {
    mean: f64,
    lowest: f64,
    /// Length of an interval.
    step: f64,
    /// Interval of each sample, and the sample's fractional position in it.
    samples: Vec<(usize, f64)>,
}

/// Tunnel's derivatives over the angles of attack of a maneuver.
struct TunnelChange<'t, 'a> {
    task: &'t Task<'a>,
    range: &'t AlphaRange,
}

impl TunnelChange<'_, '_> {
    /// Change of a derivative's term over α at the swept angles, per unit of its regressor; along
    /// α itself, change of the coefficient. `None` without a table.
    fn change_of_term(&self, derivative: &Derivative) -> Option<Vec<f64>> {
        match derivative.regressor {
            Regressor::Alpha => self.change_along_alpha(&derivative.name),
            _ => self.change_from_mean(&derivative.name),
        }
    }

    /// Tunnel's change of a derivative, or tabulated sum, from the mean angle of attack to those swept.
    /// `None` without a table.
    fn change_from_mean(&self, name: &str) -> Option<Vec<f64>> {
        let table = self.table(name);
        let mean = table(self.range.mean)?;
        let at = |alpha_deg| Some(table(alpha_deg)? - mean);
        self.range.angles().map(at).collect()
    }

    /// Tunnel's change of a coefficient beyond that by its slope along α at the mean.
    fn change_along_alpha(&self, slope: &str) -> Option<Vec<f64>> {
        let range = self.range;
        let sums = &self.task.context.buildup.combined;
        let sum = sums.iter().find(|sum| sum.slope == slope);
        let Some(change) = sum.and_then(|sum| self.change_from_mean(&sum.name)) else {
            return Some(range.integrate_from_mean(&self.change_from_mean(slope)?));
        };
        let mean = self.table(slope)(range.mean)?;
        let both = change.iter().zip(range.angles());
        let beyond = both.map(|(c, alpha)| c - mean * (alpha - range.mean));
        Some(beyond.collect())
    }

    /// Tunnel's table of a derivative over α in deg, at the maneuver's condition.
    fn table(&self, name: &str) -> impl Fn(f64) -> Option<f64> {
        let tunnel = self.task.context.tunnel;
        let flown = self.task.maneuver.condition(tunnel);
        let table = tunnel.reader(name);
        move |alpha_deg| {
            let condition = Condition { alpha_deg, ..flown };
            table.as_ref()?.at(&condition).map(|v| v.value)
        }
    }
}

impl AlphaRange {
    /// Range of the samples' angles, deg.
    fn from_samples(alphas: &[f64]) -> AlphaRange {
        let mean = alphas.iter().sum::<f64>() / alphas.len().max(1) as f64;
        let lowest = alphas.iter().copied().fold(mean, f64::min);
        let highest = alphas.iter().copied().fold(mean, f64::max);
        let mut range = AlphaRange {
            mean,
            lowest,
            step: ((highest - lowest) / INTERVALS as f64).max(f64::MIN_POSITIVE),
            samples: vec![],
        };
        range.samples = alphas.iter().map(|alpha| range.locate(*alpha)).collect();
        range
    }

    /// Angles from the lowest to the highest.
    fn angles(&self) -> impl Iterator<Item = f64> {
        (0..=INTERVALS).map(|i| self.lowest + self.step * i as f64)
    }

    /// Values at the samples of a quantity that is linear between the angles.
    fn interpolate_at_samples(&self, quantity: &[f64]) -> Vec<f64> {
        let samples = self.samples.iter();
        samples.map(|place| interpolate(quantity, *place)).collect()
    }

    /// Interval of an angle, and the angle's fractional position in it.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the number of an interval"
    )]
    fn locate(&self, alpha: f64) -> (usize, f64) {
        let place = ((alpha - self.lowest) / self.step).clamp(0.0, INTERVALS as f64);
        let low = (place as usize).min(INTERVALS - 1);
        (low, place - low as f64)
    }

    /// Integral over α from the mean.
    fn integrate_from_mean(&self, quantity: &[f64]) -> Vec<f64> {
        let integral = running_integral(quantity, self.step);
        let at_mean = interpolate(&integral, self.locate(self.mean));
        integral.iter().map(|value| value - at_mean).collect()
    }
}

/// Value of a quantity at a place between two angles.
fn interpolate(quantity: &[f64], (low, share): (usize, f64)) -> f64 {
    quantity[low] + share * (quantity[low + 1] - quantity[low])
}

impl AlphaSlopes {
    /// Slopes over α of the derivatives that are free in `wide`, along the motion as measured.
    pub fn new<const NX: usize, E: Equations<NX>>(
        task: &Task,
        window: &Window,
        wide: &Case<NX, E>,
    ) -> AlphaSlopes {
        let motion = window.motion(task.context.aircraft);
        let alphas: Vec<f64> = motion.points().step_by(2).map(|m| DEG * m.alpha).collect();
        let range = &AlphaRange::from_samples(&alphas);
        let tunnel = TunnelChange { task, range };
        let mut slopes = AlphaSlopes {
            derivatives: vec![],
            window: window.clone(),
        };
        for (j, name) in wide.names.iter().take(wide.derivatives()).enumerate() {
            let derivative = task.context.buildup.derivative(name);
            let Some(derivative) = derivative.filter(|d| d.regressor != Regressor::Constant) else {
                continue;
            };
            let change = tunnel.change_of_term(derivative);
            let Some(change) = change.filter(|c| c.iter().any(|c| *c != 0.0)) else {
                continue;
            };
            let mut values = range.interpolate_at_samples(&change);
            if derivative.regressor != Regressor::Alpha {
                let regressor = wide.measured_regressor(j);
                for (value, r) in values.iter_mut().zip(&regressor) {
                    *value *= r;
                }
            }
            slopes.add_slope(derivative, &values);
        }
        slopes
    }

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

    /// Adds the slope of a derivative; `values` is its regressor at the samples.
    fn add_slope(&mut self, derivative: &Derivative, values: &[f64]) {
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
        let alphas = [9.9, 12.0, 14.1];
        let range = AlphaRange::from_samples(&alphas);
        // t(α) − t(ᾱ) = 3 (α − 12): its integral is 1.5 (α − 12)².
        let changes: Vec<f64> = range.angles().map(|a| 3.0 * (a - 12.0)).collect();
        for (value, alpha) in range.interpolate_at_samples(&changes).iter().zip(&alphas) {
            assert_relative_eq!(*value, 3.0 * (alpha - 12.0), epsilon = 1e-12);
        }
        let integral = range.interpolate_at_samples(&range.integrate_from_mean(&changes));
        for (value, alpha) in integral.iter().zip(&alphas) {
            assert_relative_eq!(*value, 1.5 * (alpha - 12.0f64).powi(2), epsilon = 1e-3);
        }
        assert_relative_eq!(integral[1], 0.0);
    }
}
