//! Can a head that turns the nozzle stand and move as it is told, and does the nozzle then point where it
//! should?
//!
//! At the end of every move: ranges of tilts, legs, carriage and lift; joint cones, distance and
//! conditioning of legs; the block of the hot end and the tip over the bed. Along it: the drives run
//! evenly, so the tip leaves the way over the part that the other checks are shown; at a quarter, half
//! and three quarters it must lie within [`OFF_PATH`]. Speeds and accelerations of all drives, as for
//! carriage and bed of other printers. While material is laid the nozzle stays within its cone of the
//! layer's normal. mm, radians, seconds.

use machine::head::{Head, Stance};
use machine::height_map::HeightMap;
use machine::kinematics::Alignment;
use machine::profile::{Axis as Range, NozzleShape, Printer};
use nalgebra::Point3;

use crate::check::acceleration::{Axis, Broken, Run};
use crate::family::Family;
use crate::finding::{Findings, Place, exceeds};
use crate::posed::PosedMove;
use crate::rounding::{Doubt, LENGTH, TURN};
use crate::segment::Segment;

/// The name of this check.
pub const NAME: &str = "head";

/// How far the tip may leave its way within a move that lays material, mm.
pub const OFF_PATH: f64 = 0.01;

/// The same for other moves, mm.
pub const OFF_TRAVEL: f64 = 0.3;

/// How far the block of the hot end may be below the bed's plane, mm: rounding.
const OVER_BED: f64 = 0.005;

/// What the drives of a head did, and the greatest values seen.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HeadTotals {
    /// Greatest angle of the nozzle from the vertical, radians.
    pub tilt: f64,
    /// Greatest angle between nozzle and normal while material is laid, radians.
    pub off_normal: f64,
    /// Greatest distance of the tip from its way while material is laid, mm.
    pub off_path: f64,
    /// Greatest share of its speed limit that any drive of the machine used.
    pub speed_share: f64,
}

/// Judges the moves of such a machine.
#[derive(Debug)]
pub(crate) struct HeadCheck {
    head: Head,
    alignment: Alignment,
    bed_map: HeightMap,
    rail: Range,
    lift: Range,
    nozzle: NozzleShape,
    drives: Vec<Driven>,
    family: Family,
    totals: HeadTotals,
}

