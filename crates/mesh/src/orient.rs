//! Which way a part lies on the bed: on its largest flat side.
//!
//! In and out: Model frame, mm, radians.
//!
//! Facets are gathered in *classes* of one direction, whichever way they face: a box of 10 × 20 ×
//! 30 has three classes, of 1200, 600 and 400 mm². The class with the most area goes on the bed,
//! on the side that the ranking below prefers:
//!
//! 1. largest class area,
//! 2. largest area on the bed,
//! 3. least height,
//! 4. least overhang: facing down beyond 45° and not on the bed,
//! 5. smallest turn from the given pose,
//! 6. least azimuth from the part's own reference direction.
//!
//! Values that agree but for rounding are equal. No rule depends on the order of the facets, and
//! none on how the model is turned about z: a model that is turned rests as before, but turned.
//!
//! When no class has a twentieth of the area there is no flat side to speak of, and the pose is
//! kept. Classes of which nothing would lie on the bed, because something else of the part sticks
//! out farther, are passed over: such a part would stand on a point.

mod classes;
mod lying;
mod support;

pub use support::{Rating, rate};

use crate::mesh::Mesh;
use crate::place::reference_azimuth;
use classes::{Class, Classes};
use lying::{Lying, View};
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::f64::consts::TAU;

/// What counts as one direction and as an overhang.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientParams {
    /// Normals up to this angle from the direction of a class belong to it, rad. Usual: 1°.
    /// Smaller, and a scanned flat falls apart; larger, and the facets of a round side add up.
    pub class_tolerance_rad: f64,
    /// Facets that face down by more than this angle from the vertical need support, rad.
    /// Usual: 45°.
    pub overhang_rad: f64,
}

/// A way to lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// The direction that goes down, of length 1.
    pub down: Vector3<f64>,
    /// Area of all facets that face this way or the opposite one, mm².
    pub class_area_mm2: f64,
    /// Area that lies on the bed, mm².
    pub bed_area_mm2: f64,
    /// Height of the part, mm.
    pub height_mm: f64,
    /// Area that faces down too steeply and does not lie on the bed, mm².
    pub overhang_area_mm2: f64,
}

/// How a part rests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rest {
    /// On a flat side.
    Flat(Candidate),
    /// As it was: no class is large enough, or none of those can lie on the bed.
    Kept {
        /// Area of the largest class by the area of the surface.
        largest_share: f64,
    },
}

/// Below this share of the area, a class is no flat side: an icosphere has 0.2 %, a part with one
/// flat worth standing on has at least this.
const LEAST_SHARE: f64 = 0.05;

/// A side to lie on has this share of the area, at least, ...
const LEAST_STAND_SHARE: f64 = 1e-3;

/// ... this near to the bed, as a share of the diagonal: a scanned side is rough, and nothing of
/// it may lie on the bed to within [`BED_SHARE`].
const STAND_DEPTH_SHARE: f64 = 1e-2;

/// Areas (as a share of the surface) and heights (as a share of the size) that differ by less
/// are equal. Rounding to `f32` moves them by 1e-7; two sides that a designer made different, by
/// more than 1e-4.
const SAME_SHARE: f64 = 1e-5;

/// Directions that differ by less are the same, rad.
const SAME_ANGLE_RAD: f64 = 1e-6;

/// A facet lies on the bed when its corners are this near to it, as a share of the diagonal.
const BED_SHARE: f64 = 1e-4;

/// Facets of one piece of work. Pieces are added up in their order: sums do not depend on the
/// number of threads.
const PIECE: usize = 1 << 16;

/// How many classes are offered to the user.
const MOST_CLASSES: usize = 8;

/// Returns ways to lie, the best first.
#[must_use]
pub fn candidates(mesh: &Mesh, params: &OrientParams) -> Vec<Candidate> {
    let Classes { classes, total_mm2 } = classes::classes(mesh, params.class_tolerance_rad, 0.0);
    let view = View::of(mesh, total_mm2, params);
    let ranked = ranked(&view, &classes[..classes.len().min(MOST_CLASSES)]);
    ranked.into_iter().map(|lying| lying.candidate).collect()
}

/// Returns the rotation `part_from_model` that lays the part down as a candidate says.
#[must_use]
pub fn laid(mesh: &Mesh, candidate: &Candidate) -> Rotation3<f64> {
    part_from_model(mesh, &candidate.down)
}

/// Returns the rotation `part_from_model` that lays the part on its largest flat side.
#[must_use]
pub fn rest(mesh: &Mesh, params: &OrientParams) -> (Rotation3<f64>, Rest) {
    let all = classes::classes(mesh, params.class_tolerance_rad, LEAST_SHARE);
    let view = View::of(mesh, all.total_mm2, params);
    let largest_share = all.classes.first().map_or(0.0, |class| class.area_mm2 / all.total_mm2);
    let mut classes = all.classes.as_slice();
    while let Some(first) = classes.first().filter(|c| c.area_mm2 >= LEAST_SHARE * all.total_mm2) {
        let least = first.area_mm2 - SAME_SHARE * all.total_mm2;
        let (tied, smaller) = classes.split_at(classes.partition_point(|c| c.area_mm2 >= least));
        let stands = |c: &Lying| c.stand_mm2 >= LEAST_STAND_SHARE * all.total_mm2;
        if let Some(best) = ranked(&view, tied).into_iter().find(stands) {
            let best = best.candidate;
            return (part_from_model(mesh, &best.down), Rest::Flat(best));
        }
        classes = smaller;
    }
    (Rotation3::identity(), Rest::Kept { largest_share })
}

