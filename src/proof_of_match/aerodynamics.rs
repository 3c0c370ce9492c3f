//! Aerodynamic coefficients of a simulation: those of the trim, and their change with everything that
//! moves from it.
//!
//! C = C_trim + ∫ C_α dα + Σ C_x(α) (x − x_trim), with the derivatives at the present angle of attack.
//! A derivative is the local slope, as it is estimated; the level of a coefficient is matched at the
//! trim, so constants of the database do not enter.

use nalgebra::Vector3;

use super::derivative_table::DerivativeTable;
use crate::aero::{Axis, Buildup, Coefficient, Derivative, Regressor};
use crate::aircraft::Aircraft;
use crate::flight::signal;

/// Number of coefficients: CN, Cm, CA, CY, Cl, Cn.
pub const COEFFICIENTS: usize = 6;

/// Recorded signals of a build-up, each once: surfaces and vanes. The simulation has the flow itself.
#[must_use]
pub fn recorded_signals(buildup: &Buildup) -> Vec<&str> {
    let all = buildup
        .derivatives
        .iter()
        .flat_map(|d| d.regressor.signals());
    let mut signals: Vec<&str> = all
        .filter(|name| !signal::OF_THE_FLOW.contains(name))
        .collect();
    signals.sort_unstable();
    signals.dedup();
    signals
}

/// Flow at the c.g. and rotation, in deg, rad/s, ft/s, lbf/ft².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flow {
    pub alpha_deg: f64,
    pub beta_deg: f64,
    pub velocity: f64,
    pub mach: f64,
    pub rates: [f64; 3],
    pub alpha_rate: f64,
    pub qbar: f64,
}

/// Factor of a derivative, with the constants that it needs.
#[derive(Clone, Debug, PartialEq)]
enum Factor {
    Constant,
    Alpha,
    Beta,
    Velocity,
    Mach,
    /// Rate of an axis times half this length over the airspeed.
    Rate {
        axis: usize,
        half_length: f64,
    },
    /// Rate of the angle of attack times half this length over the airspeed.
    AlphaRate {
        half_length: f64,
    },
    /// Recorded signal with this place.
    Recorded(usize),
    /// Recorded deflection over dynamic pressure times this area or volume.
    Vane {
        place: usize,
        size: f64,
    },
    Magnitude(Box<Factor>),
    Product(Box<[Factor; 2]>),
}

/// Terms of the build-up with the derivatives of one model.
#[derive(Clone, Debug)]
pub struct Aerodynamics<'a> {
    aircraft: &'a Aircraft,
    /// Coefficient and factor of each derivative, in the order of the build-up.
    terms: Vec<(usize, Factor)>,
    has_lag: bool,
    pub table: DerivativeTable,
}

/// Balance from which a simulation starts.
#[derive(Clone, Debug, PartialEq)]
pub struct Trim {
    pub coefficients: [f64; COEFFICIENTS],
    /// Factors of the derivatives at the trim.
    pub factors: Vec<f64>,
    pub alpha_deg: f64,
}

impl<'a> Aerodynamics<'a> {
    #[must_use]
    pub fn new(
        aircraft: &'a Aircraft,
        buildup: &Buildup,
        table: DerivativeTable,
    ) -> Aerodynamics<'a> {
        let derivatives = buildup.derivatives.iter();
        let recorded = recorded_signals(buildup);
        let term = |d: &Derivative| {
            let factors = Factors {
                aircraft,
                recorded: &recorded,
                coefficient: d.coefficient,
            };
            (index(d.coefficient), factors.of(&d.regressor))
        };
        Aerodynamics {
            aircraft,
            terms: derivatives.map(term).collect(),
            has_lag: buildup.lags().next().is_some(),
            table,
        }
    }

    /// Factors of all derivatives in a flow, with the recorded signals.
    pub fn factors<'b>(
        &'b self,
        flow: &'b Flow,
        recorded: &'b [f64],
    ) -> impl Iterator<Item = f64> + 'b {
        let terms = self.terms.iter();
        terms.map(|(_, factor)| factor.value(flow, recorded))
    }

    /// Force, lbf, and moment about the c.g., ft lbf, in body axes.
    #[must_use]
    pub fn loads(
        &self,
        coefficients: &[f64; COEFFICIENTS],
        qbar: f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let [normal, pitching, axial, side, rolling, yawing] = *coefficients;
        let area = qbar * self.aircraft.wing_area_ft2;
        let (span, chord) = (self.aircraft.span_ft, self.aircraft.chord_ft);
        (
            Vector3::new(-axial, side, -normal) * area,
            Vector3::new(span * rolling, chord * pitching, span * yawing) * area,
        )
    }
}

/// Aerodynamics about a trim, prepared for a run of thousands of instants: the coefficients at the trim
/// are computed once, and factors that several derivatives have once an instant.
#[derive(Clone, Debug)]
pub struct AboutTrim<'a> {
    table: &'a DerivativeTable,
    /// Terms of each coefficient in the order of the build-up, without the constants.
    terms: [Vec<TrimmedTerm>; COEFFICIENTS],
    /// Factors of the terms, each once.
    factors: Vec<&'a Factor>,
    /// Values of the factors at the present instant.
    values: Vec<f64>,
    has_lag: bool,
}