/// One drive.
#[derive(Debug)]
struct Driven {
    name: &'static str,
    /// What a finding says of its speed, and one unit of it in mm or radians.
    unit: (&'static str, f64),
    of: Of,
    speed: f64,
    acceleration: Axis,
    last_place: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Of {
    Carriage,
    Bed,
    Lift,
    Own(usize),
}

impl Of {
    fn change(self, [from, to]: &[Stance; 2]) -> f64 {
        match self {
            Self::Carriage => to.base.s - from.base.s,
            Self::Bed => to.base.turn.radians() - from.base.turn.radians(),
            Self::Lift => to.base.z - from.base.z,
            Self::Own(k) => to.head[k] - from.head[k],
        }
    }
}

const MM: (&str, f64) = ("mm", 1.0);
const DEGREES: (&str, f64) = ("°", std::f64::consts::PI / 180.0);

impl HeadCheck {
    /// Returns the check for a printer; `None` where its nozzle stands upright.
    pub(crate) fn new(printer: &Printer) -> Option<Self> {
        let head = printer.head.clone()?;
        let mut drives = Vec::new();
        let mut drive = |name, unit, of, limits: (f64, f64), sudden, last_place| {
            let (speed, acceleration) = (limits.0, Axis::new(limits.1, sudden));
            drives.push(Driven { name, unit, of, speed, acceleration, last_place });
        };
        let (rail, lift, bed) = (printer.rail, printer.lift, printer.bed);
        if head.has_carriage() {
            let limits = (rail.speed, rail.acceleration);
            drive("the carriage", MM, Of::Carriage, limits, printer.rail_jerk, LENGTH);
            drive("the lift", MM, Of::Lift, (lift.speed, lift.acceleration), 0.0, LENGTH);
        }
        if head.turns_bed() {
            let limits = (bed.speed, bed.acceleration);
            drive("the bed", DEGREES, Of::Bed, limits, printer.bed_jerk, TURN);
        }
        for (k, own) in head.axes().iter().enumerate() {
            let limits = (own.axis.speed, own.axis.acceleration);
            let (unit, place) = if own.is_angle { (DEGREES, TURN) } else { (MM, LENGTH) };
            drive(own.name, unit, Of::Own(k), limits, 0.0, place);
        }
        Some(Self {
            head,
            alignment: printer.alignment,
            bed_map: printer.bed_map.clone(),
            rail,
            lift,
            nozzle: printer.nozzle,
            drives,
            family: Family::Planar,
            totals: HeadTotals::default(),
        })
    }

    /// A layer of this family begins.
    pub(crate) fn layer(&mut self, family: Family) {
        self.family = family;
    }

    /// Everything comes to rest.
    pub(crate) fn rest(&mut self, place: Place, findings: &mut Findings) {
        for driven in &mut self.drives {
            if let Some(broken) = driven.acceleration.next(Run::default()) {
                driven.report(&broken, place, findings);
            }
        }
    }

    /// What was seen.
    pub(crate) fn totals(&self) -> HeadTotals {
        self.totals
    }

    pub(crate) fn segment(
        &mut self,
        segment: &Segment,
        posed: &PosedMove,
        doubt: &Doubt,
        findings: &mut Findings,
    ) {
        let place = Place::end_of(segment);
        if let Some(error) = posed.lost {
            let message = || format!("the drives hold no nozzle there: {error}");
            findings.error(NAME, place, (1.0, 0.0), message);
            return;
        }
        self.drives(segment, posed, doubt, place, findings);
        if segment.path > 0.0 {
            self.stands(posed, place, findings);
            self.keeps_to_its_way(segment, posed, place, findings);
            self.points(segment, posed, place, findings);
        }
    }

    /// Speeds and accelerations.
    fn drives(
        &mut self,
        segment: &Segment,
        posed: &PosedMove,
        doubt: &Doubt,
        place: Place,
        findings: &mut Findings,
    ) {
        if segment.duration == 0.0 {
            return;
        }
        for driven in &mut self.drives {
            let change = driven.of.change(&posed.stances);
            let last_place = if segment.path == 0.0 { 0.0 } else { driven.last_place };
            let speed = change / segment.duration;
            let off = doubt.of_speed(change, last_place, segment.duration);
            let surely = (speed.abs() - off).max(0.0);
            self.totals.speed_share = self.totals.speed_share.max(surely / driven.speed);
            if exceeds(surely, driven.speed) {
                let (unit, one) = driven.unit;
                let (measured, limit) = (speed.abs() / one, driven.speed / one);
                let name = driven.name;
                findings.error(NAME, place, (measured, limit), || {
                    format!(
                        "{name} runs at {measured:.2} {unit}/s, its limit is {limit:.2} {unit}/s"
                    )
                });
            }
            let half = segment.duration / 2.0;
            let run = Run { speed, doubt: off, half, half_doubt: half * doubt.duration };
            if let Some(broken) = driven.acceleration.next(run) {
                driven.report(&broken, place, findings);
            }
        }
    }

    /// Whether the head can stand as it is told, over the bed.
    fn stands(&mut self, posed: &PosedMove, place: Place, findings: &mut Findings) {
        let ([_, stance], [_, pose]) = (&posed.stances, &posed.poses);
        if let Err(error) = self.head.check(stance, pose, &self.alignment) {
            findings.error(NAME, place, (1.0, 0.0), || error.to_string());
        }
        if self.head.has_carriage() {
            let [s, z] = [stance.base.s, stance.base.z];
            for (what, at, range) in [("carriage", s, self.rail), ("lift", z, self.lift)] {
                let (least, most) = (range.min - LENGTH, range.max + LENGTH);
                if exceeds(least, at) || exceeds(at, most) {
                    let limit = if at < least { range.min } else { range.max };
                    findings.error(NAME, place, (at, limit), || {
                        format!("the {what} is sent to {at:.3} mm, it reaches to {limit:.3} mm")
                    });
                }
            }
        }
        let tilt = pose.axis.z.clamp(-1.0, 1.0).acos();
        self.totals.tilt = self.totals.tilt.max(tilt);
        let NozzleShape { block_height, block_radius, .. } = self.nozzle;
        let rim = pose.at.z + block_height * tilt.cos() - block_radius * tilt.sin();
        if rim < -OVER_BED {
            findings.error(NAME, place, (rim, 0.0), || {
                let degrees = tilt.to_degrees();
                format!(
                    "tilted by {degrees:.1}°, the hot end's block reaches {:.2} mm below the bed",
                    -rim
                )
            });
        }
        let z = self.over_bed(&pose.at).z;
        if z < -OVER_BED {
            findings.error(NAME, place, (z, 0.0), || {
                format!("the tip of the nozzle stands {:.3} mm below the bed", -z)
            });
        }
    }

    /// A place with its height above the bed as it was probed.
    fn over_bed(&self, at: &Point3<f64>) -> Point3<f64> {
        if self.bed_map.is_flat() {
            return *at;
        }
        let z = self.bed_map.part_z(&self.alignment.over_bed(&at.xy()), at.z);
        Point3::new(at.x, at.y, z)
    }

    /// How far the tip leaves its way between the ends.
    fn keeps_to_its_way(
        &mut self,
        segment: &Segment,
        posed: &PosedMove,
        place: Place,
        findings: &mut Findings,
    ) {
        let [from, to] = &posed.stances;
        let limit = if segment.extrudes() { OFF_PATH } else { OFF_TRAVEL };
        let mut worst: f64 = 0.0;
        for share in [0.25, 0.5, 0.75] {
            let over = self.alignment.part_from_bed(&segment.curve.over_bed(share));
            let [low, high] = segment.part.map(|p| p.z);
            let way = Point3::new(over.x, over.y, low + (high - low) * share);
            let stance = Head::between(from, to, share);
            match self.head.pose(&stance, &posed.poses[1], &self.alignment) {
                Ok(pose) => worst = worst.max((self.over_bed(&pose.at) - way).norm()),
                Err(error) => {
                    findings.error(NAME, place, (1.0, 0.0), || format!("on the way: {error}"));
                    return;
                }
            }
        }
        if segment.extrudes() {
            self.totals.off_path = self.totals.off_path.max(worst);
        }
        if exceeds(worst, limit) {
            findings.error(NAME, place, (worst, limit), || {
                format!(
                    "between the ends of the move the tip is {worst:.4} mm off its way, at most \
                     {limit} mm is allowed"
                )
            });
        }
    }

    /// Whether the nozzle's own cone clears the layer.
    fn points(
        &mut self,
        segment: &Segment,
        posed: &PosedMove,
        place: Place,
        findings: &mut Findings,
    ) {
        if !segment.extrudes() {
            return;
        }
        let pose = &posed.poses[1];
        let normal = self.family.normal(&pose.at);
        let angle = normal.angle(&pose.axis);
        if !angle.is_finite() {
            return;
        }
        self.totals.off_normal = self.totals.off_normal.max(angle);
        let flank = std::f64::consts::FRAC_PI_2 - self.nozzle.half_angle;
        if exceeds(angle, flank) {
            let (measured, limit) = (angle.to_degrees(), flank.to_degrees());
            findings.error(NAME, place, (measured, limit), || {
                format!(
                    "the nozzle stands {measured:.1}° off the layer's normal, its cone clears \
                     {limit:.1}°"
                )
            });
        }
    }
}

impl Driven {
    fn report(&self, broken: &Broken, place: Place, findings: &mut Findings) {
        let (unit, one) = self.unit;
        let (measured, limit) = (broken.acceleration / one, self.acceleration.limit() / one);
        let name = self.name;
        findings.error(NAME, place, (measured, limit), || {
            format!("{name} is accelerated by {measured:.1} {unit}/s², its limit is {limit:.1} {unit}/s²")
        });
    }
}
