//! First-order changes of the sensors' readings, by their exact slopes at an instant.
#![expect(
    clippy::inline_always,
    reason = "compiled into free runs for the processor at hand"
)]

use nalgebra::Vector3;
use pulp::Simd;

use super::first_order_changes::{AirChange, DownDirection, StateChange};
use super::readings::Instant;
use crate::aircraft::{Aircraft, Position, Reading, VaneFlow};
use crate::numerics::vectors::lanes::{Lanes, combination, each};
use crate::units::{DEG, G0_FT_S2};

/// Changes of the readings, as in [`super::Readings`] without the heading.
#[derive(Clone, Copy)]
pub(crate) struct ReadingsChange<S: Simd> {
    pub alpha_vane_deg: Lanes<S>,
    pub beta_vane_deg: Lanes<S>,
    pub rates_deg_s: [Lanes<S>; 3],
    /// Bank and pitch attitude.
    pub euler_deg: [Lanes<S>; 2],
    pub an_g: Lanes<S>,
    pub ax_g: Lanes<S>,
    pub ay_g: Lanes<S>,
}

/// Slopes of the readings at an instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReadingSlopes {
    alpha_vane: VaneSlopes,
    beta_vane: VaneSlopes,
    down: DownDirection,
    an: AccelerometerSlopes,
    ax: AccelerometerSlopes,
    ay: AccelerometerSlopes,
}

/// Slopes of a vane's reading, deg, along α, β, airspeed, and the rates.
#[derive(Clone, Copy, Debug)]
struct VaneSlopes {
    by_flow: [f64; 3],
    by_rates: [f64; 3],
}

/// Slopes of an accelerometer's reading, g.
#[derive(Clone, Copy, Debug)]
struct AccelerometerSlopes {
    axis: usize,
    by_force: f64,
    by_rates: [f64; 3],
    by_angular_acceleration: [f64; 3],
}

impl ReadingSlopes {
    /// Slopes of the readings of an aircraft's sensors.
    #[must_use]
    pub fn new(instant: &Instant, aircraft: &Aircraft) -> ReadingSlopes {
        let sensors = &aircraft.sensors;
        let cg = instant.loading.cg();
        let flow = instant.flow();
        let accelerometer = |position: Position, axis: usize, sign: f64| {
            AccelerometerSlopes::new(instant, position, (axis, sign))
        };
        ReadingSlopes {
            alpha_vane: VaneSlopes::new(&sensors.alpha_reading(&flow, cg), &flow),
            beta_vane: VaneSlopes::new(&sensors.beta_reading(&flow, cg), &flow),
            down: DownDirection::new(&instant.state),
            an: accelerometer(sensors.an, 2, -1.0),
            ax: accelerometer(sensors.ax, 0, 1.0),
            ay: accelerometer(sensors.ay, 1, 1.0),
        }
    }

    /// Changes of the readings with the state, its rate, the air data, and the force.
    #[inline(always)]
    pub fn change<S: Simd>(
        &self,
        state: &StateChange<S>,
        rate: &StateChange<S>,
        air: &AirChange<S>,
        force: &[Lanes<S>; 3],
    ) -> ReadingsChange<S> {
        let rates = state.rates();
        let down = self.down.change(state);
        let [_, y, z] = self.down.direction;
        // sin θ = −x and tan φ = y/z; x² + y² + z² = 1.
        let per_square = DEG / (y * y + z * z);
        let bank = combination(&[-y * per_square, z * per_square], &[down[2], down[1]]);
        let pitch = down[0] * (-DEG / (y * y + z * z).sqrt());
        ReadingsChange {
            alpha_vane_deg: self.alpha_vane.change(air, &rates),
            beta_vane_deg: self.beta_vane.change(air, &rates),
            rates_deg_s: each(
                #[inline(always)]
                |i| rates[i] * DEG,
            ),
            euler_deg: [bank, pitch],
            an_g: self.an.change(&rates, rate, force),
            ax_g: self.ax.change(&rates, rate, force),
            ay_g: self.ay.change(&rates, rate, force),
        }
    }
}

impl VaneSlopes {
    /// Slopes of a vane. A vane's angle does not change if speed and rates grow by the same factor.
    /// Its slope along the speed therefore follows from the slopes along the rates.
    fn new(reading: &Reading, flow: &VaneFlow) -> VaneSlopes {
        let by_rates = reading.by_rates;
        let along: f64 = by_rates
            .iter()
            .zip(flow.rates)
            .map(|(by, rate)| by * rate)
            .sum();
        VaneSlopes {
            by_flow: [reading.by_alpha, reading.by_beta, -along / flow.velocity].map(|by| DEG * by),
            by_rates: by_rates.map(|by| DEG * by),
        }
    }

    #[inline(always)]
    fn change<S: Simd>(&self, air: &AirChange<S>, rates: &[Lanes<S>; 3]) -> Lanes<S> {
        combination(&self.by_flow, &[air.alpha, air.beta, air.velocity])
            + combination(&self.by_rates, rates)
    }
}

impl AccelerometerSlopes {
    /// Slopes of f + ω̇ × r + ω × (ω × r) along an axis e: along the force e/m, along ω̇ r × e, and along ω
    /// (ω·r) e + (ω·e) r − 2 (r·e) ω.
    fn new(instant: &Instant, position: Position, (axis, sign): (usize, f64)) -> Self {
        let arm = Vector3::from(position.arm(instant.loading.cg()));
        let rates = instant.state.rates;
        let mut own = Vector3::zeros();
        own[axis] = 1.0;
        let by_rates = own * rates.dot(&arm) + arm * rates[axis] - rates * (2.0 * arm[axis]);
        let per_g = sign / G0_FT_S2;
        AccelerometerSlopes {
            axis,
            by_force: per_g / instant.loading.mass_slug,
            by_rates: (by_rates * per_g).into(),
            by_angular_acceleration: (arm.cross(&own) * per_g).into(),
        }
    }

    #[inline(always)]
    fn change<S: Simd>(
        &self,
        rates: &[Lanes<S>; 3],
        rate: &StateChange<S>,
        force: &[Lanes<S>; 3],
    ) -> Lanes<S> {
        let rotation = combination(&self.by_rates, rates)
            + combination(&self.by_angular_acceleration, &rate.rates());
        rotation.plus(self.by_force, force[self.axis])
    }
}
