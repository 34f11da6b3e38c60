//! Triangles between an outer ring and the hole in it, where each of them has corners on both.
//!
//! Both rings are followed side by side; of the two triangles that may come next, that whose circle does not
//! hold the corner of the other is taken. If in the end no circle holds the corner across a side that two
//! triangles share, the triangulation is *the* constrained Delaunay triangulation of the ribbon (Delaunay's
//! lemma; for constrained ones L. P. Chew (1989), "Constrained Delaunay triangulations", Algorithmica 4).
//! Where it is not, as at a corner that a triangle with all its corners on one ring fills, there is none of
//! this kind.

use nalgebra::Point2;

use super::Triangulation;

/// How far a corner may lie in the circle of a triangle, as a share of the terms that tell: what rounding is
/// mistaken for. Corners on one circle may be joined either way.
const ON_CIRCLE: f64 = 1e-12;

/// Triangulates between `outer`, counter-clockwise, and `hole`, clockwise; `None` where some triangle of the
/// constrained Delaunay triangulation has all corners on one ring.
pub(super) fn triangulate(outer: &[Point2<f64>], hole: &[Point2<f64>]) -> Option<Triangulation> {
    let ribbon = Ribbon { outer, hole, begin: opposite_first(outer, hole)? };
    let steps = ribbon.steps()?;
    let count = u32::try_from(steps.len()).ok()?;
    let neighbours = (0..count).zip(&steps).map(|(k, step)| {
        let [next, last] = [(k + 1) % count, (k + count - 1) % count].map(Some);
        match step.along {
            Along::Outer => [None, next, last],
            Along::Hole => [None, last, next],
        }
    });
    let neighbours = neighbours.collect();
    Some(Triangulation { triangles: steps.iter().map(|step| step.corners).collect(), neighbours })
}

struct Ribbon<'a> {
    outer: &'a [Point2<f64>],
    hole: &'a [Point2<f64>],
    /// The point of the hole that is opposite to the first outside.
    begin: usize,
}

/// The ring that a triangle has a side of.
#[derive(Clone, Copy, PartialEq)]
enum Along {
    Outer,
    Hole,
}

/// A triangle, counter-clockwise: the side on its ring, and its third corner, on the other.
struct Step {
    along: Along,
    corners: [u32; 3],
}

impl Ribbon<'_> {
    /// The triangles, one after the other; each has the corner that the next one does not share.
    fn steps(&self) -> Option<Vec<Step>> {
        let (n, m) = (self.outer.len(), self.hole.len());
        let mut steps: Vec<Step> = Vec::with_capacity(n + m);
        let (mut i, mut j) = (0, 0);
        while i < n || j < m {
            let (here, below) = (self.of_outer(i), self.of_hole(j));
            let (onward, beyond) = (self.of_outer(i + 1), self.of_hole(j + 1));
            let [along_outer, along_hole] = [[here, onward, below], [beyond, below, here]];
            let along = match (i < n, j < m) {
                (true, false) => Along::Outer,
                (false, _) => Along::Hole,
                (true, true) if !self.turns_left(along_outer) => Along::Hole,
                (true, true) if !self.turns_left(along_hole) => Along::Outer,
                (true, true) if self.holds(along_outer, beyond) => Along::Hole,
                (true, true) => Along::Outer,
            };
            let (corners, new) = match along {
                Along::Outer => (along_outer, onward),
                Along::Hole => (along_hole, beyond),
            };
            let fits = |last: &Step| !self.holds(last.corners, new);
            if !self.turns_left(corners) || !steps.last().is_none_or(fits) {
                return None;
            }
            match along {
                Along::Outer => i += 1,
                Along::Hole => j += 1,
            }
            steps.push(Step { along, corners });
        }
        let new = match steps.first()?.along {
            Along::Outer => self.of_outer(1),
            Along::Hole => self.of_hole(1),
        };
        (!self.holds(steps.last()?.corners, new)).then_some(steps)
    }

    /// The index of an outer point.
    fn of_outer(&self, i: usize) -> u32 {
        (i % self.outer.len()) as u32
    }

    /// The index of a point of the hole, counted counter-clockwise from where the ribbon begins.
    fn of_hole(&self, j: usize) -> u32 {
        let m = self.hole.len();
        (self.outer.len() + (self.begin + m - j % m) % m) as u32
    }

    fn point(&self, index: u32) -> Point2<f64> {
        let index = index as usize;
        let of_hole = || self.hole[index - self.outer.len()];
        self.outer.get(index).copied().unwrap_or_else(of_hole)
    }

    /// Whether a triangle runs counter-clockwise.
    fn turns_left(&self, corners: [u32; 3]) -> bool {
        let [a, b, c] = corners.map(|k| self.point(k));
        (b - a).perp(&(c - a)) > 0.0
    }

    /// Whether the circle of a triangle holds a point.
    fn holds(&self, corners: [u32; 3], point: u32) -> bool {
        let point = self.point(point);
        let [a, b, c] = corners.map(|k| self.point(k) - point);
        let terms = [
            a.norm_squared() * b.perp(&c),
            b.norm_squared() * c.perp(&a),
            c.norm_squared() * a.perp(&b),
        ];
        let size: f64 = terms.iter().map(|term| term.abs()).sum();
        terms.iter().sum::<f64>() > ON_CIRCLE * size
    }
}

