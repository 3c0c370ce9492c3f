//! `aircraft.yaml` of a draft.

use std::fmt::Write;

use super::contents::{Draft, OPEN, UNSURE, comment, scalar};
use crate::flight::stand_in::{LATERAL, LONGITUDINAL};
use crate::flight::{StandIn, signal};
use crate::inspection::findings::Channel;
use crate::inspection::quantity::Quantity;

/// Text of the file.
pub fn text(draft: &Draft) -> String {
    let mut text = geometry(draft);
    text += &channels(draft);
    text += &unused(draft);
    text += &constants(draft);
    text += &instruments(draft);
    text
}

fn geometry(draft: &Draft) -> String {
    let name = scalar(draft.name);
    let coordinates = |value: &str| format!("x_ft: {value}, y_ft: {value}, z_ft: {value}");
    let sensor = |name: &str, signal: &str, factor: &str, effect: &str| {
        let (point, effect) = if draft.has(signal) {
            (coordinates(OPEN), effect)
        } else {
            (
                coordinates("0"),
                "no column was found: give the position with its channel",
            )
        };
        format!("    {name}: {{ {point}{factor} }} # {effect}")
    };
    let [an, ax, ay] = [
        ("an", signal::AN, "x times the pitch acceleration is in it"),
        ("ax", signal::AX, "z times the pitch acceleration is in it"),
        ("ay", signal::AY, "x times the yaw acceleration is in it"),
    ]
    .map(|(name, signal, effect)| sensor(name, signal, "", effect));
    let [alpha_vane, beta_vane] = [
        (
            "alpha_vane",
            signal::ALPHA_VANE,
            "x q/V is in it; the factor scales the slopes over alpha",
        ),
        (
            "beta_vane",
            signal::BETA_VANE,
            "x r/V is in it; the factor scales the slopes over beta",
        ),
    ]
    .map(|(name, signal, effect)| sensor(name, signal, ", factor: 1", effect));
    format!(
        "\
# The aircraft and its recorder, drafted by `harvest init` from the recording. Every {OPEN} is a question: put the value in
# its place. `harvest check {draft_name}` lists the questions that are open.
# 1 m = 3.28084 ft, 1 m2 = 10.7639 ft2, 1 kg = 0.0685218 slug, 1 kg m2 = 0.737562 slug ft2.
aircraft:
  name: {name}
  wing_area_ft2: {OPEN} # reference area: every coefficient is divided by it
  span_ft: {OPEN} # reference span: rolling and yawing moments, p b/2V, r b/2V
  chord_ft: {OPEN} # mean aerodynamic chord: pitching moment, q c/2V
  engine_inertia_slug_ft2: 0 # of one engine's rotor; with its speed it couples pitch and yaw, by little
  # thrust_line: {{ x_ft: ?, z_ft: ?, inclination_deg: 0 }} # a point of it; without it along x through the centre of gravity
  latitude_deg: 45 # gravity depends on it: 0.5 % from the equator to a pole
  # Positions: ft aft (x), right (y) and above (z) of any reference point; those of the centre of gravity count from the
  # same point. Where a position is not known, give the centre of gravity's: the sensor then counts as mounted there.
  sensors:
{an}
{ax}
{ay}
    # A vane reads its factor times the local angle (upwash, sidewash): 1 where that is not known, or for a computed angle.
{alpha_vane}
{beta_vane}

",
        draft_name = draft.name
    )
}

