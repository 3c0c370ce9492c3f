//! Sums of a window over its samples, output by output: residuals, gradient and information.
//!
//! Readings are known at points and sensitivities at nodes, and interpolated between them. The
//! gradient Σ s v over the samples is therefore a sum over the nodes. Each residual is distributed
//! over the nodes around it by the weights of the interpolation.

#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use pulp::{Arch, Simd, WithSimd};

use super::parameters::{ALL_KINDS, INPUTS, KINDS, Kind, OUTPUTS, PARAMETERS, Parameters, place};
use super::reconstruction::{
    DRIVING, LOCAL, ROW, Row, Trajectory, TrajectorySensitivities, WIDE, shared_place,
};
use super::window::Window;
use crate::flight::interpolation_kernel::InterpolationKernel;
use crate::numerics::vectors::row_products::StridedRows;
use crate::numerics::vectors::simd::{AlignedBuffer, VECTOR, load, store, vectorised};

/// Rows of an output that are summed together: they stay in the processor's first cache.
const CHUNK: usize = 16;

/// Number of parameters of a window, its own before the shared ones.
pub const ALL: usize = LOCAL + PARAMETERS;

/// Place among all parameters of a column of an output's row.
pub fn place_among_all(column: usize, output: usize) -> usize {
    if column < LOCAL {
        column
    } else {
        LOCAL + shared_place(column, output)
    }
}

/// Adds a multiple of a row of an output, or of its beginning, to values of all parameters.
#[inline(always)]
pub fn add_row(all: &mut [f64], row: &[f64], output: usize, factor: f64) {
    // Parameters of the states stand alike in a row and among all; those of the output do not.
    let (of_states, of_output) = row.split_at(row.len().min(DRIVING));
    add_scaled(all, of_states, factor);
    add_scaled(
        &mut all[place_among_all(DRIVING, output)..],
        of_output,
        factor,
    );
}

#[inline(always)]
fn add_scaled(sums: &mut [f64], values: &[f64], factor: f64) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

/// Comparison of a window's outputs with what the instruments read along a trajectory.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Residuals of each output at every sample; NaN where the output does not count.
    pub residuals: [Vec<f64>; OUTPUTS],
    pub squares: [f64; OUTPUTS],
    /// Residuals, distributed over the nodes.
    sums: [Vec<f64>; OUTPUTS],
    distribution: NodeDistribution,
}

/// Distribution of a window's samples over the nodes around them.
#[derive(Clone, Debug)]
struct NodeDistribution {
    nodes: usize,
    samples_per_node: usize,
    /// Samples that are compared.
    samples: Range<usize>,
    /// Samples by which each output was measured earlier.
    late: [f64; OUTPUTS],
}

impl NodeDistribution {
    /// Sums over the nodes of an output's values at all samples.
    fn sums(&self, output: usize, all: &[f64]) -> Vec<f64> {
        let (mut sums, mut values) = (vec![0.0; self.nodes], Vec::new());
        for phase in phases(self.samples_per_node, self.late[output], &self.samples) {
            values.clear();
            values.extend(phase.samples().map(|k| all[k]));
            phase
                .kernel
                .share_out(phase.points.start, &values, &mut sums);
        }
        sums
    }
}

/// Samples at the same distance after points that are `spacing` samples apart.
struct Phase {
    spacing: usize,
    /// Distance after the point, in samples.
    offset: usize,
    /// Points before the samples.
    points: Range<usize>,
    /// Kernel for the instant at which the instrument measured the sample.
    kernel: InterpolationKernel,
}

impl Phase {
    /// Its samples.
    fn samples(&self) -> impl Iterator<Item = usize> + use<> {
        let (first, spacing) = (self.points.start * self.spacing + self.offset, self.spacing);
        (0..self.points.len()).map(move |k| first + k * spacing)
    }
}

/// Phases of samples that were measured `late` samples earlier.
fn phases(spacing: usize, late: f64, samples: &Range<usize>) -> impl Iterator<Item = Phase> {
    let Range { start, end } = *samples;
    let point = move |sample: usize, offset: usize| sample.saturating_sub(offset).div_ceil(spacing);
    (0..spacing).map(move |offset| Phase {
        spacing,
        offset,
        points: point(start, offset)..point(end, offset),
        kernel: InterpolationKernel::at((offset as f64 - late) / spacing as f64),
    })
}

