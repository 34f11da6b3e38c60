//! A nozzle on the carriage that one or two axes tilt about a pivot.
//!
//! With `B` about the machine's y axis and `A` about its x axis, applied first, the nozzle points along
//! `t = Ry(B)·Rx(A)·z = (sin B·cos A, −sin A, cos B·cos A)`. The pivot stands at `tip + L·t`.
//!
//! * Two axes: carriage, bed and lift bring the *pivot* to its place by the ordinary inverse, and
//!   `A = −asin t_y`, `B = atan2(t_x, t_z)`. A nozzle beside the plane of the pivot (`offset`) shifts
//!   where the pivot is with the turn of the bed; iterated, each pass gains about two digits.
//! * One axis, `B` in the plane of the rail: the bed turns as for an upright nozzle over the *tip*, the
//!   carriage stands `L·sin B` farther out. What of the direction points across the rail cannot be
//!   followed: none for surfaces of revolution about the axis, and `asin |t_y|` in general.

use nalgebra::{Point3, Rotation2, Rotation3, UnitVector3, Vector2, Vector3};

use super::{HEAD_AXES, HeadAxis, Pose, Reached, Stance, in_part, over_rail};
use crate::kinematics::{Alignment, Branch, Unreachable};
use crate::profile::Axis;
use crate::program::{BedTurn, Joints};

/// See the [module](self).
#[derive(Debug, Clone, PartialEq)]
pub struct Tilting {
    /// From the pivot to the tip, mm.
    pub pivot_length: f64,
    /// How far the tip lies from the line down from the pivot, with both tilts zero, mm. Where it stands
    /// then is told by the alignment of the rail, which is that of the upright nozzle.
    pub offset: Vector2<f64>,
    /// Its tilts: `B`, or `A` and `B`.
    pub axes: Vec<HeadAxis>,
}

/// Passes of the iterations below; they end much earlier.
const MOST_PASSES: usize = 60;

/// Change of a turn below which an iteration has ended, radians.
const SETTLED: f64 = 1e-15;

impl Tilting {
    /// Returns a head with one axis, in the plane of the rail.
    #[must_use]
    pub fn one_axis(pivot_length: f64, along: Axis) -> Self {
        Self { pivot_length, offset: Vector2::zeros(), axes: vec![tilt(b'B', along)] }
    }

    /// Returns a head with an axis across the rail and one along it.
    #[must_use]
    pub fn two_axes(pivot_length: f64, across: Axis, along: Axis) -> Self {
        let axes = vec![tilt(b'A', across), tilt(b'B', along)];
        Self { pivot_length, offset: Vector2::zeros(), axes }
    }

    fn is_two_axis(&self) -> bool {
        self.axes.len() == 2
    }

    pub(super) fn stance(
        &self,
        pose: &Pose,
        near: BedTurn,
        alignment: &Alignment,
    ) -> Result<Reached, Unreachable> {
        if self.is_two_axis() {
            return self.over_pivot(pose, near, alignment);
        }
        self.over_tip(pose, near, alignment)
    }

    /// Two axes: the pivot is brought to its place.
    fn over_pivot(
        &self,
        pose: &Pose,
        near: BedTurn,
        alignment: &Alignment,
    ) -> Result<Reached, Unreachable> {
        let length = self.pivot_length;
        let bed = alignment.over_bed(&pose.at.xy());
        let mut base = alignment.joints_over_bed(&bed, pose.at.z, Branch::Near, near)?;
        let mut tilts = (0.0, 0.0);
        for _ in 0..MOST_PASSES {
            let azimuth = alignment.bed.azimuth(base.turn);
            let axis = over_rail(&pose.axis, azimuth, alignment);
            tilts = ((-axis.y).asin(), axis.x.atan2(axis.z));
            let to_tip = self.to_tip(tilts.0, tilts.1);
            let pivot = bed - Rotation2::new(azimuth) * to_tip.xy();
            let lift = pose.at.z - to_tip.z - length;
            let next = alignment.joints_over_bed(&pivot, lift, Branch::Near, near)?;
            let change = next.turn.radians() - base.turn.radians();
            base = next;
            if change.abs() <= SETTLED * base.turn.radians().abs().max(1.0) {
                break;
            }
        }
        Ok(Reached { stance: Stance { base, head: head([tilts.0, tilts.1]) }, residual: 0.0 })
    }

