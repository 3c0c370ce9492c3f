//! Sizes by which a pass steps through a maneuver.
#![expect(
    clippy::inline_always,
    reason = "compiled into the kernel for the processor at hand"
)]

use crate::numerics::vectors::simd::VECTOR;

/// Samples between two calls of the sink: a whole number of vectors, whose rows fit into the
/// first-level cache.
pub(crate) const CHUNK: usize = 24;

/// Greatest distance between the samples of a coarse pass.
pub(crate) const WIDEST_STRIDE: usize = 8;

/// Points of a chunk: its samples, the halves between them, and the sample that follows.
pub(crate) const POINTS: usize = 2 * CHUNK + 1;

/// Points of a chunk rounded up to whole vectors.
pub(crate) const PADDED_POINTS: usize = POINTS.next_multiple_of(VECTOR);

/// Zero points behind the last sample: room for a chunk that begins there at the widest stride.
pub(super) const ZERO_POINTS: usize = POINTS * WIDEST_STRIDE;

/// Every `stride`-th sample or point, from `first` on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strided {
    pub first: usize,
    pub stride: usize,
}

impl Strided {
    #[inline(always)]
    pub fn index(self, k: usize) -> usize {
        self.first + k * self.stride
    }
}
