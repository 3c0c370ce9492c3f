//! One flight through ingest: steady level flight, and everything that can be wrong with its
//! channels.

use approx::assert_relative_eq;

use super::compatibility::Compatibility;
use super::*;
use crate::aircraft::Aircraft;
use crate::aircraft::{Position, Sensors, Vane, VaneModel};
use crate::error::{Problem, ProblemStage};
use crate::flight::channel::RawColumn;
use crate::flight::formula::Operand;
use crate::flight::record::Series;
use crate::flight::signal::TIME;
use crate::flight::{Channel, Formula, LinearTable, Mark, RawFlight, signal};
use crate::tables::{ChannelVerdict, CheckVerdict};
use crate::units::DEG;
use std::collections::BTreeMap;

const ROWS: usize = 2000;
const STEP_S: f64 = 0.025;

fn aircraft() -> Aircraft {
    let at = Position {
        x_ft: 30.0,
        y_ft: 0.0,
        z_ft: 8.0,
    };
    let vane = Vane {
        x_ft: 30.0,
        y_ft: 0.0,
        z_ft: 8.0,
        factor: 1.0,
    };
    Aircraft {
        name: "steady".to_owned(),
        wing_area_ft2: 400.0,
        span_ft: 37.4,
        chord_ft: 11.5,
        engine_inertia_slug_ft2: 3.0,
        thrust_line: None,
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

/// Name, signal, unit and value of every channel of steady level flight at 20,000 ft and 600 ft/s
/// with α 20°.
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
    channels.extend([
        ("mass", signal::MASS, "slug", 3000.0),
        ("Ix", signal::IX, "slug ft2", 23_000.0),
        ("Iy", signal::IY, "slug ft2", 151_000.0),
        ("Iz", signal::IZ, "slug ft2", 170_000.0),
        ("Ixz", signal::IXZ, "slug ft2", -2000.0),
    ]);
    let given: Vec<&str> = channels.iter().map(|c| c.1).collect();
    let zero = signal::REQUIRED.iter().filter(|s| !given.contains(s));
    let zero: Vec<_> = zero
        .map(|s| (*s, *s, crate::units::Unit::of_signal(s).name, 0.0))
        .collect();
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
        let mut raw = RawFlight {
            flight_id: "007".to_owned(),
            columns: BTreeMap::new(),
        };
        let mut channels = BTreeMap::new();
        let mut add = |name: &str, signal: &str, unit: &str, values: Vec<f64>| {
            raw.columns.insert(
                name.to_owned(),
                RawColumn {
                    unit: Some(unit.to_owned()),
                    values,
                },
            );
            let (signal, unit) = (signal.to_owned(), unit.to_owned());
            channels.insert(name.to_owned(), Channel::plain(&signal, &unit));
        };
        add(
            "time",
            TIME,
            "s",
            (0..ROWS).map(|k| k as f64 * STEP_S).collect(),
        );
        for (name, signal, unit, value) in steady() {
            add(name, signal, unit, vec![value; ROWS]);
        }
        // The errors of the instruments have separate tests, which take longer than all of these.
        let compatibility = Compatibility {
            reconstruct: false,
            ..Compatibility::default()
        };
        let settings = Settings {
            compatibility,
            ..Settings::default()
        };
        Flight {
            raw,
            channels,
            constants: BTreeMap::new(),
            settings,
        }
    }

    fn values(&mut self, name: &str) -> &mut Vec<f64> {
        &mut self.raw.columns.get_mut(name).unwrap().values
    }

    fn channel(&mut self, name: &str) -> &mut Channel {
        self.channels.get_mut(name).unwrap()
    }

    /// Every channel noisy, each with noise of its own, so that all rows differ.
    fn noisy() -> Flight {
        let mut flight = Flight::steady();
        let mut state = 1_u64;
        for (name, column) in flight
            .raw
            .columns
            .iter_mut()
            .filter(|(name, _)| *name != "time")
        {
            let flag = name == "flag";
            for value in column.values.iter_mut().filter(|_| !flag) {
                let mut sum = 0.0;
                for _ in 0..4 {
                    state = state
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1_442_695_040_888_963_407);
                    sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
                }
                *value += 0.01 * ((sum - 2.0) * 20.0).round() / 10.0;
            }
        }
        flight
    }

    /// Another file of the flight: some of its rows.
    fn part(&self, rows: std::ops::Range<usize>) -> RawFlight {
        let mut part = self.raw.clone();
        part.columns
            .values_mut()
            .for_each(|c| c.values = c.values[rows.clone()].to_vec());
        part
    }

    fn of_files(&self, files: &[RawFlight], piece: usize) -> Vec<Ingested> {
        let aircraft = aircraft();
        let context = Context {
            channels: &self.channels,
            constants: &self.constants,
            aircraft: &aircraft,
            settings: &self.settings,
        };
        records(files, &context, piece)
            .unwrap()
            .into_iter()
            .map(Result::unwrap)
            .collect()
    }

    fn ingest(&self) -> Result<Ingested, Problem> {
        record(
            &self.raw,
            &self.channels,
            &self.constants,
            &aircraft(),
            &self.settings,
        )
    }

    fn refused(&self) -> Problem {
        self.ingest().expect_err("refused")
    }
}

