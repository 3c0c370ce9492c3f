//! Time histories as the report draws them: thinned, relative to the first sample, one per class.

use super::contents::{Contents, group_by};
use super::figure::scale::{Scale, extent};
use super::page_selection;
use crate::numerics::digits::with_six_digits;
use crate::tables::{History, HistoryOutput};

/// Largest number of samples of one signal: more cannot be distinguished in a column of the page.
const MOST_SAMPLES: usize = 240;

/// Reduces a history to what a figure can show: every n-th sample, with six significant digits, and
/// every sample that is excluded from the cost.
#[must_use]
pub fn thinned(history: &History) -> History {
    let step = history.time_s.len().div_ceil(MOST_SAMPLES).max(1);
    let kept: Vec<usize> = (0..history.time_s.len())
        .filter(|i| i % step == 0 || history.outputs.iter().any(|o| is_marked(o, *i)))
        .collect();
    let output = |o: &HistoryOutput| HistoryOutput {
        label: o.label.clone(),
        unit: o.unit.clone(),
        measured: rounded_at(&kept, &o.measured),
        computed: rounded_at(&kept, &o.computed),
        marked: kept.iter().map(|i| is_marked(o, *i)).collect(),
    };
    History {
        maneuver_id: history.maneuver_id.clone(),
        class: history.class.clone(),
        alpha_deg: history.alpha_deg,
        time_s: rounded_at(&kept, &history.time_s),
        outputs: history.outputs.iter().map(output).collect(),
        controls: history
            .controls
            .iter()
            .map(|(name, values)| (name.clone(), rounded_at(&kept, values)))
            .collect(),
    }
}

/// `true` for a sample that is excluded from the cost.
pub fn is_marked(output: &HistoryOutput, sample: usize) -> bool {
    output.marked.get(sample).copied().unwrap_or(false)
}

fn rounded_at(samples: &[usize], values: &[f64]) -> Vec<f64> {
    samples
        .iter()
        .map(|i| values.get(*i).map_or(f64::NAN, |v| with_six_digits(*v)))
        .collect()
}

/// The history of each class's representative maneuver, in the order of the configuration.
#[must_use]
pub fn representatives<'a>(contents: &Contents<'a>) -> Vec<&'a History> {
    let chosen = page_selection::representatives(
        contents.maneuvers,
        contents.fits,
        contents.typical_alpha_deg,
    );
    let by_class = group_by(contents.histories, |h| &h.class);
    let configured: Vec<&str> = contents.classes.iter().map(|c| c.name.as_str()).collect();
    let unconfigured = by_class.keys().copied().filter(|c| !configured.contains(c));
    configured
        .iter()
        .copied()
        .chain(unconfigured)
        .filter_map(|class| {
            let histories = by_class.get(class)?.iter().copied();
            histories
                .into_iter()
                .find(|h| chosen.contains(h.maneuver_id.as_str()))
        })
        .collect()
}

/// Time since the first sample, s.
fn seconds(history: &History) -> impl Iterator<Item = f64> {
    let start = extent(history.time_s.iter().copied()).map_or(0.0, |(first, _)| first);
    history.time_s.iter().map(move |t| t - start)
}

/// Time axis of a history, from zero to its duration.
#[must_use]
pub fn time_scale(history: &History) -> Scale {
    let duration_s = extent(seconds(history)).map_or(1.0, |(_, last)| last);
    scale_until(duration_s.max(1e-3))
}

/// Time axis from zero to `end_s`, which need not be a round number.
#[must_use]
pub fn scale_until(end_s: f64) -> Scale {
    Scale {
        max: end_s,
        ..Scale::covering(0.0, end_s)
    }
}

/// Finite samples of a signal with their times.
#[must_use]
pub fn points(history: &History, values: &[f64]) -> Vec<(f64, f64)> {
    seconds(history)
        .zip(values.iter().copied())
        .filter(|(t, v)| t.is_finite() && v.is_finite())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::campaign_fixture::campaign;

    #[test]
    fn the_converged_maneuver_nearest_to_the_configured_angle_represents_its_class() {
        let campaign = campaign();
        let contents = Contents {
            typical_alpha_deg: 12.0,
            ..campaign.contents()
        };
        let histories = representatives(&contents);
        assert_eq!(histories.len(), campaign.classes.len());
        // The first class's maneuver at 10 deg did not converge.
        assert_eq!(
            histories.iter().map(|h| h.alpha_deg).collect::<Vec<_>>(),
            [20.0, 10.0, 10.0, 10.0]
        );
    }

    #[test]
    fn thinning_keeps_every_excluded_sample() {
        let history = campaign().histories.remove(0);
        let thin = thinned(&history);
        assert_eq!(
            thin.time_s.len(),
            200,
            "every third; the excluded one is among them"
        );
        assert_eq!(thin.outputs[0].marked.iter().filter(|m| **m).count(), 1);
        assert_eq!(thinned(&thin), thin);
        let mut longer = history;
        longer.outputs[0].marked[301] = true;
        assert_eq!(thinned(&longer).time_s.len(), 201);
    }
}
