//! Swings of a signal: from one extreme to the next, by more than the smallest step. Unlike steps
//! they need not be fast, so a slow sine has them as well as a pulse.

/// Fraction of the way between two extremes that a swing excludes at either end. Near an extreme
/// the signal is flat, and noise would determine the swing's times.
const NEAR_EXTREME: f64 = 0.25;

/// One swing: the times at which the signal has left the first extreme and has come near the
/// second (by [`NEAR_EXTREME`]), s or samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::segment) struct Swing {
    pub from_s: f64,
    pub to_s: f64,
}

impl Swing {
    pub fn middle_s(&self) -> f64 {
        f64::midpoint(self.from_s, self.to_s)
    }
}

/// Finds the swings of a signal beyond a size, times in samples.
///
/// Missing samples are skipped. The median of three neighbours takes out a lone spike.
pub(in crate::segment) fn swings(values: &[f64], size: f64) -> Vec<Swing> {
    let finite: Vec<(usize, f64)> = values
        .iter()
        .copied()
        .enumerate()
        .filter(|(_, v)| v.is_finite())
        .collect();
    let smooth: Vec<(usize, f64)> = finite
        .windows(3)
        .map(|w| (w[1].0, median_of_three(w[0].1, w[1].1, w[2].1)))
        .collect();
    let extremes = extremes(&smooth, size);
    let pairs = extremes.windows(2);
    pairs
        .filter_map(|pair| smooth.get(pair[0]..=pair[1]).and_then(swing_between))
        .collect()
}

fn median_of_three(a: f64, b: f64, c: f64) -> f64 {
    a.min(b).max(a.max(b).min(c))
}

/// Direction in which a signal has moved by the size of a swing.
#[derive(Clone, Copy, PartialEq)]
enum Direction {
    None,
    Rising,
    Falling,
}

/// The indices of samples at which the signal turns, with at least `size` between neighbours.
fn extremes(values: &[(usize, f64)], size: f64) -> Vec<usize> {
    let Some(first) = values.first() else {
        return Vec::new();
    };
    let (mut low, mut high) = ((0, first.1), (0, first.1));
    let mut turns = Vec::new();
    let mut direction = Direction::None;
    for (k, (_, v)) in values.iter().enumerate() {
        if *v > high.1 {
            high = (k, *v);
        }
        if *v < low.1 {
            low = (k, *v);
        }
        if direction != Direction::Falling && high.1 - v >= size {
            turns.push(high.0);
            (direction, low, high) = (Direction::Falling, (k, *v), (k, *v));
        } else if direction != Direction::Rising && v - low.1 >= size {
            turns.push(low.0);
            (direction, low, high) = (Direction::Rising, (k, *v), (k, *v));
        }
    }
    match direction {
        Direction::Rising => turns.push(high.0),
        Direction::Falling => turns.push(low.0),
        Direction::None => {}
    }
    turns
}

/// The swing of the samples from one extreme to the next.
fn swing_between(extremes: &[(usize, f64)]) -> Option<Swing> {
    let (first, last) = (extremes.first()?.1, extremes.last()?.1);
    let share = |v: f64| (v - first) / (last - first);
    let from = extremes
        .iter()
        .rev()
        .find(|(_, v)| share(*v) <= NEAR_EXTREME)?;
    let to = extremes
        .iter()
        .find(|(_, v)| share(*v) >= 1.0 - NEAR_EXTREME)?;
    Some(Swing {
        from_s: from.0 as f64,
        to_s: to.0 as f64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_of_any_period_has_its_half_periods() {
        for period in [20.0, 200.0] {
            let values: Vec<f64> = (0..600)
                .map(|k| 4.0 * (f64::from(k) * std::f64::consts::TAU / period).sin())
                .collect();
            let swings = swings(&values, 3.0);
            assert!(
                (swings.len() as f64 - 1200.0 / period).abs() <= 1.0,
                "{}",
                swings.len()
            );
            for pair in swings.windows(2).skip(1).take(3) {
                assert!(
                    (pair[1].middle_s() - pair[0].middle_s() - period / 2.0).abs() < 0.06 * period,
                    "{pair:?}"
                );
            }
        }
    }

    #[test]
    fn noise_a_spike_and_missing_samples_make_no_swing() {
        let mut values: Vec<f64> = (0..300)
            .map(|k| if k % 2 == 0 { 0.4 } else { -0.4 })
            .collect();
        values[100] = 30.0;
        values[200] = f64::NAN;
        assert_eq!(swings(&values, 3.0), []);
        assert_eq!(swings(&[f64::NAN; 20], 3.0), []);
        assert_eq!(swings(&[], 3.0), []);
    }
}
