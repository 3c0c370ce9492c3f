//! Equal bits for every width of the processor's vectors.

use pulp::Simd;

use super::super::kernel::normal_equations::NormalAccumulator;
use super::*;

/// Outputs, gradient and information of a pass with vectors of a width, as bits.
fn bits<S: Simd, const NX: usize, E: Equations<NX>>(
    simd: S,
    case: &Case<NX, E>,
    at: &[f64],
    stride: usize,
) -> Vec<u64> {
    let mut response = case.response();
    response.sums.clear(stride);
    let mut summing = NormalAccumulator {
        sums: &mut response.sums,
        measurements: &case.measurements,
    };
    simd.vectorize(case.prepare_pass(at, stride, &mut response.outputs, &mut summing))
        .unwrap();
    let sums = super::super::cost::sums(&response, &TABLE);
    let outputs = response.outputs.iter().flatten().copied();
    let numbers = outputs
        .chain(sums.gradient.iter().copied())
        .chain(sums.information.iter().copied());
    numbers.map(f64::to_bits).collect()
}

fn assert_equal_bits<const NX: usize, E: Equations<NX>>() {
    let (mut case, parameters) = case::<NX, E>(&truth(E::AXIS), &biases(E::AXIS));
    measure(&mut case, &parameters, &mut Noise(20_261_130), 0.0);
    for stride in [1, 2, 3] {
        let narrow = bits(pulp::Scalar, &case, &parameters, stride);
        assert!(narrow.iter().all(|bits| f64::from_bits(*bits).is_finite()));
        #[cfg(target_arch = "x86_64")]
        {
            if let Some(simd) = pulp::x86::V3::try_new() {
                assert!(
                    bits(simd, &case, &parameters, stride) == narrow,
                    "four lanes, every {stride}"
                );
            }
            if let Some(simd) = pulp::x86::V4::try_new() {
                assert!(
                    bits(simd, &case, &parameters, stride) == narrow,
                    "eight lanes, every {stride}"
                );
            }
        }
    }
}

#[test]
fn a_pass_gives_the_same_bits_with_one_lane_four_and_eight() {
    assert_equal_bits::<3, Longitudinal>();
    assert_equal_bits::<4, Lateral>();
}
