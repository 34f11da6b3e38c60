//! How far a place is from the surface of the mesh. mm, part frame.

use geom::bounding::{Bounds, BoxTree};
use mesh::mesh::Mesh;
use nalgebra::Point3;

/// A mesh, ready to be asked.
pub struct Nearest {
    facets: Vec<[Point3<f64>; 3]>,
    tree: BoxTree,
}

impl Nearest {
    /// Prepares to ask about `mesh`. Facets that are not finite or name no vertex are left out.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Self {
        let facets: Vec<[Point3<f64>; 3]> = mesh
            .triangles
            .iter()
            .filter_map(|named| {
                let corner = |k: usize| mesh.vertices.get(named[k] as usize).copied();
                Some([corner(0)?, corner(1)?, corner(2)?])
            })
            .filter(|facet| facet.iter().all(|p| p.coords.iter().all(|c| c.is_finite())))
            .collect();
        let tree = BoxTree::new(facets.iter().map(Bounds::of).collect());
        Self { facets, tree }
    }

    /// Returns the distance of `p` from the nearest facet; infinite when it is more than `most`.
    #[must_use]
    pub fn distance(&self, p: &Point3<f64>, most: f64) -> f64 {
        let around = Bounds::of([p]).grown(most);
        let near = self.tree.meeting(&around);
        let distance = near
            .iter()
            .map(|&facet| distance_to_facet(&self.facets[facet as usize], p))
            .fold(f64::INFINITY, f64::min);
        if distance <= most { distance } else { f64::INFINITY }
    }
}

impl std::fmt::Debug for Nearest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Nearest").field("facets", &self.facets.len()).finish_non_exhaustive()
    }
}

/// The foot of the perpendicular where that lies in the facet, the nearest side otherwise.
fn distance_to_facet([a, b, c]: &[Point3<f64>; 3], p: &Point3<f64>) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let is_over = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|(from, to)| normal.dot(&(*to - *from).cross(&(p - *from))) >= 0.0);
    let square = normal.norm_squared();
    if is_over && square > 0.0 {
        return (p - a).dot(&normal).abs() / square.sqrt();
    }
    let side = |from: &Point3<f64>, to: &Point3<f64>| {
        let along = to - from;
        let square = along.norm_squared();
        let share = if square > 0.0 { (p - from).dot(&along) / square } else { 0.0 };
        (p - (from + along * share.clamp(0.0, 1.0))).norm()
    };
    side(a, b).min(side(b, c)).min(side(c, a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section::tests::block;

    #[test]
    fn distances_from_a_block() {
        let nearest = Nearest::new(&block(10.0, 0.0, 8.0, 0.0));
        for (p, expected) in [
            ([0.0, 0.0, 9.0], 1.0),
            ([0.0, 1.0, 7.5], 0.5),
            ([11.0, 11.0, 4.0], 2.0_f64.sqrt()),
            ([11.0, -11.0, -1.0], 3.0_f64.sqrt()),
            ([10.0, 3.0, 8.0], 0.0),
            ([0.0, 0.0, 4.0], f64::INFINITY),
        ] {
            let found = nearest.distance(&Point3::from(p), 2.0);
            assert!(found == expected || (found - expected).abs() < 1e-12, "{p:?} {found}");
        }
    }

    #[test]
    fn distance_is_that_of_a_fine_search() {
        let share = |i: u32, step: f64| (f64::from(i) * step).fract() * 4.0 - 2.0;
        for i in 0..300 {
            let point = |k: u32| {
                Point3::new(
                    share(7 * i + k, 0.618_034),
                    share(7 * i + k, 0.414_214),
                    share(7 * i + k, 0.732_051),
                )
            };
            let (facet, p) = ([point(0), point(1), point(2)], point(3));
            let mut least = f64::INFINITY;
            for u in 0..=60 {
                for v in 0..=60 - u {
                    let [u, v] = [u, v].map(|n| f64::from(n) / 60.0);
                    let at = facet[0] + (facet[1] - facet[0]) * u + (facet[2] - facet[0]) * v;
                    least = least.min((at - p).norm());
                }
            }
            let found = distance_to_facet(&facet, &p);
            assert!(found <= least + 1e-12 && least <= found + 0.08, "{found} {least}");
        }
    }
}
