//! `rhumb steps`: the pulses that make the motors run a program.

use std::fmt::Write as _;
use std::io::{BufWriter, Write};
use std::path::Path;

use machine::gcode::decimal;
use twin::picture::step_map::StepMap;
use twin::steps::binary::Binary;
use twin::steps::port::{Port, Sequence};
use twin::steps::program::{NoJoints, Step, Stepper};
use twin::steps::report::Report;
use twin::steps::{Axes, Interval, MOST_AXES, csv, table};

use super::verify::{job_of, read_program};
use super::{DONE, say, say_json, write_file};
use crate::args::{Manner, PhaseSequence, SettingsArguments, Steps};
use crate::check::each_line;
use crate::failure::Failure;
use crate::output::{self, Output};
use crate::program_text::duration;
use crate::settings::Job;

pub(super) fn run(arguments: &Steps, manner: &Manner) -> Result<u8, Failure> {
    let format = arguments.output.as_deref().map(Format::of).transpose()?;
    let source = Source::read(arguments)?;
    if let (Source::Table(..), Some(path)) = (&source, &arguments.picture) {
        let what = format!("{}: a table of points has no bed to draw", path.display());
        return Err(Failure::new("Usage", what));
    }
    let axes = source.axes(arguments, format);
    let inputs: Vec<&Path> = arguments.program.as_deref().into_iter().collect();
    let mut tally = Tally::new(&source, &axes, arguments.picture.is_some());
    if let (Some(format), Some(path)) = (format, arguments.output.as_deref()) {
        let mut file = Output::create(path, &inputs)?;
        let out = BufWriter::with_capacity(1 << 16, file.file());
        let written = |error| output::failed(path, &error);
        let start = source.start(&axes)?;
        let mut sink = Sink::new(format, out, &axes, start, arguments).map_err(written)?;
        // The first fault of the writer; what comes after it does not matter.
        let mut fault = None;
        source.each(&axes, |interval, step| {
            tally.add(interval, step);
            if fault.is_none() {
                fault = sink.interval(interval).err();
            }
        })?;
        fault.map_or_else(|| sink.finish(), Err).map_err(written)?;
        file.commit()?;
    } else {
        source.each(&axes, |interval, step| tally.add(interval, step))?;
    }
    if let (Some(map), Some(path)) = (&tally.map, &arguments.picture) {
        write_file(path, &inputs, map.draw().as_bytes())?;
    }
    if arguments.output.as_deref() != Some(Path::new("-")) {
        tell(&tally, manner)?;
    }
    Ok(DONE)
}

/// What all intervals come to.
struct Tally {
    axes: Axes,
    report: Report,
    map: Option<StepMap>,
}

impl Tally {
    fn new(source: &Source, axes: &Axes, draws: bool) -> Self {
        let map = match source {
            Source::Program(_, job) if draws => {
                Some(StepMap::new(*axes, job.printer.alignment, job.printer.rail.max))
            }
            _ => None,
        };
        Self { axes: *axes, report: Report::default(), map }
    }

    fn add(&mut self, interval: &Interval, step: Option<&Step>) {
        self.report.add(interval, &self.axes);
        if let (Some(map), Some(step)) = (&mut self.map, step) {
            map.add(step);
        }
    }
}

/// What is turned into pulses.
enum Source {
    Program(Vec<u8>, Box<Job>),
    Table(Vec<table::Point>, Box<Job>),
}

impl Source {
    fn read(arguments: &Steps) -> Result<Self, Failure> {
        let Some(path) = &arguments.program else {
            let defaults = SettingsArguments {
                printer: arguments.settings.printer.clone().or(Some("dsh-4-6b".into())),
                ..arguments.settings.clone()
            };
            return Self::table(table::EXAMPLE.as_bytes(), &defaults);
        };
        let bytes = read_program(path)?;
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv")) {
            return Self::table(&bytes, &arguments.settings);
        }
        let job = job_of(&bytes, &arguments.settings)?;
        Ok(Self::Program(bytes, Box::new(job)))
    }

    fn table(bytes: &[u8], settings: &SettingsArguments) -> Result<Self, Failure> {
        let points = table::read(&String::from_utf8_lossy(bytes))
            .map_err(|error| Failure::new("LogSyntax", format!("table of points: {error}")))?;
        Ok(Self::Table(points, Box::new(super::settings(settings)?.1)))
    }

    fn axes(&self, arguments: &Steps, format: Option<Format>) -> Axes {
        let (Self::Program(_, job) | Self::Table(_, job)) = self;
        // A port drives phases: it knows full and half steps and nothing finer.
        let drives = match format {
            Some(Format::Port) => job.drives.with_microsteps(sequence(arguments).microsteps()),
            _ => job.drives,
        };
        match self {
            Self::Program(..) => Axes::polar(&drives),
            Self::Table(..) => Axes::cartesian(&drives),
        }
    }

    fn stepper(bytes: &Job, axes: &Axes) -> Result<Stepper, Failure> {
        Stepper::new(&bytes.printer, bytes.dialect, *axes).map_err(|error: NoJoints| {
            Failure::new("Usage", error.to_string())
                .hint("rhumb slice --dialect polar writes one that does")
        })
    }

    fn start(&self, axes: &Axes) -> Result<[i64; MOST_AXES], Failure> {
        Ok(match self {
            Self::Program(_, job) => Self::stepper(job, axes)?.count(),
            Self::Table(points, _) => table::intervals(points, axes).0,
        })
    }

    fn each(
        &self,
        axes: &Axes,
        mut each: impl FnMut(&Interval, Option<&Step>),
    ) -> Result<(), Failure> {
        match self {
            Self::Program(bytes, job) => {
                let mut stepper = Self::stepper(job, axes)?;
                each_line(bytes.as_slice(), |line| {
                    stepper.line(line, |step| each(&step.interval, Some(step)));
                })
            }
            Self::Table(points, _) => {
                table::intervals(points, axes).1.iter().for_each(|interval| each(interval, None));
                Ok(())
            }
        }
    }
}

