//! Is a solid print solid?
//!
//! Where a bead is laid over empty space (see `pile`) and the place halfway down the layer below
//! belongs to the part, the space is hollow; each place counts once in a line. A layer may leave [`MOST_HOLLOW`] hollow: the corners that no round bead
//! reaches. mm³, part frame.

use nalgebra::center;

use crate::check::support::Step;
use crate::finding::{Findings, Place};
use crate::pile::{CELL, Opening};

/// The name of this check.
pub const NAME: &str = "coverage";

/// How much of a layer may lie over empty space inside the part, as a share of what it covers.
pub const MOST_HOLLOW: f64 = 0.05;

/// And at least this much of it, mm²: a bead of 0.45 mm that is missing over 4 mm.
pub const LEAST_AREA: f64 = 2.0;

/// Ground that is tilted against a bead, as a flat floor is under a wedge, lies below one side of it
/// and above the other, and what is too much there fills what is missing here. So much may be missing
/// on the whole, as a share of the bead's thickness.
const TILTED: f64 = 0.1;

/// Sums the hollow space under each layer.
#[derive(Debug, Default)]
pub(crate) struct Hollow {
    sum: f64,
    covered: u64,
    open: u64,
    /// The piece of the layer over the most empty space.
    worst: Option<(u32, Place)>,
}

impl Hollow {
    /// A bead `thickness` thick goes on by a piece over these openings into the part.
    pub(crate) fn piece(&mut self, step: &Step, openings: &[Opening], thickness: f64) {
        let footing = &step.footing;
        self.covered += u64::from(footing.covered - footing.own);
        let lacking: f64 = openings.iter().map(|opening| opening.depth).sum();
        let cells = f64::from(footing.resting) + openings.len() as f64;
        if footing.lacking + lacking <= TILTED * thickness * cells {
            return;
        }
        let mut open = 0;
        for opening in openings.iter().filter(|opening| opening.is_new) {
            open += 1;
            self.sum += opening.depth * CELL * CELL;
        }
        self.open += u64::from(open);
        if open > 0 && self.worst.is_none_or(|(most, _)| open > most) {
            let at = center(&step.ends[0], &step.ends[1]);
            let place = Place { line: step.line, layer: step.layer, at: Some(at) };
            self.worst = Some((open, place));
        }
    }

    /// Judges the layer that ends.
    pub(crate) fn end_of_layer(&mut self, findings: &mut Findings) {
        let (covered, open) = (self.covered as f64, self.open as f64);
        (self.covered, self.open) = (0, 0);
        let Some((_, place)) = self.worst.take() else { return };
        let area = open * CELL * CELL;
        let share = open / covered;
        if share > MOST_HOLLOW && area > LEAST_AREA {
            findings.warning(NAME, place, (share, MOST_HOLLOW), || {
                format!(
                    "{area:.1} mm² of the layer, {:.1} % of it, lie over holes in a part that is \
                     meant to be solid",
                    100.0 * share
                )
            });
        }
    }

    /// Returns the hollow space so far, mm³.
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
    fn holes_are_found_and_what_is_laid_twice_counts_once() {
        let (mut check, mut findings) = (Hollow::default(), Findings::default());
        let ends = [Point3::origin(), Point3::new(0.5, 0.0, 0.0)];
        let mut layer = |open: u32, own: u32| {
            for line in 0..200 {
                let open = if line % 10 == 0 { open } else { 0 };
                let footing = Footing {
                    covered: 25 + own,
                    own,
                    resting: 25 + own - open,
                    ..Footing::default()
                };
                let step =
                    Step { line, layer: None, ends, footing, is_inside: true, is_support: false };
                let opening = Opening { below: Point3::origin(), depth: 0.2, is_new: true };
                check.piece(&step, &vec![opening; open as usize], 0.2);
            }
            check.end_of_layer(&mut findings);
            findings.kept().len()
        };
        // 4 % are open, then 10 %; ground that a line covers again makes neither more nor less.
        assert_eq!([layer(10, 0), layer(10, 20), layer(25, 0), layer(25, 20)], [0, 0, 1, 2]);
        assert!((check.sum() - 20.0 * 0.2 * CELL * CELL * 70.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_too_much_on_one_side_fills_the_other() {
        let hollow = |lacking: f64| {
            let mut check = Hollow::default();
            let footing = Footing { covered: 20, resting: 12, lacking, ..Footing::default() };
            let ends = [Point3::origin(), Point3::new(0.5, 0.0, 0.0)];
            let step =
                Step { line: 1, layer: None, ends, footing, is_inside: true, is_support: false };
            let opening = Opening { below: Point3::origin(), depth: 0.13, is_new: true };
            check.piece(&step, &[opening; 8], 0.2);
            check.sum()
        };
        // A wedge: as much as is missing in eight cells rises above the bottom in the others.
        assert_eq!(hollow(-8.0 * 0.13), 0.0);
        // Flat ground beside a hole.
        assert!((hollow(0.0) - 8.0 * 0.13 * CELL * CELL).abs() < 1e-12);
    }
}
