//! Equations of motion over short intervals, which test the quantity, unit and sign of each column.
//!
//! Each equation compares the change of one quantity with the integral of others, in rad, ft, s and
//! slug. Accelerations are those of an instrument: normal positive up, axial forward, lateral
//! right. The distances of instruments from the centre of gravity are neglected.

use crate::earth::air;
use crate::inspection::quantity::Quantity;
use crate::units::G0_FT_S2;

/// Equation between quantities.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Equation {
    /// θ̇ = q cos φ − r sin φ.
    PitchAttitude,
    /// φ̇ = p + tan θ (q sin φ + r cos φ).
    RollAttitude,
    /// ψ̇ = (q sin φ + r cos φ)/cos θ.
    Heading,
    /// u̇ = r v − q w + a_x − g sin θ.
    Forward,
    /// v̇ = p w − r u + a_y + g cos θ sin φ.
    Sideways,
    /// ẇ = q u − p v − a_n + g cos θ cos φ.
    Downward,
    /// ḣ = u sin θ − v sin φ cos θ − w cos φ cos θ.
    Climb,
    /// q̄ = ½ ρ(h) V².
    DynamicPressure,
    /// Mach = V/a(h).
    SoundSpeed,
}

impl Equation {
    pub const ALL: [Equation; 9] = [
        Equation::PitchAttitude,
        Equation::RollAttitude,
        Equation::Heading,
        Equation::Forward,
        Equation::Sideways,
        Equation::Downward,
        Equation::Climb,
        Equation::DynamicPressure,
        Equation::SoundSpeed,
    ];

    /// Name of the equation for the analyst.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Equation::PitchAttitude => "pitch attitude against its rate",
            Equation::RollAttitude => "bank against its rate",
            Equation::Heading => "heading against its rate",
            Equation::Forward => "speed against axial acceleration and gravity",
            Equation::Sideways => "sideslip against lateral acceleration, yaw rate and gravity",
            Equation::Downward => {
                "angle of attack against normal acceleration, pitch rate and gravity"
            }
            Equation::Climb => "climb against the flight path",
            Equation::DynamicPressure => "dynamic pressure against speed and altitude",
            Equation::SoundSpeed => "Mach number against speed and altitude",
        }
    }

    /// Quantities that the equation requires, and those that count as zero if they are not
    /// recorded.
    #[must_use]
    pub fn quantities(self) -> (&'static [Quantity], &'static [Quantity]) {
        use Quantity::{
            Alpha, Altitude, An, Ax, Ay, Beta, Mach, P, Phi, Psi, Q, Qbar, R, Theta, Velocity,
        };
        match self {
            Equation::PitchAttitude => (&[Theta, Q], &[Phi, R]),
            Equation::RollAttitude => (&[Phi, P], &[Theta, Q, R]),
            Equation::Heading => (&[Psi, R], &[Theta, Phi, Q]),
            Equation::Forward => (&[Velocity, Theta, Ax], &[Alpha, Beta, Q, R]),
            Equation::Sideways => (&[Beta, Velocity, R], &[Ay, Phi, Theta, Alpha, P]),
            Equation::Downward => (&[Alpha, Velocity, Q, An], &[Theta, Phi, P, Beta]),
            Equation::Climb => (&[Altitude, Velocity, Theta, Alpha], &[Phi, Beta]),
            Equation::DynamicPressure => (&[Qbar, Velocity, Altitude], &[]),
            Equation::SoundSpeed => (&[Mach, Velocity, Altitude], &[]),
        }
    }

    /// `true` if the equation contains the quantity.
    #[must_use]
    pub fn contains(self, quantity: Quantity) -> bool {
        let (needed, others) = self.quantities();
        needed.contains(&quantity) || others.contains(&quantity)
    }

    /// Length of an interval, s. Altitude is recorded coarsely, so its changes are taken over
    /// longer intervals.
    #[must_use]
    pub fn interval_s(self) -> f64 {
        match self {
            Equation::Climb => 5.0,
            _ => 1.0,
        }
    }

    /// Quantity whose change is compared, and the terms of its rate; for equations of levels the
    /// quantity itself and its prediction. Sines are most of the search's time, so each equation
    /// computes its own alone.
    fn sides(self, m: &Motion) -> (f64, [f64; 4]) {
        let g = G0_FT_S2;
        match self {
            Equation::PitchAttitude => {
                let (sin_phi, cos_phi) = m.phi.sin_cos();
                (m.theta, [m.q * cos_phi, -m.r * sin_phi, 0.0, 0.0])
            }
            Equation::RollAttitude => {
                let (sin_theta, cos_theta) = m.theta.sin_cos();
                let (sin_phi, cos_phi) = m.phi.sin_cos();
                let tan = sin_theta / cos_theta;
                (m.phi, [m.p, tan * m.q * sin_phi, tan * m.r * cos_phi, 0.0])
            }
            Equation::Heading => {
                let (_, cos_theta) = m.theta.sin_cos();
                let (sin_phi, cos_phi) = m.phi.sin_cos();
                (
                    m.psi,
                    [
                        m.q * sin_phi / cos_theta,
                        m.r * cos_phi / cos_theta,
                        0.0,
                        0.0,
                    ],
                )
            }
            Equation::Forward => {
                let [u, v, w] = m.body_velocity();
                let (sin_theta, _) = m.theta.sin_cos();
                (u, [m.r * v, -m.q * w, m.ax, -g * sin_theta])
            }
            Equation::Sideways => {
                let [u, v, w] = m.body_velocity();
                let (_, cos_theta) = m.theta.sin_cos();
                let (sin_phi, _) = m.phi.sin_cos();
                (v, [m.p * w, -m.r * u, m.ay, g * cos_theta * sin_phi])
            }
            Equation::Downward => {
                let [u, v, w] = m.body_velocity();
                let (_, cos_theta) = m.theta.sin_cos();
                let (_, cos_phi) = m.phi.sin_cos();
                (w, [m.q * u, -m.p * v, -m.an, g * cos_theta * cos_phi])
            }
            Equation::Climb => {
                let [u, v, w] = m.body_velocity();
                let (sin_theta, cos_theta) = m.theta.sin_cos();
                let (sin_phi, cos_phi) = m.phi.sin_cos();
                (
                    m.altitude,
                    [
                        u * sin_theta,
                        -v * sin_phi * cos_theta,
                        -w * cos_phi * cos_theta,
                        0.0,
                    ],
                )
            }
            Equation::DynamicPressure => {
                let air = air(m.altitude);
                let pressure = 0.5 * air.density_slug_ft3 * m.velocity * m.velocity;
                (m.qbar, [pressure, 0.0, 0.0, 0.0])
            }
            Equation::SoundSpeed => {
                let air = air(m.altitude);
                (m.mach, [m.velocity / air.sound_ft_s, 0.0, 0.0, 0.0])
            }
        }
    }

    /// `true` for the equation of an attitude and its rate.
    #[must_use]
    pub fn is_of_attitude(self) -> bool {
        matches!(
            self,
            Equation::PitchAttitude | Equation::RollAttitude | Equation::Heading
        )
    }

    /// `true` if the change is of an angle that wraps around.
    fn is_angle(self) -> bool {
        matches!(self, Equation::RollAttitude | Equation::Heading)
    }

    /// `true` if values are compared, not changes.
    fn is_level(self) -> bool {
        matches!(self, Equation::DynamicPressure | Equation::SoundSpeed)
    }
}

