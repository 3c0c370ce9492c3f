//! Run: stages bring their predecessors up to date, publish what was promised, and end the same
//! however often, with however many threads and after whatever interruption they run.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant, SystemTime};

use arrow::array::AsArray;
use arrow::datatypes::Float64Type;

use crate::support::{Campaign, both_axes, demo, files, flight, run, yaw_and_roll_steps};

/// Tables and their columns that other programs rely on, with the stage that publishes them.
const PUBLISHED: &[(&str, &str, &str)] = &[
    (
        "ingest",
        "flights",
        "flight_id start_s duration_s gust_u_ft_s gust_v_ft_s gust_w_ft_s",
    ),
    (
        "ingest",
        "channels",
        "flight_id channel signal samples bridged despiked missing verdict",
    ),
    (
        "ingest",
        "checks",
        "flight_id relation signals slope correlation verdict",
    ),
    (
        "ingest",
        "instruments",
        "flight_id channel signal unit bias bias_bound scale scale_bound delay_s delay_bound_s applied verdict",
    ),
    ("ingest", "problems", "stage flight_id place reason"),
    (
        "segment",
        "maneuvers",
        "maneuver_id flight_id class axis start_s end_s alpha_deg mach qbar_psf velocity_ft_s altitude_ft mass_slug \
         x_cg_ft samples",
    ),
    (
        "segment",
        "events",
        "flight_id given_class given_start_s given_end_s found_class found_start_s found_end_s verdict",
    ),
    (
        "segment",
        "unknown",
        "flight_id start_s end_s inputs nearest_class reason",
    ),
    (
        "estimate",
        "fits",
        "maneuver_id class outcome reason iterations initial_cost final_cost condition_number left_out confounded equation_error_distance \
         prediction predicted_from predicted_cost theil theil_bias theil_variance theil_covariance theil_alpha theil_ay \
         r_squared_alpha r_squared_ay",
    ),
    (
        "estimate",
        "instrument_trends",
        "channel signal error unit flights mean mean_bound scatter common far_flights completed_flights verdict since change \
         change_bound probability",
    ),
    (
        "estimate",
        "fit_outputs",
        "maneuver_id class alpha_deg output unit samples root_mean_square theil theil_bias theil_variance \
         theil_covariance r_squared",
    ),
    (
        "estimate",
        "estimates",
        "maneuver_id flight_id class alpha_deg mach derivative unit status value bound bound_corrected wind_tunnel \
         variance_inflation excitation contribution_pct equation_error \
         equation_error_bound held_because",
    ),
    (
        "estimate",
        "combined",
        "maneuver_id flight_id class alpha_deg mach derivative unit status value bound bound_corrected wind_tunnel",
    ),
    (
        "estimate",
        "correlations",
        "maneuver_id class kind first second correlation",
    ),
    (
        "estimate",
        "predictions",
        "maneuver_id class alpha_deg output unit samples root_mean_square theil theil_bias theil_variance \
         theil_covariance r_squared",
    ),
    (
        "estimate",
        "joint",
        "joint_id class joint_alpha_deg joint_mach maneuvers maneuver_id flight_id alpha_deg mach part cost_alone \
         cost_joint",
    ),
    (
        "trend",
        "trends",
        "derivative unit group alpha_deg value standard_error lower_95 upper_95 prediction_lower_95 prediction_upper_95 \
         maneuvers outliers curve",
    ),
    (
        "trend",
        "outliers",
        "derivative unit group maneuver_id class alpha_deg value bound trend z weight_share",
    ),
    (
        "model",
        "posterior",
        "derivative unit alpha_deg mach third value standard_deviation lower_95 upper_95 wind_tunnel prior_deviation \
         flight_share_pct maneuvers",
    ),
    (
        "model",
        "posterior_covariance",
        "first first_alpha_deg first_mach first_third second second_alpha_deg second_mach second_third covariance",
    ),
    (
        "model",
        "hyperparameters",
        "derivative knowledge size length_deg",
    ),
    (
        "model",
        "contributions",
        "maneuver_id class coefficient weight",
    ),
    (
        "model",
        "self_check",
        "left_out item coefficient estimates inside_95_pct log_density",
    ),
    (
        "model",
        "lift_and_drag",
        "maneuver_id class alpha_deg mach regressor unit lift lift_bound drag drag_bound correlation",
    ),
    (
        "qualities",
        "qualities",
        "airframe axis quantity unit alpha_deg mach qbar_psf mass_slug path_deg value standard_deviation lower_95 \
         upper_95 basis damping_correlation",
    ),
    (
        "qualities",
        "levels",
        "airframe alpha_deg paragraph subject level level_1_pct level_2_pct level_3_pct worse_pct",
    ),
    (
        "qualities",
        "roots",
        "airframe axis alpha_deg real imaginary",
    ),
    (
        "match",
        "match",
        "maneuver_id flight_id class alpha_deg model test subject requirement quantity unit tolerance tolerance_pct flight_value \
         model_value samples inside_pct largest_excess largest_excess_s margin verdict repeat_pct",
    ),
    (
        "match",
        "match_verdicts",
        "maneuver_id flight_id class alpha_deg model verdict margin decided_by repeat_pct closed_loop reason",
    ),
    (
        "compare",
        "comparison",
        "derivative unit alpha_deg mach flight standard_error flight_share_pct wind_tunnel difference uncertainty difference_pct z verdict",
    ),
    (
        "compare",
        "maneuver_comparison",
        "maneuver_id derivative alpha_deg mach flight bound wind_tunnel difference uncertainty difference_pct z verdict",
    ),
    (
        "compare",
        "verdicts",
        "against derivative alpha_from_deg alpha_to_deg verdict difference_pct words",
    ),
    (
        "compare",
        "disagreements",
        "rank against derivative alpha_deg flight other difference z size_pct words",
    ),
    (
        "compare",
        "changes",
        "against derivative group alpha_deg flight before difference difference_pct z verdict",
    ),
    (
        "compare",
        "beyond_tunnel",
        "maneuver_id variable read_at tabulated_from tabulated_to treatment derivatives",
    ),
];

