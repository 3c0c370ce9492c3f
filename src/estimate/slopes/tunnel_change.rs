//! Change of the wind tunnel's derivatives over the angles of attack that a maneuver sweeps.

use crate::aero::{Combined, Condition, Derivative, Regressor};
use crate::estimate::task::Task;
use crate::numerics::cubic_curve::CubicCurve;
use crate::numerics::series::trapezoid::running_integral;
use crate::numerics::statistics::mean::mean;

/// Intervals of the swept angles of attack, in each of which the tunnel's change is linear.
const INTERVALS: usize = 200;

/// Range of a maneuver's angles of attack, deg.
pub(super) struct AlphaRange {
    pub mean: f64,
    lowest: f64,
    /// Length of an interval.
    step: f64,
    /// Interval of each sample, and the sample's fractional position in it.
    samples: Vec<(usize, f64)>,
}

/// Tunnel's derivatives over the angles of attack of a maneuver.
pub(super) struct TunnelChange<'t, 'a> {
    pub task: &'t Task<'a>,
    pub range: &'t AlphaRange,
}

impl TunnelChange<'_, '_> {
    /// Change of a derivative's term at the samples, per unit of its regressor; along α itself, change of
    /// the coefficient. `None` without a table.
    pub fn at_samples(&self, derivative: &Derivative) -> Option<Vec<f64>> {
        let change = match derivative.regressor {
            Regressor::Alpha => self.change_along_alpha(&derivative.name),
            _ => self.change_from_mean(&derivative.name),
        };
        Some(self.range.interpolate_at_samples(&change?))
    }

    /// Tunnel's change of a derivative, or tabulated sum, from the mean angle of attack to those swept.
    /// `None` without a table.
    fn change_from_mean(&self, name: &str) -> Option<Vec<f64>> {
        let table = self.table(name);
        let mean = table(self.range.mean)?;
        let at = |alpha_deg| Some(table(alpha_deg)? - mean);
        self.range.angles().map(at).collect()
    }

    /// Tunnel's change of a coefficient beyond that by its slope along α at the mean: by the sum of
    /// constant and slope times α if the tunnel has it, else by the table of the slope.
    fn change_along_alpha(&self, slope: &str) -> Option<Vec<f64>> {
        self.change_of_sum(slope)
            .or_else(|| self.change_of_slope(slope))
    }

    /// As [`Self::change_along_alpha`], by the cubic through the sum of constant and slope times α.
    fn change_of_sum(&self, slope: &str) -> Option<Vec<f64>> {
        let range = self.range;
        let sums = &self.task.context.aero_model.combined;
        let curve = self.curve_of(sums.iter().find(|sum| sum.slope == slope)?)?;
        let (mean, slope) = curve.at(range.mean);
        let beyond = range.angles().map(|alpha| {
            let (value, _) = curve.at(alpha);
            value - mean - slope * (alpha - range.mean)
        });
        Some(beyond.collect())
    }

    /// As [`Self::change_along_alpha`], by the integral over the table of the slope.
    fn change_of_slope(&self, slope: &str) -> Option<Vec<f64>> {
        let change = self.change_from_mean(slope)?;
        Some(self.range.integrate_from_mean(&change))
    }

    /// Change of a coefficient at the samples by its sum, less that by the table of its slope along α.
    /// `None` without both, and for other derivatives.
    ///
    /// The two tables would agree if they had no errors and their points were close.
    pub fn contradiction(&self, derivative: &Derivative) -> Option<Vec<f64>> {
        if derivative.regressor != Regressor::Alpha {
            return None;
        }
        let by_sum = self.change_of_sum(&derivative.name)?;
        let by_slope = self.change_of_slope(&derivative.name)?;
        let pairs = by_sum.iter().zip(by_slope);
        let difference: Vec<f64> = pairs.map(|(sum, slope)| sum - slope).collect();
        Some(self.range.interpolate_at_samples(&difference))
    }

    /// Sum of constant and slope times α over α, as tabulated, else from the tables of both. `None` without
    /// them.
    fn curve_of(&self, sum: &Combined) -> Option<CubicCurve> {
        let [tabulated, constant, slope] =
            [&sum.name, &sum.constant, &sum.slope].map(|name| self.table(name));
        let points = [&sum.name, &sum.slope].map(|name| self.task.context.tunnel.alphas_deg(name));
        let points = points.into_iter().find(|points| !points.is_empty())?;
        let knot = |alpha: f64| {
            let slope = slope(alpha)?;
            let value = tabulated(alpha).or_else(|| Some(constant(alpha)? + slope * alpha));
            Some((alpha, value?, slope))
        };
        CubicCurve::through(points.into_iter().map(knot).collect::<Option<_>>()?)
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
    pub fn from_samples(alphas: &[f64]) -> AlphaRange {
        let mean = mean(alphas.iter().copied());
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

/// Linear interpolation between the entries `low` and `low + 1`; `share` is the fraction of the
/// step above `low`.
fn interpolate(quantity: &[f64], (low, share): (usize, f64)) -> f64 {
    quantity[low] + share * (quantity[low + 1] - quantity[low])
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
