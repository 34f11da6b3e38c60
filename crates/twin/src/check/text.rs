//! Is every line one that any firmware reads the same way?
//!
//! One command a line, at most 90 characters, printable ASCII, no blank at the end. Numbers are
//! plain decimals: Klipper reads `X1e1` as two words, others as 10; a `-0`, a number without a
//! digit before the point, a sign `+` are read differently as well. Commands come from a list, so
//! that nothing but known words can move or heat the machine. Motion is `G1` alone: firmwares take
//! `G0` as a curve in joint space and skip or ignore arcs. The two words of the plane come
//! together, `F` is positive, filament alone moves in pieces under 50 mm (Klipper refuses longer
//! ones).

use machine::gcode::dialect::Dialect;
use machine::gcode::dialect::Space;
use machine::gcode::posed::MOST_WORDS;
use machine::gcode::{Code, Command, MOST_COLUMNS, SyntaxError, parse_line, printable};
use machine::head::Head;

use crate::finding::{Findings, Place};

/// The name of this check.
pub const NAME: &str = "text";

/// Filament moved without the nozzle in one line must be less than this, mm. It is the default of
/// Klipper's `max_extrude_only_distance`.
pub const FILAMENT_ALONE: f64 = 50.0;

/// The `G` commands that a program may have besides `G1`.
const GENERAL: [u32; 7] = [4, 21, 28, 90, 92, 93, 94];

/// The `M` commands that a program may have: extruder relative (83), motors off (18, 84), heaters
/// and fans, progress and messages (73, 117), waiting for moves to end (400), filament ahead of its flow
/// (572, 900), accelerations (204), objects (486).
const MACHINE: [u32; 16] =
    [18, 73, 83, 84, 104, 106, 107, 109, 117, 140, 190, 204, 400, 486, 572, 900];

/// The commands by name that a program may have: Klipper's own, which move nothing.
const NAMED: [&str; 5] = [
    "SET_PRESSURE_ADVANCE",
    "SET_PRINT_STATS_INFO",
    "EXCLUDE_OBJECT_DEFINE",
    "EXCLUDE_OBJECT_START",
    "EXCLUDE_OBJECT_END",
];

/// Judges lines as they stand.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Text {
    dialect: Dialect,
    /// The letters that say where a head that turns the nozzle stands, and whether two of them are those of
    /// the plane.
    head: Option<([u8; MOST_WORDS + 2], bool)>,
    /// Whether all but the motion comes from another program.
    is_converted: bool,
    /// Whether such a command was seen.
    has_kept: bool,
}

impl Text {
    /// Returns the check for programs in this dialect.
    #[must_use]
    pub(crate) fn new(dialect: Dialect) -> Self {
        Self { dialect, head: None, is_converted: false, has_kept: false }
    }

    /// The same for a machine whose head turns the nozzle.
    pub(crate) fn with_head(self, head: Option<&Head>) -> Self {
        let head = head.filter(|_| self.dialect.speaks_of_heads()).map(|head| {
            let mut letters = [b'E'; MOST_WORDS + 2];
            letters[1] = b'F';
            for (letter, word) in letters[2..].iter_mut().zip(self.dialect.posed_words(head)) {
                *letter = word.letter;
            }
            (letters, head.has_carriage())
        });
        Self { head, ..self }
    }

    /// What is not motion comes from another program from here on: it is as its author wrote it, and
    /// is not judged.
    pub(crate) fn is_converted(&mut self) {
        self.is_converted = true;
    }

    /// Returns whether a command is a macro of another program's author.
    pub(crate) fn is_macro_of_source(&self, command: &Command<'_>) -> bool {
        self.is_converted && matches!(command.code, Code::Named(_))
    }

    /// Returns whether there was a command that was not judged.
    pub(crate) fn has_kept(&self) -> bool {
        self.has_kept
    }

    /// Judges the characters of a line.
    pub(crate) fn characters(&self, line: &[u8], place: Place, findings: &mut Findings) {
        if line.len() > MOST_COLUMNS {
            let measured = (line.len() as f64, MOST_COLUMNS as f64);
            findings.error(NAME, place, measured, || {
                format!("{} characters in a line, at most {MOST_COLUMNS} are safe", line.len())
            });
        }
        let is_printable = |byte: &u8| (b' '..=b'~').contains(byte);
        if let Some(column) = line.iter().position(|byte| !is_printable(byte)) {
            let byte = line[column];
            findings.error(NAME, place, (f64::from(byte), f64::from(b'~')), || {
                format!("byte {byte:#04x} in column {} is not printable ASCII", column + 1)
            });
        }
        if line.last() == Some(&b' ') {
            findings.error(NAME, place, (1.0, 0.0), || "the line ends in a blank".into());
        }
        let code = line.split(|&byte| byte == b';').next().unwrap_or_default();
        let is_kept = self.is_converted && !code.starts_with(b"G1 ");
        if !code.is_empty() && !is_kept {
            words(code, place, findings);
        }
    }

