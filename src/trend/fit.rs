//! Weighted least squares of a polynomial in α, its order, and the scatter between maneuvers.
//!
//! Maneuver i has the estimate yᵢ at αᵢ with the bound bᵢ. The model is yᵢ = Σ cⱼ Pⱼ(xᵢ) + maneuver's own deviation +
//! error, with Pⱼ Legendre polynomials of the α range scaled to −1..1, deviations of standard deviation τ, errors of
//! standard deviation bᵢ. Weights are 1/(bᵢ² + τ²). τ² is the value at which the weighted residuals come out as large as
//! their degrees of freedom, Σ r²/(b² + τ²) = n − p (Paule and Mandel 1982), or zero where they are smaller already.
//!
//! One wild estimate must bend neither the trend nor τ: a residual beyond `HUBER` standard deviations counts as if it
//! were just that far (Huber's weights in the fit, his proposal 2 for τ). And no maneuver is trusted beyond a share
//! `BOUND_FLOOR` of the group's median bound: bounds are themselves only known to a factor of a few.
//!
//! The order is chosen by a criterion, and choosing is uncertain too: the orders that were not chosen count in the
//! variance with their Akaike weights, exp(−Δ/2) (Burnham and Anderson's unconditional variance), each with its own
//! variance and its distance from the chosen trend.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::{Criterion, Settings};

/// Standard deviations beyond which a residual pulls no harder than there: Huber's weights. The fit then bears a quarter
/// of wild estimates, and costs 4% of efficiency where there are none.
const HUBER: f64 = 1.5;
/// The mean of min(u², `HUBER`²) for standard normal u, which takes the place of one in the equation for τ².
const HUBER_VARIANCE: f64 = 0.778_465;
/// Standard deviations beyond which a residual says nothing about the order of the polynomial.
const WILD: f64 = 3.0;
/// No bound is taken as smaller than this share of the median bound.
const BOUND_FLOOR: f64 = 0.25;
/// Steps of the iteration between coefficients, τ² and Huber's weights; it settles in about ten.
const MOST_STEPS: usize = 100;

/// One maneuver's estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub alpha_deg: f64,
    pub value: f64,
    pub bound: f64,
}

impl Point {
    pub(super) fn key(&self) -> (f64, f64, f64) {
        (self.alpha_deg, self.value, self.bound)
    }
}

/// A fitted trend.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    range: (f64, f64),
    coefficients: DVector<f64>,
    covariance: DMatrix<f64>,
    scatter2: f64,
    degrees_of_freedom: usize,
    criterion: f64,
}

/// The trend of the order that the criterion likes best, with the other orders' doubts about it.
#[derive(Clone, Debug)]
pub(super) struct Trend {
    pub best: Fit,
    /// Every order with its Akaike weight; the weights sum to one.
    orders: Vec<(f64, Fit)>,
}

impl Trend {
    /// The trend through points sorted by α: the lower order on a tie, none where no order has a solution.
    pub(super) fn through(points: &[Point], settings: &Settings) -> Option<Trend> {
        let fits = Fit::all(points, settings);
        let best = fits.iter().reduce(|best, next| if next.criterion < best.criterion { next } else { best })?.clone();
        let likelihood = |fit: &Fit| (0.5 * (best.criterion - fit.criterion)).exp();
        let total: f64 = fits.iter().map(likelihood).sum();
        Some(Trend { orders: fits.iter().map(|fit| (likelihood(fit) / total, fit.clone())).collect(), best })
    }

    /// Value and standard error at an angle of attack.
    pub(super) fn at(&self, alpha_deg: f64) -> (f64, f64) {
        let (value, _) = self.best.at(alpha_deg);
        let variance = |(weight, fit): &(f64, Fit)| {
            let (other, error) = fit.at(alpha_deg);
            weight * (error * error + (other - value).powi(2))
        };
        (value, self.orders.iter().map(variance).sum::<f64>().sqrt())
    }
}

