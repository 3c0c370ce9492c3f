//! Section of the flying qualities: levels with their probabilities, modes, charts.

use serde::Serialize;

use super::quality_charts::{self, QualityChart, level_in_words};
use crate::aero::Axis;
use crate::qualities::{Qualities, Specification};
use crate::report::contents::Contents;
use crate::report::notation::{DASH, angle, fixed, number};
use crate::report::table_view::TableView;
use crate::tables::{ALL_PARAGRAPHS, Airframe, FlyingQuality, Level, LevelRow, QualityRow};

/// Values of the section.
#[derive(Clone, Debug, Serialize)]
pub struct QualitiesSection {
    pub note: String,
    pub airframes: Vec<AirframeView>,
}

/// One configuration of the aircraft.
#[derive(Clone, Debug, Serialize)]
pub struct AirframeView {
    pub title: String,
    /// The board's answer in a sentence or two.
    pub answer: String,
    pub charts: Vec<QualityChart>,
    pub tables: Vec<TableView>,
}

/// Probability from which a level counts as certain, per cent.
const CERTAIN_PCT: f64 = 95.0;

/// Spacing of the tables' angles of attack, deg.
const SPACING_DEG: f64 = 5.0;

/// Quantities of an axis with their symbols.
const LONGITUDINAL: [(FlyingQuality, &str); 7] = [
    (FlyingQuality::ShortPeriodFrequency, "ω sp, rad/s"),
    (FlyingQuality::ShortPeriodDamping, "ζ sp"),
    (FlyingQuality::LoadFactorPerAlpha, "n/α, g/rad"),
    (FlyingQuality::ControlAnticipation, "CAP, 1/(g s²)"),
    (FlyingQuality::AttitudeZero, "1/T θ2, 1/s"),
    (FlyingQuality::PhugoidFrequency, "ω ph, rad/s"),
    (FlyingQuality::PhugoidDamping, "ζ ph"),
];
const LATERAL: [(FlyingQuality, &str); 6] = [
    (FlyingQuality::DutchRollFrequency, "ω d, rad/s"),
    (FlyingQuality::DutchRollDamping, "ζ d"),
    (FlyingQuality::PhiBeta, "|φ/β|"),
    (FlyingQuality::RollTimeConstant, "T R, s"),
    (FlyingQuality::SpiralRate, "1/T s, 1/s"),
    (FlyingQuality::RollSpiralDecay, "ζω of roll and spiral, 1/s"),
];

/// Makes the section; `None` without a specification or flown conditions.
#[must_use]
pub fn section(contents: &Contents) -> Option<QualitiesSection> {
    let specification = contents.specification?;
    let qualities = contents.qualities;
    if qualities.levels.is_empty() {
        return None;
    }
    let airframes = specification.airframes().into_iter();
    Some(QualitiesSection {
        note: format!(
            "{}. Category {}, class {}. Modes of the equations that are estimated, linearised about \
             steady wings-level flight at the mass, dynamic pressure, Mach number and path flown at \
             each angle of attack, with the posterior's derivatives. The probabilities count the \
             posterior's covariance; they do not include pilot ratings.",
            specification.specification, specification.category, specification.class
        ),
        airframes: airframes
            .map(|airframe| view(qualities, specification, airframe))
            .collect(),
    })
}

fn view(qualities: &Qualities, specification: &Specification, airframe: Airframe) -> AirframeView {
    let levels: Vec<&LevelRow> = qualities
        .levels
        .iter()
        .filter(|row| row.airframe == airframe)
        .collect();
    let rows: Vec<&QualityRow> = qualities
        .qualities
        .iter()
        .filter(|row| row.airframe == airframe)
        .collect();
    let alphas = spaced(&levels);
    AirframeView {
        title: match airframe {
            Airframe::Bare => "Bare airframe".to_owned(),
            Airframe::Augmented => "With feedback".to_owned(),
        },
        answer: answer(&levels),
        charts: quality_charts::charts(qualities, specification, airframe),
        tables: vec![
            level_table(&levels, &alphas),
            mode_table(&rows, &alphas, Axis::Longitudinal, &LONGITUDINAL),
            mode_table(&rows, &alphas, Axis::Lateral, &LATERAL),
        ],
    }
}

