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

/// Most secants by which [`last_above`] narrows its interval; about eight suffice.
const MOST_SECANTS: usize = 30;

/// [`last_that_holds`] for the condition that a falling function is above a limit, with the same end.
/// Secants narrow the interval first, so that few halvings evaluate the function. The function must
/// not rise anywhere, not even by rounding.
#[must_use]
pub fn last_above(
    interval: (f64, f64),
    halvings: usize,
    limit: f64,
    function: impl Fn(f64) -> f64,
) -> (f64, f64) {
    let (low, high) = between_secants(interval, limit, &function);
    let is_above = |x: f64| x <= low || (x < high && function(x) > limit);
    last_that_holds(interval, halvings, is_above)
}

/// Interval, inside the given one, at whose lower end a falling function is above a limit and at
/// whose upper end it is not. An end that is not known to be so is that of the given interval. The
/// method is regula falsi; it halves the weight of an end that stays (Illinois).
fn between_secants(
    (mut low, mut high): (f64, f64),
    limit: f64,
    function: impl Fn(f64) -> f64,
) -> (f64, f64) {
    let (mut above, mut below) = (function(low) - limit, function(high) - limit);
    if !(above > 0.0 && below <= 0.0) {
        return (f64::NEG_INFINITY, f64::INFINITY);
    }
    let mut was_above = None;
    for _ in 0..MOST_SECANTS {
        let place = low + (high - low) * (above / (above - below));
        if !(low < place && place < high) {
            break;
        }
        let excess = function(place) - limit;
        let is_above = excess > 0.0;
        let stays = was_above == Some(is_above);
        was_above = Some(is_above);
        if is_above {
            (low, above) = (place, excess);
            below *= if stays { 0.5 } else { 1.0 };
        } else {
            (high, below) = (place, excess);
            above *= if stays { 0.5 } else { 1.0 };
        }
    }
    (low, high)
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
    fn secants_lead_to_the_end_of_the_halvings_with_fewer_evaluations() {
        for squares in [[1.0, 4.0, 9.0], [1e-6, 2e-6, 3e-6], [1.2, 1.1, 0.9]] {
            for limit in [0.1, 1.0, 2.0] {
                let terms = || squares.iter().zip([1.0, 0.5, 1e-7]);
                let function = |x: f64| terms().map(|(r, v)| (r / (v + x)).min(2.25)).sum::<f64>();
                let interval = (0.0, squares.iter().sum::<f64>() / limit);
                let plain = last_that_holds(interval, 200, |x| function(x) > limit);
                let count = std::cell::Cell::new(0);
                let counted = |x| {
                    count.set(count.get() + 1);
                    function(x)
                };
                assert_eq!(last_above(interval, 200, limit, counted), plain);
                assert!(count.get() < 40, "{}", count.get());
            }
        }
    }

    #[test]
    fn an_undefined_condition_ends_the_search() {
        assert_eq!(try_last_that_holds((0.0, 1.0), 5, |_| None), None);
    }
}
