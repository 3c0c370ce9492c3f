//! Surfaces, pilot controls and flags of a recording: their signs from the motion that they cause.

use super::effects::{Effect, Regression, effects};
use crate::inspection::grid::Grid;
use crate::inspection::names::vocabulary::{Input, input, is_derived, meanings};
use crate::inspection::quantity::Quantity;
use crate::inspection::search::assignment::Assignment;
use crate::inspection::search::plausible::ColumnFacts;
use crate::units;

/// Least significance of an effect that determines a sign. Residuals are coloured, so the standard
/// errors are several times too small.
const SIGN_SIGNIFICANCE: f64 = 12.0;
/// Time over which a pilot control acts, in steps of the grid.
const CONTROL_STEPS: usize = 3;

/// Axis on which an input acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ControlAxis {
    Pitch,
    Roll,
    Yaw,
}

/// An input as recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct InputColumn {
    pub column: String,
    pub kind: Input,
    pub axis: ControlAxis,
    pub sign: f64,
    /// `true` if the motion determines the sign.
    pub is_sure: bool,
    pub evidence: String,
}

/// Inputs that names determine, with their signs and axes. Signs come from the `liveliest` parts. Axes
/// of other surfaces come from all of the recordings, since a flap may move in few maneuvers.
#[must_use]
pub fn inputs(
    (liveliest, all): (&Grid, &Grid),
    assignment: &Assignment,
    facts: &[ColumnFacts],
) -> Vec<InputColumn> {
    let is_motion = |c: &&ColumnFacts| assignment.values().any(|choice| choice.column == c.name);
    let named = facts.iter().filter(|c| !is_motion(c));
    let named: Vec<(&ColumnFacts, Input)> = named.filter_map(|c| Some((c, kind_of(c)?))).collect();
    let (surfaces, controls): (Vec<_>, Vec<_>) =
        named.into_iter().partition(|(_, kind)| kind.is_surface());
    let (main, others): (Vec<_>, Vec<_>) = surfaces
        .iter()
        .copied()
        .partition(|(_, kind)| *kind != Input::OtherSurface);
    let mut found = Responses::of(liveliest, assignment, &main, 1).inputs();
    // A mixed surface moves with a main one, and shares its effect: the main ones are judged without the others.
    let with_others = Responses::of(all, assignment, &surfaces, 1).inputs();
    let is_other = |input: &InputColumn| others.iter().any(|(facts, _)| facts.name == input.column);
    found.extend(with_others.into_iter().filter(is_other));
    found.extend(Responses::of(liveliest, assignment, &controls, CONTROL_STEPS).inputs());
    let unnamed = unnamed(liveliest, assignment, facts, &found);
    found.extend(unnamed);
    found
}

/// Surfaces with names outside the vocabulary: on each axis without a named surface, the angle that the
/// angular acceleration follows most clearly.
fn unnamed(
    grid: &Grid,
    assignment: &Assignment,
    facts: &[ColumnFacts],
    found: &[InputColumn],
) -> Vec<InputColumn> {
    let is_motion = |c: &ColumnFacts| assignment.values().any(|choice| choice.column == c.name);
    let is_free = |c: &&ColumnFacts| is_nameless_angle(c) && !is_motion(c);
    let free: Vec<&ColumnFacts> = facts.iter().filter(is_free).collect();
    let clearest = |kind: Input| clearest_unnamed(grid, assignment, &free, kind);
    let main = [Input::Elevator, Input::Aileron, Input::Rudder].into_iter();
    main.filter(|kind| lacks_main_surface(found, *kind))
        .filter_map(clearest)
        .collect()
}

/// `true` for an angle whose name means nothing.
fn is_nameless_angle(column: &ColumnFacts) -> bool {
    let is_angle = column
        .unit
        .is_some_and(|unit| unit.quantity == units::Quantity::Angle);
    let has_meaning = kind_of(column).is_some() || !meanings(&column.spelling).is_empty();
    is_angle && !has_meaning && !is_derived(&column.spelling)
}

/// `true` if no main surface acts on the usual axis of this kind.
fn lacks_main_surface(inputs: &[InputColumn], kind: Input) -> bool {
    let is_main =
        |input: &&InputColumn| input.kind.is_surface() && input.kind != Input::OtherSurface;
    let mut axes = inputs.iter().filter(is_main).map(|input| input.axis);
    usual_axis(kind).is_some_and(|usual| axes.all(|axis| axis != usual))
}

