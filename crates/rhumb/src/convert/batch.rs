//! The source, gathered into batches that are planned at once.

use std::io::BufRead;

use machine::program::Layer;
use nalgebra::Point3;
use plan::route::{Kind, Stroke};

use super::Request;
use super::comment::{leaves_bracket_open, without_comment};
use super::concern::Concern;
use super::layers::Layers;
use super::line::{Line, begin};
use super::reader::{Meaning, ReadError, Reader, commands};
use super::watch::Watch;
use crate::failure::Failure;

/// Strokes that are planned at once, at least; a batch ends where the nozzle stands still anyhow.
const BATCH: usize = 2048;

/// Strokes after which a batch ends wherever it is.
const LONGEST_BATCH: usize = 1 << 15;

/// Other lines after which a batch ends: a program may have no strokes at all.
const MOST_OTHERS: usize = 1 << 12;

/// Bytes of other lines after which a batch ends: each may be long.
const MOST_BYTES: usize = 1 << 20;

/// What stands between strokes.
#[derive(Debug)]
pub(super) enum Between {
    /// A command of the source.
    Command(String),
    /// One that is left out, because it would change the machine for good.
    Refused(String),
    /// A command that homes the machine; the batch ends with it.
    Home(String),
    /// What follows a `;`.
    Comment(String),
    /// The begin of a layer of a source that does not say where it lies.
    Layer(Layer),
}

/// A piece of the source.
#[derive(Debug, Default)]
pub(super) struct Batch {
    /// Where the nozzle is to go.
    pub(super) strokes: Vec<Stroke>,
    /// The line of the source that each stroke comes from.
    pub(super) lines_of: Vec<usize>,
    /// Lines that come before the stroke with this index.
    pub(super) between: Vec<(usize, Between)>,
    /// Lines of the source up to the end of this batch.
    pub(super) lines: usize,
    /// Bytes that the lines between strokes hold.
    bytes: usize,
    /// What a user should know; in the last batch alone.
    pub(super) concerns: Vec<Concern>,
}

/// Reads a source batch by batch.
pub(super) struct Batches<'a, R> {
    source: R,
    name: &'a str,
    home: Point3<f64>,
    reader: Reader,
    layers: Layers,
    watch: Watch,
    line: Line,
    /// Commands of the line that are in the batch before this one.
    taken: usize,
    has_begun: bool,
    is_done: bool,
}

impl<'a, R: BufRead> Batches<'a, R> {
    /// Returns the batches of a source; arcs become lines that stay within `arc_tolerance`.
    pub(super) fn new(source: R, request: &Request<'a>, arc_tolerance: f64) -> Self {
        let (job, origin) = (request.job, request.origin);
        let printer = &job.printer;
        let home = printer.alignment.part_from_joints(&printer.home);
        Self {
            source,
            name: request.name,
            home,
            reader: Reader::new(origin, home, arc_tolerance),
            layers: Layers::default(),
            watch: Watch::new(printer, job.plan.filament.area, request.keeps_dangerous),
            line: Line::default(),
            taken: 0,
            has_begun: false,
            is_done: false,
        }
    }

    /// Returns the next batch; `None` after the last.
    ///
    /// # Errors
    ///
    /// `EmptyFile`, `WrongFormat` or `Encoding` for what is no program, `GcodeSyntax` for a line that is
    /// none, `GcodeUnsupported` for a motion that has no polar form, `OutOfEnvelope` for too much heat,
    /// `Unreadable` when reading fails.
    pub(super) fn next(&mut self) -> Result<Option<Batch>, Failure> {
        if !std::mem::replace(&mut self.has_begun, true) {
            begin(&mut self.source, self.name)?;
        }
        let mut batch = Batch::default();
        while !self.is_done {
            if self.taken == 0 {
                self.is_done = !self.line.read(&mut self.source, self.name)?;
            }
            let goes_home = !self.is_done && self.take(&mut batch)?;
            if self.is_done || goes_home || self.is_full(&batch) {
                self.layers.give_up();
                batch.lines = self.line.number();
                if self.is_done {
                    batch.concerns = self.watch.concerns();
                }
                return Ok(Some(batch));
            }
        }
        Ok(None)
    }