fn verdict(ingested: &Ingested, channel: &str) -> ChannelVerdict {
    ingested
        .channels
        .iter()
        .find(|c| c.channel == channel)
        .unwrap()
        .verdict
        .clone()
}

#[test]
fn steady_flight_is_a_record_without_problems() {
    let ingested = Flight::steady().ingest().unwrap();
    assert_eq!(ingested.problems, []);
    let record = &ingested.record;
    assert_eq!((record.flight_id.as_str(), record.samples), ("007", ROWS));
    assert_relative_eq!(record.step_s, STEP_S, max_relative = 1e-12);
    assert_eq!(record.signals.len(), steady().len());
    assert_eq!(verdict(&ingested, "an"), ChannelVerdict::Ok);
    assert_eq!(verdict(&ingested, "V"), ChannelVerdict::Ok);
    assert_eq!(verdict(&ingested, "q_deg_s"), ChannelVerdict::NotChecked);
    let rate = ingested
        .checks
        .iter()
        .find(|c| c.relation == "theta rate against q and r")
        .unwrap();
    assert_eq!((rate.slope, rate.verdict), (None, CheckVerdict::NotExcited));
}

#[test]
fn unit_sign_and_scale_are_those_of_the_channel_map() {
    let mut flight = Flight::steady();
    let alpha = flight.channel("alpha");
    (alpha.unit, alpha.sign, alpha.scale) = ("rad".to_owned(), -1.0, 2.0);
    flight.raw.columns.get_mut("alpha").unwrap().unit = Some("rad".to_owned());
    flight.values("alpha").fill(-10.0 / DEG);
    let ingested = flight.ingest().unwrap();
    assert_relative_eq!(
        ingested.record.values(signal::ALPHA_VANE).unwrap()[5],
        20.0,
        max_relative = 1e-12
    );
    assert_eq!(ingested.problems, []);
}

#[test]
fn a_unit_in_the_file_that_harvest_does_not_have_says_nothing_and_a_load_factor_is_in_g() {
    let mut flight = Flight::steady();
    let unit = |flight: &mut Flight, column: &str, unit: &str| {
        flight.raw.columns.get_mut(column).unwrap().unit = Some(unit.to_owned());
    };
    unit(&mut flight, "theta", "Altgrad");
    unit(&mut flight, "an", "-");
    assert_eq!(flight.ingest().unwrap().problems, []);
    // A calibrated airspeed is none.
    unit(&mut flight, "V", "KCAS");
    assert!(flight.refused().reason.contains("the file states `KCAS`"));
}

#[test]
fn fill_values_count_as_missing_and_are_named() {
    let mut flight = Flight::steady();
    flight.values("theta")[40..43].fill(-9_999.0);
    let ingested = flight.ingest().unwrap();
    let [problem] = &ingested.problems[..] else {
        panic!("{:?}", ingested.problems)
    };
    assert_eq!(problem.stage, ProblemStage::Recording);
    let words = "3 samples are fill values such as -9999";
    assert!(problem.reason.contains(words), "{}", problem.reason);
    let theta = ingested.record.values(signal::THETA).unwrap();
    assert!(theta.iter().all(|value| value.abs() < 90.0));
}

#[test]
fn a_unit_in_the_file_that_is_not_the_channel_map_s_is_refused_naming_both() {
    let mut flight = Flight::steady();
    flight.raw.columns.get_mut("theta").unwrap().unit = Some("rad".to_owned());
    let problem = flight.refused();
    assert_eq!(
        (problem.stage, problem.flight_id.as_str()),
        (ProblemStage::Ingest, "007")
    );
    assert_eq!(problem.place, "channel `theta`");
    assert!(
        problem
            .reason
            .contains("the file states `rad` for channel `theta`, the channel map `deg`")
    );
    flight.raw.columns.get_mut("theta").unwrap().unit = None;
    assert!(flight.ingest().is_ok());
}

#[test]
fn a_channel_that_nothing_requires_is_left_out_by_name() {
    let mut flight = Flight::steady();
    for name in ["psi", "mach"] {
        flight.raw.columns.get_mut(name).unwrap().unit = Some("kg".to_owned());
    }
    let ingested = flight.ingest().unwrap();
    let reasons: Vec<&str> = ingested
        .problems
        .iter()
        .map(|p| p.reason.as_str())
        .collect();
    assert_eq!(reasons.len(), 2, "{reasons:?}");
    assert!(
        reasons[0].contains("`mach` is computed from V"),
        "{reasons:?}"
    );
    assert!(reasons[1].contains("larger bounds"), "{reasons:?}");
    assert!(!ingested.record.is_recorded(signal::MACH));
    assert!(!ingested.record.signals.contains_key(signal::PSI));
}

#[test]
fn a_stated_unit_that_contradicts_the_map_costs_no_flight_where_nothing_requires_the_signal() {
    let mut flight = Flight::steady();
    for name in ["altitude", "de"] {
        flight.raw.columns.get_mut(name).unwrap().unit = Some("kg".to_owned());
    }
    let ingested = flight.ingest().unwrap();
    let places: Vec<&str> = ingested.problems.iter().map(|p| p.place.as_str()).collect();
    assert_eq!(places, ["channel `altitude`", "channel `de`"]);
    assert!(!ingested.record.is_recorded(signal::ALTITUDE));
    let altitude = ingested.record.values(signal::ALTITUDE).unwrap()[5];
    assert_relative_eq!(altitude, 20_000.0, max_relative = 1e-3);
    // Without the dynamic pressure the altitude is required.
    flight.raw.columns.remove("qbar");
    let refused = flight.refused();
    assert_eq!(refused.place, "channel `altitude`, channel `qbar`");
    assert!(refused.reason.contains("`kg`"), "{refused:?}");
}