/// Column that the angular acceleration follows most clearly as an input of this kind, if any is
/// sure.
fn clearest_unnamed(
    grid: &Grid,
    assignment: &Assignment,
    columns: &[&ColumnFacts],
    kind: Input,
) -> Option<InputColumn> {
    let judged = columns.iter().filter_map(|facts| {
        let single = [(*facts, kind)];
        let responses = Responses::of(grid, assignment, &single, 1);
        let input = responses.inputs().pop().filter(|input| input.is_sure)?;
        Some((responses.significance(0, input.axis).abs(), input))
    });
    let (_, input) = judged.max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(InputColumn {
        is_sure: false,
        evidence: format!(
            "its name is not in harvest's vocabulary; {}",
            input.evidence
        ),
        ..input
    })
}

/// Kind of an input by its name; an angle whose name is a `d` and a few letters is a surface.
#[must_use]
pub fn kind_of(facts: &ColumnFacts) -> Option<Input> {
    let is_delta = || {
        let joined = facts.spelling.joined();
        let is_angle = facts
            .unit
            .is_some_and(|u| u.quantity == units::Quantity::Angle);
        is_angle
            && joined.starts_with('d')
            && (2..=5).contains(&joined.len())
            && meanings(&facts.spelling).is_empty()
    };
    let is_position = |unit: units::Unit| {
        use units::Quantity::{Angle, Length, Number};
        matches!(unit.quantity, Angle | Length | Number)
    };
    let kind = input(&facts.spelling).or_else(|| is_delta().then_some(Input::OtherSurface));
    kind.filter(|_| facts.unit.is_none_or(is_position))
}

/// Motion whose effects on the angular accelerations are estimated beside those of the inputs.
const MOTION: [Quantity; 5] = [
    Quantity::Alpha,
    Quantity::Beta,
    Quantity::P,
    Quantity::Q,
    Quantity::R,
];

/// Effects of some inputs on the three angular accelerations.
struct Responses<'a> {
    inputs: &'a [(&'a ColumnFacts, Input)],
    /// Effects of each input on pitch, roll and yaw; empty if the inputs cannot be separated.
    effects: [Vec<Effect>; 3],
}

