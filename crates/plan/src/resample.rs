//! Strokes over the part become moves of the joints.
//!
//! A move is straight in joint space, which over the part is a piece of a spiral. A stroke is cut into
//! as few as lie within the chord tolerance of it (`division`): the deviation is measured with the
//! forward kinematics at a quarter, half and three quarters of each piece, and the bed turns by at
//! most 60° in one move; any alignment is covered.
//!
//! Positions are rounded here as the text will round them, so that lengths, speeds and
//! accelerations are planned for the very moves that a reader of the program sees.
//!
//! Ways that would come too near to the axis are bent round it ([`axis`](crate::axis)). Where the
//! carriage can pass the centre, a stroke that runs through the axis to within the chord tolerance
//! is one move to the other side of the rail, and the bed does not turn at all; what follows is
//! then laid from the far side, as far as the rail reaches.

mod division;
mod far_side;
mod long_move;
mod round_axis;
mod sweep;

use machine::gcode::Dialect;
use machine::gcode::dialect::Space;
use machine::height_map::HeightMap;
use machine::kinematics::{Alignment, Branch, Unreachable};
use machine::profile::{Axis, Printer};
use machine::program::{BedTurn, Joints};
use nalgebra::{Point2, Point3, UnitComplex};

use crate::axis::outside;
use crate::route::{Kind, Stroke};
use crate::winding::{extent, unwinding};
use sweep::Sweep;

/// How closely moves follow strokes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResampleParams {
    /// Greatest distance of an extruding move from its stroke, mm.
    pub chord: f64,
    /// The same for travel, mm.
    pub travel_chord: f64,
    /// The words of the program: in which coordinates moves are straight, and how positions are
    /// rounded.
    pub dialect: Dialect,
    /// Angle by which the slicer's frame is turned on the bed, radians. A whole number of the last
    /// decimal place of an angle in the text makes programs of turned parts equal but for it.
    pub azimuth: f64,
}

/// A move whose duration is still open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// What it does.
    pub kind: Kind,
    /// Where the axes end up.
    pub to: Joints,
    /// Where the nozzle then stands in the part, mm.
    pub at: Point3<f64>,
    /// Filament fed, mm.
    pub filament: f64,
    /// Length of the nozzle's path over the part, mm.
    pub path: f64,
    /// The speed that is wanted, mm/s.
    pub speed: f64,
}

/// Largest turn of the bed in one move, radians: 60°.
const LARGEST_TURN: f64 = std::f64::consts::FRAC_PI_3;

/// In such a move the speed of the bed is not even. Half of its turn may be done this share of it
/// before or after half of the way, which keeps the speed within 10 % of its mean.
const LARGEST_UNEVENNESS: f64 = 0.025;

/// Moves that turn the bed by less are even enough, radians: 0.6°.
const SMALL_TURN: f64 = 0.01;

/// How far a nozzle that runs straight may be from the height of the bed as it was probed, mm: a
/// fortieth of a layer.
const HEIGHT_TOLERANCE_MM: f64 = 0.005;

/// How far rounding may bring both ends of a move from where they should be, mm: half a last place of
/// rail and of angle, at the rim of the largest beds.
const ROUNDING_MM: f64 = 1e-3;

/// How far the last places of all drives of a head bring the tip from its place, mm.
const HEAD_ROUNDING_MM: f64 = 5e-3;

/// What is shorter is the last digits of one place, mm: a tenth of the finest last place.
const LEAST_PATH_MM: f64 = 1e-6;

/// How far an axis may be sent beyond its end, mm: what rounding does to a position at the end.
const REACH_SLACK_MM: f64 = 5e-4;

/// Times the tolerance, as estimated, beyond which a move is not looked at closely.
const SURELY: f64 = 2.0;

/// The legs of consecutive strokes in one list.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FlatLegs {
    /// In order.
    pub(crate) legs: Vec<Leg>,
    /// How many each stroke has.
    pub(crate) counts: Vec<usize>,
}

