//! The conductor of a simulated campaign: flies its cards, flight by flight in parallel, and writes
//! what a recorder and an all-knowing tunnel would leave: the archive, a wind-tunnel database, the
//! truth.
//!
//! Between two cards of a flight the recorder is off. Each flight's random numbers come from the
//! seed and its name, so the same cards are the same bytes whatever the number of threads.

mod cards;
mod loading;

use std::collections::BTreeMap;
use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;

use crate::error::{Error, Problem, Result};
use crate::flight::channel::RawColumn;
use crate::flight::{Channel, Record};
use crate::lab::simulator::noise::{Noise, seed_of};
use crate::lab::simulator::{Card, Flown, Instruments};
use crate::maneuver::{Event, Maneuver};
use crate::pipeline::Progress;
use crate::store::files::TunnelRow;
use crate::store::{atomic, files, recorder};
use crate::units::Unit;

use cards::{FlightCard, TestPoint};
pub use loading::SimulatedCampaign;

/// The record's time of a flight's first sample, and how long the recorder is off between two
/// cards, s.
const FIRST_S: f64 = 100.0;
const OFF_S: f64 = 30.0;

/// A flight after its cards: what was flown, with what, and which cards could not be.
#[derive(Clone, Debug, Default)]
pub struct FlownFlight {
    pub flight_id: String,
    pub flown: Vec<Flown>,
    pub instruments: Instruments,
    pub problems: Vec<Problem>,
    /// The records of its cards as its instruments left them.
    records: Vec<Record>,
}

/// A row of the truth's derivatives.
#[derive(Clone, Debug, Serialize)]
struct TruthRow<'a> {
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

/// A row of the truth's instruments.
#[derive(Clone, Debug, Serialize)]
struct InstrumentRow<'a> {
    flight_id: &'a str,
    signal: &'a str,
    noise: f64,
    coloured: f64,
    coloured_time_s: f64,
    bias: f64,
    scale: f64,
    lag_s: f64,
    quantum: f64,
    dropouts_per_s: f64,
    spikes_per_s: f64,
}

