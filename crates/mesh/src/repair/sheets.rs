//! Finds surfaces that enclose nothing: they cannot be printed, and closing them makes no sense.

use super::Joined;
use crate::inside::{distance_to, odd_point};
use crate::mesh::Mesh;
use crate::note::Tally;
use crate::topology::{Shell, Solid};
use crate::weld::steps_mm;
use geom::bounding::{Bounds, BoxTree};
use nalgebra::Vector3;

/// A shell thinner than this many steps of the file's `f32` has no thickness: its two faces
/// differ by the rounding of their corners. Steps count in the direction of the thickness: a plate
/// of 10 km by 0.2 mm has coarse numbers along it and fine ones across.
const THIN_STEPS: f64 = 2.0;

/// No shell thicker than this share of its own diagonal is called thin, however coarse the
/// numbers are: far from the origin a step is as large as the part.
const THIN_SHARE: f64 = 1e-6;

/// Removes open shells that lie in a plane, to within `near_mm`; returns whether there were any.
pub(super) fn drop_flat(joined: Joined, near_mm: f64, dropped: &mut Tally) -> (Joined, bool) {
    let solid = &joined.solid;
    let open: Vec<bool> = solid.shells().iter().map(|s| !s.is_closed()).collect();
    let facets = facets_of(solid, &open);
    let is_flat = |shell: usize| open[shell] && is_flat(solid.mesh(), &facets[shell], |_| near_mm);
    let flat: Vec<bool> = (0..open.len()).map(is_flat).collect();
    drop_marked(joined, &flat, dropped)
}

/// Removes closed shells without thickness; returns whether there were any.
pub(super) fn drop_empty(joined: Joined, dropped: &mut Tally) -> (Joined, bool) {
    let solid = &joined.solid;
    let steps = steps_mm(&solid.mesh().bounds()) * THIN_STEPS;
    let thin: Vec<bool> =
        solid.shells().iter().map(|s| s.is_closed() && is_thin(s, steps.sum())).collect();
    if !thin.contains(&true) {
        return (joined, false);
    }
    let facets = facets_of(solid, &thin);
    let rounding = |normal: &Vector3<f64>| normal.abs().dot(&steps);
    let is_empty = |shell: usize| {
        let own = &facets[shell];
        thin[shell]
            && (is_flat(solid.mesh(), own, rounding) || is_doubled(solid.mesh(), own, rounding))
    };
    let empty: Vec<bool> = (0..thin.len()).map(is_empty).collect();
    drop_marked(joined, &empty, dropped)
}

fn drop_marked(joined: Joined, marked: &[bool], dropped: &mut Tally) -> (Joined, bool) {
    if marked.contains(&true) { (joined.without(marked, dropped), true) } else { (joined, false) }
}

/// The facets of the shells that are wanted.
fn facets_of(solid: &Solid, wanted: &[bool]) -> Vec<Vec<u32>> {
    let mut facets = vec![Vec::new(); wanted.len()];
    for (t, &shell) in (0..).zip(solid.shell_of()) {
        if wanted[shell as usize] {
            facets[shell as usize].push(t);
        }
    }
    facets
}

/// Whether the mean distance between the two faces of a shell may be nothing.
///
/// Volume alone does not tell: a shell that crosses itself may enclose as much one way as the
/// other. So what is thin by this measure is looked at again.
fn is_thin(shell: &Shell, rounding: f64) -> bool {
    let limit = rounding.min(THIN_SHARE * shell.bounds.diagonal());
    2.0 * shell.volume_mm3.abs() <= limit * shell.area_mm2
}

/// Whether all corners of some facets lie in a plane; `limit` says how far off they may be along
/// the normal.
fn is_flat(mesh: &Mesh, facets: &[u32], limit: impl Fn(&Vector3<f64>) -> f64) -> bool {
    let mut normal = Vector3::zeros();
    for &t in facets {
        // Facets on the two faces of a sheet point opposite ways.
        let n = mesh.area_vector(t);
        normal += if n.dot(&normal) < 0.0 { -n } else { n };
    }
    let Some(normal) = normal.try_normalize(0.0) else {
        return true;
    };
    let Some(&first) = facets.first() else { return true };
    let origin = mesh.corners(first)[0];
    let limit = limit(&normal);
    let apart = |t: &u32| mesh.corners(*t).map(|p| (p - origin).dot(&normal).abs());
    facets.iter().flat_map(apart).all(|d| d <= limit)
}

