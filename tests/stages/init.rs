//! Init: a recording without a channel map becomes a pipeline. Channels are found in copies of the
//! demonstration that are renamed, in other units, with reversed signs, or incomplete.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use harvest::inspection::draft::{self, Draft};
use harvest::inspection::{Column, Inspection, Recording, inspect};
use harvest::store::{archive, unmapped_recording};

use crate::support::{harvest, run};

/// Rows of each flight: enough maneuvers of both axes.
const ROWS: usize = 24_000;

/// Two flights of the demonstration as recorded.
fn demonstration() -> Vec<Recording> {
    static FLIGHTS: OnceLock<Vec<Recording>> = OnceLock::new();
    let read = || {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/demo/flights");
        let flights = archive::find(&root.display().to_string()).unwrap();
        let two = flights.iter().take(2);
        two.flat_map(|flight| unmapped_recording::first_rows(flight, ROWS).unwrap())
            .collect()
    };
    FLIGHTS.get_or_init(read).clone()
}

/// Signal, factor into the signal's unit, and sign of a column.
type Truth = BTreeMap<String, (String, f64)>;

/// Channels as the shipped pipeline has them: all in the signals' units and signs.
fn truth() -> Truth {
    let text = fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/harv/aircraft.yaml"),
    )
    .unwrap();
    let mut truth = Truth::new();
    for line in text.lines().filter(|line| line.contains("{ signal: ")) {
        let (column, rest) = line.trim().split_once(": { signal: ").unwrap();
        let (signal, _) = rest.split_once(',').unwrap();
        truth.insert(column.to_owned(), (signal.to_owned(), 1.0));
    }
    assert!(truth.len() > 40);
    truth
}

/// Units of the demonstration that an SI recorder does not have.
const SI: [(&str, &str, f64); 10] = [
    ("deg", "rad", std::f64::consts::PI / 180.0),
    ("deg/s", "rad/s", std::f64::consts::PI / 180.0),
    ("ft/s", "m/s", 0.3048),
    ("ft", "m", 0.3048),
    ("g", "m/s2", 9.806_65),
    ("lbf/ft2", "Pa", 47.880_259),
    ("lbf", "N", 4.448_221_6),
    ("slug", "kg", 14.593_903),
    ("slug ft2", "kg m2", 1.355_817_95),
    ("in", "m", 0.0254),
];

/// A copy of the demonstration, and what its columns truly are.
struct Copy {
    recordings: Vec<Recording>,
    truth: Truth,
}

impl Copy {
    fn new() -> Copy {
        Copy {
            recordings: demonstration(),
            truth: truth(),
        }
    }

    fn each(mut self, change: impl Fn(&mut Column)) -> Copy {
        let columns = self.recordings.iter_mut().flat_map(|r| &mut r.columns);
        columns.for_each(change);
        self
    }

    fn in_si(mut self) -> Copy {
        let columns = &demonstration()[0].columns;
        for column in columns {
            let unit = SI
                .iter()
                .find(|(from, _, _)| column.stated.as_deref() == Some(from));
            if let (Some((_, _, factor)), Some(truth)) = (unit, self.truth.get_mut(&column.name)) {
                truth.1 /= factor;
            }
        }
        self.each(|column| {
            let unit = SI
                .iter()
                .find(|(from, _, _)| column.stated.as_deref() == Some(from));
            if let Some((_, to, factor)) = unit {
                column.stated = Some((*to).to_owned());
                column.values.iter_mut().for_each(|v| *v *= factor);
            }
        })
    }

    fn without_units(self) -> Copy {
        self.each(|column| column.stated = None)
    }

    fn reversed(mut self, names: &[&str]) -> Copy {
        for name in names {
            self.truth.get_mut(*name).unwrap().1 *= -1.0;
        }
        self.each(|column| {
            if names.contains(&column.name.as_str()) {
                column.values.iter_mut().for_each(|v| *v = -*v);
            }
        })
    }

    fn without(mut self, names: &[&str]) -> Copy {
        for recording in &mut self.recordings {
            recording
                .columns
                .retain(|c| !names.contains(&c.name.as_str()));
        }
        self.truth.retain(|name, _| !names.contains(&name.as_str()));
        self
    }

