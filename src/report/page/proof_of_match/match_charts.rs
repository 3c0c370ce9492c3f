//! Charts of the proof of match: margin of each maneuver over angle of attack, one chart for each model.

use crate::report::contents::Contents;
use crate::report::figure::chart_axis::ChartAxis;
use crate::report::figure::scale::{Scale, extent};
use crate::report::figure::style::DARK_COLOURS;
use crate::report::figure::xy_chart::{ChartPoint, ChartSeries, LevelBox, XyChart};
use crate::report::page::quality_charts::QualityChart;
use crate::tables::{MatchVerdict, MatchVerdictRow, ModelSource};

/// Least margin that a chart reaches: twice the tolerance.
const LEAST_MARGIN: f64 = -1.0;

/// Margins of a model over angle of attack, the inside shaded; `None` without a flight.
#[must_use]
pub fn chart(contents: &Contents, model: ModelSource) -> Option<QualityChart> {
    let all = contents.matched.iter().flat_map(|m| &m.verdicts);
    let flown =
        |row: &&MatchVerdictRow| row.model == model && row.verdict != MatchVerdict::NotFlown;
    let point = |row: &MatchVerdictRow| ChartPoint {
        at: (
            row.alpha_deg,
            row.margin.unwrap_or(LEAST_MARGIN).max(LEAST_MARGIN),
        ),
        label: String::new(),
        outline: vec![],
    };
    let points: Vec<ChartPoint> = all.filter(flown).map(point).collect();
    let (low, high) = extent(points.iter().map(|p| p.at.0))?;
    let id = format!("match-{}", model.name());
    let title = format!("Margin over angle of attack, {}", model.name());
    let caption = "One mark for each maneuver. 1 is a perfect match, 0 the limit; the shaded maneuvers \
                   are inside. Marks on the lower edge are at twice their tolerance or beyond.";
    Some(QualityChart::from_chart(&XyChart {
        id: &id,
        title: &title,
        description: caption,
        x: ChartAxis::linear("α, deg", Scale::covering(low, high)),
        y: ChartAxis::linear("margin", Scale::covering(LEAST_MARGIN, 1.0)),
        boxes: vec![LevelBox {
            label: "inside",
            x: (None, None),
            y: (Some(0.0), None),
        }],
        series: vec![ChartSeries {
            colour: DARK_COLOURS[1],
            points,
            is_joined: false,
        }],
    }))
}
