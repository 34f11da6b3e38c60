//! Play in the drive of the bed.
//!
//! When the drive changes its direction, its first `B` radians do not reach the bed. With the drive
//! `B/2` ahead of the bed in the direction of motion the bed stands where it should; at each change
//! of direction the drive takes up the play in a move of its own, the nozzle standing and the
//! filament with it, and only then does the bed begin to turn.
//!
//! Rule and numbers: the calibration's `theta_cmd = theta + dir·B/2`, `dir` the sign of the last
//! change.

use crate::program::BedTurn;

/// What the drive is told, and in which direction it last ran.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backlash {
    half: f64,
    direction: f64,
    bed: BedTurn,
}

impl Backlash {
    /// Returns the play of a drive that stands at `bed` after running in the direction of growing
    /// turns.
    #[must_use]
    pub fn new(play: f64, bed: BedTurn) -> Self {
        Self { half: play / 2.0, direction: 1.0, bed }
    }

    /// Returns what the drive must be told for the bed to stand at its last place.
    #[must_use]
    pub fn drive(&self) -> BedTurn {
        BedTurn::accumulated(self.bed.radians() + self.direction * self.half)
    }

    /// Returns the drive's turn that takes up the play before the bed turns to `to`; `None` when
    /// the direction stays. After it [`follow`](Self::follow) gives the end of the move.
    pub fn take_up(&mut self, to: BedTurn) -> Option<BedTurn> {
        let change = to.radians() - self.bed.radians();
        if change * self.direction >= 0.0 {
            return None;
        }
        self.direction = -self.direction;
        (self.half > 0.0).then(|| self.drive())
    }

    /// Returns what the drive must be told for the bed to stand at `to`, the play taken up.
    pub fn follow(&mut self, to: BedTurn) -> BedTurn {
        self.bed = to;
        self.drive()
    }
}

/// A bed behind a drive with play: it follows only when the play is used up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LooseBed {
    half: f64,
    bed: BedTurn,
}

impl LooseBed {
    /// Returns a bed that stands at `bed`.
    #[must_use]
    pub fn new(play: f64, bed: BedTurn) -> Self {
        Self { half: play / 2.0, bed }
    }

    /// Moves the drive and returns where the bed then stands.
    pub fn drive(&mut self, to: BedTurn) -> BedTurn {
        let (low, high) = (to.radians() - self.half, to.radians() + self.half);
        self.bed = BedTurn::accumulated(self.bed.radians().clamp(low, high));
        self.bed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_loose_bed_stands_where_it_should(
            play in 0.0..0.05_f64,
            turns in prop::collection::vec(-3.0..3.0_f64, 1..50),
        ) {
            let mut backlash = Backlash::new(play, BedTurn::default());
            let mut bed = LooseBed::new(play, BedTurn::default());
            // Homing ends in the direction of growing turns.
            bed.drive(backlash.drive());
            for turn in turns {
                let to = BedTurn::accumulated(turn);
                let before = bed.bed;
                if let Some(drive) = backlash.take_up(to) {
                    let stays = bed.drive(drive).radians() - before.radians();
                    prop_assert!(stays.abs() < 1e-12, "the bed turned by {stays}");
                }
                let off = bed.drive(backlash.follow(to)).radians() - turn;
                prop_assert!(off.abs() < 1e-12, "{off}");
            }
        }
    }

    #[test]
    fn without_play_nothing_is_taken_up() {
        let mut backlash = Backlash::new(0.0, BedTurn::default());
        assert_eq!(backlash.take_up(BedTurn::accumulated(-1.0)), None);
        assert_eq!(backlash.follow(BedTurn::accumulated(-1.0)).radians(), -1.0);
    }
}
