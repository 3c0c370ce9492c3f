//! Charts of the flying qualities: probability of the levels, control anticipation over damping,
//! and frequency over damping of the Dutch roll. A chart of the roots over angle of attack follows.

use serde::Serialize;

use crate::aero::Axis;
use crate::qualities::{Qualities, Range, Specification};
use crate::report::figure::chart_axis::{ChartAxis, decades};
use crate::report::figure::scale::{Scale, extent};
use crate::report::figure::style::{DARK_COLOURS, INK};
use crate::report::figure::xy_chart::{self, ChartPoint, ChartSeries, LevelBox, XyChart};
use crate::report::notation::angle;
use crate::tables::{
    ALL_PARAGRAPHS, Airframe, FlyingQuality, Level, LevelRow, QualityRow, RootRow,
};

/// A chart with its caption.
#[derive(Clone, Debug, Serialize)]
pub struct QualityChart {
    pub anchor: String,
    pub title: String,
    pub svg: String,
    pub caption: String,
}

impl QualityChart {
    /// Draws a chart; its description is the caption.
    pub fn from_chart(chart: &XyChart) -> QualityChart {
        QualityChart {
            anchor: format!("chart-{}", chart.id),
            title: chart.title.to_owned(),
            svg: xy_chart::draw(chart),
            caption: chart.description.to_owned(),
        }
    }
}

/// Points of an ellipse's outline.
const OUTLINE: u32 = 40;

/// Radius of the 95 % ellipse of two Gaussian variables, standard deviations: χ² with 2 degrees of
/// freedom, √5.991.
const ELLIPSE_95: f64 = 2.447_746_830_680_816;

/// Largest damping ratio that a chart reaches for a point.
const MOST_DAMPING: f64 = 3.0;

/// Number of angles of attack between labels.
const LABEL_EVERY: usize = 4;

/// The charts of an airframe.
#[must_use]
pub fn charts(
    qualities: &Qualities,
    specification: &Specification,
    airframe: Airframe,
) -> Vec<QualityChart> {
    let rows: Vec<&QualityRow> = qualities
        .qualities
        .iter()
        .filter(|row| row.airframe == airframe)
        .collect();
    let roots: Vec<&RootRow> = qualities
        .roots
        .iter()
        .filter(|row| row.airframe == airframe)
        .collect();
    let pairs = [
        PairChart {
            id: "short-period",
            title: "Short period: control anticipation over damping",
            x: (FlyingQuality::ShortPeriodDamping, "ζ"),
            y: (FlyingQuality::ControlAnticipation, "ω²/(n/α), 1/(g s²)"),
            is_logarithmic: true,
        },
        PairChart {
            id: "dutch-roll",
            title: "Dutch roll: frequency over damping",
            x: (FlyingQuality::DutchRollDamping, "ζ"),
            y: (FlyingQuality::DutchRollFrequency, "ω, rad/s"),
            is_logarithmic: false,
        },
    ];
    let pairs = pairs
        .iter()
        .filter_map(|pair| pair.draw(&rows, specification, airframe));
    let loci = [Axis::Longitudinal, Axis::Lateral].into_iter();
    let loci = loci.filter_map(|axis| locus(&roots, axis, airframe));
    let levels = qualities
        .levels
        .iter()
        .filter(|row| row.airframe == airframe && row.paragraph == ALL_PARAGRAPHS);
    let levels = probabilities(&levels.collect::<Vec<_>>(), airframe);
    levels.into_iter().chain(pairs).chain(loci).collect()
}

