//! Arcs about a centre (`G2`, `G3`) become short lines, as a firmware draws them.

use machine::gcode::Command;
use nalgebra::{Point2, Rotation2, Vector2};
use std::f64::consts::TAU;

/// How far a piece may lie from its arc, mm.
const CHORD: f64 = 1e-4;

/// Pieces of one arc at most.
const MOST_PIECES: f64 = 10_000.0;

/// How much farther from the centre an arc may end than it begins, mm: its words are rounded.
pub(crate) const ROUND: f64 = 0.003;

/// The ends of the lines that an arc from here is drawn with, and how far its end lies off its circle.
pub(crate) struct Chords {
    pub(crate) ends: Vec<Point2<f64>>,
    pub(crate) off: f64,
}

/// Draws an arc that has `X`, `Y`, `I` and `J`; `None` without a radius.
pub(crate) fn chords(command: &Command<'_>, from: &Point2<f64>) -> Option<Chords> {
    let word = |letter: u8| command.word(letter);
    let to = Point2::new(word(b'X')?, word(b'Y')?);
    let centre = from + Vector2::new(word(b'I')?, word(b'J')?);
    let (a, b) = (from - centre, to - centre);
    let radius = a.norm();
    if !(radius > 0.0 && radius.is_finite()) {
        return None;
    }
    let turn = a.perp(&b).atan2(a.dot(&b)).rem_euclid(TAU);
    let turn = if turn == 0.0 { TAU } else { turn };
    let turn = if command.is(b'G', 2) { turn - TAU } else { turn };
    let turn = if turn == 0.0 { -TAU } else { turn };
    let step = 2.0 * (1.0 - (CHORD / radius).min(1.0)).acos();
    let pieces = (turn.abs() / step).ceil().clamp(1.0, MOST_PIECES);
    let at = |k: u32| {
        let share = f64::from(k) / pieces;
        let length = 1.0 + (b.norm() / radius - 1.0) * share;
        centre + Rotation2::new(turn * share) * a * length
    };
    let mut ends: Vec<Point2<f64>> = (1..pieces as u32).map(at).collect();
    ends.push(to);
    Some(Chords { ends, off: (b.norm() - radius).abs() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use machine::gcode::parse_line;

    fn drawn(text: &str, from: [f64; 2]) -> Chords {
        chords(&parse_line(text).unwrap().command.unwrap(), &from.into()).unwrap()
    }

    #[test]
    fn arcs_run_their_way_round() {
        let length = |text: &str, from: [f64; 2]| {
            let chords = drawn(text, from);
            let mut last = Point2::from(from);
            let all = chords.ends.iter().map(|end| {
                let step = (end - last).norm();
                last = *end;
                step
            });
            all.sum::<f64>()
        };
        let quarter = TAU / 4.0 * 10.0;
        assert!((length("G3 X0 Y10 I-10 J0", [10.0, 0.0]) - quarter).abs() < 1e-3);
        assert!((length("G2 X0 Y10 I-10 J0", [10.0, 0.0]) - 3.0 * quarter).abs() < 1e-3);
        assert!((length("G3 X10 Y0 I-10 J0", [10.0, 0.0]) - 4.0 * quarter).abs() < 1e-3);
        assert!((length("G2 X10 Y0 I-10 J0", [10.0, 0.0]) - 4.0 * quarter).abs() < 1e-3);
        assert!((drawn("G3 X0 Y10.5 I-10 J0", [10.0, 0.0]).off - 0.5).abs() < 1e-9);
    }
}
