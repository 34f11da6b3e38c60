//! What happens between lines: travel, retraction, lift, wipe; and how much filament a line takes.
//!
//! A layer becomes a list of strokes, straight over the part, each with the filament it feeds and
//! the speed that is wanted; the machine's own limits come later.

use geom::region::Region;
use machine::program::{self, Layer, Step};
use nalgebra::{Point2, Point3, distance};
use slicer::bead::Bead;
use slicer::surface::{Form, LayerSurface, Plane};
use slicer::toolpath::{LayerPaths, Overhang, Role, Station};

use crate::comb::Comb;
use crate::order::OrderedLine;
use crate::printed::Printed;

/// Speeds that are wanted, mm/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Speeds {
    /// Outer walls.
    pub external_perimeter: f64,
    /// Other walls.
    pub perimeter: f64,
    /// Walls around little; 0 for no bound.
    pub small_perimeter: f64,
    /// Sparse infill.
    pub infill: f64,
    /// Solid infill.
    pub solid_infill: f64,
    /// Solid infill seen from above.
    pub top_solid_infill: f64,
    /// Single beads.
    pub gap_fill: f64,
    /// Infill that spans a gap.
    pub bridge: f64,
    /// Walls that hang over, by the degree from a quarter of the bead on; 0 for no bound.
    pub overhang: [f64; 4],
    /// The second run over tops.
    pub ironing: f64,
    /// Supports, and the layers of them next to the part.
    pub support: [f64; 2],
    /// Everything on the first layer.
    pub first_layer: f64,
    /// Without extruding.
    pub travel: f64,
}

impl Speeds {
    fn of(&self, role: Role, is_first_layer: bool) -> f64 {
        let speed = match role {
            Role::ExternalPerimeter => self.external_perimeter,
            Role::Perimeter => self.perimeter,
            Role::InternalInfill | Role::CombinedInfill => self.infill,
            Role::SolidInfill => self.solid_infill,
            Role::TopSolidInfill => self.top_solid_infill,
            Role::BridgeInfill => self.bridge,
            Role::Ironing => self.ironing,
            Role::GapFill => self.gap_fill,
            Role::SupportMaterial => self.support[0],
            Role::SupportInterface => self.support[1],
            Role::SkirtBrim => self.first_layer,
        };
        if is_first_layer { speed.min(self.first_layer) } else { speed }
    }

    /// The speed of a piece of a wall that hangs over.
    fn hanging(&self, speed: f64, overhang: Overhang) -> f64 {
        let degree = Overhang::ALL.iter().position(|degree| *degree == overhang);
        let bound = degree.and_then(|k| k.checked_sub(1)).map_or(0.0, |k| self.overhang[k]);
        if bound > 0.0 { speed.min(bound) } else { speed }
    }
}

/// How filament is fed and drawn back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilamentParams {
    /// Cross-section of the filament, mm².
    pub area: f64,
    /// Filament fed for each that the volume asks for.
    pub multiplier: f64,
    /// Most volume that melts, mm³/s.
    pub volume_per_second: f64,
    /// The least volume in a second without oozing and cooking, mm³/s.
    pub least_flow: f64,
    /// Filament drawn back before a travel, mm; 0 for never.
    pub retract_length: f64,
    /// Filament fed after a travel beyond what was drawn back, mm; less than zero to leave some out.
    pub restart_extra: f64,
    /// Speed of drawing back, mm/s.
    pub retract_speed: f64,
    /// Speed of feeding again, mm/s.
    pub feed_speed: f64,
    /// Whether filament is drawn back before every new layer.
    pub retract_between_layers: bool,
    /// Travels shorter than this leave the filament alone, mm.
    pub retract_before_travel: f64,
    /// How far the nozzle is lifted while the filament is drawn back, mm.
    pub retract_lift: f64,
    /// How far the nozzle runs back along the line while the filament is drawn back, mm.
    pub wipe: f64,
    /// Whether travel within an island keeps inside of it, and how far from its outlines, mm. On flat
    /// layers; curved ones have heights of their own to look out for.
    pub comb: Option<f64>,
}

