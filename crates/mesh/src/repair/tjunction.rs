//! Splits facets where a vertex lies on one of their open sides.
//!
//! Where one facet has a long side and its neighbours two short ones, the vertex between those
//! two lies on the long side: a T-junction, and a crack of no width. The facet is split at the
//! vertex, which keeps its place; only sides and vertices at which the surface is open are looked
//! at, so closed surfaces cost nothing and never change.

use super::Work;
use crate::inside::distance_to_segment;
use crate::mesh::{Mesh, repeated};
use crate::note::Tally;
use crate::topology::Edges;
use geom::bounding::{Bounds, BoxTree};
use nalgebra::Point3;

/// How many pairs of vertex and side are looked at in all: more than any real model needs, and
/// still under a second. Beyond, cracks are closed as holes.
const MOST_PAIRS: usize = 20_000_000;

/// Splits facets at vertices within `near_mm` of their open sides. Returns how many facets were
/// split, with the distance of the vertices from the sides, mm.
pub(super) fn split(work: &mut Work, edges: &Edges, near_mm: f64) -> Tally {
    let mut tally = Tally::default();
    let mut on_sides = vertices_on_sides(&work.mesh, edges, near_mm, &mut tally);
    on_sides.sort_by(|a, b| a.half.cmp(&b.half).then(a.along.total_cmp(&b.along)));
    let mut facets = on_sides.chunk_by(|a, b| a.half / 3 == b.half / 3).peekable();
    if facets.peek().is_none() {
        return tally;
    }
    let mut triangles = Vec::with_capacity(work.mesh.triangles.len() + on_sides.len());
    let mut windings = Vec::with_capacity(triangles.capacity());
    for (t, (corners, winding)) in work.mesh.triangles.iter().zip(&work.windings).enumerate() {
        match facets.next_if(|points| points[0].half as usize / 3 == t) {
            None => triangles.push(*corners),
            Some(points) => divide(*corners, points, &mut triangles),
        }
        windings.resize(triangles.len(), *winding);
    }
    work.mesh.triangles = triangles;
    work.windings = windings;
    tally
}

/// A vertex on the inside of an open side.
#[derive(Clone, Copy)]
struct OnSide {
    half: u32,
    /// Distance from the start of the half-edge, mm.
    along: f64,
    vertex: u32,
}

fn vertices_on_sides(mesh: &Mesh, edges: &Edges, near_mm: f64, tally: &mut Tally) -> Vec<OnSide> {
    let mut loose: Vec<u32> = edges.open().flat_map(|edge| edges.ends(mesh, edge)).collect();
    loose.sort_unstable();
    loose.dedup();
    let position = |v: u32| mesh.vertices[v as usize];
    let tree = BoxTree::new(loose.iter().map(|v| Bounds::of([&position(*v)])).collect());
    let mut found = Vec::new();
    let mut n_pairs = 0;
    for edge in edges.open() {
        let Some((half, None)) = edges.users(edge) else { continue };
        let corners = mesh.triangles[half as usize / 3];
        let (from, to) = (corners[half as usize % 3], corners[(half as usize + 1) % 3]);
        let (a, b) = (position(from), position(to));
        let near = tree.meeting(&Bounds::of([&a, &b]).grown(near_mm));
        n_pairs += near.len();
        if n_pairs > MOST_PAIRS {
            break;
        }
        for vertex in near.into_iter().map(|i| loose[i as usize]) {
            let p = position(vertex);
            let apart = distance_to_segment(&a, &b, &p);
            if !corners.contains(&vertex) && apart <= near_mm && is_between(&a, &b, &p, near_mm) {
                tally.add(apart, p);
                found.push(OnSide { half, along: (p - a).norm(), vertex });
            }
        }
    }
    found
}

/// Whether `p` is farther than `near_mm` from both ends: nearer, it belongs to the end.
fn is_between(a: &Point3<f64>, b: &Point3<f64>, p: &Point3<f64>, near_mm: f64) -> bool {
    (p - a).norm() > near_mm && (p - b).norm() > near_mm
}

