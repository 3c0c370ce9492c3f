//! Trend: groups as the analyst draws them, on the demonstration's estimates.

use std::collections::BTreeSet;

use crate::support::{Campaign, Row, demo, number};

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
    for row in &demo().tables["trends"] {
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
    assert!(
        demo().tables["trends"]
            .iter()
            .all(|t| !t["derivative"].contains("bias"))
    );
}

#[test]
fn a_new_group_is_a_line_in_the_pipeline() {
    let campaign = Campaign::on("data/demo/flights");
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