    fn renamed(mut self, names: &[(&str, &str)]) -> Copy {
        for (from, to) in names {
            let truth = self.truth.remove(*from).unwrap();
            self.truth.insert((*to).to_owned(), truth);
        }
        self.each(|column| {
            if let Some((_, to)) = names.iter().find(|(from, _)| *from == column.name) {
                (*to).clone_into(&mut column.name);
            }
        })
    }

    fn shuffled(mut self) -> Copy {
        for recording in &mut self.recordings {
            let key = |name: &str| {
                name.bytes()
                    .fold(7_u32, |h, b| (h * 31 + u32::from(b)) % 8191)
            };
            recording.columns.sort_by_key(|c| key(&c.name));
        }
        self
    }

    /// Columns that are wrong and sure, and the share of columns that are right or unsure.
    fn judged(&self) -> (Inspection, Vec<String>, f64) {
        let found = inspect(&self.recordings).unwrap();
        let mut wrong = Vec::new();
        for channel in found.channels.iter().filter(|c| c.is_sure) {
            // Names of surfaces, controls and flags are the recorder's: only unit and sign count.
            let free = !matches!(
                channel.role,
                harvest::inspection::Role::Motion | harvest::inspection::Role::Constant
            );
            let is_right = self
                .truth
                .get(&channel.column)
                .is_some_and(|(signal, factor)| {
                    let own = channel.sign * factor_into_signal(&channel.unit, &channel.signal);
                    let named = free || *signal == channel.signal;
                    named && (own / factor - 1.0).abs() < 1e-3
                });
            if !is_right {
                wrong.push(format!(
                    "{}: {} {} {}",
                    channel.column, channel.signal, channel.unit, channel.sign
                ));
            }
        }
        let all = self.truth.len() as f64;
        let share = 1.0 - wrong.len() as f64 / all;
        (found, wrong, share)
    }

    /// Inspects the recordings. Checks that nothing is wrong and sure, and that at least so many
    /// columns are sure.
    fn check(&self, least_sure: usize) -> Inspection {
        let (found, wrong, _) = self.judged();
        assert!(wrong.is_empty(), "wrong and sure: {wrong:#?}");
        let sure: BTreeSet<&str> = found
            .channels
            .iter()
            .filter(|c| c.is_sure)
            .map(|c| c.column.as_str())
            .collect();
        let unsure: Vec<String> = found
            .channels
            .iter()
            .filter(|c| !c.is_sure)
            .map(|c| {
                format!(
                    "{}: {} {} {}: {}",
                    c.column, c.signal, c.unit, c.sign, c.evidence
                )
            })
            .collect();
        assert!(
            sure.len() >= least_sure,
            "{} are sure; not sure: {unsure:#?}",
            sure.len()
        );
        found
    }
}

/// Factor from a unit to the unit at the end of a signal's name, from the definitions of the units.
fn factor_into_signal(unit: &str, signal: &str) -> f64 {
    let si = |name: &str| match name {
        "rad" | "rad/s" => 180.0 / std::f64::consts::PI,
        "m/s" | "m" => 1.0 / 0.3048,
        "m/s2" => 1.0 / 9.806_65,
        "ft/s2" => 1.0 / 32.174,
        "Pa" => 1.0 / 47.880_259,
        "N" => 1.0 / 4.448_221_6,
        "kg" => 1.0 / 14.593_903,
        "kg m2" => 1.0 / 1.355_817_95,
        "kt" => 1.687_81,
        "km/h" => 0.911_344,
        "hPa" => 100.0 / 47.880_259,
        "kPa" => 1000.0 / 47.880_259,
        _ => 1.0,
    };
    // A control recorded in metres is kept in feet; in the demonstration it is in inches.
    let inches = if signal.ends_with("_ft")
        && !signal.contains("cg")
        && unit == "m"
        && signal != "altitude_ft"
    {
        12.0
    } else {
        1.0
    };
    si(unit) * inches
}

#[test]
fn the_demonstration_is_found_as_it_is() {
    Copy::new().check(30);
}

#[test]
fn units_follow_from_the_motion_where_nothing_states_them() {
    Copy::new().in_si().without_units().shuffled().check(14);
}

#[test]
fn reversed_signs_follow_from_the_motion() {
    let reversed = [
        "alpha_vane",
        "q",
        "p",
        "theta",
        "ax",
        "de",
        "stick_lat",
        "pedal",
    ];
    let copy = Copy::new().reversed(&reversed);
    let found = copy.check(25);
    for name in ["alpha_vane", "q", "p", "theta", "de"] {
        let channel = found.channels.iter().find(|c| c.column == name).unwrap();
        assert!(channel.sign < 0.0, "{name}");
    }
}