/// What a stroke does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Lays material.
    Print,
    /// Moves without laying material.
    Travel,
    /// Moves filament alone.
    Filament,
}

/// A straight piece of the nozzle's way over the part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// What it does.
    pub kind: Kind,
    /// Where it ends, part frame, mm.
    pub to: Point3<f64>,
    /// Filament fed, mm; negative when drawn back.
    pub filament: f64,
    /// The speed that is wanted, mm/s: of the nozzle, or of the filament where it stands still.
    pub speed: f64,
    /// Whether it goes on with the line of the stroke before, in the same bead: the two may become
    /// one move.
    pub continues: bool,
}

/// A stroke, or a step that goes to the program as it is.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// A piece of the nozzle's way.
    Stroke(Stroke),
    /// Whether what is laid from here on hangs in the air.
    Hangs(bool),
    /// Anything else.
    Step(Step),
}

/// Puts strokes together; remembers where the nozzle is and whether the filament is drawn back.
#[derive(Debug, Clone)]
pub struct Router {
    at: Point3<f64>,
    retracted: bool,
    /// The line just laid, for wiping.
    last_line: Vec<Point3<f64>>,
    top: f64,
    /// Speed of the lift, mm/s.
    lift_speed: f64,
    /// What stands on the bed, where layers are curved.
    printed: Option<Printed>,
    /// The surface that is being laid: its family and level.
    surface: (Form, f64),
    /// The object of each island, where there are several.
    objects: Vec<usize>,
    items: Vec<Item>,
}

/// Travel may graze what is printed by this much, mm: what neighbouring beads of a slope stand above
/// each other in the same cell of [`Printed`].
const CLEAR_MM: f64 = 0.1;

/// How closely a way is compared with the surface that is being laid, mm: on the way a layer rises by a
/// few times [`CLEAR_MM`] in this at most.
const DIP_STEP_MM: f64 = 0.5;

/// How a program says that a wall begins and ends in a slope, and that it is done.
const SLOPES: &str = "scarf seam";

const SLOPES_END: &str = "scarf seam done";

/// A line's cross-section may drift by this share before viewers are told its width.
const AREA_DRIFT: f64 = 0.02;

/// Beads thicker than their layer by more than this share say so: what a layer's own name covers.
const THICKER: f64 = 0.15;

/// Their thickness may drift by this share before it is told again.
const HEIGHT_DRIFT: f64 = 0.05;

impl Router {
    /// Returns a router whose nozzle stands at `at`, filament ready. `printed` is the empty bed where
    /// layers are curved; on flat ones nothing ever stands above the nozzle.
    #[must_use]
    pub fn new(at: Point3<f64>, lift_speed: f64, printed: Option<Printed>) -> Self {
        Self {
            at,
            retracted: false,
            last_line: Vec::new(),
            top: 0.0,
            lift_speed,
            printed,
            surface: (Plane.form(), 0.0),
            objects: Vec::new(),
            items: Vec::new(),
        }
    }

    /// Where the nozzle stands.
    #[must_use]
    pub fn at(&self) -> Point3<f64> {
        self.at
    }

    /// Highest nozzle position of any line so far, mm.
    #[must_use]
    pub fn top(&self) -> f64 {
        self.top
    }

    /// The following layers have this form.
    pub(crate) fn follow(&mut self, form: Form) {
        self.surface.0 = form;
    }

    /// Says to which of several objects the islands of the next layer belong.
    pub(crate) fn belong_to(&mut self, objects: Vec<usize>) {
        self.objects = objects;
    }

