//! Regressors at every point, and what a case keeps of the measured motion.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use std::marker::PhantomData;

use nalgebra::SVector;
use pulp::{Arch, Simd, WithSimd};

use super::build_up::Acting;
use super::chunking::{BEYOND, WIDEST_STRIDE};
use crate::aero::{Derivative, Regressor};
use crate::aircraft::Aircraft;
use crate::dynamics::motion::Window;
use crate::dynamics::{COEFFICIENTS, Equations};
use crate::flight::signal;
use crate::units::DEG;

/// What a case keeps of the motion.
pub(super) struct Along<const NX: usize, E: Equations<NX>> {
    pub known: Vec<E::Known>,
    /// α and β at the c.g. at every point, rad.
    flow: Vec<[f64; 2]>,
    pub sensed: Vec<E::Sensed>,
    pub states: Vec<SVector<f64, NX>>,
    pub implied: Vec<[f64; COEFFICIENTS]>,
}

impl<const NX: usize, E: Equations<NX>> Along<NX, E> {
    pub fn over(aircraft: &Aircraft, window: &Window) -> Self {
        let (points, samples) = (window.len(), window.samples);
        let mut along = Along {
            known: Vec::with_capacity(points + 2 * WIDEST_STRIDE),
            flow: Vec::with_capacity(points),
            sensed: Vec::with_capacity(samples),
            states: Vec::with_capacity(samples),
            implied: Vec::with_capacity(samples),
        };
        Arch::new().dispatch(Over {
            aircraft,
            window,
            along: &mut along,
        });
        along
    }
}

/// Takes over the motion point by point, compiled for the processor at hand.
struct Over<'a, const NX: usize, E: Equations<NX>> {
    aircraft: &'a Aircraft,
    window: &'a Window,
    along: &'a mut Along<NX, E>,
}

impl<const NX: usize, E: Equations<NX>> WithSimd for Over<'_, NX, E> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Over {
            aircraft,
            window,
            along,
        } = self;
        let motion = window.motion(aircraft);
        for point in 0..window.len() {
            let motion = motion.at(point);
            let known = E::known(aircraft, &motion);
            along.flow.push([motion.alpha, motion.beta]);
            if point % 2 == 0 {
                along.sensed.push(E::sensed(aircraft, &motion));
                along.states.push(E::measured_state(&motion));
                along
                    .implied
                    .push(E::coefficients(aircraft, &motion, &known));
            }
            along.known.push(known);
        }
    }
}

/// Distinct columns of regressors.
pub(super) struct Columns<'a, const NX: usize, E: Equations<NX>> {
    aircraft: &'a Aircraft,
    window: &'a Window,
    /// Of each column a derivative that has it.
    asked: Vec<&'a Derivative>,
    equations: PhantomData<E>,
}

impl<'a, const NX: usize, E: Equations<NX>> Columns<'a, NX, E> {
    pub fn new(aircraft: &'a Aircraft, window: &'a Window) -> Self {
        Columns {
            aircraft,
            window,
            asked: vec![],
            equations: PhantomData,
        }
    }

    /// How a derivative acts. Two share a column when they have the same regressor, but a vane's
    /// moment is not its force.
    pub fn acting(&mut self, derivative: &'a Derivative) -> Acting {
        let moment =
            |d: &Derivative| matches!(d.regressor, Regressor::Vane(_)) && d.coefficient.is_moment();
        let same = |d: &&Derivative| {
            d.regressor == derivative.regressor && moment(d) == moment(derivative)
        };
        let column = self.asked.iter().position(same).unwrap_or_else(|| {
            self.asked.push(derivative);
            self.asked.len() - 1
        });
        Acting {
            coefficient: derivative.coefficient.index(),
            along: E::state_of(&derivative.regressor),
            column,
        }
    }

    /// Every column at every point, with room for points beyond.
    pub fn filled(&self, along: &Along<NX, E>) -> Vec<Vec<f64>> {
        let filled = |derivative: &&Derivative| {
            let mut column = Vec::with_capacity(self.window.len() + BEYOND);
            self.fill(derivative, along, &mut column);
            column
        };
        self.asked.iter().map(filled).collect()
    }

    /// A derivative's regressor at every point; where it is a state the factor of proportion.
    fn fill(&self, derivative: &Derivative, along: &Along<NX, E>, column: &mut Vec<f64>) {
        let (aircraft, velocity) = (self.aircraft, self.window.signal(signal::VELOCITY));
        let regressor = &derivative.regressor;
        if E::state_of(regressor).is_some() {
            let factor = |v: &f64| {
                E::state_regressor(aircraft, *v, regressor).map_or(0.0, |(_, factor)| factor)
            };
            return column.extend(velocity.iter().map(factor));
        }
        let mut rate = |name: &str, length: f64| {
            let both = self.window.signal(name).iter().zip(velocity);
            column.extend(both.map(|(rate, v)| rate / DEG * length / (2.0 * v)));
        };
        match regressor {
            Regressor::RollRate => rate(signal::P, aircraft.span_ft),
            Regressor::PitchRate => rate(signal::Q, aircraft.chord_ft),
            Regressor::YawRate => rate(signal::R, aircraft.span_ft),
            Regressor::Constant => column.resize(self.window.len(), 1.0),
            Regressor::Alpha => column.extend(along.flow.iter().map(|[alpha, _]| alpha * DEG)),
            Regressor::Beta => column.extend(along.flow.iter().map(|[_, beta]| beta * DEG)),
            Regressor::Surface(name) => column.extend(self.window.signal(name)),
            Regressor::Vane(name) => {
                let both = self
                    .window
                    .signal(name)
                    .iter()
                    .zip(self.window.signal(signal::QBAR));
                column.extend(
                    both.map(|(force, qbar)| force * surface_factor(aircraft, *qbar, derivative)),
                );
            }
        }
    }
}

/// Regressor per deflection, 1/deg times deg or per lbf: one for a surface; a vane's force and
/// moment are made coefficients.
pub(crate) fn surface_factor(aircraft: &Aircraft, qbar: f64, derivative: &Derivative) -> f64 {
    if !matches!(derivative.regressor, Regressor::Vane(_)) {
        return 1.0;
    }
    let force = qbar * aircraft.wing_area_ft2;
    let length = match derivative.coefficient.axis() {
        crate::aero::Axis::Longitudinal => aircraft.chord_ft,
        crate::aero::Axis::Lateral => aircraft.span_ft,
    };
    1.0 / if derivative.coefficient.is_moment() {
        force * length
    } else {
        force
    }
}