fn channels(draft: &Draft) -> String {
    let mut text = "\
# The recorder: each column with its signal and its unit; sign: -1 where the recorder's sign is the opposite of harvest's.
# Signs: rates and attitudes nose up, right wing down, nose right; accelerations up, forward, right; surfaces trailing edge
# down, rudder trailing edge left, roll surfaces rolling right; stick aft and right, pedal right; centre of gravity aft,
# right, above. The mirror image of a flight obeys the same equations: if all lateral channels are reversed together, no
# recording shows it, and no derivative changes.
channels:
"
    .to_owned();
    let (sure, unsure): (Vec<&Channel>, Vec<&Channel>) =
        draft.inspection.channels.iter().partition(|c| c.is_sure);
    for channel in sure {
        let _ = writeln!(text, "  {} # {}", line(channel), comment(&channel.evidence));
    }
    if !unsure.is_empty() {
        let _ = writeln!(
            text,
            "  # Check these against the recorder's documents, and delete the word `{UNSURE}` of each that is right."
        );
    }
    for channel in unsure {
        text += &columns_of_formula(channel);
        let _ = writeln!(
            text,
            "  {} # {UNSURE} {}",
            line(channel),
            comment(&channel.evidence)
        );
    }
    text
}

/// Lines of the columns from which a channel is computed; empty for one that is a column.
fn columns_of_formula(channel: &Channel) -> String {
    let pair = channel.mirror_images.as_ref();
    let columns = pair.map_or(vec![], |pair| vec![&pair.left, &pair.right]);
    let line = |column: &String| {
        let (column, unit) = (scalar(column), scalar(&channel.unit));
        format!("  {column}: {{ unit: {unit} }} # a column of the formula below\n")
    };
    columns.into_iter().map(line).collect()
}

/// Line of the channel map.
fn line(channel: &Channel) -> String {
    if let Some(pair) = &channel.mirror_images {
        let formula = scalar(&pair.formula(channel.sign));
        let column = scalar(&channel.column);
        return format!(
            "{column}: {{ signal: {}, formula: {formula} }}",
            channel.signal
        );
    }
    let sign = if channel.sign < 0.0 { ", sign: -1" } else { "" };
    let wraps = channel.wraps_at;
    let wraps = wraps.map_or_else(String::new, |period| format!(", wraps_at: {period}"));
    let (column, unit) = (scalar(&channel.column), scalar(&channel.unit));
    format!(
        "{column}: {{ signal: {}, unit: {unit}{sign}{wraps} }}",
        channel.signal
    )
}

fn unused(draft: &Draft) -> String {
    let unused = &draft.inspection.unused;
    if unused.is_empty() {
        return String::new();
    }
    let mut text =
        "\n# Columns that no signal takes. To use one, give it a line above, or compute a channel from several by a formula\n# (docs/recorder.md).\n".to_owned();
    for column in unused {
        let unit = column
            .unit
            .as_deref()
            .map_or_else(String::new, |unit| format!(" [{unit}]"));
        let _ = writeln!(
            text,
            "#   {}{}: {}",
            comment(&column.column),
            comment(&unit),
            comment(&column.reason)
        );
    }
    text
}

/// A signal that is not recorded: its value in the draft, and the place where it matters.
const NOT_RECORDED: [(&str, &str, &str); 7] = [
    (
        signal::MASS,
        OPEN,
        "every force coefficient is proportional to it",
    ),
    (
        signal::IX,
        OPEN,
        "every rolling moment coefficient is proportional to it",
    ),
    (
        signal::IY,
        OPEN,
        "every pitching moment coefficient is proportional to it",
    ),
    (
        signal::IZ,
        OPEN,
        "every yawing moment coefficient is proportional to it",
    ),
    (
        signal::X_CG,
        "0",
        "the reference point of all positions is then the centre of gravity",
    ),
    (signal::Y_CG, "0", "as x"),
    (signal::Z_CG, "0", "as x"),
];

/// `true` for an inertia about an axis of which no state is recorded, beside states of the other axis.
fn has_no_effect(inertia: &str, draft: &Draft) -> bool {
    let mut states = LATERAL.iter().chain(&LONGITUDINAL);
    if !states.any(|state| draft.has(state)) {
        return false;
    }
    let is_given = |name: &str| NOT_RECORDED.iter().any(|(given, _, _)| *given == name);
    let stand_in = StandIn::of(inertia, |name| draft.has(name) || is_given(name));
    matches!(stand_in, Some(StandIn::InertiaOf(_)))
}

