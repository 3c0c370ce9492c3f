//! Groups of maneuvers of one class and nearly one angle of attack.

use serde::Serialize;

use crate::estimate::settings::JointSettings;
use crate::maneuver::Maneuver;

/// A group of maneuvers to be estimated together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// `maneuver_id` of its rows: `joint/<class>/<mean α>`.
    pub joint_id: String,
    pub class: String,
    /// Indices in the list of maneuvers, ascending; two or more.
    pub members: Vec<usize>,
}

/// Groups maneuvers by class and angle of attack; a group has two or more.
#[must_use]
pub fn bins(maneuvers: &[Maneuver], settings: &JointSettings) -> Vec<Bin> {
    let mut classes: Vec<&str> = maneuvers.iter().map(|m| m.class.as_str()).collect();
    classes.sort_unstable();
    classes.dedup();
    let mut bins = Vec::new();
    for class in classes {
        let mut of_class: Vec<usize> = (0..maneuvers.len())
            .filter(|&i| maneuvers[i].class == class)
            .collect();
        of_class.sort_by(|&a, &b| maneuvers[a].alpha_deg.total_cmp(&maneuvers[b].alpha_deg));
        let alpha = |&i: &usize| maneuvers[i].alpha_deg;
        let groups = if settings.centres_deg.is_empty() {
            split_at_gaps(&of_class, &alpha, settings.alpha_bin_deg)
        } else {
            group_by_centre(&of_class, &alpha, settings)
        };
        for mut members in groups.into_iter().filter(|g| g.len() > 1) {
            let mean = members.iter().map(alpha).sum::<f64>() / members.len() as f64;
            members.sort_unstable();
            bins.push(Bin {
                joint_id: format!("joint/{class}/{mean:.2}"),
                class: class.to_owned(),
                members,
            });
        }
    }
    bins
}

/// Splits maneuvers, sorted by angle of attack, at the widest gap until no group is wider than
/// `widest_deg`.
fn split_at_gaps(
    sorted: &[usize],
    alpha: &dyn Fn(&usize) -> f64,
    widest_deg: f64,
) -> Vec<Vec<usize>> {
    let (Some(first), Some(last)) = (sorted.first(), sorted.last()) else {
        return vec![];
    };
    if alpha(last) - alpha(first) <= widest_deg {
        return vec![sorted.to_vec()];
    }
    let gap = |i: &usize| alpha(&sorted[*i]) - alpha(&sorted[*i - 1]);
    let Some(at) = (1..sorted.len()).max_by(|a, b| gap(a).total_cmp(&gap(b)).then(b.cmp(a))) else {
        return vec![];
    };
    let (low, high) = sorted.split_at(at);
    [
        split_at_gaps(low, alpha, widest_deg),
        split_at_gaps(high, alpha, widest_deg),
    ]
    .concat()
}

/// Groups maneuvers by the nearest centre within half of `alpha_bin_deg`.
fn group_by_centre(
    sorted: &[usize],
    alpha: &dyn Fn(&usize) -> f64,
    settings: &JointSettings,
) -> Vec<Vec<usize>> {
    let centres = &settings.centres_deg;
    let nearest = |i: &usize| {
        let distance = |c: &usize| (alpha(i) - centres[*c]).abs();
        let centre = (0..centres.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        (distance(&centre) <= settings.alpha_bin_deg / 2.0).then_some(centre)
    };
    let of = |c: usize| {
        sorted
            .iter()
            .copied()
            .filter(|i| nearest(i) == Some(c))
            .collect()
    };
    (0..centres.len()).map(of).collect()
}