#[test]
fn a_replaceable_channel_without_values_in_most_samples_is_left_out() {
    let mut flight = Flight::noisy();
    flight.values("mach")[..ROWS * 3 / 4].fill(f64::NAN);
    flight.values("theta")[..ROWS * 3 / 4].fill(f64::NAN);
    let ingested = flight.ingest().unwrap();
    let [problem] = &ingested.problems[..] else {
        panic!("{:?}", ingested.problems)
    };
    assert_eq!(problem.place, "channel `mach`");
    assert!(problem.reason.contains("25.0 %"), "{problem:?}");
    assert!(ingested.record.values(signal::MACH).unwrap()[5].is_finite());
    assert!(ingested.record.values(signal::THETA).unwrap()[5].is_nan());
}

#[test]
fn a_recorder_that_was_off_most_of_the_time_costs_no_channel() {
    let mut flight = Flight::noisy();
    let (on, off) = (ROWS / 4, 4 * ROWS);
    for (row, time) in flight.values("time").iter_mut().enumerate() {
        *time += (row / on * off) as f64 * STEP_S;
    }
    let ingested = flight.ingest().unwrap();
    assert_eq!(reasons(&ingested), Vec::<&str>::new());
    assert_eq!(ingested.record.samples, ROWS + 3 * off);
    assert!(ingested.record.is_recorded(signal::MACH));
}

/// A flight in which some channels end after most of the time.
fn with_channels_that_end(names: &[&str]) -> Flight {
    let mut flight = Flight::noisy();
    for name in names {
        flight.values(name)[CHANNEL_END..].fill(f64::NAN);
    }
    flight
}

/// First sample without a value of a channel that ends.
const CHANNEL_END: usize = ROWS * 3 / 5;

#[test]
fn a_channel_that_ends_has_its_stand_in_from_there_on_and_one_problem() {
    for name in ["mach", "altitude", "Ixz"] {
        let whole = Flight::noisy().ingest().unwrap();
        let flight = with_channels_that_end(&[name]);
        let signal = flight.channels[name].signal.clone();
        let ingested = flight.ingest().unwrap();
        let [problem] = &ingested.problems[..] else {
            panic!("{name}: {:?}", ingested.problems)
        };
        assert_eq!(problem.place, format!("channel `{name}`"));
        assert_eq!(problem.stage, ProblemStage::Recording);
        assert!(
            problem.reason.contains("no value in 20.0 of 50.0 s"),
            "{problem:?}"
        );
        let own = &ingested.record.signals[&signal];
        let before = whole.record.values(&signal).unwrap();
        assert_eq!(
            own.values[..CHANNEL_END - 10],
            before[..CHANNEL_END - 10],
            "{name}"
        );
        for k in [CHANNEL_END, ROWS - 1] {
            assert_eq!(own.marks[k], Mark::Assumed, "{name} at {k}");
            assert_relative_eq!(own.values[k], before[k], max_relative = 0.05);
        }
    }
}

#[test]
fn channels_that_end_together_are_computed_from_those_that_go_on() {
    let ingested = with_channels_that_end(&["mach", "altitude"])
        .ingest()
        .unwrap();
    let places: Vec<&str> = ingested.problems.iter().map(|p| p.place.as_str()).collect();
    assert_eq!(places, ["channel `altitude`", "channel `mach`"]);
    for signal in [signal::MACH, signal::ALTITUDE] {
        let values = ingested.record.values(signal).unwrap();
        assert!(values.iter().all(|v| v.is_finite()), "{signal}");
    }
    // Nothing stands for the angle of attack, and a state is not assumed in a gap.
    let ingested = with_channels_that_end(&["alpha", "theta"])
        .ingest()
        .unwrap();
    for signal in [signal::ALPHA_VANE, signal::THETA] {
        assert!(
            ingested.record.values(signal).unwrap()[ROWS - 1].is_nan(),
            "{signal}"
        );
    }
}

/// A flight whose inertia about x is a table over fuel that burns from 300 kg to 100 kg.
fn with_inertia_over(at: [f64; 2]) -> Flight {
    let mut flight = Flight::steady();
    let table = LinearTable::new(at.to_vec(), vec![30_000.0, 34_000.0]).unwrap();
    let fuel = |column: &str| {
        Ok(Operand {
            column: column.to_owned(),
            unit: "kg".to_owned(),
            factor: 1.0,
        })
    };
    let inertia = flight.channel("Ix");
    inertia.unit = "kg m2".to_owned();
    inertia.formula = Some(Formula::over("FUEL", "kg", table, fuel).unwrap());
    flight.raw.columns.remove("Ix");
    let burnt = |k: usize| 300.0 - 200.0 * k as f64 / (ROWS - 1) as f64;
    let column = RawColumn {
        unit: Some("kg".to_owned()),
        values: (0..ROWS).map(burnt).collect(),
    };
    flight.raw.columns.insert("FUEL".to_owned(), column);
    flight
}