/// Tables without rows in the demonstration: it has one maneuver of each class at an angle of attack,
/// no list of events, no outlier, and nothing fails. Their rows are tested in `rows`, `joint_estimation`, `segment`
/// and `ingest`, those of `outliers` in the unit tests of trends.
const WITHOUT_ROWS: [&str; 8] = [
    "beyond_tunnel",
    "changes",
    "events",
    "joint",
    "outliers",
    "predictions",
    "problems",
    "unknown",
];

const STAGES: [&str; 9] = [
    "ingest",
    "segment",
    "estimate",
    "model",
    "trend",
    "qualities",
    "match",
    "compare",
    "report",
];

/// A campaign of two short flights whose artefacts are in its store.
fn two_flights() -> Campaign {
    let campaign = Campaign::of_both_axes();
    both_axes().fill_store(&campaign);
    campaign
}

#[test]
fn each_stage_brings_its_predecessors_up_to_date_and_publishes_its_tables() {
    let rank = |name: &str| STAGES.iter().position(|s| *s == name).unwrap();
    for stage in STAGES {
        // The stages with artefacts begin with nothing, the others with these artefacts.
        let campaign = if rank(stage) > rank("estimate") {
            two_flights()
        } else {
            Campaign::of_pitch_steps()
        };
        campaign.finishes(stage);
        for (of, table, _) in PUBLISHED {
            for extension in ["csv", "parquet"] {
                let path = campaign
                    .path("reports")
                    .join(format!("{table}.{extension}"));
                assert_eq!(
                    path.is_file(),
                    rank(of) <= rank(stage),
                    "{table}.{extension} after {stage}"
                );
            }
        }
        assert!(campaign.path("reports/problems.csv").is_file(), "{stage}");
        assert_eq!(
            campaign.path("reports/report.html").is_file(),
            stage == "report"
        );
    }
}

