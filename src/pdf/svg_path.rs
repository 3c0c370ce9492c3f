//! Data of SVG paths as PDF operators.

use std::fmt::Write;

use super::operand::Number;

/// Converts the data of a path. Arcs must be half circles.
pub fn path_operators(d: &str) -> String {
    let mut outline = Outline::default();
    let (mut command, mut numbers) = (' ', Vec::new());
    let mut rest = d;
    while let Some(first) = rest.chars().next() {
        let length = number_length(rest);
        if length > 0 {
            numbers.extend(rest[..length].parse::<f32>());
            rest = &rest[length..];
            continue;
        }
        if first.is_ascii_alphabetic() {
            outline.run(command, &numbers);
            numbers.clear();
            command = first;
        }
        rest = &rest[first.len_utf8()..];
    }
    outline.run(command, &numbers);
    outline.operators
}

/// Length of the number at the start of a text. A second point or a sign begins the next number.
fn number_length(text: &str) -> usize {
    let mut has_point = false;
    let mut before = b'e';
    for (place, c) in text.bytes().enumerate() {
        match c {
            b'0'..=b'9' | b'e' => {}
            b'.' if !has_point => has_point = true,
            b'-' if before == b'e' => {}
            _ => return place,
        }
        before = c;
    }
    text.len()
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
            // Writing into a String cannot fail.
            let _ = Number(value).write_to(&mut self.operators);
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
                let [x, y] = point.map(Number);
                let _ = write!(self.operators, " {x} {y}");
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
        assert_eq!(path_operators("M5e-1-2.5E"), "0.5 -2.5 m");
    }
}