    /// Reports a line that is not a command.
    pub(crate) fn unreadable(
        &mut self,
        text: &str,
        error: &SyntaxError,
        place: Place,
        findings: &mut Findings,
    ) {
        if self.is_converted && !text.starts_with("G1 ") {
            self.has_kept = true;
            return;
        }
        findings.error(NAME, place, (error.column as f64, 0.0), || {
            format!("the line is not a command: column {}, {}", error.column, error.what)
        });
    }

    /// Judges a command.
    pub(crate) fn command(&mut self, command: &Command<'_>, place: Place, findings: &mut Findings) {
        if self.is_converted && !is_motion(command.code) && !is_on_list(command.code) {
            self.has_kept = true;
            return;
        }
        match command.code {
            Code::Numbered(b'G', 1, 0) => self.motion(command, place, findings),
            Code::Numbered(b'G', 2 | 3, 0) if is_arc(command, &self.dialect) => {}
            Code::Numbered(b'G', number @ (0 | 2 | 3 | 5), 0) => {
                findings.error(NAME, place, (f64::from(number), 1.0), || {
                    format!("motion by G{number}, which firmwares run differently; only G1 is safe")
                });
            }
            Code::Numbered(b'G', 92, 0) => self.origin(command, place, findings),
            code if is_on_list(code) => {}
            Code::Numbered(letter, number, part) => {
                findings.error(NAME, place, (f64::from(number), 0.0), || {
                    let part = if part == 0 { String::new() } else { format!(".{part}") };
                    format!("{}{number}{part} is not on the list of safe commands", letter as char)
                });
            }
            Code::Named(name) if NAMED.contains(&name.split(' ').next().unwrap_or_default()) => {}
            // A macro of the printer's owner: nobody here can know what it does.
            Code::Named(name) => findings.warning(NAME, place, (1.0, 0.0), || {
                format!("what the macro {} does cannot be judged", printable(name))
            }),
        }
    }

    /// Judges a new origin: of the filament, or of the bed's count where the dialect keeps it short.
    fn origin(&self, command: &Command<'_>, place: Place, findings: &mut Findings) {
        let given = |letter: &u8| command.word(*letter).is_some() && *letter != b'G';
        let (mut recounts, mut others) = (false, false);
        for letter in (b'A'..=b'Z').filter(given) {
            if self.dialect.recounts(letter) {
                recounts = true;
            } else {
                others |= letter != b'E' || command.word(b'E') != Some(0.0);
            }
        }
        if others || !(recounts || command.word(b'E').is_some()) {
            findings.error(NAME, place, (1.0, 0.0), || {
                "G92 may only be G92 E0: anything else moves the origin of the program".into()
            });
        }
    }

    fn motion(&self, command: &Command<'_>, place: Place, findings: &mut Findings) {
        let plane = self.dialect.plane.map(|word| command.word(word.letter).is_some());
        let in_pairs = self.head.is_none_or(|(_, has_carriage)| has_carriage);
        if plane[0] != plane[1] && in_pairs {
            let [first, second] = self.dialect.plane.map(|word| word.letter as char);
            findings.error(NAME, place, (1.0, 2.0), || {
                format!("{first} and {second} must come together, one of them is missing")
            });
        }
        let [first, second] = self.dialect.plane.map(|word| word.letter);
        let usual = [b'Z', b'E', b'F', first, second];
        let known = self.head.as_ref().map_or(&usual[..], |(letters, _)| letters);
        if let Some(letter) = command.letter_besides(known) {
            let name = self.dialect.name;
            findings.error(NAME, place, (1.0, 0.0), || {
                format!("the word {} means nothing in a move of dialect {name}", letter as char)
            });
        }
        if let Some(feed) = command.word(b'F').filter(|feed| *feed <= 0.0) {
            findings.error(NAME, place, (feed, 0.0), || {
                format!("the speed F is {feed} mm/min, it must be positive")
            });
        }
        let alone = command.letter_besides(b"GEF").is_none();
        let filament = command.word(b'E').unwrap_or(0.0).abs();
        if alone && filament >= FILAMENT_ALONE {
            findings.error(NAME, place, (filament, FILAMENT_ALONE), || {
                format!("{filament} mm of filament in one move, must be under {FILAMENT_ALONE} mm")
            });
        }
    }
}

