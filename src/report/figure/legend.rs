//! Legends of figures, as HTML beside the drawing.

use serde::Serialize;

use super::style::{
    EXCLUDED_COLOUR, INK, MEASURED_COLOUR, OUTSIDE_COLOUR, TOLERANCE_AREA, TOLERANCE_LIMIT,
};

/// One entry of a legend.
#[derive(Clone, Debug, Serialize)]
pub struct LegendView {
    /// Small SVG drawing.
    pub key: String,
    pub label: String,
}

impl LegendView {
    pub fn new(key: String, label: &str) -> LegendView {
        LegendView {
            key,
            label: label.to_owned(),
        }
    }
}

/// A small drawing before a word of a legend.
#[must_use]
pub fn key(width: u32, content: &str) -> String {
    format!(
        r#"<svg class="key inline" viewBox="0 0 {width} 12" width="{width}" height="12" aria-hidden="true">{content}</svg>"#
    )
}

/// Content of a key that shows a line; an empty `dash` draws it solid.
#[must_use]
pub fn line(colour: &str, dash: &str, width: f64) -> String {
    let dash = if dash.is_empty() { "none" } else { dash };
    format!(
        r#"<path d="M0 6h24" stroke="{colour}" stroke-width="{width}" stroke-dasharray="{dash}" fill="none"/>"#
    )
}

/// Legend of a maneuver's time history.
#[must_use]
pub fn time_history(has_excluded_samples: bool) -> Vec<LegendView> {
    let mut legend = vec![
        LegendView::new(key(24, &line(MEASURED_COLOUR, "", 4.0)), "measured"),
        LegendView::new(key(24, &line(INK, "", 1.4)), "computed; residual, input"),
    ];
    if has_excluded_samples {
        let dot = format!(r#"<rect x="3" y="3" width="6" height="6" fill="{EXCLUDED_COLOUR}"/>"#);
        legend.push(LegendView::new(key(12, &dot), "left out of the cost"));
    }
    legend
}

/// Legend of a maneuver that was flown again, with times outside the tolerance and those that another quantity
/// excuses.
#[must_use]
pub fn flown_again(has_outside: bool, has_excused: bool) -> Vec<LegendView> {
    let tube = format!(
        r#"<rect x="0" y="1" width="24" height="10" fill="{TOLERANCE_AREA}" stroke="{TOLERANCE_LIMIT}"/>"#
    );
    let mut legend = vec![
        LegendView::new(key(24, &line(MEASURED_COLOUR, "", 4.0)), "measured"),
        LegendView::new(key(24, &line(INK, "", 1.4)), "flown again"),
        LegendView::new(key(24, &tube), "tolerance"),
    ];
    if has_outside {
        let bar = format!(
            r#"<rect width="24" height="12" fill="{OUTSIDE_COLOUR}" fill-opacity=".15"/><rect y="7" width="24" height="5" fill="{OUTSIDE_COLOUR}"/>"#
        );
        legend.push(LegendView::new(key(24, &bar), "outside"));
    }
    if has_excused {
        let bar = format!(
            r##"<rect x=".5" y="6.5" width="23" height="5" fill="#ffffff" stroke="{OUTSIDE_COLOUR}"/>"##
        );
        let label = "outside, but another quantity meets the requirement";
        legend.push(LegendView::new(key(24, &bar), label));
    }
    legend
}
