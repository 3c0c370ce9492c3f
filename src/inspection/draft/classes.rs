//! Maneuver classes of a draft: those that the surfaces and pilot controls of the recording allow.

use std::fmt::Write;

use super::contents::Draft;
use super::model::{basic, bias, biased, of_surface};
use crate::aero::Axis;
use crate::inspection::controls::inputs::{ControlAxis, InputColumn};
use crate::inspection::findings::Channel;
use crate::inspection::names::vocabulary::Input;

/// Least number of steps of an input that make a maneuver: a doublet has three.
const FEWEST_STEPS: usize = 3;
/// Largest number of steps of an input that is not excited in a maneuver: two may be a trim and its
/// return.
const MOST_OTHER_STEPS: usize = 2;

/// A maneuver class of the draft.
#[derive(Clone, Debug, PartialEq)]
pub struct DraftClass {
    pub name: String,
    title: String,
    axis: Axis,
    /// Signals that must step, those that may, and those that must not.
    steps: Vec<String>,
    may_step: Vec<String>,
    rests: Vec<String>,
}

/// Classes by inputs that move: of the surfaces, and of the pilot's controls.
pub fn classes(draft: &Draft) -> Vec<DraftClass> {
    let of_surfaces = Inputs::of(draft, Input::is_surface);
    let of_pilot = Inputs::of(draft, |kind| !kind.is_surface());
    let axes = [ControlAxis::Pitch, ControlAxis::Roll, ControlAxis::Yaw];
    let of_pilot_all = axes.map(|axis| of_pilot.of_axis(axis)).concat();
    let mut classes = of_surfaces.classes(FlownBy::Surfaces, &of_pilot_all);
    classes.extend(of_pilot.classes(FlownBy::Pilot, &[]));
    classes
}

/// Inputs whose steps make a maneuver.
#[derive(Clone, Copy)]
enum FlownBy {
    Pilot,
    Surfaces,
}

impl FlownBy {
    /// End of a class's name.
    fn suffix(self) -> &'static str {
        match self {
            FlownBy::Pilot => "pilot",
            FlownBy::Surfaces => "surface",
        }
    }
}

/// Inputs of one kind that have steps.
struct Inputs<'a> {
    inputs: Vec<(&'a Channel, &'a InputColumn)>,
}

impl<'a> Inputs<'a> {
    fn of(draft: &'a Draft, is_wanted: impl Fn(Input) -> bool) -> Inputs<'a> {
        let wanted = draft.inputs().filter(|(_, input)| is_wanted(input.kind));
        Inputs {
            inputs: wanted.collect(),
        }
    }

    /// Inputs of an axis that step: the main one first, where there is one, then flaps, vanes and the
    /// like. Beside main ones that only follow feedback the others are no maneuver of the axis.
    fn of_axis(&self, axis: ControlAxis) -> Vec<String> {
        let of_axis = self.inputs.iter().filter(|(_, input)| input.axis == axis);
        let (main, others): (Vec<_>, Vec<_>) =
            of_axis.partition(|(_, input)| input.kind != Input::OtherSurface);
        let steps = |(channel, _): &&&(&Channel, &InputColumn)| channel.step.is_some();
        if !main.is_empty() && !main.iter().any(|input| steps(&input)) {
            return Vec::new();
        }
        let all = main.iter().chain(&others).filter(|input| steps(input));
        all.map(|(channel, _)| channel.signal.clone()).collect()
    }

    /// Pitch, roll, yaw, and roll with yaw. The first input of each axis must step, the others may; `others` must rest in
    /// all of them.
    fn classes(&self, by: FlownBy, others: &[String]) -> Vec<DraftClass> {
        let [pitch, roll, yaw] = [ControlAxis::Pitch, ControlAxis::Roll, ControlAxis::Yaw]
            .map(|axis| self.of_axis(axis));
        let class = |name: &str, axis: Axis, steps: &[&Vec<String>], rests: &[&Vec<String>]| {
            let first = |signals: &&Vec<String>| signals.first().cloned();
            let all_step = steps.iter().all(|signals| !signals.is_empty());
            let further = steps.iter().flat_map(|signals| signals.iter().skip(1));
            all_step.then(|| DraftClass {
                name: format!("{name}_{}", by.suffix()),
                title: title(name, by),
                axis,
                steps: steps.iter().filter_map(first).collect(),
                may_step: further.cloned().collect(),
                rests: rests
                    .iter()
                    .filter_map(first)
                    .chain(others.iter().cloned())
                    .collect(),
            })
        };
        let classes = [
            class("pitch", Axis::Longitudinal, &[&pitch], &[&roll, &yaw]),
            class("roll", Axis::Lateral, &[&roll], &[&yaw]),
            class("yaw", Axis::Lateral, &[&yaw], &[&roll]),
            class("roll_yaw", Axis::Lateral, &[&roll, &yaw], &[]),
        ];
        classes.into_iter().flatten().collect()
    }
}

fn title(name: &str, by: FlownBy) -> String {
    let inputs = name.replace('_', " and ");
    match by {
        FlownBy::Pilot => format!("Steps of the pilot's {inputs} control"),
        FlownBy::Surfaces => format!("Steps of the {inputs} surfaces"),
    }
}

/// Weights of the outputs: those of the paper's pilot inputs (Tables 2 and 4).
fn weights(axis: Axis) -> &'static str {
    match axis {
        Axis::Longitudinal => "{ alpha: 5, q: 8, theta: 4, an: 150, ax: 250 }",
        Axis::Lateral => "{ beta: 12, p: 3, r: 17, phi: 3, ay: 200 }",
    }
}

