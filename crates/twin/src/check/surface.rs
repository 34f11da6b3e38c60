//! Does every bead lie on the surface of its layer, and every layer its thickness above the one
//! before?
//!
//! The level of a layer is the median of the levels of all places where it lays material: the ends
//! and the middle of every line. Half of the lines would have to be wrong together to move it. The
//! distance of a place from its layer is its difference of level times the thickness of a unit of
//! level there.
//!
//! Where lines go round the axis, nearer than [`ROUND_AXIS`] clearances, cones are not judged: at
//! their tip, which no such line can reach.
//!
//! From one layer of a family to the next the level grows by the announced thickness, or by a whole
//! multiple of it where curved layers pass beside the part and are left out. The first layer lies
//! its thickness above the bed.
//!
//! Planes that are announced and hold nothing are told, where something follows: it begins in mid-air.
//!
//! Walls that begin and end in a slope, as announced, lie within their layer: at most its thickness
//! below its surface.
//!
//! A program that announces its surfaces (see [`crate::family`]) claims all this, and what is found
//! is an error. Of others it is a warning: a wall that climbs in a helix is printed on purpose.

use machine::kinematics::Alignment;
use machine::profile::Printer;
use machine::program::Role;
use nalgebra::Point3;

use crate::family::Family;
use crate::finding::{Findings, Place, Severity, exceeds};
use crate::replay::LayerMark;
use crate::rounding;
use crate::segment::Segment;

/// The name of this check.
pub const NAME: &str = "surface";

/// How far a bead may lie from its layer, mm: a twentieth of a thin layer. Chords take up to 7 µm
/// of it on curved layers.
pub const OFF: f64 = 0.010;

/// Lines that go round the axis do so at one clearance; twice that is where they leave it.
pub const ROUND_AXIS: f64 = 2.0;

/// Gathers the levels of a layer, and judges it when it ends.
#[derive(Debug)]
pub(crate) struct Surface {
    /// Nearer to the axis cones are not judged, mm.
    tip: f64,
    alignment: Alignment,
    mark: Option<LayerMark>,
    samples: Vec<Sample>,
    /// The layer before: its family and level.
    last: Option<(Family, f64)>,
    /// Planes without material since then.
    n_empty: usize,
    worst: f64,
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    line: usize,
    /// How much lower than its layer it may lie, mm.
    lower: f64,
    at: Point3<f64>,
    level: f64,
}

impl Surface {
    /// Returns the check for this printer.
    #[must_use]
    pub(crate) fn new(printer: &Printer) -> Self {
        Self {
            tip: ROUND_AXIS * printer.axis_clearance,
            alignment: printer.alignment,
            mark: None,
            samples: Vec::new(),
            last: None,
            n_empty: 0,
            worst: 0.0,
        }
    }

    /// Begins a layer; the one before has been [ended](Self::end_of_layer).
    pub(crate) fn layer(&mut self, mark: LayerMark) {
        self.mark = Some(mark);
        self.samples.clear();
    }

    pub(crate) fn segment(&mut self, segment: &Segment) {
        let Some(mark) = &self.mark else { return };
        if !segment.extrudes() || segment.role == Role::Custom {
            return;
        }
        let family = mark.family.unwrap_or_default();
        let line = segment.line;
        let tip = if let Family::Conical { .. } = family { self.tip } else { 0.0 };
        let lower = if segment.slopes { mark.height.unwrap_or_default() } else { 0.0 };
        let mut sample = |at: Point3<f64>| {
            // Written so that what is not a number is judged.
            if !(tip > 0.0 && at.x.hypot(at.y) < tip) {
                self.samples.push(Sample { line, lower, at, level: family.level(&at) });
            }
        };
        sample(segment.part[0]);
        if family != Family::Planar {
            sample(segment.middle(&self.alignment));
        }
        sample(segment.part[1]);
    }

    /// Judges the layer that ends.
    pub(crate) fn end_of_layer(&mut self, findings: &mut Findings) {
        let Some(mark) = self.mark else { return };
        let Some(level) = median(&self.samples) else {
            self.empty(&mark);
            return;
        };
        self.after_empty(&mark, findings);
        let severity = if mark.family.is_some() { Severity::Error } else { Severity::Warning };
        let family = mark.family.unwrap_or_default();
        if mark.climbs {
            self.turn(&mark, severity, findings);
            return;
        }
        for sample in &self.samples {
            let off = (sample.level - level) * family.thickness_per_level(&sample.at);
            let off = if off < 0.0 { (-off - sample.lower).max(0.0) } else { off };
            if exceeds(off, OFF) {
                let place =
                    Place { line: sample.line, layer: Some(mark.index), at: Some(sample.at) };
                findings.add(NAME, severity, place, (off, OFF), || {
                    format!(
                        "a bead lies {off:.4} mm off its {} layer, at most {OFF} mm",
                        family.name()
                    )
                });
            }
            if !off.is_nan() {
                self.worst = self.worst.max(off);
            }
        }
        self.step(&mark, level, severity, findings);
        self.last = Some((family, level));
    }

