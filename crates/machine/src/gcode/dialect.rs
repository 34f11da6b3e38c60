//! The words in which a firmware wants its moves.
//!
//! A [`Dialect`] is a value: two words for the plane, and in which coordinates the firmware draws
//! a straight line between two lines of the program. To add one, add a constant and list it in
//! [`ALL`].

use nalgebra::Point3;

use super::label::LabelWords;
use super::marlin::Marlin;
use super::number::{decimal, quantum, value};
use super::speed_word::{SpeedWord, Way};
use crate::profile::Printer;
use crate::program::{BedTurn, Joints, Move};

/// In which coordinates a move between two lines of the program is straight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Space {
    /// The axes run together from end to end: a spiral piece over the part.
    Joints,
    /// The nozzle runs straight over the part.
    Part,
    /// The nozzle of an ideal polar printer would run straight: the firmware turns `x` and `y` into
    /// radius and angle itself. A real machine's misalignment is in the words, which are therefore
    /// not quite part coordinates.
    IdealPlane,
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
    /// The x coordinate of the carriage's place on an ideal machine, mm.
    IdealX,
    /// Its y coordinate, mm.
    IdealY,
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dialect {
    /// What users call it.
    pub name: &'static str,
    /// In which coordinates its moves are straight.
    pub space: Space,
    /// The two words of the plane, always written together.
    pub plane: [Word; 2],
    /// What `F` means.
    pub speed: SpeedWord,
    /// Turn of the bed, in degrees, beyond which the count begins again (`G92`) at the next layer:
    /// where the firmware keeps it in single precision, whose last place grows with it.
    pub recount_beyond: Option<f64>,
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
    speed: SpeedWord::Nozzle,
    recount_beyond: None,
};

/// `X` along the rail, `C` in degrees, every move with its time (`G93`): `RepRapFirmware`,
/// grblHAL and `LinuxCNC` with a rotary axis.
pub const RRF_DIRECT: Dialect = Dialect {
    name: "rrf-direct",
    space: Space::Joints,
    plane: [
        Word { letter: b'X', quantity: Quantity::Rail },
        Word { letter: b'C', quantity: Quantity::Bed },
    ],
    speed: SpeedWord::InverseTime,
    // The last place of a single-precision number is 0.002° from here on; 90 turns take longer
    // than a layer, so it never gets much worse.
    recount_beyond: Some(32_768.0),
};

/// Klipper with `kinematics: polar`.
pub const KLIPPER_POLAR: Dialect = ideal_plane("klipper-polar", SpeedWord::Words);

/// `RepRapFirmware` with `M669 K7`.
pub const RRF_POLAR: Dialect = ideal_plane("rrf-polar", SpeedWord::Words);

/// Marlin with `POLAR`.
pub const MARLIN_POLAR: Dialect =
    ideal_plane("marlin-polar", SpeedWord::MarlinPolar(Marlin::EXAMPLE));

/// grblHAL with `POLAR_ROBOT`.
pub const GRBLHAL_POLAR: Dialect = ideal_plane("grblhal-polar", SpeedWord::Words);

const fn ideal_plane(name: &'static str, speed: SpeedWord) -> Dialect {
    let plane = [
        Word { letter: b'X', quantity: Quantity::IdealX },
        Word { letter: b'Y', quantity: Quantity::IdealY },
    ];
    Dialect { name, space: Space::IdealPlane, plane, speed, recount_beyond: None }
}

/// `X` and `Y` in the part: for viewers, and for printers that are not polar.
pub const CARTESIAN: Dialect = Dialect {
    name: "cartesian",
    space: Space::Part,
    plane: [
        Word { letter: b'X', quantity: Quantity::PartX },
        Word { letter: b'Y', quantity: Quantity::PartY },
    ],
    speed: SpeedWord::Nozzle,
    recount_beyond: None,
};

/// All dialects, the default one first.
pub const ALL: [Dialect; 7] =
    [POLAR, RRF_DIRECT, KLIPPER_POLAR, RRF_POLAR, MARLIN_POLAR, GRBLHAL_POLAR, CARTESIAN];

