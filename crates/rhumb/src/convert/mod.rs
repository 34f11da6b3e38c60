//! Another slicer's program in the words of a polar machine.
//!
//! The source is read line by line, its ways gathered in batches, and each batch planned as our own
//! layers are: cut to the chord tolerance, clear of the axis, at speeds that the axes can keep, with
//! the calibration of the machine in every coordinate. Everything else keeps its place between
//! them. Memory holds one batch, whatever the length of the program.

mod arc;
mod reader;
mod segments;

use std::io::{BufRead, Read, Write};
use std::path::Path;

use machine::gcode::{Emitter, MOST_COLUMNS, printable};
use machine::program::Step;
use nalgebra::{Point2, Point3, Vector2};
use plan::follow::Follower;
use plan::resample::ResampleParams;
use plan::route::{Kind, Stroke};

use crate::failure::Failure;
use crate::interrupt::Interrupt;
use crate::output;
use crate::program_text::duration;
use crate::settings::Job;
use reader::{Meaning, Reader};

pub use segments::{Unreadable, segments};

/// What to convert and how.
pub struct Request<'a> {
    /// What to call the program.
    pub name: &'a str,
    /// The place in the source that becomes the rotation axis, mm.
    pub origin: Vector2<f64>,
    /// The machine and its words.
    pub job: &'a Job,
    /// When the program was made, for its first line.
    pub made_at: &'a str,
}

/// What came of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Converted {
    /// Lines read.
    pub lines: usize,
    /// Lines written.
    pub written: usize,
    /// Filament fed, less what is drawn back, mm.
    pub filament: f64,
    /// Estimated time, s.
    pub time: f64,
    /// Commands left out because no firmware reads lines that long.
    pub left_out: usize,
}

/// Strokes that are planned at once, at least; a batch ends where the nozzle stands still anyhow.
const BATCH: usize = 2048;

/// Strokes after which a batch ends wherever it is.
const LONGEST_BATCH: usize = 1 << 15;

/// Other lines after which a batch ends: a program may have no strokes at all.
const MOST_OTHERS: usize = 1 << 12;

/// Longest line of a source, bytes.
const LONGEST_LINE: u64 = 1 << 20;

/// Share of the chord tolerance for cutting arcs into lines; the lines have the rest.
const ARC_SHARE: f64 = 0.25;

/// Converts a program.
///
/// # Errors
///
/// `GcodeSyntax` for a line that is none, `OutOfEnvelope` for one that leads out of the machine's
/// reach, or what reading and writing report.
pub fn convert(
    request: &Request<'_>,
    mut source: impl BufRead,
    out: &mut dyn Write,
    interrupt: &Interrupt,
) -> Result<Converted, Failure> {
    let mut conversion = Conversion::new(request, out);
    conversion.head(request).map_err(written)?;
    let mut line = Vec::new();
    loop {
        line.clear();
        let count = Read::take(&mut source, LONGEST_LINE)
            .read_until(b'\n', &mut line)
            .map_err(|error| Failure::new("Unreadable", format!("{}: {error}", request.name)))?;
        if count == 0 {
            return conversion.finish();
        }
        conversion.line(&String::from_utf8_lossy(&line))?;
        if conversion.is_full() {
            interrupt.check()?;
            conversion.flush()?;
        }
    }
}

/// Returns the middle of all that a program prints, mm: where a part usually belongs on the axis.
///
/// # Errors
///
/// As [`convert`]; `NothingToPrint` when nothing is printed.
pub fn middle(mut source: impl BufRead, name: &str) -> Result<Vector2<f64>, Failure> {
    let mut reader = Reader::new(Vector2::zeros(), Point3::origin(), 0.1);
    let (mut number, mut line, mut strokes) = (0, Vec::new(), Vec::new());
    let mut bounds: Option<[Point2<f64>; 2]> = None;
    loop {
        line.clear();
        let count = Read::take(&mut source, LONGEST_LINE)
            .read_until(b'\n', &mut line)
            .map_err(|error| Failure::new("Unreadable", format!("{name}: {error}")))?;
        if count == 0 {
            break;
        }
        number += 1;
        let text = String::from_utf8_lossy(&line);
        let (code, _) = without_comment(&text);
        strokes.clear();
        reader.line(&code, &mut strokes).map_err(|error| unreadable(name, number, &error))?;
        for stroke in strokes.iter().filter(|stroke| stroke.kind == Kind::Print) {
            let p = stroke.to.xy();
            let [low, high] = bounds.unwrap_or([p, p]);
            bounds = Some([low.inf(&p), high.sup(&p)]);
        }
    }
    let [low, high] =
        bounds.ok_or_else(|| Failure::new("NothingToPrint", format!("{name} lays no material")))?;
    Ok(nalgebra::center(&low, &high).coords)
}

