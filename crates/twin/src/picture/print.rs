//! The whole print, isometric.
//!
//! What lies lower is painted first, whichever layer it belongs to: the eye looks down, so of two places
//! behind each other the nearer one is the higher one. A layer of a bowl or a cone is painted in as many
//! pieces as it has heights. A bead is a dark line with a light one on it; walls are lit from the left by the direction that they
//! face, which is the side towards the eye. Sparse infill is hidden in nearly every print and left
//! out, except on the layer drawn last.
//!
//! When there are more pieces than may be drawn, every other layer is dropped, then every second
//! of the rest, and so on; the topmost layer always stays.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use machine::profile::Printer;
use machine::program::Role;
use nalgebra::{Point2, Point3, Vector2, center};

use super::palette::{AXIS, INK, of_height, of_role};
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
    let mut painting = Painting { view: &view, groups: BTreeMap::new() };
    for (layer, thickness) in layers.iter().zip(thicknesses(&layers)) {
        layer.traces.iter().for_each(|trace| painting.add(trace, thickness));
    }
    for (group, lines) in &painting.groups {
        lines.paint(&mut canvas, &view, group, shade);
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

/// Returns how far each layer reaches down to the drawn one below, mm: what is between two drawn layers
/// is painted by the upper one.
fn thicknesses(layers: &[Painted]) -> Vec<f64> {
    let extent = |layer: &Painted| {
        let heights = layer.traces.iter().flat_map(|trace| &trace.points).map(|p| p.z);
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)])
    };
    let mut below = [0.0; 2];
    let mut found = Vec::new();
    for layer in layers {
        let extent = extent(layer);
        // The bed or the top of the part cuts off one end of a curved layer, not both.
        found.push((extent[0] - below[0]).abs().max((extent[1] - below[1]).abs()));
        below = extent;
    }
    let mut sorted = found.clone();
    sorted.sort_by(f64::total_cmp);
    // Where a curved layer begins or ends elsewhere than the one before, that says nothing.
    let most = JUMP * sorted.get(sorted.len() / 2).copied().unwrap_or_default();
    found.iter().map(|thickness| thickness.min(most)).collect()
}

/// Layers are at most so many times thicker than half of them.
const JUMP: f64 = 2.0;

/// Heights that differ by less than this are painted together, mm: half of a common layer.
const STEP: f64 = 0.1;

/// A piece rises by no more than this, mm: the width of a bead, within which order is not seen.
const RISE: f64 = 0.5;

/// What is painted with the same pens, in the order of painting. Lengths in 0.01 mm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Group {
    /// In [`STEP`].
    height: i64,
    /// The outline last: it is nearest to the eye.
    role: Reverse<Role>,
    /// How wide it is drawn.
    side: i64,
}

/// The lines of a group, by their step of light.
#[derive(Debug, Clone)]
struct Lines {
    edges: Vec<PathData>,
    ridges: Vec<PathData>,
}

/// Sorts pieces into groups.
struct Painting<'a> {
    view: &'a View,
    groups: BTreeMap<Group, Lines>,
}

impl Painting<'_> {
    fn add(&mut self, trace: &Trace, thickness: f64) {
        let Stroke::Bead(role, width) = trace.kind else { return };
        let look = Look::of(role);
        // Walls reach down to the drawn layer below, also where they lean; fill is seen from
        // above only.
        let side = if look == Look::Wall { width.max(thickness * LEANING) } else { width };
        let side = (side * 100.0).round();
        let rise = if look == Look::Wall { 0.16 * side / 100.0 * self.view.scale } else { 0.0 };
        let mut last = None;
        for pair in trace.points.windows(2) {
            let step = look.step(&pair[0], &pair[1]);
            let pieces = ((pair[1].z - pair[0].z).abs() / RISE).ceil().max(1.0);
            let at = |k: f64| pair[0] + (pair[1] - pair[0]) * (k / pieces);
            for k in 0..pieces as u32 {
                let ends = [at(f64::from(k)), at(f64::from(k) + 1.0)];
                let height = (center(&ends[0], &ends[1]).z / STEP).round() as i64;
                let group = Group { height, role: Reverse(role), side: side as i64 };
                let goes_on = last == Some((group, step));
                let pixels = ends.map(|end| self.view.pixel(&end));
                let lines = self.groups.entry(group).or_insert_with(Lines::none);
                lines.add(step, pixels, rise, goes_on);
                last = Some((group, step));
            }
        }
    }
}