    /// Returns the strokes of a layer whose lines are in order.
    #[must_use]
    pub fn layer(
        &mut self,
        layer: &LayerPaths,
        lines: &[OrderedLine],
        speeds: &Speeds,
        filament: &FilamentParams,
    ) -> Vec<Item> {
        self.surface.1 = layer.upper;
        let highest = lines.iter().flat_map(|line| &line.stations).map(|station| station.at.z);
        self.top = highest.fold(self.top, f64::max);
        self.items.push(Item::Step(Step::Layer(Layer {
            index: layer.index,
            top: self.top,
            height: layer.thickness,
        })));
        if filament.retract_between_layers && layer.index > 0 {
            self.retract(filament);
        }
        let mut last_island = None;
        // Combs of islands, made when they are wanted.
        let mut combs: Vec<Option<Comb>> = vec![None; layer.islands.len()];
        for line in lines {
            self.turn_to(line.island);
            let same_island = line.island.is_some() && line.island == last_island;
            let inside = line.island.filter(|_| same_island).map(|i| &layer.islands[i].outline);
            let to = line.stations[0].at;
            let comb = line.island.filter(|_| same_island).and_then(|i| combs.get_mut(i));
            if !self.combed(&to, inside.zip(comb), speeds.travel, filament) {
                self.travel(to, inside, speeds.travel, filament);
            }
            let said = |what: &str| Item::Step(Step::Remark(what.into()));
            if line.slopes {
                self.items.push(said(SLOPES));
            }
            self.line(line, (layer.index == 0, layer.thickness), speeds, filament);
            if line.slopes {
                self.items.push(said(SLOPES_END));
            }
            last_island = line.island;
        }
        self.turn_to(None);
        std::mem::take(&mut self.items)
    }

    /// Says which object the following strokes belong to, the way to them included.
    fn turn_to(&mut self, island: Option<usize>) {
        if !self.objects.is_empty() {
            let object = island.and_then(|island| self.objects.get(island)).copied();
            self.items.push(Item::Step(Step::Object(object)));
        }
    }

    /// Returns the strokes that draw the filament back.
    #[must_use]
    pub fn draw_back(&mut self, filament: &FilamentParams) -> Vec<Item> {
        self.retract(filament);
        std::mem::take(&mut self.items)
    }

    /// Returns the stroke that lifts the nozzle by `lift` mm above where it is and above all that stands on
    /// or beside the straight way to `out`, but to no more than `most`.
    #[must_use]
    pub fn leave(&mut self, out: &Point2<f64>, lift: f64, most: f64) -> Vec<Item> {
        let at = self.at;
        let highest = self.printed.as_ref().map_or(at.z, |printed| {
            let (_, on_it) = printed.over(&at, &Point3::new(out.x, out.y, at.z));
            printed.beside(&at.xy(), out, on_it.max(at.z))
        });
        let height = (highest + lift).min(most).max(at.z);
        self.stroke(Kind::Travel, Point3::new(at.x, at.y, height), 0.0, self.lift_speed);
        std::mem::take(&mut self.items)
    }

    fn stroke(&mut self, kind: Kind, to: Point3<f64>, filament: f64, speed: f64) {
        let continues = false;
        self.items.push(Item::Stroke(Stroke { kind, to, filament, speed, continues }));
        self.at = to;
    }

    /// Lays a piece of a line; it continues one that was laid just before.
    fn lay(&mut self, to: Point3<f64>, filament: f64, speed: f64) {
        let continues = matches!(
            self.items.last(),
            Some(Item::Stroke(Stroke { kind: Kind::Print, speed: before, .. })) if *before == speed
        );
        self.items.push(Item::Stroke(Stroke { kind: Kind::Print, to, filament, speed, continues }));
        self.at = to;
    }

