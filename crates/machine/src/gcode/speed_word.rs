//! What the number of an `F` word means.
//!
//! A move is planned with its duration; each firmware turns distance and `F` into a duration in its
//! own way, and the word must be such that the planned one comes out.

use std::f64::consts::FRAC_2_PI;

/// What a firmware makes of `F`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SpeedWord {
    /// Speed of the nozzle over the part, mm/min.
    Nozzle,
    /// Speed along the straight line of the words X, Y and Z, mm/min.
    Words,
    /// One over the time of the move, 1/min, on every move (`G93`).
    InverseTime,
    /// Like `Words`, but multiplied, wherever the bed turns, by a factor that grows towards the
    /// axis; see [`SpeedWord::word`].
    MarlinPolar {
        /// `PRINTABLE_RADIUS` of the firmware's configuration, mm.
        printable_radius: f64,
    },
}

/// What the speed word of a move depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Way {
    /// Length of the nozzle's path over the part, mm.
    pub path: f64,
    /// Distance between the ends in the words X, Y and Z, mm.
    pub words: f64,
    /// Filament fed or drawn back, mm.
    pub filament: f64,
    /// Turn of the bed, radians.
    pub turn: f64,
    /// Distance of the end from the axis, mm.
    pub radius: f64,
}

/// Marlin's `POLAR_MIN_SEGMENT_LENGTH`, mm: it cuts lines into pieces of that length, unless they
/// run faster than 90 mm/s.
const MARLIN_PIECE_MM: f64 = 0.5;

impl SpeedWord {
    /// Returns the number of `F` for a move of `duration` s. Where only filament moves, its speed
    /// counts in every dialect but those with inverse time.
    ///
    /// Marlin's planner multiplies the speed of each piece, which turns the bed by `dθ` and ends
    /// `r` from the axis, by `1 + n·R/r`, with `n = 1 − |atan2(dr, |dr|·dθ)|/90°`, that is
    /// `n = 2/π·atan(dθ)`, and `n = 1` where `r` does not change at all. The word is divided by
    /// that factor.
    #[must_use]
    pub fn word(&self, way: &Way, duration: f64) -> f64 {
        match self {
            Self::InverseTime => 60.0 / duration,
            _ => self.distance(way) / duration * 60.0 / self.factor(way),
        }
    }

    /// Returns how long the firmware takes for a move with this `F`, s: the inverse of
    /// [`word`](Self::word).
    #[must_use]
    pub fn duration(&self, way: &Way, word: f64) -> f64 {
        match self {
            Self::InverseTime => 60.0 / word,
            _ => self.distance(way) * 60.0 / (word * self.factor(way)),
        }
    }

    /// Returns whether the distance in the words counts.
    #[must_use]
    pub fn is_along_words(&self) -> bool {
        matches!(self, Self::Words | Self::MarlinPolar { .. })
    }

    /// Returns whether every move needs the word anew.
    #[must_use]
    pub fn is_of_one_move(&self) -> bool {
        *self == Self::InverseTime
    }

    fn distance(&self, way: &Way) -> f64 {
        let distance = if *self == Self::Nozzle { way.path } else { way.words };
        if distance > 0.0 { distance } else { way.filament.abs() }
    }

    fn factor(&self, way: &Way) -> f64 {
        let Self::MarlinPolar { printable_radius } = self else { return 1.0 };
        if way.turn == 0.0 || way.radius == 0.0 {
            return 1.0;
        }
        let pieces = (way.words / MARLIN_PIECE_MM).floor().max(1.0);
        1.0 + printable_radius / way.radius * FRAC_2_PI * (way.turn.abs() / pieces).atan()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAY: Way = Way { path: 3.0, words: 2.5, filament: 0.1, turn: 0.2, radius: 12.0 };

    #[test]
    fn the_word_means_the_duration() {
        let marlin = SpeedWord::MarlinPolar { printable_radius: 82.0 };
        for law in [SpeedWord::Nozzle, SpeedWord::Words, SpeedWord::InverseTime, marlin] {
            let back = law.duration(&WAY, law.word(&WAY, 0.08));
            assert!((back - 0.08).abs() < 1e-15, "{law:?}: {back}");
        }
        assert_eq!(SpeedWord::Nozzle.word(&WAY, 0.1), 1800.0);
        assert_eq!(SpeedWord::Words.word(&WAY, 0.1), 1500.0);
        assert_eq!(SpeedWord::InverseTime.word(&WAY, 0.05), 1200.0);
        let alone = Way { path: 0.0, words: 0.0, ..WAY };
        assert!((SpeedWord::Words.word(&alone, 0.1) - 60.0).abs() < 1e-12);
    }

    #[test]
    fn marlin_is_asked_for_less_near_the_axis() {
        let marlin = SpeedWord::MarlinPolar { printable_radius: 82.0 };
        // Five pieces of 0.5 mm, each with 0.04 rad: n = 0.02546, factor 1.174.
        let word = marlin.word(&WAY, 0.1);
        assert!((1500.0 / word - 1.173_9).abs() < 1e-3, "{word}");
        let radial = Way { turn: 0.0, ..WAY };
        assert_eq!(marlin.word(&radial, 0.1), 1500.0);
    }
}
