//! File of a standard case: JSON with constants, held values, starting values and weights; a CSV of
//! the same name holds the record.
//!
//! The case has its own conventions. The record is converted to harvest's signals. Terms that the
//! case's equations omit, and its unit of acceleration, become known parts of the measured outputs
//! ([`CaseFile::measurements`]).

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::aero::{Axis, Bias, Coefficient, Derivative, Output, Regressor};
use crate::aircraft::{Aircraft, Position, Sensors, Vane, VaneModel};
use crate::dynamics::OUTPUTS;
use crate::earth::gravity_ft_s2;
use crate::flight::record::Series;
use crate::flight::{Mark, Record, signal};
use crate::numerics::bisection::last_that_holds;
use crate::output_error::Measurements;
use crate::units::{DEG, G0_FT_S2};

/// A case as written. Further keys of the file (its truth, its noise) are ignored.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct CaseFile {
    constants: Constants,
    pub fixed: BTreeMap<String, f64>,
    pub start: BTreeMap<String, f64>,
    weights: BTreeMap<Output, f64>,
    dt: f64,
    pub x0_samples: usize,
    pub ftol: f64,
    ax_thrust_term: bool,
}

/// Constants in ft, slug, ft/s²; arms from the c.g. to the sensor, positive aft, right and up.
#[derive(Clone, Copy, Debug, Deserialize)]
#[expect(non_snake_case, reason = "keys of the file")]
struct Constants {
    S: f64,
    cbar: f64,
    b: f64,
    mass: f64,
    g: f64,
    Ix: f64,
    Iy: f64,
    Iz: f64,
    Ixz: f64,
    Ixe: f64,
    x_alpha: f64,
    y_alpha: f64,
    k_alpha: f64,
    x_an: f64,
    y_an: f64,
    z_an: f64,
    x_ax: f64,
    y_ax: f64,
    z_ax: f64,
}

/// Signals and the columns of the record that hold them.
const COLUMNS: [(&str, &str); 14] = [
    (signal::ALPHA_VANE, "alpha"),
    (signal::BETA_VANE, "beta"),
    (signal::VELOCITY, "V"),
    (signal::P, "p"),
    (signal::Q, "q"),
    (signal::R, "r"),
    (signal::THETA, "theta"),
    (signal::PHI, "phi"),
    (signal::AN, "an"),
    (signal::AX, "ax"),
    (signal::AY, "ay"),
    (signal::QBAR, "qbar"),
    (signal::THRUST, "thrust"),
    (signal::RPM_LEFT, "rpm"),
];

/// Latitude of the case, which gives only g; the altitude is chosen to match g.
const LATITUDE_DEG: f64 = 45.0;

/// Altitudes between which that of a given g is looked for, ft: gravity from 32.5 to 29.3 ft/s².
const ALTITUDES_FT: (f64, f64) = (-100_000.0, 1_000_000.0);

/// Most halvings of that range; it ends at neighbours, after 53 and as many as the altitude is below 10⁶ ft in
/// powers of two.
const HALVINGS: usize = 100;

/// Altitude at which gravity is g, ft, by bisection.
fn altitude_of_gravity_ft(g: f64) -> f64 {
    let is_heavier = |altitude_ft| gravity_ft_s2(LATITUDE_DEG, altitude_ft) > g;
    let (low, high) = last_that_holds(ALTITUDES_FT, HALVINGS, is_heavier);
    0.5 * (low + high)
}

/// Parses the name of a bias parameter: an output followed by `_bias`.
pub(super) fn bias(name: &str) -> Option<Bias> {
    let output = name.strip_suffix("_bias")?;
    let outputs = Axis::Longitudinal.outputs();
    let output = Output::from_word(output).filter(|o| outputs.contains(o))?;
    Some(Bias {
        name: name.to_owned(),
        output,
    })
}

/// Parses the name of a derivative: the coefficient followed by `0`, `a`, `q` or the column of a
/// surface. The column of a thrust-vectoring vane ends in `v`.
///
/// # Errors
/// The message for a name without a longitudinal coefficient.
pub(super) fn derivative(name: &str) -> Result<Derivative, String> {
    let coefficients = Axis::Longitudinal.coefficients();
    let after = |c: &Coefficient| name.strip_prefix(format!("{c:?}").as_str());
    let found = coefficients.into_iter().find_map(|c| Some((c, after(&c)?)));
    let (coefficient, variable) =
        found.ok_or_else(|| format!("`{name}` is not a derivative of CN, Cm or CA"))?;
    let regressor = match variable {
        "0" => Regressor::Constant,
        "a" => Regressor::Alpha,
        "q" => Regressor::PitchRate,
        vane if vane.ends_with('v') => Regressor::Vane(vane.to_owned()),
        surface => Regressor::Surface(surface.to_owned()),
    };
    Ok(Derivative {
        name: name.to_owned(),
        coefficient,
        regressor,
    })
}