/// Turns strokes into legs; remembers where the joints stand.
#[derive(Debug, Clone)]
pub struct Resampler {
    alignment: Alignment,
    /// From the slicer's frame to the part's.
    azimuth: UnitComplex<f64>,
    params: ResampleParams,
    /// What nozzle and carriage keep from the axis, mm.
    clearance: f64,
    rail: Axis,
    lift: Axis,
    bed_map: HeightMap,
    /// How far the bed may turn from home, radians.
    most_turn: f64,
    /// How far from the axis the far side of the rail reaches, mm; negative when it does not.
    far_reach: f64,
    joints: Joints,
    /// How the rail then points over the bed.
    facing: UnitComplex<f64>,
    branch: Branch,
    /// Where the nozzle stands over the bed; not always where the last stroke ended.
    over_bed: Point2<f64>,
    /// Where the last stroke ended, though that may be too near to the axis.
    meant: Target,
    /// Where it stands in the part, as the text says it.
    at_part: Point3<f64>,
    /// Filament of strokes too short to be moves, for the next one that lays material, mm.
    owed: f64,
    /// The same drawn back, for the next stroke that lays none.
    owed_back: f64,
}

/// Where the nozzle is to be, over the bed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Target {
    over_bed: Point2<f64>,
    z: f64,
}

impl Resampler {
    /// Returns a resampler for a printer that stands at its home position.
    #[must_use]
    pub fn new(printer: &Printer, params: ResampleParams) -> Self {
        let at = printer.alignment.part_from_joints(&printer.home);
        let reaches_far_side = params.dialect.reaches_far_side();
        Self {
            alignment: printer.alignment,
            azimuth: UnitComplex::new(params.azimuth),
            params,
            clearance: printer.axis_clearance
                + if printer.head.is_some() { HEAD_ROUNDING_MM } else { 0.0 },
            rail: printer.rail,
            lift: printer.lift,
            bed_map: printer.bed_map.clone(),
            most_turn: if reaches_far_side { printer.most_turn } else { f64::INFINITY },
            far_reach: if reaches_far_side { -printer.rail.min } else { f64::NEG_INFINITY },
            joints: printer.home,
            facing: UnitComplex::new(printer.alignment.bed.azimuth(printer.home.turn)),
            branch: Branch::Near,
            over_bed: Point2::from(printer.alignment.over_bed(&at.xy())),
            meant: Target {
                over_bed: Point2::from(printer.alignment.over_bed(&at.xy())),
                z: printer.home.z,
            },
            at_part: at,
            owed: 0.0,
            owed_back: 0.0,
        }
    }

    /// The same after the printer has been homed by other means.
    #[must_use]
    pub(crate) fn at_home(&self, printer: &Printer) -> Self {
        let joints = printer.home;
        let at_part = self.alignment.part_from_joints(&joints);
        let over_bed = Point2::from(self.alignment.over_bed(&at_part.xy()));
        let facing = UnitComplex::new(self.alignment.bed.azimuth(joints.turn));
        let branch = Branch::Near;
        let meant = Target { over_bed, z: joints.z };
        Self { joints, facing, branch, over_bed, meant, at_part, ..self.clone() }
    }

    /// Filament of strokes too short to be moves that is still to be laid, mm.
    #[cfg(test)]
    pub(crate) fn owed(&self) -> f64 {
        self.owed
    }

    /// Keeps the carriage on the near side of the axis. Where layers are curved, the way from one side
    /// to the other could lead through what stands around the axis.
    #[must_use]
    pub(crate) fn on_near_side(self) -> Self {
        Self { far_reach: f64::NEG_INFINITY, ..self }
    }

    /// Where the joints stand.
    #[must_use]
    pub fn joints(&self) -> Joints {
        self.joints
    }

    /// Returns where the nozzle stands in the part, as the text says it.
    #[must_use]
    pub(crate) fn at_part(&self) -> Point3<f64> {
        self.at_part
    }

