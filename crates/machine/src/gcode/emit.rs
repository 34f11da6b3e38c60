//! The only place that writes programs as text.
//!
//! Promises, whatever comes in: one command a line, at most [`MOST_COLUMNS`] characters, printable
//! ASCII, shortest decimal numbers, every motion a `G1` (or `G2` and `G3`, where steps are arcs), the plane's two words always together,
//! `F` positive. Filament is relative (`M83`); what rounding takes from one move is given to the
//! next, so that the sum is right to half a last place.

use std::io::{self, Write};

use super::correction::Correction;
use super::dialect::{DEGREE_DECIMALS, Dialect, MM_DECIMALS, NEAR_AXIS_DECIMALS, Quantity};
use super::label::Labels;
use super::number::{decimal, push_quantum, quantum, scale, value};
use super::posed::{Drive, MOST_WORDS, PosedWord};
use super::speed_word::Way;
use crate::profile::Printer;
use crate::program::{Arc, BedTurn, Joints, Layer, Move, Posed, Role, Step};

/// Longest line, in characters. Marlin's command buffer holds 96.
pub const MOST_COLUMNS: usize = 90;

/// Decimal places of `E`: 10 nm of filament.
const FILAMENT_DECIMALS: usize = 5;

/// Decimal places of `F`.
const FEED_DECIMALS: usize = 1;

/// The least `F`, mm/min: one last place.
pub const LEAST_FEED: f64 = 0.1;

/// Decimal places of small inverse times: 0.0001/min is 0.1 % for a move of ten minutes.
const INVERSE_TIME_DECIMALS: usize = 4;

/// How a program says how long it has taken so far; Cura's words, which print servers read.
pub const ELAPSED: &str = ";TIME_ELAPSED:";

const DEGREES_IN_A_TURN: f64 = 360.0;

/// Writes the steps of a program to `W` in the words of a dialect.
pub struct Emitter<W> {
    out: W,
    dialect: Dialect,
    line: Vec<u8>,
    correction: Option<Correction>,
    /// The words of a head that turns the nozzle, and what each was told last, in units of the finest
    /// last place.
    posed: Vec<PosedWord>,
    told: [Option<i64>; MOST_WORDS],
    /// The last plane words and z written, in units of the finest last place.
    position: Option<[i64; 3]>,
    /// Where the bed was told to turn last.
    turn: Option<BedTurn>,
    /// Whole turns that the firmware's count is behind.
    recounted: f64,
    /// Whether the part is done and what follows only leaves it.
    leaves: bool,
    /// Whether the firmware now takes `F` as inverse time.
    inverse_time: bool,
    /// The last speed word, in units of its last place.
    feed: i64,
    /// Filament that rounding has kept back so far, mm.
    filament_owed: f64,
    bead: Option<(Role, i64)>,
    /// Thickness of the layer, and of the beads wanted and told, in the last place.
    layer_height: i64,
    wanted_height: i64,
    told_height: i64,
    labels: Option<Labels>,
    /// The object that the lines belong to.
    object: Option<usize>,
    lines: usize,
}

impl<W: Write> Emitter<W> {
    /// Returns an emitter that has written nothing yet.
    pub fn new(out: W, dialect: Dialect) -> Self {
        Self {
            out,
            dialect,
            line: Vec::with_capacity(MOST_COLUMNS),
            correction: None,
            posed: Vec::new(),
            told: [None; MOST_WORDS],
            position: None,
            turn: None,
            recounted: 0.0,
            leaves: false,
            inverse_time: false,
            feed: 0,
            filament_owed: 0.0,
            bead: None,
            layer_height: 0,
            wanted_height: 0,
            told_height: 0,
            labels: None,
            object: None,
            lines: 0,
        }
    }

    /// Returns an emitter for a printer that stands at home, whose bed heights and play are
    /// corrected for.
    pub fn for_printer(out: W, dialect: Dialect, printer: &Printer) -> Self {
        let dialect = dialect.on(printer);
        let head = printer.head.as_ref().filter(|_| dialect.speaks_of_heads());
        let posed = head.map(|head| dialect.posed_words(head)).unwrap_or_default();
        // Heads are planned with the bed as it was probed.
        let correction =
            if printer.head.is_none() { Correction::of(printer, dialect) } else { None };
        Self { correction, posed, ..Self::new(out, dialect) }
    }

