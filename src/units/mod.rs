//! Units of channels, signals and table columns, and the factors between them.
//!
//! Inside the equations angles are radians and everything else is foot, slug, second, pound-force.
//! A signal's unit is the end of its name (`alpha_vane_deg`, `qbar_psf`). A channel's unit is stated
//! in the channel map.

mod constants;
mod parsing;
mod product;
mod quantity;
#[cfg(test)]
mod tests;
mod unit;

pub use constants::{DEG, G0_FT_S2, M_PER_FT, RAD};
pub use product::{UnitProduct, name_of};
pub use quantity::{Dimensions, Quantity};
pub use unit::{Conversion, Unit};
