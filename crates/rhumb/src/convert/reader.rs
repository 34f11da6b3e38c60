//! Another slicer's program, line by line: where it wants the nozzle to go.
//!
//! Understood are `G0` to `G3` with modal and missing words, absolute and relative positions (`G90`,
//! `G91`) and filament (`M82`, `M83`), millimetres and inches (`G21`, `G20`), origins set by `G92`,
//! arcs and helices, line numbers with checksums, comments after `;` and in brackets. All else is
//! handed on as it is, in its place.
//!
//! `G91` makes filament relative as well, as Marlin has it; `G90` brings back what `M82` or `M83`
//! said, so that programs written for firmwares that keep the two apart come out right too.

use machine::gcode::{Code, Command, parse_line};
use nalgebra::{Point3, Vector2, Vector3};
use plan::route::{Kind, Stroke};

use super::arc::Arc;

/// What a line asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meaning<'a> {
    /// Strokes, which were appended.
    Motion,
    /// A state that the new program has in its own way: nothing to write.
    Absorbed,
    /// The machine is homed by this line.
    Home(&'a str),
    /// A line that goes over as it is.
    Other(&'a str),
}

/// Why a line cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum ReadError {
    /// It is not a command.
    #[error("{0}")]
    Syntax(#[from] machine::gcode::SyntaxError),
    /// The number after `*` is not that of the line.
    #[error("the checksum is {given}, that of the line is {found}")]
    Checksum {
        /// In the line.
        given: u32,
        /// Computed.
        found: u32,
    },
    /// An arc without a circle.
    #[error("no arc has this centre or radius")]
    NoArc,
    /// Arcs outside of the plane of the bed.
    #[error("arcs outside of the xy plane (G18, G19) are not understood")]
    OtherPlane,
    /// A curve or a meaning of `F` that no polar firmware has.
    #[error("{0} is not understood")]
    Foreign(&'static str),
    /// A motion that has no polar form.
    #[error("{0} moves the machine in a way that is not understood")]
    ForeignMotion(String),
    /// A word that moves what no Cartesian printer has, as in a program that is polar already.
    #[error("{0} is an axis beside X, Y, Z and E, and nobody knows what it moves")]
    ForeignAxis(char),
    /// A feed rate that never arrives.
    #[error("F must be above 0, not {0}")]
    Feed(f64),
    /// More filament than there is.
    #[error("{0:.3e} mm of filament in one line")]
    Filament(f64),
    /// A byte that no firmware reads.
    #[error("there is a NUL in the line")]
    Nul,
    /// A temperature beyond that of the machine.
    #[error("a {of} temperature of {told} °C; the machine's highest is {most} °C")]
    TooHot {
        /// Nozzle or bed.
        of: &'static str,
        /// °C.
        told: f64,
        /// °C.
        most: f64,
    },
}

impl ReadError {
    /// The class of failure that it is.
    pub(super) fn class(&self) -> &'static str {
        match self {
            Self::OtherPlane | Self::Foreign(_) | Self::ForeignMotion(_) | Self::ForeignAxis(_) => {
                "GcodeUnsupported"
            }
            Self::TooHot { .. } => "OutOfEnvelope",
            _ => "GcodeSyntax",
        }
    }
}

/// Reads lines; remembers the state that they build on.
#[derive(Debug, Clone)]
pub(super) struct Reader {
    /// The place in the source that becomes the axis, mm.
    origin: Vector2<f64>,
    /// Where the nozzle is, mm, as it will be printed.
    at: Point3<f64>,
    /// Where the source says that it is, less where it is, mm.
    offset: Vector3<f64>,
    /// Axes that nothing was said of since homing: the source takes them to be at its zero, wherever
    /// our machine has its home.
    is_at_home: [bool; 3],
    /// The source's filament position, mm.
    filament: f64,
    is_relative: bool,
    filament_is_relative: bool,
    /// What `M82` or `M83` said last.
    filament_mode_is_relative: bool,
    /// mm in a unit of length.
    unit: f64,
    /// mm/s.
    speed: f64,
    has_speed: bool,
    /// The motion command in force: 0 to 3.
    motion: u32,
    arc_tolerance: f64,
}

/// The speed before the first `F`, mm/s: that of Marlin and Klipper.
const FIRST_SPEED_MM_S: f64 = 25.0;

/// Filament moves alone in pieces shorter than this, mm: Klipper refuses 50.
const LONGEST_FILAMENT_MM: f64 = 49.0;

/// Words of axes that only other machines have.
const FOREIGN_AXES: &[u8] = b"ABCTUVW";

/// The same on lines, where `R` is no radius.
const FOREIGN_AXES_OF_LINES: &[u8] = b"ABCRTUVW";

/// Most filament in a line, mm: a third of a usual spool. Each piece of it is a move of its own.
const MOST_FILAMENT_MM: f64 = 1e5;

/// Most filament for each millimetre of a line, mm. More cannot go with the motion: at the slowest `F`
/// there is, 0.1 mm/min, the extruder would be too fast. It goes before.
const MOST_FILAMENT_PER_MM: f64 = 1e4;

impl Reader {
    /// Returns a reader before the first line; the nozzle stands at `home` in the part.
    pub(super) fn new(origin: Vector2<f64>, home: Point3<f64>, arc_tolerance: f64) -> Self {
        Self {
            origin,
            at: home,
            offset: Vector3::new(origin.x, origin.y, 0.0),
            is_at_home: [true; 3],
            filament: 0.0,
            is_relative: false,
            filament_is_relative: false,
            filament_mode_is_relative: false,
            unit: 1.0,
            speed: FIRST_SPEED_MM_S,
            has_speed: false,
            motion: 1,
            arc_tolerance,
        }
    }

    /// Where the nozzle is, mm, as it will be printed.
    pub(super) fn at(&self) -> Point3<f64> {
        self.at
    }

    /// Whether an `F` was read.
    pub(super) fn has_speed(&self) -> bool {
        self.has_speed
    }

    /// The machine now stands at `home`, and no origin is set.
    pub(super) fn homed(&mut self, home: Point3<f64>) {
        self.at = home;
        self.offset = Vector3::new(self.origin.x, self.origin.y, 0.0);
        self.is_at_home = [true; 3];
    }

    /// Reads one of the [`commands`] of a line and appends the strokes that it asks for.
    pub(super) fn line<'a>(
        &mut self,
        code: &'a str,
        strokes: &mut Vec<Stroke>,
    ) -> Result<Meaning<'a>, ReadError> {
        let code = code.trim();
        if code.contains('\0') {
            return Err(ReadError::Nul);
        }
        let first = code.bytes().next().unwrap_or(b' ').to_ascii_uppercase();
        let second = code.as_bytes().get(1).copied().unwrap_or(b' ');
        let is_word = second.is_ascii_digit() || b"+-. ".contains(&second);
        // Marks of the begin and the end of a program.
        if code == "%" {
            return Ok(Meaning::Absorbed);
        }
        if b"XYZEFIJR".contains(&first) && is_word {
            // Words alone go on with the last motion.
            let full = format!("G{} {code}", self.motion);
            let line = parse_line(&full)?;
            return match &line.command {
                Some(command) => self.motion(command, strokes).map(|()| Meaning::Motion),
                None => Ok(Meaning::Absorbed),
            };
        }
        if first != b'G' && !is_mode_of_filament(code) {
            return Ok(Meaning::Other(code));
        }
        match parse_line(code)?.command {
            Some(command) => self.command(&command, code, strokes),
            None => Ok(Meaning::Absorbed),
        }
    }

    fn command<'a>(
        &mut self,
        command: &Command<'_>,
        code: &'a str,
        strokes: &mut Vec<Stroke>,
    ) -> Result<Meaning<'a>, ReadError> {
        let number = match command.code {
            Code::Numbered(b'G', number, part) if is_foreign_motion(number, part) => {
                let name = code.split_ascii_whitespace().next().unwrap_or_default();
                return Err(ReadError::ForeignMotion(name.chars().take(20).collect()));
            }
            Code::Numbered(b'G', number, 0) => number,
            Code::Numbered(b'M', number, 0) => {
                self.filament_mode_is_relative = number == 83;
                self.filament_is_relative = number == 83;
                return Ok(Meaning::Absorbed);
            }
            _ => return Ok(Meaning::Other(code)),
        };
        match number {
            0..=3 => self.motion = number,
            17 | 21 | 94 => self.unit = if number == 21 { 1.0 } else { self.unit },
            18 | 19 => return Err(ReadError::OtherPlane),
            20 => self.unit = 25.4,
            90 => {
                self.is_relative = false;
                self.filament_is_relative = self.filament_mode_is_relative;
            }
            91 => (self.is_relative, self.filament_is_relative) = (true, true),
            92 => {
                self.set_origin(command);
                return Ok(Meaning::Absorbed);
            }
            28 => return Ok(Meaning::Home(code)),
            93 => return Err(ReadError::Foreign("inverse time (G93)")),
            95 => return Err(ReadError::Foreign("feed per turn (G95)")),
            _ => return Ok(Meaning::Other(code)),
        }
        if number > 3 {
            return Ok(Meaning::Absorbed);
        }
        self.motion(command, strokes).map(|()| Meaning::Motion)
    }

    fn set_origin(&mut self, command: &Command<'_>) {
        for (k, letter) in [b'X', b'Y', b'Z'].into_iter().enumerate() {
            if let Some(value) = command.word(letter) {
                self.offset[k] = value * self.unit - self.at[k];
                self.is_at_home[k] = false;
            }
        }
        if let Some(value) = command.word(b'E') {
            self.filament = value * self.unit;
        }
    }

    fn motion(
        &mut self,
        command: &Command<'_>,
        strokes: &mut Vec<Stroke>,
    ) -> Result<(), ReadError> {
        let is_arc = self.motion > 1;
        let axes = if is_arc { FOREIGN_AXES } else { FOREIGN_AXES_OF_LINES };
        if let Some(axis) = axes.iter().find(|axis| command.word(**axis).is_some()) {
            return Err(ReadError::ForeignAxis(char::from(*axis)));
        }
        if let Some(speed) = command.word(b'F') {
            if speed <= 0.0 {
                return Err(ReadError::Feed(speed));
            }
            (self.speed, self.has_speed) = (speed * self.unit / 60.0, true);
        }
        let to = self.target(command);
        let filament = self.fed(command);
        if filament.abs() > MOST_FILAMENT_MM {
            return Err(ReadError::Filament(filament));
        }
        if to == self.at && filament == 0.0 && !is_arc {
            return Ok(());
        }
        if !is_arc {
            self.straight(to, filament, strokes);
            return Ok(());
        }
        let length = |letter: u8| command.word(letter).map(|value| value * self.unit);
        let (i, j) = (length(b'I'), length(b'J'));
        let arc = Arc {
            from: self.at,
            to,
            centre: (i.is_some() || j.is_some())
                .then(|| Vector2::new(i.unwrap_or(0.0), j.unwrap_or(0.0))),
            radius: length(b'R'),
            clockwise: self.motion == 2,
        };
        let points = arc.points(self.arc_tolerance).ok_or(ReadError::NoArc)?;
        let share = filament / points.len() as f64;
        for (k, point) in points.into_iter().enumerate() {
            self.straight(point, share, strokes);
            // The pieces of an arc may become one move again.
            if let Some(piece) = strokes.last_mut().filter(|_| k > 0) {
                piece.continues = piece.kind == Kind::Print;
            }
        }
        Ok(())
    }

    fn target(&mut self, command: &Command<'_>) -> Point3<f64> {
        let mut to = self.at;
        for (k, letter) in [b'X', b'Y', b'Z'].into_iter().enumerate() {
            if let Some(value) = command.word(letter) {
                let is_at_home = std::mem::replace(&mut self.is_at_home[k], false);
                let from = if is_at_home { -self.offset[k] } else { self.at[k] };
                let value = value * self.unit;
                to[k] = if self.is_relative { from + value } else { value - self.offset[k] };
            }
        }
        to
    }

    fn fed(&mut self, command: &Command<'_>) -> f64 {
        let Some(value) = command.word(b'E') else { return 0.0 };
        let value = value * self.unit;
        if self.filament_is_relative {
            self.filament += value;
            return value;
        }
        let fed = value - self.filament;
        self.filament = value;
        fed
    }

    fn straight(&mut self, to: Point3<f64>, filament: f64, strokes: &mut Vec<Stroke>) {
        let speed = self.speed;
        let is_alone =
            to == self.at || filament.abs() > MOST_FILAMENT_PER_MM * (to - self.at).norm();
        if is_alone {
            let pieces = (filament.abs() / LONGEST_FILAMENT_MM).ceil().max(1.0);
            let stroke = Stroke {
                kind: Kind::Filament,
                to: self.at,
                filament: filament / pieces,
                speed,
                continues: false,
            };
            strokes.extend(std::iter::repeat_n(stroke, pieces as usize));
        }
        if to == self.at {
            return;
        }
        let filament = if is_alone { 0.0 } else { filament };
        let kind = if filament > 0.0 { Kind::Print } else { Kind::Travel };
        strokes.push(Stroke { kind, to, filament, speed, continues: false });
        self.at = to;
    }
}