#[test]
fn tables_have_their_fixed_columns_and_parquet_equals_csv() {
    let campaign = Campaign::of_demo();
    for (path, bytes) in &demo().bytes {
        fs::create_dir_all(campaign.path("reports")).unwrap();
        fs::write(campaign.path("reports").join(path), bytes).unwrap();
    }
    for (_, table, columns) in PUBLISHED {
        let batch = campaign.batch(table);
        let schema = batch.schema();
        let names: Vec<&str> = schema.fields().iter().map(|f| f.name().as_str()).collect();
        for column in columns.split_whitespace() {
            assert!(names.contains(&column), "{table} lacks {column}");
        }
        let mut csv =
            csv::Reader::from_path(campaign.path("reports").join(format!("{table}.csv"))).unwrap();
        assert_eq!(
            csv.headers().unwrap().iter().collect::<Vec<_>>(),
            names,
            "{table}"
        );
        let rows: Vec<csv::StringRecord> = csv.records().map(Result::unwrap).collect();
        assert_eq!(rows.len(), batch.num_rows(), "{table}");
        assert_eq!(rows.is_empty(), WITHOUT_ROWS.contains(table), "{table}");
        for (j, name) in names.iter().enumerate() {
            let column = batch.column(j);
            let empty = rows.iter().filter(|r| r[j].is_empty()).count();
            assert_eq!(empty, column.null_count(), "{table}: {name}");
            if let Some(numbers) = column.as_primitive_opt::<Float64Type>() {
                let same = |(row, number): (&csv::StringRecord, Option<f64>)| {
                    number.is_none_or(|number| {
                        row[j].parse::<f64>().unwrap().to_bits() == number.to_bits()
                    })
                };
                assert!(rows.iter().zip(numbers.iter()).all(same), "{table}: {name}");
            }
        }
    }
}

/// The columns of each table that was published, by its name.
fn published_columns() -> BTreeMap<String, Vec<String>> {
    let tables = demo()
        .bytes
        .iter()
        .filter(|(path, _)| path.extension().is_some_and(|e| e == "csv"));
    let columns = |bytes: &[u8]| {
        csv::Reader::from_reader(bytes)
            .headers()
            .unwrap()
            .iter()
            .map(str::to_owned)
            .collect()
    };
    tables
        .map(|(path, bytes)| {
            (
                path.file_stem().unwrap().to_string_lossy().into_owned(),
                columns(bytes),
            )
        })
        .collect()
}

#[test]
fn every_published_table_is_promised() {
    let promised: BTreeSet<&str> = PUBLISHED.iter().map(|(_, table, _)| *table).collect();
    assert_eq!(
        published_columns()
            .keys()
            .map(String::as_str)
            .collect::<BTreeSet<_>>(),
        promised
    );
}

/// The columns that `docs/tables.md` explains, by table, in its order.
fn explained_columns() -> BTreeMap<String, Vec<String>> {
    let page = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/tables.md")).unwrap();
    let section = |section: &str| {
        let (table, _) = section.split_once(':').unwrap();
        let columns = section
            .lines()
            .filter_map(|line| line.strip_prefix("| `")?.split('`').next());
        (table.to_owned(), columns.map(str::to_owned).collect())
    };
    page.split("\n## ").skip(1).map(section).collect()
}

#[test]
fn the_page_of_the_tables_explains_every_column_and_no_other() {
    let published = published_columns();
    let explained = explained_columns();
    assert_eq!(
        published["combined"], published["estimates"],
        "the page says so"
    );
    for (table, columns) in published.iter().filter(|(table, _)| *table != "combined") {
        assert_eq!(explained.get(table), Some(columns), "{table}");
    }
}

/// Bytes and time of last change of every file of a campaign but its lock.
fn state(campaign: &Campaign) -> BTreeMap<PathBuf, (Vec<u8>, SystemTime)> {
    ["store", "reports"]
        .iter()
        .flat_map(|folder| files(&campaign.path(folder)))
        .filter(|path| {
            !["lock", "contents.json"].contains(&&*path.file_name().unwrap().to_string_lossy())
        })
        .map(|path| {
            let changed = fs::metadata(&path).unwrap().modified().unwrap();
            (path.clone(), (fs::read(&path).unwrap(), changed))
        })
        .collect()
}

