//! Finding the centre: the machine's own misalignment out of what a sensor sees of magnets.
//!
//! Magnets stand on the bed, a Hall sensor rides on the carriage in the nozzle's place. Each time
//! the sensor passes over a magnet the joints are known: a [`Sighting`]. From sightings follow where
//! the carriage really stands on the rail (`a`), by how much the rail misses the axis of rotation
//! (`b`) and where the ring of magnets, the plate, lies on the bed (`ex`, `ey`, `psi`).
//!
//! 1. [`log`] reads what was seen: located magnets, readings, or switchings of a sensor.
//! 2. [`peaks`] finds the middle of a magnet's field in one scan, [`detect`] the magnets in a log.
//! 3. [`pairing`] finds the magnets that were seen from both sides of the axis. They give `a` and
//!    `b` in closed form, independent of where they stand.
//! 4. [`ring`] finds the ring by consensus, in spite of missed, loose and alien magnets.
//! 5. [`joint`] says how well each number is known, and takes over where no magnet was seen twice.
//! 6. [`fit`] puts it together and says what the data do **not** determine: from one side of the
//!    axis alone a ring says nothing of `b`, however many magnets it has.
//!
//! [`scan`] does it all on a machine, through the small interface of [`rig`]; [`stepwise`] is the
//! source's own search, for comparison.
//!
//! The sensor does not sit exactly where the nozzle does. [`pins`] finds the nozzle's own centre from
//! a print. [`pivot`] finds the pivot of a head that tilts, from touches of one point.
//!
//! Frames, signs and the model are those of [`kinematics`](crate::kinematics). Lengths are mm,
//! angles radians. The source's own procedure, averages of the positions of a ring seen from one
//! side, finds the plate's eccentricity only.

pub mod detect;
pub mod fit;
pub mod joint;
pub mod known;
pub mod log;
pub mod pairing;
pub mod peaks;
pub mod pins;
pub mod pivot;
pub mod rig;
pub mod ring;
pub mod scan;
pub mod stepwise;

use nalgebra::Vector2;
use std::f64::consts::{PI, TAU};

use crate::kinematics::Alignment;
use crate::program::{BedTurn, Joints};

/// Where the joints stood when the sensor was over a magnet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// Carriage, mm; negative beyond the axis.
    pub s: f64,
    /// Azimuth of the rail seen from the bed, radians, any number of turns.
    pub theta: f64,
    /// Whether the magnet shows the other pole than most. False where the sensor cannot tell.
    pub is_reversed: bool,
}

impl Sighting {
    /// Returns a sighting of a magnet like the others.
    #[must_use]
    pub fn new(s: f64, theta: f64) -> Self {
        Self { s, theta, is_reversed: false }
    }

    /// Returns where on the bed the magnet lies on a machine with this rail, mm from the axis.
    #[must_use]
    pub fn over_bed(&self, a: f64, b: f64) -> Vector2<f64> {
        let alignment = Alignment { a, b, ..Alignment::IDEAL };
        let turn = BedTurn::accumulated(self.theta);
        let at = alignment.part_from_joints(&Joints { s: self.s, turn, z: 0.0 });
        at.xy().coords
    }
}

/// Returns the same angle within half a turn of 0.
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    let wrapped = angle - (angle / TAU).round() * TAU;
    wrapped.clamp(-PI, PI)
}
