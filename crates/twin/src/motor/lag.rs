//! How far the bed lags behind its pulses while it changes its speed.
//!
//! To give the bed an acceleration `α` its motor must turn `g` times as fast and bring up
//! `(J_motor + J_bed/g²)·g·α`; it does so only from a load angle behind (see the
//! [module](super)), which is `1/g` of it at the bed and `r` times that at the nozzle. Acceleration is
//! that between neighbouring lines, less what [rounding](crate::rounding) explains. What the rotor swings
//! beyond the load angle is not counted.

use super::Motor;
use crate::rounding::Doubt;
use crate::segment::Segment;
use machine::program::Role;

/// What turns the bed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BedDrive {
    /// The motor.
    pub motor: Motor,
    /// Amplitude of its currents, A.
    pub current: f64,
    /// Its turns in a turn of the bed.
    pub gear_ratio: f64,
    /// Of bed and part about the axis, kg·m².
    pub inertia: f64,
}

impl BedDrive {
    /// Returns the torque that the motor must bring up for an acceleration of the bed (rad/s²), N·m.
    #[must_use]
    pub fn torque(&self, acceleration: f64) -> f64 {
        let gear = self.gear_ratio;
        (self.motor.inertia + self.inertia / (gear * gear)) * gear * acceleration
    }

    /// Returns how far the bed lags at an acceleration (rad/s²), radians; `None` when the motor cannot
    /// bring it up.
    #[must_use]
    pub fn lag(&self, acceleration: f64) -> Option<f64> {
        let angle = self.motor.load_angle(self.torque(acceleration), self.current)?;
        Some(angle / self.gear_ratio)
    }
}

/// Where it lags most.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Worst {
    /// Of the bed, radians.
    pub angle: f64,
    /// Of the nozzle over the bed, mm.
    pub distance: f64,
    /// The line.
    pub line: usize,
    /// Lines for which the motor is too weak.
    pub too_weak: usize,
}

/// Follows a program.
#[derive(Debug, Clone, Copy)]
pub struct Lag {
    drive: BedDrive,
    /// Speed of the line before, how far that may be off, and half its duration.
    last: (f64, f64, f64),
    worst: Worst,
}

impl Lag {
    /// Returns a bed at rest.
    #[must_use]
    pub fn new(drive: BedDrive) -> Self {
        Self { drive, last: (0.0, 0.0, 0.0), worst: Worst::default() }
    }

    /// The program goes on.
    pub fn add(&mut self, segment: &Segment) {
        if segment.duration <= 0.0 {
            return;
        }
        let doubt = Doubt::of(segment);
        let change = segment.bed_change();
        let last_place = if segment.path > 0.0 { doubt.turn } else { 0.0 };
        let half = segment.duration / 2.0;
        let now =
            (change / segment.duration, doubt.of_speed(change, last_place, segment.duration), half);
        let before = std::mem::replace(&mut self.last, now);
        let change = ((now.0 - before.0).abs() - now.1 - before.1).max(0.0);
        let acceleration = change / (before.2 + half);
        // Where nothing is laid, nothing is misplaced; but the motor must keep up.
        let Some(angle) = self.drive.lag(acceleration) else {
            self.worst.too_weak += 1;
            return;
        };
        let distance = angle * segment.curve.radius(0.0);
        let lays = segment.extrudes() && segment.role != Role::Custom;
        if lays && distance > self.worst.distance {
            (self.worst.angle, self.worst.distance) = (angle, distance);
            self.worst.line = segment.line;
        }
    }

    /// Returns where it lagged most while material was laid.
    #[must_use]
    pub fn worst(&self) -> Worst {
        self.worst
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::polar_segment;

    const DRIVE: BedDrive =
        BedDrive { motor: Motor::NEMA_17, current: 2.5, gear_ratio: 5.0, inertia: 4e-3 };

    #[test]
    fn the_lag_is_that_of_the_torque() {
        // (5.4e-6 + 4e-3/25)·5·50 = 0.04135 N·m of 0.415.
        let lag = DRIVE.lag(50.0).unwrap();
        assert!((DRIVE.torque(50.0) - 0.041_35).abs() < 1e-9);
        assert!((lag - (0.041_35_f64 / 0.415).asin() / 250.0).abs() < 1e-12);
        assert_eq!(DRIVE.lag(1000.0), None);
    }

    #[test]
    fn a_bed_that_speeds_up_lags_and_one_at_speed_does_not() {
        let mut lag = Lag::new(DRIVE);
        // 40 mm out; lines of 50 ms at 0, 2, 4, 4, 4 rad/s.
        let mut turn = 0.0;
        for (line, speed) in [(1, 2.0), (2, 4.0), (3, 4.0), (4, 4.0)] {
            let to: f64 = turn + speed * 0.05;
            let mut segment = polar_segment([40.0, turn], [40.0, to], 40.0 * speed);
            (segment.line, segment.filament) = (line, 0.1);
            lag.add(&segment);
            turn = to;
        }
        let worst = lag.worst();
        // From rest within half a line: 80 rad/s².
        assert_eq!((worst.line, worst.too_weak), (1, 0));
        assert!((worst.angle / DRIVE.lag(80.0).unwrap() - 1.0).abs() < 1e-3, "{worst:?}");
        assert!((worst.distance - 40.0 * worst.angle).abs() < 1e-12);
    }
}