    /// Writes one step.
    ///
    /// # Errors
    ///
    /// What the writer reports.
    pub fn step(&mut self, step: &Step) -> io::Result<()> {
        match step {
            Step::Move(motion) => self.planned(motion),
            Step::Arc(arc) => self.motion(&arc.motion, Some(arc)),
            Step::Posed(posed) if self.posed.is_empty() => self.motion(&posed.motion, None),
            Step::Posed(posed) => self.stance(posed),
            Step::Layer(layer) => self.layer(layer),
            Step::Bead(role, width) => self.bead(*role, *width),
            Step::Height(height) => {
                self.height(*height);
                Ok(())
            }
            Step::Fan(share) => self.fan(*share),
            Step::Object(object) => self.object(*object),
            Step::Elapsed(seconds) => self.text(&format!("{ELAPSED}{}", decimal(*seconds, 1))),
            Step::Acceleration(wanted) => match self.dialect.acceleration(*wanted) {
                Some(words) => self.text(&words),
                None => Ok(()),
            },
            Step::Remark(text) => self.comment(text),
            Step::Custom(line) => self.custom(line),
        }
    }

    /// Writes a comment line, cut to the longest that is allowed.
    ///
    /// # Errors
    ///
    /// What the writer reports.
    pub fn comment(&mut self, text: &str) -> io::Result<()> {
        self.text(&format!("; {}", printable(text)))
    }

    /// Writes a line as it is, after making it printable and cutting it.
    ///
    /// # Errors
    ///
    /// What the writer reports.
    pub fn text(&mut self, line: &str) -> io::Result<()> {
        let line = printable(line);
        self.line.extend(line.bytes().take(MOST_COLUMNS));
        // Where it is cut there may be a blank.
        let length = self.line.trim_ascii_end().len();
        self.line.truncate(length);
        self.end_line()
    }

    /// Says that the part is done: heights from here on are not its own, and are marked (`;E`) so
    /// that `RepRapFirmware` does not take them for the height of the part.
    pub fn leave_part(&mut self) {
        self.leaves = true;
    }

    /// Tells which lines belong to which object from here on.
    pub fn label(&mut self, labels: Labels) {
        self.labels = Some(labels);
    }

    /// Returns the number of lines written.
    #[must_use]
    pub fn lines(&self) -> usize {
        self.lines
    }

    /// Flushes and returns the writer.
    ///
    /// # Errors
    ///
    /// What the writer reports.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }

    fn planned(&mut self, motion: &Move) -> io::Result<()> {
        let Some(correction) = &mut self.correction else { return self.motion(motion, None) };
        let (take_up, told) = correction.moves(motion);
        if let Some(take_up) = take_up {
            self.motion(&take_up, None)?;
        }
        self.motion(&told, None)
    }

    /// A line of the printer's owner, who knows nothing of inverse time.
    fn custom(&mut self, line: &str) -> io::Result<()> {
        if self.inverse_time && line.trim_start().starts_with(['G', 'g']) {
            self.inverse_time = false;
            self.text("G94")?;
        }
        if line.trim_start().starts_with("G28") {
            // Where the machine stands now is not where it was told last.
            (self.position, self.turn) = (None, None);
            self.told = [None; MOST_WORDS];
            self.recounted = 0.0;
        }
        self.text(line)
    }

