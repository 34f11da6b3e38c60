//! What is joined to what: sides, shells, open and crowded edges.
//!
//! An *edge* is a pair of vertices that some triangle joins; any number of triangles may use it.
//! A *side* is an edge as one sheet of surface sees it: it belongs to one triangle (the surface
//! is open there) or to two that run along it in opposite directions. An edge that four triangles
//! use is two sides with the same ends.
//!
//! Where more than two triangles meet, they are taken in the order of their angle about the edge,
//! and each that runs from the lower vertex to the higher is paired with the previous one that
//! runs back: the two enclose material between them. So a section of the surface closes whatever
//! the mesh, because every crossing of a side is entered by one triangle and left by the other.
//!
//! Half-edge `3 t + k` runs from corner `k` of triangle `t` to corner `k + 1`. Frame and unit are
//! those of the mesh.

mod crowd;
mod edges;

pub(crate) use edges::{Edges, runs_up};
use edges::{Sides, ends_of_half};

use crate::groups::Groups;
use crate::measure;
use crate::mesh::{Mesh, MeshFault};
use crate::note::Tally;
use geom::bounding::Bounds;
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;
use std::sync::Arc;

/// Marks that there is no half-edge.
pub(crate) const NONE: u32 = u32::MAX;

/// A mesh with its sides and shells.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    mesh: Mesh,
    joins: Arc<Joins>,
    shells: Vec<Shell>,
    open_sides: usize,
    nonmanifold_edges: Tally,
}

/// How triangles are joined. A solid that is moved has the same, so they share it: it is larger than
/// the mesh.
#[derive(Debug, PartialEq)]
struct Joins {
    sides: Vec<[u32; 3]>,
    users: Vec<[u32; 2]>,
    shell_of: Vec<u32>,
}

/// A part of the surface that is connected over its sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Shell {
    /// How many triangles it has.
    pub triangles: usize,
    /// The first of them.
    pub first: u32,
    /// The volume that it encloses, mm³; negative when it is a cavity, and without meaning when
    /// it is open.
    pub volume_mm3: f64,
    /// Its area, mm².
    pub area_mm2: f64,
    /// How many of its sides are open.
    pub open_sides: usize,
    /// The box around it.
    pub bounds: Bounds,
}

impl Solid {
    /// Finds the sides and shells of a mesh.
    ///
    /// # Panics
    ///
    /// When a triangle names a vertex twice or one that does not exist
    /// ([`Mesh::check`]); [`repair`](crate::repair::repair) removes the former.
    #[must_use]
    pub fn new(mesh: Mesh) -> Self {
        let edges = Edges::of(&mesh);
        Self::from_edges(mesh, edges)
    }

    /// As [`Solid::new`], for edges that are known.
    pub(crate) fn from_edges(mesh: Mesh, edges: Edges) -> Self {
        let nonmanifold_edges = edges.crowded(&mesh);
        let Sides { of: sides, users } = edges.into_sides(&mesh);
        let open_sides = users.iter().filter(|u| u[1] == NONE).count();
        let (shell_of, n_shells) = shells(sides.len(), &users);
        let joins = Joins { sides, users, shell_of };
        let mut solid = Self {
            mesh,
            joins: Arc::new(joins),
            shells: vec![Shell::empty(); n_shells as usize],
            open_sides,
            nonmanifold_edges,
        };
        solid.measure_shells();
        solid
    }

    /// Returns the mesh.
    #[must_use]
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Returns the mesh, giving up the rest.
    #[must_use]
    pub fn into_mesh(self) -> Mesh {
        self.mesh
    }

    /// Returns, for each triangle, the side from corner `k` to corner `k + 1`.
    #[must_use]
    pub fn sides(&self) -> &[[u32; 3]] {
        &self.joins.sides
    }

    /// Returns the number of sides.
    #[must_use]
    pub fn n_sides(&self) -> usize {
        self.joins.users.len()
    }

    /// Returns the two vertices of a side, the lower number first.
    #[must_use]
    pub fn ends(&self, side: u32) -> [u32; 2] {
        ends_of_half(&self.mesh, self.joins.users[side as usize][0])
    }

