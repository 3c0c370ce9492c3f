//! Joint filters against the filter of one maneuver, joint output error, and Monte Carlo.

use approx::assert_relative_eq;

use super::*;
use crate::output_error::{Detail, Joint, Likelihood};

/// Maneuver flown through light turbulence with its own biases and initial states.
fn flown<const NX: usize, E: InGusts<NX>>(seed: u64, noise: &Noise) -> Simulated<NX, E> {
    let mut simulated = prepared::<NX, E>(&truth(E::AXIS), &biases(E::AXIS));
    simulated.fly(noise, &mut Draws(seed));
    simulated
}

/// Parameters of maneuvers with these filters, which share all derivatives.
fn sharing<const NX: usize, E: InGusts<NX>>(filters: &[Filter<NX, E>]) -> SharedParameters {
    let labels = ["a", "b", "c"];
    let members = labels
        .iter()
        .zip(filters)
        .map(|(label, filter)| (*label, filter.names(), filter.case.derivatives()));
    SharedParameters::new(members, |_| false).unwrap()
}

/// Joint parameters from each maneuver's own and its noise.
fn assembled<const NX: usize, E: InGusts<NX>>(
    joint: &JointFilter<NX, E>,
    own: &[Vec<f64>],
    noise: &[Noise],
) -> Vec<f64> {
    let shared = &own[0][..joint.own().shared().len()];
    joint.with_noise(&joint.own().assemble(shared, own), noise)
}

fn assert_two_copies_divide_bounds<const NX: usize, E: InGusts<NX>>() {
    let copies = [(); 2].map(|()| flown::<NX, E>(20_261_123, &light()));
    let start = [&copies[0].own[..], &[]].concat();
    let filters = copies.map(|copy| copy.filter);
    let own = SharedParameters::of_one(filters[0].names());
    let alone = JointFilter::new(&filters[..1], &own);
    let settings = scoring::Settings {
        tolerance: 1e-14,
        ..scoring::Settings::default()
    };
    let floors = |joint: &JointFilter<NX, E>| joint.floors(&[[1e-6; OUTPUTS]; 2]);
    let from = alone.with_noise(&start, &[Noise::starting(light().outputs)]);
    let single = minimise(&alone, from, &floors(&alone), &settings).unwrap();

    let parameters = sharing(&filters);
    let both = JointFilter::new(&filters, &parameters);
    let first = alone.first_noise();
    let shared = filters[0].case.derivatives();
    let values = vec![single.parameters[..first].to_vec(); 2];
    let noise = [alone.noise(&single.parameters)[0]; 2];
    // The minimum of one is that of both.
    let at = assembled(&both, &values, &noise);
    let joint = scored_from(&both, at.clone());
    assert_eq!((joint.iterations, &joint.parameters), (0, &at));
    let twice = 2.0 * single.response.cost;
    assert_relative_eq!(joint.response.cost, twice, max_relative = 1e-12);
    let (one, two) = (
        bounds(&alone, &single, 1e10).unwrap(),
        bounds(&both, &joint, 1e10).unwrap(),
    );
    let corrected = (one.corrected(&alone, &single), two.corrected(&both, &joint));
    for j in 0..shared {
        let (one, two) = (one.covariance[(j, j)], two.covariance[(j, j)]);
        assert_relative_eq!(two, one / 2.0, max_relative = 1e-7);
        // Two maneuvers have twice the degrees of freedom of Student's t: the corrected bound falls by
        // more than the root of two.
        let ratio = (corrected.1[(j, j)] / corrected.0[(j, j)]).sqrt();
        assert!(ratio < 0.75 && corrected.1[(j, j)] >= two, "{ratio}");
    }
    // From elsewhere the iteration arrives there.
    let off = vec![start.iter().map(|v| 1.1 * v).collect(); 2];
    let from = assembled(&both, &off, &[Noise::starting(light().outputs); 2]);
    let found = minimise(&both, from, &floors(&both), &settings).unwrap();
    for (j, value) in at.iter().enumerate().take(shared) {
        let z = (found.parameters[j] - value) / two.covariance[(j, j)].sqrt();
        assert!(z.abs() < 1e-2, "{}: {z}", parameters.names()[j]);
    }
}

#[test]
fn two_copies_of_a_maneuver_have_its_estimate_with_bounds_shorter_by_the_root_of_two() {
    assert_two_copies_divide_bounds::<4, LongitudinalInGusts>();
    assert_two_copies_divide_bounds::<6, LateralInGusts>();
}

/// Compares gradient and information without process noise with those of joint output error.
fn assert_still_air_is_joint_output_error<
    const NX: usize,
    E: Equations<NX>,
    const NG: usize,
    G: InGusts<NG>,
