//! Uncertainty that remains after the flights, the basis for what to fly next. It shows posterior
//! over prior standard deviations, and the effect of one more of the flown maneuvers.

use std::collections::BTreeMap;

use serde::Serialize;

use super::qualities_section;
use super::quality_charts::{QualityChart, level_in_words};
use crate::aero::Axis;
use crate::maneuver::Status;
use crate::numerics::statistics::order_statistics::median;
use crate::report::contents::{Contents, group_by};
use crate::report::figure::chart_axis::ChartAxis;
use crate::report::figure::scale::{Scale, extent};
use crate::report::figure::style::{DARK_COLOURS, INK, TOLERANCE_LIMIT};
use crate::report::figure::xy_chart::{ChartPoint, ChartSeries, XyChart};
use crate::report::notation::{angle, coefficient_of, count, fixed};
use crate::tables::{EstimateRow, LevelRow, PosteriorRow};

/// Number of derivatives that answer and chart name.
const NAMED: usize = 3;

/// Number of maneuvers to repeat that the answer names.
const REPEATS: usize = 2;

/// Answer in sentences, with its chart.
#[derive(Clone, Debug, Serialize)]
pub struct UncertaintySection {
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
pub fn section(contents: &Contents) -> Option<UncertaintySection> {
    let rows: Vec<(&PosteriorRow, f64)> = contents
        .posterior
        .iter()
        .filter_map(|row| Some((row, remaining_pct(row)?)))
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
    let most_uncertain = most_uncertain(&rows);
    Some(UncertaintySection {
        answer: answer(contents, &rows, &most_uncertain)?,
        chart: chart(&rows, &axes, &most_uncertain)?,
    })
}

/// Posterior standard deviation, percent of the prior one.
fn remaining_pct(row: &PosteriorRow) -> Option<f64> {
    let pct = 100.0 * row.standard_deviation / row.prior_deviation;
    pct.is_finite().then_some(pct)
}

fn medians(rows: &[(&PosteriorRow, f64)], axis: Axis) -> Vec<(f64, f64)> {
    let mut own: Vec<(f64, f64)> = rows
        .iter()
        .filter(|(row, _)| coefficient_of(&row.derivative).is_some_and(|c| c.axis() == axis))
        .map(|(row, pct)| (row.alpha_deg, *pct))
        .collect();
    own.sort_by(|a, b| a.0.total_cmp(&b.0));
    let of_angle = own.chunk_by(|a, b| (a.0 - b.0).abs() < 1e-6);
    of_angle
        .filter_map(|own| Some((own.first()?.0, median(own.iter().map(|(_, pct)| *pct))?)))
        .collect()
}

/// A row of the posterior, and its standard deviation in percent of that before flight.
type RemainingUncertainty<'a> = (&'a PosteriorRow, f64);

/// Lines below the figure: median of all derivatives, derivatives about which flights gave least
/// information, maneuvers worth a repeat, level to decide, command that plans the flight.
fn answer(
    contents: &Contents,
    rows: &[RemainingUncertainty],
    most_uncertain: &[RemainingUncertainty],
) -> Option<String> {
    let all = median(rows.iter().map(|(_, pct)| *pct))?;
    let information = Information::new(contents);
    let places: Vec<String> = most_uncertain
        .iter()
        .map(|(row, pct)| information.place_in_words(row, *pct))
        .collect();
    let sentences = [
        Some(format!(
            "Flights have brought the standard deviations of the derivatives to {} % of those before flight, in \
             the median; the reduction is least for {}.",
            fixed(all, 0),
            places.join(", ")
        )),
        repeats_in_words(&information.repeats()),
        level_to_decide(contents),
        Some(
            "Cards with their minutes and the chance that they decide a level: harvest next --minutes 45, which \
             flies each candidate in the simulator."
                .to_owned(),
        ),
    ];
    let sentences: Vec<String> = sentences.into_iter().flatten().collect();
    Some(sentences.join(" "))
}

/// Largest row of each derivative; the derivatives with the largest of these, descending.
fn most_uncertain<'a>(rows: &[RemainingUncertainty<'a>]) -> Vec<RemainingUncertainty<'a>> {
    let mut of_name: BTreeMap<&str, RemainingUncertainty> = BTreeMap::new();
    for (row, pct) in rows {
        let largest = of_name.entry(&row.derivative).or_insert((row, *pct));
        if *pct > largest.1 {
            *largest = (row, *pct);
        }
    }
    let mut all: Vec<RemainingUncertainty> = of_name.into_values().collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all.truncate(NAMED);
    all
}

/// Least certain level of the last airframe: that with feedback where there is one.
fn level_to_decide(contents: &Contents) -> Option<String> {
    let airframe = contents.specification?.airframes().into_iter().last()?;
    let levels = contents.qualities.levels.iter();
    let levels: Vec<&LevelRow> = levels.filter(|row| row.airframe == airframe).collect();
    let row = qualities_section::least_certain(&levels)?;
    let (level, pct) = qualities_section::most_probable(row);
    Some(format!(
        "The level to decide first is that of {}: {} with {} % probability only.",
        qualities_section::place_in_words(row),
        level_in_words(level, "worse than Level 3"),
        fixed(pct, 0)
    ))
}

