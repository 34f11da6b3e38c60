//! Which triangles use which edge.
//!
//! Half-edges with the same ends are brought together part by part ([`parts`](crate::parts)): a
//! part holds the edges of a range of lower ends, so edges come out numbered by (lower end,
//! higher end) whatever the number of threads.

use super::{NONE, crowd};
use crate::mesh::{Mesh, repeated};
use crate::note::Tally;
use crate::parts::{Parts, parts_for, sorted_by_bucket};
use nalgebra::{center, distance};

/// The edges of a mesh and the half-edges that use them.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Edges {
    /// The edge of each half-edge; [`NONE`] in triangles that name a vertex twice.
    of: Vec<[u32; 3]>,
    /// The first two users; the second is [`NONE`] where there is one.
    users: Vec<[u32; 2]>,
    /// Edges with more than two users, ascending, with all of them.
    crowds: Vec<(u32, Vec<u32>)>,
    n_open: usize,
    n_twisted: usize,
}

impl Edges {
    /// Finds the edges of a mesh, leaving out triangles that name a vertex twice.
    ///
    /// # Panics
    ///
    /// When there are more than 2³² half-edges.
    pub(crate) fn of(mesh: &Mesh) -> Self {
        let triangles = &mesh.triangles;
        let n_halves = 3 * triangles.len();
        let n_parts = parts_for(n_halves);
        let n_vertices = mesh.vertices.len().max(1) as u64;
        let low = |half: u32| ends_of(&triangles[half as usize / 3], half as usize % 3)[0];
        let part_of = |half: u32| (u64::from(low(half)) * n_parts as u64 / n_vertices) as usize;
        let parts = Parts::deal(n_halves, n_parts, part_of);
        let mut found = parts.work(|_, halves| find(triangles, &halves));
        let mut base = 0;
        for part in &mut found {
            part.shift(base);
            base += part.users.len() as u32;
        }
        let answers: Vec<&[u32]> = found.iter().map(|part| part.of.as_slice()).collect();
        let of = parts.gather(&answers).as_chunks().0.to_vec();
        Self {
            of,
            n_open: found.iter().map(|part| part.n_open).sum(),
            n_twisted: found.iter().map(|part| part.n_twisted).sum(),
            users: concat(found.iter().map(|part| &part.users)),
            crowds: found.into_iter().flat_map(|part| part.crowds).collect(),
        }
    }

    /// How many edges one triangle alone uses.
    pub(crate) fn n_open(&self) -> usize {
        self.n_open
    }

    /// How many edges two triangles use in the same direction.
    pub(crate) fn n_twisted(&self) -> usize {
        self.n_twisted
    }

    /// How many edges there are.
    pub(crate) fn len(&self) -> usize {
        self.users.len()
    }

    /// The edges that one triangle alone uses.
    pub(crate) fn open(&self) -> impl Iterator<Item = u32> {
        (0..).zip(&self.users).filter(|(_, users)| users[1] == NONE).map(|(edge, _)| edge)
    }

    /// The edges that more than two triangles use, ascending, with all their users.
    pub(crate) fn crowds(&self) -> &[(u32, Vec<u32>)] {
        &self.crowds
    }

    /// The lower and the higher end of an edge.
    pub(crate) fn ends(&self, mesh: &Mesh, edge: u32) -> [u32; 2] {
        ends_of_half(mesh, self.users[edge as usize][0])
    }

    /// The one or two users of an edge; `None` when there are more.
    pub(crate) fn users(&self, edge: u32) -> Option<(u32, Option<u32>)> {
        if self.is_crowded(edge) {
            return None;
        }
        let [first, second] = self.users[edge as usize];
        Some((first, (second != NONE).then_some(second)))
    }

    /// The half-edges of the edges that two triangles use in the same direction.
    pub(crate) fn twisted<'a>(&'a self, mesh: &'a Mesh) -> impl Iterator<Item = [u32; 2]> + 'a {
        let users = (0..).zip(&self.users).filter(|(_, users)| users[1] != NONE);
        users
            .filter(|(_, [first, second])| runs_up(mesh, *first) == runs_up(mesh, *second))
            .filter(|(edge, _)| !self.is_crowded(*edge))
            .map(|(_, users)| *users)
    }

