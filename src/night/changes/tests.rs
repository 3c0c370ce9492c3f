//! Two nights that differ in one thing: only that difference is found, with its cause.

use std::collections::BTreeMap;

use super::*;
use crate::lineage::Lineage;
use crate::maneuver::Maneuver;
use crate::tables::TunnelVerdict;
use crate::tables::{CommonErrorVerdict, InstrumentError, InstrumentTrend, InstrumentTrendRow};

#[derive(Clone)]
struct Campaign {
    lineage: Lineage,
    maneuvers: Vec<ManeuverWindow>,
    fits: Vec<FitRow>,
    estimates: Vec<EstimateRow>,
    trends: Vec<PublishedTrend>,
    verdicts: Vec<PublishedVerdict>,
    instrument_trends: Vec<InstrumentTrendRow>,
}

impl Campaign {
    fn tables(&self) -> NightTables<'_> {
        let Campaign {
            lineage,
            maneuvers,
            fits,
            estimates,
            trends,
            verdicts,
            instrument_trends,
        } = self;
        NightTables {
            lineage,
            maneuvers,
            fits,
            estimates,
            trends,
            verdicts,
            posterior: &[],
            covariances: &[],
            self_check: &[],
            instrument_trends,
        }
    }

    fn fly(&mut self, flight: &str, class: &str, value: f64) {
        let maneuver_id = format!("{flight}_{class}");
        self.lineage
            .flights
            .insert(flight.to_owned(), "01".to_owned());
        self.maneuvers.push(ManeuverWindow {
            maneuver_id: maneuver_id.clone(),
            flight_id: flight.to_owned(),
            class: class.to_owned(),
            start_s: 10.0,
            end_s: 20.0,
        });
        self.fits.push(fit(&maneuver_id, class));
        let maneuver = Maneuver {
            flight_id: flight.into(),
            class: class.into(),
            ..Maneuver::example(&maneuver_id, 30.0)
        };
        self.estimates.push(EstimateRow {
            value: Some(value),
            bound: Some(0.05),
            bound_corrected: Some(0.1),
            ..EstimateRow::without_results(&maneuver, "Cm_de", "per_deg", Status::Estimated)
        });
    }
}

fn fit(maneuver_id: &str, class: &str) -> FitRow {
    FitRow {
        iterations: 5,
        ..FitRow::without_numbers(maneuver_id, class, Outcome::Converged)
    }
}

fn campaign() -> Campaign {
    let mut campaign = Campaign {
        lineage: Lineage::default(),
        maneuvers: vec![],
        fits: vec![],
        estimates: vec![],
        trends: vec![],
        verdicts: vec![],
        instrument_trends: vec![],
    };
    campaign.fly("f1", "one", 1.0);
    campaign.fly("f2", "two", 2.0);
    campaign.trends.push(PublishedTrend {
        derivative: "Cm_de".into(),
        unit: "per_deg".into(),
        group: "all".into(),
        alpha_deg: 30.0,
        value: 1.5,
        standard_error: 0.1,
    });
    campaign.verdicts.push(PublishedVerdict {
        derivative: "Cm_de".into(),
        alpha_deg: 30.0,
        verdict: TunnelVerdict::Agrees,
    });
    campaign
}

#[test]
fn two_nights_of_the_same_differ_in_nothing() {
    let changes = between("0001", &campaign().tables(), &campaign().tables());
    assert!(changes.is_empty() && !changes.alert && changes.causes.is_empty());
}

#[test]
fn a_new_flight_brings_new_maneuvers_and_is_why_a_trend_moved() {
    let mut now = campaign();
    now.fly("f3", "one", 3.0);
    now.trends[0].value = 1.7;
    now.verdicts[0].verdict = TunnelVerdict::FlightHigher;
    let changes = between("0001", &campaign().tables(), &now.tables());
    assert_eq!(changes.maneuvers.len(), 1);
    let new = &changes.maneuvers[0];
    assert_eq!(
        (&*new.maneuver_id, new.what, &*new.because),
        ("f3_one", ManeuverDifference::New, "new flight f3")
    );
    assert_eq!(
        (changes.trends.len(), &*changes.trends[0].because),
        (1, "new flight f3")
    );
    assert_eq!(
        (changes.verdicts.len(), &*changes.verdicts[0].because),
        (1, "new flight f3")
    );
    assert!(changes.alert && changes.estimates.is_empty());
}

#[test]
fn what_moves_within_its_uncertainty_is_no_news_and_new_maneuvers_alone_no_alert() {
    let mut now = campaign();
    now.fly("f3", "one", 3.0);
    now.estimates[0].value = Some(1.09);
    now.trends[0].value = 1.59;
    let changes = between("0001", &campaign().tables(), &now.tables());
    assert!(changes.estimates.is_empty() && changes.trends.is_empty() && !changes.alert);
}

