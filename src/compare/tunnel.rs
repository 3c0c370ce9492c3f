//! Comparison of flight with the wind tunnel: the posterior at the tunnel's breakpoints, and each maneuver
//! at its own flight condition.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use super::judgement::judge;
use super::settings::Settings;
use crate::aero::wind_tunnel::TunnelValue;
use crate::aero::{Condition, WindTunnel};
use crate::maneuver::{Maneuver, Status};
use crate::numerics::statistics::mean::mean;
use crate::tables::{
    ComparisonRow, EstimateRow, ManeuverComparisonRow, PosteriorRow, TunnelDifference,
    TunnelVerdict,
};
use crate::trend;

/// Compares the posterior of each derivative with the tunnel: one row per derivative and α, in the
/// order of the posterior. The angles are the tunnel's breakpoints where it has some. Over Mach
/// number and third variable the point nearest to the maneuvers near that α counts.
///
/// The posterior's standard deviation has the tunnel's uncertainty in it, so it alone is the error
/// of the difference. Verdicts, in this order:
/// - `nothing learnt`: flight gave less than `learnt_pct` of the information;
/// - `sign differs`: flight and tunnel have opposite signs, and the posterior exceeds its error;
/// - `agrees`: the difference is within `agreement_z` errors or `agreement_pct` percent;
/// - `flight higher`, `flight lower`: otherwise, in the algebraic sense (−0.3 is lower than −0.2).
///   `difference_pct` is in percent of the tunnel value's magnitude, so it has the same sign.
#[must_use]
pub fn compare_posterior(
    posterior: &[PosteriorRow],
    maneuvers: &[Maneuver],
    tunnel: &WindTunnel,
    groups: &trend::Settings,
    settings: &Settings,
) -> Vec<ComparisonRow> {
    let derivatives = posterior.chunk_by(|a, b| a.derivative == b.derivative);
    derivatives
        .flat_map(|rows| compare_derivative(rows, maneuvers, tunnel, groups, settings))
        .collect()
}

/// Rows of one derivative.
fn compare_derivative(
    rows: &[PosteriorRow],
    maneuvers: &[Maneuver],
    tunnel: &WindTunnel,
    groups: &trend::Settings,
    settings: &Settings,
) -> Vec<ComparisonRow> {
    let name = &rows[0].derivative;
    let group = groups.group_of(name);
    let breakpoints = tunnel.alphas_deg(name);
    let is_breakpoint = |row: &&PosteriorRow| breakpoints.contains(&row.alpha_deg);
    let has_breakpoints = rows.iter().any(|row| is_breakpoint(&row));
    let mut alphas: Vec<f64> = rows
        .iter()
        .filter(|row| !has_breakpoints || is_breakpoint(row))
        .map(|row| row.alpha_deg)
        .collect();
    alphas.sort_by(f64::total_cmp);
    alphas.dedup();
    let row = |alpha_deg: f64| {
        let of_group = |m: &&Maneuver| group.is_none_or(|group| group.has(&m.class));
        let flown = maneuvers.iter().filter(of_group);
        let condition = condition_near(flown, tunnel, alpha_deg, groups.alpha_step_deg);
        let there = rows
            .iter()
            .filter(|row| row.alpha_deg.total_cmp(&alpha_deg).is_eq());
        let nearest = there.min_by(|a, b| {
            let distance = |row: &PosteriorRow| distance(row, condition.as_ref());
            distance(a)
                .partial_cmp(&distance(b))
                .unwrap_or(Ordering::Equal)
        })?;
        let group = group.map_or_else(String::new, |g| g.name.clone());
        Some(comparison_row(nearest, group, condition, settings))
    };
    alphas.into_iter().filter_map(row).collect()
}

/// Distances of a row from a condition in Mach number and third variable, for comparison in this
/// order.
fn distance(row: &PosteriorRow, condition: Option<&Condition>) -> (f64, f64) {
    let apart = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or(0.0, |(a, b)| (a - b).abs());
    (
        apart(row.mach, condition.map(|c| c.mach)),
        apart(row.third, condition.and_then(|c| c.third)),
    )
}

