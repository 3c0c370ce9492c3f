//! Finding on one instrument: its estimated errors, its faults in words, and its row of the table
//! `instruments`.

use std::collections::BTreeMap;

use super::super::error_estimates::{
    ErrorEstimate, ErrorEvidence, correct_together, estimate, evidence, has_estimate_at_limit,
    instrument_error, withdraw_corrections,
};
use super::super::joint_fit::FittedErrors;
use super::super::parameters::{ALL_KINDS, KINDS, Kind, SIGNALS};
use super::super::settings::Compatibility;
use crate::flight::{Channel, signal};
use crate::tables::{InstrumentRow, InstrumentVerdict};
use crate::units::Unit;

/// Verb of a scale error in words; the other errors follow "is".
const READS: &str = "reads";

/// Estimated errors of one instrument; `None` for an error that the flight does not determine.
#[derive(Clone, Debug, PartialEq)]
pub struct InstrumentFinding {
    pub signal: &'static str,
    pub channel: String,
    /// `false` if no window of the flight could be reconstructed.
    pub examined: bool,
    pub estimates: [Option<ErrorEstimate>; KINDS],
    /// Mean airspeed of the windows.
    pub speed_ft_s: Option<f64>,
    /// Evidence of the flight alone on its errors.
    pub evidence: Vec<ErrorEvidence>,
    /// Temperature of the air over that of the standard atmosphere, if it explains the scale error.
    pub air_temperature: Option<f64>,
    /// Distance of a vane ahead of its stated position, if that explains the readings of all instruments.
    pub ahead_ft: Option<f64>,
}

impl InstrumentFinding {
    /// Finding on instrument `i` from the fitted errors; `None` unless it is recorded.
    pub(super) fn of(
        i: usize,
        errors: Option<&FittedErrors>,
        channels: &BTreeMap<String, Channel>,
        recorded: &[String],
        settings: &Compatibility,
    ) -> Option<InstrumentFinding> {
        let signal = SIGNALS[i];
        let (channel, _) = channels.iter().find(|(_, c)| c.signal == signal)?;
        if !recorded.iter().any(|name| name == signal) {
            return None;
        }
        let mut estimates = ALL_KINDS.map(|kind| estimate(errors?, i, kind, settings));
        correct_together(&mut estimates, settings);
        if has_estimate_at_limit(&estimates) {
            withdraw_corrections(&mut estimates);
        }
        let evidence = ALL_KINDS
            .into_iter()
            .filter_map(|kind| evidence(errors?, i, kind, settings));
        Some(InstrumentFinding {
            signal,
            channel: channel.clone(),
            examined: errors.is_some(),
            estimates,
            speed_ft_s: errors.and_then(|errors| errors.speed_ft_s),
            evidence: evidence.collect(),
            air_temperature: None,
            ahead_ft: None,
        })
    }

    /// `true` if an error of the instrument is a fault.
    pub(super) fn has_fault(&self) -> bool {
        self.ahead_ft.is_some() || self.estimates.iter().flatten().any(|e| e.fault)
    }

    /// Each fault in words.
    pub(super) fn faults(&self) -> Vec<String> {
        let fault = |kind: Kind| {
            let e = self.estimates[kind as usize].filter(|e| e.fault)?;
            let words = match kind {
                Kind::Bias => format!("off by {:.3} {}", e.value, self.unit()),
                Kind::Scale => format!("{READS} {:.3} times what it should", 1.0 + e.value),
                Kind::Delay if e.value > 0.0 => format!("delayed by {:.0} ms", 1e3 * e.value),
                Kind::Delay => format!("ahead by {:.0} ms", -1e3 * e.value),
            };
            Some(if e.at_limit {
                format!("{words} or more, the limit of the search")
            } else {
                words
            })
        };
        let faults = ALL_KINDS.into_iter().filter_map(fault);
        faults.chain(self.position_in_words()).collect()
    }

    /// Position of a vane against the stated one, in words.
    fn position_in_words(&self) -> Option<String> {
        self.ahead_ft.map(|ahead_ft| {
            let direction = if ahead_ft > 0.0 { "ahead" } else { "aft" };
            let distance_ft = ahead_ft.abs();
            format!("about {distance_ft:.0} ft {direction} of its position in aircraft.yaml")
        })
    }

