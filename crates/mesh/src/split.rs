//! Takes a solid apart into its bodies: each an outer surface with the cavities within it.
//!
//! A cavity belongs to the smallest body whose box holds its box; where none does, it is dropped. Bodies
//! that touch or overlap stay apart, as their surfaces are. Frame and unit are those of the solid.

use geom::bounding::Bounds;

use crate::mesh::Mesh;
use crate::topology::{Shell, Solid};

/// Returns the bodies of a solid, in the order of their first facets. A solid of one body comes back as it
/// is but for its cavities that lie in no body.
#[must_use]
pub fn bodies(solid: &Solid) -> Vec<Mesh> {
    let shells = solid.shells();
    let bodies: Vec<usize> = (0..shells.len()).filter(|k| !is_cavity(&shells[*k])).collect();
    let body_of: Vec<Option<usize>> = (0..shells.len()).map(|k| home(k, shells, &bodies)).collect();
    let mut facets = vec![Vec::new(); bodies.len()];
    for (corners, &shell) in solid.mesh().triangles.iter().zip(solid.shell_of()) {
        if let Some(body) = body_of[shell as usize] {
            facets[body].push(*corners);
        }
    }
    facets.into_iter().map(|facets| part(solid.mesh(), facets)).collect()
}

/// Returns how many bodies a solid has.
#[must_use]
pub fn count(solid: &Solid) -> usize {
    solid.shells().iter().filter(|shell| !is_cavity(shell)).count()
}

/// A mesh of some facets of another and of the vertices that they use, in their order.
fn part(whole: &Mesh, mut triangles: Vec<[u32; 3]>) -> Mesh {
    let mut used: Vec<u32> = triangles.as_flattened().to_vec();
    used.sort_unstable();
    used.dedup();
    for v in triangles.as_flattened_mut() {
        *v = used.partition_point(|other| other < v) as u32;
    }
    let vertices = used.iter().map(|v| whole.vertices[*v as usize]).collect();
    Mesh { vertices, triangles }
}

fn is_cavity(shell: &Shell) -> bool {
    shell.is_closed() && shell.volume_mm3 < 0.0
}

/// The body that a shell is part of, by its place among `bodies`.
fn home(shell: usize, shells: &[Shell], bodies: &[usize]) -> Option<usize> {
    let own = bodies.binary_search(&shell).ok();
    own.or_else(|| {
        let around = (0..bodies.len())
            .filter(|body| holds(&shells[bodies[*body]].bounds, &shells[shell].bounds));
        around.min_by(|a, b| {
            let volume = |body: &usize| shells[bodies[*body]].volume_mm3;
            volume(a).total_cmp(&volume(b))
        })
    })
}

fn holds(outer: &Bounds, inner: &Bounds) -> bool {
    (0..3).all(|k| outer.min[k] <= inner.min[k] && inner.max[k] <= outer.max[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::volume_mm3;
    use crate::shapes;
    use nalgebra::Isometry3;

    fn together(meshes: &[Mesh]) -> Solid {
        let mut all = Mesh::default();
        for mesh in meshes {
            let first = all.vertices.len() as u32;
            all.vertices.extend(&mesh.vertices);
            all.triangles.extend(mesh.triangles.iter().map(|corners| corners.map(|v| v + first)));
        }
        Solid::new(all)
    }

    #[test]
    fn cavities_stay_with_their_bodies() {
        let at = |size: f64, x: f64| {
            let moved = Isometry3::translation(x, 0.0, 20.0 - size / 2.0);
            shapes::cube(size).transformed(&moved)
        };
        let mut cavity = at(10.0, 50.0);
        cavity.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        let parts = bodies(&together(&[at(20.0, 0.0), cavity, at(20.0, 50.0), at(4.0, 50.0)]));
        let volumes: Vec<f64> = parts.iter().map(|part| volume_mm3(part).round()).collect();
        assert_eq!(volumes, [8000.0, 7000.0, 64.0]);
        assert!(parts.iter().all(|part| part.check().is_ok() && !part.has_unused_vertices()));
        assert_eq!(parts[0].vertices.len(), 8);
        let cubes: Vec<Mesh> = (0..9).map(|k| at(4.0, 10.0 * f64::from(k))).collect();
        assert_eq!(count(&together(&cubes)), 9);
    }

    #[test]
    fn one_body_stays_whole() {
        for name in shapes::NAMES {
            let mesh = shapes::by_name(name).unwrap();
            let parts = bodies(&Solid::new(mesh.clone()));
            assert_eq!(parts, [mesh], "{name}");
        }
    }
}
