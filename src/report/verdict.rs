//! The verdicts of one derivative across angle of attack, put into one line: equal verdicts side by
//! side become a range.

use std::fmt::Write;

use super::notation::angle;
use crate::tables::ComparisonRow;

/// Neighbouring angles of attack with the same verdict.
#[derive(Clone, Debug, PartialEq)]
pub struct Run<'a> {
    pub verdict: &'a str,
    pub from_deg: f64,
    pub to_deg: f64,
    /// Where its cell begins and ends in the strip: half way to its neighbours.
    left_deg: f64,
    right_deg: f64,
}

/// The runs of rows that are sorted by angle of attack.
#[must_use]
pub fn runs<'a>(rows: &[&'a ComparisonRow]) -> Vec<Run<'a>> {
    let mut runs: Vec<Run> = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        let alpha = row.alpha_deg;
        let before = i
            .checked_sub(1)
            .and_then(|j| rows.get(j))
            .map(|r| alpha - r.alpha_deg);
        let after = rows.get(i + 1).map(|r| r.alpha_deg - alpha);
        let left_deg = alpha - 0.5 * before.or(after).unwrap_or(1.0);
        let right_deg = alpha + 0.5 * after.or(before).unwrap_or(1.0);
        match runs.last_mut() {
            Some(run) if run.verdict == row.verdict => {
                run.to_deg = alpha;
                run.right_deg = right_deg;
            }
            _ => runs.push(Run {
                verdict: &row.verdict,
                from_deg: alpha,
                to_deg: alpha,
                left_deg,
                right_deg,
            }),
        }
    }
    runs
}

/// More runs than these are read more easily by verdict than by angle of attack.
const MOST_RUNS: usize = 4;

/// The runs in words: `agrees 5°–25°, flight lower 30°–60°`; many of them by verdict, the most
/// frequent first: `agrees 5°, 15°–30°; flight lower 10°, 35°–60°`.
#[must_use]
pub fn phrase(runs: &[Run]) -> String {
    if runs.len() <= MOST_RUNS {
        let words: Vec<String> = runs
            .iter()
            .map(|run| format!("{} {}", run.verdict, run.range()))
            .collect();
        return words.join(", ");
    }
    let mut verdicts: Vec<&str> = Vec::new();
    for run in runs {
        if !verdicts.contains(&run.verdict) {
            verdicts.push(run.verdict);
        }
    }
    let of = |verdict: &str| {
        runs.iter()
            .filter(|run| run.verdict == verdict)
            .collect::<Vec<_>>()
    };
    let extent = |verdict: &str| {
        of(verdict)
            .iter()
            .map(|run| run.right_deg - run.left_deg)
            .sum::<f64>()
    };
    verdicts.sort_by(|a, b| extent(b).total_cmp(&extent(a)));
    let words: Vec<String> = verdicts
        .iter()
        .map(|verdict| {
            let ranges: Vec<String> = of(verdict).iter().map(|run| run.range()).collect();
            format!("{verdict} {}", ranges.join(", "))
        })
        .collect();
    words.join("; ")
}

impl Run<'_> {
    /// The angles of attack it covers: `5°–25°`.
    #[must_use]
    pub fn range(&self) -> String {
        let (from, to) = (angle(self.from_deg), angle(self.to_deg));
        if from == to {
            from
        } else {
            format!("{from}\u{2013}{to}")
        }
    }
}

/// How a verdict is drawn: top and bottom of its bar in a strip 14 high, and its colour. Place and
/// height tell them apart without colour.
fn bar(verdict: &str) -> (f64, f64, &'static str) {
    match verdict {
        "agrees" => (5.0, 9.0, "#8a8f98"),
        "flight higher" => (0.0, 7.0, "#0060a8"),
        "flight lower" => (7.0, 14.0, "#b34700"),
        "sign differs" => (0.0, 14.0, "#7a0143"),
        _ => (6.5, 7.5, "#c9ccd1"),
    }
}

