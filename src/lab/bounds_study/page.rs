//! The page of the documentation that says what the bounds are worth: Markdown from the study's
//! tables.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use crate::tables::{CoverageRow, StartRow};

/// What is wanted of every derivative: bias under this share of the scatter, and coverage of the
/// 95% interval between these.
const BIAS: f64 = 0.1;
const COVERED: std::ops::RangeInclusive<f64> = 0.92..=0.98;

/// The page. `command` is what makes it again.
#[must_use]
pub fn page(command: &str, coverage: &[CoverageRow], starts: &[StartRow]) -> String {
    let mut page = format!(
        "# What the bounds are worth\n\n\
         Made by `{command}`. Simulated maneuvers are recorded many times, each time with other noise, and estimated; \
         held values are the true ones. *White* and *coloured* are noise of the five outputs, as the theory has it; \
         coloured noise is a first-order process of the same size. *Noise on every channel* is white, also on surfaces, \
         airspeed and the other axis, which the estimator takes as exact.\n\n\
         *Scatter* is the standard deviation of the estimates, *bound* the root mean square of the bounds they state. \
         Coverage is how often an interval holds the truth; of {records} records it is known to \
         {error:.1} % (one standard error at 95 %), a bias over scatter to {bias:.2}.\n\n",
        records = coverage.iter().map(|r| r.realisations).max().unwrap_or(0),
        error = 100.0 * counting_error(coverage),
        bias = bias_error(coverage),
    );
    page += &summary(coverage);
    page += &starts_table(starts);
    for (residuals, weights) in settings(coverage) {
        let rows = coverage
            .iter()
            .filter(|r| r.residuals == residuals && r.weights == weights);
        let _ = write!(page, "\n## {residuals} residuals, weights: {weights}\n\n");
        page += &derivatives(rows);
    }
    page
}

/// Standard error of a coverage of 95%.
fn counting_error(coverage: &[CoverageRow]) -> f64 {
    let n = coverage
        .iter()
        .map(|r| r.converged)
        .min()
        .unwrap_or(1)
        .max(1) as f64;
    (0.95 * 0.05 / n).sqrt()
}

fn bias_error(coverage: &[CoverageRow]) -> f64 {
    1.0 / (coverage
        .iter()
        .map(|r| r.converged)
        .min()
        .unwrap_or(1)
        .max(1) as f64)
        .sqrt()
}

/// The ways of recording and weighting, in the order they come.
fn settings(coverage: &[CoverageRow]) -> Vec<(&str, &str)> {
    let mut found = Vec::new();
    for row in coverage {
        let setting = (row.residuals.as_str(), row.weights.as_str());
        if !found.contains(&setting) {
            found.push(setting);
        }
    }
    found
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn share<'a>(
    rows: impl Iterator<Item = &'a CoverageRow> + Clone,
    holds: impl Fn(&CoverageRow) -> bool,
) -> f64 {
    100.0 * rows.clone().filter(|r| holds(r)).count() as f64 / rows.count().max(1) as f64
}

fn summary(coverage: &[CoverageRow]) -> String {
    let mut text = String::from(
        "| residuals | weights | maneuvers × derivatives | `bound`: scatter / bound, coverage of 95 % | \
         `bound_corrected`: scatter / bound, coverage of 68 %, of 95 % | 95 % covered 92 to 98 % of the time | \
         bias under 0.1 scatter |\n|---|---|---|---|---|---|---|\n",
    );
    for (residuals, weights) in settings(coverage) {
        let rows = coverage
            .iter()
            .filter(|r| r.residuals == residuals && r.weights == weights);
        let of = |f: fn(&CoverageRow) -> f64| median(rows.clone().map(f));
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

fn starts_table(starts: &[StartRow]) -> String {
    if starts.is_empty() {
        return String::new();
    }
    let mut text = String::from(
        "\n## Starting elsewhere\n\nHow often the iteration reaches the minimum that it reaches from the truth (no \
         derivative differs by more than a tenth of its bound): by itself, and as the program does it, from the \
         equation error's solution where it does not converge from the given values.\n\n\
         | starting values | records | reached by itself | reached |\n|---|---|---|---|\n",
    );
    let kinds: BTreeSet<&str> = starts.iter().map(|r| r.start.as_str()).collect();
    for kind in kinds {
        let rows = starts.iter().filter(|r| r.start == kind);
        let sum = |f: fn(&StartRow) -> usize| rows.clone().map(f).sum::<usize>();
        let records = sum(|r| r.records);
        let percent = |count: usize| 100.0 * count as f64 / records.max(1) as f64;
        let (alone, reached) = (percent(sum(|r| r.alone)), percent(sum(|r| r.reached)));
        let _ = writeln!(
            text,
            "| {kind} | {records} | {alone:.1} % | {reached:.1} % |"
        );
    }
    text
}

/// A row per class and derivative, over its angles of attack.
fn derivatives<'a>(rows: impl Iterator<Item = &'a CoverageRow>) -> String {
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

    fn row(residuals: &str, alpha_deg: f64, covered: f64) -> CoverageRow {
        CoverageRow {
            class: "class".into(),
            alpha_deg,
            residuals: residuals.into(),
            weights: "table".into(),
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
    fn the_page_says_how_many_intervals_keep_their_promise() {
        let rows = [
            row("white", 10.0, 0.95),
            row("white", 20.0, 0.90),
            row("coloured", 10.0, 0.93),
        ];
        let starts = [StartRow {
            class: "class".into(),
            alpha_deg: 10.0,
            start: "half".into(),
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
        assert!(page.contains("| half | 200 | 75.0 % | 99.5 % |"), "{page}");
        assert!(
            page.contains(
                "| class | derivative | 10, 20 | 0.05, 0.05 | 2.00, 2.00 | 1.00, 1.00 | 68, 68 | 95.0, 90.0 |"
            )
        );
        assert!(page.contains("\n## coloured residuals, weights: table\n"));
    }
}
