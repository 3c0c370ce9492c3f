//! Recursive-descent parser of formulas, which checks units.

use super::parts::{MOST_OPERANDS, Node, Operand};
use super::tokens::{Token, tokens};
use crate::units::{Conversion, Dimensions, Unit, UnitProduct, name_of};

/// Deepest nesting of parentheses and signs.
const DEEPEST: usize = 30;

/// Largest exponent.
const LARGEST_EXPONENT: f64 = 8.0;

/// Number without a unit.
const PURE: Dimensions = [0; 6];

/// A formula as parsed.
pub struct ParsedFormula {
    pub root: Node,
    pub dimensions: Dimensions,
    pub operands: Vec<Operand>,
    /// Conversion of each operand to the base units.
    pub to_base: Vec<Conversion>,
}

/// Parses a formula. `operand` returns the unit and factor of a column.
///
/// # Errors
/// In words: what cannot be read, an unknown column, quantities that do not fit each other.
pub fn parse(
    text: &str,
    operand: &impl Fn(&str) -> Result<Operand, String>,
) -> Result<ParsedFormula, String> {
    let mut parser = Parser {
        tokens: tokens(text)?,
        next: 0,
        operands: Vec::new(),
        to_base: Vec::new(),
        operand,
    };
    let (root, dimensions) = parser.sum(0)?;
    parser.end()?;
    Ok(ParsedFormula {
        root,
        dimensions,
        operands: parser.operands,
        to_base: parser.to_base,
    })
}

/// Part of a formula with its dimensions.
type Typed = (Node, Dimensions);

/// Recursive-descent parser that checks units as it goes.
struct Parser<'a, F> {
    tokens: Vec<Token>,
    /// Index of the next token.
    next: usize,
    operands: Vec<Operand>,
    to_base: Vec<Conversion>,
    /// Unit and factor of a column.
    operand: &'a F,
}