    /// Goes to the begin of a line; `inside` is an outline that need not be crossed.
    fn travel(
        &mut self,
        to: Point3<f64>,
        inside: Option<&Region>,
        speed: f64,
        filament: &FilamentParams,
    ) {
        let (from_plane, to_plane) = (self.at.xy(), to.xy());
        let length = distance(&from_plane, &to_plane);
        let stays_inside =
            || inside.is_some_and(|outline| outline.contains_segment(&from_plane, &to_plane));
        if length >= filament.retract_before_travel && !stays_inside() {
            self.retract(filament);
        }
        let lift = if self.retracted { filament.retract_lift } else { 0.0 };
        let (above, highest) = match &self.printed {
            Some(printed) => printed.over(&self.at, &to),
            None => (f64::INFINITY, 0.0),
        };
        let beside = self.beside(&to);
        if lift == 0.0 && above <= CLEAR_MM && beside.is_none() {
            if self.at != to {
                self.stroke(Kind::Travel, to, 0.0, speed);
            }
        } else {
            let highest = highest.max(beside.unwrap_or(0.0));
            self.go_over(to, self.at.z.max(to.z).max(highest) + lift, speed);
        }
        if self.retracted {
            let fed = (filament.retract_length + filament.restart_extra).max(0.0);
            self.stroke(Kind::Filament, to, fed, filament.feed_speed);
            self.retracted = false;
        }
    }

    /// How high the nozzle must be on its way to `to` for what stands beside that, mm; `None` where the
    /// straight way clears it.
    fn beside(&self, to: &Point3<f64>) -> Option<f64> {
        let printed = self.printed.as_ref()?;
        let (form, level) = self.surface;
        let height = |p: &Point3<f64>| form.height(level, p.x.hypot(p.y));
        let (from, way) = (self.at, to - self.at);
        let samples = (way.xy().norm() / DIP_STEP_MM).ceil().max(1.0);
        let places = (0..=samples as u32).map(|k| from + way * (f64::from(k) / samples));
        let (dip, highest) = places.fold((0.0_f64, 0.0_f64), |(dip, highest), p| {
            let height = height(&p);
            (dip.max(height - p.z), highest.max(height))
        });
        let lowest = from.z.min(to.z);
        if dip <= CLEAR_MM {
            return None;
        }
        // On the surface itself the nozzle clears everything.
        let needed = printed.beside(&from.xy(), &to.xy(), lowest).min(highest);
        (needed > lowest).then_some(needed)
    }

    /// Goes to the begin of a line inside the island of the last one, though the straight way leaves it;
    /// returns whether there is such a way.
    fn combed(
        &mut self,
        to: &Point3<f64>,
        island: Option<(&Region, &mut Option<Comb>)>,
        speed: f64,
        filament: &FilamentParams,
    ) -> bool {
        let (Some(keep), Some((outline, comb))) = (filament.comb, island) else { return false };
        let is_flat = self.printed.is_none() && self.at.z == to.z && !self.retracted;
        let from = self.at.xy();
        if !is_flat || outline.contains_segment(&from, &to.xy()) {
            return false;
        }
        let comb = comb.get_or_insert_with(|| Comb::new(outline, keep));
        let Some(way) = comb.way(&from, &to.xy()) else { return false };
        for p in way {
            self.stroke(Kind::Travel, Point3::new(p.x, p.y, to.z), 0.0, speed);
        }
        true
    }

    /// Rises to `height`, crosses, and comes down.
    fn go_over(&mut self, to: Point3<f64>, height: f64, speed: f64) {
        if self.at.xy() == to.xy() && self.at.z == to.z {
            return;
        }
        if height > self.at.z {
            self.stroke(
                Kind::Travel,
                Point3::new(self.at.x, self.at.y, height),
                0.0,
                self.lift_speed,
            );
        }
        if self.at.xy() != to.xy() {
            self.stroke(Kind::Travel, Point3::new(to.x, to.y, self.at.z), 0.0, speed);
        }
        if self.at.z != to.z {
            self.stroke(Kind::Travel, to, 0.0, self.lift_speed);
        }
    }

    fn retract(&mut self, filament: &FilamentParams) {
        if self.retracted || filament.retract_length == 0.0 {
            return;
        }
        let wiped = self.wipe(filament);
        let rest = filament.retract_length - wiped;
        self.stroke(Kind::Filament, self.at, -rest, filament.retract_speed);
        self.retracted = true;
    }

