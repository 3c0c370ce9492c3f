//! Information that the flights since the earlier night gave about each derivative, in nats.
//!
//! Let m₀ and P₀ be mean and covariance of a derivative's posterior at n points, the tunnel's
//! breakpoints, in the earlier night. Let m and P be mean and covariance now. The information is
//! the Kullback-Leibler divergence of the two posteriors,
//!
//! ½ (tr P₀⁻¹P − n + (m − m₀)' P₀⁻¹ (m − m₀) + ln |P₀| − ln |P|).

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::lineage::InformationGain;
use crate::night::published_night::NightTables;
use crate::tables::{CovarianceRow, PosteriorRow};

/// Information about a derivative from which it is listed, nats.
const LEAST_NATS: f64 = 0.1;

/// Flight condition in ten-thousandths of the variables' units.
type PublishedPoint = (i64, Option<i64>, Option<i64>);

/// Posterior of one derivative at the points that both nights have.
struct DerivativePosterior {
    values: DVector<f64>,
    covariance: DMatrix<f64>,
}

/// Rows of a night by derivative.
struct PosteriorRows<'a> {
    rows: BTreeMap<&'a str, BTreeMap<PublishedPoint, &'a PosteriorRow>>,
    covariances: BTreeMap<&'a str, BTreeMap<(PublishedPoint, PublishedPoint), f64>>,
}

/// Derivatives on which flight added information, the most first.
pub fn information_gains(before: &NightTables, now: &NightTables) -> Vec<InformationGain> {
    let (before, now) = (
        PosteriorRows::of_tables(before),
        PosteriorRows::of_tables(now),
    );
    let names = now.rows.keys();
    let mut all: Vec<InformationGain> = names
        .filter_map(|name| information_gained(name, &before, &now))
        .collect();
    all.sort_by(|a, b| {
        b.nats
            .total_cmp(&a.nats)
            .then_with(|| a.derivative.cmp(&b.derivative))
    });
    all
}

fn information_gained(
    derivative: &str,
    before: &PosteriorRows,
    now: &PosteriorRows,
) -> Option<InformationGain> {
    let (rows_before, rows) = (before.rows.get(derivative)?, now.rows.get(derivative)?);
    let points = rows.keys().filter(|p| rows_before.contains_key(p));
    let points: Vec<PublishedPoint> = points
        .filter(|p| now.has(derivative, **p))
        .copied()
        .collect();
    let nats = divergence(
        &before.posterior(derivative, &points)?,
        &now.posterior(derivative, &points)?,
    )?;
    let pairs = points.iter().map(|p| (rows_before[p], rows[p]));
    let moved = |(was, is): &(&PosteriorRow, &PosteriorRow)| {
        (is.value - was.value).abs() / was.standard_deviation
    };
    let (was, is) = pairs.max_by(|a, b| moved(a).total_cmp(&moved(b)))?;
    (nats >= LEAST_NATS).then(|| InformationGain {
        derivative: derivative.to_owned(),
        nats,
        alpha_deg: is.alpha_deg,
        before: was.value,
        before_deviation: was.standard_deviation,
        now: is.value,
        now_deviation: is.standard_deviation,
    })
}

/// Divergence in nats; `None` if a covariance is not positive definite.
fn divergence(before: &DerivativePosterior, now: &DerivativePosterior) -> Option<f64> {
    let n = before.values.len();
    let root = Cholesky::new(before.covariance.clone())?;
    let own = Cholesky::new(now.covariance.clone())?;
    let change = &now.values - &before.values;
    let log = |c: &Cholesky<f64, nalgebra::Dyn>| {
        let diagonal = c.l_dirty().diagonal();
        2.0 * diagonal.iter().map(|d| d.ln()).sum::<f64>()
    };
    let trace = root.solve(&now.covariance).trace();
    let square = change.dot(&root.solve(&change));
    Some(0.5 * (trace - n as f64 + square + log(&root) - log(&own)))
}

