//! Formula of a channel: arithmetic of recorded columns, with units.
//!
//! `0.5 * P_S / (287.053 [m2/s2/K] * OAT) * TAS^2`: numbers, perhaps with a unit in brackets, columns,
//! `+ - * / ^` and parentheses. Columns are converted to degree, foot, slug, second and kelvin first,
//! so a formula holds in any units. A sum of different quantities is refused.

use serde::Serialize;

use super::linear_table::LinearTable;
use crate::units::{Conversion, Dimensions, Unit, UnitProduct, name_of};

/// Largest number of characters of a formula.
const LONGEST: usize = 500;

/// Deepest nesting of parentheses and signs.
const DEEPEST: usize = 30;

/// Largest exponent.
const LARGEST_EXPONENT: f64 = 8.0;

/// Number without a unit.
const PURE: Dimensions = [0; 6];

/// Column of a formula with its unit and the recorder's factor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Operand {
    pub column: String,
    pub unit: String,
    /// Sign and calibration of the recorder.
    pub factor: f64,
}

/// Formula, checked for units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Formula {
    text: String,
    operands: Vec<Operand>,
    #[serde(skip)]
    to_base: Vec<Conversion>,
    #[serde(skip)]
    root: Node,
    /// Conversion of the result to the target's unit.
    #[serde(skip)]
    of_base: Conversion,
    /// Table in which the result is the place.
    #[serde(skip_serializing_if = "Option::is_none")]
    table: Option<PlacesIn>,
}

/// Table of a formula with the unit of its places.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct PlacesIn {
    unit: String,
    table: LinearTable,
}

/// Part of a formula.
#[derive(Clone, Debug, PartialEq)]
enum Node {
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

impl Formula {
    /// Parses a formula whose result is in the unit `target`. `operand` returns the unit and factor
    /// of a column.
    ///
    /// # Errors
    /// In words: what cannot be read, an unknown column, quantities that do not fit each other.
    pub fn parse(
        text: &str,
        target: Unit,
        operand: impl Fn(&str) -> Result<Operand, String>,
    ) -> Result<Formula, String> {
        if text.chars().count() > LONGEST {
            return Err(format!("a formula has at most {LONGEST} characters"));
        }
        let mut parser = Parser {
            tokens: tokens(text)?,
            next: 0,
            operands: Vec::new(),
            to_base: Vec::new(),
            operand: &operand,
        };
        let (root, dimensions) = parser.sum(0)?;
        parser.end()?;
        if dimensions != target.dimensions() {
            return Err(format!(
                "it is in {}, which is no {}",
                name_of(dimensions),
                target.name
            ));
        }
        if parser.operands.is_empty() {
            return Err("it contains no column: give the value under `constants`".to_owned());
        }
        Ok(Formula {
            text: text.to_owned(),
            operands: parser.operands,
            to_base: parser.to_base,
            root,
            of_base: target.of_base(),
            table: None,
        })
    }

    /// Parses a formula whose result, in the unit `at_unit`, is the place in a table. The result is then
    /// the table's value, in the unit of its values.
    ///
    /// # Errors
    /// As [`Formula::parse`], and for an unknown unit.
    pub fn over(
        text: &str,
        at_unit: &str,
        table: LinearTable,
        operand: impl Fn(&str) -> Result<Operand, String>,
    ) -> Result<Formula, String> {
        let target = Unit::parse(at_unit)?;
        let unit = at_unit.to_owned();
        Ok(Formula {
            table: Some(PlacesIn { unit, table }),
            ..Formula::parse(text, target, operand)?
        })
    }

    /// Range of the places in words, for a value that is held at an end of the table. `None` for a value
    /// between the ends, for a table that is level at that end, and for a formula without a table.
    #[must_use]
    pub fn held_at_end(&self, value: f64) -> Option<String> {
        let PlacesIn { unit, table } = self.table.as_ref()?;
        let [low, high] = table.held_at(value)?;
        Some(format!("`{}` is outside {low} to {high} {unit}", self.text))
    }

    /// Columns of the formula.
    #[must_use]
    pub fn operands(&self) -> &[Operand] {
        &self.operands
    }