/// Returns the command of a line that no program may hold, because it changes the machine for good, stops
/// it, or does what is not known here; `None` where there is none. A line of another kind is judged with
/// the whole program.
#[must_use]
pub fn unsafe_command(line: &str) -> Option<String> {
    let code = parse_line(line).ok()?.command?.code;
    match code {
        Code::Numbered(letter, number, part) if !is_motion(code) && !is_on_list(code) => {
            let part = if part == 0 { String::new() } else { format!(".{part}") };
            Some(format!("{}{number}{part}", letter as char))
        }
        _ => None,
    }
}

fn is_on_list(code: Code<'_>) -> bool {
    match code {
        Code::Numbered(b'G', number, 0) => GENERAL.contains(&number),
        Code::Numbered(b'M', number, 0) => MACHINE.contains(&number),
        _ => false,
    }
}

/// Whether a command is an arc about a centre, in a dialect whose firmwares run all of them alike.
pub(crate) fn is_arc(command: &Command<'_>, dialect: &Dialect) -> bool {
    let is_code = matches!(command.code, Code::Numbered(b'G', 2 | 3, 0));
    let has = |letters: &[u8]| letters.iter().all(|letter| command.word(*letter).is_some());
    is_code
        && dialect.space == Space::Part
        && has(b"XYIJ")
        && command.letter_besides(b"XYZIJEF").is_none()
}

fn is_motion(code: Code<'_>) -> bool {
    matches!(code, Code::Numbered(b'G', 0 | 1 | 2 | 3 | 5, _))
}

/// Judges the words of a command as they are spelt.
fn words(code: &[u8], place: Place, findings: &mut Findings) {
    let mut words = code.split(|&byte| byte == b' ').filter(|word| !word.is_empty());
    let first = words.next().unwrap_or_default();
    // Messages are free text, macros have their own rules.
    let is_named = first.get(1).is_some_and(|c| c.is_ascii_alphabetic() || *c == b'_');
    if is_named || first == b"M117" {
        return;
    }
    if !is_code(first) {
        misspelt(first, "is not a command", place, findings);
    }
    let mut given = 0_u32;
    for word in words {
        let letter = word[0];
        if !letter.is_ascii_uppercase() {
            misspelt(word, "is not a letter and a number", place, findings);
            continue;
        }
        let bit = 1 << (letter - b'A');
        if given & bit != 0 {
            misspelt(word, "is given twice", place, findings);
        }
        given |= bit;
        if matches!(letter, b'G' | b'M' | b'N') {
            misspelt(word, "is a second command in the line", place, findings);
        } else if let Some(fault) = fault_of_number(&word[1..]) {
            misspelt(word, fault, place, findings);
        }
    }
}

fn misspelt(word: &[u8], fault: &'static str, place: Place, findings: &mut Findings) {
    findings.error(NAME, place, (1.0, 0.0), || {
        format!("{} {fault}", printable(&String::from_utf8_lossy(word)))
    });
}

fn is_code(word: &[u8]) -> bool {
    let number = word.get(1..).unwrap_or_default();
    let is_number = |digits: &[u8]| !digits.is_empty() && digits.iter().all(u8::is_ascii_digit);
    word.first().is_some_and(u8::is_ascii_uppercase)
        && number.splitn(2, |&byte| byte == b'.').all(is_number)
}

