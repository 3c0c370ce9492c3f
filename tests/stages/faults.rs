//! Faults planted in the demonstration's channels: each is named, and no healthy channel beside it.

use std::path::Path;

use harvest::config::{Config, Overrides};
use harvest::error::Problem;
use harvest::flight::{Channel, RawFlight};
use harvest::ingest::compatibility::{Compatibility, OnFault};
use harvest::ingest::{self, Ingested, Settings};
use harvest::schema::Words;
use harvest::store::archive;
use harvest::tables::CheckVerdict;

use crate::support::Random;

const DEG: f64 = 57.295_779_5;

/// The demonstration's pipeline.
fn config() -> Config {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/harv");
    Config::load(&folder, Overrides::default()).unwrap()
}

fn flights(config: &Config) -> Vec<RawFlight> {
    let found = archive::find(&config.archive).unwrap();
    found
        .iter()
        .map(|files| {
            archive::read(files, &config.channels)
                .unwrap()
                .swap_remove(0)
        })
        .collect()
}

fn ingest(config: &Config, raw: &RawFlight, settings: &Settings) -> Result<Ingested, Problem> {
    ingest::record(
        raw,
        &config.channels,
        &config.constants,
        &config.aircraft,
        settings,
    )
}

#[test]
fn every_demonstration_flight_passes_its_checks_and_is_repaired() {
    let config = config();
    let flights = flights(&config);
    assert_eq!(flights.len(), 4);
    for raw in &flights {
        let ingested = ingest(&config, raw, &Settings::default()).unwrap();
        assert_eq!(ingested.problems, [], "{}", raw.flight_id);
        assert_eq!(ingested.checks.len(), 13);
        for check in &ingested.checks {
            // There are no gusts.
            let weak = ["lateral acceleration", "side gusts"]
                .iter()
                .any(|name| check.relation.contains(name))
                && check.verdict == CheckVerdict::NotExcited;
            assert!(
                weak || check.verdict == CheckVerdict::Ok,
                "{}: {check:?}",
                raw.flight_id
            );
        }
        let lost = ingested.record.samples - raw.columns["time"].values.len();
        assert!(lost < 30, "{lost} lost frames");
        for row in &ingested.channels {
            assert_eq!((row.missing, row.stuck, row.between), (0, 0, 0), "{row:?}");
            assert!(
                row.rate_hz.is_some_and(|rate| (rate - 40.0).abs() < 0.01),
                "{row:?}"
            );
            assert!(row.bridged >= lost && row.bridged < 150, "{row:?}");
            assert!(row.despiked <= 12, "{row:?}");
        }
        let heading = ingested.record.values("psi_deg").unwrap();
        assert!(
            heading.windows(2).all(|p| (p[1] - p[0]).abs() < 10.0),
            "a heading that wraps"
        );
    }
}

/// Ten minutes of the second flight.
fn ten_minutes(config: &Config) -> RawFlight {
    let mut raw = flights(config).swap_remove(1);
    raw.columns
        .values_mut()
        .for_each(|c| c.values.truncate(24_000));
    raw
}

/// Each channel multiplied by its factor is accused and no other.
fn each_is_named_alone(planted: &[(&str, f64)]) {
    let config = config();
    let raw = ten_minutes(&config);
    let gross = Compatibility {
        reconstruct: false,
        ..Compatibility::default()
    };
    let on_failed_check = ingest::OnFailedCheck::Report;
    let settings = Settings {
        on_failed_check,
        compatibility: gross,
        ..Settings::default()
    };
    for (channel, factor) in planted {
        let mut wrong = raw.clone();
        let column = wrong.columns.get_mut(*channel).unwrap();
        column.values.iter_mut().for_each(|v| *v *= factor);
        let rows = ingest(&config, &wrong, &settings).unwrap().channels;
        let accused = rows.iter().filter(|c| !c.verdict.passed());
        let accused: Vec<&str> = accused.map(|c| c.channel.as_str()).collect();
        assert_eq!(accused, [*channel], "times {factor}");
    }
}

