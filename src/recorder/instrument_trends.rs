//! Rows of the table `instrument_trends`, and problems that only several flights together show.

use super::common_error::CommonError;
use super::error_series::ErrorSeries;
use super::history::{Change, ChangeShape, change};
use crate::error::{Problem, ProblemStage};
use crate::flight::signal;
use crate::tables::{
    ALL_FLIGHTS, CommonErrorVerdict, InstrumentError, InstrumentTrend, InstrumentTrendRow,
};

/// Probability of one or more false alarms over the histories of all series.
const ALARM_PROBABILITY: f64 = 0.01;

/// Probability of one or more possible changes by chance over the histories of all series. A step
/// of seven standard errors over eight flights has a chance probability of 0.004 in one series and
/// 0.2 in fifty series. It is reported as possible.
const POSSIBLE_PROBABILITY: f64 = 0.25;

/// Number of standard deviations above which an error common to all flights is certain.
const SURELY: f64 = 4.0;

/// Number of ordinary sizes above which an error common to all flights is named: one healthy
/// instrument in twenty exceeds it by chance.
const LARGEST_ORDINARY: f64 = 2.0;

/// A series with its common error and its change over the flights.
#[derive(Clone, Debug, PartialEq)]
pub struct ExaminedSeries {
    pub series: ErrorSeries,
    pub common: Option<CommonError>,
    pub change: Option<Change>,
}

/// Rows and problems of a campaign's instruments.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecorderFindings {
    pub rows: Vec<InstrumentTrendRow>,
    pub problems: Vec<Problem>,
    pub examined: Vec<ExaminedSeries>,
}

/// Examines all series of a campaign.
#[must_use]
pub fn examine(series: Vec<ErrorSeries>) -> RecorderFindings {
    let examined: Vec<ExaminedSeries> = series.into_iter().map(ExaminedSeries::of).collect();
    let tests = examined.iter().filter(|one| one.change.is_some()).count();
    RecorderFindings {
        rows: examined.iter().map(|one| one.row(tests)).collect(),
        problems: examined.iter().flat_map(ExaminedSeries::problems).collect(),
        examined,
    }
}

impl ExaminedSeries {
    fn of(series: ErrorSeries) -> ExaminedSeries {
        let common = CommonError::of(&series);
        let change = common.as_ref().and_then(|common| change(&series, common));
        ExaminedSeries {
            series,
            common,
            change,
        }
    }

    /// Ids of the flights far from the others.
    pub fn far(&self) -> &[String] {
        self.common.as_ref().map_or(&[], |common| &common.far)
    }

    /// `true` if the mean error that remains after corrections is certainly larger than ordinary.
    pub fn is_wrong_in_every_flight(&self) -> bool {
        self.common.as_ref().is_some_and(|common| {
            let size = (common.mean - self.series.corrected).abs();
            size > SURELY * common.bound.hypot(common.scatter)
                && size > LARGEST_ORDINARY * self.series.ordinary
        })
    }

    fn common_verdict(&self) -> CommonErrorVerdict {
        if self.common.is_none() {
            CommonErrorVerdict::TooFewFlights
        } else if self.is_wrong_in_every_flight() {
            CommonErrorVerdict::Wrong
        } else {
            CommonErrorVerdict::Ordinary
        }
    }

    /// Verdict on the order of the flights; `tests` is the number of series with a history.
    ///
    /// The probability of a change by chance is multiplied by the number of tests (Bonferroni).
    /// False verdicts over all series are thus no more frequent than stated.
    fn trend(&self, tests: usize) -> InstrumentTrend {
        let Some(change) = &self.change else {
            return InstrumentTrend::TooFewFlights;
        };
        let over_all = tests.max(1) as f64 * change.probability;
        match change.shape {
            ChangeShape::Step if over_all < ALARM_PROBABILITY => InstrumentTrend::Step,
            ChangeShape::Drift if over_all < ALARM_PROBABILITY => InstrumentTrend::Drift,
            ChangeShape::Step if over_all < POSSIBLE_PROBABILITY => InstrumentTrend::PossibleStep,
            ChangeShape::Drift if over_all < POSSIBLE_PROBABILITY => InstrumentTrend::PossibleDrift,
            _ => InstrumentTrend::Steady,
        }
    }