#[test]
fn an_inertia_follows_its_table_over_fuel() {
    let ingested = with_inertia_over([0.0, 400.0]).ingest().unwrap();
    assert_eq!(ingested.problems, []);
    let inertia = ingested.record.values(signal::IX).unwrap();
    // A slug ft² is 1.3558179 kg m².
    for (sample, kg_m2) in [(0, 33_000.0), (ROWS - 1, 31_000.0)] {
        assert_relative_eq!(inertia[sample], kg_m2 / 1.355_817_9, max_relative = 1e-6);
    }
}

#[test]
fn a_table_that_a_flight_never_enters_is_a_problem_and_costs_no_flight() {
    let ingested = with_inertia_over([0.0, 50.0]).ingest().unwrap();
    let [problem] = &ingested.problems[..] else {
        panic!("{:?}", ingested.problems)
    };
    assert_eq!(problem.place, "channel `Ix`");
    assert!(
        problem.reason.contains("`FUEL` is outside 0 to 50 kg"),
        "{problem:?}"
    );
    // Half of the flight is in the table: the rest is at its end.
    let half = with_inertia_over([200.0, 400.0]).ingest().unwrap();
    assert_eq!(half.problems, []);
}

#[test]
fn a_missing_or_empty_required_channel_refuses_the_flight_unless_a_constant_stands_in() {
    let mut flight = Flight::steady();
    flight.raw.columns.remove("V");
    flight.constants.insert(signal::VELOCITY.to_owned(), 600.0);
    let ingested = flight.ingest().unwrap();
    assert_eq!(
        ingested.record.values(signal::VELOCITY).unwrap(),
        [600.0; ROWS]
    );
    assert_eq!(ingested.problems.len(), 1);

    let mut flight = Flight::steady();
    flight.values("alpha").fill(f64::NAN);
    let reason = flight.refused().reason;
    let cause = "channel `alpha` (signal `alpha_vane_deg`) holds no number in 2000 rows. Where the";
    assert!(reason.starts_with(cause), "{reason}");

    let mut flight = Flight::steady();
    flight.constants.remove(signal::MASS);
    flight
        .channels
        .retain(|_, channel| channel.signal != signal::MASS);
    assert!(
        flight
            .refused()
            .reason
            .starts_with("signal `mass_slug` is neither a channel nor a constant")
    );
}

#[test]
fn all_absent_channels_that_refuse_a_flight_are_named_at_once_with_the_advice() {
    let mut flight = Flight::steady();
    for channel in ["mass", "Iy", "psi"] {
        flight.raw.columns.remove(channel);
    }
    let refused = flight.refused();
    assert_eq!(refused.stage, ProblemStage::Ingest);
    assert_eq!(refused.place, "channel `mass`, channel `Iy`");
    for words in [
        "channel `mass` (signal `mass_slug`) is not in the file; channel `Iy`",
        "replace their lines in the channel map: give each a line under `channels`",
        "under `constants` (`mass_slug: 1000`, `iy_slug_ft2: 20000`)",
    ] {
        assert!(refused.reason.contains(words), "{}", refused.reason);
    }
    assert!(!refused.reason.contains("psi"), "{}", refused.reason);
}

#[test]
fn an_absence_is_no_rejection_and_a_channel_in_another_unit_is() {
    let mut flight = Flight::steady();
    flight.raw.columns.remove("psi");
    flight.values("left_rpm").fill(f64::NAN);
    let absent = flight.ingest().unwrap();
    let stages: Vec<ProblemStage> = absent.problems.iter().map(|p| p.stage).collect();
    assert_eq!(stages, [ProblemStage::Recording; 2]);
    assert!(absent.problems.iter().all(|p| !p.stage.is_rejection()));
    let mut flight = Flight::steady();
    let column = flight.raw.columns.get_mut("de").unwrap();
    column.unit = Some("rad".to_owned());
    let other_unit = flight.ingest().unwrap();
    assert_eq!(other_unit.problems[0].stage, ProblemStage::Ingest);
}

#[test]
fn air_data_that_are_missing_are_computed_from_the_others_and_named() {
    let whole = Flight::steady().ingest().unwrap();
    for (channel, signal) in [("V", signal::VELOCITY), ("mach", signal::MACH)] {
        let mut flight = Flight::steady();
        flight.raw.columns.remove(channel);
        let ingested = flight.ingest().unwrap();
        let series = &ingested.record.signals[signal];
        assert!(series.is_assumed());
        let truth = whole.record.values(signal).unwrap()[1000];
        assert_relative_eq!(series.values[1000], truth, max_relative = 0.05);
        assert_eq!(ingested.problems.len(), 1);
        let reason = &ingested.problems[0].reason;
        assert!(reason.contains("is computed from"), "{reason}");
    }
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
    assert!(
        ingested
            .checks
            .iter()
            .all(|c| !c.relation.starts_with("psi rate"))
    );
}

