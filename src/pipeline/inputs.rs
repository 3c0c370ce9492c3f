//! What a run is given: the content of each flight's files, and the lineage that it makes with
//! configuration and code.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};

use super::{
    COMPARE_VERSION, ESTIMATE_VERSION, INGEST_VERSION, JOINT_VERSION, PREDICT_VERSION, Progress,
    Run, SEGMENT_VERSION, Shares, TREND_VERSION, comparison, problem,
};
use crate::compare::against::Earlier;
use crate::config::Config;
use crate::error::{Error, Problem, ProblemStage, Result};
use crate::lineage::{Code, Lineage, Stage};
use crate::report::SourceFile;
use crate::store::archive::FlightFiles;
use crate::store::{Contents, Digest, Fingerprint, Store};

/// The content of the archive.
#[derive(Clone, Debug, Default)]
pub(crate) struct Inputs {
    /// Fingerprint of each flight's content, or why there is none.
    contents: BTreeMap<String, std::result::Result<String, String>>,
    /// All files that could be read, the tunnel's table at the end.
    pub sources: Vec<SourceFile>,
    /// Files that are no flight of their own.
    pub problems: Vec<Problem>,
}

impl Inputs {
    /// Takes the fingerprint of every file. Of files with the same bytes the first counts, or its
    /// flight would count twice.
    fn gather(files: &[FlightFiles], known: &Contents, progress: &dyn Progress) -> Inputs {
        progress.begin("contents", files.len());
        let of_flight = |flight: &FlightFiles| {
            let content = content(flight, known);
            progress.advance(&flight.flight_id);
            content
        };
        let contents: Vec<_> = files.par_iter().map(of_flight).collect();
        progress.end();
        let mut inputs = Inputs::default();
        let contents = contents.into_iter().zip(files).map(|(digests, flight)| {
            inputs.sources.extend(
                flight
                    .files
                    .iter()
                    .zip(digests.iter().flatten())
                    .map(|(f, d)| source_file(f, d)),
            );
            digests.map(|digests| Fingerprint::of("flight", 1).with(&digests).finish())
        });
        let contents: Vec<std::result::Result<String, String>> = contents.collect();
        let mut first: BTreeMap<String, &str> = BTreeMap::new();
        for (flight, content) in files.iter().zip(contents) {
            let id = flight.flight_id.as_str();
            let content = content.and_then(|content| match first.get(&content) {
                Some(other) => Err(format!(
                    "the same bytes as flight `{other}`, and counted once: remove one of them"
                )),
                None => Ok(content),
            });
            let content = content.and_then(|content| inputs.among_rivals(flight, content, known));
            if let Ok(content) = &content {
                first.insert(content.clone(), id);
            }
            inputs.contents.insert(id.to_owned(), content);
        }
        inputs
    }

    /// A flight of which there are two records: where they are the same bytes one is left out, else
    /// nobody knows which is right.
    fn among_rivals(
        &mut self,
        flight: &FlightFiles,
        content: String,
        known: &Contents,
    ) -> std::result::Result<String, String> {
        let own: Vec<Digest> = flight
            .files
            .iter()
            .filter_map(|file| known.of(file).ok())
            .collect();
        for rival in &flight.rivals {
            if !known.of(rival).is_ok_and(|content| own.contains(&content)) {
                return Err(format!(
                    "two records would be flight `{}`: {} is the other; remove or rename one of them",
                    flight.flight_id,
                    rival.display()
                ));
            }
            let reason = format!(
                "a copy of a file of flight `{}`, left out",
                flight.flight_id
            );
            self.problems.push(problem(
                ProblemStage::Ingest,
                &flight.flight_id,
                &rival.display().to_string(),
                &reason,
            ));
        }
        Ok(content)
    }

    /// The fingerprint of a flight's content.
    ///
    /// # Errors
    /// Why there is none.
    pub fn content(&self, flight_id: &str) -> std::result::Result<&str, &str> {
        match self.contents.get(flight_id) {
            Some(Ok(content)) => Ok(content),
            Some(Err(reason)) => Err(reason),
            None => Err("it is not in the archive"),
        }
    }
}

/// The file of a flight that a problem names: the first, of several the folder.
pub(crate) fn place(flight: &FlightFiles) -> String {
    flight
        .files
        .first()
        .map_or_else(String::new, |file| file.display().to_string())
}

/// What a flight's files hold, in their order.
fn content(flight: &FlightFiles, known: &Contents) -> std::result::Result<Vec<Digest>, String> {
    // Reasons name no folder: they are among what tells nights apart.
    let of_file = |file: &PathBuf| {
        known
            .of(file)
            .map_err(|why| format!("the file {} {why}", name(file)))
    };
    flight.files.iter().map(of_file).collect()
}

