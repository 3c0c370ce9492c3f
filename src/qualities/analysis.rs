//! Flying qualities at one angle of attack: values, standard deviations, and probabilities of levels.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::judged_aircraft::JudgedAircraft;
use super::levels;
use super::linear::Differentiation;
use super::linear::{Controls, LinearModel, SteadyFlight};
use super::quantities::AxisQuantities;
use super::specification::Specification;
use super::trim::Trim;
use crate::aero::Axis;
use crate::model::LocalPosterior;
use crate::numerics::dual::Dual;
use crate::numerics::normal::NORMAL_95;
use crate::numerics::order_statistics::quantile;
use crate::numerics::random::RandomStream;
use crate::numerics::root::continuous_root;
use crate::tables::{
    ALL_PARAGRAPHS, Airframe, DeviationBasis, FlyingQuality, Level, LevelRow, QualityRow, RootRow,
};

/// Seed of the draws. All angles of attack use the same random numbers, so that probabilities vary
/// as smoothly over α as the posterior.
const SEED: u64 = 21;

/// Share of draws with another pattern of modes, above which the standard deviation is taken from
/// the draws.
const COALESCED: f64 = 0.01;

/// Rows of one airframe at one angle of attack.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Analysis {
    pub qualities: Vec<QualityRow>,
    pub levels: Vec<LevelRow>,
    pub roots: Vec<RootRow>,
}

/// An axis at one angle of attack, at the mean of the posterior and at draws from it.
#[derive(Clone, Debug)]
pub struct AxisAnalysis {
    pub axis: Axis,
    pub mean: AxisQuantities,
    pub covariance: DMatrix<f64>,
    /// Values of each draw.
    pub draws: Vec<BTreeMap<FlyingQuality, f64>>,
    /// Share of draws whose modes have another pattern than those at the mean.
    pub coalesced: f64,
}

impl AxisAnalysis {
    /// Analyses linear equations over a posterior; `None` if it is not finite.
    #[must_use]
    pub fn of(
        axis: Axis,
        linear: &LinearModel,
        posterior: &LocalPosterior,
        draws: usize,
    ) -> Option<AxisAnalysis> {
        let mean = linear.quantities(axis, &posterior.mean, Differentiation::Slopes)?;
        let root = continuous_root(&posterior.covariance);
        let mut stream = RandomStream::new(SEED, axis.name());
        let drawn = (0..draws).filter_map(|_| {
            let values = &posterior.mean + stream.deviations(&root);
            linear.quantities(axis, &values, Differentiation::ValuesAlone)
        });
        let drawn: Vec<AxisQuantities> = drawn.collect();
        let others = drawn
            .iter()
            .filter(|d| d.modes.pattern != mean.modes.pattern);
        let coalesced = others.count() as f64 / drawn.len().max(1) as f64;
        let values = |d: &AxisQuantities| d.quantities.iter().map(|(q, v)| (*q, v.value)).collect();
        Some(AxisAnalysis {
            axis,
            draws: drawn.iter().map(values).collect(),
            mean,
            covariance: posterior.covariance.clone(),
            coalesced,
        })
    }

    fn values(&self) -> BTreeMap<FlyingQuality, f64> {
        let quantities = self.mean.quantities.iter();
        quantities.map(|(q, dual)| (*q, dual.value)).collect()
    }

    /// Covariance of two quantities from their slopes.
    fn covariance(&self, a: &Dual, b: &Dual) -> f64 {
        let slopes = |dual: &Dual| DVector::from_column_slice(&dual.slopes);
        if a.slopes.is_empty() || b.slopes.is_empty() {
            return f64::NAN;
        }
        (&self.covariance * slopes(a)).dot(&slopes(b))
    }

