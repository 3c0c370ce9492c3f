//! Recorders that lack channels, pipelines without a part, recordings that are one maneuver.

use std::fs;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float64Array, RecordBatch};
use arrow::datatypes::DataType;

use crate::support::{
    Campaign, Row, number, pitch_steps, replaced, run, values, without, yaw_and_roll_steps,
};

/// The estimate of a derivative in the campaign's only maneuver.
fn estimate<'a>(estimates: &'a [Row], derivative: &str) -> &'a Row {
    let own = |row: &&Row| row["derivative"] == derivative;
    estimates.iter().find(own).unwrap()
}

/// Runs a flight that lacks channels as far as estimate; its only maneuver converges, and each
/// channel is a problem that names the cost.
fn estimates_without(record: &RecordBatch, channels: &[&str], cost: &str) -> Vec<Row> {
    let campaign = Campaign::new();
    let record = channels
        .iter()
        .fold(record.clone(), |record, channel| without(&record, channel));
    campaign.add("flight_001", &record);
    campaign.ends("estimate", 0);
    let problems = campaign.table("problems");
    assert_eq!(problems.len(), channels.len(), "{problems:?}");
    assert!(
        problems
            .iter()
            .all(|p| p["stage"] == "recording" && p["reason"].contains(cost)),
        "{problems:?}"
    );
    let fits = campaign.table("fits");
    assert!(
        fits.len() == 1 && fits[0]["outcome"] == "converged",
        "{fits:?} {problems:?}"
    );
    let instruments = campaign.table("instruments");
    let unknown = instruments
        .iter()
        .filter(|i| i["verdict"].starts_with("not e"));
    assert!(2 * unknown.count() < instruments.len(), "{instruments:?}");
    campaign.table("estimates")
}

/// Both estimates of a derivative are within so many bounds of each other.
fn agree(a: &[Row], b: &[Row], derivative: &str, bounds: f64) {
    let (a, b) = (estimate(a, derivative), estimate(b, derivative));
    let apart = (number(a, "value") - number(b, "value")).abs();
    assert!(apart < bounds * number(b, "bound_corrected"), "{a:?} {b:?}");
}

#[test]
fn a_flight_without_what_its_axis_does_not_need_is_estimated_all_the_same() {
    let whole = Campaign::of_pitch_steps();
    whole.ends("estimate", 0);
    let whole = whole.table("estimates");
    let record = pitch_steps();
    for (channels, cost) in [
        (&["psi"][..], "larger bounds"),
        (&["rpm_l", "rpm_r"], "gyroscopic moment"),
        (&["thrust"], "less the thrust"),
        (&["mach"], "standard atmosphere"),
        (
            &["phi", "p", "r", "beta_vane", "ay"],
            "no lateral derivatives",
        ),
    ] {
        let estimates = estimates_without(&record, channels, cost);
        for derivative in ["Cm_de", "Cm_alpha", "CN_alpha"] {
            agree(&estimates, &whole, derivative, 2.0);
        }
    }
}

#[test]
fn an_acceleration_that_is_not_recorded_costs_its_derivatives_only() {
    let whole = Campaign::of_pitch_steps();
    whole.ends("estimate", 0);
    let whole = whole.table("estimates");
    for (channel, cost) in [
        ("ax", "CA derivatives are not estimated"),
        ("an", "from the motion of alpha alone"),
    ] {
        let estimates = estimates_without(&pitch_steps(), &[channel], cost);
        for derivative in ["Cm_de", "Cm_alpha", "CN_alpha"] {
            let (own, with_all) = (
                estimate(&estimates, derivative),
                estimate(&whole, derivative),
            );
            let apart = (number(own, "value") - number(with_all, "value")).abs();
            let bound = number(own, "bound_corrected");
            assert!(apart < 2.0 * bound, "{channel}: {own:?} {with_all:?}");
            // The part of the instruments is estimated with and without the channel, and varies.
            assert!(
                number(own, "bound") > 0.9 * number(with_all, "bound"),
                "{own:?} {with_all:?}"
            );
        }
        let axial = estimate(&estimates, "CA_alpha");
        let status = if channel == "ax" { "held" } else { "estimated" };
        assert_eq!(axial["status"], status, "{axial:?}");
    }
}

