//! From a place in the part to joint positions, and back.
//!
//! Frames, all right-handed, z up, mm: *Part* turns with the bed, its z axis is the axis of
//! rotation up to the plate's own misplacement; *Machine* does not turn, its origin is on the axis
//! of rotation, +x runs along the rail outwards.
//!
//! With the carriage at `s` the nozzle stands at Machine `(u, v)`, `u = s + a + a1·z`,
//! `v = b + b1·z`, and over the bed at `q = Rz(theta)·(u, v)`; the plate carries the part at
//! `q = e + Rz(psi)·p`. The inverse has two branches, the carriage on either side of the axis:
//! `u = ±√(|q|² − v²)`, `theta = atan2(u·qy − v·qx, u·qx + v·qy)`. On a perfect machine this is
//! the ordinary polar angle and radius.
//!
//! The bed's own count of its turn may begin elsewhere and run the other way ([`BedScale`]): in the
//! formulas above `theta = zero ± turn`.
//!
//! Derivation and identifiability of the constants: the calibration of a polar printer's centre,
//! where the rail misses the axis by `b`. A disc of radius `|v|` about the axis is out of reach of
//! the nozzle's centre.

use nalgebra::{Point2, Point3, Rotation2, Vector2};

use crate::program::{BedTurn, Joints};

/// How a real machine misses the ideal one. All zero by default.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Alignment {
    /// True minus commanded position along the rail, mm.
    pub a: f64,
    /// How far the rail misses the axis, mm, positive towards +y of Machine.
    pub b: f64,
    /// Lean of the lift along the rail, mm per mm of height.
    pub a1: f64,
    /// Lean of the lift across the rail, mm per mm of height.
    pub b1: f64,
    /// Where the plate's centre lies on the bed, mm.
    pub plate_offset: Vector2<f64>,
    /// How the plate is turned on the bed, radians.
    pub plate_angle: f64,
    /// How the bed counts its turn.
    pub bed: BedScale,
}

/// How the count of the bed's turn relates to where it stands.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BedScale {
    /// Azimuth of the rail seen from the bed where the count is zero, radians.
    pub zero: f64,
    /// Whether a growing count turns the bed counter-clockwise seen from above. A wrong value
    /// prints a mirror image.
    pub is_reversed: bool,
    /// Turn of the drive that does not reach the bed when the direction changes, radians; see
    /// [`Backlash`](crate::backlash::Backlash).
    pub backlash: f64,
}

impl BedScale {
    /// A count that begins at the rail and grows as the bed turns clockwise.
    pub const IDEAL: Self = Self { zero: 0.0, is_reversed: false, backlash: 0.0 };

    /// Returns the azimuth of the rail seen from the bed, radians, not wrapped.
    #[must_use]
    pub fn azimuth(&self, turn: BedTurn) -> f64 {
        self.zero + self.sign() * turn.radians()
    }

    /// Returns the count at which the rail has this azimuth, radians.
    #[must_use]
    pub fn turn(&self, azimuth: f64) -> f64 {
        self.sign() * (azimuth - self.zero)
    }

    fn sign(&self) -> f64 {
        if self.is_reversed { -1.0 } else { 1.0 }
    }
}

/// The side of the axis on which the carriage stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Branch {
    /// Where the rail's positive end is.
    Near,
    /// Beyond the axis.
    Far,
}

impl Branch {
    /// Returns +1 for the near side, −1 for the far side.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::Near => 1.0,
            Self::Far => -1.0,
        }
    }

    /// Returns the other side.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Near => Self::Far,
            Self::Far => Self::Near,
        }
    }
}

