//! Vectors of the processor: their greatest width, memory aligned to them, loads and stores.
#![expect(
    clippy::inline_always,
    reason = "compiled into the loops that use them"
)]

use pulp::{Arch, Simd, WithSimd};

/// Calls a closure compiled for the processor at hand. The closure is marked `#[inline(always)]`: one that the
/// compiler does not inline is compiled without the processor's vectors.
pub(crate) fn vectorised<R>(closure: impl FnMut() -> R) -> R {
    Arch::new().dispatch(Vectorised(closure))
}

/// Closure that is called where it is compiled. As a `FnOnce` it would be called through a function that is
/// never inlined by force.
struct Vectorised<F>(F);

impl<R, F: FnMut() -> R> WithSimd for Vectorised<F> {
    type Output = R;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> R {
        (self.0)()
    }
}

/// Lanes of the widest vector of doubles (512 bit). Rows are padded to a multiple of it.
pub(crate) const VECTOR: usize = 8;

/// Buffer that begins on a cache line: a vector across two lines costs two loads.
#[derive(Clone, Debug, Default)]
pub(crate) struct AlignedBuffer {
    buffer: Vec<f64>,
    first: usize,
}

/// Length of a cache line in bytes.
const LINE: usize = 64;

/// Index of the first number of a buffer that begins a cache line.
fn first_of_line(buffer: &[f64]) -> usize {
    let offset = buffer.as_ptr().align_offset(LINE);
    offset.min(LINE / size_of::<f64>())
}

impl AlignedBuffer {
    pub fn zeros(length: usize) -> AlignedBuffer {
        let mut buffer = vec![0.0; length + LINE / size_of::<f64>()];
        let first = first_of_line(&buffer);
        buffer.truncate(first + length);
        AlignedBuffer { buffer, first }
    }

    /// Removes all values and makes room for a number of values, which are not cleared before they
    /// are appended.
    pub fn clear_with_room(&mut self, length: usize) {
        let room = length + LINE / size_of::<f64>();
        if self.buffer.capacity() < room {
            self.buffer = Vec::with_capacity(room);
            self.first = first_of_line(&self.buffer);
            self.buffer.resize(self.first, 0.0);
        }
        self.buffer.truncate(self.first);
    }

    /// Appends a number of zeros.
    #[inline]
    pub fn append_zeros(&mut self, length: usize) {
        self.buffer.resize(self.buffer.len() + length, 0.0);
    }

    #[inline]
    pub fn slice(&self) -> &[f64] {
        &self.buffer[self.first..]
    }

    #[inline]
    pub fn slice_mut(&mut self) -> &mut [f64] {
        &mut self.buffer[self.first..]
    }
}

/// Loads the vector that begins at an index of a slice.
#[inline(always)]
pub(crate) fn load<S: Simd>(from: &[f64], at: usize) -> S::f64s {
    S::as_simd_f64s(&from[at..at + S::F64_LANES]).0[0]
}

/// Stores a vector at an index of a slice.
#[inline(always)]
pub(crate) fn store<S: Simd>(to: &mut [f64], at: usize, value: S::f64s) {
    S::as_mut_simd_f64s(&mut to[at..at + S::F64_LANES]).0[0] = value;
}
