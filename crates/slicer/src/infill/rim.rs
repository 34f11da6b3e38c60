//! Stretches of rim, without what lies on turns of a spiral.
//!
//! A rim that runs round the axis leads along a turn. Laid where that turn passes less than half a
//! spacing away it would take more of the turn's place than of the space between; where it is farther, it
//! is the other way round.

use geom::polyline::length;
use nalgebra::{Point2, center};

use super::spiral::Turns;

/// What is shorter than this, in spacings, is laid all the same: a line is not lifted off for it. Rims
/// across turns lead from one to the next, and so past each within half a spacing.
const LEAST_IN_SPACINGS: f64 = 10.0;

/// Steps in a spacing in which a rim is looked at.
const STEPS_IN_SPACING: f64 = 2.0;

/// Returns what is laid of a line whose pieces are by turns of the rim and of the spiral: it ends where its
/// rim lies on a turn, and begins again behind.
pub(super) fn without_turns(pieces: &[Vec<Point2<f64>>], turns: &Turns) -> Vec<Vec<Point2<f64>>> {
    let mut lines = vec![Vec::new()];
    for (k, piece) in pieces.iter().enumerate() {
        if k % 2 == 1 {
            lines.last_mut().into_iter().for_each(|line| go_on(line, piece));
            continue;
        }
        let from = k.checked_sub(1).and_then(|k| pieces[k].last());
        let to = pieces.get(k + 1).and_then(|next| next.first());
        let stretch: Vec<Point2<f64>> = from.into_iter().chain(piece).chain(to).copied().collect();
        for (is_laid, part) in parts(&stretch, turns) {
            match lines.last_mut().filter(|_| is_laid) {
                Some(line) => go_on(line, &part),
                None => lines.push(Vec::new()),
            }
        }
    }
    lines.retain(|line| line.len() > 1);
    lines
}

/// Appends points to a line that ends with the first of them.
fn go_on(line: &mut Vec<Point2<f64>>, points: &[Point2<f64>]) {
    let known = usize::from(line.last().is_some() && line.last() == points.first());
    line.extend(&points[known..]);
}

/// Returns the parts of a stretch of rim in order, and of each whether it is laid.
fn parts(stretch: &[Point2<f64>], turns: &Turns) -> Vec<(bool, Vec<Point2<f64>>)> {
    let least = LEAST_IN_SPACINGS * turns.pitch();
    let mut parts = Vec::new();
    if length(stretch) < least {
        parts.push((true, stretch.to_vec()));
        return parts;
    }
    for [a, b] in steps(stretch, turns.pitch() / STEPS_IN_SPACING) {
        append(&mut parts, !turns.pass(&center(&a, &b)), &[a, b]);
    }
    let mut kept = Vec::new();
    for (is_laid, points) in parts {
        append(&mut kept, is_laid || length(&points) < least, &points);
    }
    kept
}

/// Lets the last part go on where both are laid or both are not.
fn append(parts: &mut Vec<(bool, Vec<Point2<f64>>)>, is_laid: bool, points: &[Point2<f64>]) {
    match parts.last_mut() {
        Some((last, line)) if *last == is_laid => line.extend(&points[1..]),
        _ => parts.push((is_laid, points.to_vec())),
    }
}

/// The sides of a line, in steps of no more than a length.
fn steps(line: &[Point2<f64>], longest: f64) -> impl Iterator<Item = [Point2<f64>; 2]> {
    line.windows(2).flat_map(move |side| {
        let (a, along) = (side[0], side[1] - side[0]);
        let count = (along.norm() / longest).ceil().max(1.0);
        let at = move |k: u32| a + along * (f64::from(k) / count);
        (0..count as u32).map(move |k| [at(k), at(k + 1)])
    })
}