/// Returns the rotation that takes a direction to −z, without losing digits anywhere.
///
/// For directions below the horizon it is the smallest such rotation; above, half a turn about x
/// and then the smallest, because the smallest alone is undefined at the zenith. `down` must have
/// length 1.
#[must_use]
pub fn down_to_bed(down: &Vector3<f64>) -> Rotation3<f64> {
    let smallest = |x: f64, y: f64, z: f64| {
        let k = 1.0 / (1.0 - z);
        Matrix3::new(1.0 - x * x * k, -x * y * k, x, -x * y * k, 1.0 - y * y * k, y, -x, -y, -z)
    };
    let matrix = if down.z <= 0.0 {
        smallest(down.x, down.y, down.z)
    } else {
        let half_turn = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        smallest(down.x, -down.y, -down.z) * half_turn
    };
    Rotation3::from_matrix_unchecked(matrix)
}

/// The rotation to the bed, with the half turn about an axis that turns with the part.
fn part_from_model(mesh: &Mesh, down: &Vector3<f64>) -> Rotation3<f64> {
    if down.z <= 0.0 {
        return down_to_bed(down);
    }
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), reference_azimuth(mesh));
    turn * down_to_bed(&(turn.inverse() * down)) * turn.inverse()
}

/// The candidates of some classes, the best first.
fn ranked(view: &View, classes: &[Class]) -> Vec<Lying> {
    let mut lying = view.lying(classes);
    let mesh = view.mesh;
    let area = SAME_SHARE * view.total_mm2;
    let length = SAME_SHARE * view.diagonal;
    // Computed when two candidates differ in nothing else.
    let mut reference = None;
    let mut ranked = Vec::with_capacity(lying.len());
    while !lying.is_empty() {
        let at = |i: usize| &lying[i].candidate;
        let mut best: Vec<usize> = (0..lying.len()).collect();
        keep_least(&mut best, area, |i| -at(i).class_area_mm2);
        keep_least(&mut best, area, |i| -at(i).bed_area_mm2);
        keep_least(&mut best, length, |i| at(i).height_mm);
        keep_least(&mut best, area, |i| at(i).overhang_area_mm2);
        keep_least(&mut best, SAME_ANGLE_RAD, |i| at(i).down.z);
        if best.len() > 1 {
            let reference = *reference.get_or_insert_with(|| reference_azimuth(mesh));
            keep_least(&mut best, 0.0, |i| azimuth_from(reference, &at(i).down));
        }
        ranked.push(lying.remove(best[0]));
    }
    ranked
}

/// Keeps those whose value is the least, up to `tolerance`.
fn keep_least(best: &mut Vec<usize>, tolerance: f64, value: impl Fn(usize) -> f64) {
    let least = best.iter().map(|i| value(*i)).fold(f64::INFINITY, f64::min);
    best.retain(|i| value(*i) <= least + tolerance);
}