/// Divides a facet at points on its sides, one side after the other: each side is whole in one of
/// the pieces until its turn comes.
fn divide(facet: [u32; 3], points: &[OnSide], triangles: &mut Vec<[u32; 3]>) {
    let mut pieces = vec![facet];
    for k in 0..3 {
        let on_side = points.iter().filter(|p| p.half as usize % 3 == k).map(|p| p.vertex);
        let (from, to) = (facet[k], facet[(k + 1) % 3]);
        let rotations = |[a, b, c]: [u32; 3]| [[a, b, c], [b, c, a], [c, a, b]];
        let whole = pieces.iter().enumerate().find_map(|(i, piece)| {
            let begins = |t: &[u32; 3]| t[0] == from && t[1] == to;
            Some((i, rotations(*piece).into_iter().find(begins)?))
        });
        if let Some((i, piece)) = whole {
            pieces.splice(i..=i, split_side(piece, on_side));
        }
    }
    // A vertex in an acute corner may lie on two sides: what is between them is nothing.
    triangles.extend(pieces.into_iter().filter(|piece| repeated(piece).is_none()));
}

/// Divides a triangle at points on its side from corner 0 to corner 1.
fn split_side([a, b, c]: [u32; 3], points: impl Iterator<Item = u32>) -> Vec<[u32; 3]> {
    let mut from = a;
    let mut pieces = Vec::new();
    for to in points.chain([b]) {
        pieces.push([from, to, c]);
        from = to;
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure;

    /// A square of two facets whose sides meet facets with more vertices.
    fn facet_with_points(points: &[(u32, f64)]) -> (usize, Vec<[u32; 3]>, Mesh) {
        let corners = [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]].map(Point3::from);
        let mut mesh = Mesh { vertices: corners.to_vec(), triangles: vec![[0, 1, 2]] };
        for &(side, share) in points {
            let (a, b) = (corners[side as usize], corners[(side as usize + 1) % 3]);
            let out = mesh.vertices.len() as u32;
            mesh.vertices.push(a + (b - a) * share);
            // A facet apart, so that the point is on an open side.
            mesh.vertices.push(Point3::new(50.0, f64::from(out), 0.0));
            mesh.vertices.push(Point3::new(60.0, f64::from(out), 5.0));
            mesh.triangles.push([out, out + 1, out + 2]);
        }
        let mut work = Work::new(mesh);
        let edges = Edges::of(&work.mesh);
        let tally = split(&mut work, &edges, 1e-3);
        let n_more = points.len();
        let pieces = work.mesh.triangles[..work.mesh.triangles.len() - n_more].to_vec();
        assert_eq!(work.windings.len(), work.mesh.triangles.len());
        (tally.count, pieces, work.mesh)
    }

    #[test]
    fn facets_are_split_at_every_point() {
        let cases: [&[(u32, f64)]; 6] = [
            &[(0, 0.5)],
            &[(0, 0.7), (0, 0.2), (0, 0.4)],
            &[(1, 0.5)],
            &[(2, 0.5), (2, 0.1)],
            &[(1, 0.3), (2, 0.6)],
            &[(0, 0.5), (1, 0.5), (2, 0.5), (2, 0.75)],
        ];
        for points in cases {
            let (n, pieces, mesh) = facet_with_points(points);
            assert_eq!((n, pieces.len()), (points.len(), points.len() + 1), "{points:?}");
            let split = Mesh { vertices: mesh.vertices, triangles: pieces };
            assert!((measure::area_mm2(&split) - 40.5).abs() < 1e-9, "{points:?}");
            // The boundary passes through every point: sides of pieces are never longer.
            let edges = Edges::of(&split);
            assert_eq!(edges.open().count(), points.len() + 3, "{points:?}");
            assert_eq!(edges.n_twisted(), 0);
        }
    }

    #[test]
    fn points_beside_the_side_and_at_its_ends_do_not_count() {
        let (n, pieces, _) = facet_with_points(&[(0, 1.0), (0, 1e-5), (1, -0.1)]);
        assert_eq!((n, pieces.len()), (0, 1));
    }
}
