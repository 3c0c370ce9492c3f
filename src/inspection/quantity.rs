//! Measured quantities of the motion, and the units in which recorders write them.

use crate::flight::signal;
use crate::units::{G0_FT_S2, RAD, Unit};

/// Quantity of the motion that the equations of motion relate to others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    Alpha,
    Beta,
    Velocity,
    Mach,
    Altitude,
    P,
    Q,
    R,
    Theta,
    Phi,
    Psi,
    An,
    Ax,
    Ay,
    Qbar,
}

impl Quantity {
    /// All quantities, in the order of a channel map.
    pub const ALL: [Quantity; 15] = [
        Quantity::Alpha,
        Quantity::Beta,
        Quantity::Velocity,
        Quantity::Mach,
        Quantity::Altitude,
        Quantity::P,
        Quantity::Q,
        Quantity::R,
        Quantity::Theta,
        Quantity::Phi,
        Quantity::Psi,
        Quantity::An,
        Quantity::Ax,
        Quantity::Ay,
        Quantity::Qbar,
    ];

    /// Quantities whose sign is reversed in the mirror image of a flight.
    pub const LATERAL: [Quantity; 6] = [
        Quantity::Beta,
        Quantity::P,
        Quantity::R,
        Quantity::Phi,
        Quantity::Psi,
        Quantity::Ay,
    ];

    /// Quantities of the same kind about or along the three axes, this one included.
    #[must_use]
    pub fn akin(self) -> &'static [Quantity] {
        match self {
            Quantity::P | Quantity::Q | Quantity::R => &[Quantity::P, Quantity::Q, Quantity::R],
            Quantity::Theta | Quantity::Phi | Quantity::Psi => {
                &[Quantity::Theta, Quantity::Phi, Quantity::Psi]
            }
            Quantity::An | Quantity::Ax | Quantity::Ay => {
                &[Quantity::An, Quantity::Ax, Quantity::Ay]
            }
            Quantity::Alpha | Quantity::Beta => &[Quantity::Alpha, Quantity::Beta],
            Quantity::Velocity | Quantity::Mach | Quantity::Altitude | Quantity::Qbar => &[],
        }
    }

    /// Signal that holds the quantity.
    #[must_use]
    pub fn signal(self) -> &'static str {
        match self {
            Quantity::Alpha => signal::ALPHA_VANE,
            Quantity::Beta => signal::BETA_VANE,
            Quantity::Velocity => signal::VELOCITY,
            Quantity::Mach => signal::MACH,
            Quantity::Altitude => signal::ALTITUDE,
            Quantity::P => signal::P,
            Quantity::Q => signal::Q,
            Quantity::R => signal::R,
            Quantity::Theta => signal::THETA,
            Quantity::Phi => signal::PHI,
            Quantity::Psi => signal::PSI,
            Quantity::An => signal::AN,
            Quantity::Ax => signal::AX,
            Quantity::Ay => signal::AY,
            Quantity::Qbar => signal::QBAR,
        }
    }

    /// Quantity that a signal holds.
    #[must_use]
    pub fn of_signal(name: &str) -> Option<Quantity> {
        let mut all = Quantity::ALL.into_iter();
        all.find(|quantity| quantity.signal() == name)
    }

    /// Units in which recorders write the quantity, the most frequent first.
    #[must_use]
    pub fn units(self) -> &'static [&'static str] {
        match self {
            Quantity::Alpha | Quantity::Beta | Quantity::Theta | Quantity::Phi | Quantity::Psi => {
                &["deg", "rad"]
            }
            Quantity::P | Quantity::Q | Quantity::R => &["deg/s", "rad/s"],
            Quantity::Velocity => &["ft/s", "m/s", "kt", "km/h"],
            Quantity::Altitude => &["ft", "m"],
            Quantity::An | Quantity::Ax | Quantity::Ay => &["g", "m/s2", "ft/s2"],
            Quantity::Qbar => &["lbf/ft2", "Pa", "hPa", "kPa", "psi"],
            Quantity::Mach => &["-"],
        }
    }

    /// `true` if recorders differ in the sign.
    #[must_use]
    pub fn is_signed(self) -> bool {
        !matches!(self, Quantity::Velocity | Quantity::Mach | Quantity::Qbar)
    }

    /// Factor from values in a unit to rad, ft, s and slug; `None` for a unit of something else.
    #[must_use]
    pub fn factor(self, unit: &str) -> Option<f64> {
        let kept = Unit::of_signal(self.signal());
        let into_kept = Unit::parse(unit).ok()?.factor_to(kept)?;
        Some(into_kept * self.base())
    }

    /// Factor from the signal's unit to rad, ft, s and slug.
    fn base(self) -> f64 {
        match self {
            Quantity::An | Quantity::Ax | Quantity::Ay => G0_FT_S2,
            Quantity::Velocity | Quantity::Mach | Quantity::Altitude | Quantity::Qbar => 1.0,
            _ => RAD,
        }
    }
}