fn comparison_row(
    row: &PosteriorRow,
    group: String,
    condition: Option<Condition>,
    settings: &Settings,
) -> ComparisonRow {
    let is_comparable = settings.is_comparable(&row.derivative);
    let value = row.wind_tunnel.filter(|_| is_comparable);
    let value = value.map(|value| TunnelValue {
        value,
        uncertainty: None,
    });
    let mut tunnel = against_tunnel(row.value, row.standard_deviation, value, settings);
    let share = row.flight_share_pct.unwrap_or(0.0);
    let is_learnt = row.maneuvers > 0 && share >= settings.learnt_pct;
    if value.is_some() && !is_learnt {
        tunnel.verdict = TunnelVerdict::NothingLearnt;
    }
    ComparisonRow {
        derivative: row.derivative.clone(),
        unit: row.unit.clone(),
        group,
        alpha_deg: row.alpha_deg,
        mach: condition.map(|c| c.mach),
        flight: row.value,
        standard_error: row.standard_deviation,
        flight_share_pct: row.flight_share_pct,
        tunnel,
    }
}

/// Compares the estimates of each maneuver with the tunnel at the maneuver's mean flight condition:
/// one row per estimate with a bound. The corrected bound is its standard error, or else the bound.
#[must_use]
pub fn compare_maneuvers(
    estimates: &[EstimateRow],
    maneuvers: &[Maneuver],
    tunnel: &WindTunnel,
    settings: &Settings,
) -> Vec<ManeuverComparisonRow> {
    let places: BTreeMap<&str, &Maneuver> = maneuvers
        .iter()
        .map(|m| (m.maneuver_id.as_str(), m))
        .collect();
    let row = |e: &EstimateRow| {
        let (flight, bound) = (e.value?, e.bound_corrected.or(e.bound)?);
        let maneuver = places.get(e.maneuver_id.as_str())?;
        let comparable = settings.is_comparable(&e.derivative);
        let value = tunnel
            .at(&e.derivative, &maneuver.condition(tunnel))
            .filter(|_| comparable);
        Some(ManeuverComparisonRow {
            maneuver_id: e.maneuver_id.clone(),
            class: e.class.clone(),
            derivative: e.derivative.clone(),
            unit: e.unit.clone(),
            alpha_deg: maneuver.alpha_deg,
            mach: maneuver.mach,
            flight,
            bound,
            tunnel: against_tunnel(flight, bound, value, settings),
        })
    };
    estimates
        .iter()
        .filter(|e| e.status == Status::Estimated)
        .filter_map(row)
        .collect()
}

/// Compares a flight value and its standard error with a reading of the tunnel.
fn against_tunnel(
    flight: f64,
    error: f64,
    tunnel: Option<TunnelValue>,
    settings: &Settings,
) -> TunnelDifference {
    let other = tunnel.map(|reading| (reading.value, reading.uncertainty));
    let judged = judge(flight, error, other, settings);
    TunnelDifference {
        wind_tunnel: tunnel.map(|reading| reading.value),
        difference: judged.difference,
        uncertainty: judged.uncertainty,
        difference_pct: judged.difference_pct,
        z: judged.z,
        verdict: judged.agreement.into(),
    }
}

