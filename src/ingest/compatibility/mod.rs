//! Data compatibility by flight-path reconstruction: the error of each instrument of a flight, with
//! its standard deviation, from the kinematic equations alone, before any aerodynamics.
//!
//! The rates and accelerations drive the equations of motion through the windows of the flight in
//! which most moves. The reconstructed motion is matched to the vanes, the airspeed, the attitudes,
//! the altitude and the pressures by output error. The windows share the biases, scale errors and
//! delays of all instruments. Surfaces, thrust and mass are in no kinematic equation, so this check
//! cannot find their faults.

mod decimation;
mod equations;
mod error_bounds;
mod error_estimates;
mod error_sizes;
mod findings;
mod parameter_noise;
mod joint_fit;
mod joint_state;
mod measured_terms;
mod parameters;
mod reconstruction;
mod row_correction;
mod settings;
mod vane_positions;
mod window;
mod window_choice;
mod window_fit;
mod window_sums;

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

pub use error_estimates::{ErrorEstimate, ErrorEvidence};
pub use error_sizes::{ErrorSize, ErrorSizes};
pub use findings::{Findings, InstrumentFinding};
pub use row_correction::correction;
pub use settings::{Action, Compatibility, OnFault};

use rayon::prelude::*;

use crate::aircraft::Aircraft;
use crate::flight::{Channel, Record, signal};
use window::Window;
use window_choice::choose_windows;

/// Signals that the reconstruction reads from a record.
#[must_use]
pub fn signals() -> BTreeSet<String> {
    parameters::SIGNALS
        .iter()
        .chain(&[
            signal::X_CG,
            signal::Y_CG,
            signal::Z_CG,
            signal::AIR_TEMPERATURE,
        ])
        .map(|s| (*s).to_owned())
        .collect()
}

/// Least number of windows for naming a fault: with fewer their scatter does not confirm it.
const FEWEST_TO_NAME: usize = 3;

/// Removes a heading that is missing in most of a record. A window uses a heading only if it is
/// complete; the other instruments can be examined without it.
fn leave_out_rare_heading(record: &mut Record) {
    let heading = record.values(signal::PSI).unwrap_or_default();
    let finite = heading.iter().filter(|v| v.is_finite()).count();
    if 2 * finite < heading.len() {
        record.signals.remove(signal::PSI);
    }
}

/// Examines the instruments of a record; `recorded` are the signals that come from channels. A long
/// record has `count` parts, each of which has its share of the windows; `read` reads a part.
#[must_use]
pub fn examine(
    (count, read): (usize, impl Fn(usize) -> Option<Record> + Sync + Send),
    channels: &BTreeMap<String, Channel>,
    recorded: &[String],
    aircraft: &Aircraft,
    settings: &Compatibility,
) -> Findings {
    if !settings.reconstruct {
        return Findings::default();
    }
    let share = settings.windows.div_ceil(count.max(1));
    let windows_of = |mut record: Record| -> Vec<Window> {
        leave_out_rare_heading(&mut record);
        let ranges = choose_windows(&record, share, settings).into_iter();
        ranges
            .map(|range| Window::of(&record, range, aircraft, settings))
            .collect()
    };
    let parts = (0..count).into_par_iter().filter_map(read);
    let windows: Vec<Window> = parts.flat_map_iter(windows_of).collect();
    let errors = joint_fit::fit(&windows, aircraft, settings);
    if windows.len() < FEWEST_TO_NAME {
        return Findings::of(errors.as_ref(), channels, recorded, settings).without_faults();
    }
    let explained = errors
        .as_ref()
        .and_then(|e| vane_positions::explained(e, &windows, aircraft, settings));
    let Some((errors, positions)) = explained else {
        return Findings::of(errors.as_ref(), channels, recorded, settings);
    };
    Findings::of(Some(&errors), channels, recorded, settings).with_positions(&positions)
}
