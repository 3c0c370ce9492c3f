//! Residuals of a fit as white noise: their correlation, cost, and the noise of the samples.

use crate::dynamics::OUTPUTS;
use crate::numerics::series::differences;
use crate::numerics::statistics::order_statistics::median;
use crate::output_error::{Fit, Measurements, Outcome};

/// Correlation of neighbouring residuals above which the air is assumed to move; white residuals of
/// a short maneuver stay below it.
const COLOURED: f64 = 0.3;

/// Standard deviation of an output's white noise, from second differences of the samples that count,
/// which lie several steps apart in a slow channel.
pub(super) fn sample_noise(measurements: &Measurements, output: usize) -> f64 {
    let counted = |k: &usize| measurements.used[*k][output];
    let counted: Vec<usize> = (0..measurements.used.len()).filter(counted).collect();
    let triples = counted.array_windows::<3>();
    let sizes = triples
        .filter(|[before, at, after]| at - before == after - at)
        .map(|triple| differences::second(&triple.map(|k| measurements.values[k][output])).abs());
    differences::noise_of_second(median(sizes).unwrap_or(0.0))
}

/// `true` for a fit by output error whose residuals show no motion of the air.
pub(in crate::estimate) fn is_white(measurements: &Measurements, fit: &Fit) -> bool {
    fit.outcome == Outcome::Converged && are_white(measurements, &fit.response.outputs)
}

/// `true` if the residuals of every output are as white noise.
pub(super) fn are_white(measurements: &Measurements, computed: &[[f64; OUTPUTS]]) -> bool {
    let correlations = lag_one(measurements, computed);
    correlations.iter().all(|r| *r < COLOURED)
}

/// Correlation of neighbouring residuals, output by output.
pub(in crate::estimate) fn lag_one(
    measurements: &Measurements,
    computed: &[[f64; OUTPUTS]],
) -> [f64; OUTPUTS] {
    let residual = |k: usize, o: usize| {
        let (z, y) = (measurements.values.get(k)?, computed.get(k)?);
        measurements.used[k][o].then(|| z[o] - y[o])
    };
    std::array::from_fn(|o| {
        let (mut square, mut product) = (0.0, 0.0);
        for k in 1..measurements.values.len() {
            if let (Some(before), Some(now)) = (residual(k - 1, o), residual(k, o)) {
                square += 0.5 * (before * before + now * now);
                product += before * now;
            }
        }
        if square > 0.0 { product / square } else { 0.0 }
    })
}

/// Largest of the outputs' correlations.
pub(in crate::estimate) fn largest_correlation(values: [f64; OUTPUTS]) -> Option<f64> {
    values.into_iter().reduce(f64::max)
}

/// Cost of output error's residuals as white noise of their own variances.
pub(super) fn white_cost(measurements: &Measurements, fit: &Fit) -> Option<f64> {
    fit.final_cost?;
    let mut cost = 0.0;
    for o in 0..OUTPUTS {
        let pairs = measurements.values.iter().zip(&fit.response.outputs);
        let counted = pairs.zip(&measurements.used).filter(|(_, used)| used[o]);
        let squares: Vec<f64> = counted.map(|((z, y), _)| (z[o] - y[o]).powi(2)).collect();
        if squares.is_empty() {
            continue;
        }
        let count = squares.len() as f64;
        let variance = squares.iter().sum::<f64>() / count;
        cost += 0.5 * count * (variance.ln() + 1.0);
    }
    cost.is_finite().then_some(cost)
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::numerics::statistics::random::RandomStream;

    #[test]
    fn the_noise_of_a_slow_output_is_that_of_its_own_samples() {
        const EVERY: usize = 4;
        let mut random = RandomStream::new(7, "slow output");
        let values = (0..4000).map(|_| [0.3 * random.normal(); OUTPUTS]);
        let mut measurements = Measurements {
            values: values.collect(),
            used: vec![[true; OUTPUTS]; 4000],
        };
        for (k, used) in measurements.used.iter_mut().enumerate() {
            used[1] = k % EVERY == 0;
            used[2] = false;
        }
        let noise = [0, 1, 2].map(|output| sample_noise(&measurements, output));
        assert_relative_eq!(noise[0], 0.3, max_relative = 0.05);
        assert_relative_eq!(noise[1], 0.3, max_relative = 0.1);
        assert!(noise[2] == 0.0, "{}", noise[2]);
    }
}
