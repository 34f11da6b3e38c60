//! One model of a batch, sliced by a process of its own: whatever becomes of that, the batch goes on.

use std::ffi::{OsStr, OsString};
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use clap::{ArgMatches, CommandFactory};
use serde_json::Value;

use super::journal::Record;
use crate::args::Arguments;
use crate::failure::Failure;
use crate::interrupt::Interrupt;
use crate::stopwatch::Stopwatch;

/// How often a process is looked after.
const LOOK_AFTER: Duration = Duration::from_millis(20);

/// What the complaint of a process may be long at most, bytes: more is no complaint.
const LONGEST_COMPLAINT: u64 = 1 << 20;

/// How long a process may take to end after it was asked to, seconds.
const PATIENCE: f64 = 10.0;

/// Options of `batch` that are not options of `slice`.
const OWN_OPTIONS: &[&str] = &["models", "out_dir", "jobs", "shard", "time_limit"];

/// What the command line says about slicing, word by word as `slice` takes it.
pub(super) fn slice_options() -> Vec<OsString> {
    let command = Arguments::command();
    let Ok(matches) = command.clone().try_get_matches_from(std::env::args_os()) else {
        return Vec::new();
    };
    match (matches.subcommand_matches("batch"), command.find_subcommand("batch")) {
        (Some(given), Some(batch)) => options_of(given, batch),
        _ => Vec::new(),
    }
}

fn options_of(given: &ArgMatches, command: &clap::Command) -> Vec<OsString> {
    let mut words = Vec::new();
    for id in given.ids().map(clap::Id::as_str) {
        let was_typed = given.value_source(id) == Some(clap::parser::ValueSource::CommandLine);
        if !was_typed || OWN_OPTIONS.contains(&id) {
            continue;
        }
        let option = command.get_arguments().find(|argument| argument.get_id() == id);
        // Groups have ids too, and nothing to type.
        let Some((option, long)) = option.and_then(|o| Some((o, o.get_long()?))) else { continue };
        if !option.get_action().takes_values() {
            words.push(format!("--{long}").into());
            continue;
        }
        for value in given.get_raw(id).into_iter().flatten() {
            let mut word = OsString::from(format!("--{long}="));
            word.push(value);
            words.push(word);
        }
    }
    words
}

/// A model to slice.
pub(super) struct Task<'a> {
    pub(super) model: &'a Path,
    pub(super) program: &'a Path,
    pub(super) report: &'a Path,
    pub(super) options: &'a [OsString],
    pub(super) threads: Option<u16>,
    /// Seconds after which it is given up; infinity for never.
    pub(super) time_limit: f64,
}

