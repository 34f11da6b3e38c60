//! The planner: one layer after the other becomes steps of the program.

use machine::gcode::dialect::{CARTESIAN, Space};
use machine::kinematics::Unreachable;
use machine::profile::Printer;
use machine::program::{Arc, Joints, Move, Posed, Role, Step};
use nalgebra::{Point2, Point3, Vector3};
use slicer::surface::{Form, LayerSurface, Plane};
use slicer::toolpath::LayerPaths;

use crate::acceleration::Accelerations;
use crate::arcs::with_arcs;
use crate::cooling::{CoolingParams, slow_down};
use crate::helix::Helix;
use crate::objects::Objects;
use crate::order::{OrderParams, OrderedLine, order};
use crate::printed::Printed;
use crate::resample::{FlatLegs, Leg, ResampleParams, Resampler};
use crate::route::{FilamentParams, Item, Kind, Router, Speeds, Stroke};
use crate::scarf::{ScarfParams, ScarfPlacement};
use crate::seam::SeamMemory;
use crate::slow_flow::{FlowWatch, SlowFlow};
use crate::speed::{Limits, Pace, Travel, gentle_durations, posed_durations, taken, travels};
use crate::tilt::{PosedLegs, TiltParams, Tilter};
use crate::time;

/// Choices of the plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanParams {
    /// Which line comes after which.
    pub order: OrderParams,
    /// Speeds that are wanted.
    pub speeds: Speeds,
    /// How filament is fed.
    pub filament: FilamentParams,
    /// How closely moves follow lines.
    pub resample: ResampleParams,
    /// How fast the nozzle is sped up.
    pub accelerations: Accelerations,
    /// How the ends of walls meet their begins.
    pub scarf: ScarfParams,
    /// Least layer time.
    pub cooling: CoolingParams,
    /// Part fan and nozzle temperature.
    pub heat: HeatParams,
    /// Whether layers are curved, so that travel must look out for what is printed.
    pub curved: bool,
    /// How far nozzles that can be turned are tilted.
    pub tilt: TiltParams,
}

/// Fan and temperature over the layers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeatParams {
    /// Nozzle temperature of the first layer, °C; the start program sets it.
    pub first_layer_temperature: f64,
    /// Nozzle temperature of all others, °C.
    pub temperature: f64,
    /// Part fan, 0 to 1.
    pub fan: f64,
    /// The same for bridges and overhangs, where that is more.
    pub bridge_fan: f64,
    /// Part fan of layers that take [`long_layer`](Self::long_layer) or more, 0 to 1; in between it
    /// falls evenly from [`fan`](Self::fan), which is that of layers of
    /// [`short_layer`](Self::short_layer) and less.
    pub least_fan: f64,
    /// s.
    pub short_layer: f64,
    /// s.
    pub long_layer: f64,
    /// Layers without fan at the bottom.
    pub layers_without_fan: usize,
    /// The layer, counted from 1, from which on the fan is not held back; below it grows evenly.
    pub full_fan_layer: usize,
}

impl HeatParams {
    /// The part fan of a layer that takes so long (s).
    fn fan_of(&self, index: usize, time: f64) -> f64 {
        if index < self.layers_without_fan {
            return 0.0;
        }
        let least = self.least_fan.min(self.fan);
        let long = (time - self.short_layer) / (self.long_layer - self.short_layer);
        let fan = if time <= self.short_layer {
            self.fan
        } else if time >= self.long_layer {
            least
        } else {
            self.fan + (least - self.fan) * long
        };
        let count = index + 1;
        if count >= self.full_fan_layer {
            return fan;
        }
        let without = self.layers_without_fan as f64;
        fan * (count as f64 - without) / (self.full_fan_layer as f64 - without)
    }
}

/// What a program amounts to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Totals {
    /// Estimated time, s.
    pub time: f64,
    /// Filament fed, less what is drawn back, mm.
    pub filament: f64,
    /// Volume laid by role, mm³, in the order of [`Role::ALL`].
    pub volume: [f64; Role::ALL.len()],
    /// Way without laying material, mm.
    pub travel: f64,
    /// Moves of the nozzle.
    pub moves: usize,
    /// Times that the filament is drawn back.
    pub retractions: usize,
    /// Turns of the bed, whichever way.
    pub bed_turns: f64,
    /// What was laid with less flow than is good.
    pub slow_flow: SlowFlow,
    /// Length of the beads that the firmware runs at a pace of its own, mm.
    pub paced: f64,
    /// Greatest angle between the nozzle and where it should have pointed, radians: what a head with
    /// one tilt axis cannot follow.
    pub residual: f64,
}

