//! Declarations of the published files: tables with their columns, columns with their words.

mod table;
mod words;

pub(crate) use table::table;
pub use table::{Cell, Cells, Column, Declared, Field, Row, Table, one_line};
pub(crate) use words::words;
pub use words::{Entry, Words};
