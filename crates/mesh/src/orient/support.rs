//! What a pose asks of the printer: how much of it hangs over, for each kind of layer.
//!
//! A bead rests on the layer below when the surface leans over it by no more than the overhang
//! angle `ω`: with the outward normal `n` of a facet and the direction `N` in which layers grow
//! there, unless `−n·N > sin ω`. Planes grow along z. Cones with angle α (above 0 sloping down
//! outwards) grow along `(sin α, cos α)` in the plane through the axis; spheres about a centre on
//! the axis grow away from it, which is a cone of the angle at which the centre sees the facet.
//!
//! In that plane let `c` be the direction of `−n` and `A` its length. The facet hangs over for all
//! angles within `acos(sin ω / A)` of `c`, one interval; so every facet adds its area to one run
//! of the angles tried, and one to a run of the centres tried: one pass for all of them.
//!
//! Facets are judged at their centroids: the angle to the axis of a facet that surrounds it means
//! nothing, and a very large facet counts wholly or not at all. Islands, which begin in mid-air on
//! facets that hang over by less, are not seen.

use super::{
    BED_SHARE, Candidate, OrientParams, PIECE, SAME_ANGLE_RAD, SAME_SHARE, part_from_model,
};
use crate::mesh::Mesh;
use crate::place::Placement;
use nalgebra::Point3;
use rayon::prelude::*;
use std::ops::Range;

/// Cones are tried up to this angle either way: beyond, no nozzle gets between the layers.
const MOST_CONE_DEG: usize = 45;

/// Number of cones tried, one a degree.
const CONES: usize = 2 * MOST_CONE_DEG + 1;

/// Number of spheres tried.
const SPHERES: usize = 33;

/// The centre of the first sphere lies as deep below the bed as the part reaches from the axis
/// (no layer leans by more than 45°), and that of each other this much deeper. The last is 256
/// times as deep: its layers lean by 0.2°.
const SPHERE_RATIO: f64 = 1.189_207_115_002_721;

/// How much of a pose hangs over, and what an estimate of its time needs. Areas mm².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rating {
    /// Area that hangs over with planar layers, and does not lie on the bed.
    pub planar_mm2: f64,
    /// The least such area with conical layers.
    pub cone_mm2: f64,
    /// The angle of those cones, rad; above 0 sloping down outwards. The least angle of several.
    pub cone_rad: f64,
    /// The least such area with spherical layers.
    pub sphere_mm2: f64,
    /// Height of the centre of those spheres, mm; negative. The deepest of several.
    pub sphere_centre_mm: f64,
    /// Area of the surface seen from the side: the outlines of all levels, integrated over z.
    pub outline_mm2: f64,
    /// Area of the surface seen from above, all of it that looks up.
    pub top_mm2: f64,
    /// Area of the surface seen from below, all of it that looks down.
    pub bottom_mm2: f64,
    /// Mean of `|n_z|` over the facets that are not flat: times the layer height, it is the mean
    /// stair step.
    pub stairs: f64,
}

/// Returns what a candidate asks of the printer when its footprint is centred on the axis.
#[must_use]
pub fn rate(mesh: &Mesh, candidate: &Candidate, params: &OrientParams) -> Rating {
    let rotation = part_from_model(mesh, &candidate.down);
    let placement = Placement::on_bed(mesh, &rotation);
    let vertices: Vec<Point3<f64>> = mesh.vertices.iter().map(|p| placement.point(p)).collect();
    let reach = vertices.iter().map(|p| p.xy().coords.norm()).fold(0.0, f64::max);
    let view = View {
        vertices: &vertices,
        least: params.overhang_rad.sin() + SAME_SHARE,
        of_class: params.class_tolerance_rad.cos(),
        near_bed: BED_SHARE * mesh.bounds().diagonal(),
        depths: (0..SPHERES).map(|j| reach * SPHERE_RATIO.powi(j as i32)).collect(),
    };
    let pieces: Vec<Sums> =
        mesh.triangles.par_chunks(PIECE).map(|piece| view.sums(piece)).collect();
    let mut sums = Sums::default();
    for piece in &pieces {
        sums.add(piece);
    }
    view.rating(&sums)
}

