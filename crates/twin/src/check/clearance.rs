//! Do nozzle and hot end stay clear of everything that was printed before?
//!
//! The outline of nozzle and block from the printer's profile stands over the tip every
//! [`crate::check::support::PIECE`] of the way, travels included, and is compared with the heights
//! of what was laid (see `pile`).
//!
//! * The flat face may press [`PRESSED`] layers deep into earlier layers: it irons what is uphill of
//!   it. What the present layer laid is soft, and the face drags through it wherever a
//!   layer slopes; that is not judged.
//! * Cone and block may touch what earlier layers laid beyond the face to [`TOUCHED`], and what the
//!   present layer laid beyond [`SOFT`] faces.
//!
//! mm, part frame.

use machine::profile::{NozzleShape, Printer};
use nalgebra::Point3;

use crate::finding::{Findings, Place};
use crate::pile::{CELL, Peak, Pile};

/// The name of this check.
pub const NAME: &str = "clearance";

/// How deep the rim of the face may press into earlier layers, in layers: it then still runs on
/// the layer below.
pub const PRESSED: f64 = 1.0;

/// How deep cone and block may reach into what was laid, mm: half a layer, and what a cell of the
/// pile rises on a slope of 45°.
pub const TOUCHED: f64 = 0.1 + CELL;

/// How far around the nozzle what the present layer laid is soft, in radii of the face.
pub const SOFT: f64 = 2.0;

/// After so many findings no more are looked for: the program is unprintable, and each costs time.
pub const ENOUGH: usize = 1000;

/// Judges places of the nozzle.
#[derive(Debug)]
pub(crate) struct Clear {
    nozzle: NozzleShape,
    deepest: f64,
    found: usize,
}

impl Clear {
    /// Returns the check for this printer.
    pub(crate) fn new(printer: &Printer) -> Self {
        Self { nozzle: printer.nozzle, deepest: 0.0, found: 0 }
    }

    /// The tip stands at `tip` while a layer `thickness` thick is printed.
    pub(crate) fn tip(
        &mut self,
        tip: &Point3<f64>,
        (layer, thickness): (u32, f64),
        place: Place,
        pile: &Pile,
        findings: &mut Findings,
    ) {
        if pile.greatest() <= tip.z || self.found >= ENOUGH {
            return;
        }
        let face = self.nozzle.flat_radius;
        let pressed = pile.peak(&tip.xy(), face, Some(layer), |_| tip.z);
        self.judge("the face of the nozzle", pressed, PRESSED * thickness, place, findings);
        let outline = |distance: f64| tip.z + self.nozzle.height(distance).max(thickness);
        // Under the face the cone is as high as at its rim.
        let rim = |rim: f64| move |distance: f64| outline(distance.max(rim));
        let radius = self.nozzle.block_radius;
        let earlier = pile.peak(&tip.xy(), radius, Some(layer), rim(face + CELL));
        let present = pile.peak(&tip.xy(), radius, None, rim(SOFT * face));
        let hit = match (earlier, present) {
            (Some(a), Some(b)) => Some(if b.above > a.above { b } else { a }),
            (a, b) => a.or(b),
        };
        self.judge("the hot end", hit, TOUCHED, place, findings);
    }

    fn judge(
        &mut self,
        what: &str,
        peak: Option<Peak>,
        limit: f64,
        place: Place,
        findings: &mut Findings,
    ) {
        let Some(Peak { above, at }) = peak else { return };
        self.deepest = self.deepest.max(above);
        if above <= limit {
            return;
        }
        self.found += 1;
        findings.warning(NAME, place, (above, limit), || {
            format!(
                "{what} reaches {above:.2} mm into what is printed at x {:.1} y {:.1} z {:.2}, at \
                 most {limit:.2} mm",
                at.x, at.y, at.z
            )
        });
    }

    /// Returns how deep the nozzle reached into what was printed, mm.
    pub(crate) fn deepest(&self) -> f64 {
        self.deepest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::Family;
    use crate::pile::Piece;
    use crate::sample::printer;

    /// A wall 10 mm long along x at y = 0 up to `top`, and the tip at `tip`; what is found.
    fn found(top: f64, tip: [f64; 3]) -> Vec<String> {
        let mut pile = Pile::new(60.0);
        pile.lay(&Piece {
            ends: [Point3::new(-5.0, 0.0, top), Point3::new(5.0, 0.0, top)],
            half_width: 0.225,
            thickness: 0.2,
            family: Family::Planar,
            layer: 3,
            stroke: 0,
        });
        let (mut check, mut findings) = (Clear::new(&printer()), Findings::default());
        let place = Place::line(1, None);
        check.tip(&Point3::from(tip), (4, 0.2), place, &pile, &mut findings);
        findings.kept().iter().map(|finding| finding.message.clone()).collect()
    }

    #[test]
    fn each_part_of_the_hot_end_is_clear_or_not() {
        assert!(found(5.0, [0.0, 0.0, 5.0]).is_empty());
        assert!(found(5.0, [0.0, 0.3, 4.81]).is_empty());
        assert!(found(5.0, [0.0, 0.3, 4.7])[0].starts_with("the face of the nozzle reaches 0.30"));
        // 2 mm beside the wall the cone is 1.35 / tan 30° = 2.3 mm above the tip.
        assert!(found(5.0, [0.0, 2.0, 3.0]).is_empty());
        assert!(found(5.0, [0.0, 2.0, 2.0])[0].starts_with("the hot end reaches 0.6"));
        // The block, 12 mm up, reaches 20 mm out.
        assert!(found(15.0, [0.0, 15.0, 3.2]).is_empty());
        assert!(found(15.0, [0.0, 15.0, 2.5])[0].starts_with("the hot end reaches 0.50"));
        assert!(found(15.0, [0.0, 20.4, 2.5]).is_empty());
    }
}
