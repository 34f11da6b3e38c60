//! Heads that turn the nozzle: from a place and a direction to what the drives are told, and back.
//!
//! A [`Pose`] is where the tip of the nozzle is in the part and the unit vector along the nozzle's
//! axis, from the tip up to the point it is turned about. A [`Stance`] is what the drives stand at:
//! carriage, bed and lift as on any polar printer, and besides them tilts (radians) or legs (mm).
//!
//! Frames as in [`kinematics`](crate::kinematics), whose misalignment holds here too. With all
//! tilts at zero a tilting head is the ordinary printer: the lift counts from where the tip of an
//! upright nozzle touches the bed, the point it is turned about stands one pivot length above.
//!
//! Sources: own derivation for the tilting heads (the ordinary polar inverse, applied to the pivot);
//! V. E. Gough, S. G. Whitehall, Universal tyre test machine, 1962, and D. Stewart, A platform with
//! six degrees of freedom, 1965, for the [`hexapod`].

pub mod hexapod;
pub mod tilting;

use nalgebra::{Matrix3, Point3, Rotation2, Rotation3, UnitVector3, Vector3};

use crate::kinematics::{Alignment, Unreachable};
use crate::profile::Axis;
use crate::program::{BedTurn, Joints};
use hexapod::Hexapod;
use tilting::Tilting;

/// Most axes that a head has of its own.
pub const HEAD_AXES: usize = 6;

/// Where the tip of the nozzle is, and how the nozzle stands. Part frame, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The tip.
    pub at: Point3<f64>,
    /// From the tip up along the nozzle.
    pub axis: UnitVector3<f64>,
}

impl Pose {
    /// Returns the pose of an upright nozzle.
    #[must_use]
    pub fn upright(at: Point3<f64>) -> Self {
        Self { at, axis: Vector3::z_axis() }
    }
}

/// What the drives stand at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stance {
    /// Carriage, bed and lift, as far as the machine has them.
    pub base: Joints,
    /// The head's own axes, in the order of [`Head::axes`]; the rest is zero.
    pub head: [f64; HEAD_AXES],
}

/// A stance, and what it leaves to be wished.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reached {
    /// What the drives are told.
    pub stance: Stance,
    /// Angle between the nozzle and the direction wanted, radians. Zero where the machine can follow
    /// any direction.
    pub residual: f64,
}

/// One axis of a head: a tilt (radians) or a leg (mm).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadAxis {
    /// Its letter in programs.
    pub letter: u8,
    /// What it is called in messages.
    pub name: &'static str,
    /// Whether it is an angle: degrees in programs.
    pub is_angle: bool,
    /// Its range, speed and acceleration.
    pub axis: Axis,
}

/// What carries the nozzle where it can be turned.
#[derive(Debug, Clone, PartialEq)]
pub enum Head {
    /// On the carriage, with one or two axes that tilt it.
    Tilting(Tilting),
    /// On six legs.
    Hexapod(Box<Hexapod>),
}

impl Head {
    /// Returns the head's own axes.
    #[must_use]
    pub fn axes(&self) -> &[HeadAxis] {
        match self {
            Self::Tilting(head) => &head.axes,
            Self::Hexapod(head) => &head.axes,
        }
    }

    /// Returns from the tip of the nozzle to what it is turned about, mm.
    #[must_use]
    pub fn pivot_length(&self) -> f64 {
        match self {
            Self::Tilting(head) => head.pivot_length,
            Self::Hexapod(head) => head.pivot_length,
        }
    }

    /// Returns how far the nozzle may lean inwards (negative) and outwards, radians.
    #[must_use]
    pub fn tilts(&self) -> [f64; 2] {
        match self {
            Self::Tilting(head) => {
                head.axes.last().map_or([0.0; 2], |tilt| [tilt.axis.min, tilt.axis.max])
            }
            Self::Hexapod(head) => [-head.joints.tilt, head.joints.tilt],
        }
    }

    /// Returns whether carriage and lift are drives of their own.
    #[must_use]
    pub fn has_carriage(&self) -> bool {
        matches!(self, Self::Tilting(_))
    }

    /// Returns whether the bed turns.
    #[must_use]
    pub fn turns_bed(&self) -> bool {
        match self {
            Self::Tilting(_) => true,
            Self::Hexapod(head) => head.turns_bed,
        }
    }

