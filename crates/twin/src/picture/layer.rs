//! One layer from above.
//!
//! Beads as wide as they are announced, coloured by role; travels thin; the rotation axis, the
//! clearance about it and the reach of the rail; a small map of the whole bed, a scale and a
//! legend. Part frame, x to the right, y upwards.

use machine::kinematics::Alignment;
use machine::profile::Printer;
use machine::program::{BedTurn, Joints, Role};
use nalgebra::Point2;

use super::palette::{AXIS, Colour, INK, of_role};
use super::svg::{Canvas, DECIMALS, PathData, Pen};
use super::trace::{Stroke, Trace, Tracer};
use crate::segment::{Kind, Segment};

/// How far drawn lines may lie from replayed ones, mm.
const TOLERANCE: f64 = 0.005;

/// The side of the square in which the layer is drawn, pixels.
const SIDE: f64 = 800.0;

/// The column with map, legend and scale, pixels.
const COLUMN: f64 = 210.0;

/// Room around the layer, as a share of its size.
const MARGIN: f64 = 0.06;

/// Collects the segments of one layer.
#[derive(Debug, Clone)]
pub struct LayerSink {
    layer: usize,
    tracer: Tracer,
}

impl LayerSink {
    /// Returns a sink that keeps the segments of this layer only.
    #[must_use]
    pub fn new(layer: usize, printer: &Printer) -> Self {
        Self { layer, tracer: Tracer::new(printer.alignment, TOLERANCE) }
    }

    /// Takes note of a segment.
    pub fn add(&mut self, segment: &Segment) {
        if segment.layer != Some(self.layer) {
            return;
        }
        match segment.kind() {
            Kind::Extrusion => {
                // Width that is not announced is drawn as wide as a usual nozzle.
                let width = if segment.width > 0.0 { segment.width } else { 0.4 };
                self.tracer.add(Stroke::Bead(segment.role, width), segment);
            }
            Kind::Travel | Kind::Wipe => self.tracer.add(Stroke::Travel, segment),
            Kind::Retraction | Kind::Prime | Kind::Still => {}
        }
    }
}

/// Returns the picture of the layer.
#[must_use]
pub fn layer_svg(mut sink: LayerSink, printer: &Printer) -> String {
    let traces = sink.tracer.take();
    let alignment = &printer.alignment;
    let axis = alignment.part_from_bed(&nalgebra::Vector2::zeros());
    let view = View::around(&traces, &axis);
    let mut canvas = Canvas::new(SIDE + COLUMN, SIDE);
    canvas.begin_window(SIDE, SIDE);
    surroundings(&mut canvas, &view, printer, &axis);
    beads(&mut canvas, &view, &traces);
    travels(&mut canvas, &view, &traces);
    cross(&mut canvas, &view.pixel(&axis));
    canvas.end_window();
    let top = legend(&mut canvas, &traces, sink.layer);
    map(&mut canvas, &traces, printer, &axis, top + 40.0);
    scale(&mut canvas, view.scale);
    canvas.finish()
}

/// How places of the part become pixels.
#[derive(Debug, Clone, Copy)]
struct View {
    centre: Point2<f64>,
    /// Pixels for a millimetre.
    scale: f64,
    /// Where the centre is drawn.
    middle: [f64; 2],
}

impl View {
    /// The view of all beads, and of the axis when it is near them.
    fn around(traces: &[Trace], axis: &Point2<f64>) -> Self {
        let mut bounds = geom::bounding::Bounds::default();
        for trace in traces {
            let half = match trace.kind {
                Stroke::Bead(_, width) => width / 2.0,
                Stroke::Travel => continue,
            };
            for p in &trace.points {
                bounds.add(&(p + nalgebra::Vector3::repeat(half)));
                bounds.add(&(p - nalgebra::Vector3::repeat(half)));
            }
        }
        if bounds.is_empty() {
            bounds.add(&nalgebra::Point3::new(axis.x - 10.0, axis.y - 10.0, 0.0));
            bounds.add(&nalgebra::Point3::new(axis.x + 10.0, axis.y + 10.0, 0.0));
        }
        let size = bounds.size();
        let side = size.x.max(size.y).max(1.0) * (1.0 + 2.0 * MARGIN);
        let centre = nalgebra::center(&bounds.min, &bounds.max).xy();
        Self { centre, scale: SIDE / side, middle: [SIDE / 2.0, SIDE / 2.0] }
    }

