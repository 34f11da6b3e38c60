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
    let all = [f64::NEG_INFINITY, f64::INFINITY];
    let of = |surface| overhangs_between(part, surface, limit, all);
    Overhang { planar: of(&Plane), chosen: of(chosen) }
}

/// Returns the area between two heights of the facets that lean out over layers by more than `limit`
/// (radians), mm².
pub(crate) fn overhangs_between(
    part: &Mesh,
    surface: &dyn LayerSurface,
    limit: f64,
    [low, high]: [f64; 2],
) -> f64 {
    let corners = part.triangles.iter().map(|t| t.map(|v| part.vertices[v as usize]));
    let hanging = corners.filter_map(|[a, b, c]| {
        let product = (b - a).cross(&(c - a));
        let twice_area = product.norm();
        let highest = a.z.max(b.z).max(c.z);
        let is_beside = highest <= low || a.z.min(b.z).min(c.z) >= high;
        if twice_area == 0.0 || highest < ON_BED_MM || is_beside {
            return None;
        }
        let outward = product / twice_area;
        let centre = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        let hangs = overhang(surface, &centre, &outward) > limit;
        let share = || share_below([a.z, b.z, c.z], high) - share_below([a.z, b.z, c.z], low);
        hangs.then(|| share() * twice_area / 2.0)
    });
    hanging.sum()
}

/// The share of a triangle whose corners have these heights that lies below `limit`.
fn share_below(mut heights: [f64; 3], limit: f64) -> f64 {
    heights.sort_by(f64::total_cmp);
    let [low, middle, high] = heights;
    if limit >= high {
        1.0
    } else if limit <= low {
        0.0
    } else if limit <= middle {
        (limit - low).powi(2) / ((middle - low) * (high - low))
    } else {
        1.0 - (high - limit).powi(2) / ((high - middle) * (high - low))
    }
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

    #[test]
    fn what_hangs_between_two_heights_is_a_share_of_all() {
        // Half a ball upside down: the zone between two heights has the area 2·pi·r·dz.
        let mut bowl = shapes::dome(15.0, 96);
        for p in &mut bowl.vertices {
            *p = Point3::new(p.x, -p.y, 15.0 - p.z);
        }
        let limit = 10.0_f64.to_radians();
        let found = overhangs_between(&bowl, &Plane, limit, [2.0, 3.3]);
        let zone = std::f64::consts::TAU * 15.0 * 1.3;
        assert!((found / zone - 1.0).abs() < 0.01, "{found} {zone}");
        assert_eq!(overhangs_between(&bowl, &Plane, limit, [15.0, 20.0]), 0.0);
    }
}
