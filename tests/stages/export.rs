//! Export: the demonstration's derivatives for simulators, read back as a tunnel and, where it is
//! installed, by JSBSim.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

use crate::support::{Campaign, demo, note_skip, number};

/// The demonstration with the artefacts of its run.
fn processed() -> Campaign {
    let campaign = Campaign::of_demo();
    demo().fill_store(&campaign);
    campaign
}

/// The demonstration's export in a folder, made once for all tests that read it.
fn exported() -> tempfile::TempDir {
    static FILES: OnceLock<BTreeMap<PathBuf, Vec<u8>>> = OnceLock::new();
    let files = FILES.get_or_init(|| {
        let campaign = processed();
        campaign.ends("export", 0);
        campaign.bytes("reports/export")
    });
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

#[test]
fn the_export_is_the_posterior_and_comes_back_as_the_tunnel() {
    let (campaign, folder) = (processed(), exported());
    let text = std::fs::read_to_string(folder.path().join("flight_updated.csv")).unwrap();
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let rows: Vec<crate::support::Row> = reader.deserialize().map(Result::unwrap).collect();
    let mut exported = rows.iter().filter(|r| r["source"].starts_with("posterior"));
    let posterior = &demo().tables["posterior"];
    assert!(posterior.len() > 1000, "{} rows", posterior.len());
    for row in posterior {
        let same = |r: &&crate::support::Row| {
            r["derivative"] == row["derivative"] && r["alpha_deg"] == row["alpha_deg"]
        };
        let found = exported
            .clone()
            .find(same)
            .unwrap_or_else(|| panic!("{row:?}"));
        assert_eq!(found["value"], row["value"]);
        assert_eq!(found["uncertainty"], row["standard_deviation"]);
    }
    assert_eq!(exported.by_ref().count(), posterior.len());
    let value = |name: &str, alpha: &str| {
        let there = |r: &&crate::support::Row| r["derivative"] == name && r["alpha_deg"] == alpha;
        rows.iter().find(there).map(|r| number(r, "value"))
    };
    for row in rows.iter().filter(|r| r["derivative"] == "CN_0") {
        let alpha = &row["alpha_deg"];
        let sum =
            number(row, "value") + value("CN_alpha", alpha).unwrap() * number(row, "alpha_deg");
        approx::assert_relative_eq!(
            sum,
            value("CN_ba", alpha).unwrap(),
            epsilon = 1e-12,
            max_relative = 1e-12
        );
    }
    // Every format is a tunnel that the pipeline takes; `export::tests` hold that its values are
    // the same to the bit.
    for name in [
        "flight_updated.csv",
        "flight_updated.parquet",
        "flight_updated.dml",
    ] {
        let outcome = crate::support::run(
            campaign
                .command("check")
                .arg("--wind-tunnel")
                .arg(folder.path().join(name)),
        );
        assert_eq!(outcome.code, Some(0), "{name}: {outcome:?}");
    }
}

#[test]
fn jsbsim_itself_computes_the_exported_coefficients() {
    let folder = exported();
    let python = std::env::var("JSBSIM_PYTHON").unwrap_or_else(|_| "python3".into());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/load_in_jsbsim.py");
    let Ok(output) = Command::new(&python)
        .arg(script)
        .arg(folder.path())
        .output()
    else {
        return note_skip(&format!("no {python} here to load the export in JSBSim"));
    };
    // JSBSim is not installed; `export::tests` evaluates the section by its rules in any case.
    if output.status.code() == Some(77) {
        return note_skip(&format!("{python} has no JSBSim"));
    }
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn draws_are_whole_models_and_the_same_for_the_same_seed() {
    let campaign = processed();
    let draw =
        |number: &str| crate::support::run(campaign.command("export").args(["--draws", number]));
    assert_eq!(draw("10000").code, Some(64), "files have four digits");
    let export = || draw("3");
    let read = |name: &str| std::fs::read(campaign.path("reports/export").join(name)).unwrap();
    assert_eq!(export().code, Some(0));
    let (table, section) = (read("draws.csv"), read("draw_0002_jsbsim.xml"));
    assert_ne!(section, read("draw_0003_jsbsim.xml"));
    assert_eq!(export().code, Some(0));
    assert_eq!(table, read("draws.csv"));
    assert_eq!(section, read("draw_0002_jsbsim.xml"));
    let rows = |table: &[u8]| String::from_utf8_lossy(table).lines().count() - 1;
    assert_eq!(rows(&table), 3 * rows(&read("flight_updated.csv")));
}

#[test]
fn an_export_does_not_change_what_is_up_to_date() {
    let campaign = processed();
    campaign.ends("export", 0);
    let names = [
        "flight_updated.csv",
        "flight_updated.parquet",
        "flight_updated.dml",
        "flight_updated_jsbsim.xml",
    ];
    let bytes =
        || names.map(|name| std::fs::read(campaign.path("reports/export").join(name)).unwrap());
    let first = bytes();
    campaign.ends("export", 0);
    assert_eq!(bytes(), first);
}
