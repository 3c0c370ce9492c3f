//! The estimation kernel on the standard case: one pass against a plain scalar one of the same
//! equations, side by side in one run, and its distance from what the processor could do at best:
//! `cargo bench --bench kernel`.
//!
//! The plain one takes each parameter by itself: no vectors, no regressors shared, sums by three
//! nested loops.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use criterion::{Criterion, criterion_group, criterion_main};
use harvest::aero::{Derivative, Regressor};
use harvest::dynamics::motion::Window;
use harvest::dynamics::{COEFFICIENTS, Equations, Longitudinal, Motion, OUTPUTS};
use harvest::lab::standard_case::{self, StandardCase};
use harvest::output_error::Detail;
use nalgebra::SVector;
use pulp::{Arch, Simd, WithSimd};

const NX: usize = 3;
type X = SVector<f64, NX>;

/// The standard case, parameter by parameter.
struct Plain<'a> {
    motion: Vec<Motion>,
    window: &'a Window,
    subject: &'a StandardCase,
    free: Vec<&'a Derivative>,
}

impl Plain<'_> {
    fn regressor(&self, d: &Derivative, point: usize, x: &X) -> f64 {
        let m = &self.motion[point];
        let aircraft = self.subject.aircraft();
        if let Some((state, factor)) =
            Longitudinal::state_regressor(aircraft, m.velocity, &d.regressor)
        {
            return factor * x[state];
        }
        let force = m.qbar * aircraft.wing_area_ft2;
        match &d.regressor {
            Regressor::Surface(name) => self.window.signal(name)[point],
            Regressor::Vane(name) if d.coefficient.is_moment() => {
                self.window.signal(name)[point] / (force * aircraft.chord_ft)
            }
            Regressor::Vane(name) => self.window.signal(name)[point] / force,
            _ => 1.0,
        }
    }

    /// Coefficients, their slopes along the states, and the regressors of the free derivatives.
    fn coefficients(
        &self,
        point: usize,
        values: &[f64],
        x: &X,
    ) -> ([f64; 3], [[f64; NX]; 3], Vec<f64>) {
        let (mut c, mut slopes, mut regressors) =
            ([0.0; COEFFICIENTS], [[0.0; NX]; COEFFICIENTS], vec![]);
        let free = self.free.iter().copied().zip(values.iter().copied());
        let held = self.subject.derivatives().1.iter().map(|(d, v)| (d, *v));
        for (i, (d, value)) in free.chain(held).enumerate() {
            let (k, r) = (d.coefficient.index(), self.regressor(d, point, x));
            c[k] += value * r;
            let along = Longitudinal::state_regressor(
                self.subject.aircraft(),
                self.motion[point].velocity,
                &d.regressor,
            );
            if let Some((state, factor)) = along {
                slopes[k][state] += value * factor;
            }
            if i < self.free.len() {
                regressors.push(r);
            }
        }
        (c, slopes, regressors)
    }

    fn slope(&self, point: usize, values: &[f64], x: &X, s: &[X]) -> (X, Vec<X>) {
        let (c, slopes, regressors) = self.coefficients(point, values, x);
        let known = Longitudinal::known(self.subject.aircraft(), &self.motion[point]);
        let rates = Longitudinal::rates(&known, x, &c);
        let through = nalgebra::SMatrix::<f64, COEFFICIENTS, NX>::from_fn(|k, i| slopes[k][i]);
        let a = rates.by_state + rates.by_coefficient * through;
        let each = self.free.iter().zip(s).zip(&regressors);
        let ds =
            each.map(|((d, s), r)| a * s + rates.by_coefficient.column(d.coefficient.index()) * *r);
        (rates.rates, ds.collect())
    }

    /// Information and gradient for unit weights; biases are left out.
    fn pass(
        &self,
        values: &[f64],
        start: X,
        step_s: f64,
        measured: &[[f64; OUTPUTS]],
    ) -> (Vec<f64>, Vec<f64>) {
        let n = self.free.len();
        let (mut information, mut gradient) = (vec![0.0; n * n], vec![0.0; n]);
        let (mut x, mut s) = (start, vec![X::zeros(); n]);
        for (sample, z) in measured.iter().enumerate() {
            let point = 2 * sample;
            let (c, slopes, regressors) = self.coefficients(point, values, &x);
            let aircraft = self.subject.aircraft();
            let known = Longitudinal::known(aircraft, &self.motion[point]);
            let read = Longitudinal::outputs(
                &known,
                &Longitudinal::sensed(aircraft, &self.motion[point]),
                &x,
                &c,
            );
            let through = nalgebra::SMatrix::<f64, COEFFICIENTS, NX>::from_fn(|k, i| slopes[k][i]);
            let by_state = read.by_state + read.by_coefficient * through;
            for (o, z) in z.iter().enumerate() {
                let row: Vec<f64> = (0..n)
                    .map(|j| {
                        let direct = read.by_coefficient[(o, self.free[j].coefficient.index())]
                            * regressors[j];
                        (by_state.row(o) * s[j])[0] + direct
                    })
                    .collect();
                for i in 0..n {
                    gradient[i] += row[i] * (z - read.outputs[o]);
                    for j in 0..n {
                        information[i * n + j] += row[i] * row[j];
                    }
                }
            }
            if sample + 1 == measured.len() {
                break;
            }
            let ahead = |s: &[X], h: f64, k: &[X]| {
                s.iter().zip(k).map(|(s, k)| s + k * h).collect::<Vec<X>>()
            };
            let (k1, d1) = self.slope(point, values, &x, &s);
            let half = 0.5 * step_s;
            let (k2, d2) = self.slope(point + 1, values, &(x + k1 * half), &ahead(&s, half, &d1));
            let (k3, d3) = self.slope(point + 1, values, &(x + k2 * half), &ahead(&s, half, &d2));
            let (k4, d4) = self.slope(
                point + 2,
                values,
                &(x + k3 * step_s),
                &ahead(&s, step_s, &d3),
            );
            x += (k1 + (k2 + k3) * 2.0 + k4) * (step_s / 6.0);
            for j in 0..n {
                s[j] += (d1[j] + (d2[j] + d3[j]) * 2.0 + d4[j]) * (step_s / 6.0);
            }
        }
        (information, gradient)
    }
}

