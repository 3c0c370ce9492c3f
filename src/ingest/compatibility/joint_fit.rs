//! The joint output-error fit: windows that each have their own first state and wind, and share the
//! instruments' errors.
//!
//! Gauss-Newton on J = Σ v²/(2R) + Σ θ²/(2P). The windows' own parameters are eliminated window by
//! window (Schur's complement), so that the work grows with the number of windows and no faster. R
//! is the long-run variance of each window's residuals: coloured noise counts as white noise as
//! strong as its slowest part. P says that instruments are ordinary or, rarely, wrong by any
//! amount: P = size², and size² + θ² (Cauchy's distribution by reweighting) for what is surely
//! larger, so that an error which several instruments could explain is given to one. At the end the
//! data are asked of each parameter as if nothing had been thought of it before, and the one that
//! is surest beyond the ordinary is freed, until none is; what comes out as large as a fault but
//! not as sure as one is thought ordinary again. A delay common to all channels is no error: the
//! mean of the delays, with the weights 1/P, is zero.
#![expect(clippy::inline_always, reason = "compiled for the processor at hand")]

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::error_sizes::ErrorSizes;
use super::parameters::{
    ALL_KINDS, INPUTS, INSTRUMENTS, KINDS, Kind, OUTPUTS, PARAMETERS, observable, place,
};
use super::reconstruction::{LOCAL, Local, ROW, Row, Sink, WIDE, respond, shared_place};
use super::settings::Compatibility;
use super::window::{Window, factor, margin};
use crate::aircraft::Aircraft;
use crate::numerics::row_products::StridedRows;
use crate::numerics::simd::{AlignedBuffer, VECTOR};
use crate::numerics::student;
use crate::output_error::coloured;

/// Rounds of re-estimating R and P, and steps within each.
const ROUNDS: usize = 6;
const STEPS: usize = 2;
const HALVINGS: usize = 5;
/// Settled when no parameter moves by more than this share of its bound.
const SETTLED: f64 = 0.05;
/// The equations themselves are held to be no better than this: gravity, arms and positions are not
/// known more closely.
pub const MODEL_SCALE: f64 = 0.002;
/// A parameter is surely larger than ordinary when it is this many times its bound; one that is to
/// be freed at the end is so by itself, and needs more.
const SURELY: f64 = 3.0;
const FREED: f64 = 4.0;
/// So many at most.
const MOST_FREED: usize = 4;
/// The first round thinks every fault as likely as not: this many times the least size of one.
const BROAD: f64 = 2.0;
/// What the equations do not explain of a vane's motion is gusts, and the aircraft turns into a
/// gust: as much of it as this goes with the motion that they do explain, and is taken for a scale
/// error.
const ANSWERED: f64 = 0.5;
/// How closely the mean of the delays is held at zero, s.
const COMMON_DELAY_S: f64 = 1e-4;

/// The errors that the windows agree on.
#[derive(Clone, Debug)]
pub struct Errors {
    pub values: [f64; PARAMETERS],
    /// Standard deviations; none for what nothing determines.
    pub bounds: [f64; PARAMETERS],
    /// What a fault is to be measured against: the bounds, and of an output's scale what gusts may
    /// make of it.
    pub fault_bounds: [f64; PARAMETERS],
    /// What was thought of each before (√P).
    pub prior: [f64; PARAMETERS],
}

/// Sums over one window: information and gradient, local and shared.
#[derive(Clone, Debug)]
struct Sums {
    ll: DMatrix<f64>,
    ls: DMatrix<f64>,
    ss: DMatrix<f64>,
    gl: DVector<f64>,
    gs: DVector<f64>,
    cost: f64,
}

/// Sums of one output with unit weight: of its rows (s, v) Σ of their squares, row by row; the
/// lower triangle counts.
struct Raw(AlignedBuffer);

impl Raw {
    fn information(&self, i: usize, j: usize) -> f64 {
        self.0.slice()[i.max(j) * WIDE + i.min(j)]
    }