#[test]
fn a_time_that_fits_nowhere_or_stands_still_costs_its_row_and_is_named() {
    let mut flight = Flight::steady();
    flight.values("time")[100] = 1.0;
    flight.values("time")[300] = flight.values("time")[299];
    flight.values("time")[500] = f64::NAN;
    let ingested = flight.ingest().unwrap();
    let places: Vec<&str> = ingested.problems.iter().map(|p| p.place.as_str()).collect();
    assert_eq!(places, ["channel `time`", "channel `time`"]);
    assert!(
        ingested.problems[0]
            .reason
            .starts_with("2 rows have a time that is not a number or fits nowhere")
    );
    assert!(
        ingested.problems[1]
            .reason
            .starts_with("time stands still in 1 rows, the first is row 301 of part 1")
    );
    let velocity = &ingested.record.signals[signal::VELOCITY];
    let bridged: Vec<usize> = (0..ROWS)
        .filter(|&k| velocity.marks[k] == Mark::Bridged)
        .collect();
    assert_eq!(bridged, [100, 300, 500]);
}

#[test]
fn a_clock_that_cannot_be_followed_or_is_absent_is_refused_and_named() {
    let mut flight = Flight::steady();
    flight.values("time")[500..900].fill(f64::NAN);
    let problem = flight.refused();
    assert_eq!(problem.place, "channel `time`");
    assert!(
        problem
            .reason
            .starts_with("of 2000 rows 400 have a time that is not a number"),
        "{}",
        problem.reason
    );
    flight.raw.columns.remove("time");
    assert!(flight.refused().reason.contains("is not in the file"));
    flight.channels.remove("time");
    assert!(flight.refused().reason.contains("has no clock"));
}

#[test]
fn a_time_in_another_unit_is_named_as_time() {
    for (factor, words) in [
        (1e3, "is the time in ms?"),
        (1.0 / 60.0, "is the time in min?"),
    ] {
        let mut flight = Flight::steady();
        flight.values("time").iter_mut().for_each(|t| *t *= factor);
        let problem = flight.refused();
        assert_eq!(problem.place, "channel `time`");
        assert!(problem.reason.contains(words), "{}", problem.reason);
    }
    // In its true unit the same record is read.
    let mut flight = Flight::steady();
    flight.values("time").iter_mut().for_each(|t| *t *= 1e3);
    flight.raw.columns.get_mut("time").unwrap().unit = Some("ms".to_owned());
    flight.channel("time").unit = "ms".to_owned();
    assert_eq!(flight.ingest().unwrap().problems, []);
}

#[test]
fn a_record_of_two_rows_is_named_as_short() {
    let flight = Flight::steady();
    let stretches = flight.of_files(&[flight.part(0..2)], usize::MAX);
    assert!(
        reasons(&stretches[0])[0].starts_with("the record is 0.025 s long, shorter than"),
        "{:?}",
        stretches[0].problems
    );
}

#[test]
fn a_signal_with_two_channels_and_a_unit_of_another_quantity_are_refused() {
    let mut flight = Flight::steady();
    flight.channel("de").signal = signal::THETA.to_owned();
    assert!(
        flight
            .refused()
            .reason
            .contains("both mapped to signal `theta_deg`")
    );
    let mut flight = Flight::steady();
    flight.channel("theta").unit = "ft".to_owned();
    flight.raw.columns.get_mut("theta").unwrap().unit = None;
    assert!(
        flight
            .refused()
            .reason
            .contains("is in deg, which `ft` does not convert to")
    );
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
    assert_eq!(
        (velocity.marks[51], velocity.values[51]),
        (Mark::Bridged, 600.0)
    );
    // Computed from Mach and altitude.
    assert_eq!(velocity.marks[250], Mark::Assumed);
    assert_relative_eq!(velocity.values[250], 600.0, max_relative = 1e-3);
    assert_eq!(
        (velocity.marks[1000], velocity.values[1000]),
        (Mark::Despiked, 600.0)
    );
    assert_eq!(
        (velocity.marks[1501], velocity.values[1501]),
        (Mark::Bridged, 600.0)
    );
    let row = ingested.channels.iter().find(|c| c.channel == "V").unwrap();
    assert_eq!((row.bridged, row.despiked, row.missing), (7, 1, 100));
}

#[test]
fn numbers_that_no_aircraft_has_are_missing_and_named() {
    for (name, rows) in [("theta", 0..3), ("theta", 700..704), ("psi", 1996..2000)] {
        let mut flight = Flight::noisy();
        flight.values(name)[rows.clone()].fill(1e308);
        flight.values(name)[rows.start] = -1e200;
        let ingested = flight.ingest().unwrap();
        let first_s = rows.start as f64 * STEP_S;
        assert_eq!(ingested.problems.len(), 1, "{:?}", ingested.problems);
        assert_eq!(ingested.problems[0].place, format!("channel `{name}`"));
        assert_eq!(
            ingested.problems[0].reason,
            format!(
                "{} samples are beyond 1e9 deg, which no aircraft has, the first at {first_s:.3} s; they count \
                 as missing",
                rows.len()
            )
        );
        let signal = &flight.channels[name].signal;
        let series = &ingested.record.signals[signal];
        assert!(rows.into_iter().all(|k| series.marks[k] != Mark::Measured));
        assert!(!series.values.iter().any(|v| v.abs() > 1e3));
    }
}

#[test]
fn a_flag_is_never_despiked_and_holds_its_last_value() {
    let mut flight = Flight::steady();
    flight.values("flag")[700] = 1.0;
    flight.values("flag")[800..].fill(1.0);
    flight.values("flag")[796..800].fill(f64::NAN);
    let flag = flight.ingest().unwrap().record.signals["obes"].clone();
    assert_eq!((flag.values[700], flag.marks[700]), (1.0, Mark::Measured));
    assert_eq!(
        (flag.values[799], flag.marks[799], flag.values[800]),
        (0.0, Mark::Bridged, 1.0)
    );
}

