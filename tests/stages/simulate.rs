//! Simulate: what the simulator flies, the estimator finds again; the two write the same physics down differently.

use std::path::Path;

use harvest::config::Simulation;
use harvest::estimate::{self, Basis, Estimated};
use harvest::simulate::Flown;

fn simulation() -> Simulation {
    std::env::set_current_dir(env!("CARGO_MANIFEST_DIR")).unwrap();
    Simulation::load(Path::new("pipelines/harv/cards.yaml")).unwrap()
}

fn estimated(simulation: &Simulation, flown: &Flown) -> Estimated {
    let config = &simulation.config;
    let basis = Basis {
        aircraft: &config.aircraft,
        buildup: &config.buildup,
        tunnel: &config.tunnel,
        settings: &config.estimate,
    };
    estimate::maneuver(&flown.record, &flown.maneuver, config.class(&flown.maneuver.class).unwrap(), &basis)
}

#[test]
#[ignore = "prints"]
fn look() {
    let s = simulation();
    for class in s.cards.programs.keys() {
        for alpha in [10.0, 20.0, 30.0, 40.0, 50.0, 60.0] {
            let card = s.card(class, alpha).unwrap();
            let t0 = std::time::Instant::now();
            let flown = match s.simulator.fly(&card) {
                Ok(f) => f,
                Err(p) => {
                    println!("{class} {alpha} {}", p.reason);
                    continue;
                }
            };
            let took = t0.elapsed().as_secs_f64();
            let range = |n: &str| {
                let v = flown.record.values(n).unwrap();
                (v.iter().copied().fold(f64::INFINITY, f64::min), v.iter().copied().fold(f64::NEG_INFINITY, f64::max))
            };
            let e = estimated(&s, &flown);
            let mut worst: Vec<(f64, f64, String)> = e
                .estimates
                .iter()
                .filter(|r| r.status == "estimated")
                .filter_map(|r| {
                    let t = flown.truth.iter().find(|t| t.derivative == r.derivative)?.value;
                    let err = r.value? - t;
                    Some((err / t * 100.0, err / r.bound.unwrap_or(f64::NAN), r.derivative.clone()))
                })
                .collect();
            worst.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
            println!(
                "{class} {alpha} {} {:.2}s V {:.0} T {:.0} alpha {:.1?} beta {:.1?} phi {:.1?} theta {:.1?} de {:.1?} dpv {:.1?} dr {:.1?} | med {:.3}% {:?}",
                e.fit.outcome,
                took,
                flown.maneuver.velocity_ft_s,
                flown.record.values("thrust_lbf").unwrap()[0],
                range("alpha_vane_deg"),
                range("beta_vane_deg"),
                range("phi_deg"),
                range("theta_deg"),
                range("de_deg"),
                range("dpv_deg"),
                range("dr_deg"),
                worst.get(worst.len() / 2).map_or(f64::NAN, |w| w.0),
                worst.iter().rev().take(4).map(|w| format!("{} {:.2}% {:.2}", w.2, w.0, w.1)).collect::<Vec<_>>()
            );
        }
    }
}
