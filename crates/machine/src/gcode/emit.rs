//! The only place that writes programs as text.
//!
//! Promises, whatever comes in: one command a line, at most [`MOST_COLUMNS`] characters, printable
//! ASCII, shortest decimal numbers, every motion a `G1`, the plane's two words always together,
//! `F` positive. Filament is relative (`M83`); what rounding takes from one move is given to the
//! next, so that the sum is right to half a last place.

use std::io::{self, Write};

use super::dialect::{Dialect, MM_DECIMALS, NEAR_AXIS_DECIMALS};
use super::number::{decimal, push_quantum, quantum, value};
use crate::program::{Layer, Move, Role, Step};

/// Longest line, in characters. Marlin's command buffer holds 96.
pub const MOST_COLUMNS: usize = 90;

/// Decimal places of `E`: 10 nm of filament.
const FILAMENT_DECIMALS: usize = 5;

/// Decimal places of `F`.
const FEED_DECIMALS: usize = 1;

/// Writes the steps of a program to `W` in the words of a dialect.
pub struct Emitter<W> {
    out: W,
    dialect: Dialect,
    line: Vec<u8>,
    /// The last plane words and z written, in units of the finest last place.
    position: Option<[i64; 3]>,
    feed: i64,
    /// Filament that rounding has kept back so far, mm.
    filament_owed: f64,
    bead: Option<(Role, i64)>,
    lines: usize,
}

impl<W: Write> Emitter<W> {
    /// Returns an emitter that has written nothing yet.
    pub fn new(out: W, dialect: Dialect) -> Self {
        Self {
            out,
            dialect,
            line: Vec::with_capacity(MOST_COLUMNS),
            position: None,
            feed: 0,
            filament_owed: 0.0,
            bead: None,
            lines: 0,
        }
    }

    /// Writes one step.
    ///
    /// # Errors
    ///
    /// What the writer reports.
    pub fn step(&mut self, step: &Step) -> io::Result<()> {
        match step {
            Step::Move(motion) => self.motion(motion),
            Step::Layer(layer) => self.layer(layer),
            Step::Bead(role, width) => self.bead(*role, *width),
            Step::Fan(share) => self.fan(*share),
            Step::Remark(text) => self.comment(text),
            Step::Custom(line) => self.text(line),
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
        self.line.extend(line.trim_end().bytes().take(MOST_COLUMNS));
        self.end_line()
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

    fn motion(&mut self, motion: &Move) -> io::Result<()> {
        let decimals = self.dialect.decimals(motion);
        let plane = self.dialect.plane_values(&motion.to, &motion.at);
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
        self.line.extend_from_slice(b"G1");
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
        if filament != 0 {
            self.line.extend_from_slice(b" E");
            push_quantum(&mut self.line, filament, FILAMENT_DECIMALS);
        }
        // Rounded down, so that a limit stays a limit; never to nothing. What is a whole number but
        // for its last bits stays one.
        let feed = (motion.feed().word() * 10.0 + 1e-3).floor().max(1.0) as i64;
        if feed != self.feed {
            self.line.extend_from_slice(b" F");
            push_quantum(&mut self.line, feed, FEED_DECIMALS);
            self.feed = feed;
        }
        if plane_moved {
            self.position = Some(target);
        } else if let Some(position) = &mut self.position {
            position[2] = z;
        } else {
            // Nothing is known of the plane yet: no later move may take it for granted.
            self.position = Some([i64::MIN, i64::MIN, z]);
        }
        self.end_line()
    }

    fn layer(&mut self, layer: &Layer) -> io::Result<()> {
        let top = decimal(layer.top, MM_DECIMALS);
        self.text(";LAYER_CHANGE")?;
        self.text(&format!(";Z:{top}"))?;
        self.text(&format!(";HEIGHT:{}", decimal(layer.height, MM_DECIMALS)))?;
        self.text(&format!(";LAYER:{}", layer.index))?;
        for word in ["BEFORE", "AFTER"] {
            self.text(&format!(";{word}_LAYER_CHANGE"))?;
            self.text(&format!(";{top}"))?;
        }
        self.bead = None;
        Ok(())
    }

    fn bead(&mut self, role: Role, width: f64) -> io::Result<()> {
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