/// Probability over angle of attack that every paragraph is met at a level or better; `None` without
/// a flown condition.
fn probabilities(levels: &[&LevelRow], airframe: Airframe) -> Option<QualityChart> {
    let (low, high) = extent(levels.iter().map(|row| row.alpha_deg))?;
    let id = format!("levels-{airframe}");
    let title = "Probability of a level or better";
    let caption = "Probability that every paragraph is met at Level 1, at Level 2 or better (2), at Level 3 or \
                   better (3).";
    Some(QualityChart::from_chart(&XyChart {
        id: &id,
        title,
        description: caption,
        x: ChartAxis::linear("α, deg", Scale::covering(low, high)),
        y: ChartAxis::linear("probability, %", Scale::covering(0.0, 100.0)),
        boxes: vec![],
        series: level_lines(levels),
    }))
}

/// Line of a level's probability.
struct LevelLine {
    /// Number of the level.
    label: &'static str,
    colour: &'static str,
    share: fn(&LevelRow) -> f64,
}

const LEVEL_LINES: [LevelLine; 3] = [
    LevelLine {
        label: "1",
        colour: DARK_COLOURS[4],
        share: |row| row.level_1_pct,
    },
    LevelLine {
        label: "2",
        colour: DARK_COLOURS[1],
        share: |row| row.level_1_pct + row.level_2_pct,
    },
    LevelLine {
        label: "3",
        colour: DARK_COLOURS[2],
        share: |row| row.level_1_pct + row.level_2_pct + row.level_3_pct,
    },
];

/// Least difference at which two lines are distinguishable in the chart, per cent.
const LEAST_APART_PCT: f64 = 3.0;

/// Lines of the levels. Lines that coincide everywhere share one label; each other line has its label where it is
/// farthest from the others.
fn level_lines(levels: &[&LevelRow]) -> Vec<ChartSeries> {
    let shares = LevelShares::new(levels);
    let line = |line: usize| {
        let (label, labelled) = shares.label(line);
        let point = |(i, row): (usize, &&LevelRow)| {
            let is_labelled = Some(i) == labelled;
            let label = if is_labelled { label.as_str() } else { "" };
            ChartPoint::new((row.alpha_deg, shares.of_line[line][i]), label.to_owned())
        };
        ChartSeries {
            colour: LEVEL_LINES[line].colour,
            points: levels.iter().enumerate().map(point).collect(),
            is_joined: true,
        }
    };
    (0..LEVEL_LINES.len()).map(line).collect()
}

/// Probabilities of each line at each angle of attack, per cent.
struct LevelShares {
    of_line: [Vec<f64>; LEVEL_LINES.len()],
    angles: usize,
}

impl LevelShares {
    fn new(levels: &[&LevelRow]) -> LevelShares {
        LevelShares {
            of_line: LEVEL_LINES
                .each_ref()
                .map(|line| levels.iter().map(|row| (line.share)(row)).collect()),
            angles: levels.len(),
        }
    }

    /// Distance of two lines at an angle of attack.
    fn distance(&self, a: usize, b: usize, angle: usize) -> f64 {
        (self.of_line[a][angle] - self.of_line[b][angle]).abs()
    }

    fn coincide(&self, a: usize, b: usize) -> bool {
        (0..self.angles).all(|angle| self.distance(a, b, angle) < LEAST_APART_PCT)
    }

    /// Label of a line, and the index of the angle of attack at which it stands.
    fn label(&self, line: usize) -> (String, Option<usize>) {
        let lines = 0..LEVEL_LINES.len();
        let (group, others): (Vec<usize>, Vec<usize>) =
            lines.partition(|other| self.coincide(line, *other));
        let nearest = |angle: usize| {
            let distances = others
                .iter()
                .map(|other| self.distance(line, *other, angle));
            distances.fold(100.0, f64::min)
        };
        let labelled = (0..self.angles).max_by(|a, b| nearest(*a).total_cmp(&nearest(*b)));
        // The last line of a group is drawn over the others.
        if group.last() != Some(&line) {
            return (String::new(), labelled);
        }
        let names: Vec<&str> = group.iter().map(|i| LEVEL_LINES[*i].label).collect();
        (names.join(", "), labelled)
    }
}