    fn gradient(&self, i: usize) -> f64 {
        self.information(RESIDUAL, i)
    }

    fn square(&self) -> f64 {
        self.information(RESIDUAL, RESIDUAL)
    }
}

/// One window with its own parameters.
struct Member<'a> {
    window: &'a Window,
    local: Local,
    variances: [f64; OUTPUTS],
    /// Of each output, with unit weight.
    raw: Vec<Raw>,
    sums: Sums,
    /// The window's information and gradient on the shared parameters when its own follow.
    reduced: (DMatrix<f64>, DVector<f64>),
    /// Of each output at every sample; NaN where it does not count.
    residuals: [Vec<f64>; OUTPUTS],
}

struct Problem<'a> {
    aircraft: &'a Aircraft,
    margin: usize,
    settings: &'a Compatibility,
    present: [bool; PARAMETERS],
}

/// Fits the windows; none where there are too few that can be followed.
pub fn fit(windows: &[Window], aircraft: &Aircraft, settings: &Compatibility) -> Option<Errors> {
    let step_s = windows.first()?.step_s;
    let problem = Problem {
        aircraft,
        margin: margin(settings, step_s),
        settings,
        present: present(windows),
    };
    let mut shared = [0.0; PARAMETERS];
    let begin = |window| Member::begin(window, &problem, &shared);
    let mut members: Vec<Member> = windows.par_iter().filter_map(begin).collect();
    if members.len() < settings.least_windows {
        return None;
    }
    let mut prior = std::array::from_fn(|j| BROAD * size_of(&settings.faulty, j));
    for round in 0..ROUNDS {
        let steps = problem.settle(&mut members, &mut shared, &prior)?;
        if round > 2 && steps == 1 {
            break;
        }
        if round > 0 {
            prior = problem.prior(&members, &shared, &prior)?;
        }
    }
    for _ in 0..MOST_FREED {
        let Some((j, size)) = problem.surest(&members, &shared, &prior) else {
            break;
        };
        prior[j] = size;
        problem.settle(&mut members, &mut shared, &prior)?;
    }
    let mut bounds = problem.bounds(&members, &shared, &prior, windows)?;
    let doubted = problem.doubted(&shared, &problem.fault_bounds(&members, &bounds), &prior);
    if !doubted.is_empty() {
        for j in doubted {
            prior[j] = size_of(&settings.ordinary, j);
        }
        problem.settle(&mut members, &mut shared, &prior)?;
        bounds = problem.bounds(&members, &shared, &prior, windows)?;
    }
    let fault_bounds = problem.fault_bounds(&members, &bounds);
    Some(Errors {
        values: shared,
        bounds,
        fault_bounds,
        prior,
    })
}

/// How many times larger than the swings of each accelerometer (forward, right, up) those of ω × v
/// are which they are balanced against: a share of these that the model does not know is so much
/// more of the accelerometer's scale.
fn outweighed(windows: &[Window]) -> [f64; 3] {
    let swings = |values: &dyn Fn(&Window, usize) -> f64| {
        let of = |window: &Window| {
            let values: Vec<f64> = (0..window.samples)
                .map(|k| values(window, k))
                .filter(|v| v.is_finite())
                .collect();
            let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
            values.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
        };
        windows.iter().map(of).sum::<f64>()
    };
    std::array::from_fn(|i| {
        let turning = swings(&|w, k| w.turning(k)[i]);
        let felt = swings(&|w, k| factor(3 + i) * w.inputs[3 + i][w.margin + k]);
        if felt > 0.0 {
            (turning / felt).sqrt()
        } else {
            0.0
        }
    })
}

/// The parameters of instruments that are recorded and that the equations say something of.
fn present(windows: &[Window]) -> [bool; PARAMETERS] {
    let recorded = |i: usize| {
        i < INPUTS
            || windows
                .iter()
                .any(|w| w.outputs[i - INPUTS].iter().any(|v| v.is_finite()))
    };
    let mut present = [false; PARAMETERS];
    for i in (0..INSTRUMENTS).filter(|i| recorded(*i)) {
        for kind in ALL_KINDS {
            present[place(i, kind)] = observable(i, kind);
        }
    }
    present
}

