//! Cuts a solid at a height: what is below, or above, with the cut closed.
//!
//! A vertex at the height itself belongs to what is kept. Every side of the surface that leaves it
//! gives one point, whatever the triangle, so the cut runs in rings; they are filled by the even-odd
//! rule. Where the rings of shells cross, the cut stays open for a repair to close. Part frame, mm.

use crate::mesh::Mesh;
use crate::soup::{Facet, Soup};
use crate::topology::Solid;
use geom::triangulate::triangulate;
use nalgebra::{Point2, Point3};

/// What is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keep {
    /// What is below the cut.
    Lower,
    /// What is above it.
    Upper,
}

/// A vertex that is nearer to the cut than this is on it, mm: the last digit of single precision at
/// 100 mm. Sides beside it would cross the cut in points that are one but for rounding.
const ON_CUT_MM: f64 = 1e-5;

/// Marks that no side follows.
const NONE: u32 = u32::MAX;

/// Returns the facets of what a cut leaves, the cut among them.
#[must_use]
pub fn cut(solid: &Solid, height: f64, keep: Keep) -> Soup {
    let mesh = solid.mesh();
    let is_kept = |p: &Point3<f64>| {
        let is_inside = if keep == Keep::Lower { p.z < height } else { p.z > height };
        is_inside || is_on(p, height)
    };
    let is_kept: Vec<bool> = mesh.vertices.iter().map(is_kept).collect();
    let mut facets = Vec::with_capacity(mesh.triangles.len());
    // The side at which a ring goes on, after each.
    let mut next = vec![NONE; solid.n_sides()];
    for (corners, sides) in mesh.triangles.iter().zip(solid.sides()) {
        let kept = corners.map(|v| is_kept[v as usize]);
        let mut outline: Vec<Point3<f64>> = Vec::with_capacity(4);
        let (mut leaves, mut enters) = (NONE, NONE);
        for k in 0..3 {
            let after = (k + 1) % 3;
            if kept[k] {
                outline.push(settled(&mesh.vertices[corners[k] as usize], height));
            }
            if kept[k] != kept[after] {
                outline.push(crossing(mesh, solid.ends(sides[k]), height));
                *(if kept[k] { &mut leaves } else { &mut enters }) = sides[k];
            }
        }
        for pair in outline.get(1..).unwrap_or_default().windows(2) {
            facets.push(facet([outline[0], pair[0], pair[1]]));
        }
        if leaves != NONE {
            next[enters as usize] = leaves;
        }
    }
    fill(solid, height, keep, &mut next, &mut facets);
    Soup { facets }
}

fn is_on(p: &Point3<f64>, height: f64) -> bool {
    (p.z - height).abs() <= ON_CUT_MM
}

/// A vertex, exactly at the height when it is on the cut.
fn settled(p: &Point3<f64>, height: f64) -> Point3<f64> {
    if is_on(p, height) { Point3::new(p.x, p.y, height) } else { *p }
}

/// Where a side crosses a height.
fn crossing(mesh: &Mesh, ends: [u32; 2], height: f64) -> Point3<f64> {
    let [a, b] = ends.map(|v| mesh.vertices[v as usize]);
    if let Some(end) = [a, b].iter().find(|p| is_on(p, height)) {
        return settled(end, height);
    }
    let p = a + (b - a) * ((height - a.z) / (b.z - a.z));
    Point3::new(p.x, p.y, height)
}