/// The machine cannot get to a place.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Unreachable {
    /// The nozzle cannot stand over a point of the bed.
    #[error(
        "the nozzle passes the rotation axis at {miss:.3} mm and cannot stand {radius:.3} mm from \
         it"
    )]
    Disc {
        /// Distance of the point from the axis, mm.
        radius: f64,
        /// Least distance that the nozzle can have, mm.
        miss: f64,
    },
    /// An axis ends before.
    #[error("the {axis} would have to go to {position:.3} mm, it reaches from {min} to {max} mm")]
    BeyondTravel {
        /// Its name.
        axis: &'static str,
        /// mm.
        position: f64,
        /// mm.
        min: f64,
        /// mm.
        max: f64,
    },
    /// A head that turns the nozzle cannot stand so.
    #[error("the {what} would be {value:.3}{unit}, the head allows {limit:.3}{unit}")]
    Head {
        /// What is beyond its bound.
        what: &'static str,
        /// In `unit`.
        value: f64,
        /// The bound.
        limit: f64,
        /// The unit, with what stands before it.
        unit: &'static str,
    },
    /// One line winds further round the axis than the wires of the bed allow.
    #[error("the bed would have to turn {turns:.1} times from home, its wires allow {most}")]
    WoundUp {
        /// Turns from home.
        turns: f64,
        /// The bound.
        most: f64,
    },
}

impl Alignment {
    /// The machine of the drawing.
    pub const IDEAL: Self = Self {
        a: 0.0,
        b: 0.0,
        a1: 0.0,
        b1: 0.0,
        plate_offset: Vector2::new(0.0, 0.0),
        plate_angle: 0.0,
        bed: BedScale::IDEAL,
    };

    /// Returns where in the part the nozzle stands.
    #[must_use]
    pub fn part_from_joints(&self, joints: &Joints) -> Point3<f64> {
        let part = self.part_from_bed(&self.over_bed_from_joints(joints));
        Point3::new(part.x, part.y, joints.z)
    }

    /// Returns the point of the bed, seen from the axis, over which the nozzle stands.
    #[must_use]
    pub fn over_bed_from_joints(&self, joints: &Joints) -> Vector2<f64> {
        Rotation2::new(self.bed.azimuth(joints.turn)) * self.nozzle(joints)
    }

    /// Returns the joints that bring the nozzle over `part`, with the bed turned as little as
    /// possible from `near`. On the axis itself the bed stays where it is.
    ///
    /// # Errors
    ///
    /// [`Unreachable::Disc`] inside the disc that the rail misses.
    pub fn joints_from_part(
        &self,
        part: &Point3<f64>,
        branch: Branch,
        near: BedTurn,
    ) -> Result<Joints, Unreachable> {
        self.joints_over_bed(&self.over_bed(&part.xy()), part.z, branch, near)
    }

    /// Like [`joints_from_part`](Self::joints_from_part), for a point of the bed seen from the axis.
    ///
    /// # Errors
    ///
    /// [`Unreachable::Disc`] inside the disc that the rail misses.
    pub fn joints_over_bed(
        &self,
        q: &Vector2<f64>,
        z: f64,
        branch: Branch,
        near: BedTurn,
    ) -> Result<Joints, Unreachable> {
        let v = self.miss(z);
        let square = q.norm_squared() - v * v;
        if square < 0.0 {
            return Err(Unreachable::Disc { radius: q.norm(), miss: v.abs() });
        }
        let u = branch.sign() * square.sqrt();
        let turn = if *q == Vector2::zeros() {
            near
        } else {
            near.nearest(self.bed.turn((u * q.y - v * q.x).atan2(u * q.x + v * q.y)))
        };
        Ok(Joints { s: u - self.a - self.a1 * z, turn, z })
    }

    /// Returns where the nozzle stands in Machine, mm.
    #[must_use]
    pub fn nozzle(&self, joints: &Joints) -> Vector2<f64> {
        Vector2::new(joints.s + self.a + self.a1 * joints.z, self.miss(joints.z))
    }

    /// Returns by how much the rail passes the axis at a height, mm, positive towards +y of
    /// Machine.
    #[must_use]
    pub fn miss(&self, z: f64) -> f64 {
        self.b + self.b1 * z
    }