    fn motion(&mut self, motion: &Move, arc: Option<&Arc>) -> io::Result<()> {
        let decimals = self.dialect.decimals(motion);
        let plane = self.plane_words(&motion.to, motion);
        let counts = [quantum(plane[0], decimals[0]), quantum(plane[1], decimals[1])];
        let finest = |k: usize| counts[k] * 10_i64.pow((NEAR_AXIS_DECIMALS - decimals[k]) as u32);
        let z = quantum(motion.to.z, MM_DECIMALS);
        let target = [finest(0), finest(1), z];
        let wanted = motion.filament + self.filament_owed;
        let filament = quantum(wanted, FILAMENT_DECIMALS);
        self.filament_owed = wanted - value(filament, FILAMENT_DECIMALS);
        let moved = |k: usize| self.position.is_none_or(|last| last[k] != target[k]);
        // A move without path keeps the plane: its words are only the rounding of where it is.
        let plane_moved = motion.path > 0.0 && (moved(0) || moved(1));
        let z_moved = moved(2);
        if !plane_moved && !z_moved && filament == 0 {
            return Ok(());
        }
        if self.dialect.speed.is_of_one_move() && !self.inverse_time {
            self.inverse_time = true;
            self.text("G93")?;
        }
        let arc = arc.filter(|_| plane_moved).and_then(|arc| Some((arc, self.last_point()?)));
        self.line.extend_from_slice(match arc {
            None => b"G1",
            Some((arc, _)) if arc.clockwise => b"G2",
            Some(_) => b"G3",
        });
        if plane_moved {
            for k in 0..2 {
                self.line.extend_from_slice(&[b' ', self.dialect.plane[k].letter]);
                push_quantum(&mut self.line, counts[k], decimals[k]);
            }
        }
        if z_moved {
            self.line.extend_from_slice(b" Z");
            push_quantum(&mut self.line, z, MM_DECIMALS);
        }
        if let Some((arc, from)) = arc {
            for (k, letter) in [b'I', b'J'].into_iter().enumerate() {
                self.line.extend_from_slice(&[b' ', letter]);
                let aside = quantum(arc.centre[k] - from[k], MM_DECIMALS);
                push_quantum(&mut self.line, aside, MM_DECIMALS);
            }
        }
        if filament != 0 {
            self.line.extend_from_slice(b" E");
            push_quantum(&mut self.line, filament, FILAMENT_DECIMALS);
        }
        self.speed(motion, target, plane_moved);
        if z_moved && self.leaves {
            self.line.extend_from_slice(b" ;E");
        }
        if plane_moved {
            self.position = Some(target);
            self.turn = Some(motion.to.turn);
        } else if let Some(position) = &mut self.position {
            position[2] = z;
        } else {
            // Nothing is known of the plane yet: no later move may take it for granted.
            self.position = Some([i64::MIN, i64::MIN, z]);
        }
        self.end_line()
    }

    /// Where the words of the plane are, as they were written last.
    fn last_point(&self) -> Option<[f64; 2]> {
        let last = self.position.filter(|last| last[0] != i64::MIN)?;
        Some([0, 1].map(|k| value(last[k], NEAR_AXIS_DECIMALS)))
    }

    /// A move of a head that turns the nozzle: the words that change, carriage and bed together.
    fn stance(&mut self, posed: &Posed) -> io::Result<()> {
        let motion = &posed.motion;
        let wanted = motion.filament + self.filament_owed;
        let filament = quantum(wanted, FILAMENT_DECIMALS);
        self.filament_owed = wanted - value(filament, FILAMENT_DECIMALS);
        let mut told = self.told;
        for (k, word) in self.posed.iter().enumerate() {
            let decimals = self.posed_decimals(word.drive, posed);
            let turned = if word.drive == Drive::Bed { self.recounted } else { 0.0 };
            let number = word.drive.number(&posed.stance) - turned * DEGREES_IN_A_TURN;
            let finest = 10_i64.pow((NEAR_AXIS_DECIMALS - decimals) as u32);
            told[k] = Some(quantum(number, decimals) * finest);
        }
        // A move without path keeps the drives: the words are only the rounding of where they are.
        let moved = |k: usize| motion.path > 0.0 && told[k] != self.told[k];
        let in_plane = |k: usize| matches!(self.posed[k].drive, Drive::Carriage | Drive::Bed);
        let plane_moved = (0..self.posed.len()).any(|k| in_plane(k) && moved(k));
        let written: Vec<usize> = (0..self.posed.len())
            .filter(|&k| if in_plane(k) { plane_moved } else { moved(k) })
            .collect();
        if written.is_empty() && filament == 0 {
            return Ok(());
        }
        if self.dialect.speed.is_of_one_move() && !self.inverse_time {
            self.inverse_time = true;
            self.text("G93")?;
        }
        self.line.extend_from_slice(b"G1");
        for &k in &written {
            let decimals = self.posed_decimals(self.posed[k].drive, posed);
            let finest = 10_i64.pow((NEAR_AXIS_DECIMALS - decimals) as u32);
            self.line.extend_from_slice(&[b' ', self.posed[k].letter]);
            push_quantum(&mut self.line, told[k].unwrap_or_default() / finest, decimals);
            self.told[k] = told[k];
        }
        if filament != 0 {
            self.line.extend_from_slice(b" E");
            push_quantum(&mut self.line, filament, FILAMENT_DECIMALS);
        }
        self.speed(&Move { path: posed.way(), ..*motion }, [0; 3], true);
        if !written.is_empty() {
            self.turn = Some(posed.stance.base.turn);
        }
        if self.leaves && written.iter().any(|&k| self.posed[k].drive == Drive::Lift) {
            self.line.extend_from_slice(b" ;E");
        }
        self.end_line()
    }

