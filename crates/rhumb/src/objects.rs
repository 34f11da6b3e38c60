//! Several models on one bed, seen from above.

use std::ops::Range;

use geom::circle::convex_hull;
use geom::grid::mm;
use geom::region::{Fill, Region};
use mesh::mesh::Mesh;
use nalgebra::{Point2, Vector3};

/// Where one of several meshes is in the mesh of all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Extent {
    /// Its vertices.
    pub vertices: Range<usize>,
    /// Its facets.
    pub triangles: Range<usize>,
}

impl Extent {
    /// Adds a mesh to others, moved by `shift`.
    pub fn added(all: &mut Mesh, mesh: &Mesh, shift: &Vector3<f64>) -> Self {
        let (vertices, triangles) = (all.vertices.len(), all.triangles.len());
        all.vertices.extend(mesh.vertices.iter().map(|p| p + shift));
        let first = vertices as u32;
        all.triangles.extend(mesh.triangles.iter().map(|corners| corners.map(|v| v + first)));
        Self { vertices: vertices..all.vertices.len(), triangles: triangles..all.triangles.len() }
    }

    /// Returns the extent of a mesh that is alone.
    #[must_use]
    pub fn of(mesh: &Mesh) -> Self {
        Self { vertices: 0..mesh.vertices.len(), triangles: 0..mesh.triangles.len() }
    }

    /// Returns its part of the mesh of all.
    #[must_use]
    pub fn mesh(&self, all: &Mesh) -> Mesh {
        let first = self.vertices.start as u32;
        let facets = all.triangles[self.triangles.clone()].iter();
        Mesh {
            vertices: all.vertices[self.vertices.clone()].to_vec(),
            triangles: facets.map(|corners| corners.map(|v| v - first)).collect(),
        }
    }

    /// Returns the same in a mesh that has others before it.
    #[must_use]
    pub fn behind(&self, before: &Self) -> Self {
        let (v, t) = (before.vertices.start, before.triangles.start);
        Self {
            vertices: self.vertices.start + v..self.vertices.end + v,
            triangles: self.triangles.start + t..self.triangles.end + t,
        }
    }
}

/// One of several models, where it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// What it is called.
    pub name: String,
    /// Which model it is, counted from 0 in the order of the command line, each object of a 3MF as
    /// one; copies are the same.
    pub model: usize,
    /// Where it is in the mesh of all.
    pub extent: Extent,
    /// Its outline from above, part frame, or, where no other model reaches into the box around it,
    /// the hull of it.
    pub outline: Region,
}

impl Object {
    /// Returns the corners of its hull.
    #[must_use]
    pub fn hull(&self) -> Vec<Point2<f64>> {
        let corners: Vec<Point2<f64>> =
            self.outline.rings().flatten().map(|corner| mm(*corner)).collect();
        convex_hull(&corners)
    }
}

/// Returns the hull of a mesh, seen from above.
#[must_use]
pub fn hull(mesh: &Mesh) -> Region {
    let corners: Vec<Point2<f64>> = mesh.vertices.iter().map(|p| p.xy()).collect();
    Region::from_rings([convex_hull(&corners).as_slice()], Fill::NonZero)
}

/// Returns what a closed mesh covers, seen from above.
#[must_use]
pub fn outline(mesh: &Mesh) -> Region {
    // What looks up covers as much as all together, and is wound one way.
    let facets =
        mesh.triangles.iter().map(|corners| corners.map(|v| mesh.vertices[v as usize].xy()));
    let looks_up = |[a, b, c]: &[Point2<f64>; 3]| (b - a).perp(&(c - a)) > 0.0;
    let facets: Vec<[Point2<f64>; 3]> = facets.filter(looks_up).collect();
    Region::from_rings(facets.iter().map(<[_; 3]>::as_slice), Fill::NonZero)
}

/// Area that two outlines may share and still only touch, mm²: the corners of a part lie on a grid.
const TOUCHING_MM2: f64 = 1e-3;

/// Returns whether two outlines share an area.
#[must_use]
pub fn overlap(a: &Region, b: &Region) -> bool {
    a.intersection(b).area() > TOUCHING_MM2
}
