//! Noise of the process and of the outputs, and its parameters.
//!
//! The angle of the air is a random walk, whose steps from sample to sample are white noise. A
//! rotary gust is noise of first order: white noise low-passed at a corner frequency that all
//! rotary gusts share. Angle and rotary gusts correlate, because a rotary gust in the plane of the
//! angle is the angle's change along the body (MIL-F-8785C).
//!
//! The parameters are such that the iteration may give them any value: logarithms of sizes, and
//! u = asinh(c / √(1 − Σ c²)) for a correlation c, with the sum over the rotary gusts. Rotary gusts
//! are independent of each other, so their covariance with the angle is positive definite as long as
//! Σ c² < 1. For a single gust u = artanh c.

use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

use crate::dynamics::{InGusts, OUTPUTS};
use crate::units::RAD;

/// Largest number of rotary gusts of an axis.
const MOST_GUSTS: usize = 2;

/// Standard deviations from which the iteration starts: light turbulence.
const START_ANGLE: f64 = 0.05 * RAD;
const START_GUST: f64 = 0.4 * RAD;
/// Usual corner of the rotary gusts, rad/s, from span and airspeed of a fighter, and the standard
/// deviation of its logarithm. A maneuver of some ten seconds hardly determines it.
const USUAL_CORNER: f64 = 4.0;
const CORNER_SPREAD: f64 = 0.7;
/// Prior standard deviation of a correlation's parameter: two thirds of the correlations are below
/// 0.46. A maneuver of some ten seconds hardly determines a correlation. Close to one it would
/// leave a combination of the moments without noise.
const CORRELATION_SPREAD: f64 = 0.5;
/// Prior standard deviation of the logarithm of a rotary gust below the size that the angle's
/// random walk implies. A maneuver of some ten seconds may show none by chance, and bounds without
/// it would be too small.
const ROTARY_SPREAD: f64 = 0.5;
/// Standard deviations of severe turbulence (30 ft/s rms at 300 ft/s), an upper limit for air.
const SEVERE_ANGLE: f64 = 0.7 * RAD;
const SEVERE_GUST: f64 = 6.0 * RAD;
/// Standard deviations below which a gust has no effect on any output.
const LEAST_ANGLE: f64 = 1e-4 * RAD;
const LEAST_GUST: f64 = 1e-3 * RAD;

/// Largest ratio of a rotary gust to the size that the angle's random walk implies. Fits in
/// simulated turbulence have up to 5, fits with surfaces recorded 0.4 s late 300 and more.
const MOST_EXCESS: f64 = 10.0;

/// Noise of a maneuver.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Standard deviation of the change of the air's angle from sample to sample, rad.
    pub angle: f64,
    /// Root mean square of each rotary gust, rad/s.
    pub gusts: [f64; MOST_GUSTS],
    /// Corner frequency of the rotary gusts, rad/s.
    pub corner: f64,
    /// Correlation of each rotary gust's changes with the angle's; the sum of their squares is below
    /// one.
    pub correlations: [f64; MOST_GUSTS],
    /// Standard deviation of each output's noise, in the output's unit.
    pub outputs: [f64; OUTPUTS],
}

/// One parameter of the noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseParameter {
    Angle,
    Gust(usize),
    Corner,
    Correlation(usize),
    Output(usize),
}

/// Prior distribution of a noise parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoisePrior {
    /// Normal distribution with this mean and standard deviation of the parameter.
    Normal(f64, f64),
    /// Normal distribution of the size about zero; the parameter is the logarithm of the size, and
    /// the number the logarithm of the standard deviation. It bounds sizes that affect no output.
    Size(f64),
}

impl NoisePrior {
    /// Cost, its slope and its expected curvature at a value of the parameter.
    #[must_use]
    pub fn cost(self, value: f64) -> [f64; 3] {
        match self {
            NoisePrior::Normal(mean, deviation) => {
                let z = (value - mean) / deviation;
                [0.5 * z * z, z / deviation, deviation.powi(-2)]
            }
            NoisePrior::Size(size) => {
                let square = (2.0 * (value - size)).exp();
                [0.5 * square, square, 2.0 * square]
            }
        }
    }
}

