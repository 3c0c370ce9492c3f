//! Parts of the posterior against other ways to compute them.

use approx::assert_relative_eq;
use nalgebra::{Cholesky, DMatrix, DVector};

use super::fixture::{Flown, NAMES, aero_model, diagonal, exact, maneuver, posterior, tunnel};
use crate::aero::wind_tunnel::{self, Third, TunnelPoint};
use crate::aero::{Axis, Coefficient, Condition, WindTunnel};
use crate::maneuver::Maneuver;
use crate::model::fusion::coefficient::Data;
use crate::model::fusion::observed_differences::ObservedDifferences;
use crate::model::fusion::open_scales::add_open_scales;
use crate::model::fusion::posterior::{
    LeaveOneOut, WhitenedInformation, gaussian, information, of_differences,
};
use crate::model::fusion::scales::{
    logarithms_of, most_probable, negative_log_posterior, scales_of,
};
use crate::model::fusion::unknowns::root_of_differences;
use crate::model::prior::scale_prior::Scale;
use crate::model::prior::term::{PosteriorTerm, TermSources};
use crate::model::{ManeuverResults, Settings};
use crate::numerics::linear_algebra::root::EXACT;
use crate::numerics::statistics::random::RandomStream;
use crate::output_error::error_effect::SharedError;

/// Ten maneuvers in four flights, with everything that they can share.
pub fn campaign() -> Vec<Flown> {
    let mut noise = RandomStream::new(5, "campaign");
    (0..10)
        .map(|i| {
            let alpha_deg = 3.7 * f64::from(i) + 1.0;
            let flight = format!("f{}", i % 4);
            let estimates = [
                ("CN_0", 0.1 + 0.02 * noise.normal()),
                ("CN_alpha", 0.05 + 0.004 * noise.normal()),
            ];
            let covariance = diagonal([0.02, 0.003]);
            Flown::new(
                &format!("m{i}"),
                &flight,
                alpha_deg,
                &estimates,
                &covariance,
            )
            .with(SharedError::Held("CN_q".into()), 0.8, &[0.004, -0.002])
            .with(SharedError::Bias("an".into()), 0.01, &[0.006, 0.001])
            .with(SharedError::Delay("de_deg".into()), 0.001, &[0.002, 0.001])
        })
        .collect()
}

/// Terms and data of a campaign.
pub fn data(flown: &[Flown], settings: &Settings) -> (Vec<PosteriorTerm>, Data) {
    let evidence: Vec<ManeuverResults> = flown.iter().map(Flown::evidence).collect();
    let (aero_model, tunnel) = (aero_model(), tunnel(None));
    let basis = TermSources {
        aero_model: &aero_model,
        tunnel: &tunnel,
        settings,
    };
    let terms = basis.terms(Coefficient::CN, &evidence);
    let data = Data::new(&terms, &evidence, &basis);
    (terms, data)
}

pub fn scales() -> Vec<Scale> {
    [(0.2, 12.0), (0.3, 20.0), (0.15, 9.0)]
        .map(|(size, length_deg)| Scale { size, length_deg })
        .to_vec()
}

/// Rows, differences and covariance of all data, dense.
fn dense(data: &Data, weights: &[f64]) -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>) {
    let n = data.flights.iter().map(|f| f.rows.len()).sum();
    let mut rows = DMatrix::zeros(n, data.unknowns.count);
    let mut covariance = DMatrix::zeros(n, n);
    let mut differences = DVector::zeros(n);
    let mut first = 0;
    for flight in &data.flights {
        let own = flight.covariance(weights);
        covariance
            .view_mut((first, first), own.shape())
            .copy_from(&own);
        for (i, row) in flight.rows.iter().enumerate() {
            differences[first + i] = flight.differences[i];
            for (place, value) in row {
                rows[(first + i, *place)] += *value;
            }
        }
        first += flight.rows.len();
    }
    (rows, differences, covariance)
}

