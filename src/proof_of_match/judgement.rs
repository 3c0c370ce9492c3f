//! Judgement of a free run by the tolerances.

use super::dutch_roll::DutchRoll;
use super::free_run::FreeRun;
use super::maneuver_recording::ManeuverRecording;
use super::outputs::output_index;
use super::specification::{Test, Tolerance};
use crate::tables::MatchVerdict;

/// Finding about one tolerance.
#[derive(Clone, Debug, PartialEq)]
pub struct ToleranceFinding {
    pub test: String,
    pub subject: String,
    /// Number of the requirement within its test, from one.
    pub requirement: usize,
    /// Number of the requirement among those of all tests of the maneuver.
    place: usize,
    pub tolerance: Tolerance,
    /// Value of the Dutch roll's quantity in flight and by the model; `None` for a time history.
    pub flight_value: Option<f64>,
    pub model_value: Option<f64>,
    pub samples: usize,
    pub inside_pct: f64,
    /// Largest distance beyond the tolerance, with its time; `None` if the simulated aircraft
    /// departs.
    pub largest_excess: Option<(f64, f64)>,
    /// Margin to the tolerance; minus infinity if the simulated aircraft departs.
    pub margin: f64,
}

impl ToleranceFinding {
    #[must_use]
    pub fn verdict(&self) -> MatchVerdict {
        verdict(self.margin)
    }
}

/// Verdict of a margin.
#[must_use]
pub fn verdict(margin: f64) -> MatchVerdict {
    if margin >= 0.0 {
        MatchVerdict::Inside
    } else {
        MatchVerdict::Outside
    }
}

/// A tolerance that can be judged.
#[derive(Clone, Copy, Debug)]
pub struct Judged<'a> {
    pub test: &'a Test,
    /// Number of the requirement within its test, from one.
    pub requirement: usize,
    /// Number of the requirement among those of all tests of the maneuver.
    place: usize,
    pub tolerance: Tolerance,
}

impl Judged<'_> {
    /// `true` for alternatives of one requirement.
    #[must_use]
    pub fn is_alternative(&self, other: &Judged) -> bool {
        self.place == other.place
    }
}

/// Tolerances of some tests that can be judged. Tolerances of the Dutch roll are left out if it is
/// not available.
#[must_use]
pub fn judged<'a>(tests: &[&'a Test], has_dutch_roll: bool) -> Vec<Judged<'a>> {
    let requirements = tests.iter().flat_map(|test| {
        let own = (1..).zip(&test.all_of);
        own.map(move |(number, requirement)| (*test, number, requirement))
    });
    let all = requirements
        .enumerate()
        .flat_map(|(place, (test, number, own))| {
            own.one_of.iter().map(move |tolerance| Judged {
                test,
                requirement: number,
                place,
                tolerance: *tolerance,
            })
        });
    all.filter(|j| has_dutch_roll || !j.tolerance.quantity.is_of_dutch_roll())
        .collect()
}

/// Outcome of a model's simulation: the run, and the Dutch roll of flight and model.
#[derive(Clone, Debug)]
pub struct Simulated {
    pub run: FreeRun,
    pub flight: Option<DutchRoll>,
    pub model: Option<DutchRoll>,
}

/// Judges a simulation. `required_pct` of the samples must be inside.
#[must_use]
pub fn judge(
    recording: &ManeuverRecording,
    simulated: &Simulated,
    judged: &[Judged],
    required_pct: f64,
) -> Vec<ToleranceFinding> {
    let finding = |own: &Judged| {
        let tolerance = &own.tolerance;
        let differences = if tolerance.quantity.is_of_dutch_roll() {
            simulated.difference(tolerance).into_iter().collect()
        } else {
            differences(recording, &simulated.run, tolerance)
        };
        ToleranceFinding {
            test: own.test.test.clone(),
            subject: own.test.subject.clone(),
            requirement: own.requirement,
            place: own.place,
            tolerance: *tolerance,
            flight_value: simulated.flight.and_then(|f| f.value(tolerance.quantity)),
            model_value: simulated.model.and_then(|m| m.value(tolerance.quantity)),
            samples: differences.len(),
            inside_pct: inside_pct(&differences),
            largest_excess: largest_excess(&differences),
            margin: margin(&differences, required_pct),
        }
    };
    judged.iter().map(finding).collect()
}

impl Simulated {
    /// Difference of a quantity of the Dutch roll; `None` if the flight has none.
    fn difference(&self, tolerance: &Tolerance) -> Option<Difference> {
        let flight = self.flight?.value(tolerance.quantity)?;
        let model = self.model.and_then(|model| model.value(tolerance.quantity));
        Some(Difference {
            time_s: f64::NAN,
            size: model.map_or(f64::INFINITY, |model| (model - flight).abs()),
            width: tolerance.width(flight),
        })
    }
}

/// Best alternative of the requirement with the smallest margin; `None` without findings.
#[must_use]
pub fn decisive(findings: &[ToleranceFinding]) -> Option<&ToleranceFinding> {
    let requirements = findings.chunk_by(|a, b| a.place == b.place);
    let best =
        requirements.filter_map(|own| own.iter().max_by(|a, b| a.margin.total_cmp(&b.margin)));
    best.min_by(|a, b| a.margin.total_cmp(&b.margin))
}

/// Difference of one sample from the measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Difference {
    time_s: f64,
    /// Infinite after a departure.
    size: f64,
    width: f64,
}

impl Difference {
    /// Size of the difference over the width of the tolerance.
    fn ratio(&self) -> f64 {
        self.size / self.width
    }
}

fn differences(
    recording: &ManeuverRecording,
    run: &FreeRun,
    tolerance: &Tolerance,
) -> Vec<Difference> {
    let Some(output) = output_index(tolerance.quantity) else {
        return vec![];
    };
    let counts = |sample: &usize| !recording.repaired[*sample][output];
    let at = |sample: usize| {
        let measured = recording.measured[sample][output];
        let computed = run.outputs.get(sample).map(|outputs| outputs[output]);
        Difference {
            time_s: recording.start_s + sample as f64 * recording.step_s,
            size: computed.map_or(f64::INFINITY, |computed| (computed - measured).abs()),
            width: tolerance.width(measured),
        }
    };
    (0..recording.samples).filter(counts).map(at).collect()
}

fn inside_pct(differences: &[Difference]) -> f64 {
    let inside = differences.iter().filter(|d| d.size <= d.width).count();
    100.0 * inside as f64 / differences.len().max(1) as f64
}

fn largest_excess(differences: &[Difference]) -> Option<(f64, f64)> {
    let excess = differences.iter().map(|d| (d.size - d.width, d.time_s));
    let largest = excess.max_by(|a, b| a.0.total_cmp(&b.0));
    largest.filter(|(excess, _)| excess.is_finite())
}

/// Number of samples that may be outside, given the share that must be inside.
#[must_use]
pub fn allowed_outside(samples: usize, required_pct: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a count"
    )]
    let required = (0.01 * required_pct * samples as f64 - 1e-9)
        .ceil()
        .max(1.0) as usize;
    samples.saturating_sub(required)
}

/// One minus the smallest ratio that the required share of the samples does not exceed.
fn margin(differences: &[Difference], required_pct: f64) -> f64 {
    let mut ratios: Vec<f64> = differences.iter().map(Difference::ratio).collect();
    ratios.sort_by(f64::total_cmp);
    ratios.truncate(ratios.len() - allowed_outside(ratios.len(), required_pct));
    ratios.last().map_or(f64::NEG_INFINITY, |ratio| 1.0 - ratio)
}
