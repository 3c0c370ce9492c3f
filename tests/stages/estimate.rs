//! Estimate: every maneuver a row, the demonstration's derivatives near their truths, new
//! derivatives by YAML alone.

use crate::support::{Campaign, Row, demo, number, rows};

/// Two tables of estimates are the same but for rounding: to a thousandth of the estimate's own
/// bound.
pub fn assert_same_estimates(a: &[Row], b: &[Row]) {
    assert_eq!(a.len(), b.len());
    assert!(a.iter().any(|row| row["status"] == "estimated"));
    for (a, b) in a.iter().zip(b) {
        assert_eq!(
            (&a["derivative"], &a["status"], &a["unit"]),
            (&b["derivative"], &b["status"], &b["unit"])
        );
        if a["status"] == "estimated" {
            let apart = (number(a, "value") - number(b, "value")).abs();
            assert!(apart < 1e-3 * number(a, "bound"), "{a:?}\n{b:?}");
        }
    }
}

fn estimate(maneuver: &str, derivative: &str) -> &'static Row {
    let of = |row: &&Row| row["maneuver_id"] == maneuver && row["derivative"] == derivative;
    let row = rows("estimates").iter().find(of).unwrap();
    assert_eq!(row["status"], "estimated", "{row:?}");
    row
}

#[test]
fn every_maneuver_of_the_demonstration_converges() {
    assert_eq!(demo().outcome.code, Some(0), "{:?}", demo().outcome);
    let fits = &demo().tables["fits"];
    assert_eq!(fits.len(), 36);
    for fit in fits {
        assert_eq!(fit["outcome"], "converged", "{fit:?}");
    }
}

#[test]
fn derivatives_are_near_those_that_were_flown() {
    // The last number of each line is the derivative that was true during the maneuver, from the
    // list that came with the simulated campaign (JSBSim). The instruments have biases and scale
    // factors of one to two per cent; a derivative is a ratio of two channels, and a tenth is what
    // two such errors and a bound of a few per cent leave. The corrected bound has both in it.
    for (maneuver, derivative, truth) in [
        ("flight_001_t00118", "CN_alpha", 0.084_940),
        ("flight_003_t00103", "CN_alpha", 0.038_856),
        ("flight_001_t00233", "Cm_de", -0.016_084),
        ("flight_004_t00809", "Cm_de", -0.015_602),
        ("flight_002_t00562", "Cm_dpv", -1529.765),
        ("flight_004_t01299", "Cm_dpv", -1657.494),
        ("flight_001_t00397", "CY_beta", -0.011_486),
        ("flight_001_t01004", "Cl_beta", -0.003_435),
        ("flight_003_t00204", "Cn_beta", 0.001_423),
        ("flight_001_t00719", "Cl_da", 0.001_700),
        ("flight_003_t00204", "Cn_dr", -0.001_212),
        ("flight_003_t00541", "Cn_dyv", 2127.180),
        ("flight_004_t00124", "Cl_p", -0.227_934),
    ] {
        let row = estimate(maneuver, derivative);
        let (value, bound) = (number(row, "value"), number(row, "bound_corrected"));
        let ratio = value / truth;
        assert!(
            (ratio - 1.0).abs() < 0.1,
            "{derivative} of {maneuver} is {ratio} times the truth"
        );
        let errors = (value - truth).abs() / bound;
        assert!(
            errors < 3.0,
            "{derivative} of {maneuver} is {errors} bounds from the truth"
        );
    }
}

#[test]
fn primary_derivatives_have_the_sign_of_a_conventional_aircraft() {
    // Median over all maneuvers that estimate it.
    for (derivative, sign, sentence) in [
        ("CN_alpha", 1.0, "more angle of attack, more normal force"),
        ("CN_de", 1.0, "stabilator trailing edge down lifts the tail"),
        (
            "Cm_de",
            -1.0,
            "stabilator trailing edge down pitches the nose down",
        ),
        ("Cm_q", -1.0, "pitching up is damped"),
        ("Cm_dpv", -1.0, "plume down pitches the nose down"),
        ("CY_beta", -1.0, "wind from the right pushes to the left"),
        ("Cl_beta", -1.0, "wind from the right rolls to the left"),
        ("Cl_p", -1.0, "rolling is damped"),
        ("Cl_da", 1.0, "ailerons roll to the right"),
        (
            "CY_dr",
            1.0,
            "rudder trailing edge left pushes to the right",
        ),
        (
            "Cn_dr",
            -1.0,
            "rudder trailing edge left yaws the nose left",
        ),
        ("Cn_dyv", 1.0, "plume right yaws the nose right"),
    ] {
        let of = |row: &&Row| row["derivative"] == derivative && row["status"] == "estimated";
        let mut values: Vec<f64> = demo().tables["estimates"]
            .iter()
            .filter(of)
            .map(|row| number(row, "value"))
            .collect();
        values.sort_by(f64::total_cmp);
        let median = values[values.len() / 2];
        assert!(median * sign > 0.0, "{sentence}: {derivative} is {median}");
    }
}