#[test]
fn a_channel_that_ends_within_a_flight_costs_no_maneuver() {
    let whole = Campaign::of_pitch_steps();
    whole.ends("estimate", 0);
    let whole = whole.table("estimates");
    let record = pitch_steps();
    let campaign = Campaign::new();
    let channels = ["mach", "altitude", "rpm_l", "Ixz"];
    let ending = channels.iter().fold(record, |record, channel| {
        let mut own = values(&record, channel);
        // From within the flight's only maneuver on.
        let last = 5 * own.len() / 6;
        own[last..].fill(f64::NAN);
        replaced(&record, channel, |field, _| {
            let field = field.clone().with_data_type(DataType::Float64);
            (field, Arc::new(Float64Array::from(own)) as ArrayRef)
        })
    });
    campaign.add("flight_001", &ending);
    campaign.ends("estimate", 0);
    let problems = campaign.table("problems");
    let places: Vec<&str> = problems.iter().map(|p| p["place"].as_str()).collect();
    assert_eq!(places.len(), channels.len(), "{problems:?}");
    for channel in channels {
        assert!(
            places.contains(&&*format!("channel `{channel}`")),
            "{problems:?}"
        );
    }
    let fits = campaign.table("fits");
    assert!(
        fits.len() == 1 && fits[0]["outcome"] == "converged",
        "{fits:?}"
    );
    let estimates = campaign.table("estimates");
    for derivative in ["Cm_de", "Cm_alpha", "CN_alpha"] {
        agree(&estimates, &whole, derivative, 2.0);
    }
}

#[test]
fn check_lists_what_the_files_lack_and_which_flights_a_run_refuses() {
    let campaign = Campaign::of_pitch_steps();
    let channels = ["psi", "obes"];
    let lacking = channels
        .iter()
        .fold(pitch_steps(), |record, channel| without(&record, channel));
    campaign.add("flight_002", &lacking);
    let heading = "no `psi_deg`: the errors of the other instruments";
    let check = campaign.ends("check", 0).stdout;
    for words in [
        format!("without    in 1 of 2 flights: {heading}"),
        "without    in 1 of 2 flights: no `obes`: maneuvers are recognised by their inputs"
            .to_owned(),
    ] {
        assert!(check.contains(&words), "`{words}` is not in\n{check}");
    }
    let refused = without(&without(&pitch_steps(), "mass"), "time");
    campaign.add("flight_001", &without(&lacking, "mass"));
    campaign.add("flight_002", &refused);
    let check = campaign.ends("check", 2).stdout;
    for words in [
        "refused    1 of 2 flights: channel `mass` (signal `mass_slug`) is not in the file. Where the recorder lacks it",
        "refused    1 of 2 flights: the time channel `time` is not in the file",
        "a run would refuse every flight",
    ] {
        assert!(check.contains(words), "`{words}` is not in\n{check}");
    }
    let run = campaign.ends("ingest", 2);
    assert!(
        run.stdout
            .contains("or its value under `constants` (`mass_slug: 1000`)"),
        "{run:?}"
    );
}

#[test]
fn a_pipeline_without_flags_and_pedals_runs() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    for line in [
        "  obes: { signal: obes, unit: \"0/1\" }\n",
        "  pedal: { signal: pedal_in, unit: in }\n",
        "  psi: { signal: psi_deg, unit: deg, wraps_at: 360 }\n",
        "  dyv: { signal: dyv_deg, unit: deg }\n",
    ] {
        campaign.edit("aircraft.yaml", line, "");
    }
    campaign.ends("check", 0);
    campaign.ends("estimate", 0);
    let fits = campaign.table("fits");
    assert!(
        fits.len() == 1 && fits[0]["outcome"] == "converged",
        "{fits:?}"
    );
}

