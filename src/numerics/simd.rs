//! Vectors of the processor at hand: their widest width, memory aligned to them, loads and stores.
#![expect(
    clippy::inline_always,
    reason = "compiled into the loops that use them"
)]

use pulp::Simd;

/// A group is padded to a multiple of this many lanes: the widest vector of doubles there is.
pub(crate) const VECTOR: usize = 8;

/// Numbers that begin where a line of the fastest memory does: a vector that lies across two lines
/// costs twice.
#[derive(Clone, Debug, Default)]
pub(crate) struct Aligned {
    buffer: Vec<f64>,
    first: usize,
    length: usize,
}

impl Aligned {
    pub fn zeros(length: usize) -> Aligned {
        const LINE: usize = 64;
        let buffer = vec![0.0; length + LINE / size_of::<f64>()];
        let first = buffer
            .as_ptr()
            .align_offset(LINE)
            .min(LINE / size_of::<f64>());
        Aligned {
            buffer,
            first,
            length,
        }
    }

    #[inline]
    pub fn slice(&self) -> &[f64] {
        &self.buffer[self.first..self.first + self.length]
    }

    #[inline]
    pub fn slice_mut(&mut self) -> &mut [f64] {
        &mut self.buffer[self.first..self.first + self.length]
    }
}

/// The vector that begins at a place of a slice.
#[inline(always)]
pub(crate) fn load<S: Simd>(from: &[f64], at: usize) -> S::f64s {
    S::as_simd_f64s(&from[at..at + S::F64_LANES]).0[0]
}

/// Writes a vector to a place of a slice.
#[inline(always)]
pub(crate) fn store<S: Simd>(to: &mut [f64], at: usize, value: S::f64s) {
    S::as_mut_simd_f64s(&mut to[at..at + S::F64_LANES]).0[0] = value;
}
