//! Page of the documentation with the results of the study, Markdown.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::condition_rows::ALL_CLASSES;
use crate::lab::campaign::StudyCondition;
use crate::numerics::statistics::order_statistics::upper_median;
use crate::tables::{ConditionRow, CoverageRow, StartRow, StartVariant};

/// Criterion for the bias of a derivative: below this share of the scatter.
const BIAS: f64 = 0.1;

/// Criterion for the coverage of the 95% interval of a derivative.
const COVERED: std::ops::RangeInclusive<f64> = 0.92..=0.98;

/// Tables of a study, for its page.
#[derive(Clone, Copy)]
pub struct StudyTables<'a> {
    pub conditions: &'a [ConditionRow],
    pub coverage: &'a [CoverageRow],
    pub starts: &'a [StartRow],
}

/// Page of a study; `command` repeats it.
#[must_use]
pub fn page(command: &str, conditions: &[StudyCondition], study: StudyTables) -> String {
    let mut page = introduction(command, study.coverage);
    page += &conditions_table(conditions);
    page += &errors_table(study.conditions);
    page += &summary(conditions, study.coverage);
    page += &starts_table(study.starts);
    for condition in conditions {
        let _ = write!(page, "\n## {}\n\n{condition}.\n\n", condition.name);
        page += &classes_table(of_condition(study.conditions, &condition.name));
        page.push('\n');
        let rows = study.coverage.iter();
        page += &derivatives_table(rows.filter(|r| r.condition == condition.name));
    }
    page
}

fn introduction(command: &str, coverage: &[CoverageRow]) -> String {
    let records = coverage.iter().map(|r| r.realisations).max().unwrap_or(0);
    let least = least_converged(coverage);
    format!(
        "# Coverage of the bounds\n\n\
         Made by `{command}`, harvest {version}, sources {sources}.\n\n\
         Simulated maneuvers with known derivatives are flown and recorded {records} times under each \
         condition, and estimated with the campaign's settings. In turbulence and gusts each record is of a \
         flight of its own; in still air only the noise differs. Instruments have noise and no other errors; \
         held derivatives have their true values. Coloured noise is a first-order process with the standard \
         deviation of the white noise.\n\n\
         *Scatter* is the standard deviation of the estimates, *bound* the root mean square of their bounds. \
         *Coverage* is the share of the intervals that contain the truth. With \
         {records} records, a coverage of 95 % of one derivative has a standard error of {error:.1} %, and a \
         ratio of bias to scatter one of {bias:.2}; in the row with fewest converged records ({least}), \
         {most_error:.1} % and {most_bias:.2}.\n",
        version = env!("CARGO_PKG_VERSION"),
        sources = env!("HARVEST_SOURCE"),
        error = 100.0 * coverage_error(records),
        bias = bias_error(records),
        most_error = 100.0 * coverage_error(least),
        most_bias = bias_error(least),
    )
}

/// Least number of converged records of any maneuver.
fn least_converged(coverage: &[CoverageRow]) -> usize {
    let converged = coverage.iter().map(|r| r.converged);
    converged.min().unwrap_or(1).max(1)
}

/// Standard error of a coverage of 95% from a number of records.
fn coverage_error(records: usize) -> f64 {
    (0.95 * 0.05 / records as f64).sqrt()
}

/// Standard error of the ratio of bias to scatter from a number of records.
fn bias_error(records: usize) -> f64 {
    1.0 / (records as f64).sqrt()
}

fn conditions_table(conditions: &[StudyCondition]) -> String {
    let mut text = String::from("\n| condition | what is flown and recorded |\n|---|---|\n");
    for condition in conditions {
        let _ = writeln!(text, "| {} | {condition} |", condition.name);
    }
    text
}

/// Rows of a condition, that of all classes first.
fn of_condition<'a>(
    rows: &'a [ConditionRow],
    name: &'a str,
) -> impl Iterator<Item = &'a ConditionRow> {
    rows.iter().filter(move |row| row.condition == name)
}

/// Heads of the columns about all estimates of a condition or class.
const ERROR_HEADS: &str = "records, converged | median steps | estimates | 95 % intervals of `bound`, of \
    `bound_corrected` that contain the truth | median error, median `bound_corrected`, % of the size | median \
    `bound_corrected` / `bound` |";