impl Task<'_> {
    /// Slices the model and says how it went.
    ///
    /// # Errors
    ///
    /// `Interrupted`; what goes wrong with the model is in the record.
    pub(super) fn run(&self, fingerprint: &str, interrupt: &Interrupt) -> Result<Record, Failure> {
        let clock = Stopwatch::start();
        let ended = self.start().and_then(|child| self.wait(child, &clock, interrupt));
        interrupt.check()?;
        let mut record = Record {
            model: self.model.to_string_lossy().into_owned(),
            program: self.program.to_string_lossy().into_owned(),
            fingerprint: fingerprint.to_owned(),
            seconds: clock.seconds(),
            ..Record::default()
        };
        match ended {
            Ok(Ended { status, .. }) if status.code().is_some_and(|code| code <= 1) => {
                record.status = status.code().map_or(0, |code| code as u8);
                record.read_report(self.report);
            }
            Ok(Ended { status, complaint }) => record.complain(&failure_of(status, &complaint)),
            Err(failure) => record.complain(&failure),
        }
        Ok(record)
    }

    fn start(&self) -> Result<Child, Failure> {
        let not_started = |error: std::io::Error| {
            Failure::new("Unreadable", format!("a process for it cannot be started: {error}"))
        };
        let rhumb = std::env::current_exe().map_err(not_started)?;
        Command::new(rhumb)
            .args(["slice", "--quiet", "--error-format", "json", "--stop-at-end-of-input"])
            .arg(flag("--output=", self.program))
            .arg(flag("--report=", self.report))
            .args(self.threads.map(|threads| format!("--threads={threads}")))
            .args(self.options)
            .arg("--")
            .arg(self.model)
            // Nothing is ever said there; it ends when the batch does, killed or not.
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(not_started)
    }

    fn wait(
        &self,
        mut child: Child,
        clock: &Stopwatch,
        interrupt: &Interrupt,
    ) -> Result<Ended, Failure> {
        // A process that says much would wait for a reader.
        let complaint = child.stderr.take().map(|pipe| {
            std::thread::spawn(move || {
                let mut text = Vec::new();
                let _ = pipe.take(LONGEST_COMPLAINT).read_to_end(&mut text);
                text
            })
        });
        let mut is_late = false;
        let mut asked = None;
        let status = loop {
            let ended = child.try_wait().map_err(|error| {
                Failure::new("Unreadable", format!("its process is lost: {error}"))
            })?;
            if let Some(status) = ended {
                break status;
            }
            let now = clock.seconds();
            is_late |= now > self.time_limit;
            match asked {
                None if is_late || interrupt.check().is_err() => {
                    ask_to_end(&mut child);
                    asked = Some(now);
                }
                Some(asked) if now > asked + PATIENCE => drop(child.kill()),
                _ => {}
            }
            std::thread::sleep(LOOK_AFTER);
        };
        if is_late {
            let limit = self.time_limit;
            return Err(Failure::new("LimitExceeded", format!("took over {limit} s"))
                .hint("--time-limit SECONDS allows more"));
        }
        let complaint = complaint.and_then(|reader| reader.join().ok()).unwrap_or_default();
        Ok(Ended { status, complaint })
    }
}

struct Ended {
    status: ExitStatus,
    complaint: Vec<u8>,
}

fn flag(name: &str, value: &Path) -> OsString {
    let mut word = OsString::from(name);
    word.push::<&OsStr>(value.as_ref());
    word
}

/// Asks a process to end and to clear away what it has begun.
fn ask_to_end(child: &mut Child) {
    #[cfg(unix)]
    if let Some(process) = i32::try_from(child.id()).ok().and_then(rustix::process::Pid::from_raw) {
        // One that has just ended needs no asking.
        let _ = rustix::process::kill_process(process, rustix::process::Signal::TERM);
    }
    #[cfg(not(unix))]
    drop(child.kill());
}

/// What a process says went wrong.
fn failure_of(status: ExitStatus, complaint: &[u8]) -> Failure {
    let said = String::from_utf8_lossy(complaint);
    let said = said.lines().rev().find_map(|line| serde_json::from_str::<Value>(line).ok());
    let part =
        |name: &str| said.as_ref().and_then(|said| said["error"][name].as_str()).map(str::to_owned);
    let known = part("class").and_then(|class| Failure::known_class(&class));
    match (known, part("message")) {
        (Some(class), Some(message)) => {
            let failure = Failure::new(class, message);
            match part("hint") {
                Some(hint) => failure.hint(hint),
                None => failure,
            }
        }
        // Killed, by the system for want of memory as a rule.
        _ => Failure::new("Bug", format!("its process was cut off: {status}"))
            .hint("where memory is short, fewer --jobs take less"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_typed_for_slicing_is_handed_on_and_nothing_else() {
        let line = [
            "rhumb",
            "batch",
            "a.stl",
            "b.stl",
            "--out-dir",
            "out",
            "--jobs",
            "2",
            "--set",
            "perimeters=3",
            "--set=fill_density=40%",
            "--layers",
            "conical",
            "--cone-angle",
            "-20",
            "--no-verify",
            "--json",
            "--threads",
            "1",
        ];
        let command = Arguments::command();
        let matches = command.clone().try_get_matches_from(line).unwrap();
        let given = matches.subcommand_matches("batch").unwrap();
        let words = options_of(given, command.find_subcommand("batch").unwrap());
        let mut words: Vec<&str> = words.iter().filter_map(|word| word.to_str()).collect();
        words.sort_unstable();
        assert_eq!(
            words,
            [
                "--cone-angle=-20",
                "--layers=conical",
                "--no-verify",
                "--set=fill_density=40%",
                "--set=perimeters=3",
            ]
        );
    }
}
