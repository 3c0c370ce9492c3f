//! The rigid body: m (v̇ + ω × v) = F + m g and I ω̇ = M − ω × (I ω + h).
//!
//! v are the velocities u v w and ω the rates p q r in body axes. h is the engines' angular momentum
//! along +x. The attitude is a quaternion. The earth is flat and does not rotate; gravity is
//! [`crate::earth::gravity_ft_s2`].
//!
//! The equations are the laws of Newton and Euler in vector form, independent of the estimator's
//! equations in α, β and V. So each checks the other.

use nalgebra::{Matrix3, Quaternion, SVector, UnitQuaternion, Vector3};

use super::loading::Mass;
use crate::numerics::runge_kutta::{self, POINT};

/// State of the body: velocity u v w over the ground, ft/s; rates p q r, rad/s; attitude, body to
/// earth (north, east, down); position north, east and up, ft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyState {
    pub velocity: Vector3<f64>,
    pub rates: Vector3<f64>,
    pub attitude: Quaternion<f64>,
    pub position: Vector3<f64>,
}

/// Time derivative of the state, in the same layout.
pub type StateRate = BodyState;

/// Euler angles, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Euler {
    pub phi: f64,
    pub theta: f64,
    pub psi: f64,
}

impl Euler {
    /// Attitude quaternion: yaw, then pitch, then roll.
    #[must_use]
    pub fn attitude(self) -> Quaternion<f64> {
        *UnitQuaternion::from_euler_angles(self.phi, self.theta, self.psi)
    }
}

impl BodyState {
    /// Adds `factor` times a rate.
    #[must_use]
    pub fn plus(&self, rate: &StateRate, factor: f64) -> BodyState {
        BodyState {
            velocity: self.velocity + rate.velocity * factor,
            rates: self.rates + rate.rates * factor,
            attitude: self.attitude + rate.attitude * factor,
            position: self.position + rate.position * factor,
        }
    }

    /// Restores the unit length of the attitude quaternion.
    #[must_use]
    pub fn normalised(self) -> BodyState {
        BodyState {
            attitude: self.attitude.normalize(),
            ..self
        }
    }

    #[must_use]
    pub fn is_finite(&self) -> bool {
        let values: SVector<f64, 6> =
            SVector::from_iterator(self.velocity.iter().chain(&self.rates).copied());
        values.iter().all(|v| v.is_finite()) && self.attitude.norm().is_finite()
    }

    /// Rotation matrix from body to earth axes.
    #[must_use]
    fn earth_from_body(&self) -> Matrix3<f64> {
        UnitQuaternion::from_quaternion(self.attitude)
            .to_rotation_matrix()
            .into_inner()
    }

    /// Euler angles; ψ between −π and π.
    #[must_use]
    pub fn euler(&self) -> Euler {
        let m = self.earth_from_body();
        Euler {
            phi: m[(2, 1)].atan2(m[(2, 2)]),
            theta: (-m[(2, 0)]).clamp(-1.0, 1.0).asin(),
            psi: m[(1, 0)].atan2(m[(0, 0)]),
        }
    }

    /// Rates of φ and θ, rad/s, from the rate of the quaternion.
    #[must_use]
    pub fn euler_rates(&self, rate: &StateRate) -> (f64, f64) {
        let (a, d) = (self.attitude, rate.attitude);
        let (up, up_dot) = (
            2.0 * (a.w * a.j - a.k * a.i),
            2.0 * (d.w * a.j + a.w * d.j - d.k * a.i - a.k * d.i),
        );
        let (y, x) = (
            2.0 * (a.w * a.i + a.j * a.k),
            1.0 - 2.0 * (a.i * a.i + a.j * a.j),
        );
        let y_dot = 2.0 * (d.w * a.i + a.w * d.i + d.j * a.k + a.j * d.k);
        let x_dot = -4.0 * (a.i * d.i + a.j * d.j);
        (
            (x * y_dot - y * x_dot) / (x * x + y * y),
            up_dot / (1.0 - up * up).sqrt(),
        )
    }
}

/// Loads on the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loads {
    /// Force without gravity in body axes, lbf.
    pub force: Vector3<f64>,
    /// Moment about the c.g. in body axes, ft lbf.
    pub moment: Vector3<f64>,
    /// Angular momentum of the engines along +x, slug ft²/s.
    pub engine_momentum: f64,
    pub gravity_ft_s2: f64,
}

/// Time derivative of the state under loads.
#[must_use]
pub fn state_rate(state: &BodyState, mass: &Mass, loads: &Loads) -> StateRate {
    let (v, w) = (state.velocity, state.rates);
    let to_earth = state.earth_from_body();
    let gravity = to_earth.transpose() * Vector3::new(0.0, 0.0, loads.gravity_ft_s2);
    let momentum = mass.inertia * w + Vector3::new(loads.engine_momentum, 0.0, 0.0);
    let turning = loads.moment - w.cross(&momentum);
    let over_ground = to_earth * v;
    BodyState {
        velocity: loads.force / mass.mass_slug + gravity - w.cross(&v),
        rates: mass.inverse_inertia * turning,
        attitude: state.attitude * Quaternion::from_imag(w) * 0.5,
        position: Vector3::new(over_ground.x, over_ground.y, -over_ground.z),
    }
}

