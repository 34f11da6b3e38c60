//! The whole print, isometric.
//!
//! Layers are painted from below upwards, so that what is in front hides what is behind. A bead is
//! a dark line with a light one on it; walls are lit from the left by the direction that they
//! face, which is the side towards the eye. Sparse infill is hidden in nearly every print and left
//! out, except on the layer drawn last.
//!
//! When there are more pieces than may be drawn, every other layer is dropped, then every second
//! of the rest, and so on; the topmost layer always stays.

use machine::profile::Printer;
use machine::program::Role;
use nalgebra::{Point2, Point3, Vector2};

use super::palette::{AXIS, Colour, INK, of_height, of_role};
use super::svg::{Canvas, PathData, Pen};
use super::trace::{Stroke, Trace, Tracer};
use crate::segment::Segment;

/// How far drawn lines may lie from replayed ones, mm.
const TOLERANCE: f64 = 0.03;

/// The longer side of the picture, pixels.
const SIDE: f64 = 1000.0;

/// Room around the print, pixels.
const MARGIN: f64 = 24.0;

/// Elevation of the eye above the bed: that of an isometric view, about 35°, less a little, so
/// that walls are seen better. Radians.
const ELEVATION: f64 = 0.52;

/// Azimuth of the eye, radians. Off the diagonal, so that square parts show two unlike sides.
const AZIMUTH: f64 = -1.05;

/// Where the light comes from, as an azimuth, radians: over the left shoulder.
const LIGHT: f64 = AZIMUTH - 0.8;

/// Walls that face the eye less than this, as a cosine, fade to the mean light.
const EDGE: f64 = 0.45;

/// Steps of light that are told apart. More make files larger, fewer make bands.
const STEPS: usize = 24;

/// How wide walls are drawn for each mm between drawn layers: about the cosine of the elevation
/// for upright walls, more so that walls that lean by 45° have no gaps.
const LEANING: f64 = 1.35;

/// What the colours mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shade {
    /// How high a bead lies.
    Height,
    /// What it is for.
    Role,
}

/// Collects the beads of a print.
#[derive(Debug, Clone)]
pub struct PrintSink {
    most: usize,
    axis: Point2<f64>,
    tracer: Tracer,
    /// Layers that were kept, with their ordinal numbers.
    kept: Vec<Painted>,
    kept_count: usize,
    /// The layer before the present one, when it was not kept.
    last: Option<Painted>,
    present: Option<usize>,
    ordinal: usize,
    every: usize,
}

/// One layer's lines.
#[derive(Debug, Clone)]
struct Painted {
    ordinal: usize,
    traces: Vec<Trace>,
    count: usize,
}

impl PrintSink {
    /// Returns a sink from which at most about `most` pieces are drawn: more by no more than the
    /// pieces of one curved move.
    #[must_use]
    pub fn new(most: usize, printer: &Printer) -> Self {
        Self {
            most,
            axis: printer.alignment.part_from_bed(&Vector2::zeros()),
            tracer: Tracer::new(printer.alignment, TOLERANCE),
            kept: Vec::new(),
            kept_count: 0,
            last: None,
            present: None,
            ordinal: 0,
            every: 1,
        }
    }

    /// Takes note of a segment.
    pub fn add(&mut self, segment: &Segment) {
        let (Some(layer), true) = (segment.layer, segment.extrudes()) else { return };
        if self.present != Some(layer) {
            self.end_layer();
            self.present = Some(layer);
        }
        if self.tracer.count() < self.most {
            let width = if segment.width > 0.0 { segment.width } else { 0.4 };
            self.tracer.add(Stroke::Bead(segment.role, width), segment);
        }
    }

