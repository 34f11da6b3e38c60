//! Finds the rims of holes.
//!
//! A rim is followed along the surface: at the end of an open side, the fan of triangles around
//! that vertex leads to the next open side. Where several fans meet in a vertex a hole lies
//! between two of them, so that the rim goes on along another fan, the one that lies nearest: a
//! piece that hangs in a surface by its corners alone has holes around it that both bound. So
//! every rim closes, whatever the mesh. A rim that comes to a vertex twice is cut in two there,
//! because two holes that touch are two holes.

use crate::topology::{Solid, after};
use std::cmp::Ordering;
use std::collections::HashMap;
use std::iter::zip;

/// The rim of a hole.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rim {
    /// Its vertices, each once, in the direction that facets which fill the hole run along it:
    /// against the facets around the hole.
    pub(super) vertices: Vec<u32>,
    /// The shell around it; of several, the one of the greatest area.
    pub(super) shell: u32,
}

/// Finds the rims of all holes of a solid. Where they begin, and in which order they come, is a
/// matter of positions: the order of the facets is all one.
pub(super) fn rims(solid: &Solid) -> Vec<Rim> {
    let mut seen = vec![false; 3 * solid.mesh().triangles.len()];
    // Where a vertex stands in the rim that is being followed.
    let mut place = vec![usize::MAX; solid.mesh().vertices.len()];
    let crossings = crossings(solid);
    let mut rims = Vec::new();
    let mut firsts: Vec<u32> = solid.open_halves().collect();
    firsts.sort_unstable_by(|a, b| by_place(solid, *a, *b));
    for first in firsts {
        let mut path: Vec<u32> = Vec::new();
        let mut half = first;
        while !seen[half as usize] {
            seen[half as usize] = true;
            let v = start(solid, half) as usize;
            if place[v] != usize::MAX {
                let rest = path.split_off(place[v]);
                rest.iter().for_each(|h| place[start(solid, *h) as usize] = usize::MAX);
                rims.push(rim(solid, &rest));
            }
            place[v] = path.len();
            path.push(half);
            half = crossings.get(&half).copied().unwrap_or_else(|| next_open(solid, half));
        }
        path.iter().for_each(|h| place[start(solid, *h) as usize] = usize::MAX);
        if !path.is_empty() {
            rims.push(rim(solid, &path));
        }
    }
    rims
}

/// The vertex at which a side begins.
fn start(solid: &Solid, half: u32) -> u32 {
    solid.mesh().triangles[half as usize / 3][half as usize % 3]
}

/// Orders sides by where they begin and end.
fn by_place(solid: &Solid, a: u32, b: u32) -> Ordering {
    let position = |half: u32| &solid.mesh().vertices[start(solid, half) as usize];
    let ends = |half: u32| [position(half), position(after(half))];
    let (a_ends, b_ends) = (ends(a), ends(b));
    let coordinates = zip(a_ends, b_ends).flat_map(|(p, q)| zip(&p.coords, &q.coords));
    let mut by_axis = coordinates.map(|(p, q)| p.total_cmp(q));
    by_axis.find(|order| order.is_ne()).unwrap_or_else(|| a.cmp(&b))
}

/// The rim that open sides form.
fn rim(solid: &Solid, path: &[u32]) -> Rim {
    let shells = path.iter().map(|half| solid.shell_of()[*half as usize / 3]);
    let area = |shell: &u32| solid.shells()[*shell as usize].area_mm2;
    // Of equal areas the first of the path.
    let shell = shells.rev().max_by(|a, b| area(a).total_cmp(&area(b))).expect("a rim has sides");
    Rim { vertices: path.iter().rev().map(|half| start(solid, *half)).collect(), shell }
}

/// The open side after `half` around the vertex at its end.
fn next_open(solid: &Solid, half: u32) -> u32 {
    let mut at = after(half);
    while let Some(mate) = solid.mate(at) {
        at = after(mate);
    }
    at
}

/// In a vertex of more fans than this each rim keeps to its own: pairs are compared each with
/// each.
const MOST_FANS: usize = 32;

/// A fan of triangles that ends in open sides on both hands.
struct Fan {
    vertex: u32,
    /// The open side that ends in the vertex, and the one that begins there.
    comes: u32,
    goes: u32,
}

/// For open sides that end where several fans meet, the open side that bounds the same hole.
fn crossings(solid: &Solid) -> HashMap<u32, u32> {
    let fan = |comes: u32| {
        let goes = next_open(solid, comes);
        Fan { vertex: start(solid, goes), comes, goes }
    };
    let mut fans: Vec<Fan> = solid.open_halves().map(fan).collect();
    fans.sort_unstable_by(|a, b| a.vertex.cmp(&b.vertex).then(by_place(solid, a.goes, b.goes)));
    let mut crossings = HashMap::new();
    for meeting in fans.chunk_by(|a, b| a.vertex == b.vertex) {
        if (2..=MOST_FANS).contains(&meeting.len()) {
            cross(solid, meeting, &mut crossings);
        }
    }
    crossings
}

/// Pairs the fans that meet in a vertex, those with the least angle between them first.
fn cross(solid: &Solid, fans: &[Fan], crossings: &mut HashMap<u32, u32>) {
    let position = |half: u32| solid.mesh().vertices[start(solid, half) as usize];
    let angle = |from: &Fan, to: &Fan| {
        let vertex = position(to.goes);
        (position(from.comes) - vertex).angle(&(position(after(to.goes)) - vertex))
    };
    let mut pairs = Vec::new();
    for (i, from) in fans.iter().enumerate() {
        let others = fans.iter().enumerate().filter(|(j, _)| *j != i);
        pairs.extend(others.map(|(j, to)| (angle(from, to), i, j)));
    }
    pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let (mut left, mut entered) = (vec![false; fans.len()], vec![false; fans.len()]);
    for (_, i, j) in pairs {
        if !left[i] && !entered[j] {
            (left[i], entered[j]) = (true, true);
            crossings.insert(fans[i].comes, fans[j].goes);
        }
    }
    // What is left over is one fan at most, which then goes on along itself.
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
    fn a_piece_that_hangs_by_its_corners_bounds_the_holes_around_it() {
        // Four facets around two; found by a test of random holes.
        let sphere = shapes::icosphere(1, 10.0);
        let rims = rims_without(sphere, &[0, 1, 26, 51, 57, 67]);
        assert_eq!(rims.iter().map(Vec::len).collect::<Vec<_>>(), [3; 6]);
    }

    #[test]
    fn rims_begin_and_come_by_position() {
        let places = |mesh: &Mesh| -> Vec<Vec<[f64; 3]>> {
            let place = |v: &u32| mesh.vertices[*v as usize].coords.into();
            let rims = rims(&Solid::new(mesh.clone()));
            rims.iter().map(|rim| rim.vertices.iter().map(place).collect()).collect()
        };
        let mut ball = shapes::icosphere(1, 10.0);
        for missing in [70, 40, 39, 5] {
            ball.triangles.remove(missing);
        }
        let mut turned = ball.clone();
        turned.vertices.reverse();
        let last = turned.vertices.len() as u32 - 1;
        turned.triangles.iter_mut().flatten().for_each(|v| *v = last - *v);
        assert_eq!(places(&ball), places(&turned));
    }

    #[test]
    fn a_closed_surface_has_none() {
        assert!(rims(&Solid::new(shapes::torus(20.0, 5.0, 12, 8))).is_empty());
    }
}