#[test]
fn the_normal_equations_give_generalised_least_squares() {
    let flown = campaign();
    let (terms, mut data) = data(&flown, &Settings::default());
    data.set_noise(&terms, &scales());
    let weights = vec![1.0, 0.4, 1.0, 1.0, 1.0, 0.7, 1.0, 1.0, 1.0, 1.0];
    let root = data.unknowns.root(&terms, &scales(), EXACT);
    let found = gaussian(
        &root,
        &information(&data.flights, &weights, data.unknowns.count),
    )
    .unwrap();
    // y ~ N(0, A C Aᵀ + Σ): the mean of the unknowns is C Aᵀ (A C Aᵀ + Σ)⁻¹ y.
    let (rows, differences, covariance) = dense(&data, &weights);
    let transposed = root.transposed();
    let prior = transposed.tr_mul(&transposed);
    let gain = &prior * rows.transpose();
    let inverse = Cholesky::new(&rows * &gain + covariance).unwrap().inverse();
    let mean = &gain * &inverse * differences;
    let rest = &prior - &gain * inverse * gain.transpose();
    let scale = prior.diagonal().map(f64::sqrt);
    for i in 0..data.unknowns.count {
        assert_relative_eq!(found.mean[i], mean[i], epsilon = 1e-9 * scale[i]);
        for j in 0..data.unknowns.count {
            let unit = scale[i] * scale[j];
            assert_relative_eq!(
                found.covariance[(i, j)],
                rest[(i, j)],
                epsilon = 1e-9 * unit
            );
        }
    }
}

/// Information of the data on the differences.
fn observed(terms: &[PosteriorTerm], data: &Data) -> ObservedDifferences {
    let weights: Vec<f64> = data
        .flights
        .iter()
        .flat_map(|f| &f.maneuvers)
        .map(|_| 1.0)
        .collect();
    let sums = information(&data.flights, &weights, data.unknowns.count);
    let own = of_differences(&sums, &data.unknowns).unwrap();
    ObservedDifferences::new(terms, &data.unknowns, &own)
}

#[test]
fn derivatives_over_the_scales_are_those_of_differences() {
    let (terms, data) = data(&campaign(), &Settings::default());
    let observed = observed(&terms, &data);
    assert!(observed.information.vector.len() < data.unknowns.differences);
    let at = logarithms_of(&scales());
    let local =
        |at: &DVector<f64>| negative_log_posterior(&observed, &scales_of(at), EXACT).unwrap();
    let (whole, step) = (local(&at), 1e-5);
    for i in 0..at.len() {
        let off = DVector::from_fn(at.len(), |k, _| if k == i { step } else { 0.0 });
        let (above, below) = (local(&(&at + &off)), local(&(&at - &off)));
        let slope = (above.value - below.value) / (2.0 * step);
        assert_relative_eq!(
            whole.gradient[i],
            slope,
            epsilon = 1e-6,
            max_relative = 1e-6
        );
        let slopes = (above.gradient - below.gradient) / (2.0 * step);
        let own = whole.curvature.column(i).into_owned();
        assert_relative_eq!(own, slopes, epsilon = 1e-6, max_relative = 1e-6);
    }
}

#[test]
fn expected_second_derivatives_are_the_mean_over_data_that_the_scales_predict() {
    let (terms, data) = data(&campaign(), &exact());
    let mut observed = observed(&terms, &data);
    let root = observed.root(&scales(), EXACT);
    // η = Λ f + Λ^½ e of a difference f with its prior's covariance and unit noise e.
    let matrix = observed.information.matrix.clone();
    let eigen = matrix.clone().symmetric_eigen();
    let half = &eigen.eigenvectors
        * DMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0).sqrt()))
        * eigen.eigenvectors.transpose();
    let mut stream = RandomStream::new(3, "scales");
    let mut sum = DMatrix::zeros(6, 6);
    let (mut expected, count) = (DMatrix::zeros(6, 6), 4000);
    for _ in 0..count {
        let difference = root.times(&DVector::from_fn(root.rank(), |_, _| stream.normal()));
        let noise = DVector::from_fn(matrix.nrows(), |_, _| stream.normal());
        observed.information.vector = &matrix * difference + &half * noise;
        let local = negative_log_posterior(&observed, &scales(), EXACT).unwrap();
        sum += local.curvature / f64::from(count);
        expected = local.expected;
    }
    let scale = expected.diagonal().map(f64::sqrt);
    for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
        let unit = scale[i] * scale[j];
        assert_relative_eq!(sum[(i, j)], expected[(i, j)], epsilon = 0.1 * unit);
    }
}

