//! How the nozzle stands along its way, and the moves of machines whose head turns it.
//!
//! All families of layers are surfaces of revolution about the axis of the bed, so a direction is one
//! angle in the meridian: positive where the nozzle leans outwards, as it does on layers that slope
//! down outwards. The [`Field`] says it for every place: that of the normal, or as little as the nozzle
//! needs to clear the layer, and in either case no more than the head reaches, than keeps the block of
//! the hot end over bed and bowl, and than the carriage has rail for. It depends on the place alone, so
//! neighbouring beads are laid alike, and it is even along a layer; how fast the drives can follow is
//! the business of the law of [`speed`](crate::speed).
//!
//! The tilter turns legs of the tip into moves of all drives. Those run evenly from end to end of a
//! move, so the tip leaves the way that an upright nozzle would take; legs are halved until it lies
//! within half the chord tolerance of it, and the direction within half a degree. What is counted are
//! stances as the text says them, through the forward kinematics.

use machine::gcode::Dialect;
use machine::gcode::dialect::POLAR;
use machine::head::{Head, Pose, Stance};
use machine::height_map::HeightMap;
use machine::kinematics::{Alignment, Branch, Unreachable};
use machine::profile::{Axis, NozzleShape, Printer};
use machine::program::Joints;
use nalgebra::{Point3, UnitVector3, Vector3};
use slicer::surface::Form;

use crate::resample::Leg;
use crate::route::Kind;

/// How much the nozzle is to be tilted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Tilt {
    /// Not at all.
    None,
    /// As little as it must to clear the layers.
    #[default]
    Needed,
    /// Along the normal of the layers.
    Normal,
}

/// Choices about the direction of the nozzle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TiltParams {
    /// How much of it.
    pub tilt: Tilt,
    /// The steepest slope that a nozzle clears, seen from its own axis, radians.
    pub clears: f64,
}

/// The direction of the nozzle everywhere. See the [module](self).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    params: TiltParams,
    /// How far the head tilts inwards (negative) and outwards, radians.
    range: [f64; 2],
    /// How far the carriage reaches inwards and outwards, mm; infinite without one.
    rail: [f64; 2],
    pivot_length: f64,
    /// From the tip to the lower rim of the block: distance, mm, and angle from the nozzle, radians.
    rim: (f64, f64),
    /// Distance from the axis within which directions are taken back to the vertical, mm.
    calm: f64,
}

/// On a standing bed the direction turns round with the place; within this distance of the axis that
/// would be quick, mm.
const CALM_MM: f64 = 4.0;

/// What the pivot of a head with two axes keeps from the axis when it leans inwards, mm: nearer, the bed
/// would have to turn for a small step of the tip.
const PIVOT_CLEAR_MM: f64 = 2.0;

/// Share of the slope that a nozzle clears which is used before the head is tilted.
const CLEAR_SHARE: f64 = 0.95;

impl Field {
    /// Returns the field of a printer; `None` where its nozzle always stands upright.
    #[must_use]
    pub fn of(printer: &Printer, params: TiltParams) -> Option<Self> {
        let head = printer.head.as_ref()?;
        let NozzleShape { block_height, block_radius, half_angle, .. } = printer.nozzle;
        // The flank of the nozzle stays over the bed too.
        let flank = std::f64::consts::FRAC_PI_2 - half_angle;
        let range = head.tilts().map(|tilt| tilt.clamp(-flank, flank));
        let rail = match head {
            Head::Tilting(tilting) if tilting.axes.len() == 1 => {
                [printer.rail.min, printer.rail.max]
            }
            Head::Tilting(_) => [PIVOT_CLEAR_MM, printer.rail.max],
            Head::Hexapod(_) => [f64::NEG_INFINITY, f64::INFINITY],
        };
        Some(Self {
            params,
            range,
            rail,
            pivot_length: head.pivot_length(),
            rim: (block_height.hypot(block_radius), block_radius.atan2(block_height)),
            calm: if head.turns_bed() { 0.0 } else { CALM_MM },
        })
    }

