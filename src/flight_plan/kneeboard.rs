//! The pilot's page: one sheet with the cards in the order of flying and the goals before and after.

use std::collections::BTreeMap;

use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment};
use serde::Serialize;

use super::plan::Plan;
use crate::config::Config;
use crate::lab::campaign::{Cards, FlightLimits};
use crate::lab::simulator::{Program, TestInput};
use crate::numerics::statistics::order_statistics::median;
use crate::report::{
    angle, count, fixed, number, power_of_ten, symbol, unit, well_formed, without_unit,
};
use crate::tables::{FlyingQuality, GoalKind, NextCardRow, NextGoalRow};
use crate::units::Unit;

/// Largest number of goals on the sheet: those that gain most.
const MOST_GOALS: usize = 14;

/// Largest number of refused cards on the sheet; the table has all.
const MOST_REFUSED: usize = 4;

/// Values of the template.
#[derive(Debug, Serialize)]
struct Page<'a> {
    title: &'a str,
    aircraft: &'a str,
    minutes: String,
    flown_minutes: String,
    /// Percentage by which the goals' standard deviations fall, in their weighted mean.
    fall_pct: String,
    cards: Vec<CardLine>,
    programs: Vec<ProgramLine>,
    goals: Vec<GoalLine>,
    /// `true` if a goal has a wanted bound or is to be decided.
    has_targets: bool,
    /// `true` if a goal has a unit.
    has_units: bool,
    further_goals: usize,
    limits: String,
    settle_s: String,
    change_s_per_deg: String,
    refused: Vec<RefusedLine>,
    further_refused: usize,
}

/// Line of a card.
#[derive(Debug, Serialize)]
struct CardLine {
    place: usize,
    at: String,
    class: String,
    title: String,
    times: usize,
    alpha: String,
    mach: String,
    calibrated_kt: String,
    altitude: String,
    inputs: String,
    minutes: String,
    reaches: String,
    informs: Vec<InformedGoal>,
}

/// Line of a program of inputs.
#[derive(Debug, Serialize)]
struct ProgramLine {
    class: String,
    /// Scale of the inputs, unless it is one.
    scale: String,
    inputs: String,
}

/// Goal on which a card gives much information.
#[derive(Debug, Serialize)]
struct InformedGoal {
    symbol: String,
    rest: String,
}

/// Line of a goal.
#[derive(Debug, Serialize)]
struct GoalLine {
    symbol: String,
    of: String,
    unit: String,
    range: String,
    before: String,
    after: String,
    fall_pct: String,
    reached: String,
}

/// Line of a card that is refused.
#[derive(Debug, Serialize)]
struct RefusedLine {
    class: String,
    alpha: String,
    reason: String,
}

/// Renders the page.
///
/// # Errors
/// An error of the template, with its line.
pub fn page(config: &Config, plan: &Plan, minutes: f64, cards: &Cards) -> Result<String, String> {
    let next = &cards.next;
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    let (goals, further_goals) = goal_lines(&plan.goals);
    let refused = || plan.cards.iter().filter(|row| !row.refused.is_empty());
    let page = Page {
        title: &config.title,
        aircraft: &config.aircraft.name,
        minutes: fixed(minutes, 0),
        flown_minutes: fixed(plan.minutes, 1),
        fall_pct: fixed(plan.fall_pct(), 0),
        cards: card_lines(config, plan, cards),
        programs: program_lines(plan, cards),
        has_targets: goals.iter().any(|goal| !goal.reached.is_empty()),
        has_units: goals.iter().any(|goal| !goal.unit.is_empty()),
        goals,
        further_goals,
        limits: limits_in_words(&next.limits),
        settle_s: fixed(next.settle_s, 0),
        change_s_per_deg: plain(next.change_s_per_deg),
        refused: refused().take(MOST_REFUSED).map(refused_line).collect(),
        further_refused: refused().count().saturating_sub(MOST_REFUSED),
    };
    environment
        .render_named_str(
            "kneeboard.html",
            include_str!("kneeboard.html"),
            Serde(&page),
        )
        .map(well_formed)
        .map_err(|error| format!("the kneeboard's template: {error:#}"))
}

/// Lines of the cards, each with its start on the flight's clock.
fn card_lines(config: &Config, plan: &Plan, cards: &Cards) -> Vec<CardLine> {
    let mut lines = Vec::new();
    let (mut at, mut before) = (0.0, None);
    for row in &plan.cards {
        if row.place.is_none() {
            continue;
        }
        let way = before.map_or(0.0, |before: f64| (row.alpha_deg - before).abs());
        at += way * cards.next.change_s_per_deg / 60.0;
        let minutes = row.minutes * row.times as f64;
        let program = cards.programs.get(&row.class);
        let program = program.map(|program| program.scaled(row.scale));
        lines.push(card_line(config, row, program.as_ref(), at));
        (at, before) = (at + minutes, Some(row.alpha_deg));
    }
    lines
}