impl Comparison {
    /// Compares some samples of a window.
    pub fn of(
        window: &Window,
        trajectory: &Trajectory,
        shared: &Parameters,
        samples: &Range<usize>,
    ) -> Comparison {
        let errors: [_; OUTPUTS] = std::array::from_fn(|output| {
            ALL_KINDS.map(|kind| shared[place(INPUTS + output, kind)])
        });
        let mut comparison = Comparison {
            residuals: std::array::from_fn(|_| vec![f64::NAN; window.samples]),
            squares: [0.0; OUTPUTS],
            sums: std::array::from_fn(|_| Vec::new()),
            distribution: NodeDistribution {
                nodes: window.nodes(),
                samples_per_node: window.samples_per_node(),
                samples: samples.clone(),
                late: errors.map(|error| error[Kind::Delay as usize] / window.step_s),
            },
        };
        for (output, error) in errors.into_iter().enumerate() {
            comparison.compare(output, window, &trajectory.readings[output], error, samples);
            comparison.share_out(output);
        }
        comparison
    }

    /// Writes the residuals of an output.
    fn compare(
        &mut self,
        output: usize,
        window: &Window,
        readings: &[f64],
        [bias, scale, delay_s]: [f64; KINDS],
        samples: &Range<usize>,
    ) {
        let (measured, residuals) = (&window.outputs[output], &mut self.residuals[output]);
        let mut read = vec![0.0; readings.len()];
        for phase in phases(window.samples_per_point, delay_s / window.step_s, samples) {
            let read = &mut read[..phase.points.len()];
            phase
                .kernel
                .interpolate_from(phase.points.start, readings, read);
            for (k, reading) in phase.samples().zip(read) {
                residuals[k] = measured[k] - ((1.0 + scale) * *reading + bias);
            }
        }
    }

    /// Distributes the residuals of an output over the nodes.
    fn share_out(&mut self, output: usize) {
        let counted = |v: &f64| if v.is_finite() { *v } else { 0.0 };
        let counted: Vec<f64> = self.residuals[output].iter().map(counted).collect();
        let compared = counted.get(self.distribution.samples.clone());
        let compared = compared.unwrap_or_default();
        self.squares[output] = compared.iter().map(|v| v * v).sum();
        self.sums[output] = self.distribution.sums(output, &counted);
    }

    /// Numbers of an output's samples that count, distributed over the nodes.
    fn counts(&self, output: usize) -> Vec<f64> {
        let counted = |v: &f64| f64::from(u8::from(v.is_finite()));
        let counted: Vec<f64> = self.residuals[output].iter().map(counted).collect();
        self.distribution.sums(output, &counted)
    }

    /// Σ s v of each output, s its sensitivities.
    pub fn gradients(&self, sensitivities: &TrajectorySensitivities) -> [Row; OUTPUTS] {
        Arch::new().dispatch(Gradients {
            rows: &sensitivities.rows,
            residuals: &self.sums,
        })
    }
}

/// Sums of the sensitivities of each output times its residuals.
struct Gradients<'a> {
    rows: &'a [[Row; OUTPUTS]],
    residuals: &'a [Vec<f64>; OUTPUTS],
}

impl WithSimd for Gradients<'_> {
    type Output = [Row; OUTPUTS];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [Row; OUTPUTS] {
        let mut gradients = [[0.0; WIDE]; OUTPUTS];
        for (node, rows) in self.rows.iter().enumerate() {
            for (output, row) in rows.iter().enumerate() {
                let residual = simd.splat_f64s(self.residuals[output][node]);
                let sum = &mut gradients[output];
                for lane in (0..WIDE).step_by(S::F64_LANES) {
                    let so_far = load::<S>(sum, lane);
                    let sum_now = simd.mul_add_f64s(residual, load::<S>(row, lane), so_far);
                    store::<S>(sum, lane, sum_now);
                }
            }
        }
        gradients
    }
}

/// Equations of a window linearised about a trajectory, with the sums that do not depend on the weights of
/// the outputs.
#[derive(Debug)]
pub struct LinearisedWindow {
    pub sensitivities: TrajectorySensitivities,
    /// Numbers of samples that each node stands for.
    pub counts: [Vec<f64>; OUTPUTS],
    /// Σ s sᵀ of each output. The lower triangle counts.
    products: Vec<AlignedBuffer>,
}