    /// Takes the line just read into the batch, or what is left of it; returns whether the machine is homed
    /// by it, and leaves what follows that.
    fn take(&mut self, batch: &mut Batch) -> Result<bool, Failure> {
        let text = self.line.text();
        let number = self.line.number();
        let (code, comment) = without_comment(&text);
        if self.taken == 0 && leaves_bracket_open(&text) {
            self.watch.open_bracket(&text, number);
        }
        let mut is_alone = true;
        let fault = |error: &ReadError| unreadable(self.name, number, error);
        let mut left = commands(&code).map_err(|error| fault(&error))?.enumerate().peekable();
        let mut goes_home = false;
        while let Some((k, command)) = left.next() {
            is_alone = false;
            if k < self.taken {
                continue;
            }
            let (first, from) = (batch.strokes.len(), self.reader.at());
            if self.watch.is_on_card() {
                self.watch.other(command, number).map_err(|error| fault(&error))?;
                continue;
            }
            let meaning =
                self.reader.line(command, &mut batch.strokes).map_err(|error| fault(&error))?;
            batch.lines_of.resize(batch.strokes.len(), number);
            match meaning {
                Meaning::Motion => {
                    let new = &batch.strokes[first..];
                    self.watch.moved(from, new, self.reader.has_speed(), (command, number));
                    if let Some(stroke) = laid(new) {
                        self.layers.laid(stroke.to.z, &mut batch.between);
                    }
                }
                Meaning::Absorbed => {}
                Meaning::Other(line) => {
                    let goes_over =
                        self.watch.other(line, number).map_err(|error| fault(&error))?;
                    let line = line.to_owned();
                    batch.bytes += line.len();
                    let kind = if goes_over { Between::Command } else { Between::Refused };
                    batch.between.push((first, kind(line)));
                }
                Meaning::Home(line) => {
                    self.watch.home(line, number);
                    batch.between.push((first, Between::Home(line.to_owned())));
                    self.reader.homed(self.home);
                    if left.peek().is_some() {
                        self.taken = k + 1;
                        return Ok(true);
                    }
                    goes_home = true;
                }
            }
        }
        self.taken = 0;
        // Remarks on single moves have no place where moves are cut to pieces, and what the source
        // estimated is not true of this machine.
        let kept = comment.filter(|comment| is_alone && !is_estimate(comment));
        if let Some(comment) = kept {
            self.watch.comment(&comment, number);
            if !self.layers.comment(&comment, batch.strokes.len(), &mut batch.between) {
                batch.bytes += comment.len();
                batch.between.push((batch.strokes.len(), Between::Comment(comment.into_owned())));
            }
        }
        Ok(goes_home)
    }

    fn is_full(&self, batch: &Batch) -> bool {
        let rests = batch.strokes.last().is_some_and(|stroke| stroke.kind == Kind::Filament);
        batch.strokes.len() >= LONGEST_BATCH
            || batch.strokes.len() >= BATCH && rests && !self.layers.is_open()
            || batch.between.len() >= MOST_OTHERS
            || batch.bytes >= MOST_BYTES
    }
}

fn laid(strokes: &[Stroke]) -> Option<&Stroke> {
    strokes.iter().find(|stroke| stroke.kind == Kind::Print)
}

fn is_estimate(comment: &str) -> bool {
    comment.contains("estimated printing time")
        || comment.contains("estimated first layer printing time")
        || comment.starts_with("TIME:")
        || comment.starts_with("TIME_ELAPSED:")
}

/// Says which line is none.
pub(super) fn unreadable(name: &str, line: usize, error: &ReadError) -> Failure {
    Failure::new(error.class(), format!("{name}, line {line}: {error}"))
}
