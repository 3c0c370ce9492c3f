//! Errors of a wrong configuration: each test copies the shipped pipeline, makes one thing wrong
//! and reads the error.

use approx::assert_relative_eq;
use std::fs;
use std::path::{Path, PathBuf};

use super::{Config, Overrides};

/// A copy of the shipped pipeline, to be made wrong.
struct Copy {
    folder: tempfile::TempDir,
}

impl Copy {
    fn new() -> Copy {
        let folder = tempfile::tempdir().unwrap();
        let shipped = Path::new("pipelines/harv");
        fs::create_dir(folder.path().join("maneuvers")).unwrap();
        for sub in ["", "maneuvers"] {
            for entry in fs::read_dir(shipped.join(sub)).unwrap() {
                let path = entry.unwrap().path();
                if path.is_file() {
                    fs::copy(
                        &path,
                        folder.path().join(sub).join(path.file_name().unwrap()),
                    )
                    .unwrap();
                }
            }
        }
        Copy { folder }
    }

    fn path(&self, file: &str) -> PathBuf {
        self.folder.path().join(file)
    }

    /// Replaces the one place where `from` stands; returns the line on which it begins.
    fn spoil(&self, file: &str, from: &str, to: &str) -> usize {
        let text = fs::read_to_string(self.path(file)).unwrap();
        assert_eq!(text.matches(from).count(), 1, "`{from}` in {file}");
        fs::write(self.path(file), text.replacen(from, to, 1)).unwrap();
        text.split(from).next().unwrap().matches('\n').count() + 1
    }

    /// Removes the lines of channels.
    fn unmap(&self, channels: &[&str]) {
        let text = fs::read_to_string(self.path("aircraft.yaml")).unwrap();
        let is_removed = |line: &str| {
            let mut channels = channels.iter();
            channels.any(|channel| line.starts_with(&format!("  {channel}: {{ signal")))
        };
        let kept: Vec<&str> = text.lines().filter(|line| !is_removed(line)).collect();
        self.write("aircraft.yaml", &kept.join("\n"));
    }

    fn write(&self, file: &str, text: &str) -> PathBuf {
        fs::write(self.path(file), text).unwrap();
        self.path(file)
    }

    fn load(&self, overrides: Overrides) -> Result<Config, String> {
        let folder = format!("{}/", self.folder.path().display());
        Config::load(self.folder.path(), overrides).map_err(|e| e.to_string().replace(&folder, ""))
    }

    fn error(&self) -> String {
        self.load(Overrides::default()).unwrap_err()
    }

    fn error_with_tunnel(&self, rows: &str) -> String {
        let path = self.write(
            "tunnel.csv",
            &format!("derivative,alpha_deg,value,unit\n{rows}"),
        );
        self.load(Overrides {
            wind_tunnel: Some(path),
            ..Overrides::default()
        })
        .unwrap_err()
    }

    fn error_with_events(&self, rows: &str) -> String {
        let path = self.write(
            "events.csv",
            &format!("flight_id,class,start_s,end_s\n{rows}"),
        );
        self.load(Overrides {
            events: Some(path),
            ..Overrides::default()
        })
        .unwrap_err()
    }
}

#[test]
fn the_shipped_pipeline_is_right() {
    let config = Copy::new().load(Overrides::default()).unwrap();
    assert_eq!(config.classes.len(), 9);
    assert_eq!(config.aero_model.derivatives.len(), 48);
}

#[test]
fn an_unknown_key_is_named_with_the_one_that_was_probably_meant() {
    let copy = Copy::new();
    let line = copy.spoil("pipeline.yaml", "wind_tunnel: data", "wind_tunel: data");
    let e = copy.error();
    assert!(
        e.starts_with(&format!(
            "pipeline.yaml:{line}: unknown field `wind_tunel`, expected one of "
        )),
        "{e}"
    );
    assert!(e.ends_with("did you mean `wind_tunnel`?"), "{e}");
}

#[test]
fn an_unknown_key_deep_in_a_file_is_named_with_its_path() {
    let copy = Copy::new();
    let line = copy.spoil("pipeline.yaml", "signal_to_noise: 5", "signal_noise: 5");
    let e = copy.error();
    assert!(
        e.starts_with(&format!(
            "pipeline.yaml:{line}: segment.quality: unknown field `signal_noise`"
        )),
        "{e}"
    );
    assert!(e.ends_with("did you mean `signal_to_noise`?"), "{e}");
}

#[test]
fn an_unknown_word_is_named_with_the_one_that_was_probably_meant() {
    let copy = Copy::new();
    let line = copy.spoil(
        "maneuvers/ppss.yaml",
        "axis: longitudinal",
        "axis: longitudnal",
    );
    let e = copy.error();
    assert!(
        e.starts_with(&format!(
            "maneuvers/ppss.yaml:{line}: axis: unknown variant `longitudnal`"
        )),
        "{e}"
    );
    assert!(e.ends_with("did you mean `longitudinal`?"), "{e}");
}

#[test]
fn yaml_that_cannot_be_read_is_named_by_line() {
    let copy = Copy::new();
    let line = copy.spoil(
        "model.yaml",
        "  - { name: CN_alpha,",
        "  - { name CN_alpha: [,",
    );
    let e = copy.error();
    assert!(e.starts_with(&format!("model.yaml:{line}: ")), "{e}");
}

#[test]
fn a_missing_key_is_named_by_its_file() {
    let copy = Copy::new();
    copy.spoil("pipeline.yaml", "\narchive: ", "\n# archive: ");
    let e = copy.error();
    assert!(e.starts_with("pipeline.yaml:"), "{e}");
    assert!(e.ends_with("missing field `archive`"), "{e}");
}

#[test]
fn a_typo_in_a_derivative_is_answered_with_its_name() {
    let copy = Copy::new();
    let line = copy.spoil("maneuvers/ppss.yaml", "CN_0, CN_alpha,", "CN_0, CN_alhpa,");
    assert_eq!(
        copy.error(),
        format!(
            "maneuvers/ppss.yaml:{line}: class PPSS: no longitudinal derivative `CN_alhpa` in the model; did you mean \
             `CN_alpha`?"
        )
    );
}

#[test]
fn a_derivative_of_the_other_axis_is_none_of_this_class() {
    let copy = Copy::new();
    let line = copy.spoil(
        "maneuvers/ppss.yaml",
        "inactive: [\n",
        "inactive: [ Cl_beta,\n",
    );
    let e = copy.error();
    let expected = format!(
        "maneuvers/ppss.yaml:{line}: class PPSS: no longitudinal derivative `Cl_beta` in the model"
    );
    assert!(e.starts_with(&expected), "{e}");
}

#[test]
fn a_derivative_in_no_list_is_named() {
    let copy = Copy::new();
    copy.spoil("maneuvers/ppss.yaml", "CN_0, CN_alpha,", "CN_0,");
    assert_eq!(
        copy.error(),
        "maneuvers/ppss.yaml:1: class PPSS: `CN_alpha` is neither estimated, held nor inactive"
    );
}

#[test]
fn a_derivative_in_two_lists_is_named() {
    let copy = Copy::new();
    copy.spoil(
        "maneuvers/ppss.yaml",
        "CN_dlef, CN_dtef,",
        "CN_dlef, CN_dtef, CN_de,",
    );
    let e = copy.error();
    assert!(e.starts_with("maneuvers/ppss.yaml:"), "{e}");
    assert!(
        e.ends_with(": `CN_de` stands twice among estimated, held and inactive"),
        "{e}"
    );
}

