//! The words of machines whose head turns the nozzle.
//!
//! | head | dialect `polar` | dialect `rrf-direct` |
//! | --- | --- | --- |
//! | one tilt | `R T Z B` | `X C Z B` |
//! | two tilts | `R T Z A B` | `X C Z A B` |
//! | six legs over a turning bed | `X Y Z U V W T` | `X Y Z U V W C` |
//! | six legs over a standing bed | `X Y Z U V W` | `X Y Z U V W` |
//!
//! Lengths have three decimals (five for a carriage within 2 mm of the axis), angles four. `F` means
//! what it means in the dialect. Other dialects leave the turning of words into joints to firmwares that
//! know of no tilt.

use super::dialect::{DEGREE_DECIMALS, Dialect, MM_DECIMALS, Quantity, Space};
use super::number::{quantum, value};
use crate::head::{Head, Stance};
use crate::program::BedTurn;

/// What a word of such a machine stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drive {
    /// The carriage, mm.
    Carriage,
    /// The bed, degrees.
    Bed,
    /// The lift, mm.
    Lift,
    /// An axis of the head by its number: a leg in mm.
    Leg(usize),
    /// An axis of the head by its number: a tilt in degrees.
    Tilt(usize),
}

/// A word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PosedWord {
    /// The letter.
    pub letter: u8,
    /// What its number means.
    pub drive: Drive,
}

/// Most words that say where such a machine stands.
pub const MOST_WORDS: usize = 7;

impl Dialect {
    /// Returns whether programs for machines with such heads can be written in this dialect.
    #[must_use]
    pub fn speaks_of_heads(&self) -> bool {
        self.space == Space::Joints
    }

    /// Returns the words of a machine with this head, in the order in which they are written.
    #[must_use]
    pub fn posed_words(&self, head: &Head) -> Vec<PosedWord> {
        let plane = |quantity: Quantity, drive: Drive| {
            let word = self.plane.iter().find(|word| word.quantity == quantity);
            word.map(|word| PosedWord { letter: word.letter, drive })
        };
        let bed = plane(Quantity::Bed, Drive::Bed).filter(|_| head.turns_bed());
        let own = head.axes().iter().enumerate().map(|(k, axis)| PosedWord {
            letter: axis.letter,
            drive: if axis.is_angle { Drive::Tilt(k) } else { Drive::Leg(k) },
        });
        if head.has_carriage() {
            let lift = PosedWord { letter: b'Z', drive: Drive::Lift };
            let carriage = plane(Quantity::Rail, Drive::Carriage);
            return carriage.into_iter().chain(bed).chain([lift]).chain(own).collect();
        }
        own.chain(bed).collect()
    }

    /// Returns a stance as a program in this dialect's words will say it.
    #[must_use]
    pub fn rounded_stance(&self, stance: &Stance, head: &Head) -> Stance {
        let mut rounded = *stance;
        if head.has_carriage() || head.turns_bed() {
            rounded.base = self.rounded_joints(&stance.base);
        }
        for (axis, value) in head.axes().iter().zip(&mut rounded.head) {
            let drive = if axis.is_angle { Drive::Tilt(0) } else { Drive::Leg(0) };
            let scale = if axis.is_angle { 1_f64.to_radians() } else { 1.0 };
            *value =
                self::value(quantum(*value / scale, drive.decimals()), drive.decimals()) * scale;
        }
        rounded
    }
}

impl Drive {
    /// Decimal places, but of a carriage near the axis.
    pub(super) fn decimals(self) -> usize {
        match self {
            Self::Carriage | Self::Lift | Self::Leg(_) => MM_DECIMALS,
            Self::Bed | Self::Tilt(_) => DEGREE_DECIMALS,
        }
    }

    /// Returns the number that a word has in a stance.
    #[must_use]
    pub fn number(self, stance: &Stance) -> f64 {
        match self {
            Self::Carriage => stance.base.s,
            Self::Bed => stance.base.turn.radians().to_degrees(),
            Self::Lift => stance.base.z,
            Self::Leg(k) => stance.head[k],
            Self::Tilt(k) => stance.head[k].to_degrees(),
        }
    }

    /// Sets in a stance what a word's number says.
    pub fn set(self, stance: &mut Stance, number: f64) {
        match self {
            Self::Carriage => stance.base.s = number,
            Self::Bed => stance.base.turn = BedTurn::accumulated(number.to_radians()),
            Self::Lift => stance.base.z = number,
            Self::Leg(k) => stance.head[k] = number,
            Self::Tilt(k) => stance.head[k] = number.to_radians(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::dialect::{KLIPPER_POLAR, POLAR, RRF_DIRECT};
    use super::*;
    use crate::head::hexapod::{Hexapod, JointLimits, Layout};
    use crate::head::tilting::Tilting;
    use crate::profile::Axis;
    use crate::program::Joints;
    use nalgebra::Vector3;

    const AXIS: Axis = Axis { min: -1.0, max: 400.0, speed: 1.0, acceleration: 1.0 };

    fn hexapod(turns_bed: bool) -> Head {
        let layout = Layout {
            base_radius: 150.0,
            platform_radius: 100.0,
            base_half_angle: 0.2,
            platform_half_angle: 0.0,
        };
        let home = Vector3::new(0.0, 0.0, 100.0);
        let joints = JointLimits { cone: 1.0, home, apart: 1.0, condition: 20.0, tilt: 0.7 };
        Head::Hexapod(Box::new(Hexapod {
            turns_bed,
            ..Hexapod::new(layout.joints(), 45.0, AXIS, joints)
        }))
    }

    #[test]
    fn every_head_has_its_words() {
        let letters = |dialect: Dialect, head: &Head| -> String {
            dialect.posed_words(head).iter().map(|word| char::from(word.letter)).collect()
        };
        let one = Head::Tilting(Tilting::one_axis(43.0, AXIS));
        let two = Head::Tilting(Tilting::two_axes(43.0, AXIS, AXIS));
        assert_eq!(
            (letters(POLAR, &one), letters(RRF_DIRECT, &one)),
            ("RTZB".into(), "XCZB".into())
        );
        assert_eq!(letters(RRF_DIRECT, &two), "XCZAB");
        assert_eq!(letters(RRF_DIRECT, &hexapod(true)), "XYZUVWC");
        assert_eq!(letters(POLAR, &hexapod(true)), "XYZUVWT");
        assert_eq!(letters(POLAR, &hexapod(false)), "XYZUVW");
        assert!(!KLIPPER_POLAR.speaks_of_heads());
    }

    #[test]
    fn a_stance_said_in_words_is_the_rounded_one() {
        let two = Head::Tilting(Tilting::two_axes(43.0, AXIS, AXIS));
        let base = Joints { s: 33.123_456, turn: BedTurn::accumulated(7.654_321), z: 5.432_19 };
        for (head, own) in [(two, 0.123_456_789), (hexapod(true), 123.456_789)] {
            let count = head.axes().len();
            let stance = Stance {
                base: if head.has_carriage() { base } else { Joints { s: 0.0, z: 0.0, ..base } },
                head: std::array::from_fn(|k| if k < count { own + k as f64 / 90.0 } else { 0.0 }),
            };
            let rounded = POLAR.rounded_stance(&stance, &head);
            let mut read = Stance { base: Joints { s: 0.0, z: 0.0, ..base }, head: [0.0; 6] };
            for word in POLAR.posed_words(&head) {
                let places = word.drive.decimals();
                word.drive
                    .set(&mut read, value(quantum(word.drive.number(&stance), places), places));
            }
            assert_eq!(read, rounded);
            assert_ne!(stance, rounded);
        }
    }
}
