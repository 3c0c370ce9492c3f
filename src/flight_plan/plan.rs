//! Plan of the next flight: candidates and goals to a choice, and the choice to the rows of the tables.

use super::candidate::{CandidateCard, reach_deg};
use super::choice::{
    Aim, AimPart, Budget, CardChoice, CardSet, CoefficientCovariance, Price, variance,
};
use super::experience::{CampaignHistory, noise_factors, with_noise};
use super::goal_points::{GoalBasis, GoalPoint, Matches, Target};
use super::goals::Goal;
use super::rehearsal::Rehearsed;
use crate::aero::{AeroModel, Condition, WindTunnel};
use crate::estimate::Covariance;
use crate::model::{self, ManeuverResults, Model, Outlook, OutlookPoint};
use crate::qualities::{self, FlownConditions};
use crate::tables::{NextCardRow, NextGoalRow};

/// Number of goals that a card's row names.
const NAMED_GOALS: usize = 3;

/// Posterior, history and model of a campaign, from which the next flight is planned.
#[derive(Clone, Copy, Debug)]
pub struct CampaignState<'a> {
    pub model: &'a Model,
    pub evidence: &'a [ManeuverResults<'a>],
    pub history: CampaignHistory<'a>,
    pub aero_model: &'a AeroModel,
    pub tunnel: &'a WindTunnel,
    pub settings: &'a model::Settings,
    /// Flying qualities whose levels may be goals, with the flown conditions.
    pub qualities: Option<(&'a qualities::JudgedAircraft<'a>, &'a FlownConditions)>,
    pub matches: &'a Matches,
}

/// A candidate with its rehearsal, or the reason why it is refused.
#[derive(Debug)]
pub struct Rehearsal {
    pub candidate: CandidateCard,
    pub result: Result<Rehearsed, String>,
}

/// A candidate that is not refused, with its index.
#[derive(Clone, Copy)]
struct KeptCard<'a> {
    candidate: &'a CandidateCard,
    rehearsed: &'a Rehearsed,
}

/// Rows of the next flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    pub cards: Vec<NextCardRow>,
    pub goals: Vec<NextGoalRow>,
    /// Minutes of the flight, with the changes of angle of attack.
    pub minutes: f64,
    /// Information of the flight, nats.
    pub information: f64,
}

impl Plan {
    /// Percentage by which the goals' standard deviations fall, in their weighted geometric mean.
    #[must_use]
    pub fn fall_pct(&self) -> f64 {
        100.0 * (1.0 - (-self.information).exp())
    }
}

/// Plans the next flight.
#[must_use]
pub fn plan(
    state: &CampaignState,
    rehearsals: &[Rehearsal],
    goals: &[Goal],
    budget: Budget,
) -> Plan {
    let kept: Vec<KeptCard> = rehearsals
        .iter()
        .filter_map(|rehearsal| {
            Some(KeptCard {
                candidate: &rehearsal.candidate,
                rehearsed: rehearsal.result.as_ref().ok()?,
            })
        })
        .collect();
    let points = goal_points(state, &kept, goals);
    let outlooks = outlooks(state, &kept, &points);
    let choice = CardChoice {
        aims: aims(&outlooks, &points),
        coefficients: knowledge(state, &kept, outlooks),
        prices: kept.iter().map(|card| price(card.candidate)).collect(),
        budget,
    };
    let flown = choice.choose();
    let rows = PlanRows {
        state,
        kept: &kept,
        points: &points,
        choice: &choice,
        flown: &flown,
    };
    let refused = rehearsals.iter().filter_map(|rehearsal| {
        let reason = rehearsal.result.as_ref().err()?;
        Some(NextCardRow {
            refused: reason.clone(),
            ..rows.of_candidate(&rehearsal.candidate)
        })
    });
    Plan {
        cards: rows.cards().into_iter().chain(refused).collect(),
        goals: rows.goals(),
        minutes: flown.minutes(),
        information: flown.worth(),
    }
}

fn price(candidate: &CandidateCard) -> Price {
    Price {
        minutes: candidate.minutes,
        alpha_deg: candidate.card.alpha_deg,
    }
}

/// Goals at each of their angles of attack.
fn goal_points(state: &CampaignState, kept: &[KeptCard], goals: &[Goal]) -> Vec<GoalPoint> {
    let basis = GoalBasis {
        model: state.model,
        qualities: state.qualities,
        matches: state.matches,
        reach_deg: reach_deg(kept.iter().map(|card| card.candidate)),
    };
    basis.points(goals, &|alpha_deg| condition(state, kept, alpha_deg))
}

/// Flight condition at an angle of attack: that of the nearest card; `None` without cards.
fn condition(state: &CampaignState, kept: &[KeptCard], alpha_deg: f64) -> Option<Condition> {
    let distance = |kept: &&KeptCard| (kept.candidate.card.alpha_deg - alpha_deg).abs();
    let nearest = kept
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)));
    let condition = nearest?.rehearsed.maneuver.condition(state.tunnel);
    Some(Condition {
        alpha_deg,
        ..condition
    })
}

