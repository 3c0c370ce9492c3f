//! The states' own way through a chunk of samples, and what it leaves for the sensitivities: at
//! each stage of each step the slopes A = ∂ẋ/∂x (through the coefficients included) and B = ∂ẋ/∂c.
//!
//! A stage waits for the one before it, so the chain goes stage by stage beside other work
//! ([`Meanwhile`]).
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

use nalgebra::SVector;

use super::chunk::Near;
use crate::dynamics::{COEFFICIENTS, Equations};
use crate::numerics::row_products::Meanwhile;
use crate::numerics::runge_kutta::{POINT, STAGES};
use crate::numerics::simd::VECTOR;
use crate::output_error::case::Case;
use crate::output_error::case::chunking::{CHUNK, Spaced};

/// A state beyond this (rad, rad/s) is no flight: it stops the integration before the numbers
/// overflow.
const BEYOND_SENSE: f64 = 50.0;

/// What a chunk's course leaves: entry by entry, sample after sample.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Path<const NX: usize> {
    /// The states at the samples.
    pub states: [SVector<f64, NX>; CHUNK],
    /// What the first lanes of a group multiply their regressors by: the states that they follow,
    /// else one.
    pub times: [[[f64; VECTOR]; CHUNK]; STAGES],
    /// A by stage, rate and state.
    pub a: [[[[f64; CHUNK]; NX]; NX]; STAGES],
    /// B by stage, rate and coefficient.
    pub b: [[[[f64; CHUNK]; COEFFICIENTS]; NX]; STAGES],
}

impl<const NX: usize> Path<NX> {
    pub const NONE: Path<NX> = Path {
        states: [SVector::<f64, NX>::from_array_storage(nalgebra::ArrayStorage([[0.0; NX]; 1]));
            CHUNK],
        times: [[[1.0; VECTOR]; CHUNK]; STAGES],
        a: [[[[0.0; CHUNK]; NX]; NX]; STAGES],
        b: [[[[0.0; CHUNK]; COEFFICIENTS]; NX]; STAGES],
    };

    /// The first of some samples whose state left the bounds of sense or is no number.
    pub fn senseless(&self, samples: usize) -> Option<usize> {
        self.states[..samples]
            .iter()
            .position(|x| !x.iter().all(|x| x.abs() < BEYOND_SENSE))
    }
}

/// The classical Runge-Kutta steps of a chunk, stage by stage.
pub(crate) struct Course<'a, const NX: usize, E: Equations<NX>> {
    case: &'a Case<NX, E>,
    near: &'a Near<NX>,
    path: &'a mut Path<NX>,
    /// The state at the sample, at the stage, and what is there of the next sample's.
    x: SVector<f64, NX>,
    at: SVector<f64, NX>,
    next: SVector<f64, NX>,
    points: Spaced,
    sample: usize,
    stage: usize,
    end: usize,
    /// How far ahead each stage looks along its slope, and its part of the step, s.
    ahead_s: [f64; STAGES],
    part_s: [f64; STAGES],
}

impl<'a, const NX: usize, E: Equations<NX>> Course<'a, NX, E> {
    /// The course from the state `x` over `samples` samples: at the first of these points, at every
    /// other of them.
    pub fn new(
        case: &'a Case<NX, E>,
        near: &'a Near<NX>,
        path: &'a mut Path<NX>,
        x: SVector<f64, NX>,
        points: Spaced,
        samples: usize,
    ) -> Self {
        let h = points.stride as f64 * case.step_s;
        let (ahead_s, part_s) = (
            [0.5 * h, 0.5 * h, h, 0.0],
            [h / 6.0, h / 3.0, h / 3.0, h / 6.0],
        );
        let (at, next) = (x, x);
        let mut course = Course {
            case,
            near,
            path,
            x,
            at,
            next,
            points,
            sample: 0,
            stage: 0,
            end: samples,
            ahead_s,
            part_s,
        };
        course.arrive(x);
        course
    }

    /// Goes to the end.
    #[inline(always)]
    pub fn finish(&mut self) {
        while self.sample < self.end {
            self.advance();
        }
    }

    /// Goes to a stage's state. What is written of it is written while the processor has it at
    /// hand: reading it back at once, in another width, would hold up the chain.
    #[inline(always)]
    fn arrive(&mut self, at: SVector<f64, NX>) {
        self.at = at;
        if self.sample < self.end {
            for (slot, &state) in E::FOLLOWED.iter().enumerate() {
                self.path.times[self.stage][self.sample][slot] = at[state];
            }
        }
    }

    /// The state at the sample that the course has reached.
    pub fn state(&self) -> SVector<f64, NX> {
        self.x
    }
}

impl<const NX: usize, E: Equations<NX>> Meanwhile for Course<'_, NX, E> {
    #[inline(always)]
    fn advance(&mut self) {
        if self.sample >= self.end {
            return;
        }
        let (sample, stage) = (self.sample, self.stage);
        let point = POINT[stage];
        let c = self.near.coefficients::<E>(2 * sample + point, &self.at);
        let rates = E::rates(
            &self.case.known[self.points.at(2 * sample + point)],
            &self.at,
            &c,
        );
        for i in 0..NX {
            self.next[i] = rates.rates[i].mul_add(self.part_s[stage], self.next[i]);
        }
        let path = &mut *self.path;
        for &(i, j) in E::RATES_BY_COEFFICIENT {
            path.b[stage][i][j][sample] = rates.by_coefficient[(i, j)];
        }
        let a = self.near.through::<E, NX>(
            2 * sample + point,
            rates.by_state,
            &rates.by_coefficient,
            E::RATES_BY_COEFFICIENT,
        );
        for &(i, j) in E::RATES_BY_STATE {
            path.a[stage][i][j][sample] = a[(i, j)];
        }
        if stage + 1 < STAGES {
            let mut at = self.x;
            for i in 0..NX {
                at[i] = rates.rates[i].mul_add(self.ahead_s[stage], at[i]);
            }
            self.stage = stage + 1;
            self.arrive(at);
        } else {
            path.states[sample] = self.x;
            self.x = self.next;
            (self.stage, self.sample) = (0, sample + 1);
            self.arrive(self.next);
        }
    }
}
