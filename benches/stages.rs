//! Times of the stages on one flight of the demonstration campaign, measured in one run: `make bench`.
//!
//! The speed of a machine drifts; compare lines of one run. Useful ratios: exact sensitivities against
//! a response alone (finite differences cost one response per parameter), stages against reading the
//! flight.

use std::collections::BTreeMap;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use harvest::aero::Axis;
use harvest::config::{Config, Overrides};
use harvest::dynamics::motion::{ManeuverSignals, MassProperties};
use harvest::dynamics::{Longitudinal, OUTPUTS};
use harvest::estimate::{self, Context};
use harvest::flight::Record;
use harvest::maneuver::{Class, Maneuver, Status};
use harvest::output_error::{Case, Measurements, Model};
use harvest::store::archive;
use harvest::{ingest, segment};

/// A flight of the demonstration campaign, and one of its maneuvers that excites every longitudinal
/// surface.
struct BenchFlight {
    config: Config,
    record: Record,
    maneuver: Maneuver,
    class: Class,
}

fn load() -> anyhow::Result<BenchFlight> {
    let config = Config::load(Path::new("pipelines/harv"), Overrides::default())?;
    for files in archive::find(&config.archive)? {
        let raw = archive::read(&files, &config.channels)
            .map_err(|p| anyhow::anyhow!(p.reason))?
            .swap_remove(0);
        let record = ingest::record(
            &raw,
            &config.channels,
            &config.constants,
            &config.aircraft,
            &config.ingest,
        )
        .map_err(|p| anyhow::anyhow!(p.reason))?
        .record;
        let found = segment::maneuvers(&record, &config.classes, &config.aircraft, &config.segment);
        let most_free = |m: &Maneuver| {
            let class = config.class(&m.class)?;
            let free = class
                .statuses
                .values()
                .filter(|s| **s == Status::Estimated)
                .count();
            (class.axis == Axis::Longitudinal && free > 20).then(|| class.clone())
        };
        if let Some((maneuver, class)) = found
            .maneuvers
            .iter()
            .find_map(|m| Some((m.clone(), most_free(m)?)))
        {
            return Ok(BenchFlight {
                config,
                record,
                maneuver,
                class,
            });
        }
    }
    anyhow::bail!("the demonstration campaign has no longitudinal maneuver with all surfaces")
}

/// Case of the maneuver with the free derivatives of its class, or with none.
fn case(bench: &BenchFlight, free: bool) -> Result<Case<3, Longitudinal>, String> {
    let derivatives: Vec<_> = bench
        .config
        .aero_model
        .derivatives_of(Axis::Longitudinal)
        .collect();
    let tunnel = |name: &str| {
        bench
            .config
            .tunnel
            .value(name, bench.maneuver.alpha_deg, bench.maneuver.mach)
            .map_or(0.0, |v| v.value)
    };
    let mut model = Model::default();
    for derivative in derivatives {
        if free && bench.class.statuses.get(&derivative.name) == Some(&Status::Estimated) {
            model.free.push(derivative);
        } else {
            model.held.push((derivative, tunnel(&derivative.name)));
        }
    }
    let range = bench.record.sample_at(bench.maneuver.start_s)
        ..bench.record.sample_at(bench.maneuver.end_s) + 1;
    let samples = range.len();
    let surfaces = bench
        .config
        .aero_model
        .derivatives
        .iter()
        .filter_map(|d| d.regressor.surface());
    let signals = ManeuverSignals::cut(
        &bench.config.aircraft,
        &bench.record,
        range,
        surfaces,
        MassProperties::Recorded,
    )?;
    let measurements = Measurements {
        values: vec![[0.0; OUTPUTS]; samples],
        used: vec![[true; OUTPUTS]; samples],
    };
    Ok(Case::new(
        &bench.config.aircraft,
        &signals,
        measurements,
        &model,
    ))
}

fn responses(c: &mut Criterion, bench: &BenchFlight) -> Result<(), String> {
    let values: BTreeMap<String, f64> = bench
        .config
        .aero_model
        .derivatives
        .iter()
        .filter_map(|d| {
            let value = bench.config.tunnel.value(
                &d.name,
                bench.maneuver.alpha_deg,
                bench.maneuver.mach,
            )?;
            Some((d.name.clone(), value.value))
        })
        .collect();
    for (label, free) in [
        ("response alone", false),
        ("response with sensitivities", true),
    ] {
        let case = case(bench, free)?;
        let start = case.starting_values(|name| values.get(name).copied().unwrap_or(0.0));
        let mut response = case.response();
        c.bench_function(&format!("{label}, {} parameters", case.parameters()), |b| {
            b.iter(|| case.respond(&start, &mut response));
        });
    }
    Ok(())
}

fn stages(c: &mut Criterion) -> anyhow::Result<()> {
    let bench = load()?;
    let config = &bench.config;
    let Some(files) = archive::find(&config.archive)?.into_iter().next() else {
        anyhow::bail!("the archive is empty");
    };
    c.bench_function("read one flight", |b| {
        b.iter(|| archive::read(&files, &config.channels));
    });
    let raw = archive::read(&files, &config.channels)
        .map_err(|p| anyhow::anyhow!(p.reason))?
        .swap_remove(0);
    c.bench_function("ingest one flight", |b| {
        b.iter(|| {
            ingest::record(
                &raw,
                &config.channels,
                &config.constants,
                &config.aircraft,
                &config.ingest,
            )
        });
    });
    c.bench_function("segment one flight", |b| {
        b.iter(|| {
            segment::maneuvers(
                &bench.record,
                &config.classes,
                &config.aircraft,
                &config.segment,
            )
        });
    });
    let context = Context::new(
        &config.aircraft,
        &config.aero_model,
        &config.tunnel,
        &config.estimate,
    );
    c.bench_function("estimate one maneuver", |b| {
        b.iter(|| estimate::maneuver(&bench.record, &bench.maneuver, &bench.class, &context));
    });
    responses(c, &bench).map_err(anyhow::Error::msg)
}

#[expect(clippy::print_stderr, reason = "the benchmark's own output")]
fn all(c: &mut Criterion) {
    if let Err(error) = stages(c) {
        eprintln!("no benchmark: {error}");
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10).measurement_time(std::time::Duration::from_secs(3));
    targets = all
}
criterion_main!(benches);