    /// Result for one value of each column, in their order.
    #[must_use]
    pub fn value(&self, columns: &[f64]) -> f64 {
        let mut base = [f64::NAN; MOST_OPERANDS];
        for ((own, value), (operand, to_base)) in base
            .iter_mut()
            .zip(columns)
            .zip(self.operands.iter().zip(&self.to_base))
        {
            *own = to_base.of(value * operand.factor);
        }
        let result = self.of_base.of(self.root.value(&base));
        let table = self.table.as_ref();
        table.map_or(result, |places| places.table.value(result))
    }
}

/// Largest number of different columns of a formula.
const MOST_OPERANDS: usize = 16;

impl Node {
    fn value(&self, columns: &[f64]) -> f64 {
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

/// Word of a formula.
#[derive(Clone, Debug, PartialEq)]
enum Token {
    Number(f64),
    /// Unit in brackets.
    Unit(String),
    Column(String),
    Sign(char),
}

impl Token {
    fn in_words(&self) -> String {
        match self {
            Token::Number(number) => format!("the number {number}"),
            Token::Unit(unit) => format!("the unit [{unit}]"),
            Token::Column(name) => format!("`{name}`"),
            Token::Sign(sign) => format!("`{sign}`"),
        }
    }
}

/// Words of a text. A name with other characters than letters, digits, `_` and `.` stands in backticks.
fn tokens(text: &str) -> Result<Vec<Token>, String> {
    let mut tokens = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let (token, length) = match first {
            '+' | '-' | '*' | '/' | '^' | '(' | ')' => (Token::Sign(first), 1),
            '[' => enclosed(rest, ']').map(|(unit, n)| (Token::Unit(unit), n))?,
            '`' => enclosed(rest, '`').map(|(name, n)| (Token::Column(name), n))?,
            '0'..='9' | '.' => number(rest)?,
            first if is_of_name(first) => {
                let name: String = rest.chars().take_while(|c| is_of_name(*c)).collect();
                let length = name.len();
                (Token::Column(name), length)
            }
            other => {
                return Err(format!(
                    "`{other}` has no meaning; a formula has numbers, units in [ ], columns, + - * / ^ and ( )"
                ));
            }
        };
        tokens.push(token);
        rest = rest.get(length..).unwrap_or_default().trim_start();
    }
    Ok(tokens)
}

fn is_of_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_' || c == '.'
}

/// Text up to the closing character, and its length with both.
fn enclosed(rest: &str, close: char) -> Result<(String, usize), String> {
    let inside = rest.get(1..).unwrap_or_default();
    let end = inside
        .find(close)
        .ok_or_else(|| format!("`{close}` is missing"))?;
    Ok((inside[..end].trim().to_owned(), end + 2))
}

/// Number at the beginning of a text, and its length.
fn number(rest: &str) -> Result<(Token, usize), String> {
    let mut length = 0;
    let mut before = ' ';
    for c in rest.chars() {
        let is_exponent_sign = matches!(c, '+' | '-') && matches!(before, 'e' | 'E');
        if !(c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E') || is_exponent_sign) {
            break;
        }
        length += 1;
        before = c;
    }
    let number = rest[..length].parse::<f64>().ok();
    let number = number.filter(|n| n.is_finite());
    let number = number.ok_or_else(|| format!("`{}` is no number", &rest[..length]))?;
    Ok((Token::Number(number), length))
}

/// Part of a formula with its dimensions.
type Typed = (Node, Dimensions);

/// Recursive-descent parser that checks units as it goes.
struct Parser<'a, F> {
    tokens: Vec<Token>,
    next: usize,
    operands: Vec<Operand>,
    to_base: Vec<Conversion>,
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

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Columns of an air-data computer, two ailerons and two engines.
    fn operand(column: &str) -> Result<Operand, String> {
        let unit = match column {
            "P_S" => "hPa",
            "OAT" => "degC",
            "TAS" => "m/s",
            "AIL L" | "AIL_R" => "rad",
            "THR1" | "THR2" => "kN",
            "M" => "-",
            "FUEL" => "kg",
            _ => return Err(format!("no column `{column}`")),
        };
        Ok(Operand {
            column: column.to_owned(),
            unit: unit.to_owned(),
            factor: 1.0,
        })
    }

    fn value(text: &str, signal: &str, columns: &[f64]) -> f64 {
        Formula::parse(text, Unit::of_signal(signal), operand)
            .expect(text)
            .value(columns)
    }

