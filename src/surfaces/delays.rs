//! Delays of the surfaces from the evidence of many maneuvers.
//!
//! A recorder delays all its channels alike, or each bus by its own delay. The delay of a surface s
//! is τ_s = μ + d_s, with a common part μ and its own part d_s. Both are normal. The data determine
//! their standard deviations, from well below a millisecond to the tens of milliseconds of a bus. A
//! surface that hardly moves thus gets the delay of the others, with a bound as wide as the
//! difference between surfaces.
//!
//! Maneuvers are weighted by Student's t, since a model that does not fit a maneuver biases its
//! delays. The bound is the larger of the posterior's and the jackknife's, and at least the error
//! of the equations' timing.

use nalgebra::{DMatrix, DVector};

use super::evidence::{DelayEvidence, FlightEvidence, SurfaceDelay};
use crate::numerics::linear_algebra::symmetric;
use crate::numerics::statistics::random_effects::{Observation, RandomEffects};

/// Error that linear interpolation between samples leaves in a delay, as a share of the sampling
/// interval. In simulated campaigns without delay the estimate is 0.45 ms at a sampling interval of
/// 25 ms.
const OF_STEP: f64 = 0.02;

/// Standard deviations that delays may have, in common and by surface, s: each twice the one
/// before, all with the same prior probability.
const STANDARD_DEVIATIONS_S: [f64; 8] = [0.125e-3, 0.25e-3, 0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3];

/// Standard deviation of a maneuver's own delays, s, when its distance from the others is measured.
const OWN_S: f64 = 0.02;

/// Degrees of freedom of Student's t.
const FREEDOM: f64 = 5.0;

/// Number of times that the weights of the maneuvers are estimated anew.
const WEIGHT_ROUNDS: usize = 8;

/// Least number of flights for which the jackknife leaves out one flight at a time; with fewer it
/// leaves out one maneuver at a time.
const FEWEST_FLIGHTS: usize = 5;

/// Longest delay, s: at the band's upper end a longer one turns the phase by more than a quarter.
const LONGEST_S: f64 = 0.1;

/// Delays from one flight's maneuvers.
#[must_use]
pub fn of_flight(maneuvers: &[DelayEvidence], step_s: f64) -> Vec<SurfaceDelay> {
    let alone: Vec<Vec<&DelayEvidence>> = maneuvers.iter().map(|m| vec![m]).collect();
    combined(&alone, step_s)
}

/// Delays from all flights. Their bounds contain the scatter between flights.
#[must_use]
pub fn of_campaign(flights: &[FlightEvidence]) -> Vec<SurfaceDelay> {
    let step_s = flights.iter().map(|f| f.step_s).fold(0.0, f64::max);
    let groups: Vec<Vec<&DelayEvidence>> = if flights.len() >= FEWEST_FLIGHTS {
        flights.iter().map(|f| f.delays.iter().collect()).collect()
    } else {
        let maneuvers = flights.iter().flat_map(|f| &f.delays);
        maneuvers.map(|m| vec![m]).collect()
    };
    let mut delays = combined(&groups, step_s);
    for delay in &mut delays {
        let own = flights.iter().flat_map(|f| &f.own_delays);
        let own = own.filter(|own| own.surface == delay.surface);
        delay.bound_s = delay.bound_s.hypot(scatter_s(own));
    }
    delays
}

/// Scatter of a surface's delay between flights beyond their bounds, standard deviation.
fn scatter_s<'a>(flights: impl Iterator<Item = &'a SurfaceDelay>) -> f64 {
    let observation = |flight: &SurfaceDelay| Observation {
        value: flight.delay_s,
        variance: flight.bound_s * flight.bound_s,
    };
    let observations: Vec<Observation> = flights.map(observation).collect();
    let pooled = RandomEffects::mean_of(&observations);
    pooled.map_or(0.0, |pooled| pooled.scatter_variance.sqrt())
}

