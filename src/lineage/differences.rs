//! The differences between two lineages, in words.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::parts::{Code, Lineage, method_stage};
use super::stage::Stage;

/// Kind of a cause.
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
    /// The first stage that reads what differs.
    pub stage: Stage,
    pub origin: Origin,
    /// The flight, the path in the configuration, or the method.
    pub subject: String,
    /// The difference in words: `new flight flight_007`.
    pub words: String,
}

/// Largest number of differences of one part of the configuration that are listed, so that a report
/// stays readable.
const MOST_DIFFERENCES: usize = 5;

/// Longest value that is quoted whole, characters.
const LONGEST_VALUE: usize = 40;

impl Lineage {
    /// Differences since `before`, in the order of the stages.
    #[must_use]
    pub fn differences(&self, before: &Lineage) -> Vec<Cause> {
        let mut causes = flight_differences(&before.flights, &self.flights);
        for stage in Stage::ALL {
            let tables = (before.tables.get(&stage), self.tables.get(&stage));
            causes.extend(table_differences(stage, tables.0, tables.1));
            let settings = (
                before.configuration.get(&stage),
                self.configuration.get(&stage),
            );
            causes.extend(setting_differences(stage, settings.0, settings.1));
        }
        causes.extend(method_differences(&before.code, &self.code));
        causes.extend(program_difference(&before.code, &self.code));
        causes.sort();
        causes
    }
}

/// Keys of two maps in order, each once.
fn union<'a, V>(a: &'a BTreeMap<String, V>, b: &'a BTreeMap<String, V>) -> BTreeSet<&'a String> {
    a.keys().chain(b.keys()).collect()
}

fn flight_differences(
    before: &BTreeMap<String, String>,
    now: &BTreeMap<String, String>,
) -> Vec<Cause> {
    let cause = |flight: &String| {
        let words = match (before.get(flight), now.get(flight)) {
            (a, b) if a == b => return None,
            (None, _) => format!("new flight {flight}"),
            (_, None) => format!("flight {flight} is gone from the archive"),
            _ => format!("the file of flight {flight} changed"),
        };
        Some(Cause {
            stage: Stage::Ingest,
            origin: Origin::Flight,
            subject: flight.clone(),
            words,
        })
    };
    union(before, now).into_iter().filter_map(cause).collect()
}

fn table_differences(
    stage: Stage,
    before: Option<&BTreeMap<String, String>>,
    now: Option<&BTreeMap<String, String>>,
) -> Vec<Cause> {
    let empty = BTreeMap::new();
    let (before, now) = (before.unwrap_or(&empty), now.unwrap_or(&empty));
    let names = union(before, now).into_iter();
    names
        .filter(|name| before.get(*name) != now.get(*name))
        .map(|name| Cause {
            stage,
            origin: Origin::Configuration,
            subject: name.clone(),
            words: format!("the {name} changed"),
        })
        .collect()
}

fn setting_differences(
    stage: Stage,
    before: Option<&BTreeMap<String, Value>>,
    now: Option<&BTreeMap<String, Value>>,
) -> Vec<Cause> {
    let empty = BTreeMap::new();
    let (before, now) = (before.unwrap_or(&empty), now.unwrap_or(&empty));
    let of_part = |name: &String| {
        let mut paths = Vec::new();
        compare_values(name, before.get(name), now.get(name), &mut paths);
        let more = paths.len().saturating_sub(MOST_DIFFERENCES);
        paths.truncate(MOST_DIFFERENCES);
        if more > 0 {
            let words = format!("{more} more settings of `{name}` changed");
            paths.push((name.clone(), words));
        }
        paths
    };
    let paths = union(before, now).into_iter().flat_map(of_part);
    paths
        .map(|(subject, words)| Cause {
            stage,
            origin: Origin::Configuration,
            subject,
            words,
        })
        .collect()
}

fn method_differences(before: &Code, now: &Code) -> Vec<Cause> {
    let version = |code: &Code, method: &String| code.methods.get(method).copied();
    let cause = |method: &String| {
        let (a, b) = (version(before, method), version(now, method));
        let (a, b) = (a.unwrap_or_default(), b.unwrap_or_default());
        (a != b).then(|| Cause {
            stage: method_stage(method),
            origin: Origin::Code,
            subject: method.clone(),
            words: format!("method `{method}`: version {a} became {b}"),
        })
    };
    let methods = union(&before.methods, &now.methods);
    methods.into_iter().filter_map(cause).collect()
}

/// Difference of the program. Any change of code may reach the stages that are made anew each time;
/// the stages before them have versions of their methods.
fn program_difference(before: &Code, now: &Code) -> Option<Cause> {
    if (&before.version, &before.source) == (&now.version, &now.source) {
        return None;
    }
    let name = |code: &Code| format!("{} ({})", code.version, code.source);
    Some(Cause {
        stage: Stage::Model,
        origin: Origin::Code,
        subject: "harvest".to_owned(),
        words: format!("the program changed from {} to {}", name(before), name(now)),
    })
}

/// Collects the paths at which two values differ, with the difference in words.
fn compare_values(
    path: &str,
    before: Option<&Value>,
    now: Option<&Value>,
    found: &mut Vec<(String, String)>,
) {
    match (before, now) {
        (a, b) if a == b => {}
        (Some(Value::Object(a)), Some(Value::Object(b))) => {
            let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
            for key in keys {
                compare_values(&format!("{path}.{key}"), a.get(key), b.get(key), found);
            }
        }
        (a, b) => {
            let (a, b) = (quote(a), quote(b));
            let words = format!("configuration {path}: {a} became {b}");
            found.push((path.to_owned(), words));
        }
    }
}

/// A value as text; a long one is cut.
fn quote(value: Option<&Value>) -> String {
    let Some(value) = value else {
        return "nothing".to_owned();
    };
    let text = value.to_string();
    if text.chars().count() <= LONGEST_VALUE {
        return text;
    }
    let beginning: String = text.chars().take(LONGEST_VALUE).collect();
    format!("{beginning}…")
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
            (Stage::Estimate, Stage::Model)
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
