//! How much of a part hangs over: with planar layers, and with those that were chosen.

use mesh::mesh::Mesh;
use nalgebra::Point3;
use slicer::overhang::overhang;
use slicer::surface::{LayerSurface, Plane};

/// Unsupported area, mm².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overhang {
    /// With planar layers.
    pub planar: f64,
    /// With the layers that were chosen.
    pub chosen: f64,
}

/// What stands this near to the bed rests on it, mm.
const ON_BED_MM: f64 = 0.01;

/// Returns the area of the facets that lean out over the layers by more than `limit` (radians), each
/// judged at its centre.
#[must_use]
pub fn overhangs(part: &Mesh, chosen: &dyn LayerSurface, limit: f64) -> Overhang {
    let (mut planar, mut on_chosen) = (0.0, 0.0);
    for triangle in &part.triangles {
        let [a, b, c] = triangle.map(|v| part.vertices[v as usize]);
        let product = (b - a).cross(&(c - a));
        let twice_area = product.norm();
        if twice_area == 0.0 || a.z.max(b.z).max(c.z) < ON_BED_MM {
            continue;
        }
        let outward = product / twice_area;
        let centre = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        let area = |surface: &dyn LayerSurface| {
            let hangs = overhang(surface, &centre, &outward) > limit;
            if hangs { twice_area / 2.0 } else { 0.0 }
        };
        planar += area(&Plane);
        on_chosen += area(chosen);
    }
    Overhang { planar, chosen: on_chosen }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;
    use slicer::surface::Cone;

    #[test]
    fn cones_carry_what_planes_do_not() {
        let mushroom = shapes::mushroom(96);
        let limit = 45.0_f64.to_radians();
        let cone = Cone::new(46.0_f64.to_radians()).unwrap();
        let found = overhangs(&mushroom, &cone, limit);
        assert!(found.planar > 1000.0, "{found:?}");
        assert!(found.chosen < 0.2 * found.planar, "{found:?}");
        let flat = overhangs(&mushroom, &Plane, limit);
        assert_eq!(flat.planar, flat.chosen);
        assert_eq!(overhangs(&shapes::cube(10.0), &Plane, limit).planar, 0.0);
    }
}