    /// Returns how far the nozzle leans outwards over a place of the part, on layers of this form,
    /// radians.
    #[must_use]
    pub fn lean(&self, form: &Form, p: &Point3<f64>) -> f64 {
        let slope = form.slope(p);
        let spare = CLEAR_SHARE * self.params.clears;
        let wanted = match self.params.tilt {
            Tilt::None => return 0.0,
            Tilt::Needed => (slope.abs() - spare).max(0.0).copysign(slope),
            Tilt::Normal => slope,
        };
        if wanted == 0.0 {
            return 0.0;
        }
        let r = p.x.hypot(p.y);
        let [inwards, outwards] = self.bounds(slope, r, p.z);
        let lean = wanted.clamp(inwards, outwards);
        if r < self.calm { lean * r / self.calm } else { lean }
    }

    /// How far the nozzle may lean either way.
    fn bounds(&self, slope: f64, r: f64, z: f64) -> [f64; 2] {
        let (reach, angle) = self.rim;
        // The rim of the block over the bed.
        let mut most = (-(z.max(0.0)) / reach).max(-1.0).acos() - angle;
        if slope < 0.0 {
            // And over the other side of a bowl.
            let across = (reach - 2.0 * r).max(-reach) * -slope.tan() / reach;
            most = most.min(across.clamp(-1.0, 1.0).acos() - angle);
        }
        let most = most.max(0.0);
        let sine = |x: f64| {
            if x.is_finite() { (x / self.pivot_length).clamp(-1.0, 1.0).asin() } else { x }
        };
        let rail = [sine(self.rail[0] - r).min(0.0), sine(self.rail[1] - r).max(0.0)];
        [self.range[0].max(-most).max(rail[0]), self.range[1].min(most).min(rail[1])]
    }

    /// Returns how steep layers of this form look from the nozzle over a place, radians.
    #[must_use]
    pub fn steepness(&self, form: &Form, p: &Point3<f64>) -> f64 {
        let slope = form.slope(p);
        // On top of a cone nothing lies uphill of where the direction is taken back.
        let calm = if slope > 0.0 { 0.0 } else { self.calm };
        (slope - Self { calm, ..*self }.lean(form, p)).abs()
    }

    fn axis(&self, form: &Form, p: &Point3<f64>) -> UnitVector3<f64> {
        let lean = self.lean(form, p);
        let out = p.coords.xy().try_normalize(0.0).unwrap_or_else(nalgebra::zero) * lean.sin();
        UnitVector3::new_normalize(Vector3::new(out.x, out.y, lean.cos()))
    }
}

/// Legs with what the drives stand at after each.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PosedLegs {
    /// The legs of each stroke.
    pub(crate) groups: Vec<Vec<Leg>>,
    /// What the drives stand at after each of them.
    pub(crate) stances: Vec<Stance>,
    /// How far the pivot runs round the tip in each, mm.
    pub(crate) swings: Vec<f64>,
    /// The leg of the tip that each is a piece of, counted over all groups.
    pub(crate) origins: Vec<usize>,
}

/// Turns legs of the tip into moves of all drives. See the [module](self).
#[derive(Debug, Clone)]
pub(crate) struct Tilter {
    head: Head,
    alignment: Alignment,
    bed_map: HeightMap,
    rail: Axis,
    lift: Axis,
    dialect: Dialect,
    field: Field,
    /// From the frame that turns with the slicer's to the part's is a turn about the axis: it does not
    /// show in an angle of the meridian.
    form: Form,
    tolerance: [f64; 2],
    /// Where an upright nozzle's joints would be for the tip.
    joints: Joints,
    pose: Pose,
    stance: Stance,
    /// Greatest angle between nozzle and direction wanted that the head could not follow, radians.
    residual: f64,
}

/// How far the direction may be off within a move, radians, where beads are laid and elsewhere.
const DIRECTION: [f64; 2] = [0.5 * DEGREE, 2.0 * DEGREE];

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Share of the chord tolerance that the turning of the nozzle may use.
pub const CHORD_SHARE: f64 = 0.5;

/// Halvings of a leg; a sixty-fourth of it is short.
const MOST_HALVINGS: u32 = 10;

/// Shorter legs are not halved, mm: rounding is seen there.
const LEAST_HALVED_MM: f64 = 0.04;

