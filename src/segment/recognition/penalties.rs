//! Penalties of a cut: the tie-breakers by which one way to cut a sequence of steps into maneuvers
//! is better than another.
//!
//! Cuts are compared term by term in the order of the fields of [`Penalties`]; a term decides only
//! where all before it are equal:
//!
//! 1. `unexplained_steps`: fewer steps that are no input of a maneuver.
//! 2. `steps_in_pulses`: more steps explained as pulses of known lengths.
//! 3. `flag_gaps`: fewer gaps of the excitation flag within a maneuver.
//! 4. `maneuvers`: fewer maneuvers.
//! 5. `short_pauses`: fewer pauses too short for the decay and the lead-in on their sides.
//! 6. `unlike_repeats`: fewer maneuvers that follow one of their class with other steps.
//! 7. `loose_ends`: fewer inputs away from trim at the end, and fewer returns to an input.
//! 8. `pauses_s`: longer pauses between the maneuvers.

use std::cmp::Reverse;
use std::ops::Add;

/// Penalties of a cut, of a maneuver in it, or of the pause before a maneuver: less is better, term
/// by term.
///
/// Terms of which more is better are in [`Reverse`].
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub(super) struct Penalties {
    /// Steps that are no input of a maneuver. Excitation has a purpose, so a cut that explains more
    /// steps is closer to the flown maneuvers.
    pub unexplained_steps: usize,
    /// Steps that rules about lengths of pulses explain: prescribed lengths fit by chance less
    /// often than numbers of steps.
    pub steps_in_pulses: Reverse<usize>,
    /// Gaps of the excitation flag within a maneuver: the flag rests between maneuvers.
    pub flag_gaps: usize,
    /// Number of maneuvers: steps that one maneuver explains need no second.
    pub maneuvers: usize,
    /// Pauses between maneuvers that are shorter than the decay before and the lead-in after them:
    /// test cards leave room for both.
    pub short_pauses: usize,
    /// Maneuvers of the same class as the one before that do not repeat its steps: an immediate
    /// repetition mostly has the same steps.
    pub unlike_repeats: usize,
    /// Inputs of a maneuver that do not end where they began, and returns to an input after another
    /// has stepped. A wrong cut increases both. The two are one term, for a step may pass
    /// undetected.
    pub loose_ends: usize,
    /// The pauses between the maneuvers, s: inputs of one maneuver follow each other closely.
    pub pauses_s: Reverse<f64>,
}

impl Add for Penalties {
    type Output = Penalties;

    fn add(self, more: Penalties) -> Penalties {
        Penalties {
            unexplained_steps: self.unexplained_steps + more.unexplained_steps,
            steps_in_pulses: Reverse(self.steps_in_pulses.0 + more.steps_in_pulses.0),
            flag_gaps: self.flag_gaps + more.flag_gaps,
            maneuvers: self.maneuvers + more.maneuvers,
            short_pauses: self.short_pauses + more.short_pauses,
            unlike_repeats: self.unlike_repeats + more.unlike_repeats,
            loose_ends: self.loose_ends + more.loose_ends,
            pauses_s: Reverse(self.pauses_s.0 + more.pauses_s.0),
        }
    }
}

impl Penalties {
    /// The terms in words: the unexplained steps, and every other term that is not zero.
    pub fn in_words(&self) -> String {
        let counts = [
            (
                self.unexplained_steps,
                "step unexplained",
                "steps unexplained",
            ),
            (self.steps_in_pulses.0, "step in pulses", "steps in pulses"),
            (self.flag_gaps, "flag gap", "flag gaps"),
            (self.maneuvers, "maneuver", "maneuvers"),
            (self.short_pauses, "short pause", "short pauses"),
            (self.unlike_repeats, "unlike repeat", "unlike repeats"),
            (self.loose_ends, "loose end", "loose ends"),
        ];
        let mut words: Vec<String> = counts
            .into_iter()
            .enumerate()
            .filter(|(k, (count, ..))| *count > 0 || *k == 0)
            .map(|(_, (count, one, many))| {
                format!("{count} {}", if count == 1 { one } else { many })
            })
            .collect();
        if self.pauses_s.0 > 0.0 {
            words.push(format!("pauses of {:.1} s", self.pauses_s.0));
        }
        words.join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For each term a cut that is worse than [`Penalties::default`] by this term alone.
    fn worse_by_one_term() -> [Penalties; 8] {
        let mut worse = [Penalties::default(); 8];
        worse[0].unexplained_steps = 1;
        worse[1].steps_in_pulses = Reverse(0);
        worse[2].flag_gaps = 1;
        worse[3].maneuvers = 1;
        worse[4].short_pauses = 1;
        worse[5].unlike_repeats = 1;
        worse[6].loose_ends = 1;
        worse[7].pauses_s = Reverse(-1.0);
        worse
    }

    #[test]
    fn a_term_decides_only_where_all_before_it_are_equal() {
        let pulses = Penalties {
            steps_in_pulses: Reverse(1),
            ..Penalties::default()
        };
        let mut worse = worse_by_one_term();
        for (k, cut) in worse.iter_mut().enumerate() {
            // The second term is a count of which more is better: all others have one.
            cut.steps_in_pulses = Reverse(usize::from(k != 1));
            assert!(pulses < *cut, "{cut:?}");
        }
        for pair in worse.windows(2) {
            assert!(pair[1] < pair[0], "{pair:?}");
        }
    }
    #[test]
    fn terms_that_are_zero_are_left_out_of_the_words_except_the_first() {
        let one = Penalties {
            maneuvers: 1,
            ..Penalties::default()
        };
        assert_eq!(one.in_words(), "0 steps unexplained, 1 maneuver");
        let two = Penalties {
            unexplained_steps: 1,
            steps_in_pulses: Reverse(5),
            maneuvers: 2,
            pauses_s: Reverse(1.6),
            ..Penalties::default()
        };
        assert_eq!(
            two.in_words(),
            "1 step unexplained, 5 steps in pulses, 2 maneuvers, pauses of 1.6 s"
        );
    }
}
