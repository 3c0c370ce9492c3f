//! World with a true aircraft, and an analyst whose tunnel is wrong: cards are flown, estimated and fused in it.

use std::collections::BTreeMap;
use std::path::Path;

use rayon::prelude::*;

use crate::aero::WindTunnel;
use crate::config::Config;
use crate::estimate::{Estimated, means};
use crate::flight_plan::candidate::{CandidateCard, candidates};
use crate::flight_plan::choice::Budget;
use crate::flight_plan::experience::CampaignHistory;
use crate::flight_plan::goals::Goal;
use crate::flight_plan::plan::{CampaignState, Plan, Rehearsal, plan};
use crate::flight_plan::rehearsal::{RehearsalBasis, derivatives, instruments};
use crate::lab::campaign::{FlightLimits, SimulatedCampaign, TestPoint, tunnel_rows};
use crate::lab::simulator::{Instruments, Simulator};
use crate::maneuver::Maneuver;
use crate::model::{ManeuverResults, Model, model};
use crate::numerics::statistics::random::derived_seed;
use crate::pipeline::estimate_maneuver;
use crate::proof_of_match::of_posterior;
use crate::tables::{NextGoalRow, PosteriorRow};

/// A simulated world: the aircraft as it is, and the analyst who has a wrong tunnel.
pub struct World {
    pub shipped: SimulatedCampaign,
    /// With the tunnel's tables in place of the truth.
    pub config: Config,
    instruments: Instruments,
    seed: u64,
}

/// A flown maneuver with its estimate.
pub type FlownCard = (Maneuver, Estimated);

impl World {
    /// World whose tunnel errs as the cards say: by 8 % of a derivative, and by 3 % further that
    /// change over α.
    pub fn new(seed: u64, points: &[(&str, &[f64])]) -> World {
        let mut world = World::with_shipped_candidates(seed);
        let point = |(class, alphas): &(&str, &[f64])| TestPoint {
            class: (*class).to_owned(),
            alpha_deg: alphas.to_vec(),
            scale: 1.0,
        };
        world.shipped.cards.next.candidates = points.iter().map(point).collect();
        world
    }

    /// World as of [`World::new`], with the candidates of the shipped cards.
    pub fn with_shipped_candidates(seed: u64) -> World {
        let mut shipped = SimulatedCampaign::load(Path::new("pipelines/harv/cards.yaml")).unwrap();
        shipped.cards.seed = seed;
        let mut config = shipped.config.clone();
        config.tunnel = wrong(&shipped);
        let instruments = instruments(&shipped.cards.instruments, &[]);
        World {
            shipped,
            config,
            instruments,
            seed,
        }
    }

    pub fn candidates(&self) -> Vec<CandidateCard> {
        candidates(&self.shipped.cards, &self.config)
    }

    /// Budget of a flight of some minutes.
    pub fn budget(&self, minutes: f64) -> Budget {
        Budget::of(&self.shipped.cards.next, minutes)
    }

    /// Flies cards of one flight with the truth, and estimates them.
    pub fn fly(&self, flight: &str, cards: &[CandidateCard]) -> Vec<FlownCard> {
        let fly = |(i, candidate): (usize, &CandidateCard)| {
            let flown = self.shipped.simulator.fly(&candidate.card).unwrap();
            let seed = derived_seed(self.seed, &format!("{flight} {i}"));
            let record = flown.recorded(&self.instruments, seed);
            let maneuver = Maneuver {
                maneuver_id: format!("{flight}_{i:03}"),
                flight_id: flight.to_owned(),
                ..flown.maneuver
            };
            let mut estimated = estimate_maneuver(&self.config, &record, &maneuver, &[]);
            estimated.means = means(&record, &maneuver, &self.config.aero_model);
            (maneuver, estimated)
        };
        cards.par_iter().enumerate().map(fly).collect()
    }