#[test]
fn a_wrong_channel_refuses_the_flight_or_is_reported_as_the_settings_say() {
    let mut flight = Flight::steady();
    flight.values("an").iter_mut().for_each(|v| *v = -*v);
    let problem = flight.refused();
    assert_eq!(problem.place, "channel `an`");
    assert!(problem.reason.contains("slope -1.00"), "{}", problem.reason);
    assert!(
        problem.reason.contains("its sign is reversed"),
        "{}",
        problem.reason
    );
    flight.settings.on_failed_check = OnFailedCheck::Report;
    let ingested = flight.ingest().unwrap();
    assert_eq!(ingested.problems, [problem]);
    assert_eq!(
        verdict(&ingested, "an"),
        ChannelVerdict::Fault("its sign is reversed".into())
    );
}

#[test]
fn a_channel_that_no_correction_sets_right_is_named_once() {
    let mut flight = Flight::noisy();
    flight.values("alpha").iter_mut().for_each(|v| *v *= -1e3);
    let place = flight.refused().place;
    assert_eq!(place.matches("`alpha`").count(), 1, "{place}");
}

#[test]
fn masses_and_inertias_that_no_aircraft_has_are_named() {
    let cases = [
        (
            "mass",
            -1.0,
            "mass",
            "its median is -3000 slug; it must be greater than zero",
        ),
        ("mass", 0.0, "mass", "its median is 0 slug"),
        (
            "mass",
            14.593_9,
            "mass",
            "aircraft have 2 to 6: is it in kg?",
        ),
        ("mass", 32.174, "mass", "aircraft have 2 to 6: is it in lb?"),
        (
            "mass",
            1.0 / 14.593_9,
            "mass",
            "sin alpha; aircraft have 2 to 6",
        ),
        ("Iy", -1.0, "Iy", "its median is -151000 slug ft2"),
        ("Iy", 1.355_8, "Iy", "exceeds the sum of the others"),
        ("Iz", 1.355_8, "Iz", "exceeds the sum of the others"),
        ("Ix", 32.174, "Ix", "exceeds the sum of the others"),
        ("Ixz", 32.174, "Ixz", "its square exceeds their product"),
    ];
    for (name, factor, place, words) in cases {
        let mut flight = Flight::steady();
        flight.values(name).iter_mut().for_each(|v| *v *= factor);
        let problem = flight.refused();
        assert_eq!(problem.place, format!("channel `{place}`"), "{problem:?}");
        assert!(problem.reason.contains(words), "{}", problem.reason);
        flight.settings.on_failed_check = OnFailedCheck::Report;
        let ingested = flight.ingest().unwrap();
        assert_eq!(ingested.problems, std::slice::from_ref(&problem));
        assert_eq!(
            verdict(&ingested, name),
            ChannelVerdict::Fault(problem.reason)
        );
    }
}

#[test]
fn inertias_that_are_all_in_a_wrong_unit_are_named() {
    for (factor, words) in [
        (32.174, "in roll is 0.840 of half the span"),
        (1.0 / 32.174, "in roll is 0.026 of half the span"),
    ] {
        let mut flight = Flight::steady();
        for name in ["Ix", "Iy", "Iz", "Ixz"] {
            flight.values(name).iter_mut().for_each(|v| *v *= factor);
        }
        let problem = flight.refused();
        assert_eq!(problem.place, "channel `Ix`");
        assert!(problem.reason.contains(words), "{}", problem.reason);
    }
}

#[test]
fn a_channel_of_nothing_but_zeros_is_among_those_that_never_change() {
    let mut flight = Flight::steady();
    flight.values("an").fill(0.0);
    let problem = flight.refused();
    assert!(problem.place.contains("`an`"), "{}", problem.place);
    assert!(
        problem.reason.contains("`an`: it never changes"),
        "{}",
        problem.reason
    );
}

#[test]
fn an_instrument_that_is_dead_throughout_is_named_though_no_relation_is_excited_without_it() {
    let mut flight = Flight::noisy();
    flight.values(signal::AY).fill(0.0);
    assert_eq!(
        flight.ingest().map(|i| i.problems),
        Ok(Vec::new()),
        "too short a record to tell"
    );
    flight.settings.checks.dead_s = 20.0;
    let problem = flight.refused();
    assert_eq!(problem.place, format!("channel `{}`", signal::AY));
    let reason = problem.reason;
    assert!(
        reason.contains("one value throughout, while the aircraft flies"),
        "{reason}"
    );
}

#[test]
fn an_airspeed_of_zero_beside_the_dynamic_pressure_of_a_flight_is_named_and_on_the_ground_is_none()
{
    let mut flight = Flight::noisy();
    flight.values("V").fill(0.0);
    let problem = flight.refused();
    assert_eq!(problem.place, "channel `V`");
    let reason = problem.reason;
    assert!(reason.contains("its median is 0.0000 ft/s"), "{reason}");
    flight.values("qbar").fill(0.3);
    flight.values("mach").fill(0.01);
    assert_eq!(flight.ingest().map(|i| i.problems), Ok(Vec::new()));
}

fn reasons(ingested: &Ingested) -> Vec<&str> {
    ingested
        .problems
        .iter()
        .map(|p| p.reason.as_str())
        .collect()
}

