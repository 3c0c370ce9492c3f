//! Readings of the flow vanes (eqs. 2.9 and 3.8 and their exact forms), and their inversion to the
//! angles at the c.g.
//!
//! A vane is away from the c.g., so rotation adds ω × arm to the velocity at the vane. Upwash and
//! sidewash multiply its reading by a factor `k`. Exact: the angle of the local velocity.
//! Small-angle, as printed in the paper: α + (x q + y p)/V and β + (z p − x r)/V, with arms aft,
//! right and above. At tip booms the two differ by up to 0.45° at α 30° to 50°.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

use super::geometry::{Sensors, Vane, VaneModel};
use super::position::Position;
use crate::numerics::trig::{angle_of, sin_cos};

/// Flow at the c.g. and rotation: angles in rad, velocity in ft/s, body rates in rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VaneFlow {
    pub alpha: f64,
    pub beta: f64,
    pub velocity: f64,
    pub rates: [f64; 3],
}

/// Reading of a vane (rad) with its slopes along α, β and the body rates p, q, r.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    pub angle: f64,
    pub by_alpha: f64,
    pub by_beta: f64,
    pub by_rates: [f64; 3],
}

/// Velocity of the air past a point of the aircraft in body axes, and its slopes along α, β and the
/// rates.
struct LocalVelocity {
    velocity: [f64; 3],
    by_alpha: [f64; 3],
    by_beta: [f64; 3],
    by_rates: [[f64; 3]; 3],
    /// Sine and cosine of α and β.
    directions: [(f64, f64); 2],
}

/// Sine and cosine of an angle from a given direction, times the speed, with the angle's slopes.
struct AngleFromDirection {
    sine: f64,
    cosine: f64,
    by_alpha: f64,
    by_beta: f64,
    by_rates: [f64; 3],
}

impl LocalVelocity {
    /// Angle in the plane of symmetry from a direction given by sine and cosine.
    #[inline(always)]
    fn alpha_from(&self, direction: (f64, f64)) -> AngleFromDirection {
        let [u, _, w] = self.velocity;
        let per_square = 1.0 / (u * u + w * w);
        let slope = |d: [f64; 3]| (u * d[2] - w * d[0]) * per_square;
        self.turn((u, w), direction, slope)
    }

    /// Angle from the plane of symmetry, from a direction given by sine and cosine.
    #[inline(always)]
    fn beta_from(&self, direction: (f64, f64)) -> AngleFromDirection {
        let [u, v, w] = self.velocity;
        let across = (u * u + w * w).sqrt();
        let per_square = 1.0 / (across * across + v * v);
        let along = v / across;
        let slope = |d: [f64; 3]| (across * d[1] - along * (u * d[0] + w * d[2])) * per_square;
        self.turn((across, v), direction, slope)
    }

    /// Angle of a vector in a plane from a direction, with the slope of its angle along a change of velocity.
    #[inline(always)]
    fn turn(
        &self,
        (forward, aside): (f64, f64),
        (s, c): (f64, f64),
        slope: impl Fn([f64; 3]) -> f64,
    ) -> AngleFromDirection {
        AngleFromDirection {
            sine: aside * c - forward * s,
            cosine: forward * c + aside * s,
            by_alpha: slope(self.by_alpha),
            by_beta: slope(self.by_beta),
            by_rates: self.by_rates.map(slope),
        }
    }
}

impl AngleFromDirection {
    /// Reading of a vane, where the angle is from the direction `from`.
    #[inline(always)]
    fn reading(&self, from: f64) -> Reading {
        Reading {
            angle: from + angle_of(self.sine, self.cosine),
            by_alpha: self.by_alpha,
            by_beta: self.by_beta,
            by_rates: self.by_rates,
        }
    }

    /// Tangent of the angle to the direction.
    #[inline(always)]
    fn tangent_left(&self) -> f64 {
        -self.sine / self.cosine
    }
}