/// Angles of attack at multiples of the tables' spacing; all angles if no multiple was judged.
fn spaced(levels: &[&LevelRow]) -> Vec<f64> {
    let mut all: Vec<f64> = levels.iter().map(|row| row.alpha_deg).collect();
    all.dedup();
    let is_multiple = |alpha: &f64| {
        let share = alpha / SPACING_DEG;
        (share - share.round()).abs() < 1e-6
    };
    let spaced: Vec<f64> = all.iter().copied().filter(is_multiple).collect();
    if spaced.is_empty() { all } else { spaced }
}

fn is_at(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

/// Answer in sentences: angles of attack with Level 1 for certain, most probable level elsewhere,
/// and the paragraph that fails most.
fn answer(levels: &[&LevelRow]) -> String {
    let all: Vec<&&LevelRow> = levels
        .iter()
        .filter(|row| row.paragraph == ALL_PARAGRAPHS)
        .collect();
    let certain = |row: &&&&LevelRow, most: Level| {
        let shares = [row.level_1_pct, row.level_2_pct, row.level_3_pct];
        let count = most as usize + 1;
        shares[..count.min(3)].iter().sum::<f64>() >= CERTAIN_PCT
    };
    let share = |most: Level| {
        let met = all.iter().filter(|row| certain(row, most)).count();
        format!("{met} of {}", all.len())
    };
    let mut text = format!(
        "With at least {CERTAIN_PCT:.0} % probability every paragraph is met at Level 1 at {} angles \
         of attack, at Level 2 or better at {}, and at Level 3 or better at {}.",
        share(Level::One),
        share(Level::Two),
        share(Level::Three)
    );
    text.extend(worst(levels));
    text.extend(least_certain(levels).map(|row| {
        format!(
            " The least certain is {}: {}.",
            place_in_words(row),
            probabilities_in_words(row)
        )
    }));
    text
}

/// Paragraph with the largest probability of missing Level 1, and where; of several, the one that is worst on
/// average. `None` where every paragraph is certain to meet Level 1.
fn worst(levels: &[&LevelRow]) -> Option<String> {
    let mean_level = |row: &LevelRow| {
        row.level_1_pct + 2.0 * row.level_2_pct + 3.0 * row.level_3_pct + 4.0 * row.worse_pct
    };
    let badness = |row: &LevelRow| (-row.level_1_pct, mean_level(row));
    let own = levels.iter().filter(|row| row.paragraph != ALL_PARAGRAPHS);
    let worst = own.max_by(|a, b| {
        let (a, b) = (badness(a), badness(b));
        // The first of equals stands at the lowest angle of attack.
        a.0.total_cmp(&b.0)
            .then(a.1.total_cmp(&b.1))
            .then(std::cmp::Ordering::Greater)
    })?;
    (worst.level_1_pct < CERTAIN_PCT).then(|| {
        format!(
            " The worst is {}: it misses Level 1 with {} % probability, and is worse than Level 3 with {} %.",
            place_in_words(worst),
            fixed(100.0 - worst.level_1_pct, 0),
            fixed(worst.worse_pct, 0)
        )
    })
}

/// Paragraph and angle of attack whose level is least certain: the largest entropy of its probabilities. `None` where
/// every level is certain.
#[must_use]
pub fn least_certain<'a>(levels: &[&'a LevelRow]) -> Option<&'a LevelRow> {
    let entropy = |row: &LevelRow| -> f64 {
        let shares = probabilities(row).map(|(_, pct)| 0.01 * pct);
        shares
            .iter()
            .filter(|p| **p > 0.0)
            .map(|p| -p * p.ln())
            .sum()
    };
    let own = levels
        .iter()
        .copied()
        .filter(|row| row.paragraph != ALL_PARAGRAPHS);
    let most = own.max_by(|a, b| entropy(a).total_cmp(&entropy(b)))?;
    (most_probable(most).1 < CERTAIN_PCT).then_some(most)
}

