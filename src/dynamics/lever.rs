//! Acceleration at an arm from the c.g., besides that of the c.g. itself: ω̇ × r + ω × (ω × r).
//!
//! Eqs. 2.7, 2.8 and 3.7 drop the products of two different rates. These reach 0.005 g at high roll
//! rate, so they are kept here.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

/// One body-axis component of the lever acceleration, ft/s², with its slopes along ω and ω̇.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lever {
    pub value: f64,
    pub by_rates: [f64; 3],
    pub by_accelerations: [f64; 3],
}

/// Component `i` (0 forward, 1 right, 2 down) at an arm in body axes (ft), for ω in rad/s and ω̇ in
/// rad/s².
#[inline(always)]
pub(crate) fn lever(i: usize, arm: [f64; 3], rates: [f64; 3], accelerations: [f64; 3]) -> Lever {
    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
    let along = arm[0] * rates[0] + arm[1] * rates[1] + arm[2] * rates[2];
    let across2 = rates[j] * rates[j] + rates[k] * rates[k];
    let mut by_accelerations = [0.0; 3];
    by_accelerations[j] = arm[k];
    by_accelerations[k] = -arm[j];
    let value = accelerations[j] * arm[k] - accelerations[k] * arm[j]
        + rates[i] * (along - rates[i] * arm[i])
        - arm[i] * across2;
    let mut by_rates = [0.0; 3];
    by_rates[i] = along - rates[i] * arm[i];
    by_rates[j] = rates[i] * arm[j] - 2.0 * arm[i] * rates[j];
    by_rates[k] = rates[i] * arm[k] - 2.0 * arm[i] * rates[k];
    Lever {
        value,
        by_rates,
        by_accelerations,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    const ARM: [f64; 3] = [6.9, -0.25, 1.8];
    const RATES: [f64; 3] = [0.4, -0.2, 0.15];
    const ACCELERATIONS: [f64; 3] = [1.1, -0.7, 0.3];

    fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    }

    #[test]
    fn the_lever_is_the_rigid_body_s_acceleration() {
        let (turning, centripetal) = (cross(ACCELERATIONS, ARM), cross(RATES, cross(RATES, ARM)));
        for i in 0..3 {
            assert_abs_diff_eq!(
                lever(i, ARM, RATES, ACCELERATIONS).value,
                turning[i] + centripetal[i],
                epsilon = 1e-14
            );
        }
    }

    #[test]
    fn the_lever_has_the_printed_terms_of_2_7_2_8_and_3_7() {
        // Arms aft, right and above, as in the paper. The printed forms have no products of two
        // different rates.
        let (x, y, z) = (-ARM[0], ARM[1], -ARM[2]);
        let only = |i: usize, w: f64| {
            let mut rates = [0.0; 3];
            rates[i] = w;
            rates
        };
        let [pd, qd, rd] = ACCELERATIONS;
        for (i, w) in [(0, 0.4), (1, -0.2), (2, 0.15)] {
            let [p, q, r] = only(i, w);
            let up = -lever(2, ARM, only(i, w), ACCELERATIONS).value;
            assert_abs_diff_eq!(
                up,
                -(x * qd + y * pd) - z * (q * q + p * p),
                epsilon = 1e-14
            );
            let forward = lever(0, ARM, only(i, w), ACCELERATIONS).value;
            assert_abs_diff_eq!(
                forward,
                -(z * qd + y * rd) + x * (q * q + r * r),
                epsilon = 1e-14
            );
            let right = lever(1, ARM, only(i, w), ACCELERATIONS).value;
            assert_abs_diff_eq!(
                right,
                -x * rd + z * pd - y * (p * p + r * r),
                epsilon = 1e-14
            );
        }
    }

    #[test]
    fn slopes_of_the_lever_are_those_of_finite_differences() {
        let h = 1e-6;
        for i in 0..3 {
            let at = lever(i, ARM, RATES, ACCELERATIONS);
            for j in 0..3 {
                let moved = |v: [f64; 3], d: f64| {
                    let mut v = v;
                    v[j] += d;
                    v
                };
                let rate = (lever(i, ARM, moved(RATES, h), ACCELERATIONS).value
                    - lever(i, ARM, moved(RATES, -h), ACCELERATIONS).value)
                    / (2.0 * h);
                assert_abs_diff_eq!(at.by_rates[j], rate, epsilon = 1e-9);
                let acceleration = (lever(i, ARM, RATES, moved(ACCELERATIONS, h)).value
                    - lever(i, ARM, RATES, moved(ACCELERATIONS, -h)).value)
                    / (2.0 * h);
                assert_abs_diff_eq!(at.by_accelerations[j], acceleration, epsilon = 1e-9);
            }
        }
    }
}