#[test]
fn a_derivative_twice_in_an_override_is_named() {
    let copy = Copy::new();
    copy.spoil(
        "maneuvers/pyrs.yaml",
        "estimated: [CY_da, Cl_dr]",
        "estimated: [CY_da, Cl_dr]\n    held: [CY_da]",
    );
    let e = copy.error();
    assert!(
        e.ends_with(": `CY_da` stands twice among estimated, held and inactive"),
        "{e}"
    );
}

#[test]
fn a_held_derivative_without_a_tunnel_table_is_named() {
    let copy = Copy::new();
    let line = copy.spoil("maneuvers/olat.yaml", "CY_ddht, CY_dyv,", "CY_dyv,");
    copy.spoil(
        "maneuvers/olat.yaml",
        "inactive: [\n",
        "held: [CY_ddht]\ninactive: [\n",
    );
    let table: String = fs::read_to_string("data/demo/wt_tables.csv").unwrap();
    let without: Vec<&str> = table
        .lines()
        .skip(1)
        .filter(|l| !l.starts_with("CY_ddht") && !l.starts_with("CYddht"))
        .collect();
    let e = copy.error_with_tunnel(&without.join("\n"));
    assert_eq!(
        e,
        format!(
            "maneuvers/olat.yaml:{}: class OLAT: `CY_ddht` is held, and tunnel.csv has no value to hold it at",
            line - 1
        )
    );
}

/// Edit of the model that makes a derivative along q one along α̇.
const LAG_OF_CA: [&str; 2] = [
    "coefficient: CA, regressor: q }",
    "coefficient: CA, regressor: alpha_dot }",
];

#[test]
fn a_lag_is_not_held_by_evidence() {
    let copy = Copy::new();
    copy.spoil("model.yaml", LAG_OF_CA[0], LAG_OF_CA[1]);
    for class in ["3211", "olon", "ppss", "ppsstv", "ssimd_lon"] {
        let file = format!("maneuvers/{class}.yaml");
        copy.spoil(&file, "CA_alpha, CA_q,", "CA_alpha,");
        copy.spoil(&file, "held: [", "held: [CA_q, ");
    }
    let config = copy.load(Overrides::default()).unwrap();
    assert!(
        config
            .aero_model
            .lag_warning()
            .unwrap()
            .starts_with("CA_q: ")
    );
    copy.spoil("pipeline.yaml", "  hold: table\n", "  hold: evidence\n");
    let e = copy.error();
    assert!(
        e.contains("derivatives along `alpha_dot`, which must stay held"),
        "{e}"
    );
}

#[test]
fn a_lag_is_never_estimated() {
    let copy = Copy::new();
    copy.spoil("model.yaml", LAG_OF_CA[0], LAG_OF_CA[1]);
    let e = copy.error();
    assert!(
        e.contains("`CA_q` is estimated; a derivative along `alpha_dot` is held or inactive"),
        "{e}"
    );
}

#[test]
fn a_bias_is_never_held() {
    let copy = Copy::new();
    copy.spoil(
        "maneuvers/ppss.yaml",
        "an_bias, ax_bias, q_bias,",
        "ax_bias, q_bias,",
    );
    let line = copy.spoil("maneuvers/ppss.yaml", "held: [\n", "held: [ an_bias,\n");
    assert_eq!(
        copy.error(),
        format!(
            "maneuvers/ppss.yaml:{line}: class PPSS: a bias is estimated or inactive, not held"
        )
    );
}

#[test]
fn an_unknown_unit_is_answered_with_the_known_ones() {
    let copy = Copy::new();
    let line = copy.spoil(
        "aircraft.yaml",
        "alpha_vane_deg, unit: deg }",
        "alpha_vane_deg, unit: gons }",
    );
    let e = copy.error();
    let expected = format!(
        "aircraft.yaml:{line}: channel `alpha_vane`: unknown unit `gons`; units of its quantity are deg, rad, "
    );
    assert!(e.starts_with(&expected), "{e}");
}

#[test]
fn a_unit_that_cannot_become_the_signal_s_is_named() {
    let copy = Copy::new();
    let line = copy.spoil(
        "aircraft.yaml",
        "q: { signal: q_deg_s, unit: deg/s }",
        "q: { signal: q_deg_s, unit: deg }",
    );
    assert_eq!(
        copy.error(),
        format!("aircraft.yaml:{line}: channel `q`: `deg` cannot become deg/s of `q_deg_s`")
    );
}

#[test]
fn a_signal_without_the_unit_at_its_end_is_told_the_name_to_use() {
    let copy = Copy::new();
    let line = copy.spoil(
        "aircraft.yaml",
        "stick_lat: { signal: stick_lat_in, unit: in }",
        "stick_lat: { signal: stick_lat, unit: mm }",
    );
    assert_eq!(
        copy.error(),
        format!(
            "aircraft.yaml:{line}: channel `stick_lat`: `mm` cannot become - of `stick_lat`: a signal's name ends \
             with the unit that it is kept in, such as `stick_lat_ft`"
        )
    );
}

#[test]
fn a_sign_is_one_or_minus_one() {
    let copy = Copy::new();
    let line = copy.spoil(
        "aircraft.yaml",
        "q_deg_s, unit: deg/s }",
        "q_deg_s, unit: deg/s, sign: -2 }",
    );
    assert_eq!(
        copy.error(),
        format!("aircraft.yaml:{line}: channel `q`: sign is 1 or -1, not -2")
    );
}

#[test]
fn a_formula_is_checked_for_columns_and_units() {
    let qbar = "  qbar: { signal: qbar_psf, unit: lbf/ft2 }";
    let computed = |lines: &str| {
        let copy = Copy::new();
        let line = copy.spoil("aircraft.yaml", qbar, lines);
        (line, copy)
    };
    let good = "  RHO: { unit: kg/m3 }\n  qbar: { signal: qbar_psf, formula: 0.5 * RHO * V^2 }";
    let (_, copy) = computed(good);
    let config = copy.load(Overrides::default()).unwrap();
    let formula = config.channels["qbar"].formula.as_ref().unwrap();
    // 1.225 kg/m3 and 100 ft/s: 569.03 Pa, 11.8845 psf.
    assert_relative_eq!(formula.value(&[1.225, 100.0]), 11.8845, max_relative = 1e-5);
    assert!(!config.channels.contains_key("RHO"));
    for (lines, at, words) in [
        (
            "  qbar: { signal: qbar_psf, formula: 0.5 * RHO * V^2 }",
            0,
            "no column `RHO`",
        ),
        (
            "  RHO: { unit: kg/m3 }\n  qbar: { signal: qbar_psf, formula: 0.5 * RHO * V }",
            1,
            "channel `qbar`: formula `0.5 * RHO * V`: it is in ft-2 slug s-1, which is no lbf/ft2",
        ),
        (
            "  RHO: { unit: kg/m3 }\n  qbar: { signal: qbar_psf, unit: Pa, formula: RHO * V^2 }",
            1,
            "a formula has no `unit`",
        ),
        (
            "  RHO: { unit: kg/m3, sign: -2 }\n  qbar: { signal: qbar_psf, formula: RHO * V^2 }",
            1,
            "`RHO`: sign is 1 or -1, and scale is greater than zero",
        ),
        (
            "  W: { signal: w_deg, formula: da + dr }\n  qbar: { signal: qbar_psf, formula: W }",
            1,
            "`W` is a formula itself",
        ),
        (
            "  qbar: { signal: qbar_psf }",
            0,
            "channel `qbar`: it has no `unit`",
        ),
    ] {
        let (line, copy) = computed(lines);
        let error = copy.error();
        let place = format!("aircraft.yaml:{}: ", line + at);
        assert!(
            error.starts_with(&place) && error.contains(words),
            "{error}"
        );
    }
}