impl VaneFlow {
    #[inline(always)]
    fn at(&self, arm: [f64; 3]) -> LocalVelocity {
        let (directions, v) = (sin_cos([self.alpha, self.beta]), self.velocity);
        let [(sa, ca), (sb, cb)] = directions;
        let ([p, q, r], [x, y, z]) = (self.rates, arm);
        LocalVelocity {
            velocity: [
                v * ca * cb + q * z - r * y,
                v * sb + r * x - p * z,
                v * sa * cb + p * y - q * x,
            ],
            by_alpha: [-v * sa * cb, 0.0, v * ca * cb],
            by_beta: [-v * ca * sb, v * cb, -v * sa * sb],
            by_rates: [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]],
            directions,
        }
    }
}

/// Error of an angle, rad, below which one more Newton step leaves rounding errors only.
const CLOSE: f64 = 1e-7;

/// Largest number of steps of Newton's iteration; three are usual.
const MOST_STEPS: usize = 8;

impl Vane {
    /// Reading of an α vane, with the c.g. at `cg`.
    #[inline(always)]
    #[must_use]
    pub fn alpha_reading(self, model: VaneModel, flow: &VaneFlow, cg: Position) -> Reading {
        let arm = self.position().arm(cg);
        let exact = match model {
            VaneModel::Exact => {
                let local = flow.at(arm);
                local.alpha_from(local.directions[0]).reading(flow.alpha)
            }
            VaneModel::SmallAngle => {
                return self.alpha_small(
                    flow.alpha,
                    self.alpha_by_rates(flow.velocity, cg),
                    flow.rates,
                );
            }
        };
        scaled(exact, self)
    }

    /// Slopes of the small angle at an α vane along the rates, s.
    #[inline(always)]
    #[must_use]
    pub fn alpha_by_rates(self, velocity: f64, cg: Position) -> [f64; 3] {
        let (arm, per_speed) = (self.position().arm(cg), 1.0 / velocity);
        [arm[1] * per_speed, -arm[0] * per_speed, 0.0]
    }

    /// Slopes of the small angle at a β vane along the rates, s.
    #[inline(always)]
    #[must_use]
    pub fn beta_by_rates(self, velocity: f64, cg: Position) -> [f64; 3] {
        let (arm, per_speed) = (self.position().arm(cg), 1.0 / velocity);
        [-arm[2] * per_speed, 0.0, arm[0] * per_speed]
    }

    /// Small-angle reading of an α vane.
    #[inline(always)]
    #[must_use]
    pub fn alpha_small(self, alpha: f64, by_rates: [f64; 3], rates: [f64; 3]) -> Reading {
        scaled(
            Reading {
                angle: alpha + dot(by_rates, rates),
                by_alpha: 1.0,
                by_beta: 0.0,
                by_rates,
            },
            self,
        )
    }

    /// Small-angle reading of a β vane.
    #[inline(always)]
    #[must_use]
    pub fn beta_small(self, beta: f64, by_rates: [f64; 3], rates: [f64; 3]) -> Reading {
        scaled(
            Reading {
                angle: beta + dot(by_rates, rates),
                by_alpha: 0.0,
                by_beta: 1.0,
                by_rates,
            },
            self,
        )
    }

    /// Reading of a β vane, with the c.g. at `cg`.
    #[inline(always)]
    #[must_use]
    pub fn beta_reading(self, model: VaneModel, flow: &VaneFlow, cg: Position) -> Reading {
        let arm = self.position().arm(cg);
        let exact = match model {
            VaneModel::Exact => {
                let local = flow.at(arm);
                local.beta_from(local.directions[1]).reading(flow.beta)
            }
            VaneModel::SmallAngle => {
                return self.beta_small(
                    flow.beta,
                    self.beta_by_rates(flow.velocity, cg),
                    flow.rates,
                );
            }
        };
        scaled(exact, self)
    }
}

