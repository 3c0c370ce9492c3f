//! Parts of a formula: its columns, and the tree of its operations.

use serde::Serialize;

/// Column of a formula with its unit and the recorder's factor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Operand {
    pub column: String,
    pub unit: String,
    /// Sign and calibration of the recorder.
    pub factor: f64,
}

/// Part of a formula.
#[derive(Clone, Debug, PartialEq)]
pub enum Node {
    Number(f64),
    Operand(usize),
    Negative(Box<Node>),
    Sum(Box<Node>, Box<Node>),
    Difference(Box<Node>, Box<Node>),
    Product(Box<Node>, Box<Node>),
    Quotient(Box<Node>, Box<Node>),
    Whole(Box<Node>, i32),
    Power(Box<Node>, f64),
}

/// Largest number of different columns of a formula.
pub const MOST_OPERANDS: usize = 16;

impl Node {
    /// Value for one value of each column.
    pub fn value(&self, columns: &[f64]) -> f64 {
        match self {
            Node::Number(number) => *number,
            Node::Operand(index) => columns.get(*index).copied().unwrap_or(f64::NAN),
            Node::Negative(a) => -a.value(columns),
            Node::Sum(a, b) => a.value(columns) + b.value(columns),
            Node::Difference(a, b) => a.value(columns) - b.value(columns),
            Node::Product(a, b) => a.value(columns) * b.value(columns),
            Node::Quotient(a, b) => a.value(columns) / b.value(columns),
            Node::Whole(a, exponent) => a.value(columns).powi(*exponent),
            Node::Power(a, exponent) => a.value(columns).powf(*exponent),
        }
    }
}
