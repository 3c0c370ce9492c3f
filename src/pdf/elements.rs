//! Kind, classes and text of an element of the page.

use roxmltree::Node;

/// Elements of running text.
const INLINE: [&str; 12] = [
    "a", "b", "i", "em", "strong", "small", "sub", "span", "br", "code", "title", "desc",
];

/// Elements that a printed page omits.
const OMITTED: [&str; 6] = ["script", "style", "head", "button", "input", "label"];

pub fn has_class(node: Node, class: &str) -> bool {
    node.attribute("class")
        .is_some_and(|classes| classes.split(' ').any(|c| c == class))
}

/// `true` for an element that begins a line of its own.
pub fn is_block(node: Node) -> bool {
    let name = node.tag_name().name();
    let is_inline_drawing = name == "svg" && has_class(node, "inline");
    !INLINE.contains(&name) && !is_inline_drawing
}

/// `true` for an element that is of use on a screen alone.
pub fn is_screen_only(node: Node) -> bool {
    OMITTED.contains(&node.tag_name().name()) || has_class(node, "screen")
}

/// Text of an element in one line, without its `small` parts.
pub fn plain_text(node: Node) -> String {
    let is_kept = |text: &Node| {
        text.ancestors()
            .filter(Node::is_element)
            .all(|a| !is_screen_only(a) && !a.has_tag_name("small"))
    };
    let parts: String = node
        .descendants()
        .filter(Node::is_text)
        .filter(is_kept)
        .filter_map(|text| text.text())
        .collect();
    parts.split_whitespace().collect::<Vec<_>>().join(" ")
}
