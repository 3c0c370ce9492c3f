//! The build-up as DAVE-ML (ANSI/AIAA S-119-2011, DAVEfunc 2.0).
//!
//! Each derivative is a gridded function, with a second function that is 1 where the value is
//! flight's. The coefficients are sums of them.

use super::export_contents::{COEFFICIENTS, ExportContents, terms};
use super::export_table::{ExportTable, GridCell};
use super::xml::{Xml, escaped};
use crate::aero::{Coefficient, Derivative, Regressor};
use crate::flight::signal;
use crate::model::CorrelatedDerivatives;
use crate::units::Unit;

const DECLARATION: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"no\"?>\n\
    <!DOCTYPE DAVEfunc PUBLIC \"-//AIAA//DTD for Flight Dynamic Models - Functions 2.0//EN\" \
    \"http://daveml.org/DTDs/2p0/DAVEfunc.dtd\">";

/// Rates over twice the speed: identifier, description.
const RATES: [(Regressor, &str, &str); 4] = [
    (
        Regressor::RollRate,
        "pb_2V",
        "roll rate p b/2V, positive right wing down",
    ),
    (
        Regressor::PitchRate,
        "qc_2V",
        "pitch rate q c/2V, positive nose up",
    ),
    (
        Regressor::YawRate,
        "rb_2V",
        "yaw rate r b/2V, positive nose right",
    ),
    (
        Regressor::AlphaRate,
        "alphadot_c_2V",
        "rate of the angle of attack times c/2V",
    ),
];

/// The whole document.
#[must_use]
pub fn document(contents: &ExportContents, tables: &[ExportTable]) -> String {
    let mut xml = Xml::new(DECLARATION);
    xml.open("DAVEfunc", &[("xmlns", "http://daveml.org/2010/DAVEML")]);
    header(contents, &mut xml);
    inputs(contents, tables, &mut xml);
    for table in tables {
        let name = table.derivative.as_str();
        variable(
            &mut xml,
            name,
            name,
            &unit(&table.unit),
            &table.sources(),
            VariableRole::Output,
        );
        let words =
            format!("1 where flight gave half or more of the information on {name}, else 0");
        variable(
            &mut xml,
            name,
            &flag(name),
            "nd",
            &words,
            VariableRole::Output,
        );
    }
    for coefficient in COEFFICIENTS {
        coefficients(contents, tables, coefficient, &mut xml);
    }
    for (id, points, units) in breakpoints(contents, tables) {
        xml.open("breakpointDef", &[("bpID", &id), ("units", units)]);
        xml.text("bpVals", &[], &numbers(points));
        xml.close();
    }
    for table in tables {
        gridded(contents, table, &mut xml);
    }
    for table in tables {
        function(
            contents,
            table,
            &table.derivative,
            &format!("{}_table", table.derivative),
            &mut xml,
        );
        let flag = flag(&table.derivative);
        function(contents, table, &flag, &format!("{flag}_table"), &mut xml);
    }
    xml.close();
    xml.finish()
}

fn header(contents: &ExportContents, xml: &mut Xml) {
    let (settings, a) = (contents.settings, contents.aircraft);
    xml.open("fileHeader", &[("name", contents.title)]);
    xml.empty(
        "author",
        &[("name", &settings.author), ("org", &settings.organisation)],
    );
    xml.empty("creationDate", &[("date", &settings.date)]);
    let text = format!(
        "{}: flight-updated derivatives: posterior of flight tests and wind tunnel; the description of each \
         table names the larger source of information; the function <name>_is_flight gives it at every point. Uncertainties are standard deviations; correlations \
         between derivatives are means over the breakpoints. Body axes: CN up, CA aft, CY right, moments \
         right wing down, nose up, nose right, about the c.g. Reference area {} ft2, span {} ft, chord {} ft. Thrust \
         vectoring is in lbf and ft lbf and in no coefficient. Tables are linear between their points and constant beyond.",
        contents.title, a.wing_area_ft2, a.span_ft, a.chord_ft
    );
    xml.text("description", &[], &text);
    xml.close();
}

/// Role of a variable.
#[derive(Clone, Copy, PartialEq, Eq)]
enum VariableRole {
    Input,
    Output,
}

fn variable(xml: &mut Xml, name: &str, id: &str, units: &str, words: &str, role: VariableRole) {
    xml.open(
        "variableDef",
        &[("name", name), ("varID", id), ("units", units)],
    );
    xml.text("description", &[], words);
    xml.empty(
        if role == VariableRole::Input {
            "isInput"
        } else {
            "isOutput"
        },
        &[],
    );
    xml.close();
}

