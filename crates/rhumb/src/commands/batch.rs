//! `rhumb batch`: many models, one after the other or some at the same time.
//!
//! Every model is sliced by a process of its own, so that nothing that a model does stops the others
//! and memory is that of the models under way. What is done is written to a [`journal`] as soon as it
//! is; the same command, given again, goes on from there.

mod child;
mod journal;

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::Serialize;

use self::child::{Task, slice_options};
use self::journal::{Journal, Record};
use super::{DONE, say, say_json, settings, to_json, wish, write_file};
use crate::args::{Batch, Manner};
use crate::failure::Failure;
use crate::input;
use crate::interrupt::Interrupt;
use crate::settings::{KEYS, Settings, material};

/// What models are called, in folders.
const ENDINGS: &[&str] = &["stl", "3mf", "obj"];

/// The report.
#[derive(Serialize)]
struct Report<'a> {
    rhumb: &'static str,
    /// Models with a program.
    done: usize,
    /// Of them, those whose program needs a look.
    need_a_look: usize,
    /// Models without.
    failed: usize,
    /// In the order of the command line.
    models: &'a [Record],
}

pub(super) fn run(arguments: &Batch, manner: &Manner) -> Result<u8, Failure> {
    let interrupt = Interrupt::on_signals();
    let mut wanted = arguments.settings.clone();
    wanted.set.extend(arguments.layers.set());
    // A setting that is wrong is wrong for all models.
    let (settings, _) = settings(&wanted)?;
    material::check(&settings)?;
    wish(&arguments.place)?;
    let shard = Shard::parse(arguments.shard.as_deref())?;
    let models = shard.of(models(&arguments.models)?);
    let programs = programs(&models, &arguments.out_dir)?;
    fs::create_dir_all(&arguments.out_dir)
        .map_err(|error| crate::output::failed(&arguments.out_dir, &error))?;
    let batch = Work {
        arguments,
        options: slice_options(),
        threads: manner.threads,
        job: fingerprint(&settings, arguments.settings.calibration.as_deref())?,
        interrupt: &interrupt,
        journal: Mutex::new(Journal::open(
            arguments.out_dir.join(format!("batch{}.jsonl", shard.suffix())),
        )?),
        is_told: !(manner.quiet || manner.json),
    };
    let records = batch.all(&models, &programs).map_err(stopped)?;
    let done = records.iter().filter(|record| record.is_done()).count();
    let report = Report {
        rhumb: env!("CARGO_PKG_VERSION"),
        done,
        need_a_look: records.iter().filter(|record| record.status == super::LOOK).count(),
        failed: records.len() - done,
        models: &records,
    };
    let target = arguments.out_dir.join(format!("batch{}.json", shard.suffix()));
    write_file(&target, &[], to_json(&report)?.as_bytes())?;
    if manner.json {
        say_json(&report)?;
    } else if !manner.quiet {
        say(&summary(&report, &target))?;
    }
    Ok(records.iter().map(|record| record.status).max().unwrap_or(DONE))
}

/// A stop as it is for many models: each that was finished has its program.
fn stopped(failure: Failure) -> Failure {
    if failure.class() != "Interrupted" {
        return failure;
    }
    Failure::new("Interrupted", "stopped on request; what was finished is kept")
        .hint("the same command goes on where this one stopped")
}

/// The models that are meant, folders replaced by what is in them.
fn models(named: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut models = Vec::new();
    for path in named {
        if !path.is_dir() {
            can_be_read_again(path)?;
            models.push(path.clone());
            continue;
        }
        let unreadable = |error| input::unreadable(path, &error);
        let mut inside = Vec::new();
        for entry in fs::read_dir(path).map_err(unreadable)? {
            inside.push(entry.map_err(unreadable)?.path());
        }
        let is_model = |file: &PathBuf| {
            let ending = file.extension().and_then(|ending| ending.to_str());
            ending.is_some_and(|ending| ENDINGS.iter().any(|e| e.eq_ignore_ascii_case(ending)))
                && file.is_file()
        };
        inside.retain(is_model);
        // The order of a folder is the file system's own.
        inside.sort();
        models.extend(inside);
    }
    if models.is_empty() {
        return Err(Failure::new("NotFound", "there is no model in what was named").hint(format!(
            "in folders, files that end with .{} are taken",
            ENDINGS.join(" or .")
        )));
    }
    Ok(models)
}

