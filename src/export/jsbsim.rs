//! The build-up as a JSBSim aerodynamics section.
//!
//! JSBSim's axes NORMAL (up), AXIAL (aft) and SIDE (right) are the axes of CN, CA and CY: its body
//! forces are −AXIAL, SIDE, −NORMAL. ROLL, PITCH and YAW are moments right wing down, nose up, nose
//! right, as Cl, Cm, Cn.
//!
//! α and β are read in degrees. The rates are p b/2V, r b/2V and q c̄/2V in radians: `aero/bi2vel`
//! times p or r, `aero/ci2vel` times q. Vanes are forces in lbf and moments in ft lbf, and are not
//! multiplied by q̄S.

use super::export_contents::{COEFFICIENTS, ExportContents, terms};
use super::export_table::ExportTable;
use super::xml::Xml;
use crate::aero::{Coefficient, Derivative, Regressor};

/// JSBSim's `<aerodynamics>` section.
#[must_use]
pub fn section(contents: &ExportContents, tables: &[ExportTable]) -> String {
    let mut xml = Xml::new("<?xml version=\"1.0\" encoding=\"UTF-8\"?>");
    xml.open("aerodynamics", &[]);
    let a = contents.aircraft;
    let description = format!(
        "{}: posterior of flight tests and wind tunnel; the description of each function names the larger source of information. \
         Reference area {} ft2, span {} ft, chord {} ft: metrics must be the same. Moments are about the c.g.: put the \
         aerodynamic reference point (AERORP) there. Signals that have no property of their own begin with harvest/ and \
         are to be set by the flight control section, in the unit of their names.",
        contents.title, a.wing_area_ft2, a.span_ft, a.chord_ft
    );
    xml.text("description", &[], &description);
    for property in own_properties(contents, tables) {
        xml.text("property", &[("value", "0")], &property);
    }
    for derivative in &contents.aero_model.derivatives {
        if let Some(table) = tables.iter().find(|t| t.derivative == derivative.name) {
            function(contents, table, &mut xml);
        }
    }
    for coefficient in COEFFICIENTS {
        xml.open(
            "function",
            &[("name", &format!("aero/harvest/{}", word(coefficient)))],
        );
        let text = format!("{} without thrust-vectoring vanes", word(coefficient));
        xml.text("description", &[], &text);
        let products: Vec<Vec<Factor>> = terms(contents, tables, coefficient, false)
            .map(|d| factors(contents, d))
            .collect();
        sum(&mut xml, &products);
        xml.close();
    }
    for coefficient in COEFFICIENTS {
        axis(contents, tables, coefficient, &mut xml);
    }
    xml.close();
    xml.finish()
}

fn word(coefficient: Coefficient) -> String {
    format!("{coefficient:?}")
}

/// JSBSim's axis of a coefficient and the property of its reference length.
fn axis_of(coefficient: Coefficient) -> (&'static str, Option<&'static str>) {
    match coefficient {
        Coefficient::CN => ("NORMAL", None),
        Coefficient::CA => ("AXIAL", None),
        Coefficient::CY => ("SIDE", None),
        Coefficient::Cl => ("ROLL", Some("metrics/bw-ft")),
        Coefficient::Cm => ("PITCH", Some("metrics/cbarw-ft")),
        Coefficient::Cn => ("YAW", Some("metrics/bw-ft")),
    }
}

/// Property of a signal.
fn property(contents: &ExportContents, signal: &str) -> String {
    let given = contents.settings.jsbsim_properties.get(signal);
    given.cloned().unwrap_or_else(|| match signal {
        "altitude_ft" => "position/h-sl-ft".to_owned(),
        "qbar_psf" => "aero/qbar-psf".to_owned(),
        "velocity_ft_s" => "velocities/vt-fps".to_owned(),
        "mach" => "velocities/mach".to_owned(),
        "mass_slug" => "inertia/mass-slugs".to_owned(),
        _ => format!("harvest/{signal}"),
    })
}

