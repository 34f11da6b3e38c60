//! Can bed and carriage follow the changes of speed?
//!
//! An axis has a mean speed on every segment. From the middle of one to the middle of the next it
//! may change by the acceleration limit times the time between, plus the sudden change that the
//! printer's profile allows (`bed_jerk`, `rail_jerk`). The sudden change is not granted anew at
//! every line: over *any* stretch of the program the speed may change by `acceleration · time +
//! sudden change`, once. With a sudden change of zero that is the rule for neighbours alone.
//!
//! The worst of all stretches that end at a line is that of the line before or the line alone, as
//! in the search for the greatest sum of consecutive numbers (J. Bentley, 1984, "Algorithm design
//! techniques", who names J. Kadane); so one number for each direction is remembered.
//!
//! Moves of filament or lift alone are time in which bed and carriage stand still. Homing, dwells
//! and waits for heat bring everything to rest, as do begin and end of the program: to rest and
//! from rest the half of a segment is available. Where a firmware runs a line at a pace of its own
//! and itself sees to what the axes can follow, its `F` says nothing, and the judging begins anew
//! behind it. Allowed on top is what
//! [rounding](crate::rounding) can do to the two means and to the time. mm, radians, seconds.

use machine::profile::Printer;

use crate::finding::{Findings, Place, exceeds};
use crate::rounding::Doubt;
use crate::segment::Segment;

/// The name of this check.
pub const NAME: &str = "acceleration";

/// Judges the changes of speed of bed and carriage, and remembers the greatest acceleration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Acceleration {
    bed: Axis,
    rail: Axis,
    last: Option<Place>,
}

/// One axis: its limits, how it ran last, and how far its speed ran ahead.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axis {
    limit: f64,
    sudden: f64,
    /// `None` where nothing is known of it.
    last: Option<Run>,
    faster: Stretch,
    slower: Stretch,
    greatest: f64,
}

/// The mean speed over one segment.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Run {
    pub(crate) speed: f64,
    /// How far the speed may be off.
    pub(crate) doubt: f64,
    /// From the middle to either end, s.
    pub(crate) half: f64,
    /// How far that may be off, s.
    pub(crate) half_doubt: f64,
}

/// A stretch of the program over which the speed changed one way.
#[derive(Debug, Clone, Copy, Default)]
struct Stretch {
    /// By how much the speed changed beyond `acceleration · time`.
    ahead: f64,
    change: f64,
    time: f64,
}

/// A stretch over which an axis cannot follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Broken {
    pub(crate) acceleration: f64,
    change: f64,
    time: f64,
}

impl Acceleration {
    /// Returns the check for this printer, at rest.
    #[must_use]
    pub(crate) fn new(printer: &Printer) -> Self {
        Self {
            bed: Axis::new(printer.bed.acceleration, printer.bed_jerk),
            rail: Axis::new(printer.rail.acceleration, printer.rail_jerk),
            last: None,
        }
    }

    pub(crate) fn segment(&mut self, segment: &Segment, doubt: &Doubt, findings: &mut Findings) {
        if segment.duration == 0.0 {
            return;
        }
        let place = Place::end_of(segment);
        if segment.is_paced {
            self.last = Some(place);
            (self.bed, self.rail) = (self.bed.unknown(), self.rail.unknown());
            return;
        }
        let run = |change: f64, last_place: f64| {
            let is_still = segment.path == 0.0;
            let off = if is_still { 0.0 } else { last_place };
            Run {
                speed: change / segment.duration,
                doubt: doubt.of_speed(change, off, segment.duration),
                half: segment.duration / 2.0,
                half_doubt: segment.duration / 2.0 * doubt.duration,
            }
        };
        let bed = self.bed.next(run(segment.bed_change(), doubt.turn));
        let rail = self.rail.next(run(segment.rail_change(), doubt.rail));
        self.last = Some(place);
        self.report(bed, rail, place, findings);
    }