/// Text of a class's file.
pub fn text(draft: &Draft, class: &DraftClass) -> String {
    let mut text = format!(
        "class: {}\ntitle: {}\naxis: {}\n\
         # A maneuver has at least {FEWEST_STEPS} steps of its own inputs; the sizes of steps are in pipeline.yaml (segment: steps:).\n\
         recognise:\n  steps:\n",
        class.name,
        class.title,
        class.axis.name()
    );
    for signal in &class.steps {
        let _ = writeln!(text, "    {signal}: {{ at_least: {FEWEST_STEPS} }}");
    }
    for signal in &class.may_step {
        let _ = writeln!(
            text,
            "    {signal}: {{ at_least: 0 }} # counts where it moves from side to side"
        );
    }
    for signal in &class.rests {
        let _ = writeln!(text, "    {signal}: {{ at_most: {MOST_OTHER_STEPS} }}");
    }
    text += "  lead_in_s: 1 # trimmed flight before the first step\n  decay_s: 2.4 # response after the last step\n\n";
    let surfaces = draft.surfaces(class.axis == Axis::Longitudinal);
    let of_surfaces = surfaces.iter().flat_map(|(s, _)| of_surface(class.axis, s));
    let estimated = [
        basic(class.axis),
        of_surfaces.collect(),
        biased(class.axis).map(bias).collect(),
    ];
    text += "\
# estimated: from the maneuver, where the surface moves in it; held: at the wind tunnel's value; inactive: small feedback
# motion alone, at the tunnel's value where there is one. With a tunnel, put surfaces that only follow a schedule or feedback
# under inactive: then the others are estimated better.
";
    let _ = writeln!(text, "estimated:\n  [{}]", wrapped(&estimated.concat()));
    let _ = writeln!(
        text,
        "\n# The diagonal of W1, on residuals in deg, deg/s and g, for output error alone.\nweights: {}",
        weights(class.axis)
    );
    text
}

/// Names in lines of at most a hundred letters.
fn wrapped(names: &[String]) -> String {
    let mut lines = vec![String::new()];
    for name in names {
        if lines
            .last()
            .is_some_and(|line| line.len() + name.len() > 100)
        {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            let _ = write!(line, "{name}, ");
        }
    }
    let lines: Vec<&str> = lines.iter().map(|line| line.trim_end()).collect();
    lines.join("\n   ").trim_end_matches(',').to_owned()
}
