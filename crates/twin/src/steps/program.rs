//! From the lines of a program to intervals.
//!
//! A line that moves is one interval where the firmware runs the axes themselves (see
//! [`Space::Joints`]). Where the words are `X` and `Y` that the firmware turns into radius and angle, it
//! is as many as it takes for the axes to run evenly in each: no piece turns the bed by more than
//! [`PIECE`], and none passes the place that is nearest to the axis, where the carriage turns round.
//! `G4` is an interval without pulses. `G28` sets the count to that of the printer's home without
//! counting the way there, which switches end and no program knows.

use machine::gcode::Command;
use machine::gcode::dialect::{Dialect, Space};
use machine::profile::Printer;
use machine::program::{BedTurn, Joints};
use nalgebra::Point3;

use super::count::Counts;
use super::{Axes, Interval, MOST_AXES};
use crate::replay::{Event, Replay, read};
use crate::segment::Segment;

/// Turn of the bed up to which the axes run evenly enough, radians: 2°, over which the carriage
/// leaves an even run by 0.015 % of its radius.
pub const PIECE: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Most pieces that a line is cut into.
const MOST_PIECES: f64 = 360.0;

/// Follows a program. Lines that cannot be read are left out, as a firmware does.
#[derive(Debug)]
pub struct Stepper {
    replay: Replay,
    dialect: Dialect,
    counts: Counts,
    filament: f64,
}

/// An interval, and the segment that it is part of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// The interval.
    pub interval: Interval,
    /// What the line does; `None` for a dwell.
    pub segment: Option<Segment>,
    /// Whether it is the last of its line.
    pub ends_line: bool,
}

