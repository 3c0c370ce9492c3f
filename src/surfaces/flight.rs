//! Evidence of a flight: the evidence of its maneuvers, linearised about their common delays.

use super::delays;
use super::evidence::{FlightEvidence, SurfaceDelay};
use super::maneuver_data::{AircraftModel, ManeuverData};
use crate::flight::Record;
use crate::maneuver::Maneuver;

/// Largest number of steps of a flight's delays; the fit usually settles after three.
const STEPS: usize = 6;

/// Largest change of a delay at which the fit is settled, s.
const SETTLED_S: f64 = 1e-5;

/// Evidence of a flight's maneuvers, each with its part of the record.
#[must_use]
pub fn flight_evidence(
    flight_id: &str,
    maneuvers: &[(Record, &Maneuver)],
    basis: AircraftModel,
) -> FlightEvidence {
    let data: Vec<ManeuverData> = maneuvers
        .iter()
        .filter(|(_, maneuver)| !maneuver.is_rejected())
        .filter_map(|(record, maneuver)| ManeuverData::new(record, maneuver, basis))
        .collect();
    let mut evidence = FlightEvidence {
        flight_id: flight_id.to_owned(),
        step_s: maneuvers.first().map_or(0.0, |(record, _)| record.step_s),
        delays: vec![],
        own_delays: vec![],
        effects: data.iter().flat_map(ManeuverData::effects).collect(),
    };
    for _ in 0..STEPS {
        let about = std::mem::take(&mut evidence.own_delays);
        let about_s = |surface: &str| delay_of_surface_s(&about, surface);
        evidence.delays = data.iter().filter_map(|d| d.delays(about_s)).collect();
        evidence.own_delays = delays::of_flight(&evidence.delays, evidence.step_s);
        let change = |delay: &SurfaceDelay| (delay.delay_s - about_s(&delay.surface)).abs();
        let largest_s = evidence.own_delays.iter().map(change).fold(0.0, f64::max);
        if largest_s < SETTLED_S {
            break;
        }
    }
    evidence
}

/// Delay of a surface; zero for a surface that is not in the list.
fn delay_of_surface_s(delays: &[SurfaceDelay], surface: &str) -> f64 {
    let known = delays.iter().find(|delay| delay.surface == surface);
    known.map_or(0.0, |delay| delay.delay_s)
}