fn size_of(sizes: &ErrorSizes, j: usize) -> f64 {
    sizes.of(j / KINDS, ALL_KINDS[j % KINDS])
}

fn total(members: &[Member]) -> DMatrix<f64> {
    members
        .iter()
        .fold(DMatrix::zeros(PARAMETERS, PARAMETERS), |sum, m| {
            sum + &m.reduced.0
        })
}

impl Problem<'_> {
    /// The samples of a window whose outputs are compared: a delay does not reach beyond the ends.
    fn compared(&self, window: &Window) -> Range<usize> {
        self.margin..window.samples.saturating_sub(self.margin)
    }

    /// Steps until the parameters settle, then R anew; how many steps.
    fn settle(
        &self,
        members: &mut [Member],
        shared: &mut [f64; PARAMETERS],
        prior: &[f64; PARAMETERS],
    ) -> Option<usize> {
        let mut steps = 0;
        while steps < STEPS {
            steps += 1;
            if self.step(members, shared, prior)? < SETTLED {
                break;
            }
        }
        members
            .par_iter_mut()
            .for_each(|member| member.reweigh(self));
        Some(steps)
    }

    /// The parameter that the data, if nothing had been thought of it before, most surely put
    /// beyond what is thought of it, and what is to be thought of it then.
    fn surest(
        &self,
        members: &[Member],
        shared: &[f64; PARAMETERS],
        prior: &[f64; PARAMETERS],
    ) -> Option<(usize, f64)> {
        let inverse = self.inverse(&total(members), prior)?;
        let alone = |j: usize| {
            let (variance, ordinary) = (inverse[(j, j)], size_of(&self.settings.ordinary, j));
            let told = 1.0 - variance / (prior[j] * prior[j]);
            let (value, bound) = (shared[j] / told, (variance / told).sqrt());
            let beyond = self.present[j]
                && told > 1e-6
                && prior[j] <= ordinary
                && value.abs() > 2.0 * ordinary;
            (beyond && value.abs() > FREED * bound)
                .then(|| (j, ordinary.hypot(value), value.abs() / bound))
        };
        let surest = (0..PARAMETERS)
            .filter_map(alone)
            .max_by(|a, b| a.2.total_cmp(&b.2));
        surest.map(|(j, size, _)| (j, size))
    }

    /// √P: what is thought of each parameter, seeing what it has come out as.
    fn prior(
        &self,
        members: &[Member],
        shared: &[f64; PARAMETERS],
        before: &[f64; PARAMETERS],
    ) -> Option<[f64; PARAMETERS]> {
        let inverse = self.inverse(&total(members), before)?;
        Some(std::array::from_fn(|j| {
            let ordinary = size_of(&self.settings.ordinary, j);
            let surely = shared[j].abs() > SURELY * inverse[(j, j)].sqrt();
            if surely {
                ordinary.hypot(shared[j])
            } else {
                ordinary
            }
        }))
    }

    /// The weights of the delays in their mean.
    fn common(&self, prior: &[f64; PARAMETERS]) -> [f64; PARAMETERS] {
        let delay = |j: usize| self.present[j] && ALL_KINDS[j % KINDS] == Kind::Delay;
        let weight = |j: usize| {
            if delay(j) {
                1.0 / (prior[j] * prior[j])
            } else {
                0.0
            }
        };
        let sum: f64 = (0..PARAMETERS).map(weight).sum();
        std::array::from_fn(|j| weight(j) / sum / COMMON_DELAY_S)
    }

    /// The gradient of what is thought before, and of the data.
    fn gradient(
        &self,
        members: &[Member],
        shared: &[f64; PARAMETERS],
        prior: &[f64; PARAMETERS],
    ) -> DVector<f64> {
        let common = self.common(prior);
        let mean: f64 = common.iter().zip(shared).map(|(c, v)| c * v).sum();
        let drawn = |j: usize| {
            if self.present[j] {
                shared[j] / (prior[j] * prior[j])
            } else {
                0.0
            }
        };
        members.iter().fold(
            DVector::from_fn(PARAMETERS, |j, _| -drawn(j) - common[j] * mean),
            |g, m| g + &m.reduced.1,
        )
    }

    fn cost(
        &self,
        members: &[Member],
        shared: &[f64; PARAMETERS],
        prior: &[f64; PARAMETERS],
    ) -> f64 {
        let drawn: f64 = shared.iter().zip(prior).map(|(v, p)| (v / p).powi(2)).sum();
        let mean: f64 = self
            .common(prior)
            .iter()
            .zip(shared)
            .map(|(c, v)| c * v)
            .sum();
        members.iter().map(|m| m.sums.cost).sum::<f64>() + drawn + mean * mean
    }

    /// (H + P⁻¹)⁻¹ over what is present; the rest is zero.
    fn inverse(
        &self,
        information: &DMatrix<f64>,
        prior: &[f64; PARAMETERS],
    ) -> Option<DMatrix<f64>> {
        let common = self.common(prior);
        // In units of the prior: a unit diagonal is added.
        let whitened = DMatrix::from_fn(PARAMETERS, PARAMETERS, |i, j| {
            let own = f64::from(u8::from(i == j));
            let together = information[(i, j)] + common[i] * common[j];
            if self.present[i] && self.present[j] {
                together * prior[i] * prior[j] + own
            } else {
                own
            }
        });
        let inverse = Cholesky::new(whitened)?.inverse();
        Some(DMatrix::from_fn(PARAMETERS, PARAMETERS, |i, j| {
            if self.present[i] && self.present[j] {
                inverse[(i, j)] * prior[i] * prior[j]
            } else {
                0.0
            }
        }))
    }

    /// One step of all parameters; the largest move of a shared one over its bound.
    fn step(
        &self,
        members: &mut [Member],
        shared: &mut [f64; PARAMETERS],
        prior: &[f64; PARAMETERS],
    ) -> Option<f64> {
        let inverse = self.inverse(&total(members), prior)?;
        let full = &inverse * self.gradient(members, shared, prior);
        let cost = self.cost(members, shared, prior);
        let mut share = 1.0;
        for _ in 0..=HALVINGS {
            let trial = self.moved(shared, &full, share);
            // In the order of the windows, so that no sum depends on the threads.
            let moved: Option<Vec<Member>> = members
                .par_iter()
                .map(|m| m.moved(self, &trial, &full, share))
                .collect();
            if let Some(moved) = moved
                && self.cost(&moved, &trial, prior) <= cost * (1.0 + 1e-9)
            {
                let over = |j: usize| (trial[j] - shared[j]).abs() / inverse[(j, j)].sqrt();
                let largest = (0..PARAMETERS)
                    .filter(|j| self.present[*j])
                    .map(over)
                    .fold(0.0, f64::max);
                for (member, moved) in members.iter_mut().zip(moved) {
                    *member = moved;
                }
                *shared = trial;
                return Some(largest);
            }
            share *= 0.5;
        }
        Some(0.0)
    }

    /// The shared parameters a share of a step on, kept within sense.
    fn moved(
        &self,
        shared: &[f64; PARAMETERS],
        step: &DVector<f64>,
        share: f64,
    ) -> [f64; PARAMETERS] {
        let longest = self.settings.longest_delay_s;
        std::array::from_fn(|j| {
            let value = shared[j] + share * step[j];
            match ALL_KINDS[j % KINDS] {
                Kind::Delay => value.clamp(-longest, longest),
                Kind::Scale => value.clamp(-0.8, 4.0),
                Kind::Bias => value,
            }
        })
    }

    /// Standard deviations of the shared parameters: of the information or of the scatter between
    /// windows, whichever is larger.
    fn bounds(
        &self,
        members: &[Member],
        shared: &[f64; PARAMETERS],
        prior: &[f64; PARAMETERS],
        windows: &[Window],
    ) -> Option<[f64; PARAMETERS]> {
        let inverse = self.inverse(&total(members), prior)?;
        let jackknife = self.jackknife(members, shared, prior);
        let mut bounds = std::array::from_fn(|j| inverse[(j, j)].max(jackknife[j]).sqrt());
        for (i, outweighed) in outweighed(windows).into_iter().enumerate() {
            let j = place(3 + i, Kind::Scale);
            bounds[j] = bounds[j].hypot(MODEL_SCALE * outweighed);
        }
        Some(bounds)
    }

    /// The bounds with what gusts may make of an output's scale.
    fn fault_bounds(&self, members: &[Member], bounds: &[f64; PARAMETERS]) -> [f64; PARAMETERS] {
        let mut wider = *bounds;
        for o in 0..OUTPUTS {
            let sums = members.iter().map(|m| m.unexplained(self, o));
            let (slow, moved) =
                sums.fold((0.0, 0.0), |(slow, moved), (s, m)| (slow + s, moved + m));
            let j = place(INPUTS + o, Kind::Scale);
            if moved > 0.0 {
                wider[j] = wider[j].hypot(ANSWERED * (slow / moved).sqrt());
            }
        }
        wider
    }

    /// Parameters that came out as large as a fault but, seen by their bounds, not as sure as one:
    /// no ordinary error is that large, so they are thought ordinary after all.
    fn doubted(
        &self,
        shared: &[f64; PARAMETERS],
        bounds: &[f64; PARAMETERS],
        prior: &[f64; PARAMETERS],
    ) -> Vec<usize> {
        let freed =
            |j: &usize| self.present[*j] && prior[*j] > size_of(&self.settings.ordinary, *j);
        let large = |j: &usize| shared[*j].abs() > size_of(&self.settings.faulty, *j);
        let needed = |j: usize| {
            self.settings
                .standard_errors_of_fault(ALL_KINDS[j % KINDS], shared[j])
        };
        let unsure = |j: &usize| shared[*j].abs() <= needed(*j) * bounds[*j];
        (0..PARAMETERS)
            .filter(freed)
            .filter(large)
            .filter(unsure)
            .collect()
    }

    /// Variances of the shared parameters from the scatter between windows: each left out in turn.
    /// Few windows know their scatter badly, so these are larger as Student's intervals are longer.
    fn jackknife(
        &self,
        members: &[Member],
        shared: &[f64; PARAMETERS],
        prior: &[f64; PARAMETERS],
    ) -> [f64; PARAMETERS] {
        let (whole, all) = (total(members), self.gradient(members, shared, prior));
        let without = |m: &Member| {
            Some(self.inverse(&(&whole - &m.reduced.0), prior)? * (&all - &m.reduced.1))
        };
        let left_out: Vec<DVector<f64>> = members.iter().filter_map(without).collect();
        let count = left_out.len() as f64;
        let longer = student::widening_95(count - 1.0).powi(2);
        std::array::from_fn(|j| {
            let mean = left_out.iter().map(|d| d[j]).sum::<f64>() / count.max(1.0);
            longer * left_out.iter().map(|d| (d[j] - mean).powi(2)).sum::<f64>() * (count - 1.0)
                / count.max(1.0)
        })
    }
}

