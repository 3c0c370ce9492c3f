//! Order statistics: medians, quantiles, and the noise that a median implies.
//!
//! | function | even count | values that are not finite |
//! |---|---|---|
//! | [`median`] | mean of the two middle values | left out |
//! | [`upper_median`] | the larger of the two middle values | left out |
//! | [`upper_median_in_place`] | the larger of the two middle values | ordered: −∞ first, then +∞, then NaN |
//! | [`quantile`] | linear between the two neighbours | left out |
//! | [`quantile_of_sorted`] | linear between the two neighbours | infinite if a neighbour is |
//! | [`upper_median_of_magnitudes`] | the larger of the two middle values | left out |
//! | [`lower_quantile_of_magnitudes`] | the smaller of the two neighbours | left out |
//! | [`trimmed_range`] | | ordered |
//! | [`weighted_median`] | the smaller of the two middle values | ordered |
//!
//! Every function returns `None` for no values. The functions on `_in_place` and `_of_magnitudes` reorder their
//! argument and allocate nothing; they select in linear time. The upper median of many values is one of the
//! values. It needs one selection; the mean of the middle two needs a second pass. Noise estimates
//! over thousands of samples therefore use it. Trends use it for the scatter of the median
//! maneuver. The scatter then belongs to one maneuver and is not the mean of two classes.
//! [`median`] would change the published scatter.

/// Standard deviation of a normal distribution over the median of its absolute deviations: 1/Φ⁻¹(¾).
pub const SIGMA_PER_MAD: f64 = 1.482_602_218_505_602;

/// Median of the finite values; the mean of the two middle ones of an even count.
#[must_use]
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values = finite(values);
    if values.is_empty() {
        return None;
    }
    let (count, middle) = (values.len(), values.len() / 2);
    let (below, upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let upper = *upper;
    let largest_below = below.iter().copied().max_by(f64::total_cmp);
    let lower = largest_below.filter(|_| count % 2 == 0).unwrap_or(upper);
    Some(lower.midpoint(upper))
}

/// Median of the finite values; the larger of the two middle ones of an even count.
#[must_use]
pub fn upper_median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    upper_median_in_place(&mut finite(values))
}

/// Median of all values; the larger of the two middle ones of an even count. Reorders them.
#[must_use]
pub fn upper_median_in_place(values: &mut [f64]) -> Option<f64> {
    select(values, values.len() / 2)
}

/// Smallest value at which the weights of the values up to it are half of all weights, from values with their
/// weights.
#[must_use]
pub fn weighted_median(mut values: Vec<(f64, f64)>) -> Option<f64> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * values.iter().map(|(_, weight)| weight).sum::<f64>();
    let mut sum = 0.0;
    let median = values.into_iter().find(|(_, weight)| {
        sum += weight;
        sum >= half
    });
    median.map(|(value, _)| value)
}

/// Median of counts; the larger of the two middle ones of an even number of counts. Reorders them.
#[must_use]
pub fn upper_median_of_counts(counts: &mut [usize]) -> Option<usize> {
    let middle = counts.len() / 2;
    (!counts.is_empty()).then(|| *counts.select_nth_unstable(middle).1)
}

/// Upper median of the finite values among non-negative ones that are given by their bits. Reorders them.
///
/// Non-negative floats are in the order of their bits, which compare faster than the floats; what
/// is not finite comes last.
#[must_use]
pub fn upper_median_of_magnitudes(bits: &mut [u64]) -> Option<f64> {
    select_magnitude(bits, finite_magnitudes(bits) / 2)
}

/// Quantile of the finite values among non-negative ones that are given by their bits, at a share between 0
/// and 1; the smaller of two neighbours. Reorders them.
#[must_use]
pub fn lower_quantile_of_magnitudes(bits: &mut [u64], share: f64) -> Option<f64> {
    let last = finite_magnitudes(bits).checked_sub(1)?;
    select_magnitude(bits, whole(last as f64 * share))
}

/// Number of finite values among non-negative ones that are given by their bits.
#[must_use]
pub fn finite_magnitudes(bits: &[u64]) -> usize {
    let infinite = f64::INFINITY.to_bits();
    bits.iter().filter(|bits| **bits < infinite).count()
}

/// Quantile of the finite values at a share between 0 and 1, linear between neighbours.
#[must_use]
pub fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values = finite(values);
    let rank = share * values.len().checked_sub(1)? as f64;
    let below = select(&mut values, whole(rank))?;
    let larger = values.get(whole(rank) + 1..).unwrap_or_default();
    let above = larger.iter().copied().min_by(f64::total_cmp);
    Some(below + (above.unwrap_or(below) - below) * rank.fract())
}

/// Quantile of sorted values at a share between 0 and 1, linear between neighbours; infinite if one
/// of them is.
#[must_use]
pub fn quantile_of_sorted(sorted: &[f64], share: f64) -> Option<f64> {
    let rank = share * sorted.len().checked_sub(1)? as f64;
    let below = whole(rank);
    let first = *sorted.get(below)?;
    let second = sorted.get(below + 1).filter(|second| **second > first);
    let step = |second: &f64| (second - first) * rank.fract();
    let is_between = rank.fract() > 0.0;
    Some(first + second.filter(|_| is_between).map_or(0.0, step))
}

