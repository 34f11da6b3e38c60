//! How long the machine takes.
//!
//! A firmware runs each line at its `F` at most. It speeds up and brakes within what path, carriage,
//! bed and lift can be accelerated by, each by its share of the line; from one line to the next
//! carriage and bed may change their speed at once by what the profile allows (`rail_jerk`,
//! `bed_jerk`). Where words are part coordinates, the two straight axes of that machine have the
//! carriage's limits. The nozzle stands still where only filament moves, and while the machine waits.
//!
//! Lines are kept until so many have come that a stop at the last of them no longer tells on the
//! first; firmwares look ahead less far.
//!
//! Uniformly accelerated motion: `v² = v₀² + 2·a·d`; a line entered at `v₀` and left at `v₁` peaks at
//! `v² = a·d + (v₀² + v₁²)/2` or at its `F`. mm, radians, seconds.

use std::collections::VecDeque;

use machine::profile::Printer;

use crate::segment::Segment;

/// Lines that are looked over at once.
const WINDOW: usize = 4096;

/// Sums up the time of a program.
#[derive(Debug, Clone)]
pub(crate) struct Ramps {
    path: f64,
    lift: f64,
    /// Carriage and bed: acceleration, and sudden change of speed.
    joints: [Axis; 2],
    /// Moves that are not yet timed.
    ahead: Vec<Run>,
    /// The square of the speed at which the first of them is entered.
    entry: f64,
    time: f64,
    /// How long each move took, where somebody wants to know.
    each: Option<Vec<f64>>,
}

/// Tells for each segment how long it really takes, some segments later.
#[derive(Debug, Clone)]
pub struct Clock {
    ramps: Ramps,
    /// Not yet told.
    waiting: VecDeque<Segment>,
}

impl Clock {
    /// Returns the clock of a printer that stands still.
    #[must_use]
    pub fn new(printer: &Printer) -> Self {
        let ramps = Ramps { each: Some(Vec::new()), ..Ramps::new(printer) };
        Self { ramps, waiting: VecDeque::new() }
    }

    /// The next segment; `each` is given those that are timed by now, in order, with the duration
    /// that ramps give them.
    pub fn segment(&mut self, segment: &Segment, each: impl FnMut(&Segment)) {
        self.waiting.push_back(*segment);
        self.ramps.segment(segment);
        self.tell(each);
    }

    /// The program ends: `each` is given the rest.
    pub fn finish(mut self, each: impl FnMut(&Segment)) {
        self.ramps.rest();
        self.tell(each);
    }

