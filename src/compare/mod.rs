//! Compare sets flight against the wind tunnel, derivative by derivative: the trend that speaks for
//! it at the tunnel's own breakpoints, and each maneuver at its own α and Mach number; and against
//! earlier campaigns.
//!
//! Where the tunnel has no breakpoint inside a trend it is read at the trend's α, else only at its
//! own. The Mach number is the mean at which the group's maneuvers were flown there. The difference
//! is judged by its standard error, z = (flight − tunnel) / √(standard error² + tunnel's
//! uncertainty²), with the tunnel's uncertainty where it states one.

pub mod against;
pub mod beyond;
pub mod ranges;

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::aero::{Condition, WindTunnel};
use crate::maneuver::{Maneuver, Status};
use crate::settings::settings;
use crate::tables::{
    ChangeVerdict, ComparisonRow, EstimateRow, ManeuverComparisonRow, TrendRow, TunnelVerdict,
};
use crate::trend;

settings! {
    /// Settings of the comparison with the wind tunnel and earlier campaigns.
    pub struct Settings {
        /// Derivatives whose tunnel values are not comparable with flight. Their rows have the verdict
        /// `no tunnel value`.
        pub not_comparable: BTreeSet<String> = BTreeSet::new(),
        /// Largest difference that counts as agreement, standard errors of the difference. Larger:
        /// more rows agree, and real differences go unreported.
        pub agreement_z: f64 = 2.0,
        /// Largest difference that counts as agreement whatever its standard error, percent of the
        /// tunnel's value. The default is about the repeatability of tunnel tests. Larger: more rows
        /// agree.
        pub agreement_pct: f64 = 5.0,
        /// Most rows of the table `disagreements`.
        pub worst: usize = 20,
        /// Folders with the published tables of earlier campaigns or nights. Each adds its trends to
        /// the comparison.
        pub against: Vec<PathBuf> = Vec::new(),
    }
}

impl Settings {
    fn comparable(&self, derivative: &str) -> bool {
        !self.not_comparable.contains(derivative)
    }
}

/// One row per derivative and α of the trend of the derivative's group, in the order of the trends:
/// at the tunnel's breakpoints where it has some there.
///
/// Verdicts: `no tunnel value`; `sign differs` where both are non-zero beyond their uncertainty and
/// on different sides of zero; `agrees` within `agreement_z` standard errors or `agreement_pct`
/// percent; else `flight higher` or `flight lower`, in the algebraic sense: −0.3 is lower than
/// −0.2. `difference_pct` is of the tunnel value's magnitude, so its sign says the same.
#[must_use]
pub fn comparison(
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
        let comparable = settings.comparable(&t.derivative);
        if comparable && !is_breakpoint(t.alpha_deg) && of_it().any(|o| is_breakpoint(o.alpha_deg))
        {
            return None;
        }
        let classes = maneuvers.iter().filter(|m| group.has(&m.class));
        let condition = condition_near(classes, tunnel, t.alpha_deg, groups.alpha_step_deg);
        let value = condition
            .filter(|_| comparable)
            .and_then(|condition| tunnel.at(&t.derivative, &condition));
        let judged = judge(
            t.value,
            t.standard_error,
            value.map(|w| (w.value, w.uncertainty)),
            settings,
        );
        Some(ComparisonRow {
            derivative: t.derivative.clone(),
            unit: t.unit.clone(),
            group: t.group.clone(),
            alpha_deg: t.alpha_deg,
            mach: condition.map(|c| c.mach),
            flight: t.value,
            standard_error: t.standard_error,
            wind_tunnel: value.map(|w| w.value),
            difference: judged.difference,
            uncertainty: judged.uncertainty,
            difference_pct: judged.difference_pct,
            z: judged.z,
            verdict: judged.agreement.into(),
        })
    };
    trends.iter().filter_map(row).collect()
}