#[test]
fn a_second_run_changes_nothing() {
    let campaign = two_flights();
    campaign.finishes("run");
    let before = state(&campaign);
    campaign.finishes("run");
    assert!(state(&campaign) == before, "a file was written again");
}

#[test]
fn a_second_run_of_a_campaign_with_a_refused_flight_changes_nothing_and_reports_it_again() {
    let campaign = Campaign::of_pitch_steps();
    fs::write(campaign.flight("spoiled"), "text").unwrap();
    campaign.ends("run", 2);
    let before = state(&campaign);
    let again = campaign.ends("run", 2);
    assert!(
        again.stdout.contains("not a readable Parquet file"),
        "{again:?}"
    );
    assert!(state(&campaign) == before, "a file was written again");
}

#[test]
fn tables_and_report_are_the_same_bytes_with_one_thread_and_with_two() {
    // Five maneuvers, three of them enough for trends.
    let campaign = Campaign::of_both_axes();
    campaign.add("flight_003", &flight(3, 330));
    let with_threads = |threads: &str| {
        campaign.forget();
        let outcome = run(campaign.command("run").args(["--threads", threads]));
        assert!(
            outcome.stdout.contains("5 of them converged"),
            "{outcome:?}"
        );
        assert!(!campaign.table("trends").is_empty());
        campaign.bytes("reports")
    };
    let (one, two) = (with_threads("1"), with_threads("2"));
    assert!(one.keys().eq(two.keys()));
    for (path, bytes) in &one {
        assert!(two[path] == *bytes, "{} differs", path.display());
    }
}