    /// Everything comes to rest.
    pub(crate) fn rest(&mut self, findings: &mut Findings) {
        let (bed, rail) = (self.bed.next(Run::default()), self.rail.next(Run::default()));
        if let Some(place) = self.last {
            self.report(bed, rail, place, findings);
        }
    }

    fn report(
        &self,
        bed: Option<Broken>,
        rail: Option<Broken>,
        place: Place,
        findings: &mut Findings,
    ) {
        for (what, unit, axis, broken) in
            [("the bed", "rad/s", &self.bed, bed), ("the carriage", "mm/s", &self.rail, rail)]
        {
            let Some(Broken { acceleration, change, time }) = broken else { continue };
            let limit = axis.limit;
            findings.error(NAME, place, (acceleration, limit), || {
                let sudden = axis.sudden;
                let ms = time * 1e3;
                format!(
                    "{what} changes its speed by {change:.3} {unit} within {ms:.3} ms; beyond a \
                     sudden {sudden:.3} {unit} that is {acceleration:.1} {unit}², its limit is \
                     {limit:.1} {unit}²"
                )
            });
        }
    }

    /// Returns the greatest acceleration of the bed between neighbouring segments so far, less
    /// what rounding explains, rad/s².
    #[must_use]
    pub(crate) fn greatest_bed(&self) -> f64 {
        self.bed.greatest
    }

    /// Returns the same for the carriage, mm/s².
    #[must_use]
    pub(crate) fn greatest_rail(&self) -> f64 {
        self.rail.greatest
    }
}

impl Axis {
    /// Returns an axis at rest, with its limit and what its speed may change by at once.
    pub(crate) fn new(limit: f64, sudden: f64) -> Self {
        let (last, none) = (Some(Run::default()), Stretch::default());
        Self { limit, sudden, last, faster: none, slower: none, greatest: 0.0 }
    }

    /// The same when nothing is known of how it ran last.
    fn unknown(self) -> Self {
        let none = Stretch::default();
        Self { last: None, faster: none, slower: none, ..self }
    }

    /// The limit that it was given.
    pub(crate) fn limit(&self) -> f64 {
        self.limit
    }

    /// Returns the stretch, ending here, over which it could not follow.
    pub(crate) fn next(&mut self, run: Run) -> Option<Broken> {
        let last = self.last.replace(run)?;
        let time = last.half + run.half;
        if time == 0.0 {
            return None;
        }
        let change = run.speed - last.speed;
        let doubt = last.doubt + run.doubt;
        let most_time = time + last.half_doubt + run.half_doubt;
        self.greatest = self.greatest.max((change.abs() - doubt) / most_time);
        let faster = self.faster.extended(change - doubt, most_time, self.limit);
        let slower = self.slower.extended(-change - doubt, most_time, self.limit);
        (self.faster, self.slower) = (faster, slower);
        for stretch in [&mut self.faster, &mut self.slower] {
            if exceeds(stretch.ahead, self.sudden) {
                let Stretch { change, time, .. } = *stretch;
                // What follows is judged afresh, or one fault would be told at every line.
                *stretch = Stretch::default();
                let acceleration = (change - self.sudden) / time;
                return Some(Broken { acceleration, change, time });
            }
        }
        None
    }
}