/// One row per maneuver and derivative that it estimates with a bound, in the order of the
/// estimates: the tunnel at the maneuver's own mean flight condition. The error of the flight's
/// value is its corrected bound, else its bound.
#[must_use]
pub fn of_maneuvers(
    estimates: &[EstimateRow],
    maneuvers: &[Maneuver],
    tunnel: &WindTunnel,
    settings: &Settings,
) -> Vec<ManeuverComparisonRow> {
    let places: std::collections::BTreeMap<&str, &Maneuver> = maneuvers
        .iter()
        .map(|m| (m.maneuver_id.as_str(), m))
        .collect();
    let row = |e: &EstimateRow| {
        let (flight, bound) = (e.value?, e.bound_corrected.or(e.bound)?);
        let maneuver = places.get(e.maneuver_id.as_str())?;
        let comparable = settings.comparable(&e.derivative);
        let value = tunnel
            .at(&e.derivative, &maneuver.condition(tunnel))
            .filter(|_| comparable);
        let judged = judge(
            flight,
            bound,
            value.map(|w| (w.value, w.uncertainty)),
            settings,
        );
        Some(ManeuverComparisonRow {
            maneuver_id: e.maneuver_id.clone(),
            class: e.class.clone(),
            derivative: e.derivative.clone(),
            unit: e.unit.clone(),
            alpha_deg: maneuver.alpha_deg,
            mach: maneuver.mach,
            flight,
            bound,
            wind_tunnel: value.map(|w| w.value),
            difference: judged.difference,
            uncertainty: judged.uncertainty,
            difference_pct: judged.difference_pct,
            z: judged.z,
            verdict: judged.agreement.into(),
        })
    };
    estimates
        .iter()
        .filter(|e| e.status == Status::Estimated)
        .filter_map(row)
        .collect()
}

/// Mean flight condition of the maneuvers within half a step of α, or else of the nearest one, at
/// that α.
pub(crate) fn condition_near<'a>(
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

/// Result of comparing a value of flight with another value of the same derivative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Agreement {
    /// There is no other value.
    NoValue,
    Agrees,
    Higher,
    Lower,
    SignDiffers,
}

impl From<Agreement> for TunnelVerdict {
    fn from(agreement: Agreement) -> TunnelVerdict {
        match agreement {
            Agreement::NoValue => TunnelVerdict::NoTunnelValue,
            Agreement::Agrees => TunnelVerdict::Agrees,
            Agreement::Higher => TunnelVerdict::FlightHigher,
            Agreement::Lower => TunnelVerdict::FlightLower,
            Agreement::SignDiffers => TunnelVerdict::SignDiffers,
        }
    }
}

impl From<TunnelVerdict> for Agreement {
    fn from(verdict: TunnelVerdict) -> Agreement {
        match verdict {
            TunnelVerdict::NoTunnelValue => Agreement::NoValue,
            TunnelVerdict::Agrees => Agreement::Agrees,
            TunnelVerdict::FlightHigher => Agreement::Higher,
            TunnelVerdict::FlightLower => Agreement::Lower,
            TunnelVerdict::SignDiffers => Agreement::SignDiffers,
        }
    }
}

impl From<Agreement> for ChangeVerdict {
    fn from(agreement: Agreement) -> ChangeVerdict {
        match agreement {
            Agreement::NoValue => ChangeVerdict::NotThereBefore,
            Agreement::Agrees => ChangeVerdict::Agrees,
            Agreement::Higher => ChangeVerdict::Higher,
            Agreement::Lower => ChangeVerdict::Lower,
            Agreement::SignDiffers => ChangeVerdict::SignDiffers,
        }
    }
}

impl From<ChangeVerdict> for Agreement {
    fn from(verdict: ChangeVerdict) -> Agreement {
        match verdict {
            ChangeVerdict::NotThereBefore => Agreement::NoValue,
            ChangeVerdict::Agrees => Agreement::Agrees,
            ChangeVerdict::Higher => Agreement::Higher,
            ChangeVerdict::Lower => Agreement::Lower,
            ChangeVerdict::SignDiffers => Agreement::SignDiffers,
        }
    }
}

/// A value of flight beside another one.
pub(crate) struct Judged {
    pub difference: Option<f64>,
    /// Standard error of the difference.
    pub uncertainty: Option<f64>,
    /// Of the other value's magnitude.
    pub difference_pct: Option<f64>,
    pub z: Option<f64>,
    pub agreement: Agreement,
}