#[test]
fn a_time_of_another_unit_or_rate_is_named_and_no_channel() {
    let config = config();
    for (number, raw) in flights(&config).iter().enumerate() {
        // 40 Hz taken for 32 or 50 Hz; minutes of a slower recorder; a tenth.
        for factor in [0.8, 1.25, 3.0, 0.1, 1.0 / 20.0] {
            let mut wrong = raw.clone();
            let time = wrong.columns.get_mut("time").unwrap();
            time.values.iter_mut().for_each(|t| *t *= factor);
            let problem = ingest(&config, &wrong, &Settings::default()).unwrap_err();
            let about = format!("flight {number} times {factor}: {problem:?}");
            assert_eq!(problem.place, "channel `time`", "{about}");
            let counts = problem.reason.strip_prefix("it counts ").unwrap();
            let seconds: f64 = counts.split(' ').next().unwrap().parse().unwrap();
            assert!((seconds / factor - 1.0).abs() < 0.03, "{about}");
        }
    }
}

#[test]
fn a_centre_of_gravity_in_inches_and_a_velocity_at_rest_are_named() {
    let config = config();
    let raw = ten_minutes(&config);
    for (channel, factor) in [("xcg", 12.0), ("zcg", 12.0), ("V", 1.0 / DEG)] {
        let mut wrong = raw.clone();
        let column = wrong.columns.get_mut(channel).unwrap();
        column.values.iter_mut().for_each(|v| *v *= factor);
        let problem = ingest(&config, &wrong, &Settings::default()).unwrap_err();
        assert_eq!(problem.place, format!("channel `{channel}`"), "{problem:?}");
        assert!(problem.reason.contains("in another unit"), "{problem:?}");
    }
}

#[test]
fn a_reversed_attitude_or_rate_is_named() {
    each_is_named_alone(&["theta", "phi", "psi", "p", "q", "r"].map(|name| (name, -1.0)));
}

#[test]
fn a_reversed_vane_accelerometer_or_altitude_is_named() {
    each_is_named_alone(
        &["alpha_vane", "beta_vane", "an", "ax", "ay", "altitude"].map(|name| (name, -1.0)),
    );
}

#[test]
fn an_angle_or_a_rate_in_radians_is_named() {
    each_is_named_alone(
        &["theta", "phi", "alpha_vane", "beta_vane", "p", "q", "r"].map(|name| (name, 1.0 / DEG)),
    );
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
    raw.columns
        .get_mut("q")
        .unwrap()
        .values
        .iter_mut()
        .for_each(|v| *v /= DEG);
    let problem = ingest(&config, &raw, &Settings::default()).unwrap_err();
    assert_eq!(
        (problem.flight_id.as_str(), problem.place.as_str()),
        ("flight_002", "channel `q`")
    );
    assert!(
        problem
            .reason
            .contains("theta rate against q and r: slope "),
        "{}",
        problem.reason
    );
    assert!(
        problem
            .reason
            .contains("it is recorded in rad/s, not in deg/s"),
        "{}",
        problem.reason
    );
}

/// Values that have nothing of the signal: noise of a size about a middle.
fn noise(count: usize, middle: f64, size: f64) -> Vec<f64> {
    let mut random = Random::new(7);
    let mut value = || middle + size * (2.0 * random.unit() - 1.0);
    (0..count).map(|_| value()).collect()
}

/// Ten minutes with a thermometer of the standard atmosphere.
fn with_thermometer(config: &mut Config) -> RawFlight {
    let mut raw = ten_minutes(config);
    let mut air = raw.columns["altitude"].clone();
    air.unit = Some("K".to_owned());
    air.values
        .iter_mut()
        .for_each(|h| *h = 288.15 - 0.0065 * 0.3048 * *h);
    raw.columns.insert("OAT".to_owned(), air);
    let channel = Channel::plain("air_kelvin", "K");
    config.channels.insert("OAT".to_owned(), channel);
    raw
}

