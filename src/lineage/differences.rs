//! The differences between two lineages, in words.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::parts::{Code, Lineage, method_stage};
use super::stage::Stage;

/// What kind of thing made a difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    Flight,
    Configuration,
    Code,
}

/// One difference between two lineages.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Cause {
    /// The first stage that it reaches.
    pub stage: Stage,
    pub origin: Origin,
    /// The flight, the path in the configuration, or the method.
    pub subject: String,
    /// In words: `new flight flight_007`.
    pub words: String,
}

/// No more differences of one part than this are spelled out.
const SPELLED_OUT: usize = 5;

impl Lineage {
    /// What became different since `before`, in the order of the stages; empty when nothing did.
    #[must_use]
    pub fn differences(&self, before: &Lineage) -> Vec<Cause> {
        let mut causes = flights(&before.flights, &self.flights);
        let empty = BTreeMap::new();
        for stage in Stage::ALL {
            let [a, b] = [before, self].map(|l| l.tables.get(&stage).unwrap_or(&empty));
            for name in union(a, b)
                .into_iter()
                .filter(|name| a.get(*name) != b.get(*name))
            {
                let words = format!("the {name} changed");
                causes.push(Cause {
                    stage,
                    origin: Origin::Configuration,
                    subject: name.clone(),
                    words,
                });
            }
        }
        let empty = BTreeMap::new();
        for stage in Stage::ALL {
            let [a, b] = [before, self].map(|l| l.configuration.get(&stage).unwrap_or(&empty));
            for name in union(a, b) {
                let mut paths = Vec::new();
                compare(name, a.get(name), b.get(name), &mut paths);
                let more = paths.len().saturating_sub(SPELLED_OUT);
                paths.truncate(SPELLED_OUT);
                if more > 0 {
                    paths.push((
                        name.clone(),
                        format!("{more} more settings of `{name}` changed"),
                    ));
                }
                let cause = |(subject, words)| Cause {
                    stage,
                    origin: Origin::Configuration,
                    subject,
                    words,
                };
                causes.extend(paths.into_iter().map(cause));
            }
        }
        causes.extend(code(&before.code, &self.code));
        causes.sort();
        causes
    }
}

fn union<'a, V>(a: &'a BTreeMap<String, V>, b: &'a BTreeMap<String, V>) -> Vec<&'a String> {
    let mut names: Vec<&String> = a.keys().chain(b.keys()).collect();
    names.sort();
    names.dedup();
    names
}

fn flights(before: &BTreeMap<String, String>, now: &BTreeMap<String, String>) -> Vec<Cause> {
    let cause = |flight: &String| {
        let words = match (before.get(flight), now.get(flight)) {
            (None, _) => format!("new flight {flight}"),
            (_, None) => format!("flight {flight} is gone from the archive"),
            _ => format!("the file of flight {flight} changed"),
        };
        Cause {
            stage: Stage::Ingest,
            origin: Origin::Flight,
            subject: flight.clone(),
            words,
        }
    };
    union(before, now)
        .into_iter()
        .filter(|f| before.get(*f) != now.get(*f))
        .map(cause)
        .collect()
}

fn code(before: &Code, now: &Code) -> Vec<Cause> {
    let mut causes = Vec::new();
    for method in union(&before.methods, &now.methods) {
        let [a, b] = [before, now].map(|c| c.methods.get(method).copied().unwrap_or_default());
        if a != b {
            let (stage, words) = (
                method_stage(method),
                format!("method `{method}`: version {a} became {b}"),
            );
            causes.push(Cause {
                stage,
                origin: Origin::Code,
                subject: method.clone(),
                words,
            });
        }
    }
    if (&before.version, &before.source) != (&now.version, &now.source) {
        let name = |c: &Code| format!("{} ({})", c.version, c.source);
        let words = format!("the program changed from {} to {}", name(before), name(now));
        // Stages with artefacts state their methods' versions; what is made anew each time may
        // differ by any change.
        causes.push(Cause {
            stage: Stage::Trend,
            origin: Origin::Code,
            subject: "harvest".to_owned(),
            words,
        });
    }
    causes
}

