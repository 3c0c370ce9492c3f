//! Lineage of a campaign: its code, configuration and input.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::{Value, json};

use crate::config::Config;
use crate::lineage::{Code, Lineage, Stage};
use crate::maneuver::Class;
use crate::pipeline::{Conductor, method_versions};
use crate::store::Fingerprint;

/// Lineage of the results that this conductor loads or makes.
#[must_use]
pub fn campaign_lineage(conductor: &Conductor) -> Lineage {
    let config = conductor.runner.config;
    Lineage {
        code: Code {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            source: env!("HARVEST_SOURCE").to_owned(),
            methods: method_versions(),
        },
        configuration: configuration(config),
        flights: flights(conductor),
        tables: tables(conductor),
    }
}

/// Entry of a rejected flight, in place of the fingerprint of its content.
#[must_use]
pub fn rejection(reason: &str) -> String {
    format!("refused: {reason}")
}

/// Fingerprints of the flights' contents. Copies that were left out have an entry each: they are in
/// the table `problems`.
fn flights(conductor: &Conductor) -> BTreeMap<String, String> {
    let contents = &conductor.flight_contents;
    let flights = contents.fingerprints.iter().map(|(id, fingerprint)| {
        let entry = fingerprint
            .clone()
            .unwrap_or_else(|reason| rejection(&reason));
        (id.clone(), entry)
    });
    let copies = contents.problems.iter();
    flights
        .chain(copies.map(|p| (p.place.clone(), rejection(&p.reason))))
        .collect()
}

/// Fingerprints of the other input files, by the first stage that reads them.
fn tables(conductor: &Conductor) -> BTreeMap<Stage, BTreeMap<String, String>> {
    let config = conductor.runner.config;
    let earlier = conductor.earlier.iter();
    let earlier = earlier.map(|e| (format!("trends in {}", e.name), fingerprint(&e.trends)));
    let events = (
        "analyst's list of events".to_owned(),
        fingerprint(&config.events),
    );
    let tunnel = ("wind-tunnel table".to_owned(), fingerprint(&config.tunnel));
    let database = (
        "database of the proof of match".to_owned(),
        fingerprint(&config.match_database),
    );
    [
        (Stage::Segment, [events].into()),
        (Stage::Estimate, [tunnel].into()),
        (Stage::Match, [database].into()),
        (Stage::Compare, earlier.collect()),
    ]
    .into()
}

/// Configuration as it was checked, by the first stage that reads it.
fn configuration(config: &Config) -> BTreeMap<Stage, BTreeMap<String, Value>> {
    let classes = config.classes.iter();
    let recognition: Value = classes
        .clone()
        .map(|c| (c.name.clone(), json!({"axis": c.axis, "by": c.recognition})))
        .collect();
    let classes: Value = classes.map(|c| (c.name.clone(), class(c))).collect();
    let estimate = &config.estimate;
    let report = &config.report;
    let template = config.template.as_ref().map(fingerprint);
    [
        (
            Stage::Ingest,
            named([
                ("channels", value(&config.channels)),
                ("constants", value(&config.constants)),
                ("aircraft", value(&config.aircraft)),
                ("ingest", value(&config.ingest)),
            ]),
        ),
        (
            Stage::Segment,
            named([
                ("recognition", recognition),
                ("segment", value(&config.segment)),
            ]),
        ),
        (
            Stage::Estimate,
            named([
                ("classes", classes),
                ("model", value(&config.aero_model)),
                ("estimate", value(estimate)),
                ("surfaces", value(&estimate.surfaces)),
                ("joint", value(&estimate.joint)),
                ("prediction", value(&estimate.prediction)),
            ]),
        ),
        (
            Stage::Model,
            named([
                ("model", value(&config.model)),
                ("held_values", value(&estimate.held_values)),
            ]),
        ),
        (Stage::Trend, named([("trend", value(&config.trend))])),
        (
            Stage::Qualities,
            named([("qualities", value(&config.qualities))]),
        ),
        (
            Stage::Match,
            named([("match", value(&config.proof_of_match))]),
        ),
        (Stage::Compare, named([("compare", value(&config.compare))])),
        (
            Stage::Report,
            named([
                ("title", value(&config.title)),
                ("template", value(&template)),
                (
                    "histories_at_alpha_deg",
                    value(&report.histories_at_alpha_deg),
                ),
                ("maneuver_pages", value(&report.maneuver_pages)),
            ]),
        ),
    ]
    .into()
}

/// Settings of a class that its maneuvers' estimates read.
fn class(class: &Class) -> Value {
    json!({
        "title": class.title,
        "statuses": class.statuses,
        "weights": class.weights,
        "overrides": class.overrides,
    })
}

fn named<const N: usize>(parts: [(&str, Value); N]) -> BTreeMap<String, Value> {
    parts
        .into_iter()
        .map(|(name, value)| (name.to_owned(), value))
        .collect()
}

/// Value as JSON. Only a map whose keys are no strings would fail; the configuration has none.
fn value(part: &impl Serialize) -> Value {
    serde_json::to_value(part).unwrap_or_default()
}

fn fingerprint(table: &impl Serialize) -> String {
    Fingerprint::of("table", 1).with(table).finish()
}
