//! Results of recognition: maneuvers found, and excitation that fits no class.

use crate::maneuver::{Class, Recognised, Unknown};

/// A maneuver's class and the times of its first and last input, s on the record's clock.
#[derive(Clone, Debug)]
pub(in crate::segment) struct FoundManeuver<'a> {
    pub class: &'a Class,
    pub first_s: f64,
    pub last_s: f64,
    pub recognised: Recognised,
}

impl FoundManeuver<'_> {
    /// Duration of the inputs.
    pub fn excited_for_s(&self) -> f64 {
        self.last_s - self.first_s
    }

    /// Appends words to the evidence for the class.
    pub fn add_evidence(&mut self, words: &str) {
        let evidence = &mut self.recognised.evidence;
        if !evidence.is_empty() {
            evidence.push_str("; ");
        }
        evidence.push_str(words);
    }
}

/// Recognition of a record or of one sequence of its steps.
#[derive(Clone, Debug, Default)]
pub(in crate::segment) struct Recognition<'a> {
    pub found: Vec<FoundManeuver<'a>>,
    pub unknown: Vec<Unknown>,
}

impl<'a> Recognition<'a> {
    pub fn add(&mut self, more: Recognition<'a>) {
        self.found.extend(more.found);
        self.unknown.extend(more.unknown);
    }

    /// Sorts the maneuvers by time and removes overlaps.
    ///
    /// Keeps the longer of two excitations whose inputs overlap. Excitation of no class is
    /// removed if it overlaps a maneuver, or longer excitation of no class, of which it is a part.
    pub fn remove_overlaps(&mut self) {
        self.found
            .sort_by(|a, b| b.excited_for_s().total_cmp(&a.excited_for_s()));
        let mut found: Vec<FoundManeuver> = Vec::new();
        for f in self.found.drain(..) {
            let overlaps =
                |other: &FoundManeuver| f.first_s <= other.last_s && f.last_s >= other.first_s;
            if !found.iter().any(overlaps) {
                found.push(f);
            }
        }
        found.sort_by(|a, b| a.first_s.total_cmp(&b.first_s));
        self.unknown
            .sort_by(|a, b| (b.end_s - b.start_s).total_cmp(&(a.end_s - a.start_s)));
        let mut unknown: Vec<Unknown> = Vec::new();
        for u in self.unknown.drain(..) {
            let overlaps = |from_s: f64, to_s: f64| u.start_s <= to_s && u.end_s >= from_s;
            if !found.iter().any(|f| overlaps(f.first_s, f.last_s))
                && !unknown.iter().any(|o| overlaps(o.start_s, o.end_s))
            {
                unknown.push(u);
            }
        }
        unknown.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
        (self.found, self.unknown) = (found, unknown);
    }
}