#[test]
fn other_names_mean_the_same() {
    let copy = Copy::new().in_si().renamed(&[
        ("time", "Time"),
        ("alpha_vane", "AOA"),
        ("beta_vane", "SideslipAngle"),
        ("V", "TrueAirspeed"),
        ("mach", "MachNo"),
        ("altitude", "PressureAltitude"),
        ("p", "RollRate"),
        ("q", "PitchRate"),
        ("r", "YawRate"),
        ("theta", "PitchAngle"),
        ("phi", "BankAngle"),
        ("psi", "Heading"),
        ("an", "NZ"),
        ("ax", "NX"),
        ("ay", "NY"),
        ("qbar", "DynamicPressure"),
        ("de", "Elevator"),
        ("da", "Aileron"),
        ("dr", "Rudder"),
        ("mass", "GrossMass"),
        ("Ix", "Ixx"),
        ("Iy", "Iyy"),
        ("Iz", "Izz"),
    ]);
    copy.check(25);
}

#[test]
fn columns_without_names_are_found_by_their_motion() {
    let names: Vec<String> = truth().into_keys().collect();
    // `column_3` is what import calls a column of a text without a header.
    for place in ["CH", "column_"] {
        let numbers: Vec<String> = (0..names.len()).map(|n| format!("{place}{n}")).collect();
        let pairs = names.iter().zip(&numbers);
        let pairs: Vec<(&str, &str)> = pairs.map(|(a, b)| (a.as_str(), b.as_str())).collect();
        let copy = Copy::new().renamed(&pairs).shuffled();
        let found = copy.check(12);
        for name in ["alpha_vane", "V", "q", "theta", "an"] {
            let number = pairs.iter().find(|pair| pair.0 == name).unwrap().1;
            let channel = found.channels.iter().find(|c| c.column == number);
            assert!(channel.is_some_and(|c| c.is_sure), "{name} in {number}");
        }
    }
}

/// A copy whose names tell nothing, without some columns.
fn nameless_without(names: &[&str]) -> Copy {
    let copy = Copy::new().without(names);
    let numbered = copy.truth.keys().enumerate();
    let pairs: Vec<(String, String)> = numbered
        .map(|(n, name)| (name.clone(), format!("c{n:02}")))
        .collect();
    let pairs: Vec<(&str, &str)> = pairs
        .iter()
        .map(|(a, b)| (a.as_str(), b.as_str()))
        .collect();
    copy.renamed(&pairs).shuffled()
}

#[test]
fn a_flap_that_follows_the_angle_of_attack_is_not_taken_for_it() {
    let (_, wrong, _) = nameless_without(&["alpha_vane"]).judged();
    assert!(wrong.is_empty(), "wrong and sure: {wrong:#?}");
}

#[test]
fn one_equation_does_not_confirm_two_columns_whose_names_mean_nothing() {
    // Bank and its rate satisfy the equation of sideslip and yaw rate.
    let (_, wrong, _) =
        nameless_without(&["theta", "q", "r", "psi", "beta_vane", "alpha_vane"]).judged();
    assert!(wrong.is_empty(), "wrong and sure: {wrong:#?}");
}

#[test]
fn gravity_proposes_pitch_and_bank_of_a_recorder_without_names_and_heading() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/navion/flights");
    let flights = archive::find(&root.display().to_string()).unwrap();
    let read = |flight| unmapped_recording::first_rows(flight, 60_000).unwrap();
    let mut recordings: Vec<Recording> = flights.iter().flat_map(read).collect();
    let names = [
        ("PITCH", "theta_deg"),
        ("GYRO_Y", "q_deg_s"),
        ("ROLL", "phi_deg"),
        ("GYRO_X", "p_deg_s"),
    ];
    for column in recordings.iter_mut().flat_map(|r| &mut r.columns) {
        let code = column
            .name
            .bytes()
            .fold(7_u32, |h, b| (h * 31 + u32::from(b)) % 8191);
        if column.name != "time" {
            column.name = format!("X{code}");
        }
    }
    let found = inspect(&recordings).unwrap();
    for (name, signal) in names {
        let code = name
            .bytes()
            .fold(7_u32, |h, b| (h * 31 + u32::from(b)) % 8191);
        let own = found
            .channels
            .iter()
            .find(|c| c.column == format!("X{code}"));
        let own = own.unwrap_or_else(|| panic!("{name} has no signal"));
        assert_eq!(
            (own.signal.as_str(), own.is_sure),
            (signal, false),
            "{}",
            own.evidence
        );
    }
}