/// Probability of each level, percent.
fn probabilities(row: &LevelRow) -> [(Level, f64); 4] {
    [
        (Level::One, row.level_1_pct),
        (Level::Two, row.level_2_pct),
        (Level::Three, row.level_3_pct),
        (Level::Worse, row.worse_pct),
    ]
}

/// Most probable level with its probability, percent; of equals the better one.
#[must_use]
pub fn most_probable(row: &LevelRow) -> (Level, f64) {
    let better_of_equals = |a: (Level, f64), b: (Level, f64)| if b.1 > a.1 { b } else { a };
    let [first, others @ ..] = probabilities(row);
    others.into_iter().fold(first, better_of_equals)
}

/// Subject, paragraph and angle of attack: `Dutch roll (3.3.1.1) at 20°`.
#[must_use]
pub fn place_in_words(row: &LevelRow) -> String {
    format!(
        "{} ({}) at {}",
        row.subject,
        row.paragraph,
        angle(row.alpha_deg)
    )
}

/// Levels with their probabilities, without those that round to zero.
fn probabilities_in_words(row: &LevelRow) -> String {
    let likely = probabilities(row)
        .into_iter()
        .filter(|(_, pct)| *pct >= 0.5);
    let words: Vec<String> = likely
        .map(|(level, pct)| {
            format!(
                "{} with {} %",
                level_in_words(level, "worse"),
                fixed(pct, 0)
            )
        })
        .collect();
    words.join(", ")
}

/// Level and its probability of each paragraph, by angle of attack.
fn level_table(levels: &[&LevelRow], alphas: &[f64]) -> TableView {
    let paragraphs: Vec<&&LevelRow> = levels
        .iter()
        .filter(|row| alphas.first().is_some_and(|a| is_at(row.alpha_deg, *a)))
        .collect();
    let head = |row: &&&LevelRow| format!("{} {}", row.paragraph, row.subject);
    let heads: Vec<String> = paragraphs.iter().map(head).collect();
    let heads: Vec<&str> = std::iter::once("α")
        .chain(heads.iter().map(String::as_str))
        .collect();
    let line = |alpha: &f64| {
        let cell = |paragraph: &&&LevelRow| {
            let own = levels
                .iter()
                .find(|row| is_at(row.alpha_deg, *alpha) && row.paragraph == paragraph.paragraph);
            own.map_or_else(|| DASH.to_owned(), |row| level_cell(row))
        };
        let cells = paragraphs.iter().map(cell);
        std::iter::once(angle(*alpha)).chain(cells).collect()
    };
    TableView::new(
        "Levels",
        "Level at the mean of the posterior, and its probability.",
        &heads,
        alphas.iter().map(line).collect(),
    )
}

fn level_cell(row: &LevelRow) -> String {
    let probability = match row.level {
        Level::One => row.level_1_pct,
        Level::Two => row.level_2_pct,
        Level::Three => row.level_3_pct,
        Level::Worse => row.worse_pct,
    };
    format!("{} ({} %)", row.level, fixed(probability, 0))
}

/// Quantities of an axis with their standard deviations, by angle of attack.
fn mode_table(
    rows: &[&QualityRow],
    alphas: &[f64],
    axis: Axis,
    quantities: &[(FlyingQuality, &str)],
) -> TableView {
    let heads: Vec<&str> = ["α", "q̄, lb/ft²", "path"]
        .into_iter()
        .chain(quantities.iter().map(|(_, symbol)| *symbol))
        .collect();
    let line = |alpha: &f64| {
        let at = |quantity: FlyingQuality| {
            let mut own = rows.iter();
            own.find(|row| is_at(row.alpha_deg, *alpha) && row.quantity == quantity)
        };
        let flown = rows
            .iter()
            .find(|row| row.axis == axis && is_at(row.alpha_deg, *alpha))?;
        let condition = [
            angle(*alpha),
            fixed(flown.qbar_psf, 0),
            angle(flown.path_deg),
        ];
        let cells = quantities
            .iter()
            .map(|(quantity, _)| mode_cell(at(*quantity)));
        Some(condition.into_iter().chain(cells).collect())
    };
    let title = match axis {
        Axis::Longitudinal => "Longitudinal modes",
        Axis::Lateral => "Lateral-directional modes",
    };
    TableView::new(
        title,
        "Value ± standard deviation. – : the mode does not exist or diverges.",
        &heads,
        alphas.iter().filter_map(line).collect(),
    )
}

