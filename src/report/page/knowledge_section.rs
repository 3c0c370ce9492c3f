//! Information added by the flights: posterior standard deviations over the prior ones, the basis
//! for what to fly next.

use std::collections::BTreeMap;

use serde::Serialize;

use super::quality_charts::QualityChart;
use crate::aero::Axis;
use crate::numerics::order_statistics::median;
use crate::report::contents::{Contents, group_by};
use crate::report::figure::scale::{Scale, extent};
use crate::report::figure::style::{DARK_COLOURS, TOLERANCE_LIMIT};
use crate::report::figure::xy_chart::{ChartAxis, ChartPoint, ChartSeries, XyChart};
use crate::report::notation::{angle, coefficient_of, fixed};
use crate::tables::PosteriorRow;

/// Number of derivatives that the answer names.
const NAMED: usize = 5;

/// Answer in sentences, with its charts.
#[derive(Clone, Debug, Serialize)]
pub struct KnowledgeSection {
    pub answer: String,
    pub chart: QualityChart,
}

/// Medians over angle of attack of an axis's derivatives.
struct AxisMedians {
    label: &'static str,
    colour: &'static str,
    /// Fifth of the angles of attack at which the label stands.
    label_at: usize,
    /// Angle of attack and median, ascending.
    medians: Vec<(f64, f64)>,
}

/// The section; `None` without a posterior.
#[must_use]
pub fn section(contents: &Contents) -> Option<KnowledgeSection> {
    let rows: Vec<(&PosteriorRow, f64)> = contents
        .posterior
        .iter()
        .filter_map(|row| Some((row, left_pct(row)?)))
        .collect();
    let axes = [
        (Axis::Longitudinal, "longitudinal", DARK_COLOURS[1], 1),
        (Axis::Lateral, "lateral", DARK_COLOURS[2], 3),
    ];
    let axes = axes.map(|(axis, label, colour, label_at)| AxisMedians {
        label,
        colour,
        label_at,
        medians: medians(&rows, axis),
    });
    Some(KnowledgeSection {
        answer: answer(contents, &rows, &axes)?,
        chart: chart(&rows, &axes)?,
    })
}

/// Posterior standard deviation, percent of the prior one.
fn left_pct(row: &PosteriorRow) -> Option<f64> {
    let left = 100.0 * row.standard_deviation / row.prior_deviation;
    left.is_finite().then_some(left)
}

fn medians(rows: &[(&PosteriorRow, f64)], axis: Axis) -> Vec<(f64, f64)> {
    let mut own: Vec<(f64, f64)> = rows
        .iter()
        .filter(|(row, _)| coefficient_of(&row.derivative).is_some_and(|c| c.axis() == axis))
        .map(|(row, left)| (row.alpha_deg, *left))
        .collect();
    own.sort_by(|a, b| a.0.total_cmp(&b.0));
    let of_angle = own.chunk_by(|a, b| (a.0 - b.0).abs() < 1e-6);
    of_angle
        .filter_map(|own| Some((own.first()?.0, median(own.iter().map(|(_, left)| *left))?)))
        .collect()
}

/// Answer in sentences: median over all derivatives, angle of attack with the largest remaining
/// uncertainty, and derivatives with the largest remaining uncertainty.
fn answer(
    contents: &Contents,
    rows: &[(&PosteriorRow, f64)],
    axes: &[AxisMedians],
) -> Option<String> {
    let all = median(rows.iter().map(|(_, left)| *left))?;
    let so_far = format!(
        "Flights have brought the standard deviations of the derivatives to {} % of those before flight, in \
         the median.",
        fixed(all, 0)
    );
    let places = axes
        .iter()
        .flat_map(|axis| axis.medians.iter().map(move |m| (axis.label, m)));
    let least = places.max_by(|a, b| a.1.1.total_cmp(&b.1.1));
    let least = least.map(|(label, (alpha, left))| {
        format!(
            " They have taught least at {} ({label} median {} %), and of the derivatives {}.",
            angle(*alpha),
            fixed(*left, 0),
            least_known(contents).join(", ")
        )
    });
    Some(format!(
        "{so_far}{} The cards that lower them most are chosen by harvest next, which flies each candidate \
         in the simulator first.",
        least.unwrap_or_default()
    ))
}

