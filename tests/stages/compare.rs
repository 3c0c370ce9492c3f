//! Compare: a word for every derivative and angle of attack of the demonstration.

use std::collections::BTreeSet;

use crate::support::{Campaign, demo, number};

#[test]
fn every_row_has_a_word_that_follows_from_its_numbers() {
    for row in &demo().tables["comparison"] {
        let verdict = row["verdict"].as_str();
        if verdict == "no tunnel value" {
            assert!(
                row["wind_tunnel"].is_empty() && row["z"].is_empty(),
                "{row:?}"
            );
            continue;
        }
        let (flight, tunnel) = (number(row, "flight"), number(row, "wind_tunnel"));
        assert!(
            (number(row, "difference") - (flight - tunnel)).abs()
                <= 1e-9 * flight.abs().max(tunnel.abs())
        );
        match verdict {
            "flight higher" => assert!(flight > tunnel, "{row:?}"),
            "flight lower" => assert!(flight < tunnel, "{row:?}"),
            "sign differs" => assert!(flight * tunnel < 0.0, "{row:?}"),
            "agrees" => {}
            other => panic!("`{other}` is no verdict: {row:?}"),
        }
    }
}

#[test]
fn the_paper_s_derivatives_without_a_tunnel_value_say_so() {
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
        assert!(compared.contains(name) != name.ends_with("_bias"), "{name}");
    }
    for name in ["CN_ba", "Cm_ba", "CA_ba"] {
        assert!(compared.contains(name), "{name}");
    }
}

#[test]
fn a_tunnel_that_agrees_with_flight_is_said_to_agree() {
    // The demonstration's tunnel is wrong on purpose; one that is flight's own trend agrees
    // everywhere.
    let campaign = Campaign::on("data/demo/flights");
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
