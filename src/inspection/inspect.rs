//! Inspection of recordings: search for the channels, then a finding for each column.

use std::collections::BTreeSet;

use super::channels::{
    constant_channel, input_unit, plain_channel, rounded, suffix, temperature_channel,
    time_channel, unless_shared, unless_unknown_unit,
};
use super::clock::{find_clock, uneven_clock};
use super::controls::inputs::{InputColumn, inputs, kind_of, rate};
use super::controls::steps::{Excursions, InputActivity, steps};
use super::findings::{Channel, Inspection, Role, Unused};
use super::grid::Grid;
use super::mach_airspeed::{with_airspeed, without_airspeed};
use super::names::mirror_images::MirrorImages;
use super::names::vocabulary::meanings;
use super::quantity::Quantity;
use super::recording::{Recording, without_fill_values};
use super::search::assignment::{Assignment, Candidates, Search};
use super::search::certainty::verdicts;
use super::search::descent::SearchResult;
use super::search::plausible::{ColumnFacts, candidates, facts};
use crate::flight::signal;
use crate::units::{self, Unit};

/// Samples on which the search runs, and those on which its result is judged: the minutes with the
/// most motion.
const SEARCH_SAMPLES: usize = 1_500;
const JUDGED_SAMPLES: usize = 6_000;

/// Inspects recordings of one recorder.
///
/// # Errors
/// A message where no column counts time.
pub fn inspect(recordings: &[Recording]) -> Result<Inspection, String> {
    let cleaned = without_fill_values(recordings);
    let recordings = cleaned.as_deref().unwrap_or(recordings);
    match with_airspeed(recordings) {
        Some(extended) => inspect_pairs(&extended).map(without_airspeed),
        None => inspect_pairs(recordings),
    }
}

/// Inspects recordings with the half differences of mirror images in their place.
fn inspect_pairs(recordings: &[Recording]) -> Result<Inspection, String> {
    let pairs = MirrorImages::of(recordings);
    if pairs.is_empty() {
        return inspect_columns(recordings);
    }
    let mut replaced = recordings.to_vec();
    for pair in &pairs {
        replaced = pair.replaced(&replaced);
    }
    let mut inspection = inspect_columns(&replaced)?;
    for channel in &mut inspection.channels {
        if let Some(pair) = pairs.iter().find(|pair| pair.name == channel.column) {
            channel.is_sure = false;
            channel.evidence = format!("{}; {}", pair.evidence(), channel.evidence);
            channel.mirror_images = Some(pair.clone());
        }
    }
    Ok(inspection)
}

/// Inspects recordings column by column.
fn inspect_columns(recordings: &[Recording]) -> Result<Inspection, String> {
    let clock = find_clock(recordings);
    if clock.as_ref().is_none_or(|clock| !clock.is_sure)
        && let Some(reason) = uneven_clock(recordings)
    {
        return Err(reason);
    }
    let clock = clock.ok_or(
        "no column counts time: one column must rise evenly from row to row, in s, ms, us or ns; \
         `harvest import` with `--step SECONDS` adds one to recordings of a constant step",
    )?;
    let grid = Grid::of(recordings, &clock);
    let facts = facts(recordings);
    let candidates = candidates(&facts, &clock);
    let (coarse, fine) = (
        grid.liveliest(SEARCH_SAMPLES),
        grid.liveliest(JUDGED_SAMPLES),
    );
    let search = |grid| Search {
        grid,
        candidates: &candidates,
    };
    let result = search(&coarse).best();
    let assignment = &result.assignment;
    let mut channels = FoundChannels {
        facts: &facts,
        channels: vec![time_channel(&clock, &facts)],
    };
    channels.add_motion(&search(&fine), &result);
    let inputs = inputs((&fine, &grid), assignment, &facts);
    channels.add_inputs(&inputs, &grid);
    channels.add_constants();
    channels.mark_unsure_inertias();
    channels.add_flags(recordings);
    Ok(Inspection {
        unused: channels.unused(&candidates, assignment),
        channels: channels.channels,
        grid,
        step_s: clock.step_s,
    })
}

/// Channels found so far.
struct FoundChannels<'a> {
    facts: &'a [ColumnFacts],
    channels: Vec<Channel>,
}

