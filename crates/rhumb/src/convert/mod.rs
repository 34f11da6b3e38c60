//! Another slicer's program in the words of a polar machine.
//!
//! The source is read line by line, its ways gathered in batches, and each batch planned as our own
//! layers are: cut to the chord tolerance, clear of the axis, at speeds that the axes can keep, with
//! the calibration of the machine in every coordinate. Everything else keeps its place between
//! them. Reading, planning and writing run side by side, a few batches apart, and the bytes are the
//! same whichever is faster. Memory holds these batches, whatever the length of the program.

mod arc;
mod batch;
mod comment;
mod concern;
mod layers;
mod line;
mod middle;
mod order;
mod reader;
mod segments;
mod tee;
mod watch;

use std::io::{BufRead, Write};
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use machine::gcode::{Emitter, MOST_COLUMNS, printable};
use machine::program::Step;
use nalgebra::Vector2;
use plan::follow::{Followed, Follower};
use plan::resample::ResampleParams;
use plan::slow_flow::{FlowWatch, SlowFlow};
use twin::verify::Verdict;

use crate::check::check;
use crate::failure::Failure;
use crate::interrupt::Interrupt;
use crate::output;
use crate::program_text::duration;
use crate::settings::Job;
use batch::{Batch, Batches, Between};
pub use concern::Concern;
pub use middle::middle;
use tee::{Chunks, Tee};

pub use segments::{Unreadable, segments};

/// What to convert and how.
pub struct Request<'a> {
    /// What to call the program.
    pub name: &'a str,
    /// The place in the source that becomes the rotation axis, mm.
    pub origin: Vector2<f64>,
    /// The machine and its words.
    pub job: &'a Job,
    /// Whether commands that change the machine for good go over.
    pub keeps_dangerous: bool,
    /// When the program was made, for its first line.
    pub made_at: &'a str,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq, Default)]
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
    /// What is laid with less flow than the filament should have.
    pub slow_flow: SlowFlow,
    /// What a user should know of the source, in the order of its lines.
    pub concerns: Vec<Concern>,
}

/// Batches on their way from one part of the work to the next.
const BATCHES_AHEAD: usize = 4;

/// Share of the chord tolerance for cutting arcs into lines; the lines have the rest.
const ARC_SHARE: f64 = 0.25;

/// Converts a program.
///
/// # Errors
///
/// `EmptyFile`, `WrongFormat` or `Encoding` for what is no program, `GcodeSyntax` for a line that is
/// none, `GcodeUnsupported` for a motion that has no polar form, `OutOfEnvelope` for one that leads out
/// of the machine's reach or heats too much, or what reading and writing report.
pub fn convert(
    request: &Request<'_>,
    source: impl BufRead + Send,
    out: &mut dyn Write,
    interrupt: &Interrupt,
) -> Result<Converted, Failure> {
    let job = request.job;
    if job.printer.head.is_some() {
        return Err(Failure::new(
            "ConfigConflict",
            "programs of other slicers are for a nozzle on a carriage, and this printer's is on legs",
        )
        .hint("--set head=fixed, where a carriage can move the nozzle without its legs"));
    }
    let chord = job.plan.resample.chord;
    let mut batches = Batches::new(source, request, chord * ARC_SHARE);
    let mut planning = Planning::new(request, chord * (1.0 - ARC_SHARE));
    let mut writing = Writing::new(request, out);
    writing.head(request).map_err(written)?;
    thread::scope(|scope| {
        let (to_plan, batches_read) = sync_channel(BATCHES_AHEAD);
        let (to_write, batches_planned) = sync_channel(BATCHES_AHEAD);
        start(scope, move || read(&mut batches, &to_plan, interrupt))?;
        start(scope, move || planning.run(&batches_read, &to_write))?;
        for planned in batches_planned {
            writing.batch(planned?)?;
        }
        writing.finish()
    })
}

/// Converts a program, and proves what is written on a model of the machine while it is written.
///
/// # Errors
///
/// As [`convert`].
pub fn convert_checked(
    request: &Request<'_>,
    source: impl BufRead + Send,
    out: &mut dyn Write,
    interrupt: &Interrupt,
) -> Result<(Converted, Verdict), Failure> {
    thread::scope(|scope| {
        let (sender, receiver) = sync_channel(BATCHES_AHEAD);
        let job = request.job;
        let verdict = start(scope, move || check(Chunks::new(receiver), job, None, false, |_| {}))?;
        let mut tee = Tee::new(out, sender);
        let converted = convert(request, source, &mut tee, interrupt);
        drop(tee);
        let verdict = verdict.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        Ok((converted?, verdict?))
    })
}

/// Starts a thread; a system may allow no more of them.
fn start<'scope, T: Send + 'scope>(
    scope: &'scope thread::Scope<'scope, '_>,
    work: impl FnOnce() -> T + Send + 'scope,
) -> Result<thread::ScopedJoinHandle<'scope, T>, Failure> {
    thread::Builder::new().spawn_scoped(scope, work).map_err(|error| {
        Failure::new("LimitExceeded", format!("the system starts no more threads: {error}"))
    })
}

/// Reads batches until the source ends, or whoever plans them has stopped.
fn read<R: BufRead>(
    batches: &mut Batches<'_, R>,
    to_plan: &SyncSender<Result<Batch, Failure>>,
    interrupt: &Interrupt,
) {
    loop {
        let next = interrupt.check().and_then(|()| batches.next());
        let Some(message) = next.transpose() else { return };
        let is_last = message.is_err();
        if to_plan.send(message).is_err() || is_last {
            return;
        }
    }
}

