//! Contents of tables that follow from others: outliers, sums, comparisons by maneuver, verdicts,
//! disagreements, changes since an earlier campaign, readings beyond the tunnel.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use crate::compare::verdict;
use crate::support::{Campaign, Row, demo, number, rows};

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs())
}

/// Estimates and sums of the demonstration by maneuver and derivative.
fn estimates() -> BTreeMap<(&'static str, &'static str), &'static Row> {
    let all = rows("estimates").iter().chain(rows("combined"));
    all.map(|row| {
        (
            (row["maneuver_id"].as_str(), row["derivative"].as_str()),
            row,
        )
    })
    .collect()
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some(f64::midpoint(values[last / 2], values[last.div_ceil(2)]))
}

#[test]
fn sums_are_constant_plus_slope_times_alpha() {
    let estimates = estimates();
    for sum in rows("combined") {
        let (id, name) = (sum["maneuver_id"].as_str(), sum["derivative"].as_str());
        let part = |part: &str| {
            let name = name.replace("ba", part);
            number(estimates[&(id, name.as_str())], "value")
        };
        let expected = part("0") + part("alpha") * number(sum, "alpha_deg");
        assert!(near(number(sum, "value"), expected), "{expected}: {sum:?}");
    }
}

#[test]
fn each_maneuver_is_compared_with_the_tunnel_at_its_own_angle_of_attack() {
    let estimates = estimates();
    for row in rows("maneuver_comparison") {
        let of = (row["maneuver_id"].as_str(), row["derivative"].as_str());
        let estimate = estimates[&of];
        assert_eq!(row["flight"], estimate["value"], "{row:?}");
        assert_eq!(row["bound"], estimate["bound_corrected"], "{row:?}");
        if row["verdict"] == "no tunnel value" {
            assert!(row["wind_tunnel"].is_empty(), "{row:?}");
            continue;
        }
        assert_eq!(row["wind_tunnel"], estimate["wind_tunnel"], "{row:?}");
        let [flight, bound, tunnel] = ["flight", "bound", "wind_tunnel"].map(|c| number(row, c));
        assert_eq!(row["verdict"], verdict(flight, bound, tunnel), "{row:?}");
        assert!(near(number(row, "z"), (flight - tunnel) / bound), "{row:?}");
    }
}

#[test]
fn correlations_are_between_pairs_of_the_maneuver_and_not_small() {
    let mut pairs = BTreeSet::new();
    for row in rows("correlations") {
        let columns = ["maneuver_id", "kind", "first", "second"];
        assert!(
            pairs.insert(columns.map(|c| row[c].as_str())),
            "twice: {row:?}"
        );
        let size = number(row, "correlation").abs();
        assert!(size <= 1.0 && row["first"] != row["second"], "{row:?}");
        assert!(row["kind"] == "regressors" || size >= 0.5, "{row:?}");
    }
}

/// Rows of the comparison that a verdict on a range is about.
fn of_range(range: &Row) -> Vec<&'static Row> {
    let [from, to] = ["alpha_from_deg", "alpha_to_deg"].map(|column| number(range, column));
    rows("comparison")
        .iter()
        .filter(|row| row["derivative"] == range["derivative"])
        .filter(|row| (from..=to).contains(&number(row, "alpha_deg")))
        .collect()
}

#[test]
fn a_verdict_on_a_range_is_that_of_each_of_its_rows_with_their_median_difference() {
    let mut covered = 0;
    for range in rows("verdicts") {
        let rows = of_range(range);
        covered += rows.len();
        assert!(!rows.is_empty() && rows.iter().all(|row| row["verdict"] == range["verdict"]));
        let differences = rows.iter().filter(|row| !row["difference_pct"].is_empty());
        let differences = differences
            .map(|row| number(row, "difference_pct"))
            .collect();
        match median(differences) {
            Some(median) => assert!(near(median, number(range, "difference_pct")), "{range:?}"),
            None => assert!(range["difference_pct"].is_empty(), "{range:?}"),
        }
    }
    assert_eq!(covered, rows("comparison").len());
}

#[test]
fn disagreements_are_ranked_by_size_and_stand_in_the_comparison() {
    let mut size_before = f64::INFINITY;
    for (at, row) in rows("disagreements").iter().enumerate() {
        assert_eq!(row["rank"], (at + 1).to_string());
        let size = number(row, "size_pct");
        assert!(size <= size_before, "{row:?}");
        size_before = size;
        let compared = rows("comparison")
            .iter()
            .find(|c| c["derivative"] == row["derivative"] && c["alpha_deg"] == row["alpha_deg"]);
        let compared = compared.unwrap();
        assert_ne!(compared["verdict"], "agrees");
        assert_eq!(
            [&row["flight"], &row["other"], &row["difference"], &row["z"]],
            ["flight", "wind_tunnel", "difference", "z"].map(|column| &compared[column])
        );
    }
}

