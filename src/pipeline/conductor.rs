//! The conductor: the stages of a campaign in order.

use std::collections::BTreeMap;
use std::time::Duration;

use super::campaign::Campaign;
use super::progress::Progress;
use super::records::flight_contents::{FlightContents, source_file};
use super::records::lift_check;
use super::stages::model_stage::{self, MODEL_VERSION};
use super::stages::qualities_stage::{self, QUALITIES_VERSION};
use super::stages::trend_stage::{self, COMPARE_VERSION, TREND_VERSION};
use super::steps::estimate_step::{self, EstimateStep};
use super::steps::group_steps::{self, JointStep, PredictStep};
use super::steps::ingest_step::{self, IngestStep};
use super::steps::match_step::{self, MatchStep};
use super::steps::segment_step::{self, SegmentStep};
use super::steps::step::Step;
use super::steps::step_runner::{AbsentArtefacts, StepRunner};
use super::steps::surfaces_step::{self, SurfacesStep};
use crate::compare::earlier_campaign::Earlier;
use crate::config::Config;
use crate::error::{Error, Result};
use crate::lineage::Stage;
use crate::store::archive::{self, FlightFiles};
use crate::store::{InputDigests, Store};

/// Name and version of each method whose artefacts the store keeps.
#[must_use]
pub fn step_versions() -> [(&'static str, u32); 7] {
    [
        version_of::<IngestStep>(),
        version_of::<SegmentStep>(),
        version_of::<SurfacesStep>(),
        version_of::<EstimateStep>(),
        version_of::<JointStep>(),
        version_of::<PredictStep>(),
        version_of::<MatchStep>(),
    ]
}

fn version_of<S: Step>() -> (&'static str, u32) {
    (S::KIND.name(), S::VERSION)
}

/// Versions of all methods, by name.
#[must_use]
pub fn method_versions() -> BTreeMap<String, u32> {
    let made_anew = [
        (Stage::Model.name(), MODEL_VERSION),
        (Stage::Trend.name(), TREND_VERSION),
        (Stage::Qualities.name(), QUALITIES_VERSION),
        (Stage::Compare.name(), COMPARE_VERSION),
    ];
    step_versions()
        .into_iter()
        .chain(made_anew)
        .map(|(name, version)| (name.to_owned(), version))
        .collect()
}

/// A campaign's configuration, archive and store, opened.
pub struct Conductor<'a> {
    pub runner: StepRunner<'a>,
    pub archive: Vec<FlightFiles>,
    pub flight_contents: FlightContents,
    /// Tables of earlier campaigns to compare with.
    pub earlier: Vec<Earlier>,
}

