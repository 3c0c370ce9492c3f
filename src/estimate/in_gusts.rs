//! Filter error on one maneuver, and the choice between it and output error.

use std::cmp::Ordering;

use nalgebra::{DMatrix, DVector, SVector};

use super::alpha_slopes::AlphaSlopes;
use super::prepared_case::{PreparedCase, all_free};
use super::settings::Method;
use super::task::{Task, values_by_name};
use crate::aero::Axis;
use crate::dynamics::{Equations, InGusts, OUTPUTS};
use crate::filter_error::bounds::{self, Bounds, WidePass};
use crate::filter_error::filter::Filter;
use crate::filter_error::noise::Noise;
use crate::filter_error::scoring::{Scored, minimise};
use crate::filter_error::slopes::SlopeEffect;
use crate::flight::signal;
use crate::numerics::order_statistics::median;
use crate::output_error::calibration_errors::Misreading;
use crate::output_error::equation_error::Regression;
use crate::output_error::error_effect::{ErrorEffect, SharedError, covariance_of};
use crate::output_error::{Case, Fit, Measurements, Model, Outcome, Response, equation_error};
use crate::tables::{EstimationMethod, FitRow};
use crate::units::DEG;

/// Scale of turbulence at altitude, ft (MIL-F-8785C, Dryden): with it the random walk of the angle
/// is the high-frequency part of a gust of some speed.
const GUST_SCALE_FT: f64 = 1750.0;

/// Correlation of neighbouring residuals from which the air is taken to move: white residuals of a
/// short maneuver stay below it.
const COLOURED: f64 = 0.3;

/// Change by slopes over α, in bounds, up to which they are not held in a second fit.
const SMALL_CHANGE: f64 = 0.3;

/// Size of a rotary gust over the deviation of its rate from which it may stand for the rate.
const MOSTLY: f64 = 0.5;

/// Steps to the slopes over α: the effect on the estimates is linear but for products of slopes and
/// noise.
const SLOPE_STEPS: usize = 3;

/// Shares of a step to the slopes that are tried.
const STEP_SHARES: [f64; 3] = [1.0, 0.5, 0.25];

/// Rise of the cost by a step to the slopes that the slopes' prior may outweigh.
const ALLOWED_RISE: f64 = 1.0;

/// Least output noise as a share of the noise seen in the samples.
const LEAST_SHARE: f64 = 0.5;

/// Filter error's result on a maneuver.
pub(super) struct Filtered {
    pub fit: Fit,
    /// Information of derivatives, biases and initial states.
    pub information: DMatrix<f64>,
    noise: Noise,
    /// True where gusts account for a drift of the attitude.
    pub attitude_drifts: bool,
    /// Lag-one correlation of each output's innovations.
    autocorrelation: [f64; OUTPUTS],
    /// Log-likelihood gained over output error.
    likelihood_gain: Option<f64>,
    /// Outputs along the air's angle; `None` where they diverge.
    pub outputs_along_air: Option<Vec<[f64; OUTPUTS]>>,
    /// Equation error with the slopes over α that the filter holds; `None` without any.
    pub second_opinion: Option<Regression>,
    /// Cost of output error at its start and end.
    output_error_costs: [Option<f64>; 2],
}

impl<'a> Task<'a> {
    /// Returns true if filter error is to estimate a maneuver with this fit by output error.
    pub(super) fn needs_filter(&self, measurements: &Measurements, fit: &Fit) -> bool {
        match self.context.settings.method {
            Method::OutputError => false,
            Method::FilterError => true,
            Method::Auto => !is_white(measurements, fit),
        }
    }