impl<'a> Member<'a> {
    fn begin(
        window: &'a Window,
        problem: &Problem,
        shared: &[f64; PARAMETERS],
    ) -> Option<Member<'a>> {
        let mut local = [0.0; LOCAL];
        local
            .iter_mut()
            .zip(window.start.iter())
            .for_each(|(l, x)| *l = *x);
        // What is believed before residuals are seen.
        let variances =
            std::array::from_fn(|o| problem.settings.ordinary.of(INPUTS + o, Kind::Bias).powi(2));
        Member::at(window, problem, local, variances, shared)
    }

    fn at(
        window: &'a Window,
        problem: &Problem,
        local: Local,
        variances: [f64; OUTPUTS],
        shared: &[f64; PARAMETERS],
    ) -> Option<Member<'a>> {
        let mut summing = Summing::over(window);
        respond(
            window,
            problem.aircraft,
            &local,
            shared,
            problem.compared(window),
            &mut summing,
        )?;
        let (raw, residuals) = summing.finished();
        let (sums, reduced) = (Sums::none(), (DMatrix::zeros(0, 0), DVector::zeros(0)));
        let mut member = Member {
            window,
            local,
            variances,
            raw,
            sums,
            reduced,
            residuals,
        };
        member.weigh(problem);
        Some(member)
    }

    /// This member with its own parameters where they follow the shared ones' step.
    fn moved(
        &self,
        problem: &Problem,
        shared: &[f64; PARAMETERS],
        step: &DVector<f64>,
        share: f64,
    ) -> Option<Member<'a>> {
        let own =
            Cholesky::new(self.sums.ll.clone())?.solve(&(&self.sums.gl - &self.sums.ls * step));
        let local = std::array::from_fn(|i| self.local[i] + share * own[i]);
        Member::at(self.window, problem, local, self.variances, shared)
    }

    /// The outputs' sums together, each with its weight 1/R.
    fn weigh(&mut self, problem: &Problem) {
        let mut sums = Sums::none();
        for (o, raw) in self.raw.iter().enumerate() {
            let weight = 1.0 / self.variances[o];
            sums.cost += weight * raw.square();
            sums.add(o, weight, raw);
        }
        let wind = problem.settings.wind_change_ft_s2;
        for j in LOCAL - 3..LOCAL {
            sums.ll[(j, j)] += 1.0 / (wind * wind);
            sums.gl[j] -= self.local[j] / (wind * wind);
            sums.cost += (self.local[j] / wind).powi(2);
        }
        self.reduced = sums.reduced();
        self.sums = sums;
    }

    /// Of one output: the squares of the slow part of what the equations leave, and of the motion
    /// that they explain.
    fn unexplained(&self, problem: &Problem, o: usize) -> (f64, f64) {
        let measured = &self.window.outputs[o];
        let known = problem
            .compared(self.window)
            .filter(|k| measured[*k].is_finite());
        let both = known.map(|k| (self.residuals[o][k], measured[k] - self.residuals[o][k]));
        let (residuals, values): (Vec<f64>, Vec<f64>) = both.unzip();
        (slow(&residuals), about_mean(&values))
    }

    /// R from the residuals, as strong as their slowest part.
    fn reweigh(&mut self, problem: &Problem) {
        let range = problem.compared(self.window);
        for o in 0..OUTPUTS {
            let residuals = self.residuals[o].get(range.clone()).unwrap_or_default();
            let floor = 1e-3 * problem.settings.ordinary.of(INPUTS + o, Kind::Bias);
            let level = coloured::slow_noise_level(residuals, self.window.step_s);
            self.variances[o] = level.max(floor * floor);
        }
        self.weigh(problem);
    }
}

