//! Weighted least squares of a polynomial or spline in α, its order, and the scatter between
//! maneuvers.
//!
//! # Symbols
//!
//! Angles are in deg; y, b, τ and λ are in the derivative's unit.
//!
//! | symbol | quantity |
//! |---|---|
//! | n, p | number of maneuvers, number of coefficients |
//! | αᵢ, yᵢ, bᵢ | angle of attack, estimate and bound (a standard deviation) of maneuver i |
//! | Pⱼ, cⱼ | function j of the [`Basis`], and its coefficient |
//! | rᵢ | residual of maneuver i: estimate less trend |
//! | τ | standard deviation of the maneuvers' own deviations from the derivative |
//! | hᵢ | leverage: share of an estimate in the trend's value at its own α, from 0 to 1 |
//! | λ | lack of fit: standard deviation of the derivative about a curve of p coefficients |
//!
//! # Weights and scatter
//!
//! An estimate is the trend plus the maneuver's own deviation uᵢ plus its error eᵢ. Their standard
//! deviations are τ and bᵢ:
//!
//! yᵢ = Σ cⱼ Pⱼ(αᵢ) + uᵢ + eᵢ.
//!
//! The weight of an estimate is one over its variance, 1/(bᵢ² + τ²). τ² is chosen so that the
//! weighted sum of squared residuals equals their degrees of freedom (Paule and Mandel 1982):
//!
//! Σ rᵢ²/(bᵢ² + τ²) = Σ (1 − hᵢ).
//!
//! Over all maneuvers the right side is n − p. If the left side is smaller without τ², τ² is zero. A
//! class of at least `OWN_SCATTER` maneuvers has a τ of its own. A class with wrong values, for
//! example because of a wrong held value, thus does not change the weights of the others.
//!
//! # Outliers and intervals
//!
//! [`RobustSolution`] limits the influence of an outlier on the trend and on τ. A bound below the
//! fraction `BOUND_FLOOR` of the group's median bound is raised to that limit: a bound is itself
//! uncertain by a factor of a few. The 95 % band is Student's t with n − p degrees of freedom times
//! the standard error (Hartung and Knapp 2001). The standard error is never smaller than the one
//! from the bounds alone.
//!
//! # Lack of fit
//!
//! Maneuvers at one flown α differ from each other by their own deviations and errors only. The mean
//! residuals of the flown α differ also by the lack of fit. λ² is the variance of these means that
//! deviations and errors do not explain, by the same equation of Paule and Mandel. More maneuvers do
//! not reduce it, so it is added to the variance of the trend at every α. If no α was flown twice,
//! all scatter beyond the bounds counts as lack of fit.
//!
//! # Order
//!
//! An information criterion chooses the order; the choice is uncertain. The variance is therefore
//! averaged over all orders: each adds its own variance and the square of its distance from the
//! chosen trend. Its share is proportional to exp(−Δ/2), with Δ its criterion less the chosen one's
//! (Burnham and Anderson's unconditional variance). A criterion also prefers smooth curves, which
//! leaves a bias as large as the standard error. No standard error is therefore smaller than that of
//! the fit with one more coefficient (undersmoothing, Hall 1992).

use nalgebra::{DMatrix, DVector};

use super::basis::Basis;
use super::lack_of_fit::LackOfFit;
use super::point::{TrendPoint, flown_alphas};
use super::robust::{Residual, RobustSolution, inverse_variances, weighted_solution};
use super::scatter::{floored_variances, strata};
use super::settings::{Criterion, Settings};
use crate::numerics::statistics::order_statistics::upper_median;
use crate::numerics::statistics::student;

/// Distance from the trend beyond which a residual has no further influence on the choice of the
/// order, standard deviations.
const OUTLYING: f64 = 3.0;

/// A fitted trend.
#[derive(Clone, Debug)]
pub(super) struct TrendFit {
    basis: Basis,
    coefficients: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Covariance from the bounds alone, without scatter.
    covariance_of_bounds: DMatrix<f64>,
    /// Squared lack of fit λ²: variance of the derivative about the curve.
    lack_of_fit2: f64,
    /// Scatter variance τ² of the stratum of each point, in the points' order.
    scatter2: Vec<f64>,
    /// Standard deviation of the estimate of one further maneuver about the derivative: its own
    /// deviation, and an error of the median bound.
    deviation_of_one_more: f64,
    degrees_of_freedom: usize,
    criterion: f64,
    /// Residual of each point, in the points' order.
    residuals: Vec<Residual>,
}

