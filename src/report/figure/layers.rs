//! Layers of a drawing: marks of equal appearance as one path, over or under the others.

use super::svg_writer::{PathStyle, SvgWriter};

/// Paths from bottom to top, each with its data in the units of [`SvgWriter::lines`].
#[derive(Clone, Debug, Default)]
pub struct Layers {
    paths: Vec<(PathStyle<'static>, String)>,
}

impl Layers {
    /// Adds marks that may overlap, each over the one before it. Marks of other calls must not overlap these.
    pub fn add(&mut self, marks: impl IntoIterator<Item = (PathStyle<'static>, String)>) {
        let mut lowest = 0;
        for (style, data) in marks {
            if !data.is_empty() {
                lowest = self.layer(lowest, style);
                self.paths[lowest].1.push_str(&data);
            }
        }
    }

    /// Index of the lowest layer of an appearance from `lowest` upwards; a new one on top if there is none.
    fn layer(&mut self, lowest: usize, style: PathStyle<'static>) -> usize {
        let above = self.paths.iter().skip(lowest);
        let found = above.map(|path| path.0).position(|other| other == style);
        found.map_or_else(
            || {
                self.paths.push((style, String::new()));
                self.paths.len() - 1
            },
            |index| lowest + index,
        )
    }

    /// Draws the layers.
    pub fn draw(&self, svg: &mut SvgWriter) {
        for (style, data) in &self.paths {
            svg.lines(data, *style);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLUE: PathStyle = PathStyle {
        stroke: Some(("blue", 2.0)),
        dash: "",
        fill: None,
        fill_opacity: None,
    };
    const BLACK: PathStyle = PathStyle {
        stroke: Some(("black", 1.0)),
        ..BLUE
    };

    fn data(layers: &Layers) -> Vec<&str> {
        layers.paths.iter().map(|path| path.1.as_str()).collect()
    }

    #[test]
    fn marks_alike_are_one_path_and_keep_their_order_within_a_call() {
        let mut layers = Layers::default();
        layers.add([(BLUE, "a".to_owned()), (BLACK, "b".to_owned())]);
        layers.add([(BLACK, "c".to_owned()), (BLUE, String::new())]);
        layers.add([(BLUE, "d".to_owned()), (BLACK, "e".to_owned())]);
        assert_eq!(data(&layers), ["ad", "bce"]);
        layers.add([(BLACK, "f".to_owned()), (BLUE, "g".to_owned())]);
        assert_eq!(data(&layers), ["ad", "bcef", "g"], "blue over black");
    }
}
