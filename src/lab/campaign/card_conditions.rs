//! Checks of the conditions of test cards: test points, masses, limits of the next flight.

use super::cards::Cards;
use super::next_flight::FlightLimits;
use super::test_point::TestPoint;
use crate::config::Source;
use crate::error::{Result, did_you_mean};

/// Smallest and largest scale of the inputs, of either sign.
const SCALES: std::ops::RangeInclusive<f64> = 0.01..=10.0;

/// Largest ratio of a mass to those of the loadings, either way: beyond it their line extrapolates too far.
/// A pound or a kilogram for a slug is more.
const MASS_RATIO: f64 = 2.0;

/// Checks the conditions of all cards.
///
/// # Errors
/// [`crate::error::Error`] with file, line and the probable meaning of the first mistake.
pub(super) fn check(cards: &Cards, source: &Source) -> Result<()> {
    for (name, flight) in &cards.flights {
        points(&flight.points, source, &["flights", name])?;
        mass(cards, flight.mass_slug, source, &["flights", name])?;
    }
    let next = &cards.next;
    points(&next.candidates, source, &["next", "candidates"])?;
    if let Some(mass_slug) = next.mass_slug {
        mass(cards, mass_slug, source, &["next"])?;
    }
    limits(&next.limits, cards, source)
}

/// Checks the test points under a path of keys.
fn points(points: &[TestPoint], source: &Source, path: &[&str]) -> Result<()> {
    for (place, point) in points.iter().enumerate() {
        let error = |name: &str, what: &str| {
            let what = format!("{}: {what}", point.class);
            Err(source.error_in_entry(path, ("class", place), name, what))
        };
        if point.alpha_deg.is_empty() {
            return error("alpha_deg", "`alpha_deg` lists no angle of attack");
        }
        if !SCALES.contains(&point.scale.abs()) {
            let (least, most) = (SCALES.start(), SCALES.end());
            let scale = point.scale;
            let what = format!(
                "`scale` must lie between {least} and {most}, or with the other sign, not {scale}"
            );
            return error("scale", &what);
        }
    }
    Ok(())
}

/// Checks a mass against those of the loadings.
fn mass(cards: &Cards, mass_slug: f64, source: &Source, path: &[&str]) -> Result<()> {
    let loadings = cards
        .aircraft
        .loadings
        .iter()
        .map(|loading| loading.mass_slug);
    let (lowest, highest) = loadings.fold((f64::INFINITY, 0.0_f64), |(low, high), own| {
        (low.min(own), high.max(own))
    });
    if (lowest / MASS_RATIO..=highest * MASS_RATIO).contains(&mass_slug) || lowest > highest {
        return Ok(());
    }
    let what = format!(
        "`mass_slug` is {mass_slug}, but the loadings are of {lowest} to {highest} slug: is it in another unit?"
    );
    let path: Vec<String> = path.iter().map(|key| (*key).to_owned()).collect();
    let path = [path, vec!["mass_slug".to_owned()]].concat();
    Err(source.error_at(&path, what))
}

/// Checks that limits are ranges, and that each rate is of a surface of the cards' aircraft.
fn limits(limits: &FlightLimits, cards: &Cards, source: &Source) -> Result<()> {
    let at = |name: &str| ["next", "limits", name].map(str::to_owned);
    let ranges = [
        ("alpha_deg", limits.alpha_deg),
        ("an_g", limits.an_g),
        ("qbar_psf", limits.qbar_psf),
    ];
    for (name, range) in ranges {
        if let Some((low, high)) = range
            && low >= high
        {
            let what =
                format!("`{name}` must be a lowest and a higher value, not {low} and {high}");
            return Err(source.error_at(&at(name), what));
        }
    }
    let surfaces = &cards.aircraft.surfaces;
    for (name, rate) in &limits.surface_rates_deg_s {
        let mut path = at("surface_rates_deg_s").to_vec();
        path.push(name.clone());
        if !surfaces.contains_key(name) {
            let near = did_you_mean(name, surfaces.keys().map(String::as_str));
            let what = format!(
                "`surface_rates_deg_s`: the aircraft of the cards has no surface `{name}`{near}"
            );
            return Err(source.error_at(&path, what));
        }
        if *rate <= 0.0 {
            let what = format!("the highest rate of `{name}` must be above 0, not {rate}");
            return Err(source.error_at(&path, what));
        }
    }
    Ok(())
}