/// Asserts that signals are equal bit by bit, and everything else is equal.
fn assert_same(a: &Ingested, b: &Ingested) {
    for (name, series) in &a.record.signals {
        let bits = |s: &Series| s.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(series.marks, b.record.signals[name].marks, "{name}");
        assert_eq!(bits(series), bits(&b.record.signals[name]), "{name}");
    }
    assert_eq!(
        (&a.channels, &a.checks, &a.problems),
        (&b.channels, &b.checks, &b.problems)
    );
}

#[test]
fn a_record_does_not_depend_on_the_pieces_it_was_read_in() {
    let mut flight = Flight::noisy();
    for column in flight.raw.columns.values_mut() {
        let once = column.values.clone();
        (0..24).for_each(|_| column.values.extend_from_slice(&once));
    }
    let rows = flight.values("time").len();
    flight
        .values("time")
        .iter_mut()
        .enumerate()
        .for_each(|(k, t)| *t = k as f64 * STEP_S);
    flight.values("V")[16_380..16_390].fill(f64::NAN);
    flight.values("V")[30_000] += 5.0;
    flight
        .values("psi")
        .iter_mut()
        .enumerate()
        .for_each(|(k, v)| *v = (*v + 0.01 * k as f64) % 360.0);
    flight.channel("psi").wraps_at = Some(360.0);
    flight.values("theta")[20_000..20_600].fill(20.01);
    flight
        .raw
        .columns
        .values_mut()
        .for_each(|c| drop(c.values.drain(40_000..40_003)));
    let files = std::slice::from_ref(&flight.raw);
    let whole = flight.of_files(files, usize::MAX);
    assert_eq!(whole[0].record.samples, rows);
    assert_eq!(
        whole[0]
            .channels
            .iter()
            .find(|c| c.channel == "theta")
            .unwrap()
            .stuck,
        600
    );
    for piece in [1000, 16_384, 20_000] {
        assert_same(&whole[0], &flight.of_files(files, piece)[0]);
    }
}

#[test]
fn rows_that_are_there_twice_are_used_once_and_named() {
    let flight = Flight::noisy();
    let mut twice = flight.raw.clone();
    for column in twice.columns.values_mut() {
        let again = column.values[700..900].to_vec();
        column.values.splice(900..900, again);
    }
    let plain = flight.ingest().unwrap();
    let [once] = &flight.of_files(&[twice], usize::MAX)[..] else {
        panic!("one stretch")
    };
    assert_eq!(once.record, plain.record);
    assert!(
        reasons(once)[0].starts_with("rows from row 901 on"),
        "{:?}",
        once.problems
    );
}

#[test]
fn overlapping_files_and_copies_are_used_once_and_named() {
    let flight = Flight::noisy();
    let plain = flight.ingest().unwrap();
    let cases = [
        vec![flight.part(0..1200), flight.part(800..ROWS)],
        vec![flight.raw.clone(), flight.raw.clone()],
    ];
    for files in cases {
        let [once] = &flight.of_files(&files, usize::MAX)[..] else {
            panic!("one stretch")
        };
        assert_eq!(once.record, plain.record);
        assert_eq!(once.problems.len(), 1, "{:?}", once.problems);
        assert!(
            reasons(once)[0].contains("are there already"),
            "{:?}",
            once.problems
        );
    }
}

#[test]
fn files_in_the_wrong_order_are_one_flight() {
    let flight = Flight::noisy();
    let files = [flight.part(1000..ROWS), flight.part(0..1000)];
    assert_eq!(
        flight.of_files(&files, usize::MAX)[0].record,
        flight.ingest().unwrap().record
    );
}

#[test]
fn a_clock_that_starts_anew_or_a_long_gap_makes_a_stretch_with_an_id_of_its_own() {
    for (back, word) in [
        (-20.0, "time jumps back from"),
        (5000.0, "the clock lacks 5000.0 s"),
    ] {
        let mut flight = Flight::noisy();
        flight.values("time")[1000..]
            .iter_mut()
            .for_each(|t| *t += back);
        let stretches = flight.of_files(std::slice::from_ref(&flight.raw), usize::MAX);
        let ids: Vec<&str> = stretches
            .iter()
            .map(|s| s.record.flight_id.as_str())
            .collect();
        assert_eq!(ids, ["007", "007.2"]);
        assert_eq!(
            (stretches[0].record.samples, stretches[1].record.samples),
            (1000, 1000)
        );
        assert!(
            reasons(&stretches[0])[0].contains(word),
            "{:?}",
            stretches[0].problems
        );
        assert!(
            reasons(&stretches[0])[0].ends_with("what follows is a record of its own, `007.2`")
        );
        // Nothing is rejected.
        assert_eq!(stretches[0].problems[0].stage, ProblemStage::Recording);
        assert_eq!(reasons(&stretches[1]), Vec::<&str>::new());
    }
}

