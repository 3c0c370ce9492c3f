//! The page that explains the tables, made from their declarations: `docs/tables.md`.

use std::fmt::Write;

use super::{
    AgreementRow, ChangeRow, ChannelRow, CheckRow, ComparisonRow, ConditionRow, ContributionRow,
    CorrelationRow, CovarianceRow, CoverageRow, DisagreementRow, DrawRow, EstimateRow, EventRow,
    ExportRow, ExtrapolationRow, FitRow, FlightRow, InstrumentRow, InstrumentTrendRow, JointRow,
    LevelRow, LiftAndDragRow, ManeuverComparisonRow, MatchRow, MatchVerdictRow, NextCardRow,
    NextGoalRow, OutlierRow, PosteriorRow, PredictedRow, QualityRow, RootRow, ScaleRow,
    SelfCheckRow, StartRow, TrendRow, VerdictRow,
};
use crate::aero::DerivativeUnit;
use crate::error::Problem;
use crate::maneuver::{Maneuver, UnclassifiedExcitation};
use crate::schema::{Cells, Column, Entry, Row, Table, Words, one_line};

const HEAD: &str = "\
<!-- Made from the declarations of the tables by `make docs`: edit those. -->

# Tables

A run writes each table twice into its folder of reports (`reports/harv/` for the pipeline `harv`):
`<table>.parquet` and `<table>.csv`, with the same rows in the same order, flights by name, maneuvers by
time. A value that does not exist is a null in Parquet and an empty field in CSV; there are no NaNs.
Times are seconds on the record's own clock.

A column's unit is in the table below (`1` for a plain number), or row by row in the column `unit`. Each Parquet file has its
columns' units and meanings as key-value metadata `harvest.columns` (JSON). What the file was made from
is in `harvest.stage`, `harvest.code`, `harvest.configuration`, `harvest.flights` (fingerprints of the
files' contents) and `harvest.tables`.

Signs: surfaces trailing edge down positive, rudder trailing edge left, roll surfaces rolling right,
pitch vane plume down, yaw vane plume right; CN up, CA aft, CY right; Cm nose up, Cl right wing down, Cn
nose right.

`CN_…` (normal force) and `Cn_…` (yawing moment) differ by case only: do not use the names where case is
lost.
";

const COMBINED: &str = "\
Sums that the tunnel tabulates in one number: a constant plus a slope times α (eqs. 2.14, 2.15).

The columns are those of `estimates`. `value` is the sum at the maneuver's mean α; the bounds come from
the full covariance. A sum has a row where both parts were estimated. Constant and slope alone are
strongly correlated; their sum is well determined.
";

const FIT_OUTPUTS: &str = "\
Agreement of each output with the maneuver's own fit.

Computed outputs are those of the equations, integrated over the
maneuver with the estimates of the fit. With filter error they contain no gusts, except that the angle of
the air follows the vane as closely as the size of the gusts asks for: predictions from one sample to the
next would follow any motion.
";

/// Section of the page: a table with its columns; without any, the meaning names the table that has them.
struct Section {
    name: &'static str,
    per: &'static str,
    meaning: &'static str,
    columns: Vec<Column<'static>>,
}

impl Section {
    fn of<T: Table + 'static>() -> Section {
        Section {
            name: T::NAME,
            per: T::PER,
            meaning: T::MEANING,
            columns: T::columns(&[]),
        }
    }
}

/// The page as Markdown.
#[must_use]
pub fn page() -> String {
    let mut page = String::from(HEAD);
    page.push_str("\nUnits of derivatives and biases in the column `unit`:\n\n");
    words(&mut page, DerivativeUnit::ENTRIES);
    for section in sections() {
        heading(&mut page, &section);
        if !section.columns.is_empty() {
            rows(&mut page, &section.columns);
        }
    }
    page
}

