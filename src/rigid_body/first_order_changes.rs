//! First-order changes of a body's air data and of the rate of its state, by the exact slopes of
//! the equations at an instant. Several changes are computed together in the lanes of vectors.
#![expect(
    clippy::inline_always,
    reason = "compiled into free runs for the processor at hand"
)]

use std::array::from_fn;

use nalgebra::Vector3;
use pulp::Simd;

use super::air_data::AirData;
use super::body::BodyState;
use super::loading::Mass;
use crate::earth::air_gradients;
use crate::numerics::vectors::lanes::{Lanes, combination, each};

/// Number of states whose changes change the motion: u v w, p q r, the attitude, and the height.
pub(crate) const CHANGING: usize = 11;

/// Vector of the body axes.
type Three<S> = [Lanes<S>; 3];

/// Change of a state or of its rate: velocity, rates, attitude quaternion i j k w, and height. The
/// position over the ground has no effect.
#[derive(Clone, Copy)]
pub(crate) struct StateChange<S: Simd>(pub [Lanes<S>; CHANGING]);

impl<S: Simd> StateChange<S> {
    /// Adds `factor` times a rate.
    #[inline(always)]
    pub fn plus(&self, rate: &StateChange<S>, factor: f64) -> StateChange<S> {
        StateChange(each(
            #[inline(always)]
            |i| self.0[i].plus(factor, rate.0[i]),
        ))
    }

    #[inline(always)]
    pub fn velocity(&self) -> Three<S> {
        each(
            #[inline(always)]
            |i| self.0[i],
        )
    }

    #[inline(always)]
    pub fn rates(&self) -> Three<S> {
        each(
            #[inline(always)]
            |i| self.0[3 + i],
        )
    }

    #[inline(always)]
    pub fn attitude(&self) -> [Lanes<S>; 4] {
        each(
            #[inline(always)]
            |i| self.0[6 + i],
        )
    }

    #[inline(always)]
    pub fn altitude(&self) -> Lanes<S> {
        self.0[10]
    }

    /// Change of the state after the attitude is normalised from `attitude` to unit length.
    #[inline(always)]
    pub fn normalised(mut self, attitude: &[f64; 4]) -> StateChange<S> {
        let per_length = 1.0 / attitude.iter().map(|a| a * a).sum::<f64>().sqrt();
        let unit = attitude.map(|a| a * per_length);
        let along = combination(&unit, &self.attitude());
        for (own, unit) in self.0[6..].iter_mut().zip(unit) {
            *own = own.plus(-unit, along) * per_length;
        }
        self
    }
}

/// Attitude quaternion of a state: i j k w.
pub(super) fn attitude(state: &BodyState) -> [f64; 4] {
    state.attitude.coords.into()
}

/// Change of the air data: angles in rad, dynamic pressure over itself.
#[derive(Clone, Copy)]
pub(crate) struct AirChange<S: Simd> {
    pub alpha: Lanes<S>,
    pub beta: Lanes<S>,
    pub velocity: Lanes<S>,
    pub mach: Lanes<S>,
    pub relative_qbar: Lanes<S>,
}

/// Slopes of the air data along the velocity relative to still air and along the height.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AirSlopes {
    alpha: [f64; 3],
    beta: [f64; 3],
    speed: [f64; 3],
    mach_by_speed: f64,
    mach_by_height: f64,
    qbar_by_speed: f64,
    qbar_by_height: f64,
}

impl AirSlopes {
    #[must_use]
    pub fn new(state: &BodyState, air: &AirData) -> AirSlopes {
        let [u, v, w]: [f64; 3] = state.velocity.into();
        let (speed, gradients) = (air.velocity_ft_s, air_gradients(state.position.z));
        let in_plane = u.hypot(w);
        let per_square = 1.0 / (in_plane * in_plane);
        // β = asin(v/V): dβ = (dv − v/V dV) / √(u² + w²).
        let aside = v / (speed * speed);
        AirSlopes {
            alpha: [-w * per_square, 0.0, u * per_square],
            beta: [
                -aside * u / in_plane,
                (1.0 - aside * v) / in_plane,
                -aside * w / in_plane,
            ],
            speed: [u / speed, v / speed, w / speed],
            mach_by_speed: air.mach / speed,
            mach_by_height: -air.mach * gradients.sound,
            qbar_by_speed: 2.0 / speed,
            qbar_by_height: gradients.density,
        }
    }

    #[inline(always)]
    pub fn change<S: Simd>(&self, state: &StateChange<S>) -> AirChange<S> {
        let velocity = state.velocity();
        let speed = combination(&self.speed, &velocity);
        let both = [speed, state.altitude()];
        AirChange {
            alpha: combination(&self.alpha, &velocity),
            beta: combination(&self.beta, &velocity),
            velocity: speed,
            mach: combination(&[self.mach_by_speed, self.mach_by_height], &both),
            relative_qbar: combination(&[self.qbar_by_speed, self.qbar_by_height], &both),
        }
    }
}