fn inputs(contents: &ExportContents, tables: &[ExportTable], xml: &mut Xml) {
    variable(
        xml,
        "angleOfAttack",
        "alpha",
        "deg",
        "angle of attack, positive nose up",
        VariableRole::Input,
    );
    variable(
        xml,
        "angleOfSideslip",
        "beta",
        "deg",
        "sideslip, positive wind from the right",
        VariableRole::Input,
    );
    if tables.iter().any(|t| !t.machs.is_empty()) {
        variable(
            xml,
            "machNumber",
            "mach",
            "nd",
            "Mach number",
            VariableRole::Input,
        );
    }
    if let Some(third) = third(contents, tables) {
        variable(
            xml,
            third,
            third,
            "nd",
            "the tables' third variable, in the unit of its name",
            VariableRole::Input,
        );
    }
    let has_alpha_rate = contents.aero_model.along_alpha_rate().next().is_some();
    let is_used = |rate: &Regressor| *rate != Regressor::AlphaRate || has_alpha_rate;
    for (_, id, words) in RATES.iter().filter(|(rate, ..)| is_used(rate)) {
        variable(xml, id, id, "rad", words, VariableRole::Input);
    }
    let mut surfaces: Vec<&str> = contents
        .aero_model
        .derivatives
        .iter()
        .flat_map(|d| d.regressor.signals())
        .collect();
    surfaces.sort_unstable();
    surfaces.dedup();
    // Signals that tables depend on are already inputs.
    let is_input = |signal: &&str| {
        let has_machs = *signal == signal::MACH && tables.iter().any(|t| !t.machs.is_empty());
        has_machs || Some(*signal) == third(contents, tables)
    };
    for signal in surfaces.into_iter().filter(|s| !is_input(s)) {
        variable(
            xml,
            signal,
            signal,
            Unit::of_signal(signal).name,
            "surface, vane or other signal, in the unit of its name",
            VariableRole::Input,
        );
    }
}

fn third<'a>(contents: &'a ExportContents, tables: &[ExportTable]) -> Option<&'a str> {
    let depends = tables.iter().any(|t| !t.thirds.is_empty());
    contents
        .tunnel
        .settings()
        .third
        .as_ref()
        .filter(|_| depends)
        .map(|third| third.name.as_str())
}

/// Writes a coefficient without vanes as the sum of its terms, and the load of its vanes, if any.
fn coefficients(
    contents: &ExportContents,
    tables: &[ExportTable],
    coefficient: Coefficient,
    xml: &mut Xml,
) {
    let name = format!("{coefficient:?}");
    let load = if coefficient.is_moment() {
        "ft*lbf"
    } else {
        "lbf"
    };
    for (vanes, id, units) in [
        (false, name.clone(), "nd"),
        (true, format!("{name}_vanes"), load),
    ] {
        let terms: Vec<&Derivative> = terms(contents, tables, coefficient, vanes).collect();
        if terms.is_empty() {
            continue;
        }
        xml.open(
            "variableDef",
            &[("name", &id), ("varID", &id), ("units", units)],
        );
        xml.open("calculation", &[]);
        xml.open("math", &[("xmlns", "http://www.w3.org/1998/Math/MathML")]);
        xml.open("apply", &[]);
        xml.empty("plus", &[]);
        for derivative in terms {
            term(derivative, xml);
        }
        for _ in 0..3 {
            xml.close();
        }
        xml.empty("isOutput", &[]);
        xml.close();
    }
}

fn term(derivative: &Derivative, xml: &mut Xml) {
    if derivative.regressor == Regressor::Constant {
        return xml.text("ci", &[], &derivative.name);
    }
    xml.open("apply", &[]);
    xml.empty("times", &[]);
    xml.text("ci", &[], &derivative.name);
    factors(&derivative.regressor, xml);
    xml.close();
}

fn factors(regressor: &Regressor, xml: &mut Xml) {
    let name = match regressor {
        Regressor::Magnitude(of) => {
            xml.open("apply", &[]);
            xml.empty("abs", &[]);
            factors(of, xml);
            return xml.close();
        }
        Regressor::Product(both) => return both.iter().for_each(|r| factors(r, xml)),
        Regressor::Constant => return,
        Regressor::Alpha => "alpha",
        Regressor::Beta => "beta",
        Regressor::Surface(signal) | Regressor::Vane(signal) => signal,
        rate => RATES
            .iter()
            .find(|(r, ..)| r == rate)
            .map_or("", |(_, id, _)| id),
    };
    xml.text("ci", &[], name);
}

/// Writes the breakpoints of every variable of a table.
fn breakpoints<'a>(
    contents: &ExportContents,
    tables: &'a [ExportTable],
) -> Vec<(String, &'a [f64], &'static str)> {
    let third = third(contents, tables).is_some();
    let of = |table: &'a ExportTable| {
        let id = |variable: &str| format!("{}_{variable}", table.derivative);
        let mut all = vec![
            (id("alpha"), table.alphas_deg.as_slice(), "deg"),
            (id("mach"), &table.machs, "nd"),
        ];
        if third {
            all.push((id("third"), &table.thirds, "nd"));
        }
        all.into_iter().filter(|(_, points, _)| !points.is_empty())
    };
    tables.iter().flat_map(of).collect()
}