#[test]
fn a_bound_stands_beside_every_estimate_and_nowhere_else() {
    for row in rows("estimates") {
        assert_eq!(
            row["status"] == "estimated",
            !row["bound"].is_empty(),
            "{row:?}"
        );
        assert_eq!(
            row["status"] == "inactive",
            row["value"].is_empty(),
            "{row:?}"
        );
        if row["status"] == "estimated" {
            assert!(
                number(row, "bound_corrected") >= number(row, "bound")
                    && number(row, "bound") > 0.0,
                "{row:?}"
            );
        }
    }
}

#[test]
fn maneuvers_hold_the_tunnel_s_values_until_the_posterior_of_the_other_flights_has_them() {
    let off = |rows: &[Row]| {
        let held = rows.iter().filter(|r| r["status"] == "held");
        let off = held.filter(|r| r["value"] != r["wind_tunnel"]);
        off.count()
    };
    assert!(off(&demo().tables["estimates"]) > 100);
    let campaign = Campaign::of_demo();
    demo().fill_store(&campaign);
    campaign.copy_pipeline();
    let (posterior, tunnel) = ("held_values: posterior", "held_values: tunnel");
    campaign.edit("pipeline.yaml", posterior, tunnel);
    campaign.finishes("compare");
    let estimates = campaign.table("estimates");
    assert_eq!(off(&estimates), 0);
    // Trends and their outliers are of these estimates, and those of the demonstration of its own.
    let outliers = campaign.table("outliers");
    assert!(!outliers.is_empty());
    for outlier in outliers {
        let is_own = |row: &&Row| {
            row["maneuver_id"] == outlier["maneuver_id"]
                && row["derivative"] == outlier["derivative"]
        };
        let row = estimates.iter().find(is_own);
        assert!(
            row.is_none_or(|row| row["value"] == outlier["value"]),
            "{outlier:?}"
        );
    }
}

#[test]
fn an_override_of_a_class_holds_above_its_angle_of_attack() {
    // The paper's asterisk in Table 3: CY_da of pilot yaw and roll steps.
    let statuses = demo().tables["estimates"]
        .iter()
        .filter(|r| r["class"] == "PYRS" && r["derivative"] == "CY_da");
    let mut seen = 0;
    for row in statuses {
        let expected = if number(row, "alpha_deg") > 22.5 {
            "estimated"
        } else {
            "held"
        };
        assert_eq!(row["status"], expected, "{row:?}");
        seen += 1;
    }
    assert_eq!(seen, 4);
}

#[test]
fn a_derivative_under_another_name_is_a_matter_of_the_model_s_file() {
    let shipped = Campaign::of_pitch_steps();
    shipped.ends("estimate", 0);
    let other = Campaign::of_pitch_steps();
    other.copy_pipeline();
    other.edit(
        "model.yaml",
        "CN_de,     coefficient",
        "CN_stab,   coefficient",
    );
    for file in other.class_files() {
        if std::fs::read_to_string(other.path("pipeline").join(&file))
            .unwrap()
            .contains("CN_de")
        {
            other.edit(&file, "CN_de,", "CN_stab,");
        }
    }
    let table = std::fs::read_to_string("data/demo/wt_tables.csv").unwrap();
    let renamed = table
        .replace("CN_de,", "CN_stab,")
        .replace("CNde,", "CNstab,");
    std::fs::write(other.path("tunnel.csv"), renamed).unwrap();
    let outcome = crate::support::run(
        other
            .command("estimate")
            .arg("--wind-tunnel")
            .arg(other.path("tunnel.csv")),
    );
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let mut rows = other.table("estimates");
    for row in &mut rows {
        let name = row.get_mut("derivative").unwrap();
        *name = name.replace("CN_stab", "CN_de");
    }
    assert_eq!(rows, shipped.table("estimates"));
}

