//! Runs of short lines on a circle become one arc, for firmwares that draw arcs.
//!
//! An arc takes the place of level lines that follow each other at one speed with one bead, all of whose
//! ends and middles lie within the tolerance of one circle; it begins and ends where they do, and feeds
//! the same filament.

use machine::program::{Arc, Move, Step};
use nalgebra::{Point2, Point3, Vector2};

/// Fewest lines that become an arc.
const FEWEST: usize = 3;

/// Largest turn of an arc, radians: a little less than a whole one, whose ends would say nothing of it.
const LARGEST_TURN: f64 = 6.0;

/// Largest radius, mm: beyond it, rounding of the centre moves the arc.
const LARGEST_RADIUS_MM: f64 = 1000.0;

/// Speeds, and filament for each mm, that differ by less than this share are one: words are rounded.
const ALIKE: f64 = 5e-3;

/// Places of the centre, as the program says it, in a millimetre.
const PLACES: f64 = 1000.0;

/// Puts arcs in place of lines within `tolerance` (mm); the nozzle stands at `at` before the first step.
#[must_use]
pub fn with_arcs(steps: Vec<Step>, at: Point3<f64>, tolerance: f64) -> Vec<Step> {
    let mut all = Vec::with_capacity(steps.len());
    let mut run: Vec<Move> = Vec::new();
    let (mut from, mut at) = (at, at);
    for step in steps {
        let Step::Move(motion) = step else {
            settle(&mut all, &mut run, &from, tolerance);
            from = at;
            all.push(step);
            continue;
        };
        let goes_on = run.last().is_none_or(|last| alike(last, &motion));
        if !goes_on || !curves(&motion, &at) {
            settle(&mut all, &mut run, &from, tolerance);
            from = at;
        }
        if curves(&motion, &at) {
            run.push(motion);
        } else {
            all.push(Step::Move(motion));
            from = motion.at;
        }
        at = motion.at;
    }
    settle(&mut all, &mut run, &from, tolerance);
    all
}

/// Whether a move may be a part of an arc.
fn curves(motion: &Move, from: &Point3<f64>) -> bool {
    motion.extrudes() && motion.at.z == from.z
}

fn alike(a: &Move, b: &Move) -> bool {
    let close = |x: f64, y: f64| (x - y).abs() <= ALIKE * x.abs().max(y.abs());
    close(a.path / a.duration, b.path / b.duration)
        && close(a.filament / a.path, b.filament / b.path)
}

/// Writes a run that begins at `from`, its circles as arcs, and empties it.
fn settle(all: &mut Vec<Step>, run: &mut Vec<Move>, from: &Point3<f64>, tolerance: f64) {
    let points: Vec<Point2<f64>> =
        std::iter::once(from.xy()).chain(run.iter().map(|motion| motion.at.xy())).collect();
    let mut k = 0;
    while k < run.len() {
        let Some((count, arc)) = longest(&points[k..], &run[k..], tolerance) else {
            all.push(Step::Move(run[k]));
            k += 1;
            continue;
        };
        all.push(Step::Arc(arc));
        k += count;
    }
    run.clear();
}

/// The longest arc at the begin of a run, and how many lines it takes.
fn longest(points: &[Point2<f64>], run: &[Move], tolerance: f64) -> Option<(usize, Arc)> {
    let mut found = None;
    let mut count = FEWEST;
    while count <= run.len() {
        let Some(circle) = Circle::through(&points[..=count], tolerance) else { break };
        found = Some((count, circle));
        count += 1;
    }
    let (count, circle) = found?;
    let moves = &run[..count];
    let last = moves.last()?;
    let path = circle.radius * circle.turn.abs();
    let lines: f64 = moves.iter().map(|motion| motion.path).sum();
    let duration: f64 = moves.iter().map(|motion| motion.duration).sum();
    let motion = Move {
        to: last.to,
        at: last.at,
        filament: moves.iter().map(|motion| motion.filament).sum(),
        path,
        duration: duration * path / lines,
    };
    Some((count, Arc { motion, centre: circle.centre, clockwise: circle.turn < 0.0 }))
}

struct Circle {
    centre: Point2<f64>,
    radius: f64,
    /// From the first point to the last, counter-clockwise, radians.
    turn: f64,
}