/// Flies all cards and writes the campaign into a folder.
///
/// # Errors
/// A disk that says no. A card that cannot be flown is among the flights' problems.
pub fn run(
    simulation: &SimulatedCampaign,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Vec<FlownFlight>> {
    let cards = &simulation.cards.flights;
    progress.begin("simulate", cards.len());
    let fly = |(flight_id, card): (&String, &FlightCard)| {
        let flown = flight(simulation, flight_id, card);
        let path = out.join("flights").join(format!("{flight_id}.parquet"));
        if !flown.records.is_empty() {
            let columns = recording(&simulation.config.channels, &flown.records);
            let bytes = recorder::bytes(&columns).map_err(|what| Error::store(&path, &what))?;
            atomic::place(&path, &bytes)?;
        }
        progress.advance(flight_id);
        Ok(flown)
    };
    let flights = cards
        .par_iter()
        .map(fly)
        .collect::<Result<Vec<FlownFlight>>>()?;
    progress.end();
    files::place_rows(&out.join("wind_tunnel.csv"), &wind_tunnel(simulation))?;
    truth(simulation, out, &flights)?;
    Ok(flights)
}

/// Flies the cards of one flight one after another.
fn flight(simulation: &SimulatedCampaign, flight_id: &str, card: &FlightCard) -> FlownFlight {
    let seed = seed_of(simulation.cards.seed, flight_id);
    let instruments = simulation.cards.instruments.drawn(seed);
    let mut flight = FlownFlight {
        flight_id: flight_id.to_owned(),
        instruments,
        ..FlownFlight::default()
    };
    let mut start_s = FIRST_S;
    for (k, card) in cards(simulation, flight_id, card, seed)
        .into_iter()
        .enumerate()
    {
        let card = Card { start_s, ..card };
        match simulation.simulator.fly(&card) {
            Ok(flown) => {
                flight
                    .records
                    .push(flown.recorded(&flight.instruments, seed_of(seed, &format!("card {k}"))));
                flight.flown.push(flown);
            }
            Err(problem) => flight.problems.push(problem),
        }
        start_s += card.program.duration_s + OFF_S;
    }
    flight
}

/// The cards of a flight: its test points in order, each a little lighter than the one before.
fn cards(
    simulation: &SimulatedCampaign,
    flight_id: &str,
    flight: &FlightCard,
    seed: u64,
) -> Vec<Card> {
    let points = flight
        .points
        .iter()
        .flat_map(|p| p.alpha_deg.iter().map(move |alpha| (p, *alpha)));
    let card = |(k, (point, alpha_deg)): (usize, (&TestPoint, f64))| {
        let axis = simulation.config.class(&point.class)?.axis;
        Some(Card {
            flight_id: flight_id.to_owned(),
            class: point.class.clone(),
            axis,
            alpha_deg,
            altitude_ft: flight.altitude_ft,
            heading_deg: flight.heading_deg,
            mass_slug: flight.mass_slug - flight.burnt_slug * k as f64,
            start_s: 0.0,
            tables: simulation.cards.tables,
            turbulence: flight.turbulence,
            seed: seed_of(seed, &format!("air {k}")),
            program: simulation
                .cards
                .programs
                .get(&point.class)?
                .scaled(point.scale),
        })
    };
    points.enumerate().filter_map(card).collect()
}

/// The columns that the recorder writes of some records, one after another: the channel map
/// backwards.
fn recording(
    channels: &BTreeMap<String, Channel>,
    records: &[Record],
) -> BTreeMap<String, RawColumn> {
    let column = |(name, channel): (&String, &Channel)| {
        let factor = Unit::parse(&channel.unit)
            .ok()
            .and_then(|u| u.factor_to(Unit::of_signal(&channel.signal)));
        let per_unit = 1.0 / (factor.unwrap_or(1.0) * channel.sign * channel.scale);
        let recorded = |value: f64| match channel.wraps_at {
            Some(period) => (value * per_unit).rem_euclid(period),
            None => value * per_unit,
        };
        let of = |record: &Record, k: usize| match record.values(&channel.signal) {
            _ if channel.signal == "time_s" => record.time_s(k),
            Some(values) => values.get(k).copied().unwrap_or(f64::NAN),
            // A flag that this card's program does not name.
            None => 0.0,
        };
        let values = records
            .iter()
            .flat_map(|record| (0..record.samples).map(move |k| recorded(of(record, k))));
        (
            name.clone(),
            RawColumn {
                unit: Some(channel.unit.clone()),
                values: values.collect(),
            },
        )
    };
    channels.iter().map(column).collect()
}

/// The truth as a tunnel would have measured it: each derivative wrong by a share of its size over
/// the whole table, each point by another; and the sums that a tunnel tabulates, of its own values.
fn wind_tunnel(simulation: &SimulatedCampaign) -> Vec<TunnelRow> {
    let (settings, seed) = (&simulation.cards.wind_tunnel, simulation.cards.seed);
    let source = Some("simulated tunnel: the truth with stated errors".to_owned());
    let mut rows = Vec::new();
    for derivative in &simulation.config.buildup.derivatives {
        let same =
            |row: &&TunnelRow| row.derivative.replace('_', "") == derivative.name.replace('_', "");
        let size = simulation.config.tunnel.root_mean_square(&derivative.name) / 100.0;
        let mut noise = Noise::new(seed, &format!("tunnel {}", derivative.name));
        let whole = settings.error_pct * noise.normal();
        for row in simulation.truth.iter().filter(same) {
            rows.push(TunnelRow {
                derivative: derivative.name.clone(),
                value: row.value + size * (whole + settings.scatter_pct * noise.normal()),
                uncertainty: Some(size * settings.error_pct.hypot(settings.scatter_pct)),
                source: source.clone(),
                ..row.clone()
            });
        }
    }
    for combined in &simulation.config.buildup.combined {
        let of = |name: &str| {
            rows.iter()
                .filter(|r| r.derivative == name)
                .cloned()
                .collect::<Vec<TunnelRow>>()
        };
        let slopes = of(&combined.slope);
        for row in of(&combined.constant) {
            let there = |s: &&TunnelRow| {
                s.alpha_deg.total_cmp(&row.alpha_deg).is_eq() && s.mach == row.mach
            };
            if let Some(slope) = slopes.iter().find(there) {
                let uncertainty = row
                    .uncertainty
                    .zip(slope.uncertainty)
                    .map(|(a, b)| a.hypot(b * row.alpha_deg));
                let value = row.value + slope.value * row.alpha_deg;
                rows.push(TunnelRow {
                    derivative: combined.name.clone(),
                    value,
                    uncertainty,
                    ..row
                });
            }
        }
    }
    rows.retain(|row| !settings.leave_out.contains(&row.derivative));
    rows
}

fn truth(simulation: &SimulatedCampaign, out: &Path, flights: &[FlownFlight]) -> Result<()> {
    let folder = out.join("truth");
    let flown = || flights.iter().flat_map(|f| &f.flown);
    let event = |m: &Maneuver| Event {
        flight_id: m.flight_id.clone(),
        class: m.class.clone(),
        start_s: m.start_s,
        end_s: m.end_s,
    };
    let events: Vec<Event> = flown().map(|f| event(&f.maneuver)).collect();
    files::place_rows(&folder.join("events.csv"), &events)?;
    let rows: Vec<TruthRow> = flown().flat_map(|f| true_rows(simulation, f)).collect();
    files::place_rows(&folder.join("derivatives.csv"), &rows)?;
    let rows: Vec<InstrumentRow> = flights.iter().flat_map(instrument_rows).collect();
    files::place_rows(&folder.join("instruments.csv"), &rows)?;
    let problems: Vec<&Problem> = flights.iter().flat_map(|f| &f.problems).collect();
    files::place_rows(&folder.join("not_flown.csv"), &problems)
}

fn true_rows<'a>(simulation: &'a SimulatedCampaign, flown: &'a Flown) -> Vec<TruthRow<'a>> {
    let m = &flown.maneuver;
    let row = |derivative, unit, value| TruthRow {
        flight_id: &m.flight_id,
        class: &m.class,
        start_s: m.start_s,
        end_s: m.end_s,
        alpha_deg: m.alpha_deg,
        mach: m.mach,
        derivative,
        unit,
        value,
    };
    let value = |name: &str| {
        flown
            .truth
            .iter()
            .find(|t| t.derivative == name)
            .map(|t| t.value)
    };
    let mut rows: Vec<TruthRow> = flown
        .truth
        .iter()
        .map(|t| row(&t.derivative, t.unit, t.value))
        .collect();
    for combined in &simulation.config.buildup.combined {
        if let Some((constant, slope)) = value(&combined.constant).zip(value(&combined.slope)) {
            rows.push(row(&combined.name, "-", constant + slope * m.alpha_deg));
        }
    }
    rows
}

fn instrument_rows(flight: &FlownFlight) -> impl Iterator<Item = InstrumentRow<'_>> {
    flight
        .instruments
        .0
        .iter()
        .map(|(signal, i)| InstrumentRow {
            flight_id: &flight.flight_id,
            signal,
            noise: i.noise,
            coloured: i.coloured,
            coloured_time_s: i.coloured_time_s,
            bias: i.bias,
            scale: i.scale,
            lag_s: i.lag_s,
            quantum: i.quantum,
            dropouts_per_s: i.dropouts_per_s,
            spikes_per_s: i.spikes_per_s,
        })
}
