//! Removes facets that bound nothing: those with two equal corners, and those that occur twice.
//!
//! Facets of zero area with three different corners stay: they join their neighbours, and
//! without them the surface would be open there.
//!
//! Of facets with the same corners in the same direction, the first stays; two do where two solids
//! inside each other have a side in common, facet for facet: both are closed with it, and one of
//! them is open without. Facets with the same corners in opposite directions lie back to back,
//! and that means one of two things:
//!
//! * a *double skin*, where an exporter wrote one surface with both faces. One of each two must
//!   go, or the solid counts as nothing;
//! * a *wall* between two solids that touch, or a sheet of no thickness. Both must stay, or both
//!   solids are open.
//!
//! Which one it is shows at the rim: a patch of such pairs is thinned to one face where that
//! leaves fewer edges with an odd number of facets than keeping both does, or where it closes by
//! itself. A double skin that is thinned has no direction of its own; its neighbours decide.

use super::{Winding, Work};
use crate::groups::Groups;
use crate::measure;
use crate::mesh::{Mesh, repeated};
use crate::note::Tally;
use crate::topology::Edges;
use nalgebra::distance;

/// Removes facets with two equal corners. Returns how many, with their lengths, mm.
pub(crate) fn drop_degenerate(mesh: &mut Mesh) -> Tally {
    let mut tally = Tally::default();
    for (t, corners) in (0..).zip(&mesh.triangles) {
        if repeated(corners).is_some() {
            let [a, b, c] = mesh.corners(t);
            tally.add(distance(&a, &b).max(distance(&b, &c)), a);
        }
    }
    if tally.count > 0 {
        mesh.triangles.retain(|corners| repeated(corners).is_none());
    }
    tally
}

/// Removes facets that occur more than once. Returns how many, with their areas, mm².
pub(super) fn drop_duplicates(work: &mut Work, edges: &Edges) -> Tally {
    let mut keep = vec![true; work.mesh.triangles.len()];
    let pairs = drop_same(work, edges, &mut keep);
    thin_double_skins(work, edges, &pairs, &mut keep);
    let mut tally = Tally::default();
    for (t, _) in (0..).zip(&keep).filter(|(_, keep)| !**keep) {
        let corners = work.mesh.corners(t);
        tally.add(measure::area_of(&corners), corners[0]);
    }
    if tally.count > 0 {
        work.retain(&keep);
    }
    tally
}

/// Two facets back to back, the first in file order first.
type Pair = [u32; 2];

/// Marks facets that repeat an earlier one in the same direction; returns the pairs that are left
/// back to back.
fn drop_same(work: &Work, edges: &Edges, keep: &mut [bool]) -> Vec<Pair> {
    let triangles = &work.mesh.triangles;
    let mut keys: Vec<([u32; 3], bool, u32)> = suspects(work, edges)
        .into_iter()
        .map(|t| {
            let [a, b, c] = triangles[t as usize];
            let mut sorted = [a, b, c];
            sorted.sort_unstable();
            let even = sorted == [a, b, c] || sorted == [b, c, a] || sorted == [c, a, b];
            (sorted, even, t)
        })
        .collect();
    keys.sort_unstable();
    let (mut copies, mut pairs) = (Vec::new(), Vec::new());
    for same_corners in keys.chunk_by(|a, b| a.0 == b.0) {
        let first = same_corners[0];
        let other = same_corners.iter().find(|key| key.1 != first.1);
        for same in same_corners.chunk_by(|a, b| a.1 == b.1) {
            match same {
                [(_, _, one), (_, _, two)] if other.is_none() => copies.push([*one, *two]),
                _ => same[1..].iter().for_each(|(_, _, t)| keep[*t as usize] = false),
            }
        }
        if let Some(other) = other {
            pairs.push([first.2.min(other.2), first.2.max(other.2)]);
        }
    }
    for (copy, patch) in copies.iter().zip(patches(edges, &copies, keep)) {
        let closes_both = patch.has_rim && patch.odd_if_kept == 0 && patch.odd_if_thinned > 0;
        keep[copy[1] as usize] = closes_both;
    }
    pairs
}

