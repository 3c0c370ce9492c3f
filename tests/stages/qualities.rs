//! Flying qualities of the demonstration: levels, probabilities, feedback, mistakes in the specification.

use std::collections::BTreeMap;

use crate::support::{Campaign, Row, demo, number};

#[test]
fn every_angle_of_attack_has_every_paragraph_with_probabilities_that_add_up() {
    let levels = &demo().tables["levels"];
    let mut by_alpha: BTreeMap<&str, Vec<&Row>> = BTreeMap::new();
    for row in levels {
        by_alpha.entry(&row["alpha_deg"]).or_default().push(row);
        let shares = ["level_1_pct", "level_2_pct", "level_3_pct", "worse_pct"];
        let sum: f64 = shares.map(|name| number(row, name)).iter().sum();
        assert!((sum - 100.0).abs() < 1e-9, "{row:?}");
    }
    assert!(by_alpha.len() > 20, "{} angles of attack", by_alpha.len());
    for rows in by_alpha.values() {
        let paragraphs: Vec<&str> = rows.iter().map(|r| r["paragraph"].as_str()).collect();
        assert_eq!(
            paragraphs,
            [
                "3.2.1.2",
                "3.2.2.1.1",
                "3.2.2.1.2",
                "3.3.1.1",
                "3.3.1.2",
                "3.3.1.3",
                "3.3.1.4",
                "all"
            ]
        );
        // All together are no better than the worst.
        let level_1 = |row: &&Row| number(row, "level_1_pct");
        let worst = rows[..7].iter().map(level_1).fold(100.0, f64::min);
        assert!(level_1(&rows[7]) <= worst + 1e-9);
    }
}

#[test]
fn the_modes_are_those_of_a_fighter_and_their_deviations_are_small_beside_them() {
    let rows = &demo().tables["qualities"];
    for (quantity, least, most) in [
        ("short_period_frequency", 0.3, 3.0),
        ("dutch_roll_frequency", 0.3, 4.0),
        ("load_factor_per_alpha", 0.5, 30.0),
    ] {
        let own: Vec<&Row> = rows
            .iter()
            .filter(|r| r["quantity"] == quantity && !r["value"].is_empty())
            .filter(|r| number(r, "alpha_deg") <= 30.0)
            // Without a deviation the mode does not exist in many draws.
            .filter(|r| !r["standard_deviation"].is_empty())
            .collect();
        assert!(own.len() > 10, "{quantity}: {}", own.len());
        for row in own {
            let value = number(row, "value");
            assert!((least..most).contains(&value), "{row:?}");
            let deviation = number(row, "standard_deviation");
            assert!(deviation > 0.0 && deviation < 0.5 * value, "{row:?}");
        }
    }
    let roots = &demo().tables["roots"];
    assert_eq!(roots.len() % 8, 0, "four roots of each axis");
}

#[test]
fn feedback_of_yaw_rate_damps_the_dutch_roll_and_a_misspelt_surface_is_named() {
    let campaign = Campaign::of_demo();
    demo().fill_store(&campaign);
    campaign.copy_pipeline();
    let commented = "# feedback:\n#   de_deg: { alpha_deg: 0.3, q_deg_s: 0.3 }";
    let feedback = "feedback:\n  dr_deg: { r_deg_s: 0.5 }";
    campaign.edit("qualities.yaml", commented, feedback);
    campaign.ends("qualities", 0);
    let rows = campaign.table("qualities");
    let damping = |airframe: &str| -> BTreeMap<String, f64> {
        rows.iter()
            .filter(|r| r["airframe"] == airframe && r["quantity"] == "dutch_roll_decay")
            .map(|r| (r["alpha_deg"].clone(), number(r, "value")))
            .collect()
    };
    let (bare, augmented) = (damping("bare"), damping("augmented"));
    assert!(bare.len() > 20 && bare.len() == augmented.len());
    for (alpha, bare) in bare
        .iter()
        .filter(|(a, _)| a.parse::<f64>().unwrap() < 20.0)
    {
        assert!(
            augmented[alpha] > 1.03 * bare,
            "{alpha}: {bare}, {}",
            augmented[alpha]
        );
    }
    let line = campaign.edit("qualities.yaml", "dr_deg: { r_deg_s", "drr_deg: { r_deg_s");
    let outcome = campaign.ends("qualities", 1);
    let place = format!("qualities.yaml:{line}: `drr_deg` is no surface of the model");
    assert!(outcome.stderr.contains(&place), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("did you mean `dr_deg`?"));
}

#[test]
fn a_pipeline_without_a_specification_has_no_flying_qualities() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    std::fs::remove_file(campaign.path("pipeline/qualities.yaml")).unwrap();
    campaign.finishes("qualities");
    assert!(campaign.table("qualities").is_empty());
    assert!(campaign.table("levels").is_empty());
}