/// The number of the point of the hole that is nearest to the first outside; `None` without either.
fn opposite_first(outer: &[Point2<f64>], hole: &[Point2<f64>]) -> Option<usize> {
    let first = outer.first()?;
    let squared = |p: &Point2<f64>| (p - first).norm_squared();
    let nearest = |a: &usize, b: &usize| squared(&hole[*a]).total_cmp(&squared(&hole[*b]));
    (0..hole.len()).min_by(nearest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// A ring of `count` points whose distance from the middle changes `waves` times.
    fn wavy(radius: f64, wave: f64, waves: f64, count: u32) -> Vec<Point2<f64>> {
        let at = |k: u32| {
            let angle = TAU * f64::from(k) / f64::from(count);
            let r = radius + wave * (waves * angle).sin();
            Point2::new(r * angle.cos(), r * angle.sin())
        };
        (0..count).map(at).collect()
    }

    fn sorted(triangles: &Triangulation) -> Vec<[u32; 3]> {
        let ordered = |corners: &[u32; 3]| {
            let mut corners = *corners;
            corners.sort_unstable();
            corners
        };
        let mut all: Vec<[u32; 3]> = triangles.triangles.iter().map(ordered).collect();
        all.sort_unstable();
        all
    }

    #[test]
    fn a_ribbon_is_what_the_general_way_gives() {
        let mut found = 0;
        for (wave, count) in [(0.0, 301), (0.3, 407), (1.0, 533), (2.0, 799)] {
            let outer = wavy(20.0, wave, 5.0, count);
            let mut hole = wavy(19.3, wave, 5.0, count - 31);
            hole.reverse();
            let Some(triangles) = triangulate(&outer, &hole) else { continue };
            found += 1;
            for (k, sides) in (0_u32..).zip(&triangles.neighbours) {
                for (side, other) in sides.iter().enumerate() {
                    let Some(other) = other else { continue };
                    let [from, to] =
                        [side, (side + 1) % 3].map(|c| triangles.triangles[k as usize][c]);
                    let shared = triangles.triangles[*other as usize];
                    assert!(shared.contains(&from) && shared.contains(&to));
                }
            }
            // Three rings are no ribbon: the third, far away and tiny, changes nothing in it.
            let speck = [[90.0, 0.0], [90.1, 0.0], [90.0, 0.1]].map(Point2::from).to_vec();
            let all = super::super::triangulate(&[outer, hole, speck]).unwrap();
            let mut expected = sorted(&all);
            let speck = (count * 2 - 31..).take(3).collect::<Vec<u32>>();
            expected.retain(|corners| corners[..] != speck[..]);
            assert_eq!(sorted(&triangles), expected);
        }
        assert!(found >= 3, "{found}");
    }

    #[test]
    fn what_is_no_ribbon_is_left_to_the_general_way() {
        let outer = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]].map(Point2::from);
        let hole = [[4.0, 4.0], [4.0, 6.0], [6.0, 6.0], [6.0, 4.0]].map(Point2::from);
        assert!(triangulate(&outer, &hole).is_some());
        // In the other direction nothing turns left.
        let turned: Vec<Point2<f64>> = hole.iter().rev().copied().collect();
        assert!(triangulate(&outer, &turned).is_none());
        // A notch that holds a triangle of its own.
        let notched = [
            [0.0, 0.0],
            [10.0, 0.0],
            [10.0, 4.9],
            [30.0, 5.0],
            [10.0, 5.1],
            [10.0, 10.0],
            [0.0, 10.0],
        ];
        assert!(triangulate(&notched.map(Point2::from), &hole).is_none());
        assert!(triangulate(&outer, &[]).is_none());
    }
}
