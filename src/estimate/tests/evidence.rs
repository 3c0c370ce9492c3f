//! Holding by evidence and the measures of a maneuver, on a simulated maneuver whose truth is
//! known.

use std::collections::BTreeMap;

use approx::assert_relative_eq;

use super::super::*;
use crate::aero::wind_tunnel::TunnelPoint;
use crate::aero::{AeroModel, Axis, Coefficient, Derivative, WindTunnel};
use crate::dynamics::Longitudinal;
use crate::dynamics::motion::{ManeuverSignals, MassProperties};
use crate::dynamics::tests::aircraft;
use crate::flight::record::Series;
use crate::flight::{Mark, Record, signal};
use crate::maneuver::class::Recognition;
use crate::maneuver::{Class, Status};
use crate::output_error::tests::{
    NOISE, Noise, SAMPLES, derivative, nothing_measured, record, surface, truth,
};
use crate::output_error::{Case, Model};
use crate::tables::{CorrelationKind, CorrelationRow, EstimateRow, Outcome};

/// The longitudinal derivatives that are true, and what is flown with them.
struct Flown {
    truth: Vec<(Derivative, f64)>,
    record: Record,
}

/// Flies the doublets of the simulated record with its surfaces edited; outputs as measured with
/// noise.
fn fly(truth: Vec<(Derivative, f64)>, edit: impl Fn(&mut Record)) -> Flown {
    let mut record = record();
    edit(&mut record);
    let model = Model {
        free: truth.iter().map(|(d, _)| d).collect(),
        ..Model::default()
    };
    let surfaces = truth.iter().filter_map(|(d, _)| d.regressor.surface());
    let signals = ManeuverSignals::cut(
        &aircraft(),
        &record,
        0..SAMPLES,
        surfaces,
        MassProperties::Recorded,
    )
    .unwrap();
    let case = Case::<3, Longitudinal>::new(&aircraft(), &signals, nothing_measured(), &model);
    let values: BTreeMap<&str, f64> = truth.iter().map(|(d, v)| (d.name.as_str(), *v)).collect();
    let mut response = case.response();
    case.respond(&case.starting_values(|name| values[name]), &mut response)
        .unwrap();
    let mut noise = Noise(11);
    let outputs = [
        signal::ALPHA_VANE,
        signal::Q,
        signal::THETA,
        signal::AN,
        signal::AX,
    ];
    for (o, name) in outputs.into_iter().enumerate() {
        let measured = response
            .outputs
            .iter()
            .map(|y| y[o] + 0.1 * NOISE[o] * noise.gaussian())
            .collect();
        put(&mut record, name, measured);
    }
    Flown { truth, record }
}

fn put(record: &mut Record, name: &str, values: Vec<f64>) {
    record.signals.insert(
        name.into(),
        Series {
            marks: vec![Mark::Measured; values.len()],
            values,
        },
    );
}

/// A tunnel whose values are off by a tenth, with a stated uncertainty of `share` of each
/// derivative.
fn tunnel(truth: &[(Derivative, f64)], share: f64) -> WindTunnel {
    let mut tunnel = WindTunnel::default();
    for (derivative, value) in truth.iter().filter(|(_, value)| *value != 0.0) {
        let (value, uncertainty) = (1.1 * value, Some(share * value.abs()));
        let point = TunnelPoint {
            uncertainty,
            ..TunnelPoint::new(20.0, value)
        };
        tunnel.insert(&derivative.name, point);
    }
    tunnel
}

impl Flown {
    fn estimated(&self, hold: Hold, tunnel_share: f64) -> Estimated {
        self.estimated_with(hold, &tunnel(&self.truth, tunnel_share))
    }

    fn estimated_with(&self, hold: Hold, tunnel: &WindTunnel) -> Estimated {
        let axis = Axis::Longitudinal;
        let weights = axis
            .outputs()
            .into_iter()
            .zip(NOISE.map(|sd| 1.0 / (0.01 * sd * sd)))
            .collect();
        let class = Class {
            name: "steps".into(),
            title: String::new(),
            axis,
            recognition: Recognition::default(),
            statuses: self
                .truth
                .iter()
                .map(|(d, _)| (d.name.clone(), Status::Estimated))
                .collect(),
            weights,
            overrides: vec![],
        };
        let maneuver = super::maneuver("f_t0", 20.0);
        let derivatives = self.truth.iter().map(|(d, _)| d.clone()).collect();
        let (aircraft, aero_model) = (
            aircraft(),
            AeroModel {
                derivatives,
                ..AeroModel::default()
            },
        );
        let settings = Settings {
            hold,
            // An error of the tunnel is the same at all angles of attack.
            tunnel_error_length_deg: f64::INFINITY,
            ..Settings::default()
        };
        let context = Context::new(&aircraft, &aero_model, tunnel, &settings);
        super::super::maneuver(&self.record, &maneuver, &class, &context)
    }
}

