//! `rhumb slice`: the main job.

use std::io::{BufRead, BufReader, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};

use machine::gcode::dialect::{CARTESIAN, Space};
use machine::gcode::{Dialect, ELAPSED};
use mesh::model::Format;
use slicer::level::Snap;
use twin::verify::Verdict;

use super::{DONE, LOOK, display_name, say, say_json, settings, to_json, wish};
use crate::args::{Manner, Proof, SettingsArguments, Slice};
use crate::calibration;
use crate::check::{check, refusal};
use crate::clock;
use crate::failure::Failure;
use crate::input;
use crate::interrupt::Interrupt;
use crate::models::{Arrangement, Model};
use crate::output::{self, Output};
use crate::own;
use crate::pipeline::{self, Outcome, Request, Watch};
use crate::place::parse_place;
use crate::progress::{Bars, Progress, Silent};
use crate::report::Report;
use crate::settings::{Job, material};
use crate::stopwatch::Stopwatch;
use crate::summary;

pub(super) fn run(arguments: &Slice, manner: &Manner) -> Result<u8, Failure> {
    let mut total = Stopwatch::start();
    let mut wanted = arguments.settings.clone();
    wanted.set.extend(arguments.layers.set());
    let (settings, mut job) = settings(&wanted)?;
    material::check(&settings)?;
    job.most_cuts = arguments.effort.most_cuts * 1e6;
    job.draws_arcs = draws_arcs(arguments, &job)?;
    let wish = wish(&arguments.place)?;
    let mut arrangement = arrangement(arguments)?;
    arrangement.own = own::asked(&arguments.object, &settings)?;
    let target = target(arguments);
    let inputs: Vec<&Path> = arguments.models.iter().map(PathBuf::as_path).collect();
    let models = models(&inputs)?;
    // Until here a signal ends the process at once: a pipe may keep it waiting, and nothing is begun.
    let interrupt = Interrupt::on_signals();
    if arguments.stop_at_end_of_input {
        interrupt.raise_at_end_of_input();
    }
    let mut out = Output::create(&target, &inputs)?;
    let beside = |path: &Option<PathBuf>| path.as_deref().map(|p| Output::create(p, &inputs));
    let report_file = beside(&arguments.report).transpose()?;
    let placed_file = beside(&arguments.export_placed).transpose()?;
    let preview_file = beside(&arguments.preview_gcode).transpose()?;

    let mut progress = progress(manner);
    // A preview is a slice of its own, for which the bytes must stay.
    let again = preview_file.is_some().then(|| models.clone());
    let name = names(&inputs);
    let (mut outcome, preview_file) = {
        let mut text = BufWriter::with_capacity(1 << 16, out.file());
        let request = Request {
            model: &[],
            name: &name,
            wish,
            settings: &settings,
            job: &job,
            made_at: &clock::now(),
        };
        let watch = &mut Watch { progress: &mut *progress, interrupt: &interrupt };
        let mut outcome = pipeline::slice_all(&request, models, &arrangement, &mut text, watch)
            .map_err(|failure| about_model(failure, &inputs))?;
        outcome.warnings.extend(calibration::warning(&job.printer));
        text.flush().map_err(|error| output::failed(&target, &error))?;
        drop(text);
        if job.tells_progress {
            out = with_progress(&out, &target, &inputs, outcome.totals.time, &job.dialect)?;
        }
        let shown = preview_file.zip(again).map(|(file, models)| {
            let seen = Seen { request: &request, models, arrangement: &arrangement };
            preview(seen, &wanted, file, watch)
        });
        let shown = shown.transpose()?;
        (outcome, shown)
    };
    let verdict = if arguments.effort.no_verify {
        None
    } else {
        progress.stage("verify", 1);
        Some(proved(&out, &mut outcome, &job, arguments.effort.verify)?)
    };
    drop(progress);
    interrupt.check()?;
    if let Some(failure) = verdict.as_ref().and_then(refusal) {
        return Err(failure);
    }
    outcome.timings.total = total.lap();
    let is_written = report_file.is_some() || manner.json;
    let report = summary::report(&name, &outcome, verdict.as_ref(), &job, is_written);
    if let Some(file) = report_file {
        fill(file, to_json(&report)?.as_bytes())?;
    }
    if let Some(file) = placed_file {
        fill(file, &mesh::stl::write(pipeline::part(&outcome)))?;
    }
    if let Some(file) = preview_file {
        file.commit()?;
    }
    out.commit()?;
    tell(&report, &outcome, verdict.as_ref(), &job, &target, manner)?;
    let misses_flats = job.schedule.snap != Snap::Off && outcome.layout.missed().next().is_some();
    let needs_a_look = !report.verify.findings.is_empty() || outcome.health.guessed || misses_flats;
    Ok(if needs_a_look { LOOK } else { DONE })
}

