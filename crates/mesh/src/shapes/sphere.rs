//! Spheres of nearly equal triangles.

use crate::mesh::Mesh;
use crate::topology::Edges;
use nalgebra::{Point3, center};

/// Returns a sphere of 20·4^`level` triangles: an icosahedron whose triangles are divided in four
/// `level` times, every vertex at `radius` from the centre.
///
/// # Panics
///
/// When `level` is above 12, which is a third of a billion triangles.
#[must_use]
pub fn icosphere(level: u32, radius: f64) -> Mesh {
    assert!(level <= 12, "the vertices of level {level} cannot be numbered");
    let mut mesh = icosahedron();
    for _ in 0..level {
        mesh = divided(&mesh);
    }
    for p in &mut mesh.vertices {
        *p *= radius;
    }
    let lowest = mesh.bounds().min.z;
    for p in &mut mesh.vertices {
        p.z -= lowest;
    }
    mesh
}

/// Splits every triangle in four; new vertices are lifted to the unit sphere.
fn divided(mesh: &Mesh) -> Mesh {
    let edges = Edges::of(mesh);
    let n_old = mesh.vertices.len() as u32;
    let mut vertices = mesh.vertices.clone();
    vertices.extend((0..edges.len() as u32).map(|edge| {
        let [a, b] = edges.ends(mesh, edge).map(|v| mesh.vertices[v as usize]);
        Point3::from(center(&a, &b).coords.normalize())
    }));
    let mut triangles = Vec::with_capacity(4 * mesh.triangles.len());
    for (&[a, b, c], of) in mesh.triangles.iter().zip(edges.of_triangles()) {
        let [ab, bc, ca] = of.map(|edge| n_old + edge);
        triangles.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    Mesh { vertices, triangles }
}

fn icosahedron() -> Mesh {
    // Three golden rectangles, one in each coordinate plane.
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut vertices = Vec::new();
    for (s, t) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        vertices.push(Point3::new(0.0, s, t * g));
        vertices.push(Point3::new(s, t * g, 0.0));
        vertices.push(Point3::new(t * g, 0.0, s));
    }
    let mut triangles = Vec::new();
    let adjacent = |a: &Point3<f64>, b: &Point3<f64>| ((a - b).norm() - 2.0).abs() < 0.1;
    for a in 0..12_usize {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [a, b, c].map(|i| vertices[i]);
                if adjacent(&p, &q) && adjacent(&q, &r) && adjacent(&r, &p) {
                    let outward = (q - p).cross(&(r - p)).dot(&p.coords) > 0.0;
                    let [a, b, c] = [a, b, c].map(|i| i as u32);
                    triangles.push(if outward { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    for p in &mut vertices {
        *p = Point3::from(p.coords.normalize());
    }
    Mesh { vertices, triangles }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure;
    use std::f64::consts::PI;

    #[test]
    fn area_and_volume_approach_the_sphere() {
        for level in 0..5 {
            let mesh = icosphere(level, 10.0);
            assert_eq!(mesh.triangles.len(), 20 << (2 * level));
            assert_eq!(mesh.vertices.len(), (10 << (2 * level)) + 2);
            let share = measure::volume_mm3(&mesh) / (4.0 / 3.0 * PI * 1000.0);
            let missing = 0.6 * 0.25_f64.powi(level as i32);
            assert!(share < 1.0 && share > 1.0 - missing, "{level}: {share}");
        }
    }
}