/// The program does not say where the joints are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "a program in dialect {0} does not say where carriage, bed and lift alone bring this machine"
)]
pub struct NoJoints(pub &'static str);

impl Stepper {
    /// Returns a stepper at the printer's home.
    ///
    /// # Errors
    ///
    /// [`NoJoints`] for a dialect in part coordinates.
    pub fn new(printer: &Printer, dialect: Dialect, axes: Axes) -> Result<Self, NoJoints> {
        let replay = Replay::new(printer, dialect);
        let Some(home) = replay.drives() else { return Err(NoJoints(dialect.name)) };
        let counts = Counts::new(axes, positions(&home, 0.0));
        Ok(Self { replay, dialect, counts, filament: 0.0 })
    }

    /// Returns where the motors are, in pulses from zero.
    #[must_use]
    pub fn count(&self) -> [i64; MOST_AXES] {
        self.counts.count()
    }

    /// Follows the next line; `each` is shown what it makes the motors do.
    pub fn line(&mut self, text: &[u8], mut each: impl FnMut(&Step)) {
        let mut command = Command::BLANK;
        let is_plain = command.read_plain(text);
        let text = if is_plain { "" } else { std::str::from_utf8(text).unwrap_or_default() };
        let from = self.replay.drives();
        let event = if is_plain {
            self.replay.follow_command(&command)
        } else {
            let Ok(line) = read(text) else {
                self.replay.skip();
                return;
            };
            let event = self.replay.follow(&line);
            match line.command {
                Some(read) => command = read,
                None => return,
            }
            event
        };
        match (event, from.zip(self.replay.drives())) {
            (Event::Segment(segment), Some((from, to))) => {
                self.segment(&segment, &from, &to, &mut each);
            }
            (Event::Rest, Some((_, to))) => self.rest(&command, &to, &mut each),
            _ => {}
        }
    }

    fn segment(
        &mut self,
        segment: &Segment,
        from: &Joints,
        to: &Joints,
        each: &mut impl FnMut(&Step),
    ) {
        let before = self.filament;
        self.filament += segment.filament;
        let mut last = 0.0;
        for share in self.shares(from, to) {
            let ends_line = share == 1.0;
            let (joints, filament) = if ends_line {
                (*to, self.filament)
            } else {
                (self.dialect.between(from, to, share), before + share * segment.filament)
            };
            let duration = (share - last) * segment.duration;
            let to = positions(&joints, filament);
            let interval = self.counts.go(segment.line, to, duration);
            each(&Step { interval, segment: Some(*segment), ends_line });
            last = share;
        }
    }

    /// Where a line is cut, as shares of it; the last is 1.
    fn shares(&self, from: &Joints, to: &Joints) -> Vec<f64> {
        if self.dialect.space != Space::IdealPlane {
            return vec![1.0];
        }
        let place = |joints: &Joints| {
            let (sin, cos) = joints.turn.radians().sin_cos();
            Point3::new(joints.s * cos, joints.s * sin, 0.0)
        };
        let (a, b) = (place(from), place(to));
        let turn = (to.turn.radians() - from.turn.radians()).abs();
        let pieces = (turn / PIECE).ceil().clamp(1.0, MOST_PIECES);
        let mut shares: Vec<f64> = (1..=pieces as u32).map(|k| f64::from(k) / pieces).collect();
        let along = b - a;
        let foot = -a.coords.dot(&along) / along.norm_squared();
        if 0.0 < foot && foot < 1.0 {
            shares.push(foot);
            shares.sort_by(f64::total_cmp);
            shares.dedup();
        }
        shares
    }

    fn rest(&mut self, command: &Command<'_>, to: &Joints, each: &mut impl FnMut(&Step)) {
        if command.is(b'G', 28) {
            self.counts.stand(positions(to, self.filament));
        }
        if !command.is(b'G', 4) {
            return;
        }
        let ms = command.word(b'P').unwrap_or(0.0) / 1e3;
        let duration = command.word(b'S').unwrap_or(ms);
        if duration > 0.0 {
            let interval = self.counts.go(self.replay.lines(), self.counts.at(), duration);
            each(&Step { interval, segment: None, ends_line: true });
        }
    }
}

fn positions(joints: &Joints, filament: f64) -> [f64; MOST_AXES] {
    [joints.s, joints.turn.radians(), joints.z, filament]
}

/// Returns where the carriage and the bed are when the motors stand at these counts.
#[must_use]
pub fn joints_at(axes: &Axes, count: [i64; MOST_AXES]) -> Joints {
    let at = |k: usize| count[k] as f64 * axes.steps[k];
    Joints { s: at(0), turn: BedTurn::accumulated(at(1)), z: at(2) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::printer;
    use machine::gcode::dialect::{CARTESIAN, KLIPPER_POLAR, POLAR};

    fn axes() -> Axes {
        let turn = 0.0225_f64.to_radians();
        Axes {
            names: &["R", "theta", "Z", "E"],
            steps: [0.0125, turn, 0.0025, 0.01],
            turns: [false, true, false, false],
        }
    }

    fn intervals(dialect: Dialect, text: &str) -> Vec<Interval> {
        let mut stepper = Stepper::new(&printer(), dialect, axes()).unwrap();
        let mut intervals = Vec::new();
        for line in text.lines() {
            stepper.line(line.as_bytes(), |step| intervals.push(step.interval));
        }
        intervals
    }

    #[test]
    fn a_line_is_an_interval() {
        let found = intervals(
            POLAR,
            "G28\nG90\nM83\nG1 R20 T0 Z0.2 F6000\n;LAYER:0\nG4 P250\nG1 R20 T90 E0.5\nG1 E-0.8 F600\n",
        );
        assert_eq!(found.len(), 4);
        // From home at R = 100, Z = 20.
        assert_eq!(found[0].count, [8000, 0, 8000, 0]);
        assert_eq!(found[0].pulses, [-6400, 0, -7920, 0]);
        assert_eq!((found[1].duration, found[1].pulses), (0.25, [0; 4]));
        assert_eq!((found[2].line, found[2].pulses), (7, [0, 4000, 0, 50]));
        assert_eq!(found[3].pulses, [0, 0, 0, -80]);
        assert!((found[3].start - (found[2].start + found[2].duration)).abs() < 1e-12);
        assert!((found[3].rate(&axes(), 3) - 1000.0).abs() < 1e-9);
    }

    #[test]
    fn a_straight_line_past_the_axis_turns_the_carriage_round() {
        let found = intervals(KLIPPER_POLAR, "G28\nG1 X10 Y-5 F600\nG1 X10 Y5\n");
        let line: Vec<&Interval> = found.iter().filter(|interval| interval.line == 3).collect();
        assert!(line.len() > 20);
        let ways = line.iter().map(|interval| interval.pulses[0].signum());
        let ways: Vec<i64> = ways.filter(|way| *way != 0).collect();
        let turns = ways.windows(2).filter(|pair| pair[0] * pair[1] < 0).count();
        assert_eq!((ways[0], ways[ways.len() - 1], turns), (-1, 1, 1));
        let back: i64 = line.iter().map(|interval| interval.pulses[0]).sum();
        assert_eq!(back, 0);
        let bed: i64 = line.iter().map(|interval| interval.pulses[1]).sum();
        assert_eq!(bed, 2 * (0.5_f64.atan() / axes().steps[1]).round() as i64);
        let duration: f64 = line.iter().map(|interval| interval.duration).sum();
        assert!((duration - 1.0).abs() < 1e-12);
    }

    #[test]
    fn homing_is_no_pulses() {
        let found = intervals(POLAR, "G28\nG1 R20 T720 Z5 F600\nG28\nG1 R20 T0 Z5\n");
        assert_eq!(found[1].count, [8000, 0, 8000, 0]);
        assert_eq!(found[0].pulses[0], found[1].pulses[0]);
    }

    #[test]
    fn part_coordinates_have_no_motors() {
        let error = Stepper::new(&printer(), CARTESIAN, axes()).unwrap_err();
        assert!(error.to_string().contains("cartesian"));
    }
}