/// Property of the third variable, if a table depends on one.
fn third(contents: &ExportContents, tables: &[ExportTable]) -> Option<String> {
    let depends = tables.iter().any(|t| !t.thirds.is_empty());
    let third = contents
        .tunnel
        .settings()
        .third
        .as_ref()
        .filter(|_| depends)?;
    Some(property(contents, &third.name))
}

/// Properties that JSBSim itself lacks, each once.
fn own_properties(contents: &ExportContents, tables: &[ExportTable]) -> Vec<String> {
    let all = COEFFICIENTS
        .into_iter()
        .flat_map(|c| [false, true].map(|vanes| (c, vanes)));
    let derivatives =
        all.flat_map(|(c, vanes)| terms(contents, tables, c, vanes).collect::<Vec<_>>());
    let surfaces = derivatives
        .flat_map(|d| d.regressor.signals())
        .map(|signal| property(contents, signal));
    let mut properties: Vec<String> = surfaces
        .chain(third(contents, tables))
        .filter(|p| p.starts_with("harvest/"))
        .collect();
    properties.sort();
    properties.dedup();
    properties
}

/// Factor of a product.
struct Factor {
    property: String,
    /// `true` for the property's magnitude.
    is_magnitude: bool,
}

impl Factor {
    fn of_property(property: impl Into<String>) -> Factor {
        Factor {
            property: property.into(),
            is_magnitude: false,
        }
    }
}

/// Factors of one term: the derivative and its regressor.
fn factors(contents: &ExportContents, derivative: &Derivative) -> Vec<Factor> {
    let mut factors = vec![Factor::of_property(format!(
        "aero/harvest/{}",
        derivative.name
    ))];
    factors.extend(regressor_factors(contents, &derivative.regressor));
    factors
}

fn regressor_factors(contents: &ExportContents, regressor: &Regressor) -> Vec<Factor> {
    let all = |properties: &[&str]| properties.iter().map(|p| Factor::of_property(*p)).collect();
    match regressor {
        Regressor::Constant => vec![],
        Regressor::Alpha => all(&["aero/alpha-deg"]),
        Regressor::Beta => all(&["aero/beta-deg"]),
        Regressor::RollRate => all(&["velocities/p-aero-rad_sec", "aero/bi2vel"]),
        Regressor::PitchRate => all(&["velocities/q-aero-rad_sec", "aero/ci2vel"]),
        Regressor::YawRate => all(&["velocities/r-aero-rad_sec", "aero/bi2vel"]),
        Regressor::AlphaRate => all(&["aero/alphadot-rad_sec", "aero/ci2vel"]),
        Regressor::Surface(signal) | Regressor::Vane(signal) => {
            vec![Factor::of_property(property(contents, signal))]
        }
        Regressor::Magnitude(of) => {
            let magnitude = |factor: Factor| Factor {
                is_magnitude: true,
                ..factor
            };
            let own = regressor_factors(contents, of);
            own.into_iter().map(magnitude).collect()
        }
        Regressor::Product(both) => {
            let both = both.iter();
            both.flat_map(|r| regressor_factors(contents, r)).collect()
        }
    }
}

fn axis(
    contents: &ExportContents,
    tables: &[ExportTable],
    coefficient: Coefficient,
    xml: &mut Xml,
) {
    let (name, length) = axis_of(coefficient);
    xml.open("axis", &[("name", name)]);
    let kind = if coefficient.is_moment() {
        "moment"
    } else {
        "force"
    };
    xml.open(
        "function",
        &[(
            "name",
            &format!("aero/{kind}/harvest/{}", word(coefficient)),
        )],
    );
    let mut whole = vec!["aero/qbar-psf".to_owned(), "metrics/Sw-sqft".to_owned()];
    whole.extend(length.map(str::to_owned));
    whole.push(format!("aero/harvest/{}", word(coefficient)));
    let vanes = terms(contents, tables, coefficient, true).map(|d| factors(contents, d));
    let whole = whole.into_iter().map(Factor::of_property).collect();
    let products: Vec<Vec<Factor>> = std::iter::once(whole).chain(vanes).collect();
    sum(xml, &products);
    xml.close();
    xml.close();
}