#[test]
fn a_pipeline_without_accelerometers_is_valid_and_check_reports_the_cost_of_each() {
    let campaign = Campaign::of_pitch_steps();
    campaign.copy_pipeline();
    for (channel, uncertainty) in [("an", 0.01), ("ax", 0.005), ("ay", 0.005)] {
        let line = format!("  {channel}: {{ signal: {channel}_g, unit: g }}\n");
        let instrument = format!(
            "  {channel}_g:\n    uncertainty: {{ bias: {uncertainty}, scale_pct: 0.1 }}\n    \
             ordinary: {{ bias: 0.01, scale_pct: 0.3 }}\n    fault: {{ bias: 0.05, scale_pct: 5 }}\n"
        );
        campaign.edit("aircraft.yaml", &line, "");
        campaign.edit("aircraft.yaml", &instrument, "");
    }
    let check = campaign.ends("check", 0).stdout;
    for words in [
        "without    no `an_g`: it is taken as 1; the CN derivatives follow from the motion of alpha",
        "without    no `ax_g`: it is taken as 0; the CA derivatives are not estimated",
        "without    no `ay_g`: it is taken as 0; the CY derivatives follow from the motion of beta",
    ] {
        assert!(check.contains(words), "`{words}` is not in\n{check}");
    }
    assert!(!check.contains("found and not estimated"), "{check}");
}

#[test]
fn a_lateral_maneuver_does_without_lateral_acceleration() {
    let whole = Campaign::new();
    whole.add("flight_001", &yaw_and_roll_steps());
    whole.ends("estimate", 0);
    let whole = whole.table("estimates");
    let cost = "from the motion of beta alone";
    let estimates = estimates_without(&yaw_and_roll_steps(), &["ay"], cost);
    for derivative in ["Cl_da", "Cn_dr", "Cn_beta"] {
        agree(&estimates, &whole, derivative, 3.0);
    }
    let bound = |rows: &[Row]| number(estimate(rows, "CY_beta"), "bound_corrected");
    assert!(bound(&estimates) > bound(&whole));
}

#[test]
fn a_lateral_maneuver_does_without_the_longitudinal_channels() {
    let whole = Campaign::new();
    whole.add("flight_001", &yaw_and_roll_steps());
    whole.ends("estimate", 0);
    let whole = whole.table("estimates");
    let channels = ["q", "theta", "an", "ax"];
    let estimates = estimates_without(
        &yaw_and_roll_steps(),
        &channels,
        "no longitudinal derivatives",
    );
    for derivative in ["Cl_da", "Cn_dr", "Cn_beta"] {
        agree(&estimates, &whole, derivative, 3.0);
    }
}

#[test]
fn a_maneuver_of_the_axis_that_is_not_recorded_is_rejected_with_the_reason() {
    let campaign = Campaign::new();
    campaign.add("flight_001", &without(&pitch_steps(), "theta"));
    campaign.ends("estimate", 2);
    let maneuvers = campaign.table("maneuvers");
    assert_eq!(maneuvers.len(), 1);
    assert_eq!(maneuvers[0]["verdict"], "rejected");
    assert!(maneuvers[0]["reason"].contains("theta_deg is not recorded"));
}