impl Totals {
    /// Returns the volume laid, mm³.
    #[must_use]
    pub fn extruded(&self) -> f64 {
        self.volume.iter().sum()
    }

    /// Returns the volume laid of the part itself, without skirt, brim and supports, mm³.
    #[must_use]
    pub fn part(&self) -> f64 {
        let roles = Role::ALL.iter().zip(&self.volume);
        let is_part = |role: Role| role != Role::SkirtBrim && !is_support(role);
        roles.filter(|(role, _)| is_part(**role)).map(|(_, volume)| volume).sum()
    }

    /// Returns the volume laid of supports, mm³.
    #[must_use]
    pub fn supports(&self) -> f64 {
        let roles = Role::ALL.iter().zip(&self.volume);
        roles.filter(|(role, _)| is_support(**role)).map(|(_, volume)| volume).sum()
    }
}

fn is_support(role: Role) -> bool {
    matches!(role, Role::SupportMaterial | Role::SupportInterface)
}

/// Why a layer cannot be planned.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("layer {layer}: {source}")]
pub struct PlanError {
    /// Counted from 0.
    pub layer: usize,
    /// What is out of reach.
    #[source]
    pub source: Unreachable,
}

/// How a program says that the following layer climbs in one turn.
const CLIMBS: &str = "spiral vase";

/// Stands for the part fan of the layer, which depends on the time that it takes.
const USUAL_FAN: f64 = -1.0;

/// Changes of the part fan that nobody notices, as a share of its full speed.
const FAN_STEP: f64 = 0.01;

/// About how often a program says how long it has taken so far, s.
pub const TOLD_EVERY_S: f64 = 15.0;

/// Puts the time that has passed between the steps of a layer, at its begin and every so often; what the
/// moves were planned to take is stretched to the layer's estimate.
fn timed(steps: Vec<Step>, from: f64, to: f64) -> Vec<Step> {
    let planned = |step: &Step| match step {
        Step::Move(motion) | Step::Arc(Arc { motion, .. }) => motion.duration,
        Step::Posed(posed) => posed.motion.duration,
        _ => 0.0,
    };
    let all: f64 = steps.iter().map(planned).sum();
    let scale = if all > 0.0 { (to - from) / all } else { 0.0 };
    let (mut now, mut told) = (from, f64::NEG_INFINITY);
    let mut with_times = Vec::with_capacity(steps.len() + 1);
    for step in steps {
        // What belongs to a layer stands behind its begin.
        let is_begin = matches!(step, Step::Layer(_));
        let elapsed = now;
        now += planned(&step) * scale;
        let is_due = is_begin || elapsed - told >= TOLD_EVERY_S;
        if is_due && !is_begin {
            with_times.push(Step::Elapsed(elapsed));
        }
        with_times.push(step);
        if is_begin {
            with_times.push(Step::Elapsed(elapsed));
        }
        told = if is_due { elapsed } else { told };
    }
    with_times
}

/// Plans layer after layer. See the [module](self).
pub struct Planner<'a> {
    printer: &'a Printer,
    params: PlanParams,
    limits: Limits,
    resampler: Resampler,
    router: Router,
    seams: SeamMemory,
    helix: Helix,
    pace: Pace,
    totals: Totals,
    flow: FlowWatch,
    role: Role,
    /// The part fan as it was told last.
    fan: f64,
    objects: Option<Objects>,
    tells_time: bool,
    draws_arcs: bool,
    is_first_layer: bool,
    /// The acceleration that was told last, mm/s².
    acceleration: f64,
    tilter: Option<Tilter>,
    /// In which coordinates moves are straight, but for what a head makes of them.
    space: Space,
}