/// Quantities at one time, in rad, ft, s and slug; zero where one is not recorded.
#[derive(Clone, Copy, Debug, Default)]
struct Motion {
    alpha: f64,
    beta: f64,
    velocity: f64,
    mach: f64,
    altitude: f64,
    p: f64,
    q: f64,
    r: f64,
    theta: f64,
    phi: f64,
    psi: f64,
    an: f64,
    ax: f64,
    ay: f64,
    qbar: f64,
}

impl Motion {
    /// Velocity forward, right and down, ft/s.
    fn body_velocity(&self) -> [f64; 3] {
        let (sin_alpha, cos_alpha) = self.alpha.sin_cos();
        let (sin_beta, cos_beta) = self.beta.sin_cos();
        let level = self.velocity * cos_beta;
        [
            level * cos_alpha,
            self.velocity * sin_beta,
            level * sin_alpha,
        ]
    }

    fn set(&mut self, quantity: Quantity, value: f64) {
        let place = match quantity {
            Quantity::Alpha => &mut self.alpha,
            Quantity::Beta => &mut self.beta,
            Quantity::Velocity => &mut self.velocity,
            Quantity::Mach => &mut self.mach,
            Quantity::Altitude => &mut self.altitude,
            Quantity::P => &mut self.p,
            Quantity::Q => &mut self.q,
            Quantity::R => &mut self.r,
            Quantity::Theta => &mut self.theta,
            Quantity::Phi => &mut self.phi,
            Quantity::Psi => &mut self.psi,
            Quantity::An => &mut self.an,
            Quantity::Ax => &mut self.ax,
            Quantity::Ay => &mut self.ay,
            Quantity::Qbar => &mut self.qbar,
        };
        *place = value;
    }
}