/// The sum of squares without that of what does not continue from sample to sample.
fn slow(values: &[f64]) -> f64 {
    let noise = values
        .windows(2)
        .map(|w| (w[1] - w[0]).powi(2))
        .sum::<f64>()
        / 2.0;
    (values.iter().map(|v| v * v).sum::<f64>() - noise).max(0.0)
}

fn about_mean(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    values.iter().map(|v| (v - mean).powi(2)).sum()
}

/// Rows of an output that are summed together.
const CHUNK: usize = 16;
/// Where the residual stands in a row.
const RESIDUAL: usize = ROW;

/// Sums what a window's outputs leave, chunk by chunk.
struct Summing<'a> {
    measured: &'a [Vec<f64>; OUTPUTS],
    residuals: [Vec<f64>; OUTPUTS],
    raw: Vec<Raw>,
    /// Of each output the rows that are not summed yet, and how many.
    rows: AlignedBuffer,
    filled: [usize; OUTPUTS],
}

impl<'a> Summing<'a> {
    fn over(window: &'a Window) -> Summing<'a> {
        Summing {
            measured: &window.outputs,
            residuals: std::array::from_fn(|_| vec![f64::NAN; window.samples]),
            raw: (0..OUTPUTS)
                .map(|_| Raw(AlignedBuffer::zeros(WIDE * WIDE)))
                .collect(),
            rows: AlignedBuffer::zeros(OUTPUTS * CHUNK * WIDE),
            filled: [0; OUTPUTS],
        }
    }

    #[inline(always)]
    fn sum<S: Simd>(&mut self, simd: S, output: usize) {
        let values = &self.rows.slice()[output * CHUNK * WIDE..];
        let rows = StridedRows {
            values,
            stride: WIDE,
            count: self.filled[output],
        };
        rows.add_gram(
            simd,
            &[VECTOR; WIDE / VECTOR],
            self.raw[output].0.slice_mut(),
            WIDE,
        );
        self.filled[output] = 0;
    }

    /// The sums and the residuals.
    fn finished(mut self) -> (Vec<Raw>, [Vec<f64>; OUTPUTS]) {
        Arch::new().dispatch(Finish(&mut self));
        (self.raw, self.residuals)
    }
}

/// Sums what is left.
struct Finish<'a, 'b>(&'a mut Summing<'b>);

impl WithSimd for Finish<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        (0..OUTPUTS).for_each(|output| self.0.sum(simd, output));
    }
}