/// Variables that a table depends on, slowest first: name of the breakpoints, identifier of the
/// variable.
fn variables<'a>(table: &ExportTable, third: Option<&'a str>) -> Vec<(&'static str, &'a str)> {
    let mut variables = Vec::new();
    if !table.thirds.is_empty() {
        variables.push(("third", third.unwrap_or_default()));
    }
    if !table.machs.is_empty() {
        variables.push(("mach", "mach"));
    }
    variables.push(("alpha", "alpha"));
    variables
}

/// Writes a table's correlations. Each pair has its coefficient at the later table; the earlier
/// table refers to it.
fn correlations(contents: &ExportContents, table: &ExportTable, xml: &mut Xml) {
    let own = |pair: &&CorrelatedDerivatives| pair.first == table.derivative;
    for pair in contents.correlations.iter().filter(own) {
        xml.empty("correlatesWith", &[("varID", &pair.second)]);
    }
    let named = |pair: &&CorrelatedDerivatives| pair.second == table.derivative;
    for pair in contents.correlations.iter().filter(named) {
        let coefficient = pair.correlation.to_string();
        let attributes = [("varID", pair.first.as_str()), ("corrCoef", &coefficient)];
        xml.empty("correlation", &attributes);
    }
}

/// Gridded tables of a derivative: its values with their uncertainties, and its flag for flight.
fn gridded(contents: &ExportContents, table: &ExportTable, xml: &mut Xml) {
    values_table(contents, table, xml);
    flag_table(table, xml);
}

/// Values of the cells of a table as lines, one per row of its grid.
fn data_lines(table: &ExportTable, value: impl Fn(&GridCell) -> f64) -> Vec<String> {
    let values: Vec<f64> = table.cells.iter().map(value).collect();
    let rows = values.chunks(table.alphas_deg.len().max(1));
    let mut lines: Vec<String> = rows.map(|row| format!("{},", numbers(row))).collect();
    if let Some(last) = lines.last_mut() {
        last.pop();
    }
    lines
}

/// References of a gridded table to its breakpoints.
fn breakpoint_references(table: &ExportTable, xml: &mut Xml) {
    xml.open("breakpointRefs", &[]);
    for (variable, _) in variables(table, None) {
        let id = format!("{}_{variable}", table.derivative);
        xml.empty("bpRef", &[("bpID", &id)]);
    }
    xml.close();
}

/// Gridded table of a derivative's values, with uncertainties if every cell has one.
fn values_table(contents: &ExportContents, table: &ExportTable, xml: &mut Xml) {
    let id = format!("{}_table", table.derivative);
    xml.open(
        "griddedTableDef",
        &[
            ("name", &table.derivative),
            ("gtID", &id),
            ("units", &unit(&table.unit)),
        ],
    );
    xml.text("description", &[], &table.sources());
    breakpoint_references(table, xml);
    if table.cells.iter().all(|c| c.uncertainty.is_some()) {
        xml.open("uncertainty", &[("effect", "additive")]);
        xml.open("normalPDF", &[("numSigmas", "1")]);
        xml.open("bounds", &[]);
        let uncertainties = data_lines(table, |c| c.uncertainty.unwrap_or_default());
        xml.block("dataTable", &[], &uncertainties);
        xml.close();
        correlations(contents, table, xml);
        for _ in 0..2 {
            xml.close();
        }
    }
    xml.block("dataTable", &[], &data_lines(table, |c| c.value));
    xml.close();
}

/// Gridded table of the flag: 1 in cells that flight mostly determines, else 0.
fn flag_table(table: &ExportTable, xml: &mut Xml) {
    let flag = flag(&table.derivative);
    xml.open(
        "griddedTableDef",
        &[
            ("name", &flag),
            ("gtID", &format!("{flag}_table")),
            ("units", "nd"),
        ],
    );
    breakpoint_references(table, xml);
    let flags = data_lines(table, |c| f64::from(u8::from(c.is_flight)));
    xml.block("dataTable", &[], &flags);
    xml.close();
}

fn function(
    contents: &ExportContents,
    table: &ExportTable,
    variable: &str,
    gridded: &str,
    xml: &mut Xml,
) {
    xml.open("function", &[("name", variable)]);
    for (_, id) in variables(table, third(contents, std::slice::from_ref(table))) {
        xml.empty(
            "independentVarRef",
            &[
                ("varID", id),
                ("extrapolate", "neither"),
                ("interpolate", "linear"),
            ],
        );
    }
    xml.empty("dependentVarRef", &[("varID", variable)]);
    xml.open("functionDefn", &[]);
    xml.empty("griddedTableRef", &[("gtID", gridded)]);
    xml.close();
    xml.close();
}

fn flag(derivative: &str) -> String {
    format!("{derivative}_is_flight")
}

fn numbers(values: &[f64]) -> String {
    values
        .iter()
        .map(f64::to_string)
        .collect::<Vec<_>>()
        .join(", ")
}

/// Unit in the spelling of the standard.
fn unit(unit: &str) -> String {
    match unit {
        "-" => "nd".to_owned(),
        other => match other.strip_prefix("per_") {
            Some(per) => format!("1/{per}"),
            None => escaped(&other.replace("_per_", "/")),
        },
    }
}