impl Lines {
    fn none() -> Self {
        let none = vec![PathData::with_decimals(1); STEPS + 1];
        Self { edges: none.clone(), ridges: none }
    }

    fn add(&mut self, step: usize, pixels: [[f64; 2]; 2], rise: f64, goes_on: bool) {
        for (data, up) in [(&mut self.edges, 0.0), (&mut self.ridges, rise)] {
            if !goes_on {
                data[step].move_to(pixels[0][0], pixels[0][1] - up);
            }
            data[step].line_to(pixels[1][0], pixels[1][1] - up);
        }
    }

    fn paint(&self, canvas: &mut Canvas, view: &View, group: &Group, shade: Shade) {
        let Reverse(role) = group.role;
        let colour = match shade {
            Shade::Height => of_height(view.share_of_height(group.height as f64 * STEP)),
            Shade::Role => of_role(role),
        };
        let (look, width) = (Look::of(role), group.side as f64 / 100.0 * view.scale);
        for (step, data) in self.edges.iter().enumerate() {
            canvas.path(data, &Pen::new(colour.lit(0.72 * look.brightness(step)), width));
        }
        for (step, data) in self.ridges.iter().enumerate() {
            let pen = Pen::new(colour.lit(look.brightness(step)), width * look.ridge(step));
            canvas.path(data, &pen);
        }
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
    fn of(role: Role) -> Self {
        if role.is_wall() { Self::Wall } else { Self::Fill }
    }

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
    fn the_far_side_of_a_bowl_is_painted_before_its_near_rim() {
        // One layer: the rim first, 10 mm up, then the bottom of the bowl and a line up its side.
        let mut sink = PrintSink::new(1000, &printer());
        for (from, to) in
            [([20.0, 10.0], [20.0, 10.0]), ([2.0, 1.0], [2.0, 1.0]), ([2.0, 1.0], [20.0, 10.0])]
        {
            let turn = if from == to { 1.0 } else { 0.0 };
            let mut line = segment(joints(from[0], 0.0, from[1]), joints(to[0], turn, to[1]), 20.0);
            (line.layer, line.filament) = (Some(0), 0.1);
            sink.add(&line);
        }
        sink.end_layer();
        let layers: Vec<Painted> = sink.last.take().into_iter().collect();
        let view = View::around(&layers, &sink.axis);
        let mut painting = Painting { view: &view, groups: BTreeMap::new() };
        layers[0].traces.iter().for_each(|trace| painting.add(trace, 0.2));
        let heights: Vec<i64> = painting.groups.keys().map(|group| group.height).collect();
        assert!(heights.is_sorted() && heights.len() > 18, "{heights:?}");
        assert_eq!((heights[0], heights[heights.len() - 1]), (10, 100));
    }

    #[test]
    fn layers_reach_down_to_the_drawn_one_below() {
        let layer = |heights: [f64; 2]| Painted {
            ordinal: 0,
            traces: vec![Trace {
                kind: Stroke::Travel,
                points: heights.map(|z| Point3::new(0.0, 0.0, z)).to_vec(),
            }],
            count: 1,
        };
        // Bowls that the bed cuts off, then the rim does, then a tower elsewhere.
        let bowls = [[0.2, 8.0], [0.2, 8.3], [0.5, 8.4], [0.8, 8.4], [1.1, 30.0]].map(layer);
        let expected = [0.6, 0.3, 0.3, 0.3, 0.6];
        for (found, expected) in thicknesses(&bowls).iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
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
