//! The export of the shipped model with a few trends: read back as a database, evaluated as a
//! simulator would, checked against DAVE-ML's grammar, and compared with harvest's own simulator,
//! which has an independent build-up.

mod grammar;
mod jsbsim;

use std::collections::BTreeMap;
use std::path::Path;

use approx::assert_relative_eq;
use nalgebra::Vector3;

use super::export_table::{ExportTable, is_same_breakpoint};
use super::*;
use crate::aero::wind_tunnel::TunnelPoint;
use crate::aero::{
    AeroModel, Coefficient, Condition, Derivative, Regressor, WindTunnel, wind_tunnel,
};
use crate::config::{Config, Overrides};
use crate::export::jsbsim::section as section_of;
use crate::lab::simulator::aerodynamics::Aerodynamics;
use crate::model::CorrelatedDerivatives;
use crate::rigid_body::AirData;
use crate::store::files::TunnelRow;
use crate::store::tunnel;
use crate::tables::PosteriorRow;

/// A database of the tables, read linearly and clamped, as simulators read them.
fn database(tables: &[ExportTable], settings: &wind_tunnel::Settings) -> WindTunnel {
    let mut database = WindTunnel::new(wind_tunnel::Settings {
        third: settings.third.clone(),
        ..Default::default()
    });
    for table in tables {
        for (at, cell) in table.points() {
            let point = TunnelPoint {
                alpha_deg: at.alpha_deg,
                mach: Some(at.mach).filter(|_| !table.machs.is_empty()),
                value: cell.value,
                uncertainty: cell.uncertainty,
                source: Some(cell.source.clone()),
            };
            database.insert_at(&table.derivative, at.third, point);
        }
    }
    database
}

const ALPHAS: [f64; 7] = [10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0];

/// The shipped pipeline with a posterior of four derivatives, one of each kind, between 10 and 40 deg.
struct Flown {
    config: Config,
    posterior: Vec<PosteriorRow>,
    correlations: Vec<CorrelatedDerivatives>,
}

fn posterior_row(derivative: &str, unit: &str, at: &Condition, value: f64) -> PosteriorRow {
    PosteriorRow {
        derivative: derivative.into(),
        unit: unit.into(),
        alpha_deg: at.alpha_deg,
        mach: Some(at.mach).filter(|mach| *mach > 0.0),
        third: at.third,
        value,
        standard_deviation: 0.01 + 1e-4 * at.alpha_deg,
        lower_95: value - 0.02,
        upper_95: value + 0.02,
        wind_tunnel: Some(1.0),
        prior_deviation: 0.2,
        flight_share_pct: Some(2.0 * at.alpha_deg),
        maneuvers: 8,
    }
}

fn at_alpha(alpha_deg: f64) -> Condition {
    Condition {
        alpha_deg,
        mach: 0.0,
        third: None,
    }
}

impl Flown {
    fn new() -> Flown {
        let config = Config::load(Path::new("pipelines/harv"), Overrides::default()).unwrap();
        let mut posterior = Vec::new();
        for name in ["CN_alpha", "Cm_q", "Cl_p", "CY_dyv"] {
            let unit = config.aero_model.unit_of(name).unwrap().name();
            for (i, alpha) in ALPHAS.into_iter().enumerate() {
                let tunnel = config.tunnel.value(name, alpha, 0.3).unwrap().value;
                let value = 1.2 * tunnel + 0.001 * i as f64;
                posterior.push(posterior_row(name, unit, &at_alpha(alpha), value));
            }
        }
        let correlations = vec![CorrelatedDerivatives {
            first: "CN_alpha".into(),
            second: "Cm_q".into(),
            correlation: -0.5,
        }];
        Flown {
            config,
            posterior,
            correlations,
        }
    }