/// Derivatives with the largest medians over angle of attack.
fn least_known(contents: &Contents) -> Vec<String> {
    let by_name: BTreeMap<&str, Vec<&PosteriorRow>> =
        group_by(contents.posterior, |row| &row.derivative);
    let of_name = |(name, own): (&'_ str, Vec<&PosteriorRow>)| {
        let left = median(own.into_iter().filter_map(left_pct))?;
        Some((name.to_owned(), left))
    };
    let mut all: Vec<(String, f64)> = by_name.into_iter().filter_map(of_name).collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all.truncate(NAMED);
    all.into_iter()
        .map(|(name, left)| format!("{name} ({} %)", fixed(left, 0)))
        .collect()
}

/// Chart over angle of attack: a mark for each derivative, and the medians of both axes.
fn chart(rows: &[(&PosteriorRow, f64)], axes: &[AxisMedians]) -> Option<QualityChart> {
    let (low, high) = extent(rows.iter().map(|(row, _)| row.alpha_deg))?;
    let (_, most) = extent(rows.iter().map(|(_, left)| *left))?;
    let caption = "Standard deviation of each derivative over that before flight, and the medians of both \
                   axes. At 100 % or more flights have taught nothing.";
    let marks = rows.iter().map(|(row, left)| ChartPoint {
        at: (row.alpha_deg, *left),
        label: String::new(),
        outline: vec![],
    });
    let marks = ChartSeries {
        colour: TOLERANCE_LIMIT,
        points: marks.collect(),
        is_joined: false,
    };
    Some(QualityChart::from_chart(&XyChart {
        id: "knowledge",
        title: "Uncertainty that flights have left",
        description: caption,
        x: ChartAxis::linear("α, deg", Scale::covering(low, high)),
        y: ChartAxis::linear(
            "standard deviation, % of that before flight",
            Scale::covering(0.0, most.max(100.0)),
        ),
        boxes: vec![],
        series: std::iter::once(marks)
            .chain(axes.iter().map(AxisMedians::series))
            .collect(),
    }))
}

impl AxisMedians {
    fn series(&self) -> ChartSeries {
        let labelled = self.label_at * self.medians.len() / 5;
        let point = |(i, at): (usize, &(f64, f64))| ChartPoint {
            at: *at,
            label: if i == labelled { self.label } else { "" }.to_owned(),
            outline: vec![],
        };
        ChartSeries {
            colour: self.colour,
            points: self.medians.iter().enumerate().map(point).collect(),
            is_joined: true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture::campaign;

    #[test]
    fn the_answer_names_what_flights_have_taught_least() {
        let mut campaign = campaign();
        campaign.posterior.truncate(1);
        let first = campaign.posterior[0].clone();
        for (alpha_deg, left) in [(20.0, 0.2), (30.0, 0.6), (40.0, 0.4)] {
            campaign.posterior.push(PosteriorRow {
                derivative: "Cn_dr".into(),
                alpha_deg,
                standard_deviation: left * 0.01,
                prior_deviation: 0.01,
                ..first.clone()
            });
        }
        campaign.posterior.remove(0);
        let section = section(&campaign.contents()).unwrap();
        assert!(
            section.answer.contains("to 40 % of those before flight"),
            "{}",
            section.answer
        );
        assert!(
            section.answer.contains(
                "least at 30° (lateral median 60 %), and of the derivatives Cn_dr (40 %)."
            ),
            "{}",
            section.answer
        );
        let chart = roxmltree::Document::parse(&section.chart.svg).unwrap();
        assert!(
            chart
                .descendants()
                .any(|node| node.text() == Some("lateral"))
        );
    }

    #[test]
    fn without_a_posterior_there_is_no_answer() {
        let mut campaign = campaign();
        campaign.posterior.clear();
        assert!(section(&campaign.contents()).is_none());
    }
}