#[test]
fn signs_that_only_gravity_determines_are_not_sure_without_it() {
    // Without accelerations, pitch may be reversed together with yaw: every equation that is left holds.
    let copy = Copy::new()
        .without(&["an", "ax", "ay", "altitude", "mach", "qbar", "beta_vane"])
        .reversed(&["theta", "r"]);
    let (found, wrong, _) = copy.judged();
    assert!(wrong.is_empty(), "wrong and sure: {wrong:#?}");
    let doubt = |name: &str| {
        found
            .channels
            .iter()
            .find(|c| c.column == name && !c.is_sure)
    };
    let theta = doubt("theta").expect("theta, not sure");
    assert!(
        theta.evidence.contains("reversed together"),
        "{}",
        theta.evidence
    );
}

#[test]
fn an_altitude_above_the_sea_determines_which_way_is_up() {
    let names = ["an", "ax", "ay", "qbar", "beta_vane", "mach"];
    let copy = Copy::new().without(&names).reversed(&["theta"]);
    let found = copy.check(12);
    for (name, sign) in [("altitude", 1.0), ("theta", -1.0), ("q", 1.0)] {
        let channel = found.channels.iter().find(|c| c.column == name).unwrap();
        assert_eq!((channel.sign, channel.is_sure), (sign, true), "{name}");
    }
}

#[test]
fn axes_in_another_order_are_found_by_their_motion() {
    let copy = Copy::new().renamed(&[
        ("p", "WX"),
        ("q", "WZ"),
        ("r", "WY"),
        ("an", "NY"),
        ("ax", "NX"),
        ("ay", "NZ"),
        ("da", "DE"),
        ("de", "DV"),
        ("Ix", "JX"),
        ("Iy", "JZ"),
        ("Iz", "JY"),
    ]);
    let found = copy.check(20);
    for (name, signal) in [
        ("WZ", "q_deg_s"),
        ("WY", "r_deg_s"),
        ("NY", "an_g"),
        ("NZ", "ay_g"),
    ] {
        let channel = found.channels.iter().find(|c| c.column == name).unwrap();
        assert_eq!(channel.signal, signal, "{name}");
        assert!(channel.is_sure, "{name}: {}", channel.evidence);
    }
}

#[test]
fn names_of_other_languages_are_known_and_ends_that_are_no_units_left_out() {
    let copy = Copy::new().in_si().without_units().renamed(&[
        ("time", "Zeit"),
        ("alpha_vane", "alpha_m"),
        ("beta_vane", "Schiebewinkel"),
        ("V", "vitesse_air"),
        ("q", "Nickrate"),
        ("theta", "assiette"),
        ("an", "VRTG"),
        ("de", "profondeur"),
        ("dr", "Seitenruder"),
        ("stick_pitch", "CCPOS"),
        ("mass", "GW"),
    ]);
    let found = copy.check(12);
    let names = [
        "alpha_m",
        "Schiebewinkel",
        "vitesse_air",
        "profondeur",
        "Seitenruder",
        "CCPOS",
        "GW",
    ];
    for name in names {
        assert!(found.channels.iter().any(|c| c.column == name), "{name}");
    }
}

#[test]
fn surfaces_whose_names_mean_nothing_are_found_by_their_effects_and_not_sure() {
    let copy = Copy::new().renamed(&[("de", "S01"), ("da", "S02"), ("dr", "S03")]);
    let found = copy.check(20);
    for (name, effect) in [("S01", "pitch"), ("S02", "roll"), ("S03", "yaw")] {
        let channel = found.channels.iter().find(|c| c.column == name);
        let channel = channel.unwrap_or_else(|| panic!("{name}: {:#?}", found.unused));
        assert!(
            !channel.is_sure && channel.evidence.contains(effect),
            "{name}: {}",
            channel.evidence
        );
        assert!(channel.sign > 0.0, "{name}");
    }
}

