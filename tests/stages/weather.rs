//! Flights in turbulence: the weather is no fault of an instrument, and a wrong sign or unit is still
//! named.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use harvest::config::{Config, Overrides};
use harvest::flight::{Channel, RawFlight};
use harvest::ingest::compatibility::Compatibility;
use harvest::ingest::{self, Ingested, OnFailedCheck, Settings};
use harvest::store::archive;

use crate::lab::cards;
use crate::support::{Campaign, harvest, run};

const DEG: f64 = 57.295_779_5;

/// Gusts of the simulated flights, ft/s: light, moderate and severe.
const GUSTS_FT_S: [f64; 3] = [3.0, 7.0, 15.0];

/// Largest of them that counts as moderate, ft/s.
const MODERATE_FT_S: f64 = 10.0;

/// Flights in turbulence, in the order of [`GUSTS_FT_S`], and the pipeline that reads them.
struct Turbulent {
    config: Config,
    flights: Vec<RawFlight>,
}

fn turbulent() -> &'static Turbulent {
    static TURBULENT: OnceLock<Turbulent> = OnceLock::new();
    TURBULENT.get_or_init(|| {
        let campaign = Campaign::new();
        let (file, out) = (campaign.path("cards.yaml"), campaign.path("simulated"));
        let flights: String = GUSTS_FT_S.iter().enumerate().map(flight).collect();
        fs::write(&file, with_quiet_flight(&cards(&flights))).unwrap();
        let mut simulate = harvest();
        simulate.args(["lab", "simulate"]).arg(&file);
        simulate.arg("--out").arg(&out);
        let outcome = run(&mut simulate);
        assert_eq!(outcome.code, Some(0), "{outcome:?}");
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/harv");
        let config = Config::load(&folder, Overrides::default()).unwrap();
        let found = archive::find(&out.join("flights").to_string_lossy()).unwrap();
        let read = |files| {
            archive::read(files, &config.channels)
                .unwrap()
                .swap_remove(0)
        };
        let flights = found.iter().map(read).collect();
        Turbulent { config, flights }
    })
}

/// Cards that last a minute, so that quiet flight follows each maneuver.
fn with_quiet_flight(cards: &str) -> String {
    let lines = cards
        .lines()
        .map(|line| match line.split_once("duration_s:") {
            Some((before, _)) => format!("{before}duration_s: 60\n"),
            None => format!("{line}\n"),
        });
    lines.collect()
}

/// Cards of a flight of nine minutes: the shorter, the harder is a fault to find.
fn flight((number, sigma_ft_s): (usize, &f64)) -> String {
    format!(
        "
  air_{number}: {{ altitude_ft: 25000, mass_slug: 1050, burnt_slug: 4, turbulence: {{ sigma_ft_s: {sigma_ft_s} }}, points: [
    {{ class: SSIMD_LAT, alpha_deg: [10, 30] }}, {{ class: OLON, alpha_deg: [10, 20] }},
    {{ class: OLAT, alpha_deg: [10, 25] }}, {{ class: PPSS, alpha_deg: [10] }},
    {{ class: PYRS, alpha_deg: [10, 20] }} ] }}"
    )
}

/// Ingests a flight with one channel multiplied by a factor, and reports failed checks.
fn ingested(flight: &RawFlight, channel: &str, factor: f64, reconstruct: bool) -> Ingested {
    let mut wrong = flight.clone();
    let column = wrong.columns.get_mut(channel).unwrap();
    column.values.iter_mut().for_each(|v| *v *= factor);
    let compatibility = Compatibility {
        reconstruct,
        ..Compatibility::default()
    };
    let settings = Settings {
        on_failed_check: OnFailedCheck::Report,
        compatibility,
        ..Settings::default()
    };
    let config = &turbulent().config;
    ingest::record(
        &wrong,
        &config.channels,
        &config.constants,
        &config.aircraft,
        &settings,
    )
    .unwrap()
}

#[test]
fn no_instrument_is_called_wrong_for_the_weather_and_the_gusts_are_measured() {
    for (flight, sigma_ft_s) in turbulent().flights.iter().zip(GUSTS_FT_S) {
        let ingested = ingested(flight, "alpha_vane", 1.0, true);
        assert_eq!(ingested.problems, [], "{sigma_ft_s} ft/s");
        let failed = ingested.checks.iter().filter(|c| !c.verdict.passed());
        assert_eq!(failed.count(), 0, "{sigma_ft_s} ft/s");
        let row = ingested.flight.unwrap();
        for gust in [row.gust_u_ft_s, row.gust_v_ft_s, row.gust_w_ft_s] {
            let ratio = gust.unwrap() / sigma_ft_s;
            assert!((0.7..1.3).contains(&ratio), "{row:?}");
        }
    }
}