    /// Returns how near to the axis the nozzle can be, anywhere up to `height`, while the carriage
    /// and the nozzle both keep `clearance` from the middle of the rail, mm.
    #[must_use]
    pub fn clear_radius(&self, clearance: f64, height: f64) -> f64 {
        let worst = |at_bed: f64, lean: f64| at_bed.abs().max((at_bed + lean * height).abs());
        (clearance + worst(self.a, self.a1)).hypot(worst(self.b, self.b1))
    }

    /// Like [`clear_radius`](Self::clear_radius), at one height `z`.
    #[must_use]
    pub fn clear_radius_at(&self, clearance: f64, z: f64) -> f64 {
        (clearance + (self.a + self.a1 * z).abs()).hypot(self.miss(z))
    }

    /// Returns the point of the bed, seen from the axis, on which a point of the part lies.
    #[must_use]
    pub fn over_bed(&self, part: &Point2<f64>) -> Vector2<f64> {
        self.plate_offset + turned(part.coords, self.plate_angle)
    }

    /// Returns the point of the part that lies on a point of the bed, seen from the axis.
    #[must_use]
    pub fn part_from_bed(&self, over_bed: &Vector2<f64>) -> Point2<f64> {
        Point2::from(turned(over_bed - self.plate_offset, -self.plate_angle))
    }
}

/// Turns a vector; most plates are straight, and a turn by nothing needs no sine.
fn turned(vector: Vector2<f64>, angle: f64) -> Vector2<f64> {
    if angle == 0.0 { vector } else { Rotation2::new(angle) * vector }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const LEANING: Alignment = Alignment {
        a: 0.2,
        b: 0.35,
        a1: 0.0015,
        b1: -0.002,
        plate_offset: Vector2::new(0.3, -0.4),
        plate_angle: 0.05,
        bed: BedScale { zero: 0.7, is_reversed: true, backlash: 0.0 },
    };

    #[test]
    fn an_ideal_machine_is_ordinary_polar() {
        let joints = Alignment::default()
            .joints_from_part(&Point3::new(-3.0, 4.0, 7.0), Branch::Near, BedTurn::default())
            .unwrap();
        assert!((joints.s - 5.0).abs() < 1e-15);
        assert!((joints.turn.radians() - 4.0_f64.atan2(-3.0)).abs() < 1e-15);
        assert_eq!(joints.z, 7.0);
    }

    #[test]
    fn forward_undoes_inverse_on_both_branches() {
        let mut worst: f64 = 0.0;
        for i in 0..20_000_u32 {
            let t = f64::from(i);
            let radius = 1.0 + 110.0 * (t * 0.618).fract();
            let angle = t * 2.4;
            let part =
                Point3::new(radius * angle.cos(), radius * angle.sin(), (t * 0.37).fract() * 150.0);
            let near = BedTurn::accumulated((t * 0.1).sin() * 400.0);
            for branch in [Branch::Near, Branch::Far] {
                let joints = LEANING.joints_from_part(&part, branch, near).unwrap();
                assert!((joints.turn.radians() - near.radians()).abs() <= PI + 1e-9);
                worst = worst.max((LEANING.part_from_joints(&joints) - part).norm());
            }
        }
        assert!(worst < 1e-12 * 200.0, "{worst}");
    }

    #[test]
    fn the_disc_that_the_rail_misses_is_out_of_reach() {
        let alignment = Alignment { b: 0.5, ..Alignment::default() };
        let inside = Point3::new(0.3, -0.2, 0.0);
        let error = alignment.joints_from_part(&inside, Branch::Near, BedTurn::default());
        assert!(matches!(error, Err(Unreachable::Disc { miss: 0.5, .. })), "{error:?}");
    }

    #[test]
    fn on_the_axis_the_bed_stays() {
        let near = BedTurn::accumulated(17.0);
        let joints = Alignment::default()
            .joints_from_part(&Point3::new(0.0, 0.0, 1.0), Branch::Far, near)
            .unwrap();
        assert_eq!((joints.s, joints.turn), (-0.0, near));
    }
}
