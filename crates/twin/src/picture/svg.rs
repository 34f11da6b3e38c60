//! Writing SVG.

use std::fmt::Write;

use super::palette::Colour;

/// Decimals of a pixel.
pub(super) const DECIMALS: usize = 2;

/// Farther from the origin nothing is drawn, pixels; beyond it numbers would lose their decimals.
const FARTHEST: f64 = 1e7;

/// A growing SVG document. Coordinates are pixels, y downwards.
#[derive(Debug)]
pub(super) struct Canvas {
    text: String,
}

/// How a path is drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pen {
    pub(super) colour: Colour,
    /// Pixels.
    pub(super) width: f64,
    pub(super) opacity: f64,
    /// Lengths of dash and gap, pixels; none for a continuous line.
    pub(super) dashes: Option<[f64; 2]>,
}

impl Pen {
    pub(super) fn new(colour: Colour, width: f64) -> Self {
        Self { colour, width, opacity: 1.0, dashes: None }
    }

    pub(super) fn faint(self, opacity: f64) -> Self {
        Self { opacity, ..self }
    }

    pub(super) fn dashed(self, dash: f64, gap: f64) -> Self {
        Self { dashes: Some([dash, gap]), ..self }
    }
}

/// The `d` of a path.
#[derive(Debug, Clone)]
pub(super) struct PathData {
    text: String,
    decimals: usize,
}

impl PathData {
    pub(super) fn with_decimals(decimals: usize) -> Self {
        Self { text: String::new(), decimals }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.text.is_empty()
    }

    pub(super) fn move_to(&mut self, x: f64, y: f64) {
        self.point('M', x, y);
    }

    pub(super) fn line_to(&mut self, x: f64, y: f64) {
        self.point('L', x, y);
    }

    fn point(&mut self, letter: char, x: f64, y: f64) {
        self.text.push(letter);
        push_number(&mut self.text, x, self.decimals);
        self.text.push(' ');
        push_number(&mut self.text, y, self.decimals);
    }
}

impl Canvas {
    /// Returns an empty document of this size.
    pub(super) fn new(width: f64, height: f64) -> Self {
        let mut text = String::from("<svg xmlns=\"http://www.w3.org/2000/svg\"");
        // Writing to a string cannot fail, here and below.
        let _ = writeln!(
            text,
            " viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" font-family=\"Inter, Segoe UI, \
             Helvetica, Arial, sans-serif\" stroke-linecap=\"round\" stroke-linejoin=\"round\" \
             fill=\"none\">",
            width.round(),
            height.round()
        );
        Self { text }
    }

    pub(super) fn path(&mut self, data: &PathData, pen: &Pen) {
        if data.is_empty() {
            return;
        }
        let _ = write!(self.text, "<path d=\"{}\"", data.text);
        self.stroke(pen);
        self.text.push_str("/>\n");
    }

    pub(super) fn circle(&mut self, x: f64, y: f64, radius: f64, pen: &Pen) {
        self.ellipse(x, y, [radius, radius], pen);
    }

    pub(super) fn ellipse(&mut self, x: f64, y: f64, radii: [f64; 2], pen: &Pen) {
        let _ = write!(
            self.text,
            "<ellipse cx=\"{}\" cy=\"{}\" rx=\"{}\" ry=\"{}\"",
            number(x),
            number(y),
            number(radii[0]),
            number(radii[1])
        );
        self.stroke(pen);
        self.text.push_str("/>\n");
    }

    pub(super) fn line(&mut self, from: [f64; 2], to: [f64; 2], pen: &Pen) {
        let mut data = PathData::with_decimals(DECIMALS);
        data.move_to(from[0], from[1]);
        data.line_to(to[0], to[1]);
        self.path(&data, pen);
    }

    /// Begins a part of the picture that is cut off at a rectangle from the origin.
    pub(super) fn begin_window(&mut self, width: f64, height: f64) {
        let (width, height) = (number(width), number(height));
        let _ = writeln!(
            self.text,
            "<svg x=\"0\" y=\"0\" width=\"{width}\" height=\"{height}\" overflow=\"hidden\">"
        );
    }

    /// Ends it.
    pub(super) fn end_window(&mut self) {
        self.text.push_str("</svg>\n");
    }

    /// A filled rectangle with rounded corners.
    pub(super) fn swatch(&mut self, at: [f64; 2], size: [f64; 2], colour: Colour) {
        let _ = writeln!(
            self.text,
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"3\" fill=\"{}\"/>",
            number(at[0]),
            number(at[1]),
            number(size[0]),
            number(size[1]),
            colour.hex()
        );
    }

    /// A filled rectangle.
    pub(super) fn cell(&mut self, at: [f64; 2], size: [f64; 2], colour: Colour) {
        let _ = writeln!(
            self.text,
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\"/>",
            number(at[0]),
            number(at[1]),
            number(size[0]),
            number(size[1]),
            colour.hex()
        );
    }

    /// Text whose baseline starts at this place.
    pub(super) fn label(&mut self, x: f64, y: f64, size: f64, text: &str) {
        let (x, y, size) = (number(x), number(y), number(size));
        let _ = write!(self.text, "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\"");
        let _ = write!(self.text, " fill=\"{}\">", super::palette::INK.hex());
        for c in text.chars() {
            match c {
                '<' => self.text.push_str("&lt;"),
                '&' => self.text.push_str("&amp;"),
                c if c.is_control() => {}
                c => self.text.push(c),
            }
        }
        self.text.push_str("</text>\n");
    }

    pub(super) fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }

    fn stroke(&mut self, pen: &Pen) {
        let width = number(pen.width);
        let _ = write!(self.text, " stroke=\"{}\" stroke-width=\"{width}\"", pen.colour.hex());
        if pen.opacity < 1.0 {
            let _ = write!(self.text, " stroke-opacity=\"{}\"", number(pen.opacity));
        }
        if let Some([dash, gap]) = pen.dashes {
            let _ = write!(self.text, " stroke-dasharray=\"{} {}\"", number(dash), number(gap));
        }
    }
}

fn number(value: f64) -> String {
    let mut text = String::new();
    push_number(&mut text, value, DECIMALS);
    text
}

/// Appends a number; places that are not finite become 0.
fn push_number(text: &mut String, value: f64, decimals: usize) {
    let value = if value.is_finite() { value } else { 0.0 };
    text.push_str(&machine::gcode::decimal(value.clamp(-FARTHEST, FARTHEST), decimals));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document() {
        let mut canvas = Canvas::new(100.0, 50.0);
        canvas.line([0.0, 1.234_5], [-2.5, f64::NAN], &Pen::new(Colour([255, 0, 1]), 2.0));
        canvas.label(1.0, 2.0, 12.0, "a < b & c\n");
        let text = canvas.finish();
        assert!(text.contains("viewBox=\"0 0 100 50\""));
        let path = "<path d=\"M0 1.23L-2.5 0\" stroke=\"#ff0001\" stroke-width=\"2\"/>";
        assert!(text.contains(path), "{text}");
        assert!(text.contains(">a &lt; b &amp; c</text>"));
        assert!(text.ends_with("</svg>\n"));
    }
}