    /// Runs back along the last line while drawing filament back; returns how much.
    fn wipe(&mut self, filament: &FilamentParams) -> f64 {
        let line = std::mem::take(&mut self.last_line);
        if filament.wipe <= 0.0 || line.last() != Some(&self.at) {
            return 0.0;
        }
        // As fast as the retraction lasts, and a tenth of it left for the standstill.
        let per_mm = 0.9 * filament.retract_length / filament.wipe;
        let speed = filament.retract_speed / per_mm;
        let (mut left, mut drawn) = (filament.wipe, 0.0);
        for back in line.iter().rev().skip(1) {
            let step = back - self.at;
            let length = step.norm().min(left);
            if length <= 0.0 {
                continue;
            }
            let to = self.at + step.normalize() * length;
            self.stroke(Kind::Travel, to, -per_mm * length, speed);
            drawn += per_mm * length;
            left -= length;
            if left <= 0.0 {
                break;
            }
        }
        drawn
    }

    /// Says how thick a bead is where that is much more than its layer: in a wedge, or over one that no
    /// bead fits in.
    fn tell_height(&mut self, thickness: f64, of_layer: f64, told: &mut Option<f64>) {
        let wanted = (thickness > (1.0 + THICKER) * of_layer).then_some(thickness);
        let is_told = match (wanted, &told) {
            (Some(wanted), Some(told)) => (wanted - *told).abs() <= HEIGHT_DRIFT * *told,
            (None, None) => true,
            _ => false,
        };
        if !is_told {
            self.items.push(Item::Step(Step::Height(wanted)));
            *told = wanted;
        }
    }

    fn line(
        &mut self,
        line: &OrderedLine,
        (is_first_layer, layer_thickness): (bool, f64),
        speeds: &Speeds,
        filament: &FilamentParams,
    ) {
        let mut wanted = speeds.of(line.role, is_first_layer);
        if speeds.small_perimeter > 0.0 && is_small_wall(line) {
            wanted = wanted.min(speeds.small_perimeter);
        }
        let (mut told, mut told_hangs) = ((f64::NAN, None), false);
        let mut told_height: Option<f64> = None;
        let is_combined = line.role == Role::CombinedInfill;
        if let Some(first) = line.stations.first().filter(|_| is_combined) {
            self.items.push(Item::Step(Step::Height(Some(first.bead.thickness))));
        }
        for pair in line.stations.windows(2).flat_map(|pair| in_even_pieces(&pair[0], &pair[1])) {
            let (width, area) = if line.role == Role::ExternalPerimeter {
                within(&pair[0], &pair[1])
            } else {
                mean(&pair[0], &pair[1])
            };
            let overhang = if line.role.is_wall() { pair[0].overhang } else { Overhang::None };
            let hangs = line.role == Role::BridgeInfill || overhang >= Overhang::Half;
            if hangs != told_hangs {
                self.items.push(Item::Hangs(hangs));
                told_hangs = hangs;
            }
            let role = program_role(line.role, overhang);
            if !is_combined {
                let thickness = f64::midpoint(pair[0].bead.thickness, pair[1].bead.thickness);
                self.tell_height(thickness, layer_thickness, &mut told_height);
            }
            let drift = (area - told.0).abs();
            if drift.is_nan() || drift > AREA_DRIFT * told.0 || Some(role) != told.1 {
                self.items.push(Item::Step(Step::Bead(role, width)));
                told = (area, Some(role));
            }
            let wanted = speeds.hanging(wanted, overhang);
            let length = (pair[1].at - pair[0].at).norm();
            let fed = area * length / filament.area * filament.multiplier;
            let melts = filament.volume_per_second / (area * filament.multiplier);
            self.lay(pair[1].at, fed, wanted.min(melts));
            if let Some(printed) = &mut self.printed {
                printed.add(&pair[0].at, &pair[1].at);
            }
        }
        if is_combined || told_height.is_some() {
            self.items.push(Item::Step(Step::Height(None)));
        }
        if told_hangs {
            self.items.push(Item::Hangs(false));
        }
        self.last_line = line.stations.iter().map(|station| station.at).collect();
    }
}

