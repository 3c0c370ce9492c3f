//! Flying qualities at one angle of attack: values, standard deviations, and probabilities of levels.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::judged_aircraft::JudgedAircraft;
use super::levels::{self, value_of};
use super::linear::{Controls, Differentiation, LinearModel, SteadyFlight};
use super::quantities::AxisQuantities;
use super::specification::Specification;
use super::trim::Trim;
use crate::aero::Axis;
use crate::model::{LocalPosterior, Model};
use crate::numerics::dual::Dual;
use crate::numerics::linear_algebra::root::continuous_root;
use crate::numerics::statistics::normal::NORMAL_95;
use crate::numerics::statistics::order_statistics::quantile_of_sorted;
use crate::numerics::statistics::random::RandomStream;
use crate::tables::{
    ALL_PARAGRAPHS, Airframe, DeviationBasis, FlyingQuality, Level, LevelRow, QualityRow, RootRow,
};
use crate::units::DEG;

/// Seed of the draws.
const SEED: u64 = 21;

/// Share of draws with another pattern of modes, above which the standard deviation is taken from
/// the draws.
const COALESCED: f64 = 0.01;

/// Largest share of draws beyond either end of the interval by slopes: twice that of a normal
/// distribution. A quotient reaches it when its denominator is ten standard deviations from zero.
const BEYOND_AN_END: f64 = 0.05;

/// Shares of draws within one standard deviation by slopes: that of a normal distribution is 0.683.
/// Beside a pole the slopes are steep, and nearly all draws are within.
const WITHIN_ONE_DEVIATION: std::ops::RangeInclusive<f64> = 0.6..=0.77;

/// Largest share of draws that may lack a value: that of one tail of the 95 % interval.
const UNDEFINED: f64 = 0.025;

/// Quantiles of a normal distribution at minus and plus one standard deviation.
const ONE_DEVIATION: [f64; 2] = [0.158_655, 0.841_345];

/// Rows of one airframe at one angle of attack.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Analysis {
    pub qualities: Vec<QualityRow>,
    pub levels: Vec<LevelRow>,
    pub roots: Vec<RootRow>,
}

/// Standard normal deviates of the draws of each axis. All angles of attack share them, so that
/// probabilities vary as smoothly over α as the posterior.
#[derive(Clone, Debug)]
pub struct SharedDraws {
    longitudinal: DMatrix<f64>,
    lateral: DMatrix<f64>,
}

impl SharedDraws {
    #[must_use]
    pub fn new(model: &Model, draws: usize) -> SharedDraws {
        let of = |axis: Axis| standard_draws(axis, model.local_values(axis), draws);
        SharedDraws {
            longitudinal: of(Axis::Longitudinal),
            lateral: of(Axis::Lateral),
        }
    }

    fn of_axis(&self, axis: Axis) -> &DMatrix<f64> {
        match axis {
            Axis::Longitudinal => &self.longitudinal,
            Axis::Lateral => &self.lateral,
        }
    }
}

/// Draws of independent standard normal deviates: a row for each of an axis's values, a column for
/// each draw.
#[must_use]
pub fn standard_draws(axis: Axis, values: usize, draws: usize) -> DMatrix<f64> {
    let mut stream = RandomStream::new(SEED, axis.name());
    DMatrix::from_fn(values, draws, |_, _| stream.normal())
}

/// An axis at one angle of attack, at the mean of the posterior and at draws from it.
#[derive(Clone, Debug)]
pub struct AxisAnalysis {
    pub axis: Axis,
    pub mean: AxisQuantities,
    pub covariance: DMatrix<f64>,
    /// Values of each draw; NaN if its equations have no finite roots.
    pub draws: Vec<Vec<(FlyingQuality, f64)>>,
    /// Share of draws whose modes have another pattern than those at the mean.
    pub coalesced: f64,
}

impl AxisAnalysis {
    /// Analyses linear equations over a posterior, with [`standard_draws`]; `None` if the posterior is
    /// not finite.
    #[must_use]
    pub fn of(
        axis: Axis,
        linear: &LinearModel,
        posterior: &LocalPosterior,
        draws: &DMatrix<f64>,
    ) -> Option<AxisAnalysis> {
        let mean = linear.quantities(axis, &posterior.mean, Differentiation::Slopes)?;
        let quantities = mean.quantities.iter();
        let without: Vec<_> = quantities.map(|(q, _)| (*q, f64::NAN)).collect();
        let deviations = continuous_root(&posterior.covariance) * draws;
        let (mut drawn, mut others) = (Vec::with_capacity(draws.ncols()), 0);
        for deviation in deviations.column_iter() {
            let values = &posterior.mean + deviation;
            let found = linear.quantities(axis, &values, Differentiation::ValuesAlone);
            let pattern = found.as_ref().map(|found| found.modes.pattern);
            others += usize::from(pattern != Some(mean.modes.pattern));
            drawn.push(found.map_or_else(|| without.clone(), |found| found.values()));
        }
        Some(AxisAnalysis {
            axis,
            coalesced: others as f64 / drawn.len().max(1) as f64,
            draws: drawn,
            mean,
            covariance: posterior.covariance.clone(),
        })
    }