#[test]
fn a_vane_factor_is_greater_than_zero() {
    let copy = Copy::new();
    let line = copy.spoil("aircraft.yaml", "factor: 0.98", "factor: 0");
    assert_eq!(
        copy.error(),
        format!("aircraft.yaml:{line}: `factor` must be greater than zero, not 0")
    );
}

#[test]
fn a_decay_is_not_negative() {
    let copy = Copy::new();
    let line = copy.spoil("maneuvers/ppss.yaml", "decay_s: 2.4", "decay_s: -2.4");
    assert_eq!(
        copy.error(),
        format!("maneuvers/ppss.yaml:{line}: class PPSS: `decay_s` must not be negative, not -2.4")
    );
}

#[test]
fn two_sources_of_a_signal_are_one_too_many() {
    let copy = Copy::new();
    let line = copy.spoil(
        "aircraft.yaml",
        "r: { signal: r_deg_s,",
        "r: { signal: q_deg_s,",
    );
    assert_eq!(
        copy.error(),
        format!("aircraft.yaml:{line}: signal `q_deg_s` has two sources")
    );
}

#[test]
fn a_constant_is_a_source_too() {
    let copy = Copy::new();
    copy.spoil(
        "aircraft.yaml",
        "constants: {}",
        "constants: { mass_slug: 1050 }",
    );
    let e = copy.error();
    assert!(e.starts_with("aircraft.yaml:"), "{e}");
    assert!(e.ends_with(": signal `mass_slug` has two sources"), "{e}");
}

#[test]
fn a_column_that_nothing_uses_is_listed() {
    let copy = Copy::new();
    let qbar = "  qbar: { signal: qbar_psf, unit: lbf/ft2 }";
    copy.spoil(
        "aircraft.yaml",
        qbar,
        &format!("  OAT: {{ unit: degC }}\n{qbar}"),
    );
    let config = copy.load(Overrides::default()).unwrap();
    assert_eq!(config.unused_columns, ["OAT"]);
}

#[test]
fn a_regressor_in_another_spelling_is_answered_with_harvest_s() {
    for (written, meant) in [("alpha^2", "alpha * alpha"), ("\"|alpha|\"", "abs(alpha)")] {
        let copy = Copy::new();
        copy.spoil(
            "model.yaml",
            "name: CN_dlef,   coefficient: CN, regressor: dlef_deg",
            &format!("name: CN_dlef,   coefficient: CN, regressor: {written}"),
        );
        let error = copy.error();
        assert!(
            error.ends_with(&format!("did you mean `{meant}`?")),
            "{error}"
        );
    }
}

#[test]
fn a_table_over_fuel_is_a_channel_in_the_unit_of_its_values() {
    let copy = Copy::new();
    copy.spoil(
        "aircraft.yaml",
        "  Iy: { signal: iy_slug_ft2, unit: slug ft2 }",
        "  FUEL: { unit: lb }\n  Iy: { signal: iy_slug_ft2, unit: kg m2, table: { over: FUEL, at_unit: kg, at: [0, \
         1000, 4000], value: [200000, 205000, 214000] } }",
    );
    let config = copy.load(Overrides::default()).unwrap();
    let channel = &config.channels["Iy"];
    assert_eq!(channel.unit, "kg m2");
    let table = channel.formula.as_ref().unwrap();
    assert_eq!(table.operands()[0].column, "FUEL");
    // 2204.6226 lb are 1000 kg.
    for (pounds, inertia) in [
        (-1.0, 200_000.0),
        (1_102.311_3, 202_500.0),
        (2_204.622_6, 205_000.0),
        (99_999.0, 214_000.0),
    ] {
        assert_relative_eq!(table.value(&[pounds]), inertia, max_relative = 1e-7);
    }
    assert!(!config.channels.contains_key("FUEL"));
}

#[test]
fn a_mistake_of_a_table_is_named_at_its_line() {
    let good = [
        ("over", "FUEL"),
        ("at_unit", "kg"),
        ("at", "[0, 1000, 4000]"),
        ("value", "[200000, 205000, 214000]"),
    ];
    for (key, wrong, words) in [
        ("over", "FEUL", "`over: FEUL`: no column `FEUL`"),
        ("over", "FUEL * FUEL", "which is no kg"),
        ("over", "Iz", "`Iz` is a table itself"),
        ("at_unit", "m", "it is in slug, which is no m"),
        ("at_unit", "stone", "unknown unit `stone`"),
        (
            "at",
            "[0, 4000, 1000]",
            "`at` must increase: 1000 comes after 4000",
        ),
        ("at", "[0, 1000]", "`value` has 3 numbers and `at` 2"),
        ("at", "[0, .nan, 2]", "finite"),
        ("at", "[-5, 1000, 4000]", "no mass is -5 kg"),
        ("value", "[200000, 205000, -214000]", "is greater than zero"),
        (
            "value",
            "[200000, 205000, 21400]",
            "is a digit or a decimal point wrong?",
        ),
        ("value", "[2e5]", "`value` has 1 numbers"),
    ] {
        let copy = Copy::new();
        let line = |(own, text): &(&str, &str)| {
            let text = if *own == key { wrong } else { text };
            format!("      {own}: {text}\n")
        };
        let lines: String = good.iter().map(line).collect();
        let iz = "  Iz: { signal: iz_slug_ft2, unit: slug ft2 }\n";
        copy.spoil("aircraft.yaml", iz, "");
        let first = copy.spoil(
            "aircraft.yaml",
            "  Iy: { signal: iy_slug_ft2, unit: slug ft2 }",
            &format!(
                "  FUEL: {{ unit: kg }}\n  Iy:\n    signal: iy_slug_ft2\n    unit: kg m2\n    table:\n{lines}  \
                 Iz: {{ signal: iz_slug_ft2, unit: kg m2, table: {{ over: FUEL, at_unit: kg, at: [0, 1], value: [1, 2] \
                 }} }}"
            ),
        );
        let error = copy.error();
        let named = match words {
            words if words.starts_with("`value` has") => "value",
            words if words.ends_with("which is no m") => "over",
            _ => key,
        };
        let at = good.iter().position(|(own, _)| *own == named).unwrap();
        let place = format!("aircraft.yaml:{}: ", first + 5 + at);
        assert!(
            error.starts_with(&place) && error.contains(words),
            "{place} {words}: {error}"
        );
    }
}

#[test]
fn a_table_has_a_unit_and_nothing_of_a_column_or_a_formula() {
    let table = "table: { over: V, at_unit: ft/s, at: [0, 1], value: [1, 2] }";
    for (line, words) in [
        (
            "signal: iy_slug_ft2",
            "a table needs a `signal`, and a `unit`",
        ),
        ("unit: slug ft2", "a table needs a `signal`, and a `unit`"),
        (
            "signal: iy_slug_ft2, unit: slug ft2, sign: -1",
            "has no `sign`",
        ),
        (
            "signal: iy_slug_ft2, unit: ft, formula: V",
            "has no `formula`",
        ),
        (
            "signal: iy_slug_ft2, unit: ft",
            "`ft` cannot become slug ft2",
        ),
        (
            "signal: time_s, unit: s",
            "the clock is a column, not a table",
        ),
    ] {
        let copy = Copy::new();
        let at = copy.spoil(
            "aircraft.yaml",
            "  Iy: { signal: iy_slug_ft2, unit: slug ft2 }",
            &format!("  Iy: {{ {line}, {table} }}"),
        );
        let error = copy.error();
        let place = format!("aircraft.yaml:{at}: channel `Iy`: ");
        assert!(
            error.starts_with(&place) && error.contains(words),
            "{words}: {error}"
        );
    }
}