impl Stretch {
    /// Returns the worst stretch that ends one line later.
    fn extended(&self, change: f64, time: f64, limit: f64) -> Self {
        let ahead = self.ahead + change - limit * time;
        // Also where it is not a number: that must come out as a finding.
        if ahead <= 0.0 {
            return Self::default();
        }
        Self { ahead, change: self.change + change, time: self.time + time }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{filament_segment, polar_segment, printer};

    /// Runs the bed at 60 mm from the axis through speeds (rad/s), each held for a time (s).
    fn bed(printer: &Printer, speeds: &[(f64, f64)]) -> Vec<f64> {
        let (mut check, mut findings) = (Acceleration::new(printer), Findings::default());
        let mut turn = 0.0;
        for &(speed, time) in speeds {
            let next = turn + speed * time;
            let mut segment = if speed == 0.0 {
                filament_segment(1.0, 1.0 / time)
            } else {
                polar_segment([60.0, turn], [60.0, next], 60.0 * speed.abs())
            };
            segment.line = 1;
            turn = next;
            check.segment(&segment, &Doubt::of(&segment), &mut findings);
        }
        check.rest(&mut findings);
        findings.kept().iter().map(|finding| finding.measured).collect()
    }

    #[test]
    fn from_rest_and_to_rest_within_half_a_segment() {
        // 50 rad/s² for 20 ms gives 1 rad/s.
        let printer = printer();
        assert!(bed(&printer, &[(1.0, 0.04)]).is_empty());
        let found = bed(&printer, &[(1.0, 0.038)]);
        assert_eq!(found.len(), 2);
        assert!((found[0] - 52.6).abs() < 1.0, "{found:?}");
    }

    #[test]
    fn between_neighbours_and_through_stillness() {
        let printer = printer();
        assert!(bed(&printer, &[(1.0, 0.1), (3.0, 0.1), (-1.0, 0.1), (0.0, 0.1)]).is_empty());
        assert_eq!(bed(&printer, &[(2.0, 0.1), (2.0, 0.02), (-1.0, 0.04), (-1.0, 0.1)]).len(), 1);
        // A retraction gives the bed time to stop and start again.
        assert!(bed(&printer, &[(2.0, 0.1), (0.0, 0.1), (-2.0, 0.1)]).is_empty());
        assert_eq!(bed(&printer, &[(2.0, 0.1), (0.0, 0.001), (-2.0, 0.1)]), [] as [f64; 0]);
        let flip = [(2.0, 0.1), (3.0, 0.1), (0.0, 0.001), (-3.0, 0.1), (-2.0, 0.1)];
        assert_eq!(bed(&printer, &flip).len(), 2);
    }

    #[test]
    fn a_sudden_change_is_granted_once() {
        let mut printer = printer();
        printer.bed_jerk = 0.5;
        // Rises of 0.3 rad/s every 2 ms: each alone is a sudden change, together they are not.
        let rise: Vec<(f64, f64)> = (0..20).map(|k| (0.3 + 0.3 * f64::from(k), 0.002)).collect();
        assert!(bed(&printer, &rise[..2]).len() <= 1);
        assert!(!bed(&printer, &rise).is_empty());
        // Up and down again is a zigzag, which never adds up.
        let zigzag: Vec<(f64, f64)> =
            (0..40).map(|k| (0.5 + 0.4 * f64::from(k % 2), 0.02)).collect();
        assert!(bed(&printer, &zigzag).is_empty());
        printer.bed_jerk = 0.0;
        printer.bed.acceleration = 15.0;
        assert!(!bed(&printer, &zigzag).is_empty());
    }

    #[test]
    fn a_line_at_the_firmwares_own_pace_is_not_judged() {
        let run = |is_paced: bool| {
            let (mut check, mut findings) = (Acceleration::new(&printer()), Findings::default());
            for (from, to) in [(20.0, 25.0), (25.0, 26.0), (26.0, 21.0)] {
                let mut segment = polar_segment([from, 0.0], [to, 0.0], 60.0);
                segment.is_paced = is_paced && from == 25.0;
                check.segment(&segment, &Doubt::of(&segment), &mut findings);
            }
            check.rest(&mut findings);
            findings.kept().len()
        };
        assert_eq!((run(false), run(true)), (1, 0));
    }

    #[test]
    fn the_carriage_has_its_own_limit() {
        let printer = printer();
        let run = |feed: f64| {
            let (mut check, mut findings) = (Acceleration::new(&printer), Findings::default());
            for (from, to) in [(20.0, 21.0), (21.0, 20.0)] {
                let segment = polar_segment([from, 0.0], [to, 0.0], feed);
                check.segment(&segment, &Doubt::of(&segment), &mut findings);
            }
            findings.kept().len()
        };
        // From rest, and back: 2·v² mm/s² each.
        assert_eq!((run(27.0), run(28.0)), (0, 2));
    }
}
