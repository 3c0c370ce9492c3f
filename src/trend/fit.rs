//! Weighted least squares of a polynomial or spline in α, its order, and the scatter between maneuvers.
//!
//! Maneuver i has the estimate yᵢ at αᵢ with the bound bᵢ. The model is yᵢ = Σ cⱼ Pⱼ(αᵢ) + maneuver's own deviation +
//! error, with the functions of [`Basis`], deviations of standard deviation τ, errors of standard deviation bᵢ. Weights are
//! 1/(bᵢ² + τ²). τ² is the value at which the weighted residuals come out as large as their degrees of freedom,
//! Σ r²/(b² + τ²) = n − p (Paule and Mandel 1982), or zero where they are smaller already.
//!
//! One wild estimate must bend neither the trend nor τ: a residual beyond `HUBER` standard deviations counts as if it
//! were just that far (Huber's weights in the fit, his proposal 2 for τ). And no maneuver is trusted beyond a share
//! `BOUND_FLOOR` of the group's median bound: bounds are themselves only known to a factor of a few.
//!
//! The covariance of the coefficients is that of an M-estimate (Huber 1981, section 7.6),
//!
//! K² · [Σψ²(uᵢ)/(n − p)] / m² · (Xᵀ V⁻¹ X)⁻¹, K = 1 + (p/n)(1 − m)/m,
//!
//! with u the residuals over their standard deviations, ψ cutting them at `HUBER`, m the share that is not cut and
//! V = b² + τ². The bracket is what makes few data honest: it scales by the residuals as they are, not by what bounds and
//! τ say they should be, and the interval takes Student's t with n − p degrees of freedom (Hartung and Knapp 2001). It is
//! never smaller than what the bounds alone say.
//!
//! The order is chosen by a criterion, and choosing is uncertain too: the orders that were not chosen count in the
//! variance with their Akaike weights, exp(−Δ/2) (Burnham and Anderson's unconditional variance), each with its own
//! variance and its distance from the chosen trend. And a criterion smooths: it leaves a bias as large as the errors. So no
//! standard error is smaller than that of one coefficient more (undersmoothing, Hall 1992).

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::basis::Basis;
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
    basis: Basis,
    coefficients: DVector<f64>,
    covariance: DMatrix<f64>,
    /// The covariance if the bounds were all there is.
    of_bounds: DMatrix<f64>,
    scatter2: f64,
    degrees_of_freedom: usize,
    criterion: f64,
    /// Of each point, in its order.
    residuals: Vec<Residual>,
}

/// How one maneuver's estimate lies to the trend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Residual {
    /// Over its standard deviation, with what the estimate itself pulls the trend counted.
    pub z: f64,
    /// What is left of its weight: one, less for a wild one.
    pub share: f64,
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
    pub(super) fn through(points: &[Point], settings: &Settings, knots_deg: &[f64]) -> Option<Trend> {
        let fits = Fit::all(points, settings, knots_deg);
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
        let averaged = self.orders.iter().map(variance).sum::<f64>().sqrt();
        (value, averaged.max(self.error_of_the_next_order(alpha_deg)))
    }

    /// The standard error of the fit with one coefficient more; zero where the data allow none.
    fn error_of_the_next_order(&self, alpha_deg: f64) -> f64 {
        let size = self.best.basis.size() + 1;
        let next = self.orders.iter().find(|(_, fit)| fit.basis.size() == size);
        next.map_or(0.0, |(_, fit)| fit.at(alpha_deg).1)
    }
}

impl Fit {
    /// The fits of every order that the data allow. Points are sorted by α.
    ///
    /// At least two degrees of freedom are left to the residuals, and there are no more coefficients than distinct α: with
    /// several maneuvers at each, a trend may run through the middle of every cluster, and must be able to where a
    /// derivative bends between them. With knots, polynomials up to the third order compete with the splines.
    fn all(points: &[Point], settings: &Settings, knots_deg: &[f64]) -> Vec<Fit> {
        let (Some(first), Some(last)) = (points.first(), points.last()) else { return Vec::new() };
        let range = (first.alpha_deg, last.alpha_deg);
        let most = clusters(points, settings.alpha_step_deg).min(points.len().saturating_sub(2));
        let highest = if knots_deg.is_empty() { settings.max_order } else { settings.max_order.min(3) };
        let polynomials = (0..=highest).map(|order| Basis::polynomial(range, order));
        let splines = (1..=highest).map(|order| Basis::spline(range, order, knots_deg));
        let bent = splines.filter(|basis| basis.size() > basis.order() + 1);
        let bases = polynomials.chain(bent).filter(|basis| basis.size() <= most);
        bases.filter_map(|basis| Fit::of(points, basis, settings.criterion)).collect()
    }

    /// The fit of one basis; none where the normal equations have no solution.
    pub(super) fn of(points: &[Point], basis: Basis, criterion: Criterion) -> Option<Fit> {
        let (n, p) = (points.len(), basis.size());
        let design = DMatrix::from_rows(&points.iter().map(|q| basis.row(q.alpha_deg)).collect::<Vec<_>>());
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
        let total: Vec<f64> = variances.iter().map(|v| v + scatter2).collect();
        let covariance = robust_covariance(&design, &residuals, &total)?;
        let of_bounds = solve(&design, &values, &DVector::from_iterator(n, variances.iter().map(|v| 1.0 / v)))?.1;
        Some(Fit {
            residuals: standardised(&design, &residuals, &total, &weights, &solution.1),
            basis,
            coefficients: solution.0,
            covariance,
            of_bounds,
            scatter2,
            degrees_of_freedom,
            criterion: misfit + penalty(criterion, n, p + 1),
        })
    }

