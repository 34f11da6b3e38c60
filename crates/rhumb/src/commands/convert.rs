//! `rhumb convert`: any slicer's Cartesian program for a polar machine.

use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Cursor, Write};
use std::path::{Path, PathBuf};

use machine::head::Head;
use nalgebra::Vector2;
use twin::verify::Verdict;

use super::{DONE, LOOK, display_name, say, say_json, settings};
use crate::args::{Convert, Manner};
use crate::check::{findings, refusal_of_converted};
use crate::clock;
use crate::convert::{Converted, Request, convert, convert_checked, middle};
use crate::failure::Failure;
use crate::input;
use crate::interrupt::Interrupt;
use crate::output::{self, Output};
use crate::place::parse_centre;
use crate::program_text::duration;
use crate::report::SlowFlow;
use crate::settings::Job;

pub(super) fn run(arguments: &Convert, manner: &Manner) -> Result<u8, Failure> {
    let job = upright(settings(&arguments.settings)?.1);
    let source = Source::open(&arguments.program)?;
    // Until here a signal ends the process at once: a pipe may keep it waiting, and nothing is begun.
    let interrupt = Interrupt::on_signals();
    let name = display_name(&arguments.program);
    let origin = match arguments.origin.as_str() {
        "auto" => middle(source.reader()?, &name)?,
        place => parse_centre(place)?.coords,
    };
    let target = target(arguments);
    let mut out = Output::create(&target, &[arguments.program.as_path()])?;
    let made_at = clock::now();
    let keeps_dangerous = arguments.allow_dangerous;
    let request = Request { name: &name, origin, job: &job, keeps_dangerous, made_at: &made_at };
    let (converted, verdict) = {
        let mut text = BufWriter::with_capacity(1 << 16, out.file());
        let done = if arguments.no_verify {
            (convert(&request, source.reader()?, &mut text, &interrupt)?, None)
        } else {
            let (converted, verdict) =
                convert_checked(&request, source.reader()?, &mut text, &interrupt)?;
            (converted, Some(verdict))
        };
        text.flush().map_err(|error| output::failed(&target, &error))?;
        done
    };
    interrupt.check()?;
    if let Some(failure) = verdict.as_ref().and_then(refusal_of_converted) {
        return Err(failure);
    }
    out.commit()?;
    let slow = SlowFlow::of(&converted.slow_flow, job.plan.filament.least_flow);
    tell(&converted, slow.as_ref(), verdict.as_ref(), (&origin, &target), manner)?;
    let is_clean = verdict.is_none_or(|verdict| verdict.findings.is_empty());
    Ok(if is_clean && converted.left_out == 0 { DONE } else { LOOK })
}

/// A head on the carriage keeps its nozzle upright: programs of others say nothing of tilts, and with all of
/// them at zero its words are those of a printer without a head.
fn upright(mut job: Job) -> Job {
    job.printer.head = job.printer.head.filter(|head| !matches!(head, Head::Tilting(_)));
    job
}

/// A program that can be read from its begin more than once.
enum Source {
    File(PathBuf),
    /// Standard input and what else cannot be read twice.
    Bytes(Vec<u8>),
}

impl Source {
    fn open(path: &Path) -> Result<Self, Failure> {
        let is_file = std::fs::metadata(path).is_ok_and(|metadata| metadata.is_file());
        Ok(if is_file { Self::File(path.to_owned()) } else { Self::Bytes(input::read(path)?) })
    }

    fn reader(&self) -> Result<Box<dyn BufRead + Send + '_>, Failure> {
        match self {
            Self::File(path) => {
                let file = File::open(path).map_err(|error| {
                    let class = match error.kind() {
                        std::io::ErrorKind::NotFound => "NotFound",
                        std::io::ErrorKind::PermissionDenied => "PermissionDenied",
                        _ => "Unreadable",
                    };
                    Failure::new(class, format!("{}: {error}", path.display()))
                })?;
                Ok(Box::new(BufReader::with_capacity(1 << 18, file)))
            }
            Self::Bytes(bytes) => Ok(Box::new(Cursor::new(bytes.as_slice()))),
        }
    }
}

/// Where the program goes: `IN.polar.gcode` in the working folder unless the user says.
pub(super) fn target(arguments: &Convert) -> PathBuf {
    arguments.output.clone().unwrap_or_else(|| {
        let stem = arguments.program.file_stem().filter(|_| arguments.program != Path::new("-"));
        let mut name = stem.unwrap_or("program".as_ref()).to_owned();
        name.push(".polar.gcode");
        PathBuf::from(name)
    })
}

fn tell(
    converted: &Converted,
    slow: Option<&SlowFlow>,
    verdict: Option<&Verdict>,
    (origin, target): (&Vector2<f64>, &Path),
    manner: &Manner,
) -> Result<(), Failure> {
    if target == Path::new("-") || manner.quiet && !manner.json {
        return Ok(());
    }
    let Converted { lines, written, filament, time, left_out, ref concerns, .. } = *converted;
    if manner.json {
        return say_json(&serde_json::json!({
            "lines": lines,
            "written": written,
            "filament_mm": filament,
            "time_s": time,
            "left_out": left_out,
            "slow_flow": slow,
            "warnings": concerns.iter().map(|concern| serde_json::json!({
                "code": concern.code,
                "line": concern.line,
                "count": concern.count,
                "message": concern.to_string(),
            })).collect::<Vec<_>>(),
            "origin_mm": [origin.x, origin.y],
            "verify": verdict.map(|verdict| serde_json::json!({"findings": findings(verdict)})),
        }));
    }
    let mut text = format!(
        "{lines} lines became {written}, {:.2} m of filament, about {}\n",
        filament / 1000.0,
        duration(time)
    );
    if left_out > 0 {
        text.push_str(&format!(
            "{left_out} commands are longer than firmwares read and were left out\n"
        ));
    }
    if let Some(slow) = slow {
        text.push_str(&format!("slow flow  {slow}\n"));
    }
    for concern in concerns {
        text.push_str(&format!("{concern}\n"));
    }
    for finding in verdict.iter().flat_map(|verdict| &verdict.findings) {
        text.push_str(&format!("{finding}\n"));
    }
    text.push_str(&format!("written  {}\n", display_name(target)));
    say(&text)
}
