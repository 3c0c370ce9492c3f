//! The published tables: rows to a data frame, to Parquet and CSV.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use parquet::file::reader::{FileReader, SerializedFileReader};
use polars::prelude::{
    Column, CsvWriter, DataFrame, KeyValueMetadata, NamedFrom, ParquetCompression, ParquetWriter,
    SerWriter, Series,
};

use super::atomic;
use crate::aero::{Axis, Output};
use crate::error::{Error, Problem, Result};
use crate::maneuver::{Maneuver, Unknown};
use crate::schema::Words;
use crate::tables::{
    BeyondRow, ChangeRow, ChannelRow, CheckRow, ComparisonRow, CorrelationRow, CoverageRow,
    DisagreementRow, EstimateRow, EventRow, ExportRow, FitRow, InstrumentRow, JointRow,
    ManeuverComparisonRow, OutlierRow, PredictedRow, PredictionRow, StartRow, TrendRow, VerdictRow,
};

/// Where tables are published, and what their Parquet files say about where they come from.
#[derive(Clone, Debug, Default)]
pub struct Shelf {
    /// None: what is published there goes nowhere.
    folder: Option<PathBuf>,
    provenance: Vec<(String, String)>,
}

impl Shelf {
    /// A folder for tables that say nothing about where they come from.
    #[must_use]
    pub fn of(folder: &Path) -> Shelf {
        Shelf {
            folder: Some(folder.to_owned()),
            provenance: Vec::new(),
        }
    }

    /// The same with pairs for the key-value metadata of each Parquet file; the CSV beside it stays
    /// as it is.
    #[must_use]
    pub fn with(mut self, provenance: Vec<(String, String)>) -> Shelf {
        self.provenance = provenance;
        self
    }
}

/// The key-value metadata of a published Parquet file.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file.
pub fn provenance(path: &Path) -> Result<BTreeMap<String, String>> {
    let file = std::fs::File::open(path).map_err(Error::io(path, "cannot open the table"))?;
    let reader = SerializedFileReader::new(file).map_err(|e| Error::store(path, &e))?;
    let pairs = reader
        .metadata()
        .file_metadata()
        .key_value_metadata()
        .cloned()
        .unwrap_or_default();
    Ok(pairs
        .into_iter()
        .filter_map(|pair| Some((pair.key, pair.value?)))
        .collect())
}

/// A row type with the name of its table and its columns.
pub trait Table: Sized {
    const NAME: &'static str;
    fn columns(rows: &[Self]) -> Vec<Column>;
}

/// A type of cell: how a column of it is made.
trait Cell: Sized {
    fn column<'a>(name: &str, cells: impl Iterator<Item = &'a Self>) -> Column
    where
        Self: 'a;
}

fn column<T: ?Sized, V: AsRef<T>>(name: &str, values: V) -> Column
where
    Series: NamedFrom<V, T>,
{
    Series::new(name.into(), values).into()
}

/// Empty is absent: a CSV cannot tell the two apart.
impl Cell for String {
    fn column<'a>(name: &str, cells: impl Iterator<Item = &'a Self>) -> Column {
        let text = cells.map(|text| (!text.is_empty()).then_some(text.as_str()));
        column::<[Option<&str>], _>(name, text.collect::<Vec<_>>())
    }
}

impl Cell for Option<String> {
    fn column<'a>(name: &str, cells: impl Iterator<Item = &'a Self>) -> Column {
        column::<[Option<&str>], _>(name, cells.map(Option::as_deref).collect::<Vec<_>>())
    }
}

impl Cell for f64 {
    fn column<'a>(name: &str, cells: impl Iterator<Item = &'a Self>) -> Column {
        column::<[Option<f64>], _>(
            name,
            cells
                .map(|v| v.is_finite().then_some(*v))
                .collect::<Vec<_>>(),
        )
    }
}

impl Cell for Option<f64> {
    fn column<'a>(name: &str, cells: impl Iterator<Item = &'a Self>) -> Column {
        column::<[Option<f64>], _>(
            name,
            cells
                .map(|v| v.filter(|v| v.is_finite()))
                .collect::<Vec<_>>(),
        )
    }
}

impl Cell for usize {
    fn column<'a>(name: &str, cells: impl Iterator<Item = &'a Self>) -> Column {
        column::<[i64], _>(
            name,
            cells
                .map(|v| i64::try_from(*v).unwrap_or(i64::MAX))
                .collect::<Vec<_>>(),
        )
    }
}

impl Cell for Option<usize> {
    fn column<'a>(name: &str, cells: impl Iterator<Item = &'a Self>) -> Column {
        let whole = |v: &Self| v.map(|v| i64::try_from(v).unwrap_or(i64::MAX));
        column::<[Option<i64>], _>(name, cells.map(whole).collect::<Vec<_>>())
    }
}

impl<W: Words> Cell for W {
    fn column<'a>(name: &str, cells: impl Iterator<Item = &'a Self>) -> Column
    where
        Self: 'a,
    {
        column::<[Option<&str>], _>(
            name,
            cells.map(|cell| Some(cell.word())).collect::<Vec<_>>(),
        )
    }
}

