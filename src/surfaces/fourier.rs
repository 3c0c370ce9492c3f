//! Fourier sums of tapered series within a band of frequencies.
//!
//! The taper keeps the noise of other frequencies out of the band. Without it, the gyros' noise,
//! which after differentiation rises with frequency, would leak to lower frequencies. A linear
//! equation between series also holds between their Fourier sums if all have the same taper.

use std::f64::consts::PI;

use nalgebra::Complex;

use crate::numerics::series::harmonics::Harmonics;

/// Fourier sums at the frequencies of a band.
pub type Spectrum = Vec<Complex<f64>>;

/// Lowest frequency, Hz: below it the motion is trim and drift.
const LOWEST_HZ: f64 = 0.1;

/// Highest frequency, Hz. Surfaces and airframe move below it, and the rates' noise dominates above
/// it. Up to 5 Hz the delays of simulated campaigns change by less than 0.1 ms.
const HIGHEST_HZ: f64 = 2.5;

/// Largest share of the sampling rate, below which the slope of the rates keeps its phase.
const OF_RATE: f64 = 0.125;

/// Share of the samples at either end over which the taper rises.
const TAPERED: f64 = 0.1;

/// Least number of frequencies of a fit: about twice the number of regressors.
const FEWEST_FREQUENCIES: usize = 20;

/// Band of frequencies of series of one length.
#[derive(Clone, Debug)]
pub struct Band {
    step_s: f64,
    harmonics: Harmonics,
    taper: Vec<f64>,
    /// Slope of the taper, 1/s.
    taper_slope: Vec<f64>,
}

impl Band {
    /// Band of series of this number of samples; `None` if they are too short.
    pub fn new(samples: usize, step_s: f64) -> Option<Band> {
        let length_s = samples as f64 * step_s;
        let band_hz = LOWEST_HZ..=HIGHEST_HZ.min(OF_RATE / step_s);
        let mut inside = (1..samples / 2).filter(|k| band_hz.contains(&(*k as f64 / length_s)));
        let first = inside.next()?;
        let numbers = first..first + 1 + inside.count();
        (numbers.len() >= FEWEST_FREQUENCIES).then(|| Band {
            step_s,
            harmonics: Harmonics::new(samples, numbers),
            taper: (0..samples).map(|i| taper(i, samples).0).collect(),
            taper_slope: (0..samples).map(|i| taper(i, samples).1 / step_s).collect(),
        })
    }

    /// Frequencies, Hz.
    pub fn frequencies_hz(&self) -> Vec<f64> {
        let length_s = self.taper.len() as f64 * self.step_s;
        let numbers = self.harmonics.numbers();
        numbers.map(|k| k as f64 / length_s).collect()
    }

    /// Fourier sums of series without their means, tapered.
    pub fn spectra(&self, series: &[Vec<f64>]) -> Vec<Spectrum> {
        let tapered = series.iter().map(|s| without_mean(s, &self.taper));
        self.sums(&tapered.collect::<Vec<_>>())
    }

    /// Series with their spectra, prepared for shifts in time.
    pub fn shifted(&self, series: &[Vec<f64>]) -> Vec<DelayedSpectrum> {
        let both = series.iter().flat_map(|series| {
            [
                without_mean(series, &self.taper),
                without_mean(series, &self.taper_slope),
            ]
        });
        let mut spectra = self.sums(&both.collect::<Vec<_>>()).into_iter();
        std::iter::from_fn(|| {
            Some(DelayedSpectrum {
                spectrum: spectra.next()?,
                edges: spectra.next()?,
            })
        })
        .collect()
    }

    /// Fourier sums of series, a spectrum for each; computed together, which fills the processor's
    /// vectors.
    fn sums(&self, series: &[Vec<f64>]) -> Vec<Spectrum> {
        let (sums, count) = (self.harmonics.sums(series), self.harmonics.len());
        let spectrum = |column: usize| {
            let sum = |k: usize| Complex::new(sums[(k, column)], sums[(count + k, column)]);
            (0..count).map(sum).collect()
        };
        (0..series.len()).map(spectrum).collect()
    }
}

/// Series without its mean, times the factor of each sample.
fn without_mean(series: &[f64], factors: &[f64]) -> Vec<f64> {
    let mean = series.iter().sum::<f64>() / factors.len().max(1) as f64;
    let both = series.iter().zip(factors);
    both.map(|(value, factor)| (value - mean) * factor)
        .collect()
}

/// Taper at a sample, and its slope per sample. The taper is a raised cosine at either end, and one
/// between.
fn taper(sample: usize, samples: usize) -> (f64, f64) {
    let rise = TAPERED * samples as f64;
    let from_start = sample as f64 + 0.5;
    let from_end = samples as f64 - from_start;
    let edge = from_start.min(from_end);
    if edge >= rise {
        return (1.0, 0.0);
    }
    let angle = PI * edge / rise;
    let slope = 0.5 * PI / rise * angle.sin();
    let signed = if from_start < from_end { slope } else { -slope };
    (0.5 * (1.0 - angle.cos()), signed)
}