/// Returns the commands of a line, which may have several: `G90 G21 G1 X10`. What follows another
/// letter is one command, whatever it holds. Line number and checksum are taken off.
pub(super) fn commands(code: &str) -> Result<impl Iterator<Item = &str>, ReadError> {
    let code = numbered(code)?;
    let bytes = code.as_bytes();
    let begins = |k: usize| {
        matches!(bytes[k], b'G' | b'g' | b'M' | b'm')
            && bytes.get(k + 1).is_some_and(u8::is_ascii_digit)
    };
    let may_split = !bytes.is_empty() && begins(0) && matches!(bytes[0], b'G' | b'g');
    let mut rest = 0;
    Ok(std::iter::from_fn(move || {
        if rest >= bytes.len() {
            return None;
        }
        let next = (rest + 1..bytes.len()).find(|&k| may_split && begins(k));
        let end = next.unwrap_or(bytes.len());
        // ASCII letters begin characters.
        let command = &code[rest..end];
        rest = end;
        Some(command)
    }))
}

/// Takes off line number and checksum.
fn numbered(code: &str) -> Result<&str, ReadError> {
    let code = code.trim();
    let Some(rest) = code.strip_prefix(['N', 'n']) else { return Ok(code) };
    let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
    if digits == 0 {
        return Ok(code);
    }
    let Some((line, sum)) = code.rsplit_once('*') else { return Ok(rest[digits..].trim_start()) };
    let found = line.bytes().fold(0, |sum, byte| sum ^ u32::from(byte));
    match sum.trim().parse() {
        Ok(given) if given != found => Err(ReadError::Checksum { given, found }),
        _ => Ok(line[1 + digits..].trim()),
    }
}