fn mode_cell(row: Option<&&QualityRow>) -> String {
    let Some(value) = row.and_then(|row| row.value) else {
        return DASH.to_owned();
    };
    let deviation = row.and_then(|row| row.standard_deviation);
    format!("{} ± {}", number(Some(value), 3), number(deviation, 2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture::campaign;

    #[test]
    fn the_answer_counts_the_angles_of_attack_that_are_certain() {
        let campaign = campaign();
        let section = section(&campaign.contents()).expect("a section");
        let bare = &section.airframes[0];
        assert!(
            bare.answer.contains("Level 1 at 1 of 3 angles"),
            "{}",
            bare.answer
        );
        assert!(
            bare.answer.contains("Level 2 or better at 3 of 3"),
            "{}",
            bare.answer
        );
        assert!(
            bare.answer.ends_with(
                " The worst is short-period damping (3.2.2.1.2) at 30°: it misses Level 1 with 99 % \
                 probability, and is worse than Level 3 with 0 %. The least certain is short-period damping \
                 (3.2.2.1.2) at 20°: Level 1 with 60 %, Level 2 with 40 %."
            ),
            "{}",
            bare.answer
        );
        assert_eq!(
            bare.charts.len(),
            4,
            "probabilities, two charts of levels and the lateral roots"
        );
        let levels = &bare.tables[0];
        assert_eq!(levels.rows[1], ["20°", "1 (60 %)", "1 (60 %)"]);
        assert_eq!(bare.tables[1].rows[0][4], "0.550 ± 0.050");
    }

    #[test]
    fn the_worst_of_several_that_miss_level_1_is_the_one_with_the_worst_levels() {
        let mut campaign = campaign();
        for row in &mut campaign.qualities.levels {
            (row.level_1_pct, row.level_2_pct) = (0.0, 100.0);
        }
        let last = campaign.qualities.levels.len() - 2;
        let row = &mut campaign.qualities.levels[last];
        (row.level_2_pct, row.worse_pct) = (0.0, 100.0);
        let levels: Vec<&LevelRow> = campaign.qualities.levels.iter().collect();
        let answer = answer(&levels);
        assert!(
            answer.contains("at 30°: it misses Level 1 with 100 % probability, and is worse than Level 3 with 100 %"),
            "{answer}"
        );
        assert!(
            !answer.contains("least certain"),
            "every level is certain: {answer}"
        );
    }

    #[test]
    fn without_a_specification_there_is_no_section() {
        let mut campaign = campaign();
        campaign.specification = None;
        assert!(section(&campaign.contents()).is_none());
    }

    #[test]
    fn the_page_has_the_charts_and_the_answer() {
        let campaign = campaign();
        let page = crate::report::html(&campaign.contents(), None).expect("a page");
        let (answer, tables) = (page.find("Level 2 or better"), page.find("<table"));
        assert!(
            answer < tables && answer.is_some(),
            "the answer stands before any table"
        );
        let picture = page.find("id=\"chart-levels-bare\"");
        assert!(answer < picture && picture < tables, "and its picture");
        assert_eq!(page.matches("id=\"chart-levels-bare\"").count(), 1);
        assert!(page.contains("id=\"chart-short-period-bare\""));
        assert!(page.contains("id=\"chart-roots-lateral-bare\""));
        assert!(!page.contains("NaN"));
    }
}