/// Writes a sum of products of properties. JSBSim requires two operands or more in each.
fn sum(xml: &mut Xml, products: &[Vec<Factor>]) {
    if products.is_empty() {
        xml.text("value", &[], "0");
    }
    if products.len() > 1 {
        xml.open("sum", &[]);
    }
    for product in products {
        if product.len() > 1 {
            xml.open("product", &[]);
        }
        for factor in product {
            if factor.is_magnitude {
                xml.open("abs", &[]);
            }
            xml.text("property", &[], &factor.property);
            if factor.is_magnitude {
                xml.close();
            }
        }
        if product.len() > 1 {
            xml.close();
        }
    }
    if products.len() > 1 {
        xml.close();
    }
}

/// Writes the table of one derivative.
fn function(contents: &ExportContents, table: &ExportTable, xml: &mut Xml) {
    xml.open(
        "function",
        &[("name", &format!("aero/harvest/{}", table.derivative))],
    );
    let over_mach = if table.machs.is_empty() {
        ""
    } else {
        "; at the Mach numbers flown"
    };
    xml.text(
        "description",
        &[],
        &format!("{} ({}){over_mach}", table.sources(), table.unit),
    );
    let third = third(contents, std::slice::from_ref(table)).unwrap_or_default();
    let axes = [
        ("aero/alpha-deg", table.alphas_deg.as_slice()),
        ("velocities/mach", table.machs.as_slice()),
        (third.as_str(), table.thirds.as_slice()),
    ];
    let values: Vec<f64> = table.cells.iter().map(|c| c.value).collect();
    // A variable with one breakpoint is no variable: the cells are the same without it.
    let axes: Vec<(&str, &[f64])> = axes
        .into_iter()
        .filter(|(_, points)| points.len() > 1)
        .collect();
    lookup(&axes, &values, xml);
    xml.close();
}

/// Writes values over their axes: a constant, or a table of one, two or three variables.
fn lookup(axes: &[(&str, &[f64])], values: &[f64], xml: &mut Xml) {
    match axes {
        [] => xml.text(
            "value",
            &[],
            &values.first().copied().unwrap_or_default().to_string(),
        ),
        [(property, points)] => {
            xml.open("table", &[]);
            xml.text("independentVar", &[("lookup", "row")], property);
            let cells = points.iter().zip(values);
            let lines: Vec<String> = cells.map(|(x, y)| format!("{x} {y}")).collect();
            xml.block("tableData", &[], &lines);
            xml.close();
        }
        [(row, rows), (column, columns), rest @ ..] => {
            xml.open("table", &[]);
            xml.text("independentVar", &[("lookup", "row")], row);
            xml.text("independentVar", &[("lookup", "column")], column);
            let size = rows.len() * columns.len();
            if let [(property, breakpoints), ..] = rest {
                xml.text("independentVar", &[("lookup", "table")], property);
                for (breakpoint, values) in breakpoints.iter().zip(values.chunks(size)) {
                    xml.block(
                        "tableData",
                        &[("breakPoint", &breakpoint.to_string())],
                        &plane(rows, columns, values),
                    );
                }
            } else {
                xml.block("tableData", &[], &plane(rows, columns, values));
            }
            xml.close();
        }
    }
}

/// Lines of a table of two variables: the columns' breakpoints, then each row's with its values.
/// The rows' variable varies fastest in `values`.
fn plane(rows: &[f64], columns: &[f64], values: &[f64]) -> Vec<String> {
    let words = |values: Vec<f64>| {
        values
            .iter()
            .map(f64::to_string)
            .collect::<Vec<_>>()
            .join(" ")
    };
    let line = |(i, row): (usize, &f64)| {
        let across = (0..columns.len())
            .filter_map(|j| values.get(j * rows.len() + i).copied())
            .collect();
        format!("{row} {}", words(across))
    };
    std::iter::once(words(columns.to_vec()))
        .chain(rows.iter().enumerate().map(line))
        .collect()
}