    /// Returns the stance that brings the nozzle into a pose, or as near to its direction as the
    /// machine can, with the bed turned as little as possible from `near`.
    ///
    /// # Errors
    ///
    /// [`Unreachable`] where no position of the drives does, whatever their ranges.
    pub fn stance(
        &self,
        pose: &Pose,
        near: BedTurn,
        alignment: &Alignment,
    ) -> Result<Reached, Unreachable> {
        match self {
            Self::Tilting(head) => head.stance(pose, near, alignment),
            Self::Hexapod(head) => {
                head.stance(pose, near, alignment).map(|stance| Reached { stance, residual: 0.0 })
            }
        }
    }

    /// Returns the pose of a stance. Legs have several; it is that near `near`.
    ///
    /// # Errors
    ///
    /// [`Unreachable`] where legs of these lengths do not meet.
    pub fn pose(
        &self,
        stance: &Stance,
        near: &Pose,
        alignment: &Alignment,
    ) -> Result<Pose, Unreachable> {
        match self {
            Self::Tilting(head) => Ok(head.pose(stance, alignment)),
            Self::Hexapod(head) => head.pose(stance, near, alignment),
        }
    }

    /// Checks ranges of the head's axes and what else its joints allow.
    ///
    /// # Errors
    ///
    /// [`Unreachable`] with the first bound that is broken.
    pub fn check(
        &self,
        stance: &Stance,
        pose: &Pose,
        alignment: &Alignment,
    ) -> Result<(), Unreachable> {
        for (axis, &value) in self.axes().iter().zip(&stance.head) {
            let Axis { min, max, .. } = axis.axis;
            if value < min - SLACK || value > max + SLACK {
                let (scale, unit) =
                    if axis.is_angle { (180.0 / std::f64::consts::PI, "°") } else { (1.0, " mm") };
                let limit = if value < min { min } else { max };
                let what = axis.name;
                return Err(Unreachable::Head {
                    what,
                    value: value * scale,
                    limit: limit * scale,
                    unit,
                });
            }
        }
        match self {
            Self::Tilting(_) => Ok(()),
            Self::Hexapod(head) => head.check(stance, pose, alignment),
        }
    }

    /// Returns where the drives are when a share of the way is done: all run evenly.
    #[must_use]
    pub fn between(from: &Stance, to: &Stance, share: f64) -> Stance {
        let blend = |a: f64, b: f64| a + (b - a) * share;
        let turn = blend(from.base.turn.radians(), to.base.turn.radians());
        let base = Joints {
            s: blend(from.base.s, to.base.s),
            turn: BedTurn::accumulated(turn),
            z: blend(from.base.z, to.base.z),
        };
        Stance { base, head: std::array::from_fn(|k| blend(from.head[k], to.head[k])) }
    }
}

/// How far rounding may bring an axis beyond its end, mm or radians.
const SLACK: f64 = 5e-4;

/// Returns the shortest turn that brings the vertical to `axis`, which must not point straight down.
#[must_use]
pub fn shortest_turn(axis: &UnitVector3<f64>) -> Rotation3<f64> {
    let h = 1.0 / (1.0 + axis.z);
    let (x, y, z) = (axis.x, axis.y, axis.z);
    Rotation3::from_matrix_unchecked(Matrix3::new(
        1.0 - h * x * x,
        -h * x * y,
        x,
        -h * x * y,
        1.0 - h * y * y,
        y,
        -x,
        -y,
        z,
    ))
}

/// A direction of the part as the machine sees it, where the rail has this azimuth over the bed.
fn over_rail(axis: &Vector3<f64>, azimuth: f64, alignment: &Alignment) -> Vector3<f64> {
    turned(axis, alignment.plate_angle - azimuth)
}

/// The same back.
fn in_part(axis: &Vector3<f64>, azimuth: f64, alignment: &Alignment) -> UnitVector3<f64> {
    UnitVector3::new_normalize(turned(axis, azimuth - alignment.plate_angle))
}

fn turned(axis: &Vector3<f64>, angle: f64) -> Vector3<f64> {
    let xy = Rotation2::new(angle) * axis.xy();
    Vector3::new(xy.x, xy.y, axis.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_turn_brings_the_vertical_to_the_axis() {
        for (x, y, z) in [(0.0, 0.0, 1.0), (0.3, -0.4, 0.8), (0.9, 0.1, -0.2), (-0.1, 0.0, -0.99)] {
            let axis = UnitVector3::new_normalize(Vector3::new(x, y, z));
            let turn = shortest_turn(&axis);
            assert!((turn * Vector3::z() - axis.into_inner()).norm() < 1e-14);
            assert!((turn.matrix().determinant() - 1.0).abs() < 1e-13);
            // No twist: the turn is about a level line.
            assert!(turn.axis().is_none_or(|line| line.z.abs() < 1e-12));
        }
    }
}