impl Sensors {
    /// Reading of the α vane, with the c.g. at `cg`.
    #[inline(always)]
    #[must_use]
    pub fn alpha_reading(&self, flow: &VaneFlow, cg: Position) -> Reading {
        self.alpha_vane.alpha_reading(self.vane_model, flow, cg)
    }

    /// Reading of the β vane, with the c.g. at `cg`.
    #[inline(always)]
    #[must_use]
    pub fn beta_reading(&self, flow: &VaneFlow, cg: Position) -> Reading {
        self.beta_vane.beta_reading(self.vane_model, flow, cg)
    }

    /// Flow at the c.g. from the readings of the two vanes (`alpha`, `beta` of `read`). Small-angle
    /// readings are solved directly. Exact readings are inverted by Newton's iteration on the
    /// tangents of the angles' remaining errors, which are almost linear.
    #[inline(always)]
    #[must_use]
    pub fn flow_at_cg(&self, read: &VaneFlow, cg: Position) -> VaneFlow {
        let mut flow = VaneFlow {
            alpha: read.alpha * (1.0 / self.alpha_vane.factor),
            beta: read.beta * (1.0 / self.beta_vane.factor),
            ..*read
        };
        let at_vanes = sin_cos([flow.alpha, flow.beta]);
        flow.alpha -= dot(
            self.alpha_vane.alpha_by_rates(read.velocity, cg),
            read.rates,
        );
        flow.beta -= dot(self.beta_vane.beta_by_rates(read.velocity, cg), read.rates);
        if self.vane_model == VaneModel::SmallAngle {
            return flow;
        }
        let arms = [self.alpha_vane, self.beta_vane].map(|vane| vane.position().arm(cg));
        for _ in 0..MOST_STEPS {
            let (alpha, beta) = (
                flow.at(arms[0]).alpha_from(at_vanes[0]),
                flow.at(arms[1]).beta_from(at_vanes[1]),
            );
            let (alpha_error, beta_error) = (alpha.tangent_left(), beta.tangent_left());
            let determinant = alpha.by_alpha * beta.by_beta - alpha.by_beta * beta.by_alpha;
            flow.alpha += (alpha_error * beta.by_beta - beta_error * alpha.by_beta) / determinant;
            flow.beta += (beta_error * alpha.by_alpha - alpha_error * beta.by_alpha) / determinant;
            if alpha_error.abs().max(beta_error.abs()) < CLOSE {
                break;
            }
        }
        flow
    }
}