    /// Standard deviation and 95 % interval of a quantity.
    #[must_use]
    pub fn uncertainty(&self, quantity: FlyingQuality, dual: &Dual) -> Uncertainty {
        let deviation = self.covariance(dual, dual).sqrt();
        if self.coalesced <= COALESCED && deviation.is_finite() {
            return Uncertainty {
                deviation,
                lower: dual.value - NORMAL_95 * deviation,
                upper: dual.value + NORMAL_95 * deviation,
                basis: DeviationBasis::Slopes,
            };
        }
        let drawn = || {
            let drawn = self.draws.iter().filter_map(|d| d.get(&quantity).copied());
            drawn.filter(|v| v.is_finite())
        };
        let count = drawn().count() as f64;
        let mean = drawn().sum::<f64>() / count;
        let square = drawn().map(|v| (v - mean) * (v - mean)).sum::<f64>();
        Uncertainty {
            deviation: (square / (count - 1.0)).sqrt(),
            lower: quantile(drawn(), 0.025).unwrap_or(f64::NAN),
            upper: quantile(drawn(), 0.975).unwrap_or(f64::NAN),
            basis: DeviationBasis::Draws,
        }
    }

    /// Correlation of a quantity with the damping ratio of the same mode.
    fn damping_correlation(&self, quantity: FlyingQuality, dual: &Dual) -> Option<f64> {
        let damping = match quantity {
            FlyingQuality::ControlAnticipation => FlyingQuality::ShortPeriodDamping,
            FlyingQuality::DutchRollFrequency => FlyingQuality::DutchRollDamping,
            _ => return None,
        };
        let quantities = self.mean.quantities.iter();
        let (_, damping) = quantities.clone().find(|(q, _)| *q == damping)?;
        let variances = self.covariance(dual, dual) * self.covariance(damping, damping);
        let correlation = self.covariance(dual, damping) / variances.sqrt();
        correlation
            .is_finite()
            .then_some(correlation.clamp(-1.0, 1.0))
    }
}

/// Standard deviation and 95 % interval of a quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncertainty {
    pub deviation: f64,
    pub lower: f64,
    pub upper: f64,
    pub basis: DeviationBasis,
}

impl Analysis {
    /// Analyses an airframe in steady flight; `None` if the posterior is not finite.
    #[must_use]
    pub fn of(basis: &JudgedAircraft, airframe: Airframe, trim: &Trim) -> Option<Analysis> {
        let specification = basis.specification;
        let of_axis = |axis: Axis| {
            let (linear, posterior) = linearised(basis, airframe, trim, axis);
            AxisAnalysis::of(axis, &linear, &posterior, specification.draws)
        };
        let axes = [Axis::Longitudinal, Axis::Lateral].map(of_axis);
        let axes: Vec<AxisAnalysis> = axes.into_iter().flatten().collect();
        if axes.is_empty() {
            return None;
        }
        let place = JudgedFlight { airframe, trim };
        Some(Analysis {
            qualities: axes.iter().flat_map(|a| place.quality_rows(a)).collect(),
            levels: place.level_rows(&axes, specification),
            roots: axes.iter().flat_map(|a| place.root_rows(a)).collect(),
        })
    }
}

/// Linear equations of an axis of an airframe in steady flight, with the posterior there.
#[must_use]
pub fn linearised(
    basis: &JudgedAircraft,
    airframe: Airframe,
    trim: &Trim,
    axis: Axis,
) -> (LinearModel, LocalPosterior) {
    let specification = basis.specification;
    let fixed = BTreeMap::new();
    let flight = SteadyFlight {
        aircraft: basis.aircraft,
        buildup: basis.buildup,
        trim,
        controls: Controls {
            feedback: match airframe {
                Airframe::Bare => &fixed,
                Airframe::Augmented => &specification.feedback,
            },
            pitch: &specification.pitch_control,
        },
    };
    let posterior = basis.model.posterior_at_condition(axis, &trim.condition);
    let linear = match axis {
        Axis::Longitudinal => flight.longitudinal(&posterior),
        Axis::Lateral => flight.lateral(&posterior),
    };
    (linear, posterior)
}

/// Airframe and steady flight to which the rows apply.
struct JudgedFlight<'a> {
    airframe: Airframe,
    trim: &'a Trim,
}