    /// Value and standard error at an angle of attack.
    pub(super) fn at(&self, alpha_deg: f64) -> (f64, f64) {
        let row = self.basis.row(alpha_deg);
        let variance = |covariance: &DMatrix<f64>| (&row * covariance * row.transpose())[(0, 0)];
        let variance = variance(&self.covariance).max(variance(&self.of_bounds));
        ((&row * &self.coefficients)[(0, 0)], variance.max(0.0).sqrt())
    }

    pub(super) fn basis(&self) -> &Basis {
        &self.basis
    }

    pub(super) fn residuals(&self) -> &[Residual] {
        &self.residuals
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

/// The covariance of an M-estimate's coefficients, by the residuals as they are.
fn robust_covariance(design: &DMatrix<f64>, residuals: &DVector<f64>, variances: &[f64]) -> Option<DMatrix<f64>> {
    let (n, p) = (design.nrows() as f64, design.ncols() as f64);
    let u2 = || residuals.iter().zip(variances).map(|(r, v)| r * r / v);
    let kept = u2().filter(|u2| *u2 <= HUBER * HUBER).count() as f64 / n;
    let cut: f64 = u2().map(|u2| u2.min(HUBER * HUBER)).sum();
    // Most of the residuals beyond the cut: a fit that describes half of its data does not exist.
    let kept = kept.max(0.5);
    let correction = 1.0 + p / n * (1.0 - kept) / kept;
    let scale = correction * correction * cut / (n - p) / (kept * kept);
    let weights = DVector::from_iterator(variances.len(), variances.iter().map(|v| 1.0 / v));
    Some(solve(design, residuals, &weights)?.1 * scale)
}

/// Residuals over their standard deviations: the variance of a residual is less by what the estimate pulls the trend.
fn standardised(
    design: &DMatrix<f64>,
    residuals: &DVector<f64>,
    variances: &[f64],
    weights: &DVector<f64>,
    inverse: &DMatrix<f64>,
) -> Vec<Residual> {
    let of = |i: usize| {
        let row = design.row(i);
        let leverage = weights[i] * (row * inverse * row.transpose())[(0, 0)];
        let left = (1.0 - leverage).max(1e-6);
        Residual { z: residuals[i] / (variances[i] * left).sqrt(), share: weights[i] * variances[i] }
    };
    (0..design.nrows()).map(of).collect()
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

    fn constant(points: &[Point]) -> Option<Fit> {
        let range = (points[0].alpha_deg, points[points.len() - 1].alpha_deg);
        Fit::of(points, Basis::polynomial(range, 0), Criterion::Aicc)
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
            let fit = Trend::through(&data, &Settings { criterion, ..Settings::default() }, &[]).expect("a fit");
            assert_eq!(fit.best.basis().order(), 3);
            for a in [5.0, 20.0, 40.0, 60.0] {
                assert_relative_eq!(fit.at(a).0, cubic(a), epsilon = 0.01);
            }
        }
    }

    #[test]
    fn order_zero_is_the_weighted_mean() {
        let data = [(10.0, 1.0, 0.1), (20.0, 1.1, 0.2), (30.0, 0.95, 0.1), (40.0, 1.05, 0.15)];
        let data = data.map(|(alpha_deg, value, bound)| Point { alpha_deg, value, bound });
        let fit = constant(&data).expect("a fit");
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
        let fit = constant(&data).expect("a fit");
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
        let clean = Trend::through(&data, &settings, &[]).expect("a fit");
        data.push(Point { alpha_deg: 60.0, value: 5.0, bound: 0.01 });
        let wild = Trend::through(&data, &settings, &[]).expect("a fit");
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
        let fit = constant(&data).expect("a fit");
        assert!(fit.at(10.0).0 < 1.009);
    }

    #[test]
    fn a_bend_between_few_alpha_is_followed() {
        let bent = |a: f64| if a < 15.0 { 0.8 } else { 0.4 };
        let four: Vec<f64> = [10.0, 20.0, 30.0, 40.0].iter().flat_map(|a| [*a, a + 0.1, a + 0.2, a + 0.3]).collect();
        let fit = Trend::through(&points(bent, &four), &Settings::default(), &[]).expect("a fit");
        assert!((fit.at(20.0).0 - 0.4).abs() < 0.02, "{}", fit.at(20.0).0);
    }

    #[test]
    fn few_alpha_limit_the_order() {
        let wavy = |a: f64| (a / 3.0).sin();
        let three: Vec<f64> = [10.0, 20.0, 30.0].iter().flat_map(|a| [*a, a + 0.3, a + 0.6, a + 0.9]).collect();
        assert!(
            Trend::through(&points(wavy, &three), &Settings::default(), &[]).expect("a fit").best.basis().order() <= 2
        );
        let one = [20.0, 20.1, 20.2, 20.3, 20.4];
        assert_eq!(
            Trend::through(&points(wavy, &one), &Settings::default(), &[]).expect("a fit").best.basis().order(),
            0
        );
    }
}