/// A flown maneuver with what it would add if flown once more.
#[derive(Clone, Debug)]
struct Repeat<'a> {
    class: &'a str,
    alpha_deg: f64,
    duration_s: f64,
    derivatives: usize,
    /// Sum over its derivatives of ln(standard deviation tonight / standard deviation after the repeat).
    gain: f64,
}

fn repeats_in_words(repeats: &[Repeat]) -> Option<String> {
    let words = |repeat: &Repeat| {
        format!(
            "{} at {} ({} s: {} by {} %)",
            repeat.class,
            angle(repeat.alpha_deg),
            fixed(repeat.duration_s, 0),
            count(repeat.derivatives, "derivative"),
            fixed(
                -100.0 * (-repeat.gain / repeat.derivatives as f64).exp_m1(),
                0
            )
        )
    };
    let words: Vec<String> = repeats.iter().take(REPEATS).map(words).collect();
    (!words.is_empty()).then(|| {
        format!(
            "Of the maneuvers flown, one more {} lowers the standard deviations most, each derivative alone.",
            words.join(" or ")
        )
    })
}

/// Estimates that are evidence of the posterior.
struct Information<'a> {
    contents: &'a Contents<'a>,
    posterior: BTreeMap<&'a str, Vec<&'a PosteriorRow>>,
    /// Weight of each maneuver in each coefficient.
    weights: BTreeMap<(&'a str, &'a str), f64>,
}

impl<'a> Information<'a> {
    fn new(contents: &'a Contents<'a>) -> Information<'a> {
        let contributions = contents.contributions.iter();
        let weight = contributions.map(|row| {
            let key = (row.maneuver_id.as_str(), row.coefficient.as_str());
            (key, row.weight)
        });
        Information {
            contents,
            posterior: group_by(contents.posterior, |row| &row.derivative),
            weights: weight.collect(),
        }
    }

    /// Information of an estimate on its derivative, 1/variance; `None` for one that is no evidence.
    fn of_estimate(&self, row: &EstimateRow) -> Option<f64> {
        let coefficient = format!("{:?}", coefficient_of(&row.derivative)?);
        let key = (row.maneuver_id.as_str(), coefficient.as_str());
        let weight = *self.weights.get(&key)?;
        let bound = row.bound_corrected.or(row.bound)?;
        let information = weight / (bound * bound);
        (row.status == Status::Estimated && information.is_finite()).then_some(information)
    }

    /// Class whose maneuvers give most information on a derivative, in the mean.
    fn best_class(&self, derivative: &str) -> Option<&'a str> {
        let mut by_class: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
        for row in self.contents.estimates {
            if row.derivative != derivative {
                continue;
            }
            if let Some(information) = self.of_estimate(row) {
                let (sum, n) = by_class.entry(&row.class).or_default();
                *sum += information;
                *n += 1.0;
            }
        }
        let means = by_class
            .into_iter()
            .map(|(class, (sum, n))| (class, sum / n));
        let best = means.max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(best.0)
    }

    /// Derivative, angle of attack, share left, and the class that estimates it best.
    fn place_in_words(&self, row: &PosteriorRow, pct: f64) -> String {
        let class = self.best_class(&row.derivative).map_or_else(
            || "no class estimates it".to_owned(),
            |class| format!("{class} estimates it best"),
        );
        format!(
            "{} at {} ({} %; {class})",
            row.derivative,
            angle(row.alpha_deg),
            fixed(pct, 0)
        )
    }

    /// The best maneuver of each class to be flown once more, the most informative first.
    fn repeats(&self) -> Vec<Repeat<'a>> {
        let by_maneuver = group_by(self.contents.estimates, |row| &row.maneuver_id);
        let mut best: BTreeMap<&str, Repeat> = BTreeMap::new();
        for maneuver in self.contents.maneuvers {
            let rows = by_maneuver.get(maneuver.maneuver_id.as_str());
            let gains: Vec<f64> = rows
                .into_iter()
                .flatten()
                .filter_map(|row| self.gain(row))
                .collect();
            let repeat = Repeat {
                class: &maneuver.class,
                alpha_deg: maneuver.alpha_deg,
                duration_s: maneuver.end_s - maneuver.start_s,
                derivatives: gains.len(),
                gain: gains.iter().sum(),
            };
            let own = best.entry(repeat.class).or_insert_with(|| repeat.clone());
            if repeat.gain > own.gain {
                *own = repeat;
            }
        }
        let mut all: Vec<Repeat> = best.into_values().filter(|r| r.derivatives > 0).collect();
        all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        all
    }

    /// Logarithm of the reduction of a derivative's standard deviation by one more estimate like this one.
    fn gain(&self, row: &EstimateRow) -> Option<f64> {
        let information = self.of_estimate(row)?;
        let own = self.posterior.get(row.derivative.as_str())?.iter();
        let distance = |p: &PosteriorRow| (p.alpha_deg - row.alpha_deg).abs();
        let nearest = own.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        let gain = 0.5 * (nearest.standard_deviation.powi(2) * information).ln_1p();
        gain.is_finite().then_some(gain)
    }
}