/// Series of one quantity, with the factor to rad, ft, s and slug.
#[derive(Clone, Copy, Debug)]
pub struct Scaled<'a> {
    pub values: &'a [f64],
    pub factor: f64,
}

/// Agreement of an equation with the columns assigned to its quantities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    /// Mean square of the residual over the mean square of the terms: 0 for an exact equation.
    pub ratio: f64,
    /// Number of intervals.
    pub intervals: usize,
}

/// Share of intervals with the largest residuals that are left out: spikes and dropouts.
const OUTLIERS: f64 = 0.02;
/// Least misfit that counts: lever arms, instrument errors and wind leave this amount.
const LEAST_RATIO: f64 = 1e-4;
/// Least number of intervals that decide.
const FEWEST_INTERVALS: usize = 5;

/// Misfit of an equation over all stretches of a uniform step. `None` if a needed quantity is
/// missing or too few intervals have all quantities.
pub fn misfit<'a>(
    equation: Equation,
    stretches: &[std::ops::Range<usize>],
    step_s: f64,
    series: impl Fn(Quantity) -> Option<Scaled<'a>>,
) -> Option<Misfit> {
    let (needed, others) = equation.quantities();
    let mut used = Vec::new();
    for quantity in needed {
        used.push((*quantity, series(*quantity)?));
    }
    used.extend(others.iter().filter_map(|q| Some((*q, series(*q)?))));
    let mut squares = Vec::new();
    for stretch in stretches {
        interval_squares(equation, stretch.clone(), step_s, &used, &mut squares);
    }
    summed(squares)
}

/// Squares of residual and terms of each interval of a stretch.
fn interval_squares(
    equation: Equation,
    stretch: std::ops::Range<usize>,
    step_s: f64,
    used: &[(Quantity, Scaled)],
    squares: &mut Vec<(f64, f64)>,
) {
    let sides = |k: usize| {
        let mut motion = Motion::default();
        for (quantity, scaled) in used {
            motion.set(*quantity, scaled.factor * scaled.values[k]);
        }
        equation.sides(&motion)
    };
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a few steps"
    )]
    let length = ((equation.interval_s() / step_s).round() as usize).max(1);
    let mut at = stretch.start;
    while at < stretch.end && (equation.is_level() || at + length < stretch.end) {
        let (value, rates) = sides(at);
        let (measured, terms) = if equation.is_level() {
            (value, rates)
        } else {
            let (last, integral) = integrated(&sides, rates, at..at + length, step_s);
            (change(equation, value, last), integral)
        };
        let residual = measured - terms.iter().sum::<f64>();
        let size = measured * measured + terms.iter().map(|t| t * t).sum::<f64>();
        if residual.is_finite() && size.is_finite() {
            squares.push((residual * residual, size));
        }
        at += length;
    }
}

/// Compared quantity at the end of an interval, and the integrals of the terms (trapezia). `before`
/// are the terms at its start.
fn integrated(
    sides: &impl Fn(usize) -> (f64, [f64; 4]),
    mut before: [f64; 4],
    interval: std::ops::Range<usize>,
    step_s: f64,
) -> (f64, [f64; 4]) {
    let mut integral = [0.0; 4];
    let mut last = f64::NAN;
    for k in interval.start + 1..=interval.end {
        let (value, rates) = sides(k);
        for (sum, (a, b)) in integral.iter_mut().zip(before.iter().zip(rates)) {
            *sum += 0.5 * step_s * (a + b);
        }
        (last, before) = (value, rates);
    }
    (last, integral)
}

/// Change of the compared quantity; the shorter way round for an angle.
fn change(equation: Equation, from: f64, to: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let change = to - from;
    if equation.is_angle() {
        (change + PI).rem_euclid(TAU) - PI
    } else {
        change
    }
}

/// Misfit of intervals without those of the largest residuals.
fn summed(mut squares: Vec<(f64, f64)>) -> Option<Misfit> {
    squares.sort_by(|a, b| a.0.total_cmp(&b.0));
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a length"
    )]
    let kept = (squares.len() as f64 * (1.0 - OUTLIERS)).ceil() as usize;
    squares.truncate(kept);
    if squares.len() < FEWEST_INTERVALS {
        return None;
    }
    let residual: f64 = squares.iter().map(|s| s.0).sum();
    let size: f64 = squares.iter().map(|s| s.1).sum();
    (size > 0.0).then(|| Misfit {
        ratio: (residual / size).max(LEAST_RATIO),
        intervals: squares.len(),
    })
}