impl<'a> Planner<'a> {
    /// Returns a planner for a printer at its home position.
    #[must_use]
    pub fn new(printer: &'a Printer, mut params: PlanParams) -> Self {
        params.resample.dialect = params.resample.dialect.on(printer);
        params.order.seam = params.order.seam.seen_from(params.resample.azimuth);
        let dialect = params.resample.dialect;
        let chords = [params.resample.chord, params.resample.travel_chord];
        let tilter = Tilter::new(printer, params.tilt, dialect, chords);
        let stands = printer.head.as_ref().is_some_and(|head| !head.turns_bed());
        // Over a standing bed the tip runs straight; legs make it so.
        let tip = if stands && tilter.is_some() { CARTESIAN } else { dialect };
        let resampler = Resampler::new(printer, ResampleParams { dialect: tip, ..params.resample });
        let on_near_side = params.curved || tilter.is_some();
        let resampler = if on_near_side { resampler.on_near_side() } else { resampler };
        let printed = params.curved.then(|| Printed::nothing(printer.rail.max, printer.nozzle));
        Self {
            printer,
            params,
            limits: Limits::of(printer, params.resample.dialect.space),
            tilter,
            space: tip.space,
            router: Router::new(resampler.at(), printer.lift.speed, printed),
            resampler,
            seams: SeamMemory::default(),
            helix: Helix::default(),
            pace: Pace::REST,
            totals: Totals::default(),
            flow: FlowWatch::new(params.filament.least_flow, params.filament.area),
            role: Role::Custom,
            fan: 0.0,
            objects: None,
            tells_time: false,
            draws_arcs: false,
            is_first_layer: true,
            acceleration: f64::NAN,
        }
    }

    /// Tells which of several objects lines belong to.
    #[must_use]
    pub fn with_objects(self, objects: Objects) -> Self {
        Self { objects: Some(objects), ..self }
    }

    /// Puts arcs in place of lines on a circle.
    #[must_use]
    pub fn drawing_arcs(self) -> Self {
        Self { draws_arcs: true, ..self }
    }

    /// Tells how long the print has taken so far, every [`TOLD_EVERY_S`] or so.
    #[must_use]
    pub fn telling_time(self) -> Self {
        Self { tells_time: true, ..self }
    }

    /// The following layers have this form, which travel and nozzles that can be turned follow.
    pub fn follow(&mut self, form: Form) {
        self.router.follow(form);
        if let Some(tilter) = &mut self.tilter {
            tilter.follow(form);
        }
    }

    /// Plans the next layer.
    ///
    /// # Errors
    ///
    /// [`PlanError`] where a line comes nearer to the axis than the rail can.
    pub fn layer(&mut self, layer: &LayerPaths) -> Result<Vec<Step>, PlanError> {
        self.layer_on(layer, |_| Vector3::z())
    }

    /// Like [`layer`](Self::layer), for a layer with these unit normals, upwards.
    ///
    /// # Errors
    ///
    /// As [`layer`](Self::layer).
    pub fn layer_on(
        &mut self,
        layer: &LayerPaths,
        normal: impl Fn(&Point3<f64>) -> Vector3<f64>,
    ) -> Result<Vec<Step>, PlanError> {
        self.is_first_layer = layer.index == 0;
        let nozzle = self.begin_at();
        let turn = self.helix.turn(layer, nozzle);
        let climbs = turn.is_some();
        let lines = match turn {
            Some(turn) => vec![turn],
            None => order(layer, nozzle, &mut self.seams, &self.params.order),
        };
        let lines = self.with_scarfs(lines, normal);
        if let Some(objects) = &self.objects {
            self.router.belong_to(objects.of_islands(layer, self.params.resample.azimuth));
        }
        let items = self.router.layer(layer, &lines, &self.params.speeds, &self.params.filament);
        let items = self.with_bridge_fan(items, layer.index);
        let (before, start) = (self.totals.time, self.resampler.at_part());
        let planned =
            self.lower(items).map_err(|source| PlanError { layer: layer.index, source })?;
        let planned = if self.draws_arcs {
            with_arcs(planned, start, self.params.resample.chord)
        } else {
            planned
        };
        let fan = self.params.heat.fan_of(layer.index, self.totals.time - before);
        let mut steps = self.heat(layer.index, fan);
        if climbs {
            steps.push(Step::Remark(CLIMBS.into()));
        }
        steps.extend(self.with_usual_fan(planned));
        if self.tells_time {
            steps = timed(steps, before, self.totals.time);
        }
        Ok(steps)
    }

