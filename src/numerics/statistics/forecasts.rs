//! Stated probabilities beside what came true.

/// Bins of equal width that the stated probabilities are sorted into.
const BINS: usize = 10;

/// Reliability part of the Brier score (Murphy 1973). It is the mean square of a difference over
/// the forecasts. The difference is the mean probability of the forecast's bin less the fraction of
/// the bin that came true.
pub fn reliability(forecasts: &[(f64, bool)]) -> f64 {
    let of_bin = |bin: usize| {
        let [low, high] = [bin, bin + 1].map(|edge| edge as f64 / BINS as f64);
        let is_last = bin + 1 == BINS;
        let own = forecasts
            .iter()
            .filter(move |(p, _)| *p >= low && (*p < high || is_last));
        let difference: f64 = own
            .clone()
            .map(|(p, came_true)| p - f64::from(u8::from(*came_true)))
            .sum();
        difference * difference / own.count().max(1) as f64
    };
    (0..BINS).map(of_bin).sum::<f64>() / forecasts.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forecasts_that_come_true_as_often_as_stated_are_reliable() {
        let true_of_four = |p: f64| [(p, true), (p, false), (p, false), (p, false)];
        assert!(reliability(&true_of_four(0.25)) < 1e-30);
        // A quarter beside a stated half, and a certain success.
        let mut mixed = true_of_four(0.5).to_vec();
        mixed.extend([(1.0, true); 4]);
        assert!((reliability(&mixed) - 0.5 * 0.0625).abs() < 1e-15);
    }
}