fn sequence(arguments: &Steps) -> Sequence {
    match arguments.sequence {
        PhaseSequence::Full => Sequence::Full,
        PhaseSequence::Half => Sequence::Half,
    }
}

/// How pulses are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Csv,
    Binary,
    Port,
}

impl Format {
    fn of(path: &Path) -> Result<Self, Failure> {
        if path == Path::new("-") {
            return Ok(Self::Csv);
        }
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        match extension.to_str() {
            Some("csv") => Ok(Self::Csv),
            Some("bin") => Ok(Self::Binary),
            Some("lpt") => Ok(Self::Port),
            _ => Err(Failure::new(
                "Usage",
                format!("{} does not end in .csv, .bin or .lpt", path.display()),
            )
            .hint("the end of its name says in which format pulses are written")),
        }
    }
}

/// A file in one of the formats.
enum Sink<W> {
    Csv(W, Axes),
    Binary(Binary<W>),
    Port(Port<W>),
}

impl<W: Write> Sink<W> {
    fn new(
        format: Format,
        mut out: W,
        axes: &Axes,
        start: [i64; MOST_AXES],
        arguments: &Steps,
    ) -> std::io::Result<Self> {
        Ok(match format {
            Format::Csv => {
                csv::head(&mut out, axes, start)?;
                Self::Csv(out, *axes)
            }
            Format::Binary => Self::Binary(Binary::new(out, axes, start)?),
            Format::Port => Self::Port(Port::new(out, axes, sequence(arguments), start)?),
        })
    }

    fn interval(&mut self, interval: &Interval) -> std::io::Result<()> {
        match self {
            Self::Csv(out, axes) => csv::row(out, axes, interval),
            Self::Binary(binary) => binary.interval(interval),
            Self::Port(port) => port.interval(interval),
        }
    }

    fn finish(self) -> std::io::Result<()> {
        match self {
            Self::Csv(mut out, _) => out.flush(),
            Self::Binary(binary) => binary.finish(),
            Self::Port(port) => port.finish(),
        }
    }
}

fn tell(Tally { axes, report, map }: &Tally, manner: &Manner) -> Result<(), Failure> {
    let motors = || axes.names.iter().zip(&report.motors).enumerate();
    if manner.json {
        let object = |(k, (name, motor)): (usize, (&&str, &twin::steps::report::Motor))| {
            serde_json::json!({
                "axis": name,
                "unit": axes.unit(k),
                "step": axes.step_in_unit(k),
                "pulses": motor.pulses,
                "net_pulses": motor.net,
                "peak_rate_hz": motor.rate,
                "peak_rate_line": motor.rate_line,
                "worst_error_steps": motor.error,
            })
        };
        return say_json(&serde_json::json!({
            "intervals": report.intervals,
            "time_s": report.time,
            "axes": motors().map(object).collect::<Vec<_>>(),
            "bed_error": map.as_ref().map(|map| serde_json::json!({
                "worst_mm": map.worst(),
                "rms_mm": map.rms(),
            })),
        }));
    }
    let mut out = String::new();
    for (k, (name, motor)) in motors() {
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "{name:<5} {} {} a pulse: {} pulses, {} net, {:.0} a second at most (line {}), at most \
             {:.3} of a step off",
            decimal(axes.in_unit(k, axes.steps[k]), 6),
            axes.unit(k),
            motor.pulses,
            motor.net,
            motor.rate,
            motor.rate_line,
            motor.error
        );
    }
    if let Some(map) = map {
        let _ = writeln!(
            out,
            "whole steps put the nozzle {:.1} µm off at most, {:.1} µm rms",
            map.worst() * 1e3,
            map.rms() * 1e3
        );
    }
    let _ = writeln!(out, "{} intervals, {}", report.intervals, duration(report.time));
    say(&out)
}