    /// Returns the triangle across side `k` of `triangle` and the number of that side there;
    /// `None` where the surface is open.
    #[must_use]
    pub fn across(&self, triangle: u32, k: usize) -> Option<(u32, usize)> {
        self.mate(3 * triangle + k as u32).map(|half| (half / 3, half as usize % 3))
    }

    /// Returns the half-edge on the other side.
    pub(crate) fn mate(&self, half: u32) -> Option<u32> {
        self.joins.mate(half)
    }

    /// Returns how many sides belong to one triangle only.
    #[must_use]
    pub fn open_sides(&self) -> usize {
        self.open_sides
    }

    /// Returns the open half-edges, in the order of the sides.
    pub(crate) fn open_halves(&self) -> impl Iterator<Item = u32> {
        self.joins.users.iter().filter(|u| u[1] == NONE).map(|u| u[0])
    }

    /// Returns the edges that more than two triangles use: how many, and their lengths, mm.
    #[must_use]
    pub fn nonmanifold_edges(&self) -> &Tally {
        &self.nonmanifold_edges
    }

    /// Returns the connected parts of the surface, in the order of their first triangles.
    #[must_use]
    pub fn shells(&self) -> &[Shell] {
        &self.shells
    }

    /// Returns the enclosed volume, mm³, as [`measure::volume_mm3`] has it.
    #[must_use]
    pub fn volume_mm3(&self) -> f64 {
        self.shells.iter().map(|shell| shell.volume_mm3).sum()
    }

    /// Returns the shell of each triangle.
    #[must_use]
    pub fn shell_of(&self) -> &[u32] {
        &self.joins.shell_of
    }

    /// Returns the solid moved by `to_from_here`; sides and shells keep their numbers.
    #[must_use]
    pub fn transformed(&self, to_from_here: &Isometry3<f64>) -> Self {
        self.moved(|p| to_from_here * p)
    }

    /// Returns the solid with every vertex moved in the same rigid way.
    #[must_use]
    pub fn moved(&self, to_from_here: impl Fn(&Point3<f64>) -> Point3<f64>) -> Self {
        self.clone().into_moved(to_from_here)
    }

    /// As [`Solid::moved`], giving up the solid where it was.
    #[must_use]
    pub fn into_moved(mut self, to_from_here: impl Fn(&Point3<f64>) -> Point3<f64>) -> Self {
        for p in &mut self.mesh.vertices {
            *p = to_from_here(p);
        }
        self.nonmanifold_edges.at = self.nonmanifold_edges.at.map(|p| to_from_here(&p));
        self.find_boxes();
        self
    }

    /// Returns the vertices at which fans of triangles touch that no side connects.
    ///
    /// Every other vertex has its triangles in one row around it.
    #[must_use]
    pub fn pinched_vertices(&self) -> Vec<u32> {
        let mut n_corners = vec![0_u32; self.mesh.vertices.len()];
        let mut first = vec![NONE; self.mesh.vertices.len()];
        for (half, &v) in (0..).zip(self.mesh.triangles.as_flattened()) {
            n_corners[v as usize] += 1;
            if first[v as usize] == NONE {
                first[v as usize] = half;
            }
        }
        let is_pinched = |v: &u32| {
            let first = first[*v as usize];
            first != NONE && self.fan(first) < n_corners[*v as usize]
        };
        (0..first.len() as u32).into_par_iter().filter(is_pinched).collect()
    }

    /// How many triangles follow each other around the vertex that `half` begins at.
    fn fan(&self, half: u32) -> u32 {
        let mut n = 1;
        let mut at = half;
        while let Some(next) = self.mate(before(at)) {
            if next == half {
                return n;
            }
            at = next;
            n += 1;
        }
        // The fan is open: the rest lies the other way round.
        at = half;
        while let Some(mate) = self.mate(at) {
            at = after(mate);
            n += 1;
        }
        n
    }