/// Outlook of each coefficient on the cards, with the noise of the campaign's maneuvers, and on the
/// goals.
fn outlooks(state: &CampaignState, kept: &[KeptCard], points: &[GoalPoint]) -> Vec<Outlook> {
    let covariances = covariances(state, kept);
    let planned = kept.iter().zip(&covariances);
    let planned: Vec<ManeuverResults> = planned
        .filter_map(|(KeptCard { rehearsed, .. }, covariance)| {
            Some(ManeuverResults {
                maneuver: &rehearsed.maneuver,
                estimates: &rehearsed.estimated.estimates,
                combined: &rehearsed.estimated.combined,
                covariance: covariance.as_ref()?,
            })
        })
        .collect();
    let asked: Vec<OutlookPoint> = points.iter().map(|p| p.point.clone()).collect();
    state.model.outlook(
        (state.evidence, &planned),
        &asked,
        (state.aero_model, state.tunnel),
        state.settings,
    )
}

/// Aims of the goals: each has a part in every coefficient that has a row for it.
fn aims(outlooks: &[Outlook], points: &[GoalPoint]) -> Vec<Aim> {
    let mut parts: Vec<Vec<AimPart>> = vec![vec![]; points.len()];
    for (coefficient, outlook) in outlooks.iter().enumerate() {
        for &(point, row) in &outlook.points {
            parts[point].push(AimPart { coefficient, row });
        }
    }
    let all = points.iter().zip(parts).enumerate();
    let known = all.filter(|(_, (_, parts))| !parts.is_empty());
    known
        .map(|(point, (goal, parts))| {
            let before = variance(&parts, |coefficient| &outlooks[coefficient].covariance);
            let before = before.max(0.0).sqrt();
            Aim {
                parts,
                weight: goal.weight,
                wanted: goal.target.wanted(before),
                point,
            }
        })
        .collect()
}

/// Covariance of each coefficient with the observations of the cards. Only a share of a class's
/// maneuvers is usable, by experience, so the noise covariance of its rows is divided by this
/// share.
fn knowledge(
    state: &CampaignState,
    kept: &[KeptCard],
    outlooks: Vec<Outlook>,
) -> Vec<CoefficientCovariance> {
    let share = |kept: &KeptCard| {
        let experience = state.history.of(&kept.candidate.card.class);
        experience.usable * experience.weight
    };
    let shares: Vec<f64> = kept.iter().map(share).collect();
    let of_coefficient = |outlook: Outlook| {
        let mut cards = outlook.planned;
        for (card, share) in cards.iter_mut().zip(&shares) {
            if let Some(card) = card {
                card.noise /= *share;
            }
        }
        CoefficientCovariance {
            covariance: outlook.covariance,
            cards,
        }
    };
    outlooks.into_iter().map(of_coefficient).collect()
}

/// Covariance of each card, with the noise of the campaign's maneuvers of its class.
fn covariances(state: &CampaignState, kept: &[KeptCard]) -> Vec<Option<Covariance>> {
    let simulated = kept.iter().filter_map(|kept| {
        let covariance = kept.rehearsed.estimated.covariance.as_ref()?;
        Some((kept.candidate.card.class.as_str(), covariance))
    });
    let factors = noise_factors(&state.history, simulated);
    let own = kept.iter().map(|kept| {
        let factor = factors.get(kept.candidate.card.class.as_str());
        let covariance = kept.rehearsed.estimated.covariance.as_ref()?;
        Some(with_noise(covariance, factor.copied().unwrap_or(1.0)))
    });
    own.collect()
}

/// Choice as rows of the tables.
struct PlanRows<'a> {
    state: &'a CampaignState<'a>,
    kept: &'a [KeptCard<'a>],
    points: &'a [GoalPoint],
    choice: &'a CardChoice,
    flown: &'a CardSet<'a>,
}