/// Cost of a rotary gust that is smaller than the random walk of the angle implies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotaryCost {
    pub cost: f64,
    /// Slope and curvature along the logarithm of the gust's excess.
    pub slope: f64,
    pub curvature: f64,
    /// Slope of that logarithm along each parameter that acts on it.
    pub along: [(NoiseParameter, f64); 3],
}

impl NoiseParameter {
    /// Noise parameters of an axis with this number of rotary gusts, in order.
    #[must_use]
    pub fn all(gusts: usize) -> Vec<NoiseParameter> {
        let mut all = vec![NoiseParameter::Angle];
        all.extend((0..gusts).map(NoiseParameter::Gust));
        all.push(NoiseParameter::Corner);
        all.extend((0..gusts).map(NoiseParameter::Correlation));
        all.extend((0..OUTPUTS).map(NoiseParameter::Output));
        all
    }

    /// Prior of the parameter; outputs have none.
    #[must_use]
    pub fn prior(self) -> Option<NoisePrior> {
        match self {
            NoiseParameter::Angle => Some(NoisePrior::Size(SEVERE_ANGLE.ln())),
            NoiseParameter::Gust(_) => Some(NoisePrior::Size(SEVERE_GUST.ln())),
            NoiseParameter::Corner => Some(NoisePrior::Normal(USUAL_CORNER.ln(), CORNER_SPREAD)),
            NoiseParameter::Correlation(_) => Some(NoisePrior::Normal(0.0, CORRELATION_SPREAD)),
            NoiseParameter::Output(_) => None,
        }
    }

    /// Least value of the parameter; `resolution` is the least standard deviation of each output.
    #[must_use]
    pub fn floor(self, resolution: &[f64; OUTPUTS]) -> f64 {
        match self {
            NoiseParameter::Angle => LEAST_ANGLE.ln(),
            NoiseParameter::Gust(_) => LEAST_GUST.ln(),
            NoiseParameter::Output(o) => resolution[o].ln(),
            NoiseParameter::Corner | NoiseParameter::Correlation(_) => f64::NEG_INFINITY,
        }
    }
}

impl Noise {
    /// Noise from which the iteration starts, with these standard deviations of the outputs.
    #[must_use]
    pub fn starting(outputs: [f64; OUTPUTS]) -> Noise {
        Noise {
            angle: START_ANGLE,
            gusts: [START_GUST; MOST_GUSTS],
            corner: USUAL_CORNER,
            correlations: [0.0; MOST_GUSTS],
            outputs,
        }
    }

    /// Noise of still air, with these standard deviations of the outputs.
    #[must_use]
    pub fn without_gusts(outputs: [f64; OUTPUTS]) -> Noise {
        Noise {
            angle: LEAST_ANGLE,
            gusts: [LEAST_GUST; MOST_GUSTS],
            ..Noise::starting(outputs)
        }
    }

    /// Noise of almost still air, from which the iteration can grow gusts if there are any.
    #[must_use]
    pub fn with_small_gusts(outputs: [f64; OUTPUTS]) -> Noise {
        Noise {
            angle: 10.0 * LEAST_ANGLE,
            gusts: [10.0 * LEAST_GUST; MOST_GUSTS],
            ..Noise::starting(outputs)
        }
    }

    /// Noise with these values of the parameters, in the order of [`NoiseParameter::all`].
    #[must_use]
    pub fn of_parameters(parameters: &[f64], gusts: usize) -> Noise {
        // Gusts that the axis does not have are still.
        let mut noise = Noise::without_gusts([1.0; OUTPUTS]);
        for (parameter, value) in NoiseParameter::all(gusts).into_iter().zip(parameters) {
            match parameter {
                NoiseParameter::Angle => noise.angle = value.exp(),
                NoiseParameter::Gust(g) => noise.gusts[g] = value.exp(),
                NoiseParameter::Corner => noise.corner = value.exp(),
                NoiseParameter::Correlation(g) => noise.correlations[g] = value.sinh(),
                NoiseParameter::Output(o) => noise.outputs[o] = value.exp(),
            }
        }
        let squares = noise.correlations.iter().map(|s| s * s).sum::<f64>();
        noise.correlations = noise.correlations.map(|s| s / (1.0 + squares).sqrt());
        noise
    }

