//! DAVE-ML (ANSI/AIAA S-119) read as a tunnel database. It reads the functions of the wanted
//! variables over gridded tables or points, with breakpoints, units and additive normal
//! uncertainties. In a gridded table the last of its breakpoints varies fastest.

use std::collections::BTreeMap;

use roxmltree::{Document, Node, ParsingOptions};

use super::xml_bounds::excess;
use crate::store::files::TunnelRow;
use crate::units::DEG;

/// A fault of the document, with its line.
type Wrong = (Option<usize>, String);

/// Independent variable of a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Variable {
    Alpha { in_rad: bool },
    Mach,
    Third,
}

/// Names of the angle of attack, without the characters between words.
const ALPHA_NAMES: [&str; 7] = [
    "alpha",
    "alphadeg",
    "alpharad",
    "aoa",
    "angleofattack",
    "angleofattackdeg",
    "angleofattackrad",
];

/// A grid: breakpoints of each variable, values with the last variable fastest.
struct Grid {
    axes: Vec<(Variable, Vec<f64>)>,
    values: Vec<f64>,
    uncertainties: Option<Vec<f64>>,
    source: Option<String>,
}

/// Reads the functions of the wanted variables as rows, each with the line of its function.
pub(super) fn rows(
    text: &str,
    third: Option<&str>,
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<(usize, TunnelRow)>, Wrong> {
    if let Some((line, what)) = excess(text) {
        return Err((line, what.to_owned()));
    }
    let document = parsed(text)?;
    let definitions = Definitions::new(&document, text, third);
    if document.root_element().tag_name().name() != "DAVEfunc" {
        return Err((
            Some(1),
            "not DAVE-ML: the outermost element must be `DAVEfunc`".into(),
        ));
    }
    let mut rows = Vec::new();
    for function in children(document.root_element(), "function") {
        let dependent =
            child(function, "dependentVarRef").or_else(|| child(function, "dependentVarPts"));
        let name = dependent
            .and_then(|d| d.attribute("varID"))
            .unwrap_or_default();
        if wanted(name) {
            let line = definitions.line(function);
            let grid = definitions.grid(function)?;
            let of_function = rows_of(name, &grid, definitions.unit(name));
            rows.extend(of_function.map(|row| (line, row)));
        }
    }
    if rows.is_empty() {
        return Err((
            None,
            "no function of the file gives a derivative of the model, by the `varID` of its dependent variable".into(),
        ));
    }
    Ok(rows)
}

/// Parses a document.
fn parsed(text: &str) -> Result<Document<'_>, Wrong> {
    let options = ParsingOptions {
        allow_dtd: true,
        ..ParsingOptions::default()
    };
    Document::parse_with_options(text, options).map_err(|e| {
        let line = usize::try_from(e.pos().row).ok();
        (line, format!("not readable as XML: {e}"))
    })
}

/// Definitions of a document by id.
struct Definitions<'a, 'input> {
    /// Places at which lines end.
    line_ends: Vec<usize>,
    variables: BTreeMap<&'a str, Node<'a, 'input>>,
    breakpoints: BTreeMap<&'a str, Node<'a, 'input>>,
    tables: BTreeMap<&'a str, Node<'a, 'input>>,
    third: Option<&'a str>,
}

fn children<'a, 'input>(
    node: Node<'a, 'input>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'input>> {
    node.children().filter(move |n| n.tag_name().name() == name)
}

fn child<'a, 'input>(node: Node<'a, 'input>, name: &'static str) -> Option<Node<'a, 'input>> {
    children(node, name).next()
}

/// Name without the characters that authors put between words.
fn plain(name: &str) -> String {
    name.chars()
        .filter(|c| c.is_alphanumeric())
        .flat_map(char::to_lowercase)
        .collect()
}

impl<'a, 'input> Definitions<'a, 'input> {
    fn new(
        document: &'a Document<'input>,
        text: &str,
        third: Option<&'a str>,
    ) -> Definitions<'a, 'input> {
        let by_id = |name: &'static str, id: &'static str| {
            let nodes = document
                .descendants()
                .filter(move |n| n.tag_name().name() == name);
            nodes
                .filter_map(move |n| Some((n.attribute(id)?, n)))
                .collect::<BTreeMap<_, _>>()
        };
        Definitions {
            line_ends: text.match_indices('\n').map(|(at, _)| at).collect(),
            variables: by_id("variableDef", "varID"),
            breakpoints: by_id("breakpointDef", "bpID"),
            tables: by_id("griddedTableDef", "gtID"),
            third,
        }
    }

    fn line(&self, node: Node) -> usize {
        let start = node.range().start;
        1 + self.line_ends.partition_point(|end| *end < start)
    }

