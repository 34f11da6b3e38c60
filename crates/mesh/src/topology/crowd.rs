//! Pairs the triangles at an edge that more than two of them use.
//!
//! Looking along the edge from its lower to its higher end, let a triangle lie at the angle φ of
//! its third corner. A triangle that runs *up* the edge (lower to higher end) has its normal at
//! φ + 90°, so its material lies at smaller angles; one that runs *down* has it at larger ones.
//! So each up is paired with the previous down, nested like brackets, around the circle: the two
//! enclose material. What finds no partner stays open.

use super::NONE;
use super::edges::runs_up;
use crate::mesh::Mesh;
use nalgebra::Vector3;
use std::cmp::Ordering;

/// Triangles closer than this in angle lie in one plane, rad. Facets of one wall that is split by
/// different diagonals differ by the rounding of their corners, up to 1e-7. Where planes agree,
/// ups go first: two solids that share a wall then stay two, each with its own side. Of several
/// ups or downs, those with a twin (the same triangle the other way round) lie side by side, so
/// that others find each other past them.
const SAME_ANGLE_RAD: f64 = 1e-6;

/// Returns pairs of half-edges that enclose material, then half-edges that stay open (with
/// [`NONE`]).
pub(super) fn pairs(mesh: &Mesh, ends: [u32; 2], halves: &[u32]) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    let mut downs = Vec::new();
    let mut ups = Vec::new();
    for half in around(mesh, ends, halves) {
        if !runs_up(mesh, half) {
            downs.push(half);
        } else if let Some(down) = downs.pop() {
            pairs.push([down, half]);
        } else {
            ups.push(half);
        }
    }
    // Going round once more, the first ups meet the last downs.
    let mut open = Vec::new();
    for up in ups {
        match downs.pop() {
            Some(down) => pairs.push([down, up]),
            None => open.push([up, NONE]),
        }
    }
    open.extend(downs.into_iter().map(|down| [down, NONE]));
    pairs.extend(open);
    pairs
}

/// The half-edges by their angle about the edge.
fn around(mesh: &Mesh, ends: [u32; 2], halves: &[u32]) -> Vec<u32> {
    let [low, high] = ends.map(|v| mesh.vertices[v as usize]);
    let axis = (high - low).try_normalize(0.0).unwrap_or_default();
    let arm = |half: u32| -> Vector3<f64> {
        let to_third = mesh.vertices[third(mesh, half) as usize] - low;
        to_third - axis * axis.dot(&to_third)
    };
    let zero = halves.iter().find_map(|&half| arm(half).try_normalize(0.0)).unwrap_or_default();
    let quarter = axis.cross(&zero);
    let angle = |half: u32| {
        let arm = arm(half);
        let angle = arm.dot(&quarter).atan2(arm.dot(&zero));
        if angle < -SAME_ANGLE_RAD { angle + std::f64::consts::TAU } else { angle }
    };
    let mut order: Vec<(f64, u32)> = halves.iter().map(|&half| (angle(half), half)).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let same_plane = |a: &(f64, u32), b: &(f64, u32)| b.0 - a.0 <= SAME_ANGLE_RAD;
    let planes = order.chunk_by(same_plane);
    planes.flat_map(|plane| in_plane(mesh, plane.iter().map(|(_, half)| *half))).collect()
}

/// The half-edges of one plane in their order.
fn in_plane(mesh: &Mesh, halves: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut halves: Vec<u32> = halves.collect();
    if halves.len() == 1 {
        return halves;
    }
    let mut sides: Vec<(u32, bool)> =
        halves.iter().map(|half| (third(mesh, *half), runs_up(mesh, *half))).collect();
    sides.sort_unstable();
    let rank = |half: u32| {
        let up = runs_up(mesh, half);
        let has_twin = sides.binary_search(&(third(mesh, half), !up)).is_ok();
        match (up, has_twin) {
            (true, false) => 0,
            (true, true) => 1,
            (false, true) => 2,
            (false, false) => 3,
        }
    };
    let position = |half: u32| mesh.vertices[third(mesh, half) as usize];
    halves.sort_unstable_by(|a, b| {
        let (p, q) = (position(*a), position(*b));
        let by_axis = (0..3).map(|axis| p[axis].total_cmp(&q[axis]));
        by_axis.fold(rank(*a).cmp(&rank(*b)), Ordering::then).then(a.cmp(b))
    });
    halves
}

/// The corner of a half-edge's triangle that lies across from it.
fn third(mesh: &Mesh, half: u32) -> u32 {
    mesh.triangles[half as usize / 3][(half as usize + 2) % 3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    /// An upright edge with a triangle at each angle (degrees); `true` runs up.
    fn star(blades: &[(f64, bool)]) -> Vec<[u32; 2]> {
        let vertices = vec![Point3::origin(), Point3::new(0.0, 0.0, 5.0)];
        let mut mesh = Mesh { vertices, triangles: Vec::new() };
        for (i, &(angle_deg, up)) in blades.iter().enumerate() {
            let (sin, cos) = angle_deg.to_radians().sin_cos();
            mesh.vertices.push(Point3::new(3.0 * cos, 3.0 * sin, i as f64));
            let third = i as u32 + 2;
            mesh.triangles.push(if up { [0, 1, third] } else { [1, 0, third] });
        }
        let halves: Vec<u32> = (0..blades.len() as u32).map(|t| 3 * t).collect();
        let mut pairs = pairs(&mesh, [0, 1], &halves);
        // Triangles instead of half-edges.
        pairs.iter_mut().flatten().filter(|h| **h != NONE).for_each(|h| *h /= 3);
        pairs.sort_unstable();
        pairs
    }

    #[test]
    fn pairs_enclose_material() {
        // Material from 10° to 80° and from 100° to 170°, whatever the order.
        let blades = [(10.0, false), (80.0, true), (100.0, false), (170.0, true)];
        assert_eq!(star(&blades), [[0, 1], [2, 3]]);
        let blades = [(170.0, true), (80.0, true), (10.0, false), (100.0, false)];
        assert_eq!(star(&blades), [[2, 1], [3, 0]]);
        // Across the zero of the angle.
        let blades = [(80.0, true), (200.0, false), (250.0, true), (300.0, false)];
        assert_eq!(star(&blades), [[1, 2], [3, 0]]);
    }

    #[test]
    fn a_shared_wall_keeps_its_two_faces() {
        let blades = [(0.0, false), (90.0, true), (90.0, false), (180.0, true)];
        assert_eq!(star(&blades), [[0, 1], [2, 3]]);
    }

    #[test]
    fn a_fin_stays_open() {
        let blades = [(270.0, false), (0.0, true), (90.0, true)];
        assert_eq!(star(&blades), [[0, 1], [2, NONE]]);
    }

    #[test]
    fn nested_solids_pair_like_brackets() {
        let blades = [(0.0, false), (10.0, false), (20.0, true), (90.0, true)];
        assert_eq!(star(&blades), [[0, 3], [1, 2]]);
    }
}
