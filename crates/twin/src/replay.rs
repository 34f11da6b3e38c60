//! Lines of a program become segments.
//!
//! One line in, at most one [`Event`] out; nothing is remembered but where the machine stands and
//! what was announced, so memory does not grow with the program. Positions in joints go through
//! the printer's *forward* kinematics; its inverse is never asked.
//!
//! What `F` means is the dialect's: the speed of the nozzle over the part, so that a move takes the
//! length of its [curve](crate::curve) divided by it, the speed along the words, or inverse time;
//! where only filament moves `F` is the speed of the filament. Where the firmware turns words into
//! radius and angle itself, a line is taken as the spiral piece between its ends, from which it
//! differs by less than the chord tolerance to which such lines are cut. The bed follows its drive
//! through the play of the machine, and heights are above the bed as it was probed. `G92` sets the
//! count of the bed. `F`, the plane and `Z` hold until they are given again; `E` is relative. Words are
//! read as in absolute positions (`G90`) and relative filament (`M83`) whatever was commanded:
//! that it was commanded is for [`crate::check::modes`]. `G28` brings the machine to the
//! printer's home.

use machine::backlash::LooseBed;
use machine::gcode::dialect::{Dialect, Quantity, Space};
use machine::gcode::speed_word::{SpeedWord, Way};
use machine::gcode::{Command, Line, SyntaxError, parse_line};
use machine::height_map::HeightMap;
use machine::kinematics::{Alignment, Branch};
use machine::profile::Printer;
use machine::program::{BedTurn, Feed, Joints, Role};
use nalgebra::Point3;

use crate::curve::Curve;
use crate::family::Family;
use crate::posed::{PosedMove, PosedReplay};
use crate::segment::Segment;

/// What a line makes happen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// Nothing that a check looks at.
    Nothing,
    /// The axes or the filament move.
    Segment(Segment),
    /// A layer begins.
    Layer(LayerMark),
    /// The machine stands still until something is done: homing, a dwell, a wait for heat.
    Rest,
    /// The nozzle is to have a temperature.
    Nozzle(Heating),
    /// The bed is to have a temperature.
    Bed(Heating),
}

/// A layer as the comments announce it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerMark {
    /// The line of its number.
    pub line: usize,
    /// Its number.
    pub index: usize,
    /// The highest place of the nozzle so far, mm, when it was announced.
    pub top: Option<f64>,
    /// Its thickness, mm, when it was announced.
    pub height: Option<f64>,
    /// The surfaces that it belongs to, when they were announced; they are planar otherwise.
    pub family: Option<Family>,
    /// Whether it was announced to climb by its thickness in one turn.
    pub climbs: bool,
}

/// How a comment says that the next layer climbs.
const CLIMBS: &str = " spiral vase";

/// How a comment says that a wall begins and ends in a slope, and that it is done.
const SLOPES: &str = " scarf seam";

const SLOPES_END: &str = " scarf seam done";

/// A temperature commanded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heating {
    /// °C; 0 is off.
    pub target: f64,
    /// Whether the program waits until it is reached.
    pub waits: bool,
}

/// Where the machine stands.
#[derive(Debug, Clone, Copy)]
struct Stand {
    /// The plane's words, in their own units.
    plane: [f64; 2],
    z: f64,
    /// Where the words bring the bed's drive.
    drive: BedTurn,
    joints: Option<Joints>,
    part: Point3<f64>,
}

/// Reads a program line by line. See the [module](self).
#[derive(Debug, Clone)]
pub struct Replay {
    alignment: Alignment,
    bed_map: HeightMap,
    bed: LooseBed,
    home: Joints,
    dialect: Dialect,
    posed: Option<PosedReplay>,
    line: usize,
    stand: Stand,
    /// The number of the last `F`; 0 before the first.
    speed_word: f64,
    /// What was taken off the count of the bed, radians.
    recounted: f64,
    layer: Option<usize>,
    top: Option<f64>,
    height: Option<f64>,
    family: Option<Family>,
    climbs: bool,
    slopes: bool,
    role: Role,
    width: f64,
    /// The thickness announced since the layer began, mm.
    bead_height: Option<f64>,
    /// Whether the layer has its number: what is announced after it is said of beads.
    in_layer: bool,
}