/// The files of the models, as they are.
fn models<'a>(inputs: &[&'a Path]) -> Result<Vec<Model<'a>>, Failure> {
    let model = |&name: &&'a Path| {
        let bytes = input::read(name)?;
        Ok(Model { name, format: Format::of(name, &bytes), bytes: bytes.into() })
    };
    inputs.iter().map(model).collect()
}

/// The program with what is done and left put behind every line that says how long it has taken so far.
fn with_progress(
    plain: &Output,
    target: &Path,
    inputs: &[&Path],
    total: f64,
    dialect: &Dialect,
) -> Result<Output, Failure> {
    let mut told = Output::create(target, inputs)?;
    let mut from = BufReader::new(plain.reread()?);
    let mut to = BufWriter::with_capacity(1 << 16, told.file());
    let fail = |error| output::failed(target, &error);
    let (mut line, mut last) = (Vec::new(), None);
    while from.read_until(b'\n', &mut line).map_err(fail)? > 0 {
        to.write_all(&line).map_err(fail)?;
        if let Some(now) = elapsed(&line) {
            let done = (100.0 * now / total).clamp(0.0, 100.0) as u32;
            let left = ((total - now).max(0.0) / 60.0).round() as u64;
            if last.replace((done, left)) != Some((done, left))
                && let Some(words) = dialect.progress(done, left)
            {
                writeln!(to, "{words}").map_err(fail)?;
            }
        }
        line.clear();
    }
    to.flush().map_err(fail)?;
    drop(to);
    Ok(told)
}

/// The seconds of a line that says how long the print has taken.
fn elapsed(line: &[u8]) -> Option<f64> {
    let seconds = line.strip_prefix(ELAPSED.as_bytes())?;
    std::str::from_utf8(seconds).ok()?.trim_end().parse().ok()
}

/// What was sliced.
struct Seen<'a> {
    request: &'a Request<'a>,
    models: Vec<Model<'a>>,
    arrangement: &'a Arrangement,
}

/// The same in part coordinates.
fn preview(
    seen: Seen<'_>,
    wanted: &SettingsArguments,
    mut file: Output,
    watch: &mut Watch<'_>,
) -> Result<Output, Failure> {
    let mut wanted = wanted.clone();
    wanted.dialect = Some(CARTESIAN.name.to_owned());
    let (settings, mut job) = settings(&wanted)?;
    job.most_cuts = seen.request.job.most_cuts;
    job.draws_arcs = seen.request.job.draws_arcs;
    let request = Request { settings: &settings, job: &job, ..*seen.request };
    let mut text = BufWriter::with_capacity(1 << 16, file.file());
    pipeline::slice_all(&request, seen.models, seen.arrangement, &mut text, watch)?;
    text.flush().map_err(|error| output::failed(Path::new("preview"), &error))?;
    drop(text);
    Ok(file)
}

fn progress(manner: &Manner) -> Box<dyn Progress> {
    if manner.quiet || !std::io::stderr().is_terminal() {
        Box::new(Silent)
    } else {
        Box::new(Bars::default())
    }
}

