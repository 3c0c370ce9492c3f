//! Conditions of the study of the bounds: what is flown, and how it is recorded and estimated.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::lab::simulator::{
    DerivativeLookup, DiscreteGusts, FlightCondition, Turbulence, TurbulenceModel,
};
use crate::output_error::estimation::Weights;

/// Noise of the records.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RecordNoise {
    /// White noise of the five outputs, as the theory assumes.
    White,
    /// Coloured noise of the five outputs with the same standard deviation.
    Coloured,
    /// White noise of every channel, including those that the estimator takes as exact: surfaces,
    /// airspeed, the other axis.
    #[default]
    EveryChannel,
}

/// One condition of the study. Default: still air, derivatives and recorder as the estimator assumes,
/// noise on every channel, the campaign's weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyCondition {
    pub name: String,
    #[serde(default)]
    pub turbulence: Option<Turbulence>,
    #[serde(default)]
    pub discrete_gusts: Option<DiscreteGusts>,
    /// Source of the derivatives during a maneuver.
    #[serde(default, rename = "tables")]
    pub derivatives: DerivativeLookup,
    /// Time by which surfaces are recorded late.
    #[serde(default)]
    pub surface_delay_s: f64,
    #[serde(default)]
    pub noise: RecordNoise,
    /// Weights of the residuals; `None` for those of the campaign's settings.
    #[serde(default)]
    pub weights: Option<Weights>,
}

impl StudyCondition {
    /// Condition of the flights.
    #[must_use]
    pub fn flown(&self) -> FlightCondition {
        FlightCondition {
            derivatives: self.derivatives,
            turbulence: self.turbulence,
            discrete_gusts: self.discrete_gusts,
        }
    }
}

/// The condition in words: `Dryden 3 ft/s rms over 1750 ft; surfaces 10 ms late; noise on every channel`.
impl fmt::Display for StudyCondition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        if let Some(turbulence) = &self.turbulence {
            let model = match turbulence.model {
                TurbulenceModel::Dryden => "Dryden",
                TurbulenceModel::VonKarman => "von Kármán",
            };
            parts.push(format!(
                "{model} {} ft/s rms over {} ft",
                turbulence.sigma_ft_s,
                turbulence.scale_length_ft()
            ));
        }
        if let Some(gusts) = &self.discrete_gusts {
            parts.push(format!(
                "1 − cos gusts of {} ft/s over {} ft, {} a second in each axis",
                gusts.size_ft_s, gusts.gradient_ft, gusts.per_s
            ));
        }
        if parts.is_empty() {
            parts.push("still air".to_owned());
        }
        if self.derivatives == DerivativeLookup::Varying {
            parts.push("derivatives vary with α and Mach number".to_owned());
        }
        if self.surface_delay_s > 0.0 {
            parts.push(format!("surfaces {} ms late", 1e3 * self.surface_delay_s));
        }
        let noise = match self.noise {
            RecordNoise::White => "white noise on the outputs",
            RecordNoise::Coloured => "coloured noise on the outputs",
            RecordNoise::EveryChannel => "noise on every channel",
        };
        parts.push(noise.to_owned());
        if let Some(weights) = self.weights {
            parts.push(format!("`weights: {weights}`"));
        }
        f.write_str(&parts.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_condition_is_described_by_what_departs_from_the_default() {
        let condition = StudyCondition {
            name: "all".into(),
            turbulence: Some(Turbulence {
                model: TurbulenceModel::VonKarman,
                sigma_ft_s: 3.0,
                length_ft: None,
            }),
            discrete_gusts: None,
            derivatives: DerivativeLookup::Varying,
            surface_delay_s: 0.01,
            noise: RecordNoise::EveryChannel,
            weights: None,
        };
        assert_eq!(
            condition.to_string(),
            "von Kármán 3 ft/s rms over 2500 ft; derivatives vary with α and Mach number; surfaces 10 ms late; \
             noise on every channel"
        );
        let still = StudyCondition {
            turbulence: None,
            derivatives: DerivativeLookup::Frozen,
            surface_delay_s: 0.0,
            noise: RecordNoise::White,
            weights: Some(Weights::Table),
            ..condition
        };
        assert_eq!(
            still.to_string(),
            "still air; white noise on the outputs; `weights: table`"
        );
    }
}