impl Replay {
    /// Returns a replay that stands at the printer's home, before the first line.
    #[must_use]
    pub fn new(printer: &Printer, dialect: Dialect) -> Self {
        let posed = PosedReplay::new(printer, &dialect);
        let mut stand = Stand::at_home(&printer.home, &dialect, &printer.alignment);
        if posed.as_ref().is_some_and(|posed| !posed.turns_bed()) {
            stand.joints = None;
        }
        Self {
            alignment: printer.alignment,
            posed,
            bed_map: printer.bed_map.clone(),
            bed: LooseBed::new(printer.alignment.bed.backlash, printer.home.turn),
            home: printer.home,
            dialect: dialect.on(printer),
            line: 0,
            stand,
            speed_word: 0.0,
            recounted: 0.0,
            layer: None,
            top: None,
            height: None,
            family: None,
            climbs: false,
            slopes: false,
            role: Role::Custom,
            width: 0.0,
            bead_height: None,
            in_layer: false,
        }
    }

    /// Reads the next line.
    ///
    /// # Errors
    ///
    /// [`SyntaxError`] when it is not a command; the machine stays where it is.
    pub fn line(&mut self, text: &str) -> Result<Event, SyntaxError> {
        match read(text) {
            Ok(line) => Ok(self.follow(&line)),
            Err(error) => {
                self.line += 1;
                Err(error)
            }
        }
    }

    /// Follows the next line, taken apart before by [`read`].
    pub fn follow(&mut self, line: &Line<'_>) -> Event {
        match (&line.command, line.comment) {
            (Some(command), _) => self.follow_command(command),
            (None, Some(comment)) => {
                self.line += 1;
                self.comment(comment)
            }
            (None, None) => {
                self.line += 1;
                Event::Nothing
            }
        }
    }

    /// Follows the next line, which is this command.
    pub(crate) fn follow_command(&mut self, command: &Command<'_>) -> Event {
        self.line += 1;
        self.command(command)
    }

    /// Follows a line from here to a place, one of several that a command is drawn with, with its share of
    /// the filament.
    pub(crate) fn piece(&mut self, to: [f64; 2], z: f64, filament: f64) -> Segment {
        let from = self.stand;
        self.stand = self.stand_at(to, z);
        self.segment(&from, filament)
    }

    /// Takes the speed of a command.
    pub(crate) fn take_speed(&mut self, command: &Command<'_>) {
        if let Some(word) = command.word(b'F').filter(|word| *word > 0.0) {
            self.speed_word = word;
        }
    }

    /// Where the words of the plane and `Z` are.
    pub(crate) fn words(&self) -> ([f64; 2], f64) {
        (self.stand.plane, self.stand.z)
    }

    /// Counts a line that could not be read.
    pub(crate) fn skip(&mut self) {
        self.line += 1;
    }

    /// Returns the number of lines read.
    #[must_use]
    pub fn lines(&self) -> usize {
        self.line
    }

    /// Returns where the words bring the drives, the bed's before any play in it; `None` where words
    /// are part coordinates, or bring a head that turns the nozzle somewhere.
    #[must_use]
    pub fn drives(&self) -> Option<Joints> {
        if self.posed.is_some() {
            return None;
        }
        let Stand { joints, drive, z, .. } = self.stand;
        joints.map(|joints| Joints { s: joints.s, turn: drive, z })
    }

    /// Returns the layer announced last.
    #[must_use]
    pub fn layer(&self) -> Option<usize> {
        self.layer
    }

    fn command(&mut self, command: &Command<'_>) -> Event {
        use machine::gcode::Code::Numbered;
        match command.code {
            Numbered(b'G', 0..=3, 0) => self.motion(command).map_or(Event::Nothing, Event::Segment),
            Numbered(b'G', 28, 0) => {
                self.stand = Stand::at_home(&self.home, &self.dialect, &self.alignment);
                if let Some(posed) = &mut self.posed {
                    posed.homed();
                    self.stand.joints = self.stand.joints.filter(|_| posed.turns_bed());
                }
                self.recounted = 0.0;
                Event::Rest
            }
            Numbered(b'G', 92, 0) => {
                self.recount(command);
                Event::Nothing
            }
            Numbered(b'G', 4, 0) | Numbered(b'M', 400, 0) => Event::Rest,
            Numbered(b'M', 104 | 109, 0) => {
                heating(command, 109).map_or(Event::Nothing, Event::Nozzle)
            }
            Numbered(b'M', 140 | 190, 0) => {
                heating(command, 190).map_or(Event::Nothing, Event::Bed)
            }
            _ => Event::Nothing,
        }
    }