/// What stands between strokes.
enum Between {
    /// A command of the source.
    Command(String),
    /// The same, which homes the machine.
    Home(String),
    Comment(String),
}

struct Conversion<'a> {
    name: &'a str,
    dialect: &'static str,
    home: Point3<f64>,
    reader: Reader,
    follower: Follower,
    text: Emitter<&'a mut dyn Write>,
    strokes: Vec<Stroke>,
    /// The line of the source that each stroke comes from.
    lines_of: Vec<usize>,
    /// Lines that come before the stroke with this index.
    between: Vec<(usize, Between)>,
    converted: Converted,
}

impl<'a> Conversion<'a> {
    fn new(request: &Request<'a>, out: &'a mut dyn Write) -> Self {
        let job = request.job;
        let home = job.printer.alignment.part_from_joints(&job.printer.home);
        let chord = job.plan.resample.chord;
        let params = ResampleParams { chord: chord * (1.0 - ARC_SHARE), ..job.plan.resample };
        Self {
            name: request.name,
            dialect: job.dialect.name,
            home,
            reader: Reader::new(request.origin, home, chord * ARC_SHARE),
            follower: Follower::new(&job.printer, params),
            text: Emitter::for_printer(out, job.dialect, &job.printer),
            strokes: Vec::with_capacity(BATCH),
            lines_of: Vec::with_capacity(BATCH),
            between: Vec::new(),
            converted: Converted::default(),
        }
    }

    fn head(&mut self, request: &Request<'_>) -> std::io::Result<()> {
        let version = env!("CARGO_PKG_VERSION");
        self.text.comment(&format!("generated by rhumb {version} on {}", request.made_at))?;
        let name: String = printable(request.name).chars().take(60).collect();
        self.text.comment(&format!("converted from {name}"))?;
        ["G21", "G90", "M83"].iter().try_for_each(|line| self.text.text(line))
    }

    fn line(&mut self, text: &str) -> Result<(), Failure> {
        self.converted.lines += 1;
        let number = self.converted.lines;
        let (code, comment) = without_comment(text);
        if !code.trim().is_empty() {
            let first = self.strokes.len();
            let meaning = self
                .reader
                .line(&code, &mut self.strokes)
                .map_err(|error| unreadable(self.name, number, &error))?;
            self.lines_of.resize(self.strokes.len(), number);
            match meaning {
                Meaning::Motion | Meaning::Absorbed => {}
                Meaning::Other(line) => {
                    self.between.push((first, Between::Command(line.to_owned())));
                }
                Meaning::Home(line) => {
                    self.between.push((first, Between::Home(line.to_owned())));
                    self.flush()?;
                }
            }
        }
        // Remarks on single moves have no place where moves are cut to pieces, and what the source
        // estimated is not true of this machine.
        let is_kept = |comment: &String| {
            code.trim().is_empty() && !comment.contains("estimated printing time")
        };
        if let Some(comment) = comment.filter(is_kept) {
            self.between.push((self.strokes.len(), Between::Comment(comment)));
        }
        Ok(())
    }

    fn is_full(&self) -> bool {
        let rests = self.strokes.last().is_some_and(|stroke| stroke.kind == Kind::Filament);
        self.strokes.len() >= LONGEST_BATCH
            || self.strokes.len() >= BATCH && rests
            || self.between.len() >= MOST_OTHERS
    }