    fn is_crowded(&self, edge: u32) -> bool {
        self.crowds.binary_search_by_key(&edge, |crowd| crowd.0).is_ok()
    }

    /// The edge of each half-edge of each triangle.
    pub(crate) fn of_triangles(&self) -> &[[u32; 3]] {
        &self.of
    }

    /// The edges that more than two triangles use, by length.
    pub(crate) fn crowded(&self, mesh: &Mesh) -> Tally {
        let mut tally = Tally::default();
        for (edge, _) in &self.crowds {
            let [a, b] = self.ends(mesh, *edge).map(|v| mesh.vertices[v as usize]);
            tally.add(distance(&a, &b), center(&a, &b));
        }
        tally
    }

    /// Splits edges until each side has one user, or two that run oppositely.
    ///
    /// # Panics
    ///
    /// When a triangle names a vertex twice.
    pub(crate) fn into_sides(mut self, mesh: &Mesh) -> Sides {
        assert!(self.of.iter().all(|of| of[0] != NONE), "triangles have three different corners");
        let crowds = std::mem::take(&mut self.crowds);
        if self.n_twisted > 0 {
            self.split_twisted(mesh, &crowds);
        }
        for (edge, halves) in crowds {
            let mut pairs = crowd::pairs(mesh, self.ends(mesh, edge), &halves).into_iter();
            let first = pairs.next().expect("a crowd has users");
            self.users[edge as usize] = first;
            for pair in pairs {
                self.add_side(pair);
            }
        }
        Sides { of: self.of, users: self.users }
    }

    fn split_twisted(&mut self, mesh: &Mesh, crowds: &[(u32, Vec<u32>)]) {
        for edge in 0..self.users.len() as u32 {
            let [first, second] = self.users[edge as usize];
            let crowded = || crowds.binary_search_by_key(&edge, |crowd| crowd.0).is_ok();
            if second != NONE && runs_up(mesh, first) == runs_up(mesh, second) && !crowded() {
                self.users[edge as usize] = [first, NONE];
                self.add_side([second, NONE]);
            }
        }
    }

    fn add_side(&mut self, users: [u32; 2]) {
        let side = self.users.len() as u32;
        self.users.push(users);
        for half in users.into_iter().filter(|half| *half != NONE) {
            self.of[half as usize / 3][half as usize % 3] = side;
        }
    }
}

/// The sides of a mesh.
pub(crate) struct Sides {
    /// The side of each half-edge.
    pub(crate) of: Vec<[u32; 3]>,
    /// The users; the second is [`NONE`] where the side is open.
    pub(crate) users: Vec<[u32; 2]>,
}

/// Whether a half-edge runs from the lower end to the higher.
pub(crate) fn runs_up(mesh: &Mesh, half: u32) -> bool {
    let corners = &mesh.triangles[half as usize / 3];
    let k = half as usize % 3;
    corners[k] < corners[(k + 1) % 3]
}

/// The lower and the higher end of a half-edge.
pub(crate) fn ends_of_half(mesh: &Mesh, half: u32) -> [u32; 2] {
    ends_of(&mesh.triangles[half as usize / 3], half as usize % 3)
}

fn ends_of(corners: &[u32; 3], k: usize) -> [u32; 2] {
    let (a, b) = (corners[k], corners[(k + 1) % 3]);
    [a.min(b), a.max(b)]
}

fn concat<'a, T: Copy + 'a>(parts: impl Iterator<Item = &'a Vec<T>> + Clone) -> Vec<T> {
    let mut all = Vec::with_capacity(parts.clone().map(Vec::len).sum());
    for part in parts {
        all.extend_from_slice(part);
    }
    all
}

/// The edges of one part.
#[derive(Default)]
struct Found {
    of: Vec<u32>,
    users: Vec<[u32; 2]>,
    crowds: Vec<(u32, Vec<u32>)>,
    n_open: usize,
    n_twisted: usize,
}

impl Found {
    /// Numbers the edges from `base`.
    fn shift(&mut self, base: u32) {
        for edge in self.of.iter_mut().filter(|edge| **edge != NONE) {
            *edge += base;
        }
        for (edge, _) in &mut self.crowds {
            *edge += base;
        }
    }
}