fn card_line(config: &Config, row: &NextCardRow, program: Option<&Program>, at: f64) -> CardLine {
    let title = config.class(&row.class).map(|class| class.title.clone());
    let reach =
        |value: Option<f64>, decimals| value.map_or_else(String::new, |v| fixed(v, decimals));
    let informs = row.informs.split("; ").filter_map(|part| {
        let (goal, rest) = part.split_once(" at ")?;
        Some(InformedGoal {
            symbol: goal_symbol(goal),
            rest: format!("at {rest}"),
        })
    });
    CardLine {
        place: row.place.unwrap_or_default(),
        at: fixed(at, 1),
        class: row.class.clone(),
        title: title.unwrap_or_default(),
        times: row.times,
        alpha: angle(row.alpha_deg),
        altitude: fixed(row.altitude_ft, 0),
        mach: reach(row.mach, 2),
        calibrated_kt: reach(row.calibrated_airspeed_kt, 0),
        inputs: program.map_or_else(String::new, amplitudes),
        minutes: fixed(row.minutes * row.times as f64, 1),
        reaches: format!(
            "{} to {}°, {} to {} g, {} psf",
            reach(row.lowest_alpha_deg, 0),
            reach(row.highest_alpha_deg, 0),
            reach(row.lowest_an_g, 1),
            reach(row.highest_an_g, 1),
            reach(row.highest_qbar_psf, 0),
        ),
        informs: informs.take(1).collect(),
    }
}

/// Program of each class and scale that is flown, in the order of flying.
fn program_lines(plan: &Plan, cards: &Cards) -> Vec<ProgramLine> {
    let mut lines: Vec<ProgramLine> = Vec::new();
    for row in plan.cards.iter().filter(|row| row.place.is_some()) {
        let Some(program) = cards.programs.get(&row.class) else {
            continue;
        };
        let is_plain = row.scale.total_cmp(&1.0).is_eq();
        let scale = if is_plain {
            String::new()
        } else {
            plain(row.scale)
        };
        if lines
            .iter()
            .any(|line| line.class == row.class && line.scale == scale)
        {
            continue;
        }
        let program = program.scaled(row.scale);
        let inputs: Vec<String> = program.inputs.iter().map(pulses).collect();
        lines.push(ProgramLine {
            class: row.class.clone(),
            scale,
            inputs: inputs.join("; "),
        });
    }
    lines
}

/// Pulses of an input: start, amplitude of the first, widths.
fn pulses(input: &TestInput) -> String {
    let widths: Vec<String> = input.widths_s.iter().copied().map(plain).collect();
    let unit = unit_of(&input.signal);
    format!(
        "{} {}{unit} from {} s for {} s",
        name_of(&input.signal),
        plain(input.size),
        plain(input.start_s),
        widths.join(", "),
    )
}

/// Largest amplitude of each signal and the time that it moves.
fn amplitudes(program: &Program) -> String {
    let mut signals: Vec<(&str, f64, f64)> = Vec::new();
    for input in &program.inputs {
        let (size, length) = (input.size.abs(), input.widths_s.iter().sum::<f64>());
        match signals.iter_mut().find(|own| own.0 == input.signal) {
            Some(own) => *own = (own.0, own.1.max(size), own.2 + length),
            None => signals.push((&input.signal, size, length)),
        }
    }
    let part = |(signal, size, length): &(&str, f64, f64)| {
        let (name, unit) = (name_of(signal), unit_of(signal));
        format!("{name} ±{}{unit} {} s", plain(*size), plain(*length))
    };
    signals.iter().map(part).collect::<Vec<_>>().join(", ")
}

/// Name of a signal without its unit.
fn name_of(signal: &str) -> String {
    without_unit(signal).replace('_', " ")
}

fn unit_of(signal: &str) -> String {
    match Unit::of_signal(signal).name {
        "deg" => "°".to_owned(),
        other => format!(" {other}"),
    }
}

