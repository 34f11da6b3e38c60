//! Does the outermost bead stay within the part?
//!
//! Halfway along external and overhanging perimeters both sides of the bead are looked at: a point
//! [`STICK_OUT`] + [`SLACK`] inside either side must lie within the mesh, half a layer under the
//! nozzle. On planar layers that is the mesh's section at the middle of the layer; on curved ones
//! the points lie along the normal of the layer (half a layer down, and half the bead's own thickness
//! where that differs: the better of the two counts), the mesh's [columns](Columns) are asked, and how
//! far the bead sticks out is its distance from the mesh: curved layers meet faces at shallow
//! angles, where a µm across is many along the layer. Less than a layer's thickness is a warning
//! there. A bounded number of segments of each layer is looked at, spread evenly over the layer: when there
//! are too many, every other one is dropped and only every second, fourth, eighth … is taken from
//! then on. Neither prints whose outlines are moved outwards on purpose are judged nor planar layers in
//! which the nozzle leaves its plane. mm, part frame.

use machine::kinematics::Alignment;
use machine::profile::Printer;
use machine::program::Role;
use mesh::mesh::Mesh;
use nalgebra::{Point2, Point3, Vector3};

use crate::columns::Columns;
use crate::family::Family;
use crate::finding::{Findings, Place, Severity, exceeds};
use crate::nearest::Nearest;
use crate::replay::LayerMark;
use crate::rounding;
use crate::section::Section;
use crate::segment::Segment;

/// The name of this check.
pub const NAME: &str = "deposit";

/// How far a bead may stick out of the section, mm: less than the unevenness of any printed wall.
pub const STICK_OUT: f64 = 0.02;

/// What is added for the places of the text, mm: chord (0.005), simplification (0.002), the last
/// places (0.001), and half the step of `;WIDTH:` (0.005). Coarser tolerances come on top.
pub const SLACK: f64 = 0.013;

/// Beads farther out than this are said to lie where the part is not, mm.
const FAR_OUT: f64 = 1.0;

/// Share of the layer's thickness above which a bead in a slope counts as the whole one.
const WHOLE: f64 = 0.9;

/// The mesh, as curved layers need it.
#[derive(Debug)]
pub(crate) struct Solid<'a> {
    columns: Columns<'a>,
    nearest: Nearest,
}

impl<'a> Solid<'a> {
    /// Prepares a mesh.
    pub(crate) fn new(mesh: &'a Mesh) -> Self {
        Self { columns: Columns::new(mesh), nearest: Nearest::new(mesh) }
    }
}

/// Segments looked at in a layer. Each costs 0.1 µs and 64 bytes; 4096 segments of a usual length
/// are 2 m of wall, so that nearly every layer is looked at in full.
const MOST_SAMPLES: usize = 4096;

/// One segment looked at.
#[derive(Debug, Clone, Copy)]
struct Sample {
    line: usize,
    middle: Point3<f64>,
    /// From the middle to the left along the layer, of length 1.
    side: Vector3<f64>,
    half_width: f64,
    /// Half the thickness of the bead.
    half_height: f64,
}

/// Samples the outermost beads of a layer.
#[derive(Debug, Clone, Default)]
pub(crate) struct Deposit {
    samples: Vec<Sample>,
    /// Segments seen in this layer.
    seen: usize,
    /// One of so many is looked at; a power of two.
    every: usize,
    layer: Option<usize>,
    family: Family,
    alignment: Alignment,
    filament_area: f64,
    /// Whether outlines lie outside of those of the mesh on purpose: nothing is judged then.
    is_grown: bool,
    top: f64,
    /// Half the thickness of the layer, mm.
    half_height: f64,
    /// What lines may lie farther off than is usual, mm.
    coarse: f64,
    /// The same of the last bead.
    half_of_last: f64,
    /// Whether the layer can be judged.
    is_sound: bool,
}

