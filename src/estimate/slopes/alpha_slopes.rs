//! Change of the derivatives over the angles of attack that a maneuver sweeps.
//!
//! The build-up has one value of each derivative in a maneuver. In the wind tunnel's tables t(α) it
//! changes. For a regressor r other than α the coefficient gains the term (t(α) − t(ᾱ)) r. For α
//! itself it gains T(α) − T(ᾱ) − T'(ᾱ) (α − ᾱ). T is the sum of the constant and α t, as tabulated or
//! from the tables of both, with the slope t at its points. Without such tables T is the integral of t.
//! Held derivatives change as estimated ones do.
//!
//! Slopes of two kinds act in a maneuver:
//!
//! | slope | acts along | prior for the common share λ |
//! |---|---|---|
//! | of a coefficient | the sum of its derivatives' changes in the tunnel | λ |
//! | of a derivative | σ (α − ᾱ) r; along α itself σ (α − ᾱ)²/2 | mean 0, standard deviation λ |
//!
//! The share is 1 where flight changes as the tunnel does, and 0 where the derivatives are constant. σ is the
//! standard uncertainty of a derivative's change per degree. Along α itself the difference between
//! T(α) − T(ᾱ) − T'(ᾱ) (α − ᾱ) and the integral of t(α) − t(ᾱ) is one more slope with the prior of a
//! derivative: its two tables contradict each other by that much. Filter error estimates the slopes
//! ([`filter_error::slopes`](crate::filter_error::slopes)).

use super::tunnel_change::{AlphaRange, TunnelChange};
use crate::aero::{Coefficient, Derivative, Regressor};
use crate::dynamics::Equations;
use crate::dynamics::motion::ManeuverSignals;
use crate::estimate::task::Task;
use crate::filter_error::bounds::WidePass;
use crate::filter_error::slopes::SlopePrior;
use crate::numerics::statistics::mean::mean;
use crate::output_error::{Case, Model};
use crate::units::DEG;

/// Slopes over α that act in a maneuver, with its signals.
#[derive(Clone)]
pub(in crate::estimate) struct AlphaSlopes {
    pub slopes: Vec<AlphaSlope>,
    /// Derivatives along α and constants, one pair per coefficient, that take the slopes' lines.
    lines: Vec<[Derivative; 2]>,
    /// Signals of the maneuver, with those of the slopes.
    pub signals: ManeuverSignals,
}

/// Slope of a coefficient or derivative.
#[derive(Clone)]
pub(in crate::estimate) struct AlphaSlope {
    /// Derivative along the change less its line, which is one of the signals.
    pub term: Derivative,
    pub prior: SlopePrior,
    /// Line through the change: slope over α, per deg, and value at α = 0.
    line: [f64; 2],
}

/// Change of a coefficient along a maneuver.
struct CoefficientChange {
    name: String,
    coefficient: Coefficient,
    /// Values at the samples.
    values: Vec<f64>,
    /// Slope of the values over α, per deg, where the regressors are at their means.
    slope: f64,
}

impl AlphaSlopes {
    /// Slopes over α of the derivatives that are free in `wide`, along the motion as measured.
    pub fn new<const NX: usize, E: Equations<NX>>(
        task: &Task,
        signals: &ManeuverSignals,
        wide: &Case<NX, E>,
    ) -> AlphaSlopes {
        let motion = signals.motion(task.context.aircraft);
        let alphas: Vec<f64> = motion.points().step_by(2).map(|m| DEG * m.alpha).collect();
        let mut slopes = AlphaSlopes {
            slopes: vec![],
            lines: lines::<NX, E>(),
            signals: signals.clone(),
        };
        for (change, prior) in changes(task, &alphas, wide) {
            slopes.add(&change, prior, &alphas);
        }
        slopes
    }