impl PlanRows<'_> {
    /// Cards in the order of flying, then the others by information per minute.
    fn cards(&self) -> Vec<NextCardRow> {
        let all = 0..self.kept.len();
        let (mut flown, mut others): (Vec<usize>, Vec<usize>) =
            all.partition(|card| self.flown.times[*card] > 0);
        let key = |card: &usize| &self.kept[*card].candidate.card;
        flown.sort_by(|a, b| {
            let by_alpha = key(a).alpha_deg.total_cmp(&key(b).alpha_deg);
            by_alpha.then_with(|| key(a).class.cmp(&key(b).class))
        });
        let nothing = CardSet::empty(self.choice);
        let per_minute = |card: &usize| nothing.gain(*card) / self.choice.prices[*card].minutes;
        others.sort_by(|a, b| per_minute(b).total_cmp(&per_minute(a)));
        let flown = flown.into_iter().enumerate().map(|(i, card)| NextCardRow {
            place: Some(i + 1),
            loss_without: Some(self.flown.worth() - self.flown.without(card).worth()),
            ..self.card(card, &nothing)
        });
        let others = others.into_iter().map(|card| self.card(card, &nothing));
        flown.chain(others).collect()
    }

    fn card(&self, card: usize, nothing: &CardSet) -> NextCardRow {
        let KeptCard {
            candidate,
            rehearsed,
        } = self.kept[card];
        let information = nothing.gain(card);
        let extremes = rehearsed.extremes;
        NextCardRow {
            times: self.flown.times[card],
            information: Some(information),
            information_per_minute: Some(information / candidate.minutes),
            lowest_alpha_deg: Some(extremes.alpha_deg.0),
            highest_alpha_deg: Some(extremes.alpha_deg.1),
            lowest_an_g: Some(extremes.an_g.0),
            highest_an_g: Some(extremes.an_g.1),
            highest_qbar_psf: Some(extremes.qbar_psf.1),
            mach: Some(extremes.mach),
            calibrated_airspeed_kt: Some(extremes.calibrated_kt),
            informs: self.most_informed_goals(card, nothing),
            ..self.of_candidate(candidate)
        }
    }

    /// Row of a card before it is rehearsed.
    fn of_candidate(&self, candidate: &CandidateCard) -> NextCardRow {
        let card = &candidate.card;
        NextCardRow {
            place: None,
            times: 0,
            class: card.class.clone(),
            alpha_deg: card.alpha_deg,
            scale: candidate.scale,
            altitude_ft: card.altitude_ft,
            minutes: candidate.minutes,
            usable_pct: 100.0 * self.state.history.of(&card.class).usable,
            information: None,
            information_per_minute: None,
            loss_without: None,
            lowest_alpha_deg: None,
            highest_alpha_deg: None,
            lowest_an_g: None,
            highest_an_g: None,
            highest_qbar_psf: None,
            mach: None,
            calibrated_airspeed_kt: None,
            informs: String::new(),
            refused: String::new(),
        }
    }

    /// Goals on which a card by itself gives most information, each derivative once.
    fn most_informed_goals(&self, card: usize, nothing: &CardSet) -> String {
        let mut after = nothing.clone();
        after.fly(card);
        let mut gains: Vec<(f64, &GoalPoint, f64, f64)> = self
            .choice
            .aims
            .iter()
            .map(|aim| {
                let (before, after) = (nothing.deviation(aim), after.deviation(aim));
                let worth = aim.worth(before * before, after * after);
                (worth, &self.points[aim.point], before, after)
            })
            .filter(|(worth, ..)| *worth > 0.0)
            .collect();
        gains.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut named: Vec<&str> = Vec::new();
        let mut parts = Vec::new();
        for (_, goal, before, after) in gains {
            let name = goal.name.as_str();
            if named.len() < NAMED_GOALS && !named.contains(&name) {
                named.push(name);
                let alpha_deg = goal.point.condition.alpha_deg;
                let fall_pct = 100.0 * (1.0 - after / before);
                parts.push(format!("{name} at {alpha_deg}°: −{fall_pct:.0} %"));
            }
        }
        parts.join("; ")
    }

    /// Goals in the order of the goals' file, or of the posterior.
    fn goals(&self) -> Vec<NextGoalRow> {
        let nothing = CardSet::empty(self.choice);
        let row = |aim: &Aim| {
            let (before, after) = (nothing.deviation(aim), self.flown.deviation(aim));
            goal_row(&self.points[aim.point], aim.wanted, before, after)
        };
        self.choice.aims.iter().map(row).collect()
    }
}

/// Row of a goal with its standard deviations before and after the flight.
fn goal_row(goal: &GoalPoint, wanted: f64, before: f64, after: f64) -> NextGoalRow {
    let decision = match &goal.target {
        Target::Bound(_) => None,
        Target::Decision(decision) => Some(decision),
    };
    let interval = decision.map(|own| own.most_probable(before));
    let limit = |limit: fn((f64, f64)) -> f64| {
        let (sides, _) = interval?;
        Some(limit(sides)).filter(|value| value.is_finite())
    };
    NextGoalRow {
        kind: goal.kind,
        goal: goal.name.clone(),
        of: goal.of.to_owned(),
        decided_by: goal.decided_by.clone(),
        unit: goal.unit.to_owned(),
        alpha_deg: goal.point.condition.alpha_deg,
        before,
        after,
        wanted: match &goal.target {
            Target::Bound(bound) => *bound,
            Target::Decision(_) => (wanted > 0.0 && wanted < before).then_some(wanted),
        },
        value: decision.map(|own| own.mean),
        lower_limit: limit(|sides| sides.0),
        upper_limit: limit(|sides| sides.1),
        probability_pct: interval.map(|(_, probability)| 100.0 * probability),
        decided_pct: decision.map(|own| 100.0 * own.probability_of_decision(before, after)),
    }
}
