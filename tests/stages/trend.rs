//! Trend: groups as the analyst draws them, on the demonstration's estimates.

use std::collections::BTreeSet;

use crate::support::{Campaign, Row, demo, flight, number, rows, values, with_values};

#[test]
fn a_derivative_s_trend_is_through_the_classes_of_its_group() {
    let trends = &demo().tables["trends"];
    let of = |derivative: &str, group: &str| -> Vec<&Row> {
        trends
            .iter()
            .filter(|t| t["derivative"] == derivative && t["group"] == group)
            .collect()
    };
    // Four maneuvers of each class.
    assert!(
        of("Cm_dpv", "pitch vanes")
            .iter()
            .all(|t| t["maneuvers"] == "4")
    );
    assert!(
        of("Cm_q", "pitch rate")
            .iter()
            .all(|t| t["maneuvers"] == "8")
    );
    assert!(of("Cm_alpha", "all").iter().all(|t| t["maneuvers"] == "20"));
    for (derivative, group) in [
        ("Cm_dpv", "pitch vanes"),
        ("Cm_q", "pitch rate"),
        ("Cm_alpha", "all"),
    ] {
        assert!(!of(derivative, group).is_empty(), "{derivative} {group}");
    }
    assert!(of("Cm_dpv", "all").is_empty());
}

#[test]
fn a_trend_stays_inside_its_data_and_its_band_holds_its_value() {
    for row in rows("trends") {
        let (alpha, value) = (number(row, "alpha_deg"), number(row, "value"));
        assert!((9.0..=42.0).contains(&alpha), "{row:?}");
        assert!(
            number(row, "lower_95") <= value && value <= number(row, "upper_95"),
            "{row:?}"
        );
        assert!(number(row, "standard_error") > 0.0, "{row:?}");
    }
}

#[test]
fn biases_have_no_trend() {
    // A bias has the unit of its instrument.
    let of_instrument = |row: &&Row| row["unit"] == "g" || row["unit"] == "deg_s";
    let biases: BTreeSet<&str> = rows("estimates")
        .iter()
        .filter(of_instrument)
        .map(|row| row["derivative"].as_str())
        .collect();
    assert_eq!(biases.len(), 6, "{biases:?}");
    for row in rows("trends") {
        assert!(!biases.contains(row["derivative"].as_str()), "{row:?}");
    }
}

#[test]
fn a_new_group_is_a_line_in_the_pipeline() {
    let campaign = Campaign::of_demo();
    demo().fill_store(&campaign);
    campaign.copy_pipeline();
    campaign.edit(
        "pipeline.yaml",
        "    - { name: all }",
        "    - { name: doublets, derivatives: [Cn_dr], classes: [SSIMD_LAT] }\n    - { name: all }",
    );
    campaign.ends("compare", 0);
    let rudder: Vec<Row> = campaign
        .table("comparison")
        .into_iter()
        .filter(|r| r["derivative"] == "Cn_dr")
        .collect();
    assert!(!rudder.is_empty());
    let groups: BTreeSet<&str> = rudder.iter().map(|r| r["group"].as_str()).collect();
    assert_eq!(groups, ["doublets"].into());
    // All other derivatives are untouched.
    let others = |rows: Vec<Row>| -> Vec<Row> {
        rows.into_iter()
            .filter(|r| r["derivative"] != "Cn_dr")
            .collect()
    };
    assert_eq!(
        others(campaign.table("trends")),
        others(demo().tables["trends"].clone())
    );
    assert_eq!(
        others(campaign.table("comparison")),
        others(demo().tables["comparison"].clone())
    );
}

#[test]
fn a_doubtful_maneuver_keeps_its_numbers_and_enters_no_trend() {
    // The elevator of one flight is recorded 0.4 s late: its maneuvers do not follow the model.
    let campaign = Campaign::new();
    for number in 1..=4 {
        let mut record = flight(number, 3600);
        if number == 1 {
            let elevator = values(&record, "de");
            record = with_values(&record, "de", |row, _| elevator[row.saturating_sub(16)]);
        }
        campaign.add(&format!("flight_00{number}"), &record);
    }
    let outcome = campaign.ends("run", 2);
    let fits = campaign.table("fits");
    let doubtful: Vec<&Row> = fits.iter().filter(|f| f["outcome"] == "doubtful").collect();
    assert!(!doubtful.is_empty(), "{outcome:?}");
    let (problems, estimates) = (campaign.table("problems"), campaign.table("estimates"));
    let report = std::fs::read_to_string(campaign.path("reports/report.html")).unwrap();
    assert!(report.contains("doubtful maneuver") && outcome.stdout.contains("converged"));
    for fit in &doubtful {
        let id = &fit["maneuver_id"];
        assert!(id.starts_with("flight_001"), "{fit:?}");
        assert!(
            problems
                .iter()
                .any(|p| p["reason"].starts_with("doubtful") && p["place"] == *id),
            "{problems:?}"
        );
        assert!(
            estimates
                .iter()
                .any(|e| e["maneuver_id"] == *id && !e["bound_corrected"].is_empty())
        );
    }
    let converged: BTreeSet<&str> = fits
        .iter()
        .filter(|f| f["outcome"] == "converged")
        .map(|f| f["maneuver_id"].as_str())
        .collect();
    let counted = estimates.iter().filter(|e| {
        e["derivative"] == "Cm_alpha"
            && e["status"] == "estimated"
            && converged.contains(&*e["maneuver_id"])
    });
    let counted = counted.count().to_string();
    let trends = campaign.table("trends");
    let of_all = trends
        .iter()
        .filter(|t| t["derivative"] == "Cm_alpha" && t["group"] == "all");
    assert!(of_all.clone().count() > 0 && of_all.clone().all(|t| t["maneuvers"] == counted));
}