/// The trend of the order that the criterion chooses, with the other orders for its uncertainty.
#[derive(Clone, Debug)]
pub(super) struct Trend {
    pub best: TrendFit,
    /// Every order with its Akaike weight; the weights sum to one.
    orders: Vec<(f64, TrendFit)>,
}

impl Trend {
    /// Fits every order to points sorted by α, and takes the one with the least criterion: the lower
    /// one on a tie. `None` if no order has a solution.
    pub(super) fn through(
        points: &[TrendPoint],
        settings: &Settings,
        knots_deg: &[f64],
    ) -> Option<Trend> {
        let fits = TrendFit::all(points, settings, knots_deg);
        let best = fits
            .iter()
            .reduce(|best, next| {
                if next.criterion < best.criterion {
                    next
                } else {
                    best
                }
            })?
            .clone();
        // With three maneuvers only the mean is allowed, and its AICc is infinite.
        let likelihood = |fit: &TrendFit| {
            if fit.criterion.total_cmp(&best.criterion).is_eq() {
                1.0
            } else {
                (0.5 * (best.criterion - fit.criterion)).exp()
            }
        };
        let total: f64 = fits.iter().map(likelihood).sum();
        Some(Trend {
            orders: fits
                .iter()
                .map(|fit| (likelihood(fit) / total, fit.clone()))
                .collect(),
            best,
        })
    }

    /// Value and standard error at an angle of attack.
    pub(super) fn value_and_error(&self, alpha_deg: f64) -> (f64, f64) {
        let (value, _) = self.best.value_and_error(alpha_deg);
        let variance = |(weight, fit): &(f64, TrendFit)| {
            let (other, error) = fit.value_and_error(alpha_deg);
            weight * (error * error + (other - value).powi(2))
        };
        let averaged = self.orders.iter().map(variance).sum::<f64>().sqrt();
        (value, averaged.max(self.error_of_next_order(alpha_deg)))
    }

    /// The standard error of the fit with one more coefficient; zero if the data allow none.
    fn error_of_next_order(&self, alpha_deg: f64) -> f64 {
        let size = self.best.basis.size() + 1;
        let next = self.orders.iter().find(|(_, fit)| fit.basis.size() == size);
        next.map_or(0.0, |(_, fit)| fit.value_and_error(alpha_deg).1)
    }
}

impl TrendFit {
    /// The fits of every order that the data allow. Points are sorted by α.
    ///
    /// A fit is allowed if at least two degrees of freedom remain for the residuals, and if it has
    /// no more coefficients than flown α. With several maneuvers at each flown α, the curve may
    /// thus pass through the mean at every α. It must do so if the derivative bends between the
    /// flown angles. Candidates are polynomials and splines. With knots from the analyst, both go
    /// up to the third order. Without them the knots are the flown α between the ends: every one or
    /// every second one with straight lines, every second one with cubics.
    fn all(points: &[TrendPoint], settings: &Settings, knots_deg: &[f64]) -> Vec<TrendFit> {
        let (Some(first), Some(last)) = (points.first(), points.last()) else {
            return Vec::new();
        };
        let range = (first.alpha_deg, last.alpha_deg);
        let flown = flown_alphas(points);
        let most = flown.len().min(points.len().saturating_sub(2));
        let highest = if knots_deg.is_empty() {
            settings.max_order
        } else {
            settings.max_order.min(3)
        };
        let polynomials = (0..=highest).map(|order| Basis::polynomial(range, order));
        let splines: Vec<Basis> = if knots_deg.is_empty() {
            let between = flown.get(1..flown.len() - 1).unwrap_or_default();
            let thinned = |every| {
                between
                    .iter()
                    .copied()
                    .skip(every - 1)
                    .step_by(every)
                    .collect::<Vec<f64>>()
            };
            let of = |(order, every)| Basis::spline(range, order, &thinned(every));
            [(1, 1), (1, 2), (3, 2)].map(of).into()
        } else {
            (1..=highest)
                .map(|order| Basis::spline(range, order, knots_deg))
                .collect()
        };
        let bent = splines
            .into_iter()
            .filter(|basis| basis.order() <= highest && basis.size() > basis.order() + 1);
        let bases = polynomials.chain(bent).filter(|basis| basis.size() <= most);
        bases
            .filter_map(|basis| TrendFit::fit_basis(points, basis, settings.criterion))
            .collect()
    }

