//! Tables of the wind tunnel: rows as written become tables in the units of the model, or name the line of the
//! first mistake.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::aero::{AeroModel, Derivative, DerivativeUnit, WindTunnel, wind_tunnel};
use crate::error::{Error, Result, similarity};
use crate::store;
use crate::store::files::TunnelRow;

/// Similarity, from 0 to 1, from which an unknown name counts as a misspelt name of the model. In a
/// name of five letters one added letter, or two exchanged ones, reach it.
pub(super) const MISSPELT: f64 = 0.93;

/// Reads the tunnel's tables, in the units of the model's derivatives.
pub(super) fn read(
    path: &Path,
    aero_model: &AeroModel,
    settings: &wind_tunnel::Settings,
) -> Result<WindTunnel> {
    let error = |line: Option<usize>, what: String| Error::config(path, line, what);
    let mut tunnel = WindTunnel::new(settings.clone());
    let mut read = RowsRead::default();
    let derivatives = aero_model.derivatives.iter();
    let derivatives: BTreeMap<String, &Derivative> = derivatives
        .map(|d| (wind_tunnel::key(&d.name), d))
        .collect();
    for (line, mut row) in tunnel_rows(path, aero_model, settings)? {
        check(&row)
            .and_then(|()| convert(&mut row, &derivatives))
            .and_then(|()| read.add(line, &row))
            .map_err(|what| error(Some(line), what))?;
        tunnel.insert_at(&row.derivative, row.third, row.point());
    }
    if let Some((line, what)) = read.misspelt(aero_model) {
        return Err(error(Some(line), what));
    }
    if let Some(third) = settings.third.as_ref().filter(|_| !read.has_third) {
        let what = format!(
            "no table depends on `{}`, which pipeline.yaml names (tunnel: third:)",
            third.name
        );
        return Err(error(None, what));
    }
    Ok(tunnel)
}

/// Reads the tables of a file; without a file there are none.
pub(super) fn read_optional(
    path: Option<&Path>,
    aero_model: &AeroModel,
    settings: &wind_tunnel::Settings,
) -> Result<WindTunnel> {
    path.map_or_else(
        || Ok(WindTunnel::new(settings.clone())),
        |path| read(path, aero_model, settings),
    )
}

/// Rows of the tunnel's tables as written; of a DAVE-ML file those of the model's derivatives and
/// sums.
pub(crate) fn tunnel_rows(
    path: &Path,
    aero_model: &AeroModel,
    settings: &wind_tunnel::Settings,
) -> Result<Vec<(usize, TunnelRow)>> {
    let derivatives = aero_model.derivatives.iter().map(|d| &d.name);
    let names: Vec<String> = derivatives
        .chain(aero_model.combined.iter().map(|c| &c.name))
        .map(|name| wind_tunnel::key(name))
        .collect();
    let third = settings.third.as_ref().map(|third| third.name.as_str());
    store::tunnel::rows(path, third, |variable| {
        names.contains(&wind_tunnel::key(variable))
    })
}

/// Longest name of a derivative, bytes.
const LONGEST_NAME: usize = 200;

/// Refuses a row whose name is too long, or whose numbers are not finite or are out of range.
fn check(row: &TunnelRow) -> std::result::Result<(), String> {
    let name = &row.derivative;
    if name.len() > LONGEST_NAME {
        let length = name.len();
        return Err(format!("the name of a derivative has {length} characters"));
    }
    let numbers = [
        Some(row.alpha_deg),
        Some(row.value),
        row.mach,
        row.uncertainty,
        row.third,
    ];
    if numbers.iter().flatten().any(|v| !v.is_finite()) {
        return Err(format!("`{name}` has a value that is no number"));
    }
    if row.alpha_deg.abs() > 180.0 {
        let alpha_deg = row.alpha_deg;
        return Err(format!(
            "`{name}` has the angle of attack {alpha_deg} deg; it lies between -180 and 180"
        ));
    }
    match row.uncertainty.filter(|u| *u < 0.0) {
        None => Ok(()),
        Some(uncertainty) => Err(format!(
            "`{name}` has the uncertainty {uncertainty}; none is negative"
        )),
    }
}

