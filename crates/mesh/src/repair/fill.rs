//! Fills a rim with triangles.
//!
//! * A flat rim, with the rims inside it, by the constrained Delaunay triangulation of its plane:
//!   there is only one surface to find.
//! * A rim in space by the triangles of least area. Source: G. Barequet, M. Sharir (1995),
//!   "Filling gaps in the boundary of a polyhedron", Computer Aided Geometric Design 12(2),
//!   section 4 (after G. Klincsek (1980)): with W(i, k) the least area that closes the rim from
//!   corner i to corner k, W(i, k) = min over m of W(i, m) + W(m, k) + area(i, m, k), in O(n³).
//! * A long rim in space by the triangulation of its projection, when that does not cross itself.
//!
//! The triangles run along the rim in its own direction. Every filling is checked to have exactly
//! the rim as its border before it is used.

use crate::mesh::Mesh;
use geom::triangulate::triangulate;
use nalgebra::{Point2, Point3, Unit, Vector3};

/// A plane with axes, to draw rims in.
pub(super) struct Plane {
    origin: Point3<f64>,
    x: Vector3<f64>,
    y: Vector3<f64>,
    /// The side from which rims run counter-clockwise.
    pub(super) normal: Vector3<f64>,
}

impl Plane {
    /// Returns the plane that fits a rim, by the area vector of its cone (M. Newell's method);
    /// `None` when the rim encloses no area.
    pub(super) fn through(points: &[Point3<f64>]) -> Option<Self> {
        let origin = mean(points);
        let mut twice_area = Vector3::zeros();
        for (i, p) in points.iter().enumerate() {
            twice_area += (p - origin).cross(&(points[(i + 1) % points.len()] - origin));
        }
        let size = points.iter().map(|p| (p - origin).norm_squared()).fold(0.0, f64::max);
        // Rounding leaves an area of some 1e-16 of the square of the size.
        let normal = Unit::try_new(twice_area, NO_AREA * size)?.into_inner();
        let seed = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        let x = normal.cross(&seed).normalize();
        Some(Self { origin, x, y: normal.cross(&x), normal })
    }

    /// Returns the position of a point in the plane.
    pub(super) fn flatten(&self, p: &Point3<f64>) -> Point2<f64> {
        let arm = p - self.origin;
        Point2::new(arm.dot(&self.x), arm.dot(&self.y))
    }

    /// Returns how far the farthest point lies from the plane.
    pub(super) fn farthest(&self, points: &[Point3<f64>]) -> f64 {
        points.iter().map(|p| (p - self.origin).dot(&self.normal).abs()).fold(0.0, f64::max)
    }
}

/// A rim encloses no area below this share of the square of its size.
const NO_AREA: f64 = 1e-9;

fn mean(points: &[Point3<f64>]) -> Point3<f64> {
    let first = points.first().copied().unwrap_or_default();
    let sum: Vector3<f64> = points.iter().map(|p| p - first).sum();
    first + sum / points.len().max(1) as f64
}

/// Returns the positions of a rim.
pub(super) fn positions(mesh: &Mesh, rim: &[u32]) -> Vec<Point3<f64>> {
    rim.iter().map(|v| mesh.vertices[*v as usize]).collect()
}

/// Fills rims that lie in `plane`, one around the others; `None` when they cross or touch.
pub(super) fn in_plane(mesh: &Mesh, rims: &[&[u32]], plane: &Plane) -> Option<Vec<[u32; 3]>> {
    let flatten = |rim: &&[u32]| -> Vec<Point2<f64>> {
        rim.iter().map(|v| plane.flatten(&mesh.vertices[*v as usize])).collect()
    };
    let rings: Vec<Vec<Point2<f64>>> = rims.iter().map(flatten).collect();
    let names: Vec<u32> = rims.iter().flat_map(|rim| rim.iter().copied()).collect();
    let filling = triangulate(&rings).ok()?;
    let triangles: Vec<[u32; 3]> =
        filling.triangles.iter().map(|t| t.map(|i| names[i as usize])).collect();
    has_border(&triangles, rims).then_some(triangles)
}

/// Fills a rim whose points lie on a line: the triangles have no area, and join its sides.
pub(super) fn crack(rim: &[u32]) -> Vec<[u32; 3]> {
    (1..rim.len().saturating_sub(1)).map(|i| [rim[0], rim[i], rim[i + 1]]).collect()
}

/// How many areas the fillings of one repair may compute: about a second.
pub(super) const MOST_AREAS: usize = 30_000_000;

/// Rims longer than this are filled by their projection: the table of areas has n² entries.
const LONGEST: usize = 400;

/// Fills a rim in space; `None` when it is too long and its projection crosses itself.
pub(super) fn in_space(mesh: &Mesh, rim: &[u32], areas_left: &mut usize) -> Option<Vec<[u32; 3]>> {
    let n_areas = rim.len().pow(3) / 6;
    if rim.len() <= LONGEST && n_areas <= *areas_left {
        *areas_left -= n_areas;
        return Some(least_area(mesh, &from_least(mesh, rim)));
    }
    let plane = Plane::through(&positions(mesh, rim))?;
    in_plane(mesh, &[rim], &plane)
}