/// Cells of the columns about all estimates of a condition or class.
fn error_cells(row: &ConditionRow) -> String {
    let number = |value: Option<f64>, digits: usize| {
        let value = value.filter(|v| v.is_finite());
        value.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"))
    };
    format!(
        "{}, {} | {} | {} | {}, {} % | {}, {} | {} |",
        row.records,
        row.converged,
        number(row.iterations, 0),
        row.estimates,
        number(Some(100.0 * row.coverage_95), 1),
        number(Some(100.0 * row.corrected_coverage_95), 1),
        number(row.error_pct, 1),
        number(row.corrected_bound_pct, 1),
        number(row.correction, 2),
    )
}

/// Error and coverage of all estimates: a row per condition.
fn errors_table(rows: &[ConditionRow]) -> String {
    let mut text = format!(
        "\n## All estimates\n\nConstants are left out. The size of a derivative is the root mean square of \
         its true table.\n\n| condition | {ERROR_HEADS}\n|---|---|---|---|---|---|---|\n"
    );
    for row in rows.iter().filter(|r| r.class == ALL_CLASSES) {
        let _ = writeln!(text, "| {} | {}", row.condition, error_cells(row));
    }
    text
}

/// Error and coverage of one condition: a row per class.
fn classes_table<'a>(rows: impl Iterator<Item = &'a ConditionRow>) -> String {
    let mut text = format!("| class | {ERROR_HEADS}\n|---|---|---|---|---|---|---|\n");
    for row in rows {
        let _ = writeln!(text, "| {} | {}", row.class, error_cells(row));
    }
    text
}

/// Percentage of rows that satisfy a condition.
fn share<'a>(
    rows: impl Iterator<Item = &'a CoverageRow> + Clone,
    holds: impl Fn(&CoverageRow) -> bool,
) -> f64 {
    100.0 * rows.clone().filter(|r| holds(r)).count() as f64 / rows.count().max(1) as f64
}

/// Medians over maneuvers and derivatives: a row per condition.
fn summary(conditions: &[StudyCondition], coverage: &[CoverageRow]) -> String {
    let mut text = String::from(
        "\n## Each derivative\n\nRatios and coverages are medians over maneuvers and derivatives.\n\n\
         | condition | maneuvers × derivatives | `bound`: scatter / bound, coverage of 95 % | \
         `bound_corrected`: scatter / bound, coverage of 68 %, of 95 % | coverage of 95 % between 92 and 98 % | \
         bias below 0.1 scatter |\n|---|---|---|---|---|---|\n",
    );
    for condition in conditions {
        let rows = coverage.iter().filter(|r| r.condition == condition.name);
        let of = |f: fn(&CoverageRow) -> f64| upper_median(rows.clone().map(f)).unwrap_or(f64::NAN);
        let _ = writeln!(
            text,
            "| {} | {} | {:.2}, {:.1} % | {:.2}, {:.1} %, {:.1} % | {:.0} % | {:.0} % |",
            condition.name,
            rows.clone().count(),
            of(|r| r.scatter_over_bound),
            100.0 * of(|r| r.coverage_95),
            of(|r| r.scatter_over_corrected),
            100.0 * of(|r| r.corrected_coverage_68),
            100.0 * of(|r| r.corrected_coverage_95),
            share(rows.clone(), |r| COVERED.contains(&r.corrected_coverage_95)),
            share(rows.clone(), |r| r.bias_over_scatter.abs() < BIAS),
        );
    }
    text
}

/// Minima reached from other starting values: a row per kind of start.
fn starts_table(starts: &[StartRow]) -> String {
    if starts.is_empty() {
        return String::new();
    }
    let mut text = String::from(
        "\n## Other starting values\n\nShare of the records whose iteration by output error reaches the same minimum as from the true \
         values (no derivative differs by more than a tenth of its bound): unaided, and with the program's second \
         start from the equation-error solution.\n\n\
         | starting values | records | reached unaided | reached |\n|---|---|---|---|\n",
    );
    let kinds: BTreeSet<StartVariant> = starts.iter().map(|r| r.start).collect();
    for kind in kinds {
        let rows = starts.iter().filter(|r| r.start == kind);
        let sum = |count: fn(&StartRow) -> usize| rows.clone().map(count).sum::<usize>();
        let records = sum(|r| r.records);
        let percent = |count: usize| 100.0 * count as f64 / records.max(1) as f64;
        let (unaided, reached) = (percent(sum(|r| r.alone)), percent(sum(|r| r.reached)));
        let _ = writeln!(
            text,
            "| {kind} | {records} | {unaided:.1} % | {reached:.1} % |"
        );
    }
    text
}

