//! The checks that need to know all that was laid before: `support`, `overlap`, `clearance` and the
//! hollow space of `coverage`.
//!
//! Every move is taken apart into pieces of at most [`PIECE`]. The nozzle stands over each, and
//! what it lays is added to the pile. A line is what is laid without a move between;
//! it has a number, so that it can be told from its neighbours.

use machine::kinematics::{Alignment, Branch};
use machine::program::{BedTurn, Role};
use nalgebra::{Point3, Rotation2, UnitVector3, Vector2, center};

use crate::check::clearance::Clear;
use crate::check::coverage::Hollow;
use crate::check::overlap::Overlap;
use crate::check::support::{Follow, PIECE, Step, Support};
use crate::columns::Columns;
use crate::finding::{Findings, Place};
use crate::pile::{HALFWAY_DOWN, Opening, Piece, Pile};
use crate::replay::LayerMark;
use crate::rounding;
use crate::segment::Segment;
use crate::verify::Setup;

/// What the thorough checks come to. mm, mm³.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thorough {
    /// What beads rest on.
    pub support: Support,
    /// Length of what was laid twice.
    pub laid_twice: f64,
    /// How deep the nozzle reached into what was printed.
    pub deepest_touch: f64,
    /// Empty space inside the part, where that is meant to be solid.
    pub hollow: f64,
}

/// Knows all that was laid. See the [module](self).
#[derive(Debug)]
pub(crate) struct Watch<'a> {
    alignment: Alignment,
    filament_area: f64,
    pile: Pile,
    mark: Option<LayerMark>,
    stroke: u32,
    /// Where the last line ended, until something else happens.
    end: Option<Point3<f64>>,
    thickness: f64,
    follow: Follow,
    overlap: Overlap,
    clear: Clear,
    /// The part, when it is known.
    part: Option<Columns<'a>>,
    /// For parts that are meant to be solid.
    hollow: Option<Hollow>,
    /// Those of a piece that belong to the part.
    openings: Vec<Opening>,
}

/// How far lines may begin from the end of the one before and still go on, mm: the last places.
const SAME_PLACE: f64 = 3.0 * rounding::LENGTH;

/// A bead thicker than this many layers is a blob whose thickness says nothing.
const THICKEST: f64 = 2.0;

impl<'a> Watch<'a> {
    /// Returns the watch over a bare bed.
    pub(crate) fn new(setup: &Setup<'a>) -> Self {
        let Setup { printer, .. } = *setup;
        let filament_area = setup.filament_area / setup.multiplier;
        Self {
            alignment: printer.alignment,
            filament_area,
            pile: Pile::new(printer.rail.max.max(-printer.rail.min)),
            mark: None,
            stroke: 0,
            end: None,
            thickness: 0.0,
            follow: Follow::default(),
            overlap: Overlap::default(),
            clear: Clear::new(printer),
            part: setup.mesh.map(Columns::new),
            hollow: setup.solid.then(Hollow::default),
            openings: Vec::new(),
        }
    }

    pub(crate) fn layer(&mut self, mark: LayerMark, findings: &mut Findings) {
        self.end_of_line(findings);
        if let Some(hollow) = &mut self.hollow {
            hollow.end_of_layer(findings);
        }
        self.thickness = mark.height.unwrap_or_default();
        self.mark = Some(mark);
    }

    /// The nozzle stands along `axes` at the ends of the segment.
    pub(crate) fn segment(
        &mut self,
        segment: &Segment,
        axes: &[UnitVector3<f64>; 2],
        findings: &mut Findings,
    ) {
        if segment.path <= 0.0 {
            return;
        }
        let lays = segment.extrudes() && segment.role != Role::Custom;
        let goes_on = self.end.is_some_and(|end| (end - segment.part[0]).norm() < SAME_PLACE);
        if !lays || !goes_on {
            self.end_of_line(findings);
        }
        let Some(mark) = self.mark else { return };
        if lays {
            self.thickness = self.thickness_of(segment, &mark);
            self.end = Some(segment.part[1]);
        }
        let count = (segment.path / PIECE).ceil().max(1.0) as u32;
        let mut from = segment.part[0];
        for k in 1..=count {
            let to = if k == count {
                segment.part[1]
            } else {
                self.at(segment, f64::from(k) / f64::from(count))
            };
            let share = f64::from(k) / f64::from(count);
            let axis = if axes[0] == axes[1] { axes[1] } else { axes[0].slerp(&axes[1], share) };
            self.piece([from, to], (lays, &axis), segment, &mark, findings);
            from = to;
        }
    }

    /// Ends the program, and returns what it came to.
    pub(crate) fn finish(&mut self, findings: &mut Findings) -> Thorough {
        self.end_of_line(findings);
        if let Some(hollow) = &mut self.hollow {
            hollow.end_of_layer(findings);
        }
        Thorough {
            support: self.follow.sums(),
            laid_twice: self.overlap.sum(),
            deepest_touch: self.clear.deepest(),
            hollow: self.hollow.as_ref().map_or(0.0, Hollow::sum),
        }
    }

