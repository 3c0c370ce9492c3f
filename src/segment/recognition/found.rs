//! Results of recognition: maneuvers found, and excitation that fits no class.

use crate::maneuver::{Class, Recognised, UnclassifiedExcitation};

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
pub(in crate::segment) struct RecognitionResult<'a> {
    pub found: Vec<FoundManeuver<'a>>,
    pub unknown: Vec<UnclassifiedExcitation>,
}

impl<'a> RecognitionResult<'a> {
    pub fn add(&mut self, more: RecognitionResult<'a>) {
        self.found.extend(more.found);
        self.unknown.extend(more.unknown);
    }
}