impl<W: Words> Cell for Option<W> {
    fn column<'a>(name: &str, cells: impl Iterator<Item = &'a Self>) -> Column
    where
        Self: 'a,
    {
        let words = cells.map(|cell| cell.as_ref().map(Words::word));
        column::<[Option<&str>], _>(name, words.collect::<Vec<_>>())
    }
}

/// Says which fields of a row type are the columns of which table.
macro_rules! table {
    ($row:ty, $name:literal, $($field:ident)*) => {
        impl Table for $row {
            const NAME: &'static str = $name;
            fn columns(rows: &[Self]) -> Vec<Column> {
                vec![$(Cell::column(stringify!($field), rows.iter().map(|row| &row.$field))),*]
            }
        }
    };
}

table!(Unknown, "unknown", flight_id start_s end_s inputs nearest_class reason);
table!(FitRow, "fits", maneuver_id class outcome reason start iterations initial_cost final_cost condition_number left_out
    largest_condition_index confounded);
table!(EstimateRow, "estimates", maneuver_id flight_id class alpha_deg mach derivative unit status value bound
    bound_held bound_calibration bound_corrected wind_tunnel variance_inflation excitation contribution_pct equation_error
    held_because);
table!(CorrelationRow, "correlations", maneuver_id class kind first second correlation);
table!(TrendRow, "trends", derivative unit group alpha_deg value standard_error lower_95 upper_95 prediction_lower_95
    prediction_upper_95 maneuvers outliers curve order scatter);
table!(OutlierRow, "outliers", derivative unit group maneuver_id class alpha_deg value bound trend z weight_share);
table!(ComparisonRow, "comparison", derivative unit group alpha_deg mach flight standard_error wind_tunnel difference
    uncertainty difference_pct z verdict);
table!(ManeuverComparisonRow, "maneuver_comparison", maneuver_id class derivative unit alpha_deg mach flight bound
    wind_tunnel difference uncertainty difference_pct z verdict);
table!(VerdictRow, "verdicts", against derivative unit group alpha_from_deg alpha_to_deg verdict difference_pct words);
table!(DisagreementRow, "disagreements", rank against derivative unit alpha_deg flight other difference z size_pct words);
table!(ChangeRow, "changes", against derivative unit group alpha_deg flight standard_error before before_standard_error
    difference difference_pct z verdict);
table!(BeyondRow, "beyond_tunnel", maneuver_id alpha_deg mach variable read_at tabulated_from tabulated_to treatment
    derivatives);
table!(ChannelRow, "channels", flight_id channel signal samples rate_hz between bridged despiked missing
    stuck wraps quantisation noise verdict);
table!(CheckRow, "checks", flight_id relation signals slope correlation verdict);
table!(InstrumentRow, "instruments", flight_id channel signal unit bias bias_bound scale scale_bound delay_s delay_bound_s
    applied verdict);
table!(EventRow, "events", flight_id given_class given_start_s given_end_s found_class found_start_s found_end_s verdict);
table!(CoverageRow, "coverage", class alpha_deg residuals weights derivative unit truth realisations converged bias scatter
    bias_over_scatter scatter_over_bound coverage_68 coverage_95 scatter_over_corrected corrected_coverage_68
    corrected_coverage_95);
table!(StartRow, "starts", class alpha_deg start records alone reached);
table!(Problem, "problems", stage flight_id place reason);

/// What it was recognised by and what it is worth follow the maneuver's own columns.
impl Table for Maneuver {
    const NAME: &'static str = "maneuvers";
    fn columns(rows: &[Self]) -> Vec<Column> {
        macro_rules! columns {
            ($($($part:ident).+)*) => { vec![$(Cell::column(last!($($part)+), rows.iter().map(|row| &row.$($part).+))),*] };
        }
        macro_rules! last {
            ($name:ident) => { stringify!($name) };
            ($first:ident $($rest:ident)+) => { last!($($rest)+) };
        }
        columns!(maneuver_id flight_id class axis start_s end_s alpha_deg mach qbar_psf velocity_ft_s altitude_ft mass_slug
            x_cg_ft samples origin recognised.confidence recognised.first_input_s recognised.last_input_s
            recognised.inputs recognised.followed recognised.evidence quality.verdict quality.reason
            quality.lead_in_motion quality.alpha_rms_deg quality.other_axis quality.signal_to_noise
            quality.saturated_share quality.rate_limited_share quality.marked_share)
    }
}

table!(PredictionRow, "predictions", maneuver_id class alpha_deg output unit samples root_mean_square theil theil_bias
    theil_variance theil_covariance r_squared);
table!(JointRow, "joint", joint_id class joint_alpha_deg joint_mach maneuvers maneuver_id flight_id alpha_deg mach part
    cost_alone cost_joint);

