//! Evidence of a maneuver: its information on the surfaces' delays, and the ratio of the surfaces'
//! effects to the tunnel's.

use nalgebra::{Complex, DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::fourier::Spectrum;
use super::maneuver_data::{CoefficientData, ManeuverData, TermData};
use super::weighted_fit::{Prior, WeightedFit};

/// Prior standard deviation of a derivative along a state, in sizes of its table: wide, so that the
/// data decide.
const OF_STATES: f64 = 3.0;

/// Prior standard deviation of a derivative along a surface about the tunnel's value, in sizes of
/// its table, when delays are estimated. It fixes the derivatives of surfaces that hardly move.
const OF_SURFACES: f64 = 0.5;

/// Standard deviation of the tunnel's values in the comparison of effects, in sizes of the table:
/// values near zero may have either sign.
const OF_TUNNEL: f64 = 0.5;

/// Prior standard deviation of a derivative without a table, over the ratio of the coefficient's
/// power to the regressor's.
const WITHOUT_TABLE: f64 = 1e3;

/// Information of one maneuver on the delays τ of its surfaces: the cost is ½ τᵀ H τ − τᵀ h.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DelayEvidence {
    pub surfaces: Vec<String>,
    /// Matrix H, row by row, 1/s².
    pub information: Vec<f64>,
    /// Vector h, 1/s.
    pub moment: Vec<f64>,
}

/// Delay of a surface relative to accelerations, rates and vanes; negative if the surface is
/// recorded early.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceDelay {
    pub surface: String,
    pub delay_s: f64,
    /// Standard deviation.
    pub bound_s: f64,
}

/// Ratio of a surface's effect to the effect that the tunnel predicts: one if correct, minus one if
/// the sign is reversed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceEffect {
    pub surface: String,
    pub ratio: f64,
    /// Standard deviation.
    pub bound: f64,
}

/// Evidence of one flight on its surfaces.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FlightEvidence {
    pub flight_id: String,
    /// Sampling interval of the record.
    pub step_s: f64,
    /// One entry per maneuver.
    pub delays: Vec<DelayEvidence>,
    /// Delays from this flight alone.
    pub own_delays: Vec<SurfaceDelay>,
    /// One entry per maneuver and surface.
    pub effects: Vec<SurfaceEffect>,
}

impl ManeuverData {
    /// Information on the delays, linearised about given delays, s.
    pub fn delays(&self, about_s: impl Fn(&str) -> f64) -> Option<DelayEvidence> {
        let count = self.surfaces.len();
        let delays_s: Vec<f64> = self.surfaces.iter().map(|s| about_s(s)).collect();
        let mut information = DMatrix::zeros(count, count);
        let mut gradient = DVector::zeros(count);
        for coefficient in &self.coefficients {
            let (own, pull) = self.coefficient_information(coefficient, &delays_s)?;
            information += own;
            gradient += pull;
        }
        let moment = &information * DVector::from_vec(delays_s) + gradient;
        Some(DelayEvidence {
            surfaces: self.surfaces.clone(),
            information: information.transpose().as_slice().to_vec(),
            moment: moment.as_slice().to_vec(),
        })
    }

    /// Information of one coefficient on the delays, and its gradient.
    fn coefficient_information(
        &self,
        coefficient: &CoefficientData,
        delays_s: &[f64],
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let CoefficientData { implied, terms } = coefficient;
        let shifted = terms.iter().map(|term| {
            let delay_s = term.surface.map_or(0.0, |s| delays_s[s]);
            term.regressor
                .spectrum_at_delay(&self.frequencies_hz, delay_s)
        });
        let (columns, slopes): (Vec<Spectrum>, Vec<Spectrum>) = shifted.unzip();
        let priors: Vec<Prior> = (terms.iter().zip(&columns))
            .map(|(term, column)| delay_prior(term, implied, column))
            .collect();
        let fit = WeightedFit::new(&self.frequencies_hz, implied, &columns, &priors)?;
        let mut by_delay = vec![vec![Complex::new(0.0, 0.0); implied.len()]; delays_s.len()];
        for ((term, slope), value) in terms.iter().zip(&slopes).zip(fit.values.iter()) {
            if let Some(surface) = term.surface {
                for (sum, slope) in by_delay[surface].iter_mut().zip(slope) {
                    *sum += slope * *value;
                }
            }
        }
        Some(fit.eliminated(&columns, &by_delay))
    }

    /// Ratios of the surfaces' effects to the tunnel's, from derivatives estimated without the
    /// tunnel's signs.
    pub fn effects(&self) -> Vec<SurfaceEffect> {
        let mut sums = vec![(0.0, 0.0); self.surfaces.len()];
        for CoefficientData { implied, terms } in &self.coefficients {
            let columns: Vec<Spectrum> = terms
                .iter()
                .map(|term| {
                    term.regressor
                        .spectrum_at_delay(&self.frequencies_hz, 0.0)
                        .0
                })
                .collect();
            let priors: Vec<Prior> = (terms.iter().zip(&columns))
                .map(|(term, column)| unsigned_prior(term, implied, column))
                .collect();
            let Some(fit) = WeightedFit::new(&self.frequencies_hz, implied, &columns, &priors)
            else {
                continue;
            };
            for (j, term) in terms.iter().enumerate() {
                let Some((surface, tunnel)) = term.surface.zip(term.tunnel) else {
                    continue;
                };
                let variance = fit.covariance[(j, j)] + (OF_TUNNEL * term.size).powi(2);
                sums[surface].0 += tunnel * fit.values[j] / variance;
                sums[surface].1 += tunnel * tunnel / variance;
            }
        }
        let known = self.surfaces.iter().zip(sums);
        known
            .filter(|(_, (_, information))| *information > 0.0)
            .map(|(surface, (sum, information))| SurfaceEffect {
                surface: surface.clone(),
                ratio: sum / information,
                bound: information.sqrt().recip(),
            })
            .collect()
    }
}

/// Prior of a derivative for the delays.
fn delay_prior(term: &TermData, implied: &Spectrum, column: &Spectrum) -> Prior {
    let sizes = if term.surface.is_some() {
        OF_SURFACES
    } else {
        OF_STATES
    };
    Prior {
        value: term.tunnel.unwrap_or(0.0),
        deviation: deviation(sizes * term.size, implied, column),
    }
}

/// Prior of a derivative that may have either sign.
fn unsigned_prior(term: &TermData, implied: &Spectrum, column: &Spectrum) -> Prior {
    Prior {
        value: 0.0,
        deviation: deviation(OF_STATES * term.size, implied, column),
    }
}

/// The stated deviation, or a wide one if none is stated.
fn deviation(stated: f64, implied: &Spectrum, column: &Spectrum) -> f64 {
    if stated > 0.0 {
        return stated;
    }
    let power = |spectrum: &Spectrum| spectrum.iter().map(Complex::norm_sqr).sum::<f64>();
    let ratio = (power(implied) / power(column)).sqrt();
    if ratio.is_finite() && ratio > 0.0 {
        WITHOUT_TABLE * ratio
    } else {
        1.0
    }
}