    fn contents(&self) -> ExportContents<'_> {
        ExportContents {
            title: "F/A-18 & others",
            aircraft: &self.config.aircraft,
            aero_model: &self.config.aero_model,
            tunnel: &self.config.tunnel,
            posterior: &self.posterior,
            correlations: &self.correlations,
            settings: &self.config.export,
        }
    }

    /// Further derivatives along products, magnitudes and airspeed.
    fn with_products(mut self) -> Flown {
        for (name, coefficient, regressor, value) in [
            ("CN_alpha2", Coefficient::CN, "alpha * alpha", 1e-4),
            ("Cm_alpha_de", Coefficient::Cm, "alpha * de_deg", -2e-5),
            ("Cn_abs_beta", Coefficient::Cn, "abs(beta)", 3e-4),
            ("Cl_mach_r", Coefficient::Cl, "mach * r", 0.2),
            ("CA_V", Coefficient::CA, "velocity_ft_s", 1e-5),
            ("Cm_alpha_dot", Coefficient::Cm, "alpha_dot", -4.0),
        ] {
            self.config.aero_model.derivatives.push(Derivative {
                name: name.into(),
                coefficient,
                regressor: Regressor::parse(regressor).unwrap(),
            });
            for alpha_deg in ALPHAS {
                let point = TunnelPoint::new(alpha_deg, value);
                self.config.tunnel.insert(name, point);
            }
        }
        self
    }

    /// A tunnel of one derivative over two Mach numbers and two altitudes.
    fn over_mach_and_altitude(mut self) -> Flown {
        let third = Some(wind_tunnel::Third {
            name: "altitude_ft".into(),
            at: 20e3,
        });
        let mut tunnel = WindTunnel::new(wind_tunnel::Settings {
            third,
            ..Default::default()
        });
        for altitude in [10e3, 40e3] {
            for mach in [0.2, 0.9] {
                for alpha_deg in [5.0, 20.0, 50.0] {
                    let value = alpha_deg * (1.0 + mach) + 1e-4 * altitude;
                    let point = TunnelPoint {
                        mach: Some(mach),
                        uncertainty: Some(0.5),
                        ..TunnelPoint::new(alpha_deg, value)
                    };
                    tunnel.insert_at("CN_alpha", Some(altitude), point);
                }
            }
        }
        self.config.tunnel = tunnel;
        self.posterior.clear();
        for third in [Some(10e3), Some(40e3)] {
            for mach in [0.2, 0.9] {
                for alpha_deg in [5.0, 20.0, 50.0] {
                    let at = Condition {
                        alpha_deg,
                        mach,
                        third,
                    };
                    let value = alpha_deg * (1.1 + mach);
                    self.posterior
                        .push(posterior_row("CN_alpha", "per_deg", &at, value));
                }
            }
        }
        self
    }
}

#[test]
fn the_posterior_stands_where_it_has_rows_and_the_tunnel_elsewhere() {
    let flown = Flown::new();
    let tables = tables(&flown.contents());
    assert_eq!(
        tables.len(),
        flown.config.aero_model.derivatives.len() + flown.config.aero_model.combined.len()
    );
    for table in &tables {
        for (at, cell) in table.points() {
            let row = flown.posterior.iter().find(|row| {
                row.derivative == table.derivative
                    && is_same_breakpoint(row.alpha_deg, at.alpha_deg)
            });
            let tunnel = flown
                .config
                .tunnel
                .value(&table.derivative, at.alpha_deg, 0.3);
            let (value, uncertainty) = row.map_or_else(
                || (tunnel.unwrap().value, tunnel.unwrap().uncertainty),
                |row| (row.value, Some(row.standard_deviation)),
            );
            assert_eq!(cell.value.to_bits(), value.to_bits());
            assert_eq!(cell.uncertainty, uncertainty);
            // The share of flight is 2 % for each degree.
            assert_eq!(cell.is_flight, row.is_some() && at.alpha_deg >= 25.0);
        }
    }
    let slope = tables.iter().find(|t| t.derivative == "CN_alpha").unwrap();
    assert_eq!(
        slope.sources(),
        "posterior: mostly wind tunnel: 10° to 20°; posterior: mostly flight: 25° to 40°"
    );
}

#[test]
fn the_grid_of_the_export_is_that_of_the_posterior() {
    let flown = Flown::new().over_mach_and_altitude();
    let tables = tables(&flown.contents());
    let slope = tables.iter().find(|t| t.derivative == "CN_alpha").unwrap();
    assert_eq!(slope.machs, [0.2, 0.9]);
    assert_eq!(slope.thirds, [10e3, 40e3]);
    assert_eq!(slope.alphas_deg, [5.0, 20.0, 50.0]);
    for (at, cell) in slope.points() {
        assert_relative_eq!(cell.value, at.alpha_deg * (1.1 + at.mach));
    }
}

#[test]
fn daveml_has_the_correlations_between_derivatives() {
    let flown = Flown::new();
    let contents = flown.contents();
    let text = daveml::document(&contents, &tables(&contents));
    assert!(text.contains("<correlatesWith varID=\"Cm_q\"/>"));
    assert!(text.contains("<correlation varID=\"CN_alpha\" corrCoef=\"-0.5\"/>"));
}

/// Place of a value, by its bits: derivative, α, Mach, third variable.
type Place = (String, [Option<u64>; 3]);

/// The values and uncertainties of rows, by their bits.
fn points(rows: impl IntoIterator<Item = TunnelRow>) -> BTreeMap<Place, (u64, Option<u64>)> {
    let bits = |v: Option<f64>| v.map(f64::to_bits);
    let point = |r: TunnelRow| {
        let place = (r.derivative, [Some(r.alpha_deg), r.mach, r.third].map(bits));
        (place, (r.value.to_bits(), bits(r.uncertainty)))
    };
    rows.into_iter().map(point).collect()
}