    /// One axis: the bed stands as for the tip of an upright nozzle.
    fn over_tip(
        &self,
        pose: &Pose,
        near: BedTurn,
        alignment: &Alignment,
    ) -> Result<Reached, Unreachable> {
        let length = self.pivot_length;
        let bed = alignment.over_bed(&pose.at.xy());
        let mut lift = pose.at.z;
        // The lift leans, so where the rail passes the axis depends on the tilt, a little.
        for _ in 0..MOST_PASSES {
            let tip = alignment.joints_over_bed(&bed, lift, Branch::Near, near)?;
            let azimuth = alignment.bed.azimuth(tip.turn);
            let axis = over_rail(&pose.axis, azimuth, alignment);
            let along = axis.x.atan2(axis.z);
            let next = pose.at.z + length * (along.cos() - 1.0);
            let settled =
                (next - lift).abs() * (alignment.a1.abs() + alignment.b1.abs()) <= SETTLED;
            lift = next;
            if settled {
                let base = Joints { s: tip.s + length * along.sin(), z: lift, ..tip };
                let stance = Stance { base, head: head([along, 0.0]) };
                return Ok(Reached { stance, residual: axis.y.abs().asin() });
            }
        }
        Err(Unreachable::Head { what: "tilt", value: 0.0, limit: 0.0, unit: "" })
    }

    /// From where an upright nozzle would have its tip, at the height of the pivot, to the tip, as the
    /// machine sees it.
    fn to_tip(&self, across: f64, along: f64) -> Vector3<f64> {
        let beside = Vector3::new(self.offset.x, self.offset.y, 0.0);
        tilted(across, along) * (beside - Vector3::z() * self.pivot_length) - beside
    }

    pub(super) fn pose(&self, stance: &Stance, alignment: &Alignment) -> Pose {
        let (across, along) = if self.is_two_axis() {
            (stance.head[0], stance.head[1])
        } else {
            (0.0, stance.head[0])
        };
        let to_tip = self.to_tip(across, along);
        let azimuth = alignment.bed.azimuth(stance.base.turn);
        let tip = alignment.nozzle(&stance.base) + to_tip.xy();
        let place = alignment.part_from_bed(&(Rotation2::new(azimuth) * tip));
        let z = stance.base.z + self.pivot_length + to_tip.z;
        let axis = tilted(across, along) * Vector3::z();
        Pose { at: Point3::new(place.x, place.y, z), axis: in_part(&axis, azimuth, alignment) }
    }
}

/// Returns by how much the pivot is farther from the tip than it is taken to be, mm: with the tip told to
/// stay at a fixed point at `tilt` and at `-tilt` (radians), it is found `apart` farther inwards at the
/// former.
#[must_use]
pub fn pivot_error(apart: f64, tilt: f64) -> f64 {
    apart / (2.0 * tilt.sin())
}

fn head(tilts: [f64; 2]) -> [f64; HEAD_AXES] {
    let mut all = [0.0; HEAD_AXES];
    all[..2].copy_from_slice(&tilts);
    all
}

pub(crate) fn tilted(across: f64, along: f64) -> Rotation3<f64> {
    let about = |axis: UnitVector3<f64>, angle: f64| Rotation3::from_axis_angle(&axis, angle);
    about(Vector3::y_axis(), along) * about(Vector3::x_axis(), across)
}

fn tilt(letter: u8, axis: Axis) -> HeadAxis {
    let name = if letter == b'A' { "tilt A" } else { "tilt B" };
    HeadAxis { letter, name, is_angle: true, axis }
}

#[cfg(test)]
mod tests {
    use super::super::Head;
    use super::*;
    use crate::kinematics::BedScale;
    use std::f64::consts::FRAC_PI_2;

    const ANY: Axis = Axis { min: -FRAC_PI_2, max: FRAC_PI_2, speed: 1.0, acceleration: 10.0 };

    const LEANING: Alignment = Alignment {
        a: 0.2,
        b: 0.35,
        a1: 0.0015,
        b1: -0.002,
        plate_offset: Vector2::new(0.3, -0.4),
        plate_angle: 0.05,
        bed: BedScale { zero: 0.7, is_reversed: true, backlash: 0.0 },
    };

    fn pose(k: u32) -> Pose {
        let t = f64::from(k);
        let (radius, azimuth) = (45.0 + 60.0 * (t * 0.618).fract(), t * 2.4);
        let (tilt, way) = (0.7 * (t * 0.37).fract(), t * 0.9);
        let at =
            Point3::new(radius * azimuth.cos(), radius * azimuth.sin(), (t * 0.23).fract() * 90.0);
        let axis = Vector3::new(tilt.sin() * way.cos(), tilt.sin() * way.sin(), tilt.cos());
        Pose { at, axis: UnitVector3::new_normalize(axis) }
    }