    fn posed_decimals(&self, drive: Drive, posed: &Posed) -> usize {
        match drive {
            Drive::Carriage => self.dialect.length_decimals(posed.stance.base.s.abs()),
            drive => drive.decimals(),
        }
    }

    fn plane_words(&self, to: &Joints, motion: &Move) -> [f64; 2] {
        let mut words = self.dialect.plane_values(to, &motion.at);
        for (word, value) in self.dialect.plane.iter().zip(&mut words) {
            if word.quantity == Quantity::Bed {
                *value -= self.recounted * DEGREES_IN_A_TURN;
            }
        }
        words
    }

    /// Appends the speed word, where it is not still the same.
    fn speed(&mut self, motion: &Move, target: [i64; 3], plane_moved: bool) {
        let way = self.way(motion, target, plane_moved);
        let word = self.dialect.speed.word(&way, motion.duration);
        // A tenth of mm/min is fine for speeds; inverse times of long moves are small numbers.
        let decimals = if self.dialect.speed.is_of_one_move() && word < 600.0 {
            INVERSE_TIME_DECIMALS
        } else {
            FEED_DECIMALS
        };
        // Rounded down, so that a limit stays a limit; never to nothing. What is a whole number but
        // for its last bits stays one.
        let feed = ((word * scale(decimals) + 1e-3) as i64).max(1);
        if feed != self.feed || self.dialect.speed.is_of_one_move() {
            self.line.extend_from_slice(b" F");
            push_quantum(&mut self.line, feed, decimals);
            self.feed = feed;
        }
    }

    /// What the speed word depends on.
    fn way(&self, motion: &Move, target: [i64; 3], plane_moved: bool) -> Way {
        let mut way = Way {
            path: motion.path,
            words: 0.0,
            filament: motion.filament,
            turn: 0.0,
            ends: [[0.0; 2]; 2],
            rise: 0.0,
        };
        if !self.dialect.speed.is_along_words() {
            return way;
        }
        let plane = |words: [i64; 3]| [0, 1].map(|k| value(words[k], NEAR_AXIS_DECIMALS));
        let known = self.position.filter(|last| last[0] != i64::MIN);
        way.rise = self.position.map_or(0.0, |last| value(target[2] - last[2], MM_DECIMALS));
        way.words = match known {
            _ if !plane_moved => way.rise.abs(),
            Some(last) => {
                way.ends = [plane(last), plane(target)];
                let apart = |k: usize| value(target[k] - last[k], NEAR_AXIS_DECIMALS);
                apart(0).hypot(apart(1)).hypot(way.rise)
            }
            // Where nothing is known of the begin the planned path is the best guess.
            None => motion.path,
        };
        if let Some(last) = self.turn.filter(|_| plane_moved && known.is_some()) {
            way.turn = motion.to.turn.radians() - last.radians();
        }
        way
    }

