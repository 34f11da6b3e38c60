//! Is as much material laid as the part holds, and no more?
//!
//! What a layer holds is the area of the mesh's section at the middle of the layer times its
//! height; what is laid is filament times its cross-section. Skirt, brim, priming
//! (`Custom`), supports and ironing are not the part's. Outlines that are moved on purpose count
//! as a wider border, with its rounded corners.
//!
//! * A layer may hold more than its section by [`LAYER_SHARE`] of it, plus [`BORDER`] times its
//!   outline, plus one bead's dot.
//! * The print may hold more than its sections together by [`PRINT_SHARE`], plus the border.
//! * A print that is meant to be solid may hold less by [`PRINT_SHARE`], plus the border, plus
//!   the edges of its outermost beads: a bead's side is a half circle, which leaves
//!   `h²·(1 − π/4)/2` of the outline's square corner empty.
//!
//! A mesh with holes encloses nothing for certain, and its sections have no certain area: where it does
//! not fit what is laid, that is said and is no finding.
//!
//! Curved layers, and those in which the nozzle leaves its plane, cannot be told by a plane section;
//! then only the print as a whole is compared, with the volume that the mesh encloses, and its
//! surface stands for the outlines, and half a layer on what runs along the layers for their stairs: there a
//! layer is laid whole or not at all, as its middle has it, which no section shows. Shells that
//! overlap are counted as often as they do (see [`crate::section`]).
//!
//! mm, mm², mm³. Part frame.

use std::f64::consts::{FRAC_PI_3, FRAC_PI_4};

use machine::program::Role;

use crate::family::Family;
use crate::finding::{Findings, Place, exceeds};
use crate::replay::LayerMark;
use crate::rounding;
use crate::section::Section;
use crate::segment::Segment;

/// The name of this check.
pub const NAME: &str = "volume";

/// How much more than its section a layer may hold, as a share. Fill that is anchored in the walls
/// overlaps them by a fraction of a bead, which is 2 % of a section of 20 mm and 4 % of one of
/// 10 mm; beads laid twice are 100 %.
pub const LAYER_SHARE: f64 = 0.05;

/// How much more or less than its sections a print may hold, as a share: what rhumb promises.
pub const PRINT_SHARE: f64 = 0.02;

/// How far the laid outline may lie beyond the section's, mm: chord (0.005), simplification
/// (0.002), the last places (0.001), and room for what they do together.
pub const BORDER: f64 = 0.01;

/// Families whose surfaces are compared with that of the mesh. Blends announce one with each layer, and
/// the first and steepest tell the others.
const MOST_FAMILIES: usize = 32;

/// What one layer holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerVolume {
    /// Its number.
    pub index: usize,
    /// The line where it begins.
    pub line: usize,
    /// Highest place of the nozzle so far, mm, when announced.
    pub top: Option<f64>,
    /// Its thickness, mm, when announced.
    pub height: Option<f64>,
    /// Material laid for the part, mm³.
    pub part: f64,
    /// Material laid for anything else, mm³.
    pub other: f64,
    /// The area of the mesh at its middle, mm², when there is a mesh.
    pub area: Option<f64>,
    /// The length of the outline there, mm; zero without a mesh.
    pub outline: f64,
    /// What the section gains at corners where outlines are moved on purpose, mm².
    pub corners: f64,
    /// Whether the nozzle stayed in one plane while it laid the part.
    pub is_plane: bool,
}

/// Sums material by layer and role, and compares it with the mesh.
#[derive(Debug, Clone)]
pub(crate) struct Volume {
    filament_area: f64,
    nozzle: f64,
    /// How far outlines may lie from those of the mesh, mm.
    border: f64,
    /// How far they were moved on purpose, mm.
    moved: f64,
    layers: Vec<LayerVolume>,
    /// Families of layers that were announced, the first [`MOST_FAMILIES`].
    families: Vec<Family>,
    /// Filament by role, in the order of [`Role::ALL`], mm.
    by_role: [f64; Role::ALL.len()],
    filament: f64,
}

