//! The pulses that make the motors run a program.
//!
//! A motor on an axis with a step of `l` stands at `n·l`. Over an interval it gets
//! `round(x₂/l) − round(x₁/l)` pulses, so that it is never more than `l/2` from where it should be, at
//! the end of the first interval or the last. (To round the differences `(x₂ − x₁)/l` themselves, as
//! the source does, lets the error grow with every interval.) How fast pulses come is set by the length
//! of the interval.
//!
//! [`count`] is one motor; [`program`] makes intervals of the lines of a program, [`table`] of a table of
//! prescribed points; [`csv`], [`binary`] and [`port`] are the files they are written to, and each says
//! what its format is; [`report`] is what all of them come to.
//!
//! Source: synthesis of the control of step drives for prescribed movements (Kyrgyz State Technical
//! University): `X(k+1) = X(k) + n·l`, control points, pulses by interval, parallel port.
//!
//! Axes R, theta, Z and E in this order; mm, and radians for theta, unless a file says degrees. Positions
//! of theta are those of the drive, before any play.

pub mod binary;
pub mod count;
pub mod csv;
pub mod port;
pub mod program;
pub mod report;
pub mod table;

use machine::drive::{Drives, Transmission};

/// Most axes that there are.
pub const MOST_AXES: usize = 4;

/// The axes of a machine as the motors see them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    /// Their names; the first of them only, where there are fewer than [`MOST_AXES`].
    pub names: &'static [&'static str],
    /// How far a pulse moves each, mm or radians; 1 for those that are not there.
    pub steps: [f64; MOST_AXES],
    /// Whether they turn.
    pub turns: [bool; MOST_AXES],
}

impl Axes {
    /// The axes of a polar printer with these drives.
    #[must_use]
    pub fn polar(drives: &Drives) -> Self {
        let drives = drives.in_order();
        Self {
            names: &["R", "theta", "Z", "E"],
            steps: drives.map(|drive| drive.step()),
            turns: drives.map(|drive| drive.transmission == Transmission::Shaft),
        }
    }

    /// The axes of a machine that is not polar, whose x and y run as the carriage does.
    #[must_use]
    pub fn cartesian(drives: &Drives) -> Self {
        let (rail, lift) = (drives.rail.step(), drives.lift.step());
        Self { names: &["X", "Y", "Z"], steps: [rail, rail, lift, 1.0], turns: [false; MOST_AXES] }
    }

    /// Returns a position or step of an axis in the unit of files: mm or degrees.
    #[must_use]
    pub fn in_unit(&self, axis: usize, value: f64) -> f64 {
        if self.turns[axis] { value.to_degrees() } else { value }
    }

    /// Returns what a pulse moves an axis by, in the unit of files, without the last of 16 digits, in
    /// which degrees made of radians are not whole; over 10⁹ pulses that is 10⁻⁶ of one.
    #[must_use]
    pub fn step_in_unit(&self, axis: usize) -> f64 {
        let step = self.in_unit(axis, self.steps[axis]);
        format!("{step:.14e}").parse().unwrap_or(step)
    }

    /// Returns the unit of an axis in files.
    #[must_use]
    pub fn unit(&self, axis: usize) -> &'static str {
        if self.turns[axis] { "deg" } else { "mm" }
    }
}

/// What happens between two points of a program: all axes run evenly from one place to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The line that commands it, counted from 1.
    pub line: usize,
    /// When it begins, s from the begin of the program.
    pub start: f64,
    /// How long it takes, s.
    pub duration: f64,
    /// Where the axes are to be when it begins.
    pub from: [f64; MOST_AXES],
    /// Where they are to be when it ends.
    pub to: [f64; MOST_AXES],
    /// Where the motors are when it begins, in pulses from zero.
    pub count: [i64; MOST_AXES],
    /// The pulses of each motor; negative for those backwards.
    pub pulses: [i64; MOST_AXES],
}

impl Interval {
    /// Returns how far a motor is from where it should be when the interval ends.
    #[must_use]
    pub fn error(&self, axes: &Axes, axis: usize) -> f64 {
        (self.count[axis] + self.pulses[axis]) as f64 * axes.steps[axis] - self.to[axis]
    }

    /// Returns the pulses a second that the axis asks for, regardless of how they are rounded; zero
    /// where the time is not known.
    #[must_use]
    pub fn rate(&self, axes: &Axes, axis: usize) -> f64 {
        let steps = (self.to[axis] - self.from[axis]).abs() / axes.steps[axis];
        if self.duration > 0.0 { steps / self.duration } else { 0.0 }
    }
}
