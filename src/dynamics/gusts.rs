//! Equations of an axis in moving air: its states, and the body rates relative to the air.
//!
//! The first state is the flow angle with gusts included. The vane measures it, and the
//! aerodynamics depend on it. With a rotary gust g the aerodynamics depend on the rate q + g
//! relative to the air; the gyro and the kinematics have q. In the state vector the rates relative
//! to the air follow the states of the axis in still air. A gust is constant during a step of the
//! integration, so both rates of a pair have the same acceleration. Between steps gusts decay and
//! grow ([`InGusts::decayed`]).
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

use nalgebra::{SMatrix, SVector};

use super::equations::{COEFFICIENTS, Equations, OUTPUTS, Outputs, Rates};
use super::lateral::Lateral;
use super::longitudinal::Longitudinal;
use super::motion::Motion;
use crate::aero::{Axis, Regressor};
use crate::aircraft::Aircraft;

/// Equations of an axis whose last states are the body rates relative to the air.
pub trait InGusts<const NX: usize>: Equations<NX> {
    /// Index of the state that is the flow angle, gusts included.
    const ANGLE: usize = 0;
    /// Index of the output that measures the flow angle.
    const VANE: usize = 0;
    /// Pairs of states (rate of the gyro, rate relative to the air), one for each rotary gust.
    const AIR_RELATIVE_RATES: &'static [(usize, usize)];

    /// Number of states without the rates relative to the air.
    #[must_use]
    fn states_in_still_air() -> usize {
        NX - Self::AIR_RELATIVE_RATES.len()
    }

    /// State after the rotary gusts have decayed to a share of themselves.
    #[inline(always)]
    #[must_use]
    fn decayed(mut x: SVector<f64, NX>, share: f64) -> SVector<f64, NX> {
        for &(rate, relative) in Self::AIR_RELATIVE_RATES {
            x[relative] = x[rate] + share * (x[relative] - x[rate]);
        }
        x
    }
}

/// Longitudinal axis with the pitch rate relative to the air as a further state.
#[derive(Clone, Copy, Debug)]
pub struct LongitudinalInGusts;

/// Lateral-directional axis with the roll and yaw rates relative to the air as further states.
#[derive(Clone, Copy, Debug)]
pub struct LateralInGusts;

impl InGusts<4> for LongitudinalInGusts {
    const AIR_RELATIVE_RATES: &'static [(usize, usize)] = &[(1, 3)];
}

impl InGusts<6> for LateralInGusts {
    const AIR_RELATIVE_RATES: &'static [(usize, usize)] = &[(1, 4), (2, 5)];
}

/// States without the rates relative to the air.
#[inline(always)]
fn without_relative_rates<const N: usize, const M: usize>(x: &SVector<f64, M>) -> SVector<f64, N> {
    SVector::from_fn(|i, _| x[i])
}

/// State with the rates relative to the air equal to the gyro's.
#[inline(always)]
fn with_relative_rates<const N: usize, const M: usize>(
    x: &SVector<f64, N>,
    relative: &[(usize, usize)],
) -> SVector<f64, M> {
    let mut wide = SVector::zeros();
    for i in 0..N {
        wide[i] = x[i];
    }
    for &(rate, relative) in relative {
        wide[relative] = x[rate];
    }
    wide
}

/// Rates of all states: a rate relative to the air accelerates as the gyro's rate does.
#[inline(always)]
fn rates_in_gusts<const N: usize, const M: usize>(
    still_air: &Rates<N>,
    relative: &[(usize, usize)],
) -> Rates<M> {
    let (mut by_state, mut by_coefficient) = (SMatrix::zeros(), SMatrix::zeros());
    let mut copy_row = |from: usize, to: usize| {
        for j in 0..N {
            by_state[(to, j)] = still_air.by_state[(from, j)];
        }
        for k in 0..COEFFICIENTS {
            by_coefficient[(to, k)] = still_air.by_coefficient[(from, k)];
        }
    };
    for i in 0..N {
        copy_row(i, i);
    }
    for &(rate, relative) in relative {
        copy_row(rate, relative);
    }
    Rates {
        rates: with_relative_rates(&still_air.rates, relative),
        by_state,
        by_coefficient,
    }
}

/// Outputs, which depend on no rate relative to the air.
#[inline(always)]
fn outputs_in_gusts<const N: usize, const M: usize>(still_air: &Outputs<N>) -> Outputs<M> {
    let mut by_state = SMatrix::<f64, OUTPUTS, M>::zeros();
    for o in 0..OUTPUTS {
        for j in 0..N {
            by_state[(o, j)] = still_air.by_state[(o, j)];
        }
    }
    Outputs {
        outputs: still_air.outputs,
        by_state,
        by_coefficient: still_air.by_coefficient,
    }
}

