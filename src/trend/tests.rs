//! Trend on synthetic estimates with known truths.

use approx::assert_relative_eq;

use super::*;
use crate::maneuver::Maneuver;

pub(super) fn estimate(
    derivative: &str,
    class: &str,
    alpha_deg: f64,
    value: f64,
    bound: f64,
) -> EstimateRow {
    let maneuver = Maneuver {
        class: class.into(),
        ..Maneuver::example(&format!("f1_t{alpha_deg:05.1}"), alpha_deg)
    };
    EstimateRow {
        value: Some(value),
        bound: Some(bound / 5.0),
        bound_corrected: Some(bound),
        ..EstimateRow::without_results(&maneuver, derivative, "per_deg", Status::Estimated)
    }
}

/// Numbers that look random and are the same every time: Knuth's linear congruential generator,
/// normal by summing.
pub(super) struct Lcg(pub u64);

impl Lcg {
    pub(super) fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// The trends without breakpoints of a tunnel.
pub(super) fn through(estimates: &[EstimateRow], settings: &Settings) -> Trends {
    trends(estimates, settings, |_| Vec::new())
}

fn groups_of<'a>(rows: &'a [TrendRow], derivative: &str) -> BTreeSet<&'a str> {
    rows.iter()
        .filter(|r| r.derivative == derivative)
        .map(|r| r.group.as_str())
        .collect()
}

#[test]
fn the_band_covers_the_truth_at_its_nominal_rate() {
    let truth = |a: f64| 0.06 - 2e-3 * (a - 30.0) + 3e-5 * (a - 30.0).powi(2);
    let mut random = Lcg(7);
    let (mut inside, mut all) = (0.0, 0.0);
    for _ in 0..200 {
        let draw = |i: u32| {
            let alpha = 5.0 + 5.0 * f64::from(i % 12) + 0.4 * random.normal();
            let bound = 0.004 * (0.5 + random.uniform());
            let value = truth(alpha) + bound * random.normal() + 0.008 * random.normal();
            estimate("d", "A", alpha, value, bound)
        };
        let estimates: Vec<EstimateRow> = (0..40).map(draw).collect();
        let Trends { rows, problems, .. } = through(
            &estimates,
            &Settings {
                per_class: false,
                ..Settings::default()
            },
        );
        assert_eq!(problems, []);
        for row in rows {
            all += 1.0;
            inside += f64::from(u8::from(
                (row.lower_95..=row.upper_95).contains(&truth(row.alpha_deg)),
            ));
        }
    }
    let covered = inside / all;
    assert!((0.90..=0.98).contains(&covered), "{covered}");
}

#[test]
fn the_order_of_the_maneuvers_does_not_matter_to_the_bit() {
    let mut random = Lcg(1);
    let mut estimates: Vec<EstimateRow> = (0..30)
        .map(|i| {
            estimate(
                "d",
                ["A", "B"][i % 2],
                5.0 + 55.0 * random.uniform(),
                random.normal(),
                0.1 + random.uniform(),
            )
        })
        .collect();
    let Trends { rows, .. } = through(&estimates, &Settings::default());
    assert_eq!(groups_of(&rows, "d"), ["A", "B", "all"].into());
    estimates.reverse();
    estimates.swap(3, 17);
    assert_eq!(through(&estimates, &Settings::default()).rows, rows);
}

