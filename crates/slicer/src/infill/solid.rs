//! Lines of solid areas.
//!
//! Straight lines and turns of the spiral lie a fixed distance apart, and their width is balanced so that
//! they take the volume of their area; loops follow its outline. On curved layers straight lines of the
//! chart would not be evenly far apart, so there the spiral takes their place. Places are those of the
//! layer's chart, mm.

use geom::region::{Island, Region};
use geom::spiral::Spiral;

use super::link::{self, JoinParams};
use super::spiral::Turns;
use super::{
    FillLayer, FillLine, Filling, SOLID_JOINS, SolidPattern, closed_lines, concentric, fill_lines,
    monotonic, open_lines, rectilinear, rim, turning,
};
use crate::bead::Bead;
use crate::toolpath::Role;

/// Fills the inner solid area of an island and that which is seen from above.
pub(super) fn fill(solids: &[(&Region, Solid); 2], layer: &FillLayer<'_>, filling: &mut Filling) {
    if fill_as_one(solids, layer, filling) {
        return;
    }
    for (region, solid) in solids {
        for island in region.islands() {
            solid.fill(island, layer, filling);
        }
    }
}

/// Fills two solid areas that lie side by side with turns of the same spiral, which go on from one to the
/// other: each ended on its own they would leave a groove between. The narrower lines are laid in both.
/// Returns whether it did.
fn fill_as_one(
    solids: &[(&Region, Solid); 2],
    layer: &FillLayer<'_>,
    filling: &mut Filling,
) -> bool {
    let [(solid, how), (top, top_how)] = solids;
    let is_spiral = |how: &Solid| how.pattern_on(layer) == SolidPattern::Archimedean;
    let width = how.width.min(top_how.width);
    let are_alike = how.width.max(top_how.width) <= MOST_ALIKE * width;
    if !(is_spiral(how) && is_spiral(top_how) && are_alike) || solid.is_empty() || top.is_empty() {
        return false;
    }
    // Rounded corners of a border leave cracks that no bead could be laid beside.
    let whole = solid.union(&top.outset(CRACK_MM));
    for island in whole.islands() {
        let area = Region::from_island(island.clone());
        let Some(lines) = (Solid { width, ..*how }).turns(&area, layer) else {
            for (part, how) in solids {
                for island in part.intersection(&area).islands() {
                    how.fill(island, layer, filling);
                }
            }
            continue;
        };
        filling.lines.extend(lines.iter().flat_map(|line| shared_out(line, top, top_how.role)));
    }
    true
}

/// Lines of two areas that differ by no more than this in width can be laid alike.
const MOST_ALIKE: f64 = 1.25;

/// Wider than any crack between areas that were cut apart on the grid, mm, and far less than beads are
/// placed to.
const CRACK_MM: f64 = 1e-4;

/// A line taken apart where it enters or leaves `other`, and what lies there given its role. Points of a
/// spiral lie near enough to each other for the middle of a side to tell.
fn shared_out(line: &FillLine, other: &Region, role: Role) -> Vec<FillLine> {
    let mut parts: Vec<FillLine> = Vec::new();
    for side in line.points.windows(2) {
        let is_other = other.contains(&nalgebra::center(&side[0], &side[1]));
        let role = if is_other { role } else { line.role };
        match parts.last_mut() {
            Some(part) if part.role == role => part.points.push(side[1]),
            _ => parts.push(FillLine { role, points: side.to_vec(), ..line.clone() }),
        }
    }
    parts
}

/// How a solid area is filled.
pub(super) struct Solid {
    pub(super) role: Role,
    /// Width of the lines, mm.
    pub(super) width: f64,
    pub(super) pattern: SolidPattern,
    /// Direction of parallel lines, radians.
    pub(super) angle: f64,
}