    /// Estimates a maneuver by filter error, from still or from moving air as the residuals of output
    /// error are, then from the other; `None` where neither converges or the data determine no
    /// covariance. `wide` has the held derivatives free as well, and `implied` are the starting values by
    /// equation error. Where rotary gusts account for the rates, both are tried: they can be taken for
    /// the rates' own effect.
    pub(super) fn filtered<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
        &self,
        prepared: &PreparedCase<'a, NX, E>,
        wide: &Case<NX, E>,
        implied: Vec<f64>,
        output_error: &Fit,
    ) -> Option<Filtered> {
        let case = &prepared.case;
        let resolution = self.least_deviations(&case.measurements);
        let moving = (implied, Noise::starting(resolution));
        let still = (output_error.values.clone(), Noise::slight(resolution));
        let (first, second) = if is_white(&case.measurements, output_error) {
            (still, moving)
        } else {
            (moving, still)
        };
        let slopes = self.alpha_slopes(&prepared.window, wide);
        let constant = Sweep::constant(slopes);
        let filter = self.filter::<NX, E, NG, G>(prepared, &constant, &prepared.model, None);
        let from = |start: &FilterStart| self.fit_filter(&filter, start, &resolution);
        let found = match from(&first) {
            None => from(&second)?,
            Some(found) if found.is_mostly_air(&filter, &case.motion.states) => {
                let both = [Some(found), from(&second)];
                both.into_iter().flatten().min_by(Minimum::by_cost)?
            }
            Some(found) => found,
        };
        let fitted = FilterFit { filter, found };
        let start = self.swept(prepared, constant, fitted)?;
        let swept = self.with_slopes(prepared, start, &resolution);
        let Swept {
            sweep,
            fitted,
            pass,
            effect,
        } = &swept;
        let mut fit = fitted.fit();
        self.add_held(prepared, pass, fitted.bounds(), effect.as_ref(), &mut fit);
        self.add_calibration(prepared, sweep, fitted, &mut fit);
        Some(Filtered {
            information: fitted.information(),
            outputs_along_air: fitted.outputs_along_air(),
            second_opinion: self.second_opinion_on(prepared, sweep),
            noise: fitted.noise(),
            attitude_drifts: fitted.noise().is_of_air(G::FELT_RATES.len(), case.step_s),
            autocorrelation: lag_one(&case.measurements, &fit.response.outputs),
            output_error_costs: [output_error.initial_cost, output_error.final_cost],
            likelihood_gain: white_cost(&case.measurements, output_error)
                .map(|cost| cost - fitted.cost()),
            fit,
        })
    }

    /// Fits the filter again with the slopes held, as long as they move the estimates. A step that the
    /// likelihood does not bear out is halved; slopes of which no step holds are uncertainty alone.
    fn with_slopes<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
        &self,
        prepared: &PreparedCase<'a, NX, E>,
        start: Swept<NG, G>,
        resolution: &[f64; OUTPUTS],
    ) -> Swept<NG, G> {
        let mut swept = start;
        for _ in 0..SLOPE_STEPS {
            let Some(effect) = swept.moving_effect() else {
                return swept;
            };
            let next = STEP_SHARES.iter().find_map(|share| {
                let sweep = swept.sweep.towards(&effect.slopes, *share);
                let own = swept.fitted.moved(&effect.change, *share);
                let near = (own, swept.fitted.noise());
                let implied = (self.implied(prepared, &sweep), Noise::starting(*resolution));
                let model = sweep.held_in(&prepared.model);
                let like = Some(&swept.fitted.filter);
                let filter = self.filter::<NX, E, NG, G>(prepared, &sweep, &model, like);
                let from = |start: &FilterStart| self.fit_filter(&filter, start, resolution);
                let starts = [near, implied];
                let found = starts.iter().filter_map(from);
                let found = found.min_by(Minimum::by_cost)?;
                let fitted = FilterFit { filter, found };
                if fitted.cost() < swept.fitted.cost() + ALLOWED_RISE {
                    self.swept(prepared, sweep, fitted)
                } else {
                    None
                }
            });
            match next {
                Some(next) => swept = next,
                None => break,
            }
        }
        if let Some(effect) = &mut swept.effect
            && swept
                .fitted
                .bounds()
                .are_exceeded_by(&effect.change, SMALL_CHANGE)
        {
            effect.become_uncertainty();
        }
        swept
    }

    /// Starting values by equation error with the slopes held.
    fn implied<const NX: usize, E: Equations<NX>>(
        &self,
        prepared: &PreparedCase<'a, NX, E>,
        sweep: &Sweep,
    ) -> Vec<f64> {
        let case = self.case_with::<NX, E>(prepared, sweep, &sweep.held_in(&prepared.model));
        equation_error::start(&case, &self.tunnel_start(&prepared.case))
    }

    /// The maneuver in the window of its slopes.
    fn case_with<const NX: usize, E: Equations<NX>>(
        &self,
        prepared: &PreparedCase<'a, NX, E>,
        sweep: &Sweep,
        model: &Model,
    ) -> Case<NX, E> {
        let window = &sweep.slopes.window;
        prepared
            .case
            .with_model(self.context.aircraft, window, model)
    }

    /// A fit with what is left of the slopes' effect on it.
    fn swept<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
        &self,
        prepared: &PreparedCase<'a, NX, E>,
        sweep: Sweep,
        fitted: FilterFit<NG, G>,
    ) -> Option<Swept<NG, G>> {
        let pass = self.wide_pass(prepared, &sweep, &fitted)?;
        let effect = sweep.effect(&pass, fitted.bounds());
        Some(Swept {
            sweep,
            fitted,
            pass,
            effect,
        })
    }

    /// Minimum of a filter's cost from a start; `None` where the iteration does not converge.
    fn fit_filter<const NG: usize, G: InGusts<NG>>(
        &self,
        filter: &Filter<NG, G>,
        (own, noise): &FilterStart,
        resolution: &[f64; OUTPUTS],
    ) -> Option<Minimum> {
        let settings = self.context.settings;
        let start = filter.with_noise(own, noise);
        let floors = resolution.map(|deviation| LEAST_SHARE * deviation);
        let scored = minimise(filter, start, &floors, &settings.filter)?;
        if !scored.converged {
            return None;
        }
        let limit = settings.iteration.max_condition_number;
        let bounds = bounds::bounds(filter, &scored, limit).ok()?;
        Some(Minimum { scored, bounds })
    }

    /// Pass at a fit with the held derivatives and the slopes free as well.
    fn wide_pass<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
        &self,
        prepared: &PreparedCase<'a, NX, E>,
        sweep: &Sweep,
        fitted: &FilterFit<NG, G>,
    ) -> Option<WidePass> {
        let model = sweep.held_in(&prepared.model);
        let all = all_free(&model);
        let all = if sweep.is_constant() {
            sweep.slopes.added_to(&all)
        } else {
            all
        };
        let wide = self.filter(prepared, sweep, &all, Some(&fitted.filter));
        let values = values_by_name(&model, fitted.filter.names(), fitted.own());
        WidePass::of(&fitted.filter, fitted.parameters(), &wide, &values)
    }

    /// Equation error with the slopes over α that a fit holds; `None` without any.
    fn second_opinion_on<const NX: usize, E: Equations<NX>>(
        &self,
        prepared: &PreparedCase<'a, NX, E>,
        sweep: &Sweep,
    ) -> Option<Regression> {
        let model = sweep.held_in(&prepared.model);
        let case = |model: &Model| self.case_with::<NX, E>(prepared, sweep, model);
        let uncertainties = self.held_uncertainties(&prepared.model);
        let regression =
            |wide: &Case<NX, E>| equation_error::regression(&case(&model), wide, &uncertainties);
        (!sweep.is_constant()).then(|| regression(&case(&all_free(&model))))
    }

    /// Filter of a model in the window of the slopes; `like` is another one of the maneuver.
    fn filter<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
        &self,
        prepared: &PreparedCase<'a, NX, E>,
        sweep: &Sweep,
        model: &Model,
        like: Option<&Filter<NG, G>>,
    ) -> Filter<NG, G> {
        let (aircraft, window) = (self.context.aircraft, &sweep.slopes.window);
        let calibration = &self.context.settings.calibration;
        let uncertainty = |output: crate::aero::Output| {
            let known = calibration.get(output.signal())?;
            (known.bias > 0.0).then_some(known.bias)
        };
        let biases: Vec<Option<f64>> = model.biases.iter().map(|b| uncertainty(b.output)).collect();
        if let Some(filter) = like {
            return filter.with_model(aircraft, window, model, &biases);
        }
        let measurements = prepared.case.measurements.clone();
        Filter::new(aircraft, window, measurements, model, &biases)
    }

    /// Standard deviations of the outputs' own noise: of the second differences of the measured
    /// values, and at least the configured resolution.
    fn least_deviations(&self, measurements: &Measurements) -> [f64; OUTPUTS] {
        let resolution = self.resolution();
        std::array::from_fn(|o| sample_noise(measurements, o).max(resolution[o]))
    }

    /// Adds the effect of the tunnel's errors on the estimates, and that of the derivatives' change
    /// over the angles of attack of the maneuver.
    fn add_held<const NX: usize, E: Equations<NX>>(
        &self,
        prepared: &PreparedCase<'a, NX, E>,
        pass: &WidePass,
        bounds: &Bounds,
        effect: Option<&SlopeEffect>,
        fit: &mut Fit,
    ) {
        let uncertainties = self.held_uncertainties(&prepared.model);
        let changes = bounds.changes(&pass.held_shifts(&uncertainties));
        let mut held = covariance_of(&changes, fit.values.len());
        let effects = uncertainties
            .iter()
            .zip(&changes)
            .map(|((name, deviation), change)| {
                ErrorEffect::new(SharedError::Held((*name).to_owned()), *deviation, change)
            });
        fit.shared_errors.extend(effects);
        if let Some(effect) = effect {
            for (value, change) in fit.values.iter_mut().zip(effect.change.iter()) {
                *value += change;
            }
            held += &effect.covariance;
        }
        add(&mut fit.covariance, &held);
        add(&mut fit.covariance_corrected, &held);
        fit.covariance_held = Some(held);
    }

    /// Adds the effect of calibration errors. The estimates move by H⁻¹ times the gradient of the
    /// maneuver as an instrument in error would have recorded it.
    fn add_calibration<const NX: usize, E: Equations<NX>, const NG: usize, G: InGusts<NG>>(
        &self,
        prepared: &PreparedCase<'a, NX, E>,
        sweep: &Sweep,
        fitted: &FilterFit<NG, G>,
        fit: &mut Fit,
    ) {
        let model = sweep.held_in(&prepared.model);
        let window = &sweep.slopes.window;
        let errors = self.misreadings(window);
        if self.context.settings.calibration.is_empty() && errors.is_empty() {
            return;
        }
        let cases = errors.iter().map(|error| {
            let misread_window = error.of_window(window);
            let measured = misread(&prepared.case, error);
            let windows = [window, &misread_window];
            let filter = &fitted.filter;
            filter.as_recorded(self.context.aircraft, windows, measured, &model)
        });
        let Ok(shifts) = fitted.filter.gradient_shifts(fitted.parameters(), cases) else {
            fit.reason.push_str(super::calibration_effect::NOT_COUNTED);
            return;
        };
        let changes = fitted.bounds().changes(&shifts);
        let common = covariance_of(&changes, fit.values.len());
        let effects = errors.iter().zip(&changes);
        fit.shared_errors
            .extend(effects.map(|(error, change)| error.effect(change)));
        add(&mut fit.covariance_corrected, &common);
        fit.covariance_calibration = Some(common);
    }

    /// Adds what the filter found of the air to the row of `fits`.
    pub(super) fn add_gusts(&self, filtered: &Filtered, step_s: f64, row: &mut FitRow) {
        let noise = &filtered.noise;
        let maneuver = self.record.values(signal::VELOCITY).unwrap_or_default();
        let velocities = maneuver.get(self.range()).unwrap_or_default();
        let velocity = velocities.iter().sum::<f64>() / velocities.len().max(1) as f64;
        let steps = GUST_SCALE_FT / (2.0 * velocity * step_s);
        let rotary = match self.class.axis {
            Axis::Longitudinal => noise.gusts[0],
            Axis::Lateral => noise.gusts[0].max(noise.gusts[1]),
        };
        [row.initial_cost, row.final_cost] = filtered.output_error_costs;
        row.method = Some(EstimationMethod::FilterError);
        row.gust_ft_s = Some(velocity * noise.angle * steps.sqrt());
        row.rotary_gust_deg_s = Some(rotary * DEG);
        row.gust_corner_rad_s = Some(noise.corner);
        row.autocorrelation = largest(filtered.autocorrelation);
        row.likelihood_gain = filtered.likelihood_gain;
    }

    /// Adds the residuals' correlation to the row of a fit by output error.
    pub(super) fn add_still_air(measurements: &Measurements, fit: &Fit, row: &mut FitRow) {
        row.method = Some(EstimationMethod::OutputError);
        row.autocorrelation = largest(lag_one(measurements, &fit.response.outputs));
    }

    /// Starting values with the tunnel's derivatives.
    pub(super) fn tunnel_start<const NX: usize, E: Equations<NX>>(
        &self,
        case: &Case<NX, E>,
    ) -> Vec<f64> {
        let maneuver = self.maneuver;
        case.starting_values(|name| {
            self.context
                .start
                .value(name, maneuver.alpha_deg, maneuver.mach)
                .map_or(0.0, |v| v.value)
        })
    }
}

