//! What a move becomes on a real bed: the lift follows the probed heights, and the drive takes up
//! its play where the bed changes its direction.

use nalgebra::Point3;

use super::dialect::{Dialect, Space};
use crate::backlash::Backlash;
use crate::height_map::HeightMap;
use crate::kinematics::Alignment;
use crate::profile::{Printer, Turntable};
use crate::program::{Joints, Move};

/// Turns planned moves into those that the machine is told.
#[derive(Debug, Clone)]
pub(super) struct Correction {
    map: HeightMap,
    alignment: Alignment,
    backlash: Option<Backlash>,
    bed: Turntable,
    /// Speed of the lift, less what rounding takes, mm/s.
    lift_speed: f64,
    /// Where the lift was told to go last, mm.
    lift: f64,
    /// Where the last planned move ended, and how the bed ran in it (rad/s, s).
    at: (Joints, Point3<f64>),
    pace: (f64, f64),
}

/// Share of the lift's speed that is used: the rest is for the rounding of heights.
const USED_SHARE: f64 = 0.99;

impl Correction {
    /// Returns the correction of a printer at home; `None` where there is nothing to correct.
    pub(super) fn of(printer: &Printer, dialect: Dialect) -> Option<Self> {
        let alignment = printer.alignment;
        let play = alignment.bed.backlash;
        let has_play = play > 0.0 && dialect.space != Space::Part;
        if printer.bed_map.is_flat() && !has_play {
            return None;
        }
        let home = printer.home;
        Some(Self {
            map: printer.bed_map.clone(),
            alignment,
            backlash: has_play.then(|| Backlash::new(play, home.turn)),
            bed: printer.bed,
            lift_speed: printer.lift.speed * USED_SHARE,
            lift: home.z,
            at: (home, alignment.part_from_joints(&home)),
            pace: (0.0, 0.0),
        })
    }

    /// Returns what the machine is told for a planned move, and before it, where the bed changes its
    /// direction, the move that takes up the play.
    pub(super) fn moves(&mut self, planned: &Move) -> (Option<Move>, Move) {
        let turned = planned.to.turn.radians() - self.at.0.turn.radians();
        let pace = (turned / planned.duration, planned.duration);
        let take_up = self.take_up(planned, pace);
        let mut told = *planned;
        told.to = self.told(&planned.to, &planned.at);
        if planned.path == 0.0 {
            told.to.z = self.lift;
        }
        let rise = (told.to.z - self.lift).abs();
        told.duration = told.duration.max(rise / self.lift_speed);
        self.lift = told.to.z;
        self.at = (planned.to, planned.at);
        self.pace = pace;
        (take_up, told)
    }

    fn told(&mut self, to: &Joints, at: &Point3<f64>) -> Joints {
        let z = self.map.lift(&self.alignment.over_bed(&at.xy()), to.z);
        let turn = match &mut self.backlash {
            Some(backlash) => backlash.follow(to.turn),
            None => to.turn,
        };
        Joints { z, turn, ..*to }
    }

    /// The move of the drive alone that comes before a change of direction: slow enough that the
    /// bed's drive can follow from the move before and to the one after.
    fn take_up(&mut self, planned: &Move, next: (f64, f64)) -> Option<Move> {
        let backlash = self.backlash.as_mut()?;
        let last = backlash.drive().radians();
        let turn = backlash.take_up(planned.to.turn)?;
        let way = turn.radians() - last;
        let limit = self.bed.acceleration;
        let mut duration = way.abs() / self.bed.speed;
        let too_fast = |duration: f64| {
            let speed = way / duration;
            [self.pace, next]
                .iter()
                .any(|(other, time)| (speed - other).abs() > limit * f64::midpoint(*time, duration))
        };
        // Ends, because the speed goes to zero and the time allowed grows.
        while too_fast(duration) {
            duration *= 1.1;
        }
        let to = Joints { turn, z: self.lift, ..self.at.0 };
        let (path, filament) = (way.abs() * self.at.0.s.abs(), 0.0);
        Some(Move { to, at: self.at.1, filament, path, duration })
    }
}