    /// Sets the count of the bed back by whole turns where it has grown too large for the firmware;
    /// done by itself at every [`Step::Layer`].
    ///
    /// # Errors
    ///
    /// What the writer reports.
    pub fn recount(&mut self) -> io::Result<()> {
        let (Some(beyond), Some(turn)) = (self.dialect.recount_beyond, self.turn) else {
            return Ok(());
        };
        let degrees = turn.radians().to_degrees();
        if (degrees - self.recounted * DEGREES_IN_A_TURN).abs() <= beyond {
            return Ok(());
        }
        self.recounted = (degrees / DEGREES_IN_A_TURN).floor();
        self.told = [None; MOST_WORDS];
        let left = quantum(degrees - self.recounted * DEGREES_IN_A_TURN, DEGREE_DECIMALS);
        self.line.extend_from_slice(b"G92");
        for (k, word) in self.dialect.plane.iter().enumerate() {
            if word.quantity == Quantity::Bed {
                self.line.extend_from_slice(&[b' ', word.letter]);
                push_quantum(&mut self.line, left, DEGREE_DECIMALS);
                if let Some(position) = &mut self.position {
                    let places = (NEAR_AXIS_DECIMALS - DEGREE_DECIMALS) as u32;
                    position[k] = left * 10_i64.pow(places);
                }
            }
        }
        self.end_line()
    }

    fn layer(&mut self, layer: &Layer) -> io::Result<()> {
        let top = decimal(layer.top, MM_DECIMALS);
        self.text(";LAYER_CHANGE")?;
        self.text(&format!(";Z:{top}"))?;
        self.layer_height = quantum(layer.height, MM_DECIMALS);
        self.wanted_height = self.layer_height;
        self.told_height = self.layer_height;
        self.text(&format!(";HEIGHT:{}", decimal(layer.height, MM_DECIMALS)))?;
        self.text(&format!(";LAYER:{}", layer.index))?;
        for word in ["BEFORE", "AFTER"] {
            self.text(&format!(";{word}_LAYER_CHANGE"))?;
            self.text(&format!(";{top}"))?;
        }
        self.bead = None;
        self.recount()
    }

    /// Takes note of a thickness, which is told with the next bead.
    fn height(&mut self, height: Option<f64>) {
        self.wanted_height =
            height.map_or(self.layer_height, |height| quantum(height, MM_DECIMALS));
    }

    fn bead(&mut self, role: Role, width: f64) -> io::Result<()> {
        if self.wanted_height != self.told_height {
            self.told_height = self.wanted_height;
            let height = decimal(value(self.told_height, MM_DECIMALS), MM_DECIMALS);
            self.text(&format!(";HEIGHT:{height}"))?;
        }
        let width = quantum(width, 2);
        let (last_role, last_width) = self.bead.unzip();
        if last_role != Some(role) {
            self.text(&format!(";TYPE:{}", role.label()))?;
        }
        if last_width != Some(width) {
            self.text(&format!(";WIDTH:{}", decimal(value(width, 2), 2)))?;
        }
        self.bead = Some((role, width));
        Ok(())
    }

    fn object(&mut self, object: Option<usize>) -> io::Result<()> {
        let Some(labels) = &self.labels else { return Ok(()) };
        let end = self.object.map(|last| labels.end(last));
        let begin = object.map(|next| labels.begin(next));
        if object == self.object {
            return Ok(());
        }
        self.object = object;
        end.into_iter().chain(begin).try_for_each(|line| self.text(&line))
    }

    fn fan(&mut self, share: f64) -> io::Result<()> {
        let speed = quantum(share.clamp(0.0, 1.0) * 255.0, 0);
        if speed == 0 { self.text("M107") } else { self.text(&format!("M106 S{speed}")) }
    }

    fn end_line(&mut self) -> io::Result<()> {
        debug_assert!(self.line.len() <= MOST_COLUMNS);
        self.line.push(b'\n');
        self.out.write_all(&self.line)?;
        self.line.clear();
        self.lines += 1;
        Ok(())
    }
}

/// Returns `text` with everything but printable ASCII replaced: names of files and solids must
/// never end a line or start a command.
#[must_use]
pub fn printable(text: &str) -> String {
    text.chars().map(|c| if c == ' ' || c.is_ascii_graphic() { c } else { '?' }).collect()
}