    /// Model with the slopes added as held derivatives; `values[i]` belongs to slope `i`.
    pub fn held_in<'s>(&'s self, model: &Model<'s>, values: &[f64]) -> Model<'s> {
        let mut held = model.clone();
        let slopes_and_values = || self.slopes.iter().zip(values);
        held.held
            .extend(slopes_and_values().map(|(slope, value)| (&slope.term, *value)));
        for (part, derivative) in self.parts_of_lines() {
            let of_line = slopes_and_values().filter(|(slope, _)| slope.has_line_in(derivative));
            let value = of_line.map(|(slope, value)| slope.line[part] * value).sum();
            held.held.push((derivative, value));
        }
        held
    }

    /// Model with the slopes free as well.
    pub fn added_to<'s>(&'s self, model: &Model<'s>) -> Model<'s> {
        let mut wide = model.clone();
        wide.free
            .extend(self.slopes.iter().map(|slope| &slope.term));
        wide.free
            .extend(self.parts_of_lines().map(|(_, derivative)| derivative));
        wide
    }

    /// Pass whose parameters of the slopes move their lines as well.
    pub fn with_lines(&self, mut pass: WidePass) -> WidePass {
        for (part, derivative) in self.parts_of_lines() {
            let slopes = self.slopes.iter().filter(|s| s.has_line_in(derivative));
            for slope in slopes {
                pass.add_column(&derivative.name, slope.line[part], &slope.term.name);
            }
        }
        pass
    }

    /// Derivatives of the lines, each with its place in [`AlphaSlope::line`].
    fn parts_of_lines(&self) -> impl Iterator<Item = (usize, &Derivative)> {
        self.lines.iter().flat_map(|pair| pair.iter().enumerate())
    }

    /// Adds the slope of a change, unless nothing changes.
    ///
    /// The change's line acts along the angle of attack of the computed motion. Along the measured one, the
    /// vane's noise would bias the slope to zero.
    fn add(&mut self, change: &CoefficientChange, prior: SlopePrior, alphas: &[f64]) {
        if change.values.iter().all(|v| *v == 0.0) {
            return;
        }
        let along = if self.lines.is_empty() {
            0.0
        } else {
            change.slope
        };
        let line = [along, -along * mean(alphas.iter().copied())];
        let pairs = change.values.iter().zip(alphas);
        let rest: Vec<f64> = pairs
            .map(|(value, alpha)| value - line[0] * alpha - line[1])
            .collect();
        self.signals = self.signals.with_samples(&change.name, &rest);
        let term = Derivative {
            regressor: Regressor::Surface(change.name.clone()),
            name: change.name.clone(),
            coefficient: change.coefficient,
        };
        self.slopes.push(AlphaSlope { term, prior, line });
    }
}

impl CoefficientChange {
    /// No change, at as many samples as there are angles of attack.
    fn none(name: &str, coefficient: Coefficient, alphas: &[f64]) -> CoefficientChange {
        CoefficientChange {
            name: format!("{name} over alpha"),
            coefficient,
            values: vec![0.0; alphas.len()],
            slope: 0.0,
        }
    }

    /// Adds the changes of a derivative, per unit of its regressor; along α itself those of the coefficient.
    fn add(&mut self, changes: &[f64], alphas: &[f64], regressor: Option<&[f64]>) {
        let Some(regressor) = regressor else {
            let pairs = self.values.iter_mut().zip(changes);
            return pairs.for_each(|(value, change)| *value += change);
        };
        for ((value, change), r) in self.values.iter_mut().zip(changes).zip(regressor) {
            *value += change * r;
        }
        self.slope += mean(regressor.iter().copied()) * slope_of_line(alphas, changes);
    }
}

impl AlphaSlope {
    /// `true` if the derivative belongs to the lines of the slope's coefficient.
    fn has_line_in(&self, derivative: &Derivative) -> bool {
        self.term.coefficient == derivative.coefficient
    }
}