impl Volume {
    /// Returns the check for filament of this cross-section (mm²) and a nozzle of this bore (mm).
    #[must_use]
    pub(crate) fn new(filament_area: f64, nozzle: f64) -> Self {
        let by_role = [0.0; Role::ALL.len()];
        Self {
            filament_area,
            nozzle,
            border: BORDER,
            moved: 0.0,
            layers: Vec::new(),
            families: Vec::new(),
            by_role,
            filament: 0.0,
        }
    }

    /// Allows for outlines that are moved by as much on purpose, mm.
    #[must_use]
    pub(crate) fn moved(self, by: f64) -> Self {
        Self { border: BORDER + by, moved: by, ..self }
    }

    pub(crate) fn segment(&mut self, segment: &Segment) {
        self.filament += segment.filament;
        if !segment.extrudes() {
            return;
        }
        self.by_role[role_index(segment.role)] += segment.filament;
        let mut volume = segment.filament * self.filament_area;
        if let Some(thick) = segment.height.filter(|_| is_part(segment.role)) {
            volume -= self.below(volume, thick);
        }
        let Some(layer) = self.layers.last_mut() else { return };
        if is_part(segment.role) {
            layer.part += volume;
            let in_plane =
                |z: f64| layer.top.is_some_and(|top| (z - top).abs() <= rounding::IN_PLANE);
            layer.is_plane &= in_plane(segment.part[0].z) && in_plane(segment.part[1].z);
        } else {
            layer.other += volume;
        }
    }

    /// Gives layers below the last their shares of a bead that is as thick as several, and returns what
    /// they got, mm³.
    fn below(&mut self, volume: f64, thick: f64) -> f64 {
        let own = self.layers.last().and_then(|layer| layer.height).unwrap_or(thick);
        let (mut left, mut given) = (thick - own, 0.0);
        for layer in self.layers.iter_mut().rev().skip(1) {
            let Some(height) = layer.height.filter(|_| left > rounding::LENGTH) else { break };
            let share = volume * height.min(left) / thick;
            layer.part += share;
            given += share;
            left -= height;
        }
        given
    }

    /// Begins a layer, with the section at its middle when there is a mesh.
    pub(crate) fn layer(&mut self, mark: LayerMark, section: Option<&Section>) {
        let family = mark.family.unwrap_or_default();
        if self.families.len() < MOST_FAMILIES && self.families.last() != Some(&family) {
            self.families.push(family);
        }
        self.layers.push(LayerVolume {
            index: mark.index,
            line: mark.line,
            top: mark.top,
            height: mark.height,
            part: 0.0,
            other: 0.0,
            area: section.map(Section::area),
            outline: section.map_or(0.0, Section::perimeter),
            corners: section
                .filter(|_| self.moved > 0.0)
                .map_or(0.0, |section| section.convex_turns() * self.moved * self.moved / 2.0),
            is_plane: true,
        });
    }

    /// Returns what each layer holds.
    #[must_use]
    pub(crate) fn layers(&self) -> &[LayerVolume] {
        &self.layers
    }

    /// Returns the filament fed in all, less what was drawn back, mm.
    #[must_use]
    pub(crate) fn filament(&self) -> f64 {
        self.filament
    }

    /// Whether anything was laid at all.
    pub(crate) fn has_laid(&self) -> bool {
        self.by_role.iter().any(|filament| *filament > 0.0)
    }

    /// Returns the material laid for each role, mm³.
    #[must_use]
    pub(crate) fn by_role(&self) -> [(Role, f64); Role::ALL.len()] {
        Role::ALL.map(|role| (role, self.by_role[role_index(role)] * self.filament_area))
    }