    /// Covariance of two quantities from their slopes.
    fn covariance(&self, a: &Dual, b: &Dual) -> f64 {
        let slopes = |dual: &Dual| DVector::from_column_slice(&dual.slopes);
        if a.slopes.is_empty() || b.slopes.is_empty() {
            return f64::NAN;
        }
        (&self.covariance * slopes(a)).dot(&slopes(b))
    }

    /// Standard deviation and 95 % interval of a quantity: by its slopes, if the draws confirm them.
    #[must_use]
    pub fn uncertainty(&self, quantity: FlyingQuality, dual: &Dual) -> Uncertainty {
        let deviation = self.covariance(dual, dual).sqrt();
        let by_slopes = Uncertainty {
            deviation,
            lower: dual.value - NORMAL_95 * deviation,
            upper: dual.value + NORMAL_95 * deviation,
            basis: DeviationBasis::Slopes,
        };
        let values = self.draws.iter().filter_map(|d| value_of(d, quantity));
        let drawn = Drawn::of(values, self.draws.len());
        let holds = deviation.is_finite()
            && self.coalesced <= COALESCED
            && drawn.confirms(dual.value, &by_slopes);
        if holds {
            by_slopes
        } else {
            drawn.uncertainty()
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

/// Values of a quantity in draws.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Ascending; a mode that never doubles has infinity.
    values: Vec<f64>,
    /// Number of all draws, with those that lack a value.
    draws: usize,
}

impl Drawn {
    /// Values of a quantity; NaN counts as no value.
    pub fn of(values: impl Iterator<Item = f64>, draws: usize) -> Drawn {
        let mut values: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
        values.sort_unstable_by(f64::total_cmp);
        Drawn { values, draws }
    }

    /// Share of the draws.
    fn share(&self, count: usize) -> f64 {
        count as f64 / self.draws as f64
    }

    fn lacks_values(&self) -> bool {
        self.share(self.draws - self.values.len()) > UNDEFINED
    }

    /// `true` if the draws are distributed as the slopes state. No draws refute nothing.
    fn confirms(&self, value: f64, by_slopes: &Uncertainty) -> bool {
        if self.draws == 0 {
            return true;
        }
        let below = |limit: f64| self.values.partition_point(|own| *own < limit);
        let not_above = |limit: f64| self.values.partition_point(|own| *own <= limit);
        let under = below(by_slopes.lower);
        let over = self.values.len() - not_above(by_slopes.upper);
        let deviation = by_slopes.deviation;
        let within = not_above(value + deviation) - below(value - deviation);
        // Equal values have no distribution, and slopes of zero are right.
        let is_certain = deviation == 0.0 && under + over == 0;
        !self.lacks_values()
            && self.share(under.max(over)) <= BEYOND_AN_END
            && (is_certain || WITHIN_ONE_DEVIATION.contains(&self.share(within)))
    }

    /// Interval between quantiles. The standard deviation is half the width of the central 68 %.
    /// The standard deviation of all values is infinite for a quotient whose denominator may be
    /// zero. NaN for what draws without a value leave open; an end is infinite if the quantile is.
    pub fn uncertainty(&self) -> Uncertainty {
        let at = |share: f64| {
            let known = Some(share).filter(|_| !self.lacks_values());
            known
                .and_then(|share| quantile_of_sorted(&self.values, share))
                .unwrap_or(f64::NAN)
        };
        let [low, high] = ONE_DEVIATION.map(at);
        Uncertainty {
            deviation: 0.5 * (high - low),
            lower: at(0.025),
            upper: at(0.975),
            basis: DeviationBasis::Draws,
        }
    }
}

impl Analysis {
    /// Analyses an airframe in steady flight; `None` if the posterior is not finite.
    #[must_use]
    pub fn of(
        basis: &JudgedAircraft,
        draws: &SharedDraws,
        airframe: Airframe,
        trim: &Trim,
    ) -> Option<Analysis> {
        let specification = basis.specification;
        let of_axis = |axis: Axis| {
            let (linear, posterior) = linearised(basis, airframe, trim, axis);
            AxisAnalysis::of(axis, &linear, &posterior, draws.of_axis(axis))
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
        aero_model: basis.aero_model,
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
                path_deg: (trim.theta - trim.alpha) * DEG,
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
        let means: Vec<_> = axes.iter().flat_map(|a| a.mean.values()).collect();
        let mean = levels_of(specification, &means);
        let mut counts = vec![[0_usize; 4]; mean.len()];
        let mut values = vec![];
        for draw in 0..draws {
            values.clear();
            values.extend(axes.iter().flat_map(|a| &a.draws[draw]).copied());
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

/// Level of each requirement, then the worst level.
fn levels_of(specification: &Specification, values: &levels::Values) -> Vec<Level> {
    let requirements = specification.requirements.iter();
    let mut found: Vec<Level> = requirements
        .map(|requirement| levels::level(specification, requirement, values))
        .collect();
    found.push(found.iter().copied().max().unwrap_or(Level::Worse));
    found
}
