//! Fixture of the report's tests: a small campaign with every kind of row.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

use super::contents::{ConfiguredClass, Contents, HistoryFigure};
use super::page::draw_history;
use super::provenance::{Provenance, SourceFile};
use crate::aero::Axis;
use crate::error::{Problem, ProblemStage};
use crate::lineage::Changes;
use crate::maneuver::{Maneuver, Status};
use crate::output_error::identifiability::CollinearityLimits;
use crate::proof_of_match::{self, Matched};
use crate::qualities::{Qualities, Specification};
use crate::tables::{
    AgreementRow, Airframe, ChannelRow, ChannelVerdict, CheckRow, CheckVerdict, ComparisonRow,
    ContributionRow, CorrelationRow, DeviationBasis, EstimateRow, EventRow, EventVerdict, FitRow,
    FlightRow, FlyingQuality, History, HistoryOutput, InstrumentRow, Level, LevelRow, MatchRow,
    MatchVerdict, MatchVerdictRow, MatchedQuantity, ModelSource, Outcome, PosteriorRow, QualityRow,
    RootRow, TrendRow, TunnelDifference, TunnelVerdict,
};

/// Owner of the rows that [`Contents`] borrows.
#[derive(Clone, Debug, Default)]
pub struct Campaign {
    pub maneuvers: Vec<Maneuver>,
    pub fits: Vec<FitRow>,
    pub estimates: Vec<EstimateRow>,
    pub predictions: Vec<AgreementRow>,
    pub correlations: Vec<CorrelationRow>,
    pub limits: CollinearityLimits,
    pub trends: Vec<TrendRow>,
    pub specification: Option<Specification>,
    pub qualities: Qualities,
    pub tolerances: Option<proof_of_match::Specification>,
    pub matched: Vec<Matched>,
    pub posterior: Vec<PosteriorRow>,
    pub contributions: Vec<ContributionRow>,
    pub comparison: Vec<ComparisonRow>,
    pub flights: Vec<FlightRow>,
    pub channels: Vec<ChannelRow>,
    pub checks: Vec<CheckRow>,
    pub instruments: Vec<InstrumentRow>,
    pub events: Vec<EventRow>,
    pub problems: Vec<Problem>,
    pub pages: BTreeSet<String>,
    pub histories: Vec<History>,
    /// The histories drawn, as they are when the contents are first asked for.
    pub history_figures: OnceLock<BTreeMap<String, HistoryFigure>>,
    pub provenance: Provenance,
    pub order: Vec<String>,
    pub classes: Vec<ConfiguredClass>,
    pub overnight: Changes,
}

impl Campaign {
    fn draw_histories(&self) -> BTreeMap<String, HistoryFigure> {
        let drawn = self.histories.iter().enumerate().map(|(i, history)| {
            let figure = draw_history(history, format!("h{i}"));
            (history.maneuver_id.clone(), figure)
        });
        drawn.collect()
    }

    pub fn contents(&self) -> Contents<'_> {
        Contents {
            title: "A campaign",
            aircraft: "an aircraft",
            archive: "an archive",
            wind_tunnel: "a tunnel, reconstructed",
            maneuvers: &self.maneuvers,
            fits: &self.fits,
            estimates: &self.estimates,
            predictions: &self.predictions,
            correlations: &self.correlations,
            limits: &self.limits,
            posterior: &self.posterior,
            contributions: &self.contributions,
            trends: &self.trends,
            specification: self.specification.as_ref(),
            qualities: &self.qualities,
            tolerances: self.tolerances.as_ref(),
            matched: &self.matched,
            comparison: &self.comparison,
            flights: &self.flights,
            channels: &self.channels,
            checks: &self.checks,
            instruments: &self.instruments,
            instrument_trends: &[],
            events: &self.events,
            problems: &self.problems,
            pages: &self.pages,
            history_figures: self.history_figures.get_or_init(|| self.draw_histories()),
            histories: &self.histories,
            typical_alpha_deg: 30.0,
            provenance: &self.provenance,
            order: &self.order,
            classes: &self.classes,
            overnight: &self.overnight,
        }
    }
}

const LONGITUDINAL: [(&str, &str); 4] = [
    ("CN_0", "-"),
    ("CN_alpha", "per_deg"),
    ("Cm_de", "per_deg"),
    ("an_bias", "g"),
];
const LATERAL: [(&str, &str); 4] = [
    ("CY_beta", "per_deg"),
    ("Cn_0", "-"),
    ("Cn_alpha", "per_deg"),
    ("Cn_dyv", "ftlbf_per_deg"),
];