/// Results by class and derivative, over the angles of attack.
fn derivatives_table<'a>(rows: impl Iterator<Item = &'a CoverageRow>) -> String {
    let mut groups: Vec<(&str, &str)> = Vec::new();
    let mut members: BTreeMap<(&str, &str), Vec<&CoverageRow>> = BTreeMap::new();
    for row in rows {
        let key = (row.class.as_str(), row.derivative.as_str());
        if !members.contains_key(&key) {
            groups.push(key);
        }
        members.entry(key).or_default().push(row);
    }
    let mut text = String::from(
        "| class | derivative | α, deg | bias / scatter | scatter / bound | scatter / corrected | 68 % covered | \
         95 % covered |\n|---|---|---|---|---|---|---|---|\n",
    );
    for key in groups {
        let each = |f: &dyn Fn(&CoverageRow) -> String| {
            members[&key]
                .iter()
                .map(|r| f(r))
                .collect::<Vec<_>>()
                .join(", ")
        };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} |",
            key.0,
            key.1,
            each(&|r| format!("{:.0}", r.alpha_deg)),
            each(&|r| format!("{:.2}", r.bias_over_scatter)),
            each(&|r| format!("{:.2}", r.scatter_over_bound)),
            each(&|r| format!("{:.2}", r.scatter_over_corrected)),
            each(&|r| format!("{:.0}", 100.0 * r.corrected_coverage_68)),
            each(&|r| format!("{:.1}", 100.0 * r.corrected_coverage_95)),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::campaign::RecordNoise;
    use crate::lab::simulator::DerivativeLookup;

    fn condition(name: &str) -> StudyCondition {
        StudyCondition {
            name: name.into(),
            turbulence: None,
            discrete_gusts: None,
            derivatives: DerivativeLookup::Frozen,
            surface_delay_s: 0.0,
            noise: RecordNoise::EveryChannel,
            weights: None,
        }
    }

    fn coverage_row(condition: &str, alpha_deg: f64, covered: f64) -> CoverageRow {
        CoverageRow {
            class: "class".into(),
            alpha_deg,
            condition: condition.into(),
            derivative: "derivative".into(),
            unit: "1/deg".into(),
            truth: 1.0,
            realisations: 100,
            converged: 100,
            bias: 0.0,
            scatter: 1.0,
            bias_over_scatter: 0.05,
            scatter_over_bound: 2.0,
            coverage_68: 0.4,
            coverage_95: 0.7,
            scatter_over_corrected: 1.0,
            corrected_coverage_68: 0.68,
            corrected_coverage_95: covered,
        }
    }

    fn condition_row(condition: &str, class: &str) -> ConditionRow {
        ConditionRow {
            condition: condition.into(),
            class: class.into(),
            records: 200,
            converged: 190,
            iterations: Some(6.0),
            estimates: 2850,
            coverage_95: 0.812,
            corrected_coverage_95: 0.951,
            error_pct: Some(4.04),
            corrected_bound_pct: Some(6.0),
            correction: None,
        }
    }

    #[test]
    fn the_page_has_rows_for_conditions_and_classes_and_counts_what_meets_the_criteria() {
        let conditions = [condition("still"), condition("gusts")];
        let tables = StudyTables {
            conditions: &[
                condition_row("still", ALL_CLASSES),
                condition_row("still", "OLAT"),
            ],
            coverage: &[
                coverage_row("still", 10.0, 0.95),
                coverage_row("still", 20.0, 0.90),
                coverage_row("gusts", 10.0, 0.93),
            ],
            starts: &[StartRow {
                class: "class".into(),
                alpha_deg: 10.0,
                start: StartVariant::Half,
                records: 200,
                alone: 150,
                reached: 199,
            }],
        };
        let page = page("make validate", &conditions, tables);
        for line in [
            "| still | still air; noise on every channel |",
            "| still | 200, 190 | 6 | 2850 | 81.2, 95.1 % | 4.0, 6.0 | – |",
            "| OLAT | 200, 190 | 6 | 2850 | 81.2, 95.1 % | 4.0, 6.0 | – |",
            "| still | 2 | 2.00, 70.0 % | 1.00, 68.0 %, 95.0 % | 50 % | 100 % |",
            "| half the truth | 200 | 75.0 % | 99.5 % |",
            "| class | derivative | 10, 20 | 0.05, 0.05 | 2.00, 2.00 | 1.00, 1.00 | 68, 68 | 95.0, 90.0 |",
            "## gusts",
        ] {
            assert!(page.lines().any(|l| l == line), "{line}\n{page}");
        }
    }
}