#[test]
fn a_required_signal_without_a_source_has_its_remedies() {
    let copy = Copy::new();
    let lines = [
        "  theta: { signal: theta_deg, unit: deg }\n",
        "  phi: { signal: phi_deg, unit: deg }\n",
    ];
    for line in lines {
        copy.spoil("aircraft.yaml", line, "");
    }
    let error = copy.error();
    for words in [
        "gives the signal `theta_deg`: give a line",
        "formula",
        "all of `beta_vane_deg`",
    ] {
        assert!(error.contains(words), "`{words}` is not in {error}");
    }
    assert!(!error.contains("did you mean"), "{error}");
}

#[test]
fn the_value_in_place_of_a_signal_without_a_source_may_have_an_uncertainty() {
    let copy = Copy::new();
    copy.spoil(
        "aircraft.yaml",
        "  thrust: { signal: thrust_lbf, unit: lbf }\n",
        "",
    );
    copy.spoil(
        "aircraft.yaml",
        "  thrust_lbf: { uncertainty: { scale_pct: 1 } }\n",
        "  thrust_lbf: { uncertainty: { bias: 9000 } }\n",
    );
    let config = copy.load(Overrides::default()).unwrap();
    let stated = config.estimate.calibration["thrust_lbf"];
    assert!((stated.bias - 9000.0).abs() < 1e-9);
    let absences = config.absences();
    assert!(
        absences.iter().any(|line| line.contains("no `thrust_lbf`")),
        "{absences:?}"
    );
}

/// The line of `check` that begins so, of a pipeline whose channel map lacks these lines.
fn absence_without(channels: &[&str], begin: &str) -> String {
    let copy = Copy::new();
    copy.unmap(channels);
    let config = copy.load(Overrides::default()).unwrap();
    let absences = config.absences();
    let line = absences.iter().find(|line| line.starts_with(begin));
    line.unwrap_or_else(|| panic!("{absences:?}")).clone()
}

#[test]
fn a_flag_or_control_that_no_channel_gives_is_an_absence_with_its_cost() {
    let flag = absence_without(&["obes"], "no `obes`: ");
    assert!(flag.contains("by their inputs alone"), "{flag}");
    let pedal = absence_without(&["pedal"], "no `pedal_in`: ");
    assert!(
        pedal.contains("stand for its steps in maneuvers of"),
        "{pedal}"
    );
    assert!(!pedal.contains("cannot be recognised"), "{pedal}");
    let all = ["obes", "tvcs", "stick_pitch", "stick_lat", "pedal"];
    absence_without(&all, "no `stick_pitch_in`: ");
}

#[test]
fn an_instrument_of_a_signal_that_no_channel_gives_is_an_absence() {
    let heading = absence_without(&["psi"], "no `psi_deg`: ");
    assert!(heading.contains("larger bounds"), "{heading}");
    let copy = Copy::new();
    copy.spoil(
        "aircraft.yaml",
        "  dyv_deg: { uncertainty: { bias: 0.05, scale_pct: 0.2 } }\n",
        "  dyv_deg: { uncertainty: { bias: 0.05, scale_pct: 0.2 } }\n  fuel_flow: { uncertainty: { bias: 1 } }\n",
    );
    let absences = copy.load(Overrides::default()).unwrap().absences();
    assert!(
        absences.contains(&"no `fuel_flow`: no result depends on it".to_owned()),
        "{absences:?}"
    );
}

#[test]
fn a_surface_that_no_channel_gives_costs_the_classes_that_need_it() {
    let vanes = absence_without(&["dyv"], "no `dyv_deg`: ");
    for words in [
        "maneuvers of SSIMD_LAT cannot be recognised",
        "maneuvers of PYRSTV are found and not estimated",
        "its effect is left out of maneuvers of OLAT, PYRS",
    ] {
        assert!(vanes.contains(words), "`{words}` is not in {vanes}");
    }
}

#[test]
fn a_pipeline_of_which_no_class_is_left_is_refused() {
    let copy = Copy::new();
    copy.unmap(&["de", "da"]);
    let error = copy.error();
    assert!(
        error.starts_with("aircraft.yaml:")
            && error.contains("no class is left")
            && error.contains("`da_deg`, `de_deg`"),
        "{error}"
    );
}

#[test]
fn a_signal_misspelt_in_the_channel_map_is_no_absence() {
    let copy = Copy::new();
    copy.spoil("aircraft.yaml", "{ signal: obes,", "{ signal: obse,");
    let error = copy.error();
    assert!(error.contains("`obes`; did you mean `obse`?"), "{error}");
    // Misspelt where it is used, and absent: the other uses say what was meant.
    let copy = Copy::new();
    copy.unmap(&["obes"]);
    copy.spoil(
        "pipeline.yaml",
        "excitation_flag: obes",
        "excitation_flag: obse",
    );
    let error = copy.error();
    assert!(error.contains("`obse`; did you mean `obes`?"), "{error}");
}

#[test]
fn a_step_size_of_a_signal_that_nothing_else_names_is_refused() {
    let copy = Copy::new();
    let line = copy.spoil(
        "pipeline.yaml",
        "    pedal_in: 1\n",
        "    pedal_in: 1\n    canard: 1\n",
    );
    assert_eq!(
        copy.error(),
        format!(
            "pipeline.yaml:{}: segment: no channel gives the signal `canard`",
            line + 1
        )
    );
}

#[test]
fn what_files_lack_has_the_words_of_the_channel_map() {
    let whole = Copy::new().load(Overrides::default()).unwrap();
    let lacking = ["psi_deg", "obes", "dyv_deg"].map(str::to_owned).into();
    let in_files = whole.absences_in_files(&lacking);
    let copy = Copy::new();
    copy.unmap(&["psi", "obes", "dyv"]);
    let without = copy.load(Overrides::default()).unwrap();
    let of_map = whole.absences();
    let mut in_map = without.absences();
    in_map.retain(|line| !of_map.contains(line));
    assert_eq!(in_files, in_map);
    assert_eq!(in_files.len(), 3, "{in_files:?}");
    assert_eq!(whole.absences_in_files(&[].into()), Vec::<String>::new());
}

#[test]
fn a_required_signal_without_a_source_is_named() {
    let copy = Copy::new();
    copy.spoil(
        "aircraft.yaml",
        "  Iy: { signal: iy_slug_ft2, unit: slug ft2 }\n",
        "",
    );
    let text = fs::read_to_string(copy.path("aircraft.yaml")).unwrap();
    let line = text.lines().position(|l| l == "channels:").unwrap() + 1;
    let e = copy.error();
    let expected =
        format!("aircraft.yaml:{line}: no channel or constant gives the signal `iy_slug_ft2`");
    assert!(e.starts_with(&expected), "{e}");
}

#[test]
fn a_weight_that_is_missing_is_named() {
    let copy = Copy::new();
    let line = copy.spoil(
        "maneuvers/ppss.yaml",
        "weights: { alpha: 5, q: 8,",
        "weights: { alpha: 5,",
    );
    assert_eq!(
        copy.error(),
        format!("maneuvers/ppss.yaml:{line}: class PPSS: `weights` lacks `q`")
    );
}

#[test]
fn a_weight_of_the_other_axis_is_named() {
    let copy = Copy::new();
    let line = copy.spoil(
        "maneuvers/ppss.yaml",
        "weights: { alpha: 5,",
        "weights: { alpha: 5, beta: 12,",
    );
    assert_eq!(
        copy.error(),
        format!(
            "maneuvers/ppss.yaml:{line}: class PPSS: `beta` is no longitudinal output; they are `alpha`, `q`, `theta`, \
             `an`, `ax`"
        )
    );
}