impl FoundChannels<'_> {
    fn is_free(&self, facts: &ColumnFacts) -> bool {
        !self
            .channels
            .iter()
            .any(|channel| channel.column == facts.name)
    }

    /// Adds the channels of the motion from the result of the search.
    fn add_motion(&mut self, search: &Search, result: &SearchResult) {
        let mut verdicts = verdicts(search, result);
        for (quantity, choice) in &result.assignment {
            let Some(facts) = self.facts.iter().find(|c| c.name == choice.column) else {
                continue;
            };
            let Some(verdict) = verdicts.remove(quantity) else {
                continue;
            };
            let unit = Unit::parse(choice.unit).ok();
            let turn = unit.and_then(|u| Unit::of_signal(signal::PSI).factor_to(u));
            let is_heading = *quantity == Quantity::Psi;
            let (is_sure, evidence) = unless_unknown_unit(facts, verdict.is_sure, verdict.evidence);
            self.channels.push(Channel {
                unit: choice.unit.to_owned(),
                sign: choice.sign,
                wraps_at: turn.filter(|_| is_heading).map(|degree| 360.0 * degree),
                is_sure,
                evidence,
                ..plain_channel(facts, quantity.signal().to_owned(), Role::Motion)
            });
        }
    }

    /// Adds surfaces and pilot controls.
    fn add_inputs(&mut self, inputs: &[InputColumn], grid: &Grid) {
        let free = inputs.iter().filter_map(|input| {
            let own = self.facts.iter().find(|c| c.name == input.column);
            Some((input, own.filter(|c| self.is_free(c))?))
        });
        let free: Vec<(&InputColumn, &ColumnFacts)> = free.collect();
        let usual = self.unit_of_angles(&free);
        let excursions = free.iter().map(|(input, facts)| {
            let (unit, _) = input_unit(facts, input, usual);
            Excursions::of(grid, &input.column, input.kind, unit)
        });
        let excursions: Vec<Excursions> = excursions.collect();
        let steps = steps(&excursions);
        for (((input, facts), excursions), step) in free.into_iter().zip(&excursions).zip(&steps) {
            let channel = self.input_channel(input, facts, (excursions.moves(), step), usual);
            self.channels.push(channel);
        }
    }

    /// Degrees, if the recorder surely writes angles without a stated unit in them: its other angles then have them too.
    fn unit_of_angles(&self, inputs: &[(&InputColumn, &ColumnFacts)]) -> Option<Unit> {
        let degrees = Unit::of_signal(signal::THETA);
        let is_stated = |name: &str| {
            self.facts
                .iter()
                .any(|c| c.name == name && c.unit.is_some())
        };
        let is_angle = |c: &&Channel| {
            Unit::of_signal(&c.signal).quantity == degrees.quantity
                && c.is_sure
                && !is_stated(&c.column)
        };
        let angles = || self.channels.iter().filter(is_angle);
        let are_of_motion = angles().next().is_some() && angles().all(|c| c.unit == degrees.name);
        let is_of_surface = |(input, facts): &(&InputColumn, &ColumnFacts)| {
            facts.unit.is_none() && input_unit(facts, input, None).0.name == degrees.name
        };
        (are_of_motion || inputs.iter().any(is_of_surface)).then_some(degrees)
    }

    /// Channel of an input, which moves or not and has a step or not.
    fn input_channel(
        &self,
        input: &InputColumn,
        facts: &ColumnFacts,
        (moves, step): (bool, &InputActivity),
        usual: Option<Unit>,
    ) -> Channel {
        let (unit, stated) = input_unit(facts, input, usual);
        let kept = if unit.quantity == units::Quantity::Number {
            ""
        } else {
            suffix(unit)
        };
        let signal = self.free_name(&facts.spelling.words.join("_"), kept);
        let factor = unit.factor_to(Unit::of_signal(&signal)).unwrap_or(1.0);
        let mut evidence = input.evidence.clone();
        if !stated {
            evidence += "; its unit follows from its range alone";
        }
        let rate = rate(input.axis).signal();
        let own_rate = self.channels.iter().find(|c| c.signal == rate);
        let rate_is_sure = own_rate.is_some_and(|c| c.is_sure);
        if input.is_sure && !rate_is_sure {
            evidence = format!("{evidence}; but {rate} is not sure");
        }
        if let Some(why) = step.reason_without_step().filter(|_| moves) {
            evidence = format!("{evidence}; {why}");
        }
        let is_sure = input.is_sure && stated && rate_is_sure;
        let (is_sure, evidence) = unless_unknown_unit(facts, is_sure, evidence);
        Channel {
            unit: unit.name.to_owned(),
            sign: input.sign,
            is_sure,
            evidence,
            step: step.size().map(|size| rounded(size * factor)),
            moves,
            ..plain_channel(facts, signal, Role::Input(input.clone()))
        }
    }

    /// A signal's name that no channel has.
    fn free_name(&self, words: &str, suffix: &str) -> String {
        let is_taken = |name: &str| self.channels.iter().any(|c| c.signal == name);
        let name = format!("{words}{suffix}");
        let numbered = (2..).map(|n| format!("{words}_{n}{suffix}"));
        std::iter::once(name)
            .chain(numbered)
            .find(|name| !is_taken(name))
            .unwrap_or_default()
    }

    /// Adds signals that names and units alone give.
    fn add_constants(&mut self) {
        let others = signal::REQUIRED
            .iter()
            .filter(|name| Quantity::of_signal(name).is_none());
        for name in others.chain([&signal::AIR_TEMPERATURE]) {
            let weight = |facts: &ColumnFacts| {
                let meanings = meanings(&facts.spelling);
                meanings.into_iter().find(|m| m.0 == *name).map(|m| m.1)
            };
            let target = Unit::of_signal(name);
            let converts =
                |facts: &&ColumnFacts| facts.unit.is_none_or(|u| u.conversion_to(target).is_some());
            let free = self
                .facts
                .iter()
                .filter(|c| self.is_free(c) && c.range.is_some());
            let named = free.filter(converts).filter_map(|c| Some((weight(c)?, c)));
            let mut named: Vec<(f64, &ColumnFacts)> = named.collect();
            named.sort_by(|a, b| b.0.total_cmp(&a.0));
            let Some((best, facts)) = named.first() else {
                continue;
            };
            let channel = match *name {
                signal::AIR_TEMPERATURE => temperature_channel(facts),
                name => Some(constant_channel(facts, name)),
            };
            let rivals = named.iter().skip(1);
            let rival = rivals
                .filter(|(weight, _)| weight >= best)
                .map(|(_, c)| c)
                .next();
            self.channels
                .extend(channel.map(|own| unless_shared(own, rival.copied())));
        }
    }

    /// Marks the moments of inertia as unsure unless the moment about z is the largest, as in every
    /// aircraft. Recorders differ in the order of the axes.
    fn mark_unsure_inertias(&mut self) {
        let largest = |signal: &str| {
            let own = self.channels.iter().find(|c| c.signal == signal)?;
            let unit = Unit::parse(&own.unit).ok()?;
            Some(own.range.1 * unit.factor_to(Unit::of_signal(signal))?)
        };
        let [x, y, z] = [signal::IX, signal::IY, signal::IZ].map(largest);
        let is_largest = z.is_none_or(|z| [x, y].into_iter().flatten().all(|other| other < z));
        if is_largest {
            return;
        }
        let of_inertia =
            |c: &&mut Channel| [signal::IX, signal::IY, signal::IZ].contains(&&*c.signal);
        for channel in self.channels.iter_mut().filter(of_inertia) {
            channel.is_sure = false;
            channel.evidence +=
                "; but the largest moment of inertia of an aircraft is that about z";
        }
    }

    /// Adds columns with no values but zero and one.
    fn add_flags(&mut self, recordings: &[Recording]) {
        for facts in self.facts {
            let values = || {
                let columns = recordings.iter().filter_map(|r| r.column(&facts.name));
                columns.flat_map(|column| &column.values)
            };
            let unit = facts.unit;
            let is_number = unit.is_none_or(|u| u.quantity == units::Quantity::Number);
            #[expect(clippy::float_cmp, reason = "flags are exactly 0 or 1")]
            let is_flag = values().all(|v| v.is_nan() || *v == 0.0 || *v == 1.0)
                && [0.0, 1.0].iter().all(|level| values().any(|v| v == level));
            if is_flag && is_number && facts.range.is_some() && self.is_free(facts) {
                let name = self.free_name(&facts.spelling.words.join("_"), "");
                self.channels.push(Channel {
                    unit: "0/1".to_owned(),
                    is_sure: true,
                    evidence: "0 and 1 alone".to_owned(),
                    ..plain_channel(facts, name, Role::Flag)
                });
            }
        }
    }

    /// Columns without a signal, each with the reason.
    fn unused(&self, candidates: &Candidates, assignment: &Assignment) -> Vec<Unused> {
        let free = self.facts.iter().filter(|c| self.is_free(c));
        let unused = |facts: &ColumnFacts| Unused {
            column: facts.name.clone(),
            unit: facts
                .unit
                .map(|u| u.name.to_owned())
                .or_else(|| facts.unknown_unit.clone()),
            reason: reason(facts, candidates, assignment),
        };
        free.map(unused).collect()
    }
}

