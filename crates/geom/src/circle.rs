//! The smallest circle around a set of points.
//!
//! Source: E. Welzl (1991), "Smallest enclosing disks (balls and ellipsoids)", in the iterative
//! move-to-front form. Differences: the points go through their convex hull first, and are taken
//! in hull order instead of a random one, so that the answer does not depend on chance. On a hull
//! of n points the worst case is O(n³), in practice a few passes.

use nalgebra::{Point2, distance};

/// A circle in the plane, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// The centre.
    pub centre: Point2<f64>,
    /// The radius, not negative.
    pub radius: f64,
}

/// How much farther than the radius a point may lie and still count as inside, as a share of the
/// radius. Below rounding (about 1e-15) the search would never end; above 1e-9 the circle would
/// visibly miss points of a part of 1 m.
const SLACK: f64 = 1e-12;

impl Circle {
    fn holds(&self, p: &Point2<f64>) -> bool {
        distance(&self.centre, p) <= self.radius * (1.0 + SLACK)
    }

    fn across(a: &Point2<f64>, b: &Point2<f64>) -> Self {
        Self { centre: nalgebra::center(a, b), radius: distance(a, b) / 2.0 }
    }

    /// The circle through three points; the widest pair's circle when they are collinear.
    fn through(a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>) -> Self {
        let (u, v) = (b - a, c - a);
        let twice_cross = 2.0 * u.perp(&v);
        if twice_cross == 0.0 {
            let pairs = [Self::across(a, b), Self::across(b, c), Self::across(a, c)];
            return pairs.into_iter().max_by(|p, q| p.radius.total_cmp(&q.radius)).expect("three");
        }
        let (uu, vv) = (u.norm_squared(), v.norm_squared());
        let offset = nalgebra::Vector2::new(v.y * uu - u.y * vv, u.x * vv - v.x * uu);
        let centre = a + offset / twice_cross;
        // The farthest of the three, so that rounding never leaves one outside.
        let radius = [a, b, c].iter().map(|p| distance(&centre, p)).fold(0.0, f64::max);
        Self { centre, radius }
    }
}

/// Returns the smallest circle that holds all `points`; `None` when there are none.
#[must_use]
pub fn smallest_around(points: &[Point2<f64>]) -> Option<Circle> {
    let hull = convex_hull(points);
    let first = hull.first()?;
    let mut circle = Circle { centre: *first, radius: 0.0 };
    for (i, p) in hull.iter().enumerate() {
        if !circle.holds(p) {
            circle = with_one_on_rim(&hull[..i], p);
        }
    }
    Some(circle)
}

fn with_one_on_rim(points: &[Point2<f64>], rim: &Point2<f64>) -> Circle {
    let mut circle = Circle { centre: *rim, radius: 0.0 };
    for (i, p) in points.iter().enumerate() {
        if !circle.holds(p) {
            circle = with_two_on_rim(&points[..i], rim, p);
        }
    }
    circle
}

fn with_two_on_rim(points: &[Point2<f64>], a: &Point2<f64>, b: &Point2<f64>) -> Circle {
    let mut circle = Circle::across(a, b);
    for p in points {
        if !circle.holds(p) {
            circle = Circle::through(a, b, p);
        }
    }
    circle
}

/// Returns the convex hull, counter-clockwise, without collinear points, starting at the
/// leftmost (then lowest) point. Andrew's monotone chain.
#[must_use]
pub fn convex_hull(points: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let mut sorted = points.to_vec();
    sorted.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let mut hull: Vec<Point2<f64>> = Vec::new();
    let chain = |hull: &mut Vec<Point2<f64>>, base: usize, p: Point2<f64>| {
        while hull.len() >= base + 2 {
            let (a, b) = (hull[hull.len() - 2], hull[hull.len() - 1]);
            if (b - a).perp(&(p - b)) > 0.0 {
                break;
            }
            hull.pop();
        }
        hull.push(p);
    };
    for p in &sorted {
        chain(&mut hull, 0, *p);
    }
    let lower = hull.len() - 1;
    for p in sorted.iter().rev().skip(1) {
        chain(&mut hull, lower, *p);
    }
    hull.pop();
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn square_and_triangle() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]].map(Point2::from);
        let circle = smallest_around(&square).unwrap();
        assert!((circle.centre - Point2::new(1.0, 1.0)).norm() < 1e-12);
        assert!((circle.radius - 2.0_f64.sqrt()).abs() < 1e-12);
        // An obtuse triangle: the circle stands on the long side.
        let obtuse = [[0.0, 0.0], [10.0, 0.0], [5.0, 1.0]].map(Point2::from);
        let circle = smallest_around(&obtuse).unwrap();
        assert!((circle.centre - Point2::new(5.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn holds_every_point_and_is_no_larger_than_needed() {
        let mut state = 3_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        for _ in 0..200 {
            let points: Vec<_> =
                (0..40).map(|_| Point2::new(next() * 60.0, next() * 9.0)).collect();
            let circle = smallest_around(&points).unwrap();
            let on_rim = points
                .iter()
                .filter(|p| (distance(&circle.centre, p) - circle.radius).abs() < 1e-9)
                .count();
            assert!(points.iter().all(|p| circle.holds(p)));
            assert!(on_rim >= 2, "a circle that two points do not pin could shrink");
        }
    }

    #[test]
    fn degenerate_sets() {
        assert!(smallest_around(&[]).is_none());
        let point = Point2::new(3.0, 4.0);
        assert_eq!(smallest_around(&[point; 5]).unwrap(), Circle { centre: point, radius: 0.0 });
        let line: Vec<_> = (0..9).map(|i| Point2::new(f64::from(i), 2.0 * f64::from(i))).collect();
        let circle = smallest_around(&line).unwrap();
        assert!((circle.centre - Point2::new(4.0, 8.0)).norm() < 1e-12);
    }
}
