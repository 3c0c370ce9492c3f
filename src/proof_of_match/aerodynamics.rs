//! Aerodynamic coefficients of a simulation: the values at trim, and their change with the motion
//! and the surfaces.
//!
//! A coefficient is C = C_trim + ∫ C_α dα + Σ C_x(α) (x − x_trim). C_trim is its value at trim, and
//! the integral of its derivative C_α is taken from the trim to the present angle of attack. The
//! sum is over all other regressors x, with the derivatives C_x at the present angle of attack. A
//! derivative is a local slope, as estimated. Constants of the database do not enter, because
//! C_trim is matched to the flight.

use nalgebra::Vector3;

use super::derivative_table::DerivativeTable;
use super::factor::{AeroInputs, FLOW, Factor, Factors, FlowSlopes};
use crate::aero::{AeroModel, Axis, Coefficient, Derivative};
use crate::aircraft::Aircraft;
use crate::flight::signal;

/// Number of coefficients: CN, Cm, CA, CY, Cl, Cn.
pub const COEFFICIENTS: usize = 6;

/// Force along body x, y and z: index of its coefficient and sign, X = −CA, Y = CY, Z = −CN.
pub const FORCE: [(usize, f64); 3] = [(2, -1.0), (3, 1.0), (0, -1.0)];

/// Moment about body x, y and z: index of its coefficient, Cl, Cm, Cn.
pub const MOMENT: [usize; 3] = [4, 1, 5];

/// Recorded signals of a build-up, each once: surfaces and vanes. The flow itself comes from the
/// simulation.
#[must_use]
pub fn recorded_signals(aero_model: &AeroModel) -> Vec<&str> {
    let all = aero_model
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

/// Terms of the build-up with the derivatives of one model.
#[derive(Clone, Debug)]
pub struct Aerodynamics<'a> {
    aircraft: &'a Aircraft,
    /// Coefficient and factor of each derivative, in the order of the build-up.
    terms: Vec<(usize, Factor)>,
    has_alpha_rate: bool,
    pub table: DerivativeTable,
}

/// Trim from which a simulation starts: coefficients, and factors of the derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulationTrim {
    pub coefficients: [f64; COEFFICIENTS],
    /// Factors of the derivatives at the trim.
    pub factors: Vec<f64>,
    pub alpha_deg: f64,
}

impl SimulationTrim {
    /// Coefficients from their change relative to the trim.
    #[must_use]
    pub fn plus(&self, change: [f64; COEFFICIENTS]) -> [f64; COEFFICIENTS] {
        std::array::from_fn(|i| self.coefficients[i] + change[i])
    }
}

impl<'a> Aerodynamics<'a> {
    #[must_use]
    pub fn new(
        aircraft: &'a Aircraft,
        aero_model: &AeroModel,
        table: DerivativeTable,
    ) -> Aerodynamics<'a> {
        let derivatives = aero_model.derivatives.iter();
        let recorded = recorded_signals(aero_model);
        let term = |d: &Derivative| {
            let factors = Factors {
                aircraft,
                recorded: &recorded,
                coefficient: d.coefficient,
            };
            (index(d.coefficient), factors.factor_of(&d.regressor))
        };
        Aerodynamics {
            aircraft,
            terms: derivatives.map(term).collect(),
            has_alpha_rate: aero_model.along_alpha_rate().next().is_some(),
            table,
        }
    }

    /// Factors of all derivatives in a flow, with the recorded signals.
    pub fn factors<'b>(
        &'b self,
        flow: &'b AeroInputs,
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
        let area = qbar * self.aircraft.wing_area_ft2;
        let force = FORCE.map(|(coefficient, sign)| sign * coefficients[coefficient]);
        let lengths = self.lengths().into_iter().zip(MOMENT);
        let moment = lengths.map(|(length, coefficient)| length * coefficients[coefficient]);
        (
            Vector3::from(force) * area,
            Vector3::from_iterator(moment) * area,
        )
    }

    /// Index of a derivative's coefficient.
    #[must_use]
    pub fn coefficient(&self, derivative: usize) -> usize {
        self.terms[derivative].0
    }

    /// Reference lengths of the moments about the body axes, ft.
    #[must_use]
    pub fn lengths(&self) -> [f64; 3] {
        let Aircraft {
            span_ft, chord_ft, ..
        } = self.aircraft;
        [*span_ft, *chord_ft, *span_ft]
    }

    /// Reference area, ft².
    #[must_use]
    pub fn area(&self) -> f64 {
        self.aircraft.wing_area_ft2
    }
}