/// Faults that are not found, or that are named wrongly: a fault is found in any turbulence. In light
/// and moderate turbulence the channel is named, and no other but `beside`.
fn misnamed(planted: &[(&str, f64)], beside: &[&str]) -> Vec<String> {
    let mut misnamed = Vec::new();
    for (flight, sigma_ft_s) in turbulent().flights.iter().zip(GUSTS_FT_S) {
        for (channel, factor) in planted {
            let rows = ingested(flight, channel, *factor, false).channels;
            let named = rows.iter().filter(|c| !c.verdict.passed());
            let named: Vec<&str> = named.map(|c| c.channel.as_str()).collect();
            let is_named =
                named.contains(channel) && named.iter().all(|n| n == channel || beside.contains(n));
            let is_severe = sigma_ft_s > MODERATE_FT_S;
            if named.is_empty() || !(is_severe || is_named) {
                misnamed.push(format!(
                    "{channel} × {factor} in {sigma_ft_s} ft/s: {named:?}"
                ));
            }
        }
    }
    misnamed
}

#[test]
fn a_reversed_sign_is_named_in_turbulence() {
    let planted = ["theta", "phi", "p", "q", "beta_vane", "an", "ax", "ay"];
    assert_eq!(misnamed(&planted.map(|name| (name, -1.0)), &[]), [""; 0]);
    // The side velocity alone separates yaw rate and heading, and gusts may drown it; the downward
    // velocity alone separates vane and altitude.
    for pair in [["r", "psi"], ["alpha_vane", "altitude"]] {
        assert_eq!(misnamed(&pair.map(|name| (name, -1.0)), &pair), [""; 0]);
    }
}

#[test]
fn a_wrong_unit_is_named_in_turbulence() {
    let radians = ["theta", "phi", "alpha_vane", "beta_vane", "p", "q", "r"];
    assert_eq!(
        misnamed(&radians.map(|name| (name, 1.0 / DEG)), &[]),
        [""; 0]
    );
    let units = [
        ("altitude", 0.3048),
        ("V", 0.3048),
        ("V", 0.5925),
        ("qbar", 47.88),
        ("an", 32.174),
        ("ax", 9.806_65),
        ("ay", 32.174),
    ];
    assert_eq!(misnamed(&units, &[]), [""; 0]);
}

/// Scale of a channel and whether it is corrected, in a demonstration flight on a day with 1.1 times
/// the temperature of the standard atmosphere at the same pressures.
fn scale_on_a_warm_day(channel: &str, temperature_is_recorded: bool) -> (f64, bool) {
    const RATIO: f64 = 1.1;
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut config = Config::load(&root.join("pipelines/harv"), Overrides::default()).unwrap();
    let files = archive::find(&root.join("data/demo/flights").to_string_lossy()).unwrap();
    let of_standard = |altitude_ft: &f64| 288.15 - 0.0065 * 0.3048 * altitude_ft;
    let read = archive::read(&files[0], &config.channels);
    let mut flight = read.unwrap().swap_remove(0);
    let mut air = flight.columns["altitude"].clone();
    air.unit = Some("K".to_owned());
    air.values = air.values.iter().map(|h| RATIO * of_standard(h)).collect();
    for (name, factor) in [("qbar", 1.0 / RATIO), ("mach", RATIO.powf(-0.5))] {
        let column = flight.columns.get_mut(name).unwrap();
        column.values.iter_mut().for_each(|v| *v *= factor);
    }
    flight.columns.insert("OAT".to_owned(), air);
    if temperature_is_recorded {
        let channel = Channel::plain("air_kelvin", "K");
        config.channels.insert("OAT".to_owned(), channel);
    }
    let ingested = ingest::record(
        &flight,
        &config.channels,
        &config.constants,
        &config.aircraft,
        &Settings::default(),
    )
    .unwrap();
    let rows = &ingested.instruments;
    let row = rows.iter().find(|row| row.channel == channel).unwrap();
    (row.scale.unwrap(), row.applied.contains("scale"))
}

#[test]
fn the_recorded_temperature_of_a_warm_day_leaves_air_data_as_they_are() {
    for (channel, scale) in [("qbar", 1.0 / 1.1), ("mach", 1.0 / 1.1_f64.sqrt())] {
        let (found, _) = scale_on_a_warm_day(channel, true);
        assert!((found - 1.0).abs() < 0.02, "{channel}: {found}");
        let (found, is_applied) = scale_on_a_warm_day(channel, false);
        assert!((found - scale).abs() < 0.02, "{channel}: {found}");
        assert!(!is_applied, "{channel}");
    }
}
