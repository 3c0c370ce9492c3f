//! Checks of a channel's table: numbers that an aircraft can have.

use super::written::TableLine;
use crate::flight::linear_table::{LinearTable, Mistake};
use crate::flight::signal;
use crate::units::{Quantity, Unit};

/// Signals whose values fuel changes by a factor of 3 at most.
const OF_MASS: [&str; 4] = [signal::MASS, signal::IX, signal::IY, signal::IZ];

/// Largest ratio of two values of such a table: a misplaced decimal point makes it 10.
const MOST_CHANGE: f64 = 5.0;

/// Table of a line, with numbers that the signal can have.
///
/// # Errors
/// The key of the table with a mistake.
pub fn checked_table(name: &str, line: &TableLine) -> Result<LinearTable, Mistake> {
    let at_unit = Unit::parse(&line.at_unit).map_err(|what| ("at_unit", what))?;
    let table = LinearTable::new(line.at.clone(), line.value.clone())?;
    let is_mass = at_unit.quantity == Quantity::Mass;
    if let Some(negative) = table.at().iter().find(|at| is_mass && **at < 0.0) {
        let what = format!("`at`: no mass is {negative} {}", line.at_unit);
        return Err(("at", what));
    }
    check_values(name, table.values())?;
    Ok(table)
}

/// Refuses values of a positive signal that are not positive, and masses and inertias that differ more
/// than by fuel.
fn check_values(name: &str, values: &[f64]) -> Result<(), Mistake> {
    let (least, most) = values
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(least, most), value| {
            (least.min(*value), most.max(*value))
        });
    if signal::POSITIVE.contains(&name) && least <= 0.0 {
        let what = format!("`value`: `{name}` is greater than zero, not {least}");
        return Err(("value", what));
    }
    if OF_MASS.contains(&name) && most > MOST_CHANGE * least {
        let what = format!(
            "`value`: {most} is {:.3} times {least}, more than fuel changes `{name}`: is a digit or a decimal point wrong?",
            most / least
        );
        return Err(("value", what));
    }
    Ok(())
}