    /// Values of the parameters for this noise, in the order of [`NoiseParameter::all`].
    #[must_use]
    pub fn parameters(&self, gusts: usize) -> Vec<f64> {
        let value = |parameter| match parameter {
            NoiseParameter::Angle => self.angle.ln(),
            NoiseParameter::Gust(g) => self.gusts[g].ln(),
            NoiseParameter::Corner => self.corner.ln(),
            NoiseParameter::Correlation(g) => {
                (self.correlations[g] / self.own_share(gusts)).asinh()
            }
            NoiseParameter::Output(o) => self.outputs[o].ln(),
        };
        NoiseParameter::all(gusts).into_iter().map(value).collect()
    }

    /// Share √(1 − Σ c²) of the angle's changes that none of an axis's rotary gusts has.
    fn own_share(&self, gusts: usize) -> f64 {
        let squares = self.correlations[..gusts].iter().map(|c| c * c);
        (1.0 - squares.sum::<f64>()).sqrt()
    }

    /// Slope of a gust's correlation along the parameter u of one of the correlations. With
    /// s = sinh u it is c = s/√(1 + Σ s²).
    fn correlation_slope(&self, gust: usize, along: usize, gusts: usize) -> f64 {
        let (own, c) = (self.own_share(gusts), &self.correlations);
        let direct = if gust == along { 1.0 } else { 0.0 };
        own * (c[along] / own).hypot(1.0) * (direct - c[gust] * c[along])
    }

    /// `true` if all noise of the process is at its floor.
    #[must_use]
    pub fn has_no_gusts(&self) -> bool {
        // Parameters are logarithms, whose rounding the factor covers.
        const AT: f64 = 1.0 + 1e-9;
        self.angle <= AT * LEAST_ANGLE && self.gusts.iter().all(|g| *g <= AT * LEAST_GUST)
    }

    /// `true` for moving air whose rotary gusts are consistent with the random walk of the angle.
    /// Rotary gusts without gusts of the angle are a misfit of the rates instead.
    #[must_use]
    pub fn is_of_air(&self, gusts: usize, step_s: f64) -> bool {
        let belongs = |gust| self.rotary_excess(gust, step_s) < MOST_EXCESS.ln();
        !self.has_no_gusts() && (0..gusts).all(belongs)
    }

    /// Steady gain of a filter for the angle of the air alone, measured by the output `vane`; zero
    /// in still air.
    ///
    /// Let q be the variance of the angle's random walk in a step and r the variance of the vane's
    /// noise, both rad². The variance of the predicted angle is p = q/2 + √(q²/4 + q r), and the
    /// gain p / (p + r).
    #[must_use]
    pub fn angle_gain(&self, vane: usize) -> f64 {
        if self.has_no_gusts() {
            return 0.0;
        }
        let (q, r) = (self.angle.powi(2), (self.outputs[vane] * RAD).powi(2));
        let p = 0.5 * q + (0.25 * q * q + q * r).sqrt();
        p / (p + r)
    }

    /// Logarithm of a rotary gust's size over the size that the random walk of the angle implies.
    ///
    /// Let σ be the walk's standard deviation per sample, rad, Δt the sampling interval, s, and ω
    /// the corner, rad/s. The rotary gust is the angle's rate, which is white with intensity σ²/Δt,
    /// low-passed at ω. Its variance is therefore σ² ω/(2 Δt) (MIL-F-8785C).
    fn rotary_excess(&self, gust: usize, step_s: f64) -> f64 {
        let expected = self.angle * (self.corner / (2.0 * step_s)).sqrt();
        (self.gusts[gust] / expected).ln()
    }