fn held(estimated: &Estimated) -> Vec<(&str, &str)> {
    let held = estimated
        .estimates
        .iter()
        .filter(|row| row.status == Status::Held);
    held.map(|row| {
        (
            row.derivative.as_str(),
            row.held_because.as_deref().unwrap_or(""),
        )
    })
    .collect()
}

fn row<'a>(estimated: &'a Estimated, derivative: &str) -> &'a EstimateRow {
    estimated
        .estimates
        .iter()
        .find(|row| row.derivative == derivative)
        .unwrap()
}

#[test]
fn evidence_holds_nothing_where_all_is_excited() {
    let flown = fly(truth(Axis::Longitudinal), |_| {});
    let estimated = flown.estimated(Hold::Evidence, 0.5);
    assert_eq!(
        estimated.fit.outcome,
        Outcome::Converged,
        "{}",
        estimated.fit.reason
    );
    assert_eq!(held(&estimated), []);
}

#[test]
fn evidence_holds_exactly_the_surface_that_did_not_move() {
    let flown = fly(truth(Axis::Longitudinal), |record| {
        put(record, "dpv_deg", vec![0.0; SAMPLES]);
    });
    let estimated = flown.estimated(Hold::Evidence, 0.5);
    assert_eq!(
        estimated.fit.outcome,
        Outcome::Converged,
        "{}",
        estimated.fit.reason
    );
    let because = "dpv_deg did not move";
    assert_eq!(held(&estimated), [("CN_dpv", because), ("Cm_dpv", because)]);
    for row in estimated
        .estimates
        .iter()
        .filter(|row| row.status == Status::Held)
    {
        assert_eq!(
            (row.value, row.excitation),
            (row.wind_tunnel, Some(0.0)),
            "{row:?}"
        );
    }
}

#[test]
fn evidence_holds_what_a_tunnel_without_error_knows_better_but_no_constant() {
    let flown = fly(truth(Axis::Longitudinal), |_| {});
    let estimated = flown.estimated(Hold::Evidence, 1e-9);
    let free: Vec<&str> = estimated
        .estimates
        .iter()
        .filter(|r| r.status == Status::Estimated)
        .map(|r| r.derivative.as_str())
        .collect();
    assert_eq!(free, ["CN_0", "Cm_0", "CA_0"]);
    assert!(
        held(&estimated)
            .iter()
            .all(|(_, because)| because.starts_with("estimated, its bound would be"))
    );
    assert!(
        held(&estimated)
            .iter()
            .all(|(_, because)| !because.contains("e-")),
        "numbers that a reader can read"
    );
}

/// A second surface that moves in proportion to the first, as stabilator and pitch vane of pilot's
/// steps nearly do.
fn with_twin() -> Flown {
    let mut truth = truth(Axis::Longitudinal);
    truth.push((
        derivative("Cm_twin", Coefficient::Cm, surface("twin_deg")),
        -0.006,
    ));
    fly(truth, |record| {
        let twin = record.signals["de_deg"]
            .values
            .iter()
            .map(|v| 2.0 * v)
            .collect();
        put(record, "twin_deg", twin);
    })
}