#[inline(always)]
fn scaled(r: Reading, vane: Vane) -> Reading {
    let k = vane.factor;
    Reading {
        angle: k * r.angle,
        by_alpha: k * r.by_alpha,
        by_beta: k * r.by_beta,
        by_rates: [k * r.by_rates[0], k * r.by_rates[1], k * r.by_rates[2]],
    }
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    const CG: Position = Position {
        x_ft: 38.2,
        y_ft: 0.0,
        z_ft: 8.7,
    };

    fn sensors(vane_model: VaneModel) -> Sensors {
        let p = Position {
            x_ft: 31.4,
            y_ft: -0.1,
            z_ft: 6.95,
        };
        Sensors {
            an: p,
            ax: p,
            ay: p,
            alpha_vane: Vane {
                x_ft: 35.4,
                y_ft: 19.2,
                z_ft: 7.9,
                factor: 1.02,
            },
            beta_vane: Vane {
                x_ft: 35.4,
                y_ft: -19.2,
                z_ft: 7.9,
                factor: 0.98,
            },
            vane_model,
            thrust_in_ax: true,
        }
    }

    const FLOW: VaneFlow = VaneFlow {
        alpha: 0.6,
        beta: 0.1,
        velocity: 280.0,
        rates: [0.3, -0.1, 0.15],
    };

    fn slopes_match(read: impl Fn(&VaneFlow) -> Reading) {
        let (h, at) = (1e-6, read(&FLOW));
        let numeric = |f: &dyn Fn(&mut VaneFlow, f64)| {
            let (mut up, mut down) = (FLOW, FLOW);
            f(&mut up, h);
            f(&mut down, -h);
            (read(&up).angle - read(&down).angle) / (2.0 * h)
        };
        assert_abs_diff_eq!(at.by_alpha, numeric(&|f, d| f.alpha += d), epsilon = 1e-8);
        assert_abs_diff_eq!(at.by_beta, numeric(&|f, d| f.beta += d), epsilon = 1e-8);
        for i in 0..3 {
            assert_abs_diff_eq!(
                at.by_rates[i],
                numeric(&|f, d| f.rates[i] += d),
                epsilon = 1e-8
            );
        }
    }

    #[test]
    fn slopes_of_the_readings_are_those_of_finite_differences() {
        for model in [VaneModel::Exact, VaneModel::SmallAngle] {
            let s = sensors(model);
            slopes_match(|f| s.alpha_reading(f, CG));
            slopes_match(|f| s.beta_reading(f, CG));
        }
    }

    #[test]
    fn a_vane_ahead_of_the_cg_reads_less_alpha_when_the_nose_goes_up() {
        for model in [VaneModel::Exact, VaneModel::SmallAngle] {
            let s = sensors(model);
            let still = VaneFlow {
                rates: [0.0; 3],
                beta: 0.0,
                ..FLOW
            };
            let nose_up = VaneFlow {
                rates: [0.0, 0.2, 0.0],
                ..still
            };
            assert!(s.alpha_reading(&nose_up, CG).angle < s.alpha_reading(&still, CG).angle);
        }
    }

    #[test]
    fn a_vane_on_the_right_tip_reads_more_alpha_when_the_right_wing_goes_down() {
        for model in [VaneModel::Exact, VaneModel::SmallAngle] {
            let s = sensors(model);
            let still = VaneFlow {
                rates: [0.0; 3],
                alpha: 0.1,
                beta: 0.0,
                ..FLOW
            };
            let rolling = VaneFlow {
                rates: [0.2, 0.0, 0.0],
                ..still
            };
            assert!(s.alpha_reading(&rolling, CG).angle > s.alpha_reading(&still, CG).angle);
        }
    }

    #[test]
    fn a_vane_ahead_of_the_cg_reads_more_beta_when_the_nose_goes_right() {
        // The nose moving right meets the air from the right.
        for model in [VaneModel::Exact, VaneModel::SmallAngle] {
            let s = sensors(model);
            let still = VaneFlow {
                rates: [0.0; 3],
                alpha: 0.1,
                beta: 0.0,
                ..FLOW
            };
            let yawing = VaneFlow {
                rates: [0.0, 0.0, 0.2],
                ..still
            };
            assert!(s.beta_reading(&yawing, CG).angle > s.beta_reading(&still, CG).angle);
        }
    }

    #[test]
    fn exact_and_printed_forms_agree_for_small_angles_at_the_cg_s_height() {
        let small = VaneFlow {
            alpha: 0.02,
            beta: 0.0,
            velocity: 500.0,
            rates: [0.01, 0.02, 0.0],
        };
        let (exact, printed) = (sensors(VaneModel::Exact), sensors(VaneModel::SmallAngle));
        let difference =
            exact.alpha_reading(&small, CG).angle - printed.alpha_reading(&small, CG).angle;
        assert_abs_diff_eq!(difference, 0.0, epsilon = 2e-6);
    }

    #[test]
    fn the_inversion_returns_the_angles_at_the_cg() {
        for model in [VaneModel::Exact, VaneModel::SmallAngle] {
            let s = sensors(model);
            let read = VaneFlow {
                alpha: s.alpha_reading(&FLOW, CG).angle,
                beta: s.beta_reading(&FLOW, CG).angle,
                ..FLOW
            };
            let back = s.flow_at_cg(&read, CG);
            assert_abs_diff_eq!(back.alpha, FLOW.alpha, epsilon = 1e-15);
            assert_abs_diff_eq!(back.beta, FLOW.beta, epsilon = 1e-15);
        }
    }
}
