//! Is every bead as thick as its layer and as wide as announced?
//!
//! The filament of a segment over its length is the cross-section of its bead; announced are width
//! and thickness, which make a rectangle with half-round sides, `t·(w − t·(1 − π/4))`. On planar
//! layers the two agree to [`OFF`], the rounding of both, and of `;WIDTH:` to 0.01 mm. Beads of
//! curved layers may be from [`THINNEST`] to [`THICKEST`] of their layer, as wedges on a flat floor
//! are; over all of them the middle one agrees to [`OFF`]. Lines that go round the axis are shorter
//! or longer than what they stand for, and are not judged. mm.

use machine::profile::Printer;
use machine::program::Role;

use crate::check::surface::ROUND_AXIS;
use crate::family::Family;
use crate::finding::{Findings, Place, exceeds};
use crate::replay::LayerMark;
use crate::rounding::Doubt;
use crate::segment::Segment;

/// The name of this check.
pub const NAME: &str = "flow";

/// How much more or less than announced the cross-section may be, as a share: less than what shows on
/// a wall.
pub const OFF: f64 = 0.03;

/// The thinnest wedge, as a share of its layer. Half, less what its width is rounded by.
pub const THINNEST: f64 = 0.45;

/// The thickest wedge, likewise.
pub const THICKEST: f64 = 1.6;

/// Half the last place of `;WIDTH:`, mm.
const WIDTH: f64 = 0.005;

/// The last place of a word of filament, mm.
const FILAMENT: f64 = 1e-5;

/// Shares are counted in classes of this width, to find the middle one.
const CLASS: f64 = 0.005;

/// Compares cross-sections.
#[derive(Debug)]
pub(crate) struct Flow {
    filament_area: f64,
    /// Nearer to the axis nothing is judged, mm.
    round_axis: f64,
    mark: Option<LayerMark>,
    /// Length of the beads of curved layers by their share of what is announced.
    classes: Vec<f64>,
}

impl Flow {
    /// Returns the check for this printer and filament of this cross-section, mm².
    pub(crate) fn new(printer: &Printer, filament_area: f64) -> Self {
        let round_axis = ROUND_AXIS * printer.axis_clearance;
        Self { filament_area, round_axis, mark: None, classes: Vec::new() }
    }

    pub(crate) fn layer(&mut self, mark: LayerMark) {
        self.mark = Some(mark);
    }

    pub(crate) fn segment(&mut self, segment: &Segment, doubt: &Doubt, findings: &mut Findings) {
        let Some(mark) = self.mark else { return };
        let Some(height) = mark.height.filter(|height| *height > 0.0) else { return };
        if !segment.extrudes() || segment.role == Role::Custom || segment.width <= 0.0 {
            return;
        }
        if segment.nearest < self.round_axis {
            return;
        }
        let announced = area(segment.width, height);
        let share = segment.filament * self.filament_area / segment.path / announced;
        let rounded = doubt.duration
            + FILAMENT / segment.filament
            + (area(segment.width + WIDTH, height) / announced - 1.0);
        let is_planar = mark.family.unwrap_or_default() == Family::Planar;
        let [least, most] = if is_planar { [1.0 - OFF, 1.0 + OFF] } else { [THINNEST, THICKEST] };
        if exceeds(share, most + rounded) || exceeds(least - rounded, share) {
            let limit = if share > most { most } else { least };
            findings.warning(NAME, Place::end_of(segment), (share, limit), || {
                format!(
                    "a bead has {:.1} % of its announced cross-section of {announced:.4} mm²",
                    100.0 * share
                )
            });
        }
        if !is_planar && share.is_finite() {
            let class = (share.min(THICKEST) / CLASS) as usize;
            if self.classes.len() <= class {
                self.classes.resize(class + 1, 0.0);
            }
            self.classes[class] += segment.path;
        }
    }

    /// Ends the program.
    pub(crate) fn end(&self, place: Place, findings: &mut Findings) {
        let whole: f64 = self.classes.iter().sum();
        let mut below = 0.0;
        let middle = self.classes.iter().position(|length| {
            below += length;
            below > whole / 2.0
        });
        let Some(middle) = middle else { return };
        let share = (middle as f64 + 0.5) * CLASS;
        if exceeds((share - 1.0).abs(), OFF) {
            findings.warning(NAME, place, (share, 1.0), || {
                format!("beads of curved layers have {:.1} % of what is announced", 100.0 * share)
            });
        }
    }
}

fn area(width: f64, thickness: f64) -> f64 {
    thickness * (width - thickness * (1.0 - std::f64::consts::FRAC_PI_4))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{part_segment, printer};
    use nalgebra::Point3;

    /// What is found of ten beads with this share of the announced cross-section.
    fn found(share: f64, family: Option<Family>) -> Vec<f64> {
        let (mut check, mut findings) =
            (Flow::new(&Printer { axis_clearance: 0.02, ..printer() }, 2.0), Findings::default());
        check.layer(LayerMark { line: 1, index: 0, top: None, height: Some(0.2), family });
        for k in 0..10 {
            let at = |x: f64| Point3::new(x, 5.0 + f64::from(k), 0.2);
            let mut segment = part_segment(at(0.0), at(2.0));
            segment.role = Role::Perimeter;
            segment.filament = share * area(0.45, 0.2) * 2.0 / 2.0;
            check.segment(&segment, &Doubt::of(&segment), &mut findings);
        }
        check.end(Place::line(9, None), &mut findings);
        findings.kept().iter().map(|finding| finding.limit).collect()
    }

    #[test]
    fn planar_beads_have_what_is_announced() {
        assert!(found(1.0, None).is_empty() && found(1.025, None).is_empty());
        assert_eq!(found(1.06, None), [1.0 + OFF; 10]);
        assert_eq!(found(0.94, None), [1.0 - OFF; 10]);
    }

    #[test]
    fn wedges_are_thinner_and_thicker_but_not_most_beads() {
        let cone = Some(Family::Conical { slope: 0.5 });
        assert!(found(1.02, cone).is_empty());
        assert_eq!(found(1.06, cone), [1.0]);
        assert_eq!(found(0.3, cone).len(), 11);
        assert_eq!(found(1.9, cone).len(), 11);
    }
}
