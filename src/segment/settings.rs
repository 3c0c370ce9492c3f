//! Settings of segment: sizes of steps, pauses, and the limits of quality.

use std::collections::BTreeMap;

use crate::settings::{elements, settings};

settings! {
    /// Settings of the search for maneuvers; times in s.
    pub struct Settings {
        /// Flag signal that is up while the on-board excitation system moves the surfaces; may be
        /// left out. It is drawn, and a flight without it is listed in `problems`. A surface that steps while it is
        /// up is not taken for feedback to the pilot, unless the flag is stuck.
        pub excitation_flag: String = String::new(),
        /// Signals of the pilot's controls. A surface that steps with a control is geared to it; a
        /// surface that steps right after a control is feedback. Neither counts as excitation by
        /// the on-board system.
        pub pilot_controls: Vec<String> = Vec::new(),
        /// Smallest change of each signal that counts as a step, in the signal's unit. Smaller:
        /// turbulence and feedback are counted as steps. Larger: small doublets are missed. Classes
        /// count steps of these signals only.
        pub steps: BTreeMap<String, f64> = BTreeMap::new(),
        /// Limits beyond which a maneuver is rejected.
        pub quality: QualityLimits = QualityLimits::default(),
    }
    expert {
        /// Smallest first and last pilot step of a maneuver, as a share of the smallest step. They
        /// deflect the control from trim and return it, by half a reversal or less. Larger: the
        /// maneuver's window may cut them off. They are never counted.
        pub deflection_share: f64 = 0.45,
        /// Longest duration of a step: a full reversal at the actuators' rate limit. Larger: slower
        /// motion counts as steps.
        pub transit_s: f64 = 0.15,
        /// Time over which the level before and after a step is averaged. Larger: less noise, and
        /// steps close together merge.
        pub level_s: f64 = 0.125,
        /// Smallest step, in standard deviations of the signal's own changes. Larger: fewer steps
        /// from feedback in turbulence, more missed edges.
        pub steps_over_noise: f64 = 4.0,
        /// Share of a signal's largest step in a maneuver below which its steps count as feedback.
        /// The default lies below a deflection from trim, about half a reversal.
        pub outstanding_share: f64 = 0.35,
        /// Smallest motion of a pilot control that gears a surface to it, as a share of the
        /// control's smallest step. Smaller: more surface steps are attributed to the pilot.
        pub geared_share: f64 = 0.35,
        /// Longest delay of a geared surface behind its control: filters and actuators. Larger: more
        /// surface steps are attributed to the pilot.
        pub gearing_s: f64 = 0.4,
        /// Time after a pilot's step in which surface steps count as feedback: the first overshoot
        /// of the response.
        pub answer_s: f64 = 1.0,
        /// Shortest pause between two maneuvers. Larger: maneuvers that follow each other closely
        /// merge.
        pub shortest_pause_s: f64 = 0.7,
        /// Longest time that a pilot holds a control away from trim within one maneuver: half a slow
        /// oscillation. Smaller: slow maneuvers come apart.
        pub longest_hold_s: f64 = 4.0,
        /// Longest rest of all controls at trim within one maneuver. A longer one ends it, and later
        /// steps are recovery, unless the pilot goes over to another control of the class.
        pub longest_rest_s: f64 = 2.0,
        /// Least share of the pause between two maneuvers that the first one's decay keeps, and of
        /// the lead-in that the second may use. Larger: longer decay, shorter lead-in. The lead-in
        /// matters more: the inputs before a decay have determined most derivatives.
        pub shared_lead_in: f64 = 0.25,
        /// Fewest steps of excitation that is reported when it fits no class. The default is the
        /// edges of one doublet. Smaller: flickering flags and turns appear in `unknown`.
        pub fewest_steps: usize = 3,
    }
}

settings! {
    /// Stops and rate of a surface's actuator.
    pub struct Actuator {
        /// Lower stop, deg.
        pub lower_deg: f64,
        /// Upper stop, deg.
        pub upper_deg: f64,
        /// Highest rate, deg/s.
        pub rate_deg_s: f64,
    }
}
elements!(BTreeMap<String, Actuator>: Actuator as "<surface>");

settings! {
    /// Limits beyond which a maneuver is not estimated.
    pub struct QualityLimits {
        /// Largest motion in the lead-in over motion in the maneuver. Larger: maneuvers with
        /// residual motion before their inputs pass, whose initial state dominates the derivatives.
        pub lead_in_motion: f64 = 0.5,
        /// Largest root mean square of alpha about its mean, deg. The default is the spacing of the
        /// trends. Larger: maneuvers pass during which the derivatives are not constant.
        pub alpha_rms_deg: f64 = 5.0,
        /// Largest share of the axis's angular acceleration that the motion of the other axis makes.
        /// Larger: maneuvers pass that errors of the other axis's gyros move.
        pub other_axis: f64 = 0.2,
        /// Smallest signal-to-noise ratio. Smaller: maneuvers pass whose response noise hides.
        pub signal_to_noise: f64 = 5.0,
        /// Largest share of the inputs' time that a surface is at a stop, where it excites nothing.
        pub saturated_share: f64 = 0.5,
        /// Largest share of the inputs' time that a surface moves at its actuator's rate, where it
        /// follows no command. Its measured motion enters the equations, so less does no harm.
        pub rate_limited_share: f64 = 0.8,
        /// Largest share of marked samples: bridged, despiked, missing or stuck. Segment applies it
        /// to all signals of a maneuver, estimate to the outputs together and to each surface.
        /// Larger: more maneuvers are estimated from repaired samples.
        pub marked_share: f64 = 0.2,
        /// Stops and rate of each surface's actuator, by signal. A surface without an entry is never
        /// saturated or rate-limited.
        pub actuators: BTreeMap<String, Actuator> = BTreeMap::new(),
    }
}