fn add(sum: &mut Option<DMatrix<f64>>, part: &DMatrix<f64>) {
    if let Some(sum) = sum {
        *sum += part;
    }
}

/// Slopes of the derivatives over α, and the values at which a fit holds them.
struct Sweep {
    slopes: AlphaSlopes,
    values: Vec<f64>,
}

impl Sweep {
    /// Derivatives that do not change over α.
    fn constant(slopes: AlphaSlopes) -> Self {
        let values = vec![0.0; slopes.derivatives.len()];
        Sweep { slopes, values }
    }

    /// A share of the way to other values.
    fn towards(&self, values: &DVector<f64>, share: f64) -> Self {
        let both = self.values.iter().zip(values.iter());
        Sweep {
            slopes: self.slopes.clone(),
            values: both.map(|(from, to)| from + share * (to - from)).collect(),
        }
    }

    fn effect(&self, pass: &WidePass, bounds: &Bounds) -> Option<SlopeEffect> {
        pass.slope_effect(bounds, &self.slopes.derivatives, &self.values)
    }

    fn is_constant(&self) -> bool {
        self.values.iter().all(|v| *v == 0.0)
    }

    fn held_in<'s>(&'s self, model: &Model<'s>) -> Model<'s> {
        if self.is_constant() {
            model.clone()
        } else {
            self.slopes.held_in(model, &self.values)
        }
    }
}