/// Judges a value with its standard error by another, whose own may not be known.
pub(crate) fn judge(
    flight: f64,
    error: f64,
    other: Option<(f64, Option<f64>)>,
    settings: &Settings,
) -> Judged {
    let Some((other, stated)) = other else {
        return Judged {
            difference: None,
            uncertainty: None,
            difference_pct: None,
            z: None,
            agreement: Agreement::NoValue,
        };
    };
    let other_error = stated.unwrap_or(0.0);
    let (difference, uncertainty) = (flight - other, error.hypot(other_error));
    let is_nonzero = |value: f64, error: f64| value.abs() > settings.agreement_z * error;
    let agreement =
        if flight * other < 0.0 && is_nonzero(flight, error) && is_nonzero(other, other_error) {
            Agreement::SignDiffers
        } else if difference.abs() <= settings.agreement_z * uncertainty
            || difference.abs() <= settings.agreement_pct / 100.0 * other.abs()
        {
            Agreement::Agrees
        } else if difference > 0.0 {
            Agreement::Higher
        } else {
            Agreement::Lower
        };
    let finite = |v: f64| v.is_finite().then_some(v);
    Judged {
        difference: Some(difference),
        uncertainty: Some(uncertainty),
        difference_pct: finite(100.0 * difference / other.abs()),
        z: finite(difference / uncertainty),
        agreement,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aero::Axis;
    use crate::aero::wind_tunnel::TunnelPoint;
    use crate::maneuver::ManeuverOrigin;
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
        let mut rows = comparison(
            &[trend],
            &maneuvers,
            tunnel,
            &trend::Settings::default(),
            settings,
        );
        assert_eq!(rows.len(), 1);
        rows.remove(0)
    }

    fn says(trend: TrendRow, value: f64, uncertainty: Option<f64>) -> TunnelVerdict {
        one(trend, &tunnel(value, uncertainty), &Settings::default()).verdict
    }

    #[test]
    fn flight_and_tunnel_agree_within_two_standard_errors() {
        assert_eq!(says(flight(1.19, 0.1), 1.0, None), TunnelVerdict::Agrees);
        assert_eq!(
            says(flight(1.21, 0.1), 1.0, None),
            TunnelVerdict::FlightHigher
        );
        assert_eq!(
            says(flight(0.79, 0.1), 1.0, None),
            TunnelVerdict::FlightLower
        );
    }

    #[test]
    fn the_tunnel_s_uncertainty_counts() {
        assert_eq!(
            says(flight(1.25, 0.1), 1.0, Some(0.1)),
            TunnelVerdict::Agrees
        );
        let row = one(
            flight(1.5, 0.3),
            &tunnel(1.0, Some(0.4)),
            &Settings::default(),
        );
        assert_relative_eq!(row.z.expect("z"), 1.0);
    }

    #[test]
    fn a_small_difference_agrees_however_well_it_is_determined() {
        assert_eq!(says(flight(-1.04, 1e-6), -1.0, None), TunnelVerdict::Agrees);
        assert_eq!(
            says(flight(-1.06, 1e-6), -1.0, None),
            TunnelVerdict::FlightLower
        );
        assert_eq!(
            says(flight(-0.94, 1e-6), -1.0, None),
            TunnelVerdict::FlightHigher
        );
    }

    #[test]
    fn signs_differ_only_where_both_are_sure() {
        assert_eq!(
            says(flight(-0.5, 0.1), 1.0, Some(0.1)),
            TunnelVerdict::SignDiffers
        );
        assert_eq!(
            says(flight(-0.1, 0.1), 1.0, Some(0.1)),
            TunnelVerdict::FlightLower
        );
        assert_eq!(
            says(flight(0.5, 0.1), -0.1, Some(0.1)),
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
            assert_eq!(row.verdict, TunnelVerdict::NoTunnelValue);
            assert_eq!(
                (row.wind_tunnel, row.difference, row.difference_pct, row.z),
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
        assert_relative_eq!(row.difference.expect("difference"), 0.5);
        assert_relative_eq!(row.difference_pct.expect("percent"), 25.0);
        assert_relative_eq!(row.z.expect("z"), 2.0);
        let zero = one(flight(1.0, 0.0), &tunnel(0.0, None), &Settings::default());
        assert_eq!(
            (zero.difference_pct, zero.z, zero.verdict),
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
        let rows = comparison(&trends, &maneuvers, &tunnel, &groups, &Settings::default());
        // The trend of class B does not speak for the derivative; no maneuver is within half a step
        // of 30°, and the nearest is that at 21°.
        assert_eq!(rows.len(), 2);
        assert_relative_eq!(
            rows[0].wind_tunnel.expect("tunnel"),
            3.5,
            max_relative = 1e-12
        );
        assert_relative_eq!(
            rows[1].wind_tunnel.expect("tunnel"),
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
            let rows = comparison(trends, &maneuvers, &tunnel, &groups, &Settings::default());
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
            held_because: None,
        };
        let rows = of_maneuvers(
            std::slice::from_ref(&estimate),
            &maneuvers,
            &tunnel,
            &Settings::default(),
        );
        assert_relative_eq!(rows[0].wind_tunnel.expect("tunnel"), 3.0);
        assert_relative_eq!(
            rows[0].uncertainty.expect("uncertainty"),
            0.5,
            max_relative = 1e-14
        );
        assert_relative_eq!(rows[0].z.expect("z"), 2.0, max_relative = 1e-14);
        assert_relative_eq!(
            rows[0].difference_pct.expect("percent"),
            100.0 / 3.0,
            max_relative = 1e-14
        );
        assert_eq!(rows[0].verdict, TunnelVerdict::Agrees);
        estimate.status = Status::Held;
        assert_eq!(
            of_maneuvers(&[estimate], &maneuvers, &tunnel, &Settings::default()),
            []
        );
    }
}
