//! Ways that keep clear of the rotation axis.
//!
//! Near the axis a straight line asks for a bed speed of `v/d`; through it, for a half turn in no
//! time, and firmwares abort or jerk. A way that would enter the disc of the clearance goes in up to
//! its rim, round it on the nearer side, and out.
//!
//! All points are on the bed, mm from the axis.

use nalgebra::{Point2, Vector2, distance};

/// A piece of a way that keeps clear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Piece {
    /// Straight to a point.
    Line(Point2<f64>),
    /// Round the axis at the clearance, by this angle (radians, counter-clockwise positive), to a
    /// point.
    Arc(f64, Point2<f64>),
}

impl Piece {
    /// Where it ends.
    #[must_use]
    pub fn end(&self) -> Point2<f64> {
        match self {
            Self::Line(to) | Self::Arc(_, to) => *to,
        }
    }
}

/// How much nearer than the clearance a line may pass by rounding, as a share of it.
const SLACK: f64 = 1e-9;

/// Returns the point itself, or the one on the rim of the clearance in its direction; `from`
/// decides for a point on the axis.
#[must_use]
pub fn outside(p: Point2<f64>, from: Point2<f64>, clearance: f64) -> Point2<f64> {
    let radius = p.coords.norm();
    if radius >= clearance {
        return p;
    }
    let direction = if radius > 0.0 { p.coords } else { from.coords };
    match direction.try_normalize(0.0) {
        Some(unit) => Point2::from(unit * clearance),
        None => Point2::new(clearance, 0.0),
    }
}

/// Returns the distance of the segment `a`–`b` from the axis.
#[must_use]
pub fn distance_to_axis(a: &Point2<f64>, b: &Point2<f64>) -> f64 {
    geom::polyline::distance_to_segment(a, b, &Point2::origin())
}

/// Returns the way along the line from `a` to `b`, begun at `from`: where the line lies within the
/// clearance, along its rim instead, from where it enters to where it leaves. An end that lies within is
/// taken to the rim in its own direction, and `from`, where the nozzle stands, is `a` or the place on the
/// rim to which `a` was taken. So what is left of the line is kept as it is.
#[must_use]
pub fn keep_clear(from: &Point2<f64>, [a, b]: [&Point2<f64>; 2], clearance: f64) -> Vec<Piece> {
    if distance_to_axis(a, b) >= clearance * (1.0 - SLACK) {
        return vec![Piece::Line(*b)];
    }
    let unit = (b - a).try_normalize(0.0).unwrap_or_else(nalgebra::zero);
    let along = -a.coords.dot(&unit);
    let foot = a + unit * along;
    let half_chord = (clearance * clearance - foot.coords.norm_squared()).max(0.0).sqrt();
    let is_outside = |p: &Point2<f64>| p.coords.norm() >= clearance * (1.0 - SLACK);
    let entry = if is_outside(a) { on_rim(foot - unit * half_chord, clearance) } else { *from };
    let exit = if is_outside(b) {
        on_rim(foot + unit * half_chord, clearance)
    } else {
        outside(*b, entry, clearance)
    };
    // Round the side on which the line passes; exactly through the middle, counter-clockwise.
    let sweep = entry.coords.perp(&exit.coords).atan2(entry.coords.dot(&exit.coords));
    let passes_left = unit.perp(&(Point2::origin() - foot)) > 0.0;
    let sweep = if sweep.abs() > std::f64::consts::PI - SLACK {
        sweep.abs() * if passes_left || foot.coords == Vector2::zeros() { 1.0 } else { -1.0 }
    } else {
        sweep
    };
    let mut pieces = Vec::with_capacity(3);
    let is_apart = |p: &Point2<f64>, q: &Point2<f64>| distance(p, q) > clearance * SLACK;
    if is_apart(from, &entry) {
        pieces.push(Piece::Line(entry));
    }
    if is_apart(&entry, &exit) {
        pieces.push(Piece::Arc(sweep, exit));
    }
    if is_outside(b) && is_apart(&exit, b) {
        pieces.push(Piece::Line(*b));
    } else if pieces.is_empty() {
        // Nowhere to go; but the height may change.
        pieces.push(Piece::Line(exit));
    }
    pieces
}

/// Returns where the line from `a` to `b` enters the clearance and where it leaves it, as shares of the
/// line; `None` for an end that lies within.
#[must_use]
pub fn crossings_of_rim([a, b]: [&Point2<f64>; 2], clearance: f64) -> [Option<f64>; 2] {
    let way = b - a;
    let square = way.norm_squared();
    let is_outside = |p: &Point2<f64>| p.coords.norm() >= clearance * (1.0 - SLACK);
    if square == 0.0 {
        return [is_outside(a).then_some(0.0), is_outside(b).then_some(1.0)];
    }
    let foot = -a.coords.dot(&way) / square;
    let from_axis = (a + way * foot).coords.norm_squared();
    let half_chord = ((clearance * clearance - from_axis).max(0.0) / square).sqrt();
    let share = |share: f64| share.clamp(0.0, 1.0);
    [
        is_outside(a).then(|| share(foot - half_chord)),
        is_outside(b).then(|| share(foot + half_chord)),
    ]
}