    /// Takes note of a plane that was announced and holds nothing: the next lies above it.
    fn empty(&mut self, mark: &LayerMark) {
        let is_plane = mark.family.unwrap_or_default() == Family::Planar;
        let (true, Some(height)) = (is_plane, mark.height) else { return };
        let below = match self.last {
            None => 0.0,
            Some((Family::Planar, below)) => below,
            // Planes on a curved stage begin where they begin.
            Some(_) => return,
        };
        self.last = Some((Family::Planar, below + height));
        self.n_empty += 1;
    }

    /// Tells that a layer has nothing below it but layers that hold nothing.
    fn after_empty(&mut self, mark: &LayerMark, findings: &mut Findings) {
        let count = std::mem::take(&mut self.n_empty);
        if count > 0 {
            let place = Place::line(mark.line, Some(mark.index));
            findings.warning(NAME, place, (count as f64, 0.0), || {
                format!("the layer begins in mid-air: nothing was laid in {count} below it")
            });
        }
    }

    /// Judges a layer that climbs in one turn: it takes the height of one layer.
    fn turn(&mut self, mark: &LayerMark, severity: Severity, findings: &mut Findings) {
        let family = mark.family.unwrap_or_default();
        let by_level = |a: &&Sample, b: &&Sample| a.level.total_cmp(&b.level);
        let Some(low) = self.samples.iter().min_by(by_level) else { return };
        let Some(high) = self.samples.iter().max_by(by_level) else { return };
        let climbs = (high.level - low.level) * family.thickness_per_level(&high.at);
        let limit = mark.height.unwrap_or_default() + OFF;
        if exceeds(climbs, limit) {
            let place = Place { line: high.line, layer: Some(mark.index), at: Some(high.at) };
            findings.add(NAME, severity, place, (climbs, limit), || {
                format!("a turn climbs by {climbs:.3} mm, at most {limit:.3} mm")
            });
        }
        self.last = Some((family, high.level));
    }

    /// Judges how far the layer lies above the one before.
    fn step(&self, mark: &LayerMark, level: f64, severity: Severity, findings: &mut Findings) {
        let Some(height) = mark.height.filter(|height| *height > 0.0) else { return };
        let family = mark.family.unwrap_or_default();
        let below = match self.last {
            None if family == Family::Planar => 0.0,
            Some((last, below)) if last == family => below,
            // The first layer of a curved family is a wedge on what lies below.
            _ => return,
        };
        let thickness = (level - below) * family.announced_per_level();
        let steps = if family == Family::Planar { 1.0 } else { (thickness / height).round() };
        let off = (thickness - steps.max(1.0) * height).abs();
        let limit = OFF + rounding::LENGTH * steps.max(1.0);
        if exceeds(off, limit) {
            let place = Place::line(mark.line, Some(mark.index));
            findings.add(NAME, severity, place, (off, limit), || {
                format!(
                    "the layer lies {thickness:.3} mm above what is below, its thickness is \
                     {height} mm"
                )
            });
        }
    }

    /// Returns the greatest distance of a bead from its layer so far, mm.
    #[must_use]
    pub(crate) fn worst(&self) -> f64 {
        self.worst
    }
}