    /// Returns where the nozzle stands, in the slicer's frame.
    #[must_use]
    pub fn at(&self) -> Point3<f64> {
        turned(&self.azimuth.inverse(), &self.at_part)
    }

    /// Returns the legs of consecutive strokes.
    ///
    /// # Errors
    ///
    /// [`Unreachable`] where the rail misses the axis by more than a stroke keeps from it.
    pub fn legs(&mut self, strokes: &[Stroke]) -> Result<Vec<Vec<Leg>>, Unreachable> {
        let flat = self.flat_legs(strokes).map_err(|(_, error)| error)?;
        let mut legs = flat.legs.into_iter();
        Ok(flat.counts.iter().map(|&count| legs.by_ref().take(count).collect()).collect())
    }

    /// Like [`legs`](Self::legs) in one list, and says which stroke is out of reach.
    pub(crate) fn flat_legs(
        &mut self,
        strokes: &[Stroke],
    ) -> Result<FlatLegs, (usize, Unreachable)> {
        let mut legs = Vec::with_capacity(4 * strokes.len());
        let mut counts = Vec::with_capacity(strokes.len());
        while counts.len() < strokes.len() {
            let index = counts.len();
            let before = legs.len();
            if let Some((count, leg)) = self.long_move(&strokes[index..]) {
                // The strokes before the last of them have no leg of their own.
                counts.resize(index + count - 1, 0);
                legs.push(leg);
            } else {
                self.legs_of(strokes, index, &mut legs).map_err(|error| (index, error))?;
            }
            counts.push(legs.len() - before);
        }
        Ok(FlatLegs { legs, counts })
    }

    fn legs_of(
        &mut self,
        strokes: &[Stroke],
        index: usize,
        legs: &mut Vec<Leg>,
    ) -> Result<(), Unreachable> {
        let stroke = &strokes[index];
        let at = turned(&self.azimuth, &stroke.to);
        let target =
            Target { over_bed: Point2::from(self.alignment.over_bed(&at.xy())), z: stroke.to.z };
        if self.params.dialect.space == Space::Part {
            self.straight(stroke, at, legs);
            Ok(())
        } else if stroke.kind == Kind::Filament || target.over_bed == self.over_bed {
            self.standing(stroke, target.z, legs)
        } else {
            self.across(strokes, index, target, legs)?;
            self.unwind(strokes, index, legs)
        }
    }

    /// A stroke in a dialect whose moves are straight over the part.
    fn straight(&mut self, stroke: &Stroke, at: Point3<f64>, legs: &mut Vec<Leg>) {
        let at = self.params.dialect.rounded_point(&at);
        let here = self.at_part;
        // Joints are a courtesy here; where the rail cannot follow, they stay.
        self.joints = self
            .alignment
            .joints_from_part(&at, Branch::Near, self.joints.turn)
            .unwrap_or(Joints { z: at.z, ..self.joints });
        let path = if stroke.kind == Kind::Filament { 0.0 } else { (at - here).norm() };
        self.at_part = at;
        legs.push(Leg {
            kind: stroke.kind,
            to: self.joints,
            at,
            filament: stroke.filament,
            path,
            speed: stroke.speed,
        });
    }

    /// A stroke that moves the lift or the filament only.
    fn standing(
        &mut self,
        stroke: &Stroke,
        z: f64,
        legs: &mut Vec<Leg>,
    ) -> Result<(), Unreachable> {
        within(&self.lift, "lift", z)?;
        // Filament alone leaves a height that was changed for the axis as it is.
        let stays = stroke.kind == Kind::Filament && z == self.meant.z;
        let z = if stays { self.joints.z } else { z };
        let to = self.params.dialect.rounded_joints(&Joints { z, ..self.joints });
        let path = if stroke.kind == Kind::Filament { 0.0 } else { (to.z - self.joints.z).abs() };
        if path == 0.0 && stroke.filament == 0.0 {
            return Ok(());
        }
        let filament = self.with_owed(stroke.kind, stroke.filament, true);
        if !stays {
            self.meant.z = z;
        }
        self.joints = to;
        self.at_part = self.alignment.part_from_joints(&to);
        legs.push(Leg {
            kind: stroke.kind,
            to,
            at: self.at_part,
            filament,
            path,
            speed: stroke.speed,
        });
        Ok(())
    }