    /// Finds the boxes around the shells anew; volumes and areas stay when a solid moves.
    fn find_boxes(&mut self) {
        self.shells.iter_mut().for_each(|shell| shell.bounds = Bounds::default());
        // A vertex has six corners on average, nearly always of one shell.
        let mut seen_by = vec![NONE; self.mesh.vertices.len()];
        for (corners, &shell) in self.mesh.triangles.iter().zip(&self.joins.shell_of) {
            for &v in corners {
                if seen_by[v as usize] != shell {
                    seen_by[v as usize] = shell;
                    self.shells[shell as usize].bounds.add(&self.mesh.vertices[v as usize]);
                }
            }
        }
    }

    fn measure_shells(&mut self) {
        let origin = measure::local_origin(&self.mesh);
        self.shells.iter_mut().for_each(|shell| *shell = Shell::empty());
        for (t, &shell) in (0..).zip(&self.joins.shell_of) {
            let corners = self.mesh.corners(t);
            let shell = &mut self.shells[shell as usize];
            shell.first = shell.first.min(t);
            shell.triangles += 1;
            shell.volume_mm3 += measure::cone_volume(&origin, &corners);
            shell.area_mm2 += measure::area_of(&corners);
        }
        self.find_boxes();
        for users in self.joins.users.iter().filter(|u| u[1] == NONE) {
            let shell = self.joins.shell_of[users[0] as usize / 3];
            self.shells[shell as usize].open_sides += 1;
        }
    }

    /// Checks the mesh and the rule of the sides: each has one user, or two that run oppositely.
    ///
    /// # Errors
    ///
    /// The first [`MeshFault`].
    pub fn check(&self) -> Result<(), MeshFault> {
        self.mesh.check()?;
        let fault = |side: u32, rule| Err(MeshFault::BadSide { side: side as usize, rule });
        let mut directions = vec![[0_u8; 2]; self.n_sides()];
        for (corners, sides) in self.mesh.triangles.iter().zip(&self.joins.sides) {
            for (k, &side) in sides.iter().enumerate() {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                if side as usize >= self.n_sides() || self.ends(side) != [a.min(b), a.max(b)] {
                    return fault(side, "its ends are those of its triangles");
                }
                let n = &mut directions[side as usize][usize::from(a > b)];
                *n += 1;
                if *n > 1 {
                    return fault(side, "at most one triangle runs along it each way");
                }
            }
        }
        for (side, (n, users)) in (0..).zip(directions.iter().zip(&self.joins.users)) {
            let n_users = n[0] + n[1];
            if n_users != 1 + u8::from(users[1] != NONE) {
                return fault(side, "its users are the triangles that name it");
            }
        }
        Ok(())
    }
}

impl Joins {
    fn mate(&self, half: u32) -> Option<u32> {
        let side = self.sides[half as usize / 3][half as usize % 3];
        let [first, second] = self.users[side as usize];
        let other = if first == half { second } else { first };
        (other != NONE).then_some(other)
    }
}

/// Returns the shell of each triangle, and how many there are, numbered by their first triangles.
fn shells(n_triangles: usize, users: &[[u32; 2]]) -> (Vec<u32>, u32) {
    let mut groups = Groups::new(n_triangles);
    for [first, second] in users.iter().filter(|users| users[1] != NONE) {
        groups.join(*first as usize / 3, *second as usize / 3);
    }
    groups.numbered()
}

impl Shell {
    fn empty() -> Self {
        Self {
            triangles: 0,
            first: NONE,
            volume_mm3: 0.0,
            area_mm2: 0.0,
            open_sides: 0,
            bounds: Bounds::default(),
        }
    }

    /// Returns whether every side has a triangle on both sides.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.open_sides == 0
    }
}

/// The half-edge after `half` in its triangle.
pub(crate) fn after(half: u32) -> u32 {
    if half % 3 == 2 { half - 2 } else { half + 1 }
}