impl<'a> Conductor<'a> {
    /// Opens the campaign for one run alone, waiting up to `wait` for another run to leave the
    /// store.
    ///
    /// # Errors
    /// No archive, a store in use, a disk that fails.
    pub fn open(
        config: &'a Config,
        wait: Duration,
        progress: &'a dyn Progress,
    ) -> Result<Conductor<'a>> {
        let archive = archive::find(&config.archive)?;
        let store = Store::open(&config.store, wait)?.sharing(config.shared_store.as_deref())?;
        let contents = store.contents();
        let conductor = Conductor::new(
            config,
            store,
            contents,
            archive,
            AbsentArtefacts::Make,
            progress,
        )?;
        conductor.remember_contents()?;
        Ok(conductor)
    }

    /// Opens the campaign of these flights as one of several processes that add to the store and
    /// publish nothing.
    ///
    /// # Errors
    /// As [`Conductor::open`].
    pub fn open_shared(
        config: &'a Config,
        archive: Vec<FlightFiles>,
        absent: AbsentArtefacts,
        wait: Duration,
        progress: &'a dyn Progress,
    ) -> Result<Conductor<'a>> {
        let store =
            Store::open_shared(&config.store, wait)?.sharing(config.shared_store.as_deref())?;
        let contents = store.contents();
        Conductor::new(config, store, contents, archive, absent, progress)
    }

    /// Opens the campaign for reading only; nothing is made or changed.
    ///
    /// # Errors
    /// No archive.
    pub fn read_only(config: &'a Config, progress: &'a dyn Progress) -> Result<Conductor<'a>> {
        let store = Store::read_only(&config.store).sharing(config.shared_store.as_deref())?;
        let contents = store.contents();
        Conductor::read_only_with(config, store, contents, progress)
    }

    /// Opens the campaign for reading only, with every input file digested anew.
    ///
    /// # Errors
    /// No archive.
    pub fn read_only_digesting_all(
        config: &'a Config,
        progress: &'a dyn Progress,
    ) -> Result<Conductor<'a>> {
        let store = Store::read_only(&config.store).sharing(config.shared_store.as_deref())?;
        Conductor::read_only_with(config, store, InputDigests::empty(), progress)
    }

    fn read_only_with(
        config: &'a Config,
        store: Store,
        contents: InputDigests,
        progress: &'a dyn Progress,
    ) -> Result<Conductor<'a>> {
        let archive = archive::find(&config.archive)?;
        Conductor::new(
            config,
            store,
            contents,
            archive,
            AbsentArtefacts::Report,
            progress,
        )
    }

    fn new(
        config: &'a Config,
        store: Store,
        contents: InputDigests,
        archive: Vec<FlightFiles>,
        absent: AbsentArtefacts,
        progress: &'a dyn Progress,
    ) -> Result<Conductor<'a>> {
        let earlier = trend_stage::read_earlier(config)?;
        let mut flight_contents = FlightContents::gather(&archive, &contents, progress);
        if let Some(file) = &config.wind_tunnel {
            let tunnel = contents
                .of(file)
                .map_err(|why| Error::config(file, None, why))?;
            flight_contents.sources.push(source_file(file, &tunnel));
        }
        Ok(Conductor {
            runner: StepRunner::new(config, store, contents, absent, progress),
            archive,
            flight_contents,
            earlier,
        })
    }

    /// Saves the digests of input files for the next run.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Store`] naming the file.
    pub fn remember_contents(&self) -> Result<()> {
        self.runner.store.remember(&self.runner.contents)
    }

    /// Brings the campaign up to date as far as `until`, without the report.
    ///
    /// A conductor that is open for reading only stops before the first stage that needs a missing
    /// artefact.
    ///
    /// # Errors
    /// A fault that stops the run. A fault of one flight or maneuver is a problem.
    pub fn campaign(&self, until: Stage) -> Result<Campaign> {
        self.campaign_of(&self.archive, until)
    }

    /// Brings the campaign of some flights up to date as far as `until`.
    ///
    /// # Errors
    /// As [`Conductor::campaign`].
    fn campaign_of(&self, files: &[FlightFiles], until: Stage) -> Result<Campaign> {
        let (runner, config) = (&self.runner, self.runner.config);
        let mut campaign = Campaign::default();
        ingest_step::ingest(runner, files, &self.flight_contents, &mut campaign)?;
        lift_check::compare_lift(config, &mut campaign);
        if until >= Stage::Segment {
            segment_step::segment(runner, &mut campaign)?;
        }
        if until >= Stage::Estimate && !self.estimate(&mut campaign)? {
            return Ok(campaign);
        }
        if until >= Stage::Model {
            model_stage::fit_model(config, &mut campaign);
        }
        if until >= Stage::Trend {
            trend_stage::fit_trends(config, &mut campaign);
        }
        if until >= Stage::Qualities {
            qualities_stage::judge_qualities(config, &mut campaign);
        }
        if until >= Stage::Match {
            match_step::fly_again(runner, &mut campaign)?;
        }
        if until >= Stage::Compare {
            trend_stage::compare(config, &self.earlier, &mut campaign);
        }
        Ok(campaign)
    }

    /// Loads or makes the delays of the surfaces of a segmented campaign, by which estimates are
    /// corrected.
    ///
    /// # Errors
    /// As [`Conductor::campaign`].
    pub fn surfaces(&self, campaign: &mut Campaign) -> Result<()> {
        surfaces_step::surfaces(&self.runner, campaign)
    }

    /// Loads or makes the estimates of all maneuvers and groups of a segmented campaign; `false` if
    /// some are missing.
    ///
    /// # Errors
    /// As [`Conductor::campaign`].
    pub fn estimate(&self, campaign: &mut Campaign) -> Result<bool> {
        let runner = &self.runner;
        surfaces_step::surfaces(runner, campaign)?;
        let Some(estimates) = estimate_step::estimate(runner, campaign)? else {
            return Ok(false);
        };
        group_steps::estimate_jointly(runner, campaign, &estimates)?;
        group_steps::predict(runner, campaign, &estimates)?;
        estimate_step::collect_rows(campaign, estimates);
        Ok(campaign.state(Stage::Estimate).missing.is_empty())
    }
}