/// Fit with the derivatives' slopes held, and the effect of what they are known to be off.
struct Swept<const NG: usize, G: InGusts<NG>> {
    sweep: Sweep,
    fitted: FilterFit<NG, G>,
    pass: WidePass,
    effect: Option<SlopeEffect>,
}

impl<const NG: usize, G: InGusts<NG>> Swept<NG, G> {
    /// Effect of the slopes, if it moves the estimates by more than a small part of their bounds.
    fn moving_effect(&self) -> Option<&SlopeEffect> {
        let bounds = self.fitted.bounds();
        let moves = |e: &&SlopeEffect| bounds.are_exceeded_by(&e.change, SMALL_CHANGE);
        self.effect.as_ref().filter(moves)
    }
}

/// Start of a filter's iteration: derivatives, biases and initial states, and the noise.
type FilterStart = (Vec<f64>, Noise);

/// Minimum of a filter's cost with its bounds.
struct Minimum {
    scored: Scored,
    bounds: Bounds,
}

impl Minimum {
    /// −log of the likelihood.
    fn cost(&self) -> f64 {
        self.scored.response.cost
    }

    fn by_cost(&self, other: &Minimum) -> Ordering {
        self.cost().total_cmp(&other.cost())
    }

    /// True where a rotary gust is as large as a good part of the rate that it adds to.
    fn is_mostly_air<const NX: usize, const NG: usize, G: InGusts<NG>>(
        &self,
        filter: &Filter<NG, G>,
        states: &[SVector<f64, NX>],
    ) -> bool {
        let gusts = filter.noise(&self.scored.parameters).gusts;
        let mut rates = G::FELT_RATES.iter().zip(gusts);
        rates.any(|((rate, _), gust)| {
            let values = states.iter().map(|x| x[*rate]);
            let values = DVector::from_iterator(states.len(), values);
            gust > MOSTLY * values.variance().sqrt()
        })
    }
}