fn on_rim(p: Point2<f64>, clearance: f64) -> Point2<f64> {
    Point2::from(p.coords.normalize() * clearance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn lines_cross_the_rim_where_they_enter_and_leave() {
        let cross =
            |a: [f64; 2], b: [f64; 2]| crossings_of_rim([&Point2::from(a), &Point2::from(b)], 0.5);
        assert_eq!(cross([-1.0, 0.0], [1.0, 0.0]), [Some(0.25), Some(0.75)]);
        assert_eq!(cross([-1.0, 0.3], [1.0, 0.3]), [Some(0.3), Some(0.7)]);
        assert_eq!(cross([0.1, 0.0], [0.9, 0.0]), [None, Some(0.5)]);
        assert_eq!(cross([0.9, 0.0], [0.1, 0.0]), [Some(0.5), None]);
        assert_eq!(cross([0.1, 0.0], [0.0, 0.2]), [None, None]);
        assert_eq!(cross([0.6, 0.0], [0.6, 0.0]), [Some(0.0), Some(1.0)]);
    }

    fn points(way: &[Piece], from: Point2<f64>) -> Vec<Point2<f64>> {
        let mut list = vec![from];
        for piece in way {
            if let Piece::Arc(sweep, _) = piece {
                let start = list.last().unwrap().coords;
                for k in 1..=32 {
                    let angle = sweep * f64::from(k) / 32.0;
                    list.push(Point2::from(nalgebra::Rotation2::new(angle) * start));
                }
            }
            list.push(piece.end());
        }
        list
    }

    #[test]
    fn far_lines_are_left_alone() {
        let (a, b) = (Point2::new(-5.0, 1.0), Point2::new(5.0, 1.0));
        assert_eq!(keep_clear(&a, [&a, &b], 0.5), [Piece::Line(b)]);
        let before = Point2::new(-2.0, 0.1);
        assert_eq!(keep_clear(&a, [&a, &before], 0.5).len(), 1, "it ends before");
    }

    #[test]
    fn no_way_comes_nearer_than_the_clearance() {
        for k in 0..200 {
            let angle = f64::from(k) * 0.37;
            let offset = f64::from(k % 21 - 10) * 0.05;
            let unit = Vector2::new(angle.cos(), angle.sin());
            let side = Vector2::new(-unit.y, unit.x) * offset;
            let (a, b) = (Point2::from(side - unit * 4.0), Point2::from(side + unit * 7.0));
            let way = keep_clear(&a, [&a, &b], 0.4);
            for p in points(&way, a) {
                assert!(p.coords.norm() >= 0.4 * (1.0 - 1e-6), "offset {offset}: {p}");
            }
            assert_eq!(way.last().unwrap().end(), b);
            // It passes on the side of the line, which is the shorter one.
            if let Some(Piece::Arc(sweep, _)) = way.iter().find(|p| matches!(p, Piece::Arc(..))) {
                assert!(sweep.abs() <= PI + 1e-9 && (offset == 0.0 || sweep * offset < 0.0));
            }
        }
    }

    #[test]
    fn a_line_that_begins_or_ends_within_is_kept_outside() {
        // The side of a bar past the axis, with its corner within the clearance.
        let (corner, end) = (Point2::new(0.375, 0.375), Point2::new(0.375, 30.0));
        let from = outside(corner, end, 0.8);
        let way = keep_clear(&from, [&corner, &end], 0.8);
        let leaves = Point2::new(0.375, (0.64_f64 - 0.375 * 0.375).sqrt());
        assert!(
            matches!(way[0], Piece::Arc(sweep, to) if sweep > 0.0 && (to - leaves).norm() < 1e-12)
        );
        assert_eq!(way[1..], [Piece::Line(end)]);
        let back = keep_clear(&end, [&end, &corner], 0.8);
        assert!((back[0].end() - leaves).norm() < 1e-12);
        assert!((back[1].end() - from).norm() < 1e-12 && back.len() == 2);
        // Wholly within: along the rim, and nowhere at all straight towards the axis.
        let inner = Point2::new(0.3, 0.3);
        let nowhere = keep_clear(&from, [&corner, &inner], 0.8);
        assert!(nowhere.len() == 1 && (nowhere[0].end() - from).norm() < 1e-12);
        assert_eq!(keep_clear(&from, [&corner, &Point2::new(-0.1, 0.1)], 0.8).len(), 1);
    }

    #[test]
    fn points_inside_move_to_the_rim() {
        let from = Point2::new(3.0, 4.0);
        assert_eq!(outside(from, from, 0.5), from);
        assert!((outside(Point2::new(0.1, 0.0), from, 0.5) - Point2::new(0.5, 0.0)).norm() < 1e-12);
        assert!((outside(Point2::origin(), from, 0.5) - Point2::new(0.3, 0.4)).norm() < 1e-12);
        assert_eq!(outside(Point2::origin(), Point2::origin(), 0.5), Point2::new(0.5, 0.0));
    }
}