    /// The fit of one basis; `None` if the normal equations have no solution.
    fn fit_basis(points: &[TrendPoint], basis: Basis, criterion: Criterion) -> Option<TrendFit> {
        let (n, p) = (points.len(), basis.size());
        let rows: Vec<_> = points.iter().map(|q| basis.row(q.alpha_deg)).collect();
        let design = DMatrix::from_rows(&rows);
        let values = DVector::from_iterator(n, points.iter().map(|q| q.value));
        let bounds2 = floored_variances(points);
        let degrees_of_freedom = n.checked_sub(p).filter(|d| *d > 0)?;
        let strata = strata(points);
        let solution = RobustSolution::solve(&design, &values, &bounds2, &strata)?;
        let misfit: f64 = solution.deviations().map(deviance).sum();
        let by_bounds = inverse_variances(&bounds2);
        let lack = LackOfFit::from_residuals(points, &solution.residuals, &bounds2, p);
        let bound2 = upper_median(bounds2.iter().copied()).unwrap_or(0.0);
        let totals = solution.variances.iter().zip(&bounds2);
        Some(TrendFit {
            lack_of_fit2: lack.lack2,
            deviation_of_one_more: (bound2 + lack.own2).sqrt(),
            residuals: solution.standardised(&design),
            basis,
            covariance: solution.covariance(&design)?,
            covariance_of_bounds: weighted_solution(&design, &values, &by_bounds)?.1,
            scatter2: totals.map(|(all, bound)| all - bound).collect(),
            degrees_of_freedom,
            criterion: misfit + penalty(criterion, n, p + strata.len()),
            coefficients: solution.coefficients,
        })
    }

    /// Value and standard error at an angle of attack.
    pub(super) fn value_and_error(&self, alpha_deg: f64) -> (f64, f64) {
        let row = self.basis.row(alpha_deg);
        let variance = |covariance: &DMatrix<f64>| (&row * covariance * row.transpose())[(0, 0)];
        let variance = variance(&self.covariance).max(variance(&self.covariance_of_bounds));
        (
            (&row * &self.coefficients)[(0, 0)],
            (variance.max(0.0) + self.lack_of_fit2).sqrt(),
        )
    }

    pub(super) fn basis(&self) -> &Basis {
        &self.basis
    }

    pub(super) fn residuals(&self) -> &[Residual] {
        &self.residuals
    }

    /// Scatter τ of the median maneuver, in the derivative's unit.
    pub(super) fn scatter(&self) -> f64 {
        upper_median(self.scatter2.iter().copied()).map_or(0.0, f64::sqrt)
    }

    /// Standard deviation of the estimate of one further maneuver about the derivative, without the
    /// error of the trend.
    pub(super) fn deviation_of_one_more(&self) -> f64 {
        self.deviation_of_one_more
    }

    /// The half width of the 95% band in standard errors: Student's t with the residuals' degrees
    /// of freedom.
    pub(super) fn quantile_95(&self) -> f64 {
        student::quantile_95(self.degrees_of_freedom as f64)
    }
}

/// Minus twice the log-likelihood of one residual r of variance v: ln v + r²/v, with r²/v limited to
/// [`OUTLYING`]². An order thus gains nothing by a curve that passes nearer to an outlier.
fn deviance((residual, variance): (f64, f64)) -> f64 {
    variance.ln() + (residual * residual / variance).min(OUTLYING * OUTLYING)
}

