//! True values of a simulated campaign as tables: events, derivatives, instruments, cards not
//! flown.

use std::path::Path;

use serde::Serialize;

use super::flights::FlownFlight;
use super::simulated_campaign::SimulatedCampaign;
use crate::error::{Problem, Result};
use crate::lab::simulator::FlownManeuver;
use crate::maneuver::{Event, Maneuver};
use crate::store::files;

/// Row of `derivatives.csv`.
#[derive(Clone, Debug, Serialize)]
struct TrueDerivativeRow<'a> {
    flight_id: &'a str,
    class: &'a str,
    start_s: f64,
    end_s: f64,
    alpha_deg: f64,
    mach: f64,
    derivative: &'a str,
    unit: &'a str,
    value: f64,
}

/// Row of `instruments.csv`.
#[derive(Clone, Debug, Serialize)]
struct TrueInstrumentRow<'a> {
    flight_id: &'a str,
    signal: &'a str,
    noise: f64,
    coloured: f64,
    coloured_time_s: f64,
    bias: f64,
    scale: f64,
    delay_s: f64,
    lag_s: f64,
    quantum: f64,
    dropouts_per_s: f64,
    spikes_per_s: f64,
}

/// Writes the tables into a folder.
///
/// # Errors
/// [`crate::error::Error::Io`] naming the file.
pub fn write(campaign: &SimulatedCampaign, folder: &Path, flights: &[FlownFlight]) -> Result<()> {
    let flown = || flights.iter().flat_map(|flight| &flight.flown);
    let events: Vec<Event> = flown().map(|f| event(&f.maneuver)).collect();
    files::place_rows(&folder.join("events.csv"), &events)?;
    let derivatives: Vec<TrueDerivativeRow> =
        flown().flat_map(|f| derivative_rows(campaign, f)).collect();
    files::place_rows(&folder.join("derivatives.csv"), &derivatives)?;
    let instruments: Vec<TrueInstrumentRow> = flights.iter().flat_map(instrument_rows).collect();
    files::place_rows(&folder.join("instruments.csv"), &instruments)?;
    let problems: Vec<&Problem> = flights.iter().flat_map(|f| &f.problems).collect();
    files::place_rows(&folder.join("not_flown.csv"), &problems)
}

fn event(maneuver: &Maneuver) -> Event {
    Event {
        flight_id: maneuver.flight_id.clone(),
        class: maneuver.class.clone(),
        start_s: maneuver.start_s,
        end_s: maneuver.end_s,
    }
}

/// Rows of the true derivatives and combined sums of a maneuver.
fn derivative_rows<'a>(
    campaign: &'a SimulatedCampaign,
    flown: &'a FlownManeuver,
) -> Vec<TrueDerivativeRow<'a>> {
    let maneuver = &flown.maneuver;
    let row = |derivative, unit, value| TrueDerivativeRow {
        flight_id: &maneuver.flight_id,
        class: &maneuver.class,
        start_s: maneuver.start_s,
        end_s: maneuver.end_s,
        alpha_deg: maneuver.alpha_deg,
        mach: maneuver.mach,
        derivative,
        unit,
        value,
    };
    let value = |name: &str| {
        let mut truth = flown.truth.iter();
        truth.find(|t| t.derivative == name).map(|t| t.value)
    };
    let mut rows: Vec<TrueDerivativeRow> = flown
        .truth
        .iter()
        .map(|t| row(&t.derivative, t.unit, t.value))
        .collect();
    for combined in &campaign.config.aero_model.combined {
        if let Some((constant, slope)) = value(&combined.constant).zip(value(&combined.slope)) {
            let sum = constant + slope * maneuver.alpha_deg;
            rows.push(row(&combined.name, "-", sum));
        }
    }
    rows
}

fn instrument_rows(flight: &FlownFlight) -> impl Iterator<Item = TrueInstrumentRow<'_>> {
    let instruments = flight.instruments.0.iter();
    instruments.map(|(signal, i)| TrueInstrumentRow {
        flight_id: &flight.flight_id,
        signal,
        noise: i.noise,
        coloured: i.coloured,
        coloured_time_s: i.coloured_time_s,
        bias: i.bias,
        scale: i.scale,
        delay_s: i.delay_s,
        lag_s: i.lag_s,
        quantum: i.quantum,
        dropouts_per_s: i.dropouts_per_s,
        spikes_per_s: i.spikes_per_s,
    })
}