    /// Gives walls the seams that are wanted; on the first layer there is nothing to lie on.
    fn with_scarfs(
        &self,
        lines: Vec<OrderedLine>,
        normal: impl Fn(&Point3<f64>) -> Vector3<f64>,
    ) -> Vec<OrderedLine> {
        let scarf = &self.params.scarf;
        if self.is_first_layer || scarf.placement == ScarfPlacement::Nowhere {
            return lines;
        }
        let seamed = |line: OrderedLine| {
            if scarf.suits(&line) { scarf.scarfed(&line, &normal) } else { line }
        };
        lines.into_iter().map(seamed).collect()
    }

    /// Where the order of a layer begins: where the nozzle is. Home stands still while the part may
    /// be turned, so before the first line it is taken to turn with the part: a print then does not
    /// depend on how the model is turned, but for the way to it.
    fn begin_at(&self) -> Point2<f64> {
        if self.totals.moves == 0 {
            return Point2::new(self.printer.home.s, 0.0);
        }
        self.router.at().xy()
    }

    /// Plans the end: filament back, nozzle up and out of the way.
    ///
    /// # Errors
    ///
    /// [`PlanError`], which cannot occur after a layer that was planned.
    pub fn finish(mut self) -> Result<(Vec<Step>, Totals), PlanError> {
        const CLEARANCE_MM: f64 = 5.0;
        self.follow(Plane.form());
        let fail = |source| PlanError { layer: 0, source };
        let items = self.router.draw_back(&self.params.filament);
        let mut steps = self.lower(items).map_err(fail)?;
        let home = Joints { s: self.printer.home.s, ..self.resampler.joints() };
        let out = self.printer.alignment.part_from_joints(&home).xy();
        let items = self.router.leave(&out, CLEARANCE_MM, self.printer.lift.max);
        steps.extend(self.lower(items).map_err(fail)?);
        let from = self.resampler.joints();
        let to = self.resampler.as_written(&Joints { s: self.printer.home.s, ..from });
        let path = (to.s - from.s).abs();
        if path > 0.0 {
            let at = self.printer.alignment.part_from_joints(&to);
            let speed = self.params.speeds.travel;
            let leg = Leg { kind: Kind::Travel, to, at, filament: 0.0, path, speed };
            let gentle = self.params.accelerations.of_travel();
            let legs = FlatLegs { legs: vec![leg], counts: vec![1] };
            let Timed { moves, accelerations, .. } =
                self.timed(legs, from, vec![gentle]).map_err(fail)?;
            for (step, wanted) in moves.into_iter().zip(accelerations) {
                if self.params.accelerations.are_wanted() {
                    self.tell(wanted, &mut steps);
                }
                steps.push(step);
            }
        }
        let residual = self.tilter.as_ref().map_or(0.0, Tilter::residual);
        Ok((steps, Totals { slow_flow: self.flow.found(), residual, ..self.totals }))
    }

    fn heat(&mut self, index: usize, fan: f64) -> Vec<Step> {
        let heat = &self.params.heat;
        let mut steps = Vec::new();
        if index == 1 && heat.temperature != heat.first_layer_temperature {
            let celsius = machine::gcode::decimal(heat.temperature, 0);
            steps.push(Step::Custom(format!("M104 S{celsius}")));
        }
        if (fan - self.fan).abs() >= FAN_STEP || (fan == 0.0 && self.fan > 0.0) {
            steps.push(Step::Fan(fan));
            self.fan = fan;
        }
        steps
    }

