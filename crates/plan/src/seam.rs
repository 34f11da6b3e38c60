//! Where closed lines begin.

use nalgebra::{Point2, distance};

/// How the begin of a wall is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeamPosition {
    /// Where the nozzle is nearest: least travel, seams anywhere.
    Nearest,
    /// Above the seam of the layer below; on a new wall in its sharpest corner.
    Aligned,
}

/// How far a seam may move from one layer to the next and still follow the one below, mm. Walls of
/// a steep cone move by a few millimetres; beyond, the wall belongs to something else.
const LARGEST_STEP_MM: f64 = 5.0;

/// Turns below this are part of a curve, radians (30°): no place to hide a seam.
const LEAST_CORNER: f64 = 0.52;

/// The seams of the layer below and of the one at hand.
#[derive(Debug, Clone, Default)]
pub struct SeamMemory {
    below: Vec<Point2<f64>>,
    here: Vec<Point2<f64>>,
}

impl SeamMemory {
    /// A new layer begins.
    pub fn next_layer(&mut self) {
        self.below = std::mem::take(&mut self.here);
    }

    /// Returns the index of the point at which a closed line (mm, material to the left) begins,
    /// and remembers it.
    pub fn choose(
        &mut self,
        points: &[Point2<f64>],
        nozzle: &Point2<f64>,
        position: SeamPosition,
    ) -> usize {
        let index = match position {
            SeamPosition::Nearest => nearest(points, nozzle).0,
            SeamPosition::Aligned => self.aligned(points),
        };
        self.here.push(points[index]);
        index
    }

    fn aligned(&self, points: &[Point2<f64>]) -> usize {
        let above_a_seam = self
            .below
            .iter()
            .map(|seam| nearest(points, seam))
            .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        match above_a_seam {
            Some((index, step)) if step <= LARGEST_STEP_MM => index,
            _ => sharpest_corner(points),
        }
    }
}

/// The point nearest to `to` and its distance; the first of equals.
pub(crate) fn nearest(points: &[Point2<f64>], to: &Point2<f64>) -> (usize, f64) {
    points
        .iter()
        .map(|p| distance(p, to))
        .enumerate()
        .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
        .expect("lines have points")
}

fn sharpest_corner(points: &[Point2<f64>]) -> usize {
    let count = points.len();
    let hides = |i: usize| {
        let (before, at, after) =
            (points[(i + count - 1) % count], points[i], points[(i + 1) % count]);
        let (u, v) = (at - before, after - at);
        let turn = u.perp(&v).atan2(u.dot(&v));
        // Any corner that points into the part hides a seam better than those that point out.
        let bonus = if turn < 0.0 { std::f64::consts::PI } else { 0.0 };
        if turn.abs() < LEAST_CORNER { 0.0 } else { turn.abs() + bonus }
    };
    // Without a corner, and among equal ones: the point farthest along +x, which in the frame of
    // the slicer turns with the part.
    let better = |a: &usize, b: &usize| {
        let (wa, wb) = (hides(*a), hides(*b));
        let (pa, pb) = (points[*a], points[*b]);
        ((wa * 1e6).round().total_cmp(&(wb * 1e6).round()))
            .then(pa.x.total_cmp(&pb.x))
            .then(pa.y.total_cmp(&pb.y))
    };
    (0..count).max_by(better).expect("lines have points")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(list: &[[f64; 2]]) -> Vec<Point2<f64>> {
        list.iter().map(|&p| Point2::from(p)).collect()
    }

    #[test]
    fn nearest_begins_at_the_nozzle() {
        let square = points(&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]);
        let mut memory = SeamMemory::default();
        let index = memory.choose(&square, &Point2::new(5.0, 3.5), SeamPosition::Nearest);
        assert_eq!(index, 2);
    }

    #[test]
    fn aligned_hides_in_a_notch_and_stays_there() {
        let notched = points(&[[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [4.0, 5.0], [0.0, 8.0]]);
        let mut memory = SeamMemory::default();
        let nozzle = Point2::new(100.0, 0.0);
        assert_eq!(memory.choose(&notched, &nozzle, SeamPosition::Aligned), 3);
        memory.next_layer();
        let moved: Vec<_> = notched.iter().map(|p| p + nalgebra::Vector2::new(0.3, 0.1)).collect();
        assert_eq!(memory.choose(&moved, &nozzle, SeamPosition::Aligned), 3);
    }

    #[test]
    fn a_circle_without_corners_gets_one_line_of_seams() {
        let circle: Vec<_> = (0..100)
            .map(|i| {
                let angle = f64::from(i) * std::f64::consts::TAU / 100.0;
                Point2::new(10.0 * angle.cos(), 10.0 * angle.sin())
            })
            .collect();
        let mut memory = SeamMemory::default();
        assert_eq!(memory.choose(&circle, &Point2::new(-50.0, 0.0), SeamPosition::Aligned), 0);
    }
}
