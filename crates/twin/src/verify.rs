//! Runs all checks over a program, line by line.
//!
//! ```
//! use machine::gcode::dialect::POLAR;
//! use twin::verify::{Setup, Verifier};
//! # fn example(printer: &machine::profile::Printer, mesh: &mesh::mesh::Mesh, text: &str) {
//! let filament_area = 2.405;
//! let setup = Setup { printer, dialect: POLAR, filament_area, multiplier: 1.0, restart_extra: 0.0,
//!                     volume_per_second: 11.0, coarse: 0.0, mesh: Some(mesh), moved: 0.0,
//!                     solid: false, thorough: false };
//! let mut verifier = Verifier::new(setup);
//! for line in text.lines() {
//!     verifier.line(line);
//! }
//! let verdict = verifier.finish();
//! assert!(verdict.worst().is_none(), "{:?}", verdict.findings);
//! # }
//! ```
//!
//! Nothing is allocated for a line without a finding, outside the begin of a layer; memory is the
//! sums of the layers, the findings kept, and an index of the mesh by height; a thorough proof also
//! keeps the heights of what was laid.

use machine::gcode::dialect::{Dialect, Space};
use machine::gcode::{Command, MOST_COLUMNS};
use machine::head::Head;
use machine::profile::Printer;
use mesh::mesh::Mesh;
use nalgebra::{Point2, Vector3};

use crate::arc::{Chords, ROUND, chords};
use crate::check::acceleration::Acceleration;
use crate::check::axis::Clearance;
use crate::check::continuity::Continuity;
use crate::check::declared::Declared;
use crate::check::deposit::{Deposit, Solid};
use crate::check::flow::Flow;
use crate::check::head::HeadCheck;
use crate::check::heat::Heat;
use crate::check::height;
use crate::check::modes::Modes;
use crate::check::reach::Reach;
use crate::check::speed::Speed;
use crate::check::surface::{ROUND_AXIS, Surface};
use crate::check::text::{self, Text, is_arc};
use crate::check::volume::{Enclosed, Volume};
use crate::family::Family;
use crate::finding::{Finding, Findings, Omitted, Place, Severity, exceeds};
use crate::ramps::Ramps;
use crate::replay::{Event, Heating, LayerMark, Replay, read};
use crate::rounding::Doubt;
use crate::section::{Section, Sweep, convex_edges, surface, volume};
use crate::segment::Segment;
use crate::thorough::Watch;
use crate::totals::{Tally, Totals};

/// What a program is judged by.
#[derive(Debug, Clone, Copy)]
pub struct Setup<'a> {
    /// The machine.
    pub printer: &'a Printer,
    /// The words of the program.
    pub dialect: Dialect,
    /// The cross-section of the filament, mm².
    pub filament_area: f64,
    /// Filament fed for each that the volume asks for (`extrusion_multiplier`).
    pub multiplier: f64,
    /// Filament that is fed after a travel beyond what was drawn back before it, mm; less than zero
    /// where some is left out.
    pub restart_extra: f64,
    /// How much farther than is usual (0.007 mm) moves may lie from the outlines that they stand
    /// for, mm.
    pub coarse: f64,
    /// The most filament that melts, mm³/s; infinite when that is not known.
    pub volume_per_second: f64,
    /// The part as it was placed, in the frame of the part.
    pub mesh: Option<&'a Mesh>,
    /// How far outlines lie from those of the mesh on purpose, mm: more than zero when any lies
    /// outside, less when all lie inside.
    pub moved: f64,
    /// Whether the print is meant to be solid.
    pub solid: bool,
    /// Whether to remember all that was laid, and to judge what lies below and around.
    pub thorough: bool,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// What was found, by line; at most [`crate::finding::MOST_KEPT`] of each check and severity.
    pub findings: Vec<Finding>,
    /// How many more there are.
    pub omitted: Vec<Omitted>,
    /// What could not be judged, and why.
    pub notes: Vec<&'static str>,
    /// The sums of the program.
    pub totals: Totals,
}

impl Verdict {
    /// Returns how bad the worst finding is; `None` when there is none.
    #[must_use]
    pub fn worst(&self) -> Option<Severity> {
        self.findings.iter().map(|finding| finding.severity).max()
    }
}

/// A comment that begins so names the program of which this one was made: its commands other than
/// motion are kept as they were, and are not judged.
pub const CONVERTED_FROM: &str = "converted from ";

