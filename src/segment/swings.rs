//! Swings of a signal: from one extreme to the next, by more than the smallest step. Unlike steps
//! they need not be fast, so a slow sine shows them as well as a pulse does.

/// From one extreme to the other: when the signal has left the first by a quarter of the way, and
/// when it has come within a quarter of the second, s or samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Swing {
    pub from_s: f64,
    pub to_s: f64,
}

impl Swing {
    pub fn middle_s(&self) -> f64 {
        f64::midpoint(self.from_s, self.to_s)
    }
}

/// The swings of a signal beyond a size, times in samples. Missing samples are passed over; a lone
/// spike is taken out by the median of three.
pub(super) fn of_signal(values: &[f64], size: f64) -> Vec<Swing> {
    let finite: Vec<(usize, f64)> = values
        .iter()
        .copied()
        .enumerate()
        .filter(|(_, v)| v.is_finite())
        .collect();
    let smooth: Vec<(usize, f64)> = finite
        .windows(3)
        .map(|w| (w[1].0, middle(w[0].1, w[1].1, w[2].1)))
        .collect();
    let extremes = extremes(&smooth, size);
    let pairs = extremes.windows(2);
    pairs
        .filter_map(|pair| smooth.get(pair[0]..=pair[1]).and_then(swing))
        .collect()
}

fn middle(a: f64, b: f64, c: f64) -> f64 {
    a.min(b).max(a.max(b).min(c))
}

/// The indices of samples at which the signal turns, with at least `size` between neighbours.
fn extremes(values: &[(usize, f64)], size: f64) -> Vec<usize> {
    let Some(first) = values.first() else {
        return Vec::new();
    };
    let (mut low, mut high) = ((0, first.1), (0, first.1));
    let mut turns = Vec::new();
    // 1 while it rises, -1 while it falls, 0 before anything has happened.
    let mut direction = 0;
    for (k, (_, v)) in values.iter().enumerate() {
        if *v > high.1 {
            high = (k, *v);
        }
        if *v < low.1 {
            low = (k, *v);
        }
        if direction >= 0 && high.1 - v >= size {
            turns.push(high.0);
            (direction, low, high) = (-1, (k, *v), (k, *v));
        } else if direction <= 0 && v - low.1 >= size {
            turns.push(low.0);
            (direction, low, high) = (1, (k, *v), (k, *v));
        }
    }
    match direction {
        1 => turns.push(high.0),
        -1 => turns.push(low.0),
        _ => {}
    }
    turns
}

fn swing(part: &[(usize, f64)]) -> Option<Swing> {
    let (first, last) = (part.first()?.1, part.last()?.1);
    let share = |v: f64| (v - first) / (last - first);
    let from = part.iter().rev().find(|(_, v)| share(*v) <= 0.25)?;
    let to = part.iter().find(|(_, v)| share(*v) >= 0.75)?;
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
            let swings = of_signal(&values, 3.0);
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
        assert_eq!(of_signal(&values, 3.0), []);
        assert_eq!(of_signal(&[f64::NAN; 20], 3.0), []);
        assert_eq!(of_signal(&[], 3.0), []);
    }
}
