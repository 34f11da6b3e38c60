//! Are nozzle and bed as warm as they must be, never warmer than they may, and cold at the end?
//!
//! Only commands are seen, not temperatures. So a nozzle is taken to be warm enough when a wait
//! (`M109`) was for a temperature at which it may extrude, and no lower one was commanded since.

use machine::profile::Printer;

use crate::finding::{Findings, Place, exceeds};
use crate::replay::Heating;
use crate::segment::Segment;

/// The name of this check.
pub const NAME: &str = "heat";

/// Follows the temperatures commanded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Heat {
    nozzle_max: f64,
    bed_max: f64,
    extrudes_from: f64,
    nozzle: f64,
    /// The temperature that the nozzle certainly has, °C.
    certain: f64,
    bed: f64,
    /// Whether a converted program has said nothing of heat so far.
    says_nothing: bool,
}

impl Heat {
    /// Returns the check for this printer, with everything cold.
    #[must_use]
    pub(crate) fn new(printer: &Printer) -> Self {
        Self {
            nozzle_max: printer.nozzle_temperature_max,
            bed_max: printer.bed_temperature_max,
            extrudes_from: printer.nozzle_temperature_min_extrude,
            nozzle: 0.0,
            certain: 0.0,
            bed: 0.0,
            says_nothing: false,
        }
    }

    pub(crate) fn nozzle(&mut self, heating: Heating, place: Place, findings: &mut Findings) {
        if std::mem::take(&mut self.says_nothing) {
            self.certain = 0.0;
        }
        self.nozzle = heating.target;
        self.certain =
            if heating.waits { heating.target } else { self.certain.min(heating.target) };
        range("the nozzle", heating.target, self.nozzle_max, place, findings);
    }

    pub(crate) fn bed(&mut self, heating: Heating, place: Place, findings: &mut Findings) {
        self.bed = heating.target;
        range("the bed", heating.target, self.bed_max, place, findings);
    }

    /// The program was made by somebody who need not heat in it: until it says anything of heat, nobody
    /// knows how warm the nozzle is.
    pub(crate) fn is_converted(&mut self) {
        (self.certain, self.says_nothing) = (f64::INFINITY, true);
    }

    /// Something was commanded of which nobody knows whether it heats or cools.
    pub(crate) fn unknown(&mut self) {
        (self.certain, self.nozzle, self.bed) = (f64::INFINITY, 0.0, 0.0);
    }

    pub(crate) fn segment(&mut self, segment: &Segment, findings: &mut Findings) {
        if segment.filament > 0.0 && exceeds(self.extrudes_from, self.certain) {
            let (is, least) = (self.certain, self.extrudes_from);
            findings.error(NAME, Place::end_of(segment), (is, least), || {
                format!(
                    "filament is pushed into a nozzle that was last waited for at {is} °C, \
                     it needs at least {least} °C"
                )
            });
        }
    }

    pub(crate) fn end(&self, place: Place, findings: &mut Findings) {
        for (what, target) in [("the nozzle", self.nozzle), ("the bed", self.bed)] {
            if target != 0.0 {
                findings.error(NAME, place, (target, 0.0), || {
                    format!("the program ends with {what} still set to {target} °C")
                });
            }
        }
    }
}

fn range(what: &str, target: f64, limit: f64, place: Place, findings: &mut Findings) {
    if exceeds(target, limit) {
        findings.error(NAME, place, (target, limit), || {
            format!("{what} is set to {target} °C, its limit is {limit} °C")
        });
    } else if exceeds(0.0, target) {
        findings.error(NAME, place, (target, 0.0), || {
            format!("{what} is set to {target} °C, below zero")
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{filament_segment, printer};

    enum Act {
        Nozzle(f64),
        NozzleWait(f64),
        Bed(f64),
        Feed(f64),
    }

    fn found(acts: &[Act]) -> Vec<(f64, f64)> {
        let (mut check, mut findings) = (Heat::new(&printer()), Findings::default());
        let place = Place::line(1, None);
        let set = |target, waits| Heating { target, waits };
        for act in acts {
            match act {
                Act::Nozzle(t) => check.nozzle(set(*t, false), place, &mut findings),
                Act::NozzleWait(t) => check.nozzle(set(*t, true), place, &mut findings),
                Act::Bed(t) => check.bed(set(*t, false), place, &mut findings),
                Act::Feed(e) => check.segment(&filament_segment(*e, 5.0), &mut findings),
            }
        }
        check.end(place, &mut findings);
        findings.kept().iter().map(|finding| (finding.measured, finding.limit)).collect()
    }

    #[test]
    fn a_converted_program_may_leave_heat_to_its_user_but_not_begin_halfway() {
        let place = Place::line(1, None);
        for (heating, n) in [(None, 0), (Some((20.0, true)), 1), (Some((210.0, false)), 1)] {
            let (mut check, mut findings) = (Heat::new(&printer()), Findings::default());
            check.is_converted();
            if let Some((target, waits)) = heating {
                check.nozzle(Heating { target, waits }, place, &mut findings);
            }
            check.segment(&filament_segment(1.0, 5.0), &mut findings);
            assert_eq!(findings.kept().len(), n, "{heating:?}");
        }
    }

    #[test]
    fn a_sound_print_and_its_faults() {
        use Act::{Bed, Feed, Nozzle, NozzleWait};
        let off = || [Nozzle(0.0), Bed(0.0)];
        let run = |mut acts: Vec<Act>| {
            acts.extend(off());
            found(&acts)
        };
        assert!(
            run(vec![Bed(60.0), NozzleWait(210.0), Feed(1.0), Nozzle(200.0), Feed(1.0)]).is_empty()
        );
        assert!(run(vec![NozzleWait(210.0), Feed(1.0), Nozzle(0.0), Feed(-1.0)]).is_empty());
        assert_eq!(run(vec![NozzleWait(261.0)]), [(261.0, 260.0)]);
        assert_eq!(run(vec![Nozzle(-5.0)]), [(-5.0, 0.0)]);
        assert_eq!(run(vec![Bed(110.5)]), [(110.5, 110.0)]);
        assert_eq!(run(vec![Nozzle(210.0), Feed(1.0)]), [(0.0, 170.0)]);
        assert_eq!(run(vec![NozzleWait(210.0), Nozzle(150.0), Feed(1.0)]), [(150.0, 170.0)]);
        assert_eq!(found(&[NozzleWait(210.0), Bed(60.0)]), [(210.0, 0.0), (60.0, 0.0)]);
    }
}