#[test]
fn the_first_group_that_names_a_derivative_speaks_for_it() {
    let group = |name: &str, derivatives: &[&str], classes: &[&str]| TrendGroup {
        name: name.into(),
        derivatives: derivatives.iter().map(|&s| s.to_owned()).collect(),
        classes: classes.iter().map(|&s| s.to_owned()).collect(),
        knots_deg: None,
    };
    let groups = vec![
        group("all", &[], &[]),
        group("B", &["vane"], &["B"]),
        group("A and B", &["rate"], &["A", "B"]),
    ];
    let settings = Settings {
        groups,
        ..Settings::default()
    };
    let value = |class: &str| if class == "B" { 1.03 } else { 1.0 };
    let estimates: Vec<EstimateRow> = ["vane", "rate", "other"]
        .iter()
        .flat_map(|d| ["A", "B", "C"].map(|c| (*d, c)))
        .flat_map(|(d, c)| {
            (0..8).map(move |i| estimate(d, c, 10.0 + 5.0 * f64::from(i), value(c), 0.1))
        })
        .collect();
    let Trends { rows, problems, .. } = through(&estimates, &settings);
    assert_eq!(problems, []);
    assert_eq!(groups_of(&rows, "vane"), ["A", "B", "C"].into());
    assert_eq!(groups_of(&rows, "rate"), ["A", "A and B", "B", "C"].into());
    assert_eq!(groups_of(&rows, "other"), ["A", "B", "C", "all"].into());
    let of = |d: &str, g: &str| {
        rows.iter()
            .find(|r| r.derivative == d && r.group == g)
            .expect("a trend")
    };
    assert_relative_eq!(of("vane", "B").value, 1.03, max_relative = 1e-9);
    assert_eq!(of("rate", "A and B").maneuvers, 16);
    assert_relative_eq!(of("other", "all").value, 1.01, max_relative = 1e-6);
}

#[test]
fn a_class_that_strays_does_not_take_the_weight_from_those_that_agree() {
    let mut random = Lcg(5);
    let mut draw = |class: &str, i: u32, value: f64, bound: f64| {
        estimate(
            "d",
            class,
            5.0 + 4.0 * f64::from(i),
            value + bound * random.normal(),
            bound,
        )
    };
    let mut estimates: Vec<EstimateRow> = (0..14).map(|i| draw("A", i, 1.0, 0.02)).collect();
    // Like a vane whose rudder, which moves with it, is held at a wrong value.
    estimates.extend((0..14).map(|i| draw("B", i, -2.0 + 0.3 * f64::from(i), 0.4)));
    let trends = through(
        &estimates,
        &Settings {
            per_class: false,
            ..Settings::default()
        },
    );
    for row in trends.rows {
        assert!(
            (row.value - 1.0).abs() < 0.05 && row.standard_error < 0.1,
            "{row:?}"
        );
    }
}

#[test]
fn the_grid_stays_inside_the_data() {
    let estimates: Vec<EstimateRow> = [11.0, 14.8, 20.1, 25.0, 29.7]
        .iter()
        .map(|&a| estimate("d", "A", a, 1.0, 0.1))
        .collect();
    let at = |reach| {
        let settings = Settings {
            alpha_reach_deg: reach,
            per_class: false,
            ..Settings::default()
        };
        through(&estimates, &settings)
            .rows
            .iter()
            .map(|r| r.alpha_deg)
            .collect::<Vec<_>>()
    };
    assert_eq!(at(0.0), [15.0, 20.0, 25.0]);
    assert_eq!(at(0.5), [15.0, 20.0, 25.0, 30.0]);
}

#[test]
fn held_unbounded_and_left_out_estimates_have_no_part() {
    let mut estimates: Vec<EstimateRow> = (0..6)
        .map(|i| estimate("d", "A", 10.0 + 5.0 * f64::from(i), 1.0, 0.1))
        .collect();
    let wrong = |change: &dyn Fn(&mut EstimateRow)| {
        let mut row = estimate("d", "A", 20.0, 99.0, 0.1);
        change(&mut row);
        row
    };
    estimates.push(wrong(&|e| e.status = Status::Held));
    estimates.push(wrong(&|e| (e.bound, e.bound_corrected) = (None, None)));
    estimates.push(wrong(&|e| e.bound_corrected = Some(f64::INFINITY)));
    estimates.push(wrong(&|e| e.derivative = "bias".into()));
    let settings = Settings {
        leave_out: ["bias".to_owned()].into(),
        ..Settings::default()
    };
    let Trends { rows, problems, .. } = through(&estimates, &settings);
    assert_eq!(problems, []);
    assert!(
        rows.iter()
            .all(|r| r.derivative == "d" && r.maneuvers == 6 && (r.value - 1.0).abs() < 1e-9)
    );
}