#[test]
fn every_format_comes_back_as_the_same_tunnel_to_the_bit() {
    for flown in [Flown::new(), Flown::new().over_mach_and_altitude()] {
        let contents = flown.contents();
        let tables = tables(&contents);
        let folder = tempfile::tempdir().unwrap();
        let third = flown
            .config
            .tunnel
            .settings()
            .third
            .as_ref()
            .map(|t| t.name.as_str());
        crate::store::table::publish_export(
            &crate::store::table::TableFolder::of(folder.path()),
            &rows(&tables),
            third,
        )
        .unwrap();
        std::fs::write(
            folder.path().join("flight_updated.dml"),
            daveml::document(&contents, &tables),
        )
        .unwrap();
        let names: Vec<&str> = tables.iter().map(|t| t.derivative.as_str()).collect();
        let read = |extension: &str| {
            let path = folder.path().join(format!("flight_updated.{extension}"));
            let found = tunnel::rows(&path, third, |name| names.contains(&name)).unwrap();
            points(found.into_iter().map(|(_, row)| row))
        };
        let written = rows(&tables).into_iter().map(|r| TunnelRow {
            derivative: r.derivative,
            alpha_deg: r.alpha_deg,
            mach: r.mach,
            value: r.value,
            unit: r.unit,
            uncertainty: r.uncertainty,
            source: None,
            third: r.third,
        });
        let written = points(written);
        assert_eq!(read("csv"), written);
        assert_eq!(read("parquet"), written);
        let of_values = |all: &BTreeMap<Place, (u64, Option<u64>)>| -> BTreeMap<Place, u64> {
            all.iter()
                .map(|(place, (value, _))| (place.clone(), *value))
                .collect()
        };
        assert_eq!(of_values(&read("dml")), of_values(&written));
    }
}

#[test]
fn daveml_keeps_the_uncertainties_where_every_value_has_one() {
    let flown = Flown::new().over_mach_and_altitude();
    let contents = flown.contents();
    let text = daveml::document(&contents, &tables(&contents));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.dml");
    std::fs::write(&path, text).unwrap();
    let found = tunnel::rows(&path, Some("altitude_ft"), |name| name == "CN_alpha").unwrap();
    assert!(
        found
            .iter()
            .any(|(_, r)| r.uncertainty == Some(0.01 + 1e-4 * 50.0))
            && found.iter().all(|(_, r)| r.uncertainty.is_some())
    );
}

#[test]
fn daveml_follows_its_grammar() {
    for flown in [Flown::new(), Flown::new().over_mach_and_altitude()] {
        let contents = flown.contents();
        let text = daveml::document(&contents, &tables(&contents));
        assert_eq!(grammar::faults(&text), Vec::<String>::new());
    }
}

#[test]
fn the_grammar_sees_what_is_out_of_order() {
    let flown = Flown::new();
    let contents = flown.contents();
    let text = daveml::document(&contents, &tables(&contents));
    for (from, to) in [
        ("<isInput/>", "<isInput/><description>late</description>"),
        ("gtID=\"CN_alpha_table\"", "gtID=\"other_table\""),
        ("<creationDate date=\"not stated\"/>", ""),
        (" org=\"not stated\"", ""),
    ] {
        assert!(text.contains(from), "{from}");
        assert!(
            !grammar::faults(&text.replacen(from, to, 1)).is_empty(),
            "{from}"
        );
    }
}

/// Rate of the angle of attack in every state, rad/s.
const ALPHA_DOT: f64 = 0.17;

/// States of flight with every regressor at work.
fn states() -> Vec<(f64, f64, Vector3<f64>)> {
    vec![
        (12.3, 2.0, Vector3::new(0.3, -0.1, 0.05)),
        (32.5, -4.0, Vector3::new(-0.2, 0.25, 0.1)),
        (2.0, 0.5, Vector3::new(0.1, 0.1, -0.1)),
        (64.0, 0.0, Vector3::zeros()),
    ]
}

