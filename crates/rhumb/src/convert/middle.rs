//! Where the print of another program stands on its bed.

use std::io::BufRead;

use nalgebra::{Point2, Point3, Vector2};
use plan::route::Kind;

use super::batch::unreadable;
use super::comment::without_comment;
use super::line::{Line, begin};
use super::reader::{ReadError, Reader, commands};
use crate::failure::Failure;

/// How finely arcs are followed, mm; only where they reach counts here.
const ARC_TOLERANCE_MM: f64 = 0.1;

/// Returns the middle of all that a program prints, mm: where a part usually belongs on the axis. What
/// comes before the first layer of a program that announces layers is priming, and does not count.
///
/// # Errors
///
/// As [`convert`](super::convert); `NothingToPrint` when nothing is printed.
pub fn middle(mut source: impl BufRead, name: &str) -> Result<Vector2<f64>, Failure> {
    let mut reader = Reader::new(Vector2::zeros(), Point3::origin(), ARC_TOLERANCE_MM);
    let (mut line, mut strokes) = (Line::default(), Vec::new());
    let mut bounds: Option<[Point2<f64>; 2]> = None;
    let mut has_layers = false;
    begin(&mut source, name)?;
    while line.read(&mut source, name)? {
        let text = line.text();
        let (code, comment) = without_comment(&text);
        strokes.clear();
        let fault = |error: &ReadError| unreadable(name, line.number(), error);
        for command in commands(&code).map_err(|error| fault(&error))? {
            reader.line(command, &mut strokes).map_err(|error| fault(&error))?;
        }
        let begins_layer = comment
            .is_some_and(|comment| comment == "LAYER_CHANGE" || comment.starts_with("LAYER:"));
        if begins_layer && !has_layers {
            (has_layers, bounds) = (true, None);
        }
        for stroke in strokes.iter().filter(|stroke| stroke.kind == Kind::Print) {
            let p = stroke.to.xy();
            let [low, high] = bounds.unwrap_or([p, p]);
            bounds = Some([low.inf(&p), high.sup(&p)]);
        }
    }
    let [low, high] =
        bounds.ok_or_else(|| Failure::new("NothingToPrint", format!("{name} lays no material")))?;
    Ok(nalgebra::center(&low, &high).coords)
}