    /// Turns the fan up for what hangs in the air, and back to [`USUAL_FAN`].
    fn with_bridge_fan(&self, items: Vec<Item>, index: usize) -> Vec<Item> {
        let heat = &self.params.heat;
        let may_be_less = heat.least_fan.min(heat.fan) < heat.bridge_fan;
        if !may_be_less && heat.full_fan_layer <= index || index < heat.layers_without_fan {
            return items;
        }
        let (mut fan, mut hanging) = (USUAL_FAN, false);
        let mut all = Vec::with_capacity(items.len());
        for item in items {
            // Lines that hang follow each other: between them the fan is left as it is.
            let lays = match &item {
                Item::Hangs(hangs) => {
                    hanging = *hangs;
                    hanging
                }
                Item::Stroke(stroke) => stroke.kind == Kind::Print,
                Item::Step(step) => matches!(step, Step::Bead(..)),
            };
            let wanted = if hanging { heat.bridge_fan } else { USUAL_FAN };
            if lays && wanted != fan {
                all.push(Item::Step(Step::Fan(wanted)));
                fan = wanted;
            }
            all.push(item);
        }
        if fan != USUAL_FAN {
            all.push(Item::Step(Step::Fan(USUAL_FAN)));
        }
        all
    }

    /// Puts the layer's fan where it was left open; it stays where bridges want no more.
    fn with_usual_fan(&self, steps: Vec<Step>) -> impl Iterator<Item = Step> {
        let (usual, more) = (self.fan, self.params.heat.bridge_fan > self.fan);
        steps.into_iter().filter_map(move |step| match step {
            Step::Fan(_) if !more => None,
            Step::Fan(USUAL_FAN) => Some(Step::Fan(usual)),
            step => Some(step),
        })
    }

    /// Turns strokes into timed moves, in their places between the other steps.
    fn lower(&mut self, items: Vec<Item>) -> Result<Vec<Step>, Unreachable> {
        let strokes: Vec<Stroke> = items
            .iter()
            .filter_map(|item| match item {
                Item::Stroke(stroke) => Some(*stroke),
                Item::Hangs(_) | Item::Step(_) => None,
            })
            .collect();
        let start = self.resampler.joints();
        let legs = self.resampler.flat_legs(&strokes).map_err(|(_, unreachable)| unreachable)?;
        let Timed { counts, moves, accelerations } = self.timed_by_role(legs, start, &items)?;
        let mut steps = Vec::with_capacity(items.len() + moves.len());
        let tells = self.params.accelerations.are_wanted();
        let mut moves = moves.into_iter().zip(accelerations);
        let mut counts = counts.into_iter();
        for item in items {
            match item {
                Item::Step(step) => steps.push(step),
                Item::Hangs(_) => {}
                Item::Stroke(_) => {
                    for (step, wanted) in moves.by_ref().take(counts.next().unwrap_or(0)) {
                        if tells {
                            self.tell(wanted, &mut steps);
                        }
                        steps.push(step);
                    }
                }
            }
        }
        Ok(steps)
    }

    /// Says how fast the nozzle may be sped up from here on, where that is not still the same.
    fn tell(&mut self, wanted: f64, steps: &mut Vec<Step>) {
        let wanted = wanted.min(self.printer.path_acceleration);
        if wanted != self.acceleration {
            steps.push(Step::Acceleration(wanted));
            self.acceleration = wanted;
        }
    }

    /// Like [`timed`](Self::timed), with the volume counted by role.
    fn timed_by_role(
        &mut self,
        legs: FlatLegs,
        start: Joints,
        items: &[Item],
    ) -> Result<Timed, Unreachable> {
        let mut rest = legs.legs.iter();
        let mut counts = legs.counts.iter();
        let wanted = self.params.accelerations;
        let mut accelerations = Vec::with_capacity(legs.legs.len());
        for item in items {
            match item {
                Item::Step(Step::Bead(role, _)) => self.role = *role,
                Item::Hangs(_) | Item::Step(_) => {}
                Item::Stroke(_) => {
                    let mut fed = 0.0;
                    for leg in rest.by_ref().take(counts.next().copied().unwrap_or(0)) {
                        let prints = leg.kind == Kind::Print;
                        fed += if prints { leg.filament } else { 0.0 };
                        accelerations.push(if prints {
                            wanted.of(self.role, self.is_first_layer)
                        } else {
                            wanted.of_travel()
                        });
                    }
                    let place = Role::ALL.iter().position(|role| *role == self.role);
                    self.totals.volume[place.expect("all roles are listed")] +=
                        fed * self.params.filament.area;
                }
            }
        }
        self.timed(legs, start, accelerations)
    }