#[test]
fn a_weight_is_greater_than_zero() {
    for wrong in ["0", "-8", ".nan"] {
        let copy = Copy::new();
        let line = copy.spoil("maneuvers/ppss.yaml", "q: 8,", &format!("q: {wrong},"));
        assert_eq!(
            copy.error(),
            format!(
                "maneuvers/ppss.yaml:{line}: class PPSS: the weight of `q` must be greater than zero"
            )
        );
    }
}

#[test]
fn recognition_by_an_unknown_signal_is_answered_with_the_one_that_was_meant() {
    let copy = Copy::new();
    let line = copy.spoil(
        "maneuvers/ppss.yaml",
        "stick_pitch_in: {",
        "stick_pich_in: {",
    );
    assert_eq!(
        copy.error(),
        format!(
            "maneuvers/ppss.yaml:{line}: class PPSS: no channel gives the signal `stick_pich_in`; did you mean \
             `stick_pitch_in`?"
        )
    );
}

#[test]
fn recognition_by_steps_of_no_stated_size_is_named() {
    let copy = Copy::new();
    let line = copy.spoil("maneuvers/ppss.yaml", "pedal_in: {", "theta_deg: {");
    assert_eq!(
        copy.error(),
        format!(
            "maneuvers/ppss.yaml:{line}: class PPSS: `segment: steps:` of pipeline.yaml gives no size for steps of \
             `theta_deg`"
        )
    );
}

#[test]
fn an_unknown_word_of_recognition_is_answered_with_the_one_that_was_meant() {
    let copy = Copy::new();
    copy.spoil("maneuvers/3211.yaml", "{widths: [", "{width: [");
    let e = copy.error();
    assert!(
        e.starts_with("maneuvers/3211.yaml:") && e.ends_with("did you mean `widths`?"),
        "{e}"
    );
    let copy = Copy::new();
    copy.spoil("maneuvers/3211.yaml", "  pulses:", "  pulse:");
    let e = copy.error();
    assert!(
        e.starts_with("maneuvers/3211.yaml:") && e.ends_with("did you mean `pulses`?"),
        "{e}"
    );
}

#[test]
fn numbers_that_no_campaign_has_are_named_with_their_range() {
    for (file, from, to, said) in [
        (
            "maneuvers/ppss.yaml",
            "lead_in_s: 1.0",
            "lead_in_s: 1e9",
            "`lead_in_s` must lie between 0 and 86400, not 1000000000",
        ),
        (
            "maneuvers/3211.yaml",
            "widths: [3, 2, 1, 1]",
            "widths: [3, 2, 1, 1e9]",
            "`widths` must lie between 0.001 and 1000, not 1000000000",
        ),
        (
            "maneuvers/3211.yaml",
            "tolerance: 0.35",
            "tolerance: 1e4",
            "`tolerance` must lie between 0 and 1000, not 10000",
        ),
        (
            "maneuvers/ppss.yaml",
            "weights: { alpha: 5, q: 8, theta: 4, an: 150, ax: 250 }",
            "weights: { alpha: 5, q: 8, theta: 4, an: 1e300, ax: 250 }",
            "`an` must lie between 0 and 1000000000000",
        ),
        (
            "pipeline.yaml",
            "report:\n",
            "model: { expert: { length_deg: 1e-9 } }\nreport:\n",
            "`length_deg` must lie between 0.1 and 180, not 0.000000001",
        ),
        (
            "pipeline.yaml",
            "report:\n",
            "model: { expert: { degrees_of_freedom: 0 } }\nreport:\n",
            "`degrees_of_freedom` must lie between 1 and 1000000000000, not 0",
        ),
    ] {
        let copy = Copy::new();
        copy.spoil(file, from, to);
        let e = copy.error();
        assert!(e.starts_with(file) && e.contains(said), "{e}");
    }
}

#[test]
fn patterns_that_cannot_be_are_named_with_their_line() {
    for (from, to, said) in [
        (
            "widths: [3, 2, 1, 1]",
            "widths: [3]",
            "`widths` are the lengths of two pulses or more",
        ),
        (
            "unit_s: [0.2, 2]",
            "unit_s: [2, 0.2]",
            "`unit_s` is the shortest unit and the longest",
        ),
        (
            "tolerance: 0.35",
            "tolerance: 0",
            "`tolerance` must be greater than zero",
        ),
    ] {
        let copy = Copy::new();
        let line = copy.spoil("maneuvers/3211.yaml", from, to);
        let e = copy.error();
        assert!(
            e.starts_with(&format!("maneuvers/3211.yaml:{line}: class 3211: {said}")),
            "{e}"
        );
    }
    for (sweep, said) in [
        ("{at_least: 3}", "at least 4 swings"),
        ("{at_least: 9, ratio: 0.5}", "`ratio` must be greater"),
    ] {
        let copy = Copy::new();
        let line = copy.spoil(
            "maneuvers/olon.yaml",
            "  lead_in_s:",
            &format!("  sweep: {{de_deg: {sweep}}}\n  lead_in_s:"),
        );
        let e = copy.error();
        assert!(
            e.contains(said) && e.starts_with("maneuvers/olon.yaml:"),
            "{line}: {e}"
        );
    }
}

#[test]
fn a_class_that_nothing_makes_is_named() {
    let copy = Copy::new();
    copy.spoil(
        "maneuvers/ppss.yaml",
        "{at_least: 7, at_most: 12}",
        "{at_most: 12}",
    );
    let e = copy.error();
    assert!(e.contains("class PPSS: nothing makes this maneuver"), "{e}");
}

#[test]
fn pilot_controls_and_actuators_of_no_signal_are_answered_with_the_one_that_was_meant() {
    let copy = Copy::new();
    let line = copy.spoil(
        "pipeline.yaml",
        "[stick_pitch_in, stick_lat_in, pedal_in]",
        "[stick_pitch_in, pedal_inn]",
    );
    assert_eq!(
        copy.error(),
        format!(
            "pipeline.yaml:{line}: segment: no channel gives the signal `pedal_inn`; did you mean `pedal_in`?"
        )
    );
    let copy = Copy::new();
    let line = copy.spoil(
        "pipeline.yaml",
        "lower_deg: -24, upper_deg: 10.5",
        "lower_deg: 24, upper_deg: 10.5",
    );
    let e = copy.error();
    assert!(
        e.starts_with(&format!(
            "pipeline.yaml:{line}: the actuator of `de_deg` needs"
        )),
        "{e}"
    );
    let copy = Copy::new();
    let line = copy.spoil("pipeline.yaml", "other_axis: 0.2 ", "other_axis: -1 ");
    assert_eq!(
        copy.error(),
        format!("pipeline.yaml:{line}: `other_axis` must not be negative, not -1")
    );
}

#[test]
fn a_trend_group_of_an_unknown_derivative_is_answered_with_the_one_that_was_meant() {
    let copy = Copy::new();
    let line = copy.spoil(
        "pipeline.yaml",
        "derivatives: [CN_q, Cm_q]",
        "derivatives: [CN_q, Cm_qq]",
    );
    assert_eq!(
        copy.error(),
        format!("pipeline.yaml:{line}: unknown derivative `Cm_qq`; did you mean `Cm_q`?")
    );
}

#[test]
fn a_trend_group_of_an_unknown_class_is_answered_with_the_one_that_was_meant() {
    let copy = Copy::new();
    let line = copy.spoil("pipeline.yaml", "classes: [PPSSTV]", "classes: [PPSTV]");
    assert_eq!(
        copy.error(),
        format!("pipeline.yaml:{line}: unknown class `PPSTV`; did you mean `PPSSTV`?")
    );
}