/// The rim from its least vertex (by x, y, z), so that a choice between equal areas does not
/// depend on where the rim was found.
fn from_least(mesh: &Mesh, rim: &[u32]) -> Vec<u32> {
    let position = |i: &usize| mesh.vertices[rim[*i] as usize];
    let order = |a: &usize, b: &usize| {
        let (p, q) = (position(a), position(b));
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z))
    };
    let least = (0..rim.len()).min_by(order).unwrap_or(0);
    [&rim[least..], &rim[..least]].concat()
}

/// The triangles of least area that close a rim.
fn least_area(mesh: &Mesh, rim: &[u32]) -> Vec<[u32; 3]> {
    let points = positions(mesh, rim);
    let n = points.len();
    let mut least = vec![0.0; n * n];
    let mut middle = vec![0; n * n];
    for width in 2..n {
        for i in 0..n - width {
            let k = i + width;
            let mut best = f64::INFINITY;
            for m in i + 1..k {
                let (a, b, c) = (&points[i], &points[m], &points[k]);
                let area = (b - a).cross(&(c - a)).norm();
                let sum = least[i * n + m] + least[m * n + k] + area;
                if sum < best {
                    best = sum;
                    middle[i * n + k] = m;
                }
            }
            least[i * n + k] = best;
        }
    }
    let mut triangles = Vec::with_capacity(n.saturating_sub(2));
    let mut open = vec![(0, n - 1)];
    while let Some((i, k)) = open.pop() {
        if k - i >= 2 {
            // Areas beyond the range of numbers leave the table empty: any corner will do.
            let m = middle[i * n + k].clamp(i + 1, k - 1);
            triangles.push([rim[i], rim[m], rim[k]]);
            open.extend([(i, m), (m, k)]);
        }
    }
    triangles
}

/// Whether triangles have exactly `rims` as their border, in the same direction.
fn has_border(triangles: &[[u32; 3]], rims: &[&[u32]]) -> bool {
    let along = |ring: &[u32]| -> Vec<[u32; 2]> {
        (0..ring.len()).map(|i| [ring[i], ring[(i + 1) % ring.len()]]).collect()
    };
    let mut sides: Vec<[u32; 2]> = triangles.iter().flat_map(|t| along(t)).collect();
    // The rims run along their filling; backwards they are its missing partners.
    sides.extend(rims.iter().flat_map(|rim| along(rim)).map(|[a, b]| [b, a]));
    let mut backwards: Vec<[u32; 2]> = sides.iter().map(|[a, b]| [*b, *a]).collect();
    sides.sort_unstable();
    backwards.sort_unstable();
    sides == backwards && sides.windows(2).all(|pair| pair[0] != pair[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure;

    fn mesh(points: &[[f64; 3]]) -> Mesh {
        Mesh { vertices: points.iter().map(|p| Point3::from(*p)).collect(), triangles: vec![] }
    }

    fn area(mesh: &Mesh, triangles: Vec<[u32; 3]>) -> f64 {
        measure::area_mm2(&Mesh { vertices: mesh.vertices.clone(), triangles })
    }

    #[test]
    fn least_area_of_a_bent_rim() {
        // Two squares at a right angle: along the fold, not across it.
        let bent = mesh(&[
            [10.0, 0.0, 0.0],
            [10.0, 10.0, 0.0],
            [0.0, 10.0, 0.0],
            [0.0, 10.0, 10.0],
            [0.0, 0.0, 10.0],
            [0.0, 0.0, 0.0],
        ]);
        let rim = [0, 1, 2, 3, 4, 5];
        let filling = in_space(&bent, &rim, &mut 1000).unwrap();
        assert!(has_border(&filling, &[&rim]));
        assert!((area(&bent, filling) - 200.0).abs() < 1e-9);
    }

    #[test]
    fn long_rims_use_their_projection() {
        let n = 1000;
        let wave = |i: u32| {
            let turn = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
            [20.0 * turn.cos(), 20.0 * turn.sin(), (3.0 * turn).sin()]
        };
        let mesh = mesh(&(0..n).map(wave).collect::<Vec<_>>());
        let rim: Vec<u32> = (0..n).collect();
        let filling = in_space(&mesh, &rim, &mut 1000).unwrap();
        assert!(has_border(&filling, &[&rim]));
        let area = area(&mesh, filling);
        assert!(area > 1250.0 && area < 1300.0, "{area}");
    }

    #[test]
    fn plane_of_a_rim() {
        let square = [[0.0, 0.0, 5.0], [4.0, 0.0, 5.0], [4.0, 4.0, 5.1], [0.0, 4.0, 5.0]];
        let points: Vec<_> = square.iter().map(|p| Point3::from(*p)).collect();
        let plane = Plane::through(&points).unwrap();
        assert!(plane.normal.z > 0.99);
        assert!(plane.farthest(&points) > 0.02 && plane.farthest(&points) < 0.1);
        let line = [[0.0; 3], [1.0, 1.0, 1.0], [3.0, 3.0, 3.0]].map(Point3::from);
        assert!(Plane::through(&line).is_none());
        assert_eq!(crack(&[4, 5, 6, 7]), [[4, 5, 6], [4, 6, 7]]);
    }

    #[test]
    fn borders() {
        assert!(has_border(&[[0, 1, 2], [0, 2, 3]], &[&[0, 1, 2, 3]]));
        assert!(!has_border(&[[0, 1, 2]], &[&[0, 2, 1]]));
        assert!(!has_border(&[[0, 1, 2], [0, 1, 2]], &[&[0, 1, 2]]));
        assert!(!has_border(&[[0, 1, 2]], &[&[0, 1, 2, 3]]));
    }
}