/// Curves, direct steps, probing, moves to stored places and drilling cycles: on a polar machine they
/// would go where nobody meant.
fn is_foreign_motion(number: u32, part: u32) -> bool {
    matches!((number, part), (5..=6 | 38 | 61 | 73 | 82..=89, _) | (0..=3, 1..))
}

fn is_mode_of_filament(code: &str) -> bool {
    let word = code.split_ascii_whitespace().next().unwrap_or_default();
    word.eq_ignore_ascii_case("M82") || word.eq_ignore_ascii_case("M83")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> (Vec<Stroke>, Vec<String>) {
        let home = Point3::new(120.0, 0.0, 5.0);
        let mut reader = Reader::new(Vector2::new(100.0, 100.0), home, 0.001);
        let (mut strokes, mut others) = (Vec::new(), Vec::new());
        for line in text.lines() {
            for command in commands(line).unwrap() {
                if let Meaning::Other(line) = reader.line(command, &mut strokes).unwrap() {
                    others.push(line.to_owned());
                }
            }
        }
        (strokes, others)
    }

    fn ends(strokes: &[Stroke]) -> Vec<[f64; 3]> {
        let fine = |n: f64| (n * 1e6).round() / 1e6;
        strokes.iter().map(|s| [fine(s.to.x), fine(s.to.y), fine(s.filament)]).collect()
    }

    #[test]
    fn absolute_and_relative_in_any_mixture() {
        let (strokes, _) = read(
            "G90\nM82\nG1 X110 Y100 Z0.2 F6000\nG1 Y105 E1\ng1x100e3\nG92 E0\nG1 X90 E0.5\nG91\n\
             G1 X-5 E0.25\nG90\nG1 X100 E1.5\nM83\nG1 Y110 E.5\nG1 E-2 F1200\nG92 X0 Y0\nG1 X1 Y1",
        );
        assert_eq!(
            ends(&strokes),
            [
                [10.0, 0.0, 0.0],
                [10.0, 5.0, 1.0],
                [0.0, 5.0, 2.0],
                [-10.0, 5.0, 0.5],
                [-15.0, 5.0, 0.25],
                [0.0, 5.0, 0.75],
                [0.0, 10.0, 0.5],
                [0.0, 10.0, -2.0],
                [1.0, 11.0, 0.0],
            ]
        );
        assert_eq!(strokes[7].kind, Kind::Filament);
        assert_eq!((strokes[1].speed, strokes[7].speed), (100.0, 20.0));
    }

    #[test]
    fn what_is_relative_to_home_is_relative_to_the_zero_of_the_source() {
        let (strokes, _) = read("G91\nG1 X110 Y105 Z0.2 F600\nG1 X-5\nG90\nG1 X90");
        let places: Vec<_> = strokes.iter().map(|s| (s.to.x, s.to.y, s.to.z)).collect();
        assert_eq!(places, [(10.0, 5.0, 0.2), (5.0, 5.0, 0.2), (-10.0, 5.0, 0.2)]);
    }

    #[test]
    fn inches_modal_words_numbers_and_checksums() {
        let (strokes, _) =
            read("G20\nG1 X4 Y4 F60\nG21\nX110.05 Y-3\nY90\nN3 G1 X100 Y100*42\nG90 G0 X101");
        assert_eq!(
            ends(&strokes),
            [
                [1.6, 1.6, 0.0],
                [10.05, -103.0, 0.0],
                [10.05, -10.0, 0.0],
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
            ]
        );
        let wrong = commands("N3 G1 X100 Y100*97").map(Iterator::count);
        assert_eq!(wrong, Err(ReadError::Checksum { given: 97, found: 42 }));
    }

    #[test]
    fn everything_else_goes_over() {
        let (strokes, others) = read("M104 S200\nG4 P10\nT0\nSET_FAN SPEED=1\nG29\nM117 E: X5 *");
        assert!(strokes.is_empty());
        assert_eq!(others, ["M104 S200", "G4 P10", "T0", "SET_FAN SPEED=1", "G29", "M117 E: X5 *"]);
    }

    #[test]
    fn arcs_end_where_they_should_and_share_their_filament() {
        let (strokes, _) =
            read("M83\nG1 X110 Y100 F3000\nG3 X100 Y110 I-10 J0 E2\nG2 X110 Y100 R10");
        let fed: f64 = strokes.iter().map(|stroke| stroke.filament).sum();
        assert!((fed - 2.0).abs() < 1e-12 && strokes.len() > 50);
        assert_eq!(strokes.last().unwrap().to.xy(), nalgebra::Point2::new(10.0, 0.0));
    }

    /// A number that a spool does not hold must not become as many moves; found by fuzzing.
    #[test]
    fn filament_without_measure_is_refused_or_fed_before_the_move() {
        for line in ["G1 E99999999999999", "G1 X5 E100000", "G1 X20 E1666666666666666666666666666"]
        {
            let mut reader = Reader::new(Vector2::zeros(), Point3::origin(), 0.01);
            let mut strokes = Vec::new();
            let read = reader.line(line, &mut strokes).map(|_| ());
            assert!(strokes.len() < 10_000, "{line}");
            assert_eq!(read.is_err(), !line.ends_with("E100000"), "{line}: {read:?}");
        }
        let (strokes, _) = read("M83\nG1 X100 Y100 F6000\nG1 X100.0001 E20");
        let kinds: Vec<Kind> = strokes[1..].iter().map(|stroke| stroke.kind).collect();
        assert_eq!(kinds, [Kind::Filament, Kind::Travel]);
    }

    #[test]
    fn long_purges_come_in_pieces() {
        let (strokes, _) = read("M83\nG1 E120 F300");
        assert_eq!(strokes.len(), 3);
        assert!(strokes.iter().all(|stroke| (stroke.filament - 40.0).abs() < 1e-12));
    }

    #[test]
    fn faults_are_named() {
        let mut reader = Reader::new(Vector2::zeros(), Point3::origin(), 0.001);
        let mut line = |text: &'static str| reader.line(text, &mut Vec::new());
        assert!(matches!(line("G1 X5 F"), Err(ReadError::Syntax(_))));
        assert_eq!(line("G2 X5 Y5 F100 I3 J9"), Err(ReadError::NoArc));
        assert_eq!(line("G18"), Err(ReadError::OtherPlane));
        for foreign in ["G5 X5 Y5 I1 J1 P1 Q1", "G5.1 X5", "G6 X5", "G38.2 Z-5", "G61 X", "G83 X1"]
        {
            let name = foreign.split(' ').next().unwrap().to_owned();
            assert_eq!(line(foreign), Err(ReadError::ForeignMotion(name)));
        }
        // What a program for a polar printer says, and one for a turning head.
        assert_eq!(line("G1 X50 T-3 E1"), Err(ReadError::ForeignAxis('T')));
        assert_eq!(line("G1 R50 E1"), Err(ReadError::ForeignAxis('R')));
        assert_eq!(line("G0 X1 C90"), Err(ReadError::ForeignAxis('C')));
        assert_eq!(line("G1 X5 F0"), Err(ReadError::Feed(0.0)));
        assert!(line("G1 X5 X6").unwrap_err().to_string().contains("twice"));
        assert!(line("G1 X-2e1 E3").unwrap_err().to_string().contains("twice"));
        assert!(matches!(line("G93"), Err(ReadError::Foreign(_))));
    }

    #[test]
    fn several_commands_in_a_line() {
        let parts = |line: &'static str| commands(line).unwrap().map(str::trim).collect::<Vec<_>>();
        assert_eq!(parts("G90 G21 G1 X10 F600"), ["G90", "G21", "G1 X10 F600"]);
        assert_eq!(parts("N7 G90 G1 X5"), ["G90", "G1 X5"]);
        assert_eq!(parts("g91g1x5"), ["g91", "g1x5"]);
        assert_eq!(parts("M117 Go G1 X5"), ["M117 Go G1 X5"]);
        assert_eq!(parts("SET_PIN PIN=M1"), ["SET_PIN PIN=M1"]);
        assert_eq!(parts("G1 X5 M106"), ["G1 X5", "M106"]);
        assert_eq!(parts(" "), [] as [&str; 0]);
    }

    #[test]
    fn the_first_speed_is_that_of_firmwares() {
        assert_eq!(read("G1 X110").0[0].speed, 25.0);
    }
}