#[test]
fn changes_are_differences_from_the_trends_of_an_earlier_campaign() {
    let campaign = Campaign::of_demo();
    demo().fill_store(&campaign);
    let earlier = campaign.path("earlier");
    fs::create_dir(&earlier).unwrap();
    // The earlier campaign is this one, but for a larger Cl_p and no Cm_q.
    let (name, bytes) = demo()
        .bytes
        .iter()
        .find(|(path, _)| path.ends_with("trends.csv"))
        .unwrap();
    let mut reader = csv::Reader::from_reader(bytes.as_slice());
    let header = reader.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|column| column == name).unwrap();
    let mut writer = csv::Writer::from_path(earlier.join(name)).unwrap();
    writer.write_record(&header).unwrap();
    for record in reader.records().map(Result::unwrap) {
        let mut cells: Vec<String> = record.iter().map(str::to_owned).collect();
        match &record[column("derivative")] {
            "Cm_q" => continue,
            "Cl_p" => {
                let value: f64 = record[column("value")].parse().unwrap();
                cells[column("value")] = (value + 10.0).to_string();
            }
            _ => {}
        }
        writer.write_record(&cells).unwrap();
    }
    writer.flush().unwrap();
    let mut command = campaign.command("compare");
    let outcome = crate::support::run(command.arg("--against").arg(&earlier));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let changes = campaign.table("changes");
    let compared: BTreeSet<&str> = changes.iter().map(|c| c["derivative"].as_str()).collect();
    assert!(compared.len() > 40, "{compared:?}");
    for change in &changes {
        assert_eq!(change["against"], earlier.display().to_string());
        let expected = match change["derivative"].as_str() {
            "Cm_q" => {
                assert!(change["before"].is_empty(), "{change:?}");
                "not there before"
            }
            "Cl_p" => {
                let (difference, error) = (number(change, "difference"), number(change, "z"));
                assert!((difference + 10.0).abs() < 1e-9, "{change:?}");
                let sum =
                    number(change, "standard_error").hypot(number(change, "before_standard_error"));
                assert!(near(error, difference / sum), "{change:?}");
                let is_opposite = number(change, "flight") * number(change, "before") < 0.0;
                if is_opposite {
                    "sign differs"
                } else {
                    "lower than before"
                }
            }
            _ => {
                assert_eq!(change["flight"], change["before"]);
                "agrees"
            }
        };
        assert_eq!(change["verdict"], expected, "{change:?}");
    }
}

#[test]
fn a_maneuver_below_the_tunnel_s_angles_of_attack_is_listed_with_the_tables_it_leaves() {
    let campaign = Campaign::of_pitch_steps();
    let table = fs::read_to_string("data/demo/wt_tables.csv").unwrap();
    let is_kept = |line: &&str| {
        let alpha_deg = line
            .split(',')
            .nth(1)
            .and_then(|cell| cell.parse::<f64>().ok());
        alpha_deg.is_none_or(|alpha_deg| alpha_deg >= 15.0)
    };
    let lines: Vec<&str> = table.lines().filter(is_kept).collect();
    let tunnel = campaign.path("tunnel.csv");
    fs::write(&tunnel, lines.join("\n")).unwrap();
    let mut command = campaign.command("compare");
    crate::support::run(command.arg("--wind-tunnel").arg(&tunnel));
    let beyond = campaign.table("beyond_tunnel");
    let maneuver = &campaign.table("maneuvers")[0];
    let row = beyond
        .iter()
        .find(|row| row["maneuver_id"] == maneuver["maneuver_id"])
        .unwrap();
    assert_eq!(row["variable"], "alpha_deg");
    assert_eq!(row["treatment"], "clamped");
    assert_eq!(row["read_at"], maneuver["alpha_deg"]);
    assert_eq!(
        (number(row, "tabulated_from"), number(row, "tabulated_to")),
        (15.0, 60.0)
    );
    let derivatives: BTreeSet<&str> = row["derivatives"].split(' ').collect();
    let estimates = campaign.table("estimates");
    let expected: BTreeSet<&str> = estimates
        .iter()
        .filter(|row| !row["wind_tunnel"].is_empty())
        .map(|row| row["derivative"].as_str())
        .collect();
    assert_eq!(derivatives, expected);
}