#[test]
fn errors_of_an_unknown_instrument_or_of_a_negative_size_are_refused() {
    let copy = Copy::new();
    let line = copy.spoil("aircraft.yaml", "  qbar_psf:\n", "  qbar_psi:\n");
    assert_eq!(
        copy.error(),
        format!(
            "aircraft.yaml:{line}: instruments: no channel gives the signal `qbar_psi`; did you mean `qbar_psf`?"
        )
    );
    let copy = Copy::new();
    let line = copy.spoil("aircraft.yaml", "{ scale_pct: 0.5 }", "{ scale_pct: -0.5 }");
    let instrument = line - 1;
    assert_eq!(
        copy.error(),
        format!(
            "aircraft.yaml:{instrument}: `qbar_psf`: sizes of errors are not negative, not -0.5"
        )
    );
}

/// Error of the shipped pipeline with a section in front of it.
fn error_with(section: &str, old: &str) -> (usize, String) {
    let copy = Copy::new();
    let line = copy.spoil("pipeline.yaml", section, &format!("{section}{old}"));
    (line, copy.error())
}

#[test]
fn an_old_key_is_refused_with_its_new_place_and_line() {
    let (line, e) = error_with("\ningest:\n", "  checks:\n    jumps_share: 0.3\n");
    let line = line + 3;
    assert_eq!(
        e,
        format!(
            "pipeline.yaml:{line}: `ingest: checks: jumps_share` is now `ingest: expert: checks: jumps_share`"
        )
    );
    let (line, e) = error_with("\nestimate:\n", "  max_marked_share: 0.3\n");
    let line = line + 2;
    assert_eq!(
        e,
        format!(
            "pipeline.yaml:{line}: `estimate: max_marked_share` is now `segment: quality: marked_share`"
        )
    );
}

#[test]
fn all_old_keys_are_named_at_once() {
    let old =
        "  calibration:\n    an_g: { bias: 0.1, scale_pct: 1 }\n  iteration: { tolerance: 1e-9 }\n";
    let (line, e) = error_with("\nestimate:\n", old);
    let first = format!(
        "pipeline.yaml:{}: `estimate: calibration` is now `instruments: <signal>: uncertainty` of aircraft.yaml",
        line + 2
    );
    let second = format!(
        "pipeline.yaml:{}: `estimate: iteration: tolerance` is now `estimate: expert: iteration: tolerance`",
        line + 4
    );
    assert_eq!(e, format!("{first}\n{second}"));
}

#[test]
fn keys_that_several_stages_share_reach_each_of_them() {
    let copy = Copy::new();
    copy.spoil(
        "pipeline.yaml",
        "\ningest:\n",
        "\ningest:\n  expert: { fault_standard_errors: 5 }\n",
    );
    copy.spoil(
        "pipeline.yaml",
        "    marked_share: 0.2 ",
        "    marked_share: 0.3 ",
    );
    copy.spoil(
        "pipeline.yaml",
        "  # joint: { alpha_bin_deg: 2.5 }",
        "  expert: { share_constants: true }\n  joint: {} #",
    );
    let config = copy.load(Overrides::default()).unwrap();
    assert_relative_eq!(config.ingest.checks.standard_errors, 5.0);
    assert_relative_eq!(config.ingest.compatibility.fault_standard_errors, 5.0);
    assert_relative_eq!(config.estimate.max_marked_share, 0.3);
    assert!(config.estimate.joint.unwrap().share_constants);
    assert!(config.estimate.prediction.unwrap().share_constants);
}

#[test]
fn a_regressor_that_no_channel_gives_is_named() {
    let copy = Copy::new();
    let line = copy.spoil(
        "model.yaml",
        "name: CN_dlef,   coefficient: CN, regressor: dlef_deg",
        "name: CN_dlef,   coefficient: CN, regressor: dlaf_deg",
    );
    assert_eq!(
        copy.error(),
        format!(
            "model.yaml:{line}: CN_dlef: no channel gives the signal `dlaf_deg`; did you mean `dlef_deg`?"
        )
    );
}

#[test]
fn two_classes_of_one_name_are_one_too_many() {
    let copy = Copy::new();
    copy.spoil("maneuvers/ppss.yaml", "class: PPSS\n", "class: PPSSTV\n");
    assert_eq!(
        copy.error(),
        "maneuvers/ppsstv.yaml:1: class `PPSSTV` is defined twice"
    );
}

#[test]
fn an_event_of_an_unknown_class_is_answered_with_the_one_that_was_meant() {
    assert_eq!(
        Copy::new().error_with_events("flight_001,PPSS,118,132\nflight_001,PPS,233,246\n"),
        "events.csv:3: unknown class `PPS`; did you mean `PPSS`?"
    );
}

#[test]
fn an_event_starts_before_it_ends() {
    for times in ["132,118", "118,118"] {
        assert_eq!(
            Copy::new().error_with_events(&format!("flight_001,PPSS,{times}\n")),
            "events.csv:2: the event ends before it starts"
        );
    }
}

#[test]
fn an_event_with_a_time_that_is_no_number_is_named_by_line_and_column() {
    assert_eq!(
        Copy::new().error_with_events("flight_001,PPSS,noon,132\n"),
        "events.csv:2: column `start_s`: invalid float literal"
    );
}

#[test]
fn an_angle_of_attack_beyond_a_half_turn_is_named() {
    assert_eq!(
        Copy::new().error_with_tunnel("CN_alpha,10,0.08,per_deg\nCN_alpha,200,0.08,per_deg\n"),
        "tunnel.csv:3: `CN_alpha` has the angle of attack 200 deg; it lies between -180 and 180"
    );
}

#[test]
fn a_tunnel_table_in_another_unit_is_named() {
    assert_eq!(
        Copy::new().error_with_tunnel("CN_alpha,10,0.08,per_deg\nCN_alpha,20,2.2,lbf\n"),
        "tunnel.csv:3: `CN_alpha` is in `lbf`, which cannot become the model's `per_deg`"
    );
    assert_eq!(
        Copy::new().error_with_tunnel("CN_de,10,300,lbf_per_deg\n"),
        "tunnel.csv:2: `CN_de` is in `lbf_per_deg`, which cannot become the model's `per_deg`; a thrust-vectoring vane has `vane: \
         true` in model.yaml"
    );
}

#[test]
fn a_tunnel_value_that_is_no_number_is_named_by_line_and_column() {
    assert_eq!(
        Copy::new().error_with_tunnel("CN_alpha,10,o.08,per_deg\n"),
        "tunnel.csv:2: column `value`: invalid float literal"
    );
    assert_eq!(
        Copy::new().error_with_tunnel("CN_alpha,10,NaN,per_deg\n"),
        "tunnel.csv:2: `CN_alpha` has a value that is no number"
    );
}

#[test]
fn faults_of_a_tunnel_database_are_named_as_what_they_are() {
    let of = |rows: &str| Copy::new().error_with_tunnel(rows);
    assert_eq!(of(""), "tunnel.csv: the tunnel database has no rows");
    let misspelt = of("CN_alpha,5,0.07,per_deg\nCm_dee,5,-0.01,per_deg\nCm_dee,10,-0.01,per_deg\n");
    assert_eq!(
        misspelt,
        "tunnel.csv:3: the model has no derivative `Cm_dee`; did you mean `Cm_de`, which has no rows?"
    );
    let copy = Copy::new();
    let header = "derivative,alpha_deg,value,unit,uncertainty";
    let path = copy.write(
        "tunnel.csv",
        &format!("{header}\nCm_de,5,-0.01,per_deg,-0.1\n"),
    );
    let tunnel = || Overrides {
        wind_tunnel: Some(path.clone()),
        ..Overrides::default()
    };
    assert_eq!(
        copy.load(tunnel()).unwrap_err(),
        "tunnel.csv:2: `Cm_de` has the uncertainty -0.1; none is negative"
    );
    copy.write(
        "tunnel.csv",
        "derivative;alpha_deg;value;unit\nCm_de;5;-0,01;per_deg\n",
    );
    let error = copy.load(tunnel()).unwrap_err();
    assert!(
        error.starts_with("tunnel.csv: its columns are separated by semicolons"),
        "{error}"
    );
}