    fn end_layer(&mut self) {
        let traces = self.tracer.take();
        if traces.is_empty() {
            return;
        }
        let count = traces.iter().map(|trace| trace.points.len() - 1).sum();
        let painted = Painted { ordinal: self.ordinal, traces, count };
        self.ordinal += 1;
        if let Some(mut before) = self.last.take()
            && before.ordinal.is_multiple_of(self.every)
        {
            before.hide_infill();
            self.kept_count += before.count;
            self.kept.push(before);
        }
        // The topmost layer counts as well.
        while self.kept_count + painted.count > self.most && !self.kept.is_empty() {
            self.every = self.every.saturating_mul(2);
            // 0 is a multiple of everything: the lowest layer would never go.
            let (every, is_alone) = (self.every, self.kept.len() == 1);
            self.kept.retain(|layer| !is_alone && layer.ordinal.is_multiple_of(every));
            self.kept_count = self.kept.iter().map(|layer| layer.count).sum();
        }
        self.last = Some(painted);
    }
}

impl Painted {
    fn hide_infill(&mut self) {
        let is_seen = |trace: &Trace| !matches!(trace.kind, Stroke::Bead(Role::InternalInfill, _));
        self.traces.retain(is_seen);
        self.count = self.traces.iter().map(|trace| trace.points.len() - 1).sum();
    }
}

/// Returns the picture of the print.
#[must_use]
pub fn print_svg(mut sink: PrintSink, shade: Shade) -> String {
    sink.end_layer();
    let mut layers = std::mem::take(&mut sink.kept);
    layers.extend(sink.last.take());
    let view = View::around(&layers, &sink.axis);
    let mut canvas = Canvas::new(view.size[0], view.size[1]);
    bed(&mut canvas, &view, &sink.axis);
    let mut below = 0.0;
    for layer in &layers {
        let top = layer.traces.first().map_or(0.0, |trace| trace.points[0].z);
        // What is between two drawn layers is painted by the upper one.
        paint(&mut canvas, &view, layer, (top - below).abs(), shade);
        below = top;
    }
    canvas.finish()
}

/// How places of the part become pixels.
#[derive(Debug, Clone, Copy)]
struct View {
    scale: f64,
    origin: [f64; 2],
    size: [f64; 2],
    heights: [f64; 2],
    /// How far from the axis the bed is drawn, mm.
    bed: f64,
}

/// The place on the screen in mm, to the right and downwards.
fn screen(p: &Point3<f64>) -> [f64; 2] {
    let (sin, cos) = AZIMUTH.sin_cos();
    let towards_eye = p.x * cos + p.y * sin;
    let right = p.y * cos - p.x * sin;
    [right, towards_eye * ELEVATION.sin() - p.z * ELEVATION.cos()]
}

impl View {
    fn around(layers: &[Painted], axis: &Point2<f64>) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut heights = [f64::INFINITY, f64::NEG_INFINITY];
        let mut radius: f64 = 0.0;
        let mut add = |place: [f64; 2], room: f64| {
            for k in 0..2 {
                low[k] = low[k].min(place[k] - room);
                high[k] = high[k].max(place[k] + room);
            }
        };
        for p in layers.iter().flat_map(|layer| &layer.traces).flat_map(|trace| &trace.points) {
            add(screen(p), 0.5);
            heights = [heights[0].min(p.z), heights[1].max(p.z)];
            radius = radius.max((p.xy() - axis).norm());
        }
        let bed = (radius * 1.12 / 10.0).ceil().max(1.0) * 10.0;
        let middle = screen(&Point3::new(axis.x, axis.y, 0.0));
        for sign in [-1.0, 1.0] {
            add([middle[0] + sign * bed, middle[1] + sign * bed * ELEVATION.sin()], 1.0);
        }
        let extent = [high[0] - low[0], high[1] - low[1]];
        let scale = (SIDE - 2.0 * MARGIN) / extent[0].max(extent[1]);
        Self {
            scale,
            origin: [MARGIN - low[0] * scale, MARGIN - low[1] * scale],
            size: extent.map(|side| side * scale + 2.0 * MARGIN),
            heights,
            bed,
        }
    }

    fn pixel(&self, p: &Point3<f64>) -> [f64; 2] {
        let [x, y] = screen(p);
        [self.origin[0] + x * self.scale, self.origin[1] + y * self.scale]
    }

    fn share_of_height(&self, z: f64) -> f64 {
        let span = self.heights[1] - self.heights[0];
        if span > 0.0 { (z - self.heights[0]) / span } else { 0.5 }
    }
}

