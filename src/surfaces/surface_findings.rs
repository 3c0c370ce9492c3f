//! Rows of the table `instruments` about surfaces, and problems of surfaces with a reversed sign.

use std::collections::BTreeMap;

use super::delay_corrections::DelayCorrection;
use super::evidence::{FlightEvidence, SurfaceDelay, SurfaceEffect};
use crate::error::{Problem, ProblemStage};
use crate::flight::Channel;
use crate::recorder::{ErrorSample, ErrorSeries};
use crate::tables::{ALL_FLIGHTS, InstrumentError, InstrumentRow, InstrumentVerdict};
use crate::units::Unit;

/// Size, in standard errors, above which an effect is certainly opposite to the tunnel's. Effects
/// of healthy surfaces in simulated campaigns are no lower than −0.2.
const SURELY_REVERSED: f64 = 4.0;

/// Ratio of a surface's effect to the tunnel's, from several maneuvers.
#[derive(Clone, Copy, Debug, PartialEq)]
struct MeanEffect {
    ratio: f64,
    bound: f64,
    maneuvers: usize,
}

impl MeanEffect {
    /// Mean of the effects, weighted by their bounds. The bound of the mean includes the scatter
    /// between maneuvers.
    fn of<'a>(effects: impl Iterator<Item = &'a SurfaceEffect> + Clone) -> MeanEffect {
        let weights = effects.clone().map(|e| e.bound.powi(-2));
        let information: f64 = weights.clone().sum();
        let both = effects.clone().zip(weights.clone());
        let ratio = both.map(|(e, w)| w * e.ratio).sum::<f64>() / information;
        let both = effects.clone().zip(weights);
        let square: f64 = both.map(|(e, w)| w * (e.ratio - ratio).powi(2)).sum();
        let maneuvers = effects.count();
        let dispersion = square / (maneuvers.max(2) - 1) as f64;
        MeanEffect {
            ratio,
            bound: (dispersion.max(1.0) / information).sqrt(),
            maneuvers,
        }
    }

    /// `true` if the effect is certainly opposite to the tunnel's, and nearer to minus one than to
    /// zero.
    fn is_reversed(&self) -> bool {
        self.ratio < -0.5 && self.ratio < -SURELY_REVERSED * self.bound
    }
}

/// Rows and problems of a campaign's surfaces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceFindings {
    pub rows: Vec<InstrumentRow>,
    pub problems: Vec<Problem>,
}

/// Findings of every flight, then of all flights together.
#[must_use]
pub fn findings(
    flights: &[FlightEvidence],
    pooled: &[SurfaceDelay],
    corrections: &[DelayCorrection],
    channels: &BTreeMap<String, Channel>,
) -> SurfaceFindings {
    let mut findings = SurfaceFindings::default();
    for flight in flights {
        for delay in &flight.own_delays {
            let effects = flight.effects.iter();
            let effect = MeanEffect::of(effects.filter(|e| e.surface == delay.surface));
            findings.add(&flight.flight_id, delay, effect, corrections, channels);
        }
    }
    for delay in pooled {
        let effects = flights.iter().flat_map(|flight| &flight.effects);
        let effect = MeanEffect::of(effects.filter(|e| e.surface == delay.surface));
        let row = row(ALL_FLIGHTS, delay, &effect, corrections, channels);
        findings.rows.extend(row);
    }
    findings
}

impl SurfaceFindings {
    /// Adds the row of a flight's surface, and a problem where its sign is reversed.
    fn add(
        &mut self,
        flight_id: &str,
        delay: &SurfaceDelay,
        effect: MeanEffect,
        corrections: &[DelayCorrection],
        channels: &BTreeMap<String, Channel>,
    ) {
        let Some(row) = row(flight_id, delay, &effect, corrections, channels) else {
            return;
        };
        if effect.is_reversed() {
            self.problems.push(Problem {
                stage: ProblemStage::Segment,
                flight_id: flight_id.to_owned(),
                place: format!("channel `{}`", row.channel),
                reason: format!(
                    "the effect of `{}` is {:.2} times the tunnel's (bound {:.2}) in {} maneuvers: its sign, or that of its \
                     tunnel values, is reversed; check both (aircraft.yaml: channels: {}: sign: -1)",
                    row.channel, effect.ratio, effect.bound, effect.maneuvers, row.channel
                ),
            });
        }
        self.rows.push(row);
    }
}