    /// Plans and writes the batch.
    fn flush(&mut self) -> Result<(), Failure> {
        let groups = self.follower.follow(&self.strokes).map_err(|error| {
            let line = self.lines_of[error.stroke];
            Failure::new("OutOfEnvelope", format!("{}, line {line}: {error}", self.name))
                .hint("say with --origin X,Y which place of the bed is the axis, or --origin auto")
        })?;
        let between = std::mem::take(&mut self.between);
        let mut others = between.into_iter().peekable();
        for (index, moves) in groups.iter().enumerate() {
            while let Some((_, other)) = others.next_if(|(before, _)| *before <= index) {
                self.other(other)?;
            }
            for motion in moves {
                self.converted.filament += motion.filament;
                self.text.step(&Step::Move(*motion)).map_err(written)?;
            }
        }
        for (_, other) in others {
            self.other(other)?;
        }
        self.strokes.clear();
        self.lines_of.clear();
        Ok(())
    }

    fn other(&mut self, other: Between) -> Result<(), Failure> {
        match other {
            Between::Comment(comment) => {
                self.text.text(&format!(";{comment}")).map_err(written)?;
                if comment == "LAYER_CHANGE" || comment.starts_with("LAYER:") {
                    self.text.recount().map_err(written)?;
                }
                Ok(())
            }
            // Cut short it would be another command.
            Between::Command(line) if line.len() > MOST_COLUMNS || !line.is_ascii() => {
                self.converted.left_out += 1;
                let start: String = line.chars().take(40).collect();
                self.text.comment(&format!("left out: {start}...")).map_err(written)
            }
            Between::Command(line) => self.text.step(&Step::Custom(line)).map_err(written),
            Between::Home(line) => {
                self.text.step(&Step::Custom(line)).map_err(written)?;
                self.reader.homed(self.home);
                self.follower.homed();
                Ok(())
            }
        }
    }

    fn finish(mut self) -> Result<Converted, Failure> {
        self.flush()?;
        self.converted.time = self.follower.time();
        let time = duration(self.converted.time);
        self.text
            .comment(&format!("estimated printing time (normal mode) = {time}"))
            .and_then(|()| self.text.comment(&format!("dialect = {}", self.dialect)))
            .map_err(written)?;
        self.converted.written = self.text.lines();
        self.text.finish().map_err(written)?;
        Ok(self.converted)
    }
}

#[expect(clippy::needless_pass_by_value, reason = "the shape that map_err calls")]
fn written(error: std::io::Error) -> Failure {
    output::failed(Path::new("program"), &error)
}

fn unreadable(name: &str, line: usize, error: &reader::ReadError) -> Failure {
    Failure::new("GcodeSyntax", format!("{name}, line {line}: {error}"))
}

/// Takes a line apart: what comes before `;` or stands outside of brackets, and the rest.
fn without_comment(line: &str) -> (String, Option<String>) {
    let line = line.trim_end();
    let (code, comment) = match line.split_once(';') {
        Some((code, comment)) => (code, Some(comment.to_owned())),
        None => (line, None),
    };
    // A message may have brackets of its own.
    let is_words = code.trim_start().starts_with(['G', 'g', 'N', 'n', 'X', 'Y', 'Z', '(']);
    let Some((before, rest)) = code.split_once('(').filter(|_| is_words) else {
        return (code.to_owned(), comment);
    };
    let (inside, after) = rest.split_once(')').unwrap_or((rest, ""));
    (format!("{before} {after}"), comment.or_else(|| Some(format!(" {inside}"))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_kinds_of_comments() {
        let taken = |line: &str| {
            let (code, comment) = without_comment(line);
            (code.trim().to_owned(), comment)
        };
        let some = |text: &str| Some(text.to_owned());
        assert_eq!(taken("G1 X5 ; right\r\n"), ("G1 X5".into(), some(" right")));
        assert_eq!(taken("G1 (right) X5\n"), ("G1   X5".into(), some(" right")));
        assert_eq!(taken("(only)"), (String::new(), some(" only")));
        assert_eq!(taken("M117 a (b)"), ("M117 a (b)".into(), None));
        assert_eq!(taken(";TYPE:Perimeter"), (String::new(), some("TYPE:Perimeter")));
    }
}