    /// Unwinds the bed after a travel, where the lines that follow would wind it too far.
    fn unwind(
        &mut self,
        strokes: &[Stroke],
        index: usize,
        legs: &mut Vec<Leg>,
    ) -> Result<(), Unreachable> {
        if strokes[index].kind != Kind::Travel || !self.most_turn.is_finite() {
            return Ok(());
        }
        let run = strokes[index + 1..].iter().take_while(|s| s.kind != Kind::Travel);
        let azimuth = |p: Point2<f64>| self.alignment.bed.turn(p.y.atan2(p.x));
        let places = run.map(|stroke| {
            let at = turned(&self.azimuth, &stroke.to);
            azimuth(Point2::from(self.alignment.over_bed(&at.xy())))
        });
        let run = extent(std::iter::once(azimuth(self.over_bed)).chain(places));
        let from = self.joints;
        let turn = unwinding(from.turn.radians(), &run, self.most_turn)?;
        let pieces = (turn.abs() / LARGEST_TURN).ceil() as u32;
        for k in 1..=pieces {
            let done = turn * f64::from(k) / f64::from(pieces);
            let turn = BedTurn::accumulated(from.turn.radians() + done);
            let to = Joints { turn, ..from };
            let part = self.alignment.part_from_joints(&to);
            let over_bed = Point2::from(self.alignment.over_bed(&part.xy()));
            self.push(Kind::Travel, to, &Target { over_bed, z: to.z }, legs)?;
            if let Some(leg) = legs.last_mut() {
                leg.speed = strokes[index].speed;
            }
        }
        Ok(())
    }

    /// A stroke across the bed.
    fn across(
        &mut self,
        strokes: &[Stroke],
        index: usize,
        target: Target,
        legs: &mut Vec<Leg>,
    ) -> Result<(), Unreachable> {
        let stroke = &strokes[index];
        let first = legs.len();
        let meant = target;
        let target = self.beside_axis(strokes, index, target);
        if self.passes_through(strokes, index, &target) {
            self.branch = self.branch.opposite();
            self.single(stroke.kind, &target, legs)?;
        } else if stroke.kind == Kind::Travel && !self.reaches_run(strokes, index, self.branch) {
            // Back to the side from which everything can be reached. An end on the axis has no
            // direction that a bed could turn to before the next line leaves it.
            self.branch = Branch::Near;
            let clearance = self.clear_radius(target.z);
            let over_bed = outside(target.over_bed, self.over_bed, clearance);
            self.single(stroke.kind, &Target { over_bed, ..target }, legs)?;
        } else {
            self.clear_of_axis(stroke.kind, &target, legs)?;
        }
        self.meant = meant;
        // The stroke's filament is spread over its legs by length.
        let length: f64 = legs[first..].iter().map(|leg| leg.path).sum();
        let filament = self.with_owed(stroke.kind, stroke.filament, legs.len() > first);
        for leg in &mut legs[first..] {
            leg.filament = filament * leg.path / length;
            leg.speed = stroke.speed;
        }
        Ok(())
    }

    /// The filament of a stroke with what strokes before it could not lay; or none, when it is too
    /// short to be a move itself.
    fn with_owed(&mut self, kind: Kind, filament: f64, moves: bool) -> f64 {
        let owed = if kind == Kind::Print { &mut self.owed } else { &mut self.owed_back };
        if moves {
            return filament + std::mem::take(owed);
        }
        *owed += filament;
        0.0
    }