/// Chart over angle of attack: a mark for each derivative, and the medians of both axes.
fn chart(
    rows: &[RemainingUncertainty],
    axes: &[AxisMedians],
    most_uncertain: &[RemainingUncertainty],
) -> Option<QualityChart> {
    let (low, high) = extent(rows.iter().map(|(row, _)| row.alpha_deg))?;
    let (_, most) = extent(rows.iter().map(|(_, pct)| *pct))?;
    let caption = "Standard deviation of each derivative over that before flight, the most uncertain named, and the \
                   medians of both axes. From 100 % flights gave nothing; above it, they leave the size of the \
                   tunnel's error uncertain, which counts after flight.";
    let marks = rows
        .iter()
        .map(|(row, pct)| ChartPoint::new((row.alpha_deg, *pct), String::new()));
    let named = most_uncertain
        .iter()
        .map(|(row, pct)| ChartPoint::new((row.alpha_deg, *pct), row.derivative.clone()));
    let named = ChartSeries {
        colour: INK,
        points: named.collect(),
        is_joined: false,
    };
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
            .chain([named])
            .collect(),
    }))
}

impl AxisMedians {
    fn series(&self) -> ChartSeries {
        let labelled = self.label_at * self.medians.len() / 5;
        let point = |(i, at): (usize, &(f64, f64))| {
            let label = if i == labelled { self.label } else { "" };
            ChartPoint::new(*at, label.to_owned())
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
    fn answer_and_chart_name_what_flights_gave_least_on() {
        let mut campaign = campaign();
        campaign.posterior.truncate(1);
        let first = campaign.posterior[0].clone();
        let rows = [
            ("Cn_dr", 20.0, 0.2),
            ("Cn_dr", 30.0, 1.3),
            ("CY_beta", 40.0, 0.4),
        ];
        for (derivative, alpha_deg, pct) in rows {
            campaign.posterior.push(PosteriorRow {
                derivative: derivative.into(),
                alpha_deg,
                standard_deviation: pct * 0.01,
                prior_deviation: 0.01,
                ..first.clone()
            });
        }
        campaign.posterior.remove(0);
        let section = section(&campaign.contents()).unwrap();
        assert!(
            section.answer.starts_with(
                "Flights have brought the standard deviations of the derivatives to 40 % of those before flight, in \
                 the median; the reduction is least for Cn_dr at 30° (130 %; no class estimates it), CY_beta at 40° (40 %; \
                 PYRS estimates it best)."
            ),
            "{}",
            section.answer
        );
        assert!(
            section.answer.contains("harvest next"),
            "{}",
            section.answer
        );
        let chart = roxmltree::Document::parse(&section.chart.svg).unwrap();
        let has = |text: &str| chart.descendants().any(|node| node.text() == Some(text));
        assert!(has("lateral") && has("Cn_dr") && has("CY_beta"));
    }

    #[test]
    fn the_answer_weighs_one_more_of_the_flown_maneuvers() {
        let mut campaign = campaign();
        for row in &mut campaign.estimates {
            // The posterior's standard deviation is 0.001: information of the same size divides it by √2.
            let is_best = row.class == "PYRS" && row.alpha_deg > 45.0;
            row.bound_corrected = Some(if is_best { 0.001 } else { 0.002 });
        }
        let contents = campaign.contents();
        let repeats = Information::new(&contents).repeats();
        assert_eq!(repeats.len(), 4, "the best of each class");
        assert_eq!((repeats[0].class, repeats[0].derivatives), ("PYRS", 4));
        assert!((repeats[0].gain - 4.0 * 0.5 * 2.0_f64.ln()).abs() < 1e-9);
        let answer = section(&contents).unwrap().answer;
        assert!(
            answer.contains("one more PYRS at 50° (15 s: 4 derivatives by 29 %) or "),
            "{answer}"
        );
        campaign.contributions.clear();
        let answer = section(&campaign.contents()).unwrap().answer;
        assert!(!answer.contains("one more"), "no evidence: {answer}");
    }

    #[test]
    fn the_answer_names_the_level_to_decide_with_its_probability() {
        let answer = section(&campaign().contents()).unwrap().answer;
        assert!(
            answer
                .contains("short-period damping (3.2.2.1.2) at 20°: Level 1 with 60 % probability"),
            "{answer}"
        );
    }

    #[test]
    fn without_a_posterior_there_is_no_answer() {
        let mut campaign = campaign();
        campaign.posterior.clear();
        assert!(section(&campaign.contents()).is_none());
    }
}
