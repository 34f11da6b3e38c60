//! Volume, area and centroids of a mesh, by exact polynomial integrals.
//!
//! Every triangle spans a tetrahedron with a common origin; their signed volumes add up to the
//! enclosed volume, a surface integral in the sense of Gauss. The origin is the centre of the
//! bounding box: about the origin of the file, a part at 10⁶ mm would lose ten digits. Unit mm,
//! frame that of the mesh.

use crate::mesh::Mesh;
use nalgebra::{Matrix3, Point3, Vector3};

/// Returns the point that sums are taken about: the centre of the box around the mesh.
#[must_use]
pub fn local_origin(mesh: &Mesh) -> Point3<f64> {
    let bounds = mesh.bounds();
    if bounds.is_empty() { Point3::origin() } else { nalgebra::center(&bounds.min, &bounds.max) }
}

/// Returns the signed volume between a triangle and `origin`, mm³.
#[must_use]
pub fn cone_volume(origin: &Point3<f64>, corners: &[Point3<f64>; 3]) -> f64 {
    let [a, b, c] = corners.map(|p| p - origin);
    a.dot(&b.cross(&c)) / 6.0
}

/// Returns the area of a triangle, mm².
#[must_use]
pub fn area_of(corners: &[Point3<f64>; 3]) -> f64 {
    let [a, b, c] = corners;
    (b - a).cross(&(c - a)).norm() / 2.0
}

fn all_corners(mesh: &Mesh) -> impl Iterator<Item = [Point3<f64>; 3]> {
    (0..mesh.triangles.len() as u32).map(|t| mesh.corners(t))
}

/// Returns the enclosed volume, mm³: material counts as often as it is enclosed, inside-out
/// shells count negatively. Without meaning where the surface is open.
#[must_use]
pub fn volume_mm3(mesh: &Mesh) -> f64 {
    let origin = local_origin(mesh);
    all_corners(mesh).map(|corners| cone_volume(&origin, &corners)).sum()
}

/// Returns the area of the surface, mm².
#[must_use]
pub fn area_mm2(mesh: &Mesh) -> f64 {
    all_corners(mesh).map(|corners| area_of(&corners)).sum()
}

/// Returns volume (mm³) and area (mm²) in one pass.
#[must_use]
pub fn volume_and_area(mesh: &Mesh) -> (f64, f64) {
    let origin = local_origin(mesh);
    all_corners(mesh).fold((0.0, 0.0), |(volume, area), corners| {
        (volume + cone_volume(&origin, &corners), area + area_of(&corners))
    })
}

/// Returns the centre of the enclosed volume; `None` when that is zero.
#[must_use]
pub fn centroid(mesh: &Mesh) -> Option<Point3<f64>> {
    let origin = local_origin(mesh);
    let mut volume = 0.0;
    let mut moment = Vector3::zeros();
    for corners in all_corners(mesh) {
        let v = cone_volume(&origin, &corners);
        volume += v;
        // The centre of a tetrahedron is the mean of its corners; one of them is the origin.
        moment += corners.iter().map(|p| p - origin).sum::<Vector3<f64>>() * (v / 4.0);
    }
    let centre = origin + moment / volume;
    centre.iter().all(|c| c.is_finite()).then_some(centre)
}

/// Area and its first two moments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceMoments {
    /// The area, mm².
    pub area_mm2: f64,
    /// The centre of the surface.
    pub centre: Point3<f64>,
    /// Second moments about the centre, ∫ (p − centre)(p − centre)ᵀ dA, mm⁴. Its eigenvectors are
    /// the principal directions of the surface.
    pub second_mm4: Matrix3<f64>,
}

/// Returns the moments of the surface; `None` when its area is zero.
#[must_use]
pub fn surface_moments(mesh: &Mesh) -> Option<SurfaceMoments> {
    let origin = local_origin(mesh);
    let mut area = 0.0;
    let mut first = Vector3::zeros();
    let mut second = Matrix3::zeros();
    for corners in all_corners(mesh) {
        let a = area_of(&corners);
        let arms = corners.map(|p| p - origin);
        let sum: Vector3<f64> = arms.iter().sum();
        area += a;
        first += sum * (a / 3.0);
        // ∫ p pᵀ over a triangle is A/12 (Σ pᵢ pᵢᵀ + s sᵀ) with s = Σ pᵢ.
        let squares: Matrix3<f64> = arms.iter().map(|p| p * p.transpose()).sum();
        second += (squares + sum * sum.transpose()) * (a / 12.0);
    }
    let mean = first / area;
    if !mean.iter().all(|c| c.is_finite()) {
        return None;
    }
    let second_mm4 = second - mean * mean.transpose() * area;
    Some(SurfaceMoments { area_mm2: area, centre: origin + mean, second_mm4 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use nalgebra::Isometry3;

    #[test]
    fn cube_anywhere() {
        for shift in [0.0, 1e6] {
            let mesh = shapes::cube(20.0).transformed(&Isometry3::translation(shift, 0.0, 3.0));
            assert!((volume_mm3(&mesh) - 8000.0).abs() < 1e-6);
            assert!((area_mm2(&mesh) - 2400.0).abs() < 1e-6);
            let centre = Point3::new(shift, 0.0, 13.0);
            assert!((centroid(&mesh).unwrap() - centre).norm() < 1e-6);
        }
    }

    #[test]
    fn second_moments_of_a_cube_surface() {
        // Two faces at ±10: 2·400·100; four faces: 400·20²/12 each.
        let moments = surface_moments(&shapes::cube(20.0)).unwrap();
        let expected = 2.0 * 400.0 * 100.0 + 4.0 * 400.0 * 400.0 / 12.0;
        let second = moments.second_mm4;
        assert!((second - Matrix3::identity() * expected).norm() < 1e-6 * expected);
        assert!((moments.centre - Point3::new(0.0, 0.0, 10.0)).norm() < 1e-9);
    }

    #[test]
    fn tetrahedron_centroid_is_the_mean_of_its_corners() {
        let mesh = shapes::tetrahedron(10.0);
        let mean = mesh.vertices.iter().map(|p| p.coords).sum::<Vector3<f64>>() / 4.0;
        assert!((centroid(&mesh).unwrap().coords - mean).norm() < 1e-12);
    }

    #[test]
    fn nothing_has_no_centre() {
        assert_eq!(centroid(&Mesh::default()), None);
        assert_eq!(surface_moments(&Mesh::default()), None);
        assert_eq!(volume_mm3(&Mesh::default()), 0.0);
    }
}