/// Converts value and uncertainty of a row into the unit of the model's derivative. A row of a sum, or of a
/// derivative that the model lacks, stays as written.
fn convert(
    row: &mut TunnelRow,
    derivatives: &BTreeMap<String, &Derivative>,
) -> std::result::Result<(), String> {
    let Some(derivative) = derivatives.get(&wind_tunnel::key(&row.derivative)) else {
        return Ok(());
    };
    let factor = derivative
        .unit()
        .factor_from(&row.unit)
        .ok_or_else(|| wrong_unit(row, derivative))?;
    row.value *= factor;
    row.uncertainty = row.uncertainty.map(|u| u * factor);
    Ok(())
}

/// Message for a unit that cannot become the derivative's.
fn wrong_unit(row: &TunnelRow, derivative: &Derivative) -> String {
    let unit = derivative.unit();
    let of_vane = [DerivativeUnit::LbfPerDeg, DerivativeUnit::FtLbfPerDeg];
    let is_of_vane = of_vane.iter().any(|u| u.factor_from(&row.unit).is_some());
    let hint = if unit == DerivativeUnit::PerDeg && is_of_vane {
        "; a thrust-vectoring vane has `vane: true` in model.yaml"
    } else {
        ""
    };
    let (name, written, unit) = (&row.derivative, &row.unit, unit.name());
    format!("`{name}` is in `{written}`, which cannot become the model's `{unit}`{hint}")
}

/// A point of a table: name of the derivative, and bits of angle of attack, Mach number and third variable.
type PointKey = (String, [Option<u64>; 3]);

/// Variables besides the angle of attack that a row gives.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Variables {
    mach: bool,
    third: bool,
}

/// First line of a derivative, and its name as written there.
struct FirstLine {
    line: usize,
    written: String,
}

/// Most derivatives of a tunnel's tables; a model has some hundred.
const MOST_NAMES: usize = 10_000;

/// Rows of the tunnel read so far. Each point stands once, and all rows of a derivative have the same
/// variables.
#[derive(Default)]
struct RowsRead {
    points: BTreeSet<PointKey>,
    variables: BTreeMap<String, Variables>,
    has_third: bool,
    first_lines: BTreeMap<String, FirstLine>,
}

impl RowsRead {
    fn add(&mut self, line: usize, row: &TunnelRow) -> std::result::Result<(), String> {
        let name = wind_tunnel::key(&row.derivative);
        self.first_lines
            .entry(name.clone())
            .or_insert_with(|| FirstLine {
                line,
                written: row.derivative.clone(),
            });
        if self.first_lines.len() > MOST_NAMES {
            return Err(format!(
                "these are more than {MOST_NAMES} derivatives: a row is one derivative at one angle of attack"
            ));
        }
        let given = Variables {
            mach: row.mach.is_some(),
            third: row.third.is_some(),
        };
        self.has_third |= given.third;
        if *self.variables.entry(name.clone()).or_insert(given) != given {
            let what = "has Mach number or third variable in some rows and not in others: give it in all or in none";
            return Err(format!("`{}` {what}", row.derivative));
        }
        // Adding zero makes one of the two zeros.
        let bits = |v: f64| (v + 0.0).to_bits();
        let point = [
            Some(bits(row.alpha_deg)),
            row.mach.map(bits),
            row.third.map(bits),
        ];
        if self.points.insert((name, point)) {
            return Ok(());
        }
        let mach = row.mach.map_or_else(String::new, |m| format!(", Mach {m}"));
        Err(format!(
            "`{}` has a second value at alpha {} deg{mach}; a table over a third variable needs its name in \
             pipeline.yaml (tunnel: third:)",
            row.derivative, row.alpha_deg
        ))
    }

    /// Line and message for the first name that the model lacks, if it resembles a name of the
    /// model that has no rows.
    fn misspelt(&self, aero_model: &AeroModel) -> Option<(usize, String)> {
        let derivatives = aero_model.derivatives.iter().map(|d| &d.name);
        let names = derivatives.chain(aero_model.combined.iter().map(|c| &c.name));
        let (found, lacking): (Vec<&String>, Vec<&String>) =
            names.partition(|name| self.first_lines.contains_key(&wind_tunnel::key(name)));
        let found: BTreeSet<String> = found
            .into_iter()
            .map(|name| wind_tunnel::key(name))
            .collect();
        let unknown = self
            .first_lines
            .iter()
            .filter(|(name, _)| !found.contains(*name));
        unknown
            .filter_map(|(_, FirstLine { line, written })| {
                let near = lacking
                    .iter()
                    .find(|name| similarity(written, name) >= MISSPELT)?;
                let what = format!(
                    "the model has no derivative `{written}`; did you mean `{near}`, which has no rows?"
                );
                Some((*line, what))
            })
            .min()
    }
}