impl<'a> Responses<'a> {
    fn of(
        grid: &Grid,
        assignment: &Assignment,
        inputs: &'a [(&'a ColumnFacts, Input)],
        steps: usize,
    ) -> Responses<'a> {
        let moving = |facts: &ColumnFacts| {
            if facts.is_constant() {
                None
            } else {
                grid.columns.get(&facts.name)
            }
        };
        let columns: Vec<Option<&Vec<f64>>> =
            inputs.iter().map(|(facts, _)| moving(facts)).collect();
        let motion: Vec<Vec<f64>> = MOTION
            .into_iter()
            .filter_map(|quantity| series(grid, assignment, quantity))
            .collect();
        let used = columns.iter().flatten().map(|c| c.as_slice());
        let regressors: Vec<&[f64]> = used.chain(motion.iter().map(Vec::as_slice)).collect();
        let effects = [Quantity::Q, Quantity::P, Quantity::R].map(|rate| {
            let Some(rate) = series(grid, assignment, rate) else {
                return Vec::new();
            };
            let regression = Regression {
                response: &slopes(grid, &rate, steps),
                regressors: regressors.clone(),
            };
            let mut found = effects(&regression).unwrap_or_default().into_iter();
            columns
                .iter()
                .map(|c| c.and_then(|_| found.next()).unwrap_or_default())
                .collect()
        });
        Responses { inputs, effects }
    }

    fn inputs(&self) -> Vec<InputColumn> {
        (0..self.inputs.len()).map(|n| self.input(n)).collect()
    }

    /// Effect of an input on an axis in standard errors.
    fn significance(&self, n: usize, axis: ControlAxis) -> f64 {
        self.effects[axis as usize]
            .get(n)
            .map_or(0.0, |e| e.significance)
    }

    /// Axis on which an input acts more clearly than on its own. Roll and yaw count as one: rudders roll an aircraft.
    fn clearer_axis(&self, n: usize, axis: ControlAxis) -> Option<ControlAxis> {
        let size = |axis: &ControlAxis| self.significance(n, *axis).abs();
        let lateral = [ControlAxis::Roll, ControlAxis::Yaw];
        let others: &[ControlAxis] = if axis == ControlAxis::Pitch {
            &lateral
        } else {
            &[ControlAxis::Pitch]
        };
        let own: &[ControlAxis] = if axis == ControlAxis::Pitch {
            &[ControlAxis::Pitch]
        } else {
            &lateral
        };
        let own = own.iter().map(size).fold(0.0, f64::max);
        others.iter().copied().find(|other| size(other) > own)
    }

    fn input(&self, n: usize) -> InputColumn {
        let (facts, kind) = self.inputs[n];
        let axis = usual_axis(kind).unwrap_or_else(|| self.clearest_axis(n));
        let found = self.significance(n, axis);
        let usual = usual_effect(kind);
        let is_significant = found.abs() >= SIGN_SIGNIFICANCE;
        let other = self.clearer_axis(n, axis);
        InputColumn {
            column: facts.name.clone(),
            kind,
            axis,
            sign: if found * usual < 0.0 && is_significant {
                -1.0
            } else {
                1.0
            },
            is_sure: usual != 0.0 && is_significant && other.is_none(),
            evidence: evidence_in_words((found, usual), axis, other),
        }
    }

    /// Axis on which an input acts most clearly.
    fn clearest_axis(&self, n: usize) -> ControlAxis {
        let [pitch, roll, yaw] = [ControlAxis::Pitch, ControlAxis::Roll, ControlAxis::Yaw]
            .map(|axis| self.significance(n, axis).abs());
        match (pitch >= roll.max(yaw), roll >= yaw) {
            (true, _) => ControlAxis::Pitch,
            (_, true) => ControlAxis::Roll,
            _ => ControlAxis::Yaw,
        }
    }
}

/// Text of the evidence for an input. `found` is its effect in standard errors, `usual` the usual
/// sign. `other` is the axis on which it acts more clearly, if any.
fn evidence_in_words(
    (found, usual): (f64, f64),
    axis: ControlAxis,
    other: Option<ControlAxis>,
) -> String {
    let (acceleration_of, size) = (acceleration(axis), found.abs());
    let is_significant = size >= SIGN_SIGNIFICANCE;
    if usual == 0.0 {
        return "no motion determines its sign".to_owned();
    }
    if let Some(other) = other {
        return format!(
            "by its name; but {} follows it more clearly than {acceleration_of}",
            acceleration(other)
        );
    }
    if !is_significant {
        return format!("the motion does not determine its sign ({size:.0} standard errors)");
    }
    // A significant effect of the other sign turns the sign of the input.
    let direction = if usual > 0.0 { "positive" } else { "negative" };
    format!("{direction} {acceleration_of} follows it ({size:.0} standard errors)")
}

/// Rate about the axis on which an input acts.
#[must_use]
pub fn rate(axis: ControlAxis) -> Quantity {
    match axis {
        ControlAxis::Pitch => Quantity::Q,
        ControlAxis::Roll => Quantity::P,
        ControlAxis::Yaw => Quantity::R,
    }
}

fn acceleration(axis: ControlAxis) -> &'static str {
    match axis {
        ControlAxis::Pitch => "pitch acceleration",
        ControlAxis::Roll => "roll acceleration",
        ControlAxis::Yaw => "yaw acceleration",
    }
}

/// Axis on which a kind of input acts on every aircraft.
fn usual_axis(kind: Input) -> Option<ControlAxis> {
    match kind {
        Input::Elevator | Input::PitchStick => Some(ControlAxis::Pitch),
        Input::Aileron | Input::RollStick => Some(ControlAxis::Roll),
        Input::Rudder | Input::Pedals => Some(ControlAxis::Yaw),
        Input::OtherSurface => None,
    }
}

/// Sign of the angular acceleration that follows a positive input in harvest's signs; 0 where aircraft
/// differ.
fn usual_effect(kind: Input) -> f64 {
    match kind {
        Input::Elevator | Input::Rudder => -1.0,
        Input::Aileron | Input::PitchStick | Input::RollStick | Input::Pedals => 1.0,
        Input::OtherSurface => 0.0,
    }
}

