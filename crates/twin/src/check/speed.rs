//! Does no axis run faster than it can?
//!
//! Mean speed of bed, carriage, lift and filament over every segment, at the commanded `F`. Allowed on top
//! of the limit is what the [rounding](crate::rounding) of the text can do to that mean.

use machine::profile::Printer;

use crate::finding::{Findings, Place, exceeds};
use crate::rounding::Doubt;
use crate::segment::Segment;

/// The name of this check.
pub const NAME: &str = "speed";

/// The last place of a word of filament, mm.
const FILAMENT: f64 = 1e-5;

/// Judges mean speeds, and remembers the greatest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Speed {
    bed: f64,
    rail: f64,
    lift: f64,
    extruder: f64,
    greatest_bed: f64,
    greatest_rail: f64,
}

impl Speed {
    /// Returns the check for this printer.
    #[must_use]
    pub(crate) fn new(printer: &Printer) -> Self {
        let (bed, rail, lift) = (printer.bed.speed, printer.rail.speed, printer.lift.speed);
        let extruder = printer.extruder_speed;
        Self { bed, rail, lift, extruder, greatest_bed: 0.0, greatest_rail: 0.0 }
    }

    pub(crate) fn segment(&mut self, segment: &Segment, doubt: &Doubt, findings: &mut Findings) {
        if segment.duration == 0.0 {
            return;
        }
        let duration = segment.duration;
        let place = Place::end_of(segment);
        let mut judge = |what: &str, (change, last_place): (f64, f64), limit: f64, unit: &str| {
            let speed = change.abs() / duration;
            if exceeds(speed, limit * (1.0 + doubt.duration) + last_place / duration) {
                findings.error(NAME, place, (speed, limit), || {
                    format!("{what} runs at {speed:.3} {unit}, its limit is {limit:.3} {unit}")
                });
            }
            speed
        };
        let bed = judge("the bed", (segment.bed_change(), doubt.turn), self.bed, "rad/s");
        let rail = judge("the carriage", (segment.rail_change(), doubt.rail), self.rail, "mm/s");
        judge("the lift", (segment.lift_change(), doubt.lift), self.lift, "mm/s");
        judge("the filament", (segment.filament, FILAMENT), self.extruder, "mm/s");
        self.greatest_bed = self.greatest_bed.max(bed);
        self.greatest_rail = self.greatest_rail.max(rail);
    }

    /// Returns the greatest mean speed of the bed so far, rad/s.
    #[must_use]
    pub(crate) fn greatest_bed(&self) -> f64 {
        self.greatest_bed
    }

    /// Returns the greatest mean speed of the carriage so far, mm/s.
    #[must_use]
    pub(crate) fn greatest_rail(&self) -> f64 {
        self.greatest_rail
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{filament_segment, joints, polar_segment, printer, segment};

    fn found(segment: &Segment) -> Vec<f64> {
        let mut findings = Findings::default();
        Speed::new(&printer()).segment(segment, &Doubt::of(segment), &mut findings);
        findings.kept().iter().map(|finding| finding.limit).collect()
    }

    #[test]
    fn each_axis_has_its_limit() {
        // At 20 mm the bed's 6 rad/s are 120 mm/s.
        assert_eq!(found(&polar_segment([20.0, 0.0], [20.0, 1.0], 120.0)), []);
        assert_eq!(found(&polar_segment([20.0, 0.0], [20.0, -1.0], 120.1)), [6.0]);
        assert_eq!(found(&polar_segment([20.0, 0.0], [60.0, 0.0], 150.0)), []);
        assert_eq!(found(&polar_segment([60.0, 0.0], [20.0, 0.0], 150.1)), [150.0]);
        let lift = |feed| segment(joints(20.0, 0.0, 0.2), joints(20.0, 0.0, 1.2), feed);
        assert_eq!(found(&lift(10.0)), []);
        assert_eq!(found(&lift(10.1)), [10.0]);
    }

    #[test]
    fn filament_is_pushed_and_pulled_no_faster_than_its_gear_turns() {
        let limit = printer().extruder_speed;
        assert_eq!(found(&filament_segment(2.0, limit)), []);
        assert_eq!(found(&filament_segment(2.0, 1.01 * limit)), [limit]);
        assert_eq!(found(&filament_segment(-2.0, 1.01 * limit)), [limit]);
        // Along a line as well: 10 mm in a tenth of a second, with more filament than way.
        let mut line = polar_segment([20.0, 0.0], [30.0, 0.0], 100.0);
        line.filament = 0.1 * limit;
        assert_eq!(found(&line), []);
        line.filament *= 1.01;
        assert_eq!(found(&line), [limit]);
    }

    #[test]
    fn rounding_is_no_fault() {
        // 0.9 mm at the limit, read back from rounded words: the mean may be a little above.
        let exact = polar_segment([15.0, 0.0], [14.999_6, 0.060_000_4], 90.0);
        assert!(exact.bed_change() / exact.duration > 6.0);
        assert_eq!(found(&exact), []);
        assert_eq!(found(&polar_segment([15.0, 0.0], [15.0, 0.06], 90.3)), [6.0]);
    }
}