/// Two classes of each axis at α 10° to 50°; names that differ in case alone, one outlier, one
/// failed fit.
pub fn campaign() -> Campaign {
    let mut campaign = Campaign::default();
    for (class, axis) in [
        ("OLON", Axis::Longitudinal),
        ("3211", Axis::Longitudinal),
        ("OLAT", Axis::Lateral),
        ("PYRS", Axis::Lateral),
    ] {
        campaign.classes.push(ConfiguredClass {
            name: class.into(),
            title: format!("{class} steps"),
            axis,
        });
        for alpha in [10.0, 20.0, 30.0, 40.0, 50.0] {
            fly(&mut campaign, class, axis, alpha);
        }
    }
    for (name, unit) in LONGITUDINAL.into_iter().chain(LATERAL) {
        campaign.order.push(name.into());
        for alpha_deg in [10.0, 20.0, 30.0, 40.0, 50.0] {
            compare(&mut campaign, name, unit, alpha_deg);
        }
    }
    campaign.provenance = Provenance {
        program: "harvest 0.0.0, ingest 1".into(),
        command: "harvest run mine".into(),
        data: vec![SourceFile {
            name: "flight_001.parquet".into(),
            bytes: 123,
            blake3: "00ff".into(),
        }],
        configuration: vec![(
            "pipeline.yaml".into(),
            "title: a campaign\n  deeper: 1\n".into(),
        )],
    };
    judge(&mut campaign);
    fly_again(&mut campaign);
    campaign.fits[0].outcome = Outcome::NotConverged;
    campaign.estimates[5].value = Some(1e6);
    campaign.checks.push(CheckRow {
        flight_id: "1".into(),
        relation: "theta rate against q and r".into(),
        signals: "theta_deg q_deg_s".into(),
        slope: Some(-1.0),
        correlation: None,
        verdict: CheckVerdict::WrongSign,
    });
    campaign.flights.push(FlightRow {
        flight_id: "flight_1".into(),
        start_s: 0.0,
        duration_s: 1500.0,
        gust_u_ft_s: None,
        gust_v_ft_s: Some(6.62),
        gust_w_ft_s: Some(0.3),
    });
    campaign.channels.push(ChannelRow {
        flight_id: "1".into(),
        channel: "alpha".into(),
        signal: "alpha_vane_deg".into(),
        samples: 100,
        rate_hz: Some(40.0),
        between: 0,
        bridged: 3,
        despiked: 1,
        missing: 0,
        stuck: 0,
        wraps: 0,
        quantisation: None,
        noise: Some(0.02),
        verdict: ChannelVerdict::Ok,
    });
    campaign.problems.push(problem("a file that is no record"));
    campaign.events.push(EventRow {
        flight_id: "1".into(),
        given_class: Some("OLON".into()),
        given_start_s: Some(10.0),
        given_end_s: Some(20.0),
        found_class: None,
        found_start_s: None,
        found_end_s: None,
        verdict: EventVerdict::NotFound,
    });
    campaign
}

/// Flying qualities at three angles of attack: worse with α, and a spiral that diverges at the last.
fn judge(campaign: &mut Campaign) {
    let text = include_str!("../../pipelines/harv/qualities.yaml");
    campaign.specification = serde_yaml::from_str(text).ok();
    for (alpha_deg, level_1_pct) in [(10.0, 99.0), (20.0, 60.0), (30.0, 1.0)] {
        for (quantity, axis, value) in [
            (FlyingQuality::ShortPeriodDamping, Axis::Longitudinal, 0.6),
            (FlyingQuality::ControlAnticipation, Axis::Longitudinal, 0.4),
            (FlyingQuality::DutchRollDamping, Axis::Lateral, 0.2),
            (FlyingQuality::DutchRollFrequency, Axis::Lateral, 1.5),
        ] {
            campaign.qualities.qualities.push(QualityRow {
                airframe: Airframe::Bare,
                axis,
                quantity,
                unit: quantity.unit().into(),
                alpha_deg,
                mach: 0.3,
                qbar_psf: 60.0,
                mass_slug: 1_050.0,
                path_deg: -4.0,
                value: Some(value - 0.005 * alpha_deg),
                standard_deviation: Some(0.05),
                lower_95: Some(value - 0.1),
                upper_95: Some(value + 0.1),
                basis: DeviationBasis::Slopes,
                damping_correlation: Some(0.5),
            });
        }
        for (paragraph, subject) in [
            ("3.2.2.1.2", "short-period damping"),
            ("all", "all paragraphs"),
        ] {
            campaign.qualities.levels.push(LevelRow {
                airframe: Airframe::Bare,
                alpha_deg,
                paragraph: paragraph.into(),
                subject: subject.into(),
                level: if level_1_pct > 50.0 {
                    Level::One
                } else {
                    Level::Two
                },
                level_1_pct,
                level_2_pct: 100.0 - level_1_pct,
                level_3_pct: 0.0,
                worse_pct: 0.0,
            });
        }
        for (real, imaginary) in [(-1.0, 1.0), (-1.0, -1.0), (0.01, 0.0)] {
            campaign.qualities.roots.push(RootRow {
                airframe: Airframe::Bare,
                axis: Axis::Lateral,
                alpha_deg,
                real,
                imaginary,
            });
        }
    }
}