/// A number of the cards with up to two decimals, without zeros at its end.
fn plain(value: f64) -> String {
    let text = fixed(value, 2);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Goals of one line: kind, name and airframe.
type GoalKey<'a> = (GoalKind, &'a str, &'a str);

/// Lines of the goals that gain most, and the number of the others.
fn goal_lines(rows: &[NextGoalRow]) -> (Vec<GoalLine>, usize) {
    let mut by_goal: BTreeMap<GoalKey, Vec<&NextGoalRow>> = BTreeMap::new();
    for row in rows {
        let key = (row.kind, row.goal.as_str(), row.of.as_str());
        by_goal.entry(key).or_default().push(row);
    }
    let gain = |own: &[&NextGoalRow]| median(own.iter().map(|r| (r.before / r.after).ln()));
    let mut all: Vec<(GoalKey, Vec<&NextGoalRow>)> = by_goal.into_iter().collect();
    all.sort_by(|(_, a), (_, b)| gain(b).unwrap_or(0.0).total_cmp(&gain(a).unwrap_or(0.0)));
    let further = all.len().saturating_sub(MOST_GOALS);
    let lines = all.into_iter().take(MOST_GOALS);
    (
        lines.map(|(key, own)| goal_line(key, &own)).collect(),
        further,
    )
}

fn goal_line((kind, goal, of): GoalKey, rows: &[&NextGoalRow]) -> GoalLine {
    let alphas = || rows.iter().map(|row| row.alpha_deg);
    let before = median(rows.iter().map(|row| row.before));
    let after = median(rows.iter().map(|row| row.after));
    let exponent = before.map_or(0, exponent);
    let scaled = |value: Option<f64>| {
        let value = value.map(|value| value * 10.0_f64.powi(-exponent));
        value.map_or_else(String::new, |value| number(Some(value), 2))
    };
    let unit = unit(
        &rows
            .first()
            .map_or_else(String::new, |row| row.unit.clone()),
    );
    let fall = median(
        rows.iter()
            .map(|row| 100.0 * (1.0 - row.after / row.before)),
    );
    GoalLine {
        symbol: goal_symbol(goal),
        of: of.to_owned(),
        unit: format!("{} {unit}", power(exponent)).trim().to_owned(),
        range: format!(
            "{} to {}",
            angle(alphas().fold(f64::INFINITY, f64::min)),
            angle(alphas().fold(f64::NEG_INFINITY, f64::max)),
        ),
        before: scaled(before),
        after: scaled(after),
        fall_pct: fall.map_or_else(String::new, |fall| fixed(fall, 0)),
        reached: match kind {
            GoalKind::Derivative => bounds_reached(rows),
            GoalKind::Level | GoalKind::Match => decisions(kind, rows),
        },
    }
}

/// Name of a goal: symbol of a derivative, words of a quantity, class of a match.
fn goal_symbol(goal: &str) -> String {
    match FlyingQuality::from_word(goal) {
        Some(quantity) => symbol(&quantity.name().replace('_', " ")),
        None => symbol(goal),
    }
}

/// Number of angles of attack at which a wanted bound is reached; empty without one.
fn bounds_reached(rows: &[&NextGoalRow]) -> String {
    let wanted = || rows.iter().filter_map(|row| Some((row.after, row.wanted?)));
    let reached = wanted().filter(|(after, wanted)| after <= wanted).count();
    match wanted().count() {
        0 => String::new(),
        all => format!("{reached} of {}", count(all, "angle")),
    }
}

/// Expected number of angles of attack, or of maneuvers, at which a goal is decided after the flight.
fn decisions(kind: GoalKind, rows: &[&NextGoalRow]) -> String {
    let what = if kind == GoalKind::Match {
        "maneuver"
    } else {
        "angle"
    };
    let after = rows.iter().filter_map(|row| row.decided_pct);
    format!(
        "decided: {} of {}",
        fixed(0.01 * after.sum::<f64>(), 1),
        count(rows.len(), what)
    )
}

/// Power of ten, a multiple of three, by which a number is written with few digits.
fn exponent(value: f64) -> i32 {
    if value > 0.0 && value.is_finite() && !(0.01..1000.0).contains(&value) {
        3 * power_of_ten(value).div_euclid(3)
    } else {
        0
    }
}

/// Power of ten in words; empty for one.
fn power(exponent: i32) -> String {
    let digit = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32('⁰' as u32 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
    };
    if exponent == 0 {
        return String::new();
    }
    let digits: String = exponent.to_string().chars().map(digit).collect();
    format!("10{digits}")
}

fn refused_line(row: &NextCardRow) -> RefusedLine {
    RefusedLine {
        class: row.class.clone(),
        alpha: angle(row.alpha_deg),
        reason: row.refused.clone(),
    }
}

/// The limits in one sentence; empty without any.
fn limits_in_words(limits: &FlightLimits) -> String {
    let ranges = [
        ("alpha", limits.alpha_deg, "°"),
        ("normal acceleration", limits.an_g, " g"),
        ("dynamic pressure", limits.qbar_psf, " psf"),
    ];
    let ranges = ranges.into_iter().filter_map(|(what, range, unit)| {
        let (low, high) = range?;
        Some(format!("{what} {low} to {high}{unit}"))
    });
    let rates = limits.surface_rates_deg_s.iter();
    let rates = rates.map(|(name, rate)| format!("{name} {rate}°/s"));
    ranges.chain(rates).collect::<Vec<_>>().join(", ")
}