/// Implements the equations of an axis in gusts by those of the axis.
macro_rules! in_gusts {
    (
        $name:ident: $axis:ident, $axis_states:literal, $states:literal, $names:expr,
        regressors $regressors:expr, rates by state $by_state:expr, by coefficient $by_coefficient:expr
    ) => {
        impl Equations<$states> for $name {
            type RateInputs = <$axis as Equations<$axis_states>>::RateInputs;
            type SensorInputs = <$axis as Equations<$axis_states>>::SensorInputs;

            const AXIS: Axis = <$axis as Equations<$axis_states>>::AXIS;
            const STATES: [&'static str; $states] = $names;
            const SIGNALS_NOT_READ: &'static [&'static str] =
                <$axis as Equations<$axis_states>>::SIGNALS_NOT_READ;
            const REGRESSOR_STATES: &'static [usize] = $regressors;
            const RATES_BY_STATE: &'static [(usize, usize)] = $by_state;
            const RATES_BY_COEFFICIENT: &'static [(usize, usize)] = $by_coefficient;
            const OUTPUTS_BY_STATE: &'static [(usize, usize)] = Self::OUTPUT_SLOPES;
            const OUTPUTS_BY_COEFFICIENT: &'static [(usize, usize)] =
                <$axis as Equations<$axis_states>>::OUTPUTS_BY_COEFFICIENT;

            #[inline(always)]
            fn rate_inputs(aircraft: &Aircraft, motion: &Motion) -> Self::RateInputs {
                $axis::rate_inputs(aircraft, motion)
            }

            #[inline(always)]
            fn sensor_inputs(aircraft: &Aircraft, motion: &Motion) -> Self::SensorInputs {
                $axis::sensor_inputs(aircraft, motion)
            }

            #[inline(always)]
            fn measured_state(motion: &Motion) -> SVector<f64, $states> {
                with_relative_rates(&$axis::measured_state(motion), Self::AIR_RELATIVE_RATES)
            }

            fn state_of(regressor: &Regressor) -> Option<usize> {
                $axis::state_of(regressor).map(relative_state::<$states, Self>)
            }

            fn state_regressor(
                aircraft: &Aircraft,
                velocity: f64,
                regressor: &Regressor,
            ) -> Option<(usize, f64)> {
                let (state, factor) = $axis::state_regressor(aircraft, velocity, regressor)?;
                Some((relative_state::<$states, Self>(state), factor))
            }

            #[inline(always)]
            fn implied_coefficients(
                aircraft: &Aircraft,
                motion: &Motion,
                inputs: &Self::RateInputs,
            ) -> [f64; COEFFICIENTS] {
                $axis::implied_coefficients(aircraft, motion, inputs)
            }

            #[inline(always)]
            fn rates(
                inputs: &Self::RateInputs,
                x: &SVector<f64, $states>,
                c: &[f64; COEFFICIENTS],
            ) -> Rates<$states> {
                rates_in_gusts(
                    &$axis::rates(inputs, &without_relative_rates(x), c),
                    Self::AIR_RELATIVE_RATES,
                )
            }

            #[inline(always)]
            fn outputs(
                inputs: &Self::RateInputs,
                sensors: &Self::SensorInputs,
                x: &SVector<f64, $states>,
                c: &[f64; COEFFICIENTS],
            ) -> Outputs<$states> {
                outputs_in_gusts(&$axis::outputs(
                    inputs,
                    sensors,
                    &without_relative_rates(x),
                    c,
                ))
            }
        }
    };
}

/// State that a regressor along a state of still air follows: the rate relative to the air in place
/// of the gyro's.
fn relative_state<const NX: usize, E: InGusts<NX>>(state: usize) -> usize {
    let relative = E::AIR_RELATIVE_RATES
        .iter()
        .find(|(rate, _)| *rate == state);
    relative.map_or(state, |(_, relative)| *relative)
}

impl LongitudinalInGusts {
    /// Entries of the axis in still air, and those of `a_n` and `a_x` through the pitching moment.
    const OUTPUT_SLOPES: &'static [(usize, usize)] = &[
        (0, 0),
        (0, 1),
        (1, 1),
        (2, 2),
        (3, 0),
        (3, 1),
        (3, 3),
        (4, 0),
        (4, 1),
        (4, 3),
    ];
}

impl LateralInGusts {
    /// Entries of the axis in still air, and those of `a_y` through the moments.
    const OUTPUT_SLOPES: &'static [(usize, usize)] = &[
        (0, 0),
        (0, 1),
        (0, 2),
        (1, 1),
        (2, 2),
        (3, 3),
        (4, 0),
        (4, 1),
        (4, 2),
        (4, 4),
        (4, 5),
    ];
}

in_gusts!(
    LongitudinalInGusts: Longitudinal, 3, 4, ["alpha", "q", "theta", "felt q"],
    regressors &[0, 3],
    rates by state &[
        (0, 0), (0, 1), (0, 2), (0, 3),
        (1, 0), (1, 1), (1, 3),
        (2, 1),
        (3, 0), (3, 1), (3, 3),
    ],
    by coefficient &[(0, 0), (0, 2), (1, 1), (3, 1)]
);

in_gusts!(
    LateralInGusts: Lateral, 4, 6, ["beta", "p", "r", "phi", "felt p", "felt r"],
    regressors &[0, 4, 5],
    rates by state &[
        (0, 0), (0, 1), (0, 2), (0, 3), (0, 4), (0, 5),
        (1, 0), (1, 1), (1, 2), (1, 4), (1, 5),
        (2, 0), (2, 1), (2, 2), (2, 4), (2, 5),
        (3, 1), (3, 2), (3, 3),
        (4, 0), (4, 1), (4, 2), (4, 4), (4, 5),
        (5, 0), (5, 1), (5, 2), (5, 4), (5, 5),
    ],
    by coefficient &[(0, 0), (1, 1), (1, 2), (2, 1), (2, 2), (4, 1), (4, 2), (5, 1), (5, 2)]
);