/// Converged filter.
struct FilterFit<const NG: usize, G: InGusts<NG>> {
    filter: Filter<NG, G>,
    found: Minimum,
}

impl<const NG: usize, G: InGusts<NG>> FilterFit<NG, G> {
    fn cost(&self) -> f64 {
        self.found.cost()
    }

    fn bounds(&self) -> &Bounds {
        &self.found.bounds
    }

    fn parameters(&self) -> &[f64] {
        &self.found.scored.parameters
    }

    /// Derivatives, biases and initial states, moved by a share of a change.
    fn moved(&self, change: &DVector<f64>, share: f64) -> Vec<f64> {
        let both = self.own().iter().zip(change.iter());
        both.map(|(own, change)| own + share * change).collect()
    }

    /// Derivatives, biases and initial states.
    fn own(&self) -> &[f64] {
        &self.parameters()[..self.filter.first_noise()]
    }

    fn noise(&self) -> Noise {
        self.filter.noise(self.parameters())
    }

    /// Information of derivatives, biases and initial states.
    fn information(&self) -> DMatrix<f64> {
        let n = self.filter.first_noise();
        let all = self.found.scored.response.information();
        all.view((0, 0), (n, n)).into_owned()
    }

    fn outputs_along_air(&self) -> Option<Vec<[f64; OUTPUTS]>> {
        self.filter.outputs_along_air(self.parameters()).ok()
    }