/// Judges a program while it is read.
#[derive(Debug)]
pub struct Verifier<'a> {
    replay: Replay,
    /// The motions of the last line but its last.
    pieces: Vec<Segment>,
    findings: Findings,
    tally: Tally,
    ramps: Ramps,
    text: Text,
    declared: Declared,
    modes: Modes,
    reach: Reach,
    clearance: Clearance,
    speed: Speed,
    acceleration: Acceleration,
    head: Option<HeadCheck>,
    continuity: Continuity,
    heat: Heat,
    surface: Surface,
    flow: Flow,
    volume: Volume,
    deposit: Deposit,
    watch: Option<Watch<'a>>,
    part: Option<Part<'a>>,
    setup: Setup<'a>,
}

/// The mesh and what is cut from it at the present layer.
#[derive(Debug)]
struct Part<'a> {
    mesh: &'a Mesh,
    sweep: Sweep<'a>,
    section: Section,
    /// Made for the first curved layer.
    solid: Option<Solid<'a>>,
}

impl<'a> Part<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        Self { mesh, sweep: Sweep::new(mesh), section: Section::default(), solid: None }
    }
}

impl<'a> Verifier<'a> {
    /// Returns a verifier before the first line.
    #[must_use]
    pub fn new(setup: Setup<'a>) -> Self {
        let Setup { printer, dialect, filament_area, mesh, .. } = setup;
        // The volume that the filament stands for.
        let meant = filament_area / setup.multiplier;
        Self {
            replay: Replay::new(printer, dialect),
            pieces: Vec::new(),
            findings: Findings::default(),
            tally: Tally::default(),
            ramps: Ramps::new(printer),
            text: Text::new(dialect).with_head(printer.head.as_ref()),
            declared: Declared::default(),
            modes: Modes::default(),
            reach: Reach::new(printer),
            clearance: Clearance::new(printer),
            speed: Speed::new(printer),
            acceleration: Acceleration::new(printer),
            head: HeadCheck::new(printer).filter(|_| dialect.speaks_of_heads()),
            continuity: Continuity::with_extra(setup.restart_extra),
            heat: Heat::new(printer),
            surface: Surface::new(printer),
            flow: Flow::new(printer, meant, setup.volume_per_second / setup.multiplier),
            volume: Volume::new(meant, printer.nozzle_diameter).moved(setup.moved.abs()),
            deposit: Deposit::new(printer, meant, setup.coarse).moved(setup.moved),
            watch: setup.thorough.then(|| Watch::new(&setup)),
            part: mesh.map(Part::new),
            setup,
        }
    }

    /// Judges the next line, and returns its motion for whoever draws it.
    pub fn line(&mut self, text: &str) -> Option<Segment> {
        self.line_bytes(text.as_bytes())
    }

    /// Judges the next line, whatever bytes it is made of; `each` sees its motions, of which an arc has
    /// many.
    pub fn each_of_line(&mut self, text: &[u8], mut each: impl FnMut(&Segment)) {
        let last = self.line_bytes(text);
        for piece in std::mem::take(&mut self.pieces) {
            each(&piece);
        }
        if let Some(segment) = last {
            each(&segment);
        }
    }

    /// Judges the next line, whatever bytes it is made of, and returns its last motion.
    pub fn line_bytes(&mut self, text: &[u8]) -> Option<Segment> {
        self.pieces.clear();
        let place = self.next_place();
        let mut command = Command::BLANK;
        // There is nothing to say of the characters of a plain line.
        if text.len() <= MOST_COLUMNS && command.read_plain(text) {
            return self.command(&command, place);
        }
        self.text.characters(text, place, &mut self.findings);
        match std::str::from_utf8(text) {
            Ok(text) => self.readable(text, place),
            // That these are no printable characters has been said already.
            Err(_) => {
                self.replay.skip();
                None
            }
        }
    }

    /// Ends the program.
    #[must_use]
    pub fn finish(mut self) -> Verdict {
        let place = Place::line(self.replay.lines(), self.replay.layer());
        self.end_layer();
        self.rest();
        self.continuity.end(place, &mut self.findings);
        self.heat.end(place, &mut self.findings);
        self.declared.end(&mut self.findings);
        self.flow.end(place, &mut self.findings);
        let Setup { mesh, moved, .. } = self.setup;
        let enclosed = mesh.map(|mesh| {
            move |families: &[Family], thickness: f64| Enclosed {
                edges: if moved == 0.0 { 0.0 } else { convex_edges(mesh) },
                ..enclosed(mesh, families, thickness)
            }
        });
        let is_open = || mesh.is_some_and(has_holes);
        let unjudged = self.volume.end(enclosed, is_open, self.setup.solid, &mut self.findings);
        let mut notes: Vec<&'static str> = unjudged.into_iter().collect();
        if let Some(mesh) = mesh {
            let laid = (self.volume.layers(), self.volume.has_laid());
            height::check(
                mesh,
                laid,
                self.setup.printer.nozzle_diameter,
                place,
                &mut self.findings,
            );
        }
        if self.setup.dialect.space == Space::Part {
            notes.push(
                "speed, acceleration: the firmware turns these words into joints itself, so \
                 bed and carriage are not judged",
            );
        }
        if self.text.has_kept() {
            notes.push(
                "commands: the program was converted; commands of the source that rhumb does not \
                 know are kept as they are and were not judged",
            );
        }
        let thorough = self.watch.as_mut().map(|watch| watch.finish(&mut self.findings));
        let totals = Totals { thorough, ..self.totals() };
        let (findings, omitted) = self.findings.into_parts();
        Verdict { findings, omitted, notes, totals }
    }