    /// Whether the move to `to` leaves its line by far more than the tolerance. Its deviation in the
    /// middle is about an eighth of its second derivative across the line, `2θ'·u' − θ'²·u` for the
    /// nozzle at `u` from the axis: no sine or cosine is needed to know that most lines must be cut.
    fn is_surely_too_far(&self, to: &Joints, target: &Target, tolerance: f64) -> bool {
        let along = target.over_bed - self.over_bed;
        let length = along.norm();
        if length <= tolerance {
            return false;
        }
        let middle = nalgebra::center(&self.over_bed, &target.over_bed).coords;
        let turn = to.turn.radians() - self.joints.turn.radians();
        let turn = if self.alignment.bed.is_reversed { -turn } else { turn };
        let run = to.s - self.joints.s;
        let nozzle = (middle.norm()).copysign(self.joints.s + to.s);
        // Along the rail and across it, as far as either points away from the line.
        let radial = along.perp(&middle) / (length * nozzle);
        let across = along.dot(&middle) / (length * nozzle);
        let deviation = (2.0 * turn * run * across - turn * turn * nozzle * radial).abs() / 8.0;
        deviation > SURELY * tolerance
    }

    /// Whether the move to `to` stays within the tolerance of the straight line to `target`.
    fn is_near_enough(&self, to: &Joints, target: &Target, tolerance: f64) -> bool {
        let turn = to.turn.radians() - self.joints.turn.radians();
        if turn.abs() > LARGEST_TURN {
            return false;
        }
        let along = target.over_bed - self.over_bed;
        let length = along.norm();
        if length <= tolerance {
            return true;
        }
        let unit = along / length;
        // Firmwares that take part coordinates run some moves straight and some, in pieces of their
        // own choice, as the joints do: both ways must be near. The middle is mostly the farthest.
        let as_written = |share: f64| {
            let joints = self.params.dialect.between(&self.joints, to, share);
            unit.perp(&(self.over_bed_at(&joints) - self.over_bed)).abs() <= tolerance
        };
        (self.deviation_bound(to) <= tolerance
            || self.sweep(to).is_near(&self.over_bed, &unit, tolerance))
            && (self.params.dialect.space == Space::Joints
                || [0.5, 0.25, 0.75].into_iter().all(as_written))
            && self.turns_evenly(to, turn)
    }

    fn sweep(&self, to: &Joints) -> Sweep {
        Sweep::new(&self.alignment, self.facing, &self.joints, to)
    }

    /// No move to `to` that is straight in joint space leaves the line to its end by more than this,
    /// mm, but for the rounding of its ends: an eighth of the greatest second derivative of the place
    /// over the bed, which is `2θ'·ŵ' − θ'²·w` for the nozzle at `w` in the frame of the rail.
    fn deviation_bound(&self, to: &Joints) -> f64 {
        let (from, end) = (self.alignment.nozzle(&self.joints), self.alignment.nozzle(to));
        let turn = (to.turn.radians() - self.joints.turn.radians()).abs();
        let reach = from.norm_squared().max(end.norm_squared()).sqrt();
        let run = (end - from).norm();
        (2.0 * turn * run + turn * turn * reach) / 8.0 + ROUNDING_MM
    }

    /// Whether there is nothing in the height of the bed to be followed.
    fn follows_bed_anyhow(&self, target: &Target) -> bool {
        self.bed_map.is_flat() || self.joints.z.min(target.z) >= self.bed_map.fade()
    }

    /// Whether the lift, running evenly, keeps to the bed as it was probed.
    fn follows_bed(&self, target: &Target) -> bool {
        let map = &self.bed_map;
        if self.follows_bed_anyhow(target) {
            return true;
        }
        let (from, to) = (self.over_bed.coords, target.over_bed.coords);
        let lift = |share: f64| {
            let z = self.joints.z + (target.z - self.joints.z) * share;
            map.lift(&from.lerp(&to, share), z)
        };
        let (low, high) = (lift(0.0), lift(1.0));
        [0.25, 0.5, 0.75]
            .into_iter()
            .all(|share| (lift(share) - low - (high - low) * share).abs() <= HEIGHT_TOLERANCE_MM)
    }