#[test]
fn ailerons_that_are_mirror_images_are_proposed_as_their_half_difference() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/navion/flights");
    let flights = archive::find(&root.display().to_string()).unwrap();
    let recordings = flights.iter().take(2);
    let recordings: Vec<Recording> = recordings
        .flat_map(|flight| unmapped_recording::first_rows(flight, ROWS).unwrap())
        .collect();
    let inspection = inspect(&recordings).unwrap();
    let channels = inspection.channels.iter();
    let own: Vec<_> = channels
        .filter(|channel| channel.column.to_lowercase().starts_with("aileron"))
        .collect();
    let [aileron] = &own[..] else {
        panic!("{own:?}")
    };
    assert_eq!(aileron.signal, "aileron_deg");
    assert!(!aileron.is_sure && aileron.evidence.contains("a proposal"));
    let draft = Draft {
        name: "mine",
        archive: "flights",
        inspection: &inspection,
    };
    let files = draft::files(&draft);
    let aircraft = files.iter().find(|file| file.path == "aircraft.yaml");
    let text = &aircraft.unwrap().text;
    for line in [
        "\n  AILERON_L: { unit: rad } #",
        "\n  AILERON_R: { unit: rad } #",
        "\n  aileron: { signal: aileron_deg, formula: \"0.5 * (AILERON_L - AILERON_R)\" } # unsure: a proposal: ",
    ] {
        assert!(text.contains(line), "`{line}` is not in\n{text}");
    }
}

#[test]
fn an_incomplete_recording_is_not_filled_up_with_other_columns() {
    let gone = ["psi", "beta_vane", "mach", "altitude", "tvcs", "obes", "q"];
    let copy = Copy::new().without(&gone);
    let found = copy.check(12);
    for signal in ["psi_deg", "beta_vane_deg", "mach", "altitude_ft"] {
        assert!(
            found.channels.iter().all(|c| c.signal != signal),
            "{signal}"
        );
    }
}

#[test]
fn a_recording_without_time_is_refused_in_words() {
    let error = inspect(&Copy::new().without(&["time"]).recordings).unwrap_err();
    assert!(error.contains("no column counts time"), "{error}");
}

#[test]
fn init_writes_a_pipeline_whose_questions_check_lists() {
    let folder = tempfile::tempdir().unwrap();
    let flight = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/demo/flights/flight_001.parquet");
    let init = || {
        let mut command = harvest();
        command
            .current_dir(folder.path())
            .args(["init", "mine", "--from"])
            .arg(&flight);
        run(&mut command)
    };
    let outcome = init();
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert!(
        outcome.stdout.contains("alpha_vane is alpha_vane_deg"),
        "{}",
        outcome.stdout
    );
    let page = fs::read_to_string(folder.path().join("reports/mine/recording.html")).unwrap();
    roxmltree::Document::parse_with_options(
        &page,
        roxmltree::ParsingOptions {
            allow_dtd: true,
            ..Default::default()
        },
    )
    .unwrap();
    assert_eq!(init().code, Some(1), "a pipeline is not overwritten");

    let check = || {
        let mut command = harvest();
        command.current_dir(folder.path()).args(["check", "mine"]);
        run(&mut command)
    };
    let open = check();
    assert_eq!(open.code, Some(1));
    for word in [
        "wing_area_ft2: FILL_IN",
        "aircraft.yaml:",
        "every coefficient is divided by it",
        "8 lines",
    ] {
        assert!(
            open.stderr.contains(word),
            "`{word}` is not in\n{}",
            open.stderr
        );
    }
    let aircraft = folder.path().join("pipelines/mine/aircraft.yaml");
    let text = fs::read_to_string(&aircraft).unwrap();
    for line in [
        "\n  qbar_psf: { uncertainty: { scale_pct: 0.5 }, ordinary",
        "\n  thrust_lbf: { uncertainty: { scale_pct: 1 } }\n",
        "\n  de_deg: { uncertainty: { bias: 0.05, scale_pct: 0.2 } }\n",
    ] {
        assert!(text.contains(line), "`{line}` is not in\n{text}");
    }
    let text = text.replace("wing_area_ft2: FILL_IN", "wing_area_ft2: 80");
    fs::write(&aircraft, text.replace("FILL_IN", "10")).unwrap();
    let pipeline = folder.path().join("pipelines/mine/pipeline.yaml");
    let text = fs::read_to_string(&pipeline).unwrap();
    let tunnel = folder.path().join("tunnel.csv");
    fs::write(
        &tunnel,
        "derivative,alpha_deg,value,unit\nCm_q,10,-4,per_rad\n",
    )
    .unwrap();
    let tunnel = format!("wind_tunnel: {} #", tunnel.display());
    fs::write(
        &pipeline,
        text.replace("# wind_tunnel: tunnel.csv #", &tunnel),
    )
    .unwrap();
    let right = check();
    assert_eq!(right.code, Some(0), "{}", right.stderr);
    for word in [
        "The configuration is valid",
        "not sure",
        "pitch_surface",
        "roll_pilot",
    ] {
        assert!(
            right.stdout.contains(word),
            "`{word}` is not in\n{}",
            right.stdout
        );
    }
}