/// Reason for which a column has no signal.
fn reason(facts: &ColumnFacts, candidates: &Candidates, assignment: &Assignment) -> String {
    if facts.range.is_none() {
        return "it holds no number".to_owned();
    }
    if let Some(unit) = &facts.unknown_unit {
        return format!("harvest does not have its unit `{unit}`");
    }
    let meant: BTreeSet<&str> = meanings(&facts.spelling).into_iter().map(|m| m.0).collect();
    let better = candidates.iter().find_map(|(quantity, columns)| {
        let is_candidate = columns
            .iter()
            .any(|c| c.column == facts.name && c.weight > 0.0);
        let taken = assignment.get(quantity).filter(|_| is_candidate)?;
        Some(format!(
            "`{}` fits {} better",
            taken.column,
            quantity.signal()
        ))
    });
    match (better, meant.first()) {
        (Some(better), _) => better,
        (None, Some(signal)) if facts.is_constant() => {
            format!("it may be {signal}, but is constant")
        }
        (None, Some(signal)) => format!("it may be {signal}, but its range or unit does not fit"),
        (None, None) if facts.spelling.has("fuel") && !facts.spelling.has("flow") => {
            "with the empty mass it gives mass_slug by a formula, and inertias by tables (docs/recorder.md)".to_owned()
        }
        (None, None) if kind_of(facts).is_some() => {
            "an input; nothing can be inferred from it".to_owned()
        }
        (None, None) => "its name is not in harvest's vocabulary".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inspection::test_flight::{TestFlight, test_column, times};

    #[test]
    fn a_surface_that_hardly_moves_has_the_unit_of_the_other_angles() {
        use crate::inspection::quantity::Quantity::{P, Phi, Q, Theta};
        let unit_of_aileron = |units: [&'static str; 2]| {
            let [angle, rate] = units;
            let columns = [
                ("theta", Theta, angle),
                ("q", Q, rate),
                ("phi", Phi, angle),
                ("p", P, rate),
            ];
            let mut recording = TestFlight::default().recording(&columns);
            let values = times().iter().map(|t| (0.7 * t).sin()).collect();
            recording.columns.push(test_column("da", values));
            let found = inspect(&[recording]).expect("a clock");
            let own = found.channels.into_iter().find(|c| c.column == "da");
            own.map(|channel| channel.unit)
        };
        assert_eq!(unit_of_aileron(["deg", "deg/s"]).as_deref(), Some("deg"));
        assert_eq!(unit_of_aileron(["rad", "rad/s"]).as_deref(), Some("rad"));
    }

    #[test]
    fn a_signal_that_two_names_mean_equally_is_not_sure() {
        let is_sure = |names: &[&str]| {
            let mut recording = TestFlight::default().recording(&[]);
            for name in names {
                let mut column = test_column(name, times().iter().map(|t| 90.0 + t).collect());
                column.stated = Some("kg".to_owned());
                recording.columns.push(column);
            }
            let found = inspect(&[recording]).expect("a clock");
            let mass = found.channels.iter().find(|c| c.signal == signal::MASS);
            mass.map(|channel| channel.is_sure)
        };
        assert_eq!(is_sure(&["mass"]), Some(true));
        assert_eq!(is_sure(&["mass", "masa"]), Some(false));
    }
}