/// One classical fourth-order Runge-Kutta step; `rate_at` gives the rate of a state at 0, 1/2 and 1
/// of the step.
pub fn runge_kutta_step(
    state: &BodyState,
    step_s: f64,
    rate_at: impl Fn(&BodyState, f64) -> StateRate,
) -> BodyState {
    let rate = |stage: usize, at: &BodyState| rate_at(at, 0.5 * POINT[stage] as f64);
    runge_kutta::step(state, step_s, rate, BodyState::plus).normalised()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rigid_body::Loading;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    const LOADING: Loading = Loading {
        mass_slug: 1025.0,
        x_cg_ft: 38.2,
        y_cg_ft: 0.0,
        z_cg_ft: 8.7,
        ix_slug_ft2: 22_300.0,
        iy_slug_ft2: 172_900.0,
        iz_slug_ft2: 187_600.0,
        ixz_slug_ft2: -2073.0,
    };
    const FREE: Loads = Loads {
        force: Vector3::new(0.0, 0.0, 0.0),
        moment: Vector3::new(0.0, 0.0, 0.0),
        engine_momentum: 0.0,
        gravity_ft_s2: 0.0,
    };

    fn tumbling() -> BodyState {
        BodyState {
            velocity: Vector3::new(250.0, 10.0, 120.0),
            rates: Vector3::new(1.2, 0.4, -0.3),
            attitude: Euler {
                phi: 0.3,
                theta: -0.2,
                psi: 1.0,
            }
            .attitude(),
            position: Vector3::new(0.0, 0.0, 25_000.0),
        }
    }

    fn after(state: BodyState, time_s: u32, loads: &Loads) -> BodyState {
        (0..time_s * 400).fold(state, |s, _| {
            runge_kutta_step(&s, 1.0 / 400.0, |at, _| {
                state_rate(at, &LOADING.mass(), loads)
            })
        })
    }

    #[test]
    fn free_of_moments_energy_and_the_angular_momentum_in_space_stay() {
        let energy = |s: &BodyState| 0.5 * s.rates.dot(&(LOADING.inertia() * s.rates));
        let momentum = |s: &BodyState| s.earth_from_body() * (LOADING.inertia() * s.rates);
        let (start, end) = (tumbling(), after(tumbling(), 20, &FREE));
        assert!((start.rates - end.rates).norm() > 0.1, "it does tumble");
        assert_relative_eq!(energy(&start), energy(&end), max_relative = 1e-9);
        assert!((momentum(&start) - momentum(&end)).norm() < 1e-8 * momentum(&start).norm());
        // The path over the ground is straight although the body axes turn.
        assert!(
            (start.earth_from_body() * start.velocity - end.earth_from_body() * end.velocity)
                .norm()
                < 1e-6
        );
        assert_abs_diff_eq!(end.attitude.norm(), 1.0, epsilon = 1e-14);
    }

    #[test]
    fn falling_trades_height_for_speed() {
        let loads = Loads {
            gravity_ft_s2: 32.1,
            ..FREE
        };
        let energy = |s: &BodyState| 0.5 * s.velocity.norm_squared() + 32.1 * s.position.z;
        let (start, end) = (tumbling(), after(tumbling(), 5, &loads));
        assert!(end.position.z < start.position.z);
        assert_relative_eq!(energy(&start), energy(&end), max_relative = 1e-10);
    }

    #[test]
    fn engines_turning_with_their_momentum_forward_push_the_nose_down_in_a_right_turn() {
        let loads = Loads {
            engine_momentum: 7500.0,
            ..FREE
        };
        let state = BodyState {
            rates: Vector3::new(0.0, 0.0, 0.2),
            ..tumbling()
        };
        let with = state_rate(&state, &LOADING.mass(), &loads).rates;
        let without = state_rate(&state, &LOADING.mass(), &FREE).rates;
        assert_relative_eq!(
            (with - without).y,
            -0.2 * 7500.0 / LOADING.iy_slug_ft2,
            max_relative = 1e-9
        );
        // A pitch-up yaws the nose right.
        let state = BodyState {
            rates: Vector3::new(0.0, 0.2, 0.0),
            ..tumbling()
        };
        assert!(state_rate(&state, &LOADING.mass(), &loads).rates.z > 0.0);
    }

    #[test]
    fn angles_and_their_rates_are_those_of_the_attitude() {
        let (state, h) = (tumbling(), 1e-6);
        let s = state_rate(&state, &LOADING.mass(), &FREE);
        let (phi_dot, theta_dot) = state.euler_rates(&s);
        let (up, down) = (state.plus(&s, h).euler(), state.plus(&s, -h).euler());
        assert_abs_diff_eq!(phi_dot, (up.phi - down.phi) / (2.0 * h), epsilon = 1e-8);
        assert_abs_diff_eq!(
            theta_dot,
            (up.theta - down.theta) / (2.0 * h),
            epsilon = 1e-8
        );
        let angles = state.euler();
        for (angle, expected) in [(angles.phi, 0.3), (angles.theta, -0.2), (angles.psi, 1.0)] {
            assert_abs_diff_eq!(angle, expected, epsilon = 1e-12);
        }
    }
}
