//! Data of SVG paths as PDF operators.

use std::fmt::Write;

/// A number with at most two decimals, as short as possible.
pub fn number(value: f32) -> String {
    let mut text = String::new();
    push_number(&mut text, value);
    text
}

/// Number of hundredths that a 64-bit integer holds with certainty.
const MOST_HUNDREDTHS: f64 = 1e15;

/// Appends a [`number`]. Its digits are those of an integer, which are found several times as fast as
/// those of a fraction.
fn push_number(text: &mut String, value: f32) {
    let hundredths = (100.0 * f64::from(value)).round();
    if hundredths == 0.0 || !hundredths.is_finite() {
        text.push('0');
        return;
    }
    // Writing into a String cannot fail.
    if hundredths.abs() > MOST_HUNDREDTHS {
        let _ = write!(text, "{}", hundredths / 100.0);
        return;
    }
    #[expect(clippy::cast_possible_truncation, reason = "limited above")]
    let hundredths = hundredths as i64;
    if hundredths < 0 {
        text.push('-');
    }
    let (whole, rest) = (
        hundredths.unsigned_abs() / 100,
        hundredths.unsigned_abs() % 100,
    );
    let _ = match (rest / 10, rest % 10) {
        (0, 0) => write!(text, "{whole}"),
        (tenths, 0) => write!(text, "{whole}.{tenths}"),
        (tenths, last) => write!(text, "{whole}.{tenths}{last}"),
    };
}

/// Converts the data of a path. Arcs must be half circles.
pub fn path_operators(d: &str) -> String {
    let mut outline = Outline::default();
    let (mut command, mut numbers) = (' ', Vec::new());
    let mut token = String::new();
    let flush = |token: &mut String, numbers: &mut Vec<f32>| {
        numbers.extend(token.parse::<f32>());
        token.clear();
    };
    for c in d.chars().chain(['M']) {
        match c {
            'e' | '0'..='9' => token.push(c),
            '.' if !token.contains('.') => token.push(c),
            '-' if token.is_empty() || token.ends_with('e') => token.push(c),
            '.' | '-' => {
                flush(&mut token, &mut numbers);
                token.push(c);
            }
            c if c.is_ascii_alphabetic() => {
                flush(&mut token, &mut numbers);
                outline.run(command, &numbers);
                numbers.clear();
                command = c;
            }
            _ => flush(&mut token, &mut numbers),
        }
    }
    outline.operators
}

/// Outline in the making.
#[derive(Default)]
struct Outline {
    operators: String,
    /// Current point.
    point: [f32; 2],
    /// Start of the subpath.
    start: [f32; 2],
}

impl Outline {
    /// Executes a command with its numbers.
    fn run(&mut self, command: char, numbers: &[f32]) {
        let from = |at: [f32; 2]| {
            if command.is_ascii_lowercase() {
                at
            } else {
                [0.0, 0.0]
            }
        };
        match command.to_ascii_lowercase() {
            'm' | 'l' => {
                for (i, pair) in numbers.chunks_exact(2).enumerate() {
                    let base = from(self.point);
                    self.to(
                        [base[0] + pair[0], base[1] + pair[1]],
                        command.eq_ignore_ascii_case(&'m') && i == 0,
                    );
                }
            }
            'h' => {
                for x in numbers {
                    self.to([from(self.point)[0] + x, self.point[1]], false);
                }
            }
            'v' => {
                for y in numbers {
                    self.to([self.point[0], from(self.point)[1] + y], false);
                }
            }
            'a' => {
                for arc in numbers.chunks_exact(7) {
                    let base = from(self.point);
                    self.half_circle([base[0] + arc[5], base[1] + arc[6]]);
                }
            }
            'z' => {
                self.operators.push_str(" h");
                self.point = self.start;
            }
            _ => {}
        }
    }

    /// Moves or draws a line to a point.
    fn to(&mut self, point: [f32; 2], is_move: bool) {
        let operator = if is_move { 'm' } else { 'l' };
        if !self.operators.is_empty() {
            self.operators.push(' ');
        }
        for value in point {
            push_number(&mut self.operators, value);
            self.operators.push(' ');
        }
        self.operators.push(operator);
        self.point = point;
        if is_move {
            self.start = point;
        }
    }

    /// A half circle, clockwise from left to right as drawn with y down, in two Bézier curves.
    fn half_circle(&mut self, end: [f32; 2]) {
        /// Handles of a quarter circle in radii: 4/3 (√2 − 1).
        const HANDLE: f32 = 0.5523;
        let [x, y] = self.point;
        let centre = [0.5 * (x + end[0]), 0.5 * (y + end[1])];
        // From the centre to the start, and a quarter turn on.
        let a = [x - centre[0], y - centre[1]];
        let b = [a[1], -a[0]];
        for (u, v) in [(a, b), (b, [-a[0], -a[1]])] {
            let at = |p: f32, q: f32| {
                [
                    centre[0] + p * u[0] + q * v[0],
                    centre[1] + p * u[1] + q * v[1],
                ]
            };
            for point in [at(1.0, HANDLE), at(HANDLE, 1.0), at(0.0, 1.0)] {
                let _ = write!(self.operators, " {} {}", number(point[0]), number(point[1]));
            }
            self.operators.push_str(" c");
        }
        self.point = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_and_absolute_commands_give_the_same_outline() {
        let square = "1 1 m 3 1 l 3 3 l h";
        assert_eq!(path_operators("M1 1h2v2z"), square);
        assert_eq!(path_operators("M1,1L3 1 3 3Z"), square);
        assert_eq!(path_operators("m1 1l2 0l0 2z"), square);
    }

    #[test]
    fn numbers_without_separator_are_read() {
        assert_eq!(path_operators("M.5.5l1-1"), "0.5 0.5 m 1.5 -0.5 l");
    }

    #[test]
    fn numbers_are_as_short_as_possible() {
        let written = [0.0, -0.001, 1.5, 12.345, -3.0, f32::NAN].map(number);
        assert_eq!(written, ["0", "0", "1.5", "12.35", "-3", "0"]);
        for k in -300..300 {
            let value = 0.37 * k as f32;
            let plain = format!("{value:.2}");
            let short = plain.trim_end_matches('0').trim_end_matches('.');
            assert_eq!(number(value), if k == 0 { "0" } else { short });
        }
    }
}