    fn next_place(&self) -> Place {
        Place::line(self.replay.lines() + 1, self.replay.layer())
    }

    fn readable(&mut self, text: &str, place: Place) -> Option<Segment> {
        let line = match read(text) {
            Ok(line) => line,
            Err(error) => {
                self.text.unreadable(text, &error, place, &mut self.findings);
                self.replay.skip();
                return None;
            }
        };
        let is_mark = |comment: &str| comment.trim_start().starts_with(CONVERTED_FROM);
        if line.comment.is_some_and(is_mark) {
            self.text.is_converted();
            self.heat.is_converted();
        }
        match &line.command {
            Some(command) => self.command(command, place),
            None => {
                if let Some(comment) = line.comment {
                    self.declared.comment(comment, place);
                }
                let event = self.replay.follow(&line);
                self.event(event, place)
            }
        }
    }

    fn command(&mut self, command: &Command<'_>, place: Place) -> Option<Segment> {
        if self.text.is_macro_of_source(command) {
            self.modes.unknown();
            self.heat.unknown();
        }
        self.text.command(command, place, &mut self.findings);
        self.modes.command(command, place, &mut self.findings);
        if is_arc(command, &self.setup.dialect) {
            return self.arc(command, place);
        }
        let event = self.replay.follow_command(command);
        self.event(event, place)
    }

    /// Follows an arc line by line.
    fn arc(&mut self, command: &Command<'_>, place: Place) -> Option<Segment> {
        let ([x, y], z) = self.replay.words();
        let Some(Chords { ends, off }) = chords(command, &Point2::new(x, y)) else {
            let event = self.replay.follow_command(command);
            return self.event(event, place);
        };
        if exceeds(off, ROUND) {
            self.findings.error(text::NAME, place, (off, ROUND), || {
                format!("an arc ends {off:.4} mm off its circle, at most {ROUND} mm")
            });
        }
        self.replay.skip();
        self.replay.take_speed(command);
        let rise = command.word(b'Z').unwrap_or(z) - z;
        let share = 1.0 / ends.len() as f64;
        let filament = command.word(b'E').unwrap_or(0.0) * share;
        for (k, end) in (1..).zip(&ends) {
            let z = z + rise * share * f64::from(k);
            let segment = self.replay.piece([end.x, end.y], z, filament);
            self.segment(&segment);
            self.pieces.push(segment);
        }
        self.pieces.pop()
    }

    fn event(&mut self, event: Event, place: Place) -> Option<Segment> {
        match event {
            Event::Nothing => {}
            Event::Segment(segment) => {
                self.segment(&segment);
                return Some(segment);
            }
            Event::Layer(mark) => self.layer(mark),
            Event::Rest => self.rest(),
            Event::Nozzle(heating) => {
                self.wait(heating);
                self.heat.nozzle(heating, place, &mut self.findings);
            }
            Event::Bed(heating) => {
                self.wait(heating);
                self.heat.bed(heating, place, &mut self.findings);
            }
        }
        None
    }

    fn segment(&mut self, segment: &Segment) {
        let goes_round_axis = self.goes_round_axis(segment);
        let findings = &mut self.findings;
        let doubt = Doubt::of(segment);
        self.tally.segment(segment);
        self.ramps.segment(segment);
        self.declared.segment(segment);
        if self.setup.printer.head.as_ref().is_none_or(Head::turns_bed) {
            self.clearance.segment(segment, findings);
        }
        if let (Some(head), Some(posed)) = (&mut self.head, self.replay.posed()) {
            head.segment(segment, posed, &doubt, findings);
        } else {
            self.reach.segment(segment, findings);
            self.speed.segment(segment, &doubt, findings);
            self.acceleration.segment(segment, &doubt, findings);
        }
        self.continuity.segment(segment, findings);
        self.heat.segment(segment, findings);
        self.surface.segment(segment);
        self.flow.segment(segment, &doubt, findings);
        self.volume.segment(segment);
        if self.part.is_some() && !goes_round_axis {
            self.deposit.segment(segment);
        }
        if let Some(watch) = &mut self.watch {
            let upright = [Vector3::z_axis(); 2];
            let axes = self.replay.posed().map_or(upright, |posed| posed.poses.map(|p| p.axis));
            watch.segment(segment, &axes, findings);
        }
    }