/// A batch with its moves.
struct Planned {
    batch: Batch,
    followed: Followed,
    /// The time estimated so far, s.
    time: f64,
}

struct Planning {
    name: String,
    follower: Follower,
}

impl Planning {
    fn new(request: &Request<'_>, chord: f64) -> Self {
        let job = request.job;
        let params = ResampleParams { chord, ..job.plan.resample };
        Self { name: request.name.to_owned(), follower: Follower::new(&job.printer, params) }
    }

    /// Plans batches until none comes, one cannot be planned, or whoever writes them has stopped.
    fn run(
        &mut self,
        batches: &Receiver<Result<Batch, Failure>>,
        to_write: &SyncSender<Result<Planned, Failure>>,
    ) {
        for batch in batches {
            let planned = batch.and_then(|batch| self.plan(batch));
            let is_last = planned.is_err();
            if to_write.send(planned).is_err() || is_last {
                return;
            }
        }
    }

    fn plan(&mut self, batch: Batch) -> Result<Planned, Failure> {
        let followed = self.follower.follow(&batch.strokes).map_err(|error| {
            let line = batch.lines_of[error.stroke];
            Failure::new("OutOfEnvelope", format!("{}, line {line}: {error}", self.name))
                .hint("say with --origin X,Y which place of the bed is the axis, or --origin auto")
        })?;
        if batch.between.iter().any(|(_, between)| matches!(between, Between::Home(_))) {
            self.follower.homed();
        }
        Ok(Planned { batch, followed, time: self.follower.time() })
    }
}

struct Writing<'a> {
    dialect: &'static str,
    text: Emitter<&'a mut dyn Write>,
    converted: Converted,
    flow: FlowWatch,
}

impl<'a> Writing<'a> {
    fn new(request: &Request<'_>, out: &'a mut dyn Write) -> Self {
        let job = request.job;
        Self {
            dialect: job.dialect.name,
            text: Emitter::for_printer(out, job.dialect, &job.printer),
            converted: Converted::default(),
            flow: FlowWatch::new(job.plan.filament.least_flow, job.plan.filament.area),
        }
    }

    fn head(&mut self, request: &Request<'_>) -> std::io::Result<()> {
        let version = env!("CARGO_PKG_VERSION");
        self.text.comment(&format!("generated by rhumb {version} on {}", request.made_at))?;
        let name: String = printable(request.name).chars().take(60).collect();
        self.text.comment(&format!("{}{name}", twin::verify::CONVERTED_FROM))?;
        ["G21", "G90", "M83"].iter().try_for_each(|line| self.text.text(line))
    }

    fn batch(&mut self, planned: Planned) -> Result<(), Failure> {
        let Planned { batch, followed, time } = planned;
        let mut others = batch.between.into_iter().peekable();
        let mut moves = followed.moves();
        for (index, &count) in followed.counts.iter().enumerate() {
            while let Some((_, other)) = others.next_if(|(before, _)| *before <= index) {
                self.other(other)?;
            }
            for motion in moves.by_ref().take(count) {
                self.converted.filament += motion.filament;
                self.flow.look(&motion);
                self.text.step(&Step::Move(motion)).map_err(written)?;
            }
        }
        for (_, other) in others {
            self.other(other)?;
        }
        self.converted.lines = batch.lines;
        self.converted.concerns.extend(batch.concerns);
        self.converted.time = time;
        // The machine stands still here; not every source says where its layers begin.
        self.text.recount().map_err(written)
    }

    fn other(&mut self, other: Between) -> Result<(), Failure> {
        match other {
            Between::Comment(comment) => {
                self.text.text(&format!(";{comment}")).map_err(written)?;
                if comment == "LAYER_CHANGE" {
                    self.text.recount().map_err(written)?;
                }
                Ok(())
            }
            Between::Layer(layer) => self.text.step(&Step::Layer(layer)).map_err(written),
            Between::Refused(line) => {
                let start: String = line.chars().take(40).collect();
                self.text.comment(&format!("left out: {start}")).map_err(written)
            }
            // Cut short it would be another command.
            Between::Command(line) if line.len() > MOST_COLUMNS || !line.is_ascii() => {
                self.converted.left_out += 1;
                let start: String = line.chars().take(40).collect();
                self.text.comment(&format!("left out: {start}...")).map_err(written)
            }
            // What terminals obey is no part of a message.
            Between::Command(line) | Between::Home(line) => {
                self.text.step(&Step::Custom(printable(&line))).map_err(written)
            }
        }
    }

    fn finish(mut self) -> Result<Converted, Failure> {
        let time = duration(self.converted.time);
        self.text
            .comment(&format!("estimated printing time (normal mode) = {time}"))
            .and_then(|()| self.text.comment(&format!("dialect = {}", self.dialect)))
            .map_err(written)?;
        self.converted.written = self.text.lines();
        self.converted.slow_flow = self.flow.found();
        self.text.finish().map_err(written)?;
        Ok(self.converted)
    }
}

#[expect(clippy::needless_pass_by_value, reason = "the shape that map_err calls")]
fn written(error: std::io::Error) -> Failure {
    output::failed(Path::new("program"), &error)
}