#[cfg(test)]
mod tests {
    use super::super::dialect::{CARTESIAN, POLAR};
    use super::*;
    use crate::program::{BedTurn, Joints};
    use nalgebra::Point3;

    fn to(s: f64, degrees: f64, z: f64, filament: f64, path: f64) -> Step {
        let turn = BedTurn::accumulated(degrees.to_radians());
        let (sin, cos) = turn.radians().sin_cos();
        Step::Move(Move {
            to: Joints { s, turn, z },
            at: Point3::new(s * cos, s * sin, z),
            filament,
            path,
            duration: if path > 0.0 { path / 25.0 } else { 0.5 },
        })
    }

    fn text(dialect: Dialect, steps: &[Step]) -> String {
        let mut emitter = Emitter::new(Vec::new(), dialect);
        for step in steps {
            emitter.step(step).unwrap();
        }
        String::from_utf8(emitter.finish().unwrap()).unwrap()
    }

    #[test]
    fn a_program_in_both_dialects() {
        let steps = [
            to(10.0, 90.0, 0.2, 0.0, 10.0),
            to(10.0, 90.0, 0.2, 0.8, 0.0),
            Step::Bead(Role::ExternalPerimeter, 0.45),
            to(12.5, 93.123_456, 0.2, 0.031_234_56, 3.0),
            Step::Bead(Role::ExternalPerimeter, 0.452),
            to(1.234_567_8, 453.0, 0.2, 0.1, 3.0),
        ];
        assert_eq!(
            text(POLAR, &steps),
            "G1 R10 T90 Z0.2 F1500\nG1 E0.8 F96\n;TYPE:External perimeter\n;WIDTH:0.45\n\
             G1 R12.5 T93.1235 E0.03123 F1500\nG1 R1.23457 T453 E0.1\n"
        );
        assert_eq!(text(CARTESIAN, &steps).lines().next_back(), Some("G1 X-0.06461 Y1.23288 E0.1"));
    }

    #[test]
    fn rounding_is_made_good_by_later_moves() {
        let steps: Vec<Step> =
            (1..=1000).map(|i| to(10.0 + f64::from(i), 0.0, 1.0, 0.000_013_7, 1.0)).collect();
        let total: f64 = text(POLAR, &steps)
            .lines()
            .filter_map(|line| line.split(" E").nth(1)?.split(' ').next()?.parse::<f64>().ok())
            .sum();
        assert!((total - 0.0137).abs() < 0.51e-5, "{total}");
    }

    #[test]
    fn nothing_from_outside_can_start_a_command() {
        let name = "cube\nM104 S999\r\u{2028}M105 \u{e9}";
        let out = text(POLAR, &[Step::Remark(name.into()), Step::Custom("M104 S200\nM1".into())]);
        assert_eq!(out, "; cube?M104 S999??M105 ?\nM104 S200?M1\n");
        let long = text(POLAR, &[Step::Remark("x".repeat(500))]);
        assert_eq!(long.trim_end().len(), MOST_COLUMNS);
        let blank = text(POLAR, &[Step::Remark(format!("{} {}", "x".repeat(87), "x".repeat(20)))]);
        assert!(blank.ends_with("x\n"), "no blank at the end of a line that is cut: {blank:?}");
    }

    #[test]
    fn a_layer_is_announced_as_viewers_read_it() {
        let out = text(POLAR, &[Step::Layer(Layer { index: 20, top: 4.2, height: 0.2 })]);
        assert_eq!(
            out,
            ";LAYER_CHANGE\n;Z:4.2\n;HEIGHT:0.2\n;LAYER:20\n;BEFORE_LAYER_CHANGE\n;4.2\n\
             ;AFTER_LAYER_CHANGE\n;4.2\n"
        );
    }

    #[test]
    fn a_move_that_rounds_to_nothing_is_left_out() {
        let steps = [to(10.0, 90.0, 0.2, 0.0, 10.0), to(10.000_1, 90.0, 0.2, 0.0, 0.000_1)];
        assert_eq!(text(POLAR, &steps).lines().count(), 1);
    }
}
