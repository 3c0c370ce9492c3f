//! Compare: the verdict on every derivative and angle of attack of the demonstration, judged again by
//! arithmetic of the test's own.

use std::collections::BTreeSet;

use crate::support::{Campaign, Row, demo, number, table};

/// Differences that count as agreement, as the shipped pipeline has them.
const AGREEMENT_STANDARD_ERRORS: f64 = 2.0;
const AGREEMENT_SHARE: f64 = 0.05;

/// Share of the information below which flight taught nothing, percent.
const LEARNT_PCT: f64 = 10.0;

/// Value of the tunnel's table of a derivative, by straight lines between its points and the end
/// values beyond them.
fn tunnel(points: &[Row], derivative: &str, alpha_deg: f64) -> f64 {
    let plain = |name: &str| name.replace('_', "");
    let mut points: Vec<(f64, f64)> = points
        .iter()
        .filter(|row| plain(&row["derivative"]) == plain(derivative))
        .map(|row| (number(row, "alpha_deg"), number(row, "value")))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert!(
        !points.is_empty(),
        "the tunnel has no table of {derivative}"
    );
    let above = points.partition_point(|(alpha, _)| *alpha < alpha_deg);
    match (above.checked_sub(1).map(|i| points[i]), points.get(above)) {
        (Some((a0, v0)), Some((a1, v1))) => v0 + (v1 - v0) * (alpha_deg - a0) / (a1 - a0),
        (Some((_, value)), None) | (None, Some(&(_, value))) => value,
        (None, None) => f64::NAN,
    }
}

/// Verdict on flight against a tunnel that states no uncertainty.
pub fn verdict(flight: f64, standard_error: f64, tunnel: f64) -> &'static str {
    let limit = AGREEMENT_STANDARD_ERRORS * standard_error;
    let opposite = (flight > 0.0 && tunnel < 0.0) || (flight < 0.0 && tunnel > 0.0);
    if opposite && flight.abs() > limit {
        "sign differs"
    } else if (flight - tunnel).abs() <= limit
        || (flight - tunnel).abs() <= AGREEMENT_SHARE * tunnel.abs()
    {
        "agrees"
    } else if flight > tunnel {
        "flight higher"
    } else {
        "flight lower"
    }
}

fn assert_near(a: f64, b: f64, row: &Row) {
    assert!(
        (a - b).abs() <= 1e-9 * a.abs().max(b.abs()),
        "{a} is not {b}: {row:?}"
    );
}

#[test]
fn every_verdict_follows_from_posterior_and_tunnel() {
    let points = table(std::path::Path::new("data/demo/wt_tables.csv"));
    let mut counts = std::collections::BTreeMap::new();
    for row in &demo().tables["comparison"] {
        let given = row["verdict"].as_str();
        *counts.entry(given).or_insert(0) += 1;
        let posterior = demo().tables["posterior"].iter().find(|t| {
            ["derivative", "alpha_deg"]
                .iter()
                .all(|column| t[*column] == row[*column])
        });
        let posterior = posterior.unwrap_or_else(|| panic!("no posterior has {row:?}"));
        let flight = number(posterior, "value");
        let error = number(posterior, "standard_deviation");
        assert_near(number(row, "flight"), flight, row);
        assert_near(number(row, "standard_error"), error, row);
        if given == "no tunnel value" {
            assert!(
                row["wind_tunnel"].is_empty() && row["z"].is_empty(),
                "{row:?}"
            );
            continue;
        }
        let tunnel = if row["derivative"] == "CN_0"
            || row["derivative"] == "Cm_0"
            || row["derivative"] == "CA_0"
        {
            // The tunnel has the sum with the slope.
            let alpha = number(row, "alpha_deg");
            let part =
                |ending: &str| tunnel(&points, &row["derivative"].replace("_0", ending), alpha);
            part("_ba") - alpha * part("_alpha")
        } else {
            tunnel(&points, &row["derivative"], number(row, "alpha_deg"))
        };
        assert_near(number(row, "wind_tunnel"), tunnel, row);
        assert_near(number(row, "difference"), flight - tunnel, row);
        assert_near(number(row, "uncertainty"), error, row);
        assert_near(number(row, "z"), (flight - tunnel) / error, row);
        if tunnel == 0.0 {
            assert!(row["difference_pct"].is_empty(), "{row:?}");
        } else {
            let percent = 100.0 * (flight - tunnel) / tunnel.abs();
            assert_near(number(row, "difference_pct"), percent, row);
        }
        let is_learnt = number(posterior, "flight_share_pct") >= LEARNT_PCT
            && number(posterior, "maneuvers") > 0.0;
        let expected = if is_learnt {
            verdict(flight, error, tunnel)
        } else {
            "nothing learnt"
        };
        assert_eq!(given, expected, "{row:?}");
    }
    // The demonstration has every verdict, so each branch of the arithmetic is tried.
    let verdicts = [
        "agrees",
        "flight higher",
        "flight lower",
        "no tunnel value",
        "nothing learnt",
        "sign differs",
    ];
    assert_eq!(counts.keys().copied().collect::<Vec<_>>(), verdicts);
}

