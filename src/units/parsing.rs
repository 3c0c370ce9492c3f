//! Units as they are written: a name, another spelling, or a product of units.

use super::product::UnitProduct;
use super::unit::{UNITS, Unit, unit};

impl Unit {
    /// Parses a unit, another spelling of one, or a product of units of a quantity that harvest
    /// has: `N m-1 s`. Spaces, `^`, `*` and a middle dot are ignored.
    ///
    /// # Errors
    /// A message with the names of all units, for an unknown unit.
    pub fn parse(text: &str) -> Result<Unit, String> {
        Unit::named(text)
            .or_else(|| Unit::product(text))
            .ok_or_else(|| {
                let names: Vec<&str> = UNITS.iter().map(|u| u.name).collect();
                format!(
                    "unknown unit `{text}`; the units are {}, and products of them",
                    names.join(", ")
                )
            })
    }

    /// Product of units of a quantity that signals have.
    fn product(text: &str) -> Option<Unit> {
        let product = UnitProduct::parse(text)?;
        let kept = UNITS
            .iter()
            .find(|u| u.dimensions() == product.dimensions)?;
        let factor = product.factor / kept.quantity.dimensions().1;
        Some(unit("a product of units", None, kept.quantity, factor))
    }
}
