//! What the number of an `F` word means.
//!
//! A move is planned with its duration; each firmware turns distance and `F` into a duration in its
//! own way, and the word must be such that the planned one comes out.

use super::marlin::Marlin;

/// What a firmware makes of `F`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SpeedWord {
    /// Speed of the nozzle over the part, mm/min.
    Nozzle,
    /// Speed along the straight line of the words X, Y and Z, mm/min.
    Words,
    /// One over the time of the move, 1/min, on every move (`G93`).
    InverseTime,
    /// Like `Words`, but changed wherever the bed turns; see [`Marlin`].
    MarlinPolar(Marlin),
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
    /// Both ends in the words X and Y, mm.
    pub ends: [[f64; 2]; 2],
    /// The difference of their Z, mm.
    pub rise: f64,
}

impl SpeedWord {
    /// Returns the number of `F` for a move of `duration` s. Where only filament moves, its speed
    /// counts in every dialect but those with inverse time.
    #[must_use]
    pub fn word(&self, way: &Way, duration: f64) -> f64 {
        match self {
            Self::InverseTime => 60.0 / duration,
            Self::MarlinPolar(marlin) if changes_speed(way) => marlin.speed(way, duration) * 60.0,
            _ => self.distance(way) / duration * 60.0,
        }
    }

    /// Returns how long the firmware takes for a move with this `F`, s: the inverse of
    /// [`word`](Self::word), where the firmware leaves the pace to it.
    #[must_use]
    pub fn duration(&self, way: &Way, word: f64) -> f64 {
        match self {
            Self::InverseTime => 60.0 / word,
            Self::MarlinPolar(marlin) if changes_speed(way) => marlin.duration(way, word / 60.0),
            _ => self.distance(way) * 60.0 / word,
        }
    }

    /// Returns whether the firmware runs some of a move at a speed of its own, whatever `F` says.
    #[must_use]
    pub fn sets_the_pace(&self, way: &Way) -> bool {
        matches!(self, Self::MarlinPolar(marlin) if changes_speed(way) && marlin.sets_the_pace(way))
    }

    /// Returns whether the distance in the words counts.
    #[must_use]
    pub fn is_along_words(&self) -> bool {
        matches!(self, Self::Words | Self::MarlinPolar(_))
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
}

/// Whether the bed turns on the way.
fn changes_speed(way: &Way) -> bool {
    way.turn != 0.0 && way.words > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAY: Way = Way {
        path: 3.0,
        words: 2.5,
        filament: 0.1,
        turn: 0.2,
        ends: [[12.0, 0.0], [12.0, 2.5]],
        rise: 0.0,
    };

    #[test]
    fn the_word_means_the_duration() {
        let marlin = SpeedWord::MarlinPolar(Marlin::EXAMPLE);
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
        let marlin = SpeedWord::MarlinPolar(Marlin::EXAMPLE);
        let word = marlin.word(&WAY, 0.1);
        assert!(word < 1500.0 / 1.1 && word > 1500.0 / 1.3, "{word}");
        let radial = Way { turn: 0.0, ..WAY };
        assert_eq!(marlin.word(&radial, 0.1), 1500.0);
    }
}