/// A mesh in its pose, and what it is judged by.
struct View<'a> {
    vertices: &'a [Point3<f64>],
    /// Sine of the overhang angle.
    least: f64,
    /// Facets with at least this `|n_z|` are flat.
    of_class: f64,
    /// Flat facets below this height lie on the bed, mm.
    near_bed: f64,
    /// Depths of the centres of spheres, ascending, mm.
    depths: Vec<f64>,
}

/// Areas, mm². Of cones and spheres, differences: the area of the `k`-th is the sum of `0..=k`.
#[derive(Debug, Clone)]
struct Sums {
    cones: Vec<f64>,
    spheres: Vec<f64>,
    outline: f64,
    top: f64,
    bottom: f64,
    not_flat: f64,
    stairs: f64,
}

impl Default for Sums {
    fn default() -> Self {
        Self {
            cones: vec![0.0; CONES + 1],
            spheres: vec![0.0; SPHERES + 1],
            outline: 0.0,
            top: 0.0,
            bottom: 0.0,
            not_flat: 0.0,
            stairs: 0.0,
        }
    }
}

impl Sums {
    fn add(&mut self, other: &Self) {
        let lists = self.cones.iter_mut().chain(&mut self.spheres);
        lists.zip(other.cones.iter().chain(&other.spheres)).for_each(|(a, b)| *a += b);
        self.outline += other.outline;
        self.top += other.top;
        self.bottom += other.bottom;
        self.not_flat += other.not_flat;
        self.stairs += other.stairs;
    }
}

impl View<'_> {
    fn sums(&self, piece: &[[u32; 3]]) -> Sums {
        let mut sums = Sums::default();
        for triangle in piece {
            self.count(triangle.map(|v| self.vertices[v as usize]), &mut sums);
        }
        sums
    }

    fn count(&self, corners: [Point3<f64>; 3], sums: &mut Sums) {
        let [a, b, c] = corners;
        let twice = (b - a).cross(&(c - a));
        let Some(normal) = twice.try_normalize(0.0) else { return };
        let area = twice.norm() / 2.0;
        sums.outline += area * normal.xy().norm();
        sums.top += area * normal.z.max(0.0);
        sums.bottom += area * (-normal.z).max(0.0);
        if normal.z.abs() < self.of_class {
            sums.not_flat += area;
            sums.stairs += area * normal.z.abs();
        }
        if -normal.z >= self.of_class && corners.iter().all(|p| p.z <= self.near_bed) {
            return;
        }
        let centre = corners.iter().map(|p| p.coords).sum::<nalgebra::Vector3<f64>>() / 3.0;
        let radius = centre.xy().norm();
        let outwards = if radius > 0.0 { centre.xy().dot(&normal.xy()) / radius } else { 0.0 };
        let length = outwards.hypot(normal.z);
        if length <= self.least {
            return;
        }
        let middle = (-outwards).atan2(-normal.z);
        let half = (self.least / length).acos() - SAME_ANGLE_RAD;
        let angles = middle - half..middle + half;
        let enter = |list: &mut [f64], run: Range<usize>| {
            if run.start < run.end {
                list[run.start] += area;
                list[run.end] -= area;
            }
        };
        enter(&mut sums.cones, cones_within(&angles));
        enter(&mut sums.spheres, self.spheres_within(&angles, radius, centre.z));
    }

    /// The spheres whose centre sees a place at an angle from the axis within `angles`.
    fn spheres_within(&self, angles: &Range<f64>, radius: f64, z: f64) -> Range<usize> {
        if angles.end <= 0.0 || (angles.start >= 0.0 && radius == 0.0) {
            return 0..0;
        }
        // The angle shrinks with the depth; at the depths below it is one of the ends.
        let depth_at = |angle: f64| radius / angle.tan() - z;
        let right = std::f64::consts::FRAC_PI_2;
        let from = if angles.end >= right { f64::NEG_INFINITY } else { depth_at(angles.end) };
        let to = if angles.start <= 0.0 { f64::INFINITY } else { depth_at(angles.start) };
        let first = self.depths.partition_point(|depth| *depth <= from);
        first..self.depths.partition_point(|depth| *depth < to)
    }

    fn rating(&self, sums: &Sums) -> Rating {
        let cones = running(&sums.cones[..CONES]);
        let spheres = running(&sums.spheres[..SPHERES]);
        let total: f64 = sums.outline + sums.top + sums.bottom;
        // Sums in another order differ in their last bits: what is equal but for that is equal.
        let same = SAME_SHARE * total;
        let by_angle = |k: &usize| k.abs_diff(MOST_CONE_DEG);
        let mut by_lean: Vec<usize> = (0..CONES).collect();
        by_lean.sort_by_key(by_angle);
        let cone = least(&cones, by_lean.into_iter(), same);
        let sphere = least(&spheres, (0..SPHERES).rev(), same);
        let clean = |area: f64| if area <= same { 0.0 } else { area };
        Rating {
            planar_mm2: clean(cones[MOST_CONE_DEG]),
            cone_mm2: clean(cones[cone]),
            cone_rad: cone_angle(cone),
            sphere_mm2: clean(spheres[sphere]),
            sphere_centre_mm: -self.depths[sphere],
            outline_mm2: sums.outline,
            top_mm2: sums.top,
            bottom_mm2: sums.bottom,
            stairs: if sums.not_flat > 0.0 { sums.stairs / sums.not_flat } else { 0.0 },
        }
    }
}