    fn tell(&mut self, mut each: impl FnMut(&Segment)) {
        let times = self.ramps.each.as_mut().map(std::mem::take).unwrap_or_default();
        let mut times = times.into_iter();
        while let Some(next) = self.waiting.front() {
            let runs = next.path > 0.0 && next.duration > 0.0;
            let duration = if runs { times.next() } else { Some(next.duration) };
            let (Some(duration), Some(segment)) = (duration, self.waiting.front().copied()) else {
                break;
            };
            self.waiting.pop_front();
            each(&Segment { duration, ..segment });
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Axis {
    acceleration: f64,
    sudden: f64,
}

/// A move of the nozzle.
#[derive(Debug, Clone, Copy)]
struct Run {
    length: f64,
    /// The square of its `F`.
    most: f64,
    acceleration: f64,
    /// Change of the two axes along each mm.
    slope: [f64; 2],
    /// The square of the speed at which it may be entered from the one before.
    junction: f64,
}

impl Ramps {
    /// Returns the clock of a printer that stands still.
    pub(crate) fn new(printer: &Printer) -> Self {
        let rail = Axis { acceleration: printer.rail.acceleration, sudden: printer.rail_jerk };
        let bed = Axis { acceleration: printer.bed.acceleration, sudden: printer.bed_jerk };
        Self {
            path: printer.path_acceleration,
            lift: printer.lift.acceleration,
            joints: [rail, bed],
            ahead: Vec::new(),
            entry: 0.0,
            time: 0.0,
            each: None,
        }
    }

    /// The next line.
    pub(crate) fn segment(&mut self, segment: &Segment) {
        if segment.path > 0.0 && segment.duration > 0.0 {
            self.add(segment);
            if self.ahead.len() >= WINDOW {
                self.pass(WINDOW / 2);
            }
        } else if segment.duration > 0.0 {
            self.rest();
            self.time += segment.duration;
        }
    }

    /// The machine stands still.
    pub(crate) fn rest(&mut self) {
        self.pass(self.ahead.len());
        self.entry = 0.0;
    }

    /// Returns the time up to the last rest, s.
    pub(crate) fn time(&self) -> f64 {
        self.time
    }

    fn add(&mut self, segment: &Segment) {
        let length = segment.path;
        let slope = match segment.joints {
            Some(_) => [segment.rail_change(), segment.bed_change()],
            None => {
                let by = segment.part[1] - segment.part[0];
                [by.x, by.y]
            }
        };
        let slope = slope.map(|change| change / length);
        let axes = match segment.joints {
            Some(_) => self.joints,
            None => [self.joints[0]; 2],
        };
        let mut acceleration = self.path.min(self.lift * length / segment.lift_change().abs());
        let mut junction = f64::INFINITY;
        let last = self.ahead.last();
        for k in 0..2 {
            // Along an axis that does not move anything is possible: a division by zero is infinite.
            acceleration = acceleration.min(axes[k].acceleration / slope[k].abs());
            if let Some(last) = last {
                let jump = (slope[k] - last.slope[k]).abs();
                junction = junction.min(axes[k].sudden / jump);
            }
        }
        let most = (length / segment.duration).powi(2);
        let before = last.map_or(0.0, |last| last.most);
        let junction = (junction * junction).min(most).min(before);
        self.ahead.push(Run { length, most, acceleration, slope, junction });
    }

    /// Times the first moves; after the last that is known the machine stands still.
    fn pass(&mut self, count: usize) {
        let mut entries = vec![0.0; self.ahead.len() + 1];
        for (k, run) in self.ahead.iter().enumerate().rev() {
            entries[k] = run.junction.min(run.reached_from(entries[k + 1]));
        }
        // What was promised to the moves before was found with fewer known, and is never too fast.
        entries[0] = self.entry;
        for (k, run) in self.ahead[..count].iter().enumerate() {
            entries[k + 1] = f64::min(entries[k + 1], run.reached_from(entries[k]));
            let time = run.time(entries[k], entries[k + 1]);
            self.time += time;
            if let Some(each) = &mut self.each {
                each.push(time);
            }
        }
        self.entry = entries[count];
        self.ahead.drain(..count);
    }
}

impl Run {
    /// The greatest square of the speed at one end when that at the other is given.
    fn reached_from(&self, other: f64) -> f64 {
        self.most.min(other + 2.0 * self.acceleration * self.length)
    }

    fn time(&self, entry: f64, exit: f64) -> f64 {
        let peak = (self.acceleration * self.length + f64::midpoint(entry, exit)).min(self.most);
        let peak = peak.max(entry).max(exit);
        let (first, top, last) = (entry.sqrt(), peak.sqrt(), exit.sqrt());
        let changing = (2.0 * top - first - last) / self.acceleration;
        let covered = (2.0 * peak - entry - exit) / (2.0 * self.acceleration);
        changing + (self.length - covered).max(0.0) / top
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{filament_segment, part_segment, polar_segment, printer};
    use nalgebra::Point3;

    fn time(printer: &Printer, segments: &[Segment]) -> f64 {
        let mut ramps = Ramps::new(printer);
        for segment in segments {
            ramps.segment(segment);
        }
        ramps.rest();
        ramps.time()
    }

    /// Lines along the rail through these places, at this speed.
    fn along(places: &[f64], feed: f64) -> Vec<Segment> {
        let lines = places.windows(2);
        lines.map(|ends| polar_segment([ends[0], 0.0], [ends[1], 0.0], feed)).collect()
    }

    #[test]
    fn a_trapezoid_however_it_is_cut() {
        let printer = printer();
        let a = printer.path_acceleration.min(printer.rail.acceleration);
        let whole = time(&printer, &along(&[10.0, 70.0], 60.0));
        assert!((whole - (1.0 + 60.0 / a)).abs() < 1e-9, "{whole}");
        let pieces: Vec<f64> = (0..=60_000).map(|k| 10.0 + f64::from(k) * 1e-3).collect();
        assert!((time(&printer, &along(&pieces, 60.0)) - whole).abs() < 1e-6, "over many windows");
    }

    #[test]
    fn corners_and_filament_cost_a_stop() {
        let printer = printer();
        let one = time(&printer, &along(&[10.0, 40.0], 60.0));
        let back = time(&printer, &along(&[10.0, 40.0, 10.0], 60.0));
        let a = printer.path_acceleration.min(printer.rail.acceleration);
        // The speed may jump by the jerk in all: half of it before the corner and half behind.
        let spared = 2.0 * (printer.rail_jerk / 2.0) / a;
        assert!((back - 2.0 * one).abs() < spared + 1e-9 && back < 2.0 * one + 1e-12);
        let mut lines = along(&[10.0, 40.0, 70.0], 60.0);
        lines.insert(1, filament_segment(-0.8, 8.0));
        assert!((time(&printer, &lines) - (2.0 * one + 0.1)).abs() < 1e-9);
    }

    #[test]
    fn every_move_is_told_its_time_in_order() {
        let printer = printer();
        let pieces: Vec<f64> = (0..=9000).map(|k| 10.0 + f64::from(k) * 0.01).collect();
        let mut lines = along(&pieces, 60.0);
        lines.insert(4000, filament_segment(-0.8, 8.0));
        for (k, line) in lines.iter_mut().enumerate() {
            line.line = k;
        }
        let mut told = Vec::new();
        let mut clock = Clock::new(&printer);
        for line in &lines {
            clock.segment(line, |segment| told.push(*segment));
        }
        assert!(told.len() > 4000 && told.len() < lines.len(), "memory stays bounded");
        clock.finish(|segment| told.push(*segment));
        assert!(told.iter().map(|segment| segment.line).eq(0..lines.len()));
        let sum: f64 = told.iter().map(|segment| segment.duration).sum();
        assert!((sum - time(&printer, &lines)).abs() < 1e-9);
        // The first takes longer than it would at its F, those amid a line do not.
        assert!(told[0].duration > 2.0 * lines[0].duration);
        assert!((told[2000].duration - lines[2000].duration).abs() < 1e-12);
    }

    #[test]
    fn each_axis_has_its_acceleration() {
        let mut printer = printer();
        printer.bed.acceleration = 5.0;
        // 1 rad at 20 mm: 2 rad/s need 0.4 s and 0.4 rad each to be reached and left.
        let turn = time(&printer, &[polar_segment([20.0, 0.0], [20.0, 1.0], 40.0)]);
        assert!((turn - (2.0 * 0.4 + 0.2 / 2.0)).abs() < 1e-9, "{turn}");
    }

    #[test]
    fn part_coordinates_have_straight_axes() {
        let printer = printer();
        let to = |a: [f64; 2], b: [f64; 2]| {
            let mut segment =
                part_segment(Point3::new(a[0], a[1], 1.0), Point3::new(b[0], b[1], 1.0));
            segment.duration = segment.path / 60.0;
            segment
        };
        let straight = time(&printer, &[to([0.0, 9.0], [30.0, 9.0]), to([30.0, 9.0], [60.0, 9.0])]);
        let corner = time(&printer, &[to([0.0, 9.0], [30.0, 9.0]), to([30.0, 9.0], [30.0, 39.0])]);
        assert!(corner > straight + 0.02, "{corner} {straight}");
    }
}