    /// Sets the count of the bed without moving it, where the bed has a word of its own.
    fn recount(&mut self, command: &Command<'_>) {
        for (k, word) in self.dialect.plane.iter().enumerate() {
            let Some(count) = command.word(word.letter) else { continue };
            if word.quantity == Quantity::Bed {
                self.recounted = self.stand.drive.radians() - count.to_radians();
                self.stand.plane[k] = count;
            }
        }
    }

    fn motion(&mut self, command: &Command<'_>) -> Option<Segment> {
        self.take_speed(command);
        if let Some(mut posed) = self.posed.take() {
            let segment = self.posed_motion(&mut posed, command);
            self.posed = Some(posed);
            return segment;
        }
        let words = self.dialect.plane.map(|word| command.word(word.letter));
        let (z, filament) = (command.word(b'Z'), command.word(b'E'));
        let from = self.stand;
        let moves = words[0].is_some() || words[1].is_some() || z.is_some();
        if moves {
            let plane = [0, 1].map(|k| words[k].unwrap_or(from.plane[k]));
            self.stand = self.stand_at(plane, z.unwrap_or(from.z));
        }
        (moves || filament.is_some()).then(|| self.segment(&from, filament.unwrap_or(0.0)))
    }

    /// A move of a head that turns the nozzle.
    fn posed_motion(&mut self, posed: &mut PosedReplay, command: &Command<'_>) -> Option<Segment> {
        let filament = command.word(b'E');
        let from = self.stand;
        let moves = posed.follow(command, self.recounted);
        if moves {
            let mut part = posed.last().poses[1].at;
            let over_bed = self.alignment.over_bed(&part.xy());
            part.z = self.bed_map.part_z(&over_bed, part.z);
            let near = from.joints.map_or(self.home.turn, |joints| joints.turn);
            let upright = self.alignment.joints_from_part(&part, Branch::Near, near).ok();
            let joints = upright.filter(|_| posed.turns_bed());
            self.stand = Stand { z: part.z, drive: posed.turn(), joints, part, ..from };
        }
        let swing = if moves { posed.swing() } else { 0.0 };
        (moves || filament.is_some())
            .then(|| self.segment_of(&from, filament.unwrap_or(0.0), swing))
    }

    /// Returns what the last move of a head that turns the nozzle did.
    #[must_use]
    pub fn posed(&self) -> Option<&PosedMove> {
        self.posed.as_ref().map(PosedReplay::last)
    }

    fn stand_at(&mut self, plane: [f64; 2], z: f64) -> Stand {
        let mut words = plane;
        for (word, value) in self.dialect.plane.iter().zip(&mut words) {
            if word.quantity == Quantity::Bed {
                *value += self.recounted.to_degrees();
            }
        }
        let Some(told) = self.dialect.joints(words, z, self.stand.drive) else {
            let over_bed = self.alignment.over_bed(&words.into());
            let part = Point3::new(words[0], words[1], self.bed_map.part_z(&over_bed, z));
            return Stand { plane, z, drive: self.stand.drive, joints: None, part };
        };
        let joints = Joints { turn: self.bed.drive(told.turn), ..told };
        let mut part = self.alignment.part_from_joints(&joints);
        if !self.bed_map.is_flat() {
            part.z = self.bed_map.part_z(&self.alignment.over_bed(&part.xy()), z);
        }
        Stand { plane, z, drive: told.turn, joints: Some(joints), part }
    }

    fn segment(&self, from: &Stand, filament: f64) -> Segment {
        self.segment_of(from, filament, 0.0)
    }

