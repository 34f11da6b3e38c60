//! Another slicer's program as segments, for pictures.
//!
//! What a line makes the nozzle do is read as for conversion; what it is for, from the comments of
//! PrusaSlicer, Orca, Bambu Studio and Cura. A program without marks of layers gets one for every
//! height at which something is laid.

use machine::kinematics::Alignment;
use machine::program::{Feed, Role};
use nalgebra::{Point3, Vector2};
use plan::route::Stroke;
use twin::curve::Curve;
use twin::segment::Segment;

use super::comment::without_comment;
use super::reader::Reader;

/// How far the lines that stand for an arc may lie from it, mm.
const ARC_TOLERANCE: f64 = 0.02;

/// Heights nearer than this are one layer, mm: a step of the finest lifts, many times over.
const SAME_HEIGHT: f64 = 0.02;

/// A line that could not be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unreadable {
    /// Counted from 1.
    pub line: usize,
    /// Why.
    pub message: String,
}

/// Unreadable lines that are kept; the rest is counted.
const MOST_KEPT: usize = 20;

/// Reads a program, tells `each` motion, and returns the first lines that were not understood and
/// how many more there are. `origin` is the place of its bed that becomes the axis, mm.
pub fn segments(
    program: &[u8],
    origin: Vector2<f64>,
    mut each: impl FnMut(&Segment),
) -> (Vec<Unreadable>, usize) {
    let mut foreign = Foreign::new(program, origin);
    let (mut unreadable, mut more) = (Vec::new(), 0);
    let mut strokes = Vec::new();
    for (line, bytes) in (1..).zip(program.split(|byte| *byte == b'\n')) {
        let text = String::from_utf8_lossy(bytes);
        let (code, comment) = without_comment(&text);
        if let Some(comment) = comment {
            foreign.comment(comment.trim());
        }
        if code.trim().is_empty() {
            continue;
        }
        strokes.clear();
        if let Err(error) = foreign.reader.line(&code, &mut strokes) {
            if unreadable.len() < MOST_KEPT {
                unreadable.push(Unreadable { line, message: error.to_string() });
            } else {
                more += 1;
            }
        }
        for stroke in &strokes {
            each(&foreign.segment(line, stroke));
        }
    }
    (unreadable, more)
}

struct Foreign {
    reader: Reader,
    at: Point3<f64>,
    role: Role,
    width: f64,
    layer: Option<usize>,
    /// Whether comments say where layers begin.
    names_layers: bool,
    /// Whether they also number them.
    numbers_layers: bool,
    height: f64,
}

impl Foreign {
    fn new(program: &[u8], origin: Vector2<f64>) -> Self {
        let has = |mark: &[u8]| program.windows(mark.len()).any(|window| window == mark);
        let numbers_layers = has(b";LAYER:");
        Self {
            reader: Reader::new(origin, Point3::new(-origin.x, -origin.y, 0.0), ARC_TOLERANCE),
            at: Point3::new(-origin.x, -origin.y, 0.0),
            role: Role::Custom,
            width: 0.0,
            layer: None,
            names_layers: numbers_layers || has(b";LAYER_CHANGE") || has(b"; CHANGE_LAYER"),
            numbers_layers,
            height: f64::NEG_INFINITY,
        }
    }

    fn comment(&mut self, comment: &str) {
        let after = |start: &str| comment.strip_prefix(start).map(str::trim);
        if let Some(label) = after("TYPE:").or_else(|| after("FEATURE:")) {
            self.role = role(label);
        } else if let Some(width) = after("WIDTH:").or_else(|| after("LINE_WIDTH:")) {
            let width = width.parse().ok().filter(|width: &f64| width.is_finite() && *width > 0.0);
            self.width = width.unwrap_or(self.width);
        } else if let Some(number) = after("LAYER:").and_then(|number| number.parse().ok()) {
            // Rafts have negative numbers.
            let number: i64 = number;
            self.layer = Some(number.max(0) as usize);
        } else if !self.numbers_layers && (comment == "LAYER_CHANGE" || comment == "CHANGE_LAYER") {
            self.layer = Some(self.layer.map_or(0, |layer| layer + 1));
        }
    }

    fn segment(&mut self, line: usize, stroke: &Stroke) -> Segment {
        let from = std::mem::replace(&mut self.at, stroke.to);
        let ideal = Alignment::default();
        let curve = Curve::between_points(&from, &stroke.to, &ideal);
        let path = curve.length();
        if !self.names_layers
            && path > 0.0
            && stroke.filament > 0.0
            && (stroke.to.z - self.height).abs() > SAME_HEIGHT
        {
            self.height = stroke.to.z;
            self.layer = Some(self.layer.map_or(0, |layer| layer + 1));
        }
        let way = if path > 0.0 { path } else { stroke.filament.abs() };
        Segment {
            line,
            layer: self.layer,
            role: self.role,
            height: None,
            width: self.width,
            joints: None,
            part: [from, stroke.to],
            nearest: curve.nearest_to_axis(),
            curve,
            path,
            filament: stroke.filament,
            feed: Feed::mm_per_s(stroke.speed),
            duration: if stroke.speed > 0.0 { way / stroke.speed } else { 0.0 },
            slopes: false,
            is_paced: false,
        }
    }
}

