//! Test cards for the simulator: YAML as written, checked against the pipeline whose aircraft flies
//! them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::cards::Cards;
use crate::config::{self, Config, Overrides, Source};
use crate::error::{Result, did_you_mean};
use crate::flight::signal;
use crate::lab::simulator::{Card, Program, Simulator, Tables};
use crate::store::files::TunnelRow;

/// A campaign to be simulated, checked.
#[derive(Clone, Debug)]
pub struct SimulatedCampaign {
    pub cards: Cards,
    /// The pipeline; its tunnel is the truth here.
    pub config: Config,
    /// The true derivatives as written.
    pub truth: Vec<TunnelRow>,
    pub simulator: Simulator,
}

impl SimulatedCampaign {
    /// Reads and checks a file of cards and its pipeline.
    ///
    /// # Errors
    /// [`crate::error::Error::Config`] with file, line and what was probably meant, for the first
    /// thing that is wrong.
    pub fn load(file: &Path) -> Result<SimulatedCampaign> {
        let source = Source::read(file.to_owned())?;
        let cards: Cards = source.parse()?;
        let folder = if cards.pipeline.is_dir() {
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
        .map_err(|what| source.error("aircraft", what))?;
        let simulation = SimulatedCampaign {
            cards,
            config,
            truth,
            simulator,
        };
        simulation.classes(&source)?;
        simulation.signals(&source)?;
        Ok(simulation)
    }

    /// The card of one maneuver of a class: its program at an angle of attack, in still air,
    /// derivatives frozen, for studies. `None` for a class without program.
    #[must_use]
    pub fn card(&self, class: &str, alpha_deg: f64) -> Option<Card> {
        let axis = self.config.class(class)?.axis;
        let first = self.cards.flights.values().next()?;
        Some(Card {
            flight_id: format!("{class}_{alpha_deg:02}"),
            class: class.to_owned(),
            axis,
            alpha_deg,
            altitude_ft: first.altitude_ft,
            heading_deg: first.heading_deg,
            mass_slug: first.mass_slug,
            start_s: 0.0,
            tables: Tables::Frozen,
            turbulence: None,
            seed: self.cards.seed,
            program: self.cards.programs.get(class)?.clone(),
        })
    }

    /// Every signal that the simulator gives.
    fn given(&self) -> BTreeSet<&str> {
        let settings = self.simulator.settings();
        let flags = self.cards.programs.values().flat_map(|p| p.flags.keys());
        let sticks = settings.laws.values().flat_map(|law| law.gearing.keys());
        let names = flags
            .chain(sticks)
            .chain(settings.surfaces.keys())
            .map(String::as_str);
        names
            .chain(signal::REQUIRED.iter().copied())
            .chain([signal::PSI, "time_s"])
            .collect()
    }

    fn classes(&self, source: &Source) -> Result<()> {
        for (class, program) in &self.cards.programs {
            if self.config.class(class).is_none() {
                let near = did_you_mean(class, self.config.classes.iter().map(|c| c.name.as_str()));
                return Err(source.error_under(
                    "programs",
                    class,
                    format!("unknown class `{class}`{near}"),
                ));
            }
            self.program(class, program, source)?;
        }
        for (flight, card) in &self.cards.flights {
            for point in &card.points {
                if !self.cards.programs.contains_key(&point.class) {
                    let near =
                        did_you_mean(&point.class, self.cards.programs.keys().map(String::as_str));
                    let what = format!("flight {flight}: no program `{}`{near}", point.class);
                    return Err(source.error_under("flights", &point.class, what));
                }
            }
        }
        Ok(())
    }

    fn program(&self, class: &str, program: &Program, source: &Source) -> Result<()> {
        let error = |name: &str, what: String| {
            Err(source.error_under("programs", name, format!("{class}: {what}")))
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
                "`maneuver_s` must lie within 0 and `duration_s`, its start first".into(),
            );
        }
        for input in &program.inputs {
            let known = law
                .gearing
                .keys()
                .chain(settings.surfaces.keys())
                .map(String::as_str);
            let mut known = known.chain([signal::THRUST]);
            if !known.clone().any(|name| name == input.signal) {
                let near = did_you_mean(&input.signal, known.by_ref());
                return error(
                    &input.signal,
                    format!("law `{}` moves no `{}`{near}", program.law, input.signal),
                );
            }
        }
        Ok(())
    }

    fn signals(&self, source: &Source) -> Result<()> {
        let given = self.given();
        for (column, channel) in &self.config.channels {
            if !given.contains(channel.signal.as_str()) {
                let what = format!(
                    "channel `{column}`: the simulator has no signal `{}`",
                    channel.signal
                );
                return Err(source.error("pipeline", what));
            }
        }
        for name in self.cards.instruments.0.keys() {
            if !given.contains(name.as_str()) {
                let near = did_you_mean(name, given.iter().copied());
                let what = format!("instruments: there is no signal `{name}`{near}");
                return Err(source.error_under("instruments", name, what));
            }
        }
        Ok(())
    }
}