    /// A segment in which what turns the nozzle runs `swing` mm round its tip.
    fn segment_of(&self, from: &Stand, filament: f64, swing: f64) -> Segment {
        let to = &self.stand;
        let joints = from.joints.zip(to.joints).map(|(from, to)| [from, to]);
        let curve = match &joints {
            Some([from, to]) => Curve::between_joints(from, to, &self.alignment),
            None => Curve::between_points(&from.part, &to.part, &self.alignment),
        };
        let path = curve.length();
        let way = if path > 0.0 { path.max(swing) } else { 0.0 };
        let distance = if way > 0.0 { way } else { filament.abs() };
        let (duration, is_paced) = self.pace(from, way, filament);
        let speed = if duration > 0.0 { distance / duration } else { 0.0 };
        Segment {
            line: self.line,
            layer: self.layer,
            role: self.role,
            width: self.width,
            height: self.bead_height,
            joints,
            part: [from.part, to.part],
            nearest: curve.nearest_to_axis(),
            curve,
            path,
            filament,
            feed: match self.dialect.speed {
                SpeedWord::Nozzle => Feed::from_word(self.speed_word),
                _ => Feed::mm_per_s(speed),
            },
            duration,
            slopes: self.slopes,
            is_paced,
        }
    }

    /// How long a line takes, s, and whether the firmware sets the pace of it.
    fn pace(&self, from: &Stand, path: f64, filament: f64) -> (f64, bool) {
        if self.speed_word <= 0.0 {
            return (0.0, false);
        }
        let to = &self.stand;
        let rise = to.z - from.z;
        let [x, y] = [0, 1].map(|k| to.plane[k] - from.plane[k]);
        let words = match self.dialect.speed {
            SpeedWord::Nozzle | SpeedWord::InverseTime => 0.0,
            _ => x.hypot(y).hypot(rise),
        };
        let way = Way {
            path,
            words,
            filament,
            turn: to.drive.radians() - from.drive.radians(),
            ends: [from.plane, to.plane],
            rise,
        };
        let speed = &self.dialect.speed;
        (speed.duration(&way, self.speed_word), speed.sets_the_pace(&way))
    }

    fn comment(&mut self, comment: &str) -> Event {
        if let Some(label) = comment.strip_prefix("TYPE:") {
            self.role = role_of(label);
        } else if let Some(width) = comment.strip_prefix("WIDTH:") {
            self.width = number(width).unwrap_or(self.width);
        } else if comment == "LAYER_CHANGE" {
            (self.top, self.height) = (None, None);
            (self.bead_height, self.in_layer) = (None, false);
            self.slopes = false;
        } else if let Some(top) = comment.strip_prefix("Z:") {
            self.top = number(top);
        } else if let Some(height) = comment.strip_prefix("HEIGHT:") {
            let height = number(height);
            if self.in_layer {
                self.bead_height = height.filter(|_| height != self.height);
            } else {
                self.height = height;
            }
        } else if let Some(index) = comment.strip_prefix("LAYER:").and_then(|n| n.parse().ok()) {
            self.layer = Some(index);
            self.in_layer = true;
            let Self { line, top, height, family, .. } = *self;
            let climbs = std::mem::take(&mut self.climbs);
            return Event::Layer(LayerMark { line, index, top, height, family, climbs });
        } else if comment == CLIMBS {
            self.climbs = true;
        } else if comment == SLOPES || comment == SLOPES_END {
            self.slopes = comment == SLOPES;
        } else if let Some(family) = Family::from_comment(comment) {
            self.family = Some(family);
        }
        Event::Nothing
    }
}

impl Stand {
    fn at_home(home: &Joints, dialect: &Dialect, alignment: &Alignment) -> Self {
        let part = alignment.part_from_joints(home);
        let (sin, cos) = home.turn.radians().sin_cos();
        let plane = dialect.plane.map(|word| match word.quantity {
            Quantity::Rail => home.s,
            Quantity::Bed => home.turn.radians().to_degrees(),
            Quantity::PartX => part.x,
            Quantity::PartY => part.y,
            Quantity::IdealX => home.s * cos,
            Quantity::IdealY => home.s * sin,
        });
        let joints = (dialect.space != Space::Part).then_some(*home);
        Self { plane, z: home.z, drive: home.turn, joints, part }
    }
}

/// Takes a line apart. The text of a message (`M117`) is not words.
///
/// # Errors
///
/// [`SyntaxError`] with the column of the first character that does not fit.
pub fn read(text: &str) -> Result<Line<'_>, SyntaxError> {
    match text.strip_prefix("M117") {
        Some(message) if message.is_empty() || message.starts_with(' ') => parse_line("M117"),
        _ => parse_line(text),
    }
}

