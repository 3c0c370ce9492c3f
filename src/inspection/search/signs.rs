//! Patterns of signs: the cost of an assignment with any set of its quantities reversed.
//!
//! Equations of motion have symmetries. In the mirror image of a flight all lateral signs are
//! reversed. In an equation without gravity, pitch, climb and yaw may be reversed together. Such a
//! set may contain any number of quantities, so all sets are tried. This is cheap: an equation
//! contains few quantities, and its misfit is computed once for each reversal of them.

use super::equations::Equation;
use crate::inspection::quantity::Quantity;

/// A set of reversed quantities, one bit each.
pub type Reversal = u32;

/// Physical costs of all reversals of an assignment.
#[derive(Clone, Debug)]
pub struct SignCosts {
    /// Quantities that may have either sign.
    quantities: Vec<Quantity>,
    equations: Vec<EquationCosts>,
}

/// Costs of one equation.
#[derive(Clone, Debug)]
struct EquationCosts {
    /// Places of its quantities among those that may have either sign.
    members: Vec<usize>,
    /// Logarithm of the misfit for each reversal of the members.
    costs: Vec<f64>,
}

impl EquationCosts {
    fn cost(&self, reversal: Reversal) -> f64 {
        let bits = self.members.iter().enumerate();
        let own: usize = bits
            .map(|(n, member)| ((reversal >> member & 1) as usize) << n)
            .sum();
        self.costs[own]
    }
}

impl SignCosts {
    /// Costs of the reversals of some quantities. `cost` returns the logarithm of an equation's misfit with some
    /// quantities reversed; `None` for an equation that is not tried.
    #[must_use]
    pub fn of(
        quantities: Vec<Quantity>,
        cost: impl Fn(Equation, &[Quantity]) -> Option<f64>,
    ) -> SignCosts {
        let of_equation = |equation: Equation| {
            let places = quantities.iter().enumerate();
            let own = places.filter(|(_, quantity)| equation.contains(**quantity));
            let members: Vec<usize> = own.map(|(n, _)| n).collect();
            let reversed = |own: u32| {
                let bits = members.iter().enumerate();
                let turned = bits.filter(|(n, _)| own >> n & 1 == 1);
                let turned: Vec<Quantity> = turned.map(|(_, member)| quantities[*member]).collect();
                cost(equation, &turned)
            };
            let costs: Option<Vec<f64>> = (0..1 << members.len()).map(reversed).collect();
            Some(EquationCosts {
                costs: costs?,
                members,
            })
        };
        let equations = Equation::ALL.into_iter().filter_map(of_equation).collect();
        SignCosts {
            quantities,
            equations,
        }
    }

    /// All reversals. The first reverses nothing.
    pub fn reversals(&self) -> impl Iterator<Item = Reversal> + use<> {
        0..1 << self.quantities.len()
    }

    /// Physical cost of a reversal, relative to that of the assignment without reversals.
    #[must_use]
    pub fn growth(&self, reversal: Reversal) -> f64 {
        let costs = self.equations.iter();
        costs.map(|e| e.cost(reversal) - e.costs[0]).sum()
    }

    /// Reversed quantities.
    pub fn reversed(&self, reversal: Reversal) -> impl Iterator<Item = Quantity> {
        let places = self.quantities.iter().enumerate();
        places
            .filter(move |(n, _)| reversal >> n & 1 == 1)
            .map(|(_, quantity)| *quantity)
    }

    /// The lateral quantities: reversed together they are the mirror image of the flight, which obeys the same
    /// equations.
    #[must_use]
    pub fn mirror_image(&self) -> Reversal {
        let places = self.quantities.iter().enumerate();
        let lateral = places.filter(|(_, quantity)| Quantity::LATERAL.contains(quantity));
        lateral.map(|(n, _)| 1 << n).sum()
    }
}
