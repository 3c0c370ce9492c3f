//! Parts of a tall file: names that share a clock.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::source::Tall;
use super::survey::{Clock, NamedValues, Survey};
use crate::error::Result;

impl Tall {
    /// Names of each part: first those on the clock of the name with the most values, then the
    /// others by their clocks. Values are sorted beside `scratch`.
    pub(super) fn parts(&self, survey: &Survey, scratch: &Path) -> Result<Vec<BTreeSet<String>>> {
        let names = || survey.names.iter();
        let most = names().max_by_key(|(_, values)| values.count);
        let Some(main) = most.map(|(_, values)| values.count) else {
            return Ok(vec![BTreeSet::new()]);
        };
        let is_main = |(_, values): &(&String, &NamedValues)| values.count == main;
        let Some((main, clock)) = names().find(is_main).map(|(n, v)| (n, v.clock())) else {
            return Ok(vec![BTreeSet::new()]);
        };
        let shared = if names().all(|(_, values)| values.clock() == clock) {
            BTreeMap::new()
        } else {
            self.times_shared(survey, main, scratch)?
        };
        let mut on_main = BTreeSet::new();
        let mut others: BTreeMap<Clock, BTreeSet<String>> = BTreeMap::new();
        for (name, values) in names() {
            let shared = shared.get(name).copied().unwrap_or_default();
            if values.clock() == clock || 2 * shared >= values.count {
                on_main.insert(name.clone());
            } else {
                let same_clock = others.entry(values.clock()).or_default();
                same_clock.insert(name.clone());
            }
        }
        Ok(std::iter::once(on_main)
            .chain(others.into_values())
            .collect())
    }

    /// Number of the times of each name at which another name also has a value.
    fn times_shared<'s>(
        &self,
        survey: &'s Survey,
        main: &str,
        scratch: &Path,
    ) -> Result<BTreeMap<&'s String, usize>> {
        let places: BTreeMap<&str, usize> =
            survey.names.keys().map(String::as_str).zip(0..).collect();
        let main = places.get(main).copied();
        let mut shared = vec![0_usize; places.len()];
        let mut at_once: Vec<usize> = Vec::new();
        let mut now = f64::NAN;
        let mut count = |at_once: &mut Vec<usize>| {
            if at_once.iter().any(|place| Some(*place) == main) {
                for place in at_once.iter() {
                    shared[*place] += 1;
                }
            }
            at_once.clear();
        };
        let place = |name: &str| places.get(name).copied();
        self.in_order(survey, scratch, &place, &mut |time, place, _| {
            if time.to_bits() != now.to_bits() {
                count(&mut at_once);
                now = time;
            }
            at_once.push(place);
            Ok(())
        })?;
        count(&mut at_once);
        Ok(survey.names.keys().zip(shared).collect())
    }
}