/// Further columns of `fits`; the outputs of both axes have theirs.
impl PredictedRow {
    fn columns(rows: &[&Self]) -> Vec<Column> {
        macro_rules! columns {
            ($($field:ident)*) => { vec![$(Cell::column(stringify!($field), rows.iter().map(|row| &row.$field))),*] };
        }
        let mut columns = columns!(prediction predicted_from predicted_cost theil theil_bias theil_variance
            theil_covariance);
        let outputs = || {
            [Axis::Longitudinal, Axis::Lateral]
                .into_iter()
                .flat_map(Axis::outputs)
        };
        let mut of = |prefix: &str, values: fn(&Self) -> &BTreeMap<Output, f64>| {
            for output in outputs() {
                let cells: Vec<Option<f64>> = rows
                    .iter()
                    .map(|row| values(row).get(&output).copied())
                    .collect();
                columns.push(Cell::column(
                    &format!("{prefix}_{}", output.name()),
                    cells.iter(),
                ));
            }
        };
        of("theil", |row| &row.theil_of);
        of("r_squared", |row| &row.r_squared_of);
        columns
    }
}

/// Publishes `fits`: each fit beside the prediction of the same maneuver, those without one at the
/// end.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file.
pub fn publish_fits(shelf: &Shelf, fits: &[FitRow], predicted: &[PredictedRow]) -> Result<()> {
    let none = PredictedRow::default();
    let beside: Vec<&PredictedRow> = (0..fits.len())
        .map(|i| predicted.get(i).unwrap_or(&none))
        .collect();
    let mut columns = FitRow::columns(fits);
    columns.extend(PredictedRow::columns(&beside));
    place(shelf, FitRow::NAME, fits.len(), columns)
}

/// Publishes the export's rows; the third variable, where the tables have one, is a column of its
/// name.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file.
pub fn publish_export(shelf: &Shelf, rows: &[ExportRow], third: Option<&str>) -> Result<()> {
    macro_rules! columns {
        ($($field:ident)*) => { vec![$(Cell::column(stringify!($field), rows.iter().map(|row| &row.$field))),*] };
    }
    let mut columns = columns!(derivative alpha_deg mach);
    columns.extend(third.map(|name| Cell::column(name, rows.iter().map(|row| &row.third))));
    columns.extend(columns!(value unit uncertainty source is_flight));
    place(shelf, "flight_updated", rows.len(), columns)
}

/// Publishes rows as `<name>.parquet` and `<name>.csv` on a shelf, each placed whole.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file.
pub fn publish<T: Table>(shelf: &Shelf, rows: &[T]) -> Result<()> {
    publish_as(shelf, T::NAME, rows)
}

/// Publishes rows as [`publish`] does, under another name than their type's: a second table of the
/// same columns.
///
/// # Errors
/// [`Error::Io`] or [`Error::Store`] naming the file.
pub fn publish_as<T: Table>(shelf: &Shelf, name: &str, rows: &[T]) -> Result<()> {
    place(shelf, name, rows.len(), T::columns(rows))
}

fn place(shelf: &Shelf, name: &str, rows: usize, columns: Vec<Column>) -> Result<()> {
    let Some(folder) = &shelf.folder else {
        return Ok(());
    };
    let (parquet, csv) = (
        folder.join(format!("{name}.parquet")),
        folder.join(format!("{name}.csv")),
    );
    let mut frame = DataFrame::new(rows, columns).map_err(|e| Error::store(&parquet, &e))?;
    let mut bytes = Vec::new();
    let metadata = (!shelf.provenance.is_empty())
        .then(|| KeyValueMetadata::from_static(shelf.provenance.clone()));
    ParquetWriter::new(&mut bytes)
        .with_compression(ParquetCompression::Zstd(None))
        .with_key_value_metadata(metadata)
        .finish(&mut frame)
        .map_err(|e| Error::store(&parquet, &e))?;
    atomic::place(&parquet, &bytes)?;
    bytes.clear();
    CsvWriter::new(&mut bytes)
        .finish(&mut frame)
        .map_err(|e| Error::store(&csv, &e))?;
    atomic::place(&csv, &bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::CheckVerdict;

    #[test]
    fn a_table_without_rows_has_its_columns() {
        let folder = tempfile::tempdir().unwrap();
        publish::<FitRow>(&Shelf::of(folder.path()), &[]).unwrap();
        let csv = std::fs::read_to_string(folder.path().join("fits.csv")).unwrap();
        assert!(
            csv.starts_with(
                "maneuver_id,class,outcome,reason,start,iterations,initial_cost,final_cost,condition_number"
            )
        );
    }

    #[test]
    fn what_does_not_exist_is_an_empty_field() {
        let folder = tempfile::tempdir().unwrap();
        let row = CheckRow {
            flight_id: "f1".into(),
            relation: "theta rate, against q".into(),
            signals: "theta_deg q_deg_s".into(),
            slope: None,
            correlation: Some(f64::NAN),
            verdict: CheckVerdict::NotExcited,
        };
        publish(&Shelf::of(folder.path()), &[row]).unwrap();
        let csv = std::fs::read_to_string(folder.path().join("checks.csv")).unwrap();
        assert_eq!(
            csv.lines().nth(1),
            Some("f1,\"theta rate, against q\",theta_deg q_deg_s,,,not excited")
        );
    }
}