/// Turns of the nozzle up to this come with a bead; larger ones come before it, radians.
const SMALL_TURN: f64 = 0.5 * DEGREE;

/// What is shorter is the last digits of one place, mm.
const LEAST_PATH_MM: f64 = 1e-6;

/// How far an axis may be sent beyond its end, mm.
const REACH_SLACK_MM: f64 = 5e-4;

/// One half-way point of a leg.
struct Mark {
    share: f64,
    stance: Stance,
    pose: Pose,
}

/// The way of the tip in a leg.
struct Way<'a> {
    from: Joints,
    leg: &'a Leg,
    from_at: Point3<f64>,
    /// The direction at its begin, where it turns evenly to that of its end.
    turns_from: Option<UnitVector3<f64>>,
    to_axis: UnitVector3<f64>,
}

impl Tilter {
    /// Returns the tilter of a printer at home; `None` where its nozzle always stands upright.
    pub(crate) fn new(
        printer: &Printer,
        params: TiltParams,
        dialect: Dialect,
        chords: [f64; 2],
    ) -> Option<Self> {
        let head = printer.head.clone().filter(|_| dialect.speaks_of_heads())?;
        let field = Field::of(printer, params)?;
        let alignment = printer.alignment;
        let pose = Pose::upright(alignment.part_from_joints(&printer.home));
        // A home that the head cannot reach shows with the first move.
        let stance = head
            .stance(&pose, printer.home.turn, &alignment)
            .map(|reached| dialect.rounded_stance(&reached.stance, &head))
            .unwrap_or(Stance { base: printer.home, head: [0.0; 6] });
        Some(Self {
            head,
            alignment,
            bed_map: printer.bed_map.clone(),
            rail: printer.rail,
            lift: printer.lift,
            dialect,
            field,
            form: slicer::surface::LayerSurface::form(&slicer::surface::Plane),
            tolerance: chords.map(|chord| CHORD_SHARE * chord),
            joints: printer.home,
            pose,
            stance,
            residual: 0.0,
        })
    }

    /// The following legs lie on layers of this form.
    pub(crate) fn follow(&mut self, form: Form) {
        self.form = form;
    }

    /// What the drives stand at.
    pub(crate) fn stance(&self) -> Stance {
        self.stance
    }

    /// The greatest angle between nozzle and wanted direction that the head could not follow, radians.
    pub(crate) fn residual(&self) -> f64 {
        self.residual
    }

    /// Returns the moves of all drives for legs of the tip.
    ///
    /// # Errors
    ///
    /// [`Unreachable`] where the head cannot stand so.
    pub(crate) fn legs(&mut self, groups: Vec<Vec<Leg>>) -> Result<PosedLegs, Unreachable> {
        let mut posed = PosedLegs {
            groups: Vec::with_capacity(groups.len()),
            stances: Vec::new(),
            swings: Vec::new(),
            origins: Vec::new(),
        };
        let mut origin = 0;
        for group in groups {
            let mut legs = Vec::with_capacity(group.len());
            for leg in &group {
                self.leg(leg, &mut legs, &mut posed)?;
                posed.origins.resize(posed.stances.len(), origin);
                origin += 1;
            }
            posed.groups.push(legs);
        }
        Ok(posed)
    }