/// Sections in the order of the page.
fn sections() -> Vec<Section> {
    let mut fits = Section::of::<FitRow>();
    fits.columns.extend(PredictedRow::columns(&[]));
    vec![
        Section::of::<Maneuver>(),
        Section::of::<UnclassifiedExcitation>(),
        fits,
        Section::of::<EstimateRow>(),
        Section {
            name: "combined",
            per: "maneuver and tabulated sum",
            meaning: COMBINED,
            columns: Vec::new(),
        },
        Section {
            name: "fit_outputs",
            per: "maneuver and output",
            meaning: FIT_OUTPUTS,
            columns: AgreementRow::columns(&[]),
        },
        Section::of::<AgreementRow>(),
        Section::of::<JointRow>(),
        Section::of::<CorrelationRow>(),
        Section::of::<TrendRow>(),
        Section::of::<OutlierRow>(),
        Section::of::<PosteriorRow>(),
        Section::of::<CovarianceRow>(),
        Section::of::<ScaleRow>(),
        Section::of::<ContributionRow>(),
        Section::of::<SelfCheckRow>(),
        Section::of::<LiftAndDragRow>(),
        Section::of::<QualityRow>(),
        Section::of::<LevelRow>(),
        Section::of::<RootRow>(),
        Section::of::<MatchRow>(),
        Section::of::<MatchVerdictRow>(),
        Section::of::<ComparisonRow>(),
        Section::of::<ManeuverComparisonRow>(),
        Section::of::<VerdictRow>(),
        Section::of::<DisagreementRow>(),
        Section::of::<ChangeRow>(),
        Section::of::<ExtrapolationRow>(),
        Section::of::<ExportRow>(),
        Section::of::<DrawRow>(),
        Section::of::<NextCardRow>(),
        Section::of::<NextGoalRow>(),
        Section::of::<FlightRow>(),
        Section::of::<ChannelRow>(),
        Section::of::<CheckRow>(),
        Section::of::<InstrumentRow>(),
        Section::of::<InstrumentTrendRow>(),
        Section::of::<EventRow>(),
        Section::of::<Problem>(),
        Section::of::<ConditionRow>(),
        Section::of::<CoverageRow>(),
        Section::of::<StartRow>(),
    ]
}

/// Writes the heading of a table with its explanation.
fn heading(page: &mut String, section: &Section) {
    let Section { name, per, .. } = section;
    line(page, &format!("\n## {name}: one row per {per}\n"));
    for text in section.meaning.lines() {
        line(page, text.strip_prefix(' ').unwrap_or(text));
    }
}

/// Writes the table of the columns, and the words of each below it.
fn rows(page: &mut String, columns: &[Column]) {
    line(page, "\n| column | unit | meaning |\n|---|---|---|");
    for column in columns {
        let unit = match (&column.cells, column.unit) {
            (Cells::Text(_), _) => "text",
            (_, "") => "column `unit`",
            (_, unit) => unit,
        };
        line(
            page,
            &format!("| `{}` | {unit} | {} |", column.name, column.explanation()),
        );
    }
    for column in columns.iter().filter(|column| !column.words.is_empty()) {
        line(page, &format!("\n`{}`:\n", column.name));
        words(page, column.words);
    }
}

fn words(page: &mut String, entries: &[Entry]) {
    for Entry { word, meaning } in entries {
        line(page, &format!("- `{word}`: {}", one_line(meaning)));
    }
}

fn line(page: &mut String, text: &str) {
    // Writing into a String cannot fail.
    let _ = writeln!(page, "{text}");
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `make docs` sets the variable, and the test writes the page instead.
    #[test]
    fn the_page_of_the_tables_is_the_one_made_from_their_declarations() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/tables.md");
        if std::env::var_os("HARVEST_WRITE_DOCS").is_some() {
            std::fs::write(path, page()).unwrap();
        }
        let committed = std::fs::read_to_string(path).unwrap_or_default();
        assert!(
            committed == page(),
            "docs/tables.md is not up to date: `make docs`"
        );
    }

    #[test]
    fn every_number_has_a_unit_or_a_column_with_its_unit() {
        let sections = sections();
        assert!(sections.len() > 35, "{} tables", sections.len());
        for Section { name, columns, .. } in &sections {
            let has_units = columns.iter().any(|column| column.name == "unit");
            for column in columns {
                let is_text = matches!(column.cells, Cells::Text(_));
                let column_name = &column.name;
                assert!(
                    is_text || has_units || !column.unit.is_empty(),
                    "{name}: {column_name}"
                );
                assert!(!is_text || column.unit.is_empty(), "{name}: {column_name}");
            }
        }
    }
}
