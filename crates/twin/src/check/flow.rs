//! Is every bead as thick as its layer and as wide as announced?
//!
//! The filament of a segment over its length is the cross-section of its bead; announced are width
//! and thickness, which make a rectangle with half-round sides, `t·(w − t·(1 − π/4))`.
//!
//! * Of each role the middle bead of the planar layers agrees to [`OFF`].
//! * One by one they may differ by [`DRIFT`], as a width that changes along a line is announced in
//!   steps, and by the volumes [`BLOB`] and [`LACK`], which nobody sees.
//! * Beads of curved layers may be from [`THINNEST`] to [`THICKEST`] of their layer where they are
//!   wedges on the flat layers below, and wherever the layer below is of another shape, as in a blend.
//!   Higher up they are as thick as their layer, of caps as thick as these are there. Wedges fill as
//!   well what curved layers leave below the first planar one on them; along their normal, that is.
//!
//! No line asks for more volume in a second than melts, where its speed is its own: at the pace of a
//! firmware, within a few mm of the axis, the top speed is only a bound, which ramps never reach.
//!
//! Lines that go round the axis are shorter or longer than what they stand for, and are not judged.
//! mm.

use machine::kinematics::Alignment;
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

/// How much more or less than announced the middle bead of a role may be, as a share: less than what
/// shows on a wall.
pub const OFF: f64 = 0.03;

/// The most that a bead may hold beyond that, mm³: a ball of 0.34 mm, less than a bead's width.
pub const BLOB: f64 = 0.02;

/// The most that it may lack, mm³: 0.06 mm of a wall.
pub const LACK: f64 = 0.005;

/// How much any bead of a planar layer may be, besides the rounding of `;WIDTH:` to 0.01 mm.
pub const DRIFT: f64 = 0.15;

/// Roles with less than this are not judged by their middle bead, mm: of a few beads that is
/// chance.
pub const TELLING: f64 = 200.0;

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
    alignment: Alignment,
    filament_area: f64,
    /// mm³/s.
    volume_per_second: f64,
    /// What nozzle and carriage keep from the axis, mm.
    clearance: f64,
    mark: Option<LayerMark>,
    /// The curved family that this planar layer lies on.
    ground: Option<Family>,
    /// The top of the last planar layer, mm: curved layers end on it in wedges.
    floor: f64,
    /// Whether the layer below is one of the same family.
    goes_on: bool,
    /// Length of the planar beads of each role by their share of what is announced.
    classes: [Vec<f64>; Role::ALL.len()],
}

impl Flow {
    /// Returns the check for this printer and filament of this cross-section, mm², of which so much
    /// melts, mm³/s.
    pub(crate) fn new(printer: &Printer, filament_area: f64, volume_per_second: f64) -> Self {
        Self {
            alignment: printer.alignment,
            filament_area,
            volume_per_second,
            clearance: printer.axis_clearance,
            mark: None,
            ground: None,
            floor: 0.0,
            goes_on: false,
            classes: Default::default(),
        }
    }

    pub(crate) fn layer(&mut self, mark: LayerMark) {
        let family = |mark: LayerMark| mark.family.unwrap_or_default();
        let before = self.mark.map(family).unwrap_or_default();
        let begins = family(mark) == Family::Planar && before != Family::Planar;
        self.ground = begins.then_some(before);
        if family(mark) == Family::Planar {
            self.floor = mark.top.unwrap_or(f64::INFINITY);
        }
        self.goes_on = before == Family::Planar || before == family(mark);
        self.mark = Some(mark);
    }