    /// Whether a segment is so near to the axis that its line may lead round it, and not where the part
    /// is.
    fn goes_round_axis(&self, segment: &Segment) -> bool {
        let printer = self.setup.printer;
        let clear = printer.alignment.clear_radius_at(printer.axis_clearance, segment.part[1].z);
        segment.nearest < ROUND_AXIS * clear
    }

    fn wait(&mut self, heating: Heating) {
        if heating.waits {
            self.rest();
        }
    }

    fn rest(&mut self) {
        self.ramps.rest();
        self.acceleration.rest(&mut self.findings);
        let place = Place::line(self.replay.lines(), self.replay.layer());
        if let Some(head) = &mut self.head {
            head.rest(place, &mut self.findings);
        }
    }

    fn layer(&mut self, mark: LayerMark) {
        self.end_layer();
        self.continuity.layer(mark, &mut self.findings);
        self.surface.layer(mark);
        if let Some(head) = &mut self.head {
            head.layer(mark.family.unwrap_or_default());
        }
        self.declared.layer();
        self.flow.layer(mark);
        if let Some(watch) = &mut self.watch {
            watch.layer(mark, &mut self.findings);
        }
        let is_planar = mark.family.unwrap_or_default() == Family::Planar;
        let middle = mark.top.zip(mark.height).map(|(top, height)| top - height / 2.0);
        let middle = middle.filter(|_| is_planar);
        let section = match (&mut self.part, middle) {
            (Some(part), Some(middle)) => {
                part.sweep.cut(middle, &mut part.section);
                Some(&part.section)
            }
            _ => None,
        };
        self.volume.layer(mark, section);
        self.deposit.layer(&mark);
    }

    fn end_layer(&mut self) {
        self.surface.end_of_layer(&mut self.findings);
        let Some(part) = &mut self.part else { return };
        if self.deposit.is_curved() {
            let solid = part.solid.get_or_insert_with(|| Solid::new(part.mesh));
            self.deposit.end_of_curved_layer(solid, &mut self.findings);
        } else {
            self.deposit.end_of_layer(&part.section, &mut self.findings);
        }
    }

    fn totals(&self) -> Totals {
        let Tally { time, travel, moves, short_moves, bed_turn, nearest_to_axis, .. } = self.tally;
        Totals {
            lines: self.replay.lines(),
            time: self.ramps.time(),
            commanded_time: time,
            filament: self.volume.filament(),
            volume: self.volume.filament() * self.setup.filament_area,
            by_role: self.volume.by_role(),
            travel,
            moves,
            short_moves,
            retractions: self.continuity.retractions(),
            moves_per_second: self.tally.moves_per_second,
            bed_turns: bed_turn / std::f64::consts::TAU,
            layers: self.volume.layers().to_vec(),
            bed_speed: self.speed.greatest_bed(),
            rail_speed: self.speed.greatest_rail(),
            bed_acceleration: self.acceleration.greatest_bed(),
            rail_acceleration: self.acceleration.greatest_rail(),
            deviation: self.continuity.worst_deviation(),
            nearest_to_axis,
            surface_residual: self.surface.worst(),
            head: self.head.as_ref().map(HeadCheck::totals),
            thorough: None,
        }
    }
}
/// What a mesh holds, for layers of some families and this thickness, mm; without its edges.
///
/// A ball of radius R leaves the layer that touches it by one thickness t where it leans by √(2t/R);
/// what leans more is met by so many layers that their errors cancel. R is that of the ball with this
/// surface.
fn enclosed(mesh: &Mesh, families: &[Family], thickness: f64) -> Enclosed {
    let surface = surface(mesh);
    let radius = (surface / (4.0 * std::f64::consts::PI)).sqrt();
    let reach = 2.0 * thickness / radius;
    let along = mesh.triangles.iter().filter_map(|corners| {
        let [a, b, c] = corners.map(|k| mesh.vertices.get(k as usize).copied());
        let (a, b, c) = (a?, b?, c?);
        let (area, centre) = ((b - a).cross(&(c - a)) / 2.0, (a + b.coords + c.coords) / 3.0);
        let leaning = |family: &Family| family.normal(&centre).cross(&area).norm() / area.norm();
        let least = families.iter().map(leaning).fold(1.0, f64::min);
        let share = (reach / (least * least)).min(1.0);
        share.is_finite().then_some(share * area.norm())
    });
    Enclosed { volume: volume(mesh), surface, edges: 0.0, along: along.sum() }
}

/// Whether some side of a facet has no other; a mesh that is none has no sides to ask for.
fn has_holes(mesh: &Mesh) -> bool {
    mesh.check().is_ok() && mesh::topology::Solid::new(mesh.clone()).open_sides() > 0
}