    fn leg(
        &mut self,
        leg: &Leg,
        legs: &mut Vec<Leg>,
        posed: &mut PosedLegs,
    ) -> Result<(), Unreachable> {
        if leg.path == 0.0 {
            let here = Leg { to: self.joints, at: self.pose.at, ..*leg };
            legs.push(here);
            posed.stances.push(self.stance);
            posed.swings.push(0.0);
            return Ok(());
        }
        let here = self.field.axis(&self.form, &self.pose.at);
        let mut is_off = self.pose.axis.angle(&here) > SMALL_TURN;
        if is_off {
            // Some heads cannot stand just so.
            let (_, pose) = self.stand(&Pose { axis: here, ..self.pose })?;
            is_off = self.pose.axis.angle(&pose.axis) > SMALL_TURN;
        }
        if is_off && leg.kind == Kind::Print {
            self.turn_on_the_spot(leg, here, legs, posed)?;
        }
        let way = Way {
            from: self.joints,
            leg,
            from_at: self.pose.at,
            turns_from: (is_off && leg.kind != Kind::Print).then_some(self.pose.axis),
            to_axis: self.field.axis(&self.form, &leg.at),
        };
        let begin = Mark { share: 0.0, stance: self.stance, pose: self.pose };
        let end = self.mark(&way, 1.0)?;
        let mut marks = Vec::new();
        self.divide(&way, &begin, end, MOST_HALVINGS, &mut marks)?;
        let mut filament_done = 0.0;
        for mark in &marks {
            let filament = leg.filament * mark.share - filament_done;
            if self.push(leg, mark, filament, legs, posed) {
                filament_done += filament;
            }
        }
        // What the last pieces were too short to lay goes with the one before.
        let owed = leg.filament - filament_done;
        if owed != 0.0 {
            match legs.last_mut() {
                Some(last) => last.filament += owed,
                None => {
                    legs.push(Leg {
                        to: self.joints,
                        at: self.pose.at,
                        filament: owed,
                        path: 0.0,
                        ..*leg
                    });
                    posed.stances.push(self.stance);
                    posed.swings.push(0.0);
                }
            }
        }
        // The tip follows the way of an upright one: errors of rounding do not add up.
        self.joints = leg.to;
        Ok(())
    }

    /// Turns the nozzle about its tip before a bead begins.
    fn turn_on_the_spot(
        &mut self,
        leg: &Leg,
        axis: UnitVector3<f64>,
        legs: &mut Vec<Leg>,
        posed: &mut PosedLegs,
    ) -> Result<(), Unreachable> {
        let from = self.pose;
        let steps = (from.axis.angle(&axis) / TURN_STEP).ceil().max(1.0) as u32;
        for k in 1..=steps {
            let axis = from.axis.slerp(&axis, f64::from(k) / f64::from(steps));
            let (stance, pose) = self.stand(&Pose { at: from.at, axis })?;
            let turn = Leg { kind: Kind::Travel, filament: 0.0, ..*leg };
            let mark = Mark { share: 1.0, stance, pose };
            self.push(&turn, &mark, 0.0, legs, posed);
        }
        Ok(())
    }

    fn push(
        &mut self,
        leg: &Leg,
        mark: &Mark,
        filament: f64,
        legs: &mut Vec<Leg>,
        posed: &mut PosedLegs,
    ) -> bool {
        let joints = self.joints_of(&mark.pose.at);
        let from = self.joints_of(&self.pose.at);
        let path = self.length(&from, &joints, &mark.pose.at);
        if path < LEAST_PATH_MM && mark.stance == self.stance {
            return false;
        }
        let swing = self.pose.axis.angle(&mark.pose.axis) * self.head.pivot_length();
        self.pose = mark.pose;
        self.stance = mark.stance;
        self.joints = joints;
        let path = path.max(LEAST_PATH_MM);
        legs.push(Leg { to: joints, at: mark.pose.at, filament, path, ..*leg });
        posed.stances.push(mark.stance);
        posed.swings.push(swing);
        true
    }

    /// Halves a piece of a leg until every drive may run evenly along it.
    fn divide(
        &mut self,
        way: &Way<'_>,
        from: &Mark,
        to: Mark,
        halvings: u32,
        marks: &mut Vec<Mark>,
    ) -> Result<(), Unreachable> {
        let share = f64::midpoint(from.share, to.share);
        let is_short = way.leg.path * (to.share - from.share) < LEAST_HALVED_MM
            && from.pose.axis.angle(&to.pose.axis) < DIRECTION[1];
        if halvings == 0 || is_short || self.is_even(way, from, &to)? {
            marks.push(to);
            return Ok(());
        }
        let middle = self.mark(way, share)?;
        let (stance, pose) = (middle.stance, middle.pose);
        self.divide(way, from, middle, halvings - 1, marks)?;
        self.divide(way, &Mark { share, stance, pose }, to, halvings - 1, marks)
    }