    #[test]
    fn two_axes_follow_any_direction() {
        for offset in [Vector2::zeros(), Vector2::new(1.5, -0.8)] {
            let head = Head::Tilting(Tilting { offset, ..Tilting::two_axes(43.0, ANY, ANY) });
            for k in 0..5000 {
                let wanted = pose(k);
                let near = BedTurn::accumulated(f64::from(k % 90));
                let reached = head.stance(&wanted, near, &LEANING).unwrap();
                let back = head.pose(&reached.stance, &wanted, &LEANING).unwrap();
                assert!((back.at - wanted.at).norm() < 1e-11, "{k}: {}", back.at - wanted.at);
                assert!((back.axis.into_inner() - wanted.axis.into_inner()).norm() < 1e-13);
            }
        }
    }

    #[test]
    fn one_axis_reaches_the_place_and_tells_what_of_the_direction_it_misses() {
        let head = Head::Tilting(Tilting::one_axis(43.0, ANY));
        for k in 0..5000 {
            let wanted = pose(k);
            let reached = head.stance(&wanted, BedTurn::default(), &LEANING).unwrap();
            let back = head.pose(&reached.stance, &wanted, &LEANING).unwrap();
            assert!((back.at - wanted.at).norm() < 1e-11, "{k}: {}", back.at - wanted.at);
            let angle = back.axis.cross(&wanted.axis).norm().asin();
            assert!((angle - reached.residual).abs() < 1e-9, "{k}: {angle} {}", reached.residual);
        }
    }

    #[test]
    fn one_axis_is_exact_for_surfaces_of_revolution() {
        let head = Head::Tilting(Tilting::one_axis(43.0, ANY));
        let ideal = Alignment::default();
        for k in 0..500 {
            let at = pose(k).at;
            let slope = f64::from(k) * 0.002;
            let out = at.coords.xy().normalize() * slope.sin();
            let axis = UnitVector3::new_normalize(Vector3::new(out.x, out.y, slope.cos()));
            let reached = head.stance(&Pose { at, axis }, BedTurn::default(), &ideal).unwrap();
            assert!(reached.residual < 1e-12);
            assert!((reached.stance.head[0] - slope).abs() < 1e-12);
        }
    }

    #[test]
    fn upright_it_is_the_ordinary_printer() {
        for head in [Tilting::one_axis(43.0, ANY), Tilting::two_axes(43.0, ANY, ANY)] {
            let at = Point3::new(20.0, -31.0, 7.5);
            let near = BedTurn::accumulated(11.0);
            let reached = head.stance(&Pose::upright(at), near, &LEANING).unwrap();
            let plain = LEANING.joints_from_part(&at, Branch::Near, near).unwrap();
            let apart = |a: f64, b: f64| (a - b).abs();
            assert!(apart(reached.stance.base.s, plain.s) < 1e-12);
            assert!(apart(reached.stance.base.z, plain.z) < 1e-12);
            assert!(apart(reached.stance.base.turn.radians(), plain.turn.radians()) < 1e-12);
        }
    }

    #[test]
    fn a_pivot_that_is_not_where_it_is_taken_to_be_moves_the_tip() {
        // 0.1 mm at 30°: 50 µm sideways, 13 µm up.
        let taken = Head::Tilting(Tilting::one_axis(45.0, ANY));
        let real = Head::Tilting(Tilting::one_axis(45.1, ANY));
        let ideal = Alignment::default();
        let at = Point3::new(40.0, 0.0, 10.0);
        let axis = UnitVector3::new_normalize(Vector3::new(0.5, 0.0, 0.75_f64.sqrt()));
        let told = taken.stance(&Pose { at, axis }, BedTurn::default(), &ideal).unwrap().stance;
        let off = real.pose(&told, &Pose::upright(at), &ideal).unwrap().at - at;
        // Measured at both tilts, that is how much the length is off.
        let (inwards, tilt) = (-2.0 * off.x, std::f64::consts::FRAC_PI_6);
        assert!((pivot_error(inwards, tilt) - 0.1).abs() < 1e-12);
        assert!((off.x + 0.05).abs() < 1e-12, "{off}");
        assert!((off.z - 0.1 * (1.0 - 0.75_f64.sqrt())).abs() < 1e-12, "{off}");
    }
}