/// Longer walls are none around little, mm: a circle of 6.5 mm radius.
const SMALL_WALL_MM: f64 = 6.5 * std::f64::consts::TAU;

/// Whether a line is a wall around little.
fn is_small_wall(line: &OrderedLine) -> bool {
    let is_closed = line.stations.first().map(|s| s.at) == line.stations.last().map(|s| s.at);
    if !line.role.is_wall() || !(is_closed || line.slopes) {
        return false;
    }
    let mut length = 0.0;
    line.stations.windows(2).all(|pair| {
        length += distance(&pair[0].at, &pair[1].at);
        length <= SMALL_WALL_MM
    })
}

/// Cuts a piece along which the bead changes so that each part can be laid with one width.
fn in_even_pieces(a: &Station, b: &Station) -> Vec<[Station; 2]> {
    if a.at == b.at {
        return Vec::new();
    }
    let steps = ((b.bead.width - a.bead.width).abs() / LARGEST_WIDTH_STEP_MM).ceil();
    let steps = steps.min(((b.at - a.at).norm() / LEAST_PIECE_MM).floor()).max(1.0);
    let between = |k: f64| {
        let share = k / steps;
        let blend = |from: f64, to: f64| from + (to - from) * share;
        Station {
            at: Point3::from(a.at.coords.lerp(&b.at.coords, share)),
            bead: Bead {
                width: blend(a.bead.width, b.bead.width),
                thickness: blend(a.bead.thickness, b.bead.thickness),
            },
            overhang: a.overhang,
        }
    };
    (0..steps as u32)
        .map(|k| {
            let last = f64::from(k + 1) == steps;
            [between(f64::from(k)), if last { *b } else { between(f64::from(k + 1)) }]
        })
        .collect()
}

/// The most that the width of a bead changes within a move, mm: half of that is how far a bead of
/// the mean width may stick out of a place that tapers.
const LARGEST_WIDTH_STEP_MM: f64 = 0.03;

/// Pieces of a tapering line are not cut shorter than this, mm: no firmware likes shorter ones.
const LEAST_PIECE_MM: f64 = 0.05;

/// Mean width and cross-section between two stations.
fn mean(a: &Station, b: &Station) -> (f64, f64) {
    (f64::midpoint(a.bead.width, b.bead.width), f64::midpoint(a.bead.area(), b.bead.area()))
}

/// Width and cross-section of an outer bead between two stations: the mean, or, on a piece too short
/// to be cut, little more than the lesser, so that it stays within a place that tapers.
fn within(a: &Station, b: &Station) -> (f64, f64) {
    let (width, area) = mean(a, b);
    let most = a.bead.width.min(b.bead.width) + LARGEST_WIDTH_STEP_MM / 2.0;
    if width <= most {
        return (width, area);
    }
    let thickness = f64::midpoint(a.bead.thickness, b.bead.thickness);
    (most, area - thickness * (width - most))
}

