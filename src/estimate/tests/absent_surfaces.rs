//! Maneuvers whose flight does not record a surface.

use super::*;
use crate::aero::wind_tunnel::TunnelPoint;

/// A bench whose class leaves the pitch vanes inactive, with the tunnel's values of their derivatives.
fn bench_with_resting_vanes() -> Bench {
    let mut bench = bench();
    for (derivative, value) in truth(Axis::Longitudinal) {
        if derivative.regressor.signals().any(|s| s == "dpv_deg") {
            let statuses = &mut bench.class.statuses;
            statuses.insert(derivative.name.clone(), Status::Inactive);
            let point = TunnelPoint::new(20.0, value);
            bench.tunnel.insert(&derivative.name, point);
        }
    }
    bench
}

fn without_vanes(record: &Record) -> Record {
    let mut record = record.clone();
    record.signals.remove("dpv_deg");
    record
}

#[test]
fn a_maneuver_whose_class_estimates_a_surface_that_is_not_recorded_is_rejected_with_the_reason() {
    let bench = bench();
    let record = without_vanes(&bench.flown(1, 1.0, 0.0));
    let estimated = bench.estimate(&record, &maneuver("m", 20.0));
    assert_eq!(estimated.fit.outcome, Outcome::Rejected);
    assert_eq!(estimated.fit.reason, "`dpv_deg` is not recorded");
}

#[test]
fn an_inactive_surface_that_is_not_recorded_is_left_out() {
    let bench = bench_with_resting_vanes();
    let record = without_vanes(&bench.flown(1, 1.0, 0.0));
    let lacking = bench.estimate(&record, &maneuver("m", 20.0));
    assert_ne!(
        lacking.fit.outcome,
        Outcome::Rejected,
        "{}",
        lacking.fit.reason
    );
    let mut absent = bench_with_resting_vanes();
    absent.settings.inactive_surfaces = InactiveSurfaces::Absent;
    let expected = absent.estimate(&record, &maneuver("m", 20.0));
    for name in ["Cm_de", "Cm_alpha"] {
        assert_eq!(row(&lacking, name).value, row(&expected, name).value);
    }
}
