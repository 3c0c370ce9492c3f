//! One flight through ingest: steady level flight, and everything that can be wrong with its channels.

use approx::assert_relative_eq;

use super::*;
use crate::aircraft::{Position, Sensors, Vane, VaneModel};
use crate::flight::channel::RawColumn;
use crate::units::DEG;

const ROWS: usize = 2000;
const STEP_S: f64 = 0.025;

fn aircraft() -> Aircraft {
    let at = Position { x_ft: 30.0, y_ft: 0.0, z_ft: 8.0 };
    let vane = Vane { x_ft: 30.0, y_ft: 0.0, z_ft: 8.0, factor: 1.0 };
    Aircraft {
        name: "steady".to_owned(),
        wing_area_ft2: 400.0,
        span_ft: 37.4,
        chord_ft: 11.5,
        engine_inertia_slug_ft2: 3.0,
        latitude_deg: 35.0,
        sensors: Sensors {
            an: at,
            ax: at,
            ay: at,
            alpha_vane: vane,
            beta_vane: vane,
            vane_model: VaneModel::Exact,
            thrust_in_ax: true,
        },
    }
}

/// Name, signal, unit and value of every channel of steady level flight at 20,000 ft and 600 ft/s with α 20°.
fn steady() -> Vec<(&'static str, &'static str, &'static str, f64)> {
    let (sin, cos) = (20.0 / DEG).sin_cos();
    let mut channels = vec![
        ("alpha", signal::ALPHA_VANE, "deg", 20.0),
        ("V", signal::VELOCITY, "ft/s", 600.0),
        ("theta", signal::THETA, "deg", 20.0),
        ("an", signal::AN, "g", 0.997 * cos),
        ("ax", signal::AX, "g", 0.997 * sin),
        ("altitude", signal::ALTITUDE, "ft", 20_000.0),
        ("qbar", signal::QBAR, "psf", 0.5 * 1.2673e-3 * 600.0 * 600.0),
        ("mach", signal::MACH, "-", 600.0 / 1036.9),
        ("psi", signal::PSI, "deg", 120.0),
        ("de", "de_deg", "deg", -2.0),
        ("flag", "obes", "0/1", 0.0),
    ];
    let given: Vec<&str> = channels.iter().map(|c| c.1).collect();
    let zero = signal::REQUIRED.iter().filter(|s| !given.contains(s));
    let zero: Vec<_> = zero.map(|s| (*s, *s, crate::units::Unit::of_signal(s).name, 0.0)).collect();
    channels.extend(zero);
    channels
}

struct Flight {
    raw: RawFlight,
    channels: BTreeMap<String, Channel>,
    constants: BTreeMap<String, f64>,
    settings: Settings,
}

impl Flight {
    fn steady() -> Flight {
        let mut raw = RawFlight { flight_id: "007".to_owned(), columns: BTreeMap::new() };
        let mut channels = BTreeMap::new();
        let mut add = |name: &str, signal: &str, unit: &str, values: Vec<f64>| {
            raw.columns.insert(name.to_owned(), RawColumn { unit: Some(unit.to_owned()), values });
            let (signal, unit) = (signal.to_owned(), unit.to_owned());
            channels.insert(name.to_owned(), Channel { signal, unit, sign: 1.0, scale: 1.0, wraps_at: None });
        };
        add("time", TIME, "s", (0..ROWS).map(|k| k as f64 * STEP_S).collect());
        for (name, signal, unit, value) in steady() {
            add(name, signal, unit, vec![value; ROWS]);
        }
        Flight { raw, channels, constants: BTreeMap::new(), settings: Settings::default() }
    }

    fn values(&mut self, name: &str) -> &mut Vec<f64> {
        &mut self.raw.columns.get_mut(name).unwrap().values
    }

    fn channel(&mut self, name: &str) -> &mut Channel {
        self.channels.get_mut(name).unwrap()
    }

    fn ingest(&self) -> Result<Ingested, Problem> {
        record(&self.raw, &self.channels, &self.constants, &aircraft(), &self.settings)
    }

