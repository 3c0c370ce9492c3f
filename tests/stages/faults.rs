//! Faults planted in the demonstration's channels: each is named, and no healthy channel beside it.

use std::path::Path;

use harvest::config::{Config, Overrides};
use harvest::error::Problem;
use harvest::flight::RawFlight;
use harvest::ingest::{self, Ingested, Settings};
use harvest::store::archive;

const DEG: f64 = 57.295_779_5;

/// The demonstration's pipeline.
fn config() -> Config {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/harv");
    Config::load(&folder, Overrides::default()).unwrap()
}

fn flights(config: &Config) -> Vec<RawFlight> {
    let found = archive::find(&config.archive).unwrap();
    found.iter().map(|files| archive::read(files, &config.channels).unwrap().swap_remove(0)).collect()
}

fn ingest(config: &Config, raw: &RawFlight, settings: &Settings) -> Result<Ingested, Problem> {
    ingest::record(raw, &config.channels, &config.constants, &config.aircraft, settings)
}

#[test]
fn every_demonstration_flight_passes_its_checks_and_is_repaired() {
    let config = config();
    let flights = flights(&config);
    assert_eq!(flights.len(), 4);
    for raw in &flights {
        let ingested = ingest(&config, raw, &Settings::default()).unwrap();
        assert_eq!(ingested.problems, [], "{}", raw.flight_id);
        assert_eq!(ingested.checks.len(), 12);
        for check in &ingested.checks {
            let weak = check.relation.contains("lateral acceleration") && check.verdict == "not excited";
            assert!(weak || check.verdict == "ok", "{}: {check:?}", raw.flight_id);
        }
        let lost = ingested.record.samples - raw.columns["time"].values.len();
        assert!(lost < 30, "{lost} lost frames");
        for row in &ingested.channels {
            assert_eq!((row.missing, row.stuck, row.between), (0, 0, 0), "{row:?}");
            assert!(row.rate_hz.is_some_and(|rate| (rate - 40.0).abs() < 0.01), "{row:?}");
            assert!(row.bridged >= lost && row.bridged < 150, "{row:?}");
            assert!(row.despiked <= 12, "{row:?}");
        }
        let heading = ingested.record.values("psi_deg").unwrap();
        assert!(heading.windows(2).all(|p| (p[1] - p[0]).abs() < 10.0), "a heading that wraps");
    }
}

/// Ten minutes of the second flight.
fn ten_minutes(config: &Config) -> RawFlight {
    let mut raw = flights(config).swap_remove(1);
    raw.columns.values_mut().for_each(|c| c.values.truncate(24_000));
    raw
}

/// Each channel multiplied by its factor is accused and no other.
fn each_is_named_alone(planted: &[(&str, f64)]) {
    let config = config();
    let raw = ten_minutes(&config);
    let settings = Settings { on_failed_check: ingest::OnFailedCheck::Report, ..Settings::default() };
    for (channel, factor) in planted {
        let mut wrong = raw.clone();
        let column = wrong.columns.get_mut(*channel).unwrap();
        column.values.iter_mut().for_each(|v| *v *= factor);
        let rows = ingest(&config, &wrong, &settings).unwrap().channels;
        let accused = rows.iter().filter(|c| c.verdict != "ok" && c.verdict != "not checked");
        let accused: Vec<&str> = accused.map(|c| c.channel.as_str()).collect();
        assert_eq!(accused, [*channel], "times {factor}");
    }
}

#[test]
fn a_reversed_attitude_or_rate_is_named() {
    each_is_named_alone(&["theta", "phi", "psi", "p", "q", "r"].map(|name| (name, -1.0)));
}

#[test]
fn a_reversed_vane_accelerometer_or_altitude_is_named() {
    each_is_named_alone(&["alpha_vane", "beta_vane", "an", "ax", "ay", "altitude"].map(|name| (name, -1.0)));
}

#[test]
fn an_angle_or_a_rate_in_radians_is_named() {
    each_is_named_alone(&["theta", "phi", "alpha_vane", "beta_vane", "p", "q", "r"].map(|name| (name, 1.0 / DEG)));
}

#[test]
fn metres_knots_pascals_and_feet_per_second_squared_are_named() {
    each_is_named_alone(&[
        ("altitude", 0.3048),
        ("V", 0.3048),
        ("V", 0.5925),
        ("qbar", 47.88),
        ("an", 32.174),
        ("ax", 9.806_65),
        ("ay", 32.174),
    ]);
}

#[test]
fn a_dead_rate_gyro_is_named() {
    each_is_named_alone(&[("p", 0.0), ("q", 0.0), ("r", 0.0)]);
}

#[test]
fn a_refused_flight_names_channel_relation_and_cause() {
    let config = config();
    let mut raw = ten_minutes(&config);
    raw.columns.get_mut("q").unwrap().values.iter_mut().for_each(|v| *v /= DEG);
    let problem = ingest(&config, &raw, &Settings::default()).unwrap_err();
    assert_eq!((problem.flight_id.as_str(), problem.place.as_str()), ("flight_002", "channel `q`"));
    assert!(problem.reason.contains("theta rate against q and r: slope "), "{}", problem.reason);
    assert!(problem.reason.contains("it is recorded in rad/s, not in deg/s"), "{}", problem.reason);
}
