//! Marks of flagged samples and of tolerances in strips: their appearance and paths.

use super::style::{EXCLUDED_COLOUR, OUTSIDE_COLOUR, TOLERANCE_AREA, TOLERANCE_LIMIT};
use super::svg_writer::{PathStyle, coordinate, rectangle};

/// Appearance of a tolerance: an area with its outline, which is its limits.
pub const TUBE_STYLE: PathStyle<'static> = PathStyle {
    stroke: Some((TOLERANCE_LIMIT, 0.6)),
    dash: "",
    fill: Some(TOLERANCE_AREA),
    fill_opacity: None,
};

/// Appearance of times outside a tolerance.
pub const OUTSIDE_STYLE: PathStyle<'static> = PathStyle {
    stroke: None,
    dash: "",
    fill: Some(OUTSIDE_COLOUR),
    fill_opacity: Some(0.15),
};

/// Appearance of the bar of times outside a tolerance that another quantity excuses.
pub const EXCUSED_STYLE: PathStyle<'static> = PathStyle {
    stroke: Some((OUTSIDE_COLOUR, 0.8)),
    dash: "",
    fill: Some("#ffffff"),
    fill_opacity: None,
};

/// Height of the bar of times outside a tolerance.
pub const OUTSIDE_BAR: f64 = 6.0;

/// Appearance of missing samples.
pub const MISSING_STYLE: PathStyle<'static> = PathStyle {
    stroke: Some((EXCLUDED_COLOUR, 0.8)),
    dash: "",
    fill: Some("#ffffff"),
    fill_opacity: None,
};

/// Least width of a mark that can be seen.
pub const LEAST_MARK_WIDTH: f64 = 1.6;

/// Path data of the mark of bridged samples.
#[must_use]
pub fn bridged_mark((left, right): (f64, f64), bottom: f64) -> String {
    let width = (right - left).max(LEAST_MARK_WIDTH);
    rectangle((left, bottom - 8.0), (width, 8.0))
}

/// Path data of the mark of a replaced spike.
#[must_use]
pub fn despiked_mark(x: f64, top: f64) -> String {
    format!("M{} {}h8l-4 8z", coordinate(x - 4.0), coordinate(top))
}

/// Path data of the mark of missing samples.
#[must_use]
pub fn missing_mark((left, right): (f64, f64), bottom: f64) -> String {
    let width = (right - left).max(LEAST_MARK_WIDTH);
    rectangle((left, bottom - 4.0), (width, 4.0))
}