    fn pixel(&self, p: &Point2<f64>) -> [f64; 2] {
        let off = (p - self.centre) * self.scale;
        [self.middle[0] + off.x, self.middle[1] - off.y]
    }

    fn data<'a>(&self, traces: impl IntoIterator<Item = &'a Trace>) -> PathData {
        let mut data = PathData::with_decimals(DECIMALS);
        for trace in traces {
            for (k, p) in trace.points.iter().enumerate() {
                let [x, y] = self.pixel(&p.xy());
                if k == 0 {
                    data.move_to(x, y);
                } else {
                    data.line_to(x, y);
                }
            }
        }
        data
    }
}

/// The bed's rings, the reach of the rail, the clearance about the axis.
fn surroundings(canvas: &mut Canvas, view: &View, printer: &Printer, axis: &Point2<f64>) {
    let [x, y] = view.pixel(axis);
    let reach = reach(printer);
    // Rings 10 mm apart show where the bed turns fast.
    let farthest = (SIDE / view.scale).hypot(SIDE / view.scale) + (axis - view.centre).norm();
    let mut radius = 10.0;
    while radius < reach.min(farthest) {
        let pen = Pen::new(INK, 1.0).faint(0.22);
        canvas.circle(x, y, radius * view.scale, &pen);
        radius += 10.0;
    }
    if reach < farthest {
        canvas.circle(x, y, reach * view.scale, &Pen::new(AXIS, 2.0).dashed(10.0, 6.0));
    }
    if !printer.passes_centre() && printer.axis_clearance > 0.0 {
        let pen = Pen::new(AXIS, 1.0).dashed(3.0, 3.0);
        canvas.circle(x, y, printer.axis_clearance * view.scale, &pen);
    }
}

fn beads(canvas: &mut Canvas, view: &View, traces: &[Trace]) {
    let mut kinds: Vec<(Role, f64)> = Vec::new();
    for trace in traces {
        if let Stroke::Bead(role, width) = trace.kind
            && !kinds.contains(&(role, width))
        {
            kinds.push((role, width));
        }
    }
    // Inside first, so that the outline is never hidden.
    kinds.sort_by_key(|(role, _)| std::cmp::Reverse(*role));
    for (role, width) in kinds {
        let of_kind = |trace: &&Trace| trace.kind == Stroke::Bead(role, width);
        let data = view.data(traces.iter().filter(of_kind));
        let (colour, pixels) = (of_role(role), width * view.scale);
        // A dark edge and a light ridge make single beads visible.
        canvas.path(&data, &Pen::new(colour.lit(0.68), pixels));
        canvas.path(&data, &Pen::new(colour, pixels * 0.78));
        canvas.path(&data, &Pen::new(colour.lit(1.3), pixels * 0.22).faint(0.8));
    }
}

fn travels(canvas: &mut Canvas, view: &View, traces: &[Trace]) {
    let data = view.data(traces.iter().filter(|trace| trace.kind == Stroke::Travel));
    canvas.path(&data, &travel_pen());
}

fn travel_pen() -> Pen {
    Pen::new(Colour([0x33, 0xb1, 0xff]), 1.2).dashed(5.0, 3.5)
}

fn cross(canvas: &mut Canvas, [x, y]: &[f64; 2]) {
    let (arm, gap) = (13.0, 3.5);
    let halo = Pen::new(Colour([255, 255, 255]), 4.5).faint(0.75);
    for pen in [halo, Pen::new(AXIS, 2.0)] {
        canvas.circle(*x, *y, 7.0, &pen);
        for (dx, dy) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            canvas.line([x + dx * gap, y + dy * gap], [x + dx * arm, y + dy * arm], &pen);
        }
    }
}

