//! What of a batch is done: a line of JSON for each model, written as soon as it is known.
//!
//! A batch that was cut off is taken up where it stopped: a model is done when the journal says so,
//! for the same bytes and the same settings, and its program is still there. A line that was cut off
//! itself, or is no line of ours, counts for nothing.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::failure::Failure;
use crate::output;

/// How the slice of one model ended.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    /// The model, as it was named.
    pub(super) model: String,
    /// Its program.
    pub(super) program: String,
    /// Of the model's bytes and all settings.
    pub(super) fingerprint: String,
    /// The exit status of its slice.
    pub(super) status: u8,
    /// Why there is no program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) error: Option<Complaint>,
    /// Estimated time of the print, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) time_s: Option<f64>,
    /// Weight of its filament, g.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) filament_g: Option<f64>,
    /// What the user should know.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) warnings: Vec<String>,
    /// How long slicing took, s.
    pub(super) seconds: f64,
}

/// Why there is no program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Complaint {
    pub(super) class: String,
    pub(super) message: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) hint: Option<String>,
}

impl Record {
    /// Whether there is a program.
    pub(super) fn is_done(&self) -> bool {
        self.status <= 1
    }

    /// Puts down why there is none.
    pub(super) fn complain(&mut self, failure: &Failure) {
        self.status = failure.exit_status();
        self.error = Some(Complaint {
            class: failure.class().to_owned(),
            message: failure.message().to_owned(),
            hint: failure.advice().map(str::to_owned),
        });
    }

    /// Takes over what the report of a slice says in few words; one that cannot be read is no loss
    /// of the program.
    pub(super) fn read_report(&mut self, report: &Path) {
        let Ok(file) = File::open(report) else { return };
        let Ok(report) = serde_json::from_reader::<_, Value>(BufReader::new(file)) else { return };
        self.time_s = report["print"]["time_s"].as_f64();
        self.filament_g = report["print"]["filament_g"].as_f64();
        let warnings = report["warnings"].as_array();
        self.warnings = warnings
            .into_iter()
            .flatten()
            .filter_map(|warning| warning["message"].as_str().map(str::to_owned))
            .collect();
    }
}

/// The file.
pub(super) struct Journal {
    path: PathBuf,
    file: File,
    /// The last of each program.
    done: BTreeMap<String, Record>,
}

impl Journal {
    /// Opens a journal, and reads what is in it.
    ///
    /// # Errors
    ///
    /// `OutputDenied` and its like.
    pub(super) fn open(path: PathBuf) -> Result<Self, Failure> {
        let failed = |error: &io::Error| output::failed(&path, error);
        let old = match std::fs::read(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            old => old.map_err(|error| failed(&error))?,
        };
        let lines = old.split(|&byte| byte == b'\n');
        let done = lines
            .filter_map(|line| serde_json::from_slice::<Record>(line).ok())
            .map(|record| (record.program.clone(), record))
            .collect();
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&path)
            .map_err(|error| failed(&error))?;
        if old.last().is_some_and(|&byte| byte != b'\n') {
            // What was cut off must not spoil the next line.
            file.write_all(b"\n").map_err(|error| failed(&error))?;
        }
        Ok(Self { path, file, done })
    }

    /// What was found out earlier about this program, if nothing has changed since and it is there.
    pub(super) fn found(&self, program: &Path, fingerprint: &str) -> Option<&Record> {
        let last = self.done.get(&*program.to_string_lossy())?;
        let is_same = last.is_done() && last.fingerprint == fingerprint && program.is_file();
        is_same.then_some(last)
    }

    /// Adds a line.
    ///
    /// # Errors
    ///
    /// `OutputFull` and its like.
    pub(super) fn add(&mut self, record: &Record) -> Result<(), Failure> {
        let failed = |error: io::Error| output::failed(&self.path, &error);
        let mut line =
            serde_json::to_vec(record).map_err(|error| Failure::new("Bug", error.to_string()))?;
        line.push(b'\n');
        self.file.write_all(&line).map_err(failed)?;
        self.file.sync_data().map_err(failed)
    }
}
