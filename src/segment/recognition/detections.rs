//! Detections in a record: steps, deflections, uncommanded steps of surfaces, excitation flag.
//!
//! The on-board excitation system moves surfaces while the pilot's controls rest. A surface that
//! steps while a control moves is geared to it. A surface that steps soon after the pilot responds
//! through feedback. The other steps of surfaces are uncommanded by the pilot: they distinguish
//! excitation from ordinary flying without any flag.

use crate::flight::Record;
use crate::flight::signal::FLAG_UP;
use crate::segment::noisy_controls::ControlNoise;
use crate::segment::settings::Settings;
use crate::segment::steps::detection;
use crate::segment::steps::hidden_halves::add_hidden_halves_of_all;
use crate::segment::steps::step::{SignalSteps, Steps};

/// Detections in one record, with the record and the settings used.
#[derive(Clone, Debug)]
pub(in crate::segment) struct Detections<'a> {
    pub record: &'a Record,
    pub settings: &'a Settings,
    /// Every step.
    pub steps: Steps,
    /// Every step and every smaller deflection.
    pub deflections: Steps,
    /// The steps of surfaces that no pilot control explains.
    pub uncommanded: Steps,
    /// `true` if one of the pilot's controls is recorded. Otherwise the pilot's inputs cannot be
    /// separated from the system's.
    pub pilot_is_recorded: bool,
    control_noise: &'a ControlNoise<'a>,
    /// `true` if the excitation flag is recorded and not stuck.
    flag_varies: bool,
    /// Times during which a varying flag is down between two times that it is up, of at least the
    /// shortest pause.
    pub flag_gaps: Vec<(f64, f64)>,
}

impl<'a> Detections<'a> {
    pub fn of(
        record: &'a Record,
        settings: &'a Settings,
        control_noise: &'a ControlNoise,
    ) -> Detections<'a> {
        let (steps, deflections) = detection::detect(record, settings);
        let is_recorded = |name: &String| {
            record
                .values(name)
                .is_some_and(|v| v.iter().any(|v| v.is_finite()))
        };
        let flag = record.values(&settings.excitation_flag).unwrap_or_default();
        let mut detections = Detections {
            record,
            settings,
            steps,
            deflections,
            uncommanded: Steps::default(),
            pilot_is_recorded: settings.pilot_controls.iter().any(is_recorded),
            control_noise,
            flag_varies: varies(flag),
            flag_gaps: gaps(flag, record, settings.shortest_pause_s),
        };
        let mut uncommanded = detections.uncommanded_steps();
        add_hidden_halves_of_all(&mut uncommanded, &detections.deflections, settings);
        detections.uncommanded = uncommanded;
        detections
    }

    /// The steps of surfaces without those that a pilot control explains.
    fn uncommanded_steps(&self) -> Steps {
        let uncommanded = |all: &SignalSteps| SignalSteps {
            steps: all
                .steps
                .iter()
                .filter(|s| !self.pilot_explains(s.time_s))
                .copied()
                .collect(),
            ..*all
        };
        let surfaces = self
            .steps
            .by_signal
            .iter()
            .filter(|(signal, _)| !self.is_pilot_control(signal));
        Steps {
            by_signal: surfaces
                .map(|(signal, all)| (signal.clone(), uncommanded(all)))
                .collect(),
        }
    }

    pub fn is_pilot_control(&self, signal: &str) -> bool {
        self.settings.pilot_controls.iter().any(|c| c == signal)
    }

    /// `true` if a pilot control moves at a time, or has stepped shortly before it while no flag
    /// indicates that the on-board system is active.
    fn pilot_explains(&self, time_s: f64) -> bool {
        let system_works = self.flag_is_up_at(time_s);
        self.settings.pilot_controls.iter().any(|control| {
            !system_works && self.steps_before(control, time_s) || self.moves_at(control, time_s)
        })
    }

    /// `true` if a control has stepped so shortly before a time that feedback may still respond.
    fn steps_before(&self, control: &str, time_s: f64) -> bool {
        let settings = self.settings;
        let (from_s, to_s) = (time_s - settings.answer_s, time_s + settings.transit_s);
        !self.steps.between(control, from_s, to_s).is_empty()
    }

    /// `true` if a control moves at a time by enough to move a surface that is geared to it.
    fn moves_at(&self, control: &str, time_s: f64) -> bool {
        let settings = self.settings;
        let geared_s = (time_s - settings.gearing_s, time_s + settings.transit_s);
        let noise = self.control_noise.get(control).copied().unwrap_or(0.0);
        let smallest = settings.geared_share * self.steps.smallest(control);
        detection::largest_change(self.record, control, settings, geared_s)
            >= smallest.max(settings.steps_over_noise * noise)
    }

    /// `true` if a varying flag is up at a time.
    fn flag_is_up_at(&self, time_s: f64) -> bool {
        let values = self
            .record
            .values(&self.settings.excitation_flag)
            .unwrap_or_default();
        self.flag_varies
            && values
                .get(self.record.sample_at(time_s))
                .is_some_and(|v| *v > FLAG_UP)
    }

    /// `true` if a flag is up for most of the time; `None` if it is not recorded.
    pub fn flag_is_mostly_up(&self, flag: &str, (from_s, to_s): (f64, f64)) -> Option<bool> {
        let record = self.record;
        let (first, last) = (record.sample_at(from_s), record.sample_at(to_s));
        let values = record.values(flag)?.get(first..=last)?;
        let finite = values.iter().filter(|v| v.is_finite()).count();
        let up = values.iter().filter(|v| **v > FLAG_UP).count();
        (finite > 0).then_some(2 * up > finite)
    }

    /// Number of steps of all pilot controls from one time to another.
    pub fn count_pilot_steps(&self, from_s: f64, to_s: f64) -> usize {
        self.settings
            .pilot_controls
            .iter()
            .map(|c| self.steps.between(c, from_s, to_s).len())
            .sum()
    }
}

/// `true` for a flag that is up in some samples and down in others.
fn varies(flag: &[f64]) -> bool {
    let mut up = flag.iter().filter(|v| v.is_finite()).map(|v| *v > FLAG_UP);
    up.next().is_some_and(|first| up.any(|v| v != first))
}

/// Times during which a flag is down between two times that it is up, of at least a pause.
fn gaps(flag: &[f64], record: &Record, pause_s: f64) -> Vec<(f64, f64)> {
    let finite: Vec<(usize, bool)> = flag
        .iter()
        .enumerate()
        .filter(|(_, v)| v.is_finite())
        .map(|(k, v)| (k, *v > FLAG_UP))
        .collect();
    let runs: Vec<&[(usize, bool)]> = finite.chunk_by(|a, b| a.1 == b.1).collect();
    let inner = runs
        .get(1..runs.len().saturating_sub(1))
        .unwrap_or_default();
    let down = inner
        .iter()
        .filter(|run| run.first().is_some_and(|(_, up)| !up));
    let spans =
        down.filter_map(|run| Some((record.time_s(run.first()?.0), record.time_s(run.last()?.0))));
    spans
        .filter(|(from_s, to_s)| to_s - from_s >= pause_s)
        .collect()
}