/// Required signals that neither a column gives nor a stand-in, each with the place where it matters.
/// An altitude that is asked for makes the stand-ins of other air data possible.
fn asked(draft: &Draft) -> Vec<(&'static str, &'static str)> {
    let is_given = |name: &str| NOT_RECORDED.iter().any(|(given, _, _)| *given == name);
    let others = signal::REQUIRED
        .iter()
        .filter(|name| **name != signal::ALTITUDE);
    let mut asked: Vec<(&str, &str)> = Vec::new();
    for name in std::iter::once(&signal::ALTITUDE).chain(others) {
        let has = |other: &str| {
            draft.has(other) || is_given(other) || asked.iter().any(|(name, _)| *name == other)
        };
        if !has(name) && StandIn::of(name, has).is_none() {
            asked.push((name, question(name)));
        }
    }
    asked
}

/// Place where a signal matters that no column gives.
fn question(signal: &str) -> &'static str {
    match signal {
        signal::ALTITUDE => {
            "density and speed of sound follow from it: the mean altitude of the flights, 1,000 ft are 3 % of density"
        }
        signal::ALPHA_VANE => {
            "give its column a line under channels in place of this one; with a constant there are no longitudinal derivatives"
        }
        signal::VELOCITY | signal::QBAR => {
            "every coefficient is divided by the dynamic pressure: better a column, or a formula of others, under channels"
        }
        _ => {
            "give its column a line under channels in place of this one: no axis is complete without it"
        }
    }
}

fn constants(draft: &Draft) -> String {
    let mut lines = String::new();
    for (name, value, effect) in NOT_RECORDED {
        if !draft.has(name) && !has_no_effect(name, draft) {
            let _ = writeln!(lines, "  {name}: {value} # {effect}");
        }
    }
    for (name, effect) in asked(draft) {
        let _ = writeln!(lines, "  {name}: {OPEN} # no column was found; {effect}");
    }
    let missing = Quantity::ALL
        .into_iter()
        .map(Quantity::signal)
        .filter(|name| !draft.has(name));
    let missing: Vec<&str> = missing.collect();
    let note = if missing.is_empty() {
        String::new()
    } else {
        format!("# No column was found for {}.\n", missing.join(", "))
    };
    let heading = "\n# Signals that are not recorded and constant: signal -> value, in the unit at the end of the signal's name.\n";
    if lines.is_empty() {
        format!("{heading}{note}constants: {{}}\n")
    } else {
        format!("{heading}{note}constants:\n{lines}")
    }
}

/// Usual errors of an instrument: uncertainty after calibration, ordinary error and fault. Each has
/// a bias and a scale error in percent, and is empty if the signal has none.
struct UsualErrors {
    signals: &'static [&'static str],
    uncertainty: &'static str,
    ordinary: &'static str,
    fault: &'static str,
}

