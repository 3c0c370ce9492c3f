//! JSBSim's functions evaluated as its reference manual says: properties, values, sums, products
//! and tables of one to three variables, linear between their points and constant beyond. What
//! JSBSim itself makes of the section: `tests/load_in_jsbsim.py`.

use std::collections::BTreeMap;

use roxmltree::{Document, Node};

/// The section evaluated for some properties: all that its functions define are added.
pub(super) fn evaluated(section: &str, properties: &BTreeMap<&str, f64>) -> BTreeMap<String, f64> {
    let document = Document::parse(section).unwrap();
    let root = document.root_element();
    let mut all: BTreeMap<String, f64> = properties
        .iter()
        .map(|(k, v)| ((*k).to_owned(), *v))
        .collect();
    for own in root.children().filter(|n| n.has_tag_name("property")) {
        all.entry(own.text().unwrap().to_owned()).or_insert(0.0);
    }
    let functions = root.children().filter(|n| n.has_tag_name("function"));
    let of_axes = root
        .children()
        .filter(|n| n.has_tag_name("axis"))
        .flat_map(|a| a.children());
    for function in functions.chain(of_axes.filter(|n| n.has_tag_name("function"))) {
        let operands: Vec<Node> = elements(function)
            .filter(|n| !n.has_tag_name("description"))
            .collect();
        assert_eq!(operands.len(), 1);
        let value = evaluate(operands[0], &all);
        assert!(
            all.insert(function.attribute("name").unwrap().to_owned(), value)
                .is_none()
        );
    }
    all
}

/// The force or moment of each axis.
pub(super) fn axes(section: &str, properties: &BTreeMap<&str, f64>) -> BTreeMap<String, f64> {
    let all = evaluated(section, properties);
    let document = Document::parse(section).unwrap();
    let axes = document
        .root_element()
        .children()
        .filter(|n| n.has_tag_name("axis"));
    let sum = |axis: Node| {
        elements(axis)
            .map(|f| all[f.attribute("name").unwrap()])
            .sum()
    };
    axes.map(|axis| (axis.attribute("name").unwrap().to_owned(), sum(axis)))
        .collect()
}

fn elements<'a, 'input>(node: Node<'a, 'input>) -> impl Iterator<Item = Node<'a, 'input>> {
    node.children().filter(Node::is_element)
}

fn evaluate(node: Node, all: &BTreeMap<String, f64>) -> f64 {
    let operands = || elements(node).map(|n| evaluate(n, all)).collect::<Vec<_>>();
    match node.tag_name().name() {
        "value" => node.text().unwrap().trim().parse().unwrap(),
        "property" => *all
            .get(node.text().unwrap().trim())
            .unwrap_or_else(|| panic!("{:?}", node.text())),
        "sum" => {
            assert!(operands().len() > 1);
            operands().iter().sum()
        }
        "product" => {
            assert!(operands().len() > 1);
            operands().iter().product()
        }
        "abs" => {
            assert_eq!(operands().len(), 1);
            operands()[0].abs()
        }
        "table" => table(node, all),
        other => panic!("{other}"),
    }
}

fn table(node: Node, all: &BTreeMap<String, f64>) -> f64 {
    let key = |lookup: &str| {
        let variable = elements(node).find(|n| n.attribute("lookup") == Some(lookup))?;
        Some(all[variable.text().unwrap().trim()])
    };
    let data: Vec<Node> = elements(node)
        .filter(|n| n.has_tag_name("tableData"))
        .collect();
    let row = key("row").unwrap();
    let Some(column) = key("column") else {
        let points: Vec<(f64, f64)> = lines(data[0]).iter().map(|l| (l[0], l[1])).collect();
        return along(&points, row);
    };
    let plane = |data: Node| {
        let lines = lines(data);
        let across = |l: &Vec<f64>| {
            along(
                &lines[0]
                    .iter()
                    .copied()
                    .zip(l[1..].iter().copied())
                    .collect::<Vec<_>>(),
                column,
            )
        };
        along(
            &lines[1..]
                .iter()
                .map(|l| (l[0], across(l)))
                .collect::<Vec<_>>(),
            row,
        )
    };
    match key("table") {
        None => plane(data[0]),
        Some(third) => {
            let points: Vec<(f64, f64)> = data
                .iter()
                .map(|d| {
                    (
                        d.attribute("breakPoint").unwrap().parse().unwrap(),
                        plane(*d),
                    )
                })
                .collect();
            along(&points, third)
        }
    }
}

fn lines(data: Node) -> Vec<Vec<f64>> {
    let text = data.text().unwrap();
    let numbers = |line: &str| {
        line.split_whitespace()
            .map(|w| w.parse().unwrap())
            .collect::<Vec<f64>>()
    };
    text.lines()
        .map(numbers)
        .filter(|l| !l.is_empty())
        .collect()
}

fn along(points: &[(f64, f64)], x: f64) -> f64 {
    let upper = points.partition_point(|p| p.0 < x);
    if upper == 0 {
        return points[0].1;
    }
    let Some(high) = points.get(upper) else {
        return points[points.len() - 1].1;
    };
    let low = points[upper - 1];
    low.1 + (x - low.0) / (high.0 - low.0) * (high.1 - low.1)
}