#[test]
fn the_jsbsim_section_gives_the_forces_and_moments_of_the_build_up() {
    let flown = Flown::new().with_products();
    let contents = flown.contents();
    let (tables, a) = (tables(&contents), contents.aircraft);
    let section = section_of(&contents, &tables);
    let mut surfaces: Vec<String> = contents
        .aero_model
        .derivatives
        .iter()
        .filter_map(|d| d.regressor.surface().map(str::to_owned))
        .collect();
    surfaces.sort();
    surfaces.dedup();
    let deflections: Vec<f64> = (0..surfaces.len()).map(|i| 3.0 - 1.1 * i as f64).collect();
    let names: Vec<String> = surfaces.iter().map(|s| format!("harvest/{s}")).collect();
    // JSBSim reads constant and slope linearly and apart.
    let aero_model = AeroModel {
        combined: vec![],
        ..contents.aero_model.clone()
    };
    let truth = Aerodynamics::new(
        &aero_model,
        database(&tables, &wind_tunnel::Settings::default()),
        &surfaces,
    )
    .unwrap();
    for (alpha_deg, beta_deg, rates) in states() {
        let (alpha, beta) = (alpha_deg.to_radians(), f64::to_radians(beta_deg));
        let air = AirData {
            velocity_ft_s: 310.0,
            alpha,
            beta,
            mach: 0.3,
            qbar_psf: 55.0,
        };
        let (force, moment) = truth.loads(
            a,
            &truth.values(alpha_deg, 0.3),
            &air,
            (&rates, ALPHA_DOT),
            &deflections,
        );
        let mut properties: BTreeMap<&str, f64> = BTreeMap::from([
            ("aero/alpha-deg", alpha_deg),
            ("aero/beta-deg", beta_deg),
            ("aero/bi2vel", a.span_ft / (2.0 * 310.0)),
            ("aero/ci2vel", a.chord_ft / (2.0 * 310.0)),
            ("velocities/p-aero-rad_sec", rates.x),
            ("velocities/q-aero-rad_sec", rates.y),
            ("velocities/r-aero-rad_sec", rates.z),
            ("aero/alphadot-rad_sec", ALPHA_DOT),
            ("velocities/mach", 0.3),
            ("velocities/vt-fps", 310.0),
            ("aero/qbar-psf", 55.0),
            ("metrics/Sw-sqft", a.wing_area_ft2),
            ("metrics/bw-ft", a.span_ft),
            ("metrics/cbarw-ft", a.chord_ft),
        ]);
        properties.extend(
            names
                .iter()
                .map(String::as_str)
                .zip(deflections.iter().copied()),
        );
        let axes = jsbsim::axes(&section, &properties);
        // JSBSim's body forces: X = −AXIAL, Y = SIDE, Z = −NORMAL.
        for (axis, expected) in [
            ("AXIAL", -force.x),
            ("SIDE", force.y),
            ("NORMAL", -force.z),
            ("ROLL", moment.x),
            ("PITCH", moment.y),
            ("YAW", moment.z),
        ] {
            assert_relative_eq!(axes[axis], expected, max_relative = 1e-10, epsilon = 1e-8);
        }
    }
}

#[test]
fn the_jsbsim_tables_over_three_variables_are_the_database_s() {
    let flown = Flown::new().over_mach_and_altitude();
    let contents = flown.contents();
    let tables = tables(&contents);
    let section = section_of(&contents, &tables);
    let database = database(&tables, contents.tunnel.settings());
    for (alpha_deg, mach, altitude) in [
        (12.0, 0.3, 25e3),
        (33.3, 0.5, 12e3),
        (3.0, 0.1, 50e3),
        (50.0, 0.25, 25e3),
    ] {
        let condition = Condition {
            alpha_deg,
            mach,
            third: Some(altitude),
        };
        let properties = [
            ("aero/alpha-deg", alpha_deg),
            ("velocities/mach", mach),
            ("position/h-sl-ft", altitude),
        ];
        let rest = [
            "aero/beta-deg",
            "aero/bi2vel",
            "aero/ci2vel",
            "velocities/p-aero-rad_sec",
            "velocities/q-aero-rad_sec",
            "velocities/r-aero-rad_sec",
            "aero/qbar-psf",
            "metrics/Sw-sqft",
            "metrics/bw-ft",
            "metrics/cbarw-ft",
        ];
        let all = properties
            .into_iter()
            .chain(rest.map(|name| (name, 0.0)))
            .collect();
        let value = jsbsim::evaluated(&section, &all)["aero/harvest/CN_alpha"];
        assert_relative_eq!(
            value,
            database.at("CN_alpha", &condition).unwrap().value,
            max_relative = 1e-12
        );
    }
}

#[test]
fn an_analyst_s_property_takes_the_place_of_the_house_s() {
    let mut flown = Flown::new();
    flown
        .config
        .export
        .jsbsim_properties
        .insert("de_deg".into(), "fcs/elevator-pos-deg".into());
    let contents = flown.contents();
    let section = section_of(&contents, &tables(&contents));
    assert!(
        section.contains("<property>fcs/elevator-pos-deg</property>")
            && !section.contains("harvest/de_deg")
    );
}