#[test]
fn a_killed_run_goes_on_where_it_was() {
    let campaign = two_flights();
    campaign.finishes("run");
    let (store, reports) = (campaign.bytes("store"), campaign.bytes("reports"));

    campaign.forget();
    let mut child = campaign
        .command("run")
        .args(["--threads", "1"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let ingested = campaign.path("store/ingest");
    let patience = Instant::now() + Duration::from_mins(1);
    while whole_files(&ingested).is_empty() && Instant::now() < patience {
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let made = whole_files(&ingested);
    assert!(!made.is_empty(), "it was killed before its first flight");
    assert!(
        !campaign.path("reports/report.html").exists(),
        "it was killed before its end"
    );

    campaign.finishes("run");
    let after = whole_files(&ingested);
    assert!(
        made.iter().all(|(path, time)| after[path] == *time),
        "a flight was ingested again"
    );
    assert!(campaign.bytes("store") == store);
    assert!(campaign.bytes("reports") == reports);
}

/// Files of a folder with their times of last write, without those that are being written.
fn whole_files(folder: &Path) -> BTreeMap<PathBuf, SystemTime> {
    let Ok(entries) = fs::read_dir(folder) else {
        return BTreeMap::new();
    };
    let whole = entries
        .map(Result::unwrap)
        .filter(|entry| !entry.file_name().to_string_lossy().starts_with('.'));
    whole
        .map(|entry| (entry.path(), entry.metadata().unwrap().modified().unwrap()))
        .collect()
}

#[test]
fn what_a_killed_run_leaves_is_swept_or_made_again() {
    let campaign = two_flights();
    campaign.finishes("run");
    let (store, reports) = (campaign.bytes("store"), campaign.bytes("reports"));

    // Half-written files beside their places, one artefact cut short, others and half of the tables
    // not there yet.
    for folder in [
        "store/estimate",
        "store/records",
        "store/ingest",
        "store/segment",
        "reports",
    ] {
        fs::write(campaign.path(folder).join(".harvest-xyz"), "half").unwrap();
    }
    let estimates = files(&campaign.path("store/estimate"));
    let artefact = estimates
        .iter()
        .find(|p| p.extension().is_some_and(|e| e == "json"))
        .unwrap();
    let whole = fs::read(artefact).unwrap();
    fs::write(artefact, &whole[..whole.len() / 2]).unwrap();
    fs::remove_file(&files(&campaign.path("store/ingest"))[1]).unwrap();
    fs::remove_file(&files(&campaign.path("store/records"))[1]).unwrap();
    for table in ["fits.csv", "estimates.parquet", "report.html"] {
        fs::remove_file(campaign.path("reports").join(table)).unwrap();
    }

    campaign.finishes("run");
    assert!(campaign.bytes("store") == store);
    assert!(campaign.bytes("reports") == reports);
}

#[test]
fn a_damaged_record_in_the_store_is_made_again() {
    let campaign = two_flights();
    campaign.ends("estimate", 0);
    let (store, tables) = (campaign.bytes("store"), campaign.tables());
    let record = &files(&campaign.path("store/records"))[1];
    let whole = fs::read(record).unwrap();
    fs::write(record, &whole[..whole.len() / 2]).unwrap();
    for estimate in files(&campaign.path("store/estimate")) {
        fs::remove_file(estimate).unwrap();
    }
    campaign.ends("estimate", 0);
    assert!(campaign.bytes("store") == store);
    assert!(campaign.tables() == tables);
}

#[test]
fn a_flight_that_is_taken_out_of_the_archive_leaves_the_tables() {
    let campaign = two_flights();
    campaign.finishes("run");
    fs::remove_file(campaign.flight("flight_004")).unwrap();
    campaign.finishes("run");
    let alone = Campaign::of_pitch_steps();
    alone.finishes("run");
    let (left, alone) = (campaign.tables(), alone.tables());
    let apart: Vec<_> = left
        .keys()
        .filter(|table| alone.get(*table) != left.get(*table))
        .collect();
    assert!(apart.is_empty() && left.len() == alone.len(), "{apart:?}");
}

#[test]
fn a_flight_that_is_added_leaves_the_others_artefacts_untouched() {
    let campaign = Campaign::of_pitch_steps();
    campaign.ends("estimate", 0);
    let before: BTreeMap<_, _> = state(&campaign)
        .into_iter()
        .filter(|(p, _)| p.starts_with(campaign.path("store")))
        .collect();
    campaign.add("flight_004", &yaw_and_roll_steps());
    campaign.ends("estimate", 0);
    let after = state(&campaign);
    assert!(
        before
            .iter()
            .all(|(path, state)| after.get(path) == Some(state))
    );
    assert_eq!(campaign.table("fits").len(), 2);
}

#[test]
fn a_store_that_another_run_uses_is_left_alone() {
    let campaign = Campaign::of_pitch_steps();
    fs::create_dir(campaign.path("store")).unwrap();
    let lock = File::create(campaign.path("store/lock")).unwrap();
    lock.try_lock().unwrap();
    let outcome = campaign.ends("run", 1);
    assert!(
        outcome.stderr.contains("another run is using this store"),
        "{outcome:?}"
    );
    assert!(!campaign.path("reports").exists());
    drop(lock);
    campaign.ends("ingest", 0);
}

#[test]
fn a_reports_folder_that_cannot_be_written_is_named() {
    // A file is in its place: a folder without permission would not stop a superuser.
    let campaign = Campaign::of_pitch_steps();
    fs::write(campaign.path("reports"), "a file").unwrap();
    let outcome = campaign.ends("ingest", 1);
    assert!(outcome.stderr.contains("reports"), "{outcome:?}");
    assert!(outcome.stderr.contains("cannot create"), "{outcome:?}");
}

#[test]
fn a_quiet_run_prints_nothing() {
    let campaign = Campaign::of_pitch_steps();
    let outcome = run(campaign.command("segment").arg("--quiet"));
    assert_eq!(
        (
            outcome.code,
            outcome.stdout.as_str(),
            outcome.stderr.as_str()
        ),
        (Some(0), "", "")
    );
}
