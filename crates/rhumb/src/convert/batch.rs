//! The source, gathered into batches that are planned at once.

use std::borrow::Cow;
use std::io::{BufRead, Read};

use machine::program::Layer;
use nalgebra::{Point3, Vector2};
use plan::route::{Kind, Stroke};

use super::comment::without_comment;
use super::layers::Layers;
use super::reader::{Meaning, ReadError, Reader, commands};
use crate::failure::Failure;

/// Strokes that are planned at once, at least; a batch ends where the nozzle stands still anyhow.
const BATCH: usize = 2048;

/// Strokes after which a batch ends wherever it is.
const LONGEST_BATCH: usize = 1 << 15;

/// Other lines after which a batch ends: a program may have no strokes at all.
const MOST_OTHERS: usize = 1 << 12;

/// Longest line of a source, bytes.
const LONGEST_LINE: u64 = 1 << 20;

/// What stands between strokes.
#[derive(Debug)]
pub(super) enum Between {
    /// A command of the source.
    Command(String),
    /// The same, which homes the machine; the batch ends with it.
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
}

/// A line of a source.
#[derive(Debug, Default)]
pub(super) struct Line {
    bytes: Vec<u8>,
    /// Counted from 1.
    number: usize,
}

impl Line {
    /// Reads the next line; returns whether there is one.
    pub(super) fn read(&mut self, source: &mut impl BufRead, name: &str) -> Result<bool, Failure> {
        self.bytes.clear();
        let count = Read::take(source, LONGEST_LINE)
            .read_until(b'\n', &mut self.bytes)
            .map_err(|error| Failure::new("Unreadable", format!("{name}: {error}")))?;
        self.number += usize::from(count > 0);
        Ok(count > 0)
    }

    pub(super) fn text(&self) -> Cow<'_, str> {
        String::from_utf8_lossy(&self.bytes)
    }

    pub(super) fn number(&self) -> usize {
        self.number
    }
}

/// Reads a source batch by batch.
pub(super) struct Batches<'a, R> {
    source: R,
    name: &'a str,
    home: Point3<f64>,
    reader: Reader,
    layers: Layers,
    line: Line,
    is_done: bool,
}

impl<'a, R: BufRead> Batches<'a, R> {
    pub(super) fn new(
        source: R,
        name: &'a str,
        origin: Vector2<f64>,
        home: Point3<f64>,
        arc_tolerance: f64,
    ) -> Self {
        Self {
            source,
            name,
            home,
            reader: Reader::new(origin, home, arc_tolerance),
            layers: Layers::default(),
            line: Line::default(),
            is_done: false,
        }
    }

    /// Returns the next batch; `None` after the last.
    ///
    /// # Errors
    ///
    /// `GcodeSyntax` for a line that is none, `Unreadable` when reading fails.
    pub(super) fn next(&mut self) -> Result<Option<Batch>, Failure> {
        let mut batch = Batch::default();
        while !self.is_done {
            self.is_done = !self.line.read(&mut self.source, self.name)?;
            let goes_home = !self.is_done && self.take(&mut batch)?;
            if self.is_done || goes_home || self.is_full(&batch) {
                self.layers.give_up();
                batch.lines = self.line.number;
                return Ok(Some(batch));
            }
        }
        Ok(None)
    }

    /// Takes the line just read into the batch; returns whether the machine is homed by it.
    fn take(&mut self, batch: &mut Batch) -> Result<bool, Failure> {
        let text = self.line.text();
        let (code, comment) = without_comment(&text);
        let mut goes_home = false;
        let mut is_alone = true;
        let fault = |error: &ReadError| unreadable(self.name, self.line.number, error);
        for command in commands(&code).map_err(|error| fault(&error))? {
            is_alone = false;
            let first = batch.strokes.len();
            let meaning =
                self.reader.line(command, &mut batch.strokes).map_err(|error| fault(&error))?;
            batch.lines_of.resize(batch.strokes.len(), self.line.number);
            match meaning {
                Meaning::Motion => {
                    if let Some(stroke) = laid(&batch.strokes[first..]) {
                        self.layers.laid(stroke.to.z, &mut batch.between);
                    }
                }
                Meaning::Absorbed => {}
                Meaning::Other(line) => {
                    batch.between.push((first, Between::Command(line.to_owned())));
                }
                Meaning::Home(line) => {
                    batch.between.push((first, Between::Home(line.to_owned())));
                    self.reader.homed(self.home);
                    goes_home = true;
                }
            }
        }
        // Remarks on single moves have no place where moves are cut to pieces, and what the source
        // estimated is not true of this machine.
        let kept = comment.filter(|comment| is_alone && !is_estimate(comment));
        if let Some(comment) = kept
            && !self.layers.comment(&comment, batch.strokes.len(), &mut batch.between)
        {
            batch.between.push((batch.strokes.len(), Between::Comment(comment.into_owned())));
        }
        Ok(goes_home)
    }

    fn is_full(&self, batch: &Batch) -> bool {
        let rests = batch.strokes.last().is_some_and(|stroke| stroke.kind == Kind::Filament);
        batch.strokes.len() >= LONGEST_BATCH
            || batch.strokes.len() >= BATCH && rests && !self.layers.is_open()
            || batch.between.len() >= MOST_OTHERS
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
    Failure::new("GcodeSyntax", format!("{name}, line {line}: {error}"))
}
