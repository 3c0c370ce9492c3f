//! Assignment of markers and filter tokens to maneuver classes, the same throughout the report.

use std::collections::BTreeSet;

use crate::aero::Axis;
use crate::report::contents::Contents;
use crate::report::figure::marker::Marker;

/// Classes in the order of the configuration, axis by axis, with their markers.
#[derive(Clone, Debug)]
pub struct ClassMarkers<'a> {
    classes: Vec<(&'a str, Marker)>,
}

impl<'a> ClassMarkers<'a> {
    /// Assigns a marker to each configured class, then to each class that occurs in a maneuver only.
    #[must_use]
    pub fn new(contents: &Contents<'a>) -> ClassMarkers<'a> {
        let mut markers = ClassMarkers { classes: vec![] };
        for axis in [Axis::Longitudinal, Axis::Lateral] {
            let configured = contents
                .classes
                .iter()
                .filter(|c| c.axis == axis)
                .map(|c| c.name.as_str());
            let flown: BTreeSet<&str> = contents
                .maneuvers
                .iter()
                .filter(|m| m.axis == axis)
                .map(|m| m.class.as_str())
                .collect();
            for class in configured.chain(flown) {
                markers.add(class);
            }
        }
        markers
    }

    fn add(&mut self, class: &'a str) {
        if self.position(class).is_none() {
            self.classes.push((class, Marker::nth(self.classes.len())));
        }
    }

    fn position(&self, class: &str) -> Option<usize> {
        self.classes.iter().position(|(name, _)| *name == class)
    }

    /// Adds classes that occur in estimates only.
    #[must_use]
    pub fn with<'b>(&self, classes: impl Iterator<Item = &'b str>) -> ClassMarkers<'b>
    where
        'a: 'b,
    {
        let mut all = ClassMarkers {
            classes: self.classes.clone(),
        };
        for class in classes {
            all.add(class);
        }
        all
    }

    pub fn iter(&self) -> impl Iterator<Item = (&'a str, Marker)> {
        self.classes.iter().copied()
    }

    /// Key of a class in a legend; empty for an unknown class.
    #[must_use]
    pub fn key(&self, class: &str) -> String {
        self.position(class)
            .map_or_else(String::new, |i| self.classes[i].1.key())
    }

    /// Word by which the page hides a class: it needs no escaping. Empty for an unknown class.
    #[must_use]
    pub fn token(&self, class: &str) -> String {
        self.position(class)
            .map_or_else(String::new, |i| format!("c{}", i + 1))
    }
}