/// Delays from groups of maneuvers, of which the jackknife leaves out one at a time.
fn combined(groups: &[Vec<&DelayEvidence>], step_s: f64) -> Vec<SurfaceDelay> {
    let surfaces = surfaces_of(groups);
    if surfaces.is_empty() {
        return vec![];
    }
    let sums: Vec<Vec<DelayInformation>> = groups
        .iter()
        .map(|group| {
            let members = group.iter();
            members
                .map(|m| DelayInformation::of(m, &surfaces))
                .collect()
        })
        .collect();
    let Some((delays, deviations, jackknife)) = robust(&sums, surfaces.len()) else {
        return vec![];
    };
    surfaces
        .into_iter()
        .enumerate()
        .map(|(s, surface)| SurfaceDelay {
            surface,
            delay_s: delays[s].clamp(-LONGEST_S, LONGEST_S),
            bound_s: deviations[s].max(jackknife[s]).hypot(OF_STEP * step_s),
        })
        .collect()
}

/// Signals of all surfaces, sorted.
fn surfaces_of(groups: &[Vec<&DelayEvidence>]) -> Vec<String> {
    let mut surfaces: Vec<String> = groups
        .iter()
        .flatten()
        .flat_map(|maneuver| maneuver.surfaces.iter().cloned())
        .collect();
    surfaces.sort_unstable();
    surfaces.dedup();
    surfaces
}

/// Information on the delays τ of all surfaces: matrix H and vector h of the cost ½ τᵀ H τ − τᵀ h.
#[derive(Clone, Debug)]
struct DelayInformation {
    matrix: DMatrix<f64>,
    moment: DVector<f64>,
}

impl DelayInformation {
    fn zero(count: usize) -> DelayInformation {
        DelayInformation {
            matrix: DMatrix::zeros(count, count),
            moment: DVector::zeros(count),
        }
    }

    /// Information of a maneuver, extended to the list of all surfaces.
    fn of(evidence: &DelayEvidence, surfaces: &[String]) -> DelayInformation {
        let mut information = DelayInformation::zero(surfaces.len());
        let place = |surface: &String| surfaces.iter().position(|s| s == surface);
        let places: Vec<Option<usize>> = evidence.surfaces.iter().map(place).collect();
        let count = places.len();
        for (i, row) in places.iter().enumerate() {
            let Some(row) = *row else { continue };
            information.moment[row] = evidence.moment.get(i).copied().unwrap_or(0.0);
            for (j, column) in places.iter().enumerate() {
                let Some(column) = *column else { continue };
                let value = evidence.information.get(i * count + j);
                information.matrix[(row, column)] = value.copied().unwrap_or(0.0);
            }
        }
        information
    }

    fn add(&mut self, weight: f64, other: &DelayInformation) {
        self.matrix += weight * &other.matrix;
        self.moment += weight * &other.moment;
    }

    /// Squared distance of a maneuver's own delays from given delays, and its degrees of freedom.
    /// The own delays have a wide prior.
    fn distance(&self, delays: &DVector<f64>) -> Option<(f64, f64)> {
        let count = delays.len();
        let own = &self.matrix + DMatrix::identity(count, count) * OWN_S.powi(-2);
        let covariance = symmetric::inverse(&own)?;
        let gradient = &self.moment - &self.matrix * delays;
        let freedom = (&covariance * &self.matrix).trace();
        Some((gradient.dot(&(covariance * &gradient)), freedom))
    }
}

type Robust = (DVector<f64>, Vec<f64>, Vec<f64>);

/// Estimates the delays with robust weights of the maneuvers. Returns delays, their standard
/// deviations, and the standard deviations of the jackknife.
fn robust(groups: &[Vec<DelayInformation>], count: usize) -> Option<Robust> {
    let mut weights: Vec<Vec<f64>> = groups.iter().map(|g| vec![1.0; g.len()]).collect();
    let mut sums = weighted_sums(groups, &weights, count);
    let mut posterior = DelayPosterior::of(&total(&sums, count))?;
    for _ in 0..WEIGHT_ROUNDS {
        let (mut square, mut freedom) = (0.0, 0.0);
        for (group, weights) in groups.iter().zip(&mut weights) {
            for (maneuver, weight) in group.iter().zip(weights) {
                let (distance, own) = maneuver.distance(&posterior.delays)?;
                *weight = ((FREEDOM + own) / (FREEDOM + distance)).min(1.0);
                square += *weight * distance;
                freedom += own;
            }
        }
        let dispersion = if freedom > 0.0 {
            (square / freedom).max(1.0)
        } else {
            1.0
        };
        for weight in weights.iter_mut().flatten() {
            *weight /= dispersion;
        }
        sums = weighted_sums(groups, &weights, count);
        posterior = DelayPosterior::of(&total(&sums, count))?;
    }
    let jackknife = jackknife(&sums, count)?;
    Some((posterior.delays, posterior.deviations, jackknife))
}

