//! Does everything keep clear of the rotation axis?
//!
//! Where the carriage cannot pass the centre, a move that comes near the axis makes the bed turn
//! at `v/d`, and Klipper aborts the print on one that meets it. So no point of any segment, travels
//! included, may be nearer than the printer's clearance; not only the ends, since a move between
//! two far ends can pass close by. Where the carriage can pass, bed speed and acceleration are the
//! only limits there are.

use machine::profile::Printer;

use crate::finding::{Findings, Place, exceeds};
use crate::rounding;
use crate::segment::Segment;

/// The name of this check.
pub const NAME: &str = "axis";

/// How much nearer than the clearance a chord between two points at the clearance may come in part
/// coordinates, mm: twice the usual distance between a path and its chord. Below it, detours round
/// the axis would be refused; 0.01 mm changes the bed's speed at a clearance of 0.5 mm by 2 %.
const CHORD: f64 = 0.01;

/// Judges how near segments come.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Clearance {
    /// `None` when the carriage can pass the centre.
    least: Option<f64>,
}

impl Clearance {
    /// Returns the check for this printer.
    #[must_use]
    pub(crate) fn new(printer: &Printer) -> Self {
        Self { least: (!printer.passes_centre()).then_some(printer.axis_clearance) }
    }

    pub(crate) fn segment(&self, segment: &Segment, findings: &mut Findings) {
        let Some(least) = self.least else { return };
        let chord = if segment.joints.is_some() { 0.0 } else { CHORD };
        let slack = rounding::last_place(least) + chord;
        if exceeds(least - slack, segment.nearest) {
            let nearest = segment.nearest;
            findings.error(NAME, Place::end_of(segment), (nearest, least), || {
                format!(
                    "the nozzle comes to {nearest:.4} mm of the rotation axis on the way here, \
                     must keep {least} mm clear"
                )
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{part_segment, polar_segment, printer};
    use nalgebra::Point3;

    fn count(printer: &Printer, segment: &Segment) -> usize {
        let mut findings = Findings::default();
        Clearance::new(printer).segment(segment, &mut findings);
        findings.kept().len()
    }

    #[test]
    fn between_the_ends_as_well() {
        let printer = printer();
        assert_eq!(count(&printer, &polar_segment([5.0, 0.0], [0.5, 1.0], 10.0)), 0);
        assert_eq!(count(&printer, &polar_segment([5.0, 0.0], [0.49, 1.0], 10.0)), 1);
        assert_eq!(count(&printer, &polar_segment([5.0, 0.0], [-5.0, 0.0], 10.0)), 1);
        let past = |x: f64| part_segment(Point3::new(x, -8.0, 1.0), Point3::new(x, 8.0, 1.0));
        assert_eq!(count(&printer, &past(0.5)), 0);
        assert_eq!(count(&printer, &past(0.4)), 1);
        assert_eq!(count(&printer, &past(f64::NAN)), 1);
    }

    #[test]
    fn a_carriage_that_passes_the_centre_may() {
        let mut printer = printer();
        printer.rail.min = -20.0;
        assert_eq!(count(&printer, &polar_segment([5.0, 0.0], [-5.0, 0.0], 10.0)), 0);
    }
}
