//! What a search needs of a machine.

use super::log::{Direction, Edge};

/// A machine with a sensor in the nozzle's place, above a bed with magnets.
///
/// Positions are those that the machine is told: carriage in mm, azimuth of the rail seen from the
/// bed in radians, accumulated. Every call returns when the motion has ended.
pub trait Rig {
    /// Drives the carriage to its end-stop and the bed to its zero.
    ///
    /// # Errors
    ///
    /// [`RigError`], here and below.
    fn home(&mut self) -> Result<(), RigError>;

    /// Drives the carriage.
    ///
    /// # Errors
    ///
    /// [`RigError`]
    fn carriage_to(&mut self, s: f64) -> Result<(), RigError>;

    /// Turns the bed.
    ///
    /// # Errors
    ///
    /// [`RigError`]
    fn turn_to(&mut self, theta: f64) -> Result<(), RigError>;

    /// Turns the bed at a steady speed towards `theta` until the digital sensor is on (or off).
    /// Returns where it switched; `None` when it did not on the whole way. A sensor that is in that
    /// state already counts as not switching.
    ///
    /// # Errors
    ///
    /// [`RigError`]
    fn turn_until(&mut self, is_on: bool, theta: f64) -> Result<Option<f64>, RigError>;

    /// Returns whether the digital sensor is on.
    ///
    /// # Errors
    ///
    /// [`RigError`]
    fn is_on(&mut self) -> Result<bool, RigError>;

    /// Returns the reading of the analogue sensor.
    ///
    /// # Errors
    ///
    /// [`RigError`]
    fn level(&mut self) -> Result<f64, RigError>;

    /// Brings the machine to rest where nothing is in the way of the magnets.
    ///
    /// # Errors
    ///
    /// [`RigError`]
    fn park(&mut self) -> Result<(), RigError>;
}

/// Why a machine did not do what it was told.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RigError {
    /// Someone asked to stop.
    #[error("stopped on request")]
    Stopped,
    /// There is no answer.
    #[error("the printer did not answer {0:?} in time")]
    Silent(String),
    /// The line is dead.
    #[error("the printer is gone: {0}")]
    Gone(String),
    /// The answer is none.
    #[error("the printer answered {0:?} with {1:?}")]
    Garbled(String, String),
    /// The printer says that it cannot.
    #[error("the printer refused {0:?}: {1}")]
    Refused(String, String),
}

/// Turns the bed from where it stands to `theta` and returns all that the sensor saw on the way.
///
/// # Errors
///
/// [`RigError`]
pub fn sweep(rig: &mut dyn Rig, s: f64, from: f64, theta: f64) -> Result<Vec<Edge>, RigError> {
    let direction = if theta > from { Direction::Clockwise } else { Direction::CounterClockwise };
    let mut edges = Vec::new();
    // Over a magnet the first edge has no other to go with.
    if rig.is_on()? && rig.turn_until(false, theta)?.is_none() {
        return Ok(edges);
    }
    while let Some(on) = rig.turn_until(true, theta)? {
        let Some(off) = rig.turn_until(false, theta)? else { break };
        edges.push(Edge { s, theta: on, is_on: true, direction });
        edges.push(Edge { s, theta: off, is_on: false, direction });
    }
    Ok(edges)
}
