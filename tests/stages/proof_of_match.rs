//! Proof of match of the demonstration: verdicts, models, repairs of the store, mistakes in the tolerances.

use std::collections::BTreeSet;

use crate::support::{Campaign, Row, both_axes, demo, number};

/// Verdicts of one model.
fn verdicts<'a>(rows: &'a [Row], model: &str) -> Vec<&'a Row> {
    rows.iter().filter(|row| row["model"] == model).collect()
}

#[test]
fn every_maneuver_is_flown_again_by_every_model_and_the_worst_requirement_decides() {
    let tables = &demo().tables;
    let rows = &tables["match"];
    for model in ["posterior", "tunnel"] {
        let own = verdicts(&tables["match_verdicts"], model);
        let ids: BTreeSet<&str> = own.iter().map(|r| r["maneuver_id"].as_str()).collect();
        assert_eq!(ids.len(), tables["maneuvers"].len(), "{model}");
        for verdict in own {
            let of_maneuver = rows
                .iter()
                .filter(|r| r["maneuver_id"] == verdict["maneuver_id"] && r["model"] == model);
            let of_maneuver: Vec<&Row> = of_maneuver.collect();
            let decided_by = &verdict["decided_by"];
            let decisive = of_maneuver
                .iter()
                .find(|r| format!("{} {}", r["test"], r["quantity"]) == *decided_by);
            assert_eq!(
                decisive.unwrap()["verdict"],
                verdict["verdict"],
                "{verdict:?}"
            );
            assert!((0.0..=100.0).contains(&number(verdict, "repeat_pct")));
            for row in of_maneuver {
                let is_inside = row["verdict"] == "inside";
                assert_eq!(is_inside, number(row, "inside_pct") >= 100.0, "{row:?}");
                assert_eq!(
                    is_inside,
                    row["margin"].parse::<f64>().is_ok_and(|m| m >= 0.0)
                );
            }
        }
    }
}

#[test]
fn the_posterior_matches_the_flights_better_than_the_tunnel() {
    let tables = &demo().tables;
    let inside = |model: &str| {
        let own = verdicts(&tables["match_verdicts"], model);
        own.iter().filter(|r| r["verdict"] == "inside").count()
    };
    let (posterior, tunnel) = (inside("posterior"), inside("tunnel"));
    assert!(
        posterior > tunnel,
        "{posterior} with the posterior, {tunnel} with the tunnel"
    );
    let closed = tables["match_verdicts"]
        .iter()
        .filter(|r| r["closed_loop"] == "1");
    assert!(
        closed.count() > 50,
        "the pilot's steps are flown with feedback"
    );
}

#[test]
fn the_dutch_roll_is_judged_by_its_values() {
    let rows = demo().tables["match"]
        .iter()
        .filter(|r| r["test"] == "2.d.7");
    let rows: Vec<&Row> = rows.filter(|r| !r["model_value"].is_empty()).collect();
    assert!(rows.len() > 60, "{}", rows.len());
    for row in rows {
        let (flight, model) = (number(row, "flight_value"), number(row, "model_value"));
        let part = |name: &str| row[name].parse::<f64>().unwrap_or(0.0);
        let width = part("tolerance").max(0.01 * part("tolerance_pct") * flight.abs());
        let is_inside = (model - flight).abs() <= width;
        assert_eq!(row["verdict"] == "inside", is_inside, "{row:?}");
    }
}

#[test]
fn a_run_with_other_tolerances_flies_again_and_one_with_the_same_does_not() {
    let campaign = Campaign::of_both_axes();
    both_axes().fill_store(&campaign);
    campaign.copy_pipeline();
    campaign.finishes("match");
    let before = campaign.bytes("store/match");
    assert_eq!(before.len(), 2);
    campaign.finishes("match");
    assert_eq!(campaign.bytes("store/match"), before);
    campaign.edit(
        "match.yaml",
        "models: [posterior, tunnel]",
        "models: [trend]",
    );
    campaign.finishes("match");
    let models: BTreeSet<String> = campaign
        .table("match_verdicts")
        .iter()
        .map(|r| r["model"].clone())
        .collect();
    assert_eq!(models, BTreeSet::from(["trend".to_owned()]));
    assert!(campaign.bytes("store/match").len() > before.len());
}