    fn wrong(&self, node: Node, what: impl Into<String>) -> Wrong {
        (Some(self.line(node)), what.into())
    }

    fn unit(&self, variable: &str) -> &'a str {
        self.variables
            .get(variable)
            .and_then(|v| v.attribute("units"))
            .unwrap_or("nd")
    }

    /// Independent variable of a reference.
    fn variable(&self, reference: Node) -> Result<Variable, Wrong> {
        self.refuse_interpolation(reference)?;
        let id = reference.attribute("varID").unwrap_or_default();
        let definition = self.variables.get(id);
        let names = [Some(id), definition.and_then(|d| d.attribute("name"))]
            .map(|n| plain(n.unwrap_or_default()));
        let is = |known: &[&str]| names.iter().any(|name| known.contains(&name.as_str()));
        let is_third = self
            .third
            .is_some_and(|third| names.contains(&plain(third)));
        if is(&ALPHA_NAMES) {
            match self.unit(id) {
                "deg" => Ok(Variable::Alpha { in_rad: false }),
                "rad" => Ok(Variable::Alpha { in_rad: true }),
                other => Err(self.wrong(
                    reference,
                    format!("angle of attack in `{other}`: deg or rad"),
                )),
            }
        } else if is(&["mach", "machnumber"]) {
            Ok(Variable::Mach)
        } else if is_third {
            Ok(Variable::Third)
        } else {
            let what = format!(
                "a table over `{id}`: only angle of attack, Mach number and the variable that pipeline.yaml names (tunnel: third:) are read"
            );
            Err(self.wrong(reference, what))
        }
    }

    /// Refuses a reference that asks for another than linear interpolation.
    fn refuse_interpolation(&self, reference: Node) -> Result<(), Wrong> {
        let stated = reference.attribute("interpolate");
        match stated.filter(|interpolation| *interpolation != "linear") {
            None => Ok(()),
            Some(other) => Err(self.wrong(
                reference,
                format!(
                    "`interpolate=\"{other}\"`: tables are read linearly, or as pipeline.yaml states (tunnel: interpolation:)"
                ),
            )),
        }
    }

    /// Grid of a function: inside it, or in a gridded table.
    fn grid(&self, function: Node<'a, 'input>) -> Result<Grid, Wrong> {
        match child(function, "dependentVarPts") {
            Some(values) => self.inline_grid(function, values),
            None => self.gridded_table(function),
        }
    }

    /// Grid whose points and values are inside the function.
    fn inline_grid(
        &self,
        function: Node<'a, 'input>,
        values: Node<'a, 'input>,
    ) -> Result<Grid, Wrong> {
        let points = children(function, "independentVarPts");
        let axes = points
            .map(|points| Ok((self.variable(points)?, self.numbers(points)?)))
            .collect::<Result<_, Wrong>>()?;
        let grid = Grid {
            axes,
            values: self.numbers(values)?,
            uncertainties: None,
            source: child(function, "description").map(content),
        };
        self.complete(function, grid)
    }

    /// Grid of the gridded table that a function refers to.
    fn gridded_table(&self, function: Node<'a, 'input>) -> Result<Grid, Wrong> {
        let definition = child(function, "functionDefn")
            .ok_or_else(|| self.wrong(function, "no `functionDefn`"))?;
        let table = self.table(definition)?;
        let variables: Vec<Variable> = children(function, "independentVarRef")
            .map(|reference| self.variable(reference))
            .collect::<Result<_, _>>()?;
        let breakpoints: Vec<Vec<f64>> = children(table, "breakpointRefs")
            .flat_map(|refs| children(refs, "bpRef"))
            .map(|reference| self.breakpoints(reference))
            .collect::<Result<_, _>>()?;
        if variables.len() != breakpoints.len() {
            let what = format!(
                "{} independent variables and {} breakpoints",
                variables.len(),
                breakpoints.len()
            );
            return Err(self.wrong(table, what));
        }
        let data = child(table, "dataTable").ok_or_else(|| self.wrong(table, "no `dataTable`"))?;
        let values = self.numbers(data)?;
        let description = child(table, "description").or(child(function, "description"));
        let grid = Grid {
            axes: variables.into_iter().zip(breakpoints).collect(),
            uncertainties: self.uncertainties(table, values.len())?,
            values,
            source: description.map(content),
        };
        self.complete(table, grid)
    }

    /// Checks that a grid depends on angle of attack, and has exactly as many values as its ascending
    /// breakpoints require.
    fn complete(&self, at: Node, grid: Grid) -> Result<Grid, Wrong> {
        let sizes = grid.axes.iter().map(|(_, points)| points.len());
        let expected = sizes.fold(1, usize::saturating_mul);
        if grid.values.len() != expected || grid.axes.is_empty() {
            let what = format!("{} values for {expected} grid points", grid.values.len());
            return Err(self.wrong(at, what));
        }
        if grid
            .axes
            .iter()
            .any(|(_, points)| points.windows(2).any(|w| w[0] >= w[1]))
        {
            return Err(self.wrong(at, "breakpoints must ascend"));
        }
        if !grid
            .axes
            .iter()
            .any(|(v, _)| matches!(v, Variable::Alpha { .. }))
        {
            return Err(self.wrong(at, "the table does not depend on angle of attack"));
        }
        Ok(grid)
    }

    fn table(&self, definition: Node<'a, 'input>) -> Result<Node<'a, 'input>, Wrong> {
        let inline =
            child(definition, "griddedTableDef").or_else(|| child(definition, "griddedTable"));
        if let Some(table) = inline {
            return Ok(table);
        }
        let reference = child(definition, "griddedTableRef").ok_or_else(|| {
            self.wrong(
                definition,
                "ungridded tables are not read: give the function over a grid",
            )
        })?;
        let id = reference.attribute("gtID").unwrap_or_default();
        self.tables
            .get(id)
            .copied()
            .ok_or_else(|| self.wrong(reference, format!("there is no table `{id}`")))
    }

    fn breakpoints(&self, reference: Node) -> Result<Vec<f64>, Wrong> {
        let id = reference.attribute("bpID").unwrap_or_default();
        let values = self.breakpoints.get(id).and_then(|b| child(*b, "bpVals"));
        let values = values
            .ok_or_else(|| self.wrong(reference, format!("there are no breakpoints `{id}`")))?;
        self.numbers(values)
    }

    /// Standard uncertainties of a table that states additive normal ones.
    fn uncertainties(&self, table: Node<'a, 'input>, n: usize) -> Result<Option<Vec<f64>>, Wrong> {
        let Some(uncertainty) = child(table, "uncertainty") else {
            return Ok(None);
        };
        let normal = child(uncertainty, "normalPDF");
        let Some(normal) = normal.filter(|_| uncertainty.attribute("effect") == Some("additive"))
        else {
            return Err(self.wrong(uncertainty, "only additive normal uncertainties are read"));
        };
        let sigmas: f64 = normal
            .attribute("numSigmas")
            .and_then(|s| s.trim().parse().ok())
            .unwrap_or(1.0);
        let bounds = child(normal, "bounds").ok_or_else(|| self.wrong(normal, "no `bounds`"))?;
        let values = self.numbers(child(bounds, "dataTable").unwrap_or(bounds))?;
        let values = if values.len() == 1 {
            vec![values[0]; n]
        } else {
            values
        };
        if values.len() != n {
            return Err(self.wrong(
                bounds,
                format!("{} uncertainties for {n} values", values.len()),
            ));
        }
        Ok(Some(values.into_iter().map(|v| v / sigmas).collect()))
    }

    /// Numbers in an element's text, separated by commas and blanks.
    fn numbers(&self, node: Node) -> Result<Vec<f64>, Wrong> {
        let text: String = node
            .children()
            .filter(Node::is_text)
            .filter_map(|n| n.text())
            .collect();
        let words = text
            .split([',', ' ', '\n', '\t', '\r'])
            .filter(|w| !w.is_empty());
        let number = |word: &str| {
            let number = word.parse::<f64>().ok().filter(|v| v.is_finite());
            number.ok_or_else(|| self.wrong(node, format!("`{word}` is no number")))
        };
        words.map(number).collect()
    }
}

/// Points of a grid as rows of a tunnel table.
fn rows_of<'g>(
    name: &'g str,
    grid: &'g Grid,
    unit: &'g str,
) -> impl Iterator<Item = TunnelRow> + use<'g> {
    (0..grid.values.len()).map(move |i| {
        let mut row = TunnelRow {
            derivative: name.to_owned(),
            alpha_deg: 0.0,
            mach: None,
            value: grid.values[i],
            unit: unit.to_owned(),
            uncertainty: grid.uncertainties.as_ref().map(|u| u[i]),
            source: grid.source.clone(),
            third: None,
        };
        let mut rest = i;
        for (variable, points) in grid.axes.iter().rev() {
            let at = points[rest % points.len()];
            rest /= points.len();
            match variable {
                Variable::Alpha { in_rad } => row.alpha_deg = if *in_rad { at * DEG } else { at },
                Variable::Mach => row.mach = Some(at),
                Variable::Third => row.third = Some(at),
            }
        }
        row
    })
}

fn content(node: Node) -> String {
    node.text()
        .unwrap_or_default()
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
}