#[test]
fn the_mean_from_observed_differences_is_that_of_all_unknowns() {
    let (terms, data) = data(&campaign(), &Settings::default());
    let weights = vec![1.0; 10];
    let sums = information(&data.flights, &weights, data.unknowns.count);
    let whole = gaussian(&data.unknowns.root(&terms, &scales(), EXACT), &sums).unwrap();
    let mean = observed(&terms, &data).mean(&scales(), EXACT).unwrap();
    assert_eq!(mean.len(), data.unknowns.differences);
    for (i, own) in mean.iter().enumerate() {
        let unit = whole.covariance[(i, i)].sqrt();
        assert_relative_eq!(*own, whole.mean[i], epsilon = 1e-8 * unit);
    }
}

#[test]
fn the_posterior_of_the_observed_unknowns_does_not_depend_on_the_others() {
    let (terms, data) = data(&campaign(), &Settings::default());
    let sums = information(&data.flights, &[1.0; 10], data.unknowns.count);
    let is_observed = |unknown| sums.is_about(unknown);
    let root = data.unknowns.root(&terms, &scales(), EXACT);
    let of_observed = (data.unknowns).root_of_observed(&terms, &scales(), EXACT, is_observed);
    let observed = (0..data.unknowns.count).filter(|i| is_observed(*i)).count();
    assert_eq!(of_observed.rank(), observed);
    assert!(observed < root.rank());
    let whole = gaussian(&root, &sums).unwrap();
    let found = gaussian(&of_observed, &sums).unwrap();
    let deviation = whole.covariance.diagonal().map(f64::sqrt);
    for i in 0..data.unknowns.count {
        let factor = f64::from(u8::from(is_observed(i)));
        let unit = deviation[i];
        assert_relative_eq!(found.mean[i], factor * whole.mean[i], epsilon = 1e-9 * unit);
        for j in (0..data.unknowns.count).filter(|j| is_observed(*j)) {
            let expected = factor * whole.covariance[(i, j)];
            let unit = unit * deviation[j];
            assert_relative_eq!(found.covariance[(i, j)], expected, epsilon = 1e-9 * unit);
        }
    }
}

#[test]
fn the_likelihood_of_the_scales_is_that_of_the_data() {
    // Differences of the log likelihood between two scales, against the dense one of the data.
    let flown = campaign();
    let (terms, data) = data(&flown, &exact());
    let weights = vec![1.0; flown.len()];
    let others = [Scale {
        size: 0.4,
        length_deg: 25.0,
    }; 3];
    let (rows, differences, covariance) = dense(&data, &weights);
    let of_data = |scales: &[Scale]| {
        let root = data.unknowns.root(&terms, scales, EXACT);
        let image = root.left(&rows.transpose());
        let cholesky = Cholesky::new(&covariance + image.tr_mul(&image)).unwrap();
        let roots: f64 = cholesky.l().diagonal().iter().map(|d| d.ln()).sum();
        0.5 * differences.dot(&cholesky.solve(&differences)) + roots
    };
    let own = |scales: &[Scale]| {
        let value = negative_log_posterior(&observed(&terms, &data), scales, EXACT)
            .unwrap()
            .value;
        let both = terms.iter().zip(scales);
        value
            - both
                .map(|(t, s)| t.prior.scale.penalty(s).value)
                .sum::<f64>()
    };
    assert_relative_eq!(
        own(&scales()) - own(&others),
        of_data(&scales()) - of_data(&others),
        max_relative = 1e-8
    );
}

/// Second derivatives of a function, by differences of its values.
fn second_derivatives(at: &DVector<f64>, f: impl Fn(&DVector<f64>) -> f64) -> DMatrix<f64> {
    const H: f64 = 0.02;
    let step = |i: usize, h: f64| DVector::from_fn(at.len(), |k, _| if k == i { h } else { 0.0 });
    DMatrix::from_fn(at.len(), at.len(), |i, j| {
        let value = |a: f64, b: f64| f(&(at + step(i, a * H) + step(j, b * H)));
        (value(1.0, 1.0) - value(1.0, -1.0) - value(-1.0, 1.0) + value(-1.0, -1.0)) / (4.0 * H * H)
    })
}

