//! Discrete gusts: a train of 1 − cos gusts across and down (MIL-F-8785C, 14 CFR 25.341).
//!
//! A gust of size U and gradient distance d has the velocity U/2 (1 − cos πx/d) over 0 ≤ x ≤ 2d
//! along the path. The air turns with its gradient: `q_g` = −∂w/∂x, `r_g` = ∂v/∂x.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::gust::{Gust, GustPath};
use crate::numerics::statistics::random::RandomStream;

/// Size, length and frequency of discrete gusts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiscreteGusts {
    /// Greatest velocity U of a gust; its sign is random.
    pub size_ft_s: f64,
    /// Gradient distance d, from the edge of a gust to its middle.
    pub gradient_ft: f64,
    /// Mean number of gusts per second in each axis; their times are random.
    pub per_s: f64,
}

/// Velocity of a gust at a distance from its edge, and its gradient along the path.
fn one_minus_cosine(size: f64, gradient_ft: f64, distance_ft: f64) -> (f64, f64) {
    if !(0.0..=2.0 * gradient_ft).contains(&distance_ft) {
        return (0.0, 0.0);
    }
    let phase = PI * distance_ft / gradient_ft;
    (
        0.5 * size * (1.0 - phase.cos()),
        0.5 * size * PI / gradient_ft * phase.sin(),
    )
}

impl DiscreteGusts {
    /// Checks size, length and frequency.
    ///
    /// # Errors
    /// The message for the first one that is wrong.
    pub fn check(&self) -> Result<(), String> {
        if !(self.gradient_ft > 0.0 && self.gradient_ft.is_finite()) {
            return Err("`gradient_ft` must be positive".into());
        }
        if !(self.per_s >= 0.0 && self.per_s.is_finite() && self.size_ft_s.is_finite()) {
            return Err("`per_s` must not be negative, and `size_ft_s` a number".into());
        }
        Ok(())
    }

    /// Draws the gusts along a path.
    #[must_use]
    pub fn gusts(&self, path: &GustPath, seed: u64) -> Vec<Gust> {
        let (speed_ft_s, step_s) = (path.speed_ft_s, path.step_s);
        let duration_s = step_s * path.count as f64;
        let across = self.edges(
            speed_ft_s,
            duration_s,
            &mut RandomStream::new(seed, "discrete gust across"),
        );
        let down = self.edges(
            speed_ft_s,
            duration_s,
            &mut RandomStream::new(seed, "discrete gust down"),
        );
        (0..path.count)
            .map(|k| {
                let place_ft = speed_ft_s * step_s * k as f64;
                let (v, v_by_x) = self.sum(&across, place_ft);
                let (w, w_by_x) = self.sum(&down, place_ft);
                let mut gust = Gust::default();
                (gust.velocity.y, gust.velocity.z) = (v, w);
                (gust.rates.y, gust.rates.z) = (-w_by_x, v_by_x);
                gust
            })
            .collect()
    }

    /// Places along the path at which gusts begin, ft, each with its sign. The first may begin before
    /// the path does.
    fn edges(
        &self,
        speed_ft_s: f64,
        duration_s: f64,
        random: &mut RandomStream,
    ) -> Vec<(f64, f64)> {
        let mut edges = Vec::new();
        let mut time_s = self.wait_s(random) - 2.0 * self.gradient_ft / speed_ft_s;
        while time_s < duration_s {
            let sign = if random.uniform() < 0.5 { 1.0 } else { -1.0 };
            edges.push((speed_ft_s * time_s, sign));
            time_s += self.wait_s(random);
        }
        edges
    }

    /// Draws the time from one gust to the next; infinite at a rate of zero.
    fn wait_s(&self, random: &mut RandomStream) -> f64 {
        -random.uniform().ln() / self.per_s
    }

    /// Velocity and gradient of all gusts at a place. The edges ascend.
    fn sum(&self, edges: &[(f64, f64)], place_ft: f64) -> (f64, f64) {
        let length_ft = 2.0 * self.gradient_ft;
        let first = edges.partition_point(|(edge_ft, _)| place_ft - edge_ft > length_ft);
        let begun = edges[first..].partition_point(|(edge_ft, _)| place_ft - edge_ft >= 0.0);
        edges[first..][..begun]
            .iter()
            .map(|(edge_ft, sign)| {
                one_minus_cosine(sign * self.size_ft_s, self.gradient_ft, place_ft - edge_ft)
            })
            .fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{assert_abs_diff_eq, assert_relative_eq};

    const GUSTS: DiscreteGusts = DiscreteGusts {
        size_ft_s: 12.0,
        gradient_ft: 150.0,
        per_s: 0.4,
    };

    #[test]
    fn a_gust_rises_to_its_size_over_its_gradient_distance_and_falls_back() {
        for (distance, velocity, gradient) in [
            (-1.0, 0.0, 0.0),
            (0.0, 0.0, 0.0),
            (75.0, 6.0, 6.0 * PI / 150.0),
            (150.0, 12.0, 0.0),
            (225.0, 6.0, -6.0 * PI / 150.0),
            (300.0, 0.0, 0.0),
            (301.0, 0.0, 0.0),
        ] {
            let (v, by_x) = one_minus_cosine(12.0, 150.0, distance);
            assert_abs_diff_eq!(v, velocity, epsilon = 1e-12);
            assert_abs_diff_eq!(by_x, gradient, epsilon = 1e-12);
        }
    }

    fn path(speed_ft_s: f64, step_s: f64, count: usize) -> GustPath {
        GustPath {
            speed_ft_s,
            span_ft: 40.0,
            step_s,
            count,
        }
    }

    #[test]
    fn the_air_turns_with_the_gradient_that_the_aircraft_meets() {
        let (speed, step) = (400.0, 0.001);
        let gusts = GUSTS.gusts(&path(speed, step, 30_000), 4);
        for three in gusts.windows(3) {
            let by_x = (three[2].velocity - three[0].velocity) / (2.0 * step * speed);
            // Edges of gusts bend the gradient within a step.
            assert_abs_diff_eq!(three[1].rates.y, -by_x.z, epsilon = 2e-3);
            assert_abs_diff_eq!(three[1].rates.z, by_x.y, epsilon = 2e-3);
            assert!(three[1].velocity.x == 0.0 && three[1].rates.x == 0.0);
        }
    }

    #[test]
    fn gusts_come_at_their_rate_with_the_mean_square_of_a_random_train() {
        // Rate times duration times the mean square of one: 3/8 U².
        let speed = 300.0;
        let gusts = GUSTS.gusts(&path(speed, 0.05, 400_000), 6);
        let expected = 0.4 * (2.0 * 150.0 / speed) * 3.0 / 8.0 * 144.0;
        for axis in [1, 2] {
            let square = gusts.iter().map(|g| g.velocity[axis].powi(2)).sum::<f64>();
            assert_relative_eq!(square / gusts.len() as f64, expected, max_relative = 0.06);
        }
    }
}
