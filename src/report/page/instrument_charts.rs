//! Charts of instruments whose errors change over the flights, are large in every flight, or are
//! far from the others in some flights.

use super::quality_charts::QualityChart;
use crate::numerics::statistics::normal::NORMAL_95;
use crate::report::contents::Contents;
use crate::report::figure::chart_axis::ChartAxis;
use crate::report::figure::scale::{Scale, extent};
use crate::report::figure::style::INK;
use crate::report::figure::xy_chart::{ChartPoint, ChartSeries, LevelBox, XyChart};
use crate::tables::{
    ALL_FLIGHTS, CommonErrorVerdict, InstrumentError, InstrumentRow, InstrumentTrend,
    InstrumentTrendRow,
};

/// The charts, in the order of the table.
#[must_use]
pub fn charts(contents: &Contents) -> Vec<QualityChart> {
    let trends = contents.instrument_trends.iter().enumerate();
    let remarkable = trends.filter(|(_, trend)| is_remarkable(trend));
    remarkable
        .filter_map(|(i, trend)| chart(contents, i, trend))
        .collect()
}

fn is_remarkable(trend: &InstrumentTrendRow) -> bool {
    let changes = !matches!(
        trend.verdict,
        InstrumentTrend::Steady | InstrumentTrend::TooFewFlights
    );
    changes || trend.common == CommonErrorVerdict::Wrong || !trend.far_flights.is_empty()
}

fn chart(contents: &Contents, number: usize, trend: &InstrumentTrendRow) -> Option<QualityChart> {
    let points = points(contents, trend);
    let x = extent(points.iter().map(|point| point.at.0))?;
    let ends = points
        .iter()
        .flat_map(|point| point.outline.iter().map(|at| at.1));
    let y = extent(ends)?;
    let id = format!("instrument-{number}");
    let title = format!("`{}`: {} over the flights", trend.channel, trend.error);
    let caption = format!("{} The bars are 95 % intervals.", in_words(trend));
    let label = format!("{}, {}", trend.error, trend.unit);
    let common = trend.mean.zip(trend.scatter.zip(trend.mean_bound));
    let common = common.map(|(mean, (scatter, bound))| {
        let half = NORMAL_95 * scatter.hypot(bound);
        LevelBox {
            label: "all flights",
            x: (None, None),
            y: (Some(mean - half), Some(mean + half)),
        }
    });
    Some(QualityChart::from_chart(&XyChart {
        id: &id,
        title: &title,
        description: &caption,
        x: ChartAxis::linear("flight", Scale::covering(x.0, x.1)),
        y: ChartAxis::linear(&label, Scale::covering(y.0, y.1)),
        boxes: common.into_iter().collect(),
        series: vec![ChartSeries {
            colour: INK,
            points,
            is_joined: false,
        }],
    }))
}

/// Error of each flight over its number in the order of the flights.
fn points(contents: &Contents, trend: &InstrumentTrendRow) -> Vec<ChartPoint> {
    let of_channel = contents.instruments.iter();
    let of_channel =
        of_channel.filter(|row| row.channel == trend.channel && row.flight_id != ALL_FLIGHTS);
    let offset = f64::from(u8::from(trend.error == InstrumentError::Scale));
    let far: Vec<&str> = trend.far_flights.split(' ').collect();
    let point = |(i, row): (usize, &InstrumentRow)| {
        let (value, bound) = row.error(trend.error)?;
        let (x, y) = ((i + 1) as f64, offset + value);
        let is_named =
            far.contains(&row.flight_id.as_str()) || trend.since.as_ref() == Some(&row.flight_id);
        Some(ChartPoint {
            at: (x, y),
            label: if is_named {
                row.flight_id.clone()
            } else {
                String::new()
            },
            outline: vec![(x, y - NORMAL_95 * bound), (x, y + NORMAL_95 * bound)],
        })
    };
    of_channel.enumerate().filter_map(point).collect()
}

fn in_words(trend: &InstrumentTrendRow) -> String {
    let mut sentences = Vec::new();
    if let Some(since) = &trend.since {
        sentences.push(format!("A {} since {since}.", trend.verdict));
    }
    if trend.common == CommonErrorVerdict::Wrong {
        sentences.push("Wrong in every flight.".to_owned());
    }
    if !trend.far_flights.is_empty() {
        sentences.push(format!("Far from the others: {}.", trend.far_flights));
    }
    sentences.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture::Campaign;
    use crate::tables::InstrumentVerdict;

    fn trend(verdict: InstrumentTrend) -> InstrumentTrendRow {
        InstrumentTrendRow {
            channel: "Q".into(),
            signal: "q_deg_s".into(),
            error: InstrumentError::Scale,
            unit: "1".into(),
            flights: 3,
            mean: Some(1.0),
            mean_bound: Some(0.001),
            scatter: Some(0.002),
            common: CommonErrorVerdict::Ordinary,
            far_flights: String::new(),
            completed_flights: 0,
            verdict,
            since: Some("f2".into()),
            change: Some(0.02),
            change_bound: Some(0.001),
            probability: Some(1e-6),
        }
    }

    fn row(flight: usize, scale: f64) -> InstrumentRow {
        InstrumentRow {
            scale: Some(scale),
            scale_bound: Some(0.001),
            ..InstrumentRow::undetermined(
                &format!("f{flight}"),
                "Q",
                "q_deg_s",
                "deg/s",
                InstrumentVerdict::Ok,
            )
        }
    }

    #[test]
    fn a_step_has_a_chart_with_its_flight_and_a_steady_error_none() {
        let campaign = Campaign {
            instruments: vec![row(1, 1.0), row(2, 1.02), row(3, 1.021)],
            ..Campaign::default()
        };
        let verdicts = [
            InstrumentTrend::Steady,
            InstrumentTrend::Step,
            InstrumentTrend::PossibleStep,
        ];
        let trends = verdicts.map(trend);
        let contents = Contents {
            instrument_trends: &trends,
            ..campaign.contents()
        };
        let charts = charts(&contents);
        assert_eq!(charts.len(), 2);
        let possible = &charts[1].caption;
        assert!(
            possible.starts_with("A possible step since f2."),
            "{possible}"
        );
        assert!(
            charts[0].caption.starts_with("A step since f2."),
            "{}",
            charts[0].caption
        );
        assert!(charts[0].svg.contains(">f2<"));
    }
}