/// Refuses pipes and devices: a model is read to see whether it has changed, and again to be sliced.
fn can_be_read_again(path: &Path) -> Result<(), Failure> {
    if fs::metadata(path).is_ok_and(|metadata| !metadata.is_file()) {
        let what = format!("{} is no file that can be read twice", path.display());
        return Err(Failure::new("NotRegularFile", what).hint("slice it by itself"));
    }
    Ok(())
}

/// Where the program of each model goes.
fn programs(models: &[PathBuf], folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let mut taken: BTreeMap<PathBuf, &Path> = BTreeMap::new();
    let mut programs = Vec::new();
    for model in models {
        let mut name = model.file_stem().unwrap_or("model".as_ref()).to_owned();
        name.push(".gcode");
        let program = folder.join(name);
        if let Some(other) = taken.insert(program.clone(), model) {
            return Err(Failure::new(
                "OutputTwice",
                format!(
                    "{} and {} would both be {}",
                    other.display(),
                    model.display(),
                    program.display()
                ),
            )
            .hint("give models of one name in batches of their own, each with its --out-dir"));
        }
        programs.push(program);
    }
    Ok(programs)
}

/// One share of the models.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Shard {
    /// From 0.
    index: usize,
    count: usize,
}

impl Shard {
    fn parse(text: Option<&str>) -> Result<Self, Failure> {
        let Some(text) = text else { return Ok(Self { index: 0, count: 1 }) };
        text.split_once('/')
            .and_then(|(k, n)| Some((k.parse::<usize>().ok()?, n.parse::<usize>().ok()?)))
            .filter(|(k, n)| (1..=*n).contains(k))
            .map(|(k, n)| Self { index: k - 1, count: n })
            .ok_or_else(|| {
                Failure::new("Usage", format!("--shard {text:?} is not K/N with K from 1 to N"))
            })
    }

    fn of(self, models: Vec<PathBuf>) -> Vec<PathBuf> {
        models.into_iter().skip(self.index).step_by(self.count).collect()
    }

    /// What tells the files of shares apart.
    fn suffix(self) -> String {
        if self.count == 1 {
            String::new()
        } else {
            format!("-{}-of-{}", self.index + 1, self.count)
        }
    }
}

/// A number for all that decides about a program but the model. Another version of rhumb, or of its
/// compiler, may number otherwise: then it is sliced again.
fn fingerprint(settings: &Settings, calibration: Option<&Path>) -> Result<DefaultHasher, Failure> {
    let mut hasher = DefaultHasher::new();
    env!("CARGO_PKG_VERSION").hash(&mut hasher);
    for key in KEYS {
        key.name.hash(&mut hasher);
        settings.get(key).0.to_string().hash(&mut hasher);
    }
    if let Some(path) = calibration {
        input::read(path)?.hash(&mut hasher);
    }
    Ok(hasher)
}

/// A batch under way.
struct Work<'a> {
    arguments: &'a Batch,
    options: Vec<OsString>,
    threads: Option<u16>,
    job: DefaultHasher,
    interrupt: &'a Interrupt,
    journal: Mutex<Journal>,
    /// Whether each model is told as it ends.
    is_told: bool,
}