impl<F: Fn(&str) -> Result<Operand, String>> Parser<'_, F> {
    /// Takes one of these signs, if it is next.
    fn take(&mut self, signs: &[char]) -> Option<char> {
        let Some(Token::Sign(sign)) = self.tokens.get(self.next) else {
            return None;
        };
        let sign = *sign;
        signs.contains(&sign).then(|| {
            self.next += 1;
            sign
        })
    }

    fn end(&self) -> Result<(), String> {
        self.tokens.get(self.next).map_or(Ok(()), |token| {
            let what = token.in_words();
            Err(format!("{what} stands where an operator is expected"))
        })
    }

    fn sum(&mut self, depth: usize) -> Result<Typed, String> {
        let (mut left, dimensions) = self.product(depth)?;
        while let Some(sign) = self.take(&['+', '-']) {
            let (right, own) = self.product(depth)?;
            if own != dimensions {
                let (a, b) = (name_of(dimensions), name_of(own));
                return Err(format!(
                    "a sum of {a} and {b}: both sides of `{sign}` need the same quantity"
                ));
            }
            let (left_of, right) = (Box::new(left), Box::new(right));
            left = match sign {
                '+' => Node::Sum(left_of, right),
                _ => Node::Difference(left_of, right),
            };
        }
        Ok((left, dimensions))
    }

    fn product(&mut self, depth: usize) -> Result<Typed, String> {
        let (mut left, mut dimensions) = self.signed(depth)?;
        while let Some(sign) = self.take(&['*', '/']) {
            let (right, own) = self.signed(depth)?;
            let side = if sign == '*' { 1 } else { -1 };
            for (sum, own) in dimensions.iter_mut().zip(own) {
                *sum += side * own;
            }
            let (left_of, right) = (Box::new(left), Box::new(right));
            left = match sign {
                '*' => Node::Product(left_of, right),
                _ => Node::Quotient(left_of, right),
            };
        }
        Ok((left, dimensions))
    }

    fn signed(&mut self, depth: usize) -> Result<Typed, String> {
        if depth > DEEPEST {
            return Err(format!("it is nested more than {DEEPEST} deep"));
        }
        if self.take(&['-']).is_some() {
            let (of, dimensions) = self.signed(depth + 1)?;
            return Ok((Node::Negative(Box::new(of)), dimensions));
        }
        let (base, dimensions) = self.atom(depth)?;
        if self.take(&['^']).is_none() {
            return Ok((base, dimensions));
        }
        let exponent = self.exponent()?;
        raised(base, dimensions, exponent)
    }

    fn exponent(&mut self) -> Result<f64, String> {
        let sign = if self.take(&['-']).is_some() {
            -1.0
        } else {
            1.0
        };
        match self.tokens.get(self.next) {
            Some(Token::Number(number)) if *number <= LARGEST_EXPONENT => {
                self.next += 1;
                Ok(sign * number)
            }
            _ => Err(format!(
                "behind `^` stands a number up to {LARGEST_EXPONENT}, such as 2 or 0.5"
            )),
        }
    }

    fn atom(&mut self, depth: usize) -> Result<Typed, String> {
        let token = self.tokens.get(self.next).cloned();
        self.next += 1;
        match token {
            Some(Token::Number(number)) => self.number(number),
            Some(Token::Column(name)) => self.column(&name),
            Some(Token::Sign('(')) => {
                let inside = self.sum(depth + 1)?;
                let closed = self.take(&[')']);
                closed.map(|_| inside).ok_or("`)` is missing".to_owned())
            }
            Some(other) => Err(format!(
                "{} stands where a column, a number or `(` is expected",
                other.in_words()
            )),
            None => Err("it ends where a column, a number or `(` is expected".to_owned()),
        }
    }

    /// Number with the unit that may follow it.
    fn number(&mut self, number: f64) -> Result<Typed, String> {
        let Some(Token::Unit(unit)) = self.tokens.get(self.next) else {
            return Ok((Node::Number(number), PURE));
        };
        let product = UnitProduct::parse(unit)
            .ok_or_else(|| format!("`[{unit}]` is no unit and no product of units"))?;
        self.next += 1;
        Ok((Node::Number(number * product.factor), product.dimensions))
    }

    fn column(&mut self, name: &str) -> Result<Typed, String> {
        let operand = (self.operand)(name)?;
        let unit = Unit::parse(&operand.unit).map_err(|what| format!("`{name}`: {what}"))?;
        let known = self.operands.iter().position(|o| o.column == name);
        let index = known.unwrap_or(self.operands.len());
        if known.is_none() {
            if index == MOST_OPERANDS {
                return Err(format!("it has more than {MOST_OPERANDS} columns"));
            }
            self.operands.push(operand);
            self.to_base.push(unit.to_base());
        }
        Ok((Node::Operand(index), unit.dimensions()))
    }
}

/// Power of a part. The exponents of its unit must stay whole.
fn raised(base: Node, dimensions: Dimensions, exponent: f64) -> Result<Typed, String> {
    let mut raised = PURE;
    for (own, before) in raised.iter_mut().zip(dimensions) {
        let product = f64::from(before) * exponent;
        #[expect(
            clippy::cast_possible_truncation,
            reason = "rounded, and small: both factors are"
        )]
        let whole = product.round() as i32;
        if (product - f64::from(whole)).abs() > 1e-9 {
            let unit = name_of(dimensions);
            return Err(format!("{unit} to the power of {exponent} is no unit"));
        }
        *own = whole;
    }
    #[expect(
        clippy::cast_possible_truncation,
        reason = "not beyond LARGEST_EXPONENT"
    )]
    let whole = exponent.round() as i32;
    let base = Box::new(base);
    let node = if (exponent - f64::from(whole)).abs() < 1e-12 {
        Node::Whole(base, whole)
    } else {
        Node::Power(base, exponent)
    };
    Ok((node, raised))
}