fn weighted_sums(
    groups: &[Vec<DelayInformation>],
    weights: &[Vec<f64>],
    count: usize,
) -> Vec<DelayInformation> {
    let sum = |(group, weights): (&Vec<DelayInformation>, &Vec<f64>)| {
        let mut sum = DelayInformation::zero(count);
        for (maneuver, weight) in group.iter().zip(weights) {
            sum.add(*weight, maneuver);
        }
        sum
    };
    groups.iter().zip(weights).map(sum).collect()
}

fn total(sums: &[DelayInformation], count: usize) -> DelayInformation {
    let mut total = DelayInformation::zero(count);
    for sum in sums {
        total.add(1.0, sum);
    }
    total
}

/// Standard deviations of the delays by leaving out one group at a time.
fn jackknife(sums: &[DelayInformation], count: usize) -> Option<Vec<f64>> {
    let groups = sums.len() as f64;
    let total = total(sums, count);
    let mut left_out = Vec::with_capacity(sums.len());
    for sum in sums {
        let mut rest = total.clone();
        rest.add(-1.0, sum);
        left_out.push(DelayPosterior::of(&rest)?.delays);
    }
    let mean = left_out.iter().sum::<DVector<f64>>() / groups;
    let deviation = |s: usize| {
        let square = |d: &DVector<f64>| (d[s] - mean[s]).powi(2);
        let sum: f64 = left_out.iter().map(square).sum();
        ((groups - 1.0) / groups * sum).sqrt()
    };
    Some((0..count).map(deviation).collect())
}

/// Mean and standard deviations of the delays.
#[derive(Clone, Debug)]
struct DelayPosterior {
    delays: DVector<f64>,
    deviations: Vec<f64>,
}

impl DelayPosterior {
    /// Mixture over the standard deviations of the delays, weighted by the evidence for each.
    fn of(data: &DelayInformation) -> Option<DelayPosterior> {
        let mut parts = Vec::with_capacity(STANDARD_DEVIATIONS_S.len().pow(2));
        for own_s in STANDARD_DEVIATIONS_S {
            let independent = IndependentPosterior::new(data, own_s)?;
            for common_s in STANDARD_DEVIATIONS_S {
                parts.push(independent.with_common_delay(data, common_s)?);
            }
        }
        let largest = parts
            .iter()
            .map(|p| p.log_evidence)
            .fold(f64::MIN, f64::max);
        let likelihoods = parts.iter().map(|p| (p.log_evidence - largest).exp());
        let sum: f64 = likelihoods.clone().sum();
        let shares: Vec<f64> = likelihoods.map(|l| l / sum).collect();
        let mut delays = DVector::zeros(data.moment.len());
        for (part, share) in parts.iter().zip(&shares) {
            delays += *share * &part.delays;
        }
        let variance = |s: usize| {
            let of_part = |(part, share): (&PosteriorAtDeviations, &f64)| {
                share * (part.variances[s] + (part.delays[s] - delays[s]).powi(2))
            };
            parts.iter().zip(&shares).map(of_part).sum::<f64>()
        };
        let deviations = (0..delays.len()).map(|s| variance(s).sqrt()).collect();
        Some(DelayPosterior { delays, deviations })
    }
}

/// Posterior at one pair of standard deviations of the delays, common and own.
struct PosteriorAtDeviations {
    delays: DVector<f64>,
    variances: DVector<f64>,
    log_evidence: f64,
}

/// Posterior of delays without a common part, at one standard deviation of the own parts.
struct IndependentPosterior {
    /// Variance of the own parts.
    own: f64,
    covariance: DMatrix<f64>,
    delays: DVector<f64>,
    log_determinant: f64,
}

impl IndependentPosterior {
    fn new(data: &DelayInformation, own_s: f64) -> Option<IndependentPosterior> {
        let (count, own) = (data.moment.len(), own_s * own_s);
        let posterior = &data.matrix + DMatrix::identity(count, count) / own;
        let covariance = symmetric::inverse(&posterior)?;
        Some(IndependentPosterior {
            own,
            delays: &covariance * &data.moment,
            covariance,
            log_determinant: posterior.cholesky()?.ln_determinant(),
        })
    }