/// Adds the facets of the cut; what is left of `next` are its sides in rings.
fn fill(solid: &Solid, height: f64, keep: Keep, next: &mut [u32], facets: &mut Vec<Facet>) {
    let mut rings: Vec<Vec<Point2<f64>>> = Vec::new();
    for start in 0..next.len() {
        let mut ring = Vec::new();
        let mut at = start;
        while next[at] != NONE {
            ring.push(rounded(&crossing(solid.mesh(), solid.ends(at as u32), height)));
            at = std::mem::replace(&mut next[at], NONE) as usize;
        }
        // A chain that ends elsewhere is the border of an open surface.
        if ring.len() > 2 && at == start {
            rings.push(ring);
        }
    }
    let Ok(filled) = triangulate(&rings) else { return };
    let points: Vec<Point2<f64>> = rings.into_iter().flatten().collect();
    for [a, b, c] in filled.triangles {
        let [b, c] = if keep == Keep::Lower { [b, c] } else { [c, b] };
        let corners = [a, b, c].map(|v| points[v as usize]);
        facets.push(facet(corners.map(|p| Point3::new(p.x, p.y, height))));
    }
}

/// A point of a ring as the facets have it.
fn rounded(p: &Point3<f64>) -> Point2<f64> {
    Point2::new(f64::from(p.x as f32 + 0.0), f64::from(p.y as f32 + 0.0))
}

fn facet(corners: [Point3<f64>; 3]) -> Facet {
    corners.map(|p| [p.x as f32 + 0.0, p.y as f32 + 0.0, p.z as f32 + 0.0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::health::solid_from_soup;
    use crate::{measure, shapes};

    /// Volume and heights of a part of a shape, which must be closed without a repair.
    fn part(mesh: Mesh, height: f64, keep: Keep) -> (f64, f64, f64) {
        let (solid, health) = solid_from_soup(&cut(&Solid::new(mesh), height, keep)).unwrap();
        assert_eq!(solid.open_sides(), 0, "{:?}", health.notes);
        assert_eq!(health.open_edges, 0, "{:?}", health.notes);
        let bounds = solid.mesh().bounds();
        (measure::volume_mm3(solid.mesh()), bounds.min.z, bounds.max.z)
    }

    #[test]
    fn both_parts_are_closed_and_make_the_whole() {
        for name in shapes::NAMES {
            let mesh = shapes::by_name(name).unwrap();
            let bounds = mesh.bounds();
            let whole = measure::volume_mm3(&mesh);
            for share in [0.1, 0.37, 0.5, 0.9] {
                let height = bounds.min.z + share * bounds.size().z;
                let lower = part(mesh.clone(), height, Keep::Lower);
                let upper = part(mesh.clone(), height, Keep::Upper);
                let off = (lower.0 + upper.0 - whole).abs();
                assert!(off < 1e-4 * whole, "{name} at {height}: {off} of {whole}");
                assert!((lower.2 - height).abs() < 1e-4 && (upper.1 - height).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn a_cut_at_a_face_goes_along_it() {
        // Steps at 3.07, 7.33, 11.9 and 15, of 288 mm² each.
        let lower = part(shapes::steps(), 7.33, Keep::Lower);
        assert!((lower.0 - 288.0 * (3.07 + 3.0 * 7.33)).abs() < 0.1, "{lower:?}");
        let upper = part(shapes::steps(), 7.33, Keep::Upper);
        assert!((upper.0 - 288.0 * (11.9 + 15.0 - 2.0 * 7.33)).abs() < 0.1, "{upper:?}");
        assert!((part(shapes::steps(), 99.0, Keep::Lower).0 - 10_742.4).abs() < 0.01);
        assert!(cut(&Solid::new(shapes::steps()), 99.0, Keep::Upper).facets.is_empty());
    }

    #[test]
    fn a_tube_stays_a_tube() {
        let outline = [[-10.0, -10.0], [10.0, -10.0], [10.0, 10.0], [-10.0, 10.0]];
        let hole = vec![[-5.0, -5.0], [-5.0, 5.0], [5.0, 5.0], [5.0, -5.0]];
        let tube = shapes::extruded(&outline, &[hole], 20.0);
        let lower = part(tube, 7.0, Keep::Lower);
        assert!((lower.0 - 300.0 * 7.0).abs() < 1e-3, "{lower:?}");
    }
}