    pub(crate) fn segment(&mut self, segment: &Segment, doubt: &Doubt, findings: &mut Findings) {
        self.melts(segment, doubt, findings);
        let Some(mark) = self.mark else { return };
        let height = segment.height.or(mark.height);
        let Some(height) = height.filter(|height| *height > 0.0) else { return };
        if !segment.extrudes() || segment.role == Role::Custom || segment.width <= 0.0 {
            return;
        }
        let clear = self.alignment.clear_radius_at(self.clearance, segment.part[1].z);
        if segment.nearest < ROUND_AXIS * clear {
            return;
        }
        let announced = area(segment.width, height);
        let share = segment.filament * self.filament_area / segment.path / announced;
        let rounded = doubt.duration
            + FILAMENT / segment.filament
            + (area(segment.width + WIDTH, height) / announced - 1.0);
        let is_planar = mark.family.unwrap_or_default() == Family::Planar;
        let [least, most] = self.limits(segment, &mark, height);
        let volume = announced * segment.path;
        let over = (share - most - rounded) * volume;
        let under = (least - rounded - share) * volume;
        if exceeds(over, BLOB) || exceeds(under, LACK) {
            let limit = if share > most { most } else { least };
            findings.warning(NAME, Place::end_of(segment), (share, limit), || {
                format!(
                    "a bead has {:.1} % of its announced cross-section of {announced:.4} mm²",
                    100.0 * share
                )
            });
        }
        // The width that ironing is announced with is rounded by a tenth of it.
        let is_told = segment.role != Role::Ironing;
        let is_told_plane = is_planar && self.ground.is_none() && !mark.climbs && !segment.slopes;
        let role = Role::ALL.iter().position(|role| *role == segment.role && is_told);
        if let Some(role) = role.filter(|_| is_told_plane && share.is_finite()) {
            let class = (share.min(THICKEST) / CLASS) as usize;
            let classes = &mut self.classes[role];
            if classes.len() <= class {
                classes.resize(class + 1, 0.0);
            }
            classes[class] += segment.path;
        }
    }

    /// The least and the greatest share of the announced cross-section.
    fn limits(&self, segment: &Segment, mark: &LayerMark, height: f64) -> [f64; 2] {
        let family = mark.family.unwrap_or_default();
        let upright = |family: Family| family.normal(&segment.middle(&self.alignment)).z;
        match self.ground {
            // The first turn of a vase begins without thickness.
            _ if mark.climbs => [0.0, THICKEST],
            // As thin as nothing where a slope begins or ends.
            _ if segment.slopes => [0.0, THICKEST],
            Some(ground) => [THINNEST, THICKEST / upright(ground)],
            None if family == Family::Planar => [1.0 - DRIFT, 1.0 + DRIFT],
            None => {
                let slope = upright(family);
                let lowest = segment.part[0].z.min(segment.part[1].z);
                let is_wedge = (lowest - self.floor) / slope < THICKEST * height;
                if is_wedge || !self.goes_on {
                    return [THINNEST, THICKEST];
                }
                // Caps are as thick upright everywhere.
                let usual = if matches!(family, Family::Caps { .. }) { slope } else { 1.0 };
                [usual - DRIFT, usual + DRIFT]
            }
        }
    }

    /// Judges the volume in a second.
    fn melts(&self, segment: &Segment, doubt: &Doubt, findings: &mut Findings) {
        if !segment.extrudes() || segment.duration <= 0.0 || segment.is_paced {
            return;
        }
        let rate = segment.filament * self.filament_area / segment.duration;
        let limit = self.volume_per_second;
        let rounded = doubt.duration + FILAMENT / segment.filament;
        if exceeds(rate, limit * (1.0 + rounded)) {
            findings.warning(NAME, Place::end_of(segment), (rate, limit), || {
                format!("a line asks for {rate:.2} mm³/s of filament, {limit} mm³/s melt")
            });
        }
    }