impl Deposit {
    /// Returns the check for this printer, of a program whose lines may lie so much farther off than
    /// is usual, mm.
    #[must_use]
    pub(crate) fn new(printer: &Printer, filament_area: f64, coarse: f64) -> Self {
        Self { alignment: printer.alignment, filament_area, coarse, ..Self::default() }
    }

    /// Allows for outlines that are moved on purpose, outwards when that is more than zero.
    #[must_use]
    pub(crate) fn moved(self, by: f64) -> Self {
        Self { is_grown: by > 0.0, ..self }
    }

    /// Begins a layer.
    pub(crate) fn layer(&mut self, mark: &LayerMark) {
        self.samples.clear();
        (self.seen, self.every) = (0, 1);
        (self.layer, self.top) = (Some(mark.index), mark.top.unwrap_or_default());
        self.family = mark.family.unwrap_or_default();
        self.half_height = mark.height.unwrap_or_default() / 2.0;
        self.half_of_last = self.half_height;
        self.is_sound =
            mark.top.is_some() && mark.height.is_some() && !mark.climbs && !self.is_grown;
    }

    pub(crate) fn segment(&mut self, segment: &Segment) {
        // Walls that hang over are outer ones, or lie inside of one.
        let is_outer = matches!(segment.role, Role::ExternalPerimeter | Role::OverhangPerimeter);
        if !is_outer || !segment.extrudes() || !self.is_sound {
            return;
        }
        let [from, to] = &segment.part;
        if self.family == Family::Planar {
            let off = (from.z - self.top).abs().max((to.z - self.top).abs());
            // What begins or ends in a slope lies within the layer, beside the same outline.
            if segment.slopes && exceeds(off, rounding::IN_PLANE) {
                return;
            }
            self.is_sound = !exceeds(off, rounding::IN_PLANE);
        }
        // So does it on curved layers, in a half of the layer: its middle is not that of the whole bead.
        let is_whole = |t: f64| t >= WHOLE * 2.0 * self.half_height;
        if segment.slopes && !segment.thickness(self.filament_area).is_some_and(is_whole) {
            return;
        }
        let middle = segment.middle(&self.alignment);
        let along = to - from;
        let aside = self.family.normal(&middle).cross(&along);
        let length = aside.norm();
        if exceeds(rounding::LENGTH, length) {
            return;
        }
        if self.seen.is_multiple_of(self.every) {
            self.thin_out();
        }
        let half_height = self.half_height_of(segment);
        if self.seen.is_multiple_of(self.every) {
            self.samples.push(Sample {
                line: segment.line,
                middle,
                side: aside / length,
                half_width: segment.width / 2.0,
                half_height,
            });
        }
        self.seen += 1;
    }

    /// Half the thickness of a bead: curved layers are thinner or thicker in places. What is too short
    /// to tell is like the bead before, and what is too thick for any bead like its layer.
    fn half_height_of(&mut self, segment: &Segment) -> f64 {
        let of_layer = self.half_height;
        if self.family == Family::Planar {
            return of_layer;
        }
        if let Some(thickness) = segment.thickness(self.filament_area) {
            let is_sound = thickness > 0.0 && thickness < 4.0 * of_layer;
            self.half_of_last = if is_sound { thickness / 2.0 } else { of_layer };
        }
        self.half_of_last
    }

    /// Makes room for one more sample.
    fn thin_out(&mut self) {
        if self.samples.len() == MOST_SAMPLES {
            let mut index = 0;
            self.samples.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.every *= 2;
        }
    }

    /// Returns whether the layer that ends needs the mesh's columns to be judged.
    pub(crate) fn is_curved(&self) -> bool {
        self.family != Family::Planar && !self.samples.is_empty()
    }

