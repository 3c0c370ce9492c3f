//! Evidence for a class besides its required inputs, and the resulting confidence.
//!
//! The weights are judgements; their product is the confidence. They order classes that fit alike,
//! and the confidence of a maneuver is published; nothing else depends on them.

use super::patterns;
use super::segment::Segment;
use crate::maneuver::{Class, Recognised};

/// Weight of a flag that contradicts the class. Flags may be stuck, missing or late, so it takes three of them
/// to halve the confidence (0.8³ = 0.51).
const FLAG_CONTRADICTS: f64 = 0.8;

/// Weight of a flag that is not recorded: a quarter of the loss of a contradiction. A class without
/// its flag thus comes before a class that a flag contradicts.
const FLAG_NOT_RECORDED: f64 = 0.95;

/// Weight of a signal whose motion is neither clear nor absent, or is not recorded. It is half the
/// loss of a contradiction, since either outcome is open.
const MOTION_UNCLEAR: f64 = 0.9;

/// Weight of a record without pilot controls. All classes have it alike, so it lowers the published confidence
/// and leaves their order.
const PILOT_NOT_RECORDED: f64 = 0.9;

/// Loss of weight of pulses that deviate by the whole tolerance. There the pulses may as well
/// belong to another class; beyond it they do not count at all.
const PULSES_AT_TOLERANCE: f64 = 0.5;

/// One finding for or against a class.
struct Finding {
    weight: f64,
    words: String,
}

impl Finding {
    fn new(weight: f64, words: String) -> Finding {
        Finding { weight, words }
    }
}

/// Confidence in a class, from 0 to 1.
pub(super) fn confidence(segment: &Segment, class: &Class) -> f64 {
    product(&findings(segment, class))
}

fn product(findings: &[Finding]) -> f64 {
    findings.iter().map(|finding| finding.weight).product()
}

/// The inputs, followers, confidence and evidence of a maneuver of a class in a segment.
pub(super) fn recognised(
    segment: &Segment,
    class: &Class,
    (first_s, last_s): (f64, f64),
) -> Recognised {
    let inputs = segment.inputs(class);
    let findings = findings(segment, class);
    let words: Vec<&str> = findings.iter().map(|f| f.words.as_str()).collect();
    Recognised {
        first_input_s: Some(first_s),
        last_input_s: Some(last_s),
        inputs: segment.count_in_words(inputs.iter().copied()),
        followed: segment.followers(&inputs),
        confidence: Some(product(&findings)),
        evidence: words.join("; "),
    }
}

fn findings(segment: &Segment, class: &Class) -> Vec<Finding> {
    let mut findings = flag_findings(segment, class);
    for (signal, wanted) in &class.recognition.moves {
        let does = if *wanted { "moves" } else { "rests" };
        findings.push(match segment.moves(signal) {
            Some(_) => Finding::new(1.0, format!("{signal} {does}")),
            None => Finding::new(
                MOTION_UNCLEAR,
                format!("{signal} neither moves nor rests clearly"),
            ),
        });
    }
    for (signal, pulses) in &class.recognition.pulses {
        if let Ok(fit) = patterns::fit_pulses(&segment.steps_of(signal), pulses) {
            findings.push(Finding::new(
                1.0 - PULSES_AT_TOLERANCE * fit.deviation / pulses.tolerance,
                format!("{signal} pulses of {:.2} s the unit", fit.unit_s),
            ));
        }
    }
    if !segment.detections.pilot_is_recorded {
        let words =
            "no pilot control is recorded: steps of surfaces stand for the pilot's".to_owned();
        findings.push(Finding::new(PILOT_NOT_RECORDED, words));
    }
    findings
}

fn flag_findings(segment: &Segment, class: &Class) -> Vec<Finding> {
    let finding = |(flag, wanted): (&String, &bool)| {
        let position = |up: bool| if up { "up" } else { "down" };
        match segment.flag_is_up(flag) {
            Some(up) if up == *wanted => Finding::new(1.0, format!("{flag} is {}", position(up))),
            Some(up) => Finding::new(
                FLAG_CONTRADICTS,
                format!("although {flag} is {}", position(up)),
            ),
            None => Finding::new(FLAG_NOT_RECORDED, format!("{flag} is not recorded")),
        }
    };
    class.recognition.flags.iter().map(finding).collect()
}
