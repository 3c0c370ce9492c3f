//! Compare sets flight against the wind tunnel, derivative by derivative, at each α of the trend that speaks for it.
//!
//! Flight is the trend of the derivative's group; the tunnel is read at that α and at the mean Mach number at which the
//! group's maneuvers were flown there. The difference is judged by its standard error,
//! z = (flight − tunnel) / √(standard error² + tunnel's uncertainty²), with the tunnel's uncertainty where it states one.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::aero::WindTunnel;
use crate::aero::wind_tunnel::TunnelValue;
use crate::maneuver::Maneuver;
use crate::tables::{ComparisonRow, TrendRow};
use crate::trend;

/// What the analyst decides about the comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Derivatives whose tunnel values, where the database holds any, are no measurements to compare with.
    #[serde(default)]
    pub not_comparable: BTreeSet<String>,
    /// Flight and tunnel agree when they differ by no more than this many standard errors. Default 2.
    #[serde(default = "default_agreement_z")]
    pub agreement_z: f64,
    /// They agree as well when they differ by no more than this share of the tunnel's value, in percent, however well
    /// the difference is determined. Default 5, about as well as tunnel tests repeat each other.
    #[serde(default = "default_agreement_pct")]
    pub agreement_pct: f64,
}

fn default_agreement_z() -> f64 {
    2.0
}
fn default_agreement_pct() -> f64 {
    5.0
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            not_comparable: BTreeSet::new(),
            agreement_z: default_agreement_z(),
            agreement_pct: default_agreement_pct(),
        }
    }
}

/// One row per derivative and α of the trend of the derivative's group, in the order of the trends.
///
/// Verdicts: `no tunnel value`; `sign differs` where both are non-zero beyond their uncertainty and on different sides of
/// zero; `agrees` within `agreement_z` standard errors or `agreement_pct` percent; else `flight higher` or `flight
/// lower`, in the algebraic sense: −0.3 is lower than −0.2. `difference_pct` is of the tunnel value's magnitude, so its
/// sign says the same.
#[must_use]
pub fn comparison(
    trends: &[TrendRow],
    maneuvers: &[Maneuver],
    tunnel: &WindTunnel,
    groups: &trend::Settings,
    settings: &Settings,
) -> Vec<ComparisonRow> {
    let row = |t: &TrendRow| {
        let group = groups.group_of(&t.derivative).filter(|g| g.name == t.group)?;
        let classes = maneuvers.iter().filter(|m| group.has(&m.class));
        let mach = mach_near(classes, t.alpha_deg, groups.alpha_step_deg);
        let comparable = !settings.not_comparable.contains(&t.derivative);
        let value = mach.filter(|_| comparable).and_then(|mach| tunnel.value(&t.derivative, t.alpha_deg, mach));
        Some(compared(t, value, settings))
    };
    trends.iter().filter_map(row).collect()
}

/// Mean Mach number of the maneuvers within half a step of α, or else of the nearest one.
fn mach_near<'a>(maneuvers: impl Iterator<Item = &'a Maneuver>, alpha_deg: f64, step_deg: f64) -> Option<f64> {
    let distance = |m: &Maneuver| (m.alpha_deg - alpha_deg).abs();
    let known: Vec<&Maneuver> = maneuvers.filter(|m| m.mach.is_finite() && m.alpha_deg.is_finite()).collect();
    let near: Vec<f64> = known.iter().filter(|m| distance(m) <= 0.5 * step_deg).map(|m| m.mach).collect();
    if near.is_empty() {
        known.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).map(|m| m.mach)
    } else {
        Some(near.iter().sum::<f64>() / near.len() as f64)
    }
}

fn compared(t: &TrendRow, tunnel: Option<TunnelValue>, settings: &Settings) -> ComparisonRow {
    let difference = tunnel.map(|w| t.value - w.value);
    let uncertainty = tunnel.and_then(|w| w.uncertainty).unwrap_or(0.0);
    let share = |d: f64, w: TunnelValue| 100.0 * d / w.value.abs();
    ComparisonRow {
        derivative: t.derivative.clone(),
        unit: t.unit.clone(),
        group: t.group.clone(),
        alpha_deg: t.alpha_deg,
        flight: t.value,
        standard_error: t.standard_error,
        wind_tunnel: tunnel.map(|w| w.value),
        difference,
        difference_pct: difference.zip(tunnel).map(|(d, w)| share(d, w)).filter(|p| p.is_finite()),
        z: difference.map(|d| d / t.standard_error.hypot(uncertainty)).filter(|z| z.is_finite()),
        verdict: tunnel.map_or("no tunnel value", |w| verdict(t, w, settings)).to_owned(),
    }
}