#[test]
fn surfaces_that_move_in_proportion_are_unidentifiable_named_and_have_no_bound() {
    let estimated = with_twin().estimated(Hold::Table, 0.5);
    assert_eq!(
        estimated.fit.outcome,
        Outcome::Unidentifiable,
        "{}",
        estimated.fit.reason
    );
    let named = estimated.fit.confounded.as_deref().unwrap();
    for name in ["Cm_de", "Cm_twin"] {
        assert!(
            estimated.fit.reason.contains(name) && named.contains(name),
            "{} / {named}",
            estimated.fit.reason
        );
        assert_eq!(row(&estimated, name).variance_inflation, None);
    }
    for row in &estimated.estimates {
        assert!(
            row.bound.is_none() && row.bound_corrected.is_none() && row.bound_held.is_none(),
            "{row:?}"
        );
    }
    let of = |c: &&CorrelationRow| {
        c.kind == CorrelationKind::Regressors && c.first == "de_deg" && c.second == "twin_deg"
    };
    assert_relative_eq!(
        estimated.correlations.iter().find(of).unwrap().correlation,
        1.0,
        max_relative = 1e-12
    );
    assert!(
        !estimated
            .correlations
            .iter()
            .any(|c| c.kind == CorrelationKind::Estimates),
        "there is no inverse to take them from"
    );
}

#[test]
fn of_surfaces_that_move_in_proportion_evidence_holds_one_and_says_from_what_it_cannot_be_told_apart()
 {
    let flown = with_twin();
    let estimated = flown.estimated(Hold::Evidence, 0.5);
    assert_eq!(
        estimated.fit.outcome,
        Outcome::Converged,
        "{}",
        estimated.fit.reason
    );
    let held = held(&estimated);
    assert_eq!(held.len(), 1, "{held:?}");
    let (name, because) = held[0];
    let other = if name == "Cm_de" { "Cm_twin" } else { "Cm_de" };
    assert!(["Cm_de", "Cm_twin"].contains(&name), "{held:?}");
    assert!(
        because.starts_with("not identifiable beside") && because.contains(other),
        "{because}"
    );
    // The twin moves by twice the elevator: an error of the one enters the other, and its
    // bound counts it.
    let factor = if name == "Cm_twin" { 2.0 } else { 0.5 };
    let wrong = 0.5
        * flown
            .truth
            .iter()
            .find(|(d, _)| d.name == name)
            .map(|(_, value)| value.abs())
            .unwrap();
    let free = row(&estimated, other);
    assert_relative_eq!(
        free.bound_held.unwrap(),
        factor * wrong,
        max_relative = 1e-3
    );
    assert!(free.bound_corrected.unwrap() >= free.bound_held.unwrap());
}

#[test]
fn of_surfaces_that_move_in_proportion_neither_can_be_held_without_a_tunnel_and_the_reason_says_so()
{
    let flown = with_twin();
    let known: Vec<(Derivative, f64)> = flown
        .truth
        .iter()
        .filter(|(d, _)| !["Cm_de", "Cm_twin"].contains(&d.name.as_str()))
        .cloned()
        .collect();
    let estimated = flown.estimated_with(Hold::Evidence, &tunnel(&known, 0.5));
    assert_eq!(estimated.fit.outcome, Outcome::Unidentifiable);
    let reason = &estimated.fit.reason;
    assert!(
        reason.ends_with(
            "; none of Cm_de, Cm_twin has a wind-tunnel value with an uncertainty to be held at"
        ),
        "{reason}"
    );
}

#[test]
fn equation_error_agrees_with_the_truth_of_what_is_well_excited() {
    let flown = fly(truth(Axis::Longitudinal), |_| {});
    let estimated = flown.estimated(Hold::Table, 0.5);
    for (derivative, value) in &flown.truth {
        if ["CN_alpha", "CN_de", "Cm_alpha", "Cm_q", "Cm_de", "Cm_dpv"]
            .contains(&derivative.name.as_str())
        {
            let found = row(&estimated, &derivative.name).equation_error.unwrap();
            assert_relative_eq!(found, *value, max_relative = 0.05);
        }
    }
}

#[test]
fn excitation_is_the_surface_s_motion_in_degrees_and_contributions_are_shares_of_the_coefficient() {
    let flown = fly(truth(Axis::Longitudinal), |_| {});
    let estimated = flown.estimated(Hold::Table, 0.5);
    // 5 deg for 60 of 320 samples, as many up as down.
    let expected = 5.0 * (60.0 / SAMPLES as f64).sqrt();
    assert_relative_eq!(
        row(&estimated, "Cm_dpv").excitation.unwrap(),
        expected,
        max_relative = 1e-9
    );
    assert_eq!(row(&estimated, "Cm_0").excitation, None);
    let shares: f64 = ["CA_0", "CA_alpha"]
        .iter()
        .filter_map(|name| row(&estimated, name).contribution_pct)
        .sum();
    assert_relative_eq!(shares, 100.0, max_relative = 1e-9);
}