    /// Row of the series; `tests` is the number of series with a history.
    fn row(&self, tests: usize) -> InstrumentTrendRow {
        let series = &self.series;
        let common = self.common.as_ref();
        let verdict = self.trend(tests);
        let change = self.change.as_ref();
        let seen = change.filter(|_| verdict != InstrumentTrend::Steady);
        // The table has scale factors, as `instruments` does.
        let offset = f64::from(u8::from(series.error == InstrumentError::Scale));
        InstrumentTrendRow {
            channel: series.channel.clone(),
            signal: series.signal.clone(),
            error: series.error,
            unit: series.unit().to_owned(),
            flights: series.samples.len(),
            mean: common.map(|common| offset + common.mean),
            mean_bound: common.map(|common| common.bound),
            scatter: common.map(|common| common.scatter),
            common: self.common_verdict(),
            far_flights: self.far().join(" "),
            completed_flights: 0,
            verdict,
            since: seen.map(|change| change.since.clone()),
            change: change.map(|change| change.size),
            change_bound: change.map(|change| change.bound),
            probability: change.map(|change| change.probability),
        }
    }

    fn problems(&self) -> Vec<Problem> {
        let series = &self.series;
        let problem = |flight_id: &str, reason: String| Problem {
            stage: ProblemStage::Ingest,
            flight_id: flight_id.to_owned(),
            place: format!("channel `{}`", series.channel),
            reason,
        };
        let Some(common) = &self.common else {
            return vec![];
        };
        let far = series.samples.iter();
        let far = far.filter(|sample| common.far.contains(&sample.flight_id));
        let mut problems: Vec<Problem> = far
            .map(|sample| {
                let reason = format!(
                    "`{}`: {} is far from the other flights' ({}, scatter {}). This error is not corrected: \
                     check the instrument of this flight",
                    series.channel,
                    self.in_words(sample.value, sample.bound),
                    self.in_words(common.mean, common.bound),
                    self.number(common.scatter),
                );
                problem(&sample.flight_id, reason)
            })
            .collect();
        if self.is_wrong_in_every_flight() {
            let reason = format!(
                "`{}` disagrees with the other channels in every flight: {} over {} flights (scatter {}). Check its \
                 calibration, its unit and its position in aircraft.yaml{}",
                series.channel,
                self.in_words(common.mean, common.bound),
                series.samples.len() - common.far.len(),
                self.number(common.scatter),
                self.other_cause(),
            );
            problems.push(problem(ALL_FLIGHTS, reason));
        }
        problems
    }