/// Whether every facet has another at its back; `limit` says how far that may be along its
/// normal.
fn is_doubled(mesh: &Mesh, facets: &[u32], limit: impl Fn(&Vector3<f64>) -> f64) -> bool {
    let boxes = facets.iter().map(|t| Bounds::of(&mesh.corners(*t))).collect();
    let tree = BoxTree::new(boxes);
    facets.iter().all(|&t| {
        let Some(normal) = mesh.area_vector(t).try_normalize(0.0) else { return true };
        let limit = limit(&normal);
        let p = odd_point(&mesh.corners(t));
        let near = tree.meeting(&Bounds::of([&p]).grown(limit));
        near.into_iter().map(|i| facets[i as usize]).any(|other| {
            let faces_away = mesh.area_vector(other).dot(&normal) < 0.0;
            faces_away && distance_to(&mesh.corners(other), &p) <= limit
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repair::Work;
    use crate::shapes;
    use nalgebra::Point3;

    fn joined(mesh: Mesh) -> Joined {
        Joined::new(Work::new(mesh))
    }

    /// A curved sheet of `n` by `n` squares with two faces, the second over other diagonals.
    fn sheet_with_two_faces(n: u32) -> Mesh {
        let mut mesh = Mesh::default();
        let at = |i: u32, j: u32| i * (n + 1) + j;
        for i in 0..=n {
            for j in 0..=n {
                let (x, y) = (f64::from(i), f64::from(j));
                mesh.vertices.push(Point3::new(x, y, 0.1 * x * x));
            }
        }
        for i in 0..n {
            for j in 0..n {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                mesh.triangles.extend([[a, b, c], [a, c, d], [a, d, b], [b, d, c]]);
            }
        }
        mesh
    }

    #[test]
    fn sheets_with_two_faces_are_empty() {
        let mut tally = Tally::default();
        let (left, changed) = drop_empty(joined(sheet_with_two_faces(5)), &mut tally);
        assert!(changed && tally.count >= 1);
        assert!(left.solid.mesh().triangles.is_empty());
    }

    #[test]
    fn thin_solids_are_not_empty() {
        let wide = shapes::block(1e7, 1e7, 0.2);
        let sheet = shapes::block(20.0, 20.0, 0.01);
        for mesh in [sheet, wide, shapes::cube(1e-3), shapes::cube(2e-5)] {
            let (_, changed) = drop_empty(joined(mesh), &mut Tally::default());
            assert!(!changed);
        }
    }

    #[test]
    fn a_figure_of_eight_is_not_empty() {
        let bow = [[-10.0, -10.0], [10.0, 10.0], [10.0, -10.0], [-10.0, 10.0]];
        let level = |z: f64| bow.iter().map(move |[x, y]| Point3::new(*x, *y, z));
        let mut mesh =
            Mesh { vertices: level(0.0).chain(level(20.0)).collect(), triangles: vec![] };
        for i in 0..4 {
            let (a, b) = (i, (i + 1) % 4);
            mesh.triangles.extend([[a, b, b + 4], [a, b + 4, a + 4]]);
        }
        mesh.triangles.extend([[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]]);
        let joined = joined(mesh);
        assert_eq!(joined.solid.open_sides(), 0);
        assert!(joined.solid.shells()[0].volume_mm3.abs() < 1e-9);
        assert!(!drop_empty(joined, &mut Tally::default()).1);
    }

    #[test]
    fn flat_and_curved_open_shells() {
        let mut cube = shapes::cube(20.0);
        cube.triangles.truncate(2);
        assert!(drop_flat(joined(cube), 1e-3, &mut Tally::default()).1);
        let mut cube = shapes::cube(20.0);
        cube.triangles.truncate(4);
        cube.triangles.remove(0);
        let (left, changed) = drop_flat(joined(cube), 1e-3, &mut Tally::default());
        // A lone facet goes, two facets of the top go: both are flat.
        assert!(changed && left.solid.mesh().triangles.is_empty());
    }
}