#[test]
fn an_event_at_no_time_and_an_empty_list_are_named() {
    assert_eq!(
        Copy::new().error_with_events("flight_001,PPSS,NaN,130\n"),
        "events.csv:2: column `start_s`: NaN is no time"
    );
    let copy = Copy::new();
    let overrides = Overrides {
        events: Some(copy.write("events.csv", "")),
        ..Overrides::default()
    };
    assert_eq!(
        copy.load(overrides).unwrap_err(),
        "events.csv: the file is empty: its first line must name its columns"
    );
}

#[test]
fn a_folder_without_a_pipeline_says_what_one_is() {
    let copy = Copy::new();
    fs::remove_file(copy.path("pipeline.yaml")).unwrap();
    assert!(copy.error().contains(
        "a pipeline is a folder with pipeline.yaml, aircraft.yaml, model.yaml and maneuvers/"
    ));
}

#[test]
fn a_missing_file_of_a_pipeline_is_named() {
    let copy = Copy::new();
    fs::remove_file(copy.path("model.yaml")).unwrap();
    assert!(
        copy.error().starts_with("model.yaml: cannot read it"),
        "{}",
        copy.error()
    );
}

#[test]
fn a_pipeline_without_classes_says_so() {
    let copy = Copy::new();
    for file in fs::read_dir(copy.path("maneuvers")).unwrap() {
        fs::remove_file(file.unwrap().path()).unwrap();
    }
    let says = || {
        copy.error()
            .starts_with("maneuvers: no maneuver class: each is a file `<class>.yaml` here")
    };
    assert!(says(), "{}", copy.error());
    fs::remove_dir(copy.path("maneuvers")).unwrap();
    assert!(says(), "{}", copy.error());
}

#[test]
fn a_tunnel_per_radian_becomes_one_per_degree() {
    let copy = Copy::new();
    let table = fs::read_to_string("data/demo/wt_tables.csv").unwrap();
    let path = copy.write(
        "tunnel.csv",
        &table.replace("CNalpha,5,0.0968867536,per_deg", "CNalpha,5,5.0,1/rad"),
    );
    let config = copy
        .load(Overrides {
            wind_tunnel: Some(path),
            ..Overrides::default()
        })
        .unwrap();
    let value = config.tunnel.value("CN_alpha", 5.0, 0.3).unwrap().value;
    approx::assert_relative_eq!(value, 5.0_f64.to_radians(), max_relative = 1e-14);
}

#[test]
fn a_second_value_at_one_place_and_a_mach_number_in_some_rows_only_are_named() {
    let e = Copy::new().error_with_tunnel("CN_alpha,10,0.08,per_deg\nCNalpha,10,0.09,per_deg\n");
    assert!(
        e.starts_with("tunnel.csv:3: `CNalpha` has a second value at alpha 10 deg"),
        "{e}"
    );
    let copy = Copy::new();
    let rows =
        "derivative,alpha_deg,mach,value,unit\nCN_q,10,0.3,4.0,per_rad\nCN_q,15,,4.0,per_rad\n";
    let path = copy.write("mach.csv", rows);
    let e = copy
        .load(Overrides {
            wind_tunnel: Some(path),
            ..Overrides::default()
        })
        .unwrap_err();
    assert!(
        e.starts_with("mach.csv:3: `CN_q` has Mach number or third variable in some rows"),
        "{e}"
    );
}

#[test]
fn a_third_variable_without_a_column_is_named() {
    let copy = Copy::new();
    copy.spoil("pipeline.yaml", "  # third: {", "  third: {");
    let e = copy.error();
    assert_eq!(
        e,
        "data/demo/wt_tables.csv: no table depends on `altitude_ft`, which pipeline.yaml names (tunnel: third:)"
    );
}

#[test]
fn numbers_that_no_campaign_has_are_refused_at_their_line() {
    let cases = [
        ("memory_mb: 200 #", "memory_mb", "-1 #"),
        ("memory_mb: 200 #", "memory_mb", ".nan #"),
        ("longest_bridge_s: 0.25", "longest_bridge_s", "-0.25"),
        ("longest_clock_gap_s: 600", "longest_clock_gap_s", ".inf"),
        ("alpha_step_deg: 5", "alpha_step_deg", "0.00001"),
        ("marked_share: 0.2", "marked_share", "20"),
        ("stick_lat_in: 1", "stick_lat_in", "0"),
        ("standard_errors: 2", "standard_errors", "-2"),
        (
            "histories_at_alpha_deg: 30",
            "histories_at_alpha_deg",
            ".nan",
        ),
        ("max_order: 10", "max_order", "4000000000"),
    ];
    for (given, name, wrong) in cases {
        let copy = Copy::new();
        let line = copy.spoil("pipeline.yaml", given, &format!("{name}: {wrong}"));
        let error = copy.error();
        assert!(
            error.starts_with(&format!("pipeline.yaml:{line}: `{name}` must ")),
            "{error}"
        );
    }
    let copy = Copy::new();
    let line = copy.spoil(
        "aircraft.yaml",
        "engine_inertia_slug_ft2: 3.0",
        "engine_inertia_slug_ft2: .inf",
    );
    let error = copy.error();
    assert!(
        error.starts_with(&format!(
            "aircraft.yaml:{line}: `engine_inertia_slug_ft2` must "
        )),
        "{error}"
    );
}

#[test]
fn a_constant_mass_is_greater_than_zero() {
    let copy = Copy::new();
    copy.spoil(
        "aircraft.yaml",
        "  mass: { signal: mass_slug, unit: slug }
",
        "",
    );
    let line = copy.spoil(
        "aircraft.yaml",
        "constants: {}",
        "constants: { mass_slug: -1111 }",
    );
    assert_eq!(
        copy.error(),
        format!("aircraft.yaml:{line}: `mass_slug` must be greater than zero, not -1111")
    );
}

#[test]
fn what_the_parser_takes_long_for_is_refused_at_once() {
    let deep = "[".repeat(100_000);
    let keys: Vec<String> = (0..100_000).map(|k| format!("k{k}: 1\n")).collect();
    let begun = std::time::Instant::now();
    for (text, error) in [
        (
            format!("title: t\narchive: {deep}"),
            "pipeline.yaml:2: brackets are nested",
        ),
        (
            format!("title: t\na: [\" #\", {deep}"),
            "pipeline.yaml:2: brackets are nested",
        ),
        (
            "%TAG !t! t:x\n".repeat(50_000),
            "pipeline.yaml:1: a line begins with `%`",
        ),
        (keys.concat(), "pipeline.yaml:1: unknown field `k0`"),
        (
            "#\n".repeat(1_000_000),
            "pipeline.yaml: it is larger than 1 MB",
        ),
    ] {
        let copy = Copy::new();
        let path = copy.write("pipeline.yaml", &text);
        let found = copy.error();
        assert!(found.starts_with(error), "{found}");
        assert!(path.is_file());
    }
    assert!(begun.elapsed().as_secs() < 60, "{:?}", begun.elapsed());
}