    fn end_of_line(&mut self, findings: &mut Findings) {
        if self.end.take().is_some() {
            self.follow.end(findings);
            self.overlap.end(findings);
            self.stroke += 1;
        }
    }

    fn piece(
        &mut self,
        ends: [Point3<f64>; 2],
        (lays, axis): (bool, &UnitVector3<f64>),
        segment: &Segment,
        mark: &LayerMark,
        findings: &mut Findings,
    ) {
        let layer = mark.index as u32;
        let place = Place { line: segment.line, layer: segment.layer, at: Some(ends[1]) };
        let height = mark.height.unwrap_or_default();
        let alignment = &self.alignment;
        let rail = || rail_over_part(alignment, segment, &ends[1]);
        self.clear.tip((&ends[1], axis), (layer, height), place, (&self.pile, rail), findings);
        if !lays {
            return;
        }
        let is_support = is_support(segment.role);
        let footing = self.pile.lay(&Piece {
            ends,
            half_width: segment.width / 2.0,
            thickness: self.thickness,
            family: mark.family.unwrap_or_default(),
            layer,
            stroke: self.stroke,
            supports: is_support,
        });
        let is_inside = footing.resting < footing.covered && self.is_inside(&ends, segment.role);
        let step =
            Step { line: segment.line, layer: segment.layer, ends, footing, is_inside, is_support };
        self.follow.piece(&step, findings);
        // What fills a gap between walls lies between and under their round sides; ironing lies on
        // what it smooths.
        if !matches!(segment.role, Role::GapFill | Role::Ironing) {
            self.overlap.piece(&step, findings);
        }
        let Some(hollow) = self.hollow.as_mut().filter(|_| !is_support) else { return };
        let part = self.part.as_ref();
        // Where the layer below is as thick; without a mesh, what the bead is for tells.
        let belongs =
            |opening: &&Opening| part.map_or(is_inside, |part| part.winding(&opening.below) != 0);
        self.openings.clear();
        self.openings.extend(self.pile.openings().iter().filter(belongs));
        hollow.piece(&step, &self.openings, self.thickness);
    }

    /// Returns whether the place halfway down the layer below belongs to the part, and, where nothing lies
    /// there for another layer, the one below that, too: what is left out at the very underside of a part
    /// carries nothing. Without a mesh, whether that is what the bead is for.
    fn is_inside(&self, ends: &[Point3<f64>; 2], role: Role) -> bool {
        let Some(part) = &self.part else { return role == Role::InternalInfill };
        let middle = center(&ends[0], &ends[1]);
        let normal = self.mark.and_then(|mark| mark.family).unwrap_or_default().normal(&middle);
        let is_part =
            |layers: f64| part.winding(&(middle - normal * (layers * self.thickness))) != 0;
        let deepest = self.pile.openings().iter().map(|opening| opening.depth).fold(0.0, f64::max);
        let goes_on = deepest > HALFWAY_DOWN * self.thickness;
        is_part(HALFWAY_DOWN) && (!goes_on || is_part(HALFWAY_DOWN + 1.0))
    }

    fn thickness_of(&self, segment: &Segment, mark: &LayerMark) -> f64 {
        let height = segment.height.or(mark.height).unwrap_or_default();
        match segment.thickness(self.filament_area) {
            Some(thickness) if thickness > 0.0 && thickness < THICKEST * height => thickness,
            Some(_) => height,
            None => self.thickness,
        }
    }

    fn at(&self, segment: &Segment, share: f64) -> Point3<f64> {
        let over_part = self.alignment.part_from_bed(&segment.curve.over_bed(share));
        let [from, to] = segment.part.map(|p| p.z);
        Point3::new(over_part.x, over_part.y, from + (to - from) * share)
    }
}

fn is_support(role: Role) -> bool {
    matches!(role, Role::SupportMaterial | Role::SupportInterface)
}

/// Where the rail lies over the part while the nozzle is at a place of a segment; of length 1.
fn rail_over_part(alignment: &Alignment, segment: &Segment, at: &Point3<f64>) -> Vector2<f64> {
    let joints = segment.joints.map(|[_, to]| to);
    let is_beyond = joints.is_some_and(|joints| alignment.nozzle(&joints).x < 0.0);
    let branch = if is_beyond { Branch::Far } else { Branch::Near };
    let near = joints.map_or(BedTurn::default(), |joints| joints.turn);
    // Nearer to the axis than the rail comes the nozzle is by rounding only.
    let turn = alignment.joints_from_part(at, branch, near).map_or(near, |joints| joints.turn);
    let over_bed = Rotation2::new(alignment.bed.azimuth(turn)) * Vector2::x();
    alignment.part_from_bed(&over_bed) - alignment.part_from_bed(&Vector2::zeros())
}
