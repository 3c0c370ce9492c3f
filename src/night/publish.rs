//! A night: what a run made, published together with what it was made from; or, when nothing is
//! new, the night that holds.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::changes::{self, Window};
use crate::config::Config;
use crate::error::{Error, Problem, ProblemStage, Result};
use crate::lineage::{Changes, Lineage, Stage};
use crate::maneuver::Maneuver;
use crate::pipeline::{Campaign, REPORT, Run, inputs};
use crate::store::nights::{Night, Nights, Summary};
use crate::store::table::{self, Shelf};
use crate::store::{Fingerprint, files};
use crate::tables::{EstimateRow, FitRow, PublishedTrend, PublishedVerdict};

/// What changed since the night before, for machines: among the published files of a complete
/// night.
pub const ALERT: &str = "alert.json";

/// Keys of the Parquet files' metadata.
const STAGE: &str = "harvest.stage";
const CODE: &str = "harvest.code";
const CONFIGURATION: &str = "harvest.configuration";
const FLIGHTS: &str = "harvest.flights";
const TABLES: &str = "harvest.tables";

/// How a run ended.
#[derive(Clone, Debug)]
pub struct Done {
    /// The night that holds now.
    pub night: String,
    /// Whether this run published it.
    pub is_new: bool,
    pub summary: Summary,
    /// How many artefacts of the store this run made.
    pub made: usize,
    /// The report, where there is one.
    pub report: Option<PathBuf>,
}

impl Done {
    /// Whether something of what was recorded was rejected. A derivative with too few maneuvers for
    /// a trend is among the problems, but nothing of it was rejected.
    #[must_use]
    pub fn rejected(&self) -> bool {
        rejected(&self.summary.problems)
    }
}

/// Whether something of what was recorded is among the problems.
#[must_use]
pub fn rejected(problems: &[Problem]) -> bool {
    problems.iter().any(|p| p.stage != ProblemStage::Trend)
}

/// The tables of a published night that are compared with tonight's.
#[derive(Clone, Debug)]
pub struct Published {
    pub lineage: Lineage,
    maneuvers: Vec<Window>,
    fits: Vec<FitRow>,
    estimates: Vec<EstimateRow>,
    trends: Vec<PublishedTrend>,
    verdicts: Vec<PublishedVerdict>,
}

impl Published {
    /// Reads a complete night.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Config`] naming the table that cannot be read.
    pub fn read(nights: &Nights, night: &Night) -> Result<Published> {
        let folder = nights.folder(&night.name);
        let mut estimates: Vec<EstimateRow> = files::published(&folder, "estimates")?;
        estimates.retain(|e| !e.is_joint());
        Ok(Published {
            lineage: night.lineage.clone(),
            maneuvers: files::published(&folder, "maneuvers")?,
            fits: files::published(&folder, "fits")?,
            estimates,
            trends: files::published(&folder, "trends")?,
            verdicts: files::published(&folder, "comparison")?,
        })
    }

    #[must_use]
    pub fn tables(&self) -> changes::Tables<'_> {
        changes::Tables {
            lineage: &self.lineage,
            maneuvers: &self.maneuvers,
            fits: &self.fits,
            estimates: &self.estimates,
            trends: &self.trends,
            verdicts: &self.verdicts,
        }
    }
}

/// The pairs that a Parquet file of a stage carries.
fn provenance(lineage: &Lineage, stage: Stage) -> Vec<(String, String)> {
    fn text(part: &impl serde::Serialize) -> String {
        serde_json::to_string(part).unwrap_or_default()
    }
    let part = lineage.until(stage);
    let pairs = [
        (STAGE, stage.name().to_owned()),
        (CODE, text(&part.code)),
        (CONFIGURATION, text(&part.configuration)),
        (FLIGHTS, text(&part.flights)),
        (TABLES, text(&part.tables)),
    ];
    pairs.map(|(key, value)| (key.to_owned(), value)).to_vec()
}

/// The lineage that a published Parquet file states, and its stage.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file, and what is not there.
pub fn stated(path: &Path) -> Result<(Stage, Lineage)> {
    fn part<T: serde::de::DeserializeOwned>(
        path: &Path,
        pairs: &BTreeMap<String, String>,
        key: &str,
    ) -> Result<T> {
        let text = pairs
            .get(key)
            .ok_or_else(|| Error::damaged(path, &format!("its metadata has no `{key}`")))?;
        serde_json::from_str(text)
            .map_err(|e| Error::damaged(path, &format!("its metadata `{key}`: {e}")))
    }
    let pairs = table::provenance(path)?;
    let stage = pairs.get(STAGE).map(String::as_str).unwrap_or_default();
    let stage = Stage::from_word(stage);
    let stage =
        stage.ok_or_else(|| Error::damaged(path, &format!("its metadata has no `{STAGE}`")))?;
    let lineage = Lineage {
        code: part(path, &pairs, CODE)?,
        configuration: part(path, &pairs, CONFIGURATION)?,
        flights: part(path, &pairs, FLIGHTS)?,
        tables: part(path, &pairs, TABLES)?,
    };
    Ok((stage, lineage))
}

