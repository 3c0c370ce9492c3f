//! Aerodynamic coefficients of a simulation: the values at trim, and their change with the motion
//! and the surfaces.
//!
//! A coefficient is C = C_trim + ∫ C_α dα + Σ C_x(α) (x − x_trim). C_trim is its value at trim, and
//! the integral of its derivative C_α is taken from the trim to the present angle of attack. The
//! sum is over all other regressors x, with the derivatives C_x at the present angle of attack. A
//! derivative is a local slope, as estimated. Constants of the database do not enter, because
//! C_trim is matched to the flight.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]
#![expect(
    clippy::needless_range_loop,
    reason = "plain indices become straight code for the vectors"
)]

use nalgebra::Vector3;

use super::derivative_table::{
    ALPHA_ROW, CoefficientLanes, DerivativePlace, DerivativeTable, FIRST_ROW,
};
use super::factor::{AeroInputs, FLOW, Factor, Factors};
use crate::aero::{AeroModel, Axis, Coefficient, Condition, Derivative, WindTunnel};
use crate::aircraft::Aircraft;
use crate::flight::signal;
use crate::numerics::vectors::simd::{VECTOR, vectorised};

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

/// Build-up with the derivatives of one model.
#[derive(Clone, Debug)]
pub struct Aerodynamics<'a> {
    aircraft: &'a Aircraft,
    /// Factors of the derivatives in the order of the table's rows.
    factors: Vec<Factor>,
    has_alpha_rate: bool,
    pub table: DerivativeTable,
}

/// Trim from which a simulation starts.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulationTrim {
    pub coefficients: [f64; COEFFICIENTS],
    /// Factors of the build-up at the trim.
    pub factors: Vec<f64>,
}

impl SimulationTrim {
    /// Coefficients from their change relative to the trim.
    #[must_use]
    pub fn plus(&self, change: [f64; COEFFICIENTS]) -> [f64; COEFFICIENTS] {
        std::array::from_fn(|i| self.coefficients[i] + change[i])
    }
}

impl<'a> Aerodynamics<'a> {
    /// Tabulates the derivatives of a model at a maneuver's condition. A derivative that the model
    /// lacks is taken from the fallback, or is zero.
    #[must_use]
    pub fn new(
        (aircraft, aero_model): (&'a Aircraft, &AeroModel),
        models: (&WindTunnel, &WindTunnel),
        condition: &Condition,
    ) -> Aerodynamics<'a> {
        let (factors, places) = build_up(aircraft, aero_model);
        Aerodynamics {
            aircraft,
            factors,
            has_alpha_rate: aero_model.along_alpha_rate().next().is_some(),
            table: DerivativeTable::new((aero_model, places), models, condition),
        }
    }

    /// Factors in a flow, with the recorded signals.
    pub fn factors<'b>(
        &'b self,
        flow: &'b AeroInputs,
        recorded: &'b [f64],
    ) -> impl Iterator<Item = f64> + 'b {
        let factors = self.factors.iter();
        factors.map(|factor| factor.value(flow, recorded))
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

/// Factors of a build-up, and the place of each derivative in their table.
fn build_up(aircraft: &Aircraft, aero_model: &AeroModel) -> (Vec<Factor>, Vec<DerivativePlace>) {
    let recorded = recorded_signals(aero_model);
    let factor_of = |d: &Derivative| {
        let factors = Factors {
            aircraft,
            recorded: &recorded,
            coefficient: d.coefficient,
        };
        factors.factor_of(&d.regressor)
    };
    let mut factors = vec![Factor::Alpha, Factor::Constant];
    let mut places: Vec<DerivativePlace> = Vec::with_capacity(aero_model.derivatives.len());
    for derivative in &aero_model.derivatives {
        let (factor, coefficient) = (factor_of(derivative), index(derivative.coefficient));
        // A second derivative of a coefficient along the same factor has a row of its own.
        let is_free =
            |row: usize| row < FIRST_ROW || !places.contains(&DerivativePlace { row, coefficient });
        let row = (0..factors.len()).find(|row| factors[*row] == factor && is_free(*row));
        let row = row.unwrap_or_else(|| {
            factors.push(factor);
            factors.len() - 1
        });
        places.push(DerivativePlace { row, coefficient });
    }
    (factors, places)
}

/// Aerodynamics about a trim, prepared for a run of thousands of instants. What does not change from
/// the trim is computed once.
#[derive(Clone, Debug)]
pub struct TrimmedAerodynamics<'a> {
    aerodynamics: &'a Aerodynamics<'a>,
    factors_at_trim: Vec<f64>,
    /// Integrals of the derivatives along α at the trim.
    integrals_at_trim: CoefficientLanes,
    /// Change of each factor from the trim at the present instant.
    moved: Vec<f64>,
    /// Slopes of the factors along the flow at the present instant.
    slopes_of_factors: Vec<FactorSlope>,
}