impl Solid {
    fn fill(&self, island: &Island, layer: &FillLayer<'_>, filling: &mut Filling) {
        let bead = Bead { width: self.width, thickness: layer.thickness };
        let area = Region::from_island(island.clone());
        match self.pattern_on(layer) {
            SolidPattern::Rectilinear => {
                let even = rectilinear::evenly(&area, bead.spacing(), self.angle);
                let bead = Bead::with_spacing(even.spacing, layer.thickness);
                let (core, chords) = (&even.core, &even.chords);
                let lines = open_lines(core, chords, &SOLID_JOINS, self.role, bead, layer);
                filling.lines.extend(lines);
            }
            SolidPattern::Monotonic { joined } => {
                let even = rectilinear::evenly(&area, bead.spacing(), self.angle);
                let bead = Bead::with_spacing(even.spacing, layer.thickness);
                let longest = if joined { f64::INFINITY } else { 0.0 };
                let lines = monotonic::lines(&even, &JoinParams { longest, ..SOLID_JOINS });
                let lines = fill_lines(lines, self.role, bead, layer).collect();
                filling.in_order.push(lines);
            }
            SolidPattern::Concentric => loops(&area, self.role, bead, layer, filling),
            SolidPattern::Archimedean => self.spiral(&area, bead, layer, filling),
        }
    }

    /// Straight lines of a curved chart are not equally far apart everywhere; turns of the spiral are.
    fn pattern_on(&self, layer: &FillLayer<'_>) -> SolidPattern {
        if layer.chart.is_flat() { self.pattern } else { self.pattern.evenly_curved() }
    }

    fn spiral(&self, area: &Region, bead: Bead, layer: &FillLayer<'_>, filling: &mut Filling) {
        match self.turns(area, layer) {
            Some(lines) => filling.lines.extend(lines),
            // Too narrow for turns of a fixed pitch: loops follow the outline instead.
            None => loops(area, self.role, bead, layer, filling),
        }
    }

    /// Turns of the spiral that take the volume of an area; `None` where they would not.
    fn turns(&self, area: &Region, layer: &FillLayer<'_>) -> Option<Vec<FillLine>> {
        let bead = Bead { width: self.width, thickness: layer.thickness };
        let core = layer.chart.inset(area, bead.spacing() / 2.0);
        // Turns of neighbouring layers lie in each other's grooves.
        let phase = if layer.index.is_multiple_of(2) { 0.0 } else { std::f64::consts::PI };
        let spiral = Spiral { pitch: bead.spacing(), phase, turning: turning(layer.index) };
        let turns = Turns::inside(&core, spiral);
        let chords = turns.chords(layer.tolerance);
        let lines = link::joined_pieces(&core, &chords, &SOLID_JOINS);
        let lines = lines.iter().flat_map(|pieces| rim::without_turns(pieces, &turns)).collect();
        let lines: Vec<FillLine> = fill_lines(lines, self.role, bead, layer).collect();
        let bead = balanced(&lines, area, layer)?;
        Some(lines.into_iter().map(|line| FillLine { bead, ..line }).collect())
    }
}

fn loops(area: &Region, role: Role, bead: Bead, layer: &FillLayer<'_>, filling: &mut Filling) {
    let (rings, thin) = concentric::solid(area, &layer.chart, bead.spacing());
    filling.lines.extend(closed_lines(rings, role, bead));
    filling.thin.extend(thin);
}

/// How much wider or narrower than wanted the beads of a solid area may be to take its volume.
const BALANCE: std::ops::RangeInclusive<f64> = 0.9..=1.1;

/// The bead with which lines take the volume of their area: turns of a fixed pitch end where the
/// area does, and leave a little more or less than their own place. `None` where that is too much.
fn balanced(lines: &[FillLine], area: &Region, layer: &FillLayer<'_>) -> Option<Bead> {
    let length: f64 = lines
        .iter()
        .flat_map(|line| line.points.windows(2))
        .map(|w| layer.chart.length(&w[0], &w[1]))
        .sum();
    let bead = lines.first()?.bead;
    let spacing = layer.chart.area(area) / length;
    BALANCE
        .contains(&(spacing / bead.spacing()))
        .then(|| Bead::with_spacing(spacing, layer.thickness))
}
