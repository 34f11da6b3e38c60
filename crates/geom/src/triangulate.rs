//! Triangles that fill a set of closed rings: constrained Delaunay triangulation.
//!
//! Wraps the triangulation of the spade crate, the only module that names it. What lies inside is
//! decided by the even-odd rule, so rings may come in any direction and any nesting. The ribbon between two
//! rings, which is what thin walls leave, is triangulated along its way, which is several times faster
//! (`triangulate/ribbon.rs`).

mod ribbon;

use nalgebra::Point2;
use spade::{ConstrainedDelaunayTriangulation, Triangulation as _};

/// The triangles inside a set of rings.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Triangulation {
    /// Corners, counter-clockwise, as indices into the rings' points counted through in order.
    /// Points that coincide go by the first one's index.
    pub triangles: Vec<[u32; 3]>,
    /// The triangle across the side from corner `k` to corner `k + 1`; `None` on a ring.
    pub neighbours: Vec<[Option<u32>; 3]>,
}

/// Why rings cannot be triangulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TriangulateError {
    /// Two ring sides cross between their ends.
    RingsCross,
    /// A coordinate is not finite, or too large or small for exact arithmetic.
    BadCoordinate,
}

impl std::fmt::Display for TriangulateError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::RingsCross => "two sides of the rings cross",
            Self::BadCoordinate => "a coordinate is outside the range of exact arithmetic",
        })
    }
}

impl std::error::Error for TriangulateError {}

type Cdt = ConstrainedDelaunayTriangulation<spade::Point2<f64>>;

/// Triangulates the inside (even-odd) of closed `rings`, in any unit.
///
/// A side that two rings share, or one ring runs twice, bounds nothing and is ignored.
///
/// # Errors
///
/// [`TriangulateError`], when sides cross or coordinates are out of range.
pub fn triangulate(rings: &[Vec<Point2<f64>>]) -> Result<Triangulation, TriangulateError> {
    if let [outer, hole] = rings
        && let Some(triangles) = ribbon::triangulate(outer, hole)
    {
        return Ok(triangles);
    }
    let points: Vec<Point2<f64>> = rings.iter().flatten().copied().collect();
    let first_same = first_of_equal_points(&points);
    // The triangulation wants each point once; `distinct` are the input indices that it gets.
    let distinct: Vec<usize> = (0..points.len()).filter(|&i| first_same[i] == i).collect();
    let mut place = vec![usize::MAX; points.len()];
    for (k, &i) in distinct.iter().enumerate() {
        place[i] = k;
    }
    let vertices = distinct
        .iter()
        .map(|&i| spade::Point2::new(tame(points[i].x), tame(points[i].y)))
        .collect();
    let sides = odd_sides(rings, &first_same, &place);
    let mut crossed = false;
    let cdt = Cdt::try_bulk_load_cdt(vertices, sides, |_| crossed = true)
        .map_err(|_| TriangulateError::BadCoordinate)?;
    if crossed {
        return Err(TriangulateError::RingsCross);
    }
    Ok(inside(&cdt, &distinct))
}

/// Coordinates that round to nothing beside any real one become zero; the library refuses them.
fn tame(coordinate: f64) -> f64 {
    if coordinate.abs() < spade::MIN_ALLOWED_VALUE { 0.0 } else { coordinate }
}

/// For each point, the index of the first point equal to it.
fn first_of_equal_points(points: &[Point2<f64>]) -> Vec<usize> {
    let key = |i: usize| (tame(points[i].x), tame(points[i].y));
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_unstable_by(|&a, &b| {
        let (p, q) = (key(a), key(b));
        p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1)).then(a.cmp(&b))
    });
    let mut first = vec![0; points.len()];
    for run in order.chunk_by(|&a, &b| key(a) == key(b)) {
        for &i in run {
            first[i] = run[0];
        }
    }
    first
}

/// The ring sides that occur an odd number of times, each once, as places among the distinct
/// points.
fn odd_sides(rings: &[Vec<Point2<f64>>], first_same: &[usize], place: &[usize]) -> Vec<[usize; 2]> {
    let mut sides = Vec::new();
    let mut start = 0;
    for ring in rings {
        for k in 0..ring.len() {
            let a = place[first_same[start + k]];
            let b = place[first_same[start + (k + 1) % ring.len()]];
            if a != b {
                sides.push([a.min(b), a.max(b)]);
            }
        }
        start += ring.len();
    }
    sides.sort_unstable();
    sides.chunk_by(|a, b| a == b).filter(|run| run.len() % 2 == 1).map(|run| run[0]).collect()
}

