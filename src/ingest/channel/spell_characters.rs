//! Characters of the spells of a channel that its samples still depend on.

use std::collections::VecDeque;
use std::ops::Range;

use super::character::{Character, SPELL};

/// Characters of the spells that samples still depend on.
#[derive(Clone, Debug)]
pub struct Characters {
    /// Characters from spell `first_spell` on.
    kept: VecDeque<Character>,
    first_spell: usize,
    pub latest: Character,
    /// Noises and periods of all spells, for the statistics.
    pub noises: Vec<f64>,
    pub periods: Vec<usize>,
}

impl Characters {
    /// Characters before the first spell.
    pub fn none() -> Characters {
        Characters {
            kept: VecDeque::new(),
            first_spell: 0,
            latest: Character::UNKNOWN,
            noises: Vec::new(),
            periods: Vec::new(),
        }
    }

    /// Number of the next spell to be characterised.
    pub fn next_spell(&self) -> usize {
        self.first_spell + self.kept.len()
    }

    /// Adds the character of the next spell.
    pub fn push(&mut self, character: Character) {
        if character.noise.is_finite() {
            self.noises.push(character.noise);
        }
        self.periods.push(character.rate.period);
        self.latest = character;
        self.kept.push_back(character);
    }

    /// Character of the spell of a sample.
    pub fn at(&self, sample: usize) -> &Character {
        let spell = (sample / SPELL).saturating_sub(self.first_spell);
        self.kept.get(spell).unwrap_or(&Character::UNKNOWN)
    }

    /// Parts of a range of samples that have one character, as offsets from `from`.
    pub fn parts(&self, from: usize, length: usize) -> Vec<(Range<usize>, Character)> {
        let to = from + length;
        let cut = |spell: usize| (spell * SPELL).clamp(from, to) - from;
        let spells = from / SPELL..to.div_ceil(SPELL);
        spells
            .map(|spell| (cut(spell)..cut(spell + 1), *self.at(spell * SPELL)))
            .collect()
    }

    /// Drops the spells before a sample's.
    pub fn drop_before(&mut self, sample: usize) {
        while self.first_spell < sample / SPELL && !self.kept.is_empty() {
            self.kept.pop_front();
            self.first_spell += 1;
        }
    }
}