/// The turning bed: rings 10 mm apart about its axis.
fn bed(canvas: &mut Canvas, view: &View, axis: &Point2<f64>) {
    let [x, y] = view.pixel(&Point3::new(axis.x, axis.y, 0.0));
    let mut radius = 10.0;
    while radius <= view.bed {
        let radii = [radius * view.scale, radius * view.scale * ELEVATION.sin()];
        let is_rim = radius + 10.0 > view.bed;
        let pen = Pen::new(INK, if is_rim { 2.0 } else { 1.0 });
        canvas.ellipse(x, y, radii, &pen.faint(if is_rim { 0.7 } else { 0.3 }));
        radius += 10.0;
    }
    let arm = view.bed * view.scale;
    let pen = Pen::new(AXIS, 1.5).faint(0.6);
    canvas.line([x - arm, y], [x + arm, y], &Pen::new(INK, 1.0).faint(0.3));
    canvas.ellipse(x, y, [6.0, 6.0 * ELEVATION.sin()], &pen);
}

fn paint(canvas: &mut Canvas, view: &View, layer: &Painted, thickness: f64, shade: Shade) {
    let mut kinds: Vec<(Role, f64)> = Vec::new();
    for trace in &layer.traces {
        if let Stroke::Bead(role, width) = trace.kind
            && !kinds.contains(&(role, width))
        {
            kinds.push((role, width));
        }
    }
    // The outline last: it is nearest to the eye.
    kinds.sort_by_key(|(role, _)| std::cmp::Reverse(*role));
    for (role, width) in kinds {
        let traces: Vec<&Trace> =
            layer.traces.iter().filter(|trace| trace.kind == Stroke::Bead(role, width)).collect();
        let z = traces.first().map_or(0.0, |trace| trace.points[0].z);
        let colour = match shade {
            Shade::Height => of_height(view.share_of_height(z)),
            Shade::Role => of_role(role),
        };
        let is_wall = matches!(role, Role::ExternalPerimeter | Role::Perimeter);
        // Walls reach down to the drawn layer below, also where they lean; fill is seen from
        // above only.
        let side = if is_wall { width.max(thickness * LEANING) } else { width };
        let look = if is_wall { Look::Wall } else { Look::Fill };
        strokes(canvas, view, &traces, colour, side * view.scale, look);
    }
}

/// How a bead is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    /// From the side: its light depends on its direction.
    Wall,
    /// From above: its width on the screen depends on its direction.
    Fill,
}

impl Look {
    /// The step of light or width of a piece, up to [`STEPS`].
    fn step(self, from: &Point3<f64>, to: &Point3<f64>) -> usize {
        let along = (to - from).xy();
        let Some(along) = along.try_normalize(f64::MIN_POSITIVE) else { return STEPS };
        let eye = Vector2::new(AZIMUTH.cos(), AZIMUTH.sin());
        let share = match self {
            Self::Wall => {
                let face = Vector2::new(along.y, -along.x);
                // Which of the two faces is seen changes at the silhouette; there the light is
                // even, or the picture would have a jagged edge between light and dark.
                let turned_to_eye = (face.dot(&eye) / EDGE).clamp(-1.0, 1.0);
                let light = face.dot(&Vector2::new(LIGHT.cos(), LIGHT.sin()));
                (turned_to_eye * light + 1.0) / 2.0
            }
            Self::Fill => along.dot(&eye).abs(),
        };
        (share.clamp(0.0, 1.0) * STEPS as f64).round() as usize
    }

    /// How bright a step is: 1 is the colour as it is.
    fn brightness(self, step: usize) -> f64 {
        match self {
            Self::Wall => 0.5 + 0.62 * step as f64 / STEPS as f64,
            Self::Fill => 1.08,
        }
    }

