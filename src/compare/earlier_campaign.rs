//! Comparison of a campaign with an earlier one: the trend of each derivative's group is compared
//! with the earlier trend of that group. z is the difference over its standard error, the root of
//! the sum of both squared standard errors.
//!
//! If the two campaigns share flights, their errors are not independent, and z is too small. The
//! comparison may then miss small changes, but reports no false ones.

use std::path::Path;

use super::judgement::judge;
use super::settings::Settings;
use crate::tables::{ChangeRow, PublishedTrend, TrendRow};
use crate::trend;

/// An earlier campaign's published trends.
#[derive(Clone, Debug, PartialEq)]
pub struct Earlier {
    /// Folder as the analyst names it.
    pub name: String,
    pub trends: Vec<PublishedTrend>,
}

impl Earlier {
    #[must_use]
    pub fn new(folder: &Path, trends: Vec<PublishedTrend>) -> Earlier {
        Earlier {
            name: folder.display().to_string(),
            trends,
        }
    }

    /// Value and standard error of the earlier trend at an α, linear between its published α; `None`
    /// outside of them or in another unit.
    fn trend_at(&self, now: &TrendRow) -> Option<(f64, f64)> {
        let same = |e: &&PublishedTrend| {
            e.derivative == now.derivative
                && e.group == now.group
                && e.unit == now.unit
                && e.alpha_deg.is_finite()
        };
        let mut rows: Vec<&PublishedTrend> = self.trends.iter().filter(same).collect();
        rows.sort_by(|a, b| a.alpha_deg.total_cmp(&b.alpha_deg));
        let high = rows.iter().find(|r| r.alpha_deg >= now.alpha_deg)?;
        let low = rows.iter().rev().find(|r| r.alpha_deg <= now.alpha_deg)?;
        let span = high.alpha_deg - low.alpha_deg;
        let share = if span > 0.0 {
            (now.alpha_deg - low.alpha_deg) / span
        } else {
            0.0
        };
        let mix = |a: f64, b: f64| a + share * (b - a);
        Some((
            mix(low.value, high.value),
            mix(low.standard_error, high.standard_error),
        ))
    }
}

/// Compares the trend of each derivative's group with the earlier one: one row per α.
#[must_use]
pub fn changes(
    trends: &[TrendRow],
    earlier: &Earlier,
    groups: &trend::Settings,
    settings: &Settings,
) -> Vec<ChangeRow> {
    let is_of_group = |t: &&TrendRow| {
        groups
            .group_of(&t.derivative)
            .is_some_and(|g| g.name == t.group)
    };
    let row = |t: &TrendRow| {
        let before = earlier.trend_at(t);
        let judged = judge(
            t.value,
            t.standard_error,
            before.map(|(value, error)| (value, Some(error))),
            settings,
        );
        ChangeRow {
            against: earlier.name.clone(),
            derivative: t.derivative.clone(),
            unit: t.unit.clone(),
            group: t.group.clone(),
            alpha_deg: t.alpha_deg,
            flight: t.value,
            standard_error: t.standard_error,
            before: before.map(|(value, _)| value),
            before_standard_error: before.map(|(_, error)| error),
            difference: judged.difference,
            difference_pct: judged.difference_pct,
            z: judged.z,
            verdict: judged.agreement.into(),
        }
    };
    trends.iter().filter(is_of_group).map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::{ChangeVerdict, PublishedTrend};
    use approx::assert_relative_eq;

    fn now(alpha_deg: f64, value: f64) -> TrendRow {
        TrendRow {
            derivative: "d".into(),
            unit: "per_deg".into(),
            group: "all".into(),
            alpha_deg,
            value,
            standard_error: 0.3,
            lower_95: value,
            upper_95: value,
            prediction_lower_95: value,
            prediction_upper_95: value,
            maneuvers: 5,
            outliers: 0,
            curve: "polynomial".into(),
            order: 1,
            scatter: 0.0,
        }
    }

    #[test]
    fn a_trend_is_compared_with_the_earlier_one_between_its_points_and_not_beyond() {
        let before = |alpha_deg: f64, value: f64| PublishedTrend {
            derivative: "d".into(),
            unit: "per_deg".into(),
            group: "all".into(),
            alpha_deg,
            value,
            standard_error: 0.4,
        };
        let earlier = Earlier::new(
            Path::new("reports/last"),
            vec![before(20.0, 4.0), before(10.0, 2.0)],
        );
        let trends = [
            now(10.0, 2.5),
            now(15.0, 5.0),
            now(20.0, 1.0),
            now(25.0, 1.0),
        ];
        let rows = changes(
            &trends,
            &earlier,
            &trend::Settings::default(),
            &Settings::default(),
        );
        let verdicts: Vec<ChangeVerdict> = rows.iter().map(|r| r.verdict).collect();
        assert_eq!(
            verdicts,
            [
                ChangeVerdict::Agrees,
                ChangeVerdict::Higher,
                ChangeVerdict::Lower,
                ChangeVerdict::NotThereBefore
            ]
        );
        assert_relative_eq!(rows[1].before.expect("before"), 3.0);
        assert_relative_eq!(rows[1].z.expect("z"), 4.0, max_relative = 1e-14);
        let (verdicts, worst) =
            crate::compare::ranges::ranges_of_changes(&rows, "reports/last", &Settings::default());
        assert_eq!(
            verdicts[1].words,
            "flight higher than reports/last at 15°, by 67% ± 17%"
        );
        assert_eq!((worst.len(), worst[0].alpha_deg), (2, 20.0));
    }
}
