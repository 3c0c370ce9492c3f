//! A run: the campaign brought up to date and published as a night.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::campaign_lineage::{campaign_lineage, rejection};
use super::changes;
use super::damaged_artefacts::damaged_artefacts;
use super::published_night::{ManeuverWindow, NightTables};
use super::published_tables::{publish_problems, publish_tables};
use crate::config::Config;
use crate::error::{Error, Problem, ProblemStage, Result};
use crate::lineage::{Changes, Lineage, Stage};
use crate::maneuver::Maneuver;
use crate::pipeline::{
    Campaign, Conductor, PAGE, PRINTED_PAGE, Progress, Report, make_report, problem,
};
use crate::store::{Fingerprint, Night, Nights, Summary, atomic};
use crate::tables::{PublishedTrend, PublishedVerdict};

/// Name of the published file with the changes since the night before, for machines to read.
const ALERT: &str = "alert.json";

/// End of a run.
#[derive(Clone, Debug)]
pub struct RunOutcome {
    /// Name of the current night.
    pub night: String,
    /// `true` if this run published it.
    pub is_new: bool,
    pub summary: Summary,
    /// Number of artefacts that this run made.
    pub made: usize,
    /// The report of a complete night.
    pub report: Option<PathBuf>,
}

impl RunOutcome {
    /// `true` if something that was recorded was rejected.
    #[must_use]
    pub fn has_rejections(&self) -> bool {
        has_rejections(&self.summary.problems)
    }
}

/// `true` if something that was recorded was rejected. A signal that a recording lacks, or a derivative
/// with too few maneuvers for a trend, is a problem, but no rejection.
#[must_use]
pub fn has_rejections(problems: &[Problem]) -> bool {
    problems.iter().any(|p| p.stage.is_rejection())
}

/// Brings the campaign up to date as far as `until` and publishes it as a night. Waits up to `wait`
/// for another run to leave store and reports.
///
/// # Errors
/// A fault that stops the run: no archive, a store in use, a disk that fails. A fault of one flight
/// or maneuver is a problem of the night's summary.
pub fn run(
    config: &Config,
    until: Stage,
    wait: Duration,
    progress: &dyn Progress,
) -> Result<RunOutcome> {
    let conductor = Conductor::open(config, wait, progress)?;
    let nights = Nights::open(&config.reports, wait)?;
    let run = NightRun {
        lineage: campaign_lineage(&conductor),
        printed_names: printed_names(config),
        conductor,
        nights,
        until,
    };
    if let Some(night) = run.valid_night() {
        run.conductor.runner.store.send_unsent()?;
        run.conductor.remember_contents()?;
        return Ok(run.outcome(night, false));
    }
    let outcome = run.publish();
    if outcome.is_err() {
        // The unfinished night's files may fill the disk that stopped the run.
        run.nights.remove_tonight();
    }
    outcome
}

/// Names that the report prints and that affect no number: archive, tunnel, files of the
/// configuration.
fn printed_names(config: &Config) -> BTreeMap<String, String> {
    let files = config.files.iter().map(|(name, text)| {
        let fingerprint = Fingerprint::of("text", 1).with(text).finish();
        (name.clone(), fingerprint)
    });
    let tunnel = config.tunnel_name();
    files
        .chain([
            ("archive".to_owned(), config.archive.clone()),
            ("wind tunnel".to_owned(), tunnel),
        ])
        .collect()
}

/// A run with its campaign and reports opened.
struct NightRun<'a> {
    conductor: Conductor<'a>,
    nights: Nights,
    until: Stage,
    lineage: Lineage,
    printed_names: BTreeMap<String, String>,
}