    /// Judges the planar layer that ends, by its section.
    pub(crate) fn end_of_layer(&mut self, section: &Section, findings: &mut Findings) {
        if !self.is_sound || self.samples.is_empty() || self.is_curved() {
            return;
        }
        let probes: Vec<Point2<f64>> = self
            .samples
            .iter()
            .flat_map(|sample| [1.0, -1.0].map(|sign| sample.probe(sign, self.coarse).xy()))
            .collect();
        let windings = section.windings(&probes);
        for (sample, windings) in self.samples.iter().zip(windings.chunks(2)) {
            let Some(left) = windings.iter().position(|&winding| winding == 0) else { continue };
            let sign = if left == 0 { 1.0 } else { -1.0 };
            let out = section.distance(&sample.at(sign * sample.half_width).xy());
            self.report(sample, out, Severity::Error, findings);
        }
    }

    /// Judges the curved layer that ends, by the mesh's columns and its surface.
    pub(crate) fn end_of_curved_layer(&mut self, solid: &Solid<'_>, findings: &mut Findings) {
        if !self.is_sound {
            return;
        }
        for sample in &self.samples {
            // Wedges on a flat floor are laid for the middle of their layer, layers of uneven
            // thickness for their own.
            let halves = [self.half_height, sample.half_height];
            let out = halves.map(|half| self.out_of(solid, sample, half));
            let out = out[0].min(out[1]);
            if !exceeds(out, STICK_OUT + SLACK + self.coarse) {
                continue;
            }
            let severity = if exceeds(out, 2.0 * sample.half_height) {
                Severity::Error
            } else {
                Severity::Warning
            };
            self.report(sample, out, severity, findings);
        }
    }

    /// How far a bead sticks out of the part `depth` under the nozzle, mm; 0 where it does not.
    fn out_of(&self, solid: &Solid<'_>, sample: &Sample, depth: f64) -> f64 {
        // Along the layer, which near the apex of a cone is far from straight.
        let at = |aside: f64| {
            let p = self.family.walk(&sample.middle, &sample.side, aside);
            p - self.family.normal(&p) * depth
        };
        let is_outside = |aside: f64| solid.columns.winding(&at(aside)) == 0;
        let sides = [1.0, -1.0].into_iter();
        let out = sides
            .filter(|sign| is_outside(sample.inner(self.coarse) * sign))
            .map(|sign| solid.nearest.distance(&at(sign * sample.half_width), FAR_OUT));
        out.fold(0.0, f64::max)
    }

    fn report(&self, sample: &Sample, out: f64, severity: Severity, findings: &mut Findings) {
        let place = Place { line: sample.line, layer: self.layer, at: Some(sample.middle) };
        findings.add(NAME, severity, place, (out, STICK_OUT), || {
            if out.is_finite() {
                let width = 2.0 * sample.half_width;
                format!(
                    "an outer bead {width:.2} mm wide sticks {out:.3} mm out of the part, at most \
                     {STICK_OUT} mm"
                )
            } else {
                "an outer bead lies where the part has no section".into()
            }
        });
    }
}

impl Sample {
    /// How far from the middle line the mesh is asked, mm.
    fn inner(&self, coarse: f64) -> f64 {
        (self.half_width - STICK_OUT - SLACK - coarse).max(0.0)
    }

    fn probe(&self, sign: f64, coarse: f64) -> Point3<f64> {
        self.at(sign * self.inner(coarse))
    }