/// Penalty of a criterion for `k` parameters fitted to `n` data.
fn penalty(criterion: Criterion, n: usize, k: usize) -> f64 {
    let (n, k) = (n as f64, k as f64);
    match criterion {
        Criterion::Aicc if n - k - 1.0 > 0.0 => 2.0 * k * n / (n - k - 1.0),
        Criterion::Aicc => f64::INFINITY,
        Criterion::Bic => k * n.ln(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::point::count_flown;
    use super::super::scatter::HUBER_VARIANCE;
    use super::*;
    use approx::assert_relative_eq;

    fn points(of: impl Fn(f64) -> f64, alphas: &[f64]) -> Vec<TrendPoint> {
        let mut points: Vec<TrendPoint> = alphas
            .iter()
            .map(|&a| TrendPoint {
                alpha_deg: a,
                value: of(a),
                bound: 0.01,
                class: 0,
                flown: 0,
            })
            .collect();
        count_flown(points.iter_mut(), 5.0);
        points
    }

    fn constant(points: &[TrendPoint]) -> Option<TrendFit> {
        let range = (points[0].alpha_deg, points[points.len() - 1].alpha_deg);
        TrendFit::fit_basis(points, Basis::polynomial(range, 0), Criterion::Aicc)
    }

    fn alphas() -> Vec<f64> {
        (0..48).map(|i| 5.0 + 55.0 * f64::from(i) / 47.0).collect()
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
            let fit = Trend::through(
                &data,
                &Settings {
                    criterion,
                    ..Settings::default()
                },
                &[],
            )
            .expect("a fit");
            assert_eq!(fit.best.basis().order(), 3);
            for a in [5.0, 20.0, 40.0, 60.0] {
                assert_relative_eq!(fit.value_and_error(a).0, cubic(a), epsilon = 0.01);
            }
        }
    }

    #[test]
    fn the_mean_of_three_maneuvers_has_at_least_the_error_that_their_bounds_leave() {
        let data = points(|a| 0.5 + 0.02 * (a / 10.0).sin(), &[10.0, 20.0, 30.0]);
        for criterion in [Criterion::Aicc, Criterion::Bic] {
            let settings = Settings {
                criterion,
                ..Settings::default()
            };
            let trend = Trend::through(&data, &settings, &[]).expect("a trend");
            let weights: Vec<f64> = trend.orders.iter().map(|(weight, _)| *weight).collect();
            assert_eq!(weights, [1.0]);
            let (value, error) = trend.value_and_error(20.0);
            assert!((value - 0.5).abs() < 0.02, "{value}");
            assert!(error >= 0.01 / 3.0_f64.sqrt(), "{error}");
        }
    }

    #[test]
    fn order_zero_is_the_weighted_mean() {
        let data = [
            (10.0, 1.0, 0.1),
            (20.0, 1.1, 0.2),
            (30.0, 0.95, 0.1),
            (40.0, 1.05, 0.15),
        ];
        let mut data = data.map(|(alpha_deg, value, bound)| TrendPoint {
            alpha_deg,
            value,
            bound,
            class: 0,
            flown: 0,
        });
        count_flown(data.iter_mut(), 5.0);
        let fit = constant(&data).expect("a fit");
        let sum = |f: &dyn Fn(&TrendPoint) -> f64| data.iter().map(f).sum::<f64>();
        let weight = sum(&|p| p.bound.powi(-2));
        assert_relative_eq!(fit.scatter(), 0.0);
        assert_relative_eq!(
            fit.value_and_error(33.0).0,
            sum(&|p| p.value * p.bound.powi(-2)) / weight,
            max_relative = 1e-12
        );
        assert_relative_eq!(
            fit.value_and_error(33.0).1,
            weight.sqrt().recip(),
            max_relative = 1e-12
        );
    }

    #[test]
    fn scatter_between_maneuvers_is_what_the_bounds_leave() {
        // Two levels 0.5 either side of the mean, negligible bounds: τ² = Σ r²/(n − 1), in terms of
        // cut residuals.
        let mut data = points(|_| 1.0, &alphas());
        for (i, p) in data.iter_mut().enumerate() {
            p.value += if i % 2 == 0 { 0.5 } else { -0.5 };
            p.bound = 1e-4;
        }
        let fit = constant(&data).expect("a fit");
        assert_relative_eq!(
            fit.scatter(),
            (0.25 * 48.0 / 47.0 / HUBER_VARIANCE).sqrt(),
            max_relative = 1e-4
        );
    }

    /// Pairs of maneuvers at 10, 20, … 50 deg, `apart` from each other.
    fn pairs(of: impl Fn(f64) -> f64, apart: f64) -> Vec<TrendPoint> {
        let alphas: Vec<f64> = (1..=5).flat_map(|i| [10.0 * f64::from(i); 2]).collect();
        let mut data = points(of, &alphas);
        for (i, p) in data.iter_mut().enumerate() {
            p.value += if i % 2 == 0 {
                0.5 * apart
            } else {
                -0.5 * apart
            };
            p.bound = 1e-4;
        }
        data
    }

    #[test]
    fn what_a_curve_misses_is_lack_of_fit_and_what_maneuvers_of_one_alpha_differ_by_is_not() {
        let missed = constant(&pairs(|a| 0.01 * a, 0.02)).expect("a fit");
        // The means are ±0.2, ±0.1, 0 from the constant; pairs leave 2·0.01² with five degrees of freedom.
        let own2 = 10.0 * 0.01_f64.powi(2) / 5.0 / HUBER_VARIANCE;
        let between2 = 0.1 / 4.0 / HUBER_VARIANCE;
        assert_relative_eq!(
            missed.lack_of_fit2,
            between2 - 0.5 * own2,
            max_relative = 1e-3
        );
        let line = TrendFit::fit_basis(
            &pairs(|a| 0.01 * a, 0.02),
            Basis::polynomial((10.0, 50.0), 1),
            Criterion::Aicc,
        );
        assert_relative_eq!(line.expect("a fit").lack_of_fit2, 0.0);
    }

    #[test]
    fn lack_of_fit_widens_the_band_of_the_trend_but_not_that_of_one_more_maneuver_twice() {
        let fit = constant(&pairs(|a| 0.01 * a, 0.02)).expect("a fit");
        let averaged2 = fit.covariance[(0, 0)];
        assert_relative_eq!(
            fit.value_and_error(33.0).1.powi(2),
            averaged2 + fit.lack_of_fit2,
            max_relative = 1e-12
        );
        let own2 = 10.0 * 0.01_f64.powi(2) / 5.0 / HUBER_VARIANCE;
        assert_relative_eq!(
            fit.deviation_of_one_more().powi(2),
            own2,
            max_relative = 1e-3
        );
    }

    #[test]
    fn one_outlier_at_the_end_does_not_bend_the_trend() {
        let line = |a: f64| 0.05 + 0.001 * a;
        let mut data = points(line, &alphas());
        for (i, p) in data.iter_mut().enumerate() {
            p.value += if i % 2 == 0 { 0.01 } else { -0.01 };
        }
        let settings = Settings::default();
        let clean = Trend::through(&data, &settings, &[]).expect("a fit");
        data.push(TrendPoint {
            alpha_deg: 60.0,
            value: 5.0,
            bound: 0.01,
            class: 0,
            flown: 21,
        });
        let wild = Trend::through(&data, &settings, &[]).expect("a fit");
        for a in [10.0, 30.0, 50.0, 60.0] {
            assert_relative_eq!(
                wild.value_and_error(a).0,
                clean.value_and_error(a).0,
                epsilon = 0.01
            );
        }
        assert!(wild.best.scatter() < 0.02, "{}", wild.best.scatter());
    }

    #[test]
    fn a_tiny_bound_does_not_dominate() {
        let mut data = points(|_| 1.0, &alphas()[..5]);
        data[0].value = 1.01;
        data[0].bound = 1e-9;
        let fit = constant(&data).expect("a fit");
        assert!(fit.value_and_error(10.0).0 < 1.009);
    }

    #[test]
    fn a_bend_between_few_alpha_is_followed() {
        let bent = |a: f64| if a < 15.0 { 0.8 } else { 0.4 };
        let four: Vec<f64> = [10.0, 20.0, 30.0, 40.0]
            .iter()
            .flat_map(|a| [*a, a + 0.1, a + 0.2, a + 0.3])
            .collect();
        let fit = Trend::through(&points(bent, &four), &Settings::default(), &[]).expect("a fit");
        assert!(
            (fit.value_and_error(20.0).0 - 0.4).abs() < 0.02,
            "{}",
            fit.value_and_error(20.0).0
        );
    }

    #[test]
    fn few_alpha_limit_the_order() {
        let wavy = |a: f64| (a / 3.0).sin();
        let three: Vec<f64> = [10.0, 20.0, 30.0]
            .iter()
            .flat_map(|a| [*a, a + 0.3, a + 0.6, a + 0.9])
            .collect();
        assert!(
            Trend::through(&points(wavy, &three), &Settings::default(), &[])
                .expect("a fit")
                .best
                .basis()
                .order()
                <= 2
        );
        let one = [20.0, 20.1, 20.2, 20.3, 20.4];
        assert_eq!(
            Trend::through(&points(wavy, &one), &Settings::default(), &[])
                .expect("a fit")
                .best
                .basis()
                .order(),
            0
        );
    }
}
