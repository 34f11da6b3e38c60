//! Arcs of other programs (`G2`, `G3`): circles and helices about z become short lines.
//!
//! An arc goes by its centre (`I`, `J`, from the begin) or by its radius (`R`; negative for the
//! longer of the two arcs). Without an end in the plane it is a whole circle.

use nalgebra::{Point2, Point3, Rotation2, Vector2};
use std::f64::consts::TAU;

/// An arc as it is written, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Arc {
    /// Where it begins.
    pub(super) from: Point3<f64>,
    /// Where it ends.
    pub(super) to: Point3<f64>,
    /// `I` and `J`.
    pub(super) centre: Option<Vector2<f64>>,
    /// `R`.
    pub(super) radius: Option<f64>,
    /// Whether it runs clockwise seen from above (`G2`).
    pub(super) clockwise: bool,
}

/// An end may be this far off its circle, mm: some slicers write two decimals.
const MOST_OFF_MM: f64 = 0.05;

/// Pieces of one arc at most.
const MOST_PIECES: f64 = 10_000.0;

impl Arc {
    /// Returns the ends of lines that stay within `tolerance` mm of the arc; `None` for what is no
    /// arc.
    pub(super) fn points(&self, tolerance: f64) -> Option<Vec<Point3<f64>>> {
        let centre = self.middle()?;
        let (a, b) = (self.from.xy() - centre, self.to.xy() - centre);
        let radius = a.norm();
        // Also what is not a number ends here.
        let is_circle = radius > 0.0 && (b.norm() - radius).abs() <= MOST_OFF_MM;
        if !is_circle {
            return None;
        }
        let sweep = self.sweep(&a, &b);
        // A chord of angle φ is r·(1 − cos(φ/2)) from its arc.
        let step = 2.0 * (1.0 - (tolerance / radius).min(1.0)).acos();
        let pieces = (sweep.abs() / step).ceil().clamp(1.0, MOST_PIECES);
        let rise = self.to.z - self.from.z;
        let at = |k: u32| {
            let share = f64::from(k) / pieces;
            // The radius runs from that of the begin to that of the end.
            let length = 1.0 + (b.norm() / radius - 1.0) * share;
            let xy = centre + Rotation2::new(sweep * share) * a * length;
            Point3::new(xy.x, xy.y, self.from.z + rise * share)
        };
        let mut points: Vec<Point3<f64>> = (1..pieces as u32).map(at).collect();
        points.push(self.to);
        Some(points)
    }

    fn middle(&self) -> Option<Point2<f64>> {
        if let Some(offset) = self.centre {
            return Some(self.from.xy() + offset);
        }
        let radius = self.radius?;
        let chord = self.to.xy() - self.from.xy();
        let half = chord.norm() / 2.0;
        let is_possible = half > 0.0 && half <= radius.abs() + MOST_OFF_MM;
        if !is_possible {
            return None;
        }
        let height = (radius * radius - half * half).max(0.0).sqrt();
        // Left of the chord for the short counter-clockwise arc.
        let left = Vector2::new(-chord.y, chord.x) / (2.0 * half);
        let side = if self.clockwise == (radius < 0.0) { 1.0 } else { -1.0 };
        Some(nalgebra::center(&self.from.xy(), &self.to.xy()) + left * height * side)
    }

    fn sweep(&self, a: &Vector2<f64>, b: &Vector2<f64>) -> f64 {
        if self.from.xy() == self.to.xy() {
            return if self.clockwise { -TAU } else { TAU };
        }
        let turn = a.perp(b).atan2(a.dot(b)).rem_euclid(TAU);
        if self.clockwise { turn - TAU } else { turn }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(from: [f64; 2], to: [f64; 2], clockwise: bool) -> Arc {
        let (from, to) = (Point3::new(from[0], from[1], 1.0), Point3::new(to[0], to[1], 2.0));
        Arc { from, to, centre: None, radius: None, clockwise }
    }

    fn length(arc: &Arc) -> f64 {
        let mut last = arc.from.xy();
        arc.points(1e-4)
            .unwrap()
            .iter()
            .map(|p| {
                let step = (p.xy() - last).norm();
                last = p.xy();
                step
            })
            .sum()
    }

    #[test]
    fn quarters_and_three_quarters_by_centre_and_by_radius() {
        let quarter = TAU / 4.0 * 10.0;
        let by_centre =
            Arc { centre: Some(Vector2::new(-10.0, 0.0)), ..arc([10.0, 0.0], [0.0, 10.0], false) };
        assert!((length(&by_centre) - quarter).abs() < 1e-2);
        let long = Arc { clockwise: true, ..by_centre };
        assert!((length(&long) - 3.0 * quarter).abs() < 1e-2);
        for (radius, clockwise, wanted) in [
            (10.0, false, quarter),
            (10.0, true, quarter),
            (-10.0, false, 3.0 * quarter),
            (-10.0, true, 3.0 * quarter),
        ] {
            let by_radius =
                Arc { radius: Some(radius), ..arc([10.0, 0.0], [0.0, 10.0], clockwise) };
            assert!((length(&by_radius) - wanted).abs() < 1e-2, "{radius} {clockwise}");
        }
        let middle = Arc { radius: Some(10.0), ..arc([10.0, 0.0], [0.0, 10.0], false) };
        assert!(middle.middle().unwrap().coords.norm() < 1e-9, "counter-clockwise, about 0, 0");
    }

    #[test]
    fn a_helix_rises_evenly_and_lines_stay_near() {
        let whole =
            Arc { centre: Some(Vector2::new(-5.0, 0.0)), ..arc([5.0, 0.0], [5.0, 0.0], true) };
        let points = whole.points(0.002).unwrap();
        let mut last = whole.from;
        for p in &points {
            let sagitta = 5.0 - nalgebra::center(&last.xy(), &p.xy()).coords.norm();
            assert!(sagitta <= 0.002 + 1e-12);
            assert!(p.z > last.z);
            last = *p;
        }
        assert_eq!(last, whole.to);
        assert!(points[points.len() / 4].y < -4.9, "clockwise");
    }

    #[test]
    fn what_is_no_arc_is_none() {
        assert!(arc([0.0, 0.0], [1.0, 0.0], false).points(0.01).is_none());
        let off =
            Arc { centre: Some(Vector2::new(3.0, 0.0)), ..arc([0.0, 0.0], [1.0, 0.0], false) };
        assert!(off.points(0.01).is_none());
        let short = Arc { radius: Some(0.3), ..arc([0.0, 0.0], [1.0, 0.0], false) };
        assert!(short.points(0.01).is_none());
        let none = Arc { radius: Some(f64::NAN), ..arc([0.0, 0.0], [1.0, 0.0], false) };
        assert!(none.points(0.01).is_none());
    }
}