    fn refused(&self) -> Problem {
        self.ingest().expect_err("refused")
    }
}

fn verdict(ingested: &Ingested, channel: &str) -> String {
    ingested.channels.iter().find(|c| c.channel == channel).unwrap().verdict.clone()
}

#[test]
fn steady_flight_is_a_record_without_problems() {
    let ingested = Flight::steady().ingest().unwrap();
    assert_eq!(ingested.problems, []);
    let record = &ingested.record;
    assert_eq!((record.flight_id.as_str(), record.samples), ("007", ROWS));
    assert_relative_eq!(record.step_s, STEP_S, max_relative = 1e-12);
    assert_eq!(record.signals.len(), steady().len());
    assert_eq!(verdict(&ingested, "an"), "ok");
    assert_eq!(verdict(&ingested, "V"), "ok");
    assert_eq!(verdict(&ingested, "q_deg_s"), "not checked");
    let rate = ingested.checks.iter().find(|c| c.relation == "theta rate against q and r").unwrap();
    assert_eq!((rate.slope, rate.verdict.as_str()), (None, "not excited"));
}

#[test]
fn unit_sign_and_scale_are_those_of_the_channel_map() {
    let mut flight = Flight::steady();
    let alpha = flight.channel("alpha");
    (alpha.unit, alpha.sign, alpha.scale) = ("rad".to_owned(), -1.0, 2.0);
    flight.raw.columns.get_mut("alpha").unwrap().unit = Some("rad".to_owned());
    flight.values("alpha").fill(-10.0 / DEG);
    let ingested = flight.ingest().unwrap();
    assert_relative_eq!(ingested.record.values(signal::ALPHA_VANE).unwrap()[5], 20.0, max_relative = 1e-12);
    assert_eq!(ingested.problems, []);
}

#[test]
fn a_unit_in_the_file_that_is_not_the_channel_map_s_is_refused_naming_both() {
    let mut flight = Flight::steady();
    flight.raw.columns.get_mut("theta").unwrap().unit = Some("rad".to_owned());
    let problem = flight.refused();
    assert_eq!((problem.stage.as_str(), problem.flight_id.as_str()), ("ingest", "007"));
    assert_eq!(problem.place, "channel `theta`");
    assert!(problem.reason.contains("the file states `rad` for channel `theta`, the channel map `deg`"));
    flight.raw.columns.get_mut("theta").unwrap().unit = None;
    assert!(flight.ingest().is_ok());
}

#[test]
fn a_missing_or_empty_required_channel_refuses_the_flight_unless_a_constant_stands_in() {
    let mut flight = Flight::steady();
    flight.raw.columns.remove("V");
    assert_eq!(flight.refused().reason, "channel `V` (signal `velocity_ft_s`) is not in the file");
    flight.constants.insert(signal::VELOCITY.to_owned(), 600.0);
    let ingested = flight.ingest().unwrap();
    assert_eq!(ingested.record.values(signal::VELOCITY).unwrap(), [600.0; ROWS]);
    assert_eq!(ingested.problems.len(), 1);

    let mut flight = Flight::steady();
    flight.values("qbar").fill(f64::NAN);
    assert_eq!(flight.refused().reason, "channel `qbar` (signal `qbar_psf`) holds no number in 2000 rows");

    let mut flight = Flight::steady();
    flight.channels.remove("mach");
    assert!(flight.refused().reason.starts_with("signal `mach` is neither a channel nor a constant"));
}

#[test]
fn another_missing_or_empty_channel_is_a_problem_and_the_rest_goes_on() {
    let mut flight = Flight::steady();
    flight.raw.columns.remove("de");
    flight.values("psi").fill(f64::NAN);
    let ingested = flight.ingest().unwrap();
    let places: Vec<&str> = ingested.problems.iter().map(|p| p.place.as_str()).collect();
    assert_eq!(places, ["channel `de`", "channel `psi`"]);
    assert!(ingested.record.values("de_deg").is_none());
    assert!(ingested.checks.iter().all(|c| !c.relation.starts_with("psi rate")));
}

