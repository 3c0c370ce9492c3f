//! The page `docs/settings.md`, made from the declarations of the settings, and checks that the
//! parser accepts just these. `make docs` writes the page anew.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use super::instruments::InstrumentErrors;
use super::source::Source;
use super::written::{AircraftFile, PipelineFile};
use crate::settings::{Key, Setting};

const PAGE: &str = "docs/settings.md";

const HEAD: &str = "\
# Settings

All keys of `pipeline.yaml`, and the `instruments:` of `aircraft.yaml`. This page is made from the declarations in the
sources; a test holds the two alike. `make check` reads a pipeline's files and names the first mistake with file and line.

The keys that an analyst decides stand at the top level of a stage. Those under `expert:` have defaults reasoned from
instruments, flight mechanics and numerics. They rarely need a change, and each explanation states the effect of a change.

A path `ingest: expert: checks: block_s` is written

```yaml
ingest:
  expert:
    checks: { block_s: 0.2 }
```

`<signal>` and `<surface>` stand for names of `aircraft.yaml`, `[]` for each entry of a list. *required* marks keys without
a default.

`estimate: hold: evidence` has a price: where the tunnel is worse than its stated uncertainty, its intervals cover less than
those of `table` ([validity](validity.md#intervals-with-hold-evidence)). State the tunnel's uncertainty where evidence
decides.
";

fn source(text: &str) -> Source {
    Source::of("pipeline.yaml", text)
}

/// Sections of the page: name and keys of each stage of `pipeline.yaml`, then `instruments:` of
/// `aircraft.yaml`.
fn sections() -> Vec<(&'static str, Vec<Key>)> {
    let mut sections: Vec<(&'static str, Vec<Key>)> = Vec::new();
    for key in PipelineFile::keys() {
        let name = if key.path.len() == 1 { "" } else { key.path[0] };
        match sections.iter_mut().find(|(section, _)| *section == name) {
            Some((_, keys)) => keys.push(key),
            None => sections.push((name, vec![key])),
        }
    }
    let instruments = crate::settings::below(
        &["instruments"],
        <BTreeMap<String, InstrumentErrors> as Setting>::keys(),
    );
    sections.push(("instruments", instruments));
    sections
}

fn rows(keys: &[&Key]) -> String {
    let row = |key: &&Key| {
        let default = key
            .default
            .as_ref()
            .map_or_else(|| "*required*".to_owned(), |d| format!("`{}`", plain(d)));
        let explanation = key.explanation.replace('|', "\\|");
        format!("| `{}` | {default} | {explanation} |\n", key.written())
    };
    let rows: String = keys.iter().map(row).collect();
    format!("| key | default | meaning and effect |\n|---|---|---|\n{rows}")
}

/// A default without the quotes of JSON, and `none` for a missing one.
fn plain(default: &str) -> String {
    match default {
        "null" => "none".to_owned(),
        "\"\"" => default.to_owned(),
        _ => default.replace('"', "").replace('|', "\\|"),
    }
}

fn page() -> String {
    let mut page = HEAD.to_owned();
    for (name, keys) in sections() {
        let title = match name {
            "" => "## Places and title".to_owned(),
            "instruments" => "## `instruments:` of `aircraft.yaml`".to_owned(),
            _ => format!("## `{name}:`"),
        };
        let (expert, in_sight): (Vec<&Key>, Vec<&Key>) = keys
            .iter()
            .partition(|key| key.path.get(1) == Some(&"expert"));
        let _ = write!(page, "\n{title}\n\n{}", rows(&in_sight));
        if !expert.is_empty() {
            let _ = write!(page, "\n### `{name}: expert:`\n\n{}", rows(&expert));
        }
    }
    page
}

#[test]
fn the_page_of_settings_is_what_the_declarations_make() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(PAGE);
    if std::env::var_os("HARVEST_WRITE_DOCS").is_some() {
        fs::write(&path, page()).unwrap();
    }
    let written = fs::read_to_string(&path).unwrap();
    assert!(written == page(), "{PAGE} is out of date: make docs");
}

#[test]
fn every_setting_has_an_explanation() {
    for key in sections().into_iter().flat_map(|(_, keys)| keys) {
        assert!(key.explanation.len() >= 10, "{}", key.written());
    }
}

/// YAML with one key at a path, `[]` as a list.
fn yaml(path: &[&str], value: &str) -> String {
    match path {
        [] => value.to_owned(),
        ["[]", rest @ ..] => format!("[{}]", yaml(rest, value)),
        [name, rest @ ..] => format!("{{ \"{name}\": {} }}", yaml(rest, value)),
    }
}

#[test]
fn every_default_can_be_written_under_its_key() {
    let mut parsed = 0;
    for key in PipelineFile::keys() {
        let default = key.default.as_deref().map(plain);
        let Some(default) = default.filter(|default| default != "none") else {
            continue;
        };
        let text = format!(
            "title: t\narchive: a\n{}: {}\n",
            key.path[0],
            yaml(&key.path[1..], &default)
        );
        let file = source(&text).parse::<PipelineFile>();
        assert!(file.is_ok(), "{text}: {}", file.err().unwrap());
        parsed += 1;
    }
    assert!(parsed > 100, "{parsed} defaults");
}

/// Names that the parser accepts at a path, taken from its error about an unknown name. `None` if
/// it takes a single value or any name.
fn expected(file: fn(&Source) -> Option<String>, path: &[&str]) -> Option<Vec<String>> {
    let text = yaml(&[path, &["no_such_key"]].concat(), "0");
    let answer = file(&source(&text))?;
    let (_, list) = answer.split_once("unknown field `no_such_key`, expected ")?;
    let list = list.split("; did you mean").next().unwrap_or_default();
    Some(
        list.split('`')
            .skip(1)
            .step_by(2)
            .map(str::to_owned)
            .collect(),
    )
}

#[test]
fn the_parser_takes_the_declared_keys_and_no_others() {
    let pipeline = |s: &Source| s.parse::<PipelineFile>().err().map(|e| e.to_string());
    let aircraft = |s: &Source| s.parse::<AircraftFile>().err().map(|e| e.to_string());
    for (name, keys) in sections() {
        let file: fn(&Source) -> Option<String> = if name == "instruments" {
            aircraft
        } else {
            pipeline
        };
        for key in &keys {
            for depth in 1..=key.path.len() {
                let (above, below) = key.path.split_at(depth);
                let Some(found) = expected(file, above) else {
                    let names = |n: &&&str| !["[]"].contains(n) && !n.starts_with('<');
                    assert!(
                        below.iter().take(1).find(names).is_none(),
                        "{}",
                        key.written()
                    );
                    continue;
                };
                let mut declared: Vec<&str> = keys
                    .iter()
                    .filter(|other| other.path.starts_with(above))
                    .filter_map(|other| other.path.get(depth).copied())
                    .collect();
                declared.sort_unstable();
                declared.dedup();
                let mut found: Vec<&str> = found.iter().map(String::as_str).collect();
                found.sort_unstable();
                assert_eq!(found, declared, "{}", above.join(": "));
            }
        }
    }
}