/// Proof of match of four maneuvers: two inside, one outside, one not flown.
fn fly_again(campaign: &mut Campaign) {
    let text = include_str!("../../pipelines/harv/match.yaml");
    campaign.tolerances = serde_yaml::from_str(text).ok();
    for (i, margin) in [Some(0.4), Some(0.2), Some(-0.5), None]
        .into_iter()
        .enumerate()
    {
        let Some(maneuver) = campaign.maneuvers.get(i) else {
            continue;
        };
        let verdict = match margin {
            Some(margin) if margin >= 0.0 => MatchVerdict::Inside,
            Some(_) => MatchVerdict::Outside,
            None => MatchVerdict::NotFlown,
        };
        let models = [(ModelSource::Posterior, 0.0), (ModelSource::Tunnel, -0.1)];
        let verdicts = models.map(|(model, less)| MatchVerdictRow {
            maneuver_id: maneuver.maneuver_id.clone(),
            flight_id: maneuver.flight_id.clone(),
            class: maneuver.class.clone(),
            alpha_deg: maneuver.alpha_deg,
            model,
            verdict,
            margin: margin.map(|m: f64| m + less),
            decided_by: margin.map_or("", |_| "2.c.10 an_g").to_owned(),
            repeat_pct: margin.map(|margin| 50.0 + 100.0 * margin),
            closed_loop: margin.map(|_| usize::from(i == 1)),
            reason: margin.map_or("no signal", |_| "").to_owned(),
        });
        let mut matched = Matched {
            verdicts: verdicts.to_vec(),
            ..Matched::default()
        };
        if margin.is_some() {
            for (quantity, within) in [
                (MatchedQuantity::PitchAttitude, 1.5),
                (MatchedQuantity::NormalAcceleration, 0.1),
            ] {
                matched
                    .rows
                    .push(match_row(maneuver, quantity, (within, margin, verdict)));
            }
            matched.history = Some(flown_again(maneuver));
        }
        campaign.matched.push(matched);
    }
}

fn match_row(
    maneuver: &Maneuver,
    quantity: MatchedQuantity,
    (within, margin, verdict): (f64, Option<f64>, MatchVerdict),
) -> MatchRow {
    MatchRow {
        maneuver_id: maneuver.maneuver_id.clone(),
        flight_id: maneuver.flight_id.clone(),
        class: maneuver.class.clone(),
        alpha_deg: maneuver.alpha_deg,
        model: ModelSource::Posterior,
        test: "2.c.10".into(),
        subject: "short-period dynamics".into(),
        requirement: 1,
        quantity,
        unit: quantity.unit().into(),
        tolerance: Some(within),
        tolerance_pct: None,
        flight_value: None,
        model_value: None,
        samples: 50,
        inside_pct: 100.0,
        largest_excess: margin.map(|margin| -margin * within),
        largest_excess_s: Some(12.0),
        margin,
        verdict,
        repeat_pct: Some(90.0),
    }
}

/// Pitch attitude and normal acceleration, measured and simulated.
fn flown_again(maneuver: &Maneuver) -> History {
    let times: Vec<f64> = (0..50).map(|k| 0.2 * f64::from(k)).collect();
    let output = |quantity: MatchedQuantity, size: f64| HistoryOutput {
        label: quantity.name().into(),
        unit: quantity.unit().into(),
        measured: times.iter().map(|t| size * t.sin()).collect(),
        computed: times.iter().map(|t| size * (t + 0.1).sin()).collect(),
        marked: vec![false; times.len()],
    };
    History {
        maneuver_id: maneuver.maneuver_id.clone(),
        class: maneuver.class.clone(),
        alpha_deg: maneuver.alpha_deg,
        outputs: vec![
            output(MatchedQuantity::PitchAttitude, 5.0),
            output(MatchedQuantity::NormalAcceleration, 0.5),
        ],
        controls: vec![],
        time_s: times.clone(),
    }
}

pub fn problem(reason: &str) -> Problem {
    Problem {
        stage: ProblemStage::Ingest,
        flight_id: "7".into(),
        place: "flight_007.parquet".into(),
        reason: reason.into(),
    }
}