    fn unit(&self) -> &'static str {
        Unit::of_signal(self.signal).name
    }

    /// All faults of the instrument with their bounds, as a sentence.
    pub(super) fn fault_sentence(&self) -> String {
        let bound = |kind: Kind| {
            let e = self.estimates[kind as usize].filter(|e| e.fault)?;
            Some(match kind {
                Kind::Bias => format!("bound {:.3} {}", e.bound, self.unit()),
                Kind::Scale => format!("bound {:.3}", e.bound),
                Kind::Delay => format!("bound {:.0} ms", 1e3 * e.bound),
            })
        };
        let bounds: Vec<String> = ALL_KINDS.into_iter().filter_map(bound).collect();
        let predicate = |fault: String| {
            if fault.starts_with(READS) {
                fault
            } else {
                format!("is {fault}")
            }
        };
        let faults: Vec<String> = self.faults().into_iter().map(predicate).collect();
        let bounds = if bounds.is_empty() {
            String::new()
        } else {
            format!(" ({})", bounds.join(", "))
        };
        let against = if self.ahead_ft.is_some() {
            "as the other channels show"
        } else {
            "against the other channels"
        };
        format!(
            "`{}` {} {against}{bounds}{}",
            self.channel,
            faults.join(", "),
            self.vane_position().unwrap_or_default()
        )
    }

    /// Temperature of the air that explains the scale error of q̄, in words.
    pub(super) fn air_sentence(&self) -> Option<String> {
        let ratio = self.air_temperature?;
        let scale = self.estimates[Kind::Scale as usize]?;
        Some(format!(
            "`{}` reads {:.3} times what it should in the standard atmosphere, as in air of {:.0} % of its temperature. \
             The channel is left as recorded: record the temperature of the air (signal `{}`)",
            self.channel,
            1.0 + scale.value,
            100.0 * ratio,
            signal::AIR_TEMPERATURE
        ))
    }

    /// Position that explains the delay of a vane. A vane at a distance x ahead of the c.g. reads α
    /// − q x/V. In a pitching motion q ≈ α̇, so the reading is about α(t − x/V). Likewise β + r x/V
    /// with r ≈ −β̇.
    fn vane_position(&self) -> Option<String> {
        let is_vane = matches!(self.signal, signal::ALPHA_VANE | signal::BETA_VANE);
        let delay = self.estimates[Kind::Delay as usize].filter(|e| e.fault && is_vane)?;
        let (distance_ft, speed_ft_s) = (delay.value * self.speed_ft_s?, self.speed_ft_s?);
        let direction = if distance_ft > 0.0 { "ahead" } else { "aft" };
        Some(format!(
            "; a vane {:.1} ft {direction} of its position in aircraft.yaml has this delay at {speed_ft_s:.0} ft/s: check the \
             position first",
            distance_ft.abs()
        ))
    }

    /// Treatment of the channel with a fault, in words.
    pub(super) fn consequence(&self) -> &'static str {
        if self.ahead_ft.is_some() {
            return "the estimates have the stated position: correct it (aircraft.yaml, aircraft: sensors)";
        }
        if self
            .estimates
            .iter()
            .flatten()
            .any(|e| e.fault && e.applied)
        {
            "the record is corrected by it. Check the instrument and the recorder"
        } else {
            "the channel is left as recorded. Check the instrument and the recorder, or have it corrected \
             (ingest: compatibility: fault: apply)"
        }
    }

    /// Row of the table `instruments`.
    pub(super) fn row(&self, flight_id: &str) -> InstrumentRow {
        let of = |kind: Kind| self.estimates[kind as usize];
        let value = |kind: Kind| of(kind).map(|e| e.value);
        let bound = |kind: Kind| of(kind).map(|e| e.bound);
        let scatter = |kind: Kind| of(kind).map(|e| e.scatter);
        let applied: Vec<&str> = ALL_KINDS
            .into_iter()
            .filter(|k| of(*k).is_some_and(|e| e.applied))
            .map(|kind| instrument_error(kind).name())
            .collect();
        let faults = self.faults();
        let is_determined = self.estimates.iter().any(Option::is_some);
        let verdict = match (faults.is_empty(), is_determined) {
            (false, _) => InstrumentVerdict::Fault(faults.join(", ")),
            (true, true) if of(Kind::Delay).is_none() => InstrumentVerdict::NoDelay,
            (true, true) => InstrumentVerdict::Ok,
            (true, false) if self.examined => InstrumentVerdict::NotExcited,
            (true, false) => InstrumentVerdict::NotExamined,
        };
        InstrumentRow {
            flight_id: flight_id.to_owned(),
            channel: self.channel.clone(),
            signal: self.signal.to_owned(),
            unit: self.unit().to_owned(),
            bias: value(Kind::Bias),
            bias_bound: bound(Kind::Bias),
            bias_scatter: scatter(Kind::Bias),
            scale: value(Kind::Scale).map(|s| 1.0 + s),
            scale_bound: bound(Kind::Scale),
            scale_scatter: scatter(Kind::Scale),
            delay_s: value(Kind::Delay),
            delay_bound_s: bound(Kind::Delay),
            applied: applied.join(" "),
            verdict,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::error_estimates::tests::estimated;
    use super::*;

    #[test]
    fn the_delay_of_a_vane_is_reported_with_the_position_that_explains_it() {
        let finding = |signal: &'static str, delay_s: f64| InstrumentFinding {
            signal,
            channel: "vane".to_owned(),
            examined: true,
            estimates: [None, None, Some(estimated(Kind::Delay, delay_s, 0.002))],
            speed_ft_s: Some(170.0),
            evidence: vec![],
            air_temperature: None,
            ahead_ft: None,
        };
        let ahead = finding(signal::ALPHA_VANE, 0.088).fault_sentence();
        assert!(ahead.contains("15.0 ft ahead of its position"), "{ahead}");
        let aft = finding(signal::BETA_VANE, -0.088).fault_sentence();
        assert!(aft.contains("15.0 ft aft of its position"), "{aft}");
        assert!(
            !finding(signal::THETA, 0.088)
                .fault_sentence()
                .contains("vane 15")
        );
    }
}