impl JudgedFlight<'_> {
    fn quality_rows(&self, analysis: &AxisAnalysis) -> Vec<QualityRow> {
        let row = |(quantity, dual): &(FlyingQuality, Dual)| {
            let uncertainty = analysis.uncertainty(*quantity, dual);
            // An infinite time to double has no deviation, though some draws may have a finite one.
            let is_some = dual.value.is_finite();
            let finite = |value: f64| (is_some && value.is_finite()).then_some(value);
            let trim = self.trim;
            QualityRow {
                airframe: self.airframe,
                axis: analysis.axis,
                quantity: *quantity,
                unit: quantity.unit().to_owned(),
                alpha_deg: trim.condition.alpha_deg,
                mach: trim.condition.mach,
                qbar_psf: trim.qbar,
                mass_slug: trim.mass,
                path_deg: (trim.theta - trim.alpha).to_degrees(),
                value: finite(dual.value),
                standard_deviation: finite(uncertainty.deviation),
                lower_95: finite(uncertainty.lower),
                upper_95: finite(uncertainty.upper),
                basis: uncertainty.basis,
                damping_correlation: analysis.damping_correlation(*quantity, dual),
            }
        };
        analysis.mean.quantities.iter().map(row).collect()
    }

    fn root_rows(&self, analysis: &AxisAnalysis) -> Vec<RootRow> {
        let row = |root: &super::modes::Root| RootRow {
            airframe: self.airframe,
            axis: analysis.axis,
            alpha_deg: self.trim.condition.alpha_deg,
            real: root.value.re,
            imaginary: root.value.im,
        };
        analysis.mean.modes.roots.iter().map(row).collect()
    }

    /// Levels of each paragraph, then of all. Axes are independent, so draws of the two may be
    /// paired at random.
    fn level_rows(&self, axes: &[AxisAnalysis], specification: &Specification) -> Vec<LevelRow> {
        let draws = axes.iter().map(|a| a.draws.len()).min().unwrap_or(0);
        let mean = levels_of(
            specification,
            &all_values(axes.iter().map(AxisAnalysis::values)),
        );
        let mut counts = vec![[0_usize; 4]; mean.len()];
        for draw in 0..draws {
            let values = all_values(axes.iter().map(|a| a.draws[draw].clone()));
            for (counts, level) in counts.iter_mut().zip(levels_of(specification, &values)) {
                counts[level as usize] += 1;
            }
        }
        let of_all = (ALL_PARAGRAPHS, "all paragraphs");
        let paragraphs = specification.requirements.iter();
        let paragraphs = paragraphs.map(|r| (r.paragraph.as_str(), r.subject.as_str()));
        let rows = paragraphs.chain([of_all]).zip(mean).zip(counts);
        let percent = |count: usize| 100.0 * count as f64 / draws.max(1) as f64;
        rows.map(|(((paragraph, subject), level), counts)| {
            let [level_1_pct, level_2_pct, level_3_pct, worse_pct] = counts.map(percent);
            LevelRow {
                airframe: self.airframe,
                alpha_deg: self.trim.condition.alpha_deg,
                paragraph: paragraph.to_owned(),
                subject: subject.to_owned(),
                level,
                level_1_pct,
                level_2_pct,
                level_3_pct,
                worse_pct,
            }
        })
        .collect()
    }
}

fn all_values(
    axes: impl Iterator<Item = BTreeMap<FlyingQuality, f64>>,
) -> Vec<(FlyingQuality, f64)> {
    axes.flatten().collect()
}

/// Level of each requirement, then the worst level.
fn levels_of(specification: &Specification, values: &levels::Values) -> Vec<Level> {
    let requirements = specification.requirements.iter();
    let mut found: Vec<Level> = requirements
        .map(|requirement| levels::level(specification, requirement, values))
        .collect();
    found.push(found.iter().copied().max().unwrap_or(Level::Worse));
    found
}
