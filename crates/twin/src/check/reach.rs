//! Does the machine get everywhere it is sent?
//!
//! Carriage and lift run linearly between the ends of a move, so their ends suffice. In part
//! coordinates the firmware decides where the carriage stands; there the distance from the axis
//! must not exceed that of a carriage at the end of its rail. Firmwares clamp or drop what is out
//! of reach in silence.

use machine::kinematics::Alignment;
use machine::profile::{Axis, Printer};
use machine::program::{BedTurn, Joints};

use crate::finding::{Findings, Place, exceeds};
use crate::rounding;
use crate::segment::Segment;

/// The name of this check.
pub const NAME: &str = "reach";

/// Judges where segments end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    rail: Axis,
    lift: Axis,
    alignment: Alignment,
}

impl Reach {
    /// Returns the check for this printer.
    #[must_use]
    pub(crate) fn new(printer: &Printer) -> Self {
        Self { rail: printer.rail, lift: printer.lift, alignment: printer.alignment }
    }

    pub(crate) fn segment(&self, segment: &Segment, findings: &mut Findings) {
        let place = Place::end_of(segment);
        match &segment.joints {
            Some([_, to]) => axis("the carriage", "the rail", to.s, &self.rail, place, findings),
            None => self.radius(segment, place, findings),
        }
        axis("the nozzle", "the lift", segment.part[1].z, &self.lift, place, findings);
    }

    fn radius(&self, segment: &Segment, place: Place, findings: &mut Findings) {
        let z = segment.part[1].z;
        let outermost = Joints { s: self.rail.max, turn: BedTurn::default(), z };
        let part = self.alignment.part_from_joints(&outermost);
        let limit = self.alignment.over_bed(&part.xy()).norm();
        let radius = segment.curve.radius(1.0);
        if exceeds(radius, limit + rounding::LENGTH) {
            findings.error(NAME, place, (radius, limit), || {
                format!("{radius:.3} mm from the axis, the rail reaches to {limit:.3} mm")
            });
        }
    }
}

fn axis(
    what: &str,
    range: &str,
    position: f64,
    axis: &Axis,
    place: Place,
    findings: &mut Findings,
) {
    let slack = rounding::LENGTH / 2.0;
    let limit = if position < axis.min { axis.min } else { axis.max };
    if exceeds(axis.min - slack, position) || exceeds(position, axis.max + slack) {
        findings.error(NAME, place, (position, limit), || {
            let (min, max) = (axis.min, axis.max);
            format!("{what} at {position:.3} mm, {range} reaches from {min} to {max} mm")
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{joints, part_segment, printer, segment};
    use nalgebra::Point3;

    fn found(segment: &Segment) -> Vec<(f64, f64)> {
        let mut findings = Findings::default();
        Reach::new(&printer()).segment(segment, &mut findings);
        findings.kept().iter().map(|finding| (finding.measured, finding.limit)).collect()
    }

    #[test]
    fn carriage_and_lift_keep_to_their_range() {
        let to = |s, z| segment(joints(60.0, 0.0, 1.0), joints(s, 1.0, z), 50.0);
        assert_eq!(found(&to(120.0, 150.0)), []);
        assert_eq!(found(&to(120.000_4, 0.0)), []);
        assert_eq!(found(&to(120.002, 0.0)), [(120.002, 120.0)]);
        assert_eq!(found(&to(-0.5, 0.2)), [(-0.5, 0.0)]);
        assert_eq!(found(&to(50.0, -0.01)), [(-0.01, 0.0)]);
        assert_eq!(found(&to(f64::NAN, 0.2)).len(), 1);
        assert_eq!(found(&to(121.0, 151.0)).len(), 2);
    }

    #[test]
    fn part_coordinates_keep_to_the_radius() {
        let to = |x, y| part_segment(Point3::new(3.0, 4.0, 1.0), Point3::new(x, y, 1.0));
        assert_eq!(found(&to(-72.0, 96.0)), []);
        assert_eq!(found(&to(-72.1, 96.0)).len(), 1);
        assert_eq!(found(&to(f64::INFINITY, 0.0)).len(), 1);
    }
}
