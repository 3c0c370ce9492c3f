//! Comparison of each flight's normal force with the tunnel's. No kinematic relation contains the
//! mass, and a mass in another unit makes every force derivative wrong by one factor.

use crate::aero::{AeroModel, Coefficient, WindTunnel};
use crate::config::Config;
use crate::error::{Problem, ProblemStage};
use crate::ingest::LiftPoint;
use crate::pipeline::campaign::Campaign;
use crate::pipeline::problems::problem;

/// Ratio of flight to tunnel, or the inverse, above which the mass is reported if it is exceeded at
/// every angle of attack. Pounds for kilograms make 2.2. Surfaces and errors of the tunnel change
/// the ratio at some angles by a third.
const FACTOR: f64 = 1.6;

/// Least number of angles of attack for a verdict.
const FEWEST_ANGLES: usize = 2;

/// Adds a problem for each flight whose normal force is a multiple or a fraction of the tunnel's at
/// every angle of attack.
pub fn compare_lift(config: &Config, campaign: &mut Campaign) {
    let accepted = campaign
        .flights
        .iter()
        .filter(|flight| flight.is_accepted());
    let found = accepted.filter_map(|flight| {
        let lift = &flight.ingested.assessment.lift;
        let factor = common_factor(lift, &config.aero_model, &config.tunnel)?;
        Some(mass_problem(flight.id(), factor))
    });
    let found: Vec<Problem> = found.collect();
    campaign.problems.extend(found);
}

fn mass_problem(flight_id: &str, factor: f64) -> Problem {
    let reason = format!(
        "at every angle of attack the normal force, from mass and an, is {factor:.2} times the tunnel's or \
         further from it: is the mass in another unit (lb for kg is 2.2), or the wing area, or the tunnel's?"
    );
    problem(ProblemStage::Ingest, flight_id, "mass", &reason)
}

/// Ratio of flight to tunnel that is nearest to one, if all ratios are beyond [`FACTOR`] on one
/// side.
fn common_factor(lift: &[LiftPoint], aero_model: &AeroModel, tunnel: &WindTunnel) -> Option<f64> {
    let ratio = |point: &LiftPoint| {
        let tunnel = tunnel_normal_force(point, aero_model, tunnel)?;
        Some(point.normal_force / tunnel).filter(|ratio| *ratio > 0.0)
    };
    let ratios: Vec<f64> = lift.iter().filter_map(ratio).collect();
    if ratios.len() < FEWEST_ANGLES {
        return None;
    }
    let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = ratios.iter().copied().fold(0.0, f64::max);
    if least > FACTOR {
        Some(least)
    } else {
        (largest < 1.0 / FACTOR).then_some(largest)
    }
}

/// Normal force coefficient of the tunnel without surfaces and rates; `None` beyond its tables.
fn tunnel_normal_force(
    point: &LiftPoint,
    aero_model: &AeroModel,
    tunnel: &WindTunnel,
) -> Option<f64> {
    let value = |name: &str| {
        let alphas = tunnel.alphas_deg(name);
        let is_inside = alphas.first()? <= &point.alpha_deg && &point.alpha_deg <= alphas.last()?;
        let value = tunnel.value(name, point.alpha_deg, point.mach);
        Some(value.filter(|_| is_inside)?.value)
    };
    let is_normal = |name: &str| {
        let derivative = aero_model.derivative(name);
        derivative.is_some_and(|d| d.coefficient == Coefficient::CN)
    };
    let sum = aero_model
        .combined
        .iter()
        .find(|sum| is_normal(&sum.constant))?;
    value(&sum.name).or_else(|| Some(value(&sum.constant)? + value(&sum.slope)? * point.alpha_deg))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aero::wind_tunnel::{Settings, TunnelPoint};
    use crate::aero::{Axis, Combined, Derivative, Regressor};

    fn aero_model() -> AeroModel {
        let derivative = |name: &str, regressor| Derivative {
            name: name.to_owned(),
            coefficient: Coefficient::CN,
            regressor,
        };
        assert_eq!(Coefficient::CN.axis(), Axis::Longitudinal);
        AeroModel {
            derivatives: vec![
                derivative("N0", Regressor::Constant),
                derivative("Na", Regressor::Alpha),
            ],
            combined: vec![Combined {
                name: "N".to_owned(),
                constant: "N0".to_owned(),
                slope: "Na".to_owned(),
            }],
            ..AeroModel::default()
        }
    }

    /// Tunnel with CN = 0.08 α, as a sum or as its parts.
    fn tunnel(as_sum: bool) -> WindTunnel {
        let mut tunnel = WindTunnel::new(Settings::default());
        for alpha_deg in [0.0, 20.0] {
            let mut insert = |name: &str, value| {
                let point = TunnelPoint::new(alpha_deg, value);
                tunnel.insert(name, point);
            };
            if as_sum {
                insert("N", 0.08 * alpha_deg);
            } else {
                insert("N0", 0.0);
                insert("Na", 0.08);
            }
        }
        tunnel
    }

    fn lift(factors: [f64; 3]) -> Vec<LiftPoint> {
        let angles = [6.0, 12.0, 30.0].into_iter().zip(factors);
        let point = |(alpha_deg, factor): (f64, f64)| LiftPoint {
            alpha_deg,
            mach: 0.4,
            normal_force: factor * 0.08 * alpha_deg,
        };
        angles.map(point).collect()
    }

    #[test]
    fn a_factor_at_every_angle_in_the_tables_is_found_and_no_other() {
        for as_sum in [true, false] {
            let factor = |factors| common_factor(&lift(factors), &aero_model(), &tunnel(as_sum));
            let near = |factor: Option<f64>, expected: f64| {
                factor.is_some_and(|factor| (factor - expected).abs() < 1e-9)
            };
            assert!(near(factor([2.2, 1.8, 1.0]), 1.8));
            assert!(near(factor([0.4, 0.5, 1.0]), 0.5));
            assert_eq!(factor([2.2, 1.3, 2.2]), None);
            assert_eq!(factor([1.0, 1.0, 2.2]), None);
        }
    }
}