#[test]
fn a_useless_channel_that_nothing_requires_costs_no_flight() {
    let mut config = config();
    let raw = with_thermometer(&mut config);
    let rows = raw.columns["time"].values.len();
    let settings = few_windows(OnFault::Apply);
    for (channel, values, consequence) in [
        ("psi", noise(rows, 180.0, 180.0), "larger bounds"),
        ("psi", noise(rows, 180.0, 10.0), "larger bounds"),
        ("psi", vec![90.0; rows], "larger bounds"),
        (
            "altitude",
            vec![20_000.0; rows],
            "`altitude_ft` is computed",
        ),
        (
            "altitude",
            noise(rows, 20_000.0, 9_000.0),
            "`altitude_ft` is computed",
        ),
        ("mach", noise(rows, 0.0, 5.0), "`mach` is computed"),
        ("mach", vec![0.6; rows], "`mach` is computed"),
        ("OAT", noise(rows, 250.0, 60.0), "standard atmosphere"),
        ("OAT", vec![288.15; rows], "standard atmosphere"),
        ("OAT", vec![-20.0; rows], "degC"),
    ] {
        let mut wrong = raw.clone();
        wrong.columns.get_mut(channel).unwrap().values = values;
        let ingested = ingest(&config, &wrong, &settings).unwrap();
        let [problem] = &ingested.problems[..] else {
            panic!("{channel}: {:?}", ingested.problems)
        };
        assert_eq!(problem.place, format!("channel `{channel}`"));
        assert!(problem.reason.contains("left out"), "{problem:?}");
        assert!(problem.reason.contains(consequence), "{problem:?}");
        let rows = ingested.channels.iter();
        let accused: Vec<&str> = rows
            .filter(|row| !row.verdict.passed())
            .map(|row| row.channel.as_str())
            .collect();
        assert_eq!(accused, [channel]);
        let signal = &config.channels[channel].signal;
        assert!(!ingested.record.is_recorded(signal), "{channel}");
        assert!(
            ingested
                .instruments
                .iter()
                .all(|row| row.channel != channel)
        );
    }
}

#[test]
fn a_fault_beside_a_useless_channel_is_found_all_the_same() {
    let config = config();
    let mut raw = ten_minutes(&config);
    raw.columns.get_mut("altitude").unwrap().values.fill(2e4);
    let theta = &mut raw.columns.get_mut("theta").unwrap().values;
    for value in theta {
        *value = -*value;
    }
    let problem = ingest(&config, &raw, &few_windows(OnFault::Apply)).unwrap_err();
    assert_eq!(problem.place, "channel `theta`", "{problem:?}");
}

#[test]
fn noise_in_a_required_channel_refuses_the_flight() {
    let config = config();
    let raw = ten_minutes(&config);
    let rows = raw.columns["time"].values.len();
    let mut wrong = raw.clone();
    wrong.columns.get_mut("phi").unwrap().values = noise(rows, 0.0, 60.0);
    let problem = ingest(&config, &wrong, &few_windows(OnFault::Apply)).unwrap_err();
    assert!(problem.place.contains("`phi`"), "{problem:?}");
}

/// Fewer windows than by default, for speed.
fn few_windows(fault: OnFault) -> Settings {
    Settings {
        compatibility: Compatibility {
            windows: 8,
            fault,
            ..Compatibility::default()
        },
        ..Settings::default()
    }
}

/// A channel recorded so many samples late; each is 25 ms.
fn delay(raw: &mut RawFlight, channel: &str, samples: usize) {
    let values = &mut raw.columns.get_mut(channel).unwrap().values;
    let before = values.clone();
    for (value, late) in values[samples..].iter_mut().zip(before) {
        *value = late;
    }
}

/// The channels that are named as delayed, each with its delay in s.
fn delayed(ingested: &Ingested) -> Vec<(&str, f64)> {
    let rows = ingested
        .instruments
        .iter()
        .filter(|r| r.verdict.word().contains("delayed by"));
    rows.map(|r| (r.channel.as_str(), r.delay_s.unwrap()))
        .collect()
}