impl Sink for Summing<'_> {
    #[inline(always)]
    fn looks_at(&self, sample: usize, output: usize) -> bool {
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
            self.sum(simd, output);
        }
    }
}

impl Sums {
    fn none() -> Sums {
        Sums {
            ll: DMatrix::zeros(LOCAL, LOCAL),
            ls: DMatrix::zeros(LOCAL, PARAMETERS),
            ss: DMatrix::zeros(PARAMETERS, PARAMETERS),
            gl: DVector::zeros(LOCAL),
            gs: DVector::zeros(PARAMETERS),
            cost: 0.0,
        }
    }

    /// Adds what one output has summed.
    fn add(&mut self, o: usize, weight: f64, raw: &Raw) {
        for i in 0..ROW {
            for j in 0..ROW {
                let h = weight * raw.information(i, j);
                match (i < LOCAL, j < LOCAL) {
                    (true, true) => self.ll[(i, j)] += h,
                    (true, false) => self.ls[(i, shared_place(j, o))] += h,
                    (false, true) => {}
                    (false, false) => self.ss[(shared_place(i, o), shared_place(j, o))] += h,
                }
            }
            if i < LOCAL {
                self.gl[i] += weight * raw.gradient(i);
            } else {
                self.gs[shared_place(i, o)] += weight * raw.gradient(i);
            }
        }
    }

    fn reduced(&self) -> (DMatrix<f64>, DVector<f64>) {
        match Cholesky::new(self.ll.clone()) {
            Some(own) => {
                let information = &self.ss - self.ls.transpose() * own.solve(&self.ls);
                (
                    information,
                    &self.gs - self.ls.transpose() * own.solve(&self.gl),
                )
            }
            None => (
                DMatrix::zeros(PARAMETERS, PARAMETERS),
                DVector::zeros(PARAMETERS),
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_from_sample_to_sample_is_no_gust() {
        let noise: Vec<f64> = (0_u64..4000)
            .map(|k| (k * k * 7 % 101) as f64 / 50.0 - 1.0)
            .collect();
        let gust: Vec<f64> = (0..4000).map(|k| (f64::from(k) * 0.03).sin()).collect();
        assert!(
            slow(&noise) < 0.1 * about_mean(&noise),
            "{} of {}",
            slow(&noise),
            about_mean(&noise)
        );
        assert!((slow(&gust) / about_mean(&gust) - 1.0).abs() < 0.01);
    }
}
