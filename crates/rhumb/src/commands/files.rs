//! Which files a command reads and which it writes, so that it can be refused before any work when
//! one would overwrite another.

use std::path::{Path, PathBuf};

use super::{convert, slice};
use crate::args::{Calibrate, Command, SettingsArguments};
use crate::failure::Failure;
use crate::output::keep_apart;

/// Refuses a command that would overwrite what it reads, or write two things to one file.
///
/// # Errors
///
/// `OutputIsInput`, `OutputTwice`, or what [`crate::output::Output::create`] says of a target.
pub(super) fn check(command: &Command) -> Result<(), Failure> {
    let files = Files::of(command);
    let inputs: Vec<&Path> = files.inputs.iter().map(PathBuf::as_path).collect();
    let outputs: Vec<&Path> = files.outputs.iter().map(PathBuf::as_path).collect();
    keep_apart(&inputs, &outputs)
}

#[derive(Default)]
struct Files {
    inputs: Vec<PathBuf>,
    outputs: Vec<PathBuf>,
}

impl Files {
    fn of(command: &Command) -> Self {
        let files = Self::default();
        match command {
            Command::Slice(a) => files
                .reads(&a.models)
                .reads_settings(&a.settings)
                .writes([&slice::target(a)])
                .writes(a.report.iter().chain(&a.export_placed).chain(&a.preview_gcode)),
            Command::Orient(a) => {
                files.reads([&a.model]).reads_settings(&a.settings).writes(&a.output)
            }
            Command::Convert(a) => {
                files.reads([&a.program]).reads_settings(&a.settings).writes([&convert::target(a)])
            }
            Command::Preview(a) => files
                .reads([&a.program])
                .reads(&a.model)
                .reads_settings(&a.settings)
                .writes([&a.output]),
            Command::Steps(a) => files
                .reads(&a.program)
                .reads_settings(&a.settings)
                .writes(a.output.iter().chain(&a.picture)),
            Command::Motor(a) => files.writes(&a.output),
            Command::Curve(a) => files.writes(a.output()),
            Command::Model(a) => files.writes(&a.output),
            Command::Calibrate(calibrate) => files.of_calibration(calibrate),
            // Its outputs are looked at by each slice.
            Command::Batch(a) => files.reads_settings(&a.settings),
            Command::Inspect(_)
            | Command::Verify(_)
            | Command::Send(_)
            | Command::Profile(_)
            | Command::Completions(_) => files,
        }
    }

    fn of_calibration(self, calibrate: &Calibrate) -> Self {
        match calibrate {
            Calibrate::Fit(a) => {
                self.reads([&a.log]).reads(&a.pins).writes(a.output.iter().chain(&a.picture))
            }
            Calibrate::Scan(a) => self
                .reads(&a.pins)
                .reads_settings(&a.settings)
                .writes(a.output.iter().chain(&a.log).chain(&a.picture)),
            // Its calibration may be brought up to date in place.
            Calibrate::Pins(a) => self.reads(&a.readings).writes(&a.output),
            Calibrate::Pivot(a) => self.reads(&a.log).writes(&a.output),
            Calibrate::Show(a) => self.reads([&a.file]).writes(&a.picture),
        }
    }

    fn reads<'a>(mut self, paths: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        self.inputs.extend(paths.into_iter().cloned());
        self
    }

    fn reads_settings(mut self, settings: &SettingsArguments) -> Self {
        // A built-in name is no file; where one of that name lies about, it is not read.
        let names = [&settings.printer, &settings.material, &settings.print];
        let is_path = |name: &&String| name.contains(std::path::is_separator) || name.contains('.');
        self.inputs.extend(names.into_iter().flatten().filter(is_path).map(PathBuf::from));
        self.reads(&settings.calibration)
    }

    fn writes<'a>(mut self, paths: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        self.outputs.extend(paths.into_iter().cloned());
        self
    }
}