/// Returns what is wrong with a number, if anything is.
fn fault_of_number(number: &[u8]) -> Option<&'static str> {
    let (is_negative, digits) = match number.split_first() {
        Some((b'-', digits)) => (true, digits),
        _ => (false, number),
    };
    match digits.first() {
        None => return Some("has no number"),
        Some(b'.') => return Some("has no digit before the point"),
        _ => {}
    }
    let mut points = 0;
    let mut is_zero = true;
    for &byte in digits {
        match byte {
            b'0' => {}
            b'1'..=b'9' => is_zero = false,
            b'.' => points += 1,
            _ => return Some("is not a plain decimal number"),
        }
    }
    if points > 1 || digits.ends_with(b".") {
        return Some("is not a plain decimal number");
    }
    (is_negative && is_zero).then_some("is a negative zero")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::read;
    use machine::gcode::dialect::{CARTESIAN, POLAR};

    fn found(dialect: Dialect, line: &str) -> Vec<String> {
        found_by(Text::new(dialect), line)
    }

    fn found_by(mut check: Text, line: &str) -> Vec<String> {
        let place = Place::line(1, None);
        let mut findings = Findings::default();
        check.characters(line.as_bytes(), place, &mut findings);
        match read(line) {
            Ok(read) => {
                if let Some(command) = &read.command {
                    check.command(command, place, &mut findings);
                }
            }
            Err(error) => check.unreadable(line, &error, place, &mut findings),
        }
        findings.kept().iter().map(|finding| finding.message.clone()).collect()
    }

    #[test]
    fn sound_lines() {
        for line in [
            "",
            ";TYPE:External perimeter",
            "; a remark ;",
            "G1 R12.345 T-93.1235 Z0.2 E0.03123 F1500",
            "G1 E-0.8 F2400",
            "G92 E0",
            "M104 S210 ; warm",
            "M117 1e5 .5 -0 done?",
            "G4 P500",
            "M106 S127",
        ] {
            assert_eq!(found(POLAR, line), Vec::<String>::new(), "{line}");
        }
        assert!(found(CARTESIAN, "G1 X0 Y-3.25 E0.1").is_empty());
    }

    #[test]
    fn commands_of_another_program_are_not_judged_but_motion_is() {
        let mut check = Text::new(POLAR);
        check.is_converted();
        for line in
            ["M204 P800", "T0", "m73 p5 r.5", "START_PRINT BED=60", "M862.3 P \"x\"", "G28 W"]
        {
            assert_eq!(found_by(check, line), Vec::<String>::new(), "{line}");
        }
        for line in ["G0 R5 T3", "G2 R5 T3 I1 J1", "G1 R5", "G1 R-0 T3", "G1 E50", "G92 X5"] {
            assert_eq!(found_by(check, line).len(), 1, "{line}");
        }
    }

    #[test]
    fn faults_and_what_is_said_of_them() {
        let long = format!("; {}", "x".repeat(89));
        for (line, said) in [
            (long.as_str(), "91 characters"),
            ("; caf\u{e9}", "column 6"),
            ("G1 R20\tT3", "0x09"),
            ("G1 R20 T3 ", "ends in a blank"),
            ("G1 R1e1 T3", "R1e1 is not a plain"),
            ("G1 RNaN T3", "RNaN is not a plain"),
            ("G1 Rinf T3", "Rinf is not a plain"),
            ("G1 R-0 T3", "R-0 is a negative zero"),
            ("G1 R-0.00 T3", "R-0.00 is a negative zero"),
            ("G1 R.5 T3", "no digit before"),
            ("G1 R5. T3", "R5. is not a plain"),
            ("G1 R+5 T3", "R+5 is not a plain"),
            ("G1 R5T3", "R5T3 is not a plain"),
            ("g1 R5 T3", "g1 is not a command"),
            ("G1 R5 T3 R6", "R6 is given twice"),
            ("G1 R5 T3 G1 R6 T3", "second command"),
            ("N5 G1 R5 T3", "second command"),
            ("G1 R5 T3*71", "T3*71 is not a plain"),
            ("G0 R5 T3", "motion by G0"),
            ("G2 R5 T3 I1 J1", "motion by G2"),
            ("M82", "M82 is not on the list"),
            ("G92.1", "G92.1 is not on the list"),
            ("M500", "M500 is not on the list"),
            ("T1", "T1 is not on the list"),
            ("START_PRINT BED=60", "START_PRINT"),
            ("G92 X0", "G92 may only"),
            ("G92 E5", "G92 may only"),
            ("G1 R5 E1", "R and T must come together"),
            ("G1 X5 Y3", "the word X"),
            ("G1 R5 T3 F0", "must be positive"),
            ("G1 R5 T3 F-5", "must be positive"),
            ("G1 E50", "under 50 mm"),
            ("G1 E-50", "under 50 mm"),
            ("G1 R", "not a command"),
        ] {
            let found = found(POLAR, line);
            assert!(found.iter().any(|message| message.contains(said)), "{line}: {found:?}");
        }
    }
}