#[test]
fn a_tolerance_without_width_and_an_unknown_class_are_named_with_their_line() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    let line = campaign.edit("match.yaml", "an_g, within: 0.10", "an_g");
    let outcome = campaign.ends("match", 1);
    let place = format!("match.yaml:{line}: `an_g`: give `within` or `within_pct`");
    assert!(outcome.stderr.contains(&place), "{}", outcome.stderr);
    campaign.edit("match.yaml", "an_g }", "an_g, within: 0.10 }");
    let unknown = "axis: longitudinal # applies to all its classes; or";
    let line = campaign.edit(
        "match.yaml",
        unknown,
        "axis: longitudinal\n    classes: [PPSX] #",
    );
    let outcome = campaign.ends("match", 1);
    let place = format!(
        "match.yaml:{}: unknown class `PPSX`; did you mean `PPSS`?",
        line + 1
    );
    assert!(outcome.stderr.contains(&place), "{}", outcome.stderr);
}

#[test]
fn tests_and_tolerances_that_judge_nothing_are_named_with_their_line() {
    for (right, wrong, said) in [
        (
            "- { quantity: r_deg_s, within: 2, within_pct: 10 }",
            "- { quantity: q_deg_s, within: 2, within_pct: 10 }",
            "`q_deg_s` is a longitudinal quantity, but test 2.d.6 is of the lateral axis",
        ),
        (
            "- { quantity: theta_deg, within: 1.5 }",
            "- { quantity: dutch_roll_period, within: 1.5 }",
            "`dutch_roll_period` is a lateral quantity, but test 2.c.10 is of the longitudinal axis",
        ),
        (
            "- test: 2.d.6",
            "- test: 2.d.2",
            "test 2.d.2 stands twice for class OLAT: put its requirements in one list, or give each its own number",
        ),
        (
            "one_of:\n          - { quantity: r_deg_s, within: 2, within_pct: 10 }",
            "one_of: []",
            "test 2.d.6: `one_of` lists no tolerance",
        ),
        (
            "trim_s: 1 ",
            "trim_s: 0 ",
            "`trim_s` must be above 0 and at most 5, not 0",
        ),
        (
            "inside_pct: 100 ",
            "inside_pct: 0 ",
            "`inside_pct` must be above 0 and at most 100, not 0",
        ),
    ] {
        let campaign = Campaign::of_pitch_steps();
        campaign.copy_pipeline();
        let line = campaign.edit("match.yaml", right, wrong);
        let outcome = campaign.ends("check", 1);
        let place = format!("match.yaml:{line}: {said}");
        assert!(
            outcome.stderr.contains(&place),
            "{place}: {}",
            outcome.stderr
        );
    }
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    let file = campaign.path("pipeline/match.yaml");
    let text = std::fs::read_to_string(&file).unwrap();
    let (head, _) = text.split_once("\ntests:").unwrap();
    std::fs::write(&file, format!("{head}\ntests: []\n")).unwrap();
    let outcome = campaign.ends("check", 1);
    let line = head.matches('\n').count() + 2;
    let place = format!("match.yaml:{line}: `tests` lists no test");
    assert!(outcome.stderr.contains(&place), "{}", outcome.stderr);
}

#[test]
fn a_pipeline_without_tolerances_has_no_proof() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    std::fs::remove_file(campaign.path("pipeline/match.yaml")).unwrap();
    campaign.finishes("match");
    assert!(campaign.table("match").is_empty());
    assert!(campaign.table("match_verdicts").is_empty());
}
