//! The standard case by which estimators are timed against each other: one longitudinal maneuver as
//! JSON (constants, held values, start, weights) with its record as CSV beside it, estimated again
//! and again.
//!
//! Its conventions are brought to ours, not ours to it: the record is written in our signals, and
//! what its equations leave out or count in another unit is a known part of the measured outputs
//! ([`Given::measurements`]).

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use nalgebra::DMatrix;
use rayon::prelude::*;
use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

use crate::aero::{Axis, Bias, Coefficient, Derivative, Output, Regressor};
use crate::aircraft::{Aircraft, Position, Sensors, Vane, VaneModel};
use crate::dynamics::motion::{MassProperties, Window};
use crate::dynamics::{Longitudinal, OUTPUTS};
use crate::earth::gravity_ft_s2;
use crate::error::{Error, Result};
use crate::flight::record::Series;
use crate::flight::{Mark, Record, signal};
use crate::numerics::symmetric;
use crate::output_error::cost::Sums;
use crate::output_error::newton_raphson::{self, Settings};
use crate::output_error::surface_noise::noisy_surfaces;
use crate::output_error::{
    Case, Fit, InitialState, Likelihood, Measurements, Model, Outcome, cramer_rao,
};
use crate::store::files;
use crate::units::{DEG, G0_FT_S2};

/// A case as its file says it; what else the file says (its truth, its noise) is not needed.
#[derive(Clone, Debug, Deserialize)]
struct Given {
    constants: Constants,
    fixed: BTreeMap<String, f64>,
    start: BTreeMap<String, f64>,
    weights: BTreeMap<Output, f64>,
    dt: f64,
    x0_samples: usize,
    ftol: f64,
    ax_thrust_term: bool,
}

/// In ft, slug, ft/s²; arms are sensor minus c.g., positive aft, right and up.
#[derive(Clone, Copy, Debug, Deserialize)]
#[expect(non_snake_case, reason = "as the file spells them")]
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

/// What came of a case, and how long it took.
#[derive(Clone, Debug, Serialize)]
pub struct Timed {
    pub outcome: &'static str,
    pub theta: BTreeMap<String, f64>,
    /// Standard errors for white residuals, scaled by their variance.
    pub std: BTreeMap<String, f64>,
    /// Standard errors with the residuals' autocorrelation and the surfaces' noise counted: the
    /// bounds of the table `estimates`, which no peer has.
    pub std_corrected: BTreeMap<String, f64>,
    pub cost: Option<f64>,
    pub iterations: usize,
    /// Reading the case and its record.
    pub import_s: f64,
    /// The first estimate, with what happens only once.
    pub first_s: f64,
    /// One entry per repetition of the estimate: from the record in memory to estimates and
    /// standard errors.
    pub wall_s: Vec<f64>,
    pub cpu_s: Vec<f64>,
    /// Of these the part that lays the maneuver out before the first iteration.
    pub ready_s: Vec<f64>,
    /// The bounds with autocorrelation counted, which are not in `wall_s`.
    pub corrected_s: Vec<f64>,
}

/// The cases of a folder.
#[derive(Clone, Debug, Serialize)]
pub struct Batch {
    pub count: usize,
    /// Seconds from the first estimate's begin to the last one's end, over all threads.
    pub wall_s: f64,
    pub cpu_s: f64,
    pub results: BTreeMap<String, Timed>,
}

/// A case in memory, in our words.
#[derive(Clone, Debug)]
pub struct Subject {
    given: Given,
    aircraft: Aircraft,
    record: Record,
    free: Vec<Derivative>,
    held: Vec<(Derivative, f64)>,
    biases: Vec<Bias>,
    import_s: f64,
}

/// Reads a case and the record beside it.
///
/// # Errors
/// [`Error`] naming the file that is missing or cannot be understood.
pub fn load(file: &Path) -> Result<Subject> {
    let begin = Instant::now();
    let given: Given = serde_json::from_str(&files::text(file)?).map_err(|e| {
        Error::config(
            file,
            Some(e.line()),
            format!("no case as it should be: {e}"),
        )
    })?;
    let table = file.with_extension("csv");
    let columns = files::columns(&table)?;
    let aircraft = given.aircraft();
    let record = given
        .record(&columns)
        .map_err(|what| Error::config(&table, None, what))?;
    let derivative =
        |name: &String| derivative(name).map_err(|what| Error::config(file, None, what));
    let mut free = Vec::new();
    let mut biases = Vec::new();
    for name in given.start.keys() {
        match bias(name) {
            Some(bias) => biases.push(bias),
            None => free.push(derivative(name)?),
        }
    }
    let held = given
        .fixed
        .iter()
        .map(|(name, value)| Ok((derivative(name)?, *value)))
        .collect::<Result<_>>()?;
    Ok(Subject {
        aircraft,
        record,
        free,
        held,
        biases,
        import_s: begin.elapsed().as_secs_f64(),
        given,
    })
}