#[test]
fn the_verdict_of_this_test_can_fail() {
    assert_eq!(verdict(1.0, 0.1, 1.19), "agrees");
    assert_eq!(verdict(1.0, 0.1, 1.21), "flight lower");
    assert_eq!(verdict(1.0, 0.001, 1.04), "agrees");
    assert_eq!(verdict(1.0, 0.1, -0.1), "sign differs");
    assert_eq!(verdict(0.1, 0.1, -0.01), "agrees");
}

#[test]
fn derivatives_that_are_not_comparable_have_no_tunnel_value() {
    for name in [
        "CY_beta", "Cl_beta", "Cn_beta", "CN_dpv", "Cm_dpv", "CA_dpv", "CY_dyv", "Cl_dyv", "Cn_dyv",
    ] {
        let rows: Vec<_> = demo().tables["comparison"]
            .iter()
            .filter(|r| r["derivative"] == name)
            .collect();
        assert!(!rows.is_empty(), "{name}");
        assert!(
            rows.iter().all(|r| r["verdict"] == "no tunnel value"),
            "{name}"
        );
    }
}

#[test]
fn every_derivative_that_is_estimated_is_compared_and_the_combined_ones_too() {
    let compared: BTreeSet<&str> = demo().tables["comparison"]
        .iter()
        .map(|r| r["derivative"].as_str())
        .collect();
    for row in demo().tables["estimates"]
        .iter()
        .filter(|r| r["status"] == "estimated")
    {
        let name = row["derivative"].as_str();
        // About the constants of the lateral axis the tunnel says nothing.
        let is_unknown = ["CY_0", "Cl_0", "Cn_0"].contains(&name);
        let is_expected = !is_unknown && !name.ends_with("_bias");
        assert_eq!(compared.contains(name), is_expected, "{name}");
    }
    for name in ["CN_ba", "Cm_ba", "CA_ba"] {
        assert!(compared.contains(name), "{name}");
    }
}

#[test]
fn a_tunnel_that_agrees_with_flight_has_the_verdict_agrees() {
    // The demonstration's tunnel is wrong on purpose; one that is flight's own trend agrees
    // everywhere.
    let campaign = Campaign::of_demo();
    demo().fill_store(&campaign);
    campaign.copy_pipeline();
    let rows = &demo().tables["comparison"];
    let flight: Vec<String> = rows
        .iter()
        .filter(|r| r["derivative"] == "Cl_p")
        .map(|r| format!("Cl_p,{},{},per_rad", r["alpha_deg"], r["flight"]))
        .collect();
    let table = std::fs::read_to_string("data/demo/wt_tables.csv").unwrap();
    let others: Vec<&str> = table.lines().filter(|l| !l.starts_with("Clp,")).collect();
    std::fs::write(
        campaign.path("tunnel.csv"),
        format!("{}\n{}\n", others.join("\n"), flight.join("\n")),
    )
    .unwrap();
    let outcome = crate::support::run(
        campaign
            .command("compare")
            .arg("--wind-tunnel")
            .arg(campaign.path("tunnel.csv")),
    );
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let damping: Vec<_> = campaign
        .table("comparison")
        .into_iter()
        .filter(|r| r["derivative"] == "Cl_p")
        .collect();
    assert!(!damping.is_empty());
    assert!(
        damping.iter().all(|r| r["verdict"] == "agrees"),
        "{damping:?}"
    );
}
