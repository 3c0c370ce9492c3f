//! Comparison of flight with the wind tunnel: trends at the tunnel's breakpoints, and each maneuver
//! at its own flight condition.

use std::collections::BTreeMap;

use super::judgement::judge;
use super::settings::Settings;
use crate::aero::wind_tunnel::TunnelValue;
use crate::aero::{Condition, WindTunnel};
use crate::maneuver::{Maneuver, Status};
use crate::tables::{
    ComparisonRow, EstimateRow, ManeuverComparisonRow, TrendRow, TunnelDifference,
};
use crate::trend;

/// Compares the trend of each derivative's group with the tunnel: one row per derivative and α, in
/// the order of the trends, at the tunnel's breakpoints where it has some there.
///
/// The verdict is `sign differs` where both are non-zero beyond their uncertainty and on different
/// sides of zero; `agrees` within `agreement_z` standard errors or `agreement_pct` percent; else
/// `flight higher` or `flight lower` in the algebraic sense: −0.3 is lower than −0.2.
/// `difference_pct` is in percent of the tunnel value's magnitude, so it has the same sign.
#[must_use]
pub fn compare_trends(
    trends: &[TrendRow],
    maneuvers: &[Maneuver],
    tunnel: &WindTunnel,
    groups: &trend::Settings,
    settings: &Settings,
) -> Vec<ComparisonRow> {
    let row = |t: &TrendRow| {
        let group = groups
            .group_of(&t.derivative)
            .filter(|g| g.name == t.group)?;
        let of_it = || {
            trends
                .iter()
                .filter(|o| o.derivative == t.derivative && o.group == t.group)
        };
        let breakpoints = tunnel.alphas_deg(&t.derivative);
        let is_breakpoint = |alpha: f64| {
            breakpoints
                .binary_search_by(|b| b.total_cmp(&alpha))
                .is_ok()
        };
        let comparable = settings.is_comparable(&t.derivative);
        if comparable && !is_breakpoint(t.alpha_deg) && of_it().any(|o| is_breakpoint(o.alpha_deg))
        {
            return None;
        }
        let classes = maneuvers.iter().filter(|m| group.has(&m.class));
        let condition = condition_near(classes, tunnel, t.alpha_deg, groups.alpha_step_deg);
        let value = condition
            .filter(|_| comparable)
            .and_then(|condition| tunnel.at(&t.derivative, &condition));
        Some(ComparisonRow {
            derivative: t.derivative.clone(),
            unit: t.unit.clone(),
            group: t.group.clone(),
            alpha_deg: t.alpha_deg,
            mach: condition.map(|c| c.mach),
            flight: t.value,
            standard_error: t.standard_error,
            tunnel: against_tunnel(t.value, t.standard_error, value, settings),
        })
    };
    trends.iter().filter_map(row).collect()
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

/// Compares a value of flight and its standard error with a reading of the tunnel.
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
    let mean = |values: Vec<f64>| {
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
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
    use crate::aero::Axis;
    use crate::aero::wind_tunnel::TunnelPoint;
    use crate::maneuver::ManeuverOrigin;
    use crate::tables::TunnelVerdict;
    use approx::assert_relative_eq;

    fn flight(value: f64, standard_error: f64) -> TrendRow {
        TrendRow {
            derivative: "d".into(),
            unit: "per_deg".into(),
            group: "all".into(),
            alpha_deg: 20.0,
            value,
            standard_error,
            lower_95: value - 2.0 * standard_error,
            upper_95: value + 2.0 * standard_error,
            prediction_lower_95: 0.0,
            prediction_upper_95: 0.0,
            outliers: 0,
            curve: "polynomial".into(),
            maneuvers: 10,
            order: 1,
            scatter: 0.0,
        }
    }

    fn maneuver(class: &str, alpha_deg: f64, mach: f64) -> Maneuver {
        Maneuver {
            maneuver_id: String::new(),
            flight_id: String::new(),
            class: class.into(),
            axis: Axis::Longitudinal,
            start_s: 0.0,
            end_s: 10.0,
            alpha_deg,
            mach,
            qbar_psf: 50.0,
            velocity_ft_s: 300.0,
            altitude_ft: 25e3,
            mass_slug: 1050.0,
            x_cg_ft: 38.0,
            samples: 401,
            origin: ManeuverOrigin::Found,
            recognised: crate::maneuver::Recognised::default(),
            quality: crate::maneuver::Quality::default(),
        }
    }

    fn tunnel(value: f64, uncertainty: Option<f64>) -> WindTunnel {
        let mut tunnel = WindTunnel::default();
        tunnel.insert(
            "d",
            TunnelPoint {
                alpha_deg: 20.0,
                mach: None,
                value,
                uncertainty,
                source: None,
            },
        );
        tunnel
    }

    fn one(trend: TrendRow, tunnel: &WindTunnel, settings: &Settings) -> ComparisonRow {
        let maneuvers = [maneuver("A", 20.3, 0.3)];
        let mut rows = compare_trends(
            &[trend],
            &maneuvers,
            tunnel,
            &trend::Settings::default(),
            settings,
        );
        assert_eq!(rows.len(), 1);
        rows.remove(0)
    }

    fn verdict_on(trend: TrendRow, value: f64, uncertainty: Option<f64>) -> TunnelVerdict {
        one(trend, &tunnel(value, uncertainty), &Settings::default())
            .tunnel
            .verdict
    }

    #[test]
    fn flight_and_tunnel_agree_within_two_standard_errors() {
        assert_eq!(
            verdict_on(flight(1.19, 0.1), 1.0, None),
            TunnelVerdict::Agrees
        );
        assert_eq!(
            verdict_on(flight(1.21, 0.1), 1.0, None),
            TunnelVerdict::FlightHigher
        );
        assert_eq!(
            verdict_on(flight(0.79, 0.1), 1.0, None),
            TunnelVerdict::FlightLower
        );
    }

    #[test]
    fn the_tunnel_s_uncertainty_counts() {
        assert_eq!(
            verdict_on(flight(1.25, 0.1), 1.0, Some(0.1)),
            TunnelVerdict::Agrees
        );
        let row = one(
            flight(1.5, 0.3),
            &tunnel(1.0, Some(0.4)),
            &Settings::default(),
        );
        assert_relative_eq!(row.tunnel.z.expect("z"), 1.0);
    }

    #[test]
    fn a_small_difference_agrees_however_well_it_is_determined() {
        assert_eq!(
            verdict_on(flight(-1.04, 1e-6), -1.0, None),
            TunnelVerdict::Agrees
        );
        assert_eq!(
            verdict_on(flight(-1.06, 1e-6), -1.0, None),
            TunnelVerdict::FlightLower
        );
        assert_eq!(
            verdict_on(flight(-0.94, 1e-6), -1.0, None),
            TunnelVerdict::FlightHigher
        );
    }

    #[test]
    fn signs_differ_only_where_both_are_sure() {
        assert_eq!(
            verdict_on(flight(-0.5, 0.1), 1.0, Some(0.1)),
            TunnelVerdict::SignDiffers
        );
        assert_eq!(
            verdict_on(flight(-0.1, 0.1), 1.0, Some(0.1)),
            TunnelVerdict::FlightLower
        );
        assert_eq!(
            verdict_on(flight(0.5, 0.1), -0.1, Some(0.1)),
            TunnelVerdict::FlightHigher
        );
    }

    #[test]
    fn a_derivative_without_a_tunnel_value_says_so() {
        let none = one(
            flight(1.0, 0.1),
            &WindTunnel::default(),
            &Settings::default(),
        );
        let settings = Settings {
            not_comparable: ["d".to_owned()].into(),
            ..Settings::default()
        };
        let refused = one(flight(1.0, 0.1), &tunnel(1.0, None), &settings);
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
        let row = one(
            flight(-1.5, 0.25),
            &tunnel(-2.0, None),
            &Settings::default(),
        );
        assert_relative_eq!(row.tunnel.difference.expect("difference"), 0.5);
        assert_relative_eq!(row.tunnel.difference_pct.expect("percent"), 25.0);
        assert_relative_eq!(row.tunnel.z.expect("z"), 2.0);
        let zero = one(flight(1.0, 0.0), &tunnel(0.0, None), &Settings::default());
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
    fn the_tunnel_is_read_at_the_mach_of_the_group_s_maneuvers_near_that_alpha() {
        let mut tunnel = WindTunnel::default();
        for (alpha_deg, mach, value) in [
            (20.0, 0.2, 2.0),
            (20.0, 0.6, 6.0),
            (30.0, 0.2, 2.0),
            (30.0, 0.6, 6.0),
        ] {
            let point = TunnelPoint {
                alpha_deg,
                mach: Some(mach),
                value,
                uncertainty: None,
                source: None,
            };
            tunnel.insert("d", point);
        }
        let group = trend::Group {
            name: "A".into(),
            classes: vec!["A".into()],
            ..trend::Group::default()
        };
        let groups = trend::Settings {
            groups: vec![group],
            ..trend::Settings::default()
        };
        let maneuvers = [
            maneuver("A", 19.0, 0.3),
            maneuver("A", 21.0, 0.4),
            maneuver("B", 20.0, 0.6),
            maneuver("A", 40.0, 0.2),
        ];
        let of = |group: &str, alpha_deg: f64| TrendRow {
            group: group.into(),
            alpha_deg,
            ..flight(3.5, 0.1)
        };
        let trends = [of("A", 20.0), of("B", 20.0), of("A", 30.0)];
        let rows = compare_trends(&trends, &maneuvers, &tunnel, &groups, &Settings::default());
        // The trend of class B does not speak for the derivative; no maneuver is within half a step
        // of 30°, and the nearest is that at 21°.
        assert_eq!(rows.len(), 2);
        assert_relative_eq!(
            rows[0].tunnel.wind_tunnel.expect("tunnel"),
            3.5,
            max_relative = 1e-12
        );
        assert_relative_eq!(
            rows[1].tunnel.wind_tunnel.expect("tunnel"),
            4.0,
            max_relative = 1e-12
        );
    }

    #[test]
    fn the_tunnel_is_compared_at_its_own_breakpoints_where_a_trend_has_some() {
        let mut tunnel = WindTunnel::default();
        for alpha_deg in [12.5, 20.0] {
            tunnel.insert(
                "d",
                TunnelPoint {
                    alpha_deg,
                    mach: None,
                    value: 1.0,
                    uncertainty: None,
                    source: None,
                },
            );
        }
        let at = |alpha_deg: f64| TrendRow {
            alpha_deg,
            ..flight(1.0, 0.1)
        };
        let alphas = |trends: &[TrendRow]| -> Vec<f64> {
            let maneuvers = [maneuver("A", 20.3, 0.3)];
            let groups = trend::Settings::default();
            let rows = compare_trends(trends, &maneuvers, &tunnel, &groups, &Settings::default());
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
                    alpha_deg,
                    mach: None,
                    value,
                    uncertainty: Some(0.3),
                    source: None,
                },
            );
        }
        let maneuvers = [Maneuver {
            maneuver_id: "m".into(),
            ..maneuver("A", 25.0, 0.3)
        }];
        let mut estimate = EstimateRow {
            maneuver_id: "m".into(),
            flight_id: "f".into(),
            class: "A".into(),
            alpha_deg: 25.0,
            mach: 0.3,
            derivative: "d".into(),
            unit: "per_deg".into(),
            status: Status::Estimated,
            value: Some(4.0),
            bound: Some(0.1),
            bound_held: None,
            bound_calibration: None,
            bound_corrected: Some(0.4),
            wind_tunnel: None,
            variance_inflation: None,
            excitation: None,
            contribution_pct: None,
            equation_error: None,
            equation_error_bound: None,
            held_because: None,
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
