//! Finds the rims of holes.
//!
//! A rim is followed along the surface: at the end of an open side, the fan of triangles around
//! that vertex leads to the next open side. So every rim closes, whatever the mesh. A rim that
//! comes to a vertex twice is cut in two there, because two holes that touch are two holes.

use crate::topology::{Solid, after};

/// The rim of a hole.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rim {
    /// Its vertices, each once, in the direction that facets which fill the hole run along it:
    /// against the facets around the hole.
    pub(super) vertices: Vec<u32>,
    /// The shell around it.
    pub(super) shell: u32,
}

/// Finds the rims of all holes of a solid, in the order of their first sides.
pub(super) fn rims(solid: &Solid) -> Vec<Rim> {
    let triangles = &solid.mesh().triangles;
    let start = |half: u32| triangles[half as usize / 3][half as usize % 3];
    let mut seen = vec![false; 3 * triangles.len()];
    // Where a vertex stands in the rim that is being followed.
    let mut place = vec![usize::MAX; solid.mesh().vertices.len()];
    let mut rims = Vec::new();
    for first in solid.open_halves() {
        if seen[first as usize] {
            continue;
        }
        let shell = solid.shell_of()[first as usize / 3];
        let mut path: Vec<u32> = Vec::new();
        let mut half = first;
        while !seen[half as usize] {
            seen[half as usize] = true;
            let v = start(half);
            if place[v as usize] != usize::MAX {
                let rest = path.split_off(place[v as usize]);
                rest.iter().for_each(|u| place[*u as usize] = usize::MAX);
                push(&mut rims, rest, shell);
            }
            place[v as usize] = path.len();
            path.push(v);
            half = next_open(solid, half);
        }
        path.iter().for_each(|u| place[*u as usize] = usize::MAX);
        push(&mut rims, path, shell);
    }
    rims
}

fn push(rims: &mut Vec<Rim>, mut vertices: Vec<u32>, shell: u32) {
    vertices.reverse();
    rims.push(Rim { vertices, shell });
}

/// The open side after `half` around the vertex at its end.
fn next_open(solid: &Solid, half: u32) -> u32 {
    let mut at = after(half);
    while let Some(mate) = solid.mate(at) {
        at = after(mate);
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::shapes;

    fn rims_without(mesh: Mesh, missing: &[usize]) -> Vec<Vec<u32>> {
        let mut mesh = mesh;
        let mut i = 0;
        mesh.triangles.retain(|_| {
            i += 1;
            !missing.contains(&(i - 1))
        });
        rims(&Solid::new(mesh)).into_iter().map(|rim| rim.vertices).collect()
    }

    #[test]
    fn a_missing_facet_leaves_its_own_rim() {
        let cube = shapes::cube(20.0);
        let rims = rims_without(cube.clone(), &[4]);
        assert_eq!(rims.len(), 1);
        let [a, b, c] = cube.triangles[4];
        assert!([[a, b, c], [b, c, a], [c, a, b]].iter().any(|r| r[..] == rims[0]));
    }

    #[test]
    fn holes_that_touch_are_two() {
        // Two facets of a sphere that share a vertex only.
        let sphere = shapes::icosphere(1, 10.0);
        let a = 0;
        let shared = |t: &[u32; 3]| sphere.triangles[a].iter().filter(|v| t.contains(v)).count();
        let b = sphere.triangles.iter().position(|t| shared(t) == 1).unwrap();
        let rims = rims_without(sphere.clone(), &[a, b]);
        assert_eq!(rims.iter().map(Vec::len).collect::<Vec<_>>(), [3, 3]);
    }

    #[test]
    fn a_closed_surface_has_none() {
        assert!(rims(&Solid::new(shapes::torus(20.0, 5.0, 12, 8))).is_empty());
    }
}