impl NightRun<'_> {
    fn config(&self) -> &Config {
        self.conductor.runner.config
    }

    /// The current night, if this run would make the same night. It has this run's lineage, reaches
    /// the same stage, and its files and artefacts are whole.
    fn valid_night(&self) -> Option<Night> {
        let night = self
            .nights
            .current()
            .filter(|night| self.has_same_lineage(night) && night.until >= self.until)?;
        let runner = &self.conductor.runner;
        let has_all = damaged_artefacts(&runner.store, &runner.contents, &night).is_empty();
        (has_all && self.nights.is_intact(&night)).then_some(night)
    }

    fn has_same_lineage(&self, night: &Night) -> bool {
        night.lineage == self.lineage && night.shown == self.printed_names
    }

    /// Runs the stages, writes tonight's files and publishes them.
    fn publish(&self) -> Result<RunOutcome> {
        let tonight = self.nights.tonight()?;
        let mut campaign = self.conductor.campaign(self.until)?;
        let (reported, published) = rayon::join(
            || self.place_report(&tonight, &campaign),
            || publish_tables(&campaign, self.until, &tonight, &self.lineage),
        );
        let (changes, problem) = reported?;
        published?;
        campaign.problems.extend(problem);
        publish_problems(&campaign, self.until, &tonight, &self.lineage)?;
        let store = &self.conductor.runner.store;
        store.send_unsent()?;
        store.register_reports(&self.config().reports)?;
        self.conductor.remember_contents()?;
        self.publish_files(&self.manifest(&campaign, &changes))
    }

    /// Places changes and report in the folder of a night that has them. A report that cannot be printed
    /// is a problem of the campaign.
    fn place_report(
        &self,
        tonight: &Path,
        campaign: &Campaign,
    ) -> Result<(Changes, Option<Problem>)> {
        if self.until < Stage::Report {
            return Ok((Changes::default(), None));
        }
        let changes = self.changes(campaign);
        let place = tonight.join(ALERT);
        let alert = serde_json::to_vec_pretty(&changes).map_err(|e| Error::store(&place, &e))?;
        atomic::place(&place, &alert)?;
        let Report { html, pdf } = make_report(&self.conductor, campaign, &changes)?;
        atomic::place(&tonight.join(PAGE), html.as_bytes())?;
        let problem = match pdf {
            Ok(bytes) => {
                atomic::place(&tonight.join(PRINTED_PAGE), &bytes)?;
                None
            }
            Err(why) => {
                let reason = format!("not made: {why}");
                Some(problem(ProblemStage::Report, "", PRINTED_PAGE, &reason))
            }
        };
        Ok((changes, problem))
    }

    /// Changes since the last complete night, or those that a first night shows by itself.
    fn changes(&self, campaign: &Campaign) -> Changes {
        let Some(before) = self.night_before() else {
            return changes::of_first_night(&campaign.instrument_trends);
        };
        let maneuvers: Vec<ManeuverWindow> = campaign.maneuvers.iter().map(window).collect();
        let trends: Vec<PublishedTrend> =
            campaign.trends.iter().map(PublishedTrend::from).collect();
        let comparison = campaign.comparison.iter();
        let verdicts: Vec<PublishedVerdict> = comparison.map(PublishedVerdict::from).collect();
        let now = NightTables {
            lineage: &self.lineage,
            maneuvers: &maneuvers,
            fits: &campaign.fits,
            estimates: &campaign.estimates,
            trends: &trends,
            verdicts: &verdicts,
            posterior: &campaign.model.rows.posterior,
            covariances: &campaign.model.rows.covariance,
            self_check: &campaign.model.rows.self_check,
            instrument_trends: &campaign.instrument_trends,
        };
        changes::since(&self.nights, &before, &now)
    }

    /// The complete night with which tonight's is compared. A night that is repaired keeps its
    /// predecessor.
    fn night_before(&self) -> Option<Night> {
        let last = self.nights.complete()?;
        let before = if self.has_same_lineage(&last) {
            self.nights.night(last.since.as_ref()?)?
        } else {
            last
        };
        self.nights.is_intact(&before).then_some(before)
    }

    /// Tonight's manifest, without its name and files.
    fn manifest(&self, campaign: &Campaign, changes: &Changes) -> Night {
        let mut lineage = self.lineage.clone();
        let unread = campaign.unread.iter();
        lineage
            .flights
            .extend(unread.map(|(flight, why)| (flight.clone(), rejection(why))));
        Night {
            until: self.until,
            since: changes.since.clone(),
            shown: self.printed_names.clone(),
            lineage,
            summary: Summary {
                flights: campaign.flights.len(),
                refused: campaign.rejected_flights(),
                maneuvers: campaign.maneuvers.len(),
                converged: campaign.converged(),
                problems: campaign.problems.clone(),
                alert: changes.alert,
            },
            artefacts: self.conductor.runner.store.required(),
            ..Night::default()
        }
    }

    /// Publishes tonight's files: as a new night, or in place of files that the current night of
    /// the same lineage has lost. A current night that reaches further stays.
    fn publish_files(&self, tonight: &Night) -> Result<RunOutcome> {
        let current = self.nights.current();
        match current.filter(|night| self.has_same_lineage(night)) {
            Some(night) if night.until > self.until => {
                self.nights.remove_tonight();
                Ok(self.outcome(night, false))
            }
            Some(night) if night.until == self.until => match self.nights.restore(&night)? {
                Some(restored) => Ok(self.outcome(restored, false)),
                None => self.publish_new(tonight),
            },
            _ => self.publish_new(tonight),
        }
    }

    fn publish_new(&self, tonight: &Night) -> Result<RunOutcome> {
        let keep = self.config().report.keep_nights;
        let published = self.nights.publish(tonight.clone(), keep)?;
        Ok(self.outcome(published, true))
    }

    fn outcome(&self, night: Night, is_new: bool) -> RunOutcome {
        let report = night
            .is_complete()
            .then(|| self.config().reports.join(PAGE));
        RunOutcome {
            night: night.name,
            is_new,
            summary: night.summary,
            made: self.conductor.runner.store.made(),
            report,
        }
    }
}

fn window(maneuver: &Maneuver) -> ManeuverWindow {
    ManeuverWindow {
        maneuver_id: maneuver.maneuver_id.clone(),
        flight_id: maneuver.flight_id.clone(),
        class: maneuver.class.clone(),
        start_s: maneuver.start_s,
        end_s: maneuver.end_s,
    }
}
