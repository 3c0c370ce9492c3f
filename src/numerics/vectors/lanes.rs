//! Numbers side by side in the lanes of a vector, and their linear combinations.
#![expect(
    clippy::inline_always,
    reason = "compiled into the loops that use them"
)]

use std::ops::{Add, Mul, Sub};

use pulp::Simd;

use super::simd::{load, store};

/// One number in each lane of a vector.
#[derive(Clone, Copy)]
pub(crate) struct Lanes<S: Simd> {
    simd: S,
    values: S::f64s,
}

impl<S: Simd> Lanes<S> {
    /// Zero in every lane.
    #[inline(always)]
    pub fn zero(simd: S) -> Lanes<S> {
        Lanes {
            simd,
            values: simd.splat_f64s(0.0),
        }
    }

    /// Loads the numbers that begin at an index of a slice.
    #[inline(always)]
    pub fn load(simd: S, from: &[f64], at: usize) -> Lanes<S> {
        Lanes {
            simd,
            values: load::<S>(from, at),
        }
    }

    /// Stores the numbers at an index of a slice.
    #[inline(always)]
    pub fn store(self, to: &mut [f64], at: usize) {
        store::<S>(to, at, self.values);
    }

    /// Adds `factor` times other numbers.
    #[inline(always)]
    pub fn plus(self, factor: f64, other: Lanes<S>) -> Lanes<S> {
        let factor = self.simd.splat_f64s(factor);
        Lanes {
            simd: self.simd,
            values: self.simd.mul_add_f64s(factor, other.values, self.values),
        }
    }
}

impl<S: Simd> Add for Lanes<S> {
    type Output = Lanes<S>;

    #[inline(always)]
    fn add(self, other: Lanes<S>) -> Lanes<S> {
        Lanes {
            simd: self.simd,
            values: self.simd.add_f64s(self.values, other.values),
        }
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Lanes<S>;

    #[inline(always)]
    fn sub(self, other: Lanes<S>) -> Lanes<S> {
        Lanes {
            simd: self.simd,
            values: self.simd.sub_f64s(self.values, other.values),
        }
    }
}

impl<S: Simd> Mul<f64> for Lanes<S> {
    type Output = Lanes<S>;

    #[inline(always)]
    fn mul(self, factor: f64) -> Lanes<S> {
        let factor = self.simd.splat_f64s(factor);
        Lanes {
            simd: self.simd,
            values: self.simd.mul_f64s(factor, self.values),
        }
    }
}

/// Numbers that a function returns for each place. Unlike `std::array::from_fn` and iterators it is
/// inlined with its function; otherwise each operation would be a call, as the called function is
/// compiled without the processor's vectors.
#[expect(
    clippy::needless_range_loop,
    reason = "an iterator's functions are not inlined"
)]
#[inline(always)]
pub(crate) fn each<S: Simd, const N: usize>(of: impl Fn(usize) -> Lanes<S>) -> [Lanes<S>; N] {
    let mut all = [of(0); N];
    for place in 1..N {
        all[place] = of(place);
    }
    all
}

/// Sum of numbers times factors.
#[inline(always)]
pub(crate) fn combination<S: Simd, const N: usize>(
    factors: &[f64; N],
    of: &[Lanes<S>; N],
) -> Lanes<S> {
    let mut sum = of[0] * factors[0];
    for place in 1..N {
        sum = sum.plus(factors[place], of[place]);
    }
    sum
}