    /// Fit in the form of output error: the noise's parameters are left out, and the outputs are the
    /// predicted ones.
    fn fit(&self) -> Fit {
        let Minimum { scored, bounds } = &self.found;
        Fit {
            outcome: Outcome::Converged,
            reason: scored.reason.clone(),
            iterations: scored.iterations,
            initial_cost: Some(scored.initial_cost),
            final_cost: Some(scored.response.cost),
            values: self.own().to_vec(),
            weights: self.noise().outputs.map(|deviation| deviation.powi(-2)),
            response: Response::of_outputs(scored.response.predicted.clone()),
            condition_number: Some(bounds.condition_number),
            undetermined: vec![],
            covariance: Some(bounds.covariance.clone()),
            covariance_held: None,
            covariance_calibration: None,
            covariance_corrected: Some(bounds.corrected(&self.filter, scored)),
            shared_errors: vec![],
        }
    }
}

/// Measurements as an instrument in error would have recorded them.
fn misread<const NX: usize, E: Equations<NX>>(
    case: &Case<NX, E>,
    error: &Misreading,
) -> Measurements {
    let mut measured = case.measurements.clone();
    let outputs = E::AXIS.outputs();
    if let Some(o) = outputs.iter().position(|o| o.signal() == error.signal) {
        for values in &mut measured.values {
            values[o] += error.scale * values[o] + error.bias;
        }
    }
    measured
}

/// Standard deviation of an output's white noise: the second difference of white noise has six times
/// its variance, and that of the motion is small.
fn sample_noise(measurements: &Measurements, output: usize) -> f64 {
    const NORMAL_MEDIAN: f64 = 0.674_489_75;
    let both = measurements
        .values
        .windows(3)
        .zip(measurements.used.windows(3));
    let differences = both
        .filter(|(_, used)| used.iter().all(|used| used[output]))
        .map(|(z, _)| (z[0][output] - 2.0 * z[1][output] + z[2][output]).abs());
    median(differences).unwrap_or(0.0) / (NORMAL_MEDIAN * 6f64.sqrt())
}

/// True for a fit by output error whose residuals show no motion of the air.
pub(super) fn is_white(measurements: &Measurements, fit: &Fit) -> bool {
    let correlations = lag_one(measurements, &fit.response.outputs);
    fit.outcome == Outcome::Converged && correlations.iter().all(|r| *r < COLOURED)
}

/// Correlation of neighbouring residuals, output by output.
fn lag_one(measurements: &Measurements, computed: &[[f64; OUTPUTS]]) -> [f64; OUTPUTS] {
    let residual = |k: usize, o: usize| {
        let (z, y) = (measurements.values.get(k)?, computed.get(k)?);
        measurements.used[k][o].then(|| z[o] - y[o])
    };
    std::array::from_fn(|o| {
        let (mut square, mut product) = (0.0, 0.0);
        for k in 1..measurements.values.len() {
            if let (Some(before), Some(now)) = (residual(k - 1, o), residual(k, o)) {
                square += 0.5 * (before * before + now * now);
                product += before * now;
            }
        }
        if square > 0.0 { product / square } else { 0.0 }
    })
}

fn largest(values: [f64; OUTPUTS]) -> Option<f64> {
    values.into_iter().reduce(f64::max)
}

/// Cost of output error's residuals as white noise of their own variances.
fn white_cost(measurements: &Measurements, fit: &Fit) -> Option<f64> {
    fit.final_cost?;
    let mut cost = 0.0;
    for o in 0..OUTPUTS {
        let both = measurements.values.iter().zip(&fit.response.outputs);
        let counted = both.zip(&measurements.used).filter(|(_, used)| used[o]);
        let squares: Vec<f64> = counted.map(|((z, y), _)| (z[o] - y[o]).powi(2)).collect();
        let count = squares.len() as f64;
        let variance = squares.iter().sum::<f64>() / count.max(1.0);
        cost += 0.5 * count * (variance.ln() + 1.0);
    }
    cost.is_finite().then_some(cost)
}