#[test]
fn settings_of_trends_tunnel_and_export_are_checked_by_line() {
    let copy = Copy::new();
    let line = copy.spoil(
        "pipeline.yaml",
        "interpolation: linear",
        "interpolation: cubic",
    );
    let e = copy.error();
    assert!(
        e.starts_with(&format!("pipeline.yaml:{line}: ")) && e.contains("monotone_cubic"),
        "{e}"
    );
    let copy = Copy::new();
    let line = copy.spoil("pipeline.yaml", "outlier_z: 3", "outlier_z: 0");
    assert_eq!(
        copy.error(),
        format!("pipeline.yaml:{line}: `outlier_z` must be greater than zero, not 0")
    );
    let copy = Copy::new();
    let line = copy.spoil(
        "pipeline.yaml",
        "# export:\n",
        "export: { jsbsim_properties: { de_dg: fcs/de } }\n",
    );
    let e = copy.error();
    assert!(
        e.starts_with(&format!(
            "pipeline.yaml:{line}: export: no derivative is of the signal `de_dg`; did you mean"
        )),
        "{e}"
    );
}

#[test]
fn a_place_in_an_object_store_is_an_archive_or_a_store_with_a_cache_and_nothing_else() {
    let copy = Copy::new();
    let own = |store: &str| Overrides {
        store: Some(store.into()),
        ..Overrides::default()
    };
    if cfg!(feature = "s3") {
        copy.spoil(
            "pipeline.yaml",
            "\narchive: data/demo/flights",
            "\narchive: s3://fleet/flights",
        );
        let config = copy.load(own("s3://fleet/store")).unwrap();
        assert_eq!(config.archive, "s3://fleet/flights");
        assert_eq!(config.shared_store, Some("s3://fleet/store".into()));
        assert!(config.store.starts_with("data/store"));
        let cached = Overrides {
            store_cache: Some("cache".into()),
            ..own("s3://fleet/store")
        };
        assert_eq!(copy.load(cached).unwrap().store, PathBuf::from("cache"));
        assert!(
            copy.load(own("s3:///store"))
                .unwrap_err()
                .contains("expected s3://bucket/prefix")
        );
    } else {
        assert!(
            copy.load(own("s3://fleet/store"))
                .unwrap_err()
                .contains("--features s3")
        );
        let archive = Overrides {
            archive: Some("s3://fleet/flights".into()),
            ..Overrides::default()
        };
        assert!(
            copy.load(archive)
                .unwrap_err()
                .starts_with("s3://fleet/flights: ")
        );
    }
    let reports = Overrides {
        reports: Some("s3://fleet/reports".into()),
        ..Overrides::default()
    };
    assert!(
        copy.load(reports)
            .unwrap_err()
            .contains("it cannot lie in an object store")
    );
    let line = copy.spoil(
        "pipeline.yaml",
        "\n# store_cache: data/store/harv",
        "\nstore_cache: data/store/harv",
    ) + 1;
    let error = copy.error();
    assert!(
        error.starts_with(&format!("pipeline.yaml:{line}: `store_cache`")),
        "{error}"
    );
}

#[test]
fn levels_of_flying_qualities_are_ranges_that_widen() {
    let first =
        "categories: [A], level_1: { min: 0.28, max: 3.6 }, level_2: { min: 0.16, max: 10 }";
    for (levels, said) in [
        (
            "level_1: { min: 0.28, max: -1 }, level_2: { min: 0.16, max: 10 }",
            "the `min` 0.28 of level 1 is above its `max` -1",
        ),
        (
            "level_1: { min: 0.28, max: 3.6 }, level_2: { min: 0.5, max: 10 }",
            "level 2 allows less than level 1: its `min` is 0.5, that of level 1 0.28",
        ),
        (
            "level_1: { min: 0.28, max: 3.6 }, level_2: { min: 0.16, max: 3 }",
            "level 2 allows less than level 1: its `max` is 3, that of level 1 3.6",
        ),
    ] {
        let copy = Copy::new();
        let line = copy.spoil(
            "qualities.yaml",
            first,
            &format!("categories: [A], {levels}"),
        );
        let place = format!("qualities.yaml:{line}: a limit of `control_anticipation`: ");
        assert_eq!(copy.error(), place + said);
    }
}

#[test]
fn parts_of_the_flying_qualities_that_have_no_effect_are_named() {
    let requirement = "limits:
      - { quantity: phugoid_damping, level_1: { min: 0.04 }, level_2: { min: 0 } }
      - { quantity: phugoid_time_to_double, level_3: { min: 55 } }";
    let feedback = "# feedback:";
    let spiral = "spiral_time_to_double, categories: [A, C]";
    for (from, to, said) in [
        (
            "{ de_deg: 1 }",
            "{ de_deg: 0 }",
            "`pitch_control` moves no pitching moment: its gearings are zero, or its surfaces have no derivative of Cm; \
             n/α and 1/T_θ2 need one",
        ),
        (
            "{ de_deg: 1 }",
            "{ da_deg: 1 }",
            "`pitch_control`: `da_deg` has no longitudinal derivative",
        ),
        (
            "{ de_deg: 1 }",
            "{ de_deg: 1000000000 }",
            "`de_deg` must lie between -100 and 100, not 1000000000",
        ),
        (
            feedback,
            "feedback: { de_deg: { beta_deg: 1 } }",
            "feedback of `beta_deg` to `de_deg` has no effect: `de_deg` has no lateral derivative",
        ),
        (
            feedback,
            "feedback: { de_deg: { q_deg_s: 1e9 } }",
            "`q_deg_s` must lie between -100 and 100, not 1000000000",
        ),
        (
            spiral,
            "spiral_time_to_double, categories: []",
            "a limit of `spiral_time_to_double`: `categories` is empty, so it never applies",
        ),
        (
            spiral,
            "spiral_time_to_double, classes: []",
            "a limit of `spiral_time_to_double`: `classes` is empty, so it never applies",
        ),
        (
            requirement,
            "limits: []",
            "paragraph 3.2.1.2: `limits` lists no limit",
        ),
        (
            "- paragraph: 3.3.1.2 ",
            "- paragraph: 3.3.1.1 ",
            "paragraph 3.3.1.1 stands twice: put its limits in one list",
        ),
        (
            "spiral_time_to_double, categories: [B]",
            "spiral_time_to_double, categories: [A, C]",
            "a limit of `spiral_time_to_double`: it stands twice in paragraph 3.3.1.3 for the same categories and classes",
        ),
        (
            "by: dutch_roll_bank",
            "by: phugoid_damping",
            "a limit of `dutch_roll_decay`: `raised` is by `phugoid_damping`, a quantity of the longitudinal axis",
        ),
        (
            "by: dutch_roll_bank",
            "by: dutch_roll_decay",
            "a limit of `dutch_roll_decay`: `raised` is by `dutch_roll_decay` itself",
        ),
    ] {
        let copy = Copy::new();
        let line = copy.spoil("qualities.yaml", from, to);
        assert_eq!(
            copy.error(),
            format!("qualities.yaml:{line}: {said}"),
            "{to}"
        );
    }
    let copy = Copy::new();
    let text = fs::read_to_string(copy.path("qualities.yaml")).unwrap();
    let (head, _) = text.split_once("\nrequirements:").unwrap();
    copy.write("qualities.yaml", &format!("{head}\nrequirements: []\n"));
    let line = head.matches('\n').count() + 2;
    let said = "`requirements` lists no paragraph";
    assert_eq!(copy.error(), format!("qualities.yaml:{line}: {said}"));
}
