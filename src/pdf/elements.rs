//! Questions about an element of the page: its classes, its kind, its text.

use roxmltree::Node;

/// An element's text in one line, without what is small beside it.
pub fn plain_text(node: Node) -> String {
    let mut text = String::new();
    for part in node.descendants().filter(Node::is_text) {
        let is_kept = part
            .ancestors()
            .all(|a| !a.is_element() || !(is_for_screens(a) || a.has_tag_name("small")));
        if let (Some(part), true) = (part.text(), is_kept) {
            text.push_str(part);
        }
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

pub fn has_class(node: Node, class: &str) -> bool {
    node.attribute("class")
        .is_some_and(|c| c.split(' ').any(|c| c == class))
}

/// What is of use on a screen alone.
pub fn is_for_screens(node: Node) -> bool {
    matches!(
        node.tag_name().name(),
        "script" | "style" | "head" | "button" | "input" | "label"
    ) || node
        .attribute("class")
        .is_some_and(|c| c.split(' ').any(|c| c == "screen"))
}

pub fn is_block(node: Node) -> bool {
    let inline = [
        "a", "b", "i", "em", "strong", "small", "sub", "span", "br", "code", "title", "desc",
    ];
    let name = node.tag_name().name();
    let is_key = name == "svg" && (has_class(node, "key") || has_class(node, "strip"));
    !inline.contains(&name) && !is_key
}