fn name(file: &Path) -> String {
    file.file_name()
        .map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

fn source_file(file: &Path, digest: &Digest) -> SourceFile {
    SourceFile {
        name: name(file),
        bytes: digest.bytes,
        blake3: digest.blake3.clone(),
    }
}

impl<'a> Run<'a> {
    /// A run that believes what its store remembers of files' contents.
    pub(crate) fn of_store(
        config: &'a Config,
        store: Store,
        files: &[FlightFiles],
        progress: &'a dyn Progress,
    ) -> Result<Run<'a>> {
        let contents = store.contents();
        Run::new(config, store, contents, files, progress)
    }

    pub(crate) fn new(
        config: &'a Config,
        store: Store,
        contents: Contents,
        files: &[FlightFiles],
        progress: &'a dyn Progress,
    ) -> Result<Run<'a>> {
        let earlier = comparison::earlier(config)?;
        let mut inputs = Inputs::gather(files, &contents, progress);
        let tunnel = contents
            .of(&config.wind_tunnel)
            .map_err(|why| Error::config(&config.wind_tunnel, None, why))?;
        inputs
            .sources
            .push(source_file(&config.wind_tunnel, &tunnel));
        let lineage = lineage(config, &inputs, &earlier);
        let shares = Shares::of(
            config.ingest.memory_mb,
            config.channels.len(),
            rayon::current_num_threads(),
        );
        let (shelves, tonight) = (BTreeMap::new(), None);
        Ok(Run {
            config,
            store,
            progress,
            shares,
            contents,
            inputs,
            earlier,
            lineage,
            shelves,
            tonight,
        })
    }
}

fn value(part: &impl Serialize) -> Value {
    // What cannot be written as JSON would be a map with keys that are no strings; there is none.
    serde_json::to_value(part).unwrap_or_default()
}

fn parts<const N: usize>(parts: [(&str, Value); N]) -> BTreeMap<String, Value> {
    parts
        .into_iter()
        .map(|(name, value)| (name.to_owned(), value))
        .collect()
}

fn fingerprint(table: &impl Serialize) -> String {
    Fingerprint::of("table", 1).with(table).finish()
}

/// What decides this run's results.
fn lineage(config: &Config, inputs: &Inputs, earlier: &[Earlier]) -> Lineage {
    let methods = [
        ("ingest", INGEST_VERSION),
        ("segment", SEGMENT_VERSION),
        ("estimate", ESTIMATE_VERSION),
        ("joint", JOINT_VERSION),
        ("predict", PREDICT_VERSION),
        ("trend", TREND_VERSION),
        ("compare", COMPARE_VERSION),
    ];
    let flights = inputs.contents.iter().map(|(id, content)| {
        let content = content.clone().unwrap_or_else(|reason| refused(&reason));
        (id.clone(), content)
    });
    // Copies that were left out are in no table but `problems`, which a night must not pass over
    // either.
    let copies = inputs
        .problems
        .iter()
        .map(|p| (p.place.clone(), refused(&p.reason)));
    Lineage {
        code: Code {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            source: env!("HARVEST_SOURCE").to_owned(),
            methods: methods
                .map(|(name, version)| (name.to_owned(), version))
                .into(),
        },
        configuration: configuration(config),
        flights: flights.chain(copies).collect(),
        tables: [
            (
                Stage::Compare,
                earlier
                    .iter()
                    .map(|e| (format!("trends in {}", e.name), fingerprint(&e.trends)))
                    .collect(),
            ),
            (
                Stage::Segment,
                [(
                    "analyst's list of events".to_owned(),
                    fingerprint(&config.events),
                )]
                .into(),
            ),
            (
                Stage::Estimate,
                [("wind-tunnel table".to_owned(), fingerprint(&config.tunnel))].into(),
            ),
        ]
        .into(),
    }
}

/// What stands in place of a content's fingerprint where a flight was refused before it was read.
pub(crate) fn refused(reason: &str) -> String {
    format!("refused: {reason}")
}

fn configuration(config: &Config) -> BTreeMap<Stage, BTreeMap<String, Value>> {
    let recognition: Value = config
        .classes
        .iter()
        .map(|c| (c.name.clone(), json!({"axis": c.axis, "by": c.recognition})))
        .collect();
    let class = |c: &crate::maneuver::Class| {
        let settings = json!({"title": c.title, "statuses": c.statuses, "weights": c.weights, "overrides": c.overrides});
        (c.name.clone(), settings)
    };
    let classes: Value = config.classes.iter().map(class).collect();
    let estimate = &config.estimate;
    let template = config.template.as_ref().map(fingerprint);
    let (at, pages) = (
        config.report.histories_at_alpha_deg,
        config.report.maneuver_pages,
    );
    [
        (
            Stage::Ingest,
            parts([
                ("channels", value(&config.channels)),
                ("constants", value(&config.constants)),
                ("aircraft", value(&config.aircraft)),
                ("ingest", value(&config.ingest)),
            ]),
        ),
        (
            Stage::Segment,
            parts([
                ("recognition", recognition),
                ("segment", value(&config.segment)),
            ]),
        ),
        (
            Stage::Estimate,
            parts([
                ("classes", classes),
                ("model", value(&config.buildup)),
                ("estimate", value(estimate)),
                ("joint", value(&estimate.joint)),
                ("prediction", value(&estimate.prediction)),
            ]),
        ),
        (Stage::Trend, parts([("trend", value(&config.trend))])),
        (Stage::Compare, parts([("compare", value(&config.compare))])),
        (
            Stage::Report,
            parts([
                ("title", value(&config.title)),
                ("template", value(&template)),
                ("histories_at_alpha_deg", value(&at)),
                ("maneuver_pages", value(&pages)),
            ]),
        ),
    ]
    .into()
}