impl Circle {
    /// The circle that a line through points follows within the tolerance, one way round.
    fn through(points: &[Point2<f64>], tolerance: f64) -> Option<Self> {
        let (first, last) = (points.first()?, points.last()?);
        let centre = centre_of(first, &points[points.len() / 2], last)?;
        // As the program will say it.
        let aside = (centre - first).map(|c| (c * PLACES).round() / PLACES);
        let centre = first + aside;
        let radius = aside.norm();
        if radius > LARGEST_RADIUS_MM || radius <= tolerance {
            return None;
        }
        let off = |p: &Point2<f64>| ((p - centre).norm() - radius).abs();
        let is_near = points.iter().all(|p| off(p) <= tolerance)
            && points
                .windows(2)
                .all(|pair| off(&nalgebra::center(&pair[0], &pair[1])) <= tolerance);
        if !is_near {
            return None;
        }
        let angle = |pair: &[Point2<f64>]| -> f64 {
            let [a, b]: [Vector2<f64>; 2] = [pair[0] - centre, pair[1] - centre];
            a.perp(&b).atan2(a.dot(&b))
        };
        let turns: Vec<f64> = points.windows(2).map(angle).collect();
        let turn: f64 = turns.iter().sum();
        let is_one_way = turns.iter().all(|t| *t != 0.0 && t.signum() == turn.signum());
        (is_one_way && turn.abs() <= LARGEST_TURN).then_some(Self { centre, radius, turn })
    }
}

/// The centre of the circle through three points; none where they lie in a line.
fn centre_of(a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>) -> Option<Point2<f64>> {
    let (u, v) = (b - a, c - a);
    let twice = 2.0 * u.perp(&v);
    let aside = Vector2::new(
        v.y * u.norm_squared() - u.y * v.norm_squared(),
        u.x * v.norm_squared() - v.x * u.norm_squared(),
    ) / twice;
    (aside.x.is_finite() && aside.y.is_finite()).then(|| a + aside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use machine::program::Joints;

    fn to(p: Point2<f64>, from: Point2<f64>, speed: f64) -> Step {
        let path = (p - from).norm();
        Step::Move(Move {
            to: Joints { s: 0.0, turn: Default::default(), z: 0.2 },
            at: Point3::new(p.x, p.y, 0.2),
            filament: 0.03 * path,
            path,
            duration: path / speed,
        })
    }

    /// A straight line onto a circle of 10 mm, three quarters of it in chords, and a line away.
    fn lines(n: u32) -> (Vec<Step>, f64) {
        let mut points = vec![Point2::new(30.0, 0.0), Point2::new(10.0, 0.0)];
        let on = |k: u32| {
            let angle = 1.5 * std::f64::consts::PI * f64::from(k) / f64::from(n);
            Point2::new(10.0 * angle.cos(), 10.0 * angle.sin())
        };
        points.extend((1..=n).map(on));
        points.push(Point2::new(-20.0, -30.0));
        let steps = points.windows(2).map(|pair| to(pair[1], pair[0], 40.0)).collect();
        let length: f64 = points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
        (steps, 0.03 * length)
    }

    #[test]
    fn chords_of_a_circle_become_one_arc_and_keep_their_filament() {
        let start = Point3::new(30.0, 0.0, 0.2);
        let (steps, fed) = lines(90);
        let fitted = with_arcs(steps, start, 0.005);
        let [Step::Move(_), Step::Arc(arc), Step::Move(last)] = fitted.as_slice() else {
            panic!("{fitted:?}")
        };
        assert!(arc.centre.coords.norm() < 1e-3 && !arc.clockwise);
        assert!((arc.motion.path - 15.0 * std::f64::consts::PI).abs() < 0.01);
        assert!((arc.motion.path / arc.motion.duration - 40.0).abs() < 1e-9);
        assert_eq!(arc.motion.at.xy(), Point2::new(arc.motion.at.x, -10.0));
        let all = arc.motion.filament + last.filament + 0.6;
        assert!((all - fed).abs() < 1e-9);
        // Chords whose middles are too far from the circle are corners.
        let (coarse, _) = lines(20);
        let same = with_arcs(coarse.clone(), start, 0.005);
        assert_eq!(same, coarse);
    }

    #[test]
    fn other_speeds_beads_and_heights_end_an_arc() {
        let start = Point3::new(30.0, 0.0, 0.2);
        let (mut steps, _) = lines(90);
        if let Step::Move(motion) = &mut steps[45] {
            motion.duration *= 2.0;
        }
        let fitted = with_arcs(steps, start, 0.005);
        let arcs = fitted.iter().filter(|step| matches!(step, Step::Arc(_))).count();
        assert_eq!((arcs, fitted.len()), (2, 5));
        let (mut steps, _) = lines(90);
        steps.insert(45, Step::Fan(1.0));
        let fitted = with_arcs(steps, start, 0.005);
        assert_eq!(fitted.iter().filter(|step| matches!(step, Step::Arc(_))).count(), 2);
    }
}