#[test]
fn a_pipeline_does_without_tunnel_and_sticks_and_check_reports_the_cost() {
    let campaign = Campaign::new();
    // Class flags stay: without them as well steps of the stabilator fit OLON as they fit PPSS.
    let sticks = ["stick_pitch", "stick_lat", "pedal", "psi", "rpm_l"];
    let record = sticks
        .iter()
        .fold(pitch_steps(), |record, channel| without(&record, channel));
    campaign.add("flight_001", &record);
    campaign.copy_pipeline();
    for line in [
        "  psi: { signal: psi_deg, unit: deg, wraps_at: 360 }\n",
        "  rpm_l: { signal: left_rpm, unit: rpm }\n",
    ] {
        campaign.edit("aircraft.yaml", line, "");
    }
    let pipeline = fs::read_to_string(campaign.path("pipeline/pipeline.yaml")).unwrap();
    let kept =
        |line: &&str| !line.starts_with("wind_tunnel:") && !line.contains("excitation_flag:");
    let pipeline: Vec<&str> = pipeline.lines().filter(kept).collect();
    fs::write(campaign.path("pipeline/pipeline.yaml"), pipeline.join("\n")).unwrap();
    let aircraft = fs::read_to_string(campaign.path("pipeline/aircraft.yaml")).unwrap();
    let (before, after) = aircraft.split_once("  psi_deg:\n").unwrap();
    let after: Vec<&str> = after.lines().skip(2).collect();
    let aircraft = format!("{before}{}\n", after.join("\n"));
    fs::write(campaign.path("pipeline/aircraft.yaml"), aircraft).unwrap();
    let check = campaign.ends("check", 0).stdout;
    for words in [
        "tunnel     none",
        "without    no wind tunnel: nothing is compared",
        "derivatives that the classes hold count as zero",
        "without    no `left_rpm`: it is taken as 0; the gyroscopic moment",
        "without    no `psi_deg`: the errors of the other instruments",
        "without    no `air_kelvin`: the air has the temperature of the standard atmosphere",
        "without    no `segment: excitation_flag`",
    ] {
        assert!(check.contains(words), "`{words}` is not in\n{check}");
    }
    campaign.ends("run", 0);
    let maneuvers = campaign.table("maneuvers");
    assert_eq!(maneuvers.len(), 1, "{maneuvers:?}");
    assert_eq!(maneuvers[0]["class"], "PPSS");
    assert!(number(&maneuvers[0], "confidence") <= 0.9);
    assert!(maneuvers[0]["evidence"].contains("stand for the pilot's"));
    let means = campaign.table("trends");
    assert!(!means.is_empty() && means.iter().all(|row| row["curve"] == "mean"));
}

/// Rows of a record between two times of its clock.
fn between(record: &RecordBatch, from_s: f64, to_s: f64) -> RecordBatch {
    let time = values(record, "time");
    let first = time.iter().position(|t| *t >= from_s).unwrap();
    let count = time.iter().filter(|t| (from_s..=to_s).contains(*t)).count();
    record.slice(first, count)
}

/// A channel with a value every half second and nulls between.
fn at_two_hertz(record: &RecordBatch, channel: &str) -> RecordBatch {
    let slow = values(record, channel).into_iter().enumerate();
    let slow: Vec<Option<f64>> = slow.map(|(k, v)| (k % 20 == 7).then_some(v)).collect();
    replaced(record, channel, |field, _| {
        let field = field
            .clone()
            .with_data_type(DataType::Float64)
            .with_nullable(true);
        (field, Arc::new(Float64Array::from(slow)) as ArrayRef)
    })
}

#[test]
fn a_recording_that_is_the_maneuver_is_a_result() {
    let campaign = Campaign::new();
    let maneuver = between(&pitch_steps(), 119.2, 132.3);
    let slow = ["altitude", "mach", "qbar", "V"];
    let maneuver = slow
        .iter()
        .fold(maneuver, |record, name| at_two_hertz(&record, name));
    campaign.add("flight_001", &maneuver);
    campaign.ends("run", 0);
    let fits = campaign.table("fits");
    assert!(
        fits.len() == 1 && fits[0]["outcome"] == "converged",
        "{fits:?}"
    );
    let instruments = campaign.table("instruments");
    assert!(
        instruments.iter().any(|i| i["verdict"].starts_with("ok")),
        "{instruments:?}"
    );
    let trends = campaign.table("trends");
    let mean = trends
        .iter()
        .find(|row| row["derivative"] == "Cm_de")
        .unwrap();
    assert_eq!(
        (mean["curve"].as_str(), mean["maneuvers"].as_str()),
        ("mean", "1")
    );
    let estimates = campaign.table("estimates");
    let own = number(estimate(&estimates, "Cm_de"), "value");
    assert!((number(mean, "value") - own).abs() < 1e-12 * own.abs());
    assert_eq!(campaign.table("problems"), Vec::<Row>::new());
}

#[test]
fn an_event_that_ends_with_the_record_is_taken() {
    let campaign = Campaign::new();
    campaign.add("flight_001", &between(&pitch_steps(), 118.8, 132.47));
    let events = campaign.path("events.csv");
    fs::write(
        &events,
        "flight_id,class,start_s,end_s\nflight_001,PPSS,118.8,132.5\n",
    )
    .unwrap();
    let outcome = run(campaign.command("estimate").arg("--events").arg(&events));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    assert_eq!(campaign.table("maneuvers")[0]["origin"], "given");
}
