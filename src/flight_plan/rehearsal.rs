//! Rehearsal of a card: it is flown by the posterior's aircraft, recorded with the campaign's
//! noise, and estimated as a flown maneuver is. The covariance of that estimate, nuisance
//! parameters included, predicts the information of the card.

use std::collections::BTreeMap;

use super::candidate::CandidateCard;
use super::limits::{self, Extremes};
use crate::aero::WindTunnel;
use crate::aero::wind_tunnel::TunnelPoint;
use crate::config::Config;
use crate::estimate::Estimated;
use crate::flight::{RemainingError, RemainingErrors};
use crate::lab::campaign::FlightLimits;
use crate::lab::simulator::{Instrument, Instruments, Simulator};
use crate::maneuver::Maneuver;
use crate::numerics::statistics::order_statistics::median;
use crate::pipeline::estimate_maneuver;
use crate::surfaces::DelayCorrection;
use crate::tables::{ChannelRow, EstimateRow, InstrumentError, InstrumentRow, Outcome};

/// A card as it will be flown.
#[derive(Clone, Debug)]
pub struct Rehearsed {
    pub maneuver: Maneuver,
    pub estimated: Estimated,
    pub extremes: Extremes,
}

/// Everything that rehearsals have in common.
#[derive(Clone, Debug)]
pub struct RehearsalBasis<'a> {
    pub config: &'a Config,
    pub simulator: &'a Simulator,
    pub instruments: &'a Instruments,
    /// Errors that remain in the signals of a flight.
    pub remaining_errors: &'a BTreeMap<String, RemainingErrors>,
    pub delays: &'a [DelayCorrection],
    pub limits: &'a FlightLimits,
}

impl RehearsalBasis<'_> {
    /// Flies, records and estimates a card.
    ///
    /// # Errors
    /// The reason why the card is refused: it cannot be flown, breaks a limit, or cannot be estimated.
    pub fn rehearse(&self, candidate: &CandidateCard) -> Result<Rehearsed, String> {
        let card = &candidate.card;
        let flown = self.simulator.fly(card).map_err(|problem| problem.reason)?;
        let extremes = Extremes::of(&flown.record);
        if let Some(reason) = limits::broken(self.limits, &flown.record, &extremes) {
            return Err(reason);
        }
        let maneuver = Maneuver {
            maneuver_id: format!("{} {}", card.flight_id, card.seed),
            ..flown.maneuver.clone()
        };
        let mut record = flown.recorded(self.instruments, card.seed);
        record.remaining_errors.clone_from(self.remaining_errors);
        let estimated = estimate_maneuver(self.config, &record, &maneuver, self.delays);
        let fit = &estimated.fit;
        if fit.outcome != Outcome::Converged || estimated.covariance.is_none() {
            let (outcome, reason) = (fit.outcome, &fit.reason);
            return Err(format!(
                "its rehearsal cannot be estimated: {outcome}: {reason}"
            ));
        }
        Ok(Rehearsed {
            maneuver,
            estimated,
            extremes,
        })
    }
}

/// Instruments with the noise of the campaign's channels and no other errors, since each estimate
/// already includes the uncertainty of calibration. A channel without measured noise has the noise
/// of the cards.
#[must_use]
pub fn instruments(of_cards: &Instruments, channels: &[ChannelRow]) -> Instruments {
    let of_cards = of_cards.0.iter();
    let mut noise: BTreeMap<String, f64> = of_cards.map(|(s, i)| (s.clone(), i.noise)).collect();
    let mut measured: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for row in channels {
        let of_signal = measured.entry(&row.signal).or_default();
        of_signal.extend(deviation(row).filter(|deviation| *deviation > 0.0));
    }
    for (signal, values) in measured {
        if let Some(median) = median(values) {
            noise.insert(signal.to_owned(), median);
        }
    }
    let instrument = |noise| Instrument {
        noise,
        ..Instrument::default()
    };
    Instruments(
        noise
            .into_iter()
            .map(|(signal, noise)| (signal, instrument(noise)))
            .collect(),
    )
}