/// Facets at an edge where more than two meet, or two that run the same way: no other facet can
/// occur twice, but for two that share all their edges with each other and nothing else.
fn suspects(work: &Work, edges: &Edges) -> Vec<u32> {
    let mut suspicious = vec![false; work.mesh.triangles.len()];
    let mut mark = |half: u32| suspicious[half as usize / 3] = true;
    for (_, users) in edges.crowds() {
        users.iter().for_each(|half| mark(*half));
    }
    if edges.n_twisted() > 0 {
        edges.twisted(&work.mesh).flatten().for_each(&mut mark);
    }
    (0..).zip(suspicious).filter(|(_, suspicious)| *suspicious).map(|(t, _)| t).collect()
}

/// What meets at an edge of a pair.
struct Rim {
    /// The pairs there, as indices.
    pairs: Vec<usize>,
    /// How many facets are there that belong to no pair.
    n_others: usize,
}

/// A patch of pairs of facets that lie on each other.
#[derive(Clone, Copy, Default)]
struct Patch {
    /// Edges with an odd number of facets if both facets of every pair stay, and if one does.
    odd_if_kept: usize,
    odd_if_thinned: usize,
    /// Whether other facets meet it somewhere.
    has_rim: bool,
}

fn thin_double_skins(work: &mut Work, edges: &Edges, pairs: &[Pair], keep: &mut [bool]) {
    for (pair, patch) in pairs.iter().zip(patches(edges, pairs, keep)) {
        let closes = !patch.has_rim && patch.odd_if_thinned == 0;
        if patch.odd_if_thinned < patch.odd_if_kept || closes {
            keep[pair[1] as usize] = false;
            work.windings[pair[0] as usize] = Winding::Free;
        }
    }
}

/// The patch that each pair is part of.
fn patches(edges: &Edges, pairs: &[Pair], keep: &[bool]) -> Vec<Patch> {
    let rims = rims(edges, pairs, keep);
    // Pairs that share an edge with nothing else there belong to one patch.
    let mut groups = Groups::new(pairs.len());
    for rim in rims.iter().filter(|rim| rim.n_others == 0) {
        for &pair in &rim.pairs[1..] {
            groups.join(rim.pairs[0], pair);
        }
    }
    let patch_of: Vec<usize> = (0..pairs.len()).map(|i| groups.leader(i)).collect();
    let mut patches = vec![Patch::default(); pairs.len()];
    for rim in &rims {
        let mut there: Vec<usize> = rim.pairs.iter().map(|pair| patch_of[*pair]).collect();
        there.sort_unstable();
        for run in there.chunk_by(|a, b| a == b) {
            let patch = &mut patches[run[0]];
            patch.odd_if_kept += rim.n_others % 2;
            patch.odd_if_thinned += (rim.n_others + run.len()) % 2;
            patch.has_rim |= rim.n_others > 0;
        }
    }
    patch_of.into_iter().map(|leader| patches[leader]).collect()
}

