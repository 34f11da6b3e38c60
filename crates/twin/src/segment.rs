//! One motion line of a program, and all that is known of it.

use nalgebra::Point3;

use crate::curve::Curve;
use machine::kinematics::Alignment;
use machine::program::{Feed, Joints, Role};

/// What a segment does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The nozzle moves and lays material.
    Extrusion,
    /// The nozzle moves, the filament stands still.
    Travel,
    /// The nozzle moves while filament is drawn back.
    Wipe,
    /// Only filament moves, backwards.
    Retraction,
    /// Only filament moves, forwards.
    Prime,
    /// The line names the place where everything already is.
    Still,
}

/// Pieces of one path, at most: some turns of the bed.
const MOST_PIECES: u32 = 256;

/// One motion line. Frames and units as in the [crate].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Its line in the program, counted from 1.
    pub line: usize,
    /// The layer that was announced last.
    pub layer: Option<usize>,
    /// What the material is for, as announced last; `Custom` before that.
    pub role: Role,
    /// The width of the bead as announced last, mm; 0 before that.
    pub width: f64,
    /// The thickness of the bead as announced within its layer, mm; `None` where it is that of the layer.
    pub height: Option<f64>,
    /// The joints at both ends; `None` where the firmware takes part coordinates.
    pub joints: Option<[Joints; 2]>,
    /// Where the nozzle is in the part at both ends, mm.
    pub part: [Point3<f64>; 2],
    /// The path over the bed.
    pub curve: Curve,
    /// The length of the path over the part, lift included, mm.
    pub path: f64,
    /// The least distance from the axis on the way, mm.
    pub nearest: f64,
    /// Filament fed, mm; negative when it is drawn back.
    pub filament: f64,
    /// The speed that holds on this line: of the nozzle, or of the filament where only that
    /// moves. Zero when none was ever given.
    pub feed: Feed,
    /// How long it takes at that speed, s; zero when nothing moves or no speed was given.
    pub duration: f64,
    /// Whether it is part of a wall that begins and ends in a slope, as announced: it may lie as low as
    /// its layer begins, and be as thin as nothing.
    pub slopes: bool,
    /// Whether the firmware runs some of it at a pace of its own, whatever `F` says, and itself sees
    /// to what bed and carriage can follow.
    pub is_paced: bool,
}

/// Segments shorter than this have too few digits of filament to tell their thickness, mm.
const TELLING: f64 = 0.1;

impl Segment {
    /// Returns the thickness of a bead of the announced width that takes the filament of this one, of
    /// the given cross-section (mm²), mm; `None` for what is too short to tell.
    #[must_use]
    pub fn thickness(&self, filament_area: f64) -> Option<f64> {
        const ROUNDING: f64 = 1.0 - std::f64::consts::FRAC_PI_4;
        if self.path < TELLING {
            return None;
        }
        // area = t·(w − t·(1 − π/4)), the smaller root.
        let area = self.filament * filament_area / self.path;
        let width = self.width;
        let square = width * width - 4.0 * ROUNDING * area;
        Some(2.0 * area / (width + square.max(0.0).sqrt()))
    }

    /// Returns what it does.
    #[must_use]
    pub fn kind(&self) -> Kind {
        if self.path > 0.0 {
            if self.filament > 0.0 {
                Kind::Extrusion
            } else if self.filament < 0.0 {
                Kind::Wipe
            } else {
                Kind::Travel
            }
        } else if self.filament > 0.0 {
            Kind::Prime
        } else if self.filament < 0.0 {
            Kind::Retraction
        } else {
            Kind::Still
        }
    }

    /// Returns where in the part it is halfway on a machine that is aligned like this, mm: on an
    /// arc, far from the middle of the chord.
    #[must_use]
    pub fn middle(&self, alignment: &Alignment) -> Point3<f64> {
        let halfway = alignment.part_from_bed(&self.curve.over_bed(0.5));
        Point3::new(halfway.x, halfway.y, f64::midpoint(self.part[0].z, self.part[1].z))
    }

    /// Returns whether it lays material on the way.
    #[must_use]
    pub fn extrudes(&self) -> bool {
        self.path > 0.0 && self.filament > 0.0
    }

    /// Returns the ends of straight pieces that stay within about `tolerance` (mm) of the path, in
    /// the part. One, of a straight path.
    pub fn pieces(
        &self,
        alignment: &Alignment,
        tolerance: f64,
    ) -> impl Iterator<Item = Point3<f64>> + use<> {
        let bow = self.curve.deviation_bound() / tolerance;
        let count = (bow.sqrt().ceil() as u32).clamp(1, MOST_PIECES);
        let ([from, to], curve, alignment) = (self.part, self.curve, *alignment);
        (1..=count).map(move |k| {
            if k == count {
                return to;
            }
            let t = f64::from(k) / f64::from(count);
            let place = alignment.part_from_bed(&curve.over_bed(t));
            Point3::new(place.x, place.y, from.z + (to.z - from.z) * t)
        })
    }

    /// Returns how far the bed turns, radians; zero in part coordinates.
    #[must_use]
    pub fn bed_change(&self) -> f64 {
        self.curve.turn()
    }

    /// Returns how far the carriage runs, mm; zero in part coordinates.
    #[must_use]
    pub fn rail_change(&self) -> f64 {
        self.joints.map_or(0.0, |[from, to]| to.s - from.s)
    }

    /// Returns how far the lift rises, mm; on a bed that was probed not quite what the nozzle rises
    /// over the part.
    #[must_use]
    pub fn lift_change(&self) -> f64 {
        match self.joints {
            Some([from, to]) => to.z - from.z,
            None => self.part[1].z - self.part[0].z,
        }
    }
}