/// Series of a surface and its spectra, prepared for shifts in time.
///
/// Let w be the taper, τ the shift, s, and ω the angular frequency, rad/s. The tapered series y(t +
/// τ) has the spectrum e^(jωτ) ∫ w(t − τ) y(t) e^(−jωt) dt. Since the taper rises over seconds, w(t
/// − τ) ≈ w(t) − τ w'(t).
#[derive(Clone, Debug)]
pub struct DelayedSpectrum {
    spectrum: Spectrum,
    edges: Spectrum,
}

impl DelayedSpectrum {
    /// Spectrum of the series `delay_s` later, and its slope along the delay, 1/s.
    pub fn spectrum_at_delay(&self, frequencies_hz: &[f64], delay_s: f64) -> (Spectrum, Spectrum) {
        let all = frequencies_hz.iter().zip(&self.spectrum).zip(&self.edges);
        let one = |((frequency_hz, y), edge): ((&f64, &Complex<f64>), &Complex<f64>)| {
            let omega = 2.0 * PI * frequency_hz;
            let turn = Complex::from_polar(1.0, omega * delay_s);
            let shifted = turn * (y - edge * delay_s);
            (shifted, Complex::new(0.0, omega) * shifted - turn * edge)
        };
        all.map(one).unzip()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    const STEP_S: f64 = 0.025;

    /// Motion of several frequencies that starts and ends away from its mean.
    fn motion(t: f64) -> f64 {
        2.0 * (1.3 * t).sin() + 0.7 * (4.1 * t + 0.4).cos() + 0.3 * (9.0 * t).sin() + 0.05 * t
    }

    fn series(late_s: f64) -> Vec<f64> {
        let time_s = |k: u32| f64::from(k) * STEP_S - late_s;
        (0..700).map(|k| motion(time_s(k))).collect()
    }

    fn distance(a: &Spectrum, b: &Spectrum) -> f64 {
        let square = |(a, b): (&Complex<f64>, &Complex<f64>)| (a - b).norm_sqr();
        a.iter().zip(b).map(square).sum::<f64>().sqrt()
    }

    #[test]
    fn a_late_series_is_shifted_back() {
        let band = Band::new(700, STEP_S).unwrap();
        let exact = &band.spectra(&[series(0.0)])[0];
        let late = &band.shifted(&[series(0.5), series(0.012)])[1];
        let (shifted, _) = late.spectrum_at_delay(&band.frequencies_hz(), 0.012);
        let (recorded, _) = late.spectrum_at_delay(&band.frequencies_hz(), 0.0);
        assert!(distance(&shifted, exact) < 0.01 * distance(&recorded, exact));
    }

    #[test]
    fn the_slope_along_the_delay_is_that_of_the_shifted_spectrum() {
        let band = Band::new(700, STEP_S).unwrap();
        let late = &band.shifted(&[series(0.0)])[0];
        let frequencies_hz = band.frequencies_hz();
        let (before, after) = (
            late.spectrum_at_delay(&frequencies_hz, 0.009_999).0,
            late.spectrum_at_delay(&frequencies_hz, 0.010_001).0,
        );
        let slope = late.spectrum_at_delay(&frequencies_hz, 0.01).1;
        for ((a, b), slope) in before.iter().zip(&after).zip(&slope) {
            assert_abs_diff_eq!(((b - a) / 2e-6).re, slope.re, epsilon = 1e-4);
            assert_abs_diff_eq!(((b - a) / 2e-6).im, slope.im, epsilon = 1e-4);
        }
    }

    #[test]
    fn a_sine_of_the_band_is_at_its_frequency() {
        let samples = 800;
        let sine: Vec<f64> = (0..samples)
            .map(|k| (2.0 * PI * 10.0 * k as f64 / samples as f64).sin())
            .collect();
        let band = Band::new(samples, STEP_S).unwrap();
        let power = band.spectra(&[sine])[0].clone();
        let power: Vec<f64> = power.iter().map(|x| x.norm()).collect();
        let all = power.iter().enumerate();
        let (at, largest) = all.max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
        assert_abs_diff_eq!(band.frequencies_hz()[at], 0.5, epsilon = 1e-12);
        // Half the samples, less those under the taper.
        assert_abs_diff_eq!(*largest, 0.5 * 0.9 * 800.0, epsilon = 1.0);
    }

    #[test]
    fn a_short_series_has_no_band() {
        assert!(Band::new(200, STEP_S).is_none() && Band::new(0, STEP_S).is_none());
        assert!(Band::new(400, STEP_S).is_some());
    }
}