/// Estimates a case `repetitions` times.
///
/// # Errors
/// A sentence when the record lacks a signal.
pub fn timed(subject: &Subject, repetitions: usize) -> Result<Timed, String> {
    let clock = Clock::start();
    let mut estimated = subject.estimate()?;
    let first_s = clock.wall_s();
    let corrected = estimated.corrected(subject).unwrap_or_default();
    let (mut wall_s, mut cpu_s, mut ready_s, mut corrected_s) = (vec![], vec![], vec![], vec![]);
    for _ in 0..repetitions {
        let clock = Clock::start();
        let mut again = subject.estimate()?;
        wall_s.push(clock.wall_s());
        cpu_s.push(clock.cpu_s());
        ready_s.push(again.ready_s);
        let clock = Clock::start();
        again.corrected(subject);
        corrected_s.push(clock.wall_s());
    }
    let Estimated { fit, std, case, .. } = &estimated;
    let unit = |name: &str| {
        if bias(name).is_some() {
            subject.given.accelerometer_unit()
        } else {
            1.0
        }
    };
    let named = |values: &[f64]| {
        let both = case.names.iter().zip(values);
        both.map(|(name, value)| (name.clone(), value * unit(name)))
            .collect()
    };
    Ok(Timed {
        outcome: fit.outcome.name(),
        theta: named(&fit.values),
        std: named(std),
        std_corrected: named(&corrected),
        cost: fit.final_cost,
        iterations: fit.iterations,
        import_s: subject.import_s,
        first_s,
        wall_s,
        cpu_s,
        ready_s,
        corrected_s,
    })
}