impl CaseFile {
    /// Aircraft of the case, with the c.g. as the reference point of positions.
    pub fn aircraft(&self) -> Aircraft {
        let c = &self.constants;
        let at = |x_ft: f64, y_ft: f64, z_ft: f64| Position { x_ft, y_ft, z_ft };
        Aircraft {
            name: "standard case".to_owned(),
            wing_area_ft2: c.S,
            span_ft: c.b,
            chord_ft: c.cbar,
            engine_inertia_slug_ft2: c.Ixe,
            thrust_line: None,
            latitude_deg: LATITUDE_DEG,
            sensors: Sensors {
                an: at(c.x_an, c.y_an, c.z_an),
                ax: at(c.x_ax, c.y_ax, c.z_ax),
                ay: at(0.0, 0.0, 0.0),
                alpha_vane: Vane {
                    x_ft: c.x_alpha,
                    y_ft: c.y_alpha,
                    z_ft: 0.0,
                    factor: c.k_alpha,
                },
                beta_vane: Vane {
                    x_ft: 0.0,
                    y_ft: 0.0,
                    z_ft: 0.0,
                    factor: 1.0,
                },
                vane_model: VaneModel::SmallAngle,
                thrust_in_ax: self.ax_thrust_term,
            },
        }
    }

    /// Converts the columns of the case's record to harvest's signals.
    ///
    /// # Errors
    /// The message for a missing column.
    pub fn record(&self, columns: &BTreeMap<String, Vec<f64>>) -> Result<Record, String> {
        let samples = columns.values().next().map_or(0, Vec::len);
        let c = &self.constants;
        let constant = |value: f64| vec![value; samples];
        let mut signals: BTreeMap<String, Vec<f64>> = columns.clone();
        for (signal, column) in COLUMNS {
            let values = signals
                .remove(column)
                .ok_or_else(|| format!("the record has no column `{column}`"))?;
            signals.insert(signal.to_owned(), values);
        }
        let constants = [
            (signal::MASS, c.mass),
            (signal::IX, c.Ix),
            (signal::IY, c.Iy),
            (signal::IZ, c.Iz),
            (signal::IXZ, c.Ixz),
            (signal::X_CG, 0.0),
            (signal::Y_CG, 0.0),
            (signal::Z_CG, 0.0),
            (signal::MACH, 0.0),
            (signal::RPM_RIGHT, 0.0),
            (signal::ALTITUDE, altitude_of_gravity_ft(c.g)),
        ];
        signals.extend(constants.map(|(name, value)| (name.to_owned(), constant(value))));
        let series = |values: Vec<f64>| Series {
            marks: vec![Mark::Measured; values.len()],
            values,
        };
        Ok(Record {
            flight_id: "standard case".to_owned(),
            start_s: 0.0,
            step_s: self.dt,
            samples,
            signals: signals
                .into_iter()
                .map(|(name, values)| (name, series(values)))
                .collect(),
            remaining_errors: BTreeMap::new(),
        })
    }

    /// Standard gravity in units of the case's gravity, the unit of its accelerometers.
    pub fn accelerometer_unit(&self) -> f64 {
        G0_FT_S2 / self.constants.g
    }

    /// Weights of the outputs in harvest's units.
    pub fn weights(&self) -> [f64; OUTPUTS] {
        let unit = self.accelerometer_unit();
        let weight = |o: Output| self.weights.get(&o).copied().unwrap_or(0.0);
        let [alpha, q, theta, an, ax] = Axis::Longitudinal.outputs().map(weight);
        [alpha, q, theta, an * unit * unit, ax * unit * unit]
    }

    /// Measured outputs in harvest's units. Adds the products of different rates that the case's
    /// 2.7 and 2.8 omit and harvest's include.
    pub fn measurements(&self, record: &Record) -> Measurements {
        let c = &self.constants;
        let values = |name: &str| record.values(name).unwrap_or_default();
        let [p, q, r] = [signal::P, signal::Q, signal::R].map(values);
        let [alpha, theta, an, ax] =
            [signal::ALPHA_VANE, signal::THETA, signal::AN, signal::AX].map(values);
        let unit = self.accelerometer_unit();
        let row = |k: usize| {
            let (p, r) = (p[k] / DEG, r[k] / DEG);
            // With the arm −x forward and −z down: down r p (−x), forward p r (−z).
            let (down, forward) = (-r * p * c.x_an, -p * r * c.z_ax);
            [
                alpha[k],
                q[k],
                theta[k],
                an[k] / unit - down / G0_FT_S2,
                ax[k] / unit + forward / G0_FT_S2,
            ]
        };
        Measurements {
            values: (0..record.samples).map(row).collect(),
            used: vec![[true; OUTPUTS]; record.samples],
        }
    }
}