impl Fit {
    /// The fits of every order that the data allow. Points are sorted by α.
    ///
    /// At least two degrees of freedom are left to the residuals, and there are no more coefficients than distinct α: with
    /// several maneuvers at each, a trend may run through the middle of every cluster, and must be able to where a
    /// derivative bends between them.
    fn all(points: &[Point], settings: &Settings) -> Vec<Fit> {
        let by_alpha = clusters(points, settings.alpha_step_deg).saturating_sub(1);
        let Some(by_points) = points.len().checked_sub(3) else { return Vec::new() };
        let highest = settings.max_order.min(by_alpha).min(by_points);
        (0..=highest).filter_map(|order| Fit::of_order(points, order, settings.criterion)).collect()
    }

    /// The fit of one order; none where the normal equations have no solution.
    pub(super) fn of_order(points: &[Point], order: usize, criterion: Criterion) -> Option<Fit> {
        let range = (points.first()?.alpha_deg, points.last()?.alpha_deg);
        let (n, p) = (points.len(), order + 1);
        let design = DMatrix::from_rows(&points.iter().map(|q| basis(range, q.alpha_deg, order)).collect::<Vec<_>>());
        let values = DVector::from_iterator(n, points.iter().map(|q| q.value));
        let variances = floored_variances(points);
        let degrees_of_freedom = n.checked_sub(p).filter(|d| *d > 0)?;
        let mut weights = DVector::from_element(n, 1.0);
        let (mut scatter2, mut solution) = (f64::INFINITY, solve(&design, &values, &weights)?);
        for _ in 0..MOST_STEPS {
            let residuals = &values - &design * &solution.0;
            let before = scatter2;
            scatter2 = scatter_squared(&residuals, &variances, degrees_of_freedom);
            weights = DVector::from_iterator(n, (0..n).map(|i| weight(residuals[i], variances[i] + scatter2)));
            let next = solve(&design, &values, &weights)?;
            let moved = (&design * (&next.0 - &solution.0)).amax();
            let smallest = variances.iter().copied().fold(f64::INFINITY, f64::min) + scatter2;
            solution = next;
            if moved <= 1e-6 * smallest.sqrt() && (scatter2 - before).abs() <= 1e-6 * smallest {
                break;
            }
        }
        let residuals = &values - &design * &solution.0;
        let misfit = (0..n).map(|i| deviance(residuals[i], variances[i] + scatter2)).sum::<f64>();
        Some(Fit {
            range,
            coefficients: solution.0,
            covariance: solution.1,
            scatter2,
            degrees_of_freedom,
            criterion: misfit + penalty(criterion, n, p + 1),
        })
    }

    /// Value and standard error at an angle of attack.
    pub(super) fn at(&self, alpha_deg: f64) -> (f64, f64) {
        let row = basis(self.range, alpha_deg, self.order());
        let variance = (&row * &self.covariance * row.transpose())[(0, 0)];
        ((&row * &self.coefficients)[(0, 0)], variance.max(0.0).sqrt())
    }

    pub(super) fn order(&self) -> usize {
        self.coefficients.len() - 1
    }

    /// τ.
    pub(super) fn scatter(&self) -> f64 {
        self.scatter2.sqrt()
    }

    /// The half width of the 95% band in standard errors: Student's t with the residuals' degrees of freedom.
    pub(super) fn quantile_95(&self) -> f64 {
        StudentsT::new(0.0, 1.0, self.degrees_of_freedom as f64).map_or(f64::NAN, |t| t.inverse_cdf(0.975))
    }
}

/// How many distinct α there are: a new one begins half a step of the published grid beyond the last one's beginning.
fn clusters(points: &[Point], step_deg: f64) -> usize {
    let (mut n, mut begin) = (0, f64::NEG_INFINITY);
    for p in points {
        if p.alpha_deg - begin > 0.5 * step_deg {
            n += 1;
            begin = p.alpha_deg;
        }
    }
    n
}

/// The Legendre polynomials up to an order at one α of a range.
fn basis((low, high): (f64, f64), alpha_deg: f64, order: usize) -> nalgebra::RowDVector<f64> {
    let x = if high > low { (2.0 * alpha_deg - low - high) / (high - low) } else { 0.0 };
    let mut p = vec![1.0, x];
    for j in 1..order {
        let n = j as f64;
        p.push(((2.0 * n + 1.0) * x * p[j] - n * p[j - 1]) / (n + 1.0));
    }
    nalgebra::RowDVector::from_iterator(order + 1, p.into_iter().take(order + 1))
}