#[test]
fn a_drafted_class_takes_doublets_of_several_surfaces_for_one_maneuver() {
    let folder = tempfile::tempdir().unwrap();
    let flight = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/demo/flights/flight_001.parquet");
    let command = |words: &[&str]| {
        let mut command = harvest();
        command.current_dir(folder.path()).args(words);
        run(&mut command)
    };
    command(&["init", "mine", "--from", &flight.display().to_string()]);
    let aircraft = folder.path().join("pipelines/mine/aircraft.yaml");
    let text = fs::read_to_string(&aircraft).unwrap();
    let harv = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/harv/aircraft.yaml");
    let harv = fs::read_to_string(harv).unwrap();
    let parts = |text: &str| {
        let (geometry, recorder) = text.split_once("\n# The recorder").unwrap();
        (geometry.to_owned(), recorder.to_owned())
    };
    let answered = format!("{}\n# The recorder{}", parts(&harv).0, parts(&text).1);
    fs::write(&aircraft, answered).unwrap();
    let outcome = command(&["segment", "mine"]);
    assert!(
        outcome.code.is_some_and(|code| code != 1),
        "{}",
        outcome.stderr
    );
    let found = fs::read_to_string(folder.path().join("reports/mine/maneuvers.csv")).unwrap();
    // Flap, aileron, elevator and vane step one after another from 1157.7 to 1183.7 s.
    let of_flaps = found
        .lines()
        .filter(|line| line.starts_with("flight_001_t0115"));
    assert_eq!(of_flaps.count(), 1, "{found}");
    let unknown = fs::read_to_string(folder.path().join("reports/mine/unknown.csv")).unwrap();
    assert_eq!(unknown.lines().count(), 1, "{unknown}");
}

#[test]
fn surfaces_without_units_are_inputs_and_check_asks_for_what_no_recording_has() {
    let folder = tempfile::tempdir().unwrap();
    let flights = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/navion/flights");
    let command = |words: &[&str]| {
        let mut command = harvest();
        command.current_dir(folder.path()).args(words);
        run(&mut command)
    };
    let outcome = command(&["init", "nv", "--from", &flights.display().to_string()]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert!(!outcome.stdout.contains("no input"), "{}", outcome.stdout);
    let pipeline = folder.path().join("pipelines/nv");
    for class in ["pitch_surface", "roll_surface", "yaw_surface"] {
        let file = pipeline.join(format!("maneuvers/{class}.yaml"));
        assert!(file.is_file(), "{class}: {}", outcome.stdout);
    }
    // Three lengths, five sensors, mass and three moments of inertia.
    let open = command(&["check", "nv"]);
    assert!(open.stderr.contains("12 lines have"), "{}", open.stderr);
    let aircraft = pipeline.join("aircraft.yaml");
    let text = fs::read_to_string(&aircraft).unwrap();
    let air = "\n  OAT: { signal: air_kelvin, unit: degC } # unsure:";
    assert!(text.contains(air), "{text}");
    let text = text.replace("wing_area_ft2: FILL_IN", "wing_area_ft2: 80");
    fs::write(&aircraft, text.replace("FILL_IN", "10")).unwrap();
    let right = command(&["check", "nv"]);
    assert_eq!(right.code, Some(0), "{}", right.stderr);
}

/// Classes that are drafted for recordings of single maneuvers: flight of the demonstration, first and
/// last input.
fn classes_of(maneuvers: &[(usize, f64, f64)]) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/demo/flights");
    let flights = archive::find(&root.display().to_string()).unwrap();
    let cut = |(flight, from_s, to_s): &(usize, f64, f64)| {
        let mut recording = unmapped_recording::first_rows(&flights[*flight], 60_000)
            .unwrap()
            .remove(0);
        let times = recording.column("time").unwrap().values.clone();
        let start = times.iter().position(|t| *t >= from_s - 1.2).unwrap();
        let end = times.iter().position(|t| *t > to_s + 1.0).unwrap();
        for column in &mut recording.columns {
            column.values = column.values[start..end].to_vec();
        }
        recording
    };
    let recordings: Vec<Recording> = maneuvers.iter().map(cut).collect();
    let inspection = inspect(&recordings).unwrap();
    let files = draft::files(&Draft {
        name: "one_axis",
        archive: "flights",
        inspection: &inspection,
    });
    let paths = files.into_iter().map(|file| file.path);
    paths.filter(|p| p.starts_with("maneuvers/")).collect()
}

