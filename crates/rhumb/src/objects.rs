//! Several models on one bed, seen from above.

use std::ops::Range;

use geom::circle::convex_hull;
use geom::grid::mm;
use geom::region::{Fill, Region};
use mesh::mesh::Mesh;
use nalgebra::Point2;

/// One of several models, where it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// What it is called.
    pub name: String,
    /// Which model of the command line it is, counted from 0; copies are the same.
    pub model: usize,
    /// Its vertices in the mesh of all.
    pub vertices: Range<usize>,
    /// Its facets there.
    pub triangles: Range<usize>,
    /// Its outline from above, part frame, or, where no other model reaches into the box around it,
    /// the hull of it.
    pub outline: Region,
}

impl Object {
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
