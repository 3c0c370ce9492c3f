//! Sums of a window's information and gradient over its samples, output by output.
//!
//! Residuals are those of every sample. Sensitivities are known at nodes and interpolated between them.
//! So the gradient Σ s v over the samples is one over the nodes, with each residual shared out to the
//! nodes around it by the weights of the interpolation.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};

use super::parameters::{ALL_KINDS, INPUTS, KINDS, Kind, OUTPUTS, PARAMETERS, Parameters, place};
use super::reconstruction::{DRIVING, LOCAL, ROW, Reconstructed, Row, WIDE, shared_place};
use super::window::Window;
use crate::flight::interpolation_kernel::InterpolationKernel;
use crate::numerics::row_products::StridedRows;
use crate::numerics::simd::{AlignedBuffer, VECTOR};

/// Rows of an output that are summed together: they stay in the processor's first cache.
const CHUNK: usize = 16;

/// Place of the residual in a row.
const RESIDUAL: usize = ROW;

/// Sums of one output with unit weight.
pub struct OutputSums {
    /// Σ of the products of its rows (s, v), s the sensitivities and v the residual. The lower triangle
    /// counts.
    products: AlignedBuffer,
    pub squared_residuals: f64,
}

impl OutputSums {
    pub fn information(&self, i: usize, j: usize) -> f64 {
        self.products.slice()[i.max(j) * WIDE + i.min(j)]
    }

    pub fn gradient(&self, i: usize) -> f64 {
        self.information(RESIDUAL, i)
    }
}

/// Number of parameters of a window, its own before the shared ones.
pub const ALL: usize = LOCAL + PARAMETERS;

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
        self.cost += weight * sums.squared_residuals;
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

    /// Scores on the shared parameters with the local ones eliminated, from scores on all, one a
    /// column. `None` where the local parameters are not determined.
    pub fn eliminated(&self, scores: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let own = Cholesky::new(self.local_information.clone())?;
        let local_steps = own.solve(&scores.rows(0, LOCAL).into_owned());
        Some(scores.rows(LOCAL, PARAMETERS) - self.cross_information.tr_mul(&local_steps))
    }

    /// Step of the local parameters that follows a step of the shared ones.
    pub fn local_step(&self, shared_step: &DVector<f64>) -> Option<DVector<f64>> {
        let own = Cholesky::new(self.local_information.clone())?;
        Some(own.solve(&(&self.local_gradient - &self.cross_information * shared_step)))
    }
}

/// Residuals of each output at every sample; NaN where the output does not count.
pub type Residuals = [Vec<f64>; OUTPUTS];

/// Compares the outputs of some samples of a reconstructed window with the measured ones.
pub fn output_sums(
    window: &Window,
    reconstructed: &Reconstructed,
    shared: &Parameters,
    samples: &Range<usize>,
) -> (Vec<OutputSums>, Residuals) {
    let mut rows = AlignedBuffer::zeros(reconstructed.rows.len() * WIDE);
    let mut all = Vec::with_capacity(OUTPUTS);
    let residuals = std::array::from_fn(|output| {
        let comparison = Comparison {
            reconstructed,
            step_s: window.step_s,
            output,
            error: ALL_KINDS.map(|kind| shared[place(INPUTS + output, kind)]),
        };
        let mut residuals = vec![f64::NAN; window.samples];
        let shares = comparison.shares(&window.outputs[output], samples, &mut residuals);
        let filled = comparison.fill_rows(&shares.of_nodes, rows.slice_mut());
        let mut products = AlignedBuffer::zeros(WIDE * WIDE);
        Arch::new().dispatch(Products {
            rows: &rows.slice()[..filled * WIDE],
            products: products.slice_mut(),
        });
        all.push(OutputSums {
            products,
            squared_residuals: shares.squared_residuals,
        });
        residuals
    });
    (all, residuals)
}

/// Comparison of one output.
struct Comparison<'a> {
    reconstructed: &'a Reconstructed,
    step_s: f64,
    output: usize,
    /// Errors of its instrument.
    error: [f64; KINDS],
}

/// An output's samples shared out to the nodes.
struct Shares {
    squared_residuals: f64,
    /// Number of samples and sum of residuals of each node.
    of_nodes: Vec<[f64; 2]>,
}

impl Comparison<'_> {
    /// Writes the residuals and shares them out to the nodes around the instant that a sample shows.
    fn shares(&self, measured: &[f64], samples: &Range<usize>, residuals: &mut [f64]) -> Shares {
        let readings = &self.reconstructed.readings;
        let [bias, scale, delay_s] = self.error;
        let late = delay_s / self.step_s;
        let kernel = InterpolationKernel::at(-late);
        let nodes = self.reconstructed.rows.len();
        let per_node = self.reconstructed.samples_per_node;
        let between = |k: usize| InterpolationKernel::at((k as f64 - late) / per_node as f64);
        let between: Vec<InterpolationKernel> = (0..per_node).map(between).collect();
        let mut shares = Shares {
            squared_residuals: 0.0,
            of_nodes: vec![[0.0; 2]; nodes],
        };
        for k in samples.clone().filter(|k| measured[*k].is_finite()) {
            let (reading, _) = kernel.interpolate(k, readings.len(), |i| readings[i][self.output]);
            let residual = measured[k] - ((1.0 + scale) * reading + bias);
            residuals[k] = residual;
            shares.squared_residuals += residual * residual;
            for (node, share, _) in between[k % per_node].weights_at(k / per_node, nodes) {
                let [count, sum] = &mut shares.of_nodes[node];
                *count += share;
                *sum += share * residual;
            }
        }
        shares
    }

    /// Writes the rows of the nodes that have samples, and returns their number. Beyond the first and the
    /// last sample the weights are negative and next to nothing.
    fn fill_rows(&self, shares: &[[f64; 2]], rows: &mut [f64]) -> usize {
        let mut filled = 0;
        for (node, [count, sum]) in shares
            .iter()
            .enumerate()
            .filter(|(_, [count, _])| *count > 0.0)
        {
            let root = count.sqrt();
            let row = &mut rows[filled * WIDE..][..WIDE];
            row.copy_from_slice(&self.row(node, root));
            row[RESIDUAL] = sum / root;
            filled += 1;
        }
        filled
    }

    /// Sensitivities of the output at a node, times a factor.
    fn row(&self, node: usize, factor: f64) -> Row {
        let Reconstructed {
            readings,
            rows,
            samples_per_node,
        } = self.reconstructed;
        let gain = 1.0 + self.error[Kind::Scale as usize];
        let mut row = rows[node][self.output].map(|slope| factor * gain * slope);
        let sample = node * samples_per_node;
        let (before, after) = (
            sample.saturating_sub(1),
            (sample + 1).min(readings.len() - 1),
        );
        let rise = readings[after][self.output] - readings[before][self.output];
        let rate = rise / ((after - before) as f64 * self.step_s);
        let own = [1.0, readings[sample][self.output], -gain * rate];
        for (column, slope) in row[DRIVING..].iter_mut().zip(own) {
            *column = factor * slope;
        }
        row
    }
}

/// Σ of the products of rows.
struct Products<'a> {
    rows: &'a [f64],
    products: &'a mut [f64],
}

impl WithSimd for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for values in self.rows.chunks(CHUNK * WIDE) {
            let rows = StridedRows {
                values,
                stride: WIDE,
                count: values.len() / WIDE,
            };
            rows.add_gram(simd, &[VECTOR; WIDE / VECTOR], self.products, WIDE);
        }
    }
}