#[test]
fn a_delay_of_a_tenth_of_a_second_is_named_and_the_record_corrected_by_it() {
    let config = config();
    let exact = ten_minutes(&config);
    let settings = few_windows(OnFault::Apply);
    let healthy = ingest(&config, &exact, &settings).unwrap();
    // A late yaw rate alone would make the gross checks accuse the lateral accelerometer.
    for channel in ["r", "alpha_vane"] {
        let mut raw = exact.clone();
        delay(&mut raw, channel, 4);
        let ingested = ingest(&config, &raw, &settings).unwrap();
        let [(named, delay_s)] = delayed(&ingested)[..] else {
            panic!("{:?}", ingested.problems)
        };
        assert_eq!(named, channel);
        assert!((delay_s - 0.1).abs() < 0.01, "{delay_s}");
        assert_eq!(ingested.problems.len(), 1, "{:?}", ingested.problems);
        assert_eq!(ingested.problems[0].place, format!("channel `{channel}`"));
        let signal = &config.channels[channel].signal;
        let (values, before) = (
            ingested.record.values(signal).unwrap(),
            healthy.record.values(signal).unwrap(),
        );
        let apart = |shift: usize| {
            let pairs = values.iter().zip(&before[shift..]).skip(100).take(20_000);
            pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>()
        };
        assert!(apart(0) < apart(1), "{channel} is still late");
    }
}

#[test]
fn delays_of_two_channels_are_both_named() {
    let config = config();
    let mut raw = ten_minutes(&config);
    delay(&mut raw, "theta", 3);
    delay(&mut raw, "beta_vane", 4);
    let ingested = ingest(&config, &raw, &few_windows(OnFault::Apply)).unwrap();
    let named: Vec<&str> = delayed(&ingested).into_iter().map(|d| d.0).collect();
    assert_eq!(named, ["beta_vane", "theta"]);
}

#[test]
fn a_reversed_sign_and_a_delay_in_one_flight_are_both_named() {
    let config = config();
    let mut raw = ten_minutes(&config);
    raw.columns
        .get_mut("an")
        .unwrap()
        .values
        .iter_mut()
        .for_each(|v| *v = -*v);
    delay(&mut raw, "q", 4);
    let problem = ingest(&config, &raw, &few_windows(OnFault::Apply)).unwrap_err();
    assert_eq!(problem.place, "channel `an`");
    assert!(
        problem.reason.contains("its sign is reversed"),
        "{}",
        problem.reason
    );
    assert!(
        problem.reason.contains("`q` is delayed by"),
        "{}",
        problem.reason
    );
}

#[test]
fn a_fault_refuses_the_flight_or_is_only_reported_by_the_settings() {
    let config = config();
    let mut raw = ten_minutes(&config);
    delay(&mut raw, "q", 4);
    let refuse = few_windows(OnFault::Refuse);
    let problem = ingest(&config, &raw, &refuse).unwrap_err();
    assert_eq!(problem.place, "channel `q`");
    let report = few_windows(OnFault::Report);
    let ingested = ingest(&config, &raw, &report).unwrap();
    assert_eq!(ingested.problems.len(), 1);
    let q = ingested
        .instruments
        .iter()
        .find(|r| r.channel == "q")
        .unwrap();
    assert!(
        q.verdict.word().starts_with("delayed by") && !q.applied.contains("delay"),
        "{q:?}"
    );
}

#[test]
fn the_table_has_the_known_errors_of_a_healthy_flight() {
    let config = config();
    let settings = few_windows(OnFault::Apply);
    let mut raw = ten_minutes(&config);
    let before = ingest(&config, &raw, &settings).unwrap().instruments;
    raw.columns
        .get_mut("q")
        .unwrap()
        .values
        .iter_mut()
        .for_each(|v| *v += 0.08);
    raw.columns
        .get_mut("ax")
        .unwrap()
        .values
        .iter_mut()
        .for_each(|v| *v -= 0.01);
    let ingested = ingest(&config, &raw, &settings).unwrap();
    assert_eq!(ingested.problems, []);
    for (channel, bias) in [("q", 0.08), ("ax", -0.01)] {
        let of = |rows: &[harvest::tables::InstrumentRow]| {
            let row = rows.iter().find(|r| r.channel == channel).unwrap();
            (row.bias.unwrap(), row.bias_bound.unwrap())
        };
        let ((with, bound), (without, _)) = (of(&ingested.instruments), of(&before));
        assert!(
            (with - without - bias).abs() < 2.0 * bound,
            "{channel}: {with} after {without}, bound {bound}"
        );
    }
}