/// A quantity of the motion in rad, ft and s.
fn series(grid: &Grid, assignment: &Assignment, quantity: Quantity) -> Option<Vec<f64>> {
    let choice = assignment.get(&quantity)?;
    let factor = choice.sign * quantity.factor(choice.unit)?;
    let values = grid.columns.get(&choice.column)?;
    Some(values.iter().map(|v| v * factor).collect())
}

/// Slope of a series: about each sample for one step, over the following steps for more.
fn slopes(grid: &Grid, values: &[f64], steps: usize) -> Vec<f64> {
    let mut slopes = vec![f64::NAN; values.len()];
    let back = usize::from(steps == 1);
    for stretch in &grid.stretches {
        for k in stretch.start + back..stretch.end.saturating_sub(steps) {
            let over = (steps + back) as f64 * grid.step_s;
            slopes[k] = (values[k + steps] - values[k - back]) / over;
        }
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inspection::recording::{Column, Recording};
    use crate::inspection::search::assignment::Choice;
    use crate::inspection::search::plausible::facts;
    use crate::numerics::series::sample_count::whole_steps;

    const STEP_S: f64 = 0.1;

    /// Four hours of a surface at rest, with a doublet of 4 deg in the middle that lasts this long.
    fn surface(doublet_s: f64) -> Vec<f64> {
        let mut values: Vec<f64> = (0..144_000).map(|k| 0.02 * f64::from(k % 3)).collect();
        let (middle, half) = (72_000, whole_steps(0.5 * doublet_s, STEP_S));
        values[middle - half..middle].fill(4.0);
        values[middle..middle + half].fill(-4.0);
        values
    }

    fn grid(columns: &[(&str, Vec<f64>)]) -> Grid {
        let (_, values) = columns.first().expect("a column");
        Grid {
            step_s: STEP_S,
            stretches: vec![0..values.len(); 1],
            columns: columns
                .iter()
                .map(|(name, values)| ((*name).to_owned(), values.clone()))
                .collect(),
        }
    }

    /// A grid with this surface, and what is known of its column.
    fn of_surface(values: Vec<f64>) -> (Grid, ColumnFacts) {
        let column = Column {
            name: "dsa".to_owned(),
            stated: Some("deg".to_owned()),
            values: values.clone(),
        };
        let recording = Recording {
            name: "flight".to_owned(),
            columns: vec![column],
        };
        let facts = facts(&[recording]).pop().expect("a column");
        (grid(&[("dsa", values)]), facts)
    }

    #[test]
    fn the_axis_of_a_flap_that_few_maneuvers_move_follows_from_all_of_the_recordings() {
        let dsa = surface(6.0);
        let mut q = vec![0.0; dsa.len()];
        for k in 1..dsa.len() - 1 {
            q[k + 1] = q[k - 1] - 2.0 * STEP_S * (2.0 * dsa[k] + 0.1 * (0.37 * k as f64).sin());
        }
        // The rest of the surface, without a meaning, goes with the roll rate.
        let p = (0..dsa.len()).map(|k| if k % 3 == 1 { -0.05 } else { 0.0 });
        let all = grid(&[("dsa", dsa.clone()), ("q", q), ("p", p.collect())]);
        let (_, facts) = of_surface(dsa);
        let liveliest = Grid {
            stretches: vec![0..6_000; 1],
            columns: all
                .columns
                .iter()
                .map(|(name, values)| (name.clone(), values[..6_000].to_vec()))
                .collect(),
            ..all.clone()
        };
        let choice = |quantity, column: &str| {
            let choice = Choice {
                column: column.to_owned(),
                unit: "deg/s",
                sign: 1.0,
            };
            (quantity, choice)
        };
        let assignment = [choice(Quantity::P, "p"), choice(Quantity::Q, "q")].into();
        let axis = |all: &Grid| {
            let found = inputs((&liveliest, all), &assignment, std::slice::from_ref(&facts));
            found.first().map(|input| input.axis)
        };
        assert_eq!(axis(&liveliest), Some(ControlAxis::Roll));
        assert_eq!(axis(&all), Some(ControlAxis::Pitch));
    }
}