#[test]
fn the_spread_over_open_scales_is_the_mean_square_over_draws_of_them() {
    let flown = campaign();
    let (terms, data) = data(&flown, &Settings::default());
    let weights = vec![1.0; flown.len()];
    let sums = information(&data.flights, &weights, data.unknowns.count);
    let own = of_differences(&sums, &data.unknowns).unwrap();
    let observed = observed(&terms, &data);
    let scales = most_probable(&observed, &scales());
    let mean = |at: &DVector<f64>| {
        let root = root_of_differences(&terms, &scales_of(at), EXACT, |_| true);
        gaussian(&root, &own).unwrap().mean
    };
    let at = logarithms_of(&scales);
    let curvature = second_derivatives(&at, |at| {
        let scales = scales_of(at);
        negative_log_posterior(&observed, &scales, EXACT)
            .unwrap()
            .value
    });
    let root = Cholesky::new(curvature).unwrap().inverse();
    let root = Cholesky::new(root).unwrap().l();
    let (centre, mut stream) = (mean(&at), RandomStream::new(7, "scales"));
    let mut squares = DVector::zeros(centre.len());
    for _ in 0..1000 {
        let deviates = DVector::from_fn(at.len(), |_, _| stream.normal());
        let off = mean(&(&at + &root * deviates)) - &centre;
        squares += off.component_mul(&off) / 1000.0;
    }
    let mut whole = gaussian(&data.unknowns.root(&terms, &scales, EXACT), &sums).unwrap();
    let before = whole.covariance.diagonal();
    add_open_scales(&observed, &scales, &mut whole);
    let added = whole.covariance.diagonal() - before;
    // A quadrature of three points a direction beside a thousand draws.
    let share = added.rows(0, squares.len()).sum() / squares.sum();
    assert!((0.75..1.3).contains(&share), "{share}");
    let n = squares.len();
    let (a, b) = (added.rows(0, n).into_owned(), &squares);
    assert!(a.dot(b) > 0.95 * a.norm() * b.norm());
}

#[test]
fn without_what_maneuvers_add_there_is_the_information_of_the_others() {
    let flown = campaign();
    let (terms, mut data) = data(&flown, &Settings::default());
    data.set_noise(&terms, &scales());
    let weights = vec![1.0, 0.4, 1.0, 1.0, 1.0, 0.7, 1.0, 1.0, 1.0, 1.0];
    let count = data.unknowns.count;
    let removed = [0, 2];
    for flight in &data.flights {
        let removed: Vec<usize> = removed
            .into_iter()
            .filter(|i| *i < flight.maneuvers.len())
            .collect();
        let kept: Vec<usize> = (0..flight.maneuvers.len())
            .filter(|i| !removed.contains(i))
            .collect();
        let (columns, differences) = flight.added_by(&removed, &weights, count).unwrap();
        let all = information(std::slice::from_ref(flight), &weights, count);
        let others = information(&[flight.of_maneuvers(&kept)], &weights, count);
        let scale = all.matrix.amax();
        assert!(others.matrix.amax() > 0.1 * scale && columns.amax().powi(2) > 0.01 * scale);
        let rest = &all.matrix - &columns * columns.transpose();
        assert_relative_eq!(rest, others.matrix, epsilon = 1e-9 * scale);
        let rest = &all.vector - &columns * &differences;
        assert_relative_eq!(rest, others.vector, epsilon = 1e-9 * all.vector.amax());
    }
    let root = data.unknowns.root(&terms, &scales(), EXACT);
    let all = information(&data.flights, &weights, count);
    let mut whitened = WhitenedInformation::new(&root, &all);
    let flights = data.flights.iter();
    let added = flights.map(|flight| flight.added_by(&[0], &weights, count).unwrap());
    let added: Vec<_> = added.collect();
    whitened.remove(&added);
    let mut others = all.clone();
    for (columns, differences) in &added {
        others.matrix -= columns * columns.transpose();
        others.vector -= columns * differences;
    }
    let expected = WhitenedInformation::new(&root, &others).solved().unwrap();
    let found = whitened.solved().unwrap();
    let (images, expected) = (
        found.images(&data.flights, count),
        expected.images(&data.flights, count),
    );
    assert_eq!(images.len(), data.flights.len());
    for ((mean, covariance), (expected_mean, expected_covariance)) in images.iter().zip(&expected) {
        assert_relative_eq!(mean, expected_mean, epsilon = 1e-9);
        assert_relative_eq!(covariance, expected_covariance, epsilon = 1e-9);
    }
    // The rows of each flight are its own.
    for (flight, (mean, covariance)) in data.flights.iter().zip(&images) {
        let alone = found.images(std::slice::from_ref(flight), count);
        assert_relative_eq!(mean, &alone[0].0, epsilon = 1e-12);
        assert_relative_eq!(covariance, &alone[0].1, epsilon = 1e-12);
    }
    assert!(found.images(&[], count).is_empty());
}