    #[test]
    fn formulas_have_the_values_of_hand_calculations() {
        // 1013.25 hPa at 15 degC is 1.225 kg/m3; at 50 m/s 1531.25 Pa, 31.981 psf.
        let pressure = "0.5 * P_S / (287.053 [m2/s2/K] * OAT) * TAS^2";
        let qbar = value(pressure, "qbar_psf", &[1013.25, 15.0, 50.0]);
        assert_relative_eq!(qbar, 31.981, max_relative = 1e-4);
        let compressible = value("0.7 * P_S * M^2", "qbar_psf", &[1013.25, 0.2]);
        assert_relative_eq!(compressible, 59.255, max_relative = 1e-4);
        // Half of 0.1 rad is 2.8648 deg.
        let aileron = value("(`AIL L` - AIL_R) / 2", "da_deg", &[0.07, -0.03]);
        assert_relative_eq!(aileron, 2.864_788_976, max_relative = 1e-9);
        let thrust = value("THR1 + THR2", "thrust_lbf", &[4.448_221_615, 8.896_443_231]);
        assert_relative_eq!(thrust, 3000.0, max_relative = 1e-9);
        let mass = value("1000 [kg] + FUEL", "mass_slug", &[459.390_293_7]);
        assert_relative_eq!(mass, 100.0, max_relative = 1e-9);
        let speed = value(
            "(2 * P_S / (1.225 [kg/m3]))^0.5 * M / M",
            "velocity_ft_s",
            &[6.125, 0.3],
        );
        assert_relative_eq!(speed, 1000_f64.sqrt() / 0.3048, max_relative = 1e-9);
    }

    #[test]
    fn signs_and_powers_bind_as_in_mathematics() {
        for (text, expected) in [
            ("-M^2", -9.0),
            ("2 - M - 1", -2.0),
            ("12 / M / 2", 2.0),
            ("2 * -M", -6.0),
            ("M^-1 * 3", 1.0),
            ("2 + M * 2e0", 8.0),
            ("(2 + M) * 2", 10.0),
        ] {
            assert_relative_eq!(value(text, "mach", &[3.0]), expected, max_relative = 1e-12);
        }
    }

    #[test]
    fn a_recorders_factor_and_a_missing_value_enter() {
        let half = |column: &str| operand(column).map(|o| Operand { factor: -0.5, ..o });
        let formula = Formula::parse("M + 1", Unit::of_signal("mach"), half).unwrap();
        assert_relative_eq!(formula.value(&[0.4]), 0.8);
        assert!(formula.value(&[f64::NAN]).is_nan());
    }

    #[test]
    fn a_table_is_read_at_the_result_in_the_unit_of_its_places() {
        let table = LinearTable::new(vec![0.0, 200.0], vec![1000.0, 1200.0]).unwrap();
        let inertia = Formula::over("FUEL / 2", "kg", table.clone(), operand).unwrap();
        assert_relative_eq!(inertia.value(&[100.0]), 1050.0, max_relative = 1e-9);
        assert_relative_eq!(inertia.value(&[900.0]), 1200.0, max_relative = 1e-9);
        assert!(inertia.value(&[f64::NAN]).is_nan());
        let of_pounds = Formula::over("FUEL", "lb", table.clone(), operand).unwrap();
        // 45.359237 kg are 100 lb.
        assert_relative_eq!(of_pounds.value(&[45.359_237]), 1100.0, max_relative = 1e-6);
        let refused = Formula::over("FUEL", "m", table, operand).unwrap_err();
        assert!(refused.contains("in slug, which is no m"), "{refused}");
    }

    #[test]
    fn what_does_not_fit_is_refused_in_words() {
        let deep = format!("{}M{}", "(".repeat(40), ")".repeat(40));
        for (text, words) in [
            ("THR1 + FUEL", "a sum of lbf and slug"),
            ("THR1 * TAS", "it is in ft2 slug s-3, which is no lbf"),
            ("TRH1", "no column `TRH1`"),
            ("THR1 +", "it ends where a column"),
            ("THR1 THR2", "`THR2` stands where an operator is expected"),
            ("(THR1", "`)` is missing"),
            ("THR1 * 2 [furlong]", "`[furlong]` is no unit"),
            ("THR1 % 2", "`%` has no meaning"),
            ("THR1^0.5", "to the power of 0.5 is no unit"),
            ("M^M", "behind `^` stands a number"),
            ("3 [lbf]", "contains no column"),
            ("1.2.3 * THR1", "`1.2.3` is no number"),
            ("`THR1", "is missing"),
            ("", "it ends where"),
            (deep.as_str(), "nested more than"),
        ] {
            let refused = Formula::parse(text, Unit::of_signal("thrust_lbf"), operand);
            let message = refused.expect_err(text);
            assert!(message.contains(words), "{text}: {message}");
        }
    }
}
