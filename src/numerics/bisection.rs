//! Bisection: the place in an interval at which a condition ceases to hold.

/// Interval that remains after a number of halvings. The condition must hold up to some place and
/// fail beyond it. It holds at the lower end and fails at the upper end. An end of the given
/// interval that no halving has moved is not tested.
#[must_use]
pub fn last_that_holds(
    interval: (f64, f64),
    halvings: usize,
    holds: impl Fn(f64) -> bool,
) -> (f64, f64) {
    let always = |middle| Some(holds(middle));
    try_last_that_holds(interval, halvings, always).unwrap_or(interval)
}

/// [`last_that_holds`] for a condition that may be undefined at a place; `None` where it is.
#[must_use]
pub fn try_last_that_holds(
    (mut low, mut high): (f64, f64),
    halvings: usize,
    holds: impl Fn(f64) -> Option<bool>,
) -> Option<(f64, f64)> {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        let before = (low, high);
        if holds(middle)? {
            low = middle;
        } else {
            high = middle;
        }
        if (low, high) == before {
            // No number lies between: further halvings would repeat this one.
            break;
        }
    }
    Some((low, high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_halving_halves_the_interval() {
        assert_eq!(last_that_holds((0.0, 8.0), 3, |x| x <= 2.5), (2.0, 3.0));
        assert_eq!(last_that_holds((0.0, 8.0), 0, |x| x <= 2.5), (0.0, 8.0));
    }

    #[test]
    fn the_search_ends_at_neighbours() {
        let (low, high) = last_that_holds((0.0, 4.0), 200, |x| x * x <= 2.0);
        assert_eq!(low.next_up().to_bits(), high.to_bits());
        assert!(low * low <= 2.0 && high * high > 2.0);
    }

    #[test]
    fn an_undefined_condition_ends_the_search() {
        assert_eq!(try_last_that_holds((0.0, 1.0), 5, |_| None), None);
    }
}
