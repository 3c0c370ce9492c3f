//! Page of the documentation with the results of the study, Markdown.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use crate::numerics::order_statistics::upper_median;
use crate::tables::{CoverageRow, Residuals, StartRow, StartVariant, Weights};

/// Criterion for the bias of a derivative: below this share of the scatter.
const BIAS: f64 = 0.1;

/// Criterion for the coverage of the 95% interval of a derivative.
const COVERED: std::ops::RangeInclusive<f64> = 0.92..=0.98;

/// Page of a study; `command` repeats it.
#[must_use]
pub fn page(command: &str, coverage: &[CoverageRow], starts: &[StartRow]) -> String {
    let mut page = introduction(command, coverage);
    page += &summary(coverage);
    page += &starts_table(starts);
    for (residuals, weights) in scenarios(coverage) {
        let rows = coverage
            .iter()
            .filter(|r| r.residuals == residuals && r.weights == weights);
        let _ = write!(page, "\n## {residuals} residuals, weights: {weights}\n\n");
        page += &derivatives_table(rows);
    }
    page
}

fn introduction(command: &str, coverage: &[CoverageRow]) -> String {
    format!(
        "# Coverage of the bounds\n\n\
         Made by `{command}`, harvest {version}, sources {sources}.\n\n\
         Simulated maneuvers with known derivatives are recorded {records} times each, with fresh noise, and \
         estimated. Held derivatives have their true values. *White* and *coloured* noise act on the five \
         outputs, as the theory assumes; coloured noise is a first-order process with the same standard \
         deviation. *Noise on every channel* is white and acts also on surfaces, airspeed and the other axis, \
         which the estimator takes as exact.\n\n\
         *Scatter* is the standard deviation of the estimates, *bound* the root mean square of their bounds. \
         *Coverage* is the share of the intervals that contain the truth. The number of records leaves a \
         standard error of {error:.1} % in a coverage of 95 %, and of {bias:.2} in a ratio of bias to \
         scatter.\n\n",
        version = env!("CARGO_PKG_VERSION"),
        sources = env!("HARVEST_SOURCE"),
        records = coverage.iter().map(|r| r.realisations).max().unwrap_or(0),
        error = 100.0 * coverage_error(coverage),
        bias = bias_error(coverage),
    )
}

/// Least number of converged records of any maneuver.
fn least_converged(coverage: &[CoverageRow]) -> f64 {
    let converged = coverage.iter().map(|r| r.converged);
    converged.min().unwrap_or(1).max(1) as f64
}

/// Standard error of a coverage of 95%.
fn coverage_error(coverage: &[CoverageRow]) -> f64 {
    (0.95 * 0.05 / least_converged(coverage)).sqrt()
}

/// Standard error of the ratio of bias to scatter.
fn bias_error(coverage: &[CoverageRow]) -> f64 {
    1.0 / least_converged(coverage).sqrt()
}

/// Pairs of residuals and weights, in order of appearance.
fn scenarios(coverage: &[CoverageRow]) -> Vec<(Residuals, Weights)> {
    let mut found = Vec::new();
    for row in coverage {
        let scenario = (row.residuals, row.weights);
        if !found.contains(&scenario) {
            found.push(scenario);
        }
    }
    found
}

/// Percentage of rows that satisfy a condition.
fn share<'a>(
    rows: impl Iterator<Item = &'a CoverageRow> + Clone,
    holds: impl Fn(&CoverageRow) -> bool,
) -> f64 {
    100.0 * rows.clone().filter(|r| holds(r)).count() as f64 / rows.count().max(1) as f64
}

/// Medians over maneuvers and derivatives: a row per scenario.
fn summary(coverage: &[CoverageRow]) -> String {
    let mut text = String::from(
        "| residuals | weights | maneuvers × derivatives | `bound`: scatter / bound, coverage of 95 % | \
         `bound_corrected`: scatter / bound, coverage of 68 %, of 95 % | coverage of 95 % between 92 and 98 % | \
         bias below 0.1 scatter |\n|---|---|---|---|---|---|---|\n",
    );
    for (residuals, weights) in scenarios(coverage) {
        let rows = coverage
            .iter()
            .filter(|r| r.residuals == residuals && r.weights == weights);
        let of = |f: fn(&CoverageRow) -> f64| upper_median(rows.clone().map(f)).unwrap_or(f64::NAN);
        let _ = writeln!(
            text,
            "| {residuals} | {weights} | {} | {:.2}, {:.1} % | {:.2}, {:.1} %, {:.1} % | {:.0} % | {:.0} % |",
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
    text + "\nRatios and coverages are medians over maneuvers and derivatives.\n"
}

/// Minima reached from other starting values: a row per kind of start.
fn starts_table(starts: &[StartRow]) -> String {
    if starts.is_empty() {
        return String::new();
    }
    let mut text = String::from(
        "\n## Other starting values\n\nShare of the records whose iteration reaches the same minimum as from the true \
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

    fn row(residuals: Residuals, alpha_deg: f64, covered: f64) -> CoverageRow {
        CoverageRow {
            class: "class".into(),
            alpha_deg,
            residuals,
            weights: Weights::Table,
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

    #[test]
    fn the_page_counts_the_derivatives_that_meet_the_criteria() {
        let rows = [
            row(Residuals::White, 10.0, 0.95),
            row(Residuals::White, 20.0, 0.90),
            row(Residuals::Coloured, 10.0, 0.93),
        ];
        let starts = [StartRow {
            class: "class".into(),
            alpha_deg: 10.0,
            start: StartVariant::Half,
            records: 200,
            alone: 150,
            reached: 199,
        }];
        let page = page("make validate", &rows, &starts);
        assert!(
            page.contains(
                "| white | table | 2 | 2.00, 70.0 % | 1.00, 68.0 %, 95.0 % | 50 % | 100 % |"
            ),
            "{page}"
        );
        assert!(
            page.contains("| half the truth | 200 | 75.0 % | 99.5 % |"),
            "{page}"
        );
        assert!(
            page.contains(
                "| class | derivative | 10, 20 | 0.05, 0.05 | 2.00, 2.00 | 1.00, 1.00 | 68, 68 | 95.0, 90.0 |"
            )
        );
        assert!(page.contains("\n## coloured residuals, weights: table\n"));
    }
}