/// The half-edge before `half` in its triangle.
pub(crate) fn before(half: u32) -> u32 {
    if half.is_multiple_of(3) { half + 2 } else { half - 1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    fn join(a: &Mesh, b: &Mesh) -> Mesh {
        let facets = |m: &Mesh| {
            (0..m.triangles.len() as u32)
                .map(|t| m.corners(t).map(|p| [p.x as f32, p.y as f32, p.z as f32]))
                .collect::<Vec<_>>()
        };
        let facets = [facets(a), facets(b)].concat();
        crate::weld::exactly(&crate::soup::Soup { facets })
    }

    fn cube_at(x: f64, y: f64, z: f64) -> Mesh {
        shapes::cube(20.0).transformed(&Isometry3::translation(x, y, z))
    }

    #[test]
    fn a_cube_has_eighteen_sides() {
        let solid = Solid::new(shapes::cube(20.0));
        solid.check().unwrap();
        assert_eq!((solid.n_sides(), solid.open_sides(), solid.shells().len()), (18, 0, 1));
        let shell = &solid.shells()[0];
        assert!(shell.is_closed());
        assert!((shell.volume_mm3 - 8000.0).abs() < 1e-9);
        assert!((shell.area_mm2 - 2400.0).abs() < 1e-9);
        assert!(solid.pinched_vertices().is_empty());
        for t in 0..12 {
            for k in 0..3 {
                let (u, j) = solid.across(t, k).unwrap();
                assert_eq!(solid.across(u, j), Some((t, k)));
            }
        }
    }

    #[test]
    fn cubes_that_share_an_edge_stay_two_shells() {
        let solid = Solid::new(join(&cube_at(0.0, 0.0, 0.0), &cube_at(20.0, 20.0, 0.0)));
        solid.check().unwrap();
        assert_eq!((solid.open_sides(), solid.nonmanifold_edges().count), (0, 1));
        let volumes: Vec<f64> = solid.shells().iter().map(|s| s.volume_mm3.round()).collect();
        assert_eq!(volumes, [8000.0, 8000.0]);
        assert_eq!(solid.nonmanifold_edges().worst, 20.0);
        assert_eq!(solid.pinched_vertices().len(), 2);
    }

    #[test]
    fn cubes_that_share_a_wall_stay_two_shells() {
        for (x, z) in [(20.0, 0.0), (0.0, 20.0)] {
            let solid = Solid::new(join(&cube_at(0.0, 0.0, 0.0), &cube_at(x, 0.0, z)));
            solid.check().unwrap();
            assert_eq!(solid.open_sides(), 0);
            assert!(solid.nonmanifold_edges().count >= 4);
            let volumes: Vec<f64> = solid.shells().iter().map(|s| s.volume_mm3.round()).collect();
            assert_eq!(volumes, [8000.0, 8000.0]);
        }
    }

    #[test]
    fn a_shared_vertex_is_pinched() {
        let solid = Solid::new(join(&cube_at(0.0, 0.0, 0.0), &cube_at(20.0, 20.0, 20.0)));
        assert_eq!((solid.nonmanifold_edges().count, solid.pinched_vertices().len()), (0, 1));
        assert_eq!(solid.shells().len(), 2);
    }

    #[test]
    fn open_sides_are_counted() {
        let mut mesh = shapes::cube(20.0);
        mesh.triangles.remove(4);
        let solid = Solid::new(mesh);
        solid.check().unwrap();
        assert_eq!((solid.open_sides(), solid.shells()[0].open_sides), (3, 3));
        assert_eq!(solid.open_halves().count(), 3);
        assert!(solid.pinched_vertices().is_empty());
    }

    #[test]
    fn a_turned_triangle_opens_its_sides() {
        let mut mesh = shapes::cube(20.0);
        mesh.triangles[0].swap(1, 2);
        let solid = Solid::new(mesh);
        solid.check().unwrap();
        assert_eq!((solid.open_sides(), solid.shells().len()), (6, 2));
    }

    #[test]
    fn moving_keeps_the_sides() {
        let solid = Solid::new(shapes::cube(20.0));
        let moved = solid.transformed(&Isometry3::translation(5.0, 0.0, 0.0));
        assert_eq!(moved.sides(), solid.sides());
        assert_eq!(moved.shells()[0].bounds.max.x, 15.0);
    }
}