/// Collects the paths at which two values differ, with what they were and are.
fn compare(
    path: &str,
    before: Option<&Value>,
    now: Option<&Value>,
    found: &mut Vec<(String, String)>,
) {
    match (before, now) {
        (a, b) if a == b => {}
        (Some(Value::Object(a)), Some(Value::Object(b))) => {
            let mut keys: Vec<&String> = a.keys().chain(b.keys()).collect();
            keys.sort();
            keys.dedup();
            for key in keys {
                compare(&format!("{path}.{key}"), a.get(key), b.get(key), found);
            }
        }
        (a, b) => {
            let (a, b) = (short(a), short(b));
            found.push((
                path.to_owned(),
                format!("configuration {path}: {a} became {b}"),
            ));
        }
    }
}

/// A value in a few words.
fn short(value: Option<&Value>) -> String {
    const LONGEST: usize = 40;
    match value {
        None => "nothing".to_owned(),
        Some(value) => {
            let text = value.to_string();
            if text.chars().count() <= LONGEST {
                return text;
            }
            format!("{}…", text.chars().take(LONGEST).collect::<String>())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lineage() -> Lineage {
        let settings = serde_json::json!({"weights": "table", "steps": {"de_deg": 2.5}});
        let methods = [
            ("ingest".to_owned(), 1),
            ("estimate".to_owned(), 5),
            ("joint".to_owned(), 2),
        ]
        .into();
        Lineage {
            code: Code {
                version: "0.1.0".into(),
                source: "aa".into(),
                methods,
            },
            configuration: [(Stage::Segment, [("segment".to_owned(), settings)].into())].into(),
            flights: [("f1".to_owned(), "01".to_owned())].into(),
            tables: [(
                Stage::Estimate,
                [("wind-tunnel table".to_owned(), "03".to_owned())].into(),
            )]
            .into(),
        }
    }

    fn words(now: &Lineage) -> Vec<String> {
        now.differences(&lineage())
            .into_iter()
            .map(|c| c.words)
            .collect()
    }

    #[test]
    fn the_same_lineage_has_no_differences() {
        assert_eq!(lineage().differences(&lineage()), []);
    }

    #[test]
    fn a_flight_is_new_gone_or_changed() {
        let mut now = lineage();
        now.flights = [("f2".to_owned(), "02".to_owned())].into();
        assert_eq!(
            words(&now),
            ["flight f1 is gone from the archive", "new flight f2"]
        );
        now.flights = [("f1".to_owned(), "02".to_owned())].into();
        assert_eq!(words(&now), ["the file of flight f1 changed"]);
    }

    #[test]
    fn a_setting_is_named_by_its_path_with_what_it_was_and_is() {
        let mut now = lineage();
        let settings = serde_json::json!({"weights": "table", "steps": {"de_deg": 3.0}});
        now.configuration = [(Stage::Segment, [("segment".to_owned(), settings)].into())].into();
        let causes = now.differences(&lineage());
        assert_eq!(
            causes[0].words,
            "configuration segment.steps.de_deg: 2.5 became 3.0"
        );
        assert_eq!(
            (causes.len(), causes[0].stage, causes[0].origin),
            (1, Stage::Segment, Origin::Configuration)
        );
    }

    #[test]
    fn a_method_and_the_program_are_code_and_the_tunnel_s_table_counts() {
        let mut now = lineage();
        now.code.methods.insert("joint".into(), 3);
        now.code.source = "bb".into();
        now.tables.clear();
        let causes = now.differences(&lineage());
        assert_eq!(causes[0].words, "the wind-tunnel table changed");
        assert_eq!(causes[1].words, "method `joint`: version 2 became 3");
        assert_eq!(
            (causes[1].stage, causes[2].stage),
            (Stage::Estimate, Stage::Trend)
        );
    }

    #[test]
    fn what_later_stages_read_does_not_decide_an_earlier_one() {
        let mut now = lineage();
        now.code.methods.insert("estimate".into(), 6);
        now.tables.clear();
        assert_eq!(now.until(Stage::Segment), lineage().until(Stage::Segment));
        assert_ne!(now.until(Stage::Estimate), lineage().until(Stage::Estimate));
    }
}
