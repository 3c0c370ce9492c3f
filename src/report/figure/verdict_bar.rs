//! Small bar that shows the verdicts of one derivative over angle of attack.

use std::fmt::Write;

use crate::tables::TunnelVerdict;

/// A part of the bar with one verdict.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarSegment {
    pub verdict: TunnelVerdict,
    pub from_deg: f64,
    pub to_deg: f64,
}

/// Height of the bar, px.
const HEIGHT: u32 = 14;

/// Top, bottom and colour of a segment. Place and height distinguish verdicts without colour.
fn style(verdict: TunnelVerdict) -> (f64, f64, &'static str) {
    match verdict {
        TunnelVerdict::Agrees => (5.0, 9.0, "#8a8f98"),
        TunnelVerdict::FlightHigher => (0.0, 7.0, "#0060a8"),
        TunnelVerdict::FlightLower => (7.0, 14.0, "#b34700"),
        TunnelVerdict::SignDiffers => (0.0, 14.0, "#7a0143"),
        TunnelVerdict::NothingLearnt => (4.0, 10.0, "#dfe1e5"),
        TunnelVerdict::NoTunnelValue => (6.5, 7.5, "#c9ccd1"),
    }
}

/// Draws the segments as SVG; empty if there are none or the range of angle of attack is.
#[must_use]
pub fn draw(segments: &[BarSegment], (from_deg, to_deg): (f64, f64), width: u32) -> String {
    let scale = f64::from(width) / (to_deg - from_deg);
    if segments.is_empty() || !scale.is_finite() || scale <= 0.0 {
        return String::new();
    }
    let x = |alpha_deg: f64| ((alpha_deg - from_deg) * scale).clamp(0.0, f64::from(width));
    let mut svg = format!(
        r#"<svg class="strip inline" viewBox="0 0 {width} {HEIGHT}" width="{width}" height="{HEIGHT}" aria-hidden="true">"#
    );
    for segment in segments {
        let (top, bottom, colour) = style(segment.verdict);
        let (left, right) = (x(segment.from_deg), x(segment.to_deg));
        // Writing into a String cannot fail.
        let _ = write!(
            svg,
            r#"<rect x="{left:.1}" y="{top}" width="{:.1}" height="{}" fill="{colour}"/>"#,
            right - left,
            bottom - top
        );
    }
    svg.push_str("</svg>");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_fill_the_bar_to_scale() {
        let segment = |verdict, from_deg, to_deg| BarSegment {
            verdict,
            from_deg,
            to_deg,
        };
        let segments = [
            segment(TunnelVerdict::Agrees, 5.0, 15.0),
            segment(TunnelVerdict::FlightHigher, 15.0, 35.0),
        ];
        let svg = draw(&segments, (5.0, 35.0), 120);
        assert_eq!(svg.matches("<rect").count(), 2);
        assert!(svg.contains(r#"x="0.0" y="5" width="40.0""#), "{svg}");
        assert!(svg.contains(r#"x="40.0" y="0" width="80.0""#), "{svg}");
    }

    #[test]
    fn nothing_compared_gives_no_bar() {
        assert_eq!(draw(&[], (0.0, 1.0), 100), "");
    }
}
