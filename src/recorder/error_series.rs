//! One error of one instrument over the flights of a campaign.

use std::collections::BTreeMap;

use crate::flight::Channel;
use crate::ingest::ErrorEvidence;
use crate::tables::InstrumentError;
use crate::units::Unit;

/// Error of an instrument in one flight, from that flight alone.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorSample {
    pub flight_id: String,
    pub value: f64,
    /// Standard deviation of the error.
    pub bound: f64,
    /// Standard deviation of the part that all flights share, such as the error of the equations.
    pub systematic: f64,
}

/// One error of one instrument, in the order of the flights.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorSeries {
    pub channel: String,
    pub signal: String,
    pub error: InstrumentError,
    /// Standard deviation of the errors of healthy instruments.
    pub ordinary: f64,
    /// Error by which every flight is corrected already.
    pub corrected: f64,
    pub samples: Vec<ErrorSample>,
}

impl ErrorSeries {
    /// Unit of the error.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        match self.error {
            InstrumentError::Bias => Unit::of_signal(&self.signal).name,
            InstrumentError::Scale => "1",
            InstrumentError::Delay => "s",
        }
    }
}

/// Series of all instruments of the kinematic equations, from the evidence of each flight.
#[must_use]
pub fn instrument_series(
    flights: &[(String, Vec<ErrorEvidence>)],
    channels: &BTreeMap<String, Channel>,
) -> Vec<ErrorSeries> {
    let mut series: BTreeMap<(&str, InstrumentError), ErrorSeries> = BTreeMap::new();
    for (flight_id, evidence) in flights {
        for one in evidence {
            let Some((channel, _)) = channels.iter().find(|(_, c)| c.signal == one.signal) else {
                continue;
            };
            let of_error = series
                .entry((channel, one.error))
                .or_insert_with(|| ErrorSeries {
                    channel: channel.clone(),
                    signal: one.signal.clone(),
                    error: one.error,
                    ordinary: one.ordinary,
                    corrected: 0.0,
                    samples: vec![],
                });
            of_error.samples.push(ErrorSample {
                flight_id: flight_id.clone(),
                value: one.value,
                bound: one.bound,
                systematic: one.systematic,
            });
        }
    }
    series.into_values().collect()
}
