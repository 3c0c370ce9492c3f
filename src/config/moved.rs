//! Keys that earlier versions took elsewhere: refused with their new place.

use serde_yaml::Value;

use super::source::Source;
use super::written::PipelineFile;
use crate::error::Error;
use crate::settings::{Key, Setting};

/// Keys that another key or file has replaced, and the new place.
const REPLACED: [(&str, &str); 11] = [
    (
        "estimate: max_marked_share",
        "`segment: quality: marked_share`",
    ),
    (
        "estimate: calibration",
        "`instruments: <signal>: uncertainty` of aircraft.yaml",
    ),
    (
        "estimate: joint: share_constants",
        "`estimate: expert: share_constants`",
    ),
    (
        "estimate: prediction: share_constants",
        "`estimate: expert: share_constants`",
    ),
    (
        "ingest: checks: standard_errors",
        "`ingest: expert: fault_standard_errors`",
    ),
    (
        "ingest: compatibility: fault_standard_errors",
        "`ingest: expert: fault_standard_errors`",
    ),
    (
        "ingest: compatibility: ordinary: delay_s",
        "`instruments: <signal>: ordinary: delay_s` of aircraft.yaml",
    ),
    (
        "ingest: compatibility: ordinary",
        "`instruments: <signal>: ordinary` of aircraft.yaml",
    ),
    (
        "ingest: compatibility: faulty: delay_s",
        "`instruments: <signal>: fault: delay_s` of aircraft.yaml",
    ),
    (
        "ingest: compatibility: faulty",
        "`instruments: <signal>: fault` of aircraft.yaml",
    ),
    ("estimate: resolution", "`estimate: expert: resolution`"),
];

/// Error for the keys of `pipeline.yaml` that have a new place, with a line for each of them.
/// `None` if there are none.
pub(super) fn refusal(pipeline: &Source) -> Option<Error> {
    let written: Value = pipeline.parse().ok()?;
    let mut paths = Vec::new();
    leaves(&written, &mut Vec::new(), &mut paths);
    let expert = expert_keys();
    let mut moved: Vec<MovedKey> = paths
        .iter()
        .filter_map(|path| new_place(path, &expert))
        .collect();
    moved.dedup();
    let (first, further) = moved.split_first()?;
    let further = further.iter().map(|key| {
        let error = pipeline.error_at(&key.old, key.message());
        format!("\n{error}")
    });
    let message = first.message() + &further.collect::<String>();
    Some(pipeline.error_at(&first.old, message))
}

/// An old key.
#[derive(PartialEq)]
struct MovedKey {
    old: Vec<String>,
    place: String,
}

impl MovedKey {
    fn message(&self) -> String {
        format!("`{}` is now {}", self.old.join(": "), self.place)
    }
}

/// Paths of all single values and lists.
fn leaves(value: &Value, path: &mut Vec<String>, found: &mut Vec<Vec<String>>) {
    let Some(map) = value.as_mapping().filter(|map| !map.is_empty()) else {
        found.push(path.clone());
        return;
    };
    for (key, below) in map {
        path.push(key.as_str().unwrap_or_default().to_owned());
        leaves(below, path, found);
        path.pop();
    }
}

/// Keys under `expert:`, as they are written.
fn expert_keys() -> Vec<String> {
    let keys = PipelineFile::keys();
    let expert = keys.iter().filter(|key| key.path.get(1) == Some(&"expert"));
    expert.map(Key::written).collect()
}

/// New place of an old key.
fn new_place(path: &[String], expert_keys: &[String]) -> Option<MovedKey> {
    let written = path.join(": ");
    if let Some((old, place)) = REPLACED.iter().find(|(old, _)| is_below(&written, old)) {
        return Some(MovedKey {
            old: old.split(": ").map(str::to_owned).collect(),
            place: (*place).to_owned(),
        });
    }
    let (stage, rest) = path.split_first()?;
    let expert = format!("{stage}: expert: {}", rest.join(": "));
    let exists = expert_keys.iter().any(|key| is_below(&expert, key));
    exists.then(|| MovedKey {
        old: path.to_vec(),
        place: format!("`{expert}`"),
    })
}

/// Test for a path that is another one or lies below it.
fn is_below(path: &str, outer: &str) -> bool {
    path.strip_prefix(outer)
        .is_some_and(|rest| rest.is_empty() || rest.starts_with(": "))
}