#[test]
fn a_new_derivative_is_a_line_in_the_model_and_one_in_each_class() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    // Normal force from the pitch rate's own surface, the ailerons: estimated by no class, absent
    // in each.
    let first = "  - { name: CN_alpha,";
    campaign.edit(
        "model.yaml",
        first,
        &format!("  - {{ name: CN_da, coefficient: CN, regressor: da_deg }}\n{first}"),
    );
    for file in campaign.class_files() {
        let text = std::fs::read_to_string(campaign.path("pipeline").join(&file)).unwrap();
        if text.contains("axis: longitudinal") {
            if text.contains("inactive: [") {
                campaign.edit(&file, "inactive: [", "inactive: [CN_da, ");
            } else {
                campaign.edit(&file, "held: [", "inactive: [CN_da]\nheld: [");
            }
        }
    }
    campaign.ends("estimate", 0);
    let rows = campaign.table("estimates");
    let names: Vec<&str> = rows.iter().map(|r| r["derivative"].as_str()).collect();
    let at = names.iter().position(|n| *n == "CN_da").unwrap();
    assert_eq!(
        names[at + 1],
        "CN_alpha",
        "rows come in the order of the model"
    );
    assert_eq!(rows[at]["status"], "inactive");
}

#[test]
fn a_product_of_regressors_is_a_line_in_the_model_and_one_that_is_none_is_refused_with_its_line() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    let first = "  - { name: CN_alpha,";
    let line = |regressor: &str| {
        format!("  - {{ name: CN_alpha_de, coefficient: CN, regressor: {regressor} }}\n{first}")
    };
    campaign.edit("model.yaml", first, &line("alpha ^ 2"));
    for file in campaign.class_files() {
        let text = std::fs::read_to_string(campaign.path("pipeline").join(&file)).unwrap();
        if text.contains("axis: longitudinal") {
            campaign.edit(&file, "estimated: [", "estimated: [CN_alpha_de, ");
        }
    }
    let refused = campaign.ends("estimate", 1);
    let place = "model.yaml:11: CN_alpha_de: `alpha ^ 2` is no regressor";
    assert!(refused.stderr.contains(place), "{}", refused.stderr);
    campaign.edit("model.yaml", "alpha ^ 2", "alpha * de_deg");
    campaign.harvest("estimate");
    let rows = campaign.table("estimates");
    let row = rows.iter().find(|r| r["derivative"] == "CN_alpha_de");
    let row = row.unwrap();
    assert_eq!((&*row["unit"], &*row["status"]), ("per_deg2", "estimated"));
    assert!(number(row, "bound") > 0.0);
}

#[test]
fn a_bias_less_is_a_line_less() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    campaign.edit("model.yaml", "  - { name: q_bias, output: q }\n", "");
    for file in campaign.class_files() {
        if std::fs::read_to_string(campaign.path("pipeline").join(&file))
            .unwrap()
            .contains("q_bias")
        {
            campaign.edit(&file, " q_bias,", "");
        }
    }
    campaign.ends("estimate", 0);
    assert!(
        campaign
            .table("estimates")
            .iter()
            .all(|row| row["derivative"] != "q_bias")
    );
    assert!(
        campaign
            .table("estimates")
            .iter()
            .any(|row| row["derivative"] == "an_bias")
    );
}

#[test]
fn a_held_derivative_without_a_tunnel_value_stops_the_run() {
    let campaign = Campaign::of_pitch_steps();
    let table = std::fs::read_to_string("data/demo/wt_tables.csv").unwrap();
    let without: Vec<&str> = table
        .lines()
        .filter(|l| !l.starts_with("CN_dlef,") && !l.starts_with("CNdlef,"))
        .collect();
    assert!(without.len() < table.lines().count());
    std::fs::write(campaign.path("tunnel.csv"), without.join("\n")).unwrap();
    let outcome = crate::support::run(
        campaign
            .command("estimate")
            .arg("--wind-tunnel")
            .arg(campaign.path("tunnel.csv")),
    );
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    assert!(outcome.stderr.contains("3211.yaml:"), "{outcome:?}");
    assert!(
        outcome.stderr.contains("`CN_dlef` is held, and "),
        "{outcome:?}"
    );
}
