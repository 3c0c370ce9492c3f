//! Sums of a window's information and gradient over its samples, output by output.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use nalgebra::{Cholesky, DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};

use super::parameters::{OUTPUTS, PARAMETERS};
use super::reconstruction::{LOCAL, ROW, Row, Sink, WIDE, shared_place};
use super::window::Window;
use crate::numerics::row_products::StridedRows;
use crate::numerics::simd::{AlignedBuffer, VECTOR};

/// Rows of an output that are summed together: they stay in the processor's first cache.
const CHUNK: usize = 16;

/// Place of the residual in a row.
const RESIDUAL: usize = ROW;

/// Sums of one output with unit weight: Σ of the products of its rows (s, v), s the sensitivities
/// and v the residual. The lower triangle counts.
pub struct OutputSums(AlignedBuffer);

impl OutputSums {
    pub fn information(&self, i: usize, j: usize) -> f64 {
        self.0.slice()[i.max(j) * WIDE + i.min(j)]
    }

    pub fn gradient(&self, i: usize) -> f64 {
        self.information(RESIDUAL, i)
    }

    pub fn squared_residuals(&self) -> f64 {
        self.information(RESIDUAL, RESIDUAL)
    }
}

/// Weighted sums over one window: information and gradient on the window's own (local) and on the
/// shared parameters.
#[derive(Clone, Debug)]
pub struct WindowSums {
    pub local_information: DMatrix<f64>,
    /// Local parameters by rows, shared ones by columns.
    pub cross_information: DMatrix<f64>,
    pub shared_information: DMatrix<f64>,
    pub local_gradient: DVector<f64>,
    pub shared_gradient: DVector<f64>,
    pub cost: f64,
}

impl WindowSums {
    pub fn zero() -> WindowSums {
        WindowSums {
            local_information: DMatrix::zeros(LOCAL, LOCAL),
            cross_information: DMatrix::zeros(LOCAL, PARAMETERS),
            shared_information: DMatrix::zeros(PARAMETERS, PARAMETERS),
            local_gradient: DVector::zeros(LOCAL),
            shared_gradient: DVector::zeros(PARAMETERS),
            cost: 0.0,
        }
    }

    /// Adds the sums of one output.
    pub fn add(&mut self, output: usize, weight: f64, sums: &OutputSums) {
        self.cost += weight * sums.squared_residuals();
        for i in 0..ROW {
            for j in 0..ROW {
                let h = weight * sums.information(i, j);
                match (i < LOCAL, j < LOCAL) {
                    (true, true) => self.local_information[(i, j)] += h,
                    (true, false) => {
                        self.cross_information[(i, shared_place(j, output))] += h;
                    }
                    (false, true) => {}
                    (false, false) => {
                        let place = (shared_place(i, output), shared_place(j, output));
                        self.shared_information[place] += h;
                    }
                }
            }
            if i < LOCAL {
                self.local_gradient[i] += weight * sums.gradient(i);
            } else {
                self.shared_gradient[shared_place(i, output)] += weight * sums.gradient(i);
            }
        }
    }

    /// Information and gradient on the shared parameters with the local ones eliminated (Schur's
    /// complement). Zero where the local parameters are not determined.
    pub fn reduced(&self) -> (DMatrix<f64>, DVector<f64>) {
        let Some(own) = Cholesky::new(self.local_information.clone()) else {
            return (
                DMatrix::zeros(PARAMETERS, PARAMETERS),
                DVector::zeros(PARAMETERS),
            );
        };
        let cross = self.cross_information.transpose();
        let information = &self.shared_information - &cross * own.solve(&self.cross_information);
        let gradient = &self.shared_gradient - &cross * own.solve(&self.local_gradient);
        (information, gradient)
    }

    /// Step of the local parameters that follows a step of the shared ones.
    pub fn local_step(&self, shared_step: &DVector<f64>) -> Option<DVector<f64>> {
        let own = Cholesky::new(self.local_information.clone())?;
        Some(own.solve(&(&self.local_gradient - &self.cross_information * shared_step)))
    }
}

/// Residuals of each output at every sample; NaN where the output does not count.
pub type Residuals = [Vec<f64>; OUTPUTS];

/// Sink of a reconstruction that sums its outputs, chunk by chunk.
pub struct OutputSummation<'a> {
    measured: &'a [Vec<f64>; OUTPUTS],
    residuals: Residuals,
    sums: Vec<OutputSums>,
    /// Rows of each output that are not summed yet, and their number.
    rows: AlignedBuffer,
    filled: [usize; OUTPUTS],
}

impl<'a> OutputSummation<'a> {
    pub fn over(window: &'a Window) -> OutputSummation<'a> {
        OutputSummation {
            measured: &window.outputs,
            residuals: std::array::from_fn(|_| vec![f64::NAN; window.samples]),
            sums: (0..OUTPUTS)
                .map(|_| OutputSums(AlignedBuffer::zeros(WIDE * WIDE)))
                .collect(),
            rows: AlignedBuffer::zeros(OUTPUTS * CHUNK * WIDE),
            filled: [0; OUTPUTS],
        }
    }

    #[inline(always)]
    fn sum_chunk<S: Simd>(&mut self, simd: S, output: usize) {
        let values = &self.rows.slice()[output * CHUNK * WIDE..];
        let rows = StridedRows {
            values,
            stride: WIDE,
            count: self.filled[output],
        };
        rows.add_gram(
            simd,
            &[VECTOR; WIDE / VECTOR],
            self.sums[output].0.slice_mut(),
            WIDE,
        );
        self.filled[output] = 0;
    }

    /// Sums the chunks that are not full and returns sums and residuals.
    pub fn finish(mut self) -> (Vec<OutputSums>, Residuals) {
        Arch::new().dispatch(SumRemaining(&mut self));
        (self.sums, self.residuals)
    }
}

struct SumRemaining<'a, 'b>(&'a mut OutputSummation<'b>);

impl WithSimd for SumRemaining<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        (0..OUTPUTS).for_each(|output| self.0.sum_chunk(simd, output));
    }
}

impl Sink for OutputSummation<'_> {
    #[inline(always)]
    fn counts(&self, sample: usize, output: usize) -> bool {
        self.measured[output][sample].is_finite()
    }

    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, sample: usize, output: usize, value: f64, row: &mut Row) {
        let residual = self.measured[output][sample] - value;
        self.residuals[output][sample] = residual;
        row[RESIDUAL] = residual;
        let place = output * CHUNK + self.filled[output];
        self.rows.slice_mut()[place * WIDE..][..WIDE].copy_from_slice(row);
        self.filled[output] += 1;
        if self.filled[output] == CHUNK {
            self.sum_chunk(simd, output);
        }
    }
}