impl Dialect {
    /// Returns the dialect that users call `name`.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        ALL.into_iter().find(|dialect| dialect.name == name)
    }

    /// Returns the dialect as a firmware that is set up for this printer speaks it.
    #[must_use]
    pub fn on(mut self, printer: &Printer) -> Self {
        if let SpeedWord::MarlinPolar(marlin) = &mut self.speed {
            *marlin = Marlin::of(printer);
        }
        self
    }

    /// Returns what the speed word of a move from `from` to `to` depends on, when the nozzle runs
    /// `path` mm over the part and `filament` mm are fed.
    #[must_use]
    pub fn way(&self, from: &Joints, to: &Joints, path: f64, filament: f64) -> Way {
        let ends = match self.space {
            Space::IdealPlane => [ideal(from), ideal(to)],
            Space::Joints | Space::Part => [[0.0; 2]; 2],
        };
        let rise = to.z - from.z;
        let [x, y] = [0, 1].map(|k| ends[1][k] - ends[0][k]);
        let turn = to.turn.radians() - from.turn.radians();
        Way { path, words: x.hypot(y).hypot(rise), filament, turn, ends, rise }
    }

    /// Returns the command that makes the firmware push filament ahead of its flow by so many seconds of
    /// its speed (pressure advance, linear advance); `None` where no firmware of this dialect has one.
    #[must_use]
    pub fn pressure_advance(&self, seconds: f64) -> Option<String> {
        let value = decimal(seconds, 4);
        match self.name {
            "klipper-polar" => Some(format!("SET_PRESSURE_ADVANCE ADVANCE={value}")),
            "rrf-polar" | "rrf-direct" => Some(format!("M572 D0 S{value}")),
            "marlin-polar" => Some(format!("M900 K{value}")),
            _ => None,
        }
    }

    /// Returns the command that bounds the acceleration of what follows, mm/s²; `None` where no firmware
    /// of this dialect has one.
    #[must_use]
    pub fn acceleration(&self, mm_per_s2: f64) -> Option<String> {
        let value = decimal(mm_per_s2, 0);
        match self.name {
            "klipper-polar" | "marlin-polar" | "cartesian" => Some(format!("M204 S{value}")),
            "rrf-polar" | "rrf-direct" => Some(format!("M204 P{value} T{value}")),
            _ => None,
        }
    }

    /// Returns how firmwares of this dialect are told which lines belong to which object; comments for
    /// print servers where none takes a command for it.
    #[must_use]
    pub fn label_words(&self) -> LabelWords {
        match self.name {
            "klipper-polar" => LabelWords::ExcludeObject,
            "rrf-polar" | "rrf-direct" | "marlin-polar" => LabelWords::M486,
            _ => LabelWords::Comments,
        }
    }

    /// Returns the command that tells the share of the print that is done and the minutes left; `None`
    /// where no firmware of this dialect has one.
    #[must_use]
    pub fn progress(&self, percent: u32, minutes: u64) -> Option<String> {
        match self.name {
            "klipper-polar" | "rrf-polar" | "rrf-direct" | "marlin-polar" | "cartesian" => {
                Some(format!("M73 P{percent} R{minutes}"))
            }
            _ => None,
        }
    }

    /// Returns whether `G92` may set the count of this word: the bed's, where it is kept short.
    #[must_use]
    pub fn recounts(&self, letter: u8) -> bool {
        let is_bed = |word: &Word| word.quantity == Quantity::Bed && word.letter == letter;
        self.recount_beyond.is_some() && self.plane.iter().any(is_bed)
    }

    /// Returns whether the words can bring the carriage to the other side of the axis.
    #[must_use]
    pub fn reaches_far_side(&self) -> bool {
        self.space == Space::Joints
    }

    /// Returns where the joints are when a share of the way from one position to another is done.
    #[must_use]
    pub fn between(&self, from: &Joints, to: &Joints, share: f64) -> Joints {
        let blend = |a: f64, b: f64| a + (b - a) * share;
        let z = blend(from.z, to.z);
        if self.space == Space::IdealPlane {
            let (a, b) = (ideal(from), ideal(to));
            let (x, y) = (blend(a[0], b[0]), blend(a[1], b[1]));
            return from_ideal([x, y], z, from.turn);
        }
        let turn = blend(from.turn.radians(), to.turn.radians());
        Joints { s: blend(from.s, to.s), turn: BedTurn::accumulated(turn), z }
    }

    /// Returns the numbers of the plane's words for the end of a move.
    #[must_use]
    pub(super) fn plane_values(&self, to: &Joints, at: &Point3<f64>) -> [f64; 2] {
        self.plane.map(|word| match word.quantity {
            Quantity::Rail => to.s,
            Quantity::Bed => to.turn.radians().to_degrees(),
            Quantity::PartX => at.x,
            Quantity::PartY => at.y,
            Quantity::IdealX => ideal(to)[0],
            Quantity::IdealY => ideal(to)[1],
        })
    }

    /// Returns the joints that a position in this dialect's words stands for, the bed turned as
    /// little as possible from `near` where the words do not say; `None` when they are part
    /// coordinates.
    #[must_use]
    pub fn joints(&self, plane: [f64; 2], z: f64, near: BedTurn) -> Option<Joints> {
        match self.space {
            Space::Joints => {
                Some(Joints { s: plane[0], turn: BedTurn::accumulated(plane[1].to_radians()), z })
            }
            Space::IdealPlane => Some(from_ideal(plane, z, near)),
            Space::Part => None,
        }
    }

    /// Returns joints as a program in this dialect's words will say them.
    #[must_use]
    pub fn rounded_joints(&self, to: &Joints) -> Joints {
        let lengths = self.length_decimals(to.s.abs());
        let z = rounded(to.z, MM_DECIMALS);
        if self.space == Space::IdealPlane {
            return from_ideal(ideal(to).map(|n| rounded(n, lengths)), z, to.turn);
        }
        let degrees = rounded(to.turn.radians().to_degrees(), DEGREE_DECIMALS);
        let turn = BedTurn::accumulated(degrees.to_radians());
        Joints { s: rounded(to.s, lengths), turn, z }
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
            Space::Joints | Space::IdealPlane => step.to.s.abs(),
            Space::Part => step.at.xy().coords.norm(),
        });
        self.plane
            .map(|word| if word.quantity == Quantity::Bed { DEGREE_DECIMALS } else { lengths })
    }

    /// Decimal places of lengths at this distance from the axis: near it a thousandth of a
    /// millimetre is a coarse angle.
    pub(super) fn length_decimals(&self, from_axis: f64) -> usize {
        if from_axis < NEAR_AXIS_MM { NEAR_AXIS_DECIMALS } else { MM_DECIMALS }
    }
}

/// The place of the carriage on an ideal machine that counts its turn from +x.
fn ideal(joints: &Joints) -> [f64; 2] {
    let (sin, cos) = joints.turn.radians().sin_cos();
    [joints.s * cos, joints.s * sin]
}

fn from_ideal([x, y]: [f64; 2], z: f64, near: BedTurn) -> Joints {
    let turn = if x == 0.0 && y == 0.0 { near } else { near.nearest(y.atan2(x)) };
    Joints { s: x.hypot(y), turn, z }
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
    fn pressure_advance_is_said_as_each_firmware_knows_it() {
        let said = ALL.map(|dialect| dialect.pressure_advance(0.045));
        let known: Vec<String> = said.into_iter().flatten().collect();
        assert_eq!(
            known,
            [
                "M572 D0 S0.045",
                "SET_PRESSURE_ADVANCE ADVANCE=0.045",
                "M572 D0 S0.045",
                "M900 K0.045"
            ]
        );
    }

    #[test]
    fn names_are_found_again() {
        for dialect in ALL {
            assert_eq!(Dialect::by_name(dialect.name), Some(dialect));
        }
        assert_eq!(Dialect::by_name("marlin"), None);
    }
}