/// What other slicers' words come to.
fn role(label: &str) -> Role {
    if let Some(role) = Role::from_label(label) {
        return role;
    }
    let label = label.to_ascii_lowercase();
    match label.as_str() {
        "outer wall" | "wall-outer" => Role::ExternalPerimeter,
        "overhang perimeter" | "overhang wall" => Role::OverhangPerimeter,
        "inner wall" | "wall-inner" => Role::Perimeter,
        "fill" | "sparse infill" => Role::InternalInfill,
        "skin"
        | "internal solid infill"
        | "internal bridge"
        | "bottom surface"
        | "internal bridge infill" => Role::SolidInfill,
        "bridge infill" | "bridge" => Role::BridgeInfill,
        "top surface" => Role::TopSolidInfill,
        "ironing" => Role::Ironing,
        "gap infill" => Role::GapFill,
        "skirt" | "brim" => Role::SkirtBrim,
        _ => Role::Custom,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Vec<Segment> {
        let mut all = Vec::new();
        assert_eq!(
            segments(text.as_bytes(), Vector2::zeros(), |segment| all.push(*segment)),
            (Vec::new(), 0)
        );
        all
    }

    #[test]
    fn cura_prusaslicer_and_bambu_studio_name_layers_and_roles() {
        let cura = read(
            "G28\nG90\nM82\n;LAYER:0\n;TYPE:WALL-OUTER\nG0 F6000 X10 Y10 Z0.3\nG1 X20 E1\n;LAYER:1\n\
             ;TYPE:FILL\nG0 Z0.5\nG1 X10 E2",
        );
        let seen: Vec<_> = cura.iter().map(|s| (s.line, s.layer, s.role)).collect();
        assert_eq!(seen[1], (7, Some(0), Role::ExternalPerimeter));
        assert_eq!(seen[3], (11, Some(1), Role::InternalInfill));
        assert_eq!((cura[1].filament, cura[1].path, cura[1].duration), (1.0, 10.0, 0.1));
        let prusa = read(
            "M83\n;LAYER_CHANGE\n;Z:0.2\n;HEIGHT:0.2\nG1 Z.2 F600\n;TYPE:Bridge infill\n;WIDTH:0.5\n\
             G1 X5 E.2\n;LAYER_CHANGE\nG1 X9 E.1",
        );
        assert_eq!(
            (prusa[1].layer, prusa[1].role, prusa[1].width),
            (Some(0), Role::BridgeInfill, 0.5)
        );
        assert_eq!(prusa[2].layer, Some(1));
        let bambu =
            read("M83\n; CHANGE_LAYER\n; FEATURE: Outer wall\n; LINE_WIDTH: 0.42\nG1 X5 E.2 F600");
        assert_eq!(
            (bambu[0].layer, bambu[0].role, bambu[0].width),
            (Some(0), Role::ExternalPerimeter, 0.42)
        );
    }

    #[test]
    fn without_marks_every_height_is_a_layer_and_hops_are_none() {
        let bare = read("G1 Z.2 F600\nG1 X5 E1\nG1 Z1\nG1 X0\nG1 Z.2\nG1 X9 E2\nG1 Z.4\nG1 X0 E3");
        let layers: Vec<_> = bare.iter().filter(|s| s.extrudes()).map(|s| s.layer).collect();
        assert_eq!(layers, [Some(0), Some(0), Some(1)]);
    }

    #[test]
    fn the_origin_becomes_the_axis() {
        let mut all = Vec::new();
        let program = b"G1 X110 Y100 F600\nG1 Y105 E1";
        segments(program, Vector2::new(100.0, 100.0), |segment| all.push(*segment));
        assert_eq!(all[1].part[1], Point3::new(10.0, 5.0, 0.0));
        assert_eq!(all[0].part[0], Point3::new(-100.0, -100.0, 0.0));
    }

    #[test]
    fn what_is_not_understood_is_told_and_left_out() {
        let mut count = 0;
        let (unreadable, more) =
            segments(b"G1 X1 F600\nG1 X{y}\nG2 X5\nG1 X2\n", Vector2::zeros(), |_| count += 1);
        assert_eq!((count, more), (2, 0));
        assert_eq!(unreadable.iter().map(|u| u.line).collect::<Vec<_>>(), [2, 3]);
    }
}