/// Independent fused multiplications, or ones that wait for each other.
struct Fused {
    rounds: usize,
    chained: bool,
}

impl WithSimd for Fused {
    /// The sum, so that nothing is left out, and the lanes of a vector.
    type Output = (f64, usize);

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "compiled for the processor at hand")]
    fn with_simd<S: Simd>(self, simd: S) -> (f64, usize) {
        let (a, b) = (
            simd.splat_f64s(black_box(0.999)),
            simd.splat_f64s(black_box(1e-3)),
        );
        let mut sums = [simd.splat_f64s(0.0); 12];
        for _ in 0..self.rounds {
            if self.chained {
                for _ in 0..12 {
                    sums[0] = simd.mul_add_f64s(sums[0], a, b);
                }
            } else {
                for sum in &mut sums {
                    *sum = simd.mul_add_f64s(*sum, a, b);
                }
            }
        }
        (
            sums.iter().map(|s| simd.reduce_sum_f64s(*s)).sum(),
            S::F64_LANES,
        )
    }
}

/// Seconds of one fused multiplication of a vector, and its lanes.
fn fused_s(chained: bool) -> (f64, usize) {
    const ROUNDS: usize = 100_000;
    let (mut best, mut lanes) = (f64::INFINITY, 1);
    for _ in 0..100 {
        let begin = Instant::now();
        lanes = black_box(Arch::new().dispatch(Fused {
            rounds: ROUNDS,
            chained,
        }))
        .1;
        best = best.min(begin.elapsed().as_secs_f64());
    }
    (best / (12 * ROUNDS) as f64, lanes)
}

/// Prints what a pass must at least cost, and what it costs.
#[expect(clippy::print_stdout, reason = "the benchmark's own output")]
fn floors(samples: usize, lanes: usize, pass_s: f64) {
    let (throughput_s, vector) = fused_s(false);
    let (latency_s, _) = fused_s(true);
    // Of a lane and sample: its regressor at four stages, Φ s, Γ r (of the last stage one entry),
    // outputs C s + D r.
    let lane = 4 + NX * NX + 3 * NX + 1 + Longitudinal::OUTPUTS_BY_STATE.len() + 2;
    // The residual is a lane more. Half of the symmetric matrix.
    let squares = OUTPUTS * (lanes + 1) * (lanes + 2) / 2;
    let operations = samples * (lanes * lane + squares);
    let floor_s = operations as f64 / vector as f64 * throughput_s;
    // A stage waits for sine and cosine (7 fused multiplications one after the other), the rate (4)
    // and the state (1).
    let waiting_s = (samples * 4 * 12) as f64 * latency_s;
    println!("{samples} samples, {lanes} lanes, vectors of {vector}");
    println!(
        "fused multiplications of one pass: {operations} ({lane} a lane and sample, {squares} a sample in the sums)"
    );
    println!(
        "throughput floor {:.0} us, latency floor {:.0} us",
        1e6 * floor_s,
        1e6 * waiting_s
    );
    println!(
        "a pass takes {:.0} us: {:.1} times the throughput floor",
        1e6 * pass_s,
        pass_s / floor_s
    );
}

fn kernel(c: &mut Criterion) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/standard_case.json");
    let Ok(subject) = standard_case::load(&file) else {
        return;
    };
    let Ok(window) = subject.window() else { return };
    let case = subject.case(&window);
    let (start, _) = subject.start(&case);
    let mut response = case.response();
    let mut free: Vec<&Derivative> = subject.derivatives().0.iter().collect();
    free.sort_by_key(|d| d.coefficient.index());
    let motion: Vec<Motion> = window.motion(subject.aircraft()).points().collect();
    let state = Longitudinal::measured_state(&motion[0]);
    let plain = Plain {
        motion,
        window: &window,
        subject: &subject,
        free,
    };
    c.bench_function("one pass, kernel", |b| {
        b.iter(|| case.respond(&start, &mut response))
    });
    c.bench_function("one pass, plain scalar", |b| {
        b.iter(|| plain.pass(&start, state, window.step_s, &case.measurements.values));
    });
    c.bench_function("one pass, coarse", |b| {
        b.iter(|| case.respond_with(Detail::Coarse, &start, &mut response))
    });
    c.bench_function("sensitivities kept", |b| {
        b.iter(|| case.sensitivities(&start))
    });
    c.bench_function("maneuver laid out", |b| b.iter(|| subject.case(&window)));
    let mut pass_s = f64::INFINITY;
    for _ in 0..1000 {
        let begin = Instant::now();
        let _ = black_box(case.respond(&start, &mut response));
        pass_s = pass_s.min(begin.elapsed().as_secs_f64());
    }
    floors(case.samples(), case.derivatives(), pass_s);
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).measurement_time(std::time::Duration::from_secs(3));
    targets = kernel
}
criterion_main!(benches);