/// Bounds squared, none smaller than the floor.
fn floored_variances(points: &[Point]) -> Vec<f64> {
    let mut bounds: Vec<f64> = points.iter().map(|p| p.bound).collect();
    bounds.sort_by(f64::total_cmp);
    let floor = BOUND_FLOOR * bounds.get(bounds.len() / 2).copied().unwrap_or(0.0);
    points.iter().map(|p| p.bound.max(floor).powi(2)).collect()
}

/// Coefficients and their covariance for given weights.
fn solve(design: &DMatrix<f64>, values: &DVector<f64>, weights: &DVector<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let weighted = DMatrix::from_fn(design.nrows(), design.ncols(), |i, j| weights[i] * design[(i, j)]);
    let normal = weighted.transpose() * design;
    let cholesky = normal.cholesky()?;
    Some((cholesky.solve(&(weighted.transpose() * values)), cholesky.inverse()))
}

/// One over the variance, less where the residual is wild.
fn weight(residual: f64, variance: f64) -> f64 {
    let u = residual.abs() / variance.sqrt();
    if u > HUBER { HUBER / u / variance } else { 1.0 / variance }
}

/// Minus twice the log-likelihood of one residual; a wild one costs the same however wild it is, so that no order is
/// chosen for coming nearer to it.
fn deviance(residual: f64, variance: f64) -> f64 {
    variance.ln() + (residual * residual / variance).min(WILD * WILD)
}

/// What `k` parameters fitted to `n` data cost.
fn penalty(criterion: Criterion, n: usize, k: usize) -> f64 {
    let (n, k) = (n as f64, k as f64);
    match criterion {
        Criterion::Aicc if n - k - 1.0 > 0.0 => 2.0 * k * n / (n - k - 1.0),
        Criterion::Aicc => f64::INFINITY,
        Criterion::Bic => k * n.ln(),
    }
}