fn program_role(role: Role, overhang: Overhang) -> program::Role {
    match role {
        // The wall that is seen keeps its name all the way round: readers join it into loops.
        Role::Perimeter if overhang >= Overhang::Half => program::Role::OverhangPerimeter,
        Role::ExternalPerimeter => program::Role::ExternalPerimeter,
        Role::Perimeter => program::Role::Perimeter,
        Role::InternalInfill | Role::CombinedInfill => program::Role::InternalInfill,
        Role::SolidInfill => program::Role::SolidInfill,
        Role::TopSolidInfill => program::Role::TopSolidInfill,
        Role::BridgeInfill => program::Role::BridgeInfill,
        Role::Ironing => program::Role::Ironing,
        Role::SupportMaterial => program::Role::SupportMaterial,
        Role::SupportInterface => program::Role::SupportInterface,
        Role::GapFill => program::Role::GapFill,
        Role::SkirtBrim => program::Role::SkirtBrim,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;
    use slicer::toolpath::IslandPaths;

    const BEAD: Bead = Bead { width: 0.45, thickness: 0.2 };

    const SPEEDS: Speeds = Speeds {
        external_perimeter: 30.0,
        perimeter: 45.0,
        small_perimeter: 0.0,
        infill: 60.0,
        solid_infill: 50.0,
        top_solid_infill: 30.0,
        gap_fill: 20.0,
        bridge: 25.0,
        overhang: [0.0, 25.0, 15.0, 10.0],
        ironing: 15.0,
        support: [50.0, 40.0],
        first_layer: 20.0,
        travel: 120.0,
    };

    const FILAMENT: FilamentParams = FilamentParams {
        area: 2.405_281_875,
        multiplier: 1.0,
        volume_per_second: 11.0,
        least_flow: 0.1,
        retract_length: 0.8,
        restart_extra: 0.0,
        retract_speed: 35.0,
        feed_speed: 20.0,
        retract_between_layers: false,
        retract_before_travel: 2.0,
        retract_lift: 0.2,
        wipe: 0.0,
        comb: None,
    };

    fn line(points: &[[f64; 2]], z: f64) -> OrderedLine {
        OrderedLine {
            role: Role::Perimeter,
            stations: points
                .iter()
                .map(|p| Station {
                    at: Point3::new(p[0], p[1], z),
                    bead: BEAD,
                    overhang: Overhang::None,
                })
                .collect(),
            island: Some(0),
            slopes: false,
        }
    }

    fn layer() -> LayerPaths {
        let ring = [[-10.0, -10.0], [10.0, -10.0], [10.0, 10.0], [-10.0, 10.0]].map(Point2::from);
        let outline = Region::from_rings([ring.as_slice()], Fill::NonZero);
        let island = IslandPaths { outline, ..IslandPaths::default() };
        LayerPaths { index: 3, islands: vec![island], thickness: 0.2, ..LayerPaths::default() }
    }

    fn strokes(items: &[Item]) -> Vec<Stroke> {
        items
            .iter()
            .filter_map(|item| match item {
                Item::Stroke(stroke) => Some(*stroke),
                Item::Hangs(_) | Item::Step(_) => None,
            })
            .collect()
    }

    #[test]
    fn filament_is_the_volume_of_the_bead() {
        let mut router = Router::new(Point3::new(0.0, 0.0, 0.8), 10.0, None);
        let items =
            router.layer(&layer(), &[line(&[[0.0, 0.0], [7.0, 0.0]], 0.8)], &SPEEDS, &FILAMENT);
        let printed = strokes(&items);
        assert_eq!(printed.len(), 1);
        assert!((printed[0].filament * FILAMENT.area - 7.0 * BEAD.area()).abs() < 1e-12);
        assert_eq!(printed[0].speed, 45.0);
    }

    #[test]
    fn filament_is_drawn_back_only_across_outlines_and_always_fed_again() {
        let mut router = Router::new(Point3::new(-9.0, 0.0, 0.8), 10.0, None);
        let lines = [
            line(&[[-9.0, 0.0], [-5.0, 0.0]], 0.8),
            line(&[[5.0, 0.0], [9.0, 0.0]], 0.8),
            line(&[[5.0, 30.0], [9.0, 30.0]], 0.8),
        ];
        let strokes = strokes(&router.layer(&layer(), &lines, &SPEEDS, &FILAMENT));
        let drawn: Vec<f64> = strokes
            .iter()
            .filter(|stroke| stroke.kind == Kind::Filament)
            .map(|stroke| stroke.filament)
            .collect();
        assert_eq!(drawn, [-0.8, 0.8]);
        let lifted = strokes.iter().map(|stroke| stroke.to.z).fold(0.0, f64::max);
        assert!((lifted - 1.0).abs() < 1e-12);
    }

    #[test]
    fn travel_over_a_dome_rises_above_it_and_no_higher() {
        let filament = FilamentParams { retract_length: 0.0, ..FILAMENT };
        let printed = Some(Printed::nothing(50.0, machine::profile::NozzleShape::COMMON));
        let mut router = Router::new(Point3::new(0.0, -9.0, 5.0), 10.0, printed);
        let lines = [line(&[[0.0, -9.0], [0.0, 9.0]], 5.0), line(&[[-9.0, 0.0], [-8.0, 0.0]], 1.0)];
        let to_the_foot = strokes(&router.layer(&layer(), &lines, &SPEEDS, &filament));
        let heights = |strokes: &[Stroke]| -> Vec<f64> {
            let travels = strokes.iter().filter(|s| s.kind == Kind::Travel);
            travels.map(|s| (s.to.z * 100.0).round() / 100.0).collect()
        };
        assert_eq!(heights(&to_the_foot), [5.0, 1.0], "down only where the dome has ended");
        let beyond = [line(&[[8.0, 0.0], [9.0, 0.0]], 1.0)];
        let across = strokes(&router.layer(&layer(), &beyond, &SPEEDS, &filament));
        assert_eq!(heights(&across), [5.0, 5.0, 1.0]);
    }

    #[test]
    fn a_wipe_draws_back_the_same_amount() {
        let filament = FilamentParams { wipe: 3.0, ..FILAMENT };
        let mut router = Router::new(Point3::new(0.0, 0.0, 0.8), 10.0, None);
        let lines = [
            line(&[[0.0, 0.0], [1.0, 0.0], [1.0, 5.0]], 0.8),
            line(&[[50.0, 0.0], [51.0, 0.0]], 0.8),
        ];
        let strokes = strokes(&router.layer(&layer(), &lines, &SPEEDS, &filament));
        let back: f64 = strokes.iter().filter(|s| s.filament < 0.0).map(|s| s.filament).sum();
        assert!((back + 0.8).abs() < 1e-12, "{back}");
        let wiped = strokes.iter().find(|s| s.kind == Kind::Travel && s.filament < 0.0).unwrap();
        assert_eq!(wiped.to, Point3::new(1.0, 2.0, 0.8));
    }

    #[test]
    fn wide_beads_are_slowed_to_what_melts() {
        let wide = Bead { width: 2.0, thickness: 0.3 };
        let mut fat = line(&[[0.0, 0.0], [7.0, 0.0]], 0.8);
        for station in &mut fat.stations {
            station.bead = wide;
        }
        let mut router = Router::new(Point3::new(0.0, 0.0, 0.8), 10.0, None);
        let strokes = strokes(&router.layer(&layer(), &[fat], &SPEEDS, &FILAMENT));
        assert!((strokes[0].speed * wide.area() - 11.0).abs() < 1e-9);
    }

    #[test]
    fn the_nozzle_leaves_a_bowl_above_its_rim() {
        let wall = |x: f64| [Point3::new(x, -20.0, 12.0), Point3::new(x, 20.0, 12.0)];
        let inside = Point3::new(1.0, 0.0, 4.0);
        let height = |walls: &[[Point3<f64>; 2]]| {
            let mut printed = Printed::nothing(50.0, machine::profile::NozzleShape::COMMON);
            walls.iter().for_each(|[a, b]| printed.add(a, b));
            let mut router = Router::new(inside, 15.0, Some(printed));
            let _ = router.leave(&Point2::new(50.0, 0.0), 5.0, 30.0);
            router.at().z
        };
        assert_eq!(height(&[]), 9.0);
        // What stands behind the nozzle is not on its way.
        assert_eq!(height(&[wall(-45.0)]), 9.0);
        assert!((height(&[wall(20.0)]) - 17.0).abs() < 1e-3);
    }
}