/// Estimates every case of a folder `repetitions` times, case by case in parallel.
///
/// # Errors
/// [`Error`] naming the file that is missing or cannot be understood.
pub fn batch(folder: &Path, repetitions: usize) -> Result<Batch> {
    let paths = files::with_extension(folder, "json")?;
    let subjects: Vec<Subject> = paths.iter().map(|path| load(path)).collect::<Result<_>>()?;
    let clock = Clock::start();
    let results: Vec<Timed> = subjects
        .par_iter()
        .zip(&paths)
        .map(|(subject, path)| {
            timed(subject, repetitions).map_err(|what| Error::config(path, None, what))
        })
        .collect::<Result<_>>()?;
    let (wall_s, cpu_s) = (clock.wall_s(), clock.cpu_s());
    let name = |path: &Path| {
        path.file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let results: BTreeMap<String, Timed> =
        paths.iter().map(|path| name(path)).zip(results).collect();
    Ok(Batch {
        count: results.len(),
        wall_s,
        cpu_s,
        results,
    })
}

/// One estimate: the fit, the inverse of its information matrix and its standard errors.
struct Estimated {
    window: Window,
    case: Case<3, Longitudinal>,
    fit: Fit,
    inverse: Option<DMatrix<f64>>,
    std: Vec<f64>,
    ready_s: f64,
}

impl Estimated {
    /// Standard errors with autocorrelation and the surfaces' noise counted; none where the data
    /// determine none.
    fn corrected(&mut self, subject: &Subject) -> Option<Vec<f64>> {
        let names = &self.case.names;
        let mut free: Vec<&Derivative> = subject.free.iter().collect();
        free.sort_by_key(|d| names.iter().position(|name| *name == d.name));
        let held: Vec<(&Derivative, f64)> = subject.held.iter().map(|(d, v)| (d, *v)).collect();
        self.case.noisy_surfaces = noisy_surfaces(&subject.aircraft, &self.window, &free, &held);
        let bounds = cramer_rao::bounds(self.inverse.as_ref()?, &self.case, &self.fit);
        Some(
            bounds
                .corrected
                .diagonal()
                .iter()
                .map(|v| v.sqrt())
                .collect(),
        )
    }
}

impl Subject {
    fn estimate(&self) -> Result<Estimated, String> {
        let clock = Clock::start();
        let window = self.window()?;
        let case = self.case(&window);
        let ready_s = clock.wall_s();
        let settings = Settings {
            tolerance: STEPS_AHEAD * self.given.ftol,
            ..Settings::default()
        };
        let (start, weights) = self.start(&case);
        let fit = newton_raphson::minimise(&case, start, weights, &settings);
        let sums = case.sums(&fit.response, &fit.weights);
        let inverse = Some(&sums).filter(|_| fit.outcome == Outcome::Converged);
        let inverse = inverse.and_then(|sums| symmetric::inverse(&sums.information));
        let std = inverse
            .as_ref()
            .map_or(vec![], |inverse| standard_errors(inverse, &sums));
        Ok(Estimated {
            window,
            case,
            fit,
            inverse,
            std,
            ready_s,
        })
    }

    /// The case's signals at samples and between them.
    ///
    /// # Errors
    /// A sentence when the record lacks a signal.
    pub fn window(&self) -> Result<Window, String> {
        let derivatives = self.free.iter().chain(self.held.iter().map(|(d, _)| d));
        let surfaces = derivatives.filter_map(|d| d.regressor.surface());
        Window::cut(
            &self.record,
            0..self.record.samples,
            surfaces,
            MassProperties::Mean,
        )
    }

    /// The maneuver laid out for the iteration.
    #[must_use]
    pub fn case(&self, window: &Window) -> Case<3, Longitudinal> {
        let model = Model {
            free: self.free.iter().collect(),
            held: self.held.iter().map(|(d, v)| (d, *v)).collect(),
            biases: self.biases.iter().collect(),
            initial_state: InitialState::Measured,
        };
        let mut case = Case::new(
            &self.aircraft,
            window,
            self.given.measurements(&self.record),
            &model,
        );
        case.start_from_mean_of(self.given.x0_samples);
        case
    }

    /// Free derivatives and held ones with their values.
    #[must_use]
    pub fn derivatives(&self) -> (&[Derivative], &[(Derivative, f64)]) {
        (&self.free, &self.held)
    }

    #[must_use]
    pub fn aircraft(&self) -> &Aircraft {
        &self.aircraft
    }

    /// The case's starting values in the order of its parameters, and its weights.
    #[must_use]
    pub fn start(&self, case: &Case<3, Longitudinal>) -> (Vec<f64>, [f64; OUTPUTS]) {
        let unit = |name: &str| {
            if bias(name).is_some() {
                self.given.accelerometer_unit()
            } else {
                1.0
            }
        };
        let value = |name: &String| self.given.start.get(name).map_or(0.0, |v| v / unit(name));
        (case.names.iter().map(value).collect(), self.given.weights())
    }
}

/// Square roots of the diagonal of H⁻¹, scaled by the residuals' variance 2 n J/(n − parameters).
fn standard_errors(inverse: &DMatrix<f64>, sums: &Sums) -> Vec<f64> {
    let variance = sums.weighted_square / (sums.count - inverse.nrows()) as f64;
    inverse
        .diagonal()
        .iter()
        .map(|v| (v * variance).sqrt())
        .collect()
}

/// `an_bias`, `ax_bias`: the output that a bias shifts.
fn bias(name: &str) -> Option<Bias> {
    let output = name.strip_suffix("_bias")?;
    let outputs = Axis::Longitudinal.outputs();
    let output = outputs.into_iter().find(|o| o.name() == output)?;
    Some(Bias {
        name: name.to_owned(),
        output,
    })
}

/// Coefficient, then `0`, `a`, `q` or the column of a surface; that of a thrust-vectoring vane ends
/// in `v`.
fn derivative(name: &str) -> Result<Derivative, String> {
    let coefficients = Axis::Longitudinal.coefficients();
    let of = |c: &Coefficient| name.strip_prefix(format!("{c:?}").as_str());
    let found = coefficients.into_iter().find_map(|c| Some((c, of(&c)?)));
    let (coefficient, along) =
        found.ok_or_else(|| format!("`{name}` is no derivative of CN, Cm or CA"))?;
    let regressor = match along {
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

impl Given {
    /// The c.g. is the reference point, so that arms are positions.
    fn aircraft(&self) -> Aircraft {
        let c = &self.constants;
        let at = |x_ft: f64, y_ft: f64, z_ft: f64| Position { x_ft, y_ft, z_ft };
        Aircraft {
            name: "standard case".to_owned(),
            wing_area_ft2: c.S,
            span_ft: c.b,
            chord_ft: c.cbar,
            engine_inertia_slug_ft2: c.Ixe,
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

    /// The case's record in our signals.
    fn record(&self, columns: &BTreeMap<String, Vec<f64>>) -> Result<Record, String> {
        let samples = columns.values().next().map_or(0, Vec::len);
        let c = &self.constants;
        let constant = |value: f64| vec![value; samples];
        let mut signals: BTreeMap<String, Vec<f64>> = columns.clone();
        for (ours, theirs) in RECORDED {
            let values = signals
                .remove(theirs)
                .ok_or_else(|| format!("the record has no column `{theirs}`"))?;
            signals.insert(ours.to_owned(), values);
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
            (signal::ALTITUDE, altitude_ft(c.g)),
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
        })
    }

    /// Our g in theirs: accelerometers count in units of the case's own gravity.
    fn accelerometer_unit(&self) -> f64 {
        G0_FT_S2 / self.constants.g
    }

    fn weights(&self) -> [f64; OUTPUTS] {
        let unit = self.accelerometer_unit();
        let weight = |o: Output| self.weights.get(&o).copied().unwrap_or(0.0);
        let [alpha, q, theta, an, ax] = Axis::Longitudinal.outputs().map(weight);
        [alpha, q, theta, an * unit * unit, ax * unit * unit]
    }

    /// The outputs, with the products of two different rates that 2.7 and 2.8 drop and we keep
    /// added to what was measured.
    fn measurements(&self, record: &Record) -> Measurements {
        let c = &self.constants;
        let values = |name: &str| record.values(name).unwrap_or_default();
        let [p, q, r] = [signal::P, signal::Q, signal::R].map(values);
        let [alpha, theta, an, ax] =
            [signal::ALPHA_VANE, signal::THETA, signal::AN, signal::AX].map(values);
        let unit = self.accelerometer_unit();
        let row = |k: usize| {
            let (p, r) = (p[k] / DEG, r[k] / DEG);
            // Down at the arm (−x forward, −z down): r p (−x); forward: p r (−z).
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

/// What the record's columns are in our signals.
const RECORDED: [(&str, &str); 14] = [
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

/// Peers stop after a step that lowered the cost by less than `ftol` of it; ours before a step that
/// would. So that it takes the step that peers take last, its tolerance is smaller by what a step
/// does near the minimum.
const STEPS_AHEAD: f64 = 0.01;

const LATITUDE_DEG: f64 = 45.0;

/// The altitude at which gravity is g, ft: the case gives g alone.
fn altitude_ft(g: f64) -> f64 {
    let (mut low, mut high) = (-100_000.0, 1_000_000.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if gravity_ft_s2(LATITUDE_DEG, middle) > g {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}

/// Wall clock and processor time since a begin.
struct Clock {
    wall: Instant,
    cpu_s: f64,
}

impl Clock {
    fn start() -> Clock {
        Clock {
            wall: Instant::now(),
            cpu_s: processor_s(),
        }
    }

    fn wall_s(&self) -> f64 {
        self.wall.elapsed().as_secs_f64()
    }

    fn cpu_s(&self) -> f64 {
        processor_s() - self.cpu_s
    }
}

/// Processor time of the whole process, s.
fn processor_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn the_standard_case_reaches_the_minimum_of_its_peers_and_the_truth() {
        #[derive(Deserialize)]
        struct Said {
            truth: BTreeMap<String, f64>,
        }
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/standard_case.json");
        let timed = timed(&load(&file).unwrap(), 1).unwrap();
        assert_eq!((timed.outcome, timed.iterations), ("converged", 4));
        // CasADi, JAX, SciPy, C++ and others; the copy of the record is rounded to a millionth.
        assert_relative_eq!(timed.cost.unwrap(), 0.011_840_931_330, max_relative = 1e-6);
        let said: Said = serde_json::from_str(&files::text(&file).unwrap()).unwrap();
        // Biases and constants take up what the noise of the substituted signals does.
        for (name, truth) in said.truth.iter().filter(|(name, _)| bias(name).is_none()) {
            let off = (timed.theta[name] - truth) / timed.std[name].max(timed.std_corrected[name]);
            assert!(off.abs() < 5.0, "{name} is {off:.1} standard errors off");
        }
        assert_eq!(timed.wall_s.len(), 1);
    }
}