    /// Posterior with a common part. The prior covariance own² I + common² 1 1ᵀ of n delays has the
    /// inverse I/own² − f 1 1ᵀ with f = common²/(own² (own² + n common²)). With C the covariance
    /// without the common part, the covariance is C + f/g C 1 1ᵀ C with g = 1 − f 1ᵀ C 1, and the
    /// determinant of its inverse is g times the one without. `None` unless g is positive.
    fn with_common_delay(
        &self,
        data: &DelayInformation,
        common_s: f64,
    ) -> Option<PosteriorAtDeviations> {
        let (count, own, common) = (data.moment.len() as f64, self.own, common_s * common_s);
        let along_one = own + count * common;
        let factor = common / (own * along_one);
        let column = self.covariance.column_sum();
        let left = 1.0 - factor * column.sum();
        if left.is_nan() || left <= 0.0 {
            return None;
        }
        let raise = factor / left;
        let delays = &self.delays + raise * column.dot(&data.moment) * &column;
        let log_prior = (count - 1.0) * own.ln() + along_one.ln();
        let log_determinant = self.log_determinant + left.ln();
        Some(PosteriorAtDeviations {
            log_evidence: 0.5 * (data.moment.dot(&delays) - log_prior - log_determinant),
            variances: self.covariance.diagonal() + raise * column.component_mul(&column),
            delays,
        })
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;
    use crate::output_error::tests::Noise;

    #[test]
    fn the_posterior_with_a_common_delay_is_that_of_its_whole_prior() {
        let evidence = maneuver(&[("da", 3.0, 0.5), ("de", 1.0, 2.0), ("dr", -2.0, 4.0)]);
        let surfaces = surfaces_of(&[vec![&evidence]]);
        let data = DelayInformation::of(&evidence, &surfaces);
        for (own_s, common_s) in [(1e-3, 4e-3), (0.125e-3, 16e-3), (16e-3, 0.125e-3)] {
            let found = IndependentPosterior::new(&data, own_s)
                .unwrap()
                .with_common_delay(&data, common_s)
                .unwrap();
            let prior = DMatrix::from_fn(3, 3, |i, j| {
                common_s.powi(2) + if i == j { own_s.powi(2) } else { 0.0 }
            });
            let information = &data.matrix + prior.clone().try_inverse().unwrap();
            let covariance = information.clone().try_inverse().unwrap();
            let delays = &covariance * &data.moment;
            let determinants = information.determinant() * prior.determinant();
            let log_evidence = 0.5 * (data.moment.dot(&delays) - determinants.ln());
            assert_relative_eq!(found.delays, delays, max_relative = 1e-8);
            let variances = covariance.diagonal();
            assert_relative_eq!(found.variances, variances, max_relative = 1e-8);
            assert_relative_eq!(found.log_evidence, log_evidence, max_relative = 1e-8);
        }
    }

    /// Evidence of one surface each: its delay in ms with a bound in ms.
    fn maneuver(entries: &[(&str, f64, f64)]) -> DelayEvidence {
        let count = entries.len();
        let mut information = vec![0.0; count * count];
        let mut moment = vec![0.0; count];
        for (i, (_, delay_ms, bound_ms)) in entries.iter().enumerate() {
            let own = (1e-3 * bound_ms).powi(-2);
            information[i * count + i] = own;
            moment[i] = own * 1e-3 * delay_ms;
        }
        DelayEvidence {
            surfaces: entries.iter().map(|(s, ..)| (*s).to_owned()).collect(),
            information,
            moment,
        }
    }

    fn of_flight(maneuvers: &[DelayEvidence]) -> Vec<SurfaceDelay> {
        super::of_flight(maneuvers, 0.025)
    }

    fn flight(delays: Vec<DelayEvidence>) -> FlightEvidence {
        FlightEvidence {
            flight_id: "f".to_owned(),
            step_s: 0.0,
            own_delays: super::of_flight(&delays, 0.0),
            delays,
            effects: vec![],
        }
    }

    fn of<'a>(delays: &'a [SurfaceDelay], surface: &str) -> &'a SurfaceDelay {
        delays.iter().find(|d| d.surface == surface).unwrap()
    }

    #[test]
    fn surfaces_of_one_recorder_share_their_delay() {
        let all = |k: u32| {
            let off = 0.3 * (f64::from(k) - 1.5);
            maneuver(&[
                ("da", 10.0 + off, 1.0),
                ("dr", 10.2 - off, 1.0),
                ("de", 9.8 + off, 1.0),
                ("dlef", 40.0, 80.0),
            ])
        };
        let delays = of_flight(&(0..4).map(all).collect::<Vec<_>>());
        let (moved, still) = (of(&delays, "da"), of(&delays, "dlef"));
        assert!((moved.delay_s - 0.010).abs() < 0.5e-3, "{moved:?}");
        assert!((still.delay_s - 0.010).abs() < 0.5e-3, "{still:?}");
        assert!(
            moved.bound_s < 0.8e-3 && still.bound_s < 1.5e-3,
            "{still:?}"
        );
    }

    #[test]
    fn surfaces_of_different_buses_keep_their_own() {
        let all = |_| {
            maneuver(&[
                ("da", 6.0, 0.8),
                ("dr", 12.0, 0.8),
                ("dpv", -8.0, 0.8),
                ("dlef", 40.0, 80.0),
            ])
        };
        let delays = of_flight(&(0..4).map(all).collect::<Vec<_>>());
        for (surface, delay_s) in [("da", 6e-3), ("dr", 12e-3), ("dpv", -8e-3)] {
            let found = of(&delays, surface);
            assert!((found.delay_s - delay_s).abs() < 0.3e-3, "{found:?}");
            assert!(found.bound_s < 0.8e-3, "{found:?}");
        }
        assert!(of(&delays, "dlef").bound_s > 5e-3);
    }

    #[test]
    fn one_maneuver_that_does_not_fit_hardly_moves_the_others() {
        let mut maneuvers: Vec<DelayEvidence> = (0..8)
            .map(|k| maneuver(&[("da", 0.2 * (f64::from(k) - 3.5), 0.5)]))
            .collect();
        maneuvers.push(maneuver(&[("da", 15.0, 0.5)]));
        let delays = of_flight(&maneuvers);
        assert!(of(&delays, "da").delay_s.abs() < 0.6e-3, "{delays:?}");
    }

    #[test]
    fn without_evidence_there_is_no_delay() {
        assert!(of_campaign(&[]).is_empty() && of_flight(&[]).is_empty());
        let nothing = of_flight(&[maneuver(&[("da", 0.0, 1e9)])]);
        assert!(of(&nothing, "da").bound_s > 5e-3);
    }

    #[test]
    fn flights_that_differ_widen_the_bound() {
        let flights = |step_ms: f64| -> Vec<FlightEvidence> {
            let delay_ms = |k: u32| 8.0 + step_ms * (f64::from(k) - 2.5);
            let maneuvers = |k| vec![maneuver(&[("da", delay_ms(k), 0.5)])];
            (0..6).map(|k| flight(maneuvers(k))).collect()
        };
        let (alike, different) = (of_campaign(&flights(0.1)), of_campaign(&flights(3.0)));
        assert!(of(&alike, "da").bound_s < 0.5e-3, "{alike:?}");
        // A single flight has no scatter, for any rounding of its weight.
        for bound_ms in [0.31, 0.47, 0.53, 0.77] {
            let one = flight(vec![maneuver(&[("da", 7.3, bound_ms)])]);
            let delays = of_campaign(&[one]);
            assert!(of(&delays, "da").bound_s < 2e-3, "{delays:?}");
        }
        // The standard deviation of six equidistant numbers is 1.87 distances.
        assert!(of(&different, "da").bound_s > 4.5e-3, "{different:?}");
    }

    #[test]
    fn bounds_have_their_nominal_coverage() {
        let mut noise = Noise(11);
        let (mut held, mut all) = (0, 0);
        for _ in 0..60 {
            let flights: Vec<FlightEvidence> = (0..5)
                .map(|_| {
                    let mut one = || {
                        let delay = |truth: f64, bound: f64, n: &mut Noise| {
                            (truth + bound * n.gaussian(), bound)
                        };
                        let (da, dr) = (delay(9.0, 2.0, &mut noise), delay(9.0, 3.0, &mut noise));
                        maneuver(&[("da", da.0, da.1), ("dr", dr.0, dr.1)])
                    };
                    flight((0..4).map(|_| one()).collect())
                })
                .collect();
            for delay in of_campaign(&flights) {
                held += u32::from((delay.delay_s - 9e-3).abs() < 1.96 * delay.bound_s);
                all += 1;
            }
        }
        let share = f64::from(held) / f64::from(all);
        assert!((0.9..=1.0).contains(&share), "{share}");
    }
}