fn fly(campaign: &mut Campaign, class: &str, axis: Axis, alpha_deg: f64) {
    let maneuver_id = format!("1-{class}-{alpha_deg}");
    let maneuver = Maneuver {
        flight_id: "1".into(),
        class: class.into(),
        axis,
        start_s: 10.0,
        end_s: 25.0,
        samples: 600,
        ..Maneuver::example(&maneuver_id, alpha_deg)
    };
    campaign.fits.push(FitRow {
        reason: "steps below the tolerance".into(),
        iterations: 6,
        initial_cost: Some(12.0),
        final_cost: Some(0.4),
        condition_number: Some(150.0),
        left_out: Some(0.0),
        largest_condition_index: Some(12.2),
        ..FitRow::without_numbers(&maneuver_id, class, Outcome::Converged)
    });
    for (name, unit) in if axis == Axis::Longitudinal {
        LONGITUDINAL
    } else {
        LATERAL
    } {
        campaign.estimates.push(EstimateRow {
            value: Some(0.05 - 0.001 * alpha_deg),
            bound: Some(0.002),
            bound_corrected: Some(0.004),
            wind_tunnel: Some(0.05),
            variance_inflation: Some(12.0),
            excitation: Some(1.5),
            contribution_pct: Some(40.0),
            equation_error: Some(0.05),
            equation_error_bound: Some(0.01),
            ..EstimateRow::without_results(&maneuver, name, unit, Status::Estimated)
        });
    }
    for coefficient in axis.coefficients() {
        campaign.contributions.push(ContributionRow {
            maneuver_id: maneuver_id.clone(),
            class: class.into(),
            coefficient: format!("{coefficient:?}"),
            weight: 1.0,
        });
    }
    campaign.maneuvers.push(maneuver);
    campaign.pages.insert(maneuver_id.clone());
    campaign
        .histories
        .push(history(&maneuver_id, class, alpha_deg));
}

fn history(maneuver_id: &str, class: &str, alpha_deg: f64) -> History {
    let time_s: Vec<f64> = (0..600).map(|i| 10.0 + 0.025 * f64::from(i)).collect();
    let computed: Vec<f64> = time_s.iter().map(|t| t.sin()).collect();
    let output = HistoryOutput {
        label: "alpha_vane".into(),
        unit: "deg".into(),
        measured: computed.iter().map(|v| v + 0.01).collect(),
        computed,
        marked: (0..600).map(|i| i == 300).collect(),
    };
    let controls = vec![(
        "de_deg".to_owned(),
        time_s.iter().map(|t| t.cos()).collect(),
    )];
    let (maneuver_id, class) = (maneuver_id.into(), class.into());
    History {
        maneuver_id,
        class,
        alpha_deg,
        time_s,
        outputs: vec![output],
        controls,
    }
}

fn compare(campaign: &mut Campaign, name: &str, unit: &str, alpha_deg: f64) {
    let value = 0.05 - 0.001 * alpha_deg;
    campaign.trends.push(TrendRow {
        derivative: name.into(),
        unit: unit.into(),
        group: "all".into(),
        alpha_deg,
        value,
        standard_error: 0.001,
        lower_95: value - 0.002,
        upper_95: value + 0.002,
        prediction_lower_95: value - 0.004,
        prediction_upper_95: value + 0.004,
        outliers: 0,
        curve: "polynomial".into(),
        maneuvers: 10,
        order: 2,
        scatter: 0.001,
    });
    campaign.posterior.push(PosteriorRow {
        derivative: name.into(),
        unit: unit.into(),
        alpha_deg,
        mach: None,
        third: None,
        value,
        standard_deviation: 0.001,
        lower_95: value - 0.002,
        upper_95: value + 0.002,
        wind_tunnel: Some(0.05),
        prior_deviation: 0.01,
        flight_share_pct: Some(99.0),
        maneuvers: 10,
    });
    campaign.comparison.push(ComparisonRow {
        derivative: name.into(),
        unit: unit.into(),
        group: "all".into(),
        alpha_deg,
        mach: Some(0.3),
        flight: value,
        standard_error: 0.001,
        flight_share_pct: Some(99.0),
        tunnel: TunnelDifference {
            wind_tunnel: Some(0.05),
            difference: Some(value - 0.05),
            uncertainty: Some(0.001),
            difference_pct: Some(100.0 * (value - 0.05) / 0.05),
            z: Some(-3.0),
            verdict: if alpha_deg < 25.0 {
                TunnelVerdict::Agrees
            } else {
                TunnelVerdict::FlightLower
            },
        },
    });
}