/// Errors that remain in the signals of a flight like those of the campaign. Each is the median
/// bound and scatter of an error that its flights determine.
#[must_use]
pub fn remaining_errors(rows: &[InstrumentRow]) -> BTreeMap<String, RemainingErrors> {
    let mut rows_by_signal: BTreeMap<&str, Vec<&InstrumentRow>> = BTreeMap::new();
    for row in rows {
        rows_by_signal.entry(&row.signal).or_default().push(row);
    }
    let errors = rows_by_signal.into_iter().map(|(signal, rows)| {
        let remaining = |error: InstrumentError| {
            let determined = rows.iter().filter(|row| row.error(error).is_some());
            let bounds = determined.clone().filter_map(|row| row.error(error));
            let bound = median(bounds.map(|(_, bound)| bound))?;
            Some(RemainingError {
                scatter: median(determined.map(|row| row.scatter(error)))?,
                ..RemainingError::corrected(bound)
            })
        };
        let errors = RemainingErrors {
            bias: remaining(InstrumentError::Bias),
            scale: remaining(InstrumentError::Scale),
        };
        (signal.to_owned(), errors)
    });
    errors.collect()
}

/// Standard deviation of a channel's samples: that of its noise, and at least that of its rounding, which
/// a noise below the recorder's step hides.
fn deviation(row: &ChannelRow) -> Option<f64> {
    // Rounding errors are uniform over a step.
    let rounding = row.quantisation.map(|step| step / 12.0_f64.sqrt());
    row.noise.map(|noise| noise.max(rounding.unwrap_or(0.0)))
}

/// Derivatives of the aircraft that flies the rehearsals: the posterior's, else the tunnel's, else the
/// median of the estimates at each degree, else zero.
#[must_use]
pub fn derivatives(
    config: &Config,
    mut posterior: WindTunnel,
    estimates: &[EstimateRow],
) -> WindTunnel {
    for derivative in &config.aero_model.derivatives {
        let name = derivative.name.as_str();
        if posterior.has(name) {
            continue;
        }
        posterior.take_table(name, &config.tunnel);
        if !posterior.has(name) {
            for point in medians(name, estimates) {
                posterior.insert(name, point);
            }
        }
    }
    posterior
}

/// Median of a derivative's estimates at each degree of angle of attack; zero without estimates.
fn medians(name: &str, estimates: &[EstimateRow]) -> Vec<TunnelPoint> {
    let mut by_degree: BTreeMap<i64, Vec<f64>> = BTreeMap::new();
    for row in estimates.iter().filter(|row| row.derivative == name) {
        #[expect(clippy::cast_possible_truncation, reason = "an angle in whole degrees")]
        let degree = row.alpha_deg.round() as i64;
        by_degree.entry(degree).or_default().extend(row.value);
    }
    let by_degree = by_degree.into_iter();
    let found =
        by_degree.filter_map(|(degree, own)| Some(TunnelPoint::new(degree as f64, median(own)?)));
    let mut found: Vec<TunnelPoint> = found.collect();
    if found.is_empty() {
        found.push(TunnelPoint::new(0.0, 0.0));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::{ChannelVerdict, InstrumentVerdict};
    use approx::assert_relative_eq;

    fn channel(noise: Option<f64>, quantisation: Option<f64>) -> ChannelRow {
        ChannelRow {
            flight_id: "f".to_owned(),
            channel: "q".to_owned(),
            signal: "q_deg_s".to_owned(),
            samples: 1000,
            rate_hz: Some(40.0),
            between: 0,
            bridged: 0,
            despiked: 0,
            missing: 0,
            stuck: 0,
            wraps: 0,
            quantisation,
            noise,
            verdict: ChannelVerdict::Ok,
        }
    }

    #[test]
    fn the_noise_of_a_coarse_channel_is_at_least_that_of_its_rounding() {
        let noise =
            |row: ChannelRow| instruments(&Instruments::default(), &[row]).0["q_deg_s"].noise;
        // A step of 0.6 has the deviation 0.6/√12.
        assert_relative_eq!(
            noise(channel(Some(0.0), Some(0.6))),
            0.173_205,
            max_relative = 1e-5
        );
        assert_relative_eq!(noise(channel(Some(0.5), Some(0.6))), 0.5);
        assert_relative_eq!(noise(channel(Some(0.02), None)), 0.02);
    }

    #[test]
    fn a_planned_flight_has_the_remaining_errors_of_the_flown_ones() {
        let row = |bias_bound: Option<f64>| InstrumentRow {
            bias: bias_bound.map(|_| 0.5),
            bias_bound,
            ..InstrumentRow::undetermined("f", "Q", "q_deg_s", "deg/s", InstrumentVerdict::Ok)
        };
        let rows = [Some(0.01), Some(0.03), Some(0.02), None].map(row);
        let expected = RemainingErrors {
            bias: Some(RemainingError::corrected(0.02)),
            scale: None,
        };
        assert_eq!(
            remaining_errors(&rows),
            [("q_deg_s".to_owned(), expected)].into()
        );
    }
}