    pub fn model(&self, evidence: &[ManeuverResults]) -> Model {
        let Config {
            aero_model,
            tunnel,
            model: settings,
            ..
        } = &self.config;
        model(evidence, aero_model, tunnel, settings)
    }

    /// Plan of the next flight from what was flown.
    pub fn plan(&self, flown: &[FlownCard], budget: Budget) -> Plan {
        let evidence = evidence(flown);
        let model = self.model(&evidence);
        let config = &self.config;
        let posterior = of_posterior(&model.rows.posterior, &config.tunnel.clamped());
        let rows: Vec<_> = flown
            .iter()
            .flat_map(|(_, e)| e.estimates.clone())
            .collect();
        let settings = self.shipped.cards.aircraft.clone();
        let derivatives = derivatives(config, posterior, &rows);
        let simulator =
            Simulator::new(&config.aircraft, &config.aero_model, derivatives, settings).unwrap();
        let basis = RehearsalBasis {
            config,
            simulator: &simulator,
            instruments: &self.instruments,
            // The records of these worlds are not reconstructed.
            remaining_errors: &BTreeMap::new(),
            delays: &[],
            limits: &FlightLimits::default(),
        };
        let rehearse = |candidate: CandidateCard| {
            let result = basis.rehearse(&candidate);
            Rehearsal { candidate, result }
        };
        let rehearsals: Vec<Rehearsal> = self.candidates().into_par_iter().map(rehearse).collect();
        let maneuvers: Vec<Maneuver> = flown.iter().map(|(m, _)| m.clone()).collect();
        let fits: Vec<_> = flown.iter().map(|(_, e)| e.fit.clone()).collect();
        let covariances: Vec<_> = flown.iter().map(|(_, e)| e.covariance.clone()).collect();
        let state = CampaignState {
            model: &model,
            evidence: &evidence,
            history: CampaignHistory {
                maneuvers: &maneuvers,
                fits: &fits,
                covariances: &covariances,
                contributions: &model.rows.contributions,
            },
            aero_model: &config.aero_model,
            tunnel: &config.tunnel,
            settings: &config.model,
            qualities: None,
            matches: &BTreeMap::new(),
        };
        let goals: Vec<Goal> = model.quantities().map(Goal::of).collect();
        plan(&state, &rehearsals, &goals, budget)
    }

    /// Cards of a plan, each as often as it is flown.
    pub fn cards(&self, plan: &Plan) -> Vec<CandidateCard> {
        let all = self.candidates();
        let chosen = plan.cards.iter().filter(|row| row.place.is_some());
        let chosen = chosen.flat_map(|row| {
            let is_it = |c: &&CandidateCard| {
                c.card.class == row.class && (c.card.alpha_deg - row.alpha_deg).abs() < 1e-9
            };
            let candidate = all.iter().find(is_it).unwrap().clone();
            std::iter::repeat_n(candidate, row.times)
        });
        chosen.collect()
    }
}

/// Standard deviation of a goal by a model.
pub fn deviation(model: &Model, goal: &NextGoalRow) -> f64 {
    let mut rows = model.rows.posterior.iter();
    let is_there = |row: &&PosteriorRow| {
        row.derivative == goal.goal && (row.alpha_deg - goal.alpha_deg).abs() < 1e-6
    };
    rows.find(is_there).unwrap().standard_deviation
}

pub fn evidence(flown: &[FlownCard]) -> Vec<ManeuverResults<'_>> {
    let own = flown.iter().filter_map(|(maneuver, estimated)| {
        Some(ManeuverResults {
            maneuver,
            estimates: &estimated.estimates,
            combined: &estimated.combined,
            covariance: estimated.covariance.as_ref()?,
        })
    });
    own.collect()
}

/// The true tables with errors.
fn wrong(shipped: &SimulatedCampaign) -> WindTunnel {
    let mut tunnel = WindTunnel::new(shipped.config.tunnel.settings().clone());
    for row in tunnel_rows(shipped) {
        tunnel.insert(&row.derivative, row.point());
    }
    tunnel
}