/// τ²: where the sum of squared residuals over their variances, wild ones cut, is what its degrees of freedom expect.
/// The sum falls as τ² grows, so bisection finds it.
fn scatter_squared(residuals: &DVector<f64>, variances: &[f64], degrees_of_freedom: usize) -> f64 {
    let expected = HUBER_VARIANCE * degrees_of_freedom as f64;
    let sum = |scatter2: f64| -> f64 {
        residuals.iter().zip(variances).map(|(r, v)| (r * r / (v + scatter2)).min(HUBER * HUBER)).sum()
    };
    if sum(0.0) <= expected {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, residuals.norm_squared() / expected);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if sum(middle) > expected { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn points(of: impl Fn(f64) -> f64, alphas: &[f64]) -> Vec<Point> {
        alphas.iter().map(|&a| Point { alpha_deg: a, value: of(a), bound: 0.01 }).collect()
    }

    fn alphas() -> Vec<f64> {
        (0..48).map(|i| 5.0 + 55.0 * f64::from(i) / 47.0).collect()
    }

    #[test]
    fn the_variance_of_cut_normal_residuals_is_that_of_its_integral() {
        let density = |u: f64| (-0.5 * u * u).exp() / std::f64::consts::TAU.sqrt();
        let h = 1e-3;
        let integral: f64 =
            (-8000..8000).map(|i| (f64::from(i) + 0.5) * h).map(|u| (u * u).min(HUBER * HUBER) * density(u) * h).sum();
        assert_relative_eq!(integral, HUBER_VARIANCE, max_relative = 1e-5);
    }

    #[test]
    fn a_polynomial_s_order_and_values_are_recovered() {
        let cubic = |a: f64| 0.3 - 0.02 * a + 4e-4 * a * a - 5e-6 * a * a * a;
        // A deterministic ripple of the bounds' size stands for noise.
        let mut data = points(cubic, &alphas());
        for (i, p) in data.iter_mut().enumerate() {
            p.value += 0.01 * [1.1, -0.7, 0.2, -1.3, 0.9, -0.2][i % 6];
        }
        for criterion in [Criterion::Aicc, Criterion::Bic] {
            let fit = Trend::through(&data, &Settings { criterion, ..Settings::default() }).expect("a fit");
            assert_eq!(fit.best.order(), 3);
            for a in [5.0, 20.0, 40.0, 60.0] {
                assert_relative_eq!(fit.at(a).0, cubic(a), epsilon = 0.01);
            }
        }
    }

    #[test]
    fn order_zero_is_the_weighted_mean() {
        let data = [(10.0, 1.0, 0.1), (20.0, 1.1, 0.2), (30.0, 0.95, 0.1), (40.0, 1.05, 0.15)];
        let data = data.map(|(alpha_deg, value, bound)| Point { alpha_deg, value, bound });
        let fit = Fit::of_order(&data, 0, Criterion::Aicc).expect("a fit");
        let sum = |f: &dyn Fn(&Point) -> f64| data.iter().map(f).sum::<f64>();
        let weight = sum(&|p| p.bound.powi(-2));
        assert_relative_eq!(fit.scatter(), 0.0);
        assert_relative_eq!(fit.at(33.0).0, sum(&|p| p.value * p.bound.powi(-2)) / weight, max_relative = 1e-12);
        assert_relative_eq!(fit.at(33.0).1, weight.sqrt().recip(), max_relative = 1e-12);
    }

    #[test]
    fn scatter_between_maneuvers_is_what_the_bounds_leave() {
        // Two levels 0.5 either side of the mean, negligible bounds: τ² = Σ r²/(n − 1), in terms of cut residuals.
        let mut data = points(|_| 1.0, &alphas());
        for (i, p) in data.iter_mut().enumerate() {
            p.value += if i % 2 == 0 { 0.5 } else { -0.5 };
            p.bound = 1e-4;
        }
        let fit = Fit::of_order(&data, 0, Criterion::Aicc).expect("a fit");
        assert_relative_eq!(fit.scatter(), (0.25 * 48.0 / 47.0 / HUBER_VARIANCE).sqrt(), max_relative = 1e-4);
    }

    #[test]
    fn one_wild_estimate_at_the_end_does_not_bend_the_trend() {
        let line = |a: f64| 0.05 + 0.001 * a;
        let mut data = points(line, &alphas());
        for (i, p) in data.iter_mut().enumerate() {
            p.value += if i % 2 == 0 { 0.01 } else { -0.01 };
        }
        let settings = Settings::default();
        let clean = Trend::through(&data, &settings).expect("a fit");
        data.push(Point { alpha_deg: 60.0, value: 5.0, bound: 0.01 });
        let wild = Trend::through(&data, &settings).expect("a fit");
        for a in [10.0, 30.0, 50.0, 60.0] {
            assert_relative_eq!(wild.at(a).0, clean.at(a).0, epsilon = 0.01);
        }
        assert!(wild.best.scatter() < 0.02, "{}", wild.best.scatter());
    }

    #[test]
    fn a_tiny_bound_does_not_dominate() {
        let mut data = points(|_| 1.0, &alphas()[..5]);
        data[0].value = 1.01;
        data[0].bound = 1e-9;
        let fit = Fit::of_order(&data, 0, Criterion::Aicc).expect("a fit");
        assert!(fit.at(10.0).0 < 1.009);
    }

    #[test]
    fn a_bend_between_few_alpha_is_followed() {
        let bent = |a: f64| if a < 15.0 { 0.8 } else { 0.4 };
        let four: Vec<f64> = [10.0, 20.0, 30.0, 40.0].iter().flat_map(|a| [*a, a + 0.1, a + 0.2, a + 0.3]).collect();
        let fit = Trend::through(&points(bent, &four), &Settings::default()).expect("a fit");
        assert!((fit.at(20.0).0 - 0.4).abs() < 0.02, "{}", fit.at(20.0).0);
    }

    #[test]
    fn few_alpha_limit_the_order() {
        let wavy = |a: f64| (a / 3.0).sin();
        let three: Vec<f64> = [10.0, 20.0, 30.0].iter().flat_map(|a| [*a, a + 0.3, a + 0.6, a + 0.9]).collect();
        assert!(Trend::through(&points(wavy, &three), &Settings::default()).expect("a fit").best.order() <= 2);
        let one = [20.0, 20.1, 20.2, 20.3, 20.4];
        assert_eq!(Trend::through(&points(wavy, &one), &Settings::default()).expect("a fit").best.order(), 0);
    }
}