/// The median level; `None` without samples.
fn median(samples: &[Sample]) -> Option<f64> {
    let mut levels: Vec<f64> = samples.iter().map(|sample| sample.level).collect();
    if levels.is_empty() {
        return None;
    }
    let middle = levels.len() / 2;
    Some(*levels.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{part_segment, printer};

    const CONE: Family = Family::Conical { slope: 0.5 };

    /// A plane without material is told when something lies above it, and is no gap.
    #[test]
    fn what_begins_above_an_empty_layer_is_in_mid_air() {
        let (mut check, mut findings) = (Surface::new(&printer()), Findings::default());
        let mark = |index: usize| LayerMark {
            line: 10 * index,
            index,
            top: Some(0.0),
            height: Some(0.2),
            family: Some(Family::Planar),
            climbs: false,
        };
        for index in 0..4 {
            check.layer(mark(index));
            if index == 2 {
                let at = |x: f64| Point3::new(x, 1.0, 0.6);
                let mut segment = part_segment(at(12.0), at(12.5));
                (segment.filament, segment.role) = (0.1, Role::Perimeter);
                check.segment(&segment);
            }
            check.end_of_layer(&mut findings);
        }
        let found: Vec<_> = findings.kept().iter().map(|f| (f.line, f.severity)).collect();
        assert_eq!(found, [(20, Severity::Warning)]);
    }

    /// Layers of four lines each at these levels, the third line of the last raised by `raised`.
    fn found(family: Option<Family>, levels: &[f64], raised: f64) -> (Vec<f64>, f64) {
        let (mut check, mut findings) = (Surface::new(&printer()), Findings::default());
        for (index, &level) in levels.iter().enumerate() {
            let mark = LayerMark {
                line: 10 * index,
                index,
                top: None,
                height: Some(0.2),
                family,
                climbs: false,
            };
            check.layer(mark);
            for k in 0..4 {
                let is_raised = index + 1 == levels.len() && k == 2;
                let by = if is_raised { raised } else { 0.0 };
                let at = |x: f64| {
                    let r = x.hypot(f64::from(k));
                    let z = family.unwrap_or_default().height(level, r);
                    Point3::new(x, f64::from(k), z + by)
                };
                let mut segment = part_segment(at(12.0), at(12.5));
                (segment.filament, segment.role) = (0.1, Role::Perimeter);
                check.segment(&segment);
            }
            check.end_of_layer(&mut findings);
        }
        let measured = findings.kept().iter().map(|finding| finding.measured).collect();
        (measured, check.worst())
    }

    #[test]
    fn layers_on_their_surfaces_are_sound() {
        let (none, worst) = found(None, &[0.2, 0.4, 0.6], 0.0);
        assert_eq!((none, worst), (vec![], 0.0));
        let step = 0.2 * 1.25_f64.sqrt();
        // The fourth is two steps above the third: one passed beside the part.
        let levels = [8.0, 8.0 + step, 8.0 + 2.0 * step, 8.0 + 4.0 * step];
        let (none, worst) = found(Some(CONE), &levels, 0.0);
        assert!(none.is_empty() && worst < 1e-3, "{none:?} {worst}");
    }

    #[test]
    fn caps_lie_their_thickness_apart_on_the_axis() {
        // 12 mm out their normals lean by 37°.
        let caps = Some(Family::Caps { radius: 20.0 });
        assert!(found(caps, &[8.0, 8.2, 8.4, 9.0], 0.0).0.is_empty());
        let along_normal = 0.2 / 0.8;
        assert_eq!(found(caps, &[8.0, 8.0 + along_normal], 0.0).0.len(), 1);
    }

    #[test]
    fn a_bead_off_its_layer_is_found() {
        for (raised, count) in [(0.009, 0), (0.012, 2), (-0.012, 2)] {
            assert_eq!(found(None, &[0.2, 0.4], raised).0.len(), count, "{raised}");
        }
        // Along the normal it is less: 0.0125 · cos(26.6°) = 0.0112; the chord is off too.
        let (off, worst) = found(Some(CONE), &[8.0], 0.0125);
        assert_eq!(off.len(), 3);
        assert!((worst - 0.0125 * 0.8_f64.sqrt()).abs() < 1e-3, "{worst}");
    }

    #[test]
    fn a_shifted_layer_is_found() {
        assert_eq!(found(None, &[0.2, 0.45], 0.0).0.len(), 1);
        assert_eq!(found(None, &[0.25, 0.45], 0.0).0.len(), 1);
        assert_eq!(found(None, &[0.2, 0.6], 0.0).0.len(), 1);
        let step = 0.2 * 1.25_f64.sqrt();
        assert_eq!(found(Some(CONE), &[8.0, 8.05 + step], 0.0).0.len(), 1);
    }

    #[test]
    fn what_has_no_level_is_found() {
        // Caps of a sphere of 5 mm do not reach 12 mm out.
        let family = Some(Family::Caps { radius: 5.0 });
        let (mut check, mut findings) = (Surface::new(&printer()), Findings::default());
        check.layer(LayerMark {
            line: 1,
            index: 0,
            top: None,
            height: None,
            family,
            climbs: false,
        });
        let mut segment = part_segment(Point3::new(12.0, 0.0, 0.2), Point3::new(12.5, 0.0, 0.2));
        (segment.filament, segment.role) = (0.1, Role::Perimeter);
        check.segment(&segment);
        check.end_of_layer(&mut findings);
        assert_eq!(findings.checks(), [NAME]);
    }
}