impl<'a> PosteriorRows<'a> {
    fn of_tables(tables: &NightTables<'a>) -> PosteriorRows<'a> {
        let mut night = PosteriorRows {
            rows: BTreeMap::new(),
            covariances: BTreeMap::new(),
        };
        for row in tables.posterior {
            let own = night.rows.entry(&row.derivative).or_default();
            own.insert(point(row.alpha_deg, row.mach, row.third), row);
        }
        let of_one = tables.covariances.iter().filter(|c| c.first == c.second);
        for row in of_one {
            let (first, second) = points(row);
            let own = night.covariances.entry(&row.first).or_default();
            own.insert((first, second), row.covariance);
            own.insert((second, first), row.covariance);
        }
        night
    }

    /// `true` for a point at which covariances are published.
    fn has(&self, derivative: &str, point: PublishedPoint) -> bool {
        let own = self.covariances.get(derivative);
        own.is_some_and(|own| own.contains_key(&(point, point)))
    }

    fn posterior(
        &self,
        derivative: &str,
        points: &[PublishedPoint],
    ) -> Option<DerivativePosterior> {
        let (rows, own) = (
            self.rows.get(derivative)?,
            self.covariances.get(derivative)?,
        );
        let n = points.len();
        let mut covariance = DMatrix::zeros(n, n);
        for (i, a) in points.iter().enumerate() {
            for (j, b) in points.iter().enumerate() {
                covariance[(i, j)] = *own.get(&(*a, *b))?;
            }
        }
        let values = points.iter().map(|p| rows[p].value);
        Some(DerivativePosterior {
            values: DVector::from_iterator(n, values),
            covariance,
        })
    }
}

fn points(row: &CovarianceRow) -> (PublishedPoint, PublishedPoint) {
    (
        point(row.first_alpha_deg, row.first_mach, row.first_third),
        point(row.second_alpha_deg, row.second_mach, row.second_third),
    )
}

#[expect(clippy::cast_possible_truncation, reason = "variables of tables")]
fn point(alpha_deg: f64, mach: Option<f64>, third: Option<f64>) -> PublishedPoint {
    let rounded = |v: f64| (v * 1e4).round() as i64;
    (rounded(alpha_deg), mach.map(rounded), third.map(rounded))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn posterior(values: &[f64], covariance: &[f64]) -> DerivativePosterior {
        let n = values.len();
        DerivativePosterior {
            values: DVector::from_column_slice(values),
            covariance: DMatrix::from_row_slice(n, n, covariance),
        }
    }

    #[test]
    fn half_the_deviation_gains_its_logarithm_less_the_gain_by_chance() {
        let (before, now) = (posterior(&[1.0], &[4.0]), posterior(&[1.0], &[1.0]));
        let expected = 2f64.ln() - 0.5 * (1.0 - 0.25);
        assert_relative_eq!(
            divergence(&before, &now).unwrap(),
            expected,
            epsilon = 1e-12
        );
        let moved = posterior(&[3.0], &[1.0]);
        assert_relative_eq!(
            divergence(&before, &moved).unwrap(),
            expected + 0.5,
            epsilon = 1e-12
        );
    }

    #[test]
    fn strongly_correlated_points_count_once() {
        // Two points correlated by 0.999...: the second adds next to nothing.
        let r = 1.0 - 1e-9;
        let before = posterior(&[0.0, 0.0], &[4.0, 4.0 * r, 4.0 * r, 4.0]);
        let s = 1.0 - 4.0 * (1.0 - r);
        let now = posterior(&[0.0, 0.0], &[1.0, s, s, 1.0]);
        let once = divergence(&posterior(&[0.0], &[4.0]), &posterior(&[0.0], &[1.0])).unwrap();
        assert_relative_eq!(divergence(&before, &now).unwrap(), once, epsilon = 1e-6);
    }

    #[test]
    fn equal_posteriors_have_no_divergence() {
        let same = posterior(&[1.0, 2.0], &[2.0, 0.5, 0.5, 1.0]);
        assert_relative_eq!(divergence(&same, &same).unwrap(), 0.0, epsilon = 1e-12);
    }
}
