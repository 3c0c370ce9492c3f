//! Change of the derivatives over the angles of attack of one maneuver: that of the wind tunnel, and
//! that of held values.

pub mod tunnel_change;
pub mod alpha_slopes;
pub mod held_slopes;
