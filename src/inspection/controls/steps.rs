//! Steps of surfaces and pilot controls: inputs that move, those that only follow feedback, and the
//! size of a step.

use std::ops::Range;

use crate::inspection::grid::Grid;
use crate::inspection::names::vocabulary::Input;
use crate::numerics::series::differences;
use crate::numerics::statistics::order_statistics::{median, quantile};
use crate::units::{Quantity, Unit};

/// Range of a surface that moves, deg.
const MOVES_DEG: f64 = 0.5;
/// Share of the samples beyond an input's range, and of the changes beyond its quickest one, that
/// are ignored.
const RARELY: f64 = 0.002;
/// Longest time that is ignored as rare, s: in hours of recording a single maneuver moves its
/// surfaces for longer.
const RARELY_S: f64 = 0.5;
/// Size of a step relative to the quickest change, so that the smallest of several inputs counts as
/// well.
const STEP_SHARE: f64 = 0.2;
/// Steps of the grid in which a step happens.
const STEP_TIME: usize = 3;
/// Share of the quickest change of the liveliest input of its kind below which an input only
/// follows feedback. In recordings of one axis of the demonstration the surfaces of the other axis
/// reach 0.01 to 0.07. The slowest of the surfaces that are stepped, the flaps, reach 0.26.
const FEEDBACK_SHARE: f64 = 0.1;
/// Least size of a step in standard deviations of an input's noise: one sample in sixteen thousand
/// is beyond it. Controls of the demonstration that nobody touches have
/// 3, and those that are stepped have 79 or more.
const STEP_SIGMAS: f64 = 4.0;

/// Size of the motion of an input.
#[derive(Clone, Debug, PartialEq)]
pub struct Excursions<'a> {
    column: &'a str,
    is_surface: bool,
    unit: Unit,
    /// Range without rare samples, in the unit.
    range: f64,
    /// Quickest change within the time of a step without rare ones, in the unit.
    change: f64,
    /// Standard deviation of the noise, in the unit.
    noise: f64,
}

/// Activity of an input: the size of its steps, or why it has none.
#[derive(Clone, Debug, PartialEq)]
pub enum InputActivity {
    /// Size in the unit recorded.
    Size(f64),
    /// Nothing but the feedback that follows the motion, beside the input that is named.
    Feedback(String),
    /// Nothing that stands out of the noise.
    Noise,
}

impl InputActivity {
    #[must_use]
    pub fn size(&self) -> Option<f64> {
        match self {
            InputActivity::Size(size) => Some(*size),
            InputActivity::Feedback(_) | InputActivity::Noise => None,
        }
    }

    /// Reason for which an input has no step, in words.
    #[must_use]
    pub fn reason_without_step(&self) -> Option<String> {
        match self {
            InputActivity::Size(_) => None,
            InputActivity::Feedback(liveliest) => Some(format!(
                "it changes by less than {FEEDBACK_SHARE} of what {liveliest} does, as feedback does: no step and no class"
            )),
            InputActivity::Noise => {
                Some("no change stands out of its noise: no step and no class".to_owned())
            }
        }
    }
}

impl<'a> Excursions<'a> {
    /// Measures the motion of a column, in the column's unit: range and largest change within a
    /// step's time (both without rare extremes), and noise.
    #[must_use]
    pub fn of(grid: &Grid, column: &'a str, kind: Input, unit: Unit) -> Excursions<'a> {
        let values = grid.columns.get(column).map_or(&[][..], Vec::as_slice);
        let rarely = rare_share(grid);
        let range = quantile(values.iter().copied(), 1.0 - rarely)
            .zip(quantile(values.iter().copied(), rarely));
        let changes = windows(grid, values, STEP_TIME + 1).map(|w| (w[STEP_TIME] - w[0]).abs());
        let seconds =
            windows(grid, values, 3).map(|w| differences::second(&[w[0], w[1], w[2]]).abs());
        let noise = median(seconds).map(differences::noise_of_second);
        Excursions {
            column,
            is_surface: kind.is_surface(),
            unit,
            range: range.map_or(0.0, |(high, low)| high - low),
            change: quantile(changes, 1.0 - rarely).unwrap_or_default(),
            noise: noise.unwrap_or_default(),
        }
    }

    /// `true` for a surface or a control that moves. Positions in other units than angles have no
    /// usual size.
    #[must_use]
    pub fn moves(&self) -> bool {
        let least = Unit::of_signal("_deg")
            .factor_to(self.unit)
            .filter(|_| self.is_surface && self.unit.quantity == Quantity::Angle)
            .map_or(0.0, |factor| MOVES_DEG * factor);
        self.range > least
    }

    /// Quickest change of another input of this kind, in this input's unit.
    fn beside(&self, other: &Excursions) -> Option<f64> {
        let factor = other.unit.factor_to(self.unit)?;
        (other.is_surface == self.is_surface).then_some(other.change * factor)
    }

    fn step(&self, all: &[Excursions]) -> InputActivity {
        let beside = all
            .iter()
            .filter_map(|other| Some((self.beside(other)?, other)));
        let liveliest = beside.max_by(|a, b| a.0.total_cmp(&b.0));
        let size = STEP_SHARE * self.change;
        match liveliest {
            Some((change, other)) if self.change < FEEDBACK_SHARE * change => {
                InputActivity::Feedback(other.column.to_owned())
            }
            _ if size <= STEP_SIGMAS * self.noise => InputActivity::Noise,
            _ => InputActivity::Size(size),
        }
    }
}

/// Activity of each of the inputs of a recording. Surfaces are compared with surfaces and controls with
/// controls, where their units are of one quantity.
#[must_use]
pub fn steps(inputs: &[Excursions]) -> Vec<InputActivity> {
    inputs.iter().map(|input| input.step(inputs)).collect()
}

/// Windows of values within the stretches of a grid.
fn windows<'a>(
    grid: &'a Grid,
    values: &'a [f64],
    length: usize,
) -> impl Iterator<Item = &'a [f64]> {
    let of_stretch = move |stretch: &Range<usize>| {
        let values = values.get(stretch.clone()).unwrap_or_default();
        values.windows(length)
    };
    grid.stretches.iter().flat_map(of_stretch)
}