    /// Whether tip and direction keep to their ways when all drives run evenly.
    fn is_even(&self, way: &Way<'_>, from: &Mark, to: &Mark) -> Result<bool, Unreachable> {
        let kind = usize::from(way.leg.kind != Kind::Print);
        for part in [0.5, 0.25, 0.75] {
            let share = from.share + (to.share - from.share) * part;
            let wanted = self.wanted(way, share);
            let stance = Head::between(&from.stance, &to.stance, part);
            let pose = self.head.pose(&stance, &wanted, &self.alignment)?;
            let off = (self.on_bed(&pose).at - wanted.at).norm();
            let near = self.stance.base.turn;
            let residual = self.head.stance(&wanted, near, &self.alignment)?.residual;
            let angle = pose.axis.angle(&wanted.axis);
            if off > self.tolerance[kind] || angle > DIRECTION[kind] + residual {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn mark(&mut self, way: &Way<'_>, share: f64) -> Result<Mark, Unreachable> {
        let (stance, pose) = self.stand(&self.wanted(way, share))?;
        Ok(Mark { share, stance, pose })
    }

    /// The stance for a pose as the text says it, and what pose that is.
    fn stand(&mut self, wanted: &Pose) -> Result<(Stance, Pose), Unreachable> {
        let mut told = *wanted;
        if !self.bed_map.is_flat() {
            let over_bed = self.alignment.over_bed(&wanted.at.xy());
            told.at.z = self.bed_map.lift(&over_bed, wanted.at.z);
        }
        let near = self.stance.base.turn;
        let reached = self.head.stance(&told, near, &self.alignment)?;
        self.residual = self.residual.max(reached.residual);
        let stance = self.dialect.rounded_stance(&reached.stance, &self.head);
        if self.head.has_carriage() {
            within(&self.rail, "carriage", stance.base.s)?;
            within(&self.lift, "lift", stance.base.z)?;
        }
        let pose = self.head.pose(&stance, &told, &self.alignment)?;
        self.head.check(&stance, &pose, &self.alignment)?;
        Ok((stance, self.on_bed(&pose)))
    }

    /// A pose with its height above the bed as it was probed.
    fn on_bed(&self, pose: &Pose) -> Pose {
        if self.bed_map.is_flat() {
            return *pose;
        }
        let over_bed = self.alignment.over_bed(&pose.at.xy());
        let z = self.bed_map.part_z(&over_bed, pose.at.z);
        Pose { at: Point3::new(pose.at.x, pose.at.y, z), ..*pose }
    }

    fn wanted(&self, way: &Way<'_>, share: f64) -> Pose {
        let at = if !self.head.turns_bed() {
            way.from_at.lerp(&way.leg.at, share)
        } else if share == 1.0 {
            way.leg.at
        } else {
            self.alignment.part_from_joints(&POLAR.between(&way.from, &way.leg.to, share))
        };
        let axis = match &way.turns_from {
            Some(from) => from.slerp(&way.to_axis, share),
            None => self.field.axis(&self.form, &at),
        };
        Pose { at, axis }
    }

    /// The joints that bring an upright nozzle to a place.
    fn joints_of(&self, at: &Point3<f64>) -> Joints {
        self.alignment
            .joints_from_part(at, Branch::Near, self.joints.turn)
            .unwrap_or(Joints { z: at.z, ..self.joints })
    }

    /// Length of the way of the tip over the part from where it is to `end`, mm.
    fn length(&self, from: &Joints, to: &Joints, end: &Point3<f64>) -> f64 {
        if !self.head.turns_bed() {
            return (end - self.pose.at).norm();
        }
        let turn = (to.turn.radians() - from.turn.radians()).abs();
        // Below a tenth of a radian arc and chord agree to 0.04 %.
        let pieces = (turn / 0.1).ceil().clamp(1.0, 1000.0) as u32;
        let mut last = self.pose.at;
        let mut length = 0.0;
        for k in 1..=pieces {
            let next = if k == pieces {
                *end
            } else {
                let share = f64::from(k) / f64::from(pieces);
                self.alignment.part_from_joints(&POLAR.between(from, to, share))
            };
            length += (next - last).norm();
            last = next;
        }
        length
    }
}

/// Turns of the nozzle on the spot are cut into steps of this, radians: in each the tip stays where it is
/// to within the tolerance of travel.
const TURN_STEP: f64 = 2.0 * DEGREE;

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