fn heating(command: &Command<'_>, waiting: u32) -> Option<Heating> {
    let target = command.word(b'S').or(command.word(b'R'))?;
    Some(Heating { target, waits: command.is(b'M', waiting) })
}

/// The role with this label; what the machine crate does not know is no part of the part.
fn role_of(label: &str) -> Role {
    Role::from_label(label).unwrap_or(Role::Custom)
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::printer;
    use crate::segment::Kind;
    use machine::gcode::dialect::{CARTESIAN, POLAR};

    fn segments(dialect: Dialect, text: &str) -> Vec<Segment> {
        let mut replay = Replay::new(&printer(), dialect);
        text.lines()
            .filter_map(|line| match replay.line(line).unwrap() {
                Event::Segment(segment) => Some(segment),
                _ => None,
            })
            .collect()
    }

    #[test]
    fn a_short_polar_program() {
        let read = segments(
            POLAR,
            "G28\nG90\nM83\n;LAYER_CHANGE\n;Z:0.2\n;HEIGHT:0.2\n;LAYER:0\n;TYPE:Perimeter\n\
             ;WIDTH:0.45\nG1 R20 T0 Z0.2 F6000\nG1 E0.8 F600\nG1 R20 T90 E0.5 F1200\nG1 E-0.8\n\
             G1 Z1.2\nG1 F900\nG1 R20 T90\n",
        );
        let kinds: Vec<Kind> = read.iter().map(Segment::kind).collect();
        use Kind::{Extrusion, Prime, Retraction, Still, Travel};
        assert_eq!(kinds, [Travel, Prime, Extrusion, Retraction, Travel, Still]);
        assert_eq!(read[0].line, 10);
        assert_eq!((read[2].layer, read[2].role, read[2].width), (Some(0), Role::Perimeter, 0.45));
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!((read[2].path - 20.0 * quarter).abs() < 1e-12);
        assert!((read[2].duration - quarter).abs() < 1e-12);
        assert!((read[2].part[1] - Point3::new(0.0, 20.0, 0.2)).norm() < 1e-12);
        assert!((read[3].duration - 0.8 / 20.0).abs() < 1e-12);
        assert_eq!((read[4].path, read[4].duration), (1.0, 0.05));
    }

    #[test]
    fn part_coordinates_run_straight() {
        let read = segments(CARTESIAN, "G28\nG1 X30 Y0 Z0 F600\nG1 X0 Y40 E1\n");
        assert_eq!(read[0].part[0], Point3::new(100.0, 0.0, 20.0));
        assert_eq!((read[1].path, read[1].joints), (50.0, None));
        assert_eq!(read[1].nearest, 24.0);
        assert_eq!(read[1].duration, 5.0);
    }

    #[test]
    fn events_other_than_motion() {
        let mut replay = Replay::new(&printer(), POLAR);
        let on = |target, waits| Heating { target, waits };
        assert_eq!(replay.line("M104 S210"), Ok(Event::Nozzle(on(210.0, false))));
        assert_eq!(replay.line("M190 S60"), Ok(Event::Bed(on(60.0, true))));
        assert_eq!(replay.line("M117 Layer 3: R12 T"), Ok(Event::Nothing));
        assert_eq!(replay.line("G28"), Ok(Event::Rest));
        assert_eq!(replay.line(";Z:0.4"), Ok(Event::Nothing));
        let mark = LayerMark {
            line: 6,
            index: 7,
            top: Some(0.4),
            height: None,
            family: None,
            climbs: false,
        };
        assert_eq!(replay.line(";LAYER:7"), Ok(Event::Layer(mark)));
        assert!(replay.line("G1 R").is_err());
        assert_eq!((replay.lines(), replay.layer()), (7, Some(7)));
    }

    #[test]
    fn a_misaligned_machine_is_where_its_kinematics_says() {
        let mut printer = printer();
        printer.alignment = Alignment { a: 0.2, b: 0.35, ..Alignment::default() };
        let mut replay = Replay::new(&printer, POLAR);
        let Ok(Event::Segment(segment)) = replay.line("G1 R10 T30 Z1 F600") else { panic!() };
        let joints = segment.joints.unwrap()[1];
        assert_eq!(segment.part[1], printer.alignment.part_from_joints(&joints));
        assert!((segment.curve.radius(1.0) - 10.2_f64.hypot(0.35)).abs() < 1e-12);
    }
}
