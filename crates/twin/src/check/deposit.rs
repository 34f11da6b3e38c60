//! Does the outermost bead stay within the part?
//!
//! Halfway along external perimeters both sides of the bead are looked at: a point
//! [`STICK_OUT`] + [`SLACK`] inside either side must lie in the mesh's section at the middle of the
//! layer. A bounded number of segments of each layer is looked at, spread evenly over the layer:
//! when there are too many, every other one is dropped and only every second, fourth, eighth …
//! is taken from then on. Layers in which the nozzle leaves its plane are not judged. mm, part
//! frame.

use machine::program::Role;
use nalgebra::{Point2, Point3, Vector2};

use crate::finding::{Findings, Place, exceeds};
use crate::rounding;
use crate::section::Section;
use crate::segment::Segment;

/// The name of this check.
pub const NAME: &str = "deposit";

/// How far a bead may stick out of the section, mm: less than the unevenness of any printed wall.
pub const STICK_OUT: f64 = 0.02;

/// What is added for the places of the text, mm: chord (0.005), simplification (0.002), the last
/// places (0.001), and half the step of `;WIDTH:` (0.005).
pub const SLACK: f64 = 0.013;

/// Segments looked at in a layer. Each costs 0.1 µs and 64 bytes; 4096 segments of a usual length
/// are 2 m of wall, so that nearly every layer is looked at in full.
const MOST_SAMPLES: usize = 4096;

/// One segment looked at.
#[derive(Debug, Clone, Copy)]
struct Sample {
    line: usize,
    middle: Point3<f64>,
    /// From the middle to the left, of length 1.
    side: Vector2<f64>,
    half_width: f64,
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
    top: f64,
    is_plane: bool,
}

impl Deposit {
    /// Begins a layer whose upper side lies at `top`; `None` when that is not known.
    pub(crate) fn layer(&mut self, index: usize, top: Option<f64>) {
        self.samples.clear();
        (self.seen, self.every) = (0, 1);
        (self.layer, self.top) = (Some(index), top.unwrap_or_default());
        self.is_plane = top.is_some();
    }

    pub(crate) fn segment(&mut self, segment: &Segment) {
        if segment.role != Role::ExternalPerimeter || !segment.extrudes() || !self.is_plane {
            return;
        }
        let [from, to] = &segment.part;
        let off = (from.z - self.top).abs().max((to.z - self.top).abs());
        self.is_plane = !exceeds(off, rounding::IN_PLANE);
        let along = to.xy() - from.xy();
        let length = along.norm();
        if length < rounding::LENGTH {
            return;
        }
        if self.seen.is_multiple_of(self.every) {
            self.thin_out();
        }
        if self.seen.is_multiple_of(self.every) {
            self.samples.push(Sample {
                line: segment.line,
                middle: segment.middle,
                side: Vector2::new(-along.y, along.x) / length,
                half_width: segment.width / 2.0,
            });
        }
        self.seen += 1;
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

    /// Judges the layer that ends, by its section.
    pub(crate) fn end_of_layer(&mut self, section: &Section, findings: &mut Findings) {
        if !self.is_plane || self.samples.is_empty() {
            return;
        }
        let probes: Vec<Point2<f64>> = self
            .samples
            .iter()
            .flat_map(|sample| {
                let inner = (sample.half_width - STICK_OUT - SLACK).max(0.0);
                [1.0, -1.0].map(|sign| sample.at(sign * inner))
            })
            .collect();
        let windings = section.windings(&probes);
        for (sample, windings) in self.samples.iter().zip(windings.chunks(2)) {
            let Some(left) = windings.iter().position(|&winding| winding == 0) else { continue };
            let sign = if left == 0 { 1.0 } else { -1.0 };
            self.report(sample, sign, section, findings);
        }
    }

    fn report(&self, sample: &Sample, sign: f64, section: &Section, findings: &mut Findings) {
        let out = section.distance(&sample.at(sign * sample.half_width));
        let place = Place { line: sample.line, layer: self.layer, at: Some(sample.middle) };
        findings.error(NAME, place, (out, STICK_OUT), || {
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
    fn at(&self, aside: f64) -> Point2<f64> {
        self.middle.xy() + self.side * aside
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::part_segment;
    use crate::section::Sweep;
    use crate::section::tests::block;

    /// A wall along x at this y in a block of 20 mm with a hole of 8 mm, in pieces.
    fn found(y: f64, pieces: u32) -> Vec<(f64, String)> {
        let mut section = Section::default();
        Sweep::new(&block(10.0, 4.0, 1.0, 0.0)).cut(0.5, &mut section);
        let (mut check, mut findings) = (Deposit::default(), Findings::default());
        check.layer(3, Some(0.6));
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
        check.layer(0, Some(0.6));
        check.segment(&segment);
        check.end_of_layer(&Section::default(), &mut findings);
        assert!(findings.kept()[0].message.contains("no section"));
        check.layer(0, Some(0.8));
        check.segment(&segment);
        check.end_of_layer(&Section::default(), &mut findings);
        assert_eq!(findings.kept().len(), 1);
    }
}