/// Chart of two quantities of one mode.
struct PairChart {
    id: &'static str,
    title: &'static str,
    x: (FlyingQuality, &'static str),
    y: (FlyingQuality, &'static str),
    is_logarithmic: bool,
}

impl PairChart {
    fn draw(
        &self,
        rows: &[&QualityRow],
        specification: &Specification,
        airframe: Airframe,
    ) -> Option<QualityChart> {
        let points = self.points(rows);
        let (x, y) = self.axes(&points, specification)?;
        let levels = [Level::Three, Level::Two, Level::One];
        let boxes = levels.map(|level| {
            let sides = |quantity| sides(specification.range_of(quantity, level));
            LevelBox {
                label: level_in_words(level, ""),
                x: sides(self.x.0),
                y: sides(self.y.0),
            }
        });
        let id = format!("{}-{airframe}", self.id);
        let caption =
            "One point for each angle of attack, with its 95 % ellipse; boxes are levels.";
        Some(QualityChart::from_chart(&XyChart {
            id: &id,
            title: self.title,
            description: caption,
            x,
            y,
            boxes: boxes.to_vec(),
            series: vec![ChartSeries {
                colour: INK,
                points,
                is_joined: true,
            }],
        }))
    }

    fn points(&self, rows: &[&QualityRow]) -> Vec<ChartPoint> {
        let of = |quantity: FlyingQuality| rows.iter().filter(move |row| row.quantity == quantity);
        let mut points = Vec::new();
        for y in of(self.y.0) {
            let is_same = |x: &&&QualityRow| (x.alpha_deg - y.alpha_deg).abs() < 1e-9;
            let Some(x) = of(self.x.0).find(is_same) else {
                continue;
            };
            let (Some(at_x), Some(at_y)) = (x.value, y.value) else {
                continue;
            };
            if at_x > MOST_DAMPING || self.is_logarithmic && at_y <= 0.0 {
                continue;
            }
            let label = if points.len() % LABEL_EVERY == 0 {
                angle(y.alpha_deg)
            } else {
                String::new()
            };
            points.push(ChartPoint {
                at: (at_x, at_y),
                label,
                outline: ellipse((x, at_x), (y, at_y)),
            });
        }
        points
    }

    fn axes(
        &self,
        points: &[ChartPoint],
        specification: &Specification,
    ) -> Option<(ChartAxis, ChartAxis)> {
        let limits = |quantity| {
            let levels = [Level::One, Level::Two];
            let ranges = levels.map(|level| specification.range_of(quantity, level));
            ranges
                .into_iter()
                .flat_map(|r| r.min.into_iter().chain(r.max))
        };
        let (low, high) = extent(points.iter().map(|p| p.at.0).chain(limits(self.x.0)))?;
        let x = ChartAxis::linear(self.x.1, Scale::covering(low.min(0.0), high));
        points.first()?;
        let (low, high) = extent(points.iter().map(|p| p.at.1).chain(limits(self.y.0)))?;
        let y = ChartAxis {
            label: self.y.1.to_owned(),
            scale: if self.is_logarithmic {
                decades(low, high)
            } else {
                Scale::covering(0.0, high)
            },
            is_logarithmic: self.is_logarithmic,
        };
        Some((x, y))
    }
}

fn sides(range: Range) -> (Option<f64>, Option<f64>) {
    (range.min, range.max)
}

/// Level in words; `worse` is the text for a level below all.
#[must_use]
pub fn level_in_words(level: Level, worse: &'static str) -> &'static str {
    match level {
        Level::One => "Level 1",
        Level::Two => "Level 2",
        Level::Three => "Level 3",
        Level::Worse => worse,
    }
}

/// Outline of the 95 % ellipse; empty without a correlation.
fn ellipse((x, at_x): (&QualityRow, f64), (y, at_y): (&QualityRow, f64)) -> Vec<(f64, f64)> {
    let (Some(sx), Some(sy), Some(correlation)) = (
        x.standard_deviation,
        y.standard_deviation,
        y.damping_correlation,
    ) else {
        return vec![];
    };
    let across = (1.0 - correlation * correlation).max(0.0).sqrt();
    let point = |i: u32| {
        let turn = 2.0 * std::f64::consts::PI * f64::from(i) / f64::from(OUTLINE);
        let (sin, cos) = turn.sin_cos();
        (
            at_x + ELLIPSE_95 * sx * cos,
            at_y + ELLIPSE_95 * sy * (correlation * cos + across * sin),
        )
    };
    (0..OUTLINE).map(point).collect()
}

/// Roots of an axis over angle of attack, in the upper half of the plane.
fn locus(roots: &[&RootRow], axis: Axis, airframe: Airframe) -> Option<QualityChart> {
    let own: Vec<&&RootRow> = roots
        .iter()
        .filter(|root| root.axis == axis && root.imaginary >= 0.0)
        .collect();
    let scale = |values: &mut dyn Iterator<Item = f64>, least: f64| {
        let (low, high) = extent(values)?;
        Some(Scale::covering(low.min(least), high.max(0.0)))
    };
    let real = scale(&mut own.iter().map(|r| r.real), f64::INFINITY)?;
    let imaginary = scale(&mut own.iter().map(|r| r.imaginary), 0.0)?;
    let alphas = extent(own.iter().map(|r| r.alpha_deg))?;
    let title = match axis {
        Axis::Longitudinal => "Longitudinal roots over α",
        Axis::Lateral => "Lateral-directional roots over α",
    };
    let id = format!("roots-{axis}-{airframe}");
    let caption = format!(
        "From {} (labelled) to {}; to the right of zero the motion diverges.",
        angle(alphas.0),
        angle(alphas.1)
    );
    let point = |root: &&&RootRow| {
        let is_labelled = (root.alpha_deg - alphas.0).abs() < 1e-9;
        let label = is_labelled.then(|| angle(root.alpha_deg));
        ChartPoint::new((root.real, root.imaginary), label.unwrap_or_default())
    };
    Some(QualityChart::from_chart(&XyChart {
        id: &id,
        title,
        description: &caption,
        x: ChartAxis::linear("real part, 1/s", real),
        y: ChartAxis::linear("imaginary part, rad/s", imaginary),
        boxes: vec![],
        series: vec![ChartSeries {
            colour: DARK_COLOURS[1],
            points: own.iter().map(point).collect(),
            is_joined: false,
        }],
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture::campaign;

    #[test]
    fn a_level_s_line_is_the_probability_of_that_level_or_a_better_one() {
        let campaign = campaign();
        let mut row = campaign.qualities.levels[0].clone();
        row.level_1_pct = 50.0;
        row.level_2_pct = 30.0;
        row.level_3_pct = 15.0;
        let lines = level_lines(&[&row]);
        let at: Vec<f64> = lines.iter().map(|line| line.points[0].at.1).collect();
        assert_eq!(at, [50.0, 80.0, 95.0]);
    }

    #[test]
    fn lines_that_coincide_share_one_label() {
        let campaign = campaign();
        let row = |level_1_pct: f64, level_3_pct: f64| LevelRow {
            level_1_pct,
            level_2_pct: 0.0,
            level_3_pct,
            ..campaign.qualities.levels[0].clone()
        };
        let rows = [row(0.0, 0.0), row(0.0, 90.0), row(1.0, 40.0)];
        let lines = level_lines(&rows.iter().collect::<Vec<_>>());
        let labels = |line: &ChartSeries| {
            let labels = line.points.iter().map(|p| p.label.clone());
            labels.collect::<Vec<_>>()
        };
        assert_eq!(labels(&lines[0]), ["", "", ""]);
        assert_eq!(labels(&lines[1]).concat(), "1, 2");
        assert_eq!(labels(&lines[2]), ["", "3", ""], "where it is alone");
    }
}