>() {
    let (truth, given) = (truth(E::AXIS), biases(E::AXIS));
    let model = Model {
        free: truth.iter().map(|(d, _)| d).collect(),
        held: vec![],
        biases: given.iter().collect(),
        initial_state: InitialState::Estimated,
    };
    let [(a, case_a, own_a), (b, case_b, own_b)] = [11, 12].map(|seed| {
        let simulated = flown::<NG, G>(seed, &light());
        let measured = simulated.filter.case.measurements.clone();
        let of = (&aircraft(), &signals());
        let unknown = vec![None; given.len()];
        let filter = Filter::<NG, G>::new(of.0, of.1, measured.clone(), &model, &unknown);
        let case = Case::<NX, E>::new(of.0, of.1, measured, &model);
        let own = simulated.own.iter().map(|v| 1.05 * v);
        (filter, case, own.collect::<Vec<f64>>())
    });
    let own = [own_a, own_b];
    let joint = Joint::new([("a", &case_a), ("b", &case_b)], |_| false).unwrap();
    let shared = joint.parameters().shared().len();
    let at = joint.parameters().assemble(&own[0][..shared], &own);
    let mut response = joint.response();
    joint.respond(Detail::Whole, &at, &mut response).unwrap();
    let weights = light().outputs.map(|deviation| deviation.powi(-2));
    let sums = Likelihood::sums(&joint, &response, &weights);

    let filters = [a, b];
    let parameters = sharing(&filters);
    let filter = JointFilter::new(&filters, &parameters);
    let at = filter.with_noise(&at, &[Noise::without_gusts(light().outputs); 2]);
    let response = filter.respond(&at).unwrap();
    let (gradient, information) = (filter.gradient(&response), filter.information(&response));
    assert_eq!(filter.own().names(), joint.names());
    for i in 0..joint.names().len() {
        let unit = sums.information[(i, i)].sqrt();
        assert_relative_eq!(
            gradient[i],
            sums.gradient[i],
            max_relative = 1e-7,
            epsilon = 1e-9 * unit
        );
        for j in 0..joint.names().len() {
            let unit = unit * sums.information[(j, j)].sqrt();
            let difference = information[(i, j)] - sums.information[(i, j)];
            assert!(difference.abs() < 1e-7 * unit, "{difference} of {unit}");
        }
    }
}

#[test]
fn without_process_noise_a_joint_filter_is_joint_output_error() {
    assert_still_air_is_joint_output_error::<3, Longitudinal, 4, LongitudinalInGusts>();
    assert_still_air_is_joint_output_error::<4, Lateral, 6, LateralInGusts>();
}

#[test]
fn each_maneuver_keeps_its_noise_and_a_still_one_has_it_at_the_floor() {
    let still = Noise {
        angle: 1e-9,
        gusts: [1e-9; 2],
        ..light()
    };
    let noises = [light(), still];
    let members = [(21, light()), (22, still)]
        .map(|(seed, noise)| flown::<4, LongitudinalInGusts>(seed, &noise));
    let own = members.each_ref().map(|member| member.own.clone());
    let filters = members.map(|member| member.filter);
    let parameters = sharing(&filters);
    let joint = JointFilter::new(&filters, &parameters);
    let start = noises.map(|noise| Noise::starting(noise.outputs));
    let scored = scored_from(&joint, assembled(&joint, &own, &start));
    let found = joint.noise(&scored.parameters);
    assert_relative_eq!(found[0].angle, light().angle, max_relative = 0.3);
    assert!(found[1].angle < 0.004 * RAD, "{} deg", found[1].angle / RAD);
}

/// Squares of errors in bounds, and the share of 95 % intervals that hold.
#[derive(Default)]
struct Scatter {
    square: f64,
    within: f64,
    count: f64,
}

impl Scatter {
    /// Adds the errors of the derivatives, in the bounds of a minimum.
    fn add<const NX: usize, E: InGusts<NX>>(
        &mut self,
        joint: &JointFilter<NX, E>,
        start: &[Noise],
        own: &[Vec<f64>],
    ) {
        let scored = scored_from(joint, assembled(joint, own, start));
        let bounds = bounds(joint, &scored, 1e10).unwrap();
        let covariance = bounds.corrected(joint, &scored);
        for j in 0..joint.filters()[0].case.derivatives() {
            let z = (scored.parameters[j] - own[0][j]) / covariance[(j, j)].sqrt();
            self.square += z * z;
            self.count += 1.0;
            self.within += f64::from(u8::from(z.abs() < 1.96));
        }
    }

    fn mean_square(&self) -> f64 {
        self.square / self.count
    }

    fn share(&self) -> f64 {
        self.within / self.count
    }
}

/// Estimates pairs of simulated maneuvers in gusts of different sizes, alone and jointly: bounds of the
/// joint estimates hold as well as those of the single ones, whose maneuvers of 8 s are short.
fn assert_joint_estimates_scatter_as_single_ones<const NX: usize, E: InGusts<NX>>() {
    const PAIRS: usize = 16;
    let heavy = Noise {
        angle: 2.0 * light().angle,
        gusts: light().gusts.map(|g| 2.0 * g),
        ..light()
    };
    let mut draws = Draws(17);
    let mut members = [(); 2].map(|()| prepared::<NX, E>(&truth(E::AXIS), &biases(E::AXIS)));
    let own = members.each_ref().map(|member| member.own.clone());
    let start = [Noise::starting(light().outputs); 2];
    let (mut single, mut both) = (Scatter::default(), Scatter::default());
    for _ in 0..PAIRS {
        members[0].fly(&light(), &mut draws);
        members[1].fly(&heavy, &mut draws);
        let filters = members.map(|member| member.filter);
        for (filter, own) in filters.iter().zip(&own) {
            let parameters = sharing(std::slice::from_ref(filter));
            let alone = JointFilter::new(std::slice::from_ref(filter), &parameters);
            single.add(&alone, &start[..1], std::slice::from_ref(own));
        }
        let parameters = sharing(&filters);
        both.add(&JointFilter::new(&filters, &parameters), &start, &own);
        let mut own = own.iter();
        members = filters.map(|filter| Simulated {
            filter,
            own: own.next().unwrap().clone(),
        });
    }
    let (joint, alone) = (both.mean_square(), single.mean_square());
    assert!(
        joint < 1.25 * alone,
        "mean squares of z: {joint}, alone {alone}"
    );
    let (joint, alone) = (both.share(), single.share());
    assert!(
        joint > alone - 0.04,
        "95 % intervals hold {joint}, alone {alone}"
    );
}

#[test]
fn joint_estimates_in_gusts_scatter_by_their_bounds() {
    assert_joint_estimates_scatter_as_single_ones::<4, LongitudinalInGusts>();
    assert_joint_estimates_scatter_as_single_ones::<6, LateralInGusts>();
}