/// Share of the samples of a grid that are rare.
fn rare_share(grid: &Grid) -> f64 {
    let samples: usize = grid.stretches.iter().map(Range::len).sum();
    let duration_s = samples as f64 * grid.step_s;
    RARELY.min(RARELY_S / duration_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::series::sample_count::whole_steps;

    const STEP_S: f64 = 0.1;

    /// Four hours of a surface at rest, with a doublet of this size in the middle that lasts this long.
    fn surface(size: f64, doublet_s: f64) -> Vec<f64> {
        let mut values: Vec<f64> = (0..144_000).map(|k| 0.02 * f64::from(k % 3)).collect();
        let (middle, half) = (72_000, whole_steps(0.5 * doublet_s, STEP_S));
        values[middle - half..middle].fill(size);
        values[middle..middle + half].fill(-size);
        values
    }

    fn grid(columns: &[(&str, Vec<f64>)]) -> Grid {
        let samples = columns.first().map_or(0, |(_, values)| values.len());
        Grid {
            step_s: STEP_S,
            stretches: vec![0..samples; 1],
            columns: columns
                .iter()
                .map(|(name, values)| ((*name).to_owned(), values.clone()))
                .collect(),
        }
    }

    fn unit(name: &str) -> Unit {
        Unit::parse(name).expect("a unit")
    }

    #[test]
    fn a_surface_that_one_maneuver_of_a_campaign_steps_is_a_surface_that_moves() {
        let grid = grid(&[("dsa", surface(4.0, 6.0))]);
        let dsa = Excursions::of(&grid, "dsa", Input::OtherSurface, unit("deg"));
        assert!(dsa.moves());
        let step = steps(&[dsa])[0].size().expect("a step");
        assert!((0.7..=1.7).contains(&step), "{step}");
    }

    #[test]
    fn a_surface_that_leaves_its_place_for_a_moment_rests() {
        let grid = grid(&[("dsa", surface(4.0, 0.4))]);
        let dsa = Excursions::of(&grid, "dsa", Input::OtherSurface, unit("deg"));
        assert!(!dsa.moves());
    }

    #[test]
    fn the_least_range_of_a_surface_is_in_its_own_unit() {
        let radians = surface(4.0, 6.0).iter().map(|v| v.to_radians()).collect();
        let grid = grid(&[("de", radians)]);
        let moves = |name: &str| Excursions::of(&grid, "de", Input::Elevator, unit(name)).moves();
        assert!(moves("rad") && !moves("deg"));
    }

    #[test]
    fn an_input_that_changes_little_beside_another_or_beside_its_noise_has_no_step() {
        let radians = |size: f64| {
            let degrees = surface(size, 6.0);
            degrees.iter().map(|v| v.to_radians()).collect::<Vec<_>>()
        };
        let noise = (0..144_000).map(|k| (1.7 * f64::from((k % 997) * (k % 997) % 997)).sin());
        let grid = grid(&[
            ("de", surface(6.0, 6.0)),
            ("da", radians(0.5)),
            ("dr", radians(1.0)),
            ("stick", noise.collect()),
        ]);
        let of = |column, kind, name: &str| Excursions::of(&grid, column, kind, unit(name));
        let found = steps(&[
            of("de", Input::Elevator, "deg"),
            of("da", Input::Aileron, "rad"),
            of("dr", Input::Rudder, "rad"),
            of("stick", Input::PitchStick, "in"),
        ]);
        assert!(found[0].size().is_some());
        assert_eq!(found[1], InputActivity::Feedback("de".to_owned()));
        assert!(found[2].size().is_some());
        assert_eq!(found[3], InputActivity::Noise);
    }
}