/// Size of ordinary delays, s, and the error of the equations in a delay: the estimate in simulated
/// campaigns without delay is 0.45 ms.
const ORDINARY_S: f64 = 3e-3;
const MODEL_S: f64 = 0.5e-3;

/// Delays of the surfaces over the flights, each estimated from its flight alone.
#[must_use]
pub fn delay_series(
    flights: &[FlightEvidence],
    corrections: &[DelayCorrection],
    channels: &BTreeMap<String, Channel>,
) -> Vec<ErrorSeries> {
    let of_channel = |(name, channel): (&String, &Channel)| {
        let sample = |flight: &FlightEvidence| {
            let mut own = flight.own_delays.iter();
            let delay = own.find(|delay| delay.surface == channel.signal)?;
            delay.is_determined().then(|| ErrorSample {
                flight_id: flight.flight_id.clone(),
                value: delay.delay_s,
                bound: delay.bound_s,
                systematic: MODEL_S,
            })
        };
        let samples: Vec<ErrorSample> = flights.iter().filter_map(sample).collect();
        let mut corrections = corrections.iter();
        let correction = corrections.find(|c| c.surface == channel.signal);
        (!samples.is_empty()).then(|| ErrorSeries {
            channel: name.clone(),
            signal: channel.signal.clone(),
            error: InstrumentError::Delay,
            ordinary: ORDINARY_S,
            corrected: correction.map_or(0.0, |c| c.delay_s),
            samples,
        })
    };
    channels.iter().filter_map(of_channel).collect()
}

/// Row of a surface; `None` for one without a channel.
fn row(
    flight_id: &str,
    delay: &SurfaceDelay,
    effect: &MeanEffect,
    corrections: &[DelayCorrection],
    channels: &BTreeMap<String, Channel>,
) -> Option<InstrumentRow> {
    let (channel, _) = channels.iter().find(|(_, c)| c.signal == delay.surface)?;
    let is_shifted = corrections
        .iter()
        .any(|c| c.surface == delay.surface && c.delay_s != 0.0);
    let verdict = if effect.is_reversed() {
        InstrumentVerdict::Fault("sign reversed".to_owned())
    } else if delay.is_determined() {
        InstrumentVerdict::Ok
    } else {
        InstrumentVerdict::NotExcited
    };
    let told = delay.is_determined();
    let unit = Unit::of_signal(&delay.surface).name;
    Some(InstrumentRow {
        delay_s: told.then_some(delay.delay_s),
        delay_bound_s: told.then_some(delay.bound_s),
        applied: if is_shifted { "delay" } else { "" }.to_owned(),
        ..InstrumentRow::undetermined(flight_id, channel, &delay.surface, unit, verdict)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(ratios: &[(f64, f64)]) -> MeanEffect {
        let effects: Vec<SurfaceEffect> = ratios
            .iter()
            .map(|(ratio, bound)| SurfaceEffect {
                surface: "da".to_owned(),
                ratio: *ratio,
                bound: *bound,
            })
            .collect();
        MeanEffect::of(effects.iter())
    }

    #[test]
    fn a_reversed_surface_is_as_sure_as_its_maneuvers_agree() {
        assert!(mean(&[(-1.0, 0.3), (-0.9, 0.3), (-1.1, 0.3)]).is_reversed());
        assert!(!mean(&[(-1.0, 0.6)]).is_reversed());
        assert!(!mean(&[(-0.3, 0.05)]).is_reversed());
        assert!(!mean(&[(-3.0, 0.2), (1.0, 0.2), (-2.0, 0.2)]).is_reversed());
        assert!(!mean(&[(1.0, 0.1), (0.9, 0.1)]).is_reversed());
        assert!(!mean(&[]).is_reversed());
    }
}
