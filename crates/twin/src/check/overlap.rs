//! Is no bead laid where its layer has one already?
//!
//! Neighbours share a tenth of their width, and more where a wall closes on itself or fill ends in
//! a wall. A piece of which more than [`MOST_SHARE`] lies where another line of the same layer does
//! is laid twice; [`LONGEST`] of such pieces in a row are found. Gap fill is not looked at: it lies
//! between the round sides of its neighbours. mm, part frame.

use crate::check::support::Step;
use crate::finding::{Findings, Place};

/// The name of this check.
pub const NAME: &str = "overlap";

/// The share of a piece that may lie on a line of the same layer.
pub const MOST_SHARE: f64 = 0.8;

/// Length of what may be laid twice, mm: fill runs along a wall from one of its lines to the next.
pub const LONGEST: f64 = 10.0;

/// Follows a line from piece to piece.
#[derive(Debug, Default)]
pub(crate) struct Overlap {
    run: Option<(Place, f64)>,
    sum: f64,
}

impl Overlap {
    /// A line goes on by a piece.
    pub(crate) fn piece(&mut self, step: &Step, findings: &mut Findings) {
        if step.footing.taken_share() <= MOST_SHARE {
            self.end(findings);
            return;
        }
        let [from, to] = step.ends;
        let place = Place { line: step.line, layer: step.layer, at: Some(from) };
        let run = self.run.get_or_insert((place, 0.0));
        run.1 += (to - from).norm();
    }

    /// The line ends.
    pub(crate) fn end(&mut self, findings: &mut Findings) {
        let Some((place, length)) = self.run.take() else { return };
        if length <= LONGEST {
            return;
        }
        self.sum += length;
        findings.warning(NAME, place, (length, LONGEST), || {
            format!("{length:.1} mm of a bead lie where the layer has one already")
        });
    }

    /// Returns the length of what was laid twice so far, mm.
    pub(crate) fn sum(&self) -> f64 {
        self.sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pile::Footing;
    use nalgebra::Point3;

    #[test]
    fn a_line_laid_twice_is_found_and_a_crossing_is_not() {
        let (mut check, mut findings) = (Overlap::default(), Findings::default());
        let mut line = |taken: &[u32]| {
            for (k, &taken) in taken.iter().enumerate() {
                let at = |k: usize| Point3::new(0.5 * k as f64, 0.0, 1.0);
                let footing = Footing { covered: 10, taken, ..Footing::default() };
                let step = Step {
                    line: k,
                    layer: Some(1),
                    ends: [at(k), at(k + 1)],
                    footing,
                    is_inside: false,
                    is_support: false,
                };
                check.piece(&step, &mut findings);
            }
            check.end(&mut findings);
            findings.kept().len()
        };
        assert_eq!(line(&[4; 30]), 0);
        assert_eq!(line(&[10, 10, 10, 0, 10, 10, 10]), 0);
        assert_eq!(line(&[10; 20]), 0);
        assert_eq!(line(&[10; 21]), 1);
        assert_eq!(check.sum(), 10.5);
    }
}
