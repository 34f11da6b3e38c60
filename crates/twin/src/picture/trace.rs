//! Segments joined to lines, with the points left out that no eye would miss.

use machine::kinematics::Alignment;
use machine::program::Role;
use nalgebra::Point3;

use crate::segment::Segment;

/// A line of one kind, part frame, mm.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trace {
    pub(super) kind: Stroke,
    /// At least two.
    pub(super) points: Vec<Point3<f64>>,
}

/// What a line shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Stroke {
    /// Material of a role and width (mm).
    Bead(Role, f64),
    /// The nozzle on its way.
    Travel,
}

/// Ends of segments that are nearer than this belong together, mm.
const JOINED: f64 = 1e-6;

/// Points that may wait for the decision whether they are left out. More would make the decision
/// slow without leaving out many more.
const MOST_WAITING: usize = 32;

/// Collects segments as lines.
#[derive(Debug, Clone)]
pub(super) struct Tracer {
    alignment: Alignment,
    /// How far a line may lie from the points left out, mm.
    tolerance: f64,
    traces: Vec<Trace>,
    /// Points after the last one of the last line: the last of them is its end for now.
    waiting: Vec<Point3<f64>>,
    count: usize,
}

impl Tracer {
    pub(super) fn new(alignment: Alignment, tolerance: f64) -> Self {
        Self { alignment, tolerance, traces: Vec::new(), waiting: Vec::new(), count: 0 }
    }

    /// Returns about how many pieces there are.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    pub(super) fn add(&mut self, kind: Stroke, segment: &Segment) {
        let finite = |p: &Point3<f64>| p.coords.iter().all(|c| c.is_finite());
        let [from, to] = &segment.part;
        if !finite(from) || !finite(to) {
            return;
        }
        let continues = self.traces.last().is_some_and(|trace| trace.kind == kind)
            && self.waiting.last().is_some_and(|last| (last - from).norm() < JOINED);
        if !continues {
            self.flush();
            self.traces.push(Trace { kind, points: vec![*from] });
        }
        for point in segment.pieces(&self.alignment, self.tolerance.max(JOINED)) {
            self.point(point);
        }
    }

    fn point(&mut self, point: Point3<f64>) {
        let Some(trace) = self.traces.last_mut() else { return };
        let Some(anchor) = trace.points.last() else { return };
        let fits = self.waiting.len() < MOST_WAITING
            && self.waiting.iter().all(|p| distance(anchor, &point, p) <= self.tolerance);
        if !fits {
            trace.points.extend(self.waiting.last());
            self.count += 1;
            self.waiting.clear();
        }
        self.waiting.push(point);
    }

    fn flush(&mut self) {
        if let (Some(trace), Some(last)) = (self.traces.last_mut(), self.waiting.last()) {
            trace.points.push(*last);
            self.count += 1;
        }
        self.waiting.clear();
    }

    /// Returns the lines and begins anew.
    pub(super) fn take(&mut self) -> Vec<Trace> {
        self.flush();
        self.count = 0;
        std::mem::take(&mut self.traces)
    }
}

fn distance(a: &Point3<f64>, b: &Point3<f64>, p: &Point3<f64>) -> f64 {
    let along = b - a;
    let square = along.norm_squared();
    let share = if square > 0.0 { ((p - a).dot(&along) / square).clamp(0.0, 1.0) } else { 0.0 };
    (a + along * share - p).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::polar_segment;

    #[test]
    fn straight_lines_need_two_points_and_arcs_more() {
        let mut tracer = Tracer::new(Alignment::default(), 0.01);
        let kind = Stroke::Bead(Role::Perimeter, 0.45);
        for k in 0..10 {
            let s = 20.0 + f64::from(k);
            tracer.add(kind, &polar_segment([s, 0.0], [s + 1.0, 0.0], 20.0));
        }
        tracer.add(kind, &polar_segment([30.0, 0.0], [30.0, 1.0], 20.0));
        tracer.add(Stroke::Travel, &polar_segment([30.0, 1.0], [40.0, 1.0], 20.0));
        let traces = tracer.take();
        assert_eq!(traces.len(), 2);
        assert_eq!(traces[0].points[1], Point3::new(30.0, 0.0, 0.2));
        let arc = &traces[0].points[1..];
        assert!(arc.len() > 10 && arc.len() < 60, "{}", arc.len());
        for pair in arc.windows(2) {
            let middle = nalgebra::center(&pair[0], &pair[1]);
            assert!((middle.xy().coords.norm() - 30.0).abs() < 0.03);
        }
        assert!(tracer.take().is_empty());
    }

    #[test]
    fn what_is_not_finite_is_left_out() {
        let mut tracer = Tracer::new(Alignment::default(), 0.01);
        tracer.add(Stroke::Travel, &polar_segment([30.0, 1.0], [f64::NAN, 1.0], 20.0));
        assert!(tracer.take().is_empty());
    }
}