/// Errors of usual flight-test instruments.
const USUAL: &[UsualErrors] = &[
    UsualErrors {
        signals: &[signal::P, signal::Q, signal::R],
        uncertainty: "bias: 0.05, scale_pct: 0.1",
        ordinary: "bias: 0.1, scale_pct: 0.5",
        fault: "bias: 0.5, scale_pct: 5",
    },
    UsualErrors {
        signals: &[signal::AN, signal::AX, signal::AY],
        uncertainty: "bias: 0.01, scale_pct: 0.1",
        ordinary: "bias: 0.01, scale_pct: 0.3",
        fault: "bias: 0.05, scale_pct: 5",
    },
    UsualErrors {
        signals: &[signal::ALPHA_VANE, signal::BETA_VANE],
        uncertainty: "bias: 0.1",
        ordinary: "bias: 0.3, scale_pct: 2",
        fault: "bias: 2, scale_pct: 10",
    },
    UsualErrors {
        signals: &[signal::VELOCITY],
        uncertainty: "bias: 1, scale_pct: 0.2",
        ordinary: "bias: 3, scale_pct: 1",
        fault: "bias: 20, scale_pct: 5",
    },
    UsualErrors {
        signals: &[signal::THETA, signal::PHI, signal::PSI],
        uncertainty: "bias: 0.1",
        ordinary: "bias: 0.2, scale_pct: 0.5",
        fault: "bias: 1, scale_pct: 5",
    },
    UsualErrors {
        signals: &[signal::QBAR],
        uncertainty: "scale_pct: 0.5",
        ordinary: "bias: 1, scale_pct: 3",
        fault: "bias: 10, scale_pct: 15",
    },
    UsualErrors {
        signals: &[signal::ALTITUDE],
        uncertainty: "",
        ordinary: "bias: 100, scale_pct: 1",
        fault: "bias: 1000, scale_pct: 5",
    },
    UsualErrors {
        signals: &[signal::MACH],
        uncertainty: "",
        ordinary: "bias: 0.005, scale_pct: 2",
        fault: "bias: 0.05, scale_pct: 10",
    },
    UsualErrors {
        signals: &[signal::THRUST],
        uncertainty: "scale_pct: 1",
        ordinary: "",
        fault: "",
    },
];

/// Errors of the transducer of a surface.
const OF_SURFACES: UsualErrors = UsualErrors {
    signals: &[],
    uncertainty: "bias: 0.05, scale_pct: 0.2",
    ordinary: "",
    fault: "",
};

/// Errors of mass and inertias that are given as constants. Mass: half of the fuel burnt in a
/// training or test flight. Inertias: the error of an estimate from type data.
const OF_CONSTANTS: [(&str, UsualErrors); 4] = [
    (signal::MASS, of_constant("scale_pct: 3")),
    (signal::IX, of_constant("scale_pct: 5")),
    (signal::IY, of_constant("scale_pct: 5")),
    (signal::IZ, of_constant("scale_pct: 5")),
];

const fn of_constant(uncertainty: &'static str) -> UsualErrors {
    UsualErrors {
        signals: &[],
        uncertainty,
        ordinary: "",
        fault: "",
    }
}

impl UsualErrors {
    /// Line of a signal.
    fn line(&self, signal: &str) -> String {
        let kinds = [
            ("uncertainty", self.uncertainty),
            ("ordinary", self.ordinary),
            ("fault", self.fault),
        ];
        let given = kinds.iter().filter(|(_, sizes)| !sizes.is_empty());
        let given: Vec<String> = given
            .map(|(kind, sizes)| format!("{kind}: {{ {sizes} }}"))
            .collect();
        format!("  {signal}: {{ {} }}\n", given.join(", "))
    }
}

fn instruments(draft: &Draft) -> String {
    let of_signals = USUAL.iter().flat_map(|usual| {
        let recorded = usual.signals.iter().filter(|name| draft.has(name));
        recorded.map(|name| usual.line(name))
    });
    let surfaces = draft.inputs().filter(|(_, input)| input.kind.is_surface());
    let of_surfaces = surfaces.map(|(channel, _)| OF_SURFACES.line(&channel.signal));
    let constant = OF_CONSTANTS
        .iter()
        .filter(|(name, _)| !draft.has(name) && !has_no_effect(name, draft));
    let of_constants = constant.map(|(name, errors)| errors.line(name));
    let lines: String = of_signals.chain(of_surfaces).chain(of_constants).collect();
    let map = if lines.is_empty() { " {}\n" } else { "\n" };
    format!(
        "
# Sizes of the errors of the instruments, in the signal's unit and in percent: what calibration leaves (uncertainty), what a
# healthy instrument has (ordinary), and what makes it faulty (fault). These are usual ones; give the recorder's own. Signals
# without an uncertainty count as exact, unless the flight itself determines their errors. A scale error of mass or of an
# inertia is one of all derivatives of a force or a moment (mass_slug: {{ uncertainty: {{ scale_pct: 0.5 }} }}).
instruments:{map}{lines}"
    )
}
