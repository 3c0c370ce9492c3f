//! The estimation kernel on the standard case, side by side in one run with the plain scalar reference
//! of the same equations, and its distance from the limits of the processor:
//! `cargo bench --bench kernel`.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use criterion::{Criterion, criterion_group, criterion_main};
use harvest::dynamics::{Equations, Longitudinal, OUTPUTS};
use harvest::lab::standard_case;
use harvest::output_error::Detail;
use harvest::output_error::kernel::reference::Reference;
use pulp::{Arch, Simd, WithSimd};

const NX: usize = Longitudinal::STATES.len();

/// Chain of dependent fused multiplications, or independent ones.
struct Fused {
    rounds: usize,
    chained: bool,
}

impl WithSimd for Fused {
    /// Sum, so that the compiler keeps all operations, and the lanes of a vector.
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

/// Duration of one fused multiplication of a vector, s, and its lanes.
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

/// Prints the least duration of a pass by throughput and latency, and its actual one.
#[expect(clippy::print_stdout, reason = "the benchmark's own output")]
fn floors(samples: usize, lanes: usize, pass_s: f64) {
    let (throughput_s, vector) = fused_s(false);
    let (latency_s, _) = fused_s(true);
    // Per lane and sample: regressors of four stages, Φ s, Γ r (one entry in the last stage), and the
    // outputs C s + D r.
    let lane = 4 + NX * NX + 3 * NX + 1 + Longitudinal::OUTPUTS_BY_STATE.len() + 2;
    // Half of the symmetric matrix; the residual is one more lane.
    let squares = OUTPUTS * (lanes + 1) * (lanes + 2) / 2;
    let operations = samples * (lanes * lane + squares);
    let floor_s = operations as f64 / vector as f64 * throughput_s;
    // Chain of a stage: sine and cosine (7 fused multiplications), the rate (4) and the state (1).
    let chain_s = (samples * 4 * 12) as f64 * latency_s;
    println!("{samples} samples, {lanes} lanes, vectors of {vector}");
    println!(
        "fused multiplications of one pass: {operations} ({lane} a lane and sample, {squares} a sample in the sums)"
    );
    println!(
        "throughput floor {:.0} us, latency floor {:.0} us",
        1e6 * floor_s,
        1e6 * chain_s
    );
    println!(
        "a pass takes {:.0} us: {:.1} times the throughput floor",
        1e6 * pass_s,
        pass_s / floor_s
    );
}

fn kernel(c: &mut Criterion) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/standard_case.json");
    let Ok(standard) = standard_case::load(&file) else {
        return;
    };
    let Ok(signals) = standard.signals() else {
        return;
    };
    let (case, model) = (standard.case(&signals), standard.model());
    let (start, weights) = standard.start(&case);
    let mut response = case.response();
    let reference = Reference::new(standard.aircraft(), &signals, &model, &case);
    c.bench_function("one pass, kernel", |b| {
        b.iter(|| case.respond(&start, &mut response));
    });
    c.bench_function("one pass, plain scalar", |b| {
        b.iter(|| reference.run(&start, &weights));
    });
    c.bench_function("one pass, coarse", |b| {
        b.iter(|| case.respond_with(Detail::Coarse, &start, &mut response));
    });
    c.bench_function("sensitivities kept", |b| {
        b.iter(|| case.sensitivities(&start));
    });
    c.bench_function("maneuver prepared", |b| b.iter(|| standard.case(&signals)));
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
