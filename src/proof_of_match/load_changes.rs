//! Changes of the aerodynamic force and moment to first order.
#![expect(
    clippy::inline_always,
    reason = "compiled into free runs for the processor at hand"
)]

use std::array::from_fn;

use pulp::Simd;

use super::aerodynamics::{Aerodynamics, COEFFICIENTS, FORCE, MOMENT};
use super::derivative_table::CoefficientLanes;
use super::factor::{AeroInputs, FLOW};
use crate::numerics::vectors::lanes::{Lanes, combination, each};
use crate::rigid_body::{AirChange, BodySlopes, Instant, StateChange};
use crate::units::DEG;

/// Changes of force and moment.
#[derive(Clone, Copy)]
pub struct LoadsChange<S: Simd> {
    pub force: [Lanes<S>; 3],
    pub moment: [Lanes<S>; 3],
}

/// Slopes of the aerodynamic loads at an instant.
#[derive(Clone, Copy, Debug)]
pub struct LoadSlopes {
    /// Slopes of the coefficients along each quantity of the flow: angles in rad, relative changes of dynamic
    /// pressure.
    coefficients: [CoefficientLanes; FLOW],
    /// Aerodynamic force and moment, which are proportional to dynamic pressure.
    force: [f64; 3],
    moment: [f64; 3],
    /// Slope of each component of force and moment along its coefficient.
    force_by_coefficient: [f64; 3],
    moment_by_coefficient: [f64; 3],
    alpha_rate: Option<AlphaRateTerm>,
}

/// Slopes of α̇ where the loads depend on α̇, so that its equation is implicit.
#[derive(Clone, Copy, Debug)]
struct AlphaRateTerm {
    by_velocity: [f64; 3],
    /// Along the accelerations at a constant α̇.
    by_acceleration: [f64; 3],
    /// Slopes of force and moment along α̇.
    force: [f64; 3],
    moment: [f64; 3],
}

impl LoadSlopes {
    /// Slopes of the loads from the coefficients and their slopes along the flow.
    #[must_use]
    pub fn new(
        aerodynamics: &Aerodynamics,
        instant: &Instant,
        coefficients: &[f64; COEFFICIENTS],
        mut by_flow: [CoefficientLanes; FLOW],
        has_alpha_rate: bool,
    ) -> LoadSlopes {
        let qbar = instant.air.qbar_psf;
        let area = qbar * aerodynamics.area();
        let (force, moment) = aerodynamics.loads(coefficients, qbar);
        for (quantity, unit) in [
            (AeroInputs::ALPHA, DEG),
            (AeroInputs::BETA, DEG),
            (AeroInputs::QBAR, qbar),
        ] {
            for slope in &mut by_flow[quantity] {
                *slope *= unit;
            }
        }
        let mut slopes = LoadSlopes {
            coefficients: by_flow,
            force: force.into(),
            moment: moment.into(),
            force_by_coefficient: FORCE.map(|(_, sign)| sign * area),
            moment_by_coefficient: aerodynamics.lengths().map(|length| length * area),
            alpha_rate: None,
        };
        slopes.alpha_rate = has_alpha_rate.then(|| slopes.alpha_rate_term(instant));
        slopes
    }

    /// Slopes of α̇ = (u ẇ − w u̇)/(u² + w²), with u and w the velocities along body x and z. u̇
    /// and ẇ are linear in α̇.
    fn alpha_rate_term(&self, instant: &Instant) -> AlphaRateTerm {
        let along = self.coefficients[AeroInputs::ALPHA_RATE];
        let force: [f64; 3] = from_fn(|i| self.force_by_coefficient[i] * along[FORCE[i].0]);
        let moment = from_fn(|i| self.moment_by_coefficient[i] * along[MOMENT[i]]);
        let [u, _, w]: [f64; 3] = instant.state.velocity.into();
        let [u_rate, _, w_rate]: [f64; 3] = instant.rate.velocity.into();
        let per_square = 1.0 / (u * u + w * w);
        let alpha_rate = (u * w_rate - w * u_rate) * per_square;
        // α̇ = α̇₀ + gain · α̇, so every slope of α̇₀ is divided by 1 − gain.
        let gain = (u * force[2] - w * force[0]) * per_square / instant.loading.mass_slug;
        let factor = per_square / (1.0 - gain);
        AlphaRateTerm {
            by_velocity: [
                (w_rate - 2.0 * alpha_rate * u) * factor,
                0.0,
                (-u_rate - 2.0 * alpha_rate * w) * factor,
            ],
            by_acceleration: [-w * factor, 0.0, u * factor],
            force,
            moment,
        }
    }

    /// Change of the loads with the state, and with direct changes of the coefficients.
    #[inline(always)]
    pub fn change<S: Simd>(
        &self,
        body: &BodySlopes,
        state: &StateChange<S>,
        air: &AirChange<S>,
        direct: &[Lanes<S>; COEFFICIENTS],
    ) -> LoadsChange<S> {
        let [p, q, r] = state.rates();
        let flow = [air.alpha, air.beta, air.velocity, air.mach, p, q, r];
        let coefficients: [Lanes<S>; COEFFICIENTS] = each(
            #[inline(always)]
            |i| {
                let [alpha, beta, velocity, mach, p, q, r, _, qbar] = &self.coefficients;
                let along = [alpha[i], beta[i], velocity[i], mach[i], p[i], q[i], r[i]];
                let along_flow = combination(&along, &flow);
                direct[i] + along_flow.plus(qbar[i], air.relative_qbar)
            },
        );
        let mut loads = LoadsChange {
            force: each(
                #[inline(always)]
                |i| {
                    let by_coefficient = coefficients[FORCE[i].0] * self.force_by_coefficient[i];
                    by_coefficient.plus(self.force[i], air.relative_qbar)
                },
            ),
            moment: each(
                #[inline(always)]
                |i| {
                    let by_coefficient = coefficients[MOMENT[i]] * self.moment_by_coefficient[i];
                    by_coefficient.plus(self.moment[i], air.relative_qbar)
                },
            ),
        };
        if let Some(term) = &self.alpha_rate {
            let rate = body.change(state, &loads.force, &loads.moment);
            let alpha_rate = combination(&term.by_velocity, &state.velocity())
                + combination(&term.by_acceleration, &rate.velocity());
            for i in 0..3 {
                loads.force[i] = loads.force[i].plus(term.force[i], alpha_rate);
                loads.moment[i] = loads.moment[i].plus(term.moment[i], alpha_rate);
            }
        }
        loads
    }
}