/// The angle of the `k`-th cone, rad.
fn cone_angle(k: usize) -> f64 {
    (k as f64 - MOST_CONE_DEG as f64).to_radians()
}

/// The cones whose angle lies within `angles`.
fn cones_within(angles: &Range<f64>) -> Range<usize> {
    let place = |angle: f64| angle.to_degrees() + MOST_CONE_DEG as f64;
    let first = (place(angles.start).floor() + 1.0).clamp(0.0, CONES as f64) as usize;
    first..place(angles.end).ceil().clamp(0.0, CONES as f64) as usize
}

fn running(differences: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let add = |difference: &f64| {
        sum += difference;
        sum
    };
    differences.iter().map(add).collect()
}

/// The first of `order` whose area is the least, up to `same`.
fn least(areas: &[f64], order: impl Iterator<Item = usize>, same: f64) -> usize {
    let lowest = areas.iter().copied().fold(f64::INFINITY, f64::min);
    let mut order = order;
    order.find(|&k| areas[k] <= lowest + same).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use nalgebra::Vector3;

    const USUAL: OrientParams = OrientParams {
        class_tolerance_rad: std::f64::consts::PI / 180.0,
        overhang_rad: std::f64::consts::FRAC_PI_4,
    };

    /// The rating of a mesh as it stands.
    fn upright(mesh: &Mesh) -> Rating {
        let candidate = Candidate {
            down: -Vector3::z(),
            class_area_mm2: 0.0,
            bed_area_mm2: 0.0,
            height_mm: 0.0,
            overhang_area_mm2: 0.0,
        };
        rate(mesh, &candidate, &USUAL)
    }

    #[test]
    fn a_cube_hangs_nowhere() {
        let rating = upright(&shapes::cube(20.0));
        assert_eq!((rating.planar_mm2, rating.cone_mm2, rating.sphere_mm2), (0.0, 0.0, 0.0));
        assert_eq!(rating.cone_rad, 0.0);
        assert!((rating.outline_mm2 - 1600.0).abs() < 1e-9);
        assert!((rating.top_mm2 - 400.0).abs() < 1e-9 && rating.stairs == 0.0);
    }

    #[test]
    fn ceilings_need_cones_of_45_degrees() {
        let rating = upright(&shapes::cross(20.0));
        assert!((rating.planar_mm2 - 1600.0).abs() < 1e-6, "{rating:?}");
        assert_eq!(rating.cone_mm2, 0.0);
        assert!((rating.cone_rad.abs().to_degrees() - 45.0).abs() < 1e-9);
    }

    /// A funnel: a cone on its tip, cut off, that widens upwards by `degrees` from the vertical.
    fn funnel(degrees: f64) -> Mesh {
        let wide = 2.0 + 10.0 * degrees.to_radians().tan();
        shapes::revolved(&[[0.0, 0.0], [2.0, 0.0], [wide, 10.0], [0.0, 10.0]], 256)
    }

    #[test]
    fn cones_hold_what_leans_outwards_by_their_angle_more() {
        for degrees in [50.0, 60.0, 75.0] {
            let rating = upright(&funnel(degrees));
            assert!(rating.planar_mm2 > 100.0, "{degrees}");
            assert_eq!(rating.cone_mm2, 0.0, "{degrees}");
            // Facets of a cone of 256 lean by as much as its outline, but for a part in 10⁴.
            let angle = rating.cone_rad.to_degrees();
            assert!((angle - (degrees - 45.0)).abs() <= 1.01, "{degrees}: {angle}");
        }
    }

    #[test]
    fn the_best_is_what_trying_all_finds() {
        let mesh = shapes::mushroom(48);
        let rating = upright(&mesh);
        let placement = Placement::on_bed(&mesh, &nalgebra::Rotation3::identity());
        let part = placement.mesh(&mesh);
        let hanging = |grows: &dyn Fn(f64, f64) -> f64| -> f64 {
            (0..part.triangles.len() as u32)
                .filter(|t| part.corners(*t).iter().any(|p| p.z > 1e-3))
                .map(|t| {
                    let mean = part.corners(t).iter().map(|p| p.coords).sum::<Vector3<f64>>() / 3.0;
                    let angle = grows(mean.xy().norm(), mean.z);
                    let out = mean.xy().normalize() * angle.sin();
                    let growth = Vector3::new(out.x, out.y, angle.cos());
                    let twice = part.area_vector(t);
                    let hangs = -twice.normalize().dot(&growth) > 45_f64.to_radians().sin() + 1e-5;
                    if hangs { twice.norm() / 2.0 } else { 0.0 }
                })
                .sum()
        };
        assert!((rating.planar_mm2 - hanging(&|_, _| 0.0)).abs() < 1e-6);
        let cones = (-45..=45).map(|d| hanging(&|_, _| f64::from(d).to_radians()));
        let best = cones.fold(f64::INFINITY, f64::min);
        assert!((rating.cone_mm2 - best).abs() < 1e-2, "{} {best}", rating.cone_mm2);
        let centre = rating.sphere_centre_mm;
        let at_centre = hanging(&|r, z| r.atan2(z - centre));
        assert!((rating.sphere_mm2 - at_centre).abs() < 1e-2, "{} {at_centre}", rating.sphere_mm2);
        let reach = part.vertices.iter().map(|p| p.xy().coords.norm()).fold(0.0, f64::max);
        for j in 0..SPHERES {
            let depth = reach * SPHERE_RATIO.powi(j as i32);
            let area = hanging(&|r, z| r.atan2(z + depth));
            assert!(area >= rating.sphere_mm2 - 1e-2, "{j}: {area}");
        }
    }

    #[test]
    fn an_empty_mesh_asks_for_nothing() {
        let rating = upright(&Mesh::default());
        assert_eq!((rating.planar_mm2, rating.sphere_mm2, rating.stairs), (0.0, 0.0, 0.0));
    }
}