    /// Compares with the mesh, which holds what `enclosed` says and has holes if `is_open`; `is_solid`
    /// when the print is meant to be. Returns what could not be judged.
    pub(crate) fn end(
        &self,
        enclosed: Option<impl FnOnce(&[Family], f64) -> Enclosed>,
        is_open: impl FnOnce() -> bool,
        is_solid: bool,
        findings: &mut Findings,
    ) -> Option<&'static str> {
        let mut own = Findings::default();
        let note = self.compare(enclosed, is_solid, &mut own);
        // Holes are looked for only where they would explain something: that takes time.
        if own.is_empty() {
            return note;
        }
        if is_open() {
            return Some(
                "volume: the model has holes that stay open, and what is laid is not what its \
                 outlines seem to hold; nobody knows what it should be",
            );
        }
        findings.append(own);
        note
    }

    fn compare(
        &self,
        enclosed: Option<impl FnOnce(&[Family], f64) -> Enclosed>,
        is_solid: bool,
        findings: &mut Findings,
    ) -> Option<&'static str> {
        let Some(enclosed) = enclosed else {
            return Some("volume: without a mesh, material is summed and not compared");
        };
        let Some(last) = self.layers.last() else {
            return Some("volume: no layers are announced, material is not compared");
        };
        let place = Place::line(last.line, Some(last.index));
        let flat: Option<Vec<Bill>> =
            self.layers.iter().map(|layer| Bill::of(layer, self.border)).collect();
        let laid: f64 = self.layers.iter().map(|layer| layer.part).sum();
        let (bill, note) = if let Some(layers) = flat {
            for (layer, bill) in self.layers.iter().zip(&layers) {
                self.overfilled(layer, bill, findings);
            }
            (layers.iter().fold(Bill::default(), Bill::plus), None)
        } else {
            let note = "volume: layers are curved or lack ;Z: or ;HEIGHT:, only the whole print \
                        is compared";
            (self.whole_mesh(enclosed), Some(note))
        };
        whole(laid, &bill, is_solid, place, findings);
        note
    }

    fn overfilled(&self, layer: &LayerVolume, bill: &Bill, findings: &mut Findings) {
        let dot = self.nozzle * self.nozzle * layer.height.unwrap_or(0.0);
        let limit = bill.section * (1.0 + LAYER_SHARE) + bill.border + dot;
        if exceeds(layer.part, limit) {
            let (laid, holds) = (layer.part, bill.section);
            let place = Place::line(layer.line, Some(layer.index));
            findings.error(NAME, place, (laid, limit), || {
                format!(
                    "the layer gets {laid:.3} mm³, its section holds {holds:.3} mm³ and may get \
                     {limit:.3} mm³"
                )
            });
        }
    }

    /// What the mesh holds, where sections do not count.
    fn whole_mesh(&self, enclosed: impl FnOnce(&[Family], f64) -> Enclosed) -> Bill {
        let height = self.layers.iter().filter_map(|layer| layer.height).fold(0.0, f64::max);
        let enclosed = enclosed(&self.families, height);
        // An outline times the thickness of its layer is a piece of the surface.
        let edges = enclosed.surface * height * (1.0 - FRAC_PI_4) / 2.0;
        // A layer that ends in a surface is laid whole or not at all.
        let stairs = enclosed.along * height / 2.0;
        let moved = self.moved;
        let corners = moved * moved * (enclosed.edges + 4.0 * FRAC_PI_3 * moved);
        let border = enclosed.surface * self.border + corners + stairs;
        Bill { section: enclosed.volume, border, edges }
    }
}

/// What a mesh encloses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Enclosed {
    /// mm³.
    pub(crate) volume: f64,
    /// Area of its surface, mm².
    pub(crate) surface: f64,
    /// What it gains at its edges where outlines are moved on purpose, mm³ for each mm² of that.
    pub(crate) edges: f64,
    /// Area of what runs along the layers, mm². What leans against them counts by the share of it
    /// that one layer meets.
    pub(crate) along: f64,
}

/// What a layer, or a print, should hold.
#[derive(Debug, Clone, Copy, Default)]
struct Bill {
    section: f64,
    border: f64,
    /// What the round sides of the outermost beads leave empty.
    edges: f64,
}

impl Bill {
    /// `None` where a plane section says nothing.
    fn of(layer: &LayerVolume, border: f64) -> Option<Self> {
        let (height, area) = (layer.height?, layer.area?);
        let mut borders = Self::for_outline(layer.outline, height, border);
        borders.border += layer.corners * height;
        layer.is_plane.then_some(Self { section: area * height, ..borders })
    }

    fn for_outline(outline: f64, height: f64, border: f64) -> Self {
        let edges = outline * height * height * (1.0 - FRAC_PI_4) / 2.0;
        Self { section: 0.0, border: outline * height * border, edges }
    }