/// What the report prints beside numbers.
fn shown(config: &Config) -> BTreeMap<String, String> {
    let named = [
        ("archive", config.archive.clone()),
        ("wind tunnel", config.wind_tunnel.display().to_string()),
    ];
    let named = named.map(|(what, name)| (what.to_owned(), name));
    let text = |(name, text): &(String, String)| {
        (name.clone(), Fingerprint::of("text", 1).with(text).finish())
    };
    config.files.iter().map(text).chain(named).collect()
}

fn window(maneuver: &Maneuver) -> Window {
    Window {
        maneuver_id: maneuver.maneuver_id.clone(),
        flight_id: maneuver.flight_id.clone(),
        class: maneuver.class.clone(),
        start_s: maneuver.start_s,
        end_s: maneuver.end_s,
    }
}

impl Run<'_> {
    /// A folder for tables that say what decides this stage.
    pub(crate) fn shelf_in(&self, folder: &Path, stage: Stage) -> Shelf {
        Shelf::of(folder).with(provenance(&self.lineage, stage))
    }

    /// Makes tonight's folder the place of all tables.
    pub(crate) fn publish_into(&mut self, tonight: PathBuf) {
        let shelf = |stage: Stage| (stage, self.shelf_in(&tonight, stage));
        self.shelves = Stage::ALL.into_iter().map(shelf).collect();
        self.tonight = Some(tonight);
    }

    /// The night that holds, if it was made of what this run would be made of, reaches as far, and
    /// is whole with all its artefacts: then there is nothing to do.
    pub(crate) fn is_published(&self, nights: &Nights, until: Stage) -> Option<Done> {
        let night = nights
            .current()
            .filter(|night| self.is_of_the_same(night) && night.until >= until)?;
        let there = self.store.artefacts();
        let is_there = |(name, size): (&String, &u64)| there.get(name) == Some(size);
        (night.artefacts.iter().all(is_there) && nights.is_whole(&night))
            .then(|| self.done(night, false))
    }

    /// Whether a night was made of what this run is made of.
    fn is_of_the_same(&self, night: &Night) -> bool {
        night.lineage == self.lineage && night.shown == shown(self.config)
    }

    fn done(&self, night: Night, is_new: bool) -> Done {
        let report = night
            .is_complete()
            .then(|| self.config.reports.join(REPORT));
        Done {
            night: night.name,
            is_new,
            summary: night.summary,
            made: self.store.made(),
            report,
        }
    }

    /// The complete night that tonight's is held against.
    fn before(&self, nights: &Nights) -> Option<Night> {
        let last = nights.complete()?;
        // A night that is repaired keeps the one before it.
        let before = if self.is_of_the_same(&last) {
            nights.night(last.since.as_ref()?)?
        } else {
            last
        };
        nights.is_whole(&before).then_some(before)
    }

    /// What changed since the last complete night; also placed for machines to read.
    pub(crate) fn changes(&self, nights: &Nights, campaign: &Campaign) -> Result<Changes> {
        // Tables that an older program wrote may lack what this one reads: then there is nothing to
        // compare with.
        let before = self
            .before(nights)
            .and_then(|night| Some((Published::read(nights, &night).ok()?, night)));
        let changes = match before {
            None => Changes::default(),
            Some((before, night)) => {
                let windows: Vec<Window> = campaign.maneuvers.iter().map(window).collect();
                let trends: Vec<PublishedTrend> =
                    campaign.trends.iter().map(PublishedTrend::from).collect();
                let verdicts: Vec<PublishedVerdict> = campaign
                    .comparison
                    .iter()
                    .map(PublishedVerdict::from)
                    .collect();
                let now = changes::Tables {
                    lineage: &self.lineage,
                    maneuvers: &windows,
                    fits: &campaign.fits,
                    estimates: &campaign.estimates,
                    trends: &trends,
                    verdicts: &verdicts,
                };
                changes::between(&night.name, &before.tables(), &now)
            }
        };
        self.place_tonight(
            ALERT,
            &serde_json::to_vec_pretty(&changes).unwrap_or_default(),
        )?;
        Ok(changes)
    }

    /// Publishes what lies in tonight's folder.
    pub(crate) fn publish(
        &self,
        nights: &Nights,
        campaign: &Campaign,
        until: Stage,
    ) -> Result<Done> {
        let mut lineage = self.lineage.clone();
        let unread = campaign
            .unread
            .iter()
            .map(|(flight, why)| (flight.clone(), inputs::refused(why)));
        lineage.flights.extend(unread);
        let summary = Summary {
            flights: campaign.flights.len(),
            refused: campaign.refused(),
            maneuvers: campaign.maneuvers.len(),
            converged: campaign.converged(),
            problems: campaign.problems.clone(),
            alert: campaign.overnight.alert,
        };
        let tonight = Night {
            until,
            since: campaign.overnight.since.clone(),
            shown: shown(self.config),
            lineage,
            summary,
            artefacts: self.store.needed(),
            ..Night::default()
        };
        self.store.serves(&self.config.reports)?;
        self.store.remember(&self.contents)?;
        let done = match nights.current().filter(|night| self.is_of_the_same(night)) {
            Some(night) if night.until > until => {
                nights.forget_tonight();
                self.done(night, false)
            }
            Some(night) if night.until == until => {
                self.done(nights.repair(&night, tonight)?, false)
            }
            _ => self.done(
                nights.publish(tonight, self.config.report.keep_nights)?,
                true,
            ),
        };
        Ok(done)
    }
}