    /// Cost of a rotary gust that is smaller than the random walk of the angle implies; `None` for
    /// a larger gust.
    #[must_use]
    pub fn rotary_cost(&self, gust: usize, step_s: f64) -> Option<RotaryCost> {
        let excess = self.rotary_excess(gust, step_s);
        (excess < 0.0).then(|| {
            let [cost, slope, curvature] = NoisePrior::Normal(0.0, ROTARY_SPREAD).cost(excess);
            RotaryCost {
                cost,
                slope,
                curvature,
                along: [
                    (NoiseParameter::Gust(gust), 1.0),
                    (NoiseParameter::Angle, -1.0),
                    (NoiseParameter::Corner, -0.5),
                ],
            }
        })
    }

    /// Share of a rotary gust that remains after a step.
    #[must_use]
    pub fn decay(&self, step_s: f64) -> f64 {
        (-self.corner * step_s).exp()
    }

    /// Slope of [`Noise::decay`] along a parameter.
    #[must_use]
    pub fn decay_slope(&self, parameter: NoiseParameter, step_s: f64) -> f64 {
        match parameter {
            NoiseParameter::Corner => -self.corner * step_s * self.decay(step_s),
            _ => 0.0,
        }
    }

    /// Variance of a rotary gust's change in a step, (rad/s)²: with it the gust keeps its size.
    fn gust_variance(&self, gust: usize, step_s: f64) -> f64 {
        self.gusts[gust].powi(2) * (1.0 - self.decay(step_s).powi(2))
    }

    /// Covariance of the states' noise in a step.
    #[must_use]
    pub fn covariance<const NX: usize, E: InGusts<NX>>(&self, step_s: f64) -> SMatrix<f64, NX, NX> {
        let mut q = SMatrix::zeros();
        q[(E::ANGLE, E::ANGLE)] = self.angle.powi(2);
        for (g, &(_, relative)) in E::AIR_RELATIVE_RATES.iter().enumerate() {
            let variance = self.gust_variance(g, step_s);
            let cross = self.correlations[g] * self.angle * variance.sqrt();
            q[(relative, relative)] = variance;
            q[(E::ANGLE, relative)] = cross;
            q[(relative, E::ANGLE)] = cross;
        }
        q
    }

    /// Slope of [`Noise::covariance`] along a parameter.
    #[must_use]
    pub fn covariance_slope<const NX: usize, E: InGusts<NX>>(
        &self,
        parameter: NoiseParameter,
        step_s: f64,
    ) -> SMatrix<f64, NX, NX> {
        let q = self.covariance::<NX, E>(step_s);
        let mut slope = SMatrix::zeros();
        if parameter == NoiseParameter::Angle {
            slope[(E::ANGLE, E::ANGLE)] = 2.0 * q[(E::ANGLE, E::ANGLE)];
        }
        let decay = self.decay(step_s);
        for (g, &(_, relative)) in E::AIR_RELATIVE_RATES.iter().enumerate() {
            // Relative slopes of the gust's standard deviation and of the correlation.
            let (of_gust, of_angle) = match parameter {
                NoiseParameter::Gust(other) if other == g => (1.0, 0.0),
                NoiseParameter::Corner => {
                    let left = decay * decay;
                    (left * self.corner * step_s / (1.0 - left), 0.0)
                }
                NoiseParameter::Angle => (0.0, 1.0),
                _ => (0.0, 0.0),
            };
            let mut cross = (of_gust + of_angle) * q[(E::ANGLE, relative)];
            if let NoiseParameter::Correlation(along) = parameter {
                let unit = self.angle * self.gust_variance(g, step_s).sqrt();
                cross = self.correlation_slope(g, along, E::AIR_RELATIVE_RATES.len()) * unit;
            }
            slope[(relative, relative)] = 2.0 * of_gust * q[(relative, relative)];
            slope[(E::ANGLE, relative)] = cross;
            slope[(relative, E::ANGLE)] = cross;
        }
        slope
    }
}
