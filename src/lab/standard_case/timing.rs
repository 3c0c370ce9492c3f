//! Timing of the standard case: wall clock and processor time of repeated estimates.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use rayon::prelude::*;
use rustix::time::{ClockId, clock_gettime};
use serde::Serialize;

use super::case::{StandardCase, StandardEstimate, load};
use crate::error::{Error, Result};
use crate::store::files;

/// Estimates of a case and the times they took.
#[derive(Clone, Debug, Serialize)]
pub struct TimedCase {
    pub outcome: &'static str,
    pub theta: BTreeMap<String, f64>,
    /// Standard errors for white residuals, scaled by their variance.
    pub std: BTreeMap<String, f64>,
    /// Standard errors that account for the autocorrelation of the residuals and the noise of the
    /// surfaces: `bound_corrected` of the table `estimates`.
    pub std_corrected: BTreeMap<String, f64>,
    pub cost: Option<f64>,
    pub iterations: usize,
    /// Time to read the case and its record.
    pub import_s: f64,
    /// Time of the first estimate, including all initialisation.
    pub first_s: f64,
    /// Wall-clock time of each repetition, from the record in memory to estimates and standard
    /// errors.
    pub wall_s: Vec<f64>,
    /// Processor time of each repetition.
    pub cpu_s: Vec<f64>,
    /// Share of `wall_s` before the first iteration.
    pub ready_s: Vec<f64>,
    /// Time of `std_corrected`, not included in `wall_s`.
    pub corrected_s: Vec<f64>,
}

/// Timed cases of a folder.
#[derive(Clone, Debug, Serialize)]
pub struct TimedBatch {
    pub count: usize,
    /// Wall-clock time from the first estimate to the end of the last.
    pub wall_s: f64,
    /// Processor time of all threads.
    pub cpu_s: f64,
    pub results: BTreeMap<String, TimedCase>,
}

/// Estimates a case `repetitions` times.
///
/// # Errors
/// The message for a signal that the record lacks.
pub fn timed(case: &StandardCase, repetitions: usize) -> Result<TimedCase, String> {
    // Without repetitions no processor time is read: valgrind cannot.
    let start = Instant::now();
    let mut first = case.estimate()?;
    let first_s = start.elapsed().as_secs_f64();
    let corrected = first.corrected(case).unwrap_or_default();
    let (mut wall_s, mut cpu_s, mut ready_s, mut corrected_s) = (vec![], vec![], vec![], vec![]);
    for _ in 0..repetitions {
        let stopwatch = Stopwatch::start();
        let mut estimate = case.estimate()?;
        wall_s.push(stopwatch.wall_s());
        cpu_s.push(stopwatch.cpu_s());
        ready_s.push(estimate.ready_s);
        let stopwatch = Stopwatch::start();
        estimate.corrected(case);
        corrected_s.push(stopwatch.wall_s());
    }
    let StandardEstimate { fit, std, .. } = &first;
    Ok(TimedCase {
        outcome: fit.outcome.name(),
        theta: first.by_name(case, &fit.values),
        std: first.by_name(case, std),
        std_corrected: first.by_name(case, &corrected),
        cost: fit.final_cost,
        iterations: fit.iterations,
        import_s: case.import_s,
        first_s,
        wall_s,
        cpu_s,
        ready_s,
        corrected_s,
    })
}

/// Estimates every case of a folder `repetitions` times, the cases in parallel.
///
/// # Errors
/// [`Error`] naming the file that is missing or malformed.
pub fn batch(folder: &Path, repetitions: usize) -> Result<TimedBatch> {
    let paths = files::with_extension(folder, "json")?;
    let cases: Vec<StandardCase> = paths.iter().map(|path| load(path)).collect::<Result<_>>()?;
    let stopwatch = Stopwatch::start();
    let results: Vec<TimedCase> = cases
        .par_iter()
        .zip(&paths)
        .map(|(case, path)| {
            timed(case, repetitions).map_err(|message| Error::config(path, None, message))
        })
        .collect::<Result<_>>()?;
    let (wall_s, cpu_s) = (stopwatch.wall_s(), stopwatch.cpu_s());
    let name = |path: &Path| {
        path.file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let results: BTreeMap<String, TimedCase> =
        paths.iter().map(|path| name(path)).zip(results).collect();
    Ok(TimedBatch {
        count: results.len(),
        wall_s,
        cpu_s,
        results,
    })
}

/// Wall-clock and processor time since its start.
struct Stopwatch {
    wall: Instant,
    cpu_s: f64,
}

impl Stopwatch {
    fn start() -> Stopwatch {
        Stopwatch {
            wall: Instant::now(),
            cpu_s: processor_s(),
        }
    }

    fn wall_s(&self) -> f64 {
        self.wall.elapsed().as_secs_f64()
    }

    fn cpu_s(&self) -> f64 {
        processor_s() - self.cpu_s
    }
}

/// Processor time of the process, s.
fn processor_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::super::case_file::bias;
    use super::*;

    #[test]
    fn the_standard_case_reaches_the_minimum_of_other_estimators() {
        #[derive(serde::Deserialize)]
        struct Truth {
            truth: BTreeMap<String, f64>,
        }
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/standard_case.json");
        let timed = timed(&load(&file).unwrap(), 1).unwrap();
        assert_eq!((timed.outcome, timed.iterations), ("converged", 4));
        // Minimum of CasADi, JAX, SciPy and C++ implementations; the record is rounded to 1e-6.
        assert_relative_eq!(timed.cost.unwrap(), 0.011_840_931_330, max_relative = 1e-6);
        let file: Truth = serde_json::from_str(&files::text(&file).unwrap()).unwrap();
        // Biases and constants absorb the noise of the substituted signals.
        for (name, truth) in file.truth.iter().filter(|(name, _)| bias(name).is_none()) {
            let off = (timed.theta[name] - truth) / timed.std[name].max(timed.std_corrected[name]);
            assert!(off.abs() < 5.0, "{name} is {off:.1} standard errors off");
        }
        assert_eq!(timed.wall_s.len(), 1);
    }
}
