//! Declarations of what the published files contain: the words that a column may hold.

mod words;

pub(crate) use words::words;
pub use words::{Entry, Words};