/// How far a direction lies counter-clockwise from the reference, seen from above; what is just
/// short of a full turn counts as none.
fn azimuth_from(reference: f64, down: &Vector3<f64>) -> f64 {
    let turn = (down.y.atan2(down.x) - reference).rem_euclid(TAU);
    if turn > TAU - SAME_ANGLE_RAD { 0.0 } else { turn }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    const USUAL: OrientParams = OrientParams {
        class_tolerance_rad: std::f64::consts::PI / 180.0,
        overhang_rad: std::f64::consts::FRAC_PI_4,
    };

    fn turned(mesh: &Mesh, rotation: &Rotation3<f64>) -> Mesh {
        let vertices = mesh.vertices.iter().map(|p| rotation * p).collect();
        Mesh { vertices, triangles: mesh.triangles.clone() }
    }

    fn best(mesh: &Mesh) -> Candidate {
        match rest(mesh, &USUAL).1 {
            Rest::Flat(candidate) => candidate,
            kept => panic!("{kept:?}"),
        }
    }

    /// An L of 40 × 30 × 20 with arms of 5.
    fn bracket() -> Mesh {
        let outline = [[0.0, 0.0], [40.0, 0.0], [40.0, 5.0], [5.0, 5.0], [5.0, 30.0], [0.0, 30.0]];
        shapes::extruded(&outline, &[], 20.0)
    }

    fn some_rotations() -> Vec<Rotation3<f64>> {
        (0..12)
            .map(|i| {
                let i = f64::from(i);
                Rotation3::from_euler_angles(0.3 + 1.1 * i, 2.3 * i, 0.7 * i)
            })
            .collect()
    }

    #[test]
    fn a_cube_stays_as_it_is() {
        let (rotation, rest) = rest(&shapes::cube(20.0), &USUAL);
        assert_eq!(rotation, Rotation3::identity());
        let Rest::Flat(best) = rest else { panic!("{rest:?}") };
        assert_eq!((best.class_area_mm2, best.bed_area_mm2, best.height_mm), (800.0, 400.0, 20.0));
        assert_eq!(best.overhang_area_mm2, 0.0);
    }

    #[test]
    fn boxes_and_brackets_lie_on_their_largest_side() {
        let block = shapes::block(10.0, 20.0, 30.0);
        for rotation in some_rotations() {
            let lying = best(&turned(&block, &rotation));
            assert!((lying.class_area_mm2 - 1200.0).abs() < 1e-6);
            assert!((lying.height_mm - 10.0).abs() < 1e-6);
            let lying = best(&turned(&bracket(), &rotation));
            assert!((lying.class_area_mm2 - 1600.0).abs() < 1e-6, "{lying:?}");
            assert!((lying.bed_area_mm2 - 800.0).abs() < 1e-6, "not on the small arm");
            assert!((lying.height_mm - 30.0).abs() < 1e-6);
            assert!((rotation.inverse() * lying.down + Vector3::y()).norm() < 1e-6);
        }
    }

    #[test]
    fn candidates_are_ranked() {
        let ranked = candidates(&bracket(), &USUAL);
        let areas: Vec<f64> = ranked.iter().map(|c| c.class_area_mm2.round()).collect();
        assert_eq!(areas, [1600.0, 1600.0, 1200.0, 1200.0, 650.0, 650.0]);
        assert!(ranked[0].bed_area_mm2 > ranked[1].bed_area_mm2);
    }

    #[test]
    fn round_parts_keep_their_pose() {
        let (rotation, rest) = rest(&shapes::icosphere(4, 20.0), &USUAL);
        assert_eq!(rotation, Rotation3::identity());
        assert!(matches!(rest, Rest::Kept { largest_share } if largest_share < 0.01));
        assert_eq!(super::rest(&Mesh::default(), &USUAL).1, Rest::Kept { largest_share: 0.0 });
    }

    #[test]
    fn parts_do_not_stand_on_a_point() {
        // A dish with a spike on both sides of its flat walls.
        let spike =
            |z: f64| [[0.0, -z], [2.0, 0.0], [20.0, 0.0], [20.0, 1.0], [2.0, 1.0], [0.0, 1.0 + z]];
        let (_, both) = rest(&shapes::revolved(&spike(9.0), 32), &USUAL);
        assert!(matches!(both, Rest::Kept { largest_share } if largest_share > 0.5), "{both:?}");
        let mut one_side = spike(9.0);
        one_side[0][1] = 0.0;
        assert!((best(&shapes::revolved(&one_side, 32)).down + Vector3::z()).norm() < 1e-9);
    }

    #[test]
    fn noise_does_not_split_a_side() {
        let mut mesh = shapes::block(10.0, 20.0, 30.0);
        // Every corner is off by up to 10 µm.
        let mut state = 3_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * 0.02
        };
        for p in &mut mesh.vertices {
            *p += Vector3::new(noise(), noise(), noise());
        }
        let params = OrientParams { class_tolerance_rad: 3_f64.to_radians(), ..USUAL };
        let Rest::Flat(best) = rest(&mesh, &params).1 else { panic!("a flat side") };
        assert!((best.class_area_mm2 - 1200.0).abs() < 3.0);
    }

    #[test]
    fn the_bed_is_met_exactly() {
        for rotation in some_rotations() {
            let down = rotation * Vector3::x();
            let to_bed = down_to_bed(&down);
            assert!((to_bed * down + Vector3::z()).norm() < 1e-15);
            let matrix = to_bed.matrix();
            assert!((matrix * matrix.transpose() - Matrix3::identity()).norm() < 1e-14);
            assert!((matrix.determinant() - 1.0).abs() < 1e-14);
        }
        assert_eq!(down_to_bed(&-Vector3::z()), Rotation3::identity());
    }

    #[test]
    fn turning_the_model_turns_its_resting_pose() {
        let part = bracket();
        for tilt in [0.0, 0.4, 2.0, std::f64::consts::PI] {
            let given = turned(&part, &Rotation3::from_euler_angles(tilt, 0.1 * tilt, 0.0));
            let (to_part, _) = rest(&given, &USUAL);
            for angle in [0.3, 1.0, 2.5, 4.0] {
                let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
                let (to_part_turned, _) = rest(&turned(&given, &turn), &USUAL);
                let error = (to_part_turned * turn).matrix() - (turn * to_part).matrix();
                assert!(error.norm() < 1e-6, "{tilt} {angle}: {error}");
            }
        }
    }

    #[test]
    fn facet_order_does_not_matter() {
        for name in shapes::NAMES {
            let mesh = shapes::by_name(name).unwrap();
            let mut shuffled = mesh.clone();
            shuffled.triangles.reverse();
            shuffled.triangles.rotate_left(mesh.triangles.len() / 3);
            let (a, b) = (rest(&mesh, &USUAL).0, rest(&shuffled, &USUAL).0);
            assert!((a.matrix() - b.matrix()).norm() < 1e-9, "{name}");
        }
    }
}