fn verdict(t: &TrendRow, tunnel: TunnelValue, settings: &Settings) -> &'static str {
    let uncertainty = tunnel.uncertainty.unwrap_or(0.0);
    let difference = t.value - tunnel.value;
    let is_nonzero = |value: f64, error: f64| value.abs() > settings.agreement_z * error;
    if t.value * tunnel.value < 0.0 && is_nonzero(t.value, t.standard_error) && is_nonzero(tunnel.value, uncertainty) {
        "sign differs"
    } else if difference.abs() <= settings.agreement_z * t.standard_error.hypot(uncertainty)
        || difference.abs() <= settings.agreement_pct / 100.0 * tunnel.value.abs()
    {
        "agrees"
    } else if difference > 0.0 {
        "flight higher"
    } else {
        "flight lower"
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aero::Axis;
    use crate::aero::wind_tunnel::TunnelPoint;
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
            origin: "found".into(),
        }
    }

    fn tunnel(value: f64, uncertainty: Option<f64>) -> WindTunnel {
        let mut tunnel = WindTunnel::default();
        tunnel.insert("d", TunnelPoint { alpha_deg: 20.0, mach: None, value, uncertainty, source: None });
        tunnel
    }

    fn one(trend: TrendRow, tunnel: &WindTunnel, settings: &Settings) -> ComparisonRow {
        let maneuvers = [maneuver("A", 20.3, 0.3)];
        let mut rows = comparison(&[trend], &maneuvers, tunnel, &trend::Settings::default(), settings);
        assert_eq!(rows.len(), 1);
        rows.remove(0)
    }

    fn says(trend: TrendRow, value: f64, uncertainty: Option<f64>) -> String {
        one(trend, &tunnel(value, uncertainty), &Settings::default()).verdict
    }

    #[test]
    fn flight_and_tunnel_agree_within_two_standard_errors() {
        assert_eq!(says(flight(1.19, 0.1), 1.0, None), "agrees");
        assert_eq!(says(flight(1.21, 0.1), 1.0, None), "flight higher");
        assert_eq!(says(flight(0.79, 0.1), 1.0, None), "flight lower");
    }

    #[test]
    fn the_tunnel_s_uncertainty_counts() {
        assert_eq!(says(flight(1.25, 0.1), 1.0, Some(0.1)), "agrees");
        let row = one(flight(1.5, 0.3), &tunnel(1.0, Some(0.4)), &Settings::default());
        assert_relative_eq!(row.z.expect("z"), 1.0);
    }

    #[test]
    fn a_small_difference_agrees_however_well_it_is_determined() {
        assert_eq!(says(flight(-1.04, 1e-6), -1.0, None), "agrees");
        assert_eq!(says(flight(-1.06, 1e-6), -1.0, None), "flight lower");
        assert_eq!(says(flight(-0.94, 1e-6), -1.0, None), "flight higher");
    }

    #[test]
    fn signs_differ_only_where_both_are_sure() {
        assert_eq!(says(flight(-0.5, 0.1), 1.0, Some(0.1)), "sign differs");
        assert_eq!(says(flight(-0.1, 0.1), 1.0, Some(0.1)), "flight lower");
        assert_eq!(says(flight(0.5, 0.1), -0.1, Some(0.1)), "flight higher");
    }

    #[test]
    fn a_derivative_without_a_tunnel_value_says_so() {
        let none = one(flight(1.0, 0.1), &WindTunnel::default(), &Settings::default());
        let settings = Settings { not_comparable: ["d".to_owned()].into(), ..Settings::default() };
        let refused = one(flight(1.0, 0.1), &tunnel(1.0, None), &settings);
        for row in [none, refused] {
            assert_eq!(row.verdict, "no tunnel value");
            assert_eq!((row.wind_tunnel, row.difference, row.difference_pct, row.z), (None, None, None, None));
        }
    }

    #[test]
    fn the_numbers_of_a_row_are_those_of_their_definitions() {
        let row = one(flight(-1.5, 0.25), &tunnel(-2.0, None), &Settings::default());
        assert_relative_eq!(row.difference.expect("difference"), 0.5);
        assert_relative_eq!(row.difference_pct.expect("percent"), 25.0);
        assert_relative_eq!(row.z.expect("z"), 2.0);
        let zero = one(flight(1.0, 0.0), &tunnel(0.0, None), &Settings::default());
        assert_eq!((zero.difference_pct, zero.z, zero.verdict.as_str()), (None, None, "flight higher"));
    }

    #[test]
    fn the_tunnel_is_read_at_the_mach_of_the_group_s_maneuvers_near_that_alpha() {
        let mut tunnel = WindTunnel::default();
        for (mach, value) in [(0.2, 2.0), (0.6, 6.0)] {
            let point = TunnelPoint { alpha_deg: 20.0, mach: Some(mach), value, uncertainty: None, source: None };
            tunnel.insert("d", point);
        }
        let group = trend::Group { name: "A".into(), classes: vec!["A".into()], ..trend::Group::default() };
        let groups = trend::Settings { groups: vec![group], ..trend::Settings::default() };
        let maneuvers =
            [maneuver("A", 19.0, 0.3), maneuver("A", 21.0, 0.4), maneuver("B", 20.0, 0.6), maneuver("A", 40.0, 0.2)];
        let of = |group: &str, alpha_deg: f64| TrendRow { group: group.into(), alpha_deg, ..flight(3.5, 0.1) };
        let trends = [of("A", 20.0), of("B", 20.0), of("A", 30.0)];
        let rows = comparison(&trends, &maneuvers, &tunnel, &groups, &Settings::default());
        // The trend of class B does not speak for the derivative; no maneuver is within half a step of 30°,
        // and the nearest is that at 21°.
        assert_eq!(rows.len(), 2);
        assert_relative_eq!(rows[0].wind_tunnel.expect("tunnel"), 3.5, max_relative = 1e-12);
        assert_relative_eq!(rows[1].wind_tunnel.expect("tunnel"), 4.0, max_relative = 1e-12);
    }
}