/// Slopes of the rate of a body's state, as [`super::body::state_rate`] computes it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodySlopes {
    velocity: [f64; 3],
    rates: [f64; 3],
    attitude: [f64; 4],
    gravity: DownDirection,
    gravity_ft_s2: f64,
    per_mass: f64,
    /// Rows of the inertia matrix and of its inverse.
    inertia: [[f64; 3]; 3],
    inverse_inertia: [[f64; 3]; 3],
    /// Angular momentum of body and engines.
    momentum: [f64; 3],
}

/// Direction down in body axes, with its slopes along the attitude quaternion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DownDirection {
    pub direction: [f64; 3],
    by_attitude: [[f64; 4]; 3],
}

impl DownDirection {
    /// Third row of the rotation matrix of the quaternion at unit length, whose entries are of second degree in it.
    #[must_use]
    pub fn new(state: &BodyState) -> DownDirection {
        let attitude = attitude(state);
        let per_length = 1.0 / state.attitude.norm();
        let [i, j, k, w] = attitude.map(|a| a * per_length);
        let direction = [
            2.0 * (i * k - w * j),
            2.0 * (j * k + w * i),
            w * w - i * i - j * j + k * k,
        ];
        let by_unit = [[k, -w, i, -j], [w, k, j, i], [-i, -j, k, w]];
        // Along the quaternion itself, where its length alone changes, the direction stays.
        let by_attitude = from_fn(|row| {
            let along = direction[row];
            let unit = [i, j, k, w];
            from_fn(|n| 2.0 * (by_unit[row][n] - along * unit[n]) * per_length)
        });
        DownDirection {
            direction,
            by_attitude,
        }
    }

    #[inline(always)]
    pub fn change<S: Simd>(&self, state: &StateChange<S>) -> Three<S> {
        let attitude = state.attitude();
        each(
            #[inline(always)]
            |i| combination(&self.by_attitude[i], &attitude),
        )
    }
}

impl BodySlopes {
    #[must_use]
    pub fn new(
        state: &BodyState,
        mass: &Mass,
        engine_momentum: f64,
        gravity_ft_s2: f64,
    ) -> BodySlopes {
        let momentum = mass.inertia * state.rates + Vector3::new(engine_momentum, 0.0, 0.0);
        BodySlopes {
            velocity: state.velocity.into(),
            rates: state.rates.into(),
            attitude: attitude(state),
            gravity: DownDirection::new(state),
            gravity_ft_s2,
            per_mass: 1.0 / mass.mass_slug,
            // Both matrices are symmetric.
            inertia: mass.inertia.into(),
            inverse_inertia: mass.inverse_inertia.into(),
            momentum: momentum.into(),
        }
    }

    /// Change of the state's rate with the state, and with force and moment.
    #[inline(always)]
    pub fn change<S: Simd>(
        &self,
        state: &StateChange<S>,
        force: &Three<S>,
        moment: &Three<S>,
    ) -> StateChange<S> {
        let (velocity, rates, attitude) = (state.velocity(), state.rates(), state.attitude());
        let down = self.gravity.change(state);
        let momentum: Three<S> = each(
            #[inline(always)]
            |i| combination(&self.inertia[i], &rates),
        );
        let turning: Three<S> = each(
            #[inline(always)]
            |i| {
                let gyroscopic = cross_change(&self.rates, &rates, &self.momentum, &momentum, i);
                moment[i] - gyroscopic
            },
        );
        let [i, j, k, w] = self.attitude;
        let [p, q, r] = self.rates;
        let climb =
            combination(&self.gravity.direction, &velocity) + combination(&self.velocity, &down);
        let accelerations: Three<S> = each(
            #[inline(always)]
            |i| {
                let turned = cross_change(&self.rates, &rates, &self.velocity, &velocity, i);
                (down[i] * self.gravity_ft_s2).plus(self.per_mass, force[i]) - turned
            },
        );
        let [du, dv, dw] = accelerations;
        let [dp, dq, dr] = each(
            #[inline(always)]
            |i| combination(&self.inverse_inertia[i], &turning),
        );
        StateChange([
            du,
            dv,
            dw,
            dp,
            dq,
            dr,
            half(&rates, &attitude, [w, -k, j], [0.0, r, -q, p]),
            half(&rates, &attitude, [k, w, -i], [-r, 0.0, p, q]),
            half(&rates, &attitude, [-j, i, w], [q, -p, 0.0, r]),
            half(&rates, &attitude, [-i, -j, -k], [-p, -q, -r, 0.0]),
            climb * -1.0,
        ])
    }
}

/// Half the sum of the changes of rates and attitude times their factors.
#[inline(always)]
fn half<S: Simd>(
    rates: &Three<S>,
    attitude: &[Lanes<S>; 4],
    by_rates: [f64; 3],
    by_attitude: [f64; 4],
) -> Lanes<S> {
    (combination(&by_rates, rates) + combination(&by_attitude, attitude)) * 0.5
}

/// Component `i` of the change of a cross product a × b, with the changes of both.
#[inline(always)]
fn cross_change<S: Simd>(
    a: &[f64; 3],
    da: &Three<S>,
    b: &[f64; 3],
    db: &Three<S>,
    i: usize,
) -> Lanes<S> {
    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
    combination(&[a[j], -a[k], b[k], -b[j]], &[db[k], db[j], da[j], da[k]])
}
