//! Ingest on the demonstration flights: what is repaired, and which channel is named when one is made wrong.

#![expect(clippy::expect_used, reason = "a test that cannot read the demonstration has nothing to say")]

use std::collections::BTreeMap;
use std::path::Path;

use harvest::aircraft::{Aircraft, Position, Sensors, Vane, VaneModel};
use harvest::flight::{Channel, RawFlight};
use harvest::ingest::{self, Ingested, Settings};
use harvest::store::archive;

/// Column, signal and unit of the demonstration's recorder (`data/demo/channels.csv`).
const CHANNELS: &[(&str, &str, &str)] = &[
    ("time", "time_s", "s"),
    ("alpha_vane", "alpha_vane_deg", "deg"),
    ("beta_vane", "beta_vane_deg", "deg"),
    ("V", "velocity_ft_s", "ft/s"),
    ("mach", "mach", "-"),
    ("altitude", "altitude_ft", "ft"),
    ("p", "p_deg_s", "deg/s"),
    ("q", "q_deg_s", "deg/s"),
    ("r", "r_deg_s", "deg/s"),
    ("theta", "theta_deg", "deg"),
    ("phi", "phi_deg", "deg"),
    ("psi", "psi_deg", "deg"),
    ("an", "an_g", "g"),
    ("ax", "ax_g", "g"),
    ("ay", "ay_g", "g"),
    ("qbar", "qbar_psf", "lbf/ft2"),
    ("de", "de_deg", "deg"),
    ("rpm_l", "left_rpm", "rpm"),
    ("rpm_r", "right_rpm", "rpm"),
    ("thrust", "thrust_lbf", "lbf"),
    ("mass", "mass_slug", "slug"),
    ("xcg", "x_cg_ft", "ft"),
    ("ycg", "y_cg_ft", "ft"),
    ("zcg", "z_cg_ft", "ft"),
    ("Ix", "ix_slug_ft2", "slug ft2"),
    ("Iy", "iy_slug_ft2", "slug ft2"),
    ("Iz", "iz_slug_ft2", "slug ft2"),
    ("Ixz", "ixz_slug_ft2", "slug ft2"),
    ("obes", "obes", "0/1"),
];

const DEG: f64 = 57.295_779_5;

fn channels() -> BTreeMap<String, Channel> {
    let channel = |(name, signal, unit): &(&str, &str, &str)| {
        let wraps_at = (*name == "psi").then_some(360.0);
        let channel =
            Channel { signal: (*signal).to_owned(), unit: (*unit).to_owned(), sign: 1.0, scale: 1.0, wraps_at };
        ((*name).to_owned(), channel)
    };
    CHANNELS.iter().map(channel).collect()
}

/// `data/demo/aircraft.json`.
fn aircraft() -> Aircraft {
    let at = |x_ft, y_ft, z_ft| Position { x_ft, y_ft, z_ft };
    Aircraft {
        name: "demonstration".to_owned(),
        wing_area_ft2: 400.0,
        span_ft: 37.42,
        chord_ft: 11.52,
        engine_inertia_slug_ft2: 3.0,
        latitude_deg: 35.0,
        sensors: Sensors {
            an: at(31.3, -0.25, 6.9),
            ax: at(31.4, -0.1, 6.95),
            ay: at(31.45, 0.1, 6.85),
            alpha_vane: Vane { x_ft: 35.4, y_ft: 19.2, z_ft: 7.9, factor: 1.02 },
            beta_vane: Vane { x_ft: 35.4, y_ft: -19.2, z_ft: 7.9, factor: 0.98 },
            vane_model: VaneModel::Exact,
            thrust_in_ax: true,
        },
    }
}

fn flights() -> Vec<RawFlight> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/demo/flights");
    let found = archive::find(&folder.display().to_string()).expect("the demonstration");
    found.iter().map(|files| archive::read(files, &channels()).expect("a flight")).collect()
}

fn ingest(raw: &RawFlight, settings: &Settings) -> Ingested {
    ingest::record(raw, &channels(), &BTreeMap::new(), &aircraft(), settings).expect("a record")
}

#[test]
fn every_demonstration_flight_passes_its_checks_and_is_repaired() {
    let flights = flights();
    assert_eq!(flights.len(), 4);
    for raw in &flights {
        let ingested = ingest(raw, &Settings::default());
        assert_eq!(ingested.problems, [], "{}", raw.flight_id);
        assert_eq!(ingested.checks.len(), 12);
        for check in &ingested.checks {
            let weak = check.relation.contains("lateral acceleration") && check.verdict == "not excited";
            assert!(weak || check.verdict == "ok", "{}: {check:?}", raw.flight_id);
        }
        let lost = ingested.record.samples - raw.columns["time"].values.len();
        assert!(lost < 30, "{lost} lost frames");
        for row in &ingested.channels {
            assert_eq!(row.missing, 0, "{row:?}");
            assert!(row.bridged >= lost && row.bridged < 150, "{row:?}");
            assert!(row.despiked <= 12, "{row:?}");
        }
        let heading = ingested.record.values("psi_deg").expect("psi");
        assert!(heading.windows(2).all(|p| (p[1] - p[0]).abs() < 10.0), "a heading that wraps");
    }
}

/// Ten minutes of the second flight.
fn ten_minutes() -> RawFlight {
    let mut raw = flights().swap_remove(1);
    raw.columns.values_mut().for_each(|c| c.values.truncate(24_000));
    raw
}

/// Each channel multiplied by its factor is accused and no other.
fn each_is_named_alone(planted: &[(&str, f64)]) {
    let raw = ten_minutes();
    let settings = Settings { on_failed_check: ingest::OnFailedCheck::Report, ..Settings::default() };
    for (channel, factor) in planted {
        let mut wrong = raw.clone();
        let column = wrong.columns.get_mut(*channel).expect("a channel");
        column.values.iter_mut().for_each(|v| *v *= factor);
        let rows = ingest(&wrong, &settings).channels;
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
    let mut raw = ten_minutes();
    raw.columns.get_mut("q").expect("q").values.iter_mut().for_each(|v| *v /= DEG);
    let refused = ingest::record(&raw, &channels(), &BTreeMap::new(), &aircraft(), &Settings::default());
    let problem = refused.expect_err("refused");
    assert_eq!((problem.flight_id.as_str(), problem.place.as_str()), ("flight_002", "channel `q`"));
    assert!(problem.reason.contains("theta rate against q and r: slope "), "{}", problem.reason);
    assert!(problem.reason.contains("it is recorded in rad/s, not in deg/s"), "{}", problem.reason);
}
