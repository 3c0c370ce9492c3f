//! Results from several maneuvers and from evidence, through the program: `hold: evidence`,
//! `estimate: joint`, the prediction of data not used.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use crate::support::{Campaign, Row, number, pitch_steps, run, with_values};

/// Two flights with one maneuver each, of one class at one angle of attack: the second is the first
/// as other instruments would have recorded it. The pipeline is the shipped one, edited.
fn two_recordings(edits: &[(&str, &str)]) -> Campaign {
    let campaign = Campaign::new();
    let first = pitch_steps();
    // A sawtooth of the size of the gyro's noise.
    let second = with_values(&first, "q", |row, q| {
        q + 0.02 * ((row * 7 % 11) as f64 - 5.0) / 5.0
    });
    campaign.add("flight_001", &first);
    campaign.add("flight_002", &second);
    campaign.copy_pipeline();
    for (from, to) in edits {
        campaign.edit("pipeline.yaml", from, to);
    }
    campaign
}

/// Bytes of store and reports.
fn published_bytes(campaign: &Campaign) -> [BTreeMap<PathBuf, Vec<u8>>; 2] {
    [campaign.bytes("store"), campaign.bytes("reports")]
}

fn without_joint(rows: Vec<Row>) -> Vec<Row> {
    rows.into_iter()
        .filter(|row| !row["maneuver_id"].starts_with("joint/"))
        .collect()
}

#[test]
fn hold_by_evidence_gives_each_held_derivative_a_reason_and_a_second_run_changes_nothing() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    campaign.edit("pipeline.yaml", "hold: table", "hold: evidence");
    campaign.finishes("run");
    let estimates = campaign.table("estimates");
    for row in &estimates {
        assert_eq!(
            row["status"] == "held",
            !row["held_because"].is_empty(),
            "{row:?}"
        );
    }
    assert!(estimates.iter().any(|row| row["status"] == "held"));
    let report = std::fs::read_to_string(campaign.path("reports/report.html")).unwrap();
    assert!(report.contains("By the evidence of each maneuver"));
    let before = published_bytes(&campaign);
    campaign.finishes("run");
    assert!(published_bytes(&campaign) == before);
}

#[test]
fn joint_estimates_add_rows_without_changing_others_for_any_number_of_threads() {
    let alone = two_recordings(&[]);
    alone.ends("estimate", 0);
    assert!(alone.table("joint").is_empty());

    let joint = two_recordings(&[("# joint: { alpha_bin_deg: 2.5 }", "joint: {}")]);
    let with_threads = |threads: &str| {
        joint.forget();
        let outcome = run(joint.command("estimate").args(["--threads", threads]));
        assert_eq!(outcome.code, Some(0), "{outcome:?}");
        published_bytes(&joint)
    };
    let one = with_threads("1");
    assert!(
        with_threads("2") == one,
        "the number of threads decides something"
    );

    let members = joint.table("joint");
    assert_eq!(members.len(), 2);
    assert!(
        members
            .iter()
            .all(|row| row["part"] == "joined" && row["maneuvers"] == "2"),
        "{members:?}"
    );
    let shared: Vec<Row> = joint
        .table("estimates")
        .into_iter()
        .filter(|r| r["maneuver_id"] == members[0]["joint_id"])
        .collect();
    let of = |rows: &[Row], name: &str| {
        let row = rows
            .iter()
            .find(|r| r["derivative"] == name && r["status"] == "estimated")
            .cloned();
        row.unwrap_or_else(|| panic!("{name} is not estimated"))
    };
    let (both, single) = (
        of(&shared, "Cm_alpha"),
        of(&alone.table("estimates"), "Cm_alpha"),
    );
    assert_eq!(both["flight_id"], "joint");
    // What both hold is wrong alike, and how much it matters depends on their noise.
    let by_data2 = |row: &Row| number(row, "bound").powi(2) - number(row, "bound_held").powi(2);
    let ratio = (by_data2(&both) / by_data2(&single)).sqrt();
    assert!((0.6..0.8).contains(&ratio), "{ratio}: {both:?}\n{single:?}");
    assert!(
        (number(&both, "value") - number(&single, "value")).abs()
            < number(&single, "bound_corrected")
    );
    for table in ["fits", "estimates", "combined"] {
        assert_eq!(
            without_joint(joint.table(table)),
            alone.table(table),
            "{table}"
        );
    }
    for table in ["maneuvers", "correlations", "predictions"] {
        assert_eq!(joint.table(table), alone.table(table), "{table}");
    }
}

#[test]
fn joint_estimation_is_refused_with_hold_by_evidence() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    campaign.edit("pipeline.yaml", "hold: table", "hold: evidence");
    let line = campaign.edit(
        "pipeline.yaml",
        "# joint: { alpha_bin_deg: 2.5 }",
        "joint: {}",
    );
    let outcome = campaign.ends("check", 1);
    assert!(
        outcome.stderr.contains(&format!(
            "pipeline.yaml:{line}: `joint` needs `hold: table`"
        )),
        "{outcome:?}"
    );
}

#[test]
fn two_maneuvers_predict_each_other_and_a_single_one_has_a_reason_for_none() {
    let campaign = two_recordings(&[]);
    campaign.ends("estimate", 0);
    let outputs = ["alpha", "q", "theta", "an", "ax"];
    for fit in campaign.table("fits") {
        assert_eq!(
            (fit["prediction"].as_str(), fit["predicted_from"].as_str()),
            ("predicted", "1")
        );
        let shares =
            ["theil_bias", "theil_variance", "theil_covariance"].map(|column| number(&fit, column));
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{fit:?}");
        // The same maneuver but for the gyro's noise.
        assert!(
            (number(&fit, "predicted_cost") / number(&fit, "final_cost") - 1.0).abs() < 0.1,
            "{fit:?}"
        );
        for output in outputs {
            assert!(
                number(&fit, &format!("theil_{output}")) < 0.1
                    && !fit[&format!("r_squared_{output}")].is_empty()
            );
        }
        assert!(fit["theil_beta"].is_empty(), "an output of the other axis");
    }
    let predictions = campaign.table("predictions");
    let predicted: BTreeSet<&str> = predictions
        .iter()
        .map(|row| row["output"].as_str())
        .collect();
    assert_eq!((predictions.len(), predicted), (10, outputs.into()));
    let before = published_bytes(&campaign);
    campaign.ends("estimate", 0);
    assert!(published_bytes(&campaign) == before);

    std::fs::remove_file(campaign.flight("flight_002")).unwrap();
    campaign.ends("estimate", 0);
    assert_eq!(
        campaign.table("fits")[0]["prediction"],
        "no other maneuver of its class and angle of attack"
    );
    assert!(campaign.table("predictions").is_empty());
    assert_eq!(run(campaign.command("gc").arg("--yes")).code, Some(0));
    assert!(campaign.bytes("store/predict").is_empty());
}