    /// Cause of a common error that is not the instrument's, in words.
    fn other_cause(&self) -> &'static str {
        if [signal::QBAR, signal::MACH].contains(&self.series.signal.as_str()) {
            ", and the temperature of the air"
        } else {
            ""
        }
    }

    /// An error with its bound in words.
    fn in_words(&self, value: f64, bound: f64) -> String {
        let bound = self.number(bound);
        match self.series.error {
            InstrumentError::Bias => format!("bias {} ± {bound}", self.number(value)),
            InstrumentError::Scale => format!("scale factor {:.4} ± {bound}", 1.0 + value),
            InstrumentError::Delay => format!("delay {} ± {bound}", self.number(value)),
        }
    }

    fn number(&self, value: f64) -> String {
        match self.series.error {
            InstrumentError::Bias => format!("{value:.3} {}", self.series.unit()),
            InstrumentError::Scale => format!("{value:.4}"),
            InstrumentError::Delay => format!("{:.1} ms", 1e3 * value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture;
    use super::*;
    use crate::numerics::statistics::random::RandomStream;

    fn scales(values: &[f64]) -> ErrorSeries {
        fixture::scales(values.iter().map(|value| (*value, 0.004)), 0.002)
    }

    #[test]
    fn a_rate_that_is_five_percent_off_in_every_flight_is_named() {
        let found = examine(vec![scales(&[0.046, 0.052, 0.049, 0.05, 0.051, 0.047])]);
        assert_eq!(found.rows[0].common, CommonErrorVerdict::Wrong);
        assert_eq!(found.problems.len(), 1);
        let problem = &found.problems[0];
        assert_eq!(problem.flight_id, ALL_FLIGHTS);
        assert!(
            problem.reason.contains("scale factor 1.0492"),
            "{problem:?}"
        );
        let healthy = examine(vec![scales(&[0.004, -0.002, 0.001, 0.005, -0.003, 0.0])]);
        assert!(healthy.problems.is_empty());
        let mut corrected = scales(&[0.046, 0.052, 0.049, 0.05, 0.051, 0.047]);
        corrected.corrected = 0.05;
        assert!(examine(vec![corrected]).problems.is_empty());
        assert_eq!(healthy.rows[0].common, CommonErrorVerdict::Ordinary);
        assert_eq!(healthy.rows[0].verdict, InstrumentTrend::Steady);
    }

    #[test]
    fn a_flight_far_from_the_others_is_a_problem_of_that_flight() {
        let mut values = vec![0.001, -0.002, 0.0, 0.002, 0.001, -0.001, 0.0, 0.001, 0.002];
        values.push(0.2);
        let found = examine(vec![scales(&values)]);
        assert_eq!(found.rows[0].far_flights, "f9");
        assert_eq!(found.problems.len(), 1);
        assert_eq!(found.problems[0].flight_id, "f9");
    }

    /// Series of steady scale errors over eight flights, with scatter and errors of the flights.
    fn steady(random: &mut RandomStream) -> ErrorSeries {
        let errors = (0..8).map(|_| (0.003 * random.normal() + 0.002 * random.normal(), 0.002));
        fixture::scales(errors.collect::<Vec<_>>(), 0.0)
    }

    #[test]
    fn a_step_of_seven_standard_errors_among_many_series_is_a_possible_one() {
        let stepping = [0.001, -0.001, 0.0, 0.001, 0.0126, 0.0137, 0.0117, 0.013];
        let mut random = RandomStream::new(5, "many series");
        let mut series: Vec<ErrorSeries> = (0..40).map(|_| steady(&mut random)).collect();
        let own = |value: &f64| (*value, 0.0025);
        series.push(fixture::scales(stepping.iter().map(own), 0.0));
        let found = examine(series);
        let row = found.rows.last().unwrap();
        assert_eq!(row.verdict, InstrumentTrend::PossibleStep, "{row:?}");
        assert_eq!(row.since.as_deref(), Some("f4"));
        let size = row.change.unwrap() / row.change_bound.unwrap();
        assert!((5.0..9.0).contains(&size), "{size}");
        // Alone it is sure.
        let alone = examine(vec![found.examined.last().unwrap().series.clone()]);
        assert_eq!(alone.rows[0].verdict, InstrumentTrend::Step);
    }

    #[test]
    fn steady_instruments_have_possible_changes_no_more_often_than_stated() {
        const CAMPAIGNS: usize = 100;
        const SERIES: usize = 12;
        let mut random = RandomStream::new(6, "steady campaigns");
        let (mut possible, mut sure) = (0, 0);
        for _ in 0..CAMPAIGNS {
            let found = examine((0..SERIES).map(|_| steady(&mut random)).collect());
            let has = |verdicts: [InstrumentTrend; 2]| {
                let mut rows = found.rows.iter();
                usize::from(rows.any(|row| verdicts.contains(&row.verdict)))
            };
            possible += has([
                InstrumentTrend::PossibleStep,
                InstrumentTrend::PossibleDrift,
            ]);
            sure += has([InstrumentTrend::Step, InstrumentTrend::Drift]);
        }
        // A quarter has a deviation of 4.3 in 100 campaigns, a hundredth one of 1.
        assert!(
            possible <= 33 && sure <= 4,
            "{possible} possible, {sure} sure"
        );
        assert!(possible > 2, "{possible}: the limit is far too strict");
    }

    #[test]
    fn a_step_has_its_flight_and_no_problem() {
        let values = [
            0.001, -0.002, 0.0, 0.002, 0.001, 0.0, 0.041, 0.039, 0.04, 0.042, 0.038,
        ];
        let found = examine(vec![scales(&values)]);
        let row = &found.rows[0];
        assert_eq!(
            (row.verdict, row.since.as_deref()),
            (InstrumentTrend::Step, Some("f6"))
        );
        assert!(
            row.change
                .is_some_and(|change| (change - 0.04).abs() < 0.003)
        );
    }
}
