//! What turns the pulses of a stepper driver into motion: motor, microsteps, gear, and belt, screw
//! or pinion.
//!
//! A pulse turns the motor by `360° / (full steps · microsteps)`, the shaft behind the gear by that
//! over the ratio, and moves the axis by the [`Transmission`]'s travel for a turn. mm; radians where the
//! axis is the bed.

use std::f64::consts::TAU;

/// The drive of one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Full steps in a turn of the motor.
    pub motor_steps: u32,
    /// Pulses in a full step.
    pub microsteps: u32,
    /// Turns of the motor in a turn of the shaft.
    pub gear_ratio: f64,
    /// What the shaft moves.
    pub transmission: Transmission,
}

/// How a turning shaft moves its axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Transmission {
    /// A toothed pulley on a belt.
    Belt {
        /// Teeth of the pulley.
        teeth: f64,
        /// Distance between teeth, mm.
        pitch: f64,
    },
    /// A screw.
    Screw {
        /// Travel in a turn, mm.
        lead: f64,
    },
    /// A pinion on a rack, or a wheel on filament.
    Pinion {
        /// To where it grips, mm.
        radius: f64,
    },
    /// Not taken apart: what was measured.
    Measured {
        /// Travel in a full step of the motor, mm.
        per_step: f64,
    },
    /// The shaft is the axis, which turns.
    Shaft,
}

/// The drives of a polar printer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drives {
    /// Of the carriage.
    pub rail: Drive,
    /// Of the bed.
    pub bed: Drive,
    /// Of the lift.
    pub lift: Drive,
    /// Of the filament.
    pub filament: Drive,
}

impl Drive {
    /// Returns how far a pulse moves the axis, mm; radians for a [shaft](Transmission::Shaft).
    #[must_use]
    pub fn step(&self) -> f64 {
        let travel = match self.transmission {
            Transmission::Belt { teeth, pitch } => teeth * pitch,
            Transmission::Screw { lead } => lead,
            Transmission::Pinion { radius } => TAU * radius,
            Transmission::Measured { per_step } => per_step * f64::from(self.motor_steps),
            Transmission::Shaft => TAU,
        };
        travel / (f64::from(self.motor_steps) * f64::from(self.microsteps) * self.gear_ratio)
    }

    /// Returns the same drive with another number of microsteps.
    #[must_use]
    pub fn with_microsteps(self, microsteps: u32) -> Self {
        Self { microsteps, ..self }
    }
}

impl Drives {
    /// The drives in the order R, theta, Z, E.
    #[must_use]
    pub fn in_order(&self) -> [Drive; 4] {
        [self.rail, self.bed, self.lift, self.filament]
    }

    /// Returns the same drives with other numbers of microsteps.
    #[must_use]
    pub fn with_microsteps(self, microsteps: u32) -> Self {
        Self {
            rail: self.rail.with_microsteps(microsteps),
            bed: self.bed.with_microsteps(microsteps),
            lift: self.lift.with_microsteps(microsteps),
            filament: self.filament.with_microsteps(microsteps),
        }
    }
}

impl Transmission {
    /// How a transmission is written.
    pub const WANTED: &'static str =
        "\"belt TEETHxPITCH\", \"screw LEAD\", \"pinion RADIUS\" or \"step TRAVEL\", lengths in mm";

    /// Reads a transmission as settings have it, such as `belt 20x2` or `screw 8`; `None` when it
    /// is none, or does not move.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let length = |text: &str| {
            let text = text.trim();
            text.parse::<f64>().ok().filter(|mm| mm.is_finite() && *mm > 0.0 && *mm <= MOST_MM)
        };
        let (kind, rest) = text.trim().split_once(' ')?;
        match kind {
            "belt" => {
                let (teeth, pitch) = rest.split_once('x')?;
                Some(Self::Belt { teeth: length(teeth)?, pitch: length(pitch)? })
            }
            "screw" => Some(Self::Screw { lead: length(rest)? }),
            "pinion" => Some(Self::Pinion { radius: length(rest)? }),
            "step" => Some(Self::Measured { per_step: length(rest)? }),
            _ => None,
        }
    }
}

/// No wheel, lead or step is larger, mm.
const MOST_MM: f64 = 1000.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(transmission: Transmission, microsteps: u32, gear_ratio: f64) -> Drive {
        Drive { motor_steps: 200, microsteps, gear_ratio, transmission }
    }

    #[test]
    fn steps_of_common_drives() {
        let belt = Transmission::parse("belt 20x2").unwrap();
        assert_eq!(drive(belt, 16, 1.0).step(), 0.0125);
        let screw = Transmission::parse("screw 8").unwrap();
        assert_eq!(drive(screw, 16, 1.0).step(), 0.0025);
        let bed = drive(Transmission::Shaft, 16, 5.0).step().to_degrees();
        assert!((bed - 0.0225).abs() < 1e-15);
        // A wheel of 11 mm with a gear of 3:1.
        let wheel = Transmission::parse("pinion 5.5").unwrap();
        assert!((drive(wheel, 16, 3.0).step() - TAU * 5.5 / 9600.0).abs() < 1e-15);
        let measured = Transmission::parse("step 1.6").unwrap();
        assert_eq!(drive(measured, 1, 1.0).step(), 1.6);
        assert_eq!(drive(measured, 1, 1.0).with_microsteps(2).step(), 0.8);
    }

    #[test]
    fn what_is_no_transmission() {
        for text in [
            "",
            "belt",
            "belt 20",
            "belt 20x",
            "belt 0x2",
            "screw",
            "screw -8",
            "rope 3",
            "pinion nan",
            "screw 8 mm",
            "step 1e9",
        ] {
            assert_eq!(Transmission::parse(text), None, "{text}");
        }
    }
}