    /// Whether the bed turns evenly enough in a move that is straight over an ideal machine.
    fn turns_evenly(&self, to: &Joints, turn: f64) -> bool {
        if self.params.dialect.space == Space::Joints || turn.abs() < SMALL_TURN {
            return true;
        }
        let half = self.params.dialect.between(&self.joints, to, 0.5);
        let done = half.turn.radians() - self.joints.turn.radians();
        (done - turn / 2.0).abs() <= LARGEST_UNEVENNESS * turn.abs()
    }

    /// One move straight in joint space, wherever that runs over the part.
    fn single(
        &mut self,
        kind: Kind,
        target: &Target,
        legs: &mut Vec<Leg>,
    ) -> Result<(), Unreachable> {
        let to = self.joints_at(target)?;
        self.push(kind, to, target, legs)
    }

    fn push(
        &mut self,
        kind: Kind,
        to: Joints,
        target: &Target,
        legs: &mut Vec<Leg>,
    ) -> Result<(), Unreachable> {
        within(&self.rail, "carriage", to.s)?;
        within(&self.lift, "lift", to.z)?;
        let to = self.as_written(&to);
        let facing = UnitComplex::new(self.alignment.bed.azimuth(to.turn));
        let part = self.alignment.part_from_bed(&(facing * self.alignment.nozzle(&to)));
        let at = Point3::new(part.x, part.y, to.z);
        let path = self.path_length(&to, at);
        if path < LEAST_PATH_MM {
            return Ok(());
        }
        (self.joints, self.facing) = (to, facing);
        self.over_bed = target.over_bed;
        self.at_part = at;
        legs.push(Leg { kind, to, at, filament: 0.0, path, speed: 0.0 });
        Ok(())
    }

    /// Joints as the text will say them, within the reach of the rail.
    pub(crate) fn as_written(&self, to: &Joints) -> Joints {
        let written = self.params.dialect.rounded_joints(to);
        if written.s <= self.rail.max {
            return written;
        }
        // Two rounded words may stand for a place farther out than either.
        let s = to.s.min(self.rail.max) - 2.0 * ROUNDING_MM;
        self.params.dialect.rounded_joints(&Joints { s, ..*to })
    }

    /// Length of the way of the nozzle over the part in one move to `to`, which is at `end`.
    fn path_length(&self, to: &Joints, end: Point3<f64>) -> f64 {
        let turn = (to.turn.radians() - self.joints.turn.radians()).abs();
        // Below a tenth of a radian arc and chord agree to 0.04 %.
        let pieces = (turn / 0.1).ceil().clamp(1.0, 1000.0) as u32;
        let mut from = self.at_part;
        let between = (1..pieces).map(|k| {
            let share = f64::from(k) / f64::from(pieces);
            let joints = self.params.dialect.between(&self.joints, to, share);
            self.alignment.part_from_joints(&joints)
        });
        between
            .chain(std::iter::once(end))
            .map(|next| {
                let length = (next - from).norm();
                from = next;
                length
            })
            .sum()
    }

    fn joints_at(&self, target: &Target) -> Result<Joints, Unreachable> {
        self.joints_on(target, self.branch)
    }

    fn joints_on(&self, target: &Target, branch: Branch) -> Result<Joints, Unreachable> {
        let near = self.joints.turn;
        self.alignment.joints_over_bed(&target.over_bed.coords, target.z, branch, near)
    }

    fn over_bed_at(&self, joints: &Joints) -> Point2<f64> {
        Point2::from(self.alignment.over_bed_from_joints(joints))
    }
}

/// Turns a point about the z axis.
fn turned(by: &UnitComplex<f64>, p: &Point3<f64>) -> Point3<f64> {
    let xy = by * p.xy();
    Point3::new(xy.x, xy.y, p.z)
}

/// Whether an axis reaches a position.
fn within(axis: &Axis, name: &'static str, position: f64) -> Result<(), Unreachable> {
    let Axis { min, max, .. } = *axis;
    if position < min - REACH_SLACK_MM || position > max + REACH_SLACK_MM {
        return Err(Unreachable::BeyondTravel { axis: name, position, min, max });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
