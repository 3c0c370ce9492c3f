//! Verdicts in words: neighbouring angles of attack with the same verdict become one range and one
//! sentence. Ranges that disagree are ranked by their largest difference over the derivative's size.

use super::judgement::Agreement;
use super::settings::Settings;
use crate::aero::WindTunnel;
use crate::numerics::statistics::mean::mean;
use crate::numerics::statistics::order_statistics::median;
use crate::tables::{ChangeRow, ComparisonRow, DisagreementRow, Verdict, VerdictRow};

/// Comparison at one angle of attack, with the tunnel or an earlier campaign.
#[derive(Clone, Copy, Debug)]
struct ComparedAlpha<'a> {
    derivative: &'a str,
    unit: &'a str,
    group: &'a str,
    alpha_deg: f64,
    verdict: Verdict,
    agreement: Agreement,
    flight: f64,
    other: Option<f64>,
    difference_pct: Option<f64>,
    z: Option<f64>,
    /// Standard error of the difference in percent of the other value.
    error_pct: Option<f64>,
}

impl<'a> ComparedAlpha<'a> {
    fn of_tunnel(r: &'a ComparisonRow) -> ComparedAlpha<'a> {
        ComparedAlpha {
            derivative: &r.derivative,
            unit: &r.unit,
            group: &r.group,
            alpha_deg: r.alpha_deg,
            verdict: Verdict::Tunnel(r.tunnel.verdict),
            agreement: r.tunnel.verdict.into(),
            flight: r.flight,
            other: r.tunnel.wind_tunnel,
            difference_pct: r.tunnel.difference_pct,
            z: r.tunnel.z,
            error_pct: share(r.tunnel.uncertainty, r.tunnel.wind_tunnel),
        }
    }

    fn of_change(r: &'a ChangeRow) -> ComparedAlpha<'a> {
        ComparedAlpha {
            derivative: &r.derivative,
            unit: &r.unit,
            group: &r.group,
            alpha_deg: r.alpha_deg,
            verdict: Verdict::Change(r.verdict),
            agreement: r.verdict.into(),
            flight: r.flight,
            other: r.before,
            difference_pct: r.difference_pct,
            z: r.z,
            error_pct: share(
                Some(
                    r.standard_error
                        .hypot(r.before_standard_error.unwrap_or(0.0)),
                ),
                r.before,
            ),
        }
    }
}

/// A value in percent of another's magnitude.
fn share(value: Option<f64>, other: Option<f64>) -> Option<f64> {
    let share = 100.0 * value? / other?.abs();
    share.is_finite().then_some(share)
}

/// Ranges of the comparison with the tunnel, and the worst ranges.
#[must_use]
pub fn ranges_of_tunnel(
    rows: &[ComparisonRow],
    tunnel: &WindTunnel,
    settings: &Settings,
) -> (Vec<VerdictRow>, Vec<DisagreementRow>) {
    let compared: Vec<ComparedAlpha> = rows.iter().map(ComparedAlpha::of_tunnel).collect();
    ranges(&compared, "wind tunnel", "tunnel", settings, |name| {
        tunnel.root_mean_square(name)
    })
}

/// Ranges of the comparison with one earlier campaign, and the worst ranges.
#[must_use]
pub fn ranges_of_changes(
    rows: &[ChangeRow],
    against: &str,
    settings: &Settings,
) -> (Vec<VerdictRow>, Vec<DisagreementRow>) {
    let compared: Vec<ComparedAlpha> = rows
        .iter()
        .filter(|r| r.against == against)
        .map(ComparedAlpha::of_change)
        .collect();
    let size = |name: &str| {
        let values: Vec<f64> = compared
            .iter()
            .filter(|p| p.derivative == name)
            .filter_map(|p| p.other)
            .collect();
        mean(values.iter().map(|v| v * v)).sqrt()
    };
    ranges(&compared, against, against, settings, size)
}

fn ranges(
    compared: &[ComparedAlpha],
    against: &str,
    called: &str,
    settings: &Settings,
    size: impl Fn(&str) -> f64,
) -> (Vec<VerdictRow>, Vec<DisagreementRow>) {
    let (mut verdicts, mut worst) = (Vec::new(), Vec::new());
    let same_trend =
        |a: &ComparedAlpha, b: &ComparedAlpha| a.derivative == b.derivative && a.group == b.group;
    for derivative in compared.chunk_by(same_trend) {
        let mut done = 0_usize;
        for run in derivative.chunk_by(|a, b| a.verdict == b.verdict) {
            let before = done.checked_sub(1).map(|i| derivative[i].alpha_deg);
            done += run.len();
            let (first, last) = (run[0], run[run.len() - 1]);
            let words = range_in_words(run, before, done == derivative.len(), called, settings);
            verdicts.push(VerdictRow {
                against: against.to_owned(),
                derivative: first.derivative.to_owned(),
                unit: first.unit.to_owned(),
                group: first.group.to_owned(),
                alpha_from_deg: first.alpha_deg,
                alpha_to_deg: last.alpha_deg,
                verdict: first.verdict,
                difference_pct: median(run.iter().filter_map(|p| p.difference_pct)),
                words: words.clone(),
            });
            worst.extend(disagreement(run, against, size(first.derivative), words));
        }
    }
    let size_of = |row: &DisagreementRow| row.size_pct.unwrap_or(0.0);
    worst.sort_by(|a, b| size_of(b).total_cmp(&size_of(a)));
    worst.truncate(settings.worst);
    for (i, row) in worst.iter_mut().enumerate() {
        row.rank = i + 1;
    }
    (verdicts, worst)
}

/// The worst angle of attack of a range that disagrees.
fn disagreement(
    run: &[ComparedAlpha],
    against: &str,
    size: f64,
    words: String,
) -> Option<DisagreementRow> {
    let apart = |p: &ComparedAlpha| p.other.map(|other| p.flight - other);
    let disagrees = !matches!(run[0].agreement, Agreement::Agrees | Agreement::NoValue);
    let distance = |p: &ComparedAlpha| apart(p).map_or(0.0, f64::abs);
    let p = run
        .iter()
        .filter(|_| disagrees)
        .max_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    let difference = apart(p)?;
    Some(DisagreementRow {
        rank: 0,
        against: against.to_owned(),
        derivative: p.derivative.to_owned(),
        unit: p.unit.to_owned(),
        alpha_deg: p.alpha_deg,
        flight: p.flight,
        other: p.other?,
        difference,
        z: p.z,
        size_pct: Some(100.0 * difference.abs() / size).filter(|s| s.is_finite()),
        words,
    })
}

/// Describes one range of equal verdicts.
fn range_in_words(
    run: &[ComparedAlpha],
    before_deg: Option<f64>,
    to_the_end: bool,
    called: &str,
    settings: &Settings,
) -> String {
    let (first, last) = (run[0], run[run.len() - 1]);
    let range = if run.len() == 1 {
        format!("at {}°", first.alpha_deg)
    } else {
        format!("from {}° to {}°", first.alpha_deg, last.alpha_deg)
    };
    match first.agreement {
        Agreement::Agrees
            if run
                .iter()
                .all(|p| p.z.is_some_and(|z| z.abs() <= settings.agreement_z)) =>
        {
            format!("agrees within its uncertainty {range}")
        }
        Agreement::Agrees => format!(
            "agrees within its uncertainty or {}% {range}",
            settings.agreement_pct
        ),
        Agreement::Higher => {
            format!(
                "flight higher than {called} {range}{}",
                extent_in_words(run)
            )
        }
        Agreement::Lower => {
            format!("flight lower than {called} {range}{}", extent_in_words(run))
        }
        Agreement::SignDiffers => match before_deg.filter(|_| to_the_end) {
            Some(before) => format!("sign differs above {before}°"),
            None => format!("sign differs {range}"),
        },
        Agreement::NoValue => format!("{} {range}", first.verdict),
    }
}

/// Size of a disagreement in words: the median in percent of the other value's magnitude, with the
/// extremes if they are far from the median. If the other value is zero, the size is in the
/// derivative's unit.
fn extent_in_words(run: &[ComparedAlpha]) -> String {
    let mut shares: Vec<f64> = run
        .iter()
        .filter_map(|p| p.difference_pct)
        .map(f64::abs)
        .collect();
    shares.sort_by(f64::total_cmp);
    let percent = |share: f64| {
        if share < 9.95 {
            format!("{share:.1}%")
        } else {
            format!("{share:.0}%")
        }
    };
    let error = median(run.iter().filter_map(|p| p.error_pct));
    let error = error.map_or_else(String::new, |error| format!(" ± {}", percent(error)));
    match (
        median(shares.iter().copied()),
        shares.first(),
        shares.last(),
    ) {
        (Some(middle), Some(least), Some(most)) if most - least > 0.5 * middle => {
            format!(
                ", by {}{error} ({} to {})",
                percent(middle),
                percent(*least),
                percent(*most)
            )
        }
        (Some(middle), ..) => format!(", by {}{error}", percent(middle)),
        _ => {
            let apart = run
                .iter()
                .filter_map(|p| p.other.map(|other| (p.flight - other).abs()));
            median(apart).map_or_else(String::new, |apart| {
                format!(", by {apart:.3e} {}", run[0].unit)
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aero::wind_tunnel::TunnelPoint;
    use crate::tables::{TunnelDifference, TunnelVerdict};
    use approx::assert_relative_eq;

    fn row(
        alpha_deg: f64,
        flight: f64,
        tunnel: Option<f64>,
        verdict: TunnelVerdict,
    ) -> ComparisonRow {
        ComparisonRow {
            derivative: "d".into(),
            unit: "per_deg".into(),
            group: "all".into(),
            alpha_deg,
            mach: Some(0.3),
            flight,
            standard_error: 0.1,
            flight_share_pct: Some(99.0),
            tunnel: TunnelDifference {
                wind_tunnel: tunnel,
                difference: tunnel.map(|t| flight - t),
                uncertainty: tunnel.map(|_| 0.1),
                difference_pct: tunnel
                    .filter(|t| *t != 0.0)
                    .map(|t| 100.0 * (flight - t) / t.abs()),
                z: tunnel.map(|t| (flight - t) / 0.1),
                verdict,
            },
        }
    }

    fn tunnel() -> WindTunnel {
        let mut tunnel = WindTunnel::default();
        tunnel.insert("d", TunnelPoint::new(0.0, 2.0));
        tunnel
    }

    fn sentences(rows: &[ComparisonRow]) -> Vec<String> {
        ranges_of_tunnel(rows, &tunnel(), &Settings::default())
            .0
            .into_iter()
            .map(|v| v.words)
            .collect()
    }

    #[test]
    fn neighbours_with_one_verdict_become_one_sentence() {
        let rows = [
            row(5.0, 2.1, Some(2.0), TunnelVerdict::Agrees),
            row(10.0, 2.1, Some(2.0), TunnelVerdict::Agrees),
            row(35.0, 1.4, Some(2.0), TunnelVerdict::FlightLower),
            row(40.0, 1.4, Some(2.0), TunnelVerdict::FlightLower),
            row(60.0, 1.38, Some(2.0), TunnelVerdict::FlightLower),
        ];
        assert_eq!(
            sentences(&rows),
            [
                "agrees within its uncertainty from 5° to 10°",
                "flight lower than tunnel from 35° to 60°, by 30% ± 5.0%"
            ]
        );
    }

    #[test]
    fn a_sign_that_differs_to_the_end_differs_above_the_last_that_does_not() {
        let rows = [
            row(35.0, 2.0, None, TunnelVerdict::NoTunnelValue),
            row(40.0, 2.5, Some(0.0), TunnelVerdict::FlightHigher),
            row(45.0, 1.0, Some(-2.0), TunnelVerdict::SignDiffers),
            row(50.0, 1.0, Some(-2.0), TunnelVerdict::SignDiffers),
        ];
        assert_eq!(
            sentences(&rows),
            [
                "no tunnel value at 35°",
                "flight higher than tunnel at 40°, by 2.500e0 per_deg",
                "sign differs above 40°"
            ]
        );
    }

    #[test]
    fn uneven_differences_have_their_extremes_in_words() {
        let rows = [
            row(5.0, 2.2, Some(2.0), TunnelVerdict::FlightHigher),
            row(10.0, 2.6, Some(2.0), TunnelVerdict::FlightHigher),
            row(15.0, 3.0, Some(2.0), TunnelVerdict::FlightHigher),
        ];
        assert_eq!(
            sentences(&rows),
            ["flight higher than tunnel from 5° to 15°, by 30% ± 5.0% (10% to 50%)"]
        );
    }

    #[test]
    fn agreement_by_percent_alone_is_worded_as_such() {
        assert_eq!(
            sentences(&[row(5.0, 2.3, Some(2.0), TunnelVerdict::Agrees)]),
            ["agrees within its uncertainty or 5% at 5°"]
        );
    }

    #[test]
    fn the_worst_disagreement_is_the_one_furthest_apart_for_the_derivative_s_size() {
        let rows = [
            row(5.0, 0.05, Some(0.01), TunnelVerdict::FlightHigher),
            row(10.0, 2.0, Some(2.0), TunnelVerdict::Agrees),
            row(15.0, 1.5, Some(2.0), TunnelVerdict::FlightLower),
            row(20.0, 1.2, Some(2.0), TunnelVerdict::FlightLower),
        ];
        let (_, worst) = ranges_of_tunnel(&rows, &tunnel(), &Settings::default());
        assert_eq!(
            worst
                .iter()
                .map(|w| (w.rank, w.alpha_deg))
                .collect::<Vec<_>>(),
            [(1, 20.0), (2, 5.0)]
        );
        assert_relative_eq!(worst[0].size_pct.expect("size"), 40.0, max_relative = 1e-12);
        assert_relative_eq!(worst[1].size_pct.expect("size"), 2.0, max_relative = 1e-12);
        let one = Settings {
            worst: 1,
            ..Settings::default()
        };
        assert_eq!(ranges_of_tunnel(&rows, &tunnel(), &one).1.len(), 1);
    }
}