/// A strip across angle of attack that shows the runs, as an SVG of the given width.
#[must_use]
pub fn strip(runs: &[Run], alpha_from_deg: f64, alpha_to_deg: f64, width: u32) -> String {
    let scale = f64::from(width) / (alpha_to_deg - alpha_from_deg);
    if runs.is_empty() || !scale.is_finite() || scale <= 0.0 {
        return String::new();
    }
    let x = |alpha: f64| ((alpha - alpha_from_deg) * scale).clamp(0.0, f64::from(width));
    let mut svg = format!(
        r#"<svg class="strip" viewBox="0 0 {width} 14" width="{width}" height="14" aria-hidden="true">"#
    );
    for run in runs {
        let (top, bottom, colour) = bar(run.verdict);
        let (left, right) = (x(run.left_deg), x(run.right_deg));
        // Writing into a String cannot fail.
        let _ = write!(
            svg,
            r#"<rect x="{left:.1}" y="{top}" width="{:.1}" height="{}" fill="{colour}"/>"#,
            right - left,
            bottom - top
        );
    }
    svg.push_str("</svg>");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(verdicts: &[(f64, &str)]) -> Vec<ComparisonRow> {
        let row = |(alpha_deg, verdict): &(f64, &str)| ComparisonRow {
            derivative: "CN_alpha".into(),
            unit: "per_deg".into(),
            group: "all".into(),
            alpha_deg: *alpha_deg,
            mach: None,
            flight: 1.0,
            standard_error: 0.1,
            wind_tunnel: None,
            difference: None,
            uncertainty: None,
            difference_pct: None,
            z: None,
            verdict: (*verdict).into(),
        };
        verdicts.iter().map(row).collect()
    }

    #[test]
    fn equal_verdicts_side_by_side_become_a_range() {
        let rows = rows(&[
            (5.0, "agrees"),
            (10.0, "agrees"),
            (15.0, "flight lower"),
            (20.0, "agrees"),
            (25.0, "agrees"),
            (30.5, "agrees"),
        ]);
        let runs = runs(&rows.iter().collect::<Vec<_>>());
        assert_eq!(
            phrase(&runs),
            "agrees 5°\u{2013}10°, flight lower 15°, agrees 20°\u{2013}30.5°"
        );
    }

    #[test]
    fn many_runs_are_told_by_verdict_the_most_frequent_first() {
        let verdicts = [
            "agrees",
            "flight lower",
            "flight lower",
            "agrees",
            "flight lower",
            "flight higher",
        ];
        let rows = rows(
            &verdicts
                .iter()
                .zip([5.0, 10.0, 15.0, 20.0, 25.0, 30.0])
                .map(|(v, a)| (a, *v))
                .collect::<Vec<_>>(),
        );
        let runs = runs(&rows.iter().collect::<Vec<_>>());
        assert_eq!(
            phrase(&runs),
            "flight lower 10°\u{2013}15°, 25°; agrees 5°, 20°; flight higher 30°"
        );
    }

    #[test]
    fn the_strip_has_a_bar_per_run_and_fills_its_width() {
        let rows = rows(&[
            (10.0, "agrees"),
            (20.0, "flight higher"),
            (30.0, "flight higher"),
        ]);
        let svg = strip(&runs(&rows.iter().collect::<Vec<_>>()), 5.0, 35.0, 120);
        assert_eq!(svg.matches("<rect").count(), 2);
        assert!(svg.contains(r#"x="0.0" y="5" width="40.0""#), "{svg}");
        assert!(svg.contains(r#"x="40.0" y="0" width="80.0""#), "{svg}");
    }

    #[test]
    fn nothing_compared_is_an_empty_phrase_and_strip() {
        assert_eq!(phrase(&runs(&[])), "");
        assert_eq!(strip(&[], 0.0, 1.0, 100), "");
    }
}