/// Reads the program again and judges it.
fn proved(
    out: &Output,
    outcome: &mut Outcome,
    job: &Job,
    proof: Proof,
) -> Result<Verdict, Failure> {
    let mut lap = Stopwatch::start();
    let text = BufReader::new(out.reread()?);
    let full = proof == Proof::Full;
    let verdict = check(text, job, Some(pipeline::part(outcome)), full, |_| {})?;
    outcome.timings.verify = lap.lap();
    Ok(verdict)
}

/// Where the program goes: `MODEL.gcode` in the working folder unless the user says.
pub(super) fn target(arguments: &Slice) -> PathBuf {
    arguments.output.clone().unwrap_or_else(|| {
        let first = arguments.models.first().filter(|name| *name != Path::new("-"));
        let stem = first.and_then(|name| name.file_stem());
        let mut name = stem.unwrap_or("model".as_ref()).to_owned();
        name.push(".gcode");
        PathBuf::from(name)
    })
}

/// What is wrong with a model names it; other failures name what they are about.
fn about_model(failure: Failure, models: &[&Path]) -> Failure {
    match models {
        [model] if matches!(failure.exit_status(), 4 | 5 | 8) => failure.about(model),
        _ => failure,
    }
}

/// The names of the models, for people.
fn names(models: &[&Path]) -> String {
    match models {
        [] => String::new(),
        [model] => display_name(model),
        [model, others @ ..] => format!("{} and {} more", display_name(model), others.len()),
    }
}

/// Where several models are to stand.
fn arrangement(arguments: &Slice) -> Result<Arrangement, Failure> {
    let copies = usize::from(arguments.copies);
    let at = arguments.at.iter().map(|text| parse_place("--at", text));
    let at = at.collect::<Result<Vec<_>, _>>()?;
    let wanted = copies * arguments.models.len();
    if !at.is_empty() && at.len() != wanted {
        let what = format!("--at is given {} times for {wanted} parts", at.len());
        return Err(Failure::new("Usage", what));
    }
    let gap = arguments.gap;
    if !(gap.is_finite() && gap >= 0.0) {
        return Err(Failure::new("Usage", format!("--gap {gap} is below 0")));
    }
    let n_inputs = arguments.models.iter().filter(|name| *name == Path::new("-")).count();
    if n_inputs > 1 {
        return Err(Failure::new("Usage", "standard input holds one model".to_owned()));
    }
    let (file_settings, split) = (arguments.file_settings, arguments.split);
    Ok(Arrangement { at, gap, copies, own: Vec::new(), file_settings, split })
}

/// Whether runs of lines become arcs.
fn draws_arcs(arguments: &Slice, job: &Job) -> Result<bool, Failure> {
    if arguments.arcs && job.dialect.space != Space::Part {
        let name = job.dialect.name;
        let what = format!("--arcs: dialect {name} has no arcs that run as they are meant");
        let hint = match job.dialect.space {
            Space::Joints => "circles about the axis are one move anyway",
            _ => "polar firmwares cut arcs as coarsely as they like, near the axis too",
        };
        return Err(Failure::new("ConfigConflict", what).hint(hint));
    }
    Ok(arguments.arcs)
}

fn fill(mut file: Output, bytes: &[u8]) -> Result<(), Failure> {
    file.file().write_all(bytes).map_err(|error| output::failed(Path::new("report"), &error))?;
    file.commit()
}

fn tell(
    report: &Report,
    outcome: &Outcome,
    verdict: Option<&Verdict>,
    job: &Job,
    target: &Path,
    manner: &Manner,
) -> Result<(), Failure> {
    let to_standard_output = target == Path::new("-");
    if manner.json && !to_standard_output {
        return say_json(report);
    }
    if manner.quiet {
        return Ok(());
    }
    let text =
        summary::text(report, outcome, verdict, job, &target.display().to_string(), manner.verbose);
    if to_standard_output {
        // The program itself is on standard output; a summary that cannot be shown is no failure.
        let _ = std::io::stderr().lock().write_all(text.as_bytes());
        return Ok(());
    }
    say(&text)
}