#[test]
fn too_few_maneuvers_for_a_trend_have_means_and_no_problem() {
    let apart = [
        estimate("d", "A", 10.0, 1.0, 0.1),
        estimate("d", "B", 20.0, 3.0, 0.2),
    ];
    let Trends { rows, problems, .. } = through(&apart, &Settings::default());
    assert_eq!(problems, []);
    let means: Vec<_> = rows
        .iter()
        .map(|r| (r.alpha_deg, r.value, r.standard_error))
        .collect();
    assert_eq!(means, [(10.0, 1.0, 0.1), (20.0, 3.0, 0.2)]);
    assert_relative_eq!(rows[1].upper_95 - 3.0, 1.959_964 * 0.2, max_relative = 1e-6);
    assert!(rows.iter().all(|r| r.curve == "mean" && r.maneuvers == 1));
    let Trends { rows, problems, .. } = through(&[], &Settings::default());
    assert_eq!((rows, problems), (vec![], vec![]));
}

#[test]
fn a_mean_of_two_weighs_by_bounds_and_scatter() {
    let two = |apart: f64| {
        let both = [
            estimate("d", "A", 10.0, 1.0, 0.3),
            estimate("d", "A", 10.5, 1.0 + apart, 0.4),
        ];
        through(&both, &Settings::default()).rows.remove(0)
    };
    // Together as their bounds say: weights 1/0.09 and 1/0.16, so 0.64 and 0.36.
    let near = two(0.5);
    assert_relative_eq!(near.value, 1.0 + 0.36 * 0.5, max_relative = 1e-9);
    assert_relative_eq!(near.standard_error, 0.24, max_relative = 1e-9);
    assert_relative_eq!(near.scatter, 0.0);
    assert_eq!(near.maneuvers, 2);
    // Two further apart: τ² = (9 − 0.25)/2, and (y₁ − y₂)² is the sum of both variances.
    let far = two(3.0);
    assert_relative_eq!(far.scatter.powi(2), 4.375, max_relative = 1e-9);
    assert!(far.standard_error > 1.0 && (far.value - 2.5).abs() < 0.05);
}

#[test]
fn the_uncertainty_of_held_values_does_not_average_out() {
    let mut estimates: Vec<EstimateRow> = (0..40)
        .map(|i| estimate("Cm_dpv", "PPSSTV", 10.0 + f64::from(i), 1.0, 0.1))
        .collect();
    let without = through(&estimates, &Settings::default()).rows[0].standard_error;
    for e in &mut estimates {
        e.bound_held = Some(0.08);
    }
    let with = through(&estimates, &Settings::default()).rows[0].standard_error;
    assert_relative_eq!(with, without.hypot(0.08), max_relative = 1e-9);
    assert!(without < 0.05 && with >= 0.08);
}

#[test]
fn between_flown_angles_the_uncertainty_of_held_values_counts_as_at_them() {
    let estimates: Vec<EstimateRow> = [10.0, 10.4, 30.0, 30.4]
        .iter()
        .map(|&a| EstimateRow {
            bound_held: Some(if a < 20.0 { 0.06 } else { 0.1 }),
            ..estimate("Cm_dpv", "PPSSTV", a, 1.0, 0.1)
        })
        .collect();
    let members: Vec<&EstimateRow> = estimates.iter().collect();
    assert_relative_eq!(common_error(&members, 10.2, 5.0), 0.06, max_relative = 1e-9);
    assert_relative_eq!(common_error(&members, 19.0, 5.0), 0.08, max_relative = 1e-2);
    assert_relative_eq!(common_error(&members, 31.0, 5.0), 0.1, max_relative = 1e-9);
}

