//! A flight from formulas that obeys the equations of motion, for tests.

use super::clock::find_clock;
use super::grid::Grid;
use super::quantity::Quantity;
use super::recording::{Column, Recording};
use super::search::assignment::{Assignment, Candidates, Choice};
use super::search::plausible::{candidates, facts};
use crate::earth::air;
use crate::units::G0_FT_S2;

const STEP_S: f64 = 0.1;
const SAMPLES: usize = 3_000;
/// Half the interval of numerical derivatives, s.
const HALF_S: f64 = 1e-4;

/// A column of a test recording: name, quantity, and unit of the values.
pub type Recorded = (&'static str, Quantity, &'static str);

/// Values of all quantities over time, in rad, ft, s and slug.
#[derive(Clone, Copy, Debug)]
pub struct TestFlight {
    /// Amplitude of the bank angle, rad.
    pub bank: f64,
    /// Mean pitch attitude, rad.
    pub pitch: f64,
    /// Factor of the motion in pitch.
    pub pitching: f64,
}

impl Default for TestFlight {
    fn default() -> TestFlight {
        TestFlight {
            bank: 0.5,
            pitch: 0.12,
            pitching: 1.0,
        }
    }
}

impl TestFlight {
    fn theta(self, t: f64) -> f64 {
        self.pitch + self.pitching * (0.06 * (0.5 * t).sin() + 0.04 * (1.3 * t).sin())
    }

    fn alpha(self, t: f64) -> f64 {
        0.14 + self.pitching * (0.05 * (0.6 * t + 1.0).sin() + 0.02 * (1.7 * t).sin())
    }

    fn phi(self, t: f64) -> f64 {
        self.bank * ((0.3 * t).sin() + 0.3 * (1.1 * t).sin())
    }

    fn psi(self, t: f64) -> f64 {
        self.bank * (0.4 * (0.37 * t).sin() + 0.1 * (0.9 * t).sin())
    }

    /// Components of the velocity along the body axes, ft/s.
    fn uvw(self, t: f64) -> [f64; 3] {
        let (alpha, beta, velocity) = (self.alpha(t), beta(t), velocity(t));
        let level = velocity * beta.cos();
        [
            level * alpha.cos(),
            velocity * beta.sin(),
            level * alpha.sin(),
        ]
    }

    /// Angular rates about the body axes, rad/s.
    fn rates(self, t: f64) -> [f64; 3] {
        let (sin_theta, cos_theta) = self.theta(t).sin_cos();
        let (sin_phi, cos_phi) = self.phi(t).sin_cos();
        let [theta, phi, psi] = [
            slope(|t| self.theta(t), t),
            slope(|t| self.phi(t), t),
            slope(|t| self.psi(t), t),
        ];
        [
            phi - psi * sin_theta,
            theta * cos_phi + psi * cos_theta * sin_phi,
            psi * cos_theta * cos_phi - theta * sin_phi,
        ]
    }

    /// Accelerations of the instruments: axial, lateral, normal, ft/s².
    fn accelerations(self, t: f64) -> [f64; 3] {
        let ([u, v, w], [p, q, r]) = (self.uvw(t), self.rates(t));
        let (sin_theta, cos_theta) = self.theta(t).sin_cos();
        let (sin_phi, cos_phi) = self.phi(t).sin_cos();
        let change = |axis: usize| slope(|t| self.uvw(t)[axis], t);
        [
            change(0) - r * v + q * w + G0_FT_S2 * sin_theta,
            change(1) - p * w + r * u - G0_FT_S2 * cos_theta * sin_phi,
            q * u - p * v + G0_FT_S2 * cos_theta * cos_phi - change(2),
        ]
    }

    fn climb(self, t: f64) -> f64 {
        let [u, v, w] = self.uvw(t);
        let (sin_theta, cos_theta) = self.theta(t).sin_cos();
        let (sin_phi, cos_phi) = self.phi(t).sin_cos();
        u * sin_theta - (v * sin_phi + w * cos_phi) * cos_theta
    }

    /// Altitude at each sample, ft.
    fn altitudes(self) -> Vec<f64> {
        let mut altitude = 12_000.0;
        let step = |t: &f64| {
            let before = altitude;
            altitude += 0.5 * STEP_S * (self.climb(*t) + self.climb(t + STEP_S));
            before
        };
        times().iter().map(step).collect()
    }

    /// Values of a quantity at each sample, in rad, ft, s and slug.
    fn values(self, quantity: Quantity) -> Vec<f64> {
        let altitudes = self.altitudes();
        let value = |(t, altitude): (f64, f64)| match quantity {
            Quantity::Alpha => self.alpha(t),
            Quantity::Beta => beta(t),
            Quantity::Velocity => velocity(t),
            Quantity::Mach => velocity(t) / air(altitude).sound_ft_s,
            Quantity::Altitude => altitude,
            Quantity::P => self.rates(t)[0],
            Quantity::Q => self.rates(t)[1],
            Quantity::R => self.rates(t)[2],
            Quantity::Theta => self.theta(t),
            Quantity::Phi => self.phi(t),
            Quantity::Psi => self.psi(t),
            Quantity::Ax => self.accelerations(t)[0],
            Quantity::Ay => self.accelerations(t)[1],
            Quantity::An => self.accelerations(t)[2],
            Quantity::Qbar => 0.5 * air(altitude).density_slug_ft3 * velocity(t).powi(2),
        };
        times().into_iter().zip(altitudes).map(value).collect()
    }

    /// Recording of some quantities, without stated units.
    #[must_use]
    pub fn recording(self, columns: &[Recorded]) -> Recording {
        let column = |(name, quantity, unit): &Recorded| {
            let factor = quantity.factor(unit).expect("a unit of the quantity");
            let values = self.values(*quantity).into_iter();
            test_column(name, values.map(|v| v / factor).collect())
        };
        let mut recorded: Vec<Column> = columns.iter().map(column).collect();
        recorded.push(test_column("time", times()));
        Recording {
            name: "flight".to_owned(),
            columns: recorded,
        }
    }
}

fn beta(t: f64) -> f64 {
    0.05 * (0.7 * t).sin() + 0.02 * (1.9 * t).sin()
}

fn velocity(t: f64) -> f64 {
    520.0 + 60.0 * (0.11 * t).sin() + 15.0 * (0.4 * t).sin()
}

fn slope(value: impl Fn(f64) -> f64, t: f64) -> f64 {
    (value(t + HALF_S) - value(t - HALF_S)) / (2.0 * HALF_S)
}

/// Times of the samples, s.
#[must_use]
pub fn times() -> Vec<f64> {
    (0..SAMPLES).map(|k| STEP_S * k as f64).collect()
}

/// A column without a stated unit.
#[must_use]
pub fn test_column(name: &str, values: Vec<f64>) -> Column {
    Column {
        name: name.to_owned(),
        stated: None,
        values,
    }
}

/// Grid and candidates of a recording.
#[must_use]
pub fn searched(recording: &Recording) -> (Grid, Candidates) {
    let recordings = std::slice::from_ref(recording);
    let clock = find_clock(recordings).expect("a clock");
    let facts = facts(recordings);
    (Grid::of(recordings, &clock), candidates(&facts, &clock))
}

/// The assignment of each column to its quantity, in some units.
#[must_use]
pub fn assigned(columns: &[Recorded]) -> Assignment {
    let choice = |(name, quantity, unit): &Recorded| {
        let choice = Choice {
            column: (*name).to_owned(),
            unit,
            sign: 1.0,
        };
        (*quantity, choice)
    };
    columns.iter().map(choice).collect()
}
