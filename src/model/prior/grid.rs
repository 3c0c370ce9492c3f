//! Grid of flight conditions. A quantity has values at its points and is linear between them.

use crate::aero::Condition;
use crate::aero::wind_tunnel::each_or_none;

/// Points over angle of attack, Mach number and third variable. The quantity does not depend on a
/// variable without points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grid {
    /// Ascending, deg.
    pub alphas_deg: Vec<f64>,
    pub machs: Vec<f64>,
    pub thirds: Vec<f64>,
}

/// One point of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    pub alpha_deg: f64,
    pub mach: Option<f64>,
    pub third: Option<f64>,
}

impl Node {
    /// Condition of the point at which tables are read.
    #[must_use]
    pub fn condition(&self) -> Condition {
        Condition {
            alpha_deg: self.alpha_deg,
            mach: self.mach.unwrap_or(0.0),
            third: self.third,
        }
    }
}

impl Grid {
    /// Grid of one variable.
    #[must_use]
    pub fn of_alpha(alphas_deg: Vec<f64>) -> Grid {
        Grid {
            alphas_deg,
            ..Grid::default()
        }
    }

    /// `true` if the values depend on Mach number.
    #[must_use]
    pub fn depends_on_mach(&self) -> bool {
        !self.machs.is_empty()
    }

    #[must_use]
    pub fn len(&self) -> usize {
        self.alphas_deg.len() * self.machs.len().max(1) * self.thirds.len().max(1)
    }

    /// Points in order: α varies fastest, then Mach.
    #[must_use]
    pub fn nodes(&self) -> Vec<Node> {
        let mut nodes = Vec::with_capacity(self.len());
        for third in each_or_none(&self.thirds) {
            for mach in each_or_none(&self.machs) {
                nodes.extend(self.alphas_deg.iter().map(|&alpha_deg| Node {
                    alpha_deg,
                    mach,
                    third,
                }));
            }
        }
        nodes
    }

    /// Weights of the points for the value at a condition. A condition beyond the grid has the
    /// weights at the edge.
    #[must_use]
    pub fn shares(&self, at: &Condition) -> Vec<(usize, f64)> {
        let third = either_side(&self.thirds, at.third.unwrap_or(f64::NAN));
        let mach = either_side(&self.machs, at.mach);
        let alpha = either_side(&self.alphas_deg, at.alpha_deg);
        let (per_mach, machs) = (self.alphas_deg.len(), self.machs.len().max(1));
        let mut shares = Vec::new();
        for &(t, share_t) in &third {
            for &(m, share_m) in &mach {
                for &(a, share_a) in &alpha {
                    let share = share_t * share_m * share_a;
                    if share != 0.0 {
                        shares.push(((t * machs + m) * per_mach + a, share));
                    }
                }
            }
        }
        shares
    }
}

/// Neighbouring points of a value, with their weights in the linear interpolation.
fn either_side(points: &[f64], value: f64) -> Vec<(usize, f64)> {
    let last = points.len().saturating_sub(1);
    let above = points.partition_point(|p| *p < value);
    if above == 0 || value.is_nan() {
        return vec![(0, 1.0)];
    }
    if above > last {
        return vec![(last, 1.0)];
    }
    let (low, high) = (points[above - 1], points[above]);
    let share = (value - low) / (high - low);
    vec![(above - 1, 1.0 - share), (above, share)]
}

/// Sorts the points, keeps each once, and adds points so that no gap exceeds `widest`.
#[must_use]
pub fn refined(points: impl IntoIterator<Item = f64>, widest: f64) -> Vec<f64> {
    let mut points: Vec<f64> = points.into_iter().collect();
    points.sort_by(f64::total_cmp);
    points.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
    let mut all = Vec::with_capacity(points.len());
    for pair in points.windows(2) {
        let parts = ((pair[1] - pair[0]) / widest - 1e-9).ceil().max(1.0);
        let step = (pair[1] - pair[0]) / parts;
        let mut part = 0.0;
        while part < parts {
            all.push(pair[0] + part * step);
            part += 1.0;
        }
    }
    all.extend(points.last());
    all
}
