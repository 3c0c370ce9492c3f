//! Maneuvers of the simulator with known derivatives, recorded by instruments that are only noisy.

use std::path::Path;
use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};

use crate::aero::wind_tunnel::{self, TunnelPoint};
use crate::aero::{AeroModel, Condition, WindTunnel};
use crate::aircraft::Aircraft;
use crate::flight::Record;
use crate::lab::campaign::SimulatedCampaign;
use crate::lab::simulator::{FlownManeuver, Instrument, Instruments, TrueDerivative};
use crate::model::LocalPosterior;
use crate::proof_of_match::aerodynamics::Aerodynamics;
use crate::proof_of_match::free_run::Simulation;
use crate::proof_of_match::maneuver_recording::ManeuverRecording;
use crate::proof_of_match::{
    Matched, OwnEstimates, ProofInputs, RecordedManeuver, Specification, fly_again,
};
use crate::tables::{MatchVerdictRow, ModelSource};

pub fn shipped() -> &'static SimulatedCampaign {
    static CAMPAIGN: OnceLock<SimulatedCampaign> = OnceLock::new();
    CAMPAIGN
        .get_or_init(|| SimulatedCampaign::load(Path::new("pipelines/harv/cards.yaml")).unwrap())
}

/// Tolerances as shipped, with one model.
pub fn specification() -> Specification {
    let text = include_str!("../../../pipelines/harv/match.yaml");
    let mut specification: Specification = serde_yaml::from_str(text).unwrap();
    specification.models = vec![ModelSource::Tunnel];
    specification
}

/// A maneuver flown with constant derivatives, with the time of its first input.
pub fn flown(class: &str, alpha_deg: f64) -> FlownManeuver {
    let card = shipped().card(class, alpha_deg).unwrap();
    let first = card
        .program
        .inputs
        .iter()
        .map(|i| i.start_s)
        .reduce(f64::min);
    let mut flown = shipped().simulator.fly(&card).unwrap();
    flown.maneuver.recognised.first_input_s = first;
    flown
}

/// Estimates at the truth: of some derivatives with independent errors of so many per cent, the others held.
pub fn estimated(flown: &FlownManeuver, names: &[&str], error_pct: f64) -> OwnEstimates {
    let error = |name: &&str| {
        let own = flown.truth.iter().find(|d| d.derivative == **name).unwrap();
        0.01 * error_pct * own.value
    };
    let errors: Vec<f64> = names.iter().map(error).collect();
    let variances = errors.iter().map(|error| error * error);
    let covariance = DMatrix::from_diagonal(&DVector::from_iterator(names.len(), variances));
    OwnEstimates {
        values: flown
            .truth
            .iter()
            .map(|d| (d.derivative.clone(), d.value))
            .collect(),
        estimated: names.iter().map(|&name| name.to_owned()).collect(),
        covariance: covariance.as_slice().to_vec(),
    }
}

/// Record of a maneuver with the campaign's noise alone.
pub fn noisy(flown: &FlownManeuver, seed: u64) -> Record {
    let instruments = shipped().cards.instruments.0.iter();
    let noise = instruments.map(|(signal, instrument)| {
        let noise = Instrument {
            noise: instrument.noise,
            quantum: instrument.quantum,
            ..Instrument::default()
        };
        (signal.clone(), noise)
    });
    flown.recorded(&Instruments(noise.collect()), seed)
}

/// Constant derivatives at a maneuver's condition as a database.
pub fn database(flown: &FlownManeuver, value: impl Fn(&TrueDerivative) -> f64) -> WindTunnel {
    let mut database = WindTunnel::new(wind_tunnel::Settings::default());
    for own in &flown.truth {
        let point = TunnelPoint::new(flown.maneuver.alpha_deg, value(own));
        database.insert(&own.derivative, point);
    }
    database
}

/// True derivatives of a maneuver, with one of them times a factor.
pub fn truth(flown: &FlownManeuver, wrong: &str, factor: f64) -> WindTunnel {
    database(flown, |own| {
        let factor = if own.derivative == wrong { factor } else { 1.0 };
        factor * own.value
    })
}

/// Proof of a record with one database.
pub fn proof(
    flown: &FlownManeuver,
    record: &Record,
    database: WindTunnel,
    specification: &Specification,
) -> Matched {
    let posterior = database.clone();
    proof_with(flown, record, (database, &posterior, None), specification)
}

/// Proof of a record with one database and a posterior.
pub fn proof_with(
    flown: &FlownManeuver,
    record: &Record,
    (database, posterior, local): (WindTunnel, &WindTunnel, Option<&LocalPosterior>),
    specification: &Specification,
) -> Matched {
    let models = [(ModelSource::Tunnel, database)];
    let basis = ProofInputs {
        aircraft: &shipped().config.aircraft,
        aero_model: &shipped().config.aero_model,
        models: &models,
        posterior,
        tunnel: &shipped().config.tunnel,
        specification,
    };
    let flown = RecordedManeuver {
        record,
        maneuver: &flown.maneuver,
        local,
        own: None,
    };
    fly_again(&basis, &flown)
}

/// Verdict of a record with one database, by the shipped tolerances.
pub fn verdict(flown: &FlownManeuver, record: &Record, database: WindTunnel) -> MatchVerdictRow {
    let mut matched = proof(flown, record, database, &specification());
    matched.verdicts.remove(0)
}

/// A maneuver as recorded.
pub fn recording(flown: &FlownManeuver, record: &Record, aircraft: &Aircraft) -> ManeuverRecording {
    let aero_model = &shipped().config.aero_model;
    ManeuverRecording::new(record, &flown.maneuver, (aircraft, aero_model), 1.0).unwrap()
}

/// A maneuver with the aircraft of a database.
pub fn simulation<'a>(
    flown: &FlownManeuver,
    aircraft: &'a Aircraft,
    recording: &'a ManeuverRecording,
    tunnel: &WindTunnel,
) -> Simulation<'a> {
    let condition = Condition {
        alpha_deg: flown.maneuver.alpha_deg,
        mach: flown.maneuver.mach,
        third: None,
    };
    let aero_model: &AeroModel = &shipped().config.aero_model;
    Simulation {
        aircraft,
        recording,
        aerodynamics: Aerodynamics::new((aircraft, aero_model), (tunnel, tunnel), &condition),
    }
}