/// Largest minus smallest value, after a share of the values is left out at either end.
#[must_use]
pub fn trimmed_range(mut values: Vec<f64>, share: f64) -> Option<f64> {
    let left_out = whole(values.len() as f64 * share);
    let smallest = select(&mut values, left_out)?;
    let largest = values.len().checked_sub(left_out + 1)?;
    Some(select(&mut values, largest)? - smallest)
}

fn finite(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    values.into_iter().filter(|v| v.is_finite()).collect()
}

fn select_magnitude(bits: &mut [u64], rank: usize) -> Option<f64> {
    let is_there = rank < bits.len();
    let magnitude = is_there.then(|| f64::from_bits(*bits.select_nth_unstable(rank).1));
    magnitude.filter(|magnitude| magnitude.is_finite())
}

fn select(values: &mut [f64], rank: usize) -> Option<f64> {
    (rank < values.len()).then(|| *values.select_nth_unstable_by(rank, f64::total_cmp).1)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of a count; a negative one is rank 0"
)]
fn whole(rank: f64) -> usize {
    rank as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const EVEN: [f64; 4] = [4.0, 1.0, 3.0, 2.0];
    const ODD: [f64; 3] = [3.0, 1.0, 2.0];

    #[test]
    fn a_weighted_median_has_half_of_the_weights_on_either_side() {
        let values = vec![(4.0, 1.0), (1.0, 1.0), (2.0, 5.0), (3.0, 1.0)];
        assert_eq!(weighted_median(values), Some(2.0));
        assert_eq!(weighted_median(vec![(2.0, 1.0), (1.0, 1.0)]), Some(1.0));
        assert_eq!(weighted_median(vec![]), None);
    }

    #[test]
    fn medians_of_even_counts_follow_their_rules() {
        assert_eq!(median(EVEN), Some(2.5));
        assert_eq!(upper_median(EVEN), Some(3.0));
        assert_eq!(quantile(EVEN, 0.5), Some(2.5));
        assert_eq!(upper_median_of_counts(&mut [4, 1, 3, 2]), Some(3));
        let mut bits = EVEN.map(f64::to_bits);
        assert_eq!(upper_median_of_magnitudes(&mut bits), Some(3.0));
        assert_eq!(lower_quantile_of_magnitudes(&mut bits, 0.5), Some(2.0));
    }

    #[test]
    fn medians_of_odd_counts_are_the_middle_value() {
        assert_eq!(median(ODD), Some(2.0));
        assert_eq!(upper_median(ODD), Some(2.0));
        let mut bits = ODD.map(f64::to_bits);
        assert_eq!(upper_median_of_magnitudes(&mut bits), Some(2.0));
        assert_eq!(lower_quantile_of_magnitudes(&mut bits, 0.5), Some(2.0));
        assert_eq!(quantile(ODD, 0.5), Some(2.0));
    }

    #[test]
    fn values_that_are_not_finite_are_left_out_or_come_last() {
        let spoiled = [f64::NAN, 1.0, f64::INFINITY, 2.0, 3.0];
        assert_eq!(median(spoiled), Some(2.0));
        assert_eq!(upper_median(spoiled), Some(2.0));
        assert_eq!(quantile(spoiled, 1.0), Some(3.0));
        assert_eq!(upper_median_in_place(&mut spoiled.clone()), Some(3.0));
        let mut bits = spoiled.map(f64::to_bits);
        assert_eq!(upper_median_of_magnitudes(&mut bits), Some(2.0));
        assert_eq!(lower_quantile_of_magnitudes(&mut bits, 1.0), Some(3.0));
        assert_eq!(finite_magnitudes(&bits), 3);
    }

    #[test]
    fn no_values_have_no_order_statistic() {
        assert_eq!(median([f64::NAN]), None);
        assert_eq!(upper_median([]), None);
        assert_eq!(upper_median_in_place(&mut []), None);
        assert_eq!(upper_median_of_counts(&mut []), None);
        assert_eq!(upper_median_of_magnitudes(&mut [f64::NAN.to_bits()]), None);
        assert_eq!(quantile([f64::NAN], 0.5), None);
        assert_eq!(lower_quantile_of_magnitudes(&mut [], 0.5), None);
        assert_eq!(trimmed_range(Vec::new(), 0.02), None);
    }

    #[test]
    fn quantiles_are_linear_between_values() {
        assert_relative_eq!(quantile(ODD, 0.25).expect("a quantile"), 1.5);
        let values: Vec<f64> = (0..100).map(|k| f64::from(37 * k % 101)).collect();
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        for share in [0.0, 0.1, 0.333, 0.75, 0.999, 1.0] {
            let expected = quantile_of_sorted(&sorted, share);
            assert_eq!(quantile(values.clone(), share), expected, "{share}");
        }
    }

    #[test]
    fn a_trimmed_range_leaves_out_a_share_at_either_end() {
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!(trimmed_range(values.clone(), 0.02), Some(95.0));
        assert_eq!(trimmed_range(values, 0.0), Some(99.0));
        assert_eq!(trimmed_range(vec![1.0], 0.5), Some(0.0));
        assert_eq!(trimmed_range(vec![1.0, 2.0], 1.0), None);
    }
}