impl LinearisedWindow {
    pub fn of(sensitivities: TrajectorySensitivities, comparison: &Comparison) -> LinearisedWindow {
        let mut rows = AlignedBuffer::zeros(sensitivities.rows.len() * WIDE);
        let counts: [_; OUTPUTS] = std::array::from_fn(|output| comparison.counts(output));
        let products = |output: usize| {
            let mut filled = 0;
            // Beyond the first and the last sample the weights are negative and next to nothing.
            for (own, count) in sensitivities
                .rows
                .iter()
                .zip(&counts[output])
                .filter(|(_, c)| **c > 0.0)
            {
                let root = count.sqrt();
                let row = &mut rows.slice_mut()[filled * WIDE..][..WIDE];
                row.iter_mut()
                    .zip(&own[output])
                    .for_each(|(to, slope)| *to = root * slope);
                filled += 1;
            }
            let mut products = AlignedBuffer::zeros(WIDE * WIDE);
            Arch::new().dispatch(Products {
                rows: &rows.slice()[..filled * WIDE],
                products: products.slice_mut(),
            });
            products
        };
        LinearisedWindow {
            products: (0..OUTPUTS).map(products).collect(),
            counts,
            sensitivities,
        }
    }

    /// Information on all parameters for the weights 1/R of the outputs.
    pub fn information(&self, weights: &[f64; OUTPUTS]) -> DMatrix<f64> {
        let mut information = DMatrix::zeros(ALL, ALL);
        let columns = information.as_mut_slice();
        vectorised(
            #[inline(always)]
            || {
                for output in 0..OUTPUTS {
                    let products = self.products[output].slice();
                    for i in 0..ROW {
                        let column = &mut columns[place_among_all(i, output) * ALL..][..ALL];
                        let row = &products[i * WIDE..][..=i];
                        add_row(column, row, output, weights[output]);
                    }
                }
            },
        );
        information.fill_lower_triangle_with_upper_triangle();
        information
    }
}

/// Gradient on all parameters for the weights 1/R of the outputs.
pub fn weighted_gradient(gradients: &[Row; OUTPUTS], weights: &[f64; OUTPUTS]) -> DVector<f64> {
    let mut gradient = DVector::zeros(ALL);
    for (output, (own, weight)) in gradients.iter().zip(weights).enumerate() {
        add_row(gradient.as_mut_slice(), &own[..ROW], output, *weight);
    }
    gradient
}

/// Information of a window on the shared parameters, its own ones eliminated (Schur's complement).
#[derive(Debug)]
pub struct ReducedInformation {
    pub shared: DMatrix<f64>,
    own: Cholesky<f64, Dyn>,
    /// Change of the own parameters against that of the shared ones.
    following: DMatrix<f64>,
}

impl ReducedInformation {
    /// Eliminates a window's own parameters. `None` if they are not determined.
    pub fn of(all: &DMatrix<f64>) -> Option<ReducedInformation> {
        let own = Cholesky::new(all.view((0, 0), (LOCAL, LOCAL)).into_owned())?;
        let cross = all.view((0, LOCAL), (LOCAL, PARAMETERS));
        let following = own.solve(&cross);
        let shared = all.view((LOCAL, LOCAL), (PARAMETERS, PARAMETERS));
        Some(ReducedInformation {
            shared: shared - cross.tr_mul(&following),
            own,
            following,
        })
    }

    /// Eliminates the own parameters from scores on all, one a column: changes the rows of the shared ones.
    pub fn eliminate(&self, scores: &mut DMatrix<f64>) {
        let (own, mut shared) = scores.rows_range_pair_mut(0..LOCAL, LOCAL..ALL);
        // Products with a transposed matrix are dots, element by element.
        let followed = self.following.transpose();
        shared.gemm(-1.0, &followed, &own, 1.0);
    }

    /// Gradient on the shared parameters, from that on all.
    pub fn gradient(&self, all: &DVector<f64>) -> DVector<f64> {
        all.rows(LOCAL, PARAMETERS) - self.following.tr_mul(&all.rows(0, LOCAL))
    }

    /// Step of a window's own parameters that follows a step of the shared ones.
    pub fn local_step(&self, gradient: &DVector<f64>, shared_step: &DVector<f64>) -> DVector<f64> {
        self.own.solve(&gradient.rows(0, LOCAL)) - &self.following * shared_step
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
                vector_stride: VECTOR,
                count: values.len() / WIDE,
            };
            rows.add_gram(simd, &[VECTOR; WIDE / VECTOR], self.products, WIDE);
        }
    }
}
