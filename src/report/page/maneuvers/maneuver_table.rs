//! Table of all maneuvers with flight condition and outcome of the fit.

use std::collections::BTreeMap;

use super::maneuver_page;
use crate::maneuver::Maneuver;
use crate::report::contents::Contents;
use crate::report::notation::{DASH, fixed, number, outcome_in_words};
use crate::report::page::classes::class_markers::ClassMarkers;
use crate::report::table_view::TableView;
use crate::tables::{FitRow, Outcome};

const HEADS: [&str; 14] = [
    "maneuver",
    "flight",
    "class",
    "time, s",
    "α, deg",
    "Mach",
    "q̄, psf",
    "outcome",
    "iterations",
    "first J",
    "last J",
    "condition",
    "left out, %",
    "reason",
];

/// A row per maneuver, linked to its page where it has one.
#[must_use]
pub fn table(contents: &Contents, markers: &ClassMarkers) -> TableView {
    let fits = contents.fits_by_maneuver();
    let anchors = maneuver_page::anchors(contents);
    let rows = contents
        .maneuvers
        .iter()
        .map(|maneuver| row(maneuver, &fits))
        .collect();
    let mut table = TableView::new("Maneuvers", &pages_note(contents), &HEADS, rows);
    table.links = contents
        .maneuvers
        .iter()
        .map(|m| anchors.get(m.maneuver_id.as_str()).cloned())
        .map(Option::unwrap_or_default)
        .collect();
    table.classes = contents
        .maneuvers
        .iter()
        .map(|m| markers.token(&m.class))
        .collect();
    table
}

fn row(maneuver: &Maneuver, fits: &BTreeMap<&str, &FitRow>) -> Vec<String> {
    let mut cells = vec![
        maneuver.maneuver_id.clone(),
        maneuver.flight_id.clone(),
        maneuver.class.clone(),
        format!(
            "{}\u{2013}{}",
            fixed(maneuver.start_s, 1),
            fixed(maneuver.end_s, 1)
        ),
        fixed(maneuver.alpha_deg, 1),
        fixed(maneuver.mach, 3),
        fixed(maneuver.qbar_psf, 1),
    ];
    match fits.get(maneuver.maneuver_id.as_str()) {
        Some(fit) => cells.extend(fit_cells(fit)),
        None => cells.extend(
            ["no fit"]
                .into_iter()
                .chain([DASH; 5])
                .chain([""])
                .map(str::to_owned),
        ),
    }
    cells
}

fn fit_cells(fit: &FitRow) -> [String; 7] {
    // Beside a converged fit, a reason would be noise.
    let reason = if fit.outcome == Outcome::Converged {
        String::new()
    } else {
        fit.reason.clone()
    };
    [
        outcome_in_words(fit.outcome).to_owned(),
        fit.iterations.to_string(),
        number(fit.initial_cost, 3),
        number(fit.final_cost, 3),
        number(fit.condition_number, 3),
        fit.left_out
            .map_or_else(|| DASH.to_owned(), |share| fixed(100.0 * share, 2)),
        reason,
    ]
}

/// Note for a campaign in which some maneuvers have no page; empty otherwise.
fn pages_note(contents: &Contents) -> String {
    let (all, with_page) = (contents.maneuvers.len(), contents.pages.len());
    if with_page >= all {
        return String::new();
    }
    format!(
        "{with_page} of {all} maneuvers have a page below: the representative of each class, those \
         that changed since the night before, those that failed, and an even selection of the \
         others; `harvest show maneuver` draws any of them"
    )
}