    fn plus(self, other: &Self) -> Self {
        Self {
            section: self.section + other.section,
            border: self.border + other.border,
            edges: self.edges + other.edges,
        }
    }
}

fn whole(laid: f64, bill: &Bill, is_solid: bool, place: Place, findings: &mut Findings) {
    let holds = bill.section;
    let most = holds * (1.0 + PRINT_SHARE) + bill.border;
    if exceeds(laid, most) {
        findings.error(NAME, place, (laid, most), || {
            format!(
                "the print gets {laid:.2} mm³, the mesh holds {holds:.2} mm³, at most {most:.2} mm³"
            )
        });
    }
    let least = holds * (1.0 - PRINT_SHARE) - bill.border - bill.edges;
    if is_solid && exceeds(least, laid) {
        findings.error(NAME, place, (laid, least), || {
            format!(
                "the solid print gets {laid:.2} mm³, the mesh holds {holds:.2} mm³, at least \
                 {least:.2} mm³"
            )
        });
    }
}

fn is_part(role: Role) -> bool {
    !matches!(
        role,
        Role::SkirtBrim
            | Role::SupportMaterial
            | Role::SupportInterface
            | Role::Ironing
            | Role::Custom
    )
}

fn role_index(role: Role) -> usize {
    Role::ALL.iter().position(|&known| known == role).unwrap_or(Role::ALL.len() - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{joints, polar_segment, segment};
    use crate::section::tests::block;
    use crate::section::{self, Sweep};

    const HEIGHT: f64 = 0.2;

    fn section_at(z: f64) -> Section {
        let mut section = Section::default();
        Sweep::new(&block(10.0, 0.0, 1.0, 0.0)).cut(z, &mut section);
        section
    }

    /// Five layers of a block of 400 mm² and 1 mm, each filled to a share of what it holds; the lines of
    /// what is found.
    fn found(shares: [f64; 5], role: Role, is_solid: bool) -> Vec<usize> {
        let (findings, unjudged) = judged(shares, role, is_solid, false);
        assert_eq!(unjudged, None);
        findings
    }

    /// The same, with what could not be judged, for a mesh that may have a hole left.
    fn judged(
        shares: [f64; 5],
        role: Role,
        is_solid: bool,
        is_open: bool,
    ) -> (Vec<usize>, Option<&'static str>) {
        let mut check = Volume::new(2.0, 0.4);
        for (index, share) in shares.into_iter().enumerate() {
            let top = HEIGHT * (index + 1) as f64;
            let (top_mark, height) = (Some(top), Some(HEIGHT));
            let mark = LayerMark {
                line: index + 1,
                index,
                top: top_mark,
                height,
                family: None,
                climbs: false,
            };
            check.layer(mark, Some(&section_at(top - HEIGHT / 2.0)));
            let mut line = segment(joints(5.0, 0.0, top), joints(9.0, 1.0, top), 20.0);
            (line.filament, line.role) = (share * 400.0 * HEIGHT / 2.0, role);
            check.segment(&line);
        }
        let mut findings = Findings::default();
        let enclosed = Enclosed { volume: 400.0, surface: 880.0, edges: 0.0, along: 0.0 };
        let enclosed = Some(|_: &[Family], _| enclosed);
        let unjudged = check.end(enclosed, || is_open, is_solid, &mut findings);
        (findings.kept().iter().map(|finding| finding.line).collect(), unjudged)
    }

    #[test]
    fn nobody_knows_what_a_mesh_with_a_hole_left_open_holds() {
        // The whole print has 4 % too much: found where the mesh is closed, told as unknown where not.
        let closed = judged([1.04; 5], Role::Perimeter, false, false);
        assert_eq!(closed, (vec![5], None));
        let (findings, unjudged) = judged([1.04; 5], Role::Perimeter, false, true);
        assert_eq!(findings, []);
        assert!(unjudged.is_some());
    }

    #[test]
    fn sections_are_filled_and_not_more() {
        assert_eq!(found([1.0, 1.02, 0.97, 1.0, 1.0], Role::SolidInfill, true), []);
        assert_eq!(found([0.2; 5], Role::InternalInfill, false), []);
        assert_eq!(found([0.9, 0.9, 1.2, 0.9, 0.9], Role::Perimeter, false), [3]);
        assert_eq!(found([1.04; 5], Role::Perimeter, false), [5]);
        assert_eq!(found([0.965; 5], Role::SolidInfill, true), [5]);
        assert_eq!(found([0.965; 5], Role::SolidInfill, false), []);
        assert_eq!(found([3.0; 5], Role::SkirtBrim, false), []);
    }

    #[test]
    fn roles_and_layers_are_summed_exactly() {
        let mut check = Volume::new(2.0, 0.4);
        let mut line = polar_segment([5.0, 0.0], [9.0, 1.0], 20.0);
        line.filament = 0.5;
        line.role = Role::Custom;
        check.segment(&line);
        let mark = LayerMark {
            line: 1,
            index: 0,
            top: Some(0.2),
            height: None,
            family: None,
            climbs: false,
        };
        check.layer(mark, None);
        line.role = Role::Perimeter;
        check.segment(&line);
        line.filament = -0.25;
        check.segment(&line);
        assert_eq!(check.filament(), 0.75);
        assert_eq!(check.layers()[0].part, 1.0);
        let by_role = check.by_role();
        let of = |role| by_role.iter().find(|(known, _)| *known == role).unwrap().1;
        assert_eq!((of(Role::Perimeter), of(Role::Custom), of(Role::GapFill)), (1.0, 1.0, 0.0));
    }

    #[test]
    fn what_cannot_be_judged_is_said() {
        let mut findings = Findings::default();
        let mut check = Volume::new(2.0, 0.4);
        assert!(
            check
                .end(None::<fn(&[Family], f64) -> Enclosed>, || false, true, &mut findings)
                .unwrap()
                .contains("without a mesh")
        );
        let small = Enclosed { volume: 1.0, surface: 6.0, edges: 0.0, along: 0.0 };
        assert!(
            check
                .end(Some(|_: &[Family], _| small), || false, true, &mut findings)
                .unwrap()
                .contains("no layers")
        );
        let mark = LayerMark {
            line: 4,
            index: 0,
            top: Some(1.0),
            height: Some(1.0),
            family: None,
            climbs: false,
        };
        check.layer(mark, Some(&section_at(0.5)));
        let mut rising = segment(joints(5.0, 0.0, 0.5), joints(9.0, 1.0, 1.0), 20.0);
        rising.filament = 200.0;
        check.segment(&rising);
        let block = block(10.0, 0.0, 1.0, 0.0);
        let mesh = Enclosed {
            volume: section::volume(&block),
            surface: section::surface(&block),
            edges: 0.0,
            along: 0.0,
        };
        assert_eq!(mesh.surface, 880.0);
        assert!(
            check
                .end(Some(|_: &[Family], _| mesh), || false, true, &mut findings)
                .unwrap()
                .contains("curved")
        );
        assert!(findings.checks().is_empty());
        check.segment(&rising);
        check.end(Some(|_: &[Family], _| mesh), || false, true, &mut findings);
        assert_eq!(findings.checks(), [NAME]);
    }

    /// A cube of 1 mm on curved layers, moved outwards by 2 mm: what lies beyond its sides is most of it.
    #[test]
    fn what_is_moved_outwards_gains_at_edges_on_curved_layers_too() {
        let found = |edges: f64, moved: f64| {
            let mut check = Volume::new(2.0, 0.4).moved(moved);
            let mark = LayerMark {
                line: 1,
                index: 0,
                top: Some(1.0),
                height: Some(1.0),
                family: None,
                climbs: false,
            };
            check.layer(mark, Some(&section_at(0.5)));
            let mut rising = segment(joints(5.0, 0.0, 0.5), joints(9.0, 1.0, 1.0), 20.0);
            rising.filament = 30.0;
            check.segment(&rising);
            let mut findings = Findings::default();
            let cube = Enclosed { volume: 1.0, surface: 6.0, edges, along: 0.0 };
            check.end(Some(|_: &[Family], _| cube), || false, false, &mut findings);
            !findings.checks().is_empty()
        };
        let edges = 3.0 * std::f64::consts::PI;
        assert!(!found(edges, 2.0));
        assert!(found(0.0, 2.0) && found(edges, 0.0));
    }
}
