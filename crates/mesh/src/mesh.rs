//! Triangles that share vertices.
//!
//! Vertices keep the coordinates of the Model frame, mm: `f64` holds every `f32` of the file
//! exactly, so a difference of two vertices (all that is ever computed) is as good as after any
//! recentring.

use geom::bounding::Bounds;
use nalgebra::{Isometry3, Point3, Vector3};

/// Triangles over shared vertices. Any two triangles may share anything: what is closed, open or
/// doubled is for [`Solid`](crate::topology::Solid) to say.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Positions, mm.
    pub vertices: Vec<Point3<f64>>,
    /// Corners as vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// Why a mesh is not one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshFault {
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not finite: {position}")]
    NotFinite {
        /// The vertex.
        vertex: usize,
        /// Its position.
        position: Point3<f64>,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, there are {vertices}")]
    NoSuchVertex {
        /// The triangle.
        triangle: usize,
        /// What it names.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A triangle names a vertex twice.
    #[error("triangle {triangle} names vertex {vertex} twice")]
    RepeatedCorner {
        /// The triangle.
        triangle: usize,
        /// The vertex.
        vertex: u32,
    },
    /// A side of a [`Solid`](crate::topology::Solid) breaks the rule of the sides.
    #[error("side {side}: {rule}")]
    BadSide {
        /// The side.
        side: usize,
        /// The rule that does not hold.
        rule: &'static str,
    },
}

impl Mesh {
    /// Returns the mesh moved by `to_from_here`.
    #[must_use]
    pub fn transformed(&self, to_from_here: &Isometry3<f64>) -> Self {
        let vertices = self.vertices.iter().map(|p| to_from_here * p).collect();
        Self { vertices, triangles: self.triangles.clone() }
    }

    /// Returns the smallest box around all vertices, mm.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        Bounds::of(&self.vertices)
    }

    /// Returns the corners of a triangle.
    #[must_use]
    pub fn corners(&self, triangle: u32) -> [Point3<f64>; 3] {
        self.triangles[triangle as usize].map(|v| self.vertices[v as usize])
    }

    /// Returns the outward normal of a triangle times twice its area, mm².
    #[must_use]
    pub fn area_vector(&self, triangle: u32) -> Vector3<f64> {
        self.area_vector_of(&self.triangles[triangle as usize])
    }

    /// The same of a triangle that is given by its corners.
    pub(crate) fn area_vector_of(&self, corners: &[u32; 3]) -> Vector3<f64> {
        let [a, b, c] = corners.map(|v| self.vertices[v as usize]);
        (b - a).cross(&(c - a))
    }

    /// Checks that coordinates are finite, and that every triangle names three different vertices
    /// that exist.
    ///
    /// # Errors
    ///
    /// The first [`MeshFault`].
    pub fn check(&self) -> Result<(), MeshFault> {
        for (vertex, p) in self.vertices.iter().enumerate() {
            if !p.iter().all(|c| c.is_finite()) {
                return Err(MeshFault::NotFinite { vertex, position: *p });
            }
        }
        for (triangle, corners) in self.triangles.iter().enumerate() {
            let vertices = self.vertices.len();
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices) {
                return Err(MeshFault::NoSuchVertex { triangle, vertex, vertices });
            }
            if let Some(vertex) = repeated(corners) {
                return Err(MeshFault::RepeatedCorner { triangle, vertex });
            }
        }
        Ok(())
    }

    /// Returns whether there are vertices that no triangle names.
    pub(crate) fn has_unused_vertices(&self) -> bool {
        let mut used = vec![false; self.vertices.len()];
        for &v in self.triangles.iter().flatten() {
            used[v as usize] = true;
        }
        used.contains(&false)
    }

    /// Removes the vertices that no triangle names; the others keep their order.
    pub(crate) fn drop_unused_vertices(&mut self) {
        let mut number = vec![u32::MAX; self.vertices.len()];
        for &v in self.triangles.iter().flatten() {
            number[v as usize] = 0;
        }
        if !number.contains(&u32::MAX) {
            return;
        }
        let mut kept = 0;
        for (v, number) in number.iter_mut().enumerate() {
            if *number == 0 {
                self.vertices[kept as usize] = self.vertices[v];
                *number = kept;
                kept += 1;
            }
        }
        self.vertices.truncate(kept as usize);
        for v in self.triangles.iter_mut().flatten() {
            *v = number[*v as usize];
        }
    }
}

/// Returns a vertex that a triangle names twice.
pub(crate) fn repeated(corners: &[u32; 3]) -> Option<u32> {
    let [a, b, c] = *corners;
    if a == b || a == c {
        Some(a)
    } else if b == c {
        Some(b)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Mesh {
        let vertices = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [9.0, 9.0, 9.0], [0.0, 2.0, 0.0]];
        Mesh { vertices: vertices.map(Point3::from).to_vec(), triangles: vec![[0, 1, 3]] }
    }

    #[test]
    fn faults_are_found() {
        let good = triangle();
        assert_eq!(good.check(), Ok(()));
        let mut bad = good;
        bad.triangles.push([0, 1, 4]);
        assert!(matches!(bad.check(), Err(MeshFault::NoSuchVertex { triangle: 1, .. })));
        bad.triangles[1] = [3, 1, 3];
        let fault = MeshFault::RepeatedCorner { triangle: 1, vertex: 3 };
        assert_eq!(bad.check(), Err(fault));
        bad.vertices[2].y = f64::NAN;
        assert!(matches!(bad.check(), Err(MeshFault::NotFinite { vertex: 2, .. })));
    }

    #[test]
    fn unused_vertices_go_and_the_shape_stays() {
        let mut mesh = triangle();
        let corners = mesh.corners(0);
        mesh.drop_unused_vertices();
        assert_eq!(mesh.vertices.len(), 3);
        assert_eq!(mesh.corners(0), corners);
        assert_eq!(mesh.area_vector(0), Vector3::new(0.0, 0.0, 4.0));
    }

    #[test]
    fn moving_moves_the_box() {
        let moved = triangle().transformed(&Isometry3::translation(1.0, 2.0, 3.0));
        assert_eq!(moved.bounds().max, Point3::new(10.0, 11.0, 12.0));
    }
}
