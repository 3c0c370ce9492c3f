//! Sizes in which a pass goes through a maneuver.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

use crate::numerics::simd::VECTOR;

/// Samples between two calls of the sink, whole vectors of them: what they leave fits into the
/// fastest memory.
pub(crate) const CHUNK: usize = 24;

/// Samples, or points, at equal distances.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spaced {
    pub first: usize,
    pub stride: usize,
}

impl Spaced {
    #[inline(always)]
    pub fn at(self, k: usize) -> usize {
        self.first + k * self.stride
    }
}

/// A pass may take every so many samples at most.
pub(crate) const WIDEST_STRIDE: usize = 8;

/// Points kept beyond the last sample: those of a chunk that begins there, of the widest strides.
pub(super) const BEYOND: usize = POINTS * WIDEST_STRIDE;

/// Points of a chunk's samples and of the one that follows, and the same in whole vectors.
pub(crate) const POINTS: usize = 2 * CHUNK + 1;
pub(crate) const WHOLE: usize = POINTS.next_multiple_of(VECTOR);