#[test]
fn recordings_of_one_axis_have_classes_of_this_axis_alone() {
    let pitch = [
        (0, 119.8, 130.0),
        (0, 234.2, 239.7),
        (0, 581.7, 592.0),
        (1, 222.9, 232.6),
        (1, 563.2, 576.1),
    ];
    let found = classes_of(&pitch);
    assert!(
        found.contains(&"maneuvers/pitch_surface.yaml".to_owned())
            && found
                .iter()
                .all(|class| class.starts_with("maneuvers/pitch")),
        "{found:?}"
    );
    let lateral = [
        (0, 398.9, 423.3),
        (1, 112.2, 126.3),
        (1, 313.8, 324.4),
        (1, 412.0, 428.8),
    ];
    let found = classes_of(&lateral);
    assert!(
        found.contains(&"maneuvers/roll_yaw_surface.yaml".to_owned())
            && found.iter().all(|class| !class.contains("pitch")),
        "{found:?}"
    );
}

#[test]
fn a_required_signal_that_no_column_gives_is_a_question() {
    let copy = Copy::new().without(&["altitude", "qbar", "alpha_vane"]);
    let (inspection, _, _) = copy.judged();
    let files = draft::files(&Draft {
        name: "mine",
        archive: "flights",
        inspection: &inspection,
    });
    let aircraft = files
        .iter()
        .find(|file| file.path == "aircraft.yaml")
        .unwrap();
    for line in [
        "\n  altitude_ft: FILL_IN # no column was found; density",
        "\n  alpha_vane_deg: FILL_IN #",
    ] {
        assert!(
            aircraft.text.contains(line),
            "`{line}` is not in\n{}",
            aircraft.text
        );
    }
    // The airspeed and that altitude give the dynamic pressure.
    assert!(
        !aircraft.text.contains("qbar_psf: FILL_IN"),
        "{}",
        aircraft.text
    );
}

#[test]
fn a_recorder_of_one_axis_is_not_asked_for_inertias_and_positions_of_the_other() {
    let lateral = [
        "beta_vane",
        "p",
        "r",
        "phi",
        "ay",
        "psi",
        "Ix",
        "Iy",
        "Iz",
        "Ixz",
    ];
    let (inspection, _, _) = Copy::new().without(&lateral).judged();
    let files = draft::files(&Draft {
        name: "mine",
        archive: "flights",
        inspection: &inspection,
    });
    let mut files = files.iter();
    let aircraft = &files
        .find(|file| file.path == "aircraft.yaml")
        .unwrap()
        .text;
    assert!(aircraft.contains("\n  iy_slug_ft2: FILL_IN"), "{aircraft}");
    for absent in [
        "ix_slug_ft2",
        "iz_slug_ft2",
        "ay: { x_ft: FILL_IN",
        "beta_vane: { x_ft: FILL_IN",
    ] {
        assert!(!aircraft.contains(absent), "{absent} in\n{aircraft}");
    }
}

#[test]
fn recordings_of_another_format_are_answered_with_the_command_that_imports_them() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("recordings")).unwrap();
    fs::write(folder.path().join("recordings/x.csv"), "t,q\n0,1\n0.1,2\n").unwrap();
    for place in ["recordings/x.csv", "recordings"] {
        let mut command = harvest();
        command
            .current_dir(folder.path())
            .args(["init", "mine", "--from", place]);
        let outcome = run(&mut command);
        assert_eq!(outcome.code, Some(1));
        for words in [
            format!("`harvest import {place} --to data/mine/flights`"),
            "`harvest init mine --from data/mine/flights`".to_owned(),
        ] {
            assert!(outcome.stderr.contains(&words), "{}", outcome.stderr);
        }
    }
}
