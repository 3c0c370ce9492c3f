//! Report stage: one self-contained HTML page for a flight-test review board.
//!
//! The page holds inline SVG, its style and one small script that it can do without; it loads
//! nothing. [`crate::pdf`] sets the same page on paper. Rust makes the values, the template
//! `report.html` their order and appearance.
//!
//! In the order of use: `contents` (the input), `figure` (SVG), `page` (the sections) and
//! `strip_chart` (the pictures of `harvest show`).

#[cfg(test)]
mod campaign_fixture;
mod contents;
mod figure;
mod history;
mod notation;
mod page;
mod page_selection;
mod provenance;
mod recording_page;
pub mod strip_chart;
mod table_view;
#[cfg(test)]
mod tests;

use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment};

pub use contents::{ConfiguredClass, Contents, HistoryFigure};
pub use history::thinned;
pub use notation::{
    angle, count, fixed, number, power_of_ten, symbol, unit, well_formed, without_unit,
};
use page::Page;
pub use page::draw_history;
pub use page_selection::{maneuvers_with_page, representatives};
pub use provenance::{Provenance, SourceFile};
pub use recording_page::recording_page;

/// Renders the report page.
///
/// `template` replaces the built-in one and receives the same values.
///
/// # Errors
/// An error of the template, with its line.
pub fn html(contents: &Contents, template: Option<&str>) -> Result<String, String> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment
        .render_named_str(
            "report.html",
            template.unwrap_or(include_str!("report.html")),
            Serde(&Page::new(contents)),
        )
        .map(well_formed)
        .map_err(|error| format!("the report's template: {error:#}"))
}