/// Term of a build-up about a trim.
#[derive(Clone, Debug)]
struct TrimmedTerm {
    derivative: usize,
    /// Place among the factors.
    factor: usize,
    is_along_alpha: bool,
    /// Factor at the trim; along α the integral of the derivative there.
    at_trim: f64,
}

impl<'a> AboutTrim<'a> {
    #[must_use]
    pub fn new(aerodynamics: &'a Aerodynamics, trim: &Trim) -> AboutTrim<'a> {
        let table = &aerodynamics.table;
        let place = table.place(trim.alpha_deg);
        let mut terms = [const { Vec::new() }; COEFFICIENTS];
        let mut factors: Vec<&Factor> = Vec::new();
        let own = aerodynamics.terms.iter().zip(&trim.factors).enumerate();
        for (derivative, ((coefficient, factor), factor_at_trim)) in own {
            if *factor == Factor::Constant {
                continue;
            }
            let is_along_alpha = *factor == Factor::Alpha;
            let known = factors.iter().position(|known| *known == factor);
            terms[*coefficient].push(TrimmedTerm {
                derivative,
                factor: known.unwrap_or(factors.len()),
                is_along_alpha,
                at_trim: if is_along_alpha {
                    table.entries(place).integral(derivative)
                } else {
                    *factor_at_trim
                },
            });
            if known.is_none() {
                factors.push(factor);
            }
        }
        AboutTrim {
            table,
            terms,
            values: vec![0.0; factors.len()],
            has_lag: aerodynamics.has_lag,
            factors,
        }
    }

    /// True where the coefficients depend on the rate of the angle of attack.
    #[must_use]
    pub fn have_lag(&self) -> bool {
        self.has_lag
    }

    /// Change of the coefficients from the trim.
    #[must_use]
    pub fn change(&mut self, flow: &Flow, recorded: &[f64]) -> [f64; COEFFICIENTS] {
        for (value, factor) in self.values.iter_mut().zip(&self.factors) {
            *value = factor.value(flow, recorded);
        }
        let entries = self.table.entries(self.table.place(flow.alpha_deg));
        let mut change = [0.0; COEFFICIENTS];
        for (sum, terms) in change.iter_mut().zip(&self.terms) {
            for term in terms {
                *sum += if term.is_along_alpha {
                    entries.integral(term.derivative) - term.at_trim
                } else {
                    entries.value(term.derivative) * (self.values[term.factor] - term.at_trim)
                };
            }
        }
        change
    }
}

/// Place of a coefficient among those of both axes.
fn index(coefficient: Coefficient) -> usize {
    let first = match coefficient.axis() {
        Axis::Longitudinal => 0,
        Axis::Lateral => 3,
    };
    first + coefficient.index()
}

/// Aircraft, recorded signals and coefficient from which factors follow.
struct Factors<'a> {
    aircraft: &'a Aircraft,
    recorded: &'a [&'a str],
    coefficient: Coefficient,
}

impl Factors<'_> {
    fn of(&self, regressor: &Regressor) -> Factor {
        let rate = |axis: usize, length: f64| Factor::Rate {
            axis,
            half_length: 0.5 * length,
        };
        match regressor {
            Regressor::Constant => Factor::Constant,
            Regressor::Alpha => Factor::Alpha,
            Regressor::Beta => Factor::Beta,
            Regressor::RollRate => rate(0, self.aircraft.span_ft),
            Regressor::PitchRate => rate(1, self.aircraft.chord_ft),
            Regressor::YawRate => rate(2, self.aircraft.span_ft),
            Regressor::AlphaRate => Factor::AlphaRate {
                half_length: 0.5 * self.aircraft.chord_ft,
            },
            Regressor::Surface(name) if name == signal::VELOCITY => Factor::Velocity,
            Regressor::Surface(name) if name == signal::MACH => Factor::Mach,
            Regressor::Surface(name) => Factor::Recorded(self.place(name)),
            Regressor::Vane(name) => Factor::Vane {
                place: self.place(name),
                size: self.aircraft.wing_area_ft2
                    * self.coefficient.reference_length(self.aircraft),
            },
            Regressor::Magnitude(of) => Factor::Magnitude(Box::new(self.of(of))),
            Regressor::Product(both) => {
                Factor::Product(Box::new([self.of(&both[0]), self.of(&both[1])]))
            }
        }
    }

    fn place(&self, name: &str) -> usize {
        let place = self.recorded.iter().position(|own| *own == name);
        place.unwrap_or(usize::MAX)
    }
}

impl Factor {
    #[inline]
    fn value(&self, flow: &Flow, recorded: &[f64]) -> f64 {
        let at = |place: &usize| recorded.get(*place).copied().unwrap_or(0.0);
        match self {
            Factor::Constant => 1.0,
            Factor::Alpha => flow.alpha_deg,
            Factor::Beta => flow.beta_deg,
            Factor::Velocity => flow.velocity,
            Factor::Mach => flow.mach,
            Factor::Rate { axis, half_length } => flow.rates[*axis] * half_length / flow.velocity,
            Factor::AlphaRate { half_length } => flow.alpha_rate * half_length / flow.velocity,
            Factor::Recorded(place) => at(place),
            Factor::Vane { place, size } => at(place) / (flow.qbar * size),
            Factor::Magnitude(of) => of.value(flow, recorded).abs(),
            Factor::Product(both) => both[0].value(flow, recorded) * both[1].value(flow, recorded),
        }
    }
}