#[test]
fn what_is_left_out_is_predicted_as_if_it_had_not_been_there() {
    let flown = campaign();
    let (terms, data) = data(&flown, &Settings::default());
    let weights = vec![1.0; flown.len()];
    let root = data.unknowns.root(&terms, &scales(), EXACT);
    let whole = gaussian(
        &root,
        &information(&data.flights, &weights, data.unknowns.count),
    )
    .unwrap();
    let leaving_out = LeaveOneOut::new(&data.flights[1], &weights, &whole).unwrap();
    let left = leaving_out.flight().unwrap();
    // The flight: the others are fitted anew.
    let mut others = data.flights.clone();
    let own = others.remove(1);
    let rest = gaussian(&root, &information(&others, &weights, data.unknowns.count)).unwrap();
    let (predicted, spread) = own.image(&rest.mean, &rest.covariance);
    let expected = &own.differences - predicted;
    assert_relative_eq!(left.differences, expected, epsilon = 1e-9);
    let expected = spread + own.covariance(&weights);
    assert_relative_eq!(left.covariance, expected, epsilon = 1e-9);
    // One of its maneuvers: the flight's calibration errors follow from its other maneuvers.
    let (_, rows) = own.maneuvers[0].clone();
    let alone = leaving_out.rows(&rows).unwrap();
    // Of the flight's rows, those of the maneuver given the others.
    let joint = left.covariance.clone();
    let kept: Vec<usize> = (0..own.rows.len()).filter(|i| !rows.contains(i)).collect();
    let out: Vec<usize> = rows.clone().collect();
    let cross = joint.select_rows(&out).select_columns(&kept);
    let inverse = Cholesky::new(joint.select_rows(&kept).select_columns(&kept))
        .unwrap()
        .inverse();
    let differences = left.differences.select_rows(&out)
        - &cross * &inverse * left.differences.select_rows(&kept);
    let covariance =
        joint.select_rows(&out).select_columns(&out) - &cross * inverse * cross.transpose();
    assert_relative_eq!(alone.differences, differences, epsilon = 1e-9);
    assert_relative_eq!(alone.covariance, covariance, epsilon = 1e-9);
}

#[test]
fn between_the_points_the_prior_s_variance_is_kept() {
    let (terms, _) = data(&campaign(), &exact());
    let prior = &terms[1].prior;
    let scale = scales()[1];
    let at = |alpha_deg: f64| Condition {
        alpha_deg,
        mach: 0.3,
        third: None,
    };
    assert_relative_eq!(
        prior.variance_between_points(&scale, &at(10.0)),
        0.0,
        epsilon = 1e-18
    );
    // Half way between two points the straight line and what lies between make up the whole variance
    // but for their covariance, which the closed form has.
    let step = prior.grid.alphas_deg[1] - prior.grid.alphas_deg[0];
    let middle = prior.grid.alphas_deg[4] + 0.5 * step;
    let fading = |d: f64| {
        let r = 3f64.sqrt() * d / scale.length_deg;
        (1.0 + r) * (-r).exp()
    };
    let shares = prior.grid.shares(&at(middle));
    let (i, j) = (shares[0].0, shares[1].0);
    // Amplitude at the point between, where the table is linear.
    let mean = 0.5 * (prior.mean[i] + prior.mean[j]);
    let size = tunnel(None).root_mean_square("CN_alpha");
    let shape = 0.5 * size * size + 0.5 * mean * mean;
    let expected =
        scale.size.powi(2) / 1.25 * shape * (1.5 + 0.5 * fading(step) - 2.0 * fading(0.5 * step));
    assert_relative_eq!(
        prior.variance_between_points(&scale, &at(middle)),
        expected,
        max_relative = 1e-9
    );
}