impl Work<'_> {
    /// Slices all models; the records are in their order.
    fn all(&self, models: &[PathBuf], programs: &[PathBuf]) -> Result<Vec<Record>, Failure> {
        let next = AtomicUsize::new(0);
        let worker = || -> Result<Vec<(usize, Record)>, Failure> {
            let mut records = Vec::new();
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let (Some(model), Some(program)) = (models.get(index), programs.get(index)) else {
                    return Ok(records);
                };
                records.push((index, self.one(model, program)?));
            }
        };
        let shares: Vec<Result<Vec<(usize, Record)>, Failure>> = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..self.arguments.jobs).map(|_| scope.spawn(worker)).collect();
            let lost = || Failure::new("Bug", "a thread of the batch was lost");
            workers.into_iter().map(|worker| worker.join().map_err(|_| lost())?).collect()
        });
        let mut records = Vec::with_capacity(models.len());
        for share in shares {
            records.extend(share?);
        }
        records.sort_by_key(|(index, _)| *index);
        Ok(records.into_iter().map(|(_, record)| record).collect())
    }

    /// Slices a model, unless that has been done.
    fn one(&self, model: &Path, program: &Path) -> Result<Record, Failure> {
        self.interrupt.check()?;
        let report = program.with_extension("json");
        let task = Task {
            model,
            program,
            report: &report,
            options: &self.options,
            threads: self.threads,
            time_limit: self.arguments.time_limit.unwrap_or(f64::INFINITY),
        };
        let mut hasher = self.job.clone();
        self.options.hash(&mut hasher);
        // What cannot be read is for the slice to say.
        input::read(model).unwrap_or_default().hash(&mut hasher);
        let fingerprint = format!("{:016x}", hasher.finish());
        if let Some(record) = self.journal()?.found(program, &fingerprint) {
            return Ok(record.clone());
        }
        let record = task.run(&fingerprint, self.interrupt)?;
        self.journal()?.add(&record)?;
        if self.is_told {
            // Nobody to tell is no reason to stop.
            let _ = std::io::stderr().lock().write_all(line(&record).as_bytes());
        }
        Ok(record)
    }

    fn journal(&self) -> Result<std::sync::MutexGuard<'_, Journal>, Failure> {
        self.journal.lock().map_err(|_| Failure::new("Bug", "the journal of the batch was lost"))
    }
}

/// A model in one line.
fn line(record: &Record) -> String {
    let how = match (&record.error, record.time_s) {
        (Some(error), _) => {
            // The model is named in front of the line already.
            let named = format!("{}: ", record.model);
            let message = error.message.strip_prefix(&named).unwrap_or(&error.message);
            format!("error[{}]: {message}", error.class)
        }
        (None, Some(time)) => {
            let grams = record.filament_g.unwrap_or_default();
            let look = if record.status == DONE { "" } else { ", needs a look" };
            format!("{}, {grams:.2} g{look}", crate::program_text::duration(time))
        }
        (None, None) => "done".to_owned(),
    };
    let how: String = how.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
    format!("{}: {how}\n", record.model.escape_debug())
}

fn summary(report: &Report<'_>, target: &Path) -> String {
    let mut text = String::new();
    // Writing to a text never fails.
    let _ = write!(text, "{} done", report.done);
    if report.need_a_look > 0 {
        let _ = write!(text, ", {} of them with something to look at", report.need_a_look);
    }
    let _ = writeln!(text, ", {} failed; report in {}", report.failed, target.display());
    for record in report.models.iter().filter(|record| !record.is_done()) {
        text.push_str("  ");
        text.push_str(&line(record));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_disjoint_and_together_everything() {
        let models: Vec<PathBuf> = (0..11).map(|k| PathBuf::from(format!("{k}.stl"))).collect();
        let mut all: Vec<PathBuf> = Vec::new();
        for k in 1..=3 {
            let share = Shard::parse(Some(&format!("{k}/3"))).unwrap();
            assert_eq!(share.suffix(), format!("-{k}-of-3"));
            all.extend(share.of(models.clone()));
        }
        all.sort_by_key(|path| models.iter().position(|model| model == path));
        assert_eq!(all, models);
        for wrong in ["0/3", "4/3", "1", "a/b", "-1/2", "1/0"] {
            assert_eq!(Shard::parse(Some(wrong)).unwrap_err().class(), "Usage", "{wrong}");
        }
    }

    #[test]
    fn models_of_one_name_are_refused() {
        let models = ["a/part.stl", "b/part.STL"].map(PathBuf::from);
        let failure = programs(&models, Path::new("out")).unwrap_err();
        assert_eq!(failure.class(), "OutputTwice");
    }
}
