//! Tokens of a formula: numbers, units in brackets, columns, operators.

/// Token of a formula.
#[derive(Clone, Debug, PartialEq)]
pub enum Token {
    Number(f64),
    /// Unit in brackets.
    Unit(String),
    Column(String),
    Sign(char),
}

impl Token {
    pub fn in_words(&self) -> String {
        match self {
            Token::Number(number) => format!("the number {number}"),
            Token::Unit(unit) => format!("the unit [{unit}]"),
            Token::Column(name) => format!("`{name}`"),
            Token::Sign(sign) => format!("`{sign}`"),
        }
    }
}

/// Tokens of a text. A name with other characters than letters, digits, `_` and `.` stands in backticks.
pub fn tokens(text: &str) -> Result<Vec<Token>, String> {
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
