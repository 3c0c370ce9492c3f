//! A simulated campaign: test cards, checked against the pipeline of the aircraft that flies them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::cards::Cards;
use super::recording::Recorder;
use crate::config::{self, Config, Overrides, Source};
use crate::error::{Result, did_you_mean};
use crate::flight::signal;
use crate::lab::simulator::{
    AIR_TEMPERATURE, Card, FlightCondition, Program, STATIC_PRESSURE, Simulator,
};
use crate::store::files::{self, TunnelRow};

/// Test cards with their pipeline and simulator, checked.
#[derive(Clone, Debug)]
pub struct SimulatedCampaign {
    pub cards: Cards,
    /// Configuration of the pipeline; its wind tunnel holds the true derivatives.
    pub config: Config,
    /// True derivatives as written.
    pub truth: Vec<TunnelRow>,
    pub simulator: Simulator,
    pub recorder: Recorder,
}

impl SimulatedCampaign {
    /// Reads and checks a file of cards and its pipeline.
    ///
    /// # Errors
    /// [`crate::error::Error`] with file, line and the probable meaning of the first mistake.
    pub fn load(file: &Path) -> Result<SimulatedCampaign> {
        let source = Source::read(file.to_owned())?;
        let cards: Cards = source.parse()?;
        let folder = if files::is_folder(&cards.pipeline) {
            cards.pipeline.clone()
        } else {
            PathBuf::from("pipelines").join(&cards.pipeline)
        };
        let overrides = Overrides {
            wind_tunnel: Some(cards.truth.clone()),
            ..Overrides::default()
        };
        let config = Config::load(&folder, overrides)?;
        let truth = config::tunnel_rows(&cards.truth, &config.buildup, config.tunnel.settings())?;
        let truth = truth.into_iter().map(|(_, row)| row).collect();
        let simulator = Simulator::new(
            &config.aircraft,
            &config.buildup,
            config.tunnel.clone(),
            cards.aircraft.clone(),
        )
        .map_err(|message| source.error("aircraft", message))?;
        let names = signals(&cards, &simulator);
        check_channels(&config, &names, &source)?;
        check_instruments(&cards, &names, &source)?;
        let rate_hz = simulator.settings().rate_hz;
        let names: Vec<&str> = names.into_iter().collect();
        let recorder = Recorder::new(&cards.recorder, &config.channels, (&names, rate_hz))
            .map_err(|(name, what)| source.error_under("recorder", &name, what))?;
        let campaign = SimulatedCampaign {
            cards,
            config,
            truth,
            simulator,
            recorder,
        };
        campaign.check_programs(&source)?;
        campaign.check_flights(&source)?;
        campaign.check_conditions(&source)?;
        Ok(campaign)
    }

    /// Card of one maneuver as the estimator assumes it, for studies: in still air, with frozen
    /// derivatives. `None` for a class without program.
    #[must_use]
    pub fn card(&self, class: &str, alpha_deg: f64) -> Option<Card> {
        let axis = self.config.class(class)?.axis;
        let conditions = self.cards.flights.values().next()?;
        Some(Card {
            flight_id: format!("{class}_{alpha_deg:02}"),
            class: class.to_owned(),
            axis,
            alpha_deg,
            altitude_ft: conditions.altitude_ft,
            heading_deg: conditions.heading_deg,
            mass_slug: conditions.mass_slug,
            start_s: 0.0,
            condition: FlightCondition::default(),
            seed: self.cards.seed,
            program: self.cards.programs.get(class)?.clone(),
        })
    }

    fn check_programs(&self, source: &Source) -> Result<()> {
        for (class, program) in &self.cards.programs {
            if self.config.class(class).is_none() {
                let near = did_you_mean(class, self.config.classes.iter().map(|c| c.name.as_str()));
                return Err(source.error_under(
                    "programs",
                    class,
                    format!("unknown class `{class}`{near}"),
                ));
            }
            self.check_program(class, program, source)?;
        }
        Ok(())
    }

    fn check_program(&self, class: &str, program: &Program, source: &Source) -> Result<()> {
        let error = |name: &str, message: String| {
            Err(source.error_under("programs", name, format!("{class}: {message}")))
        };
        let settings = self.simulator.settings();
        let Some(law) = settings.laws.get(&program.law) else {
            let near = did_you_mean(&program.law, settings.laws.keys().map(String::as_str));
            return error(&program.law, format!("no law `{}`{near}", program.law));
        };
        let (from_s, to_s) = program.maneuver_s;
        if !(0.0 <= from_s && from_s < to_s && to_s <= program.duration_s) {
            return error(
                class,
                "`maneuver_s` must be a start and a later end between 0 and `duration_s`".into(),
            );
        }
        let movable: Vec<&str> = law
            .gearing
            .keys()
            .chain(settings.surfaces.keys())
            .map(String::as_str)
            .chain([signal::THRUST])
            .collect();
        for input in &program.inputs {
            if !movable.contains(&input.signal.as_str()) {
                let near = did_you_mean(&input.signal, movable.iter().copied());
                return error(
                    &input.signal,
                    format!("law `{}` moves no `{}`{near}", program.law, input.signal),
                );
            }
        }
        Ok(())
    }

    fn check_flights(&self, source: &Source) -> Result<()> {
        for (flight, card) in &self.cards.flights {
            for point in &card.points {
                if !self.cards.programs.contains_key(&point.class) {
                    let near =
                        did_you_mean(&point.class, self.cards.programs.keys().map(String::as_str));
                    let message = format!("flight {flight}: no program `{}`{near}", point.class);
                    return Err(source.error_under("flights", &point.class, message));
                }
            }
        }
        Ok(())
    }

    /// Checks air and delays of the flights, then those of the study.
    fn check_conditions(&self, source: &Source) -> Result<()> {
        for (flight, card) in &self.cards.flights {
            card.condition(self.cards.derivatives)
                .check()
                .map_err(|what| source.error_under("flights", flight, what))?;
        }
        for condition in &self.cards.study.conditions {
            condition
                .flown()
                .check()
                .map_err(|what| source.error_under("study", &condition.name, what))?;
        }
        Ok(())
    }
}

/// Signals of the simulator.
fn signals<'a>(cards: &'a Cards, simulator: &'a Simulator) -> BTreeSet<&'a str> {
    let settings = simulator.settings();
    let flags = cards.programs.values().flat_map(|p| p.flags.keys());
    let sticks = settings.laws.values().flat_map(|law| law.gearing.keys());
    let names = flags
        .chain(sticks)
        .chain(settings.surfaces.keys())
        .map(String::as_str);
    names
        .chain(signal::REQUIRED.iter().copied())
        .chain([signal::PSI, signal::TIME, STATIC_PRESSURE, AIR_TEMPERATURE])
        .collect()
}

fn check_channels(config: &Config, signals: &BTreeSet<&str>, source: &Source) -> Result<()> {
    let recorded = config.channels.iter();
    for (column, channel) in recorded.filter(|(_, channel)| channel.formula.is_none()) {
        if !signals.contains(channel.signal.as_str()) {
            let message = format!(
                "channel `{column}`: the simulator has no signal `{}`",
                channel.signal
            );
            return Err(source.error("pipeline", message));
        }
    }
    Ok(())
}

fn check_instruments(cards: &Cards, signals: &BTreeSet<&str>, source: &Source) -> Result<()> {
    for name in cards.instruments.0.keys() {
        if !signals.contains(name.as_str()) {
            let near = did_you_mean(name, signals.iter().copied());
            let message = format!("instruments: there is no signal `{name}`{near}");
            return Err(source.error_under("instruments", name, message));
        }
    }
    Ok(())
}