/// Returns where it ends.
fn legend(canvas: &mut Canvas, traces: &[Trace], layer: usize) -> f64 {
    let left = SIDE + 10.0;
    canvas.label(left, 40.0, 22.0, &format!("Layer {layer}"));
    let height = traces.iter().find_map(|trace| match trace.kind {
        Stroke::Bead(..) => trace.points.first().map(|p| p.z),
        Stroke::Travel => None,
    });
    let mut y = 62.0;
    if let Some(z) = height {
        canvas.label(left, y, 14.0, &format!("z = {} mm", machine::gcode::decimal(z, 3)));
        y += 34.0;
    }
    for role in Role::ALL {
        let is_drawn =
            |trace: &Trace| matches!(trace.kind, Stroke::Bead(drawn, _) if drawn == role);
        if traces.iter().any(is_drawn) {
            canvas.swatch([left, y - 12.0], [20.0, 14.0], of_role(role));
            canvas.label(left + 30.0, y, 14.0, role.label());
            y += 26.0;
        }
    }
    if traces.iter().any(|trace| trace.kind == Stroke::Travel) {
        canvas.line([left, y - 5.0], [left + 20.0, y - 5.0], &travel_pen());
        canvas.label(left + 30.0, y, 14.0, "Travel");
        y += 26.0;
    }
    cross(canvas, &[left + 10.0, y - 1.0]);
    canvas.label(left + 30.0, y + 4.0, 14.0, "Rotation axis");
    y + 26.0
}

/// The whole bed, small, with the layer on it.
fn map(canvas: &mut Canvas, traces: &[Trace], printer: &Printer, axis: &Point2<f64>, top: f64) {
    let radius = 80.0;
    let centre = [SIDE + 10.0 + radius, top + radius];
    let view = View { centre: *axis, scale: radius / reach(printer).max(1.0), middle: centre };
    canvas.circle(centre[0], centre[1], radius, &Pen::new(AXIS, 1.5).dashed(6.0, 4.0));
    let is_bead = |trace: &&Trace| matches!(trace.kind, Stroke::Bead(..));
    let data = view.data(traces.iter().filter(is_bead));
    canvas.path(&data, &Pen::new(of_role(Role::ExternalPerimeter), 0.8).faint(0.9));
    let pen = Pen::new(AXIS, 1.5);
    canvas.line([centre[0] - 4.0, centre[1]], [centre[0] + 4.0, centre[1]], &pen);
    canvas.line([centre[0], centre[1] - 4.0], [centre[0], centre[1] + 4.0], &pen);
    let text = format!("Reach {} mm", machine::gcode::decimal(reach(printer), 1));
    canvas.label(SIDE + 10.0, top + 2.0 * radius + 24.0, 14.0, &text);
}

/// A bar of a round length, about 120 pixels long.
fn scale(canvas: &mut Canvas, pixels_per_mm: f64) {
    let wanted = 120.0 / pixels_per_mm;
    let decade = 10.0_f64.powf(wanted.log10().floor());
    let steps = [5.0, 2.0, 1.0];
    let length = steps.into_iter().map(|k| k * decade).find(|&l| l <= wanted).unwrap_or(decade);
    let (left, y) = (SIDE + 10.0, SIDE - 24.0);
    let right = left + length * pixels_per_mm;
    let pen = Pen::new(INK, 2.0);
    canvas.line([left, y], [right, y], &pen);
    for x in [left, right] {
        canvas.line([x, y - 5.0], [x, y + 5.0], &pen);
    }
    let text = format!("{} mm", machine::gcode::decimal(length, 3));
    canvas.label(left, y - 12.0, 14.0, &text);
}

/// How far from the axis the nozzle comes, mm.
fn reach(printer: &Printer) -> f64 {
    let alignment: &Alignment = &printer.alignment;
    let outermost = Joints { s: printer.rail.max, turn: BedTurn::default(), z: 0.0 };
    alignment.over_bed(&alignment.part_from_joints(&outermost).xy()).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{polar_segment, printer};

    #[test]
    fn a_layer_shows_its_beads_and_nothing_of_others() {
        let printer = printer();
        let mut sink = LayerSink::new(0, &printer);
        let mut line = polar_segment([20.0, 0.0], [20.0, 1.0], 20.0);
        sink.add(&line);
        line.filament = 0.3;
        sink.add(&line);
        line.role = Role::GapFill;
        line.layer = Some(1);
        sink.add(&line);
        let svg = layer_svg(sink, &printer);
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
        for text in ["Layer 0", "z = 0.2 mm", "Perimeter", "Travel", "Reach 120 mm", "2 mm"] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(!svg.contains("Gap fill"));
    }

    #[test]
    fn an_empty_layer_is_a_picture_too() {
        let printer = printer();
        let svg = layer_svg(LayerSink::new(5, &printer), &printer);
        assert!(svg.contains("Layer 5") && !svg.contains("NaN"));
    }
}