#[test]
fn the_tunnel_s_breakpoints_inside_the_data_are_published_too() {
    let estimates: Vec<EstimateRow> = [11.0, 14.8, 20.1, 25.0, 29.7]
        .iter()
        .map(|&a| estimate("d", "A", a, 1.0, 0.1))
        .collect();
    let settings = Settings {
        per_class: false,
        ..Settings::default()
    };
    let found = trends(&estimates, &settings, |_| {
        vec![2.0, 12.0, 15.000_000_1, 22.5, 40.0]
    });
    let alphas: Vec<f64> = found.rows.iter().map(|r| r.alpha_deg).collect();
    assert_eq!(alphas, [12.0, 15.000_000_1, 20.0, 22.5, 25.0, 30.0]);
}

#[test]
fn a_trend_is_not_continued_past_its_last_maneuver() {
    let estimates: Vec<EstimateRow> = (0..12)
        .map(|i| 10.2 + 2.0 * f64::from(i))
        .map(|a| estimate("d", "A", a, 0.1 * a, 0.01))
        .collect();
    let settings = Settings {
        per_class: false,
        ..Settings::default()
    };
    let rows = through(&estimates, &settings).rows;
    assert_relative_eq!(rows[0].alpha_deg, 10.0);
    assert_relative_eq!(rows[0].value, 1.02, max_relative = 1e-9);
}

#[test]
fn each_outlier_is_named_and_a_good_maneuver_is_not() {
    let wave =
        |i: i32| 0.004 * [1.0, -1.1, 0.3, -0.6, 0.9, -0.5][usize::try_from(i % 6).expect("small")];
    let mut estimates: Vec<EstimateRow> = (0..20)
        .map(|i| estimate("d", "A", 10.0 + 2.0 * f64::from(i), 1.0 + wave(i), 0.005))
        .collect();
    estimates[7].value = Some(1.2);
    estimates[7].maneuver_id = "wild".into();
    let settings = Settings {
        per_class: false,
        ..Settings::default()
    };
    let found = through(&estimates, &settings);
    let names: Vec<&str> = found
        .outliers
        .iter()
        .map(|o| o.maneuver_id.as_str())
        .collect();
    assert_eq!(names, ["wild"]);
    let wild = &found.outliers[0];
    assert!(
        wild.z > 10.0 && wild.weight_share < 0.2 && (wild.trend - 1.0).abs() < 0.01,
        "{wild:?}"
    );
    assert!(
        found
            .rows
            .iter()
            .all(|r| r.outliers == 1 && (r.value - 1.0).abs() < 0.01)
    );
}

#[test]
fn a_spline_follows_a_kink_at_its_knot_or_between_the_flown_alpha() {
    let kinked = |a: f64| {
        if a < 30.0 {
            1.0
        } else {
            1.0 + 0.05 * (a - 30.0)
        }
    };
    let estimates: Vec<EstimateRow> = (0..56)
        .map(|i| 5.0 + f64::from(i))
        .map(|a| estimate("d", "A", a, kinked(a), 0.002))
        .collect();
    let settings = |knots_deg: Vec<f64>| {
        let groups = vec![TrendGroup {
            name: "all".into(),
            knots_deg: Some(knots_deg),
            ..TrendGroup::default()
        }];
        Settings {
            per_class: false,
            groups,
            ..Settings::default()
        }
    };
    let at_kink = |settings: &Settings| {
        through(&estimates, settings)
            .rows
            .into_iter()
            .find(|r| (r.alpha_deg - 30.0).abs() < 1e-9)
            .expect("30")
    };
    let spline = at_kink(&settings(vec![30.0]));
    assert_eq!(
        (spline.curve.as_str(), spline.order),
        ("spline, knots 30", 1)
    );
    assert_relative_eq!(spline.value, 1.0, epsilon = 1e-6);
    let unguided = at_kink(&settings(vec![]));
    assert!(unguided.curve.starts_with("spline, knots"), "{unguided:?}");
    assert_relative_eq!(unguided.value, 1.0, epsilon = 0.003);
}
