//! The content models of DAVEfunc 2.0's DTD for the elements that the export writes, as patterns
//! over the names of an element's children, and its identifiers and references. The whole DTD
//! against a file: `tests/davefunc.py`.

use std::collections::BTreeSet;

use roxmltree::{Document, Node, ParsingOptions};

/// Element; its children in order, with ? * + as in the DTD, and an alternative's names between
/// bars; required attributes.
const MODELS: [(&str, &str, &str); 37] = [
    (
        "DAVEfunc",
        "fileHeader variableDef+ breakpointDef* griddedTableDef* ungriddedTableDef* function* checkData?",
        "",
    ),
    (
        "fileHeader",
        "author+ creationDate|fileCreationDate fileVersion? description? reference* modificationRecord* provenance*",
        "",
    ),
    ("author", "address*", "name org"),
    ("creationDate", "", "date"),
    ("description", "#text", ""),
    (
        "variableDef",
        "description? provenance|provenanceRef? calculation? isInput|isControl|isDisturbance? isState? isStateDeriv? \
         isOutput? isStdAIAA? uncertainty?",
        "name varID units",
    ),
    ("isInput", "", ""),
    ("isOutput", "", ""),
    ("calculation", "math", ""),
    ("math", "apply", ""),
    ("apply", "plus|times apply|ci*", ""),
    ("plus", "", ""),
    ("times", "", ""),
    ("ci", "#text", ""),
    ("breakpointDef", "description? bpVals", "bpID"),
    ("bpVals", "#text", ""),
    (
        "griddedTableDef",
        "description? provenance|provenanceRef? breakpointRefs uncertainty? dataTable",
        "gtID",
    ),
    ("breakpointRefs", "bpRef+", ""),
    ("bpRef", "", "bpID"),
    ("uncertainty", "normalPDF|uniformPDF", "effect"),
    (
        "normalPDF",
        "bounds correlatesWith* correlation*",
        "numSigmas",
    ),
    ("bounds", "dataTable", ""),
    ("correlatesWith", "", "varID"),
    ("correlation", "", "varID corrCoef"),
    ("dataTable", "#text", ""),
    (
        "function",
        "description? provenance|provenanceRef? independentVarRef+ dependentVarRef functionDefn",
        "name",
    ),
    ("independentVarRef", "", "varID"),
    ("dependentVarRef", "", "varID"),
    ("functionDefn", "griddedTableRef|griddedTableDef", ""),
    ("griddedTableRef", "", "gtID"),
    ("checkData", "provenance|provenanceRef? staticShot+", ""),
    (
        "staticShot",
        "description? provenance|provenanceRef? checkInputs? internalValues? checkOutputs",
        "name",
    ),
    ("checkInputs", "signal+", ""),
    ("checkOutputs", "signal+", ""),
    ("signal", "varID|signalID signalValue tol?", ""),
    ("varID", "#text", ""),
    ("signalValue", "#text", ""),
];

/// Violations of the grammar by a document, in words.
pub(super) fn faults(text: &str) -> Vec<String> {
    let document = Document::parse_with_options(
        text,
        ParsingOptions {
            allow_dtd: true,
            ..Default::default()
        },
    )
    .unwrap();
    let nodes: Vec<Node> = document.descendants().filter(Node::is_element).collect();
    let mut faults: Vec<String> = nodes.iter().flat_map(|n| of(*n)).collect();
    let ids: Vec<&str> = nodes
        .iter()
        .filter_map(|n| match n.tag_name().name() {
            "variableDef" => n.attribute("varID"),
            "breakpointDef" => n.attribute("bpID"),
            "griddedTableDef" => n.attribute("gtID"),
            _ => None,
        })
        .collect();
    let known: BTreeSet<&str> = ids.iter().copied().collect();
    if known.len() < ids.len() {
        faults.push("an identifier stands twice".into());
    }
    for node in &nodes {
        let reference = match node.tag_name().name() {
            "independentVarRef" | "dependentVarRef" => node.attribute("varID"),
            "bpRef" => node.attribute("bpID"),
            "griddedTableRef" => node.attribute("gtID"),
            "ci" => node.text(),
            _ => None,
        };
        faults.extend(
            reference
                .filter(|r| !known.contains(r))
                .map(|r| format!("nothing is called {r}")),
        );
    }
    faults
}

fn of(node: Node) -> Vec<String> {
    let name = node.tag_name().name();
    let Some((_, model, required)) = MODELS.iter().find(|(known, ..)| *known == name) else {
        return vec![format!("{name} is no element")];
    };
    let mut faults: Vec<String> = required
        .split_whitespace()
        .filter(|a| node.attribute(*a).is_none())
        .map(|a| format!("{name} lacks {a}"))
        .collect();
    let children: Vec<&str> = node
        .children()
        .filter(Node::is_element)
        .map(|c| c.tag_name().name())
        .collect();
    if !follows(&children, model) {
        faults.push(format!("{name} has {children:?}, not {model}"));
    }
    faults
}

/// Test for names in a model's order; each part takes as many as it can, which is enough for
/// these models.
fn follows(names: &[&str], model: &str) -> bool {
    let mut rest = names;
    for part in model.split_whitespace().filter(|p| *p != "#text") {
        let plain = part.trim_end_matches(['?', '*', '+']);
        let count = rest
            .iter()
            .take_while(|n| plain.split('|').any(|p| p == **n))
            .count();
        let (least, most) = match &part[plain.len()..] {
            "?" => (0, 1),
            "*" => (0, usize::MAX),
            "+" => (1, usize::MAX),
            _ => (1, 1),
        };
        if count < least {
            return false;
        }
        rest = &rest[count.min(most)..];
    }
    rest.is_empty()
}
