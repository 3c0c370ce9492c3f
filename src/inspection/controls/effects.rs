//! Effects of inputs on the angular accelerations, by least squares. They determine the signs of
//! surfaces and pilot controls, and the axis on which a surface acts.
//!
//! A draft has no mass or inertia yet, so the response is an acceleration and not a coefficient as
//! in `output_error::likelihood::equation_error`.

use nalgebra::{DMatrix, DVector};

/// Angular accelerations and their regressors, over samples without gaps.
#[derive(Clone, Debug)]
pub struct Regression<'a> {
    /// Angular acceleration of each sample.
    pub response: &'a [f64],
    pub regressors: Vec<&'a [f64]>,
}

/// Coefficient of one regressor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effect {
    pub slope: f64,
    /// Slope over its standard error.
    pub significance: f64,
}

/// Least share of a regressor that earlier regressors leave unexplained. With less it is a copy or
/// mirror image of another, such as the second of two ailerons.
const OWN_SHARE: f64 = 1e-4;

/// Columns of a matrix that are no linear combination of those before them.
fn independent(x: &DMatrix<f64>) -> Vec<usize> {
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let mut kept = Vec::new();
    for (j, column) in x.column_iter().enumerate() {
        let mut rest = column.clone_owned();
        for direction in &basis {
            rest -= direction * direction.dot(&rest);
        }
        let share = rest.norm();
        if share > OWN_SHARE * column.norm() {
            basis.push(rest / share);
            kept.push(j);
        }
    }
    kept
}

/// Effects of all regressors; `None` with too few samples. A regressor that others explain has no
/// effect of its own.
#[must_use]
pub fn effects(regression: &Regression) -> Option<Vec<Effect>> {
    let columns = regression.regressors.len() + 1;
    let row = |k: usize| {
        let mut row = vec![1.0];
        row.extend(regression.regressors.iter().map(|r| r[k]));
        (row, regression.response[k])
    };
    let rows = (0..regression.response.len()).map(row);
    let rows: Vec<(Vec<f64>, f64)> = rows
        .filter(|(row, y)| y.is_finite() && row.iter().all(|x| x.is_finite()))
        .collect();
    let degrees = rows.len().checked_sub(columns).filter(|n| *n > columns)?;
    let x = DMatrix::from_fn(rows.len(), columns, |i, j| rows[i].0[j]);
    let y = DVector::from_fn(rows.len(), |i, _| rows[i].1);
    let scale: Vec<f64> = x
        .column_iter()
        .map(|c| c.norm().max(f64::MIN_POSITIVE))
        .collect();
    let x = DMatrix::from_fn(rows.len(), columns, |i, j| x[(i, j)] / scale[j]);
    let kept = independent(&x);
    let x = x.select_columns(&kept);
    let inverse = (x.transpose() * &x).cholesky()?.inverse();
    let slopes = &inverse * (x.transpose() * &y);
    let variance = (&y - &x * &slopes).norm_squared() / degrees as f64;
    let effect = |j: usize| {
        let place = kept.iter().position(|own| *own == j);
        place.map_or_else(Effect::default, |k| Effect {
            slope: slopes[k] / scale[j],
            significance: slopes[k] / (variance * inverse[(k, k)]).sqrt(),
        })
    };
    Some((1..columns).map(effect).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_of_two_inputs_are_told_apart_with_their_signs() {
        let wave = |w: f64| {
            (0..400)
                .map(|k| (w * f64::from(k)).sin())
                .collect::<Vec<_>>()
        };
        let (a, b, noise) = (wave(0.11), wave(0.07), wave(2.9));
        let response: Vec<f64> = (0..400)
            .map(|k| -3.0 * a[k] + 0.5 * b[k] + 0.1 * noise[k])
            .collect();
        let found = effects(&Regression {
            response: &response,
            regressors: vec![&a, &b],
        })
        .unwrap();
        assert!((found[0].slope + 3.0).abs() < 0.02 && found[0].significance < -100.0);
        assert!((found[1].slope - 0.5).abs() < 0.02 && found[1].significance > 50.0);
        // The mirror image of an input takes nothing from the others.
        let mirror: Vec<f64> = a.iter().map(|v| -v).collect();
        let with_mirror = effects(&Regression {
            response: &response,
            regressors: vec![&a, &mirror, &b],
        })
        .unwrap();
        assert_eq!(with_mirror[1], Effect::default());
        assert!((with_mirror[0].slope - found[0].slope).abs() < 1e-9);
        assert!((with_mirror[2].slope - found[1].slope).abs() < 1e-9);
    }
}
