//! Machines whose head turns the nozzle: where the words bring it.
//!
//! Words become a stance, and the stance a pose by the head's *forward* kinematics. For the checks that
//! look at a place over the bed the tip is given the joints that an upright nozzle would have there; the
//! drives' own ranges, speeds and joints are for [`crate::check::head`].

use machine::gcode::Command;
use machine::gcode::dialect::Dialect;
use machine::gcode::posed::{Drive, PosedWord};
use machine::head::{Head, Pose, Stance};
use machine::kinematics::{Alignment, Unreachable};
use machine::profile::Printer;
use machine::program::BedTurn;

/// What the last move did. See the [module](self).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosedMove {
    /// What the drives stood at before and stand at now.
    pub stances: [Stance; 2],
    /// Where the nozzle was and is.
    pub poses: [Pose; 2],
    /// Why the drives have no pose, where they have none: the nozzle is then taken to stay.
    pub lost: Option<Unreachable>,
}

/// Follows the words of such a machine.
#[derive(Debug, Clone)]
pub(crate) struct PosedReplay {
    head: Head,
    alignment: Alignment,
    words: Vec<PosedWord>,
    home: (Stance, Pose),
    last: PosedMove,
}

impl PosedReplay {
    /// Returns the replay of a printer at home; `None` where its nozzle stands upright, or the dialect
    /// knows of no tilt.
    pub(crate) fn new(printer: &Printer, dialect: &Dialect) -> Option<Self> {
        let head = printer.head.clone().filter(|_| dialect.speaks_of_heads())?;
        let alignment = printer.alignment;
        let pose = Pose::upright(alignment.part_from_joints(&printer.home));
        // Rounded, as whatever told the drives to stand so.
        let stance = head
            .stance(&pose, printer.home.turn, &alignment)
            .map(|reached| dialect.rounded_stance(&reached.stance, &head))
            .unwrap_or(Stance { base: printer.home, head: [0.0; 6] });
        let last = PosedMove { stances: [stance; 2], poses: [pose; 2], lost: None };
        let words = dialect.posed_words(&head);
        Some(Self { head, alignment, words, home: (stance, pose), last })
    }

    /// The machine is homed.
    pub(crate) fn homed(&mut self) {
        let (stance, pose) = self.home;
        self.last = PosedMove { stances: [stance; 2], poses: [pose; 2], lost: None };
    }

    /// Follows the words of a move; returns whether there are any. `recounted` is what was taken off the
    /// count of the bed, radians.
    pub(crate) fn follow(&mut self, command: &Command<'_>, recounted: f64) -> bool {
        let mut stance = self.last.stances[1];
        let mut moves = false;
        for word in &self.words {
            let Some(number) = command.word(word.letter) else { continue };
            moves = true;
            let turned = if word.drive == Drive::Bed { recounted.to_degrees() } else { 0.0 };
            word.drive.set(&mut stance, number + turned);
        }
        let [_, from] = self.last.stances;
        let [_, was] = self.last.poses;
        let (pose, lost) = match self.head.pose(&stance, &was, &self.alignment) {
            Ok(pose) if moves => (pose, None),
            Ok(_) => (was, None),
            Err(error) => (was, Some(error)),
        };
        self.last = PosedMove { stances: [from, stance], poses: [was, pose], lost };
        moves
    }

    /// What the last move did.
    pub(crate) fn last(&self) -> &PosedMove {
        &self.last
    }

    /// How the bed stands by its count.
    pub(crate) fn turn(&self) -> BedTurn {
        self.last.stances[1].base.turn
    }

    /// Whether the bed turns at all.
    pub(crate) fn turns_bed(&self) -> bool {
        self.head.turns_bed()
    }

    /// How far the pivot ran round the tip in the last move, mm.
    pub(crate) fn swing(&self) -> f64 {
        let [from, to] = &self.last.poses;
        from.axis.angle(&to.axis) * self.head.pivot_length()
    }
}
