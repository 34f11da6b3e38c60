//! The moves of a program as columns of small numbers.
//!
//! A million moves go into a page as differences in whole numbers, a column for each quantity:
//! lengths in thousandths of a millimetre, angles in ten-thousandths of a degree, times in
//! hundred-thousandths of a second, filament likewise. Sums are rounded, not differences, so that
//! no error grows with the program.

use machine::kinematics::Alignment;
use machine::profile::Printer;
use machine::program::{Joints, Role};
use nalgebra::Point3;
use twin::segment::{Kind, Segment};

/// How far drawn lines may lie from the path of the nozzle, mm.
const TOLERANCE: f64 = 0.02;

/// Farther than this from the origin nothing is shown, mm.
const FARTHEST: f64 = 1e6;

/// Steps in a millimetre, in a degree, in a second and in a millimetre of filament.
const MM: f64 = 1e3;
const DEGREE: f64 = 1e4;
const SECOND: f64 = 1e5;
const FILAMENT_MM: f64 = 1e5;

/// The names of the columns, in their order in the page.
const NAMES: [&str; 12] = [
    "line", "what", "layer", "width", "filament", "duration", "bed", "rail", "pieces", "x", "y",
    "z",
];

/// Collects moves. See the [module](self).
#[derive(Debug, Clone)]
pub struct Columns {
    alignment: Alignment,
    columns: [Vec<u8>; NAMES.len()],
    start: Option<Standing>,
    now: Standing,
    moves: usize,
    pieces: usize,
    has_joints: bool,
    /// Sums of the program so far.
    time: f64,
    filament: f64,
}

/// What the next differences are taken from, in steps.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Standing {
    place: [i64; 3],
    bed: i64,
    rail: i64,
    line: i64,
    layer: i64,
    width: i64,
    time: i64,
    filament: i64,
}

impl Columns {
    /// Returns an empty collection.
    #[must_use]
    pub fn new(printer: &Printer) -> Self {
        Self {
            alignment: printer.alignment,
            columns: Default::default(),
            start: None,
            now: Standing { layer: -1, ..Standing::default() },
            moves: 0,
            pieces: 0,
            has_joints: true,
            time: 0.0,
            filament: 0.0,
        }
    }

    /// Takes note of a segment; what moves nothing is left out.
    pub fn add(&mut self, segment: &Segment) {
        let is_near =
            |p: &Point3<f64>| p.coords.iter().all(|c| c.is_finite() && c.abs() < FARTHEST);
        let kind = segment.kind();
        if kind == Kind::Still || !segment.part.iter().all(is_near) {
            return;
        }
        let [from, to] = segment.joints.map_or([None; 2], |joints| joints.map(Some));
        if self.start.is_none() {
            self.now.place = steps(&segment.part[0]);
            (self.now.bed, self.now.rail) = self.joints(from.as_ref());
            self.start = Some(self.now);
        } else if self.now.place != steps(&segment.part[0]) {
            // Homing moves the machine without a word of where it goes.
            self.entry(segment, Kind::Travel, [0.0; 2], from.as_ref(), &[segment.part[0]]);
        }
        self.has_joints &= to.is_some();
        let places: Vec<Point3<f64>> = if segment.path > 0.0 {
            segment.pieces(&self.alignment, TOLERANCE).collect()
        } else {
            Vec::new()
        };
        let amounts = [segment.filament, segment.duration];
        self.entry(segment, kind, amounts, to.as_ref(), &places);
    }

    fn entry(
        &mut self,
        segment: &Segment,
        kind: Kind,
        [filament, duration]: [f64; 2],
        to: Option<&Joints>,
        places: &[Point3<f64>],
    ) {
        self.moves += 1;
        self.time += finite(duration).max(0.0);
        self.filament += finite(filament);
        let (bed, rail) = self.joints(to);
        let next = Standing {
            line: segment.line as i64,
            layer: segment.layer.map_or(-1, |layer| layer as i64),
            width: (finite(segment.width) * MM).round() as i64,
            time: (self.time * SECOND).round() as i64,
            filament: (self.filament * FILAMENT_MM).round() as i64,
            bed,
            rail,
            place: self.now.place,
        };
        let now = std::mem::replace(&mut self.now, next);
        self.unsigned(0, (next.line - now.line).max(0) as u64);
        self.unsigned(1, code(kind) | (role_index(segment.role) as u64) << 3);
        self.signed(2, next.layer - now.layer);
        self.signed(3, next.width - now.width);
        self.signed(4, next.filament - now.filament);
        self.unsigned(5, (next.time - now.time).max(0) as u64);
        self.signed(6, next.bed - now.bed);
        self.signed(7, next.rail - now.rail);
        self.unsigned(8, places.len() as u64);
        for place in places {
            let place = steps(place);
            for (k, c) in place.into_iter().enumerate() {
                self.signed(9 + k, c - self.now.place[k]);
            }
            self.now.place = place;
        }
        self.pieces += places.len();
    }

    /// Where bed and carriage stand, in steps: the bed as the azimuth of the rail over the part.
    fn joints(&self, joints: Option<&Joints>) -> (i64, i64) {
        let Some(joints) = joints else { return (self.now.bed, self.now.rail) };
        let azimuth = self.alignment.bed.azimuth(joints.turn) - self.alignment.plate_angle;
        let steps = |value: f64, unit: f64| (finite(value) * unit).round() as i64;
        (steps(azimuth.to_degrees(), DEGREE), steps(joints.s, MM))
    }

    fn unsigned(&mut self, column: usize, mut value: u64) {
        let bytes = &mut self.columns[column];
        while value > 127 {
            bytes.push(value as u8 | 128);
            value >>= 7;
        }
        bytes.push(value as u8);
    }

    /// Negative numbers become odd ones.
    fn signed(&mut self, column: usize, value: i64) {
        self.unsigned(column, ((value << 1) ^ (value >> 63)) as u64);
    }

    /// Returns all columns, one after the other.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8> {
        self.columns.concat()
    }

    /// Returns what is needed to read them.
    #[must_use]
    pub fn description(&self) -> serde_json::Value {
        let start = self.start.unwrap_or_default();
        let columns: Vec<_> =
            NAMES.iter().zip(&self.columns).map(|(name, bytes)| (name, bytes.len())).collect();
        serde_json::json!({
            "moves": self.moves,
            "pieces": self.pieces,
            "columns": columns,
            "start": start.place,
            "bedStart": start.bed,
            "railStart": start.rail,
            "hasJoints": self.has_joints,
        })
    }
}

fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

fn steps(place: &Point3<f64>) -> [i64; 3] {
    [place.x, place.y, place.z].map(|c| (c * MM).round() as i64)
}

/// What the page calls what a move does.
fn code(kind: Kind) -> u64 {
    match kind {
        Kind::Extrusion => 0,
        Kind::Travel | Kind::Still => 1,
        Kind::Wipe => 2,
        Kind::Retraction => 3,
        Kind::Prime => 4,
    }
}

fn role_index(role: Role) -> usize {
    Role::ALL.iter().position(|known| *known == role).unwrap_or(Role::ALL.len() - 1)
}