#[test]
fn a_class_s_setting_moves_its_own_maneuvers_and_the_method_those_of_all() {
    let mut before = campaign();
    let classes = |weight: f64| -> BTreeMap<String, serde_json::Value> {
        [(
            "classes".to_owned(),
            serde_json::json!({"one": {"w": weight}, "two": {"w": 1.0}}),
        )]
        .into()
    };
    before
        .lineage
        .configuration
        .insert(Stage::Estimate, classes(1.0));
    let mut now = before.clone();
    now.lineage
        .configuration
        .insert(Stage::Estimate, classes(2.0));
    now.estimates[0].value = Some(1.2);
    let changes = between("0001", &before.tables(), &now.tables());
    assert_eq!(
        (changes.estimates.len(), &*changes.estimates[0].of),
        (1, "f1_one")
    );
    assert_eq!(
        changes.estimates[0].because,
        "configuration classes.one.w: 1.0 became 2.0"
    );
    let mut now = before.clone();
    now.lineage.code.methods.insert("estimate".into(), 6);
    now.estimates[1].value = Some(2.2);
    let changes = between("0001", &before.tables(), &now.tables());
    assert_eq!(
        changes.estimates[0].because,
        "method `estimate`: version 0 became 6"
    );
}

#[test]
fn a_maneuver_is_gone_with_its_flight_or_no_longer_what_it_was() {
    let mut now = campaign();
    now.maneuvers.remove(1);
    now.fits.remove(1);
    now.estimates.remove(1);
    now.lineage.flights.remove("f2");
    now.maneuvers[0].end_s = 21.0;
    now.fits[0].outcome = Outcome::NotConverged;
    now.lineage.flights.insert("f1".into(), "02".into());
    let changes = between("0001", &campaign().tables(), &now.tables());
    let of = |id: &str| {
        changes
            .maneuvers
            .iter()
            .find(|m| m.maneuver_id == id)
            .unwrap()
    };
    assert_eq!(
        of("f1_one").words,
        "10.00-20.00 s became 10.00-21.00 s, converged became not_converged"
    );
    assert_eq!(of("f1_one").because, "the file of flight f1 changed");
    assert_eq!(
        (of("f2_two").what, &*of("f2_two").because),
        (
            ManeuverDifference::Gone,
            "flight f2 is gone from the archive"
        )
    );
    assert!(changes.alert);
}

fn trend(verdict: InstrumentTrend, since: Option<&str>) -> InstrumentTrendRow {
    InstrumentTrendRow {
        channel: "alpha".into(),
        signal: "alpha_vane_deg".into(),
        error: InstrumentError::Bias,
        unit: "deg".into(),
        flights: 12,
        mean: Some(0.1),
        mean_bound: Some(0.1),
        scatter: Some(0.3),
        common: CommonErrorVerdict::Ordinary,
        far_flights: String::new(),
        completed_flights: 0,
        verdict,
        since: since.map(Into::into),
        change: Some(0.7),
        change_bound: Some(0.05),
        probability: Some(1e-7),
    }
}

#[test]
fn an_instrument_that_steps_is_an_alert_with_its_channel_and_flight_once() {
    let (mut before, mut now) = (campaign(), campaign());
    before.instrument_trends = vec![trend(InstrumentTrend::Steady, None)];
    now.instrument_trends = vec![trend(InstrumentTrend::Step, Some("f2"))];
    let changes = between("0001", &before.tables(), &now.tables());
    let change = &changes.instruments[0];
    assert!(changes.alert && !changes.is_empty());
    assert_eq!(
        (change.channel.as_str(), change.since.as_str()),
        ("alpha", "f2")
    );
    let again = between("0002", &now.tables(), &now.tables());
    assert!(!again.alert && again.instruments.is_empty());
    // A possible step is no alert, and is one as soon as it is sure.
    let mut possible = campaign();
    possible.instrument_trends = vec![trend(InstrumentTrend::PossibleStep, Some("f2"))];
    assert!(!between("0001", &before.tables(), &possible.tables()).alert);
    assert!(between("0002", &possible.tables(), &now.tables()).alert);
}

#[test]
fn a_first_night_names_the_channel_that_steps_and_its_flight() {
    let first = of_first_night(&[
        trend(InstrumentTrend::Steady, None),
        trend(InstrumentTrend::Step, Some("f2")),
    ]);
    assert!(first.alert && first.since.is_none());
    let changes = first.instruments.iter();
    let named: Vec<(&str, &str)> = changes
        .map(|i| (i.channel.as_str(), i.since.as_str()))
        .collect();
    assert_eq!(named, [("alpha", "f2")]);
    let possible = of_first_night(&[trend(InstrumentTrend::PossibleStep, Some("f2"))]);
    assert!(!possible.alert && possible.is_empty());
}

#[test]
fn a_night_before_without_readable_tables_is_an_alert_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let nights = Nights::read_only(folder.path());
    let before = Night {
        name: "0007".to_owned(),
        ..Night::default()
    };
    let now = PublishedNight::default();
    let changes = since(&nights, &before, &now.tables());
    assert_eq!(changes.since.as_deref(), Some("0007"));
    assert!(changes.alert);
    let why = changes.not_compared.unwrap();
    assert!(why.contains("0007") && why.contains("cannot read"), "{why}");
}