/// Brings the half-edges with the same ends together.
fn find(triangles: &[[u32; 3]], halves: &[u32]) -> Found {
    let corners = |half: u32| &triangles[half as usize / 3];
    let mut keys: Vec<u128> = Vec::with_capacity(halves.len());
    for (position, &half) in halves.iter().enumerate() {
        if repeated(corners(half)).is_none() {
            let [low, high] = ends_of(corners(half), half as usize % 3).map(u128::from);
            keys.push(low << 64 | high << 32 | position as u128);
        }
    }
    let keys = sorted(keys);
    let mut found = Found { of: vec![NONE; halves.len()], ..Found::default() };
    for run in keys.chunk_by(|a, b| a >> 32 == b >> 32) {
        let edge = found.users.len() as u32;
        let half = |key: &u128| halves[*key as u32 as usize];
        for key in run {
            found.of[*key as u32 as usize] = edge;
        }
        let first = half(&run[0]);
        let second = run.get(1).map_or(NONE, half);
        let low = (run[0] >> 64) as u32;
        let runs_up = |half: u32| corners(half)[half as usize % 3] == low;
        found.users.push([first, second]);
        match run.len() {
            1 => found.n_open += 1,
            2 => found.n_twisted += usize::from(runs_up(first) == runs_up(second)),
            _ => found.crowds.push((edge, run.iter().map(half).collect())),
        }
    }
    found
}

/// Sorts keys whose upper half is a vertex; a part has those of a short range.
fn sorted(mut keys: Vec<u128>) -> Vec<u128> {
    let low = |key: u128| (key >> 64) as usize;
    let least = keys.iter().map(|key| low(*key)).min().unwrap_or(0);
    let n_buckets = keys.iter().map(|key| low(*key)).max().unwrap_or(0) + 1 - least;
    if n_buckets <= 4 * keys.len() {
        return sorted_by_bucket(&keys, n_buckets, |key| low(key) - least);
    }
    keys.sort_unstable();
    keys
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    fn flat(triangles: Vec<[u32; 3]>) -> Mesh {
        let vertices = (0..9).map(|i| Point3::new(f64::from(i), f64::from(i * i), 0.0)).collect();
        Mesh { vertices, triangles }
    }

    #[test]
    fn users_are_counted() {
        let triangles =
            vec![[0, 1, 2], [1, 0, 3], [0, 1, 4], [5, 6, 6], [7, 8, 2], [8, 7, 3], [4, 2, 8]];
        let mesh = flat(triangles);
        let edges = Edges::of(&mesh);
        assert_eq!(edges.crowds(), [(0, vec![0, 3, 6])]);
        assert_eq!(edges.ends(&mesh, 0), [0, 1]);
        assert_eq!(edges.of_triangles()[3], [NONE; 3]);
        assert_eq!(edges.users(0), None);
        let shared = edges.of_triangles()[4][0];
        assert_eq!(edges.users(shared), Some((12, Some(15))));
        // 2-8 is used twice, both ways; all others once.
        assert_eq!((edges.n_open(), edges.n_twisted()), (11, 0));
        assert_eq!((edges.open().count(), edges.len()), (11, 14));
    }

    #[test]
    fn twisted_edges_become_two_sides() {
        let mesh = flat(vec![[0, 1, 2], [0, 1, 3]]);
        let edges = Edges::of(&mesh);
        assert_eq!((edges.n_twisted(), edges.len()), (1, 5));
        let sides = edges.into_sides(&mesh);
        assert_eq!(sides.users.len(), 6);
        assert_ne!(sides.of[0][0], sides.of[1][0]);
        assert!(sides.users.iter().all(|u| u[1] == NONE));
    }

    #[test]
    fn edges_are_numbered_by_their_ends() {
        let triangles = (0..60_000_u32).map(|i| [i, i + 1, i + 2]).collect();
        let vertices = vec![Point3::origin(); 60_002];
        let mesh = Mesh { vertices, triangles };
        let edges = Edges::of(&mesh);
        assert!((0..edges.len() as u32).is_sorted_by_key(|edge| edges.ends(&mesh, edge)));
        assert_eq!(edges.len(), 120_001);
    }
}