#[test]
fn each_condition_has_the_same_number_of_local_values() {
    let mut at_two_machs = tunnel(None);
    for (mach, value) in [(0.2, 4.0), (0.8, 6.0)] {
        let point = TunnelPoint {
            mach: Some(mach),
            ..TunnelPoint::new(10.0, value)
        };
        at_two_machs.insert("CN_q", point);
    }
    let values = [tunnel(None), at_two_machs].map(|tunnel| {
        let model = posterior(&campaign(), &tunnel, &exact());
        let values = model.local_values(Axis::Longitudinal);
        for alpha_deg in [-5.0, 17.0, 50.0] {
            let condition = Condition {
                alpha_deg,
                mach: 0.3,
                third: None,
            };
            let local = model.posterior_at_condition(Axis::Longitudinal, &condition);
            assert_eq!(local.values.len(), values);
            assert_eq!(local.mean.len(), values);
        }
        values
    });
    assert_eq!(values[1], values[0] + 1);
}

#[test]
fn draws_have_the_mean_and_covariance_of_the_posterior() {
    let model = posterior(&campaign(), &tunnel(None), &Settings::default());
    let sampler = model.sampler();
    let mut stream = RandomStream::new(1, "draws");
    let count = 2000;
    let rows = &model.rows.posterior;
    let draws: Vec<Vec<f64>> = (0..count)
        .map(|_| sampler.draw(&mut stream).iter().map(|r| r.value).collect())
        .collect();
    for (i, row) in rows.iter().enumerate() {
        let mean = draws.iter().map(|d| d[i]).sum::<f64>() / f64::from(count);
        let square = draws.iter().map(|d| (d[i] - mean).powi(2)).sum::<f64>() / f64::from(count);
        let deviation = row.standard_deviation;
        assert_relative_eq!(
            mean,
            row.value,
            epsilon = 4.0 * deviation / f64::from(count).sqrt()
        );
        assert_relative_eq!(square.sqrt(), deviation, max_relative = 0.08);
    }
    // The constant of each draw is its sum less the slope's part.
    let of = |draw: &[f64], name: &str, alpha_deg: f64| {
        let place = rows
            .iter()
            .position(|r| r.derivative == name && (r.alpha_deg - alpha_deg).abs() < 1e-9);
        draw[place.unwrap()]
    };
    let draw = &draws[7];
    let sum = of(draw, NAMES[0], 20.0) + 20.0 * of(draw, NAMES[1], 20.0);
    assert_relative_eq!(sum, of(draw, "CN_ba", 20.0), max_relative = 1e-12);
}

#[test]
fn a_maneuver_without_the_third_variable_is_read_where_the_tunnel_is() {
    let third = |name: &str, maneuver: &Maneuver| {
        let third = Some(Third {
            name: name.into(),
            at: 7.0,
        });
        let tunnel = WindTunnel::new(wind_tunnel::Settings {
            third,
            ..wind_tunnel::Settings::default()
        });
        maneuver.condition(&tunnel).third
    };
    let mut own = maneuver("m", "f", 20.0);
    assert_eq!(third("qbar_psf", &own), Some(own.qbar_psf));
    assert_eq!(third("flap_deg", &own), Some(7.0));
    own.qbar_psf = f64::NAN;
    assert_eq!(third("qbar_psf", &own), Some(7.0));
    assert_eq!(own.condition(&tunnel(None)).third, None);
}