/// Keeps the faces that an odd number of ring sides separates from the outside.
fn inside(cdt: &Cdt, distinct: &[usize]) -> Triangulation {
    let mut is_inside: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    let outer = cdt.outer_face().fix().index();
    is_inside[outer] = Some(false);
    let mut queue: Vec<_> = Vec::new();
    for edge in cdt.directed_edges() {
        if edge.face().fix().index() == outer {
            queue.push(edge.fix());
        }
    }
    while let Some(edge) = queue.pop() {
        let edge = cdt.directed_edge(edge);
        let from = is_inside[edge.face().fix().index()].expect("queued from a decided face");
        let next = edge.rev().face();
        if is_inside[next.fix().index()].is_none() {
            is_inside[next.fix().index()] = Some(from ^ edge.is_constraint_edge());
            if let Some(face) = next.as_inner() {
                queue.extend(face.adjacent_edges().map(|e| e.fix()));
            }
        }
    }
    let mut number = vec![None; cdt.num_all_faces()];
    let kept: Vec<_> =
        cdt.inner_faces().filter(|face| is_inside[face.fix().index()] == Some(true)).collect();
    for (k, face) in (0_u32..).zip(&kept) {
        number[face.fix().index()] = Some(k);
    }
    let corner = |v: usize| u32::try_from(distinct[v]).expect("fewer than 2^32 points");
    let mut result = Triangulation::default();
    for face in kept {
        let edges = face.adjacent_edges();
        result.triangles.push(edges.map(|e| corner(e.from().fix().index())));
        result.neighbours.push(edges.map(|e| {
            let across = number[e.rev().face().fix().index()];
            if e.is_constraint_edge() { None } else { across }
        }));
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(points: &[[f64; 2]]) -> Vec<Point2<f64>> {
        points.iter().map(|&p| Point2::from(p)).collect()
    }

    fn area(rings: &[Vec<Point2<f64>>], t: &Triangulation) -> f64 {
        let points: Vec<_> = rings.iter().flatten().collect();
        t.triangles
            .iter()
            .map(|c| {
                let [a, b, c] = c.map(|i| points[i as usize]);
                let twice = (b - a).perp(&(c - a));
                assert!(twice > 0.0, "triangles run counter-clockwise");
                twice / 2.0
            })
            .sum()
    }

    #[test]
    fn square_with_hole_in_any_direction() {
        let outer = ring(&[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]]);
        let mut hole = ring(&[[2.0, 2.0], [4.0, 2.0], [4.0, 4.0], [2.0, 4.0]]);
        for _ in 0..2 {
            let rings = [outer.clone(), hole.clone()];
            let t = triangulate(&rings).unwrap();
            assert!((area(&rings, &t) - 96.0).abs() < 1e-9);
            hole.reverse();
        }
    }

    #[test]
    fn neighbours_are_mutual() {
        let rings = [ring(&[[0.0, 0.0], [4.0, 0.0], [5.0, 3.0], [2.0, 5.0], [-1.0, 3.0]])];
        let t = triangulate(&rings).unwrap();
        assert_eq!(t.triangles.len(), 3);
        for (i, sides) in (0_u32..).zip(&t.neighbours) {
            for &j in sides.iter().flatten() {
                assert!(t.neighbours[j as usize].contains(&Some(i)));
            }
        }
    }

    #[test]
    fn repeated_points_and_shared_sides() {
        // Two squares that share a side bound one rectangle.
        let left = ring(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 1.0]]);
        let right = ring(&[[1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0]]);
        let rings = [left, right];
        let t = triangulate(&rings).unwrap();
        assert!((area(&rings, &t) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn crossing_rings_are_refused() {
        let bow = ring(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]);
        assert_eq!(triangulate(&[bow]), Err(TriangulateError::RingsCross));
        let far = ring(&[[0.0, 0.0], [1e300, 0.0], [0.0, 1.0]]);
        assert_eq!(triangulate(&[far]), Err(TriangulateError::BadCoordinate));
    }

    #[test]
    fn nothing_in_nothing_out() {
        assert_eq!(triangulate(&[]).unwrap(), Triangulation::default());
        let line = ring(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]);
        assert_eq!(triangulate(&[line]).unwrap(), Triangulation::default());
    }
}