#[test]
fn time_backwards_standing_still_or_absent_is_refused_and_named() {
    let mut flight = Flight::steady();
    flight.values("time")[100] = 1.0;
    let problem = flight.refused();
    assert_eq!(problem.place, "channel `time`");
    assert!(problem.reason.starts_with("time runs backwards in row 101: from 2.4750 s to 1.0000 s"));
    flight.values("time")[100] = 2.475;
    assert!(flight.refused().reason.starts_with("time stands still in row 101 at 2.4750 s"));
    flight.raw.columns.remove("time");
    assert!(flight.refused().reason.contains("is not in the file"));
    flight.channels.remove("time");
    assert!(flight.refused().reason.contains("has no clock"));
}

#[test]
fn a_signal_with_two_channels_and_a_unit_of_another_quantity_are_refused() {
    let mut flight = Flight::steady();
    flight.channel("de").signal = signal::THETA.to_owned();
    assert!(flight.refused().reason.contains("both mapped to signal `theta_deg`"));
    let mut flight = Flight::steady();
    flight.channel("theta").unit = "ft".to_owned();
    flight.raw.columns.get_mut("theta").unwrap().unit = None;
    assert!(flight.refused().reason.contains("is in deg, which `ft` does not convert to"));
}

#[test]
fn dropouts_spikes_and_lost_frames_are_repaired_marked_and_counted() {
    let mut flight = Flight::steady();
    flight.values("V")[50..54].fill(f64::NAN);
    flight.values("V")[200..300].fill(f64::NAN);
    flight.values("V")[1000] = 900.0;
    for column in flight.raw.columns.values_mut() {
        column.values.drain(1500..1503);
    }
    let ingested = flight.ingest().unwrap();
    assert_eq!(ingested.record.samples, ROWS);
    let velocity = &ingested.record.signals[signal::VELOCITY];
    assert_eq!((velocity.marks[51], velocity.values[51]), (Mark::Bridged, 600.0));
    assert_eq!((velocity.marks[250], velocity.values[250].is_nan()), (Mark::Missing, true));
    assert_eq!((velocity.marks[1000], velocity.values[1000]), (Mark::Despiked, 600.0));
    assert_eq!((velocity.marks[1501], velocity.values[1501]), (Mark::Bridged, 600.0));
    let row = ingested.channels.iter().find(|c| c.channel == "V").unwrap();
    assert_eq!((row.bridged, row.despiked, row.missing), (7, 1, 100));
}

#[test]
fn a_flag_is_never_despiked_and_holds_its_last_value() {
    let mut flight = Flight::steady();
    flight.values("flag")[700] = 1.0;
    flight.values("flag")[800..].fill(1.0);
    flight.values("flag")[796..800].fill(f64::NAN);
    let flag = flight.ingest().unwrap().record.signals["obes"].clone();
    assert_eq!((flag.values[700], flag.marks[700]), (1.0, Mark::Measured));
    assert_eq!((flag.values[799], flag.marks[799], flag.values[800]), (0.0, Mark::Bridged, 1.0));
}

#[test]
fn a_wrong_channel_refuses_the_flight_or_is_reported_as_the_settings_say() {
    let mut flight = Flight::steady();
    flight.values("an").iter_mut().for_each(|v| *v = -*v);
    let problem = flight.refused();
    assert_eq!(problem.place, "channel `an`");
    assert!(problem.reason.contains("slope -1.00"), "{}", problem.reason);
    assert!(problem.reason.contains("its sign is reversed"), "{}", problem.reason);
    flight.settings.on_failed_check = OnFailedCheck::Report;
    let ingested = flight.ingest().unwrap();
    assert_eq!(ingested.problems, [problem]);
    assert_eq!(verdict(&ingested, "an"), "its sign is reversed");
}

#[test]
fn a_channel_of_nothing_but_zeros_is_among_those_that_never_change() {
    let mut flight = Flight::steady();
    flight.values("an").fill(0.0);
    let problem = flight.refused();
    assert!(problem.place.contains("`an`"), "{}", problem.place);
    assert!(problem.reason.contains("`an`: it never changes"), "{}", problem.reason);
}