    /// Ends the program.
    pub(crate) fn end(&self, place: Place, findings: &mut Findings) {
        for (role, classes) in Role::ALL.iter().zip(&self.classes) {
            let whole: f64 = classes.iter().sum();
            let mut below = 0.0;
            let middle = classes.iter().position(|length| {
                below += length;
                below > whole / 2.0
            });
            let Some(middle) = middle.filter(|_| whole > TELLING) else { continue };
            let share = (middle as f64 + 0.5) * CLASS;
            if exceeds((share - 1.0).abs(), OFF) {
                findings.warning(NAME, place, (share, 1.0), || {
                    let (percent, role) = (100.0 * share, role.label());
                    format!("the middle bead of {role} has {percent:.1} % of what is announced")
                });
            }
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

    fn found(share: f64, family: Option<Family>) -> Vec<f64> {
        found_at(0.2, share, family)
    }

    /// What is found of a hundred beads at this height with this share of the announced cross-section.
    fn found_at(z: f64, share: f64, family: Option<Family>) -> Vec<f64> {
        let printer = Printer { axis_clearance: 0.02, ..printer() };
        let (mut check, mut findings) =
            (Flow::new(&printer, 2.0, f64::INFINITY), Findings::default());
        check.layer(LayerMark {
            line: 1,
            index: 0,
            top: None,
            height: Some(0.2),
            family,
            climbs: false,
        });
        for k in 0..110 {
            let at = |x: f64| Point3::new(x, 5.0 + f64::from(k), z);
            let mut segment = part_segment(at(0.0), at(20.0));
            segment.role = Role::Perimeter;
            segment.filament = share * area(0.45, 0.2) * 20.0 / 2.0;
            check.segment(&segment, &Doubt::of(&segment), &mut findings);
        }
        check.end(Place::line(9, None), &mut findings);
        let mut limits: Vec<f64> = findings.kept().iter().map(|found| found.limit).collect();
        limits.dedup();
        limits
    }

    #[test]
    fn planar_beads_have_what_is_announced() {
        assert!(found(1.0, None).is_empty() && found(1.025, None).is_empty());
        assert_eq!(found(1.05, None), [1.0]);
        assert_eq!(found(0.95, None), [1.0]);
        assert_eq!(found(1.5, None)[0], 1.0 + DRIFT);
        assert_eq!(found(0.6, None)[0], 1.0 - DRIFT);
    }

    #[test]
    fn no_more_volume_is_asked_for_than_melts() {
        let count = |filament: f64| {
            let (check, mut findings) = (Flow::new(&printer(), 2.0, 10.0), Findings::default());
            // 20 mm at 20 mm/s: a second.
            let mut segment = part_segment(Point3::new(0.0, 5.0, 0.2), Point3::new(20.0, 5.0, 0.2));
            segment.filament = filament;
            check.melts(&segment, &Doubt::of(&segment), &mut findings);
            findings.kept().len()
        };
        assert_eq!([4.99, 5.0, 5.01].map(count), [0, 0, 1]);
    }

    #[test]
    fn wedges_are_thinner_and_thicker() {
        let cone = Some(Family::Conical { slope: 0.5 });
        assert!(found(1.02, cone).is_empty());
        assert!(found(1.3, cone).is_empty() && found(0.55, cone).is_empty());
        assert_eq!(found(0.3, cone)[0], THINNEST);
        assert_eq!(found(1.9, cone)[0], THICKEST);
    }

    #[test]
    fn curved_beads_off_the_floor_are_as_thick_as_their_layer() {
        let cone = Some(Family::Conical { slope: 0.5 });
        assert!(found_at(2.0, 1.02, cone).is_empty());
        assert_eq!(found_at(2.0, 1.3, cone)[0], 1.0 + DRIFT);
        assert_eq!(found_at(2.0, 0.6, cone)[0], 1.0 - DRIFT);
        // A cap that falls by 60° at 100 mm, where it is half as thick.
        let caps = Some(Family::Caps { radius: 120.0 });
        assert!(found_at(2.0, 0.6, caps).iter().all(|limit| *limit > 0.6));
        assert!(found_at(2.0, 0.95, caps).iter().all(|limit| *limit < 0.95));
    }
}
