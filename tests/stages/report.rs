//! Report: one file that needs nothing else and says everything.

use std::collections::BTreeSet;

use crate::support::{Campaign, demo};

#[test]
fn the_report_needs_no_network() {
    let html = demo().report.to_lowercase();
    assert_eq!(
        html.matches("<script").count(),
        1,
        "one that sorts and hides, and loads nothing"
    );
    for forbidden in [
        "<script ",
        "<link",
        "<iframe",
        "@import",
        "url(http",
        "src=\"http",
        "href=\"http",
        "onload=",
    ] {
        assert!(!html.contains(forbidden), "{forbidden}");
    }
    // Names of SVG's vocabularies are no addresses that anything is loaded from.
    let loads = html.replace("http://www.w3.org/", "");
    assert!(!loads.contains("http://") && !loads.contains("https://"));
    assert!(html.contains("<svg"));
}

#[test]
fn the_report_has_every_derivative_class_and_maneuver() {
    let html = &demo().report;
    let names = |table: &str, column: &str| -> BTreeSet<String> {
        demo().tables[table]
            .iter()
            .map(|r| r[column].clone())
            .collect()
    };
    for name in names("comparison", "derivative") {
        assert!(html.contains(&name), "{name}");
    }
    for name in names("maneuvers", "class")
        .into_iter()
        .chain(names("maneuvers", "flight_id"))
    {
        assert!(html.contains(&name), "{name}");
    }
    assert!(
        html.replace("&#x2f;", "/")
            .contains("data/demo/wt_tables.csv"),
        "where the tunnel's numbers come from"
    );
    // A figure per derivative: 48 and the three combined.
    assert!(
        html.matches("<svg").count() >= 51,
        "{}",
        html.matches("<svg").count()
    );
}

#[test]
fn the_report_names_no_folder_of_the_machine_that_made_it() {
    let folder = std::env::temp_dir();
    assert!(!demo().report.contains(&*folder.to_string_lossy()));
    assert!(!demo().report.contains(env!("CARGO_MANIFEST_DIR")));
}

#[test]
fn an_analyst_s_own_template_replaces_the_built_in_one() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    let template = campaign.path("own.html");
    std::fs::write(&template, "<h1>{{ title }}</h1>").unwrap();
    let line = format!(
        "histories_at_alpha_deg: 30\n  template: {}",
        template.display()
    );
    campaign.edit("pipeline.yaml", "histories_at_alpha_deg: 30", &line);
    campaign.finishes("report");
    let report = std::fs::read_to_string(campaign.path("reports/report.html")).unwrap();
    assert!(
        report.starts_with("<h1>F") && report.contains("derivatives"),
        "{report}"
    );
    assert!(
        campaign.path("reports/report.pdf").exists(),
        "it is well-formed, so it is on paper too"
    );
    std::fs::write(&template, "<h1>{{ title }}<br></h1>").unwrap();
    campaign.ends("report", 2);
    assert!(
        !campaign.path("reports/report.pdf").exists(),
        "another night's paper would be taken for this one's"
    );
    let problems = campaign.table("problems");
    assert!(
        problems
            .iter()
            .any(|p| p["place"] == "report.pdf" && p["reason"].contains("well-formed")),
        "{problems:?}"
    );
}

#[test]
fn every_maneuver_has_its_page_with_a_time_history_and_the_provenance_names_every_flight() {
    let html = &demo().report;
    for row in &demo().tables["maneuvers"] {
        assert!(html.contains(&format!("Time history of {}<", row["maneuver_id"])));
        assert!(
            html.contains(&format!("{}.parquet", row["flight_id"])),
            "{}",
            row["flight_id"]
        );
    }
    assert!(html.contains("harvest run harv --archive"));
    assert!(html.contains("recognise:"), "the classes as configured");
}
