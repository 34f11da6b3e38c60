//! Lines of supports: columns of walls, and dense layers next to the part.

use geom::grid::mm;
use geom::region::Region;
use nalgebra::Point2;
use std::f64::consts::FRAC_PI_2;

use super::clip::{Course, clipped};
use super::link::{self, JoinParams};
use super::{Chord, FillLayer, FillLine, closed_lines, fill_lines, honeycomb, rectilinear, sparse};
use crate::bead::Bead;
use crate::support::{Column, SupportParams, SupportPattern};
use crate::toolpath::Role;

/// How far along the rim lines of the interface are joined, in spacings.
const JOIN_IN_SPACINGS: f64 = 2.0;

/// How much wider or narrower than asked for the beads of a dense area may be for its volume.
const WIDTHS: std::ops::RangeInclusive<f64> = 0.7..=1.5;

/// Returns the lines of a column in one layer: what of it is `laid` there.
pub(crate) fn lines(
    column: &Column,
    laid: impl Fn(&Region) -> Region,
    layer: &FillLayer<'_>,
    params: &SupportParams,
) -> Vec<FillLine> {
    let bead = Bead { width: params.width, thickness: layer.thickness };
    let support = Support { layer, params, bead };
    let mut lines = Vec::new();
    let on_bed = layer.index == 0;
    let beside = column.whole.difference(&column.interface);
    let body = laid(&beside);
    if on_bed {
        // All of it holds on to the bed.
        for island in body.islands() {
            let area = Region::from_island(island.clone());
            support.dense(&area, Role::SupportMaterial, 0.0, &mut lines);
        }
    } else if !body.is_empty() {
        support.body(&column.whole, &beside, &body, &mut lines);
    }
    for island in laid(&column.interface).islands() {
        let area = Region::from_island(island.clone());
        support.dense(&area, Role::SupportInterface, params.interface_spacing, &mut lines);
    }
    lines
}

struct Support<'a> {
    layer: &'a FillLayer<'a>,
    params: &'a SupportParams,
    bead: Bead,
}

impl Support<'_> {
    /// Lines that stand on those of the layer below, and one around the column. What of it is no
    /// interface (`beside`), and laid (`body`), has edges where it has no sides: lines end there without
    /// more ado.
    fn body(&self, column: &Region, beside: &Region, body: &Region, lines: &mut Vec<FillLine>) {
        let (bead, role, params) = (self.bead, Role::SupportMaterial, self.params);
        let rim = column.inset_coarsely(bead.width / 2.0);
        if params.sheath {
            self.sheath(&rim, body, lines);
        }
        let room = if params.sheath { rim.inset_coarsely(bead.spacing()) } else { rim };
        let core = room.intersection(body);
        if core.is_empty() {
            return;
        }
        let pitch = params.spacing + bead.width;
        let rows = |angle| rectilinear::rows_at(&core, pitch / 2.0, pitch, angle);
        let chords = match params.pattern {
            SupportPattern::Rectilinear => rows(params.angle),
            SupportPattern::RectilinearGrid => {
                let is_even = self.layer.index.is_multiple_of(2);
                rows(params.angle + if is_even { 0.0 } else { FRAC_PI_2 })
            }
            SupportPattern::Honeycomb => {
                let reach = core.rings().flatten().map(|&p| mm(p).coords.norm());
                let reach = reach.fold(0.0, f64::max);
                let courses = honeycomb::courses(reach, pitch, bead.spacing(), params.angle);
                clipped(&core, &courses).chords
            }
        };
        // Without a loop around, lines hold each other along the rim, unless that is the edge of a wedge,
        // where a line along it has no room.
        let is_whole = || beside.difference(body).inset(bead.width / 4.0).is_empty();
        let is_joined = !params.sheath && is_whole();
        let longest = if is_joined { JOIN_IN_SPACINGS * pitch } else { 0.0 };
        let joins = JoinParams { longest, fill_rim: false };
        lines.extend(self.open(&core, &chords, &joins, role, bead));
    }

    /// The line around a column.
    fn sheath(&self, rim: &Region, body: &Region, lines: &mut Vec<FillLine>) {
        let rings = rim.rings().map(|ring| ring.iter().map(|&p| mm(p)).collect());
        let courses: Vec<Course> = rings.map(|points| Course { points, closed: true }).collect();
        let around = clipped(body, &courses);
        let loops = around.loops.iter().map(|points| self.closed_under(points));
        let loops: Vec<Vec<Point2<f64>>> = loops.filter(|points| points.len() >= 3).collect();
        lines.extend(closed_lines(loops, Role::SupportMaterial, self.bead));
        let pieces = around.chords.into_iter().map(|chord| chord.points).collect();
        lines.extend(self.placed(pieces, Role::SupportMaterial, self.bead));
    }

    /// Lines across those of columns, `space` mm apart.
    fn dense(&self, area: &Region, role: Role, space: f64, lines: &mut Vec<FillLine>) {
        let wanted = self.bead.spacing() + space;
        let even = rectilinear::evenly(area, wanted, self.params.angle + FRAC_PI_2);
        let joins = JoinParams { longest: JOIN_IN_SPACINGS * wanted, fill_rim: false };
        let laid = self.open(&even.core, &even.chords, &joins, role, self.bead);
        let length: f64 = laid
            .iter()
            .flat_map(|line| line.points.windows(2))
            .map(|w| self.layer.chart.length(&w[0], &w[1]))
            .sum();
        if length <= 0.0 {
            return;
        }
        let bead = if space > 0.0 {
            self.bead
        } else {
            // On a slope lines lie farther apart than they look.
            let true_area = self.layer.chart.area(&self.layer.chart.region_under(area));
            let wide = WIDTHS.start() * self.bead.spacing()..=WIDTHS.end() * self.bead.spacing();
            let spacing = (true_area / length).clamp(*wide.start(), *wide.end());
            Bead::with_spacing(spacing, self.bead.thickness)
        };
        lines.extend(laid.into_iter().map(|line| FillLine { bead, ..line }));
    }

    /// Chords joined along the rim, in the chart.
    fn open(
        &self,
        core: &Region,
        chords: &[Chord],
        joins: &JoinParams,
        role: Role,
        bead: Bead,
    ) -> Vec<FillLine> {
        self.placed(link::joined(core, chords, joins), role, bead)
    }

    /// Lines seen along the axis, in the chart.
    fn placed(&self, lines: Vec<Vec<Point2<f64>>>, role: Role, bead: Bead) -> Vec<FillLine> {
        let mut lines: Vec<FillLine> = fill_lines(lines, role, bead, self.layer).collect();
        for line in &mut lines {
            line.points = sparse::under(&line.points, self.layer);
        }
        lines
    }

    fn closed_under(&self, points: &[Point2<f64>]) -> Vec<Point2<f64>> {
        let mut line = points.to_vec();
        line.extend(points.first());
        let mut line = sparse::under(&line, self.layer);
        line.pop();
        line
    }
}