    /// The width of the ridge on the screen, as a share of the bead's.
    fn ridge(self, step: usize) -> f64 {
        match self {
            Self::Wall => 0.62,
            // The view shrinks areas by the sine of the elevation, and the length of the bead by
            // the root below; its width takes the rest.
            Self::Fill => {
                let (towards_eye, sin) = (step as f64 / STEPS as f64, ELEVATION.sin());
                let length = (1.0 - towards_eye * towards_eye * (1.0 - sin * sin)).sqrt();
                0.7 * sin / length
            }
        }
    }
}

fn strokes(
    canvas: &mut Canvas,
    view: &View,
    traces: &[&Trace],
    colour: Colour,
    width: f64,
    look: Look,
) {
    let mut edges: Vec<PathData> = vec![PathData::with_decimals(1); STEPS + 1];
    let mut ridges = edges.clone();
    let rise = if look == Look::Wall { 0.16 * width } else { 0.0 };
    for trace in traces {
        let mut last = None;
        for pair in trace.points.windows(2) {
            let step = look.step(&pair[0], &pair[1]);
            let pixels = [view.pixel(&pair[0]), view.pixel(&pair[1])];
            for (data, up) in [(&mut edges, 0.0), (&mut ridges, rise)] {
                if last != Some(step) {
                    data[step].move_to(pixels[0][0], pixels[0][1] - up);
                }
                data[step].line_to(pixels[1][0], pixels[1][1] - up);
            }
            last = Some(step);
        }
    }
    for (step, data) in edges.iter().enumerate() {
        canvas.path(data, &Pen::new(colour.lit(0.72 * look.brightness(step)), width));
    }
    for (step, data) in ridges.iter().enumerate() {
        let pen = Pen::new(colour.lit(look.brightness(step)), width * look.ridge(step));
        canvas.path(data, &pen);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{joints, printer, segment};

    fn sink(layers: usize, pieces: u32, most: usize) -> PrintSink {
        let mut sink = PrintSink::new(most, &printer());
        for layer in 0..layers {
            for k in 0..pieces {
                let z = 0.2 * (layer + 1) as f64;
                let turn = |k: u32| f64::from(k) * 0.3;
                let mut line = segment(
                    joints(20.0 + 5.0 * f64::from(k % 2), turn(k), z),
                    joints(20.0 + 5.0 * f64::from((k + 1) % 2), turn(k + 1), z),
                    20.0,
                );
                (line.layer, line.filament) = (Some(layer), 0.1);
                sink.add(&line);
            }
        }
        sink
    }

    fn drawn(mut sink: PrintSink) -> Vec<usize> {
        sink.end_layer();
        let top = sink.last.iter();
        sink.kept.iter().chain(top).map(|layer| layer.ordinal).collect()
    }

    #[test]
    fn layers_are_skipped_evenly_and_the_top_stays() {
        assert_eq!(drawn(sink(10, 5, 100_000)), (0..10).collect::<Vec<_>>());
        let all: usize = {
            let mut all = sink(10, 5, 100_000);
            all.end_layer();
            all.kept_count + all.last.as_ref().map_or(0, |last| last.count)
        };
        assert_eq!(drawn(sink(10, 5, all / 2)), [0, 4, 8, 9]);
        let mut tight = sink(100, 5, all / 3);
        tight.end_layer();
        let count = tight.kept_count + tight.last.as_ref().map_or(0, |last| last.count);
        assert!(count <= all / 3);
        assert_eq!(tight.last.map(|last| last.ordinal), Some(99));
    }

    #[test]
    fn a_picture_of_it() {
        for shade in [Shade::Height, Shade::Role] {
            let svg = print_svg(sink(3, 8, 1000), shade);
            assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
            assert!(svg.matches("<path").count() > 6);
        }
        let empty = print_svg(sink(0, 0, 10), Shade::Height);
        assert!(!empty.contains("NaN") && !empty.contains("inf"), "{empty}");
    }
}