/// Aerodynamics about a trim, prepared for a run of thousands of instants. The coefficients at the
/// trim are computed once; a factor that several derivatives have is computed once per instant.
#[derive(Clone, Debug)]
pub struct TrimmedAerodynamics<'a> {
    table: &'a DerivativeTable,
    /// Terms of each coefficient in the order of the build-up, without the constants.
    terms: [Vec<TrimmedTerm>; COEFFICIENTS],
    /// Factors of the terms, each once.
    factors: Vec<&'a Factor>,
    /// Values of the factors at the present instant.
    values: Vec<f64>,
    /// Slopes of the factors along the flow at the present instant; `None` for recorded signals.
    slopes: Vec<Option<FlowSlopes>>,
    /// Every derivative at the present angle of attack.
    derivatives: Vec<f64>,
    /// Slope of each derivative's coefficient along the derivative at the present instant.
    by_derivative: Vec<f64>,
    has_alpha_rate: bool,
    trim_alpha_deg: f64,
}

/// Term of a build-up about a trim.
#[derive(Clone, Debug)]
struct TrimmedTerm {
    derivative: usize,
    /// Index of the term's factor in [`TrimmedAerodynamics::values`].
    factor: usize,
    is_along_alpha: bool,
    /// Factor at the trim; along α the integral of the derivative there.
    at_trim: f64,
}

impl<'a> TrimmedAerodynamics<'a> {
    #[must_use]
    pub fn new(aerodynamics: &'a Aerodynamics, trim: &SimulationTrim) -> TrimmedAerodynamics<'a> {
        let table = &aerodynamics.table;
        let place = table.position_of(trim.alpha_deg);
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
        TrimmedAerodynamics {
            table,
            terms,
            values: vec![0.0; factors.len()],
            slopes: factors
                .iter()
                .map(|factor| factor.follows_flow().then_some([0.0; FLOW]))
                .collect(),
            derivatives: vec![0.0; table.derivatives()],
            by_derivative: vec![0.0; table.derivatives()],
            has_alpha_rate: aerodynamics.has_alpha_rate,
            factors,
            trim_alpha_deg: trim.alpha_deg,
        }
    }

    /// `true` if the coefficients depend on the rate of the angle of attack.
    #[must_use]
    pub fn have_alpha_rate(&self) -> bool {
        self.has_alpha_rate
    }

    /// Change of the coefficients from the trim.
    #[must_use]
    pub fn change(&mut self, flow: &AeroInputs, recorded: &[f64]) -> [f64; COEFFICIENTS] {
        for (value, factor) in self.values.iter_mut().zip(&self.factors) {
            *value = factor.value(flow, recorded);
        }
        let entries = self.table.entries(self.table.position_of(flow.alpha_deg));
        entries.read_into(&mut self.derivatives);
        let mut change = [0.0; COEFFICIENTS];
        for (sum, terms) in change.iter_mut().zip(&self.terms) {
            for term in terms {
                *sum += if term.is_along_alpha {
                    entries.integral(term.derivative) - term.at_trim
                } else {
                    self.derivatives[term.derivative] * (self.values[term.factor] - term.at_trim)
                };
            }
        }
        change
    }

    /// Change of the coefficients from the trim, with its slopes along the flow and along each
    /// derivative. A derivative is raised by the same amount at every angle of attack.
    #[must_use]
    pub fn change_with_slopes(
        &mut self,
        flow: &AeroInputs,
        recorded: &[f64],
    ) -> CoefficientSlopes<'_> {
        let change = self.change(flow, recorded);
        let entries = self.table.entries(self.table.position_of(flow.alpha_deg));
        for (slopes, factor) in self.slopes.iter_mut().zip(&self.factors) {
            if let Some(slopes) = slopes {
                *slopes = factor.slopes(flow, recorded);
            }
        }
        let mut by_flow = [[0.0; FLOW]; COEFFICIENTS];
        for (sums, terms) in by_flow.iter_mut().zip(&self.terms) {
            for term in terms {
                if term.is_along_alpha {
                    sums[AeroInputs::ALPHA] += entries.integral_slope(term.derivative);
                    self.by_derivative[term.derivative] = flow.alpha_deg - self.trim_alpha_deg;
                    continue;
                }
                let moved = self.values[term.factor] - term.at_trim;
                sums[AeroInputs::ALPHA] += entries.value_slope(term.derivative) * moved;
                if let Some(slopes) = &self.slopes[term.factor] {
                    let value = self.derivatives[term.derivative];
                    for (sum, slope) in sums.iter_mut().zip(slopes) {
                        *sum += value * slope;
                    }
                }
                self.by_derivative[term.derivative] = moved;
            }
        }
        CoefficientSlopes {
            change,
            by_flow,
            by_derivative: &self.by_derivative,
        }
    }
}

/// Change of the coefficients from the trim, with its slopes, at an instant.
#[derive(Clone, Debug)]
pub struct CoefficientSlopes<'a> {
    pub change: [f64; COEFFICIENTS],
    pub by_flow: [FlowSlopes; COEFFICIENTS],
    /// Slope of each derivative's coefficient along the derivative.
    pub by_derivative: &'a [f64],
}

/// Index of a coefficient among the coefficients of both axes.
fn index(coefficient: Coefficient) -> usize {
    let first = match coefficient.axis() {
        Axis::Longitudinal => 0,
        Axis::Lateral => 3,
    };
    first + coefficient.index()
}