/// Mean flight condition at an α of the maneuvers within half a step of it, or else of the nearest
/// maneuver.
fn condition_near<'a>(
    maneuvers: impl Iterator<Item = &'a Maneuver>,
    tunnel: &WindTunnel,
    alpha_deg: f64,
    step_deg: f64,
) -> Option<Condition> {
    let distance = |m: &Maneuver| (m.alpha_deg - alpha_deg).abs();
    let known: Vec<&Maneuver> = maneuvers
        .filter(|m| m.mach.is_finite() && m.alpha_deg.is_finite())
        .collect();
    let mut near: Vec<&Maneuver> = known
        .iter()
        .copied()
        .filter(|m| distance(m) <= 0.5 * step_deg)
        .collect();
    if near.is_empty() {
        near.extend(
            known
                .into_iter()
                .min_by(|a, b| distance(a).total_cmp(&distance(b))),
        );
    }
    let mean = |values: Vec<f64>| (!values.is_empty()).then(|| mean(values.iter().copied()));
    let mach = mean(near.iter().map(|m| m.mach).collect())?;
    let third = mean(
        near.iter()
            .filter_map(|m| m.condition(tunnel).third)
            .collect(),
    );
    Some(Condition {
        alpha_deg,
        mach,
        third,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aero::wind_tunnel::TunnelPoint;
    use approx::assert_relative_eq;

    fn flight(value: f64, standard_deviation: f64) -> PosteriorRow {
        PosteriorRow {
            derivative: "d".into(),
            unit: "per_deg".into(),
            alpha_deg: 20.0,
            mach: None,
            third: None,
            value,
            standard_deviation,
            lower_95: value - 2.0 * standard_deviation,
            upper_95: value + 2.0 * standard_deviation,
            wind_tunnel: None,
            prior_deviation: 1.0,
            flight_share_pct: Some(99.0),
            maneuvers: 3,
        }
    }

    fn maneuver(class: &str, alpha_deg: f64, mach: f64) -> Maneuver {
        Maneuver {
            class: class.into(),
            mach,
            ..Maneuver::example("m", alpha_deg)
        }
    }

    fn one(row: PosteriorRow, value: Option<f64>, settings: &Settings) -> ComparisonRow {
        let maneuvers = [maneuver("A", 20.3, 0.3)];
        let row = PosteriorRow {
            wind_tunnel: value,
            ..row
        };
        let groups = trend::Settings::default();
        let mut rows = compare_posterior(
            &[row],
            &maneuvers,
            &WindTunnel::default(),
            &groups,
            settings,
        );
        assert_eq!(rows.len(), 1);
        rows.remove(0)
    }

    fn verdict_on(row: PosteriorRow, value: f64) -> TunnelVerdict {
        one(row, Some(value), &Settings::default()).tunnel.verdict
    }

    #[test]
    fn flight_and_tunnel_agree_within_two_standard_errors() {
        assert_eq!(verdict_on(flight(1.19, 0.1), 1.0), TunnelVerdict::Agrees);
        assert_eq!(
            verdict_on(flight(1.21, 0.1), 1.0),
            TunnelVerdict::FlightHigher
        );
        assert_eq!(
            verdict_on(flight(0.79, 0.1), 1.0),
            TunnelVerdict::FlightLower
        );
    }

    #[test]
    fn a_tenth_of_the_information_is_nothing_learnt() {
        let with_share = |share: f64, maneuvers: usize| PosteriorRow {
            flight_share_pct: Some(share),
            maneuvers,
            ..flight(1.5, 0.1)
        };
        assert_eq!(
            verdict_on(with_share(9.9, 3), 1.0),
            TunnelVerdict::NothingLearnt
        );
        assert_eq!(
            verdict_on(with_share(10.1, 3), 1.0),
            TunnelVerdict::FlightHigher
        );
        assert_eq!(
            verdict_on(with_share(99.0, 0), 1.0),
            TunnelVerdict::NothingLearnt
        );
    }

    #[test]
    fn a_small_difference_agrees_however_well_it_is_determined() {
        assert_eq!(verdict_on(flight(-1.04, 1e-6), -1.0), TunnelVerdict::Agrees);
        assert_eq!(
            verdict_on(flight(-1.06, 1e-6), -1.0),
            TunnelVerdict::FlightLower
        );
        assert_eq!(
            verdict_on(flight(-0.94, 1e-6), -1.0),
            TunnelVerdict::FlightHigher
        );
    }

    #[test]
    fn signs_differ_only_where_flight_is_sure() {
        assert_eq!(
            verdict_on(flight(-0.5, 0.1), 1.0),
            TunnelVerdict::SignDiffers
        );
        assert_eq!(
            verdict_on(flight(-0.1, 0.1), 1.0),
            TunnelVerdict::FlightLower
        );
    }

    #[test]
    fn a_derivative_without_a_tunnel_value_has_its_own_verdict() {
        let none = one(flight(1.0, 0.1), None, &Settings::default());
        let settings = Settings {
            not_comparable: ["d".to_owned()].into(),
            ..Settings::default()
        };
        let refused = one(flight(1.0, 0.1), Some(1.0), &settings);
        for row in [none, refused] {
            assert_eq!(row.tunnel.verdict, TunnelVerdict::NoTunnelValue);
            assert_eq!(
                (
                    row.tunnel.wind_tunnel,
                    row.tunnel.difference,
                    row.tunnel.difference_pct,
                    row.tunnel.z
                ),
                (None, None, None, None)
            );
        }
    }

    #[test]
    fn the_numbers_of_a_row_are_those_of_their_definitions() {
        let row = one(flight(-1.5, 0.25), Some(-2.0), &Settings::default());
        assert_relative_eq!(row.tunnel.difference.expect("difference"), 0.5);
        assert_relative_eq!(row.tunnel.difference_pct.expect("percent"), 25.0);
        assert_relative_eq!(row.tunnel.z.expect("z"), 2.0);
        let zero = one(flight(1.0, 0.0), Some(0.0), &Settings::default());
        assert_eq!(
            (
                zero.tunnel.difference_pct,
                zero.tunnel.z,
                zero.tunnel.verdict
            ),
            (None, None, TunnelVerdict::FlightHigher)
        );
    }

    #[test]
    fn the_point_nearest_to_the_flown_mach_number_is_compared() {
        let group = trend::TrendGroup {
            name: "A".into(),
            classes: vec!["A".into()],
            ..trend::TrendGroup::default()
        };
        let groups = trend::Settings {
            groups: vec![group],
            ..trend::Settings::default()
        };
        let maneuvers = [
            maneuver("A", 19.0, 0.3),
            maneuver("A", 21.0, 0.4),
            maneuver("B", 20.0, 0.9),
        ];
        let at = |mach: f64| PosteriorRow {
            mach: Some(mach),
            wind_tunnel: Some(10.0 * mach),
            ..flight(3.5, 0.1)
        };
        let posterior = [at(0.2), at(0.4), at(0.6)];
        let tunnel = WindTunnel::default();
        let rows = compare_posterior(
            &posterior,
            &maneuvers,
            &tunnel,
            &groups,
            &Settings::default(),
        );
        assert_eq!(rows.len(), 1);
        assert_relative_eq!(rows[0].tunnel.wind_tunnel.expect("tunnel"), 4.0);
        assert_relative_eq!(rows[0].mach.expect("mach"), 0.35);
    }

    #[test]
    fn the_tunnel_is_compared_at_its_own_breakpoints_where_the_posterior_has_some() {
        let mut tunnel = WindTunnel::default();
        for alpha_deg in [12.5, 20.0] {
            tunnel.insert("d", TunnelPoint::new(alpha_deg, 1.0));
        }
        let at = |alpha_deg: f64| PosteriorRow {
            alpha_deg,
            ..flight(1.0, 0.1)
        };
        let alphas = |rows: &[PosteriorRow]| -> Vec<f64> {
            let maneuvers = [maneuver("A", 20.3, 0.3)];
            let groups = trend::Settings::default();
            let rows = compare_posterior(rows, &maneuvers, &tunnel, &groups, &Settings::default());
            rows.iter().map(|r| r.alpha_deg).collect()
        };
        assert_eq!(
            alphas(&[at(10.0), at(12.5), at(15.0), at(20.0)]),
            [12.5, 20.0]
        );
        assert_eq!(alphas(&[at(15.0), at(17.5)]), [15.0, 17.5]);
    }

    #[test]
    fn each_maneuver_is_compared_at_its_own_condition() {
        let mut tunnel = WindTunnel::default();
        for (alpha_deg, value) in [(20.0, 2.0), (30.0, 4.0)] {
            tunnel.insert(
                "d",
                TunnelPoint {
                    uncertainty: Some(0.3),
                    ..TunnelPoint::new(alpha_deg, value)
                },
            );
        }
        let maneuvers = [maneuver("A", 25.0, 0.3)];
        let mut estimate = EstimateRow {
            value: Some(4.0),
            bound: Some(0.1),
            bound_corrected: Some(0.4),
            ..EstimateRow::without_results(&maneuvers[0], "d", "per_deg", Status::Estimated)
        };
        let rows = compare_maneuvers(
            std::slice::from_ref(&estimate),
            &maneuvers,
            &tunnel,
            &Settings::default(),
        );
        assert_relative_eq!(rows[0].tunnel.wind_tunnel.expect("tunnel"), 3.0);
        assert_relative_eq!(
            rows[0].tunnel.uncertainty.expect("uncertainty"),
            0.5,
            max_relative = 1e-14
        );
        assert_relative_eq!(rows[0].tunnel.z.expect("z"), 2.0, max_relative = 1e-14);
        assert_relative_eq!(
            rows[0].tunnel.difference_pct.expect("percent"),
            100.0 / 3.0,
            max_relative = 1e-14
        );
        assert_eq!(rows[0].tunnel.verdict, TunnelVerdict::Agrees);
        estimate.status = Status::Held;
        assert_eq!(
            compare_maneuvers(&[estimate], &maneuvers, &tunnel, &Settings::default()),
            []
        );
    }
}
