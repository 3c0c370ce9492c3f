//! Lineage: code, configuration and input that decide a published night, and the differences between
//! two nights.

mod change_rows;
mod differences;
mod parts;
mod stage;

pub use change_rows::{
    Changes, Contradiction, InformationGain, InstrumentChange, ManeuverChange, ManeuverDifference,
    Moved, VerdictChange,
};
pub use differences::{Cause, Origin};
pub use parts::{Code, Lineage};
pub use stage::Stage;