/// Changes of the coefficients over α by the derivatives that are free in `wide`. First one
/// standard deviation of each derivative's change, then the changes in the tunnel.
fn changes<const NX: usize, E: Equations<NX>>(
    task: &Task,
    alphas: &[f64],
    wide: &Case<NX, E>,
) -> Vec<(CoefficientChange, SlopePrior)> {
    let range = &AlphaRange::from_samples(alphas);
    let tunnel = TunnelChange { task, range };
    let mut changes = vec![];
    let mut in_tunnel = E::AXIS.coefficients().map(|coefficient| {
        CoefficientChange::none(&format!("{coefficient:?}"), coefficient, alphas)
    });
    for (j, name) in wide.names.iter().take(wide.derivatives()).enumerate() {
        let derivative = task.context.aero_model.derivative(name);
        let Some(derivative) = derivative.filter(|d| d.regressor != Regressor::Constant) else {
            continue;
        };
        let is_alpha = derivative.regressor == Regressor::Alpha;
        let regressor = (!is_alpha).then(|| wide.measured_regressor(j));
        if let Some(changes) = tunnel.at_samples(derivative) {
            let sum = &mut in_tunnel[derivative.coefficient.index()];
            sum.add(&changes, alphas, regressor.as_deref());
        }
        let deviation = own_change(task, derivative, alphas, range.mean);
        let mut change = CoefficientChange::none(name, derivative.coefficient, alphas);
        change.add(&deviation, alphas, regressor.as_deref());
        changes.push((change, SlopePrior::DEVIATION));
        if let Some(contradiction) = tunnel.contradiction(derivative) {
            let name = format!("{name} by its sum");
            let mut change = CoefficientChange::none(&name, derivative.coefficient, alphas);
            change.add(&contradiction, alphas, None);
            changes.push((change, SlopePrior::DEVIATION));
        }
    }
    changes.extend(in_tunnel.map(|change| (change, SlopePrior::SHARE)));
    changes
}

/// One standard deviation of a derivative's own change from the mean `at` of the angles to each sample; along α
/// itself, of the coefficient's.
///
/// The table's error has the standard uncertainty u and the correlation length ℓ of the posterior's
/// prior. Over a small distance d it changes by √3 u d/ℓ.
fn own_change(task: &Task, derivative: &Derivative, alphas: &[f64], at: f64) -> Vec<f64> {
    let length = task.context.settings.tunnel_error_length_deg;
    let slope = 3f64.sqrt() * task.held_uncertainty(derivative) / length;
    let change = |alpha: &f64| match derivative.regressor {
        Regressor::Alpha => 0.5 * slope * (alpha - at).powi(2),
        _ => slope * (alpha - at),
    };
    alphas.iter().map(change).collect()
}

/// Derivatives of the lines of an axis; none where α is no state.
fn lines<const NX: usize, E: Equations<NX>>() -> Vec<[Derivative; 2]> {
    if E::state_of(&Regressor::Alpha).is_none() {
        return vec![];
    }
    let parts = |coefficient: Coefficient| {
        [
            (Regressor::Alpha, "line"),
            (Regressor::Constant, "constant"),
        ]
        .map(|(regressor, part)| Derivative {
            name: format!("{coefficient:?} over alpha, {part}"),
            regressor,
            coefficient,
        })
    };
    E::AXIS.coefficients().map(parts).to_vec()
}

/// Slope of the least-squares line of `y` over `x`; zero if `x` is constant.
fn slope_of_line(x: &[f64], y: &[f64]) -> f64 {
    let mean = mean(x.iter().copied());
    let square: f64 = x.iter().map(|x| (x - mean).powi(2)).sum();
    let product: f64 = x.iter().zip(y).map(|(x, y)| (x - mean) * y).sum();
    if square > 0.0 { product / square } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_slope_of_a_line_is_that_of_least_squares() {
        assert_relative_eq!(slope_of_line(&[1.0, 2.0, 4.0], &[5.0, 7.0, 11.0]), 2.0);
        // Points off the line by +1, −2, +1 at −1, 0, 1 leave its slope.
        assert_relative_eq!(slope_of_line(&[-1.0, 0.0, 1.0], &[-2.0, -2.0, 4.0]), 3.0);
        assert_relative_eq!(slope_of_line(&[2.0, 2.0], &[1.0, 3.0]), 0.0);
    }
}