/// The edges of all pairs, each once.
fn rims(edges: &Edges, pairs: &[Pair], keep: &[bool]) -> Vec<Rim> {
    let mut in_pair = vec![false; keep.len()];
    let mut uses: Vec<(u32, usize)> = Vec::new();
    for (i, pair) in pairs.iter().enumerate() {
        pair.iter().for_each(|t| in_pair[*t as usize] = true);
        uses.extend(edges.of_triangles()[pair[0] as usize].map(|edge| (edge, i)));
    }
    uses.sort_unstable();
    let others = |edge: u32| {
        let counts = |half: &u32| {
            let t = *half as usize / 3;
            keep[t] && !in_pair[t]
        };
        match edges.users(edge) {
            Some((first, second)) => {
                [Some(first), second].iter().flatten().filter(|h| counts(h)).count()
            }
            None => {
                let at = edges.crowds().binary_search_by_key(&edge, |crowd| crowd.0);
                at.map_or(0, |at| edges.crowds()[at].1.iter().filter(|h| counts(h)).count())
            }
        }
    };
    uses.chunk_by(|a, b| a.0 == b.0)
        .map(|run| Rim { pairs: run.iter().map(|(_, i)| *i).collect(), n_others: others(run[0].0) })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    fn turned(t: &[u32; 3]) -> [u32; 3] {
        [t[0], t[2], t[1]]
    }

    /// How many facets are dropped, how many are left, and how many have lost their direction.
    fn outcome(mesh: Mesh) -> [usize; 3] {
        let mut work = Work::new(mesh);
        let edges = Edges::of(&work.mesh);
        let n_dropped = drop_duplicates(&mut work, &edges).count;
        let n_free = work.windings.iter().filter(|w| **w == Winding::Free).count();
        [n_dropped, work.mesh.triangles.len(), n_free]
    }

    fn cube_and(extra: impl Fn(&[[u32; 3]]) -> Vec<[u32; 3]>) -> Mesh {
        let mut mesh = shapes::cube(20.0);
        let more = extra(&mesh.triangles);
        mesh.triangles.extend(more);
        mesh
    }

    #[test]
    fn copies_go() {
        assert_eq!(outcome(cube_and(|t| t[4..8].to_vec())), [4, 12, 0]);
        let rotated = |t: &[[u32; 3]]| t[4..8].iter().map(|t| [t[1], t[2], t[0]]).collect();
        assert_eq!(outcome(cube_and(rotated)), [4, 12, 0]);
        assert_eq!(outcome(cube_and(<[_]>::to_vec)), [12, 12, 0]);
    }

    #[test]
    fn a_copy_beside_holes_goes() {
        // Two of the three neighbours of the doubled facet are missing.
        let mut mesh = cube_and(|t| vec![t[5]]);
        mesh.triangles.remove(4);
        mesh.triangles.remove(2);
        assert_eq!(outcome(mesh), [1, 10, 0]);
    }

    #[test]
    fn a_side_that_two_solids_share_stays_twice() {
        // A lower block inside the cube, on the same two facets.
        let mut mesh = shapes::cube(20.0);
        let low: Vec<bool> = mesh.vertices.iter().map(|p| p.z < 10.0).collect();
        let first = mesh.vertices.len() as u32;
        let halfway =
            mesh.vertices.clone().into_iter().map(|p| nalgebra::Point3::new(p.x, p.y, 10.0));
        mesh.vertices.extend(halfway);
        let own = |v: u32| if low[v as usize] { v } else { v + first };
        let block: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(own)).collect();
        mesh.triangles.extend(block);
        assert_eq!(outcome(mesh), [0, 24, 0]);
    }

    #[test]
    fn double_skins_are_thinned() {
        let all = |t: &[[u32; 3]]| t.iter().map(turned).collect();
        assert_eq!(outcome(cube_and(all)), [12, 12, 12]);
        let one_side = |t: &[[u32; 3]]| t[4..6].iter().map(turned).collect();
        assert_eq!(outcome(cube_and(one_side)), [2, 12, 2]);
    }

    #[test]
    fn walls_between_solids_stay() {
        // Two tetrahedra on one face.
        let mut mesh = shapes::tetrahedron(10.0);
        mesh.vertices.push(nalgebra::Point3::new(0.0, 0.0, -9.0));
        mesh.triangles.extend([[0, 1, 2], [0, 4, 1], [1, 4, 2], [2, 4, 0]]);
        assert_eq!(outcome(mesh), [0, 8, 0]);
        // A sheet with two faces.
        let mut sheet = shapes::tetrahedron(10.0);
        sheet.triangles = vec![[0, 1, 2], [2, 1, 0], [0, 2, 3], [3, 2, 0]];
        assert_eq!(outcome(sheet), [0, 4, 0]);
    }

    #[test]
    fn equal_corners_go_and_flat_facets_stay() {
        let mut mesh = cube_and(|t| vec![[t[0][0], t[0][0], t[0][1]], [7, 7, 7]]);
        assert_eq!(drop_degenerate(&mut mesh).count, 2);
        assert_eq!(mesh.triangles.len(), 12);
        assert_eq!(drop_degenerate(&mut mesh).count, 0);
    }
}
