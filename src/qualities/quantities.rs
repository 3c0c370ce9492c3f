//! Quantities of the modes that a specification judges, with their slopes along the derivatives.

use nalgebra::DVector;

use super::linear::{Differentiation, LinearModel, SolvedEquations};
use super::modes::{Modes, magnitude_of_ratio};
use crate::aero::Axis;
use crate::numerics::dual::Dual;
use crate::tables::FlyingQuality;

/// Quantities of an axis at values of the derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisQuantities {
    /// Quantities of the modes that exist.
    pub quantities: Vec<(FlyingQuality, Dual)>,
    pub modes: Modes,
}

impl AxisQuantities {
    /// Quantities without their slopes.
    #[must_use]
    pub fn values(&self) -> Vec<(FlyingQuality, f64)> {
        let quantities = self.quantities.iter();
        quantities.map(|(q, dual)| (*q, dual.value)).collect()
    }
}

impl LinearModel {
    /// Modes at values of the derivatives; `None` if a value is not finite.
    #[must_use]
    pub fn modes(&self, axis: Axis, values: &DVector<f64>) -> Option<Modes> {
        let solved = self.solved(values, Differentiation::ValuesAlone);
        Modes::of_matrix(axis, &solved.matrix, &[])
    }

    /// Quantities at values of the derivatives; `None` if a value is not finite.
    #[must_use]
    pub fn quantities(
        &self,
        axis: Axis,
        values: &DVector<f64>,
        differentiation: Differentiation,
    ) -> Option<AxisQuantities> {
        let solved = self.solved(values, differentiation);
        let modes = Modes::of_matrix(axis, &solved.matrix, &solved.slopes)?;
        let quantities = match axis {
            Axis::Longitudinal => longitudinal(&modes, &solved, self.velocity / self.gravity),
            Axis::Lateral => lateral(&modes, &solved),
        };
        Some(AxisQuantities { quantities, modes })
    }
}

impl SolvedEquations {
    /// Entry of the matrix A with its slopes.
    fn a(&self, i: usize, j: usize) -> Dual {
        let slopes = self.slopes.iter().map(|m| m[(i, j)]);
        Dual::new(self.matrix[(i, j)], slopes.collect())
    }

    fn b(&self, i: usize) -> Dual {
        let slopes = self.control_slopes.iter().map(|m| m[i]);
        Dual::new(self.control[i], slopes.collect())
    }

    /// Larger zero of the transfer function from control to pitch attitude. With θ held at zero the
    /// moment determines the control, and velocity and α remain.
    fn attitude_zero(&self) -> Dual {
        let entry = |i: usize, j: usize| self.a(i, j) - self.b(i) * self.a(2, j) / self.b(2);
        let [xx, xz, zx, zz] = [entry(0, 0), entry(0, 1), entry(1, 0), entry(1, 1)];
        let sum = xx.clone() + zz.clone();
        let difference = xx - zz;
        let root = (difference.clone() * difference + xz * zx * 4.0).sqrt();
        (root - sum) * 0.5
    }

    /// Steady load factor per angle of attack, by the control at constant speed: q̇ = 0 gives the
    /// control, α̇ = 0 the pitch rate.
    fn load_factor(&self, velocity_over_gravity: f64) -> Dual {
        let lift_by_moment = self.b(1) / self.b(2);
        let by_alpha = lift_by_moment.clone() * self.a(2, 1) - self.a(1, 1);
        let by_rate = self.a(1, 2) - lift_by_moment * self.a(2, 2);
        by_alpha / by_rate * velocity_over_gravity
    }
}

fn longitudinal(
    modes: &Modes,
    entries: &SolvedEquations,
    velocity_over_gravity: f64,
) -> Vec<(FlyingQuality, Dual)> {
    let (fast, slow) = (modes.fast_pair(), modes.slow_pair());
    let load_factor = entries.load_factor(velocity_over_gravity);
    let fastest = modes.slow.iter().map(|i| &modes.roots[*i]);
    let diverging = fastest.max_by(|a, b| a.value.re.total_cmp(&b.value.re));
    vec![
        (FlyingQuality::ShortPeriodFrequency, fast.frequency()),
        (FlyingQuality::ShortPeriodDamping, fast.damping()),
        (FlyingQuality::PhugoidFrequency, slow.frequency()),
        (FlyingQuality::PhugoidDamping, slow.damping()),
        (
            FlyingQuality::PhugoidTimeToDouble,
            diverging.map_or_else(|| f64::NAN.into(), |root| time_to_double(root.real())),
        ),
        (FlyingQuality::AttitudeZero, entries.attitude_zero()),
        // CAP = ω²/(n/α): ω² is the product of the fast roots, n/α the load factor per radian.
        (
            FlyingQuality::ControlAnticipation,
            fast.product.clone() / load_factor.clone(),
        ),
        (FlyingQuality::LoadFactorPerAlpha, load_factor),
    ]
}

fn lateral(modes: &Modes, entries: &SolvedEquations) -> Vec<(FlyingQuality, Dual)> {
    let fast = modes.fast_pair();
    let oscillation = &modes.roots[modes.fast[0]];
    let phi_beta = magnitude_of_ratio(&entries.matrix, oscillation, &entries.slopes);
    let mut quantities = vec![
        (FlyingQuality::DutchRollFrequency, fast.frequency()),
        (FlyingQuality::DutchRollDamping, fast.damping()),
        (FlyingQuality::DutchRollDecay, fast.decay()),
        (
            FlyingQuality::DutchRollBank,
            fast.product.clone() * phi_beta.clone(),
        ),
        (FlyingQuality::PhiBeta, phi_beta),
    ];
    if modes.is_slow_oscillation() {
        quantities.push((FlyingQuality::RollSpiralDecay, modes.slow_pair().decay()));
        return quantities;
    }
    let [roll, spiral] = modes.slow.map(|i| modes.roots[i].real());
    quantities.extend([
        (FlyingQuality::RollTimeConstant, time_constant(roll)),
        (FlyingQuality::SpiralRate, -spiral.clone()),
        (FlyingQuality::SpiralTimeToDouble, time_to_double(spiral)),
    ]);
    quantities
}

/// Time constant of a root that decays; infinite for one that does not.
fn time_constant(root: Dual) -> Dual {
    if root.value < 0.0 {
        Dual::from(-1.0) / root
    } else {
        f64::INFINITY.into()
    }
}

/// Time in which a root doubles; infinite for one that decays.
fn time_to_double(root: Dual) -> Dual {
    if root.value > 0.0 {
        Dual::from(std::f64::consts::LN_2) / root
    } else {
        f64::INFINITY.into()
    }
}
