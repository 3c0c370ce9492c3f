//! Sine and cosine together, and the arctangent, from arithmetic alone. The equations of motion need them
//! four times a step, and a library call costs more than the rest of a stage.
//!
//! Minimax polynomials of FreeBSD's msun within ±π/4, after the argument reduction of Cody and
//! Waite. The error is below one unit in the last place up to 50 rad, where an integration is
//! stopped. With fused multiplication throughout, every processor returns the same bits.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4};

/// sin(r)/r − 1 over r², in powers of r².
const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
/// (cos(r) − 1 + r²/2) over r⁴, in powers of r².
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];
/// (1 − arctan(t)/t) over t², in powers of t².
const ARCTANGENT: [f64; 11] = [
    3.333_333_333_333_293e-1,
    -1.999_999_999_987_648_3e-1,
    1.428_571_427_250_346_6e-1,
    -1.111_111_040_546_235_6e-1,
    9.090_887_133_436_507e-2,
    -7.691_876_205_044_83e-2,
    6.661_073_137_387_531e-2,
    -5.833_570_133_790_573_5e-2,
    4.976_877_994_615_932_4e-2,
    -3.653_157_274_421_691_6e-2,
    1.628_582_011_536_578_2e-2,
];
/// Greatest tangent at which the polynomial holds.
const WIDEST_TANGENT: f64 = 7.0 / 16.0;
/// π/2 in two parts; products of the first with small whole numbers are exact.
const HALF_PI: [f64; 2] = [FRAC_PI_2, 6.123_233_995_736_766e-17];

/// (sin x, cos x) of two angles in rad, computed side by side.
#[inline(always)]
#[must_use]
pub(crate) fn sin_cos(x: [f64; 2]) -> [(f64, f64); 2] {
    if x[0].abs() <= FRAC_PI_4 && x[1].abs() <= FRAC_PI_4 {
        return near_zero(x);
    }
    let mut r = x;
    let mut quarters = [0; 2];
    for i in 0..2 {
        let turns = (x[i] * FRAC_2_PI).round_ties_even();
        r[i] = (-turns).mul_add(HALF_PI[1], (-turns).mul_add(HALF_PI[0], x[i]));
        #[expect(clippy::cast_possible_truncation, reason = "a whole number")]
        {
            quarters[i] = turns as i64 & 3;
        }
    }
    let [first, second] = near_zero(r);
    [turned(first, quarters[0]), turned(second, quarters[1])]
}

/// Angle of the point (x, y), rad: a polynomial near the axis, elsewhere the library's.
#[inline(always)]
#[must_use]
pub(crate) fn angle_of(y: f64, x: f64) -> f64 {
    if y.abs() <= WIDEST_TANGENT * x && x > 0.0 {
        near_axis(y / x)
    } else {
        y.atan2(x)
    }
}

/// Arctangent of a small number: even and odd powers side by side.
#[inline(always)]
fn near_axis(t: f64) -> f64 {
    let z = t * t;
    let w = z * z;
    let (mut even, mut odd) = (ARCTANGENT[10], ARCTANGENT[9]);
    for n in (0..5).rev() {
        even = even.mul_add(w, ARCTANGENT[2 * n]);
    }
    for n in (0..4).rev() {
        odd = odd.mul_add(w, ARCTANGENT[2 * n + 1]);
    }
    (-t).mul_add(z.mul_add(even, w * odd), t)
}

/// Sine and cosine after adding quarter turns.
#[inline(always)]
fn turned((s, c): (f64, f64), quarters: i64) -> (f64, f64) {
    match quarters {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// Sines and cosines of two angles within ±π/4: all four are one polynomial with different
/// coefficients.
#[inline(always)]
fn near_zero(r: [f64; 2]) -> [(f64, f64); 2] {
    let angle = [r[0], r[1], r[0], r[1]];
    let z = times(angle, angle);
    let zz = times(z, z);
    // Sine: r + z r p; cosine: 1 − z/2 + z² p.
    let factor = [r[0], r[1], z[0], z[1]];
    let start = [
        r[0],
        r[1],
        (-0.5_f64).mul_add(z[0], 1.0),
        (-0.5_f64).mul_add(z[1], 1.0),
    ];
    let both = fused(times(z, factor), polynomial(z, zz), start);
    [(both[0], both[2]), (both[1], both[3])]
}

#[inline(always)]
fn times(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]]
}

#[inline(always)]
fn fused(a: [f64; 4], b: [f64; 4], c: [f64; 4]) -> [f64; 4] {
    [
        a[0].mul_add(b[0], c[0]),
        a[1].mul_add(b[1], c[1]),
        a[2].mul_add(b[2], c[2]),
        a[3].mul_add(b[3], c[3]),
    ]
}

/// Coefficients of sine and cosine at one power.
#[inline(always)]
fn at_power(n: usize) -> [f64; 4] {
    [SINE[n], SINE[n], COSINE[n], COSINE[n]]
}

/// Polynomials of order five, in pairs, so that terms do not wait for each other.
#[inline(always)]
fn polynomial(z: [f64; 4], zz: [f64; 4]) -> [f64; 4] {
    let low = fused(at_power(1), z, at_power(0));
    let middle = fused(at_power(3), z, at_power(2));
    let high = fused(at_power(5), z, at_power(4));
    fused(times(zz, zz), high, fused(zz, middle, low))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_those_of_the_platform_to_two_in_the_last_place() {
        for k in -50_000..=50_000 {
            let x = f64::from(k) * 1.001e-3;
            let [(s, c), other] = sin_cos([x, -0.5 * x]);
            assert_eq!(other, sin_cos([-0.5 * x, 1.0])[0]);
            assert!((s - x.sin()).abs() <= 3e-16, "sin {x}");
            assert!((c - x.cos()).abs() <= 3e-16, "cos {x}");
        }
        assert_eq!(sin_cos([0.0; 2])[0], (0.0, 1.0));
    }

    #[test]
    fn the_angle_of_a_point_is_that_of_the_platform_to_two_in_the_last_place() {
        for k in -60_000..=60_000 {
            let t = f64::from(k) * 1.01e-5;
            for (y, x) in [(t, 1.0), (270.0 * t, 270.0), (t, -1.0), (1.0, t)] {
                let (angle, expected) = (angle_of(y, x), y.atan2(x));
                assert!(
                    (angle - expected).abs() <= 3e-16 * expected.abs(),
                    "{y} {x}"
                );
            }
        }
        assert!(angle_of(f64::NAN, 1.0).is_nan() && angle_of(1.0, f64::NAN).is_nan());
    }

    #[test]
    fn what_is_no_number_stays_none() {
        let [nan, infinite] = sin_cos([f64::NAN, f64::INFINITY]);
        assert!(nan.0.is_nan() && infinite.1.is_nan());
    }
}