#[test]
fn a_slow_channel_is_measured_where_it_is_recorded_and_on_a_line_between() {
    let recorded = |k: usize| 20.0 + 0.3 * (0.02 * k as f64).sin() + 0.01 * ((k * k % 17) as f64);
    for held in [false, true] {
        let mut flight = Flight::noisy();
        let slow = |(k, v): (usize, &mut f64)| {
            *v = if k % 4 == 1 || held {
                recorded(k - (k + 3) % 4 % k.max(1))
            } else {
                f64::NAN
            };
        };
        flight.values("theta").iter_mut().enumerate().for_each(slow);
        let ingested = flight.ingest().unwrap();
        let theta = &ingested.record.signals[signal::THETA];
        let measured: Vec<usize> = (8..60)
            .filter(|&k| theta.marks[k] == Mark::Measured)
            .collect();
        assert_eq!(
            measured,
            (9..60).step_by(4).collect::<Vec<_>>(),
            "held {held}"
        );
        assert!((10..60).all(|k| k % 4 == 1 || theta.marks[k] == Mark::Between));
        assert_relative_eq!(
            theta.values[11],
            0.5 * (recorded(9) + recorded(13)),
            max_relative = 1e-12
        );
        let row = ingested
            .channels
            .iter()
            .find(|c| c.channel == "theta")
            .unwrap();
        assert_relative_eq!(row.rate_hz.unwrap(), 10.0, max_relative = 1e-6);
        assert_eq!((row.bridged, row.despiked, row.stuck), (0, 0, 0));
    }
}

#[test]
fn a_channel_in_a_file_of_its_own_is_brought_to_the_record_s_clock() {
    let mut flight = Flight::noisy();
    let mut own = RawFlight {
        flight_id: "007".to_owned(),
        columns: BTreeMap::new(),
    };
    // 10 Hz, 7 ms late, of a value that rises slowly.
    let times: Vec<f64> = (0..500).map(|k| f64::from(k) * 0.1 + 0.007).collect();
    own.columns.insert(
        "psi".to_owned(),
        RawColumn {
            unit: None,
            values: times.iter().map(|t| 100.0 + 0.2 * t).collect(),
        },
    );
    own.columns.insert(
        "time".to_owned(),
        RawColumn {
            unit: None,
            values: times,
        },
    );
    flight.raw.columns.remove("psi");
    for files in [[flight.raw.clone(), own.clone()], [own, flight.raw.clone()]] {
        let [one] = &flight.of_files(&files, 700)[..] else {
            panic!("one stretch")
        };
        let psi = &one.record.signals[signal::PSI];
        let own: Vec<usize> = (100..120)
            .filter(|&k| psi.marks[k] == Mark::Measured)
            .collect();
        assert_eq!(own, [100, 104, 108, 112, 116]);
        for k in [100, 101, 102, 103] {
            assert_relative_eq!(
                psi.values[k],
                100.0 + 0.2 * k as f64 * STEP_S,
                max_relative = 1e-9
            );
        }
        assert_eq!(psi.marks[101], Mark::Between);
        assert_eq!(one.problems, []);
    }
}

#[test]
fn a_stuck_channel_is_left_out_from_its_first_repetition_and_named() {
    let mut flight = Flight::noisy();
    flight.values("alpha")[600..800].fill(20.013);
    let ingested = flight.ingest().unwrap();
    let alpha = &ingested.record.signals[signal::ALPHA_VANE];
    assert!((600..800).all(|k| alpha.marks[k] == Mark::Stuck && alpha.values[k].is_nan()));
    assert_eq!(alpha.marks[599], Mark::Measured);
    assert_eq!(
        (
            reasons(&ingested).len(),
            ingested.problems[0].place.as_str()
        ),
        (1, "channel `alpha`")
    );
    assert!(
        reasons(&ingested)[0].starts_with("its value is stuck from 15.0 s to 20.0 s"),
        "{:?}",
        ingested.problems
    );
}

#[test]
fn a_control_at_rest_and_a_coarse_channel_are_not_stuck() {
    let mut flight = Flight::noisy();
    // A stick without noise that moves now and then, and a surface in steps much larger than its
    // noise.
    let moved = |k: usize| {
        if (400..460).contains(&k) {
            (k - 400) as f64 * 0.05
        } else {
            0.0
        }
    };
    flight
        .values("de")
        .iter_mut()
        .enumerate()
        .for_each(|(k, v)| *v = moved(k));
    flight
        .values("mach")
        .iter_mut()
        .for_each(|v| *v = (*v * 20.0).round() / 20.0);
    let ingested = flight.ingest().unwrap();
    assert_eq!(ingested.problems, []);
}

#[test]
fn noise_and_quantisation_are_estimated_and_wraps_counted() {
    let mut flight = Flight::noisy();
    flight
        .values("phi_deg")
        .iter_mut()
        .enumerate()
        .for_each(|(k, v)| *v = (*v + 0.7 * k as f64 + 180.0) % 360.0 - 180.0);
    flight.settings.on_failed_check = OnFailedCheck::Report;
    let ingested = flight.ingest().unwrap();
    let row = |name: &str| {
        ingested
            .channels
            .iter()
            .find(|c| c.channel == name)
            .unwrap()
    };
    assert_relative_eq!(row("V").quantisation.unwrap(), 0.001, max_relative = 1e-6);
    let noise = row("V").noise.unwrap();
    assert!((0.008..0.016).contains(&noise), "{noise}");
    assert_eq!(row("phi_deg").wraps, 4);
    assert!(
        ingested
            .record
            .values(signal::PHI)
            .unwrap()
            .windows(2)
            .all(|p| (p[1] - p[0]).abs() < 1.0)
    );
    assert_eq!(row("time").samples, ROWS);
}
