//! Fewer points on a line, within a tolerance.
//!
//! Source: D. H. Douglas, T. K. Peucker (1973), "Algorithms for the reduction of the number of
//! points required to represent a digitized line or its caricature"; the recursion is a stack of
//! our own, so depth is no matter. On rings the two anchor points are the leftmost (then lowest)
//! point and the one farthest from it: they depend on the shape and not on where the ring starts.
//!
//! Guarantee: no dropped point lies farther than the tolerance from the line that replaces it.

use nalgebra::Point2;

use crate::grid::{GridPoint, steps};

/// Marks the points of an open line that must stay so that none of the others lies farther than
/// the limit from the line that is left; both ends are taken to stay.
///
/// `segment(a, b)` returns what returns the squared distance of point `p` from the segment `a`–`b`, all
/// three by index: the points may be of any kind, such as positions with a width.
pub fn mark_kept<D: Fn(usize) -> f64>(
    first: usize,
    last: usize,
    limit_squared: f64,
    segment: impl Fn(usize, usize) -> D,
    keep: &mut [bool],
) {
    let mut stack = vec![(first, last)];
    while let Some((a, b)) = stack.pop() {
        let distance_squared = segment(a, b);
        let farthest = (a + 1..b)
            .map(|p| (distance_squared(p), p))
            // The first of equals, so that the choice does not depend on evaluation order.
            .reduce(|best, next| if next.0 > best.0 { next } else { best });
        if let Some((distance, p)) = farthest
            && distance > limit_squared
        {
            keep[p] = true;
            stack.push((a, p));
            stack.push((p, b));
        }
    }
}

/// Returns the ring thinned out to within `tolerance` (mm); fewer than three points when the whole
/// ring is smaller than that.
#[must_use]
pub fn simplify_ring(ring: &[GridPoint], tolerance: f64) -> Vec<GridPoint> {
    if ring.len() <= 3 {
        return ring.to_vec();
    }
    let start = (0..ring.len()).min_by_key(|&i| (ring[i].x, ring[i].y)).expect("not empty");
    let mut points: Vec<GridPoint> = ring[start..].iter().chain(&ring[..start]).copied().collect();
    points.push(points[0]);
    let far = (1..points.len() - 1)
        .max_by(|&a, &b| {
            let (da, db) =
                (squared_length(points[0], points[a]), squared_length(points[0], points[b]));
            da.total_cmp(&db).then(b.cmp(&a))
        })
        .expect("more than three points");
    let limit = f64::from(steps(tolerance)).powi(2);
    let points_of = &points;
    let distance = |a: usize, b: usize| {
        let (a, b) = (float(points_of[a]), float(points_of[b]));
        move |p: usize| squared_distance(&a, &b, &float(points_of[p]))
    };
    let mut keep = vec![false; points.len()];
    keep[0] = true;
    keep[far] = true;
    mark_kept(0, far, limit, distance, &mut keep);
    mark_kept(far, points.len() - 1, limit, distance, &mut keep);
    let result: Vec<GridPoint> =
        points.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(p, _)| *p).collect();
    // Two anchors and nothing between: the ring is a sliver thinner than the tolerance.
    if result.len() < 3 { Vec::new() } else { result }
}

/// Returns an open line thinned out to within `tolerance`, in the unit of its points.
#[must_use]
pub fn simplify_line(points: &[Point2<f64>], tolerance: f64) -> Vec<Point2<f64>> {
    if points.len() <= 2 {
        return points.to_vec();
    }
    let distance =
        |a: usize, b: usize| move |p: usize| squared_distance(&points[a], &points[b], &points[p]);
    let mut keep = vec![false; points.len()];
    keep[0] = true;
    keep[points.len() - 1] = true;
    mark_kept(0, points.len() - 1, tolerance * tolerance, distance, &mut keep);
    points.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(p, _)| *p).collect()
}

fn float(p: GridPoint) -> Point2<f64> {
    Point2::new(f64::from(p.x), f64::from(p.y))
}

fn squared_length(a: GridPoint, b: GridPoint) -> f64 {
    (float(b) - float(a)).norm_squared()
}

/// Squared distance of `p` from the segment `a`–`b`.
fn squared_distance(a: &Point2<f64>, b: &Point2<f64>, p: &Point2<f64>) -> f64 {
    let (along, to_p) = (b - a, p - a);
    let length_squared = along.norm_squared();
    if length_squared == 0.0 {
        return to_p.norm_squared();
    }
    let t = (to_p.dot(&along) / length_squared).clamp(0.0, 1.0);
    (to_p - along * t).norm_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{mm, snap};

    fn circle(points: u32, radius: f64) -> Vec<GridPoint> {
        (0..points)
            .map(|i| {
                let angle = f64::from(i) * std::f64::consts::TAU / f64::from(points);
                snap(&Point2::new(radius * angle.cos(), radius * angle.sin()))
            })
            .collect()
    }

    #[test]
    fn no_dropped_point_is_farther_than_the_tolerance() {
        let ring = circle(5000, 20.0);
        let thin = simplify_ring(&ring, 0.002);
        // The sagitta rule: 2 µm on 20 mm is a chord of 0.566 mm, 222 of them.
        assert!(thin.len() > 200 && thin.len() < 520, "{} points", thin.len());
        for p in &ring {
            let nearest = (0..thin.len())
                .map(|i| squared_distance(&mm(thin[i]), &mm(thin[(i + 1) % thin.len()]), &mm(*p)))
                .fold(f64::INFINITY, f64::min);
            assert!(nearest.sqrt() <= 0.002 + 1e-5, "{}", nearest.sqrt());
        }
    }

    #[test]
    fn the_start_of_the_ring_does_not_matter() {
        let ring = circle(997, 7.0);
        let mut turned = ring.clone();
        turned.rotate_left(313);
        assert_eq!(simplify_ring(&ring, 0.01), simplify_ring(&turned, 0.01));
    }

    #[test]
    fn collinear_points_go_and_slivers_vanish() {
        let p = |x: f64, y: f64| snap(&Point2::new(x, y));
        let ring = vec![p(0.0, 0.0), p(5.0, 0.0), p(10.0, 0.0), p(10.0, 10.0), p(0.0, 10.0)];
        assert_eq!(simplify_ring(&ring, 0.001).len(), 4);
        let sliver = vec![p(0.0, 0.0), p(5.0, 0.0005), p(10.0, 0.0), p(5.0, -0.0005)];
        assert!(simplify_ring(&sliver, 0.001).is_empty());
        let line: Vec<_> = (0..50).map(|i| Point2::new(f64::from(i), 0.0)).collect();
        assert_eq!(simplify_line(&line, 0.001).len(), 2);
    }
}
