//! Whether two triangles pass through each other or share a piece of plane.
//!
//! Source of the crossing test: T. Möller (1997), "A fast triangle-triangle intersection test",
//! Journal of Graphics Tools 2(2): both triangles cut the common line of their planes in an
//! interval, and they cross where the intervals overlap. Differences: a triangle must reach
//! beyond the other's plane by more than a given depth on both sides, and the intervals must
//! overlap by more than it, so that contact is no crossing.

use nalgebra::{Point3, Vector3};

/// Planes cross when the sine of their angle is above this; below, their common line is noise.
const PARALLEL: f64 = 1e-9;

/// Normals that differ by less than this from opposite belong to walls back to back (0.08°).
const BACK_TO_BACK: f64 = -0.999_999;

/// A triangle with its plane.
pub(super) struct Facet {
    corners: [Point3<f64>; 3],
    /// Of length 1, or 0 when the triangle has no area.
    normal: Vector3<f64>,
}

impl Facet {
    pub(super) fn new(corners: [Point3<f64>; 3]) -> Self {
        let [a, b, c] = corners;
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
        Self { corners, normal }
    }

    /// How far the corners of another triangle lie above this one's plane.
    fn heights(&self, other: &Self) -> [f64; 3] {
        other.corners.map(|p| (p - self.corners[0]).dot(&self.normal))
    }

    /// A point at which the triangles pass through each other by more than `depth`.
    pub(super) fn crossing(&self, other: &Self, depth: f64) -> Option<Point3<f64>> {
        let reaches = |heights: &[f64; 3]| {
            heights.iter().any(|h| *h > depth) && heights.iter().any(|h| *h < -depth)
        };
        let above_self = self.heights(other);
        if !reaches(&above_self) {
            return None;
        }
        let above_other = other.heights(self);
        if !reaches(&above_other) {
            return None;
        }
        let line = self.normal.cross(&other.normal);
        let line = line.try_normalize(PARALLEL)?;
        let mine = self.cut(&above_other, &line)?;
        let others = other.cut(&above_self, &line)?;
        let place = |p: &Point3<f64>| (p - self.corners[0]).dot(&line);
        let from = if place(&mine[0]) > place(&others[0]) { mine[0] } else { others[0] };
        let to = if place(&mine[1]) < place(&others[1]) { mine[1] } else { others[1] };
        (place(&to) - place(&from) > depth).then(|| nalgebra::center(&from, &to))
    }

    /// The ends of the cut with a plane that the corners lie at `heights` above, along `line`.
    fn cut(&self, heights: &[f64; 3], line: &Vector3<f64>) -> Option<[Point3<f64>; 2]> {
        let mut ends: Vec<Point3<f64>> = Vec::with_capacity(3);
        for k in 0..3 {
            let (h, g) = (heights[k], heights[(k + 1) % 3]);
            let (a, b) = (&self.corners[k], &self.corners[(k + 1) % 3]);
            if h == 0.0 {
                ends.push(*a);
            } else if (h > 0.0) != (g > 0.0) && g != 0.0 {
                ends.push(a + (b - a) * (h / (h - g)));
            }
        }
        let place = |p: &&Point3<f64>| (*p - self.corners[0]).dot(line);
        let by_place = |p: &&Point3<f64>, q: &&Point3<f64>| place(p).total_cmp(&place(q));
        let (first, last) = (ends.iter().min_by(by_place)?, ends.iter().max_by(by_place)?);
        Some([*first, *last])
    }

    /// A point near both triangles, when they lie back to back in a plane, to within `depth`, and
    /// overlap there by more than `least_wall` in every direction.
    pub(super) fn common_wall(
        &self,
        other: &Self,
        depth: f64,
        least_wall: f64,
    ) -> Option<Point3<f64>> {
        let lies_in = |heights: [f64; 3]| heights.iter().all(|h| h.abs() <= depth);
        if self.normal.dot(&other.normal) > BACK_TO_BACK || !lies_in(self.heights(other)) {
            return None;
        }
        // Separating axes: the normals of all sides within the plane.
        let across = |facet: &Self, k: usize| {
            let side = facet.corners[(k + 1) % 3] - facet.corners[k];
            side.cross(&self.normal).try_normalize(0.0)
        };
        let axes = (0..3).flat_map(|k| [across(self, k), across(other, k)]).flatten();
        let span = |facet: &Self, axis: &Vector3<f64>| {
            let places = facet.corners.map(|p| (p - self.corners[0]).dot(axis));
            (
                places.iter().copied().fold(f64::INFINITY, f64::min),
                places.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            )
        };
        for axis in axes {
            let (a, b) = (span(self, &axis), span(other, &axis));
            if a.1.min(b.1) - a.0.max(b.0) <= least_wall {
                return None;
            }
        }
        let centre = |facet: &Self| {
            nalgebra::center(
                &facet.corners[0],
                &nalgebra::center(&facet.corners[1], &facet.corners[2]),
            )
        };
        Some(nalgebra::center(&centre(self), &centre(other)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facet(corners: [[f64; 3]; 3]) -> Facet {
        Facet::new(corners.map(Point3::from))
    }

    fn floor() -> Facet {
        facet([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0]])
    }

    #[test]
    fn crossings() {
        let blade =
            |x: f64, z: f64| facet([[x, 1.0, z - 1.0], [x, 3.0, z + 1.0], [x, 5.0, z - 1.0]]);
        assert!(floor().crossing(&blade(2.0, 0.0), 1e-6).is_some());
        let at = blade(2.0, 0.0).crossing(&floor(), 1e-6).unwrap();
        assert!((at - Point3::new(2.0, 3.0, 0.0)).norm() < 1e-9);
        assert!(floor().crossing(&blade(2.0, 1.0), 1e-6).is_none(), "the foot touches");
        assert!(floor().crossing(&blade(2.0, -1.0 + 1e-7), 1e-6).is_none(), "the tip touches");
        assert!(floor().crossing(&blade(9.5, 0.0), 1e-6).is_none(), "beside the triangle");
        let side = facet([[0.0, 1.0, -1.0], [0.0, 3.0, 1.0], [0.0, 5.0, -1.0]]);
        assert!(floor().crossing(&side, 1e-6).is_none(), "along a side");
        let flat = facet([[1.0, 1.0, -1.0]; 3]);
        assert!(floor().crossing(&flat, 1e-6).is_none());
    }

    #[test]
    fn common_walls() {
        let lid = |x: f64, z: f64| facet([[x, 0.0, z], [x, 10.0, z], [x + 10.0, 0.0, z]]);
        assert!(floor().common_wall(&lid(1.0, 0.0), 1e-6, 1e-3).is_some());
        assert!(floor().common_wall(&lid(9.9999, 0.0), 1e-6, 1e-3).is_none(), "end to end");
        assert!(floor().common_wall(&lid(1.0, 1e-3), 1e-6, 1e-3).is_none(), "above");
        assert!(floor().common_wall(&floor(), 1e-6, 1e-3).is_none(), "the same way round");
    }
}
