//! A night: a run's results published together with what decided them, and the questions of the
//! morning after.

pub mod changes;
pub mod diff;
pub mod explain;
pub mod gc;
pub mod publish;
mod run;
pub mod status;
pub mod verify;

pub use run::run;