    /// Gives every leg its duration.
    fn timed(
        &mut self,
        FlatLegs { legs, counts }: FlatLegs,
        start: Joints,
        accelerations: Vec<f64>,
    ) -> Result<Timed, Unreachable> {
        let Some(tilter) = &mut self.tilter else {
            let travels = travels(&legs, start);
            let law = |legs: &[Leg], pace: Pace, limits: &Limits| {
                gentle_durations(legs, &travels, pace, limits, &accelerations)
            };
            let (legs, times) = self.timed_by(legs, &travels, start, &accelerations, law);
            let moves = legs.iter().zip(times).map(|(leg, time)| Step::Move(planned(leg, time)));
            return Ok(Timed { counts, moves: moves.collect(), accelerations });
        };
        let from = tilter.stance();
        let mut legs = legs.into_iter();
        let groups = counts.iter().map(|&count| legs.by_ref().take(count).collect()).collect();
        let PosedLegs { groups, stances, swings, origins } = tilter.legs(groups)?;
        let accelerations: Vec<f64> =
            origins.iter().filter_map(|&k| accelerations.get(k).copied()).collect();
        let counts = groups.iter().map(Vec::len).collect();
        let legs: Vec<Leg> = groups.into_iter().flatten().collect();
        let travels = travels(&legs, start);
        let law = |legs: &[Leg], pace: Pace, limits: &Limits| {
            posed_durations(legs, (&from, &stances), pace, limits, &accelerations)
        };
        let (legs, times) = self.timed_by(legs, &travels, start, &accelerations, law);
        let motions = legs.iter().zip(times).map(|(leg, time)| planned(leg, time));
        let moves = motions.zip(stances.iter().zip(&swings)).map(|(motion, (&stance, &swing))| {
            Step::Posed(Box::new(Posed { motion, stance, swing }))
        });
        let moves = moves.collect();
        Ok(Timed { counts, moves, accelerations })
    }

    /// Gives legs the durations of a law of speed, s, and counts them.
    fn timed_by(
        &mut self,
        mut legs: Vec<Leg>,
        travels: &[Travel],
        start: Joints,
        wanted: &[f64],
        law: impl Fn(&[Leg], Pace, &Limits) -> (Vec<f64>, Pace),
    ) -> (Vec<Leg>, Vec<f64>) {
        let (mut times, mut pace) = law(&legs, self.pace, &self.limits);
        let least_feed = self.params.filament.least_flow / self.params.filament.area;
        if slow_down(&mut legs, &times, &self.params.cooling, least_feed) {
            (times, pace) = law(&legs, self.pace, &self.limits);
        }
        self.pace = pace;
        let dialect = &self.params.resample.dialect;
        let taken = taken(&legs, start, &times, dialect);
        self.totals.paced += taken.paced;
        let taken = taken.times;
        self.totals.time +=
            time::estimate(&legs, travels, &taken, self.printer, self.space, wanted);
        for (leg, travel) in legs.iter().zip(travels) {
            self.count(leg, travel.axes[1]);
        }
        for (leg, &duration) in legs.iter().zip(taken.iter()) {
            self.flow.look(&planned(leg, duration));
        }
        (legs, times)
    }

    fn count(&mut self, leg: &Leg, turned: f64) {
        self.totals.filament += leg.filament;
        self.totals.bed_turns += turned.abs() / std::f64::consts::TAU;
        match leg.kind {
            Kind::Print => self.totals.moves += 1,
            Kind::Travel => {
                self.totals.moves += 1;
                self.totals.travel += leg.path;
            }
            Kind::Filament => {
                self.totals.retractions += usize::from(leg.filament < 0.0);
            }
        }
    }

    /// Returns where the nozzle stands, in the slicer's frame.
    #[must_use]
    pub fn at(&self) -> Point3<f64> {
        self.router.at()
    }
}

fn planned(leg: &Leg, duration: f64) -> Move {
    let Leg { to, at, filament, path, .. } = *leg;
    Move { to, at, filament, path, duration }
}

/// Legs as steps that last as long as they should.
struct Timed {
    /// How many each stroke has.
    counts: Vec<usize>,
    moves: Vec<Step>,
    /// How fast the nozzle should be sped up in each, mm/s².
    accelerations: Vec<f64>,
}
