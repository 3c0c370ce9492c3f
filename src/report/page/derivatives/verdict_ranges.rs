//! Verdicts of one derivative over angle of attack: neighbours with the same verdict as a range.

use crate::report::figure::verdict_bar::BarSegment;
use crate::report::notation::angle;
use crate::tables::{ComparisonRow, TunnelVerdict};

/// Neighbouring angles of attack with the same verdict.
#[derive(Clone, Debug, PartialEq)]
pub struct VerdictRange {
    pub verdict: TunnelVerdict,
    pub from_deg: f64,
    pub to_deg: f64,
    /// Ends of its segment in the bar: half way to the neighbours.
    left_deg: f64,
    right_deg: f64,
}

impl VerdictRange {
    /// Angles of attack in words: `5°–25°`.
    #[must_use]
    pub fn angles(&self) -> String {
        let (from, to) = (angle(self.from_deg), angle(self.to_deg));
        if from == to {
            from
        } else {
            format!("{from}\u{2013}{to}")
        }
    }

    fn width_deg(&self) -> f64 {
        self.right_deg - self.left_deg
    }
}

/// Ranges of equal verdicts, from rows sorted by angle of attack.
#[must_use]
pub fn ranges(rows: &[&ComparisonRow]) -> Vec<VerdictRange> {
    let mut ranges: Vec<VerdictRange> = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        let alpha = row.alpha_deg;
        let before = i
            .checked_sub(1)
            .and_then(|j| rows.get(j))
            .map(|r| alpha - r.alpha_deg);
        let after = rows.get(i + 1).map(|r| r.alpha_deg - alpha);
        let left_deg = alpha - 0.5 * before.or(after).unwrap_or(1.0);
        let right_deg = alpha + 0.5 * after.or(before).unwrap_or(1.0);
        match ranges.last_mut() {
            Some(range) if range.verdict == row.tunnel.verdict => {
                range.to_deg = alpha;
                range.right_deg = right_deg;
            }
            _ => ranges.push(VerdictRange {
                verdict: row.tunnel.verdict,
                from_deg: alpha,
                to_deg: alpha,
                left_deg,
                right_deg,
            }),
        }
    }
    ranges
}

/// Segments of the bar that shows the ranges.
#[must_use]
pub fn bar_segments(ranges: &[VerdictRange]) -> Vec<BarSegment> {
    ranges
        .iter()
        .map(|range| BarSegment {
            verdict: range.verdict,
            from_deg: range.left_deg,
            to_deg: range.right_deg,
        })
        .collect()
}

/// Number of ranges above which they are ordered by verdict, which is easier to read.
const MOST_RANGES: usize = 4;

/// Ranges in words: `agrees 5°–25°, flight lower 30°–60°`.
///
/// Many ranges are grouped by verdict, the widest first: `flight lower 10°, 35°–60°; agrees 5°`.
#[must_use]
pub fn phrase(ranges: &[VerdictRange]) -> String {
    if ranges.len() <= MOST_RANGES {
        let words: Vec<String> = ranges
            .iter()
            .map(|range| format!("{} {}", range.verdict, range.angles()))
            .collect();
        return words.join(", ");
    }
    let mut verdicts: Vec<(TunnelVerdict, Vec<&VerdictRange>)> = Vec::new();
    for range in ranges {
        match verdicts.iter_mut().find(|v| v.0 == range.verdict) {
            Some(verdict) => verdict.1.push(range),
            None => verdicts.push((range.verdict, vec![range])),
        }
    }
    verdicts.sort_by(|a, b| total_width_deg(&b.1).total_cmp(&total_width_deg(&a.1)));
    let words: Vec<String> = verdicts
        .iter()
        .map(|(verdict, own)| {
            let angles: Vec<String> = own.iter().map(|range| range.angles()).collect();
            format!("{verdict} {}", angles.join(", "))
        })
        .collect();
    words.join("; ")
}

fn total_width_deg(ranges: &[&VerdictRange]) -> f64 {
    ranges.iter().map(|range| range.width_deg()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::TunnelDifference;

    fn rows(verdicts: &[(f64, TunnelVerdict)]) -> Vec<ComparisonRow> {
        let row = |(alpha_deg, verdict): &(f64, TunnelVerdict)| ComparisonRow {
            derivative: "CN_alpha".into(),
            unit: "per_deg".into(),
            group: "all".into(),
            alpha_deg: *alpha_deg,
            mach: None,
            flight: 1.0,
            standard_error: 0.1,
            flight_share_pct: None,
            tunnel: TunnelDifference {
                wind_tunnel: None,
                difference: None,
                uncertainty: None,
                difference_pct: None,
                z: None,
                verdict: *verdict,
            },
        };
        verdicts.iter().map(row).collect()
    }

    #[test]
    fn neighbours_with_equal_verdicts_become_a_range() {
        let rows = rows(&[
            (5.0, TunnelVerdict::Agrees),
            (10.0, TunnelVerdict::Agrees),
            (15.0, TunnelVerdict::FlightLower),
            (20.0, TunnelVerdict::Agrees),
            (25.0, TunnelVerdict::Agrees),
            (30.5, TunnelVerdict::Agrees),
        ]);
        let ranges = ranges(&rows.iter().collect::<Vec<_>>());
        assert_eq!(
            phrase(&ranges),
            "agrees 5°\u{2013}10°, flight lower 15°, agrees 20°\u{2013}30.5°"
        );
    }

    #[test]
    fn many_ranges_are_grouped_by_verdict_the_widest_first() {
        let verdicts = [
            TunnelVerdict::Agrees,
            TunnelVerdict::FlightLower,
            TunnelVerdict::FlightLower,
            TunnelVerdict::Agrees,
            TunnelVerdict::FlightLower,
            TunnelVerdict::FlightHigher,
        ];
        let rows = rows(
            &verdicts
                .iter()
                .zip([5.0, 10.0, 15.0, 20.0, 25.0, 30.0])
                .map(|(v, a)| (a, *v))
                .collect::<Vec<_>>(),
        );
        let ranges = ranges(&rows.iter().collect::<Vec<_>>());
        assert_eq!(
            phrase(&ranges),
            "flight lower 10°\u{2013}15°, 25°; agrees 5°, 20°; flight higher 30°"
        );
    }

    #[test]
    fn the_bar_has_a_segment_per_range_that_meets_its_neighbours() {
        let rows = rows(&[
            (10.0, TunnelVerdict::Agrees),
            (20.0, TunnelVerdict::FlightHigher),
            (30.0, TunnelVerdict::FlightHigher),
        ]);
        let segments = bar_segments(&ranges(&rows.iter().collect::<Vec<_>>()));
        let ends: Vec<_> = segments.iter().map(|s| (s.from_deg, s.to_deg)).collect();
        assert_eq!(ends, [(5.0, 15.0), (15.0, 35.0)]);
    }

    #[test]
    fn no_comparison_gives_an_empty_phrase() {
        assert_eq!(phrase(&ranges(&[])), "");
    }
}