    fn at(&self, aside: f64) -> Point3<f64> {
        self.middle + self.side * aside
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::part_segment;
    use crate::section::Sweep;
    use crate::section::tests::block;

    fn mark(index: usize, top: f64, family: Option<Family>) -> LayerMark {
        LayerMark { line: 1, index, top: Some(top), height: Some(0.2), family, climbs: false }
    }

    /// A wall along x at this y in a block of 20 mm with a hole of 8 mm, in pieces.
    fn found(y: f64, pieces: u32) -> Vec<(f64, String)> {
        let mut section = Section::default();
        Sweep::new(&block(10.0, 4.0, 1.0, 0.0)).cut(0.5, &mut section);
        let (mut check, mut findings) = (Deposit::default(), Findings::default());
        check.layer(&mark(3, 0.6, None));
        for k in 0..pieces {
            let x = |k: u32| -3.0 + 6.0 * f64::from(k) / f64::from(pieces);
            let mut segment =
                part_segment(Point3::new(x(k), y, 0.6), Point3::new(x(k + 1), y, 0.6));
            (segment.role, segment.filament) = (Role::ExternalPerimeter, 0.1);
            check.segment(&segment);
        }
        check.end_of_layer(&section, &mut findings);
        assert!(check.samples.len() <= MOST_SAMPLES);
        assert!(check.samples.len() >= MOST_SAMPLES.min(pieces as usize) / 2);
        findings.kept().iter().map(|found| (found.measured, found.message.clone())).collect()
    }

    #[test]
    fn a_bead_at_the_outline_stays_within() {
        // The bead is 0.45 mm wide.
        for y in [9.775, 9.775 + 0.03, -9.775, 4.225, 4.225 - 0.03, 7.0] {
            assert!(found(y, 1).is_empty(), "{y}");
            assert!(found(y, 5_500).is_empty(), "{y}");
        }
    }

    #[test]
    fn a_bead_beyond_it_does_not() {
        for (y, out) in [(9.775 + 0.04, 0.04), (-9.9, 0.125), (4.1, 0.125)] {
            let found = found(y, 1);
            assert_eq!(found.len(), 1, "{y}");
            assert!((found[0].0 - out).abs() < 1e-9, "{found:?}");
            assert!(found[0].1.contains("an outer bead 0.45 mm wide"), "{found:?}");
        }
        assert!(found(9.9, 5_500).len() > 10);
        assert_eq!(found(12.0, 5).len(), 5);
    }

    #[test]
    fn an_empty_section_and_a_curved_layer() {
        let (mut check, mut findings) = (Deposit::default(), Findings::default());
        let mut segment = part_segment(Point3::new(0.0, 5.0, 0.6), Point3::new(2.0, 5.0, 0.6));
        (segment.role, segment.filament) = (Role::ExternalPerimeter, 0.1);
        check.layer(&mark(0, 0.6, None));
        check.segment(&segment);
        check.end_of_layer(&Section::default(), &mut findings);
        assert!(findings.kept()[0].message.contains("no section"));
        check.layer(&mark(0, 0.8, None));
        check.segment(&segment);
        check.end_of_layer(&Section::default(), &mut findings);
        assert_eq!(findings.kept().len(), 1);
    }

    #[test]
    fn beads_of_a_cone_are_looked_at_along_the_layer() {
        // In a block of 20 mm, on a cone that falls 30° outwards: the bead's outer side may lie at
        // y = 10 half a layer under the nozzle, along the normal.
        let family = Family::Conical { slope: 30_f64.to_radians().tan() };
        let block = block(10.0, 0.0, 20.0, 0.0);
        let solid = Solid::new(&block);
        let (sin, cos) = 30_f64.to_radians().sin_cos();
        let fits = 10.0 - 0.225 * cos + 0.1 * sin;
        let found = |y: f64| {
            let (mut check, mut findings) = (Deposit::default(), Findings::default());
            check.layer(&mark(0, 15.0, Some(family)));
            let at = |x: f64| Point3::new(x, y, family.height(15.0, y.hypot(x)));
            let mut segment = part_segment(at(-0.05), at(0.05));
            (segment.role, segment.filament) = (Role::ExternalPerimeter, 0.1);
            check.segment(&segment);
            check.end_of_curved_layer(&solid, &mut findings);
            findings.kept().first().map(|found| found.measured)
        };
        assert_eq!((found(fits), found(fits + 0.025), found(5.0)), (None, None, None));
        let out = found(fits + 0.1).unwrap();
        assert!((out - 0.1).abs() < 1e-3, "{out}");
        assert_eq!(found(11.5), Some(f64::INFINITY));
    }
}
