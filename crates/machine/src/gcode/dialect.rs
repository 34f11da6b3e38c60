//! The words in which a firmware wants its moves.
//!
//! A [`Dialect`] is a value: two words for the plane, and in which coordinates the firmware draws
//! a straight line between two lines of the program. To add one, add a constant and list it in
//! [`ALL`].

use nalgebra::Point3;

use super::number::{quantum, value};
use crate::program::{BedTurn, Joints, Move};

/// In which coordinates a move between two lines of the program is straight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Space {
    /// The axes run together from end to end: a spiral piece over the part.
    Joints,
    /// The nozzle runs straight over the part.
    Part,
}

/// What a word stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// The carriage, mm.
    Rail,
    /// The accumulated turn of the bed, degrees.
    Bed,
    /// The x coordinate in the part, mm.
    PartX,
    /// The y coordinate in the part, mm.
    PartY,
}

/// One of the two words that say where in the plane a move ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Word {
    /// The letter.
    pub letter: u8,
    /// What its number means.
    pub quantity: Quantity,
}

/// How a firmware wants to be spoken to. See the [module](self).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dialect {
    /// What users call it.
    pub name: &'static str,
    /// In which coordinates its moves are straight.
    pub space: Space,
    /// The two words of the plane, always written together.
    pub plane: [Word; 2],
}

/// `R` and `T`: the firmware moves carriage and bed as it is told; `F` is the speed of the nozzle
/// over the part.
pub const POLAR: Dialect = Dialect {
    name: "polar",
    space: Space::Joints,
    plane: [
        Word { letter: b'R', quantity: Quantity::Rail },
        Word { letter: b'T', quantity: Quantity::Bed },
    ],
};

/// `X` and `Y` in the part: for viewers, and for printers that are not polar.
pub const CARTESIAN: Dialect = Dialect {
    name: "cartesian",
    space: Space::Part,
    plane: [
        Word { letter: b'X', quantity: Quantity::PartX },
        Word { letter: b'Y', quantity: Quantity::PartY },
    ],
};

/// All dialects, the default one first.
pub const ALL: [Dialect; 2] = [POLAR, CARTESIAN];

impl Dialect {
    /// Returns the dialect that users call `name`.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        ALL.into_iter().find(|dialect| dialect.name == name)
    }

    /// Returns the numbers of the plane's words for the end of a move.
    #[must_use]
    pub(super) fn plane_values(&self, to: &Joints, at: &Point3<f64>) -> [f64; 2] {
        self.plane.map(|word| match word.quantity {
            Quantity::Rail => to.s,
            Quantity::Bed => to.turn.radians().to_degrees(),
            Quantity::PartX => at.x,
            Quantity::PartY => at.y,
        })
    }

    /// Returns the joints that a position in this dialect's words stands for; `None` when the
    /// words are part coordinates.
    #[must_use]
    pub fn joints(&self, plane: [f64; 2], z: f64) -> Option<Joints> {
        match self.plane.map(|word| word.quantity) {
            [Quantity::Rail, Quantity::Bed] => {
                Some(Joints { s: plane[0], turn: BedTurn::accumulated(plane[1].to_radians()), z })
            }
            _ => None,
        }
    }

    /// Returns joints as a program in this dialect's words will say them.
    #[must_use]
    pub fn rounded_joints(&self, to: &Joints) -> Joints {
        let lengths = self.length_decimals(to.s.abs());
        let degrees = rounded(to.turn.radians().to_degrees(), DEGREE_DECIMALS);
        Joints {
            s: rounded(to.s, lengths),
            turn: BedTurn::accumulated(degrees.to_radians()),
            z: rounded(to.z, MM_DECIMALS),
        }
    }

    /// Returns a point of the part as a program in this dialect's words will say it.
    #[must_use]
    pub fn rounded_point(&self, at: &Point3<f64>) -> Point3<f64> {
        let lengths = self.length_decimals(at.xy().coords.norm());
        Point3::new(rounded(at.x, lengths), rounded(at.y, lengths), rounded(at.z, MM_DECIMALS))
    }

    /// Decimal places of the plane's words at the end of a move.
    pub(super) fn decimals(&self, step: &Move) -> [usize; 2] {
        let lengths = self.length_decimals(match self.space {
            Space::Joints => step.to.s.abs(),
            Space::Part => step.at.xy().coords.norm(),
        });
        self.plane
            .map(|word| if word.quantity == Quantity::Bed { DEGREE_DECIMALS } else { lengths })
    }

    /// Decimal places of lengths at this distance from the axis: near it a thousandth of a
    /// millimetre is a coarse angle.
    fn length_decimals(&self, from_axis: f64) -> usize {
        if from_axis < NEAR_AXIS_MM { NEAR_AXIS_DECIMALS } else { MM_DECIMALS }
    }
}

fn rounded(number: f64, decimals: usize) -> f64 {
    value(quantum(number, decimals), decimals)
}

/// Decimal places of lengths: 1 µm.
pub(super) const MM_DECIMALS: usize = 3;

/// Within this distance of the axis lengths have [`NEAR_AXIS_DECIMALS`] places.
const NEAR_AXIS_MM: f64 = 2.0;

/// Decimal places of lengths near the axis: 10 nm, the grid of planar regions.
pub(super) const NEAR_AXIS_DECIMALS: usize = 5;

/// Decimal places of angles: 0.0001° is 0.2 µm at the rim of a bed of 120 mm.
pub(super) const DEGREE_DECIMALS: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_again() {
        for dialect in ALL {
            assert_eq!(Dialect::by_name(dialect.name), Some(dialect));
        }
        assert_eq!(Dialect::by_name("marlin"), None);
    }
}
