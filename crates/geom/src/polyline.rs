//! Open and closed lines in the plane: length, points along them, the nearest point.

use nalgebra::{Point2, distance};

/// Returns the length of an open line, in the unit of its points.
#[must_use]
pub fn length(points: &[Point2<f64>]) -> f64 {
    points.windows(2).map(|w| distance(&w[0], &w[1])).sum()
}

/// A place on a line: side `side` runs from point `side` to the next one, `share` of it is behind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The index of the side.
    pub side: usize,
    /// The share of the side before the place, 0 to 1.
    pub share: f64,
    /// The position.
    pub at: Point2<f64>,
    /// The distance from the point that was asked for.
    pub distance: f64,
}

/// Returns the place on a closed line nearest to `p`; the first of equals. `None` when there are
/// no points.
#[must_use]
pub fn nearest_on_ring(points: &[Point2<f64>], p: &Point2<f64>) -> Option<Place> {
    let mut best: Option<Place> = None;
    for side in 0..points.len() {
        let (a, b) = (points[side], points[(side + 1) % points.len()]);
        let share = share_nearest(&a, &b, p);
        let at = a + (b - a) * share;
        let place = Place { side, share, at, distance: distance(&at, p) };
        if best.is_none_or(|best| place.distance < best.distance) {
            best = Some(place);
        }
    }
    best
}

/// Returns how far along the segment `a`–`b` the point nearest to `p` lies, as a share of it.
#[must_use]
pub fn share_nearest(a: &Point2<f64>, b: &Point2<f64>, p: &Point2<f64>) -> f64 {
    let along = b - a;
    let length_squared = along.norm_squared();
    if length_squared == 0.0 {
        return 0.0;
    }
    ((p - a).dot(&along) / length_squared).clamp(0.0, 1.0)
}

/// Returns the distance of `p` from the segment `a`–`b`.
#[must_use]
pub fn distance_to_segment(a: &Point2<f64>, b: &Point2<f64>, p: &Point2<f64>) -> f64 {
    distance(&(a + (b - a) * share_nearest(a, b, p)), p)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_place_on_a_square() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]].map(Point2::from);
        let place = nearest_on_ring(&square, &Point2::new(3.0, 5.0)).unwrap();
        assert_eq!((place.side, place.share), (2, 0.25));
        assert_eq!(place.distance, 1.0);
        let closing = nearest_on_ring(&square, &Point2::new(-1.0, 2.0)).unwrap();
        assert_eq!(closing.side, 3);
        assert!(nearest_on_ring(&[], &Point2::origin()).is_none());
    }
}