impl<'a> TrimmedAerodynamics<'a> {
    #[must_use]
    pub fn new(aerodynamics: &'a Aerodynamics, trim: &SimulationTrim) -> TrimmedAerodynamics<'a> {
        let factors_at_trim = trim.factors.clone();
        let alpha_deg = factors_at_trim.get(ALPHA_ROW).copied().unwrap_or(f64::NAN);
        TrimmedAerodynamics {
            aerodynamics,
            integrals_at_trim: aerodynamics.table.entries(alpha_deg).integrals(),
            moved: vec![0.0; factors_at_trim.len()],
            factors_at_trim,
            slopes_of_factors: vec![],
        }
    }

    /// `true` if the coefficients depend on the rate of the angle of attack.
    #[must_use]
    pub fn have_alpha_rate(&self) -> bool {
        self.aerodynamics.has_alpha_rate
    }

    /// Change of the coefficients from the trim.
    #[must_use]
    pub fn change(&mut self, flow: &AeroInputs, recorded: &[f64]) -> [f64; COEFFICIENTS] {
        self.set_moved(flow, recorded);
        let entries = self.aerodynamics.table.entries(flow.alpha_deg);
        let change = vectorised(
            #[inline(always)]
            || {
                let mut change = entries.integrals();
                for c in 0..VECTOR {
                    change[c] -= self.integrals_at_trim[c];
                }
                entries.add_products(&self.moved, &mut change);
                change
            },
        );
        std::array::from_fn(|i| change[i])
    }

    /// Slopes of the coefficients along the flow and along each derivative.
    #[must_use]
    pub fn slopes(&mut self, flow: &AeroInputs, recorded: &[f64]) -> CoefficientSlopes<'_> {
        self.set_moved(flow, recorded);
        self.set_slopes_of_factors(flow, recorded);
        let entries = self.aerodynamics.table.entries(flow.alpha_deg);
        let by_flow = vectorised(
            #[inline(always)]
            || {
                let mut by_flow = [[0.0; VECTOR]; FLOW];
                let mut by_alpha = entries.integral_slopes();
                for row in FIRST_ROW..self.moved.len() {
                    add_multiple(&mut by_alpha, self.moved[row], &entries.value_slopes(row));
                }
                by_flow[AeroInputs::ALPHA] = by_alpha;
                for along in &self.slopes_of_factors {
                    let values = entries.values(along.row);
                    add_multiple(&mut by_flow[along.quantity], along.slope, &values);
                }
                by_flow
            },
        );
        CoefficientSlopes {
            by_flow,
            by_derivative: &self.moved,
        }
    }

    fn set_moved(&mut self, flow: &AeroInputs, recorded: &[f64]) {
        let factors = self.aerodynamics.factors.iter().zip(&self.factors_at_trim);
        for (moved, (factor, at_trim)) in self.moved.iter_mut().zip(factors) {
            *moved = factor.value(flow, recorded) - at_trim;
        }
    }

    fn set_slopes_of_factors(&mut self, flow: &AeroInputs, recorded: &[f64]) {
        self.slopes_of_factors.clear();
        let factors = self.aerodynamics.factors.iter().enumerate();
        for (row, factor) in factors.skip(FIRST_ROW) {
            factor.slopes((flow, recorded), 1.0, &mut |quantity, slope| {
                self.slopes_of_factors.push(FactorSlope {
                    row,
                    quantity,
                    slope,
                });
            });
        }
    }
}

/// Slope of the factor of a row along one quantity of the flow.
#[derive(Clone, Copy, Debug)]
struct FactorSlope {
    row: usize,
    quantity: usize,
    slope: f64,
}

/// Adds a multiple of the numbers of all coefficients.
#[inline(always)]
fn add_multiple(sums: &mut CoefficientLanes, factor: f64, numbers: &CoefficientLanes) {
    for c in 0..VECTOR {
        sums[c] = factor.mul_add(numbers[c], sums[c]);
    }
}

/// Slopes of the coefficients at an instant.
#[derive(Clone, Debug)]
pub struct CoefficientSlopes<'a> {
    /// Along each quantity of the flow.
    pub by_flow: [CoefficientLanes; FLOW],
    /// Along the derivatives of each row of the table. A derivative is raised by the same amount at
    /// every angle of attack.
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
